/* Opens what is looked at: verbs that make surfaces, lines and pictures take models and files
 * alike. */
#include "cli_volume.h"

#include <math.h>
#include <string.h>

/* Tets of the mesh of a first look, and pixels that a view may be off if nothing is said. */
static const uint64_t LOOK_TETS = 100000;
static const double PIXELS = 1;

static const cli_option DETAIL[] = {
    {CLI_ERROR, 0, "error", CLI_TYPE_LIST, "[CHANNEL=]E[%]|Npx", NULL, 0, 0,
     "of a model: as coarse as an error of the channels, or of one, allows, in percent of the "
     "channel's range or a number in its unit; or, where there is a view, as an error of N pixels "
     "on the screen allows"},
    {CLI_SPACE_ERROR, 0, "space-error", CLI_TYPE_AMOUNT, "D[%]", NULL, 0, 0,
     "of a model: how far isosurfaces may be from their places, in percent of the box's diagonal, "
     "or a length"},
    {CLI_BOUNDARY_ERROR, 0, "boundary-error", CLI_TYPE_AMOUNT, "D[%]", NULL, 0, 0,
     "of a model: how far the boundary may be from its place, likewise"},
    {CLI_TETS, 0, "tets", CLI_TYPE_COUNT, "N", NULL, 1, 4294967295.0,
     "of a model: at most N tets, with the least error"},
    {CLI_FULL, 0, "full", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "of a model: the finest mesh (the default where there is no view; else 1px)"},
};
const cli_group cli_group_detail = {"Detail", DETAIL, sizeof DETAIL / sizeof *DETAIL};

cli_volume_request cli_volume_request_defaults(void)
{
    return (cli_volume_request){.channel = TL_NONE};
}

/* ---- what the words ask for ---- */

/* "Npx" above 0. */
static bool parse_pixels(const char *text, double *pixels)
{
    char number[64];
    size_t length = strlen(text);
    if (length < 3 || length - 2 >= sizeof number || strcmp(text + length - 2, "px") != 0)
        return false;
    memcpy(number, text, length - 2);
    number[length - 2] = '\0';
    return cli_parse_real(number, pixels) && isfinite(*pixels) && *pixels > 0;
}

/* One bound: of all channels of the step, of the one that is named, or of the visible values. */
static int take_error(const cli_session *session, const cli_volume *volume,
                      const cli_volume_request *request, const char *text, double *bounds,
                      tl_cut_query *query)
{
    char name[CLI_NAME_BYTES];
    double value;
    bool percent, found = false;
    if (parse_pixels(text, &value)) {
        if (!request->camera)
            return cli_misuse(session->args.verb, "--error %s: there is no view", text);
        query->pixels = fmin(query->pixels, value);
        return CLI_DONE;
    }
    if (!cli_parse_bound(text, name, &value, &percent))
        return cli_misuse(session->args.verb,
                          "--error %s: expected E, E%%, CHANNEL=E, CHANNEL=E%% or Npx, above 0",
                          text);
    for (uint32_t c = 0; c < volume->head->channel_count; c++) {
        const tl_store_channel *channel = &volume->head->channels[c];
        double range = channel->range[1] - channel->range[0];
        if (!cli_in_step(channel, &volume->step)) continue;
        if (*name ? strcmp(channel->name, name) != 0
                  : request->channel != TL_NONE && c != request->channel)
            continue;
        found = true;
        if (c != request->channel)
            bounds[c] = fmin(bounds[c], percent ? value * range : value);
        else if (range > 0)
            query->bounds.classified =
                fmin(query->bounds.classified, percent ? value : value / range);
    }
    return found || !*name ? CLI_DONE
                           : cli_unknown_in_model(session, volume->head, &volume->step, name);
}

/* A length, or a part of the diagonal. */
static void take_length(const cli_volume *volume, const cli_value *word, double *bound)
{
    if (word->given) *bound = word->percent ? word->real * volume->diagonal : word->real;
}

