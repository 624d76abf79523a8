/* Series of files: those beside a file whose names differ from its own in one number alone. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "formats/formats_openfoam.h"
#include "mesh/mesh.h"

/* Digits of a number at most: it fits in 32 bits. */
enum { DIGITS_MAX = 9, PATH_BYTES = 4096 };

/* "flow_0012.vtu": stem "flow_", 4 digits, ending ".vtu". */
typedef struct numbered {
    size_t stem, digits; /* bytes */
    const char *ending;
    uint32_t number;
} numbered;

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* False for a name without a number right before its ending. */
static bool take_apart(const char *name, numbered *n)
{
    const char *dot = strrchr(name, '.');
    *n = (numbered){.ending = dot};
    if (!dot || !dot[1] || is_digit(dot[1])) return false;
    n->stem = (size_t)(dot - name);
    while (n->stem && is_digit(name[n->stem - 1])) n->stem--;
    n->digits = (size_t)(dot - name) - n->stem;
    if (!n->digits || n->digits > DIGITS_MAX) return false;
    n->number = (uint32_t)strtoul(name + n->stem, NULL, 10);
    return true;
}

static bool is_padded(const char *name, const numbered *n)
{
    return n->digits > 1 && name[n->stem] == '0';
}

/* Another number of the same name: without zeros before it, or of the same width. */
static bool is_sibling(const char *own_name, const numbered *own, const char *name, numbered *n)
{
    return take_apart(name, n) && n->stem == own->stem && strcmp(n->ending, own->ending) == 0 &&
           memcmp(name, own_name, n->stem) == 0 &&
           (n->digits == own->digits || !is_padded(name, n));
}

/* The parts of one data set have numbers, too: that which names them lies beside them, or beside
 * their folder. */
static bool is_piece(const char *folder, const char *name, const numbered *n)
{
    static const char *const PARTS[] = {".pvtu", ".pvts", ".pvti", ".pvtr", ".vtm"};
    char path[PATH_BYTES];
    size_t stem = n->stem;
    while (stem && strchr("_-. 0123456789", name[stem - 1])) stem--;
    for (size_t i = 0; i < sizeof PARTS / sizeof *PARTS; i++) {
        int length = snprintf(path, sizeof path, "%s/%.*s%s", folder, (int)stem, name, PARTS[i]);
        if (length > 0 && (size_t)length < sizeof path && tli_file_exists(path)) return true;
        length = snprintf(path, sizeof path, "%s%s", folder, PARTS[i]);
        if (length > 0 && (size_t)length < sizeof path && tli_file_exists(path)) return true;
    }
    return false;
}

static int by_number(const void *a, const void *b)
{
    const tl_step *x = a, *y = b;
    if (x->number != y->number) return x->number < y->number ? -1 : 1;
    return strcmp(x->path, y->path);
}

static tl_status add_file(tl_ctx *ctx, const char *path, size_t folder_bytes, const char *name,
                          uint32_t number, tl_series *series)
{
    tl_status st = TL_OK;
    const size_t bytes = folder_bytes + strlen(name) + 1;
    char *whole = tl_mem_alloc(ctx, bytes, 1, &st);
    if (st) return st;
    memcpy(whole, path, folder_bytes);
    strcpy(whole + folder_bytes, name);
    series->steps[series->count++] = (tl_step){whole, 0, number};
    return TL_OK;
}

