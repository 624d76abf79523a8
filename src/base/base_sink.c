/* Output files that appear under their name only when they are complete. A regular file is written
 * without a name (O_TMPFILE) where the file system can do so, so that even a killed process leaves
 * nothing behind; else under a temporary name in the same folder. A committed close syncs, takes
 * over the permissions of the file that is replaced, and renames. What is no regular file is
 * written in place. */
#define _GNU_SOURCE 1 /* O_TMPFILE */

#include "base/base_context.h"
#include "base/base_file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define BUFFER_BYTES ((size_t)256 << 10)
#define WRITE_BYTES_MAX ((size_t)1 << 30) /* one call; the system takes no more than 2 GiB */
#define TEMP_TRIES 100
#define PROC_FD_BYTES 40

_Static_assert(sizeof(off_t) == 8, "offsets over 4 GiB; _FILE_OFFSET_BITS=64 is missing");

struct tli_sink {
    tl_ctx *ctx;
    char *path;      /* as the caller gave it, for messages */
    char *target;    /* the final name, links resolved; NULL: written in place */
    char *temp;      /* room for a temporary name, NULL: written in place */
    bool temp_named; /* the file stands under temp */
    int fd;
    mode_t mode; /* of the file that is replaced; 0: there was none */
    uint64_t flushed;
    size_t used;
    uint8_t *buffer;  /* [BUFFER_BYTES] */
    tl_status status; /* of the first failed write */
    int error;        /* and its errno */
};

/* ---- failures ---- */

static tl_status fail_write(tli_sink *sink)
{
    return tli_fail_system(sink->ctx, sink->status, sink->error,
                           "'%s': can't be written at byte %llu", sink->path,
                           (unsigned long long)sink->flushed);
}

static tl_status fail_path(const tli_sink *sink, const char *what)
{
    return tli_fail_system(sink->ctx, TL_ERR_IO, errno, "'%s': %s", sink->path, what);
}

/* ---- opening ---- */

/* Bytes of the folder part of target, its last '/' included; 0: the current folder. */
static size_t folder_bytes(const char *target)
{
    const char *slash = strrchr(target, '/');
    return slash ? (size_t)(slash - target) + 1 : 0;
}

/* Next temporary name: hidden, next to the target. Clock, process and address make it differ; the
 * file is created only if the name is free. */
static void temp_name(tli_sink *sink, unsigned attempt)
{
    size_t folder = folder_bytes(sink->target);
    uint64_t salt = (uint64_t)(tli_clock_s() * 1e9) ^ (uint64_t)getpid() << 40 ^ (uintptr_t)sink;
    salt = (salt + attempt) * 0x9e3779b97f4a7c15u;
    memcpy(sink->temp, sink->target, folder);
    snprintf(sink->temp + folder, PROC_FD_BYTES, ".tetralod-%016llx", (unsigned long long)salt);
}

/* A file without a name in the target's folder that can be given one later; -1 when not to be had.
 */
