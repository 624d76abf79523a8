/* The quadrics of all vertices of the working mesh. Every vertex gets the field weight 1, shared by
 * its tets in proportion to their volumes: the error that counts is the one at the vertices
 * (Sondershaus 2007, 4.2.5), and slivers with wild gradients weigh little. Sondershaus 2007, 3.1.4
 * (field, face, vertex distribution) and 4.1.2 (sharp edges, with b = -Ap and c = p'Ap). */
#include "simplify/simplify_quadric.h"

#include <math.h>
#include <string.h>

#include "simplify/simplify_work.h"

/* Geometric terms in squared diagonals against squared field ranges. FACE and EDGE: leaving a
 * surface by 0.1 % of the diagonal costs as much as a field error of 0.1 % of the range.
 * DISTRIBUTION: moving by the size of the star costs as much as that fraction of the range: small
 * beside any field error that shows, enough to keep the system regular and tets round where the
 * field is flat or linear. */
static const double FACE_WEIGHT = 1.0;
static const double EDGE_WEIGHT = 1.0;
static const double DISTRIBUTION = 1e-4;
/* Above this mean ratio, cubed, a tet is far from flat for any rounding. */
static const double SOLID_CUBE = 1e-9;

typedef struct quadric_job {
    tli_work *work;
    float (*gradients)[4]; /* of one component, and the volume; that negative: not surely solid */
    size_t component;
    uint8_t *inner; /* [vert_count] or NULL */
} quadric_job;

/* Gradient of a component in each tet, in ranges per diagonal. */
static tl_status set_gradients(void *arg, size_t begin, size_t end, unsigned worker)
{
    quadric_job *job = arg;
    const tli_work *w = job->work;
    size_t k = w->components;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = w->tets[t];
        double e[3][3], df[3], edges = 0;
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++)
                e[i][j] = (w->verts[q[i + 1]].xyz[j] - w->verts[q[0]].xyz[j]) * w->scale;
            df[i] =
                k ? w->values[q[i + 1] * k + job->component] - w->values[q[0] * k + job->component]
                  : 0;
        }
        double c[3][3];
        for (int i = 0; i < 3; i++) {
            const double *a = e[(i + 1) % 3], *b = e[(i + 2) % 3];
            for (int j = 0; j < 3; j++) edges += a[j] * a[j] + (b[j] - a[j]) * (b[j] - a[j]);
            c[i][0] = a[1] * b[2] - a[2] * b[1];
            c[i][1] = a[2] * b[0] - a[0] * b[2];
            c[i][2] = a[0] * b[1] - a[1] * b[0];
        }
        double det = e[0][0] * c[0][0] + e[0][1] * c[0][1] + e[0][2] * c[0][2], inv = 1 / det;
        float *g = job->gradients[t];
        for (int j = 0; j < 3; j++)
            g[j] = (float)((df[0] * c[0][j] + df[1] * c[1][j] + df[2] * c[2][j]) * inv);
        g[3] = (float)det;
        if (!(det > 0) || !isfinite(g[0]) || !isfinite(g[1]) || !isfinite(g[2]))
            g[0] = g[1] = g[2] = g[3] = 0;
        if (!(432 * det * det > SOLID_CUBE * edges * edges * edges)) g[3] = -g[3];
    }
    return TL_OK;
}

/* A number of a vertex that looks random. */
static inline uint64_t number_of(tl_lidx v)
{
    uint64_t x = (v + UINT64_C(0x9e3779b97f4a7c15)) * UINT64_C(0xbf58476d1ce4e5b9);
    return (x ^ x >> 32) * UINT64_C(0x94d049bb133111eb);
}

/* Are all tets around v solid and of one region, and every edge of the faces opposite v there in
 * both directions, as it is around a vertex that lies on no surface? A face's product is the sum of
 * a b (a - b) over its edges, which has the other sign in the other direction. */
static bool is_inner(const quadric_job *job, tl_lidx v)
{
    const tli_work *w = job->work;
    const tli_star *s = &w->verts[v].star;
    uint64_t sum = 0;
    bool fine = s->count > 0;
    for (uint32_t i = 0; i < s->count; i++) {
        const tl_lidx *q = w->tets[s->tets[i]];
        const uint8_t *f = tli_tet_faces[tli_corner_of(q, v)];
        uint64_t a = number_of(q[f[0]]), b = number_of(q[f[1]]), c = number_of(q[f[2]]);
        sum += (a - b) * (b - c) * (c - a);
        fine = fine && job->gradients[s->tets[i]][3] > 0 &&
               (!w->regions || w->regions[s->tets[i]] == w->regions[s->tets[0]]);
    }
    return fine && sum == 0;
}

