/* Lines through a mesh for picking. The line is cut into pieces; the locator names the tets whose
 * boxes touch the box of a piece, each is cut with the line by its barycentric weights, which are
 * linear along it. So nothing depends on adjacency: gaps, several components and inverted tets are
 * no special cases. */
#include "view/view_ray.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/base_vec.h"
#include "draw/draw.h"
#include "mesh/mesh.h"

/* Pieces of a line: the box of a piece has few tets, however it runs. */
enum { PIECES_MIN = 4, PIECES_MAX = 512, SPANS_FIRST = 64 };
/* A line that runs in a face belongs to the tets on both sides: weights down to minus this count,
 * so that rounding does not lose it between them. */
static const double WEIGHT_SLACK = 1e-12;
/* A channel varies over a tet by so many steps of its transfer function at most to be taken as one
 * part. */
static const double PART_STEPS = 16;
enum { PARTS_MAX = 256 };

/* ---- the tets of a line ---- */

/* The spans of a piece, and where they go. */
typedef struct walk {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const double *xyz;
    const tl_lidx *tets;
    double base[3], direction[3]; /* of the piece */
    double length;
    tli_span *spans;
    size_t span_count, span_max;
    tl_status status;
} walk;

/* Narrows from .. to down to where the weight a + t * b is not negative; false: nowhere. */
static bool narrow(double a, double b, double *from, double *to)
{
    a += WEIGHT_SLACK;
    if (b > 0 && -a / b > *from) *from = -a / b;
    if (b < 0 && -a / b < *to) *to = -a / b;
    return b != 0 || a >= 0;
}

static void put_weights(const double a[4], const double b[4], double t, double weights[4])
{
    double sum = 0;
    for (int i = 0; i < 4; i++) {
        weights[i] = fmax(a[i] + t * b[i], 0);
        sum += weights[i];
    }
    for (int i = 0; i < 4; i++) weights[i] /= sum;
}

static bool add_span(void *user, tl_lidx tet)
{
    walk *w = user;
    double p[4][3], end[3], a[4], b[4], from = 0, to = w->length;
    tli_tet_corners(w->xyz, w->tets + 4 * (size_t)tet, p);
    for (int k = 0; k < 3; k++) end[k] = w->base[k] + w->length * w->direction[k];
    if (!tl_tet_weights(TLI_CORNERS(p), w->base, a) || !tl_tet_weights(TLI_CORNERS(p), end, b))
        return true;
    for (int i = 0; i < 4; i++) b[i] = (b[i] - a[i]) / w->length;
    for (int i = 0; i < 4; i++)
        if (!narrow(a[i], b[i], &from, &to)) return true;
    if (!(from < to)) return true;
    if (w->span_count == w->span_max) {
        const size_t most = w->span_max ? 2 * w->span_max : SPANS_FIRST;
        tli_span *grown = tl_mem_resize(w->ctx, w->spans, most, sizeof *grown, &w->status);
        if (w->status) return false;
        w->spans = grown;
        w->span_max = most;
    }
    tli_span *span = &w->spans[w->span_count++];
    *span = (tli_span){.tet = tet, .t = {from, to}};
    put_weights(a, b, from, span->weights[0]);
    put_weights(a, b, to, span->weights[1]);
    return true;
}

static int by_entry(const void *a, const void *b)
{
    const tli_span *x = a, *y = b;
    if (x->t[0] != y->t[0]) return x->t[0] < y->t[0] ? -1 : 1;
    return (x->tet > y->tet) - (x->tet < y->tet);
}

/* The part of a line in a box; false: none. */
static bool meet_box(const tli_sight *sight, const double bounds[6], double t[2])
{
    t[0] = sight->least;
    t[1] = (double)INFINITY;
    for (int k = 0; k < 3; k++) {
        const double low = bounds[2 * k] - sight->origin[k], d = sight->direction[k];
        const double high = bounds[2 * k + 1] - sight->origin[k];
        if (d == 0 && (low > 0 || high < 0)) return false;
        if (d == 0) continue;
        t[0] = fmax(t[0], fmin(low / d, high / d));
        t[1] = fmin(t[1], fmax(low / d, high / d));
    }
    return t[0] < t[1] && isfinite(t[0]) && isfinite(t[1]);
}

