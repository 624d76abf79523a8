/* tetralod extract: a conforming mesh out of a model, for an error, a budget, a level or a view,
 * with the errors that hold in it. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_camera.h"
#include "cli_model.h"
#include "cli_visible.h"

static const cli_option WANTED[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "OUT", NULL, 0, 0,
     "the mesh file to write; required"},
    {CLI_ERROR, 0, "error", CLI_TYPE_LIST, "[CHANNEL=]V[%]", NULL, 0, 0,
     "bound of the error at every original vertex, for one channel or for all; in percent of the "
     "channel's range, or a number in its unit"},
    {CLI_BOUNDARY_ERROR, 0, "boundary-error", CLI_TYPE_AMOUNT, "D[%]", NULL, 0, 0,
     "how far the boundary may be from the original one, in percent of the box's diagonal, or a "
     "length"},
    {CLI_TETS, 0, "tets", CLI_TYPE_COUNT, "N", NULL, 1, 4294967295.0,
     "at most N tets, with the least error; together with a bound no more than it needs"},
    {CLI_BYTES, 0, "bytes", CLI_TYPE_BYTES, "SIZE", NULL, 0, 0,
     "at most so many bytes of the file, likewise; such as 500K or 2M"},
    {CLI_LEVEL, 0, "level", CLI_TYPE_COUNT, "L", NULL, 0, 63, "all of one level; 0 is the finest"},
    {CLI_FULL, 0, "full", CLI_TYPE_FLAG, NULL, NULL, 0, 0, "the finest mesh, as --level 0"},
    {CLI_CHANNELS, 0, "channels", CLI_TYPE_LIST, "A,B", NULL, 0, 0,
     "write these channels only; the others are not read"},
    {CLI_STEP, 0, "step", CLI_TYPE_TEXT, "N|last", NULL, 0, 0,
     "the time step, where the model has several; the first if not said. Bounds are for its "
     "channels"},
    {CLI_TIME, 0, "time", CLI_TYPE_REAL, "T", NULL, 0, 0, "the step nearest to this time"},
};
static const cli_option PLACES[] = {
    {CLI_BOX, 0, "box", CLI_TYPE_TEXT, "X0,Y0,Z0,X1,Y1,Z1", NULL, 0, 0,
     "errors are bounded in this box only"},
    {CLI_OUTSIDE_ERROR, 0, "outside-error", CLI_TYPE_LIST, "[CHANNEL=]V[%]", NULL, 0, 0,
     "with --box: bound of the error outside of it; without it the mesh is as coarse as can be"},
    {CLI_VIEW, 0, "view", CLI_TYPE_INPUT, "CAMERA", NULL, 0, 0,
     "a JSON file with position, focal_point, view_up, view_angle or parallel_scale, and size; "
     "what "
     "is out of view may have any error"},
    {CLI_PIXELS, 0, "pixels", CLI_TYPE_REAL, "P", "1", DBL_MIN, 65536,
     "with --view: by how many pixels an isosurface or the boundary may be off"},
};
static const cli_option SEEN[] = {
    {CLI_ISO, 0, "iso", CLI_TYPE_LIST, "[CHANNEL=]VALUE", NULL, 0, 0,
     "an isosurface that is looked at; --space-error and --pixels count these alone"},
    {CLI_TRANSFER, 0, "transfer", CLI_TYPE_INPUTS, "[CHANNEL=]FILE", NULL, 0, 0,
     "a colour map in ParaView's JSON: values with an opacity are looked at. Without --iso and "
     "--transfer all values of scalars are"},
    {CLI_SPACE_ERROR, 0, "space-error", CLI_TYPE_AMOUNT, "D[%]", NULL, 0, 0,
     "how far isosurfaces may be from their places, in percent of the box's diagonal, or a "
     "length"},
    {CLI_CLASSIFIED_ERROR, 0, "classified-error", CLI_TYPE_AMOUNT, "E[%]", NULL, 0, 0,
     "bound of the error weighed with opacity: the sum over 64 bins of the range of the largest "
     "error at values in the bin, as a part of the range, times the bin's opacity"},
};
static const cli_group SEEN_GROUP = {"What is looked at", SEEN, sizeof SEEN / sizeof *SEEN};
static const cli_group WANTED_GROUP = {"What is wanted", WANTED, sizeof WANTED / sizeof *WANTED};
static const cli_group PLACES_GROUP = {"Where", PLACES, sizeof PLACES / sizeof *PLACES};

/* What the words ask of the library. */
typedef struct request {
    tl_store *store;
    const tl_store_head *head;
    tl_cut_query query;
    double *inside, *outside; /* [channel_count] bounds */
    double box[6];
    tl_camera camera;
    float *opacity; /* [channel_count][TL_BINS] or NULL */
    size_t *channels;
    size_t channel_count;
    cli_model_step step;
} request;

