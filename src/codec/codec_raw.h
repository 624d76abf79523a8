/* The plain layout: every number by itself, little endian. Encoding side. */
#ifndef TETRALOD_SRC_CODEC_RAW_H
#define TETRALOD_SRC_CODEC_RAW_H

#include "codec/codec.h"

tl_status tli_topology_encode_raw(tl_ctx *ctx, const tl_patch *patch, tli_bytes *out);
tl_status tli_channel_encode_raw(const int64_t *values, uint32_t count, uint32_t components,
                                 tli_bytes *out);
/* Appends the low elem_bytes of each of values [count]. */
tl_status tli_raw_append(tli_bytes *out, const int64_t *values, size_t count, unsigned elem_bytes);

#endif
