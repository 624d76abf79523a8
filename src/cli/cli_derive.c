/* Derived channels, thresholds, regions and planes: words that all verbs which look at a mesh
 * share. */
#include "cli_derive.h"

#include <math.h>
#include <string.h>

static const cli_option OPTIONS[] = {
    {CLI_DERIVE, 0, "derive", CLI_TYPE_LIST, "NAME=EXPRESSION", NULL, 0, 0,
     "add a channel, for instance 'w=mag(curl(U))', 'q=qcriterion(U)', 'e=p/(rho*T^2)', or "
     "'s=if(x > 0, U.x, -U[0])'. Operators + - * / ^ == != < <= > >= && || !, functions abs sqrt "
     "exp log log10 sin cos tan atan2 min max if vec mag norm dot cross grad div curl qcriterion, "
     "positions x y z, pi; odd names in quotes. May be given several times, in order"},
    {CLI_THRESHOLD, 0, "threshold", CLI_TYPE_LIST, "CHANNEL=LOW,HIGH", NULL, 0, 0,
     "keep tets all of whose corners have a value from LOW to HIGH (numbers or percent of the "
     "range; one may be left out), of a vector its length"},
    {CLI_REGIONS, 0, "regions", CLI_TYPE_LIST, "A,B", NULL, 0, 0,
     "keep the tets of these regions, by number or name"},
    {CLI_HIDE_REGIONS, 0, "hide-regions", CLI_TYPE_LIST, "A,B", NULL, 0, 0,
     "leave the tets of these regions out"},
    {CLI_CLIP, 0, "clip", CLI_TYPE_LIST, "PLANE", NULL, 0, 0,
     "cut away what lies beyond a plane: 'x<V' keeps what is below V (a number or percent of the "
     "box; also y and z), 'x>V' what is above; x=V and -x=V are the same without quotes; "
     "NX,NY,NZ,D keeps what has NX*x + NY*y + NZ*z <= D. Several planes keep what is on all sides"},
};
const cli_group cli_group_derive = {"Fields and parts", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

bool cli_derive_given(const cli_session *session)
{
    static const cli_id ids[] = {CLI_DERIVE, CLI_THRESHOLD, CLI_REGIONS, CLI_HIDE_REGIONS,
                                 CLI_CLIP};
    bool any = false;
    for (size_t i = 0; i < sizeof ids / sizeof *ids; i++)
        any = any || cli_get(session, ids[i])->given;
    return any;
}

typedef struct job {
    cli_session *session;
    tl_ctx *ctx;
    const tl_source_facts *facts;
    tl_view *view;
    tl_scene *scene;
} job;

static int done(const job *j, tl_status st)
{
    return st ? cli_fail(j->session, j->ctx, st) : CLI_DONE;
}

static tl_status add_text(const job *j, tl_node_kind kind, const char *prop, const char *text,
                          tl_node *node)
{
    tl_status st = tl_scene_add(j->ctx, j->scene, kind, node);
    const tl_value value = {.text = text};
    return st ? st : tl_scene_set(j->ctx, j->scene, *node, prop, &value);
}

/* ---- channels ---- */

/* NAME=EXPRESSION, which may have an = of its own. */
static int add_channel(const job *j, const char *text)
{
    tl_node node;
    const char *equals = strchr(text, '=');
    if (!equals || equals == text || (size_t)(equals - text) >= CLI_NAME_BYTES)
        return cli_misuse(j->session->args.verb, "--derive %s: expected NAME=EXPRESSION", text);
    return done(j, add_text(j, TL_NODE_DERIVE, "text", text, &node));
}

/* ---- thresholds ---- */

/* The range that percent are of. */
static tl_status range_of(const job *j, const char *name, double range[2])
{
    const tl_values *values;
    for (size_t c = 0; j->facts->is_model && c < j->facts->channel_count; c++)
        if (strcmp(j->facts->channels[c].name, name) == 0) {
            memcpy(range, j->facts->channels[c].range, 2 * sizeof *range);
            return TL_OK;
        }
    tl_status st = tl_view_values(j->ctx, j->view, j->scene, name, &values);
    if (st) return st;
    range[0] = values->least;
    range[1] = values->most;
    return TL_OK;
}

/* Nothing leaves the end open. */
static int set_end(const job *j, tl_node node, const char *prop, const char *text, size_t length,
                   const char *name)
{
    double value, range[2] = {0, 0};
    if (!length) return CLI_DONE;
    if (text[length - 1] == '%') {
        tl_status st = range_of(j, name, range);
        if (st) return cli_fail(j->session, j->ctx, st);
    }
    if (!cli_parse_part(text, length, range, &value))
        return cli_misuse(j->session->args.verb, "--threshold %s=%s: expected CHANNEL=LOW,HIGH",
                          name, text);
    /* an end at infinity is an open one */
    return isfinite(value) ? done(j, tl_scene_set_real(j->ctx, j->scene, node, prop, value))
                           : CLI_DONE;
}

static int add_threshold(const job *j, const char *text)
{
    char name[CLI_NAME_BYTES];
    const char *value, *comma = NULL;
    tl_node node;
    if (!cli_split_named(text, name, sizeof name, &value) || !(comma = strchr(value, ',')))
        return cli_misuse(j->session->args.verb, "--threshold %s: expected CHANNEL=LOW,HIGH", text);
    int failed = done(j, add_text(j, TL_NODE_THRESHOLD, "channel", name, &node));
    /* percent are of what there is without it */
    if (!failed) failed = done(j, tl_scene_set_flag(j->ctx, j->scene, node, "on", false));
    if (!failed) failed = set_end(j, node, "low", value, (size_t)(comma - value), name);
    if (!failed) failed = set_end(j, node, "high", comma + 1, strlen(comma + 1), name);
    return failed;
}

/* They come all at once: each is of the whole mesh. */
static int add_thresholds(const job *j)
{
    size_t count;
    int failed = CLI_DONE;
    const cli_value *ranges = cli_get(j->session, CLI_THRESHOLD);
    const size_t before = (tl_scene_nodes(j->scene, &count), count);
    for (size_t i = 0; !failed && i < ranges->item_count; i++)
        failed = add_threshold(j, ranges->items[i]);
    for (size_t i = before; !failed && i < before + ranges->item_count; i++)
        failed = done(j, tl_scene_set_flag(j->ctx, j->scene, tl_scene_nodes(j->scene, &count)[i],
                                           "on", true));
    return failed;
}

/* ---- regions ---- */

static int set_regions(const job *j, cli_id id, const char *prop)
{
    char list[TL_SCENE_TEXT_BYTES] = "";
    size_t at = 0;
    const cli_value *words = cli_get(j->session, id);
    for (size_t i = 0; i < words->item_count; i++) {
        at += (size_t)snprintf(list + at, sizeof list - at, "%s%s", at ? "," : "", words->items[i]);
        if (at >= sizeof list) return cli_misuse(j->session->args.verb, "--%s: too many", prop);
    }
    const tl_value value = {.text = list};
    return words->given ? done(j, tl_scene_set(j->ctx, j->scene, TL_NODE_DATA + 1, prop, &value))
                        : CLI_DONE;
}

/* ---- planes ---- */

/* "x<V", "x>V", "x=V", "-x=V": a point and the normal of the side that goes. */
static bool parse_axis(const char *text, const double bounds[6], double plane[6])
{
    bool minus = *text == '-';
    const char *sign = text + minus + 1;
    int axis = text[minus] - 'x';
    if (axis < 0 || axis > 2 || !*sign || !strchr("<>=", *sign) || (minus && *sign != '='))
        return false;
    plane[3 + axis] = minus || *sign == '>' ? -1 : 1;
    return cli_parse_part(sign + 1, strlen(sign + 1), bounds + 2 * axis, &plane[axis]) &&
           isfinite(plane[axis]);
}

/* NX,NY,NZ,D: the point lies on the axis that the normal is nearest to. */
static bool parse_normal(const char *text, double plane[6])
{
    double numbers[4];
    int axis = 0;
    if (!cli_parse_reals(text, numbers, 4)) return false;
    for (int k = 1; k < 3; k++)
        if (fabs(numbers[k]) > fabs(numbers[axis])) axis = k;
    for (int k = 0; k < 3; k++) plane[k] = 0;
    memcpy(plane + 3, numbers, 3 * sizeof *plane);
    if (numbers[axis] != 0) plane[axis] = numbers[3] / numbers[axis];
    return numbers[axis] != 0 && isfinite(plane[axis]);
}

static int add_plane(const job *j, const char *text)
{
    tl_node node;
    double plane[6] = {0}, numbers[4];
    if (cli_parse_reals(text, numbers, 4) && numbers[0] == 0 && numbers[1] == 0 && numbers[2] == 0)
        return cli_misuse(j->session->args.verb, "--clip %s: expected a normal with a length",
                          text);
    if (!parse_axis(text, j->facts->bounds, plane) && !parse_normal(text, plane))
        return cli_misuse(j->session->args.verb,
                          "--clip %s: expected x<V, x>V, x=V, -x=V (or y, z) or NX,NY,NZ,D", text);
    tl_status st = tl_scene_add(j->ctx, j->scene, TL_NODE_CLIP, &node);
    if (!st) st = tl_scene_set_reals(j->ctx, j->scene, node, "plane", plane, 6);
    return done(j, st);
}

/* ---- all of it ---- */

int cli_derive(cli_session *session, const tl_source *source, tl_view *view, tl_scene *scene)
{
    const job j = {session, session->ctx, tl_source_get_facts(source), view, scene};
    const cli_value *derived = cli_get(session, CLI_DERIVE), *planes = cli_get(session, CLI_CLIP);
    int failed = CLI_DONE;
    for (size_t i = 0; !failed && i < derived->item_count; i++)
        failed = add_channel(&j, derived->items[i]);
    if (!failed) failed = add_thresholds(&j);
    if (!failed) failed = set_regions(&j, CLI_REGIONS, "regions");
    if (!failed) failed = set_regions(&j, CLI_HIDE_REGIONS, "hide_regions");
    for (size_t i = 0; !failed && i < planes->item_count; i++)
        failed = add_plane(&j, planes->items[i]);
    return failed;
}