static size_t piece_count(const tl_mesh *mesh)
{
    const double n = cbrt((double)tl_mesh_tet_count(mesh));
    return n < PIECES_MIN ? PIECES_MIN : n > PIECES_MAX ? PIECES_MAX : (size_t)n;
}

/* The spans of the line from t to t + length, sorted, with their places along all of the line. */
static void collect(walk *w, const tl_locator *locator, const tli_sight *sight, double t,
                    double length)
{
    double low[3], high[3];
    w->span_count = 0;
    w->length = length;
    for (int k = 0; k < 3; k++) {
        w->base[k] = sight->origin[k] + t * sight->direction[k];
        const double end = w->base[k] + length * sight->direction[k];
        low[k] = fmin(w->base[k], end);
        high[k] = fmax(w->base[k], end);
    }
    tli_locator_box(locator, low, high, add_span, w);
    if (w->span_count) qsort(w->spans, w->span_count, sizeof *w->spans, by_entry);
    for (size_t i = 0; i < w->span_count; i++)
        for (int end = 0; end < 2; end++) w->spans[i].t[end] += t;
}

/* Hands a span on but for what the ones before it had. */
static bool hand_on(const tli_span *span, double *reached, tli_span_fn fn, void *user)
{
    tli_span rest = *span;
    if (!(span->t[1] > *reached)) return true;
    if (span->t[0] < *reached) {
        const double w = (*reached - span->t[0]) / (span->t[1] - span->t[0]);
        for (int i = 0; i < 4; i++)
            rest.weights[0][i] += w * (span->weights[1][i] - span->weights[0][i]);
        rest.t[0] = *reached;
    }
    *reached = rest.t[1];
    return fn(user, &rest);
}

tl_status tli_sight_walk(tl_ctx *ctx, const tl_mesh *mesh, const tl_locator *locator,
                         const double bounds[6], const tli_sight *sight, tli_span_fn fn, void *user)
{
    double t[2], reached = -(double)INFINITY;
    if (!meet_box(sight, bounds, t)) return TL_OK;
    walk w = {.ctx = ctx, .mesh = mesh, .xyz = tl_mesh_xyz(mesh), .tets = tl_mesh_tets(mesh)};
    const size_t pieces = piece_count(mesh);
    const double length = (t[1] - t[0]) / (double)pieces;
    bool goes_on = true;
    memcpy(w.direction, sight->direction, sizeof w.direction);
    for (size_t i = 0; goes_on && !w.status && i < pieces; i++) {
        collect(&w, locator, sight, t[0] + (double)i * length, length);
        for (size_t s = 0; goes_on && !w.status && s < w.span_count; s++)
            goes_on = hand_on(&w.spans[s], &reached, fn, user);
    }
    tl_mem_free(ctx, w.spans);
    return w.status;
}

/* ---- what is met ---- */

static double value_at(const tl_mesh *mesh, const double *scalar, const tli_span *span, int end)
{
    double sum = 0;
    const tl_lidx *tet = tl_mesh_tets(mesh) + 4 * (size_t)span->tet;
    for (int i = 0; i < 4; i++)
        if (span->weights[end][i] != 0) sum += span->weights[end][i] * scalar[tet[i]];
    return sum;
}

/* Optical depth on the way, up to where it is as much as is sought. */
typedef struct gathering {
    const tl_mesh *mesh;
    const tli_fog *fog;
    const tli_veil *veils;
    size_t veil_count, passed;
    double end, depth, sought, t;
    bool is_found;
} gathering;

/* Adds a depth between t and t + length; false: it is found. */
static bool add_depth(gathering *g, double t, double length, double depth)
{
    if (depth > 0 && g->depth + depth >= g->sought) {
        g->t = t + length * ((g->sought - g->depth) / depth);
        g->is_found = true;
        return false;
    }
    g->depth += depth;
    return true;
}

/* Adds the veils before t. */
static bool pass_veils(gathering *g, double t)
{
    while (g->passed < g->veil_count && g->veils[g->passed].t <= t) {
        const tli_veil *veil = &g->veils[g->passed++];
        if (!add_depth(g, veil->t, 0, veil->depth)) return false;
    }
    return true;
}

