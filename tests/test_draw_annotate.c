/* Ticks with known answers and of ranges at the ends of what a double holds; cameras that fit; what
 * annotation draws, in front and behind, on any background. */
#include "check.h"

#include "check_ctx.h"
#include "tetralod/draw.h"

enum { SIDE = 300 };
static const double BOX[6] = {-1, 1, -2, 2, 0, 3};

/* ---- ticks ---- */

static void check_labels(double low, double high, size_t most, int exponent, const char *words)
{
    tl_tick ticks[TL_TICKS_MAX];
    int found;
    char text[TL_TICKS_MAX * TL_TICK_BYTES] = "";
    size_t count = tl_ticks(low, high, most, ticks, &found);
    for (size_t i = 0; i < count; i++) {
        strcat(text, i ? " " : "");
        strcat(text, ticks[i].label);
        CHECK(ticks[i].value >= low && ticks[i].value <= high);
        CHECK(ticks[i].at >= 0 && ticks[i].at <= 1);
    }
    assert_string_equal(text, words);
    CHECK_EQ(found, exponent);
}

static void round_numbers(void **state)
{
    (void)state;
    check_labels(0, 1, 5, 0, "0.0 0.5 1.0");
    check_labels(0, 1, 4, 0, "0.0 0.5 1.0");
    check_labels(0, 1, 8, 0, "0.0 0.2 0.4 0.6 0.8 1.0");
    check_labels(-1.25, 1, 8, 0, "−1.0 −0.5 0.0 0.5 1.0");
    check_labels(298, 692, 6, 0, "300 400 500 600");
    check_labels(0, 2.5e7, 4, 7, "0 1 2");
    check_labels(-3e-7, 4e-7, 4, -7, "−2 0 2 4");
    check_labels(101325, 101325.4, 6, 0, "101325.0 101325.1 101325.2 101325.3 101325.4");
    check_labels(5, 5, 4, 0, "5");
    check_labels(0, 0, 4, 0, "0");
    check_labels(3e20, 3e20, 4, 20, "3");
}

static void numbers_of_any_size(void **state)
{
    (void)state;
    check_labels(-1.7e308, 1.7e308, 4, 308, "−1 0 1");
    check_labels(0, 4e-300, 3, -300, "0 2 4");
    tl_tick ticks[TL_TICKS_MAX];
    int exponent;
    for (int e = -320; e <= 308; e += 4)
        for (size_t most = 2; most <= 40; most += 19) {
            const double high = 1.7 * pow(10, e);
            size_t count = tl_ticks(-high / 3, high, most, ticks, &exponent);
            CHECK(count >= 1 && count <= most);
            for (size_t i = 1; i < count; i++) CHECK(ticks[i].value > ticks[i - 1].value);
        }
    /* neighbours among doubles */
    CHECK(tl_ticks(1, nextafter(1, 2), 5, ticks, &exponent) >= 1);
}

static void powers_of_ten(void **state)
{
    (void)state;
    tl_tick ticks[TL_TICKS_MAX];
    char text[1024] = "";
    size_t count = tl_ticks_log(0.005, 2e6, 20, ticks);
    for (size_t i = 0; i < count; i++)
        if (ticks[i].label[0]) {
            strcat(text, " ");
            strcat(text, ticks[i].label);
            CHECK_NEAR(ticks[i].at, log10(ticks[i].value / 0.005) / log10(2e6 / 0.005), 1e-9);
        }
    assert_string_equal(text, " 0.01 0.1 1 10 100 1000 10000 10⁵ 10⁶");
    count = tl_ticks_log(2, 9, 4, ticks);
    CHECK(count >= 2);
    CHECK_NEAR(ticks[0].at, log10(ticks[0].value / 2) / log10(4.5), 1e-9);
    CHECK(tl_ticks_log(1e-300, 1e300, 5, ticks) <= 8);
    CHECK_EQ(tl_ticks_log(7, 7, 5, ticks), 1);
    tl_exponent_text(-12, text);
    assert_string_equal(text, "×10⁻¹²");
}

/* ---- cameras ---- */

