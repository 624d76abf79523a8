/* The pointer in the view. Tools are asked first; else a drag moves the camera: left turns, middle
 * (or Shift) moves across, right goes nearer, Alt looks around, Ctrl rolls. Wheel and pinch go to
 * what is under the pointer. How a camera moves is scene.h. */
#include "viewer_core.h"

#include <math.h>
#include <string.h>

#define TURN_DEGREES_PX 0.35 /* a drag over a view of 1,000 pixels goes nearly around */
#define CLICK_PX 3.0         /* a press that moves no farther is a click */
#define WHEEL_FACTOR 1.18    /* a step of the wheel */
#define DRAG_FACTOR_PX 1.008
#define SCROLL_REST_MS 220 /* a wheel that rests so long has ended its gesture */

typedef enum drag_kind {
    DRAG_NONE = 0,
    DRAG_TOOL,
    DRAG_TURN,
    DRAG_PAN,
    DRAG_ZOOM,
    DRAG_LOOK,
    DRAG_ROLL
} drag_kind;

struct viewer_input {
    drag_kind drag;
    bool is_moved; /* the drag has left its place: before, it may be a click */
    const viewer_tool *tool;
    viewer_pointer pointer; /* of the drag */
    double last_x, last_y;
    double depth;     /* pan: of what is held; 0: the focal point's */
    double anchor[3]; /* zoom: what stays where it is */
    bool has_anchor;
    double over_x, over_y; /* where the pointer is */
    guint scroll_rest;
    double pinch;
};

static double pixel_scale(const viewer *v)
{
    return gtk_widget_get_scale_factor(v->picture);
}

static void zoom(viewer *v, double factor, double x, double y)
{
    const double scale = pixel_scale(v);
    tl_camera camera = viewer_camera(v);
    if (v->input->has_anchor)
        tl_camera_zoom(&camera, factor, v->input->anchor);
    else
        tl_camera_zoom_px(&camera, factor, x * scale, y * scale);
    viewer_set_camera(v, &camera);
}

/* What is under a pixel stays there during a gesture. */
static void set_anchor(viewer *v, double x, double y)
{
    v->input->has_anchor = viewer_depth_at(v, x, y, v->input->anchor);
}

/* ---- drags ---- */

static drag_kind kind_of(const viewer_pointer *p)
{
    if (p->button == 2 || (p->button == 1 && (p->pressed & GDK_SHIFT_MASK))) return DRAG_PAN;
    if (p->button == 3) return DRAG_ZOOM;
    if (p->button != 1) return DRAG_NONE;
    if (p->pressed & GDK_ALT_MASK) return DRAG_LOOK;
    return p->pressed & GDK_CONTROL_MASK ? DRAG_ROLL : DRAG_TURN;
}

/* A double click makes a place the middle of the view and of turning. */
static void center_at(viewer *v, double x, double y)
{
    double xyz[3];
    if (!viewer_depth_at(v, x, y, xyz)) return;
    tl_camera camera = viewer_camera(v);
    for (int i = 0; i < 3; i++) {
        const double by = xyz[i] - camera.focal_point[i];
        camera.focal_point[i] += by;
        camera.position[i] += by;
    }
    viewer_fly_to(v, &camera);
}

void viewer_input_press(viewer *v, viewer_pointer *p)
{
    struct viewer_input *input = v->input;
    const GArray *tools = viewer_tools_all(v);
    p->from_x = p->x;
    p->from_y = p->y;
    input->pointer = *p;
    input->last_x = p->x;
    input->last_y = p->y;
    input->drag = DRAG_NONE;
    for (guint i = tools->len; i-- > 0 && input->drag == DRAG_NONE;) {
        const viewer_tool *tool = &g_array_index(tools, viewer_tool, i);
        if (!tool->press || !tool->press(v, tool->user, p)) continue;
        input->tool = tool;
        input->drag = DRAG_TOOL;
    }
    if (input->drag == DRAG_NONE && p->presses == 2 && p->button == 1) {
        center_at(v, p->x, p->y);
        return;
    }
    if (input->drag == DRAG_NONE) input->drag = kind_of(p);
    if (input->drag == DRAG_NONE) return;
    input->depth = 0;
    set_anchor(v, p->x, p->y);
    if (input->drag == DRAG_PAN && input->has_anchor) {
        double px[2];
        const tl_camera camera = viewer_camera(v);
        if (!tl_camera_project(&camera, input->anchor, px, &input->depth)) input->depth = 0;
    }
    viewer_motion_stop(v);
    input->is_moved = false;
}

