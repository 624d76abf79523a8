/* Which original vertex each vertex of the finest level is. The file does not say so, but it is
 * where the original was rounded to: both are joined by their places on the lattice, in bins that
 * fit into memory. The step of a vertex is not known; steps that some vertex has are tried. */
#include <math.h>

#include "base/base_sort.h"
#include "model/model_add.h"
#include "store/store_format.h"

enum {
    BINS = 64,
    FINER = 2,           /* steps of a lattice shrink by 2^FINER, as model_lattice.c has it */
    STEPS_MAX = 32,      /* that are tried */
    BOX_BYTES = 8 << 20, /* of records dealt at a time; a box has some at least */
    BOX_LEAST = 1024
};

/* A vertex of a patch. */
typedef struct vertex {
    uint64_t place; /* hash of it */
    uint32_t rank;  /* of the patch */
    uint16_t local;
    uint8_t twin, shared;
} vertex;

/* An original; its values follow. */
typedef struct original {
    uint64_t place, id;
    double xyz[3];
    double values[];
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

/* ---- records on their way to bins ---- */

typedef struct outbox {
    tl_ctx *ctx;
    tli_bins *bins;
    uint8_t *records, *sorted;
    uint32_t *keys, *places, *begins;
    size_t count, room;
} outbox;

static tl_status open_outbox(tl_ctx *ctx, tli_bins *bins, outbox *o)
{
    tl_status st = TL_OK;
    *o = (outbox){.ctx = ctx, .bins = bins, .room = BOX_BYTES / bins->record_bytes};
    if (o->room < BOX_LEAST) o->room = BOX_LEAST;
    o->records = tl_mem_alloc(ctx, o->room, bins->record_bytes, &st);
    o->sorted = tl_mem_alloc(ctx, o->room, bins->record_bytes, &st);
    o->keys = tl_mem_alloc(ctx, o->room, sizeof *o->keys, &st);
    o->places = tl_mem_alloc(ctx, o->room, sizeof *o->places, &st);
    o->begins = tl_mem_alloc(ctx, (size_t)bins->bin_count + 1, sizeof *o->begins, &st);
    return st;
}

static tl_status flush(outbox *o)
{
    const size_t bytes = o->bins->record_bytes;
    if (!o->count) return TL_OK;
    tli_deal_alone(o->keys, o->count, o->bins->bin_count, o->begins, o->places);
    for (size_t i = 0; i < o->count; i++)
        memcpy(o->sorted + o->places[i] * bytes, o->records + i * bytes, bytes);
    o->count = 0;
    return tli_bins_add(o->bins, o->sorted, o->begins);
}

/* The place of the next record, for a bin; full outboxes are emptied first. */
static void *next_record(outbox *o, uint32_t bin, tl_status *st)
{
    if (!*st && o->count == o->room) *st = flush(o);
    if (*st) return NULL;
    o->keys[o->count] = bin;
    return o->records + o->count++ * o->bins->record_bytes;
}

static tl_status close_outbox(outbox *o, tl_status st)
{
    if (!st) st = flush(o);
    void *blocks[] = {o->begins, o->places, o->keys, o->sorted, o->records};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(o->ctx, blocks[i]);
    return st;
}

/* ---- vertices ---- */

static uint64_t hash_place(const int64_t place[3])
{
    uint8_t bytes[24];
    memcpy(bytes, place, sizeof bytes);
    return tli_store_hash(0, bytes, sizeof bytes);
}

static uint32_t bin_of(uint64_t place)
{
    return (uint32_t)(place >> 32) % BINS;
}

/* Common powers of two of all places: no step is finer than that. */
static unsigned shift_of(const int64_t place[3])
{
    uint64_t all = (uint64_t)(place[0] | place[1] | place[2]);
    return all ? (unsigned)__builtin_ctzll(all) : 63;
}

static tl_status deal_vertices(joiner *j, unsigned *shift)
{
    outbox out;
    tl_status st = open_outbox(j->ctx, &j->vertices, &out);
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
            vertex *to = next_record(&out, bin_of(record.place), &st);
            if (to) *to = record;
        }
        tl_mem_free(j->ctx, twins);
        tl_patch_destroy(j->ctx, p);
        if (!st) st = tl_progress(j->ctx, "match", rank, 2 * (uint64_t)j->a->finest_count);
    }
    return close_outbox(&out, st);
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

