/* The promises of a cut, measured by brute force at every vertex of the original and at the
 * centroid of every tet (DESIGN.md, section 5), and the distance of the boundaries, both ways. */
#include "cut/cut_prover.h"

#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "measure/measure.h"

/* Rounding of a measured error, relative to the values at hand. */
static const double SLACK = 1e-9;
enum { GRAIN = 1024 };

/* Where the original vertices lie in the mesh of a cut. */
typedef struct places {
    tl_lidx *tets;
    double (*weights)[4], *outside;
    double *errors;
} places;

/* The difference at the nearest point of a tet. */
static double error_in_tet(const tl_mesh *mesh, const tl_channel *copy, const tl_channel *channel,
                           size_t v, tl_lidx tet, const double w[4])
{
    const tl_lidx self[4] = {(tl_lidx)v, (tl_lidx)v, (tl_lidx)v, (tl_lidx)v};
    const double whole[4] = {1, 0, 0, 0};
    tli_tet_point here = tli_tet_point_make(self, whole);
    tli_tet_point there = tli_tet_point_make(mesh->tets + 4 * (size_t)tet, w);
    return tli_point_error(channel, &here, copy, &there);
}

/* The search for a point within reach of a vertex whose value is within the bound. */
typedef struct search {
    const tl_mesh *mesh;
    const tl_channel *copy, *channel;
    size_t vert;
    const double *x;
    double reach, bound;
    bool found;
} search;

/* The nearest point of the tet, and its corners: of a flat tet several may lie at one place, each
 * with a value of its own. */
static bool look_in_tet(void *user, tl_lidx tet)
{
    search *s = user;
    double p[4][3], w[4];
    tli_tet_corners(s->mesh->xyz, s->mesh->tets + 4 * (size_t)tet, p);
    if (tl_tet_nearest(TLI_CORNERS(p), s->x, w) > s->reach) return true;
    s->found = error_in_tet(s->mesh, s->copy, s->channel, s->vert, tet, w) <= s->bound;
    for (int i = 0; i < 4 && !s->found; i++) {
        double corner[4] = {0}, to[3];
        corner[i] = 1;
        vec_sub(p[i], s->x, to);
        s->found = vec_length(to) <= s->reach &&
                   error_in_tet(s->mesh, s->copy, s->channel, s->vert, tet, corner) <= s->bound;
    }
    return !s->found;
}

/* Is there one? All tets within reach are asked. */
static bool holds_elsewhere(const tl_locator *locator, search *s)
{
    double low[3], high[3];
    for (int k = 0; k < 3; k++) {
        low[k] = s->x[k] - s->reach;
        high[k] = s->x[k] + s->reach;
    }
    s->found = false;
    tli_locator_box(locator, low, high, look_in_tet, s);
    return s->found;
}

static void note_channel(tl_cut_check_channel *r, double promised, double measured, bool uniform)
{
    if (r->promised == 0 || measured * r->promised > r->measured * promised) {
        r->promised = promised;
        r->measured = measured;
    }
    if (uniform && measured > 0 && promised > r->looseness * measured)
        r->looseness = promised / measured;
}

/* One on vertices and one on tets may have the same name. */
static const tl_channel *find_channel(const tl_mesh *mesh, const char *name, tl_on on)
{
    for (size_t c = 0; c < mesh->channel_count; c++)
        if (mesh->channels[c].on == on && strcmp(mesh->channels[c].name, name) == 0)
            return &mesh->channels[c];
    return NULL;
}

/* ---- channels on tets ---- */

typedef struct cells {
    const tl_mesh *original, *mesh;
    const tl_channel *channel, *copy;
    const tl_locator *locator;
    double reach, bound;
    double *errors; /* [tet_count] of the original */
} cells;

/* Infinite where the copy has no number and the original one. */
static double cell_error(const cells *c, size_t original, tl_lidx tet)
{
    const uint32_t n = c->channel->components;
    double sum = 0;
    for (uint32_t k = 0; k < n; k++) {
        const double before = c->channel->values[original * n + k];
        const double off = before - c->copy->values[tet * (size_t)n + k];
        if (!isfinite(before)) return 0;
        sum += off * off;
    }
    return isnan(sum) ? (double)INFINITY : sqrt(sum);
}

