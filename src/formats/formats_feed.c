/* Windows of tets out of data sets of any size. A window is a run of cells, made to a small grid of
 * its own: its points are numbered in ascending order of the data set's, so that what depends on
 * the order of indices (the cut of cells) comes out as in the whole. formats_tets.c then splits it
 * as it splits a whole grid. */
#include "formats/formats_feeder.h"

#include "base/base_sort.h"
#include "base/base_spill.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

/* Points or cells looked at at once. */
#define STEP_POINTS 65536u

/* ---- arrays ---- */

tl_status tli_feeder_add(tli_feeder *feeder, tl_on on, const char *name, uint32_t components,
                         tl_scalar scalar)
{
    tl_status st = TL_OK;
    uint32_t count = feeder->array_counts[on];
    char *own = tli_strdup(feeder->ctx, name, &st);
    feeder->arrays[on] = tl_mem_resize(feeder->ctx, feeder->arrays[on], (size_t)count + 1,
                                       sizeof *feeder->arrays[on], &st);
    if (st) {
        tl_mem_free(feeder->ctx, own);
        return st;
    }
    feeder->arrays[on][count] = (tli_feeder_array){own, components, scalar, {0}};
    feeder->array_counts[on]++;
    return TL_OK;
}

void tli_feeder_drop_arrays(tli_feeder *feeder)
{
    for (int on = 0; on < 2; on++) {
        for (uint32_t i = 0; i < feeder->array_counts[on]; i++)
            tl_mem_free(feeder->ctx, feeder->arrays[on][i].name);
        tl_mem_free(feeder->ctx, feeder->arrays[on]);
    }
}

unsigned tli_feeder_usual_tets(uint8_t vtk_type)
{
    static const uint8_t usual[] = {[TLI_SHAPE_TETRA] = 1,
                                    [TLI_SHAPE_PYRAMID] = 2,
                                    [TLI_SHAPE_WEDGE] = 3,
                                    [TLI_SHAPE_HEXAHEDRON] = 6,
                                    [TLI_SHAPE_VOXEL] = 6};
    const tli_shape shape = tli_cell_type_of(vtk_type).shape;
    return (size_t)shape < sizeof usual ? usual[shape] : 0;
}

/* ---- opening ---- */

/* Holds whole ids, over the whole array: what tli_tets_find_region asks of a grid. */
static tl_status holds_ids(tli_feed *feed, uint32_t array, bool *holds)
{
    tli_feeder *feeder = feed->feeder;
    tl_status st = TL_OK;
    size_t step = STEP_POINTS;
    *holds = feeder->arrays[TL_ON_TET][array].components == 1;
    double *values = tl_mem_alloc(feed->ctx, step, sizeof *values, &st);
    for (uint64_t first = 0; !st && *holds && first < feeder->cell_count; first += step) {
        uint64_t left = feeder->cell_count - first, count = left < step ? left : step;
        st = feeder->values(feeder, TL_ON_TET, array, first, count, values);
        for (uint64_t i = 0; !st && i < count && *holds; i++)
            *holds = tl_scalar_holds(TL_I32, values[i] + 0.0);
    }
    tl_mem_free(feed->ctx, values);
    return st;
}

