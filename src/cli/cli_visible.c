/* Opacities of bins, from isovalues and from ParaView's colour maps. */
#include "cli_visible.h"

#include <math.h>
#include <string.h>

/* The larger of what is there and what the points make visible; colours alone show all. */
static void fill_bins(const tl_control_points *points, const tl_store_channel *channel, float *bins)
{
    const double low = channel->range[0], width = (channel->range[1] - low) / TL_BINS;
    for (int b = 0; b < TL_BINS; b++) {
        double opacity, unseen;
        tl_control_points_visible(points, low + b * width, low + (b + 1) * width, &opacity,
                                  &unseen);
        bins[b] = fmaxf(bins[b], (float)opacity);
    }
}

/* The channel of that name; of no name the only scalar. *exit_status tells if it is NULL. */
static const tl_store_channel *find_channel(const cli_session *session, const tl_store_head *head,
                                            const char *name, int *exit_status)
{
    const tl_store_channel *found = NULL;
    size_t count = 0;
    for (uint32_t c = 0; c < head->channel_count; c++) {
        const tl_store_channel *channel = &head->channels[c];
        const bool fits = *name ? strcmp(channel->name, name) == 0
                                : channel->components == 1 && channel->on == TL_ON_VERTEX;
        if (!fits) continue;
        found = found ? found : channel;
        count++;
    }
    if (*name && !found)
        *exit_status =
            cli_misuse(session->args.verb, "the model has no channel '%s'", cli_name(name).s);
    if (!*name && count != 1)
        *exit_status = cli_misuse(session->args.verb,
                                  "whose values? the model has %zu scalars on vertices; name "
                                  "one: CHANNEL=...",
                                  count);
    return *exit_status ? NULL : found;
}

static int add_transfer(cli_session *session, const tl_store_head *head, const char *word,
                        float *opacity)
{
    char name[CLI_NAME_BYTES] = "";
    const char *path = word;
    int exit_status = CLI_DONE;
    tl_control_points *points = NULL;
    FILE *there = fopen(word, "rb"); /* a path may hold an equals sign */
    if (there) fclose(there);
    if (!there && strchr(word, '=')) cli_split_named(word, name, sizeof name, &path);
    const tl_store_channel *channel = find_channel(session, head, name, &exit_status);
    if (exit_status) return exit_status;
    tl_status st = tl_control_points_read(session->ctx, path, false, &points);
    if (st) return cli_fail(session, session->ctx, st);
    fill_bins(points, channel, opacity + (channel - head->channels) * TL_BINS);
    tl_mem_free(session->ctx, points);
    return CLI_DONE;
}

static int add_isovalue(const cli_session *session, const tl_store_head *head, const char *word,
                        float *opacity)
{
    char name[CLI_NAME_BYTES] = "";
    const char *text = word;
    double value = 0;
    int exit_status = CLI_DONE;
    if (strchr(word, '=') && !cli_split_named(word, name, sizeof name, &text)) text = "";
    if (!cli_parse_real(text, &value) || !isfinite(value))
        return cli_misuse(session->args.verb, "--iso %s: expected CHANNEL=VALUE", word);
    const tl_store_channel *channel = find_channel(session, head, name, &exit_status);
    if (!channel) return exit_status;
    opacity[(size_t)(channel - head->channels) * TL_BINS + tl_bin_of(channel->range, value)] = 1;
    return CLI_DONE;
}

int cli_visible_read(cli_session *session, const tl_store_head *head, float **opacity)
{
    const cli_value *isos = cli_get(session, CLI_ISO), *maps = cli_get(session, CLI_TRANSFER);
    tl_status st = TL_OK;
    int exit_status = CLI_DONE;
    *opacity = NULL;
    if (!isos->given && !maps->given) return CLI_DONE;
    float *bins =
        tl_mem_zalloc(session->ctx, (size_t)head->channel_count * TL_BINS, sizeof *bins, &st);
    if (st) return cli_fail(session, session->ctx, st);
    for (size_t i = 0; !exit_status && i < isos->item_count; i++)
        exit_status = add_isovalue(session, head, isos->items[i], bins);
    for (size_t i = 0; !exit_status && i < maps->item_count; i++)
        exit_status = add_transfer(session, head, maps->items[i], bins);
    if (exit_status)
        tl_mem_free(session->ctx, bins);
    else
        *opacity = bins;
    return exit_status;
}

tl_status cli_visible_values(tl_ctx *ctx, const tl_store_head *head, uint32_t channel,
                             const double *values, size_t value_count, float **opacity)
{
    tl_status st = TL_OK;
    *opacity = tl_mem_zalloc(ctx, (size_t)head->channel_count * TL_BINS, sizeof **opacity, &st);
    for (size_t i = 0; !st && i < value_count; i++)
        (*opacity)[channel * (size_t)TL_BINS +
                   tl_bin_of(head->channels[channel].range, values[i])] = 1;
    return st;
}
