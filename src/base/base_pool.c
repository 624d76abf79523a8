/* The thread pool: workers sleep on a condition variable and take pieces of the current job from
 * one counter. A job is over when its pieces are taken and the workers that joined have left; a
 * worker that wakes up too late finds it closed and is not waited for. The only file that starts
 * threads. */
#include "base/base_context.h"
#include "base/base_lock.h"

#include <signal.h>

typedef struct job {
    tl_ctx *ctx;
    tli_range_fn fn;
    void *arg;
    size_t item_count, grain, piece_count;
    atomic_size_t next_piece;
    atomic_bool failed;
    /* the lowest failed piece, under the pool's mutex */
    size_t failed_piece;
    unsigned failed_worker;
    tl_status status;
} job;

typedef struct worker {
    tli_pool *pool;
    pthread_t thread;
    unsigned number;
} worker;

struct tli_pool {
    tl_ctx *ctx;
    pthread_mutex_t mutex;
    pthread_cond_t wake, idle;
    job *job;            /* open for joining, or NULL */
    uint64_t generation; /* counts jobs, so that a worker joins each at most once */
    unsigned active;     /* workers inside the job, the caller not included */
    bool ending;
    unsigned worker_count;
    worker workers[]; /* [worker_count], numbers 1 .. worker_count */
};

/* ---- running pieces ---- */

static void job_fail(tli_pool *pool, job *j, size_t piece, unsigned number, tl_status status)
{
    atomic_store(&j->failed, true);
    pthread_mutex_lock(&pool->mutex);
    if (!j->status || piece < j->failed_piece) {
        j->failed_piece = piece;
        j->failed_worker = number;
        j->status = status;
    }
    pthread_mutex_unlock(&pool->mutex);
}

static tl_status piece_run(const job *j, size_t piece, unsigned number)
{
    if (tli_ctx_is_cancelled(j->ctx)) return tl_fail(j->ctx, TL_ERR_CANCELLED, "cancelled");
    size_t begin = piece * j->grain;
    size_t end = j->item_count - begin > j->grain ? begin + j->grain : j->item_count;
    return j->fn(j->arg, begin, end, number);
}

/* Pieces are taken in order and each one taken is run, so the lowest piece that can fail always
 * runs, whatever happens in the others. */
static void job_run(tli_pool *pool, job *j, unsigned number)
{
    while (!atomic_load_explicit(&j->failed, memory_order_relaxed)) {
        size_t piece = atomic_fetch_add_explicit(&j->next_piece, 1, memory_order_relaxed);
        if (piece >= j->piece_count) return;
        tl_status st = piece_run(j, piece, number);
        if (st) job_fail(pool, j, piece, number, st);
    }
}

