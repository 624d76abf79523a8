/* The cost kernel for processors with AVX2; the build compiles this file with -mavx2. Elsewhere it
 * is the kernel for any processor once more. */
#define TLI_COST_NAME tli_cost_avx2
#define TLI_SHAPES_NAME tli_shapes_avx2
#include "simplify/simplify_cost.inc.h"
