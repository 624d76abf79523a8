/* tetralod simplify: fewer tets at a known error. Translates what a user says, percentages of
 * ranges and of the diagonal, into the absolute bounds of the library, and reports promise and
 * measurement side by side. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "cli_session.h"

static const cli_option TARGET[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "OUT", NULL, 0, 0,
     "the file to write, as what its ending says: .vtu, .vtk, .msh, .mesh, .exo, .node; required"},
    {CLI_RATIO, 0, "ratio", CLI_TYPE_AMOUNT, "R", NULL, DBL_MIN, 1,
     "stop at this part of the tets, such as 0.1 or 10%"},
    {CLI_TETS, 0, "tets", CLI_TYPE_COUNT, "N", NULL, 1, 4294967295.0, "stop at N tets or less"},
    {CLI_ERROR, 0, "error", CLI_TYPE_LIST, "[CHANNEL=]V[%]", NULL, 0, 0,
     "bound of the error at every original vertex, for one channel or for all; in percent of the "
     "channel's range, or a number in its unit"},
    {CLI_BOUNDARY_ERROR, 0, "boundary-error", CLI_TYPE_AMOUNT, "D[%]", "0.1%", 0, 0,
     "how far the boundary and the interfaces between regions may move, in percent of the box's "
     "diagonal, or a length"},
    {CLI_TMP, 0, "tmp", CLI_TYPE_TEXT, "DIR", NULL, 0, 0,
     "folder for work files of a mesh in parts, which have no names; TMPDIR, else /tmp, if not "
     "said"},
};
static const cli_option STEERING[] = {
    {CLI_CHANNELS, 0, "channels", CLI_TYPE_LIST, "A[:W],B[:W]", NULL, 0, 0,
     "the channels on vertices that steer and are held, with weights (1 if not said); the others "
     "are carried along. Without it, all of them"},
    {CLI_METHOD, 0, "method", CLI_TYPE_CHOICE, "auto|queue|independent|randomized|blocks", "auto",
     0, 0,
     "order of the collapses: the best by measurement, always the cheapest (one thread), rounds of "
     "independent ones (one thread), the cheapest of a few random ones (one thread), the cheapest "
     "in "
     "each of many blocks"},
    {CLI_PLACEMENT, 0, "placement", CLI_TYPE_CHOICE, "optimal|subset", "optimal", 0, 0,
     "new vertices lie where the error is smallest, or are original ones"},
    {CLI_MIN_QUALITY, 0, "min-quality", CLI_TYPE_REAL, "Q", "0.01", 0, 1,
     "mean ratio (1 regular, 0 flat) that no new tet falls below"},
    {CLI_SEED, 0, "seed", CLI_TYPE_COUNT, "N", "1", 0, 0, "seed of the randomized method"},
};
static const cli_group TARGET_GROUP = {"Target", TARGET, sizeof TARGET / sizeof *TARGET};
static const cli_group STEERING_GROUP = {"Steering", STEERING, sizeof STEERING / sizeof *STEERING};

/* The channels that steer, with their bounds, and what the library is asked. */
typedef struct request {
    tl_simplify_opts opts;
    tl_simplify_channel *channels; /* [channel_count] */
    double (*ranges)[2];           /* [channel_count] */
    size_t channel_count;
    double diagonal;
    double cpu_seconds; /* of all threads, measuring included */
} request;

/* ---- options ---- */

/* What can be refused before anything is read. */
static int check_words(const cli_session *session)
{
    const cli_verb *verb = session->args.verb;
    const cli_value *errors = cli_get(session, CLI_ERROR);
    const bool ratio = cli_get(session, CLI_RATIO)->given, tets = cli_get(session, CLI_TETS)->given;
    if (!cli_get(session, CLI_OUTPUT)->given) return cli_misuse(verb, "-o OUT is missing");
    if (!ratio && !tets && !errors->given)
        return cli_misuse(verb, "how far? say one of --ratio R, --tets N and --error E");
    if (ratio && tets) return cli_misuse(verb, "--ratio and --tets are both given; say one");
    for (size_t i = 0; i < errors->item_count; i++) {
        char name[CLI_NAME_BYTES];
        double value;
        bool percent;
        if (!cli_parse_bound(errors->items[i], name, &value, &percent))
            return cli_misuse(verb,
                              "--error %s: expected V, V%%, CHANNEL=V or CHANNEL=V%%, above 0",
                              errors->items[i]);
    }
    return CLI_DONE;
}

