/* Marching tetrahedra. Each vertex gets a rank, the number of values at or below its scalar; a tet
 * whose corners have one rank is passed over at the cost of four bytes. Two passes over pieces of
 * tets: how many triangles and cut edges there will be, then the triangles themselves, whose
 * corners are edges of the piece; equal edges of one piece are found in a small table, those of
 * several by extract_weld.c. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/base_vec.h"
#include "extract/extract.h"
#include "mesh/mesh.h"

enum {
    RANK_NONE = 255, /* of a vertex that is not finite */
    TABLE_BITS = 13, /* of the table of a piece */
    TABLE_FILL = 1 << (TABLE_BITS - 1),
    GRAIN = 8192
};

/* Edges of a tet as corners, and for each set of corners above the value (bit i: corner i) the
 * edges that are cut: three, or four around a quadrangle, counterclockwise as seen from below the
 * value. */
static const uint8_t EDGES[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
static const struct {
    uint8_t count, edges[4];
} CASES[16] = {{0, {0}},          {3, {0, 1, 2}},    {3, {0, 4, 3}},    {4, {1, 2, 4, 3}},
               {3, {1, 3, 5}},    {4, {0, 3, 5, 2}}, {4, {0, 4, 5, 1}}, {3, {2, 4, 5}},
               {3, {2, 5, 4}},    {4, {0, 1, 5, 4}}, {4, {0, 2, 5, 3}}, {3, {1, 5, 3}},
               {4, {1, 3, 4, 2}}, {3, {0, 3, 4}},    {3, {0, 2, 1}},    {0, {0}}};

/* Edges that a piece has met lately; a stamp that is not the table's is an empty place. */
typedef struct table {
    uint64_t verts[1 << TABLE_BITS];
    uint32_t level_stamps[1 << TABLE_BITS]; /* stamp in the upper 24 bits, level below */
    uint32_t slots[1 << TABLE_BITS];
    uint32_t stamp, used;
} table;

typedef struct job {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const double *scalar;
    const tl_range_index *ranges;
    double levels[TL_SLICE_VALUES_MAX]; /* the values, rising */
    size_t level_count;
    uint8_t *ranks;    /* [vert_count] */
    size_t *triangles; /* [piece_count + 1] counts, then starts */
    tli_cut_edges cut;
    tl_lidx *tets;        /* [triangles] where each lies, or NULL: nothing of tets is carried */
    uint32_t *numbers;    /* of cut edges */
    table *tables;        /* [threads] */
    tli_cut_edge *unique; /* [vert_count] of the result */
    tli_slice_end *ends;  /* [vert_count] of the result, or NULL: not asked */
    double **values;      /* [channel_count] of the result */
    const tl_slice_opts *opts;
    tl_polydata *out;
} job;

static tl_status rank_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t v = begin; v < end; v++) {
        double s = j->scalar[v];
        size_t rank = 0;
        for (size_t last = j->level_count; rank < last;) {
            size_t middle = (rank + last) / 2;
            if (s >= j->levels[middle])
                rank = middle + 1;
            else
                last = middle;
        }
        j->ranks[v] = (uint8_t)(isfinite(s) ? rank : RANK_NONE);
    }
    return TL_OK;
}

/* The least and largest rank of a tet's corners; false if no value lies between. */
static inline bool is_cut(const job *j, const tl_lidx *q, unsigned ranks[4], unsigned *low,
                          unsigned *high)
{
    for (int i = 0; i < 4; i++) ranks[i] = j->ranks[q[i]];
    if (((ranks[0] ^ ranks[1]) | (ranks[0] ^ ranks[2]) | (ranks[0] ^ ranks[3])) == 0) return false;
    *low = *high = ranks[0];
    for (int i = 1; i < 4; i++) {
        *low = ranks[i] < *low ? ranks[i] : *low;
        *high = ranks[i] > *high ? ranks[i] : *high;
    }
    if (*high == RANK_NONE) return false;
    for (int i = 0; i < 4; i++)
        if (!vec_is_finite(j->mesh->xyz + 3 * (size_t)q[i])) return false;
    return true;
}

/* The corners above a value. */
static unsigned case_of(const unsigned ranks[4], unsigned level)
{
    unsigned set = 0;
    for (unsigned i = 0; i < 4; i++) set |= (unsigned)(ranks[i] > level) << i;
    return set;
}

