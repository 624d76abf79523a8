/* The maker: builds models, beside all else. Its memory is that of the build's options, not that of
 * the view. */
#include <math.h>
#include <string.h>

#include "live/live.h"

/* With the lock; gives it for the work. */
static void make(tl_live *live)
{
    tl_ctx *ctx = live->maker.ctx;
    tl_build_result result = {0};
    char *input = live->make_input, *path = live->make_path;
    const tl_read_opts *read = live->has_make_read ? &live->make_read : NULL;
    const tl_build_opts *opts = live->has_make_opts ? &live->make_opts : NULL;
    live->maker.started_s = tli_clock_s();
    tli_live_unlock(live);
    tl_status st = tl_model_build(ctx, input, read, path, opts, &result);
    tl_build_release(ctx, &result);
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
                              const char *path, const tl_build_opts *opts)
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
        if (read) live->make_read = *read;
        if (opts) live->make_opts = *opts;
        tl_ctx_cancel(live->maker.ctx, false);
        tli_bell_ring(&live->maker.bell);
    }
    tli_live_unlock(live);
    return st;
}
