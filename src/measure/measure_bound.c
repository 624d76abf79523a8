/* How far a triangle can be from a surface: branch and bound, so that a Hausdorff distance is known
 * from above and not at samples only.
 *
 * Two bounds hold for a piece of the triangle. The distance to one triangle C of the surface is
 * convex, so over the piece it is largest at a corner, and the distance to the surface is not above
 * it. And the distance to the surface changes by no more than one moves. A piece that can't be
 * bounded well enough is cut along the side of C's prism that it crosses, so that on flat parts
 * every piece soon lies over one triangle and its bound is exact. Where it crosses none, it is cut
 * where two triangles that are nearest to different corners are equally far, as in a valley; else
 * it is halved. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "measure/measure.h"

enum { STACK_MAX = 128, CUT_PIECES_MAX = 3, DEAL_SPLITS_MAX = 128, BORDERS_MAX = 64 };

/* No point of a triangle is farther from the nearest corner than this times the longest side. */
static const double CORNER_REACH = 0.57735026918962576451;
/* Relative to the longest side of a piece: corners this near to a cutting plane lie on it. */
static const double CUT_SLACK = 1e-6;

typedef struct piece_corner {
    double x[3], distance;
    tl_lidx nearest;
} piece_corner;

typedef struct piece {
    piece_corner corners[3];
} piece;

/* Length of the side opposite corner i. */
static double side_length(const piece *p, int i)
{
    double e[3];
    vec_sub(p->corners[(i + 1) % 3].x, p->corners[(i + 2) % 3].x, e);
    return vec_length(e);
}

static int longest_side(const piece *p)
{
    double length[3] = {side_length(p, 0), side_length(p, 1), side_length(p, 2)};
    int i = length[1] > length[0] ? 1 : 0;
    return length[2] > length[i] ? 2 : i;
}

/* ---- bounds ---- */

/* The largest distance of the piece to one triangle of the surface. */
static double bound_by(const tli_bound_query *query, const piece *p, tl_lidx triangle)
{
    double largest = 0;
    for (int i = 0; i < 3; i++) {
        double distance2 = tli_surface_distance2(query->to, triangle, p->corners[i].x);
        if (distance2 > largest) largest = distance2;
    }
    return tli_surface_distance(largest, query->rounding);
}

/* No point of the piece is farther than the result. May raise *found by the distance of the piece's
 * centre; *centre receives the triangle nearest to it, or TL_NONE if it was not needed. */
static double piece_bound(const tli_bound_query *query, const piece *p, double *found,
                          tl_lidx *centre)
{
    double largest = 0, x[3];
    const piece_corner *c = p->corners;
    *centre = TL_NONE;
    for (int i = 0; i < 3; i++) largest = fmax(largest, c[i].distance);
    *found = fmax(*found, largest);
    if (c[0].nearest == c[1].nearest && c[0].nearest == c[2].nearest) return largest;
    double bound = largest + CORNER_REACH * side_length(p, longest_side(p));
    for (int i = 0; bound > *found && i < 3; i++) {
        tl_lidx nearest = p->corners[i].nearest;
        if (i > 0 && nearest == p->corners[i - 1].nearest) continue;
        bound = fmin(bound, bound_by(query, p, nearest));
    }
    if (bound <= *found) return bound;
    for (int k = 0; k < 3; k++)
        x[k] = (p->corners[0].x[k] + p->corners[1].x[k] + p->corners[2].x[k]) / 3;
    double distance2 = tli_surface_nearest(query->to, x, p->corners[0].nearest, centre);
    *found = fmax(*found, tli_surface_distance(distance2, query->rounding));
    return fmin(bound, bound_by(query, p, *centre));
}

/* ---- cutting ---- */

/* The point at parameter t from a to b. */
static piece_corner corner_between(const tli_bound_query *query, const piece_corner *a,
                                   const piece_corner *b, double t, tl_lidx hint)
{
    piece_corner c;
    for (int k = 0; k < 3; k++) c.x[k] = a->x[k] + t * (b->x[k] - a->x[k]);
    c.distance = tli_surface_distance(tli_surface_nearest(query->to, c.x, hint, &c.nearest),
                                      query->rounding);
    return c;
}

