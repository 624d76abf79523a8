/* Threads of no pool, bells with a limit of time, and calls that another thread cancels. */
#include <signal.h>
#include <stdatomic.h>

#include "base/base_lock.h"

#include "check_ctx.h"

/* Two threads count in turns. */
typedef struct turns {
    tli_lock lock;
    tli_bell bell;
    int count;
    bool masked; /* signals are blocked there */
} turns;

static void count_odd(void *arg)
{
    turns *t = arg;
    sigset_t mask;
    pthread_sigmask(SIG_SETMASK, NULL, &mask);
    tli_lock_take(&t->lock);
    t->masked = sigismember(&mask, SIGINT) == 1;
    for (int i = 0; i < 100; i++) {
        while (t->count % 2 == 0) tli_bell_wait(&t->bell, &t->lock);
        t->count++;
        tli_bell_ring(&t->bell);
    }
    tli_lock_give(&t->lock);
}

static void test_threads_take_turns(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_thread thread, none = {0};
    turns t = {0};
    CHECK_OK(ctx, tli_lock_create(ctx, &t.lock));
    CHECK_OK(ctx, tli_bell_create(ctx, &t.bell));
    CHECK_OK(ctx, tli_thread_start(ctx, count_odd, &t, &thread));
    tli_lock_take(&t.lock);
    for (int i = 0; i < 100; i++) {
        while (t.count % 2 == 1) CHECK(tli_bell_wait_for(&t.bell, &t.lock, 20));
        t.count++;
        tli_bell_ring(&t.bell);
    }
    tli_lock_give(&t.lock);
    tli_thread_join(&thread);
    tli_thread_join(&thread); /* again: nothing */
    tli_thread_join(&none);
    CHECK_EQ(t.count, 200);
    CHECK(t.masked);
    tli_bell_destroy(&t.bell);
    tli_lock_destroy(&t.lock);
    check_ctx_destroy(ctx);
}

static void test_bell_gives_up(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_lock lock;
    tli_bell bell;
    CHECK_OK(ctx, tli_lock_create(ctx, &lock));
    CHECK_OK(ctx, tli_bell_create(ctx, &bell));
    const double waits[] = {-1, 0, 0.05, 0.999999999e-3};
    tli_lock_take(&lock);
    for (int i = 0; i < 4; i++) {
        double start = tli_clock_s();
        while (tli_bell_wait_for(&bell, &lock, start + waits[i] - tli_clock_s())) {
        }
        CHECK(tli_clock_s() - start >= waits[i]);
    }
    tli_lock_give(&lock);
    tli_bell_destroy(&bell);
    tli_lock_destroy(&lock);
    check_ctx_destroy(ctx);
}

/* Work that lasts until it is cancelled. */
typedef struct endless {
    tl_ctx *ctx;
    atomic_size_t begun;
} endless;

static tl_status take_a_while(void *arg, size_t begin, size_t end, unsigned worker)
{
    endless *e = arg;
    (void)begin, (void)end, (void)worker;
    atomic_fetch_add(&e->begun, 1);
    double start = tli_clock_s();
    while (tli_clock_s() - start < 1e-4) {
    }
    return TL_OK;
}

static void cancel_once_begun(void *arg)
{
    endless *e = arg;
    while (!atomic_load(&e->begun)) {
    }
    tl_ctx_cancel(e->ctx, true);
}

static void test_cancel_from_another_thread(void **state)
{
    (void)state;
    for (unsigned threads = 1; threads <= 3; threads += 2) {
        endless e = {.ctx = check_ctx_create(threads)};
        tli_thread thread;
        CHECK_OK(e.ctx, tli_thread_start(e.ctx, cancel_once_begun, &e, &thread));
        CHECK_STATUS(tli_parallel(e.ctx, 1000000000, 1, take_a_while, &e), TL_ERR_CANCELLED);
        CHECK(!strcmp(tl_ctx_message(e.ctx), "cancelled"));
        tli_thread_join(&thread);
        CHECK_STATUS(tl_progress(e.ctx, "turning", 0, 1), TL_ERR_CANCELLED);
        CHECK(!strcmp(tl_ctx_message(e.ctx), "cancelled during turning"));
        tl_ctx *fork = NULL;
        CHECK_OK(e.ctx, tli_ctx_fork(e.ctx, &fork));
        CHECK_STATUS(tli_parallel(fork, 1, 1, take_a_while, &e), TL_ERR_CANCELLED);
        CHECK_STATUS(tli_ctx_join(e.ctx, fork, TL_OK), TL_OK);
        tl_ctx_cancel(e.ctx, false);
        CHECK_OK(e.ctx, tli_parallel(e.ctx, 10, 1, take_a_while, &e));
        CHECK_OK(e.ctx, tl_progress(e.ctx, "turning", 0, 1));
        check_ctx_destroy(e.ctx);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_threads_take_turns),
                                       cmocka_unit_test(test_bell_gives_up),
                                       cmocka_unit_test(test_cancel_from_another_thread)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
