/* Files: opened by the command line, a dialog, a drop or from the recent ones; scenes. */
#include "viewer_core.h"

#include <glib/gstdio.h>
#include <string.h>

static const tl_node DATA = TL_NODE_DATA + 1, PICTURE = TL_NODE_PICTURE + 1;
/* What a first look stands in front of. */
static const double DARK[3] = {0.115, 0.12, 0.13}, LIGHT[3] = {1, 1, 1};

struct viewer_files {
    char *opening;    /* path that is being opened */
    bool is_replaced; /* another file was being opened, whose end is not this one's */
    GMenu *recent;
};

/* ---- opening ---- */

bool viewer_files_idle(const viewer *v)
{
    return !v->files->opening && viewer_models_idle(v);
}

bool viewer_files_opens(const viewer *v)
{
    return v->files->opening != NULL;
}

/* scene: one of the window's context, which may be changed. */
static void open_now(viewer *v, const char *path, tl_scene *scene)
{
    struct viewer_files *files = v->files;
    if (!viewer_save_idle(v)) {
        viewer_say(v, VIEWER_WARNING, "Pictures are being saved; open '%s' after that.", path);
        return;
    }
    char *whole = g_canonicalize_filename(path, NULL);
    tl_status st = tl_scene_set_text(v->ctx, scene, DATA, "file", whole);
    const char *why = st ? tl_ctx_message(v->ctx) : "";
    if (!st) st = tl_live_open(v->live, whole, scene);
    if (st) {
        viewer_say(v, VIEWER_ERROR, "'%s' can't be opened: %s", path,
                   *why ? why : tl_status_name(st));
        g_free(whole);
        return;
    }
    files->is_replaced = files->opening != NULL;
    g_free(files->opening);
    files->opening = whole;
    viewer_window_retitle(v);
}

/* Without things: the live view adds those of a first look. */
static tl_status make_scene(viewer *v, tl_scene **scene)
{
    tl_status st = tl_scene_create(v->ctx, scene);
    if (!st)
        st = tl_scene_set_reals(v->ctx, *scene, PICTURE, "background",
                                viewer_window_is_dark(v) ? DARK : LIGHT, 3);
    return st;
}

/* The data set that a scene names, beside its own file where the name has no folder to begin with;
 * NULL: none. */
static char *data_of(const tl_scene *scene, const char *scene_path)
{
    const char *file = tl_scene_text(scene, DATA, "file");
    char *folder = g_path_get_dirname(scene_path);
    char *whole = g_canonicalize_filename(folder, NULL);
    char *path = *file ? g_canonicalize_filename(file, whole) : NULL;
    g_free(whole);
    g_free(folder);
    return path;
}

static bool is_scene(const char *path)
{
    return g_str_has_suffix(path, ".json");
}

void viewer_open(viewer *v, const char *path, const char *scene_path)
{
    tl_scene *scene = NULL;
    char *named = NULL;
    if (path && !scene_path && is_scene(path)) {
        scene_path = path;
        path = NULL;
    }
    const tl_status st =
        scene_path ? tl_scene_read(v->ctx, scene_path, &scene) : make_scene(v, &scene);
    if (!viewer_ok(v, st)) {
        tl_scene_destroy(v->ctx, scene);
        return;
    }
    if (!path) named = data_of(scene, scene_path);
    if (path || named)
        open_now(v, path ? path : named, scene);
    else
        viewer_say(v, VIEWER_ERROR, "'%s' names no data set; open that first.", scene_path);
    tl_scene_destroy(v->ctx, scene);
    g_free(named);
}

/* Shows what is open as the scene of a file says, or opens what that names. */
static bool open_scene(viewer *v, const char *path)
{
    tl_scene *scene = NULL;
    double bounds[6];
    if (!viewer_ok(v, tl_scene_read(v->ctx, path, &scene))) return false;
    char *file = data_of(scene, path);
    const bool is_other = !v->source || (file && g_strcmp0(file, v->path) != 0 &&
                                         g_file_test(file, G_FILE_TEST_EXISTS));
    g_free(file);
    if (is_other) {
        tl_scene_destroy(v->ctx, scene);
        viewer_open(v, NULL, path);
        return true;
    }
    tl_scene_bounds(v->scene, bounds);
    if (!viewer_ok(v, tl_scene_set_bounds(v->ctx, scene, bounds))) {
        tl_scene_destroy(v->ctx, scene);
        return false;
    }
    viewer_take_scene(v, scene);
    return true;
}

