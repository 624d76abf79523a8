/* Matching faces. Every face belongs to the smallest of its vertices; tets are dealt out to ranges
 * of vertices by their two smallest ones (three faces belong to the smallest vertex, one to the
 * second), as numbers of 4 bytes; each range then finds its pairs in a hash table that fits in the
 * cache. A tet is read twice in order and once or twice by its number; nothing as large as the
 * faces is ever written but the result. */
#include "mesh/mesh_faces.h"
#include "mesh/mesh.h"
#include "mesh/mesh_bucket.h"

#include <stdatomic.h>
#include <string.h>

/* Faces a range is meant to hold; its table takes up to 64 bytes for each. */
#define RANGE_FACES 2048
/* Tets are fetched this far ahead of their turn: in a mesh in random order each is a cache miss. */
#define PREFETCH_TETS 12
/* Tets looked at for open faces at a time; a multiple of 8. */
#define OPEN_PIECE_TETS 65536
/* In a slot, instead of a face: taken by no face; by a face that has found its partner and is not
 * looked for any more. Faces are numbered below both. */
#define SLOT_EMPTY 0xffffffffu
#define SLOT_CLOSED 0xfffffffeu

#if defined(__GNUC__)
#define PREFETCH(address) __builtin_prefetch(address)
#else
#define PREFETCH(address) ((void)(address))
#endif

/* A face in a table: its vertices, ascending, and its number 4 * tet + face. */
typedef struct slot {
    tl_lidx a, b, c, face;
} slot;

typedef struct table {
    slot *slots;
    size_t room;
} table;

typedef struct matching {
    tl_ctx *ctx;
    const tl_lidx *tets;
    size_t vert_count;
    tli_buckets buckets;
    uint32_t *entries; /* 4 * tet + 1 (the faces of its smallest vertex) + 2 (that of its second) */
    table *tables;     /* one a worker */
    tl_lidx *opposite; /* the result, or NULL: */
    uint32_t *bits;    /* ... the boundary is the result */
    atomic_size_t nonmanifold_count;
} matching;

static inline tl_lidx least(tl_lidx a, tl_lidx b)
{
    return a < b ? a : b;
}

static inline tl_lidx most(tl_lidx a, tl_lidx b)
{
    return a < b ? b : a;
}

static inline void two_smallest(const tl_lidx *v, tl_lidx *first, tl_lidx *second)
{
    tl_lidx low01 = least(v[0], v[1]), high01 = most(v[0], v[1]);
    tl_lidx low23 = least(v[2], v[3]), high23 = most(v[2], v[3]);
    *first = least(low01, low23);
    *second = least(most(low01, low23), least(high01, high23));
}

static tl_status count_tets(void *arg, size_t begin, size_t end, unsigned worker)
{
    matching *m = arg;
    (void)worker;
    tl_status st = tli_tets_check(m->ctx, m->tets, begin, end, m->vert_count);
    if (st) return st;
    uint32_t *counts = tli_buckets_row(&m->buckets, begin);
    unsigned shift = m->buckets.shift;
    for (size_t t = begin; t < end; t++) {
        tl_lidx first, second;
        two_smallest(m->tets + 4 * t, &first, &second);
        counts[first >> shift]++;
        if (first >> shift != second >> shift) counts[second >> shift]++;
    }
    return TL_OK;
}

static tl_status deal_tets(void *arg, size_t begin, size_t end, unsigned worker)
{
    matching *m = arg;
    (void)worker;
    uint32_t *places = tli_buckets_row(&m->buckets, begin);
    unsigned shift = m->buckets.shift;
    for (size_t t = begin; t < end; t++) {
        tl_lidx first, second;
        two_smallest(m->tets + 4 * t, &first, &second);
        bool same = first >> shift == second >> shift;
        m->entries[places[first >> shift]++] = (uint32_t)(4 * t) | (same ? 3 : 1);
        if (!same) m->entries[places[second >> shift]++] = (uint32_t)(4 * t) | 2;
    }
    return TL_OK;
}

