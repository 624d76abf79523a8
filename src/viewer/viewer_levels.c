/* Values on a histogram. All isosurfaces of the channel have their line; that of the selected one
 * is held anywhere, the others by their line, which selects them. */
#include "viewer_levels.h"

#include <math.h>
#include <string.h>

#include "viewer_widgets.h"
#include "viewer_zoom.h"

enum { MARGIN = 9, TOP = 12, PLOT = 64, LEVELS_MAX = 2 };
static const double REACH_PX = 7, KEY_PX = 1, KEY_FAR = 10, KNOB_RADIUS = 5;

struct viewer_levels {
    viewer *v;
    GtkWidget *box, *area, *row_label, *entries[LEVELS_MAX], *error;
    tl_node node;
    viewer_histogram histogram;
    viewer_axis axis;
    viewer_zoom zoom;
    double range[2];
    int held; /* which value is dragged, or has the keys */
    bool is_dragging;
};

/* ---- what the scene says ---- */

static int level_count(const viewer_levels *l)
{
    return tl_scene_kind(l->v->scene, l->node) == TL_NODE_THRESHOLD ? 2 : 1;
}

static const char *prop_of(const viewer_levels *l, int i)
{
    return level_count(l) == 1 ? "value" : i ? "high" : "low";
}

bool viewer_levels_has(tl_node_kind kind)
{
    return kind == TL_NODE_SURFACE || kind == TL_NODE_THRESHOLD;
}

/* The value that counts; where it is empty the middle of the range, or one of its ends. */
static double level_of(const viewer_levels *l, tl_node node, const char *prop)
{
    tl_value value;
    if (!tl_scene_get(l->v->ctx, l->v->scene, node, prop, &value) && value.count)
        return value.reals[0];
    if (strcmp(prop, "low") == 0) return l->axis.range[0];
    if (strcmp(prop, "high") == 0) return l->axis.range[1];
    const viewer_axis axis = {{l->range[0], l->range[1]}, l->axis.logarithmic, 0, 1};
    return viewer_axis_value(&axis, 0.5);
}

static void set_level(viewer_levels *l, int i, double value)
{
    viewer *v = l->v;
    const tl_status st = tl_scene_set_real(v->ctx, v->scene, l->node, prop_of(l, i), value);
    if (viewer_settle(v, st, l->entries[i], l->error)) viewer_levels_show(l, l->node);
}

static bool is_of_channel(const viewer_levels *l, tl_node node)
{
    return tl_scene_kind(l->v->scene, node) == TL_NODE_SURFACE &&
           strcmp(tl_scene_text(l->v->scene, node, "channel"), l->histogram.channel) == 0;
}

/* ---- painting ---- */

/* One that is held and not seen has its knob at the end where it is. */
static void paint_level(const viewer_levels *l, cairo_t *cr, const viewer_ink *ink, double value,
                        bool is_held, double opacity)
{
    const double at = viewer_axis_px(&l->axis, value), right = l->axis.length_px + 2 * MARGIN;
    const double x = is_held ? fmin(fmax(at, KNOB_RADIUS), right - KNOB_RADIUS) : at;
    if (x < 0 || x > right) return;
    viewer_ink_set(cr, ink, opacity);
    cairo_set_line_width(cr, is_held ? 2 : 1);
    cairo_move_to(cr, is_held ? x : viewer_ink_snap(ink, x), TOP - 4);
    if (at >= 0 && at <= right) cairo_rel_line_to(cr, 0, PLOT + 4);
    cairo_stroke(cr);
    if (!is_held) return;
    cairo_arc(cr, x, TOP - 4, KNOB_RADIUS, 0, 2 * G_PI);
    cairo_fill(cr);
}

/* What a threshold leaves is marked. */
static void paint_inside(const viewer_levels *l, cairo_t *cr, const viewer_ink *ink)
{
    const double left = l->axis.start_px, right = left + l->axis.length_px;
    const double low = viewer_axis_px(&l->axis, level_of(l, l->node, "low"));
    const double high = viewer_axis_px(&l->axis, level_of(l, l->node, "high"));
    const double from = fmin(fmax(low, left), right), to = fmin(fmax(high, left), right);
    viewer_ink_set(cr, ink, 0.15);
    cairo_rectangle(cr, from, TOP, fmax(to - from, 0), PLOT);
    cairo_fill(cr);
}

