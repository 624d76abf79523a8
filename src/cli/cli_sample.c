/* tetralod sample: synthetic data with known formulas. */
#include <string.h>
#include <strings.h>

#include "cli_session.h"

static const cli_option OPTIONS[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "OUT", NULL, 0, 0,
     "the .vtu file to write; required"},
    {CLI_SIZE, 0, "size", CLI_TYPE_COUNT, "N", "0", 0, 4294967295.0,
     "vertices along each side of a grid, or the nearest equal of another sample; 0 takes the "
     "sample's own"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

static bool known_sample(const char *name)
{
    for (size_t i = 0; tl_sample_name(i); i++)
        if (strcmp(tl_sample_name(i), name) == 0) return true;
    return false;
}

static int unknown_sample(const cli_verb *verb, const char *name)
{
    const char *words[32];
    size_t count = 0;
    for (; count < 32 && tl_sample_name(count); count++) words[count] = tl_sample_name(count);
    const char *near = cli_nearest(name, words, count);
    if (near) return cli_misuse(verb, "there is no sample '%s'; did you mean '%s'?", name, near);
    return cli_misuse(verb, "there is no sample '%s'", name);
}

static int run(cli_session *session)
{
    const char *name = session->args.operands[0];
    const char *path = cli_get(session, CLI_OUTPUT)->text;
    uint32_t size = (uint32_t)cli_get(session, CLI_SIZE)->count;
    if (!known_sample(name)) return unknown_sample(session->args.verb, name);
    if (!path) return cli_misuse(session->args.verb, "-o OUT is missing");
    const char *dot = strrchr(path, '.');
    if (!dot || strcasecmp(dot, ".vtu") != 0)
        return cli_misuse(session->args.verb, "'%s': samples are written as .vtu", path);
    int exit_status = cli_output_check(session, path);
    if (exit_status) return exit_status;
    double start = cli_now();
    tl_status st = tl_sample_write(session->ctx, name, size, path);
    double seconds = cli_now() - start;
    cli_progress_clear(&session->progress);
    if (st) return cli_fail(session, session->ctx, st);
    uint64_t bytes = cli_file_bytes(path);
    if (cli_get(session, CLI_JSON)->given) {
        json_t *object = json_object();
        cli_json_text(object, "sample", name);
        cli_json_text(object, "file", path);
        cli_json_count(object, "bytes", bytes);
        cli_json_real(object, "seconds", seconds);
        cli_json_facts(object, session->ctx);
        cli_json_print(object);
    } else if (cli_loud(session)) {
        printf("%-10s  %s: %s (%s, %s)\n", "wrote", path, tl_sample_about(name),
               cli_bytes((double)bytes).s, cli_seconds(seconds).s);
        cli_print_notes(session);
    }
    return CLI_DONE;
}

static const char *const EXAMPLES[] = {
    "tetralod sample sphere-flow -o flow.vtu", "The flow past a sphere, in a graded mesh",
    "tetralod sample gaussians -o g.vtu --size 64", "1.25 million tets with a smooth field", NULL};

const cli_verb cli_verb_sample = {
    .name = "sample",
    .operands = "NAME -o OUT",
    .operand_least = 1,
    .operand_most = 1,
    .about = "write a synthetic data set with a known formula",
    .details = "The file is streamed: memory does not grow with the size. NAME is one of",
    .groups = {&GROUP, &cli_group_common},
    .examples = EXAMPLES,
    .run = run,
    .word = tl_sample_name,
    .word_about = tl_sample_about};
