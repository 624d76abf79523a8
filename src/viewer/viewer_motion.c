/* How the camera moves by itself: flights to another view, flying by keys that are held, spinning;
 * and the actions for views. Each goes on from one frame of the window to the next, as a gesture.
 */
#include "viewer_core.h"

#include <math.h>

#define KEY_DEGREES 5.0
#define FLY_PER_S 0.7 /* of the distance to the focal point */
#define SPIN_DEGREES_S 24.0
#define FLIGHT_S 0.3 /* to another view */

/* Keys that fly while they are held. */
static const struct fly_key {
    guint key;
    int axis; /* forward, right, up */
    double sign;
} FLY_KEYS[] = {{GDK_KEY_w, 0, 1},  {GDK_KEY_s, 0, -1}, {GDK_KEY_d, 1, 1},
                {GDK_KEY_a, 1, -1}, {GDK_KEY_e, 2, 1},  {GDK_KEY_q, 2, -1}};

struct viewer_motion {
    unsigned held; /* bits of FLY_KEYS */
    bool is_fast;
    bool is_spinning, is_trackball;
    guint tick;
    gint64 tick_time;
    tl_camera from, to; /* of a flight */
    gint64 flight_begin;
    bool is_flying;
};

/* ---- the camera ---- */

tl_camera viewer_camera(const viewer *v)
{
    tl_camera camera;
    const int scale = gtk_widget_get_scale_factor(v->picture);
    const int width = MAX(gtk_widget_get_width(v->picture) * scale, 1);
    const int height = MAX(gtk_widget_get_height(v->picture) * scale, 1);
    tl_scene_camera(v->scene, (uint32_t)width, (uint32_t)height, &camera);
    return camera;
}

void viewer_set_camera(viewer *v, const tl_camera *camera)
{
    if (tl_scene_set_camera(v->ctx, v->scene, camera)) return; /* too near or too far: it stays */
    viewer_changed(v);
}

tl_orbit_style viewer_orbit_style(const viewer *v)
{
    return v->motion->is_trackball ? TL_ORBIT_TRACKBALL : TL_ORBIT_TURNTABLE;
}

/* ---- what goes on by itself: flights, flying, spinning ---- */

static void normalized_mix(const double a[3], const double b[3], double t, double out[3])
{
    double length = 0;
    for (int i = 0; i < 3; i++) {
        out[i] = a[i] + t * (b[i] - a[i]);
        length += out[i] * out[i];
    }
    length = sqrt(length);
    for (int i = 0; i < 3 && length > 0; i++) out[i] /= length;
}

static double view_of(const tl_camera *camera, double direction[3])
{
    double length = 0;
    for (int i = 0; i < 3; i++) {
        direction[i] = camera->position[i] - camera->focal_point[i];
        length += direction[i] * direction[i];
    }
    length = sqrt(length);
    for (int i = 0; i < 3 && length > 0; i++) direction[i] /= length;
    return length;
}

static tl_camera between(const tl_camera *from, const tl_camera *to, double t)
{
    double a[3], b[3], direction[3];
    tl_camera camera = *to;
    const double from_length = view_of(from, a), to_length = view_of(to, b);
    const double length = from_length * pow(to_length / from_length, t);
    normalized_mix(a, b, t, direction);
    normalized_mix(from->view_up, to->view_up, t, camera.view_up);
    for (int i = 0; i < 3; i++) {
        camera.focal_point[i] += (1 - t) * (from->focal_point[i] - to->focal_point[i]);
        camera.position[i] = camera.focal_point[i] + length * direction[i];
    }
    if (from->parallel_scale > 0 && to->parallel_scale > 0)
        camera.parallel_scale =
            from->parallel_scale * pow(to->parallel_scale / from->parallel_scale, t);
    return camera;
}

static void fly(viewer *v, double seconds)
{
    double moves[3] = {0}, direction[3];
    tl_camera camera = viewer_camera(v);
    const double distance = view_of(&camera, direction);
    const double step = FLY_PER_S * distance * seconds * (v->motion->is_fast ? 4 : 1);
    for (size_t i = 0; i < G_N_ELEMENTS(FLY_KEYS); i++)
        if (v->motion->held & 1u << i) moves[FLY_KEYS[i].axis] += FLY_KEYS[i].sign * step;
    tl_camera_fly(&camera, NULL, 0, 0, moves);
    viewer_set_camera(v, &camera);
}

static void spin(viewer *v, double seconds)
{
    static const double UP[3] = {0, 0, 1};
    tl_camera camera = viewer_camera(v);
    tl_camera_spin(&camera, camera.focal_point, UP, SPIN_DEGREES_S * seconds);
    viewer_set_camera(v, &camera);
}

static bool goes_on(const struct viewer_motion *motion)
{
    return motion->held || motion->is_spinning || motion->is_flying;
}

