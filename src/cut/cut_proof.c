/* Proofs that patches fit together. A cut fits together where each face at the border of one of its
 * patches has the tets that it has in a level as a whole: inner faces two, one on each side, faces
 * of the boundary one. (Levels may differ: where a flat tet at the boundary goes, the face behind
 * it is boundary from then on.) So faces are matched once, over the whole model; afterwards a cut
 * is proved by counting numbers, without a mesh being made. */
#include "cut/cut_proof.h"

#include "base/base_predicates.h"
#include "base/base_vec.h"
#include "cut/cut_keys.h"
#include "mesh/mesh.h"

#include <stdlib.h>
#include <string.h>

/* Patches decoded between two steps that one thread takes. */
#define ROUND_PATCHES ((size_t)256)
/* Tets on a side of a face are counted in 8 bits, up to this. */
#define SIDE_MOST 255u

/* What a face has in another level than the first. */
typedef struct other {
    uint32_t face;
    uint16_t count;
} other;

/* What a patch adds to a mesh. */
typedef struct facts {
    size_t first_side, side_count; /* its faces at the border */
    tli_proof_sums sums;
} facts;

struct tli_proof {
    tl_ctx *ctx;
    const tl_store *store;
    const tl_store_head *head;
    facts *patches;  /* [patch count] */
    uint32_t *sides; /* [side_count] 2 * face + side; all patches one after another */
    size_t side_count, side_capacity;
    uint16_t *expected; /* [face_count] tets on both sides, in the first level that has the face */
    uint32_t face_count;
    other *others; /* [other_count] those of further levels that differ, by face */
    size_t other_count, other_capacity;
    tli_proof_level *levels; /* [level count] */
};

/* A decoded patch on its way into the table. */
typedef struct raw {
    tl_patch *patch;
    uint64_t *values; /* [vert_count] what the values of a vertex hash to */
} raw;

typedef struct builder {
    tl_ctx *ctx;
    tl_store *store;
    tli_proof *proof;
    const uint32_t *ids; /* [count] patches of this round */
    size_t count;
    raw *raws; /* [ROUND_PATCHES] */
    tli_keys places, faces;
    /* [place_capacity] by number of the place: the vertex it was last, and what that is told by */
    uint32_t *verts, *vert_levels;
    uint64_t *vert_values;
    size_t place_capacity;
    uint32_t vert_count; /* vertices told apart so far */
    uint32_t *local;     /* [65,536] vertex for each of a patch */
    uint32_t *leaves;    /* [leaf_count] patches without producer of the levels so far */
    size_t leaf_count;
} builder;

/* Face i of a tet by its vertices in rising order; *side: which way its normal points. numbers:
 * those of the patch's vertices, or NULL for their places in the patch. */
static void face_of(const uint32_t *numbers, const uint16_t *tet, unsigned i, int64_t key[3],
                    unsigned *side)
{
    unsigned turns = 0;
    for (int k = 0; k < 3; k++) {
        const uint16_t v = tet[tli_tet_faces[i][k]];
        const int64_t vert = numbers ? numbers[v] : v;
        int at = k;
        for (; at && key[at - 1] > vert; at--, turns++) key[at] = key[at - 1];
        key[at] = vert;
    }
    *side = turns & 1;
}

/* ---- decoding, on all threads ---- */

static uint64_t mix(uint64_t hash, uint64_t value)
{
    hash = (hash ^ value) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 32;
}

static tl_status hash_values(tl_ctx *ctx, const builder *b, uint32_t id, raw *r)
{
    tl_status st = TL_OK;
    const tl_store_head *head = b->proof->head;
    const uint32_t verts = r->patch->vert_count;
    r->values = tl_mem_zalloc(ctx, verts, sizeof *r->values, &st);
    for (uint32_t c = 0; !st && c < head->channel_count; c++) {
        const uint32_t k = head->channels[c].components;
        if (head->channels[c].on != TL_ON_VERTEX) continue;
        int64_t *images = tl_mem_alloc(ctx, verts, k * sizeof *images, &st);
        if (!st) st = tl_store_channel_images(ctx, b->store, id, r->patch, c, images);
        for (size_t i = 0; !st && i < (size_t)verts * k; i++)
            r->values[i / k] = mix(r->values[i / k], (uint64_t)images[i]);
        tl_mem_free(ctx, images);
    }
    return st;
}

