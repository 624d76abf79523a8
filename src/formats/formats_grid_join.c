/* Grids that become one: blocks of a file, pieces of a partition, parts of a collection. What comes
 * second goes behind what is there; ids are shifted, arrays that only one side has are filled up
 * with NaN. */
#include "formats/formats_grid.h"
#include "formats/formats_split.h"

#include <math.h>
#include <string.h>

/* ---- structured blocks to lists ---- */

static tl_status alloc_list(tli_grid *grid, uint64_t cells)
{
    tl_status st = TL_OK;
    if (cells > SIZE_MAX / 8)
        return tl_fail(grid->ctx, TL_ERR_UNSUPPORTED, "%llu cells are too many",
                       (unsigned long long)cells);
    grid->types = tl_mem_alloc(grid->ctx, (size_t)cells, 1, &st);
    grid->offsets = tl_mem_alloc(grid->ctx, (size_t)cells + 1, sizeof *grid->offsets, &st);
    grid->connectivity = tl_mem_alloc(grid->ctx, (size_t)cells * 8, sizeof(uint32_t), &st);
    return st;
}

/* Corners of the cells of one block: those of a hexahedron, quad, line or point in VTK's order. */
static void list_block(tli_grid *grid, const tli_grid_block *block, uint64_t *cell)
{
    static const uint8_t corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                          {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    static const uint8_t vtk_types[4] = {1, 3, 9, 12};
    uint32_t cells[3];
    uint64_t steps[3], stride = 1;
    unsigned wide = 0, axes[3] = {0, 1, 2};
    for (unsigned axis = 0; axis < 3; axis++) {
        uint32_t dim = block->dims[axis];
        cells[axis] = dim > 1 ? dim - 1 : dim;
        if (dim > 1) axes[wide++] = axis;
        steps[axis] = stride;
        stride *= dim;
    }
    for (uint32_t k = 0; k < cells[2]; k++)
        for (uint32_t j = 0; j < cells[1]; j++)
            for (uint32_t i = 0; i < cells[0]; i++, ++*cell) {
                uint64_t base = block->first_point + i + j * steps[1] + k * steps[2];
                uint32_t *out = grid->connectivity + grid->offsets[*cell];
                for (unsigned c = 0; c < 1u << wide; c++) {
                    uint64_t id = base;
                    for (unsigned a = 0; a < wide; a++) id += corners[c][a] * steps[axes[a]];
                    out[c] = (uint32_t)id;
                }
                grid->types[*cell] = vtk_types[wide];
                grid->offsets[*cell + 1] = grid->offsets[*cell] + (1u << wide);
            }
}

static tl_status check_block(const tli_grid *grid, uint32_t index)
{
    const tli_grid_block *b = &grid->blocks[index];
    uint64_t plane = (uint64_t)b->dims[0] * b->dims[1];
    if (b->first_point <= grid->point_count && grid->point_count <= UINT32_MAX &&
        (plane == 0 || b->dims[2] <= (grid->point_count - b->first_point) / plane))
        return TL_OK;
    return tl_fail(grid->ctx, TL_ERR_FORMAT,
                   "block %u: %u x %u x %u points from %llu on, but there are %llu", index,
                   b->dims[0], b->dims[1], b->dims[2], (unsigned long long)b->first_point,
                   (unsigned long long)grid->point_count);
}

tl_status tli_grid_unstructure(tli_grid *grid)
{
    uint64_t cells = tli_grid_cell_count(grid), cell = 0;
    tl_status st = TL_OK;
    if (!grid->block_count) return TL_OK;
    for (uint32_t b = 0; b < grid->block_count && !st; b++) st = check_block(grid, b);
    if (!st) st = alloc_list(grid, cells);
    if (st) return st;
    grid->offsets[0] = 0;
    for (uint32_t b = 0; b < grid->block_count; b++) list_block(grid, &grid->blocks[b], &cell);
    grid->cell_count = cells;
    tl_mem_free(grid->ctx, grid->blocks);
    grid->blocks = NULL;
    grid->block_count = 0;
    return TL_OK;
}

/* ---- lists that are implied ---- */

/* Types and offsets of a list of tets alone. */
static tl_status spell_out(tli_grid *grid)
{
    tl_status st = TL_OK;
    size_t cells = (size_t)grid->cell_count;
    if (grid->block_count) return TL_OK;
    if (!grid->types) {
        grid->types = tl_mem_alloc(grid->ctx, cells, 1, &st);
        if (st) return st;
        memset(grid->types, TLI_VTK_TETRA, cells);
    }
    if (!grid->offsets) {
        grid->offsets = tl_mem_alloc(grid->ctx, cells + 1, sizeof *grid->offsets, &st);
        if (st) return st;
        for (size_t i = 0; i <= cells; i++) grid->offsets[i] = 4 * i;
    }
    return TL_OK;
}

/* Makes room for more elements behind count, in a row of requests. */
static void *grow(tl_ctx *ctx, void *block, uint64_t count, uint64_t more, size_t elem_bytes,
                  tl_status *st)
{
    if (count > SIZE_MAX - more) {
        if (!*st) *st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "too many elements to join");
        return block;
    }
    return tl_mem_resize(ctx, block, (size_t)(count + more), elem_bytes, st);
}

