/* The default order: rounds of blocks. In each round the vertices are divided into blocks, and
 * inside of every block edges are collapsed cheapest first up to a cost that is the same for all,
 * on all threads. Borders of blocks stay for a round in which they are no borders. The cost rises
 * from round to round so that the result is close to that of one queue over the whole mesh, while
 * each worker stays inside of its cache. The last edges are taken from one queue, so that the count
 * is met. */
#include "simplify/simplify_order.h"

/* Vertices of a block: small enough for a cache of some MiB, large enough that most are inside. */
static const size_t BLOCK_VERTS = 6000;
/* A round aims at this part of the tets, as long as the target is farther. */
static const double ROUND_SHARE = 0.5;
/* What is left of the way to the target for the last queue. */
static const double LAST_SHARE = 0.04;
/* First guess of how the number of tets falls with cost: tets ~ cost^-FALL. Field errors grow with
 * the square of the edge length, costs with the square of errors times the merged vertices: 3 / 7.
 */
static const double FALL = 3.0 / 7.0;

typedef struct round_job {
    tli_hand **hands;
    const tl_lidx *verts;
    const size_t *starts;
    double cost_max;
    tli_log *logs; /* one a block, NULL without a listener */
} round_job;

static tl_status run_block(void *arg, size_t begin, size_t end, unsigned worker)
{
    round_job *job = arg;
    tli_hand *hand = job->hands[worker];
    tl_status st = TL_OK;
    for (size_t b = begin; !st && b < end; b++) {
        hand->block = (uint16_t)(b + 1);
        hand->cost_max = job->cost_max;
        if (job->logs) hand->log = &job->logs[b];
        tli_queue_clear(hand->queue);
        st = tli_hand_queue(hand, job->verts + job->starts[b], job->starts[b + 1] - job->starts[b]);
        if (!st) st = tli_hand_run(hand, SIZE_MAX);
    }
    return st;
}

/* Median over samples of the cheapest edge of a vertex. */
static double sample_cost(tli_hand *hand, const tl_lidx *verts, size_t count)
{
    enum { SAMPLES = 1001 };
    float best[SAMPLES];
    size_t n = 0;
    for (size_t i = 0; i < SAMPLES && i < count; i++) {
        tl_lidx u = verts[i * (count - 1) /
                          (SAMPLES - 1 > count - 1 ? count - 1 + (count == 1) : SAMPLES - 1)];
        size_t near = tli_star_neighbours(hand->work, u, 0, hand->near);
        float least = INFINITY;
        hand->cost(hand->work, u, hand->near, near, hand->costs);
        for (size_t j = 0; j < near; j++) least = fminf(least, hand->costs[j]);
        if (least == INFINITY) continue;
        size_t at = n++;
        for (; at > 0 && best[at - 1] > least; at--) best[at] = best[at - 1];
        best[at] = least;
    }
    return n ? (double)best[n / 2] : 0;
}

/* Tells the logs of all blocks in their order, and releases them. */
static tl_status tell_logs(const tli_work *w, tli_log *logs, size_t count, tl_status st)
{
    for (size_t b = 0; logs && b < count; b++) {
        if (!st) st = tli_log_tell(&logs[b], w);
        tli_log_release(w->ctx, &logs[b]);
    }
    tl_mem_free(w->ctx, logs);
    return st;
}

static tl_status one_round(tli_work *w, tli_hand **hands, tl_lidx *verts, unsigned round,
                           double cost_max)
{
    size_t *starts = NULL, blocks = 0, count = tli_work_list_live(w, verts);
    tl_status st = tli_partition(w, verts, count, BLOCK_VERTS, round, &starts, &blocks);
    round_job job = {hands, verts, starts, cost_max, NULL};
    if (w->listener) job.logs = tl_mem_zalloc(w->ctx, blocks, sizeof *job.logs, &st);
    if (!st) st = tli_parallel(w->ctx, blocks, 1, run_block, &job);
    st = tell_logs(w, job.logs, blocks, st);
    for (unsigned i = 0; !st && i < w->bank_count; i++) st = tli_hand_settle(hands[i]);
    tl_mem_free(w->ctx, starts);
    return st;
}

/* Rounds down to a little above the target. */
static tl_status all_rounds(tli_work *w, tli_hand **hands, tl_lidx *verts, size_t target)
{
    tl_status st = TL_OK;
    size_t goal = target + (size_t)((double)target * LAST_SHARE);
    double cost = sample_cost(hands[0], verts, tli_work_list_live(w, verts)), fall = FALL;
    if (!(cost > 0)) cost = 1e-12;
    unsigned idle = 0;
    for (unsigned round = 0; !st && w->tets_live > goal && idle < 4 && round < 60; round++) {
        size_t before = w->tets_live;
        double aim = (double)before * ROUND_SHARE;
        if (aim < (double)goal) aim = (double)goal;
        if (round) cost *= fmin(pow((double)before / aim, 1 / fall), 64);
        st = one_round(w, hands, verts, round, cost);
        idle = w->tets_live == before ? idle + 1 : 0;
        if (!st) st = tli_order_report(w, w->tets_live, target);
    }
    return st;
}

tl_status tli_order_blocks(tli_work *w, size_t target)
{
    tl_status st = TL_OK;
    tl_lidx *verts = tl_mem_alloc(w->ctx, w->verts_live, sizeof *verts, &st);
    tli_hand **hands = tl_mem_zalloc(w->ctx, w->bank_count, sizeof *hands, &st);
    for (unsigned i = 0; !st && i < w->bank_count; i++) st = tli_hand_create(w, i, &hands[i]);
    if (!st && w->verts_live > BLOCK_VERTS) st = all_rounds(w, hands, verts, target);
    for (unsigned i = 0; hands && i < w->bank_count; i++) tli_hand_destroy(hands[i]);
    tl_mem_free(w->ctx, hands);
    tl_mem_free(w->ctx, verts);
    return st ? st : tli_order_queue(w, target);
}
