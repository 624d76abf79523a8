/* Locks and bells. */
#include "base/base_lock.h"

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
    if (pthread_cond_init(&bell->condition, NULL) == 0) return TL_OK;
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

void tli_bell_ring(tli_bell *bell)
{
    TL_ASSERT(pthread_cond_broadcast(&bell->condition) == 0);
}
