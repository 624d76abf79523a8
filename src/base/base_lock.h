/* Stage base, internal: a lock for what several threads of a caller share. */
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

#endif
