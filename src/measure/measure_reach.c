/* How far one surface is from another at most, without samples: the distances of its vertices, then
 * triangles by branch and bound. Most triangles lie over one triangle of the other surface and are
 * done after a glance. */
#include <limits.h>

#include "measure/measure.h"

/* Gap that is accepted between the distance found and the bound, relative to it. */
static const double GAP_RELATIVE = 0.1;
/* Cuts of a triangle on average. One alone may take them all: at a coarse level a triangle lies
 * over ten thousand of the original ones, and is cut as often. */
enum { SPLITS_MEAN = 16 };

static void measure_vertex(tli_reach *r, tl_lidx v, tl_lidx *last)
{
    double distance2 =
        tli_surface_nearest(r->query.to, r->query.from->xyz + 3 * (size_t)v, *last, last);
    r->distances[v] = tli_surface_distance(distance2, r->query.rounding);
    r->nearest[v] = *last;
    r->query.found = fmax(r->query.found, r->distances[v]);
}

tl_status tli_reach_create(tl_ctx *ctx, const tli_surface *from, const tli_surface *to,
                           const uint8_t *left_out, double gap, tli_reach *r)
{
    tl_status st = TL_OK;
    tl_lidx last = TL_NONE;
    *r = (tli_reach){.ctx = ctx, .left_out = left_out};
    r->distances = tl_mem_alloc(ctx, from->vert_count, sizeof *r->distances, &st);
    r->nearest = tl_mem_alloc(ctx, from->vert_count, sizeof *r->nearest, &st);
    if (st) return st;
    r->query = (tli_bound_query){.from = from,
                                 .to = to,
                                 .distances = r->distances,
                                 .nearest = r->nearest,
                                 .tolerance = gap,
                                 .tolerance_relative = GAP_RELATIVE,
                                 .rounding = tli_surface_rounding(from, to),
                                 .split_max = UINT_MAX,
                                 .splits_left = &r->splits_left};
    r->splits_left = (uint64_t)SPLITS_MEAN * (from->triangle_count + to->triangle_count);
    for (size_t v = 0; v < from->vert_count; v++) r->nearest[v] = TL_NONE;
    for (size_t i = 0; i < 3 * from->triangle_count; i++)
        if (!left_out[i / 3] && r->nearest[from->triangles[i]] == TL_NONE)
            measure_vertex(r, from->triangles[i], &last);
    r->bound = r->query.found;
    return TL_OK;
}

/* What costs least first: a triangle over a single one, the triangle as it is, then its cover, then
 * branch and bound. */
static double bound_triangle(tli_reach *r, size_t triangle)
{
    const tl_lidx *v = r->query.from->triangles + 3 * triangle;
    if (r->nearest[v[0]] == r->nearest[v[1]] && r->nearest[v[0]] == r->nearest[v[2]])
        return r->query.found; /* no point is farther than the farthest corner */
    tli_bound_query glance = r->query;
    double bound, corners[9], most = fmax(r->query.found, r->query.tolerance);
    glance.split_max = 0;
    tli_surface_bound(&glance, triangle, &r->query.found, &bound);
    if (bound <= most) return bound;
    tli_surface_triangle(r->query.from, triangle, corners);
    bound = tli_surface_cover(r->query.to, NULL, corners, most);
    if (bound > most) tli_surface_bound(&r->query, triangle, &r->query.found, &bound);
    return bound;
}

void tli_reach_bound(tli_reach *r)
{
    for (size_t t = 0; t < r->query.from->triangle_count; t++)
        if (!r->left_out[t]) r->bound = fmax(r->bound, bound_triangle(r, t));
    r->bound = fmax(r->bound, r->query.found);
}

void tli_reach_release(tli_reach *r)
{
    if (!r->ctx) return;
    tl_mem_free(r->ctx, r->nearest);
    tl_mem_free(r->ctx, r->distances);
    *r = (tli_reach){0};
}
