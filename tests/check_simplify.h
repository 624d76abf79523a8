/* What the tests of stage simplify share: runs with their result, and brute-force measures of what
 * it promises that share no code with it. Include after check.h. */
#ifndef TETRALOD_TESTS_CHECK_SIMPLIFY_H
#define TETRALOD_TESTS_CHECK_SIMPLIFY_H

#include "tetralod/measure.h"
#include "tetralod/simplify.h"

#include "make_mesh.h"

static const char *const method_names[] = {"auto", "queue", "independent", "randomized", "blocks"};

/* A simplified mesh and what was said about it. */
typedef struct shrunk {
    tl_mesh *mesh;
    tl_simplify_result result;
} shrunk;

static inline tl_ctx *shrink_ctx(unsigned thread_count)
{
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = thread_count;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

static inline shrunk shrink(const tl_mesh *mesh, const tl_simplify_opts *opts)
{
    shrunk s = {0};
    CHECK_OK(tl_mesh_ctx(mesh),
             tl_mesh_simplify(tl_mesh_ctx(mesh), mesh, opts, &s.mesh, &s.result));
    CHECK_EQ(s.result.tets_out, tl_mesh_tet_count(s.mesh));
    CHECK_EQ(s.result.vertices_out, tl_mesh_vert_count(s.mesh));
    CHECK_EQ(s.result.tets_in, tl_mesh_tet_count(mesh));
    CHECK_EQ(s.result.vertices_in, tl_mesh_vert_count(mesh));
    CHECK(s.result.stopped_by != NULL);
    return s;
}

static inline void shrink_release(shrunk *s)
{
    if (s->mesh) tl_simplify_release(tl_mesh_ctx(s->mesh), &s->result);
    tl_mesh_destroy(s->mesh);
    *s = (shrunk){0};
}

static inline tl_simplify_opts shrink_ratio(double ratio)
{
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.ratio = ratio;
    return opts;
}

/* A few Gaussians over the unit cube. */
static inline double field_bumps(const double x[3])
{
    static const double at[5][5] = {{0.3, 0.3, 0.4, 0.12, 1},
                                    {0.7, 0.6, 0.3, 0.2, -0.8},
                                    {0.5, 0.75, 0.7, 0.15, 1.2},
                                    {0.2, 0.8, 0.2, 0.25, 0.6},
                                    {0.85, 0.2, 0.8, 0.1, 0.9}};
    double sum = 0;
    for (int i = 0; i < 5; i++) {
        double d = 0;
        for (int k = 0; k < 3; k++) d += (x[k] - at[i][k]) * (x[k] - at[i][k]);
        sum += at[i][4] * exp(-d / (2 * at[i][3] * at[i][3]));
    }
    return sum;
}

static inline double field_linear(const double x[3])
{
    return 3 * x[0] - 2 * x[1] + 0.5 * x[2] + 7;
}

/* Perturbs inner vertices only: a coordinate on the surface of the unit cube stays. */
static inline void perturb_inner(make_mesh *m, double amount, uint64_t seed)
{
    for (size_t i = 0; i < 3 * m->vert_count; i++) {
        double by = amount * (2 * make_uniform(&seed) - 1);
        if (m->xyz[i] > 0 && m->xyz[i] < 1) m->xyz[i] += by;
    }
}

/* ---- space ---- */

static inline double mesh_diagonal(const tl_mesh *mesh)
{
    tl_mesh_stats stats;
    CHECK_OK(tl_mesh_ctx(mesh), tl_mesh_measure(tl_mesh_ctx(mesh), mesh, &stats));
    return stats.diagonal;
}

static inline void tet_points(const tl_mesh *mesh, size_t t, double p[4][3])
{
    for (size_t i = 0; i < 4; i++)
        memcpy(p[i], tl_mesh_xyz(mesh) + 3 * (size_t)tl_mesh_tets(mesh)[4 * t + i], sizeof p[i]);
}

/* Volume of the tets of a region (of all where the mesh has none or all is true). */
static inline double region_volume(const tl_mesh *mesh, int32_t region, bool all)
{
    double sum = 0, p[4][3];
    const int32_t *regions = tl_mesh_regions(mesh);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        if (!all && regions[t] != region) continue;
        tet_points(mesh, t, p);
        sum += tl_tet_volume((const double(*)[3])p);
    }
    return sum;
}

