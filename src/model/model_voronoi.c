/* Voronoi cells by Lloyd's relaxation, each with a distance in which its tets are as long as wide
 * (Ponchio & Hormann 2008, 6.4). There cells are as large as their seeds happen to lie; here each
 * distance is scaled until the cells hold equally many tets. */
#include <math.h>
#include <string.h>

#include "model/model_cells.h"

/* Relaxation ends after so many rounds; the last ones only balance. */
enum { ROUNDS = 24, LLOYD_ROUNDS = 14 };
/* A cell that holds k times what it should is made smaller by the k-th part to this power. */
static const double DAMPING = 0.25;
/* Least part of a shape's largest extent that its distance follows. */
static const double FLATTEST = 0.05;
/* What rounding may add to a squared distance, relative. */
static const double ROUNDING = 1e-9;

/* ---- nearest seeds ---- */

static double distance2(const tli_seed *s, const double x[3])
{
    const double a = x[0] - s->at[0], b = x[1] - s->at[1], c = x[2] - s->at[2];
    const double *m = s->metric;
    return m[0] * a * a + m[1] * b * b + m[2] * c * c +
           2 * (m[3] * a * b + m[4] * a * c + m[5] * b * c);
}

/* Largest squared distance to a box: that of a corner. */
static double farthest2(const tli_seed *s, const double box[6])
{
    double most = 0;
    for (int corner = 0; corner < 8; corner++) {
        double x[3];
        for (int k = 0; k < 3; k++) x[k] = box[2 * k + (corner >> k & 1)];
        most = fmax(most, distance2(s, x));
    }
    return most;
}

/* A lower bound of the squared distance to a box, by the extents of the ball that reaches it: along
 * axis k a ball of radius 1 reaches the root of the inverse metric's k-th diagonal element. */
static double nearest2(const tli_seed *s, const double box[6])
{
    const double *m = s->metric;
    const double det = m[0] * (m[1] * m[2] - m[5] * m[5]) - m[3] * (m[3] * m[2] - m[5] * m[4]) +
                       m[4] * (m[3] * m[5] - m[1] * m[4]);
    const double minors[3] = {m[1] * m[2] - m[5] * m[5], m[0] * m[2] - m[4] * m[4],
                              m[0] * m[1] - m[3] * m[3]};
    double most = 0;
    for (int k = 0; k < 3; k++) {
        double gap = fmax(box[2 * k] - s->at[k], s->at[k] - box[2 * k + 1]);
        if (gap > 0) most = fmax(most, gap * gap * det / minors[k]);
    }
    return most;
}

/* Seeds that can be the nearest of a point in a box, ascending. */
static size_t list_near(const tli_seed *seeds, size_t count, const double box[6], uint32_t *near)
{
    double reach = (double)INFINITY;
    size_t n = 0;
    for (size_t s = 0; s < count; s++) reach = fmin(reach, farthest2(&seeds[s], box));
    for (size_t s = 0; s < count; s++)
        if (!(nearest2(&seeds[s], box) > reach * (1 + ROUNDING))) near[n++] = (uint32_t)s;
    return n;
}

void tli_voronoi_find(const tli_seed *seeds, size_t count, const double (*points)[3],
                      size_t point_count, uint32_t *near, uint32_t *cell_of)
{
    double box[6] = {INFINITY, -INFINITY, INFINITY, -INFINITY, INFINITY, -INFINITY};
    for (size_t i = 0; i < point_count; i++)
        for (int k = 0; k < 3; k++) {
            box[2 * k] = fmin(box[2 * k], points[i][k]);
            box[2 * k + 1] = fmax(box[2 * k + 1], points[i][k]);
        }
    size_t n = list_near(seeds, count, box, near);
    for (size_t i = 0; i < point_count; i++) {
        double least = (double)INFINITY;
        cell_of[i] = near[0];
        for (size_t s = 0; s < n; s++) {
            double d2 = distance2(&seeds[near[s]], points[i]);
            if (!(d2 < least)) continue;
            least = d2;
            cell_of[i] = near[s];
        }
    }
}

/* ---- relaxation ---- */

/* What a cell holds. */
typedef struct content {
    double tets, sum[3], shape[6];
} content;

typedef struct relaxation {
    const tli_sampling *const *samplings;
    const double *weights;
    size_t patch_count, count;
    tli_seed *seeds;
    double *sizes;     /* [count] a distance counts as that part of itself, squared */
    double (*unit)[6]; /* [count] metrics of determinant 1 */
    content *contents;
    uint32_t *near;
} relaxation;

