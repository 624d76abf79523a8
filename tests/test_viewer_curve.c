/* Axes and control points of the viewer's editors: places and values, hits, changes, and that
 * curves with fewer points stay close. */
#include "check.h"

#include "viewer/viewer_curve.h"

static const viewer_axis LINEAR = {{-2, 6}, false, 10, 200};
static const viewer_axis LOGARITHMIC = {{0.01, 1e4}, true, 10, 300};
static const double HAT[] = {0, 0, 1, 1, 2, 0};

static viewer_curve *hat(void)
{
    viewer_curve *curve = calloc(1, sizeof *curve);
    assert_non_null(curve);
    viewer_curve_set(curve, 2, HAT, 3);
    return curve;
}

/* ---- axes ---- */

static void places_and_values(void **state)
{
    (void)state;
    CHECK_NEAR(viewer_axis_px(&LINEAR, 0), 60, 1e-12);
    CHECK_NEAR(viewer_axis_px(&LOGARITHMIC, 1), 110, 1e-9);
    CHECK(viewer_axis_px(&LOGARITHMIC, 0) < -1e5);
    CHECK(viewer_axis_px(&LOGARITHMIC, -3) < -1e5);
    /* ends are exact, so that a point dragged to an end has its value */
    CHECK(viewer_axis_value(&LOGARITHMIC, 10) == 0.01);
    CHECK(viewer_axis_value(&LOGARITHMIC, 310) == 1e4);
    CHECK(viewer_axis_value(&LINEAR, 210) == 6);
    for (double px = 0; px <= 300; px += 7) {
        CHECK_NEAR(viewer_axis_px(&LINEAR, viewer_axis_value(&LINEAR, px)), px, 1e-9);
        CHECK_NEAR(viewer_axis_px(&LOGARITHMIC, viewer_axis_value(&LOGARITHMIC, px)), px, 1e-9);
    }
}

static void values_as_large_as_they_get(void **state)
{
    (void)state;
    const viewer_axis axis = {{-1.7e308, 1.7e308}, false, 0, 100};
    CHECK_NEAR(viewer_axis_px(&axis, 0), 50, 1e-9);
    CHECK_NEAR(viewer_axis_value(&axis, 50), 0, 1e293);
    CHECK(isfinite(viewer_axis_round(&axis, 1e300)));
}

static void steps_beside_a_value(void **state)
{
    (void)state;
    CHECK_NEAR(viewer_axis_beside(&LINEAR, 0, 25), 1, 1e-12);
    CHECK(viewer_axis_beside(&LINEAR, 5.99, 25) == 6);
    CHECK(viewer_axis_beside(&LINEAR, -1.99, -25) == -2);
    CHECK_NEAR(viewer_axis_beside(&LOGARITHMIC, 1, 50), 10, 1e-9);
}

static void zoom_and_pan(void **state)
{
    (void)state;
    static const double ALL[2] = {-4, 10}, POSITIVE[2] = {1e-3, 1e6};
    viewer_axis axis = LINEAR;
    const double held = viewer_axis_value(&axis, 60);
    viewer_axis_zoom(&axis, ALL, 0.25, 60);
    CHECK_NEAR(axis.range[1] - axis.range[0], 2, 1e-12);
    CHECK_NEAR(viewer_axis_value(&axis, 60), held, 1e-12);
    viewer_axis_pan(&axis, ALL, 30);
    CHECK_NEAR(viewer_axis_value(&axis, 90), held, 1e-12);
    viewer_axis_pan(&axis, ALL, 1e6);
    CHECK_NEAR(axis.range[0], -4, 1e-12);
    CHECK_NEAR(axis.range[1], -2, 1e-12);
    viewer_axis_zoom(&axis, ALL, 1e3, 60);
    CHECK(axis.range[0] == -4 && axis.range[1] == 10);
    for (int i = 0; i < 200; i++) viewer_axis_zoom(&axis, ALL, 0.5, 100);
    CHECK(axis.range[0] < axis.range[1]);
    CHECK(viewer_axis_value(&axis, 10) < viewer_axis_value(&axis, 210));
    axis = LOGARITHMIC;
    viewer_axis_zoom(&axis, POSITIVE, 0.5, 160);
    CHECK_NEAR(log10(axis.range[1] / axis.range[0]), 3, 1e-9);
    viewer_axis_pan(&axis, POSITIVE, -1e6);
    CHECK_NEAR(axis.range[1] / 1e6, 1, 1e-9);
}

