/* How cameras move: angles and distances that stay, points that stay under the pointer, no trouble
 * at the ends of a turntable's axis; cameras of scenes, views in words. */
#include "check_scene.h"

#include "base/base_vec.h"
#include "make_mesh.h"

enum { CAMERAS = 200, WIDTH = 640, HEIGHT = 400 };
/* Of lengths, relative; of pixels. */
static const double SAME = 1e-12, SAME_PX = 1e-8;

static double random_part(uint64_t *seed)
{
    return 2 * make_uniform(seed) - 1;
}

static tl_camera random_camera(uint64_t *seed, bool parallel)
{
    tl_camera c = tl_camera_defaults();
    for (int k = 0; k < 3; k++) {
        c.position[k] = 10 * random_part(seed);
        c.focal_point[k] = 10 * random_part(seed);
        c.view_up[k] = random_part(seed);
    }
    c.view_angle = 5 + 100 * make_uniform(seed);
    c.parallel_scale = parallel ? 1 + make_uniform(seed) : 0;
    c.size_px[0] = WIDTH;
    c.size_px[1] = HEIGHT;
    return c;
}

static double distance(const double a[3], const double b[3])
{
    double from[3];
    vec_sub(a, b, from);
    return vec_length(from);
}

/* Where a point is on the picture is that of the renderer: through the corners and the middle. */
static void rays_and_places_agree(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < CAMERAS; i++) {
        const tl_camera c = random_camera(&seed, i % 2);
        const double px[2] = {WIDTH * make_uniform(&seed), HEIGHT * make_uniform(&seed)};
        double origin[3], direction[3], point[3], again[2], along, view[3];
        tl_camera_ray(&c, px[0], px[1], origin, direction);
        CHECK_NEAR(vec_length(direction), 1, SAME);
        for (int k = 0; k < 3; k++) point[k] = origin[k] + 7 * direction[k];
        CHECK(tl_camera_project(&c, point, again, &along));
        CHECK_NEAR(again[0], px[0], SAME_PX);
        CHECK_NEAR(again[1], px[1], SAME_PX);
        vec_sub(c.focal_point, c.position, view);
        CHECK_NEAR(along, 7 * vec_dot(direction, view) / vec_length(view), 1e-10);
        CHECK(tl_camera_project(&c, c.focal_point, again, &along));
        CHECK_NEAR(again[0], WIDTH / 2.0, SAME_PX);
        CHECK_NEAR(along, vec_length(view), 1e-10);
        for (int k = 0; k < 3; k++) point[k] = 2 * c.position[k] - c.focal_point[k];
        CHECK_EQ(tl_camera_project(&c, point, again, &along), i % 2); /* behind */
    }
    /* half a height at the distance of the focal point is the upper edge */
    tl_camera c = tl_camera_defaults();
    double px[2], along;
    const double above[3] = {0, tan(15 * acos(-1) / 180), 0};
    CHECK(tl_camera_project(&c, above, px, &along));
    CHECK_NEAR(px[1], 0, SAME_PX);
    CHECK_NEAR(along, 1, SAME);
}

