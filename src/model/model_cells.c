/* Octrees that are turned from level to level, their leaves merged to cells of equal content
 * (Sondershaus 2007, 6.3.2), and Voronoi cells (model_voronoi.c) behind one interface. */
#include "model/model_cells.h"

#include <math.h>
#include <string.h>

#include "model/model.h"
#include "segment/segment_octree.h"

/* Leaves of the octree that make up a cell. */
enum { CELL_LEAVES = 24 };

struct tli_cells {
    tl_ctx *ctx;
    size_t count;
    tli_seed *seeds; /* [count]; NULL: the octree */
    tli_octree octree;
};

/* ---- samples ---- */

static void add_shape(const double p[4][3], double shape[6])
{
    static const int ends[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    double own[6] = {0};
    for (int e = 0; e < 6; e++) {
        double d[3];
        for (int k = 0; k < 3; k++) d[k] = p[ends[e][1]][k] - p[ends[e][0]][k];
        const double products[6] = {d[0] * d[0], d[1] * d[1], d[2] * d[2],
                                    d[0] * d[1], d[0] * d[2], d[1] * d[2]};
        for (int k = 0; k < 6; k++) own[k] += products[k];
    }
    double size = own[0] + own[1] + own[2];
    for (int k = 0; size > 0 && k < 6; k++) shape[k] += own[k] / size;
}

void tli_sampling_set(const double *xyz, const tl_lidx *tets, const tl_lidx *list, size_t count,
                      tli_sampling *sampling)
{
    memset(sampling->shape, 0, sizeof sampling->shape);
    for (size_t i = 0; i < TLI_SAMPLES; i++) {
        const tl_lidx *tet = tets + 4 * (size_t)list[(2 * i + 1) * count / (2 * TLI_SAMPLES)];
        double p[4][3];
        for (int c = 0; c < 4; c++) memcpy(p[c], xyz + 3 * (size_t)tet[c], sizeof p[c]);
        for (int k = 0; k < 3; k++)
            sampling->at[i][k] = p[0][k] / 4 + p[1][k] / 4 + p[2][k] / 4 + p[3][k] / 4;
        add_shape((const double(*)[3])p, sampling->shape);
    }
}

/* ---- octrees ---- */

/* A patch's samples stand for equally many tets; patches of different sizes for each other. */
static tl_status hand_over(void *user, uint64_t first, size_t count, double *xyz, uint8_t *missing)
{
    const tli_patch_note *patches = user;
    (void)missing;
    for (size_t i = 0; i < count; i++, xyz += 3) {
        uint64_t at = first + i;
        memcpy(xyz, patches[at / TLI_SAMPLES].sampling->at[at % TLI_SAMPLES], 3 * sizeof *xyz);
    }
    return TL_OK;
}

/* By 45 degrees around an axis between the two shortest sides of the box. */
static void turn(const double bounds[6], double rows[9])
{
    int longest = 0;
    for (int k = 1; k < 3; k++)
        if (bounds[2 * k + 1] - bounds[2 * k] > bounds[2 * longest + 1] - bounds[2 * longest])
            longest = k;
    const double c = sqrt(0.5), s = sqrt(0.5);
    double axis[3] = {c, c, c};
    axis[longest] = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double across = i == j ? 0 : (j == (i + 1) % 3 ? -s : s) * axis[3 - i - j];
            rows[3 * i + j] = (1 - c) * axis[i] * axis[j] + (i == j ? c : 0) + across;
        }
}

/* Leaves count samples, where the merging should count tets. */
static tl_status weigh_leaves(const tli_model *m, size_t first, size_t end, tli_octree *octree)
{
    tl_status st = TL_OK;
    double *tets = tl_mem_zalloc(m->ctx, octree->leaf_count, sizeof *tets, &st);
    for (size_t p = first; !st && p < end; p++)
        for (size_t i = 0; i < TLI_SAMPLES; i++)
            tets[tli_octree_leaf(octree, m->patches[p].sampling->at[i])] +=
                (double)m->patches[p].tet_count / TLI_SAMPLES;
    for (size_t l = 0; !st && l < octree->leaf_count; l++)
        octree->counts[l] = (uint64_t)ceil(tets[l]);
    tl_mem_free(m->ctx, tets);
    return st;
}

