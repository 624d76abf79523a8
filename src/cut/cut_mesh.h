/* Stage cut, internal: meshes of patches. */
#ifndef TETRALOD_SRC_CUT_MESH_H
#define TETRALOD_SRC_CUT_MESH_H

#include "tetralod/cut.h"

/* tl_cut_mesh of some patches of a cut, in any order. The context may be another than the store's.
 */
tl_status tli_patches_mesh(tl_ctx *ctx, tl_store *store, const uint32_t *patches,
                           size_t patch_count, const size_t *channels, size_t channel_count,
                           tl_mesh **mesh);

#endif