/* Where a point lies on the picture, -1 to 1. */
static void look(const tl_camera *c, const double xyz[3], double out[2])
{
    double f[3], r[3], u[3], d[3], length = 0, side = 0;
    for (int k = 0; k < 3; k++) f[k] = c->focal_point[k] - c->position[k];
    for (int k = 0; k < 3; k++) length += f[k] * f[k];
    for (int k = 0; k < 3; k++) f[k] /= sqrt(length);
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        r[k] = f[i] * c->view_up[j] - f[j] * c->view_up[i];
        side += r[k] * r[k];
    }
    for (int k = 0; k < 3; k++) r[k] /= sqrt(side);
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        u[k] = r[i] * f[j] - r[j] * f[i];
        d[k] = xyz[k] - c->position[k];
    }
    const double pi = acos(-1), z = d[0] * f[0] + d[1] * f[1] + d[2] * f[2];
    const double half =
        c->parallel_scale > 0 ? c->parallel_scale : z * tan(c->view_angle * pi / 360);
    CHECK(z > 0);
    out[0] = (d[0] * r[0] + d[1] * r[1] + d[2] * r[2]) / half * c->size_px[1] / c->size_px[0];
    out[1] = (d[0] * u[0] + d[1] * u[1] + d[2] * u[2]) / half;
}

static void corner(size_t i, double xyz[3])
{
    for (size_t k = 0; k < 3; k++) xyz[k] = BOX[2 * k + (i >> k & 1)];
}

static void fits_a_window(void **state)
{
    (void)state;
    const double window[4] = {-0.7, 0.5, -0.9, 0.8};
    double points[8][3];
    for (size_t i = 0; i < 8; i++) corner(i, points[i]);
    for (int parallel = 0; parallel < 2; parallel++)
        for (double azimuth = 0; azimuth < 360; azimuth += 45) {
            tl_camera c = tl_camera_fit(BOX, azimuth, 25, 1, 400, 300);
            double low[2] = {9, 9}, high[2] = {-9, -9};
            c.parallel_scale = parallel;
            tl_camera_fit_points(&c, points[0], 8, window, 1);
            for (size_t i = 0; i < 8; i++) {
                double at[2];
                look(&c, points[i], at);
                for (int k = 0; k < 2; k++) {
                    low[k] = fmin(low[k], at[k]);
                    high[k] = fmax(high[k], at[k]);
                }
            }
            for (int k = 0; k < 2; k++)
                CHECK(low[k] > window[2 * k] - 1e-9 && high[k] < window[2 * k + 1] + 1e-9);
            /* it touches one pair of sides */
            const double across = (high[0] - low[0]) / (window[1] - window[0]);
            const double up = (high[1] - low[1]) / (window[3] - window[2]);
            CHECK_NEAR(fmax(across, up), 1, 1e-9);
        }
}

/* ---- pictures ---- */

#if TETRALOD_WITH_PANGO

static tl_transfer *grey_ramp(tl_ctx *ctx)
{
    static const tl_color_point colors[] = {{0, {0, 0, 0}}, {1, {1, 1, 1}}};
    static const tl_opacity_point opacity[] = {{0, 1}};
    tl_transfer *transfer = NULL;
    CHECK_OK(ctx, tl_transfer_create(ctx, colors, 2, opacity, 1, 1, &transfer));
    return transfer;
}

/* A picture with a square of one colour in its middle. */
static tl_image *red_square(tl_ctx *ctx)
{
    tl_image *image = NULL;
    CHECK_OK(ctx, tl_image_create(ctx, SIDE, SIDE, &image));
    for (size_t y = SIDE / 3; y < 2 * SIDE / 3; y++)
        for (size_t x = SIDE / 3; x < 2 * SIDE / 3; x++)
            for (size_t k = 0; k < 4; k++) image->rgba[4 * (y * SIDE + x) + k] = k % 3 ? 0 : 1;
    return image;
}

/* The same, annotated. */
static tl_image *annotated(tl_ctx *ctx, const tl_annotation *a)
{
    tl_image *image = red_square(ctx);
    const tl_camera camera = tl_camera_fit(BOX, 30, 20, 1, SIDE, SIDE);
    CHECK_OK(ctx, tl_draw_annotation(ctx, a, &camera, image));
    return image;
}

static double contrast(const tl_image *image, const float background[3])
{
    double most = 0;
    for (size_t p = 0; p < (size_t)SIDE * SIDE; p++)
        for (size_t k = 0; k < 3; k++)
            most = fmax(
                most, fabs((double)(image->rgba[4 * p + k] +
                                    (1 - image->rgba[4 * p + 3]) * background[k] - background[k])));
    return most;
}