static tl_status deal_original(joiner *j, const tl_segment *s, size_t v, outbox *out)
{
    tl_status st = TL_OK;
    const tli_plan *plan = j->a->plan;
    uint64_t before[STEPS_MAX];
    for (size_t i = 0; !st && i < j->step_count; i++) {
        int64_t place[3];
        round_place(j, s->xyz + 3 * v, j->steps[i], place);
        size_t same = 0;
        before[i] = hash_place(place);
        while (before[same] != before[i]) same++;
        if (same < i) continue;
        original *to = next_record(out, bin_of(before[i]), &st);
        if (!to) break;
        to->place = before[i];
        to->id = s->vert_ids[v];
        memcpy(to->xyz, s->xyz + 3 * v, sizeof to->xyz);
        for (size_t f = 0; f < plan->field_count; f++)
            memcpy(to->values + plan->fields[f].first,
                   s->values + v * plan->source_vert_comps + plan->fields[f].source_first,
                   plan->fields[f].components * sizeof *to->values);
    }
    return st;
}

static tl_status deal_originals(joiner *j)
{
    outbox out;
    tl_status st = open_outbox(j->ctx, &j->originals, &out);
    for (uint32_t i = 0; !st && i < tl_segments_count(j->a->segments); i++) {
        tl_segment s;
        st = tl_segments_load(j->ctx, j->a->segments, i, &s);
        if (st) break;
        for (size_t v = 0; !st && v < s.vert_count; v++)
            if (!(s.links[v] & TL_LINK_COPY)) st = deal_original(j, &s, v, &out);
        tl_segment_release(j->ctx, &s);
    }
    return close_outbox(&out, st);
}

/* ---- both ---- */

/* What is in a bin, in the order of places. */
typedef struct sorted_bin {
    uint8_t *records;
    uint64_t *places;
    uint32_t *order;
    size_t count;
} sorted_bin;

static tl_status sort_bin(tl_ctx *ctx, const tli_bins *bins, uint32_t bin, sorted_bin *s)
{
    tl_status st = TL_OK;
    s->count = (size_t)bins->counts[bin];
    s->records = tl_mem_alloc(ctx, s->count, bins->record_bytes, &st);
    s->places = tl_mem_alloc(ctx, s->count, sizeof *s->places, &st);
    s->order = tl_mem_alloc(ctx, s->count, sizeof *s->order, &st);
    if (!st) st = tli_bins_read(ctx, bins, bin, s->records);
    for (size_t i = 0; !st && i < s->count; i++) {
        memcpy(&s->places[i], s->records + i * bins->record_bytes, sizeof *s->places);
        s->order[i] = (uint32_t)i;
    }
    return st ? st : tli_sort_u64(ctx, s->places, s->order, s->count);
}

static void release_bin(tl_ctx *ctx, sorted_bin *s)
{
    tl_mem_free(ctx, s->order);
    tl_mem_free(ctx, s->places);
    tl_mem_free(ctx, s->records);
}

static const original *original_at(const joiner *j, const sorted_bin *s, size_t i)
{
    return (const original *)(const void *)(s->records + s->order[i] * j->original_bytes);
}

static const vertex *vertex_at(const sorted_bin *s, size_t i)
{
    return (const vertex *)(const void *)s->records + s->order[i];
}

/* Different vertices at one place (the two sides of a baffle) can't be told from each other by it:
 * fine as long as their values are the same. */
