/* The context: creation, status names, message chain, log, progress.
 *
 * Each worker of the pool writes its own message, found by the identity of the calling thread, so
 * that failures of several workers never mix; tli_parallel hands on the one that counts. */
#include "base/base_context.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Longest line that reaches the log hook, terminator included. */
#define LOG_LINE_BYTES 1024

int tl_version(void)
{
    return TL_VERSION;
}

const char *tl_status_name(tl_status status)
{
    switch (status) {
    case TL_OK: return "ok";
    case TL_ERR_ARG: return "bad argument";
    case TL_ERR_MEMORY: return "out of memory";
    case TL_ERR_BUDGET: return "out of budget";
    case TL_ERR_THREAD: return "no thread";
    case TL_ERR_IO: return "file access failed";
    case TL_ERR_FORMAT: return "bad format";
    case TL_ERR_UNSUPPORTED: return "unsupported";
    case TL_ERR_DATA: return "unusable data";
    case TL_ERR_CANCELLED: return "cancelled";
    }
    return "unknown status";
}

void tli_assert_failed(const char *condition, const char *file, int line)
{
    fprintf(stderr, "tetralod: broken promise at %s:%d: %s\n", file, line, condition);
    abort();
}

/* ---- creation ---- */

tl_ctx_opts tl_ctx_opts_defaults(void)
{
    return (tl_ctx_opts){.struct_bytes = sizeof(tl_ctx_opts)};
}

static unsigned processor_count(void)
{
    long count = sysconf(_SC_NPROCESSORS_ONLN);
    if (count < 1) return 1;
    return count < TL_THREADS_MAX ? (unsigned)count : TL_THREADS_MAX;
}

tl_status tl_ctx_create(const tl_ctx_opts *opts, tl_ctx **ctx)
{
    tl_ctx_opts o = tl_ctx_opts_defaults();
    if (!ctx) return TL_ERR_ARG;
    *ctx = NULL;
    if (opts) {
        if (opts->struct_bytes < sizeof o) return TL_ERR_ARG;
        o = *opts;
    }
    if (o.thread_count > TL_THREADS_MAX) return TL_ERR_ARG;
    if (!o.thread_count) o.thread_count = processor_count();
    if (!o.resize) o.resize = tli_resize_default;

    size_t bytes = sizeof(tl_ctx) + o.thread_count * sizeof(tli_message);
    tl_ctx *c = o.resize(o.user, NULL, 0, bytes);
    if (!c) return TL_ERR_MEMORY;
    *c = (tl_ctx){.opts = o, .root = c, .own_bytes = bytes, .thread_count = o.thread_count};
    atomic_store(&c->budget_bytes, o.budget_bytes);
    for (unsigned i = 0; i < c->thread_count; i++) {
        c->messages[i].length = 0;
        c->messages[i].text[0] = 0;
    }
    tl_status st = TL_OK;
    bool locked = pthread_mutex_init(&c->log_mutex, NULL) == 0;
    bool spill_locked = pthread_mutex_init(&c->spill_mutex, NULL) == 0;
    if (!locked || !spill_locked) st = TL_ERR_THREAD;
    if (!st && c->thread_count > 1) st = tli_pool_create(c, c->thread_count, &c->pool);
    if (st) {
        if (locked) pthread_mutex_destroy(&c->log_mutex);
        if (spill_locked) pthread_mutex_destroy(&c->spill_mutex);
        o.resize(o.user, c, bytes, 0);
        return st;
    }
    *ctx = c;
    return TL_OK;
}

void tl_ctx_destroy(tl_ctx *ctx)
{
    if (!ctx) return;
    tli_pool_destroy(ctx, ctx->pool);
    size_t left = atomic_load(&ctx->current_bytes);
    if (left) tl_log(ctx, TL_LOG_WARNING, "%zu bytes were not released before the context", left);
    pthread_mutex_destroy(&ctx->spill_mutex);
    pthread_mutex_destroy(&ctx->log_mutex);
    ctx->opts.resize(ctx->opts.user, ctx, ctx->own_bytes, 0);
}

unsigned tl_ctx_thread_count(const tl_ctx *ctx)
{
    return ctx->thread_count;
}

/* ---- messages ---- */

const char *tl_ctx_message(const tl_ctx *ctx)
{
    return ctx->messages[0].text;
}

static void message_clear(tli_message *message)
{
    message->length = 0;
    message->text[0] = 0;
}

void tl_ctx_clear(tl_ctx *ctx)
{
    message_clear(&ctx->messages[0]);
}

/* Names from files may hold anything; a line stays one line and a terminal stays as it was. */
static void make_printable(char *text)
{
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (c < 0x20 || c == 0x7f) *text = '?';
    }
}