static int check_words(const cli_session *session)
{
    const cli_verb *verb = session->args.verb;
    bool level = cli_get(session, CLI_LEVEL)->given, full = cli_get(session, CLI_FULL)->given;
    bool error = cli_get(session, CLI_ERROR)->given, tets = cli_get(session, CLI_TETS)->given;
    bool boundary = cli_get(session, CLI_BOUNDARY_ERROR)->given;
    bool view = cli_get(session, CLI_VIEW)->given, bytes = cli_get(session, CLI_BYTES)->given;
    bool space = cli_get(session, CLI_SPACE_ERROR)->given;
    bool classified = cli_get(session, CLI_CLASSIFIED_ERROR)->given;
    if (!cli_get(session, CLI_OUTPUT)->given) return cli_misuse(verb, "-o OUT is missing");
    if (!(level || full || error || tets || bytes || boundary || space || classified || view))
        return cli_misuse(verb,
                          "how fine? say --error E, --tets N, --level L, --full or --view CAMERA");
    if (level && full) return cli_misuse(verb, "--level and --full are both given; say one");
    if (!cli_get(session, CLI_BOX)->given && cli_get(session, CLI_OUTSIDE_ERROR)->given)
        return cli_misuse(verb, "--outside-error needs --box");
    if (cli_get(session, CLI_BOX)->given && !(error || boundary || space || classified))
        return cli_misuse(verb, "--box needs --error or --boundary-error, which hold in it");
    if ((cli_get(session, CLI_ISO)->given || cli_get(session, CLI_TRANSFER)->given) &&
        !(space || classified || view))
        return cli_misuse(verb, "--iso and --transfer need --space-error, --classified-error or "
                                "--view, which count what is looked at");
    if (cli_get(session, CLI_PIXELS)->given && !view)
        return cli_misuse(verb, "--pixels needs --view");
    return CLI_DONE;
}

/* Sets the bounds of channels; those for one channel stand before those for all. */
static int set_bounds(const cli_session *session, const request *r, cli_id id, double *bounds)
{
    const cli_value *words = cli_get(session, id);
    for (size_t c = 0; c < r->head->channel_count; c++) bounds[c] = INFINITY;
    for (int named = 0; named < 2; named++)
        for (size_t i = 0; i < words->item_count; i++) {
            char name[CLI_NAME_BYTES];
            double value;
            bool percent, found = false;
            if (!cli_parse_bound(words->items[i], name, &value, &percent))
                return cli_misuse(session->args.verb,
                                  "--%s %s: expected V, V%%, CHANNEL=V or CHANNEL=V%%, above 0",
                                  id == CLI_ERROR ? "error" : "outside-error", words->items[i]);
            if ((*name != '\0') != named) continue;
            for (size_t c = 0; c < r->head->channel_count; c++) {
                const tl_store_channel *channel = &r->head->channels[c];
                if (!cli_in_step(channel, &r->step)) continue;
                if (named && strcmp(channel->name, name) != 0) continue;
                double range = channel->range[1] - channel->range[0];
                bounds[c] = percent ? value * range : value;
                found = true;
            }
            if (named && !found) return cli_unknown_in_model(session, r->head, &r->step, name);
        }
    return CLI_DONE;
}

