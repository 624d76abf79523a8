/* A flight that a seed steers: cameras, things, colours, sizes, files and questions in any order
 * and at any moment. Frames stay in order, memory flat, and the end is what the scene says. */
#include "check_live.h"

static const char *const MODEL = "flight.tlod";
enum { ROUNDS = 5, STEPS = 120 };

typedef struct flight {
    tl_ctx *ctx;
    tl_live *live;
    tl_scene *scene;
    uint64_t seed, last_frame;
} flight;

static uint32_t pick(flight *f, uint32_t count)
{
    return (uint32_t)(make_random(&f->seed) % count);
}

static void look(flight *f)
{
    const tl_frame *frame = tl_live_frame(f->live);
    if (!frame) return;
    CHECK(frame->number > f->last_frame);
    f->last_frame = frame->number;
    CHECK(frame->reduction >= 1 && frame->reduction <= 3 && frame->samples >= 1);
    CHECK(frame->camera.size_px[0] == frame->width && frame->camera.size_px[1] == frame->height);
    CHECK(frame->content && frame->facts->tets > 0);
    uint64_t sum = 0; /* all of it can be read */
    for (size_t i = 0; i < 4 * (size_t)frame->width * frame->height; i++) sum += frame->rgba[i];
    for (size_t i = 0; i < (size_t)frame->width * frame->height; i++) sum += frame->depth[i] > 0;
    CHECK(sum > 0);
    if (pick(f, 3) == 0) tl_live_probe(f->live, pick(f, frame->width), pick(f, frame->height));
    tl_live_release(f->live, frame);
}

static void take_events(flight *f)
{
    tl_live_event e;
    while (tl_live_next_event(f->live, &e)) {
        if (e.kind == TL_LIVE_FAILED && e.status != TL_ERR_CANCELLED)
            fail_msg("job %d failed: %s: %s", e.job, tl_status_name(e.status), e.text);
        if (e.kind == TL_LIVE_OPENED) /* shows the scene of the time when it was asked for */
            CHECK_STATUS(tl_live_set_scene(f->live, f->scene), TL_OK);
    }
    tl_live_get_probe(f->live);
}

static void command(flight *f, const char *format, double value)
{
    char text[200];
    snprintf(text, sizeof text, format, value);
    live_do(f->live, f->ctx, f->scene, text);
}

static void step(flight *f)
{
    tl_live_counts counts;
    switch (pick(f, 16)) {
    case 0: tl_live_set_moving(f->live, true); break;
    case 1: tl_live_set_moving(f->live, false); break;
    case 2: command(f, "set surface1.value %g", 0.2 + 0.6 * make_uniform(&f->seed)); break;
    case 3: command(f, "set surface1.opacity %g", 0.3 + 0.7 * make_uniform(&f->seed)); break;
    case 4: command(f, "set surface1.visible %g", pick(f, 2)); break;
    case 5: command(f, "view 30,20,%g", 1 + 3 * make_uniform(&f->seed)); break;
    case 6: tl_live_set_size(f->live, 20 + pick(f, 200), 20 + pick(f, 150)); break;
    case 7: tl_live_histogram(f->live, "f", pick(f, 2), &counts); break;
    case 8:
        if (pick(f, 4) == 0) tl_live_open(f->live, MODEL, f->scene);
        break;
    case 9: command(f, "set detail.moving_tets %g", 1000 + pick(f, 20000)); break;
    default: live_turn(f->live, f->ctx, f->scene, 5); break;
    }
    take_events(f);
    look(f);
    if (pick(f, 3) == 0) nanosleep(&(struct timespec){.tv_nsec = 1000000 * pick(f, 20)}, NULL);
}

/* All that a flight changed is as it was. */
static void come_home(flight *f)
{
    tl_live_set_moving(f->live, false);
    tl_live_set_size(f->live, 160, 100);
    command(f, "set surface1.value 0.5", 0);
    command(f, "set surface1.opacity 1", 0);
    command(f, "set surface1.visible on", 0);
    command(f, "set detail.moving_tets 5000", 0);
    command(f, "view 30,20,1", 0);
    const double end = live_now() + LIVE_PATIENCE_S;
    do {
        tl_live_wait(f->live, UINT64_MAX, 1);
        take_events(f);
    } while (!tl_live_settled(f->live) && live_now() < end);
}

static void test_flight(void **state)
{
    (void)state;
    flight f = {.ctx = check_ctx_create(1), .live = live_create(NULL), .seed = 5};
    uint64_t ram[ROUNDS];
    uint8_t *first = NULL;
    f.scene = live_open(f.live, f.ctx, MODEL);
    live_do(f.live, f.ctx, f.scene, "add surface value=0.5");
    tl_scene_forget(f.ctx, f.scene);
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < STEPS; i++) step(&f);
        come_home(&f);
        tl_scene_forget(f.ctx, f.scene);
        const tl_frame *frame = tl_live_frame(f.live);
        CHECK(frame && frame->is_final && frame->width == 160);
        const size_t bytes = 4 * (size_t)frame->width * frame->height;
        if (!first) {
            first = malloc(bytes);
            memcpy(first, frame->rgba, bytes);
        }
        CHECK_EQ(memcmp(first, frame->rgba, bytes), 0);
        tl_live_release(f.live, frame);
        ram[round] = tl_live_get_stats(f.live).ram_bytes;
        printf("after %d steps: %llu bytes\n", (round + 1) * STEPS, (unsigned long long)ram[round]);
    }
    /* what is kept for moving depends on the moment; what leaks has no bound */
    uint64_t least = ram[0];
    for (int round = 1; round < ROUNDS; round++) least = ram[round] < least ? ram[round] : least;
    CHECK_BOUND("bytes at the end", (double)ram[ROUNDS - 1], 3 * (double)least);
    free(first);
    tl_live_destroy(f.live);
    tl_scene_destroy(f.ctx, f.scene);
    check_ctx_destroy(f.ctx);
}

static int make_data(void **state)
{
    (void)state;
    live_model(MODEL, 16);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_flight)};
    return cmocka_run_group_tests(tests, make_data, NULL);
}
