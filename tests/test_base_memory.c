/* Blocks, budget, arena, checked integers. */
#include "check.h"

#include "check_alloc.h"

#include "base/base.h"

#define BUDGET ((size_t)1 << 20)
#define HEADER_BYTES 16 /* counted with each block */

static tl_ctx *ctx_create(size_t budget_bytes, check_alloc *alloc, unsigned thread_count)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.budget_bytes = budget_bytes;
    opts.thread_count = thread_count;
    if (alloc) {
        opts.resize = check_alloc_resize;
        opts.user = alloc;
    }
    tl_ctx *ctx = NULL;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

static void test_checked_integers(void **state)
{
    (void)state;
    size_t out = 7;
    CHECK(tli_mul_size(0, SIZE_MAX, &out) && out == 0);
    CHECK(tli_mul_size(SIZE_MAX, 1, &out) && out == SIZE_MAX);
    CHECK(tli_mul_size(SIZE_MAX / 3, 3, &out) && out == SIZE_MAX / 3 * 3);
    out = 7;
    CHECK(!tli_mul_size(SIZE_MAX / 2 + 1, 2, &out) && out == 7);
    CHECK(!tli_mul_size((size_t)1 << 32, (size_t)1 << 32, &out) && out == 7);
    CHECK(!tli_add_size(SIZE_MAX, 1, &out) && out == 7);
    CHECK(tli_add_size(SIZE_MAX - 1, 1, &out) && out == SIZE_MAX);
    tl_lidx index = 7;
    CHECK(!tli_to_lidx(TL_NONE, &index) && index == 7);
    CHECK(!tli_to_lidx((uint64_t)1 << 32, &index) && index == 7);
    CHECK(tli_to_lidx(TL_NONE - 1, &index) && index == TL_NONE - 1);
}

