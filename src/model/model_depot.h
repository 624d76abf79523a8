/* Stage model, internal: blocks of bytes in a working file, put and read by several threads. */
#ifndef TETRALOD_SRC_MODEL_DEPOT_H
#define TETRALOD_SRC_MODEL_DEPOT_H

#include "base/base.h"

typedef struct tli_depot tli_depot;
/* folder as in tli_scratch_open. */
tl_status tli_depot_create(tl_ctx *ctx, const char *folder, tli_depot **depot);
/* In a file of that name, which stays: begun anew, or with all that it holds. */
tl_status tli_depot_open(tl_ctx *ctx, const char *path, bool anew, tli_depot **depot);
/* Forgets what lies behind end. TL_ERR_DATA for a file that has less. */
tl_status tli_depot_cut(tli_depot *depot, uint64_t end);
/* First byte behind all blocks. */
uint64_t tli_depot_end(const tli_depot *depot);
/* Brings all blocks to the disk. */
tl_status tli_depot_sync(tl_ctx *ctx, tli_depot *depot);
/* NULL is allowed. */
void tli_depot_destroy(tli_depot *depot);
/* Writes a block behind all others; ctx is the caller's, as in tli_depot_get. */
tl_status tli_depot_put(tl_ctx *ctx, tli_depot *depot, const void *bytes, size_t byte_count,
                        uint64_t *ofs);
tl_status tli_depot_get(tl_ctx *ctx, const tli_depot *depot, uint64_t ofs, void *bytes,
                        size_t byte_count);
/* Forgets all blocks; new ones take their room. */
void tli_depot_clear(tli_depot *depot);

#endif
