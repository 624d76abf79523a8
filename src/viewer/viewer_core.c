/* Scene, live view and the parts that hear of them. Changes are gathered until the loop is idle:
 * then the live view gets the scene once, and the parts hear once what has changed. Frames and
 * events of the live view come on its threads; its hook wakes the loop. */
#include "viewer_core.h"
#include "viewer_tools.h"

#include <stdarg.h>
#include <stdatomic.h>

typedef struct ear {
    viewer_listener listener;
    void *user;
} ear;

struct viewer_core {
    GArray *ears[VIEWER_SIGNAL_COUNT]; /* ear */
    guint flush_source;
    uint64_t things, camera; /* versions that the parts know of */
    uint64_t sent;           /* version that the live view has */
    double window[4];        /* of the scene: where the picture has room for the data */
    uint64_t kept;           /* version of the camera that was kept; 0: none was */
    bool is_reframed;        /* it is another one than the live view has */
    int gestures;            /* that go on */
    atomic_int is_woken;     /* the loop will look for frames and events */
    GBytes *frame_bytes;     /* keeps v->frame */
    GPtrArray *held;         /* held_frame: those that the window, or GTK, has */
    bool is_ended;           /* parts are going: nothing is told any more */
};

/* A frame whose pixels a texture shows. */
typedef struct held_frame {
    viewer *v; /* NULL: it was given back, as the live view goes */
    const tl_frame *frame;
} held_frame;

/* ---- signals ---- */

void viewer_listen(viewer *v, viewer_signal signal, viewer_listener listener, void *user)
{
    const ear e = {listener, user};
    g_array_append_val(v->core->ears[signal], e);
}

void viewer_tell(viewer *v, viewer_signal signal)
{
    const GArray *ears = v->core->ears[signal];
    if (v->core->is_ended) return;
    for (guint i = 0; i < ears->len; i++) {
        const ear e = g_array_index(ears, ear, i);
        e.listener(v, e.user);
    }
}

/* A number of all nodes but the camera, in order. */
static uint64_t things_version(const tl_scene *scene)
{
    size_t count;
    uint64_t version = 0;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    for (size_t i = 0; i < count; i++) {
        if (tl_scene_kind(scene, nodes[i]) == TL_NODE_CAMERA) continue;
        version =
            (version ^ tl_scene_node_version(scene, nodes[i]) ^ nodes[i]) * 0x9e3779b97f4a7c15;
        version ^= version >> 29;
    }
    return version;
}

static void send_scene(viewer *v)
{
    struct viewer_core *core = v->core;
    const uint64_t version = tl_scene_version(v->scene);
    if ((version == core->sent && !core->is_reframed) || !v->source) return;
    if (tl_live_set_scene(v->live, v->scene))
        viewer_say(v, VIEWER_ERROR, "The scene does not fit in memory; an older one is shown.");
    core->sent = version;
    core->is_reframed = false;
}

void viewer_flush(viewer *v)
{
    struct viewer_core *core = v->core;
    if (core->flush_source) g_source_remove(core->flush_source);
    core->flush_source = 0;
    if (core->is_ended) return;
    const uint64_t things = things_version(v->scene);
    const uint64_t camera = tl_scene_node_version(v->scene, TL_NODE_CAMERA + 1);
    const bool other_things = things != core->things, other_camera = camera != core->camera;
    core->things = things;
    core->camera = camera;
    if (other_things) viewer_frame_scene(v); /* words come and go, and the room for the data */
    send_scene(v);
    if (v->selected && !tl_scene_name(v->scene, v->selected)) viewer_select(v, 0);
    if (other_things) viewer_tell(v, VIEWER_SCENE);
    if (other_camera) viewer_tell(v, VIEWER_CAMERA);
}

static gboolean on_flush(gpointer data)
{
    viewer *v = data;
    v->core->flush_source = 0;
    viewer_flush(v);
    return G_SOURCE_REMOVE;
}

