/* The builder: opens files, makes contents, and takes back what nobody uses any more. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "live/live.h"

/* Memory of a tet in a content and while it is made, bytes: a first guess of what fits where
 * something did not. */
enum { TET_BYTES = 600 };
/* Fewer tets than this are no content. */
enum { TETS_LEAST = 1000 };
/* Part of the memory that is kept for the frames of the drawer, at least. */
static const double DRAWER_SHARE = 0.2;

/* ---- memory ---- */

/* What the builder may take: what the others do not, at their most. */
static size_t budget(const tl_live *live)
{
    const uint64_t limit = live->ram_limit;
    uint64_t others = tl_ctx_current_bytes(live->ctx) + tl_ctx_peak_bytes(live->clerk.ctx);
    uint64_t drawer = tl_ctx_peak_bytes(live->drawer.ctx);
    uint64_t kept = (uint64_t)(DRAWER_SHARE * (double)limit);
    others += drawer > kept ? drawer : kept;
    uint64_t least = limit / 8; /* the others may be above the limit; something is to be seen */
    uint64_t left = limit > others ? limit - others : 0;
    left = left > least ? left : least;
    return left < SIZE_MAX ? (size_t)left : SIZE_MAX;
}

/* After a failure for lack of memory: what is tried next is smaller. False: there is no less. */
static bool shrink(tl_live *live, const tli_live_task *task)
{
    char text[TLI_LIVE_NOTE_BYTES];
    if (task->step == TLI_LIVE_FINE && !live->made_room && live->fine && live->coarse &&
        live->coarse->stamp == live->scene->stamp) {
        tli_live_drop_content(live, live->fine); /* makes room for the one to come */
        live->fine = NULL;
        live->made_room = true;
        live->is_drawn = false;
        tli_bell_ring(&live->drawer.bell);
        return true;
    }
    if (!tl_source_get_facts(live->source->source)->is_model)
        return tl_source_trim(live->source->source);
    bool first = live->fits_tets == UINT64_MAX;
    uint64_t tets = first ? (uint64_t)budget(live) / TET_BYTES : live->fits_tets / 2;
    if (task->tets_max < UINT64_MAX && tets > task->tets_max / 2) tets = task->tets_max / 2;
    if (tets < TETS_LEAST) return false;
    live->fits_tets = tets;
    snprintf(text, sizeof text,
             "%.0f MiB of memory are allowed: the picture is coarser than asked for",
             (double)live->ram_limit / (1 << 20));
    if (first) tli_live_event(live, TL_LIVE_NOTICE, TL_LIVE_CONTENT, text);
    return true;
}

/* Why the builder failed. With the lock. */
static void say_why(const tl_live *live, tl_status status, char *text, size_t bytes)
{
    const char *message = tl_ctx_message(live->builder.ctx);
    if (status == TL_ERR_BUDGET)
        tli_print(text, bytes, "the limit of %.3g MiB of memory is too low: %s",
                  (double)live->ram_limit / (1 << 20), message);
    else
        snprintf(text, bytes, "%s", message);
}

/* ---- what can go ---- */

/* Destroys, without the lock, what nobody holds. */
static void clear_old(tl_live *live)
{
    tl_ctx *ctx = live->builder.ctx;
    while (live->old_contents || live->old_sources) {
        tli_live_content *contents = live->old_contents;
        tli_live_source *sources = live->old_sources;
        live->old_contents = NULL;
        live->old_sources = NULL;
        tli_live_unlock(live);
        while (contents) {
            tli_live_content *next = contents->next;
            tl_content_destroy(ctx, contents->content);
            tl_mem_free(ctx, contents);
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
    tl_ctx_set_budget(ctx, budget(live));
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
    say_why(live, st, text, sizeof text);
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
    tl_ctx_set_budget(ctx, budget(live));
    tli_live_unlock(live);
    double start = tli_clock_s();
    tl_status st = build(live, source, scene->scene, task, &made);
    double seconds = tli_clock_s() - start;
    tli_live_lock(live);
    if (!st) {
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
    } else if (st == TL_ERR_MEMORY || st == TL_ERR_BUDGET ? !shrink(live, task)
                                                          : st != TL_ERR_CANCELLED) {
        char text[sizeof((tl_live_event *)0)->text];
        live->has_failed = true;
        live->failed_stamp = scene->stamp;
        live->failed_camera = task->camera;
        live->is_drawn = false; /* the frame's note says it */
        tli_bell_ring(&live->drawer.bell);
        say_why(live, st, text, sizeof text);
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
        clear_old(live);
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
    clear_old(live);
}
