/* Files of others: ParaView's transfer functions into scenes and out again, VTK's cameras; what is
 * wrong in them, every prefix of them, failing memory. That their colours are those of ParaView is
 * the business of transfer_test.py. */
#include "check_scene.h"

#include "fail_alloc.h"
#include "make_mesh.h"

static void write_text(const char *path, const char *text, size_t bytes)
{
    FILE *file = fopen(path, "wb");
    CHECK(file && fwrite(text, 1, bytes, file) == bytes && fclose(file) == 0);
}

static void write_file(const char *path, const char *text)
{
    write_text(path, text, strlen(text));
}

/* Colour times opacity, and opacity, of straight points [count][numbers + 1] at a value. */
static double point_at(const double *points, size_t count, size_t stride, size_t k, double value)
{
    size_t i = 0;
    while (i < count && points[i * stride] <= value) i++;
    if (i == 0 || i == count) return points[(i ? count - 1 : 0) * stride + k];
    const double *a = points + (i - 1) * stride, *b = a + stride;
    return a[k] + (value - a[0]) / (b[0] - a[0]) * (b[k] - a[k]);
}

/* No value between is more opaque, and an error below what is promised does not show. */
static void what_is_visible_holds(void **state)
{
    (void)state;
    enum { POINTS = 6, ROUNDS = 200, SAMPLES = 60 };
    uint64_t seed = 21;
    double shown = 0;
    tl_color_point colors[POINTS];
    tl_opacity_point opacities[POINTS];
    for (int round = 0; round < ROUNDS; round++) {
        double opacity, unseen, at[2] = {0, 0};
        for (int i = 0; i < POINTS; i++) {
            colors[i].value = at[0] += make_uniform(&seed);
            opacities[i].value = at[1] += make_uniform(&seed);
            opacities[i].opacity = make_uniform(&seed) * (round % 3 > 0);
            for (int k = 0; k < 3; k++) colors[i].rgb[k] = make_uniform(&seed);
        }
        const tl_control_points p = {.colors = colors,
                                     .color_count = round % 5 ? POINTS : 0,
                                     .opacities = opacities,
                                     .opacity_count = round % 7 ? POINTS : 0};
        const double low = 4 * make_uniform(&seed) - 1, high = low + make_uniform(&seed);
        tl_control_points_visible(&p, low, high, &opacity, &unseen);
        CHECK(unseen >= 0);
        if (!p.opacity_count) CHECK(opacity == 1);
        for (int i = 0; i < SAMPLES && p.opacity_count; i++) {
            const double value = low + (high - low) * i / (SAMPLES - 1);
            const double wrong = value + unseen * (2 * make_uniform(&seed) - 1);
            const double is = point_at(&opacities->value, POINTS, 2, 1, value);
            const double was = point_at(&opacities->value, POINTS, 2, 1, wrong);
            CHECK(is <= opacity + 1e-12);
            shown = fmax(shown, fabs(is - was));
            for (size_t k = 1; k <= 3 && p.color_count; k++)
                shown = fmax(shown, fabs(is * point_at(&colors->value, POINTS, 4, k, value) -
                                         was * point_at(&colors->value, POINTS, 4, k, wrong)));
        }
    }
    CHECK_BOUND("a change that is not seen", shown, TL_UNSEEN + 1e-12);
    CHECK(shown > TL_UNSEEN / 4);
}

#if TETRALOD_WITH_JANSSON

/* As ParaView writes it, commas and all. */
static const char MAP[] =
    "[{\"ColorSpace\": \"Step\", \"Name\": \"m\", \"NanColor\": [0.25, 0.5, 1],"
    " \"NanOpacity\": 0.5, \"UseLogScale\": 1,"
    " \"RGBPoints\": [1, 0, 0, 0, 10, 1, 0, 0, 100, 1, 1, 1,],"
    " \"Points\": [1, 0, 0.5, 0, 100, 0.75, 0.5, 0,],},]";

