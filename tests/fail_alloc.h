/* A context whose n-th allocation fails, and a loop over n. */
#ifndef TETRALOD_TESTS_FAIL_ALLOC_H
#define TETRALOD_TESTS_FAIL_ALLOC_H

#include "tetralod/base.h"

#include "check.h"

#include "check_alloc.h"

typedef struct fail_alloc {
    tl_ctx *ctx;
    check_alloc alloc;
} fail_alloc;

static inline void fail_alloc_open(fail_alloc *f, unsigned thread_count)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    memset(f, 0, sizeof *f);
    opts.thread_count = thread_count;
    opts.resize = check_alloc_resize;
    opts.user = &f->alloc;
    CHECK_STATUS(tl_ctx_create(&opts, &f->ctx), TL_OK);
}

static inline void fail_alloc_close(fail_alloc *f)
{
    tl_ctx_destroy(f->ctx);
    CHECK_EQ(f->alloc.live_blocks, 0);
}

/* Calls with the n-th allocation failing for n = 1, 2, 3 ... until the call succeeds; returns that
 * n. call releases what it was given; each failure must be TL_ERR_MEMORY and leak nothing. */
static inline long fail_alloc_each(fail_alloc *f, tl_status (*call)(tl_ctx *ctx, void *arg),
                                   void *arg)
{
    size_t before = tl_ctx_current_bytes(f->ctx);
    for (long n = 1;; n++) {
        f->alloc.fail_at = f->alloc.requests + (unsigned long long)n;
        tl_status st = call(f->ctx, arg);
        bool has_failed = f->alloc.requests >= f->alloc.fail_at;
        f->alloc.fail_at = 0;
        CHECK_EQ(tl_ctx_current_bytes(f->ctx), before);
        if (st == TL_OK) {
            CHECK(!has_failed); /* a success that swallowed the failure would be none */
            return n;
        }
        CHECK_STATUS(st, TL_ERR_MEMORY);
        CHECK(*tl_ctx_message(f->ctx));
    }
}

#endif
