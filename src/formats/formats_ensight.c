/* EnSight 6 and Gold, named by their case file. Parts are regions with their names. A case of
 * several servers (.sos) names other cases, whose parts are put together. */
#include "formats/formats_ensight.h"

#include "formats/formats_number.h"

#include <math.h>
#include <string.h>

tli_match tli_match_ensight(const tli_source *source)
{
    const char *format = source->folder ? NULL : strstr(source->head, "FORMAT");
    const char *type = format ? strstr(format, "type:") : NULL;
    if (type && (strstr(type, "ensight") || strstr(type, "master_server"))) return TLI_MATCH_BYTES;
    return !source->folder && tli_ends_in(source->path, ".case .encas .sos") ? TLI_MATCH_NAME
                                                                             : TLI_MATCH_NO;
}

/* ---- a case ---- */

static tl_status read_variable(tli_ensight_case *c, const tli_ensight_geo *geo,
                               const tli_ensight_variable *variable, double time)
{
    char *path = NULL;
    tli_map map = {0};
    tli_scan scan;
    tl_status st = tli_ensight_open(c, variable->file, variable->set, time, &path, &map, &scan);
    if (st) return st;
    st = tli_ensight_values_read(geo, &scan, variable);
    tli_map_close(c->ctx, &map);
    tl_mem_free(c->ctx, path);
    return st ? tl_note(c->ctx, st, "while reading variable '%s'", variable->name) : TL_OK;
}

static tl_status read_case(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                           tli_grid *grid)
{
    tli_ensight_case c;
    char *path = NULL;
    tli_map map = {0};
    tli_scan scan;
    size_t step = 0;
    tli_ensight_geo geo = {.ctx = ctx, .grid = grid, .cells.ctx = ctx, .node_ids.ctx = ctx};
    tl_status st = tli_ensight_case_read(ctx, source->path, &source->map, &c);
    geo.gold = c.gold;
    if (!st) st = tli_steps_pick(ctx, opts, c.times, c.time_count ? c.time_count : 1, &step);
    const double time = c.time_count ? c.times[step] : 0;
    if (!st && c.time_count) grid->time = time;
    if (!st) st = tli_ensight_open(&c, c.geometry, c.geometry_set, time, &path, &map, &scan);
    if (!st) st = tli_ensight_geo_read(&geo, &scan);
    if (!st) c.big_endian = scan.big_endian;
    for (uint64_t v = 0; !st && v < c.variable_count; v++)
        st = read_variable(&c, &geo, &c.variables[v], time);
    tli_map_close(ctx, &map);
    tl_mem_free(ctx, path);
    tli_ensight_geo_release(&geo);
    tli_ensight_case_release(&c);
    return st ? tl_note(ctx, st, "while reading the case '%s'", source->path) : TL_OK;
}

static tl_status list_case(tl_ctx *ctx, const tli_source *source, tl_steps *steps)
{
    tli_ensight_case c;
    tl_status st = tli_ensight_case_read(ctx, source->path, &source->map, &c);
    if (!st) st = tli_steps_alloc(ctx, c.time_count ? c.time_count : 1, steps);
    if (!st && c.time_count) memcpy(steps->times, c.times, c.time_count * sizeof *c.times);
    if (!st && c.geometry_set) steps->mesh = c.coords_only ? TL_STEPS_MOVING : TL_STEPS_CHANGING;
    tli_ensight_case_release(&c);
    return st;
}

/* ---- cases of several servers ---- */

static bool is_servers(const tli_source *source)
{
    return strstr(source->head, "master_server") != NULL;
}

/* The value of a "casefile:" line; false when there is none any more. */
static bool next_case(tli_scan *scan, tli_span *name)
{
    tli_span line;
    while (tli_scan_line(scan, &line)) {
        const char *at = tli_number_skip_space(line.text, line.text + line.bytes);
        size_t left = (size_t)(line.text + line.bytes - at);
        if (left < 10 || memcmp(at, "casefile:", 9) != 0) continue;
        const char *end = line.text + line.bytes;
        at = tli_number_skip_space(at + 9, end);
        while (end > at && tli_number_skip_space(end - 1, end) == end) end--;
        *name = (tli_span){at, (size_t)(end - at)};
        if (name->bytes) return true;
    }
    return false;
}

static char *case_path(tl_ctx *ctx, const tli_source *source, tli_span name, tl_status *st)
{
    char *text = tl_mem_alloc(ctx, name.bytes + 1, 1, st);
    if (*st) return NULL;
    memcpy(text, name.text, name.bytes);
    text[name.bytes] = '\0';
    char *path = tli_path_beside(ctx, source->path, text, st);
    tl_mem_free(ctx, text);
    return path;
}

tl_status tli_read_ensight(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                           tli_grid *grid)
{
    tli_scan scan;
    tli_span name;
    tl_status st = TL_OK;
    if (!is_servers(source)) return read_case(ctx, source, opts, grid);
    tli_scan_open(ctx, source->path, source->map.bytes, source->map.byte_count, &scan);
    for (bool first = true; !st && next_case(&scan, &name); first = false) {
        tli_grid piece;
        tli_grid_init(ctx, &piece);
        char *path = case_path(ctx, source, name, &st);
        if (!st) st = tli_grid_read(ctx, source, path, opts, first ? grid : &piece);
        if (!st && !first) st = tli_grid_join(grid, &piece, NULL);
        tl_mem_free(ctx, path);
        tli_grid_release(&piece);
    }
    if (!st && grid->point_count == 0)
        tl_log(ctx, TL_LOG_INFO, "'%s': no casefile with points", source->path);
    return st;
}

/* Of several servers those of the first. */
tl_status tli_steps_ensight(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                            tl_steps *steps)
{
    tli_scan scan;
    tli_span name;
    tl_status st = TL_OK;
    if (!is_servers(source)) return list_case(ctx, source, steps);
    tli_scan_open(ctx, source->path, source->map.bytes, source->map.byte_count, &scan);
    if (!next_case(&scan, &name)) return tli_steps_alloc(ctx, 1, steps);
    char *path = case_path(ctx, source, name, &st);
    if (!st) st = tli_grid_read_steps(ctx, source, path, opts, steps);
    tl_mem_free(ctx, path);
    return st;
}
