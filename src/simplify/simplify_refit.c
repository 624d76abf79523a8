/* The values of a simplified mesh, once its shape is known. Vertex channels: least squares over the
 * original vertices, then again with more weight on large errors. Tet channels: volume-weighted
 * means. */
#include <math.h>
#include <string.h>

#include "mesh/mesh.h"
#include "simplify/simplify_normal.h"
#include "simplify/simplify_pack.h"

/* Steps of the first fit. */
enum { STEPS_MAX = 24 };
/* Fits that follow the first, each with more weight on the vertices whose squared errors are still
 * above this multiple of the mean, and the largest weight. */
enum { STRESS_ROUNDS = 3, STRESS_STEPS = 5 };
static const double STRESS_FROM = 33, STRESS_MAX = 64;
/* Tets of a piece of work. */
enum { ERROR_TETS = 8192 };
/* Steps of the walk to an original vertex. */
enum { STEPS_WALK = 64 };
/* A weight down to the first counts as on the face; one down to the second at the end of a walk,
 * too. */
static const double ON_FACE = -1e-10, OUTSIDE = -0.25;

/* Places of the original vertices in the new mesh, near enough for a fit. */
typedef struct walk_job {
    const tli_work *work;
    const tl_mesh *original, *out;
    const tl_lidx *opposite, *hints;
    tl_lidx *tets; /* [original vertices] */
    tli_samples *samples;
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

/* Walks to the tet that holds x. Where the walk ends at the boundary the least weight may be down
 * to outside. TL_NONE when x is farther outside, or for lack of steps. */
static tl_lidx walk(const walk_job *job, const double x[3], tl_lidx tet, double outside,
                    double weights[4])
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
        if (way < 0) return weights[least] > outside ? tet : TL_NONE;
        tet = job->opposite[4 * (size_t)tet + (size_t)way] / 4;
    }
    return TL_NONE;
}

/* In the order of the working mesh, where the tet of one vertex is near the next one, unless the
 * boundary is between them. */
static tl_status place_originals(void *arg, size_t begin, size_t end, unsigned worker)
{
    const walk_job *job = arg;
    tl_lidx near = TL_NONE;
    double weights[4];
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        tl_lidx v = job->work->verts[i].origin;
        const double *x = job->original->xyz + 3 * (size_t)v;
        bool fine = job->hints[v] != TL_NONE && isfinite(x[0] + x[1] + x[2]);
        job->tets[v] = TL_NONE;
        if (fine && near != TL_NONE) job->tets[v] = walk(job, x, near, ON_FACE, weights);
        if (fine && job->tets[v] == TL_NONE)
            job->tets[v] = walk(job, x, job->hints[v], OUTSIDE, weights);
        if (job->tets[v] != TL_NONE) near = job->tets[v];
    }
    return TL_OK;
}

static tl_status weigh_samples(void *arg, size_t begin, size_t end, unsigned worker)
{
    const walk_job *job = arg;
    tli_samples *s = job->samples;
    (void)worker;
    for (size_t t = begin; t < end; t++)
        for (uint32_t k = s->starts[t]; k < s->starts[t + 1]; k++)
            weigh(job, (tl_lidx)t, job->original->xyz + 3 * (size_t)s->origins[k], s->weights[k]);
    return TL_OK;
}

/* A counting sort of the original vertices by tet. */
static tl_status sort_samples(const walk_job *job, tl_ctx *ctx)
{
    tl_status st = TL_OK;
    tli_samples *s = job->samples;
    size_t verts = job->original->vert_count, tets = job->out->tet_count;
    s->starts = tl_mem_zalloc(ctx, tets + 2, sizeof *s->starts, &st);
    if (st) return st;
    for (size_t v = 0; v < verts; v++)
        if (job->tets[v] != TL_NONE) s->starts[job->tets[v] + 2]++;
    for (size_t t = 2; t < tets + 2; t++) s->starts[t] += s->starts[t - 1];
    s->count = s->starts[tets + 1];
    s->origins = tl_mem_alloc(ctx, s->count, sizeof *s->origins, &st);
    for (size_t v = 0; !st && v < verts; v++)
        if (job->tets[v] != TL_NONE) s->origins[s->starts[job->tets[v] + 1]++] = (tl_lidx)v;
    return st;
}

static tl_status make_samples(tl_ctx *ctx, walk_job *job)
{
    tl_status st = TL_OK;
    tli_samples *s = job->samples;
    job->tets = tl_mem_alloc(ctx, job->original->vert_count, sizeof *job->tets, &st);
    if (!st) st = tli_parallel(ctx, job->original->vert_count, 2048, place_originals, job);
    if (!st) st = sort_samples(job, ctx);
    tl_mem_free(ctx, job->tets);
    s->weights = tl_mem_alloc(ctx, s->count, sizeof *s->weights, &st);
    if (!st) st = tli_parallel(ctx, job->out->tet_count, 8192, weigh_samples, job);
    return st;
}

