/* The picture of a transfer function that is edited by hand: histogram, line of opacities, strip of
 * colours, control points. */
#ifndef TETRALOD_VIEWER_POINTS_H
#define TETRALOD_VIEWER_POINTS_H

#include "viewer_curve.h"
#include "viewer_zoom.h"

/* What a pointer or the keys take hold of. */
typedef enum viewer_part {
    VIEWER_PART_NONE = 0,
    VIEWER_PART_OPACITY, /* point of the line */
    VIEWER_PART_COLOR,   /* point of the strip; of a map its two ends, which are the range */
} viewer_part;

typedef struct viewer_points {
    viewer *v;
    GtkWidget *area;
    void (*selected)(void *user); /* another point, or another value of it */
    void (*exact)(void *user);    /* a double click on a point: its numbers are asked for */
    void *user;

    char channel[TL_SCENE_TEXT_BYTES]; /* "": none */
    viewer_histogram histogram;
    bool logarithmic_counts;
    bool has_opacities; /* a volume shows the channel: else its line is not there */
    bool logarithmic;   /* the scale of values */
    double range[2];    /* ends of the colours */
    viewer_axis axis;
    viewer_zoom zoom;               /* its box holds the area */
    viewer_curve opacities, colors; /* as they are drawn */
    viewer_curve handles;           /* points of the line that can be held: few */
    bool own_opacities, own_colors; /* they stand in the scene: not from histogram and map */

    viewer_part part; /* what is selected, and which point of it */
    size_t point;
    bool is_dragging;
    bool is_new;           /* the double click has made the point that it is on */
    bool is_out;           /* the point is dragged out: gone when it is let go there */
    viewer_part held_part; /* it, to come back */
    double held_value, held_numbers[3];
    double start[2]; /* of the drag, pixels, and from there to the point */
    double offset[2];
} viewer_points;

/* Makes the area, which it lives as long as. selected may be called at any change. */
viewer_points *viewer_points_create(viewer *v, void (*selected)(void *user),
                                    void (*exact)(void *user), void *user);
/* Shows what scene and picture say of a channel; "": of none. */
void viewer_points_show(viewer_points *points, const char *channel);

/* ---- changes: all go through the scene ---- */

/* Begins a step of the scene that changes the transfer function; gives its node, which is added
 * where there is none. 0: it failed, which was said. Successive steps join until the scene is
 * sealed. */
tl_node viewer_points_begin(viewer_points *points);
/* Ends the step; on a failure, which it says, all is as before. */
void viewer_points_end(viewer_points *points, tl_status status);
/* Value of the selected point, and its opacity or colour [1 or 3]; false: none is selected. */
bool viewer_points_get(const viewer_points *points, double *value, double *numbers);
/* Moves the selected point, not past its neighbours; numbers may be NULL. */
void viewer_points_set(viewer_points *points, double value, const double *numbers);
/* Whether the selected point can be removed. */
bool viewer_points_is_removable(const viewer_points *points);
void viewer_points_remove(viewer_points *points);
/* A point at a value, on the curve; it is selected then. */
void viewer_points_add(viewer_points *points, viewer_part part, double value);
/* Makes points out of the map's colours, which then can be moved. */
void viewer_points_own_colors(viewer_points *points);
/* Turns colours of its own the other way around. */
void viewer_points_mirror(viewer_points *points);
/* Moves the ends of the colours to a range, low below high. */
void viewer_points_set_range(viewer_points *points, const double range[2]);

/* ---- for painting (viewer_points_paint.c) ---- */

/* Heights of the area's parts, from the top. */
enum {
    VIEWER_PLOT_TOP = 8,
    VIEWER_PLOT_HEIGHT = 104,
    VIEWER_STRIP_TOP = 118,
    VIEWER_STRIP_HEIGHT = 18,
    VIEWER_HANDLE_HEIGHT = 9,
    VIEWER_NUMBERS_TOP = VIEWER_STRIP_TOP + VIEWER_STRIP_HEIGHT + VIEWER_HANDLE_HEIGHT + 2,
    VIEWER_POINTS_HEIGHT = 172,
    VIEWER_POINTS_MARGIN = 9 /* left and right of the axis */
};
/* Where the marker of colour point i stands: the two ends of the range stay in the area when they
 * are not seen, so that they can be held. */
double viewer_points_marker_px(const viewer_points *points, size_t i);
void viewer_points_paint(viewer_points *points, cairo_t *cr, double width);

/* ---- for hands (viewer_points_hand.c) ---- */

/* Lets pointer and keys hold the points. */
void viewer_points_add_hands(viewer_points *points);

#endif
