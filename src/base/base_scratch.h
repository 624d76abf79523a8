/* Stage base, internal: working files that are written and read at any place. They have no name
 * where the file system can do so, so that even a killed process leaves nothing behind; else they
 * are removed when they are closed. */
#ifndef TETRALOD_SRC_BASE_SCRATCH_H
#define TETRALOD_SRC_BASE_SCRATCH_H

#include "base/base.h"

typedef struct tli_scratch tli_scratch;

/* folder NULL: "/tmp". Gives *scratch. TL_ERR_IO. */
tl_status tli_scratch_open(tl_ctx *ctx, const char *folder, tli_scratch **scratch);
/* A file that exists, for reading alone; it stays. */
tl_status tli_scratch_open_file(tl_ctx *ctx, const char *path, tli_scratch **scratch);
/* The working file of a file that is to stand under path: in the folder of path. */
tl_status tli_scratch_open_beside(tl_ctx *ctx, const char *path, tli_scratch **scratch);
/* A file under a name that stays when it is closed, or the program ends: begun anew, or as it is.
 */
tl_status tli_scratch_open_named(tl_ctx *ctx, const char *path, bool anew, tli_scratch **scratch);
/* Brings what was written to the disk. */
tl_status tli_scratch_sync(tl_ctx *ctx, tli_scratch *scratch);
/* Gives it that name, replacing what has it. It stays when the file is closed. */
tl_status tli_scratch_keep(tli_scratch *scratch, const char *path);
/* NULL is allowed. */
void tli_scratch_close(tli_scratch *scratch);

/* Several threads may write and read at once, each with its context: of failures. TL_ERR_IO says
 * when the disk is full, or the file too short. */
tl_status tli_scratch_write(tl_ctx *ctx, tli_scratch *scratch, uint64_t ofs, const void *bytes,
                            size_t byte_count);
tl_status tli_scratch_read(tl_ctx *ctx, const tli_scratch *scratch, uint64_t ofs, void *bytes,
                           size_t byte_count);
/* For messages: its folder, or its path where it has a name. */
const char *tli_scratch_folder(const tli_scratch *scratch);
/* First byte behind all that was written. */
uint64_t tli_scratch_bytes(const tli_scratch *scratch);

/* Makes the file byte_count bytes long, with room on the disk for all of them, and maps them for
 * reading and writing: the mapping outlives the file. Returns 0 or an errno value. */
int tli_scratch_reserve(tli_scratch *scratch, size_t byte_count, void **map);
/* The first byte_count bytes of the file, mapped for reading. */
tl_status tli_scratch_map(tl_ctx *ctx, const tli_scratch *scratch, size_t byte_count,
                          const uint8_t **bytes);
void tli_scratch_unmap(const uint8_t *bytes, size_t byte_count);
/* The pages of mapped bytes [begin, end) need not stay resident; any thread. */
void tli_scratch_forget(const uint8_t *bytes, size_t begin, size_t end);

#endif
