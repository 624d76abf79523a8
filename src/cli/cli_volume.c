/* Opens what is looked at: verbs that make surfaces, lines and pictures take models and files
 * alike. */
#include "cli_volume.h"

#include <math.h>
#include <string.h>

/* Pixels that a scene goes up to; what stands in place of a bound
 * of 0, which there is none. */
static const double PIXELS_MOST = 1000, LEAST = 1e-300;

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

/* Bounds of channels, as the scene takes them; *pixels becomes the least of those in pixels. */
static int take_errors(cli_session *session, cli_volume *volume, double *pixels)
{
    char list[TL_SCENE_TEXT_BYTES] = "", name[CLI_NAME_BYTES];
    const cli_value *errors = cli_get(session, CLI_ERROR);
    size_t at = 0;
    for (size_t i = 0; i < errors->item_count; i++) {
        const char *text = errors->items[i];
        double value;
        bool percent;
        if (parse_pixels(text, &value)) {
            *pixels = fmin(*pixels, value);
            continue;
        }
        if (!cli_parse_bound(text, name, &value, &percent))
            return cli_misuse(session->args.verb,
                              "--error %s: expected E, E%%, CHANNEL=E, CHANNEL=E%% or Npx, above 0",
                              text);
        at += (size_t)snprintf(list + at, sizeof list - at, "%s%s", at ? ";" : "", text);
        if (at >= sizeof list) return cli_misuse(session->args.verb, "--error: too much of it");
    }
    if (!*list) return CLI_DONE;
    tl_status st =
        tl_scene_set_text(session->ctx, volume->scene, TL_NODE_DETAIL + 1, "errors", list);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

static tl_status set_detail(cli_session *session, cli_volume *volume, const char *prop,
                            double value)
{
    return tl_scene_set_real(session->ctx, volume->scene, TL_NODE_DETAIL + 1, prop, value);
}

/* A length, or a part of the diagonal. */
static tl_status take_length(cli_session *session, cli_volume *volume, const cli_value *word,
                             const char *prop)
{
    if (!word->given) return TL_OK;
    const double length = word->percent ? word->real * volume->diagonal : word->real;
    return set_detail(session, volume, prop, fmax(length, LEAST));
}

/* The words of cli_group_detail to the scene's node. */
static int take_detail(cli_session *session, cli_volume *volume)
{
    double pixels = INFINITY;
    const cli_value *tets = cli_get(session, CLI_TETS);
    const cli_value *space = cli_get(session, CLI_SPACE_ERROR);
    const cli_value *boundary = cli_get(session, CLI_BOUNDARY_ERROR);
    const bool is_said =
        cli_get(session, CLI_ERROR)->given || space->given || boundary->given || tets->given;
    int failed = take_errors(session, volume, &pixels);
    if (failed) return failed;
    tl_status st = take_length(session, volume, space, "space_error");
    if (!st) st = take_length(session, volume, boundary, "boundary_error");
    if (!st && tets->given) st = set_detail(session, volume, "tets", (double)tets->count);
    if (!st && cli_get(session, CLI_FULL)->given)
        st = tl_scene_set_flag(session->ctx, volume->scene, TL_NODE_DETAIL + 1, "full", true);
    if (!st && is_said)
        st = set_detail(session, volume, "error_px",
                        isfinite(pixels) ? fmin(pixels, PIXELS_MOST) : 0);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* ---- opening ---- */

static int open_model(cli_session *session, cli_volume *volume)
{
    tl_status st = tl_source_open(session->ctx, volume->input.path, &volume->source);
    if (st) return cli_fail(session, session->ctx, st);
    volume->is_model = true;
    volume->store = tl_source_store(volume->source);
    volume->head = tl_store_get_head(volume->store);
    volume->errors =
        tl_mem_zalloc(session->ctx, volume->head->channel_count, sizeof *volume->errors, &st);
    return st ? cli_fail(session, session->ctx, st)
              : cli_choose_step(session, volume->head, &volume->step);
}

static bool says_step(const cli_session *session)
{
    return cli_get(session, CLI_STEP)->given || cli_get(session, CLI_TIME)->given;
}

/* Where the step of a scene is read: in the file, or in one beside it. */
static int find_step(cli_session *session, cli_volume *volume, int64_t number, const char **path,
                     tl_read_opts *opts)
{
    const tl_series *series = &volume->series;
    tl_status st = tl_series_find(session->ctx, *path, opts, &volume->series);
    if (st) return cli_fail(session, session->ctx, st);
    opts->step = (uint64_t)number; /* what the reader refuses where there is none */
    for (size_t i = 0; i < series->count; i++)
        if (series->steps[i].number == (uint64_t)number) {
            *path = series->steps[i].path;
            opts->step = series->steps[i].step;
        }
    return CLI_DONE;
}

/* Of a series the step that the words say, else that of the scene. */
static int open_file(cli_session *session, cli_volume *volume)
{
    tl_read_opts opts;
    int64_t number = -1;
    const char *path = volume->input.path;
    int failed = cli_read_opts(session, path, &opts);
    if (!failed && volume->scene && !says_step(session))
        number = (int64_t)tl_scene_real(volume->scene, TL_NODE_DATA + 1, "step");
    if (!failed && number >= 0) failed = find_step(session, volume, number, &path, &opts);
    if (!failed) failed = cli_open_with(session, session->ctx, path, &opts, &volume->input);
    if (!failed) failed = cli_check_volume(&volume->input);
    if (!failed && number < 0 && (opts.has_time || opts.step))
        failed = cli_step_number(session, path, &opts, &number);
    if (failed) return failed;
    tl_status st = tl_source_create(session->ctx, volume->input.mesh, path, &volume->source);
    if (st) return cli_fail(session, session->ctx, st);
    volume->input.mesh = NULL; /* the source's */
    if (number < 0) return CLI_DONE;
    volume->step = (cli_model_step){true, (uint32_t)number, NAN};
    st = tl_source_set_step(session->ctx, volume->source, (uint32_t)number);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* The step of a scene, where the words say no other: that of the volume, too. */
static tl_status take_step(cli_session *session, cli_volume *volume, bool is_read)
{
    cli_model_step step = {0};
    const bool is_said = says_step(session);
    if (!volume->step.is_chosen && is_read && is_said)
        return tl_scene_set_real(session->ctx, volume->scene, TL_NODE_DATA + 1, "step", -1);
    if (!volume->step.is_chosen) return TL_OK;
    if (!is_read || is_said)
        return tl_scene_set_real(session->ctx, volume->scene, TL_NODE_DATA + 1, "step",
                                 volume->step.number);
    while (volume->head && cli_next_step(volume->head, &step))
        if (step.number == tl_scene_real(volume->scene, TL_NODE_DATA + 1, "step"))
            volume->step = step;
    return TL_OK;
}

/* The scene of the words, on top of one that is there already. */
static int take_words(cli_session *session, cli_volume *volume)
{
    tl_status st = TL_OK;
    const bool is_read = volume->scene != NULL;
    if (!is_read) st = tl_scene_create(session->ctx, &volume->scene);
    if (!st) st = tl_scene_set_bounds(session->ctx, volume->scene, volume->bounds);
    if (!st) st = tl_view_create(session->ctx, volume->source, &volume->view);
    if (!st) st = take_step(session, volume, is_read);
    if (st) return cli_fail(session, session->ctx, st);
    int failed = take_detail(session, volume);
    return failed ? failed : cli_derive(session, volume->source, volume->view, volume->scene);
}

int cli_volume_begin(cli_session *session, const char *path, tl_scene *scene, cli_volume *volume)
{
    double start = cli_now();
    *volume = (cli_volume){.input.path = path, .scene = scene};
    const bool is_model = tl_store_is(session->ctx, path);
    int failed = is_model ? open_model(session, volume) : open_file(session, volume);
    if (!failed) {
        const tl_source_facts *facts = tl_source_get_facts(volume->source);
        memcpy(volume->bounds, facts->bounds, sizeof volume->bounds);
        volume->diagonal = facts->diagonal;
        failed = take_words(session, volume);
    }
    volume->seconds = volume->open_seconds = cli_now() - start;
    if (failed) cli_volume_close(session, volume);
    return failed;
}

int cli_volume_cut(cli_session *session, cli_volume *volume, const tl_view_request *request)
{
    double start = cli_now(), pixels;
    const cli_value *errors = cli_get(session, CLI_ERROR);
    if (!volume->is_model) return CLI_DONE;
    volume->has_view = request->camera != NULL;
    for (size_t i = 0; !volume->has_view && i < errors->item_count; i++)
        if (parse_pixels(errors->items[i], &pixels))
            return cli_misuse(session->args.verb, "--error %s: there is no view", errors->items[i]);
    tl_status st = tl_view_cut(session->ctx, volume->view, volume->scene, request, &volume->state);
    volume->cut_seconds = cli_now() - start;
    if (st) return cli_fail(session, session->ctx, st);
    volume->cut = tl_view_get_cut(volume->view);
    volume->error_count = 0;
    for (uint32_t c = 0; c < volume->head->channel_count; c++)
        if (cli_in_step(&volume->head->channels[c], &volume->step))
            volume->errors[volume->error_count++] = (tl_content_error){
                volume->head->channels[c].name, tl_cut_channel_error(volume->cut, c)};
    return CLI_DONE;
}

int cli_volume_mesh(cli_session *session, cli_volume *volume)
{
    double start = cli_now();
    tl_status st =
        tl_view_mesh(session->ctx, volume->view, volume->scene, &volume->mesh, &volume->whole_tets);
    if (!st) {
        volume->tets = tl_mesh_tet_count(volume->mesh);
        volume->verts = tl_mesh_vert_count(volume->mesh);
    }
    cli_progress_clear(&session->progress);
    volume->mesh_seconds = cli_now() - start;
    volume->seconds = volume->open_seconds + volume->cut_seconds + volume->mesh_seconds;
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

void cli_volume_take(cli_volume *volume, const tl_content *content)
{
    const tl_content_facts *f = tl_content_get_facts(content);
    volume->cut_seconds = f->cut_s;
    volume->mesh_seconds = f->mesh_s;
    volume->seconds = volume->open_seconds + f->cut_s + f->mesh_s;
    volume->tets = f->tets;
    volume->verts = f->verts;
    volume->whole_tets = f->is_part ? f->whole_tets : 0;
    if (!volume->is_model) return;
    volume->cut = tl_view_get_cut(volume->view);
    volume->state = tl_cut_get_state(volume->cut);
    volume->state.boundary_error = f->boundary_error;
    volume->state.pixels = f->error_px;
    volume->state.bounds_kept = f->bounds_kept;
    volume->has_view = true;
    volume->error_count = f->error_count;
    memcpy(volume->errors, f->errors, f->error_count * sizeof *f->errors);
}

int cli_volume_open(cli_session *session, const char *path, cli_volume *volume)
{
    const tl_view_request request = tl_view_request_defaults();
    int failed = cli_volume_begin(session, path, NULL, volume);
    if (failed) return failed;
    failed = cli_volume_cut(session, volume, &request);
    if (!failed) failed = cli_volume_mesh(session, volume);
    if (failed) cli_volume_close(session, volume);
    return failed;
}

void cli_volume_close(cli_session *session, cli_volume *volume)
{
    tl_mem_free(session->ctx, volume->errors);
    tl_view_destroy(volume->view);
    tl_scene_destroy(session->ctx, volume->scene);
    tl_source_destroy(volume->source);
    cli_close(&volume->input);
    tl_series_release(session->ctx, &volume->series);
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
    printf("kept        %s of %s tets\n", cli_count(volume->tets).s,
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
    for (size_t i = 0; i < volume->error_count; i++)
        printf("            %s within %s\n", cli_name(volume->errors[i].channel).s,
               cli_real(volume->errors[i].error).s);
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
    if (volume->verts) cli_json_count(object, "vertices", volume->verts);
    cli_json_count(object, "patches", volume->state.patches);
    json_t *list = cli_json_list(object, "bounds_promised");
    for (size_t i = 0; i < volume->error_count; i++) {
        json_t *item = cli_json_item(list);
        cli_json_text(item, "channel", volume->errors[i].channel);
        cli_json_real(item, "error", volume->errors[i].error);
    }
    cli_json_real(object, "boundary_error", volume->state.boundary_error);
    cli_json_real(object, "space_error", volume->state.space_error);
    if (volume->has_view) cli_json_real(object, "error_px", volume->state.pixels);
    cli_json_flag(object, "bounds_kept", volume->state.bounds_kept);
    cli_json_count(object, "bytes_read", tl_store_bytes_read(volume->store));
}

void cli_json_volume(json_t *object, const cli_volume *volume)
{
    if (volume->whole_tets) cli_json_count(object, "kept_tets", volume->tets);
    if (volume->is_model) {
        put_model(object, volume);
        return;
    }
    cli_json_count(object, "tets", volume->tets);
    cli_json_count(object, "vertices", volume->verts);
}

void cli_json_volume_seconds(json_t *object, const cli_volume *volume)
{
    cli_json_real(object, "open", volume->open_seconds);
    cli_json_real(object, "cut", volume->cut_seconds);
    cli_json_real(object, "mesh", volume->mesh_seconds);
}
