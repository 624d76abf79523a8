/* MetaImage (.mha, .mhd): "Key = value" lines, the last of which names the file of the values or
 * says LOCAL (itk.org/Wiki/MetaIO/Documentation). Channels of a point stand together. */
#include "formats/formats_volume.h"

#include "formats/formats_emit.h"

#include <inttypes.h>
#include <string.h>

typedef struct header {
    tli_scan scan;
    int64_t axes;
    int64_t sizes[3];
    double spacing[3], origin[3], matrix[9]; /* matrix: a row an axis */
    int64_t channels, header_bytes;
    tl_scalar scalar;
    bool has_sizes, has_type, text, packed, big_endian;
    tli_span data_file; /* empty: not said */
} header;

static bool type_of(tli_span word, tl_scalar *scalar)
{
    static const struct {
        const char *name;
        tl_scalar scalar;
    } types[] = {
        {"MET_CHAR", TL_I8},        {"MET_UCHAR", TL_U8},  {"MET_SHORT", TL_I16},
        {"MET_USHORT", TL_U16},     {"MET_INT", TL_I32},   {"MET_UINT", TL_U32},
        {"MET_LONG", TL_I32},       {"MET_ULONG", TL_U32}, {"MET_LONG_LONG", TL_I64},
        {"MET_ULONG_LONG", TL_U64}, {"MET_FLOAT", TL_F32}, {"MET_DOUBLE", TL_F64},
    };
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (tli_span_is(word, types[i].name)) {
            *scalar = types[i].scalar;
            return true;
        }
    return false;
}

static bool is_true(tli_span value)
{
    return tli_span_is(value, "True") || tli_span_is(value, "1");
}

static tl_status read_matrix(header *h, tli_span value)
{
    double rows[9] = {0};
    int count = (int)(h->axes * h->axes);
    if (!tli_span_f64s(value, rows, count))
        return tli_scan_fail(&h->scan, "TransformMatrix: expected %d numbers", count);
    for (int64_t row = 0; row < h->axes; row++)
        for (int64_t axis = 0; axis < h->axes; axis++)
            h->matrix[3 * row + axis] = rows[row * h->axes + axis];
    return TL_OK;
}

static tl_status axis_reals(header *h, tli_span value, const char *key, double *values)
{
    if (tli_span_f64s(value, values, (int)h->axes)) return TL_OK;
    return tli_scan_fail(&h->scan, "%s: expected %" PRId64 " numbers, one an axis", key, h->axes);
}

static tl_status read_sizes(header *h, tli_span value)
{
    h->has_sizes = tli_span_i64s(value, h->sizes, (int)h->axes);
    for (int64_t axis = 0; h->has_sizes && axis < h->axes; axis++)
        h->has_sizes = h->sizes[axis] >= 1 && h->sizes[axis] <= UINT32_MAX;
    if (h->has_sizes) return TL_OK;
    return tli_scan_fail(&h->scan, "DimSize: expected %" PRId64 " whole numbers above 0", h->axes);
}

static tl_status read_key(header *h, tli_span key, tli_span value)
{
    if (tli_span_is(key, "NDims")) {
        if (!tli_span_i64s(value, &h->axes, 1) || h->axes < 1 || h->axes > 3)
            return tl_fail(h->scan.ctx, TL_ERR_UNSUPPORTED,
                           "'%s': NDims %.*s; images of 1 to 3 axes are read", h->scan.path,
                           (int)(value.bytes < 20 ? value.bytes : 20), value.text);
    } else if (tli_span_is(key, "DimSize")) {
        return read_sizes(h, value);
    } else if (tli_span_is(key, "ElementSpacing")) {
        return axis_reals(h, value, "ElementSpacing", h->spacing);
    } else if (tli_span_is(key, "Offset") || tli_span_is(key, "Origin") ||
               tli_span_is(key, "Position")) {
        return axis_reals(h, value, "Offset", h->origin);
    } else if (tli_span_is(key, "TransformMatrix") || tli_span_is(key, "Rotation") ||
               tli_span_is(key, "Orientation")) {
        return read_matrix(h, value);
    } else if (tli_span_is(key, "ElementNumberOfChannels")) {
        if (!tli_span_i64s(value, &h->channels, 1) || h->channels < 1)
            return tli_scan_fail(&h->scan, "ElementNumberOfChannels: expected 1 or more");
    } else if (tli_span_is(key, "HeaderSize")) {
        if (!tli_span_i64s(value, &h->header_bytes, 1) || h->header_bytes < -1)
            return tli_scan_fail(&h->scan, "HeaderSize: expected -1 or more");
    } else if (tli_span_is(key, "ElementType")) {
        h->has_type = type_of(value, &h->scalar);
        if (!h->has_type) return tli_scan_fail(&h->scan, "ElementType: expected one of numbers");
    } else if (tli_span_is(key, "BinaryData")) {
        h->text = !is_true(value);
    } else if (tli_span_is(key, "CompressedData")) {
        h->packed = is_true(value);
    } else if (tli_span_is(key, "BinaryDataByteOrderMSB") ||
               tli_span_is(key, "ElementByteOrderMSB")) {
        h->big_endian = is_true(value);
    } else if (tli_span_is(key, "ElementDataFile")) {
        h->data_file = value;
    }
    return TL_OK;
}