static gboolean on_tick(GtkWidget *widget, GdkFrameClock *clock, gpointer data)
{
    (void)widget;
    viewer *v = data;
    struct viewer_motion *motion = v->motion;
    const gint64 now = gdk_frame_clock_get_frame_time(clock);
    const double seconds = CLAMP((double)(now - motion->tick_time) / 1e6, 0, 0.25);
    motion->tick_time = now;
    if (motion->is_flying) {
        const double t = CLAMP((double)(now - motion->flight_begin) / 1e6 / FLIGHT_S, 0, 1);
        const tl_camera camera = between(&motion->from, &motion->to, t * t * (3 - 2 * t));
        viewer_set_camera(v, t < 1 ? &camera : &motion->to);
        motion->is_flying = t < 1;
    }
    if (motion->held) fly(v, seconds);
    if (motion->is_spinning && !viewer_input_is_dragging(v)) spin(v, seconds);
    if (goes_on(motion)) return G_SOURCE_CONTINUE;
    motion->tick = 0;
    viewer_end_gesture(v);
    return G_SOURCE_REMOVE;
}

static void go_on(viewer *v)
{
    struct viewer_motion *motion = v->motion;
    if (motion->tick || !goes_on(motion)) return;
    motion->tick_time = g_get_monotonic_time();
    motion->tick = gtk_widget_add_tick_callback(v->picture, on_tick, v, NULL);
    viewer_begin_gesture(v);
}

/* Moves the camera to another place so that the eye can follow. */
void viewer_fly_to(viewer *v, const tl_camera *to)
{
    struct viewer_motion *motion = v->motion;
    double a[3], b[3];
    motion->from = viewer_camera(v);
    motion->to = *to;
    const double lengths = view_of(&motion->from, a) * view_of(to, b);
    const double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if (!(lengths > 0) || cosine < -0.98) { /* the way around is not known */
        viewer_set_camera(v, to);
        return;
    }
    motion->flight_begin = g_get_monotonic_time();
    motion->is_flying = true;
    go_on(v);
}

void viewer_motion_stop(viewer *v)
{
    v->motion->is_flying = false;
}

/* ---- keys that are held ---- */

static void set_held(viewer *v, guint key, bool is_down)
{
    for (size_t i = 0; i < G_N_ELEMENTS(FLY_KEYS); i++) {
        if (gdk_keyval_to_lower(key) != FLY_KEYS[i].key) continue;
        v->motion->held = is_down ? v->motion->held | 1u << i : v->motion->held & ~(1u << i);
    }
    go_on(v);
}

static gboolean on_key(GtkEventControllerKey *controller, guint key, guint code,
                       GdkModifierType state, viewer *v)
{
    (void)controller, (void)code;
    if (state & (GDK_CONTROL_MASK | GDK_ALT_MASK)) return GDK_EVENT_PROPAGATE;
    v->motion->is_fast = state & GDK_SHIFT_MASK;
    set_held(v, key, true);
    for (size_t i = 0; i < G_N_ELEMENTS(FLY_KEYS); i++)
        if (gdk_keyval_to_lower(key) == FLY_KEYS[i].key) return GDK_EVENT_STOP;
    return GDK_EVENT_PROPAGATE;
}

static void on_key_up(GtkEventControllerKey *controller, guint key, guint code,
                      GdkModifierType state, viewer *v)
{
    (void)controller, (void)code, (void)state;
    set_held(v, key, false);
}

static void on_leave(GtkEventControllerFocus *controller, viewer *v)
{
    (void)controller;
    v->motion->held = 0;
}

/* ---- actions ---- */

static void stand(viewer *v, const char *side)
{
    double view[3], bounds[6];
    if (!v->source || !tl_view_read(side, view)) return;
    tl_scene_bounds(v->scene, bounds);
    /* the scene knows which part of the picture is free for the data */
    const tl_camera from = viewer_camera(v);
    char *line = g_strdup_printf("view %s", side);
    const tl_status st = tl_scene_do(v->ctx, v->scene, line);
    g_free(line);
    if (!viewer_ok(v, st)) return;
    const tl_camera to = viewer_camera(v);
    viewer_set_camera(v, &from);
    viewer_fly_to(v, &to);
}

static void view_front(viewer *v)
{
    stand(v, "-y");
}
static void view_back(viewer *v)
{
    stand(v, "+y");
}
static void view_left(viewer *v)
{
    stand(v, "-x");
}
static void view_right(viewer *v)
{
    stand(v, "+x");
}
static void view_top(viewer *v)
{
    stand(v, "+z");
}
static void view_bottom(viewer *v)
{
    stand(v, "-z");
}
static void view_iso(viewer *v)
{
    stand(v, "iso");
}

static void fit(viewer *v)
{
    if (!v->source) return;
    const tl_camera from = viewer_camera(v);
    if (!viewer_ok(v, tl_scene_do(v->ctx, v->scene, "fit"))) return;
    const tl_camera to = viewer_camera(v);
    viewer_set_camera(v, &from);
    viewer_fly_to(v, &to);
}

static void step(viewer *v, double right, double up)
{
    tl_camera camera = viewer_camera(v);
    tl_camera_orbit(&camera, NULL, right, up, viewer_orbit_style(v), NULL);
    viewer_input_keep(v);
    viewer_set_camera(v, &camera);
}

