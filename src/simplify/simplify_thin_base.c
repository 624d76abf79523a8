/* The kernel of the thinning for any processor. */
#define TLI_THIN_NAME tli_thin_base
#include "simplify/simplify_thin.inc.h"

const tli_thin_kernel *tli_thin_best(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) return &tli_thin_avx2;
#endif
    return &tli_thin_base;
}