static void orbits_keep_distance_and_angle(void **state)
{
    (void)state;
    uint64_t seed = 2;
    for (int i = 0; i < CAMERAS; i++) {
        tl_camera c = random_camera(&seed, i % 3 == 0);
        double pivot[3], px[2], along, from[3], to[3];
        for (int k = 0; k < 3; k++) pivot[k] = 5 * random_part(&seed);
        for (int turn = 0; turn < 10; turn++) {
            const tl_camera before = c;
            double was[2];
            const bool seen = tl_camera_project(&c, pivot, was, &along);
            tl_camera_orbit(&c, pivot, 360 * random_part(&seed), 360 * random_part(&seed),
                            i % 2 ? TL_ORBIT_TRACKBALL : TL_ORBIT_TURNTABLE, NULL);
            CHECK_NEAR(distance(c.position, pivot), distance(before.position, pivot), 1e-10);
            CHECK_NEAR(distance(c.position, c.focal_point),
                       distance(before.position, before.focal_point), 1e-10);
            CHECK_EQ(tl_camera_project(&c, pivot, px, &along), seen);
            if (!seen) continue;
            CHECK_NEAR(px[0], was[0], 1e-6); /* what is turned around stays where it is seen */
            CHECK_NEAR(px[1], was[1], 1e-6);
        }
        /* by so many degrees around the picture's own directions */
        const double angle = 170 * make_uniform(&seed);
        vec_sub(c.position, c.focal_point, from);
        tl_camera_orbit(&c, NULL, i % 2 ? angle : 0, i % 2 ? 0 : angle, TL_ORBIT_TRACKBALL, NULL);
        vec_sub(c.position, c.focal_point, to);
        CHECK_NEAR(vec_dot(from, to) / vec_dot(from, from), cos(angle * acos(-1) / 180), 1e-10);
    }
}

/* Right is right, up is up. */
static void orbits_go_where_they_should(void **state)
{
    (void)state;
    static const double BOX[6] = {-1, 1, -1, 1, -1, 1};
    for (int style = 0; style < 2; style++) {
        tl_camera c = tl_camera_fit(BOX, 0, 0, 1, WIDTH, HEIGHT), to;
        tl_camera_orbit(&c, NULL, 30, 0, style, NULL);
        to = tl_camera_fit(BOX, 30, 0, 1, WIDTH, HEIGHT);
        CHECK_NEAR(distance(c.position, to.position), 0, 1e-12);
        tl_camera_orbit(&c, NULL, 0, 20, style, NULL);
        to = tl_camera_fit(BOX, 30, 20, 1, WIDTH, HEIGHT);
        CHECK_NEAR(distance(c.position, to.position), 0, 1e-12);
        CHECK_NEAR(distance(c.view_up, to.view_up), 0, 1e-12);
    }
}

/* However wildly the turntable is turned, the horizon stays level and the camera the right way up;
 * from an end of the axis it comes back. */
static void turntables_have_no_gimbal(void **state)
{
    (void)state;
    static const double BOX[6] = {-1, 1, -1, 1, -1, 1};
    uint64_t seed = 3;
    tl_camera c = tl_camera_fit(BOX, 0, 0, 1, WIDTH, HEIGHT);
    const double start = distance(c.position, c.focal_point);
    size_t ends = 0;
    for (int i = 0; i < 20000; i++) {
        double view[3], right[3];
        tl_camera_orbit(&c, NULL, 90 * random_part(&seed), 90 * random_part(&seed),
                        TL_ORBIT_TURNTABLE, NULL);
        vec_sub(c.focal_point, c.position, view);
        vec_cross(view, c.view_up, right);
        const double length = vec_length(view);
        ends += fabs(view[2]) / length > 1 - 1e-12;
        CHECK_NEAR(right[2] / length, 0, 1e-9);
        CHECK(c.view_up[2] > -1e-9);
        CHECK_NEAR(length, start, 1e-9);
    }
    printf("at an end of the axis %zu times of 20000\n", ends);
    CHECK(ends > 1000);
    c = tl_camera_fit(BOX, 40, 10, 1, WIDTH, HEIGHT);
    const tl_camera before = c;
    tl_camera_orbit(&c, NULL, 0, 1000, TL_ORBIT_TURNTABLE, NULL);
    tl_camera_orbit(&c, NULL, 50, 0, TL_ORBIT_TURNTABLE, NULL); /* seen from above, turned */
    tl_camera_orbit(&c, NULL, -50, 0, TL_ORBIT_TURNTABLE, NULL);
    tl_camera_orbit(&c, NULL, 0, -80, TL_ORBIT_TURNTABLE, NULL);
    CHECK_NEAR(distance(c.position, before.position), 0, 1e-9);
    CHECK_NEAR(distance(c.view_up, before.view_up), 0, 1e-9);
    /* upside down it stays so, and right is right on the picture still */
    c.view_up[0] *= -1, c.view_up[1] *= -1, c.view_up[2] *= -1;
    double px[2], along;
    tl_camera_orbit(&c, NULL, 5, 0, TL_ORBIT_TURNTABLE, NULL);
    CHECK(c.view_up[2] < 0);
    tl_camera moved = before;
    moved.view_up[0] *= -1, moved.view_up[1] *= -1, moved.view_up[2] *= -1;
    CHECK(tl_camera_project(&moved, c.position, px, &along) && px[0] > WIDTH / 2.0);
    /* another axis */
    const double y[3] = {0, 1e-200, 0};
    c = tl_camera_defaults();
    tl_camera_orbit(&c, NULL, 90, 0, TL_ORBIT_TURNTABLE, y);
    CHECK_NEAR(c.position[0], 1, SAME);
    CHECK_NEAR(c.position[1], 0, SAME);
}

