/* Series: which step is read, and the list of steps. */
#include "formats/formats_reader.h"

#include <math.h>

tl_status tli_steps_alloc(tl_ctx *ctx, size_t count, tl_steps *steps)
{
    tl_status st = TL_OK;
    steps->times = tl_mem_alloc(ctx, count, sizeof *steps->times, &st);
    if (st) return st;
    steps->count = count;
    for (size_t i = 0; i < count; i++) steps->times[i] = (double)NAN;
    return TL_OK;
}

void tl_steps_release(tl_ctx *ctx, tl_steps *steps)
{
    tl_mem_free(ctx, steps->times);
    *steps = (tl_steps){0};
}

/* Of two times equally near the earlier step; a time that is NaN is near nothing. */
static size_t nearest_step(const double *times, size_t count, double time)
{
    size_t best = 0;
    double best_distance = (double)INFINITY;
    for (size_t i = 0; i < count; i++) {
        double distance = fabs(times[i] - time);
        if (!(distance < best_distance)) continue;
        best = i;
        best_distance = distance;
    }
    return best;
}

tl_status tli_steps_pick(tl_ctx *ctx, const tl_read_opts *opts, const double *times, size_t count,
                         size_t *step)
{
    *step = 0;
    if (opts->has_time && times)
        *step = nearest_step(times, count, opts->time);
    else if (opts->has_time)
        *step = 0;
    else if (opts->step == TL_STEP_LAST)
        *step = count - 1;
    else if (opts->step >= count)
        return tl_fail(ctx, TL_ERR_ARG, "step %llu: there %s %zu, from 0 on",
                       (unsigned long long)opts->step, count == 1 ? "is" : "are", count);
    else
        *step = (size_t)opts->step;
    if (count > 1 && times && isfinite(times[*step]))
        tl_log(ctx, TL_LOG_INFO, "step %zu of %zu (0 to %zu), time %.10g", *step, count, count - 1,
               times[*step]);
    else if (count > 1)
        tl_log(ctx, TL_LOG_INFO, "step %zu of %zu (0 to %zu)", *step, count, count - 1);
    return TL_OK;
}
