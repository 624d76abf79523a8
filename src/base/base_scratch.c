/* Working files: of all stages that handle more than fits into memory. */
#define _GNU_SOURCE 1 /* O_TMPFILE */

#include "base/base_scratch.h"
#include "base/base_context.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#define IO_BYTES_MAX ((size_t)1 << 30) /* one call; the system takes no more than 2 GiB */
#define TEMP_TRIES 100
#define NAME_BYTES 48

struct tli_scratch {
    tl_ctx *ctx;
    char *folder; /* for messages, its last '/' not included; of a file that exists its path */
    char *name;   /* room for a name in the folder */
    bool named;   /* the file stands under it, to be removed */
    bool reading; /* a file that exists */
    int fd;
    _Atomic uint64_t bytes;
};

static tl_status fail(tl_ctx *ctx, const tli_scratch *scratch, const char *what)
{
    return tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': %s%s", scratch->folder,
                           scratch->reading ? "" : "a working file ", what);
}

/* A free name, hidden: clock, process and address make it differ. */
static void next_name(tli_scratch *s, unsigned attempt)
{
    uint64_t salt = (uint64_t)(tli_clock_s() * 1e9) ^ (uint64_t)getpid() << 40 ^ (uintptr_t)s;
    salt = (salt + attempt) * 0x9e3779b97f4a7c15u;
    size_t folder = strlen(s->folder);
    memcpy(s->name, s->folder, folder);
    snprintf(s->name + folder, NAME_BYTES, "/.tetralod-%016llx", (unsigned long long)salt);
}

static void create(tli_scratch *s)
{
    s->fd = open(s->folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
    char proc[NAME_BYTES];
    snprintf(proc, sizeof proc, "/proc/self/fd/%d", s->fd);
    if (s->fd >= 0 && access(proc, F_OK) == 0) return;
    if (s->fd >= 0) close(s->fd);
    s->fd = -1;
    for (unsigned attempt = 0; s->fd < 0 && attempt < TEMP_TRIES; attempt++) {
        next_name(s, attempt);
        s->fd = open(s->name, O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0666);
        if (s->fd < 0 && errno != EEXIST) break;
    }
    s->named = s->fd >= 0;
}

static tl_status scratch_create(tl_ctx *ctx, const char *folder, size_t folder_bytes,
                                tli_scratch **scratch)
{
    tl_status st = TL_OK;
    *scratch = NULL;
    tli_scratch *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    *s = (tli_scratch){.ctx = ctx, .fd = -1};
    s->folder = tl_mem_zalloc(ctx, folder_bytes + 1, 1, &st);
    s->name = tl_mem_alloc(ctx, folder_bytes + NAME_BYTES, 1, &st);
    if (st) {
        tli_scratch_close(s);
        return st;
    }
    memcpy(s->folder, folder, folder_bytes);
    *scratch = s;
    return TL_OK;
}

static tl_status finish_open(tl_ctx *ctx, tli_scratch **scratch, const char *what)
{
    if ((*scratch)->fd >= 0) return TL_OK;
    tl_status st = fail(ctx, *scratch, what);
    tli_scratch_close(*scratch);
    *scratch = NULL;
    return st;
}

tl_status tli_scratch_open(tl_ctx *ctx, const char *folder, tli_scratch **scratch)
{
    if (!folder || !folder[0]) folder = "/tmp";
    tl_status st = scratch_create(ctx, folder, strlen(folder), scratch);
    if (st) return st;
    if (!tli_file_fault(ctx)) create(*scratch);
    return finish_open(ctx, scratch, "can't be created");
}

tl_status tli_scratch_open_beside(tl_ctx *ctx, const char *path, tli_scratch **scratch)
{
    const char *slash = strrchr(path, '/');
    const char *folder = slash ? path : ".";
    size_t bytes = !slash ? 1 : slash == path ? 1 : (size_t)(slash - path);
    tl_status st = scratch_create(ctx, folder, bytes, scratch);
    if (st) return st;
    if (!tli_file_fault(ctx)) create(*scratch);
    return finish_open(ctx, scratch, "can't be created");
}

tl_status tli_scratch_open_file(tl_ctx *ctx, const char *path, tli_scratch **scratch)
{
    struct stat info;
    tl_status st = scratch_create(ctx, path, strlen(path), scratch);
    if (st) return st;
    tli_scratch *s = *scratch;
    s->reading = true;
    if (!tli_file_fault(ctx)) s->fd = open(path, O_RDONLY | O_CLOEXEC);
    if (s->fd >= 0 && (fstat(s->fd, &info) || !S_ISREG(info.st_mode))) {
        close(s->fd);
        s->fd = -1;
        errno = EINVAL;
    }
    if (s->fd >= 0) s->bytes = (uint64_t)info.st_size;
    return finish_open(ctx, scratch, "can't be opened");
}

tl_status tli_scratch_open_named(tl_ctx *ctx, const char *path, bool anew, tli_scratch **scratch)
{
    struct stat info;
    tl_status st = scratch_create(ctx, path, strlen(path), scratch);
    if (st) return st;
    tli_scratch *s = *scratch;
    s->reading = true; /* messages name the file */
    if (!tli_file_fault(ctx))
        s->fd = open(path, O_RDWR | O_CLOEXEC | (anew ? O_CREAT | O_TRUNC : 0), 0666);
    if (s->fd >= 0 && !fstat(s->fd, &info)) s->bytes = (uint64_t)info.st_size;
    return finish_open(ctx, scratch, "can't be opened");
}

tl_status tli_scratch_sync(tl_ctx *ctx, tli_scratch *s)
{
    if (tli_file_fault(ctx) || fdatasync(s->fd))
        return fail(ctx, s, "can't be brought to the disk");
    return TL_OK;
}

/* Gives a file without a name the one in s->name. */
static int link_name(tli_scratch *s)
{
    char proc[NAME_BYTES];
    int failed = -1;
    snprintf(proc, sizeof proc, "/proc/self/fd/%d", s->fd);
    for (unsigned attempt = 0; failed && attempt < TEMP_TRIES; attempt++) {
        next_name(s, attempt);
        failed = linkat(AT_FDCWD, proc, AT_FDCWD, s->name, AT_SYMLINK_FOLLOW);
        if (failed && errno != EEXIST) break;
    }
    s->named = !failed;
    return failed;
}

tl_status tli_scratch_keep(tli_scratch *s, const char *path)
{
    tl_ctx *ctx = s->ctx;
    if (tli_file_fault(ctx) || fsync(s->fd)) return fail(ctx, s, "can't be brought to the disk");
    if (!s->named && link_name(s)) return fail(ctx, s, "can't be named");
    if (tli_file_fault(ctx) || rename(s->name, path))
        return tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': can't be put in its place", path);
    s->named = false;
    return TL_OK;
}

void tli_scratch_close(tli_scratch *s)
{
    if (!s) return;
    tl_ctx *ctx = s->ctx;
    if (s->fd >= 0) close(s->fd); /* what matters was synced before, or is not needed any more */
    if (s->named) unlink(s->name);
    tl_mem_free(ctx, s->name);
    tl_mem_free(ctx, s->folder);
    tl_mem_free(ctx, s);
}

tl_status tli_scratch_write(tl_ctx *ctx, tli_scratch *s, uint64_t ofs, const void *bytes,
                            size_t byte_count)
{
    const uint8_t *from = bytes;
    while (byte_count) {
        size_t piece = byte_count < IO_BYTES_MAX ? byte_count : IO_BYTES_MAX;
        ssize_t done = tli_file_fault(s->ctx) ? -1 : pwrite(s->fd, from, piece, (off_t)ofs);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0)
            return tli_fail_system(ctx, TL_ERR_IO, errno,
                                   "'%s': %scan't be written, %zu bytes at byte %llu", s->folder,
                                   s->reading ? "" : "a working file ", byte_count,
                                   (unsigned long long)ofs);
        from += done;
        ofs += (uint64_t)done;
        byte_count -= (size_t)done;
    }
    uint64_t bytes_now = atomic_load(&s->bytes);
    while (ofs > bytes_now && !atomic_compare_exchange_weak(&s->bytes, &bytes_now, ofs)) continue;
    return TL_OK;
}

