/* The widget that shows the frames of the live view, and over them what tools draw. A frame that is
 * finer than the one before, of the same view, is faded in, so that refinement does not jump.
 * Frames that move come as they are.
 *
 * A frame is a GdkMemoryTexture on the pixels of the live view: nothing is copied here. GTK's
 * renderer on the processor turns textures of any format into floats and back (4.8: 5 ms for 1,200
 * x 760 pixels), so that it gets the pixels as a surface of cairo, as which they are made (0.3 ms).
 */
#include "viewer_core.h"

#include <math.h>
#include <time.h>

#define FADE_S 0.12

#define VIEWER_TYPE_PICTURE (viewer_picture_get_type())
G_DECLARE_FINAL_TYPE(ViewerPicture, viewer_picture, VIEWER, PICTURE, GtkWidget)

struct _ViewerPicture {
    GtkWidget parent;
    viewer *v;
    GdkTexture *texture, *former; /* former: while it is faded over */
    gint64 fade_begin;
    guint fade_tick;
    GArray *tools; /* viewer_tool */
    GdkFrameClock *clock;
    gint64 paint_begin;
    double paint_cpu_s;
    viewer_paint_stats stats;
};

G_DEFINE_FINAL_TYPE(ViewerPicture, viewer_picture, GTK_TYPE_WIDGET)

/* ---- drawing ---- */

static double faded(const ViewerPicture *self)
{
    const double part = (double)(g_get_monotonic_time() - self->fade_begin) / 1e6 / FADE_S;
    const double t = CLAMP(part, 0, 1);
    return t * t * (3 - 2 * t);
}

static void draw_tools(ViewerPicture *self, GtkSnapshot *snapshot, double width, double height)
{
    const graphene_rect_t all = GRAPHENE_RECT_INIT(0, 0, (float)width, (float)height);
    const bool dark = viewer_window_is_dark(self->v);
    cairo_t *cr = NULL;
    for (guint i = 0; i < self->tools->len; i++) {
        const viewer_tool *tool = &g_array_index(self->tools, viewer_tool, i);
        if (!tool->draw || !tool->shown || !tool->shown(self->v, tool->user)) continue;
        if (!cr) cr = gtk_snapshot_append_cairo(snapshot, &all);
        cairo_save(cr);
        tool->draw(self->v, tool->user, cr, width, height, dark);
        cairo_restore(cr);
    }
    if (cr) cairo_destroy(cr);
}

/* Name of the surface of a texture. */
static const char SURFACE[] = "tetralod-surface";

static void append_surface(GtkSnapshot *s, cairo_surface_t *surface, const graphene_rect_t *place,
                           double scale)
{
    cairo_t *cr = gtk_snapshot_append_cairo(s, place);
    cairo_translate(cr, (double)place->origin.x, (double)place->origin.y);
    cairo_scale(cr, scale, scale);
    cairo_set_source_surface(cr, surface, 0, 0);
    if (scale == 1) cairo_pattern_set_filter(cairo_get_source(cr), CAIRO_FILTER_NEAREST);
    cairo_paint(cr);
    cairo_destroy(cr);
}

/* A frame of another size, while the window's changes, is shown as the one to come: as high as the
 * view, since angles count from its lower to its upper edge. */
static void append(GtkSnapshot *s, GdkTexture *texture, double width, double height)
{
    const double scale = height / gdk_texture_get_height(texture);
    const double wide = scale * gdk_texture_get_width(texture);
    const graphene_rect_t place =
        GRAPHENE_RECT_INIT((float)((width - wide) / 2), 0, (float)wide, (float)height);
    cairo_surface_t *surface = g_object_get_data(G_OBJECT(texture), SURFACE);
    if (surface)
        append_surface(s, surface, &place, scale);
    else
        gtk_snapshot_append_texture(s, texture, &place);
}

static void snapshot(GtkWidget *widget, GtkSnapshot *s)
{
    ViewerPicture *self = VIEWER_PICTURE(widget);
    const double width = gtk_widget_get_width(widget), height = gtk_widget_get_height(widget);
    if (self->former) {
        append(s, self->former, width, height);
        gtk_snapshot_push_opacity(s, faded(self));
    }
    if (self->texture) append(s, self->texture, width, height);
    if (self->former) gtk_snapshot_pop(s);
    if (self->texture) draw_tools(self, s, width, height);
}

/* ---- frames ---- */