static void turn_left(viewer *v)
{
    step(v, -KEY_DEGREES, 0);
}
static void turn_right(viewer *v)
{
    step(v, KEY_DEGREES, 0);
}
static void turn_up(viewer *v)
{
    step(v, 0, KEY_DEGREES);
}
static void turn_down(viewer *v)
{
    step(v, 0, -KEY_DEGREES);
}

static void zoom_in(viewer *v)
{
    viewer_input_scroll(v, gtk_widget_get_width(v->picture) / 2.0,
                        gtk_widget_get_height(v->picture) / 2.0, -1);
}
static void zoom_out(viewer *v)
{
    viewer_input_scroll(v, gtk_widget_get_width(v->picture) / 2.0,
                        gtk_widget_get_height(v->picture) / 2.0, 1);
}

static void toggle_spin(viewer *v)
{
    v->motion->is_spinning = !v->motion->is_spinning;
    go_on(v);
}
static bool is_spinning(const viewer *v)
{
    return v->motion && v->motion->is_spinning;
}

static void toggle_trackball(viewer *v)
{
    v->motion->is_trackball = !v->motion->is_trackball;
}
static bool is_trackball(const viewer *v)
{
    return v->motion && v->motion->is_trackball;
}

static void toggle_parallel(viewer *v)
{
    tl_camera camera = viewer_camera(v);
    tl_camera_set_parallel(&camera, !(camera.parallel_scale > 0));
    viewer_set_camera(v, &camera);
    tl_scene_seal(v->scene);
}
static bool is_parallel(const viewer *v)
{
    return tl_scene_flag(v->scene, TL_NODE_CAMERA + 1, "parallel");
}

static void undo(viewer *v)
{
    if (tl_scene_undo_name(v->scene)) viewer_do(v, "undo");
}
static void redo(viewer *v)
{
    if (tl_scene_redo_name(v->scene)) viewer_do(v, "redo");
}

static const viewer_action ACTIONS[] = {
    {"", "Drag", "Pointer", "Turn", NULL, NULL},
    {"", "Middle or Shift drag", "Pointer", "Move across", NULL, NULL},
    {"", "Wheel, right drag", "Pointer", "Nearer and farther, there", NULL, NULL},
    {"", "Double click", "Pointer", "Turn around this place", NULL, NULL},
    {"", "Ctrl drag", "Pointer", "Roll", NULL, NULL},
    {"", "Alt drag", "Pointer", "Look around", NULL, NULL},
    {"", "Arrow keys", "Pointer", "Turn by 5 degrees", NULL, NULL},
    {"", "W A S D, Q E", "Fly", "Forward, left, back, right; down, up", NULL, NULL},
    {"", "Shift", "Fly", "Faster", NULL, NULL},
    {"fit", "f Home", "View", "All in view", fit, NULL},
    {"view-front", "1", "View", "Front (from −y)", view_front, NULL},
    {"view-back", "2", "View", "Back (from +y)", view_back, NULL},
    {"view-left", "3", "View", "Left (from −x)", view_left, NULL},
    {"view-right", "4", "View", "Right (from +x)", view_right, NULL},
    {"view-top", "5", "View", "Above (from +z)", view_top, NULL},
    {"view-bottom", "6", "View", "Below (from −z)", view_bottom, NULL},
    {"view-iso", "0", "View", "Isometric", view_iso, NULL},
    {"turn-left", "Left", "", "Turn left", turn_left, NULL},
    {"turn-right", "Right", "", "Turn right", turn_right, NULL},
    {"turn-up", "Up", "", "Turn up", turn_up, NULL},
    {"turn-down", "Down", "", "Turn down", turn_down, NULL},
    {"zoom-in", "plus equal KP_Add", "View", "Nearer", zoom_in, NULL},
    {"zoom-out", "minus KP_Subtract", "View", "Farther", zoom_out, NULL},
    {"parallel", "p", "View", "Parallel, no perspective", toggle_parallel, is_parallel},
    {"spin", "space", "View", "Spin", toggle_spin, is_spinning},
    {"trackball", "t", "View", "Turn freely, over the poles", toggle_trackball, is_trackball},
    {"undo", "<Control>z", "Scene", "Undo", undo, NULL},
    {"redo", "<Control><Shift>z <Control>y", "Scene", "Redo", redo, NULL},
};

/* ---- the part ---- */

void viewer_motion_attach(viewer *v)
{
    GtkEventController *keys = gtk_event_controller_key_new();
    GtkEventController *focus = gtk_event_controller_focus_new();
    v->motion = g_new0(struct viewer_motion, 1);
    g_signal_connect(keys, "key-pressed", G_CALLBACK(on_key), v);
    g_signal_connect(keys, "key-released", G_CALLBACK(on_key_up), v);
    g_signal_connect(focus, "leave", G_CALLBACK(on_leave), v);
    gtk_widget_add_controller(v->picture, keys);
    gtk_widget_add_controller(v->picture, focus);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
}

void viewer_motion_destroy(viewer *v)
{
    g_clear_pointer(&v->motion, g_free);
}
