/* Which original vertex each vertex of the finest level is. The file does not say so, but it is
 * where the original was rounded to: both are joined by their places on the lattice, in bins that
 * fit into memory. The step of a vertex is not known; steps that some vertex has are tried. */
#include <math.h>

#include "model/model_add_bins.h"
#include "model/model_stars.h"
#include "store/store_format.h"

enum {
    FINER = 2,     /* steps of a lattice shrink by 2^FINER, as model_lattice.c has it */
    STEPS_MAX = 32 /* that are tried */
};

/* Places beyond the bound by no more than this part of it are rounding. */
static const double SLACK = 1e-6;

/* A vertex of a patch. */
typedef struct vertex {
    uint64_t place; /* hash of it */
    uint32_t rank;  /* of the patch */
    uint16_t local;
    uint8_t twin, shared;
} vertex;

/* An original, as tli_record_fill has it: where it is, its values, their stars. */
typedef struct original {
    uint64_t place, id;
    double record[];
} original;

typedef struct joiner {
    tli_adder *a;
    tl_ctx *ctx;
    size_t original_bytes;
    tli_bins vertices, originals;
    int steps[STEPS_MAX]; /* that are tried, 0: places are exact */
    size_t step_count;
    uint8_t *seen; /* a bit for each id that is carried */
    uint64_t carried;
} joiner;

/* ---- vertices ---- */

static uint64_t hash_place(const int64_t place[3])
{
    uint8_t bytes[24];
    memcpy(bytes, place, sizeof bytes);
    return tli_store_hash(0, bytes, sizeof bytes);
}

/* Common powers of two of all places: no step is finer than that. */
static unsigned shift_of(const int64_t place[3])
{
    uint64_t all = (uint64_t)(place[0] | place[1] | place[2]);
    return all ? (unsigned)__builtin_ctzll(all) : 63;
}

static tl_status deal_vertices(joiner *j, unsigned *shift)
{
    tli_outbox out;
    tl_status st = tli_outbox_open(j->ctx, &j->vertices, &out);
    *shift = 63;
    for (uint32_t rank = 0; !st && rank < j->a->finest_count; rank++) {
        const uint32_t id = j->a->finest[rank];
        tl_patch *p = NULL;
        tli_twin *twins = NULL;
        size_t twin_count = 0, twin = 0;
        st = tl_store_topology(j->ctx, j->a->store, id, &p);
        if (!st) st = tli_store_twins(j->ctx, j->a->store, id, &twins, &twin_count);
        for (uint32_t v = 0; !st && v < p->vert_count; v++) {
            vertex record = {hash_place(p->places[v]), rank, (uint16_t)v, 0, p->shared[v]};
            if (twin < twin_count && twins[twin].vert == v) record.twin = twins[twin++].twin;
            if (shift_of(p->places[v]) < *shift) *shift = shift_of(p->places[v]);
            vertex *to = tli_outbox_next(&out, tli_bin_of(record.place), &st);
            if (to) *to = record;
        }
        tl_mem_free(j->ctx, twins);
        tl_patch_destroy(j->ctx, p);
        if (!st) st = tl_progress(j->ctx, "match", rank, 2 * (uint64_t)j->a->finest_count);
    }
    return tli_outbox_close(&out, st);
}

/* ---- originals ---- */

/* From the largest step that the bound on places allows to the finest that is in use. */
static void list_steps(joiner *j, unsigned shift)
{
    const tl_lattice *lattice = &j->a->head->lattice;
    const int unit = lattice->exponent;
    if (lattice->kind != TL_PLACE_LATTICE) {
        j->steps[j->step_count++] = 0;
        return;
    }
    int step = ilogb(j->a->head->position_error) + 1, least = unit + (int)shift;
    for (; j->step_count < STEPS_MAX; step -= FINER) {
        j->steps[j->step_count++] = step > unit ? step : unit;
        if (step <= least || step <= unit) break;
    }
}

static void round_place(const joiner *j, const double *xyz, int step, int64_t place[3])
{
    double at[3];
    bool exact = j->a->head->lattice.kind != TL_PLACE_LATTICE;
    for (int k = 0; k < 3; k++) at[k] = exact ? xyz[k] : ldexp(rint(ldexp(xyz[k], -step)), step);
    tl_lattice_nearest(&j->a->head->lattice, at, place);
}

