/* The kernel of the thinning for processors with AVX2; the build compiles this file with -mavx2.
 * Elsewhere it is the kernel for any processor once more. */
#define TLI_THIN_NAME tli_thin_avx2
#include "simplify/simplify_thin.inc.h"
