/* The queue-driven collapse loop that all orders share: cheapest edge first, fresh costs for the
 * edges of the vertex that stays. */
#include "simplify/simplify_order.h"

tl_status tli_hand_create(tli_work *work, unsigned bank, tli_hand **hand)
{
    tl_status st = TL_OK;
    tli_hand *h = tl_mem_zalloc(work->ctx, 1, sizeof *h, &st);
    *hand = h;
    if (st) return st;
    h->work = work;
    h->bank = &work->banks[bank];
    h->cost = tli_cost_best();
    h->cost_max = (double)FLT_MAX;
    h->log = &h->own_log;
    st = tli_hood_create(work->ctx, work, &h->hood);
    if (!st) st = tli_queue_create(work->ctx, &h->queue);
    return st;
}

void tli_hand_destroy(tli_hand *hand)
{
    if (!hand) return;
    tl_ctx *ctx = hand->work->ctx;
    tli_log_release(ctx, &hand->own_log);
    tli_queue_destroy(ctx, hand->queue);
    tli_hood_destroy(ctx, hand->hood);
    tl_mem_free(ctx, hand);
}

/* Queues the edges from u to hand->near [count] that are cheap enough, and notes at u what the
 * others cost at least. */
static tl_status queue_edges(tli_hand *hand, tl_lidx u, size_t count)
{
    tli_work *w = hand->work;
    tl_status st = TL_OK;
    float least = INFINITY;
    hand->cost(w, u, hand->near, count, hand->costs);
    for (size_t i = 0; !st && i < count; i++) {
        float cost = hand->costs[i];
        if (cost < least) least = cost;
        if (!(cost <= hand->cost_max)) continue;
        tl_lidx v = hand->near[i];
        tli_queue_entry entry = {u, v, w->verts[u].version + w->verts[v].version};
        st = tli_queue_push(hand->queue, (double)cost, entry);
    }
    w->verts[u].cost_floor = least;
    return st;
}

tl_status tli_hand_queue(tli_hand *hand, const tl_lidx *verts, size_t count)
{
    tli_work *w = hand->work;
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < count; i++) {
        tli_vertex *u = &w->verts[verts[i]];
        if (u->cost_floor > hand->cost_max) continue;
        size_t n = tli_star_neighbours(w, verts[i], hand->block, hand->near), m = 0;
        u->border = n == 0;
        for (size_t j = 0; j < n; j++)
            if (hand->near[j] > verts[i]) hand->near[m++] = hand->near[j];
        if (m) st = queue_edges(hand, verts[i], m);
    }
    return st;
}

/* Fresh costs for all edges of a vertex that took another in; their other ends own some of them. */
static tl_status queue_kept(tli_hand *hand, tl_lidx kept)
{
    const tli_hood *hood = hand->hood;
    size_t n = hood->vert_count - 2u;
    memcpy(hand->near, hood->verts + 2, n * sizeof *hand->near);
    tl_status st = queue_edges(hand, kept, n);
    for (size_t i = 0; i < n; i++) {
        float *floor = &hand->work->verts[hand->near[i]].cost_floor;
        if (hand->costs[i] < *floor) *floor = hand->costs[i];
    }
    return st;
}

/* Asks for the memory of the entries that come next. */
static void prefetch(const tli_hand *hand)
{
    const tli_work *w = hand->work;
    const tli_queue_entry *e = tli_queue_peek(hand->queue, 4);
    if (e) {
        __builtin_prefetch(&w->verts[e->u]);
        __builtin_prefetch(&w->verts[e->v]);
    }
    e = tli_queue_peek(hand->queue, 2);
    if (e && e->stamp == w->verts[e->u].version + w->verts[e->v].version) {
        __builtin_prefetch(w->verts[e->u].star.tets);
        __builtin_prefetch(w->verts[e->v].star.tets);
    }
}

tl_status tli_hand_collapse(tli_hand *hand, tli_queue_entry edge, bool *done)
{
    tli_work *w = hand->work;
    tli_verdict verdict;
    uint32_t gone;
    tl_status st = tli_collapse_edge(w, hand->hood, hand->bank, hand->block, edge.u, edge.v,
                                     &verdict, &hand->kept, &gone);
    *done = !st && verdict == TLI_DONE;
    if (st) return st;
    hand->verdicts[verdict]++;
    if (!*done) return TL_OK;
    hand->tets_gone += gone;
    hand->verts_gone++;
    if (!w->listener) return TL_OK;
    return tli_log_add(hand->log, w, hand->kept, hand->kept == edge.u ? edge.v : edge.u,
                       hand->cost_now);
}

tl_status tli_hand_run(tli_hand *hand, size_t tets_max)
{
    tli_work *w = hand->work;
    tli_queue_entry e;
    tl_status st = TL_OK;
    while (!st && hand->tets_gone < tets_max && tli_queue_pop(hand->queue, &e)) {
        bool done;
        prefetch(hand);
        const tli_vertex *u = &w->verts[e.u], *v = &w->verts[e.v];
        if (e.stamp != u->version + v->version || v->border || u->border) continue;
        hand->cost_now = tli_queue_level(hand->queue);
        st = tli_hand_collapse(hand, e, &done);
        if (!st && done) st = queue_kept(hand, hand->kept);
    }
    return st;
}

tl_status tli_hand_settle(tli_hand *hand)
{
    tli_work *w = hand->work;
    w->tets_live -= hand->tets_gone;
    w->verts_live -= hand->verts_gone;
    for (int i = 0; i < TLI_VERDICT_COUNT; i++) w->verdicts[i] += hand->verdicts[i];
    hand->tets_gone = hand->verts_gone = 0;
    memset(hand->verdicts, 0, sizeof hand->verdicts);
    return w->listener ? tli_log_tell(&hand->own_log, w) : TL_OK;
}