static void round_values(void **state)
{
    (void)state;
    /* a pixel is 0.04, so hundredths do */
    CHECK(viewer_axis_round(&LINEAR, 0.33333) == 0.33);
    CHECK(viewer_axis_round(&LINEAR, 5.9999) == 6);
    for (double px = 0; px <= 300; px++) {
        const double value = viewer_axis_value(&LOGARITHMIC, 10 + px);
        const double rounded = viewer_axis_round(&LOGARITHMIC, value);
        CHECK_NEAR(viewer_axis_px(&LOGARITHMIC, rounded), 10 + px, 0.5);
    }
}

/* ---- control points ---- */

static void values_of_a_curve(void **state)
{
    (void)state;
    viewer_curve *curve = hat();
    double at;
    viewer_curve_at(curve, false, 0.25, &at);
    CHECK_NEAR(at, 0.25, 1e-15);
    viewer_curve_at(curve, false, -5, &at);
    CHECK(at == 0);
    viewer_curve_at(curve, false, 1, &at);
    CHECK(at == 1);
    const double decades[] = {1, 0, 100, 1}, step[] = {0, 0, 1, 0.2, 1, 0.8, 2, 0.8};
    viewer_curve_set(curve, 2, decades, 2);
    viewer_curve_at(curve, true, 10, &at);
    CHECK_NEAR(at, 0.5, 1e-15);
    viewer_curve_set(curve, 2, step, 4);
    viewer_curve_at(curve, false, 1, &at);
    CHECK(at == 0.8);
    viewer_curve_at(curve, false, nextafter(1, 0), &at);
    CHECK_NEAR(at, 0.2, 1e-12);
    curve->count = 0;
    viewer_curve_at(curve, false, 1, &at);
    CHECK(at == 0);
    free(curve);
}

static void points_come_and_go(void **state)
{
    (void)state;
    viewer_curve *curve = hat();
    double before, after;
    viewer_curve_at(curve, false, 1.7, &before);
    CHECK_EQ(viewer_curve_add(curve, false, 1.5), 2);
    CHECK_EQ(curve->count, 4);
    viewer_curve_at(curve, false, 1.7, &after);
    CHECK_NEAR(after, before, 1e-15);
    CHECK(viewer_curve_row(curve, 3)[0] == 2);
    CHECK(viewer_curve_remove(curve, 2));
    CHECK(memcmp(curve->rows, HAT, sizeof HAT) == 0);
    CHECK_EQ(viewer_curve_add(curve, false, -1), 0);
    CHECK_EQ(viewer_curve_add(curve, false, 9), 4);
    CHECK(!viewer_curve_remove(curve, 5));
    while (curve->count > 1) CHECK(viewer_curve_remove(curve, 0));
    CHECK(!viewer_curve_remove(curve, 0));
    CHECK(curve->rows[0] == 9);
    free(curve);
}

static void no_room_is_said(void **state)
{
    (void)state;
    viewer_curve *curve = hat();
    for (size_t i = curve->count; i < VIEWER_CURVE_POINTS_MAX; i++)
        CHECK(viewer_curve_add(curve, false, 1) != VIEWER_CURVE_NONE);
    CHECK_EQ(viewer_curve_add(curve, false, 1), VIEWER_CURVE_NONE);
    CHECK_EQ(curve->count, VIEWER_CURVE_POINTS_MAX);
    free(curve);
}

static void neighbours_are_not_passed(void **state)
{
    (void)state;
    viewer_curve *curve = hat();
    CHECK(viewer_curve_move(curve, 1, 7) == 2);
    CHECK(viewer_curve_move(curve, 1, -7) == 0);
    CHECK(viewer_curve_move(curve, 1, 1.25) == 1.25);
    CHECK(viewer_curve_move(curve, 0, -7) == -7);
    CHECK(viewer_curve_move(curve, 2, 70) == 70);
    free(curve);
}

