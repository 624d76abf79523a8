/* Whatever fails on the way (an allocation, the budget, a hook that ends the call), nothing is left
 * behind and *out is NULL. */
#include "check.h"
#include "check_simplify.h"
#include "fail_alloc.h"

static make_mesh two_regions(size_t n)
{
    make_mesh m = make_grid(n);
    perturb_inner(&m, 0.1 / (double)(n - 1), 7);
    make_two_regions(&m);
    return m;
}

static tl_status no_listener(void *user, const tl_collapse *collapse)
{
    (void)user;
    (void)collapse;
    return TL_OK;
}

typedef struct attempt {
    const tl_mesh *mesh;
    tl_simplify_opts opts;
} attempt;

static tl_status try_once(tl_ctx *ctx, void *arg)
{
    attempt *a = arg;
    tl_mesh *out = (tl_mesh *)(uintptr_t)a->mesh;
    tl_simplify_result result;
    tl_status st = tl_mesh_simplify(ctx, a->mesh, &a->opts, &out, &result);
    if (st) {
        CHECK(out == NULL);
        CHECK(result.channels == NULL);
    }
    tl_mesh_destroy(out);
    tl_simplify_release(ctx, &result);
    return st;
}

static void test_each_allocation(void **state)
{
    (void)state;
    for (int method = 1; method <= TL_SIMPLIFY_BLOCKS; method++)
        for (int how = 0; how < 4; how++) {
            fail_alloc f;
            fail_alloc_open(&f, 2);
            make_mesh m = two_regions(5);
            tl_mesh *mesh = make_object(f.ctx, &m, field_bumps);
            tl_channel tet_channel = {"cell", "", 1, TL_ON_TET, TL_F64, m.xyz};
            CHECK_OK(f.ctx, tl_mesh_add_channel(mesh, &tet_channel));
            attempt a = {mesh, shrink_ratio(0.3)};
            a.opts.method = (tl_simplify_method)method;
            if (how & 1) a.opts.error = 0.05;
            if (how & 2) a.opts.listener = no_listener;
            long n = fail_alloc_each(&f, try_once, &a);
            printf("%s%s%s: %ld allocations\n", method_names[method], how & 1 ? ", error" : "",
                   how & 2 ? ", listener" : "", n - 1);
            tl_mesh_destroy(mesh);
            make_release(&m);
            fail_alloc_close(&f);
        }
}

/* The blocks proper, with logs of their own, need some vertices more. */
static void test_allocations_in_blocks(void **state)
{
    fail_alloc f;
    fail_alloc_open(&f, 2);
    make_mesh m = two_regions(19);
    tl_mesh *mesh = make_object(f.ctx, &m, field_bumps);
    (void)state;
    attempt a = {mesh, shrink_ratio(0.05)};
    a.opts.listener = no_listener;
    size_t before = tl_ctx_current_bytes(f.ctx);
    long tries = 0;
    for (long n = 1;; n = n * 5 / 4 + 1, tries++) { /* thinly: each takes a while */
        f.alloc.fail_at = f.alloc.requests + (unsigned long long)n;
        tl_status st = try_once(f.ctx, &a);
        bool has_failed = f.alloc.requests >= f.alloc.fail_at;
        f.alloc.fail_at = 0;
        CHECK_EQ(tl_ctx_current_bytes(f.ctx), before);
        if (st == TL_OK) {
            CHECK(!has_failed);
            break;
        }
        CHECK_STATUS(st, TL_ERR_MEMORY);
    }
    CHECK(tries > 10);
    tl_mesh_destroy(mesh);
    make_release(&m);
    fail_alloc_close(&f);
}

/* ---- budget ---- */

