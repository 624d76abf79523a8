/* Whole files as bytes. Regular files are mapped; pipes, devices and what refuses to be mapped are
 * read into memory of the budget. A file that another program cuts short while it is mapped ends
 * the process (SIGBUS), as with every mapped file. */
#define _DEFAULT_SOURCE 1 /* madvise: glibc's posix_madvise ignores "not needed" */

#include "base/base_context.h"
#include "base/base_file.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#define READ_BYTES_FIRST ((size_t)64 << 10)
#define READ_BYTES_MAX ((size_t)1 << 30) /* one call; the system takes no more than 2 GiB */

static const uint8_t no_bytes[1];

bool tli_file_fault(tl_ctx *ctx)
{
    tl_ctx *root = ctx->root;
    uint64_t left = atomic_load(&root->file_fail_in);
    while (left && !atomic_compare_exchange_weak(&root->file_fail_in, &left, left - 1)) continue;
    if (left != 1) return false;
    errno = EIO;
    return true;
}

void tli_file_fail_at(tl_ctx *ctx, uint64_t n)
{
    ctx->root->file_fail_in = n;
}

/* Reads once; -1 with errno on failure. */
static ssize_t read_some(tl_ctx *ctx, int fd, uint8_t *bytes, size_t room)
{
    ssize_t got;
    if (tli_file_fault(ctx)) return -1;
    if (room > READ_BYTES_MAX) room = READ_BYTES_MAX;
    do got = read(fd, bytes, room);
    while (got < 0 && errno == EINTR);
    return got;
}

static tl_status refuse_size(tl_ctx *ctx, const char *path, uint64_t most_bytes)
{
    return tl_fail(ctx, TL_ERR_FORMAT,
                   "'%s' has more than the %llu bytes that are expected at most", path,
                   (unsigned long long)most_bytes);
}

/* Reads to the end into a block that grows; size_hint bytes are expected. */
static tl_status read_whole(tl_ctx *ctx, int fd, const char *path, uint64_t size_hint,
                            uint64_t most_bytes, tli_map *map)
{
    tl_status st = TL_OK;
    size_t room = READ_BYTES_FIRST, used = 0;
    if (size_hint >= room && size_hint < SIZE_MAX)
        room = (size_t)size_hint + 1; /* + 1: sees the end */
    uint8_t *bytes = tl_mem_alloc(ctx, room, 1, &st);
    while (!st) {
        if (used > most_bytes) {
            st = refuse_size(ctx, path, most_bytes);
            break;
        }
        if (used == room) {
            size_t more = room < SIZE_MAX / 2 ? room * 2 : SIZE_MAX;
            bytes = tl_mem_resize(ctx, bytes, more, 1, &st);
            if (st) break;
            room = more;
        }
        ssize_t got = read_some(ctx, fd, bytes + used, room - used);
        if (got < 0) {
            st = tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': can't be read at byte %zu", path,
                                 used);
        } else if (got == 0) {
            break;
        } else {
            used += (size_t)got;
        }
    }
    if (st) {
        tl_mem_free(ctx, bytes);
        return tl_note(ctx, st, "while reading '%s' into memory", path);
    }
    *map = (tli_map){.bytes = bytes, .byte_count = used, .owned = bytes};
    return TL_OK;
}

static tl_status map_or_read(tl_ctx *ctx, int fd, const char *path, uint64_t most_bytes,
                             tli_map *map)
{
    struct stat info;
    if (fstat(fd, &info))
        return tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': can't be examined", path);
    if (S_ISDIR(info.st_mode)) return tl_fail(ctx, TL_ERR_IO, "'%s' is a folder, not a file", path);
    uint64_t size = info.st_size > 0 ? (uint64_t)info.st_size : 0;
    if (!S_ISREG(info.st_mode)) size = 0;
    if (size > most_bytes) return refuse_size(ctx, path, most_bytes);
    if (size && size <= PTRDIFF_MAX) {
        if (tli_file_fault(ctx))
            return tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': can't be read", path);
        void *bytes = mmap(NULL, (size_t)size, PROT_READ, MAP_PRIVATE, fd, 0);
        if (bytes != MAP_FAILED) {
            *map = (tli_map){.bytes = bytes, .byte_count = size};
            return TL_OK;
        }
    }
    /* files of /proc say that they are empty, too */
    return read_whole(ctx, fd, path, size, most_bytes, map);
}

tl_status tli_map_open(tl_ctx *ctx, const char *path, tli_map *map)
{
    return tli_map_open_within(ctx, path, UINT64_MAX, map);
}

tl_status tli_map_open_within(tl_ctx *ctx, const char *path, uint64_t most_bytes, tli_map *map)
{
    *map = (tli_map){.bytes = no_bytes};
    int fd = tli_file_fault(ctx) ? -1 : open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': can't be opened", path);
    tl_status st = map_or_read(ctx, fd, path, most_bytes, map);
    close(fd); /* read only: nothing that closing could lose */
    return st;
}

void tli_map_forget(const tli_map *map, uint64_t begin, uint64_t end)
{
    uint64_t page = (uint64_t)sysconf(_SC_PAGESIZE);
    if (map->owned || map->bytes == no_bytes) return;
    if (end > map->byte_count) end = map->byte_count;
    begin = (begin + page - 1) / page * page; /* pages that are shared with the neighbours stay */
    if (end < map->byte_count) end = end / page * page;
    if (begin >= end) return;
    void *start = (void *)((uintptr_t)map->bytes + (uintptr_t)begin);
    (void)madvise(start, (size_t)(end - begin), MADV_DONTNEED); /* a hint: it may be refused */
}

void tli_map_close(tl_ctx *ctx, tli_map *map)
{
    if (map->owned)
        tl_mem_free(ctx, map->owned);
    else if (map->bytes && map->bytes != no_bytes)
        munmap((void *)(uintptr_t)map->bytes, (size_t)map->byte_count);
    *map = (tli_map){.bytes = no_bytes};
}
