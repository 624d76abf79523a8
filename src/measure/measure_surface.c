/* Triangle surfaces and the nearest point on them: a packed tree over the triangles in Hilbert
 * order (Kamel & Faloutsos 1993) with four boxes a node, whose distances are computed side by side.
 */
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "base/base_vec.h"
#include "measure/measure.h"

enum { FAN = 4, NODE_GRAIN = 1024, STACK_MAX = (FAN - 1) * TLI_SURFACE_LEVELS_MAX + 1 };

/* Squared sine of the angle between two sides below which a triangle's inner point is checked
 * against its sides: its plane is not known well. */
static const double SLIVER_SINE2 = 1e-8;

/* ---- one triangle ---- */

/* Squared distance of v to the segment from 0 to e. */
static double segment_distance2(const double v[3], const double e[3])
{
    double along = vec_dot(v, e), length2 = vec_dot(e, e), d[3];
    double t = along <= 0 ? 0 : along >= length2 ? 1 : along / length2;
    for (int k = 0; k < 3; k++) d[k] = v[k] - t * e[k];
    return vec_dot(d, d);
}

/* Every candidate is the distance to a point of the triangle, so the result is never too small. */
double tli_triangle_distance2(const double a[3], const double b[3], const double c[3],
                              const double x[3])
{
    double e0[3], e1[3], v[3], d[3], normal[3], across[3];
    vec_sub(b, a, e0);
    vec_sub(c, a, e1);
    vec_sub(x, a, v);
    vec_cross(e0, e1, normal);
    double det = vec_dot(normal, normal); /* s / det and t / det are the weights of b and c */
    vec_cross(v, e1, across);
    double s = vec_dot(across, normal);
    vec_cross(e0, v, across);
    double t = vec_dot(across, normal);
    bool inside = det > 0 && s >= 0 && t >= 0 && s + t <= det;
    bool sliver = !(det > SLIVER_SINE2 * vec_dot(e0, e0) * vec_dot(e1, e1));
    double best = (double)INFINITY;
    if (inside) {
        for (int k = 0; k < 3; k++) d[k] = v[k] - (s / det) * e0[k] - (t / det) * e1[k];
        best = vec_dot(d, d);
        if (!sliver) return best;
    }
    /* Outside, the nearest point lies on a side that x sees. */
    double side;
    if ((sliver || t < 0) && (side = segment_distance2(v, e0)) < best) best = side;
    if ((sliver || s < 0) && (side = segment_distance2(v, e1)) < best) best = side;
    if (sliver || s + t > det) {
        double e2[3], w[3];
        vec_sub(c, b, e2);
        vec_sub(x, b, w);
        if ((side = segment_distance2(w, e2)) < best) best = side;
    }
    return best;
}

double tli_surface_distance2(const tli_surface *surface, tl_lidx triangle, const double x[3])
{
    return tli_triangle_distance2(tli_surface_corner(surface, triangle, 0),
                                  tli_surface_corner(surface, triangle, 1),
                                  tli_surface_corner(surface, triangle, 2), x);
}

/* ---- building ---- */

static tl_status order_triangles(tl_ctx *ctx, const double *xyz, const tl_lidx *triangles,
                                 size_t triangle_count, uint32_t *order)
{
    tl_status st = TL_OK;
    double *centroids = tl_mem_alloc(ctx, triangle_count, 3 * sizeof *centroids, &st);
    if (!st) {
        for (size_t t = 0; t < triangle_count; t++)
            for (size_t k = 0; k < 3; k++)
                centroids[3 * t + k] = (xyz[3 * (size_t)triangles[3 * t] + k] +
                                        xyz[3 * (size_t)triangles[3 * t + 1] + k] +
                                        xyz[3 * (size_t)triangles[3 * t + 2] + k]) /
                                       3;
        st = tli_sort_hilbert(ctx, centroids, triangle_count, order);
    }
    tl_mem_free(ctx, centroids);
    return st;
}

/* Takes the triangles in order and the vertices as they come. */
static void renumber(tli_surface *surface, const double *xyz, const tl_lidx *triangles,
                     const uint32_t *order, tl_lidx *new_of)
{
    for (size_t i = 0; i < surface->triangle_count; i++) {
        for (size_t k = 0; k < 3; k++) {
            tl_lidx v = triangles[3 * (size_t)order[i] + k];
            if (new_of[v] == TL_NONE) {
                new_of[v] = (tl_lidx)surface->vert_count;
                memcpy(surface->xyz + 3 * surface->vert_count, xyz + 3 * (size_t)v,
                       3 * sizeof *xyz);
                surface->vert_count++;
            }
            surface->triangles[3 * i + k] = new_of[v];
        }
    }
}

