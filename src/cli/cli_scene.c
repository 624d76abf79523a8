/* What a picture shows: words to nodes of a scene. */
#include <math.h>
#include <string.h>

#include "cli_scene.h"

/* ---- nodes ---- */

static int done(const cli_scene *scene, tl_status st)
{
    return st ? cli_fail(scene->session, scene->session->ctx, st) : CLI_DONE;
}

int cli_scene_add(cli_scene *scene, tl_node_kind kind, tl_node *node)
{
    return done(scene, tl_scene_add(scene->session->ctx, scene->volume.scene, kind, node));
}

int cli_scene_text(cli_scene *scene, tl_node node, const char *prop, const char *text)
{
    const tl_value value = {.text = text};
    return done(scene, tl_scene_set(scene->session->ctx, scene->volume.scene, node, prop, &value));
}

int cli_scene_reals(cli_scene *scene, tl_node node, const char *prop, const double *reals,
                    size_t count)
{
    const tl_value value = {.reals = reals, .count = count};
    return done(scene, tl_scene_set(scene->session->ctx, scene->volume.scene, node, prop, &value));
}

int cli_scene_real(cli_scene *scene, tl_node node, const char *prop, double value)
{
    return cli_scene_reals(scene, node, prop, &value, 1);
}

int cli_scene_flag(cli_scene *scene, tl_node node, const char *prop, bool value)
{
    return cli_scene_real(scene, node, prop, value);
}

/* A thing of a channel, or of none (NULL). */
static int add_thing(cli_scene *scene, tl_node_kind kind, const char *channel, tl_node *node)
{
    int failed = cli_scene_add(scene, kind, node);
    return failed || !channel ? failed : cli_scene_text(scene, *node, "channel", channel);
}

/* ---- channels ---- */

static int channel_values(cli_scene *scene, const char *name, const tl_values **values)
{
    return done(scene, tl_view_values(scene->session->ctx, scene->volume.view, scene->volume.scene,
                                      name, values));
}

static int unknown_map(const cli_session *session, const char *map)
{
    cli_misuse(session->args.verb, "--colormap %s is unknown", map);
    fputs("  colour maps:", stderr);
    for (size_t i = 0; tl_colormap_name(i); i++) fprintf(stderr, " %s", tl_colormap_name(i));
    fputs("\n", stderr);
    return CLI_WRONG_USE;
}

/* "V" or "P%" of the volume. */
static bool parse_end(const char *text, double *value, bool *percent)
{
    if (cli_parse_amount(text, value, percent) && *percent) return *value <= 1;
    *percent = false;
    return cli_parse_real(text, value) && isfinite(*value);
}

/* The value that a part of the volume is below. */
static int rank_value(cli_scene *scene, tl_node node, const char *name, double part, double *value)
{
    const tl_values *values;
    const double percent[2] = {100 * part, 100 * part};
    int failed = cli_scene_text(scene, node, "range_by", "percent");
    if (!failed) failed = cli_scene_text(scene, node, "symmetric", "off");
    if (!failed) failed = cli_scene_reals(scene, node, "percent", percent, 2);
    if (!failed) failed = channel_values(scene, name, &values);
    if (!failed) *value = values->range[0];
    return failed;
}

/* --range LOW,HIGH: both in percent, or values. */
static int set_range(cli_scene *scene, tl_node node, const char *name)
{
    char low[64];
    const cli_session *session = scene->session;
    const char *text = cli_get(session, CLI_RANGE)->text, *comma = text ? strchr(text, ',') : NULL;
    double range[2];
    bool percent[2];
    if (!text) return CLI_DONE;
    snprintf(low, sizeof low, "%.*s", comma ? (int)(comma - text) : 0, text);
    if (!comma || !parse_end(low, &range[0], &percent[0]) ||
        !parse_end(comma + 1, &range[1], &percent[1]))
        return cli_misuse(session->args.verb, "--range %s: expected LOW,HIGH, as values or P%%",
                          text);
    int failed = CLI_DONE;
    const bool ranks = percent[0] && percent[1]; /* may meet in a constant channel */
    for (int k = 0; !failed && !ranks && k < 2; k++)
        if (percent[k]) failed = rank_value(scene, node, name, range[k], &range[k]);
    if (failed) return failed;
    if (!(range[0] < range[1]) && !((percent[0] || percent[1]) && range[0] == range[1]))
        return cli_misuse(session->args.verb, "--range %s: expected LOW,HIGH with LOW below HIGH",
                          text);
    if (!ranks && cli_get(session, CLI_LOG)->given && !(range[0] > 0))
        return cli_misuse(session->args.verb, "--range %s: a logarithmic scale begins above 0",
                          text);
    for (int k = 0; ranks && k < 2; k++) range[k] *= 100;
    failed = cli_scene_text(scene, node, "range_by", ranks ? "percent" : "values");
    return failed ? failed : cli_scene_reals(scene, node, ranks ? "percent" : "range", range, 2);
}

