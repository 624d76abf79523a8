/* Where the original's vertices lie in the copy, and how far a channel is off there: the mean field
 * error of Sondershaus 2007, 4.2.5. Vertices are visited along a Hilbert curve, so that the tet of
 * one is a good hint for the next and both meshes stay in the cache. */
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "base/base_vec.h"
#include "measure/measure.h"

enum {
    LOCATE_GRAIN = 2048, /* vertices of a piece; each piece starts without a hint */
    CHANNEL_GRAIN = 8192 /* vertices whose errors are summed on their own */
};

/* ---- points in tets ---- */

tli_tet_point tli_tet_point_make(const tl_lidx corners[4], const double weights[4])
{
    tli_tet_point point;
    point.base = 0;
    for (int i = 0; i < 4; i++) {
        point.corners[i] = corners[i];
        point.weights[i] = weights[i];
        if (weights[i] > weights[point.base]) point.base = i;
    }
    return point;
}

/* Written as the value at one corner and differences to it, so that a constant stays constant to
 * the bit and a corner of weight 0 has no say, even if it holds no number. */
static double interpolate(const tl_channel *channel, const tli_tet_point *point, uint32_t component)
{
    size_t stride = channel->components;
    const double *values = channel->values + component;
    double base = values[point->corners[point->base] * stride], sum = base;
    for (int i = 0; i < 4; i++) {
        if (i == point->base || point->weights[i] == 0) continue;
        sum += point->weights[i] * (values[point->corners[i] * stride] - base);
    }
    return sum;
}

double tli_point_error(const tl_channel *original, const tli_tet_point *point,
                       const tl_channel *copy, const tli_tet_point *copy_point)
{
    double sum = 0, difference = 0;
    for (uint32_t c = 0; c < original->components; c++) {
        difference = interpolate(original, point, c) - interpolate(copy, copy_point, c);
        sum += difference * difference;
    }
    double error = original->components == 1 ? fabs(difference) : sqrt(sum);
    return isnan(error) ? (double)INFINITY : error;
}

bool tli_channel_finite(const tl_channel *channel, size_t element)
{
    const double *values = channel->values + element * channel->components;
    for (uint32_t c = 0; c < channel->components; c++)
        if (!isfinite(values[c])) return false;
    return true;
}

/* ---- location ---- */

typedef struct locate_job {
    const tl_mesh *original, *copy;
    const tl_locator *locator;
    const uint32_t *order;
    const tl_lidx *hints;
    uint8_t *used;   /* [original vert_count] */
    tl_lidx *tet_of; /* [copy vert_count] a tet that uses the vertex, or TL_NONE */
    tl_lidx *tets;
    double (*weights)[4];
    double *distances;
} locate_job;

static bool same_place(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* The tet of the copy's vertex with the same number, if it is at the same place. */
static tl_lidx locate_same(const locate_job *job, size_t v, double weights[4])
{
    if (v >= job->copy->vert_count || job->tet_of[v] == TL_NONE) return TL_NONE;
    if (!same_place(job->original->xyz + 3 * v, job->copy->xyz + 3 * v)) return TL_NONE;
    const tl_lidx *corners = job->copy->tets + 4 * (size_t)job->tet_of[v];
    bool taken = false; /* a broken tet may name the vertex twice */
    for (int i = 0; i < 4; i++) {
        weights[i] = corners[i] == v && !taken;
        taken = taken || corners[i] == v;
    }
    return job->tet_of[v];
}

/* Rounding must not keep a vertex that the copy has kept from taking that vertex's value exactly.
 */
static void snap_to_corner(const tl_mesh *mesh, tl_lidx tet, const double x[3], double weights[4])
{
    for (size_t i = 0; i < 4; i++) {
        if (!same_place(x, mesh->xyz + 3 * (size_t)mesh->tets[4 * (size_t)tet + i])) continue;
        for (size_t j = 0; j < 4; j++) weights[j] = j == i;
        return;
    }
}

static void locate_one(const locate_job *job, size_t v, tl_lidx *last)
{
    const double *x = job->original->xyz + 3 * v;
    double weights[4] = {0, 0, 0, 0}, distance = 0;
    tl_lidx tet = TL_NONE;
    if (job->used[v] && vec_is_finite(x)) {
        tet = locate_same(job, v, weights);
        if (tet == TL_NONE) {
            tl_lidx hint = job->hints && job->hints[v] != TL_NONE ? job->hints[v] : *last;
            tet = tl_locator_nearest(job->locator, x, hint, weights, &distance);
            if (tet != TL_NONE) snap_to_corner(job->copy, tet, x, weights);
        }
        *last = tet;
    }
    if (job->tets) job->tets[v] = tet;
    if (job->weights) memcpy(job->weights[v], weights, sizeof weights);
    if (job->distances) job->distances[v] = distance;
}

static tl_status locate_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const locate_job *job = arg;
    tl_lidx last = TL_NONE;
    (void)worker;
    for (size_t i = begin; i < end; i++) locate_one(job, job->order[i], &last);
    return TL_OK;
}

