/* The checksum of the file format: four lanes of eight bytes each, every step of which can be
 * undone, so that damage inside of eight aligned bytes is found for certain and any other with all
 * but a chance of 2^-64. It guards against accidents, not against forgers. */
#include "store/store_format.h"

/* First 64 bits behind the point of the square roots of 2, 3, 5 and 7, made odd. */
#define ROOT_2 0x6a09e667f3bcc909u
#define ROOT_3 0xbb67ae8584caa73bu
#define ROOT_5 0x3c6ef372fe94f82bu
#define ROOT_7 0xa54ff53a5f1d36f1u

#define LANES 4
#define STRIPE_BYTES 32

static uint64_t word_at(const uint8_t *bytes)
{
    uint64_t word = 0;
    for (unsigned i = 0; i < 8; i++) word |= (uint64_t)bytes[i] << 8 * i;
    return word;
}

static uint64_t step(uint64_t lane, uint64_t word)
{
    lane = (lane ^ word) * ROOT_3;
    return lane << 29 | lane >> 35;
}

static uint64_t mix(uint64_t value)
{
    value = (value ^ value >> 32) * ROOT_5;
    value = (value ^ value >> 29) * ROOT_7;
    return value ^ value >> 32;
}

uint64_t tli_store_hash(uint64_t seed, const uint8_t *bytes, size_t byte_count)
{
    uint64_t lanes[LANES] = {seed ^ ROOT_2, seed ^ ROOT_3, seed ^ ROOT_5, seed ^ ROOT_7};
    size_t left = byte_count;
    for (; left >= STRIPE_BYTES; left -= STRIPE_BYTES, bytes += STRIPE_BYTES)
        for (size_t i = 0; i < LANES; i++) lanes[i] = step(lanes[i], word_at(bytes + 8 * i));
    uint8_t last[STRIPE_BYTES] = {0};
    if (left) memcpy(last, bytes, left);
    for (size_t i = 0; 8 * i < left; i++) lanes[i] = step(lanes[i], word_at(last + 8 * i));
    uint64_t hash = seed ^ (uint64_t)byte_count * ROOT_2;
    for (size_t i = 0; i < LANES; i++) hash = mix(hash ^ lanes[i]);
    return hash;
}

uint64_t tli_store_seed(uint64_t identity, tli_store_part part, uint32_t a, uint32_t b)
{
    return mix(mix(identity ^ (uint64_t)part) ^ ((uint64_t)a << 32 | b));
}
