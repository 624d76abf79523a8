/* What an encoder says, as a list: symbols with the row of the table that they are coded by, and
 * bits that are not modelled. The list is counted by the trainer, weighed, or turned into bytes,
 * last token first, as the decoder's state unwinds. */
#ifndef TETRALOD_SRC_CODEC_TOKENS_H
#define TETRALOD_SRC_CODEC_TOKENS_H

#include "codec/codec.h"
#include "codec/codec_model.h"

/* A token of raw bits: flag, how many (1 .. 16), the bits. Of a symbol: 16 * row + symbol. */
#define TOKEN_RAW 0x80000000u

typedef struct tli_tokens {
    tl_ctx *ctx;
    uint32_t *tokens;
    size_t count, capacity;
    tl_status status; /* the first failure; tokens are then dropped */
} tli_tokens;

void tli_tokens_open(tl_ctx *ctx, tli_tokens *tokens);
void tli_tokens_close(tli_tokens *tokens);
void tli_tokens_grow(tli_tokens *tokens);

static inline void tokens_add(tli_tokens *tokens, uint32_t token)
{
    if (tokens->count == tokens->capacity) tli_tokens_grow(tokens);
    if (tokens->count < tokens->capacity) tokens->tokens[tokens->count++] = token;
}

static inline void tokens_symbol(tli_tokens *tokens, uint32_t row, uint32_t symbol)
{
    tokens_add(tokens, row << 4 | symbol);
}

static inline void tokens_raw(tli_tokens *tokens, uint64_t value, uint32_t bit_count)
{
    for (uint32_t done = 0; done < bit_count;) {
        uint32_t now = bit_count - done < RANS_RAW_BITS ? bit_count - done : RANS_RAW_BITS;
        uint32_t bits = (uint32_t)(value >> done & ((UINT64_C(1) << now) - 1));
        tokens_add(tokens, TOKEN_RAW | now << RANS_RAW_BITS | bits);
        done += now;
    }
}

/* Bits that tokens [begin, end) take with a table. */
double tli_tokens_weigh(const tli_tokens *tokens, size_t begin, size_t end, const tli_table *table);
/* Adds their symbols to counts. */
void tli_tokens_count(const tli_tokens *tokens, uint64_t (*counts)[RANS_SYMBOLS]);
/* Appends the stream. */
tl_status tli_tokens_write(const tli_tokens *tokens, const tli_table *table, tli_bytes *out);

#endif
