/* Points that lie at one place become one, so that blocks that were written apart hang together.
 * Points are hashed by the cells of a grid of at least the distance (without one, by their
 * coordinates); each looks into its cell and the neighbours for the point of the smallest index
 * that is near. Only points that stayed themselves draw others, in the order of their indices, so
 * the result depends on the file alone and no chain of near points shrinks a mesh. */
#include "base/base_vec.h"
#include "formats/formats_grid.h"
#include "formats/formats_split.h"

#include <math.h>
#include <string.h>

/* Cells along an axis at most. */
#define CELLS_MAX 0x1p50

/* A hash table of cells with chains of points. */
typedef struct weld_table {
    const double *xyz;
    double low[3], distance;
    double cell; /* half the width of a cell, so that no difference overflows */
    size_t mask;
    tl_lidx *heads; /* [mask + 1] first point that stayed itself, or TL_NONE */
    tl_lidx *next;  /* [point_count] the next one of the same chain */
} weld_table;

static size_t hash_cell(const weld_table *t, const int64_t at[3])
{
    uint64_t h = 0;
    for (int axis = 0; axis < 3; axis++) {
        h ^= (uint64_t)at[axis];
        h *= 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
    }
    return (size_t)h & t->mask;
}

/* False for a point that is not finite: it is welded to none. */
static bool cell_of(const weld_table *t, const double *p, int64_t at[3])
{
    if (!vec_is_finite(p)) return false;
    for (int axis = 0; axis < 3; axis++) {
        double x = p[axis] + 0.0; /* never -0 */
        if (t->distance == 0)
            memcpy(&at[axis], &x, sizeof x);
        else
            at[axis] = (int64_t)floor((x / 2 - t->low[axis] / 2) / t->cell);
    }
    return true;
}

static bool is_near(const weld_table *t, const double *p, const double *q)
{
    if (t->distance == 0) return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
    double d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= t->distance * t->distance;
}

/* The smallest point that stayed itself and is near, or TL_NONE. */
static tl_lidx find_near(const weld_table *t, const double *p, const int64_t at[3])
{
    int reach = t->distance > 0 ? 1 : 0;
    tl_lidx best = TL_NONE;
    for (int z = -reach; z <= reach; z++)
        for (int y = -reach; y <= reach; y++)
            for (int x = -reach; x <= reach; x++) {
                const int64_t near_cell[3] = {at[0] + x, at[1] + y, at[2] + z};
                for (tl_lidx q = t->heads[hash_cell(t, near_cell)]; q != TL_NONE; q = t->next[q])
                    if (q < best && is_near(t, p, t->xyz + 3 * (size_t)q)) best = q;
            }
    return best;
}

static void set_cells(weld_table *t, const double *xyz, size_t points)
{
    double high[3] = {0, 0, 0}, width = 0;
    bool any = false;
    for (size_t i = 0; i < points; i++) {
        const double *p = xyz + 3 * i;
        if (!vec_is_finite(p)) continue;
        for (int axis = 0; axis < 3; axis++) {
            if (!any || p[axis] < t->low[axis]) t->low[axis] = p[axis];
            if (!any || p[axis] > high[axis]) high[axis] = p[axis];
        }
        any = true;
    }
    for (int axis = 0; axis < 3; axis++) width = fmax(width, high[axis] / 2 - t->low[axis] / 2);
    t->cell = fmax(t->distance / 2, width / CELLS_MAX);
}

/* target [point_count]: what each point becomes. */
static tl_status find_targets(tl_ctx *ctx, const double *xyz, size_t points, double distance,
                              tl_lidx *target, uint64_t *welded)
{
    tl_status st = TL_OK;
    weld_table t = {.xyz = xyz, .distance = distance, .mask = 1};
    while (t.mask + 1 < points) t.mask = 2 * t.mask + 1;
    if (distance > 0) set_cells(&t, xyz, points);
    t.heads = tl_mem_alloc(ctx, t.mask + 1, sizeof *t.heads, &st);
    t.next = tl_mem_alloc(ctx, points, sizeof *t.next, &st);
    for (size_t i = 0; i <= t.mask && !st; i++) t.heads[i] = TL_NONE;
    for (size_t i = 0; i < points && !st; i++) {
        int64_t at[3];
        target[i] = (tl_lidx)i;
        if (!cell_of(&t, xyz + 3 * i, at)) continue;
        tl_lidx other = find_near(&t, xyz + 3 * i, at);
        if (other != TL_NONE) {
            target[i] = other;
            ++*welded;
            continue;
        }
        size_t slot = hash_cell(&t, at);
        t.next[i] = t.heads[slot];
        t.heads[slot] = (tl_lidx)i;
    }
    tl_mem_free(ctx, t.next);
    tl_mem_free(ctx, t.heads);
    return st;
}

static void replace(uint32_t *ids, uint64_t count, const tl_lidx *target)
{
    for (uint64_t i = 0; i < count; i++) ids[i] = target[ids[i]];
}

tl_status tli_grid_weld(tli_grid *grid, double distance, uint64_t *welded)
{
    tl_ctx *ctx = grid->ctx;
    *welded = 0;
    if (!(distance >= 0) || isinf(distance))
        return tl_fail(ctx, TL_ERR_ARG, "a distance of welding is finite and 0 or more, not %g",
                       distance);
    if (grid->point_count > TL_MESH_VERTS_MAX)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "%llu points are too many to weld",
                       (unsigned long long)grid->point_count);
    tl_status st = tli_grid_unstructure(grid);
    tl_lidx *target = tl_mem_alloc(ctx, (size_t)grid->point_count, sizeof *target, &st);
    if (!st) st = find_targets(ctx, grid->xyz, (size_t)grid->point_count, distance, target, welded);
    for (uint64_t c = 0; c < grid->cell_count && !st && *welded; c++) {
        uint64_t begin = grid->offsets ? grid->offsets[c] : 4 * c;
        uint64_t end = grid->offsets ? grid->offsets[c + 1] : 4 * c + 4;
        if (!grid->types || grid->types[c] != TLI_VTK_POLYHEDRON) /* a polyhedron names faces */
            replace(grid->connectivity + begin, end - begin, target);
    }
    if (!st && grid->face_count)
        replace(grid->face_points, grid->face_offsets[grid->face_count], target);
    for (uint32_t i = 0; i < grid->label_count && !st; i++)
        replace(grid->labels[i].points, grid->labels[i].offsets[grid->labels[i].face_count],
                target);
    tl_mem_free(ctx, target);
    return st;
}
