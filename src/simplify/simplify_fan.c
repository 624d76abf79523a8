/* How far a collapse moves a surface. The fans before and after have the same rim; seen along their
 * mean normal they cover the same plane region, so the vertical distance between them is piecewise
 * linear over the overlay of the two and largest at one of its corners: a bound on the two-sided
 * Hausdorff distance that is exact for small bends. Where a fan can't be seen so, the simplicial
 * map that moves both ends to the new place bounds the distance. */
#include "base/base_vec.h"
#include "simplify/simplify_hood.h"

/* A point counts as inside a projected triangle down to this barycentric weight. */
static const double INSIDE = -1e-9;
/* A fan whose summed normal is shorter than this part of its area folds back on itself. */
static const double FOLD = 0.2;

enum { FAN_POINTS = 2 * TLI_FAN_MAX + 3 };

/* A sheet of the fan in a frame with the mean normal as third axis; point 0 is the new place. */
typedef struct sheet {
    double at[FAN_POINTS][3];
    uint16_t from[FAN_POINTS]; /* local vertex of a point */
    uint16_t point_count;
    uint16_t tris[TLI_FAN_MAX][3], tri_count;    /* before */
    uint16_t fresh[TLI_FAN_MAX][2], fresh_count; /* after: place and two rim points */
    uint16_t u, v;                               /* points of the ends, 0 when absent */
} sheet;

/* Sum of the area normals of one group (all when group is NULL) and of their lengths. */
static double sum_normals(const tli_work *w, const tli_hood *h, const int64_t *group, double n[3])
{
    double lengths = 0;
    n[0] = n[1] = n[2] = 0;
    for (uint32_t i = 0; i < h->fan_count; i++) {
        if (group && h->fan[i].group != *group) continue;
        const uint16_t *l = h->fan[i].verts;
        double a[3], b[3], c[3];
        vec_sub(w->verts[h->verts[l[1]]].xyz, w->verts[h->verts[l[0]]].xyz, a);
        vec_sub(w->verts[h->verts[l[2]]].xyz, w->verts[h->verts[l[0]]].xyz, b);
        vec_cross(a, b, c);
        for (int j = 0; j < 3; j++) n[j] += c[j];
        lengths += vec_length(c);
    }
    return lengths;
}

bool tli_fan_volume_plane(const tli_work *w, const tli_hood *h, double normal[3], double *offset)
{
    double lengths = sum_normals(w, h, NULL, normal), total = 0;
    if (!(vec_length(normal) > FOLD * lengths)) return false;
    for (uint32_t i = 0; i < h->fan_count; i++) {
        const uint16_t *l = h->fan[i].verts;
        double a[3], b[3], c[3], o[3];
        vec_sub(w->verts[h->verts[l[1]]].xyz, w->verts[h->verts[l[0]]].xyz, a);
        vec_sub(w->verts[h->verts[l[2]]].xyz, w->verts[h->verts[l[0]]].xyz, b);
        vec_sub(w->verts[h->verts[l[0]]].xyz, w->verts[h->ends[0]].xyz, o);
        vec_cross(a, b, c);
        total += vec_dot(c, o);
    }
    *offset = total;
    return true;
}

/* The tets between place and the old faces. Those of interfaces (even groups) part the volume. */
double tli_fan_volume_change(const tli_work *w, const tli_hood *h, const double place[3])
{
    double total = 0;
    for (uint32_t i = 0; i < h->fan_count; i++) {
        const uint16_t *l = h->fan[i].verts;
        double a[3], b[3], c[3], o[3];
        if (!(h->fan[i].group & 1)) continue;
        vec_sub(w->verts[h->verts[l[1]]].xyz, w->verts[h->verts[l[0]]].xyz, a);
        vec_sub(w->verts[h->verts[l[2]]].xyz, w->verts[h->verts[l[0]]].xyz, b);
        vec_sub(place, w->verts[h->verts[l[0]]].xyz, o);
        vec_cross(a, b, c);
        total += vec_dot(c, o);
    }
    return total / 6;
}

static uint16_t point_of(sheet *s, uint16_t l)
{
    for (uint16_t i = 1; i < s->point_count; i++)
        if (s->from[i] == l) return i;
    s->from[s->point_count] = l;
    return s->point_count++;
}

