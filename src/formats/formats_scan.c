/* A file's text and bytes taken one after the other: words, lines, numbers, runs of binary numbers,
 * each checked against what is left. */
#include "formats/formats_scan.h"

#include "formats/formats_number.h"
#include "formats/formats_reader.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* Characters of the file that a message shows. */
#define SHOWN_MAX 24

void tli_scan_open(tl_ctx *ctx, const char *path, const void *bytes, uint64_t byte_count,
                   tli_scan *scan)
{
    const char *text = bytes;
    *scan =
        (tli_scan){.ctx = ctx, .path = path, .begin = text, .at = text, .end = text + byte_count};
}

tl_status tli_scan_fail(const tli_scan *scan, const char *format, ...)
{
    char what[400];
    va_list args;
    va_start(args, format);
    tli_vprint(what, sizeof what, format, args);
    va_end(args);
    if (scan->binary)
        return tl_fail(scan->ctx, TL_ERR_FORMAT, "'%s': byte %" PRIu64 ": %s", scan->path,
                       (uint64_t)(scan->at - scan->begin), what);
    uint64_t line = 1;
    for (const char *p = scan->begin; p < scan->at; p++) line += *p == '\n';
    char shown[SHOWN_MAX + 1];
    size_t length = 0;
    for (const char *p = scan->at; p < scan->end && length < SHOWN_MAX && *p >= ' ' && *p <= '~';
         p++)
        shown[length++] = *p;
    shown[length] = '\0';
    return tl_fail(scan->ctx, TL_ERR_FORMAT, "'%s': line %" PRIu64 ": %s, found '%s'", scan->path,
                   line, what, scan->at < scan->end ? shown : "the end of the file");
}

/* ---- text ---- */

