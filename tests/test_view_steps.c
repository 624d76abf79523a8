/* Sources of several steps that are no models: each is read when it is asked for, the last ones are
 * kept as memory allows, and what is shown of a step does not depend on what was before. */
#include "check.h"

#include "view/view.h"

#include "check_view.h"
#include "make_series.h"

enum { SIDE = 9, STEPS = 12 };
static const unsigned NUMBERS[STEPS] = {0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110};
static const char *const LINES[] = {"add volume channel=T",
                                    "add surface channel=T value=0.7 opacity=0.5", NULL};

static int write_files(void **state)
{
    (void)state;
    series_write("view_steps", SIDE, NUMBERS, STEPS);
    return 0;
}

static void set_step(tl_ctx *ctx, tl_scene *scene, double step)
{
    CHECK_OK(ctx, tl_scene_set_real(ctx, scene, TL_NODE_DATA + 1, "step", step));
}

static tl_source *open_series(tl_ctx *ctx, unsigned own, int64_t step)
{
    tl_source *source = NULL;
    CHECK_OK(ctx, tl_source_read(ctx, series_path("view_steps", own), NULL, step, &source));
    return source;
}

static void steps_are_listed(void **state)
{
    (void)state;
    tl_source *none = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = open_series(ctx, 20, -1);
    const tl_source_facts *facts = tl_source_get_facts(source);
    CHECK(!facts->is_model);
    CHECK_EQ(facts->step_count, STEPS);
    CHECK_EQ(facts->own_step, 2);
    CHECK_EQ(facts->steps[5].number, 50);
    assert_string_equal(facts->steps[5].file, series_path("view_steps", 50));
    CHECK(facts->channels[0].has_steps);
    assert_string_equal(facts->name, series_path("view_steps", 20));
    tl_source_destroy(source);
    CHECK_STATUS(tl_source_read(ctx, series_path("view_steps", 20), NULL, 7, &none), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "steps: 0 10 20 30 40 50 60 70 80 90 100 110"));
    CHECK(!none);
    check_ctx_destroy(ctx);
}

/* The same pictures as of the step's file as a mesh of its own, in any order. */
static void pictures_of_steps(void **state)
{
    (void)state;
    static const size_t ORDER[] = {2, 5, 0, 2, 4, 5};
    tl_view *view = NULL;
    tl_shown *shown = NULL;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = open_series(ctx, 0, -1);
    tl_scene *scene = view_scene(ctx, source, LINES);
    tl_renderer *renderer = picture_renderer(ctx);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
    tl_content *last = NULL;
    for (size_t i = 0; i < sizeof ORDER / sizeof *ORDER; i++) {
        tl_source *alone = NULL;
        set_step(ctx, scene, NUMBERS[ORDER[i]]);
        tl_content *content = view_build(ctx, view, scene);
        CHECK_EQ(tl_content_get_facts(content)->step, NUMBERS[ORDER[i]]);
        tl_image *image = view_draw(ctx, shown, content, scene);
        tl_content_destroy(ctx, last);
        last = content;
        tl_mesh *mesh = NULL;
        CHECK_OK(ctx, tl_mesh_read(ctx, series_path("view_steps", NUMBERS[ORDER[i]]), NULL, &mesh,
                                   NULL));
        CHECK_OK(ctx, tl_source_create(ctx, mesh, "alone", &alone));
        CHECK_OK(ctx, tl_source_set_step(ctx, alone, NUMBERS[ORDER[i]]));
        tl_image *expected = view_picture(ctx, alone, scene);
        CHECK(picture_same(image, expected));
        tl_image_destroy(ctx, expected);
        tl_image_destroy(ctx, image);
        tl_source_destroy(alone);
    }
    tl_shown_destroy(ctx, shown);
    tl_content_destroy(ctx, last);
    tl_renderer_destroy(ctx, renderer);
    tl_view_destroy(view);
    tl_scene_destroy(ctx, scene);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* Asks for a step, which reads it unless it is kept. */
static tl_status histogram(tl_ctx *ctx, tl_source *source, unsigned step)
{
    double bins[8], range[2];
    tl_scene *scene = view_scene(ctx, source, LINES);
    set_step(ctx, scene, step);
    tl_status st = tl_source_histogram(ctx, source, scene, "T", false, bins, 8, range);
    if (!st) CHECK(range[1] > range[0]);
    tl_scene_destroy(ctx, scene);
    return st;
}

/* Goes through all steps; returns the bytes that are kept then. */
static size_t visit(tl_ctx *ctx, tl_source *source)
{
    for (size_t i = 0; i < STEPS; i++) CHECK_OK(ctx, histogram(ctx, source, NUMBERS[i]));
    return tl_ctx_current_bytes(ctx);
}

static void steps_are_kept_as_memory_allows(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = open_series(ctx, 0, -1);
    const size_t one = tl_ctx_current_bytes(ctx), all = visit(ctx, source);
    CHECK(all > 5 * one);
    /* what is kept is not read again */
    CHECK_EQ(rename(series_path("view_steps", 30), "view_steps_away"), 0);
    CHECK_OK(ctx, histogram(ctx, source, 30));
    /* but all that nobody looks at can go, and comes back */
    CHECK(tl_source_trim(source));
    CHECK(!tl_source_trim(source));
    CHECK(tl_ctx_current_bytes(ctx) < one);
    CHECK_STATUS(histogram(ctx, source, 30), TL_ERR_IO);
    CHECK_EQ(rename("view_steps_away", series_path("view_steps", 30)), 0);
    CHECK_EQ(visit(ctx, source), all);
    /* where there is no room for all the oldest ones go */
    CHECK(tl_source_trim(source));
    tl_ctx_reset_peak(ctx);
    tl_ctx_set_budget(ctx, all - one);
    CHECK(visit(ctx, source) > one);
    CHECK(tl_ctx_peak_bytes(ctx) <= all - one);
    /* one alone does not fit: an error, and the next one that does */
    CHECK(tl_source_trim(source));
    tl_ctx_set_budget(ctx, one / 2);
    CHECK_STATUS(histogram(ctx, source, 10), TL_ERR_BUDGET);
    tl_ctx_set_budget(ctx, 0);
    CHECK_OK(ctx, histogram(ctx, source, 10));
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

static bool stop(void *user, const char *stage, uint64_t done, uint64_t total)
{
    (void)stage, (void)done, (void)total;
    return !*(bool *)user;
}

/* A step that is stopped while it is read leaves all as it was. */
static void reading_is_stopped(void **state)
{
    (void)state;
    bool is_stopped = false;
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 1;
    opts.progress = stop;
    opts.user = &is_stopped;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    tl_source *source = open_series(ctx, 0, 20);
    const size_t before = tl_ctx_current_bytes(ctx);
    is_stopped = true;
    CHECK_STATUS(histogram(ctx, source, 40), TL_ERR_CANCELLED);
    CHECK_EQ(tl_ctx_current_bytes(ctx), before);
    is_stopped = false;
    CHECK_OK(ctx, histogram(ctx, source, 40));
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_are_listed), cmocka_unit_test(pictures_of_steps),
        cmocka_unit_test(steps_are_kept_as_memory_allows), cmocka_unit_test(reading_is_stopped)};
    return cmocka_run_group_tests(tests, write_files, NULL);
}