static void paint(GtkDrawingArea *area, cairo_t *cr, int width, int height, gpointer user)
{
    viewer_levels *l = user;
    const viewer_ink ink = viewer_ink_of(GTK_WIDGET(area));
    size_t count;
    const tl_node *nodes = tl_scene_nodes(l->v->scene, &count);
    (void)height;
    l->axis.start_px = MARGIN;
    l->axis.length_px = fmax(width - 2.0 * MARGIN, 1);
    if (tl_scene_kind(l->v->scene, l->node) == TL_NODE_KIND_COUNT ||
        !(l->axis.range[0] < l->axis.range[1]))
        return;
    viewer_histogram_paint(&l->histogram, cr, &ink, &l->axis, TOP + PLOT, PLOT, true);
    viewer_ink_set(cr, &ink, 0.35);
    cairo_set_line_width(cr, ink.pixel);
    cairo_move_to(cr, MARGIN, viewer_ink_snap(&ink, TOP + PLOT));
    cairo_rel_line_to(cr, l->axis.length_px, 0);
    cairo_stroke(cr);
    if (level_count(l) == 2) paint_inside(l, cr, &ink);
    for (size_t i = 0; level_count(l) == 1 && i < count; i++)
        if (nodes[i] != l->node && is_of_channel(l, nodes[i]))
            paint_level(l, cr, &ink, level_of(l, nodes[i], "value"), false, 0.45);
    for (int i = 0; i < level_count(l); i++)
        paint_level(l, cr, &ink, level_of(l, l->node, prop_of(l, i)), true, 0.9);
    viewer_axis_paint(GTK_WIDGET(area), cr, &ink, &l->axis, TOP + PLOT + 1);
}

/* ---- pointer and keys ---- */

static double value_at(const viewer_levels *l, double x)
{
    const double value = viewer_axis_value(&l->axis, x);
    return viewer_axis_round(&l->axis, fmin(fmax(value, l->axis.range[0]), l->axis.range[1]));
}

static double away(const viewer_levels *l, tl_node node, const char *prop, double x)
{
    return fabs(viewer_axis_px(&l->axis, level_of(l, node, prop)) - x);
}

/* The other isosurface whose line is under the pointer, if that of the selected one is not; 0:
 * none. */
static tl_node other_surface(const viewer_levels *l, double x)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(l->v->scene, &count);
    double nearest = level_count(l) == 1 ? fmin(REACH_PX, away(l, l->node, "value", x)) : 0;
    tl_node other = 0;
    for (size_t i = 0; i < count; i++)
        if (nodes[i] != l->node && is_of_channel(l, nodes[i]) &&
            away(l, nodes[i], "value", x) < nearest) {
            nearest = away(l, nodes[i], "value", x);
            other = nodes[i];
        }
    return other;
}

/* Ends of a threshold do not pass each other. */
static void drag_to(viewer_levels *l, double x)
{
    double value = value_at(l, x);
    if (level_count(l) == 2) {
        const double end = level_of(l, l->node, prop_of(l, !l->held));
        value = l->held ? fmax(value, end) : fmin(value, end);
    }
    set_level(l, l->held, value);
}

static void drag_begin(GtkGestureDrag *drag, double x, double y, viewer_levels *l)
{
    if (y >= l->zoom.top) { /* the numbers are the zoom's */
        gtk_gesture_set_state(GTK_GESTURE(drag), GTK_EVENT_SEQUENCE_DENIED);
        return;
    }
    gtk_widget_grab_focus(l->area);
    const tl_node other = other_surface(l, x);
    if (other) { /* the panel comes back with it */
        l->node = other;
        viewer_select(l->v, other);
    }
    l->held = 0;
    if (level_count(l) == 2) l->held = away(l, l->node, "high", x) < away(l, l->node, "low", x);
    l->is_dragging = true;
    tl_scene_seal(l->v->scene);
    viewer_begin_gesture(l->v);
    if (!other) drag_to(l, x);
}

static void drag_update(GtkGestureDrag *drag, double dx, double dy, viewer_levels *l)
{
    double x, y;
    (void)dy;
    if (l->is_dragging && gtk_gesture_drag_get_start_point(drag, &x, &y)) drag_to(l, x + dx);
}

static void drag_end(GtkGestureDrag *drag, double dx, double dy, viewer_levels *l)
{
    (void)drag;
    (void)dx;
    (void)dy;
    if (!l->is_dragging) return;
    l->is_dragging = false;
    viewer_end_gesture(l->v);
    viewer_levels_show(l, l->node);
}

static gboolean key_pressed(GtkEventControllerKey *keys, guint key, guint code,
                            GdkModifierType state, viewer_levels *l)
{
    (void)keys;
    (void)code;
    double step = state & GDK_SHIFT_MASK ? KEY_PX * KEY_FAR : KEY_PX;
    if (key == GDK_KEY_Left)
        step = -step;
    else if (key != GDK_KEY_Right)
        return FALSE;
    drag_to(l, viewer_axis_px(&l->axis, level_of(l, l->node, prop_of(l, l->held))) + step);
    return TRUE;
}

static void add_hands(viewer_levels *l)
{
    GtkGesture *drag = gtk_gesture_drag_new();
    GtkEventController *keys = gtk_event_controller_key_new();
    g_signal_connect(drag, "drag-begin", G_CALLBACK(drag_begin), l);
    g_signal_connect(drag, "drag-update", G_CALLBACK(drag_update), l);
    g_signal_connect(drag, "drag-end", G_CALLBACK(drag_end), l);
    g_signal_connect(keys, "key-pressed", G_CALLBACK(key_pressed), l);
    gtk_widget_add_controller(l->area, GTK_EVENT_CONTROLLER(drag));
    gtk_widget_add_controller(l->area, keys);
    gtk_widget_set_focusable(l->area, TRUE);
    gtk_widget_set_cursor_from_name(l->area, "ew-resize");
    gtk_accessible_update_property(GTK_ACCESSIBLE(l->area), GTK_ACCESSIBLE_PROPERTY_LABEL, "Value",
                                   -1);
}

