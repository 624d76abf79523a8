/* VTK XML files that name others: pieces of a partition (.pvtu, .pvti, .pvtr, .pvts, .vtpd), a
 * series of steps and parts (.pvd), blocks in a tree (.vtm, .vtmb) or in a row, each of several
 * pieces (.vtpc). Pieces are one mesh again: points at the same place become one. Parts and blocks
 * are regions with their names. */
#include "formats/formats_reader.h"

#include "formats/formats_scan.h"
#include "formats/formats_xml.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEPTH_MAX 32 /* of blocks */
#define NAME_BYTES 128
#define PATH_TEXT_BYTES 4096

/* A file that is named. */
typedef struct entry {
    tli_span file;
    double time; /* NaN: none */
    size_t row;  /* of the block; pieces in one row are one block */
    char name[NAME_BYTES];
} entry;

typedef struct list {
    tl_ctx *ctx;
    const tli_source *source;
    entry *entries; /* [count], owned */
    size_t count;
    size_t rows; /* of the next entry */
    bool in_row;
    double *times; /* [time_count] ascending, each once, owned */
    size_t time_count;
} list;

/* ---- the file ---- */

static tl_status add_entry(list *l, const tli_xml_token *token, const char *file,
                           const char *parent)
{
    tli_span value;
    double time;
    tl_status st = TL_OK;
    entry e = {.time = (double)NAN, .row = l->rows};
    if (!tli_xml_attribute(token, file, &e.file) || !e.file.bytes)
        return TL_OK; /* an empty block */
    if (tli_xml_attribute(token, "timestep", &value) && tli_span_f64s(value, &time, 1))
        e.time = time;
    if (tli_xml_attribute(token, "name", &value) || tli_xml_attribute(token, "group", &value))
        tli_span_text(value, e.name, sizeof e.name);
    if (!e.name[0] && parent) memcpy(e.name, parent, sizeof e.name);
    if ((l->count & (l->count - 1)) == 0)
        l->entries =
            tl_mem_resize(l->ctx, l->entries, l->count ? 2 * l->count : 1, sizeof *l->entries, &st);
    if (!st) l->entries[l->count++] = e;
    if (!l->in_row) l->rows++;
    return st;
}

