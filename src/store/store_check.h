/* Stage store, only for its checker: the part that decodes. */
#ifndef TETRALOD_SRC_STORE_CHECK_H
#define TETRALOD_SRC_STORE_CHECK_H

#include "store/store_read.h"

/* Proves the blobs of patches [first, first + count), the inputs of one segment or roots:
 * checksums, padding, decoding, spheres, ranges, and that shared vertices agree. */
tl_status tli_store_check_group(tl_ctx *ctx, const tl_store *store, uint32_t first, uint32_t count);

#endif
