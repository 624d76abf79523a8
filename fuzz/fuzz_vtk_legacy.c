/* The reader of legacy VTK files on any bytes. */
#include "fuzz_grid.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    tl_ctx *ctx = fuzz_ctx_create();
    tli_map map = {.bytes = bytes, .byte_count = byte_count};
    tli_grid grid;
    tli_grid_init(ctx, &grid);
    fuzz_finish(ctx, tli_read_vtk_legacy(ctx, &map, "input", &grid), &grid);
    return 0;
}
