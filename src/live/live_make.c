/* The maker: builds models, beside all else. Its memory is that of the build's options, not that of
 * the view. */
#include <math.h>
#include <string.h>

#include "live/live.h"

/* Of all steps, where there are several of them. */
static tl_status build(tl_ctx *ctx, const char *input, const tl_read_opts *read, bool all_steps,
                       const char *path, const tl_build_opts *opts)
{
    tl_build_result result = {0};
    tl_series series = {0};
    tl_status st = all_steps ? tl_series_find(ctx, input, read, &series) : TL_OK;
    if (!st && series.count > 1 && series.mesh == TL_STEPS_MOVING)
        st =
            tl_fail(ctx, TL_ERR_UNSUPPORTED,
                    "'%s': its mesh moves from step to step, and a model has one mesh: build it of "
                    "one step",
                    input);
    else if (!st && series.count > 1)
        st = tl_model_build_series(ctx, series.steps, series.count, read, path, opts, &result);
    else if (!st)
        st = tl_model_build(ctx, input, read, path, opts, &result);
    tl_build_release(ctx, &result);
    tl_series_release(ctx, &series);
    return st;
}

/* With the lock; gives it for the work. */
static void make(tl_live *live)
{
    tl_ctx *ctx = live->maker.ctx;
    char *input = live->make_input, *path = live->make_path;
    const tl_read_opts *read = live->has_make_read ? &live->make_read : NULL;
    const tl_build_opts *opts = live->has_make_opts ? &live->make_opts : NULL;
    const bool all_steps = live->make_all;
    live->maker.started_s = tli_clock_s();
    tli_live_unlock(live);
    tl_status st = build(ctx, input, read, all_steps, path, opts);
    tli_live_lock(live);
    if (!live->is_ending) tl_ctx_cancel(ctx, false);
    live->make_input = live->make_path = NULL;
    if (st)
        tli_live_failed(live, TL_LIVE_MODEL, st, tl_ctx_message(ctx));
    else
        tli_live_event(live, TL_LIVE_DONE, TL_LIVE_MODEL, path);
    tl_mem_free(live->ctx, input);
    tl_mem_free(live->ctx, path);
}

void tli_live_make(void *arg)
{
    tli_live_worker *worker = arg;
    tl_live *live = worker->live;
    tli_live_lock(live);
    while (!live->is_ending) {
        if (live->make_input)
            make(live);
        else
            tli_live_sleep(live, &worker->bell, INFINITY);
    }
    tli_live_unlock(live);
}

tl_status tl_live_build_model(tl_live *live, const char *input, const tl_read_opts *read,
                              bool all_steps, const char *path, const tl_build_opts *opts)
{
    tl_status st = TL_OK;
    tli_live_lock(live);
    if (live->make_input) {
        tli_live_unlock(live);
        return TL_ERR_ARG;
    }
    char *from = tli_strdup(live->ctx, input, &st), *to = tli_strdup(live->ctx, path, &st);
    if (st) {
        tl_mem_free(live->ctx, from);
        tl_mem_free(live->ctx, to);
    } else {
        live->make_input = from;
        live->make_path = to;
        live->has_make_read = read != NULL;
        live->has_make_opts = opts != NULL;
        live->make_all = all_steps;
        if (read) live->make_read = *read;
        if (opts) live->make_opts = *opts;
        tl_ctx_cancel(live->maker.ctx, false);
        tli_bell_ring(&live->maker.bell);
    }
    tli_live_unlock(live);
    return st;
}