/* ---- fields, by brute force ---- */

/* The point of the mesh at x, or the nearest one: its tet and weights. Looks at every tet. */
static inline size_t brute_locate(const tl_mesh *mesh, const double x[3], double weights[4])
{
    double p[4][3], w[4], inside = -1e-9, nearest = INFINITY;
    size_t found = SIZE_MAX, outside = SIZE_MAX;
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        bool near = true;
        tet_points(mesh, t, p);
        for (int k = 0; near && k < 3; k++) {
            double lo = fmin(fmin(p[0][k], p[1][k]), fmin(p[2][k], p[3][k]));
            double hi = fmax(fmax(p[0][k], p[1][k]), fmax(p[2][k], p[3][k]));
            near = x[k] >= lo - 1e-9 * (hi - lo) && x[k] <= hi + 1e-9 * (hi - lo);
        }
        if (!near || !tl_tet_weights((const double(*)[3])p, x, w)) continue;
        double least = fmin(fmin(w[0], w[1]), fmin(w[2], w[3]));
        if (least < inside) continue;
        inside = least;
        found = t;
        memcpy(weights, w, sizeof w);
    }
    for (size_t t = 0; found == SIZE_MAX && t < tl_mesh_tet_count(mesh); t++) {
        tet_points(mesh, t, p);
        double d = tl_tet_nearest((const double(*)[3])p, x, w);
        if (!(d < nearest)) continue;
        nearest = d;
        outside = t;
        memcpy(weights, w, sizeof w);
    }
    return found == SIZE_MAX ? outside : found;
}

/* The norm of the difference at an original vertex. */
static inline double brute_error_at(const tl_channel *channel, size_t v, const tl_mesh *copy,
                                    const tl_channel *copied, size_t tet, const double weights[4])
{
    double sum = 0;
    for (uint32_t k = 0; k < channel->components; k++) {
        double value = 0;
        for (size_t i = 0; i < 4; i++)
            value += weights[i] *
                     copied->values[tl_mesh_tets(copy)[4 * tet + i] * channel->components + k];
        double d = value - channel->values[v * channel->components + k];
        sum += d * d;
    }
    return sqrt(sum);
}

/* The largest error of a channel over the original vertices that tets use and whose values are
 * finite; rms may be NULL. */
static inline double brute_error(const tl_mesh *original, const tl_mesh *copy, const char *name,
                                 double *rms)
{
    const tl_channel *a = tl_mesh_channel_by_name(original, name);
    const tl_channel *b = tl_mesh_channel_by_name(copy, name);
    double largest = 0, sum = 0;
    size_t count = 0;
    uint8_t *used = calloc(tl_mesh_vert_count(original), 1);
    CHECK(a && b && used && a->components == b->components);
    for (size_t i = 0; i < 4 * tl_mesh_tet_count(original); i++)
        used[tl_mesh_tets(original)[i]] = 1;
    for (size_t v = 0; v < tl_mesh_vert_count(original); v++) {
        double weights[4] = {0};
        if (!used[v]) continue;
        size_t tet = brute_locate(copy, tl_mesh_xyz(original) + 3 * v, weights);
        double e = brute_error_at(a, v, copy, b, tet, weights);
        if (!isfinite(e)) continue;
        largest = fmax(largest, e);
        sum += e * e;
        count++;
    }
    free(used);
    if (rms) *rms = count ? sqrt(sum / (double)count) : 0;
    return largest;
}

static inline double result_error(const shrunk *s, const char *name)
{
    for (size_t i = 0; i < s->result.channel_count; i++)
        if (!strcmp(s->result.channels[i].name, name)) return s->result.channels[i].max_error;
    fail_msg("the result says nothing about channel '%s'", name);
    return NAN;
}