void viewer_opened(viewer *v)
{
    struct viewer_files *files = v->files;
    g_free(v->path);
    v->path = g_strdup(tl_source_get_facts(v->source)->name);
    viewer_session_add_recent(v, v->path);
    if (g_strcmp0(files->opening, v->path) != 0) return; /* the next one is on its way */
    viewer_unsay(v);                                     /* what was wrong with the one before */
    g_clear_pointer(&files->opening, g_free);
    files->is_replaced = false;
}

/* Pictures that stand in front of one style's background go over to the other's. */
void viewer_files_restyle(viewer *v)
{
    tl_value value;
    const bool dark = viewer_window_is_dark(v);
    const double *former = dark ? LIGHT : DARK, *next = dark ? DARK : LIGHT;
    if (tl_scene_get(v->ctx, v->scene, PICTURE, "background", &value) || value.count != 3 ||
        memcmp(value.reals, former, sizeof DARK) != 0)
        return;
    viewer_ok(v, tl_scene_set_reals(v->ctx, v->scene, PICTURE, "background", next, 3));
    tl_scene_seal(v->scene);
    viewer_changed(v);
}

/* ---- what was chosen ---- */

bool viewer_may_write(viewer *v, const char *path)
{
    GStatBuf data, there;
    if (!v->path || g_stat(path, &there) || g_stat(v->path, &data) || there.st_dev != data.st_dev ||
        there.st_ino != data.st_ino)
        return true;
    viewer_say(v, VIEWER_ERROR, "'%s' is the data set that is open: choose another name.", path);
    return false;
}

static void cancel_open(viewer *v)
{
    v->files->is_replaced = false;
    tl_live_cancel(v->live, TL_LIVE_OPEN);
}

void viewer_open_as_shown(viewer *v, const char *path, bool has_steps)
{
    tl_scene *scene = NULL;
    tl_status st = tl_scene_copy(v->ctx, v->scene, &scene);
    if (!st && !has_steps) st = tl_scene_set_real(v->ctx, scene, DATA, "step", -1);
    if (viewer_ok(v, st)) open_now(v, path, scene);
    tl_scene_destroy(v->ctx, scene);
}

/* Opens what a person chose: a scene, a model, or a mesh, of which a large one raises a question.
 */
static void open_chosen(viewer *v, const char *path)
{
    if (is_scene(path))
        open_scene(v, path);
    else if (!viewer_models_ask(v, path))
        viewer_open(v, path, NULL);
}

/* ---- dialogs ---- */

char *viewer_dialog_path(GtkNativeDialog *dialog)
{
    GFile *file = gtk_file_chooser_get_file(GTK_FILE_CHOOSER(dialog));
    char *path = file ? g_file_get_path(file) : NULL;
    g_clear_object(&file);
    return path;
}

char *viewer_stem(const char *path)
{
    char *stem = g_path_get_basename(path);
    char *dot = strrchr(stem, '.');
    if (dot && dot != stem && !g_file_test(path, G_FILE_TEST_IS_DIR)) *dot = '\0';
    return stem;
}

char *viewer_name_like(const viewer *v, const char *other, const char *ending)
{
    char *stem = v->path ? viewer_stem(v->path) : g_strdup(other);
    char *name = g_strconcat(stem, ending, NULL);
    g_free(stem);
    return name;
}

GtkFileChooserNative *viewer_dialog(viewer *v, const char *title, const char *accept,
                                    GtkFileChooserAction action, const char *name,
                                    const char *folder)
{
    GtkFileChooserNative *dialog =
        gtk_file_chooser_native_new(title, v->window, action, accept, "_Cancel");
    gtk_native_dialog_set_modal(GTK_NATIVE_DIALOG(dialog), TRUE);
    if (name) gtk_file_chooser_set_current_name(GTK_FILE_CHOOSER(dialog), name);
    char *own = folder || !v->path ? NULL : g_path_get_dirname(v->path);
    if (folder || own) {
        GFile *file = g_file_new_for_path(folder ? folder : own);
        gtk_file_chooser_set_current_folder(GTK_FILE_CHOOSER(dialog), file, NULL);
        g_object_unref(file);
    }
    g_free(own);
    return dialog;
}

