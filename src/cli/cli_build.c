/* tetralod build: one multi-resolution file out of a data set. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "cli_model.h"
#include "tetralod/model.h"

/* As a part of the diagonal: tets of a model are larger. */
#define POSITION_ERROR_MAX 0.01

static const cli_option RESULT[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "M.tlod", NULL, 0, 0,
     "the file to make; required"},
    {CLI_CHANNELS, 0, "channels", CLI_TYPE_LIST, "A,B", NULL, 0, 0,
     "the channels that are taken. Without it, all of them"},
    {CLI_CHANNEL_ERROR, 0, "channel-error", CLI_TYPE_LIST, "[CHANNEL=]V[%]|lossless", NULL, 0, 0,
     "what storing may change a value by, for one channel or for all (then in percent of the "
     "range, 0.01% if not said)"},
    {CLI_POSITION_ERROR, 0, "position-error", CLI_TYPE_TEXT, "R|lossless", "1e-5", 0, 0,
     "what storing may move a vertex by, as a part of the box's diagonal, at most 0.01"},
    {CLI_LOSSLESS, 0, "lossless", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "keep places and values as they are at the finest level"},
    {CLI_PRUNE, 0, "prune", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "leave out fine tets where coarser ones are within the errors that storing may make: constant "
     "regions get small, and the finest mesh has fewer tets than the input"},
    {CLI_RAW_LAYOUT, 0, "raw-layout", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "store plain numbers, for comparison"},
};
static const cli_option SHAPE[] = {
    {CLI_SEGMENT_TETS, 0, "segment-tets", CLI_TYPE_COUNT, "N", "0", 0, 4194304,
     "tets of a segment; 0 takes the size that did best"},
    {CLI_PATCH_TETS, 0, "patch-tets", CLI_TYPE_COUNT, "N", "0", 0, 65536,
     "tets of a patch; 0 takes the size that did best"},
    {CLI_PARTITION, 0, "partition", CLI_TYPE_CHOICE, "cluster|octree|voronoi", "voronoi", 0, 0,
     "what cuts a level into segments: gathered patches, octrees that are turned from level to "
     "level, or Voronoi cells"},
    {CLI_REDUCTION, 0, "reduction", CLI_TYPE_REAL, "R", "0", 0, 0.75,
     "part of the tets that each level leaves, 0.25 to 0.75; 0 takes what did best"},
    {CLI_BOUNDARY_ERROR, 0, "boundary-error", CLI_TYPE_AMOUNT, "D[%]", "5%", 0, 100,
     "how far the boundary of the coarsest level may be from the original one, in percent of the "
     "box's diagonal"},
    {CLI_TMP, 0, "tmp", CLI_TYPE_TEXT, "DIR", NULL, 0, 0,
     "folder for work files, which have no names; that of --keep, else TMPDIR, else /tmp, if not "
     "said"},
    {CLI_KEEP_WORK, 0, "keep", CLI_TYPE_TEXT, "DIR", NULL, 0, 0,
     "keep the work in DIR, stage by stage, so that a build that ends early can be resumed"},
    {CLI_RESUME, 0, "resume", CLI_TYPE_TEXT, "DIR", NULL, 0, 0,
     "go on with the build that was kept in DIR: the same input and options but --threads, "
     "--memory and --tmp. The file has the same bytes as if it had not been interrupted"},
    {CLI_STOP_AFTER, 0, "stop-after", CLI_TYPE_TEXT, "STAGE", NULL, 0, 0,
     "with --keep or --resume: end after 'segment', 'finest' or 'level N', without a model; what "
     "the "
     "stage made is left in DIR as segments.vtu or level_N.vtu, with the numbers of segments and "
     "patches on cells"},
};
static const cli_option SERIES[] = {
    {CLI_STEPS, 0, "steps", CLI_TYPE_TEXT, "all|last|LIST", NULL, 0, 0,
     "build these steps of a series into one model: numbers from 0 on and ranges "
     "FIRST:LAST[:STRIDE], both ends included, such as 0,2,5 or 0:10:2; all when there are several "
     "files"},
    {CLI_STEER, 0, "steer", CLI_TYPE_TEXT, "all|LIST", "all", 0, 0,
     "the steps whose fields decide what is simplified; the others follow"},
};
static const cli_option ADDING[] = {
    {CLI_ADD_CHANNEL, 0, "add-channel", CLI_TYPE_OUTPUT, "M.tlod", NULL, 0, 0,
     "add the channels of IN, a data set of the same mesh, to this model instead of "
     "making one; what is there stays, and the file is replaced when the new one is complete"},
    {CLI_AS_STEP, 0, "as-step", CLI_TYPE_COUNT, "N", NULL, 0, 4294967294.0,
     "with --add-channel: they are those of time step N (of several files or steps N, N + 1 ...); "
     "without it they hold at all steps, or are those of --steps"},
};
static const cli_group ADDING_GROUP = {"Adding", ADDING, sizeof ADDING / sizeof *ADDING};
static const cli_group SERIES_GROUP = {"Series", SERIES, sizeof SERIES / sizeof *SERIES};
static const cli_group RESULT_GROUP = {"Result", RESULT, sizeof RESULT / sizeof *RESULT};
static const cli_group SHAPE_GROUP = {"Model", SHAPE, sizeof SHAPE / sizeof *SHAPE};

