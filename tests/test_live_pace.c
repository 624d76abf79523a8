/* Pixels and tets of frames: a simulated machine, slow or fast, steady or noisy, is brought to hold
 * the goal with as much as it can draw, and stays there. */
#include "live/live_pace.h"

#include "check.h"
#include "make_mesh.h"

/* Seconds of a frame of that machine. */
typedef struct machine {
    double fixed, pixel, tet; /* s a frame; of all pixels; a tet and frame */
    double noise;             /* times up to 1 + noise */
    uint64_t seed;
} machine;

static double frame_of(machine *m, const tli_pace *p)
{
    double pixels = 1.0 / (p->reduction * p->reduction);
    double seconds =
        m->fixed + m->pixel * pixels * cbrt((double)p->tets / 2e5) + m->tet * (double)p->tets;
    return seconds * (1 + m->noise * make_uniform(&m->seed));
}

/* Frames till the pace has settled; changes counts how often pixels or tets change after that. */
static tli_pace run(machine *m, double goal_s, int frames, int *changes, double *longest)
{
    tli_pace p = tli_pace_start();
    tli_pace_ask(&p, goal_s, 0);
    *changes = 0;
    *longest = 0;
    for (int i = 0; i < 2 * frames; i++) {
        tli_pace before = p;
        double seconds = frame_of(m, &p);
        tli_pace_add(&p, p.reduction, p.tets, seconds);
        if (i < frames) continue;
        *longest = fmax(*longest, seconds);
        *changes += p.reduction != before.reduction || p.tets != before.tets;
    }
    return p;
}

static void test_slow_machine(void **state)
{
    (void)state;
    int changes;
    double longest;
    machine m = {.fixed = 0.005, .pixel = 0.5, .seed = 1};
    tli_pace p = run(&m, 0.1, 60, &changes, &longest);
    CHECK_EQ(p.reduction, 3);
    CHECK_EQ(changes, 0);
    CHECK_BOUND("longest frame of a slow machine, s", longest, 0.1);
    machine slower = {.fixed = 0.01, .pixel = 0.5, .tet = 5e-7, .seed = 1};
    p = run(&slower, 0.1, 60, &changes, &longest);
    CHECK_EQ(p.reduction, 3);
    CHECK(p.tets < 200000);
    CHECK_EQ(changes, 0);
    CHECK_BOUND("longest frame of a slower one, s", longest, 0.1);
}

static void test_fast_machine(void **state)
{
    (void)state;
    int changes;
    double longest;
    machine m = {.fixed = 0.001, .pixel = 0.002, .tet = 1e-9, .seed = 1};
    tli_pace p = run(&m, 1.0 / 60, 100, &changes, &longest);
    CHECK_EQ(p.reduction, 1);
    CHECK(p.tets > 1000000);
    CHECK_EQ(changes, 0);
    CHECK_BOUND("longest frame of a fast machine, s", longest, 1.0 / 60);
}

/* Between two reductions it does not go to and fro, and noise does not make it. */
static void test_no_flicker(void **state)
{
    (void)state;
    for (int i = 0; i < 40; i++) {
        int changes;
        double longest;
        machine m = {.fixed = 0.005, .pixel = 0.02 * (i + 1), .noise = 0.25, .seed = (uint64_t)i};
        run(&m, 0.1, 100, &changes, &longest);
        CHECK(changes <= 2);
        CHECK(longest <= 0.13);
    }
}

static void test_what_is_asked_for(void **state)
{
    (void)state;
    tli_pace p = tli_pace_start();
    tli_pace_ask(&p, 0.1, 12345);
    for (int i = 0; i < 50; i++) tli_pace_add(&p, p.reduction, 12345, 10);
    CHECK_EQ(p.reduction, 3);
    CHECK_EQ(p.tets, 12345);
    for (int i = 0; i < 50; i++) tli_pace_add(&p, p.reduction, 12345, 1e-3);
    CHECK_EQ(p.reduction, 1);
    CHECK_EQ(p.tets, 12345);
    tli_pace_ask(&p, 0.1, 0); /* as it goes, from the start */
    CHECK(p.tets != 12345);
    tli_pace_ask(&p, 0, 0);
    CHECK(p.goal_s > 0);
}

/* A long frame at rest is not waited for again when something moves; a late one counts for nothing.
 */
static void test_rest_and_late_frames(void **state)
{
    (void)state;
    tli_pace p = tli_pace_start();
    tli_pace_rest(&p, p.tets, 0.05);
    CHECK_EQ(p.reduction, 2); /* only ever fewer pixels */
    tli_pace_rest(&p, p.tets, 0.6);
    CHECK_EQ(p.reduction, 3);
    tli_pace before = p;
    tli_pace_add(&p, 1, p.tets, 5);
    CHECK_EQ(memcmp(&before, &p, sizeof p), 0);
    p = tli_pace_start();
    tli_pace_rest(&p, 27 * p.tets, 0.9); /* a third of the tets along a ray */
    CHECK_EQ(p.reduction, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slow_machine), cmocka_unit_test(test_fast_machine),
        cmocka_unit_test(test_no_flicker), cmocka_unit_test(test_what_is_asked_for),
        cmocka_unit_test(test_rest_and_late_frames)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
