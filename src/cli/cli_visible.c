/* Opacities of bins, from isovalues and from ParaView's colour maps: a list of objects, or one,
 * with "Points": value, opacity, midpoint, sharpness for each node. */
#include "cli_visible.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Numbers of a node, and the most nodes that make sense. */
enum { NODE_NUMBERS = 4, NODES_MOST = 1 << 20 };

/* Errors looked at, as parts of a bin's width: from the first on, each twice the one before. */
static const double UNSEEN_LEAST = 0x1p-6;
enum { UNSEEN_STEPS = 9 };

typedef struct node {
    double value, opacity;
    bool is_bent; /* the way to the next node is no straight line */
} node;

static int wrong(const char *path, const char *what)
{
    fprintf(stderr, "tetralod: '%s': %s\n", path, what);
    return CLI_FAILED;
}

/* ---- nodes ---- */

static int by_value(const void *a, const void *b)
{
    const node *x = a, *y = b;
    return (x->value > y->value) - (x->value < y->value);
}

/* Sorted nodes. Gives *nodes [*count] (tl_mem_free), also on failure. */
static int take_nodes(tl_ctx *ctx, const char *path, const json_t *points, node **nodes,
                      size_t *count)
{
    const size_t numbers = json_array_size(points);
    tl_status st = TL_OK;
    *nodes = NULL;
    *count = numbers / NODE_NUMBERS;
    if (!json_is_array(points) || numbers % NODE_NUMBERS || !numbers || *count > NODES_MOST)
        return wrong(path, "Points: expected a list of value, opacity, midpoint, sharpness ...");
    *nodes = tl_mem_zalloc(ctx, *count, sizeof **nodes, &st);
    if (st) return wrong(path, tl_ctx_message(ctx));
    for (size_t i = 0; i < numbers; i++) {
        const json_t *item = json_array_get(points, i);
        const double x = json_number_value(item);
        node *n = &(*nodes)[i / NODE_NUMBERS];
        if (!json_is_number(item)) return wrong(path, "Points: expected numbers alone");
        if (i % NODE_NUMBERS == 1 && !(x >= 0 && x <= 1))
            return wrong(path, "Points: expected opacities from 0 to 1");
        if (i % NODE_NUMBERS == 0) n->value = x;
        if (i % NODE_NUMBERS == 1) n->opacity = x;
        if (i % NODE_NUMBERS == 2) n->is_bent = x != 0.5;
        if (i % NODE_NUMBERS == 3) n->is_bent = n->is_bent || x != 0;
    }
    qsort(*nodes, *count, sizeof **nodes, by_value);
    return CLI_DONE;
}

static double between(const node *a, const node *b, double value)
{
    const double width = b->value - a->value;
    const double t = width > 0 ? (value - a->value) / width : 0;
    return a->opacity + t * (b->opacity - a->opacity);
}

/* Largest opacity of values from low to high. Before the first node and behind the last one it is
 * theirs; a way that is not straight counts as high as its higher end. */
static double most_opaque(const node *nodes, size_t count, double low, double high)
{
    double most = 0;
    if (low <= nodes[0].value) most = nodes[0].opacity;
    if (high >= nodes[count - 1].value) most = fmax(most, nodes[count - 1].opacity);
    for (size_t i = 0; i + 1 < count; i++) {
        const node *a = &nodes[i], *b = &nodes[i + 1];
        if (b->value < low || a->value > high) continue;
        if (a->is_bent)
            most = fmax(most, fmax(a->opacity, b->opacity));
        else
            most = fmax(most, fmax(between(a, b, fmax(low, a->value)),
                                   between(a, b, fmin(high, b->value))));
    }
    return most;
}

/* ---- bins ---- */

static int fill_bins(tl_ctx *ctx, const char *path, const json_t *root,
                     const tl_store_channel *channel, float *bins)
{
    node *nodes = NULL;
    size_t count = 0;
    const json_t *map = json_is_array(root) ? json_array_get(root, 0) : root;
    const json_t *points = json_object_get(map, "Points");
    if (!json_is_object(map)) return wrong(path, "expected a JSON object with a colour map");
    if (!points && !json_object_get(map, "RGBPoints"))
        return wrong(path, "a colour map without Points, which say what is visible");
    int exit_status = points ? take_nodes(ctx, path, points, &nodes, &count) : CLI_DONE;
    const double low = channel->range[0], width = (channel->range[1] - low) / TL_BINS;
    for (int b = 0; !exit_status && b < TL_BINS; b++) {
        const double most =
            count ? most_opaque(nodes, count, low + b * width, low + (b + 1) * width) : 1;
        bins[b] = fmaxf(bins[b], (float)most);
    }
    tl_mem_free(ctx, nodes);
    return exit_status;
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

static int add_transfer(const cli_session *session, const tl_store_head *head, const char *word,
                        float *opacity)
{
    char name[CLI_NAME_BYTES] = "";
    const char *path = word;
    int exit_status = CLI_DONE;
    json_t *root = NULL;
    FILE *there = fopen(word, "rb"); /* a path may hold an equals sign */
    if (there) fclose(there);
    if (!there && strchr(word, '=')) cli_split_named(word, name, sizeof name, &path);
    const tl_store_channel *channel = find_channel(session, head, name, &exit_status);
    if (!exit_status) exit_status = cli_json_read(session->ctx, path, true, &root);
    if (!exit_status)
        exit_status = fill_bins(session->ctx, path, root, channel,
                                opacity + (channel - head->channels) * TL_BINS);
    json_decref(root);
    return exit_status;
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

/* ---- what is drawn ---- */

/* Largest opacity that points give values from low to high. */
static double opacity_between(const cli_points *p, double low, double high)
{
    node nodes[TL_SCENE_ROWS_MAX];
    for (size_t i = 0; i < p->opacity_count; i++)
        nodes[i] = (node){p->opacities[i].value, p->opacities[i].opacity, false};
    return most_opaque(nodes, p->opacity_count, low, high);
}

/* How fast opacity and colour change at most with values from low to high. */
static double steepest(const cli_points *p, double low, double high)
{
    double fade = 0, shade = 0;
    for (size_t i = 0; i + 1 < p->opacity_count; i++) {
        const tl_opacity_point *a = &p->opacities[i], *b = a + 1;
        if (b->value < low || a->value > high || a->opacity == b->opacity) continue;
        fade = fmax(fade, fabs(b->opacity - a->opacity) / (b->value - a->value));
    }
    for (size_t i = 0; i + 1 < p->color_count; i++) {
        const tl_color_point *a = &p->colors[i], *b = a + 1;
        if (b->value < low || a->value > high) continue;
        for (int k = 0; k < 3; k++)
            if (a->rgb[k] != b->rgb[k])
                shade = fmax(shade, fabs(b->rgb[k] - a->rgb[k]) / (b->value - a->value));
    }
    const double most = opacity_between(p, low, high);
    return fade + (most > 0 ? most * shade : 0);
}

/* The largest error of values from low to high, up to some bins, that does not show. */
static double unseen_error(const cli_points *p, double low, double high)
{
    double reach = UNSEEN_LEAST * (high - low), error = 0;
    for (int i = 0; i < UNSEEN_STEPS; i++, reach *= 2)
        error = fmax(error, fmin(reach, CLI_UNSEEN / steepest(p, low - reach, high + reach)));
    return error;
}

void cli_visible_points(const cli_points *points, double low, double high, double *opacity,
                        double *unseen)
{
    *opacity = opacity_between(points, low, high);
    *unseen = unseen_error(points, low, high);
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
