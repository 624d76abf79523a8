/* Independent edge collapses (Sondershaus 2007, 4.1.1): runs over the mesh, in each of which a
 * vertex takes part in one collapse at most. A run grows from an edge over the links of the new
 * vertices, so that wing vertices of a collapse are collapsed next and valences stay balanced. The
 * threshold of a run is the mean cost of a few edges; where it lets too little through, it rises.
 * One thread. */
#include "simplify/simplify_order.h"

/* Edges whose mean cost is the threshold. */
enum { SAMPLES = 10 };
/* A run that takes away less than this part of the vertices doubles the threshold of the next. */
static const double LEAST_SHARE = 0.02;

static bool marked(const tli_work *w, tl_lidx v)
{
    return w->verts[v].block != 0;
}

static tl_status queue_edge(tli_hand *hand, tl_lidx u, tl_lidx v)
{
    tli_work *w = hand->work;
    float cost;
    if (marked(w, u) || marked(w, v)) return TL_OK;
    hand->cost(w, u, &v, 1, &cost);
    if (!(cost <= hand->cost_max)) return TL_OK;
    tli_queue_entry entry = {u, v, w->verts[u].version + w->verts[v].version};
    return tli_queue_push(hand->queue, tli_queue_bucket(cost), entry);
}

/* The edges opposite the vertex that stays. */
static tl_status queue_link(tli_hand *hand)
{
    const tli_hood *h = hand->hood;
    tl_status st = TL_OK;
    for (int side = 0; side < 2; side++)
        for (uint32_t i = 0; !st && i < h->side_counts[side]; i++)
            for (int j = 0; !st && j < 3; j++) {
                tl_lidx a = h->verts[h->sides[side][i].verts[j]];
                tl_lidx b = h->verts[h->sides[side][i].verts[(j + 1) % 3]];
                if (a < b)
                    st = queue_edge(hand, a, b); /* the other tet at it has it the other way */
            }
    return st;
}

static tl_status grow(tli_hand *hand, size_t tets_max)
{
    tli_work *w = hand->work;
    tli_queue_entry e;
    tl_status st = TL_OK;
    while (!st && hand->tets_gone < tets_max && tli_queue_pop(hand->queue, &e)) {
        bool done;
        if (marked(w, e.u) || marked(w, e.v)) continue;
        st = tli_hand_collapse(hand, e, &done);
        if (st || !done) continue;
        w->verts[hand->kept].block = 1;
        st = queue_link(hand);
    }
    return st;
}

/* Mean cost of a few edges, picked at regular distances. */
static double threshold_of(tli_hand *hand, const tl_lidx *verts, size_t count, unsigned run)
{
    double sum = 0;
    size_t n = 0;
    for (size_t i = 0; i < SAMPLES; i++) {
        tl_lidx u = verts[(i * count / SAMPLES + run * 7919u) % count];
        size_t near = tli_star_neighbours(hand->work, u, hand->near);
        if (!near) continue;
        tl_lidx v = hand->near[run % near];
        float cost;
        hand->cost(hand->work, u, &v, 1, &cost);
        if (cost == INFINITY) continue;
        sum += (double)cost;
        n++;
    }
    return n ? sum / (double)n : 0;
}

static tl_status one_run(tli_hand *hand, const tl_lidx *verts, size_t count, size_t tets_max)
{
    tli_work *w = hand->work;
    tl_status st = TL_OK;
    for (size_t i = 0; i < count; i++) w->verts[verts[i]].block = 0;
    for (size_t i = 0; !st && i < count && hand->tets_gone < tets_max; i++) {
        tl_lidx u = verts[i];
        if (w->verts[u].merged != u || marked(w, u)) continue;
        size_t near = tli_star_neighbours(w, u, hand->near), best = 0;
        if (!near) continue;
        hand->cost(w, u, hand->near, near, hand->costs);
        for (size_t j = 1; j < near; j++)
            if (hand->costs[j] < hand->costs[best]) best = j;
        st = queue_edge(hand, u, hand->near[best]);
        if (!st) st = grow(hand, tets_max);
    }
    tli_queue_clear(hand->queue);
    return st;
}

tl_status tli_order_independent(tli_work *w, size_t target)
{
    tl_status st = TL_OK;
    tli_hand *hand = NULL;
    double lift = 1;
    tl_lidx *verts = tl_mem_alloc(w->ctx, w->verts_live, sizeof *verts, &st);
    if (!st) st = tli_hand_create(w, 0, &hand);
    for (unsigned run = 0, idle = 0; !st && w->tets_live > target && idle < 24; run++) {
        size_t count = tli_work_list_live(w, verts), before = w->verts_live;
        hand->cost_max = lift * threshold_of(hand, verts, count, run);
        if (idle > 8) hand->cost_max = (double)FLT_MAX; /* whatever is left */
        st = one_run(hand, verts, count, w->tets_live - target);
        if (!st) st = tli_hand_settle(hand);
        if ((double)(before - w->verts_live) < LEAST_SHARE * (double)before) lift *= 2;
        idle = before == w->verts_live ? idle + 1 : 0;
        if (!st) st = tli_order_report(w, w->tets_live, target);
    }
    tli_hand_destroy(hand);
    tl_mem_free(w->ctx, verts);
    return st;
}
