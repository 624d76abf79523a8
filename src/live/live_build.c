/* The builder: opens files, makes contents, and takes back what nobody uses any more. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "live/live.h"

/* ---- what can go ---- */

void tli_live_clear_old(tl_live *live)
{
    tl_ctx *ctx = live->builder.ctx;
    while (live->old_contents || live->old_sources) {
        tli_live_content *contents = live->old_contents;
        tli_live_source *sources = live->old_sources;
        unsigned gone = 0;
        live->old_contents = NULL;
        live->old_sources = NULL;
        tli_live_unlock(live);
        while (contents) {
            tli_live_content *next = contents->next;
            tl_content_destroy(ctx, contents->content);
            tl_mem_free(ctx, contents);
            gone++;
            contents = next;
        }
        while (sources) {
            tli_live_source *next = sources->next;
            for (int i = 0; i < TLI_LIVE_CUTS; i++) tl_view_destroy(sources->views[i]);
            tl_source_destroy(sources->source);
            tl_mem_free(ctx, sources);
            sources = next;
        }
        tli_live_lock(live);
        live->content_count -= gone;
    }
}

/* ---- files ---- */

/* Of a series the step that the scene, which may be NULL, asks for. */
static tl_status open_source(tl_live *live, const char *path, const tl_scene *scene,
                             tl_source **source)
{
    tl_ctx *ctx = live->builder.ctx;
    const double step = scene ? tl_scene_real(scene, TL_NODE_DATA + 1, "step") : -1;
    if (tl_store_is(ctx, path)) {
        tl_status st = tl_source_open(ctx, path, source);
        if (!st) tl_store_set_throttle(tl_source_store(*source), live->opts.throttle_bytes_s);
        return st;
    }
    tl_status st = tl_source_read(ctx, path, NULL, (int64_t)step, source);
    if (st != TL_ERR_ARG || step < 0) return st;
    tl_ctx_clear(ctx); /* it lacks the step */
    return tl_source_read(ctx, path, NULL, -1, source);
}

static bool has_things(const tl_scene *scene)
{
    size_t count = 0;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    for (size_t i = 0; i < count; i++)
        if (tl_scene_kind(scene, nodes[i]) >= TL_NODE_VOLUME) return true;
    return false;
}

/* What is shown of a file: a scene of the builder's, with things, bounds and frame. text [bytes]
 * says what it lacks of the one that is given, which may be NULL. */
static tl_status first_scene(tl_live *live, const tli_live_source *s, const tl_scene *given,
                             uint32_t width, uint32_t height, tl_scene **scene, char *text,
                             size_t bytes)
{
    tl_ctx *ctx = live->builder.ctx;
    tl_view *view = s->views[TLI_LIVE_CUT_COARSE]; /* makes the first content, too */
    double bounds[6], window[4];
    tl_status st =
        given ? tl_view_adapt(ctx, view, given, scene, text, bytes) : tl_scene_create(ctx, scene);
    if (!st && !has_things(*scene)) st = tl_first_look(ctx, s->source, *scene);
    if (!st) st = tl_view_bounds(ctx, view, *scene, bounds);
    if (!st) st = tl_scene_set_bounds(ctx, *scene, bounds);
    if (!st) st = tl_view_window(ctx, view, *scene, width, height, window);
    if (!st) st = tl_scene_set_frame(ctx, *scene, width, height, window);
    if (!st) tl_scene_forget(ctx, *scene);
    return st;
}

/* Takes over s. With the lock. */
static void go_over(tl_live *live, tli_live_source *s, tli_live_scene *scene)
{
    if (live->source) {
        live->source->next = live->former;
        live->former = live->source;
    }
    live->source = s;
    tli_live_drop_content(live, live->coarse);
    tli_live_drop_content(live, live->fine);
    live->coarse = live->fine = NULL;
    live->fits_tets = live->card_tets = UINT64_MAX;
    live->made_room = live->has_failed = false;
    live->rays_max = (double)INFINITY;
    live->full_s = 0;
    live->answer_count = live->next_answer = 0;
    live->has_question = false;
    tli_live_show_scene(live, scene);
    live->is_drawn = false;
    tli_live_event(live, TL_LIVE_OPENED, TL_LIVE_OPEN, tl_source_get_facts(s->source)->name);
}