/* Appends text; what does not fit is cut and ends in "...". */
TL_PRINTF(2, 0)
static void message_append(tli_message *message, const char *format, va_list args)
{
    size_t room = sizeof message->text - message->length;
    char *start = message->text + message->length;
    int wanted = tli_vprint(start, room, format, args);
    if (wanted < 0) {
        *start = 0;
        return;
    }
    make_printable(start);
    size_t written = (size_t)wanted < room ? (size_t)wanted : room - 1;
    message->length += written;
    if ((size_t)wanted >= room && room > 4) memcpy(message->text + message->length - 3, "...", 4);
}

TL_PRINTF(2, 3)
static void message_add(tli_message *message, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    message_append(message, format, args);
    va_end(args);
}

static tli_message *own_message(tl_ctx *ctx)
{
    return &ctx->messages[tli_pool_self(ctx->pool)];
}

tl_status tli_ctx_fork(tl_ctx *ctx, tl_ctx **fork)
{
    tl_status st = TL_OK;
    size_t bytes = sizeof(tl_ctx) + sizeof(tli_message);
    tl_ctx *c = tl_mem_zalloc(ctx, bytes, 1, &st);
    *fork = c;
    if (st) return st;
    c->opts = ctx->opts;
    c->opts.progress = NULL;
    c->root = ctx->root;
    c->own_bytes = bytes;
    c->thread_count = 1;
    return TL_OK;
}

tl_status tli_ctx_spare(const tl_ctx *ctx, size_t budget_bytes, tl_ctx **spare)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.budget_bytes = budget_bytes;
    opts.thread_count = 1;
    opts.resize = ctx->opts.resize;
    opts.user = ctx->opts.user;
    return tl_ctx_create(&opts, spare);
}

tl_ctx *tli_ctx_owner(tl_ctx *ctx)
{
    return ctx->root;
}

tl_status tli_ctx_join(tl_ctx *ctx, tl_ctx *fork, tl_status status)
{
    if (fork && status) *own_message(ctx) = fork->messages[0];
    tl_mem_free(ctx, fork);
    return status;
}

tl_status tl_fail(tl_ctx *ctx, tl_status status, const char *format, ...)
{
    tli_message *message = own_message(ctx);
    message_clear(message);
    va_list args;
    va_start(args, format);
    message_append(message, format, args);
    va_end(args);
    return status;
}

tl_status tli_fail_system(tl_ctx *ctx, tl_status status, int error, const char *format, ...)
{
    char reason[256];
    if (strerror_r(error, reason, sizeof reason))
        snprintf(reason, sizeof reason, "error %d", error);
    tli_message *message = own_message(ctx);
    message_clear(message);
    va_list args;
    va_start(args, format);
    message_append(message, format, args);
    va_end(args);
    message_add(message, ": %s", reason);
    return status;
}

tl_status tl_note(tl_ctx *ctx, tl_status status, const char *format, ...)
{
    tli_message *message = own_message(ctx);
    if (message->length && message->length + 1 < sizeof message->text) {
        message->text[message->length++] = '\n';
        message->text[message->length] = 0;
    }
    va_list args;
    va_start(args, format);
    message_append(message, format, args);
    va_end(args);
    return status;
}

void tl_log(tl_ctx *ctx, tl_log_level level, const char *format, ...)
{
    if (!ctx->opts.log || (ctx->root->is_quiet && level == TL_LOG_INFO)) return;
    char line[LOG_LINE_BYTES];
    va_list args;
    va_start(args, format);
    int wanted = tli_vprint(line, sizeof line, format, args);
    va_end(args);
    if (wanted < 0) return;
    make_printable(line);
    pthread_mutex_lock(&ctx->root->log_mutex);
    ctx->opts.log(ctx->opts.user, level, line);
    pthread_mutex_unlock(&ctx->root->log_mutex);
}

bool tli_ctx_quiet(tl_ctx *ctx, bool quiet)
{
    bool before = ctx->is_quiet;
    ctx->is_quiet = quiet;
    return before;
}

void tl_ctx_cancel(tl_ctx *ctx, bool cancel)
{
    atomic_store(&ctx->root->is_cancelled, cancel);
}

bool tli_ctx_is_cancelled(const tl_ctx *ctx)
{
    return atomic_load_explicit(&ctx->root->is_cancelled, memory_order_relaxed);
}

tl_status tl_progress(tl_ctx *ctx, const char *stage, uint64_t done, uint64_t total)
{
    tli_spill_relax(ctx, 0);
    if (tli_ctx_is_cancelled(ctx))
        return tl_fail(ctx, TL_ERR_CANCELLED, "cancelled during %s", stage);
    if (!ctx->opts.progress || ctx->opts.progress(ctx->opts.user, stage, done, total)) return TL_OK;
    return tl_fail(ctx, TL_ERR_CANCELLED, "cancelled during %s, at %llu of %llu", stage,
                   (unsigned long long)done, (unsigned long long)total);
}
