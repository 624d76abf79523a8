/* The field error of all common channels: at the original's vertices (Sondershaus 2007, 4.2.5), at
 * the centroids of its tets for channels on tets, and as a mean over its volume (3.1.1).
 *
 * The mean is an integral by the 4-point Gauss rule of degree 2 on each original tet. Tets are
 * visited in the order of the Hilbert ranks of their first vertices, so that nearly all points lie
 * in the tet of the point before or next to it: that tet's affine map is kept. */
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "base/base_vec.h"
#include "measure/measure.h"

enum {
    GAUSS_COUNT = 4,
    CENTROID = GAUSS_COUNT, /* the point after the Gauss points */
    POINT_COUNT,
    TET_GRAIN = 2048 /* tets whose errors are summed on their own */
};

/* (5 + 3 sqrt 5) / 20 and (5 - sqrt 5) / 20 */
static const double GAUSS_NEAR = 0.58541019662496845446, GAUSS_FAR = 0.13819660112501051518;

/* Relative to the cube of the longest edge: six times the volume below which a tet's affine map is
 * not trusted to tell inside from outside. */
static const double CACHE_VOLUME_MIN = 1e-9;
/* Relative to the original's diagonal: what rounding alone may put a vertex outside. */
static const double OUTSIDE_SLACK = 1e-9;

/* The affine map of the copy's tet that held the last point. */
typedef struct tet_cache {
    tl_lidx tet;
    bool usable;
    double origin[3], rows[3][3];
} tet_cache;

/* Sums of one piece for one channel; pieces are added in their order. */
typedef struct tet_sum {
    double integral, volume; /* of the tets with finite values */
    double squares, max;     /* at the centroids */
    size_t max_at, count, nonfinite;
} tet_sum;

/* A channel of both meshes. */
typedef struct field_pair {
    const tl_channel *original, *copy;
    bool has_nonfinite; /* the original's */
} field_pair;

typedef struct field_job {
    const tl_mesh *original, *copy;
    const tl_locator *locator;
    field_pair *pairs;
    size_t pair_count;
    bool any_on_tets;
    uint32_t *tet_order;  /* [original tet_count] */
    tl_lidx *tets;        /* [original vert_count] tet of the copy at each vertex */
    double (*weights)[4]; /* [original vert_count] */
    double *distances;    /* [original vert_count] */
    tet_sum *sums;        /* [pieces][pair_count] */
} field_job;

/* ---- location of points ---- */

static void cache_set(tet_cache *cache, const tl_mesh *mesh, tl_lidx tet)
{
    const tl_lidx *corners = mesh->tets + 4 * (size_t)tet;
    const double *p = mesh->xyz + 3 * (size_t)corners[0];
    double e[3][3], longest = 0;
    for (int i = 0; i < 3; i++) {
        const double *q = mesh->xyz + 3 * (size_t)corners[i + 1];
        for (int k = 0; k < 3; k++) e[i][k] = q[k] - p[k];
        longest = fmax(longest, vec_dot(e[i], e[i]));
    }
    for (int i = 0; i < 3; i++) vec_cross(e[(i + 1) % 3], e[(i + 2) % 3], cache->rows[i]);
    double volume6 = vec_dot(e[0], cache->rows[0]);
    cache->tet = tet;
    cache->usable = volume6 > CACHE_VOLUME_MIN * longest * sqrt(longest);
    if (!cache->usable) return;
    memcpy(cache->origin, p, sizeof cache->origin);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) cache->rows[i][k] /= volume6;
}

static bool cache_holds(const tet_cache *cache, const double x[3], double weights[4])
{
    if (!cache->usable) return false;
    const double d[3] = {x[0] - cache->origin[0], x[1] - cache->origin[1], x[2] - cache->origin[2]};
    for (int i = 0; i < 3; i++) weights[i + 1] = vec_dot(cache->rows[i], d);
    weights[0] = 1 - (weights[1] + weights[2] + weights[3]);
    return weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0 && weights[3] >= 0;
}

/* The copy's tet of the same number, if its corners are in the same places: it then holds all
 * points of the original's, flat or not, with the same weights. */
static bool same_tet(const field_job *job, size_t tet)
{
    if (tet >= job->copy->tet_count) return false;
    for (size_t i = 0; i < 4; i++) {
        const double *x = job->original->xyz + 3 * (size_t)job->original->tets[4 * tet + i];
        const double *y = job->copy->xyz + 3 * (size_t)job->copy->tets[4 * tet + i];
        if (x[0] != y[0] || x[1] != y[1] || x[2] != y[2]) return false;
    }
    return true;
}

