/* Time steps of a model: which there are, and which one --step and --time choose. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_model.h"

bool cli_in_step(const tl_store_channel *channel, const cli_model_step *step)
{
    return !channel->has_step || (step->is_chosen && channel->step == step->number);
}

bool cli_next_step(const tl_store_head *head, cli_model_step *step)
{
    const tl_store_channel *best = NULL;
    for (uint32_t c = 0; c < head->channel_count; c++) {
        const tl_store_channel *channel = &head->channels[c];
        if (!channel->has_step || (step->is_chosen && channel->step <= step->number)) continue;
        if (!best || channel->step < best->step) best = channel;
    }
    if (best) *step = (cli_model_step){true, best->step, best->time};
    return best != NULL;
}

static int unknown_step(const cli_session *session, const tl_store_head *head)
{
    cli_model_step step = {0};
    cli_misuse(session->args.verb, "--step %s: the model has no such step",
               cli_get(session, CLI_STEP)->text);
    fputs("  steps:", stderr);
    while (cli_next_step(head, &step)) fprintf(stderr, " %u", step.number);
    fputs("\n", stderr);
    return CLI_WRONG_USE;
}

/* Of two equally near the earlier one. */
static void choose_by_time(const tl_store_head *head, double time, cli_model_step *chosen)
{
    cli_model_step step = {0};
    double nearest = INFINITY;
    while (cli_next_step(head, &step))
        if (fabs(step.time - time) < nearest) {
            nearest = fabs(step.time - time);
            *chosen = step;
        }
}

int cli_choose_step(const cli_session *session, const tl_store_head *head, cli_model_step *chosen)
{
    const cli_value *number = cli_get(session, CLI_STEP), *time = cli_get(session, CLI_TIME);
    cli_model_step step = {0};
    *chosen = step;
    if (number->given && time->given)
        return cli_misuse(session->args.verb, "--step and --time both choose a step");
    if (!cli_next_step(head, &step))
        return number->given || time->given
                   ? cli_misuse(session->args.verb, "the model has no time steps")
                   : CLI_DONE;
    *chosen = step;
    if (time->given) choose_by_time(head, time->real, chosen);
    if (!number->given) return CLI_DONE;
    size_t digits = strspn(number->text, "0123456789");
    bool last = strcmp(number->text, "last") == 0;
    if (!last && (!digits || digits > 9 || number->text[digits]))
        return cli_misuse(session->args.verb, "--step %s: expected a number from 0 on, or last",
                          number->text);
    unsigned long wanted = last ? 0 : strtoul(number->text, NULL, 10);
    while (last || chosen->number != wanted) {
        *chosen = step;
        if (!cli_next_step(head, &step)) break;
    }
    return last || chosen->number == wanted ? CLI_DONE : unknown_step(session, head);
}

int cli_unknown_in_model(const cli_session *session, const tl_store_head *head,
                         const cli_model_step *step, const char *name)
{
    cli_misuse(session->args.verb, "the model has no channel '%s'", cli_name(name).s);
    fputs("  channels:", stderr);
    for (uint32_t c = 0; c < head->channel_count; c++)
        if (cli_in_step(&head->channels[c], step))
            fprintf(stderr, " '%s'", cli_name(head->channels[c].name).s);
    fputs(head->channel_count ? "\n" : " none\n", stderr);
    return CLI_WRONG_USE;
}