/* All endings that the program reads. */
static void add_filters(GtkFileChooserNative *dialog)
{
    GtkFileFilter *known = gtk_file_filter_new(), *all = gtk_file_filter_new();
    gtk_file_filter_set_name(known, "Models, meshes and scenes");
    gtk_file_filter_add_suffix(known, "tlod");
    gtk_file_filter_add_suffix(known, "json");
    for (size_t i = 0; tl_format_get(i); i++) {
        const tl_format *format = tl_format_get(i);
        char **endings = g_strsplit(format->endings, " ", -1);
        for (int k = 0; format->reads && endings[k]; k++)
            if (endings[k][0] == '.') gtk_file_filter_add_suffix(known, endings[k] + 1);
        g_strfreev(endings);
    }
    gtk_file_filter_set_name(all, "All files");
    gtk_file_filter_add_pattern(all, "*");
    gtk_file_chooser_add_filter(GTK_FILE_CHOOSER(dialog), known);
    gtk_file_chooser_add_filter(GTK_FILE_CHOOSER(dialog), all);
    g_object_unref(known);
    g_object_unref(all);
}

static void on_open(GtkNativeDialog *dialog, int response, viewer *v)
{
    char *path = response == GTK_RESPONSE_ACCEPT ? viewer_dialog_path(dialog) : NULL;
    g_object_unref(dialog);
    if (path) open_chosen(v, path);
    g_free(path);
}

static void show_open(viewer *v)
{
    GtkFileChooserNative *dialog =
        viewer_dialog(v, "Open", "_Open", GTK_FILE_CHOOSER_ACTION_OPEN, NULL, NULL);
    add_filters(dialog);
    g_signal_connect(dialog, "response", G_CALLBACK(on_open), v);
    gtk_native_dialog_show(GTK_NATIVE_DIALOG(dialog));
}

static void on_save_scene(GtkNativeDialog *dialog, int response, viewer *v)
{
    char *path = response == GTK_RESPONSE_ACCEPT ? viewer_dialog_path(dialog) : NULL;
    g_object_unref(dialog);
    if (path && viewer_may_write(v, path) && viewer_ok(v, tl_scene_write(v->ctx, v->scene, path))) {
        char *word = g_shell_quote(path);
        viewer_say(v, VIEWER_INFO,
                   "Saved. Without a window, this draws it: "
                   "tetralod render --scene %s -o picture.png",
                   word);
        g_free(word);
    }
    g_free(path);
}

static void save_scene(viewer *v)
{
    char *name = viewer_name_like(v, "scene", ".json");
    GtkFileChooserNative *dialog =
        viewer_dialog(v, "Save scene", "_Save", GTK_FILE_CHOOSER_ACTION_SAVE, name, NULL);
    g_signal_connect(dialog, "response", G_CALLBACK(on_save_scene), v);
    gtk_native_dialog_show(GTK_NATIVE_DIALOG(dialog));
    g_free(name);
}

static const viewer_action ACTIONS[] = {
    {"open", "<Control>o", "File", "Open a data set or a scene", show_open, NULL},
    {"open-scene", "", "File", "Open a scene", show_open, NULL},
    {"save-scene", "<Control>s", "File", "Save the scene", save_scene, NULL},
};

/* ---- recent files ---- */

static void on_recent(GSimpleAction *action, GVariant *parameter, gpointer data)
{
    (void)action;
    open_chosen(data, g_variant_get_string(parameter, NULL));
}

static void fill_recent(viewer *v)
{
    GMenu *menu = v->files->recent;
    char **paths = viewer_session_recent(v);
    g_menu_remove_all(menu);
    for (int i = 0; paths[i]; i++) {
        char *name = g_path_get_basename(paths[i]);
        char **parts = g_strsplit(name, "_", -1); /* a menu takes one for a mnemonic */
        char *label = g_strjoinv("__", parts);
        GMenuItem *item = g_menu_item_new(label, NULL);
        g_menu_item_set_action_and_target(item, "win.open-recent", "s", paths[i]);
        g_menu_append_item(menu, item);
        g_object_unref(item);
        g_strfreev(parts);
        g_free(label);
        g_free(name);
    }
    g_strfreev(paths);
}

GMenu *viewer_files_recent_menu(viewer *v)
{
    return v->files->recent;
}

/* ---- what the live view says ---- */

static void on_open_failed(viewer *v, const tl_live_event *event)
{
    struct viewer_files *files = v->files;
    const bool is_cancelled = event->status == TL_ERR_CANCELLED;
    viewer_window_progress(v, NULL, 0, NULL);
    const bool is_too_large = event->status == TL_ERR_BUDGET || event->status == TL_ERR_MEMORY;
    if (is_too_large && files->opening && !v->words->script)
        viewer_models_offer(v, files->opening, event->text);
    else if (!is_cancelled)
        viewer_say(v, VIEWER_ERROR, "%s", event->text);
    if (!is_cancelled || !files->is_replaced) g_clear_pointer(&files->opening, g_free);
    files->is_replaced = false;
    viewer_window_retitle(v);
}

