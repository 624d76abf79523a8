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

bool cli_derive_chooses(const cli_session *session)
{
    static const cli_id ids[] = {CLI_THRESHOLD, CLI_REGIONS, CLI_HIDE_REGIONS, CLI_CLIP};
    bool any = false;
    for (size_t i = 0; i < sizeof ids / sizeof *ids; i++)
        any = any || cli_get(session, ids[i])->given;
    return any;
}

bool cli_derive_given(const cli_session *session)
{
    return cli_get(session, CLI_DERIVE)->given || cli_derive_chooses(session);
}

static void list_channels(const tl_mesh *mesh)
{
    fputs("  channels:", stderr);
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        fprintf(stderr, " '%s'%s", cli_name(channel->name).s,
                channel->on == TL_ON_TET ? " (on tets)" : "");
    }
    fputs(tl_mesh_channel_count(mesh) ? "\n" : " none\n", stderr);
}

/* ---- channels ---- */

/* NAME=EXPRESSION, which may have an = of its own. */
static int add_channel(cli_session *session, tl_mesh *mesh, const char *text)
{
    char name[CLI_NAME_BYTES];
    const char *equals = strchr(text, '=');
    if (!equals || equals == text || (size_t)(equals - text) >= sizeof name)
        return cli_misuse(session->args.verb, "--derive %s: expected NAME=EXPRESSION", text);
    memcpy(name, text, (size_t)(equals - text));
    name[equals - text] = '\0';
    tl_status st = tl_mesh_derive(session->ctx, mesh, name, equals + 1);
    if (!st) return CLI_DONE;
    tl_note(session->ctx, st, "in --derive '%s'", cli_name(name).s);
    int failed = cli_fail(session, session->ctx, st);
    if (failed == CLI_WRONG_USE) list_channels(mesh);
    return failed;
}

/* ---- thresholds ---- */

/* Nothing leaves *value as it is. */
static bool parse_end(const char *text, size_t length, const double range[2], double *value)
{
    return !length || cli_parse_part(text, length, range, value);
}

static int keep_range(cli_session *session, const tl_mesh *mesh, const char *text, uint8_t *keep)
{
    char name[CLI_NAME_BYTES];
    double range[2], low = -(double)INFINITY, high = (double)INFINITY;
    const char *value, *comma = NULL;
    if (!cli_split_named(text, name, sizeof name, &value) || !(comma = strchr(value, ',')))
        return cli_misuse(session->args.verb, "--threshold %s: expected CHANNEL=LOW,HIGH", text);
    const tl_channel *channel = tl_mesh_channel_by_name(mesh, name);
    if (!channel) {
        cli_misuse(session->args.verb, "--threshold: there is no channel '%s'", name);
        list_channels(mesh);
        return CLI_WRONG_USE;
    }
    tl_channel_range(channel, cli_channel_elems(mesh, channel), range, NULL);
    if (!parse_end(value, (size_t)(comma - value), range, &low) ||
        !parse_end(comma + 1, strlen(comma + 1), range, &high))
        return cli_misuse(session->args.verb, "--threshold %s: expected CHANNEL=LOW,HIGH", text);
    tl_status st = tl_keep_range(session->ctx, mesh, channel, low, high, false, keep);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* ---- regions ---- */

static bool has_region(const tl_mesh *mesh, int32_t region)
{
    const int32_t *regions = tl_mesh_regions(mesh);
    if (!regions) return region == 0;
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++)
        if (regions[t] == region) return true;
    return false;
}

/* By number, or by the name of one that tets have. */
static bool find_region(const tl_mesh *mesh, const char *text, int32_t *region)
{
    double number;
    const int32_t *regions = tl_mesh_regions(mesh);
    if (cli_parse_real(text, &number) && number >= INT32_MIN && number <= INT32_MAX &&
        number == floor(number)) {
        *region = (int32_t)number;
        return has_region(mesh, *region);
    }
    int32_t last = 0;
    for (size_t t = 0; regions && t < tl_mesh_tet_count(mesh); t++) {
        if (t && regions[t] == last) continue;
        last = regions[t];
        const char *name = tl_mesh_region_name(mesh, last);
        if (name && strcmp(name, text) == 0) {
            *region = last;
            return true;
        }
    }
    return false;
}

/* Those that tets have, each when it first comes up. */
static void list_regions(const tl_mesh *mesh)
{
    int32_t seen[CLI_LIST_MAX];
    size_t count = 0;
    const int32_t *regions = tl_mesh_regions(mesh);
    fputs("  regions:", stderr);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh) && count < CLI_LIST_MAX; t++) {
        int32_t region = regions ? regions[t] : 0;
        size_t i = 0;
        while (i < count && seen[i] != region) i++;
        if (i < count) continue;
        const char *name = tl_mesh_region_name(mesh, region);
        seen[count++] = region;
        fprintf(stderr, " %d", (int)region);
        if (name) fprintf(stderr, " '%s'", cli_name(name).s);
    }
    fputs(count == CLI_LIST_MAX ? " ...\n" : "\n", stderr);
}

