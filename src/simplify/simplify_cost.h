/* Stage simplify, internal: what an edge would cost. */
#ifndef TETRALOD_SRC_SIMPLIFY_COST_H
#define TETRALOD_SRC_SIMPLIFY_COST_H

#include "simplify/simplify_work.h"

/* Strength of the pull towards the middle of the edge, relative to the trace of the form: keeps the
 * place near the edge where the form does not say where it should be. */
#define TLI_PULL 1e-3
/* Squared distance from the middle, in squared edge lengths, past which the place is no place. */
#define TLI_FAR_AWAY 4.0

/* cost [count] of the edges from u to v [count], at their best places, without a look at the tets
 * around them; INFINITY for one that can never be collapsed. */
typedef void (*tli_cost_fn)(const tli_work *work, tl_lidx u, const tl_lidx *v, size_t count,
                            float *cost);

tli_shapes tli_shapes_base(const float (*corners)[TLI_LOOK], size_t count, float least);
tli_shapes tli_shapes_avx2(const float (*corners)[TLI_LOOK], size_t count, float least);
tli_shapes_fn tli_shapes_best(void);

/* The same bytes from each; tli_cost_best asks the processor. */
void tli_cost_base(const tli_work *work, tl_lidx u, const tl_lidx *v, size_t count, float *cost);
void tli_cost_avx2(const tli_work *work, tl_lidx u, const tl_lidx *v, size_t count, float *cost);
tli_cost_fn tli_cost_best(void);

#endif
