/* Windows of tets out of data sets of any size. A window is a run of cells, made to a small grid of
 * its own: its points are numbered in ascending order of the data set's, so that what depends on
 * the order of indices (the cut of cells) comes out as in the whole. formats_tets.c then splits it
 * as it splits a whole grid. */
#include "formats/formats_feeder.h"

#include "base/base_sort.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

/* A window has that part of the memory's bytes as its number of cells: 256 Ki of 256 MiB. */
#define MEMORY_A_CELL 1024u
#define WINDOW_CELLS_MIN 4096u
/* Part of the memory that the points of a window may take as long as they are a range. */
#define RANGE_PART 4u
/* Points read at once where only some of a range are needed. */
#define GATHER_POINTS 65536u

struct tli_feed {
    tl_ctx *ctx;
    tli_feeder *reader;
    tl_read_opts opts;
    tli_map map;
    bool has_map;
    uint64_t memory_bytes, tet_estimate;
    int region_index; /* among the cell arrays, ghosts left out; -1: none */
    bool has_regions;
    bool marks_points; /* hidden, blank or fill values: points can be missing */
    tl_channel *channels;
    size_t channel_count;
    uint32_t components[2];

    uint64_t next_cell, next_tet;
    tli_grid grid; /* of the window */
    tli_tets tets;
    bool is_open; /* tets is */
    tl_lidx *ids;
    double *values;

    double *range_xyz; /* points [range_first, range_first + range_count), kept between windows */
    uint64_t range_first, range_count, range_room;

    /* the report */
    bool has_counted; /* all windows were read once */
    bool has_report;  /* it is there already: the file was read as a whole */
    tl_read_report report;
    tli_tally sum;
    uint64_t vert_count, tet_count;
    uint8_t *used; /* a bit for each point */
};

/* ---- arrays ---- */

tl_status tli_feeder_add(tli_feeder *reader, tl_on on, const char *name, uint32_t components,
                         tl_scalar scalar)
{
    tl_status st = TL_OK;
    uint32_t count = reader->array_counts[on];
    char *own = tli_strdup(reader->ctx, name, &st);
    reader->arrays[on] = tl_mem_resize(reader->ctx, reader->arrays[on], (size_t)count + 1,
                                       sizeof *reader->arrays[on], &st);
    if (st) {
        tl_mem_free(reader->ctx, own);
        return st;
    }
    reader->arrays[on][count] = (tli_feeder_array){own, components, scalar};
    reader->array_counts[on]++;
    return TL_OK;
}

void tli_feeder_drop_arrays(tli_feeder *reader)
{
    for (int on = 0; on < 2; on++) {
        for (uint32_t i = 0; i < reader->array_counts[on]; i++)
            tl_mem_free(reader->ctx, reader->arrays[on][i].name);
        tl_mem_free(reader->ctx, reader->arrays[on]);
    }
}

/* ---- opening ---- */

/* Holds whole ids, over the whole array: what tli_tets_find_region asks of a grid. */
static tl_status holds_ids(tli_feed *feed, uint32_t array, bool *holds)
{
    tli_feeder *reader = feed->reader;
    tl_status st = TL_OK;
    size_t step = GATHER_POINTS;
    *holds = reader->arrays[TL_ON_TET][array].components == 1;
    double *values = tl_mem_alloc(feed->ctx, step, sizeof *values, &st);
    for (uint64_t first = 0; !st && *holds && first < reader->cell_count; first += step) {
        uint64_t left = reader->cell_count - first, count = left < step ? left : step;
        st = reader->values(reader, TL_ON_TET, array, first, count, values);
        for (uint64_t i = 0; !st && i < count && *holds; i++)
            *holds = tl_scalar_holds(TL_I32, values[i] + 0.0);
    }
    tl_mem_free(feed->ctx, values);
    return st;
}

