/* Random cuts of a model, each proved to be a mesh that fits together, and its promises measured by
 * brute force at every vertex of the original (DESIGN.md, section 5). */
#include <float.h>
#include <math.h>
#include <string.h>

#include "measure/measure.h"
#include "tetralod/cut.h"

/* Rounding of a measured error, relative to the values at hand. */
static const double SLACK = 1e-9;
/* The volume is kept within this part, at errors up to that part of a channel's range. */
static const double VOLUME_KEPT = 0.005, VOLUME_ERROR = 0.1;
/* Kinds of cuts that are tried in turn. */
enum { KIND_UNIFORM, KIND_LEVEL, KIND_BOX, KIND_BUDGET, KINDS };

typedef struct prover {
    tl_ctx *ctx;
    const tl_store *store;
    const tl_store_head *head;
    const tl_mesh *original; /* NULL: only the shape is proved */
    tl_cut *cut;
    tl_mesh_stats finest;
    uint64_t seed;
    double *bounds; /* [channel_count] */
    tl_cut_check_result *result;
} prover;

tl_cut_check_opts tl_cut_check_opts_defaults(void)
{
    return (tl_cut_check_opts){.struct_bytes = sizeof(tl_cut_check_opts), .cuts = 12, .seed = 1};
}

/* splitmix64, in [0, 1) */
static double draw(prover *p)
{
    uint64_t z = (p->seed += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/* ---- cuts ---- */

/* A bound for every channel, the same fraction of the errors of a random level. */
static void draw_bounds(prover *p)
{
    const tl_store_head *h = p->head;
    uint32_t level = (uint32_t)(draw(p) * h->level_count);
    double part = 0.5 + draw(p);
    for (uint32_t c = 0; c < h->channel_count; c++)
        p->bounds[c] = h->levels[level].max_error[c] * part;
}

static void draw_box(prover *p, double box[6])
{
    for (int k = 0; k < 3; k++) {
        double lo = p->head->stats.bounds[2 * k], hi = p->head->stats.bounds[2 * k + 1];
        double a = lo + draw(p) * (hi - lo), size = (0.1 + 0.4 * draw(p)) * (hi - lo);
        box[k] = a - size / 2;
        box[3 + k] = a + size / 2;
    }
}

/* The i-th cut; *uniform: the same error is asked for everywhere. */
static tl_status move_cut(prover *p, uint32_t i, bool *uniform)
{
    tl_cut_query query = tl_cut_query_defaults();
    double box[6];
    unsigned kind = i % KINDS;
    *uniform = kind == KIND_LEVEL;
    if (kind == KIND_LEVEL)
        query.level = (uint32_t)(draw(p) * p->head->level_count);
    else if (kind == KIND_BUDGET)
        query.tets_max = (uint64_t)((double)p->head->input_tets * pow(10, -2 * draw(p)));
    else {
        draw_bounds(p);
        query.bounds.channels = p->bounds;
    }
    if (kind == KIND_BOX) {
        draw_box(p, box);
        query.box = box;
    }
    return tl_cut_update(p->cut, &query);
}

/* ---- shape ---- */

static tl_status prove_shape(prover *p, const tl_mesh *mesh, double error_share)
{
    tl_mesh_stats now;
    const tl_mesh_stats *f = &p->finest;
    tl_status st = tl_mesh_measure(p->ctx, mesh, &now);
    if (st) return st;
    uint64_t tets = tl_mesh_tet_count(mesh);
    if (now.nonmanifold_faces > f->nonmanifold_faces ||
        now.nonmanifold_edges > f->nonmanifold_edges)
        return tl_fail(p->ctx, TL_ERR_DATA,
                       "a cut of %llu tets does not fit together: %zu faces of more than two tets "
                       "and %zu open edges, the finest mesh has %zu and %zu",
                       (unsigned long long)tets, now.nonmanifold_faces, now.nonmanifold_edges,
                       f->nonmanifold_faces, f->nonmanifold_edges);
    if (now.inverted > f->inverted || now.degenerate > f->degenerate)
        return tl_fail(p->ctx, TL_ERR_DATA,
                       "a cut of %llu tets has %zu inverted and %zu flat ones, the finest mesh has "
                       "%zu and %zu",
                       (unsigned long long)tets, now.inverted, now.degenerate, f->inverted,
                       f->degenerate);
    double off = fabs(now.volume - f->volume) / (f->volume != 0 ? fabs(f->volume) : 1);
    if (error_share <= VOLUME_ERROR && off > p->result->volume_off) p->result->volume_off = off;
    if (error_share <= VOLUME_ERROR && off > VOLUME_KEPT)
        return tl_fail(p->ctx, TL_ERR_DATA,
                       "a cut of %llu tets has a volume of %g, the finest mesh has %g",
                       (unsigned long long)tets, now.volume, f->volume);
    return TL_OK;
}

/* ---- promises ---- */

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

/* Is there a point within reach whose value is within the bound? The nearest points of all tets
 * are asked. */
static bool holds_elsewhere(const tl_mesh *mesh, const tl_channel *copy, const tl_channel *channel,
                            size_t v, const double x[3], double reach, double bound)
{
    for (size_t t = 0; t < mesh->tet_count; t++) {
        double p[4][3], w[4];
        bool far = false;
        tli_tet_corners(mesh->xyz, mesh->tets + 4 * t, p);
        for (int k = 0; k < 3 && !far; k++) {
            double lo = fmin(fmin(p[0][k], p[1][k]), fmin(p[2][k], p[3][k]));
            double hi = fmax(fmax(p[0][k], p[1][k]), fmax(p[2][k], p[3][k]));
            far = lo > x[k] + reach || hi < x[k] - reach;
        }
        if (far || tl_tet_nearest(TLI_CORNERS(p), x, w) > reach) continue;
        if (error_in_tet(mesh, copy, channel, v, (tl_lidx)t, w) <= bound) return true;
    }
    return false;
}

/* One channel on vertices at every original vertex. */
static tl_status prove_channel(prover *p, const tl_mesh *mesh, const places *at, size_t c,
                               double reach, bool uniform)
{
    const tl_store_channel *stored = &p->head->channels[c];
    const tl_channel *channel = tl_mesh_channel_by_name(p->original, stored->name);
    const tl_channel *copy = tl_mesh_channel_by_name(mesh, stored->name);
    tl_cut_check_channel *r = &p->result->channels[c];
    double promised = tl_cut_channel_error(p->cut, c), measured = 0;
    double slack = SLACK * (stored->range[1] - stored->range[0] + fabs(stored->range[1]));
    tl_field_error error;
    if (stored->on != TL_ON_VERTEX) return TL_OK; /* one on vertices may have the same name */
    if (!channel || !copy || channel->on != TL_ON_VERTEX || channel->components != copy->components)
        return tl_fail(p->ctx, TL_ERR_DATA, "the original has no channel '%s'", stored->name);
    tl_status st = tli_measure_channel(p->ctx, p->original, channel, mesh, copy, at->tets,
                                       (const double(*)[4])at->weights, at->errors, &error);
    for (size_t v = 0; !st && v < p->original->vert_count; v++) {
        const double *x = p->original->xyz + 3 * v;
        if (at->errors[v] > promised + slack &&
            !holds_elsewhere(mesh, copy, channel, v, x, reach, promised + slack))
            return tl_fail(p->ctx, TL_ERR_DATA,
                           "channel '%s' is off by %g at vertex %zu, a cut of %zu tets promised %g",
                           stored->name, at->errors[v], v, mesh->tet_count, promised);
        measured = fmax(measured, fmin(at->errors[v], promised));
    }
    if (st) return st;
    if (r->promised == 0 || measured * r->promised > r->measured * promised) {
        r->promised = promised;
        r->measured = measured;
    }
    if (uniform && measured > 0 && promised > r->looseness * measured)
        r->looseness = promised / measured;
    return TL_OK;
}

static tl_status prove_promises(prover *p, const tl_mesh *mesh, bool uniform)
{
    tl_status st = TL_OK;
    size_t n = p->original->vert_count;
    places at = {0};
    tl_locator *locator = NULL;
    double reach = tl_cut_get_state(p->cut).boundary_error + p->head->position_error;
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
    for (size_t c = 0; !st && c < p->head->channel_count; c++)
        st = prove_channel(p, mesh, &at, c, reach + slack, uniform);
    tl_locator_destroy(locator);
    void *blocks[] = {at.tets, at.weights, at.outside, at.errors};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(p->ctx, blocks[i]);
    return st;
}

/* The boundaries, both ways. */
static tl_status prove_boundary(prover *p, const tl_mesh *mesh, bool uniform)
{
    tl_cut_check_result *r = p->result;
    tl_compare_result found;
    double promised = tl_cut_get_state(p->cut).boundary_error + p->head->position_error;
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

/* ---- all cuts ---- */

static double largest_share(const prover *p)
{
    double largest = 0;
    for (size_t c = 0; c < p->head->channel_count; c++) {
        const tl_store_channel *channel = &p->head->channels[c];
        double width = channel->range[1] - channel->range[0];
        if (width > 0) largest = fmax(largest, tl_cut_channel_error(p->cut, c) / width);
    }
    return largest;
}

static tl_status prove_cut(prover *p, uint32_t i)
{
    tl_mesh *mesh = NULL;
    bool uniform = false;
    tl_status st = move_cut(p, i, &uniform);
    if (!st) st = tl_cut_mesh(p->cut, NULL, 0, &mesh);
    if (!st) st = prove_shape(p, mesh, largest_share(p));
    if (!st && p->original) st = prove_promises(p, mesh, uniform);
    if (!st && p->original && p->finest.nonfinite_verts == 0) st = prove_boundary(p, mesh, uniform);
    if (!st) p->result->cuts_tried++;
    tl_mesh_destroy(mesh);
    return st ? tl_note(p->ctx, st, "while trying cut %u", i) : TL_OK;
}

/* The finest mesh, which all others are held against. */
static tl_status measure_finest(prover *p)
{
    tl_cut_query query = tl_cut_query_defaults();
    tl_mesh *mesh = NULL;
    query.level = 0;
    tl_status st = tl_cut_update(p->cut, &query);
    if (!st) st = tl_cut_mesh(p->cut, NULL, 0, &mesh);
    if (!st) st = tl_mesh_measure(p->ctx, mesh, &p->finest);
    if (!st && p->original && tl_mesh_tet_count(p->original) != tl_mesh_tet_count(mesh))
        st = tl_fail(p->ctx, TL_ERR_DATA,
                     "the original has %zu tets, the model was made of %zu: another data set",
                     tl_mesh_tet_count(p->original), tl_mesh_tet_count(mesh));
    tl_mesh_destroy(mesh);
    return st;
}

tl_status tl_cut_check(tl_ctx *ctx, tl_store *store, const tl_mesh *original,
                       const tl_cut_check_opts *opts, tl_cut_check_result *result)
{
    tl_status st = TL_OK;
    tl_cut_check_opts o = tl_cut_check_opts_defaults();
    tl_cut_check_result r = {0};
    prover p = {.ctx = ctx,
                .store = store,
                .head = tl_store_get_head(store),
                .original = original,
                .result = &r};
    *result = r;
    st = tli_opts_take(ctx, "tl_cut_check_opts", opts, &o, sizeof o);
    p.seed = o.seed;
    r.channels = tl_mem_zalloc(ctx, p.head->channel_count, sizeof *r.channels, &st);
    p.bounds = tl_mem_alloc(ctx, p.head->channel_count, sizeof *p.bounds, &st);
    if (!st) {
        r.channel_count = p.head->channel_count;
        for (size_t c = 0; c < r.channel_count; c++) r.channels[c].name = p.head->channels[c].name;
        st = tl_cut_create(ctx, store, &p.cut);
    }
    if (!st) st = measure_finest(&p);
    for (uint32_t i = 0; !st && i < o.cuts; i++) {
        st = prove_cut(&p, i);
        if (!st) st = tl_progress(ctx, "cuts", i + 1, o.cuts);
    }
    tl_cut_destroy(p.cut);
    tl_mem_free(ctx, p.bounds);
    if (st)
        tl_cut_check_release(ctx, &r);
    else
        *result = r;
    return st;
}

void tl_cut_check_release(tl_ctx *ctx, tl_cut_check_result *result)
{
    if (!result) return;
    tl_mem_free(ctx, result->channels);
    *result = (tl_cut_check_result){0};
}