/* Decides once for all windows which array holds the regions. */
static tl_status find_regions(tli_feed *feed)
{
    const tli_feeder *feeder = feed->feeder;
    feed->region_index = -1;
    feed->has_regions = feeder->is_final && feeder->regions;
    if (feeder->is_final) return TL_OK;
    for (uint32_t i = 0; i < feeder->array_counts[TL_ON_TET]; i++) {
        const tli_feeder_array *array = &feeder->arrays[TL_ON_TET][i];
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
                       feed->opts.region, feeder->array_counts[TL_ON_TET]);
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
static int find_ghosts(const tli_feeder *feeder, tl_on on, const char *name)
{
    for (uint32_t i = 0; i < feeder->array_counts[on]; i++) {
        const tli_feeder_array *array = &feeder->arrays[on][i];
        if (is_ghost_array(array, on) && strcmp(array->name, name) == 0) return (int)i;
    }
    return -1;
}

static bool is_channel(const tli_feed *feed, tl_on on, uint32_t index)
{
    const tli_feeder *feeder = feed->feeder;
    if (feeder->is_final) return true;
    const tli_feeder_array *array = &feeder->arrays[on][index];
    return !is_ghost_array(array, on) || find_ghosts(feeder, on, array->name) != (int)index;
}

/* Names that are taken get a suffix, as tl_mesh_adopt_channel gives it; those of a step have theirs
 * already. */
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
    const tli_feeder *feeder = feed->feeder;
    size_t most = (size_t)feeder->array_counts[0] + feeder->array_counts[1];
    feed->channels = tl_mem_zalloc(ctx, most, sizeof *feed->channels, &st);
    feed->steps = tl_mem_zalloc(ctx, most, sizeof *feed->steps, &st);
    for (int on = 0; on < 2; on++)
        for (uint32_t i = 0; !st && i < feeder->array_counts[on]; i++) {
            const tli_feeder_array *array = &feeder->arrays[on][i];
            if (!is_channel(feed, (tl_on)on, i)) continue;
            tl_channel channel = {array->name,   "",  array->components, (tl_on)on,
                                  array->scalar, none};
            if (!array->step.is_given) {
                st = tl_mesh_add_channel(names, &channel);
                if (st) break;
                channel.name = tl_mesh_channel(names, tl_mesh_channel_count(names) - 1)->name;
            }
            channel.name = tli_strdup(ctx, channel.name, &st);
            channel.values = NULL;
            if (st) break;
            feed->steps[feed->channel_count] = array->step;
            feed->channels[feed->channel_count++] = channel;
            feed->components[on] += array->components;
        }
    tl_mesh_destroy(names);
    return st;
}

