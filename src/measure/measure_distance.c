/* Mean and Hausdorff distance of two surfaces (Sondershaus 2007, 3.1.1). The mean comes from
 * samples: rows parallel to the shortest side of each triangle, so that thin triangles get no more
 * samples than their area asks for, weighted by the trapezoidal rule along and across the rows. The
 * Hausdorff distance starts from the samples and is bounded from above by measure_bound.c. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "measure/measure.h"

enum {
    VERTEX_GRAIN = 1024,
    SAMPLE_GRAIN = 8, /* triangles; one may hold many samples */
    BOUND_GRAIN = 32,
    SPLITS_MIN = 64,       /* cuts that every triangle may make in the search for the bound ... */
    SPLITS_TOTAL = 4000000 /* ... and what all may make together beyond that */
};

/* Gap between the Hausdorff distance found and its bound: relative to the distance, and relative to
 * the step of the samples. The larger one counts. */
static const double GAP_OF_DISTANCE = 0.01, GAP_OF_STEP = 0.001;
/* Relative to the largest coordinate: how far off a surface rounding may put a point. */
static const double ROUNDING = 16 * DBL_EPSILON;

typedef struct side_sum {
    double integral, max;
    size_t samples;
} side_sum;

typedef struct bound_sum {
    double found, bound;
} bound_sum;

/* From one surface to the other. */
typedef struct side_job {
    const tli_surface *from, *to;
    double step, rounding;
    double *distances; /* [from->vert_count] */
    tl_lidx *nearest;  /* [from->vert_count] */
    side_sum *sums;    /* one a piece */
    bound_sum *bounds; /* one a piece */
    tli_bound_query query;
} side_job;

static tl_status vertices_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const side_job *job = arg;
    tl_lidx last = TL_NONE;
    (void)worker;
    for (size_t v = begin; v < end; v++) {

        double distance2 = tli_surface_nearest(job->to, job->from->xyz + 3 * v, last, &last);
        job->distances[v] = tli_surface_distance(distance2, job->rounding);

        job->nearest[v] = last;
    }
    return TL_OK;
}

/* ---- samples ---- */

/* A triangle with its shortest side bc opposite a. */
typedef struct sampled_triangle {
    tl_lidx a, b, c;
    double ab[3], bc[3];
    double long_side, short_side, area;
} sampled_triangle;

static sampled_triangle orient_triangle(const tli_surface *s, size_t t)
{
    double e[3][3], length[3]; /* side i runs from corner i + 1 to corner i + 2 */
    for (int i = 0; i < 3; i++) {
        const double *p = tli_surface_corner(s, t, (i + 1) % 3);
        const double *q = tli_surface_corner(s, t, (i + 2) % 3);
        for (int k = 0; k < 3; k++) e[i][k] = q[k] - p[k];
        length[i] = vec_length(e[i]);
    }
    int a = length[1] < length[0] ? 1 : 0;
    if (length[2] < length[a]) a = 2;
    int b = (a + 1) % 3, c = (a + 2) % 3;
    const tl_lidx *ids = s->triangles + 3 * t;
    sampled_triangle r = {.a = ids[a],
                          .b = ids[b],
                          .c = ids[c],
                          .long_side = fmax(length[b], length[c]),
                          .short_side = length[a]};
    for (int k = 0; k < 3; k++) {
        r.ab[k] = e[c][k];
        r.bc[k] = e[a][k];
    }
    double n[3] = {e[c][1] * e[a][2] - e[c][2] * e[a][1], e[c][2] * e[a][0] - e[c][0] * e[a][2],
                   e[c][0] * e[a][1] - e[c][1] * e[a][0]};
    r.area = vec_length(n) / 2;
    return r;
}

/* Mean distance along the row at fraction s of the way from a to bc. The ends of the last row are
 * vertices and known. */
static double row_mean(const side_job *job, const sampled_triangle *t, double s, bool last_row,
                       tl_lidx *hint, side_sum *sum)
{
    const double *a = job->from->xyz + 3 * (size_t)t->a;
    size_t count = (size_t)fmax(1, ceil(s * t->short_side / job->step));
    double total = 0;
    for (size_t j = 0; j <= count; j++) {
        double u = (double)j / (double)count, x[3], d;
        if (last_row && (j == 0 || j == count)) {
            d = job->distances[j == 0 ? t->b : t->c];
        } else {
            for (int k = 0; k < 3; k++) x[k] = a[k] + s * (t->ab[k] + u * t->bc[k]);
            d = tli_surface_distance(tli_surface_nearest(job->to, x, *hint, hint), job->rounding);
            sum->samples++;
        }
        sum->max = fmax(sum->max, d);
        total += j == 0 || j == count ? d / 2 : d;
    }
    return total / (double)count;
}

/* Adds the integral of the distance over triangle t. At s the triangle is 2 area s wide, so with
 * the means of the rows linear in between the integral of a strip from r to s weighs them with (s -
 * r) (2 r + s) / 6 and (s - r) (r + 2 s) / 6. */
static void sample_triangle(const side_job *job, size_t index, tl_lidx *hint, side_sum *sum)
{
    sampled_triangle t = orient_triangle(job->from, index);
    size_t row_count = (size_t)fmax(1, ceil(t.long_side / job->step));
    double before = job->distances[t.a], total = 0;
    sum->max = fmax(sum->max, before);
    *hint = job->nearest[t.a];
    for (size_t i = 1; i <= row_count; i++) {
        double r = (double)(i - 1) / (double)row_count, s = (double)i / (double)row_count;
        double mean = row_mean(job, &t, s, i == row_count, hint, sum);
        total += (s - r) * (before * (2 * r + s) + mean * (r + 2 * s)) / 6;
        before = mean;
    }
    sum->integral += 2 * t.area * total;
}

