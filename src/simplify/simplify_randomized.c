/* Randomized multiple choice: the cheapest of a few random edges is collapsed. No queue, no order
 * to keep up; one thread. */
#include "base/base_random.h"
#include "simplify/simplify_order.h"

enum { CHOICES = 8 };
/* Attempts without success, as a multiple of the vertices left, after which nothing more is
 * expected. */
enum { PATIENCE = 16 };

/* A random edge of a random live vertex; verts loses the dead ones that are met. */
static bool pick_edge(const tli_work *w, tl_lidx *verts, size_t *count, uint64_t *state,
                      tli_queue_entry *edge)
{
    while (*count) {
        size_t at = tli_random(state) % *count;
        tl_lidx u = verts[at];
        if (w->verts[u].merged != u || w->verts[u].star.count == 0) {
            verts[at] = verts[--*count];
            continue;
        }
        uint64_t r = tli_random(state);
        const tl_lidx *q = w->tets[w->verts[u].star.tets[(r >> 2) % w->verts[u].star.count]];
        tl_lidx v = q[r & 3];
        if (v == u) continue;
        *edge = (tli_queue_entry){u, v, 0};
        return true;
    }
    return false;
}

static tl_status run(tli_hand *hand, tl_lidx *verts, size_t count, size_t target, uint64_t state)
{
    tli_work *w = hand->work;
    tl_status st = TL_OK;
    size_t failed = 0, step = 0;
    while (!st && w->tets_live - hand->tets_gone > target && failed < PATIENCE * count + 1000) {
        tli_queue_entry best = {0}, some;
        float least = INFINITY;
        bool done = false;
        for (int i = 0; i < CHOICES && pick_edge(w, verts, &count, &state, &some); i++) {
            float cost;
            hand->cost(w, some.u, &some.v, 1, &cost);
            if (!(cost < least)) continue;
            least = cost;
            best = some;
        }
        if (!count) break;
        if (least < INFINITY) {
            hand->cost_now = (double)least;
            st = tli_hand_collapse(hand, best, &done);
        }
        failed = done ? 0 : failed + 1;
        if (++step % 4096 == 0 && !st)
            st = tli_order_report(w, w->tets_live - hand->tets_gone, target);
    }
    return st;
}

tl_status tli_order_randomized(tli_work *w, size_t target, uint64_t seed)
{
    tl_status st = TL_OK;
    tli_hand *hand = NULL;
    tl_lidx *verts = tl_mem_alloc(w->ctx, w->verts_live, sizeof *verts, &st);
    if (!st) st = tli_hand_create(w, 0, &hand);
    if (!st) st = run(hand, verts, tli_work_list_live(w, verts), target, seed);
    if (!st) st = tli_hand_settle(hand);
    tli_hand_destroy(hand);
    tl_mem_free(w->ctx, verts);
    return st;
}
