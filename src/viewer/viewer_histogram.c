/* The histogram of a channel: asked of the live view, painted by pixels of the screen, so that bars
 * are sharp at any scale of the display. */
#include "viewer_histogram.h"

#include <math.h>
#include <string.h>

/* Counts this much below the highest are the foot of a logarithmic histogram. */
static const double COUNT_DEPTH = 1e5;
/* Room for a number of the axis, in units of the area. */
static const double NUMBER_WIDTH = 56;
static const double NUMBER_SCALE = 0.8; /* of the font of the panels */
/* Of the range of colours, what is seen beside it. */
static const double BESIDE = 0.3;
static const double TICK_LENGTH = 4, SMALL_TICK_LENGTH = 2.5;

/* ---- counts ---- */

void viewer_histogram_take(viewer *v, viewer_histogram *histogram, const char *channel,
                           bool logarithmic)
{
    g_strlcpy(histogram->channel, channel, sizeof histogram->channel);
    histogram->logarithmic = logarithmic;
    histogram->is_there = v->source && *channel &&
                          tl_live_histogram(v->live, channel, logarithmic, &histogram->counts);
}

void viewer_histogram_fit(const viewer_histogram *histogram, const double range[2],
                          viewer_axis *axis)
{
    const viewer_axis colors = {{range[0], range[1]}, histogram->logarithmic && range[0] > 0, 0, 1};
    double ends[2] = {viewer_axis_value(&colors, -BESIDE), viewer_axis_value(&colors, 1 + BESIDE)};
    if (histogram->is_there) {
        ends[0] = fmin(fmax(ends[0], histogram->counts.range[0]), range[0]);
        ends[1] = fmax(fmin(ends[1], histogram->counts.range[1]), range[1]);
    }
    axis->logarithmic = histogram->logarithmic && ends[0] > 0;
    memcpy(axis->range, ends, sizeof ends);
}

bool viewer_channel_range(const viewer *v, const viewer_histogram *histogram, double range[2])
{
    const tl_values *values = v->frame && v->frame->content
                                  ? tl_content_values(v->frame->content, histogram->channel)
                                  : NULL;
    if (values)
        memcpy(range, values->range, sizeof values->range);
    else if (histogram->is_there)
        memcpy(range, histogram->counts.range, sizeof histogram->counts.range);
    return values || histogram->is_there;
}

void viewer_colors_take(viewer_curve *curve, const tl_color_point *colors, size_t count)
{
    curve->width = 4;
    curve->count = 0;
    while (curve->count < count && curve->count < VIEWER_CURVE_POINTS_MAX) {
        const tl_color_point *from = &colors[curve->count];
        double *row = viewer_curve_row(curve, curve->count++);
        row[0] = from->value;
        memcpy(row + 1, from->rgb, sizeof from->rgb);
    }
}

/* ---- ink ---- */

viewer_ink viewer_ink_of(GtkWidget *widget)
{
    viewer_ink ink;
    gtk_style_context_get_color(gtk_widget_get_style_context(widget), &ink.text);
    ink.pixel = 1.0 / gtk_widget_get_scale_factor(widget);
    ink.dark = ink.text.red + ink.text.green + ink.text.blue > 1.5f;
    return ink;
}

void viewer_ink_set(cairo_t *cr, const viewer_ink *ink, double opacity)
{
    cairo_set_source_rgba(cr, (double)ink->text.red, (double)ink->text.green,
                          (double)ink->text.blue, opacity * (double)ink->text.alpha);
}

double viewer_ink_snap(const viewer_ink *ink, double x)
{
    return (floor(x / ink->pixel) + 0.5) * ink->pixel;
}

/* ---- bars ---- */

static double height_of(double count, double most, bool logarithmic)
{
    if (!logarithmic) return count / most;
    return log1p(count / most * COUNT_DEPTH) / log1p(COUNT_DEPTH);
}

/* The bin of a value as a real: 0 at the low end of the counts, TL_LIVE_BINS at the high one. */
static double bin_of(const viewer_histogram *histogram, double value)
{
    const viewer_axis bins = {{histogram->counts.range[0], histogram->counts.range[1]},
                              histogram->logarithmic,
                              0,
                              TL_LIVE_BINS};
    return viewer_axis_px(&bins, value);
}

