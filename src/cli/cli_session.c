/* Runs a verb: context, hooks, messages, exit status. */
#include "cli_session.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

cli_text cli_version(void)
{
    cli_text text;
    int version = tl_version();
    snprintf(text.s, sizeof text.s, "%d.%d.%d", version / 10000, version / 100 % 100,
             version % 100);
    return text;
}

/* ---- hooks ---- */

static bool on_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    return cli_progress_step(&((cli_session *)user)->progress, stage, done, total);
}

static void keep_note(cli_session *session, const char *text)
{
    size_t left = sizeof session->notes - session->notes_bytes;
    int n = snprintf(session->notes + session->notes_bytes, left, "%s\n", text);
    if (n > 0 && (size_t)n < left)
        session->notes_bytes += (size_t)n;
    else
        session->notes[session->notes_bytes] = '\0'; /* full: the rest is left out */
}

/* Whether a warning comes for the first time; beyond what there is room for all of them do. */
static bool is_new(cli_session *session, const char *text)
{
    const size_t length = strlen(text), used = strlen(session->warnings);
    for (const char *at = session->warnings; *at; at += strcspn(at, "\n") + 1)
        if (strncmp(at, text, length) == 0 && at[length] == '\n') return false;
    if (length + 2 <= sizeof session->warnings - used)
        snprintf(session->warnings + used, length + 2, "%s\n", text);
    return true;
}

static void on_log(void *user, tl_log_level level, const char *text)
{
    cli_session *session = user;
    if (level == TL_LOG_DEBUG || (level == TL_LOG_INFO && cli_get(session, CLI_QUIET)->given))
        return;
    if (level == TL_LOG_INFO && cli_loud(session)) {
        keep_note(session, text);
        return;
    }
    if (!is_new(session, text)) return;
    cli_progress_clear(&session->progress);
    fprintf(stderr, "tetralod: %s%s\n", level == TL_LOG_INFO ? "note: " : "warning: ", text);
}

void cli_drop_notes(cli_session *session)
{
    session->notes_bytes = session->notes_shown = 0;
    session->notes[0] = '\0';
}

void cli_print_notes_between(cli_session *session, size_t begin, size_t end)
{
    while (begin < end) {
        size_t length = strcspn(session->notes + begin, "\n");
        printf("            %.*s\n", (int)length, session->notes + begin);
        begin += length + 1;
    }
    session->notes_shown = end;
}

void cli_print_notes(cli_session *session)
{
    cli_print_notes_between(session, session->notes_shown, session->notes_bytes);
}

tl_status cli_context_create(cli_session *session, unsigned thread_count, tl_ctx **ctx)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.budget_bytes = (size_t)cli_get(session, CLI_MEMORY)->count;
    opts.thread_count = thread_count;
    opts.progress = on_progress;
    opts.log = on_log;
    opts.user = session;
    return tl_ctx_create(&opts, ctx);
}

const char *cli_work_folder(const cli_session *session)
{
    const char *folder = getenv("TMPDIR");
    if (cli_get(session, CLI_TMP)->given) return cli_get(session, CLI_TMP)->text;
    return folder && *folder ? folder : NULL;
}

int cli_fail(cli_session *session, tl_ctx *ctx, tl_status status)
{
    const char *line = ctx ? tl_ctx_message(ctx) : "";
    cli_progress_clear(&session->progress);
    if (session->notes_bytes) fputs(session->notes, stderr);
    session->notes_bytes = 0;
    if (status == TL_ERR_CANCELLED) {
        if (session->written_count)
            fprintf(stderr, "tetralod: stopped on request; written, and complete: %s\n",
                    cli_count(session->written_count).s);
        else
            fprintf(stderr, "tetralod: stopped on request; nothing was written\n");
        return CLI_FAILED;
    }
    if (!*line) line = tl_status_name(status);
    for (const char *prefix = "tetralod: "; *line; prefix = "  ") {
        size_t length = strcspn(line, "\n");
        fprintf(stderr, "%s%.*s\n", prefix, (int)length, line);
        line += length + (line[length] == '\n');
    }
    if (status == TL_ERR_BUDGET && cli_get(session, CLI_MEMORY)->given)
        fputs("  --memory sets the limit\n", stderr);
    return status == TL_ERR_ARG ? CLI_WRONG_USE : CLI_FAILED;
}

/* What was printed must have arrived: a full disk is a failure. */
static int finish_stdout(int exit_status)
{
    int failed = ferror(stdout) | fflush(stdout);
    if (!failed) return exit_status;
    fprintf(stderr, "tetralod: can't write to standard output: %s\n", strerror(errno));
    return exit_status ? exit_status : CLI_FAILED;
}

int cli_session_run(const cli_verb *verb, int argc, char **argv)
{
    cli_session session = {0};
    int exit_status = cli_parse(verb, argc, argv, &session.args);
    if (!exit_status && cli_get(&session, CLI_HELP)->given) {
        cli_help_verb(stdout, verb);
    } else if (!exit_status) {
        session.progress.shown = !cli_get(&session, CLI_QUIET)->given && isatty(STDERR_FILENO);
        cli_interrupt_install();
        unsigned thread_count = (unsigned)cli_get(&session, CLI_THREADS)->count;
        tl_status st = cli_context_create(&session, thread_count, &session.ctx);
        exit_status = st ? cli_fail(&session, NULL, st) : cli_roles_check(&session.args);
        if (!exit_status) exit_status = verb->run(&session);
        cli_progress_clear(&session.progress);
        tl_ctx_destroy(session.ctx);
    }
    return finish_stdout(exit_status);
}
