/* The normal equations of a fit, and conjugate gradients with the diagonal as preconditioner. A
 * weak pull towards the values before keeps vertices with few samples in place. */
#include "simplify/simplify_normal.h"

#include <math.h>
#include <string.h>

/* Pull: relative to the weight of a vertex's samples, and to that of a sample in its place, so that
 * a vertex far from all its samples does not run away. */
static const double PULL = 1e-3, PULL_LEAST = 0.01;
/* Residual, relative to the first one, at which the iteration ends. */
static const double RESIDUAL = 1e-3;
/* Rows that are built and multiplied together; vertices of a piece of a vector. */
enum { ROWS = 1024, PIECE = 16384 };

struct tli_rows {
    uint32_t starts[ROWS + 1];
    tl_lidx *columns;
    float *values;   /* every sample counts 1 */
    float *stressed; /* samples count their stress */
    size_t capacity;
};

/* ---- the matrix ---- */

typedef struct build_job {
    tli_normal *normal;
    uint32_t **slots; /* one a worker, [vertices]: place in the row at hand, from 1; 0 for none */
} build_job;

static tl_status make_room(tl_ctx *ctx, tli_rows *r, size_t count)
{
    tl_status st = TL_OK;
    if (count <= r->capacity) return TL_OK;
    size_t capacity = r->capacity ? 2 * r->capacity : 16 * ROWS;
    r->capacity = count > capacity ? count : capacity;
    r->columns = tl_mem_resize(ctx, r->columns, r->capacity, sizeof *r->columns, &st);
    r->values = tl_mem_resize(ctx, r->values, r->capacity, sizeof *r->values, &st);
    return st;
}

/* The row of vertex v behind its first entry, at base; returns its end. */
static size_t fill_row(const tli_normal *n, tl_lidx v, uint32_t *slots, tl_lidx *columns,
                       float *values, size_t base)
{
    const tli_samples *s = n->samples;
    size_t end = base + 1;
    columns[base] = v;
    values[base] = 0;
    slots[v] = 1;
    for (tl_lidx i = n->star_starts[v]; i < n->star_starts[v + 1]; i++) {
        tl_lidx t = n->stars[i];
        const tl_lidx *q = n->mesh->tets + 4 * (size_t)t;
        size_t at[4];
        if (s->starts[t] == s->starts[t + 1]) continue;
        unsigned own = tli_corner_of(q, v);
        for (int j = 0; j < 4; j++) {
            if (!slots[q[j]]) {
                columns[end] = q[j];
                values[end] = 0;
                slots[q[j]] = (uint32_t)(++end - base);
            }
            at[j] = base + slots[q[j]] - 1;
        }
        for (uint32_t k = s->starts[t]; k < s->starts[t + 1]; k++)
            for (int j = 0; j < 4; j++)
                values[at[j]] += (float)(s->weights[k][own] * s->weights[k][j]);
    }
    for (size_t i = base; i < end; i++) slots[columns[i]] = 0;
    return end;
}

static tl_status build_rows(void *arg, size_t begin, size_t end, unsigned worker)
{
    build_job *job = arg;
    tli_normal *n = job->normal;
    tli_rows *r = &n->rows[begin / ROWS];
    tl_status st = TL_OK;
    size_t count = 0;
    if (!job->slots[worker])
        job->slots[worker] = tl_mem_zalloc(n->ctx, n->mesh->vert_count, sizeof **job->slots, &st);
    for (size_t v = begin; !st && v < end; v++) {
        r->starts[v - begin] = (uint32_t)count;
        n->pull[v] = PULL_LEAST;
        if (!n->keep[v]) {
            st = make_room(n->ctx, r, count + 1 + 3 * (n->star_starts[v + 1] - n->star_starts[v]));
            if (st) return st;
            size_t first = count;
            count = fill_row(n, (tl_lidx)v, job->slots[worker], r->columns, r->values, first);
            n->pull[v] += PULL * (double)r->values[first];
            n->diagonal[v] = (double)r->values[first];
        }
        n->diagonal[v] += n->pull[v];
    }
    r->starts[end - begin] = (uint32_t)count;
    r->stressed = tl_mem_alloc(n->ctx, count, sizeof *r->stressed, &st);
    return st;
}