static int fill_query(const cli_session *session, const cli_volume *volume,
                      const cli_volume_request *request, double *bounds, tl_cut_query *query)
{
    const cli_value *errors = cli_get(session, CLI_ERROR), *tets = cli_get(session, CLI_TETS);
    const cli_value *space = cli_get(session, CLI_SPACE_ERROR);
    const cli_value *boundary = cli_get(session, CLI_BOUNDARY_ERROR);
    int failed = CLI_DONE;
    for (size_t c = 0; c < volume->head->channel_count; c++) bounds[c] = INFINITY;
    for (size_t i = 0; !failed && i < errors->item_count; i++)
        failed = take_error(session, volume, request, errors->items[i], bounds, query);
    query->bounds.channels = bounds;
    query->camera = request->camera;
    query->opacity = request->opacity;
    query->unseen = request->unseen;
    take_length(volume, space, &query->bounds.space);
    take_length(volume, boundary, &query->bounds.boundary);
    if (tets->given) query->tets_max = tets->count;
    bool is_said = errors->given || space->given || boundary->given || tets->given;
    if (cli_get(session, CLI_FULL)->given || (!is_said && !request->camera)) query->level = 0;
    if (!is_said && request->camera) query->pixels = PIXELS;
    return failed;
}

/* ---- a model ---- */

static bool is_named(const cli_volume_request *request, const char *name)
{
    bool found = !request->names;
    for (size_t i = 0; !found && i < request->name_count; i++)
        found = strcmp(request->names[i], name) == 0;
    return found;
}

/* The channels of the step that are asked for; all where words may name any. */
static void choose_channels(const cli_session *session, cli_volume *volume,
                            const cli_volume_request *request)
{
    bool all = cli_derive_given(session);
    volume->channel_count = 0;
    for (uint32_t c = 0; c < volume->head->channel_count; c++) {
        const tl_store_channel *channel = &volume->head->channels[c];
        if (cli_in_step(channel, &volume->step) && (all || is_named(request, channel->name)))
            volume->channels[volume->channel_count++] = c;
    }
}

static int open_model(cli_session *session, cli_volume *volume)
{
    tl_status st = tl_store_open(session->ctx, volume->input.path, &volume->store);
    if (st) return cli_fail(session, session->ctx, st);
    volume->is_model = true;
    volume->head = tl_store_get_head(volume->store);
    volume->channels =
        tl_mem_alloc(session->ctx, volume->head->channel_count, sizeof *volume->channels, &st);
    volume->errors =
        tl_mem_zalloc(session->ctx, volume->head->channel_count, sizeof *volume->errors, &st);
    memcpy(volume->bounds, volume->head->stats.bounds, sizeof volume->bounds);
    volume->diagonal = volume->head->stats.diagonal;
    int failed = st ? cli_fail(session, session->ctx, st)
                    : cli_choose_step(session, volume->head, &volume->step);
    if (!failed) {
        cli_volume_request all = cli_volume_request_defaults();
        choose_channels(session, volume, &all);
    }
    return failed;
}

/* Adds and chooses what the words say. */
static int derive(cli_session *session, cli_volume *volume)
{
    size_t whole = tl_mesh_tet_count(volume->input.mesh);
    int failed = cli_derive(session, volume->bounds, &volume->input.mesh);
    volume->whole_tets = cli_derive_chooses(session) ? whole : 0;
    return failed;
}

int cli_volume_begin(cli_session *session, const char *path, cli_volume *volume)
{
    double start = cli_now();
    int failed;
    *volume = (cli_volume){.input.path = path};
    if (tl_store_is(session->ctx, path)) {
        failed = open_model(session, volume);
    } else {
        failed = cli_open_volume(session, session->ctx, path, &volume->input);
        if (failed) return failed;
        cli_bounds(volume->input.mesh, volume->bounds);
        volume->diagonal = cli_diagonal(volume->input.mesh);
        failed = derive(session, volume);
    }
    volume->seconds = volume->open_seconds = cli_now() - start;
    if (failed) cli_volume_close(session, volume);
    return failed;
}

static tl_status move_cut(cli_session *session, cli_volume *volume, const tl_cut_query *query)
{
    tl_status st = TL_OK;
    if (!volume->cut) st = tl_cut_create(session->ctx, volume->store, &volume->cut);
    if (!st) st = tl_cut_update(volume->cut, query);
    if (!st) volume->state = tl_cut_get_state(volume->cut);
    for (size_t i = 0; !st && i < volume->channel_count; i++)
        volume->errors[i] = tl_cut_channel_error(volume->cut, volume->channels[i]);
    return st;
}