/* ---- arrays ---- */

static void fill_nan(double *values, uint64_t count)
{
    for (uint64_t i = 0; i < count; i++) values[i] = (double)NAN;
}

static tli_grid_array *find_array(const tli_grid *grid, tl_on on, const char *name,
                                  uint32_t components)
{
    tli_grid_array *arrays = on == TL_ON_VERTEX ? grid->point_arrays : grid->cell_arrays;
    uint32_t count = on == TL_ON_VERTEX ? grid->point_array_count : grid->cell_array_count;
    for (uint32_t i = 0; i < count; i++)
        if (arrays[i].components == components && strcmp(arrays[i].name, name) == 0)
            return &arrays[i];
    return NULL;
}

/* Arrays of from that into lacks are added there, full of NaN; counts are still those of before. */
static tl_status add_missing(tli_grid *into, const tli_grid *from, tl_on on)
{
    const tli_grid_array *arrays = on == TL_ON_VERTEX ? from->point_arrays : from->cell_arrays;
    uint32_t count = on == TL_ON_VERTEX ? from->point_array_count : from->cell_array_count;
    tl_status st = TL_OK;
    for (uint32_t i = 0; i < count && !st; i++) {
        const tli_grid_array *array = &arrays[i];
        tli_grid_array *added;
        if (find_array(into, on, array->name, array->components)) continue;
        tl_scalar scalar = array->scalar < TL_F32 ? TL_F64 : array->scalar; /* holds NaN */
        st = tli_grid_add(into, on, array->name, array->components, scalar, NULL, &added);
        if (!st) fill_nan(added->values, added->count * added->components);
    }
    return st;
}

/* Each array of into grows by more tuples: those of from, or NaN. An integer array that gets NaN,
 * or values of another type, becomes float64. */
static tl_status append_arrays(tli_grid *into, const tli_grid *from, tl_on on, uint64_t before,
                               uint64_t more)
{
    tli_grid_array *arrays = on == TL_ON_VERTEX ? into->point_arrays : into->cell_arrays;
    uint32_t count = on == TL_ON_VERTEX ? into->point_array_count : into->cell_array_count;
    tl_status st = TL_OK;
    for (uint32_t i = 0; i < count && !st; i++) {
        tli_grid_array *array = &arrays[i];
        uint32_t components = array->components;
        const tli_grid_array *source = find_array(from, on, array->name, components);
        array->values =
            grow(into->ctx, array->values, before, more, components * sizeof(double), &st);
        if (st) break;
        double *out = array->values + before * components;
        if (source && more) memcpy(out, source->values, (size_t)more * components * sizeof *out);
        if (!source) fill_nan(out, more * components);
        bool other = source ? source->scalar != array->scalar : array->scalar < TL_F32;
        if (other) array->scalar = TL_F64;
        array->count = before + more;
    }
    return st;
}

/* ---- cells, faces, labels ---- */