static tl_status build(tli_normal *n)
{
    tl_status st = TL_OK;
    unsigned workers = tl_ctx_thread_count(n->ctx);
    build_job job = {n, tl_mem_zalloc(n->ctx, workers, sizeof *job.slots, &st)};
    if (!st) st = tli_parallel(n->ctx, n->mesh->vert_count, ROWS, build_rows, &job);
    for (unsigned i = 0; job.slots && i < workers; i++) tl_mem_free(n->ctx, job.slots[i]);
    tl_mem_free(n->ctx, job.slots);
    return st;
}

tl_status tli_normal_open(tl_ctx *ctx, const tl_mesh *mesh, const tli_samples *samples,
                          const uint8_t *keep, tli_normal *n)
{
    size_t count = mesh->vert_count;
    *n = (tli_normal){.ctx = ctx, .mesh = mesh, .samples = samples, .keep = keep};
    tl_status st = tl_mesh_incidence(ctx, mesh, &n->star_starts, &n->stars);
    n->rows = tl_mem_zalloc(ctx, (count + ROWS - 1) / ROWS, sizeof *n->rows, &st);
    if (!st) n->rows_count = (count + ROWS - 1) / ROWS;
    n->sums = tl_mem_alloc(ctx, n->rows_count, sizeof *n->sums, &st);
    n->diagonal = tl_mem_zalloc(ctx, count, sizeof *n->diagonal, &st);
    n->pull = tl_mem_alloc(ctx, count, sizeof *n->pull, &st);
    n->load = tl_mem_alloc(ctx, count, sizeof *n->load, &st);
    n->room = tl_mem_alloc(ctx, count, 4 * sizeof *n->room, &st);
    n->stress = tl_mem_alloc(ctx, samples->count, sizeof *n->stress, &st);
    n->errors = tl_mem_alloc(ctx, samples->count, sizeof *n->errors, &st);
    return st ? st : build(n);
}

void tli_normal_close(tli_normal *n)
{
    for (size_t i = 0; i < n->rows_count; i++) {
        tl_mem_free(n->ctx, n->rows[i].stressed);
        tl_mem_free(n->ctx, n->rows[i].values);
        tl_mem_free(n->ctx, n->rows[i].columns);
    }
    void *blocks[] = {n->load,     n->errors, n->stress, n->room,  n->pull,
                      n->diagonal, n->sums,   n->rows,   n->stars, n->star_starts};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(n->ctx, blocks[i]);
}

void tli_normal_begin(tli_normal *n)
{
    const tli_samples *s = n->samples;
    memset(n->load, 0, n->mesh->vert_count * sizeof *n->load);
    for (size_t t = 0; t < n->mesh->tet_count; t++)
        for (uint32_t k = s->starts[t]; k < s->starts[t + 1]; k++) {
            for (size_t j = 0; j < 4; j++)
                n->load[n->mesh->tets[4 * t + j]] += s->weights[k][j] * n->errors[k];
            n->stress[k] = 1;
        }
    for (size_t i = 0; i < n->rows_count; i++) {
        tli_rows *r = &n->rows[i];
        size_t rows = n->mesh->vert_count - i * ROWS < ROWS ? n->mesh->vert_count - i * ROWS : ROWS;
        if (r->starts[rows]) memcpy(r->stressed, r->values, r->starts[rows] * sizeof *r->values);
    }
}

void tli_normal_set_stress(tli_normal *n, size_t tet, size_t sample, float stress)
{
    const tl_lidx *q = n->mesh->tets + 4 * tet;
    const double *b = n->samples->weights[sample];
    double more = (double)stress - (double)n->stress[sample];
    n->stress[sample] = stress;
    for (int i = 0; i < 4; i++) {
        n->load[q[i]] += more * b[i] * n->errors[sample];
        tli_rows *r = &n->rows[q[i] / ROWS];
        uint32_t from = r->starts[q[i] % ROWS], to = r->starts[q[i] % ROWS + 1];
        for (int j = 0; j < 4; j++)
            for (uint32_t k = from; k < to; k++)
                if (r->columns[k] == q[j]) r->stressed[k] += (float)(more * b[i] * b[j]);
    }
}