/* Slot of a face, or the empty slot where it belongs. */
static inline slot *find_slot(slot *slots, size_t mask, tl_lidx a, tl_lidx b, tl_lidx c)
{
    uint64_t h = ((uint64_t)b << 32 | c) * 0x9e3779b97f4a7c15u + a;
    h = (h ^ h >> 32) * 0xd6e8feb86659fd93u;
    size_t i = (size_t)(h >> 32) & mask;
    while (slots[i].face != SLOT_EMPTY && (slots[i].c != c || slots[i].b != b || slots[i].a != a))
        i = (i + 1) & mask;
    return &slots[i];
}

static inline void add_face(matching *m, slot *slots, size_t mask, tl_lidx a, tl_lidx b, tl_lidx c,
                            tl_lidx face, bool adjacency)
{
    slot *s = find_slot(slots, mask, a, b, c);
    if (s->face == SLOT_EMPTY) {
        *s = (slot){a, b, c, face};
        return;
    }
    if (!adjacency) {
        s->face = SLOT_CLOSED;
        return;
    }
    if (s->face == SLOT_CLOSED) return;
    tl_lidx partner = m->opposite[s->face];
    if (partner == TL_NONE) {
        m->opposite[s->face] = face;
        m->opposite[face] = s->face;
        return;
    }
    m->opposite[s->face] = m->opposite[partner] = TL_NONE; /* the third */
    s->face = SLOT_CLOSED;
    atomic_fetch_add_explicit(&m->nonmanifold_count, 1, memory_order_relaxed);
}

/* Vertex and corner as one number, so that both are sorted together. */
static inline void order(uint64_t *low, uint64_t *high)
{
    uint64_t a = *low, b = *high;
    *low = a < b ? a : b;
    *high = a < b ? b : a;
}

static inline void add_tet(matching *m, slot *slots, size_t mask, uint32_t entry, bool adjacency)
{
    tl_lidx base = entry & ~3u;
    const tl_lidx *tet = m->tets + base;
    uint64_t k[4];
    for (unsigned i = 0; i < 4; i++) k[i] = (uint64_t)tet[i] << 2 | i;
    order(&k[0], &k[1]);
    order(&k[2], &k[3]);
    order(&k[0], &k[2]);
    order(&k[1], &k[3]);
    order(&k[1], &k[2]);
    tl_lidx v[4];
    for (unsigned i = 0; i < 4; i++) v[i] = (tl_lidx)(k[i] >> 2);
    /* A tet with a vertex twice has no faces: what is left of it is a triangle. */
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[3]) return;
    if (entry & 1) {
        add_face(m, slots, mask, v[0], v[1], v[2], base | (tl_lidx)(k[3] & 3), adjacency);
        add_face(m, slots, mask, v[0], v[1], v[3], base | (tl_lidx)(k[2] & 3), adjacency);
        add_face(m, slots, mask, v[0], v[2], v[3], base | (tl_lidx)(k[1] & 3), adjacency);
    }
    if (entry & 2)
        add_face(m, slots, mask, v[1], v[2], v[3], base | (tl_lidx)(k[0] & 3), adjacency);
}

static void collect_boundary(matching *m, const slot *slots, size_t slot_count)
{
    _Atomic uint32_t *bits = (_Atomic uint32_t *)m->bits;
    for (size_t i = 0; i < slot_count; i++) {
        tl_lidx face = slots[i].face;
        if (face < SLOT_CLOSED)
            atomic_fetch_or_explicit(&bits[face / 32], 1u << face % 32, memory_order_relaxed);
    }
}

static tl_status match_range(matching *m, size_t range, table *own)
{
    const uint32_t *entries = m->entries + m->buckets.begins[range];
    size_t entry_count = m->buckets.begins[range + 1] - m->buckets.begins[range];
    size_t face_count = 0, slot_count = 16;
    for (size_t i = 0; i < entry_count; i++)
        face_count += (entries[i] & 1) * 3 + (entries[i] >> 1 & 1);
    while (slot_count < face_count + face_count / 4) slot_count *= 2;
    if (own->room < slot_count) {
        tl_status st = TL_OK;
        tl_mem_free(m->ctx, own->slots);
        own->room = 0;
        own->slots = tl_mem_alloc(m->ctx, slot_count, sizeof *own->slots, &st);
        if (st) return st;
        own->room = slot_count;
    }
    slot *slots = own->slots;
    memset(slots, 0xff, slot_count * sizeof *slots); /* SLOT_EMPTY */
    for (size_t i = 0; i < entry_count; i++) {
        if (i + PREFETCH_TETS < entry_count) {
            size_t soon = entries[i + PREFETCH_TETS] & ~3u;
            PREFETCH(m->tets + soon);
            if (m->opposite) PREFETCH(m->opposite + soon);
        }
        if (m->opposite)
            add_tet(m, slots, slot_count - 1, entries[i], true);
        else
            add_tet(m, slots, slot_count - 1, entries[i], false);
    }
    if (!m->opposite) collect_boundary(m, slots, slot_count);
    return TL_OK;
}

