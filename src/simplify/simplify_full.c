/* The full priority queue: always the cheapest edge of the whole mesh. One thread. */
#include "simplify/simplify_order.h"

tl_status tli_order_queue(tli_work *w, size_t target)
{
    tl_status st = TL_OK;
    tli_hand *hand = NULL;
    tl_lidx *verts = tl_mem_alloc(w->ctx, w->verts_live, sizeof *verts, &st);
    if (!st) st = tli_hand_create(w, 0, &hand);
    size_t first = w->tets_live;
    while (!st && w->tets_live > target) { /* again while edges that were refused may be free now */
        size_t before = w->tets_live;
        st = tli_hand_queue(hand, verts, tli_work_list_live(w, verts));
        while (!st && tli_queue_occupied(hand->queue) && hand->tets_gone < before - target) {
            size_t step = hand->tets_gone + first / 50 + 1;
            st = tli_hand_run(hand, step < before - target ? step : before - target);
            if (!st) st = tli_order_report(w, before - hand->tets_gone, target);
        }
        if (!st) st = tli_hand_settle(hand);
        tli_queue_clear(hand->queue);
        if (w->tets_live == before) break;
    }
    tli_hand_destroy(hand);
    tl_mem_free(w->ctx, verts);
    return st;
}
