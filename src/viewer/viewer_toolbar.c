/* The buttons of probe and ruler in the title bar, with icons of our own: no theme has a ruler. */
#include "viewer_tools.h"

#include <math.h>

enum { ICON_PX = 16, TICKS = 4 };

static void draw_target(cairo_t *cr)
{
    cairo_arc(cr, 8, 8, 4.5, 0, 2 * G_PI);
    cairo_stroke(cr);
    for (int i = 0; i < 4; i++) {
        const double x = cos(i * G_PI / 2), y = sin(i * G_PI / 2);
        cairo_move_to(cr, 8 + 2.5 * x, 8 + 2.5 * y);
        cairo_line_to(cr, 8 + 7.5 * x, 8 + 7.5 * y);
    }
    cairo_stroke(cr);
}

static void draw_ruler(cairo_t *cr)
{
    cairo_translate(cr, 8, 8);
    cairo_rotate(cr, -G_PI / 4);
    cairo_rectangle(cr, -8, -3, 16, 6);
    cairo_stroke(cr);
    for (int i = 0; i < TICKS; i++) {
        const double x = -8 + 16 * (i + 0.5) / TICKS;
        cairo_move_to(cr, x, -3);
        cairo_line_to(cr, x, 0);
    }
    cairo_stroke(cr);
}

static void draw_icon(GtkDrawingArea *area, cairo_t *cr, int width, int height, gpointer which)
{
    GdkRGBA color;
    gtk_style_context_get_color(gtk_widget_get_style_context(GTK_WIDGET(area)), &color);
    gdk_cairo_set_source_rgba(cr, &color);
    cairo_set_line_width(cr, 1.5);
    cairo_translate(cr, (width - ICON_PX) / 2.0, (height - ICON_PX) / 2.0);
    if (GPOINTER_TO_INT(which))
        draw_ruler(cr);
    else
        draw_target(cr);
}

/* win.probe and win.ruler are switches: the button shows their state. */
void viewer_toolbar_attach(viewer *v)
{
    static const char *const ACTIONS[] = {"win.probe", "win.ruler"};
    static const char *const TIPS[] = {"Probe: values under the pointer (i)",
                                       "Measure distances (m)"};
    GtkWidget *bar = gtk_window_get_titlebar(v->window);
    if (!GTK_IS_HEADER_BAR(bar)) return;
    for (int i = 1; i >= 0; i--) {
        GtkWidget *button = gtk_toggle_button_new(), *icon = gtk_drawing_area_new();
        gtk_drawing_area_set_content_width(GTK_DRAWING_AREA(icon), ICON_PX);
        gtk_drawing_area_set_content_height(GTK_DRAWING_AREA(icon), ICON_PX);
        gtk_drawing_area_set_draw_func(GTK_DRAWING_AREA(icon), draw_icon, GINT_TO_POINTER(i), NULL);
        gtk_button_set_child(GTK_BUTTON(button), icon);
        gtk_widget_set_tooltip_text(button, TIPS[i]);
        gtk_widget_set_focus_on_click(button, FALSE);
        gtk_actionable_set_action_name(GTK_ACTIONABLE(button), ACTIONS[i]);
        gtk_header_bar_pack_end(GTK_HEADER_BAR(bar), button);
    }
}
