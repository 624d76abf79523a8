/* OpenFOAM: files of entries "key value;", blocks and lists. A head FoamFile { } says whether lists
 * are text or binary; the numbers of binary ones stand between the parentheses. */
#include "formats/formats_openfoam.h"

#include "formats/formats_number.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define DEPTH_MAX 64

/* ---- words ---- */

char tli_foam_peek(tli_foam *file)
{
    tli_scan *scan = &file->scan;
    for (;;) {
        scan->at = tli_number_skip_space(scan->at, scan->end);
        size_t left = (size_t)(scan->end - scan->at);
        if (left == 0) return 0;
        if (left < 2 || scan->at[0] != '/' || (scan->at[1] != '/' && scan->at[1] != '*'))
            return scan->at[0];
        if (scan->at[1] == '/') {
            const char *line_end = memchr(scan->at, '\n', left);
            scan->at = line_end ? line_end : scan->end;
            continue;
        }
        const char *p = scan->at + 2;
        while (p + 1 < scan->end && !(p[0] == '*' && p[1] == '/')) p++;
        scan->at = p + 1 < scan->end ? p + 2 : scan->end;
    }
}

tl_status tli_foam_take(tli_foam *file, char expected)
{
    if (tli_foam_peek(file) != expected)
        return tli_scan_fail(&file->scan, "expected '%c'", expected);
    file->scan.at++;
    return TL_OK;
}

static bool ends_word(char c)
{
    return c == ';' || c == '{' || c == '}' || c == '[' || c == ']' || c == ' ' ||
           (c >= '\t' && c <= '\r');
}

tl_status tli_foam_word(tli_foam *file, tli_span *word)
{
    tli_scan *scan = &file->scan;
    if (!tli_foam_peek(file)) return tli_scan_fail(scan, "expected a word");
    const char *p = scan->at;
    if (*p == '"') {
        const char *quote = memchr(p + 1, '"', (size_t)(scan->end - p - 1));
        if (!quote) return tli_scan_fail(scan, "a text that does not end");
        *word = (tli_span){p + 1, (size_t)(quote - p - 1)};
        scan->at = quote + 1;
        return TL_OK;
    }
    int depth = 0; /* parentheses may stand in a word: div(phi,U) */
    while (p < scan->end && !ends_word(*p) && !(*p == '(' && p == scan->at) &&
           !(*p == ')' && depth == 0)) {
        depth += *p == '(';
        depth -= *p == ')';
        p++;
    }
    if (p == scan->at) return tli_scan_fail(scan, "expected a word");
    *word = (tli_span){scan->at, (size_t)(p - scan->at)};
    scan->at = p;
    return TL_OK;
}

tl_status tli_foam_skip_entry(tli_foam *file)
{
    int depth = 0;
    for (;;) {
        char c = tli_foam_peek(file);
        if (!c) return tli_scan_fail(&file->scan, "an entry that does not end");
        if (c == '"') {
            tli_span text;
            tl_status st = tli_foam_word(file, &text);
            if (st) return st;
            continue;
        }
        if (c == '}' && depth == 0) return TL_OK; /* of the block around it */
        file->scan.at++;
        if (c == ';' && depth == 0) return TL_OK;
        if (c == '{' || c == '(' || c == '[') depth++;
        if (c == '}' || c == ')' || c == ']') depth--;
        if (c == '}' && depth == 0) return TL_OK;
        if (depth < 0 || depth > DEPTH_MAX)
            return tli_scan_fail(&file->scan, "brackets that do not match");
    }
}

/* ---- head ---- */

/* "LSB;label=32;scalar=64" */
static void read_arch(tli_foam *file, tli_span arch)
{
    char text[96];
    tli_span_text(arch, text, sizeof text);
    file->scan.big_endian = strstr(text, "MSB") != NULL;
    if (strstr(text, "label=64")) file->label_bytes = 8;
    if (strstr(text, "scalar=32")) file->scalar_bytes = 4;
}