static tl_status match_ranges(void *arg, size_t begin, size_t end, unsigned worker)
{
    matching *m = arg;
    tl_status st = TL_OK;
    for (size_t range = begin; range < end && !st; range++)
        st = match_range(m, range, &m->tables[worker]);
    return st;
}

static tl_status clear_opposite(void *arg, size_t begin, size_t end, unsigned worker)
{
    matching *m = arg;
    (void)worker;
    memset(m->opposite + 4 * begin, 0xff, (end - begin) * 4 * sizeof *m->opposite); /* TL_NONE */
    return TL_OK;
}

/* The steps that adjacency and boundary share; the caller has set opposite or bits. */
static tl_status match_faces(matching *m, size_t tet_count)
{
    if (tet_count == 0) return TL_OK;
    unsigned threads = tl_ctx_thread_count(m->ctx);
    tli_buckets *b = &m->buckets;
    tl_status st =
        tli_buckets_open(m->ctx, tet_count, m->vert_count, 4 * tet_count, 2 * RANGE_FACES, 31, b);
    m->tables = tl_mem_zalloc(m->ctx, threads, sizeof *m->tables, &st);
    if (!st) st = tli_parallel(m->ctx, tet_count, b->piece_tets, count_tets, m);
    if (!st) tli_buckets_place(b);
    m->entries = tl_mem_alloc(m->ctx, st ? 0 : b->begins[b->bucket_count], sizeof *m->entries, &st);
    if (!st) st = tli_parallel(m->ctx, tet_count, b->piece_tets, deal_tets, m);
    if (!st && m->opposite) st = tli_parallel(m->ctx, tet_count, b->piece_tets, clear_opposite, m);
    if (!st) st = tli_parallel(m->ctx, b->bucket_count, 1, match_ranges, m);
    tl_mem_free(m->ctx, m->entries);
    for (unsigned w = 0; m->tables && w < threads; w++) tl_mem_free(m->ctx, m->tables[w].slots);
    tl_mem_free(m->ctx, m->tables);
    tli_buckets_close(m->ctx, b);
    return st;
}

tl_status tl_tets_adjacency(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count, size_t vert_count,
                            tl_lidx **opposite, size_t *nonmanifold_count)
{
    *opposite = NULL;
    if (tet_count > TL_MESH_TETS_MAX || vert_count > TL_MESH_VERTS_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "%zu tets of %zu vertices are too many", tet_count,
                       vert_count);
    matching m = {.ctx = ctx, .tets = tets, .vert_count = vert_count};
    tl_status st = TL_OK;
    m.opposite = tl_mem_alloc(ctx, tet_count, 4 * sizeof *m.opposite, &st);
    if (!st) st = match_faces(&m, tet_count);
    if (st) {
        tl_mem_free(ctx, m.opposite);
        return st;
    }
    *opposite = m.opposite;
    if (nonmanifold_count) *nonmanifold_count = m.nonmanifold_count;
    return TL_OK;
}

tl_status tl_mesh_adjacency(tl_ctx *ctx, const tl_mesh *mesh, tl_lidx **opposite,
                            size_t *nonmanifold_count)
{
    return tl_tets_adjacency(ctx, mesh->tets, mesh->tet_count, mesh->vert_count, opposite,
                             nonmanifold_count);
}

tl_status tli_faces_boundary(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count, size_t vert_count,
                             uint32_t **bits)
{
    *bits = NULL;
    matching m = {.ctx = ctx, .tets = tets, .vert_count = vert_count};
    tl_status st = TL_OK;
    m.bits = tl_mem_zalloc(ctx, tli_face_words(tet_count), sizeof *m.bits, &st);
    if (!st) st = match_faces(&m, tet_count);
    if (st) {
        tl_mem_free(ctx, m.bits);
        return st;
    }
    *bits = m.bits;
    return TL_OK;
}

