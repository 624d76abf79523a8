/* A live view: what it shows in the end is what is drawn without it, while something moves it is
 * coarser, and nothing that a shell asks waits. */
#include <stdatomic.h>
#include <sys/resource.h>

#include "check_live.h"

static const char *const MODEL = "live.tlod";

/* ---- what is shown ---- */

/* The picture of a scene, drawn in one thread, as bytes. */
static uint8_t *draw_alone(const tl_scene *scene, uint32_t width, uint32_t height)
{
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = NULL;
    tl_view *view = NULL;
    tl_content *content = NULL;
    tl_renderer *renderer = NULL;
    tl_shown *shown = NULL;
    tl_image *image = NULL;
    tl_camera camera;
    tl_draw_opts opts = tl_draw_opts_defaults();
    uint8_t *bytes = malloc(4 * (size_t)width * height);
    tl_scene_camera(scene, width, height, &camera);
    CHECK_OK(ctx, tl_source_open(ctx, MODEL, &source));
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, NULL, &content));
    CHECK_OK(ctx, tl_renderer_create(ctx, TL_RENDERER_CPU, &renderer));
    CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
    CHECK_OK(ctx, tl_content_show(ctx, shown, content));
    opts.samples = tl_content_samples(content, scene, width, height);
    CHECK_OK(ctx, tl_content_draw(ctx, shown, &camera, &opts, &image));
    CHECK_OK(ctx, tl_content_annotate(ctx, content, scene, &camera, image));
    tl_image_flatten(image, (const float[3]){0.25F, 0.5F, 0.75F});
    for (size_t i = 0; i < 4 * (size_t)width * height; i++)
        bytes[i] = (uint8_t)(fminf(fmaxf(image->rgba[i], 0), 1) * 255 + 0.5F);
    tl_image_destroy(ctx, image);
    tl_shown_destroy(ctx, shown);
    tl_renderer_destroy(ctx, renderer);
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
    return bytes;
}

static void check_final(const tl_frame *frame, const tl_scene *scene)
{
    CHECK(frame != NULL);
    CHECK(frame->is_final && !frame->is_moving);
    CHECK_EQ(frame->reduction, 1);
    CHECK_EQ(frame->note[0], 0);
    CHECK(frame->scene_version == tl_scene_version(scene));
    uint8_t *bytes = draw_alone(scene, frame->width, frame->height);
    CHECK_EQ(memcmp(bytes, frame->rgba, 4 * (size_t)frame->width * frame->height), 0);
    free(bytes);
}

/* First looks, another thing, another camera, another size: always the picture of the scene. */
static void test_final_is_the_scene(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    const tl_frame *frame;
    live_do(f.live, f.ctx, f.scene, "set picture.background 0.25,0.5,0.75");
    frame = live_settle(f.live);
    check_final(frame, f.scene);
    CHECK(frame->facts->tets > 0);
    tl_live_release(f.live, frame);
    live_do(f.live, f.ctx, f.scene, "add surface value=0.5");
    frame = live_settle(f.live);
    check_final(frame, f.scene);
    tl_live_release(f.live, frame);
    live_do(f.live, f.ctx, f.scene, "view 120,40,2.5");
    tl_live_set_size(f.live, 201, 133);
    frame = live_settle(f.live);
    CHECK_EQ(frame->width, 201);
    check_final(frame, f.scene);
    tl_live_release(f.live, frame);
    live_end(&f);
}

/* ---- moving ---- */

static void test_moving(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    uint64_t last = 0;
    live_do(f.live, f.ctx, f.scene, "set detail.moving_tets 3000");
    live_do(f.live, f.ctx, f.scene, "set picture.background 0.25,0.5,0.75");
    tl_live_release(f.live, live_settle(f.live));
    tl_live_set_moving(f.live, true);
    for (int i = 0; i < 60; i++) {
        live_turn(f.live, f.ctx, f.scene, 3);
        tl_live_wait(f.live, last, LIVE_PATIENCE_S);
        const tl_frame *frame = tl_live_frame(f.live);
        if (!frame) continue;
        CHECK(frame->number > last);
        last = frame->number;
        if (i > 30) {
            CHECK(frame->is_moving && !frame->is_final);
            CHECK(frame->facts->tets <= 3750);
        }
        tl_live_release(f.live, frame);
    }
    tl_live_stats stats = tl_live_get_stats(f.live);
    CHECK(stats.moving_frames > 20);
    CHECK(stats.longest_frame_s > 0 && stats.longest_frame_s < LIVE_PATIENCE_S);
    tl_live_set_moving(f.live, false);
    const tl_frame *frame = live_settle(f.live);
    check_final(frame, f.scene);
    CHECK(frame->facts->tets > 3750);
    tl_live_release(f.live, frame);
    live_end(&f);
}

