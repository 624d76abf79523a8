/* Long parallel runs that report their progress and can be ended: the pool's threads can't do
 * either, so the run goes in steps and the caller's thread reports in between. */
#include "measure/measure.h"

enum { RUN_STEPS = 20 }; /* reports in one run */

typedef struct shifted_run {
    tli_range_fn fn;
    void *arg;
    size_t offset;
} shifted_run;

static tl_status run_shifted(void *arg, size_t begin, size_t end, unsigned worker)
{
    const shifted_run *run = arg;
    return run->fn(run->arg, begin + run->offset, end + run->offset, worker);
}

tl_status tli_measure_run(tl_ctx *ctx, const char *stage, size_t item_count, size_t grain,
                          tli_range_fn fn, void *arg)
{
    size_t piece_count = item_count / grain + 1;
    size_t step = grain * (piece_count / RUN_STEPS + 1);
    shifted_run run = {fn, arg, 0};
    tl_status st = TL_OK;
    while (!st && run.offset < item_count) {
        size_t count = item_count - run.offset < step ? item_count - run.offset : step;
        st = tl_progress(ctx, stage, run.offset, item_count);
        if (!st) st = tli_parallel(ctx, count, grain, run_shifted, &run);
        run.offset += count;
    }
    return st ? st : tl_progress(ctx, stage, item_count, item_count);
}
