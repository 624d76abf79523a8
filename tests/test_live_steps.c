/* What is seen between two pictures that are all that is asked for: nothing at rest is coarser than
 * what was there for the same camera, and what is drawn in time stays when something moves. */
#include "check_live.h"

static const char *const MODEL = "steps.tlod";

/* Frames at rest, one after another: each promises as much as the one before, or all that is asked
 * for. */
typedef struct watch {
    live_fixture f;
    double asked_px, off_px; /* of the frame before; < 0: there is none of this camera */
    uint64_t whole_tets;
    size_t frames, coarser;
    tl_camera camera;
    bool is_final;
} watch;

static bool is_same_camera(const tl_camera *a, const tl_camera *b)
{
    bool same = a->view_angle == b->view_angle && a->size_px[0] == b->size_px[0];
    for (int k = 0; k < 3; k++)
        same = same && a->position[k] == b->position[k] && a->focal_point[k] == b->focal_point[k];
    return same;
}

static void look(watch *w)
{
    double px = -1;
    const tl_frame *frame = tl_live_frame(w->f.live);
    if (!frame) return;
    CHECK_OK(w->f.ctx, tl_content_error_px(w->f.ctx, frame->content, &frame->camera, &px));
    CHECK(frame->error_px == px);
    w->is_final = frame->is_final;
    if (frame->is_final) CHECK_BOUND("pixels", px, w->asked_px);
    if (!frame->is_moving && w->off_px >= 0 && is_same_camera(&w->camera, &frame->camera)) {
        const double before = fmax(w->off_px, w->asked_px);
        const bool lost = isinf(px) && isinf(before) && frame->facts->whole_tets < w->whole_tets;
        if (px > before || lost) {
            printf("frame %llu: %g pixels of %llu tets after %g of %llu\n",
                   (unsigned long long)frame->number, px,
                   (unsigned long long)frame->facts->whole_tets, w->off_px,
                   (unsigned long long)w->whole_tets);
            w->coarser++;
        }
    }
    w->off_px = frame->is_moving ? -1 : px;
    w->whole_tets = frame->facts->whole_tets;
    w->camera = frame->camera;
    w->frames++;
    tl_live_release(w->f.live, frame);
}

/* Looks at frames until the view has settled, or for some seconds. */
static void watch_on(watch *w, double seconds)
{
    const double end = live_now() + seconds;
    tl_live_event e;
    do {
        while (tl_live_next_event(w->f.live, &e))
            if (e.kind == TL_LIVE_FAILED) fail_msg("job %d failed: %s", e.job, e.text);
        look(w);
        nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
    } while (live_now() < end && !tl_live_settled(w->f.live));
    look(w);
}

static void rest(watch *w)
{
    watch_on(w, LIVE_PATIENCE_S);
    CHECK(tl_live_settled(w->f.live) && w->is_final);
}

static void change(watch *w, const char *command)
{
    live_do(w->f.live, w->f.ctx, w->f.scene, command);
}

static void ask(watch *w, double px)
{
    char text[64];
    snprintf(text, sizeof text, "set detail.error_px %g", px);
    w->asked_px = px;
    change(w, text);
}

/* Turns for a while, and lets go. */
static void drag(watch *w, int steps, double angle)
{
    tl_live_set_moving(w->f.live, true);
    for (int i = 0; i < steps; i++) {
        live_turn(w->f.live, w->f.ctx, w->f.scene, angle);
        watch_on(w, 0.01);
    }
    tl_live_set_moving(w->f.live, false);
}

static watch begin(tl_live_opts *opts)
{
    watch w = {.f = live_begin(opts, MODEL), .asked_px = 1, .off_px = -1};
    change(&w, "add surface value=0.3");
    return w;
}

static void end(watch *w)
{
    printf("%zu frames\n", w->frames);
    CHECK_EQ(w->coarser, 0);
    live_end(&w->f);
}

/* ---- at rest ---- */

/* Changes, each while the one before is still being refined, too. */
static void session(tl_live_opts *opts)
{
    watch w = begin(opts);
    rest(&w);
    ask(&w, 8);
    rest(&w);
    ask(&w, 2);
    rest(&w);
    ask(&w, 0.2);
    rest(&w);
    for (int round = 0; round < 3; round++) {
        drag(&w, 8, 12);
        watch_on(&w, 0.005 * round);
        change(&w, round % 2 ? "set surface1.color red" : "set surface1.color blue");
        watch_on(&w, 0.02 * round);
        change(&w, "set surface1.opacity 0.5");
        rest(&w);
        change(&w, "set surface1.opacity 1");
        rest(&w);
    }
    w.asked_px = 0.1;
    change(&w, "set detail.error_px 0.1");
    watch_on(&w, 0.01);
    drag(&w, 3, 1);
    rest(&w);
    end(&w);
}

static void test_never_coarser_at_rest(void **state)
{
    (void)state;
    session(NULL);
}

static void test_never_coarser_from_a_slow_disk(void **state)
{
    (void)state;
    tl_live_opts opts = tl_live_opts_defaults();
    opts.throttle_bytes_s = 300000;
    session(&opts);
}

/* ---- as something begins to move ---- */

/* A mesh that is drawn in time stays when a drag begins; one for which there is no time goes. */
static void test_what_is_light_stays(void **state)
{
    (void)state;
    watch w = begin(NULL);
    ask(&w, 0.05);
    change(&w, "set detail.frame_s 1");
    rest(&w);
    const uint64_t tets = w.whole_tets;
    for (int round = 0; round < 2; round++) {
        bool stays = round == 0;
        if (!stays) change(&w, "set detail.moving_tets 2000");
        tl_live_set_moving(w.f.live, true);
        int looked = 0;
        bool has_gone = false;
        for (const double end = live_now() + LIVE_PATIENCE_S; looked < 10 && live_now() < end;) {
            live_turn(w.f.live, w.f.ctx, w.f.scene, 0.5);
            tl_live_wait(w.f.live, UINT64_MAX, 0.02);
            const tl_frame *frame = tl_live_frame(w.f.live);
            if (!frame) continue;
            CHECK(frame->is_moving);
            if (stays) CHECK_EQ(frame->facts->whole_tets, tets);
            has_gone |= frame->facts->whole_tets <= 2500;
            if (has_gone) CHECK(frame->facts->whole_tets <= 2500);
            looked += stays || has_gone;
            tl_live_release(w.f.live, frame);
        }
        CHECK_EQ(looked, 10);
        tl_live_set_moving(w.f.live, false);
        w.off_px = -1;
        rest(&w);
    }
    end(&w);
}

static int make_data(void **state)
{
    (void)state;
    live_model(MODEL, 26);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_never_coarser_at_rest),
                                       cmocka_unit_test(test_never_coarser_from_a_slow_disk),
                                       cmocka_unit_test(test_what_is_light_stays)};
    return cmocka_run_group_tests(tests, make_data, NULL);
}
