/* The cost kernel for any processor, and the choice between the kernels. */
#define TLI_COST_NAME tli_cost_base
#define TLI_SHAPES_NAME tli_shapes_base
#include "simplify/simplify_cost.inc.h"

tli_cost_fn tli_cost_best(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) return tli_cost_avx2;
#endif
    return tli_cost_base;
}

tli_shapes_fn tli_shapes_best(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) return tli_shapes_avx2;
#endif
    return tli_shapes_base;
}
