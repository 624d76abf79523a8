/* Tokens to bytes: the encoder of the numeral system that codec_rans.h decodes. */
#include "codec/codec_tokens.h"

#include <math.h>

#define FIRST_TOKENS 4096

void tli_tokens_open(tl_ctx *ctx, tli_tokens *tokens)
{
    *tokens = (tli_tokens){.ctx = ctx};
}

void tli_tokens_close(tli_tokens *tokens)
{
    tl_mem_free(tokens->ctx, tokens->tokens);
    *tokens = (tli_tokens){.ctx = tokens->ctx};
}

void tli_tokens_grow(tli_tokens *tokens)
{
    size_t capacity = tokens->capacity ? 2 * tokens->capacity : FIRST_TOKENS;
    tokens->tokens = tl_mem_resize(tokens->ctx, tokens->tokens, capacity, sizeof *tokens->tokens,
                                   &tokens->status);
    if (!tokens->status) tokens->capacity = capacity;
}

/* Where a symbol lies in its row. */
static void span_of(const tli_table *table, uint32_t token, uint32_t *first, uint32_t *width)
{
    const int16_t *row = codec_row(table, token >> 4);
    uint32_t symbol = token & 15;
    *first = symbol ? (uint32_t)row[symbol - 1] + 1 : 0;
    *width = (uint32_t)row[symbol] + 1 - *first;
}

double tli_tokens_weigh(const tli_tokens *tokens, size_t begin, size_t end, const tli_table *table)
{
    double bits = 0;
    for (size_t i = begin; i < end && i < tokens->count; i++) {
        uint32_t token = tokens->tokens[i], first, width;
        if (token & TOKEN_RAW) {
            bits += token >> RANS_RAW_BITS & 31;
        } else {
            span_of(table, token, &first, &width);
            bits += RANS_BITS - log2(width);
        }
    }
    return bits;
}

void tli_tokens_count(const tli_tokens *tokens, uint64_t (*counts)[RANS_SYMBOLS])
{
    for (size_t i = 0; i < tokens->count; i++) {
        uint32_t token = tokens->tokens[i];
        if (!(token & TOKEN_RAW)) counts[token >> 4][token & 15]++;
    }
}

/* Writes the low word in front of what is there. */
static void put_word(uint8_t **at, uint64_t state)
{
    for (int i = 3; i >= 0; i--) *--*at = (uint8_t)(state >> 8 * i & 255);
}

tl_status tli_tokens_write(const tli_tokens *tokens, const tli_table *table, tli_bytes *out)
{
    uint64_t state = RANS_LOW;
    if (tokens->status) return tokens->status;
    /* A token takes at most 16 bits; the state takes 8 bytes. */
    size_t most = 2 * tokens->count + 16;
    tl_status st = tli_bytes_reserve(out, most);
    if (st) return st;
    uint8_t *begin = out->bytes + out->count, *end = begin + most, *at = end;
    for (size_t i = tokens->count; i-- > 0;) {
        uint32_t token = tokens->tokens[i], first, width;
        if (token & TOKEN_RAW) {
            uint32_t bit_count = token >> RANS_RAW_BITS & 31;
            if (state >= RANS_LOW << (32 - bit_count)) {
                put_word(&at, state);
                state >>= 32;
            }
            state = state << bit_count | (token & ((1u << bit_count) - 1));
        } else {
            span_of(table, token, &first, &width);
            if (state >= (RANS_LOW << (32 - RANS_BITS)) * width) {
                put_word(&at, state);
                state >>= 32;
            }
            state = (state / width << RANS_BITS) + state % width + first;
        }
    }
    put_word(&at, state);
    put_word(&at, state >> 32);
    out->count += (size_t)(end - at);
    for (uint8_t *to = begin; at < end; at++, to++) *to = *at;
    return TL_OK;
}
