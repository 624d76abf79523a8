/* Moves a camera until points fill a part of its picture. In the camera's directions a point has x,
 * y across and z along the view; seen from a distance d it lies in the window if
 * low t (d + z) <= x - p <= high t (d + z), t the tangent of half the view angle and p the place of
 * the camera across. Each pair of points bounds d from below; the largest bound is exact. */
#include <math.h>

#include "base/base_vec.h"
#include "draw/draw.h"

static const double PI = 3.14159265358979323846;
/* The camera keeps off the points by this part of their extent. */
static const double OFF = 0.05;

/* Extremes that the pairs of points need: of x - high t z and of x - low t z. */
typedef struct reach {
    double above, below;
} reach;

typedef struct view {
    double forward[3], across[2][3]; /* to the right and up */
    double t[2];                     /* of a parallel view: of half a height of 1 */
    bool parallel;
} view;

static bool set_view(const tl_camera *camera, view *v)
{
    v->parallel = camera->parallel_scale > 0;
    vec_sub(camera->focal_point, camera->position, v->forward);
    const double length = vec_length(v->forward);
    for (int k = 0; k < 3; k++) v->forward[k] /= length;
    vec_cross(v->forward, camera->view_up, v->across[0]);
    const double side = vec_length(v->across[0]);
    for (int k = 0; k < 3; k++) v->across[0][k] /= side;
    vec_cross(v->across[0], v->forward, v->across[1]);
    v->t[1] = v->parallel ? 1 : tan(camera->view_angle * PI / 360);
    v->t[0] = v->t[1] * camera->size_px[0] / camera->size_px[1];
    return isfinite(length) && length > 0 && isfinite(side) && side > 0;
}

static void middle_of(const double *points, size_t point_count, double middle[3])
{
    for (int k = 0; k < 3; k++) {
        double low = (double)INFINITY, high = -(double)INFINITY;
        for (size_t i = 0; i < point_count; i++) {
            low = fmin(low, points[3 * i + (size_t)k]);
            high = fmax(high, points[3 * i + (size_t)k]);
        }
        middle[k] = low / 2 + high / 2;
    }
}

void tl_camera_fit_points(tl_camera *camera, const double *points, size_t point_count,
                          const double window[4], double zoom)
{
    view v;
    double middle[3], nearest = (double)INFINITY, extent = 0;
    reach r[2] = {{-(double)INFINITY, (double)INFINITY}, {-(double)INFINITY, (double)INFINITY}};
    middle_of(points, point_count, middle);
    if (!set_view(camera, &v) || !vec_is_finite(middle)) return;
    for (size_t i = 0; i < point_count; i++) {
        double from[3];
        vec_sub(points + 3 * i, middle, from);
        const double z = vec_dot(from, v.forward);
        nearest = fmin(nearest, z);
        extent = fmax(extent, vec_length(from));
        for (int k = 0; k < 2; k++) {
            const double x = vec_dot(from, v.across[k]), slope = v.parallel ? 0 : v.t[k] * z;
            r[k].above = fmax(r[k].above, x - window[2 * k + 1] * slope);
            r[k].below = fmin(r[k].below, x - window[2 * k] * slope);
        }
    }
    extent = extent > 0 ? extent : 1;
    double d = OFF * extent;
    for (int k = 0; k < 2; k++)
        d = fmax(d, (r[k].above - r[k].below) / (v.t[k] * (window[2 * k + 1] - window[2 * k])));
    if (!v.parallel) d = fmax(d, OFF * extent - nearest);
    const double back = v.parallel ? 2 * extent : d;
    for (int k = 0; k < 3; k++) camera->position[k] = middle[k] - back * v.forward[k];
    for (int axis = 0; axis < 2; axis++) {
        /* in the middle between what either side allows; what is there stays there as it grows */
        const double ends = (window[2 * axis] + window[2 * axis + 1]) * v.t[axis] * d;
        const double aside = (r[axis].above + r[axis].below - ends) / 2 / zoom;
        for (int k = 0; k < 3; k++) camera->position[k] += aside * v.across[axis][k];
    }
    if (v.parallel)
        camera->parallel_scale = d / zoom;
    else
        camera->view_angle = atan(v.t[1] / zoom) * 360 / PI;
    for (int k = 0; k < 3; k++) camera->focal_point[k] = camera->position[k] + back * v.forward[k];
}