/* Decides once for all windows which array holds the regions. */
static tl_status find_regions(tli_feed *feed)
{
    const tli_feeder *reader = feed->reader;
    feed->region_index = -1;
    feed->has_regions = reader->is_final && reader->regions;
    if (reader->is_final) return TL_OK;
    for (uint32_t i = 0; i < reader->array_counts[TL_ON_TET]; i++) {
        const tli_feeder_array *array = &reader->arrays[TL_ON_TET][i];
        bool taken = feed->opts.region ? strcmp(array->name, feed->opts.region) == 0
                                       : tli_is_region_name(array->name);
        if (taken && !feed->opts.region) {
            tl_status st = holds_ids(feed, i, &taken);
            if (st) return st;
        }
        if (!taken) continue;
        if (array->components != 1)
            return tl_fail(feed->ctx, TL_ERR_DATA,
                           "the cell array '%s' has %u components, a region has 1", array->name,
                           array->components);
        feed->region_index = (int)i;
        feed->has_regions = true;
        return TL_OK;
    }
    if (feed->opts.region)
        return tl_fail(feed->ctx, TL_ERR_DATA, "no cell array is called '%s' (%u cell arrays)",
                       feed->opts.region, reader->array_counts[TL_ON_TET]);
    return TL_OK;
}

/* What tli_tets_mark_missing takes away. */
static bool is_ghost_array(const tli_feeder_array *array, tl_on on)
{
    if (array->components != 1) return false;
    return strcmp(array->name, "vtkGhostType") == 0 ||
           (on == TL_ON_TET && strcmp(array->name, "vtkGhostLevels") == 0);
}

/* The first of its name; a second one stays a channel. */
static int find_ghosts(const tli_feeder *reader, tl_on on, const char *name)
{
    for (uint32_t i = 0; i < reader->array_counts[on]; i++) {
        const tli_feeder_array *array = &reader->arrays[on][i];
        if (is_ghost_array(array, on) && strcmp(array->name, name) == 0) return (int)i;
    }
    return -1;
}

static bool is_channel(const tli_feed *feed, tl_on on, uint32_t index)
{
    const tli_feeder *reader = feed->reader;
    if (reader->is_final) return true;
    const tli_feeder_array *array = &reader->arrays[on][index];
    return !is_ghost_array(array, on) || find_ghosts(reader, on, array->name) != (int)index;
}

/* Names that are taken get a suffix, as tl_mesh_adopt_channel gives it. */
static tl_status add_channels(tli_feed *feed)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = feed->ctx;
    tl_mesh *names = NULL; /* a mesh without elements knows the rule */
    double *xyz = tl_mem_alloc(ctx, 0, sizeof *xyz, &st);
    tl_lidx *tets = tl_mem_alloc(ctx, 0, sizeof *tets, &st);
    if (!st) st = tl_mesh_adopt(ctx, xyz, 0, tets, 0, &names);
    if (st) {
        tl_mem_free(ctx, tets);
        tl_mem_free(ctx, xyz);
        return st;
    }
    const double none[1] = {0};
    const tli_feeder *reader = feed->reader;
    size_t most = (size_t)reader->array_counts[0] + reader->array_counts[1];
    feed->channels = tl_mem_zalloc(ctx, most, sizeof *feed->channels, &st);
    for (int on = 0; on < 2; on++)
        for (uint32_t i = 0; !st && i < reader->array_counts[on]; i++) {
            const tli_feeder_array *array = &reader->arrays[on][i];
            if (!is_channel(feed, (tl_on)on, i)) continue;
            tl_channel channel = {array->name,   "",  array->components, (tl_on)on,
                                  array->scalar, none};
            st = tl_mesh_add_channel(names, &channel);
            if (st) break;
            const tl_channel *named = tl_mesh_channel(names, tl_mesh_channel_count(names) - 1);
            channel.name = tli_strdup(ctx, named->name, &st);
            channel.values = NULL;
            if (st) break;
            feed->channels[feed->channel_count++] = channel;
            feed->components[on] += array->components;
        }
    tl_mesh_destroy(names);
    return st;
}

