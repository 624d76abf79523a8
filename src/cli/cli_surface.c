/* tetralod surface: isosurfaces, plane cuts and faces of regions of a model or a file, as
 * triangles. A model is cut where the surface is and sliced patch by patch, a file as a whole. */
#include <math.h>
#include <string.h>

#include "cli_camera.h"
#include "cli_polydata.h"
#include "cli_visible.h"

static const cli_option OPTIONS[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "OUT", NULL, 0, 0,
     "the file to write: .ply, .vtp, .stl, .obj or .glb; required"},
    {CLI_VALUE, 0, "value", CLI_TYPE_LIST, "[CHANNEL=]V[%]", NULL, 0, 0,
     "isosurface of a channel at a value, or at a part of its range; of a vector its length. May "
     "be given several times for one channel, which need not be named if there is but one"},
    {CLI_PLANE, 0, "plane", CLI_TYPE_TEXT, "X,Y,Z,NX,NY,NZ", NULL, 0, 0,
     "the cut with the plane through a point, with a normal"},
    {CLI_INTERFACES, 0, "interfaces", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the surfaces between regions, each once, with the regions on both sides as channels"},
    {CLI_BOUNDARY, 0, "boundary", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the boundary; with --interfaces both, so that the surface of each region is closed"},
    {CLI_CHANNELS, 0, "channels", CLI_TYPE_LIST, "A,B", NULL, 0, 0,
     "carry these channels along; without it all on vertices"},
    {CLI_NO_NORMALS, 0, "no-normals", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "leave out the normals, which are those of the channel's gradient, or of the boundary"},
};
static const cli_option SEEN[] = {
    {CLI_VIEW, 0, "view", CLI_TYPE_TEXT, "AZ,EL[,ZOOM]", "30,20,1.2", 0, 0,
     "of a model: for a picture as of 'render', in which --error Npx counts; what is out of view "
     "may be coarse"},
    {CLI_CAMERA, 0, "camera", CLI_TYPE_INPUT, "CAMERA.json", NULL, 0, 0,
     "of a model: the same with a camera as VTK names it"},
    {CLI_PICTURE_SIZE, 0, "size", CLI_TYPE_TEXT, "WxH", "1280x960", 0, 0, "pixels of that picture"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};
static const cli_group SEEN_GROUP = {"View", SEEN, sizeof SEEN / sizeof *SEEN};

typedef struct request {
    cli_volume *volume;
    bool by_patch; /* of a model: no mesh is made of it */
    double values[CLI_LIST_MAX];
    size_t value_count;
    double plane[6];
    bool has_faces;   /* the boundary or interfaces, neither values nor a plane */
    uint32_t channel; /* of the values, in the model or mesh; TL_NONE: the plane or faces */
    uint32_t *carried;
    size_t carried_count;
    tl_camera camera;
    bool has_view;
    float *opacity; /* of a model: the values' bins, or NULL */
} request;

static bool has_faces(const cli_session *session)
{
    return cli_get(session, CLI_INTERFACES)->given || cli_get(session, CLI_BOUNDARY)->given;
}

static int check_words(const cli_session *session)
{
    const bool value = cli_get(session, CLI_VALUE)->given;
    const bool plane = cli_get(session, CLI_PLANE)->given, faces = has_faces(session);
    int failed = cli_polydata_output(session, TL_POLY_TRIANGLES, ".ply, .vtp, .stl, .obj or .glb");
    if (!failed && value + plane + faces != 1)
        return cli_misuse(session->args.verb,
                          "say --value CHANNEL=V, --plane X,Y,Z,NX,NY,NZ or --interfaces "
                          "(--boundary)%s",
                          value + plane + faces ? ", one of them" : "");
    return failed;
}

/* ---- channels of a model's step, or of a mesh ---- */

typedef struct field {
    const char *name;
    uint32_t components;
    double range[2]; /* of its lengths */
} field;

static uint32_t field_count(const request *r)
{
    const cli_volume *v = r->volume;
    return r->by_patch ? v->head->channel_count : (uint32_t)tl_mesh_channel_count(v->mesh);
}

/* False for a channel that is not on vertices, or of another step. */
static bool is_field(const request *r, uint32_t c, const char **name)
{
    const cli_volume *v = r->volume;
    if (!r->by_patch) {
        *name = tl_mesh_channel(v->mesh, c)->name;
        return tl_mesh_channel(v->mesh, c)->on == TL_ON_VERTEX;
    }
    *name = v->head->channels[c].name;
    return v->head->channels[c].on == TL_ON_VERTEX && cli_in_step(&v->head->channels[c], &v->step);
}

static const char *field_name(const request *r, uint32_t c)
{
    const char *name;
    is_field(r, c, &name);
    return name;
}

/* The field of that name, or of no name the only one; TL_NONE if there is none. */
static uint32_t find_field(const request *r, const char *wanted)
{
    uint32_t found = TL_NONE;
    for (uint32_t c = 0; c < field_count(r); c++) {
        const char *name;
        if (!is_field(r, c, &name) || (*wanted && strcmp(name, wanted) != 0)) continue;
        if (*wanted) return c;
        if (found != TL_NONE) return TL_NONE;
        found = c;
    }
    return found;
}

static int unknown_field(const cli_session *session, const request *r, const char *name)
{
    const cli_volume *v = r->volume;
    return r->by_patch ? cli_unknown_in_model(session, v->head, &v->step, name)
                       : cli_unknown_channel(session, v->mesh, name);
}

/* Of a model as it has it, whatever was decoded. */
static void field_range(const request *r, uint32_t c, double range[2])
{
    const cli_volume *v = r->volume;
    const uint32_t own = r->by_patch ? c : cli_volume_channel(v, field_name(r, c));
    if (own != TL_NONE)
        memcpy(range, v->head->channels[own].range, 2 * sizeof *range);
    else
        tl_channel_range(tl_mesh_channel(v->mesh, c), tl_mesh_vert_count(v->mesh), range, NULL);
}

/* ---- what is asked for ---- */

static int set_values(const cli_session *session, request *r)
{
    const cli_value *list = cli_get(session, CLI_VALUE);
    for (size_t i = 0; i < list->item_count; i++) {
        char name[CLI_NAME_BYTES] = "";
        const char *text = list->items[i];
        double range[2], *value = &r->values[r->value_count];
        cli_split_named(list->items[i], name, sizeof name, &text);
        uint32_t c = find_field(r, name);
        if (c == TL_NONE && *name) return unknown_field(session, r, name);
        if (c == TL_NONE)
            return cli_misuse(session->args.verb, "--value %s: of which channel? CHANNEL=VALUE",
                              list->items[i]);
        if (r->channel != TL_NONE && c != r->channel)
            return cli_misuse(session->args.verb,
                              "--value: one channel at a time, not '%s' and '%s'",
                              cli_name(field_name(r, r->channel)).s, cli_name(name).s);
        r->channel = c;
        field_range(r, c, range);
        if (!cli_parse_part(text, strlen(text), range, value) || !isfinite(*value))
            return cli_misuse(session->args.verb,
                              "--value %s: expected CHANNEL=VALUE or CHANNEL=P%%", list->items[i]);
        r->value_count++;
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

/* Of a mesh; as numbers of 32 bits. */
static int carry_of_mesh(cli_session *session, request *r)
{
    size_t *list = NULL, count = 0;
    int failed = cli_carried(session, r->volume->mesh, &list, &count);
    for (size_t i = 0; !failed && i < count; i++) r->carried[i] = (uint32_t)list[i];
    r->carried_count = count;
    tl_mem_free(session->ctx, list);
    return failed;
}

static bool has_field(const void *arg, const char *name)
{
    return find_field(arg, name) != TL_NONE;
}

/* The same of a model. */
static int carry_of_model(const cli_session *session, request *r)
{
    const char *known;
    char name[CLI_NAME_BYTES];
    const cli_value *list = cli_get(session, CLI_CHANNELS);
    for (uint32_t c = 0; c < field_count(r); c++)
        if (is_field(r, c, &known) && (!list->given || cli_list_names(list, known)))
            r->carried[r->carried_count++] = c;
    return cli_list_unknown(list, has_field, r, name) ? unknown_field(session, r, name) : CLI_DONE;
}

static int set_carried(cli_session *session, request *r)
{
    tl_status st = TL_OK;
    r->carried = tl_mem_alloc(session->ctx, field_count(r), sizeof *r->carried, &st);
    if (st) return cli_fail(session, session->ctx, st);
    return r->by_patch ? carry_of_model(session, r) : carry_of_mesh(session, r);
}

static int set_view(cli_session *session, request *r)
{
    uint32_t size[2];
    r->has_view = cli_get(session, CLI_VIEW)->given || cli_get(session, CLI_CAMERA)->given;
    if (!r->has_view) return CLI_DONE;
    int failed = cli_picture_size(session, 1, size);
    return failed ? failed : cli_camera_choose(session, r->volume->bounds, size, &r->camera);
}

static int take_words(cli_session *session, request *r)
{
    int failed = CLI_DONE;
    if (!r->has_faces)
        failed =
            cli_get(session, CLI_PLANE)->given ? set_plane(session, r) : set_values(session, r);
    return failed ? failed : set_carried(session, r);
}

/* ---- slicing ---- */

typedef struct outcome {
    tl_polydata *surface;
    tl_slices_state slices; /* of a model */
    double error;           /* of a model: at vertices whose values lie between theirs and V */
    double area;
    bool closed;
    double slice_seconds, write_seconds;
} outcome;

static tl_status slice_mesh(cli_session *session, const request *r, tl_polydata **surface)
{
    tl_ctx *ctx = session->ctx;
    tl_status st = TL_OK;
    const tl_mesh *mesh = r->volume->mesh;
    size_t count = tl_mesh_vert_count(mesh);
    double *own = NULL, *gradients = NULL;
    const double *scalar = NULL;
    size_t *carried = tl_mem_alloc(ctx, r->carried_count, sizeof *carried, &st);
    for (size_t i = 0; !st && i < r->carried_count; i++) carried[i] = r->carried[i];
    if (!st && r->channel != TL_NONE)
        st = cli_volume_scalar(ctx, tl_mesh_channel(mesh, r->channel), count, &own, &scalar);
    if (!st && r->channel == TL_NONE) {
        scalar = own = tl_mem_alloc(ctx, count, sizeof *own, &st);
        if (!st) st = tl_plane_distance(ctx, mesh, r->plane, r->plane + 3, own);
    }
    if (!cli_get(session, CLI_NO_NORMALS)->given) {
        tl_channel channel = {.name = "scalar", .components = 1, .values = scalar};
        gradients = tl_mem_alloc(ctx, count, 3 * sizeof *gradients, &st);
        if (!st) st = tl_mesh_gradient(ctx, mesh, &channel, gradients);
    }
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = r->values;
    opts.value_count = r->value_count;
    opts.gradients = gradients;
    opts.channels = carried;
    opts.channel_count = r->carried_count;
    if (!st) st = tl_slice_mesh(ctx, mesh, scalar, &opts, surface);
    tl_mem_free(ctx, gradients);
    tl_mem_free(ctx, own);
    tl_mem_free(ctx, carried);
    return st;
}

static tl_status take_faces(cli_session *session, const request *r, tl_polydata **surface)
{
    tl_status st = TL_OK;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    size_t *carried = tl_mem_alloc(session->ctx, r->carried_count, sizeof *carried, &st);
    for (size_t i = 0; !st && i < r->carried_count; i++) carried[i] = r->carried[i];
    opts.channels = carried;
    opts.channel_count = r->carried_count;
    opts.normals = !cli_get(session, CLI_NO_NORMALS)->given;
    opts.interfaces = cli_get(session, CLI_INTERFACES)->given;
    opts.boundary = cli_get(session, CLI_BOUNDARY)->given;
    if (!st) st = tl_boundary_surface(session->ctx, r->volume->mesh, NULL, &opts, surface);
    tl_mem_free(session->ctx, carried);
    return st;
}

static tl_status slice_model(cli_session *session, const request *r, outcome *o)
{
    tl_slices *slices = NULL;
    size_t patch_count;
    tl_slices_opts opts = tl_slices_opts_defaults();
    const uint32_t *patches = tl_cut_patches(r->volume->cut, &patch_count);
    opts.channel = r->channel;
    if (r->channel == TL_NONE) memcpy(opts.plane, r->plane, sizeof opts.plane);
    opts.values = r->values;
    opts.value_count = r->value_count;
    opts.normals = !cli_get(session, CLI_NO_NORMALS)->given;
    opts.channels = r->carried;
    opts.channel_count = r->carried_count;
    tl_status st = tl_slices_create(session->ctx, r->volume->store, &opts, &slices);
    if (!st) st = tl_slices_update(slices, patches, patch_count);
    if (!st) o->slices = tl_slices_get_state(slices);
    if (!st) st = tl_slices_join(slices, &o->surface);
    tl_slices_destroy(slices);
    return st;
}

/* The largest error that the cut has at the values. */
static tl_status measure_error(cli_session *session, const request *r, outcome *o)
{
    tl_status st = TL_OK;
    size_t patch_count;
    const cli_volume *v = r->volume;
    const uint32_t *patches = tl_cut_patches(v->cut, &patch_count);
    o->error = v->head->channels[r->channel].codec_error;
    for (size_t i = 0; !st && i < patch_count; i++) {
        tl_patch_info patch;
        tl_segment_info segment;
        st = tl_store_patch(session->ctx, v->store, patches[i], &patch);
        if (!st && patch.producer == TL_NONE)
            o->error = fmax(o->error, v->head->levels[0].max_error[r->channel]);
        if (st || patch.producer == TL_NONE) continue;
        st = tl_store_segment(session->ctx, v->store, patch.producer, &segment);
        for (size_t k = 0; !st && k < r->value_count; k++) {
            uint32_t bin = tl_bin_of(v->head->channels[r->channel].range, r->values[k]);
            o->error =
                fmax(o->error, (double)segment.field_bins[r->channel * (size_t)TL_BINS + bin]);
        }
    }
    return st;
}

/* Moves the cut: as fine as need be where the values are, if they are known. Nothing of a file. */
static int cut_model(cli_session *session, request *r)
{
    tl_status st = TL_OK;
    tl_view_request seen = tl_view_request_defaults();
    if (r->channel != TL_NONE)
        st = cli_visible_values(session->ctx, r->volume->head, r->channel, r->values,
                                r->value_count, &r->opacity);
    if (st) return cli_fail(session, session->ctx, st);
    seen.camera = r->has_view ? &r->camera : NULL;
    seen.opacity = r->opacity;
    seen.channel = r->channel;
    return cli_volume_cut(session, r->volume, &seen);
}

/* ---- summaries ---- */

static void put_model(json_t *object, const request *r, const outcome *o)
{
    json_t *patches = cli_json_object(object, "patches");
    cli_json_count(patches, "decoded", o->slices.decoded);
    cli_json_count(patches, "passed_over", o->slices.passed_over);
    cli_json_count(object, "tets_decoded", o->slices.tets);
    if (r->channel != TL_NONE) cli_json_real(object, "field_error", o->error);
}

static void print_json(const cli_session *session, const request *r, const outcome *o)
{
    json_t *object = json_object();
    cli_json_text(object, "file", cli_get(session, CLI_OUTPUT)->text);
    cli_json_count(object, "triangles", o->surface->cell_count);
    cli_json_count(object, "vertices", o->surface->vert_count);
    cli_json_real(object, "area", o->area);
    cli_json_flag(object, "closed", o->closed);
    if (r->channel != TL_NONE) {
        cli_json_text(object, "channel", field_name(r, r->channel));
        cli_json_reals(object, "values", r->values, r->value_count);
    }
    if (r->by_patch) put_model(object, r, o);
    cli_polydata_json(object, session, r->volume, o->slice_seconds, o->write_seconds);
}

static void print_text(cli_session *session, const request *r, const outcome *o)
{
    cli_print_volume(session, r->volume);
    printf("surface     %s triangles, %s vertices, area %s, %s (%s)\n",
           cli_count(o->surface->cell_count).s, cli_count(o->surface->vert_count).s,
           cli_real(o->area).s,
           !o->surface->cell_count
               ? (r->has_faces ? "empty: the mesh has none" : "empty: nothing has that value")
           : o->closed ? "closed"
                       : "with a border",
           cli_seconds(o->slice_seconds).s);
    if (r->by_patch)
        printf("            %s tets in %s patches decoded, %s patches passed over\n",
               cli_count(o->slices.tets).s, cli_count(o->slices.decoded).s,
               cli_count(o->slices.passed_over).s);
    if (r->by_patch && r->channel != TL_NONE)
        printf("            on the right side of all points whose value is more than %s off\n",
               cli_real(o->error).s);
    cli_polydata_print(session, o->write_seconds);
}

/* ---- the verb ---- */

static tl_status make_surface(cli_session *session, request *r, outcome *o)
{
    double start = cli_now();
    tl_status st = r->by_patch    ? slice_model(session, r, o)
                   : r->has_faces ? take_faces(session, r, &o->surface)
                                  : slice_mesh(session, r, &o->surface);
    o->slice_seconds = cli_now() - start;
    if (!st && r->by_patch && r->channel != TL_NONE) st = measure_error(session, r, o);
    if (!st) st = tl_polydata_closed(session->ctx, o->surface, &o->closed);
    if (!st) o->area = tl_polydata_size(o->surface);
    return st ? st : cli_polydata_save(session, o->surface, &o->write_seconds);
}

/* Words that change the mesh need it whole. */
static int prepare(cli_session *session, request *r)
{
    int failed = set_view(session, r);
    r->has_faces = has_faces(session);
    r->by_patch = r->volume->is_model && !cli_derive_given(session) && !r->has_faces;
    if (!failed && !r->by_patch) failed = cut_model(session, r);
    if (!failed && !r->by_patch) failed = cli_volume_mesh(session, r->volume);
    if (!failed) failed = take_words(session, r);
    if (!failed && r->by_patch) failed = cut_model(session, r);
    return failed;
}

static int surface(cli_session *session, request *r)
{
    outcome o = {0};
    int failed = prepare(session, r);
    if (failed) return failed;
    tl_status st = make_surface(session, r, &o);
    cli_progress_clear(&session->progress);
    if (st)
        failed = cli_fail(session, session->ctx, st);
    else if (cli_get(session, CLI_JSON)->given)
        print_json(session, r, &o);
    else if (cli_loud(session))
        print_text(session, r, &o);
    tl_polydata_destroy(session->ctx, o.surface);
    return failed;
}

static int run(cli_session *session)
{
    cli_volume volume;
    request r = {.volume = &volume, .channel = TL_NONE};
    int exit_status = check_words(session);
    if (!exit_status)
        exit_status = cli_volume_begin(session, session->args.operands[0], NULL, &volume);
    if (exit_status) return exit_status;
    exit_status = surface(session, &r);
    tl_mem_free(session->ctx, r.opacity);
    tl_mem_free(session->ctx, r.carried);
    cli_volume_close(session, &volume);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod surface flow.tlod -o shock.ply --value density=1.4",
    "The isosurface of the finest mesh, with all channels on it",
    "tetralod surface flow.tlod -o shells.glb --value 20% --value 50% --value 80% --error 1%",
    "Three surfaces of the only channel, on the right side of all points that are 1 % off",
    "tetralod surface flow.tlod -o shock.ply --value density=1.4 --camera camera.json --error 1px",
    "As fine as a pixel of a view asks for",
    "tetralod surface wing.vtu -o middle.vtp --plane 0,0,0,0,1,0 --channels pressure",
    "A plane cut that carries one channel",
    "tetralod surface head.mesh -o tissues.vtp --interfaces --boundary",
    "The surfaces of all regions",
    NULL};

const cli_verb cli_verb_surface = {
    .name = "surface",
    .operands = "IN -o OUT (--value [CHANNEL=]V | --plane X,Y,Z,NX,NY,NZ | --interfaces)",
    .operand_least = 1,
    .operand_most = 1,
    .about = "isosurfaces, plane cuts, interfaces and boundaries as triangles",
    .details =
        "IN is a model or any file that 'tetralod formats' lists. Triangles look to lower "
        "values, and so do the normals. Of a model patches that the values miss are not read. "
        "--error of the channel of the values, or of none, counts where the values are: it is how "
        "far off the value of a point may be that lies on the wrong side. In JSON closed tells "
        "whether every edge has two triangles; seconds is the slicing alone, gradients included, "
        "of a model decoding, too.",
    .groups = {&GROUP, &cli_group_detail, &SEEN_GROUP, &cli_group_derive, &cli_group_reading,
               &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
