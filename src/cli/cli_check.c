/* tetralod check: proves that a model is what it says. */
#include "cli_model.h"

static const cli_option OPTIONS[] = {
    {CLI_FAST, 0, "fast", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the index alone: checksums, counts, offsets and the graph; patches are not decoded"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

static void print_json(const cli_session *session, const char *path, const tl_store *store,
                       const char *message, double seconds)
{
    json_t *object = json_object();
    cli_json_text(object, "file", path);
    cli_json_flag(object, "ok", !message);
    if (message) cli_json_text(object, "message", message);
    if (store) {
        const tl_store_head *head = tl_store_get_head(store);
        cli_json_count(object, "bytes", head->file_bytes);
        cli_json_count(object, "levels", head->level_count);
        cli_json_count(object, "segments", head->segment_count);
        cli_json_count(object, "patches", head->patch_count);
        cli_json_count(object, "bytes_read", tl_store_bytes_read(store));
    }
    cli_json_real(object, "seconds", seconds);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

static void print_text(const cli_session *session, const char *path, const tl_store *store,
                       double seconds)
{
    const tl_store_head *head = tl_store_get_head(store);
    const bool fast = cli_get(session, CLI_FAST)->given;
    printf("%-10s  %s: levels: %s, segments: %s, patches: %s (%s, %s)\n", "checked", path,
           cli_count(head->level_count).s, cli_count(head->segment_count).s,
           cli_count(head->patch_count).s, cli_bytes((double)head->file_bytes).s,
           cli_seconds(seconds).s);
    printf("%-10s  %s\n", "right",
           fast ? "head, index and graph; patches were not looked at"
                : "every byte, the graph, and every patch decodes to what the index says");
}

static int run(cli_session *session)
{
    const char *path = session->args.operands[0];
    const bool fast = cli_get(session, CLI_FAST)->given, json = cli_get(session, CLI_JSON)->given;
    tl_store *store = NULL;
    double start = cli_now();
    tl_status st = tl_store_open(session->ctx, path, &store);
    if (!st) st = tl_store_check(session->ctx, store, fast ? TL_CHECK_FAST : TL_CHECK_FULL);
    double seconds = cli_now() - start;
    cli_progress_clear(&session->progress);
    if (json)
        print_json(session, path, store, st ? tl_ctx_message(session->ctx) : NULL, seconds);
    else if (!st && cli_loud(session))
        print_text(session, path, store, seconds);
    int exit_status = st ? cli_fail(session, session->ctx, st) : CLI_DONE;
    tl_store_close(store);
    return exit_status;
}

static const char *const EXAMPLES[] = {"tetralod check flow.tlod", "Every byte of a model",
                                       "tetralod check flow.tlod --fast --json",
                                       "Its index alone, for a script", NULL};

const cli_verb cli_verb_check = {
    .name = "check",
    .operands = "MODEL",
    .operand_least = 1,
    .operand_most = 1,
    .about = "prove that a model is whole: every byte, the graph, every patch",
    .details = "A changed, missing or extra byte anywhere in the file is found, padding included. "
               "The exit status is 1 where something is wrong; the message names the place.",
    .groups = {&GROUP, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
