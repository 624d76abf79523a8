/* Pictures of any size, and sequences of them, saved by a thread of their own: the same source,
 * scene and camera, but all that the scene asks for at that size. As `tetralod render --scene`
 * draws them. */
#include "viewer_core.h"

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

#define SIDE_MOST 16384
#define FRAMES_MOST 100000
#define ONCE_AROUND 360.0 /* degrees */

typedef struct job {
    viewer *v;
    tl_source *source;
    tl_scene *scene;
    tl_camera camera;
    char *path; /* of several frames with a %d for their number */
    uint32_t frame_count;
    double degrees; /* around, in all frames */
    GThread *thread;
    atomic_int done, is_over; /* frames; the thread has ended */
    tl_status status;         /* then */
} job;

struct viewer_save {
    tl_ctx *ctx; /* of the thread; the source keeps what it allocated */
    job *job;    /* NULL: none */
    atomic_int is_cancelled;
    guint timer;
    /* the dialog */
    GtkWindow *dialog;
    GtkWidget *width, *height, *keep, *transparent, *frames, *degrees;
    double aspect;
    double chosen[2]; /* width and height of the last picture; 0: none */
    bool is_free;     /* it was not in proportion */
    bool is_sequence;
    job *asked; /* a job whose path is asked for */
};

bool viewer_save_idle(const viewer *v)
{
    return !v->save->job;
}

/* ---- the thread ---- */

static bool on_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    (void)stage, (void)done, (void)total;
    return !atomic_load(&((viewer *)user)->save->is_cancelled);
}

static bool is_page(const char *path)
{
    return g_str_has_suffix(path, ".pdf") || g_str_has_suffix(path, ".svg");
}

static tl_status save(tl_ctx *ctx, const job *j, const tl_content *content, const tl_camera *camera,
                      tl_image *image, const char *path)
{
    tl_value color;
    float background[3];
    if (is_page(path)) return tl_content_write(ctx, content, j->scene, camera, image, path);
    tl_status st = tl_content_annotate(ctx, content, j->scene, camera, image);
    if (st == TL_ERR_UNSUPPORTED) st = TL_OK; /* a build without pango: no words */
    if (!st) st = tl_scene_get(ctx, j->scene, TL_NODE_PICTURE + 1, "background", &color);
    if (!st && color.count == 3) {
        for (int i = 0; i < 3; i++) background[i] = (float)color.reals[i];
        tl_image_flatten(image, background);
    }
    return st ? st : tl_image_write_png(ctx, image, path);
}

static tl_status draw(tl_ctx *ctx, const job *j, tl_view *view, tl_renderer *renderer,
                      const tl_camera *camera, const char *path)
{
    tl_content *content = NULL;
    tl_shown *shown = NULL;
    tl_image *image = NULL;
    tl_draw_opts opts = tl_draw_opts_defaults();
    tl_status st = tl_view_build(ctx, view, j->scene, camera, NULL, &content);
    if (!st) st = tl_shown_create(ctx, renderer, &shown);
    if (!st) st = tl_content_show(ctx, shown, content);
    if (!st) {
        opts.samples =
            tl_content_samples(content, j->scene, camera->size_px[0], camera->size_px[1]);
        st = tl_content_draw(ctx, shown, camera, &opts, &image);
    }
    if (!st) st = save(ctx, j, content, camera, image, path);
    tl_image_destroy(ctx, image);
    tl_shown_destroy(ctx, shown);
    tl_content_destroy(ctx, content);
    return st;
}

/* "dir/frame_0007.png" of "dir/frame.png". */
static char *frame_path(const job *j, uint32_t frame)
{
    if (j->frame_count == 1) return g_strdup(j->path);
    const char *dot = strrchr(j->path, '.');
    const int stem = (int)(dot && !strchr(dot, '/') ? dot - j->path : (long)strlen(j->path));
    return g_strdup_printf("%.*s_%04u%s", stem, j->path, frame, j->path + stem);
}

/* A camera that is not set yet is fitted to the picture, not to the window. */
static tl_status fit_camera(tl_ctx *ctx, job *j, tl_view *view)
{
    double bounds[6], window[4];
    const uint32_t width = j->camera.size_px[0], height = j->camera.size_px[1];
    tl_status st = tl_view_bounds(ctx, view, j->scene, bounds);
    if (!st) st = tl_view_window(ctx, view, j->scene, width, height, window);
    if (!st) st = tl_scene_set_bounds(ctx, j->scene, bounds);
    if (!st) st = tl_scene_set_frame(ctx, j->scene, width, height, window);
    if (!st) tl_scene_camera(j->scene, width, height, &j->camera);
    return st;
}

