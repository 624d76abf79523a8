/* Handles of planes and boxes: what is drawn lies where the plane and the box are, what is taken
 * hold of is what is under the pointer, and a drag brings it to where the pointer goes. */
#include "viewer/viewer_handles.h"

#include "check.h"
#include "make_mesh.h"

static const double BOUNDS[6] = {-1, 3, 0, 2, -2, 2};
enum { ARM_PX = 70, REACH_PX = 10, CAMERAS = 60 };

/* Looks at a place in the bounds, from some side; every other one is parallel. */
static tl_camera random_camera(uint64_t *seed, int i)
{
    tl_camera c = tl_camera_defaults();
    for (int k = 0; k < 3; k++) {
        c.focal_point[k] =
            BOUNDS[2 * k] + (0.3 + 0.4 * make_uniform(seed)) * (BOUNDS[2 * k + 1] - BOUNDS[2 * k]);
        c.position[k] = c.focal_point[k] + (make_uniform(seed) - 0.5) * 20;
        c.view_up[k] = make_uniform(seed) - 0.5;
    }
    c.position[0] += c.position[0] > c.focal_point[0] ? 8 : -8;
    c.parallel_scale = i % 2 ? 4 : 0;
    c.size_px[0] = 800;
    c.size_px[1] = 600;
    return c;
}

static void random_plane(uint64_t *seed, double plane[6])
{
    for (int k = 0; k < 3; k++) {
        plane[k] = BOUNDS[2 * k] + make_uniform(seed) * (BOUNDS[2 * k + 1] - BOUNDS[2 * k]);
        plane[3 + k] = make_uniform(seed) - 0.5;
    }
}

static double distance_to_plane(const double plane[6], const double x[3])
{
    double sum = 0, length = 0;
    for (int k = 0; k < 3; k++) {
        sum += (x[k] - plane[k]) * plane[3 + k];
        length += plane[3 + k] * plane[3 + k];
    }
    return fabs(sum) / sqrt(length);
}

static const viewer_handle_dot *dot_of(const viewer_handle_shape *shape, viewer_handle_part part)
{
    for (int i = 0; i < shape->dot_count; i++)
        if (shape->dots[i].part == part) return &shape->dots[i];
    fail_msg("there is no dot of part %d", (int)part);
    return NULL;
}

/* Where the line of sight of a pixel meets a plane. */
static void meet_plane(const tl_camera *camera, const double plane[6], double x, double y,
                       double out[3])
{
    double origin[3], direction[3], above = 0, slope = 0;
    tl_camera_ray(camera, x, y, origin, direction);
    for (int k = 0; k < 3; k++) {
        above += (origin[k] - plane[k]) * plane[3 + k];
        slope += direction[k] * plane[3 + k];
    }
    for (int k = 0; k < 3; k++) out[k] = origin[k] - above / slope * direction[k];
}

/* The outline lies on the plane and on the bounds. */
static void test_plane_outline(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < CAMERAS; i++) {
        double plane[6];
        viewer_handle_shape shape;
        const tl_camera camera = random_camera(&seed, i);
        random_plane(&seed, plane);
        viewer_handle_plane(&camera, BOUNDS, plane, ARM_PX, &shape);
        CHECK_EQ(shape.dot_count, 3);
        CHECK(shape.line_count >= 3 + 2 && shape.line_count <= 6 + 2);
        for (int l = 0; l < shape.line_count - 2; l++) {
            const viewer_handle_line *line = &shape.lines[l];
            const viewer_handle_line *next = &shape.lines[(l + 1) % (shape.line_count - 2)];
            double x[3], nearest = INFINITY;
            CHECK_NEAR(line->x[1], next->x[0], 1e-6);
            CHECK_NEAR(line->y[1], next->y[0], 1e-6);
            meet_plane(&camera, plane, line->x[0], line->y[0], x);
            for (int k = 0; k < 3; k++) {
                nearest =
                    fmin(nearest, fmin(fabs(x[k] - BOUNDS[2 * k]), fabs(x[k] - BOUNDS[2 * k + 1])));
                CHECK(x[k] > BOUNDS[2 * k] - 1e-6 && x[k] < BOUNDS[2 * k + 1] + 1e-6);
            }
            CHECK_NEAR(nearest, 0, 1e-6);
        }
    }
}