static void on_live(viewer *v, void *user)
{
    (void)user;
    const tl_live_event *event = v->event;
    const bool is_open = event->job == TL_LIVE_OPEN;
    if (event->kind == TL_LIVE_PROGRESS && is_open)
        viewer_window_job(v, "Reading", event, cancel_open);
    else if (is_open && event->kind == TL_LIVE_FAILED)
        on_open_failed(v, event);
    else if (event->kind == TL_LIVE_FAILED && event->status != TL_ERR_CANCELLED &&
             (event->job == TL_LIVE_CONTENT || event->job == TL_LIVE_DRAWING))
        viewer_say(v, VIEWER_ERROR, "%s", event->text);
    else if (event->kind == TL_LIVE_NOTICE)
        viewer_say(v, VIEWER_WARNING, "%s", event->text);
}

static void on_source(viewer *v, void *user)
{
    (void)user;
    viewer_window_progress(v, NULL, 0, NULL);
    fill_recent(v);
}

/* ---- drops ---- */

/* Those that are no steps of the same series. */
static guint count_others(viewer *v, const char *path, const GSList *files)
{
    tl_series series = {0};
    guint others = 0;
    if (files && tl_series_find(v->ctx, path, NULL, &series)) tl_ctx_clear(v->ctx);
    for (; files; files = files->next) {
        char *other = g_file_get_path(files->data);
        bool is_step = false;
        for (size_t i = 0; other && i < series.count; i++)
            is_step |= strcmp(series.steps[i].path, other) == 0;
        others += !is_step;
        g_free(other);
    }
    tl_series_release(v->ctx, &series);
    return others;
}

static gboolean on_drop(GtkDropTarget *target, const GValue *value, double x, double y, viewer *v)
{
    (void)target, (void)x, (void)y;
    const GSList *files = g_value_get_boxed(value);
    char *path = files ? g_file_get_path(files->data) : NULL;
    if (!path) return FALSE;
    open_chosen(v, path);
    const guint others = count_others(v, path, files->next);
    if (others)
        viewer_say(v, VIEWER_WARNING,
                   "One data set is shown at a time: '%s'. %u of those dropped %s not opened.",
                   path, others, others == 1 ? "was" : "were");
    g_free(path);
    return TRUE;
}

/* ---- commands of scripts ---- */

static bool run_open(viewer *v, const char *arguments)
{
    viewer_open(v, arguments, NULL);
    return true;
}

static bool run_scene(viewer *v, const char *arguments)
{
    return open_scene(v, arguments);
}

static bool run_save_scene(viewer *v, const char *arguments)
{
    return viewer_may_write(v, arguments) &&
           viewer_ok(v, tl_scene_write(v->ctx, v->scene, arguments));
}

static const viewer_command COMMANDS[] = {
    {"open", "open FILE", run_open},
    {"scene", "scene FILE.json", run_scene},
    {"save-scene", "save-scene FILE.json", run_save_scene},
};

/* ---- the part ---- */

void viewer_files_create(viewer *v)
{
    v->files = g_new0(struct viewer_files, 1);
    v->files->recent = g_menu_new();
    fill_recent(v);
}

void viewer_files_attach(viewer *v)
{
    GSimpleAction *recent = g_simple_action_new("open-recent", G_VARIANT_TYPE_STRING);
    GtkDropTarget *drop = gtk_drop_target_new(GDK_TYPE_FILE_LIST, GDK_ACTION_COPY);
    g_signal_connect(recent, "activate", G_CALLBACK(on_recent), v);
    g_action_map_add_action(G_ACTION_MAP(v->window), G_ACTION(recent));
    g_object_unref(recent);
    g_signal_connect(drop, "drop", G_CALLBACK(on_drop), v);
    gtk_widget_add_controller(GTK_WIDGET(v->window), GTK_EVENT_CONTROLLER(drop));
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
    viewer_listen(v, VIEWER_LIVE, on_live, NULL);
    viewer_listen(v, VIEWER_SOURCE, on_source, NULL);
}

void viewer_files_destroy(viewer *v)
{
    g_object_unref(v->files->recent);
    g_free(v->files->opening);
    g_free(v->files);
}
