/* tetralod surface: isosurfaces and plane cuts of a model or a file, as triangles in a file. */
#include <math.h>
#include <string.h>

#include "cli_volume.h"

static const cli_option OPTIONS[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_TEXT, "OUT", NULL, 0, 0,
     "the file to write: .ply, .vtp, .stl, .obj or .glb; required"},
    {CLI_VALUE, 0, "value", CLI_TYPE_LIST, "[CHANNEL=]V[%]", NULL, 0, 0,
     "isosurface of a channel at a value, or at a part of its range; of a vector its length. May "
     "be "
     "given several times for one channel, which need not be named if there is but one"},
    {CLI_PLANE, 0, "plane", CLI_TYPE_TEXT, "X,Y,Z,NX,NY,NZ", NULL, 0, 0,
     "the cut with the plane through a point, with a normal"},
    {CLI_CHANNELS, 0, "channels", CLI_TYPE_LIST, "A,B", NULL, 0, 0,
     "carry these channels along; without it all on vertices"},
    {CLI_NO_NORMALS, 0, "no-normals", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "leave out the normals, which are those of the channel's gradient"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

typedef struct request {
    const tl_mesh *mesh;
    double values[CLI_LIST_MAX];
    size_t value_count;
    double plane[6];
    const tl_channel *channel; /* of the values */
    const double *scalar;      /* [vert_count] that is sliced */
    double *own;               /* scalar where it is no channel */
    double *gradients;         /* of it, or NULL */
    size_t *carried;
    size_t carried_count;
} request;

static int check_words(const cli_session *session)
{
    const cli_verb *verb = session->args.verb;
    const char *out = cli_get(session, CLI_OUTPUT)->text;
    bool value = cli_get(session, CLI_VALUE)->given, plane = cli_get(session, CLI_PLANE)->given;
    if (!cli_get(session, CLI_OUTPUT)->given) return cli_misuse(verb, "-o OUT is missing");
    if (value == plane)
        return cli_misuse(verb, "say --value CHANNEL=V or --plane X,Y,Z,NX,NY,NZ%s",
                          value ? ", not both" : "");
    return cli_output_folder(out);
}

/* ---- values ---- */

static const tl_channel *only_channel(const tl_mesh *mesh)
{
    const tl_channel *found = NULL;
    for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
        const tl_channel *channel = tl_mesh_channel(mesh, c);
        if (channel->on == TL_ON_VERTEX && found) return NULL;
        if (channel->on == TL_ON_VERTEX) found = channel;
    }
    return found;
}

static int set_values(const cli_session *session, request *r)
{
    const cli_value *list = cli_get(session, CLI_VALUE);
    for (size_t i = 0; i < list->item_count; i++) {
        char name[CLI_NAME_BYTES] = "";
        const char *text = list->items[i];
        double value, range[2];
        size_t length;
        bool named = cli_split_named(list->items[i], name, sizeof name, &text);
        const tl_channel *channel =
            named ? cli_vertex_channel(r->mesh, name) : only_channel(r->mesh);
        if (!channel && named) return cli_unknown_channel(session, r->mesh, name);
        if (!channel)
            return cli_misuse(session->args.verb, "--value %s: of which channel? CHANNEL=VALUE",
                              list->items[i]);
        if (r->channel && channel != r->channel)
            return cli_misuse(session->args.verb,
                              "--value: one channel at a time, not '%s' and '%s'",
                              cli_name(r->channel->name).s, cli_name(channel->name).s);
        r->channel = channel;
        length = strlen(text);
        bool percent = length && text[length - 1] == '%';
        char number[64] = "";
        snprintf(number, sizeof number, "%.*s", (int)(length - percent), text);
        if (!cli_parse_real(number, &value) || !isfinite(value))
            return cli_misuse(session->args.verb,
                              "--value %s: expected CHANNEL=VALUE or CHANNEL=P%%", list->items[i]);
        tl_channel_range(channel, tl_mesh_vert_count(r->mesh), range, NULL);
        r->values[r->value_count++] =
            percent ? range[0] + value / 100 * (range[1] - range[0]) : value;
    }
    return CLI_DONE;
}

static int set_plane(const cli_session *session, request *r)
{
    const char *text = cli_get(session, CLI_PLANE)->text;
    r->value_count = 1;
    r->values[0] = 0;
    if (cli_parse_reals(text, r->plane, 6)) return CLI_DONE;
    return cli_misuse(session->args.verb, "--plane %s: expected X,Y,Z,NX,NY,NZ", text);
}

static tl_status make_scalar(cli_session *session, request *r)
{
    tl_status st = TL_OK;
    size_t count = tl_mesh_vert_count(r->mesh);
    if (r->channel) {
        st = cli_volume_scalar(session->ctx, r->channel, count, &r->own, &r->scalar);
    } else {
        r->scalar = r->own = tl_mem_alloc(session->ctx, count, sizeof *r->own, &st);
        if (!st) st = tl_plane_distance(session->ctx, r->mesh, r->plane, r->plane + 3, r->own);
    }
    if (st || cli_get(session, CLI_NO_NORMALS)->given) return st;
    tl_channel scalar = {.name = "scalar", .components = 1, .values = r->scalar};
    r->gradients = tl_mem_alloc(session->ctx, count, 3 * sizeof *r->gradients, &st);
    return st ? st : tl_mesh_gradient(session->ctx, r->mesh, &scalar, r->gradients);
}