/* Of names [count], sorted or not. */
static tl_status take_siblings(tl_ctx *ctx, const char *path, size_t folder_bytes,
                               const numbered *own, char *const *names, size_t count,
                               tl_series *series)
{
    tl_status st = TL_OK;
    numbered n;
    const char *name = path + folder_bytes;
    const bool is_set_off = !own->stem || strchr("_-. ", name[own->stem - 1]);
    bool padded = is_padded(name, own);
    size_t found = 0;
    for (size_t i = 0; i < count; i++)
        if (is_sibling(name, own, names[i], &n)) {
            found++;
            padded |= is_padded(names[i], &n);
        }
    if (found < 2 || !(is_set_off || padded)) return TL_OK;
    series->is_files = true;
    series->steps = tl_mem_alloc(ctx, found, sizeof *series->steps, &st);
    for (size_t i = 0; !st && i < count; i++)
        if (is_sibling(name, own, names[i], &n) &&
            (n.number != own->number || strcmp(names[i], name) == 0))
            st = add_file(ctx, path, folder_bytes, names[i], n.number, series);
    if (st) return st;
    qsort(series->steps, series->count, sizeof *series->steps, by_number);
    size_t kept = 0;
    for (size_t i = 0; i < series->count; i++) { /* "9" and "09" are one step */
        if (kept && series->steps[kept - 1].number == series->steps[i].number)
            tli_free_const(ctx, series->steps[i].path);
        else
            series->steps[kept++] = series->steps[i];
    }
    series->count = kept;
    while (series->steps[series->own].number != own->number) series->own++;
    return TL_OK;
}

/* No steps where there are no others. */
static tl_status find_files(tl_ctx *ctx, const char *path, tl_series *series)
{
    numbered own;
    char folder[PATH_BYTES] = ".";
    char **names = NULL;
    size_t count = 0;
    const char *slash = strrchr(path, '/');
    const size_t folder_bytes = slash ? (size_t)(slash - path) + 1 : 0;
    if (folder_bytes >= sizeof folder || !take_apart(path + folder_bytes, &own)) return TL_OK;
    if (folder_bytes) snprintf(folder, sizeof folder, "%.*s", (int)folder_bytes, path);
    if (folder_bytes > 1) folder[folder_bytes - 1] = '\0';
    if (is_piece(folder, path + folder_bytes, &own)) return TL_OK;
    tl_status st = tli_folder_list(ctx, folder, &names, &count);
    if (st) { /* it need not be read to open a file in it */
        tl_ctx_clear(ctx);
        return st == TL_ERR_IO ? TL_OK : st;
    }
    st = take_siblings(ctx, path, folder_bytes, &own, names, count, series);
    tli_folder_release(ctx, names, count);
    return st;
}

/* The steps of one file. */
static tl_status take_file(tl_ctx *ctx, const char *path, tl_steps *steps, tl_series *series)
{
    tl_status st = TL_OK;
    series->steps = tl_mem_alloc(ctx, steps->count, sizeof *series->steps, &st);
    const char *name = tli_strdup(ctx, path, &st);
    if (st) {
        tli_free_const(ctx, name);
        return st;
    }
    for (size_t i = 0; i < steps->count; i++) series->steps[i] = (tl_step){name, i, (uint32_t)i};
    series->count = steps->count;
    series->times = steps->times;
    series->mesh = steps->mesh;
    steps->times = NULL;
    return TL_OK;
}

static tl_status set_times(tl_ctx *ctx, tl_series *series)
{
    tl_status st = TL_OK;
    series->times = tl_mem_alloc(ctx, series->count, sizeof *series->times, &st);
    for (size_t i = 0; !st && i < series->count; i++) series->times[i] = (double)NAN;
    return st;
}

tl_status tl_series_find(tl_ctx *ctx, const char *path, const tl_read_opts *opts, tl_series *series)
{
    tl_steps steps = {0};
    *series = (tl_series){.mesh = TL_STEPS_CHANGING};
    tl_status st = tl_read_steps(ctx, path, opts, &steps);
    if (!st && steps.count == 1) st = find_files(ctx, path, series);
    if (!st && series->count) st = set_times(ctx, series);
    if (!st && !series->count) st = take_file(ctx, path, &steps, series);
    tl_steps_release(ctx, &steps);
    if (st) tl_series_release(ctx, series);
    return st;
}

void tl_series_release(tl_ctx *ctx, tl_series *series)
{
    const size_t paths = series->is_files ? series->count : series->count > 0;
    for (size_t i = 0; i < paths; i++) tli_free_const(ctx, series->steps[i].path);
    tl_mem_free(ctx, series->steps);
    tl_mem_free(ctx, series->times);
    *series = (tl_series){0};
}