static tl_status read_head(tli_foam *file)
{
    tli_span key, value;
    tl_status st = tli_foam_word(file, &key);
    if (!st && !tli_span_is(key, "FoamFile"))
        return tli_scan_fail(&file->scan, "expected FoamFile before this");
    if (!st) st = tli_foam_take(file, '{');
    while (!st && tli_foam_peek(file) != '}') {
        st = tli_foam_word(file, &key);
        if (!st && tli_foam_peek(file) != ';') {
            st = tli_foam_word(file, &value);
            if (!st && tli_span_is(key, "format")) file->binary = tli_span_is(value, "binary");
            if (!st && tli_span_is(key, "class"))
                tli_span_text(value, file->class_name, sizeof file->class_name);
            if (!st && tli_span_is(key, "arch")) read_arch(file, value);
        }
        if (!st) st = tli_foam_skip_entry(file);
    }
    return st ? st : tli_foam_take(file, '}');
}

/* path and a tail in one block. */
static char *with_tail(tl_ctx *ctx, const char *path, const char *tail, tl_status *st)
{
    size_t room = strlen(path) + strlen(tail) + 1;
    char *joined = tl_mem_alloc(ctx, room, 1, st);
    if (*st) return NULL;
    snprintf(joined, room, "%s%s", path, tail);
    return joined;
}

tl_status tli_foam_attach(tl_ctx *ctx, const char *path, tli_map map, tli_foam *file)
{
    tl_status st = TL_OK;
    *file = (tli_foam){.ctx = ctx, .map = map, .label_bytes = 4, .scalar_bytes = 8};
    file->path = with_tail(ctx, path, "", &st);
    if (!st) {
        tli_scan_open(ctx, file->path, map.bytes, map.byte_count, &file->scan);
        st = read_head(file);
    }
    if (st) tli_foam_close(file);
    return st;
}

static tl_status unpack(tl_ctx *ctx, const char *path, tli_map *map)
{
    tli_map packed = *map;
    *map = (tli_map){0};
    tl_status st = tli_inflate(ctx, path, packed.bytes, packed.byte_count, UINT64_MAX, false, map);
    tli_map_close(ctx, &packed);
    return st;
}

tl_status tli_foam_open(tl_ctx *ctx, const char *path, tli_foam *file, bool *there)
{
    tl_status st = TL_OK;
    tli_map map = {0};
    *file = (tli_foam){.ctx = ctx};
    *there = false;
    char *packed = with_tail(ctx, path, ".gz", &st);
    if (st) return st;
    const char *name = tli_file_exists(path) ? path : packed;
    *there = tli_file_exists(name);
    if (*there) st = tli_map_open(ctx, name, &map);
    if (!st && *there && tli_is_gzip(map.bytes, map.byte_count)) st = unpack(ctx, name, &map);
    if (!st && *there) st = tli_foam_attach(ctx, name, map, file);
    tl_mem_free(ctx, packed);
    return st;
}

void tli_foam_close(tli_foam *file)
{
    tli_map_close(file->ctx, &file->map);
    tl_mem_free(file->ctx, file->path);
    *file = (tli_foam){.ctx = file->ctx};
}

/* ---- lists ---- */

tl_status tli_foam_begin_list(tli_foam *file, const char *what, uint64_t bytes, uint64_t most,
                              uint64_t *count, bool *one)
{
    int64_t value = 0;
    (void)tli_foam_peek(file);
    tl_status st = TL_OK;
    const char *digits = file->scan.at; /* 5{...} and 5(...) run on */
    while (file->scan.at < file->scan.end && *file->scan.at >= '0' && *file->scan.at <= '9' &&
           file->scan.at - digits < 18)
        value = 10 * value + (*file->scan.at++ - '0');
    if (digits == file->scan.at)
        return tli_scan_fail(&file->scan, "expected the number of %s", what);
    char c = tli_foam_peek(file);
    *one = c == '{';
    if (c != '(' && c != '{') {
        *count = (uint64_t)value;
        if (value == 0) return TL_OK; /* 0; without brackets */
        return tli_scan_fail(&file->scan, "expected '(' after the number of %s", what);
    }
    file->scan.at++;
    if (!*one) st = tli_scan_room(&file->scan, what, (uint64_t)value, bytes);
    if (!st && *one && (uint64_t)value > most)
        st = tli_scan_fail(&file->scan, "%" PRId64 " equal %s, expected at most %" PRIu64, value,
                           what, most);
    *count = (uint64_t)value;
    return st;
}

