/* The context: creation under every failure, names of statuses, message chain, log, progress. */
#include "check.h"

#include "check_alloc.h"

#include "base/base.h"

static void test_version(void **state)
{
    (void)state;
    CHECK_EQ(tl_version(), TL_VERSION);
}

static void test_status_names_are_distinct(void **state)
{
    (void)state;
    const tl_status all[] = {TL_OK,         TL_ERR_ARG,      TL_ERR_MEMORY, TL_ERR_BUDGET,
                             TL_ERR_THREAD, TL_ERR_IO,       TL_ERR_FORMAT, TL_ERR_UNSUPPORTED,
                             TL_ERR_DATA,   TL_ERR_CANCELLED};
    size_t count = sizeof all / sizeof *all;
    for (size_t i = 0; i < count; i++) {
        CHECK(strcmp(tl_status_name(all[i]), "unknown status") != 0);
        for (size_t j = 0; j < i; j++)
            CHECK(strcmp(tl_status_name(all[i]), tl_status_name(all[j])) != 0);
    }
    CHECK(strcmp(tl_status_name((tl_status)9999), "unknown status") == 0);
}

static void test_create(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    CHECK(tl_ctx_thread_count(ctx) >= 1);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    CHECK_EQ(strlen(tl_ctx_message(ctx)), 0);
    tl_ctx_destroy(ctx);
    tl_ctx_destroy(NULL);

    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 5;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    CHECK_EQ(tl_ctx_thread_count(ctx), 5);
    tl_ctx_destroy(ctx);

    opts.thread_count = 1u << 30;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_ERR_ARG);
    CHECK(!ctx);
    opts = (tl_ctx_opts){0}; /* without its size */
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_ERR_ARG);
    CHECK(!ctx);
    CHECK_STATUS(tl_ctx_create(NULL, NULL), TL_ERR_ARG);
}

static void test_create_without_memory(void **state)
{
    (void)state;
    tl_status st = TL_ERR_MEMORY;
    unsigned long long n = 0;
    while (st) {
        check_alloc alloc = {.fail_at = ++n};
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        opts.resize = check_alloc_resize;
        opts.user = &alloc;
        opts.thread_count = 3;
        tl_ctx *ctx = NULL;
        st = tl_ctx_create(&opts, &ctx);
        if (st) CHECK_STATUS(st, TL_ERR_MEMORY);
        CHECK(!ctx == (st != TL_OK));
        tl_ctx_destroy(ctx);
        CHECK_EQ(alloc.live_blocks, 0);
        CHECK_EQ(alloc.bytes, 0);
    }
    CHECK_EQ(n, 3); /* the context and its pool */
}

static tl_ctx *ctx_with(tl_ctx_opts opts)
{
    tl_ctx *ctx = NULL;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

static tl_ctx *ctx_plain(void)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 1;
    return ctx_with(opts);
}

static void test_message_chain(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_plain();
    CHECK_STATUS(tl_fail(ctx, TL_ERR_FORMAT, "patch %d: %s", 17, "40 bytes past the end"),
                 TL_ERR_FORMAT);
    CHECK_STATUS(tl_note(ctx, TL_ERR_FORMAT, "while reading '%s'", "a.vtu"), TL_ERR_FORMAT);
    assert_string_equal(tl_ctx_message(ctx),
                        "patch 17: 40 bytes past the end\nwhile reading 'a.vtu'");
    tl_fail(ctx, TL_ERR_DATA, "another"); /* starts anew */
    assert_string_equal(tl_ctx_message(ctx), "another");
    tl_ctx_clear(ctx);
    assert_string_equal(tl_ctx_message(ctx), "");
    tl_note(ctx, TL_ERR_DATA, "alone");
    assert_string_equal(tl_ctx_message(ctx), "alone");
    tl_ctx_destroy(ctx);
}

/* Names out of files: a line stays one line, a terminal gets no commands. */
static void test_message_is_printable(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_plain();
    tl_fail(ctx, TL_ERR_FORMAT, "array '%s'", "a\nb\x1b[2Jc\x7f\xc3\xa9");
    assert_string_equal(tl_ctx_message(ctx), "array 'a?b?[2Jc?\xc3\xa9'");
    tl_ctx_destroy(ctx);
}

