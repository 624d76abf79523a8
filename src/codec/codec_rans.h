/* Decoding of symbols: range asymmetric numeral systems (Duda 2013), one state of 64 bits that is
 * filled up by words of 32. Symbols are 0 .. 15; a row of a table is the last position of each
 * symbol in [0, 2^15), so that all tables of a class lie in the first-level cache and a symbol is
 * found by one vector comparison. Every symbol has at least one position. */
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
/* The state is at least this between symbols, and exactly this at the end of the stream. */
#define RANS_LOW (UINT64_C(1) << 31)
/* Bits taken at once where they are not modelled. */
#define RANS_RAW_BITS 16u

typedef struct tli_rans {
    uint64_t state;
    const uint8_t *at, *end;
    bool overrun; /* words were asked for after the last one; zeros were given */
} tli_rans;

static inline uint32_t rans_word(const uint8_t *at)
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static inline void rans_fill(tli_rans *rans)
{
    if (rans->state >= RANS_LOW) return;
    uint32_t word = 0;
    if (rans->end - rans->at >= 4) {
        word = rans_word(rans->at);
        rans->at += 4;
    } else {
        rans->overrun = true;
    }
    rans->state = rans->state << 32 | word;
}

/* Begins at bytes [byte_count]; false if there are too few. */
static inline bool rans_begin(tli_rans *rans, const uint8_t *bytes, size_t byte_count)
{
    *rans = (tli_rans){0, bytes, bytes + byte_count, false};
    if (byte_count < 8) return false;
    rans->state = (uint64_t)rans_word(bytes) << 32 | rans_word(bytes + 4);
    rans->at += 8;
    return rans->state >= RANS_LOW;
}

/* True if all that was written was read, and nothing else. filled: zero bytes may follow. */
static inline bool rans_is_done(const tli_rans *rans, bool filled)
{
    const uint8_t *at = rans->at;
    while (filled && at < rans->end && *at == 0) at++;
    return at == rans->end && !rans->overrun && rans->state == RANS_LOW;
}

static inline uint32_t rans_symbol(tli_rans *rans, const int16_t row[RANS_SYMBOLS])
{
    uint32_t position = (uint32_t)rans->state & (RANS_ONE - 1);
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
    rans->state = (rans->state >> RANS_BITS) * width + position - first;
    rans_fill(rans);
    return symbol;
}

/* bit_count <= 64 bits that are not modelled, the lowest first. */
static inline uint64_t rans_raw(tli_rans *rans, uint32_t bit_count)
{
    uint64_t value = 0;
    for (uint32_t done = 0; done < bit_count;) {
        uint32_t now = bit_count - done < RANS_RAW_BITS ? bit_count - done : RANS_RAW_BITS;
        value |= (rans->state & ((UINT64_C(1) << now) - 1)) << done;
        rans->state >>= now;
        rans_fill(rans);
        done += now;
    }
    return value;
}

#endif