static tl_status make_mesh(cli_session *session, cli_volume *volume)
{
    tl_mesh_destroy(volume->input.mesh);
    volume->input.mesh = NULL;
    tl_status st =
        tl_cut_mesh(volume->cut, volume->channels, volume->channel_count, &volume->input.mesh);
    if (!st)
        tl_mesh_set_time(volume->input.mesh,
                         volume->step.is_chosen ? volume->step.time : volume->head->time);
    cli_progress_clear(&session->progress);
    return st;
}

int cli_volume_look(cli_session *session, cli_volume *volume, const tl_mesh **mesh)
{
    tl_status st = TL_OK;
    if (volume->is_model) {
        tl_cut_query query = tl_cut_query_defaults();
        query.tets_max = LOOK_TETS;
        st = move_cut(session, volume, &query);
        if (!st) st = make_mesh(session, volume);
    }
    int failed = st ? cli_fail(session, session->ctx, st) : CLI_DONE;
    if (!failed && volume->is_model) failed = derive(session, volume);
    *mesh = volume->input.mesh;
    return failed;
}

int cli_volume_cut(cli_session *session, cli_volume *volume, const cli_volume_request *request)
{
    tl_status st = TL_OK;
    tl_cut_query query = tl_cut_query_defaults();
    double start = cli_now();
    if (!volume->is_model) return CLI_DONE;
    volume->has_view = request->camera != NULL;
    choose_channels(session, volume, request);
    double *bounds = tl_mem_alloc(session->ctx, volume->head->channel_count, sizeof *bounds, &st);
    int failed = st ? cli_fail(session, session->ctx, st)
                    : fill_query(session, volume, request, bounds, &query);
    if (!failed) {
        st = move_cut(session, volume, &query);
        if (st) failed = cli_fail(session, session->ctx, st);
    }
    tl_mem_free(session->ctx, bounds);
    volume->cut_seconds = cli_now() - start;
    return failed;
}

int cli_volume_mesh(cli_session *session, cli_volume *volume)
{
    double start = cli_now();
    if (!volume->is_model) return CLI_DONE;
    tl_status st = make_mesh(session, volume);
    int failed = st ? cli_fail(session, session->ctx, st) : derive(session, volume);
    volume->mesh_seconds = cli_now() - start;
    volume->seconds = volume->open_seconds + volume->cut_seconds + volume->mesh_seconds;
    return failed;
}

int cli_volume_open(cli_session *session, const char *path, cli_volume *volume)
{
    cli_volume_request request = cli_volume_request_defaults();
    int failed = cli_volume_begin(session, path, volume);
    if (failed) return failed;
    failed = cli_volume_cut(session, volume, &request);
    if (!failed) failed = cli_volume_mesh(session, volume);
    if (failed) cli_volume_close(session, volume);
    return failed;
}

void cli_volume_close(cli_session *session, cli_volume *volume)
{
    tl_cut_destroy(volume->cut);
    tl_mem_free(session->ctx, volume->errors);
    tl_mem_free(session->ctx, volume->channels);
    cli_close(&volume->input);
    tl_store_close(volume->store);
    *volume = (cli_volume){0};
}

/* ---- channels ---- */

uint32_t cli_volume_channel(const cli_volume *volume, const char *name)
{
    for (uint32_t c = 0; volume->is_model && c < volume->head->channel_count; c++) {
        const tl_store_channel *channel = &volume->head->channels[c];
        if (channel->on == TL_ON_VERTEX && cli_in_step(channel, &volume->step) &&
            strcmp(channel->name, name) == 0)
            return c;
    }
    return TL_NONE;
}

tl_status cli_volume_scalar(tl_ctx *ctx, const tl_channel *channel, size_t count, double **lengths,
                            const double **scalar)
{
    tl_status st = TL_OK;
    *lengths = NULL;
    *scalar = channel->values;
    if (channel->components == 1) return TL_OK;
    *lengths = tl_mem_alloc(ctx, count, sizeof **lengths, &st);
    if (!st) cli_lengths(channel, count, *lengths);
    *scalar = *lengths;
    return st;
}

