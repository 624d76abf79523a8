/* Stage cut, internal: what gradients at the vertices of a patch are summed up of. */
#ifndef TETRALOD_SRC_CUT_GRADIENT_H
#define TETRALOD_SRC_CUT_GRADIENT_H

#include "tetralod/cut.h"

/* Sum of volume times gradient over the tets of a vertex, and of volume; both times 6. */
typedef struct tli_slope {
    double sum[3], volume;
} tli_slope;

/* Adds the tets of a patch to slopes [vert_count]. xyz [vert_count][3], values [vert_count]. */
void tli_slopes_add(const tl_patch *patch, const double *xyz, const double *values,
                    tli_slope *slopes);
/* The mean by volume; 0 where no tet has one. */
void tli_slope_gradient(const tli_slope *slope, double gradient[3]);

#endif
