/* The lines of a frozen camera's frustum: seen by that camera they are the frame of its picture and
 * its middle; they reach as far as the box. */
#include "check.h"

#include "view/view_frustum.h"

#include "check_view.h"
#include "fail_alloc.h"

static const double BOX[6] = {-1, 2, 0, 1, 0, 3};

static tl_camera make_camera(bool parallel)
{
    tl_camera c = tl_camera_defaults();
    const double position[3] = {7, -9, 4}, focal[3] = {0.5, 0.5, 1}, up[3] = {0, 0.2, 1};
    memcpy(c.position, position, sizeof position);
    memcpy(c.focal_point, focal, sizeof focal);
    memcpy(c.view_up, up, sizeof up);
    c.parallel_scale = parallel ? 2 : 0;
    c.size_px[0] = 640;
    c.size_px[1] = 480;
    return c;
}

static void test_frame(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    for (int parallel = 0; parallel < 2; parallel++) {
        tl_polydata *lines = NULL;
        const tl_camera camera = make_camera(parallel);
        double nearest = INFINITY, farthest = -INFINITY, px[2], distance;
        CHECK_OK(ctx, tli_frustum_lines(ctx, &camera, BOX, &lines));
        CHECK_EQ(lines->cell_count, 12);
        for (int corner = 0; corner < 8; corner++) {
            const double at[3] = {BOX[corner & 1], BOX[2 + (corner >> 1 & 1)],
                                  BOX[4 + (corner >> 2)]};
            CHECK(tl_camera_project(&camera, at, px, &distance));
            nearest = fmin(nearest, distance);
            farthest = fmax(farthest, distance);
        }
        for (size_t v = 4; v < 12; v++) {
            CHECK(tl_camera_project(&camera, lines->xyz + 3 * v, px, &distance));
            CHECK_NEAR(fabs(px[0] - 320), 320, 0.01);
            CHECK_NEAR(fabs(px[1] - 240), 240, 0.01);
            CHECK_NEAR(distance, v < 8 ? nearest : farthest, 1e-9);
        }
        for (size_t v = 0; v < 4; v++) /* at the eye, or where the box begins */
            for (size_t k = 0; k < 3; k++)
                CHECK_NEAR(lines->xyz[3 * v + k],
                           parallel ? lines->xyz[3 * (v + 4) + k] : camera.position[k], 1e-9);
        tl_polydata_destroy(ctx, lines);
    }
    check_ctx_destroy(ctx);
}

/* The camera stands in the box: nothing is behind it. */
static void test_inside(void **state)
{
    (void)state;
    double px[2], distance;
    tl_polydata *lines = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    tl_camera camera = make_camera(false);
    const double inside[3] = {0, 0.5, 1};
    memcpy(camera.position, inside, sizeof inside);
    CHECK_OK(ctx, tli_frustum_lines(ctx, &camera, BOX, &lines));
    for (size_t v = 0; v < 8; v++)
        for (size_t k = 0; k < 3; k++) CHECK_NEAR(lines->xyz[3 * v + k], inside[k], 1e-12);
    for (size_t v = 8; v < 12; v++)
        CHECK(tl_camera_project(&camera, lines->xyz + 3 * v, px, &distance));
    tl_polydata_destroy(ctx, lines);
    memcpy(camera.focal_point, inside, sizeof inside);
    CHECK_STATUS(tli_frustum_lines(ctx, &camera, BOX, &lines), TL_ERR_ARG);
    CHECK(!lines);
    check_ctx_destroy(ctx);
}

/* They are there while a cut that was frozen is looked at from elsewhere. */
static void test_frozen_cut(void **state)
{
    static const char *const LINES[] = {"add boundary", "set detail.frozen on", NULL};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_model(ctx, 10);
    tl_scene *scene = view_scene(ctx, source, LINES);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *same = view_build(ctx, view, scene);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "view 100,40"));
    tl_content *elsewhere = view_build(ctx, view, scene);
    CHECK(elsewhere->body == same->body);
    CHECK_EQ(elsewhere->thing_count, same->thing_count + 1);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.frozen off"));
    tl_content *after = view_build(ctx, view, scene);
    CHECK_EQ(after->thing_count, same->thing_count);
    tl_content_destroy(ctx, after);
    tl_content_destroy(ctx, elsewhere);
    view_close(ctx, same, view, scene, source);
}

static tl_status try_lines(tl_ctx *ctx, void *arg)
{
    tl_polydata *lines = NULL;
    const tl_camera camera = make_camera(false);
    (void)arg;
    tl_status st = tli_frustum_lines(ctx, &camera, BOX, &lines);
    tl_polydata_destroy(ctx, lines);
    return st;
}

static void test_allocation_failures(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, try_lines, NULL) > 1);
    fail_alloc_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_frame),
        cmocka_unit_test(test_inside),
        cmocka_unit_test(test_frozen_cut),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
