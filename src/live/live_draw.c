/* The drawer: the newest content with the newest camera into frames. While something moves a frame
 * has fewer pixels, as the pace says, and is scaled up; at rest it has all of them, and when
 * nothing is left to be made, several rays a pixel. Words are written at full size. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "live/live.h"

/* A last picture of several rays a pixel that takes less, in seconds, is drawn without one of a ray
 * a pixel before it. */
static const double SHORT_S = 0.25;
/* Between two pictures of lines that move, seconds. */
static const double MOTION_S = 1.0 / 30;
/* Frames that the shell holds are waited for so often where there is no memory for another one. */
enum { WAITS_MOST = 10 };
static const double WAIT_S = 0.1;

/* What the thread keeps to itself. */
typedef struct drawer {
    tl_live *live;
    tl_ctx *ctx;
    tl_renderer *renderer;
    tl_renderer_kind kind; /* that was asked for */
    bool has_fallen;       /* back to the processor, until another kind is asked for */
    tl_shown *shown;
    tli_live_content *content; /* that is shown; holds */
    int waits;                 /* for frames of the shell, in a row */
} drawer;

/* A frame on its way. */
typedef struct shot {
    tli_live_content *content; /* hold */
    tli_live_scene *scene;
    tli_live_slot *slot;
    tl_camera camera;
    uint32_t reduction, samples;
    bool moving, is_complete;
    double time_s;
    double asked_s; /* when what it shows was asked for */
} shot;

/* ---- renderers ---- */

static tl_renderer_kind kind_of(const tl_live *live, const tl_scene *scene)
{
    if (live->opts.renderer != TL_RENDERER_AUTO || !scene) return live->opts.renderer;
    const char *text = tl_scene_text(scene, TL_NODE_PICTURE + 1, "renderer");
    if (strcmp(text, "gl") == 0) return TL_RENDERER_GL;
    return strcmp(text, "cpu") == 0 ? TL_RENDERER_CPU : TL_RENDERER_AUTO;
}

static void notice(tl_live *live, const char *text)
{
    tli_live_lock(live);
    tli_live_event(live, TL_LIVE_NOTICE, TL_LIVE_DRAWING, text);
    tli_live_unlock(live);
}

static void close_renderer(drawer *d)
{
    tl_shown_destroy(d->ctx, d->shown);
    tl_renderer_destroy(d->ctx, d->renderer);
    d->shown = NULL;
    d->renderer = NULL;
    tli_live_lock(d->live);
    tli_live_drop_content(d->live, d->content);
    tli_live_unlock(d->live);
    d->content = NULL;
}

static tl_status open_renderer(drawer *d, tl_renderer_kind kind)
{
    tl_status st = tl_renderer_create(d->ctx, kind, &d->renderer);
    if (!st) st = tl_shown_create(d->ctx, d->renderer, &d->shown);
    if (st) close_renderer(d);
    return st;
}

/* Goes on with the processor, and says why. */
static tl_status fall_back(drawer *d)
{
    char text[sizeof((tl_live_event *)0)->text];
    snprintf(text, sizeof text, "the processor draws: %s", tl_ctx_message(d->ctx));
    notice(d->live, text);
    close_renderer(d);
    d->has_fallen = true;
    return open_renderer(d, TL_RENDERER_CPU);
}

static tl_status want_renderer(drawer *d, tl_renderer_kind kind)
{
    if (d->renderer && kind == d->kind) return TL_OK;
    close_renderer(d);
    d->kind = kind;
    d->has_fallen = false;
    tl_status st = open_renderer(d, kind);
    return st && st != TL_ERR_CANCELLED && kind != TL_RENDERER_CPU ? fall_back(d) : st;
}

/* ---- what to draw ---- */

/* False: nothing; *wait_s: until there is something, or infinity. With the lock. */
static bool plan(tl_live *live, double last_s, shot *s, double *wait_s)
{
    tli_live_content *content = tli_live_best(live);
    *wait_s = (double)INFINITY;
    *s = (shot){.content = content, .scene = live->scene, .moving = live->moving, .samples = 1};
    if (!content || !tli_live_camera(live, &s->camera)) return false;
    const bool animated = content->facts->is_moving;
    s->is_complete = !s->moving && tli_live_is_final(live, content);
    /* the first content of a file is there to be seen soon; a finer one follows */
    bool is_first = content->step == TLI_LIVE_FIRST && !s->is_complete && !live->has_failed;
    s->reduction = s->moving || animated || is_first ? live->pace.reduction : 1;
    s->asked_s = live->changed_s;
    uint32_t most = s->is_complete && !animated ? tli_live_samples(live, content) : 1;
    tli_live_fit_rays(live, &s->samples, &s->reduction);
    if (animated) {
        *wait_s = last_s + MOTION_S - tli_clock_s();
        s->time_s = tli_clock_s() - live->start_s;
        return *wait_s <= 0 || !live->is_drawn;
    }
    if (!live->is_drawn && most > 1 && live->rest_s * most * most > SHORT_S) most = 1;
    if (live->is_drawn && live->drawn_samples >= most) return false;
    s->samples = most;
    return true;
}