/* Where the points of original tet with these weights lie in the copy. */
static void locate_points(const field_job *job, tet_cache *cache, size_t tet,
                          const double weights[][4], int count, tl_lidx holders[],
                          tli_tet_point points[])
{
    bool same = same_tet(job, tet);
    const tl_lidx *corners = job->original->tets + 4 * tet;
    for (int n = 0; n < count; n++) {
        double x[3] = {0, 0, 0}, found[4], distance;
        const double *place = weights[n];
        if (same) {
            holders[n] = (tl_lidx)tet;
        } else {
            for (size_t i = 0; i < 4; i++)
                for (size_t k = 0; k < 3; k++)
                    x[k] += weights[n][i] * job->original->xyz[3 * (size_t)corners[i] + k];
            if (!cache_holds(cache, x, found)) {
                tl_lidx holder = tl_locator_nearest(job->locator, x, cache->tet, found, &distance);
                cache_set(cache, job->copy, holder);
            }
            holders[n] = cache->tet;
            place = found;
        }
        points[n] = tli_tet_point_make(job->copy->tets + 4 * (size_t)holders[n], place);
    }
}

/* ---- errors over tets ---- */

static void point_weights(double weights[POINT_COUNT][4])
{
    for (int n = 0; n < GAUSS_COUNT; n++)
        for (int i = 0; i < 4; i++) weights[n][i] = i == n ? GAUSS_NEAR : GAUSS_FAR;
    for (int i = 0; i < 4; i++) weights[CENTROID][i] = 0.25;
}

/* The errors at the Gauss points of a tet. One without volume has no part in the integral, not even
 * where an error is infinite. */
static void add_integral(const double errors[GAUSS_COUNT], double volume, tet_sum *sum)
{
    if (!(volume > 0)) return;
    double total = 0;
    for (int n = 0; n < GAUSS_COUNT; n++) total += errors[n];
    sum->integral += total * (volume / GAUSS_COUNT);
    sum->volume += volume;
}

static void add_vertex_channel(const field_pair *pair, const tli_tet_point here[],
                               const tli_tet_point there[], double volume, tet_sum *sum)
{
    if (pair->has_nonfinite)
        for (int i = 0; i < 4; i++)
            if (!tli_channel_finite(pair->original, here[0].corners[i])) return;
    double errors[GAUSS_COUNT];
    for (int n = 0; n < GAUSS_COUNT; n++)
        errors[n] = tli_point_error(pair->original, &here[n], pair->copy, &there[n]);
    add_integral(errors, volume, sum);
}

/* A channel on tets at a point is that of the tet: a point with all weight on one "corner". */
static double tet_error(const field_pair *pair, tl_lidx tet, tl_lidx copy_tet)
{
    const double whole[4] = {1, 0, 0, 0};
    tli_tet_point here = tli_tet_point_make((tl_lidx[4]){tet, tet, tet, tet}, whole);
    tli_tet_point there =
        tli_tet_point_make((tl_lidx[4]){copy_tet, copy_tet, copy_tet, copy_tet}, whole);
    return tli_point_error(pair->original, &here, pair->copy, &there);
}

static void add_tet_channel(const field_pair *pair, tl_lidx tet, const tl_lidx holders[],
                            double volume, tet_sum *sum)
{
    if (!tli_channel_finite(pair->original, tet)) {
        sum->nonfinite++;
        return;
    }
    double errors[GAUSS_COUNT];
    for (int n = 0; n < GAUSS_COUNT; n++) errors[n] = tet_error(pair, tet, holders[n]);
    add_integral(errors, volume, sum);
    double error = tet_error(pair, tet, holders[CENTROID]);
    sum->squares += error * error;
    sum->count++;
    if (error < sum->max || (error == sum->max && tet > sum->max_at)) return;
    sum->max = error;
    sum->max_at = tet;
}

static double tet_volume(const tl_mesh *mesh, size_t tet)
{
    double p[4][3];
    tli_tet_corners(mesh->xyz, mesh->tets + 4 * tet, p);
    return fabs(tl_tet_volume(TLI_CORNERS(p)));
}

