/* What is painted over the picture, as lines and text that can be read on any of it. */
#include "viewer_tools.h"

#include <math.h>

#define CARD_PAD 9.0
#define CARD_AWAY 16.0 /* from the place that it is about */
#define CARD_ROUND 7.0
#define COLUMN_GAP 14

const double VIEWER_OVERLAY_ACCENT[3] = {0.98, 0.62, 0.12};
const double VIEWER_OVERLAY_SECOND[3] = {0.18, 0.62, 0.88};

void viewer_overlay_line(cairo_t *cr, const double x[2], const double y[2], const double rgb[3],
                         double width)
{
    cairo_new_path(cr);
    for (int pass = 0; pass < 2; pass++) {
        cairo_set_line_width(cr, pass ? width : width + 2);
        if (pass)
            cairo_set_source_rgb(cr, rgb[0], rgb[1], rgb[2]);
        else
            cairo_set_source_rgba(cr, 0, 0, 0, 0.45);
        cairo_move_to(cr, x[0], y[0]);
        cairo_line_to(cr, x[1], y[1]);
        cairo_stroke(cr);
    }
}

void viewer_overlay_dot(cairo_t *cr, double x, double y, double radius, const double rgb[3],
                        bool is_full)
{
    cairo_new_path(cr);
    cairo_arc(cr, x, y, radius, 0, 2 * G_PI);
    cairo_set_source_rgba(cr, rgb[0], rgb[1], rgb[2], is_full ? 1 : 0.85);
    cairo_fill_preserve(cr);
    cairo_set_line_width(cr, is_full ? 2 : 1.2);
    cairo_set_source_rgb(cr, 1, 1, 1);
    cairo_stroke_preserve(cr);
    cairo_set_line_width(cr, 0.8);
    cairo_set_source_rgba(cr, 0, 0, 0, 0.6);
    cairo_stroke(cr);
}

/* The second column stands behind the widest text of the first one. */
static void set_columns(PangoLayout *layout, const char *markup)
{
    int widest = 0;
    char **lines = g_strsplit(markup, "\n", -1);
    for (char **line = lines; *line; line++) {
        int width;
        char *tab = strchr(*line, '\t');
        if (!tab) continue;
        *tab = '\0';
        pango_layout_set_markup(layout, *line, -1);
        pango_layout_get_pixel_size(layout, &width, NULL);
        widest = MAX(widest, width);
    }
    PangoTabArray *tabs =
        pango_tab_array_new_with_positions(1, TRUE, PANGO_TAB_LEFT, widest + COLUMN_GAP);
    pango_layout_set_tabs(layout, tabs);
    pango_tab_array_free(tabs);
    g_strfreev(lines);
}

static void round_box(cairo_t *cr, double x, double y, double width, double height)
{
    const double r = CARD_ROUND;
    cairo_new_sub_path(cr);
    cairo_arc(cr, x + width - r, y + r, r, -G_PI / 2, 0);
    cairo_arc(cr, x + width - r, y + height - r, r, 0, G_PI / 2);
    cairo_arc(cr, x + r, y + height - r, r, G_PI / 2, G_PI);
    cairo_arc(cr, x + r, y + r, r, G_PI, 3 * G_PI / 2);
    cairo_close_path(cr);
}

void viewer_overlay_card(viewer *v, cairo_t *cr, const char *markup, const double at[2], bool above,
                         double width, double height, bool dark)
{
    int text_width, text_height;
    const double paper = dark ? 0.13 : 1, ink = dark ? 0.94 : 0.1;
    PangoLayout *layout = gtk_widget_create_pango_layout(v->picture, NULL);
    set_columns(layout, markup);
    pango_layout_set_markup(layout, markup, -1);
    pango_layout_get_pixel_size(layout, &text_width, &text_height);
    const double w = text_width + 2 * CARD_PAD, h = text_height + 2 * CARD_PAD;
    double left = at[0] + CARD_AWAY, top = at[1] + (above ? -CARD_AWAY - h : CARD_AWAY);
    if (left + w > width) left = at[0] - CARD_AWAY - w;
    if (!above && top + h > height) top = at[1] - CARD_AWAY - h;
    if (above && top < 0) top = at[1] + CARD_AWAY;
    left = fmax(4, fmin(left, width - w - 4));
    top = fmax(4, fmin(top, height - h - 4));
    round_box(cr, left, top, w, h);
    cairo_set_source_rgba(cr, paper, paper, paper, 0.93);
    cairo_fill_preserve(cr);
    cairo_set_line_width(cr, 1);
    cairo_set_source_rgba(cr, ink, ink, ink, 0.25);
    cairo_stroke(cr);
    cairo_set_source_rgb(cr, ink, ink, ink);
    cairo_move_to(cr, left + CARD_PAD, top + CARD_PAD);
    pango_cairo_show_layout(cr, layout);
    g_object_unref(layout);
}