/* ---- surfaces, by brute force ---- */

/* Triangles as sorted vertex triples. */
typedef struct brute_faces {
    tl_lidx (*tris)[3];
    size_t count;
} brute_faces;

typedef struct brute_face {
    tl_lidx v[3];
    uint32_t tet;
} brute_face;

static inline int brute_face_order(const void *a, const void *b)
{
    const brute_face *p = a, *q = b;
    for (int i = 0; i < 3; i++)
        if (p->v[i] != q->v[i]) return p->v[i] < q->v[i] ? -1 : 1;
    return 0;
}

/* Boundary (faces with one tet), or the faces between two regions. */
static inline brute_faces brute_surface(const tl_mesh *mesh, bool interfaces)
{
    size_t n = 4 * tl_mesh_tet_count(mesh);
    brute_face *all = malloc((n + 1) * sizeof *all);
    brute_faces out = {malloc((n + 1) * sizeof *out.tris), 0};
    const int32_t *regions = tl_mesh_regions(mesh);
    if (!all || !out.tris) abort();
    for (size_t i = 0; i < n; i++) {
        size_t m = 0;
        all[i].tet = (uint32_t)(i / 4);
        for (size_t j = 0; j < 4; j++)
            if (j != i % 4) all[i].v[m++] = tl_mesh_tets(mesh)[i / 4 * 4 + j];
        for (int a = 0; a < 2; a++)
            for (int b = 0; b < 2 - a; b++)
                if (all[i].v[b] > all[i].v[b + 1]) {
                    tl_lidx t = all[i].v[b];
                    all[i].v[b] = all[i].v[b + 1];
                    all[i].v[b + 1] = t;
                }
    }
    qsort(all, n, sizeof *all, brute_face_order);
    for (size_t i = 0, end; i < n; i = end) {
        for (end = i + 1; end < n && brute_face_order(&all[i], &all[end]) == 0;) end++;
        bool take = interfaces ? end - i == 2 && regions[all[i].tet] != regions[all[i + 1].tet]
                               : end - i == 1;
        if (take) memcpy(out.tris[out.count++], all[i].v, sizeof all[i].v);
    }
    free(all);
    return out;
}

static inline int brute_u64_order(const void *a, const void *b)
{
    uint64_t p = *(const uint64_t *)a, q = *(const uint64_t *)b;
    return p < q ? -1 : p > q;
}

static inline size_t brute_count_distinct(uint64_t *keys, size_t count)
{
    size_t distinct = 0;
    qsort(keys, count, sizeof *keys, brute_u64_order);
    for (size_t i = 0; i < count; i++) distinct += i == 0 || keys[i] != keys[i - 1];
    return distinct;
}

static inline tl_lidx brute_root(tl_lidx *up, tl_lidx v)
{
    while (up[v] != v) v = up[v] = up[up[v]];
    return v;
}

/* V - E + F of a surface and the number of its components (connected over vertices). */
static inline void brute_topology(const tl_mesh *mesh, const brute_faces *faces, long *euler,
                                  size_t *components)
{
    size_t n = tl_mesh_vert_count(mesh), verts = 0;
    uint64_t *edges = malloc((3 * faces->count + 1) * sizeof *edges);
    tl_lidx *up = malloc((n + 1) * sizeof *up);
    uint8_t *used = calloc(n + 1, 1);
    if (!edges || !up || !used) abort();
    for (size_t v = 0; v < n; v++) up[v] = (tl_lidx)v;
    for (size_t i = 0; i < faces->count; i++)
        for (size_t j = 0; j < 3; j++) {
            uint64_t a = faces->tris[i][j], b = faces->tris[i][(j + 1) % 3];
            edges[3 * i + j] = a < b ? a << 32 | b : b << 32 | a;
            used[a] = 1;
            up[brute_root(up, (tl_lidx)a)] = brute_root(up, (tl_lidx)b);
        }
    *components = 0;
    for (size_t v = 0; v < n; v++) {
        verts += used[v];
        *components += used[v] && brute_root(up, (tl_lidx)v) == v;
    }
    size_t edge_count = brute_count_distinct(edges, 3 * faces->count);
    *euler = (long)verts - (long)edge_count + (long)faces->count;
    free(used);
    free(up);
    free(edges);
}

