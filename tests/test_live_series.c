/* Steps of files in a live view: each is read beside the shell and is shown; models of all of them
 * or of one. */
#include "check_live.h"
#include "make_series.h"

enum { STEPS = 5 };
static const unsigned NUMBERS[STEPS] = {1, 2, 3, 5, 8};

static int write_files(void **state)
{
    (void)state;
    series_write("live_series", 10, NUMBERS, STEPS);
    return 0;
}

static void ask_step(live_fixture *f, unsigned number)
{
    CHECK_OK(f->ctx, tl_scene_set_real(f->ctx, f->scene, TL_NODE_DATA + 1, "step", number));
    CHECK_STATUS(tl_live_set_scene(f->live, f->scene), TL_OK);
}

static void check_shown(live_fixture *f, unsigned number)
{
    const tl_frame *frame = live_settle(f->live);
    CHECK(frame && frame->is_final);
    CHECK_EQ(frame->facts->step, number);
    CHECK_EQ(frame->scene_version, tl_scene_version(f->scene));
    tl_live_release(f->live, frame);
}

static void steps_follow_the_scene(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, series_path("live_series", 3));
    const tl_source_facts *facts = tl_source_get_facts(tl_live_source(f.live));
    CHECK_EQ(facts->step_count, STEPS);
    check_shown(&f, 3);
    ask_step(&f, 8);
    check_shown(&f, 8);
    for (size_t i = 0; i < STEPS; i++) ask_step(&f, NUMBERS[i]); /* nobody waits for most of them */
    ask_step(&f, 5);
    check_shown(&f, 5);
    live_end(&f);
}

/* A step that can't be read is said; the one before stays, and others come. */
static void a_step_is_missing(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, series_path("live_series", 1));
    check_shown(&f, 1);
    CHECK_EQ(rename(series_path("live_series", 2), "live_series_away"), 0);
    ask_step(&f, 2);
    const tl_live_event e = live_expect_failure(f.live, TL_LIVE_CONTENT, TL_ERR_IO);
    CHECK(strstr(e.text, series_path("live_series", 2)));
    ask_step(&f, 8);
    check_shown(&f, 8);
    CHECK_EQ(rename("live_series_away", series_path("live_series", 2)), 0);
    ask_step(&f, 2);
    check_shown(&f, 2);
    live_end(&f);
}

enum { MANY = 16 };

/* Bytes of all threads after all steps were shown. */
static uint64_t visit(live_fixture *f)
{
    for (unsigned i = 0; i < MANY; i++) {
        ask_step(f, i);
        check_shown(f, i);
    }
    return tl_live_get_stats(f->live).ram_bytes;
}

/* Steps that are kept make room for the one that is shown. */
static void steps_in_little_memory(void **state)
{
    (void)state;
    unsigned numbers[MANY];
    for (unsigned i = 0; i < MANY; i++) numbers[i] = i;
    series_write("live_many", 18, numbers, MANY);
    live_fixture f = live_begin(NULL, series_path("live_many", 1));
    check_shown(&f, 1);
    const uint64_t one = tl_live_get_stats(f.live).ram_bytes;
    const uint64_t all = visit(&f), limit = 3 * one;
    CHECK(all > limit);
    live_end(&f);
    tl_live_opts opts = tl_live_opts_defaults();
    opts.ram_bytes = limit;
    f = live_begin(&opts, series_path("live_many", 1));
    const uint64_t kept = visit(&f);
    printf("one step %llu, all %llu, kept %llu <= %llu bytes\n", (unsigned long long)one,
           (unsigned long long)all, (unsigned long long)kept, (unsigned long long)limit);
    CHECK(kept <= limit);
    live_end(&f);
}

static void build(tl_live *live, const char *input, bool all, const char *path)
{
    CHECK_STATUS(tl_live_build_model(live, input, NULL, all, path, NULL), TL_OK);
    CHECK_EQ(live_expect(live, TL_LIVE_DONE).job, TL_LIVE_MODEL);
}

static void models_of_steps(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, series_path("live_series", 3));
    build(f.live, series_path("live_series", 3), true, "live_series.tlod");
    CHECK_STATUS(tl_live_open(f.live, "live_series.tlod", f.scene), TL_OK);
    live_expect(f.live, TL_LIVE_OPENED);
    const tl_source_facts *facts = tl_source_get_facts(tl_live_source(f.live));
    CHECK(facts->is_model);
    CHECK_EQ(facts->step_count, STEPS);
    CHECK_EQ(facts->steps[4].number, 8);
    ask_step(&f, 5);
    check_shown(&f, 5);
    build(f.live, series_path("live_series", 3), false, "live_series.tlod");
    CHECK_OK(f.ctx, tl_scene_set_real(f.ctx, f.scene, TL_NODE_DATA + 1, "step", -1));
    CHECK_STATUS(tl_live_open(f.live, "live_series.tlod", f.scene), TL_OK);
    live_expect(f.live, TL_LIVE_OPENED);
    CHECK_EQ(tl_source_get_facts(tl_live_source(f.live))->step_count, 0);
    live_end(&f);
    CHECK_EQ(remove("live_series.tlod"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_follow_the_scene), cmocka_unit_test(a_step_is_missing),
        cmocka_unit_test(steps_in_little_memory), cmocka_unit_test(models_of_steps)};
    return cmocka_run_group_tests(tests, write_files, NULL);
}
