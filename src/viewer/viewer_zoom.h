/* What of an axis is seen: the wheel goes nearer at the pointer, a drag of the numbers moves along,
 * a double click on them, or the button that is there meanwhile, shows what was seen at first. */
#ifndef TETRALOD_VIEWER_ZOOM_H
#define TETRALOD_VIEWER_ZOOM_H

#include "viewer_histogram.h"

typedef struct viewer_zoom {
    GtkWidget *box;    /* the area, and the button over it */
    GtkWidget *area;   /* redrawn when the axis is another one */
    GtkWidget *button; /* seen while something is zoomed */
    viewer_axis *axis; /* the editor's */
    double top;        /* of the numbers, in the area */
    viewer_axis fit;   /* what is seen at first */
    double all[2];     /* what can be seen */
    bool is_on;        /* the axis is another one than fit */
    double over_px;    /* where the pointer is */
    double dragged_px; /* of the numbers */
} viewer_zoom;
/* Begins with an area whose numbers stand below top; axis and zoom live as long as the area. */
void viewer_zoom_create(viewer_zoom *zoom, GtkWidget *area, viewer_axis *axis, double top);
/* The axis as it is at first (its places are not looked at), of values that histogram knows; it is
 * taken over unless something is zoomed. */
void viewer_zoom_fit(viewer_zoom *zoom, const viewer_axis *fit, const viewer_histogram *histogram);
void viewer_zoom_reset(viewer_zoom *zoom);

#endif
