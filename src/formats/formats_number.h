/* Stage formats, internal: numbers in text. Exact, whatever the locale, and without a terminating
 * zero: the text is [at, end). */
#ifndef TETRALOD_SRC_FORMATS_NUMBER_H
#define TETRALOD_SRC_FORMATS_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

/* The place of the first character that is no white space, or end. */
const char *tli_number_skip_space(const char *at, const char *end);

/* Each skips white space, reads one number and returns the place after it. NULL, with *value
 * untouched, if there is none or if it runs into a letter, digit, sign, '.' or '_'. */

/* Correctly rounded (ties to even). Overflow gives infinity, underflow 0 or a subnormal. Takes nan,
 * nan(...), inf and infinity in any case, and d for the e of an exponent as Fortran writes it. */
const char *tli_number_f64(const char *at, const char *end, double *value);
/* Rounded once, from the text to float. */
const char *tli_number_f32(const char *at, const char *end, float *value);
/* An integer; NULL also where it does not fit. */
const char *tli_number_i64(const char *at, const char *end, int64_t *value);

#endif