static void test_blocks(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_create(0, NULL, 1);
    tl_status st = TL_OK;
    void *blocks[100];
    for (size_t i = 0; i < 100; i++) {
        blocks[i] = tl_mem_alloc(ctx, i, 3, &st);
        CHECK(blocks[i] && (uintptr_t)blocks[i] % 16 == 0);
        memset(blocks[i], 0x5a, 3 * i);
    }
    CHECK_OK(ctx, st);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 3 * 99 * 100 / 2 + 100 * HEADER_BYTES);
    for (size_t i = 0; i < 100; i++) tl_mem_free(ctx, blocks[i]);
    tl_mem_free(ctx, NULL);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    CHECK_EQ(tl_ctx_peak_bytes(ctx), 3 * 99 * 100 / 2 + 100 * HEADER_BYTES);
    tl_ctx_reset_peak(ctx);
    CHECK_EQ(tl_ctx_peak_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void check_zero(tl_ctx *ctx, size_t bytes)
{
    tl_status st = TL_OK;
    uint8_t *dirty = tl_mem_alloc(ctx, bytes, 1, &st); /* so that reused memory is not zero */
    CHECK_OK(ctx, st);
    memset(dirty, 0xff, bytes);
    tl_mem_free(ctx, dirty);
    uint8_t *zero = tl_mem_zalloc(ctx, bytes, 1, &st);
    CHECK_OK(ctx, st);
    for (size_t i = 0; i < bytes; i++) CHECK_EQ(zero[i], 0);
    tl_mem_free(ctx, zero);
}

static void test_zero_filled(void **state)
{
    (void)state;
    check_alloc alloc = {0};
    tl_ctx *own = ctx_create(0, NULL, 1), *hooked = ctx_create(0, &alloc, 1);
    for (size_t bytes = 1; bytes < 5000000; bytes = bytes * 3 + 1) {
        check_zero(own, bytes);
        check_zero(hooked, bytes);
    }
    tl_ctx_destroy(hooked);
    tl_ctx_destroy(own);
}

/* A large zero-filled block costs no time for memory that is not touched. */
static void test_zero_pages_are_cheap(void **state)
{
    (void)state;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    CHECK_SKIP("the sanitizer's allocator touches every page");
#endif
    tl_ctx *ctx = ctx_create(0, NULL, 1);
    tl_status st = TL_OK;
    double start = tli_clock_s();
    uint8_t *block = tl_mem_zalloc(ctx, (size_t)4 << 30, 1, &st);
    double seconds = tli_clock_s() - start;
    if (st) {
        tl_ctx_destroy(ctx);
        CHECK_SKIP("the system has no 4 GiB to promise");
    }
    CHECK_EQ(block[(size_t)3 << 30], 0);
    tl_mem_free(ctx, block);
    tl_ctx_destroy(ctx);
    CHECK_BOUND("seconds for 4 GiB of zeros", seconds, 0.25);
}

static void test_resize_keeps_content(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_create(0, NULL, 1);
    tl_status st = TL_OK;
    uint32_t *block = NULL;
    size_t count = 0;
    for (size_t next = 1; next < 1000000; next = next * 2 + 1) {
        block = tl_mem_resize(ctx, block, next, sizeof *block, &st);
        CHECK_OK(ctx, st);
        for (size_t i = 0; i < count; i++) CHECK_EQ(block[i], (uint32_t)i * 7);
        for (size_t i = count; i < next; i++) block[i] = (uint32_t)i * 7;
        count = next;
    }
    block = tl_mem_resize(ctx, block, 10, sizeof *block, &st);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 40 + HEADER_BYTES);
    for (size_t i = 0; i < 10; i++) CHECK_EQ(block[i], i * 7);
    block = tl_mem_resize(ctx, block, 0, sizeof *block, &st);
    CHECK(block && !st);
    tl_mem_free(ctx, block);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_budget_is_hard(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_create(BUDGET, NULL, 1);
    tl_status st = TL_OK;
    void *all = tl_mem_alloc(ctx, BUDGET - HEADER_BYTES, 1, &st); /* to the last byte */
    CHECK_OK(ctx, st);
    CHECK_EQ(tl_ctx_current_bytes(ctx), BUDGET);
    CHECK(!tl_mem_alloc(ctx, 0, 1, &st));
    CHECK_STATUS(st, TL_ERR_BUDGET);
    assert_string_equal(tl_ctx_message(ctx),
                        "16 bytes wanted, but 1048576 of the budget of 1048576 "
                        "bytes are in use");
    st = TL_OK;
    CHECK(tl_mem_resize(ctx, all, BUDGET, 1, &st) == all);
    CHECK_STATUS(st, TL_ERR_BUDGET);
    CHECK_EQ(tl_ctx_current_bytes(ctx), BUDGET);
    tl_mem_free(ctx, all);

    st = TL_OK;
    CHECK(!tl_mem_zalloc(ctx, BUDGET - HEADER_BYTES + 1, 1, &st));
    CHECK_STATUS(st, TL_ERR_BUDGET);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    CHECK_EQ(tl_ctx_peak_bytes(ctx), BUDGET);
    tl_ctx_destroy(ctx);
}

static void test_failed_status_passes_through(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_create(0, NULL, 1);
    tl_status st = TL_OK;
    int *block = tl_mem_alloc(ctx, 1, sizeof *block, &st);
    *block = 42;
    st = TL_ERR_DATA;
    CHECK(!tl_mem_alloc(ctx, 1, 1, &st));
    CHECK(!tl_mem_zalloc(ctx, 1, 1, &st));
    CHECK(!tl_mem_resize(ctx, NULL, 1, 1, &st));
    CHECK(tl_mem_resize(ctx, block, 1000, 1, &st) == block);
    CHECK_STATUS(st, TL_ERR_DATA);
    CHECK_EQ(*block, 42);
    tl_mem_free(ctx, block);
    tl_ctx_destroy(ctx);
}

static void test_sizes_that_overflow(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_create(0, NULL, 1);
    const size_t sizes[][2] = {{SIZE_MAX, 1}, {SIZE_MAX - 8, 1},     {SIZE_MAX / 2, 1},
                               {SIZE_MAX, 8}, {SIZE_MAX / 8 + 1, 8}, {3, SIZE_MAX / 2}};
    void *block = NULL;
    for (size_t i = 0; i < 6; i++) {
        tl_status st = TL_OK;
        CHECK(!tl_mem_alloc(ctx, sizes[i][0], sizes[i][1], &st));
        CHECK_STATUS(st, TL_ERR_MEMORY);
        st = TL_OK;
        CHECK(tl_mem_resize(ctx, block, sizes[i][0], sizes[i][1], &st) == block);
        CHECK_STATUS(st, TL_ERR_MEMORY);
        st = TL_OK;
        if (!block) block = tl_mem_alloc(ctx, 1, 1, &st);
    }
    tl_mem_free(ctx, block);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_allocator_that_fails(void **state)
{
    (void)state;
    check_alloc alloc = {.fail_at = 3}; /* the context is the first request */
    tl_ctx *ctx = ctx_create(BUDGET, &alloc, 1);
    tl_status st = TL_OK;
    char *block = tl_mem_alloc(ctx, 8, 1, &st);
    memcpy(block, "tetralod", 8);
    CHECK(tl_mem_resize(ctx, block, 1000, 1, &st) == block);
    CHECK_STATUS(st, TL_ERR_MEMORY);
    CHECK(strstr(tl_ctx_message(ctx), "1016 bytes") != NULL);
    CHECK(memcmp(block, "tetralod", 8) == 0);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 8 + HEADER_BYTES);
    st = TL_OK;
    block = tl_mem_resize(ctx, block, 1000, 1, &st);
    CHECK_OK(ctx, st);
    tl_mem_free(ctx, block);
    alloc.fail_at = alloc.requests + 1;
    CHECK(!tl_mem_zalloc(ctx, 10, 10, &st));
    CHECK_STATUS(st, TL_ERR_MEMORY);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
    CHECK_EQ(alloc.live_blocks, 0);
}

static tl_status churn(void *arg, size_t begin, size_t end, unsigned worker)
{
    tl_ctx *ctx = arg;
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        tl_status st = TL_OK;
        uint8_t *a = tl_mem_alloc(ctx, i % 3000, 1, &st), *b = tl_mem_zalloc(ctx, i % 70, 8, &st);
        a = tl_mem_resize(ctx, a, i % 5000, 1, &st);
        tl_mem_free(ctx, b);
        tl_mem_free(ctx, a);
        if (st) return st;
    }
    return TL_OK;
}