/* False if a block of the range index has none of the values. */
static bool may_cut(const job *j, size_t tet)
{
    if (!j->ranges) return true;
    const double *range = j->ranges->ranges[tet / TLI_RANGE_TETS];
    for (size_t k = 0; k < j->level_count; k++)
        if (range[0] < j->levels[k] && j->levels[k] <= range[1]) return true;
    return false;
}

/* ---- first pass: how much there will be ---- */

static void count_piece(const job *j, size_t begin, size_t end, size_t *triangles, size_t *edges)
{
    for (size_t t = begin; t < end; t++) {
        unsigned ranks[4], low, high;
        if (t % TLI_RANGE_TETS == 0 && !may_cut(j, t)) {
            t += TLI_RANGE_TETS - 1;
            continue;
        }
        if (!is_cut(j, j->mesh->tets + 4 * t, ranks, &low, &high)) continue;
        for (unsigned level = low; level < high; level++) {
            size_t corners = CASES[case_of(ranks, level)].count;
            *edges += corners;
            *triangles += corners - 2;
        }
    }
}

static tl_status count_pieces(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    job *j = arg;
    size_t piece = begin / TLI_SLICE_TETS, triangles = 0, edges = 0;
    count_piece(j, begin, end, &triangles, &edges);
    j->triangles[piece] = triangles;
    j->cut.starts[piece] = edges;
    return TL_OK;
}

/* ---- second pass: triangles between cut edges ---- */

/* The place of an edge among those of the piece, which begin at first; a new one if the table does
 * not have it. */
static uint32_t edge_slot(table *seen, tli_cut_edge *edges, size_t *count, tl_lidx a, tl_lidx b,
                          uint32_t level)
{
    uint64_t verts = tli_edge_key(a, b);
    uint32_t mark = seen->stamp << 8 | level;
    size_t mask = ((size_t)1 << TABLE_BITS) - 1;
    size_t at = tli_edge_hash(verts, level) & mask;
    while (seen->level_stamps[at] >> 8 == seen->stamp) {
        if (seen->verts[at] == verts && seen->level_stamps[at] == mark) return seen->slots[at];
        at = (at + 1) & mask;
    }
    seen->verts[at] = verts;
    seen->level_stamps[at] = mark;
    seen->slots[at] = (uint32_t)*count;
    seen->used++;
    edges[*count] = (tli_cut_edge){verts, level};
    return (uint32_t)(*count)++;
}

/* An empty table; what it forgets is found equal later. */
static void renew(table *seen)
{
    seen->used = 0;
    if (++seen->stamp >> 24 == 0) return;
    memset(seen->level_stamps, 0, sizeof seen->level_stamps);
    seen->stamp = 1;
}

static void march_tet(const job *j, table *seen, const tl_lidx *q, const unsigned ranks[4],
                      unsigned level, size_t first, size_t *count, tl_lidx **corners)
{
    unsigned set = case_of(ranks, level);
    uint32_t slots[4];
    for (unsigned i = 0; i < CASES[set].count; i++) {
        const uint8_t *ends = EDGES[CASES[set].edges[i]];
        slots[i] = (uint32_t)first +
                   edge_slot(seen, j->cut.edges + first, count, q[ends[0]], q[ends[1]], level);
    }
    for (unsigned i = 2; i < CASES[set].count; i++) {
        *(*corners)++ = slots[0];
        *(*corners)++ = slots[i - 1];
        *(*corners)++ = slots[i];
    }
}

static tl_status march_pieces(void *arg, size_t begin, size_t end, unsigned worker)
{
    job *j = arg;
    size_t piece = begin / TLI_SLICE_TETS, count = 0, first = j->cut.starts[piece];
    size_t triangle = j->triangles[piece];
    tl_lidx *corners = j->out->corners + 3 * triangle;
    table *seen = &j->tables[worker];
    j->cut.counts[piece] = 0;
    if (j->triangles[piece] == j->triangles[piece + 1]) return TL_OK;
    renew(seen);
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = j->mesh->tets + 4 * t;
        unsigned ranks[4], low, high;
        if (t % TLI_RANGE_TETS == 0 && !may_cut(j, t)) {
            t += TLI_RANGE_TETS - 1;
            continue;
        }
        if (!is_cut(j, q, ranks, &low, &high)) continue;
        for (unsigned level = low; level < high; level++) {
            if (seen->used > TABLE_FILL) renew(seen);
            march_tet(j, seen, q, ranks, level, first, &count, &corners);
        }
        if (!j->tets) continue;
        const size_t done = (size_t)(corners - j->out->corners) / 3;
        for (; triangle < done; triangle++) j->tets[triangle] = (tl_lidx)t;
    }
    j->cut.counts[piece] = count;
    return TL_OK;
}