/* What the library is asked, with the words that it borrows. */
typedef struct request {
    tl_build_opts opts;
    const char *channels[CLI_LIST_MAX];
    char names[CLI_LIST_MAX][CLI_NAME_BYTES];
    tl_build_channel errors[CLI_LIST_MAX];
    char error_names[CLI_LIST_MAX][CLI_NAME_BYTES];
} request;

/* "A,B" into names, after those that are there. */
static int add_channels(const cli_session *session, request *r, const char *list)
{
    while (*list) {
        size_t length = strcspn(list, ","), n = r->opts.channel_count;
        if (n == CLI_LIST_MAX || length >= CLI_NAME_BYTES)
            return cli_misuse(session->args.verb, "--channels: more or longer names than fit");
        snprintf(r->names[n], CLI_NAME_BYTES, "%.*s", (int)length, list);
        r->channels[n] = r->names[n];
        r->opts.channel_count++;
        list += length + (list[length] == ',');
    }
    r->opts.channels = r->channels;
    return CLI_DONE;
}

static int add_error(const cli_session *session, request *r, const char *text)
{
    const char *amount = text;
    tl_build_channel *e = &r->errors[r->opts.error_count];
    char *name = r->error_names[r->opts.error_count];
    bool percent = false;
    *name = '\0';
    *e = (tl_build_channel){.name = name};
    if (strchr(text, '=') && !cli_split_named(text, name, CLI_NAME_BYTES, &amount))
        return cli_misuse(session->args.verb, "--channel-error %s: no channel is named", text);
    e->lossless = strcmp(amount, "lossless") == 0;
    if (!e->lossless && (!cli_parse_amount(amount, &e->error, &percent) || !(e->error > 0)))
        return cli_misuse(session->args.verb,
                          "--channel-error %s: expected an amount above 0 or 'lossless'", text);
    e->relative = percent;
    if (*name) {
        r->opts.errors = r->errors;
        r->opts.error_count++;
    } else if (e->lossless)
        r->opts.channel_error = 0;
    else if (percent)
        r->opts.channel_error = e->error;
    else
        return cli_misuse(session->args.verb,
                          "--channel-error %s: for all channels an amount is in percent", text);
    return CLI_DONE;
}

static int set_position_error(const cli_session *session, request *r)
{
    const char *text = cli_get(session, CLI_POSITION_ERROR)->text;
    double part;
    r->opts.exact_places = strcmp(text, "lossless") == 0;
    if (r->opts.exact_places) return CLI_DONE;
    if (!cli_parse_real(text, &part) || !(part > 0) || part > POSITION_ERROR_MAX)
        return cli_misuse(session->args.verb,
                          "--position-error %s: expected a number above 0, at most %g, or "
                          "'lossless'",
                          text, POSITION_ERROR_MAX);
    r->opts.position_error = part;
    return CLI_DONE;
}

