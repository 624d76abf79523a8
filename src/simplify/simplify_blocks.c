/* The default order: rounds of blocks. In each round the vertices are divided into blocks, and
 * inside of every block edges are collapsed cheapest first up to a cost that is the same for all,
 * on all threads. Borders of blocks stay for a round in which they are no borders. The cost rises
 * from round to round so that the result is close to that of one queue over the whole mesh, while
 * each worker stays inside of its cache. The last edges are taken from one queue, so that the count
 * is met. */
#include "simplify/simplify_order.h"

/* Vertices of a block: few enough for a cache of some MiB, enough that most are inside; where the
 * mesh is small, as many blocks as keep some threads busy, down to the smaller size. */
static const size_t BLOCK_VERTS = 12000, BLOCK_VERTS_LEAST = 8000, BLOCKS_WANTED = 10;
/* A round aims at this part of the tets, as long as the target is farther. */
static const double ROUND_SHARE = 0.15;
/* What is left of the way to the target for the last queue. */
static const double LAST_SHARE = 0.3;
/* The first round goes up to this multiple of the median of the vertices' cheapest edges. */
static const double FIRST_COST = 40, LEAST_COST = 1e-12;
/* How the number of tets falls with the cost of a round: tets ~ cost^-FALL. Field errors grow with
 * the square of the edge length and costs with their squares, which gives 3 / 7 for one queue;
 * borders that become free add to it. */
static const double FALL = 0.65;

typedef struct round_job {
    tli_hand **hands;
    const tl_lidx *verts; /* by block, for the first round */
    const size_t *vert_starts;
    tli_pool *dealt; /* edges by block, for later rounds; without lists in the first */
    tli_pool *next;  /* receives the edges that wait on: a list a block, list 0 for those in none */
    double cost_max;
    tli_log *logs; /* one a block, NULL without a listener */
} round_job;

/* Takes the edges out of a list whose ends have changed since. */
static tl_status drop_old(const tli_work *w, tli_edges *list)
{
    tl_status st = TL_OK;
    size_t count = 0;
    for (size_t i = 0; i < list->count; i++) {
        tli_edge e = list->edges[i];
        if (e.stamp == (uint16_t)(w->verts[e.u].version + w->verts[e.v].version))
            list->edges[count++] = e;
    }
    list->count = list->capacity = count;
    list->edges = tl_mem_resize(w->ctx, list->edges, count, sizeof *list->edges, &st);
    return st;
}

static tl_status run_block(void *arg, size_t begin, size_t end, unsigned worker)
{
    round_job *job = arg;
    tli_hand *hand = job->hands[worker];
    tl_status st = TL_OK;
    for (size_t b = begin; !st && b < end; b++) {
        hand->in_block = true;
        hand->cost_max = job->cost_max;
        hand->later = &job->next->lists[b + 1];
        if (job->logs) hand->log = &job->logs[b];
        tli_queue_clear(hand->queue);
        if (job->dealt->lists) {
            tli_edges *list = &job->dealt->lists[b + 1];
            st = tli_hand_queue_again(hand, list->edges, list->count);
            tl_mem_free(hand->work->ctx, list->edges);
            *list = (tli_edges){0};
        } else
            st = tli_hand_queue(hand, job->verts + job->vert_starts[b],
                                job->vert_starts[b + 1] - job->vert_starts[b]);
        if (!st) st = tli_hand_run(hand, SIZE_MAX);
        if (!st) st = drop_old(hand->work, hand->later);
    }
    return st;
}