static gpointer run_job(gpointer data)
{
    static const double UP[3] = {0, 0, 1};
    job *j = data;
    tl_ctx *ctx = j->v->save->ctx;
    tl_view *view = NULL;
    tl_renderer *renderer = NULL;
    const char *word = tl_scene_text(j->scene, TL_NODE_PICTURE + 1, "renderer");
    const tl_renderer_kind kind = strcmp(word, "gl") == 0    ? TL_RENDERER_GL
                                  : strcmp(word, "cpu") == 0 ? TL_RENDERER_CPU
                                                             : TL_RENDERER_AUTO;
    tl_status st = tl_view_create(ctx, j->source, &view);
    if (!st) st = fit_camera(ctx, j, view);
    if (!st) st = tl_renderer_create(ctx, kind, &renderer);
    for (uint32_t i = 0; !st && i < j->frame_count; i++) {
        tl_camera camera = j->camera;
        tl_camera_spin(&camera, camera.focal_point, UP, j->degrees * i / j->frame_count);
        char *path = frame_path(j, i);
        st = draw(ctx, j, view, renderer, &camera, path);
        g_free(path);
        atomic_store(&j->done, (int)i + 1);
    }
    tl_renderer_destroy(ctx, renderer);
    tl_view_destroy(view);
    j->status = st;
    atomic_store(&j->is_over, 1);
    return NULL;
}

/* ---- its begin and end ---- */

static void free_job(job *j)
{
    if (!j) return;
    tl_scene_destroy(j->v->save->ctx, j->scene);
    g_free(j->path);
    g_free(j);
}

static void cancel(viewer *v)
{
    atomic_store(&v->save->is_cancelled, 1);
}

static void show_done(viewer *v, const job *j)
{
    if (j->status == TL_ERR_CANCELLED)
        viewer_say(v, VIEWER_INFO, "Stopped; no more pictures are saved.");
    else if (j->status)
        viewer_say(v, VIEWER_ERROR, "%s", tl_ctx_message(v->save->ctx));
    else if (j->frame_count == 1)
        viewer_say(v, VIEWER_INFO, "Saved ‘%s’.", j->path);
    else
        viewer_say(v, VIEWER_INFO, "Saved %u pictures.", j->frame_count);
}

static gboolean on_timer(gpointer data)
{
    viewer *v = data;
    struct viewer_save *s = v->save;
    const int done = atomic_load(&s->job->done);
    const bool is_over = atomic_load(&s->job->is_over);
    if (!is_over) {
        char *text = s->job->frame_count == 1
                         ? g_strdup("Drawing the picture")
                         : g_strdup_printf("Picture %d of %u", done + 1, s->job->frame_count);
        viewer_window_progress(
            v, text, s->job->frame_count == 1 ? -1 : done / (double)s->job->frame_count, cancel);
        g_free(text);
        return G_SOURCE_CONTINUE;
    }
    g_thread_join(s->job->thread);
    viewer_window_progress(v, NULL, 0, NULL);
    show_done(v, s->job);
    g_clear_pointer(&s->job, free_job);
    s->timer = 0;
    return G_SOURCE_REMOVE;
}

/* Takes over j. */
static bool begin(viewer *v, job *j)
{
    struct viewer_save *s = v->save;
    if (!g_str_has_suffix(j->path, ".png") && !is_page(j->path)) {
        viewer_say(v, VIEWER_ERROR, "'%s': expected a name that ends in .png, .pdf or .svg",
                   j->path);
        free_job(j);
        return false;
    }
    /* the source goes when another one is opened */
    if (s->job || !v->source || viewer_files_opens(v)) {
        viewer_say(v, VIEWER_WARNING, "%s",
                   s->job       ? "Pictures are being saved already."
                   : !v->source ? "There is nothing to save."
                                : "A file is being opened; save pictures after that.");
        free_job(j);
        return false;
    }
    atomic_store(&s->is_cancelled, 0);
    j->source = (tl_source *)(uintptr_t)v->source;
    s->job = j;
    j->thread = g_thread_new("pictures", run_job, j);
    s->timer = g_timeout_add(50, on_timer, v);
    return true;
}

