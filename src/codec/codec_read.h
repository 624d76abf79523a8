/* What the decoders of topology and channels share. */
#ifndef TETRALOD_SRC_CODEC_READ_H
#define TETRALOD_SRC_CODEC_READ_H

#include "codec/codec_model.h"
#include "codec/codec_rans.h"

/* As tokens_number. Inline: it is asked for every coordinate and value. */
static inline int64_t read_number(tli_stream *stream, uint32_t which, const tli_table *table,
                                  uint32_t first_row, tli_scale *scale, uint32_t around)
{
    uint32_t quarters = scale_expect(scale, around);
    uint32_t row = number_row(first_row, quarters);
    uint32_t symbol = stream_symbol(stream, which, codec_row(table, row));
    uint32_t length = symbol == NUMBER_ZERO ? 0 : symbol + quarters / 4 - NUMBER_MIDDLE;
    uint64_t bits = 0, magnitude;
    if (symbol == NUMBER_ESCAPE) length = (uint32_t)stream_bits(stream, NUMBER_ESCAPE_BITS);
    /* Other lengths are in no stream of ours; the end of the stream will tell. */
    length = length < 64 ? length : 64;
    scale_learn(scale, around, length);
    if (!length) return 0;
    bits = length <= PLAIN_BITS_MAX ? stream_few_bits(stream, length) : stream_bits(stream, length);
    magnitude = bits >> 1 | UINT64_C(1) << (length - 1);
    return (int64_t)((magnitude ^ (0 - (bits & 1))) + (bits & 1));
}

/* Number index of plain ones of elem_bytes, 4 or 8, little endian and signed. */
static inline int64_t read_raw(const uint8_t *bytes, size_t index, unsigned elem_bytes)
{
    const uint8_t *at = bytes + index * elem_bytes;
    return elem_bytes == 4 ? (int32_t)rans_word(at) : (int64_t)rans_long_word(at);
}

/* A raw topology after its head; *wrong says what is wrong, if anything. */
tl_status tli_topology_read_raw(tl_ctx *ctx, const uint8_t *bytes, size_t byte_count,
                                unsigned flags, tl_patch *patch, const char **wrong);
/* A raw channel; returns what is wrong, or NULL. byte_count >= CHANNEL_HEAD_BYTES. */
const char *tli_channel_read_raw(const uint8_t *bytes, size_t byte_count, size_t value_count,
                                 int64_t *values);

#endif
