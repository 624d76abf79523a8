/* A mesh as patches, cut by planes: what the codec is measured with. */
#ifndef TETRALOD_SRC_CODEC_SPLIT_H
#define TETRALOD_SRC_CODEC_SPLIT_H

#include "codec/codec.h"

typedef struct tli_split {
    size_t patch_count;
    tl_patch **patches;  /* arranged */
    uint32_t **vert_old; /* [patch][vertex] vertex of the mesh */
    uint32_t **tet_old;  /* [patch][tet] */
} tli_split;

/* Patches of at most patch_tets tets, by halving along the longest side of their centroids. */
tl_status tli_split_open(tl_ctx *ctx, const tl_mesh *mesh, const tl_lattice *lattice,
                         uint32_t patch_tets, tli_split *split);
void tli_split_close(tl_ctx *ctx, tli_split *split);

#endif
