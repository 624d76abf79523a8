/* Stage formats, internal: a file's text and bytes taken one after the other. Every step checks
 * what is left before it hands anything on, so that no count of a file is believed; failures name
 * the file and the line (text) or byte (binary). */
#ifndef TETRALOD_SRC_FORMATS_SCAN_H
#define TETRALOD_SRC_FORMATS_SCAN_H

#include "formats/formats_grid.h"
#include "formats/formats_xml.h"

typedef struct tli_scan {
    tl_ctx *ctx;
    const char *path; /* borrowed, for messages */
    const char *begin, *at, *end;
    bool binary;     /* failures name the byte, else the line */
    bool big_endian; /* of the binary numbers */
    char comment;    /* begins a comment up to the end of the line; 0: none */
} tli_scan;

/* Borrows bytes [byte_count] and path. */
void tli_scan_open(tl_ctx *ctx, const char *path, const void *bytes, uint64_t byte_count,
                   tli_scan *scan);
/* TL_ERR_FORMAT: "'path': line 12: " or "byte 340: ", the text, and what stands there. */
tl_status tli_scan_fail(const tli_scan *scan, const char *format, ...) TL_PRINTF(2, 3);

/* ---- text ---- */

/* Passes over white space and comments; true when nothing is left. */
bool tli_scan_at_end(tli_scan *scan);
/* The next word between white space; false at the end. */
bool tli_scan_word(tli_scan *scan, tli_span *word);
/* The rest of the line, without its end; false when nothing is left. */
bool tli_scan_line(tli_scan *scan, tli_span *line);
/* The next number of a text; a whole one must lie in [low, high]. what: for the message. */
tl_status tli_scan_int(tli_scan *scan, const char *what, int64_t low, int64_t high, int64_t *value);
tl_status tli_scan_real(tli_scan *scan, const char *what, double *value);
tl_status tli_scan_reals(tli_scan *scan, const char *what, uint64_t count, double *values);
/* A count of items that take min_bytes each at least, the blank between them included: refused
 * where the rest of the file can't hold so many. Also in binary files, of a count that was read. */
tl_status tli_scan_room(const tli_scan *scan, const char *what, uint64_t count, uint64_t min_bytes);

/* ---- bytes ---- */

/* The next count elements; refused where fewer are left. */
tl_status tli_scan_take(tli_scan *scan, const char *what, uint64_t count, uint64_t elem_bytes,
                        const uint8_t **bytes);
/* The next number of a type, widened. TL_I64 and TL_U64 are exact through tli_scan_binary_int. */
tl_status tli_scan_binary_int(tli_scan *scan, const char *what, unsigned bytes, int64_t low,
                              int64_t high, int64_t *value);
tl_status tli_scan_binary_reals(tli_scan *scan, const char *what, tl_scalar scalar, uint64_t count,
                                double *values);
/* A whole number of 4 or 8 bytes at a place. */
int64_t tli_int_at(const uint8_t *at, unsigned bytes, bool big_endian);

/* ---- other files ---- */

/* Opens the file that the file at base names; name need not be terminated. A device or a pipe is
 * refused, so that a file can't make us read without end. Gives *path and *map, on failure neither.
 */
tl_status tli_open_named(tl_ctx *ctx, const char *base, tli_span name, char **path, tli_map *map);
/* path with its last ending_bytes characters replaced. Gives *changed. */
tl_status tli_path_with_ending(tl_ctx *ctx, const char *path, size_t ending_bytes,
                               const char *ending, char **changed);

bool tli_file_exists(const char *path);

/* True where bytes begin a gzip stream. */
bool tli_is_gzip(const uint8_t *bytes, uint64_t byte_count);
/* Unpacks gzip members or a zlib stream. byte_count_max: the most that may come out, of which no
 * more is allocated than the packed bytes can become; exact: all of it must. Gives map (owned).
 * TL_ERR_FORMAT for damaged streams. */
tl_status tli_inflate(tl_ctx *ctx, const char *path, const uint8_t *packed, uint64_t packed_bytes,
                      uint64_t byte_count_max, bool exact, tli_map *map);

#endif
