/* Series: which step is read, and all steps of a file as a collection. */
#include "cli_session.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Longest path of a file of a series. */
#define PATH_BYTES 4096

bool cli_all_steps(const cli_session *session)
{
    const cli_value *step = cli_get(session, CLI_STEP);
    return step->given && strcmp(step->text, "all") == 0;
}

int cli_step_opts(const cli_session *session, tl_read_opts *opts)
{
    const cli_value *step = cli_get(session, CLI_STEP), *time = cli_get(session, CLI_TIME);
    const cli_verb *verb = session->args.verb;
    opts->has_time = time->given;
    opts->time = time->real;
    if (!step->given) return CLI_DONE;
    if (time->given) return cli_misuse(verb, "--step and --time both choose a step");
    if (strcmp(step->text, "all") == 0)
        return cli_misuse(verb, "--step all: convert alone writes a series, to a .pvd");
    size_t digits = strspn(step->text, "0123456789");
    if (strcmp(step->text, "last") == 0) {
        opts->step = TL_STEP_LAST;
    } else if (digits > 0 && digits < 19 && !step->text[digits]) {
        opts->step = strtoull(step->text, NULL, 10);
    } else {
        return cli_misuse(verb, "--step %s: expected a number from 0 on, last or all", step->text);
    }
    return CLI_DONE;
}

int cli_step_if_series(cli_session *session, const char *path)
{
    tl_steps steps;
    cli_value *step = &session->args.values[CLI_STEP], *time = &session->args.values[CLI_TIME];
    if (!step->given && !time->given) return CLI_DONE;
    tl_status st = tl_read_steps(session->ctx, path, NULL, &steps);
    if (st) return cli_fail(session, session->ctx, st);
    if (steps.count == 1) step->given = time->given = false;
    tl_steps_release(session->ctx, &steps);
    return CLI_DONE;
}

int cli_step_number(cli_session *session, const char *path, const tl_read_opts *opts,
                    int64_t *number)
{
    tl_steps steps;
    tl_status st = tl_read_steps(session->ctx, path, opts, &steps);
    if (st) return cli_fail(session, session->ctx, st);
    size_t chosen = opts->step == TL_STEP_LAST ? steps.count - 1 : (size_t)opts->step;
    double nearest = INFINITY;
    for (size_t i = 0; opts->has_time && i < steps.count; i++)
        if (fabs(steps.times[i] - opts->time) < nearest) {
            nearest = fabs(steps.times[i] - opts->time);
            chosen = i;
        }
    *number = steps.count > 1 ? (int64_t)chosen : -1;
    tl_steps_release(session->ctx, &steps);
    return CLI_DONE;
}

/* ---- all steps ---- */

/* What one conversion of a series needs. */
typedef struct series {
    cli_session *session;
    const char *from, *to;
    tl_read_opts opts;
    tl_steps steps;
    char (*paths)[PATH_BYTES]; /* [count] of the files, with their folder */
    const char **names;        /* [count] the same without */
    uint64_t bytes;
    double seconds;
} series;

/* flow.pvd: flow_007.vtu, with as many digits as the last step has. */
static tl_status name_files(series *s)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = s->session->ctx;
    size_t count = s->steps.count, base = strlen(s->to) - strlen(".pvd");
    const char *slash = strrchr(s->to, '/');
    size_t folder = slash ? (size_t)(slash - s->to) + 1 : 0;
    int digits = snprintf(NULL, 0, "%zu", count - 1);
    if (base + (size_t)digits + sizeof "_.vtu" > PATH_BYTES)
        return tl_fail(ctx, TL_ERR_ARG, "'%s': the name is too long", s->to);
    s->paths = tl_mem_alloc(ctx, count, sizeof *s->paths, &st);
    s->names = tl_mem_alloc(ctx, count, sizeof *s->names, &st);
    for (size_t i = 0; i < count && !st; i++) {
        snprintf(s->paths[i], PATH_BYTES, "%.*s_%0*zu.vtu", (int)base, s->to, digits, i);
        s->names[i] = s->paths[i] + folder;
    }
    return st;
}

static int convert_step(series *s, size_t step)
{
    cli_input input;
    uint64_t bytes = 0;
    double seconds = 0;
    s->opts.step = step;
    int exit_status = cli_open_with(s->session, s->session->ctx, s->from, &s->opts, &input);
    if (exit_status) return exit_status;
    exit_status = cli_check_volume(&input);
    if (exit_status) return exit_status;
    exit_status =
        cli_save(s->session, s->session->ctx, input.mesh, s->paths[step], &bytes, &seconds);
    if (!exit_status && step == 0 && cli_loud(s->session))
        cli_print_input(s->session, "read", &input);
    cli_drop_notes(s->session); /* of one step as of the next */
    s->bytes += bytes;
    s->seconds += seconds;
    cli_close(&input);
    return exit_status;
}

static void print_series(const series *s)
{
    size_t count = s->steps.count;
    if (cli_get(s->session, CLI_JSON)->given) {
        json_t *object = json_object();
        cli_json_text(object, "file", s->to);
        cli_json_count(object, "steps", count);
        json_t *list = cli_json_list(object, "files");
        for (size_t i = 0; i < count; i++) {
            json_t *item = cli_json_item(list);
            cli_json_text(item, "file", s->names[i]);
            cli_json_real(item, "time", s->steps.times[i]);
        }
        cli_json_count(object, "bytes", s->bytes);
        cli_json_real(object, "seconds", s->seconds);
        cli_json_facts(object, s->session->ctx);
        cli_json_print(object);
    } else if (cli_loud(s->session)) {
        printf("%-10s  %s: %s step%s, %s to %s (%s, %s)\n", "wrote", s->to, cli_count(count).s,
               count == 1 ? "" : "s", s->names[0], s->names[count - 1],
               cli_bytes((double)s->bytes).s, cli_seconds(s->seconds).s);
    }
}

int cli_convert_series(cli_session *session, const char *from, const char *to)
{
    series s = {.session = session, .from = from, .to = to};
    const cli_verb *verb = session->args.verb;
    const char *dot = strrchr(to, '.');
    if (!dot || strcasecmp(dot, ".pvd") != 0)
        return cli_misuse(verb, "--step all: '%s' must end in .pvd", to);
    if (cli_get(session, CLI_TIME)->given)
        return cli_misuse(verb, "--step and --time both choose a step");
    cli_value *step = &session->args.values[CLI_STEP];
    step->given = false; /* from here on it is chosen one by one */
    int exit_status = cli_read_opts(session, from, &s.opts);
    if (exit_status) return exit_status;
    tl_status st = tl_read_steps(session->ctx, from, &s.opts, &s.steps);
    if (!st) st = name_files(&s);
    for (size_t i = 0; i < s.steps.count && !st && !exit_status; i++)
        exit_status = convert_step(&s, i);
    if (!st && !exit_status)
        st = tl_series_write(session->ctx, to, s.names, s.steps.times, s.steps.count);
    if (!st && !exit_status) print_series(&s);
    if (st) exit_status = cli_fail(session, session->ctx, st);
    tl_mem_free(session->ctx, s.names);
    tl_mem_free(session->ctx, s.paths);
    tl_steps_release(session->ctx, &s.steps);
    return exit_status;
}