/* Lines up to ElementDataFile, which is the last one. */
static tl_status read_header(header *h)
{
    tl_status st = TL_OK;
    while (!st && !h->data_file.bytes) {
        const char *start = h->scan.at;
        tli_span line;
        if (!tli_scan_line(&h->scan, &line))
            return tli_scan_fail(&h->scan, "expected a line ElementDataFile");
        const char *sign = memchr(line.text, '=', line.bytes), *next = h->scan.at;
        if (!sign) continue;
        h->scan.at = start;
        st = read_key(h, (tli_span){line.text, (size_t)(sign - line.text)},
                      (tli_span){sign + 1, (size_t)(line.text + line.bytes - sign - 1)});
        if (!st) h->scan.at = next;
    }
    if (!st && (!h->has_sizes || !h->has_type))
        st = tl_fail(h->scan.ctx, TL_ERR_FORMAT, "'%s': the header has no %s", h->scan.path,
                     h->has_sizes ? "ElementType" : "DimSize");
    return st;
}

static void place_axes(const header *h, tli_volume *volume)
{
    for (int64_t axis = 0; axis < h->axes; axis++) {
        volume->dims[axis] = (uint64_t)h->sizes[axis];
        volume->origin[axis] = h->origin[axis];
        for (int64_t k = 0; k < 3; k++)
            volume->steps[axis][k] = h->matrix[3 * axis + k] * h->spacing[axis];
    }
}

static tl_status read_values(const header *h, const uint8_t *bytes, uint64_t count,
                             const char *path, tli_volume *volume, tli_grid *grid)
{
    tl_ctx *ctx = h->scan.ctx;
    tli_map unpacked = {0};
    uint64_t needed = 0;
    tl_status st = tli_volume_bytes(ctx, volume, &needed);
    if (st) return st;
    if (h->packed) {
        st = tli_inflate(ctx, path, bytes, count, needed, true, &unpacked);
    } else if (h->text) {
        tli_scan values;
        tli_scan_open(ctx, path, bytes, count, &values);
        st = tli_volume_text(&values, needed / tl_scalar_bytes(volume->scalar), &unpacked);
        volume->scalar = TL_F64;
        volume->big_endian = tli_big_endian_host();
    }
    if (unpacked.owned) {
        bytes = unpacked.bytes;
        count = unpacked.byte_count;
    } else if (!st) {
        uint64_t skip = h->header_bytes > 0 ? (uint64_t)h->header_bytes : 0;
        if (h->header_bytes < 0) skip = count > needed ? count - needed : 0;
        if (skip > count) skip = count;
        bytes += skip;
        count -= skip;
    }
    volume->bytes = bytes;
    volume->byte_count = count;
    if (!st) st = tli_volume_to_grid(ctx, volume, grid);
    tli_map_close(ctx, &unpacked);
    return st;
}

tli_match tli_match_metaimage(const tli_source *source)
{
    if (strstr(source->head, "ElementDataFile") && strstr(source->head, "DimSize"))
        return TLI_MATCH_BYTES;
    return !source->folder && tli_ends_in(source->path, ".mhd .mha") ? TLI_MATCH_NAME
                                                                     : TLI_MATCH_NO;
}

tl_status tli_read_metaimage(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                             tli_grid *grid)
{
    const char *path = source->path;
    const tli_map *map = &source->map;
    (void)opts;
    header h = {
        .axes = 3, .spacing = {1, 1, 1}, .matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .channels = 1};
    tli_volume volume;
    tli_volume_init(path, "value", &volume);
    tli_scan_open(ctx, path, map->bytes, map->byte_count, &h.scan);
    tl_status st = read_header(&h);
    if (st) return st;
    place_axes(&h, &volume);
    volume.components = (uint64_t)h.channels;
    tli_volume_order(&volume, true);
    volume.scalar = volume.type = h.scalar;
    volume.big_endian = h.big_endian;
    if (tli_span_is(h.data_file, "LOCAL"))
        return read_values(&h, (const uint8_t *)h.scan.at, (uint64_t)(h.scan.end - h.scan.at), path,
                           &volume, grid);
    while (h.data_file.bytes && h.data_file.text[0] == ' ') {
        h.data_file.text++;
        h.data_file.bytes--;
    }
    if (tli_span_is(h.data_file, "LIST") ||
        (h.data_file.bytes && memchr(h.data_file.text, '%', h.data_file.bytes)))
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "'%s': values in several files; one data file is read", path);
    char *name = NULL;
    tli_map data = {0};
    st = tli_open_named(ctx, path, h.data_file, &name, &data);
    if (!st) st = read_values(&h, data.bytes, data.byte_count, name, &volume, grid);
    tli_map_close(ctx, &data);
    tl_mem_free(ctx, name);
    return st ? tl_note(ctx, st, "while reading the values of '%s'", path) : TL_OK;
}