static tl_status tets_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const field_job *job = arg;
    tet_sum *sums = job->sums + begin / TET_GRAIN * job->pair_count;
    double weights[POINT_COUNT][4];
    tli_tet_point here[GAUSS_COUNT], there[POINT_COUNT];
    tl_lidx holders[POINT_COUNT];
    tet_cache cache = {.tet = TL_NONE};
    (void)worker;
    point_weights(weights);
    for (size_t j = 0; j < job->pair_count; j++) sums[j] = (tet_sum){.max = -1};
    for (size_t i = begin; i < end; i++) {
        size_t tet = job->tet_order[i];
        const tl_lidx *corners = job->original->tets + 4 * tet;
        if (cache.tet == TL_NONE) cache.tet = job->tets[corners[0]];
        double volume = tet_volume(job->original, tet);
        locate_points(job, &cache, tet, (const double(*)[4])weights,
                      job->any_on_tets ? POINT_COUNT : GAUSS_COUNT, holders, there);
        for (int n = 0; n < GAUSS_COUNT; n++) here[n] = tli_tet_point_make(corners, weights[n]);
        for (size_t j = 0; j < job->pair_count; j++) {
            const field_pair *pair = &job->pairs[j];
            if (pair->original->on == TL_ON_VERTEX)
                add_vertex_channel(pair, here, there, volume, &sums[j]);
            else
                add_tet_channel(pair, (tl_lidx)tet, holders, volume, &sums[j]);
        }
    }
    return TL_OK;
}

/* Adds up the pieces of channel j; fields that tli_measure_channel has filled stay. */
static void finish_channel(const field_job *job, size_t j, size_t piece_count,
                           tl_field_error *field)
{
    const tl_channel *channel = job->pairs[j].original;
    tet_sum all = {.max = -1};
    for (size_t i = 0; i < piece_count; i++) {
        const tet_sum *sum = &job->sums[i * job->pair_count + j];
        all.integral += sum->integral;
        all.volume += sum->volume;
        all.squares += sum->squares;
        all.count += sum->count;
        all.nonfinite += sum->nonfinite;
        if (sum->max < all.max || (sum->max == all.max && sum->max_at >= all.max_at)) continue;
        all.max = sum->max;
        all.max_at = sum->max_at;
    }
    field->mean = all.volume > 0 ? all.integral / all.volume : 0;
    if (channel->on == TL_ON_VERTEX) return;
    field->name = channel->name;
    field->components = channel->components;
    field->on = channel->on;
    field->rms = all.count ? sqrt(all.squares / (double)all.count) : 0;
    field->max = all.count ? all.max : 0;
    field->max_at = all.count ? all.max_at : 0;
    field->nonfinite_count = all.nonfinite;
}

/* ---- driver ---- */

static const tl_channel *find_partner(const tl_mesh *copy, const tl_channel *channel)
{
    for (size_t i = 0; i < copy->channel_count; i++) {
        const tl_channel *other = &copy->channels[i];
        if (other->on == channel->on && other->components == channel->components &&
            strcmp(other->name, channel->name) == 0)
            return other;
    }
    return NULL;
}

static tl_status pair_channels(tl_ctx *ctx, field_job *job, tl_field_error **fields)
{
    tl_status st = TL_OK;
    const tl_mesh *original = job->original;
    job->pairs = tl_mem_alloc(ctx, original->channel_count, sizeof *job->pairs, &st);
    *fields = tl_mem_zalloc(ctx, original->channel_count, sizeof **fields, &st);
    for (size_t i = 0; !st && i < original->channel_count; i++) {
        const tl_channel *channel = &original->channels[i];
        const tl_channel *partner = find_partner(job->copy, channel);
        if (!partner) {
            tl_log(ctx, TL_LOG_INFO, "channel '%s' is not compared: the copy has none like it",
                   channel->name);
            continue;
        }
        tl_field_error *field = &(*fields)[job->pair_count];
        size_t count = channel->on == TL_ON_VERTEX ? original->vert_count : original->tet_count;
        size_t nonfinite = 0;
        tl_channel_range(channel, count, field->range, &nonfinite);
        job->pairs[job->pair_count++] = (field_pair){channel, partner, nonfinite > 0};
        job->any_on_tets = job->any_on_tets || channel->on == TL_ON_TET;
    }
    return st;
}