static int open_nameless(tli_sink *sink)
{
    size_t folder = folder_bytes(sink->target);
    memcpy(sink->temp, sink->target, folder);
    memcpy(sink->temp + folder, ".", 2);
    int fd = open(sink->temp, O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
    if (fd < 0) return -1;
    char proc[PROC_FD_BYTES];
    snprintf(proc, sizeof proc, "/proc/self/fd/%d", fd);
    if (access(proc, F_OK) == 0) return fd;
    close(fd);
    return -1;
}

static int open_named(tli_sink *sink)
{
    int fd = -1;
    for (unsigned attempt = 0; fd < 0 && attempt < TEMP_TRIES; attempt++) {
        temp_name(sink, attempt);
        fd = open(sink->temp, O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    sink->temp_named = fd >= 0;
    return fd;
}

/* Finds out what stands under the path and sets target, mode and temp. */
static tl_status examine(tli_sink *sink, bool *in_place)
{
    tl_ctx *ctx = sink->ctx;
    struct stat info;
    tl_status st = TL_OK;
    bool exists = stat(sink->path, &info) == 0;
    if (!exists && errno != ENOENT) return fail_path(sink, "can't be created");
    if (exists && S_ISDIR(info.st_mode))
        return tl_fail(ctx, TL_ERR_IO, "'%s' is a folder, not a file", sink->path);
    *in_place = exists && !S_ISREG(info.st_mode);
    if (*in_place) return TL_OK;
    if (exists) {
        if (faccessat(AT_FDCWD, sink->path, W_OK, AT_EACCESS))
            return fail_path(sink, "must not be replaced");
        sink->mode = info.st_mode & 0777;
        sink->target = tl_mem_alloc(ctx, PATH_MAX, 1, &st);
        if (!st && !realpath(sink->path, sink->target)) return fail_path(sink, "can't be resolved");
    } else {
        if (lstat(sink->path, &info) == 0)
            return tl_fail(ctx, TL_ERR_IO, "'%s' is a link to a file that does not exist",
                           sink->path);
        sink->target = tli_strdup(ctx, sink->path, &st);
    }
    if (!st) sink->temp = tl_mem_alloc(ctx, folder_bytes(sink->target) + PROC_FD_BYTES, 1, &st);
    return st;
}

static tl_status sink_begin(tli_sink *sink, const char *path)
{
    tl_status st = TL_OK;
    bool in_place = false;
    sink->path = tli_strdup(sink->ctx, path, &st);
    sink->buffer = tl_mem_alloc(sink->ctx, BUFFER_BYTES, 1, &st);
    if (!st) st = examine(sink, &in_place);
    if (st) return st;
    if (!tli_file_fault(sink->ctx)) {
        if (in_place)
            sink->fd = open(path, O_WRONLY | O_CLOEXEC | O_NOCTTY);
        else
            sink->fd = open_nameless(sink);
        if (sink->fd < 0 && !in_place) sink->fd = open_named(sink);
    }
    return sink->fd < 0 ? fail_path(sink, "can't be created") : TL_OK;
}

/* Closes and removes what is left; the path of every end. */
static void sink_release(tli_sink *sink)
{
    tl_ctx *ctx = sink->ctx;
    if (sink->fd >= 0) close(sink->fd);
    if (sink->temp_named) unlink(sink->temp);
    tl_mem_free(ctx, sink->temp);
    tl_mem_free(ctx, sink->target);
    tl_mem_free(ctx, sink->buffer);
    tl_mem_free(ctx, sink->path);
    tl_mem_free(ctx, sink);
}

tl_status tli_sink_open(tl_ctx *ctx, const char *path, tli_sink **sink)
{
    tl_status st = TL_OK;
    *sink = NULL;
    tli_sink *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    s->ctx = ctx;
    s->fd = -1;
    st = sink_begin(s, path);
    if (st)
        sink_release(s);
    else
        *sink = s;
    return st;
}

/* ---- writing ---- */

/* Writes all bytes; at ofs, or at the end of what was written when ofs is -1. */
static tl_status write_all(tli_sink *sink, const uint8_t *bytes, size_t byte_count, off_t ofs)
{
    while (byte_count) {
        size_t piece = byte_count < WRITE_BYTES_MAX ? byte_count : WRITE_BYTES_MAX;
        ssize_t done = -1;
        if (!tli_file_fault(sink->ctx))
            done = ofs < 0 ? write(sink->fd, bytes, piece) : pwrite(sink->fd, bytes, piece, ofs);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) {
            sink->error = errno;
            sink->status = TL_ERR_IO;
            return fail_write(sink);
        }
        if (ofs < 0)
            sink->flushed += (uint64_t)done;
        else
            ofs += done;
        bytes += done;
        byte_count -= (size_t)done;
    }
    return TL_OK;
}

static tl_status sink_flush(tli_sink *sink)
{
    size_t used = sink->used;
    sink->used = 0;
    return write_all(sink, sink->buffer, used, -1);
}

tl_status tli_sink_write(tli_sink *sink, const void *bytes, size_t byte_count)
{
    if (sink->status) return fail_write(sink);
    if (!byte_count) return TL_OK;
    if (byte_count > BUFFER_BYTES - sink->used) {
        tl_status st = sink_flush(sink);
        if (st) return st;
        if (byte_count >= BUFFER_BYTES) return write_all(sink, bytes, byte_count, -1);
    }
    memcpy(sink->buffer + sink->used, bytes, byte_count);
    sink->used += byte_count;
    return TL_OK;
}

tl_status tli_sink_printf(tli_sink *sink, const char *format, ...)
{
    if (sink->status) return fail_write(sink);
    va_list args;
    size_t room = BUFFER_BYTES - sink->used;
    va_start(args, format);
    int wanted = tli_vprint((char *)sink->buffer + sink->used, room, format, args);
    va_end(args);
    if (wanted < 0)
        return tl_fail(sink->ctx, TL_ERR_ARG, "'%s': a text can't be formatted", sink->path);
    if ((size_t)wanted < room) {
        sink->used += (size_t)wanted;
        return TL_OK;
    }
    tl_status st = TL_OK;
    char *text = tl_mem_alloc(sink->ctx, (size_t)wanted + 1, 1, &st);
    if (st) return st;
    va_start(args, format);
    tli_vprint(text, (size_t)wanted + 1, format, args);
    va_end(args);
    st = tli_sink_write(sink, text, (size_t)wanted);
    tl_mem_free(sink->ctx, text);
    return st;
}

uint64_t tli_sink_tell(const tli_sink *sink)
{
    return sink->flushed + sink->used;
}

tl_status tli_sink_patch(tli_sink *sink, uint64_t ofs, const void *bytes, size_t byte_count)
{
    if (sink->status) return fail_write(sink);
    uint64_t end = tli_sink_tell(sink);
    if (ofs > end || byte_count > end - ofs)
        return tl_fail(sink->ctx, TL_ERR_ARG, "'%s': bytes %llu to %llu were not written yet",
                       sink->path, (unsigned long long)ofs, (unsigned long long)(ofs + byte_count));
    const uint8_t *from = bytes;
    if (ofs < sink->flushed) {
        size_t on_disk = byte_count;
        if (sink->flushed - ofs < on_disk) on_disk = (size_t)(sink->flushed - ofs);
        tl_status st = write_all(sink, from, on_disk, (off_t)ofs);
        if (st) return st;
        from += on_disk;
        ofs += on_disk;
        byte_count -= on_disk;
    }
    if (byte_count) memcpy(sink->buffer + (ofs - sink->flushed), from, byte_count);
    return TL_OK;
}

/* ---- closing ---- */

/* Pipes and some devices and file systems have nothing to sync and say so. */
static tl_status sink_sync(tli_sink *sink)
{
    int failed = tli_file_fault(sink->ctx) ? -1 : fsync(sink->fd);
    if (!failed) return TL_OK;
    if (!sink->target && (errno == EINVAL || errno == EROFS || errno == ENOTSUP)) return TL_OK;
    return fail_path(sink, "can't be brought to the disk");
}

/* Gives a nameless file its temporary name. */
static tl_status sink_name(tli_sink *sink)
{
    char proc[PROC_FD_BYTES];
    int failed = -1;
    snprintf(proc, sizeof proc, "/proc/self/fd/%d", sink->fd);
    for (unsigned attempt = 0; failed && attempt < TEMP_TRIES; attempt++) {
        temp_name(sink, attempt);
        failed = linkat(AT_FDCWD, proc, AT_FDCWD, sink->temp, AT_SYMLINK_FOLLOW);
        if (failed && errno != EEXIST) break;
    }
    sink->temp_named = !failed;
    return failed ? fail_path(sink, "can't be named") : TL_OK;
}

/* Brings the new name to the disk; an old folder entry after a crash is no damage, so no error. */
static void sync_folder(tli_sink *sink)
{
    size_t folder = folder_bytes(sink->target);
    sink->target[folder] = 0;
    int fd = open(folder ? sink->target : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    (void)fsync(fd);
    close(fd);
}

static tl_status sink_commit(tli_sink *sink)
{
    if (sink->status) return fail_write(sink);
    tl_status st = sink_flush(sink);
    if (!st) st = sink_sync(sink);
    if (!st && sink->mode && fchmod(sink->fd, sink->mode))
        st = fail_path(sink, "the permissions can't be kept");
    if (!st && sink->target && !sink->temp_named) st = sink_name(sink);
    if (!st) {
        int failed = close(sink->fd);
        sink->fd = -1;
        if (failed) st = fail_path(sink, "can't be closed");
    }
    if (st || !sink->target) return st;
    if (tli_file_fault(sink->ctx) || rename(sink->temp, sink->target))
        return fail_path(sink, "the finished file can't be put in its place");
    sink->temp_named = false;
    sync_folder(sink);
    return TL_OK;
}

tl_status tli_sink_close(tli_sink *sink, bool commit)
{
    if (!sink) return TL_OK;
    tl_status st = commit ? sink_commit(sink) : TL_OK;
    sink_release(sink);
    return st;
}