static tl_status number_corners(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t i = 3 * begin; i < 3 * end; i++)
        j->out->corners[i] = j->numbers[j->out->corners[i]];
    return TL_OK;
}

/* ---- vertices ---- */

/* Ends of an edge, and the weight of the second, in an order that other meshes with that edge find,
 * too. */
static double cut_at(const job *j, const tli_cut_edge *e, size_t ends[2])
{
    ends[0] = (size_t)(e->verts >> 32);
    ends[1] = (size_t)(e->verts & UINT32_MAX);
    return tli_cut_weight(j->mesh->xyz, j->scalar, j->levels[e->level], ends);
}

void tli_slice_normal(const double a[3], const double b[3], double w, float normal[3])
{
    double n[3];
    for (int k = 0; k < 3; k++) n[k] = -tli_mix(a[k], b[k], w);
    double length = vec_length(n);
    bool usable = length > 0 && isfinite(length);
    for (int k = 0; k < 3; k++) normal[k] = usable ? (float)(n[k] / length) : 0;
}

static void set_values(const job *j, size_t vert, const size_t ends[2], double w)
{
    for (size_t c = 0; c < j->opts->channel_count; c++) {
        const tl_channel *channel = &j->mesh->channels[j->opts->channels[c]];
        size_t n = channel->on == TL_ON_VERTEX ? channel->components : 0;
        for (size_t k = 0; k < n; k++)
            j->values[c][n * vert + k] =
                tli_mix(channel->values[n * ends[0] + k], channel->values[n * ends[1] + k], w);
    }
}

static tl_status set_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t vert = begin; vert < end; vert++) {
        size_t ends[2];
        double w = cut_at(j, &j->unique[vert], ends);
        for (size_t k = 0; k < 3; k++)
            j->out->xyz[3 * vert + k] =
                tli_mix(j->mesh->xyz[3 * ends[0] + k], j->mesh->xyz[3 * ends[1] + k], w);
        if (j->out->normals)
            tli_slice_normal(j->opts->gradients + 3 * ends[0], j->opts->gradients + 3 * ends[1], w,
                             j->out->normals + 3 * vert);
        if (j->ends)
            j->ends[vert] =
                (tli_slice_end){{(tl_lidx)ends[0], (tl_lidx)ends[1]}, j->unique[vert].level, w};
        set_values(j, vert, ends, w);
    }
    return TL_OK;
}

static tl_status make_verts(job *j)
{
    tl_status st = TL_OK;
    size_t count = j->out->vert_count;
    j->out->xyz = tl_mem_alloc(j->ctx, count, 3 * sizeof *j->out->xyz, &st);
    if (j->opts->gradients)
        j->out->normals = tl_mem_alloc(j->ctx, count, 3 * sizeof *j->out->normals, &st);
    j->values = tl_mem_zalloc(j->ctx, j->opts->channel_count, sizeof *j->values, &st);
    for (size_t c = 0; !st && c < j->opts->channel_count; c++) {
        tl_channel own = j->mesh->channels[j->opts->channels[c]];
        const size_t own_count = own.on == TL_ON_VERTEX ? count : 0;
        own.on = TL_ON_VERTEX;
        own.values = j->values[c] =
            tl_mem_alloc(j->ctx, own_count, own.components * sizeof(double), &st);
        if (!st) st = tl_polydata_adopt_channel(j->ctx, j->out, &own);
        if (st) tl_mem_free(j->ctx, j->values[c]);
    }
    if (!st) st = tli_parallel(j->ctx, count, GRAIN, set_verts, j);
    tl_mem_free(j->ctx, j->values);
    return st;
}

/* ---- values of tets ---- */

/* An array [vert_count][components] as it is of each corner of triangles [count]. */
static tl_status part_values(job *j, size_t bytes, const void *shared, void **parted)
{
    tl_status st = TL_OK;
    const size_t count = 3 * j->out->cell_count;
    char *made = tl_mem_alloc(j->ctx, count, bytes, &st);
    for (size_t i = 0; !st && i < count; i++)
        memcpy(made + i * bytes, (const char *)shared + j->out->corners[i] * bytes, bytes);
    *parted = made;
    return st;
}