/* ---- one component of a channel ---- */

typedef struct refit {
    tli_normal normal;
    const tl_channel *from, *to; /* of the original and of the new mesh */
    uint32_t component;
    double *sums; /* of squared errors, one a piece */
} refit;

/* Errors at all samples, 0 where they are not finite. */
static tl_status set_errors(void *arg, size_t begin, size_t end, unsigned worker)
{
    const refit *r = arg;
    const tli_samples *s = r->normal.samples;
    uint32_t k = r->component, m = r->from->components;
    double sum = 0;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = r->normal.mesh->tets + 4 * t;
        for (uint32_t i = s->starts[t]; i < s->starts[t + 1]; i++) {
            double e = 0, want = r->from->values[(size_t)s->origins[i] * m + k];
            for (int j = 0; j < 4; j++) /* differences first: exactly 0 for a constant */
                e += s->weights[i][j] * (want - r->to->values[(size_t)q[j] * m + k]);
            r->normal.errors[i] = isfinite(e) ? e : 0;
            sum += r->normal.errors[i] * r->normal.errors[i];
        }
    }
    r->sums[begin / ERROR_TETS] = sum;
    return TL_OK;
}

/* A vertex whose error is large beside the mean counts more in the next fit, so that the largest
 * errors fall at little cost for the mean. */
static void add_stress(refit *r)
{
    const tli_samples *s = r->normal.samples;
    size_t tets = r->normal.mesh->tet_count;
    double sum = 0;
    for (size_t i = 0; i * ERROR_TETS < tets; i++) sum += r->sums[i];
    double from = s->count ? STRESS_FROM * sum / (double)s->count : 0;
    for (size_t t = 0; from > 0 && t < tets; t++)
        for (uint32_t i = s->starts[t]; i < s->starts[t + 1]; i++) {
            double e = r->normal.errors[i], more = e * e / from;
            if (!(more > 1)) continue;
            double stress = fmin((double)r->normal.stress[i] * more, STRESS_MAX);
            tli_normal_set_stress(&r->normal, t, i, (float)stress);
        }
}

static tl_status fit(tl_ctx *ctx, refit *r)
{
    tl_status st = TL_OK;
    size_t verts = r->normal.mesh->vert_count;
    double *values = (double *)(uintptr_t)r->to->values;
    for (int i = 0; !st && i <= STRESS_ROUNDS; i++) {
        const double *change;
        st = tli_parallel(ctx, r->normal.mesh->tet_count, ERROR_TETS, set_errors, r);
        if (!st && i) add_stress(r);
        if (!st && !i) tli_normal_begin(&r->normal);
        if (!st) st = tli_normal_solve(&r->normal, i ? STRESS_STEPS : STEPS_MAX, &change);
        for (size_t v = 0; !st && v < verts; v++)
            if (isfinite(change[v])) values[v * r->to->components + r->component] += change[v];
    }
    return st;
}

tl_status tli_refit(const tli_work *work, const tl_mesh *original, tl_mesh *out,
                    const tl_lidx *opposite, const tl_lidx *hints, const uint8_t *keep,
                    const uint8_t *held)
{
    tl_status st = TL_OK;
    tli_samples samples = {0};
    tl_ctx *ctx = work->ctx;
    walk_job job = {work, original, out, opposite, hints, NULL, &samples};
    refit r = {0};
    bool any = false;
    for (size_t i = 0; i < original->channel_count; i++)
        any = any || (original->channels[i].on == TL_ON_VERTEX && !held[i]);
    if (!any) return TL_OK;
    st = make_samples(ctx, &job);
    if (!st) st = tli_normal_open(ctx, out, &samples, keep, &r.normal);
    r.sums = tl_mem_alloc(ctx, out->tet_count / ERROR_TETS + 1, sizeof *r.sums, &st);
    for (size_t i = 0; !st && i < original->channel_count; i++) {
        r.from = &original->channels[i];
        r.to = &out->channels[i];
        if (r.from->on != TL_ON_VERTEX || held[i]) continue;
        for (r.component = 0; !st && r.component < r.from->components; r.component++)
            st = fit(ctx, &r);
    }
    tl_mem_free(ctx, r.sums);
    tli_normal_close(&r.normal);
    tl_mem_free(ctx, samples.weights);
    tl_mem_free(ctx, samples.origins);
    tl_mem_free(ctx, samples.starts);
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
