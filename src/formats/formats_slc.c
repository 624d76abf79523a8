/* SLC of VolVis: a text header, a small picture, then slices of bytes, plain or run-length coded:
 * a count of 7 bits, whose eighth bit says whether that many bytes follow or one is repeated; a
 * count of 0 ends the slice. */
#include "formats/formats_volume.h"

#include <inttypes.h>
#include <string.h>

#define SIZE_MAX_AXIS 65535
/* A byte of runs becomes at most 127 / 2 bytes. */
#define RUN_GROWTH 64u

typedef struct header {
    int64_t magic, sizes[3], bits, unit, origin, modification, packing;
    double spacing[3];
} header;

static tl_status skip_marker(tli_scan *scan)
{
    if (tli_scan_at_end(scan) || *scan->at != 'X')
        return tli_scan_fail(scan, "expected X before the bytes");
    scan->at++;
    return TL_OK;
}

static tl_status read_header(tli_scan *scan, header *h)
{
    int64_t icon[2] = {0, 0};
    const uint8_t *picture;
    tl_status st = tli_scan_int(scan, "the magic number", 11111, 11111, &h->magic);
    for (int axis = 0; !st && axis < 3; axis++)
        st = tli_scan_int(scan, "a dimension", 1, SIZE_MAX_AXIS, &h->sizes[axis]);
    if (!st) st = tli_scan_int(scan, "bits of a value", 8, 8, &h->bits);
    if (!st) st = tli_scan_reals(scan, "a spacing", 3, h->spacing);
    if (!st) st = tli_scan_int(scan, "a unit", 0, 255, &h->unit);
    if (!st) st = tli_scan_int(scan, "an origin", 0, 255, &h->origin);
    if (!st) st = tli_scan_int(scan, "a modification", 0, 255, &h->modification);
    if (!st) st = tli_scan_int(scan, "the compression", 0, 1, &h->packing);
    for (int axis = 0; !st && axis < 2; axis++)
        st = tli_scan_int(scan, "the size of the picture", 0, SIZE_MAX_AXIS, &icon[axis]);
    if (!st) st = skip_marker(scan);
    scan->binary = true;
    if (!st) st = tli_scan_take(scan, "the picture", (uint64_t)(icon[0] * icon[1]), 3, &picture);
    return st;
}

/* Runs [begin, end) to exactly count bytes; false where they are damaged. */
static bool unpack_runs(const uint8_t *at, const uint8_t *end, uint8_t *out, size_t count)
{
    const uint8_t *out_end = out + count;
    while (at < end) {
        size_t run = *at & 0x7f;
        bool literal = *at++ & 0x80;
        if (run == 0) break;
        if (run > (size_t)(out_end - out) || (literal ? run : 1) > (size_t)(end - at)) return false;
        if (literal)
            memcpy(out, at, run);
        else
            memset(out, *at, run);
        at += literal ? run : 1;
        out += run;
    }
    return out == out_end;
}

static tl_status unpack_slices(tli_scan *scan, const header *h, uint8_t *values)
{
    const size_t slice = (size_t)(h->sizes[0] * h->sizes[1]);
    tl_status st = TL_OK;
    for (int64_t k = 0; !st && k < h->sizes[2]; k++) {
        int64_t bytes = 0;
        const uint8_t *runs = NULL;
        st = tli_scan_int(scan, "the size of a slice", 0, INT64_MAX, &bytes);
        if (!st) st = skip_marker(scan);
        if (!st) st = tli_scan_take(scan, "a slice", (uint64_t)bytes, 1, &runs);
        if (!st && !unpack_runs(runs, runs + bytes, values + (size_t)k * slice, slice))
            st = tli_scan_fail(scan, "the runs of slice %" PRId64 " do not make %zu bytes", k,
                               slice);
    }
    return st;
}

tli_match tli_match_slc(const tli_source *source)
{
    if (source->folder || !tli_path_ends(source->path, ".slc")) return TLI_MATCH_NO;
    return tli_head_begins(source, "11111") ? TLI_MATCH_BYTES : TLI_MATCH_NAME;
}

tl_status tli_read_slc(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                       tli_grid *grid)
{
    const char *path = source->path;
    const tli_map *map = &source->map;
    (void)opts;
    tli_scan scan;
    header h = {0};
    tli_volume volume;
    uint8_t *values = NULL;
    tli_volume_init(path, "value", &volume);
    tli_scan_open(ctx, path, map->bytes, map->byte_count, &scan);
    tl_status st = read_header(&scan, &h);
    if (st) return st;
    for (int axis = 0; axis < 3; axis++) {
        volume.dims[axis] = (uint64_t)h.sizes[axis];
        volume.steps[axis][axis] = h.spacing[axis];
    }
    volume.scalar = volume.type = TL_U8;
    tli_volume_order(&volume, true);
    st = tli_volume_bytes(ctx, &volume, &volume.byte_count);
    if (!st && h.packing == 0) {
        st = tli_scan_take(&scan, "values", volume.byte_count, 1, &volume.bytes);
    } else if (!st) {
        uint64_t left = (uint64_t)(scan.end - scan.at);
        if (volume.byte_count / RUN_GROWTH > left)
            return tli_scan_fail(&scan, "%" PRIu64 " bytes of runs can't become %" PRIu64, left,
                                 volume.byte_count);
        values = tl_mem_alloc(ctx, (size_t)volume.byte_count, 1, &st);
        if (!st) st = unpack_slices(&scan, &h, values);
        volume.bytes = values;
    }
    if (!st) st = tli_volume_to_grid(ctx, &volume, grid);
    tl_mem_free(ctx, values);
    return st;
}
