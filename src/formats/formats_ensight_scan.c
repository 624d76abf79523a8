/* EnSight: lines and numbers. Binary files hold lines of 80 bytes, int32 and float32; text files
 * hold numbers in columns (whole ones of 8 or 10, others of 12), often without a blank between
 * them, and the exponents of Fortran, whose e may be missing. */
#include "formats/formats_ensight.h"

#include "formats/formats_number.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define REAL_COLUMNS 12

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\0';
}

tl_status tli_ensight_line(tli_scan *scan, char line[TLI_ENSIGHT_LINE + 1], bool *more)
{
    tli_span span = {0};
    *more = scan->at < scan->end;
    line[0] = '\0';
    if (scan->binary && *more) {
        const uint8_t *bytes = NULL;
        tl_status st = tli_scan_take(scan, "a line", TLI_ENSIGHT_LINE, 1, &bytes);
        if (st) return st;
        const uint8_t *zero = memchr(bytes, 0, TLI_ENSIGHT_LINE);
        span = (tli_span){(const char *)bytes, zero ? (size_t)(zero - bytes) : TLI_ENSIGHT_LINE};
    } else if (*more) {
        tli_scan_line(scan, &span);
    }
    while (span.bytes && is_blank(span.text[0])) span.text++, span.bytes--;
    while (span.bytes && is_blank(span.text[span.bytes - 1])) span.bytes--;
    if (span.bytes > TLI_ENSIGHT_LINE) span.bytes = TLI_ENSIGHT_LINE;
    if (span.bytes) memcpy(line, span.text, span.bytes);
    line[span.bytes] = '\0';
    return TL_OK;
}

/* A number in columns: what follows may be the sign of the next one. */
static tl_status column_int(tli_scan *scan, const char *what, int64_t low, int64_t high,
                            int64_t *value)
{
    (void)tli_scan_at_end(scan);
    const char *end = scan->at;
    if (end < scan->end && (*end == '-' || *end == '+')) end++;
    while (end < scan->end && *end >= '0' && *end <= '9') end++;
    const bool signed_next = end < scan->end && (*end == '-' || *end == '+');
    if (!signed_next) return tli_scan_int(scan, what, low, high, value);
    tli_scan column = *scan;
    column.end = end;
    tl_status st = tli_scan_int(&column, what, low, high, value);
    if (!st) scan->at = end;
    return st;
}

tl_status tli_ensight_int(tli_scan *scan, const char *what, int64_t low, int64_t high,
                          int64_t *value)
{
    return scan->binary ? tli_scan_binary_int(scan, what, 4, low, high, value)
                        : column_int(scan, what, low, high, value);
}

tl_status tli_ensight_count(tli_scan *scan, const char *what, uint64_t min_numbers, uint64_t *count)
{
    int64_t value = 0;
    tl_status st = tli_ensight_int(scan, what, 0, INT32_MAX, &value);
    /* in columns a number takes 8 bytes and more, but some write them apart by single blanks */
    if (!st) st = tli_scan_room(scan, what, (uint64_t)value, min_numbers * (scan->binary ? 4 : 2));
    if (!st) *count = (uint64_t)value;
    return st;
}

tl_status tli_ensight_skip_ints(tli_scan *scan, const char *what, uint64_t count)
{
    const uint8_t *bytes;
    int64_t ignored;
    tl_status st = TL_OK;
    if (scan->binary) return tli_scan_take(scan, what, count, 4, &bytes);
    for (uint64_t i = 0; !st && i < count; i++)
        st = column_int(scan, what, INT64_MIN, INT64_MAX, &ignored);
    return st;
}

/* ---- reals of text ---- */

/* A number that may lack the e of its exponent. */
static bool parse_real(const char *text, size_t bytes, double *value)
{
    char fixed[2 * TLI_ENSIGHT_LINE];
    size_t used = 0;
    if (bytes >= TLI_ENSIGHT_LINE) return false;
    for (size_t i = 0; i < bytes; i++) {
        char before = i ? text[i - 1] : ' ';
        bool sign = text[i] == '+' || text[i] == '-';
        if (sign && ((before >= '0' && before <= '9') || before == '.')) fixed[used++] = 'e';
        fixed[used++] = text[i];
    }
    const char *after = tli_number_f64(fixed, fixed + used, value);
    return after && tli_number_skip_space(after, fixed + used) == fixed + used;
}

/* The numbers of a line up to most of them: words, where all of them are numbers of at most 12
 * characters or so; columns, where they are not. */
static size_t parse_line(tli_span line, uint64_t most, double *values)
{
    const char *at = line.text, *end = at + line.bytes;
    size_t count = 0;
    bool words = true;
    while (words && count < most) {
        at = tli_number_skip_space(at, end);
        if (at == end) return count;
        const char *stop = at;
        while (stop < end && tli_number_skip_space(stop, end) == stop) stop++;
        words = (size_t)(stop - at) < 2 * REAL_COLUMNS - 2 &&
                parse_real(at, (size_t)(stop - at), &values[count]);
        count += words;
        at = stop;
    }
    if (words) return count;
    for (count = 0; count < most && count * REAL_COLUMNS < line.bytes; count++) {
        size_t left = line.bytes - count * REAL_COLUMNS;
        if (!parse_real(line.text + count * REAL_COLUMNS, left < REAL_COLUMNS ? left : REAL_COLUMNS,
                        &values[count]))
            break;
    }
    return count;
}

tl_status tli_ensight_reals(tli_scan *scan, const char *what, uint64_t count, double *values)
{
    if (scan->binary) return tli_scan_binary_reals(scan, what, TL_F32, count, values);
    for (uint64_t done = 0; done < count;) {
        tli_span line;
        const char *start = scan->at;
        if (!tli_scan_line(scan, &line)) return tli_scan_fail(scan, "expected %s, a number", what);
        const char *line_end = line.text + line.bytes;
        if (tli_number_skip_space(line.text, line_end) == line_end) continue;
        size_t got = parse_line(line, count - done, values + done);
        if (got == 0) {
            scan->at = start;
            return tli_scan_fail(scan, "expected %s, a number", what);
        }
        done += got;
    }
    return TL_OK;
}