static void zooms_keep_the_point_under_the_pointer(void **state)
{
    (void)state;
    uint64_t seed = 4;
    for (int i = 0; i < CAMERAS; i++) {
        tl_camera c = random_camera(&seed, i % 2);
        const tl_camera before = c;
        const double px[2] = {WIDTH * make_uniform(&seed), HEIGHT * make_uniform(&seed)};
        const double factor = exp(3 * random_part(&seed));
        double origin[3], direction[3], point[3], now[2], along, was;
        tl_camera_ray(&c, px[0], px[1], origin, direction);
        for (int k = 0; k < 3; k++) point[k] = origin[k] + 5 * direction[k];
        tl_camera_project(&c, point, now, &was);
        tl_camera_zoom(&c, factor, point);
        CHECK(tl_camera_project(&c, point, now, &along));
        CHECK_NEAR(now[0], px[0], SAME_PX);
        CHECK_NEAR(now[1], px[1], SAME_PX);
        if (i % 2)
            CHECK_NEAR(c.parallel_scale * factor, before.parallel_scale, SAME);
        else
            CHECK_NEAR(along * factor, was, 1e-10);
        /* and back */
        tl_camera_zoom(&c, 1 / factor, point);
        CHECK_NEAR(distance(c.position, before.position), 0, 1e-10);
        CHECK_NEAR(distance(c.focal_point, before.focal_point), 0, 1e-10);
        /* the same of a pixel, at the distance of the focal point */
        const double d = distance(c.position, c.focal_point);
        tl_camera_ray(&c, px[0], px[1], origin, direction);
        tl_camera_zoom_px(&c, 2, px[0], px[1]);
        if (i % 2 == 0) CHECK_NEAR(distance(c.position, c.focal_point), d / 2, 1e-10);
        tl_camera_zoom_px(&c, 0.5, px[0], px[1]);
        CHECK_NEAR(distance(c.position, before.position), 0, 1e-9);
    }
    /* however often, the camera looks somewhere */
    tl_ctx *ctx = check_ctx_create(1);
    for (int out = 0; out < 2; out++)
        for (int parallel = 0; parallel < 2; parallel++) {
            tl_camera c = random_camera(&seed, parallel);
            for (int i = 0; i < 5000; i++) tl_camera_zoom_px(&c, out ? 0.7 : 1.4, 10, 390);
            CHECK_OK(ctx, tl_camera_check(ctx, &c));
        }
    check_ctx_destroy(ctx);
}

static void pans_follow_the_pointer(void **state)
{
    (void)state;
    uint64_t seed = 5;
    for (int i = 0; i < CAMERAS; i++) {
        tl_camera c = random_camera(&seed, i % 2);
        double px[2], now[2], along, origin[3], direction[3], point[3];
        tl_camera_ray(&c, 100, 300, origin, direction);
        for (int k = 0; k < 3; k++) point[k] = origin[k] + 4 * direction[k];
        tl_camera_project(&c, point, px, &along);
        tl_camera_pan(&c, 31, -17, along);
        tl_camera_project(&c, point, now, &along);
        CHECK_NEAR(now[0], px[0] + 31, SAME_PX);
        CHECK_NEAR(now[1], px[1] - 17, SAME_PX);
        const tl_camera before = c;
        tl_camera_pan(&c, 8, 0, 0);
        tl_camera_project(&c, before.focal_point, now, &along);
        CHECK_NEAR(now[0], WIDTH / 2.0 + 8, SAME_PX);
    }
}