static bool is_space(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

bool tli_scan_at_end(tli_scan *scan)
{
    for (;;) {
        while (scan->at < scan->end && is_space(*scan->at)) scan->at++;
        if (scan->at == scan->end) return true;
        if (!scan->comment || *scan->at != scan->comment) return false;
        const char *line_end = memchr(scan->at, '\n', (size_t)(scan->end - scan->at));
        scan->at = line_end ? line_end : scan->end;
    }
}

bool tli_scan_word(tli_scan *scan, tli_span *word)
{
    if (tli_scan_at_end(scan)) return false;
    const char *p = scan->at;
    while (p < scan->end && !is_space(*p)) p++;
    *word = (tli_span){scan->at, (size_t)(p - scan->at)};
    scan->at = p;
    return true;
}

bool tli_scan_line(tli_scan *scan, tli_span *line)
{
    if (scan->at == scan->end) return false;
    const char *line_end = memchr(scan->at, '\n', (size_t)(scan->end - scan->at));
    const char *stop = line_end ? line_end : scan->end;
    *line = (tli_span){scan->at, (size_t)(stop - scan->at)};
    if (line->bytes && line->text[line->bytes - 1] == '\r') line->bytes--;
    scan->at = line_end ? line_end + 1 : scan->end;
    return true;
}

tl_status tli_scan_int(tli_scan *scan, const char *what, int64_t low, int64_t high, int64_t *value)
{
    int64_t number;
    (void)tli_scan_at_end(scan);
    const char *after = tli_number_i64(scan->at, scan->end, &number);
    if (!after || number < low || number > high)
        return tli_scan_fail(scan, "expected %s, a whole number of %" PRId64 " to %" PRId64, what,
                             low, high);
    scan->at = after;
    *value = number;
    return TL_OK;
}

tl_status tli_scan_real(tli_scan *scan, const char *what, double *value)
{
    (void)tli_scan_at_end(scan);
    const char *after = tli_number_f64(scan->at, scan->end, value);
    if (!after) return tli_scan_fail(scan, "expected %s, a number", what);
    scan->at = after;
    return TL_OK;
}

tl_status tli_scan_reals(tli_scan *scan, const char *what, uint64_t count, double *values)
{
    tl_status st = TL_OK;
    for (uint64_t i = 0; !st && i < count; i++) st = tli_scan_real(scan, what, &values[i]);
    return st;
}

tl_status tli_scan_room(const tli_scan *scan, const char *what, uint64_t count, uint64_t min_bytes)
{
    /* the last one needs no blank behind it */
    uint64_t left = (uint64_t)(scan->end - scan->at) + !scan->binary;
    if (min_bytes && count > left / min_bytes)
        return tli_scan_fail(scan,
                             "%" PRIu64 " %s need %" PRIu64 " bytes each at least, but %" PRIu64
                             " are left of the file",
                             count, what, min_bytes, (uint64_t)(scan->end - scan->at));
    return TL_OK;
}

/* ---- bytes ---- */

int64_t tli_int_at(const uint8_t *at, unsigned bytes, bool big_endian)
{
    uint64_t bits = 0;
    for (unsigned i = 0; i < bytes; i++)
        bits |= (uint64_t)at[i] << 8 * (big_endian ? bytes - 1 - i : i);
    return bytes == 4 ? (int32_t)(uint32_t)bits : (int64_t)bits;
}

tl_status tli_scan_take(tli_scan *scan, const char *what, uint64_t count, uint64_t elem_bytes,
                        const uint8_t **bytes)
{
    uint64_t left = (uint64_t)(scan->end - scan->at);
    if (elem_bytes && count > left / elem_bytes)
        return tli_scan_fail(
            scan, "%" PRIu64 " x %" PRIu64 " bytes of %s, but %" PRIu64 " are left of the file",
            count, elem_bytes, what, left);
    *bytes = (const uint8_t *)scan->at;
    scan->at += count * elem_bytes;
    return TL_OK;
}

tl_status tli_scan_binary_int(tli_scan *scan, const char *what, unsigned bytes, int64_t low,
                              int64_t high, int64_t *value)
{
    const uint8_t *at = NULL;
    tl_status st = tli_scan_take(scan, what, 1, bytes, &at);
    if (st) return st;
    int64_t number = tli_int_at(at, bytes, scan->big_endian);
    if (number < low || number > high) {
        scan->at -= bytes;
        return tli_scan_fail(scan, "%s is %" PRId64 ", expected %" PRId64 " to %" PRId64, what,
                             number, low, high);
    }
    *value = number;
    return TL_OK;
}

tl_status tli_scan_binary_reals(tli_scan *scan, const char *what, tl_scalar scalar, uint64_t count,
                                double *values)
{
    const uint8_t *bytes = NULL;
    tl_status st = tli_scan_take(scan, what, count, tl_scalar_bytes(scalar), &bytes);
    if (!st) tli_widen(bytes, scalar, scan->big_endian, count, values);
    return st;
}

/* ---- other files ---- */

tl_status tli_open_named(tl_ctx *ctx, const char *base, tli_span name, char **path, tli_map *map)
{
    tl_status st = TL_OK;
    struct stat info;
    char *text = tl_mem_alloc(ctx, name.bytes + 1, 1, &st);
    if (st) return st;
    memcpy(text, name.text, name.bytes);
    text[name.bytes] = '\0';
    char *joined = tli_path_beside(ctx, base, text, &st);
    if (!st && stat(joined, &info) == 0 && !S_ISREG(info.st_mode))
        st = tl_fail(ctx, TL_ERR_IO, "'%s': no regular file", joined);
    if (!st) st = tli_map_open(ctx, joined, map);
    tl_mem_free(ctx, text);
    if (st) {
        tl_mem_free(ctx, joined);
        return tl_note(ctx, st, "named by '%s'", base);
    }
    *path = joined;
    return TL_OK;
}

tl_status tli_path_with_ending(tl_ctx *ctx, const char *path, size_t ending_bytes,
                               const char *ending, char **changed)
{
    tl_status st = TL_OK;
    size_t stem = strlen(path) - ending_bytes;
    char *made = tl_mem_alloc(ctx, stem + strlen(ending) + 1, 1, &st);
    if (st) return st;
    memcpy(made, path, stem);
    strcpy(made + stem, ending);
    *changed = made;
    return TL_OK;
}

bool tli_file_exists(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0;
}