typedef struct cell_search {
    const cells *cells;
    size_t original;
    const double *x;
    bool found;
} cell_search;

static bool look_at_cell(void *user, tl_lidx tet)
{
    cell_search *s = user;
    double p[4][3], w[4];
    tli_tet_corners(s->cells->mesh->xyz, s->cells->mesh->tets + 4 * (size_t)tet, p);
    s->found = tl_tet_nearest(TLI_CORNERS(p), s->x, w) <= s->cells->reach &&
               cell_error(s->cells, s->original, tet) <= s->cells->bound;
    return !s->found;
}

/* The error at a centroid, and the bound where a tet within reach keeps that. */
static tl_status measure_cells(void *arg, size_t begin, size_t end, unsigned worker)
{
    const cells *c = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        double p[4][3], x[3], low[3], high[3];
        tli_tet_corners(c->original->xyz, c->original->tets + 4 * t, p);
        for (int k = 0; k < 3; k++) {
            x[k] = (p[0][k] + p[1][k] + p[2][k] + p[3][k]) / 4;
            low[k] = x[k] - c->reach;
            high[k] = x[k] + c->reach;
        }
        tl_lidx tet = tl_locator_nearest(c->locator, x, TL_NONE, NULL, NULL);
        c->errors[t] = 0;
        if (tet == TL_NONE) continue; /* a place that is not finite is not promised */
        c->errors[t] = cell_error(c, t, tet);
        if (c->errors[t] <= c->bound) continue;
        cell_search s = {c, t, x, false};
        tli_locator_box(c->locator, low, high, look_at_cell, &s);
        if (s.found) c->errors[t] = c->bound;
    }
    return TL_OK;
}

static tl_status prove_cells(tli_prover *p, const tl_mesh *mesh, const tl_locator *locator,
                             size_t number, double reach, bool uniform)
{
    tl_status st = TL_OK;
    const tl_store_channel *stored = &p->head->channels[number];
    const double promised = tl_cut_channel_error(p->cut, number);
    const double slack = SLACK * (stored->range[1] - stored->range[0] + fabs(stored->range[1]));
    cells c = {.original = p->original,
               .mesh = mesh,
               .channel = find_channel(p->original, stored->name, TL_ON_TET),
               .copy = find_channel(mesh, stored->name, TL_ON_TET),
               .locator = locator,
               .reach = reach,
               .bound = promised + slack};
    double measured = 0;
    if (!c.channel || !c.copy || c.channel->components != c.copy->components)
        return tl_fail(p->ctx, TL_ERR_DATA, "the original has no channel '%s' on tets",
                       stored->name);
    c.errors = tl_mem_alloc(p->ctx, p->original->tet_count, sizeof *c.errors, &st);
    if (!st) st = tli_parallel(p->ctx, p->original->tet_count, GRAIN, measure_cells, &c);
    for (size_t t = 0; !st && t < p->original->tet_count; t++) {
        if (c.errors[t] > c.bound)
            st = tl_fail(p->ctx, TL_ERR_DATA,
                         "channel '%s' is off by %g at the centroid of tet %zu, a cut of %zu tets "
                         "promised %g",
                         stored->name, c.errors[t], t, mesh->tet_count, promised);
        measured = fmax(measured, fmin(c.errors[t], promised));
    }
    if (!st) note_channel(&p->result->channels[number], promised, measured, uniform);
    tl_mem_free(p->ctx, c.errors);
    return st;
}

/* ---- channels on vertices ---- */