void viewer_changed(viewer *v)
{
    if (!v->core->flush_source && !v->core->is_ended)
        v->core->flush_source = g_idle_add_full(G_PRIORITY_HIGH_IDLE, on_flush, v, NULL);
}

/* ---- changing the scene ---- */

bool viewer_ok(viewer *v, tl_status status)
{
    if (!status) return true;
    const char *message = tl_ctx_message(v->ctx);
    viewer_say(v, VIEWER_ERROR, "%s", *message ? message : tl_status_name(status));
    return false;
}

bool viewer_do(viewer *v, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *line = g_strdup_vprintf(format, arguments);
    va_end(arguments);
    const tl_status st = tl_scene_do(v->ctx, v->scene, line);
    g_free(line);
    viewer_changed(v);
    return viewer_ok(v, st);
}

void viewer_select(viewer *v, tl_node node)
{
    if (v->selected == node) return;
    v->selected = node;
    viewer_tell(v, VIEWER_SELECTED);
}

void viewer_begin_gesture(viewer *v)
{
    if (v->core->gestures++ == 0) tl_live_set_moving(v->live, true);
}

void viewer_end_gesture(viewer *v)
{
    if (--v->core->gestures > 0) return;
    viewer_flush(v);
    tl_scene_seal(v->scene);
    tl_live_set_moving(v->live, false);
}

/* ---- frames and events ---- */

static void release_frame(gpointer data)
{
    held_frame *held = data;
    if (held->v) {
        tl_live_release(held->v->live, held->frame);
        g_ptr_array_remove_fast(held->v->core->held, held);
    }
    g_free(held);
}

/* What GTK keeps of a window that is gone (a widget whose drag has not ended) is not drawn again:
 * its frames go back before the live view ends. */
static void release_held(struct viewer_core *core, tl_live *live)
{
    for (guint i = 0; i < core->held->len; i++) {
        held_frame *held = g_ptr_array_index(core->held, i);
        tl_live_release(live, held->frame);
        held->v = NULL;
    }
    g_ptr_array_free(core->held, TRUE);
}

/* It was made for a window of another size or with other words beside the data. */
static bool is_old_frame(const viewer *v)
{
    const tl_frame *frame = v->frame;
    const int scale = gtk_widget_get_scale_factor(v->picture);
    tl_camera now;
    tl_scene_camera(v->scene, frame->width, frame->height, &now);
    return v->core->is_reframed ||
           frame->width != (uint32_t)(gtk_widget_get_width(v->picture) * scale) ||
           frame->height != (uint32_t)(gtk_widget_get_height(v->picture) * scale) ||
           memcmp(&now, &frame->camera, sizeof now) != 0;
}

/* A camera that was chosen for the data stays where it is once all is seen from it: what is added
 * then does not move the picture. */
static void keep_camera(viewer *v)
{
    tl_value position;
    if (!v->frame->is_final || v->frame->scene_version != tl_scene_version(v->scene)) return;
    if (tl_scene_undo_name(v->scene)) return;
    if (tl_scene_get(v->ctx, v->scene, TL_NODE_CAMERA + 1, "position", &position)) return;
    if (position.count || is_old_frame(v)) return;
    const tl_status st = tl_scene_set_camera(v->ctx, v->scene, &v->frame->camera);
    tl_scene_forget(v->ctx, v->scene);
    v->core->kept = tl_scene_node_version(v->scene, TL_NODE_CAMERA + 1);
    if (viewer_ok(v, st)) viewer_changed(v);
}

/* Shows the newest frame. It is kept as long as the widget, or what GTK remembers of it, needs its
 * pixels. */