static void sum_area(tli_surface *surface)
{
    for (size_t t = 0; t < surface->triangle_count; t++) {
        double e0[3], e1[3], n[3];
        vec_sub(tli_surface_corner(surface, t, 1), tli_surface_corner(surface, t, 0), e0);
        vec_sub(tli_surface_corner(surface, t, 2), tli_surface_corner(surface, t, 0), e1);
        vec_cross(e0, e1, n);
        surface->area += vec_length(n) / 2;
    }
}

typedef struct tree_job {
    tli_surface *surface;
    unsigned level;
    size_t child_count; /* triangles, or nodes of the level before */
} tree_job;

static void child_box(const tree_job *job, size_t child, double lo[3], double hi[3])
{
    const tli_surface *s = job->surface;
    for (int k = 0; k < 3; k++) {
        lo[k] = (double)INFINITY;
        hi[k] = -(double)INFINITY;
    }
    if (child >= job->child_count) return;
    for (int k = 0; k < 3; k++) {
        for (int j = 0; job->level == 0 && j < 3; j++) {
            lo[k] = fmin(lo[k], tli_surface_corner(s, child, j)[k]);
            hi[k] = fmax(hi[k], tli_surface_corner(s, child, j)[k]);
        }
        for (int j = 0; job->level > 0 && j < FAN; j++) {
            const tli_surface_node *node = &s->nodes[s->level_ofs[job->level - 1] + child];
            lo[k] = fmin(lo[k], node->lo[k][j]);
            hi[k] = fmax(hi[k], node->hi[k][j]);
        }
    }
}

static tl_status nodes_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const tree_job *job = arg;
    (void)worker;
    for (size_t n = begin; n < end; n++) {
        tli_surface_node *node = &job->surface->nodes[job->surface->level_ofs[job->level] + n];
        for (size_t j = 0; j < FAN; j++) {
            double lo[3], hi[3];
            child_box(job, FAN * n + j, lo, hi);
            for (int k = 0; k < 3; k++) {
                node->lo[k][j] = lo[k];
                node->hi[k][j] = hi[k];
            }
        }
    }
    return TL_OK;
}

static tl_status build_tree(tl_ctx *ctx, tli_surface *surface)
{
    if (surface->triangle_count == 0) return TL_OK;
    tl_status st = TL_OK;
    size_t node_count = 0, width = surface->triangle_count;
    do {
        width = (width + FAN - 1) / FAN;
        TL_ASSERT(surface->level_count < TLI_SURFACE_LEVELS_MAX);
        surface->level_ofs[surface->level_count++] = node_count;
        node_count += width;
    } while (width > 1);
    surface->nodes = tl_mem_alloc(ctx, node_count, sizeof *surface->nodes, &st);
    width = surface->triangle_count;
    for (unsigned level = 0; !st && level < surface->level_count; level++) {
        tree_job job = {surface, level, width};
        width = (width + FAN - 1) / FAN;
        st = tli_parallel(ctx, width, NODE_GRAIN, nodes_range, &job);
    }
    return st;
}

tl_status tli_surface_create(tl_ctx *ctx, const double *xyz, size_t vert_count,
                             const tl_lidx *triangles, size_t triangle_count, tli_surface *surface)
{
    tl_status st = TL_OK;
    *surface = (tli_surface){.ctx = ctx, .triangle_count = triangle_count};
    uint32_t *order = tl_mem_alloc(ctx, triangle_count, sizeof *order, &st);
    surface->origins = order;
    tl_lidx *new_of = tl_mem_alloc(ctx, vert_count, sizeof *new_of, &st);
    surface->triangles = tl_mem_alloc(ctx, triangle_count, 3 * sizeof *triangles, &st);
    size_t xyz_count = vert_count / 3 < triangle_count ? vert_count : 3 * triangle_count;
    surface->xyz = tl_mem_alloc(ctx, xyz_count, 3 * sizeof *xyz, &st);
    if (!st) st = order_triangles(ctx, xyz, triangles, triangle_count, order);
    if (!st) {
        for (size_t v = 0; v < vert_count; v++) new_of[v] = TL_NONE;
        renumber(surface, xyz, triangles, order, new_of);
        sum_area(surface);
        surface->xyz = tl_mem_resize(ctx, surface->xyz, surface->vert_count, 3 * sizeof *xyz, &st);
    }
    if (!st) st = build_tree(ctx, surface);
    tl_mem_free(ctx, new_of);
    return st;
}

