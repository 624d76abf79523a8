/* Blocks in working files: they hold what memory would hold, whatever the budget; they grow and
 * shrink, outlive the spilling, and fail with a message. */
#include "check.h"

#include "base/base_file.h"
#include "base/base_spill.h"

enum { BUDGET = 1 << 20, BIG = 5 << 20 };

static tl_ctx *make_ctx(size_t budget)
{
    tl_ctx *ctx;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.budget_bytes = budget;
    opts.thread_count = 2;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

static void fill(uint8_t *bytes, size_t begin, size_t end)
{
    for (size_t i = begin; i < end; i++) bytes[i] = (uint8_t)(i * 2654435761u >> 13);
}

static void check_filled(const uint8_t *bytes, size_t count)
{
    size_t wrong = 0;
    for (size_t i = 0; i < count; i++) wrong += bytes[i] != (uint8_t)(i * 2654435761u >> 13);
    CHECK_EQ(wrong, 0);
}

static void test_blocks(void **state)
{
    (void)state;
    tl_ctx *ctx = make_ctx(BUDGET);
    tl_status st = TL_OK;
    CHECK(tl_mem_alloc(ctx, BIG, 1, &st) == NULL);
    CHECK_STATUS(st, TL_ERR_BUDGET);
    st = TL_OK;
    tli_spill_begin(ctx, NULL);
    uint8_t *small = tl_mem_alloc(ctx, 1000, 1, &st);
    uint8_t *zeros = tl_mem_zalloc(ctx, BIG, 1, &st), *grown = tl_mem_alloc(ctx, 1000, 1, &st);
    CHECK_STATUS(st, TL_OK);
    CHECK_EQ((uintptr_t)zeros % 16, 0);
    CHECK(tli_spill_bytes(ctx) >= BIG);
    for (size_t i = 0; i < BIG; i += 4096) CHECK_EQ(zeros[i], 0);
    fill(zeros, 0, BIG);
    fill(grown, 0, 1000);
    for (size_t held = 1000, more = 300000; held < BIG; held += more) { /* by steps */
        grown = tl_mem_resize(ctx, grown, held + more, 1, &st);
        CHECK_STATUS(st, TL_OK);
        fill(grown, held, held + more);
        CHECK_STATUS(tl_progress(ctx, "test", 0, 1), TL_OK); /* gives pages back */
        check_filled(grown, held + more);
    }
    check_filled(zeros, BIG);
    CHECK(tl_ctx_current_bytes(ctx) < 4000);
    tli_spill_end(ctx);
    grown = tl_mem_resize(ctx, grown, 5000, 1, &st); /* where it is */
    check_filled(grown, 5000);
    zeros = tl_mem_resize(ctx, zeros, 3 * (size_t)BIG, 1, &st); /* not any more */
    CHECK_STATUS(st, TL_ERR_BUDGET);
    check_filled(zeros, BIG);
    tl_mem_free(ctx, zeros);
    tl_mem_free(ctx, grown);
    tl_mem_free(ctx, small);
    CHECK_EQ(tli_spill_bytes(ctx), 0);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Without a budget nothing is spilled. */
static void test_no_budget(void **state)
{
    (void)state;
    tl_ctx *ctx = make_ctx(0);
    tl_status st = TL_OK;
    tli_spill_begin(ctx, "/nowhere");
    void *block = tl_mem_alloc(ctx, BIG, 1, &st);
    CHECK_STATUS(st, TL_OK);
    CHECK_EQ(tli_spill_bytes(ctx), 0);
    tl_mem_free(ctx, block);
    tli_spill_end(ctx);
    tl_ctx_destroy(ctx);
}

static void test_failures(void **state)
{
    (void)state;
    tl_ctx *ctx = make_ctx(BUDGET);
    tl_status st = TL_OK;
    tli_spill_begin(ctx, "/nowhere/at/all");
    CHECK(tl_mem_alloc(ctx, BIG, 1, &st) == NULL);
    CHECK_STATUS(st, TL_ERR_IO);
    CHECK(strstr(tl_ctx_message(ctx), "/nowhere/at/all") != NULL);
    st = TL_OK;
    tli_spill_begin(ctx, NULL);
    uint8_t *kept = tl_mem_alloc(ctx, BIG, 1, &st);
    CHECK_STATUS(st, TL_OK);
    fill(kept, 0, BIG);
    for (uint64_t n = 1; n <= 2; n++) { /* opening, taking the room */
        tli_file_fail_at(ctx, n);
        CHECK(tl_mem_resize(ctx, kept, 2 * (size_t)BIG, 1, &st) == kept);
        CHECK_STATUS(st, TL_ERR_IO);
        st = TL_OK;
        check_filled(kept, BIG);
    }
    tli_file_fail_at(ctx, 0);
    CHECK(tl_mem_alloc(ctx, (size_t)1 << 50, 1, &st) == NULL); /* no disk has it */
    CHECK_STATUS(st, TL_ERR_IO);
    tl_mem_free(ctx, kept);
    tli_spill_end(ctx);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_blocks),
                                       cmocka_unit_test(test_no_budget),
                                       cmocka_unit_test(test_failures)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