/* ---- drawing; without the lock ---- */

static tl_status show(drawer *d, tli_live_content *content)
{
    if (d->content == content) return TL_OK;
    tl_status st = tl_content_show(d->ctx, d->shown, content->content);
    tli_live_lock(d->live);
    tli_live_drop_content(d->live, d->content);
    d->content = NULL;
    if (!st) {
        content->holds++;
        d->content = content;
    }
    tli_live_unlock(d->live);
    return st;
}

/* With the renderer that there is. Gives *image, of the size of the frame. */
static tl_status draw_image(drawer *d, const shot *s, tl_image **image)
{
    tl_camera camera = s->camera;
    tl_draw_opts opts = tl_draw_opts_defaults();
    tl_image *small = NULL;
    *image = NULL;
    tl_status st = show(d, s->content);
    if (st) return st;
    opts.time_s = s->time_s;
    opts.samples = s->samples;
    if (s->reduction == 1) return tl_content_draw(d->ctx, d->shown, &camera, &opts, image);
    uint32_t width = camera.size_px[0], height = camera.size_px[1];
    camera.size_px[1] = (height + s->reduction - 1) / s->reduction;
    opts.scale = (double)camera.size_px[1] / height;
    camera.size_px[0] = (uint32_t)fmax(ceil(width * opts.scale), 1);
    st = tl_content_draw(d->ctx, d->shown, &camera, &opts, &small);
    if (!st) st = tl_image_create(d->ctx, width, height, image);
    if (!st) st = tli_live_enlarge(d->ctx, small, *image);
    tl_image_destroy(d->ctx, small);
    if (st) {
        tl_image_destroy(d->ctx, *image);
        *image = NULL;
    }
    return st;
}

static bool is_of_card(const drawer *d)
{
    return strncmp(tl_renderer_name(d->renderer), "gl", 2) == 0;
}

/* The same, with the processor where a card fails. */
static tl_status draw_anyhow(drawer *d, const shot *s, tl_image **image)
{
    tl_status st = want_renderer(d, kind_of(d->live, s->scene->scene));
    if (!st) st = draw_image(d, s, image);
    if (st && st != TL_ERR_CANCELLED && d->renderer && is_of_card(d)) {
        st = fall_back(d);
        if (!st) st = draw_image(d, s, image);
    }
    return st;
}

static tl_status make_room(drawer *d, tli_live_slot *slot, size_t pixels)
{
    tl_status st = TL_OK;
    if (pixels <= slot->pixel_max && pixels >= slot->pixel_max / 4) return TL_OK;
    tl_mem_free(d->ctx, slot->rgba);
    tl_mem_free(d->ctx, slot->depth);
    slot->pixel_max = 0;
    slot->rgba = tl_mem_alloc(d->ctx, pixels, 4, &st);
    slot->depth = tl_mem_alloc(d->ctx, pixels, sizeof *slot->depth, &st);
    if (!st) slot->pixel_max = pixels;
    return st;
}

static tl_status draw(drawer *d, const shot *s)
{
    tl_image *image = NULL;
    tl_value background = {0};
    const size_t pixels = (size_t)s->camera.size_px[0] * s->camera.size_px[1];
    tl_status st = make_room(d, s->slot, pixels);
    if (!st) st = draw_anyhow(d, s, &image);
    if (!st)
        st = tl_content_annotate(d->ctx, s->content->content, s->scene->scene, &s->camera, image);
    if (st == TL_ERR_UNSUPPORTED && image) st = TL_OK; /* a build without words */
    if (!st)
        st = tl_scene_get(d->ctx, s->scene->scene, TL_NODE_PICTURE + 1, "background", &background);
    if (!st)
        st = tli_live_bytes(d->ctx, image, background.count == 3 ? background.reals : NULL,
                            d->live->opts.is_bgra, s->slot->rgba);
    if (!st) memcpy(s->slot->depth, image->depth, pixels * sizeof *image->depth);
    tl_image_destroy(d->ctx, image);
    return st;
}