/* Planes through corners and edges of the box have each corner once. */
static void test_plane_through_corners(void **state)
{
    (void)state;
    viewer_handle_shape shape;
    const double cube[6] = {0, 1, 0, 1, 0, 1};
    const struct {
        double plane[6];
        int corners;
    } cases[] = {{{0, 0, 0, 1, 0, 0}, 4},       {{1, 0, 0, 1, 1, 1}, 3},
                 {{0, 0, 0, 1, -1, 0}, 4},      {{0.5, 0.5, 0.5, 1, 1, 1}, 6},
                 {{0.5, 0.5, 0.5, 0, 0, 2}, 4}, {{0, 0, 0, 1, 1, -2}, 4}};
    const tl_camera camera = {
        .position = {5, 4, 3}, .view_up = {0, 0, 1}, .view_angle = 30, .size_px = {100, 100}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        viewer_handle_plane(&camera, cube, cases[i].plane, ARM_PX, &shape);
        CHECK_EQ(shape.line_count - 2, cases[i].corners);
    }
    const double none[6] = {0, 0, 0, 0, 0, 0};
    viewer_handle_plane(&camera, cube, none, ARM_PX, &shape);
    CHECK_EQ(shape.dot_count + shape.line_count, 0);
}

/* What stands behind the camera is left out; what reaches there is cut off. */
static void test_behind_the_camera(void **state)
{
    (void)state;
    viewer_handle_shape shape;
    tl_camera camera = {.position = {1, 1, 0},
                        .focal_point = {2, 1, 0},
                        .view_up = {0, 0, 1},
                        .view_angle = 60,
                        .size_px = {100, 100}};
    const double box[6] = {0, 0.5, -0.5, 2, 1.5, 0.5};
    viewer_handle_box(&camera, box, &shape);
    CHECK_EQ(shape.line_count, 12 - 4); /* the side behind is gone */
    for (int i = 0; i < shape.line_count; i++)
        for (int end = 0; end < 2; end++) CHECK(isfinite(shape.lines[i].x[end]));
    for (int i = 0; i < shape.dot_count; i++) CHECK(shape.dots[i].part != VIEWER_HANDLE_FACE);
    camera.position[0] = 3;
    camera.focal_point[0] = 4;
    viewer_handle_box(&camera, box, &shape);
    CHECK_EQ(shape.dot_count + shape.line_count, 0);
}

static void test_what_is_taken(void **state)
{
    (void)state;
    viewer_handle_shape shape;
    const double box[6] = {-0.5, 0.2, -1, 2, 1.8, 1.5};
    const tl_camera camera = {.position = {9, -11, 6},
                              .focal_point = {1, 1, 0},
                              .view_up = {0, 0, 1},
                              .view_angle = 30,
                              .size_px = {800, 600}};
    viewer_handle_box(&camera, box, &shape);
    CHECK_EQ(shape.dot_count, 7);
    CHECK_EQ(shape.line_count, 12);
    for (int i = 0; i < shape.dot_count; i++) {
        const viewer_handle_dot *d = &shape.dots[i];
        CHECK_EQ(viewer_handle_at(&shape, d->x + 3, d->y - 3, REACH_PX), d->part);
    }
    CHECK_EQ(viewer_handle_at(&shape, -500, -500, REACH_PX), VIEWER_HANDLE_NONE);
    const viewer_handle_line *edge = &shape.lines[0]; /* edges of boxes do not react */
    CHECK_EQ(viewer_handle_at(&shape, edge->x[0], edge->y[0], 1), VIEWER_HANDLE_NONE);
    const double plane[6] = {1, 1, 0, 0.3, 1, 0.2};
    viewer_handle_plane(&camera, BOUNDS, plane, ARM_PX, &shape);
    edge = &shape.lines[0];
    CHECK_EQ(viewer_handle_at(&shape, (edge->x[0] + edge->x[1]) / 2 + 2,
                              (edge->y[0] + edge->y[1]) / 2, REACH_PX),
             VIEWER_HANDLE_SHIFT);
    CHECK_EQ(viewer_handle_at(&shape, (edge->x[0] + edge->x[1]) / 2 + 40,
                              (edge->y[0] + edge->y[1]) / 2 - 40, REACH_PX),
             VIEWER_HANDLE_NONE);
}