static tl_status append_cells(tli_grid *into, const tli_grid *from)
{
    tl_ctx *ctx = into->ctx;
    tl_status st = TL_OK;
    uint64_t cells = into->cell_count, more = from->cell_count;
    uint64_t ids = into->offsets[cells], more_ids = from->offsets[more];
    uint32_t points = (uint32_t)into->point_count, faces = (uint32_t)into->face_count;
    into->types = grow(ctx, into->types, cells, more, 1, &st);
    into->offsets = grow(ctx, into->offsets, cells + 1, more, sizeof *into->offsets, &st);
    into->connectivity =
        grow(ctx, into->connectivity, ids, more_ids, sizeof *into->connectivity, &st);
    if (st) return st;
    memcpy(into->types + cells, from->types, (size_t)more);
    for (uint64_t c = 0; c < more; c++) {
        uint32_t shift = from->types[c] == TLI_VTK_POLYHEDRON ? faces : points;
        for (uint64_t i = from->offsets[c]; i < from->offsets[c + 1]; i++)
            into->connectivity[ids + i] = from->connectivity[i] + shift;
        into->offsets[cells + c + 1] = ids + from->offsets[c + 1];
    }
    into->cell_count += more;
    return TL_OK;
}

static tl_status append_faces(tli_grid *into, const tli_grid *from)
{
    tl_ctx *ctx = into->ctx;
    tl_status st = TL_OK;
    uint64_t faces = into->face_count, more = from->face_count;
    if (!more) return TL_OK;
    uint64_t ids = faces ? into->face_offsets[faces] : 0, more_ids = from->face_offsets[more];
    into->face_offsets =
        grow(ctx, into->face_offsets, faces + 1, more, sizeof *into->face_offsets, &st);
    into->face_points = grow(ctx, into->face_points, ids, more_ids, sizeof *into->face_points, &st);
    if (st) return st;
    into->face_offsets[0] = 0;
    for (uint64_t f = 0; f < more; f++)
        into->face_offsets[faces + f + 1] = ids + from->face_offsets[f + 1];
    for (uint64_t i = 0; i < more_ids; i++)
        into->face_points[ids + i] = from->face_points[i] + (uint32_t)into->point_count;
    into->face_count += more;
    return TL_OK;
}

static tl_status append_blocks(tli_grid *into, const tli_grid *from)
{
    tl_status st = TL_OK;
    into->blocks = grow(into->ctx, into->blocks, into->block_count, from->block_count,
                        sizeof *into->blocks, &st);
    if (st) return st;
    for (uint32_t b = 0; b < from->block_count; b++) {
        into->blocks[into->block_count + b] = from->blocks[b];
        into->blocks[into->block_count + b].first_point += into->point_count;
    }
    into->block_count += from->block_count;
    return TL_OK;
}

static tl_status move_labels(tli_grid *into, tli_grid *from, uint32_t shift)
{
    tl_status st = TL_OK;
    for (uint32_t i = 0; i < from->label_count && !st; i++) {
        tli_grid_label *label = &from->labels[i];
        for (uint64_t p = 0; p < label->offsets[label->face_count]; p++) label->points[p] += shift;
        st = tli_grid_add_label(into, label->name, label->id, label->face_count, label->offsets,
                                label->points);
        if (st) break;
        label->offsets = NULL;
        label->points = NULL;
        label->face_count = 0;
    }
    for (uint32_t i = 0; i < from->region_name_count && !st; i++)
        st = tli_grid_name_region(into, from->region_names[i].id, from->region_names[i].name);
    return st;
}

/* ---- points and regions ---- */

static tl_status append_points(tli_grid *into, const tli_grid *from)
{
    tl_status st = TL_OK;
    uint64_t points = into->point_count, more = from->point_count;
    bool blanks = into->blanks || from->blanks, had = into->blanks != NULL;
    into->xyz = grow(into->ctx, into->xyz, points, more, 3 * sizeof *into->xyz, &st);
    if (blanks) into->blanks = grow(into->ctx, into->blanks, points, more, 1, &st);
    if (st) return st;
    if (more) memcpy(into->xyz + 3 * points, from->xyz, (size_t)more * 3 * sizeof *into->xyz);
    if (blanks && !had) memset(into->blanks, 1, (size_t)points);
    if (blanks && from->blanks) memcpy(into->blanks + points, from->blanks, (size_t)more);
    if (blanks && !from->blanks) memset(into->blanks + points, 1, (size_t)more);
    return TL_OK;
}

