/* Points and streamlines of a picture: the words that say how they look, and what is made of them.
 */
#include <math.h>
#include <string.h>

#include "cli_flow.h"
#include "cli_scene.h"

/* Of lines that do not run through the box, and of points: pixels of the final picture. */
static const double GHOST = 0.12, POINT_PX = 1.1;
/* Spacing of arrows and length of dashes, in percent of the diagonal. */
static const double ARROWS = 8, DASHES = 2;
/* Channels that streamlines have of themselves stand before those that are carried along. */
enum { OWN_CHANNELS = 2 };
/* Times that dashes and arrows move by their distance in all frames together. */
enum { ROUNDS = 6 };

/* ---- words ---- */

/* "NAME=NUMBER" or, where initial is not NaN, "NAME". */
static bool take_number(const char *word, const char *name, double initial, double *value)
{
    const size_t length = strlen(name);
    if (strncmp(word, name, length) != 0) return false;
    if (!word[length] && !isnan(initial)) {
        *value = initial;
        return true;
    }
    return word[length] == '=' && cli_parse_real(word + length + 1, value) && *value > 0 &&
           isfinite(*value);
}

static bool take_word(cli_scene *scene, const char *word)
{
    cli_lines *l = &scene->lines;
    const double percent = scene->diagonal / 100;
    double number;
    if (strcmp(word, "tubes") == 0 || strcmp(word, "flat") == 0) {
        l->shape.shape = *word == 't' ? TL_LINE_TUBE : TL_LINE_FLAT;
        return true;
    }
    if (take_number(word, "width", (double)NAN, &l->shape.width_px)) return true;
    if (take_number(word, "halo", 1.5, &l->shape.halo_px)) return true;
    if (take_number(word, "opacity", (double)NAN, &l->opacity)) return l->opacity <= 1;
    if (take_number(word, "arrows", ARROWS, &number)) {
        l->shape.arrow_spacing = number * percent;
        return true;
    }
    if (!take_number(word, "dash", DASHES, &number)) return false;
    l->shape.dash = l->shape.gap = number * percent;
    return true;
}

/* CHANNEL[:WORD,WORD ...], --seeds, --box */
int cli_swarm_lines(cli_scene *scene, const char *text)
{
    cli_session *session = scene->session;
    cli_lines *l = &scene->lines;
    const tl_channel *channel;
    const cli_value *box = cli_get(session, CLI_BOX);
    const char *seeds = cli_get(session, CLI_SEEDS)->text, *words = "";
    snprintf(l->name, sizeof l->name, "%s", text);
    if (!tl_mesh_channel_by_name(scene->mesh, text)) {
        char *colon = strrchr(l->name, ':');
        if (colon) {
            *colon = '\0';
            words = text + (colon - l->name) + 1;
        }
    }
    l->shape = tl_line_opts_defaults();
    l->opacity = 1;
    for (; *words; words += strcspn(words, ","), words += *words == ',') {
        char word[64];
        snprintf(word, sizeof word, "%.*s", (int)strcspn(words, ","), words);
        if (!take_word(scene, word))
            return cli_misuse(session->args.verb,
                              "--lines %s: '%s' is none of tubes, flat, width=PX, halo, arrows, "
                              "dash, opacity=O",
                              text, word);
    }
    if (!cli_flow_is_seeds(seeds))
        return cli_misuse(session->args.verb, "--seeds %s: expected " CLI_SEEDS_WORDS, seeds);
    if (box->given && !cli_parse_box(box->text, l->box))
        return cli_misuse(session->args.verb, "--box %s: expected X0,Y0,Z0,X1,Y1,Z1", box->text);
    l->has_box = box->given;
    return cli_flow_channel(session, scene->mesh, l->name, &channel);
}

/* ---- points ---- */

tl_status cli_swarm_add_points(cli_scene *scene)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_polydata *points = NULL;
    double values[TL_SLICE_VALUES_MAX];
    const cli_shade *shade = scene->points_shade;
    tl_points_opts opts = tl_points_opts_defaults();
    tl_point_opts shape = tl_point_opts_defaults();
    opts.count = scene->points_wanted;
    /* the least and the largest value have no surface */
    opts.low = cli_shade_shown(shade, shade->range[0]);
    opts.high = cli_shade_shown(shade, shade->range[1]);
    if (opts.low < opts.high) {
        const double range[2] = {opts.low, opts.high};
        opts.values = values;
        opts.value_count = scene->shell_count;
        cli_middles(range, opts.value_count, values);
    }
    opts.channels = &shade->channel;
    opts.channel_count = 1;
    tl_status st = tl_slice_points(ctx, scene->mesh, shade->scalar, &opts, NULL, &points);
    if (!st) st = cli_scene_keep(scene, (cli_kept){.polydata = points});
    if (st) return st;
    tl_look look = tl_look_defaults();
    look.scalar = points->channels[0].values;
    look.transfer = shade->transfer;
    look.ambient = 0.45;
    look.specular = 0;
    shape.radius_px = POINT_PX * scene->samples;
    return tl_renderer_add_points(ctx, scene->renderer, points, &look, &shape, NULL);
}

