/* What the short numbers of the index stand for. Every value is a sum and product of doubles in one
 * fixed order, without contraction, so that all readers get the same bits. */
#include <math.h>

#include "store/store_format.h"

/* 8 bits: 5 of exponent, 3 of mantissa; 16 bits: 6 and 10. The largest finite values are 3.5 and
 * 3.996 units. */
#define MANTISSA_8 3
#define BIAS_8 30
#define MANTISSA_16 10
#define BIAS_16 62

static double small_float(unsigned code, int mantissa_bits, int bias, int unit)
{
    const unsigned one = 1u << mantissa_bits, mantissa = code & (one - 1);
    const int exponent = (int)(code >> mantissa_bits);
    if (exponent) return ldexp((double)(one + mantissa), exponent + unit - bias - mantissa_bits);
    return ldexp((double)mantissa, 1 + unit - bias - mantissa_bits);
}

double tli_code8_value(unsigned code, int unit)
{
    return code >= TLI_CODE8_COUNT - 1 ? INFINITY : small_float(code, MANTISSA_8, BIAS_8, unit);
}

double tli_code16_value(unsigned code, int unit)
{
    return code >= TLI_CODE16_INFINITE ? INFINITY : small_float(code, MANTISSA_16, BIAS_16, unit);
}

double tli_range_value(const tli_range_grid *grid, unsigned code)
{
    if (code == 0) return -INFINITY;
    if (code == 0xffff) return INFINITY;
    return grid->lo + (double)(code - 1) * grid->step;
}

void tli_sphere_value(const tli_sphere_grid *grid, const uint32_t centre[3], unsigned radius,
                      double sphere[4])
{
    for (int k = 0; k < 3; k++) sphere[k] = grid->lo[k] + (double)centre[k] * grid->step;
    sphere[3] = tli_code16_value(radius, grid->unit);
}