/* Cells without a region are of region 0 as soon as others have one. */
static tl_status append_regions(tli_grid *into, const tli_grid *from, uint64_t cells, uint64_t more)
{
    tl_status st = TL_OK;
    bool had = into->regions != NULL;
    if (!had && !from->regions) return TL_OK;
    into->regions = grow(into->ctx, into->regions, cells, more, sizeof *into->regions, &st);
    if (st) return st;
    if (!had) memset(into->regions, 0, (size_t)cells * sizeof *into->regions);
    if (from->regions)
        memcpy(into->regions + cells, from->regions, (size_t)more * sizeof *into->regions);
    else
        memset(into->regions + cells, 0, (size_t)more * sizeof *into->regions);
    return TL_OK;
}

static tl_status make_block_of(tli_grid *grid, const tli_join *how)
{
    tl_status st = TL_OK;
    size_t cells = (size_t)tli_grid_cell_count(grid);
    if (!how || !how->is_block || grid->regions) return TL_OK;
    grid->regions = tl_mem_alloc(grid->ctx, cells, sizeof *grid->regions, &st);
    for (size_t i = 0; i < cells && !st; i++) grid->regions[i] = how->region;
    return st ? st : tli_grid_name_region(grid, how->region, how->name);
}

/* ---- the door ---- */

static bool is_empty(const tli_grid *grid)
{
    return grid->point_count == 0 && grid->block_count == 0 && grid->cell_count == 0;
}

static tl_status join(tli_grid *into, tli_grid *from)
{
    uint64_t cells, more = tli_grid_cell_count(from);
    tl_status st = TL_OK;
    if (into->point_count + from->point_count > TL_MESH_VERTS_MAX ||
        into->face_count + from->face_count > UINT32_MAX)
        return tl_fail(into->ctx, TL_ERR_UNSUPPORTED,
                       "%llu points together; a mesh in memory holds at most %u",
                       (unsigned long long)(into->point_count + from->point_count),
                       TL_MESH_VERTS_MAX);
    if (!into->block_count != !from->block_count) {
        st = tli_grid_unstructure(into);
        if (!st) st = tli_grid_unstructure(from);
    }
    if (!st) st = spell_out(into);
    if (!st) st = spell_out(from);
    cells = tli_grid_cell_count(into);
    if (!st) st = add_missing(into, from, TL_ON_VERTEX);
    if (!st) st = add_missing(into, from, TL_ON_TET);
    if (!st) st = append_arrays(into, from, TL_ON_VERTEX, into->point_count, from->point_count);
    if (!st) st = append_arrays(into, from, TL_ON_TET, cells, more);
    if (!st) st = append_regions(into, from, cells, more);
    if (!st) st = append_points(into, from);
    if (!st && from->block_count) st = append_blocks(into, from);
    if (!st && !from->block_count) st = append_cells(into, from);
    if (!st) st = append_faces(into, from);
    if (!st) st = move_labels(into, from, (uint32_t)into->point_count);
    if (!st) into->point_count += from->point_count;
    return st;
}

tl_status tli_grid_join(tli_grid *into, tli_grid *from, const tli_join *how)
{
    tl_status st = make_block_of(from, how);
    if (st) return st;
    if (is_empty(from)) {
        st = move_labels(into, from, 0);
    } else if (is_empty(into)) {
        tli_grid first = *from;
        tli_grid_init(from->ctx, from);
        st = move_labels(&first, into, 0);
        if (isnan(first.time)) first.time = into->time;
        tli_grid_release(into);
        *into = first;
    } else {
        st = join(into, from);
    }
    if (isnan(into->time)) into->time = from->time;
    tli_grid_release(from);
    return st;
}
