/* Streamlines of a list of seeds: seeds in batches on the pool, the lines in the order of the
 * seeds. Also what the cover shares: options, lines that stay, the result. */
#include <math.h>
#include <string.h>

#include "extract/extract_stream.h"
#include "mesh/mesh.h"

/* Parts of a chord that a step has if nothing is said, by order. */
static const double STEP_SECOND = 0.5, STEP_FIFTH = 2, STEP_MOST = 64;
/* Length of a line if nothing is said, in diagonals of the mesh. */
static const double LENGTH_DIAGONALS = 4;
enum { SEEDS_AT_ONCE = 4, ROWS_AT_ONCE = 4096 };

tl_stream_opts tl_stream_opts_defaults(void)
{
    return (tl_stream_opts){.struct_bytes = sizeof(tl_stream_opts),
                            .order = 2,
                            .direction = TL_STREAM_BOTH,
                            .tolerance = 1e-7,
                            .step_max = 10000,
                            .speed_min = 1e-6};
}

/* ---- what a call was given ---- */

static tl_status check_opts(tl_ctx *ctx, const tl_mesh *mesh, const tl_stream_opts *o)
{
    if (o->order != 2 && o->order != 5)
        return tl_fail(ctx, TL_ERR_ARG, "streamlines: the order is 2 or 5, not %u", o->order);
    if (o->direction < TL_STREAM_FORWARD || o->direction > TL_STREAM_BOTH)
        return tl_fail(ctx, TL_ERR_ARG, "streamlines: %d is no direction", (int)o->direction);
    if (!(o->step >= 0 && o->step <= STEP_MOST))
        return tl_fail(ctx, TL_ERR_ARG, "streamlines: a step is 0 to %g chords, not %g", STEP_MOST,
                       o->step);
    if (!(o->tolerance > 0 && isfinite(o->tolerance)))
        return tl_fail(ctx, TL_ERR_ARG, "streamlines: the tolerance must be above 0, not %g",
                       o->tolerance);
    if (!(o->length_max >= 0) || !(o->time_max >= 0) || !o->step_max)
        return tl_fail(ctx, TL_ERR_ARG,
                       "streamlines: length %g and time %g must be 0 or above, steps %zu above 0",
                       o->length_max, o->time_max, o->step_max);
    if (!(o->speed_min >= 0 && o->speed_min <= 1))
        return tl_fail(ctx, TL_ERR_ARG, "streamlines: the least speed is 0 to 1, not %g",
                       o->speed_min);
    return tli_carried_check(ctx, mesh, o->channels, o->channel_count);
}

static void measure_bounds(const tl_mesh *mesh, double bounds[6])
{
    for (int k = 0; k < 3; k++) {
        bounds[2 * k] = INFINITY;
        bounds[2 * k + 1] = -INFINITY;
    }
    for (size_t i = 0; i < 4 * mesh->tet_count; i++)
        for (int k = 0; k < 3; k++) {
            double x = mesh->xyz[3 * (size_t)mesh->tets[i] + (size_t)k];
            if (!isfinite(x)) continue;
            bounds[2 * k] = x < bounds[2 * k] ? x : bounds[2 * k];
            bounds[2 * k + 1] = x > bounds[2 * k + 1] ? x : bounds[2 * k + 1];
        }
    for (int k = 0; k < 6; k++)
        if (!isfinite(bounds[k])) bounds[k] = 0;
}

static void complete(tli_stream_job *job)
{
    tl_stream_opts *o = &job->opts;
    const tl_mesh *mesh = job->field.mesh;
    double diagonal = 0, range[2];
    const tl_channel vectors = {.components = 3, .values = job->field.vectors};
    measure_bounds(mesh, job->bounds);
    for (int k = 0; k < 3; k++)
        diagonal = hypot(diagonal, job->bounds[2 * k + 1] - job->bounds[2 * k]);
    tl_channel_range(&vectors, mesh->vert_count, range, NULL);
    if (!(o->step > 0)) o->step = o->order == 5 ? STEP_FIFTH : STEP_SECOND;
    job->length_max = o->length_max > 0 ? o->length_max : LENGTH_DIAGONALS * diagonal;
    job->time_max = o->time_max > 0 ? o->time_max : INFINITY;
    job->speed_min = o->speed_min * range[1];
    job->tolerance = o->tolerance * diagonal;
    job->row_doubles = TLI_ROW_CARRIED;
    for (size_t c = 0; c < o->channel_count; c++)
        job->row_doubles += mesh->channels[o->channels[c]].components;
    job->row_doubles += o->normals;
}