/* What is the same for all feeders. Takes over feeder. */
static tl_status prepare_feed(tli_feed *feed, tli_feeder *feeder)
{
    tl_status st = TL_OK;
    feed->feeder = feeder;
    feed->tet_estimate = feeder->cell_count;
    feed->marks_points = find_ghosts(feeder, TL_ON_VERTEX, "vtkGhostType") >= 0 ||
                         feed->opts.has_fill_value || feeder->blanks;
    if (feeder->is_final) feed->marks_points = false;
    if (feeder->point_count > TL_MESH_VERTS_MAX)
        return tl_fail(feed->ctx, TL_ERR_UNSUPPORTED, "%llu points, at most %u can be numbered",
                       (unsigned long long)feeder->point_count, TL_MESH_VERTS_MAX);
    feed->report.points = feed->has_report ? feed->report.points : feeder->point_count;
    if (!feed->has_report && !feeder->is_final)
        feed->used = tl_mem_zalloc(feed->ctx, (size_t)(feeder->point_count / 8 + 1), 1, &st);
    if (!st) st = find_regions(feed);
    if (!st) st = add_channels(feed);
    if (!st && feeder->estimate) st = feeder->estimate(feeder, &feed->tet_estimate);
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

/* Feeders that work in windows, the first that takes the file. */
static tl_status open_windowed(tli_feed *feed, const char *path, tli_feeder **feeder)
{
    const tl_read_opts *opts = &feed->opts;
    bool raw = opts->raw_dims[0] || opts->raw_dims[1] || opts->raw_dims[2];
    bool whole = opts->cell_to_point || opts->weld || opts->step || opts->has_time;
    *feeder = NULL;
    if (whole) return TL_OK;
    tl_status st = tli_map_open(feed->ctx, path, &feed->map);
    if (st) return st;
    feed->has_map = true;
    if (feed->map.owned) return TL_OK; /* no file that can be read again */
    if (raw) return tli_feeder_open_raw(feed->ctx, &feed->map, path, opts, feeder);
    st = tli_feeder_open_vtu(feed->ctx, &feed->map, path, feeder);
    if (!st && !*feeder) st = tli_feeder_open_vts(feed->ctx, &feed->map, path, feeder);
    if (!st && !*feeder) st = tli_feeder_open_legacy(feed->ctx, &feed->map, path, feeder);
    if (!st && !*feeder) st = tli_feeder_open_plot3d(feed->ctx, &feed->map, path, opts, feeder);
    return st;
}

/* The mesh lies in working files, where there is a budget: no reader needs to know. */
static tl_status open_whole(tli_feed *feed, const char *path, const char *folder,
                            tli_feeder **feeder)
{
    tl_mesh *mesh = NULL;
    if (feed->has_map) tli_map_close(feed->ctx, &feed->map);
    feed->has_map = false;
    tli_spill_begin(feed->ctx, folder);
    tl_status st = tl_mesh_read(feed->ctx, path, &feed->opts, &mesh, &feed->report);
    tli_spill_end(feed->ctx);
    feed->has_report = true;
    if (!st) st = tli_feeder_open_mesh(feed->ctx, mesh, true, feeder);
    if (st) tl_mesh_destroy(mesh);
    return st;
}

tl_status tli_feed_open(tl_ctx *ctx, const char *path, const tl_read_opts *opts, const char *folder,
                        uint64_t memory_bytes, tli_feed **feed)
{
    tli_feeder *feeder = NULL;
    *feed = NULL;
    tl_status st = feed_create(ctx, opts, memory_bytes, feed);
    if (st) return st;
    (*feed)->path = tli_strdup(ctx, path, &st);
    (*feed)->stamp = tli_stamp_take(path);
    if (!st && (*feed)->opts.split != 5 && (*feed)->opts.split != 6)
        st = tl_fail(ctx, TL_ERR_ARG, "a structured cell is split into 5 or 6 tets, not %d",
                     (*feed)->opts.split);
    if (!st) st = open_windowed(*feed, path, &feeder);
    if (!st && !feeder) st = open_whole(*feed, path, folder, &feeder);
    if (!st) st = prepare_feed(*feed, feeder);
    if (!st) return TL_OK;
    tli_feed_close(*feed);
    *feed = NULL;
    return st;
}

tl_status tli_feed_open_series(tl_ctx *ctx, const tl_step *steps, size_t step_count,
                               const tl_read_opts *opts, const char *folder, uint64_t memory_bytes,
                               tli_feed **feed)
{
    tli_feeder *feeder = NULL;
    *feed = NULL;
    tl_status st = feed_create(ctx, opts, memory_bytes, feed);
    if (st) return st;
    st = tli_feeder_open_series(ctx, steps, step_count, &(*feed)->opts, folder, &(*feed)->report,
                                &feeder);
    (*feed)->has_report = true;
    if (!st) st = prepare_feed(*feed, feeder);
    if (!st) return TL_OK;
    tli_feed_close(*feed);
    *feed = NULL;
    return st;
}

void tli_feed_close_window(tli_feed *feed)
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
    tli_feed_close_window(feed);
    for (size_t i = 0; i < feed->channel_count; i++)
        tl_mem_free(ctx, (char *)(uintptr_t)feed->channels[i].name);
    tl_mem_free(ctx, feed->steps);
    tl_mem_free(ctx, feed->channels);
    tl_mem_free(ctx, feed->path);
    tl_mem_free(ctx, feed->used);
    tl_mem_free(ctx, feed->range_xyz);
    if (feed->feeder) feed->feeder->close(feed->feeder);
    if (feed->has_map) tli_map_close(ctx, &feed->map);
    tl_mem_free(ctx, feed);
}

uint64_t tli_feed_point_count(const tli_feed *feed)
{
    return feed->feeder->point_count;
}

uint64_t tli_feed_tet_estimate(const tli_feed *feed)
{
    return feed->tet_estimate;
}