static void spins_rolls_and_flights(void **state)
{
    (void)state;
    uint64_t seed = 6;
    for (int i = 0; i < CAMERAS; i++) {
        tl_camera c = random_camera(&seed, false);
        const tl_camera before = c;
        double px[2], along, axis[3], pivot[3], right[3];
        for (int k = 0; k < 3; k++) axis[k] = random_part(&seed), pivot[k] = random_part(&seed);
        for (int step = 0; step < 12; step++) tl_camera_spin(&c, pivot, axis, 30);
        CHECK_NEAR(distance(c.position, before.position), 0, 1e-11);
        CHECK_NEAR(distance(c.view_up, before.view_up), 0, 1e-12);
        /* a point to the right of the middle is below it after a quarter turn clockwise */
        tl_camera_ray(&c, WIDTH / 2.0 + 100, HEIGHT / 2.0, pivot, right);
        for (int k = 0; k < 3; k++) right[k] += c.position[k];
        tl_camera_roll(&c, 90);
        CHECK(tl_camera_project(&c, right, px, &along));
        CHECK_NEAR(px[0], WIDTH / 2.0, SAME_PX);
        CHECK_NEAR(px[1], HEIGHT / 2.0 + 100, SAME_PX);
        /* forward: towards what is in the middle */
        c = before;
        const double d = distance(c.position, c.focal_point);
        tl_camera_fly(&c, NULL, 0, 0, (const double[3]){d, 0, 0});
        CHECK_NEAR(distance(c.position, before.focal_point), 0, 1e-10);
        CHECK_NEAR(distance(c.position, c.focal_point), d, 1e-10);
    }
    /* turning to the right, what was in the middle goes left; up: down */
    static const double BOX[6] = {-1, 1, -1, 1, -1, 1}, NONE[3] = {0, 0, 0};
    tl_camera c = tl_camera_fit(BOX, 30, 20, 1, WIDTH, HEIGHT);
    double px[2], along;
    tl_camera_fly(&c, NULL, 3, 2, NONE);
    CHECK(tl_camera_project(&c, NONE, px, &along) && px[0] < WIDTH / 2.0 && px[1] > HEIGHT / 2.0);
    tl_camera_fly(&c, NULL, 0, 0, (const double[3]){0, 1, 1});
    double after[2];
    tl_camera_project(&c, NONE, after, &along);
    CHECK(after[0] < px[0] && after[1] > px[1]);
}

static void parallel_and_back(void **state)
{
    (void)state;
    uint64_t seed = 7;
    for (int i = 0; i < CAMERAS; i++) {
        tl_camera c = random_camera(&seed, false);
        const tl_camera before = c;
        double px[2], now[2], along, origin[3], direction[3], aside[3];
        /* a point beside the focal point is where it was */
        tl_camera_ray(&c, WIDTH / 2.0, 0, origin, direction);
        double view[3];
        vec_sub(c.focal_point, c.position, view);
        const double d = vec_length(view), t = d * d / vec_dot(direction, view);
        for (int k = 0; k < 3; k++) aside[k] = origin[k] + t * direction[k];
        tl_camera_project(&c, aside, px, &along);
        tl_camera_set_parallel(&c, true);
        CHECK(c.parallel_scale > 0);
        tl_camera_project(&c, aside, now, &along);
        CHECK_NEAR(now[1], px[1], SAME_PX);
        tl_camera_set_parallel(&c, false);
        CHECK(c.parallel_scale == 0);
        CHECK_NEAR(distance(c.position, before.position), 0, 1e-10);
    }
}

