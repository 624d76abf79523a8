/* A context whose n-th allocation fails, and a loop over n. */
#ifndef TETRALOD_TESTS_FAIL_ALLOC_H
#define TETRALOD_TESTS_FAIL_ALLOC_H

#include "tetralod/base.h"

#include "check.h"

#include <stdatomic.h>

typedef struct fail_alloc {
    tl_ctx *ctx;
    atomic_long left; /* allocations until the one that fails; 0 or less: none fails */
} fail_alloc;

static inline void *fail_alloc_resize(void *user, void *block, size_t old_bytes, size_t new_bytes)
{
    fail_alloc *f = user;
    (void)old_bytes;
    if (new_bytes == 0) {
        free(block);
        return NULL;
    }
    if (atomic_fetch_sub(&f->left, 1) == 1) return NULL;
    return realloc(block, new_bytes);
}

static inline void fail_alloc_open(fail_alloc *f, unsigned thread_count)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = thread_count;
    opts.resize = fail_alloc_resize;
    opts.user = f;
    atomic_init(&f->left, 0);
    CHECK_STATUS(tl_ctx_create(&opts, &f->ctx), TL_OK);
}

static inline void fail_alloc_close(fail_alloc *f)
{
    tl_ctx_destroy(f->ctx);
}

/* Calls with the n-th allocation failing for n = 1, 2, 3 ... until the call succeeds; returns that
 * n. call releases what it was given; each failure must be TL_ERR_MEMORY and leak nothing. */
static inline long fail_alloc_each(fail_alloc *f, tl_status (*call)(tl_ctx *ctx, void *arg),
                                   void *arg)
{
    size_t before = tl_ctx_current_bytes(f->ctx);
    for (long n = 1;; n++) {
        atomic_store(&f->left, n);
        tl_status st = call(f->ctx, arg);
        long left = atomic_exchange(&f->left, 0);
        CHECK_EQ(tl_ctx_current_bytes(f->ctx), before);
        if (st == TL_OK) {
            CHECK(left > 0); /* a success that swallowed the failure would be none */
            return n;
        }
        CHECK_STATUS(st, TL_ERR_MEMORY);
        CHECK(*tl_ctx_message(f->ctx));
    }
}

#endif