tl_status tli_scratch_read(tl_ctx *ctx, const tli_scratch *s, uint64_t ofs, void *bytes,
                           size_t byte_count)
{
    uint8_t *to = bytes;
    while (byte_count) {
        size_t piece = byte_count < IO_BYTES_MAX ? byte_count : IO_BYTES_MAX;
        ssize_t done = tli_file_fault(s->ctx) ? -1 : pread(s->fd, to, piece, (off_t)ofs);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return fail(ctx, s, "can't be read");
        if (done == 0)
            return tl_fail(ctx, TL_ERR_IO, "'%s': ends at byte %llu, %zu more were expected",
                           s->folder, (unsigned long long)ofs, byte_count);
        to += done;
        ofs += (uint64_t)done;
        byte_count -= (size_t)done;
    }
    return TL_OK;
}

const char *tli_scratch_folder(const tli_scratch *s)
{
    return s->folder;
}

uint64_t tli_scratch_bytes(const tli_scratch *s)
{
    return atomic_load(&s->bytes);
}

tl_status tli_scratch_map(tl_ctx *ctx, const tli_scratch *s, size_t byte_count,
                          const uint8_t **bytes)
{
    *bytes = NULL;
    if (byte_count == 0) return TL_OK;
    void *map = MAP_FAILED;
    if (!tli_file_fault(s->ctx)) map = mmap(NULL, byte_count, PROT_READ, MAP_SHARED, s->fd, 0);
    if (map == MAP_FAILED) return fail(ctx, s, "can't be mapped");
    *bytes = map;
    return TL_OK;
}

int tli_scratch_reserve(tli_scratch *s, size_t byte_count, void **map)
{
    if (tli_file_fault(s->ctx)) return EIO;
    int error = posix_fallocate(s->fd, 0, (off_t)byte_count);
    if (error) return error;
    *map = mmap(NULL, byte_count, PROT_READ | PROT_WRITE, MAP_SHARED, s->fd, 0);
    return *map == MAP_FAILED ? errno : 0;
}

void tli_scratch_unmap(const uint8_t *bytes, size_t byte_count)
{
    if (bytes && byte_count) munmap((void *)(uintptr_t)bytes, byte_count);
}

void tli_scratch_forget(const uint8_t *bytes, size_t begin, size_t end)
{
    size_t page = (size_t)sysconf(_SC_PAGESIZE);
    begin = begin / page * page;
    end = (end + page - 1) / page * page;
    if (begin < end) (void)madvise((void *)((uintptr_t)bytes + begin), end - begin, MADV_DONTNEED);
}
