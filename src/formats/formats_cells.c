/* A list of cells that grows section by section. */
#include "formats/formats_cells.h"

#include "formats/formats_split.h"

#include <inttypes.h>

void tli_cells_init(tl_ctx *ctx, tli_cells *cells)
{
    *cells = (tli_cells){.ctx = ctx};
}

void tli_cells_release(tli_cells *cells)
{
    tl_mem_free(cells->ctx, cells->types);
    tl_mem_free(cells->ctx, cells->offsets);
    tl_mem_free(cells->ctx, cells->connectivity);
    tl_mem_free(cells->ctx, cells->regions);
    tli_cells_init(cells->ctx, cells);
}

/* At least wanted; doubles, unless the first request is the only one. */
static uint64_t grown(uint64_t capacity, uint64_t wanted)
{
    return wanted <= capacity || capacity == 0 || wanted > 2 * capacity ? wanted : 2 * capacity;
}

tl_status tli_cells_reserve(tli_cells *cells, uint64_t cell_count, uint64_t index_count)
{
    tl_status st = TL_OK;
    uint64_t wanted = cells->count + cell_count;
    if (wanted > cells->capacity || !cells->offsets) {
        uint64_t room = grown(cells->capacity, wanted);
        cells->types = tl_mem_resize(cells->ctx, cells->types, (size_t)room, 1, &st);
        cells->offsets = tl_mem_resize(cells->ctx, cells->offsets, (size_t)room + 1,
                                       sizeof *cells->offsets, &st);
        cells->regions =
            tl_mem_resize(cells->ctx, cells->regions, (size_t)room, sizeof *cells->regions, &st);
        if (st) return st;
        cells->capacity = room;
        if (cells->count == 0) cells->offsets[0] = 0;
    }
    wanted = cells->index_count + index_count;
    if (wanted > cells->index_capacity || !cells->connectivity) {
        uint64_t room = grown(cells->index_capacity, wanted);
        cells->connectivity = tl_mem_resize(cells->ctx, cells->connectivity, (size_t)room,
                                            sizeof *cells->connectivity, &st);
        if (!st) cells->index_capacity = room;
    }
    return st;
}

uint32_t *tli_cells_add(tli_cells *cells, uint8_t type, uint32_t index_count, int32_t region)
{
    TL_ASSERT(cells->count < cells->capacity &&
              cells->index_count + index_count <= cells->index_capacity);
    uint32_t *ids = cells->connectivity + cells->index_count;
    cells->types[cells->count] = type;
    cells->regions[cells->count++] = region;
    cells->index_count += index_count;
    cells->offsets[cells->count] = cells->index_count;
    return ids;
}

bool tli_cell_is_surface(uint8_t type)
{
    return tli_cell_type_of(type).kind == TL_CELL_SURFACE;
}

bool tli_cell_is_volume(uint8_t type)
{
    tl_cell_kind kind = tli_cell_type_of(type).kind;
    return kind < TL_CELL_SURFACE;
}

uint32_t tli_surface_corners(uint8_t type)
{
    switch (type) {
    case TLI_VTK_TRIANGLE:
    case TLI_VTK_QUADRATIC_TRIANGLE:
    case TLI_VTK_LAGRANGE_TRIANGLE: return 3;
    default: return 4;
    }
}

/* ---- checking ---- */

typedef struct check_job {
    const tli_cells *cells;
    uint64_t point_count, face_count;
} check_job;

static tl_status check_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const check_job *job = arg;
    const tli_cells *cells = job->cells;
    (void)worker;
    for (size_t cell = begin; cell < end; cell++) {
        const bool faces = cells->types[cell] == TLI_VTK_POLYHEDRON;
        const uint64_t limit = faces ? job->face_count : job->point_count;
        for (uint64_t i = cells->offsets[cell]; i < cells->offsets[cell + 1]; i++)
            if (cells->connectivity[i] >= limit)
                return tl_fail(cells->ctx, TL_ERR_FORMAT,
                               "cell %zu has %s %" PRIu64 " of %" PRIu64 ", counted from 1",
                               cell + 1, faces ? "face" : "point",
                               (uint64_t)cells->connectivity[i] + 1, limit);
    }
    return TL_OK;
}

#define CHECK_GRAIN 16384

tl_status tli_cells_to_grid(tli_cells *cells, const char *path, bool with_regions, tli_grid *grid)
{
    tl_status st = TL_OK;
    check_job job = {cells, grid->point_count, grid->face_count};
    if (cells->count == 0) return TL_OK;
    st = tli_parallel(cells->ctx, (size_t)cells->count, CHECK_GRAIN, check_piece, &job);
    if (st) return tl_note(cells->ctx, st, "in '%s'", path);
    grid->cell_count = cells->count;
    grid->types = cells->types;
    grid->offsets = cells->offsets;
    grid->connectivity = cells->connectivity;
    if (with_regions)
        grid->regions = cells->regions;
    else
        tl_mem_free(cells->ctx, cells->regions);
    tli_cells_init(cells->ctx, cells);
    return TL_OK;
}
