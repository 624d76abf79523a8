/* Contexts of tests: whatever was allocated in one must be gone when it ends. */
#ifndef TETRALOD_TESTS_CHECK_CTX_H
#define TETRALOD_TESTS_CHECK_CTX_H

#include "check.h"

#include "tetralod/base.h"

static inline tl_ctx *check_ctx_create(unsigned threads)
{
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = threads;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

static inline void check_ctx_destroy(tl_ctx *ctx)
{
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

#endif
