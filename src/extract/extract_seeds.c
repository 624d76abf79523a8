/* Where streamlines begin: on lines, in boxes, on planes, on spheres around points; always evenly,
 * never at random. Sondershaus 2007, 7.3.1, puts seeds on spheres by dividing the faces of a tet;
 * the spiral here spreads any number of them. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "extract/extract.h"

static const size_t SEEDS_MAX = (size_t)1 << 24;
/* Turn from a point of the spiral to the next: the golden angle, radians. */
static const double GOLDEN_ANGLE = 2.399963229728653;

/* Room for count points. Gives *points. */
static tl_status make_points(tl_ctx *ctx, size_t count, tl_polydata **points)
{
    tl_status st = TL_OK;
    *points = NULL;
    if (!count || count > SEEDS_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "seeds are 1 to %zu, not %zu", SEEDS_MAX, count);
    tl_polydata *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (made) made->xyz = tl_mem_alloc(ctx, count, 3 * sizeof *made->xyz, &st);
    if (st) {
        tl_polydata_destroy(ctx, made);
        return st;
    }
    made->kind = TL_POLY_POINTS;
    *points = made;
    return TL_OK;
}

static void push_point(tl_polydata *points, const double x[3])
{
    memcpy(points->xyz + 3 * points->vert_count++, x, 3 * sizeof *x);
    points->cell_count = points->vert_count;
}

/* The edge of about count cubes, squares or parts that fill those sides of a box that are above
 * least; 1 if there are none. */
static double edge_of(const double sides[3], double longest, double least, size_t count)
{
    double content = 1; /* of the longest side, which keeps it from running over */
    int extents = 0;
    for (int k = 0; k < 3; k++)
        if (sides[k] > least) {
            content *= sides[k] / longest;
            extents++;
        }
    return extents ? longest * pow(content / (double)count, 1.0 / extents) : 1;
}

/* How many of about count cubes, squares or parts stand along each side of a box, and how many in
 * all. Sides too short for half a cube are flat: the others then share the count. */
static size_t divide(const double sides[3], size_t count, size_t parts[3])
{
    double longest = fmax(fmax(sides[0], sides[1]), sides[2]);
    double edge = longest / (double)count;
    size_t all = 1;
    for (int k = 0; k < 3; k++) edge = edge_of(sides, longest, edge / 2, count);
    for (int k = 0; k < 3; k++) {
        double wanted = round(sides[k] / edge);
        parts[k] = wanted > 1 ? (size_t)fmin(wanted, (double)count) : 1;
        all *= parts[k];
    }
    return all;
}

/* Refuses what is not finite and boxes that are turned. */
static tl_status check_bounds(tl_ctx *ctx, const double bounds[6])
{
    for (int k = 0; k < 3; k++)
        if (!(isfinite(bounds[2 * k]) && isfinite(bounds[2 * k + 1]) &&
              bounds[2 * k] <= bounds[2 * k + 1]))
            return tl_fail(ctx, TL_ERR_ARG, "the box of seeds goes from %g to %g along %c",
                           bounds[2 * k], bounds[2 * k + 1], "xyz"[k]);
    return TL_OK;
}

tl_status tl_seeds_line(tl_ctx *ctx, const double a[3], const double b[3], size_t count,
                        tl_polydata **seeds)
{
    *seeds = NULL;
    if (!vec_is_finite(a) || !vec_is_finite(b))
        return tl_fail(ctx, TL_ERR_ARG, "an end of the line of seeds is not finite");
    tl_status st = make_points(ctx, count, seeds);
    for (size_t i = 0; !st && i < count; i++) {
        double x[3], w = count > 1 ? (double)i / (double)(count - 1) : 0.5;
        for (int k = 0; k < 3; k++) x[k] = a[k] * (1 - w) + b[k] * w;
        push_point(*seeds, x);
    }
    return st;
}

tl_status tl_seeds_box(tl_ctx *ctx, const double bounds[6], size_t count, tl_polydata **seeds)
{
    double sides[3];
    size_t parts[3];
    *seeds = NULL;
    tl_status st = check_bounds(ctx, bounds);
    if (st) return st;
    for (int k = 0; k < 3; k++) sides[k] = bounds[2 * k + 1] - bounds[2 * k];
    size_t all = count && count <= SEEDS_MAX ? divide(sides, count, parts) : count;
    st = make_points(ctx, all, seeds);
    for (size_t i = 0; !st && i < all; i++) {
        size_t at[3] = {i % parts[0], i / parts[0] % parts[1], i / parts[0] / parts[1]};
        double x[3];
        for (int k = 0; k < 3; k++)
            x[k] = bounds[2 * k] + ((double)at[k] + 0.5) / (double)parts[k] * sides[k];
        push_point(*seeds, x);
    }
    return st;
}