/* What is the same for all readers. Takes over reader. */
static tl_status prepare_feed(tli_feed *feed, tli_feeder *reader)
{
    tl_status st = TL_OK;
    feed->reader = reader;
    feed->tet_estimate = reader->cell_count;
    feed->marks_points = reader->has_blanks ||
                         find_ghosts(reader, TL_ON_VERTEX, "vtkGhostType") >= 0 ||
                         feed->opts.has_fill_value;
    if (reader->is_final) feed->marks_points = false;
    if (reader->point_count > TL_MESH_VERTS_MAX)
        return tl_fail(feed->ctx, TL_ERR_UNSUPPORTED, "%llu points, at most %u can be numbered",
                       (unsigned long long)reader->point_count, TL_MESH_VERTS_MAX);
    feed->report.points = feed->has_report ? feed->report.points : reader->point_count;
    if (!feed->has_report && !reader->is_final)
        feed->used = tl_mem_zalloc(feed->ctx, (size_t)(reader->point_count / 8 + 1), 1, &st);
    if (!st) st = find_regions(feed);
    if (!st) st = add_channels(feed);
    if (!st && reader->estimate) st = reader->estimate(reader, &feed->tet_estimate);
    return st;
}

static tl_status feed_create(tl_ctx *ctx, const tl_read_opts *opts, uint64_t memory_bytes,
                             tli_feed **feed)
{
    tl_status st = TL_OK;
    tli_feed *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    s->ctx = ctx;
    s->memory_bytes = memory_bytes;
    s->opts = tl_read_opts_defaults();
    tli_grid_init(ctx, &s->grid);
    st = tli_opts_take(ctx, "tl_read_opts", opts, &s->opts, sizeof s->opts);
    if (st)
        tl_mem_free(ctx, s);
    else
        *feed = s;
    return st;
}

tl_status tli_feed_of(tl_ctx *ctx, tli_feeder *feeder, uint64_t memory_bytes, tli_feed **feed)
{
    *feed = NULL;
    tl_status st = feed_create(ctx, NULL, memory_bytes, feed);
    if (st) {
        feeder->close(feeder);
        return st;
    }
    st = prepare_feed(*feed, feeder);
    if (!st) return TL_OK;
    tli_feed_close(*feed);
    *feed = NULL;
    return st;
}

tl_status tli_feed_of_mesh(tl_ctx *ctx, const tl_mesh *mesh, uint64_t memory_bytes, tli_feed **feed)
{
    tli_feeder *feeder = NULL;
    *feed = NULL;
    tl_status st = tli_feeder_open_mesh(ctx, mesh, false, &feeder);
    return st ? st : tli_feed_of(ctx, feeder, memory_bytes, feed);
}

/* Readers that work in windows, the first that takes the file. */
static tl_status open_windowed(tli_feed *feed, const char *path, tli_feeder **reader)
{
    const tl_read_opts *opts = &feed->opts;
    bool whole = opts->cell_to_point || opts->raw_dims[0] || opts->raw_dims[1] ||
                 opts->raw_dims[2] || opts->weld || opts->step || opts->has_time;
    *reader = NULL;
    if (whole) return TL_OK;
    tl_status st = tli_map_open(feed->ctx, path, &feed->map);
    if (st) return st;
    feed->has_map = true;
    if (!feed->map.owned) st = tli_feeder_open_vtu(feed->ctx, &feed->map, path, reader);
    return st;
}

static tl_status open_whole(tli_feed *feed, const char *path, tli_feeder **reader)
{
    tl_mesh *mesh = NULL;
    if (feed->has_map) tli_map_close(feed->ctx, &feed->map);
    feed->has_map = false;
    tl_status st = tl_mesh_read(feed->ctx, path, &feed->opts, &mesh, &feed->report);
    feed->has_report = true;
    if (!st) st = tli_feeder_open_mesh(feed->ctx, mesh, true, reader);
    if (st) tl_mesh_destroy(mesh);
    return st;
}

tl_status tli_feed_open(tl_ctx *ctx, const char *path, const tl_read_opts *opts,
                        uint64_t memory_bytes, tli_feed **feed)
{
    tli_feeder *reader = NULL;
    *feed = NULL;
    tl_status st = feed_create(ctx, opts, memory_bytes, feed);
    if (st) return st;
    if ((*feed)->opts.split != 5 && (*feed)->opts.split != 6)
        st = tl_fail(ctx, TL_ERR_ARG, "a structured cell is split into 5 or 6 tets, not %d",
                     (*feed)->opts.split);
    if (!st) st = open_windowed(*feed, path, &reader);
    if (!st && !reader) st = open_whole(*feed, path, &reader);
    if (!st) st = prepare_feed(*feed, reader);
    if (!st) return TL_OK;
    tli_feed_close(*feed);
    *feed = NULL;
    return st;
}

