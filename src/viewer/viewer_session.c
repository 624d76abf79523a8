/* What is remembered: recent files, the window's size and style, and, while the window is open, its
 * scene, so that it can be offered again after a crash. In the state folder of the user:
 * viewer.ini, and session-PID.ini with session-PID.json of each open window. A script leaves it
 * alone. */
#include "viewer_core.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SAVE_SECONDS 4
#define RECENT_MAX 10
#define GROUP "viewer"

struct viewer_session {
    char *folder; /* NULL: nothing is kept */
    GKeyFile *file;
    char *name;                   /* session-PID, with its folder */
    uint64_t saved;               /* version of the scene */
    char *lost_data, *lost_scene; /* of a window that crashed */
    guint timer;
};

static char *in_folder(const struct viewer_session *s, const char *name, const char *ending)
{
    char *file = g_strconcat(name, ending, NULL);
    char *path = g_build_filename(s->folder, file, NULL);
    g_free(file);
    return path;
}

static void save_file(const struct viewer_session *s)
{
    if (!s->folder) return;
    char *path = in_folder(s, "viewer", ".ini");
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

/* ---- the scene of an open window ---- */

static void remove_files(const char *name)
{
    static const char *const ENDINGS[] = {".ini", ".json"};
    for (int i = 0; i < 2; i++) {
        char *path = g_strconcat(name, ENDINGS[i], NULL);
        unlink(path);
        g_free(path);
    }
}

static gboolean on_timer(gpointer data)
{
    viewer *v = data;
    struct viewer_session *s = v->session;
    const uint64_t version = tl_scene_version(v->scene);
    if (!v->source || version == s->saved) return G_SOURCE_CONTINUE;
    GKeyFile *file = g_key_file_new();
    char *scene = g_strconcat(s->name, ".json", NULL), *ini = g_strconcat(s->name, ".ini", NULL);
    char *whole = g_canonicalize_filename(v->path, NULL);
    g_key_file_set_string(file, GROUP, "data", whole);
    if (tl_scene_write(v->ctx, v->scene, scene) == TL_OK) g_key_file_save_to_file(file, ini, NULL);
    s->saved = version;
    g_free(whole);
    g_free(scene);
    g_free(ini);
    g_key_file_free(file);
    return G_SOURCE_CONTINUE;
}

static bool is_running(int pid)
{
    return pid > 0 && (kill(pid, 0) == 0 || errno != ESRCH);
}

/* Takes the session of a window that is no more; false: there is none of this name. */
static bool take_lost(struct viewer_session *s, const char *name)
{
    if (!g_str_has_prefix(name, "session-") || !g_str_has_suffix(name, ".ini")) return false;
    if (is_running(atoi(name + strlen("session-")))) return false;
    char *path = g_build_filename(s->folder, name, NULL);
    GKeyFile *file = g_key_file_new();
    char *stem = g_strndup(path, strlen(path) - strlen(".ini"));
    const bool is_read = g_key_file_load_from_file(file, path, G_KEY_FILE_NONE, NULL);
    char *data = is_read ? g_key_file_get_string(file, GROUP, "data", NULL) : NULL;
    char *json = g_strconcat(stem, ".json", NULL), *kept = in_folder(s, "lost", ".json");
    g_key_file_free(file);
    const bool is_lost = data && rename(json, kept) == 0;
    remove_files(stem);
    if (is_lost) {
        g_free(s->lost_data);
        g_free(s->lost_scene);
        s->lost_data = g_steal_pointer(&data);
        s->lost_scene = g_steal_pointer(&kept);
    }
    g_free(data);
    g_free(kept);
    g_free(json);
    g_free(stem);
    g_free(path);
    return is_lost;
}

static void restore(viewer *v)
{
    viewer_open(v, v->session->lost_data, v->session->lost_scene);
}

void viewer_session_offer(viewer *v)
{
    struct viewer_session *s = v->session;
    GDir *folder = s->folder ? g_dir_open(s->folder, 0, NULL) : NULL;
    const char *name;
    while (folder && (name = g_dir_read_name(folder))) take_lost(s, name);
    if (folder) g_dir_close(folder);
    if (!s->lost_data) return;
    char *file = g_path_get_basename(s->lost_data);
    viewer_offer(v, "Restore", restore, "The last window, with ‘%s’, did not end well.", file);
    g_free(file);
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
    char *path = in_folder(s, "viewer", ".ini");
    char *name = g_strdup_printf("session-%d", (int)getpid());
    g_key_file_load_from_file(s->file, path, G_KEY_FILE_NONE, NULL); /* at first there is none */
    s->name = g_build_filename(s->folder, name, NULL);
    s->timer = g_timeout_add_seconds(SAVE_SECONDS, on_timer, v);
    g_free(name);
    g_free(path);
}

void viewer_session_destroy(viewer *v)
{
    struct viewer_session *s = v->session;
    int width, height;
    if (s->folder) {
        gtk_window_get_default_size(v->window, &width, &height);
        g_key_file_set_integer(s->file, GROUP, "width", width);
        g_key_file_set_integer(s->file, GROUP, "height", height);
        g_key_file_set_boolean(s->file, GROUP, "dark", viewer_window_is_dark(v));
        save_file(s);
        remove_files(s->name);
        g_source_remove(s->timer);
    }
    g_key_file_free(s->file);
    g_free(s->folder);
    g_free(s->name);
    g_free(s->lost_data);
    g_free(s->lost_scene);
    g_free(s);
}
