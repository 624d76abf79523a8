/* Pictures of things, drawn on the processor. */
#ifndef TETRALOD_TESTS_CHECK_PICTURE_H
#define TETRALOD_TESTS_CHECK_PICTURE_H

#include "tetralod/draw.h"

#include "check.h"

/* Looks along -z at the origin: parallel, 100 pixels a unit, or with a view angle from a distance
 * of
 * 10. The middle of the picture lies between pixels for an even side. */
static inline tl_camera picture_camera(uint32_t side, bool parallel)
{
    tl_camera camera = tl_camera_defaults();
    camera.position[2] = 10;
    camera.parallel_scale = parallel ? side / 200.0 : 0;
    camera.size_px[0] = camera.size_px[1] = side;
    return camera;
}

/* Nothing but these lines. */
static inline tl_image *picture_of_lines(tl_ctx *ctx, const tl_polydata *lines, const tl_look *look,
                                         const tl_line_opts *opts, const tl_camera *camera)
{
    tl_image *image = NULL;
    tl_renderer *r = NULL;
    CHECK_OK(ctx, tl_image_create(ctx, camera->size_px[0], camera->size_px[1], &image));
    CHECK_OK(ctx, tl_renderer_create(ctx, TL_RENDERER_CPU, &r));
    CHECK_OK(ctx, tl_renderer_add_lines(ctx, r, lines, look, opts, NULL));
    CHECK_OK(ctx, tl_renderer_draw(ctx, r, camera, image));
    tl_renderer_destroy(ctx, r);
    return image;
}

static inline const float *picture_pixel(const tl_image *image, size_t x, size_t y)
{
    return image->rgba + 4 * (y * image->width + x);
}

static inline double picture_opacity(const tl_image *image, size_t x, size_t y)
{
    return (double)picture_pixel(image, x, y)[3];
}

#endif
