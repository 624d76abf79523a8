/* Numbers and tables for people, objects for machines. */
#ifndef TETRALOD_CLI_PRINT_H
#define TETRALOD_CLI_PRINT_H

#include <jansson.h>
#include <stddef.h>
#include <stdint.h>

#include "tetralod/tetralod.h"

typedef tl_text cli_text;

static inline cli_text cli_count(uint64_t count) /* 1,250,235 */
{
    return tl_text_count(count);
}
static inline cli_text cli_name(const char *name) /* without control characters, shortened */
{
    return tl_text_name(name);
}
cli_text cli_real(double value);               /* four digits; "-" if not finite */
cli_text cli_share(double part, double whole); /* 0.45 %; "-" of nothing */
cli_text cli_bytes(double bytes);              /* 34.2 MiB */
cli_text cli_seconds(double seconds);          /* 0.123 s, 2 min 03 s */
cli_text cli_rate(double per_second);          /* 1.30 M/s */
cli_text cli_range(const double range[2]);     /* 0.19 .. 4.98 */

/* A table of right-aligned columns, the first one left-aligned. */
typedef struct cli_table {
    tl_ctx *ctx;
    char *cells; /* [rows][columns] cli_text */
    size_t rows, columns;
} cli_table;
/* The first row is the head. */
tl_status cli_table_create(tl_ctx *ctx, size_t rows, size_t columns, cli_table *table);
void cli_table_destroy(cli_table *table);
void cli_table_set(cli_table *table, size_t row, size_t column, cli_text text);
/* Sets the head from words separated by '|'. */
void cli_table_head(cli_table *table, const char *words);
void cli_table_print(const cli_table *table, int indent);

/* JSON. Numbers that are not finite become null, text that is not UTF-8 is read as Latin-1. */
void cli_json_real(json_t *object, const char *key, double value);
void cli_json_count(json_t *object, const char *key, uint64_t value);
void cli_json_text(json_t *object, const char *key, const char *text);
void cli_json_flag(json_t *object, const char *key, bool value);
/* A list of count numbers. */
void cli_json_reals(json_t *object, const char *key, const double *values, size_t count);
void cli_json_counts(json_t *object, const char *key, const size_t *values, size_t count);
/* Adds an empty list or object under key and returns it (borrowed from object). */
json_t *cli_json_list(json_t *object, const char *key);
json_t *cli_json_object(json_t *object, const char *key);
/* Adds an empty object to a list and returns it. */
json_t *cli_json_item(json_t *list);
/* Prints and releases it. */
void cli_json_print(json_t *object);

#endif
