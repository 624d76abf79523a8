/* The program tetralod-view, which `tetralod view` starts: words, parts, loop. */
#include "viewer_core.h"
#include "viewer_figures.h"

#include <glib-unix.h>
#include <locale.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { DONE = 0, FAILED = 1, WRONG_USE = 2 };

bool viewer_read_size(const char *text, int *width, int *height)
{
    char *end;
    const gint64 w = g_ascii_strtoll(text, &end, 10);
    if (end == text || *end != 'x') return false;
    const char *rest = end + 1;
    const gint64 h = g_ascii_strtoll(rest, &end, 10);
    if (end == rest || *end || w < 100 || h < 100 || w > 16384 || h > 16384) return false;
    *width = (int)w;
    *height = (int)h;
    return true;
}

static bool read_renderer(const char *text, tl_renderer_kind *kind)
{
    static const char *const NAMES[] = {"auto", "cpu", "gl"};
    static const tl_renderer_kind KINDS[] = {TL_RENDERER_AUTO, TL_RENDERER_CPU, TL_RENDERER_GL};
    for (int i = 0; i < 3; i++)
        if (strcmp(text, NAMES[i]) == 0) *kind = KINDS[i];
    return strcmp(text, "auto") == 0 || *kind != TL_RENDERER_AUTO;
}

static int misuse(const char *text, const char *word)
{
    fprintf(stderr, "tetralod-view: %s%s\n  'tetralod help view' lists the options\n", text, word);
    return WRONG_USE;
}

/* `tetralod view` has checked the words; this is for those who call the program itself. */
static int read_words(int *argc, char ***argv, viewer_words *words)
{
    char *size = NULL, *renderer = NULL;
    const GOptionEntry entries[] = {
        {"scene", 0, 0, G_OPTION_ARG_FILENAME, &words->scene, "what is shown, and how", "S.json"},
        {"screenshot", 0, 0, G_OPTION_ARG_FILENAME, &words->screenshot,
         "save the window when its picture is complete, and end", "OUT.png"},
        {"size", 0, 0, G_OPTION_ARG_STRING, &size, "of the window", "WxH"},
        {"script", 0, 0, G_OPTION_ARG_FILENAME, &words->script, "commands, one a line", "FILE"},
        {"stats", 0, 0, G_OPTION_ARG_NONE, &words->stats, "print figures at the end", NULL},
        {"renderer", 0, 0, G_OPTION_ARG_STRING, &renderer, "what draws", "auto|gl|cpu"},
        {"threads", 0, 0, G_OPTION_ARG_INT, &words->thread_count, "0: one a processor", "N"},
        {"memory", 0, 0, G_OPTION_ARG_INT64, &words->memory_bytes, "limit", "BYTES"},
        {"throttle", 0, 0, G_OPTION_ARG_INT64, &words->throttle_bytes_s,
         "read models no faster, for tests", "BYTES"},
        {.long_name = NULL}};
    GError *error = NULL;
    int wrong = DONE;
    GOptionContext *context = g_option_context_new("[FILE]");
    g_option_context_add_main_entries(context, entries, NULL);
    if (!g_option_context_parse(context, argc, argv, &error)) wrong = misuse(error->message, "");
    g_clear_error(&error);
    g_option_context_free(context);
    if (!wrong && *argc > 2) wrong = misuse("one file at a time, not also ", (*argv)[2]);
    if (!wrong && size && !viewer_read_size(size, &words->width, &words->height))
        wrong = misuse("--size: expected WIDTHxHEIGHT, not ", size);
    if (!wrong && renderer && !read_renderer(renderer, &words->renderer))
        wrong = misuse("--renderer: expected auto, gl or cpu, not ", renderer);
    if (!wrong && (words->thread_count < 0 || words->thread_count > TL_THREADS_MAX))
        wrong = misuse("--threads: out of range", "");
    if (!wrong && *argc > 1) words->file = g_strdup((*argv)[1]);
    g_free(size);
    g_free(renderer);
    return wrong;
}