/* --center V or none. */
static int set_center(cli_scene *scene, tl_node node)
{
    double center = 0;
    const cli_session *session = scene->session;
    const char *text = cli_get(session, CLI_CENTER)->text;
    if (!text) return CLI_DONE;
    if (strcmp(text, "none") == 0) return cli_scene_text(scene, node, "symmetric", "off");
    if (!cli_parse_real(text, &center) || !isfinite(center))
        return cli_misuse(session->args.verb, "--center %s: expected a value, or none", text);
    if (strcmp(tl_scene_text(scene->volume.scene, node, "range_by"), "values") == 0)
        return cli_misuse(session->args.verb, "--center %s: --range says the ends", text);
    if (tl_scene_flag(scene->volume.scene, node, "logarithmic"))
        return cli_misuse(session->args.verb, "--center %s: a logarithmic scale has no middle",
                          text);
    const int failed = cli_scene_text(scene, node, "symmetric", "on");
    return failed ? failed : cli_scene_real(scene, node, "center", center);
}

/* --colormap, --log, --range, --center for a transfer node; those that are given, of a new one all.
 */
static int set_words(cli_scene *scene, tl_node node, const char *name, bool is_new)
{
    const cli_session *session = scene->session;
    const cli_value *map = cli_get(session, CLI_COLORMAP);
    size_t count;
    int failed = CLI_DONE;
    if (!tl_colormap(map->text, &count)) return unknown_map(session, map->text);
    if (map->given || is_new) failed = cli_scene_text(scene, node, "map", map->text);
    if (!failed && cli_get(session, CLI_LOG)->given)
        failed = cli_scene_flag(scene, node, "logarithmic", true);
    if (!failed) failed = set_range(scene, node, name);
    return failed ? failed : set_center(scene, node);
}

int cli_scene_channel(cli_scene *scene, const char *name, const char *file,
                      const tl_values **values)
{
    tl_ctx *ctx = scene->session->ctx;
    const tl_values *own;
    tl_value colors = {0};
    int failed = CLI_DONE;
    tl_node node = tl_scene_transfer_of(scene->volume.scene, name);
    const bool is_new = node == 0;
    if (is_new) failed = channel_values(scene, name, &own); /* is there such a channel? */
    if (!failed && is_new) failed = add_thing(scene, TL_NODE_TRANSFER, name, &node);
    if (!failed) failed = set_words(scene, node, name, is_new);
    if (!failed && file) {
        tl_scene_get(ctx, scene->volume.scene, node, "colors", &colors);
        if (colors.count && !is_new)
            return cli_misuse(scene->session->args.verb,
                              "'%s' has two transfer functions, '%s' is one too many", name, file);
        failed = done(scene, tl_transfer_read(ctx, scene->volume.scene, node, file));
    }
    return failed || !values ? failed : channel_values(scene, name, values);
}

bool cli_scene_has(const cli_scene *scene, const char *name)
{
    size_t count;
    const tl_source_facts *facts = tl_source_get_facts(scene->volume.source);
    const tl_node *nodes = tl_scene_nodes(scene->volume.scene, &count);
    for (size_t c = 0; c < facts->channel_count; c++)
        if (strcmp(facts->channels[c].name, name) == 0) return true;
    for (size_t i = 0; i < count; i++) {
        const char *text = tl_scene_text(scene->volume.scene, nodes[i], "text");
        if (tl_scene_kind(scene->volume.scene, nodes[i]) == TL_NODE_DERIVE &&
            strncmp(text, name, strlen(name)) == 0 && text[strlen(name)] == '=')
            return true;
    }
    return false;
}

/* CHANNEL[:FILE]; a name may have colons. Fills name. */
static int take_channel(cli_scene *scene, const char *text, char name[CLI_NAME_BYTES])
{
    const char *file = NULL;
    snprintf(name, CLI_NAME_BYTES, "%s", text);
    if (!cli_scene_has(scene, text))
        for (const char *colon = text; !file && (colon = strchr(colon, ':')) != NULL; colon++) {
            snprintf(name, CLI_NAME_BYTES, "%.*s", (int)(colon - text), text);
            if (cli_scene_has(scene, name) || !strchr(colon + 1, ':')) file = colon + 1;
        }
    return cli_scene_channel(scene, name, file, NULL);
}

