/* Stage codec, internal: what writes files needs beside the public header. Encoding a patch:
 * tli_patch_arrange, then tli_topology_encode and tli_channel_encode, with tables that a trainer
 * made of a sample of patches. */
#ifndef TETRALOD_SRC_CODEC_H
#define TETRALOD_SRC_CODEC_H

#include "base/base.h"
#include "tetralod/codec.h"

/* A buffer of bytes that grows. tli_bytes_open before the first use; growing keeps what is there.
 */
typedef struct tli_bytes {
    tl_ctx *ctx;
    uint8_t *bytes;
    size_t count, capacity;
} tli_bytes;
void tli_bytes_open(tl_ctx *ctx, tli_bytes *buffer);
void tli_bytes_close(tli_bytes *buffer);
/* Room for more bytes after count. */
tl_status tli_bytes_reserve(tli_bytes *buffer, size_t more);
tl_status tli_bytes_append(tli_bytes *buffer, const void *bytes, size_t byte_count);

/* Puts vertices and tets into the order in which the coder meets them, and the corners of each tet
 * into the order in which it names them (an even permutation), in place. vert_order [vert_count]
 * and tet_order [tet_count] (may be NULL) receive for each new index the old one, so that channels
 * can follow; opposite is made. Arranging again changes nothing. Everything below demands an
 * arranged patch. TL_ERR_ARG if a count passes its limit or an index is not below vert_count. */
tl_status tli_patch_arrange(tl_ctx *ctx, tl_patch *patch, uint32_t *vert_order,
                            uint32_t *tet_order);

/* What of a channel the coder knows. */
typedef struct tli_coded_channel {
    tl_value_code code;
    tl_on on;
    uint32_t components; /* >= 1 */
} tli_coded_channel;

/* Counts what occurs in a sample of patches. */
typedef struct tli_trainer tli_trainer;
/* channels [channel_count] is copied. Gives *trainer. */
tl_status tli_trainer_create(tl_ctx *ctx, const tl_lattice *lattice,
                             const tli_coded_channel *channels, size_t channel_count,
                             tli_trainer **trainer);
/* NULL is allowed. */
void tli_trainer_destroy(tl_ctx *ctx, tli_trainer *trainer);
/* Counts an arranged patch as of class_; values [channel_count], each [elements][components] or
 * NULL for a channel that is left out. The order of the patches does not matter. */
tl_status tli_trainer_add(tl_ctx *ctx, tli_trainer *trainer, unsigned class_, const tl_patch *patch,
                          const int64_t *const *values);
/* Appends tables made of what was counted, for tl_codec_read; a class or channel without any patch
 * gets plain ones. */
tl_status tli_trainer_write(const tli_trainer *trainer, tli_bytes *out);

/* Appends tables to out that have the channels of fresh, tables as a trainer writes them: those
 * that old has too, the first ones, and all that is not of channels are coded as by old. */
tl_status tli_tables_extend(tl_ctx *ctx, const uint8_t *old, size_t old_bytes,
                            const tli_bytes *fresh, tli_bytes *out);

/* Where the bits of a topology blob went. */
typedef struct tli_bits {
    double connectivity, places, flags, regions;
} tli_bits;

/* Appends a blob to out. codec may be NULL for TL_CLASS_RAW. bits may be NULL, else adds up.
 * TL_ERR_ARG for a patch that is not arranged, over a limit, or with places outside the lattice. */
tl_status tli_topology_encode(tl_ctx *ctx, const tl_codec *codec, unsigned class_,
                              const tl_patch *patch, tli_bytes *out, tli_bits *bits);
tl_status tli_channel_encode(tl_ctx *ctx, const tl_codec *codec, unsigned class_,
                             const tl_patch *patch, size_t channel, tl_on on, uint32_t components,
                             const int64_t *values, tli_bytes *out);

#endif
