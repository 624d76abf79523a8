/* Opposite faces of a patch without its border: of what the border can't link. */
#ifndef TETRALOD_SRC_CODEC_MATCH_H
#define TETRALOD_SRC_CODEC_MATCH_H

#include "codec/codec.h"

/* As tl_mesh_adjacency. Gives opposite [tet_count][4]. */
tl_status tli_patch_match(tl_ctx *ctx, const tl_patch *patch, tl_lidx **opposite);

#endif
