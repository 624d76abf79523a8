/* How a camera moves: rigid turns around a pivot, moves across and along the view, scaling about a
 * point. Directions are made anew from the camera's own each time, never from the axis of a
 * turntable, so that nothing is lost at its ends. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "scene/scene.h"

static const double PI = 3.14159265358979323846;
/* The view angle of a view in words, degrees, as of tl_camera_fit. */
static const double STAND_ANGLE = 30;
/* A zoom ends where the distance is this part of the coordinates, which then have no digits left
 * for the direction, and where it is so large. */
static const double DISTANCE_LEAST = 1e-9, DISTANCE_MOST = 1e150;
/* Of the axis, from which on the picture is upside down: at the ends of the axis it is not. */
static const double UPSIDE_DOWN = -1e-6;

/* The camera's directions, of length 1, and the distance of the focal point. */
typedef struct basis {
    double right[3], up[3], forward[3], distance;
} basis;

/* To length 1, whatever the size of the numbers; gives the length, 0 if there is none. */
static double normalize(double a[3])
{
    const double most = fmax(fabs(a[0]), fmax(fabs(a[1]), fabs(a[2])));
    if (!(most > 0) || !isfinite(most)) return 0;
    for (int k = 0; k < 3; k++) a[k] /= most;
    const double length = vec_length(a);
    for (int k = 0; k < 3; k++) a[k] /= length;
    return length * most;
}

static bool basis_of(const tl_camera *camera, basis *b)
{
    double up[3] = {camera->view_up[0], camera->view_up[1], camera->view_up[2]};
    vec_sub(camera->focal_point, camera->position, b->forward);
    b->distance = normalize(b->forward);
    if (!(b->distance > 0) || !(normalize(up) > 0)) return false;
    vec_cross(b->forward, up, b->right);
    if (!(normalize(b->right) > DBL_EPSILON)) return false;
    vec_cross(b->right, b->forward, b->up);
    return true;
}

/* Half the height of what is seen at a distance along the view. */
static double half_height(const tl_camera *camera, double distance)
{
    return camera->parallel_scale > 0 ? camera->parallel_scale
                                      : distance * tan(camera->view_angle * PI / 360);
}

static void add(double to[3], double factor, const double a[3])
{
    for (int k = 0; k < 3; k++) to[k] += factor * a[k];
}

/* Turns a vector around an axis of length 1 (Rodrigues). */
static void turn(const double axis[3], double degrees, double v[3])
{
    double across[3];
    const double c = cos(degrees * PI / 180), s = sin(degrees * PI / 180);
    const double along = vec_dot(axis, v);
    vec_cross(axis, v, across);
    for (int k = 0; k < 3; k++) v[k] = v[k] * c + across[k] * s + axis[k] * along * (1 - c);
}

/* Turns the camera as a whole; axis has length 1. */
static void turn_all(tl_camera *camera, const double pivot[3], const double axis[3], double degrees)
{
    for (int end = 0; end < 2; end++) {
        double *place = end ? camera->focal_point : camera->position, from[3];
        vec_sub(place, pivot, from);
        turn(axis, degrees, from);
        for (int k = 0; k < 3; k++) place[k] = pivot[k] + from[k];
    }
    turn(axis, degrees, camera->view_up);
}

/* The turn that is left of one by degrees over the top, if it ends at the ends of the axis. */
static double over_top(const basis *b, const double axis[3], double degrees)
{
    double elevation = atan2(-vec_dot(axis, b->forward), vec_dot(axis, b->up)) * 180 / PI;
    const bool is_over = vec_dot(axis, b->up) < UPSIDE_DOWN;
    if (is_over && elevation < 0) elevation += 360;
    const double middle = is_over ? 180 : 0;
    return fmin(fmax(elevation + degrees, middle - 90), middle + 90) - elevation;
}

