/* Geometry of handles. A drag along an axis follows the point of the axis that is nearest to the
 * line of sight; where the axis runs along the sight, up and right on the picture stand for
 * forward. A tilt follows the pointer on a sphere around the middle of the plane. */
#include "viewer_handles.h"

#include <math.h>
#include <string.h>

/* Corners of the part of a plane in a box. */
enum { CORNERS_MAX = 6 };
/* Corners nearer than this are one, relative to the size of the bounds. */
static const double SAME = 1e-9;
/* Depth at which lines are cut off in front of a camera, relative to the size of the bounds. */
static const double NEAR = 1e-6;
/* Least squared sine of the angle between an axis and the sight at which a drag follows the axis.
 */
static const double SINE_LEAST = 0.02;
/* Least side of a dragged box, relative to that of the bounds. */
static const double SIDE_LEAST = 1e-3;

/* ---- vectors ---- */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out = a + t * b */
static void along(const double a[3], double t, const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) out[k] = a[k] + t * b[k];
}

static bool make_unit(double a[3])
{
    const double length = sqrt(dot(a, a));
    for (int k = 0; k < 3; k++) a[k] /= length;
    return length > 0 && isfinite(length);
}

static double size_of(const double bounds[6])
{
    return hypot(hypot(bounds[1] - bounds[0], bounds[3] - bounds[2]), bounds[5] - bounds[4]);
}

/* ---- the picture ---- */

/* Mesh units of a pixel at a place; 0 behind the camera. */
static double unit_of_pixel(const tl_camera *camera, const double xyz[3])
{
    double px[2], distance;
    const double half = tan(camera->view_angle * acos(-1) / 360);
    if (!tl_camera_project(camera, xyz, px, &distance)) return 0;
    const double tall = camera->parallel_scale > 0 ? camera->parallel_scale : distance * half;
    return 2 * tall / camera->size_px[1];
}

static void add_dot(viewer_handle_shape *shape, const tl_camera *camera, const double xyz[3],
                    viewer_handle_part part)
{
    double px[2], distance;
    if (shape->dot_count == VIEWER_HANDLE_DOTS_MAX ||
        !tl_camera_project(camera, xyz, px, &distance))
        return;
    shape->dots[shape->dot_count++] = (viewer_handle_dot){px[0], px[1], part};
}

/* Distance along the view, negative behind the camera. */
static double depth_of(const tl_camera *camera, const double xyz[3])
{
    double forward[3], to[3];
    along(camera->focal_point, -1, camera->position, forward);
    along(xyz, -1, camera->position, to);
    return make_unit(forward) ? dot(to, forward) : 0;
}

static void add_line(viewer_handle_shape *shape, const tl_camera *camera, const double a[3],
                     const double b[3], double near, viewer_handle_part part)
{
    double ends[2][3], px[2][2], distance;
    const double depths[2] = {depth_of(camera, a), depth_of(camera, b)};
    memcpy(ends[0], a, sizeof ends[0]);
    memcpy(ends[1], b, sizeof ends[1]);
    for (int i = 0; i < 2 && !(camera->parallel_scale > 0); i++) {
        if (depths[i] >= near) continue;
        if (!(depths[1 - i] > near)) return;
        const double t = (near - depths[i]) / (depths[1 - i] - depths[i]);
        for (int k = 0; k < 3; k++)
            ends[i][k] = i ? b[k] + t * (a[k] - b[k]) : a[k] + t * (b[k] - a[k]);
    }
    for (int i = 0; i < 2; i++)
        if (!tl_camera_project(camera, ends[i], px[i], &distance)) return;
    if (shape->line_count == VIEWER_HANDLE_LINES_MAX) return;
    shape->lines[shape->line_count++] =
        (viewer_handle_line){{px[0][0], px[1][0]}, {px[0][1], px[1][1]}, part};
}

/* ---- planes ---- */

/* Adds a corner unless it is there: in a corner of the box three of its edges meet. */
static void add_corner(double corners[CORNERS_MAX][3], int *count, const double at[3], double size)
{
    for (int i = 0; i < *count; i++) {
        double to[3];
        along(at, -1, corners[i], to);
        if (dot(to, to) <= SAME * SAME * size * size) return;
    }
    if (*count < CORNERS_MAX) memcpy(corners[(*count)++], at, 3 * sizeof *at);
}

