/* tetralod compare: how far a copy is from the original. */
#include <math.h>
#include <string.h>

#include "cli_session.h"

static const cli_option OPTIONS[] = {
    {CLI_ISO, 0, "iso", CLI_TYPE_LIST, "CHANNEL=VALUE", NULL, 0, 0,
     "also the distance between the isosurfaces of a scalar channel at this value"},
    {CLI_SPACING, 0, "spacing", CLI_TYPE_AMOUNT, "D[%]", "0.25%", 0, 0,
     "distance of the samples on boundaries and isosurfaces, in percent of the larger diagonal or "
     "as a length; at least 0.01%"},
    {CLI_SKIP_BOUNDARY, 0, "skip-boundary", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "leave out the distance of the boundaries"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

typedef struct iso_list {
    tl_iso_request requests[CLI_LIST_MAX];
    char names[CLI_LIST_MAX][CLI_NAME_BYTES];
    size_t count;
} iso_list;

static int parse_isos(const cli_session *session, iso_list *isos)
{
    const cli_value *list = cli_get(session, CLI_ISO);
    isos->count = list->item_count;
    for (size_t i = 0; i < isos->count; i++) {
        const char *value = NULL;
        tl_iso_request *request = &isos->requests[i];
        if (!cli_split_named(list->items[i], isos->names[i], CLI_NAME_BYTES, &value) ||
            !cli_parse_real(value, &request->value) || !isfinite(request->value))
            return cli_misuse(session->args.verb, "--iso %s: expected CHANNEL=VALUE",
                              list->items[i]);
        request->channel = isos->names[i];
    }
    return CLI_DONE;
}

static int check_isos(const cli_session *session, const iso_list *isos, const tl_mesh *mesh)
{
    for (size_t i = 0; i < isos->count; i++) {
        const tl_channel *channel = cli_vertex_channel(mesh, isos->names[i]);
        if (!channel) return cli_unknown_channel(session, mesh, isos->names[i]);
        if (channel->components != 1)
            return cli_misuse(session->args.verb, "--iso %s: the channel has %u components",
                              isos->names[i], channel->components);
    }
    return CLI_DONE;
}

/* ---- JSON ---- */

static void json_fields(json_t *object, const tl_compare_result *result)
{
    json_t *list = cli_json_list(object, "channels");
    for (size_t i = 0; i < result->field_count; i++) {
        const tl_field_error *field = &result->fields[i];
        json_t *item = cli_json_item(list);
        cli_json_text(item, "name", field->name);
        cli_json_text(item, "on", field->on == TL_ON_VERTEX ? "vertex" : "tet");
        cli_json_count(item, "components", field->components);
        cli_json_real(item, "rms", field->rms);
        cli_json_real(item, "max", field->max);
        cli_json_count(item, "max_at", field->max_at);
        cli_json_real(item, "mean", field->mean);
        cli_json_reals(item, "range", field->range, 2);
        cli_json_count(item, "nonfinite", field->nonfinite_count);
    }
}

static void json_isos(json_t *object, const tl_compare_result *result)
{
    json_t *list = cli_json_list(object, "isos");
    for (size_t i = 0; i < result->iso_count; i++) {
        const tl_iso_error *iso = &result->isos[i];
        json_t *item = cli_json_item(list);
        cli_json_text(item, "channel", iso->channel);
        cli_json_real(item, "value", iso->value);
        cli_json_real(item, "mean", iso->mean);
        cli_json_real(item, "hausdorff", iso->hausdorff);
        cli_json_reals(item, "area", iso->area, 2);
        cli_json_count(item, "samples", iso->samples);
    }
}

static void print_json(const cli_session *session, const cli_input pair[2],
                       const tl_compare_result *result, double seconds)
{
    json_t *object = json_object();
    const size_t tets[2] = {tl_mesh_tet_count(pair[0].mesh), tl_mesh_tet_count(pair[1].mesh)};
    const size_t verts[2] = {tl_mesh_vert_count(pair[0].mesh), tl_mesh_vert_count(pair[1].mesh)};
    const bool skipped = cli_get(session, CLI_SKIP_BOUNDARY)->given;
    cli_json_counts(object, "tets", tets, 2);
    cli_json_counts(object, "vertices", verts, 2);
    json_fields(object, result);
    cli_json_count(object, "outside_vertices", result->outside_vertices);
    cli_json_real(object, "outside_distance", result->outside_distance);
    json_t *boundary = cli_json_object(object, "boundary");
    cli_json_real(boundary, "mean", skipped ? (double)NAN : result->boundary_mean);
    cli_json_real(boundary, "hausdorff", skipped ? (double)NAN : result->boundary_hausdorff);
    cli_json_real(boundary, "step", result->boundary_step);
    cli_json_count(boundary, "samples", result->boundary_samples);
    cli_json_reals(object, "volume", result->volume, 2);
    cli_json_reals(object, "area", result->area, 2);
    cli_json_counts(object, "inverted", result->inverted, 2);
    cli_json_counts(object, "degenerate", result->degenerate, 2);
    cli_json_counts(object, "components", result->components, 2);
    cli_json_counts(object, "nonmanifold_faces", result->nonmanifold_faces, 2);
    cli_json_counts(object, "nonmanifold_edges", result->nonmanifold_edges, 2);
    cli_json_counts(object, "nonmanifold_vertices", result->nonmanifold_verts, 2);
    cli_json_real(object, "diagonal", result->diagonal);
    json_isos(object, result);
    cli_json_real(object, "seconds", seconds);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

/* ---- text ---- */

static tl_status print_fields(tl_ctx *ctx, const tl_compare_result *result)
{
    cli_table table;
    if (!result->field_count) {
        puts("\nthe two have no channel in common");
        return TL_OK;
    }
    tl_status st = cli_table_create(ctx, result->field_count + 1, 9, &table);
    if (st) return st;
    cli_table_head(&table, "channel|on|rms|of range|max|of range|mean|of range|range");
    for (size_t i = 0; i < result->field_count; i++) {
        const tl_field_error *field = &result->fields[i];
        double range = field->range[1] - field->range[0];
        cli_table_set(&table, i + 1, 0, cli_name(field->name));
        cli_table_set(&table, i + 1, 1, cli_name(field->on == TL_ON_VERTEX ? "vertex" : "tet"));
        cli_table_set(&table, i + 1, 2, cli_real(field->rms));
        cli_table_set(&table, i + 1, 3, cli_share(field->rms, range));
        cli_table_set(&table, i + 1, 4, cli_real(field->max));
        cli_table_set(&table, i + 1, 5, cli_share(field->max, range));
        cli_table_set(&table, i + 1, 6, cli_real(field->mean));
        cli_table_set(&table, i + 1, 7, cli_share(field->mean, range));
        cli_table_set(&table, i + 1, 8, cli_range(field->range));
    }
    putchar('\n');
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    return TL_OK;
}

static void print_distances(const cli_session *session, const tl_compare_result *result)
{
    printf("\noutside     %s original vertices, the farthest %s away (%s of the diagonal)\n",
           cli_count(result->outside_vertices).s, cli_real(result->outside_distance).s,
           cli_share(result->outside_distance, result->diagonal).s);
    if (!cli_get(session, CLI_SKIP_BOUNDARY)->given)
        printf("boundary    mean distance %s (%s), Hausdorff %s (%s); %s samples, %s apart\n",
               cli_real(result->boundary_mean).s,
               cli_share(result->boundary_mean, result->diagonal).s,
               cli_real(result->boundary_hausdorff).s,
               cli_share(result->boundary_hausdorff, result->diagonal).s,
               cli_count(result->boundary_samples).s, cli_real(result->boundary_step).s);
    for (size_t i = 0; i < result->iso_count; i++) {
        const tl_iso_error *iso = &result->isos[i];
        printf("isosurface  %s = %s: mean distance %s (%s), Hausdorff %s (%s), area %s and %s\n",
               cli_name(iso->channel).s, cli_real(iso->value).s, cli_real(iso->mean).s,
               cli_share(iso->mean, result->diagonal).s, cli_real(iso->hausdorff).s,
               cli_share(iso->hausdorff, result->diagonal).s, cli_real(iso->area[0]).s,
               cli_real(iso->area[1]).s);
    }
}

static void set_pair(cli_table *table, size_t row, const char *name, const size_t counts[2])
{
    cli_table_set(table, row, 0, cli_name(name));
    cli_table_set(table, row, 1, cli_count(counts[0]));
    cli_table_set(table, row, 2, cli_count(counts[1]));
}

static tl_status print_pairs(tl_ctx *ctx, const tl_compare_result *result)
{
    cli_table table;
    tl_status st = cli_table_create(ctx, 9, 4, &table);
    if (st) return st;
    const double *const reals[2] = {result->volume, result->area};
    cli_table_head(&table, "|original|copy|change");
    for (size_t i = 0; i < 2; i++) {
        cli_table_set(&table, i + 1, 0, cli_name(i ? "boundary area" : "volume"));
        cli_table_set(&table, i + 1, 1, cli_real(reals[i][0]));
        cli_table_set(&table, i + 1, 2, cli_real(reals[i][1]));
        cli_table_set(&table, i + 1, 3, cli_share(reals[i][1] - reals[i][0], fabs(reals[i][0])));
    }
    set_pair(&table, 3, "inverted tets", result->inverted);
    set_pair(&table, 4, "flat tets", result->degenerate);
    set_pair(&table, 5, "components", result->components);
    set_pair(&table, 6, "faces of more than two tets", result->nonmanifold_faces);
    set_pair(&table, 7, "non-manifold boundary edges", result->nonmanifold_edges);
    set_pair(&table, 8, "non-manifold boundary vertices", result->nonmanifold_verts);
    putchar('\n');
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    return TL_OK;
}

/* ---- the verb ---- */

static int compare_and_print(cli_session *session, const cli_input pair[2], const iso_list *isos)
{
    const cli_value *spacing = cli_get(session, CLI_SPACING);
    tl_compare_opts opts = tl_compare_opts_defaults();
    tl_compare_result result = {0};
    opts.isos = isos->requests;
    opts.iso_count = isos->count;
    opts.skip_boundary = cli_get(session, CLI_SKIP_BOUNDARY)->given;
    if (spacing->given) /* else the library takes the default, of the larger diagonal */
        opts.sample_step = spacing->percent ? spacing->real * fmax(cli_diagonal(pair[0].mesh),
                                                                   cli_diagonal(pair[1].mesh))
                                            : spacing->real;
    double start = cli_now();
    tl_status st = tl_mesh_compare(session->ctx, pair[0].mesh, pair[1].mesh, &opts, &result);
    double seconds = cli_now() - start;
    cli_progress_clear(&session->progress);
    if (!st && cli_get(session, CLI_JSON)->given) {
        print_json(session, pair, &result, seconds);
    } else if (!st && cli_loud(session)) {
        cli_print_input(session, "original", &pair[0]);
        cli_print_input(session, "copy", &pair[1]);
        st = print_fields(session->ctx, &result);
        print_distances(session, &result);
        if (!st) st = print_pairs(session->ctx, &result);
        printf("\ncompared in %s, %s at most\n", cli_seconds(seconds).s,
               cli_bytes((double)tl_ctx_peak_bytes(session->ctx)).s);
    }
    tl_compare_release(session->ctx, &result);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

static int run(cli_session *session)
{
    iso_list isos;
    cli_input pair[2];
    int exit_status = parse_isos(session, &isos);
    if (!exit_status)
        exit_status = cli_open_volume(session, session->ctx, session->args.operands[0], &pair[0]);
    if (exit_status) return exit_status;
    exit_status = check_isos(session, &isos, pair[0].mesh);
    session->args.values[CLI_REGION].text = NULL; /* the copy has its regions where it was told */
    if (!exit_status) exit_status = cli_step_if_series(session, session->args.operands[1]);
    if (!exit_status)
        exit_status = cli_open_volume(session, session->ctx, session->args.operands[1], &pair[1]);
    if (!exit_status) {
        exit_status = check_isos(session, &isos, pair[1].mesh);
        if (!exit_status) exit_status = compare_and_print(session, pair, &isos);
        cli_close(&pair[1]);
    }
    cli_close(&pair[0]);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod compare flow.vtu small.vtu",
    "Field errors, boundary, volume and validity",
    "tetralod compare flow.vtu small.vtu --iso pressure=0.5",
    "The distance between two isosurfaces as well",
    "tetralod compare neghip.raw small.vtu --raw 64,64,64,u8",
    "A raw volume against its copy; --raw holds for the file that needs it",
    NULL};

const cli_verb cli_verb_compare = {
    .name = "compare",
    .operands = "A B",
    .operand_least = 2,
    .operand_most = 2,
    .about = "say how far mesh B is from mesh A: fields, boundary, isosurfaces, validity",
    .details =
        "A is the original, B the copy. rms and max are taken over the vertices of A (of cell "
        "data: over the centroids), mean over its volume. Vertices that B does not hold are "
        "projected to the nearest point of its boundary and counted. All errors are absolute, "
        "in the unit of the channel or of the mesh.",
    .groups = {&GROUP, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