/* Projects one group of the fan; moved_v replaces the place of v (curves). */
static bool make_sheet(const tli_work *w, const tli_hood *h, int64_t group, const double place[3],
                       const double *moved_v, sheet *s)
{
    double n[3], x[3] = {0, 0, 0}, y[3];
    double lengths = sum_normals(w, h, &group, n), l = vec_length(n);
    if (!(l > FOLD * lengths)) return false;
    for (int i = 0; i < 3; i++) n[i] /= l;
    x[fabs(n[0]) < 0.6 ? 0 : fabs(n[1]) < 0.6 ? 1 : 2] = 1;
    vec_cross(n, x, y);
    l = vec_length(y);
    for (int i = 0; i < 3; i++) y[i] /= l;
    vec_cross(y, n, x);
    s->point_count = 1;
    s->tri_count = s->fresh_count = 0;
    for (uint32_t i = 0; i < h->fan_count; i++) {
        if (h->fan[i].group != group) continue;
        const uint16_t *f = h->fan[i].verts;
        uint16_t rim[2], rims = 0;
        for (int j = 0; j < 3; j++) s->tris[s->tri_count][j] = point_of(s, f[j]);
        for (int j = 0; j < 3; j++)
            if (f[j] <= 1 && f[(j + 1) % 3] > 1 && f[(j + 2) % 3] > 1) {
                rim[0] = s->tris[s->tri_count][(j + 1) % 3];
                rim[1] = s->tris[s->tri_count][(j + 2) % 3];
                rims = 2;
            }
        s->tri_count++;
        if (rims) memcpy(s->fresh[s->fresh_count++], rim, sizeof rim);
    }
    s->u = s->v = 0;
    memset(s->at[0], 0, sizeof s->at[0]);
    for (uint16_t i = 1; i < s->point_count; i++) {
        double d[3];
        vec_sub(s->from[i] == 1 && moved_v ? moved_v : w->verts[h->verts[s->from[i]]].xyz, place,
                d);
        s->at[i][0] = vec_dot(d, x);
        s->at[i][1] = vec_dot(d, y);
        s->at[i][2] = vec_dot(d, n);
        if (s->from[i] == 0) s->u = i;
        if (s->from[i] == 1) s->v = i;
    }
    return true;
}

static double area2(const double *a, const double *b, const double *c)
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Every triangle faces up, and the new fan winds once around its place (closed fans) or less. */
static bool sheet_is_graph(const sheet *s)
{
    int turns = 0;
    for (uint16_t i = 0; i < s->tri_count; i++)
        if (!(area2(s->at[s->tris[i][0]], s->at[s->tris[i][1]], s->at[s->tris[i][2]]) > 0))
            return false;
    for (uint16_t i = 0; i < s->fresh_count; i++) {
        const double *a = s->at[s->fresh[i][0]], *b = s->at[s->fresh[i][1]];
        if (!(area2(s->at[0], a, b) > 0)) return false;
        turns += a[1] < 0 && b[1] >= 0;
    }
    return turns <= 1;
}

/* Height of a triangle below or above p if it holds p; weight receives the least barycentric one.
 */
static double height_over(const double *a, const double *b, const double *c, const double *p,
                          double *weight)
{
    double whole = area2(a, b, c);
    double u = area2(p, b, c) / whole, v = area2(a, p, c) / whole, t = 1 - u - v;
    *weight = u < v ? (u < t ? u : t) : (v < t ? v : t);
    return u * a[2] + v * b[2] + t * c[2] - p[2];
}

/* Vertical distance of a point to the old (fresh false) or new fan; negative when none holds it. */
static double distance_to_fan(const sheet *s, bool fresh, uint16_t point)
{
    double best = -1e300, height = 0;
    uint16_t count = fresh ? s->fresh_count : s->tri_count;
    for (uint16_t i = 0; i < count; i++) {
        double weight, z = fresh ? height_over(s->at[0], s->at[s->fresh[i][0]],
                                               s->at[s->fresh[i][1]], s->at[point], &weight)
                                 : height_over(s->at[s->tris[i][0]], s->at[s->tris[i][1]],
                                               s->at[s->tris[i][2]], s->at[point], &weight);
        if (weight > best) best = weight, height = z;
    }
    return best < INSIDE ? -1 : fabs(height);
}

/* Largest vertical distance where old inner edges cross new ones. */
static double crossing_distance(const sheet *s)
{
    double largest = 0, side[FAN_POINTS]; /* of the line from 0 to r */
    for (uint16_t k = 0; k < s->fresh_count; k++) {
        const double *r = s->at[s->fresh[k][0]]; /* the new edge runs from 0 to r */
        for (uint16_t i = 1; i < s->point_count; i++)
            side[i] = r[0] * s->at[i][1] - r[1] * s->at[i][0];
        for (uint16_t i = 0; i < s->tri_count; i++)
            for (int j = 0; j < 3; j++) {
                uint16_t a = s->tris[i][j], b = s->tris[i][j < 2 ? j + 1 : 0];
                if (a != s->u && a != s->v && b != s->u && b != s->v) continue;
                double dp = side[a], dq = side[b];
                if (dp * dq >= 0) continue;
                const double *p = s->at[a], *q = s->at[b];
                double t = dp / (dp - dq), x = p[0] + t * (q[0] - p[0]),
                       y = p[1] + t * (q[1] - p[1]);
                double at = (x * r[0] + y * r[1]) / (r[0] * r[0] + r[1] * r[1]);
                if (!(at >= 0 && at <= 1)) continue;
                double z = fabs(p[2] + t * (q[2] - p[2]) - at * r[2]);
                if (z > largest) largest = z;
            }
    }
    return largest;
}