static void readable_on_any_background(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    static const float white[3] = {1, 1, 1}, black[3] = {0, 0, 0};
    for (int b = 0; b < 4; b++) {
        tl_annotation a = tl_annotation_defaults();
        tl_image *image = NULL;
        const tl_camera camera = tl_camera_fit(BOX, 30, 20, 1, SIDE, SIDE);
        a.title = "Druck im Gehäuse \xff\n";
        a.note = "p within 0.01";
        a.background = b == 0 ? white : b == 1 ? black : NULL;
        CHECK_OK(ctx, tl_image_create(ctx, SIDE, SIDE, &image));
        CHECK_OK(ctx, tl_draw_annotation(ctx, &a, &camera, image));
        /* what was made without a background is read on both */
        CHECK(contrast(image, b % 2 ? black : white) > 0.6);
        tl_image_destroy(ctx, image);
    }
    check_ctx_destroy(ctx);
}

static void far_edges_lie_behind(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_annotation a = tl_annotation_defaults();
    a.bounds = BOX;
    a.outline = true;
    tl_image *image = annotated(ctx, &a);
    size_t red = 0, other = 0;
    for (size_t y = SIDE / 3; y < 2 * SIDE / 3; y++)
        for (size_t x = SIDE / 3; x < 2 * SIDE / 3; x++) {
            const float *c = image->rgba + 4 * (y * SIDE + x);
            CHECK(c[3] == 1);
            if (c[0] == 1 && c[1] == 0)
                red++;
            else
                other++;
        }
    /* near edges cross the square with a thin line or none; far ones leave no trace */
    CHECK(other < red / 10);
    size_t around = 0;
    for (size_t p = 0; p < (size_t)SIDE * SIDE; p++) around += image->rgba[4 * p + 3] > 0;
    CHECK(around > (size_t)SIDE * SIDE / 9 + 500);
    tl_image_destroy(ctx, image);
    check_ctx_destroy(ctx);
}

/* The bar runs from dark to bright at the right, inside of what the window leaves. */
static void bar_shows_colors(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_transfer *transfer = grey_ramp(ctx);
    const tl_scalar_bar bars[2] = {{"p [Pa]", transfer, {0, 1}, {0, 1}, false},
                                   {"k", transfer, {0, 1}, {1e-3, 1e6}, true}};
    tl_annotation a = tl_annotation_defaults();
    double window[4];
    a.bars = bars;
    a.bar_count = 1;
    a.background = (const float[]){0, 0, 1};
    tl_image *image = annotated(ctx, &a);
    tl_annotation_window(&a, SIDE, SIDE, window);
    CHECK(window[1] < 0.8 && window[0] < -0.9);
    size_t best = 0, rows = 0;
    for (size_t x = SIDE / 2; x < SIDE; x++) {
        size_t run = 0;
        float last = 2;
        for (size_t y = 0; y < SIDE; y++) {
            const float *c = image->rgba + 4 * (y * SIDE + x);
            if (c[3] == 1 && c[0] == c[1] && c[1] == c[2] && c[0] <= last) {
                run++;
                last = c[0];
            }
        }
        if (run > rows) best = x, rows = run;
    }
    CHECK((double)rows > 0.4 * SIDE);
    CHECK((double)best > (window[1] + 1) / 2 * SIDE);
    tl_image_destroy(ctx, image);
    a.bar_count = 2;
    a.bounds = BOX;
    a.axes = a.triad = a.outline = true;
    image = annotated(ctx, &a);
    tl_image_destroy(ctx, image);
    tl_transfer_destroy(ctx, transfer);
    check_ctx_destroy(ctx);
}

/* Bytes of a file, with a 0 behind them; freed with tl_mem_free. */
static char *file_text(tl_ctx *ctx, const char *path, size_t *bytes)
{
    tl_status st = TL_OK;
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char *text = tl_mem_zalloc(ctx, 1 << 20, 1, &st);
    CHECK_OK(ctx, st);
    *bytes = fread(text, 1, (1 << 20) - 1, file);
    fclose(file);
    return text;
}

static bool holds(const char *text, size_t bytes, const char *word)
{
    const size_t length = strlen(word);
    for (size_t i = 0; i + length <= bytes; i++)
        if (memcmp(text + i, word, length) == 0) return true;
    return false;
}