/* Signed distances of the corners to the plane that stands on side i of the triangle, outside
 * positive; false for a side without length or a triangle without area. */
static bool side_heights(const tli_surface *surface, tl_lidx triangle, int i, const piece *p,
                         double heights[3])
{
    double e0[3], e1[3], normal[3], outward[3], d[3];
    const double *from = tli_surface_corner(surface, triangle, i);
    vec_sub(tli_surface_corner(surface, triangle, (i + 1) % 3), from, e0);
    vec_sub(tli_surface_corner(surface, triangle, (i + 2) % 3), from, e1);
    vec_cross(e0, e1, normal);
    vec_cross(e0, normal, outward);
    double length = vec_length(outward);
    if (!(length > 0)) return false;
    for (int j = 0; j < 3; j++) {
        vec_sub(p->corners[j].x, from, d);
        heights[j] = vec_dot(outward, d) / length;
    }
    return true;
}

/* The side of the triangle's prism beyond which the piece reaches farthest while it also reaches
 * inside; corners on the plane get height 0. False if there is none. */
static bool best_side(const tli_surface *surface, tl_lidx triangle, const piece *p,
                      double heights[3])
{
    double slack = CUT_SLACK * side_length(p, longest_side(p)), best = slack;
    for (int i = 0; i < 3; i++) {
        double h[3];
        if (!side_heights(surface, triangle, i, p, h)) continue;
        double high = fmax(h[0], fmax(h[1], h[2])), low = fmin(h[0], fmin(h[1], h[2]));
        if (high <= best || low >= -slack) continue;
        best = high;
        for (int j = 0; j < 3; j++) heights[j] = fabs(h[j]) <= slack ? 0 : h[j];
    }
    return best > slack;
}

/* How much farther the corners are from the triangle nearest to one corner than from that nearest
 * to another: 0 where both are equally far. Of the pairs of corners the one that tells them apart
 * best; false if none does. */
static bool best_pair(const tli_surface *surface, const piece *p, double heights[3])
{
    double slack = CUT_SLACK * side_length(p, longest_side(p)), best = slack;
    for (int i = 0; i < 3; i++) {
        int next = (i + 1) % 3;
        tl_lidx a = p->corners[i].nearest, b = p->corners[next].nearest;
        if (a == b) continue;
        double h[3];
        for (int j = 0; j < 3; j++)
            h[j] = sqrt(tli_surface_distance2(surface, a, p->corners[j].x)) -
                   sqrt(tli_surface_distance2(surface, b, p->corners[j].x));
        double apart = fmin(-h[i], h[next]);
        if (apart <= best) continue;
        best = apart;
        for (int j = 0; j < 3; j++) heights[j] = fabs(h[j]) <= slack ? 0 : h[j];
    }
    return best > slack;
}

/* Cuts the piece at height 0 and returns the number of parts. */
static int cut_at_plane(const tli_bound_query *query, const piece *p, const double heights[3],
                        tl_lidx hint, piece parts[CUT_PIECES_MAX])
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        const piece_corner *a = &p->corners[i], *b = &p->corners[j], *c = &p->corners[k];
        if (heights[i] == 0) { /* from corner a to the other side */
            double t = heights[j] / (heights[j] - heights[k]);
            piece_corner m = corner_between(query, b, c, t, hint);
            parts[0] = (piece){{*a, *b, m}};
            parts[1] = (piece){{*a, m, *c}};
            return 2;
        }
        bool alone = (heights[i] > 0) != (heights[j] > 0) && (heights[i] > 0) != (heights[k] > 0);
        if (!alone || heights[j] == 0 || heights[k] == 0) continue;
        double t = heights[i] / (heights[i] - heights[j]);
        double u = heights[i] / (heights[i] - heights[k]);
        piece_corner m = corner_between(query, a, b, t, hint);
        piece_corner n = corner_between(query, a, c, u, hint);
        parts[0] = (piece){{*a, m, n}};
        parts[1] = (piece){{m, *b, *c}};
        parts[2] = (piece){{m, *c, n}};
        return 3;
    }
    return 0;
}

