/* BINARY files of legacy VTK as a feed: the reader of whole files finds where the arrays are, and
 * ranges of them are read from the map, whose pages are given back after each read. */
#include "formats/formats_feeder.h"
#include "formats/formats_legacy.h"
#include "formats/formats_split.h"

#include <string.h>

typedef struct legacy_feeder {
    tli_feeder feeder;
    tli_legacy reader;
    tli_legacy_places places;
    tli_grid grid; /* counts, the block of a structured file, the time */
    char *path;    /* owned */
    uint64_t tet_estimate;
} legacy_feeder;

static legacy_feeder *of(tli_feeder *feeder)
{
    return (legacy_feeder *)feeder;
}

static tl_status read_numbers(legacy_feeder *f, const tli_legacy_block *block, uint64_t components,
                              uint64_t first, uint64_t count, double *values)
{
    tl_status st = tli_legacy_block_numbers(f->feeder.ctx, block, first * components,
                                            count * components, values);
    tli_legacy_forget(&f->places, block, first * components, count * components);
    return st;
}

static tl_status legacy_points(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz)
{
    legacy_feeder *f = of(feeder);
    if (f->reader.has_points) return read_numbers(f, &f->places.points, 3, first, count, xyz);
    tli_legacy_positions(&f->reader, first, count, xyz);
    return TL_OK;
}

static tl_status legacy_values(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                               uint64_t count, double *values)
{
    legacy_feeder *f = of(feeder);
    const tli_legacy_array *from = &f->places.arrays[on][array];
    tl_status st = read_numbers(f, &from->block, from->components, first, count, values);
    for (uint64_t i = 0; !st && from->is_level && i < count; i++) values[i] = values[i] > 0;
    return st;
}

static tl_status legacy_cells(tli_feeder *feeder, uint64_t first, uint64_t count, tli_grid *window)
{
    return tli_legacy_read_part(&of(feeder)->reader, first, count, window);
}

static tl_status legacy_estimate(tli_feeder *feeder, uint64_t *tets)
{
    *tets = of(feeder)->tet_estimate;
    return TL_OK;
}

static void legacy_close(tli_feeder *feeder)
{
    tl_ctx *ctx = feeder->ctx;
    legacy_feeder *f = of(feeder);
    tli_feeder_drop_arrays(feeder);
    tli_legacy_drop_places(ctx, &f->places);
    tli_legacy_end(&f->reader);
    tli_grid_release(&f->grid);
    tl_mem_free(ctx, f->path);
    tl_mem_free(ctx, f);
}

/* Looks at all types: counts tets, and finds cells that no window can cut. */
static tl_status look_at_types(legacy_feeder *f)
{
    enum { STEP = 4096 };
    const tli_legacy_block *block = &f->places.types;
    for (uint64_t first = 0; first < block->count; first += STEP) {
        int64_t types[STEP];
        const size_t count = block->count - first < STEP ? (size_t)(block->count - first) : STEP;
        tli_legacy_block_integers(block, first, count, types);
        for (size_t i = 0; i < count; i++) {
            if (types[i] < 0 || types[i] > UINT8_MAX) return TL_ERR_FORMAT;
            const tl_cell_kind kind = tli_cell_type_of((uint8_t)types[i]).kind;
            if (kind == TL_CELL_POLYHEDRON || kind == TL_CELL_PRISM) return TL_ERR_UNSUPPORTED;
            f->tet_estimate += tli_feeder_usual_tets((uint8_t)types[i]);
        }
        tli_legacy_forget(&f->places, block, first, count);
    }
    return TL_OK;
}

/* What the file has, once its places are known. */
static tl_status take_file(legacy_feeder *f)
{
    tli_feeder *feeder = &f->feeder;
    tl_status st = TL_OK;
    feeder->point_count = f->grid.point_count;
    feeder->cell_count = tli_grid_cell_count(&f->grid);
    feeder->time = f->grid.time;
    if (f->reader.kind == TLI_LEGACY_UNSTRUCTURED) {
        if (!f->reader.has_points || !feeder->cell_count) return TL_ERR_UNSUPPORTED;
        feeder->cells = legacy_cells;
        st = look_at_types(f);
        if (!st && !f->tet_estimate) return TL_ERR_UNSUPPORTED; /* of surfaces alone */
    } else {
        if (!f->grid.block_count) return TL_ERR_UNSUPPORTED;
        feeder->blocks = f->grid.blocks;
        feeder->block_count = f->grid.block_count;
        f->tet_estimate = 5 * feeder->cell_count;
    }
    for (int on = 0; on < 2; on++)
        for (uint32_t i = 0; !st && i < f->places.array_counts[on]; i++) {
            const tli_legacy_array *array = &f->places.arrays[on][i];
            st = tli_feeder_add(feeder, (tl_on)on, array->name, array->components,
                                array->block.type->scalar);
        }
    return st;
}

tl_status tli_feeder_open_legacy(tl_ctx *ctx, const tli_map *map, const char *path,
                                 tli_feeder **feeder)
{
    static const char start[] = "# vtk ";
    tl_status st = TL_OK;
    *feeder = NULL;
    if (map->byte_count < sizeof start || memcmp(map->bytes, start, sizeof start - 1) != 0)
        return TL_OK;
    legacy_feeder *f = tl_mem_zalloc(ctx, 1, sizeof *f, &st);
    if (st) return st;
    f->feeder = (tli_feeder){.ctx = ctx,
                             .points = legacy_points,
                             .values = legacy_values,
                             .estimate = legacy_estimate,
                             .close = legacy_close};
    f->path = tli_strdup(ctx, path, &st);
    tli_grid_init(ctx, &f->grid);
    tli_legacy_begin(ctx, map, f->path, &f->grid, &f->reader);
    f->places.map = map;
    f->reader.places = &f->places;
    if (!st) st = tli_legacy_read_file(&f->reader);
    if (!st) st = take_file(f);
    if (!st) {
        *feeder = &f->feeder;
        return TL_OK;
    }
    legacy_close(&f->feeder);
    /* what is wrong is said, with the place, when the file is read as a whole */
    return st == TL_ERR_FORMAT || st == TL_ERR_UNSUPPORTED ? TL_OK : st;
}
