/* Stage draw, internal: the depth order of tets. */
#ifndef TETRALOD_SRC_DRAW_ORDER_H
#define TETRALOD_SRC_DRAW_ORDER_H

#include "draw/draw.h"

/* What is ordered: the vertices as they stand on a picture of width x height pixels. */
typedef struct tli_order_view {
    const tl_volume *volume;
    const tl_transfer *transfer; /* tets that it shows nothing of are left out */
    const tli_frame *frame;
    const tli_vert *verts;
    uint32_t width, height;
} tli_order_view;

/* Tets that may be seen, farthest first. */
typedef struct tli_order {
    uint32_t *tets; /* [count], a block of tl_mem_alloc */
    size_t count;
    size_t broken; /* tets that came before one behind them, since they hide each other in a ring */
} tli_order;

/* Each tet before all that it hides: neighbours by the side of their face that the camera is on,
 * what is parted by a gap by a ray for each pixel. */
tl_status tli_order_exact(tl_ctx *ctx, const tli_order_view *view, tli_order *order);
/* By the distance of centroids: faster, and wrong where tets differ in size. */
tl_status tli_order_centroids(tl_ctx *ctx, const tli_order_view *view, tli_order *order);

/* Of tets that are parted by gaps: pairs [*count] of the tet behind, in the upper half, and the one
 * in front of it, ascending, each once. Gives *pairs. */
tl_status tli_order_gaps(tl_ctx *ctx, const tli_order_view *view, uint64_t **pairs, size_t *count);

#endif
