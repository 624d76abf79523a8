/* Control points of a transfer function and where they stand in an editor; no toolkit. */
#ifndef TETRALOD_VIEWER_CURVE_H
#define TETRALOD_VIEWER_CURVE_H

#include <stdbool.h>
#include <stddef.h>

#include "tetralod/scene.h"

/* Values along the pixels of an editor. */
typedef struct viewer_axis {
    double range[2];  /* low < high, of what is seen; above 0 if logarithmic */
    bool logarithmic; /* equal ways are equal ratios */
    double start_px, length_px;
} viewer_axis;
/* Where a value stands; one at or below 0 of a logarithmic axis far to the left. */
double viewer_axis_px(const viewer_axis *axis, double value);
/* The value at a place; both ends of the axis exactly. */
double viewer_axis_value(const viewer_axis *axis, double px);
/* The value that stands step_px beside another, within the axis. */
double viewer_axis_beside(const viewer_axis *axis, double value, double step_px);
/* The shortest decimal number about a value, not farther from it than half a pixel; within the
 * axis. */
double viewer_axis_round(const viewer_axis *axis, double value);

/* Shows factor times as much of the axis (below 1: nearer); the value at px stays there as long as
 * the ends stay within all. Nothing happens where numbers have no digits for it. */
void viewer_axis_zoom(viewer_axis *axis, const double all[2], double factor, double px);
/* Moves what is seen: the value at px comes to px + by_px, as far as the ends stay within all. */
void viewer_axis_pan(viewer_axis *axis, const double all[2], double by_px);

/* All that a list of a scene has. */
enum { VIEWER_CURVE_POINTS_MAX = TL_SCENE_ROWS_MAX, VIEWER_CURVE_WIDTH_MAX = 4 };
/* No point. */
#define VIEWER_CURVE_NONE ((size_t)-1)

/* Control points by rising value: opacities or colours, linear in between. */
typedef struct viewer_curve {
    size_t width; /* numbers of a row: 2 for value and opacity, 4 for value, red, green, blue */
    size_t count;
    double rows[VIEWER_CURVE_POINTS_MAX * VIEWER_CURVE_WIDTH_MAX];
} viewer_curve;

/* Row i: its value and what belongs to it. */
double *viewer_curve_row(viewer_curve *curve, size_t i);
const double *viewer_curve_row_const(const viewer_curve *curve, size_t i);
/* Takes rows [count][width]; what is beyond VIEWER_CURVE_POINTS_MAX is left out. */
void viewer_curve_set(viewer_curve *curve, size_t width, const double *rows, size_t count);
/* What belongs to a value [width - 1]; of the first or last point outside of them. Logarithmic:
 * linear in the logarithm of the value. Zeros of a curve without points. */
void viewer_curve_at(const viewer_curve *curve, bool logarithmic, double value, double *numbers);
/* A point on the curve, which keeps its shape. Its index, VIEWER_CURVE_NONE if there is no room. */
size_t viewer_curve_add(viewer_curve *curve, bool logarithmic, double value);
/* The last point stays; false then. */
bool viewer_curve_remove(viewer_curve *curve, size_t i);
/* Moves a point to a value, not past its neighbours; the value that it has then. */
double viewer_curve_move(viewer_curve *curve, size_t i, double value);
/* The point that is nearest to a place and not farther than reach_px; VIEWER_CURVE_NONE without
 * one. Opacities stand between bottom_px (0) and bottom_px - height_px (1); height_px 0: only the
 * place along the axis counts. Of points at one place the last one, which can be moved up. */
size_t viewer_curve_hit(const viewer_curve *curve, const viewer_axis *axis, double bottom_px,
                        double height_px, const double px[2], double reach_px);
/* Moves all points so that a range becomes another one, in the steps of the scale. */
void viewer_curve_stretch(viewer_curve *curve, bool logarithmic, const double from[2],
                          const double to[2]);
/* Leaves out points while the curve stays within tolerance (of opacity or colour) of all of them:
 * what a hand can edit, out of a fine table. */
void viewer_curve_thin(viewer_curve *curve, bool logarithmic, double tolerance);

#endif
