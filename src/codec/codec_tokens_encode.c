/* Tokens to bytes: the encoder of the numeral system that codec_rans.h decodes. */
#include "codec/codec_tokens.h"

#include <math.h>
#include <string.h>

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
    const int16_t *row = codec_row(table, token_row(token));
    uint32_t symbol = token & 15;
    *first = symbol ? (uint32_t)row[symbol - 1] + 1 : 0;
    *width = (uint32_t)row[symbol] + 1 - *first;
}

double tli_tokens_weigh(const tli_tokens *tokens, size_t begin, size_t end, const tli_table *table)
{
    double bits = 0;
    for (size_t i = begin; i < end && i < tokens->count; i++) {
        uint32_t token = tokens->tokens[i], first, width;
        if (token & TOKEN_PLAIN) {
            bits += token >> TOKEN_PLAIN_BITS & 31;
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
        if (!(token & TOKEN_PLAIN)) counts[token_row(token)][token & 15]++;
    }
}

/* Writes the low word in front of what is there. */
static void put_word(uint8_t **at, uint64_t state)
{
    for (int i = 3; i >= 0; i--) *--*at = (uint8_t)(state >> 8 * i & 255);
}

/* The symbols, down from at. Returns where they begin. */
static uint8_t *write_symbols(const tli_tokens *tokens, const tli_table *table,
                              uint32_t state_count, uint8_t *at)
{
    uint64_t states[RANS_STATES_MAX];
    for (uint32_t i = 0; i < RANS_STATES_MAX; i++) states[i] = RANS_LOW;
    for (size_t i = tokens->count; i-- > 0;) {
        uint32_t token = tokens->tokens[i], first, width;
        if (token & TOKEN_PLAIN) continue;
        uint64_t *state = &states[token >> TOKEN_STATE_SHIFT];
        span_of(table, token, &first, &width);
        if (*state >= (RANS_LOW << (32 - RANS_BITS)) * width) {
            put_word(&at, *state);
            *state >>= 32;
        }
        uint64_t whole = *state / width;
        *state = (whole << RANS_BITS) + (*state - whole * width) + first;
    }
    for (uint32_t i = state_count; i-- > 0;) {
        put_word(&at, states[i]);
        put_word(&at, states[i] >> 32);
    }
    return at;
}

/* The plain bits, down from end. Returns where they begin. */
static uint8_t *write_plain(const tli_tokens *tokens, uint8_t *end)
{
    uint64_t pending = 0; /* its lowest bits are still to be written */
    uint32_t pending_count = 0;
    uint8_t *at = end;
    for (size_t i = 0; i < tokens->count; i++) {
        uint32_t token = tokens->tokens[i];
        if (!(token & TOKEN_PLAIN)) continue;
        uint32_t bit_count = token >> TOKEN_PLAIN_BITS & 31;
        pending = pending << bit_count | (token & ((1u << bit_count) - 1));
        pending_count += bit_count;
        while (pending_count >= 8) {
            pending_count -= 8;
            *--at = (uint8_t)(pending >> pending_count & 255);
        }
    }
    if (pending_count) *--at = (uint8_t)(pending << (8 - pending_count) & 255);
    return at;
}

tl_status tli_tokens_write(const tli_tokens *tokens, const tli_table *table, uint32_t state_count,
                           size_t least_bytes, tli_bytes *out)
{
    if (tokens->status) return tokens->status;
    /* A token takes at most 16 bits; a state takes 8 bytes. */
    size_t most = 2 * tokens->count + 8 * RANS_STATES_MAX + 16;
    most = most > least_bytes ? most : least_bytes;
    tl_status st = tli_bytes_reserve(out, most);
    if (st) return st;
    uint8_t *begin = out->bytes + out->count, *end = begin + most;
    uint8_t *plain = write_plain(tokens, end);
    uint8_t *symbols = write_symbols(tokens, table, state_count, plain);
    size_t symbol_bytes = (size_t)(plain - symbols), plain_bytes = (size_t)(end - plain);
    size_t fill = symbol_bytes + plain_bytes;
    fill = fill < least_bytes ? least_bytes - fill : 0;
    memmove(begin, symbols, symbol_bytes);
    memmove(begin + symbol_bytes + fill, plain, plain_bytes);
    memset(begin + symbol_bytes, 0, fill);
    out->count += symbol_bytes + fill + plain_bytes;
    return TL_OK;
}
