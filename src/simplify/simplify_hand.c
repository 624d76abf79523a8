/* The queue-driven collapse loop that all orders share: cheapest edge first, fresh costs for the
 * edges of the vertex that stays. */
#include "simplify/simplify_order.h"

/* Slots of the table that tells neighbours seen before. */
enum { TABLE = 128 };

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

static tl_status wait(tl_ctx *ctx, tli_edges *edges, tli_edge edge)
{
    tl_status st = TL_OK;
    if (edges->count == edges->capacity) {
        edges->capacity += edges->capacity / 4 + 512;
        edges->edges = tl_mem_resize(ctx, edges->edges, edges->capacity, sizeof *edges->edges, &st);
        if (st) return st;
    }
    edges->edges[edges->count++] = edge;
    return TL_OK;
}

tl_status tli_hand_queue_from(tli_hand *hand, tl_lidx u, size_t count)
{
    tli_work *w = hand->work;
    tl_status st = TL_OK;
    hand->cost(w, u, hand->near, count, hand->costs);
    for (size_t i = 0; !st && i < count; i++) {
        float cost = hand->costs[i];
        tl_lidx v = hand->near[i];
        uint32_t stamp = w->verts[u].version + w->verts[v].version;
        bool at_border = hand->in_block && (w->verts[u].border || w->verts[v].border);
        if (cost <= hand->cost_max && !at_border)
            st =
                tli_queue_push(hand->queue, tli_queue_bucket(cost), (tli_queue_entry){u, v, stamp});
        else if (hand->later && cost <= FLT_MAX)
            st = wait(w->ctx, hand->later,
                      (tli_edge){u, v, (uint16_t)tli_queue_bucket(cost), (uint16_t)stamp});
    }
    return st;
}

tl_status tli_hand_queue_again(tli_hand *hand, const tli_edge *edges, size_t count)
{
    const tli_work *w = hand->work;
    tl_status st = TL_OK;
    uint32_t most = tli_queue_bucket((float)hand->cost_max);
    for (size_t i = 0; !st && i < count; i++) {
        tli_edge e = edges[i];
        uint32_t cost = e.cost & ~TLI_REFUSED;
        uint32_t stamp = w->verts[e.u].version + w->verts[e.v].version;
        if (e.stamp != (uint16_t)stamp) continue;
        if (cost <= most)
            st = tli_queue_push(hand->queue, cost, (tli_queue_entry){e.u, e.v, stamp});
        else
            st = wait(w->ctx, hand->later, e);
    }
    return st;
}

/* Neighbours of u with larger numbers, each once, without marks: other workers may look at the same
 * vertices. */
static size_t larger_neighbours(const tli_work *w, tl_lidx u, tl_lidx *out)
{
    const tli_star *s = &w->verts[u].star;
    tl_lidx table[TABLE];
    size_t count = 0;
    if (s->count > TLI_STAR_MAX) return 0;
    memset(table, 0, sizeof table); /* no larger neighbour is vertex 0 */
    for (uint32_t i = 0; i < s->count; i++)
        for (int j = 0; j < 4; j++) {
            tl_lidx v = w->tets[s->tets[i]][j];
            if (v <= u) continue;
            size_t slot = (v * 2654435761u) >> 25;
            if (table[slot] == v) continue;
            if (table[slot]) { /* taken by another one: look through all */
                size_t k = 0;
                while (k < count && out[k] != v) k++;
                if (k < count) continue;
            } else
                table[slot] = v;
            out[count++] = v;
        }
    return count;
}

/* The same with marks, faster, where no other worker can be near. */
static size_t larger_of_star(tli_work *w, tl_lidx u, tl_lidx *out)
{
    size_t count = tli_star_neighbours(w, u, out), larger = 0;
    for (size_t i = 0; i < count; i++)
        if (out[i] > u) out[larger++] = out[i];
    return larger;
}

tl_status tli_hand_queue(tli_hand *hand, const tl_lidx *verts, size_t count)
{
    tli_work *w = hand->work;
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < count; i++) {
        bool others_near = hand->in_block && w->verts[verts[i]].border;
        size_t n = others_near ? larger_neighbours(w, verts[i], hand->near)
                               : larger_of_star(w, verts[i], hand->near);
        st = tli_hand_queue_from(hand, verts[i], n);
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
    e = tli_queue_peek(hand->queue, 0);
    if (!e || e->stamp != w->verts[e->u].version + w->verts[e->v].version) return;
    for (int side = 0; side < 2; side++) {
        const tli_star *s = &w->verts[side ? e->v : e->u].star;
        for (uint32_t i = 0; i < s->count; i++) __builtin_prefetch(w->tets[s->tets[i]]);
    }
}

tl_status tli_hand_collapse(tli_hand *hand, tli_queue_entry edge, bool *done)
{
    tli_work *w = hand->work;
    tli_verdict verdict;
    uint32_t gone;
    tl_status st =
        tli_collapse_edge(w, hand->hood, hand->bank, edge.u, edge.v, &verdict, &hand->kept, &gone);
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

/* What was refused may be free when the mesh around it has changed. */
static tli_edge refused(const tli_hand *hand, tli_queue_entry e)
{
    uint32_t cost = tli_queue_bucket((float)hand->cost_now) | TLI_REFUSED;
    return (tli_edge){e.u, e.v, (uint16_t)cost, (uint16_t)e.stamp};
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
        if (e.stamp != u->version + v->version) continue;
        hand->cost_now = tli_queue_level(hand->queue);
        st = tli_hand_collapse(hand, e, &done);
        if (!st && !done && hand->later) st = wait(w->ctx, hand->later, refused(hand, e));
        if (st || !done) continue;
        size_t near = hand->hood->vert_count - 2u;
        memcpy(hand->near, hand->hood->verts + 2, near * sizeof *hand->near);
        st = tli_hand_queue_from(hand, hand->kept, near);
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
