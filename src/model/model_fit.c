/* Values of a mesh by least squares over samples that are seen once: of each tet the products of
 * the samples' weights are kept, which is all that the normal equations need, whatever the number
 * of samples. Solved by conjugate gradients with the diagonal as preconditioner; a weak pull
 * towards the values before keeps vertices with few samples in place, and no value leaves the range
 * of the samples by much: one that only samples at the far side of its tets know could be anything.
 */
#include <math.h>
#include <string.h>

#include "model/model.h"

/* Pull towards the values before, relative to the weight of a vertex's samples and of one more that
 * lies at the vertex. */
static const double PULL = 1e-3;
/* How far values may leave the range of the samples, relative to it. At 0 the error of fields with
 * flat ends (Neghip) is 5 % larger, at 0.1 not 1 %. */
static const double OVERSHOOT = 0.1;
/* Residual, relative to the first one, at which the iteration ends, and steps at most. */
static const double RESIDUAL = 1e-3;
enum { STEPS_MAX = 24, PRODUCTS = 10 };

struct tli_fit {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    size_t components;
    float *products; /* [tet_count][PRODUCTS] w_i w_j, i <= j */
    double *right;   /* [components][vert_count] sums of w_i (value - value now) */
    double *room;    /* [5][vert_count] */
    double *diagonal;
    double (*range)[2]; /* [components] of the samples */
};

tl_status tli_fit_create(tl_ctx *ctx, const tl_mesh *mesh, size_t components, tli_fit **fit)
{
    tl_status st = TL_OK;
    tli_fit *f = tl_mem_zalloc(ctx, 1, sizeof *f, &st);
    size_t n = mesh->vert_count;
    *fit = NULL;
    if (st) return st;
    f->ctx = ctx;
    f->mesh = mesh;
    f->components = components;
    f->products = tl_mem_zalloc(ctx, mesh->tet_count, PRODUCTS * sizeof *f->products, &st);
    f->right = tl_mem_zalloc(ctx, n * components, sizeof *f->right, &st);
    f->room = tl_mem_alloc(ctx, n, 5 * sizeof *f->room, &st);
    f->diagonal = tl_mem_zalloc(ctx, n, sizeof *f->diagonal, &st);
    f->range = tl_mem_alloc(ctx, components, sizeof *f->range, &st);
    for (size_t c = 0; !st && c < components; c++) {
        f->range[c][0] = (double)INFINITY;
        f->range[c][1] = (double)-INFINITY;
    }
    if (st)
        tli_fit_destroy(f);
    else
        *fit = f;
    return st;
}

void tli_fit_destroy(tli_fit *f)
{
    if (!f) return;
    tl_mem_free(f->ctx, f->range);
    tl_mem_free(f->ctx, f->diagonal);
    tl_mem_free(f->ctx, f->room);
    tl_mem_free(f->ctx, f->right);
    tl_mem_free(f->ctx, f->products);
    tl_mem_free(f->ctx, f);
}

void tli_fit_add(tli_fit *f, tl_lidx tet, const double w[4], const double *values,
                 const double *mesh_values)
{
    const tl_lidx *q = f->mesh->tets + 4 * (size_t)tet;
    float *product = f->products + PRODUCTS * (size_t)tet;
    size_t k = f->components, n = f->mesh->vert_count;
    for (int i = 0; i < 4; i++)
        for (int j = i; j < 4; j++) *product++ += (float)(w[i] * w[j]);
    for (int i = 0; i < 4; i++) f->diagonal[q[i]] += w[i] * w[i];
    for (size_t c = 0; c < k; c++) {
        double value = 0;
        for (int j = 0; j < 4; j++) /* differences first: exactly 0 for a constant */
            value += w[j] * (values[c] - mesh_values[q[j] * k + c]);
        if (!isfinite(value)) continue;
        if (values[c] < f->range[c][0]) f->range[c][0] = values[c];
        if (values[c] > f->range[c][1]) f->range[c][1] = values[c];
        for (int j = 0; j < 4; j++) f->right[c * n + q[j]] += w[j] * value;
    }
}

static double pull(const tli_fit *f, size_t vert)
{
    return PULL * (1 + f->diagonal[vert]);
}

static void apply(const tli_fit *f, const uint8_t *fixed, const double *from, double *to)
{
    size_t n = f->mesh->vert_count;
    for (size_t i = 0; i < n; i++) to[i] = pull(f, i) * from[i];
    for (size_t t = 0; t < f->mesh->tet_count; t++) {
        const tl_lidx *q = f->mesh->tets + 4 * t;
        const float *p = f->products + PRODUCTS * t;
        double a = from[q[0]], b = from[q[1]], c = from[q[2]], d = from[q[3]];
        to[q[0]] += p[0] * a + p[1] * b + p[2] * c + p[3] * d;
        to[q[1]] += p[1] * a + p[4] * b + p[5] * c + p[6] * d;
        to[q[2]] += p[2] * a + p[5] * b + p[7] * c + p[8] * d;
        to[q[3]] += p[3] * a + p[6] * b + p[8] * c + p[9] * d;
    }
    for (size_t i = 0; i < n; i++)
        if (fixed[i]) to[i] = 0;
}

static double dot(const double *a, const double *b, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) sum += a[i] * b[i];
    return sum;
}

/* The change of one component, in the first vector of the room. */
static void solve(tli_fit *f, const uint8_t *fixed, double *residual)
{
    size_t n = f->mesh->vert_count;
    double *change = f->room, *z = f->room + 2 * n, *p = f->room + 3 * n, *q = f->room + 4 * n;
    memset(change, 0, n * sizeof *change);
    for (size_t i = 0; i < n; i++) {
        if (fixed[i]) residual[i] = 0;
        p[i] = z[i] = residual[i] / (f->diagonal[i] + pull(f, i));
    }
    double rz = dot(residual, z, n), stop = rz * RESIDUAL * RESIDUAL;
    for (int step = 0; step < STEPS_MAX && rz > stop; step++) {
        apply(f, fixed, p, q);
        double pq = dot(p, q, n);
        if (!(pq > 0)) break;
        double alpha = rz / pq;
        for (size_t i = 0; i < n; i++) {
            change[i] += alpha * p[i];
            residual[i] -= alpha * q[i];
            z[i] = residual[i] / (f->diagonal[i] + pull(f, i));
        }
        double next = dot(residual, z, n), beta = next / rz;
        rz = next;
        for (size_t i = 0; i < n; i++) p[i] = z[i] + beta * p[i];
    }
}

void tli_fit_solve(tli_fit *f, const uint8_t *fixed, double *mesh_values)
{
    size_t n = f->mesh->vert_count, k = f->components;
    for (size_t c = 0; c < k; c++) {
        double beyond = OVERSHOOT * (f->range[c][1] - f->range[c][0]);
        double low = f->range[c][0] - beyond, high = f->range[c][1] + beyond;
        solve(f, fixed, f->right + c * n);
        for (size_t i = 0; i < n; i++) {
            double value = mesh_values[i * k + c] + f->room[i];
            if (fixed[i] || f->diagonal[i] == 0 || !isfinite(value)) continue;
            mesh_values[i * k + c] = fmin(fmax(value, low), high);
        }
    }
}