/* The polygon of a plane (unit normal) in the bounds, in order around it. */
static int plane_corners(const double bounds[6], const double plane[6],
                         double corners[CORNERS_MAX][3])
{
    double u[3], v[3], middle[3] = {0}, angles[CORNERS_MAX];
    const double *n = plane + 3;
    int count = 0;
    for (int edge = 0; edge < 12; edge++) {
        const int axis = edge / 4, p = (axis + 1) % 3, q = (axis + 2) % 3;
        double a[3], from[3];
        a[axis] = bounds[2 * axis];
        a[p] = bounds[2 * p + (edge & 1)];
        a[q] = bounds[2 * q + (edge >> 1 & 1)];
        along(a, -1, plane, from);
        const double side = bounds[2 * axis + 1] - bounds[2 * axis], t = -dot(from, n) / n[axis];
        if (n[axis] == 0 || !(t >= 0 && t <= side)) continue;
        a[axis] += t;
        add_corner(corners, &count, a, size_of(bounds));
    }
    for (int i = 0; i < count; i++) along(middle, 1.0 / count, corners[i], middle);
    const int flat = fabs(n[0]) <= fabs(n[1]) && fabs(n[0]) <= fabs(n[2]) ? 0
                     : fabs(n[1]) <= fabs(n[2])                           ? 1
                                                                          : 2;
    for (int k = 0; k < 3; k++) u[k] = (k == flat) - n[flat] * n[k];
    make_unit(u);
    for (int k = 0; k < 3; k++)
        v[k] = n[(k + 1) % 3] * u[(k + 2) % 3] - n[(k + 2) % 3] * u[(k + 1) % 3];
    for (int i = 0; i < count; i++) {
        double from[3], corner[3];
        memcpy(corner, corners[i], sizeof corner);
        along(corner, -1, middle, from);
        const double angle = atan2(dot(from, v), dot(from, u));
        int at = i;
        for (; at > 0 && angles[at - 1] > angle; at--) {
            angles[at] = angles[at - 1];
            memcpy(corners[at], corners[at - 1], sizeof corner);
        }
        angles[at] = angle;
        memcpy(corners[at], corner, sizeof corner);
    }
    return count;
}

/* The plane with a unit normal and, as its point, the middle of what it has of the bounds, or the
 * point nearest to their middle. */
static bool center_plane(const double bounds[6], const double plane[6], double centered[6])
{
    double corners[CORNERS_MAX][3], middle[3], from[3];
    memcpy(centered, plane, 6 * sizeof *centered);
    if (!make_unit(centered + 3)) return false;
    const int count = plane_corners(bounds, centered, corners);
    for (int k = 0; k < 3; k++) middle[k] = bounds[2 * k] / 2 + bounds[2 * k + 1] / 2;
    if (count) {
        double sum[3] = {0};
        for (int i = 0; i < count; i++) along(sum, 1.0 / count, corners[i], sum);
        memcpy(centered, sum, sizeof sum);
        return true;
    }
    along(middle, -1, plane, from);
    along(middle, -dot(from, centered + 3), centered + 3, centered);
    return true;
}

void viewer_handle_plane(const tl_camera *camera, const double bounds[6], const double plane[6],
                         double arm_px, viewer_handle_shape *shape)
{
    double corners[CORNERS_MAX][3], p[6], ends[2][3];
    *shape = (viewer_handle_shape){0};
    if (!center_plane(bounds, plane, p)) return;
    const double near = NEAR * size_of(bounds), arm = arm_px * unit_of_pixel(camera, p);
    const int count = plane_corners(bounds, p, corners);
    for (int i = 0; i < count; i++)
        add_line(shape, camera, corners[i], corners[(i + 1) % count], near, VIEWER_HANDLE_SHIFT);
    for (int i = 0; i < 2; i++) {
        along(p, i ? -arm : arm, p + 3, ends[i]);
        add_line(shape, camera, p, ends[i], near, VIEWER_HANDLE_SHIFT);
    }
    add_dot(shape, camera, p, VIEWER_HANDLE_SHIFT);
    add_dot(shape, camera, ends[0], VIEWER_HANDLE_TILT);
    add_dot(shape, camera, ends[1], VIEWER_HANDLE_TILT_BACK);
}

/* ---- boxes ---- */