/* ---- lines ---- */

/* The lines whose mark is wanted, with the vertices of all. Gives *part, kept; its vertices are
 * borrowed from lines. */
static tl_status choose_lines(cli_scene *scene, const tl_polydata *lines, const uint8_t *marks,
                              bool wanted, const tl_polydata **part)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = scene->session->ctx;
    tl_polydata *p = tl_mem_zalloc(ctx, 1, sizeof *p, &st);
    if (!st) st = cli_scene_keep(scene, (cli_kept){.block = p});
    if (st) return st;
    *p = *lines;
    *part = p;
    p->starts = tl_mem_alloc(ctx, lines->cell_count + 1, sizeof *p->starts, &st);
    if (!st) st = cli_scene_keep(scene, (cli_kept){.block = p->starts});
    if (st) return st;
    p->corners = tl_mem_alloc(ctx, lines->starts[lines->cell_count], sizeof *p->corners, &st);
    if (!st) st = cli_scene_keep(scene, (cli_kept){.block = p->corners});
    if (st) return st;
    p->cell_count = 0;
    p->starts[0] = 0;
    for (size_t i = 0; i < lines->cell_count; i++) {
        const tl_lidx count = lines->starts[i + 1] - lines->starts[i];
        if ((marks[i] != 0) != wanted) continue;
        memcpy(p->corners + p->starts[p->cell_count], lines->corners + lines->starts[i],
               count * sizeof *p->corners);
        p->starts[p->cell_count + 1] = p->starts[p->cell_count] + count;
        p->cell_count++;
    }
    return TL_OK;
}

/* Follows the lines; with a box those through it and the others apart. */
int cli_swarm_trace(cli_scene *scene)
{
    tl_status st = TL_OK;
    cli_session *session = scene->session;
    cli_lines *l = &scene->lines;
    tl_polydata *lines = NULL;
    const tl_channel *channel;
    tl_stream_opts opts = tl_stream_opts_defaults();
    opts.channels = &scene->color_shade->channel;
    opts.channel_count = 1;
    int failed = cli_flow_channel(session, scene->mesh, l->name, &channel);
    if (!failed)
        failed = cli_flow_trace(session, scene->mesh, channel, cli_get(session, CLI_SEEDS)->text,
                                &opts, &lines, NULL);
    if (failed) return failed;
    st = cli_scene_keep(scene, (cli_kept){.polydata = lines});
    l->parts[0] = lines;
    l->parts[1] = NULL;
    if (!st && l->has_box) {
        uint8_t *marks = tl_mem_alloc(session->ctx, lines->cell_count, sizeof *marks, &st);
        if (!st) tl_lines_in_box(lines, l->box, marks);
        if (!st) st = choose_lines(scene, lines, marks, true, &l->parts[0]);
        if (!st) st = choose_lines(scene, lines, marks, false, &l->parts[1]);
        tl_mem_free(session->ctx, marks);
    }
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

tl_status cli_swarm_add_lines(cli_scene *scene, double t)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = scene->session->ctx;
    cli_lines *l = &scene->lines;
    tl_line_opts shape = l->shape;
    shape.width_px *= scene->samples;
    shape.halo_px *= scene->samples;
    shape.phase =
        t * ROUNDS * (shape.arrow_spacing > 0 ? shape.arrow_spacing : shape.dash + shape.gap);
    for (int part = 0; !st && part < 2; part++) {
        tl_renderer_remove(ctx, scene->renderer, l->items[part]);
        l->items[part] = 0;
        if (!l->parts[part] || !l->parts[part]->cell_count) continue;
        tl_look look = tl_look_defaults();
        look.scalar = l->parts[part]->channels[OWN_CHANNELS].values;
        look.transfer = scene->color_shade->transfer;
        look.opacity = part ? GHOST : l->opacity;
        if (part) shape.arrow_spacing = shape.halo_px = 0;
        st = tl_renderer_add_lines(ctx, scene->renderer, l->parts[part], &look, &shape,
                                   &l->items[part]);
    }
    return st;
}
