/* tetralod simplify of a mesh that does not fit into the memory given: in parts. */
#include <string.h>

#include "cli_session.h"

/* What the library is asked. */
typedef struct parts_request {
    tl_simplify_opts opts;
    tl_segment_opts cut;
    tl_simplify_channel channels[CLI_LIST_MAX];
    char names[CLI_LIST_MAX][CLI_NAME_BYTES];
} parts_request;

/* "A:W,B": names that hold a comma or colon can't be told without the mesh. */
static int add_listed(const cli_session *session, parts_request *r, const char *list)
{
    while (*list) {
        size_t length = strcspn(list, ","), i = r->opts.channel_count;
        double weight = 1;
        if (i == CLI_LIST_MAX)
            return cli_misuse(session->args.verb, "--channels: more than %d channels",
                              CLI_LIST_MAX);
        snprintf(r->names[i], sizeof r->names[i], "%.*s", (int)length, list);
        char *colon = strrchr(r->names[i], ':');
        if (colon) {
            if (!cli_parse_real(colon + 1, &weight) || !(weight > 0 && weight < 1e30))
                return cli_misuse(session->args.verb, "--channels %s: the weight must be above 0",
                                  r->names[i]);
            *colon = '\0';
        }
        r->channels[i] = (tl_simplify_channel){r->names[i], weight, 0};
        r->opts.channel_count++;
        list += length + (list[length] == ',');
    }
    return CLI_DONE;
}

/* A bound of all channels is a fraction of their ranges, one of a channel a number in its unit:
 * ranges are not known yet. */
static int add_errors(const cli_session *session, parts_request *r)
{
    const cli_value *errors = cli_get(session, CLI_ERROR);
    for (size_t e = 0; e < errors->item_count; e++) {
        char name[CLI_NAME_BYTES] = "";
        const char *amount = errors->items[e];
        double value = 0;
        bool percent = false, known = false;
        if (strchr(amount, '=')) cli_split_named(errors->items[e], name, sizeof name, &amount);
        cli_parse_amount(amount, &value, &percent);
        if (percent == (name[0] != '\0'))
            return cli_misuse(session->args.verb,
                              "--error %s: of a mesh in parts, V%% or CHANNEL=V is expected",
                              errors->items[e]);
        if (!name[0]) r->opts.error = value;
        for (size_t i = 0; name[0] && i < r->opts.channel_count; i++) {
            if (strcmp(r->names[i], name) != 0) continue;
            r->channels[i].error = value;
            known = true;
        }
        if (name[0] && !known)
            return cli_misuse(session->args.verb, "--error names '%s', --channels does not", name);
    }
    return CLI_DONE;
}

static int fill_parts(const cli_session *session, parts_request *r)
{
    const cli_value *lists = cli_get(session, CLI_CHANNELS);
    const cli_value *boundary = cli_get(session, CLI_BOUNDARY_ERROR);
    const cli_value *memory = cli_get(session, CLI_MEMORY);
    r->opts = tl_simplify_opts_defaults();
    r->cut = tl_segment_opts_defaults();
    r->cut.folder = cli_work_folder(session);
    r->cut.memory_bytes = memory->count;
    int failed = CLI_DONE;
    for (size_t i = 0; i < lists->item_count && !failed; i++)
        failed = add_listed(session, r, lists->items[i]);
    if (!failed) failed = add_errors(session, r);
    if (r->opts.channel_count) r->opts.channels = r->channels;
    r->opts.boundary_error = boundary->percent ? -boundary->real : boundary->real;
    r->opts.ratio = cli_get(session, CLI_RATIO)->real;
    r->opts.target_tets = (size_t)cli_get(session, CLI_TETS)->count;
    r->opts.method = (tl_simplify_method)cli_get(session, CLI_METHOD)->choice;
    r->opts.placement = (tl_placement)cli_get(session, CLI_PLACEMENT)->choice;
    r->opts.min_quality = cli_get(session, CLI_MIN_QUALITY)->real;
    r->opts.seed = cli_get(session, CLI_SEED)->count;
    return failed;
}