static viewer_handle_drag begin_drag(const tl_camera *camera, const double value[6],
                                     viewer_handle_part part, const viewer_handle_dot *dot)
{
    viewer_handle_drag drag = {
        .camera = *camera, .arm_px = ARM_PX, .part = part, .from = {dot->x, dot->y}};
    memcpy(drag.bounds, BOUNDS, sizeof BOUNDS);
    memcpy(drag.value, value, 6 * sizeof *value);
    return drag;
}

/* The middle of a plane that is shifted to where a place of its axis is seen passes there, and its
 * normal stays; it never leaves the bounds. */
static void test_shift(void **state)
{
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < CAMERAS; i++) {
        double plane[6], value[6], there[3], px[2], distance;
        viewer_handle_shape shape;
        const tl_camera camera = random_camera(&seed, i);
        random_plane(&seed, plane);
        viewer_handle_plane(&camera, BOUNDS, plane, ARM_PX, &shape);
        const viewer_handle_dot *middle = dot_of(&shape, VIEWER_HANDLE_SHIFT);
        const viewer_handle_drag drag = begin_drag(&camera, plane, VIEWER_HANDLE_SHIFT, middle);
        viewer_handle_drag_plane(&drag, middle->x, middle->y, value); /* not moved yet */
        CHECK_NEAR(distance_to_plane(plane, value), 0, 1e-9);
        const double length = sqrt(plane[3] * plane[3] + plane[4] * plane[4] + plane[5] * plane[5]);
        const double gone = 0.3 * (make_uniform(&seed) - 0.5);
        for (int k = 0; k < 3; k++) there[k] = value[k] + gone * plane[3 + k] / length;
        CHECK(tl_camera_project(&camera, there, px, &distance));
        viewer_handle_drag_plane(&drag, px[0], px[1], value);
        for (int k = 0; k < 3; k++) CHECK_NEAR(value[3 + k], plane[3 + k] / length, 1e-12);
        /* seen along its axis the picture says nothing of how far it goes */
        double slope = 0, to = 0;
        for (int k = 0; k < 3; k++) {
            slope += value[3 + k] * (there[k] - camera.position[k]);
            to += (there[k] - camera.position[k]) * (there[k] - camera.position[k]);
        }
        if (slope * slope < 0.9 * to) CHECK_NEAR(distance_to_plane(value, there), 0, 1e-6);
        for (int far = 0; far < 2; far++) {
            double low = INFINITY, high = -INFINITY;
            viewer_handle_drag_plane(&drag, middle->x + (far ? 1e5 : -1e5), middle->y, value);
            for (int corner = 0; corner < 8; corner++) {
                double side = 0;
                for (int k = 0; k < 3; k++)
                    side += (BOUNDS[2 * k + (corner >> k & 1)] - value[k]) * value[3 + k];
                low = fmin(low, side);
                high = fmax(high, side);
            }
            CHECK(low <= 1e-9 && high >= -1e-9);
        }
    }
}

/* After a tilt the end of the arm is seen at the pointer, the middle stays where it was. */
static void test_tilt(void **state)
{
    (void)state;
    uint64_t seed = 4;
    for (int i = 0; i < CAMERAS; i++) {
        double plane[6], value[6], still[6];
        viewer_handle_shape shape, after;
        const tl_camera camera = random_camera(&seed, i);
        const viewer_handle_part part = i % 3 ? VIEWER_HANDLE_TILT : VIEWER_HANDLE_TILT_BACK;
        random_plane(&seed, plane);
        viewer_handle_plane(&camera, BOUNDS, plane, ARM_PX, &shape);
        const viewer_handle_dot *end = dot_of(&shape, part),
                                *middle = dot_of(&shape, VIEWER_HANDLE_SHIFT);
        const viewer_handle_drag drag = begin_drag(&camera, plane, part, end);
        viewer_handle_drag_plane(&drag, end->x, end->y, still);
        const double x = middle->x + 0.6 * (end->x - middle->x) + 9,
                     y = middle->y + 0.6 * (end->y - middle->y) - 7;
        viewer_handle_drag_plane(&drag, x, y, value);
        CHECK_NEAR(value[3] * value[3] + value[4] * value[4] + value[5] * value[5], 1, 1e-12);
        for (int k = 0; k < 3; k++) {
            CHECK_NEAR(value[k], still[k], 1e-9);
            CHECK_NEAR(still[3 + k],
                       plane[3 + k] /
                           sqrt(plane[3] * plane[3] + plane[4] * plane[4] + plane[5] * plane[5]),
                       0.02);
        }
        /* drawn with a box that keeps the middle, the end is at the pointer */
        const double size = 1e-3;
        const double small[6] = {value[0] - size, value[0] + size, value[1] - size,
                                 value[1] + size, value[2] - size, value[2] + size};
        viewer_handle_plane(&camera, small, value, ARM_PX, &after);
        CHECK_NEAR(dot_of(&after, part)->x, x, 0.5);
        CHECK_NEAR(dot_of(&after, part)->y, y, 0.5);
    }
}

