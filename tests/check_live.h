/* A live view for tests: a model of a grid with a few bumps, opened, and what it tells. */
#ifndef TETRALOD_TESTS_CHECK_LIVE_H
#define TETRALOD_TESTS_CHECK_LIVE_H

#include <time.h>

#include "tetralod/live.h"

#include "check_ctx.h"
#include "check_model.h"

#ifdef __SANITIZE_THREAD__
/* Libraries that are not instrumented: their own locks are not seen. */
__attribute__((visibility("default"))) const char *__tsan_default_suppressions(void);
const char *__tsan_default_suppressions(void)
{
    return "race:libfontconfig.so\nrace:libglib-2.0.so\nrace:libpangoft2-1.0.so\n"
           "race:libcairo.so\n";
}
#endif

/* Longest time that a test waits for anything; sanitizers on a busy machine are slow. */
#define LIVE_PATIENCE_S 120.0

static inline double live_bumps(const double x[3])
{
    return sin(5 * x[0]) * cos(4 * x[1]) + x[2] * x[2];
}

static inline double live_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Builds the model of a grid of size^3 cells of five tets, shaken so that it does not code well. */
static inline void live_model(const char *path, size_t size)
{
    tl_ctx *ctx = check_ctx_create(2);
    tl_build_result result;
    tl_build_opts opts = check_model_opts(2000, 300);
    make_mesh m = make_grid(size);
    make_perturb(&m, 0.1 / (double)size, 3);
    tl_mesh *mesh = make_object(ctx, &m, live_bumps);
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, path, &opts, &result));
    tl_build_release(ctx, &result);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static inline tl_live *live_create(tl_live_opts *opts)
{
    tl_live *live = NULL;
    tl_live_opts o = tl_live_opts_defaults();
    if (!opts) opts = &o;
    if (!opts->thread_count) opts->thread_count = 2;
    if (opts->renderer == TL_RENDERER_AUTO) opts->renderer = TL_RENDERER_CPU;
    CHECK_STATUS(tl_live_create(opts, &live), TL_OK);
    tl_live_set_size(live, 160, 100);
    return live;
}

/* The next event of a kind; others are passed over, those of progress and notices silently. */
static inline tl_live_event live_expect(tl_live *live, tl_live_event_kind kind)
{
    tl_live_event e = {0};
    const double end = live_now() + LIVE_PATIENCE_S;
    while (live_now() < end) {
        if (!tl_live_next_event(live, &e)) {
            nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
            continue;
        }
        if (e.kind == kind) return e;
        if (e.kind == TL_LIVE_FAILED)
            fail_msg("job %d failed: %s: %s", e.job, tl_status_name(e.status), e.text);
    }
    fail_msg("no event %d came", kind);
    return e;
}

/* The next failure. */
static inline tl_live_event live_expect_failure(tl_live *live, tl_live_job job, tl_status status)
{
    tl_live_event e = {0};
    const double end = live_now() + LIVE_PATIENCE_S;
    while (live_now() < end && e.kind != TL_LIVE_FAILED)
        if (!tl_live_next_event(live, &e)) tl_live_wait(live, UINT64_MAX, 0.01);
    CHECK_EQ(e.kind, TL_LIVE_FAILED);
    CHECK_EQ(e.job, job);
    CHECK_STATUS(e.status, status);
    CHECK(e.text[0] != 0);
    printf("told: %s\n", e.text);
    return e;
}

/* The newest frame once the view has settled, which tl_live_release takes back. */
static inline const tl_frame *live_settle(tl_live *live)
{
    const double end = live_now() + LIVE_PATIENCE_S;
    while (!tl_live_settled(live) && live_now() < end) {
        tl_live_event e;
        while (tl_live_next_event(live, &e))
            if (e.kind == TL_LIVE_FAILED)
                fail_msg("job %d failed: %s: %s", e.job, tl_status_name(e.status), e.text);
        tl_live_wait(live, UINT64_MAX, 1);
    }
    CHECK(tl_live_settled(live));
    return tl_live_frame(live);
}

/* Opens a file and gives the scene that it shows, of ctx. */
static inline tl_scene *live_open(tl_live *live, tl_ctx *ctx, const char *path)
{
    tl_scene *scene = NULL;
    CHECK_STATUS(tl_live_open(live, path, NULL), TL_OK);
    live_expect(live, TL_LIVE_OPENED);
    CHECK_OK(ctx, tl_live_get_scene(live, ctx, &scene));
    return scene;
}

/* A view of a file with the scene that it shows. */
typedef struct live_fixture {
    tl_ctx *ctx;
    tl_live *live;
    tl_scene *scene;
} live_fixture;

static inline live_fixture live_begin(tl_live_opts *opts, const char *path)
{
    live_fixture f = {.ctx = check_ctx_create(1), .live = live_create(opts)};
    f.scene = live_open(f.live, f.ctx, path);
    return f;
}

static inline void live_end(live_fixture *f)
{
    tl_live_destroy(f->live);
    tl_scene_destroy(f->ctx, f->scene);
    check_ctx_destroy(f->ctx);
}

static inline void live_do(tl_live *live, tl_ctx *ctx, tl_scene *scene, const char *command)
{
    CHECK_OK(ctx, tl_scene_do(ctx, scene, command));
    CHECK_STATUS(tl_live_set_scene(live, scene), TL_OK);
}

/* Turns the camera a little and hands the scene over. */
static inline void live_turn(tl_live *live, tl_ctx *ctx, tl_scene *scene, double angle)
{
    tl_camera camera;
    tl_scene_camera(scene, 160, 100, &camera);
    tl_camera_orbit(&camera, NULL, angle, 0, TL_ORBIT_TURNTABLE, NULL);
    CHECK_OK(ctx, tl_scene_set_camera(ctx, scene, &camera));
    CHECK_STATUS(tl_live_set_scene(live, scene), TL_OK);
}

#endif