static void transfer_functions_go_into_scenes(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx);
    const tl_node t = tl_scene_find(s, "transfer1");
    char *before = check_scene_text(ctx, s);
    tl_value value;
    static const double COLORS[] = {1, 0, 0, 0, 1, 1, 0, 0, 10, 1, 0, 0, 10, 1, 1, 1, 100, 1, 1, 1};
    static const double OPACITIES[] = {1, 0, 100, 0.75}, NAN_COLOR[] = {0.25, 0.5, 1};
    write_file("map.json", MAP);
    CHECK_OK(ctx, tl_transfer_read(ctx, s, t, "map.json"));
    CHECK_OK(ctx, tl_scene_get(ctx, s, t, "colors", &value));
    CHECK_EQ(value.count, 20);
    CHECK(memcmp(value.reals, COLORS, sizeof COLORS) == 0);
    CHECK_OK(ctx, tl_scene_get(ctx, s, t, "opacities", &value));
    CHECK_EQ(value.count, 4);
    CHECK(memcmp(value.reals, OPACITIES, sizeof OPACITIES) == 0);
    CHECK_OK(ctx, tl_scene_get(ctx, s, t, "nan_color", &value));
    CHECK(value.count == 3 && memcmp(value.reals, NAN_COLOR, sizeof NAN_COLOR) == 0);
    CHECK(tl_scene_flag(s, t, "logarithmic"));
    CHECK_OK(ctx, tl_scene_undo(ctx, s)); /* one step */
    CHECK(check_scene_says(ctx, s, before));
    CHECK_STATUS(tl_transfer_read(ctx, s, TL_NODE_CAMERA + 1, "map.json"), TL_ERR_ARG);
    CHECK_STATUS(tl_transfer_read(ctx, s, t, "none.json"), TL_ERR_IO);
    /* without NanColor and opacities these are empty again */
    CHECK_OK(ctx, tl_scene_redo(ctx, s));
    write_file("plain.json", "{\"RGBPoints\": [0, 0, 0, 0]}");
    CHECK_OK(ctx, tl_transfer_read(ctx, s, t, "plain.json"));
    CHECK_OK(ctx, tl_scene_get(ctx, s, t, "nan_color", &value));
    CHECK_EQ(value.count, 0);
    CHECK_OK(ctx, tl_scene_get(ctx, s, t, "opacities", &value));
    CHECK_EQ(value.count, 0);
    /* opacities alone leave the colours to the map */
    write_file("clear.json", "{\"Points\": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}");
    CHECK_OK(ctx, tl_transfer_read(ctx, s, t, "clear.json"));
    CHECK_OK(ctx, tl_scene_get(ctx, s, t, "colors", &value));
    CHECK_EQ(value.count, 0);
    CHECK(tl_scene_flag(s, t, "logarithmic")); /* what the scene said stays */
    tl_mem_free(ctx, before);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void transfer_functions_come_back(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    uint64_t seed = 3;
    tl_color_point colors[50];
    tl_opacity_point opacities[50];
    for (int i = 0; i < 50; i++) {
        colors[i].value = opacities[i].value = -20 + i + make_uniform(&seed);
        opacities[i].opacity = make_uniform(&seed);
        for (int k = 0; k < 3; k++) colors[i].rgb[k] = make_uniform(&seed);
    }
    for (int with = 0; with < 2; with++) {
        const tl_control_points p = {.colors = colors,
                                     .color_count = 50,
                                     .opacities = opacities,
                                     .opacity_count = with ? 50 : 0,
                                     .has_nan = with,
                                     .nan_rgb = {0.1, 0.2, 0.3}};
        tl_control_points *read = NULL;
        CHECK_OK(ctx, tl_control_points_write(ctx, "back.json", "a \"b\"\n\xff", &p));
        CHECK_OK(ctx, tl_control_points_read(ctx, "back.json", false, &read));
        CHECK_EQ(read->color_count, 50);
        CHECK(memcmp(read->colors, colors, sizeof colors) == 0);
        CHECK_EQ(read->opacity_count, p.opacity_count);
        CHECK(memcmp(read->opacities, opacities, p.opacity_count * sizeof *opacities) == 0);
        CHECK_EQ(read->has_nan, with);
        if (with) CHECK(memcmp(read->nan_rgb, p.nan_rgb, sizeof p.nan_rgb) == 0);
        CHECK(!read->logarithmic);
        tl_mem_free(ctx, read);
    }
    check_ctx_destroy(ctx);
}