static tl_status deal_original(joiner *j, const tl_segment *s, size_t v, const tli_star *stars,
                               tli_outbox *out)
{
    tl_status st = TL_OK;
    uint64_t before[STEPS_MAX];
    for (size_t i = 0; !st && i < j->step_count; i++) {
        int64_t place[3];
        round_place(j, s->xyz + 3 * v, j->steps[i], place);
        size_t same = 0;
        before[i] = hash_place(place);
        while (before[same] != before[i]) same++;
        if (same < i) continue;
        original *to = tli_outbox_next(out, tli_bin_of(before[i]), &st);
        if (!to) break;
        to->place = before[i];
        to->id = s->vert_ids[v];
        tli_record_fill(j->a->plan, s, TLI_POINTS, v, stars, to->record);
    }
    return st;
}

static tl_status deal_originals(joiner *j)
{
    tli_outbox out;
    tli_stars all;
    tl_status st = tli_outbox_open(j->ctx, &j->originals, &out);
    tl_status opened = tli_stars_open(j->ctx, j->a->plan, j->a->segments, &all);
    if (!st) st = opened;
    for (uint32_t i = 0; !st && i < tl_segments_count(j->a->segments); i++) {
        tl_segment s;
        tli_star *stars = NULL;
        st = tl_segments_load(j->ctx, j->a->segments, i, &s);
        if (st) break;
        st = tli_stars_create(j->ctx, &all, &s, &stars);
        for (size_t v = 0; !st && v < s.vert_count; v++)
            if (!(s.links[v] & TL_LINK_COPY)) st = deal_original(j, &s, v, stars, &out);
        tl_mem_free(j->ctx, stars);
        tl_segment_release(j->ctx, &s);
    }
    tli_stars_close(&all);
    return tli_outbox_close(&out, st);
}

/* ---- both ---- */

static const original *original_at(const joiner *j, const tli_sorted_bin *s, size_t i)
{
    return (const original *)(const void *)(s->records + s->order[i] * j->original_bytes);
}

static const vertex *vertex_at(const tli_sorted_bin *s, size_t i)
{
    return (const vertex *)(const void *)s->records + s->order[i];
}

/* Different vertices at one place (the two sides of a baffle) can't be told from each other by it:
 * fine as long as their values are the same. */
static tl_status check_twins(const joiner *j, const tli_sorted_bin *o, size_t first, size_t end,
                             const tli_sorted_bin *v, size_t vert, size_t vert_end)
{
    const size_t bytes = j->a->plan->vert_comps * sizeof(double);
    const original *one = original_at(j, o, first);
    const vertex *w = vertex_at(v, vert);
    bool several = false;
    for (size_t i = vert + 1; i < vert_end; i++)
        several |= !w->shared || vertex_at(v, i)->twin != w->twin;
    for (size_t i = first + 1; several && i < end; i++)
        if (memcmp(original_at(j, o, i)->record + 3, one->record + 3, bytes) != 0)
            return tl_fail(j->ctx, TL_ERR_UNSUPPORTED,
                           "vertices at one place, %g %g %g, have different values: to such a mesh "
                           "no channel can be added",
                           one->record[0], one->record[1], one->record[2]);
    return TL_OK;
}

/* Originals [first, end) and vertices [vert, vert_end) at one place. */
static tl_status join_place(joiner *j, const tli_sorted_bin *o, size_t first, size_t end,
                            const tli_sorted_bin *v, size_t vert, size_t vert_end, tli_outbox *out)
{
    tl_status st = check_twins(j, o, first, end, v, vert, vert_end);
    for (size_t i = first; !st && i < end; i++) {
        const original *from = original_at(j, o, i);
        for (size_t k = vert; !st && k < vert_end; k++) {
            const vertex *w = vertex_at(v, k);
            tli_match *to = tli_outbox_next(out, w->rank, &st);
            if (!to) break;
            uint8_t *byte = &j->seen[from->id / 8], bit = (uint8_t)(1u << from->id % 8);
            to->local = w->local;
            to->carries = !(*byte & bit);
            j->carried += to->carries;
            *byte |= bit;
            memcpy(to->xyz, from->record, sizeof to->xyz);
            memcpy(to->values, from->record + 3, tli_match_bytes(j->a->plan) - sizeof *to);
        }
    }
    return st;
}

static tl_status join_bin(joiner *j, uint32_t bin, tli_outbox *out)
{
    tli_sorted_bin o = {0}, v = {0};
    tl_status st = tli_bin_sort(j->ctx, &j->originals, bin, &o);
    if (!st) st = tli_bin_sort(j->ctx, &j->vertices, bin, &v);
    for (size_t i = 0, k = 0; !st && i < o.count && k < v.count;) {
        size_t end = i, vert_end = k;
        while (end < o.count && o.keys[end] == o.keys[i]) end++;
        while (vert_end < v.count && v.keys[vert_end] == v.keys[k]) vert_end++;
        if (o.keys[i] == v.keys[k]) st = join_place(j, &o, i, end, &v, k, vert_end, out);
        bool before = o.keys[i] < v.keys[k];
        if (o.keys[i] <= v.keys[k]) i = end;
        if (!before) k = vert_end;
    }
    tli_bin_release(j->ctx, &v);
    tli_bin_release(j->ctx, &o);
    return st;
}