static tl_simplify_channel *find_request(request *r, const char *name)
{
    for (size_t i = 0; i < r->channel_count; i++)
        if (strcmp(r->channels[i].name, name) == 0) return &r->channels[i];
    return NULL;
}

static void add_channel(request *r, const tl_mesh *mesh, const tl_channel *channel, double weight)
{
    tl_simplify_channel *old = find_request(r, channel->name);
    if (old) {
        old->weight = weight;
        return;
    }
    tl_channel_range(channel, tl_mesh_vert_count(mesh), r->ranges[r->channel_count], NULL);
    r->channels[r->channel_count++] = (tl_simplify_channel){channel->name, weight, 0};
}

/* "NAME" or "NAME:WEIGHT"; a channel whose name holds a colon is found first. */
static int add_named(const cli_session *session, request *r, const tl_mesh *mesh, const char *word)
{
    char name[CLI_NAME_BYTES];
    double weight = 1;
    const tl_channel *channel = cli_vertex_channel(mesh, word);
    const char *colon = strrchr(word, ':');
    if (!channel && colon) {
        snprintf(name, sizeof name, "%.*s", (int)(colon - word), word);
        channel = cli_vertex_channel(mesh, name);
        if (channel && (!cli_parse_real(colon + 1, &weight) || !(weight > 0 && weight < 1e30)))
            return cli_misuse(session->args.verb, "--channels %s: the weight must be above 0",
                              word);
    }
    if (!channel) return cli_unknown_channel(session, mesh, word);
    add_channel(r, mesh, channel, weight);
    return CLI_DONE;
}

static int add_listed(const cli_session *session, request *r, const tl_mesh *mesh, const char *list)
{
    if (cli_vertex_channel(mesh, list)) return add_named(session, r, mesh, list);
    while (*list) {
        char word[CLI_NAME_BYTES];
        size_t length = strcspn(list, ",");
        snprintf(word, sizeof word, "%.*s", (int)length, list);
        int failed = add_named(session, r, mesh, word);
        if (failed) return failed;
        list += length + (list[length] == ',');
    }
    return CLI_DONE;
}

/* Sets the bounds; those for one channel stand before those for all. */
static int add_errors(const cli_session *session, request *r, const tl_mesh *mesh)
{
    const cli_value *errors = cli_get(session, CLI_ERROR);
    for (int named = 0; named < 2; named++) {
        for (size_t e = 0; e < errors->item_count; e++) {
            char name[CLI_NAME_BYTES];
            double value = 0;
            bool percent = false;
            cli_parse_bound(errors->items[e], name, &value, &percent);
            if ((*name != '\0') != named) continue;
            if (named && !find_request(r, name)) {
                if (!cli_vertex_channel(mesh, name))
                    return cli_unknown_channel(session, mesh, name);
                return cli_misuse(session->args.verb, "--error names '%s', --channels does not",
                                  name);
            }
            for (size_t i = 0; i < r->channel_count; i++) {
                if (named && strcmp(r->channels[i].name, name) != 0) continue;
                double range = r->ranges[i][1] - r->ranges[i][0];
                r->channels[i].error = percent ? value * range : value;
            }
            /* a fraction also holds for a channel whose range is 0, where no absolute one can */
            if (!named) r->opts.error = percent ? value : 0;
        }
    }
    for (size_t i = 0; i < r->channel_count; i++)
        if (r->channels[i].error > r->opts.error * (r->ranges[i][1] - r->ranges[i][0]))
            r->opts.error = 0; /* one channel may err more than the rest: each by its own bound */
    return CLI_DONE;
}

static bool all_constant(const request *r)
{
    for (size_t i = 0; i < r->channel_count; i++)
        if (r->ranges[i][1] > r->ranges[i][0]) return false;
    return true;
}

