/* Memory of a context: every block is counted against the budget before it is asked for. A header
 * in front of each block keeps its size, so that it can be freed and resized without the caller
 * telling it, and a guard that finds overruns from below and double frees. The only file that calls
 * the system's allocator. */
#include "base/base_context.h"
#include "base/base_spill.h"

#include <stdalign.h>
#include <stdlib.h>
#include <string.h>

typedef struct header {
    alignas(16) size_t bytes; /* of the whole block, header included */
    uintptr_t guard;
} header;

_Static_assert(sizeof(header) == 16, "blocks must stay aligned to 16 bytes");

/* Of a block that lies in a working file. */
#define GUARD_SPILLED ((uintptr_t)0x5b111ed5a11ce5u)
#define GUARD_ALIVE ((uintptr_t)0x7e7a10d5a11ce5u)

void *tli_resize_default(void *user, void *block, size_t old_bytes, size_t new_bytes)
{
    (void)user;
    (void)old_bytes;
    if (!new_bytes) {
        free(block);
        return NULL;
    }
    return realloc(block, new_bytes);
}

size_t tl_ctx_current_bytes(const tl_ctx *ctx)
{
    return atomic_load_explicit(&ctx->root->current_bytes, memory_order_relaxed);
}

size_t tl_ctx_peak_bytes(const tl_ctx *ctx)
{
    return atomic_load_explicit(&ctx->root->peak_bytes, memory_order_relaxed);
}

void tl_ctx_set_budget(tl_ctx *ctx, size_t budget_bytes)
{
    atomic_store(&ctx->root->budget_bytes, budget_bytes);
}

size_t tli_ctx_room(const tl_ctx *ctx)
{
    const size_t budget = atomic_load(&ctx->root->budget_bytes);
    const size_t now = tl_ctx_current_bytes(ctx);
    return !budget ? SIZE_MAX : now < budget ? budget - now : 0;
}

void tl_ctx_reset_peak(tl_ctx *ctx)
{
    tl_ctx *root = ctx->root;
    if (ctx == root) atomic_store(&root->peak_bytes, atomic_load(&root->current_bytes));
}

/* ---- accounting ---- */

/* Takes bytes from the budget, or fails and takes nothing. */
static tl_status reserve(tl_ctx *ctx, size_t bytes)
{
    tl_ctx *root = ctx->root;
    size_t budget = atomic_load_explicit(&root->budget_bytes, memory_order_relaxed);
    if (!budget) budget = SIZE_MAX;
    size_t now = atomic_load_explicit(&root->current_bytes, memory_order_relaxed);
    do {
        if (now > budget || bytes > budget - now)
            return tl_fail(ctx, TL_ERR_BUDGET,
                           "%zu bytes wanted, but %zu of the budget of %zu bytes are in use", bytes,
                           now, budget);
    } while (!atomic_compare_exchange_weak_explicit(&root->current_bytes, &now, now + bytes,
                                                    memory_order_relaxed, memory_order_relaxed));
    now += bytes;
    size_t peak = atomic_load_explicit(&root->peak_bytes, memory_order_relaxed);
    while (now > peak &&
           !atomic_compare_exchange_weak_explicit(&root->peak_bytes, &peak, now,
                                                  memory_order_relaxed, memory_order_relaxed))
        continue;
    return TL_OK;
}

static void give_back(tl_ctx *ctx, size_t bytes)
{
    atomic_fetch_sub_explicit(&ctx->root->current_bytes, bytes, memory_order_relaxed);
}

static tl_status fail_memory(tl_ctx *ctx, size_t bytes)
{
    return tl_fail(ctx, TL_ERR_MEMORY, "the allocator has no %zu bytes (%zu in use)", bytes,
                   tl_ctx_current_bytes(ctx));
}

static tl_status block_bytes(tl_ctx *ctx, size_t count, size_t elem_bytes, size_t *bytes)
{
    size_t payload;
    if (!tli_mul_size(count, elem_bytes, &payload) ||
        !tli_add_size(payload, sizeof(header), bytes) || *bytes > PTRDIFF_MAX)
        return tl_fail(ctx, TL_ERR_MEMORY, "%zu elements of %zu bytes do not fit into memory",
                       count, elem_bytes);
    return TL_OK;
}

/* ---- blocks ---- */

static void *publish(header *h, size_t bytes)
{
    h->bytes = bytes;
    h->guard = GUARD_ALIVE ^ bytes;
    return h + 1;
}

static header *header_of(void *block)
{
    header *h = (header *)block - 1;
    /* else freed twice, foreign, or written below */
    TL_ASSERT(h->guard == (GUARD_ALIVE ^ h->bytes) || h->guard == (GUARD_SPILLED ^ h->bytes));
    return h;
}

