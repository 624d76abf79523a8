/* Stage base, only for files of this stage: what a context holds, locks, and the pool's inside. */
#ifndef TETRALOD_SRC_BASE_CONTEXT_H
#define TETRALOD_SRC_BASE_CONTEXT_H

#include <pthread.h>
#include <stdatomic.h>

#include "base/base.h"

/* Longest message chain in bytes, terminator included; what does not fit is cut. */
#define TLI_MESSAGE_BYTES 4096

/* Fixed in size, so that "out of memory" can always be said. */
typedef struct tli_message {
    size_t length;
    char text[TLI_MESSAGE_BYTES];
} tli_message;

typedef struct tli_pool tli_pool;
typedef struct tli_spilled tli_spilled;

struct tl_ctx {
    tl_ctx_opts opts; /* resize is never NULL */
    tl_ctx *root;     /* whose memory is counted and whose log is written: itself but for a fork */
    size_t own_bytes; /* of this block; not counted in current_bytes */
    atomic_size_t current_bytes, peak_bytes;
    atomic_size_t budget_bytes; /* of the root alone; 0: none */
    pthread_mutex_t log_mutex;
    tli_pool *pool;   /* NULL with one thread */
    bool is_quiet;    /* messages of level info are kept back */
    bool in_parallel; /* a tli_parallel is running; changed by the owner's thread alone */
    _Atomic uint64_t file_fail_in; /* file operations until one fails on purpose; 0: never */
    /* base_spill.c, of the root alone */
    const char *spill_folder; /* NULL: nothing is spilled now */
    pthread_mutex_t spill_mutex;
    tli_spilled *spilled; /* all spilled blocks */
    uint64_t spill_asked; /* bytes since pages were given back */
    double spill_relaxed; /* when that was */
    _Atomic uint64_t spilled_bytes;
    unsigned thread_count;
    atomic_bool is_cancelled; /* of the root alone */
    tli_message messages[];   /* [thread_count], one a worker; [0] is the caller's */
};

/* A block in a working file; NULL with a message in ctx. */
void *tli_spill_map(tl_ctx *ctx, size_t byte_count);
void tli_spill_unmap(tl_ctx *ctx, void *block);
/* Bytes that the block may grow to where it is. */
size_t tli_spill_room(const void *block);
/* Gives resident pages of spilled blocks back, after so many more bytes or some time. */
void tli_spill_relax(tl_ctx *ctx, size_t more);

/* The allocator used when the caller gives none. */
void *tli_resize_default(void *user, void *block, size_t old_bytes, size_t new_bytes);

/* Starts thread_count - 1 threads. */
tl_status tli_pool_create(tl_ctx *ctx, unsigned thread_count, tli_pool **pool);
void tli_pool_destroy(tl_ctx *ctx, tli_pool *pool);
/* Worker number of the calling thread; 0 for threads that are not of the pool (NULL is allowed). */
unsigned tli_pool_self(const tli_pool *pool);

/* tl_fail with ": " and the system's text for error (an errno value) behind it. */
tl_status tli_fail_system(tl_ctx *ctx, tl_status status, int error, const char *format, ...)
    TL_PRINTF(4, 5);

/* True when the file operation that is about to begin has to fail (fault injection). */
bool tli_file_fault(tl_ctx *ctx);

#endif