static void box_middle(const double box[6], double middle[3])
{
    for (int k = 0; k < 3; k++) middle[k] = box[k] / 2 + box[3 + k] / 2;
}

void viewer_handle_box(const tl_camera *camera, const double box[6], viewer_handle_shape *shape)
{
    double middle[3], a[3], b[3];
    *shape = (viewer_handle_shape){0};
    const double size = hypot(hypot(box[3] - box[0], box[4] - box[1]), box[5] - box[2]);
    for (int edge = 0; edge < 12; edge++) {
        const int axis = edge / 4, p = (axis + 1) % 3, q = (axis + 2) % 3;
        a[axis] = box[axis];
        a[p] = box[p + 3 * (edge & 1)];
        a[q] = box[q + 3 * (edge >> 1 & 1)];
        memcpy(b, a, sizeof b);
        b[axis] = box[3 + axis];
        add_line(shape, camera, a, b, NEAR * size, VIEWER_HANDLE_NONE);
    }
    box_middle(box, middle);
    add_dot(shape, camera, middle, VIEWER_HANDLE_CARRY);
    for (int face = 0; face < VIEWER_HANDLE_FACES; face++) {
        memcpy(a, middle, sizeof a);
        a[face / 2] = box[face / 2 + 3 * (face & 1)];
        add_dot(shape, camera, a, (viewer_handle_part)(VIEWER_HANDLE_FACE + face));
    }
}

/* ---- what a pointer is at ---- */

static double distance_to_line(const viewer_handle_line *line, double x, double y)
{
    const double dx = line->x[1] - line->x[0], dy = line->y[1] - line->y[0];
    const double square = dx * dx + dy * dy;
    double t = square > 0 ? ((x - line->x[0]) * dx + (y - line->y[0]) * dy) / square : 0;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return hypot(x - line->x[0] - t * dx, y - line->y[0] - t * dy);
}

viewer_handle_part viewer_handle_at(const viewer_handle_shape *shape, double x, double y,
                                    double reach_px)
{
    viewer_handle_part part = VIEWER_HANDLE_NONE;
    double nearest = reach_px;
    for (int i = 0; i < shape->dot_count; i++) {
        const double distance = hypot(x - shape->dots[i].x, y - shape->dots[i].y);
        if (!(distance <= nearest)) continue;
        nearest = distance;
        part = shape->dots[i].part;
    }
    if (part != VIEWER_HANDLE_NONE) return part;
    nearest = reach_px / 2;
    for (int i = 0; i < shape->line_count; i++) {
        if (shape->lines[i].part == VIEWER_HANDLE_NONE) continue;
        const double distance = distance_to_line(&shape->lines[i], x, y);
        if (!(distance <= nearest)) continue;
        nearest = distance;
        part = shape->lines[i].part;
    }
    return part;
}

/* ---- drags ---- */

/* How far along an axis (unit) through a place the pointer has gone. */
static double axis_drag(const viewer_handle_drag *drag, const double place[3], const double axis[3],
                        double x, double y)
{
    double t[2], origin[3], sight[3], from[3];
    const double px[2][2] = {{drag->from[0], drag->from[1]}, {x, y}};
    for (int i = 0; i < 2; i++) {
        tl_camera_ray(&drag->camera, px[i][0], px[i][1], origin, sight);
        along(origin, -1, place, from);
        const double cosine = dot(axis, sight), square = 1 - cosine * cosine;
        if (!(square > SINE_LEAST)) {
            const double unit = unit_of_pixel(&drag->camera, place);
            const double gone = (x - drag->from[0]) - (y - drag->from[1]);
            return (cosine < 0 ? -gone : gone) * unit;
        }
        t[i] = (dot(axis, from) - cosine * dot(sight, from)) / square;
    }
    return t[1] - t[0];
}

/* The end of the arm turns with the pointer on the sphere around the middle; off the sphere it is
 * at its rim. */
static void tilt(const viewer_handle_drag *drag, const double center[3], double arm, double x,
                 double y, double normal[3])
{
    double origin[3], sight[3], from[3], tip[3];
    tl_camera_ray(&drag->camera, x, y, origin, sight);
    along(origin, -1, center, from);
    const double middle = -dot(from, sight);
    along(from, middle, sight, tip); /* nearest to the centre, seen from it */
    const double square = arm * arm - dot(tip, tip);
    /* the half of the sphere on which the end was stays that of the end */
    const double side = dot(normal, sight) <= 0 ? -1 : 1;
    if (square > 0) along(tip, side * sqrt(square), sight, tip);
    if (make_unit(tip)) memcpy(normal, tip, sizeof tip);
}

