/* A patch and its channels as tokens: what trainer and encoders share. */
#ifndef TETRALOD_SRC_CODEC_TELL_H
#define TETRALOD_SRC_CODEC_TELL_H

#include "codec/codec_tokens.h"
#include "codec/codec_topology.h"

/* TL_ERR_ARG if counts pass their limits or an index is not below vert_count. */
tl_status tli_patch_verify(tl_ctx *ctx, const tl_patch *patch);

/* A whole topology: head, tokens, and where the parts of the tokens end. */
typedef struct tli_topology_tokens {
    uint8_t head[TOPOLOGY_HEAD_BYTES];
    tli_tokens tokens;
    size_t connectivity_end, flags_end, places_end;
} tli_topology_tokens;
/* tli_tokens_close(&out->tokens) afterwards, also on failure. */
tl_status tli_topology_tell(tl_ctx *ctx, const tl_lattice *lattice, const tl_patch *patch,
                            tli_topology_tokens *out);
/* The head, as of kind. */
void tli_topology_head(const tl_patch *patch, uint8_t kind, uint8_t flags, uint32_t odd_count,
                       uint8_t head[TOPOLOGY_HEAD_BYTES]);

/* A channel and the flags of its blob; first_row is the first of its rows. */
tl_status tli_channel_tell(tl_ctx *ctx, const tl_patch *patch, uint32_t first_row, tl_on on,
                           uint32_t components, const int64_t *values, uint8_t *flags,
                           tli_tokens *tokens);

/* A number whose expected length is that of around, as scale has learned. */
static inline void tokens_number(tli_tokens *tokens, uint32_t state, uint32_t first_row,
                                 tli_scale *scale, uint32_t around, int64_t value)
{
    uint64_t magnitude = value < 0 ? 0 - (uint64_t)value : (uint64_t)value;
    uint32_t length = model_length(magnitude), quarters = scale_expect(scale, around);
    uint32_t symbol = NUMBER_MIDDLE + length - quarters / 4, row = number_row(first_row, quarters);
    if (!length)
        symbol = NUMBER_ZERO;
    else if (symbol - 1 >= NUMBER_ESCAPE - 1)
        symbol = NUMBER_ESCAPE;
    tokens_symbol(tokens, state, row, symbol);
    if (symbol == NUMBER_ESCAPE) tokens_plain(tokens, length, NUMBER_ESCAPE_BITS);
    if (length) {
        uint64_t below = length > 1 ? magnitude & ((UINT64_C(1) << (length - 1)) - 1) : 0;
        tokens_plain(tokens, below << 1 | (value < 0), length);
    }
    scale_learn(scale, around, length);
}

#endif