double tli_feed_time(const tli_feed *feed)
{
    return feed->feeder->time;
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

tli_feed_step tli_feed_channel_step(const tli_feed *feed, size_t channel)
{
    return feed->steps[channel];
}

/* ---- values ---- */

/* One array of a window into its grid. */
tl_status tli_feed_read_array(tli_feed *feed, tl_on on, uint32_t index, uint64_t first,
                              uint64_t count)
{
    tli_feeder *feeder = feed->feeder;
    const tli_feeder_array *array = &feeder->arrays[on][index];
    tli_grid_array *added;
    tl_status st =
        tli_grid_add(&feed->grid, on, array->name, array->components, array->scalar, NULL, &added);
    return st ? st : feeder->values(feeder, on, index, first, count, added->values);
}

/* Values of all arrays [count][components], tuple by tuple. */
void tli_feed_interleave(const tli_grid_array *arrays, uint32_t array_count, size_t count,
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
    tli_feeder *feeder = feed->feeder;
    tl_status st = TL_OK;
    feed->grid.point_count = count;
    for (uint32_t a = 0; !st && a < feeder->array_counts[TL_ON_VERTEX]; a++)
        st = tli_feed_read_array(feed, TL_ON_VERTEX, a, first, count);
    if (feeder->blanks) feed->grid.blanks = tl_mem_alloc(feed->ctx, count, 1, &st);
    if (!st && feeder->blanks) st = feeder->blanks(feeder, first, count, feed->grid.blanks);
    if (st) return st;
    st = tli_tets_open(&feed->tets, &feed->grid, &feed->opts);
    feed->is_open = true;
    if (!st) st = tli_tets_prepare(&feed->tets);
    if (!st) st = tli_tets_mark_missing(&feed->tets);
    if (st) return st;
    if (values)
        tli_feed_interleave(feed->grid.point_arrays, feed->grid.point_array_count, count,
                            feed->components[TL_ON_VERTEX], values);
    for (size_t i = 0; missing && i < count; i++)
        missing[i] = (feed->tets.point_marks[i] & (TLI_POINT_HIDDEN | TLI_POINT_MISSING)) != 0;
    return TL_OK;
}

static tl_status read_values(tli_feed *feed, uint64_t first, size_t count, double *values)
{
    tli_feeder *feeder = feed->feeder;
    tl_status st = TL_OK;
    if (feeder->array_counts[TL_ON_VERTEX] == 1)
        return feeder->values(feeder, TL_ON_VERTEX, 0, first, count, values);
    feed->grid.point_count = count;
    for (uint32_t a = 0; !st && a < feeder->array_counts[TL_ON_VERTEX]; a++)
        st = tli_feed_read_array(feed, TL_ON_VERTEX, a, first, count);
    if (!st)
        tli_feed_interleave(feed->grid.point_arrays, feed->grid.point_array_count, count,
                            feed->components[TL_ON_VERTEX], values);
    return st;
}

tl_status tli_feed_points(tli_feed *feed, uint64_t first, size_t count, double *xyz, double *values,
                          uint8_t *missing)
{
    tl_status st = TL_OK;
    tli_feed_close_window(feed);
    if (xyz) st = feed->feeder->points(feed->feeder, first, count, xyz);
    if (missing) memset(missing, 0, count);
    if (!st && feed->marks_points)
        st = read_marked(feed, first, count, values, missing);
    else if (!st && values && feed->components[TL_ON_VERTEX])
        st = read_values(feed, first, count, values);
    tli_feed_close_window(feed);
    return st;
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
    const uint64_t points = feed->feeder->point_count;
    finite_job job = {.used = feed->tet_count ? feed->used : NULL,
                      .components = feed->components[TL_ON_VERTEX]};
    if (!job.components) return TL_OK;
    double *values = tl_mem_alloc(feed->ctx, STEP_POINTS, job.components * sizeof *values, &st);
    job.values = values;
    for (; !st && job.first < points; job.first += STEP_POINTS) {
        uint64_t left = points - job.first, count = left < STEP_POINTS ? left : STEP_POINTS;
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
    if (feed->path) st = tli_stamp_check(feed->ctx, feed->path, &feed->stamp, st);
    if (st) return st;
    if (!feed->has_report && !feed->feeder->is_final) {
        const uint64_t points = feed->feeder->point_count;
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
            all.region_name = feed->feeder->arrays[TL_ON_TET][feed->region_index].name;
        tli_tets_report(&all);
        feed->report = all.report;
        feed->has_report = true;
    }
    if (report) *report = feed->report;
    return TL_OK;
}