/* Sides of faces inside of a patch that have both tets on one side, as where the reader has turned
 * an inverted tet. What lies between shared vertices is told of by add_faces. */
static uint64_t count_odd_inside(const tl_patch *patch)
{
    uint64_t count = 0;
    for (uint32_t t = 0; t < patch->tet_count; t++)
        for (unsigned i = 0; i < 4; i++) {
            const uint32_t o = patch->opposite[t][i];
            int64_t key[3];
            unsigned sides[2];
            if (o == TL_NONE || o / 4 < t) continue;
            face_of(NULL, patch->tets[t], i, key, &sides[0]);
            if (patch->shared[key[0]] && patch->shared[key[1]] && patch->shared[key[2]]) continue;
            face_of(NULL, patch->tets[o / 4], o % 4, key, &sides[1]);
            if (sides[0] == sides[1]) count += 2;
        }
    return count;
}

static tl_status add_up(tl_ctx *ctx, const tl_lattice *lattice, const tl_patch *patch,
                        tli_proof_sums *sums)
{
    tl_status st = TL_OK;
    double(*xyz)[3] = tl_mem_alloc(ctx, patch->vert_count, sizeof *xyz, &st);
    if (st) return st;
    for (uint32_t v = 0; v < patch->vert_count; v++)
        tl_lattice_xyz(lattice, patch->places[v], xyz[v]);
    sums->tets = patch->tet_count;
    sums->odd_sides = count_odd_inside(patch);
    for (uint32_t t = 0; t < patch->tet_count; t++) {
        double p[4][3];
        for (int i = 0; i < 4; i++) memcpy(p[i], xyz[patch->tets[t][i]], sizeof p[i]);
        const int sign = tli_orient3d(p[0], p[1], p[2], p[3]);
        sums->inverted += sign < 0;
        sums->flat += sign == 0;
        sums->volume += tl_tet_volume(TLI_CORNERS(p));
    }
    tl_mem_free(ctx, xyz);
    return st;
}

static tl_status decode_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    builder *b = arg;
    tl_ctx *fork = NULL;
    tl_status st = tli_ctx_fork(b->ctx, &fork);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        raw *r = &b->raws[i];
        st = tl_store_topology(fork, b->store, b->ids[i], &r->patch);
        if (!st) st = hash_values(fork, b, b->ids[i], r);
        if (!st)
            st = add_up(fork, &b->proof->head->lattice, r->patch,
                        &b->proof->patches[b->ids[i]].sums);
    }
    return tli_ctx_join(b->ctx, fork, st);
}

static void drop_raws(builder *b)
{
    for (size_t i = 0; i < b->count; i++) {
        tl_patch_destroy(b->ctx, b->raws[i].patch);
        tl_mem_free(b->ctx, b->raws[i].values);
        b->raws[i] = (raw){0};
    }
}

/* ---- vertices ---- */

static tl_status new_vert(builder *b, uint32_t *vert)
{
    if (b->vert_count >= TL_NONE - 1)
        return tl_fail(b->ctx, TL_ERR_UNSUPPORTED, "more than %u vertices at borders of patches",
                       TL_NONE - 1);
    *vert = b->vert_count++;
    return TL_OK;
}

static tl_status make_place_room(builder *b, uint32_t place)
{
    tl_status st = TL_OK;
    if (place < b->place_capacity) return st;
    const size_t capacity = 2 * (size_t)place + 1024;
    b->verts = tl_mem_resize(b->ctx, b->verts, capacity, sizeof *b->verts, &st);
    b->vert_levels = tl_mem_resize(b->ctx, b->vert_levels, capacity, sizeof *b->vert_levels, &st);
    b->vert_values = tl_mem_resize(b->ctx, b->vert_values, capacity, sizeof *b->vert_values, &st);
    if (!st) b->place_capacity = capacity;
    return st;
}

/* The number of a vertex that other patches may hold. One whose values have changed from level to
 * level is another vertex. */
static tl_status shared_vert(builder *b, uint32_t id, uint32_t level, const raw *r, uint32_t v,
                             uint32_t *vert)
{
    const tl_patch *p = r->patch;
    uint32_t place;
    tl_status st = tli_keys_take(&b->places, p->places[v], p->twins ? p->twins[v] : 0, &place);
    if (!st) st = make_place_room(b, place);
    if (st) return st;
    const bool known = b->places.keys[place].uses > 1;
    if (known && b->vert_values[place] != r->values[v] && b->vert_levels[place] == level)
        return tl_fail(b->ctx, TL_ERR_DATA,
                       "patch %u of level %u shares a vertex with another one that has different "
                       "values there",
                       id, level);
    if (!known || b->vert_values[place] != r->values[v]) {
        st = new_vert(b, &b->verts[place]);
        b->vert_values[place] = r->values[v];
    }
    b->vert_levels[place] = level;
    *vert = b->verts[place];
    return st;
}