/* With the lock; gives it for the work. */
static void open_file(tl_live *live)
{
    tl_ctx *ctx = live->builder.ctx;
    tl_status st = TL_OK;
    char *path = live->open_path;
    tli_live_scene *given = live->opened, *shown = NULL;
    const uint32_t width = live->width, height = live->height;
    tl_scene *scene = NULL;
    live->open_path = NULL;
    live->opened = NULL;
    live->builder.job = TL_LIVE_OPEN;
    tl_ctx_set_budget(ctx, tli_live_builder_room(live));
    tli_live_unlock(live);
    tli_live_source *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (!st) s->holds = 1;
    if (!st) st = open_source(live, path, given ? given->scene : NULL, &s->source);
    for (int i = 0; !st && i < TLI_LIVE_CUTS; i++)
        st = tl_view_create(ctx, s->source, &s->views[i]);
    char text[sizeof((tl_live_event *)0)->text], lacks[sizeof text] = "";
    if (!st)
        st = first_scene(live, s, given ? given->scene : NULL, width, height, &scene, lacks,
                         sizeof lacks);
    tli_live_lock(live);
    tli_live_why(live, ctx, s ? s->source : NULL, TL_LIVE_OPEN, st, text, sizeof text);
    if (!st) {
        st = tli_live_copy_scene(live, scene, &shown);
        if (st) snprintf(text, sizeof text, "%s", tl_ctx_message(live->ctx));
    }
    if (!st) {
        go_over(live, s, shown);
        if (*lacks) tli_live_event(live, TL_LIVE_NOTICE, TL_LIVE_OPEN, lacks);
    } else {
        tli_live_failed(live, TL_LIVE_OPEN, st, text);
        if (s) tli_live_drop_source(live, s);
    }
    tl_scene_destroy(ctx, scene);
    tli_live_drop_scene(live, given);
    tl_mem_free(live->ctx, path);
}

/* ---- contents ---- */

/* A content that was to be seen until all that is asked for is there, and is coarser than what is
 * shown. */
static bool comes_too_late(tl_live *live, tli_live_content *made)
{
    tli_live_content *best = tli_live_best(live);
    return made->step == TLI_LIVE_FINE && !tli_live_is_final(live, made) && best &&
           best == live->fine && best->stamp == made->stamp &&
           tli_live_is_coarser(live, made, best);
}

/* With the lock. */
static void put(tl_live *live, const tli_live_task *task, tli_live_content *made, double seconds)
{
    if (comes_too_late(live, made)) {
        live->fine->is_stepped = true;
        tli_live_drop_content(live, made);
        return;
    }
    tli_live_content **place = task->cut == TLI_LIVE_CUT_FINE ? &live->fine : &live->coarse;
    tli_live_content **other = place == &live->coarse ? &live->fine : &live->coarse;
    tli_live_drop_content(live, *place);
    *place = made;
    if (*other && (*other)->stamp != made->stamp && made->stamp == live->scene->stamp) {
        tli_live_drop_content(live, *other);
        *other = NULL;
    }
    if (task->step == TLI_LIVE_COARSE) {
        live->coarse_s = seconds;
        live->coarse_end_s = tli_clock_s();
    }
    if (task->step == TLI_LIVE_FINE && tli_live_is_final(live, made)) {
        live->full_s = seconds;
        live->made_room = false;
    }
    live->has_failed = false;
    live->last_failure[TL_LIVE_CONTENT][0] = 0;
    live->is_drawn = false;
    tli_bell_ring(&live->drawer.bell);
}