static tl_status add_field(void *arg, size_t begin, size_t end, unsigned worker)
{
    quadric_job *job = arg;
    tli_work *w = job->work;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        float *q = w->quadrics + v * w->quadric_floats;
        const tli_star *s = &w->verts[v].star;
        double sum[10] = {0}, volume = 0;
        for (uint32_t i = 0; i < s->count; i++) {
            const float *g = job->gradients[s->tets[i]];
            double x = g[0], y = g[1], z = g[2], m = fabsf(g[3]);
            sum[0] += m * x * x;
            sum[1] += m * x * y;
            sum[2] += m * x * z;
            sum[3] += m * y * y;
            sum[4] += m * y * z;
            sum[5] += m * z * z;
            sum[6] += m * x;
            sum[7] += m * y;
            sum[8] += m * z;
            volume += m;
        }
        if (job->component == 0)
            tli_work_round_values(w, (tl_lidx)v, w->values + v * w->components);
        if (job->component == 0 && job->inner) job->inner[v] = is_inner(job, (tl_lidx)v);
        if (!(volume > 0)) continue;
        double inv = 1 / volume;
        for (int i = 0; i < 6; i++) q[i] += (float)(sum[i] * inv);
        if (w->components) {
            float *g = q + TLI_QUADRIC_HEAD + 4 * job->component;
            for (int i = 0; i < 3; i++) g[i] = (float)(sum[6 + i] * inv);
        }
        if (job->component == 0) {
            double size = cbrt(volume), pull = DISTRIBUTION * DISTRIBUTION / (size * size);
            q[0] += (float)pull;
            q[3] += (float)pull;
            q[5] += (float)pull;
            q[10] = 1;
        }
    }
    return TL_OK;
}

/* Adds weight (I - pp') or weight pp' to A. */
static void add_plane(float *q, const double p[3], double weight)
{
    q[0] += (float)(weight * p[0] * p[0]);
    q[1] += (float)(weight * p[0] * p[1]);
    q[2] += (float)(weight * p[0] * p[2]);
    q[3] += (float)(weight * p[1] * p[1]);
    q[4] += (float)(weight * p[1] * p[2]);
    q[5] += (float)(weight * p[2] * p[2]);
}

static void add_faces(tli_work *w)
{
    for (size_t s = 0; s < w->surface_count; s++) {
        const tl_lidx *v = w->surface[s];
        const double *a = w->verts[v[0]].xyz, *b = w->verts[v[1]].xyz, *c = w->verts[v[2]].xyz;
        double u[3], t[3], n[3];
        for (int i = 0; i < 3; i++) u[i] = b[i] - a[i], t[i] = c[i] - a[i];
        n[0] = u[1] * t[2] - u[2] * t[1];
        n[1] = u[2] * t[0] - u[0] * t[2];
        n[2] = u[0] * t[1] - u[1] * t[0];
        double l = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (!(l > 0) || !isfinite(l)) continue;
        for (int i = 0; i < 3; i++) n[i] /= l;
        for (int i = 0; i < 3; i++)
            add_plane(w->quadrics + v[i] * w->quadric_floats, n, FACE_WEIGHT / 6);
    }
}

static void add_sharp_edges(tli_work *w)
{
    for (size_t s = 0; s < w->sharp_count; s++) {
        const tl_lidx *v = w->sharp[s];
        double e[3], l = 0;
        for (int i = 0; i < 3; i++)
            e[i] = w->verts[v[1]].xyz[i] - w->verts[v[0]].xyz[i], l += e[i] * e[i];
        l = sqrt(l);
        if (!(l > 0) || !isfinite(l)) continue;
        for (int i = 0; i < 3; i++) e[i] /= l;
        for (int i = 0; i < 2; i++) {
            float *q = w->quadrics + v[i] * w->quadric_floats;
            q[0] += (float)(EDGE_WEIGHT / 2);
            q[3] += (float)(EDGE_WEIGHT / 2);
            q[5] += (float)(EDGE_WEIGHT / 2);
            add_plane(q, e, -EDGE_WEIGHT / 2);
        }
    }
}

static void drop_surfaces(tli_work *w)
{
    tl_mem_free(w->ctx, w->surface);
    tl_mem_free(w->ctx, w->sharp);
    w->surface = NULL;
    w->sharp = NULL;
}

tl_status tli_work_set_quadrics(tli_work *w, uint8_t *inner)
{
    tl_status st = TL_OK;
    quadric_job job = {w, NULL, 0, inner};
    memset(w->quadrics, 0, w->vert_count * w->quadric_floats * sizeof *w->quadrics);
    job.gradients = tl_mem_alloc(w->ctx, w->tet_count, sizeof *job.gradients, &st);
    do {
        if (!st) st = tli_parallel(w->ctx, w->tet_count, 16384, set_gradients, &job);
        if (!st) st = tli_parallel(w->ctx, w->vert_count, 4096, add_field, &job);
    } while (!st && ++job.component < w->components);
    tl_mem_free(w->ctx, job.gradients);
    return st;
}

void tli_work_add_surface_quadrics(tli_work *w, bool known)
{
    if (!known) {
        add_faces(w);
        add_sharp_edges(w);
    }
    drop_surfaces(w);
}

void tli_work_take_quadrics(tli_work *w, const float *quadrics)
{
    size_t floats = tli_quadric_floats(w->components);
    memset(w->quadrics, 0, w->vert_count * w->quadric_floats * sizeof *w->quadrics);
    for (size_t v = 0; v < w->vert_count; v++) {
        memcpy(w->quadrics + v * w->quadric_floats, quadrics + (size_t)w->verts[v].origin * floats,
               floats * sizeof *quadrics);
        tli_work_round_values(w, (tl_lidx)v, w->values + v * w->components);
    }
}

void tli_work_share_quadrics(tli_work *w, const float *shares)
{
    size_t floats = tli_quadric_floats(w->components);
    for (size_t v = 0; v < w->vert_count; v++)
        for (size_t i = 0; i < floats; i++)
            w->quadrics[v * w->quadric_floats + i] *= shares[w->verts[v].origin];
}
