/* Structured files as feeds: one block whose points are computed, or stand in the file as plain
 * bytes: raw volumes, and VTK XML image data, rectilinear and structured grids of one piece. */
#include "formats/formats_feeder.h"
#include "formats/formats_vtkxml.h"

#include <math.h>
#include <string.h>

static uint64_t count_cells(const tli_grid_block *block)
{
    const tli_grid one = {.blocks = (tli_grid_block *)(uintptr_t)block, .block_count = 1};
    return tli_grid_cell_count(&one);
}

/* Each cell of three dimensions becomes five or six tets. */
static tl_status lattice_estimate(tli_feeder *feeder, uint64_t *tets)
{
    *tets = 5 * feeder->cell_count;
    return TL_OK;
}

/* ---- VTK XML ---- */

typedef struct vts_feeder {
    tli_feeder feeder;
    tli_vx_file file;
    tli_vx_structure structure;
    tli_grid_block block;
    tli_vx_field *fields[2]; /* by tl_on, owned */
} vts_feeder;

static vts_feeder *of(tli_feeder *feeder)
{
    return (vts_feeder *)feeder;
}

static tl_status vts_points(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz)
{
    return tli_vx_structure_points(&of(feeder)->structure, first, count, xyz);
}

static tl_status vts_values(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                            uint64_t count, double *values)
{
    vts_feeder *f = of(feeder);
    const tli_vx_field *field = &f->fields[on][array];
    tli_vx_target target = {.f64 = values};
    return tli_vx_read_part(&f->file, tli_vx_field_in(&f->file, on, field, f->file.pieces),
                            first * field->components, count * field->components, &target);
}

static void vts_close(tli_feeder *feeder)
{
    tl_ctx *ctx = feeder->ctx;
    vts_feeder *f = of(feeder);
    tli_feeder_drop_arrays(feeder);
    if (f->structure.file) tli_vx_structure_close(&f->structure);
    tl_mem_free(ctx, f->fields[0]);
    tl_mem_free(ctx, f->fields[1]);
    tli_vx_release(&f->file);
    tl_mem_free(ctx, f);
}

/* Whether all that is read by ranges can be. */
static bool is_plain(const tli_vx_file *file)
{
    if (file->kind == TLI_VX_UNSTRUCTURED || file->piece_count != 1) return false;
    for (size_t i = 0; i < file->array_count; i++) {
        const tli_vx_array *array = &file->arrays[i];
        bool by_ranges = array->section == TLI_VX_POINT_DATA ||
                         array->section == TLI_VX_CELL_DATA || array->section == TLI_VX_POINTS;
        if (by_ranges && !tli_vx_has_parts(file, array)) return false;
    }
    return true;
}

static tl_status find_fields(vts_feeder *f, tl_on on)
{
    size_t count = 0;
    char name[256];
    tl_status st = tli_vx_fields_find(&f->file, on, &f->fields[on], &count);
    for (size_t i = 0; !st && i < count; i++) {
        const tli_vx_field *field = &f->fields[on][i];
        tli_vx_field_name(field, name, sizeof name);
        st = tli_feeder_add(&f->feeder, on, name, field->components, field->scalar);
    }
    return st;
}

tl_status tli_feeder_open_vts(tl_ctx *ctx, const tli_map *map, const char *path,
                              tli_feeder **feeder)
{
    tl_status st = TL_OK;
    *feeder = NULL;
    if (!tli_feeder_is_xml(map)) return TL_OK;
    vts_feeder *f = tl_mem_zalloc(ctx, 1, sizeof *f, &st);
    if (st) return st;
    f->feeder = (tli_feeder){.ctx = ctx,
                             .points = vts_points,
                             .values = vts_values,
                             .estimate = lattice_estimate,
                             .close = vts_close};
    st = tli_vx_head_read(ctx, map, &f->file);
    if (st || !is_plain(&f->file)) {
        vts_close(&f->feeder);
        return st == TL_ERR_FORMAT || st == TL_ERR_UNSUPPORTED ? TL_OK : st;
    }
    f->structure.file = &f->file;
    st = tli_vx_structure_open(&f->structure);
    if (!st) st = tli_vx_time_read(&f->file);
    if (!st) st = find_fields(f, TL_ON_VERTEX);
    if (!st) st = find_fields(f, TL_ON_TET);
    if (st) {
        vts_close(&f->feeder);
        return tl_note(ctx, st, "while reading '%s' as VTK XML", path);
    }
    for (int axis = 0; axis < 3; axis++) f->block.dims[axis] = (uint32_t)f->structure.dims[axis];
    f->feeder.blocks = &f->block;
    f->feeder.point_count = f->structure.point_count;
    f->feeder.cell_count = count_cells(&f->block);
    f->feeder.time = f->file.time;
    *feeder = &f->feeder;
    return TL_OK;
}

/* ---- raw volumes ---- */

typedef struct raw_feeder {
    tli_feeder feeder;
    const tli_map *map;
    tli_grid_block block;
    tl_scalar scalar;
    bool big_endian;
} raw_feeder;

static tl_status raw_points(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz)
{
    const uint32_t *dims = ((raw_feeder *)feeder)->block.dims;
    uint64_t x = first % dims[0], y = first / dims[0] % dims[1], z = first / dims[0] / dims[1];
    for (; count; count--, xyz += 3) {
        xyz[0] = (double)x, xyz[1] = (double)y, xyz[2] = (double)z;
        if (++x < dims[0]) continue;
        x = 0;
        if (++y < dims[1]) continue;
        y = 0;
        z++;
    }
    return TL_OK;
}

static tl_status raw_values(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                            uint64_t count, double *values)
{
    const raw_feeder *f = (const raw_feeder *)feeder;
    const uint64_t width = tl_scalar_bytes(f->scalar);
    (void)on, (void)array;
    tli_widen(f->map->bytes + first * width, f->scalar, f->big_endian, count, values);
    tli_map_forget(f->map, first * width, (first + count) * width);
    return TL_OK;
}

static void raw_close(tli_feeder *feeder)
{
    tli_feeder_drop_arrays(feeder);
    tl_mem_free(feeder->ctx, feeder);
}

tl_status tli_feeder_open_raw(tl_ctx *ctx, const tli_map *map, const char *path,
                              const tl_read_opts *opts, tli_feeder **feeder)
{
    uint64_t points = 0;
    *feeder = NULL;
    tl_status st = tli_raw_check(ctx, map, path, opts, &points);
    if (st) return st;
    raw_feeder *f = tl_mem_zalloc(ctx, 1, sizeof *f, &st);
    if (st) return st;
    *f = (raw_feeder){.feeder = {.ctx = ctx,
                                 .point_count = points,
                                 .time = (double)NAN,
                                 .block_count = 1,
                                 .points = raw_points,
                                 .values = raw_values,
                                 .estimate = lattice_estimate,
                                 .close = raw_close},
                      .map = map,
                      .scalar = opts->raw_scalar,
                      .big_endian = opts->raw_big_endian};
    memcpy(f->block.dims, opts->raw_dims, sizeof f->block.dims);
    f->feeder.blocks = &f->block;
    f->feeder.cell_count = count_cells(&f->block);
    st = tli_feeder_add(&f->feeder, TL_ON_VERTEX, "value", 1, opts->raw_scalar);
    if (st)
        raw_close(&f->feeder);
    else
        *feeder = &f->feeder;
    return st;
}
