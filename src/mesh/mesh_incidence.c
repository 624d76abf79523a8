/* Vertex-to-tet incidence: a counting sort of the corners by vertex, in two passes. The first deals
 * the corners out to ranges of vertices, straight into the part of the result that belongs to the
 * range; the second sorts each range by vertex, in the cache. Both read and write memory in order
 * whatever the numbering of the mesh. Beside the result it takes 8 bytes a tet. */
#include "mesh/mesh.h"
#include "mesh/mesh_bucket.h"

#include <string.h>

/* Corners a range is meant to hold: ids and numbers, in and out, are 10 bytes each. */
#define RANGE_CORNERS 16384
/* A vertex's number in its range is kept in 16 bits. */
#define RANGE_SHIFT_MAX 16

typedef struct scratch {
    tl_lidx *ids;
    size_t room;
} scratch;

typedef struct incidence {
    tl_ctx *ctx;
    const tl_lidx *tets;
    size_t vert_count;
    tli_buckets buckets;
    uint16_t *locals;   /* [4 * tet_count] the vertex's number in its range */
    tl_lidx *offsets;   /* the result */
    tl_lidx *tet_ids;   /* the result; after the first pass: grouped by range only */
    scratch *scratches; /* one a worker */
} incidence;

static tl_status count_corners(void *arg, size_t begin, size_t end, unsigned worker)
{
    incidence *in = arg;
    (void)worker;
    tl_status st = tli_tets_check(in->ctx, in->tets, begin, end, in->vert_count);
    if (st) return st;
    uint32_t *counts = tli_buckets_row(&in->buckets, begin);
    unsigned shift = in->buckets.shift;
    for (size_t i = 4 * begin; i < 4 * end; i++) counts[in->tets[i] >> shift]++;
    return TL_OK;
}

static tl_status deal_corners(void *arg, size_t begin, size_t end, unsigned worker)
{
    incidence *in = arg;
    (void)worker;
    uint32_t *places = tli_buckets_row(&in->buckets, begin);
    unsigned shift = in->buckets.shift;
    tl_lidx mask = (tl_lidx)(((uint64_t)1 << shift) - 1);
    for (size_t i = 4 * begin; i < 4 * end; i++) {
        tl_lidx v = in->tets[i];
        uint32_t place = places[v >> shift]++;
        in->tet_ids[place] = (tl_lidx)(i / 4);
        in->locals[place] = (uint16_t)(v & mask);
    }
    return TL_OK;
}

/* Copies the ids of a range aside, counts its vertices, and puts the ids in place. */
static tl_status sort_range(incidence *in, size_t range, scratch *s)
{
    const tli_buckets *b = &in->buckets;
    size_t begin = b->begins[range], count = b->begins[range + 1] - begin;
    size_t first_vert = range << b->shift;
    size_t vert_count = in->vert_count - first_vert < (size_t)1 << b->shift
                            ? in->vert_count - first_vert
                            : (size_t)1 << b->shift;
    if (s->room < count) {
        tl_status st = TL_OK;
        tl_mem_free(in->ctx, s->ids);
        s->room = 0;
        s->ids = tl_mem_alloc(in->ctx, count + count / 4, sizeof *s->ids, &st);
        if (st) return st;
        s->room = count + count / 4;
    }
    const uint16_t *locals = in->locals + begin;
    tl_lidx *offsets = in->offsets + first_vert;
    memset(offsets, 0, vert_count * sizeof *offsets);
    for (size_t i = 0; i < count; i++) offsets[locals[i]]++;
    uint32_t place = (uint32_t)begin;
    for (size_t v = 0; v < vert_count; v++) {
        uint32_t degree = offsets[v];
        offsets[v] = place;
        place += degree;
    }
    if (count) memcpy(s->ids, in->tet_ids + begin, count * sizeof *s->ids);
    for (size_t i = 0; i < count; i++) in->tet_ids[offsets[locals[i]]++] = s->ids[i];
    /* Every cursor now stands where the next vertex begins. */
    if (vert_count) memmove(offsets + 1, offsets, (vert_count - 1) * sizeof *offsets);
    if (vert_count) offsets[0] = (tl_lidx)begin;
    return TL_OK;
}

static tl_status sort_ranges(void *arg, size_t begin, size_t end, unsigned worker)
{
    incidence *in = arg;
    tl_status st = TL_OK;
    for (size_t range = begin; range < end && !st; range++)
        st = sort_range(in, range, &in->scratches[worker]);
    return st;
}

static tl_status run_passes(incidence *in, size_t tet_count)
{
    tli_buckets *b = &in->buckets;
    tl_status st = tli_parallel(in->ctx, tet_count, b->piece_tets, count_corners, in);
    if (st) return st;
    tli_buckets_place(b);
    st = tli_parallel(in->ctx, tet_count, b->piece_tets, deal_corners, in);
    if (!st) st = tli_parallel(in->ctx, b->bucket_count, 1, sort_ranges, in);
    in->offsets[in->vert_count] = (tl_lidx)(4 * tet_count);
    return st;
}

tl_status tl_tets_incidence(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count, size_t vert_count,
                            tl_lidx **offsets, tl_lidx **tet_ids)
{
    *offsets = *tet_ids = NULL;
    if (tet_count > TL_MESH_TETS_MAX || vert_count > TL_MESH_VERTS_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "%zu tets of %zu vertices are too many", tet_count,
                       vert_count);
    incidence in = {.ctx = ctx, .tets = tets, .vert_count = vert_count};
    unsigned threads = tl_ctx_thread_count(ctx);
    tl_status st = tli_buckets_open(ctx, tet_count, vert_count, 4 * tet_count, RANGE_CORNERS,
                                    RANGE_SHIFT_MAX, &in.buckets);
    in.locals = tl_mem_alloc(ctx, 4 * tet_count, sizeof *in.locals, &st);
    in.offsets = tl_mem_alloc(ctx, vert_count + 1, sizeof *in.offsets, &st);
    in.tet_ids = tl_mem_alloc(ctx, 4 * tet_count, sizeof *in.tet_ids, &st);
    in.scratches = tl_mem_zalloc(ctx, threads, sizeof *in.scratches, &st);
    if (!st) st = run_passes(&in, tet_count);
    for (unsigned w = 0; in.scratches && w < threads; w++) tl_mem_free(ctx, in.scratches[w].ids);
    tl_mem_free(ctx, in.scratches);
    tl_mem_free(ctx, in.locals);
    tli_buckets_close(ctx, &in.buckets);
    if (st) {
        tl_mem_free(ctx, in.tet_ids);
        tl_mem_free(ctx, in.offsets);
        return st;
    }
    *offsets = in.offsets;
    *tet_ids = in.tet_ids;
    return TL_OK;
}

tl_status tl_mesh_incidence(tl_ctx *ctx, const tl_mesh *mesh, tl_lidx **offsets, tl_lidx **tet_ids)
{
    return tl_tets_incidence(ctx, mesh->tets, mesh->tet_count, mesh->vert_count, offsets, tet_ids);
}