static void wrong_transfer_functions_are_named(void **state)
{
    static const char *const WRONG[][2] = {
        {"[3]", "expected a list of colour maps"},
        {"[]", "expected a list of colour maps"},
        {"{", "as JSON: line 1"},
        {"{}", "RGBPoints: expected"},
        {"{\"Points\": []}", "RGBPoints: expected"},
        {"{\"RGBPoints\": [0, 0, 0, 0], \"NanColor\": [1, 1]}", "NanColor: expected"},
        {"{\"RGBPoints\": [0, 0, 0, 0], \"NanColor\": [1, 1, 255]}", "NanColor: expected"},
        {"{\"RGBPoints\": [0, 0, 0, 0], \"NanColor\": 1}", "NanColor: expected"},
    };
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_control_points *read = NULL;
    for (size_t i = 0; i < sizeof WRONG / sizeof *WRONG; i++) {
        write_file("wrong.json", WRONG[i][0]);
        CHECK_STATUS(tl_control_points_read(ctx, "wrong.json", false, &read), TL_ERR_FORMAT);
        CHECK(!read);
        CHECK_MESSAGE(ctx, WRONG[i][1]);
        CHECK_MESSAGE(ctx, "wrong.json");
    }
    check_ctx_destroy(ctx);
}

/* ---- cameras ---- */

static void cameras_come_back(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_camera cameras[3], *read = NULL, first;
    size_t count = 0;
    for (int i = 0; i < 3; i++) {
        cameras[i] = tl_camera_defaults();
        cameras[i].position[0] = 0.1 + i;
        cameras[i].view_angle = 20.2;
        cameras[i].size_px[0] = 640 + (uint32_t)i;
        cameras[i].parallel_scale = i == 1 ? 0.3 : 0;
    }
    for (size_t n = 1; n <= 3; n += 2) {
        CHECK_OK(ctx, tl_cameras_write(ctx, "cameras.json", cameras, n));
        CHECK_OK(ctx, tl_cameras_read(ctx, "cameras.json", &read, &count));
        CHECK_EQ(count, n);
        for (size_t i = 0; i < n; i++) CHECK(memcmp(&read[i], &cameras[i], sizeof *read) == 0);
        tl_mem_free(ctx, read);
        if (n == 1) CHECK_OK(ctx, tl_camera_read(ctx, "cameras.json", &first));
    }
    CHECK(memcmp(&first, cameras, sizeof first) == 0);
    /* names as VTK writes them; of angle and scale the angle counts, unless it is said */
    write_file("vtk.json", "{\"camera\": {\"Position\": [1, 2, 3], \"FocalPoint\": [0, 0, 0],"
                           "\"ViewUp\": [0, 0, 1], \"ViewAngle\": 40, \"ParallelScale\": [5]}}");
    CHECK_OK(ctx, tl_camera_read(ctx, "vtk.json", &first));
    CHECK(first.position[2] == 3 && first.view_angle == 40 && first.parallel_scale == 0);
    write_file("vtk.json",
               "{\"cameras\": [{\"position\": [1, 2, 3], \"focal_point\": [0, 0, 0],"
               "\"parallel_scale\": 5, \"view_angle\": 3, \"parallelProjection\": 1}]}");
    CHECK_OK(ctx, tl_cameras_read(ctx, "vtk.json", &read, &count));
    CHECK(count == 1 && read->parallel_scale == 5);
    tl_mem_free(ctx, read);
    check_ctx_destroy(ctx);
}

static void wrong_cameras_are_named(void **state)
{
#define CAMERA(words) "{\"position\": [1, 2, 3], \"focal_point\": [0, 0, 0], " words "}"
    static const char *const WRONG[][2] = {
        {"", "as JSON"},
        {"[]", "a list without cameras"},
        {"[3]", "expected a JSON object with a camera"},
        {"{\"position\": [1, 2, 3]}", "no position, or no focal_point"},
        {"{\"position\": [1, 2], \"focal_point\": [0, 0, 0]}", "position: expected three"},
        {"{\"position\": [1, 2, 3], \"focal_point\": [0, 0, \"\"]}", "focal_point: expected three"},
        {"{\"position\": [1, 2, 3], \"focal_point\": [1, 2, 3]}", "position is its focal point"},
        {"{\"position\": [1e300, 2, 3], \"focal_point\": [1, 2, 3]}", "too far from its focal"},
        {CAMERA("\"view_up\": [-2, -4, -6]"), "view-up points along its view"},
        {CAMERA("\"view_up\": [0, 0, 0]"), "view-up has no direction"},
        {CAMERA("\"view_angle\": 0"), "view angle 0, expected more than 0 and less than 180"},
        {CAMERA("\"view_up\": 1"), "view_up: expected three"},
        {CAMERA("\"view_angle\": \"x\""), "view_angle: expected degrees"},
        {CAMERA("\"view_angle\": 180"), "in the camera file 'wrong.json'"},
        {CAMERA("\"parallel_scale\": []"), "parallel_scale: expected a length"},
        {CAMERA("\"size\": [0, 1]"), "size: expected"},
        {CAMERA("\"size\": [1, 1e300]"), "size: expected"},
    };
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_camera *read = NULL;
    size_t count = 1;
    for (size_t i = 0; i < sizeof WRONG / sizeof *WRONG; i++) {
        write_file("wrong.json", WRONG[i][0]);
        CHECK_STATUS(tl_cameras_read(ctx, "wrong.json", &read, &count), TL_ERR_FORMAT);
        CHECK(!read && !count);
        CHECK_MESSAGE(ctx, WRONG[i][1]);
    }
    check_ctx_destroy(ctx);
}

