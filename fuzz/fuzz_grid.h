/* What the fuzz targets of the readers share: a context with a small budget, and a look at the grid
 * that a reader hands on. A broken promise ends the program. */
#ifndef TETRALOD_FUZZ_GRID_H
#define TETRALOD_FUZZ_GRID_H

#include "formats/formats_grid.h"

#include "fuzz_base.h"

#define FUZZ_BUDGET_BYTES ((size_t)16 << 20)

static inline tl_ctx *fuzz_ctx_create(void)
{
    return fuzz_ctx_within(FUZZ_BUDGET_BYTES);
}

static inline double fuzz_sum(const double *values, uint64_t count)
{
    double sum = 0;
    for (uint64_t i = 0; i < count; i++) sum += values[i];
    return sum;
}

static inline void fuzz_check_cells(const tli_grid *grid)
{
    if (grid->block_count || !grid->cell_count) return;
    const uint64_t count = grid->cell_count;
    FUZZ_CHECK(grid->connectivity);
    FUZZ_CHECK(!grid->types || (grid->offsets && grid->offsets[0] == 0));
    for (uint64_t cell = 0; grid->offsets && cell < count; cell++)
        FUZZ_CHECK(grid->offsets[cell] <= grid->offsets[cell + 1]);
    for (uint64_t cell = 0; cell < count; cell++) {
        uint64_t limit =
            grid->types && grid->types[cell] == 42 ? grid->face_count : grid->point_count;
        uint64_t begin = grid->offsets ? grid->offsets[cell] : 4 * cell;
        uint64_t end = grid->offsets ? grid->offsets[cell + 1] : 4 * cell + 4;
        for (uint64_t i = begin; i < end; i++) FUZZ_CHECK(grid->connectivity[i] < limit);
    }
    for (uint64_t f = 0; f < grid->face_count; f++)
        for (uint64_t i = grid->face_offsets[f]; i < grid->face_offsets[f + 1]; i++)
            FUZZ_CHECK(grid->face_points[i] < grid->point_count);
    for (uint32_t l = 0; l < grid->label_count; l++)
        for (uint64_t i = 0; i < grid->labels[l].offsets[grid->labels[l].face_count]; i++)
            FUZZ_CHECK(grid->labels[l].points[i] < grid->point_count);
}

/* Reads every number, so that a sanitizer sees blocks that are too short or never written. */
static inline void fuzz_check_grid(const tli_grid *grid)
{
    uint64_t points = 0;
    double sum = fuzz_sum(grid->xyz, 3 * grid->point_count);
    for (uint32_t b = 0; b < grid->block_count; b++) {
        const tli_grid_block *block = &grid->blocks[b];
        FUZZ_CHECK(block->first_point == points);
        points += (uint64_t)block->dims[0] * block->dims[1] * block->dims[2];
    }
    FUZZ_CHECK(!grid->block_count || points == grid->point_count);
    fuzz_check_cells(grid);
    for (uint64_t i = 0; grid->blanks && i < grid->point_count; i++) sum += grid->blanks[i];
    for (uint32_t i = 0; i < grid->point_array_count; i++) {
        const tli_grid_array *array = &grid->point_arrays[i];
        FUZZ_CHECK(array->name && array->components && array->count == grid->point_count);
        sum += fuzz_sum(array->values, array->count * array->components);
    }
    for (uint32_t i = 0; i < grid->cell_array_count; i++) {
        const tli_grid_array *array = &grid->cell_arrays[i];
        FUZZ_CHECK(array->name && array->components && array->count == tli_grid_cell_count(grid));
        sum += fuzz_sum(array->values, array->count * array->components);
    }
    static volatile double sink;
    sink = sum;
    (void)sink;
}

/* Looks at what a reader gave, releases it and the context; nothing may stay behind. */
static inline void fuzz_finish(tl_ctx *ctx, tl_status status, tli_grid *grid)
{
    if (!status)
        fuzz_check_grid(grid);
    else
        FUZZ_CHECK(tl_ctx_message(ctx)[0]);
    tli_grid_release(grid);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
}

#endif