static void print_json(cli_session *session, const char *path, const tl_stream_result *result,
                       double seconds, double cpu)
{
    json_t *object = json_object();
    cli_json_text(object, "file", path);
    cli_json_count(object, "tets_in", result->tets_in);
    cli_json_count(object, "tets_out", result->tets_out);
    cli_json_count(object, "vertices_in", result->vertices_in);
    cli_json_count(object, "vertices_out", result->vertices_out);
    cli_json_real(object, "seconds", result->seconds);
    cli_json_real(object, "all_seconds", seconds);
    cli_json_real(object, "cpu_seconds", cpu);
    cli_json_count(object, "bytes", cli_file_bytes(path));
    cli_json_count(object, "inverted", result->inverted);
    cli_json_count(object, "degenerate", result->degenerate);
    cli_json_real(object, "boundary_error", result->boundary_error);
    cli_json_flag(object, "target_reached", result->target_reached);
    cli_json_flag(object, "in_parts", true);
    cli_json_count(object, "rounds", result->rounds);
    cli_json_count(object, "clusters", result->clusters);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

static void print_text(cli_session *session, const char *path, const tl_stream_result *result,
                       double seconds)
{
    printf("read        %s: %s tets, %s vertices\n", session->args.operands[0],
           cli_count(result->tets_in).s, cli_count(result->vertices_in).s);
    cli_print_notes(session);
    printf("simplified  to %s tets (%s), %s vertices, in parts: %u clusters, %u rounds, %s of %s "
           "(%s tets in)\n",
           cli_count(result->tets_out).s,
           cli_share((double)result->tets_out, (double)result->tets_in).s,
           cli_count(result->vertices_out).s, result->clusters, result->rounds,
           cli_seconds(result->seconds).s, cli_seconds(seconds).s,
           cli_rate((double)result->tets_in / seconds).s);
    if (!result->target_reached &&
        (cli_get(session, CLI_RATIO)->given || cli_get(session, CLI_TETS)->given))
        printf("            the target was NOT reached\n");
    printf("boundary    moved at most %s; errors of channels: tetralod compare\n",
           cli_real(result->boundary_error).s);
    printf("validity    %s inverted, %s flat tets\n", cli_count(result->inverted).s,
           cli_count(result->degenerate).s);
    printf("wrote       %s (%s)\n", path, cli_bytes((double)cli_file_bytes(path)).s);
    printf("memory      %s at most, %.1f bytes an input tet\n",
           cli_bytes((double)result->peak_bytes).s,
           (double)result->peak_bytes / (double)result->tets_in);
}

int cli_simplify_in_parts(cli_session *session)
{
    const char *path = cli_get(session, CLI_OUTPUT)->text, *input = session->args.operands[0];
    tl_write_opts write = tl_write_opts_defaults();
    tl_read_opts read;
    tl_stream_result result;
    parts_request request = {0}, *r = &request;
    write.zlib = cli_get(session, CLI_ZLIB)->given;
    write.ascii = cli_get(session, CLI_ASCII)->given;
    int exit_status = cli_read_opts(session, input, &read);
    if (!exit_status) exit_status = fill_parts(session, r);
    double start = cli_now(), cpu = cli_cpu();
    if (!exit_status) {
        tl_status st = tl_simplify_stream(session->ctx, input, &read, &r->opts, &r->cut, path,
                                          &write, &result, NULL);
        cli_progress_clear(&session->progress);
        if (st) exit_status = cli_fail(session, session->ctx, st);
    }
    double seconds = cli_now() - start;
    cpu = cli_cpu() - cpu;
    if (!exit_status && cli_get(session, CLI_JSON)->given)
        print_json(session, path, &result, seconds, cpu);
    else if (!exit_status && cli_loud(session))
        print_text(session, path, &result, seconds);
    return exit_status;
}
