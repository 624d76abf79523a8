/* An allocator that fails once, at the n-th request, and counts what is out. Use:
 *
 *     check_alloc alloc = {.fail_at = n};
 *     tl_ctx_opts opts = tl_ctx_opts_defaults();
 *     opts.resize = check_alloc_resize;
 *     opts.user = &alloc;
 *
 * and raise n from 1 until the call under test succeeds; alloc.live must be 0 after each
 * tl_ctx_destroy. Include after check.h. */
#ifndef TETRALOD_TESTS_CHECK_ALLOC_H
#define TETRALOD_TESTS_CHECK_ALLOC_H

#include <stdatomic.h>

typedef struct check_alloc {
    unsigned long long fail_at;      /* the request that fails, from 1; 0: none */
    atomic_ullong requests;          /* that allocate or grow */
    atomic_llong live_blocks, bytes; /* out now */
} check_alloc;

static inline void *check_alloc_resize(void *user, void *block, size_t old_bytes, size_t new_bytes)
{
    check_alloc *alloc = user;
    if (!new_bytes) {
        alloc->live_blocks -= block != NULL;
        alloc->bytes -= (long long)old_bytes;
        free(block);
        return NULL;
    }
    if (new_bytes > old_bytes && ++alloc->requests == alloc->fail_at) return NULL;
    void *moved = realloc(block, new_bytes);
    if (!moved) return NULL;
    alloc->live_blocks += !block;
    alloc->bytes += (long long)new_bytes - (long long)old_bytes;
    return moved;
}

#endif