static void end_fade(ViewerPicture *self)
{
    g_clear_object(&self->former);
    if (self->fade_tick) gtk_widget_remove_tick_callback(GTK_WIDGET(self), self->fade_tick);
    self->fade_tick = 0;
}

static gboolean on_fade(GtkWidget *widget, GdkFrameClock *clock, gpointer data)
{
    (void)clock, (void)data;
    ViewerPicture *self = VIEWER_PICTURE(widget);
    gtk_widget_queue_draw(widget);
    if (faded(self) < 1) return G_SOURCE_CONTINUE;
    g_clear_object(&self->former);
    self->fade_tick = 0;
    return G_SOURCE_REMOVE;
}

static void release_bytes(void *bytes)
{
    g_bytes_unref(bytes);
}

/* The pixels as a surface, where the window is painted by cairo, whose pixels are theirs. */
static void add_surface(GtkWidget *picture, GdkTexture *texture, GBytes *bytes, int width,
                        int height)
{
    static const cairo_user_data_key_t key;
    GtkNative *native = gtk_widget_get_native(picture);
    if (G_BYTE_ORDER != G_LITTLE_ENDIAN || !native ||
        !GSK_IS_CAIRO_RENDERER(gtk_native_get_renderer(native)))
        return;
    guchar *pixels = (guchar *)(uintptr_t)g_bytes_get_data(bytes, NULL); /* only read */
    cairo_surface_t *surface =
        cairo_image_surface_create_for_data(pixels, CAIRO_FORMAT_ARGB32, width, height, 4 * width);
    cairo_surface_set_user_data(surface, &key, g_bytes_ref(bytes), release_bytes);
    g_object_set_data_full(G_OBJECT(texture), SURFACE, surface,
                           (GDestroyNotify)cairo_surface_destroy);
}

void viewer_picture_show(GtkWidget *picture, GBytes *bytes, uint32_t width, uint32_t height,
                         bool is_finer)
{
    ViewerPicture *self = VIEWER_PICTURE(picture);
    GdkTexture *former = self->texture;
    self->texture = NULL;
    end_fade(self);
    if (bytes) {
        self->texture = gdk_memory_texture_new(
            (int)width, (int)height, GDK_MEMORY_B8G8R8A8_PREMULTIPLIED, bytes, (gsize)width * 4);
        add_surface(picture, self->texture, bytes, (int)width, (int)height);
    }
    if (is_finer && former && self->texture) {
        self->former = former;
        self->fade_begin = g_get_monotonic_time();
        self->fade_tick = gtk_widget_add_tick_callback(picture, on_fade, NULL, NULL);
    } else
        g_clear_object(&former);
    gtk_widget_queue_draw(picture);
}

bool viewer_picture_is_still(const viewer *v)
{
    return !VIEWER_PICTURE(v->picture)->former;
}

/* ---- tools ---- */

void viewer_add_tool(viewer *v, const viewer_tool *tool)
{
    g_array_append_vals(VIEWER_PICTURE(v->picture)->tools, tool, 1);
}

const GArray *viewer_tools_all(const viewer *v)
{
    return VIEWER_PICTURE(v->picture)->tools;
}

void viewer_redraw(viewer *v)
{
    gtk_widget_queue_draw(v->picture);
}

/* ---- places ---- */

/* Pixels of the frame to one of the widget. */
static double frame_scale(const viewer *v)
{
    const double height = gtk_widget_get_height(v->picture);
    return height > 0 ? v->frame->height / height : 1;
}

/* Pixels of the frame left of the widget's edge; 0 but while the window's size changes. */
static double hidden_px(const viewer *v)
{
    return (v->frame->width - frame_scale(v) * gtk_widget_get_width(v->picture)) / 2;
}

void viewer_frame_px(const viewer *v, double x, double y, double px[2])
{
    px[0] = x * frame_scale(v) + hidden_px(v);
    px[1] = y * frame_scale(v);
}

bool viewer_project(const viewer *v, const double xyz[3], double *x, double *y)
{
    double px[2], distance;
    if (!v->frame || !tl_camera_project(&v->frame->camera, xyz, px, &distance)) return false;
    *x = (px[0] - hidden_px(v)) / frame_scale(v);
    *y = px[1] / frame_scale(v);
    return true;
}