/* ---- faces ---- */

static tl_status add_side(builder *b, const uint16_t *tet, unsigned i)
{
    tli_proof *p = b->proof;
    int64_t key[3];
    unsigned side;
    uint32_t face;
    face_of(b->local, tet, i, key, &side);
    tl_status st = tli_keys_take(&b->faces, key, 0, &face);
    if (!st && face > TL_NONE / 2 - 1)
        st = tl_fail(b->ctx, TL_ERR_UNSUPPORTED, "more than %u faces at borders of patches",
                     TL_NONE / 2 - 1);
    if (!st && p->side_count == p->side_capacity) {
        const size_t capacity = p->side_capacity ? 2 * p->side_capacity : 65536;
        p->sides = tl_mem_resize(b->ctx, p->sides, capacity, sizeof *p->sides, &st);
        if (!st) p->side_capacity = capacity;
    }
    if (!st) p->sides[p->side_count++] = 2 * face + side;
    return st;
}

/* Faces at the border of a patch, and those inside that lie between vertices of the border, which
 * are the business of other patches, too, where more than two tets have a face. */
static tl_status add_faces(builder *b, uint32_t id, uint32_t level, const raw *r)
{
    const tl_patch *p = r->patch;
    tl_status st = TL_OK;
    facts *f = &b->proof->patches[id];
    f->first_side = b->proof->side_count;
    for (uint32_t v = 0; v < p->vert_count; v++) b->local[v] = TL_NONE;
    for (uint32_t v = 0; !st && v < p->vert_count; v++)
        if (p->shared[v]) st = shared_vert(b, id, level, r, v, &b->local[v]);
    for (uint32_t t = 0; !st && t < p->tet_count; t++)
        for (unsigned i = 0; !st && i < 4; i++) {
            bool all_shared = true;
            for (int k = 0; k < 3; k++)
                all_shared = all_shared && p->shared[p->tets[t][tli_tet_faces[i][k]]];
            if (p->opposite[t][i] != TL_NONE && !all_shared) continue;
            for (int k = 0; !st && k < 3; k++) {
                uint32_t *vert = &b->local[p->tets[t][tli_tet_faces[i][k]]];
                if (*vert == TL_NONE) st = new_vert(b, vert);
            }
            if (!st) st = add_side(b, p->tets[t], i);
        }
    f->side_count = b->proof->side_count - f->first_side;
    return st;
}

/* ---- levels ---- */

static void count_side(uint16_t *counts, uint32_t side)
{
    const unsigned shift = 8 * (side & 1);
    if ((counts[side / 2] >> shift & SIDE_MOST) != SIDE_MOST)
        counts[side / 2] = (uint16_t)(counts[side / 2] + (1u << shift));
}

static bool is_odd(uint16_t count)
{
    return count != 0x0001 && count != 0x0100 && count != 0x0101;
}

static tl_status add_other(builder *b, uint32_t face, uint16_t count)
{
    tli_proof *p = b->proof;
    tl_status st = TL_OK;
    if (p->other_count == p->other_capacity) {
        const size_t capacity = 2 * p->other_capacity + 64;
        p->others = tl_mem_resize(b->ctx, p->others, capacity, sizeof *p->others, &st);
        if (st) return st;
        p->other_capacity = capacity;
    }
    p->others[p->other_count++] = (other){face, count};
    return st;
}

static void add_sums(tli_proof_sums *to, const tli_proof_sums *from)
{
    to->volume += from->volume;
    to->tets += from->tets;
    to->inverted += from->inverted;
    to->flat += from->flat;
    to->odd_sides += from->odd_sides;
}

/* What a level as a whole has at a face of a side; new faces are those from first_face on. */
static tl_status note_side(builder *b, uint32_t level, const uint16_t *counts, uint32_t side,
                           uint32_t first_face)
{
    tli_proof *p = b->proof;
    const uint32_t face = side / 2;
    p->levels[level].odd_sides += is_odd(counts[face]);
    if (face >= first_face)
        p->expected[face] = counts[face];
    else if (p->expected[face] != counts[face])
        return add_other(b, face, counts[face]);
    return TL_OK;
}

