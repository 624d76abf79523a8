/* A bucket queue over the leading bits of a float32 cost. */
#include "simplify/simplify_queue.h"

#include <string.h>

enum {
    BUCKET_SHIFT = 18, /* 8 bits of exponent and 5 of mantissa stay */
    BUCKETS = 8192,
    CHUNK_ENTRIES = 42
};

/* A stack of entries is a list of chunks, the fullest last. */
typedef struct chunk {
    struct chunk *next;
    uint32_t count;
    tli_queue_entry entries[CHUNK_ENTRIES];
} chunk;

struct tli_queue {
    tli_arena arena;
    chunk *buckets[BUCKETS];
    uint64_t occupied[BUCKETS / 64];
    uint32_t lowest; /* no bucket below it is occupied */
    chunk *spare;
};

tl_status tli_queue_create(tl_ctx *ctx, tli_queue **queue)
{
    tl_status st = TL_OK;
    *queue = tl_mem_zalloc(ctx, 1, sizeof **queue, &st);
    if (!st) tli_arena_open(ctx, &(*queue)->arena);
    return st;
}

void tli_queue_destroy(tl_ctx *ctx, tli_queue *queue)
{
    if (!queue) return;
    tli_arena_close(&queue->arena);
    tl_mem_free(ctx, queue);
}

tl_status tli_queue_push(tli_queue *queue, uint32_t b, tli_queue_entry entry)
{
    chunk *c = queue->buckets[b];
    if (!c || c->count == CHUNK_ENTRIES) {
        chunk *fresh = queue->spare;
        if (fresh)
            queue->spare = fresh->next;
        else {
            tl_status st = TL_OK;
            fresh = tli_arena_alloc(&queue->arena, 1, sizeof *fresh, &st);
            if (st) return st;
        }
        fresh->next = c;
        fresh->count = 0;
        queue->buckets[b] = c = fresh;
        queue->occupied[b / 64] |= (uint64_t)1 << (b % 64);
        if (b < queue->lowest) queue->lowest = b;
    }
    c->entries[c->count++] = entry;
    return TL_OK;
}

bool tli_queue_pop(tli_queue *queue, tli_queue_entry *entry)
{
    for (uint32_t word = queue->lowest / 64; word < BUCKETS / 64; word++) {
        if (!queue->occupied[word]) continue;
        uint32_t b = word * 64 + (uint32_t)__builtin_ctzll(queue->occupied[word]);
        chunk *c = queue->buckets[b];
        *entry = c->entries[--c->count];
        queue->lowest = b;
        if (c->count == 0) {
            queue->buckets[b] = c->next;
            c->next = queue->spare;
            queue->spare = c;
            if (!queue->buckets[b]) queue->occupied[word] &= ~((uint64_t)1 << (b % 64));
        }
        return true;
    }
    queue->lowest = BUCKETS - 1;
    return false;
}

const tli_queue_entry *tli_queue_peek(const tli_queue *queue, unsigned ahead)
{
    const chunk *c = queue->buckets[queue->lowest];
    return c && c->count > ahead ? &c->entries[c->count - 1 - ahead] : NULL;
}

bool tli_queue_occupied(const tli_queue *queue)
{
    for (uint32_t word = queue->lowest / 64; word < BUCKETS / 64; word++)
        if (queue->occupied[word]) return true;
    return false;
}

double tli_queue_level(const tli_queue *queue)
{
    uint32_t bits = queue->lowest << BUCKET_SHIFT;
    float f;
    memcpy(&f, &bits, sizeof f);
    return (double)f;
}

void tli_queue_clear(tli_queue *queue)
{
    for (uint32_t b = 0; b < BUCKETS; b++)
        while (queue->buckets[b]) {
            chunk *c = queue->buckets[b];
            queue->buckets[b] = c->next;
            c->next = queue->spare;
            queue->spare = c;
        }
    memset(queue->occupied, 0, sizeof queue->occupied);
    queue->lowest = BUCKETS - 1;
}
