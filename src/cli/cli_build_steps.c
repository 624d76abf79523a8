/* Which steps of a series a model is made of, and which of them say what is simplified. */
#include <stdlib.h>
#include <string.h>

#include "cli_model.h"

/* A number of a list of steps; text moves behind it. */
static bool take_number(const char **text, uint64_t *number)
{
    size_t digits = strspn(*text, "0123456789");
    if (!digits || digits > 18) return false;
    *number = strtoull(*text, NULL, 10);
    *text += digits;
    return true;
}

/* "all", "last", or numbers N and ranges FIRST:LAST[:STRIDE] with commas between them: marks chosen
 * [count]. */
static int choose(const cli_session *session, const char *option, const char *text, bool *chosen,
                  size_t count)
{
    const char *at = text;
    bool all = strcmp(text, "all") == 0, last = strcmp(text, "last") == 0;
    for (size_t i = 0; i < count; i++) chosen[i] = all || (last && i + 1 == count);
    while (!all && !last) {
        uint64_t first, end, stride = 1;
        bool is_list = take_number(&at, &first);
        end = first;
        if (is_list && *at == ':') is_list = (at++, take_number(&at, &end));
        if (is_list && *at == ':') is_list = (at++, take_number(&at, &stride));
        if (!is_list || !stride || end < first || (*at && *at != ','))
            return cli_misuse(session->args.verb,
                              "--%s %s: expected all, last, or numbers and ranges FIRST:LAST[:STEP]"
                              " with commas",
                              option, text);
        if (end >= count)
            return cli_misuse(session->args.verb, "--%s %s: there %s %zu, from 0 on", option, text,
                              count == 1 ? "is" : "are", count);
        for (uint64_t i = first; i <= end; i += stride) chosen[i] = true;
        if (!*at) break;
        at++;
    }
    return CLI_DONE;
}

/* Every step that there is: those of one file, or a step a file. */
static tl_status list_steps(cli_session *session, const tl_read_opts *read, cli_steps *s)
{
    const cli_args *args = &session->args;
    tl_steps steps = {0};
    tl_status st = TL_OK;
    if (args->operand_count == 1) st = tl_read_steps(session->ctx, args->operands[0], read, &steps);
    s->count = args->operand_count == 1 ? steps.count : args->operand_count;
    s->items = tl_mem_alloc(session->ctx, s->count, sizeof *s->items, &st);
    s->steer = tl_mem_alloc(session->ctx, s->count, sizeof *s->steer, &st);
    for (size_t i = 0; !st && i < s->count; i++)
        s->items[i] = args->operand_count == 1 ? (tl_step){args->operands[0], i, (uint32_t)i}
                                               : (tl_step){args->operands[i], 0, (uint32_t)i};
    tl_steps_release(session->ctx, &steps);
    return st;
}

/* Keeps the steps that were chosen; those that steer must be among them. */
static int keep_chosen(const cli_session *session, const bool *chosen, const bool *steer,
                       cli_steps *s)
{
    size_t kept = 0;
    for (size_t i = 0; i < s->count; i++) {
        if (steer[i] && !chosen[i])
            return cli_misuse(session->args.verb, "--steer: step %zu is not among --steps", i);
        if (steer[i]) s->steer[s->steer_count++] = (uint32_t)i;
        if (chosen[i]) s->items[kept++] = s->items[i];
    }
    s->count = kept;
    return CLI_DONE;
}

/* The step of a file that --step chooses, under the number of --as-step. */
static int one_step(cli_session *session, const tl_read_opts *read, cli_steps *s)
{
    tl_status st = TL_OK;
    if (read->has_time)
        return cli_misuse(session->args.verb, "--as-step: choose the step of the file by --step");
    s->items = tl_mem_alloc(session->ctx, 1, sizeof *s->items, &st);
    if (st) return cli_fail(session, session->ctx, st);
    s->items[0] = (tl_step){session->args.operands[0], read->step,
                            (uint32_t)cli_get(session, CLI_AS_STEP)->count};
    s->count = 1;
    return CLI_DONE;
}

int cli_steps_choose(cli_session *session, const tl_read_opts *read, cli_steps *steps)
{
    const cli_value *list = cli_get(session, CLI_STEPS), *steers = cli_get(session, CLI_STEER);
    const cli_value *as_step = cli_get(session, CLI_AS_STEP);
    const cli_verb *verb = session->args.verb;
    *steps = (cli_steps){0};
    if (steers->given && !list->given && session->args.operand_count == 1)
        return cli_misuse(verb, "--steer needs --steps");
    if (as_step->given && !list->given && session->args.operand_count == 1)
        return one_step(session, read, steps);
    if (!list->given && session->args.operand_count == 1) return CLI_DONE;
    if (cli_get(session, CLI_STEP)->given || cli_get(session, CLI_TIME)->given)
        return cli_misuse(verb, "--step and --time choose one step; --steps chooses several");
    tl_status st = list_steps(session, read, steps);
    bool *chosen = tl_mem_zalloc(session->ctx, 2 * steps->count, sizeof *chosen, &st);
    int failed = st ? cli_fail(session, session->ctx, st) : CLI_DONE;
    if (!failed)
        failed = choose(session, "steps", list->given ? list->text : "all", chosen, steps->count);
    if (!failed && steers->given && strcmp(steers->text, "all") != 0)
        failed = choose(session, "steer", steers->text, chosen + steps->count, steps->count);
    if (!failed) failed = keep_chosen(session, chosen, chosen + steps->count, steps);
    for (size_t i = 0; !failed && as_step->given && i < steps->count; i++)
        steps->items[i].number = (uint32_t)(as_step->count + i);
    tl_mem_free(session->ctx, chosen);
    if (failed) cli_steps_release(session, steps);
    return failed;
}

void cli_steps_release(cli_session *session, cli_steps *steps)
{
    tl_mem_free(session->ctx, steps->items);
    tl_mem_free(session->ctx, steps->steer);
    *steps = (cli_steps){0};
}
