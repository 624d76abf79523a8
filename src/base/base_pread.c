/* A file read at places, by pread: several threads may read at once, and a file that another
 * program cuts short gives an error where a mapped one would end the process. */
#include "base/base_context.h"
#include "base/base_file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define READ_BYTES_MAX ((size_t)1 << 30) /* one call; the system takes no more than 2 GiB */

static tl_status examine(tl_ctx *ctx, const char *path, int fd, uint64_t *byte_count)
{
    struct stat info;
    if (fstat(fd, &info))
        return tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': can't be examined", path);
    if (S_ISDIR(info.st_mode)) return tl_fail(ctx, TL_ERR_IO, "'%s' is a folder, not a file", path);
    if (!S_ISREG(info.st_mode))
        return tl_fail(ctx, TL_ERR_IO, "'%s' is no regular file; it can't be read at places", path);
    *byte_count = (uint64_t)info.st_size;
    return TL_OK;
}

tl_status tli_pread_open(tl_ctx *ctx, const char *path, tli_pread *reader)
{
    tl_status st = TL_OK;
    uint64_t byte_count = 0;
    *reader = (tli_pread){.fd = -1};
    /* O_NONBLOCK: a pipe that nobody writes to must not wait here */
    int fd = tli_file_fault(ctx) ? -1 : open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) return tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': can't be opened", path);
    st = examine(ctx, path, fd, &byte_count);
    char *name = st ? NULL : tli_strdup(ctx, path, &st);
    if (st)
        close(fd);
    else
        *reader = (tli_pread){.path = name, .byte_count = byte_count, .fd = fd};
    return st;
}

static tl_status fail_short(tl_ctx *ctx, const tli_pread *reader, uint64_t ofs)
{
    return tl_fail(ctx, TL_ERR_IO, "'%s': ends at byte %llu, more was expected", reader->path,
                   (unsigned long long)ofs);
}

tl_status tli_pread_read(tl_ctx *ctx, const tli_pread *reader, uint64_t ofs, void *bytes,
                         size_t byte_count)
{
    uint8_t *to = bytes;
    if (ofs > reader->byte_count || byte_count > reader->byte_count - ofs)
        return fail_short(ctx, reader, reader->byte_count);
    if (reader->fd < 0) {
        if (byte_count) memcpy(to, reader->bytes + ofs, byte_count);
        return TL_OK;
    }
    while (byte_count) {
        size_t piece = byte_count < READ_BYTES_MAX ? byte_count : READ_BYTES_MAX;
        ssize_t got = tli_file_fault(ctx) ? -1 : pread(reader->fd, to, piece, (off_t)ofs);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0)
            return tli_fail_system(ctx, TL_ERR_IO, errno, "'%s': can't be read at byte %llu",
                                   reader->path, (unsigned long long)ofs);
        if (got == 0) return fail_short(ctx, reader, ofs);
        ofs += (uint64_t)got;
        to += got;
        byte_count -= (size_t)got;
    }
    return TL_OK;
}

void tli_pread_close(tl_ctx *ctx, tli_pread *reader)
{
    if (reader->fd >= 0) {
        close(reader->fd); /* read only: nothing that closing could lose */
        tl_mem_free(ctx, (void *)(uintptr_t)reader->path);
    }
    *reader = (tli_pread){.fd = -1};
}
