/* VTK XML files: any bytes end in a status, within the budget, and leave nothing behind. What is
 * read keeps the promises of a grid. */
#include <stdlib.h>

#include "formats/formats_grid.h"

#define BUDGET_BYTES ((size_t)32 << 20)

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count);

static void require(bool condition)
{
    if (!condition) abort();
}

static void check_grid(const tli_grid *grid)
{
    uint64_t cells = tli_grid_cell_count(grid);
    uint64_t length = grid->block_count ? 0 : grid->offsets ? grid->offsets[cells] : 4 * cells;
    for (uint64_t i = 0; grid->offsets && i < cells; i++)
        require(grid->offsets[i] <= grid->offsets[i + 1]);
    for (uint64_t i = 0, cell = 0; i < length; i++) {
        while (grid->offsets && grid->offsets[cell + 1] <= i) cell++;
        bool poly = grid->types && grid->types[cell] == 42;
        require(grid->connectivity[i] < (poly ? grid->face_count : grid->point_count));
    }
    for (uint64_t i = 0; grid->face_count && i < grid->face_offsets[grid->face_count]; i++)
        require(grid->face_points[i] < grid->point_count);
    for (uint32_t i = 0; i < grid->point_array_count; i++)
        require(grid->point_arrays[i].count == grid->point_count);
    for (uint32_t i = 0; i < grid->cell_array_count; i++)
        require(grid->cell_arrays[i].count == cells);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.budget_bytes = BUDGET_BYTES;
    opts.thread_count = 1;
    tl_ctx *ctx;
    if (tl_ctx_create(&opts, &ctx)) return 0;
    tli_map map = {.bytes = bytes, .byte_count = byte_count};
    tli_grid grid;
    tli_grid_init(ctx, &grid);
    tl_status st = tli_read_vtk_xml(ctx, &map, "fuzz", &grid);
    if (st)
        require(*tl_ctx_message(ctx) != '\0');
    else
        check_grid(&grid);
    tli_grid_release(&grid);
    require(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
    return 0;
}
