/* Locks and bells. */
#include "base/base_lock.h"

#include <errno.h>
#include <math.h>
#include <time.h>

tl_status tli_lock_create(tl_ctx *ctx, tli_lock *lock)
{
    if (pthread_mutex_init(&lock->mutex, NULL) == 0) return TL_OK;
    return tl_fail(ctx, TL_ERR_THREAD, "the system gives no lock");
}

void tli_lock_destroy(tli_lock *lock)
{
    pthread_mutex_destroy(&lock->mutex);
}

void tli_lock_take(tli_lock *lock)
{
    TL_ASSERT(pthread_mutex_lock(&lock->mutex) == 0);
}

void tli_lock_give(tli_lock *lock)
{
    TL_ASSERT(pthread_mutex_unlock(&lock->mutex) == 0);
}

tl_status tli_bell_create(tl_ctx *ctx, tli_bell *bell)
{
    pthread_condattr_t steady; /* seconds do not jump when the clock on the wall is set */
    bool made = pthread_condattr_init(&steady) == 0;
    if (made) {
        made = pthread_condattr_setclock(&steady, CLOCK_MONOTONIC) == 0 &&
               pthread_cond_init(&bell->condition, &steady) == 0;
        pthread_condattr_destroy(&steady);
    }
    if (made) return TL_OK;
    return tl_fail(ctx, TL_ERR_THREAD, "the system gives no condition to wait for");
}

void tli_bell_destroy(tli_bell *bell)
{
    pthread_cond_destroy(&bell->condition);
}

void tli_bell_wait(tli_bell *bell, tli_lock *lock)
{
    TL_ASSERT(pthread_cond_wait(&bell->condition, &lock->mutex) == 0);
}

bool tli_bell_wait_for(tli_bell *bell, tli_lock *lock, double seconds)
{
    static const double LONGEST_S = 1e6; /* a time_t has room for it, whatever the day */
    struct timespec end;
    double whole, part = modf(fmin(fmax(seconds, 0), LONGEST_S), &whole);
    clock_gettime(CLOCK_MONOTONIC, &end);
    end.tv_sec += (time_t)whole;
    end.tv_nsec += (long)(part * 1e9);
    if (end.tv_nsec >= 1000000000) {
        end.tv_nsec -= 1000000000;
        end.tv_sec++;
    }
    int error = pthread_cond_timedwait(&bell->condition, &lock->mutex, &end);
    TL_ASSERT(error == 0 || error == ETIMEDOUT);
    return error == 0;
}

void tli_bell_ring(tli_bell *bell)
{
    TL_ASSERT(pthread_cond_broadcast(&bell->condition) == 0);
}
