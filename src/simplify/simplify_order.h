/* Stage simplify, internal: the orders in which edges are collapsed. Each takes the working mesh
 * down to a number of tets, or to where nothing more is allowed. */
#ifndef TETRALOD_SRC_SIMPLIFY_ORDER_H
#define TETRALOD_SRC_SIMPLIFY_ORDER_H

#include <float.h>

#include "simplify/simplify_cost.h"
#include "simplify/simplify_hood.h"
#include "simplify/simplify_queue.h"

/* Collapses noted for the listener, in the order in which they were made. simplify_log.c */
typedef struct tli_log {
    tl_collapse *records; /* values are set when they are told */
    double *values;       /* [count][components], scaled */
    size_t count, capacity;
} tli_log;
tl_status tli_log_add(tli_log *log, const tli_work *work, tl_lidx kept, tl_lidx gone, double cost);
/* Calls the listener for each and empties the log. */
tl_status tli_log_tell(tli_log *log, const tli_work *work);
void tli_log_release(tl_ctx *ctx, tli_log *log);

/* Collapses kept back from the listener while the try that made them may still be thrown away; ctx
 * and components are set by the owner. simplify_log.c */
typedef struct tli_held {
    tl_ctx *ctx;
    tl_collapse *records;
    double *values; /* [capacity][components] */
    size_t components, count, capacity;
} tli_held;
/* A tl_collapse_fn. */
tl_status tli_held_add(void *held, const tl_collapse *collapse);
tl_status tli_held_tell(tli_held *held, tl_collapse_fn listener, void *user);
void tli_held_release(tli_held *held);

/* An edge that waits for a later round. */
typedef struct tli_edge {
    tl_lidx u, v;
    uint16_t cost;  /* bucket of the queue, and TLI_REFUSED */
    uint16_t stamp; /* of the sum of versions */
} tli_edge;
/* Set in the cost of an edge whose collapse the mesh has refused. */
#define TLI_REFUSED 0x8000u
typedef struct tli_edges {
    tli_edge *edges;
    size_t count, capacity;
} tli_edges;

/* What one worker needs to collapse edges on its own. simplify_hand.c */
typedef struct tli_hand {
    tli_work *work;
    tli_hood *hood;
    tli_queue *queue;
    tli_star_bank *bank;
    tli_cost_fn cost;
    bool in_block;    /* edges to border vertices wait */
    double cost_max;  /* edges above it are left alone */
    double cost_now;  /* of the collapse at hand, for the listener */
    tl_lidx kept;     /* of the last collapse */
    tli_edges *later; /* receives edges that wait or were refused; NULL: they are forgotten */
    tli_log *log;     /* own_log, unless the order sets another */
    tli_log own_log;
    size_t tets_gone, verts_gone, verdicts[TLI_VERDICT_COUNT]; /* since the last settling */
    tl_lidx near[3 * TLI_STAR_MAX];
    float costs[3 * TLI_STAR_MAX];
} tli_hand;

/* worker: number of the bank that it may use. */
tl_status tli_hand_create(tli_work *work, unsigned worker, tli_hand **hand);
void tli_hand_destroy(tli_hand *hand);
/* Queues the edges of the vertices verts [count], each once, or lets them wait. Several hands may
 * do so at a time for vertices of different blocks. */
tl_status tli_hand_queue(tli_hand *hand, const tl_lidx *verts, size_t count);
/* Queues the edges from u to hand->near [count], or lays them aside where they cost too much now.
 */
tl_status tli_hand_queue_from(tli_hand *hand, tl_lidx u, size_t count);
/* Queues edges that waited, or lets them wait on; drops old ones. */
tl_status tli_hand_queue_again(tli_hand *hand, const tli_edge *edges, size_t count);
/* Collapses queued edges, cheapest first, until the queue is empty or tets_gone reaches tets_max.
 */
tl_status tli_hand_run(tli_hand *hand, size_t tets_max);
/* Collapses one edge if the mesh allows it. */
tl_status tli_hand_collapse(tli_hand *hand, tli_queue_entry edge, bool *done);
/* Adds what the hand did to the working mesh's counts and tells its own log. */
tl_status tli_hand_settle(tli_hand *hand);

/* ---- edges that wait, by blocks: simplify_pool.c ---- */

/* Edges in lists whose order does not depend on threads. */
typedef struct tli_pool {
    tli_edges *lists; /* [list_count] */
    size_t list_count;
} tli_pool;

/* How many edges wait at each cost, without refused ones. */
typedef struct tli_tally {
    uint32_t inside[TLI_QUEUE_COSTS]; /* of a block */
    uint32_t all[TLI_QUEUE_COSTS];
} tli_tally;
/* Deals the edges to lists by block: list b (1 .. block_count) has those that lie inside of block b
 * with all their neighbours, list 0 those that lie in none. Those whose ends have changed go. */
tl_status tli_pool_deal(tli_work *work, tli_pool *pool, size_t block_count, tli_tally *tally);
void tli_pool_release(tl_ctx *ctx, tli_pool *pool);

/* Divides vertices into blocks, about so many as wanted, by planes that lie elsewhere in each
 * round; sets block numbers, 1 .. *block_count, and which vertices are at a border.
 * simplify_partition.c */
tl_status tli_partition(tli_work *work, const tl_lidx *verts, size_t count, size_t wanted,
                        unsigned round, size_t *block_count);
/* Gives the vertices by block, sorted [count], and starts [block_count + 1] into them. */
tl_status tli_sort_by_block(const tli_work *work, const tl_lidx *verts, size_t count,
                            size_t block_count, tl_lidx **sorted, size_t **starts);

/* Reports how far live tets are from the input's to target. */
static inline tl_status tli_order_report(const tli_work *work, size_t live, size_t target)
{
    size_t total = work->input_tets - target, done = work->input_tets - live;
    return tl_progress(work->ctx, "simplify", done < total ? done : total, total);
}

/* Takes the mesh down to at most target tets, as far as it goes. */
tl_status tli_order_blocks(tli_work *work, size_t target);
tl_status tli_order_queue(tli_work *work, size_t target);
tl_status tli_order_independent(tli_work *work, size_t target);
tl_status tli_order_randomized(tli_work *work, size_t target, uint64_t seed);

#endif
