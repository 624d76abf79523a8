/* Stage base, internal: vectors of three numbers. Inlined into formulas, so without the prefix of
 * shared functions. */
#ifndef TETRALOD_SRC_BASE_VEC_H
#define TETRALOD_SRC_BASE_VEC_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

static inline double vec_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double vec_length(const double a[3])
{
    return sqrt(vec_dot(a, a));
}

/* out = a - b */
static inline void vec_sub(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) out[k] = a[k] - b[k];
}

/* Of a place: -0 is at the place of 0. */
static inline uint64_t vec_hash(const double x[3])
{
    uint64_t h = 0, bits;
    for (int k = 0; k < 3; k++) {
        double positive = x[k] + 0.0;
        memcpy(&bits, &positive, sizeof bits);
        h = (h ^ bits) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
    }
    return h;
}

static inline void vec_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline bool vec_is_finite(const double a[3])
{
    return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]);
}

#endif
