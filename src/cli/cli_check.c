/* tetralod check: proves that a model is what it says. */
#include "cli_model.h"
#include "tetralod/cut.h"

#include <math.h>

static const cli_option OPTIONS[] = {
    {CLI_FAST, 0, "fast", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the index alone: checksums, counts, offsets and the graph; patches are not decoded"},
    {CLI_AGAINST, 0, "against", CLI_TYPE_INPUT, "IN", NULL, 0, 0,
     "the data set that the model was made of: every promise of random cuts is measured at every "
     "one of its vertices"},
    {CLI_CUTS, 0, "cuts", CLI_TYPE_COUNT, "N", "12", 0, 1000000,
     "random cuts that are tried: errors, levels, errors in a box, budgets and views in turn"},
    {CLI_MESHES, 0, "meshes", CLI_TYPE_COUNT, "N", NULL, 0, 1000000,
     "make and measure the mesh of so many of the cuts, not only the borders of their patches; "
     "without it of all with --against, else of 12"},
    {CLI_SEED, 0, "seed", CLI_TYPE_COUNT, "N", "1", 0, 0, "seed of the random cuts"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

/* What was found beside the bytes. */
typedef struct findings {
    tl_cut_check_result cuts;
    const char *message; /* what is wrong; NULL: nothing */
    double seconds;
} findings;

static void print_json(const cli_session *session, const char *path, const tl_store *store,
                       const findings *f)
{
    const tl_cut_check_result *cuts = &f->cuts;
    json_t *object = json_object();
    cli_json_text(object, "file", path);
    cli_json_flag(object, "ok", !f->message);
    if (f->message) cli_json_text(object, "message", f->message);
    if (store) {
        const tl_store_head *head = tl_store_get_head(store);
        cli_json_count(object, "bytes", head->file_bytes);
        cli_json_count(object, "levels", head->level_count);
        cli_json_count(object, "segments", head->segment_count);
        cli_json_count(object, "patches", head->patch_count);
        cli_json_count(object, "bytes_read", tl_store_bytes_read(store));
    }
    cli_json_count(object, "cuts_tried", cuts->cuts_tried);
    cli_json_count(object, "meshes_made", cuts->meshes_made);
    json_t *promised = cli_json_list(object, "promised");
    json_t *measured = cli_json_list(object, "measured");
    for (size_t c = 0; c < cuts->channel_count && cli_get(session, CLI_AGAINST)->given; c++) {
        const tl_store_channel *channel = &tl_store_get_head(store)->channels[c];
        json_t *item = cli_json_item(promised);
        cli_json_text(item, "channel", cuts->channels[c].name);
        if (channel->has_step) cli_json_count(item, "step", channel->step);
        cli_json_real(item, "error", cuts->channels[c].promised);
        item = cli_json_item(measured);
        cli_json_text(item, "channel", cuts->channels[c].name);
        if (channel->has_step) cli_json_count(item, "step", channel->step);
        cli_json_real(item, "error", cuts->channels[c].measured);
        cli_json_real(item, "looseness", cuts->channels[c].looseness);
    }
    cli_json_real(object, "boundary_promised", cuts->boundary_promised);
    cli_json_real(object, "boundary_measured", cuts->boundary_measured);
    cli_json_real(object, "boundary_looseness", cuts->boundary_looseness);
    cli_json_real(object, "volume_off", cuts->volume_off);
    cli_json_real(object, "seconds", f->seconds);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

static void print_text(const cli_session *session, const char *path, const tl_store *store,
                       const findings *f)
{
    const tl_store_head *head = tl_store_get_head(store);
    const bool fast = cli_get(session, CLI_FAST)->given;
    printf("%-10s  %s: levels: %s, segments: %s, patches: %s (%s, %s)\n", "checked", path,
           cli_count(head->level_count).s, cli_count(head->segment_count).s,
           cli_count(head->patch_count).s, cli_bytes((double)head->file_bytes).s,
           cli_seconds(f->seconds).s);
    printf("%-10s  %s\n", "right",
           fast ? "head, index and graph; patches were not looked at"
                : "every byte, the graph, and every patch decodes to what the index says");
    if (fast) return;
    printf("%-10s  %s random cuts fit together (%s of them measured as meshes), volume off by at "
           "most %s\n",
           "cuts", cli_count(f->cuts.cuts_tried).s, cli_count(f->cuts.meshes_made).s,
           cli_share(f->cuts.volume_off, 1).s);
    for (size_t c = 0; c < f->cuts.channel_count && cli_get(session, CLI_AGAINST)->given; c++) {
        const tl_store_channel *channel = &head->channels[c];
        char at[32] = "";
        if (!(f->cuts.channels[c].promised > 0)) continue;
        if (channel->has_step) snprintf(at, sizeof at, " at step %u", channel->step);
        printf("%-10s  %s%s: %s measured, %s promised, in the cut where they are nearest\n", "kept",
               channel->name, at, cli_real(f->cuts.channels[c].measured).s,
               cli_real(f->cuts.channels[c].promised).s);
    }
    if (f->cuts.boundary_promised > 0)
        printf("%-10s  boundary: %s measured, %s promised\n", "kept",
               cli_real(f->cuts.boundary_measured).s, cli_real(f->cuts.boundary_promised).s);
}

/* Random cuts, with the data set behind the model if there is one, at a step of it. */
static tl_status try_cuts(cli_session *session, tl_store *store, const tl_mesh *mesh,
                          const cli_model_step *step, tl_cut_check_result *cuts)
{
    tl_cut_check_opts opts = tl_cut_check_opts_defaults();
    opts.cuts = (uint32_t)cli_get(session, CLI_CUTS)->count;
    opts.seed = cli_get(session, CLI_SEED)->count;
    opts.has_step = step->is_chosen;
    opts.step = step->number;
    if (cli_get(session, CLI_MESHES)->given)
        opts.meshes = (uint32_t)cli_get(session, CLI_MESHES)->count;
    return tl_cut_check(session->ctx, store, mesh, &opts, cuts);
}

/* Adds what was found at one step. Takes it over. */
static void add_findings(const cli_session *session, const tl_store_head *head,
                         const cli_model_step *step, tl_cut_check_result *from,
                         tl_cut_check_result *to)
{
    if (!to->channels) {
        *to = *from;
        return;
    }
    to->cuts_tried += from->cuts_tried;
    to->meshes_made += from->meshes_made;
    for (size_t c = 0; c < to->channel_count; c++)
        if (cli_in_step(&head->channels[c], step)) to->channels[c] = from->channels[c];
    to->boundary_looseness = fmax(to->boundary_looseness, from->boundary_looseness);
    to->outside = fmax(to->outside, from->outside);
    to->volume_off = fmax(to->volume_off, from->volume_off);
    if (from->boundary_measured * to->boundary_promised >
        to->boundary_measured * from->boundary_promised) {
        to->boundary_promised = from->boundary_promised;
        to->boundary_measured = from->boundary_measured;
    }
    tl_cut_check_release(session->ctx, from);
}

/* The data set at a step of the model, which is there under the same number, unless it has one step
 * alone and that one is asked for. */
static int prove_step(cli_session *session, tl_store *store, const cli_model_step *step,
                      size_t step_count, findings *f, tl_status *st)
{
    const char *against = cli_get(session, CLI_AGAINST)->text;
    tl_cut_check_result found = {0};
    tl_read_opts opts;
    cli_input input;
    int failed = cli_read_opts(session, against, &opts);
    if (failed) return failed;
    if (step->is_chosen) opts.step = step_count == 1 ? 0 : step->number;
    failed = cli_open_with(session, session->ctx, against, &opts, &input);
    if (!failed) failed = cli_check_volume(&input);
    if (failed) return failed;
    *st = try_cuts(session, store, input.mesh, step, &found);
    if (!*st) add_findings(session, tl_store_get_head(store), step, &found, &f->cuts);
    if (*st && step->is_chosen) {
        cli_progress_clear(&session->progress);
        fprintf(stderr, "tetralod: at step %u:\n", step->number);
    }
    cli_close(&input);
    return CLI_DONE;
}

/* Every step of the model, or the one that --step or --time say. */
static int prove_against(cli_session *session, tl_store *store, findings *f, tl_status *st)
{
    const tl_store_head *head = tl_store_get_head(store);
    cli_value *number = &session->args.values[CLI_STEP], *time = &session->args.values[CLI_TIME];
    cli_model_step step = {0};
    tl_steps steps = {0};
    bool is_series = cli_next_step(head, &step), one = number->given || time->given;
    if (!is_series) return prove_step(session, store, &step, 0, f, st);
    int failed = one ? cli_choose_step(session, head, &step) : CLI_DONE;
    number->given = time->given = false; /* from here on it is chosen one by one */
    if (failed) return failed;
    *st = tl_read_steps(session->ctx, cli_get(session, CLI_AGAINST)->text, NULL, &steps);
    if (*st) return CLI_DONE;
    size_t count = one ? steps.count : steps.count > 1 ? steps.count : 0;
    tl_steps_release(session->ctx, &steps);
    do failed = prove_step(session, store, &step, count, f, st);
    while (!failed && !*st && !one && cli_next_step(head, &step));
    return failed;
}

static int run(cli_session *session)
{
    const char *path = session->args.operands[0], *against = cli_get(session, CLI_AGAINST)->text;
    const bool fast = cli_get(session, CLI_FAST)->given, json = cli_get(session, CLI_JSON)->given;
    tl_store *store = NULL;
    findings f = {0};
    const cli_model_step any = {0};
    int failed = CLI_DONE;
    if (fast && against)
        return cli_misuse(session->args.verb, "--fast and --against are both given; say one");
    double start = cli_now();
    tl_status st = tl_store_open(session->ctx, path, &store);
    if (!st) st = tl_store_check(session->ctx, store, fast ? TL_CHECK_FAST : TL_CHECK_FULL);
    if (!st && !fast && !against) st = try_cuts(session, store, NULL, &any, &f.cuts);
    if (!st && against) failed = prove_against(session, store, &f, &st);
    f.seconds = cli_now() - start;
    f.message = st ? tl_ctx_message(session->ctx) : NULL;
    cli_progress_clear(&session->progress);
    if (json && !failed)
        print_json(session, path, store, &f);
    else if (!st && !failed && cli_loud(session))
        print_text(session, path, store, &f);
    int exit_status = st ? cli_fail(session, session->ctx, st) : failed;
    tl_cut_check_release(session->ctx, &f.cuts);
    tl_store_close(store);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod check flow.tlod",
    "Every byte of a model",
    "tetralod check flow.tlod --fast --json",
    "Its index alone, for a script",
    "tetralod check flow.tlod --cuts 10000",
    "Ten thousand random cuts, each proved to fit together",
    "tetralod check flow.tlod --against flow.vtu --cuts 100",
    "A hundred random cuts, measured at every vertex of the data",
    NULL};

const cli_verb cli_verb_check = {
    .name = "check",
    .operands = "MODEL",
    .operand_least = 1,
    .operand_most = 1,
    .about = "prove that a model is whole and keeps what it promises",
    .details = "A changed, missing or extra byte anywhere in the file is found, padding included. "
               "Random cuts are tried: every one must fit together, keep the volume and, with "
               "--against, every promise at every vertex of the data set, by brute force. The exit "
               "status is 1 where something is wrong; the message names the place.",
    .groups = {&GROUP, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