/* ---- frames ---- */

static void count_moving(tl_live *live, const shot *s, double seconds)
{
    if (s->content->facts->tets > live->pace.tets) /* kept since it was thought to be light */
        s->content->too_slow = seconds > live->pace.goal_s ? s->content->too_slow + 1 : 0;
    tl_live_stats *stats = &live->stats;
    double waited = tli_clock_s() - s->asked_s;
    const uint64_t tets = live->pace.tets;
    stats->moving_frames++;
    stats->longest_frame_s = fmax(stats->longest_frame_s, seconds);
    stats->longest_wait_s = fmax(stats->longest_wait_s, waited);
    tli_pace_add(&live->pace, s->reduction, s->content->facts->tets, seconds);
    if (live->pace.tets != tets) tli_bell_ring(&live->builder.bell);
}

static void count_rest(tl_live *live, const shot *s, double seconds)
{
    s->content->rest_s = tli_pace_unsampled(seconds, s->samples);
    if (s->samples > 1) return;
    live->rest_s = seconds;
    bool stays = tli_live_is_light(live, s->content);
    tli_pace_rest(&live->pace, stays ? 0 : s->content->facts->tets, seconds);
}

/* More than the card may have: contents get smaller. */
static void look_at_card(tl_live *live, const drawer *d, const shot *s)
{
    uint64_t bytes = tl_renderer_card_bytes(d->renderer), tets = s->content->facts->tets;
    live->stats.card_bytes = bytes;
    if (bytes <= live->card_limit || tets < 1000) return;
    bool first = live->card_tets == UINT64_MAX;
    live->card_tets = (uint64_t)(0.8 * (double)tets * (double)live->card_limit / (double)bytes);
    if (first)
        tli_live_event(live, TL_LIVE_NOTICE, TL_LIVE_DRAWING,
                       "the limit of the graphics card's memory makes the picture coarser");
    tli_live_drop_content(live, live->fine);
    live->fine = NULL;
    tli_bell_ring(&live->builder.bell);
}

static void write_note(const tl_live *live, const drawer *d, const shot *s)
{
    char *note = s->slot->note;
    const size_t bytes = sizeof s->slot->note;
    bool is_limited =
        s->is_complete && !s->content->facts->is_complete && s->content->tets_max < UINT64_MAX;
    note[0] = 0;
    if (live->has_failed && !s->moving)
        snprintf(note, bytes, "what is shown is not all: %.150s",
                 live->last_failure[TL_LIVE_CONTENT]);
    else if (is_limited)
        snprintf(note, bytes, "coarser than asked for: memory allows %llu tets",
                 (unsigned long long)s->content->tets_max);
    else if (s->is_complete && !s->content->facts->bounds_kept)
        snprintf(note, bytes, "coarser than asked for: a limit of tets or memory is reached");
    else if (d->has_fallen)
        snprintf(note, bytes, "the processor draws: the graphics card failed");
}

/* The frame becomes the newest. */
static void publish(drawer *d, const shot *s, double seconds)
{
    tl_live *live = d->live;
    tli_live_slot *slot = s->slot;
    s->content->holds++;
    slot->content = s->content;
    snprintf(slot->renderer, sizeof slot->renderer, "%s", tl_renderer_name(d->renderer));
    write_note(live, d, s);
    slot->frame = (tl_frame){.number = ++live->frame_count,
                             .width = s->camera.size_px[0],
                             .height = s->camera.size_px[1],
                             .rgba = slot->rgba,
                             .depth = slot->depth,
                             .camera = s->camera,
                             .scene_version = s->scene->version,
                             .content = s->content->content,
                             .facts = s->content->facts,
                             .error_px = tli_live_off_px(live, s->content, &s->camera),
                             .reduction = s->reduction,
                             .samples = s->samples,
                             .is_complete = s->is_complete,
                             .is_moving = s->moving,
                             .draw_s = seconds,
                             .renderer = slot->renderer,
                             .note = slot->note};
    slot->frame.is_final = s->is_complete && s->samples >= tli_live_samples(live, s->content);
    tli_live_drop_slot(live, live->newest);
    slot->holds++;
    live->newest = slot;
    live->stats.frames++;
    look_at_card(live, d, s);
    if (s->moving)
        count_moving(live, s, seconds);
    else if (s->reduction == 1)
        count_rest(live, s, seconds);
    tli_live_tell(live);
}

