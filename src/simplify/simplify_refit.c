/* The values of a simplified mesh, once its shape is known. Vertex channels: least squares over the
 * original vertices, by conjugate gradients on the normal equations with the diagonal as
 * preconditioner; a weak pull towards the values before keeps vertices with few originals in place.
 * Tet channels: volume-weighted means. */
#include <math.h>
#include <string.h>

#include "mesh/mesh.h"
#include "simplify/simplify_pack.h"

/* Pull towards the values before, relative to the weight of a vertex's originals. */
static const double PULL = 1e-3;
/* Residual, relative to the first one, at which the iteration ends, and steps at most. */
static const double RESIDUAL = 1e-3;
enum { STEPS_MAX = 24 };

typedef struct refit {
    tl_ctx *ctx;
    const tl_mesh *original;
    tl_mesh *out;
    const tl_lidx *tets;
    const double (*weights)[4];
    const uint8_t *keep; /* [out vertices] */
    const uint8_t *held; /* [channels] */
    double *diagonal;    /* [out vertices] */
} refit;

/* to = W'W from + PULL D from over the original vertices, 0 where a vertex is kept. */
static void apply(const refit *r, const double *from, double *to)
{
    const tl_lidx *corners = r->out->tets;
    for (size_t i = 0; i < r->out->vert_count; i++) to[i] = PULL * r->diagonal[i] * from[i];
    for (size_t v = 0; v < r->original->vert_count; v++) {
        if (r->tets[v] == TL_NONE) continue;
        const tl_lidx *q = corners + 4 * (size_t)r->tets[v];
        const double *b = r->weights[v];
        double value =
            b[0] * from[q[0]] + b[1] * from[q[1]] + b[2] * from[q[2]] + b[3] * from[q[3]];
        for (int j = 0; j < 4; j++) to[q[j]] += b[j] * value;
    }
    for (size_t i = 0; i < r->out->vert_count; i++)
        if (r->keep[i]) to[i] = 0;
}

/* residual = W'(f - W x); false when a value is not finite anywhere. */
static void first_residual(const refit *r, const tl_channel *f, const tl_channel *x, uint32_t k,
                           double *residual)
{
    memset(residual, 0, r->out->vert_count * sizeof *residual);
    for (size_t v = 0; v < r->original->vert_count; v++) {
        if (r->tets[v] == TL_NONE) continue;
        const tl_lidx *q = r->out->tets + 4 * (size_t)r->tets[v];
        const double *b = r->weights[v];
        double value = 0, want = f->values[v * f->components + k];
        for (int j = 0; j < 4; j++) /* differences first: exactly 0 for a constant */
            value += b[j] * (want - x->values[q[j] * x->components + k]);
        if (!isfinite(value)) continue;
        for (int j = 0; j < 4; j++) residual[q[j]] += b[j] * value;
    }
    for (size_t i = 0; i < r->out->vert_count; i++)
        if (r->keep[i]) residual[i] = 0;
}

static double dot(const double *a, const double *b, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) sum += a[i] * b[i];
    return sum;
}

/* Conjugate gradients for the change of one component; room holds five vectors. */
static void solve(const refit *r, const tl_channel *f, const tl_channel *x, uint32_t k,
                  double *room)
{
    size_t n = r->out->vert_count;
    double *change = room, *residual = room + n, *z = room + 2 * n, *p = room + 3 * n,
           *q = room + 4 * n;
    first_residual(r, f, x, k, residual);
    memset(change, 0, n * sizeof *change);
    for (size_t i = 0; i < n; i++)
        p[i] = z[i] = r->diagonal[i] > 0 ? residual[i] / r->diagonal[i] : 0;
    double rz = dot(residual, z, n), stop = rz * RESIDUAL * RESIDUAL;
    for (int step = 0; step < STEPS_MAX && rz > stop; step++) {
        apply(r, p, q);
        double pq = dot(p, q, n);
        if (!(pq > 0)) break;
        double alpha = rz / pq;
        for (size_t i = 0; i < n; i++) {
            change[i] += alpha * p[i];
            residual[i] -= alpha * q[i];
            z[i] = r->diagonal[i] > 0 ? residual[i] / r->diagonal[i] : 0;
        }
        double next = dot(residual, z, n), beta = next / rz;
        rz = next;
        for (size_t i = 0; i < n; i++) p[i] = z[i] + beta * p[i];
    }
    double *values = (double *)(uintptr_t)x->values;
    for (size_t i = 0; i < n; i++)
        if (isfinite(change[i])) values[i * x->components + k] += change[i];
}

static bool refitted(const refit *r, size_t channel)
{
    return r->original->channels[channel].on == TL_ON_VERTEX && !r->held[channel];
}

static tl_status refit_component(void *arg, size_t begin, size_t end, unsigned worker)
{
    const refit *r = arg;
    tl_status st = TL_OK;
    double *room = tl_mem_alloc(r->ctx, r->out->vert_count, 5 * sizeof *room, &st);
    (void)worker;
    for (size_t want = begin; !st && want < end; want++) {
        size_t at = 0;
        for (size_t i = 0; i < r->original->channel_count; i++) {
            const tl_channel *f = &r->original->channels[i];
            if (!refitted(r, i)) continue;
            if (want < at + f->components)
                solve(r, f, &r->out->channels[i], (uint32_t)(want - at), room);
            if (want < at + f->components) break;
            at += f->components;
        }
    }
    tl_mem_free(r->ctx, room);
    return st;
}