/* Squared distance of x to a triangle: through its plane where the foot lies inside, else the
 * nearest edge. */
static inline double brute_triangle_distance2(const double *a, const double *b, const double *c,
                                              const double *x)
{
    const double *corner[3] = {a, b, c};
    double best = INFINITY, u[3], v[3], n[3], w[3], nn = 0, h = 0;
    for (int i = 0; i < 3; i++) {
        const double *p = corner[i], *q = corner[(i + 1) % 3];
        double pq = 0, px = 0, d = 0;
        for (int k = 0; k < 3; k++) pq += (q[k] - p[k]) * (q[k] - p[k]);
        for (int k = 0; k < 3; k++) px += (q[k] - p[k]) * (x[k] - p[k]);
        double t = pq > 0 ? fmin(fmax(px / pq, 0), 1) : 0;
        for (int k = 0; k < 3; k++) {
            double off = x[k] - p[k] - t * (q[k] - p[k]);
            d += off * off;
        }
        best = fmin(best, d);
    }
    for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], v[k] = c[k] - a[k], w[k] = x[k] - a[k];
    for (int k = 0; k < 3; k++)
        n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    for (int k = 0; k < 3; k++) nn += n[k] * n[k], h += n[k] * w[k];
    if (!(nn > 0)) return best;
    for (int i = 0; i < 3; i++) { /* the foot of x lies on the inner side of each edge */
        const double *p = corner[i], *q = corner[(i + 1) % 3];
        double side = 0;
        for (int k = 0; k < 3; k++) {
            int l = (k + 1) % 3, m = (k + 2) % 3;
            side += n[k] * ((q[l] - p[l]) * (x[m] - p[m]) - (q[m] - p[m]) * (x[l] - p[l]));
        }
        if (side < 0) return best;
    }
    return fmin(best, h * h / nn);
}

/* The largest distance found from points of surface a (corners, middles of edges, centroids) to
 * surface b. */
static inline double brute_one_sided(const tl_mesh *ma, const brute_faces *a, const tl_mesh *mb,
                                     const brute_faces *b)
{
    static const double at[7][3] = {{1, 0, 0},     {0, 1, 0},     {0, 0, 1}, {0.5, 0.5, 0},
                                    {0, 0.5, 0.5}, {0.5, 0, 0.5}, {1, 1, 1}};
    const double *xa = tl_mesh_xyz(ma), *xb = tl_mesh_xyz(mb);
    double largest = 0;
    for (size_t i = 0; i < a->count; i++)
        for (int s = 0; s < 7; s++) {
            double x[3], best = INFINITY, sum = at[s][0] + at[s][1] + at[s][2];
            for (size_t k = 0; k < 3; k++) {
                x[k] = 0;
                for (size_t j = 0; j < 3; j++)
                    x[k] += at[s][j] / sum * xa[3 * (size_t)a->tris[i][j] + k];
            }
            for (size_t j = 0; j < b->count && best > largest * largest; j++)
                best = fmin(best, brute_triangle_distance2(xb + 3 * (size_t)b->tris[j][0],
                                                           xb + 3 * (size_t)b->tris[j][1],
                                                           xb + 3 * (size_t)b->tris[j][2], x));
            largest = fmax(largest, sqrt(best));
        }
    return largest;
}

static inline double brute_surface_distance(const tl_mesh *a, const tl_mesh *b, bool interfaces)
{
    brute_faces fa = brute_surface(a, interfaces), fb = brute_surface(b, interfaces);
    double there = brute_one_sided(a, &fa, b, &fb), back = brute_one_sided(b, &fb, a, &fa);
    free(fa.tris);
    free(fb.tris);
    return fmax(there, back);
}

