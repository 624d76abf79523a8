/* Locks. */
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
