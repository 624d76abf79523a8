/* Pictures in memory. */
#include <math.h>

#include "draw/draw.h"

enum { SIDE_MAX = 32768 };

tl_status tli_image_check(tl_ctx *ctx, uint32_t width, uint32_t height)
{
    if (width && height && width <= SIDE_MAX && height <= SIDE_MAX) return TL_OK;
    return tl_fail(ctx, TL_ERR_ARG, "a picture of %u x %u pixels, expected sides of 1 to %d", width,
                   height, SIDE_MAX);
}

tl_status tl_image_create(tl_ctx *ctx, uint32_t width, uint32_t height, tl_image **image)
{
    *image = NULL;
    tl_status st = tli_image_check(ctx, width, height);
    if (st) return st;
    size_t count = (size_t)width * height;
    tl_image *i = tl_mem_zalloc(ctx, 1, sizeof *i, &st);
    float *rgba = tl_mem_zalloc(ctx, count, 4 * sizeof *rgba, &st);
    float *depth = tl_mem_alloc(ctx, count, sizeof *depth, &st);
    if (st) {
        tl_mem_free(ctx, depth);
        tl_mem_free(ctx, rgba);
        tl_mem_free(ctx, i);
        return st;
    }
    for (size_t p = 0; p < count; p++) depth[p] = INFINITY;
    *i = (tl_image){width, height, rgba, depth};
    *image = i;
    return TL_OK;
}

void tl_image_destroy(tl_ctx *ctx, tl_image *image)
{
    if (!image) return;
    tl_mem_free(ctx, image->depth);
    tl_mem_free(ctx, image->rgba);
    tl_mem_free(ctx, image);
}

/* Mean of a square of pixels, and its nearest depth. */
static void reduce_pixel(const tl_image *from, uint32_t factor, size_t x, size_t y, tl_image *to)
{
    double sum[4] = {0};
    float near = INFINITY;
    for (size_t v = y * factor; v < (y + 1) * factor; v++)
        for (size_t u = x * factor; u < (x + 1) * factor; u++) {
            size_t p = v * from->width + u;
            for (int k = 0; k < 4; k++) sum[k] += (double)from->rgba[4 * p + (size_t)k];
            near = from->depth[p] < near ? from->depth[p] : near;
        }
    size_t p = y * to->width + x;
    for (int k = 0; k < 4; k++)
        to->rgba[4 * p + (size_t)k] = (float)(sum[k] / ((double)factor * factor));
    to->depth[p] = near;
}

tl_status tl_image_reduce(tl_ctx *ctx, const tl_image *image, uint32_t factor, tl_image **small)
{
    *small = NULL;
    if (!factor || image->width % factor || image->height % factor)
        return tl_fail(ctx, TL_ERR_ARG, "%u x %u pixels are not whole squares of %u", image->width,
                       image->height, factor);
    tl_status st = tl_image_create(ctx, image->width / factor, image->height / factor, small);
    if (st) return st;
    for (size_t y = 0; y < (*small)->height; y++)
        for (size_t x = 0; x < (*small)->width; x++) reduce_pixel(image, factor, x, y, *small);
    return TL_OK;
}

void tl_image_flatten(tl_image *image, const float background[3])
{
    static const float white[3] = {1, 1, 1};
    const float *behind = background ? background : white;
    for (size_t p = 0; p < (size_t)image->width * image->height; p++) {
        float *c = image->rgba + 4 * p;
        for (int k = 0; k < 3; k++) c[k] += (1 - c[3]) * behind[k];
        c[3] = 1;
    }
}

/* Comparisons, which a compiler does for many at once; NaN is 0. */
static inline uint8_t byte_of(float value)
{
    value = value > 0 ? value : 0;
    value = value < 1 ? value : 1;
    return (uint8_t)(int)(value * 255 + 0.5F);
}

static inline void pack(const float *colors, size_t count, const float *background, bool bgra,
                        uint8_t *bytes)
{
    const float behind[4] = {background ? background[0] : 0, background ? background[1] : 0,
                             background ? background[2] : 0, background ? 1 : 0};
    for (size_t p = 0; p < count; p++)
        for (size_t k = 0; k < 4; k++)
            bytes[4 * p + (bgra && k < 3 ? 2 - k : k)] =
                byte_of(colors[4 * p + k] + (1 - colors[4 * p + 3]) * behind[k]);
}

void tli_pixels_pack(const float *colors, size_t count, const float *background, uint8_t *rgba)
{
    pack(colors, count, background, false, rgba);
}

void tli_pixels_pack_bgra(const float *colors, size_t count, const float *background, uint8_t *bgra)
{
    pack(colors, count, background, true, bgra);
}
