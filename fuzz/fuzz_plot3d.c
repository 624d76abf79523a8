/* The reader of PLOT3D on any bytes. The first two bytes tell how long the grid file is,
 * little-endian; what follows it is the solution, and no solution is asked for if nothing does. */
#include "fuzz_grid.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    static FILE *solution; /* no name in any folder; read through its descriptor */
    char path[64];
    if (byte_count < 2) return 0;
    size_t grid_bytes = bytes[0] | (size_t)bytes[1] << 8, rest = byte_count - 2;
    if (grid_bytes > rest) grid_bytes = rest;
    size_t solution_bytes = rest - grid_bytes;
    tl_read_opts opts = {.struct_bytes = sizeof opts, .split = 5};
    if (solution_bytes) {
        if (solution) fclose(solution);
        solution = tmpfile();
        FUZZ_CHECK(solution);
        FUZZ_CHECK(fwrite(bytes + 2 + grid_bytes, 1, solution_bytes, solution) == solution_bytes);
        FUZZ_CHECK(fflush(solution) == 0);
        snprintf(path, sizeof path, "/proc/self/fd/%d", fileno(solution));
        opts.solution = path;
    }
    /* a block of its own, so that reads past the grid's end are seen */
    uint8_t *own = malloc(grid_bytes ? grid_bytes : 1);
    FUZZ_CHECK(own);
    for (size_t i = 0; i < grid_bytes; i++) own[i] = bytes[2 + i];

    tl_ctx *ctx = fuzz_ctx_create();
    tli_map map = {.bytes = own, .byte_count = grid_bytes};
    tli_grid grid;
    tli_grid_init(ctx, &grid);
    fuzz_finish(ctx, tli_read_plot3d(ctx, &map, "input", &opts, &grid), &grid);
    free(own);
    return 0;
}
