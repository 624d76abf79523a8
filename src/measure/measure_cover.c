/* Is a triangle within a small distance of a surface? It is cut at the prisms on the triangles of
 * the surface around it, a little widened. What lies in a prism is no farther from that triangle
 * than its corners are, and is taken off; nothing must be left. Where the answer is yes this takes
 * a fraction of the time of branch and bound, which asks for the nearest triangle at each corner.
 */
#include <string.h>

#include "base/base_vec.h"
#include "measure/measure.h"

/* Triangles that are looked at: among more, branch and bound is as fast. */
enum { TRIANGLES_MAX = 64 };
enum { CORNERS_MAX = 12, PIECES_MAX = 48 };
/* By how much prisms are widened, in parts of the distance. */
static const double WIDENED = 0.25;

/* A convex part of the triangle. */
typedef struct polygon {
    double x[CORNERS_MAX][3];
    int count;
} polygon;

typedef struct cover {
    const tli_surface *to;
    double most, reached;
    polygon left[PIECES_MAX]; /* not yet within the distance */
    int count;
} cover;

/* ---- prisms ---- */

typedef struct prism {
    double outward[3][3], offset[3]; /* unit normals of the sides */
    bool is_flat;                    /* no area: it has no prism */
} prism;

static void make_prism(const cover *c, tl_lidx triangle, prism *p)
{
    double e0[3], e1[3], normal[3];
    const double *a = tli_surface_corner(c->to, triangle, 0);
    vec_sub(tli_surface_corner(c->to, triangle, 1), a, e0);
    vec_sub(tli_surface_corner(c->to, triangle, 2), a, e1);
    vec_cross(e0, e1, normal);
    p->is_flat = false;
    for (int i = 0; i < 3; i++) {
        double e[3], *n = p->outward[i];
        const double *from = tli_surface_corner(c->to, triangle, i);
        vec_sub(tli_surface_corner(c->to, triangle, (i + 1) % 3), from, e);
        vec_cross(e, normal, n);
        double length = vec_length(n);
        p->is_flat |= !(length > 0);
        for (int k = 0; k < 3; k++) n[k] /= length;
        p->offset[i] = vec_dot(n, from) + WIDENED * c->most;
    }
}

/* ---- cutting ---- */

/* The part of a polygon where the heights are negative (or, sign -1, positive). */
static bool clip(const polygon *from, const double heights[CORNERS_MAX], double sign, polygon *to)
{
    to->count = 0;
    for (int i = 0; i < from->count; i++) {
        int j = i + 1 < from->count ? i + 1 : 0;
        double a = sign * heights[i], b = sign * heights[j];
        if (to->count + 2 > CORNERS_MAX) return false;
        if (a <= 0) memcpy(to->x[to->count++], from->x[i], sizeof from->x[i]);
        if ((a < 0 && b > 0) || (a > 0 && b < 0)) {
            double t = a / (a - b), *x = to->x[to->count++];
            for (int k = 0; k < 3; k++) x[k] = from->x[i][k] + t * (from->x[j][k] - from->x[i][k]);
        }
    }
    return true;
}

static void copy_polygon(const polygon *from, polygon *to)
{
    to->count = from->count;
    memcpy(to->x, from->x, (size_t)from->count * sizeof *from->x);
}

/* Takes what lies in the prism off piece n: it is replaced by what is left. False if there is no
 * room to do so, in which case nothing changes. */
static bool take_off(cover *c, int n, tl_lidx triangle, const prism *p)
{
    polygon inside, outside[3], next;
    int outside_count = 0;
    copy_polygon(&c->left[n], &inside);
    for (int side = 0; side < 3; side++) {
        double heights[CORNERS_MAX], high = (double)-INFINITY, low = (double)INFINITY;
        for (int i = 0; i < inside.count; i++) {
            heights[i] = vec_dot(p->outward[side], inside.x[i]) - p->offset[side];
            if (heights[i] > high) high = heights[i];
            if (heights[i] < low) low = heights[i];
        }
        if (low >= 0) return true;
        if (high <= 0) continue;
        if (!clip(&inside, heights, -1, &outside[outside_count++]) ||
            !clip(&inside, heights, 1, &next))
            return false;
        copy_polygon(&next, &inside);
    }
    double farthest = 0;
    for (int i = 0; i < inside.count; i++) {
        double distance2 = tli_surface_distance2(c->to, triangle, inside.x[i]);
        if (distance2 > farthest) farthest = distance2;
    }
    farthest = sqrt(farthest);
    if (farthest > c->most) return true;
    if (c->count - 1 + outside_count > PIECES_MAX) return false;
    c->reached = fmax(c->reached, farthest);
    if (n != --c->count) copy_polygon(&c->left[c->count], &c->left[n]);
    for (int i = 0; i < outside_count; i++) copy_polygon(&outside[i], &c->left[c->count++]);
    return true;
}

static bool take_triangle(cover *c, tl_lidx triangle)
{
    prism p;
    make_prism(c, triangle, &p);
    for (int n = c->count; !p.is_flat && n-- > 0;)
        if (!take_off(c, n, triangle, &p)) return false;
    return true;
}

/* Those in the middle first: they take off most, and what lies beside cuts off splinters. */
static void sort_list(const tli_surface *to, const double corners[9], tl_lidx *list, size_t count)
{
    double keys[TRIANGLES_MAX];
    for (size_t i = 0; i < count; i++) {
        double key = 0;
        tl_lidx t = list[i];
        for (int k = 0; k < 3; k++) {
            double d = tli_surface_corner(to, t, 0)[k] + tli_surface_corner(to, t, 1)[k] +
                       tli_surface_corner(to, t, 2)[k] - corners[k] - corners[3 + k] -
                       corners[6 + k];
            key += d * d;
        }
        size_t at = i;
        for (; at > 0 && keys[at - 1] > key; at--) {
            keys[at] = keys[at - 1];
            list[at] = list[at - 1];
        }
        keys[at] = key;
        list[at] = t;
    }
}

double tli_surface_cover(const tli_surface *to, const uint8_t *taken, const double corners[9],
                         double most)
{
    cover c; /* large: only what is used is set */
    tl_lidx list[TRIANGLES_MAX];
    c.to = to;
    c.most = most;
    c.reached = 0;
    c.left[0].count = 3;
    c.count = 1;
    memcpy(c.left[0].x, corners, 9 * sizeof *corners);
    size_t count = tli_surface_around(to, taken, corners, most, list, TRIANGLES_MAX);
    if (count > TRIANGLES_MAX) return (double)INFINITY;
    sort_list(to, corners, list, count);
    for (size_t i = 0; i < count && c.count > 0; i++)
        if (!take_triangle(&c, list[i])) return (double)INFINITY;
    return c.count > 0 ? (double)INFINITY : c.reached;
}