int cli_scene_write_transfer(cli_scene *scene, const char *channel, const char *path)
{
    const tl_values *v;
    int failed = channel_values(scene, channel, &v);
    if (failed) return failed;
    /* what is written is not changed */
    const tl_control_points points = {.colors = (tl_color_point *)(uintptr_t)v->colors,
                                      .opacities = (tl_opacity_point *)(uintptr_t)v->opacities,
                                      .color_count = v->color_count,
                                      .opacity_count = v->opacity_count,
                                      .logarithmic = v->logarithmic};
    return done(scene, tl_control_points_write(scene->session->ctx, path, v->channel, &points));
}

/* ---- things ---- */

static int take_volume(cli_scene *scene)
{
    tl_node node;
    char name[CLI_NAME_BYTES];
    const cli_session *session = scene->session;
    const cli_value *fade = cli_get(session, CLI_GRADIENT_OPACITY);
    const char *text = cli_get(session, CLI_VOLUME)->text;
    int failed = text ? take_channel(scene, text, name) : CLI_DONE;
    if (failed || !text) return failed;
    failed = add_thing(scene, TL_NODE_VOLUME, name, &node);
    if (!failed) failed = cli_scene_flag(scene, node, "lit", cli_get(session, CLI_LIT)->given);
    if (!failed)
        failed = cli_scene_real(scene, node, "method", cli_get(session, CLI_VOLUME_METHOD)->choice);
    if (failed || !fade->given) return failed;
    failed = cli_scene_flag(scene, node, "gradient_percent", fade->percent);
    return failed ? failed
                  : cli_scene_real(scene, node, "gradient_opacity",
                                   fade->percent ? 100 * fade->real : fade->real);
}

/* A part of "VALUE[%][:COLOUR][:OPACITY]" for a surface; the first one is the value. */
static int take_part(cli_scene *scene, tl_node node, const char *word, char *part, bool is_value,
                     const tl_values *values)
{
    const cli_verb *verb = scene->session->args.verb;
    const size_t length = strlen(part);
    const bool percent = length && part[length - 1] == '%';
    double number, rgb[3];
    if (percent) part[length - 1] = '\0';
    const bool is_number = cli_parse_real(part, &number) && isfinite(number);
    if (is_value ? !is_number : percent)
        return cli_misuse(verb, "--surface %s: expected CHANNEL=VALUE[:COLOUR][:OPACITY]", word);
    if (is_value)
        return cli_scene_real(
            scene, node, "value",
            percent ? values->least * (1 - number / 100) + values->most * (number / 100) : number);
    if (is_number && number >= 0 && number <= 1)
        return cli_scene_real(scene, node, "opacity", number);
    if (tl_color_read(part, rgb)) return cli_scene_reals(scene, node, "color", rgb, 3);
    return cli_misuse(verb, "--surface %s: '%s' is no colour and no opacity", word, part);
}

/* CHANNEL=VALUE[%][:COLOUR][:OPACITY] */
static int take_surface(cli_scene *scene, const char *word)
{
    tl_node node;
    char name[CLI_NAME_BYTES], part[64];
    const char *text;
    const tl_values *values;
    if (!cli_split_named(word, name, sizeof name, &text))
        return cli_misuse(scene->session->args.verb,
                          "--surface %s: expected CHANNEL=VALUE[:COLOUR][:OPACITY]", word);
    int failed = cli_scene_channel(scene, name, NULL, &values);
    if (!failed) failed = add_thing(scene, TL_NODE_SURFACE, name, &node);
    for (int i = 0; !failed && (*text || !i); i++) {
        const size_t length = strcspn(text, ":");
        if (length >= sizeof part)
            return cli_misuse(scene->session->args.verb,
                              "--surface %s: expected CHANNEL=VALUE[:COLOUR][:OPACITY]", word);
        snprintf(part, sizeof part, "%.*s", (int)length, text);
        failed = take_part(scene, node, word, part, i == 0, values);
        text += length + (text[length] == ':');
    }
    return failed;
}