tl_status tli_refit(tl_ctx *ctx, const tl_mesh *original, tl_mesh *out, const tl_lidx *tets,
                    const double (*weights)[4], const uint8_t *keep, const uint8_t *held)
{
    tl_status st = TL_OK;
    size_t components = 0;
    refit r = {ctx, original, out, tets, weights, keep, held, NULL};
    r.diagonal = tl_mem_zalloc(ctx, out->vert_count, sizeof *r.diagonal, &st);
    if (st) return st;
    for (size_t v = 0; v < original->vert_count; v++)
        for (int j = 0; tets[v] != TL_NONE && j < 4; j++)
            r.diagonal[out->tets[4 * (size_t)tets[v] + (size_t)j]] += weights[v][j] * weights[v][j];
    for (size_t i = 0; i < original->channel_count; i++)
        if (refitted(&r, i)) components += original->channels[i].components;
    st = tli_parallel(ctx, components, 1, refit_component, &r);
    tl_mem_free(ctx, r.diagonal);
    return st;
}

/* ---- tet channels ---- */

/* The tet of out that holds the centroid of each original tet. */
typedef struct centroid_job {
    const tl_mesh *original;
    const tl_locator *locator;
    const tl_lidx *hints;
    tl_lidx *holders;
    double *volumes;
} centroid_job;

static tl_status locate_centroids(void *arg, size_t begin, size_t end, unsigned worker)
{
    centroid_job *job = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = job->original->tets + 4 * t;
        double p[4][3], x[3], weights[4], distance;
        for (int i = 0; i < 4; i++)
            memcpy(p[i], job->original->xyz + 3 * (size_t)q[i], sizeof p[i]);
        for (int j = 0; j < 3; j++) x[j] = (p[0][j] + p[1][j] + p[2][j] + p[3][j]) / 4;
        double volume = fabs(tl_tet_volume((const double(*)[3])p));
        bool finite = isfinite(x[0] + x[1] + x[2]);
        job->volumes[t] = finite && isfinite(volume) ? volume : 0;
        job->holders[t] =
            finite ? tl_locator_nearest(job->locator, x, job->hints[q[0]], weights, &distance)
                   : TL_NONE;
    }
    return TL_OK;
}

static void average(const centroid_job *job, const tl_channel *from, const tl_channel *to,
                    size_t count, double *sums, double *weights)
{
    uint32_t k = to->components;
    memset(sums, 0, count * k * sizeof *sums);
    memset(weights, 0, count * sizeof *weights);
    for (size_t t = 0; t < job->original->tet_count; t++) {
        tl_lidx h = job->holders[t];
        bool finite = h != TL_NONE;
        for (uint32_t j = 0; finite && j < k; j++) finite = isfinite(from->values[t * k + j]);
        if (!finite) continue;
        weights[h] += job->volumes[t];
        for (uint32_t j = 0; j < k; j++)
            sums[(size_t)h * k + j] += job->volumes[t] * from->values[t * k + j];
    }
    double *values = (double *)(uintptr_t)to->values;
    for (size_t h = 0; h < count; h++)
        for (uint32_t j = 0; weights[h] > 0 && j < k; j++)
            values[h * k + j] = sums[h * k + j] / weights[h];
}

tl_status tli_average_tets(tl_ctx *ctx, const tl_mesh *original, tl_mesh *out,
                           const tl_locator *locator, const tl_lidx *hints)
{
    tl_status st = TL_OK;
    centroid_job job = {original, locator, hints, NULL, NULL};
    uint32_t widest = 0;
    for (size_t i = 0; i < out->channel_count; i++) {
        const tl_channel *c = &out->channels[i];
        if (c->on == TL_ON_TET && c->scalar >= TL_F32 && c->components > widest)
            widest = c->components;
    }
    if (!widest) return TL_OK;
    job.holders = tl_mem_alloc(ctx, original->tet_count, sizeof *job.holders, &st);
    job.volumes = tl_mem_alloc(ctx, original->tet_count, sizeof *job.volumes, &st);
    double *sums = tl_mem_alloc(ctx, out->tet_count, widest * sizeof *sums, &st);
    double *weights = tl_mem_alloc(ctx, out->tet_count, sizeof *weights, &st);
    if (!st) st = tli_parallel(ctx, original->tet_count, 16384, locate_centroids, &job);
    for (size_t i = 0; !st && i < out->channel_count; i++)
        if (out->channels[i].on == TL_ON_TET && out->channels[i].scalar >= TL_F32)
            average(&job, &original->channels[i], &out->channels[i], out->tet_count, sums, weights);
    tl_mem_free(ctx, weights);
    tl_mem_free(ctx, sums);
    tl_mem_free(ctx, job.volumes);
    tl_mem_free(ctx, job.holders);
    return st;
}