static void take_frame(viewer *v)
{
    struct viewer_core *core = v->core;
    const tl_frame *frame = tl_live_frame(v->live);
    if (!frame) return;
    held_frame *held = g_new(held_frame, 1);
    *held = (held_frame){v, frame};
    g_ptr_array_add(core->held, held);
    GBytes *bytes = g_bytes_new_with_free_func(frame->rgba, (gsize)frame->width * frame->height * 4,
                                               release_frame, held);
    const bool is_finer = v->frame && v->frame->width == frame->width &&
                          v->frame->height == frame->height && !frame->is_moving &&
                          memcmp(&v->frame->camera, &frame->camera, sizeof frame->camera) == 0;
    v->frame = frame;
    if (core->frame_bytes) g_bytes_unref(core->frame_bytes);
    core->frame_bytes = bytes;
    viewer_picture_show(v->picture, bytes, frame->width, frame->height, is_finer);
    viewer_tell(v, VIEWER_FRAME);
    keep_camera(v);
}

void viewer_take_scene(viewer *v, tl_scene *scene)
{
    struct viewer_core *core = v->core;
    tl_scene_destroy(v->ctx, v->scene);
    v->scene = scene;
    v->selected = 0;
    core->kept = 0;
    memset(core->window, 0, sizeof core->window); /* the live view has the scene as it came */
    viewer_frame_scene(v);
    tl_scene_forget(v->ctx, v->scene);
    send_scene(v);
    core->things = things_version(v->scene);
    core->camera = tl_scene_node_version(v->scene, TL_NODE_CAMERA + 1);
    viewer_tell(v, VIEWER_SOURCE);
    viewer_tell(v, VIEWER_SCENE);
    viewer_tell(v, VIEWER_CAMERA);
    viewer_tell(v, VIEWER_SELECTED);
}

/* The scene of what was opened becomes the window's. */
static void take_source(viewer *v)
{
    tl_scene *scene = NULL;
    const tl_status st = tl_live_get_scene(v->live, v->ctx, &scene);
    v->source = tl_live_source(v->live);
    viewer_opened(v);
    if (!viewer_ok(v, st)) return;
    v->core->sent = tl_scene_version(scene);
    viewer_take_scene(v, scene);
}

static void take_news(viewer *v)
{
    tl_live_event event;
    while (tl_live_next_event(v->live, &event)) {
        v->event = &event;
        if (event.kind == TL_LIVE_OPENED) take_source(v);
        viewer_tell(v, VIEWER_LIVE);
        v->event = NULL;
    }
    take_frame(v);
}

static gboolean on_awake(gpointer data)
{
    viewer *v = data;
    atomic_store(&v->core->is_woken, 0);
    if (!v->core->is_ended) take_news(v);
    return G_SOURCE_REMOVE;
}

static void on_notify(void *user)
{
    viewer *v = user;
    if (!atomic_exchange(&v->core->is_woken, 1))
        g_idle_add_full(G_PRIORITY_HIGH_IDLE, on_awake, v, NULL);
}

/* ---- sizes ---- */

/* While nobody has touched it, a camera that was kept goes on following the window. */
static void release_camera(viewer *v)
{
    const bool is_kept = v->core->kept == tl_scene_node_version(v->scene, TL_NODE_CAMERA + 1);
    if (!is_kept || tl_scene_undo_name(v->scene)) return;
    viewer_ok(v, tl_scene_set_reals(v->ctx, v->scene, TL_NODE_CAMERA + 1, "position", NULL, 0));
    tl_scene_forget(v->ctx, v->scene);
}