static tl_status join(joiner *j)
{
    tli_outbox out;
    tl_status st = tli_outbox_open(j->ctx, &j->a->matches, &out);
    for (uint32_t bin = 0; !st && bin < TLI_ADD_BINS; bin++) {
        st = join_bin(j, bin, &out);
        if (!st) st = tl_progress(j->ctx, "match", TLI_ADD_BINS + bin, 2 * TLI_ADD_BINS);
    }
    st = tli_outbox_close(&out, st);
    uint64_t verts = tl_segments_vert_count(j->a->segments);
    if (!st && j->carried != verts)
        st = tl_fail(j->ctx, TL_ERR_DATA,
                     "%llu of %llu vertices lie where the model has none: another mesh",
                     (unsigned long long)(verts - j->carried), (unsigned long long)verts);
    return st;
}

/* ---- what was found ---- */

tl_status tli_matches_read(tl_ctx *ctx, const tli_adder *a, uint32_t rank, const tl_patch *patch,
                           tli_matches *m)
{
    tl_status st = TL_OK;
    const size_t n = patch->vert_count;
    const double reach = a->head->position_error * (1 + SLACK);
    *m = (tli_matches){.count = (size_t)a->matches.counts[rank]};
    m->records = tl_mem_alloc(ctx, m->count, tli_match_bytes(a->plan), &st);
    m->nearest = tl_mem_alloc(ctx, n, sizeof *m->nearest, &st);
    double *least = tl_mem_alloc(ctx, n, sizeof *least, &st);
    if (!st) st = tli_bins_read(ctx, &a->matches, rank, m->records);
    for (size_t v = 0; !st && v < n; v++) least[v] = (double)INFINITY;
    for (size_t i = 0; !st && i < m->count; i++) {
        const tli_match *match = tli_match_at(a->plan, m, i);
        double x[3], d2 = 0;
        tl_lattice_xyz(&a->head->lattice, patch->places[match->local], x);
        for (int c = 0; c < 3; c++) d2 += (x[c] - match->xyz[c]) * (x[c] - match->xyz[c]);
        if (d2 >= least[match->local]) continue;
        least[match->local] = d2;
        m->nearest[match->local] = (uint32_t)i;
    }
    for (size_t v = 0; !st && v < n; v++) {
        double x[3];
        tl_lattice_xyz(&a->head->lattice, patch->places[v], x);
        if (!(sqrt(least[v]) <= reach))
            st = tl_fail(ctx, TL_ERR_DATA,
                         "the model has a vertex at %.9g %.9g %.9g, the data set has none there: "
                         "another mesh",
                         x[0], x[1], x[2]);
    }
    tl_mem_free(ctx, least);
    return st;
}

void tli_matches_release(tl_ctx *ctx, tli_matches *m)
{
    tl_mem_free(ctx, m->nearest);
    tl_mem_free(ctx, m->records);
    *m = (tli_matches){0};
}

tl_status tli_adder_match(tli_adder *a)
{
    joiner j = {.a = a,
                .ctx = a->ctx,
                .original_bytes = sizeof(original) +
                                  sizeof(double) * (tli_record_doubles(a->plan, TLI_POINTS) - 1)};
    tl_status st = TL_OK;
    unsigned shift;
    const char *folder = a->plan->opts.folder;
    j.seen = tl_mem_zalloc(a->ctx, (size_t)(tl_segments_id_end(a->segments) / 8 + 1), 1, &st);
    if (!st) st = tli_bins_open(a->ctx, folder, sizeof(vertex), TLI_ADD_BINS, &j.vertices);
    if (!st) st = tli_bins_open(a->ctx, folder, j.original_bytes, TLI_ADD_BINS, &j.originals);
    if (!st)
        st = tli_bins_open(a->ctx, folder, tli_match_bytes(a->plan), a->finest_count, &a->matches);
    if (!st) st = deal_vertices(&j, &shift);
    if (!st) {
        list_steps(&j, shift);
        st = deal_originals(&j);
    }
    if (!st) st = join(&j);
    tli_bins_close(&j.originals);
    tli_bins_close(&j.vertices);
    tl_mem_free(a->ctx, j.seen);
    return st;
}