static void close_window(tli_feed *feed)
{
    tl_ctx *ctx = feed->ctx;
    if (feed->grid.xyz == feed->range_xyz) feed->grid.xyz = NULL;
    if (feed->is_open) tli_tets_release(&feed->tets);
    feed->is_open = false;
    tli_grid_release(&feed->grid);
    tl_mem_free(ctx, feed->ids);
    tl_mem_free(ctx, feed->values);
    feed->ids = NULL;
    feed->values = NULL;
}

void tli_feed_close(tli_feed *feed)
{
    if (!feed) return;
    tl_ctx *ctx = feed->ctx;
    close_window(feed);
    for (size_t i = 0; i < feed->channel_count; i++)
        tl_mem_free(ctx, (char *)(uintptr_t)feed->channels[i].name);
    tl_mem_free(ctx, feed->channels);
    tl_mem_free(ctx, feed->used);
    tl_mem_free(ctx, feed->range_xyz);
    if (feed->reader) feed->reader->close(feed->reader);
    if (feed->has_map) tli_map_close(ctx, &feed->map);
    tl_mem_free(ctx, feed);
}

uint64_t tli_feed_point_count(const tli_feed *feed)
{
    return feed->reader->point_count;
}

uint64_t tli_feed_tet_estimate(const tli_feed *feed)
{
    return feed->tet_estimate;
}

double tli_feed_time(const tli_feed *feed)
{
    return feed->reader->time;
}

bool tli_feed_has_regions(const tli_feed *feed)
{
    return feed->has_regions;
}

const tl_channel *tli_feed_channels(const tli_feed *feed, size_t *count)
{
    *count = feed->channel_count;
    return feed->channels;
}

/* ---- values ---- */

/* One array of a window into its grid. */
static tl_status read_array(tli_feed *feed, tl_on on, uint32_t index, uint64_t first,
                            uint64_t count)
{
    tli_feeder *reader = feed->reader;
    const tli_feeder_array *array = &reader->arrays[on][index];
    tli_grid_array *added;
    tl_status st =
        tli_grid_add(&feed->grid, on, array->name, array->components, array->scalar, NULL, &added);
    return st ? st : reader->values(reader, on, index, first, count, added->values);
}

/* Values of all arrays [count][components], tuple by tuple. */
static void interleave(const tli_grid_array *arrays, uint32_t array_count, size_t count,
                       size_t tuple, double *values)
{
    size_t place = 0;
    for (uint32_t a = 0; a < array_count; a++) {
        const uint32_t components = arrays[a].components;
        const double *from = arrays[a].values;
        double *to = values + place;
        for (size_t i = 0; i < count; i++, from += components, to += tuple)
            for (uint32_t c = 0; c < components; c++) to[c] = from[c];
        place += components;
    }
}

/* Marks points and makes fill values NaN, by the rules for a whole grid. */
static tl_status read_marked(tli_feed *feed, uint64_t first, size_t count, double *values,
                             uint8_t *missing)
{
    tli_feeder *reader = feed->reader;
    tl_status st = TL_OK;
    feed->grid.point_count = count;
    for (uint32_t a = 0; !st && a < reader->array_counts[TL_ON_VERTEX]; a++)
        st = read_array(feed, TL_ON_VERTEX, a, first, count);
    if (!st && reader->has_blanks) {
        feed->grid.blanks = tl_mem_alloc(feed->ctx, count, 1, &st);
        if (!st) st = reader->blanks(reader, first, count, feed->grid.blanks);
    }
    if (st) return st;
    st = tli_tets_open(&feed->tets, &feed->grid, &feed->opts);
    feed->is_open = true;
    if (!st) st = tli_tets_prepare(&feed->tets);
    if (!st) st = tli_tets_mark_missing(&feed->tets);
    if (st) return st;
    if (values)
        interleave(feed->grid.point_arrays, feed->grid.point_array_count, count,
                   feed->components[TL_ON_VERTEX], values);
    for (size_t i = 0; missing && i < count; i++)
        missing[i] = (feed->tets.point_marks[i] & (TLI_POINT_HIDDEN | TLI_POINT_MISSING)) != 0;
    return TL_OK;
}

