/* Pictures of things, drawn on the processor. */
#ifndef TETRALOD_TESTS_CHECK_PICTURE_H
#define TETRALOD_TESTS_CHECK_PICTURE_H

#include "tetralod/draw.h"

#include "check.h"

/* Looks along -z at the origin: parallel, 100 pixels a unit, or with a view angle from a distance
 * of 10. The middle of the picture lies between pixels for an even side. */
static inline tl_camera picture_camera(uint32_t side, bool parallel)
{
    tl_camera camera = tl_camera_defaults();
    camera.position[2] = 10;
    camera.parallel_scale = parallel ? side / 200.0 : 0;
    camera.size_px[0] = camera.size_px[1] = side;
    return camera;
}

static inline tl_image *picture_empty(tl_ctx *ctx, const tl_camera *camera)
{
    tl_image *image = NULL;
    CHECK_OK(ctx, tl_image_create(ctx, camera->size_px[0], camera->size_px[1], &image));
    return image;
}

static inline tl_renderer *picture_renderer(tl_ctx *ctx)
{
    tl_renderer *r = NULL;
    CHECK_OK(ctx, tl_renderer_create(ctx, TL_RENDERER_CPU, &r));
    return r;
}

static inline tl_image *picture_take(tl_ctx *ctx, tl_renderer *r, const tl_camera *camera)
{
    tl_image *image = picture_empty(ctx, camera);
    CHECK_OK(ctx, tl_renderer_draw(ctx, r, camera, image));
    return image;
}

/* The same of a renderer that is not needed any more. */
static inline tl_image *picture_of(tl_ctx *ctx, tl_renderer *r, const tl_camera *camera)
{
    tl_image *image = picture_take(ctx, r, camera);
    tl_renderer_destroy(ctx, r);
    return image;
}

/* Draws where anything may fail. */
static inline tl_status picture_try(tl_ctx *ctx, tl_renderer *r, const tl_camera *camera)
{
    tl_image *image = NULL;
    tl_status st = tl_image_create(ctx, camera->size_px[0], camera->size_px[1], &image);
    if (!st) st = tl_renderer_draw(ctx, r, camera, image);
    tl_image_destroy(ctx, image);
    return st;
}

/* Nothing but these lines. */
static inline tl_image *picture_of_lines(tl_ctx *ctx, const tl_polydata *lines, const tl_look *look,
                                         const tl_line_opts *opts, const tl_camera *camera)
{
    tl_renderer *r = picture_renderer(ctx);
    CHECK_OK(ctx, tl_renderer_add_lines(ctx, r, lines, look, opts, NULL));
    return picture_of(ctx, r, camera);
}

static inline const float *picture_pixel(const tl_image *image, size_t x, size_t y)
{
    return image->rgba + 4 * (y * image->width + x);
}

static inline const float *picture_middle(const tl_image *image)
{
    return picture_pixel(image, image->width / 2, image->height / 2);
}

static inline double picture_opacity(const tl_image *image, size_t x, size_t y)
{
    return (double)picture_pixel(image, x, y)[3];
}

/* Opacity of all pixels, in pixels. */
static inline double picture_covered(const tl_image *image)
{
    double sum = 0;
    for (size_t y = 0; y < image->height; y++)
        for (size_t x = 0; x < image->width; x++) sum += picture_opacity(image, x, y);
    return sum;
}

/* Of one size: the same bits. */
static inline bool picture_same(const tl_image *a, const tl_image *b)
{
    size_t count = (size_t)a->width * a->height;
    return memcmp(a->rgba, b->rgba, 4 * count * sizeof(float)) == 0 &&
           memcmp(a->depth, b->depth, count * sizeof(float)) == 0;
}

#endif
