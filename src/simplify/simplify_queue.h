/* Stage simplify, internal: a queue of edges by cost. Buckets of equal leading bits, 32 an octave,
 * so that pushing and popping cost a few operations; inside a bucket (costs equal within 2.2 %) the
 * last one in is the first one out. Entries grow old when an end changes and are dropped when
 * popped. */
#ifndef TETRALOD_SRC_SIMPLIFY_QUEUE_H
#define TETRALOD_SRC_SIMPLIFY_QUEUE_H

#include <string.h>

#include "base/base.h"

typedef struct tli_queue tli_queue;

typedef struct tli_queue_entry {
    tl_lidx u, v;
    uint32_t stamp; /* sum of the versions of u and v */
} tli_queue_entry;

tl_status tli_queue_create(tl_ctx *ctx, tli_queue **queue);
void tli_queue_destroy(tl_ctx *ctx, tli_queue *queue);
/* Bucket of a cost >= 0: it rises with the cost and fits 16 bits. */
static inline uint32_t tli_queue_bucket(float cost)
{
    uint32_t bits;
    memcpy(&bits, &cost, sizeof bits);
    return bits >> 18;
}
/* The largest cost of a bucket. */
static inline double tli_queue_cost(uint32_t bucket)
{
    uint32_t bits = bucket << 18 | ((1u << 18) - 1);
    float cost;
    memcpy(&cost, &bits, sizeof cost);
    return (double)cost;
}
/* Buckets of finite costs. */
#define TLI_QUEUE_COSTS (0x7f800000u >> 18)
tl_status tli_queue_push(tli_queue *queue, uint32_t bucket, tli_queue_entry entry);
/* Pops an entry of the lowest bucket; false when the queue is empty. */
bool tli_queue_pop(tli_queue *queue, tli_queue_entry *entry);
/* The entry that comes after the next pops, for prefetching; NULL when the chunk at hand ends. */
const tli_queue_entry *tli_queue_peek(const tli_queue *queue, unsigned ahead);
/* False when nothing is left to pop. */
bool tli_queue_occupied(const tli_queue *queue);
/* Lower end of the bucket popped last. */
double tli_queue_level(const tli_queue *queue);
/* Drops all entries, keeps the memory. */
void tli_queue_clear(tli_queue *queue);

#endif