static tl_status read_values(tli_feed *feed, uint64_t first, size_t count, double *values)
{
    tli_feeder *reader = feed->reader;
    tl_status st = TL_OK;
    if (reader->array_counts[TL_ON_VERTEX] == 1)
        return reader->values(reader, TL_ON_VERTEX, 0, first, count, values);
    feed->grid.point_count = count;
    for (uint32_t a = 0; !st && a < reader->array_counts[TL_ON_VERTEX]; a++)
        st = read_array(feed, TL_ON_VERTEX, a, first, count);
    if (!st)
        interleave(feed->grid.point_arrays, feed->grid.point_array_count, count,
                   feed->components[TL_ON_VERTEX], values);
    return st;
}

tl_status tli_feed_points(tli_feed *feed, uint64_t first, size_t count, double *xyz, double *values,
                          uint8_t *missing)
{
    tl_status st = TL_OK;
    close_window(feed);
    if (xyz) st = feed->reader->points(feed->reader, first, count, xyz);
    if (missing) memset(missing, 0, count);
    if (!st && feed->marks_points)
        st = read_marked(feed, first, count, values, missing);
    else if (!st && values && feed->components[TL_ON_VERTEX])
        st = read_values(feed, first, count, values);
    close_window(feed);
    return st;
}

/* ---- points of a window ---- */

typedef struct range_job {
    tl_lidx *ids;
    tl_lidx first;
} range_job;

static tl_status rebase_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const range_job *job = arg;
    (void)worker;
    for (size_t i = begin; i < end; i++) job->ids[i] -= job->first;
    return TL_OK;
}

static void id_range(const tl_lidx *ids, size_t count, tl_lidx *low, tl_lidx *high)
{
    *low = TL_NONE;
    *high = 0;
    for (size_t i = 0; i < count; i++) {
        *low = ids[i] < *low ? ids[i] : *low;
        *high = ids[i] > *high ? ids[i] : *high;
    }
}

/* xyz of a range of points, kept for the next window. */
static tl_status load_range(tli_feed *feed, uint64_t first, uint64_t count)
{
    tl_status st = TL_OK;
    if (first < feed->range_first || first + count > feed->range_first + feed->range_count) {
        if (count > feed->range_room) {
            tl_mem_free(feed->ctx, feed->range_xyz);
            feed->range_xyz = NULL;
            feed->range_count = feed->range_room = 0;
            feed->range_xyz = tl_mem_alloc(feed->ctx, (size_t)count, 3 * sizeof(double), &st);
            if (st) return st;
            feed->range_room = count;
        }
        feed->range_first = first;
        feed->range_count = 0;
        st = feed->reader->points(feed->reader, first, count, feed->range_xyz);
        if (!st) feed->range_count = count;
    }
    return st;
}

/* The points of a window are a range: ids become indices into it. */
static tl_status take_range(tli_feed *feed, tl_lidx low, tl_lidx high, size_t index_count)
{
    tli_grid *grid = &feed->grid;
    tl_status st = load_range(feed, low, (uint64_t)high - low + 1);
    if (st) return st;
    grid->xyz = feed->range_xyz;
    grid->point_count = feed->range_count;
    range_job job = {grid->connectivity, (tl_lidx)feed->range_first};
    return tli_parallel(feed->ctx, index_count, TLI_TETS_GRAIN, rebase_piece, &job);
}

