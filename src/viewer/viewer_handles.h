/* Handles by which planes and boxes are taken hold of in a picture: where they are, what a pointer
 * is at, what a drag makes of them. No toolkit, no state. Pixels are those of the camera's picture,
 * from its upper left corner. */
#ifndef TETRALOD_VIEWER_HANDLES_H
#define TETRALOD_VIEWER_HANDLES_H

#include "tetralod/scene.h"

/* What can be taken hold of. */
typedef enum viewer_handle_part {
    VIEWER_HANDLE_NONE = 0,
    VIEWER_HANDLE_SHIFT,     /* of a plane: moves it along its normal */
    VIEWER_HANDLE_TILT,      /* of a plane: turns its normal around the middle */
    VIEWER_HANDLE_TILT_BACK, /* the same by the other end */
    VIEWER_HANDLE_CARRY,     /* of a box: moves it across the line of sight */
    VIEWER_HANDLE_FACE /* of a box: moves a side; VIEWER_HANDLE_FACE + 2 * axis, + 1 for the far one
                        */
} viewer_handle_part;
enum { VIEWER_HANDLE_FACES = 6, VIEWER_HANDLE_END = VIEWER_HANDLE_FACE + VIEWER_HANDLE_FACES };

enum { VIEWER_HANDLE_DOTS_MAX = 8, VIEWER_HANDLE_LINES_MAX = 20 };
typedef struct viewer_handle_dot {
    double x, y;
    viewer_handle_part part;
} viewer_handle_dot;
typedef struct viewer_handle_line {
    double x[2], y[2];
    viewer_handle_part part; /* what a pointer at it takes hold of, or VIEWER_HANDLE_NONE */
} viewer_handle_line;
/* What is drawn, and reacts. What is behind the camera is left out. */
typedef struct viewer_handle_shape {
    viewer_handle_dot dots[VIEWER_HANDLE_DOTS_MAX];
    viewer_handle_line lines[VIEWER_HANDLE_LINES_MAX];
    int dot_count, line_count;
} viewer_handle_shape;

/* A plane (a point and a normal) as far as it lies in the bounds (x0, x1, y0, y1, z0, z1), with an
 * arrow along its normal from the middle, about arm_px long if it is seen from the side. */
void viewer_handle_plane(const tl_camera *camera, const double bounds[6], const double plane[6],
                         double arm_px, viewer_handle_shape *shape);
/* The edges of a box (x0 y0 z0, x1 y1 z1) with a dot on each side and one in the middle. */
void viewer_handle_box(const tl_camera *camera, const double box[6], viewer_handle_shape *shape);

/* What a pointer at x, y is at: the nearest dot within reach_px, else the nearest line that can be
 * taken, within half of that. */
viewer_handle_part viewer_handle_at(const viewer_handle_shape *shape, double x, double y,
                                    double reach_px);

/* A drag that began at from with the plane or box as it was there, and has come to to. */
typedef struct viewer_handle_drag {
    tl_camera camera;
    double bounds[6]; /* of the data: planes stay in them, boxes do not get farther out */
    double value[6];  /* where it began: plane or box */
    double arm_px;    /* as of viewer_handle_plane */
    viewer_handle_part part;
    double from[2];
} viewer_handle_drag;
/* Gives value [6]. What can't be told from where the pointer is leaves it as it was. */
void viewer_handle_drag_plane(const viewer_handle_drag *drag, double x, double y, double value[6]);
void viewer_handle_drag_box(const viewer_handle_drag *drag, double x, double y, double value[6]);

#endif
