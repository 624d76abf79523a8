/* tetralod view: starts the viewer, a program of its own that lies beside this one, so that
 * machines without a screen need no GTK. */
#include <errno.h>
#include <string.h>
#include <unistd.h>

#include "cli_session.h"

#define PROGRAM "tetralod-view"
enum { WORDS_MAX = 20, NUMBER_BYTES = 32 };

static const cli_option VIEW[] = {
    {CLI_SCENE, 0, "scene", CLI_TYPE_INPUT, "S.json", NULL, 0, 0,
     "what is shown and how, as the viewer saves it; 'render --scene' draws it, too. It names its "
     "data set, so that FILE may be left out. Without it a first look"},
    {CLI_PICTURE_SIZE, 0, "size", CLI_TYPE_TEXT, "WxH", NULL, 0, 0,
     "of the window, pixels; without it as it was last"},
    {CLI_RENDERER, 0, "renderer", CLI_TYPE_CHOICE, "auto|gl|cpu", "auto", 0, 0,
     "what draws: OpenGL where there is a GPU, or the processor"},
};
static const cli_option SCRIPTS[] = {
    {CLI_SCREENSHOT, 0, "screenshot", CLI_TYPE_OUTPUT, "OUT.png", NULL, 0, 0,
     "save the window when its picture is all that was asked for, and end"},
    {CLI_SCRIPT, 0, "script", CLI_TYPE_INPUT, "FILE", NULL, 0, 0,
     "carry out commands, one a line: those of scenes, and open, wait, screenshot, picture, "
     "frames, "
     "size, key, click, drag, turn, print, quit; - reads them from standard input"},
    {CLI_STATS, 0, "stats", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "print at the end how long frames took, what was read and what memory was used"},
    {CLI_THROTTLE, 0, "throttle", CLI_TYPE_BYTES, "SIZE", "0", 0, 0,
     "read models no faster than so many bytes a second, to see what a slow disk does"},
};
static const cli_option LIMITS[] = {
    {CLI_THREADS, 0, "threads", CLI_TYPE_COUNT, "N", "0", 0, TL_THREADS_MAX,
     "threads to use; 0 takes one a processor"},
    {CLI_MEMORY, 0, "memory", CLI_TYPE_BYTES, "SIZE", "0", 0, 0,
     "limit of memory of data and pictures, where the scene has none; 0: half of the machine's"},
    {CLI_HELP, 'h', "help", CLI_TYPE_FLAG, NULL, NULL, 0, 0, "print this help"},
};
static const cli_group VIEW_GROUP = {"View", VIEW, sizeof VIEW / sizeof *VIEW};
static const cli_group SCRIPTS_GROUP = {"Scripts", SCRIPTS, sizeof SCRIPTS / sizeof *SCRIPTS};
static const cli_group LIMITS_GROUP = {"Limits", LIMITS, sizeof LIMITS / sizeof *LIMITS};

/* The words that the viewer gets. */
typedef struct words {
    char *list[WORDS_MAX + 1];
    size_t count;
    char numbers[3][NUMBER_BYTES];
    size_t number_count;
} words;

static void add(words *w, const char *option, const char *text)
{
    w->list[w->count++] = (char *)(uintptr_t)option;
    w->list[w->count++] = (char *)(uintptr_t)text;
}

static void add_text(words *w, const cli_session *session, cli_id id, const char *option)
{
    if (cli_get(session, id)->given) add(w, option, cli_get(session, id)->text);
}

static void add_count(words *w, const cli_session *session, cli_id id, const char *option)
{
    if (!cli_get(session, id)->given) return;
    char *number = w->numbers[w->number_count++];
    snprintf(number, NUMBER_BYTES, "%llu", (unsigned long long)cli_get(session, id)->count);
    add(w, option, number);
}

static void fill(const cli_session *session, char *program, words *w)
{
    w->list[w->count++] = program;
    add_text(w, session, CLI_SCENE, "--scene");
    add_text(w, session, CLI_PICTURE_SIZE, "--size");
    static const char *const RENDERERS[] = {"auto", "gl", "cpu"};
    if (cli_get(session, CLI_RENDERER)->given)
        add(w, "--renderer", RENDERERS[cli_get(session, CLI_RENDERER)->choice]);
    add_text(w, session, CLI_SCREENSHOT, "--screenshot");
    add_text(w, session, CLI_SCRIPT, "--script");
    add_count(w, session, CLI_THROTTLE, "--throttle");
    add_count(w, session, CLI_THREADS, "--threads");
    add_count(w, session, CLI_MEMORY, "--memory");
    if (cli_get(session, CLI_STATS)->given) w->list[w->count++] = (char *)(uintptr_t) "--stats";
    if (session->args.operand_count) add(w, "--", session->args.operands[0]);
}

static int run(cli_session *session)
{
    char program[4096];
    words w = {0};
    const ssize_t n = readlink("/proc/self/exe", program, sizeof program - sizeof PROGRAM);
    program[n > 0 ? n : 0] = '\0';
    char *slash = strrchr(program, '/');
    strcpy(slash ? slash + 1 : program, PROGRAM);
    if (access(program, X_OK) != 0) {
        fprintf(stderr,
                "tetralod: there is no '%s': this build has no viewer, which needs the "
                "Debian package libgtk-4-dev\n"
                "  'tetralod render' makes pictures without a window\n",
                program);
        return CLI_FAILED;
    }
    fill(session, program, &w);
    fflush(stdout);
    execv(program, w.list);
    fprintf(stderr, "tetralod: '%s' can't be started: %s\n", program, strerror(errno));
    return CLI_FAILED;
}

static const char *const EXAMPLES[] = {
    "tetralod view flow.tlod",
    "Opens a window: all of the model at once, coarse, and finer while it is turned",
    "tetralod view part.vtu",
    "Any file that 'tetralod formats' lists; of a large one a model can be built from there",
    "tetralod view flow.json",
    "A scene that was saved before: data set, things, colours, camera",
    "tetralod view flow.tlod --screenshot window.png --size 1280x860",
    "A picture of the window, when all that it shows is there",
    "tetralod view flow.tlod --script tour.txt --stats",
    "A demonstration or a test, and what it cost",
    NULL};

const cli_verb cli_verb_view = {
    .name = "view",
    .operands = "[FILE]",
    .operand_least = 0,
    .operand_most = 1,
    .about = "the viewer: a window on a model of any size",
    .details =
        "FILE is a model, or any file that 'tetralod formats' lists. A model is seen at once, "
        "whatever its size: coarse while it is turned, then as fine as was asked for; nothing "
        "waits for the file. F1 in the window shows keys and gestures; what is on the screen, "
        "its error, tets, memory and time stand below the picture.",
    .groups = {&VIEW_GROUP, &SCRIPTS_GROUP, &LIMITS_GROUP},
    .examples = EXAMPLES,
    .run = run};
