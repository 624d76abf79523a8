/* The thread pool: every item once, pieces where the contract says, failures that do not depend on
 * timing, many short jobs, messages from workers. */
#include "check.h"
#include "check_ctx.h"

#include "base/base.h"

#include <stdatomic.h>
#include <time.h>

static void pause_us(long us)
{
    nanosleep(&(struct timespec){.tv_nsec = us * 1000}, NULL);
}

static const unsigned thread_counts[] = {1, 2, 3, 8};
#define THREAD_COUNTS (sizeof thread_counts / sizeof *thread_counts)

typedef struct work {
    tl_ctx *ctx;
    atomic_uint *visits; /* [item_count] */
    size_t item_count, grain;
    size_t fail_from;      /* items from here on fail; SIZE_MAX: none */
    atomic_uint inside[8]; /* calls running per worker */
    atomic_uint errors;    /* broken promises seen inside, where checks can't be used */
    atomic_size_t visited;
} work;

static tl_status visit(void *arg, size_t begin, size_t end, unsigned worker)
{
    work *w = arg;
    bool wrong = begin >= end || begin % w->grain || end > w->item_count ||
                 (end - begin != w->grain && end != w->item_count) ||
                 worker >= tl_ctx_thread_count(w->ctx);
    if (wrong || atomic_fetch_add(&w->inside[worker], 1)) w->errors++;
    tl_status st = TL_OK;
    for (size_t i = begin; i < end && !st; i++) {
        w->visits[i]++;
        w->visited++;
        if (i >= w->fail_from) st = tl_fail(w->ctx, TL_ERR_DATA, "item %zu", i);
    }
    if (!wrong) w->inside[worker]--;
    if (st) tl_note(w->ctx, st, "in piece %zu", begin / w->grain);
    return st;
}

static void test_each_item_once(void **state)
{
    (void)state;
    static atomic_uint visits[5000];
    const size_t counts[] = {0, 1, 2, 63, 64, 65, 4999, 5000}, grains[] = {1, 7, 64, 100000};
    for (size_t t = 0; t < THREAD_COUNTS; t++) {
        tl_ctx *ctx = check_ctx_create(thread_counts[t]);
        for (size_t c = 0; c < 8; c++)
            for (size_t g = 0; g < 4; g++) {
                work w = {.ctx = ctx,
                          .visits = visits,
                          .item_count = counts[c],
                          .grain = grains[g],
                          .fail_from = SIZE_MAX};
                for (size_t i = 0; i < 5000; i++) visits[i] = 0;
                CHECK_OK(ctx, tli_parallel(ctx, counts[c], grains[g], visit, &w));
                for (size_t i = 0; i < 5000; i++) CHECK_EQ(visits[i], i < counts[c]);
                CHECK_EQ(w.errors, 0);
            }
        tl_ctx_destroy(ctx);
    }
}

/* Whatever the timing, the lowest piece that fails is the one that is told of. */
static void test_failure_is_repeatable(void **state)
{
    (void)state;
    static atomic_uint visits[1000];
    for (size_t t = 0; t < THREAD_COUNTS; t++) {
        tl_ctx *ctx = check_ctx_create(thread_counts[t]);
        for (int round = 0; round < 300; round++) {
            work w = {.ctx = ctx,
                      .visits = visits,
                      .item_count = 1000,
                      .grain = 3,
                      .fail_from = (size_t)(round * 37 % 1000)};
            char expected[64];
            snprintf(expected, sizeof expected, "item %zu\nin piece %zu", w.fail_from,
                     w.fail_from / 3);
            CHECK_STATUS(tli_parallel(ctx, 1000, 3, visit, &w), TL_ERR_DATA);
            assert_string_equal(tl_ctx_message(ctx), expected);
            CHECK_EQ(w.errors, 0);
        }
        work w = {
            .ctx = ctx, .visits = visits, .item_count = 1000, .grain = 3, .fail_from = SIZE_MAX};
        CHECK_OK(ctx, tli_parallel(ctx, 1000, 3, visit, &w)); /* the pool is as good as before */
        tl_ctx_destroy(ctx);
    }
}

static tl_status fail_second(void *arg, size_t begin, size_t end, unsigned worker)
{
    atomic_size_t *begun = arg;
    (void)end;
    (void)worker;
    ++*begun;
    if (begin == 1) return TL_ERR_CANCELLED;
    pause_us(200); /* long enough for the failure to be seen */
    return TL_OK;
}

static void test_failure_ends_the_job(void **state)
{
    (void)state;
    for (size_t t = 0; t < THREAD_COUNTS; t++) {
        tl_ctx *ctx = check_ctx_create(thread_counts[t]);
        atomic_size_t begun = 0;
        CHECK_STATUS(tli_parallel(ctx, 100000, 1, fail_second, &begun), TL_ERR_CANCELLED);
        CHECK_BOUND("pieces begun of 100000", (double)begun, 50000.0);
        tl_ctx_destroy(ctx);
    }
}

static bool stop_at_half(void *user, const char *stage, uint64_t done, uint64_t total)
{
    (void)user;
    (void)stage;
    return done < total / 2;
}

static tl_status sum_up(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    atomic_fetch_add((atomic_size_t *)arg, end - begin);
    return TL_OK;
}