static int halve(const tli_bound_query *query, const piece *p, tl_lidx hint,
                 piece parts[CUT_PIECES_MAX])
{
    int i = longest_side(p);
    const piece_corner *a = &p->corners[i], *b = &p->corners[(i + 1) % 3],
                       *c = &p->corners[(i + 2) % 3];
    piece_corner m = corner_between(query, b, c, 0.5, hint);
    parts[0] = (piece){{*a, *b, m}};
    parts[1] = (piece){{*a, m, *c}};
    return 2;
}

static int cut(const tli_bound_query *query, const piece *p, tl_lidx centre,
               piece parts[CUT_PIECES_MAX])
{
    double heights[3];
    if (best_side(query->to, centre, p, heights) || best_pair(query->to, p, heights))
        return cut_at_plane(query, p, heights, centre, parts);
    return halve(query, p, centre, parts);
}

/* A triangle as one piece. */
static piece whole(const tli_bound_query *query, size_t triangle)
{
    piece p;
    for (int i = 0; i < 3; i++) {
        tl_lidx v = query->from->triangles[3 * triangle + (size_t)i];
        for (int k = 0; k < 3; k++) p.corners[i].x[k] = query->from->xyz[3 * (size_t)v + (size_t)k];
        p.corners[i].distance = query->distances[v];
        p.corners[i].nearest = query->nearest[v];
    }
    return p;
}

void tli_surface_bound(const tli_bound_query *query, size_t triangle, double *found, double *bound)
{
    piece stack[STACK_MAX];
    int depth = 1;
    unsigned splits = 0;
    double largest = query->found, above = 0;
    stack[0] = whole(query, triangle);
    while (depth > 0) {
        piece p = stack[--depth], parts[CUT_PIECES_MAX];
        tl_lidx centre;
        double reach = piece_bound(query, &p, &largest, &centre);
        double gap = fmax(query->tolerance, query->tolerance_relative * largest);
        if (!(reach > largest)) continue;
        if (reach <= largest + gap || splits == query->split_max ||
            (query->splits_left && *query->splits_left == 0) ||
            depth + CUT_PIECES_MAX > STACK_MAX) {
            above = fmax(above, reach);
            continue;
        }
        int count = cut(query, &p, centre, parts);
        splits++;
        if (query->splits_left) --*query->splits_left;
        for (int n = 0; n < count; n++) {
            stack[depth++] = parts[n];
            for (int i = 0; i < 3; i++) largest = fmax(largest, parts[n].corners[i].distance);
        }
    }
    *found = largest;
    *bound = fmax(above, largest);
}

/* ---- dealing ---- */

/* Sides of a triangle behind which another label begins, as in tli_deal_query. */
static bool is_border(const tli_deal_query *deal, tl_lidx triangle, int side)
{
    return deal->borders[triangle] >> side & 1;
}

/* Does the piece, which the plane on a side cuts at height 0, meet it beside the side itself? */
static bool meets_side(const tli_surface *surface, tl_lidx triangle, int side, const piece *p,
                       const double heights[3])
{
    double e[3], d[3], least = (double)INFINITY, most = (double)-INFINITY;
    const double *from = tli_surface_corner(surface, triangle, side);
    vec_sub(tli_surface_corner(surface, triangle, (side + 1) % 3), from, e);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        if ((heights[i] > 0) == (heights[j] > 0)) continue;
        double t = heights[i] / (heights[i] - heights[j]);
        for (int k = 0; k < 3; k++)
            d[k] = p->corners[i].x[k] + t * (p->corners[j].x[k] - p->corners[i].x[k]) - from[k];
        least = fmin(least, vec_dot(d, e));
        most = fmax(most, vec_dot(d, e));
    }
    return most > 0 && least < vec_dot(e, e);
}