static int set_box(const cli_session *session, request *r)
{
    const cli_value *word = cli_get(session, CLI_BOX);
    if (!word->given) return CLI_DONE;
    if (!cli_parse_reals(word->text, r->box, 6))
        return cli_misuse(session->args.verb, "--box %s: expected X0,Y0,Z0,X1,Y1,Z1", word->text);
    r->query.box = r->box;
    return CLI_DONE;
}

/* Adds the channels of a list A,B that names no channel as a whole. */
static int add_channels(const cli_session *session, request *r, const char *list)
{
    while (*list) {
        char name[CLI_NAME_BYTES];
        size_t length = strcspn(list, ","), found = SIZE_MAX;
        for (size_t c = 0; c < r->head->channel_count; c++)
            if (strcmp(r->head->channels[c].name, list) == 0) length = strlen(list);
        snprintf(name, sizeof name, "%.*s", (int)length, list);
        for (size_t c = r->head->channel_count; c-- > 0;)
            if (cli_in_step(&r->head->channels[c], &r->step) &&
                strcmp(r->head->channels[c].name, name) == 0)
                found = c;
        if (found == SIZE_MAX) return cli_unknown_in_model(session, r->head, &r->step, name);
        for (size_t i = 0; i < r->channel_count; i++)
            if (r->channels[i] == found) found = SIZE_MAX;
        if (found != SIZE_MAX) r->channels[r->channel_count++] = found;
        list += length + (list[length] == ',');
    }
    return CLI_DONE;
}

/* A length, or a part of the diagonal. */
static void set_length(const tl_store_head *head, const cli_value *word, double *bound)
{
    if (word->given) *bound = word->percent ? word->real * head->stats.diagonal : word->real;
}

static int fill_request(cli_session *session, request *r)
{
    tl_status st = TL_OK;
    int failed = CLI_DONE;
    const cli_value *lists = cli_get(session, CLI_CHANNELS);
    size_t count = r->head->channel_count;
    r->inside = tl_mem_alloc(session->ctx, count, sizeof *r->inside, &st);
    r->outside = tl_mem_alloc(session->ctx, count, sizeof *r->outside, &st);
    r->channels = tl_mem_alloc(session->ctx, count, sizeof *r->channels, &st);
    if (st) return cli_fail(session, session->ctx, st);
    failed = cli_choose_step(session, r->head, &r->step);
    if (!failed) failed = set_bounds(session, r, CLI_ERROR, r->inside);
    if (!failed) failed = set_bounds(session, r, CLI_OUTSIDE_ERROR, r->outside);
    if (!failed) failed = set_box(session, r);
    for (size_t c = 0; !lists->given && c < count; c++)
        if (cli_in_step(&r->head->channels[c], &r->step)) r->channels[r->channel_count++] = c;
    for (size_t i = 0; !failed && i < lists->item_count; i++)
        failed = add_channels(session, r, lists->items[i]);
    if (!failed && cli_get(session, CLI_VIEW)->given) {
        failed = cli_camera_read(session, cli_get(session, CLI_VIEW)->text, &r->camera);
        r->query.camera = &r->camera;
        r->query.pixels = cli_get(session, CLI_PIXELS)->real;
    }
    r->query.bounds.channels = r->inside;
    r->query.outside.channels = r->outside;
    set_length(r->head, cli_get(session, CLI_BOUNDARY_ERROR), &r->query.bounds.boundary);
    set_length(r->head, cli_get(session, CLI_SPACE_ERROR), &r->query.bounds.space);
    if (cli_get(session, CLI_CLASSIFIED_ERROR)->given)
        r->query.bounds.classified = cli_get(session, CLI_CLASSIFIED_ERROR)->real;
    if (!failed) failed = cli_visible_read(session, r->head, &r->opacity);
    r->query.opacity = r->opacity;
    if (cli_get(session, CLI_BYTES)->given) r->query.bytes_max = cli_get(session, CLI_BYTES)->count;
    if (cli_get(session, CLI_TETS)->given) r->query.tets_max = cli_get(session, CLI_TETS)->count;
    if (cli_get(session, CLI_LEVEL)->given)
        r->query.level = (uint32_t)cli_get(session, CLI_LEVEL)->count;
    if (cli_get(session, CLI_FULL)->given) r->query.level = 0;
    return failed;
}

