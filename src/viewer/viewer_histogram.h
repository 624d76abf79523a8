/* The histogram of a channel and the axis below it, painted into a GtkDrawingArea. */
#ifndef TETRALOD_VIEWER_HISTOGRAM_H
#define TETRALOD_VIEWER_HISTOGRAM_H

#include "viewer.h"
#include "viewer_curve.h"

/* How much of the volume has which values, as far as the live view has counted it. */
typedef struct viewer_histogram {
    char channel[TL_SCENE_TEXT_BYTES];
    bool logarithmic;
    bool is_there; /* counts are those of the above */
    tl_live_counts counts;
} viewer_histogram;
/* Goes over to a channel; its counts may come later, with VIEWER_LIVE, when this is called again.
 */
void viewer_histogram_take(viewer *v, viewer_histogram *histogram, const char *channel,
                           bool logarithmic);

/* Ends of the axis for a channel whose colours have a range: that with something beside it, as far
 * as there are values. Places stay. */
void viewer_histogram_fit(const viewer_histogram *histogram, const double range[2],
                          viewer_axis *axis);
/* The values that are told apart by colours: those of the picture, else all there are; false: not
 * known yet. */
bool viewer_channel_range(const viewer *v, const viewer_histogram *histogram, double range[2]);

/* Makes a curve of colours [count], as many as there is room for. */
void viewer_colors_take(viewer_curve *curve, const tl_color_point *colors, size_t count);

/* What an area is painted with. */
typedef struct viewer_ink {
    GdkRGBA text; /* of the widget's style */
    double pixel; /* a pixel of the screen, in units of the area */
    bool dark;    /* text is bright */
} viewer_ink;
viewer_ink viewer_ink_of(GtkWidget *widget);
void viewer_ink_set(cairo_t *cr, const viewer_ink *ink, double opacity);
/* To the middle of a pixel of the screen: where thin lines are sharp. */
double viewer_ink_snap(const viewer_ink *ink, double x);

/* Bars above bottom, height high at the most, in the part of the axis that has counts. Counts of a
 * logarithm show values that are rare, too. */
void viewer_histogram_paint(const viewer_histogram *histogram, cairo_t *cr, const viewer_ink *ink,
                            const viewer_axis *axis, double bottom, double height,
                            bool logarithmic_counts);
/* Ticks and numbers below a line at top; VIEWER_AXIS_HEIGHT high. */
enum { VIEWER_AXIS_HEIGHT = 20 };
void viewer_axis_paint(GtkWidget *widget, cairo_t *cr, const viewer_ink *ink,
                       const viewer_axis *axis, double top);

#endif
