/* A piece of a larger mesh: one queue over all its edges, until a number of tets or a cost is
 * reached. */
#include "simplify/simplify_piece.h"

#include <math.h>
#include <string.h>

#include "simplify/simplify_order.h"
#include "simplify/simplify_pack.h"

/* Rounds go on while one takes away this part of the tets: edges that were refused may be free. */
static const double WORTH_A_ROUND = 0.02;

size_t tli_piece_quadric_floats(size_t component_count)
{
    return tli_quadric_floats(component_count);
}

void tli_piece_reanchor(float *quadric, const double *shift, size_t component_count)
{
    static const double STAYS[3] = {0, 0, 0};
    double sum[TLI_QUADRIC_HEAD + 4 * TLI_COMPONENTS_MAX] = {0};
    tli_quadric_add_moved(sum, quadric, STAYS, shift, component_count);
    for (size_t i = 0; i < tli_quadric_floats(component_count); i++) quadric[i] = (float)sum[i];
    if (quadric[9] < 0) quadric[9] = 0;
}

/* Collapses what the queue holds, in steps between which the cost is noted. */
static tl_status run_queue(tli_hand *hand, size_t gone, size_t most, double *costs)
{
    const tli_work *w = hand->work;
    tl_status st = TL_OK;
    double highest = 0;
    for (size_t i = 0; i < TLI_CURVE_POINTS && isfinite(costs[i]); i++) highest = costs[i];
    while (!st && hand->tets_gone < most) {
        size_t at = (gone + hand->tets_gone) * TLI_CURVE_POINTS / w->tet_count;
        size_t next = ((at + 1) * w->tet_count + TLI_CURVE_POINTS - 1) / TLI_CURVE_POINTS - gone;
        st = tli_hand_run(hand, next < most ? next : most);
        double cost = tli_queue_level(hand->queue);
        bool empty = !tli_queue_occupied(hand->queue);
        if (!empty && cost > highest) highest = cost;
        size_t now = (gone + hand->tets_gone) * TLI_CURVE_POINTS / w->tet_count;
        for (; at < now && at < TLI_CURVE_POINTS; at++) costs[at] = highest;
        if (empty) break;
    }
    return st;
}

static tl_status run_piece(tli_work *w, const tli_piece *piece, double *costs)
{
    tl_status st = TL_OK;
    tli_hand *hand = NULL;
    size_t target = piece->opts->target_tets, first = w->tets_live;
    for (size_t i = 0; i < TLI_CURVE_POINTS; i++) costs[i] = (double)INFINITY;
    tl_lidx *verts = tl_mem_alloc(w->ctx, w->verts_live, sizeof *verts, &st);
    if (!st) st = tli_hand_create(w, 0, &hand);
    if (!st && piece->cost_max < hand->cost_max) hand->cost_max = piece->cost_max;
    while (!st && w->tets_live > target) {
        size_t before = w->tets_live;
        st = tli_hand_queue(hand, verts, tli_work_list_live(w, verts));
        if (!st) st = run_queue(hand, first - before, before - target, costs);
        if (!st) st = tli_hand_settle(hand);
        tli_queue_clear(hand->queue);
        if ((double)(before - w->tets_live) < WORTH_A_ROUND * (double)before) break;
    }
    tli_hand_destroy(hand);
    tl_mem_free(w->ctx, verts);
    return st;
}

/* What the next level needs of the vertices that are left, in the order of tli_pack. */
static tl_status copy_vertices(const tli_work *w, const tli_piece *piece, tli_piece_result *r)
{
    tl_status st = TL_OK;
    size_t n = tl_mesh_vert_count(r->mesh), i = 0;
    r->quadric_floats = tli_quadric_floats(w->components);
    r->origins = tl_mem_alloc(w->ctx, n, sizeof *r->origins, &st);
    r->fixed = tl_mem_alloc(w->ctx, n, sizeof *r->fixed, &st);
    r->surface_bounds = tl_mem_alloc(w->ctx, n, sizeof *r->surface_bounds, &st);
    r->quadrics = tl_mem_alloc(w->ctx, n * r->quadric_floats, sizeof *r->quadrics, &st);
    if (piece->steps) r->steps = tl_mem_alloc(w->ctx, n, sizeof *r->steps, &st);
    for (size_t v = 0; !st && v < w->vert_count; v++) {
        const tli_vertex *from = &w->verts[v];
        if (from->merged != v) continue;
        r->origins[i] = from->origin;
        r->fixed[i] = w->placement == TL_PLACE_SUBSET || from->kind >= TLI_CORNER;
        r->surface_bounds[i] = from->surface_bound;
        if (r->steps) r->steps[i] = from->step;
        memcpy(r->quadrics + i * r->quadric_floats, w->quadrics + v * w->quadric_floats,
               r->quadric_floats * sizeof *r->quadrics);
        i++;
    }
    return st;
}

tl_status tli_piece_simplify(tl_ctx *ctx, const tli_piece *piece, tli_piece_result *result)
{
    tli_work *w = NULL;
    tli_piece_result r = {0};
    *result = r;
    tl_status st = tli_work_create_piece(ctx, piece, &w);
    if (!st) st = run_piece(w, piece, r.costs);
    if (!st) st = tli_pack(w, piece->mesh, piece->opts, piece->channel_scales, &r.mesh, &r.hints);
    if (!st) st = copy_vertices(w, piece, &r);
    tli_work_destroy(w);
    if (st)
        tli_piece_release(ctx, &r);
    else
        *result = r;
    return st;
}

void tli_piece_release(tl_ctx *ctx, tli_piece_result *result)
{
    tl_mesh_destroy(result->mesh);
    void *blocks[] = {result->hints, result->origins,  result->fixed,
                      result->steps, result->quadrics, result->surface_bounds};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    *result = (tli_piece_result){0};
}