static tl_status end_list(tli_foam *file, uint64_t count, bool one)
{
    if (count == 0 && tli_foam_peek(file) != ')' && tli_foam_peek(file) != '}') return TL_OK;
    return tli_foam_take(file, one ? '}' : ')');
}

static tl_status next_label(tli_foam *file, const char *what, bool binary, int64_t low,
                            int64_t high, uint32_t *value)
{
    int64_t number = 0;
    tl_status st = TL_OK;
    if (binary) {
        const uint8_t *bytes = NULL;
        st = tli_scan_take(&file->scan, what, 1, file->label_bytes, &bytes);
        if (!st) number = tli_int_at(bytes, file->label_bytes, file->scan.big_endian);
    } else {
        (void)tli_foam_peek(file);
        const char *end = file->scan.at; /* the number may run into a bracket */
        while (end < file->scan.end && (*end == '-' || (*end >= '0' && *end <= '9'))) end++;
        if (!tli_number_i64(file->scan.at, end, &number))
            return tli_scan_fail(&file->scan, "expected %s, a whole number", what);
        file->scan.at = end;
    }
    if (!st && (number < low || number > high))
        st = tli_scan_fail(&file->scan, "%s %" PRId64 ", expected %" PRId64 " to %" PRId64, what,
                           number, low, high);
    *value = number < 0 ? TL_NONE : (uint32_t)number;
    return st;
}

tl_status tli_foam_labels(tli_foam *file, const char *what, int64_t low, int64_t high,
                          uint64_t most, uint64_t *count, uint32_t **values)
{
    bool one = false;
    tl_status st =
        tli_foam_begin_list(file, what, file->binary ? file->label_bytes : 2, most, count, &one);
    uint32_t *list = tl_mem_alloc(file->ctx, (size_t)*count, sizeof *list, &st);
    for (uint64_t i = 0; !st && i < *count; i++) {
        if (one && i > 0)
            list[i] = list[0];
        else
            st = next_label(file, what, file->binary && !one, low, high, &list[i]);
    }
    if (!st) st = end_list(file, *count, one);
    if (st) {
        tl_mem_free(file->ctx, list);
        return st;
    }
    *values = list;
    return TL_OK;
}

/* A number, or as many in parentheses. */
static tl_status next_tuple(tli_foam *file, const char *what, uint32_t components, double *values)
{
    tl_status st = components > 1 ? tli_foam_take(file, '(') : TL_OK;
    for (uint32_t c = 0; !st && c < components; c++) {
        (void)tli_foam_peek(file);
        const char *after = tli_number_f64(file->scan.at, file->scan.end, &values[c]);
        if (!after) return tli_scan_fail(&file->scan, "expected %s, a number", what);
        file->scan.at = after;
    }
    return !st && components > 1 ? tli_foam_take(file, ')') : st;
}

tl_status tli_foam_reals(tli_foam *file, const char *what, uint32_t components, uint64_t most,
                         uint64_t *count, double **values)
{
    bool one = false;
    uint64_t bytes = components * (file->binary ? file->scalar_bytes : 2);
    tl_status st = tli_foam_begin_list(file, what, bytes, most, count, &one);
    double *list = tl_mem_alloc(file->ctx, (size_t)*count, components * sizeof *list, &st);
    if (!st && file->binary && !one)
        st = tli_scan_binary_reals(&file->scan, what, file->scalar_bytes == 4 ? TL_F32 : TL_F64,
                                   *count * components, list);
    for (uint64_t i = 0; !st && i < *count && (one || !file->binary); i++) {
        if (one && i > 0)
            memcpy(list + i * components, list, components * sizeof *list);
        else
            st = next_tuple(file, what, components, list + i * components);
    }
    if (!st) st = end_list(file, *count, one);
    if (st) {
        tl_mem_free(file->ctx, list);
        return st;
    }
    *values = list;
    return TL_OK;
}