/* Frames go on, and a shell that holds too many gets no more. */
static void test_held_frames(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    const tl_frame *held[4];
    uint8_t first[16];
    for (int i = 0; i < 4; i++) {
        live_turn(f.live, f.ctx, f.scene, 10);
        held[i] = live_settle(f.live);
        CHECK(held[i] != NULL);
    }
    memcpy(first, held[0]->rgba + 4 * (160 * 50 + 80), sizeof first);
    for (int i = 0; i < 10; i++) {
        live_turn(f.live, f.ctx, f.scene, 10);
        CHECK(live_settle(f.live) == NULL);
    }
    CHECK_EQ(memcmp(first, held[0]->rgba + 4 * (160 * 50 + 80), sizeof first), 0);
    tl_live_release(f.live, held[2]);
    const tl_frame *newest = tl_live_frame(f.live);
    CHECK(newest && newest->scene_version == tl_scene_version(f.scene));
    tl_live_release(f.live, newest);
    tl_live_release(f.live, NULL);
    for (int i = 0; i < 4; i++)
        if (i != 2) tl_live_release(f.live, held[i]);
    live_end(&f);
}

/* ---- nothing to do ---- */

static double processor_s(void)
{
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    return (double)used.ru_utime.tv_sec + (double)used.ru_stime.tv_sec +
           1e-6 * (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

static void test_idle(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    tl_live_release(f.live, live_settle(f.live));
    tl_live_set_moving(f.live, true); /* a button that is held down, and nothing else */
    nanosleep(&(struct timespec){.tv_nsec = 300000000}, NULL);
    double before = processor_s();
    nanosleep(&(struct timespec){.tv_sec = 1}, NULL);
    CHECK_BOUND("processor time of an idle second, s", processor_s() - before, 0.005);
    live_end(&f);
}

static void count_call(void *user)
{
    atomic_fetch_add((atomic_int *)user, 1);
}

/* Before there is anything; ends at any moment. */
static void test_ends(void **state)
{
    (void)state;
    atomic_int calls = 0;
    tl_live_opts opts = tl_live_opts_defaults();
    opts.notify = count_call;
    opts.user = &calls;
    tl_live_destroy(NULL);
    for (int i = 0; i < 30; i++) {
        tl_live *live = live_create(&opts);
        tl_live_event e;
        tl_scene *scene = NULL;
        tl_ctx *ctx = check_ctx_create(1);
        CHECK(!tl_live_frame(live) && !tl_live_source(live) && !tl_live_get_probe(live));
        CHECK_STATUS(tl_live_get_scene(live, ctx, &scene), TL_ERR_ARG);
        CHECK(!tl_live_next_event(live, &e));
        CHECK(tl_live_settled(live));
        tl_live_probe(live, 1, 1);
        if (i % 3) CHECK_STATUS(tl_live_open(live, MODEL, NULL), TL_OK);
        if (i % 3 == 2) nanosleep(&(struct timespec){.tv_nsec = 3000000L * i}, NULL);
        if (i == 2) live_expect(live, TL_LIVE_OPENED);
        tl_live_destroy(live);
        check_ctx_destroy(ctx);
    }
    CHECK(calls > 0);
    tl_live *none = NULL;
    opts.struct_bytes = 3;
    CHECK_STATUS(tl_live_create(&opts, &none), TL_ERR_ARG);
    CHECK(!none);
}

static int make_data(void **state)
{
    (void)state;
    live_model(MODEL, 22);
    return 0;
}

/* A shell that sleeps until the hook calls it sees the final picture. */
static void test_hook_alone(void **state)
{
    (void)state;
    atomic_int calls = 0;
    tl_live_opts opts = tl_live_opts_defaults();
    opts.notify = count_call;
    opts.user = &calls;
    tl_live *live = live_create(&opts);
    const double end = live_now() + LIVE_PATIENCE_S;
    bool is_final = false;
    CHECK_STATUS(tl_live_open(live, MODEL, NULL), TL_OK);
    for (int seen = 0; !is_final && live_now() < end;) {
        tl_live_event e;
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
        if (atomic_load(&calls) == seen) continue;
        seen = atomic_load(&calls);
        while (tl_live_next_event(live, &e)) CHECK(e.kind != TL_LIVE_FAILED);
        const tl_frame *frame = tl_live_frame(live);
        is_final = frame && frame->is_final;
        tl_live_release(live, frame);
    }
    CHECK(is_final);
    tl_live_destroy(live);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_final_is_the_scene),
                                       cmocka_unit_test(test_moving),
                                       cmocka_unit_test(test_hook_alone),
                                       cmocka_unit_test(test_held_frames),
                                       cmocka_unit_test(test_idle),
                                       cmocka_unit_test(test_ends)};
    return cmocka_run_group_tests(tests, make_data, NULL);
}
