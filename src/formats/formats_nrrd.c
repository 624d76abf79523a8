/* NRRD, versions 1 to 5: a text header of "field: value" lines up to a blank one, then the values,
 * or the name of the file that holds them (teem.sourceforge.net/nrrd/format.html). Axes that are
 * not of space become the components. */
#include "formats/formats_volume.h"

#include "formats/formats_emit.h"
#include "formats/formats_number.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#define AXES_MAX 16 /* as in NRRD */

typedef enum coding { CODING_NONE = 0, CODING_RAW, CODING_TEXT, CODING_GZIP } coding;

typedef struct header {
    tli_scan scan;
    bool has_type, has_endian, big_endian;
    tl_scalar scalar;
    int64_t axes; /* 0: not said yet */
    int64_t sizes[AXES_MAX];
    bool has_sizes, has_spacings, has_mins, has_directions, has_kinds;
    double spacings[AXES_MAX], mins[AXES_MAX], maxs[AXES_MAX];
    double directions[AXES_MAX][3], origin[3];
    bool spatial[AXES_MAX], cell_centred[AXES_MAX];
    coding coding;
    int64_t line_skip, byte_skip;
    tli_span data_file; /* empty: attached */
} header;

/* ---- fields ---- */

static bool type_of(tli_span word, tl_scalar *scalar)
{
    static const struct {
        const char *names[8];
        tl_scalar scalar;
    } types[] = {
        {{"signed char", "int8", "int8_t"}, TL_I8},
        {{"uchar", "unsigned char", "uint8", "uint8_t"}, TL_U8},
        {{"short", "short int", "signed short", "signed short int", "int16", "int16_t"}, TL_I16},
        {{"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}, TL_U16},
        {{"int", "signed int", "int32", "int32_t"}, TL_I32},
        {{"uint", "unsigned int", "uint32", "uint32_t"}, TL_U32},
        {{"longlong", "long long", "long long int", "signed long long", "signed long long int",
          "int64", "int64_t"},
         TL_I64},
        {{"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"},
         TL_U64},
        {{"float"}, TL_F32},
        {{"double"}, TL_F64},
    };
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        for (size_t n = 0; n < 8 && types[i].names[n]; n++)
            if (tli_span_is(word, types[i].names[n])) {
                *scalar = types[i].scalar;
                return true;
            }
    return false;
}

/* The next word of a value; false at its end. */
static bool next_word(tli_span *rest, tli_span *word)
{
    const char *at = rest->text, *end = at + rest->bytes;
    at = tli_number_skip_space(at, end);
    const char *stop = at;
    while (stop < end && tli_number_skip_space(stop, end) == stop) stop++;
    *word = (tli_span){at, (size_t)(stop - at)};
    *rest = (tli_span){stop, (size_t)(end - stop)};
    return word->bytes > 0;
}

/* One number an axis. */
static tl_status axis_reals(header *h, tli_span value, const char *field, double *values)
{
    if (h->axes == 0 || !tli_span_f64s(value, values, (int)h->axes))
        return tli_scan_fail(&h->scan, "%s: expected %" PRId64 " numbers, one an axis", field,
                             h->axes);
    return TL_OK;
}

/* "(x,y,z)" with any number of components, of which three are taken; the place behind it. */
static const char *read_vector(const char *at, const char *end, double vector[3])
{
    at = tli_number_skip_space(at, end);
    if (at == end || *at != '(') return NULL;
    for (int i = 0;; i++) {
        double number;
        at = tli_number_f64(at + 1, end, &number);
        if (!at) return NULL;
        if (i < 3) vector[i] = number;
        at = tli_number_skip_space(at, end);
        if (at < end && *at == ')') return at + 1;
        if (at == end || *at != ',') return NULL;
    }
}

static tl_status read_directions(header *h, tli_span value)
{
    const char *at = value.text, *end = at + value.bytes;
    for (int64_t axis = 0; axis < h->axes; axis++) {
        at = tli_number_skip_space(at, end);
        h->spatial[axis] = !(end - at >= 4 && memcmp(at, "none", 4) == 0);
        at = h->spatial[axis] ? read_vector(at, end, h->directions[axis]) : at + 4;
        if (!at)
            return tli_scan_fail(
                &h->scan, "space directions: expected (x,y,z) or none for each of %" PRId64 " axes",
                h->axes);
    }
    h->has_directions = h->axes > 0;
    return TL_OK;
}

static void read_kinds(header *h, tli_span value)
{
    tli_span word;
    for (int64_t axis = 0; axis < h->axes && next_word(&value, &word); axis++) {
        bool space = tli_span_is(word, "domain") || tli_span_is(word, "space") ||
                     tli_span_is(word, "???") || tli_span_is(word, "none");
        if (!h->has_directions) h->spatial[axis] = space;
    }
    h->has_kinds = h->axes > 0;
}

static tl_status read_sizes(header *h, tli_span value)
{
    if (h->axes == 0 || !tli_span_i64s(value, h->sizes, (int)h->axes))
        return tli_scan_fail(&h->scan, "sizes: expected %" PRId64 " whole numbers, one an axis",
                             h->axes);
    for (int64_t axis = 0; axis < h->axes; axis++)
        if (h->sizes[axis] < 1 || h->sizes[axis] > UINT32_MAX)
            return tli_scan_fail(&h->scan, "sizes: %" PRId64 ", expected 1 to %u", h->sizes[axis],
                                 UINT32_MAX);
    h->has_sizes = true;
    return TL_OK;
}

static tl_status read_coding(header *h, tli_span value)
{
    if (tli_span_is(value, "raw"))
        h->coding = CODING_RAW;
    else if (tli_span_is(value, "txt") || tli_span_is(value, "text") || tli_span_is(value, "ascii"))
        h->coding = CODING_TEXT;
    else if (tli_span_is(value, "gz") || tli_span_is(value, "gzip"))
        h->coding = CODING_GZIP;
    else
        return tl_fail(h->scan.ctx, TL_ERR_UNSUPPORTED,
                       "'%s': encoding %.*s; raw, ascii and gzip are read", h->scan.path,
                       (int)(value.bytes < 40 ? value.bytes : 40), value.text);
    return TL_OK;
}

static tl_status read_dimension(header *h, tli_span value)
{
    if (h->axes) return tli_scan_fail(&h->scan, "dimension stands twice in the header");
    if (!tli_span_i64s(value, &h->axes, 1) || h->axes < 1 || h->axes > AXES_MAX) {
        h->axes = 0;
        return tli_scan_fail(&h->scan, "dimension: expected 1 to %d", AXES_MAX);
    }
    return TL_OK;
}

static void read_centers(header *h, tli_span value)
{
    tli_span word;
    for (int64_t axis = 0; axis < h->axes && next_word(&value, &word); axis++)
        h->cell_centred[axis] = tli_span_is(word, "cell");
}

static tl_status read_skip(header *h, tli_span value, const char *field, int64_t low, int64_t *skip)
{
    if (!tli_span_i64s(value, skip, 1) || *skip < low)
        return tli_scan_fail(&h->scan, "%s: expected a whole number, %" PRId64 " or more", field,
                             low);
    return TL_OK;
}

static tl_status read_field(header *h, tli_span name, tli_span value)
{
    if (tli_span_is(name, "dimension")) return read_dimension(h, value);
    if (tli_span_is(name, "sizes")) return read_sizes(h, value);
    if (tli_span_is(name, "encoding")) return read_coding(h, value);
    if (tli_span_is(name, "space directions")) return read_directions(h, value);
    if (tli_span_is(name, "line skip") || tli_span_is(name, "lineskip"))
        return read_skip(h, value, "line skip", 0, &h->line_skip);
    if (tli_span_is(name, "byte skip") || tli_span_is(name, "byteskip"))
        return read_skip(h, value, "byte skip", -1, &h->byte_skip);
    if (tli_span_is(name, "kinds")) read_kinds(h, value);
    if (tli_span_is(name, "centers") || tli_span_is(name, "centerings")) read_centers(h, value);
    if (tli_span_is(name, "data file") || tli_span_is(name, "datafile")) h->data_file = value;
    if (tli_span_is(name, "spacings")) {
        h->has_spacings = true;
        return axis_reals(h, value, "spacings", h->spacings);
    }
    if (tli_span_is(name, "axis mins") || tli_span_is(name, "axismins")) {
        h->has_mins = true;
        return axis_reals(h, value, "axis mins", h->mins);
    }
    if (tli_span_is(name, "axis maxs") || tli_span_is(name, "axismaxs"))
        return axis_reals(h, value, "axis maxs", h->maxs);
    if (tli_span_is(name, "space origin") &&
        !read_vector(value.text, value.text + value.bytes, h->origin))
        return tli_scan_fail(&h->scan, "space origin: expected (x,y,z)");
    if (tli_span_is(name, "endian")) {
        h->has_endian = true;
        h->big_endian = tli_span_is(value, "big");
        if (!h->big_endian && !tli_span_is(value, "little"))
            return tli_scan_fail(&h->scan, "endian: expected little or big");
    }
    if (tli_span_is(name, "type")) {
        h->has_type = type_of(value, &h->scalar);
        if (!h->has_type) return tli_scan_fail(&h->scan, "type: expected one of numbers");
    }
    return TL_OK;
}

/* Lines up to a blank one or the end of the file. */
static tl_status read_header(header *h)
{
    tli_span line;
    tl_status st = TL_OK;
    for (int axis = 0; axis < AXES_MAX; axis++) h->maxs[axis] = (double)NAN;
    tli_scan_line(&h->scan, &line); /* NRRD000x */
    for (;;) {
        const char *start = h->scan.at;
        if (!tli_scan_line(&h->scan, &line) || line.bytes == 0) break;
        const char *colon = memchr(line.text, ':', line.bytes);
        if (line.text[0] == '#' || (colon && colon + 1 < line.text + line.bytes && colon[1] == '='))
            continue;
        const char *next = h->scan.at;
        h->scan.at = start; /* for messages */
        if (!colon) return tli_scan_fail(&h->scan, "expected 'field: value', key:=value or #");
        st = read_field(h, (tli_span){line.text, (size_t)(colon - line.text)},
                        (tli_span){colon + 1, (size_t)(line.text + line.bytes - colon - 1)});
        if (st) return st;
        h->scan.at = next;
    }
    if (!h->has_type || !h->has_sizes || !h->coding)
        st = tl_fail(h->scan.ctx, TL_ERR_FORMAT, "'%s': the header has no %s", h->scan.path,
                     !h->has_type    ? "type"
                     : !h->has_sizes ? "sizes"
                                     : "encoding");
    return st;
}

/* ---- axes ---- */

static double axis_step(const header *h, int64_t axis)
{
    double step = h->has_spacings ? h->spacings[axis] : (double)NAN;
    int64_t gaps = h->sizes[axis] - !h->cell_centred[axis];
    if (isnan(step) && h->has_mins && gaps > 0)
        step = (h->maxs[axis] - h->mins[axis]) / (double)gaps;
    return isfinite(step) && step != 0 ? step : 1;
}

static void place_axis(const header *h, int64_t axis, int space, tli_volume *volume)
{
    if (h->has_directions) {
        memcpy(volume->steps[space], h->directions[axis], sizeof volume->steps[space]);
        return;
    }
    double step = axis_step(h, axis);
    volume->steps[space][space] = step;
    volume->origin[space] = h->origin[space];
    if (h->has_mins && isfinite(h->mins[axis]))
        volume->origin[space] = h->mins[axis] + (h->cell_centred[axis] ? 0.5 * step : 0);
}

/* Axes of space to i, j, k in their order; the others, which must be neighbours, to components. */
static tl_status map_axes(const header *h, tli_volume *volume)
{
    uint64_t stride = 1;
    int space = 0;
    int64_t last_other = -1;
    bool told = h->has_directions || h->has_kinds;
    memcpy(volume->origin, h->origin, sizeof volume->origin);
    for (int64_t axis = 0; axis < h->axes; axis++) {
        uint64_t size = (uint64_t)h->sizes[axis];
        if (stride > UINT64_MAX / size)
            return tl_fail(h->scan.ctx, TL_ERR_FORMAT, "'%s': the sizes overflow", h->scan.path);
        if (told ? h->spatial[axis] : h->axes <= 3 || axis > 0) {
            if (space == 3)
                return tl_fail(h->scan.ctx, TL_ERR_UNSUPPORTED, "'%s': more than 3 axes of space",
                               h->scan.path);
            volume->dims[space] = size;
            volume->strides[space] = stride;
            place_axis(h, axis, space++, volume);
        } else {
            if (last_other >= 0 && last_other + 1 != axis)
                return tl_fail(h->scan.ctx, TL_ERR_UNSUPPORTED,
                               "'%s': axes of space between those of components", h->scan.path);
            if (last_other < 0) volume->strides[3] = stride;
            last_other = axis;
            volume->components *= size;
        }
        stride *= size;
    }
    return TL_OK;
}

/* ---- values ---- */

/* The bytes where the values stand, after the lines to skip. */
static tl_status find_values(const header *h, const tli_map *map, tli_scan *values)
{
    const char *begin = (const char *)map->bytes;
    tli_span line;
    tli_scan_open(h->scan.ctx, h->scan.path, begin, map->byte_count, values);
    if (!h->data_file.bytes) values->at = h->scan.at;
    for (int64_t i = 0; i < h->line_skip; i++)
        if (!tli_scan_line(values, &line))
            return tli_scan_fail(values, "%" PRId64 " lines to skip", h->line_skip);
    return TL_OK;
}

static tl_status skip_bytes(const header *h, uint64_t needed, const uint8_t **bytes,
                            uint64_t *count)
{
    uint64_t skip = (uint64_t)h->byte_skip;
    if (h->byte_skip < 0) skip = *count > needed ? *count - needed : 0;
    if (skip > *count)
        return tl_fail(h->scan.ctx, TL_ERR_FORMAT, "'%s': %" PRIu64 " bytes to skip, of %" PRIu64,
                       h->scan.path, skip, *count);
    *bytes += skip;
    *count -= skip;
    return TL_OK;
}

static tl_status read_values(const header *h, const tli_map *map, tli_volume *volume,
                             tli_grid *grid)
{
    tl_ctx *ctx = h->scan.ctx;
    tli_scan values;
    tli_map unpacked = {0};
    uint64_t needed = 0;
    tl_status st = tli_volume_bytes(ctx, volume, &needed);
    if (!st) st = find_values(h, map, &values);
    if (st) return st;
    const uint8_t *bytes = (const uint8_t *)values.at;
    uint64_t count = (uint64_t)(values.end - values.at);
    if (h->coding == CODING_TEXT) {
        st = tli_volume_text(&values, needed / tl_scalar_bytes(volume->scalar), &unpacked);
        volume->scalar = TL_F64;
        volume->big_endian = tli_big_endian_host();
    } else if (h->coding == CODING_GZIP) {
        st = tli_inflate(ctx, h->scan.path, bytes, count, UINT64_MAX, false, &unpacked);
    }
    if (!st && unpacked.owned) {
        bytes = unpacked.bytes;
        count = unpacked.byte_count;
    }
    if (!st && h->coding != CODING_TEXT) st = skip_bytes(h, needed, &bytes, &count);
    volume->bytes = bytes;
    volume->byte_count = count;
    if (!st) st = tli_volume_to_grid(ctx, volume, grid);
    tli_map_close(ctx, &unpacked);
    return st;
}

tli_match tli_match_nrrd(const tli_source *source)
{
    return tli_head_begins(source, "NRRD000") ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

tl_status tli_read_nrrd(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                        tli_grid *grid)
{
    const char *path = source->path;
    const tli_map *map = &source->map;
    (void)opts;
    header h = {0};
    tli_volume volume;
    tli_volume_init(path, "value", &volume);
    tli_scan_open(ctx, path, map->bytes, map->byte_count, &h.scan);
    tl_status st = read_header(&h);
    if (!st) st = map_axes(&h, &volume);
    if (st) return st;
    volume.scalar = volume.type = h.scalar;
    volume.big_endian = h.big_endian;
    if (!h.has_endian && h.coding != CODING_TEXT && tl_scalar_bytes(h.scalar) > 1)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': the header has no endian", path);
    if (!h.data_file.bytes) return read_values(&h, map, &volume, grid);

    char *name = NULL;
    tli_map data = {0};
    tli_span rest = h.data_file, file = {0};
    next_word(&rest, &file);
    if (tli_span_is(file, "LIST") || (file.bytes && memchr(file.text, '%', file.bytes)))
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "'%s': values in several files; one data file is read", path);
    file = (tli_span){file.text, (size_t)(h.data_file.text + h.data_file.bytes - file.text)};
    st = tli_open_named(ctx, path, file, &name, &data);
    if (!st) st = read_values(&h, &data, &volume, grid);
    tli_map_close(ctx, &data);
    tl_mem_free(ctx, name);
    return st ? tl_note(ctx, st, "while reading the values of '%s'", path) : TL_OK;
}
