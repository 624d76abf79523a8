/* Scripts: one command a line, of scenes (scene.h) or of the viewer's parts, for tests and
 * demonstrations. A line begins when the one before is done: open when the file is open, picture
 * when it is written. What scenes do is done at once, many lines in a turn of the loop; other lines
 * have a turn each, in which the parts hear of the changes before. The first error ends the script
 * and the program. */
#include "viewer_core.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BEAT_MS 8
#define BEAT_LINES_S 0.008 /* lines of scenes in one turn */
#define SETTLE_SECONDS 300
#define PAINT_SECONDS 10 /* after a change of its size a window is laid out anew */
#define DRAG_STEPS 12
#define SCRIPT_BYTES_MOST (16 << 20)
#define SECONDS_MOST 3600

typedef enum wait_kind {
    WAIT_NONE = 0,
    WAIT_SETTLED,
    WAIT_TIME,
    WAIT_FILE, /* until another program has made a file */
    WAIT_TURN,
    WAIT_DRAG,
    WAIT_PAINTED
} wait_kind;

struct viewer_script {
    GPtrArray *commands; /* const viewer_command * */
    char *path, **lines; /* NULL: none runs */
    guint line;
    wait_kind wait;
    char *file; /* of WAIT_FILE */
    gint64 wait_begin, wait_end, beat;
    double turn[2], turned; /* degrees; part that is done */
    double drag[4];         /* from, to */
    int drag_step;
    viewer_pointer pointer;
    char *screenshot;       /* that is to be saved */
    double longest_stall_s; /* of the window's loop */
    double first_frame_s;
    guint timer;
    bool has_failed, is_ended;
};

/* ---- figures ---- */

static void print_stats(viewer *v)
{
    const tl_live_stats stats = tl_live_get_stats(v->live);
    const viewer_paint_stats paints = viewer_picture_stats(v);
    printf("frames        %" G_GUINT64_FORMAT ", %" G_GUINT64_FORMAT " of them while moving\n",
           stats.frames, stats.moving_frames);
    printf("longest frame %.1f ms, longest wait %.1f ms (while moving)\n",
           1e3 * stats.longest_frame_s, 1e3 * stats.longest_wait_s);
    printf("window        painted %" G_GUINT64_FORMAT
           " times, %.1f ms of processor each, %.1f ms at most; stalled "
           "for %.1f ms at most\n",
           paints.count, paints.count ? 1e3 * paints.cpu_s / (double)paints.count : 0,
           1e3 * paints.longest_s, 1e3 * v->script->longest_stall_s);
    printf("first picture %.3f s after the start\n", v->script->first_frame_s);
    printf("memory        %.1f MB, at most %.1f of %.1f MB; card %.1f MB\n",
           (double)stats.ram_bytes / 1e6, (double)stats.ram_peak_bytes / 1e6,
           (double)stats.ram_limit_bytes / 1e6, (double)stats.card_bytes / 1e6);
    printf("read          %.1f MB\n", (double)stats.bytes_read / 1e6);
    if (v->frame && v->frame->facts) {
        const tl_content_facts *facts = v->frame->facts;
        printf("drawn         %" G_GUINT64_FORMAT " tets, %" G_GUINT64_FORMAT
               " patches, error %.3g px, %s, by %s\n",
               facts->tets, facts->patches, v->frame->error_px,
               v->frame->is_final ? "complete" : "not complete", v->frame->renderer);
    }
    fflush(stdout);
}

/* ---- errors ---- */

static void fail(viewer *v, const char *text)
{
    struct viewer_script *s = v->script;
    if (s->path)
        fprintf(stderr, "%s:%u: %s\n", s->path, s->line, text);
    else
        fprintf(stderr, "tetralod-view: %s\n", text);
    s->has_failed = true;
}

void viewer_script_said(viewer *v, viewer_tone tone, const char *text)
{
    const bool is_watched = v->words->script || v->words->screenshot; /* also before they begin */
    if (!v->script || (!v->script->timer && !is_watched)) return;
    if (tone == VIEWER_ERROR)
        fail(v, text);
    else
        fprintf(stderr, "tetralod-view: note: %s\n", text);
}

/* ---- commands ---- */