/* ---- summaries ---- */

typedef struct outcome {
    const tl_polydata *surface;
    double area;
    bool closed;
    double slice_seconds, write_seconds;
} outcome;

static void print_json(const cli_session *session, const cli_volume *volume, const request *r,
                       const outcome *o)
{
    json_t *object = json_object();
    cli_json_text(object, "file", cli_get(session, CLI_OUTPUT)->text);
    cli_json_count(object, "triangles", o->surface->cell_count);
    cli_json_count(object, "vertices", o->surface->vert_count);
    cli_json_real(object, "area", o->area);
    cli_json_flag(object, "closed", o->closed);
    if (r->channel) {
        cli_json_text(object, "channel", r->channel->name);
        cli_json_reals(object, "values", r->values, r->value_count);
    }
    cli_json_volume(cli_json_object(object, "volume"), volume);
    cli_json_real(object, "seconds", o->slice_seconds);
    cli_json_real(object, "read_seconds", volume->seconds);
    cli_json_real(object, "write_seconds", o->write_seconds);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

static void print_text(cli_session *session, const cli_volume *volume, const outcome *o)
{
    const char *path = cli_get(session, CLI_OUTPUT)->text;
    cli_print_volume(session, volume);
    printf("surface     %s triangles, %s vertices, area %s, %s (%s)\n",
           cli_count(o->surface->cell_count).s, cli_count(o->surface->vert_count).s,
           cli_real(o->area).s,
           !o->surface->cell_count ? "empty: nothing has that value"
           : o->closed             ? "closed"
                                   : "with a border",
           cli_seconds(o->slice_seconds).s);
    cli_print_notes(session);
    printf("wrote       %s (%s, %s)\n", path, cli_bytes((double)cli_file_bytes(path)).s,
           cli_seconds(o->write_seconds).s);
}

/* ---- the verb ---- */

static tl_status slice(cli_session *session, request *r, tl_polydata **surface, outcome *o)
{
    tl_slice_opts opts = tl_slice_opts_defaults();
    double start = cli_now();
    tl_status st = make_scalar(session, r);
    opts.values = r->values;
    opts.value_count = r->value_count;
    opts.gradients = r->gradients;
    opts.channels = r->carried;
    opts.channel_count = r->carried_count;
    if (!st) st = tl_slice_mesh(session->ctx, r->mesh, r->scalar, &opts, surface);
    o->slice_seconds = cli_now() - start;
    if (!st) st = tl_polydata_closed(session->ctx, *surface, &o->closed);
    if (!st) o->area = tl_polydata_size(*surface);
    o->surface = *surface;
    return st;
}

static int make_surface(cli_session *session, const cli_volume *volume, request *r)
{
    tl_polydata *surface = NULL;
    outcome o = {0};
    int failed =
        cli_get(session, CLI_PLANE)->given ? set_plane(session, r) : set_values(session, r);
    if (!failed) failed = cli_carried(session, r->mesh, &r->carried, &r->carried_count);
    if (failed) return failed;
    tl_status st = slice(session, r, &surface, &o);
    double start = cli_now();
    if (!st) st = tl_polydata_write(session->ctx, surface, cli_get(session, CLI_OUTPUT)->text);
    o.write_seconds = cli_now() - start;
    cli_progress_clear(&session->progress);
    if (st)
        failed = cli_fail(session, session->ctx, st);
    else if (cli_get(session, CLI_JSON)->given)
        print_json(session, volume, r, &o);
    else if (cli_loud(session))
        print_text(session, volume, &o);
    tl_polydata_destroy(session->ctx, surface);
    return failed;
}

static int run(cli_session *session)
{
    cli_volume volume;
    int exit_status = check_words(session);
    if (!exit_status) exit_status = cli_volume_open(session, session->args.operands[0], &volume);
    if (exit_status) return exit_status;
    request r = {.mesh = volume.input.mesh};
    exit_status = make_surface(session, &volume, &r);
    tl_mem_free(session->ctx, r.carried);
    tl_mem_free(session->ctx, r.gradients);
    tl_mem_free(session->ctx, r.own);
    cli_volume_close(session, &volume);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod surface flow.tlod -o shock.ply --value density=1.4",
    "The isosurface of the finest mesh, with all channels on it",
    "tetralod surface flow.tlod -o shells.glb --value 20% --value 50% --value 80% --error 1%",
    "Three surfaces of the only channel, from a mesh with an error of 1 %",
    "tetralod surface wing.vtu -o middle.vtp --plane 0,0,0,0,1,0 --channels pressure",
    "A plane cut that carries one channel",
    NULL};

const cli_verb cli_verb_surface = {
    .name = "surface",
    .operands = "IN -o OUT (--value [CHANNEL=]V | --plane X,Y,Z,NX,NY,NZ)",
    .operand_least = 1,
    .operand_most = 1,
    .about = "isosurfaces and plane cuts as triangles",
    .details = "IN is a model or any file that 'tetralod formats' lists. Triangles look to lower "
               "values, and so do the normals. In JSON closed tells whether every edge has two "
               "triangles; seconds is the slicing alone, gradients included.",
    .groups = {&GROUP, &cli_group_detail, &cli_group_derive, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
