/* Numbers to the short codes of the index: errors up, ranges outwards, spheres around. Each code is
 * searched among the values that readers will get, so that the promise does not hang on how a
 * formula rounds. */
#include <math.h>

#include "mesh/mesh_tree.h" /* tli_float_above, tli_float_below */
#include "store/store_format.h"
#include "store/store_round.h"

/* Spare room of the grid of ranges on both sides, in parts of the range: coarse levels overshoot.
 */
#define RANGE_MARGIN 0.25
/* The same relative to the size of the values: room for their rounding. */
#define RANGE_MARGIN_VALUE 0x1p-30
#define RANGE_STEPS 65533.0
/* Spare room of the grid of centres on both sides, in parts of the diagonal. */
#define SPHERE_MARGIN 0.125
/* Relative rounding of a distance, with room. */
#define ROUNDING 0x1p-48

/* ---- errors ---- */

unsigned tli_code8_above(const double *table, double value)
{
    unsigned low = 0, high = TLI_CODE8_COUNT - 1; /* the answer is in [low, high] */
    if (!(value >= 0)) return high;
    while (low < high) {
        unsigned middle = (low + high) / 2;
        if (table[middle] >= value)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

unsigned tli_code16_above(double value, int unit)
{
    unsigned low = 0, high = TLI_CODE16_INFINITE;
    if (!(value >= 0)) return high;
    while (low < high) {
        unsigned middle = (low + high) / 2;
        if (tli_code16_value(middle, unit) >= value)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

unsigned tli_square_above(double value, int unit)
{
    unsigned code = tli_code16_above(sqrt(value), unit + TLI_SQUARE_EXPONENT);
    for (; code < TLI_CODE16_INFINITE; code++) { /* the root may have been rounded down */
        double root = tli_code16_value(code, unit + TLI_SQUARE_EXPONENT);
        if (root * root >= value) break;
    }
    return code;
}

int tli_unit_above(double value)
{
    int exponent = 0;
    if (!isfinite(value)) return TLI_UNIT_MAX;
    (void)frexp(fabs(value), &exponent);
    return exponent < TLI_UNIT_MIN ? TLI_UNIT_MIN : exponent;
}

/* ---- ranges ---- */

void tli_range_codes(const tli_range_grid *grid, const float range[2], unsigned codes[2])
{
    codes[0] = 0xffff;
    codes[1] = 0;
    if (isnan(range[0]) || isnan(range[1])) return;
    unsigned low = 0, high = 0xfffe; /* largest code whose value is not above */
    while (low < high) {
        unsigned middle = (low + high + 1) / 2;
        if (tli_float_below(tli_range_value(grid, middle)) <= range[0])
            low = middle;
        else
            high = middle - 1;
    }
    codes[0] = low;
    low = 1;
    high = 0xffff; /* smallest code whose value is not below */
    while (low < high) {
        unsigned middle = (low + high) / 2;
        if (tli_float_above(tli_range_value(grid, middle)) >= range[1])
            high = middle;
        else
            low = middle + 1;
    }
    codes[1] = low;
}

void tli_range_grid_make(const double range[2], double codec_error, tli_range_grid *grid)
{
    double size = fmax(fabs(range[0]), fabs(range[1]));
    double margin = RANGE_MARGIN * (range[1] - range[0]) + RANGE_MARGIN_VALUE * size;
    if (isfinite(codec_error)) margin += 4 * codec_error;
    double lo = range[0] - margin, hi = range[1] + margin;
    double step = hi / RANGE_STEPS - lo / RANGE_STEPS;
    if (!isfinite(lo) || !isfinite(step)) { /* at the end of float64: values get no range */
        lo = 0;
        step = 0;
    }
    *grid = (tli_range_grid){.lo = lo, .step = step > 0 ? step : 1};
}

/* ---- spheres ---- */

void tli_sphere_grid_make(const double bounds[6], double diagonal, tli_sphere_grid *grid)
{
    double margin = SPHERE_MARGIN * diagonal;
    int exponent = 0;
    (void)frexp(diagonal + 2 * margin, &exponent); /* 2^exponent is above the size */
    grid->step = ldexp(1, exponent - 32);
    grid->unit = tli_unit_above(diagonal);
    for (int k = 0; k < 3; k++) grid->lo[k] = bounds[2 * k] - margin;
}

void tli_sphere_codes(const tli_sphere_grid *grid, const double sphere[4], uint32_t centre[3],
                      unsigned *radius)
{
    double squares = 0, coded[4];
    for (int k = 0; k < 3; k++) {
        double steps = floor((sphere[k] - grid->lo[k]) / grid->step + 0.5);
        if (!(steps > 0)) steps = 0;
        centre[k] = steps < 0x1p32 ? (uint32_t)steps : UINT32_MAX;
    }
    tli_sphere_value(grid, centre, 0, coded);
    for (int k = 0; k < 3; k++) squares += (sphere[k] - coded[k]) * (sphere[k] - coded[k]);
    const double around = squares == 0 ? sphere[3] : (sphere[3] + sqrt(squares)) * (1 + ROUNDING);
    *radius = tli_code16_above(around, grid->unit);
}