static bool gather(void *user, const tli_span *span)
{
    gathering *g = user;
    const double a = value_at(g->mesh, g->fog->scalar, span, 0);
    const double b = value_at(g->mesh, g->fog->scalar, span, 1);
    const double wanted = fabs(b - a) * g->fog->transfer->per_value / PART_STEPS;
    const int parts = wanted < PARTS_MAX - 1 ? 1 + (int)wanted : PARTS_MAX; /* NaN: all clear */
    const double length = (span->t[1] - span->t[0]) / parts;
    for (int i = 0; i < parts; i++) {
        float rgb[3];
        double extinction;
        const double t = span->t[0] + i * length;
        if (t >= g->end || !pass_veils(g, t)) return false;
        tl_transfer_at(g->fog->transfer, a + (b - a) * (i + 0.5) / parts, rgb, &extinction);
        if (!add_depth(g, t, length, extinction * length)) return false;
    }
    return true;
}

tl_status tli_sight_half(tl_ctx *ctx, const tl_mesh *mesh, const tl_locator *locator,
                         const double bounds[6], const tli_sight *sight, const tli_fog *fog,
                         const tli_veil *veils, size_t veil_count, double end, double *t,
                         bool *is_hit)
{
    tl_status st = TL_OK;
    const gathering begin = {.mesh = mesh,
                             .fog = fog,
                             .veils = veils,
                             .veil_count = veil_count,
                             .end = end,
                             .sought = (double)INFINITY};
    gathering g = begin;
    *is_hit = false;
    double opacity = 1;
    if (!isfinite(end)) {
        if (fog->scalar) st = tli_sight_walk(ctx, mesh, locator, bounds, sight, gather, &g);
        pass_veils(&g, end);
        opacity = -expm1(-g.depth);
        if (st || opacity < TLI_SIGHT_SEEN) return st;
    }
    g = begin;
    g.sought = -log1p(-opacity / 2);
    if (fog->scalar) st = tli_sight_walk(ctx, mesh, locator, bounds, sight, gather, &g);
    if (!st && !g.is_found) pass_veils(&g, end);
    *t = g.is_found ? fmin(g.t, end) : end;
    *is_hit = !st && isfinite(*t);
    return st;
}

bool tli_sight_triangle(const tli_sight *sight, const double corners[3][3], double *t)
{
    double side[2][3], from[3], across[3], turned[3];
    vec_sub(corners[1], corners[0], side[0]);
    vec_sub(corners[2], corners[0], side[1]);
    vec_cross(sight->direction, side[1], across);
    const double volume = vec_dot(side[0], across);
    if (volume == 0) return false;
    vec_sub(sight->origin, corners[0], from);
    const double u = vec_dot(from, across) / volume;
    vec_cross(from, side[0], turned);
    const double v = vec_dot(sight->direction, turned) / volume;
    *t = vec_dot(side[1], turned) / volume;
    return u >= 0 && v >= 0 && u + v <= 1 && *t >= sight->least; /* false for NaN */
}

typedef struct meeting {
    const tl_mesh *mesh;
    const double *scalar; /* NULL: the mesh */
    double value, t;
    bool is_found;
} meeting;

static bool meet(void *user, const tli_span *span)
{
    meeting *m = user;
    if (m->scalar) {
        const double a = value_at(m->mesh, m->scalar, span, 0) - m->value;
        const double b = value_at(m->mesh, m->scalar, span, 1) - m->value;
        if (!(a <= 0 && b >= 0) && !(a >= 0 && b <= 0)) return true;
        m->t = a == b ? span->t[0] : span->t[0] + (span->t[1] - span->t[0]) * (a / (a - b));
    } else {
        m->t = span->t[0];
    }
    m->is_found = true;
    return false;
}

tl_status tli_sight_meet(tl_ctx *ctx, const tl_mesh *mesh, const tl_locator *locator,
                         const double bounds[6], const tli_sight *sight, const double *scalar,
                         double value, double *t, bool *is_hit)
{
    meeting m = {.mesh = mesh, .scalar = scalar, .value = value};
    tl_status st = tli_sight_walk(ctx, mesh, locator, bounds, sight, meet, &m);
    *t = m.t;
    *is_hit = !st && m.is_found;
    return st;
}