/* Counts a level as a whole: its sides are those from first on and those of leaves of coarser
 * levels, which stand for what was pruned. */
static tl_status finish_level(builder *b, uint32_t level, size_t first, uint32_t first_face)
{
    tli_proof *p = b->proof;
    tl_status st = TL_OK;
    p->face_count = b->faces.count;
    uint16_t *counts = tl_mem_zalloc(b->ctx, p->face_count, sizeof *counts, &st);
    p->expected = tl_mem_resize(b->ctx, p->expected, p->face_count, sizeof *p->expected, &st);
    for (size_t i = first; !st && i < p->side_count; i++) count_side(counts, p->sides[i]);
    for (size_t l = 0; !st && l < b->leaf_count; l++) {
        const facts *f = &p->patches[b->leaves[l]];
        for (size_t i = 0; i < f->side_count; i++) count_side(counts, p->sides[f->first_side + i]);
    }
    for (size_t i = first; !st && i < p->side_count; i++)
        st = note_side(b, level, counts, p->sides[i], first_face);
    for (size_t l = 0; !st && l < b->leaf_count; l++) {
        const facts *f = &p->patches[b->leaves[l]];
        add_sums(&p->levels[level].sums, &f->sums);
        for (size_t i = 0; !st && i < f->side_count; i++)
            st = note_side(b, level, counts, p->sides[f->first_side + i], first_face);
    }
    p->levels[level].odd_sides += p->levels[level].sums.odd_sides;
    tl_mem_free(b->ctx, counts);
    return st;
}

/* The patches ids [count] are all of a level. */
static tl_status add_level(builder *b, uint32_t level, const uint32_t *ids, size_t count,
                           size_t done)
{
    const size_t first = b->proof->side_count;
    const uint32_t first_face = b->proof->face_count;
    tl_status st = TL_OK;
    for (size_t at = 0; !st && at < count; at += b->count) {
        st = tl_progress(b->ctx, "borders", done + at, b->proof->head->patch_count);
        b->ids = ids + at;
        b->count = count - at < ROUND_PATCHES ? count - at : ROUND_PATCHES;
        if (!st) st = tli_parallel(b->ctx, b->count, 1, decode_range, b);
        for (size_t i = 0; !st && i < b->count; i++) {
            st = add_faces(b, b->ids[i], level, &b->raws[i]);
            add_sums(&b->proof->levels[level].sums, &b->proof->patches[b->ids[i]].sums);
        }
        drop_raws(b);
    }
    return st ? st : finish_level(b, level, first, first_face);
}

/* All patches by level, the coarsest first. */
static tl_status add_levels(builder *b)
{
    const tl_store_head *head = b->proof->head;
    tl_status st = TL_OK;
    size_t count = 0;
    uint32_t *ids = tl_mem_alloc(b->ctx, head->patch_count, sizeof *ids, &st);
    b->leaves = tl_mem_alloc(b->ctx, head->patch_count, sizeof *b->leaves, &st);
    for (uint32_t level = head->level_count; !st && level-- > 0;) {
        const size_t first = count;
        for (uint32_t p = 0; !st && p < head->patch_count; p++) {
            tl_patch_info info;
            st = tl_store_patch(b->ctx, b->store, p, &info);
            if (!st && info.level == level) ids[count++] = p;
        }
        if (!st) st = add_level(b, level, ids + first, count - first, first);
        for (size_t i = first; !st && i < count; i++) {
            tl_patch_info info;
            st = tl_store_patch(b->ctx, b->store, ids[i], &info);
            if (!st && info.producer == TL_NONE) b->leaves[b->leaf_count++] = ids[i];
        }
    }
    tl_mem_free(b->ctx, b->leaves);
    tl_mem_free(b->ctx, ids);
    return st;
}

static int by_face(const void *a, const void *b)
{
    const other *x = a, *y = b;
    if (x->face != y->face) return x->face < y->face ? -1 : 1;
    return (x->count > y->count) - (x->count < y->count);
}

/* ---- the object ---- */

