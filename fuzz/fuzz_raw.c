/* The reader of raw volumes. The first five bytes are the dimensions (two bits of the fourth shift
 * the first up by 0, 8, 16 or 24), the type and the byte order; the rest is the file. */
#include "fuzz_grid.h"

#define OPTION_BYTES 5

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    if (byte_count < OPTION_BYTES) return 0;
    tl_read_opts opts = {
        .struct_bytes = sizeof opts,
        .raw_dims = {(uint32_t)bytes[0] << 8 * (bytes[3] >> 6), bytes[1], bytes[2]},
        .raw_scalar = (tl_scalar)(bytes[3] & 15),
        .raw_big_endian = bytes[4] & 1,
        .split = 5};
    tl_ctx *ctx = fuzz_ctx_create();
    tli_map map = {.bytes = bytes + OPTION_BYTES, .byte_count = byte_count - OPTION_BYTES};
    tli_grid grid;
    tli_grid_init(ctx, &grid);
    fuzz_finish(ctx, tli_read_raw(ctx, &map, "input", &opts, &grid), &grid);
    return 0;
}