static bool run_wait(viewer *v, const char *arguments)
{
    struct viewer_script *s = v->script;
    char *end;
    const double seconds = g_ascii_strtod(arguments, &end);
    s->wait_begin = g_get_monotonic_time();
    if (!*arguments || strcmp(arguments, "settled") == 0) {
        s->wait = WAIT_SETTLED;
        s->wait_end = s->wait_begin + SETTLE_SECONDS * G_USEC_PER_SEC;
        return true;
    }
    if (g_str_has_prefix(arguments, "for ")) {
        g_free(s->file);
        s->file = g_strdup(arguments + 4);
        s->wait = WAIT_FILE;
        s->wait_end = s->wait_begin + SETTLE_SECONDS * G_USEC_PER_SEC;
        return true;
    }
    if (end == arguments || *end || !(seconds >= 0) || seconds > SECONDS_MOST) {
        fail(v, "wait: expected 'settled', seconds, or 'for' and a file");
        return false;
    }
    s->wait = WAIT_TIME;
    s->wait_end = s->wait_begin + (gint64)(seconds * G_USEC_PER_SEC);
    return true;
}

static void begin_screenshot(viewer *v, const char *path)
{
    struct viewer_script *s = v->script;
    g_free(s->screenshot);
    s->screenshot = g_strdup(path);
    s->wait = WAIT_PAINTED;
    s->wait_begin = g_get_monotonic_time();
    s->wait_end = s->wait_begin + PAINT_SECONDS * G_USEC_PER_SEC;
}

static bool run_screenshot(viewer *v, const char *arguments)
{
    begin_screenshot(v, arguments);
    return true;
}

static bool run_size(viewer *v, const char *arguments)
{
    int width, height;
    if (!viewer_read_size(arguments, &width, &height)) {
        fail(v, "size: expected WIDTHxHEIGHT");
        return false;
    }
    gtk_window_set_default_size(v->window, width, height);
    return true;
}

static bool run_key(viewer *v, const char *arguments)
{
    if (viewer_keys_run(v, arguments)) return true;
    fail(v, "key: no action has this key or name");
    return false;
}

/* Reads numbers with blanks or commas between; how many there are, -1: another thing. */
static int read_numbers(const char *text, double *numbers, int most)
{
    int count = 0;
    char *end;
    for (;; text = end) {
        text += strspn(text, " ,\t");
        if (!*text) return count;
        const double number = g_ascii_strtod(text, &end);
        if (end == text || count == most || !isfinite(number)) return -1;
        numbers[count++] = number;
    }
}

/* A button of the pointer, or how often it is pressed. */
static bool is_button(double number)
{
    return number == 1 || number == 2 || number == 3;
}

static bool run_click(viewer *v, const char *arguments)
{
    double numbers[4] = {0, 0, 1, 1};
    if (read_numbers(arguments, numbers, 4) < 2 || !is_button(numbers[2]) ||
        !is_button(numbers[3])) {
        fail(v, "click: expected X Y [BUTTON [PRESSES]]");
        return false;
    }
    viewer_pointer p = {.x = numbers[0], .y = numbers[1], .button = (unsigned)numbers[2]};
    for (p.presses = 1; p.presses <= (int)numbers[3]; p.presses++) {
        viewer_input_press(v, &p);
        viewer_input_release(v, &p);
    }
    return true;
}

static bool run_drag(viewer *v, const char *arguments)
{
    struct viewer_script *s = v->script;
    double numbers[5] = {0, 0, 0, 0, 1};
    if (read_numbers(arguments, numbers, 5) < 4 || !is_button(numbers[4])) {
        fail(v, "drag: expected X0 Y0 X1 Y1 [BUTTON]");
        return false;
    }
    memcpy(s->drag, numbers, sizeof s->drag);
    s->pointer = (viewer_pointer){
        .x = numbers[0], .y = numbers[1], .button = (unsigned)numbers[4], .presses = 1};
    viewer_input_press(v, &s->pointer);
    s->drag_step = 0;
    s->wait = WAIT_DRAG;
    return true;
}

static bool run_scroll(viewer *v, const char *arguments)
{
    double numbers[3];
    if (read_numbers(arguments, numbers, 3) != 3) {
        fail(v, "scroll: expected X Y STEPS");
        return false;
    }
    viewer_input_scroll(v, numbers[0], numbers[1], numbers[2]);
    return true;
}

static bool run_turn(viewer *v, const char *arguments)
{
    struct viewer_script *s = v->script;
    double numbers[3];
    if (read_numbers(arguments, numbers, 3) != 3 || !(numbers[2] > 0) ||
        numbers[2] > SECONDS_MOST) {
        fail(v, "turn: expected RIGHT UP SECONDS, degrees");
        return false;
    }
    memcpy(s->turn, numbers, sizeof s->turn);
    s->turned = 0;
    s->wait_begin = g_get_monotonic_time();
    s->wait_end = s->wait_begin + (gint64)(numbers[2] * G_USEC_PER_SEC);
    s->wait = WAIT_TURN;
    viewer_begin_gesture(v);
    return true;
}

static bool run_print(viewer *v, const char *arguments)
{
    if (strcmp(arguments, "stats") == 0)
        print_stats(v);
    else
        printf("%s\n", arguments);
    fflush(stdout);
    return true;
}

