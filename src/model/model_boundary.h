/* Stage model, internal: how far the boundary of a segment's result is from the original one. */
#ifndef TETRALOD_SRC_MODEL_BOUNDARY_H
#define TETRALOD_SRC_MODEL_BOUNDARY_H

#include "measure/measure.h"
#include "model/model.h"

typedef struct tli_boundary {
    tl_ctx *ctx;
    tli_surface before;  /* what stands for the original boundary; no vertices: it is not needed */
    double spread;       /* how far that is from the original at most, mesh units */
    tli_surface after;   /* of the new mesh */
    tl_lidx *tet_of;     /* [after.triangle_count] */
    uint8_t *outer;      /* [tet_count] of the new mesh: bit f, face f is boundary */
    tli_reach reach;     /* from before to after */
    uint8_t *is_near;    /* [after.triangle_count] takes the place of original ones */
    uint8_t *goes;       /* [before.triangle_count] has lost its place */
    double spread_after; /* as spread, of what stands for the original from now on */
    double least;        /* pieces this small are not cut, mesh units */
    double error;        /* how far the two boundaries are apart at most, mesh units */
} tli_boundary;

/* Finds the boundary of the new mesh, whose adjacency is opposite, and measures it. To be released
 * also after a failure. */
tl_status tli_boundary_measure(tl_ctx *ctx, const tli_level *level, const tli_segment_note *segment,
                               const tli_weld *weld, const tli_piece_result *piece,
                               const tl_lidx *opposite, tli_boundary *boundary);
/* Deals what stands for the original boundary from now on, each piece to the part whose boundary is
 * nearest, and cuts pieces where parts of different labels meet. part [tet_count] of the new mesh,
 * label of each part. */
tl_status tli_boundary_deal(const tli_boundary *boundary, const uint32_t *part,
                            const uint32_t *label, tli_dealer *dealer);
void tli_boundary_release(tli_boundary *boundary);

#endif
