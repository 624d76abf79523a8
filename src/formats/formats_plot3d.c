/* PLOT3D: curvilinear blocks in a grid file, their flow in a solution (Q) file of its own, read as
 * a whole. formats_plot3d_layout.c tells the variant. */
#include "formats/formats_plot3d.h"

#include <inttypes.h>
#include <string.h>

/* ---- the grid ---- */

static tl_status make_blocks(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                             const tli_p3d_header *head, tli_grid *grid)
{
    if (head->points > TL_MESH_VERTS_MAX)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': %" PRIu64 " points, at most %u can be held",
                       from->path, head->points, TL_MESH_VERTS_MAX);
    tl_status st = tli_p3d_blocks(ctx, from, as, head, &grid->blocks);
    if (st) return st;
    grid->block_count = head->block_count;
    grid->point_count = head->points;
    grid->xyz = tl_mem_zalloc(ctx, (size_t)head->points, 3 * sizeof *grid->xyz, &st);
    if (as->blank) grid->blanks = tl_mem_alloc(ctx, (size_t)head->points, 1, &st);
    return st;
}

static tl_status read_points(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                             const tli_p3d_header *head, tli_grid *grid)
{
    tl_status st = TL_OK;
    uint64_t *places = tl_mem_alloc(ctx, grid->block_count, sizeof *places, &st);
    if (!st) st = tli_p3d_place_grid(ctx, from, as, head, grid->blocks, places);
    for (uint32_t b = 0; !st && b < grid->block_count; b++) {
        const tli_grid_block *block = &grid->blocks[b];
        const size_t count = (size_t)tli_p3d_block_points(block);
        uint64_t at = places[b];
        for (unsigned axis = 0; !st && axis < as->axes; axis++, at += (uint64_t)count * as->real)
            st = tli_p3d_gather(ctx, from, as, at, count, grid->xyz + 3 * block->first_point + axis,
                                3);
        if (!st && as->blank)
            tli_p3d_read_blanks(from, as, at, count, grid->blanks + block->first_point);
        if (!st) st = tl_progress(ctx, "reading", b + 1, grid->block_count);
    }
    tl_mem_free(ctx, places);
    return st;
}

/* ---- the solution ---- */

/* Adds the arrays that the variables go to. */
static tl_status add_arrays(const tli_p3d_layout *as, const tli_p3d_header *head, tli_grid *grid)
{
    const tl_scalar scalar = as->real == 4 ? TL_F32 : TL_F64;
    tl_status st = TL_OK;
    for (uint64_t i = 0; !st && i < tli_p3d_array_count(as, head); i++) {
        char name[48];
        tli_grid_array *array = NULL;
        st = tli_grid_add(grid, TL_ON_VERTEX, tli_p3d_array_name(head, i, name),
                          tli_p3d_array_components(i), scalar, NULL, &array);
        if (!st && i == 1) memset(array->values, 0, (size_t)array->count * 3 * sizeof(double));
    }
    return st;
}

static tl_status read_variables(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                                const tli_p3d_header *head, tli_grid *grid, uint32_t first_array)
{
    tl_status st = TL_OK;
    uint64_t *places = tl_mem_alloc(ctx, grid->block_count, sizeof *places, &st);
    if (!st) st = tli_p3d_place_solution(ctx, from, as, head, grid->blocks, places, &grid->time);
    for (uint32_t b = 0; !st && b < grid->block_count; b++) {
        const tli_grid_block *block = &grid->blocks[b];
        const size_t count = (size_t)tli_p3d_block_points(block);
        uint64_t at = places[b];
        for (uint64_t var = 0; !st && var < tli_p3d_variable_count(as, head); var++) {
            uint32_t component;
            const uint64_t array = tli_p3d_array_of(as, var, &component);
            const uint32_t stride = tli_p3d_array_components(array);
            double *values = grid->point_arrays[first_array + array].values;
            st = tli_p3d_gather(ctx, from, as, at, count,
                                values + block->first_point * stride + component, stride);
            at += (uint64_t)count * as->real;
        }
        if (!st) st = tl_progress(ctx, "reading", b + 1, grid->block_count);
    }
    tl_mem_free(ctx, places);
    return st;
}

static tl_status read_solution(tl_ctx *ctx, const char *path, unsigned axes, tli_grid *grid)
{
    tli_map map;
    tli_p3d_source from = {.path = path};
    tli_p3d_layout as = {0};
    tli_p3d_header head = {0};
    tl_status st = tli_map_open(ctx, path, &map);
    if (st) return st;
    st = tli_p3d_open(ctx, &map, path, &from);
    if (!st && !tli_p3d_find_solution(&from, grid->blocks, grid->block_count, axes, &as, &head))
        st = tli_p3d_fail_solution(ctx, &from, grid->blocks, grid->block_count);
    if (!st) tli_p3d_log_solution(ctx, &from, &as, &head);
    const uint32_t first_array = grid->point_array_count;
    if (!st) st = add_arrays(&as, &head, grid);
    if (!st) st = read_variables(ctx, &from, &as, &head, grid, first_array);
    tl_mem_free(ctx, from.numbers);
    tli_map_close(ctx, &map);
    return st;
}

tl_status tli_read_plot3d(tl_ctx *ctx, const tli_map *map, const char *path,
                          const tl_read_opts *opts, tli_grid *grid)
{
    tli_p3d_source from;
    tli_p3d_layout as = {0};
    tli_p3d_header head = {0};
    tl_status st = tli_p3d_open(ctx, map, path, &from);
    if (!st && !tli_p3d_find_grid(&from, &as, &head)) st = tli_p3d_fail_grid(ctx, &from);
    if (!st) tli_p3d_log_grid(ctx, &from, &as, &head);
    if (!st) st = make_blocks(ctx, &from, &as, &head, grid);
    if (!st) st = read_points(ctx, &from, &as, &head, grid);
    tl_mem_free(ctx, from.numbers);
    if (!st && opts->solution) st = read_solution(ctx, opts->solution, as.axes, grid);
    return st;
}
