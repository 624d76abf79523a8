/* The rays for any processor. */
#define TLI_CAST_NAME tli_cast_base
#include "draw/draw_cast.inc.h"

tli_cast_fn tli_cast_best(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) return tli_cast_avx2;
#endif
    return tli_cast_base;
}
