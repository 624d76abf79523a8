/* tetralod, stage base: context, status and messages, memory under a hard budget, progress and log.
 *
 * Threads: a tl_ctx belongs to one thread at a time; the library itself starts threads only through
 * the pool of the context. Nothing here exits, prints, reads the environment or changes signals. */
#ifndef TETRALOD_BASE_H
#define TETRALOD_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of these headers: major * 10000 + minor * 100 + patch. */
#define TL_VERSION 100

#if defined(__GNUC__)
#define TL_API __attribute__((visibility("default")))
#define TL_PRINTF(format_arg, first_arg) __attribute__((format(printf, format_arg, first_arg)))
#else
#define TL_API
#define TL_PRINTF(format_arg, first_arg)
#endif

/* Version of the linked library, in the form of TL_VERSION. */
TL_API int tl_version(void);

/* Index inside one mesh in memory. A mesh holds fewer than TL_MESH_TETS_MAX tets. */
typedef uint32_t tl_lidx;
/* Index or count over a whole data set. */
typedef uint64_t tl_gidx;
/* "No vertex", "no tet", "no face". */
#define TL_NONE UINT32_MAX
/* Most threads of a pool. */
#define TL_THREADS_MAX 1024

/* Numbers are pinned and never reused. */
typedef enum tl_status {
    TL_OK = 0,
    /* wrong use by the caller */
    TL_ERR_ARG = 1,
    /* resources */
    TL_ERR_MEMORY = 10, /* the allocator returned nothing */
    TL_ERR_BUDGET = 11, /* the budget of the context would be passed */
    TL_ERR_THREAD = 12, /* a thread could not be started */
    /* environment and data */
    TL_ERR_IO = 20,          /* opening, reading, writing or renaming a file failed */
    TL_ERR_FORMAT = 21,      /* the bytes of a file are not what its format demands */
    TL_ERR_UNSUPPORTED = 22, /* the file is fine, this build can't take it */
    TL_ERR_DATA = 23,        /* the mesh can't be used for what was asked */
    /* ended from outside */
    TL_ERR_CANCELLED = 30
} tl_status;

/* Name of a status in lower case, "out of budget"; never NULL. */
TL_API const char *tl_status_name(tl_status status);

/* Memory, pool, hooks and the message of the last failure; every call that can fail takes one. */
typedef struct tl_ctx tl_ctx;

/* Importance of a log line. A clean run logs nothing above info. */
typedef enum tl_log_level {
    TL_LOG_ERROR = 0,
    TL_LOG_WARNING = 1,
    TL_LOG_INFO = 2,
    TL_LOG_DEBUG = 3
} tl_log_level;

/* The one allocator function, in the manner of realloc: block NULL allocates, new_bytes 0 frees
 * (and returns NULL). old_bytes is the size of the last request for this block. May be called from
 * several threads at once. Blocks are aligned for any type. */
typedef void *(*tl_resize_fn)(void *user, void *block, size_t old_bytes, size_t new_bytes);

/* Called on the thread that called the library, outside locks. stage is a short lower-case noun,
 * done and total are in units of the stage, done <= total. Returning false ends the call with
 * TL_ERR_CANCELLED. */
typedef bool (*tl_progress_fn)(void *user, const char *stage, uint64_t done, uint64_t total);

/* text is one line without newline, valid during the call. May be called from the pool's threads,
 * one at a time. */
typedef void (*tl_log_fn)(void *user, tl_log_level level, const char *text);

/* What a context is made of. */
typedef struct tl_ctx_opts {
    size_t struct_bytes;     /* size of this struct, set by tl_ctx_opts_defaults */
    size_t budget_bytes;     /* hard limit of memory in bytes; default 0: none */
    unsigned thread_count;   /* threads of the pool, the caller included, at most TL_THREADS_MAX;
                                default 0: one a processor. More take a stack each */
    tl_resize_fn resize;     /* default NULL: realloc and free */
    tl_progress_fn progress; /* default NULL */
    tl_log_fn log;           /* default NULL: messages are dropped */
    void *user;              /* handed to the three functions */
} tl_ctx_opts;