/* Turns around a center: to the right around the axis, upwards around the camera's right. */
static void turn_table(tl_camera *camera, const double center[3], double right, double up,
                       const double given_axis[3])
{
    basis b;
    double axis[3] = {0, 0, 1};
    const double pivot[3] = {center[0], center[1], center[2]};
    if (given_axis) memcpy(axis, given_axis, sizeof axis);
    if (!(normalize(axis) > 0) || !basis_of(camera, &b)) return;
    memcpy(camera->view_up, b.up, sizeof b.up);
    turn_all(camera, pivot, b.right, -over_top(&b, axis, up));
    turn_all(camera, pivot, axis, vec_dot(axis, b.up) < UPSIDE_DOWN ? -right : right);
}

void tl_camera_orbit(tl_camera *camera, const double pivot[3], double right, double up,
                     tl_orbit_style style, const double axis[3])
{
    basis b;
    if (!isfinite(right) || !isfinite(up) || !basis_of(camera, &b)) return;
    if (!pivot) pivot = camera->focal_point;
    if (style == TL_ORBIT_TURNTABLE) {
        turn_table(camera, pivot, right, up, axis);
        return;
    }
    const double center[3] = {pivot[0], pivot[1], pivot[2]};
    memcpy(camera->view_up, b.up, sizeof b.up);
    turn_all(camera, center, b.up, right);
    if (basis_of(camera, &b)) turn_all(camera, center, b.right, -up);
}

void tl_camera_spin(tl_camera *camera, const double pivot[3], const double axis[3], double angle)
{
    double unit[3] = {axis[0], axis[1], axis[2]};
    const double center[3] = {pivot[0], pivot[1], pivot[2]};
    if (isfinite(angle) && normalize(unit) > 0) turn_all(camera, center, unit, angle);
}

void tl_camera_roll(tl_camera *camera, double angle)
{
    basis b;
    if (!isfinite(angle) || !basis_of(camera, &b)) return;
    memcpy(camera->view_up, b.up, sizeof b.up);
    turn(b.forward, -angle, camera->view_up);
}

static void move(tl_camera *camera, double factor, const double direction[3])
{
    add(camera->position, factor, direction);
    add(camera->focal_point, factor, direction);
}

void tl_camera_pan(tl_camera *camera, double right_px, double down_px, double distance)
{
    basis b;
    if (!basis_of(camera, &b) || !isfinite(right_px) || !isfinite(down_px)) return;
    const double seen = half_height(camera, distance > 0 ? distance : b.distance);
    const double unit = 2 * seen / camera->size_px[1];
    move(camera, -right_px * unit, b.right);
    move(camera, down_px * unit, b.up);
}

/* The place across the view of a pixel, in half heights of the picture. */
static void across_of(const tl_camera *camera, double x_px, double y_px, double out[2])
{
    const double width = camera->size_px[0], height = camera->size_px[1];
    out[0] = (2 * x_px - width) / height;
    out[1] = 1 - 2 * y_px / height;
}

void tl_camera_zoom(tl_camera *camera, double factor, const double point[3])
{
    basis b;
    tl_camera c = *camera;
    double from[3], coordinates = 0;
    if (!(factor > 0) || !isfinite(factor) || !basis_of(camera, &b)) return;
    const double *about = point ? point : camera->focal_point;
    if (c.parallel_scale > 0) {
        vec_sub(about, c.position, from);
        c.parallel_scale /= factor;
        const double right = vec_dot(from, b.right), up = vec_dot(from, b.up);
        move(&c, right * (1 - 1 / factor), b.right);
        move(&c, up * (1 - 1 / factor), b.up);
    } else {
        for (int k = 0; k < 3; k++) {
            c.position[k] = about[k] + (camera->position[k] - about[k]) / factor;
            c.focal_point[k] = c.position[k] + b.forward[k] * b.distance / factor;
        }
    }
    for (int k = 0; k < 3; k++) coordinates = fmax(coordinates, fabs(c.focal_point[k]));
    const double size = c.parallel_scale > 0 ? c.parallel_scale : b.distance / factor;
    if (size > DISTANCE_LEAST * coordinates && size > DBL_MIN && size < DISTANCE_MOST) *camera = c;
}