/* Counting sort of the tets by the rank of their first vertex along the curve. */
static tl_status order_tets(tl_ctx *ctx, const tl_mesh *mesh, const uint32_t *vert_order,
                            uint32_t *tet_order)
{
    tl_status st = TL_OK;
    size_t vert_count = mesh->vert_count;
    uint32_t *rank = tl_mem_alloc(ctx, vert_count, sizeof *rank, &st);
    uint32_t *slots = tl_mem_zalloc(ctx, vert_count + 1, sizeof *slots, &st);
    if (!st) {
        for (size_t i = 0; i < vert_count; i++) rank[vert_order[i]] = (uint32_t)i;
        for (size_t t = 0; t < mesh->tet_count; t++) slots[rank[mesh->tets[4 * t]] + 1]++;
        for (size_t i = 0; i < vert_count; i++) slots[i + 1] += slots[i];
        for (size_t t = 0; t < mesh->tet_count; t++)
            tet_order[slots[rank[mesh->tets[4 * t]]]++] = (uint32_t)t;
    }
    tl_mem_free(ctx, slots);
    tl_mem_free(ctx, rank);
    return st;
}

static void count_outside(const field_job *job, double diagonal, tl_compare_result *result)
{
    for (size_t v = 0; v < job->original->vert_count; v++) {
        if (job->distances[v] > OUTSIDE_SLACK * diagonal) result->outside_vertices++;
        result->outside_distance = fmax(result->outside_distance, job->distances[v]);
    }
}

static tl_status measure_vertex_channels(tl_ctx *ctx, const field_job *job, tl_field_error *fields)
{
    tl_status st = TL_OK;
    for (size_t j = 0; !st && j < job->pair_count; j++) {
        const field_pair *pair = &job->pairs[j];
        if (pair->original->on != TL_ON_VERTEX) continue;
        double range[2] = {fields[j].range[0], fields[j].range[1]};
        st = tli_measure_channel(ctx, job->original, pair->original, job->copy, pair->copy,
                                 job->tets, (const double(*)[4])job->weights, NULL, &fields[j]);
        memcpy(fields[j].range, range, sizeof range);
    }
    return st;
}

static tl_status measure_tets(tl_ctx *ctx, field_job *job, const uint32_t *vert_order,
                              tl_field_error *fields)
{
    if (job->pair_count == 0) return TL_OK;
    tl_status st = TL_OK;
    size_t piece_count = (job->original->tet_count + TET_GRAIN - 1) / TET_GRAIN, sum_count = 0;
    if (!tli_mul_size(piece_count, job->pair_count, &sum_count))
        return tl_fail(ctx, TL_ERR_MEMORY, "%zu channels of %zu tets are too many to compare",
                       job->pair_count, job->original->tet_count);
    job->tet_order = tl_mem_alloc(ctx, job->original->tet_count, sizeof *job->tet_order, &st);
    job->sums = tl_mem_alloc(ctx, sum_count, sizeof *job->sums, &st);
    if (!st) st = order_tets(ctx, job->original, vert_order, job->tet_order);
    if (!st)
        st = tli_measure_run(ctx, "field", job->original->tet_count, TET_GRAIN, tets_range, job);
    for (size_t j = 0; !st && j < job->pair_count; j++)
        finish_channel(job, j, piece_count, &fields[j]);
    tl_mem_free(ctx, job->sums);
    tl_mem_free(ctx, job->tet_order);
    return st;
}

tl_status tli_measure_fields(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                             const tl_lidx *opposite, double diagonal, tl_compare_result *result)
{
    tl_status st = TL_OK;
    tl_locator *locator = NULL;
    field_job job = {.original = original, .copy = copy};
    size_t vert_count = original->vert_count;
    uint32_t *order = tl_mem_alloc(ctx, vert_count, sizeof *order, &st);
    job.tets = tl_mem_alloc(ctx, vert_count, sizeof *job.tets, &st);
    job.weights = tl_mem_alloc(ctx, vert_count, sizeof *job.weights, &st);
    job.distances = tl_mem_alloc(ctx, vert_count, sizeof *job.distances, &st);
    if (!st) st = pair_channels(ctx, &job, &result->fields);
    if (!st) st = tl_locator_create(ctx, copy, opposite, &locator);
    job.locator = locator;
    if (!st) st = tli_sort_hilbert(ctx, original->xyz, vert_count, order);
    if (!st)
        st = tli_locate_vertices(ctx, original, copy, locator, order, NULL, job.tets, job.weights,
                                 job.distances);
    if (!st) count_outside(&job, diagonal, result);
    if (!st) st = measure_vertex_channels(ctx, &job, result->fields);
    if (!st) st = measure_tets(ctx, &job, order, result->fields);
    if (!st) result->field_count = job.pair_count;
    tl_locator_destroy(locator);
    tl_mem_free(ctx, job.pairs);
    tl_mem_free(ctx, job.distances);
    tl_mem_free(ctx, job.weights);
    tl_mem_free(ctx, job.tets);
    tl_mem_free(ctx, order);
    return st;
}