/* Every id once, ascending, in feed->ids; the window's indices become places among them. */
static tl_status number_ids(tli_feed *feed, size_t index_count)
{
    tl_ctx *ctx = feed->ctx;
    tl_status st = TL_OK;
    tl_lidx *connectivity = feed->grid.connectivity;
    tl_lidx *keys = tl_mem_alloc(ctx, index_count, sizeof *keys, &st);
    uint32_t *places = tl_mem_alloc(ctx, index_count, sizeof *places, &st);
    if (!st) {
        memcpy(keys, connectivity, index_count * sizeof *keys);
        for (size_t i = 0; i < index_count; i++) places[i] = (uint32_t)i;
        st = tli_sort_u32(ctx, keys, places, index_count);
    }
    if (!st) {
        size_t count = 0;
        for (size_t i = 0; i < index_count; i++) {
            if (!i || keys[i] != keys[count - 1]) keys[count++] = keys[i];
            connectivity[places[i]] = (tl_lidx)(count - 1);
        }
        keys = tl_mem_resize(ctx, keys, count, sizeof *keys, &st);
        feed->grid.point_count = count;
        feed->ids = keys;
        keys = NULL;
    }
    tl_mem_free(ctx, places);
    tl_mem_free(ctx, keys);
    return st;
}

/* Tuples of the points of feed->ids: array TL_NONE for xyz. */
static tl_status gather(tli_feed *feed, uint32_t array, uint32_t components, double *values)
{
    tli_feeder *reader = feed->reader;
    tl_status st = TL_OK;
    size_t count = (size_t)feed->grid.point_count, tuple = components * sizeof *values;
    double *part = tl_mem_alloc(feed->ctx, GATHER_POINTS, tuple, &st);
    for (size_t i = 0; !st && i < count;) {
        uint64_t first = feed->ids[i], room = reader->point_count - first;
        if (room > GATHER_POINTS) room = GATHER_POINTS;
        size_t last = i;
        while (last < count && feed->ids[last] < first + room) last++;
        uint64_t needed = feed->ids[last - 1] - first + 1;
        st = array == TL_NONE ? reader->points(reader, first, needed, part)
                              : reader->values(reader, TL_ON_VERTEX, array, first, needed, part);
        for (; !st && i < last; i++)
            memcpy(values + i * components, part + (feed->ids[i] - first) * components, tuple);
    }
    tl_mem_free(feed->ctx, part);
    return st;
}

/* What marks points as missing, for the points of a window. */
static tl_status read_point_arrays(tli_feed *feed)
{
    tli_feeder *reader = feed->reader;
    tli_grid *grid = &feed->grid;
    size_t count = (size_t)grid->point_count;
    tl_status st = TL_OK;
    for (uint32_t a = 0; !st && a < reader->array_counts[TL_ON_VERTEX]; a++) {
        const tli_feeder_array *array = &reader->arrays[TL_ON_VERTEX][a];
        if (!feed->ids) {
            st = read_array(feed, TL_ON_VERTEX, a, feed->range_first, count);
            continue;
        }
        tli_grid_array *added;
        st = tli_grid_add(grid, TL_ON_VERTEX, array->name, array->components, array->scalar, NULL,
                          &added);
        if (!st) st = gather(feed, a, array->components, added->values);
    }
    if (st || !reader->has_blanks) return st;
    grid->blanks = tl_mem_alloc(feed->ctx, count, 1, &st);
    TL_ASSERT(!feed->ids); /* points of structured blocks are ranges */
    return st ? st : reader->blanks(reader, feed->range_first, count, grid->blanks);
}

static tl_status localise(tli_feed *feed)
{
    tli_grid *grid = &feed->grid;
    tl_status st = TL_OK;
    size_t index_count =
        grid->offsets ? (size_t)grid->offsets[grid->cell_count] : 4 * (size_t)grid->cell_count;
    uint64_t room = feed->memory_bytes / RANGE_PART / (3 * sizeof(double));
    tl_lidx low = 0, high = 0;
    if (index_count) id_range(grid->connectivity, index_count, &low, &high);
    bool is_kept = low >= feed->range_first && high < feed->range_first + feed->range_count;
    if (!index_count) {
        grid->point_count = 0;
    } else if (is_kept || (uint64_t)high - low < room) {
        st = take_range(feed, low, high, index_count);
    } else {
        st = number_ids(feed, index_count);
        if (!st)
            grid->xyz = tl_mem_alloc(feed->ctx, (size_t)grid->point_count, 3 * sizeof(double), &st);
        if (!st) st = gather(feed, TL_NONE, 3, grid->xyz);
    }
    if (!st && feed->marks_points && grid->point_count) st = read_point_arrays(feed);
    return st;
}