tl_status tli_stream_open(tl_ctx *ctx, const tli_stream_field *given, const tl_stream_opts *opts,
                          tli_stream_job *job)
{
    *job = (tli_stream_job){.ctx = ctx, .field = *given, .opts = tl_stream_opts_defaults()};
    tl_status st = tli_opts_take(ctx, "tl_stream_opts", opts, &job->opts, sizeof job->opts);
    if (!st) st = check_opts(ctx, given->mesh, &job->opts);
    if (st) return st;
    complete(job);
    if (!given->opposite) st = tl_mesh_adjacency(ctx, given->mesh, &job->own_opposite, NULL);
    if (!given->opposite) job->field.opposite = job->own_opposite;
    if (!st && !given->locator)
        st = tl_locator_create(ctx, given->mesh, job->field.opposite, &job->own_locator);
    if (!given->locator) job->field.locator = job->own_locator;
    return st;
}

void tli_stream_close(tli_stream_job *job)
{
    tl_locator_destroy(job->own_locator);
    tl_mem_free(job->ctx, job->own_opposite);
}

/* ---- lines that stay ---- */

typedef struct batch {
    const tli_stream_job *job;
    const double *seeds;
    tli_stream_line *lines;
} batch;

static tl_status trace_some(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const batch *b = arg;
    tl_status st = TL_OK;
    for (size_t i = begin; i < end && !st; i++)
        st = tli_stream_trace(b->job, b->seeds + 3 * i, &b->lines[i]);
    return st;
}

tl_status tli_stream_batch(const tli_stream_job *job, const double *seeds, size_t seed_count,
                           tli_stream_line *lines)
{
    batch b = {job, seeds, lines};
    return tli_parallel(job->ctx, seed_count, SEEDS_AT_ONCE, trace_some, &b);
}

tl_status tli_stream_keep(const tli_stream_job *job, const tli_stream_line *line,
                          tli_stream_sum *sum)
{
    tl_status st = TL_OK;
    size_t width = job->row_doubles;
    if (sum->count + line->count >= TL_NONE)
        return tl_fail(job->ctx, TL_ERR_UNSUPPORTED,
                       "streamlines have more than 2^32 - 2 vertices");
    if (sum->count + line->count > sum->room) {
        size_t room = sum->count + line->count + sum->room / 2;
        sum->rows = tl_mem_resize(job->ctx, sum->rows, room, width * sizeof *sum->rows, &st);
        if (!st) sum->room = room;
    }
    if (sum->line_count + 2 > sum->line_room) {
        size_t room = 2 * sum->line_room + 64;
        sum->starts = tl_mem_resize(job->ctx, sum->starts, room, sizeof *sum->starts, &st);
        if (!st) sum->line_room = room;
    }
    if (st) return st;
    memcpy(sum->rows + width * sum->count, line->rows, line->count * width * sizeof *sum->rows);
    sum->starts[sum->line_count++] = (tl_lidx)sum->count;
    sum->count += line->count;
    sum->report.steps += line->steps;
    for (int e = 0; e < TL_STREAM_END_COUNT; e++) sum->report.ends[e] += line->ends[e];
    return st;
}

void tli_stream_sum_release(const tli_stream_job *job, tli_stream_sum *sum)
{
    tl_mem_free(job->ctx, sum->starts);
    tl_mem_free(job->ctx, sum->rows);
}

/* ---- the result ---- */

typedef struct column {
    const tli_stream_sum *sum;
    size_t width, first, components;
    double *values;
} column;

static tl_status copy_column(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const column *c = arg;
    for (size_t v = begin; v < end; v++)
        for (size_t k = 0; k < c->components; k++)
            c->values[c->components * v + k] = c->sum->rows[c->width * v + c->first + k];
    return TL_OK;
}

/* Columns of the rows as a block of their own. */
static double *take_column(const tli_stream_job *job, const tli_stream_sum *sum, size_t first,
                           size_t components, tl_status *st)
{
    column c = {sum, job->row_doubles, first, components, NULL};
    c.values = tl_mem_alloc(job->ctx, sum->count, components * sizeof *c.values, st);
    if (!*st) *st = tli_parallel(job->ctx, sum->count, ROWS_AT_ONCE, copy_column, &c);
    return c.values;
}

static bool is_carried(const tli_stream_job *job, const char *name)
{
    for (size_t c = 0; c < job->opts.channel_count; c++)
        if (!strcmp(job->field.mesh->channels[job->opts.channels[c]].name, name)) return true;
    return false;
}