static void test_message_is_cut(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_plain();
    static char name[10000];
    memset(name, 'x', sizeof name - 1);
    tl_fail(ctx, TL_ERR_FORMAT, "%s", name);
    size_t length = strlen(tl_ctx_message(ctx));
    CHECK(length > 1000 && length < sizeof name);
    assert_string_equal(tl_ctx_message(ctx) + length - 3, "...");
    for (int i = 0; i < 100; i++) tl_note(ctx, TL_ERR_FORMAT, "one more");
    CHECK_EQ(strlen(tl_ctx_message(ctx)), length);
    tl_fail(ctx, TL_ERR_FORMAT, "short");
    for (int i = 0; i < 5000; i++) tl_note(ctx, TL_ERR_FORMAT, "line %d", i);
    CHECK(strncmp(tl_ctx_message(ctx), "short\nline 0\nline 1\n", 20) == 0);
    tl_ctx_destroy(ctx);
}

/* ---- hooks ---- */

typedef struct record {
    int calls, stop_at;
    tl_log_level level;
    char text[4096];
    uint64_t done, total;
} record;

static void keep_line(void *user, tl_log_level level, const char *text)
{
    record *r = user;
    r->calls++;
    r->level = level;
    snprintf(r->text, sizeof r->text, "%s", text);
}

static bool keep_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    record *r = user;
    snprintf(r->text, sizeof r->text, "%s", stage);
    r->done = done;
    r->total = total;
    return ++r->calls != r->stop_at;
}

static void test_log(void **state)
{
    (void)state;
    tl_ctx *silent = ctx_plain();
    tl_log(silent, TL_LOG_ERROR, "dropped");
    tl_ctx_destroy(silent);

    record r = {0};
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.log = keep_line;
    opts.user = &r;
    tl_ctx *ctx = ctx_with(opts);
    tl_log(ctx, TL_LOG_INFO, "%d tets\n", 5);
    CHECK_EQ(r.calls, 1);
    CHECK_EQ(r.level, TL_LOG_INFO);
    assert_string_equal(r.text, "5 tets?");
    tl_ctx_destroy(ctx);
    CHECK_EQ(r.calls, 1);
}

static void test_leak_is_logged(void **state)
{
    (void)state;
    struct {
        record r; /* first: the log hook takes the pointer for a record */
        void *block;
    } kept = {0};
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.log = keep_line;
    opts.user = &kept;
    tl_ctx *ctx = ctx_with(opts);
    tl_status st = TL_OK;
    kept.block = tl_mem_alloc(ctx, 100, 1, &st);
    size_t bytes = tl_ctx_current_bytes(ctx);
    CHECK(bytes >= 100);
    tl_ctx_destroy(ctx);
    CHECK_EQ(kept.r.calls, 1);
    CHECK_EQ(kept.r.level, TL_LOG_WARNING);
    CHECK_EQ(strtoull(kept.r.text, NULL, 10), bytes);
    free((char *)kept.block - 16); /* the block's header lies in front of it */
}

static void test_progress(void **state)
{
    (void)state;
    record r = {.stop_at = 3};
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.progress = keep_progress;
    opts.user = &r;
    tl_ctx *ctx = ctx_with(opts);
    CHECK_OK(ctx, tl_progress(ctx, "collapse", 1, 9));
    CHECK_OK(ctx, tl_progress(ctx, "collapse", 2, 9));
    CHECK_STATUS(tl_progress(ctx, "collapse", 3, 9), TL_ERR_CANCELLED);
    CHECK_EQ(r.done, 3);
    CHECK_EQ(r.total, 9);
    assert_string_equal(tl_ctx_message(ctx), "cancelled during collapse, at 3 of 9");
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_version),        cmocka_unit_test(test_status_names_are_distinct),
        cmocka_unit_test(test_create),         cmocka_unit_test(test_create_without_memory),
        cmocka_unit_test(test_message_chain),  cmocka_unit_test(test_message_is_printable),
        cmocka_unit_test(test_message_is_cut), cmocka_unit_test(test_log),
        cmocka_unit_test(test_leak_is_logged), cmocka_unit_test(test_progress),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
