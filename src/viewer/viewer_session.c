/* What is remembered: recent files, the window's size and style, and, while the window is open, its
 * scene, so that it can be offered again after a crash. In the state folder of the user:
 * viewer.ini, and of each open window session-NAME.ini (its data set), .json (its scene) and .lock,
 * which it holds. A lock that nobody holds is that of a window that crashed: the system lets go of
 * it however a program ends, on whichever computer of a shared home. Files of such a window stay
 * until its scene is open again or the offer is refused. A script leaves all of this alone. */
#include "viewer_core.h"

#include <fcntl.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define SAVE_SECONDS 4
#define RECENT_MAX 10
#define NAME_TRIES 8
#define GROUP "viewer"

/* Files of a window; name: with their folder, without an ending. */
typedef struct window_files {
    char *name; /* NULL: none */
    int lock;   /* held */
} window_files;

struct viewer_session {
    char *folder; /* NULL: nothing is kept */
    GKeyFile *file;
    window_files own, lost; /* lost: of a window that crashed, while its scene is offered */
    char *lost_data;
    bool is_restoring; /* it is being opened */
    uint64_t saved;    /* version of the scene */
    guint timer;
};

/* What another window has written since is kept. */
static void load_file(struct viewer_session *s)
{
    if (!s->folder) return;
    char *path = g_build_filename(s->folder, "viewer.ini", NULL);
    GKeyFile *file = g_key_file_new();
    if (g_key_file_load_from_file(file, path, G_KEY_FILE_NONE, NULL)) {
        g_key_file_free(s->file);
        s->file = g_steal_pointer(&file);
    }
    g_clear_pointer(&file, g_key_file_free);
    g_free(path);
}

static void save_file(const struct viewer_session *s)
{
    if (!s->folder) return;
    char *path = g_build_filename(s->folder, "viewer.ini", NULL);
    g_key_file_save_to_file(s->file, path, NULL); /* where it can't, nothing is remembered */
    g_free(path);
}

/* ---- recent files ---- */

char **viewer_session_recent(const viewer *v)
{
    char **paths = g_key_file_get_string_list(v->session->file, GROUP, "recent", NULL, NULL);
    return paths ? paths : g_new0(char *, 1);
}

void viewer_session_add_recent(viewer *v, const char *path)
{
    char *whole = g_canonicalize_filename(path, NULL);
    load_file(v->session);
    char **old = viewer_session_recent(v);
    const char *paths[RECENT_MAX] = {whole};
    gsize count = 1;
    for (int i = 0; old[i] && count < RECENT_MAX; i++)
        if (strcmp(old[i], whole) != 0) paths[count++] = old[i];
    g_key_file_set_string_list(v->session->file, GROUP, "recent", paths, count);
    save_file(v->session);
    g_strfreev(old);
    g_free(whole);
}

/* ---- files of a window ---- */

/* Holds the lock of a name; false: another window does, or it can't be held. */
static bool hold(window_files *files, const char *name, int flags)
{
    struct stat held, named;
    char *path = g_strconcat(name, ".lock", NULL);
    files->lock = open(path, O_RDWR | O_CLOEXEC | flags, 0600);
    bool is_held = files->lock >= 0 && flock(files->lock, LOCK_EX | LOCK_NB) == 0;
    /* not the lock of a window that has removed its files in between */
    if (is_held)
        is_held = fstat(files->lock, &held) == 0 && stat(path, &named) == 0 &&
                  held.st_ino == named.st_ino;
    if (is_held)
        files->name = g_strdup(name);
    else if (files->lock >= 0)
        close(files->lock);
    g_free(path);
    return is_held;
}

static void let_go(window_files *files)
{
    if (files->name) close(files->lock);
    g_clear_pointer(&files->name, g_free);
}

static void remove_file(const char *folder, const char *name)
{
    char *path = g_build_filename(folder, name, NULL);
    unlink(path);
    g_free(path);
}

/* All that begins with its name, as a crash may leave half of a file; the lock last. */
static void remove_files(const struct viewer_session *s, window_files *files)
{
    if (!files->name) return;
    char *base = g_path_get_basename(files->name), *lock = g_strconcat(base, ".lock", NULL);
    GDir *folder = g_dir_open(s->folder, 0, NULL);
    const char *name;
    while (folder && (name = g_dir_read_name(folder)))
        if (g_str_has_prefix(name, base) && strcmp(name, lock) != 0) remove_file(s->folder, name);
    if (folder) g_dir_close(folder);
    remove_file(s->folder, lock);
    g_free(lock);
    g_free(base);
    let_go(files);
}

/* A name that no window has had. */
static void begin_own(struct viewer_session *s)
{
    for (int i = 0; i < NAME_TRIES && !s->own.name; i++) {
        char *file = g_strdup_printf("session-%08x", g_random_int());
        char *name = g_build_filename(s->folder, file, NULL);
        hold(&s->own, name, O_CREAT | O_EXCL);
        g_free(name);
        g_free(file);
    }
}

static void save_scene(viewer *v)
{
    struct viewer_session *s = v->session;
    const uint64_t version = tl_scene_version(v->scene);
    if (!s->own.name || !v->source || version == s->saved) return;
    GKeyFile *file = g_key_file_new();
    char *scene = g_strconcat(s->own.name, ".json", NULL);
    char *ini = g_strconcat(s->own.name, ".ini", NULL);
    char *whole = g_canonicalize_filename(v->path, NULL);
    g_key_file_set_string(file, GROUP, "data", whole);
    /* a scene that is there has its data set beside it */
    if (g_key_file_save_to_file(file, ini, NULL) && !tl_scene_write(v->ctx, v->scene, scene))
        s->saved = version;
    g_free(whole);
    g_free(scene);
    g_free(ini);
    g_key_file_free(file);
}