static void test_accounting_over_threads(void **state)
{
    (void)state;
    check_alloc alloc = {0};
    tl_ctx *ctx = ctx_create(BUDGET, &alloc, 4);
    CHECK_OK(ctx, tli_parallel(ctx, 20000, 16, churn, ctx));
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    CHECK(tl_ctx_peak_bytes(ctx) > 3000 && tl_ctx_peak_bytes(ctx) < 4 * 6000);
    tl_ctx_destroy(ctx);
    CHECK_EQ(alloc.live_blocks, 0);
    CHECK_EQ(alloc.bytes, 0);
}

static void test_strdup(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_create(0, NULL, 1);
    tl_status st = TL_OK;
    char *copy = tli_strdup(ctx, "pressure", &st);
    assert_string_equal(copy, "pressure");
    CHECK(!tli_strdup(ctx, NULL, &st));
    CHECK_OK(ctx, st);
    tl_mem_free(ctx, copy);
    tl_ctx_destroy(ctx);
}

/* ---- arena ---- */

static void test_arena(void **state)
{
    (void)state;
    enum { COUNT = 3000 };
    tl_ctx *ctx = ctx_create(0, NULL, 1);
    tl_status st = TL_OK;
    tli_arena arena;
    tli_arena_open(ctx, &arena);
    static uint8_t *blocks[COUNT];
    for (size_t i = 0; i < COUNT; i++) {
        size_t bytes = i % 500 == 499 ? 100000 : i % 97;
        blocks[i] = tli_arena_alloc(&arena, bytes, 1, &st);
        CHECK_OK(ctx, st);
        CHECK((uintptr_t)blocks[i] % 16 == 0);
        memset(blocks[i], (int)(i & 0xff), bytes);
    }
    for (size_t i = 0; i < COUNT; i++) /* nobody wrote into a neighbour */
        for (size_t k = 0, bytes = i % 500 == 499 ? 100000 : i % 97; k < bytes; k++)
            CHECK_EQ(blocks[i][k], i & 0xff);
    CHECK_BOUND("arena bytes", (double)tl_ctx_current_bytes(ctx), 2.0 * (6 * 100000 + COUNT * 64));
    tli_arena_close(&arena);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tli_arena_close(&arena); /* empty again, may be closed again */
    CHECK(!tli_arena_alloc(&arena, SIZE_MAX, 2, &st));
    CHECK_STATUS(st, TL_ERR_MEMORY);
    st = TL_OK;
    CHECK(!tli_arena_alloc(&arena, SIZE_MAX, 1, &st));
    CHECK_STATUS(st, TL_ERR_MEMORY);
    st = TL_OK;
    CHECK(
        !tli_arena_alloc(&arena, SIZE_MAX - 40, 1, &st)); /* fits until the chunk's head is added */
    CHECK_STATUS(st, TL_ERR_MEMORY);
    CHECK(!tli_arena_alloc(&arena, 1, 1, &st));
    tl_ctx_destroy(ctx);
}

static void test_arena_under_budget(void **state)
{
    (void)state;
    tl_ctx *ctx = ctx_create(BUDGET, NULL, 1);
    tl_status st = TL_OK;
    tli_arena arena;
    tli_arena_open(ctx, &arena);
    size_t given = 0;
    while (tli_arena_alloc(&arena, 1000, 1, &st)) given += 1000;
    CHECK_STATUS(st, TL_ERR_BUDGET);
    CHECK(given > BUDGET / 3);
    CHECK(tl_ctx_peak_bytes(ctx) <= BUDGET);
    tli_arena_close(&arena);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_checked_integers),
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_zero_filled),
        cmocka_unit_test(test_zero_pages_are_cheap),
        cmocka_unit_test(test_resize_keeps_content),
        cmocka_unit_test(test_budget_is_hard),
        cmocka_unit_test(test_failed_status_passes_through),
        cmocka_unit_test(test_sizes_that_overflow),
        cmocka_unit_test(test_allocator_that_fails),
        cmocka_unit_test(test_accounting_over_threads),
        cmocka_unit_test(test_strdup),
        cmocka_unit_test(test_arena),
        cmocka_unit_test(test_arena_under_budget),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