static int keep_regions(cli_session *session, const tl_mesh *mesh, cli_id id, uint8_t *keep)
{
    int32_t regions[CLI_LIST_MAX];
    size_t count = 0;
    bool hide = id == CLI_HIDE_REGIONS;
    const cli_value *list = cli_get(session, id);
    for (size_t i = 0; i < list->item_count; i++)
        for (const char *at = list->items[i]; *at;) {
            char name[CLI_NAME_BYTES];
            size_t length = strcspn(at, ",");
            snprintf(name, sizeof name, "%.*s", (int)length, at);
            at += length + (at[length] == ',');
            if (count == CLI_LIST_MAX)
                return cli_misuse(session->args.verb, "more than %d regions", CLI_LIST_MAX);
            if (find_region(mesh, name, &regions[count++])) continue;
            cli_misuse(session->args.verb, "--%sregions: there is no region '%s'",
                       hide ? "hide-" : "", name);
            list_regions(mesh);
            return CLI_WRONG_USE;
        }
    tl_status st = tl_keep_regions(session->ctx, mesh, regions, count, hide, keep);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* ---- planes ---- */

/* "x<V", "x>V", "x=V", "-x=V". */
static bool parse_axis(const char *text, const double bounds[6], tl_half_space *side)
{
    bool minus = *text == '-';
    const char *sign = text + minus + 1;
    int axis = text[minus] - 'x';
    if (axis < 0 || axis > 2 || !*sign || !strchr("<>=", *sign) || (minus && *sign != '='))
        return false;
    double value = NAN, direction = minus || *sign == '>' ? -1 : 1;
    if (!cli_parse_part(sign + 1, strlen(sign + 1), bounds + 2 * axis, &value)) return false;
    side->normal[axis] = direction;
    side->offset = direction * value;
    return isfinite(value);
}

static int add_side(const cli_session *session, const char *text, const double bounds[6],
                    tl_half_space *side)
{
    double numbers[4];
    *side = (tl_half_space){{0, 0, 0}, 0};
    if (parse_axis(text, bounds, side)) return CLI_DONE;
    if (!cli_parse_reals(text, numbers, 4))
        return cli_misuse(session->args.verb,
                          "--clip %s: expected x<V, x>V, x=V, -x=V (or y, z) or NX,NY,NZ,D", text);
    memcpy(side->normal, numbers, sizeof side->normal);
    side->offset = numbers[3];
    return CLI_DONE;
}

/* ---- all of it ---- */

/* Puts a mesh into the place of another one. */
static void replace(tl_mesh **mesh, tl_mesh *other)
{
    tl_mesh_destroy(*mesh);
    *mesh = other;
}

static int choose_tets(cli_session *session, tl_mesh **mesh)
{
    tl_status st = TL_OK;
    int failed = CLI_DONE;
    tl_mesh *subset = NULL;
    const cli_value *ranges = cli_get(session, CLI_THRESHOLD);
    bool regions = cli_get(session, CLI_REGIONS)->given;
    bool hidden = cli_get(session, CLI_HIDE_REGIONS)->given;
    if (!ranges->given && !regions && !hidden) return CLI_DONE;
    size_t count = tl_mesh_tet_count(*mesh);
    uint8_t *keep = tl_mem_alloc(session->ctx, count, 1, &st);
    if (st) return cli_fail(session, session->ctx, st);
    memset(keep, 1, count);
    if (regions) failed = keep_regions(session, *mesh, CLI_REGIONS, keep);
    if (!failed && hidden) failed = keep_regions(session, *mesh, CLI_HIDE_REGIONS, keep);
    for (size_t i = 0; !failed && i < ranges->item_count; i++)
        failed = keep_range(session, *mesh, ranges->items[i], keep);
    if (!failed) st = tl_mesh_subset(session->ctx, *mesh, keep, &subset);
    if (!failed && st) failed = cli_fail(session, session->ctx, st);
    if (!failed) replace(mesh, subset);
    tl_mem_free(session->ctx, keep);
    return failed;
}

static int clip(cli_session *session, const double bounds[6], tl_mesh **mesh)
{
    tl_half_space sides[CLI_LIST_MAX];
    tl_mesh *clipped = NULL;
    const cli_value *planes = cli_get(session, CLI_CLIP);
    if (!planes->given) return CLI_DONE;
    for (size_t i = 0; i < planes->item_count; i++) {
        int failed = add_side(session, planes->items[i], bounds, &sides[i]);
        if (failed) return failed;
    }
    tl_status st = tl_mesh_clip(session->ctx, *mesh, sides, planes->item_count, &clipped);
    if (st) return cli_fail(session, session->ctx, st);
    replace(mesh, clipped);
    return CLI_DONE;
}

int cli_derive(cli_session *session, const double bounds[6], tl_mesh **mesh)
{
    const cli_value *derived = cli_get(session, CLI_DERIVE);
    int failed = CLI_DONE;
    for (size_t i = 0; !failed && i < derived->item_count; i++)
        failed = add_channel(session, *mesh, derived->items[i]);
    if (!failed) failed = choose_tets(session, mesh);
    if (!failed) failed = clip(session, bounds, mesh);
    if (failed || !cli_derive_chooses(session) || tl_mesh_tet_count(*mesh)) return failed;
    fprintf(stderr, "tetralod: nothing is left of the mesh by --threshold, --regions, "
                    "--hide-regions or --clip\n");
    return CLI_FAILED;
}
