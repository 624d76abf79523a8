/* The values of a simplified mesh, once its shape is known. Vertex channels: least squares over the
 * original vertices, by conjugate gradients on the normal equations with the diagonal as
 * preconditioner; a weak pull towards the values before keeps vertices with few originals in place.
 * Tet channels: volume-weighted means. */
#include <math.h>
#include <string.h>

#include "mesh/mesh.h"
#include "simplify/simplify_pack.h"

/* Pull towards the values before: relative to the weight of a vertex's originals, and to that of an
 * original in its place, so that one far from all its originals does not run away. */
static const double PULL = 1e-3, PULL_LEAST = 0.01;
/* Residual, relative to the first one, at which the iteration ends, and steps at most. */
static const double RESIDUAL = 1e-3;
enum { STEPS_MAX = 24 };
/* Fits that follow the first, each with more weight on the vertices whose squared errors are still
 * above this multiple of the mean, and the largest weight. */
enum { STRESS_ROUNDS = 3, STRESS_STEPS = 5 };
static const double STRESS_FROM = 33, STRESS_MAX = 64;
/* Steps of the walk to an original vertex. */
enum { STEPS_WALK = 64 };
/* A weight down to the first counts as on the face; one down to the second at the end of a walk,
 * too. */
static const double ON_FACE = -1e-10, OUTSIDE = -0.25;

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

static double pull_at(const refit *r, size_t i)
{
    return PULL * r->diagonal[i] + PULL_LEAST;
}

/* to = W'W from + pull from over the original vertices, 0 where a vertex is kept. */
static void apply(const refit *r, const float *stress, const double *from, double *to)
{
    const tl_lidx *corners = r->out->tets;
    for (size_t i = 0; i < r->out->vert_count; i++) to[i] = pull_at(r, i) * from[i];
    for (size_t v = 0; v < r->original->vert_count; v++) {
        if (r->tets[v] == TL_NONE) continue;
        const tl_lidx *q = corners + 4 * (size_t)r->tets[v];
        const double *b = r->weights[v];
        double value =
            b[0] * from[q[0]] + b[1] * from[q[1]] + b[2] * from[q[2]] + b[3] * from[q[3]];
        value *= (double)stress[v];
        for (int j = 0; j < 4; j++) to[q[j]] += b[j] * value;
    }
    for (size_t i = 0; i < r->out->vert_count; i++)
        if (r->keep[i]) to[i] = 0;
}

/* Error of the fit at an original vertex, 0 where it is not finite. */
static double error_at(const refit *r, const tl_channel *f, const tl_channel *x, uint32_t k,
                       size_t v)
{
    const tl_lidx *q = r->out->tets + 4 * (size_t)r->tets[v];
    const double *b = r->weights[v];
    double value = 0, want = f->values[v * f->components + k];
    for (int j = 0; j < 4; j++) /* differences first: exactly 0 for a constant */
        value += b[j] * (want - x->values[q[j] * x->components + k]);
    return isfinite(value) ? value : 0;
}