void tli_surface_release(tli_surface *surface)
{
    if (!surface->ctx) return;
    tl_mem_free(surface->ctx, surface->nodes);
    tl_mem_free(surface->ctx, surface->origins);
    tl_mem_free(surface->ctx, surface->triangles);
    tl_mem_free(surface->ctx, surface->xyz);
    *surface = (tli_surface){0};
}

/* ---- nearest ---- */

typedef struct tree_entry {
    double distance2;
    size_t index; /* in its level */
    unsigned level;
} tree_entry;

static void box_distances(const tli_surface_node *node, const double x[3], double out[FAN])
{
    for (int j = 0; j < FAN; j++) out[j] = 0;
    for (int k = 0; k < 3; k++) {
        for (int j = 0; j < FAN; j++) {
            double below = node->lo[k][j] - x[k], above = x[k] - node->hi[k][j];
            double d = below > above ? below : above;
            d = d > 0 ? d : 0;
            out[j] += d * d;
        }
    }
}

/* Child numbers by falling distance, so that the nearest ends on top of the stack. */
static void sort_children(const double distances[FAN], int order[FAN])
{
    for (int i = 0; i < FAN; i++) {
        int j = i;
        for (; j > 0 && distances[order[j - 1]] < distances[i]; j--) order[j] = order[j - 1];
        order[j] = i;
    }
}

double tli_surface_nearest(const tli_surface *surface, const double x[3], tl_lidx hint,
                           tl_lidx *triangle)
{
    tree_entry stack[STACK_MAX];
    int depth = 0;
    double best = (double)INFINITY;
    *triangle = hint;
    if (hint != TL_NONE) best = tli_surface_distance2(surface, hint, x);
    if (surface->level_count > 0) stack[depth++] = (tree_entry){0, 0, surface->level_count - 1};
    while (depth > 0) {
        tree_entry top = stack[--depth];
        if (top.distance2 >= best) continue;
        double distances[FAN];
        int order[FAN];
        box_distances(&surface->nodes[surface->level_ofs[top.level] + top.index], x, distances);
        sort_children(distances, order);
        for (int i = 0; top.level > 0 && i < FAN; i++)
            if (distances[order[i]] < best)
                stack[depth++] = (tree_entry){distances[order[i]],
                                              FAN * top.index + (size_t)order[i], top.level - 1};
        for (int i = FAN - 1; top.level == 0 && i >= 0; i--) {
            if (!(distances[order[i]] < best)) break;
            tl_lidx candidate = (tl_lidx)(FAN * top.index + (size_t)order[i]);
            double d = tli_surface_distance2(surface, candidate, x);
            if (d >= best) continue;
            best = d;
            *triangle = candidate;
        }
    }
    return best;
}

/* ---- around ---- */

static unsigned meets(const tli_surface_node *node, const double lo[3], const double hi[3])
{
    unsigned hits = 0;
    for (unsigned j = 0; j < FAN; j++) {
        bool hit = true;
        for (int k = 0; k < 3; k++) hit = hit && node->lo[k][j] <= hi[k] && node->hi[k][j] >= lo[k];
        hits |= (unsigned)hit << j;
    }
    return hits;
}

size_t tli_surface_around(const tli_surface *surface, const uint8_t *taken, const double corners[9],
                          double reach, tl_lidx *list, size_t room)
{
    tree_entry stack[STACK_MAX];
    int depth = 0;
    size_t count = 0;
    double lo[3], hi[3];
    for (int k = 0; k < 3; k++) {
        lo[k] = fmin(corners[k], fmin(corners[3 + k], corners[6 + k])) - reach;
        hi[k] = fmax(corners[k], fmax(corners[3 + k], corners[6 + k])) + reach;
    }
    if (surface->level_count > 0) stack[depth++] = (tree_entry){0, 0, surface->level_count - 1};
    while (depth > 0 && count <= room) {
        tree_entry top = stack[--depth];
        unsigned hits = meets(&surface->nodes[surface->level_ofs[top.level] + top.index], lo, hi);
        for (unsigned j = 0; j < FAN; j++) {
            size_t child = FAN * top.index + j;
            if (!(hits >> j & 1)) continue;
            if (top.level > 0)
                stack[depth++] = (tree_entry){0, child, top.level - 1};
            else if ((!taken || taken[child]) && ++count <= room)
                list[count - 1] = (tl_lidx)child;
        }
    }
    return count;
}