static tl_status part_channel(job *j, const tl_channel *from, tl_channel *own)
{
    tl_status st = TL_OK;
    const size_t n = from->components, bytes = n * sizeof(double), count = 3 * j->out->cell_count;
    void *made = NULL;
    if (from->on == TL_ON_VERTEX) {
        st = part_values(j, bytes, own->values, &made);
    } else {
        double *values = made = tl_mem_alloc(j->ctx, count, bytes, &st);
        for (size_t i = 0; !st && i < count; i++)
            memcpy(values + n * i, from->values + n * j->tets[i / 3], bytes);
    }
    if (st) return st;
    tli_free_const(j->ctx, own->values);
    own->values = made;
    return TL_OK;
}

/* Gives each triangle vertices of its own, with the values of its tet. */
static tl_status part_triangles(job *j)
{
    void *made = NULL;
    tl_polydata *out = j->out;
    if (3 * out->cell_count >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED,
                       "a slice of %zu triangles with values of tets is too large",
                       out->cell_count);
    tl_status st = part_values(j, 3 * sizeof *out->xyz, out->xyz, &made);
    if (!st) {
        tl_mem_free(j->ctx, out->xyz);
        out->xyz = made;
    }
    if (!st && out->normals) {
        st = part_values(j, 3 * sizeof *out->normals, out->normals, &made);
        if (!st) {
            tl_mem_free(j->ctx, out->normals);
            out->normals = made;
        }
    }
    for (size_t c = 0; !st && c < out->channel_count; c++)
        st = part_channel(j, &j->mesh->channels[j->opts->channels[c]], &out->channels[c]);
    out->vert_count = 3 * out->cell_count;
    for (size_t i = 0; !st && i < out->vert_count; i++) out->corners[i] = (tl_lidx)i;
    return st;
}

/* ---- the slice ---- */