/* ---- boundary out of an adjacency ---- */

typedef struct open_faces {
    const tl_lidx *tets, *opposite;
    uint32_t *bits;
    atomic_size_t count;
} open_faces;

static bool has_four_vertices(const tl_lidx *v)
{
    return v[0] != v[1] && v[0] != v[2] && v[0] != v[3] && v[1] != v[2] && v[1] != v[3] &&
           v[2] != v[3];
}

/* Pieces hold whole words: their length is a multiple of 8 tets. */
static tl_status collect_open(void *arg, size_t begin, size_t end, unsigned worker)
{
    open_faces *o = arg;
    (void)worker;
    size_t count = 0;
    for (size_t t = begin; t < end; t++) {
        if (!has_four_vertices(o->tets + 4 * t)) continue;
        for (size_t i = 0; i < 4; i++) {
            if (o->opposite[4 * t + i] != TL_NONE) continue;
            o->bits[t / 8] |= 1u << (4 * t + i) % 32;
            count++;
        }
    }
    atomic_fetch_add_explicit(&o->count, count, memory_order_relaxed);
    return TL_OK;
}

static void sorted_face(const tl_lidx *tets, size_t face, tl_lidx v[3])
{
    const tl_lidx *tet = tets + (face & ~(size_t)3);
    const uint8_t *corners = tli_tet_faces[face & 3];
    tl_lidx a = tet[corners[0]], b = tet[corners[1]], c = tet[corners[2]];
    v[0] = least(least(a, b), c);
    v[2] = most(most(a, b), c);
    v[1] = a ^ b ^ c ^ v[0] ^ v[2];
}

/* Takes away the faces that are there more than once. */
static tl_status drop_nonmanifold(tl_ctx *ctx, const open_faces *o, size_t word_count,
                                  size_t *nonmanifold_count, tl_lidx *first_nonmanifold)
{
    size_t slot_count = 16;
    while (slot_count < 2 * o->count) slot_count *= 2;
    tl_status st = TL_OK;
    slot *slots = tl_mem_alloc(ctx, slot_count, sizeof *slots, &st);
    if (st) return st;
    memset(slots, 0xff, slot_count * sizeof *slots);
    size_t count = 0;
    tl_lidx first = TL_NONE;
    for (size_t w = 0; w < word_count; w++) {
        for (uint32_t left = o->bits[w], i = 0; left; left >>= 1, i++) {
            if (!(left & 1)) continue;
            tl_lidx v[3], face = (tl_lidx)(32 * w + i);
            sorted_face(o->tets, face, v);
            slot *s = find_slot(slots, slot_count - 1, v[0], v[1], v[2]);
            if (s->face == SLOT_EMPTY) {
                *s = (slot){v[0], v[1], v[2], face};
                continue;
            }
            o->bits[w] &= ~(1u << i);
            if (s->face == SLOT_CLOSED) continue;
            o->bits[s->face / 32] &= ~(1u << s->face % 32);
            first = least(first, s->face);
            s->face = SLOT_CLOSED;
            count++;
        }
    }
    tl_mem_free(ctx, slots);
    if (nonmanifold_count) *nonmanifold_count = count;
    if (first_nonmanifold) *first_nonmanifold = first;
    return TL_OK;
}

tl_status tli_faces_boundary_of(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count,
                                const tl_lidx *opposite, uint32_t **bits, size_t *nonmanifold_count,
                                tl_lidx *first_nonmanifold)
{
    *bits = NULL;
    open_faces o = {.tets = tets, .opposite = opposite};
    tl_status st = TL_OK;
    size_t word_count = tli_face_words(tet_count);
    o.bits = tl_mem_zalloc(ctx, word_count, sizeof *o.bits, &st);
    if (!st) st = tli_parallel(ctx, tet_count, OPEN_PIECE_TETS, collect_open, &o);
    if (!st) st = drop_nonmanifold(ctx, &o, word_count, nonmanifold_count, first_nonmanifold);
    if (st) {
        tl_mem_free(ctx, o.bits);
        return st;
    }
    *bits = o.bits;
    return TL_OK;
}
