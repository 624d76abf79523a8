/* What to make next, and what is not worth being finished. The first content of a file has few
 * tets. A changed scene is made on the mesh that is there, at once; then, at rest, contents become
 * finer until they are all that was asked for, and while something moves one of few tets follows
 * the camera. */
#include <math.h>

#include "live/live.h"

/* Tets of the first content of a file. */
enum { FIRST_TETS = 60000 };
/* At rest a content of so many tets comes before one of all that is asked for, where that one takes
 * longer than this, or nobody knows, seconds, and where what is there has fewer than half of them.
 */
enum { STEP_TETS = 700000 };
static const double LONG_S = 0.8;
/* While something moves: errors on the screen by those asked for; what the builder rests between
 * two contents, by the time it took for the last one. */
static const double MOVING_ERROR = 2, REST = 2;
/* How far the camera goes before a content for moving is made anew: parts of the distance of the
 * focal point, of the view angle, and of the scale. */
static const double FAR = 0.2;
/* A content for moving is made anew when it may have so many times its tets. */
static const uint64_t MORE = 2;

static tli_live_task nothing(void)
{
    return (tli_live_task){.step = TLI_LIVE_NOTHING, .tets_max = UINT64_MAX};
}

static double distance(const double a[3], const double b[3])
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

/* Another camera that sees much else, or from nearby. */
static bool is_far(const tl_camera *from, const tl_camera *to)
{
    double reach = distance(from->position, from->focal_point);
    if (from->size_px[0] != to->size_px[0] || from->size_px[1] != to->size_px[1] ||
        (from->parallel_scale > 0) != (to->parallel_scale > 0))
        return true;
    return distance(from->position, to->position) > FAR * reach ||
           distance(from->focal_point, to->focal_point) > FAR * reach ||
           fabs(to->view_angle - from->view_angle) > FAR * from->view_angle ||
           fabs(to->parallel_scale - from->parallel_scale) > FAR * from->parallel_scale;
}

static double error_asked(const tl_live *live)
{
    double error = tl_scene_real(live->scene->scene, TL_NODE_DETAIL + 1, "error_px");
    return error > 0 ? error : 1;
}

static bool is_frozen(const tl_live *live)
{
    return tl_scene_flag(live->scene->scene, TL_NODE_DETAIL + 1, "frozen");
}

/* ---- at rest ---- */

static tli_live_task next_fine(const tl_live *live, tli_live_task task)
{
    const tli_live_content *fine = live->fine, *best = tli_live_best(live);
    task.cut = TLI_LIVE_CUT_FINE;
    if (tli_live_is_final(live, fine) || tli_live_is_final(live, live->coarse)) return nothing();
    bool here = fine && fine->stamp == live->scene->stamp &&
                tli_live_same_camera(&fine->camera, &task.camera);
    /* one for another camera is seen meanwhile */
    bool fine_enough = fine && fine->stamp == live->scene->stamp && fine->step == TLI_LIVE_FINE;
    bool slow = !(live->full_s > 0) || live->full_s > LONG_S;
    task.step = TLI_LIVE_FINE;
    task.tets_max = tli_live_room(live);
    bool helps = best->facts->whole_tets < STEP_TETS / 2 && !(fine && fine->is_stepped);
    if (best->facts->is_model && !is_frozen(live) && slow && !here && !fine_enough && helps &&
        task.tets_max > STEP_TETS)
        task.tets_max = STEP_TETS;
    return task;
}

/* ---- while something moves ---- */

static tli_live_task next_coarse(const tl_live *live, tli_live_task task, double now_s,
                                 double *wait_s)
{
    const tli_live_content *best = tli_live_best(live);
    const uint64_t most =
        live->pace.tets < tli_live_room(live) ? live->pace.tets : tli_live_room(live);
    if (!best->facts->is_model || is_frozen(live)) return nothing();
    bool too_large = best->facts->tets > most + most / 4 && !tli_live_is_light(live, best);
    bool too_small =
        !best->facts->is_complete && best->tets_max < UINT64_MAX && best->tets_max <= most / MORE;
    const tli_live_content *coarse =
        live->coarse && live->coarse->stamp == best->stamp ? live->coarse : best;
    /* a finer one that is kept meanwhile was made for the picture at rest */
    bool near = !is_far(&best->camera, &task.camera) || !is_far(&coarse->camera, &task.camera);
    if (!too_large && !too_small && near) return nothing();
    double rested = now_s - live->coarse_end_s, wanted = REST * live->coarse_s;
    if (!too_large && rested < wanted) {
        *wait_s = wanted - rested;
        return nothing();
    }
    task.step = TLI_LIVE_COARSE;
    task.cut = TLI_LIVE_CUT_COARSE;
    task.tets_max = most;
    task.error_px = MOVING_ERROR * error_asked(live);
    return task;
}

tli_live_task tli_live_next(const tl_live *live, double now_s, double *wait_s)
{
    tli_live_task task = nothing();
    *wait_s = (double)INFINITY;
    if (live->open_path) {
        task.step = TLI_LIVE_FILE;
        return task;
    }
    if (!live->source || !tli_live_camera(live, &task.camera)) return nothing();
    if (live->has_failed && live->failed_stamp == live->scene->stamp &&
        tli_live_same_camera(&live->failed_camera, &task.camera))
        return nothing();
    const tli_live_content *best = tli_live_best(live);
    if (!best) {
        task.step = TLI_LIVE_FIRST;
        task.cut = TLI_LIVE_CUT_COARSE;
        task.tets_max = FIRST_TETS < tli_live_room(live) ? FIRST_TETS : tli_live_room(live);
        return task;
    }
    if (best->stamp != live->scene->stamp) {
        task.step = TLI_LIVE_QUICK;
        task.cut = best->cut;
        task.tets_max = STEP_TETS < tli_live_room(live) ? STEP_TETS : tli_live_room(live);
        return task;
    }
    return live->moving ? next_coarse(live, task, now_s, wait_s) : next_fine(live, task);
}

bool tli_live_builds(const tl_live *live)
{
    double wait_s;
    return live->running || tli_live_next(live, 0, &wait_s).step || isfinite(wait_s);
}

/* ---- what is not worth being finished ---- */

/* Files are read for a step that nobody waits for any more. */
static bool is_slow_step(const tl_live *live)
{
    return live->source && !tl_source_get_facts(live->source->source)->is_model &&
           live->running_step != tli_live_data_step(live->scene);
}

static bool is_useless(const tl_live *live)
{
    tl_camera camera;
    if (!live->running) return false;
    if (live->open_path) return true;
    if (live->running > TLI_LIVE_FILE && is_slow_step(live)) return true;
    if (live->running != TLI_LIVE_FINE || !tli_live_camera(live, &camera)) return false;
    return live->moving || live->running_stamp != live->scene->stamp ||
           !tli_live_same_camera(&camera, &live->running_camera);
}

void tli_live_changed(tl_live *live)
{
    live->changed_s = tli_clock_s();
    live->is_drawn = false;
    if (is_useless(live)) tl_ctx_cancel(live->builder.ctx, true);
    if (live->drawing == TLI_LIVE_DRAWS_SAMPLES ||
        (live->drawing == TLI_LIVE_DRAWS_REST && live->moving))
        tl_ctx_cancel(live->drawer.ctx, true);
    tli_bell_ring(&live->builder.bell);
    tli_bell_ring(&live->drawer.bell);
}