/* ---- summaries ---- */

typedef struct outcome {
    tl_cut_state state;
    size_t vertices;
    uint64_t bytes;
    double seconds, write_seconds;
} outcome;

static void print_json(const cli_session *session, const request *r, const tl_cut *cut,
                       const outcome *o)
{
    json_t *object = json_object();
    cli_json_text(object, "file", cli_get(session, CLI_OUTPUT)->text);
    cli_json_count(object, "tets", o->state.tets);
    cli_json_count(object, "vertices", o->vertices);
    cli_json_count(object, "patches", o->state.patches);
    if (r->step.is_chosen) {
        cli_json_count(object, "step", r->step.number);
        cli_json_real(object, "time", r->step.time);
    }
    json_t *list = cli_json_list(object, "bounds_promised");
    for (size_t c = 0; c < r->head->channel_count; c++) {
        if (!cli_in_step(&r->head->channels[c], &r->step)) continue;
        json_t *item = cli_json_item(list);
        cli_json_text(item, "channel", r->head->channels[c].name);
        cli_json_real(item, "error", tl_cut_channel_error(cut, c));
        cli_json_real(item, "time", r->head->channels[c].time);
    }
    cli_json_real(object, "boundary_error", o->state.boundary_error);
    cli_json_real(object, "space_error", o->state.space_error);
    if (r->query.camera) cli_json_real(object, "pixels", o->state.pixels);
    cli_json_flag(object, "bounds_kept", o->state.bounds_kept);
    cli_json_real(object, "seconds", o->seconds);
    cli_json_real(object, "write_seconds", o->write_seconds);
    cli_json_count(object, "bytes", o->bytes);
    cli_json_count(object, "bytes_read", tl_store_bytes_read(r->store));
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

static tl_status print_text(const cli_session *session, const request *r, const tl_cut *cut,
                            const outcome *o)
{
    cli_table table;
    printf("extracted   %s of %s tets, %s vertices, from %s patches, in %s\n",
           cli_count(o->state.tets).s, cli_count(r->head->input_tets).s, cli_count(o->vertices).s,
           cli_count(o->state.patches).s, cli_seconds(o->seconds).s);
    if (!o->state.bounds_kept)
        printf("            what was asked for is NOT kept: this is what the model, or the budget, "
               "allows\n");
    size_t count = 0, row = 0;
    for (size_t c = 0; c < r->head->channel_count; c++)
        count += cli_in_step(&r->head->channels[c], &r->step);
    if (r->step.is_chosen)
        printf("step        %u, time %s\n", r->step.number, cli_real(r->step.time).s);
    tl_status st = count ? cli_table_create(session->ctx, count + 1, 4, &table) : TL_OK;
    if (count && !st) {
        cli_table_head(&table, "channel|error at most|of range|range");
        for (size_t c = 0; c < r->head->channel_count; c++) {
            const tl_store_channel *channel = &r->head->channels[c];
            double error = tl_cut_channel_error(cut, c);
            if (!cli_in_step(channel, &r->step)) continue;
            cli_table_set(&table, ++row, 0, cli_name(channel->name));
            cli_table_set(&table, row, 1, cli_real(error));
            cli_table_set(&table, row, 2, cli_share(error, channel->range[1] - channel->range[0]));
            cli_table_set(&table, row, 3, cli_range(channel->range));
        }
        putchar('\n');
        cli_table_print(&table, 0);
        putchar('\n');
        cli_table_destroy(&table);
    }
    printf("boundary    at most %s from the original one (%s of the diagonal)\n",
           cli_real(o->state.boundary_error).s,
           cli_share(o->state.boundary_error, r->head->stats.diagonal).s);
    if (cli_get(session, CLI_SPACE_ERROR)->given || r->query.opacity)
        printf("isosurfaces at most %s from their places\n", cli_real(o->state.space_error).s);
    if (r->query.camera)
        printf("view        off by at most %s pixels\n", cli_real(o->state.pixels).s);
    printf("wrote       %s (%s, %s)\n", cli_get(session, CLI_OUTPUT)->text,
           cli_bytes((double)o->bytes).s, cli_seconds(o->write_seconds).s);
    return st;
}

/* ---- the verb ---- */

static int extract(cli_session *session, request *r)
{
    tl_cut *cut = NULL;
    tl_mesh *mesh = NULL;
    outcome o = {0};
    double start = cli_now();
    tl_status st = tl_cut_create(session->ctx, r->store, &cut);
    if (!st) st = tl_cut_update(cut, &r->query);
    if (!st) st = tl_cut_mesh(cut, r->channels, r->channel_count, &mesh);
    if (!st) tl_mesh_set_time(mesh, r->step.is_chosen ? r->step.time : r->head->time);
    o.seconds = cli_now() - start;
    int exit_status = st ? cli_fail(session, session->ctx, st)
                         : cli_save(session, session->ctx, mesh, cli_get(session, CLI_OUTPUT)->text,
                                    &o.bytes, &o.write_seconds);
    if (!exit_status) {
        o.state = tl_cut_get_state(cut);
        o.vertices = tl_mesh_vert_count(mesh);
        if (cli_get(session, CLI_JSON)->given)
            print_json(session, r, cut, &o);
        else if (cli_loud(session))
            st = print_text(session, r, cut, &o);
        if (st) exit_status = cli_fail(session, session->ctx, st);
    }
    tl_mesh_destroy(mesh);
    tl_cut_destroy(cut);
    return exit_status;
}

static int run(cli_session *session)
{
    request r = {.query = tl_cut_query_defaults()};
    int exit_status = check_words(session);
    if (!exit_status) exit_status = cli_output_check(session, cli_get(session, CLI_OUTPUT)->text);
    if (exit_status) return exit_status;
    tl_status st = tl_store_open(session->ctx, session->args.operands[0], &r.store);
    if (st) return cli_fail(session, session->ctx, st);
    r.head = tl_store_get_head(r.store);
    exit_status = fill_request(session, &r);
    if (!exit_status) exit_status = extract(session, &r);
    tl_mem_free(session->ctx, r.opacity);
    tl_mem_free(session->ctx, r.channels);
    tl_mem_free(session->ctx, r.outside);
    tl_mem_free(session->ctx, r.inside);
    tl_store_close(r.store);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod extract flow.tlod -o small.vtu --error 1%",
    "As few tets as an error of 1 % of each channel's range allows",
    "tetralod extract flow.tlod -o small.vtu --tets 50000",
    "The best mesh of at most 50,000 tets",
    "tetralod extract flow.tlod -o wake.vtu --error 0.2% --box 0,-1,-1,4,1,1 --outside-error 5%",
    "Fine in a box, coarse around it, without a gap",
    "tetralod extract flow.tlod -o seen.vtu --view camera.json --pixels 1",
    "As fine as one pixel of a view asks for",
    "tetralod extract flow.tlod -o iso.vtu --iso pressure=1.2 --space-error 0.5%",
    "An isosurface within half a percent of the diagonal of its place",
    "tetralod extract flow.tlod -o seen.vtu --transfer map.json --classified-error 2%",
    "As fine as the visible values of a colour map ask for",
    NULL};

const cli_verb cli_verb_extract = {
    .name = "extract",
    .operands = "M.tlod -o OUT (--error E | --tets N | --level L | --full | --view CAMERA | ...)",
    .operand_least = 1,
    .operand_most = 1,
    .about = "take a conforming mesh out of a model, at a known error",
    .details = "Errors hold at every original vertex; those of a vector or tensor are norms of "
               "differences. In JSON all errors are absolute; seconds is the extraction alone.",
    .groups = {&WANTED_GROUP, &PLACES_GROUP, &SEEN_GROUP, &cli_group_writing, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