static inline void check_same_topology(const tl_mesh *a, const tl_mesh *b, bool interfaces)
{
    brute_faces fa = brute_surface(a, interfaces), fb = brute_surface(b, interfaces);
    long euler[2];
    size_t components[2];
    brute_topology(a, &fa, &euler[0], &components[0]);
    brute_topology(b, &fb, &euler[1], &components[1]);
    printf("%s: Euler characteristic %ld and %ld, components %zu and %zu\n",
           interfaces ? "interface" : "boundary", euler[0], euler[1], components[0], components[1]);
    CHECK_EQ(euler[1], euler[0]);
    CHECK_EQ(components[1], components[0]);
    free(fa.tris);
    free(fb.tris);
}

/* ---- everything that must hold for a mesh that was fine ---- */

static inline int brute_double_order(const void *a, const void *b)
{
    double p = *(const double *)a, q = *(const double *)b;
    return p < q ? -1 : p > q;
}

static inline void print_quality(const tl_mesh *mesh)
{
    size_t n = tl_mesh_tet_count(mesh);
    double p[4][3], *q = malloc((n + 1) * sizeof *q);
    if (!q) abort();
    for (size_t t = 0; t < n; t++) {
        tet_points(mesh, t, p);
        q[t] = tl_tet_quality((const double(*)[3])p);
    }
    qsort(q, n, sizeof *q, brute_double_order);
    printf("quality: least %.4f, 1 %% %.3f, 10 %% %.3f, median %.3f\n", q[0], q[n / 100], q[n / 10],
           q[n / 2]);
    free(q);
}

/* The result is whole: positive tets, same topology, same volume up to volume_part, boundary within
 * what was said, and that within what was asked. */
static inline void check_whole(const tl_mesh *mesh, const shrunk *s, double boundary_asked,
                               double volume_part)
{
    tl_ctx *ctx = tl_mesh_ctx(mesh);
    tl_mesh_stats stats[2];
    tl_compare_result compared;
    CHECK_OK(ctx, tl_mesh_check(ctx, s->mesh, TL_CHECK_FULL));
    CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats[0]));
    CHECK_OK(ctx, tl_mesh_measure(ctx, s->mesh, &stats[1]));
    printf("%zu tets to %zu (%s), inverted %zu, flat %zu\n", s->result.tets_in, s->result.tets_out,
           s->result.stopped_by, s->result.inverted, s->result.degenerate);
    CHECK_EQ(s->result.inverted, 0);
    CHECK_EQ(s->result.degenerate, 0);
    CHECK_EQ(stats[1].inverted, 0);
    CHECK_EQ(stats[1].degenerate, 0);
    CHECK_EQ(stats[1].nonmanifold_faces, 0);
    CHECK_EQ(stats[1].nonmanifold_edges, stats[0].nonmanifold_edges);
    CHECK_EQ(stats[1].nonmanifold_verts, stats[0].nonmanifold_verts);
    CHECK_EQ(stats[1].components, stats[0].components);
    check_same_topology(mesh, s->mesh, false);
    CHECK_BOUND("volume", fabs(stats[1].volume / stats[0].volume - 1), volume_part);
    CHECK_OK(ctx, tl_mesh_compare(ctx, mesh, s->mesh, NULL, &compared));
    double rounding = 1e-12 * stats[0].diagonal;
    CHECK_BOUND("boundary", compared.boundary_hausdorff, s->result.boundary_error + rounding);
    CHECK_BOUND("boundary, bound", compared.boundary_hausdorff_bound, /* as tight as it gets */
                1.01 * s->result.boundary_error + 1e-3 * compared.boundary_step);
    CHECK_BOUND("boundary said", s->result.boundary_error, boundary_asked);
    tl_compare_release(ctx, &compared);
    print_quality(s->mesh);
}

#endif
