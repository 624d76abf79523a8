/* The shell's side: it leaves requests and takes frames, under a lock that is held for copies only.
 */
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "live/live.h"

enum { WIDTH = 1280, HEIGHT = 800 };

tl_live_opts tl_live_opts_defaults(void)
{
    return (tl_live_opts){.struct_bytes = sizeof(tl_live_opts), .renderer = TL_RENDERER_AUTO};
}

/* ---- creation ---- */

static uint64_t half_of_memory(void)
{
    long pages = sysconf(_SC_PHYS_PAGES), bytes = sysconf(_SC_PAGESIZE);
    if (pages <= 0 || bytes <= 0) return UINT64_C(1) << 30;
    return (uint64_t)pages * (uint64_t)bytes / 2;
}

static tl_status start_worker(tl_live *live, tli_live_worker *worker, unsigned threads,
                              tl_live_job job, tli_thread_fn fn)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = threads;
    opts.progress = tli_live_progress;
    opts.user = worker;
    worker->live = live;
    worker->job = job;
    tl_status st = tl_ctx_create(&opts, &worker->ctx);
    if (!st) st = tli_thread_start(live->ctx, fn, worker, &worker->thread);
    return st;
}

static tli_live_worker *worker_of(tl_live *live, int index)
{
    tli_live_worker *workers[] = {&live->builder, &live->drawer, &live->clerk, &live->maker};
    return workers[index];
}
enum { WORKERS = 4 };

static tl_status make_bells(tl_live *live, int *made)
{
    tl_status st = tli_bell_create(live->ctx, &live->shell);
    for (*made = 0; !st && *made < WORKERS; (*made)++)
        st = tli_bell_create(live->ctx, &worker_of(live, *made)->bell);
    if (st) (*made)--;
    return st;
}

tl_status tl_live_create(const tl_live_opts *opts, tl_live **live)
{
    tl_ctx_opts ctx_opts = tl_ctx_opts_defaults();
    tl_ctx *ctx = NULL;
    tl_status st = TL_OK;
    *live = NULL;
    ctx_opts.thread_count = 1;
    st = tl_ctx_create(&ctx_opts, &ctx);
    if (st) return st;
    tl_live *l = tl_mem_zalloc(ctx, 1, sizeof *l, &st);
    if (st) {
        tl_ctx_destroy(ctx);
        return st;
    }
    l->opts = tl_live_opts_defaults();
    l->ctx = ctx;
    st = tli_opts_take(ctx, "tl_live_opts", opts, &l->opts, sizeof l->opts);
    if (!l->opts.ram_bytes) l->opts.ram_bytes = half_of_memory();
    l->ram_limit = l->opts.ram_bytes;
    l->card_limit = l->fits_tets = l->card_tets = UINT64_MAX;
    l->rays_max = (double)INFINITY;
    l->width = WIDTH;
    l->height = HEIGHT;
    l->pace = tli_pace_start();
    const unsigned threads = l->opts.thread_count;
    if (!st) st = tli_lock_create(ctx, &l->lock);
    if (st) {
        tl_mem_free(ctx, l);
        tl_ctx_destroy(ctx);
        return st;
    }
    st = make_bells(l, &l->bell_count);
    if (!st) st = start_worker(l, &l->clerk, 1, TL_LIVE_PROBE, tli_live_answer_all);
    if (!st) st = start_worker(l, &l->maker, threads, TL_LIVE_MODEL, tli_live_make);
    if (!st) st = start_worker(l, &l->drawer, threads, TL_LIVE_DRAWING, tli_live_draw);
    if (!st) st = start_worker(l, &l->builder, threads, TL_LIVE_OPEN, tli_live_build);
    if (st)
        tl_live_destroy(l);
    else
        *live = l;
    return st;
}

static void end_threads(tl_live *live)
{
    tli_live_lock(live);
    live->is_ending = true;
    for (int i = 0; i < WORKERS; i++) {
        tli_live_worker *worker = worker_of(live, i);
        if (worker->ctx) tl_ctx_cancel(worker->ctx, true);
        if (i < live->bell_count) tli_bell_ring(&worker->bell);
    }
    tli_live_unlock(live);
    for (int i = 0; i < WORKERS; i++) tli_thread_join(&worker_of(live, i)->thread);
}