static tl_status check_twins(const joiner *j, const sorted_bin *o, size_t first, size_t end,
                             const sorted_bin *v, size_t vert, size_t vert_end)
{
    const size_t bytes = j->a->plan->vert_comps * sizeof(double);
    const original *one = original_at(j, o, first);
    const vertex *w = vertex_at(v, vert);
    bool several = false;
    for (size_t i = vert + 1; i < vert_end; i++)
        several |= !w->shared || vertex_at(v, i)->twin != w->twin;
    for (size_t i = first + 1; several && i < end; i++)
        if (memcmp(original_at(j, o, i)->values, one->values, bytes) != 0)
            return tl_fail(j->ctx, TL_ERR_UNSUPPORTED,
                           "vertices at one place, %g %g %g, have different values: to such a mesh "
                           "no channel can be added",
                           one->xyz[0], one->xyz[1], one->xyz[2]);
    return TL_OK;
}

/* Originals [first, end) and vertices [vert, vert_end) at one place. */
static tl_status join_place(joiner *j, const sorted_bin *o, size_t first, size_t end,
                            const sorted_bin *v, size_t vert, size_t vert_end, outbox *out)
{
    tl_status st = check_twins(j, o, first, end, v, vert, vert_end);
    for (size_t i = first; !st && i < end; i++) {
        const original *from = original_at(j, o, i);
        for (size_t k = vert; !st && k < vert_end; k++) {
            const vertex *w = vertex_at(v, k);
            tli_match *to = next_record(out, w->rank, &st);
            if (!to) break;
            uint8_t *byte = &j->seen[from->id / 8], bit = (uint8_t)(1u << from->id % 8);
            to->local = w->local;
            to->carries = !(*byte & bit);
            j->carried += to->carries;
            *byte |= bit;
            memcpy(to->xyz, from->xyz, sizeof to->xyz);
            memcpy(to->values, from->values, j->a->plan->vert_comps * sizeof(double));
        }
    }
    return st;
}

static tl_status join_bin(joiner *j, uint32_t bin, outbox *out)
{
    sorted_bin o = {0}, v = {0};
    tl_status st = sort_bin(j->ctx, &j->originals, bin, &o);
    if (!st) st = sort_bin(j->ctx, &j->vertices, bin, &v);
    for (size_t i = 0, k = 0; !st && i < o.count && k < v.count;) {
        size_t end = i, vert_end = k;
        while (end < o.count && o.places[end] == o.places[i]) end++;
        while (vert_end < v.count && v.places[vert_end] == v.places[k]) vert_end++;
        if (o.places[i] == v.places[k]) st = join_place(j, &o, i, end, &v, k, vert_end, out);
        bool before = o.places[i] < v.places[k];
        if (o.places[i] <= v.places[k]) i = end;
        if (!before) k = vert_end;
    }
    release_bin(j->ctx, &v);
    release_bin(j->ctx, &o);
    return st;
}

static tl_status join(joiner *j)
{
    outbox out;
    tl_status st = open_outbox(j->ctx, &j->a->matches, &out);
    for (uint32_t bin = 0; !st && bin < BINS; bin++) {
        st = join_bin(j, bin, &out);
        if (!st) st = tl_progress(j->ctx, "match", BINS + bin, 2 * BINS);
    }
    st = close_outbox(&out, st);
    uint64_t verts = tl_segments_vert_count(j->a->segments);
    if (!st && j->carried != verts)
        st = tl_fail(j->ctx, TL_ERR_DATA,
                     "%llu of %llu vertices lie where the model has none: another mesh",
                     (unsigned long long)(verts - j->carried), (unsigned long long)verts);
    return st;
}

tl_status tli_adder_match(tli_adder *a)
{
    joiner j = {.a = a,
                .ctx = a->ctx,
                .original_bytes = sizeof(original) + a->plan->vert_comps * sizeof(double)};
    tl_status st = TL_OK;
    unsigned shift;
    const char *folder = a->plan->opts.folder;
    j.seen = tl_mem_zalloc(a->ctx, (size_t)(tl_segments_id_end(a->segments) / 8 + 1), 1, &st);
    if (!st) st = tli_bins_open(a->ctx, folder, sizeof(vertex), BINS, &j.vertices);
    if (!st) st = tli_bins_open(a->ctx, folder, j.original_bytes, BINS, &j.originals);
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