TL_API tl_ctx_opts tl_ctx_opts_defaults(void);

/* opts may be NULL (defaults); copied. Gives *ctx; on failure *ctx is NULL.
 * TL_ERR_ARG, TL_ERR_MEMORY, TL_ERR_THREAD. */
TL_API tl_status tl_ctx_create(const tl_ctx_opts *opts, tl_ctx **ctx);

/* Every block and object of the context must have been released before. NULL is allowed. */
TL_API void tl_ctx_destroy(tl_ctx *ctx);

/* Threads of the pool, the caller included; at least 1. */
TL_API unsigned tl_ctx_thread_count(const tl_ctx *ctx);

/* The message of the last failed call: one line a level, innermost first, separated by '\n', empty
 * when nothing failed. Valid until the next call with this context. */
TL_API const char *tl_ctx_message(const tl_ctx *ctx);

/* Forgets the message. */
TL_API void tl_ctx_clear(tl_ctx *ctx);

/* Bytes allocated now and at most, since creation or the last tl_ctx_reset_peak. */
TL_API size_t tl_ctx_current_bytes(const tl_ctx *ctx);
TL_API size_t tl_ctx_peak_bytes(const tl_ctx *ctx);
TL_API void tl_ctx_reset_peak(tl_ctx *ctx);

/* Any thread may call it: true makes the call that runs on ctx now, and those that come, end with
 * TL_ERR_CANCELLED at the next piece of work of the pool or report of progress, until false. What
 * was to be released is. */
TL_API void tl_ctx_cancel(tl_ctx *ctx, bool cancel);

/* Any thread may call it: the budget from now on, 0: none. What is above it stays. */
TL_API void tl_ctx_set_budget(tl_ctx *ctx, size_t budget_bytes);

/* Starts a new message with one line that says which file, item and expectation; returns status.
 * Used by the place that fails. May be called from the pool's threads. */
TL_API tl_status tl_fail(tl_ctx *ctx, tl_status status, const char *format, ...) TL_PRINTF(3, 4);

/* Adds one line to the message of a failure on its way up; returns status. */
TL_API tl_status tl_note(tl_ctx *ctx, tl_status status, const char *format, ...) TL_PRINTF(3, 4);

/* Sends one line to the log hook. */
TL_API void tl_log(tl_ctx *ctx, tl_log_level level, const char *format, ...) TL_PRINTF(3, 4);

/* Reports progress; TL_ERR_CANCELLED (with a message) when the hook asks to end, else TL_OK.
 * Not from the pool's threads. */
TL_API tl_status tl_progress(tl_ctx *ctx, const char *stage, uint64_t done, uint64_t total);

/* Memory of the context's budget. All three may be called from the pool's threads.
 *
 * They do nothing and return NULL (tl_mem_resize: block) when *status is a failure already, so that
 * several requests may stand in a row and *status be looked at once. On failure *status becomes
 * TL_ERR_MEMORY or TL_ERR_BUDGET and the message says how much was wanted. A count of 0 gives a
 * block that may be freed but not used. Blocks are aligned to 16 bytes. */

/* count elements, uninitialised. Gives the block. */
TL_API void *tl_mem_alloc(tl_ctx *ctx, size_t count, size_t elem_bytes, tl_status *status);
/* The same, zero-filled. */
TL_API void *tl_mem_zalloc(tl_ctx *ctx, size_t count, size_t elem_bytes, tl_status *status);
/* Resizes to count elements, keeping what fits; block may be NULL. On failure the old block stays
 * valid and is returned. */
TL_API void *tl_mem_resize(tl_ctx *ctx, void *block, size_t count, size_t elem_bytes,
                           tl_status *status);
/* NULL is allowed. */
TL_API void tl_mem_free(tl_ctx *ctx, void *block);

/* A short text by value, so that a call may stand in the arguments of printf. */
typedef struct tl_text {
    char s[64];
} tl_text;
TL_API tl_text tl_text_count(uint64_t count);  /* 1,250,235 */
TL_API tl_text tl_text_name(const char *name); /* without control characters, shortened */

#ifdef __cplusplus
}
#endif
#endif