static void first_residual(const refit *r, const float *stress, const tl_channel *f,
                           const tl_channel *x, uint32_t k, double *residual)
{
    memset(residual, 0, r->out->vert_count * sizeof *residual);
    for (size_t v = 0; v < r->original->vert_count; v++) {
        if (r->tets[v] == TL_NONE) continue;
        const tl_lidx *q = r->out->tets + 4 * (size_t)r->tets[v];
        double value = (double)stress[v] * error_at(r, f, x, k, v);
        for (int j = 0; j < 4; j++) residual[q[j]] += r->weights[v][j] * value;
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
static void solve(const refit *r, const float *stress, const tl_channel *f, const tl_channel *x,
                  uint32_t k, int steps, double *room)
{
    size_t n = r->out->vert_count;
    double *change = room, *residual = room + n, *z = room + 2 * n, *p = room + 3 * n,
           *q = room + 4 * n;
    first_residual(r, stress, f, x, k, residual);
    memset(change, 0, n * sizeof *change);
    for (size_t i = 0; i < n; i++) p[i] = z[i] = residual[i] / (r->diagonal[i] + pull_at(r, i));
    double rz = dot(residual, z, n), stop = rz * RESIDUAL * RESIDUAL;
    for (int step = 0; step < steps && rz > stop; step++) {
        apply(r, stress, p, q);
        double pq = dot(p, q, n);
        if (!(pq > 0)) break;
        double alpha = rz / pq;
        for (size_t i = 0; i < n; i++) {
            change[i] += alpha * p[i];
            residual[i] -= alpha * q[i];
            z[i] = residual[i] / (r->diagonal[i] + pull_at(r, i));
        }
        double next = dot(residual, z, n), beta = next / rz;
        rz = next;
        for (size_t i = 0; i < n; i++) p[i] = z[i] + beta * p[i];
    }
    double *values = (double *)(uintptr_t)x->values;
    for (size_t i = 0; i < n; i++)
        if (isfinite(change[i])) values[i * x->components + k] += change[i];
}

/* A vertex whose error is large beside the mean counts more in the next fit, so that the largest
 * errors fall at little cost for the mean. */
static void add_stress(const refit *r, const tl_channel *f, const tl_channel *x, uint32_t k,
                       float *stress)
{
    double sum = 0;
    size_t count = 0;
    for (size_t v = 0; v < r->original->vert_count; v++) {
        if (r->tets[v] == TL_NONE) continue;
        double e = error_at(r, f, x, k, v);
        sum += e * e;
        count++;
    }
    double from = count ? STRESS_FROM * sum / (double)count : 0;
    for (size_t v = 0; from > 0 && v < r->original->vert_count; v++) {
        if (r->tets[v] == TL_NONE) continue;
        double e = error_at(r, f, x, k, v), more = e * e / from;
        if (more > 1) stress[v] = (float)fmin(stress[v] * more, STRESS_MAX);
    }
}

static void fit(const refit *r, const tl_channel *f, const tl_channel *x, uint32_t k, float *stress,
                double *room)
{
    for (size_t v = 0; v < r->original->vert_count; v++) stress[v] = 1;
    solve(r, stress, f, x, k, STEPS_MAX, room);
    for (int i = 0; i < STRESS_ROUNDS; i++) {
        add_stress(r, f, x, k, stress);
        solve(r, stress, f, x, k, STRESS_STEPS, room);
    }
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
    float *stress = tl_mem_alloc(r->ctx, r->original->vert_count, sizeof *stress, &st);
    (void)worker;
    for (size_t want = begin; !st && want < end; want++) {
        size_t at = 0;
        for (size_t i = 0; i < r->original->channel_count; i++) {
            const tl_channel *f = &r->original->channels[i];
            if (!refitted(r, i)) continue;
            if (want < at + f->components)
                fit(r, f, &r->out->channels[i], (uint32_t)(want - at), stress, room);
            if (want < at + f->components) break;
            at += f->components;
        }
    }
    tl_mem_free(r->ctx, stress);
    tl_mem_free(r->ctx, room);
    return st;
}

/* Places of the original vertices in the new mesh, near enough for a fit. */
typedef struct walk_job {
    const tl_mesh *original, *out;
    const tl_lidx *opposite, *hints;
    tl_lidx *tets;
    double (*weights)[4];
} walk_job;

/* Barycentric weights of x in a tet that is not flat. */
static bool weigh(const walk_job *job, tl_lidx tet, const double x[3], double weights[4])
{
    const tl_lidx *q = job->out->tets + 4 * (size_t)tet;
    const double *o = job->out->xyz + 3 * (size_t)q[0];
    double e[4][3], c[3][3];
    for (int j = 0; j < 3; j++) {
        for (int i = 0; i < 3; i++)
            e[i][j] = job->out->xyz[3 * (size_t)q[i + 1] + (size_t)j] - o[j];
        e[3][j] = x[j] - o[j];
    }
    for (int i = 0; i < 3; i++) {
        const double *a = e[(i + 1) % 3], *b = e[(i + 2) % 3];
        c[i][0] = a[1] * b[2] - a[2] * b[1];
        c[i][1] = a[2] * b[0] - a[0] * b[2];
        c[i][2] = a[0] * b[1] - a[1] * b[0];
    }
    double det = e[0][0] * c[0][0] + e[0][1] * c[0][1] + e[0][2] * c[0][2];
    if (!(det > 0)) return false;
    for (int i = 0; i < 3; i++)
        weights[i + 1] = (e[3][0] * c[i][0] + e[3][1] * c[i][1] + e[3][2] * c[i][2]) / det;
    weights[0] = 1 - weights[1] - weights[2] - weights[3];
    return true;
}

/* Walks to the tet that holds x. Where the walk ends at the boundary, or for lack of steps, the
 * least weight may be a little negative. TL_NONE when x is too far outside. */
static tl_lidx walk(const walk_job *job, const double x[3], tl_lidx tet, double weights[4])
{
    for (int step = 0; step < STEPS_WALK; step++) {
        if (!weigh(job, tet, x, weights)) return TL_NONE;
        int way = -1, least = 0;
        for (int i = 0; i < 4; i++) {
            if (weights[i] < weights[least]) least = i;
            if (weights[i] < 0 && job->opposite[4 * (size_t)tet + (size_t)i] != TL_NONE &&
                (way < 0 || weights[i] < weights[way]))
                way = i;
        }
        if (weights[least] > ON_FACE) return tet;
        if (way < 0) return weights[least] > OUTSIDE ? tet : TL_NONE;
        tet = job->opposite[4 * (size_t)tet + (size_t)way] / 4;
    }
    return TL_NONE;
}

static tl_status place_originals(void *arg, size_t begin, size_t end, unsigned worker)
{
    const walk_job *job = arg;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        const double *x = job->original->xyz + 3 * v;
        bool fine = job->hints[v] != TL_NONE && isfinite(x[0] + x[1] + x[2]);
        job->tets[v] = fine ? walk(job, x, job->hints[v], job->weights[v]) : TL_NONE;
    }
    return TL_OK;
}

tl_status tli_refit(tl_ctx *ctx, const tl_mesh *original, tl_mesh *out, const tl_lidx *opposite,
                    const tl_lidx *hints, const uint8_t *keep, const uint8_t *held)
{
    tl_status st = TL_OK;
    size_t components = 0;
    tl_lidx *tets = tl_mem_alloc(ctx, original->vert_count, sizeof *tets, &st);
    double(*weights)[4] = tl_mem_alloc(ctx, original->vert_count, sizeof *weights, &st);
    refit r = {ctx, original, out, tets, (const double(*)[4])weights, keep, held, NULL};
    r.diagonal = tl_mem_zalloc(ctx, out->vert_count, sizeof *r.diagonal, &st);
    walk_job job = {original, out, opposite, hints, tets, weights};
    if (!st) st = tli_parallel(ctx, original->vert_count, 8192, place_originals, &job);
    if (st) goto done;
    for (size_t v = 0; v < original->vert_count; v++)
        for (int j = 0; tets[v] != TL_NONE && j < 4; j++)
            r.diagonal[out->tets[4 * (size_t)tets[v] + (size_t)j]] += weights[v][j] * weights[v][j];
    for (size_t i = 0; i < original->channel_count; i++)
        if (refitted(&r, i)) components += original->channels[i].components;
    st = tli_parallel(ctx, components, 1, refit_component, &r);
done:
    tl_mem_free(ctx, r.diagonal);
    tl_mem_free(ctx, weights);
    tl_mem_free(ctx, tets);
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
