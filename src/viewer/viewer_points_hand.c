/* Pointer and keys on a transfer function: a drag moves a point, or removes it far outside; a
 * double click adds one; keys go from point to point and move them. */
#include <math.h>

#include "viewer_points.h"

/* Pixels: how near a point is taken hold of, and how far outside it is let go. */
static const double REACH_PX = 11, OUT_PX = 28;
/* Steps of the keys: pixels along the axis, opacity; with Shift so many times as far. */
static const double OPACITY_STEPS = 100; /* a pixel of the plot is about one */
static const double KEY_PX = 1, KEY_OPACITY = 0.01, KEY_FAR = 10;

/* ---- places ---- */

static bool is_in_strip(double y)
{
    return y >= VIEWER_STRIP_TOP - 2;
}

/* Of a map only the two ends are held. */
static size_t hit_color(const viewer_points *points, const double px[2])
{
    const viewer_curve *colors = &points->colors;
    const size_t last = colors->count - 1;
    size_t nearest = VIEWER_CURVE_NONE;
    double reach = REACH_PX;
    for (size_t i = 0; i < colors->count; i++) {
        const double away = fabs(viewer_points_marker_px(points, i) - px[0]);
        if ((!points->own_colors && i && i < last) || away > reach) continue;
        nearest = i;
        reach = away;
    }
    return nearest;
}

static viewer_part hit(const viewer_points *points, const double px[2], size_t *point)
{
    if (px[1] >= VIEWER_NUMBERS_TOP) return VIEWER_PART_NONE; /* the zoom's */
    if (is_in_strip(px[1])) {
        *point = hit_color(points, px);
        return *point == VIEWER_CURVE_NONE ? VIEWER_PART_NONE : VIEWER_PART_COLOR;
    }
    *point = viewer_curve_hit(&points->handles, &points->axis, VIEWER_PLOT_TOP + VIEWER_PLOT_HEIGHT,
                              VIEWER_PLOT_HEIGHT, px, REACH_PX);
    return *point == VIEWER_CURVE_NONE ? VIEWER_PART_NONE : VIEWER_PART_OPACITY;
}

static double value_at(const viewer_points *points, double x)
{
    const double value = viewer_axis_value(&points->axis, x);
    return viewer_axis_round(&points->axis,
                             fmin(fmax(value, points->axis.range[0]), points->axis.range[1]));
}

static double opacity_at(double y)
{
    const double opacity = (VIEWER_PLOT_TOP + VIEWER_PLOT_HEIGHT - y) / VIEWER_PLOT_HEIGHT;
    return round(fmin(fmax(opacity, 0), 1) * OPACITY_STEPS) / OPACITY_STEPS;
}

/* ---- the pointer ---- */

static void select_point(viewer_points *points, viewer_part part, size_t point)
{
    points->part = part;
    points->point = point;
    gtk_widget_queue_draw(points->area);
    points->selected(points->user);
}

static void drag_begin(GtkGestureDrag *drag, double x, double y, viewer_points *points)
{
    const double px[2] = {x, y};
    double value, numbers[3];
    size_t point;
    if (y >= VIEWER_NUMBERS_TOP) {
        gtk_gesture_set_state(GTK_GESTURE(drag), GTK_EVENT_SEQUENCE_DENIED);
        return;
    }
    gtk_widget_grab_focus(points->area);
    const viewer_part part = hit(points, px, &point);
    select_point(points, part, point);
    if (!viewer_points_get(points, &value, numbers)) return;
    tl_scene_seal(points->v->scene); /* what keys have done is a step of its own */
    points->is_dragging = true;
    points->is_out = false;
    points->start[0] = x;
    points->start[1] = y;
    /* the point follows from where it was held, without a jump */
    points->offset[0] = (part == VIEWER_PART_COLOR ? viewer_points_marker_px(points, point)
                                                   : viewer_axis_px(&points->axis, value)) -
                        x;
    points->offset[1] = VIEWER_PLOT_TOP + VIEWER_PLOT_HEIGHT - numbers[0] * VIEWER_PLOT_HEIGHT - y;
    viewer_begin_gesture(points->v);
}