/* A camera that looks nowhere, and numbers that are none, change nothing. */
static void nonsense_changes_nothing(void **state)
{
    (void)state;
    static const double ZERO[3] = {0, 0, 0}, HUGE_AXIS[3] = {0, 0, 1e300};
    const double nan = (double)NAN;
    for (int i = 0; i < 3; i++) {
        tl_camera c = tl_camera_defaults();
        if (i == 0) memcpy(c.focal_point, c.position, sizeof c.position);
        if (i == 1) memcpy(c.view_up, (const double[3]){0, 0, 1}, sizeof c.view_up);
        const tl_camera before = c;
        const double n = i < 2 ? 10 : nan;
        tl_camera_orbit(&c, NULL, n, n, TL_ORBIT_TURNTABLE, HUGE_AXIS);
        tl_camera_orbit(&c, NULL, n, 0, TL_ORBIT_TRACKBALL, NULL);
        tl_camera_pan(&c, n, n, 0);
        tl_camera_zoom(&c, n, NULL);
        tl_camera_zoom(&c, -1, NULL);
        tl_camera_zoom_px(&c, n, n, n);
        tl_camera_roll(&c, n);
        tl_camera_spin(&c, ZERO, ZERO, 10);
        tl_camera_fly(&c, NULL, n, n, ZERO);
        if (i < 2) tl_camera_set_parallel(&c, true);
        CHECK(memcmp(&c, &before, sizeof c) == 0);
    }
}

/* ---- views in words, cameras of scenes ---- */

static void views_are_read(void **state)
{
    (void)state;
    double view[3] = {7, 7, 7};
    CHECK(tl_view_read("-30,20.5,2", view) && view[0] == -30 && view[1] == 20.5 && view[2] == 2);
    CHECK(tl_view_read("1,2", view) && view[2] == 1);
    CHECK(tl_view_read("+x", view) && view[0] == 90 && view[1] == 0);
    CHECK(tl_view_read("-z,3", view) && view[1] == -90 && view[2] == 3);
    static const char *const WRONG[] = {"",       "1",       "x",     "+x,",     "+x,0", "+x3",
                                        "1,2,-1", "1,2,3,4", "nan,0", "iso,1,2", "1;2"};
    for (size_t i = 0; i < sizeof WRONG / sizeof *WRONG; i++) CHECK(!tl_view_read(WRONG[i], view));
    CHECK(view[2] == 3);
}