/* A driver as the stages have it: phases on the pool, progress between them. */
static void test_cancel_between_phases(void **state)
{
    (void)state;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 3;
    opts.progress = stop_at_half;
    tl_ctx *ctx = NULL;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    atomic_size_t sum = 0;
    tl_status st = TL_OK;
    for (uint64_t phase = 0; !st && phase < 10; phase++) {
        st = tl_progress(ctx, "phases", phase, 10);
        if (!st) st = tli_parallel(ctx, 1000, 10, sum_up, &sum);
    }
    CHECK_STATUS(st, TL_ERR_CANCELLED);
    CHECK_EQ(sum, 5000);
    tl_ctx_destroy(ctx);
}

static void test_many_short_jobs(void **state)
{
    (void)state;
    for (size_t t = 0; t < THREAD_COUNTS; t++) {
        tl_ctx *ctx = check_ctx_create(thread_counts[t]);
        atomic_size_t sum = 0;
        double start = tli_clock_s();
        for (int i = 0; i < 5000; i++) CHECK_OK(ctx, tli_parallel(ctx, 16, 1, sum_up, &sum));
        printf("%u threads: %.1f us a job of 16 empty pieces\n", thread_counts[t],
               1e6 * (tli_clock_s() - start) / 5000);
        CHECK_EQ(sum, 5000 * 16);
        tl_ctx_destroy(ctx);
    }
}

/* Both threads work at the same time: each waits for the other, with a limit. */
typedef struct meeting {
    atomic_uint arrived;
    atomic_bool missed;
} meeting;

static tl_status meet(void *arg, size_t begin, size_t end, unsigned worker)
{
    meeting *m = arg;
    (void)begin;
    (void)end;
    (void)worker;
    m->arrived++;
    for (double start = tli_clock_s(); m->arrived < 2;) {
        if (tli_clock_s() - start > 20) {
            m->missed = true;
            break;
        }
        pause_us(50);
    }
    return TL_OK;
}

static void test_threads_run_together(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    meeting m = {0};
    CHECK_OK(ctx, tli_parallel(ctx, 2, 1, meet, &m));
    CHECK(!m.missed);
    tl_ctx_destroy(ctx);
}

typedef struct line_count {
    atomic_uint inside, lines, overlaps;
} line_count;

static void count_line(void *user, tl_log_level level, const char *text)
{
    line_count *count = user;
    (void)level;
    (void)text;
    if (count->inside++) count->overlaps++;
    count->lines++;
    count->inside--;
}

static tl_status log_lines(void *arg, size_t begin, size_t end, unsigned worker)
{
    for (size_t i = begin; i < end; i++) tl_log(arg, TL_LOG_DEBUG, "item %zu on %u", i, worker);
    return TL_OK;
}

static void test_log_from_workers(void **state)
{
    (void)state;
    line_count count = {0};
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 4;
    opts.log = count_line;
    opts.user = &count;
    tl_ctx *ctx = NULL;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    CHECK_OK(ctx, tli_parallel(ctx, 2000, 1, log_lines, ctx));
    CHECK_EQ(count.lines, 2000);
    CHECK_EQ(count.overlaps, 0);
    tl_ctx_destroy(ctx);
}

/* Each item works in a fork: nested tli_parallel, memory under the parent's budget, messages. */
static tl_status work_in_fork(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    work *w = arg;
    tl_status st = TL_OK;
    for (size_t i = begin; i < end && !st; i++) {
        tl_ctx *fork = NULL;
        st = tli_ctx_fork(w->ctx, &fork);
        if (st) break;
        work inner = {.ctx = fork, .visits = w->visits + i * 10, .item_count = 10, .grain = 3};
        inner.fail_from = w->fail_from == i ? 4 : SIZE_MAX;
        void *block = tl_mem_alloc(fork, 1000, 1, &st);
        if (!st) st = tli_parallel(fork, 10, 3, visit, &inner);
        if (tl_ctx_current_bytes(w->ctx) < 1000 || atomic_load(&inner.errors)) w->errors++;
        tl_mem_free(fork, block);
        st = tli_ctx_join(w->ctx, fork, st);
    }
    return st;
}

static void test_forks_work_inside(void **state)
{
    (void)state;
    static atomic_uint visits[1000];
    for (size_t t = 0; t < THREAD_COUNTS; t++) {
        tl_ctx *ctx = check_ctx_create(thread_counts[t]);
        memset(visits, 0, sizeof visits);
        work w = {.ctx = ctx, .visits = visits, .fail_from = SIZE_MAX};
        CHECK_STATUS(tli_parallel(ctx, 100, 1, work_in_fork, &w), TL_OK);
        for (size_t i = 0; i < 1000; i++) CHECK_EQ(visits[i], 1);
        w.fail_from = 57;
        CHECK_STATUS(tli_parallel(ctx, 100, 1, work_in_fork, &w), TL_ERR_DATA);
        CHECK(!strcmp(tl_ctx_message(ctx), "item 4\nin piece 1"));
        CHECK_EQ(w.errors, 0);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        CHECK(tl_ctx_peak_bytes(ctx) >= 1000);
        tl_ctx_destroy(ctx);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_item_once),        cmocka_unit_test(test_forks_work_inside),
        cmocka_unit_test(test_failure_is_repeatable), cmocka_unit_test(test_failure_ends_the_job),
        cmocka_unit_test(test_cancel_between_phases), cmocka_unit_test(test_many_short_jobs),
        cmocka_unit_test(test_threads_run_together),  cmocka_unit_test(test_log_from_workers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