static bool run_reset(viewer *v, const char *arguments)
{
    (void)arguments;
    tl_live_reset_stats(v->live);
    viewer_picture_reset_stats(v);
    v->script->longest_stall_s = 0;
    return true;
}

static bool run_quit(viewer *v, const char *arguments)
{
    (void)arguments;
    v->script->is_ended = true;
    gtk_window_close(v->window);
    return true;
}

static const viewer_command COMMANDS[] = {
    {"wait", "wait [settled|SECONDS|for FILE]", run_wait},
    {"screenshot", "screenshot FILE.png", run_screenshot},
    {"size", "size WIDTHxHEIGHT", run_size},
    {"key", "key KEY|ACTION", run_key},
    {"click", "click X Y [BUTTON [PRESSES]]", run_click},
    {"drag", "drag X0 Y0 X1 Y1 [BUTTON]", run_drag},
    {"scroll", "scroll X Y STEPS", run_scroll},
    {"turn", "turn RIGHT UP SECONDS", run_turn},
    {"print", "print stats|TEXT", run_print},
    {"reset", "reset", run_reset},
    {"quit", "quit", run_quit},
};

void viewer_add_commands(viewer *v, const viewer_command *commands, size_t command_count)
{
    for (size_t i = 0; i < command_count; i++)
        g_ptr_array_add(v->script->commands, (void *)(uintptr_t)&commands[i]);
}

/* ---- running ---- */

static const viewer_command *find_command(const viewer *v, const char *name)
{
    const GPtrArray *commands = v->script->commands;
    for (guint i = 0; i < commands->len; i++) {
        const viewer_command *command = g_ptr_array_index(commands, i);
        if (strcmp(command->name, name) == 0) return command;
    }
    return NULL;
}

/* True: more lines may follow in the same turn. */
static bool run_line(viewer *v, const char *text)
{
    bool goes_on = true;
    char *line = g_strstrip(g_strdup(text));
    if (*line && *line != '#') {
        char **parts = g_strsplit_set(line, " \t", 2);
        const viewer_command *command = find_command(v, parts[0]);
        goes_on = !command;
        if (!command)
            viewer_do(v, "%s", line);
        else if (!command->run(v, parts[1] ? g_strstrip(parts[1]) : "") && !v->script->has_failed)
            fail(v, command->usage);
        g_strfreev(parts);
    }
    g_free(line);
    return goes_on && !v->script->has_failed;
}

static void run_lines(viewer *v)
{
    struct viewer_script *s = v->script;
    const gint64 end = g_get_monotonic_time() + (gint64)(BEAT_LINES_S * G_USEC_PER_SEC);
    while (run_line(v, s->lines[s->line++]) && s->lines[s->line] && g_get_monotonic_time() < end) {
    }
}

static void go_on_turning(viewer *v, double part)
{
    struct viewer_script *s = v->script;
    tl_camera camera = viewer_camera(v);
    const double by = part - s->turned;
    tl_camera_orbit(&camera, NULL, by * s->turn[0], by * s->turn[1], TL_ORBIT_TURNTABLE, NULL);
    viewer_set_camera(v, &camera);
    s->turned = part;
    if (part < 1) return;
    viewer_end_gesture(v);
    s->wait = WAIT_NONE;
}

static void go_on_dragging(viewer *v)
{
    struct viewer_script *s = v->script;
    const double part = (double)++s->drag_step / DRAG_STEPS;
    s->pointer.x = s->drag[0] + part * (s->drag[2] - s->drag[0]);
    s->pointer.y = s->drag[1] + part * (s->drag[3] - s->drag[1]);
    viewer_input_drag(v, &s->pointer);
    if (s->drag_step < DRAG_STEPS) return;
    viewer_input_release(v, &s->pointer);
    s->wait = WAIT_NONE;
}

static void try_screenshot(viewer *v, gint64 now)
{
    struct viewer_script *s = v->script;
    GdkTexture *texture = viewer_window_texture(v);
    if (!texture && now < s->wait_end) return;
    if (!texture || !gdk_texture_save_to_png(texture, s->screenshot)) {
        char *text = g_strdup_printf("'%s' can't be written", s->screenshot);
        fail(v, text);
        g_free(text);
    }
    g_clear_object(&texture);
    s->wait = WAIT_NONE;
}