tl_status tli_slice_values_check(tl_ctx *ctx, const double *values, size_t value_count)
{
    if (!value_count || value_count > TL_SLICE_VALUES_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "a slice takes 1 to %u values, not %zu",
                       TL_SLICE_VALUES_MAX, value_count);
    for (size_t k = 0; k < value_count; k++)
        if (!isfinite(values[k]))
            return tl_fail(ctx, TL_ERR_ARG, "value %zu of a slice is not finite", k);
    return TL_OK;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void tli_slice_values_sort(const double *values, size_t value_count, double *sorted)
{
    memcpy(sorted, values, value_count * sizeof *sorted);
    qsort(sorted, value_count, sizeof *sorted, by_value);
}

tl_status tli_carried_check(tl_ctx *ctx, const tl_mesh *mesh, const size_t *channels,
                            size_t channel_count)
{
    for (size_t c = 0; c < channel_count; c++)
        if (channels[c] >= mesh->channel_count || mesh->channels[channels[c]].on != TL_ON_VERTEX)
            return tl_fail(ctx, TL_ERR_ARG, "channel %zu can't be carried: it is none on vertices",
                           channels[c]);
    return TL_OK;
}

static tl_status take_opts(tl_ctx *ctx, const tl_mesh *mesh, const tl_slice_opts *o)
{
    tl_status st = tli_slice_values_check(ctx, o->values, o->value_count);
    if (st) return st;
    for (size_t c = 0; c < o->channel_count; c++)
        if (o->channels[c] >= mesh->channel_count)
            return tl_fail(ctx, TL_ERR_ARG, "channel %zu can't be carried: the mesh has %zu",
                           o->channels[c], mesh->channel_count);
    if (o->ranges && o->ranges->tet_count != mesh->tet_count)
        return tl_fail(ctx, TL_ERR_ARG, "the range index is that of %zu tets, the mesh has %zu",
                       o->ranges->tet_count, mesh->tet_count);
    return TL_OK;
}

static bool carries_tets(const job *j)
{
    bool any = false;
    for (size_t c = 0; c < j->opts->channel_count; c++)
        any |= j->mesh->channels[j->opts->channels[c]].on == TL_ON_TET;
    return any;
}

/* Triangles between cut edges, and all cut edges. */
static tl_status march(job *j)
{
    tl_status st = TL_OK;
    size_t tets = j->mesh->tet_count, pieces = j->cut.piece_count;
    j->ranks = tl_mem_alloc(j->ctx, j->mesh->vert_count, 1, &st);
    j->triangles = tl_mem_alloc(j->ctx, pieces + 1, sizeof *j->triangles, &st);
    j->cut.starts = tl_mem_alloc(j->ctx, pieces + 1, sizeof *j->cut.starts, &st);
    j->cut.counts = tl_mem_alloc(j->ctx, pieces, sizeof *j->cut.counts, &st);
    j->tables = tl_mem_zalloc(j->ctx, tl_ctx_thread_count(j->ctx), sizeof *j->tables, &st);
    if (!st) st = tli_parallel(j->ctx, j->mesh->vert_count, GRAIN, rank_verts, j);
    if (!st) st = tli_parallel(j->ctx, tets, TLI_SLICE_TETS, count_pieces, j);
    if (st) return st;
    j->out->cell_count = tli_make_starts(j->triangles, pieces);
    size_t edges = tli_make_starts(j->cut.starts, pieces);
    if (edges >= TL_NONE || j->out->cell_count >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED, "a slice of %zu cut edges is too large", edges);
    j->cut.edges = tl_mem_alloc(j->ctx, edges, sizeof *j->cut.edges, &st);
    j->numbers = tl_mem_alloc(j->ctx, edges, sizeof *j->numbers, &st);
    j->out->corners = tl_mem_alloc(j->ctx, j->out->cell_count, 3 * sizeof *j->out->corners, &st);
    if (carries_tets(j)) j->tets = tl_mem_alloc(j->ctx, j->out->cell_count, sizeof *j->tets, &st);
    if (!st) st = tli_parallel(j->ctx, tets, TLI_SLICE_TETS, march_pieces, j);
    return st;
}

tl_slice_opts tl_slice_opts_defaults(void)
{
    return (tl_slice_opts){.struct_bytes = sizeof(tl_slice_opts)};
}

tl_status tl_slice_mesh(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                        const tl_slice_opts *opts, tl_polydata **triangles)
{
    return tli_slice_mesh(ctx, mesh, scalar, opts, triangles, NULL);
}

tl_status tli_slice_mesh(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                         const tl_slice_opts *opts, tl_polydata **triangles, tli_slice_end **ends)
{
    tl_slice_opts own = tl_slice_opts_defaults();
    *triangles = NULL;
    tl_status st = tli_opts_take(ctx, "tl_slice_opts", opts, &own, sizeof own);
    if (!st) st = take_opts(ctx, mesh, &own);
    if (st) return st;
    job j = {.ctx = ctx,
             .mesh = mesh,
             .scalar = scalar,
             .ranges = own.ranges,
             .level_count = own.value_count,
             .opts = &own,
             .cut.piece_count = (mesh->tet_count + TLI_SLICE_TETS - 1) / TLI_SLICE_TETS};
    tli_slice_values_sort(own.values, own.value_count, j.levels);
    j.out = tl_mem_zalloc(ctx, 1, sizeof *j.out, &st);
    if (!st) j.out->kind = TL_POLY_TRIANGLES;
    if (!st) st = march(&j);
    if (!st) st = tli_weld_edges(ctx, &j.cut, j.numbers, &j.unique, &j.out->vert_count);
    if (!st && ends) j.ends = tl_mem_alloc(ctx, j.out->vert_count, sizeof *j.ends, &st);
    if (!st) st = tli_parallel(ctx, j.out->cell_count, GRAIN, number_corners, &j);
    if (!st) st = make_verts(&j);
    if (!st && j.tets) st = part_triangles(&j);
    tl_mem_free(ctx, j.tets);
    tl_mem_free(ctx, j.unique);
    tl_mem_free(ctx, j.tables);
    tl_mem_free(ctx, j.numbers);
    tl_mem_free(ctx, j.cut.edges);
    tl_mem_free(ctx, j.cut.counts);
    tl_mem_free(ctx, j.cut.starts);
    tl_mem_free(ctx, j.triangles);
    tl_mem_free(ctx, j.ranks);
    if (st) {
        tl_mem_free(ctx, j.ends);
        tl_polydata_destroy(ctx, j.out);
        return st;
    }
    if (ends) *ends = j.ends;
    *triangles = j.out;
    return TL_OK;
}
