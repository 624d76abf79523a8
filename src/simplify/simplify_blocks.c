/* The default order: rounds of blocks. In each round the vertices are divided into blocks, and
 * inside of every block edges are collapsed cheapest first up to a cost that is the same for all,
 * on all threads. Borders of blocks stay for a round in which they are no borders. The cost is
 * taken from the costs of all edges that wait, so that it stays below the one at which a single
 * queue over the whole mesh would end, while each worker stays inside of its cache. The last edges
 * are taken from one queue, so that the count is met. */
#include "base/base_sort.h"
#include "simplify/simplify_order.h"

/* Vertices of a block: few enough for a cache of some MiB, enough that most are inside. A small
 * mesh has some blocks, too, so that threads have work, but of no fewer vertices than that. */
static const size_t BLOCK_VERTS = 9000, BLOCKS_LEAST = 6, BLOCK_VERTS_LEAST = 1000;
/* Fewer vertices go into one queue. */
static const size_t ROUNDS_FROM = 16000;
/* A round aims at this part of the tets, or at what is above the target and its margin. */
static const double ROUND_SHARE = 0.5, MARGIN = 0.05;
/* Tets above the target, in targets, that are left for the last queue. */
static const double LAST_SHARE = 0.1;
/* The first round goes up to this multiple of the median of the vertices' cheapest edges. */
static const double FIRST_COST = 40, LEAST_COST = 1e-12;
/* Where the mesh was thinned, to this part of what the last collapses are expected to cost. */
static const double THINNED_COST = 0.3;
/* Tets that go for each edge that a round may collapse: hardly differs from mesh to mesh, so that a
 * round tells the next one. */
static const double YIELD = 0.7, YIELD_LEAST = 0.3, YIELD_MOST = 1;
/* A round that takes away less than this part of the tets is idle; so many end the rounds. */
static const double IDLE_SHARE = 0.005;
enum { IDLE_MAX = 2, ROUNDS_MAX = 60 };

/* What goes from round to round. */
typedef struct rounds {
    tli_work *work;
    tli_hand **hands; /* one a worker */
    tl_lidx *verts;   /* those that live, ascending */
    size_t vert_count, target;
    tli_pool pool;   /* edges that wait */
    tli_tally tally; /* of the pool, once dealt */
    unsigned number; /* of the round */
    double cost;     /* up to which it goes */
    double yield;
} rounds;