void viewer_frame_scene(viewer *v)
{
    double window[4], bounds[6] = {0};
    const int scale = gtk_widget_get_scale_factor(v->picture);
    const int width = gtk_widget_get_width(v->picture) * scale;
    const int height = gtk_widget_get_height(v->picture) * scale;
    if (width < 1 || height < 1) return;
    const tl_node picture = TL_NODE_PICTURE + 1;
    const bool has_frame =
        tl_scene_flag(v->scene, picture, "axes") || tl_scene_flag(v->scene, picture, "box");
    tl_annotation annotation = tl_annotation_defaults();
    annotation.bar_count = tl_scene_flag(v->scene, picture, "bar");
    annotation.axes = tl_scene_flag(v->scene, picture, "axes");
    annotation.bounds = has_frame ? bounds : NULL;
    annotation.title = *tl_scene_text(v->scene, picture, "title") ? "" : NULL;
    annotation.note = tl_scene_flag(v->scene, picture, "note") ? "" : NULL;
    tl_annotation_window(&annotation, (uint32_t)width, (uint32_t)height, window);
    if (v->frame && (v->frame->width != (uint32_t)width || v->frame->height != (uint32_t)height))
        release_camera(v);
    viewer_ok(v, tl_scene_set_frame(v->ctx, v->scene, (uint32_t)width, (uint32_t)height, window));
    tl_live_set_size(v->live, (uint32_t)width, (uint32_t)height);
    if (memcmp(window, v->core->window, sizeof window) == 0) return;
    memcpy(v->core->window, window, sizeof window);
    v->core->is_reframed = true; /* which is no change of the scene */
    viewer_changed(v);
}

/* ---- states ---- */

bool viewer_settled(viewer *v)
{
    const struct viewer_core *core = v->core;
    if (!gtk_widget_get_mapped(v->picture) || core->flush_source || core->gestures ||
        !tl_live_settled(v->live) || viewer_tools_asks(v))
        return false;
    take_news(v); /* its last frame may be on its way */
    return !core->flush_source && viewer_picture_is_still(v) && tl_live_settled(v->live) &&
           (!v->frame || v->frame->scene_version == core->sent);
}

/* ---- the part ---- */

bool viewer_core_create(viewer *v)
{
    tl_live_opts opts = tl_live_opts_defaults();
    tl_ctx_opts ctx_opts = tl_ctx_opts_defaults();
    v->core = g_new0(struct viewer_core, 1);
    v->core->held = g_ptr_array_new();
    for (int i = 0; i < VIEWER_SIGNAL_COUNT; i++)
        v->core->ears[i] = g_array_new(FALSE, FALSE, sizeof(ear));
    opts.thread_count = (unsigned)v->words->thread_count;
    opts.ram_bytes = (uint64_t)v->words->memory_bytes;
    opts.throttle_bytes_s = (uint64_t)v->words->throttle_bytes_s;
    opts.renderer = v->words->renderer;
    opts.is_bgra = true; /* what the window is painted from: nothing is converted */
    opts.notify = on_notify;
    opts.user = v;
    ctx_opts.thread_count = 1;
    tl_status st = tl_ctx_create(&ctx_opts, &v->ctx);
    if (!st) st = tl_scene_create(v->ctx, &v->scene);
    if (!st) st = tl_live_create(&opts, &v->live);
    if (st) g_printerr("tetralod-view: can't begin: %s\n", tl_status_name(st));
    return !st;
}

void viewer_core_end(viewer *v)
{
    viewer_tell(v, VIEWER_END);
    v->core->is_ended = true;
}

bool viewer_core_is_ended(const viewer *v)
{
    return v->core->is_ended;
}

void viewer_core_destroy(viewer *v)
{
    struct viewer_core *core = v->core;
    core->is_ended = true;
    if (core->flush_source) g_source_remove(core->flush_source);
    if (core->frame_bytes) g_bytes_unref(core->frame_bytes);
    v->frame = NULL;
    release_held(core, v->live);
    tl_live_destroy(v->live);
    while (g_idle_remove_by_data(v)) {
    }
    if (v->save) viewer_save_destroy(v); /* the source of the live view is gone */
    tl_scene_destroy(v->ctx, v->scene);
    tl_ctx_destroy(v->ctx);
    for (int i = 0; i < VIEWER_SIGNAL_COUNT; i++) g_array_free(core->ears[i], TRUE);
    g_free(core);
    g_free(v->path);
}