static tl_status add_channel(const tli_stream_job *job, const tli_stream_sum *sum, size_t first,
                             tl_channel channel, tl_polydata *lines)
{
    tl_status st = TL_OK;
    double *values = take_column(job, sum, first, channel.components, &st);
    channel.values = values;
    if (!st) st = tl_polydata_adopt_channel(job->ctx, lines, &channel);
    if (st) tl_mem_free(job->ctx, values);
    return st;
}

static tl_status add_channels(const tli_stream_job *job, const tli_stream_sum *sum,
                              tl_polydata *lines)
{
    size_t first = TLI_ROW_CARRIED;
    tl_channel time = {
        is_carried(job, "time") ? "time_2" : "time", "", 1, TL_ON_VERTEX, TL_F32, NULL};
    tl_channel speed = {
        is_carried(job, "speed") ? "speed_2" : "speed", "", 1, TL_ON_VERTEX, TL_F32, NULL};
    tl_status st = add_channel(job, sum, TLI_ROW_TIME, time, lines);
    if (!st) st = add_channel(job, sum, TLI_ROW_SPEED, speed, lines);
    for (size_t c = 0; c < job->opts.channel_count && !st; c++) {
        const tl_channel *own = &job->field.mesh->channels[job->opts.channels[c]];
        st = add_channel(job, sum, first, *own, lines);
        first += own->components;
    }
    return st;
}

tl_status tli_stream_finish(const tli_stream_job *job, const tli_stream_sum *sum,
                            tl_polydata **lines)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = job->ctx;
    tl_polydata *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    made->kind = TL_POLY_LINES;
    made->vert_count = sum->count;
    made->cell_count = sum->line_count;
    made->xyz = take_column(job, sum, 0, 3, &st);
    made->corners = tl_mem_alloc(ctx, sum->count, sizeof *made->corners, &st);
    made->starts = tl_mem_alloc(ctx, sum->line_count + 1, sizeof *made->starts, &st);
    for (size_t v = 0; v < sum->count && !st; v++) made->corners[v] = (tl_lidx)v;
    for (size_t c = 0; c < sum->line_count && !st; c++) made->starts[c] = sum->starts[c];
    if (!st) made->starts[sum->line_count] = (tl_lidx)sum->count;
    if (!st) st = add_channels(job, sum, made);
    if (!st && job->opts.normals) st = tli_stream_normals(job, sum, &made->normals);
    if (st)
        tl_polydata_destroy(ctx, made);
    else
        *lines = made;
    return st;
}

/* ---- a list of seeds ---- */

static tl_status trace_seeds(const tli_stream_job *job, const double *seeds, size_t seed_count,
                             tli_stream_sum *sum)
{
    tl_status st = TL_OK;
    tli_stream_line *lines = tl_mem_zalloc(job->ctx, TLI_STREAM_BATCH, sizeof *lines, &st);
    for (size_t begin = 0; begin < seed_count && !st; begin += TLI_STREAM_BATCH) {
        size_t count =
            seed_count - begin < TLI_STREAM_BATCH ? seed_count - begin : TLI_STREAM_BATCH;
        st = tli_stream_batch(job, seeds + 3 * begin, count, lines);
        for (size_t i = 0; i < count && !st; i++) {
            if (lines[i].count > 1)
                st = tli_stream_keep(job, &lines[i], sum);
            else
                sum->report.seeds_outside++;
        }
        if (!st) st = tl_progress(job->ctx, "lines", begin + count, seed_count);
    }
    for (size_t i = 0; lines && i < TLI_STREAM_BATCH; i++) tl_mem_free(job->ctx, lines[i].rows);
    tl_mem_free(job->ctx, lines);
    return st;
}

tl_status tl_streamlines(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                         const tl_locator *locator, const double *vectors, const double *seeds,
                         size_t seed_count, const tl_stream_opts *opts, tl_polydata **lines,
                         tl_stream_report *report)
{
    tli_stream_job job;
    tli_stream_sum sum = {0};
    const tli_stream_field field = {mesh, opposite, locator, vectors};
    *lines = NULL;
    tl_status st = tli_stream_open(ctx, &field, opts, &job);
    if (!st) st = trace_seeds(&job, seeds, seed_count, &sum);
    if (!st) st = tli_stream_finish(&job, &sum, lines);
    if (!st && report) *report = sum.report;
    tli_stream_sum_release(&job, &sum);
    tli_stream_close(&job);
    return st;
}