static tl_status make_octree(const tli_model *m, uint32_t level, size_t first, size_t end,
                             tli_cells *cells)
{
    double rows[9];
    uint64_t samples = (end - first) * (uint64_t)TLI_SAMPLES;
    tli_octree_opts opts = {.leaf_points = samples / (cells->count * CELL_LEAVES) + 1,
                            .memory_bytes = (uint64_t)1 << 24,
                            .stage = "partition"};
    turn(m->plan->bounds, rows);
    if (level % 2 == 0) opts.rotation = rows; /* the segments of the input are not turned */
    tl_status st =
        tli_octree_build(m->ctx, samples, hand_over, m->patches + first, &opts, &cells->octree);
    if (!st) st = weigh_leaves(m, first, end, &cells->octree);
    if (!st) st = tli_octree_merge(&cells->octree, (uint32_t)cells->count);
    return st;
}

/* ---- Voronoi cells ---- */

static tl_status make_voronoi(const tli_model *m, size_t first, size_t end, tli_cells *cells)
{
    tl_status st = TL_OK;
    const tli_sampling **samplings = tl_mem_alloc(m->ctx, end - first, sizeof *samplings, &st);
    double *weights = tl_mem_alloc(m->ctx, end - first, sizeof *weights, &st);
    for (size_t p = first; !st && p < end; p++) {
        samplings[p - first] = m->patches[p].sampling;
        weights[p - first] = (double)m->patches[p].tet_count / TLI_SAMPLES;
    }
    if (!st)
        st = tli_voronoi_create(m->ctx, samplings, weights, end - first, cells->count,
                                &cells->seeds);
    tl_mem_free(m->ctx, weights);
    tl_mem_free(m->ctx, (void *)(uintptr_t)samplings);
    return st;
}

/* ---- both ---- */

tl_status tli_cells_create(const tli_model *m, uint32_t level, size_t first, size_t end,
                           double ratio, tli_cells **out)
{
    tl_status st = TL_OK;
    double tets = 0;
    *out = NULL;
    for (size_t p = first; p < end; p++) tets += m->patches[p].tet_count;
    size_t count = (size_t)(ratio * tets / m->plan->opts.segment_tets + 0.5);
    if (count < 2 || m->plan->opts.partition == TL_PARTITION_CLUSTER) return TL_OK;
    tli_cells *cells = tl_mem_zalloc(m->ctx, 1, sizeof *cells, &st);
    if (st) return st;
    cells->ctx = m->ctx;
    cells->count = count;
    st = m->plan->opts.partition == TL_PARTITION_OCTREE ? make_octree(m, level, first, end, cells)
                                                        : make_voronoi(m, first, end, cells);
    if (st)
        tli_cells_destroy(cells);
    else
        *out = cells;
    return st;
}

void tli_cells_destroy(tli_cells *cells)
{
    if (!cells) return;
    tli_octree_close(&cells->octree);
    tl_mem_free(cells->ctx, cells->seeds);
    tl_mem_free(cells->ctx, cells);
}

tl_status tli_cells_find(tl_ctx *ctx, const tli_cells *cells, const tl_mesh *mesh,
                         uint32_t *cell_of)
{
    tl_status st = TL_OK;
    double(*centres)[3] = tl_mem_alloc(ctx, mesh->tet_count, sizeof *centres, &st);
    uint32_t *near = tl_mem_alloc(ctx, cells->count, sizeof *near, &st);
    for (size_t t = 0; !st && t < mesh->tet_count; t++) {
        double p[4][3];
        tli_tet_corners(mesh->xyz, mesh->tets + 4 * t, p);
        for (int k = 0; k < 3; k++)
            centres[t][k] = p[0][k] / 4 + p[1][k] / 4 + p[2][k] / 4 + p[3][k] / 4;
        if (!cells->seeds) cell_of[t] = tli_octree_find(&cells->octree, centres[t]);
    }
    if (!st && cells->seeds)
        tli_voronoi_find(cells->seeds, cells->count, (const double(*)[3])centres, mesh->tet_count,
                         near, cell_of);
    tl_mem_free(ctx, near);
    tl_mem_free(ctx, centres);
    return st;
}
