/* Integers that say when they do not fit. */
#include "base/base.h"

bool tli_mul_size(size_t a, size_t b, size_t *out)
{
    if (b && a > SIZE_MAX / b) return false;
    *out = a * b;
    return true;
}

bool tli_add_size(size_t a, size_t b, size_t *out)
{
    if (a > SIZE_MAX - b) return false;
    *out = a + b;
    return true;
}

bool tli_to_lidx(uint64_t value, tl_lidx *out)
{
    if (value >= TL_NONE) return false; /* TL_NONE is no index */
    *out = (tl_lidx)value;
    return true;
}