/* ---- damage ---- */

static void damaged_files_are_survived(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    const tl_camera camera = tl_camera_defaults();
    char text[sizeof MAP + 400];
    uint64_t seed = 9;
    CHECK_OK(ctx, tl_cameras_write(ctx, "camera.json", &camera, 1));
    FILE *file = fopen("camera.json", "rb");
    const size_t camera_bytes = fread(text, 1, sizeof text, file);
    fclose(file);
    for (int is_map = 0; is_map < 2; is_map++) {
        const size_t bytes = is_map ? sizeof MAP - 1 : camera_bytes;
        for (size_t i = 0; i < 2 * bytes; i++) {
            char damaged[sizeof text];
            tl_camera read;
            tl_control_points *points = NULL;
            memcpy(damaged, is_map ? MAP : text, bytes);
            if (i >= bytes) damaged[i - bytes] = (char)(make_random(&seed) >> 56);
            write_text("damaged.json", damaged, i < bytes ? i : bytes);
            tl_status st = is_map ? tl_control_points_read(ctx, "damaged.json", false, &points)
                                  : tl_camera_read(ctx, "damaged.json", &read);
            CHECK(st == TL_OK || (st == TL_ERR_FORMAT && *tl_ctx_message(ctx)));
            tl_mem_free(ctx, points);
        }
    }
    check_ctx_destroy(ctx);
}

static tl_status read_and_write(tl_ctx *ctx, void *arg)
{
    tl_scene *s = NULL;
    tl_control_points *points = NULL;
    tl_camera *cameras = NULL;
    size_t count;
    tl_node node = 0;
    (void)arg;
    tl_status st = tl_scene_create(ctx, &s);
    if (!st) st = tl_scene_add(ctx, s, TL_NODE_TRANSFER, &node);
    if (!st) st = tl_transfer_read(ctx, s, node, "map.json");
    if (!st) st = tl_control_points_read(ctx, "map.json", true, &points);
    if (!st) st = tl_control_points_write(ctx, "out.json", "m", points);
    if (!st) st = tl_cameras_read(ctx, "camera.json", &cameras, &count);
    if (!st) st = tl_cameras_write(ctx, "out.json", cameras, count);
    tl_mem_free(ctx, cameras);
    tl_mem_free(ctx, points);
    tl_scene_destroy(ctx, s);
    return st;
}

static void every_failing_allocation_is_reported(void **state)
{
    (void)state;
    fail_alloc f;
    write_file("map.json", MAP);
    write_file("camera.json", CAMERA("\"view_angle\": 30"));
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, read_and_write, NULL) > 20);
    fail_alloc_close(&f);
}

#else

static void json_is_refused_by_name(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_camera camera;
    tl_control_points *points = NULL;
    write_file("any.json", "{}");
    CHECK_STATUS(tl_camera_read(ctx, "any.json", &camera), TL_ERR_UNSUPPORTED);
    CHECK_STATUS(tl_control_points_read(ctx, "any.json", false, &points), TL_ERR_UNSUPPORTED);
    CHECK_MESSAGE(ctx, "libjansson-dev");
    check_ctx_destroy(ctx);
}

#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_visible_holds),
#if TETRALOD_WITH_JANSSON
        cmocka_unit_test(transfer_functions_go_into_scenes),
        cmocka_unit_test(transfer_functions_come_back),
        cmocka_unit_test(wrong_transfer_functions_are_named),
        cmocka_unit_test(cameras_come_back),
        cmocka_unit_test(wrong_cameras_are_named),
        cmocka_unit_test(damaged_files_are_survived),
        cmocka_unit_test(every_failing_allocation_is_reported),
#else
        cmocka_unit_test(json_is_refused_by_name),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
