/* tetralod points: points on isosurfaces of a model or a file, in a file. */
#include <math.h>
#include <string.h>

#include "cli_polydata.h"

static const cli_option OPTIONS[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "OUT", NULL, 0, 0,
     "the file to write: .ply, .vtp, .obj or .glb; required"},
    {CLI_CHANNEL, 0, "channel", CLI_TYPE_TEXT, "NAME", NULL, 0, 0,
     "the channel whose isosurfaces have the points, of a vector its length; without it the first "
     "one"},
    {CLI_COUNT, 0, "count", CLI_TYPE_COUNT, "N", "200000", 1, 4294967294.0, "about so many points"},
    {CLI_AREA, 0, "area", CLI_TYPE_REAL, "A", NULL, 2.2250738585072014e-308, 1.7e308,
     "in place of --count: the area of isosurface that has one point, in mesh units squared; of "
     "all values that times the distance of values between isosurfaces with so many points. Equal "
     "tets of several files then have equal points"},
    {CLI_VALUES, 0, "values", CLI_TYPE_LIST, "V[%],V[%]...", NULL, 0, 0,
     "isosurfaces at these values or parts of the range; without it at all values, each "
     "point on its own isosurface"},
    {CLI_SHELLS, 0, "shells", CLI_TYPE_COUNT, "N", NULL, 1, TL_SLICE_VALUES_MAX,
     "N isosurfaces, at values equally far from each other"},
    {CLI_RANGE, 0, "range", CLI_TYPE_TEXT, "LOW,HIGH", NULL, 0, 0,
     "only values from LOW to HIGH (numbers or percent of the range), also for --shells"},
    {CLI_SEED, 0, "seed", CLI_TYPE_COUNT, "N", "0", 0, 0, "seed of other points"},
    {CLI_CHANNELS, 0, "channels", CLI_TYPE_LIST, "A,B", NULL, 0, 0,
     "carry these channels along; without it all on vertices"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

typedef struct request {
    const tl_mesh *mesh;
    const tl_channel *channel;
    const double *scalar; /* [vert_count] of it */
    double *own;          /* the same where it is no channel */
    double values[TL_SLICE_VALUES_MAX];
    size_t *carried;
    tl_points_opts opts;
} request;

static int check_words(const cli_session *session)
{
    int failed = cli_polydata_output(session, TL_POLY_POINTS, ".ply, .vtp, .obj or .glb");
    if (!failed && cli_get(session, CLI_VALUES)->given &&
        (cli_get(session, CLI_SHELLS)->given || cli_get(session, CLI_RANGE)->given))
        return cli_misuse(session->args.verb, "--values goes with neither --shells nor --range");
    return failed;
}

/* ---- values ---- */

static int set_channel(cli_session *session, request *r, double range[2])
{
    const char *name = cli_get(session, CLI_CHANNEL)->text;
    for (size_t c = 0; !name && !r->channel && c < tl_mesh_channel_count(r->mesh); c++)
        if (tl_mesh_channel(r->mesh, c)->on == TL_ON_VERTEX)
            r->channel = tl_mesh_channel(r->mesh, c);
    if (name) r->channel = cli_vertex_channel(r->mesh, name);
    if (!r->channel) return cli_unknown_channel(session, r->mesh, name ? name : "");
    size_t count = tl_mesh_vert_count(r->mesh);
    tl_channel_range(r->channel, count, range, NULL);
    tl_status st = cli_volume_scalar(session->ctx, r->channel, count, &r->own, &r->scalar);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

static int add_values(const cli_session *session, request *r, const char *text,
                      const double range[2])
{
    while (*text) {
        size_t length = strcspn(text, ",");
        if (r->opts.value_count == TL_SLICE_VALUES_MAX)
            return cli_misuse(session->args.verb, "--values: at most %u", TL_SLICE_VALUES_MAX);
        if (!cli_parse_part(text, length, range, &r->values[r->opts.value_count++]))
            return cli_misuse(session->args.verb, "--values %s: expected V,V or V%%,V%%", text);
        text += length + (text[length] == ',');
    }
    return CLI_DONE;
}

static int set_values(cli_session *session, request *r)
{
    double range[2];
    int failed = set_channel(session, r, range);
    const cli_value *values = cli_get(session, CLI_VALUES), *shells = cli_get(session, CLI_SHELLS);
    const char *part = cli_get(session, CLI_RANGE)->text, *comma = part ? strchr(part, ',') : NULL;
    for (size_t i = 0; !failed && i < values->item_count; i++)
        failed = add_values(session, r, values->items[i], range);
    if (!failed && part) {
        double ends[2];
        if (!comma || !cli_parse_part(part, (size_t)(comma - part), range, &ends[0]) ||
            !cli_parse_part(comma + 1, strlen(comma + 1), range, &ends[1]) || !(ends[0] < ends[1]))
            return cli_misuse(session->args.verb, "--range %s: expected LOW,HIGH", part);
        r->opts.low = range[0] = ends[0];
        r->opts.high = range[1] = ends[1];
    }
    if (!failed && shells->given) {
        r->opts.value_count = shells->count;
        cli_middles(range, shells->count, r->values);
    }
    r->opts.values = r->values;
    return failed;
}

/* ---- summaries ---- */

typedef struct outcome {
    size_t points;
    double area, seconds, write_seconds;
} outcome;

static void print_json(const cli_session *session, const cli_volume *volume, const request *r,
                       const outcome *o)
{
    json_t *object = json_object();
    cli_json_text(object, "file", cli_get(session, CLI_OUTPUT)->text);
    cli_json_count(object, "points", o->points);
    cli_json_text(object, "channel", r->channel->name);
    cli_json_reals(object, "values", r->values, r->opts.value_count);
    cli_json_real(object, "area_of_a_point", o->area);
    cli_polydata_json(object, session, volume, o->seconds, o->write_seconds);
}

static void print_text(cli_session *session, const cli_volume *volume, const request *r,
                       const outcome *o)
{
    cli_print_volume(session, volume);
    printf("points      %s on ", cli_count(o->points).s);
    if (r->opts.value_count)
        printf("%s isosurfaces", cli_count(r->opts.value_count).s);
    else
        printf("all isosurfaces");
    printf(" of %s, one for an area of %s (%s)\n", cli_name(r->channel->name).s,
           cli_real(o->area).s, cli_seconds(o->seconds).s);
    cli_polydata_print(session, o->write_seconds);
}

/* ---- the verb ---- */

static int make_points(cli_session *session, const cli_volume *volume, request *r)
{
    outcome o = {0};
    tl_polydata *points = NULL;
    int failed = set_values(session, r);
    if (!failed) failed = cli_carried(session, r->mesh, &r->carried, &r->opts.channel_count);
    if (failed) return failed;
    const cli_value *area = cli_get(session, CLI_AREA);
    r->opts.channels = r->carried;
    r->opts.count = cli_get(session, CLI_COUNT)->count;
    r->opts.seed = cli_get(session, CLI_SEED)->count;
    if (area->given) r->opts.area = area->real;
    double start = cli_now();
    tl_status st = tl_slice_points(session->ctx, r->mesh, r->scalar, &r->opts, &o.area, &points);
    o.seconds = cli_now() - start;
    if (!st) st = cli_polydata_save(session, points, &o.write_seconds);
    o.points = st ? 0 : points->vert_count;
    tl_polydata_destroy(session->ctx, points);
    cli_progress_clear(&session->progress);
    if (st) return cli_fail(session, session->ctx, st);
    if (cli_get(session, CLI_JSON)->given)
        print_json(session, volume, r, &o);
    else if (cli_loud(session))
        print_text(session, volume, r, &o);
    return CLI_DONE;
}

static int run(cli_session *session)
{
    cli_volume volume;
    int exit_status = check_words(session);
    if (!exit_status) exit_status = cli_volume_open(session, session->args.operands[0], &volume);
    if (exit_status) return exit_status;
    request r = {.mesh = volume.mesh, .opts = tl_points_opts_defaults()};
    exit_status = make_points(session, &volume, &r);
    tl_mem_free(session->ctx, r.carried);
    tl_mem_free(session->ctx, r.own);
    cli_volume_close(session, &volume);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod points flow.tlod -o flow.ply --channel density",
    "200,000 points where the density changes, the denser the faster it does",
    "tetralod points flow.tlod -o shells.vtp --shells 12 --range 20%,90% --count 1000000",
    "A million points on twelve isosurfaces of the first channel",
    "tetralod points wing.vtu -o swirl.ply --derive 'q=qcriterion(U)' --channel q --values 5,50",
    "Points on two isosurfaces of a derived channel",
    NULL};

const cli_verb cli_verb_points = {
    .name = "points",
    .operands = "IN -o OUT",
    .operand_least = 1,
    .operand_most = 1,
    .about = "points spread over isosurfaces",
    .details =
        "IN is a model or any file that 'tetralod formats' lists. Points lie on isosurfaces, "
        "each with the same area, and have the normals of these, which look to lower "
        "values. The points of a tet follow from the places of its corners, --area and "
        "--seed alone.",
    .groups = {&GROUP, &cli_group_detail, &cli_group_derive, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