/* Elements with files, wherever they stand; blocks around them give names to those without. */
static tl_status read_entries(list *l)
{
    char names[DEPTH_MAX + 1][NAME_BYTES] = {{0}};
    int depth = 0;
    tli_xml xml;
    tli_xml_token token;
    tl_status st = tli_xml_open(l->ctx, l->source->map.bytes, l->source->map.byte_count, &xml);
    while (!st) {
        st = tli_xml_next(&xml, &token);
        if (st || token.kind == TLI_XML_DONE) break;
        bool begins = token.kind == TLI_XML_START || token.kind == TLI_XML_EMPTY;
        bool row = tli_span_is(token.name, "Partitions");
        bool block = row || tli_span_is(token.name, "Block");
        if (row && token.kind != TLI_XML_EMPTY) {
            l->rows += l->in_row;
            l->in_row = token.kind == TLI_XML_START;
        }
        if (begins && tli_span_is(token.name, "Piece") && depth == 0)
            st = add_entry(l, &token, "Source", NULL);
        else if (begins && tli_span_is(token.name, "DataSet"))
            st = add_entry(l, &token, "file", names[depth]);
        else if (block && token.kind == TLI_XML_START) {
            tli_span name;
            if (depth == DEPTH_MAX)
                return tl_fail(l->ctx, TL_ERR_FORMAT,
                               "byte %" PRIu64 ": blocks in more than %d others", token.ofs,
                               DEPTH_MAX);
            memcpy(names[depth + 1], names[depth], NAME_BYTES);
            depth++;
            if (tli_xml_attribute(&token, "name", &name))
                tli_span_text(name, names[depth], NAME_BYTES);
        } else if (block && token.kind == TLI_XML_END && depth > 0) {
            depth--;
        }
    }
    return st;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Times of the entries that have one. */
static tl_status list_times(list *l)
{
    tl_status st = TL_OK;
    size_t used = 0;
    l->times = tl_mem_alloc(l->ctx, l->count, sizeof *l->times, &st);
    for (size_t i = 0; !st && i < l->count; i++)
        if (isfinite(l->entries[i].time)) l->times[used++] = l->entries[i].time;
    if (st || !used) return st;
    qsort(l->times, used, sizeof *l->times, by_value);
    for (size_t i = 0; i < used; i++)
        if (l->time_count == 0 || l->times[i] != l->times[l->time_count - 1])
            l->times[l->time_count++] = l->times[i];
    return TL_OK;
}

static tl_status open_list(tl_ctx *ctx, const tli_source *source, list *l)
{
    *l = (list){.ctx = ctx, .source = source};
    tl_status st = read_entries(l);
    if (!st) st = list_times(l);
    return st ? tl_note(ctx, st, "in '%s'", source->path) : TL_OK;
}

static void close_list(list *l)
{
    tl_mem_free(l->ctx, l->times);
    tl_mem_free(l->ctx, l->entries);
}

/* ---- its files ---- */

/* Reads a file that is named and joins it. One that can't be read here is passed over where more
 * may follow, so that a surface among blocks does no harm; *refused counts such. */
static tl_status join_entry(const list *l, const entry *e, const tl_read_opts *opts,
                            const tli_join *how, tli_grid *grid, size_t *refused)
{
    char text[PATH_TEXT_BYTES];
    tl_status st = TL_OK;
    tli_grid piece;
    tli_span_text(e->file, text, sizeof text);
    char *path = tli_path_beside(l->ctx, l->source->path, text, &st);
    if (st) return st;
    tli_grid_init(l->ctx, &piece);
    st = tli_grid_read(l->ctx, l->source, path, opts, &piece);
    if (st == TL_ERR_UNSUPPORTED && l->count > 1) {
        const char *why = tl_ctx_message(l->ctx);
        tl_log(l->ctx, TL_LOG_INFO, "left out: %.*s", (int)strcspn(why, "\n"), why);
        ++*refused;
        st = TL_OK;
    } else if (!st) {
        st = tli_grid_join(grid, &piece, how);
    }
    tli_grid_release(&piece);
    tl_mem_free(l->ctx, path);
    return st;
}

static bool is_at(const entry *e, const list *l, size_t step)
{
    return l->time_count == 0 || !isfinite(e->time) || e->time == l->times[step];
}

/* What is read of files that are named: their first step. */
static tl_read_opts opts_of_files(const tl_read_opts *opts)
{
    tl_read_opts inner = *opts;
    inner.step = 0;
    inner.has_time = false;
    return inner;
}

static tl_status join_entries(const list *l, const tl_read_opts *opts, size_t step, bool blocks,
                              tli_grid *grid)
{
    const tl_read_opts inner = opts_of_files(opts);
    size_t refused = 0, parts = 0, at = 0, row = SIZE_MAX;
    tl_status st = TL_OK;
    for (size_t i = 0; i < l->count; i++) parts += is_at(&l->entries[i], l, step);
    for (size_t i = 0; !st && i < l->count; i++) {
        const entry *e = &l->entries[i];
        if (!is_at(e, l, step)) continue;
        at += row != SIZE_MAX && e->row != row;
        row = e->row;
        const tli_join how = {.is_block = true,
                              .region = (int32_t)(at < INT32_MAX ? at : INT32_MAX),
                              .name = e->name};
        st = join_entry(l, e, &inner, blocks && parts > 1 ? &how : NULL, grid, &refused);
    }
    if (!st && refused && refused == parts)
        st = tl_fail(l->ctx, TL_ERR_UNSUPPORTED,
                     "'%s': none of the %zu files it names can be read here", l->source->path,
                     parts);
    if (!st && parts == 0) tl_log(l->ctx, TL_LOG_INFO, "'%s': names no file", l->source->path);
    return st;
}

/* ---- readers ---- */

static tli_match match_type(const tli_source *source, const char *const *types)
{
    char found[40];
    tli_vtk_xml_type(source->head, found);
    for (; *types; types++)
        if (strcmp(found, *types) == 0) return TLI_MATCH_BYTES;
    return TLI_MATCH_NO;
}

tli_match tli_match_vtkpieces(const tli_source *source)
{
    static const char *const types[] = {"PUnstructuredGrid",     "PImageData",
                                        "PRectilinearGrid",      "PStructuredGrid",
                                        "vtkPartitionedDataSet", NULL};
    return match_type(source, types);
}

tli_match tli_match_pvd(const tli_source *source)
{
    static const char *const types[] = {"Collection", NULL};
    return match_type(source, types);
}

tli_match tli_match_vtm(const tli_source *source)
{
    static const char *const types[] = {"vtkMultiBlockDataSet", "vtkPartitionedDataSetCollection",
                                        NULL};
    return match_type(source, types);
}

tl_status tli_read_vtkpieces(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                             tli_grid *grid)
{
    list l;
    uint64_t welded = 0;
    tl_status st = open_list(ctx, source, &l);
    if (!st) st = join_entries(&l, opts, 0, false, grid);
    if (!st && l.count > 1) st = tli_grid_weld(grid, 0, &welded);
    if (!st && l.count > 1)
        tl_log(ctx, TL_LOG_INFO, "'%s': %zu pieces, %" PRIu64 " points of several welded",
               source->path, l.count, welded);
    close_list(&l);
    return st;
}

tl_status tli_read_pvd(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                       tli_grid *grid)
{
    list l;
    size_t step = 0;
    tl_status st = open_list(ctx, source, &l);
    if (!st) st = tli_steps_pick(ctx, opts, l.times, l.time_count ? l.time_count : 1, &step);
    if (!st) st = join_entries(&l, opts, step, true, grid);
    if (!st && l.time_count) grid->time = l.times[step];
    close_list(&l);
    return st;
}

tl_status tli_steps_pvd(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                        tl_steps *steps)
{
    list l;
    (void)opts;
    tl_status st = open_list(ctx, source, &l);
    if (!st) st = tli_steps_alloc(ctx, l.time_count ? l.time_count : 1, steps);
    if (!st && l.time_count) memcpy(steps->times, l.times, l.time_count * sizeof *l.times);
    if (!st && l.time_count > 1) steps->mesh = TL_STEPS_CHANGING; /* not known */
    close_list(&l);
    return st;
}

tl_status tli_read_vtm(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                       tli_grid *grid)
{
    list l;
    tl_status st = open_list(ctx, source, &l);
    if (!st) st = join_entries(&l, opts, 0, true, grid);
    close_list(&l);
    return st;
}