static bool is_out(const viewer_points *points, double x, double y)
{
    return x < -OUT_PX || y < -OUT_PX || x > gtk_widget_get_width(points->area) + OUT_PX ||
           y > gtk_widget_get_height(points->area) + OUT_PX;
}

/* Outside the point is away, and back when the pointer comes back. */
static void take_out(viewer_points *points, bool out)
{
    points->is_out = out;
    if (out) {
        viewer_points_get(points, &points->held_value, points->held_numbers);
        points->held_part = points->part;
        viewer_points_remove(points);
    } else {
        viewer_points_add(points, points->held_part, points->held_value);
        viewer_points_set(points, points->held_value, points->held_numbers);
    }
}

static void drag_update(GtkGestureDrag *drag, double dx, double dy, viewer_points *points)
{
    (void)drag;
    if (!points->is_dragging) return;
    const double x = points->start[0] + dx, y = points->start[1] + dy;
    const bool out = is_out(points, x, y);
    if (out != points->is_out && (points->is_out || viewer_points_is_removable(points)))
        take_out(points, out);
    if (points->is_out) return;
    const double opacity = opacity_at(y + points->offset[1]);
    viewer_points_set(points, value_at(points, x + points->offset[0]),
                      points->part == VIEWER_PART_OPACITY ? &opacity : NULL);
}

static void drag_end(GtkGestureDrag *drag, double dx, double dy, viewer_points *points)
{
    (void)drag;
    (void)dx;
    (void)dy;
    if (!points->is_dragging) return;
    points->is_dragging = false;
    viewer_end_gesture(points->v);
    viewer_points_show(points, points->channel);
}

static void clicked(GtkGestureClick *click, int presses, double x, double y, viewer_points *points)
{
    (void)click;
    const double px[2] = {x, y}, opacity = opacity_at(y);
    size_t point;
    const viewer_part part = is_in_strip(y) ? VIEWER_PART_COLOR : VIEWER_PART_OPACITY;
    if (presses != 2 || y >= VIEWER_NUMBERS_TOP ||
        (part == VIEWER_PART_OPACITY && !points->has_opacities))
        return;
    points->is_new = !hit(points, px, &point);
    if (!points->is_new) return;
    tl_scene_seal(points->v->scene);
    viewer_points_add(points, part, value_at(points, x));
    if (part == VIEWER_PART_OPACITY) viewer_points_set(points, value_at(points, x), &opacity);
    tl_scene_seal(points->v->scene);
}

/* Once the button is up, so that a dialog does not take the end of the drag away. */
static void released(GtkGestureClick *click, int presses, double x, double y, viewer_points *points)
{
    (void)click;
    const double px[2] = {x, y};
    size_t point;
    if (presses != 2) points->is_new = false;
    if (presses == 2 && !points->is_new && hit(points, px, &point)) points->exact(points->user);
}

static void moved(GtkEventControllerMotion *motion, double x, double y, viewer_points *points)
{
    (void)motion;
    const double px[2] = {x, y};
    size_t point;
    const bool held = points->is_dragging || hit(points, px, &point);
    gtk_widget_set_cursor_from_name(points->area, held ? "grab" : NULL);
}

/* ---- the keys ---- */

/* The next point, of the line from left to right, then of the strip; false past the ends. */
static bool go_on(viewer_points *points, bool back)
{
    const size_t colors = points->own_colors ? points->colors.count : points->colors.count ? 2 : 0;
    const size_t count = points->handles.count + colors;
    size_t at = back ? count : VIEWER_CURVE_NONE; /* before the first, behind the last */
    if (points->part == VIEWER_PART_OPACITY) at = points->point;
    if (points->part == VIEWER_PART_COLOR)
        at = points->handles.count + (points->own_colors ? points->point
                                      : points->point    ? (size_t)1
                                                         : 0);
    at = back ? at - 1 : at + 1;
    if (at >= count) return false;
    if (at < points->handles.count)
        select_point(points, VIEWER_PART_OPACITY, at);
    else if (points->own_colors)
        select_point(points, VIEWER_PART_COLOR, at - points->handles.count);
    else
        select_point(points, VIEWER_PART_COLOR,
                     at > points->handles.count ? points->colors.count - 1 : 0);
    return true;
}

