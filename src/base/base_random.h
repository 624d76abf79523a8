/* Stage base, internal: numbers that look random and follow from a seed, on every machine alike
 * (splitmix64; Steele, Lea, Flood 2014). */
#ifndef TETRALOD_SRC_BASE_RANDOM_H
#define TETRALOD_SRC_BASE_RANDOM_H

#include <stdint.h>

/* Spreads the bits of z over all of them; 0 stays 0. */
static inline uint64_t tli_mix_bits(uint64_t z)
{
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

/* The next number of the row that a state stands for. */
static inline uint64_t tli_random(uint64_t *state)
{
    return tli_mix_bits(*state += UINT64_C(0x9e3779b97f4a7c15));
}

/* The next one, in [0, 1). */
static inline double tli_uniform(uint64_t *state)
{
    return (double)(tli_random(state) >> 11) * 0x1p-53;
}

#endif