static tli_live_slot *free_slot(tl_live *live)
{
    for (size_t i = 0; i < TLI_LIVE_FRAMES; i++)
        if (!live->slots[i].holds) return &live->slots[i];
    return NULL;
}

/* Memory of frames that nobody holds. */
static bool free_slots(drawer *d)
{
    bool any = false;
    for (size_t i = 0; i < TLI_LIVE_FRAMES; i++) {
        tli_live_slot *slot = &d->live->slots[i];
        if (slot->holds || !slot->pixel_max) continue;
        tl_mem_free(d->ctx, slot->rgba);
        tl_mem_free(d->ctx, slot->depth);
        slot->rgba = NULL;
        slot->depth = NULL;
        slot->pixel_max = 0;
        any = true;
    }
    return any;
}

/* After a picture that found no memory: what is tried next needs less. What shows a ray a pixel
 * does not give way to finer pictures. */
static bool make_do(drawer *d, const shot *s)
{
    tl_live *live = d->live;
    if (s->samples == 1 && free_slots(d)) return true;
    if (s->slot->pixel_max)
        return tli_live_shrink_drawn(live, s->content, s->samples, s->reduction);
    /* for a frame: the shell lets go of those that it has one after another */
    tli_live_drop_slot(live, live->newest);
    live->newest = NULL;
    if (d->waits++ >= WAITS_MOST) return false;
    tli_live_sleep(live, &live->drawer.bell, WAIT_S);
    return true;
}

/* With the lock; gives it for the work. */
static void take(drawer *d, shot *s)
{
    tl_live *live = d->live;
    s->content->holds++;
    s->scene->holds++;
    s->slot->holds++;
    live->is_drawn = true; /* what changes meanwhile makes it false again */
    live->drawing = s->samples > 1 ? TLI_LIVE_DRAWS_SAMPLES
                    : s->moving    ? TLI_LIVE_DRAWS_MOVING
                                   : TLI_LIVE_DRAWS_REST;
    const size_t room = tli_live_drawer_room(live);
    tli_live_unlock(live);
    double start = live->drawer.started_s = tli_clock_s();
    tl_ctx_set_budget(d->ctx, room);
    tl_status st = draw(d, s);
    double seconds = tli_clock_s() - start;
    tli_live_lock(live);
    live->drawing = TLI_LIVE_NO_DRAWING;
    if (!live->is_ending) tl_ctx_cancel(d->ctx, false);
    live->drawn_samples = s->samples;
    if (!st) {
        d->waits = 0;
        live->last_failure[TL_LIVE_DRAWING][0] = 0;
        publish(d, s, seconds);
    } else if (st == TL_ERR_CANCELLED || (tli_live_lacks_memory(st) && make_do(d, s))) {
        live->is_drawn = false;
    } else {
        char text[sizeof((tl_live_event *)0)->text];
        tli_live_why(live, d->ctx, NULL, TL_LIVE_DRAWING, st, text, sizeof text);
        d->waits = 0;
        live->drawn_samples = UINT32_MAX; /* not again before something changes */
        tli_live_failed(live, TL_LIVE_DRAWING, st, text);
        tli_live_tell(live);
    }
    tli_live_drop_content(live, s->content);
    tli_live_drop_scene(live, s->scene);
    tli_live_drop_slot(live, s->slot);
}

void tli_live_draw(void *arg)
{
    tli_live_worker *worker = arg;
    tl_live *live = worker->live;
    drawer d = {.live = live, .ctx = worker->ctx, .kind = live->opts.renderer};
    double last_s = 0, wait_s;
    want_renderer(&d, d.kind); /* while the file is opened; a failure comes again with a frame */
    tli_live_lock(live);
    live->start_s = tli_clock_s();
    while (!live->is_ending) {
        shot s;
        bool draws = plan(live, last_s, &s, &wait_s);
        if (draws) s.slot = free_slot(live);
        if (!draws || !s.slot) {
            if (!draws) tli_bell_ring(&live->shell); /* it may have settled */
            tli_live_sleep(live, &worker->bell, wait_s > 0 ? wait_s : INFINITY);
            continue;
        }
        last_s = tli_clock_s();
        take(&d, &s);
    }
    tli_live_unlock(live);
    close_renderer(&d);
}

void tli_live_draw_end(tl_live *live)
{
    for (size_t i = 0; i < TLI_LIVE_FRAMES; i++) {
        tl_mem_free(live->drawer.ctx, live->slots[i].depth);
        tl_mem_free(live->drawer.ctx, live->slots[i].rgba);
    }
}