static void pages(void **state)
{
    (void)state;
    static const char *const paths[] = {"page.pdf", "again.pdf", "page.svg"};
    tl_ctx *ctx = check_ctx_create(1);
    tl_annotation a = tl_annotation_defaults();
    const tl_camera camera = tl_camera_fit(BOX, 30, 20, 1, SIDE, SIDE);
    tl_image *image = red_square(ctx), *same = red_square(ctx);
    char *texts[3];
    size_t bytes[3];
    a.title = "Pressure";
    a.bounds = BOX;
    a.axes = a.outline = true;
    for (int i = 0; i < 3; i++) {
        CHECK_OK(ctx, tl_annotation_write(ctx, &a, &camera, image, paths[i]));
        texts[i] = file_text(ctx, paths[i], &bytes[i]);
    }
    assert_memory_equal(image->rgba, same->rgba, sizeof(float) * 4 * SIDE * SIDE);
    assert_memory_equal(texts[0], "%PDF-", 5);
    CHECK(holds(texts[0], bytes[0], "/FontFile")); /* text stays text */
    CHECK(holds(texts[0], bytes[0], "/Image"));
    CHECK_EQ(bytes[0], bytes[1]);
    assert_memory_equal(texts[0], texts[1], bytes[0]);
    CHECK(holds(texts[2], bytes[2], "<svg"));
    CHECK(holds(texts[2], bytes[2], "<image"));
    CHECK_EQ(tl_annotation_write(ctx, &a, &camera, image, "page.txt"), TL_ERR_UNSUPPORTED);
    CHECK_EQ(tl_annotation_write(ctx, &a, &camera, image, "nowhere/page.pdf"), TL_ERR_IO);
    CHECK_EQ(tl_annotation_write(ctx, &a, &camera, image, "/dev/full"), TL_ERR_UNSUPPORTED);
    CHECK(fopen("page.txt", "rb") == NULL);
    for (int i = 0; i < 3; i++) tl_mem_free(ctx, texts[i]);
    tl_image_destroy(ctx, image);
    tl_image_destroy(ctx, same);
    check_ctx_destroy(ctx);
}

static void wrong_numbers(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_transfer *transfer = grey_ramp(ctx);
    tl_image *image = NULL;
    const tl_camera camera = tl_camera_fit(BOX, 30, 20, 1, SIDE, SIDE);
    double box[6] = {0, 1, 0, 1, 0, INFINITY};
    tl_scalar_bar bar = {"p", transfer, {0, 1}, {2, 1}, false};
    tl_annotation a = tl_annotation_defaults();
    CHECK_OK(ctx, tl_image_create(ctx, SIDE, SIDE, &image));
    a.bounds = box;
    CHECK_STATUS(tl_draw_annotation(ctx, &a, &camera, image), TL_ERR_ARG);
    box[5] = 1;
    a.bars = &bar;
    a.bar_count = 1;
    CHECK_STATUS(tl_draw_annotation(ctx, &a, &camera, image), TL_ERR_ARG);
    bar.range[0] = 0;
    bar.logarithmic = true;
    CHECK_STATUS(tl_draw_annotation(ctx, &a, &camera, image), TL_ERR_ARG);
    bar.range[0] = 1;
    a.text_px = (double)NAN;
    CHECK_STATUS(tl_draw_annotation(ctx, &a, &camera, image), TL_ERR_ARG);
    a.text_px = 10;
    /* one value, and cameras inside of the box and beside it */
    a.outline = a.axes = true;
    for (double distance = 0; distance < 10; distance += 1.25) {
        tl_camera c = camera;
        for (int k = 0; k < 3; k++) c.position[k] = 0.5 + distance * 0.2;
        for (int k = 0; k < 3; k++) c.focal_point[k] = 20 + k;
        CHECK_OK(ctx, tl_draw_annotation(ctx, &a, &c, image));
    }
    tl_image_destroy(ctx, image);
    tl_transfer_destroy(ctx, transfer);
    check_ctx_destroy(ctx);
}

#else

static void without_pango(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_image *image = NULL;
    const tl_annotation a = tl_annotation_defaults();
    const tl_camera camera = tl_camera_fit(BOX, 30, 20, 1, SIDE, SIDE);
    CHECK_OK(ctx, tl_image_create(ctx, SIDE, SIDE, &image));
    CHECK_STATUS(tl_draw_annotation(ctx, &a, &camera, image), TL_ERR_UNSUPPORTED);
    tl_image_destroy(ctx, image);
    check_ctx_destroy(ctx);
}

#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(round_numbers),
        cmocka_unit_test(numbers_of_any_size),
        cmocka_unit_test(powers_of_ten),
        cmocka_unit_test(fits_a_window),
#if TETRALOD_WITH_PANGO
        cmocka_unit_test(readable_on_any_background),
        cmocka_unit_test(far_edges_lie_behind),
        cmocka_unit_test(bar_shows_colors),
        cmocka_unit_test(pages),
        cmocka_unit_test(wrong_numbers),
#else
        cmocka_unit_test(without_pango),
#endif
    };
    return cmocka_run_group_tests_name("draw_annotate", tests, NULL, NULL);
}
