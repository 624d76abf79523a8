/* Decoding of streams: symbols by range asymmetric numeral systems (Duda 2013), in states of 64
 * bits that are filled up by words of 32 from the front, and plain bits from the back. Symbols that
 * do not depend on each other have states of their own, so that a processor works on several at
 * once. Symbols are 0 .. 15; a row of a table is the last position of each symbol in [0, 2^15), so
 * that all tables of a class lie in the first-level cache and a symbol is found by one vector
 * comparison. Every symbol has at least one position. */
#ifndef TETRALOD_SRC_CODEC_RANS_H
#define TETRALOD_SRC_CODEC_RANS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#define RANS_SYMBOLS 16
#define RANS_BITS 15
#define RANS_ONE (1u << RANS_BITS)
/* A state is at least this between symbols, and exactly this at the end of the stream. */
#define RANS_LOW (UINT64_C(1) << 31)
#define RANS_STATES_MAX 4u
/* Plain bits that are read at once. */
#define PLAIN_BITS_MAX 56u

typedef struct tli_stream {
    uint64_t states[RANS_STATES_MAX];
    uint32_t state_count;
    const uint8_t *at, *end; /* the next word; the end of the bytes, where plain bits begin */
    uint64_t plain_bits;     /* read so far */
    uint64_t plain_most;     /* that may be asked for without looking */
    bool overrun;            /* more was asked for than is there; zeros were given */
} tli_stream;

static inline uint32_t rans_word(const uint8_t *at)
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static inline uint64_t rans_long_word(const uint8_t *at)
{
    return (uint64_t)rans_word(at) | (uint64_t)rans_word(at + 4) << 32;
}

/* Begins at bytes [byte_count]; false if there are too few. */
static inline bool stream_begin(tli_stream *s, const uint8_t *bytes, size_t byte_count,
                                uint32_t state_count)
{
    *s = (tli_stream){.state_count = state_count, .at = bytes, .end = bytes + byte_count};
    if (byte_count < 8 * (size_t)state_count) return false;
    /* A load of 8 bytes that begins before the stream's own is no load of bits. */
    s->plain_most = 8 * (uint64_t)(byte_count - 8);
    for (uint32_t i = 0; i < state_count; i++, s->at += 8) {
        s->states[i] = (uint64_t)rans_word(s->at) << 32 | rans_word(s->at + 4);
        if (s->states[i] < RANS_LOW) return false;
    }
    return true;
}

/* True if all that was written was read, and nothing else. filled: zero bytes may lie between. */
static inline bool stream_is_done(const tli_stream *s, bool filled)
{
    size_t rest = (size_t)(s->end - s->at), plain_bytes = (size_t)((s->plain_bits + 7) / 8);
    if (s->overrun || plain_bytes > rest || (!filled && plain_bytes != rest)) return false;
    const uint8_t *plain = s->end - plain_bytes;
    for (const uint8_t *at = s->at; at < plain; at++)
        if (*at) return false;
    for (uint32_t i = 0; i < s->state_count; i++)
        if (s->states[i] != RANS_LOW) return false;
    return s->plain_bits % 8 == 0 || !(*plain & ((1u << (8 - s->plain_bits % 8)) - 1));
}

static inline uint32_t stream_symbol(tli_stream *s, uint32_t which, const int16_t row[RANS_SYMBOLS])
{
    uint64_t state = s->states[which];
    uint32_t position = (uint32_t)state & (RANS_ONE - 1);
#if defined(__SSE2__)
    __m128i wanted = _mm_set1_epi16((short)position);
    __m128i low = _mm_cmpgt_epi16(wanted, _mm_loadu_si128((const __m128i *)row));
    __m128i high = _mm_cmpgt_epi16(wanted, _mm_loadu_si128((const __m128i *)(row + 8)));
    uint32_t passed = (uint32_t)_mm_movemask_epi8(_mm_packs_epi16(low, high));
    uint32_t symbol = (uint32_t)__builtin_ctz(~passed);
#else
    uint32_t symbol = 0;
    for (int i = 0; i < RANS_SYMBOLS; i++) symbol += (int)position > row[i];
#endif
    /* In front of the first symbol stands the last one, which ends where positions start again. */
    uint32_t first = ((uint32_t)row[(symbol - 1) & (RANS_SYMBOLS - 1)] + 1) & (RANS_ONE - 1);
    uint32_t width = (uint32_t)row[symbol] + 1 - first;
    state = (state >> RANS_BITS) * width + position - first;
    if (state < RANS_LOW) {
        uint32_t word = 0;
        if (s->end - s->at >= 4) {
            word = rans_word(s->at);
            s->at += 4;
        } else {
            s->overrun = true;
        }
        state = state << 32 | word;
    }
    s->states[which] = state;
    return symbol;
}

/* 1 <= bit_count <= PLAIN_BITS_MAX bits that are not modelled, the first one the highest. */
static inline uint64_t stream_few_bits(tli_stream *s, uint32_t bit_count)
{
    uint64_t bits;
    if (s->plain_bits > s->plain_most) {
        s->overrun = true;
        return 0;
    }
    bits = rans_long_word(s->end - 8 - (s->plain_bits >> 3)) << (s->plain_bits & 7);
    s->plain_bits += bit_count;
    return bits >> (64 - bit_count);
}

/* The same of 0 to 64 bits. */
static inline uint64_t stream_bits(tli_stream *s, uint32_t bit_count)
{
    if (bit_count == 0) return 0;
    if (bit_count <= PLAIN_BITS_MAX) return stream_few_bits(s, bit_count);
    uint64_t high = stream_few_bits(s, bit_count - 32);
    return high << 32 | stream_few_bits(s, 32);
}

#endif