/* "X,Y,Z,NX,NY,NZ", or "x", "y=3", "z=20%" */
static bool parse_plane(const double bounds[6], const char *text, double plane[6])
{
    if (cli_parse_reals(text, plane, 6)) return plane[3] != 0 || plane[4] != 0 || plane[5] != 0;
    const bool down = *text == '-';
    const int axis = text[down] - 'x';
    if (axis < 0 || axis > 2 || (text[down + 1] && text[down + 1] != '=')) return false;
    const double low = bounds[2 * axis], high = bounds[2 * axis + 1];
    double at = low / 2 + high / 2;
    if (text[down + 1]) {
        char number[64];
        snprintf(number, sizeof number, "%s", text + down + 2);
        const size_t length = strlen(number);
        const bool percent = length && number[length - 1] == '%';
        if (percent) number[length - 1] = '\0';
        if (!cli_parse_real(number, &at) || !isfinite(at)) return false;
        if (percent) at = low * (1 - at / 100) + high * (at / 100);
    }
    for (int k = 0; k < 6; k++) plane[k] = 0;
    plane[axis] = at;
    plane[3 + axis] = down ? -1 : 1;
    return true;
}

static int take_slices(cli_scene *scene, const double bounds[6])
{
    tl_node node;
    double plane[6];
    int failed = CLI_DONE;
    const cli_value *list = cli_get(scene->session, CLI_SLICE);
    for (size_t i = 0; !failed && i < list->item_count; i++) {
        if (!parse_plane(bounds, list->items[i], plane))
            return cli_misuse(scene->session->args.verb,
                              "--slice %s: expected X,Y,Z,NX,NY,NZ, or x, y=V, z=P%%",
                              list->items[i]);
        failed = cli_scene_add(scene, TL_NODE_SLICE, &node);
        if (!failed) failed = cli_scene_reals(scene, node, "plane", plane, 6);
    }
    return failed;
}

static int take_marks(cli_scene *scene)
{
    static const struct {
        cli_id id;
        const char *mark;
    } MARKS[] = {{CLI_COLOR_LEVELS, "levels"}, {CLI_COLOR_PATCHES, "patches"}};
    tl_node node;
    const cli_session *session = scene->session;
    for (size_t i = 0; i < sizeof MARKS / sizeof *MARKS; i++) {
        if (!cli_get(session, MARKS[i].id)->given) continue;
        if (!scene->volume.is_model)
            return cli_misuse(session->args.verb,
                              "--color-patches, --color-levels: '%s' is no model",
                              scene->volume.input.path);
        int failed = cli_scene_add(scene, TL_NODE_BOUNDARY, &node);
        return failed ? failed : cli_scene_text(scene, node, "mark", MARKS[i].mark);
    }
    return CLI_DONE;
}

/* ---- colours ---- */

/* All things that can show a channel and have no colour of their own. */
static int set_colors(cli_scene *scene)
{
    size_t count;
    int failed = CLI_DONE;
    tl_value color;
    const tl_scene *document = scene->volume.scene;
    for (size_t i = 0; !failed && i < (tl_scene_nodes(document, &count), count); i++) {
        const tl_node node = tl_scene_nodes(document, &count)[i];
        const tl_node_kind kind = tl_scene_kind(document, node);
        if (kind != TL_NODE_SURFACE && kind != TL_NODE_SLICE && kind != TL_NODE_BOUNDARY &&
            kind != TL_NODE_LINES)
            continue;
        if (*tl_scene_text(document, node, "color_by")) continue;
        if (kind == TL_NODE_SURFACE &&
            !tl_scene_get(scene->session->ctx, document, node, "color", &color) && color.count)
            continue;
        failed = cli_scene_text(scene, node, "color_by", scene->color);
    }
    return failed;
}

/* Planes show a channel, lines their speed, if nothing is said. */
static int choose_color(cli_scene *scene)
{
    size_t count;
    const tl_scene *document = scene->volume.scene;
    const tl_node *nodes = tl_scene_nodes(document, &count);
    bool has_slices = false, has_lines = false;
    for (size_t i = 0; i < count; i++) {
        has_slices |= tl_scene_kind(document, nodes[i]) == TL_NODE_SLICE;
        if (tl_scene_kind(document, nodes[i]) != TL_NODE_LINES) continue;
        has_lines = true;
        snprintf(scene->color, sizeof scene->color, "%s",
                 tl_scene_text(document, nodes[i], "channel"));
    }
    if (has_slices && !has_lines) {
        tl_status st = tl_first_channel(scene->session->ctx, scene->volume.source, document,
                                        scene->color, sizeof scene->color);
        if (st) return cli_fail(scene->session, scene->session->ctx, st);
    }
    return *scene->color ? cli_scene_channel(scene, scene->color, NULL, NULL) : CLI_DONE;
}

/* ---- all ---- */