static void move(viewer *v, const viewer_pointer *p)
{
    struct viewer_input *input = v->input;
    const double dx = p->x - input->last_x, dy = p->y - input->last_y, scale = pixel_scale(v);
    static const double STILL[3] = {0, 0, 0};
    tl_camera camera = viewer_camera(v);
    input->last_x = p->x;
    input->last_y = p->y;
    switch (input->drag) {
    case DRAG_NONE: return;
    case DRAG_TOOL:
        if (input->tool->drag) input->tool->drag(v, input->tool->user, p);
        return;
    case DRAG_TURN:
        tl_camera_orbit(&camera, NULL, -dx * TURN_DEGREES_PX, dy * TURN_DEGREES_PX,
                        viewer_orbit_style(v), NULL);
        break;
    case DRAG_PAN: tl_camera_pan(&camera, dx * scale, dy * scale, input->depth); break;
    case DRAG_ZOOM: zoom(v, pow(DRAG_FACTOR_PX, -dy), input->pointer.x, input->pointer.y); return;
    case DRAG_LOOK:
        tl_camera_fly(&camera, NULL, dx * TURN_DEGREES_PX / 2, -dy * TURN_DEGREES_PX / 2, STILL);
        break;
    case DRAG_ROLL: tl_camera_roll(&camera, dx * TURN_DEGREES_PX); break;
    }
    viewer_set_camera(v, &camera);
}

void viewer_input_drag(viewer *v, const viewer_pointer *p)
{
    struct viewer_input *input = v->input;
    if (input->drag == DRAG_NONE) return;
    if (!input->is_moved) {
        const double from_x = input->pointer.from_x, from_y = input->pointer.from_y;
        if (hypot(p->x - from_x, p->y - from_y) <= CLICK_PX) return;
        input->is_moved = true;
        viewer_begin_gesture(v);
    }
    move(v, p);
}

/* A press without a drag, for tools that take places. */
static void click_tools(viewer *v, const viewer_pointer *p)
{
    const GArray *tools = viewer_tools_all(v);
    for (guint i = tools->len; i-- > 0;) {
        const viewer_tool *tool = &g_array_index(tools, viewer_tool, i);
        if (tool->click && tool->click(v, tool->user, p)) return;
    }
}

void viewer_input_release(viewer *v, const viewer_pointer *p)
{
    struct viewer_input *input = v->input;
    const drag_kind drag = input->drag;
    input->drag = DRAG_NONE;
    if (drag == DRAG_NONE) return;
    if (drag == DRAG_TOOL && input->tool->release) input->tool->release(v, input->tool->user, p);
    if (input->is_moved)
        viewer_end_gesture(v);
    else if (drag != DRAG_TOOL)
        click_tools(v, p);
}

bool viewer_input_is_dragging(const viewer *v)
{
    return v->input->drag != DRAG_NONE;
}

/* ---- wheel and pinch ---- */

static gboolean on_scroll_rest(gpointer data)
{
    viewer *v = data;
    v->input->scroll_rest = 0;
    viewer_end_gesture(v);
    return G_SOURCE_REMOVE;
}

void viewer_input_keep(viewer *v)
{
    if (v->input->scroll_rest)
        g_source_remove(v->input->scroll_rest);
    else
        viewer_begin_gesture(v);
    v->input->scroll_rest = g_timeout_add(SCROLL_REST_MS, on_scroll_rest, v);
}

void viewer_input_scroll(viewer *v, double x, double y, double steps)
{
    if (!v->input->scroll_rest) set_anchor(v, x, y);
    viewer_input_keep(v);
    zoom(v, pow(WHEEL_FACTOR, -steps), x, y);
}

static gboolean on_scroll(GtkEventControllerScroll *controller, double dx, double dy, viewer *v)
{
    (void)controller, (void)dx;
    viewer_input_scroll(v, v->input->over_x, v->input->over_y, dy);
    return GDK_EVENT_STOP;
}

static void on_pinch_begin(GtkGesture *gesture, GdkEventSequence *sequence, viewer *v)
{
    (void)sequence;
    double x, y;
    v->input->pinch = 1;
    if (gtk_gesture_get_bounding_box_center(gesture, &x, &y)) set_anchor(v, x, y);
    viewer_begin_gesture(v);
}

static void on_pinch(GtkGestureZoom *gesture, double scale, viewer *v)
{
    double x, y;
    if (!gtk_gesture_get_bounding_box_center(GTK_GESTURE(gesture), &x, &y)) return;
    zoom(v, scale / v->input->pinch, x, y);
    v->input->pinch = scale;
}