static void assign(relaxation *r)
{
    memset(r->contents, 0, r->count * sizeof *r->contents);
    for (size_t p = 0; p < r->patch_count; p++) {
        const tli_sampling *s = r->samplings[p];
        uint32_t cells[TLI_SAMPLES];
        tli_voronoi_find(r->seeds, r->count, s->at, TLI_SAMPLES, r->near, cells);
        for (size_t i = 0; i < TLI_SAMPLES; i++) {
            content *c = &r->contents[cells[i]];
            c->tets += r->weights[p];
            for (int k = 0; k < 3; k++) c->sum[k] += r->weights[p] * s->at[i][k];
            for (int k = 0; k < 6; k++) c->shape[k] += r->weights[p] * s->shape[k];
        }
    }
}

/* The inverse of a mean shape, with determinant 1; flat ones are filled up. */
static void invert_shape(const double shape[6], double out[6])
{
    double m[6], floor = FLATTEST * fmax(shape[0], fmax(shape[1], shape[2]));
    memcpy(m, shape, sizeof m);
    for (int k = 0; k < 3; k++) m[k] += floor;
    const double inverse[6] = {m[1] * m[2] - m[5] * m[5], m[0] * m[2] - m[4] * m[4],
                               m[0] * m[1] - m[3] * m[3], m[4] * m[5] - m[3] * m[2],
                               m[3] * m[5] - m[4] * m[1], m[3] * m[4] - m[0] * m[5]};
    const double det = m[0] * inverse[0] + m[3] * inverse[3] + m[4] * inverse[4];
    /* the adjoint has the determinant det^2 */
    const double scale = cbrt(det * det);
    const double round[6] = {1, 1, 1, 0, 0, 0};
    for (int k = 0; k < 6; k++)
        out[k] = scale > 0 && isfinite(1 / scale) ? inverse[k] / scale : round[k];
}

static void move(relaxation *r, double wanted, bool lloyd)
{
    for (size_t s = 0; s < r->count; s++) {
        const content *c = &r->contents[s];
        double share = fmin(fmax(c->tets / wanted, 0.25), 4);
        r->sizes[s] *= pow(share, DAMPING);
        if (c->tets > 0 && lloyd) {
            for (int k = 0; k < 3; k++) r->seeds[s].at[k] = c->sum[k] / c->tets;
            invert_shape(c->shape, r->unit[s]);
        }
        for (int k = 0; k < 6; k++) r->seeds[s].metric[k] = r->unit[s][k] * r->sizes[s];
    }
}

/* Every so many tets along the patches, which lie along a curve. */
static void place_seeds(relaxation *r, double all)
{
    double seen = 0;
    size_t seed = 0;
    for (size_t p = 0; p < r->patch_count; p++)
        for (size_t i = 0; i < TLI_SAMPLES; i++) {
            seen += r->weights[p];
            if (seed == r->count || seen * (double)r->count < all * ((double)seed + 0.5)) continue;
            memcpy(r->seeds[seed].at, r->samplings[p]->at[i], sizeof r->seeds[seed].at);
            for (int k = 0; k < 3; k++) r->unit[seed][k] = 1;
            r->sizes[seed++] = 1;
        }
    for (; seed < r->count; seed++) { /* rounding alone brings us here */
        r->seeds[seed] = r->seeds[0];
        memcpy(r->unit[seed], r->unit[0], sizeof r->unit[0]);
        r->sizes[seed] = 1;
    }
    for (size_t s = 0; s < r->count; s++) memcpy(r->seeds[s].metric, r->unit[s], sizeof r->unit[s]);
}

tl_status tli_voronoi_create(tl_ctx *ctx, const tli_sampling *const *samplings,
                             const double *weights, size_t patch_count, size_t count,
                             tli_seed **seeds)
{
    tl_status st = TL_OK;
    double all = 0;
    relaxation r = {
        .samplings = samplings, .weights = weights, .patch_count = patch_count, .count = count};
    r.seeds = tl_mem_zalloc(ctx, count, sizeof *r.seeds, &st);
    r.sizes = tl_mem_alloc(ctx, count, sizeof *r.sizes, &st);
    r.unit = tl_mem_zalloc(ctx, count, sizeof *r.unit, &st);
    r.contents = tl_mem_alloc(ctx, count, sizeof *r.contents, &st);
    r.near = tl_mem_alloc(ctx, count, sizeof *r.near, &st);
    for (size_t p = 0; p < patch_count; p++) all += TLI_SAMPLES * weights[p];
    if (!st) place_seeds(&r, all);
    for (int round = 0; !st && round < ROUNDS; round++) {
        assign(&r);
        move(&r, all / (double)count, round < LLOYD_ROUNDS);
    }
    void *blocks[] = {r.near, r.contents, r.unit, r.sizes};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    *seeds = r.seeds;
    if (!st) return TL_OK;
    tl_mem_free(ctx, r.seeds);
    *seeds = NULL;
    return st;
}