/* A job for what is shown now; NULL: out of memory, which was said. */
static job *make_job(viewer *v, uint32_t width, uint32_t height)
{
    struct viewer_save *s = v->save;
    job *j = g_new0(job, 1);
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.progress = on_progress;
    opts.user = v;
    opts.thread_count = (unsigned)v->words->thread_count;
    j->v = v;
    j->frame_count = 1;
    tl_status st = s->ctx ? TL_OK : tl_ctx_create(&opts, &s->ctx);
    if (!st) tl_ctx_set_budget(s->ctx, tl_live_get_stats(v->live).ram_limit_bytes);
    if (!st) st = tl_scene_copy(s->ctx, v->scene, &j->scene);
    if (st) {
        viewer_say(v, VIEWER_ERROR, "No picture: %s", tl_status_name(st));
        g_free(j);
        return NULL;
    }
    tl_scene_camera(j->scene, width, height, &j->camera);
    return j;
}

/* ---- the dialog ---- */

static void on_replace(GtkDialog *dialog, int response, viewer *v)
{
    job *j = g_steal_pointer(&v->save->asked);
    gtk_window_destroy(GTK_WINDOW(dialog));
    if (response == GTK_RESPONSE_ACCEPT && j)
        begin(v, j);
    else
        free_job(j);
}

/* The dialog for a file asks about one; those of a sequence have other names. */
static void ask_replace(viewer *v, unsigned count)
{
    GtkWidget *dialog =
        gtk_message_dialog_new(v->window, GTK_DIALOG_MODAL | GTK_DIALOG_DESTROY_WITH_PARENT,
                               GTK_MESSAGE_QUESTION, GTK_BUTTONS_NONE, "Replace pictures?");
    gtk_window_set_title(GTK_WINDOW(dialog), "Replace pictures");
    gtk_message_dialog_format_secondary_text(
        GTK_MESSAGE_DIALOG(dialog), "%u of the pictures of this sequence are there already.",
        count);
    gtk_dialog_add_button(GTK_DIALOG(dialog), "_Cancel", GTK_RESPONSE_CANCEL);
    gtk_dialog_add_button(GTK_DIALOG(dialog), "_Replace", GTK_RESPONSE_ACCEPT);
    gtk_dialog_set_default_response(GTK_DIALOG(dialog), GTK_RESPONSE_CANCEL);
    g_signal_connect(dialog, "response", G_CALLBACK(on_replace), v);
    gtk_window_present(GTK_WINDOW(dialog));
}

static unsigned count_there(const job *j)
{
    unsigned count = 0;
    for (uint32_t i = 0; j->frame_count > 1 && i < j->frame_count; i++) {
        char *path = frame_path(j, i);
        count += g_file_test(path, G_FILE_TEST_EXISTS);
        g_free(path);
    }
    return count;
}

static void on_path(GtkNativeDialog *dialog, int response, viewer *v)
{
    struct viewer_save *s = v->save;
    char *path = response == GTK_RESPONSE_ACCEPT ? viewer_dialog_path(dialog) : NULL;
    g_object_unref(dialog);
    if (s->asked) s->asked->path = path;
    const unsigned count = s->asked && path ? count_there(s->asked) : 0;
    if (count)
        ask_replace(v, count);
    else if (s->asked && path)
        begin(v, g_steal_pointer(&s->asked));
    else
        g_clear_pointer(&s->asked, free_job);
}

/* What is written there, also while the keys are. */
static double number_in(GtkWidget *spin)
{
    gtk_spin_button_update(GTK_SPIN_BUTTON(spin));
    return gtk_spin_button_get_value(GTK_SPIN_BUTTON(spin));
}

static void on_accept(GtkButton *button, viewer *v)
{
    (void)button;
    struct viewer_save *s = v->save;
    if (!viewer_save_idle(v) || s->asked) return; /* a place for it is asked for */
    number_in(s->width);                          /* one moves the other */
    const double height = number_in(s->height), width = number_in(s->width);
    s->chosen[0] = width;
    s->chosen[1] = height;
    s->is_free = !gtk_check_button_get_active(GTK_CHECK_BUTTON(s->keep));
    s->asked = make_job(v, (uint32_t)width, (uint32_t)height);
    if (s->asked) {
        if (gtk_check_button_get_active(GTK_CHECK_BUTTON(s->transparent)))
            viewer_ok(v, tl_scene_set_text(s->ctx, s->asked->scene, TL_NODE_PICTURE + 1,
                                           "background", "none"));
        if (s->is_sequence) {
            s->asked->frame_count = (uint32_t)number_in(s->frames);
            s->asked->degrees = number_in(s->degrees);
        }
        char *name =
            s->is_sequence ? g_strdup("frame.png") : viewer_name_like(v, "picture", ".png");
        GtkFileChooserNative *dialog =
            viewer_dialog(v, s->is_sequence ? "Save frames as" : "Save picture as", "_Save",
                          GTK_FILE_CHOOSER_ACTION_SAVE, name, NULL);
        g_free(name);
        g_signal_connect(dialog, "response", G_CALLBACK(on_path), v);
        gtk_native_dialog_show(GTK_NATIVE_DIALOG(dialog));
    }
    gtk_window_destroy(s->dialog);
}

