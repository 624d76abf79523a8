/* Stage simplify, internal: from the working mesh to the result, and the values of its channels. */
#ifndef TETRALOD_SRC_SIMPLIFY_PACK_H
#define TETRALOD_SRC_SIMPLIFY_PACK_H

#include "simplify/simplify_work.h"

/* New numbers of what is left. */
typedef struct tli_packed {
    tl_lidx *vert_of; /* [work->vert_count], TL_NONE when gone */
    tl_lidx *tet_of;  /* [work->tet_count] */
    size_t vert_count, tet_count;
    tl_lidx *hints;
} tli_packed;

/* Gives the mesh and hints [input vertices]: a tet of it near each original vertex. simplify_pack.c
 */
tl_status tli_pack(const tli_work *work, const tl_mesh *mesh, const tl_simplify_opts *opts,
                   const double *channel_scales, tl_mesh **out, tl_lidx **hints);

/* Refits the vertex channels of a simplified mesh by least squares over the original vertices;
 * vertices with keep[v] != 0 and channels with held[i] != 0 stay. opposite is the adjacency of out,
 * hints as given by tli_pack, work as it was then. Values of out change in place. simplify_refit.c
 */
tl_status tli_refit(const tli_work *work, const tl_mesh *original, tl_mesh *out,
                    const tl_lidx *opposite, const tl_lidx *hints, const uint8_t *keep,
                    const uint8_t *held);

/* Tet channels of floating-point type become volume-weighted means over the original tets whose
 * centroids lie in each new one. simplify_refit.c */
tl_status tli_average_tets(tl_ctx *ctx, const tl_mesh *original, tl_mesh *out,
                           const tl_locator *locator, const tl_lidx *hints);

#endif