void tl_camera_zoom_px(tl_camera *camera, double factor, double x_px, double y_px)
{
    basis b;
    double origin[3], direction[3];
    if (!basis_of(camera, &b) || !isfinite(x_px) || !isfinite(y_px)) return;
    tl_camera_ray(camera, x_px, y_px, origin, direction);
    add(origin, b.distance / vec_dot(direction, b.forward), direction);
    tl_camera_zoom(camera, factor, origin);
}

void tl_camera_fly(tl_camera *camera, const double axis[3], double right, double up,
                   const double forward_right_up[3])
{
    basis b;
    if (!isfinite(right) || !isfinite(up) || !vec_is_finite(forward_right_up)) return;
    turn_table(camera, camera->position, -right, -up, axis);
    if (!basis_of(camera, &b)) return;
    move(camera, forward_right_up[0], b.forward);
    move(camera, forward_right_up[1], b.right);
    move(camera, forward_right_up[2], b.up);
}

void tl_camera_set_parallel(tl_camera *camera, bool parallel)
{
    basis b;
    if (parallel == (camera->parallel_scale > 0) || !basis_of(camera, &b)) return;
    if (parallel) {
        camera->parallel_scale = half_height(camera, b.distance);
        return;
    }
    const double distance = camera->parallel_scale / tan(camera->view_angle * PI / 360);
    camera->parallel_scale = 0;
    memcpy(camera->position, camera->focal_point, sizeof camera->position);
    add(camera->position, -distance, b.forward);
}

void tl_camera_fit_box(tl_camera *camera, const double bounds[6], const double window[4],
                       double zoom)
{
    static const double ALL[4] = {-1, 1, -1, 1};
    double corners[8][3];
    for (size_t i = 0; i < 8; i++)
        for (size_t k = 0; k < 3; k++) corners[i][k] = bounds[2 * k + (i >> k & 1)];
    tl_camera_fit_points(camera, corners[0], 8, window ? window : ALL, zoom > 0 ? zoom : 1);
}

void tl_camera_stand(tl_camera *camera, const double view[3], const double bounds[6],
                     const double window[4])
{
    const bool parallel = camera->parallel_scale > 0;
    *camera = tl_camera_fit(bounds, view[0], view[1], 1, camera->size_px[0], camera->size_px[1]);
    camera->view_angle = STAND_ANGLE;
    if (parallel) camera->parallel_scale = 1;
    tl_camera_fit_box(camera, bounds, window, view[2]);
}

void tl_camera_ray(const tl_camera *camera, double x_px, double y_px, double origin[3],
                   double direction[3])
{
    basis b;
    double across[2];
    memset(origin, 0, 3 * sizeof *origin);
    memset(direction, 0, 3 * sizeof *direction);
    if (!basis_of(camera, &b)) return;
    across_of(camera, x_px, y_px, across);
    const double half = half_height(camera, 1);
    memcpy(origin, camera->position, 3 * sizeof *origin);
    memcpy(direction, b.forward, 3 * sizeof *direction);
    double *moved = camera->parallel_scale > 0 ? origin : direction;
    add(moved, across[0] * half, b.right);
    add(moved, across[1] * half, b.up);
    normalize(direction);
}

bool tl_camera_project(const tl_camera *camera, const double xyz[3], double px[2], double *distance)
{
    basis b;
    double from[3];
    px[0] = px[1] = *distance = 0;
    if (!basis_of(camera, &b)) return false;
    vec_sub(xyz, camera->position, from);
    *distance = vec_dot(from, b.forward);
    if (!(camera->parallel_scale > 0) && !(*distance > 0)) return false;
    const double half = half_height(camera, *distance), height = camera->size_px[1];
    px[0] = camera->size_px[0] / 2.0 + vec_dot(from, b.right) / half * height / 2;
    px[1] = height / 2 - vec_dot(from, b.up) / half * height / 2;
    return true;
}