/* True while a line is not done. */
static bool is_waiting(viewer *v, gint64 now)
{
    struct viewer_script *s = v->script;
    const gint64 length = s->wait_end - s->wait_begin;
    if (!viewer_files_idle(v) || !viewer_save_idle(v)) return true;
    switch (s->wait) {
    case WAIT_NONE: break;
    case WAIT_TIME:
        if (now >= s->wait_end) s->wait = WAIT_NONE;
        break;
    case WAIT_FILE:
        if (g_file_test(s->file, G_FILE_TEST_EXISTS))
            s->wait = WAIT_NONE;
        else if (now > s->wait_end)
            fail(v, "the file that is waited for does not come");
        break;
    case WAIT_SETTLED:
        if (viewer_settled(v))
            s->wait = WAIT_NONE;
        else if (now > s->wait_end)
            fail(v, "the picture does not settle");
        break;
    case WAIT_TURN:
        go_on_turning(v, MIN(1, (double)(now - s->wait_begin) / (double)MAX(length, 1)));
        break;
    case WAIT_DRAG: go_on_dragging(v); break;
    case WAIT_PAINTED: try_screenshot(v, now); break;
    }
    return s->wait != WAIT_NONE;
}

static void end_program(viewer *v)
{
    v->script->is_ended = true;
    gtk_window_close(v->window);
}

/* Behind the last line: the picture that the command line asks for. */
static void finish(viewer *v)
{
    struct viewer_script *s = v->script;
    if (!v->words->screenshot || !viewer_settled(v)) return;
    if (g_strcmp0(s->screenshot, v->words->screenshot) == 0)
        end_program(v);
    else
        begin_screenshot(v, v->words->screenshot);
}

static gboolean on_beat(gpointer data)
{
    viewer *v = data;
    struct viewer_script *s = v->script;
    const gint64 now = g_get_monotonic_time();
    if (s->beat)
        s->longest_stall_s = MAX(s->longest_stall_s, (double)(now - s->beat) / 1e6 - BEAT_MS / 1e3);
    s->beat = now;
    if (!is_waiting(v, now)) {
        if (s->lines && s->lines[s->line])
            run_lines(v);
        else
            finish(v);
    }
    if (s->has_failed && !s->is_ended) end_program(v);
    if (s->is_ended) s->timer = 0;
    return s->is_ended ? G_SOURCE_REMOVE : G_SOURCE_CONTINUE;
}

/* ---- the part ---- */

static void on_frame(viewer *v, void *user)
{
    struct viewer_script *s = v->script;
    (void)user;
    if (s->first_frame_s == 0 && v->frame->content)
        s->first_frame_s = (double)(g_get_monotonic_time() - v->begun) / 1e6;
}

void viewer_script_attach(viewer *v)
{
    struct viewer_script *s = g_new0(struct viewer_script, 1);
    v->script = s;
    s->commands = g_ptr_array_new();
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
    viewer_listen(v, VIEWER_FRAME, on_frame, NULL);
}

/* All of a file, which may be a pipe, to be freed; NULL, said on stderr: there is none, or no end.
 */
static char *read_script(const char *path)
{
    gsize bytes = 0;
    GError *error = NULL;
    GFile *file = g_file_new_for_path(strcmp(path, "-") == 0 ? "/dev/stdin" : path);
    GFileInputStream *stream = g_file_read(file, NULL, &error);
    char *text = g_malloc(SCRIPT_BYTES_MOST + 1);
    if (stream)
        g_input_stream_read_all(G_INPUT_STREAM(stream), text, SCRIPT_BYTES_MOST, &bytes, NULL,
                                &error);
    text[bytes] = '\0';
    const bool is_text = bytes < SCRIPT_BYTES_MOST && g_utf8_validate(text, (gssize)bytes, NULL);
    if (error || !is_text) g_clear_pointer(&text, g_free);
    if (error)
        fprintf(stderr, "tetralod: '%s': %s\n", path, error->message);
    else if (!is_text)
        fprintf(stderr, "tetralod: '%s': expected a script, lines of UTF-8, less than %d bytes\n",
                path, SCRIPT_BYTES_MOST);
    g_clear_error(&error);
    g_clear_object(&stream);
    g_object_unref(file);
    return text;
}

bool viewer_script_begin(viewer *v)
{
    struct viewer_script *s = v->script;
    if (v->words->script) {
        char *text = read_script(v->words->script);
        if (!text) return false;
        s->path = g_strdup(v->words->script);
        s->lines = g_strsplit(text, "\n", -1);
        g_free(text);
    }
    if (v->words->script || v->words->screenshot) s->timer = g_timeout_add(BEAT_MS, on_beat, v);
    return true;
}

bool viewer_script_destroy(viewer *v)
{
    struct viewer_script *s = v->script;
    const bool has_failed = s->has_failed;
    if (v->words->stats) print_stats(v);
    if (s->timer) g_source_remove(s->timer);
    g_strfreev(s->lines);
    g_free(s->file);
    g_free(s->path);
    g_free(s->screenshot);
    g_ptr_array_free(s->commands, TRUE);
    g_free(s);
    v->script = NULL;
    return !has_failed;
}