/* ---- conjugate gradients ---- */

typedef struct solve_job {
    const tli_normal *normal;
    double *change, *residual, *p, *q;
    double *sums;
    double alpha, beta;
} solve_job;

static tl_status begin_steps(void *arg, size_t begin, size_t end, unsigned worker)
{
    const solve_job *job = arg;
    const tli_normal *n = job->normal;
    double dot = 0;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        job->residual[v] = n->keep[v] ? 0 : n->load[v];
        job->p[v] = job->residual[v] / n->diagonal[v];
        job->change[v] = 0;
        dot += job->residual[v] * job->p[v];
    }
    job->sums[begin / PIECE] = dot;
    return TL_OK;
}

/* q = A p */
static tl_status multiply(void *arg, size_t begin, size_t end, unsigned worker)
{
    const solve_job *job = arg;
    const tli_normal *n = job->normal;
    const tli_rows *r = &n->rows[begin / ROWS];
    double dot = 0;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        double sum = 0;
        for (uint32_t k = r->starts[v - begin]; k < r->starts[v - begin + 1]; k++)
            sum += (double)r->stressed[k] * job->p[r->columns[k]];
        if (!n->keep[v]) sum += n->pull[v] * job->p[v];
        job->q[v] = sum;
        dot += sum * job->p[v];
    }
    job->sums[begin / ROWS] = dot;
    return TL_OK;
}

static tl_status step_on(void *arg, size_t begin, size_t end, unsigned worker)
{
    const solve_job *job = arg;
    double dot = 0;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        job->change[v] += job->alpha * job->p[v];
        job->residual[v] -= job->alpha * job->q[v];
        dot += job->residual[v] * job->residual[v] / job->normal->diagonal[v];
    }
    job->sums[begin / PIECE] = dot;
    return TL_OK;
}

static tl_status turn(void *arg, size_t begin, size_t end, unsigned worker)
{
    const solve_job *job = arg;
    (void)worker;
    for (size_t v = begin; v < end; v++)
        job->p[v] = job->residual[v] / job->normal->diagonal[v] + job->beta * job->p[v];
    return TL_OK;
}

/* The load after the change; the pull is not part of it. */
static tl_status end_steps(void *arg, size_t begin, size_t end, unsigned worker)
{
    const solve_job *job = arg;
    const tli_normal *n = job->normal;
    (void)worker;
    for (size_t v = begin; v < end; v++)
        n->load[v] = job->residual[v] + n->pull[v] * job->change[v];
    return TL_OK;
}

static double sum_of(const double *sums, size_t count, size_t piece)
{
    double sum = 0;
    for (size_t i = 0; i * piece < count; i++) sum += sums[i];
    return sum;
}

tl_status tli_normal_solve(tli_normal *n, int steps, const double **change)
{
    size_t count = n->mesh->vert_count;
    double *room = n->room;
    solve_job job = {n, room, room + count, room + 2 * count, room + 3 * count, n->sums, 0, 0};
    tl_status st = tli_parallel(n->ctx, count, PIECE, begin_steps, &job);
    double rz = st ? 0 : sum_of(n->sums, count, PIECE), stop = rz * RESIDUAL * RESIDUAL;
    *change = job.change;
    for (int step = 0; !st && step < steps && rz > stop; step++) {
        st = tli_parallel(n->ctx, count, ROWS, multiply, &job);
        double pq = st ? 0 : sum_of(n->sums, count, ROWS);
        if (!(pq > 0)) break;
        job.alpha = rz / pq;
        st = tli_parallel(n->ctx, count, PIECE, step_on, &job);
        double next = st ? 0 : sum_of(n->sums, count, PIECE);
        job.beta = next / rz;
        rz = next;
        if (!st) st = tli_parallel(n->ctx, count, PIECE, turn, &job);
    }
    return st ? st : tli_parallel(n->ctx, count, PIECE, end_steps, &job);
}