static void on_pinch_end(GtkGesture *gesture, GdkEventSequence *sequence, viewer *v)
{
    (void)gesture, (void)sequence;
    viewer_end_gesture(v);
}

/* ---- GTK's events ---- */

static viewer_pointer pointer_of(GtkGesture *gesture, viewer *v, double x, double y)
{
    viewer_pointer p = v->input->pointer;
    p.x = x;
    p.y = y;
    p.pressed = gtk_event_controller_get_current_event_state(GTK_EVENT_CONTROLLER(gesture));
    return p;
}

static void on_click(GtkGestureClick *gesture, int presses, double x, double y, viewer *v)
{
    (void)gesture, (void)x, (void)y;
    v->input->pointer.presses = presses;
    gtk_widget_grab_focus(v->picture);
}

static void on_drag_begin(GtkGestureDrag *gesture, double x, double y, viewer *v)
{
    viewer_pointer p = pointer_of(GTK_GESTURE(gesture), v, x, y);
    p.button = gtk_gesture_single_get_current_button(GTK_GESTURE_SINGLE(gesture));
    viewer_input_press(v, &p);
}

static void on_drag_update(GtkGestureDrag *gesture, double dx, double dy, viewer *v)
{
    const viewer_pointer *from = &v->input->pointer;
    const viewer_pointer p =
        pointer_of(GTK_GESTURE(gesture), v, from->from_x + dx, from->from_y + dy);
    viewer_input_drag(v, &p);
}

static void on_drag_end(GtkGestureDrag *gesture, double dx, double dy, viewer *v)
{
    const viewer_pointer *from = &v->input->pointer;
    const viewer_pointer p =
        pointer_of(GTK_GESTURE(gesture), v, from->from_x + dx, from->from_y + dy);
    viewer_input_release(v, &p);
}

static void on_motion(GtkEventControllerMotion *controller, double x, double y, viewer *v)
{
    (void)controller;
    const char *cursor = NULL;
    const GArray *tools = viewer_tools_all(v);
    v->input->over_x = x;
    v->input->over_y = y;
    if (v->input->drag != DRAG_NONE) return;
    for (guint i = tools->len; i-- > 0 && !cursor;) {
        const viewer_tool *tool = &g_array_index(tools, viewer_tool, i);
        if (tool->over) cursor = tool->over(v, tool->user, x, y);
    }
    gtk_widget_set_cursor_from_name(v->picture, cursor);
}

/* ---- the part ---- */

void viewer_input_attach(viewer *v)
{
    GtkGesture *click = gtk_gesture_click_new(), *drag = gtk_gesture_drag_new();
    GtkGesture *pinch = gtk_gesture_zoom_new();
    GtkEventController *motion = gtk_event_controller_motion_new();
    GtkEventController *scroll =
        gtk_event_controller_scroll_new(GTK_EVENT_CONTROLLER_SCROLL_VERTICAL);
    v->input = g_new0(struct viewer_input, 1);
    gtk_gesture_single_set_button(GTK_GESTURE_SINGLE(click), 0);
    gtk_gesture_single_set_button(GTK_GESTURE_SINGLE(drag), 0);
    g_signal_connect(click, "pressed", G_CALLBACK(on_click), v);
    g_signal_connect(drag, "drag-begin", G_CALLBACK(on_drag_begin), v);
    g_signal_connect(drag, "drag-update", G_CALLBACK(on_drag_update), v);
    g_signal_connect(drag, "drag-end", G_CALLBACK(on_drag_end), v);
    g_signal_connect(pinch, "begin", G_CALLBACK(on_pinch_begin), v);
    g_signal_connect(pinch, "scale-changed", G_CALLBACK(on_pinch), v);
    g_signal_connect(pinch, "end", G_CALLBACK(on_pinch_end), v);
    g_signal_connect(motion, "motion", G_CALLBACK(on_motion), v);
    g_signal_connect(scroll, "scroll", G_CALLBACK(on_scroll), v);
    /* click stands behind drag: controllers added later hear first */
    gtk_widget_add_controller(v->picture, GTK_EVENT_CONTROLLER(drag));
    gtk_widget_add_controller(v->picture, GTK_EVENT_CONTROLLER(click));
    gtk_gesture_group(click, drag);
    gtk_widget_add_controller(v->picture, GTK_EVENT_CONTROLLER(pinch));
    gtk_widget_add_controller(v->picture, motion);
    gtk_widget_add_controller(v->picture, scroll);
}

void viewer_input_destroy(viewer *v)
{
    if (v->input->scroll_rest) g_source_remove(v->input->scroll_rest);
    g_clear_pointer(&v->input, g_free);
}
