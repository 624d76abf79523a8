/* The camera: from places in space to places on the picture, and the camera of a first look. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "draw/draw.h"

static const double PI = 3.14159265358979323846;
/* Pixels by which rays pass beside the middles of theirs, so that none runs along edges of a grid
 * that is seen from the front. */
static const double ASIDE[2] = {0.00137, 0.00071};
/* View angle of a first look, degrees, as VTK's. */
static const double FIT_ANGLE = 30;
/* Binary exponents of a frame's unit: it and its inverse are normal numbers. */
enum { UNIT_EXPONENT_MAX = 1000 };

static bool normalize(double a[3])
{
    double length = vec_length(a);
    if (!(length > 0) || !isfinite(length)) return false;
    for (int k = 0; k < 3; k++) a[k] /= length;
    return true;
}

tl_status tli_frame_set(tl_ctx *ctx, const tl_camera *camera, const tl_image *image,
                        tli_frame *frame)
{
    tli_frame f = {.parallel = camera->parallel_scale > 0};
    if (camera->size_px[0] != image->width || camera->size_px[1] != image->height)
        return tl_fail(ctx, TL_ERR_ARG, "the camera is for %u x %u pixels, the picture has %u x %u",
                       camera->size_px[0], camera->size_px[1], image->width, image->height);
    if (!vec_is_finite(camera->position) || !vec_is_finite(camera->focal_point) ||
        !vec_is_finite(camera->view_up) || !(camera->parallel_scale >= 0) ||
        !isfinite(camera->parallel_scale))
        return tl_fail(ctx, TL_ERR_ARG, "the camera has numbers that are not finite");
    if (!f.parallel && !(camera->view_angle > 0 && camera->view_angle < 180))
        return tl_fail(ctx, TL_ERR_ARG, "view angle %g, expected more than 0 and less than 180",
                       camera->view_angle);
    memcpy(f.origin, camera->position, sizeof f.origin);
    vec_sub(camera->focal_point, camera->position, f.forward);
    if (!isfinite(vec_length(f.forward)))
        return tl_fail(ctx, TL_ERR_ARG, "the camera is too far from its focal point");
    int exponent;
    frexp(f.parallel ? camera->parallel_scale : vec_length(f.forward), &exponent);
    exponent = exponent > UNIT_EXPONENT_MAX ? UNIT_EXPONENT_MAX : exponent;
    f.unit = ldexp(1, exponent < -UNIT_EXPONENT_MAX ? -UNIT_EXPONENT_MAX : exponent);
    if (!normalize(f.forward))
        return tl_fail(ctx, TL_ERR_ARG, "the camera's position is its focal point");
    vec_cross(f.forward, camera->view_up, f.right);
    if (!normalize(f.right))
        return tl_fail(ctx, TL_ERR_ARG, "the camera's view-up points along its view");
    vec_cross(f.right, f.forward, f.up);
    double half = f.parallel ? camera->parallel_scale : tan(camera->view_angle * PI / 360);
    f.scale = image->height / (2 * half) * (f.parallel ? f.unit : 1);
    f.middle[0] = image->width / 2.0 + ASIDE[0];
    f.middle[1] = image->height / 2.0 + ASIDE[1];
    *frame = f;
    return TL_OK;
}

void tli_frame_place(const tli_frame *frame, const double xyz[3], double out[3])
{
    double from[3];
    vec_sub(xyz, frame->origin, from);
    for (int k = 0; k < 3; k++) from[k] /= frame->unit;
    out[0] = vec_dot(from, frame->right) * frame->scale;
    out[1] = vec_dot(from, frame->up) * frame->scale;
    out[2] = vec_dot(from, frame->forward);
}

tl_camera tl_camera_fit(const double bounds[6], double azimuth, double elevation, double zoom,
                        uint32_t width, uint32_t height)
{
    tl_camera c = tl_camera_defaults();
    double a = azimuth * PI / 180, e = elevation * PI / 180, radius = 0, aspect;
    double out[3] = {sin(a) * cos(e), -cos(a) * cos(e), sin(e)};
    double up[3] = {-sin(a) * sin(e), cos(a) * sin(e), cos(e)};
    c.size_px[0] = width;
    c.size_px[1] = height;
    c.view_angle = FIT_ANGLE;
    for (int k = 0; k < 3; k++) {
        double side = bounds[2 * k + 1] - bounds[2 * k];
        radius += side * side / 4;
    }
    radius = radius > 0 ? sqrt(radius) : 1;
    /* the sphere around the box touches the nearer pair of sides */
    aspect = (double)width / height;
    double half = tan(FIT_ANGLE * PI / 360) * (aspect < 1 ? aspect : 1);
    double distance = radius / sin(atan(half)) / (zoom > 0 ? zoom : 1);
    for (int k = 0; k < 3; k++) {
        c.focal_point[k] = bounds[2 * k] / 2 + bounds[2 * k + 1] / 2;
        c.position[k] = c.focal_point[k] + distance * out[k];
        c.view_up[k] = up[k];
    }
    return c;
}