tl_status tli_proof_create(tl_ctx *ctx, tl_store *store, tli_proof **proof)
{
    tl_status st = TL_OK;
    const tl_store_head *head = tl_store_get_head(store);
    *proof = NULL;
    tli_proof *p = tl_mem_zalloc(ctx, 1, sizeof *p, &st);
    if (st) return st;
    *p = (tli_proof){.ctx = ctx, .store = store, .head = head};
    builder b = {.ctx = ctx, .store = store, .proof = p};
    p->patches = tl_mem_zalloc(ctx, head->patch_count, sizeof *p->patches, &st);
    p->levels = tl_mem_zalloc(ctx, head->level_count, sizeof *p->levels, &st);
    b.raws = tl_mem_zalloc(ctx, ROUND_PATCHES, sizeof *b.raws, &st);
    b.local = tl_mem_alloc(ctx, UINT16_MAX + 1, sizeof *b.local, &st);
    if (!st) st = tli_keys_open(ctx, 0, &b.places);
    if (!st) st = tli_keys_open(ctx, 0, &b.faces);
    if (!st) st = add_levels(&b);
    if (!st && p->other_count) qsort(p->others, p->other_count, sizeof *p->others, by_face);
    tli_keys_close(&b.faces);
    tli_keys_close(&b.places);
    void *blocks[] = {b.raws, b.local, b.verts, b.vert_levels, b.vert_values};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    if (st)
        tli_proof_destroy(p);
    else
        *proof = p;
    return st ? tl_note(ctx, st, "while matching the borders of patches") : TL_OK;
}

void tli_proof_destroy(tli_proof *p)
{
    if (!p) return;
    tl_mem_free(p->ctx, p->levels);
    tl_mem_free(p->ctx, p->others);
    tl_mem_free(p->ctx, p->expected);
    tl_mem_free(p->ctx, p->sides);
    tl_mem_free(p->ctx, p->patches);
    tl_mem_free(p->ctx, p);
}

const tli_proof_level *tli_proof_of_level(const tli_proof *p, uint32_t level)
{
    TL_ASSERT(level < p->head->level_count);
    return &p->levels[level];
}

tl_status tli_proof_counts(tl_ctx *ctx, const tli_proof *p, uint16_t **counts)
{
    tl_status st = TL_OK;
    *counts = tl_mem_zalloc(ctx, p->face_count, sizeof **counts, &st);
    return st;
}

/* ---- proving ---- */

static bool is_expected(const tli_proof *p, uint32_t face, uint16_t count)
{
    const other key = {face, count};
    if (p->expected[face] == count) return true;
    return p->other_count &&
           bsearch(&key, p->others, p->other_count, sizeof *p->others, by_face) != NULL;
}

static tl_status fail_at(tl_ctx *ctx, const tli_proof *p, uint32_t patch, uint16_t count,
                         uint16_t expected)
{
    tl_patch_info info;
    tl_status st = tl_store_patch(ctx, p->store, patch, &info);
    if (st) return st;
    return tl_fail(ctx, TL_ERR_DATA,
                   "patch %u of level %u does not fit to what is drawn around it: a face at its "
                   "border has %u and %u tets on its sides, in a level as a whole %u and %u",
                   patch, info.level, count & SIDE_MOST, count >> 8, expected & SIDE_MOST,
                   expected >> 8);
}

tl_status tli_proof_patches(tl_ctx *ctx, const tli_proof *p, const uint32_t *patches,
                            size_t patch_count, uint16_t *counts, tli_proof_sums *sums)
{
    uint32_t wrong = TL_NONE;
    uint16_t count = 0, expected = 0;
    *sums = (tli_proof_sums){0};
    for (size_t i = 0; i < patch_count; i++) {
        const facts *f = &p->patches[patches[i]];
        add_sums(sums, &f->sums);
        for (size_t s = f->first_side; s < f->first_side + f->side_count; s++)
            count_side(counts, p->sides[s]);
    }
    for (size_t i = 0; i < patch_count && wrong == TL_NONE; i++) {
        const facts *f = &p->patches[patches[i]];
        for (size_t s = f->first_side; s < f->first_side + f->side_count; s++) {
            const uint32_t face = p->sides[s] / 2;
            if (is_expected(p, face, counts[face])) continue;
            wrong = patches[i];
            count = counts[face];
            expected = p->expected[face];
        }
    }
    for (size_t i = 0; i < patch_count; i++) {
        const facts *f = &p->patches[patches[i]];
        for (size_t s = f->first_side; s < f->first_side + f->side_count; s++)
            counts[p->sides[s] / 2] = 0;
    }
    return wrong == TL_NONE ? TL_OK : fail_at(ctx, p, wrong, count, expected);
}
