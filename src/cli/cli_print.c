/* Numbers and tables for people who are tired: separators in counts, units, aligned columns. */
#include "cli_print.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

cli_text cli_real(double value)
{
    cli_text text = {"-"};
    if (isfinite(value)) snprintf(text.s, sizeof text.s, "%.4g", value);
    return text;
}

cli_text cli_share(double part, double whole)
{
    cli_text text = {"-"};
    if (isfinite(part) && whole > 0) snprintf(text.s, sizeof text.s, "%.3g %%", 100 * part / whole);
    return text;
}

cli_text cli_bytes(double bytes)
{
    static const char *const UNITS[] = {"B", "KiB", "MiB", "GiB", "TiB"};
    size_t unit = 0;
    cli_text text;
    for (; bytes >= 1024 && unit < 4; unit++) bytes /= 1024;
    snprintf(text.s, sizeof text.s, unit && bytes < 100 ? "%.1f %s" : "%.0f %s", bytes,
             UNITS[unit]);
    return text;
}

cli_text cli_seconds(double seconds)
{
    cli_text text;
    if (seconds < 120)
        snprintf(text.s, sizeof text.s, seconds < 10 ? "%.2f s" : "%.1f s", seconds);
    else if (seconds < 7200)
        snprintf(text.s, sizeof text.s, "%d min %02d s", (int)(seconds / 60), (int)seconds % 60);
    else
        snprintf(text.s, sizeof text.s, "%d h %02d min", (int)(seconds / 3600),
                 (int)(seconds / 60) % 60);
    return text;
}

cli_text cli_rate(double per_second)
{
    static const char *const UNITS[] = {"", " k", " M", " G"};
    size_t unit = 0;
    cli_text text = {"-"};
    if (!isfinite(per_second)) return text;
    for (; per_second >= 1000 && unit < 3; unit++) per_second /= 1000;
    snprintf(text.s, sizeof text.s, "%.3g%s/s", per_second, UNITS[unit]);
    return text;
}

cli_text cli_range(const double range[2])
{
    cli_text text;
    snprintf(text.s, sizeof text.s, "%.4g .. %.4g", range[0], range[1]);
    return text;
}

/* ---- tables ---- */

tl_status cli_table_create(tl_ctx *ctx, size_t rows, size_t columns, cli_table *table)
{
    tl_status st = TL_OK;
    *table = (cli_table){.ctx = ctx, .rows = rows, .columns = columns};
    table->cells = tl_mem_zalloc(ctx, rows, columns * sizeof(cli_text), &st);
    return st;
}

void cli_table_destroy(cli_table *table)
{
    tl_mem_free(table->ctx, table->cells);
    table->cells = NULL;
}

static char *cell(const cli_table *table, size_t row, size_t column)
{
    return table->cells + (row * table->columns + column) * sizeof(cli_text);
}

void cli_table_set(cli_table *table, size_t row, size_t column, cli_text text)
{
    memcpy(cell(table, row, column), text.s, sizeof text.s);
}

void cli_table_head(cli_table *table, const char *words)
{
    for (size_t column = 0; column < table->columns; column++) {
        size_t length = strcspn(words, "|");
        snprintf(cell(table, 0, column), sizeof(cli_text), "%.*s", (int)length, words);
        words += words[length] ? length + 1 : length;
    }
}

/* Characters, not bytes, of a UTF-8 text. */
static int width(const char *text)
{
    int n = 0;
    for (; *text; text++) n += ((unsigned char)*text & 0xc0) != 0x80;
    return n;
}

void cli_table_print(const cli_table *table, int indent)
{
    for (size_t row = 0; row < table->rows; row++) {
        printf("%*s", indent, "");
        for (size_t column = 0; column < table->columns; column++) {
            int widest = 0;
            for (size_t i = 0; i < table->rows; i++) {
                int w = width(cell(table, i, column));
                if (w > widest) widest = w;
            }
            const char *text = cell(table, row, column);
            int pad = widest - width(text);
            if (column == 0)
                printf("%s%*s", text, table->columns > 1 ? pad : 0, "");
            else if (!*text && column + 1 == table->columns)
                break;
            else
                printf("  %*s%s", pad, "", text);
        }
        putchar('\n');
    }
}