static bool is_on_verts(const void *mesh, const char *name)
{
    return cli_vertex_channel(mesh, name) != NULL;
}

int cli_carried(cli_session *session, const tl_mesh *mesh, size_t **carried, size_t *count)
{
    tl_status st = TL_OK;
    char name[CLI_NAME_BYTES];
    const cli_value *list = cli_get(session, CLI_CHANNELS);
    *count = 0;
    *carried = tl_mem_alloc(session->ctx, tl_mesh_channel_count(mesh), sizeof **carried, &st);
    if (st) return cli_fail(session, session->ctx, st);
    for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
        const tl_channel *channel = tl_mesh_channel(mesh, c);
        if (channel->on != TL_ON_VERTEX) continue;
        if (!list->given || cli_list_names(list, channel->name)) (*carried)[(*count)++] = c;
    }
    return cli_list_unknown(list, is_on_verts, mesh, name)
               ? cli_unknown_channel(session, mesh, name)
               : CLI_DONE;
}

/* ---- summaries ---- */

static void print_chosen(const cli_volume *volume)
{
    if (!volume->whole_tets) return;
    printf("kept        %s of %s tets\n", cli_count(tl_mesh_tet_count(volume->input.mesh)).s,
           cli_count(volume->whole_tets).s);
}

void cli_print_volume(cli_session *session, const cli_volume *volume)
{
    if (!volume->is_model) {
        cli_print_input(session, "read", &volume->input);
        print_chosen(volume);
        return;
    }
    printf("model       %s: %s of %s tets in %s patches (%s, %s)\n", volume->input.path,
           cli_count(volume->state.tets).s, cli_count(volume->head->input_tets).s,
           cli_count(volume->state.patches).s,
           cli_bytes((double)cli_file_bytes(volume->input.path)).s, cli_seconds(volume->seconds).s);
    for (size_t i = 0; i < volume->channel_count; i++)
        printf("            %s within %s\n",
               cli_name(volume->head->channels[volume->channels[i]].name).s,
               cli_real(volume->errors[i]).s);
    printf("            boundary within %s\n", cli_real(volume->state.boundary_error).s);
    if (volume->has_view)
        printf("            off by at most %s pixels on the screen\n",
               cli_real(volume->state.pixels).s);
    if (!volume->state.bounds_kept)
        printf("            what was asked for is NOT kept: this is what the model allows\n");
    print_chosen(volume);
}

static void put_model(json_t *object, const cli_volume *volume)
{
    cli_json_count(object, "tets", volume->state.tets);
    if (volume->input.mesh)
        cli_json_count(object, "vertices", tl_mesh_vert_count(volume->input.mesh));
    cli_json_count(object, "patches", volume->state.patches);
    json_t *list = cli_json_list(object, "bounds_promised");
    for (size_t i = 0; i < volume->channel_count; i++) {
        json_t *item = cli_json_item(list);
        cli_json_text(item, "channel", volume->head->channels[volume->channels[i]].name);
        cli_json_real(item, "error", volume->errors[i]);
    }
    cli_json_real(object, "boundary_error", volume->state.boundary_error);
    cli_json_real(object, "space_error", volume->state.space_error);
    if (volume->has_view) cli_json_real(object, "error_px", volume->state.pixels);
    cli_json_flag(object, "bounds_kept", volume->state.bounds_kept);
    cli_json_count(object, "bytes_read", tl_store_bytes_read(volume->store));
}

void cli_json_volume(json_t *object, const cli_volume *volume)
{
    if (volume->whole_tets)
        cli_json_count(object, "kept_tets", tl_mesh_tet_count(volume->input.mesh));
    if (volume->is_model) {
        put_model(object, volume);
        return;
    }
    cli_json_count(object, "tets", tl_mesh_tet_count(volume->input.mesh));
    cli_json_count(object, "vertices", tl_mesh_vert_count(volume->input.mesh));
}

void cli_json_volume_seconds(json_t *object, const cli_volume *volume)
{
    cli_json_real(object, "open", volume->open_seconds);
    cli_json_real(object, "cut", volume->cut_seconds);
    cli_json_real(object, "mesh", volume->mesh_seconds);
}
