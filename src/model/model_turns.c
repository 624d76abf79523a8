/* Segments in turns: enough of them to keep all threads busy, where memory is there for as many. */
#include "model/model_turns.h"

/* Segments of a turn for each thread. */
enum { TURN = 12 };

typedef struct turn {
    tli_range_fn fn;
    void *arg;
    size_t first;
} turn;

static tl_status run(void *arg, size_t begin, size_t end, unsigned worker)
{
    const turn *t = arg;
    return t->fn(t->arg, t->first + begin, t->first + end, worker);
}

tl_status tli_turns(tl_ctx *ctx, const char *stage, size_t count, size_t at_once, tli_range_fn fn,
                    void *arg)
{
    tl_status st = TL_OK;
    const size_t threads = tl_ctx_thread_count(ctx);
    const size_t step = at_once < threads ? at_once : TURN * threads;
    turn t = {fn, arg, 0};
    for (; !st && t.first < count; t.first += step) {
        size_t left = count - t.first;
        st = tl_progress(ctx, stage, t.first, count);
        if (!st) st = tli_parallel(ctx, left < step ? left : step, 1, run, &t);
    }
    return st ? st : tl_progress(ctx, stage, count, count);
}