static gboolean on_timer(gpointer data)
{
    save_scene(data);
    return G_SOURCE_CONTINUE;
}

/* ---- the scene of a window that crashed ---- */

/* The data set of a window whose files are whole; NULL: they are not. */
static char *data_of(viewer *v, const window_files *files)
{
    GKeyFile *file = g_key_file_new();
    tl_scene *scene = NULL;
    char *ini = g_strconcat(files->name, ".ini", NULL);
    char *json = g_strconcat(files->name, ".json", NULL), *data = NULL;
    if (g_key_file_load_from_file(file, ini, G_KEY_FILE_NONE, NULL))
        data = g_key_file_get_string(file, GROUP, "data", NULL);
    if (data && tl_scene_read(v->ctx, json, &scene)) g_clear_pointer(&data, g_free);
    tl_scene_destroy(v->ctx, scene);
    g_key_file_free(file);
    g_free(json);
    g_free(ini);
    return data;
}

static gint64 time_of(const window_files *files)
{
    struct stat facts;
    char *json = g_strconcat(files->name, ".json", NULL);
    const bool is_there = stat(json, &facts) == 0;
    g_free(json);
    return is_there ? (gint64)facts.st_mtim.tv_sec * 1000000000 + facts.st_mtim.tv_nsec : 0;
}

/* Keeps the last one that crashed; others are offered when that is done with. */
static void consider(viewer *v, const char *lock_name)
{
    struct viewer_session *s = v->session;
    window_files files = {NULL, -1};
    char *whole = g_build_filename(s->folder, lock_name, NULL);
    whole[strlen(whole) - strlen(".lock")] = '\0';
    if (hold(&files, whole, 0)) {
        char *data = data_of(v, &files);
        if (!data) {
            remove_files(s, &files);
        } else if (!s->lost.name || time_of(&files) > time_of(&s->lost)) {
            let_go(&s->lost);
            g_free(s->lost_data);
            s->lost = files;
            s->lost_data = data;
        } else {
            let_go(&files);
            g_free(data);
        }
    }
    g_free(whole);
}

static void restore(viewer *v)
{
    char *scene = g_strconcat(v->session->lost.name, ".json", NULL);
    v->session->is_restoring = true;
    viewer_open(v, v->session->lost_data, scene);
    g_free(scene);
}

static void refuse(viewer *v)
{
    remove_files(v->session, &v->session->lost);
}

void viewer_session_offer(viewer *v)
{
    struct viewer_session *s = v->session;
    GDir *folder = s->folder ? g_dir_open(s->folder, 0, NULL) : NULL;
    const char *name;
    while (folder && (name = g_dir_read_name(folder)))
        if (g_str_has_prefix(name, "session-") && g_str_has_suffix(name, ".lock"))
            consider(v, name);
    if (folder) g_dir_close(folder);
    if (!s->lost.name) return;
    char *file = g_path_get_basename(s->lost_data);
    viewer_offer(v, "Restore", restore, refuse, "The last window, with ‘%s’, did not end well.",
                 file);
    g_free(file);
}

/* What was offered is this window's from now on. */
static void on_source(viewer *v, void *user)
{
    (void)user;
    struct viewer_session *s = v->session;
    save_scene(v);
    if (s->is_restoring && g_strcmp0(v->path, s->lost_data) == 0) remove_files(s, &s->lost);
}

/* ---- the window ---- */

void viewer_session_window(const viewer *v, int *width, int *height, bool *dark)
{
    GKeyFile *file = v->session->file;
    const int kept_width = g_key_file_get_integer(file, GROUP, "width", NULL);
    const int kept_height = g_key_file_get_integer(file, GROUP, "height", NULL);
    const bool fits =
        kept_width >= 400 && kept_width <= 16384 && kept_height >= 300 && kept_height <= 16384;
    if (fits) *width = kept_width, *height = kept_height;
    if (g_key_file_has_key(file, GROUP, "dark", NULL))
        *dark = g_key_file_get_boolean(file, GROUP, "dark", NULL);
}

/* ---- the part ---- */

void viewer_session_create(viewer *v)
{
    struct viewer_session *s = g_new0(struct viewer_session, 1);
    v->session = s;
    s->file = g_key_file_new();
    if (v->words->script || v->words->screenshot) return;
    s->folder = g_build_filename(g_get_user_state_dir(), "tetralod", NULL);
    if (g_mkdir_with_parents(s->folder, 0700) != 0) {
        g_clear_pointer(&s->folder, g_free);
        return;
    }
    load_file(s);
    begin_own(s);
    s->timer = g_timeout_add_seconds(SAVE_SECONDS, on_timer, v);
    viewer_listen(v, VIEWER_SOURCE, on_source, NULL);
}

void viewer_session_destroy(viewer *v)
{
    struct viewer_session *s = v->session;
    int width, height;
    if (s->folder) {
        gtk_window_get_default_size(v->window, &width, &height);
        load_file(s);
        g_key_file_set_integer(s->file, GROUP, "width", width);
        g_key_file_set_integer(s->file, GROUP, "height", height);
        g_key_file_set_boolean(s->file, GROUP, "dark", viewer_window_is_dark(v));
        save_file(s);
        remove_files(s, &s->own);
        g_source_remove(s->timer);
    }
    let_go(&s->lost); /* not answered: the next window asks again */
    g_key_file_free(s->file);
    g_free(s->folder);
    g_free(s->lost_data);
    g_free(s);
}
