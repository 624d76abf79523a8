/* Opens what is looked at: verbs that make surfaces, lines and pictures take models and files
 * alike. */
#include "cli_volume.h"

#include <math.h>

static const cli_option DETAIL[] = {
    {CLI_ERROR, 0, "error", CLI_TYPE_AMOUNT, "E[%]", NULL, 0, 0,
     "of a model: as coarse as an error of the channels allows, in percent of each channel's "
     "range, "
     "or a number in its unit"},
    {CLI_TETS, 0, "tets", CLI_TYPE_COUNT, "N", NULL, 1, 4294967295.0,
     "of a model: at most N tets, with the least error"},
    {CLI_FULL, 0, "full", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "of a model: the finest mesh (the default)"},
};
const cli_group cli_group_detail = {"Detail", DETAIL, sizeof DETAIL / sizeof *DETAIL};

static void fill_query(cli_session *session, const tl_store_head *head, double *bounds,
                       tl_cut_query *query)
{
    const cli_value *error = cli_get(session, CLI_ERROR), *tets = cli_get(session, CLI_TETS);
    for (size_t c = 0; c < head->channel_count; c++) {
        double range = head->channels[c].range[1] - head->channels[c].range[0];
        bounds[c] = error->percent ? error->real * range : error->real;
    }
    if (error->given) query->bounds.channels = bounds;
    if (tets->given) query->tets_max = tets->count;
    if (cli_get(session, CLI_FULL)->given || (!error->given && !tets->given)) query->level = 0;
}

static tl_status cut_model(cli_session *session, tl_store *store, cli_volume *volume)
{
    tl_status st = TL_OK;
    tl_cut *cut = NULL;
    tl_cut_query query = tl_cut_query_defaults();
    const tl_store_head *head = tl_store_get_head(store);
    volume->is_model = true;
    volume->channel_count = head->channel_count;
    volume->errors = tl_mem_alloc(session->ctx, head->channel_count, sizeof(double), &st);
    if (!st) fill_query(session, head, volume->errors, &query);
    if (!st) st = tl_cut_create(session->ctx, store, &cut);
    if (!st) st = tl_cut_update(cut, &query);
    if (!st) st = tl_cut_mesh(cut, NULL, 0, &volume->input.mesh);
    if (!st) {
        volume->state = tl_cut_get_state(cut);
        for (size_t c = 0; c < head->channel_count; c++)
            volume->errors[c] = tl_cut_channel_error(cut, c);
    }
    tl_cut_destroy(cut);
    return st;
}

int cli_volume_open(cli_session *session, const char *path, cli_volume *volume)
{
    double start = cli_now();
    *volume = (cli_volume){.input.path = path};
    if (!tl_store_is(session->ctx, path)) {
        int failed = cli_open_volume(session, session->ctx, path, &volume->input);
        volume->seconds = cli_now() - start;
        return failed;
    }
    tl_store *store = NULL;
    tl_status st = tl_store_open(session->ctx, path, &store);
    if (!st) st = cut_model(session, store, volume);
    tl_store_close(store);
    volume->seconds = volume->input.seconds = cli_now() - start;
    cli_progress_clear(&session->progress);
    if (!st) return CLI_DONE;
    int failed = cli_fail(session, session->ctx, st);
    cli_volume_close(session, volume);
    return failed;
}

void cli_volume_close(cli_session *session, cli_volume *volume)
{
    tl_mem_free(session->ctx, volume->errors);
    volume->errors = NULL;
    cli_close(&volume->input);
}

void cli_print_volume(cli_session *session, const cli_volume *volume)
{
    const tl_mesh *mesh = volume->input.mesh;
    cli_print_input(session, volume->is_model ? "model" : "read", &volume->input);
    for (size_t c = 0; c < volume->channel_count; c++)
        printf("            %s within %s\n", cli_name(tl_mesh_channel(mesh, c)->name).s,
               cli_real(volume->errors[c]).s);
    if (volume->is_model)
        printf("            boundary within %s\n", cli_real(volume->state.boundary_error).s);
}

void cli_json_volume(json_t *object, const cli_volume *volume)
{
    const tl_mesh *mesh = volume->input.mesh;
    cli_json_count(object, "tets", tl_mesh_tet_count(mesh));
    cli_json_count(object, "vertices", tl_mesh_vert_count(mesh));
    if (!volume->is_model) return;
    cli_json_count(object, "patches", volume->state.patches);
    json_t *list = cli_json_list(object, "bounds_promised");
    for (size_t c = 0; c < volume->channel_count; c++) {
        json_t *item = cli_json_item(list);
        cli_json_text(item, "channel", tl_mesh_channel(mesh, c)->name);
        cli_json_real(item, "error", volume->errors[c]);
    }
    cli_json_real(object, "boundary_error", volume->state.boundary_error);
}
