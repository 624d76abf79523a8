/* Inrimage of INRIA: a text header "#INRIMAGE-4#{" of KEY=value lines, filled up to a multiple of
 * 256 bytes that ends in "##}\n", then values, the components of a point together, i fastest. */
#include "formats/formats_volume.h"

#include "formats/formats_number.h"

#include <inttypes.h>
#include <string.h>

#define HEAD_UNIT 256

typedef struct header {
    int64_t dims[3], components, bits;
    double spacing[3], origin[3];
    bool real, is_signed, big_endian;
    double scale; /* of fixed-point numbers */
} header;

static tl_status read_int(tli_scan *scan, const char *key, tli_span value, int64_t *number)
{
    if (tli_span_i64s(value, number, 1) && *number >= 1 && *number <= UINT32_MAX) return TL_OK;
    return tli_scan_fail(scan, "%s: expected a whole number, 1 to %u", key, UINT32_MAX);
}

static tl_status read_real(tli_scan *scan, const char *key, tli_span value, double *number)
{
    if (tli_span_f64s(value, number, 1)) return TL_OK;
    return tli_scan_fail(scan, "%s: expected a number", key);
}

/* SCALE=2**n, of fixed-point numbers. */
static tl_status read_scale(tli_scan *scan, tli_span value, double *scale)
{
    int64_t exponent = 0;
    const char *at = value.text, *end = at + value.bytes;
    if (value.bytes < 4 || memcmp(at, "2**", 3) != 0 || !tli_number_i64(at + 3, end, &exponent) ||
        exponent < -64 || exponent > 64)
        return tli_scan_fail(scan, "SCALE: expected 2**n");
    for (*scale = 1; exponent > 0; exponent--) *scale *= 2;
    for (; exponent < 0; exponent++) *scale /= 2;
    return TL_OK;
}

static tl_status read_key(tli_scan *scan, tli_span key, tli_span value, header *h)
{
    static const char *const dims[] = {"XDIM", "YDIM", "ZDIM"}, *const steps[] = {"VX", "VY", "VZ"},
                             *const places[] = {"TX", "TY", "TZ"};
    for (int axis = 0; axis < 3; axis++) {
        if (tli_span_is(key, dims[axis])) return read_int(scan, dims[axis], value, &h->dims[axis]);
        if (tli_span_is(key, steps[axis]))
            return read_real(scan, steps[axis], value, &h->spacing[axis]);
        if (tli_span_is(key, places[axis]))
            return read_real(scan, places[axis], value, &h->origin[axis]);
    }
    if (tli_span_is(key, "VDIM")) return read_int(scan, "VDIM", value, &h->components);
    if (tli_span_is(key, "SCALE")) return read_scale(scan, value, &h->scale);
    if (tli_span_is(key, "PIXSIZE")) {
        const char *after = tli_number_i64(value.text, value.text + value.bytes, &h->bits);
        if (!after || h->bits < 1 || h->bits > 64)
            return tli_scan_fail(scan, "PIXSIZE: expected 8, 16, 32 or 64 bits");
    }
    if (tli_span_is(key, "CPU"))
        h->big_endian = tli_span_is(value, "sun") || tli_span_is(value, "sgi");
    if (tli_span_is(key, "TYPE")) {
        h->real = tli_span_is(value, "float") || tli_span_is(value, "double");
        h->is_signed = tli_span_is(value, "signed fixed");
        if (!h->real && !h->is_signed && !tli_span_is(value, "unsigned fixed"))
            return tli_scan_fail(scan, "TYPE: expected float, signed fixed or unsigned fixed");
    }
    return TL_OK;
}

static tl_status read_header(tli_scan *scan, header *h)
{
    tl_status st = TL_OK;
    tli_span line;
    tli_scan_line(scan, &line); /* #INRIMAGE-4#{ */
    while (!st) {
        const char *start = scan->at;
        if (!tli_scan_line(scan, &line)) return tli_scan_fail(scan, "expected ##}");
        const char *next = scan->at;
        if (tli_span_is(line, "##}")) break;
        const char *sign = memchr(line.text, '=', line.bytes);
        if (!sign || line.text[0] == '#') continue;
        scan->at = start;
        st = read_key(scan, (tli_span){line.text, (size_t)(sign - line.text)},
                      (tli_span){sign + 1, (size_t)(line.text + line.bytes - sign - 1)}, h);
        if (!st) scan->at = next;
    }
    uint64_t head_bytes = (uint64_t)(scan->at - scan->begin);
    if (!st && head_bytes % HEAD_UNIT)
        st = tli_scan_fail(scan, "a header of %" PRIu64 " bytes, expected a multiple of %d",
                           head_bytes, HEAD_UNIT);
    return st;
}

static tl_status scalar_of(tl_ctx *ctx, const char *path, const header *h, tl_scalar *scalar)
{
    static const struct {
        int64_t bits;
        tl_scalar is_unsigned, is_signed;
    } fixed[] = {
        {8, TL_U8, TL_I8}, {16, TL_U16, TL_I16}, {32, TL_U32, TL_I32}, {64, TL_U64, TL_I64}};
    for (size_t i = 0; !h->real && i < sizeof fixed / sizeof *fixed; i++)
        if (h->bits == fixed[i].bits) {
            *scalar = h->is_signed ? fixed[i].is_signed : fixed[i].is_unsigned;
            return TL_OK;
        }
    if (h->real && (h->bits == 32 || h->bits == 64)) {
        *scalar = h->bits == 32 ? TL_F32 : TL_F64;
        return TL_OK;
    }
    return tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': %s numbers of %" PRId64 " bits", path,
                   h->real ? "floating-point" : "fixed-point", h->bits);
}

tli_match tli_match_inrimage(const tli_source *source)
{
    return tli_head_begins(source, "#INRIMAGE") ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

tl_status tli_read_inrimage(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                            tli_grid *grid)
{
    const char *path = source->path;
    const tli_map *map = &source->map;
    (void)opts;
    tli_scan scan;
    header h = {.dims = {1, 1, 1}, .components = 1, .spacing = {1, 1, 1}, .scale = 1};
    tli_volume volume;
    tli_volume_init(path, "value", &volume);
    tli_scan_open(ctx, path, map->bytes, map->byte_count, &scan);
    tl_status st = read_header(&scan, &h);
    if (!st) st = scalar_of(ctx, path, &h, &volume.scalar);
    if (st) return st;
    for (int axis = 0; axis < 3; axis++) {
        volume.dims[axis] = (uint64_t)h.dims[axis];
        volume.origin[axis] = h.origin[axis];
        volume.steps[axis][axis] = h.spacing[axis];
    }
    volume.components = (uint64_t)h.components;
    tli_volume_order(&volume, true);
    volume.type = volume.scalar;
    volume.big_endian = h.big_endian;
    if (!h.real) volume.slope = h.scale;
    volume.bytes = (const uint8_t *)scan.at;
    volume.byte_count = (uint64_t)(scan.end - scan.at);
    return tli_volume_to_grid(ctx, &volume, grid);
}
