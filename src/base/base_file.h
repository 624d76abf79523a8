/* Stage base, internal: files larger than 4 GiB, mapped reading, output that appears only when
 * complete. */
#ifndef TETRALOD_SRC_BASE_FILE_H
#define TETRALOD_SRC_BASE_FILE_H

#include "base/base.h"

/* True if the path ends in ending, which is in lower case, in any case. */
bool tli_path_ends(const char *path, const char *ending);

/* A whole file as bytes, mapped (or read, where it can't be mapped). */
typedef struct tli_map {
    const uint8_t *bytes; /* [byte_count], never NULL after a successful open */
    uint64_t byte_count;
    void *owned; /* NULL when mapped */
} tli_map;

/* TL_ERR_IO names the path and the system's reason; a folder is refused by name. */
tl_status tli_map_open(tl_ctx *ctx, const char *path, tli_map *map);
/* The same of files that make no sense above some size, pipes and devices without end included:
 * TL_ERR_FORMAT, and no more than twice as much is read of them. */
tl_status tli_map_open_within(tl_ctx *ctx, const char *path, uint64_t most_bytes, tli_map *map);
/* Tells the system that [begin, end) will not be read again soon, so that its pages need not stay
 * resident. */
void tli_map_forget(const tli_map *map, uint64_t begin, uint64_t end);
void tli_map_close(tl_ctx *ctx, tli_map *map);

/* What tells one state of a regular file from the next; of all else nothing. */
typedef struct tli_stamp {
    bool is_regular;
    uint64_t bytes, node;
    int64_t seconds, nanoseconds;
} tli_stamp;
tli_stamp tli_stamp_take(const char *path);
bool tli_stamp_holds(const char *path, const tli_stamp *before);
/* After a file was read with that status: TL_ERR_DATA, or a note, if it changed meanwhile. */
tl_status tli_stamp_check(tl_ctx *ctx, const char *path, const tli_stamp *before, tl_status status);

/* A regular file, or bytes in memory, read at places by any number of threads. Nothing is mapped: a
 * file that is cut short while it is open gives an error. */
typedef struct tli_pread {
    const char *path;     /* for messages; owned when opened from a file */
    const uint8_t *bytes; /* in memory; NULL: a file */
    uint64_t byte_count;  /* when it was opened */
    int fd;               /* -1: in memory */
} tli_pread;
/* TL_ERR_IO names the path and the system's reason; what is no regular file is refused. */
tl_status tli_pread_open(tl_ctx *ctx, const char *path, tli_pread *reader);
/* Reads all of [ofs, ofs + byte_count); TL_ERR_IO when the file ends before. */
tl_status tli_pread_read(tl_ctx *ctx, const tli_pread *reader, uint64_t ofs, void *bytes,
                         size_t byte_count);
void tli_pread_close(tl_ctx *ctx, tli_pread *reader);

/* A file being written. Buffered, 64-bit; nothing shows under the final name before a committed
 * close. A path that names something that is no regular file (a device, a pipe) is written in
 * place. */
typedef struct tli_sink tli_sink;
tl_status tli_sink_open(tl_ctx *ctx, const char *path, tli_sink **sink);
/* After a failed write all further ones return the same failure. */
tl_status tli_sink_write(tli_sink *sink, const void *bytes, size_t byte_count);
tl_status tli_sink_printf(tli_sink *sink, const char *format, ...) TL_PRINTF(2, 3);
/* Bytes written so far. */
uint64_t tli_sink_tell(const tli_sink *sink);
/* Replaces bytes written before; [ofs, ofs + byte_count) must lie below tli_sink_tell. */
tl_status tli_sink_patch(tli_sink *sink, uint64_t ofs, const void *bytes, size_t byte_count);
/* commit: flush, sync, rename over the final name; else everything is removed. NULL is allowed. */
tl_status tli_sink_close(tli_sink *sink, bool commit);

/* Fault injection for tests: the n-th file operation (open, read, write, sync, rename) from now on
 * fails with EIO; 0 switches it off. The count is that of a context and its forks. */
void tli_file_fail_at(tl_ctx *ctx, uint64_t n);

#endif
