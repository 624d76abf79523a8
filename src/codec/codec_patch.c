/* The patch as an object. */
#include "base/base.h"
#include "tetralod/codec.h"

void tl_patch_destroy(tl_ctx *ctx, tl_patch *patch)
{
    if (!patch) return;
    tl_mem_free(ctx, patch->places);
    tl_mem_free(ctx, patch->tets);
    tl_mem_free(ctx, patch->shared);
    tl_mem_free(ctx, patch->twins);
    tl_mem_free(ctx, patch->regions);
    tl_mem_free(ctx, patch->opposite);
    tl_mem_free(ctx, patch);
}