static void on_width(GtkSpinButton *spin, struct viewer_save *s)
{
    if (!gtk_check_button_get_active(GTK_CHECK_BUTTON(s->keep))) return;
    const double height = gtk_spin_button_get_value(spin) / s->aspect;
    if (ABS(height - gtk_spin_button_get_value(GTK_SPIN_BUTTON(s->height))) >= 1)
        gtk_spin_button_set_value(GTK_SPIN_BUTTON(s->height), height);
}

static void on_height(GtkSpinButton *spin, struct viewer_save *s)
{
    if (!gtk_check_button_get_active(GTK_CHECK_BUTTON(s->keep))) return;
    const double width = gtk_spin_button_get_value(spin) * s->aspect;
    if (ABS(width - gtk_spin_button_get_value(GTK_SPIN_BUTTON(s->width))) >= s->aspect)
        gtk_spin_button_set_value(GTK_SPIN_BUTTON(s->width), width);
}

static GtkWidget *add_spin(GtkWidget *grid, int row, const char *name, double least, double most,
                           double value)
{
    GtkWidget *label = gtk_label_new(name), *spin = gtk_spin_button_new_with_range(least, most, 1);
    gtk_label_set_xalign(GTK_LABEL(label), 1);
    gtk_widget_add_css_class(label, "dim-label");
    gtk_spin_button_set_value(GTK_SPIN_BUTTON(spin), value);
    gtk_text_set_activates_default(GTK_TEXT(gtk_editable_get_delegate(GTK_EDITABLE(spin))), TRUE);
    gtk_grid_attach(GTK_GRID(grid), label, 0, row, 1, 1);
    gtk_grid_attach(GTK_GRID(grid), spin, 1, row, 1, 1);
    return spin;
}

static GtkWidget *make_grid(viewer *v)
{
    struct viewer_save *s = v->save;
    GtkWidget *grid = gtk_grid_new(), *save = gtk_button_new_with_mnemonic("_Save…");
    const tl_camera camera = viewer_camera(v);
    int row = 0;
    s->aspect = (double)camera.size_px[0] / camera.size_px[1];
    gtk_grid_set_row_spacing(GTK_GRID(grid), 8);
    gtk_grid_set_column_spacing(GTK_GRID(grid), 12);
    const double width = s->chosen[0] > 0 ? s->chosen[0] : camera.size_px[0];
    const double height = s->is_free ? s->chosen[1] : width / s->aspect;
    s->width = add_spin(grid, row++, "Width, pixels", 16, SIDE_MOST, width);
    s->height = add_spin(grid, row++, "Height, pixels", 16, SIDE_MOST, height);
    s->keep = gtk_check_button_new_with_label("Keep proportions");
    gtk_check_button_set_active(GTK_CHECK_BUTTON(s->keep), !s->is_free);
    gtk_grid_attach(GTK_GRID(grid), s->keep, 1, row++, 1, 1);
    s->transparent = gtk_check_button_new_with_label("Transparent background");
    gtk_grid_attach(GTK_GRID(grid), s->transparent, 1, row++, 1, 1);
    if (s->is_sequence) {
        s->frames = add_spin(grid, row++, "Pictures", 1, FRAMES_MOST, 90);
        s->degrees = add_spin(grid, row++, "Around, degrees", -3600, 3600, ONCE_AROUND);
    }
    GtkWidget *kinds = gtk_label_new("PNG, PDF or SVG, as the name ends");
    gtk_widget_add_css_class(kinds, "dim-label");
    gtk_label_set_xalign(GTK_LABEL(kinds), 0);
    gtk_grid_attach(GTK_GRID(grid), kinds, 1, row++, 1, 1);
    gtk_widget_add_css_class(save, "suggested-action");
    gtk_widget_set_halign(save, GTK_ALIGN_END);
    gtk_widget_set_margin_top(save, 12);
    gtk_grid_attach(GTK_GRID(grid), save, 1, row, 1, 1);
    g_signal_connect(s->width, "value-changed", G_CALLBACK(on_width), s);
    g_signal_connect(s->height, "value-changed", G_CALLBACK(on_height), s);
    g_signal_connect(save, "clicked", G_CALLBACK(on_accept), v);
    gtk_window_set_default_widget(s->dialog, save);
    return grid;
}

