/* Arena: small blocks out of growing chunks, freed together. */
#include "base/base.h"

#include <stdalign.h>

#define ARENA_ALIGN 16
#define CHUNK_BYTES_FIRST ((size_t)4 << 10)
#define CHUNK_BYTES_MAX ((size_t)1 << 20)

struct tli_arena_chunk {
    alignas(ARENA_ALIGN) tli_arena_chunk *next;
    size_t used, capacity; /* bytes behind this struct */
};

_Static_assert(sizeof(tli_arena_chunk) % ARENA_ALIGN == 0, "the first block must be aligned");

void tli_arena_open(tl_ctx *ctx, tli_arena *arena)
{
    *arena = (tli_arena){.ctx = ctx};
}

void tli_arena_close(tli_arena *arena)
{
    for (tli_arena_chunk *c = arena->chunks, *next; c; c = next) {
        next = c->next;
        tl_mem_free(arena->ctx, c);
    }
    arena->chunks = NULL;
}

/* A chunk of its own size for a large block goes behind the current one, whose rest stays in use.
 */
static tli_arena_chunk *chunk_add(tli_arena *arena, size_t wanted, tl_status *status)
{
    tli_arena_chunk *head = arena->chunks;
    size_t capacity = head ? head->capacity * 2 : CHUNK_BYTES_FIRST;
    if (capacity > CHUNK_BYTES_MAX) capacity = CHUNK_BYTES_MAX;
    bool own = wanted > capacity / 4;
    if (own) capacity = wanted;
    size_t bytes;
    if (!tli_add_size(sizeof(tli_arena_chunk), capacity, &bytes)) bytes = SIZE_MAX;
    tli_arena_chunk *c = tl_mem_alloc(arena->ctx, bytes, 1, status);
    if (!c) return NULL;
    c->used = 0;
    c->capacity = capacity;
    if (own && head) {
        c->next = head->next;
        head->next = c;
    } else {
        c->next = head;
        arena->chunks = c;
    }
    return c;
}

void *tli_arena_alloc(tli_arena *arena, size_t count, size_t elem_bytes, tl_status *status)
{
    size_t bytes;
    if (*status) return NULL;
    if (!tli_mul_size(count, elem_bytes, &bytes) || !tli_add_size(bytes, ARENA_ALIGN - 1, &bytes)) {
        *status = tl_fail(arena->ctx, TL_ERR_MEMORY,
                          "%zu elements of %zu bytes do not fit into memory", count, elem_bytes);
        return NULL;
    }
    bytes &= ~(size_t)(ARENA_ALIGN - 1);
    if (!bytes) bytes = ARENA_ALIGN; /* blocks differ even when empty */
    tli_arena_chunk *c = arena->chunks;
    if (!c || bytes > c->capacity - c->used) c = chunk_add(arena, bytes, status);
    if (!c) return NULL;
    void *block = (char *)(c + 1) + c->used;
    c->used += bytes;
    return block;
}