static void scenes_have_cameras(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    tl_camera c, to;
    CHECK_OK(ctx, tl_scene_set_frame(ctx, s, WIDTH, HEIGHT, NULL));
    tl_scene_camera(s, WIDTH, HEIGHT, &c); /* fitted: all corners are seen */
    CHECK_OK(ctx, tl_camera_check(ctx, &c));
    for (size_t i = 0; i < 8; i++) {
        double corner[3], px[2], along;
        for (size_t k = 0; k < 3; k++) corner[k] = CHECK_SCENE_BOUNDS[2 * k + (i >> k & 1)];
        CHECK(tl_camera_project(&c, corner, px, &along));
        CHECK(px[0] > -SAME_PX && px[0] < WIDTH + SAME_PX && px[1] > -SAME_PX &&
              px[1] < HEIGHT + SAME_PX);
    }
    CHECK_OK(ctx, tl_scene_do(ctx, s, "view 30,20"));
    tl_scene_camera(s, WIDTH, HEIGHT, &to);
    CHECK(memcmp(&c, &to, sizeof c) == 0);
    /* what is set comes back, all of it as one step */
    uint64_t seed = 8;
    for (int i = 0; i < 20; i++) {
        c = random_camera(&seed, i % 2);
        CHECK_OK(ctx, tl_scene_set_camera(ctx, s, &c));
        tl_scene_camera(s, WIDTH, HEIGHT, &to);
        CHECK(memcmp(&c, &to, sizeof c) == 0);
    }
    CHECK(strcmp(tl_scene_undo_name(s), "set camera") == 0);
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(!tl_scene_undo_name(s));
    /* fit keeps the directions; zoom does not pile up */
    CHECK_OK(ctx, tl_scene_set_camera(ctx, s, &c));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "fit"));
    tl_scene_camera(s, WIDTH, HEIGHT, &to);
    double a[3], b[3], across[3];
    vec_sub(c.focal_point, c.position, a);
    vec_sub(to.focal_point, to.position, b);
    vec_cross(a, b, across);
    CHECK_NEAR(vec_length(across) / vec_length(a) / vec_length(b), 0, 1e-9);
    CHECK_OK(ctx, tl_scene_do(ctx, s, "view iso,4"));
    tl_scene_camera(s, WIDTH, HEIGHT, &c);
    CHECK_OK(ctx, tl_scene_do(ctx, s, "view iso,4"));
    tl_scene_camera(s, WIDTH, HEIGHT, &to);
    CHECK(memcmp(&c, &to, sizeof c) == 0);
    /* a parallel one without a scale shows what perspective does at the focal point */
    CHECK_OK(ctx, tl_scene_do(ctx, s, "set camera.position 0 -10 0"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "set camera.focal_point 0 0 0"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "set camera.view_angle 60"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "set camera.parallel_scale 0"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "set camera.parallel on"));
    tl_scene_camera(s, WIDTH, HEIGHT, &c);
    CHECK_NEAR(c.parallel_scale, 10 * tan(acos(-1) / 6), 1e-12);
    memcpy(c.focal_point, c.position, sizeof c.position);
    CHECK_STATUS(tl_scene_set_camera(ctx, s, &c), TL_ERR_ARG);
    const double wrong[6] = {0, 1, 1, 0, 0, 1}, window[4] = {0, 0, -1, 1};
    CHECK_STATUS(tl_scene_set_bounds(ctx, s, wrong), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_set_frame(ctx, s, 0, 1, NULL), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_set_frame(ctx, s, 1, 1, window), TL_ERR_ARG);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

/* All corners of a box are in the picture, the farthest one near its edge; a zoom brings some out.
 */
static void boxes_fit(void **state)
{
    (void)state;
    const double bounds[6] = {-1, 3, 2, 3, 5, 11}, view[3] = {35, 20, 1};
    for (int i = 0; i < 4; i++) {
        tl_camera c = tl_camera_defaults();
        c.size_px[0] = WIDTH;
        c.size_px[1] = HEIGHT;
        if (i & 1) tl_camera_set_parallel(&c, true);
        tl_camera_stand(&c, view, bounds, NULL);
        if (i & 2) tl_camera_fit_box(&c, bounds, NULL, 2);
        double out = -INFINITY; /* beyond the nearest edge, parts of the picture */
        for (int corner = 0; corner < 8; corner++) {
            double xyz[3], px[2], depth;
            for (int k = 0; k < 3; k++) xyz[k] = bounds[2 * k + (corner >> k & 1)];
            CHECK(tl_camera_project(&c, xyz, px, &depth));
            out = fmax(out, fmax(fabs(px[0] / WIDTH - 0.5), fabs(px[1] / HEIGHT - 0.5)) - 0.5);
        }
        CHECK(i & 2 ? out > 0 : out <= 1e-9 && out > -0.1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_and_places_agree),
        cmocka_unit_test(orbits_keep_distance_and_angle),
        cmocka_unit_test(orbits_go_where_they_should),
        cmocka_unit_test(turntables_have_no_gimbal),
        cmocka_unit_test(zooms_keep_the_point_under_the_pointer),
        cmocka_unit_test(pans_follow_the_pointer),
        cmocka_unit_test(spins_rolls_and_flights),
        cmocka_unit_test(parallel_and_back),
        cmocka_unit_test(nonsense_changes_nothing),
        cmocka_unit_test(views_are_read),
        cmocka_unit_test(boxes_fit),
        cmocka_unit_test(scenes_have_cameras),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
