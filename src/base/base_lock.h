/* Stage base, internal: a lock for what several threads of a caller share, a bell for those that
 * wait for a change of it, and threads that are of no pool. */
#ifndef TETRALOD_SRC_BASE_LOCK_H
#define TETRALOD_SRC_BASE_LOCK_H

#include <pthread.h>

#include "base/base.h"

typedef struct tli_lock {
    pthread_mutex_t mutex;
} tli_lock;

/* TL_ERR_THREAD. */
tl_status tli_lock_create(tl_ctx *ctx, tli_lock *lock);
void tli_lock_destroy(tli_lock *lock);
void tli_lock_take(tli_lock *lock);
void tli_lock_give(tli_lock *lock);

typedef struct tli_bell {
    pthread_cond_t condition;
} tli_bell;

/* TL_ERR_THREAD. */
tl_status tli_bell_create(tl_ctx *ctx, tli_bell *bell);
void tli_bell_destroy(tli_bell *bell);
/* Gives the lock, which is taken, waits and takes it again; may come back without a ring. */
void tli_bell_wait(tli_bell *bell, tli_lock *lock);
/* The same, for so many seconds at most; false: they have passed. */
bool tli_bell_wait_for(tli_bell *bell, tli_lock *lock, double seconds);
/* Wakes all that wait. */
void tli_bell_ring(tli_bell *bell);

typedef void (*tli_thread_fn)(void *arg);
typedef struct tli_thread {
    tli_thread_fn fn;
    void *arg;
    pthread_t thread;
    bool runs;
} tli_thread;

/* Runs fn(arg) on a thread that signals do not reach; *thread stays where it is until it has been
 * joined. TL_ERR_THREAD. */
tl_status tli_thread_start(tl_ctx *ctx, tli_thread_fn fn, void *arg, tli_thread *thread);
/* Waits for its end. One that was not started, or all zero, is allowed. */
void tli_thread_join(tli_thread *thread);

#endif