static bool is_spilled(const header *h)
{
    return h->guard == (GUARD_SPILLED ^ h->bytes);
}

static bool spills(const tl_ctx *ctx, size_t bytes)
{
    return ctx->root->spill_folder && bytes >= TLI_SPILL_BYTES;
}

/* A block in a file is zero at first. */
static void *spill_create(tl_ctx *ctx, size_t bytes, size_t room, tl_status *status)
{
    header *h = tli_spill_map(ctx, room);
    if (!h) {
        *status = TL_ERR_IO;
        return NULL;
    }
    h->bytes = bytes;
    h->guard = GUARD_SPILLED ^ bytes;
    return h + 1;
}

static void *block_create(tl_ctx *ctx, size_t count, size_t elem_bytes, bool zero,
                          tl_status *status)
{
    size_t bytes;
    if (*status) return NULL;
    if ((*status = block_bytes(ctx, count, elem_bytes, &bytes))) return NULL;
    if (spills(ctx, bytes)) return spill_create(ctx, bytes, bytes, status);
    if ((*status = reserve(ctx, bytes))) return NULL;
    header *h;
    if (zero && ctx->opts.resize == tli_resize_default) {
        h = calloc(1, bytes); /* large blocks: fresh pages of the system, zero and untouched */
    } else {
        h = ctx->opts.resize(ctx->opts.user, NULL, 0, bytes);
        if (h && zero) memset(h, 0, bytes);
    }
    if (!h) {
        give_back(ctx, bytes);
        *status = fail_memory(ctx, bytes);
        return NULL;
    }
    return publish(h, bytes);
}

void *tl_mem_alloc(tl_ctx *ctx, size_t count, size_t elem_bytes, tl_status *status)
{
    return block_create(ctx, count, elem_bytes, false, status);
}

void *tl_mem_zalloc(tl_ctx *ctx, size_t count, size_t elem_bytes, tl_status *status)
{
    return block_create(ctx, count, elem_bytes, true, status);
}

/* From memory into a file or back, or within a file. What grows in a file gets room for more: it
 * may do so by little steps. */
static void *move(tl_ctx *ctx, header *old, size_t bytes, tl_status *status)
{
    if (is_spilled(old) && bytes <= tli_spill_room(old)) {
        old->bytes = bytes;
        old->guard = GUARD_SPILLED ^ bytes;
        return old + 1;
    }
    void *moved = spills(ctx, bytes) && bytes < SIZE_MAX / 2
                      ? spill_create(ctx, bytes, bytes + bytes / 2, status)
                      : block_create(ctx, bytes - sizeof(header), 1, false, status);
    if (!moved) return old + 1;
    size_t kept = (old->bytes < bytes ? old->bytes : bytes) - sizeof(header);
    memcpy(moved, old + 1, kept);
    tl_mem_free(ctx, old + 1);
    return moved;
}

void *tl_mem_resize(tl_ctx *ctx, void *block, size_t count, size_t elem_bytes, tl_status *status)
{
    size_t bytes;
    if (!block) return block_create(ctx, count, elem_bytes, false, status);
    if (*status) return block;
    if ((*status = block_bytes(ctx, count, elem_bytes, &bytes))) return block;
    header *old = header_of(block);
    if (is_spilled(old) || spills(ctx, bytes)) return move(ctx, old, bytes, status);
    size_t old_bytes = old->bytes;
    if (bytes > old_bytes && (*status = reserve(ctx, bytes - old_bytes))) return block;
    header *h = ctx->opts.resize(ctx->opts.user, old, old_bytes, bytes);
    if (!h) {
        if (bytes > old_bytes) give_back(ctx, bytes - old_bytes);
        *status = fail_memory(ctx, bytes);
        return block;
    }
    if (bytes < old_bytes) give_back(ctx, old_bytes - bytes);
    return publish(h, bytes);
}

void tl_mem_free(tl_ctx *ctx, void *block)
{
    if (!block) return;
    header *h = header_of(block);
    size_t bytes = h->bytes;
    if (is_spilled(h)) {
        tli_spill_unmap(ctx, h);
        return;
    }
    h->guard = 0;
    ctx->opts.resize(ctx->opts.user, h, bytes, 0);
    give_back(ctx, bytes);
}

char *tli_strdup(tl_ctx *ctx, const char *text, tl_status *status)
{
    if (!text) return NULL;
    size_t bytes = strlen(text) + 1;
    char *copy = tl_mem_alloc(ctx, bytes, 1, status);
    if (copy) memcpy(copy, text, bytes);
    return copy;
}
