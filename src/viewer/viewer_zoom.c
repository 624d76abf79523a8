/* Pointer and wheel on the axis of a histogram. */
#include "viewer_zoom.h"

#include <math.h>
#include <string.h>

/* A step of the wheel shows so much of what was seen before, or moves along by so many pixels. */
static const double STEP = 0.8, STEP_PX = 24;

static void show(viewer_zoom *z)
{
    gtk_widget_set_visible(z->button, z->is_on);
    gtk_widget_queue_draw(z->area);
}

static void take_range(viewer_axis *axis, const viewer_axis *from)
{
    memcpy(axis->range, from->range, sizeof axis->range);
    axis->logarithmic = from->logarithmic;
}

void viewer_zoom_reset(viewer_zoom *z)
{
    z->is_on = false;
    take_range(z->axis, &z->fit);
    show(z);
}

void viewer_zoom_fit(viewer_zoom *z, const viewer_axis *fit, const viewer_histogram *histogram)
{
    const bool same = z->fit.logarithmic == fit->logarithmic;
    take_range(&z->fit, fit);
    memcpy(z->all, fit->range, sizeof z->all);
    if (histogram->is_there) {
        const double *counts = histogram->counts.range;
        if (!fit->logarithmic || counts[0] > 0) z->all[0] = fmin(z->all[0], counts[0]);
        z->all[1] = fmax(z->all[1], counts[1]);
    }
    if (!z->is_on || !same || z->axis->range[1] < z->all[0] || z->axis->range[0] > z->all[1])
        viewer_zoom_reset(z);
}

/* ---- hands ---- */

static bool is_number(const viewer_zoom *z, double y)
{
    return y >= z->top;
}

static void changed(viewer_zoom *z)
{
    z->is_on = z->axis->range[0] != z->fit.range[0] || z->axis->range[1] != z->fit.range[1];
    show(z);
}

/* Events of the wheel do not say where the pointer is. */
static void moved(GtkEventControllerMotion *motion, double x, double y, viewer_zoom *z)
{
    (void)motion;
    (void)y;
    z->over_px = x;
}

static gboolean scrolled(GtkEventControllerScroll *scroll, double dx, double dy, viewer_zoom *z)
{
    const GdkModifierType state =
        gtk_event_controller_get_current_event_state(GTK_EVENT_CONTROLLER(scroll));
    if (dx != 0 || (state & GDK_SHIFT_MASK))
        viewer_axis_pan(z->axis, z->all, -(dx != 0 ? dx : dy) * STEP_PX);
    else
        viewer_axis_zoom(z->axis, z->all, pow(STEP, -dy), z->over_px);
    changed(z);
    return TRUE;
}

static void drag_begin(GtkGestureDrag *drag, double x, double y, viewer_zoom *z)
{
    (void)x;
    if (!is_number(z, y)) gtk_gesture_set_state(GTK_GESTURE(drag), GTK_EVENT_SEQUENCE_DENIED);
    z->dragged_px = 0;
}

static void drag_update(GtkGestureDrag *drag, double dx, double dy, viewer_zoom *z)
{
    (void)drag;
    (void)dy;
    viewer_axis_pan(z->axis, z->all, dx - z->dragged_px);
    z->dragged_px = dx;
    changed(z);
}

static void pressed(GtkGestureClick *click, int presses, double x, double y, viewer_zoom *z)
{
    (void)click;
    (void)x;
    if (presses == 2 && is_number(z, y)) viewer_zoom_reset(z);
}

void viewer_zoom_create(viewer_zoom *z, GtkWidget *area, viewer_axis *axis, double top)
{
    GtkGesture *drag = gtk_gesture_drag_new(), *click = gtk_gesture_click_new();
    GtkEventController *motion = gtk_event_controller_motion_new();
    GtkEventController *scroll =
        gtk_event_controller_scroll_new(GTK_EVENT_CONTROLLER_SCROLL_BOTH_AXES);
    z->area = area;
    z->axis = axis;
    z->top = top;
    z->box = gtk_overlay_new();
    z->button = gtk_button_new_from_icon_name("zoom-original-symbolic");
    gtk_widget_add_css_class(z->button, "osd");
    gtk_widget_add_css_class(z->button, "zoom-reset");
    gtk_widget_set_tooltip_text(z->button, "All of it again (double click on the numbers)");
    gtk_widget_set_halign(z->button, GTK_ALIGN_END);
    gtk_widget_set_valign(z->button, GTK_ALIGN_START);
    gtk_widget_set_visible(z->button, FALSE);
    gtk_overlay_set_child(GTK_OVERLAY(z->box), area);
    gtk_overlay_add_overlay(GTK_OVERLAY(z->box), z->button);
    g_signal_connect_swapped(z->button, "clicked", G_CALLBACK(viewer_zoom_reset), z);
    g_signal_connect(motion, "motion", G_CALLBACK(moved), z);
    g_signal_connect(scroll, "scroll", G_CALLBACK(scrolled), z);
    g_signal_connect(drag, "drag-begin", G_CALLBACK(drag_begin), z);
    g_signal_connect(drag, "drag-update", G_CALLBACK(drag_update), z);
    g_signal_connect(click, "pressed", G_CALLBACK(pressed), z);
    gtk_widget_add_controller(area, GTK_EVENT_CONTROLLER(drag));
    gtk_widget_add_controller(area, GTK_EVENT_CONTROLLER(click));
    gtk_widget_add_controller(area, motion);
    gtk_widget_add_controller(area, scroll);
}
