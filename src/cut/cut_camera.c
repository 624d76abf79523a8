/* The view: frustum and size on the screen. */
#include "cut/cut_camera.h"

#include "base/base.h"
#include "base/base_vec.h"

#include <string.h>

/* Nearest distance that is looked at, relative to the diagonal of the data set. */
static const double NEAR = 1e-4;
/* Smallest sine of the angle between view and view-up: below, rounding chooses the picture's axes.
 */
static const double SINE_LEAST = 1e-9;
static const double PI = 3.14159265358979323846;

tl_camera tl_camera_defaults(void)
{
    return (tl_camera){
        .position = {0, 0, 1}, .view_up = {0, 1, 0}, .view_angle = 30, .size_px = {1024, 1024}};
}

static bool normalize(double a[3])
{
    double length = vec_length(a);
    if (!(length > 0) || !isfinite(length)) return false;
    for (int k = 0; k < 3; k++) a[k] /= length;
    return true;
}

/* A side plane through the eye (perspective: slope along forward) or beside it (parallel). */
static void set_plane(const tli_view *view, const double side[3], double half, double plane[4])
{
    double n[3];
    for (int k = 0; k < 3; k++)
        n[k] = view->parallel ? -side[k] : view->forward[k] * half - side[k];
    double length = vec_length(n);
    for (int k = 0; k < 3; k++) plane[k] = n[k] / length;
    plane[3] = -vec_dot(plane, view->position) + (view->parallel ? half : 0);
}

static tl_status check_camera(tl_ctx *ctx, const tl_camera *c)
{
    bool finite =
        vec_is_finite(c->position) && vec_is_finite(c->focal_point) && vec_is_finite(c->view_up);
    if (!finite) return tl_fail(ctx, TL_ERR_ARG, "the camera has a place that is not finite");
    if (!c->size_px[0] || !c->size_px[1])
        return tl_fail(ctx, TL_ERR_ARG, "the camera's picture is %u x %u pixels", c->size_px[0],
                       c->size_px[1]);
    if (!(c->parallel_scale >= 0) || !isfinite(c->parallel_scale))
        return tl_fail(ctx, TL_ERR_ARG, "parallel scale %g, expected 0 or more", c->parallel_scale);
    if (c->parallel_scale == 0 && !(c->view_angle > 0 && c->view_angle < 180))
        return tl_fail(ctx, TL_ERR_ARG, "view angle %g, expected more than 0 and less than 180",
                       c->view_angle);
    return TL_OK;
}

tl_status tli_view_set(tl_ctx *ctx, const tl_camera *camera, double diagonal, tli_view *view)
{
    tl_status st = check_camera(ctx, camera);
    if (st) return st;
    tli_view v = {.parallel = camera->parallel_scale > 0, .near = NEAR * diagonal};
    double right[3], up[3];
    for (int k = 0; k < 3; k++) v.position[k] = camera->position[k];
    vec_sub(camera->focal_point, camera->position, v.forward);
    if (!isfinite(vec_length(v.forward)))
        return tl_fail(ctx, TL_ERR_ARG, "the camera is too far from its focal point");
    if (!normalize(v.forward))
        return tl_fail(ctx, TL_ERR_ARG, "the camera's position is its focal point");
    memcpy(up, camera->view_up, sizeof up);
    if (!normalize(up)) return tl_fail(ctx, TL_ERR_ARG, "the camera's view-up has no direction");
    vec_cross(v.forward, up, right);
    if (vec_length(right) < SINE_LEAST || !normalize(right))
        return tl_fail(ctx, TL_ERR_ARG, "the camera's view-up points along its view");
    vec_cross(right, v.forward, up);
    double height = camera->size_px[1], aspect = camera->size_px[0] / height;
    double tall = v.parallel ? camera->parallel_scale : tan(camera->view_angle * PI / 360);
    double wide = tall * aspect;
    for (int side = 0; side < 4; side++) {
        double axis[3];
        for (int k = 0; k < 3; k++) axis[k] = (side < 2 ? right : up)[k] * (side % 2 ? -1 : 1);
        set_plane(&v, axis, side < 2 ? wide : tall, v.planes[side]);
    }
    v.scale = height / (2 * tall);
    /* A length across the line of sight grows towards the corner of a flat picture. */
    if (!v.parallel) v.scale *= sqrt(1 + tall * tall + wide * wide);
    *view = v;
    return TL_OK;
}

tl_status tl_camera_check(tl_ctx *ctx, const tl_camera *camera)
{
    tli_view view;
    return tli_view_set(ctx, camera, 1, &view);
}

bool tli_camera_is_same(const tl_camera *a, const tl_camera *b)
{
    bool same = a->view_angle == b->view_angle && a->parallel_scale == b->parallel_scale;
    for (int k = 0; k < 3; k++)
        same = same && a->position[k] == b->position[k] && a->focal_point[k] == b->focal_point[k] &&
               a->view_up[k] == b->view_up[k];
    return same;
}

double tli_view_pixels(const tli_view *view, const double sphere[4])
{
    for (int i = 0; i < 4; i++)
        if (vec_dot(view->planes[i], sphere) + view->planes[i][3] < -sphere[3]) return 0;
    if (view->parallel) return view->scale;
    double to[3];
    vec_sub(sphere, view->position, to);
    double depth = vec_dot(to, view->forward);
    if (depth + sphere[3] < 0) return 0;
    depth -= sphere[3];
    return view->scale / (depth > view->near ? depth : view->near);
}