static int fill_request(cli_session *session, const tl_mesh *mesh, request *r)
{
    const cli_value *lists = cli_get(session, CLI_CHANNELS);
    size_t count = cli_vertex_channel_count(mesh);
    tl_status st = TL_OK;
    int failed = CLI_DONE;
    *r = (request){.opts = tl_simplify_opts_defaults(), .diagonal = cli_diagonal(mesh)};
    r->channels = tl_mem_zalloc(session->ctx, count, sizeof *r->channels, &st);
    r->ranges = tl_mem_zalloc(session->ctx, count, sizeof *r->ranges, &st);
    if (st) return cli_fail(session, session->ctx, st);
    if (!isfinite(r->diagonal)) {
        fprintf(stderr, "tetralod: '%s' is too large: the diagonal of its box overflows\n",
                session->args.operands[0]);
        return CLI_FAILED;
    }
    for (size_t i = 0; i < lists->item_count && !failed; i++)
        failed = add_listed(session, r, mesh, lists->items[i]);
    for (size_t i = 0; i < tl_mesh_channel_count(mesh) && !lists->given; i++)
        if (tl_mesh_channel(mesh, i)->on == TL_ON_VERTEX)
            add_channel(r, mesh, tl_mesh_channel(mesh, i), 1);
    if (!failed) failed = add_errors(session, r, mesh);
    if (failed) return failed;

    const cli_value *boundary = cli_get(session, CLI_BOUNDARY_ERROR);
    r->opts.channels = r->channel_count ? r->channels : NULL;
    r->opts.channel_count = r->channel_count;
    r->opts.boundary_error = boundary->percent ? boundary->real * r->diagonal : boundary->real;
    r->opts.ratio = cli_get(session, CLI_RATIO)->real;
    r->opts.target_tets = (size_t)cli_get(session, CLI_TETS)->count;
    r->opts.method = (tl_simplify_method)cli_get(session, CLI_METHOD)->choice;
    r->opts.placement = (tl_placement)cli_get(session, CLI_PLACEMENT)->choice;
    r->opts.min_quality = cli_get(session, CLI_MIN_QUALITY)->real;
    r->opts.seed = cli_get(session, CLI_SEED)->count;
    if (!r->opts.ratio && !r->opts.target_tets && all_constant(r))
        r->opts.target_tets = 1; /* no field can err, so boundary and shape are the only limits */
    return CLI_DONE;
}

/* ---- summaries ---- */

/* The promise for a channel of the result, 0 if there is none. */
static double bound_of(request *r, const tl_simplify_channel_result *channel)
{
    const tl_simplify_channel *asked = find_request(r, channel->name);
    double fraction = r->opts.error * (channel->range[1] - channel->range[0]);
    if (!asked) return 0; /* carried along */
    if (!(asked->error > 0)) return fraction;
    return fraction > 0 && fraction < asked->error ? fraction : asked->error;
}

static void print_json(const cli_session *session, const cli_input *input, request *r,
                       const tl_simplify_result *result, const char *path, uint64_t bytes,
                       double write_seconds)
{
    json_t *object = json_object();
    cli_json_text(object, "file", path);
    cli_json_count(object, "tets_in", result->tets_in);
    cli_json_count(object, "tets_out", result->tets_out);
    cli_json_count(object, "vertices_in", result->vertices_in);
    cli_json_count(object, "vertices_out", result->vertices_out);
    cli_json_real(object, "seconds", result->seconds);
    cli_json_real(object, "cpu_seconds", r->cpu_seconds);
    cli_json_real(object, "measure_seconds", result->measure_seconds);
    cli_json_real(object, "write_seconds", write_seconds);
    cli_json_count(object, "bytes", bytes);
    cli_json_count(object, "inverted", result->inverted);
    cli_json_count(object, "degenerate", result->degenerate);
    cli_json_real(object, "boundary_error", result->boundary_error);
    cli_json_real(object, "boundary_bound", r->opts.boundary_error);
    cli_json_count(object, "outside_vertices", result->outside_vertices);
    cli_json_flag(object, "target_reached", result->target_reached);
    cli_json_text(object, "stopped_by", result->stopped_by);
    json_t *list = cli_json_list(object, "channels");
    for (size_t i = 0; i < result->channel_count; i++) {
        const tl_simplify_channel_result *channel = &result->channels[i];
        double bound = bound_of(r, channel);
        json_t *item = cli_json_item(list);
        cli_json_text(item, "name", channel->name);
        cli_json_real(item, "max_error", channel->max_error);
        cli_json_real(item, "rms_error", channel->rms_error);
        cli_json_real(item, "bound", bound > 0 ? bound : (double)NAN);
        cli_json_reals(item, "range", channel->range, 2);
    }
    cli_json_report(object, input);
    cli_json_facts(object, session->ctx);
    json_object_set_new(object, "peak_bytes", json_integer((json_int_t)result->peak_bytes));
    cli_json_print(object);
}