static bool has_things(const tl_scene *scene)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    for (size_t i = 0; i < count; i++)
        if (tl_scene_kind(scene, nodes[i]) >= TL_NODE_VOLUME) return true;
    return false;
}

/* The channel of a first look gets its colours by the words, too. */
static int first_look(cli_scene *scene)
{
    size_t count;
    tl_ctx *ctx = scene->session->ctx;
    int failed = done(scene, tl_first_look(ctx, scene->volume.source, scene->volume.scene));
    const tl_node *nodes = tl_scene_nodes(scene->volume.scene, &count);
    for (size_t i = 0; !failed && i < count; i++) {
        char name[CLI_NAME_BYTES];
        const tl_node_kind kind = tl_scene_kind(scene->volume.scene, nodes[i]);
        if (kind != TL_NODE_VOLUME && kind != TL_NODE_BOUNDARY) continue;
        snprintf(name, sizeof name, "%s",
                 tl_scene_text(scene->volume.scene, nodes[i],
                               kind == TL_NODE_VOLUME ? "channel" : "color_by"));
        return *name ? cli_scene_channel(scene, name, NULL, NULL) : CLI_DONE;
    }
    return failed;
}

static int add_given(cli_scene *scene, cli_id id, tl_node_kind kind)
{
    tl_node node;
    return cli_get(scene->session, id)->given ? cli_scene_add(scene, kind, &node) : CLI_DONE;
}

static int take_interfaces(cli_scene *scene)
{
    tl_node node;
    if (!cli_get(scene->session, CLI_INTERFACES)->given) return CLI_DONE;
    int failed = cli_scene_add(scene, TL_NODE_BOUNDARY, &node);
    return failed ? failed : cli_scene_flag(scene, node, "interfaces", true);
}

/* Things in the order in which they are drawn. */
static int take_things(cli_scene *scene)
{
    double bounds[6];
    tl_ctx *ctx = scene->session->ctx;
    const cli_session *session = scene->session;
    const cli_value *surfaces = cli_get(session, CLI_SURFACE),
                    *points = cli_get(session, CLI_POINTS), *lines = cli_get(session, CLI_LINES),
                    *color = cli_get(session, CLI_COLOR_BY);
    int failed = done(scene, tl_view_bounds(ctx, scene->volume.view, scene->volume.scene, bounds));
    if (!failed) failed = take_volume(scene);
    if (!failed && color->given) failed = take_channel(scene, color->text, scene->color);
    for (size_t i = 0; !failed && i < surfaces->item_count; i++)
        failed = take_surface(scene, surfaces->items[i]);
    if (!failed) failed = take_slices(scene, bounds);
    if (!failed) failed = take_marks(scene);
    if (!failed) failed = take_interfaces(scene);
    if (!failed) failed = add_given(scene, CLI_BOUNDARY, TL_NODE_BOUNDARY);
    if (!failed) failed = add_given(scene, CLI_EDGES, TL_NODE_EDGES);
    if (!failed && points->given) failed = cli_swarm_points(scene, points->text);
    if (!failed) failed = add_given(scene, CLI_SILHOUETTES, TL_NODE_SILHOUETTES);
    if (!failed && lines->given) failed = cli_swarm_lines(scene, lines->text);
    return failed;
}

/* Colours, edges and outlines alone are those of something: of the boundary, if there is a channel.
 */
static int complete(cli_scene *scene)
{
    static const cli_id OTHERS[] = {CLI_VOLUME,   CLI_SURFACE,       CLI_SLICE,
                                    CLI_BOUNDARY, CLI_INTERFACES,    CLI_POINTS,
                                    CLI_LINES,    CLI_COLOR_PATCHES, CLI_COLOR_LEVELS};
    tl_node node;
    if (!*scene->color || scene->had_things) return CLI_DONE;
    for (size_t i = 0; i < sizeof OTHERS / sizeof *OTHERS; i++)
        if (cli_get(scene->session, OTHERS[i])->given) return CLI_DONE;
    int failed = cli_scene_add(scene, TL_NODE_BOUNDARY, &node);
    return failed ? failed
                  : done(scene, tl_scene_move(scene->session->ctx, scene->volume.scene, node, 0));
}

int cli_scene_plan(cli_scene *scene)
{
    scene->had_things = has_things(scene->volume.scene);
    int failed = take_things(scene);
    if (!failed) failed = complete(scene);
    if (!failed && !has_things(scene->volume.scene)) return first_look(scene);
    if (!failed && !*scene->color && !scene->had_things) failed = choose_color(scene);
    return failed || !*scene->color ? failed : set_colors(scene);
}