void viewer_handle_drag_plane(const viewer_handle_drag *drag, double x, double y, double value[6])
{
    double p[6];
    memcpy(value, drag->value, sizeof p);
    if (!center_plane(drag->bounds, drag->value, p)) return;
    if (drag->part == VIEWER_HANDLE_TILT || drag->part == VIEWER_HANDLE_TILT_BACK) {
        const double sign = drag->part == VIEWER_HANDLE_TILT ? 1 : -1;
        const double arm = drag->arm_px * unit_of_pixel(&drag->camera, p);
        double normal[3];
        for (int k = 0; k < 3; k++) normal[k] = sign * p[3 + k];
        tilt(drag, p, arm, x, y, normal);
        for (int k = 0; k < 3; k++) p[3 + k] = sign * normal[k];
    } else {
        double low = 0, high = 0; /* how far the bounds reach on its sides */
        for (int corner = 0; corner < 8; corner++) {
            double from[3];
            for (int k = 0; k < 3; k++) from[k] = drag->bounds[2 * k + (corner >> k & 1)] - p[k];
            low = fmin(low, dot(from, p + 3));
            high = fmax(high, dot(from, p + 3));
        }
        const double gone = axis_drag(drag, p, p + 3, x, y);
        along(p, fmax(low, fmin(gone, high)), p + 3, p);
    }
    for (int i = 0; i < 6; i++)
        if (!isfinite(p[i])) return;
    memcpy(value, p, sizeof p);
}

/* Moves a box across the line of sight, as its middle follows the pointer. */
static void carry(const viewer_handle_drag *drag, double x, double y, double value[6])
{
    double middle[3], ends[2][3], forward[3];
    const double px[2][2] = {{drag->from[0], drag->from[1]}, {x, y}};
    box_middle(drag->value, middle);
    const double depth = depth_of(&drag->camera, middle);
    along(drag->camera.focal_point, -1, drag->camera.position, forward);
    if (!make_unit(forward)) return;
    for (int i = 0; i < 2; i++) {
        double origin[3], sight[3], from[3];
        tl_camera_ray(&drag->camera, px[i][0], px[i][1], origin, sight);
        along(origin, -1, drag->camera.position, from);
        along(origin, (depth - dot(from, forward)) / dot(sight, forward), sight, ends[i]);
    }
    for (int k = 0; k < 3; k++) {
        const double low = fmin(drag->bounds[2 * k] - drag->value[k], 0);
        const double high = fmax(drag->bounds[2 * k + 1] - drag->value[3 + k], 0);
        const double gone = fmax(low, fmin(ends[1][k] - ends[0][k], high));
        value[k] += gone;
        value[3 + k] += gone;
    }
}

void viewer_handle_drag_box(const viewer_handle_drag *drag, double x, double y, double value[6])
{
    memcpy(value, drag->value, sizeof drag->value);
    if (drag->part == VIEWER_HANDLE_CARRY) {
        carry(drag, x, y, value);
    } else if (drag->part >= VIEWER_HANDLE_FACE && (int)drag->part < VIEWER_HANDLE_END) {
        const int axis = (drag->part - VIEWER_HANDLE_FACE) / 2,
                  far = (drag->part - VIEWER_HANDLE_FACE) % 2;
        const double side = drag->bounds[2 * axis + 1] - drag->bounds[2 * axis];
        double place[3], direction[3] = {0};
        box_middle(drag->value, place);
        place[axis] = drag->value[axis + 3 * far];
        direction[axis] = 1;
        double at = place[axis] + axis_drag(drag, place, direction, x, y);
        if (far)
            at = fmax(drag->value[axis] + SIDE_LEAST * side,
                      fmin(at, fmax(drag->bounds[2 * axis + 1], drag->value[3 + axis])));
        else
            at = fmin(drag->value[3 + axis] - SIDE_LEAST * side,
                      fmax(at, fmin(drag->bounds[2 * axis], drag->value[axis])));
        value[axis + 3 * far] = at;
    }
    for (int i = 0; i < 6; i++)
        if (!isfinite(value[i])) memcpy(value, drag->value, sizeof drag->value);
}