void tl_live_destroy(tl_live *live)
{
    if (!live) return;
    tl_ctx *ctx = live->ctx;
    end_threads(live);
    tli_live_lock(live); /* nobody is left; what follows is called with it */
    for (size_t i = 0; i < TLI_LIVE_FRAMES; i++) TL_ASSERT(!live->slots[i].given);
    tli_live_drop_slot(live, live->newest);
    tli_live_drop_slot(live, live->last);
    tli_live_answer_end(live);
    tli_live_drop_scene(live, live->opened);
    tli_live_drop_scene(live, live->scene);
    if (live->builder.ctx) tli_live_build_end(live);
    if (live->drawer.ctx) tli_live_draw_end(live);
    tli_live_unlock(live);
    tl_mem_free(ctx, live->open_path);
    tl_mem_free(ctx, live->make_input);
    tl_mem_free(ctx, live->make_path);
    for (int i = 0; i < WORKERS; i++) {
        tl_ctx_destroy(worker_of(live, i)->ctx);
        if (i < live->bell_count) tli_bell_destroy(&worker_of(live, i)->bell);
    }
    if (live->bell_count >= 0) tli_bell_destroy(&live->shell);
    tli_lock_destroy(&live->lock);
    tl_mem_free(ctx, live);
    tl_ctx_destroy(ctx);
}

/* ---- what is shown ---- */

/* What was to be opened and has not begun. */
static void forget_open(tl_live *live)
{
    tl_mem_free(live->ctx, live->open_path);
    tli_live_drop_scene(live, live->opened);
    live->open_path = NULL;
    live->opened = NULL;
}

tl_status tl_live_open(tl_live *live, const char *path, const tl_scene *scene)
{
    tl_status st = TL_OK;
    tli_live_scene *shown = NULL;
    tli_live_lock(live);
    char *name = tli_strdup(live->ctx, path, &st);
    if (!st && scene) st = tli_live_copy_scene(live, scene, &shown);
    if (st) {
        tl_mem_free(live->ctx, name);
    } else {
        forget_open(live);
        live->open_path = name;
        live->opened = shown;
        tli_live_changed(live);
    }
    tli_live_unlock(live);
    return st;
}

const tl_source *tl_live_source(tl_live *live)
{
    tli_live_lock(live);
    const tl_source *source = live->source ? live->source->source : NULL;
    tli_live_unlock(live);
    return source;
}

tl_status tl_live_get_scene(tl_live *live, tl_ctx *ctx, tl_scene **scene)
{
    *scene = NULL;
    tli_live_lock(live);
    tli_live_scene *shown = live->scene;
    if (shown) shown->holds++;
    tli_live_unlock(live);
    if (!shown) return tl_fail(ctx, TL_ERR_ARG, "nothing is shown yet");
    tl_status st = tl_scene_copy(ctx, shown->scene, scene);
    tli_live_lock(live);
    tli_live_drop_scene(live, shown);
    tli_live_unlock(live);
    return st;
}

tl_status tl_live_set_scene(tl_live *live, const tl_scene *scene)
{
    tli_live_scene *copy = NULL;
    tl_status st = TL_OK;
    tli_live_lock(live);
    if (!tli_live_has_gone_over(live)) st = tli_live_copy_scene(live, scene, &copy);
    if (copy) {
        tli_live_show_scene(live, copy);
        tli_live_changed(live);
    }
    tli_live_unlock(live);
    return st;
}

static uint32_t side_of(uint32_t side)
{
    return side < 1 ? 1 : side > TLI_LIVE_SIDE_MAX ? TLI_LIVE_SIDE_MAX : side;
}

void tl_live_set_size(tl_live *live, uint32_t width, uint32_t height)
{
    tli_live_lock(live);
    if (live->width != side_of(width) || live->height != side_of(height)) {
        live->width = side_of(width);
        live->height = side_of(height);
        live->rays_max = (double)INFINITY;
        tli_live_changed(live);
    }
    tli_live_unlock(live);
}

void tl_live_set_moving(tl_live *live, bool moving)
{
    tli_live_lock(live);
    if (live->moving != moving) {
        bool is_drawn = live->is_drawn;
        live->moving = moving;
        tli_live_changed(live);
        live->is_drawn = moving && is_drawn; /* what is there stays until something changes */
    }
    tli_live_unlock(live);
}

