/* What all fuzz targets share: a check that ends the program where a promise is broken, and a
 * context of one thread with a small budget. */
#ifndef TETRALOD_FUZZ_BASE_H
#define TETRALOD_FUZZ_BASE_H

#include "tetralod/base.h"

#include <stdio.h>
#include <stdlib.h>

#define FUZZ_CHECK(condition)                                                                      \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "%s:%d: not true: %s\n", __FILE__, __LINE__, #condition);              \
            abort();                                                                               \
        }                                                                                          \
    } while (0)

static inline tl_ctx *fuzz_ctx_within(size_t budget_bytes)
{
    tl_ctx *ctx;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.budget_bytes = budget_bytes;
    opts.thread_count = 1;
    FUZZ_CHECK(tl_ctx_create(&opts, &ctx) == TL_OK);
    return ctx;
}

#endif