tl_status tli_locate_vertices(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                              const tl_locator *copy_locator, const uint32_t *order,
                              const tl_lidx *hints, tl_lidx *tets, double (*weights)[4],
                              double *outside_distance)
{
    if (copy->tet_count == 0) return tl_fail(ctx, TL_ERR_DATA, "the copy has no tets to locate in");
    tl_status st = TL_OK;
    locate_job job = {.original = original,
                      .copy = copy,
                      .locator = copy_locator,
                      .order = order,
                      .hints = hints,
                      .tets = tets,
                      .weights = weights,
                      .distances = outside_distance};
    job.used = tl_mem_zalloc(ctx, original->vert_count, sizeof *job.used, &st);
    job.tet_of = tl_mem_alloc(ctx, copy->vert_count, sizeof *job.tet_of, &st);
    if (!st) {
        for (size_t i = 0; i < copy->vert_count; i++) job.tet_of[i] = TL_NONE;
        for (size_t i = 0; i < 4 * original->tet_count; i++) job.used[original->tets[i]] = 1;
        for (size_t i = 0; i < 4 * copy->tet_count; i++)
            job.tet_of[copy->tets[i]] = (tl_lidx)(i / 4);
        st = tli_measure_run(ctx, "vertices", original->vert_count, LOCATE_GRAIN, locate_range,
                             &job);
    }
    tl_mem_free(ctx, job.tet_of);
    tl_mem_free(ctx, job.used);
    return st;
}

tl_status tli_measure_vertices(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                               const tl_locator *copy_locator, const tl_lidx *hints, tl_lidx *tets,
                               double (*weights)[4], double *outside_distance)
{
    tl_status st = TL_OK;
    uint32_t *order = tl_mem_alloc(ctx, original->vert_count, sizeof *order, &st);
    if (!st) st = tli_sort_hilbert(ctx, original->xyz, original->vert_count, order);
    if (!st)
        st = tli_locate_vertices(ctx, original, copy, copy_locator, order, hints, tets, weights,
                                 outside_distance);
    tl_mem_free(ctx, order);
    return st;
}

/* ---- errors at the vertices ---- */

/* Sums of one piece; pieces are added in their order. */
typedef struct channel_sum {
    double squares, max;
    size_t max_at, count, nonfinite;
} channel_sum;

typedef struct channel_job {
    const tl_mesh *copy;
    const tl_channel *channel, *copy_channel;
    const tl_lidx *tets;
    const double (*weights)[4];
    double *errors;
    channel_sum *sums; /* one a piece */
} channel_job;

static double vertex_error(const channel_job *job, size_t v)
{
    const tl_lidx self[4] = {(tl_lidx)v, (tl_lidx)v, (tl_lidx)v, (tl_lidx)v};
    const double whole[4] = {1, 0, 0, 0};
    const tl_lidx *corners = job->copy->tets + 4 * (size_t)job->tets[v];
    tli_tet_point here = tli_tet_point_make(self, whole);
    tli_tet_point there = tli_tet_point_make(corners, job->weights[v]);
    return tli_point_error(job->channel, &here, job->copy_channel, &there);
}

static tl_status channel_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const channel_job *job = arg;
    channel_sum sum = {.max = -1};
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        if (job->errors) job->errors[v] = 0;
        if (job->tets[v] == TL_NONE) continue;
        if (!tli_channel_finite(job->channel, v)) {
            sum.nonfinite++;
            continue;
        }
        double error = vertex_error(job, v);
        if (job->errors) job->errors[v] = error;
        sum.squares += error * error;
        sum.count++;
        if (error > sum.max) {
            sum.max = error;
            sum.max_at = v;
        }
    }
    job->sums[begin / CHANNEL_GRAIN] = sum;
    return TL_OK;
}

tl_status tli_measure_channel(tl_ctx *ctx, const tl_mesh *original, const tl_channel *channel,
                              const tl_mesh *copy, const tl_channel *copy_channel,
                              const tl_lidx *tets, const double (*weights)[4], double *errors,
                              tl_field_error *error)
{
    TL_ASSERT(channel->components == copy_channel->components);
    tl_status st = TL_OK;
    size_t sum_count = original->vert_count / CHANNEL_GRAIN + 1;
    channel_sum *sums = tl_mem_zalloc(ctx, sum_count, sizeof *sums, &st);
    channel_job job = {copy, channel, copy_channel, tets, weights, errors, sums};
    if (!st) st = tli_parallel(ctx, original->vert_count, CHANNEL_GRAIN, channel_range, &job);
    if (!st) {
        channel_sum all = {.max = -1};
        for (size_t i = 0; i < sum_count; i++) {
            all.squares += sums[i].squares;
            all.count += sums[i].count;
            all.nonfinite += sums[i].nonfinite;
            if (sums[i].count == 0 || sums[i].max <= all.max) continue;
            all.max = sums[i].max;
            all.max_at = sums[i].max_at;
        }
        *error = (tl_field_error){.name = channel->name,
                                  .components = channel->components,
                                  .on = channel->on,
                                  .rms = all.count ? sqrt(all.squares / (double)all.count) : 0,
                                  .max = all.count ? all.max : 0,
                                  .max_at = all.max_at,
                                  .nonfinite_count = all.nonfinite};
    }
    tl_mem_free(ctx, sums);
    return st;
}
