/* The n-th allocation and the n-th file operation fail: nothing leaks, nothing stays behind, and
 * the message says what happened. */
#include <unistd.h>

#include "base/base_file.h"

#include "fail_alloc.h"
#include "make_store.h"

/* A model of several pages, some of them of roots, and a context for what is no part of the test.
 */
typedef struct failure_case {
    make_store m;
    tl_ctx *content;
} failure_case;

static void case_open(failure_case *c, uint32_t coarse_segments)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 1;
    c->m = (make_store){.level_count = 3,
                        .coarse_segments = coarse_segments,
                        .channel_count = 2,
                        .vert_count = 5,
                        .with_twins = true};
    make_store_open(&c->m);
    CHECK_STATUS(tl_ctx_create(&opts, &c->content), TL_OK);
}

static void case_close(failure_case *c)
{
    CHECK_EQ(tl_ctx_current_bytes(c->content), 0);
    tl_ctx_destroy(c->content);
}

/* ---- allocations ---- */

static tl_status write_file(tl_ctx *ctx, void *arg)
{
    const failure_case *c = arg;
    tl_status st = make_store_write(ctx, c->content, &c->m, "w.tlod");
    CHECK_EQ(access("w.tlod", F_OK) == 0, st == TL_OK);
    (void)unlink("w.tlod");
    return st;
}

static tl_status read_file(tl_ctx *ctx, void *arg)
{
    const char *path = arg;
    tl_store *store = NULL;
    tl_status st = tl_store_open(ctx, path, &store);
    if (!st) st = tl_store_check(ctx, store, TL_CHECK_FULL);
    tl_store_close(store);
    return st;
}

static void test_allocations_of_writing(void **state)
{
    (void)state;
    failure_case c;
    fail_alloc f;
    case_open(&c, 80);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, write_file, &c) > 20);
    fail_alloc_close(&f);
    case_close(&c);
}

static void test_allocations_of_reading(void **state)
{
    (void)state;
    char path[] = "r.tlod";
    failure_case c;
    fail_alloc f;
    case_open(&c, 2);
    CHECK_OK(c.content, make_store_write(c.content, c.content, &c.m, "r.tlod"));
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, read_file, path) > 50);
    fail_alloc_close(&f);
    case_close(&c);
}

static tl_status no_patch(void *user, uint32_t id, tli_blob *blobs, float *ranges, double *squares)
{
    (void)user;
    (void)id;
    blobs[0] = (tli_blob){(const uint8_t *)"x", 1};
    ranges[0] = ranges[1] = 0;
    squares[0] = 0;
    return TL_OK;
}

static tl_status no_segment(void *user, uint32_t id, double *max_error, float *field, float *space)
{
    (void)user;
    (void)id;
    max_error[0] = 0;
    memset(field, 0, TL_BINS * sizeof *field);
    memset(space, 0, TL_BINS * sizeof *space);
    return TL_OK;
}

static tl_status append_file(tl_ctx *ctx, void *arg)
{
    const make_store *more = arg;
    const tli_store_added added = {NULL, no_patch, no_segment, NULL};
    tl_store *store = NULL;
    tl_status st = tl_store_open(ctx, "r.tlod", &store);
    if (!st) st = tli_store_append(ctx, store, "a.tlod", &more->head, more->codec, &added);
    tl_store_close(store);
    CHECK_EQ(access("a.tlod", F_OK) == 0, st == TL_OK);
    (void)unlink("a.tlod");
    return st;
}

static void test_allocations_of_appending(void **state)
{
    (void)state;
    failure_case c;
    fail_alloc f;
    case_open(&c, 2);
    CHECK_OK(c.content, make_store_write(c.content, c.content, &c.m, "r.tlod"));
    c.m.channel_count = 3;
    make_store_open(&c.m);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, append_file, &c.m) > 50);
    fail_alloc_close(&f);
    case_close(&c);
}

/* ---- files ---- */

/* Calls with the n-th file operation failing for n = 1, 2, 3 ... until the call succeeds. */
static uint64_t fail_file_each(tl_ctx *ctx, tl_status (*call)(tl_ctx *ctx, void *arg), void *arg)
{
    for (uint64_t n = 1;; n++) {
        tli_file_fail_at(ctx, n);
        tl_status st = call(ctx, arg);
        tli_file_fail_at(ctx, 0);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        if (!st) return n;
        CHECK_STATUS(st, TL_ERR_IO);
        CHECK(strstr(tl_ctx_message(ctx), ".tlod"));
    }
}

static tl_status write_again(tl_ctx *ctx, void *arg)
{
    return make_store_write(ctx, ctx, arg, "w.tlod");
}

static void test_files(void **state)
{
    (void)state;
    char path[] = "w.tlod";
    failure_case c;
    case_open(&c, 2);
    CHECK(fail_file_each(c.content, write_again, &c.m) > 3);
    CHECK(fail_file_each(c.content, read_file, path) > 30);
    case_close(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_allocations_of_writing),
        cmocka_unit_test(test_allocations_of_reading),
        cmocka_unit_test(test_allocations_of_appending),
        cmocka_unit_test(test_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
