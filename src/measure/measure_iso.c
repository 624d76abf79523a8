/* Isosurfaces by marching tets, for the space error of Sondershaus 2007, 3.1.1: in a tet with a
 * linear field the surface is a triangle or a flat quadrilateral. Corners on the same edge are one
 * vertex, always interpolated from its smaller index, so that identical meshes give identical
 * surfaces whatever the order of their tets' corners. */
#include <math.h>

#include "base/base_sort.h"
#include "measure/measure.h"
#include "mesh/mesh_edge.h"

enum { ISO_GRAIN = 16384 }; /* tets of a piece */

typedef struct iso_job {
    const tl_mesh *mesh;
    const double *values;
    double value;
    size_t *offsets; /* [pieces + 1] triangles of the pieces before */
    uint64_t *keys;  /* [3 * triangles] edges of the corners; NULL: count only */
} iso_job;

/* Writes the edges of the triangles of one tet, three a triangle, and returns their count. */
static size_t march_tet(const iso_job *job, const tl_lidx corners[4], uint64_t edges[6])
{
    tl_lidx above[4], below[4];
    int above_count = 0, below_count = 0;
    for (int i = 0; i < 4; i++) {
        double f = job->values[corners[i]];
        if (!isfinite(f)) return 0;
        if (f >= job->value)
            above[above_count++] = corners[i];
        else
            below[below_count++] = corners[i];
    }
    if (above_count == 0 || below_count == 0) return 0;
    if (above_count != 2) {
        tl_lidx tip = above_count == 1 ? above[0] : below[0];
        const tl_lidx *base = above_count == 1 ? below : above;
        for (int i = 0; i < 3; i++) edges[i] = tli_edge_key(tip, base[i]);
        return 1;
    }
    const uint64_t ring[4] = {tli_edge_key(above[0], below[0]), tli_edge_key(above[0], below[1]),
                              tli_edge_key(above[1], below[1]), tli_edge_key(above[1], below[0])};
    const int split[6] = {0, 1, 2, 0, 2, 3};
    for (int i = 0; i < 6; i++) edges[i] = ring[split[i]];
    return 2;
}

static tl_status march_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const iso_job *job = arg;
    size_t piece = begin / ISO_GRAIN, count = 0;
    uint64_t *out = job->keys ? job->keys + 3 * job->offsets[piece] : NULL;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        uint64_t edges[6];
        size_t found = march_tet(job, job->mesh->tets + 4 * t, edges);
        for (size_t i = 0; out && i < 3 * found; i++) out[3 * count + i] = edges[i];
        count += found;
    }
    if (!job->keys) job->offsets[piece + 1] = count;
    return TL_OK;
}

static void cut_edge(const iso_job *job, uint64_t key, double xyz[3])
{
    size_t low = (size_t)(key >> 32), high = (size_t)(key & UINT32_MAX);
    /* halves, since the difference of two values may be too large for a double */
    double from = job->values[low] / 2, to = job->values[high] / 2;
    double t = (job->value / 2 - from) / (to - from);
    t = t > 0 ? fmin(t, 1) : 0;
    const double *p = job->mesh->xyz + 3 * low, *q = job->mesh->xyz + 3 * high;
    for (int k = 0; k < 3; k++) xyz[k] = p[k] + t * (q[k] - p[k]);
}

/* Corners with the same edge become one vertex. */
static tl_status merge_corners(tl_ctx *ctx, const iso_job *job, size_t triangle_count,
                               tli_surface *surface)
{
    tl_status st = TL_OK;
    size_t corner_count = 3 * triangle_count, vert_count = 0;
    uint32_t *ids = tl_mem_alloc(ctx, corner_count, sizeof *ids, &st);
    tl_lidx *triangles = tl_mem_alloc(ctx, corner_count, sizeof *triangles, &st);
    double *xyz = NULL;
    for (size_t i = 0; !st && i < corner_count; i++) ids[i] = (uint32_t)i;
    if (!st) st = tli_sort_u64(ctx, job->keys, ids, corner_count);
    for (size_t i = 0; !st && i < corner_count; i++) {
        if (i == 0 || job->keys[i] != job->keys[i - 1]) job->keys[vert_count++] = job->keys[i];
        triangles[ids[i]] = (tl_lidx)(vert_count - 1);
    }
    xyz = tl_mem_alloc(ctx, vert_count, 3 * sizeof *xyz, &st);
    for (size_t v = 0; !st && v < vert_count; v++) cut_edge(job, job->keys[v], xyz + 3 * v);
    if (!st) st = tli_surface_create(ctx, xyz, vert_count, triangles, triangle_count, surface);
    tl_mem_free(ctx, xyz);
    tl_mem_free(ctx, triangles);
    tl_mem_free(ctx, ids);
    return st;
}

tl_status tli_iso_surface(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel, double value,
                          tli_surface *surface)
{
    TL_ASSERT(channel->components == 1 && channel->on == TL_ON_VERTEX);
    tl_status st = TL_OK;
    size_t piece_count = (mesh->tet_count + ISO_GRAIN - 1) / ISO_GRAIN;
    *surface = (tli_surface){.ctx = ctx};
    iso_job job = {.mesh = mesh, .values = channel->values, .value = value};
    job.offsets = tl_mem_zalloc(ctx, piece_count + 1, sizeof *job.offsets, &st);
    if (!st) st = tli_parallel(ctx, mesh->tet_count, ISO_GRAIN, march_range, &job);
    for (size_t i = 0; !st && i < piece_count; i++) job.offsets[i + 1] += job.offsets[i];
    size_t triangle_count = st ? 0 : job.offsets[piece_count];
    if (!st && triangle_count > UINT32_MAX / 3)
        st = tl_fail(ctx, TL_ERR_UNSUPPORTED,
                     "the isosurface %.9g of '%s' has %zu triangles, more than %u can be compared",
                     value, channel->name, triangle_count, UINT32_MAX / 3);
    job.keys = tl_mem_alloc(ctx, 3 * triangle_count, sizeof *job.keys, &st);
    if (!st) st = tli_parallel(ctx, mesh->tet_count, ISO_GRAIN, march_range, &job);
    if (!st) st = merge_corners(ctx, &job, triangle_count, surface);
    tl_mem_free(ctx, job.keys);
    tl_mem_free(ctx, job.offsets);
    return st;
}