/* Two directions across a normal, one long; false for a normal of no length. */
static bool span(const double normal[3], double u[3], double v[3])
{
    double length = vec_length(normal), n[3], helper[3] = {0, 0, 0};
    if (!(length > 0 && isfinite(length))) return false;
    int least = 0;
    for (int k = 0; k < 3; k++) {
        n[k] = normal[k] / length;
        if (fabs(n[k]) < fabs(n[least])) least = k;
    }
    helper[least] = 1;
    vec_cross(n, helper, u);
    length = vec_length(u);
    for (int k = 0; k < 3; k++) u[k] /= length;
    vec_cross(n, u, v);
    return true;
}

static bool is_inside(const double bounds[6], const double x[3])
{
    for (int k = 0; k < 3; k++)
        if (!(x[k] >= bounds[2 * k] && x[k] <= bounds[2 * k + 1])) return false;
    return true;
}

/* A plane as a lattice: the point under the middle of a box, two directions. */
typedef struct lattice {
    double middle[3], u[3], v[3], half; /* half: of a side of the square that holds the box */
} lattice;

/* Adds the centres of the squares of an edge that lie in the box; seeds NULL: only counts. */
static size_t fill_plane(const lattice *l, const double bounds[6], size_t side, tl_polydata *seeds)
{
    size_t count = 0;
    for (size_t i = 0; i < side * side; i++) {
        double a = l->half * (2 * ((double)(i % side) + 0.5) / (double)side - 1);
        double b = l->half * (2 * ((double)(i / side) + 0.5) / (double)side - 1), x[3];
        for (int k = 0; k < 3; k++) x[k] = l->middle[k] + a * l->u[k] + b * l->v[k];
        if (!is_inside(bounds, x)) continue;
        count++;
        if (seeds) push_point(seeds, x);
    }
    return count;
}

/* Squares along a side of the lattice: of the one by which the area in the box is measured, and at
 * most. */
enum { PROBE_SIDE = 256, SIDE_MAX = 8192 };

tl_status tl_seeds_plane(tl_ctx *ctx, const double origin[3], const double normal[3],
                         const double bounds[6], size_t count, tl_polydata **seeds)
{
    lattice l = {.half = 0};
    *seeds = NULL;
    tl_status st = check_bounds(ctx, bounds);
    if (st) return st;
    if (!vec_is_finite(origin) || !span(normal, l.u, l.v))
        return tl_fail(ctx, TL_ERR_ARG, "the plane of seeds has no place or no normal");
    double height = 0;
    for (int k = 0; k < 3; k++) {
        l.middle[k] = (bounds[2 * k] + bounds[2 * k + 1]) / 2;
        l.half = hypot(l.half, (bounds[2 * k + 1] - bounds[2 * k]) / 2);
        height += (l.middle[k] - origin[k]) * normal[k];
    }
    for (int k = 0; k < 3; k++) l.middle[k] -= height / vec_dot(normal, normal) * normal[k];
    double inside = (double)fill_plane(&l, bounds, PROBE_SIDE, NULL) / PROBE_SIDE / PROBE_SIDE;
    if (!(inside > 0)) return tl_fail(ctx, TL_ERR_ARG, "the plane of seeds does not meet the mesh");
    if (count > SEEDS_MAX) return make_points(ctx, count, seeds);
    size_t side = (size_t)ceil(sqrt((double)count / inside));
    if (side > SIDE_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "%zu seeds are too many for what the plane has in the box",
                       count);
    size_t all = side ? fill_plane(&l, bounds, side, NULL) : count;
    st = make_points(ctx, all, seeds);
    if (!st) fill_plane(&l, bounds, side, *seeds);
    return st;
}

tl_status tl_seeds_around(tl_ctx *ctx, const tl_polydata *points, double radius, size_t count,
                          tl_polydata **seeds)
{
    *seeds = NULL;
    if (!(radius > 0 && isfinite(radius)))
        return tl_fail(ctx, TL_ERR_ARG, "seeds around points need a radius above 0, not %g",
                       radius);
    if (count > SEEDS_MAX || points->vert_count > SEEDS_MAX / (count ? count : 1))
        return tl_fail(ctx, TL_ERR_ARG, "%zu seeds around %zu points are too many", count,
                       points->vert_count);
    tl_status st = make_points(ctx, count * points->vert_count, seeds);
    for (size_t p = 0; !st && p < points->vert_count; p++)
        for (size_t i = 0; i < count; i++) {
            double z = 1 - (2 * (double)i + 1) / (double)count, ring = sqrt(1 - z * z);
            double turn = GOLDEN_ANGLE * (double)i;
            const double at[3] = {ring * cos(turn), ring * sin(turn), z};
            double x[3];
            for (int k = 0; k < 3; k++) x[k] = points->xyz[3 * p + (size_t)k] + radius * at[k];
            push_point(*seeds, x);
        }
    return st;
}
