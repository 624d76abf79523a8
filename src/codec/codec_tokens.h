/* What an encoder says, as a list: symbols with the row of the table that they are coded by, and
 * bits that are not modelled. The list is counted by the trainer, weighed, or turned into bytes,
 * symbols last first, as the decoder's states unwind. */
#ifndef TETRALOD_SRC_CODEC_TOKENS_H
#define TETRALOD_SRC_CODEC_TOKENS_H

#include "codec/codec.h"
#include "codec/codec_model.h"

/* A token of plain bits: flag, how many (1 .. 16), the bits. Of a symbol: its state, its row, the
 * symbol. */
#define TOKEN_PLAIN 0x80000000u
#define TOKEN_PLAIN_BITS 16u
#define TOKEN_STATE_SHIFT 29
#define TOKEN_ROW_MASK 0x1ffffffu /* of a token without its symbol */

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

static inline void tokens_symbol(tli_tokens *tokens, uint32_t state, uint32_t row, uint32_t symbol)
{
    tokens_add(tokens, state << TOKEN_STATE_SHIFT | row << 4 | symbol);
}

static inline uint32_t token_row(uint32_t token)
{
    return token >> 4 & TOKEN_ROW_MASK;
}

/* The lowest bit_count bits of value, the highest of them first. */
static inline void tokens_plain(tli_tokens *tokens, uint64_t value, uint32_t bit_count)
{
    while (bit_count) {
        uint32_t now = bit_count < TOKEN_PLAIN_BITS ? bit_count : TOKEN_PLAIN_BITS;
        bit_count -= now;
        uint32_t bits = (uint32_t)(value >> bit_count & ((UINT64_C(1) << now) - 1));
        tokens_add(tokens, TOKEN_PLAIN | now << TOKEN_PLAIN_BITS | bits);
    }
}

/* Bits that tokens [begin, end) take with a table. */
double tli_tokens_weigh(const tli_tokens *tokens, size_t begin, size_t end, const tli_table *table);
/* Adds their symbols to counts. */
void tli_tokens_count(const tli_tokens *tokens, uint64_t (*counts)[RANS_SYMBOLS]);
/* Appends a stream of that many states, filled up with zeros if it has less than least_bytes. */
tl_status tli_tokens_write(const tli_tokens *tokens, const tli_table *table, uint32_t state_count,
                           size_t least_bytes, tli_bytes *out);

#endif