/* ---- frames ---- */

const tl_frame *tl_live_frame(tl_live *live)
{
    unsigned given = 0;
    tli_live_lock(live);
    tli_live_slot *slot = live->newest;
    for (size_t i = 0; i < TLI_LIVE_FRAMES; i++) given += live->slots[i].given;
    if (slot && given < TLI_LIVE_GIVEN_MAX) {
        live->newest = NULL; /* its hold is the shell's now */
        slot->given = 1;
        tli_live_drop_slot(live, live->last);
        slot->holds++;
        live->last = slot;
    } else {
        slot = NULL;
    }
    tli_live_unlock(live);
    return slot ? &slot->frame : NULL;
}

void tl_live_release(tl_live *live, const tl_frame *frame)
{
    if (!frame) return;
    tli_live_slot *slot = (tli_live_slot *)(uintptr_t)frame; /* its first field */
    tli_live_lock(live);
    TL_ASSERT(slot->given);
    slot->given = 0;
    tli_live_drop_slot(live, slot);
    tli_live_unlock(live);
}

static bool is_settled(const tl_live *live)
{
    const tli_live_content *best = tli_live_best(live);
    if (live->drawing || tli_live_builds(live)) return false;
    if (!best || !live->scene) return true;
    if (!live->is_drawn || best->facts->is_moving) return false;
    if (live->moving || !tli_live_is_final(live, best)) return true;
    return live->drawn_samples >= tli_live_samples(live, best);
}

bool tl_live_settled(tl_live *live)
{
    tli_live_lock(live);
    bool settled = is_settled(live);
    tli_live_unlock(live);
    return settled;
}

bool tl_live_wait(tl_live *live, uint64_t number, double seconds)
{
    const double end = tli_clock_s() + seconds;
    bool is_there = false;
    tli_live_lock(live);
    for (;;) {
        bool tells = live->event_count > 0;
        for (int job = 0; job < TL_LIVE_JOB_COUNT; job++) tells |= live->has_progress[job];
        is_there =
            tells || (live->newest && live->newest->frame.number > number) || is_settled(live);
        double left = end - tli_clock_s();
        if (is_there || left <= 0) break;
        tli_bell_wait_for(&live->shell, &live->lock, left);
    }
    tli_live_unlock(live);
    return is_there;
}

void tl_live_cancel(tl_live *live, tl_live_job job)
{
    tli_live_lock(live);
    if (job == TL_LIVE_MODEL && live->make_input) tl_ctx_cancel(live->maker.ctx, true);
    if (job == TL_LIVE_OPEN && live->running == TLI_LIVE_FILE)
        tl_ctx_cancel(live->builder.ctx, true);
    if (job == TL_LIVE_OPEN && live->open_path) {
        forget_open(live);
        tli_live_failed(live, TL_LIVE_OPEN, TL_ERR_CANCELLED, "cancelled before it was opened");
    }
    tli_live_unlock(live);
}

/* ---- figures ---- */

tl_live_stats tl_live_get_stats(tl_live *live)
{
    tli_live_lock(live);
    tl_live_stats s = live->stats;
    s.frame_s = live->pace.frame_s;
    s.reduction = live->pace.reduction;
    s.moving_tets = live->pace.tets;
    s.bytes_read = live->source ? tl_source_bytes_read(live->source->source) : 0;
    s.ram_bytes = tl_ctx_current_bytes(live->ctx);
    s.ram_peak_bytes = tl_ctx_peak_bytes(live->ctx);
    for (int i = 0; i < WORKERS; i++) {
        s.ram_bytes += tl_ctx_current_bytes(worker_of(live, i)->ctx);
        s.ram_peak_bytes += tl_ctx_peak_bytes(worker_of(live, i)->ctx);
    }
    s.ram_limit_bytes = live->ram_limit;
    tli_live_unlock(live);
    return s;
}

void tl_live_reset_stats(tl_live *live)
{
    tli_live_lock(live);
    uint64_t card = live->stats.card_bytes;
    live->stats = (tl_live_stats){.card_bytes = card};
    tl_ctx_reset_peak(live->ctx);
    for (int i = 0; i < WORKERS; i++) tl_ctx_reset_peak(worker_of(live, i)->ctx);
    tli_live_unlock(live);
}
