/* What the decoders of topology and channels share. */
#ifndef TETRALOD_SRC_CODEC_READ_H
#define TETRALOD_SRC_CODEC_READ_H

#include "codec/codec_model.h"
#include "codec/codec_rans.h"

/* As tokens_number. Inline: it is asked for every coordinate and value. */
static inline int64_t read_number(tli_rans *rans, const tli_table *table, uint32_t first_row,
                                  tli_scale *scale, uint32_t around)
{
    uint32_t quarters = scale_expect(scale, around), length = 0;
    uint32_t symbol = rans_symbol(rans, codec_row(table, number_row(first_row, quarters)));
    uint64_t magnitude = 0, bits = 0;
    if (symbol == NUMBER_ESCAPE)
        length = (uint32_t)rans_raw(rans, NUMBER_ESCAPE_BITS);
    else if (symbol != NUMBER_ZERO)
        length = symbol + quarters / 4 - NUMBER_MIDDLE;
    /* Other lengths are in no stream of ours; the end of the stream will tell. */
    length = length < 64 ? length : 64;
    if (length) {
        bits = rans_raw(rans, length);
        magnitude = bits >> 1 | UINT64_C(1) << (length - 1);
    }
    scale_learn(scale, around, length);
    return (int64_t)(bits & 1 ? 0 - magnitude : magnitude);
}

/* Number index of plain ones of elem_bytes, 4 or 8, little endian and signed. */
static inline int64_t read_raw(const uint8_t *bytes, size_t index, unsigned elem_bytes)
{
    const uint8_t *at = bytes + index * elem_bytes;
    if (elem_bytes == 4) return (int32_t)rans_word(at);
    return (int64_t)((uint64_t)rans_word(at) | (uint64_t)rans_word(at + 4) << 32);
}

/* A raw topology after its head; *wrong says what is wrong, if anything. */
tl_status tli_topology_read_raw(tl_ctx *ctx, const uint8_t *bytes, size_t byte_count,
                                unsigned flags, tl_patch *patch, const char **wrong);
/* A raw channel; returns what is wrong, or NULL. byte_count >= CHANNEL_HEAD_BYTES. */
const char *tli_channel_read_raw(const uint8_t *bytes, size_t byte_count, size_t value_count,
                                 int64_t *values);

#endif