/* ---- windows ---- */

static tl_status read_cells(tli_feed *feed, uint64_t first, uint64_t count)
{
    tli_feeder *reader = feed->reader;
    tli_grid *grid = &feed->grid;
    grid->cell_count = count;
    tl_status st = reader->cells(reader, first, count, grid);
    if (!st) st = localise(feed);
    for (uint32_t a = 0; !st && a < reader->array_counts[TL_ON_TET]; a++)
        st = read_array(feed, TL_ON_TET, a, first, count);
    return st;
}

/* The tets of a mesh: no cell is split, turned or left out. */
static tl_status take_final(tli_feed *feed, uint64_t first)
{
    tli_tets *t = &feed->tets;
    tl_status st = TL_OK;
    t->tets = feed->grid.connectivity;
    feed->grid.connectivity = NULL;
    t->tet_count = (size_t)feed->grid.cell_count;
    t->one_to_one = true;
    if (feed->reader->regions) {
        t->regions = tl_mem_alloc(feed->ctx, t->tet_count, sizeof *t->regions, &st);
        if (!st) st = feed->reader->regions(feed->reader, first, t->tet_count, t->regions);
    }
    return st;
}

/* After mark_missing dropped ghosts, the array of the regions may stand elsewhere. */
static int region_in_window(const tli_feed *feed)
{
    if (feed->region_index < 0) return -1;
    const char *name = feed->reader->arrays[TL_ON_TET][feed->region_index].name;
    for (uint32_t i = 0; i < feed->grid.cell_array_count; i++)
        if (strcmp(feed->grid.cell_arrays[i].name, name) == 0) return (int)i;
    return -1;
}

static tl_status split_window(tli_feed *feed)
{
    tli_tets *t = &feed->tets;
    tl_status st = tli_tets_split(t);
    if (!st && t->cell_counts)
        st = tl_fail(feed->ctx, TL_ERR_UNSUPPORTED,
                     "polyhedra and prisms can't be read in windows: convert the file first");
    int region = region_in_window(feed);
    if (!st && region >= 0) st = tli_tets_make_regions(t, region);
    if (st || feed->has_counted) return st;
    memset(&t->sum, 0, sizeof t->sum);
    tli_tets_sum(t);
    uint64_t *sum = (uint64_t *)&feed->sum;
    const uint64_t *one = (const uint64_t *)&t->sum;
    for (size_t i = 0; i < sizeof t->sum / sizeof *sum; i++) sum[i] += one[i];
    for (size_t i = 0; feed->used && i < t->grid->point_count; i++) {
        uint64_t id = feed->ids ? feed->ids[i] : feed->range_first + i;
        if (t->point_marks[i] & TLI_POINT_USED) feed->used[id / 8] |= (uint8_t)(1u << id % 8);
    }
    return st;
}

static tl_status tet_values(tli_feed *feed)
{
    tli_tets *t = &feed->tets;
    tl_status st = TL_OK;
    uint32_t components = feed->components[TL_ON_TET];
    if (!components) return TL_OK;
    for (uint32_t a = 0; !st && a < t->grid->cell_array_count; a++)
        st = tli_tets_repeat(t, &t->grid->cell_arrays[a]);
    size_t tuple = components * sizeof(double);
    feed->values = tl_mem_alloc(feed->ctx, t->tet_count, tuple, &st);
    if (st) return st;
    interleave(t->grid->cell_arrays, t->grid->cell_array_count, t->tet_count, components,
               feed->values);
    if (feed->has_counted) return TL_OK;
    for (size_t i = 0; i < t->tet_count * components; i++)
        feed->sum.nonfinite_values += !isfinite(feed->values[i]);
    return TL_OK;
}

void tli_feed_rewind(tli_feed *feed)
{
    close_window(feed);
    feed->next_cell = 0;
    feed->next_tet = 0;
}