static tl_status build(tl_live *live, const tli_live_source *source, const tl_scene *scene,
                       const tli_live_task *task, tli_live_content **made)
{
    tl_ctx *ctx = live->builder.ctx;
    tl_status st = TL_OK;
    tl_view_limits limits = tl_view_limits_defaults();
    limits.tets_max = task->tets_max;
    limits.any_cut = task->step == TLI_LIVE_QUICK;
    limits.error_px_least = task->error_px;
    *made = tl_mem_zalloc(ctx, 1, sizeof **made, &st);
    if (!st)
        st = tl_view_build(ctx, source->views[task->cut], scene, &task->camera, &limits,
                           &(*made)->content);
    if (st) {
        tl_mem_free(ctx, *made);
        *made = NULL;
        return st;
    }
    (*made)->facts = tl_content_get_facts((*made)->content);
    return TL_OK;
}

/* With the lock; gives it for the work. */
static void make_content(tl_live *live, const tli_live_task *task)
{
    tl_ctx *ctx = live->builder.ctx;
    tli_live_scene *scene = live->scene;
    tli_live_source *source = live->source;
    tli_live_content *made = NULL;
    scene->holds++;
    source->holds++;
    live->running_stamp = scene->stamp;
    live->running_step = tli_live_data_step(scene);
    live->running_camera = task->camera;
    live->builder.job = TL_LIVE_CONTENT;
    tl_ctx_set_budget(ctx, tli_live_builder_room(live));
    const bool is_tight = live->fits_tets < UINT64_MAX;
    tli_live_unlock(live);
    if (is_tight) tl_view_trim(source->views[!task->cut]);
    double start = tli_clock_s();
    tl_status st = build(live, source, scene->scene, task, &made);
    double seconds = tli_clock_s() - start;
    tli_live_lock(live);
    if (!st) {
        live->content_count++;
        made->stamp = scene->stamp;
        made->camera = task->camera;
        made->step = task->step;
        made->cut = task->cut;
        made->tets_max = task->tets_max;
        made->asked_px = -1;
        made->holds = 1;
        if (source == live->source)
            put(live, task, made, seconds);
        else
            tli_live_drop_content(live, made);
    } else if (tli_live_lacks_memory(st) ? !tli_live_shrink(live, task) : st != TL_ERR_CANCELLED) {
        char text[sizeof((tl_live_event *)0)->text];
        tli_live_why(live, ctx, source->source, TL_LIVE_CONTENT, st, text, sizeof text);
        live->made_room = false;
        live->has_failed = true;
        live->failed_stamp = scene->stamp;
        live->failed_camera = task->camera;
        live->is_drawn = false; /* the frame's note says it */
        tli_bell_ring(&live->drawer.bell);
        tli_live_failed(live, TL_LIVE_CONTENT, st, text);
    }
    tli_live_drop_source(live, source);
    tli_live_drop_scene(live, scene);
}

/* ---- the thread ---- */

void tli_live_build(void *arg)
{
    tli_live_worker *worker = arg;
    tl_live *live = worker->live;
    tli_live_lock(live);
    while (!live->is_ending) {
        double wait_s;
        tli_live_clear_old(live);
        if (live->is_ending) break;
        tli_live_task task = tli_live_next(live, tli_clock_s(), &wait_s);
        if (task.step == TLI_LIVE_NOTHING) {
            tli_bell_ring(&live->drawer.bell); /* it may be final now */
            if (live->old_contents || live->old_sources) continue;
            tli_live_sleep(live, &worker->bell, wait_s);
            continue;
        }
        live->running = task.step;
        worker->started_s = tli_clock_s();
        if (task.step == TLI_LIVE_FILE)
            open_file(live);
        else
            make_content(live, &task);
        live->running = TLI_LIVE_NOTHING;
        if (!live->is_ending) tl_ctx_cancel(worker->ctx, false);
    }
    tli_live_unlock(live);
}

void tli_live_build_end(tl_live *live)
{
    tli_live_drop_content(live, live->coarse);
    tli_live_drop_content(live, live->fine);
    tli_live_drop_former(live);
    tli_live_drop_source(live, live->source);
    live->coarse = live->fine = NULL;
    live->source = NULL;
    tli_live_clear_old(live);
}
