/* VTK XML: unstructured grids. Pieces follow one another in the grid; cells of every type pass
 * through as they are, polyhedra with their faces (formats_vtu_faces.c). */
#include <string.h>

#include "formats/formats_split.h"
#include "formats/formats_vtkxml.h"

/* Numbers the pieces' points and cells and checks that the points of each are in the file. */
static tl_status place_pieces(tli_vx_file *file, tli_grid *grid)
{
    tl_status st = TL_OK;
    for (size_t p = 0; !st && p < file->piece_count; p++) {
        tli_vx_piece *piece = &file->pieces[p];
        tli_vx_array *points = tli_vx_find(file, piece, TLI_VX_POINTS, NULL);
        piece->first_point = grid->point_count;
        piece->first_cell = grid->cell_count;
        if (piece->point_count > TL_MESH_VERTS_MAX - grid->point_count)
            return tl_fail(file->ctx, TL_ERR_UNSUPPORTED, "more than %u points", TL_MESH_VERTS_MAX);
        if (piece->cell_count > SIZE_MAX / 16 - grid->cell_count)
            return tl_fail(file->ctx, TL_ERR_FORMAT, "piece %zu: %llu cells can't be", p + 1,
                           (unsigned long long)piece->cell_count);
        grid->point_count += piece->point_count;
        grid->cell_count += piece->cell_count;
        if (piece->point_count == 0) continue;
        if (!points)
            return tl_fail(file->ctx, TL_ERR_FORMAT, "piece %zu at byte %llu has no <Points>",
                           p + 1, (unsigned long long)piece->ofs);
        if (points->components != 0 && points->components != 3)
            return tl_fail(file->ctx, TL_ERR_FORMAT,
                           "piece %zu: points of %u components, expected 3", p + 1,
                           points->components);
        st = tli_vx_open_expecting(file, points, 3 * piece->point_count);
    }
    if (!st && file->piece_count > 1)
        tl_log(file->ctx, TL_LOG_INFO, "%zu pieces; points on their borders stay apart",
               file->piece_count);
    return st;
}

static tl_status read_points(tli_vx_file *file, tli_grid *grid)
{
    tl_status st = TL_OK;
    grid->xyz = tl_mem_alloc(file->ctx, (size_t)grid->point_count, 3 * sizeof *grid->xyz, &st);
    for (size_t p = 0; !st && p < file->piece_count; p++) {
        const tli_vx_piece *piece = &file->pieces[p];
        if (piece->point_count == 0) continue;
        tli_vx_target target = {.f64 = grid->xyz + 3 * piece->first_point};
        st = tli_vx_read(file, tli_vx_find(file, piece, TLI_VX_POINTS, NULL),
                         3 * piece->point_count, &target);
    }
    return st;
}

/* An array of the <Cells> of a piece, open, with count values at least. */
static tl_status find_cell_array(tli_vx_file *file, const tli_vx_piece *piece, const char *name,
                                 uint64_t count, tli_vx_array **array)
{
    *array = tli_vx_find(file, piece, TLI_VX_CELLS, name);
    if (!*array)
        return tl_fail(file->ctx, TL_ERR_FORMAT, "the piece at byte %llu has %llu cells, but no %s",
                       (unsigned long long)piece->ofs, (unsigned long long)piece->cell_count, name);
    return tli_vx_open_expecting(file, *array, count);
}

/* Opens what describes the cells of a piece. The number of its connectivity is known only from its
 * offsets, so that array may be longer. */
static tl_status open_cells(tli_vx_file *file, const tli_vx_piece *piece)
{
    tli_vx_array *array;
    if (piece->cell_count == 0) return TL_OK;
    tl_status st = find_cell_array(file, piece, "offsets", piece->cell_count, &array);
    if (!st) st = find_cell_array(file, piece, "types", piece->cell_count, &array);
    if (!st) st = find_cell_array(file, piece, "connectivity", 0, &array);
    return st ? st : tli_vx_open(file, array);
}

tl_status tli_vx_fail_offset(const tli_vx_file *file, const tli_vx_array *ends, uint64_t cell,
                             uint64_t end, uint64_t last)
{
    char label[128];
    tli_vx_label(ends, label, sizeof label);
    return tl_fail(file->ctx, TL_ERR_FORMAT,
                   "array %s: value %llu is %llu, expected at least %llu, the one before it", label,
                   (unsigned long long)cell, (unsigned long long)end, (unsigned long long)last);
}