static int fill_request(const cli_session *session, request *r)
{
    const cli_value *channels = cli_get(session, CLI_CHANNELS);
    const cli_value *errors = cli_get(session, CLI_CHANNEL_ERROR);
    const cli_value *boundary = cli_get(session, CLI_BOUNDARY_ERROR);
    int failed = CLI_DONE;
    r->opts = tl_build_opts_defaults();
    if (cli_get(session, CLI_ADD_CHANNEL)->given) {
        if (cli_get(session, CLI_OUTPUT)->given || cli_get(session, CLI_KEEP_WORK)->given ||
            cli_get(session, CLI_RESUME)->given || cli_get(session, CLI_STOP_AFTER)->given)
            return cli_misuse(session->args.verb,
                              "--add-channel changes a model in its place, at once: -o, --keep, "
                              "--resume and --stop-after do not go with it");
    } else if (cli_get(session, CLI_AS_STEP)->given) {
        return cli_misuse(session->args.verb, "--as-step needs --add-channel");
    } else if (!cli_get(session, CLI_OUTPUT)->given && !cli_get(session, CLI_STOP_AFTER)->given)
        return cli_misuse(session->args.verb, "-o M.tlod is missing");
    for (size_t i = 0; i < channels->item_count && !failed; i++)
        failed = add_channels(session, r, channels->items[i]);
    for (size_t i = 0; i < errors->item_count && !failed; i++)
        failed = add_error(session, r, errors->items[i]);
    if (!failed && !boundary->percent && boundary->given)
        failed = cli_misuse(session->args.verb, "--boundary-error: expected percent");
    if (!failed) failed = set_position_error(session, r);
    r->opts.boundary_error = boundary->real;
    r->opts.lossless = cli_get(session, CLI_LOSSLESS)->given;
    r->opts.raw = cli_get(session, CLI_RAW_LAYOUT)->given;
    r->opts.segment_tets = (uint32_t)cli_get(session, CLI_SEGMENT_TETS)->count;
    r->opts.patch_tets = (uint32_t)cli_get(session, CLI_PATCH_TETS)->count;
    r->opts.prune = cli_get(session, CLI_PRUNE)->given;
    r->opts.partition = (tl_partition)cli_get(session, CLI_PARTITION)->choice;
    r->opts.reduction = cli_get(session, CLI_REDUCTION)->real;
    r->opts.memory_bytes = cli_get(session, CLI_MEMORY)->count;
    r->opts.keep = cli_get(session, CLI_KEEP_WORK)->text;
    r->opts.resume = cli_get(session, CLI_RESUME)->text;
    if (cli_get(session, CLI_TMP)->given || (!r->opts.keep && !r->opts.resume))
        r->opts.folder = cli_work_folder(session);
    r->opts.until = cli_get(session, CLI_STOP_AFTER)->text;
    return failed;
}

static void print_json(const cli_session *session, const char *path, const tl_build_result *r)
{
    json_t *object = json_object();
    cli_json_text(object, "file", r->bytes ? path : "");
    if (!r->bytes) cli_json_text(object, "stopped_after", cli_get(session, CLI_STOP_AFTER)->text);
    cli_json_count(object, "tets_in", r->tets_in);
    cli_json_count(object, "tets_stored", r->tets_stored);
    cli_json_count(object, "segments", r->segments);
    cli_json_count(object, "patches", r->patches);
    cli_json_count(object, "levels", r->level_count);
    cli_json_count(object, "bytes", r->bytes);
    cli_json_real(object, "bytes_per_input_tet", (double)r->bytes / (double)r->tets_in);
    cli_json_real(object, "seconds", r->seconds);
    cli_json_real(object, "cpu_seconds", cli_cpu());
    cli_json_real(object, "tets_per_second", (double)r->tets_in / r->seconds);
    cli_json_facts(object, session->ctx);
    json_object_set_new(object, "peak_bytes", json_integer((json_int_t)r->peak_bytes));
    cli_json_print(object);
}

