/* Where the numbers beside an axis or a scalar bar stand, and how they are written. */
#ifndef TETRALOD_SRC_DRAW_TICKS_H
#define TETRALOD_SRC_DRAW_TICKS_H

#include <stdbool.h>
#include <stddef.h>

enum { TLI_TICKS_MAX = 64, TLI_TICK_BYTES = 32 };

typedef struct tli_tick {
    double value;
    double at;                  /* 0 to 1 along the axis */
    char label[TLI_TICK_BYTES]; /* UTF-8; "": a small tick without number */
} tli_tick;

/* Ticks of an axis from low to high, finite, low <= high; most: numbers that have room, at least
 * 2. exponent: the labels times 10^exponent are the values; 0 for numbers that read well as they
 * are. One value gives one tick in the middle. Returns the number of ticks. */
size_t tli_ticks(double low, double high, size_t most, tli_tick ticks[TLI_TICKS_MAX],
                 int *exponent);
/* Of a logarithmic axis, 0 < low <= high: labels are the values. */
size_t tli_ticks_log(double low, double high, size_t most, tli_tick ticks[TLI_TICKS_MAX]);
/* "×10⁵"; "" for 0. */
void tli_exponent_text(int exponent, char text[TLI_TICK_BYTES]);

#endif
