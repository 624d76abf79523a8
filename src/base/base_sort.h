/* Stage base, internal: stable radix sorts and space-filling order. */
#ifndef TETRALOD_SRC_BASE_SORT_H
#define TETRALOD_SRC_BASE_SORT_H

#include <string.h>

#include "base/base.h"

/* Sorts keys [count] ascending and applies the same permutation to values [count] (may be NULL).
 * Stable; runs on the pool; digits that are equal in all keys cost one pass of reading only. */
tl_status tli_sort_u64(tl_ctx *ctx, uint64_t *keys, uint32_t *values, size_t count);
tl_status tli_sort_u32(tl_ctx *ctx, uint32_t *keys, uint32_t *values, size_t count);

/* A key whose order is that of the value, and the value back; NaN at the ends. */
static inline uint64_t tli_sort_key(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits >> 63 ? ~bits : bits | UINT64_C(1) << 63;
}

static inline double tli_sort_value(uint64_t key)
{
    double value;
    key = key >> 63 ? key & ~(UINT64_C(1) << 63) : ~key;
    memcpy(&value, &key, sizeof value);
    return value;
}

/* order [count] receives the vertices in Hilbert order of their positions in the bounding box of
 * all (21 bits an axis); ties by index. Positions that are not finite come last. */
tl_status tli_sort_hilbert(tl_ctx *ctx, const double *xyz, size_t vert_count, uint32_t *order);

#endif