static void *worker_main(void *arg)
{
    worker *w = arg;
    tli_pool *pool = w->pool;
    uint64_t seen = 0;
    pthread_mutex_lock(&pool->mutex);
    while (!pool->ending) {
        job *j = pool->job;
        if (!j || pool->generation == seen) {
            pthread_cond_wait(&pool->wake, &pool->mutex);
            continue;
        }
        seen = pool->generation;
        pool->active++;
        pthread_mutex_unlock(&pool->mutex);
        pool->ctx->messages[w->number].length = 0; /* what an earlier job left is not this one's */
        pool->ctx->messages[w->number].text[0] = 0;
        job_run(pool, j, w->number);
        pthread_mutex_lock(&pool->mutex);
        if (--pool->active == 0) pthread_cond_signal(&pool->idle);
    }
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

/* ---- creation ---- */

/* Signals stay with the caller's threads. */
static bool start_thread(pthread_t *thread, void *(*fn)(void *), void *arg)
{
    sigset_t all, before;
    sigfillset(&all);
    if (pthread_sigmask(SIG_SETMASK, &all, &before)) return false;
    bool started = pthread_create(thread, NULL, fn, arg) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return started;
}

static tl_status start_workers(tli_pool *pool, unsigned count)
{
    while (pool->worker_count < count) {
        worker *w = &pool->workers[pool->worker_count];
        *w = (worker){.pool = pool, .number = pool->worker_count + 1};
        if (!start_thread(&w->thread, worker_main, w)) return TL_ERR_THREAD;
        pool->worker_count++;
    }
    return TL_OK;
}

static size_t pool_bytes(unsigned thread_count)
{
    return sizeof(tli_pool) + (thread_count - 1) * sizeof(worker);
}

tl_status tli_pool_create(tl_ctx *ctx, unsigned thread_count, tli_pool **pool)
{
    tli_pool *p = ctx->opts.resize(ctx->opts.user, NULL, 0, pool_bytes(thread_count));
    if (!p) return TL_ERR_MEMORY;
    *p = (tli_pool){.ctx = ctx};
    bool mutex = pthread_mutex_init(&p->mutex, NULL) == 0;
    bool wake = pthread_cond_init(&p->wake, NULL) == 0;
    bool idle = pthread_cond_init(&p->idle, NULL) == 0;
    if (mutex && wake && idle && !start_workers(p, thread_count - 1)) {
        *pool = p;
        return TL_OK;
    }
    if (mutex && wake && idle) {
        tli_pool_destroy(ctx, p);
        return TL_ERR_THREAD;
    }
    if (idle) pthread_cond_destroy(&p->idle);
    if (wake) pthread_cond_destroy(&p->wake);
    if (mutex) pthread_mutex_destroy(&p->mutex);
    ctx->opts.resize(ctx->opts.user, p, pool_bytes(thread_count), 0);
    return TL_ERR_THREAD;
}

void tli_pool_destroy(tl_ctx *ctx, tli_pool *pool)
{
    if (!pool) return;
    pthread_mutex_lock(&pool->mutex);
    pool->ending = true;
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->mutex);
    for (unsigned i = 0; i < pool->worker_count; i++) pthread_join(pool->workers[i].thread, NULL);
    pthread_cond_destroy(&pool->idle);
    pthread_cond_destroy(&pool->wake);
    pthread_mutex_destroy(&pool->mutex);
    ctx->opts.resize(ctx->opts.user, pool, pool_bytes(ctx->thread_count), 0);
}

unsigned tli_pool_self(const tli_pool *pool)
{
    pthread_t self = pthread_self();
    for (unsigned i = 0; pool && i < pool->worker_count; i++)
        if (pthread_equal(pool->workers[i].thread, self)) return pool->workers[i].number;
    return 0;
}

/* ---- jobs ---- */

static tl_status run_alone(const job *j)
{
    for (size_t piece = 0; piece < j->piece_count; piece++) {
        tl_status st = piece_run(j, piece, 0);
        if (st) return st;
    }
    return TL_OK;
}

static tl_status run_shared(tli_pool *pool, job *j)
{
    pthread_mutex_lock(&pool->mutex);
    pool->job = j;
    pool->generation++;
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->mutex);
    job_run(pool, j, 0);
    pthread_mutex_lock(&pool->mutex);
    pool->job = NULL;
    while (pool->active) pthread_cond_wait(&pool->idle, &pool->mutex);
    pthread_mutex_unlock(&pool->mutex);
    tl_ctx *ctx = pool->ctx;
    if (j->status && j->failed_worker) ctx->messages[0] = ctx->messages[j->failed_worker];
    return j->status;
}

tl_status tli_parallel(tl_ctx *ctx, size_t item_count, size_t grain, tli_range_fn fn, void *arg)
{
    TL_ASSERT(grain > 0);
    TL_ASSERT(tli_pool_self(ctx->pool) == 0 && !ctx->in_parallel); /* not to be nested */
    job j = {.ctx = ctx, .fn = fn, .arg = arg, .item_count = item_count, .grain = grain};
    j.piece_count = item_count / grain + (item_count % grain != 0);
    ctx->in_parallel = true;
    tl_status st = ctx->pool && j.piece_count > 1 ? run_shared(ctx->pool, &j) : run_alone(&j);
    ctx->in_parallel = false;
    return st;
}

/* ---- threads of their own ---- */

static void *thread_main(void *arg)
{
    const tli_thread *thread = arg;
    thread->fn(thread->arg);
    return NULL;
}

tl_status tli_thread_start(tl_ctx *ctx, tli_thread_fn fn, void *arg, tli_thread *thread)
{
    *thread = (tli_thread){.fn = fn, .arg = arg};
    thread->runs = start_thread(&thread->thread, thread_main, thread);
    return thread->runs ? TL_OK : tl_fail(ctx, TL_ERR_THREAD, "the system gives no thread");
}

void tli_thread_join(tli_thread *thread)
{
    if (thread->runs) TL_ASSERT(pthread_join(thread->thread, NULL) == 0);
    thread->runs = false;
}