static tl_status print_channels(tl_ctx *ctx, request *r, const tl_simplify_result *result)
{
    cli_table table;
    if (!result->channel_count) return TL_OK;
    tl_status st = cli_table_create(ctx, result->channel_count + 1, 7, &table);
    if (st) return st;
    cli_table_head(&table, "channel|max error|of range|rms error|of range|bound|range");
    for (size_t i = 0; i < result->channel_count; i++) {
        const tl_simplify_channel_result *channel = &result->channels[i];
        double range = channel->range[1] - channel->range[0], bound = bound_of(r, channel);
        cli_table_set(&table, i + 1, 0, cli_name(channel->name));
        cli_table_set(&table, i + 1, 1, cli_real(channel->max_error));
        cli_table_set(&table, i + 1, 2, cli_share(channel->max_error, range));
        cli_table_set(&table, i + 1, 3, cli_real(channel->rms_error));
        cli_table_set(&table, i + 1, 4, cli_share(channel->rms_error, range));
        cli_table_set(&table, i + 1, 5, bound > 0 ? cli_real(bound) : cli_name("none"));
        cli_table_set(&table, i + 1, 6, cli_range(channel->range));
    }
    putchar('\n');
    cli_table_print(&table, 0);
    putchar('\n');
    cli_table_destroy(&table);
    return TL_OK;
}

static void print_stop(const cli_session *session, const tl_simplify_result *result)
{
    static const char *const WORDS[][2] = {{"target", "by the target"},
                                           {"error", "by the bound on the error"},
                                           {"boundary error", "by the bound on the boundary"},
                                           {"shape", "by the shape of the mesh"}};
    const bool target = cli_get(session, CLI_RATIO)->given || cli_get(session, CLI_TETS)->given;
    const char *words = result->stopped_by;
    for (size_t i = 0; i < sizeof WORDS / sizeof *WORDS; i++)
        if (strcmp(result->stopped_by, WORDS[i][0]) == 0) words = WORDS[i][1];
    printf("            %sstopped %s\n",
           target && !result->target_reached ? "the target was NOT reached: " : "", words);
}

static tl_status print_text(cli_session *session, const cli_input *input, request *r,
                            const tl_simplify_result *result, const char *path, uint64_t bytes,
                            double write_seconds)
{
    cli_print_input(session, "read", input);
    printf("simplified  to %s tets (%s), %s vertices, in %s (%s tets in) and %s of measuring\n",
           cli_count(result->tets_out).s,
           cli_share((double)result->tets_out, (double)result->tets_in).s,
           cli_count(result->vertices_out).s, cli_seconds(result->seconds).s,
           cli_rate((double)result->tets_in / result->seconds).s,
           cli_seconds(result->measure_seconds).s);
    cli_print_notes(session);
    print_stop(session, result);
    tl_status st = print_channels(session->ctx, r, result);
    printf("boundary    moved at most %s of %s allowed (%s of the diagonal)\n",
           cli_real(result->boundary_error).s, cli_real(r->opts.boundary_error).s,
           cli_share(r->opts.boundary_error, r->diagonal).s);
    printf("validity    %s inverted, %s flat tets (the input held %s and %s)\n",
           cli_count(result->inverted).s, cli_count(result->degenerate).s,
           cli_count(input->report.inverted).s, cli_count(input->report.degenerate).s);
    printf("wrote       %s (%s, %s)\n", path, cli_bytes((double)bytes).s,
           cli_seconds(write_seconds).s);
    printf("memory      %s at most, %.0f bytes an input tet\n",
           cli_bytes((double)result->peak_bytes).s,
           (double)result->peak_bytes / (double)result->tets_in);
    return st;
}