/* Reads the ends of the cells of a piece behind the first *length entries of connectivity, which
 * grow by those of the piece. */
static tl_status read_offsets(tli_vx_file *file, const tli_vx_piece *piece, tli_grid *grid,
                              uint64_t *length)
{
    const tli_vx_array *ends = tli_vx_find(file, piece, TLI_VX_CELLS, "offsets");
    const tli_vx_array *points = tli_vx_find(file, piece, TLI_VX_CELLS, "connectivity");
    uint64_t *offsets = grid->offsets + piece->first_cell;
    tli_vx_target target = {.u64 = offsets + 1, .limit = points->value_count + 1, .add = *length};
    tl_status st = tli_vx_read(file, ends, piece->cell_count, &target);
    for (uint64_t i = 0; !st && i < piece->cell_count; i++)
        if (offsets[i + 1] < offsets[i])
            st = tli_vx_fail_offset(file, ends, i, offsets[i + 1] - *length, offsets[i] - *length);
    if (!st) *length = offsets[piece->cell_count];
    return st;
}

static tl_status read_connectivity(tli_vx_file *file, tli_grid *grid)
{
    tl_status st = TL_OK;
    uint64_t length = grid->offsets[grid->cell_count];
    grid->connectivity = tl_mem_alloc(file->ctx, (size_t)length, sizeof *grid->connectivity, &st);
    for (size_t p = 0; !st && p < file->piece_count; p++) {
        const tli_vx_piece *piece = &file->pieces[p];
        if (piece->cell_count == 0) continue;
        const tli_vx_array *points = tli_vx_find(file, piece, TLI_VX_CELLS, "connectivity");
        const tli_vx_array *types = tli_vx_find(file, piece, TLI_VX_CELLS, "types");
        uint64_t first = grid->offsets[piece->first_cell];
        uint64_t count = grid->offsets[piece->first_cell + piece->cell_count] - first;
        tli_vx_target target = {.u32 = grid->connectivity + first,
                                .limit = piece->point_count,
                                .add = piece->first_point};
        tli_vx_target kinds = {.u8 = grid->types + piece->first_cell, .limit = 256};
        if (count < points->value_count)
            tl_log(file->ctx, TL_LOG_WARNING,
                   "piece %zu: connectivity has %llu values, the cells use the first %llu", p + 1,
                   (unsigned long long)points->value_count, (unsigned long long)count);
        st = tli_vx_read(file, points, count, &target);
        if (!st) st = tli_vx_read(file, types, piece->cell_count, &kinds);
    }
    return st;
}

/* A grid of tets alone needs neither types nor offsets. */
static void drop_tet_types(tli_grid *grid)
{
    for (uint64_t i = 0; i < grid->cell_count; i++)
        if (grid->types[i] != TLI_VTK_TETRA || grid->offsets[i + 1] != 4 * (i + 1)) return;
    tl_mem_free(grid->ctx, grid->types);
    tl_mem_free(grid->ctx, grid->offsets);
    grid->types = NULL;
    grid->offsets = NULL;
}

static tl_status read_cells(tli_vx_file *file, tli_grid *grid)
{
    tl_status st = TL_OK;
    uint64_t length = 0;
    grid->offsets =
        tl_mem_alloc(file->ctx, (size_t)grid->cell_count + 1, sizeof *grid->offsets, &st);
    grid->types = tl_mem_alloc(file->ctx, (size_t)grid->cell_count, 1, &st);
    if (st) return st;
    grid->offsets[0] = 0;
    for (size_t p = 0; !st && p < file->piece_count; p++)
        if (file->pieces[p].cell_count) st = read_offsets(file, &file->pieces[p], grid, &length);
    if (!st) st = read_connectivity(file, grid);
    if (!st) st = tli_vx_read_faces(file, grid);
    if (!st) drop_tet_types(grid);
    return st;
}

tl_status tli_vx_unstructured_open(tli_vx_file *file, tli_grid *grid)
{
    tl_status st = place_pieces(file, grid);
    for (size_t p = 0; !st && p < file->piece_count; p++) st = open_cells(file, &file->pieces[p]);
    return st;
}

tl_status tli_vx_read_unstructured(tli_vx_file *file, tli_grid *grid)
{
    tl_status st = tli_vx_unstructured_open(file, grid);
    if (!st) st = read_points(file, grid);
    if (!st) st = read_cells(file, grid);
    if (!st) st = tli_vx_fields_read(file, NULL, grid);
    return st;
}
