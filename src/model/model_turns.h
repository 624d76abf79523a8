/* Stage model, internal: work on many segments, some at a time. */
#ifndef TETRALOD_SRC_MODEL_TURNS_H
#define TETRALOD_SRC_MODEL_TURNS_H

#include "base/base.h"

/* Calls fn for each of [0, count) on the pool, one at a call, in turns between which progress is
 * told; at most at_once (>= 1) run at the same time. */
tl_status tli_turns(tl_ctx *ctx, const char *stage, size_t count, size_t at_once, tli_range_fn fn,
                    void *arg);

#endif
