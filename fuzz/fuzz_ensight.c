/* The reader of EnSight files. Bits of the first byte: Gold, binary, a case file, values at points;
 * the next two are the size of the geometry, behind which values follow. */
#include "fuzz_source.h"

#include "formats/formats_ensight.h"

#define OPTION_BYTES 3

static void read_parts(const uint8_t *bytes, size_t byte_count)
{
    tl_ctx *ctx = fuzz_ctx_create();
    tli_grid grid;
    tli_scan scan;
    const uint8_t *rest = bytes + OPTION_BYTES;
    size_t left = byte_count - OPTION_BYTES, size = bytes[1] | (size_t)bytes[2] << 8;
    if (size > left) size = left;
    tli_grid_init(ctx, &grid);
    tli_ensight_geo geo = {.ctx = ctx, .gold = bytes[0] & 1, .grid = &grid, .cells.ctx = ctx};
    tli_scan_open(ctx, "input.geo", rest, size, &scan);
    scan.binary = bytes[0] & 2;
    tl_status st = tli_ensight_geo_read(&geo, &scan);
    tli_ensight_variable variable = {
        .name = "value", .components = bytes[0] & 16 ? 6 : 1, .on_nodes = bytes[0] & 8};
    bool big_endian = scan.big_endian;
    tli_scan_open(ctx, "input.val", rest + size, left - size, &scan);
    scan.binary = bytes[0] & 2;
    scan.big_endian = big_endian;
    if (!st) st = tli_ensight_values_read(&geo, &scan, &variable);
    tli_ensight_geo_release(&geo);
    fuzz_finish(ctx, st, &grid);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    if (byte_count < OPTION_BYTES) return 0;
    if (bytes[0] & 4)
        fuzz_read(tli_read_ensight, "input.case", bytes + OPTION_BYTES, byte_count - OPTION_BYTES);
    else
        read_parts(bytes, byte_count);
    return 0;
}