static void nudge(viewer_points *points, double right_px, double up)
{
    double value, numbers[3];
    if (!viewer_points_get(points, &value, numbers)) return;
    if (right_px != 0) value = viewer_axis_beside(&points->axis, value, right_px);
    numbers[0] += up;
    viewer_points_set(points, value, points->part == VIEWER_PART_OPACITY ? numbers : NULL);
}

/* A step of its own, apart from those of keys that move. */
static void alone(viewer_points *points, void (*change)(viewer_points *))
{
    tl_scene_seal(points->v->scene);
    change(points);
    tl_scene_seal(points->v->scene);
}

/* Between the selected point and the next one. */
static void add_behind(viewer_points *points)
{
    const viewer_curve *curve =
        points->part == VIEWER_PART_OPACITY ? &points->handles : &points->colors;
    if (!points->part || points->point + 1 >= curve->count) return;
    const double *row = viewer_curve_row_const(curve, points->point);
    const double middle =
        (viewer_axis_px(&points->axis, row[0]) + viewer_axis_px(&points->axis, row[curve->width])) /
        2;
    viewer_points_add(points, points->part, viewer_axis_value(&points->axis, middle));
}

static gboolean key_pressed(GtkEventControllerKey *keys, guint key, guint code,
                            GdkModifierType state, viewer_points *points)
{
    (void)keys;
    (void)code;
    const double far = state & GDK_SHIFT_MASK ? KEY_FAR : 1;
    switch (key) {
    case GDK_KEY_Tab: return go_on(points, false);
    case GDK_KEY_ISO_Left_Tab: return go_on(points, true);
    case GDK_KEY_Left: nudge(points, -KEY_PX * far, 0); return TRUE;
    case GDK_KEY_Right: nudge(points, KEY_PX * far, 0); return TRUE;
    case GDK_KEY_Up: nudge(points, 0, KEY_OPACITY * far); return TRUE;
    case GDK_KEY_Down: nudge(points, 0, -KEY_OPACITY * far); return TRUE;
    case GDK_KEY_Delete:
    case GDK_KEY_BackSpace: alone(points, viewer_points_remove); return TRUE;
    case GDK_KEY_Insert:
    case GDK_KEY_plus: alone(points, add_behind); return TRUE;
    default: return FALSE;
    }
}

static void focus_left(viewer_points *points)
{
    tl_scene_seal(points->v->scene);
}

void viewer_points_add_hands(viewer_points *points)
{
    GtkGesture *drag = gtk_gesture_drag_new(), *click = gtk_gesture_click_new();
    GtkEventController *motion = gtk_event_controller_motion_new();
    GtkEventController *keys = gtk_event_controller_key_new();
    GtkEventController *focus = gtk_event_controller_focus_new();
    g_signal_connect(drag, "drag-begin", G_CALLBACK(drag_begin), points);
    g_signal_connect(drag, "drag-update", G_CALLBACK(drag_update), points);
    g_signal_connect(drag, "drag-end", G_CALLBACK(drag_end), points);
    g_signal_connect(click, "pressed", G_CALLBACK(clicked), points);
    g_signal_connect(click, "released", G_CALLBACK(released), points);
    g_signal_connect(motion, "motion", G_CALLBACK(moved), points);
    g_signal_connect(keys, "key-pressed", G_CALLBACK(key_pressed), points);
    g_signal_connect_swapped(focus, "leave", G_CALLBACK(focus_left), points);
    gtk_widget_add_controller(points->area, GTK_EVENT_CONTROLLER(click));
    gtk_widget_add_controller(points->area, GTK_EVENT_CONTROLLER(drag));
    gtk_widget_add_controller(points->area, motion);
    gtk_widget_add_controller(points->area, keys);
    gtk_widget_add_controller(points->area, focus);
    gtk_widget_set_focusable(points->area, TRUE);
    gtk_accessible_update_property(GTK_ACCESSIBLE(points->area), GTK_ACCESSIBLE_PROPERTY_LABEL,
                                   "Transfer function", -1);
}
