/* Stage base, internal: what all stages share below their public headers. Memory, arena, checked
 * integers, thread pool, clock. Files, sorting and predicates have headers of their own. */
#ifndef TETRALOD_SRC_BASE_H
#define TETRALOD_SRC_BASE_H

#include <stdarg.h>

#include "tetralod/base.h"

/* A broken promise of our own; never reached by bytes from a file. Stays on in release builds. */
#define TL_ASSERT(condition)                                                                       \
    ((condition) ? (void)0 : tli_assert_failed(#condition, __FILE__, __LINE__))
_Noreturn void tli_assert_failed(const char *condition, const char *file, int line);

/* *out = a * b or a + b; false on overflow (out is then untouched). */
bool tli_mul_size(size_t a, size_t b, size_t *out);
bool tli_add_size(size_t a, size_t b, size_t *out);
/* Narrows with a check: false when value does not fit. */
bool tli_to_lidx(uint64_t value, tl_lidx *out);

/* Copies a string into the context's memory. Gives it. NULL stays NULL. */
char *tli_strdup(tl_ctx *ctx, const char *text, tl_status *status);

/* Copies the options that a caller gave over *opts [opts_bytes], which holds the defaults; of a
 * shorter struct, of an older program, as much as there is. given NULL: the defaults stay. type:
 * for the message. TL_ERR_ARG for a size that can't be. */
tl_status tli_opts_take(tl_ctx *ctx, const char *type, const void *given, void *opts,
                        size_t opts_bytes);

/* snprintf and vsnprintf with a point in their numbers, whatever the locale. base_text.c */
int tli_print(char *text, size_t bytes, const char *format, ...) TL_PRINTF(3, 4);
int tli_vprint(char *text, size_t bytes, const char *format, va_list args) TL_PRINTF(3, 0);

/* Bytes, 2 to 4, of the character of UTF-8 that begins at at, below end; 0 if none of more than one
 * byte does. */
size_t tli_utf8_bytes(const char *at, const char *end);

/* ---- arena: many small blocks that die together (opened and closed by a driver) ---- */
typedef struct tli_arena_chunk tli_arena_chunk;
typedef struct tli_arena {
    tl_ctx *ctx;
    tli_arena_chunk *chunks;
} tli_arena;
void tli_arena_open(tl_ctx *ctx, tli_arena *arena);
void tli_arena_close(tli_arena *arena);
/* As tl_mem_alloc; freed by tli_arena_close. One thread at a time. */
void *tli_arena_alloc(tli_arena *arena, size_t count, size_t elem_bytes, tl_status *status);

/* ---- threads ---- */
/* Works on items [begin, end); worker is 0 .. tl_ctx_thread_count - 1 and unique among those that
 * run at the same time. */
typedef tl_status (*tli_range_fn)(void *arg, size_t begin, size_t end, unsigned worker);
/* Calls fn for [0, item_count) in pieces of at most grain items (grain >= 1), from all threads of
 * the pool, the caller being worker 0. Pieces start at multiples of grain, whatever the number of
 * threads, so per-piece results are repeatable. After a failure no new piece is begun; the status
 * of the failed piece with the lowest index is returned. Not to be nested. */
tl_status tli_parallel(tl_ctx *ctx, size_t item_count, size_t grain, tli_range_fn fn, void *arg);

/* A context of one thread for a worker of the pool, so that what runs there may call whatever takes
 * a context: it shares memory, budget, peak and log of ctx, has messages of its own and no
 * progress. Made and ended on the thread that uses it, or outside of tli_parallel. Gives *fork. */
tl_status tli_ctx_fork(tl_ctx *ctx, tl_ctx **fork);
/* A context of one thread with the allocator of ctx and a budget of its own, no progress, no log:
 * for what is to be found out once the budget of ctx is spent. Gives *spare: tl_ctx_destroy. */
tl_status tli_ctx_spare(const tl_ctx *ctx, size_t budget_bytes, tl_ctx **spare);
/* While quiet, messages of level info are kept back: those of what was said before. Returns what it
 * was. Context's own thread. */
bool tli_ctx_quiet(tl_ctx *ctx, bool quiet);
/* Bytes that are left of the budget; SIZE_MAX: there is none. Any thread. */
size_t tli_ctx_room(const tl_ctx *ctx);
/* What tl_ctx_cancel said last. */
bool tli_ctx_is_cancelled(const tl_ctx *ctx);
/* Ends a fork (NULL is allowed). If status is a failure the message of the fork becomes that of the
 * calling thread in ctx. Returns status. */
tl_status tli_ctx_join(tl_ctx *ctx, tl_ctx *fork, tl_status status);

/* The context a fork was made of, in the end; of any other itself. What a fork allocated may be
 * freed with it, so that it can outlive the fork. */
tl_ctx *tli_ctx_owner(tl_ctx *ctx);

/* Monotonic time in seconds. */
double tli_clock_s(void);

#endif