static void ask(viewer *v, bool is_sequence)
{
    struct viewer_save *s = v->save;
    if (!v->source || s->asked) return;
    s->is_sequence = is_sequence;
    s->dialog = viewer_dialog_window(v, is_sequence ? "Save frames" : "Save picture");
    GtkWidget *grid = make_grid(v);
    gtk_widget_set_margin_start(grid, 24);
    gtk_widget_set_margin_end(grid, 24);
    gtk_widget_set_margin_top(grid, 18);
    gtk_widget_set_margin_bottom(grid, 18);
    gtk_window_set_resizable(s->dialog, FALSE);
    gtk_window_set_child(s->dialog, grid);
    gtk_window_present(s->dialog);
}

static void save_picture(viewer *v)
{
    ask(v, false);
}

static void save_frames(viewer *v)
{
    ask(v, true);
}

static const viewer_action ACTIONS[] = {
    {"save-picture", "<Control>p", "File", "Save a picture", save_picture, NULL},
    {"save-frames", "<Control><Shift>p", "File", "Save frames", save_frames, NULL},
};

/* ---- commands of scripts ---- */

enum { PATH_WORDS = 4, PATH_BYTES = 4096 };
typedef struct script_words {
    char word[PATH_WORDS][PATH_BYTES];
    int count;
} script_words;

/* The words of a command, those in quotes with their spaces; false: there are too many. */
static bool read_words(viewer *v, const char *line, script_words *words)
{
    bool found = true;
    char rest[PATH_BYTES];
    for (words->count = 0; found && words->count <= PATH_WORDS;) {
        char *to = words->count < PATH_WORDS ? words->word[words->count] : rest;
        if (!viewer_ok(v, tl_scene_word(v->ctx, &line, to, PATH_BYTES, &found))) return false;
        words->count += found;
    }
    return words->count <= PATH_WORDS;
}

/* Of "FILE.png [WIDTHxHEIGHT] ...", without a size that of the view; NULL: other words. */
static job *read_job(viewer *v, const script_words *words)
{
    const tl_camera camera = viewer_camera(v);
    int width = (int)camera.size_px[0], height = (int)camera.size_px[1];
    if (!words->count || (words->count > 1 && !viewer_read_size(words->word[1], &width, &height)))
        return NULL;
    job *j = make_job(v, (uint32_t)width, (uint32_t)height);
    if (j) j->path = g_strdup(words->word[0]);
    return j;
}

static bool run_picture(viewer *v, const char *arguments)
{
    script_words words;
    if (!read_words(v, arguments, &words) || words.count > 2) return false;
    job *j = read_job(v, &words);
    return j && begin(v, j);
}

static bool run_frames(viewer *v, const char *arguments)
{
    script_words words;
    char *end_of_count, *end_of_degrees = NULL;
    double degrees = ONCE_AROUND;
    if (!read_words(v, arguments, &words) || words.count < 3) return false;
    const gint64 count = g_ascii_strtoll(words.word[2], &end_of_count, 10);
    if (words.count == 4) degrees = g_ascii_strtod(words.word[3], &end_of_degrees);
    if (count < 1 || count > FRAMES_MOST || *end_of_count || (end_of_degrees && *end_of_degrees) ||
        !isfinite(degrees))
        return false;
    job *j = read_job(v, &words);
    if (!j) return false;
    j->frame_count = (uint32_t)count;
    j->degrees = degrees;
    return begin(v, j);
}

static const viewer_command COMMANDS[] = {
    {"picture", "picture FILE.png [WIDTHxHEIGHT]", run_picture},
    {"frames", "frames FILE.png WIDTHxHEIGHT COUNT [DEGREES]", run_frames},
};

/* ---- the part ---- */

void viewer_save_attach(viewer *v)
{
    v->save = g_new0(struct viewer_save, 1);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
}

void viewer_save_end(viewer *v)
{
    struct viewer_save *s = v->save;
    if (s->timer) g_source_remove(s->timer);
    cancel(v);
    if (s->job) g_thread_join(s->job->thread);
    free_job(s->job);
    free_job(s->asked);
}

void viewer_save_destroy(viewer *v)
{
    tl_ctx_destroy(v->save->ctx);
    g_free(v->save);
}