/* ---- the panel ---- */

static bool commit_level(viewer_levels *l, int i)
{
    viewer *v = l->v;
    char *text = viewer_entry_numbers(l->entries[i]);
    tl_scene_seal(v->scene);
    const tl_status st =
        tl_scene_set_text(v->ctx, v->scene, l->node, prop_of(l, i), *text ? text : "auto");
    tl_scene_seal(v->scene);
    g_free(text);
    return viewer_settle(v, st, l->entries[i], l->error);
}

static bool commit_first(void *user)
{
    return commit_level(user, 0);
}

static bool commit_second(void *user)
{
    return commit_level(user, 1);
}

static void show_entries(viewer_levels *l)
{
    const int count = level_count(l);
    gtk_widget_set_visible(l->entries[1], count == 2);
    gtk_label_set_text(GTK_LABEL(l->row_label), count == 2 ? "From, to" : "Value");
    for (int i = 0; i < count; i++) {
        tl_value value;
        const bool any =
            !tl_scene_get(l->v->ctx, l->v->scene, l->node, prop_of(l, i), &value) && value.count;
        if (any || count == 1)
            viewer_entry_show_number(l->entries[i], level_of(l, l->node, prop_of(l, i)));
        else
            viewer_entry_show(l->entries[i], "");
        gtk_entry_set_placeholder_text(GTK_ENTRY(l->entries[i]), count == 2 ? "any" : NULL);
        viewer_mark_wrong(l->entries[i], l->error, NULL);
    }
}

/* Values are seen, where the wheel has not gone nearer. */
static void fit_axis(viewer_levels *l)
{
    viewer_axis fit = l->axis;
    viewer_histogram_fit(&l->histogram, l->range, &fit);
    for (int i = 0; i < level_count(l); i++) {
        tl_value value;
        if (tl_scene_get(l->v->ctx, l->v->scene, l->node, prop_of(l, i), &value) || !value.count)
            continue;
        fit.range[0] = fmin(fit.range[0], value.reals[0]);
        fit.range[1] = fmax(fit.range[1], value.reals[0]);
        fit.logarithmic = fit.logarithmic && fit.range[0] > 0;
    }
    viewer_zoom_fit(&l->zoom, &fit, &l->histogram);
}

void viewer_levels_show(viewer_levels *l, tl_node node)
{
    const tl_scene *scene = l->v->scene;
    const bool has = viewer_levels_has(tl_scene_kind(scene, node));
    const char *channel = has ? tl_scene_text(scene, node, "channel") : "";
    gtk_widget_set_visible(l->box, has && *channel);
    if (l->node != node) l->held = 0;
    l->node = has ? node : 0;
    if (!has) return;
    const tl_node transfer = tl_scene_transfer_of(scene, channel);
    if (strcmp(channel, l->histogram.channel) != 0) l->zoom.is_on = false;
    viewer_histogram_take(l->v, &l->histogram, channel,
                          transfer && tl_scene_flag(scene, transfer, "logarithmic"));
    if (!viewer_channel_range(l->v, &l->histogram, l->range)) {
        l->range[0] = 0;
        l->range[1] = 1;
    }
    if (!l->is_dragging) fit_axis(l);
    show_entries(l);
    gtk_widget_queue_draw(l->area);
}

viewer_levels *viewer_levels_create(viewer *v)
{
    viewer_levels *l = g_new0(viewer_levels, 1);
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    l->v = v;
    l->box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    l->area = gtk_drawing_area_new();
    gtk_drawing_area_set_content_height(GTK_DRAWING_AREA(l->area), TOP + PLOT + VIEWER_AXIS_HEIGHT);
    gtk_drawing_area_set_draw_func(GTK_DRAWING_AREA(l->area), paint, l, NULL);
    gtk_widget_set_name(l->area, "value");
    viewer_zoom_create(&l->zoom, l->area, &l->axis, TOP + PLOT + 2);
    add_hands(l);
    l->row_label = viewer_row_label("Value");
    l->entries[0] = viewer_entry_create(8, commit_first, l);
    gtk_widget_set_name(l->entries[0], "value-entry");
    l->entries[1] = viewer_entry_create(8, commit_second, l);
    gtk_box_append(GTK_BOX(row), l->row_label);
    for (int i = 0; i < LEVELS_MAX; i++) {
        gtk_widget_set_hexpand(l->entries[i], TRUE);
        gtk_box_append(GTK_BOX(row), l->entries[i]);
    }
    l->error = viewer_error_line();
    gtk_box_append(GTK_BOX(l->box), l->zoom.box);
    gtk_box_append(GTK_BOX(l->box), row);
    gtk_box_append(GTK_BOX(l->box), l->error);
    g_object_set_data_full(G_OBJECT(l->box), "tetralod-levels", l, g_free);
    return l;
}

GtkWidget *viewer_levels_widget(viewer_levels *l)
{
    return l->box;
}
