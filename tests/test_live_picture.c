/* From a drawing to a frame: pictures scaled up, and bytes. */
#include "live/live.h"

#include "check_ctx.h"

static tl_image *picture(tl_ctx *ctx, uint32_t width, uint32_t height)
{
    tl_image *image = NULL;
    CHECK_OK(ctx, tl_image_create(ctx, width, height, &image));
    return image;
}

/* A linear field of a picture, at places of a frame whose middle and pixels are those of it. */
static double field(double x, double y, int k)
{
    return 0.5 + 0.002 * (k + 1) * x - 0.001 * y;
}

static void fill(tl_image *image, double pixel)
{
    for (uint32_t y = 0; y < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++) {
            size_t p = (size_t)y * image->width + x;
            double at[2] = {(x + 0.5 - image->width / 2.0) * pixel,
                            (y + 0.5 - image->height / 2.0) * pixel};
            for (int k = 0; k < 4; k++)
                image->rgba[4 * p + (size_t)k] = (float)field(at[0], at[1], k);
            image->depth[p] = (float)(1 + at[0] * 0.01);
        }
}

/* What is linear stays so, wherever there are pixels on both sides; depths are those of pixels. */
static void test_linear_stays_linear(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{120, 80}, {121, 80}, {97, 61}, {3, 50}, {1, 1}, {40, 2}};
    for (unsigned threads = 1; threads < 4; threads++)
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
            for (uint32_t factor = 1; factor <= 3; factor++) {
                tl_ctx *ctx = check_ctx_create(threads);
                const uint32_t width = sizes[s][0], height = sizes[s][1];
                const uint32_t low = (height + factor - 1) / factor;
                const double scale = (double)low / height;
                tl_image *small = picture(ctx, (uint32_t)ceil(width * scale), low);
                tl_image *large = picture(ctx, width, height);
                fill(small, 1 / scale);
                CHECK_OK(ctx, tli_live_enlarge(ctx, small, large));
                for (uint32_t y = 0; y < height; y++)
                    for (uint32_t x = 0; x < width; x++) {
                        size_t p = (size_t)y * width + x;
                        double at[2] = {x + 0.5 - width / 2.0, y + 0.5 - height / 2.0};
                        double edge[2] = {(small->width - 1) / scale / 2,
                                          (small->height - 1) / scale / 2};
                        for (int k = 0; k < 2; k++) at[k] = fmin(fmax(at[k], -edge[k]), edge[k]);
                        for (int k = 0; k < 4; k++)
                            CHECK_NEAR((double)large->rgba[4 * p + (size_t)k],
                                       field(at[0], at[1], k), 1e-5);
                        CHECK_NEAR((double)large->depth[p], 1 + at[0] * 0.01,
                                   0.0051 / scale + 1e-6);
                    }
                if (factor == 1)
                    CHECK_EQ(memcmp(small->rgba, large->rgba, 16 * (size_t)width * height), 0);
                tl_image_destroy(ctx, large);
                tl_image_destroy(ctx, small);
                check_ctx_destroy(ctx);
            }
}

static void test_bytes(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_image *image = picture(ctx, 5, 1);
    const float colors[5][4] = {
        {0, 0, 0, 0}, {1, 0.5F, 0, 1}, {0.25F, 0, 0.125F, 0.5F}, {2, -1, NAN, 1}, {1, 1, 1, 1}};
    const uint8_t clear[5][4] = {
        {0, 0, 0, 0}, {255, 128, 0, 255}, {64, 0, 32, 128}, {255, 0, 0, 255}, {255, 255, 255, 255}};
    const uint8_t blue[5][4] = {{0, 0, 255, 255},
                                {255, 128, 0, 255},
                                {64, 0, 159, 255},
                                {255, 0, 0, 255},
                                {255, 255, 255, 255}};
    uint8_t bytes[20];
    memcpy(image->rgba, colors, sizeof colors);
    CHECK_OK(ctx, tli_live_bytes(ctx, image, NULL, false, bytes));
    CHECK_EQ(memcmp(bytes, clear, sizeof clear), 0);
    CHECK_OK(ctx, tli_live_bytes(ctx, image, (const double[3]){0, 0, 1}, false, bytes));
    CHECK_EQ(memcmp(bytes, blue, sizeof blue), 0);
    CHECK_OK(ctx, tli_live_bytes(ctx, image, (const double[3]){0, 0, 1}, true, bytes));
    for (int p = 0; p < 5; p++)
        for (int k = 0; k < 4; k++) CHECK_EQ(bytes[4 * p + k], blue[p][k < 3 ? 2 - k : k]);
    tl_image_destroy(ctx, image);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_linear_stays_linear),
                                       cmocka_unit_test(test_bytes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