/* Median over samples of the cheapest edge of a vertex. */
static double sample_cost(tli_hand *hand, const tl_lidx *verts, size_t count)
{
    enum { SAMPLES = 1001 };
    float best[SAMPLES];
    size_t n = 0;
    for (size_t i = 0; i < count; i += count / SAMPLES + 1) {
        tl_lidx u = verts[i];
        size_t near = tli_star_neighbours(hand->work, u, hand->near);
        float least = INFINITY;
        hand->cost(hand->work, u, hand->near, near, hand->costs);
        for (size_t j = 0; j < near; j++) least = hand->costs[j] < least ? hand->costs[j] : least;
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

static size_t block_size(size_t verts)
{
    size_t size = verts / BLOCKS_WANTED;
    if (size < BLOCK_VERTS_LEAST) size = BLOCK_VERTS_LEAST;
    return size > BLOCK_VERTS ? BLOCK_VERTS : size;
}

static tl_status one_round(tli_work *w, tli_hand **hands, tli_pool *pool, tl_lidx *verts,
                           unsigned round, double cost_max)
{
    size_t *vert_starts = NULL, blocks = 0, count = tli_work_list_live(w, verts);
    tl_status st = tli_partition(w, verts, count, block_size(count), round, &vert_starts, &blocks);
    if (!st && round) st = tli_pool_deal(w, pool, blocks);
    tli_pool next = {NULL, blocks + 1};
    next.lists = tl_mem_zalloc(w->ctx, blocks + 1, sizeof *next.lists, &st);
    if (!st && round) { /* edges that lie in no block wait on */
        next.lists[0] = pool->lists[0];
        pool->lists[0] = (tli_edges){0};
    }
    round_job job = {hands, verts, vert_starts, pool, &next, cost_max, NULL};
    if (w->listener) job.logs = tl_mem_zalloc(w->ctx, blocks, sizeof *job.logs, &st);
    if (!st) st = tli_parallel(w->ctx, blocks, 1, run_block, &job);
    st = tell_logs(w, job.logs, blocks, st);
    for (unsigned i = 0; !st && i < w->bank_count; i++) st = tli_hand_settle(hands[i]);
    tli_pool_release(w->ctx, pool);
    *pool = next;
    tl_mem_free(w->ctx, vert_starts);
    return st;
}

/* Rounds down to a little above the target. */
static tl_status all_rounds(tli_work *w, tli_hand **hands, tl_lidx *verts, size_t target)
{
    tli_pool pool = {0};
    tl_status st = TL_OK;
    size_t goal = target + (size_t)((double)target * LAST_SHARE);
    double cost = sample_cost(hands[0], verts, tli_work_list_live(w, verts));
    cost = cost > 0 ? FIRST_COST * cost : LEAST_COST;
    unsigned idle = 0;
    for (unsigned round = 0; !st && w->tets_live > goal && idle < 4 && round < 60; round++) {
        size_t before = w->tets_live;
        double aim = (double)before * ROUND_SHARE;
        if (aim < (double)goal) aim = (double)goal;
        if (round) cost *= fmin(pow((double)before / aim, 1 / FALL), 64);
        st = one_round(w, hands, &pool, verts, round, cost);
        idle = w->tets_live == before ? idle + 1 : 0;
        if (!st) st = tli_order_report(w, w->tets_live, target);
    }
    tli_pool_release(w->ctx, &pool);
    return st;
}

tl_status tli_order_blocks(tli_work *w, size_t target)
{
    tl_status st = TL_OK;
    tl_lidx *verts = tl_mem_alloc(w->ctx, w->verts_live, sizeof *verts, &st);
    tli_hand **hands = tl_mem_zalloc(w->ctx, w->bank_count, sizeof *hands, &st);
    for (unsigned i = 0; !st && i < w->bank_count; i++) st = tli_hand_create(w, i, &hands[i]);
    if (!st && w->verts_live > 2 * BLOCK_VERTS_LEAST) st = all_rounds(w, hands, verts, target);
    for (unsigned i = 0; hands && i < w->bank_count; i++) tli_hand_destroy(hands[i]);
    tl_mem_free(w->ctx, hands);
    tl_mem_free(w->ctx, verts);
    return st ? st : tli_order_queue(w, target);
}