typedef struct round_job {
    tli_hand **hands;
    const tl_lidx *verts; /* by block, for the first round */
    const size_t *vert_starts;
    tli_pool *dealt; /* edges by block, for later rounds; without lists in the first */
    tli_pool *next;  /* receives the edges that wait on: a list a block, list 0 for those in none */
    const uint32_t *order; /* of the blocks, those with most work first */
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
    for (size_t i = begin; !st && i < end; i++) {
        size_t b = job->order[i];
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

static size_t count_blocks(size_t verts)
{
    size_t count = verts / BLOCK_VERTS_LEAST;
    if (count > BLOCKS_LEAST) count = BLOCKS_LEAST;
    if (count < verts / BLOCK_VERTS) count = verts / BLOCK_VERTS;
    return count ? count : 1;
}

/* Blocks by the work that waits in them, the most first: a thread that begins a large one late
 * would keep the others waiting. */
static tl_status order_blocks(const round_job *job, tl_ctx *ctx, size_t blocks, uint32_t **order)
{
    tl_status st = TL_OK;
    uint64_t *keys = tl_mem_alloc(ctx, blocks, sizeof *keys, &st);
    *order = tl_mem_alloc(ctx, blocks, sizeof **order, &st);
    for (size_t b = 0; !st && b < blocks; b++) {
        size_t work = job->dealt->lists ? job->dealt->lists[b + 1].count
                                        : job->vert_starts[b + 1] - job->vert_starts[b];
        keys[b] = UINT64_MAX - work;
        (*order)[b] = (uint32_t)b;
    }
    if (!st) st = tli_sort_u64(ctx, keys, *order, blocks);
    tl_mem_free(ctx, keys);
    return st;
}

/* Sets the cost at which the round should take away its share, if all edges could be collapsed;
 * gives the number of edges up to it that can. */
static size_t aim(rounds *r)
{
    double live = (double)r->work->tets_live, above = live - (double)r->target * (1 + MARGIN);
    double wanted = fmin(above, live * ROUND_SHARE) / r->yield;
    size_t all = 0, inside = 0;
    uint32_t b = 0;
    for (; b < TLI_QUEUE_COSTS; b++) {
        all += r->tally.all[b];
        inside += r->tally.inside[b];
        if ((double)all >= wanted) break;
    }
    r->cost = b < TLI_QUEUE_COSTS ? tli_queue_cost(b) : (double)FLT_MAX;
    return inside;
}

/* Vertices and edges to their blocks. */
static tl_status deal(rounds *r, round_job *job, tl_lidx **sorted, size_t **starts, size_t *blocks)
{
    tli_work *w = r->work;
    size_t live = 0;
    for (size_t i = 0; i < r->vert_count; i++)
        if (w->verts[r->verts[i]].merged == r->verts[i]) r->verts[live++] = r->verts[i];
    r->vert_count = live;
    tl_status st =
        tli_partition(w, r->verts, r->vert_count, count_blocks(r->vert_count), r->number, blocks);
    if (!st && r->number) st = tli_pool_deal(w, &r->pool, *blocks, &r->tally);
    if (!st && !r->number)
        st = tli_sort_by_block(w, r->verts, r->vert_count, *blocks, sorted, starts);
    job->verts = *sorted;
    job->vert_starts = *starts;
    return st;
}

static tl_status one_round(rounds *r)
{
    tli_work *w = r->work;
    tl_lidx *sorted = NULL;
    size_t *starts = NULL, blocks = 0, before = w->tets_live, edges = 0;
    uint32_t *order = NULL;
    tli_pool next = {0};
    round_job job = {.hands = r->hands, .dealt = &r->pool, .next = &next};
    tl_status st = deal(r, &job, &sorted, &starts, &blocks);
    next.lists = tl_mem_zalloc(w->ctx, blocks + 1, sizeof *next.lists, &st);
    if (!st) next.list_count = blocks + 1;
    if (!st && r->number) { /* edges that lie in no block wait on */
        edges = aim(r);
        next.lists[0] = r->pool.lists[0];
        r->pool.lists[0] = (tli_edges){0};
    }
    job.cost_max = r->cost;
    if (!st) st = order_blocks(&job, w->ctx, blocks, &order);
    job.order = order;
    if (w->listener) job.logs = tl_mem_zalloc(w->ctx, blocks, sizeof *job.logs, &st);
    if (!st) st = tli_parallel(w->ctx, blocks, 1, run_block, &job);
    st = tell_logs(w, job.logs, blocks, st);
    for (unsigned i = 0; !st && i < w->bank_count; i++) st = tli_hand_settle(r->hands[i]);
    if (edges) r->yield = (double)(before - w->tets_live) / (double)edges;
    r->yield = fmin(fmax(r->yield, YIELD_LEAST), YIELD_MOST);
    tli_pool_release(w->ctx, &r->pool);
    r->pool = next;
    tl_mem_free(w->ctx, order);
    tl_mem_free(w->ctx, starts);
    tl_mem_free(w->ctx, sorted);
    return st;
}

/* Rounds down to a little above the target, or until they achieve nothing. */
static tl_status all_rounds(rounds *r)
{
    tl_status st = TL_OK;
    tli_work *w = r->work;
    size_t last = r->target + (size_t)((double)r->target * LAST_SHARE);
    r->vert_count = tli_work_list_live(w, r->verts);
    r->cost = THINNED_COST * w->last_cost;
    if (!(r->cost > 0)) r->cost = FIRST_COST * sample_cost(r->hands[0], r->verts, r->vert_count);
    if (!(r->cost > 0)) r->cost = LEAST_COST;
    r->yield = YIELD;
    for (unsigned idle = 0; !st && w->tets_live > last && idle < IDLE_MAX && r->number < ROUNDS_MAX;
         r->number++) {
        size_t before = w->tets_live;
        st = one_round(r);
        bool little = (double)(before - w->tets_live) < IDLE_SHARE * (double)before;
        idle = little ? idle + 1 : 0;
        if (!st) st = tli_order_report(w, w->tets_live, r->target);
    }
    return st;
}

/* Takes out the edges that were refused, most of them in the round before. */
static void drop_refused(tli_edges *list)
{
    size_t count = 0;
    for (size_t i = 0; i < list->count; i++)
        if (!(list->edges[i].cost & TLI_REFUSED)) list->edges[count++] = list->edges[i];
    list->count = count;
}

/* What is left of the way to the target, out of one queue of all edges that wait. */
static tl_status take_rest(rounds *r)
{
    tl_status st = TL_OK;
    tli_hand *hand = r->hands[0];
    if (r->work->tets_live <= r->target) return TL_OK;
    hand->in_block = false;
    hand->cost_max = (double)FLT_MAX;
    hand->later = NULL;
    hand->log = &hand->own_log;
    tli_queue_clear(hand->queue);
    for (size_t l = 0; !st && l < r->pool.list_count; l++) {
        drop_refused(&r->pool.lists[l]);
        st = tli_hand_queue_again(hand, r->pool.lists[l].edges, r->pool.lists[l].count);
    }
    if (!st) st = tli_hand_run(hand, r->work->tets_live - r->target);
    if (!st) st = tli_hand_settle(hand);
    return st;
}

tl_status tli_order_blocks(tli_work *w, size_t target)
{
    tl_status st = TL_OK;
    rounds r = {.work = w, .target = target};
    if (w->verts_live < ROUNDS_FROM) return tli_order_queue(w, target);
    r.verts = tl_mem_alloc(w->ctx, w->verts_live, sizeof *r.verts, &st);
    r.hands = tl_mem_zalloc(w->ctx, w->bank_count, sizeof *r.hands, &st);
    for (unsigned i = 0; !st && i < w->bank_count; i++) st = tli_hand_create(w, i, &r.hands[i]);
    if (!st) st = all_rounds(&r);
    if (!st) st = take_rest(&r);
    tli_pool_release(w->ctx, &r.pool);
    for (unsigned i = 0; r.hands && i < w->bank_count; i++) tli_hand_destroy(r.hands[i]);
    tl_mem_free(w->ctx, r.hands);
    tl_mem_free(w->ctx, r.verts);
    return st ? st : tli_order_queue(w, target);
}
