/* The rays for processors with AVX2; the build compiles this file with -mavx2. Elsewhere it is the
 * code for any processor once more. */
#define TLI_CAST_NAME tli_cast_avx2
#include "draw/draw_cast.inc.h"