static void print_text(cli_session *session, const char *path, const tl_build_result *r)
{
    cli_print_notes(session);
    if (!r->bytes) {
        printf("stopped     after '%s', %s tets in, %zu levels so far, in %s\n",
               cli_get(session, CLI_STOP_AFTER)->text, cli_count(r->tets_in).s, r->level_count,
               cli_seconds(r->seconds).s);
        return;
    }
    if (cli_get(session, CLI_ADD_CHANNEL)->given) {
        printf("added       channels to %s (%s tets), in %s\n", path, cli_count(r->tets_in).s,
               cli_seconds(r->seconds).s);
        printf("size        %s, %.2f bytes an input tet\n", cli_bytes((double)r->bytes).s,
               (double)r->bytes / (double)r->tets_in);
        printf("memory      %s at most\n", cli_bytes((double)r->peak_bytes).s);
        return;
    }
    printf("built       %s of %s tets (%s of them in all levels), in %s (%s tets)\n", path,
           cli_count(r->tets_in).s, cli_count(r->tets_stored).s, cli_seconds(r->seconds).s,
           cli_rate((double)r->tets_in / r->seconds).s);
    printf("model       %zu levels, %s segments, %s patches\n", r->level_count,
           cli_count(r->segments).s, cli_count(r->patches).s);
    for (size_t l = 0; l < r->level_count; l++)
        printf("  level %-3zu %12s tets  %8s patches  %6s segments\n", l,
               cli_count(r->levels[l].tets).s, cli_count(r->levels[l].patches).s,
               cli_count(r->levels[l].segments).s);
    printf("size        %s, %.2f bytes an input tet\n", cli_bytes((double)r->bytes).s,
           (double)r->bytes / (double)r->tets_in);
    printf("memory      %s at most\n", cli_bytes((double)r->peak_bytes).s);
}

static int run(cli_session *session)
{
    const bool adds = cli_get(session, CLI_ADD_CHANNEL)->given;
    const char *path = cli_get(session, adds ? CLI_ADD_CHANNEL : CLI_OUTPUT)->text;
    const char *input = session->args.operands[0];
    cli_steps steps = {0};
    request r = {0};
    tl_read_opts read;
    tl_build_result result;
    int failed = fill_request(session, &r);
    if (!failed) failed = cli_read_opts(session, input, &read);
    if (!failed) failed = cli_steps_choose(session, &read, &steps);
    if (failed) return failed;
    r.opts.steer = steps.steer_count ? steps.steer : NULL;
    r.opts.steer_count = steps.steer_count;
    tl_status st;
    if (adds)
        st = tl_model_add_channels(session->ctx, path, steps.items, steps.count,
                                   steps.count ? NULL : input, &read, &r.opts, &result);
    else if (steps.count)
        st = tl_model_build_series(session->ctx, steps.items, steps.count, &read, path, &r.opts,
                                   &result);
    else
        st = tl_model_build(session->ctx, input, &read, path, &r.opts, &result);
    cli_steps_release(session, &steps);
    cli_progress_clear(&session->progress);
    if (st) return cli_fail(session, session->ctx, st);
    if (cli_get(session, CLI_JSON)->given)
        print_json(session, path, &result);
    else if (cli_loud(session))
        print_text(session, path, &result);
    tl_build_release(session->ctx, &result);
    return CLI_DONE;
}

static const char *const EXAMPLES[] = {
    "tetralod build flow.vtu -o flow.tlod",
    "All levels of a flow in one file",
    "tetralod build flow.vtu -o flow.tlod --channels pressure --channel-error pressure=0.001%",
    "The pressure alone, within 0.001 % of its range",
    "tetralod build flow.pvd -o flow.tlod --steps 0:100:10 --steer 0,50,100",
    "Eleven time steps of one mesh, three of which decide what is simplified",
    "tetralod build --add-channel flow.tlod later.vtu --as-step 101",
    "A further time step; the mesh is not stored again",
    NULL};

const cli_verb cli_verb_build = {
    .name = "build",
    .operands = "IN ... (-o M.tlod | --add-channel M.tlod)",
    .operand_least = 1,
    .operand_most = CLI_OPERANDS_MAX,
    .about = "make a multi-resolution file: every view at the detail it needs, with a bound",
    .details = "The file holds the mesh at many levels in patches that fit together in any mixture "
               "that the errors ask for. Every original vertex is measured at every level, against "
               "the mesh as it will be decoded. Several time steps of one mesh (--steps, or a file "
               "a step) share it: the mesh must not move or change.",
    .groups = {&RESULT_GROUP, &SERIES_GROUP, &ADDING_GROUP, &SHAPE_GROUP, &cli_group_reading,
               &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
