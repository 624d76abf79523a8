/* Stage store, only for its writing half: the units and grids that short codes refer to. */
#ifndef TETRALOD_SRC_STORE_ROUND_H
#define TETRALOD_SRC_STORE_ROUND_H

#include "store/store_format.h"

/* The unit that is not below value; 0 of 0. */
int tli_unit_above(double value);
/* Smallest code whose value is not below; of NaN and negative numbers: infinite. table
 * [TLI_CODE8_COUNT] of tli_code8_value. */
unsigned tli_code8_above(const double *table, double value);
unsigned tli_code16_above(double value, int unit);
/* Code of the root of a sum of squares, rounded up. */
unsigned tli_square_above(double value, int unit);
/* A grid over the range of a channel with room for what coding and simplifying add. */
void tli_range_grid_make(const double range[2], double codec_error, tli_range_grid *grid);
void tli_range_codes(const tli_range_grid *grid, const float range[2], unsigned codes[2]);
/* A grid over a box, somewhat larger. */
void tli_sphere_grid_make(const double bounds[6], double diagonal, tli_sphere_grid *grid);
/* The smallest sphere around the nearest centre that holds the given one. */
void tli_sphere_codes(const tli_sphere_grid *grid, const double sphere[4], uint32_t centre[3],
                      unsigned *radius);

#endif