static void release_words(viewer_words *words)
{
    g_free(words->file);
    g_free(words->scene);
    g_free(words->screenshot);
    g_free(words->script);
}

/* Without a graphics card GTK's own drawing is faster on the processor, and the window is there
 * sooner when OpenGL is not even looked for. */
static void choose_drawing(void)
{
    if (g_getenv("GSK_RENDERER") || access("/dev/dri", F_OK) == 0 ||
        access("/dev/nvidia0", F_OK) == 0)
        return;
    const char *debug = g_getenv("GDK_DEBUG");
    char *words = g_strconcat(debug ? debug : "", debug ? "," : "", "gl-disable", NULL);
    g_setenv("GSK_RENDERER", "cairo", TRUE);
    g_setenv("GDK_DEBUG", words, TRUE);
    g_free(words);
}

static gboolean on_close(GtkWindow *window, viewer *v)
{
    (void)window;
    g_application_quit(G_APPLICATION(v->app));
    return TRUE;
}

/* Asked to end from outside: that is no crash. */
static gboolean on_stop(gpointer data)
{
    viewer *v = data;
    g_application_quit(G_APPLICATION(v->app));
    return G_SOURCE_CONTINUE;
}

static void on_activate(GtkApplication *app, viewer *v)
{
    (void)app;
    viewer_window_attach(v);
    viewer_input_attach(v);
    viewer_motion_attach(v);
    viewer_script_attach(v);
    viewer_keys_commands(v);
    viewer_figures_attach(v);
    viewer_files_attach(v);
    viewer_models_attach(v);
    viewer_save_attach(v);
    viewer_panels_attach(v);
    viewer_tools_attach(v);
    g_signal_connect(v->window, "close-request", G_CALLBACK(on_close), v);
    g_unix_signal_add(SIGTERM, on_stop, v);
    g_unix_signal_add(SIGINT, on_stop, v);
    viewer_window_retitle(v);
    if (v->words->file || v->words->scene) viewer_open(v, v->words->file, v->words->scene);
    gtk_window_present(v->window);
    gtk_widget_grab_focus(v->picture);
    viewer_session_offer(v);
    if (!viewer_script_begin(v)) {
        v->exit_status = FAILED;
        gtk_window_close(v->window);
    }
}

static void tear_down(viewer *v)
{
    viewer_core_end(v);
    if (!viewer_script_destroy(v)) v->exit_status = FAILED;
    viewer_save_end(v);
    viewer_session_destroy(v);
    viewer_status_destroy(v);
    viewer_figures_destroy(v);
    viewer_keys_destroy(v);
    viewer_window_destroy(v);
    viewer_motion_destroy(v);
    viewer_input_destroy(v);
    viewer_files_destroy(v);
    viewer_models_destroy(v);
}

int main(int argc, char **argv)
{
    viewer_words words = {0};
    viewer v = {.words = &words, .begun = g_get_monotonic_time()};
    setlocale(LC_ALL, "");
    setlocale(LC_NUMERIC, "C"); /* files and commands have points in their numbers */
    const int wrong = read_words(&argc, &argv, &words);
    if (wrong) {
        release_words(&words);
        return wrong;
    }
    choose_drawing();
    gtk_disable_setlocale();
    if (!gtk_init_check()) {
        fprintf(stderr, "tetralod-view: there is no display to open a window on; 'tetralod render' "
                        "makes pictures without one\n");
        release_words(&words);
        return FAILED;
    }
    v.app = gtk_application_new(NULL, G_APPLICATION_NON_UNIQUE);
    g_signal_connect(v.app, "activate", G_CALLBACK(on_activate), &v);
    v.exit_status = viewer_core_create(&v) ? DONE : FAILED;
    if (v.exit_status == DONE) {
        viewer_session_create(&v);
        viewer_files_create(&v);
        viewer_models_create(&v);
        g_application_run(G_APPLICATION(v.app), 0, NULL);
        tear_down(&v);
    }
    viewer_core_destroy(&v);
    g_object_unref(v.app);
    release_words(&words);
    return v.exit_status;
}