static void test_budget(void **state)
{
    make_mesh m = two_regions(9);
    tl_ctx *plain = shrink_ctx(1);
    tl_mesh *mesh = make_object(plain, &m, field_bumps);
    attempt a = {mesh, shrink_ratio(0.3)};
    a.opts.error = 0.05;
    CHECK_OK(plain, try_once(plain, &a));
    size_t peak = tl_ctx_peak_bytes(plain);
    (void)state;
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(plain);
    size_t refused = 0;
    for (int part = 1; part <= 40; part++) {
        tl_ctx *ctx = NULL;
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        opts.thread_count = 1;
        tl_ctx *free_ctx = NULL;
        CHECK_STATUS(tl_ctx_create(&opts, &free_ctx), TL_OK);
        opts.budget_bytes = peak * (size_t)part / 36;
        CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
        tl_mesh *input = make_object(free_ctx, &m, field_bumps);
        a.mesh = input;
        tl_status st = try_once(ctx, &a);
        if (st) CHECK_STATUS(st, TL_ERR_BUDGET);
        refused += st != TL_OK;
        CHECK(tl_ctx_peak_bytes(ctx) <= opts.budget_bytes);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_mesh_destroy(input);
        tl_ctx_destroy(ctx);
        tl_ctx_destroy(free_ctx);
    }
    printf("%zu of 40 budgets up to 1.1 times the peak were too small\n", refused);
    CHECK(refused >= 20 && refused < 40);
    make_release(&m);
}

/* ---- hooks that end the call ---- */

typedef struct ending {
    long left; /* calls until the end */
    long calls;
} ending;

static bool end_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    ending *e = user;
    CHECK(stage && *stage && done <= total);
    e->calls++;
    return --e->left != 0;
}

static void test_cancel(void **state)
{
    (void)state;
    for (int method = 1; method <= TL_SIMPLIFY_BLOCKS; method++) {
        ending e = {0, 0};
        tl_ctx *ctx = NULL;
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        opts.thread_count = 2;
        opts.progress = end_progress;
        opts.user = &e;
        CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
        make_mesh m = two_regions(method == TL_SIMPLIFY_BLOCKS ? 19 : 9);
        tl_mesh *mesh = make_object(ctx, &m, field_bumps);
        attempt a = {mesh, shrink_ratio(0.1)};
        a.opts.method = (tl_simplify_method)method;
        size_t before = tl_ctx_current_bytes(ctx);
        for (long n = 1;; n++) {
            e = (ending){n, 0};
            tl_status st = try_once(ctx, &a);
            CHECK_EQ(tl_ctx_current_bytes(ctx), before);
            if (st == TL_OK) break;
            CHECK_STATUS(st, TL_ERR_CANCELLED);
            CHECK_EQ(e.calls, n); /* none after the one that ended it */
        }
        printf("%s: %ld reports of progress\n", method_names[method], e.calls);
        CHECK(e.calls >= 5);
        tl_mesh_destroy(mesh);
        make_release(&m);
        tl_ctx_destroy(ctx);
    }
}

static tl_status end_listener(void *user, const tl_collapse *collapse)
{
    ending *e = user;
    (void)collapse;
    e->calls++;
    return --e->left == 0 ? TL_ERR_IO : TL_OK;
}

static void test_listener_fails(void **state)
{
    make_mesh m = two_regions(13);
    tl_ctx *ctx = shrink_ctx(4);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    (void)state;
    for (int method = 1; method <= TL_SIMPLIFY_BLOCKS; method++)
        for (int by_error = 0; by_error < 2; by_error++)
            for (long n = 1; n < 1000; n = 7 * n + 1) {
                ending e = {n, 0};
                attempt a = {mesh, shrink_ratio(0.1)};
                a.opts.method = (tl_simplify_method)method;
                a.opts.error = by_error ? 0.05 : 0;
                a.opts.listener = end_listener;
                a.opts.listener_user = &e;
                size_t before = tl_ctx_current_bytes(ctx);
                CHECK_STATUS(try_once(ctx, &a), TL_ERR_IO);
                CHECK_EQ(e.calls, n);
                CHECK_EQ(tl_ctx_current_bytes(ctx), before);
            }
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* For the thread sanitizer: all threads at work, listened to. */
static void test_many_threads(void **state)
{
    make_mesh m = two_regions(22);
    tl_ctx *ctx = shrink_ctx(4);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    (void)state;
    for (int how = 0; how < 4; how++) {
        ending e = {0, 0};
        attempt a = {mesh, shrink_ratio(0.1)};
        a.opts.method = TL_SIMPLIFY_BLOCKS;
        a.opts.error = how & 1 ? 0.05 : 0;
        a.opts.placement = (tl_placement)(how >> 1);
        a.opts.listener = end_listener;
        a.opts.listener_user = &e;
        CHECK_OK(ctx, try_once(ctx, &a));
        CHECK(e.calls > 5000);
    }
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_allocation), cmocka_unit_test(test_allocations_in_blocks),
        cmocka_unit_test(test_budget),          cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_listener_fails),  cmocka_unit_test(test_many_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