tl_status tli_foam_field(tli_foam *file, uint32_t components, uint64_t count, double *values)
{
    tli_span word;
    uint64_t found = 0;
    double *list = NULL;
    tl_status st = tli_foam_word(file, &word);
    if (!st && tli_span_is(word, "uniform")) {
        double tuple[9];
        st = next_tuple(file, "a value", components, tuple);
        for (uint64_t i = 0; !st && i < count; i++)
            memcpy(values + i * components, tuple, components * sizeof *tuple);
        return st;
    }
    if (!st && !tli_span_is(word, "nonuniform"))
        return tli_scan_fail(&file->scan, "expected uniform or nonuniform before this");
    char c = st ? 0 : tli_foam_peek(file);
    if (!st && !(c >= '0' && c <= '9')) st = tli_foam_word(file, &word); /* List<...> */
    if (!st) st = tli_foam_reals(file, "values", components, count, &found, &list);
    if (!st && found != count)
        st = tli_scan_fail(&file->scan, "%" PRIu64 " values before this, expected %" PRIu64, found,
                           count);
    if (!st) memcpy(values, list, (size_t)count * components * sizeof *values);
    tl_mem_free(file->ctx, list);
    return st;
}

/* ---- faces ---- */

static tl_status read_plain_faces(tli_foam *file, tli_foam_mesh *mesh)
{
    bool one = false, inner = false;
    uint64_t room = 0, used = 0;
    /* 3(0 1 2) and the blank after it */
    tl_status st = tli_foam_begin_list(file, "faces", 3, 0, &mesh->face_count, &one);
    mesh->face_offsets =
        tl_mem_alloc(file->ctx, (size_t)mesh->face_count + 1, sizeof *mesh->face_offsets, &st);
    if (!st) mesh->face_offsets[0] = 0;
    for (uint64_t f = 0; !st && f < mesh->face_count; f++) {
        uint64_t corners = 0;
        st = tli_foam_begin_list(file, "corners", 2, 0, &corners, &inner);
        if (!st && used + corners > room) {
            room = 2 * (used + corners) + 1024;
            mesh->face_points = tl_mem_resize(file->ctx, mesh->face_points, (size_t)room,
                                              sizeof *mesh->face_points, &st);
        }
        for (uint64_t i = 0; !st && i < corners; i++)
            st = next_label(file, "a point", false, 0, (int64_t)mesh->point_count - 1,
                            &mesh->face_points[used + i]);
        if (!st) st = end_list(file, corners, false);
        used += corners;
        mesh->face_offsets[f + 1] = used;
    }
    return st ? st : end_list(file, mesh->face_count, false);
}

static tl_status read_compact_faces(tli_foam *file, tli_foam_mesh *mesh)
{
    uint32_t *offsets = NULL;
    uint64_t count = 0, points = 0;
    tl_status st =
        tli_foam_labels(file, "offsets of faces", 0, UINT32_MAX - 1, 0, &count, &offsets);
    if (!st && count == 0) st = tli_scan_fail(&file->scan, "no offset of faces");
    if (!st)
        st = tli_foam_labels(file, "points of faces", 0, (int64_t)mesh->point_count - 1, 0, &points,
                             &mesh->face_points);
    mesh->face_offsets = tl_mem_alloc(file->ctx, (size_t)count, sizeof *mesh->face_offsets, &st);
    if (!st) mesh->face_count = count - 1;
    for (uint64_t i = 0; !st && i < count; i++) {
        mesh->face_offsets[i] = offsets[i];
        if (offsets[i] > points || (i == 0 ? offsets[0] != 0 : offsets[i] < offsets[i - 1]))
            st = tli_scan_fail(&file->scan,
                               "offset %" PRIu64 " of faces is %u, of %" PRIu64 " points", i,
                               offsets[i], points);
    }
    tl_mem_free(file->ctx, offsets);
    return st;
}

tl_status tli_foam_faces(tli_foam *file, tli_foam_mesh *mesh)
{
    return strstr(file->class_name, "Compact") || file->binary ? read_compact_faces(file, mesh)
                                                               : read_plain_faces(file, mesh);
}
