/* A reader that is as slow as a disk may be: for one thread and for several, and asked to end. */
#include "base/base_lock.h"

#include "check_ctx.h"
#include "make_store.h"

typedef struct reading {
    tl_ctx *ctx;
    const tl_store *store;
    uint32_t first, end; /* patches */
    tl_status status;
    uint64_t bytes;
} reading;

static void read_topologies(void *arg)
{
    reading *r = arg;
    for (uint32_t p = r->first; !r->status && p < r->end; p++) {
        uint8_t *bytes = NULL;
        size_t byte_count = 0;
        r->status = tl_store_blob(r->ctx, r->store, p, TL_TOPOLOGY, &bytes, &byte_count);
        if (r->status) break;
        r->bytes += byte_count;
        tl_mem_free(r->ctx, bytes);
    }
}

static tl_store *open_model(tl_ctx *ctx)
{
    tl_store *store = NULL;
    make_store m = {.level_count = 4, .coarse_segments = 60, .channel_count = 2, .vert_count = 6};
    make_store_open(&m);
    CHECK_OK(ctx, make_store_write(ctx, ctx, &m, "t.tlod"));
    CHECK_OK(ctx, tl_store_open(ctx, "t.tlod", &store));
    return store;
}

/* Two threads together read no faster than one may. */
static void test_slow(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = open_model(ctx);
    reading r[2] = {{check_ctx_create(1), store, 0, 500, TL_OK, 0},
                    {check_ctx_create(1), store, 500, 1000, TL_OK, 0}};
    tli_thread thread;
    for (int i = 0; i < 2; i++) read_topologies(&r[i]); /* pages of the index are there now */
    const uint64_t bytes = r[0].bytes + r[1].bytes, before = tl_store_bytes_read(store);
    tl_store_set_throttle(store, 10 * bytes);
    double start = tli_clock_s();
    CHECK_OK(ctx, tli_thread_start(ctx, read_topologies, &r[1], &thread));
    read_topologies(&r[0]);
    tli_thread_join(&thread);
    double seconds = tli_clock_s() - start;
    for (int i = 0; i < 2; i++) CHECK_STATUS(r[i].status, TL_OK);
    const double least = (double)(tl_store_bytes_read(store) - before) / (10 * (double)bytes);
    printf("%llu bytes in %.3f s, at least %.3f s\n", (unsigned long long)bytes, seconds, least);
    CHECK(least >= 0.1);
    CHECK(seconds >= least);
    tl_store_set_throttle(store, 0);
    tl_store_close(store);
    for (int i = 0; i < 2; i++) check_ctx_destroy(r[i].ctx);
    check_ctx_destroy(ctx);
}

static void test_slow_is_cancelled(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = open_model(ctx);
    reading r = {check_ctx_create(1), store, 0, 1000, TL_OK, 0};
    tli_thread thread;
    tl_store_set_throttle(store, 1); /* years */
    CHECK_OK(ctx, tli_thread_start(ctx, read_topologies, &r, &thread));
    tl_ctx_cancel(r.ctx, true);
    tli_thread_join(&thread);
    CHECK_STATUS(r.status, TL_ERR_CANCELLED);
    tl_store_close(store);
    check_ctx_destroy(r.ctx);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_slow),
                                       cmocka_unit_test(test_slow_is_cancelled)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