tl_status tli_feed_next(tli_feed *feed, tli_window *window, bool *more)
{
    tli_feeder *reader = feed->reader;
    uint64_t step = feed->memory_bytes / MEMORY_A_CELL, first = feed->next_cell;
    close_window(feed);
    *window = (tli_window){.first_tet = feed->next_tet};
    *more = first < reader->cell_count;
    if (!*more) {
        feed->has_counted = true;
        feed->tet_count = feed->next_tet;
        return TL_OK;
    }
    if (step < WINDOW_CELLS_MIN) step = WINDOW_CELLS_MIN;
    if (step > reader->cell_count - first) step = reader->cell_count - first;
    tl_status st = read_cells(feed, first, step);
    if (st) return st;
    st = tli_tets_open(&feed->tets, &feed->grid, &feed->opts);
    feed->is_open = true;
    feed->tets.cell_first = first;
    if (!st) st = reader->is_final ? take_final(feed, first) : split_window(feed);
    if (!st) st = tet_values(feed);
    if (st) return st;
    window->tet_count = feed->tets.tet_count;
    window->tets = feed->tets.tets;
    window->regions = feed->tets.regions;
    window->values = feed->values;
    window->point_count = (size_t)feed->grid.point_count;
    window->first_point = feed->range_first;
    window->ids = feed->ids;
    window->xyz = feed->grid.xyz;
    feed->next_cell += step;
    feed->next_tet += feed->tets.tet_count;
    return TL_OK;
}

/* ---- the report ---- */

typedef struct finite_job {
    const double *values;
    const uint8_t *used; /* bit of point first + i */
    uint64_t first;
    size_t components;
    _Atomic uint64_t bad;
} finite_job;

static tl_status finite_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    finite_job *job = arg;
    uint64_t bad = 0;
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        uint64_t id = job->first + i;
        if (job->used && !(job->used[id / 8] >> id % 8 & 1)) continue;
        for (size_t c = 0; c < job->components; c++)
            bad += !isfinite(job->values[i * job->components + c]);
    }
    atomic_fetch_add(&job->bad, bad);
    return TL_OK;
}

/* Values of points that tets use; of all points where there are no tets. */
static tl_status count_nonfinite(tli_feed *feed, uint64_t *bad)
{
    tl_status st = TL_OK;
    const uint64_t points = feed->reader->point_count;
    finite_job job = {.used = feed->tet_count ? feed->used : NULL,
                      .components = feed->components[TL_ON_VERTEX]};
    if (!job.components) return TL_OK;
    double *values = tl_mem_alloc(feed->ctx, GATHER_POINTS, job.components * sizeof *values, &st);
    job.values = values;
    for (; !st && job.first < points; job.first += GATHER_POINTS) {
        uint64_t left = points - job.first, count = left < GATHER_POINTS ? left : GATHER_POINTS;
        st = tli_feed_points(feed, job.first, (size_t)count, NULL, values, NULL);
        if (!st)
            st = tli_parallel(feed->ctx, (size_t)count, TLI_TETS_GRAIN / 8, finite_piece, &job);
    }
    *bad += atomic_load(&job.bad);
    tl_mem_free(feed->ctx, values);
    return st;
}

tl_status tli_feed_report(tli_feed *feed, tl_read_report *report)
{
    tl_status st = TL_OK;
    if (!feed->has_report && !feed->reader->is_final) {
        const uint64_t points = feed->reader->point_count;
        uint64_t used = 0;
        for (uint64_t i = 0; i <= points / 8; i++)
            used += (unsigned)__builtin_popcount(feed->used[i]);
        feed->report.unused_points = feed->tet_count ? points - used : 0;
        st = count_nonfinite(feed, &feed->sum.nonfinite_values);
        if (st) return st;
        tli_tets all = {.ctx = feed->ctx,
                        .opts = feed->opts,
                        .report = feed->report,
                        .sum = feed->sum,
                        .tet_count = feed->tet_count ? 1 : 0,
                        .vert_count = (size_t)points};
        if (feed->region_index >= 0)
            all.region_name = feed->reader->arrays[TL_ON_TET][feed->region_index].name;
        tli_tets_report(&all);
        feed->report = all.report;
        feed->has_report = true;
    }
    if (report) *report = feed->report;
    return TL_OK;
}