/* Where the piece crosses a border. Among more triangles than the list holds it goes uncut. */
static bool find_border(const tli_deal_query *deal, const piece *p, double heights[3])
{
    tl_lidx list[BORDERS_MAX];
    const tli_surface *to = deal->to;
    double slack = CUT_SLACK * side_length(p, longest_side(p)), corners[9], reach = slack;
    for (int i = 0; i < 3; i++) {
        memcpy(corners + 3 * i, p->corners[i].x, sizeof p->corners[i].x);
        reach = fmax(reach, p->corners[i].distance);
    }
    size_t count = tli_surface_around(to, deal->borders, corners, reach, list, BORDERS_MAX);
    for (size_t n = 0; n < count && count <= BORDERS_MAX; n++)
        for (int side = 0; side < 3; side++) {
            double h[3];
            if (!is_border(deal, list[n], side)) continue;
            if (!side_heights(to, list[n], side, p, h)) continue;
            for (int j = 0; j < 3; j++) heights[j] = fabs(h[j]) <= slack ? 0 : h[j];
            bool crosses =
                fmax(h[0], fmax(h[1], h[2])) > slack && fmin(h[0], fmin(h[1], h[2])) < -slack;
            if (crosses && meets_side(to, list[n], side, p, heights)) return true;
        }
    return false;
}

/* The triangle that a piece goes to, or that it has to be cut first: *count parts. Around a corner
 * of the surface where labels meet a piece can pass from one to another beside all borders: it is
 * cut there, unless all of it is as near to a triangle as its corners are to the surface. */
static tl_lidx triangle_of(const tli_bound_query *query, const tli_deal_query *deal, const piece *p,
                           piece parts[CUT_PIECES_MAX], int *count)
{
    double centre[3], heights[3], own = 0, least = (double)INFINITY;
    const piece_corner *c = p->corners;
    tl_lidx near[4] = {c[0].nearest, c[0].nearest, c[1].nearest, c[2].nearest};
    tl_lidx best = near[0];
    bool one = true;
    *count = 0;
    if (near[1] == near[2] && near[1] == near[3]) return best;
    for (int k = 0; k < 3; k++) centre[k] = (c[0].x[k] + c[1].x[k] + c[2].x[k]) / 3;
    tli_surface_nearest(query->to, centre, near[0], &near[0]);
    bool can_cut = side_length(p, longest_side(p)) > deal->least;
    if (can_cut && find_border(deal, p, heights)) {
        *count = cut_at_plane(query, p, heights, near[0], parts);
        return near[0];
    }
    for (int n = 1; n < 4; n++) one = one && deal->labels[near[n]] == deal->labels[near[0]];
    if (one) return near[0];
    for (int n = 0; n < 4; n++) {
        double bound = bound_by(query, p, near[n]);
        if (n > 0) own = fmax(own, c[n - 1].distance);
        if (!(bound < least)) continue;
        least = bound;
        best = near[n];
    }
    if (can_cut && least > own + deal->least) *count = cut(query, p, near[0], parts);
    return best;
}

tl_status tli_surface_deal(const tli_bound_query *query, tli_deal_query *deal, size_t triangle,
                           tli_piece_fn fn, void *user)
{
    piece stack[STACK_MAX];
    int depth = 1;
    unsigned splits = 0;
    tl_status st = TL_OK;
    stack[0] = whole(query, triangle);
    while (!st && depth > 0) {
        piece p = stack[--depth], parts[CUT_PIECES_MAX];
        int count;
        tl_lidx nearest = triangle_of(query, deal, &p, parts, &count);
        if (count == 0 || splits == DEAL_SPLITS_MAX || deal->splits_left == 0 ||
            depth + CUT_PIECES_MAX > STACK_MAX) {
            double corners[9];
            for (int i = 0; i < 3; i++)
                memcpy(corners + 3 * i, p.corners[i].x, sizeof p.corners[i].x);
            st = fn(user, corners, nearest);
            continue;
        }
        splits++;
        deal->splits_left--;
        for (int n = 0; n < count; n++) stack[depth++] = parts[n];
    }
    return st;
}