/* One channel on vertices at every original vertex. */
static tl_status prove_channel(tli_prover *p, const tl_mesh *mesh, const tl_locator *locator,
                               const places *at, size_t c, double reach, bool uniform)
{
    const tl_store_channel *stored = &p->head->channels[c];
    const tl_channel *channel = find_channel(p->original, stored->name, TL_ON_VERTEX);
    const tl_channel *copy = find_channel(mesh, stored->name, TL_ON_VERTEX);
    double promised = tl_cut_channel_error(p->cut, c), measured = 0;
    double slack = SLACK * (stored->range[1] - stored->range[0] + fabs(stored->range[1]));
    tl_field_error error;
    if (stored->on != TL_ON_VERTEX) return prove_cells(p, mesh, locator, c, reach, uniform);
    if (!channel || !copy || channel->components != copy->components)
        return tl_fail(p->ctx, TL_ERR_DATA, "the original has no channel '%s'", stored->name);
    tl_status st = tli_measure_channel(p->ctx, p->original, channel, mesh, copy, at->tets,
                                       (const double(*)[4])at->weights, at->errors, &error);
    for (size_t v = 0; !st && v < p->original->vert_count; v++) {
        search s = {mesh, copy, channel, v, p->original->xyz + 3 * v, reach, promised + slack,
                    false};
        if (at->errors[v] > promised + slack && !holds_elsewhere(locator, &s))
            return tl_fail(p->ctx, TL_ERR_DATA,
                           "channel '%s' is off by %g at vertex %zu, a cut of %zu tets promised %g",
                           stored->name, at->errors[v], v, mesh->tet_count, promised);
        measured = fmax(measured, fmin(at->errors[v], promised));
    }
    if (!st) note_channel(&p->result->channels[c], promised, measured, uniform);
    return st;
}

tl_status tli_prove_promises(tli_prover *p, const tl_mesh *mesh, bool uniform)
{
    tl_status st = TL_OK;
    size_t n = p->original->vert_count;
    places at = {0};
    tl_locator *locator = NULL;
    double reach = tl_cut_get_state(p->cut).boundary_error;
    double slack = SLACK * p->head->stats.diagonal;
    tl_cut_check_result *r = p->result;
    at.tets = tl_mem_alloc(p->ctx, n, sizeof *at.tets, &st);
    at.weights = tl_mem_alloc(p->ctx, n, sizeof *at.weights, &st);
    at.outside = tl_mem_alloc(p->ctx, n, sizeof *at.outside, &st);
    at.errors = tl_mem_alloc(p->ctx, n, sizeof *at.errors, &st);
    if (!st) st = tl_locator_create(p->ctx, mesh, NULL, &locator);
    if (!st)
        st = tli_measure_vertices(p->ctx, p->original, mesh, locator, NULL, at.tets, at.weights,
                                  at.outside);
    for (size_t v = 0; !st && v < n; v++) {
        if (at.outside[v] > reach + slack)
            st = tl_fail(p->ctx, TL_ERR_DATA,
                         "vertex %zu is %g away from a cut of %zu tets, which promised %g", v,
                         at.outside[v], mesh->tet_count, reach);
        r->outside = fmax(r->outside, at.outside[v]);
    }
    for (size_t c = 0; !st && c < p->channel_count; c++)
        st = prove_channel(p, mesh, locator, &at, p->channels[c], reach + slack, uniform);
    tl_locator_destroy(locator);
    void *blocks[] = {at.tets, at.weights, at.outside, at.errors};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(p->ctx, blocks[i]);
    return st;
}

/* The boundaries, both ways. */
tl_status tli_prove_boundary(tli_prover *p, const tl_mesh *mesh, bool uniform)
{
    tl_cut_check_result *r = p->result;
    tl_compare_result found;
    double promised = tl_cut_get_state(p->cut).boundary_error;
    double slack = SLACK * p->head->stats.diagonal;
    tl_status st = tl_mesh_compare(p->ctx, p->original, mesh, NULL, &found);
    if (st) return st;
    double measured = found.boundary_hausdorff;
    tl_compare_release(p->ctx, &found);
    if (measured > promised + slack)
        return tl_fail(p->ctx, TL_ERR_DATA,
                       "the boundary of a cut of %zu tets is off by %g, promised was %g",
                       mesh->tet_count, measured, promised);
    if (r->boundary_promised == 0 ||
        measured * r->boundary_promised > r->boundary_measured * promised) {
        r->boundary_promised = promised;
        r->boundary_measured = measured;
    }
    if (uniform && measured > 0 && promised > r->boundary_looseness * measured)
        r->boundary_looseness = promised / measured;
    return TL_OK;
}