/* The highest count between two values, 0 where there are none. */
static double highest(const viewer_histogram *histogram, double low, double high)
{
    const double from = floor(fmax(bin_of(histogram, low), 0));
    const double to = fmin(bin_of(histogram, high), TL_LIVE_BINS);
    double most = 0;
    for (double b = from; b < to; b++) most = fmax(most, histogram->counts.counts[(size_t)b]);
    return most;
}

void viewer_histogram_paint(const viewer_histogram *histogram, cairo_t *cr, const viewer_ink *ink,
                            const viewer_axis *axis, double bottom, double height,
                            bool logarithmic_counts)
{
    const double *range = histogram->counts.range;
    const double end = axis->start_px + axis->length_px;
    double most = 0;
    if (!histogram->is_there || !(range[1] > range[0])) return;
    for (size_t b = 0; b < TL_LIVE_BINS; b++) most = fmax(most, histogram->counts.counts[b]);
    if (!(most > 0)) return;
    cairo_move_to(cr, axis->start_px, bottom);
    for (double x = axis->start_px; x < end; x += ink->pixel) {
        const double count =
            highest(histogram, viewer_axis_value(axis, x), viewer_axis_value(axis, x + ink->pixel));
        const double y = bottom - height * height_of(count, most, logarithmic_counts);
        cairo_line_to(cr, x, y);
        cairo_line_to(cr, x + ink->pixel, y);
    }
    cairo_line_to(cr, end, bottom);
    cairo_close_path(cr);
    viewer_ink_set(cr, ink, ink->dark ? 0.26 : 0.20);
    cairo_fill(cr);
}

/* ---- axis ---- */

static void paint_number(cairo_t *cr, PangoLayout *layout, const viewer_axis *axis,
                         const char *text, double x, double top)
{
    int width, height;
    pango_layout_set_text(layout, text, -1);
    pango_layout_get_pixel_size(layout, &width, &height);
    /* the outer numbers stay inside */
    const double right = 2 * axis->start_px + axis->length_px - width;
    cairo_move_to(cr, fmin(fmax(x - width / 2.0, 0), right), top);
    pango_cairo_show_layout(cr, layout);
}

void viewer_axis_paint(GtkWidget *widget, cairo_t *cr, const viewer_ink *ink,
                       const viewer_axis *axis, double top)
{
    tl_tick ticks[TL_TICKS_MAX];
    char factor[TL_TICK_BYTES], number[2 * TL_TICK_BYTES];
    int exponent = 0;
    const size_t room = (size_t)fmax(axis->length_px / NUMBER_WIDTH, 2);
    const size_t count = axis->logarithmic
                             ? tl_ticks_log(axis->range[0], axis->range[1], room, ticks)
                             : tl_ticks(axis->range[0], axis->range[1], room, ticks, &exponent);
    PangoLayout *layout = gtk_widget_create_pango_layout(widget, NULL);
    PangoAttrList *small = pango_attr_list_new();
    pango_attr_list_insert(small, pango_attr_scale_new(NUMBER_SCALE));
    pango_layout_set_attributes(layout, small);
    tl_exponent_text(exponent, factor);
    cairo_set_line_width(cr, ink->pixel);
    for (size_t i = 0; i < count; i++) {
        const double x = axis->start_px + ticks[i].at * axis->length_px;
        cairo_move_to(cr, viewer_ink_snap(ink, x), top);
        cairo_rel_line_to(cr, 0, *ticks[i].label ? TICK_LENGTH : SMALL_TICK_LENGTH);
        viewer_ink_set(cr, ink, 0.5);
        cairo_stroke(cr);
        if (!*ticks[i].label) continue;
        /* the last number carries the factor of all of them */
        g_snprintf(number, sizeof number, "%s%s", ticks[i].label, i + 1 == count ? factor : "");
        viewer_ink_set(cr, ink, 0.75);
        paint_number(cr, layout, axis, number, x, top + TICK_LENGTH);
    }
    pango_attr_list_unref(small);
    g_object_unref(layout);
}
