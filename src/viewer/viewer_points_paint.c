/* Paints a transfer function: the histogram in grey, below the line of opacities in the colours of
 * the values, the strip of colours, and what can be held. */
#include <math.h>

#include "viewer_points.h"

static const double POINT_RADIUS = 4.5, SELECTED_RADIUS = 6;
static const double HANDLE_WIDTH = 5, SELECTED_WIDTH = 6.5; /* half of a marker below the strip */
static const double AREA_OPACITY = 0.55;

static double plot_bottom(void)
{
    return VIEWER_PLOT_TOP + VIEWER_PLOT_HEIGHT;
}

static double opacity_y(double opacity)
{
    return plot_bottom() - opacity * VIEWER_PLOT_HEIGHT;
}

static void color_at(const viewer_points *points, double value, double rgb[3])
{
    viewer_curve_at(&points->colors, points->logarithmic, value, rgb);
}

/* Columns of one pixel of the screen: colours are those of the values, also between points that
 * are close. */
static void paint_columns(viewer_points *points, cairo_t *cr, const viewer_ink *ink)
{
    const double end = points->axis.start_px + points->axis.length_px;
    for (double x = points->axis.start_px; x < end; x += ink->pixel) {
        const double value = viewer_axis_value(&points->axis, x + ink->pixel / 2);
        double rgb[3], opacity;
        color_at(points, value, rgb);
        viewer_curve_at(&points->opacities, points->logarithmic, value, &opacity);
        cairo_set_source_rgba(cr, rgb[0], rgb[1], rgb[2], AREA_OPACITY);
        cairo_rectangle(cr, x, opacity_y(opacity), ink->pixel, plot_bottom() - opacity_y(opacity));
        cairo_fill(cr);
        cairo_set_source_rgb(cr, rgb[0], rgb[1], rgb[2]);
        cairo_rectangle(cr, x, VIEWER_STRIP_TOP, ink->pixel, VIEWER_STRIP_HEIGHT);
        cairo_fill(cr);
    }
}

static void paint_line(viewer_points *points, cairo_t *cr, const viewer_ink *ink)
{
    const viewer_curve *line = &points->opacities;
    const double left = points->axis.start_px, right = left + points->axis.length_px;
    if (!line->count) return;
    cairo_save(cr);
    cairo_rectangle(cr, left, 0, right - left, VIEWER_STRIP_TOP);
    cairo_clip(cr);
    cairo_move_to(cr, left, opacity_y(viewer_curve_row_const(line, 0)[1]));
    for (size_t i = 0; i < line->count; i++) {
        const double *row = viewer_curve_row_const(line, i);
        cairo_line_to(cr, viewer_axis_px(&points->axis, row[0]), opacity_y(row[1]));
    }
    cairo_line_to(cr, right, opacity_y(viewer_curve_row_const(line, line->count - 1)[1]));
    viewer_ink_set(cr, ink, 0.85);
    cairo_set_line_width(cr, 1.5);
    cairo_set_line_join(cr, CAIRO_LINE_JOIN_ROUND);
    cairo_stroke(cr);
    cairo_restore(cr);
}

static bool is_selected(const viewer_points *points, viewer_part part, size_t i)
{
    return points->part == part && points->point == i;
}

/* Filled with a colour, within a ring that stands out of any background. */
static void ring(cairo_t *cr, const viewer_ink *ink, const double rgb[3], bool selected)
{
    cairo_set_source_rgb(cr, rgb[0], rgb[1], rgb[2]);
    cairo_fill_preserve(cr);
    viewer_ink_set(cr, ink, selected ? 1 : 0.8);
    cairo_set_line_width(cr, selected ? 2 : 1.25);
    cairo_stroke(cr);
}

static void paint_opacity_points(viewer_points *points, cairo_t *cr, const viewer_ink *ink)
{
    for (size_t i = 0; i < points->handles.count; i++) {
        const double *row = viewer_curve_row_const(&points->handles, i);
        const bool selected = is_selected(points, VIEWER_PART_OPACITY, i);
        const double x = viewer_axis_px(&points->axis, row[0]);
        double rgb[3];
        if (x < 0 || x > points->axis.start_px * 2 + points->axis.length_px) continue;
        color_at(points, row[0], rgb);
        cairo_new_path(cr);
        cairo_arc(cr, x, opacity_y(row[1]), selected ? SELECTED_RADIUS : POINT_RADIUS, 0, 2 * G_PI);
        ring(cr, ink, rgb, selected);
    }
}

double viewer_points_marker_px(const viewer_points *points, size_t i)
{
    const double x = viewer_axis_px(&points->axis, viewer_curve_row_const(&points->colors, i)[0]);
    const double right = 2 * points->axis.start_px + points->axis.length_px - HANDLE_WIDTH;
    if (i && i + 1 < points->colors.count) return x;
    return fmin(fmax(x, HANDLE_WIDTH), right);
}

static void paint_color_points(viewer_points *points, cairo_t *cr, const viewer_ink *ink)
{
    const double top = VIEWER_STRIP_TOP + VIEWER_STRIP_HEIGHT - 2;
    for (size_t i = 0; i < points->colors.count; i++) {
        const double *row = viewer_curve_row_const(&points->colors, i);
        if (!points->own_colors && i && i + 1 < points->colors.count) continue;
        const bool selected = is_selected(points, VIEWER_PART_COLOR, i);
        const double half = selected ? SELECTED_WIDTH : HANDLE_WIDTH;
        const double x = viewer_points_marker_px(points, i);
        if (x < 0 || x > points->axis.start_px * 2 + points->axis.length_px) continue;
        cairo_new_path(cr);
        cairo_move_to(cr, x, top - 3);
        cairo_line_to(cr, x + half, top + 3);
        cairo_line_to(cr, x + half, top + VIEWER_HANDLE_HEIGHT);
        cairo_line_to(cr, x - half, top + VIEWER_HANDLE_HEIGHT);
        cairo_line_to(cr, x - half, top + 3);
        cairo_close_path(cr);
        ring(cr, ink, row + 1, selected);
    }
}

void viewer_points_paint(viewer_points *points, cairo_t *cr, double width)
{
    const viewer_ink ink = viewer_ink_of(points->area);
    points->axis.start_px = VIEWER_POINTS_MARGIN;
    points->axis.length_px = fmax(width - 2 * VIEWER_POINTS_MARGIN, 1);
    const double right = points->axis.start_px + points->axis.length_px;
    if (!(points->axis.range[0] < points->axis.range[1])) return;
    viewer_histogram_paint(&points->histogram, cr, &ink, &points->axis, plot_bottom(),
                           VIEWER_PLOT_HEIGHT, points->logarithmic_counts);
    paint_columns(points, cr, &ink);
    viewer_ink_set(cr, &ink, 0.35);
    cairo_set_line_width(cr, ink.pixel);
    cairo_move_to(cr, points->axis.start_px, viewer_ink_snap(&ink, plot_bottom()));
    cairo_line_to(cr, right, viewer_ink_snap(&ink, plot_bottom()));
    cairo_stroke(cr);
    paint_line(points, cr, &ink);
    paint_opacity_points(points, cr, &ink);
    paint_color_points(points, cr, &ink);
    viewer_axis_paint(points->area, cr, &ink, &points->axis, VIEWER_NUMBERS_TOP);
}