static void points_are_hit(void **state)
{
    (void)state;
    viewer_curve *curve = hat();
    const viewer_axis axis = {{0, 2}, false, 0, 200};
    const double top[2] = {104, 3}, foot[2] = {104, 97}, left[2] = {-5, 100}, apart[2] = {140, 3};
    CHECK_EQ(viewer_curve_hit(curve, &axis, 100, 100, top, 6), 1);
    CHECK_EQ(viewer_curve_hit(curve, &axis, 100, 100, foot, 6), VIEWER_CURVE_NONE);
    CHECK_EQ(viewer_curve_hit(curve, &axis, 100, 0, foot, 6), 1);
    CHECK_EQ(viewer_curve_hit(curve, &axis, 100, 100, left, 6), 0);
    CHECK_EQ(viewer_curve_hit(curve, &axis, 100, 100, apart, 6), VIEWER_CURVE_NONE);
    viewer_curve_move(curve, 1, 2);
    viewer_curve_row(curve, 1)[1] = 0; /* two at one place */
    const double end[2] = {200, 100};
    CHECK_EQ(viewer_curve_hit(curve, &axis, 100, 100, end, 6), 2);
    free(curve);
}

/* As many points as a scene keeps: a change of one of them loses none. */
static void lists_of_scenes_fit(void **state)
{
    (void)state;
    static double rows[2 * TL_SCENE_ROWS_MAX];
    viewer_curve *curve = hat();
    for (size_t i = 0; i < TL_SCENE_ROWS_MAX; i++) rows[2 * i] = (double)i;
    viewer_curve_set(curve, 2, rows, TL_SCENE_ROWS_MAX);
    CHECK_EQ(curve->count, TL_SCENE_ROWS_MAX);
    viewer_curve_move(curve, 1, 1.5);
    CHECK(viewer_curve_row(curve, TL_SCENE_ROWS_MAX - 1)[0] == TL_SCENE_ROWS_MAX - 1);
    CHECK(viewer_curve_add(curve, false, 2.5) == VIEWER_CURVE_NONE);
    CHECK(viewer_curve_remove(curve, 1));
    CHECK_EQ(viewer_curve_add(curve, false, 2.5), 2);
    free(curve);
}

static void ranges_are_stretched(void **state)
{
    (void)state;
    viewer_curve *curve = hat();
    viewer_curve_stretch(curve, false, (double[]){0, 2}, (double[]){10, 30});
    CHECK(viewer_curve_row(curve, 0)[0] == 10);
    CHECK_NEAR(viewer_curve_row(curve, 1)[0], 20, 1e-12);
    CHECK(viewer_curve_row(curve, 2)[0] == 30);
    viewer_curve_stretch(curve, true, (double[]){10, 30}, (double[]){1, 9});
    CHECK_NEAR(viewer_curve_row(curve, 1)[0], pow(9, log(2) / log(3)), 1e-12);
    free(curve);
}

static void fewer_points_stay_close(void **state)
{
    (void)state;
    viewer_curve *fine = hat(), *thin = hat();
    const double tolerance = 0.01;
    double worst = 0;
    fine->count = 0;
    for (size_t i = 0; i < VIEWER_CURVE_POINTS_MAX; i++) {
        const double x = (double)i / (VIEWER_CURVE_POINTS_MAX - 1);
        const double row[2] = {x, 0.5 + 0.5 * sin(12 * x)};
        memcpy(viewer_curve_row(fine, fine->count++), row, sizeof row);
    }
    *thin = *fine;
    viewer_curve_thin(thin, false, tolerance);
    for (size_t i = 0; i < fine->count; i++) {
        double at;
        viewer_curve_at(thin, false, viewer_curve_row(fine, i)[0], &at);
        worst = fmax(worst, fabs(at - viewer_curve_row(fine, i)[1]));
    }
    printf("%zu of %zu points\n", thin->count, fine->count);
    CHECK_BOUND("largest difference", worst, tolerance);
    CHECK(thin->count < 40);
    viewer_curve_thin(thin, false, 2); /* both ends always stay */
    CHECK_EQ(thin->count, 2);
    CHECK(viewer_curve_row(thin, 1)[0] == 1);
    free(fine);
    free(thin);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(places_and_values),
        cmocka_unit_test(values_as_large_as_they_get),
        cmocka_unit_test(steps_beside_a_value),
        cmocka_unit_test(zoom_and_pan),
        cmocka_unit_test(round_values),
        cmocka_unit_test(values_of_a_curve),
        cmocka_unit_test(points_come_and_go),
        cmocka_unit_test(no_room_is_said),
        cmocka_unit_test(neighbours_are_not_passed),
        cmocka_unit_test(points_are_hit),
        cmocka_unit_test(lists_of_scenes_fit),
        cmocka_unit_test(ranges_are_stretched),
        cmocka_unit_test(fewer_points_stay_close),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