static tl_status samples_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const side_job *job = arg;
    side_sum sum = {0};
    tl_lidx hint = TL_NONE;
    (void)worker;
    for (size_t t = begin; t < end; t++) sample_triangle(job, t, &hint, &sum);
    job->sums[begin / SAMPLE_GRAIN] = sum;
    return TL_OK;
}

/* ---- bound ---- */

static tl_status bounds_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const side_job *job = arg;
    bound_sum sum = {0};
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        double found, bound;
        tli_surface_bound(&job->query, t, &found, &bound);
        sum.found = fmax(sum.found, found);
        sum.bound = fmax(sum.bound, bound);
    }
    job->bounds[begin / BOUND_GRAIN] = sum;
    return TL_OK;
}

/* ---- one side and both ---- */

double tli_surface_rounding(const tli_surface *a, const tli_surface *b)
{
    double largest = 0;
    for (size_t i = 0; i < 3 * a->vert_count; i++) largest = fmax(largest, fabs(a->xyz[i]));
    for (size_t i = 0; i < 3 * b->vert_count; i++) largest = fmax(largest, fabs(b->xyz[i]));
    return ROUNDING * largest;
}

static tl_status measure_side(tl_ctx *ctx, const char *stage, side_job *job, side_sum *total,
                              bound_sum *ends)
{
    size_t count = job->from->triangle_count;
    size_t piece_count = (count + SAMPLE_GRAIN - 1) / SAMPLE_GRAIN;
    size_t bound_count = (count + BOUND_GRAIN - 1) / BOUND_GRAIN;
    tl_status st = TL_OK;
    job->distances = tl_mem_alloc(ctx, job->from->vert_count, sizeof *job->distances, &st);
    job->nearest = tl_mem_alloc(ctx, job->from->vert_count, sizeof *job->nearest, &st);
    job->sums = tl_mem_alloc(ctx, piece_count, sizeof *job->sums, &st);
    job->bounds = tl_mem_alloc(ctx, bound_count, sizeof *job->bounds, &st);
    if (!st) st = tli_parallel(ctx, job->from->vert_count, VERTEX_GRAIN, vertices_range, job);
    if (!st) st = tli_measure_run(ctx, stage, count, SAMPLE_GRAIN, samples_range, job);
    *total = (side_sum){.samples = job->from->vert_count};
    for (size_t i = 0; !st && i < piece_count; i++) {
        total->integral += job->sums[i].integral;
        total->max = fmax(total->max, job->sums[i].max);
        total->samples += job->sums[i].samples;
    }
    job->query =
        (tli_bound_query){.from = job->from,
                          .to = job->to,
                          .distances = job->distances,
                          .nearest = job->nearest,
                          .found = total->max,
                          .tolerance = GAP_OF_STEP * job->step,
                          .tolerance_relative = GAP_OF_DISTANCE,
                          .rounding = job->rounding,
                          .split_max = SPLITS_MIN + (unsigned)(SPLITS_TOTAL / (count + 1))};
    if (!st) st = tli_measure_run(ctx, stage, count, BOUND_GRAIN, bounds_range, job);
    *ends = (bound_sum){0};
    for (size_t i = 0; !st && i < bound_count; i++) {
        ends->found = fmax(ends->found, job->bounds[i].found);
        ends->bound = fmax(ends->bound, job->bounds[i].bound);
    }
    tl_mem_free(ctx, job->bounds);
    tl_mem_free(ctx, job->sums);
    tl_mem_free(ctx, job->nearest);
    tl_mem_free(ctx, job->distances);
    return st;
}

/* Equal to the bit, as the boundaries of identical meshes are. */
static bool same_surface(const tli_surface *a, const tli_surface *b)
{
    return a->vert_count == b->vert_count && a->triangle_count == b->triangle_count &&
           memcmp(a->xyz, b->xyz, 3 * a->vert_count * sizeof *a->xyz) == 0 &&
           memcmp(a->triangles, b->triangles, 3 * a->triangle_count * sizeof *a->triangles) == 0;
}

tl_status tli_surface_compare(tl_ctx *ctx, const char *stage, const tli_surface *a,
                              const tli_surface *b, double step, tli_surface_error *error)
{
    *error = (tli_surface_error){0};
    if (a->triangle_count == 0 && b->triangle_count == 0) return TL_OK;
    if (a->triangle_count == 0 || b->triangle_count == 0) {
        const double far = (double)INFINITY;
        *error = (tli_surface_error){.mean = far, .one_sided = {far, far}, .bound = {far, far}};
        return TL_OK;
    }
    if (same_surface(a, b)) {
        error->samples = a->vert_count + b->vert_count;
        return TL_OK;
    }
    double rounding = tli_surface_rounding(a, b);

    side_job there = {.from = a, .to = b, .step = step, .rounding = rounding};
    side_job back = {.from = b, .to = a, .step = step, .rounding = rounding};
    side_sum sums[2];
    bound_sum ends[2];
    tl_status st = measure_side(ctx, stage, &there, &sums[0], &ends[0]);
    if (!st) st = measure_side(ctx, stage, &back, &sums[1], &ends[1]);
    if (st) return st;
    double area = a->area + b->area;
    error->mean = area > 0 ? (sums[0].integral + sums[1].integral) / area : 0;
    error->samples = sums[0].samples + sums[1].samples;
    for (int i = 0; i < 2; i++) {
        error->one_sided[i] = ends[i].found;
        error->bound[i] = ends[i].bound;
    }
    return TL_OK;
}