static double sheet_distance(const sheet *s, double rounding, double most)
{
    double flat = 0;
    if (!sheet_is_graph(s)) return -1;
    for (uint16_t i = 0; i < s->point_count; i++)
        if (fabs(s->at[i][2]) > flat) flat = fabs(s->at[i][2]);
    if (flat < rounding) return 0;
    double at_place = distance_to_fan(s, false, 0), at_u = 0, at_v = 0;
    if (s->u) at_u = distance_to_fan(s, true, s->u);
    if (s->v) at_v = distance_to_fan(s, true, s->v);
    if (at_place < 0 || at_u < 0 || at_v < 0) return -1;
    double largest = at_place > at_u ? at_place : at_u;
    if (at_v > largest) largest = at_v;
    if (largest > most && largest > rounding) return largest;
    double crossing = crossing_distance(s);
    return crossing > largest ? crossing : largest;
}

/* On a curve the rim of the sheets moves from u - v - next to u - next, v being the end that goes:
 * v is first moved onto the straight line. Gives its place there; returns the way, or -1. */
static double straighten_curve(const tli_work *w, const tli_hood *h, unsigned goes, double moved[3])
{
    uint8_t degree[TLI_HOOD_VERTS];
    uint16_t next = 0;
    memset(degree, 0, h->vert_count);
    for (uint32_t i = 0; i < h->fan_count; i++) {
        const uint16_t *l = h->fan[i].verts;
        if (l[0] != goes && l[1] != goes && l[2] != goes) continue;
        for (int j = 0; j < 3; j++) degree[l[j]]++;
    }
    for (uint16_t l = 2; l < h->vert_count; l++)
        if (degree[l] != 0 && degree[l] != 2) {
            if (next) return -1;
            next = l;
        }
    if (!next) return -1;
    double a[3], b[3], way[3];
    const double *stay = w->verts[h->ends[1 - goes]].xyz;
    vec_sub(w->verts[h->verts[next]].xyz, stay, a);
    vec_sub(w->verts[h->ends[goes]].xyz, stay, b);
    double t = vec_dot(a, b) / vec_dot(a, a);
    if (!(t >= 0 && t <= 1)) return -1;
    for (int i = 0; i < 3; i++) moved[i] = stay[i] + t * a[i];
    vec_sub(moved, w->verts[h->ends[goes]].xyz, way);
    return vec_length(way);
}

/* A fan in one plane stays there when no face turns: the most frequent case by far. */
static bool stays_flat(const tli_work *w, const tli_hood *h, const double place[3])
{
    double n[3], a[3], b[3], c[3];
    const double *origin = w->verts[h->ends[0]].xyz;
    double lengths = sum_normals(w, h, NULL, n), slack = vec_length(n);
    if (!(slack > 0.999 * lengths)) return false;
    slack *= w->rounding;
    vec_sub(place, origin, a);
    if (!(fabs(vec_dot(a, n)) < slack)) return false;
    for (uint32_t i = 0; i < h->fan_count; i++) {
        const double *x[3];
        unsigned ends = 0;
        for (int j = 0; j < 3; j++) {
            uint16_t l = h->fan[i].verts[j];
            x[j] = l <= 1 ? place : w->verts[h->verts[l]].xyz;
            ends += l <= 1;
            vec_sub(w->verts[h->verts[l]].xyz, origin, a);
            if (!(fabs(vec_dot(a, n)) < slack)) return false;
        }
        if (ends == 2) continue;
        vec_sub(x[1], x[0], a);
        vec_sub(x[2], x[0], b);
        vec_cross(a, b, c);
        if (!(vec_dot(c, n) > 0)) return false;
    }
    return true;
}

double tli_fan_distance(const tli_work *w, const tli_hood *h, const double place[3], double most)
{
    double way[3], simple = 0, total = 0, moved[3], straight = 0;
    for (int e = 0; e < 2; e++) {
        vec_sub(place, w->verts[h->ends[e]].xyz, way);
        if (vec_dot(way, way) > simple) simple = vec_dot(way, way);
    }
    simple = sqrt(simple);
    bool curve = w->verts[h->ends[0]].kind >= TLI_CURVE && w->verts[h->ends[1]].kind >= TLI_CURVE;
    if (!curve && stays_flat(w, h, place)) return 0;
    if (curve) {
        bool v_stays = memcmp(place, w->verts[h->ends[1]].xyz, sizeof way) == 0;
        straight = v_stays ? -1 : straighten_curve(w, h, 1, moved);
        if (straight < 0) return simple;
    }
    for (uint32_t i = 0; i < h->fan_count; i++) {
        bool seen = false;
        for (uint32_t j = 0; j < i; j++) seen = seen || h->fan[j].group == h->fan[i].group;
        if (seen) continue;
        sheet s;
        if (!make_sheet(w, h, h->fan[i].group, place, curve ? moved : NULL, &s)) return simple;
        double d = sheet_distance(&s, w->rounding, most);
        if (d < 0) return simple;
        if (d > total) total = d;
    }
    total += straight;
    if (total < w->rounding) return 0;
    return total < simple ? total : simple;
}