bool viewer_depth_at(const viewer *v, double x, double y, double xyz[3])
{
    double px[2], origin[3], direction[3], forward = 0, length = 0;
    const tl_frame *frame = v->frame;
    if (!frame || !frame->depth) return false;
    viewer_frame_px(v, x, y, px);
    if (px[0] < 0 || px[1] < 0 || px[0] >= frame->width || px[1] >= frame->height) return false;
    const double depth = (double)frame->depth[(size_t)px[1] * frame->width + (size_t)px[0]];
    if (!isfinite(depth)) return false;
    tl_camera_ray(&frame->camera, px[0], px[1], origin, direction);
    /* depth counts along the view, not along the sight */
    for (int i = 0; i < 3; i++) {
        const double d = frame->camera.focal_point[i] - frame->camera.position[i];
        forward += d * direction[i];
        length += d * d;
    }
    if (!(forward > 0)) return false; /* a camera that looks nowhere */
    const double cosine = forward / sqrt(length);
    for (int i = 0; i < 3; i++) xyz[i] = origin[i] + direction[i] * depth / cosine;
    return true;
}

/* ---- what painting the window takes ---- */

/* Of this thread, so that what others do does not count. */
static double cpu_seconds(void)
{
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void on_before_paint(GdkFrameClock *clock, ViewerPicture *self)
{
    (void)clock;
    self->paint_begin = g_get_monotonic_time();
    self->paint_cpu_s = cpu_seconds();
}

static void on_after_paint(GdkFrameClock *clock, ViewerPicture *self)
{
    (void)clock;
    const double seconds = (double)(g_get_monotonic_time() - self->paint_begin) / 1e6;
    self->stats.count++;
    self->stats.cpu_s += cpu_seconds() - self->paint_cpu_s;
    self->stats.longest_s = MAX(self->stats.longest_s, seconds);
}

static void realize(GtkWidget *widget)
{
    ViewerPicture *self = VIEWER_PICTURE(widget);
    GTK_WIDGET_CLASS(viewer_picture_parent_class)->realize(widget);
    self->clock = g_object_ref(gtk_widget_get_frame_clock(widget));
    g_signal_connect(self->clock, "before-paint", G_CALLBACK(on_before_paint), self);
    g_signal_connect(self->clock, "after-paint", G_CALLBACK(on_after_paint), self);
}

static void unrealize(GtkWidget *widget)
{
    ViewerPicture *self = VIEWER_PICTURE(widget);
    g_signal_handlers_disconnect_by_data(self->clock, self);
    g_clear_object(&self->clock);
    GTK_WIDGET_CLASS(viewer_picture_parent_class)->unrealize(widget);
}

viewer_paint_stats viewer_picture_stats(const viewer *v)
{
    return VIEWER_PICTURE(v->picture)->stats;
}

void viewer_picture_reset_stats(viewer *v)
{
    VIEWER_PICTURE(v->picture)->stats = (viewer_paint_stats){0};
}

/* ---- the widget ---- */

static void size_allocate(GtkWidget *widget, int width, int height, int baseline)
{
    (void)width, (void)height, (void)baseline;
    viewer_frame_scene(VIEWER_PICTURE(widget)->v);
}

static void dispose(GObject *object)
{
    ViewerPicture *self = VIEWER_PICTURE(object);
    end_fade(self);
    g_clear_object(&self->texture);
    G_OBJECT_CLASS(viewer_picture_parent_class)->dispose(object);
}

static void finalize(GObject *object)
{
    g_array_free(VIEWER_PICTURE(object)->tools, TRUE);
    G_OBJECT_CLASS(viewer_picture_parent_class)->finalize(object);
}

static void viewer_picture_class_init(ViewerPictureClass *klass)
{
    GtkWidgetClass *widget = GTK_WIDGET_CLASS(klass);
    widget->snapshot = snapshot;
    widget->size_allocate = size_allocate;
    widget->realize = realize;
    widget->unrealize = unrealize;
    G_OBJECT_CLASS(klass)->dispose = dispose;
    G_OBJECT_CLASS(klass)->finalize = finalize;
    gtk_widget_class_set_css_name(widget, "tetralod-picture");
}

static void viewer_picture_init(ViewerPicture *self)
{
    self->tools = g_array_new(FALSE, FALSE, sizeof(viewer_tool));
}

GtkWidget *viewer_picture_create(viewer *v)
{
    ViewerPicture *self = g_object_new(VIEWER_TYPE_PICTURE, NULL);
    GtkWidget *widget = GTK_WIDGET(self);
    self->v = v;
    gtk_widget_set_hexpand(widget, TRUE);
    gtk_widget_set_vexpand(widget, TRUE);
    gtk_widget_set_focusable(widget, TRUE);
    gtk_widget_set_overflow(widget, GTK_OVERFLOW_HIDDEN);
    return widget;
}