/* ---- the verb ---- */

static int simplify_and_save(cli_session *session, const cli_input *input, request *r)
{
    const char *path = cli_get(session, CLI_OUTPUT)->text;
    tl_mesh *out = NULL;
    tl_simplify_result result = {0};
    uint64_t bytes = 0;
    double seconds = 0;
    double cpu = cli_cpu();
    tl_status st = tl_mesh_simplify(session->ctx, input->mesh, &r->opts, &out, &result);
    r->cpu_seconds = cli_cpu() - cpu;
    cli_progress_clear(&session->progress);
    if (st) return cli_fail(session, session->ctx, st);
    int exit_status = cli_save(session, session->ctx, out, path, &bytes, &seconds);
    if (!exit_status && cli_get(session, CLI_JSON)->given)
        print_json(session, input, r, &result, path, bytes, seconds);
    else if (!exit_status && cli_loud(session))
        st = print_text(session, input, r, &result, path, bytes, seconds);
    if (st) exit_status = cli_fail(session, session->ctx, st);
    tl_simplify_release(session->ctx, &result);
    tl_mesh_destroy(out);
    return exit_status;
}

/* A mesh takes about four times the bytes of its file while it is simplified. */
static bool is_too_large(const cli_session *session)
{
    const cli_value *memory = cli_get(session, CLI_MEMORY);
    return memory->given && cli_file_bytes(session->args.operands[0]) > memory->count / 4;
}

static int run(cli_session *session)
{
    cli_input input;
    request r;
    int exit_status = check_words(session);
    if (!exit_status) exit_status = cli_output_check(session, cli_get(session, CLI_OUTPUT)->text);
    if (!exit_status && is_too_large(session)) return cli_simplify_in_parts(session);
    if (!exit_status)
        exit_status = cli_open_volume(session, session->ctx, session->args.operands[0], &input);
    if (exit_status) return exit_status;
    exit_status = fill_request(session, input.mesh, &r);
    if (!exit_status) exit_status = simplify_and_save(session, &input, &r);
    tl_mem_free(session->ctx, r.ranges);
    tl_mem_free(session->ctx, r.channels);
    cli_close(&input);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod simplify flow.vtu -o small.vtu --ratio 0.1",
    "A tenth of the tets",
    "tetralod simplify flow.vtu -o small.vtu --error 0.5%",
    "As few tets as an error of 0.5 % of each channel's range allows",
    "tetralod simplify flow.vtu -o small.vtu --tets 100000 --channels pressure,velocity:2 --error "
    "pressure=0.01",
    "At most 100,000 tets, velocity counting twice, pressure within 0.01 of its unit",
    NULL};

const cli_verb cli_verb_simplify = {
    .name = "simplify",
    .operands = "IN -o OUT (--ratio R | --tets N | --error E)",
    .operand_least = 1,
    .operand_most = 1,
    .may_replace = true,
    .about = "make a mesh smaller, to a number of tets or as far as an error allows",
    .details =
        "A bound always wins over a target: where a bound keeps a target from being reached, the "
        "result is as small as the bound allows and says so. Errors are measured at every original "
        "vertex; those of a vector or tensor are norms of differences. In JSON all errors are "
        "absolute; seconds is the simplification alone, measure_seconds the measuring after it. "
        "With "
        "--memory, a file of more than a quarter of it is simplified in parts, through temporary "
        "files (--tmp): errors are then not measured, and a bound is kept by leaving the borders "
        "of "
        "the parts as they are.",
    .groups = {&TARGET_GROUP, &STEERING_GROUP, &cli_group_reading, &cli_group_writing,
               &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
