/* Stage base, internal: large blocks of memory that lie in working files instead. While a context
 * spills, what is asked for in large pieces is the mapping of a file without a name: the system
 * brings its pages to the disk when it needs their room, so that a reader that holds a whole file
 * works under any budget. Such blocks do not count against it; the room in the folder is taken
 * beforehand, so that a full disk is an error and no signal. */
#ifndef TETRALOD_SRC_BASE_SPILL_H
#define TETRALOD_SRC_BASE_SPILL_H

#include "base/base.h"

/* Smallest block that is spilled. */
#define TLI_SPILL_BYTES ((size_t)1 << 20)

/* Does nothing without a budget. folder is borrowed until the end; NULL: "/tmp". Not while a
 * tli_parallel runs; blocks may outlive the end. */
void tli_spill_begin(tl_ctx *ctx, const char *folder);
void tli_spill_end(tl_ctx *ctx);
/* Bytes of all spilled blocks. */
uint64_t tli_spill_bytes(const tl_ctx *ctx);

#endif