/* A side follows the pointer along its axis, the others stay; it stops before the opposite one and
 * at the bounds. */
static void test_faces(void **state)
{
    (void)state;
    uint64_t seed = 6;
    const double box[6] = {-0.5, 0.5, -1, 2, 1.5, 1};
    for (int i = 0; i < CAMERAS; i++) {
        viewer_handle_shape shape;
        const tl_camera camera = random_camera(&seed, i);
        viewer_handle_box(&camera, box, &shape);
        for (int face = 0; face < VIEWER_HANDLE_FACES; face++) {
            const viewer_handle_part part = (viewer_handle_part)(VIEWER_HANDLE_FACE + face);
            const viewer_handle_dot *at = dot_of(&shape, part);
            const viewer_handle_drag drag = begin_drag(&camera, box, part, at);
            const int axis = face / 2, end = axis + 3 * (face % 2);
            double value[6], there[3], px[2], distance, square = 0;
            for (int k = 0; k < 3; k++) there[k] = (box[k] + box[3 + k]) / 2;
            there[axis] = box[end] + (face % 2 ? 0.2 : -0.2);
            CHECK(tl_camera_project(&camera, there, px, &distance));
            viewer_handle_drag_box(&drag, px[0], px[1], value);
            for (int k = 0; k < 6; k++)
                if (k != end) CHECK(value[k] == box[k]);
            for (int k = 0; k < 3; k++)
                square += (there[k] - camera.position[k]) * (there[k] - camera.position[k]);
            if (pow(there[axis] - camera.position[axis], 2) < 0.8 * square)
                CHECK_NEAR(value[end], there[axis], 1e-6);
            for (int far = 0; far < 2; far++) {
                viewer_handle_drag_box(&drag, at->x + (far ? 1e5 : -1e5), at->y, value);
                CHECK(value[axis] < value[3 + axis]);
                CHECK(value[axis] >= BOUNDS[2 * axis] && value[3 + axis] <= BOUNDS[2 * axis + 1]);
            }
        }
    }
}

/* A box that is carried keeps its size, and its middle is seen where the pointer is. */
static void test_carry(void **state)
{
    (void)state;
    uint64_t seed = 7;
    const double box[6] = {0.5, 0.8, -0.4, 1.5, 1.2, 0.4};
    for (int i = 0; i < CAMERAS; i++) {
        double value[6], middle[3], px[2], distance;
        viewer_handle_shape shape;
        const tl_camera camera = random_camera(&seed, i);
        viewer_handle_box(&camera, box, &shape);
        const viewer_handle_dot *at = dot_of(&shape, VIEWER_HANDLE_CARRY);
        const viewer_handle_drag drag = begin_drag(&camera, box, VIEWER_HANDLE_CARRY, at);
        viewer_handle_drag_box(&drag, at->x + 11, at->y - 8, value);
        for (int k = 0; k < 3; k++) {
            CHECK_NEAR(value[3 + k] - value[k], box[3 + k] - box[k], 1e-12);
            middle[k] = (value[k] + value[3 + k]) / 2;
        }
        CHECK(tl_camera_project(&camera, middle, px, &distance));
        CHECK_NEAR(px[0], at->x + 11, 1e-6);
        CHECK_NEAR(px[1], at->y - 8, 1e-6);
        viewer_handle_drag_box(&drag, 1e6, -1e6, value);
        for (int k = 0; k < 3; k++)
            CHECK(value[k] >= BOUNDS[2 * k] - 1e-12 && value[3 + k] <= BOUNDS[2 * k + 1] + 1e-12);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plane_outline),
        cmocka_unit_test(test_plane_through_corners),
        cmocka_unit_test(test_behind_the_camera),
        cmocka_unit_test(test_what_is_taken),
        cmocka_unit_test(test_shift),
        cmocka_unit_test(test_tilt),
        cmocka_unit_test(test_faces),
        cmocka_unit_test(test_carry),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
