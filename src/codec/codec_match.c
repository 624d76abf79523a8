/* Opposite faces by matching. */
#include "codec/codec_match.h"

tl_status tli_patch_match(tl_ctx *ctx, const tl_patch *patch, tl_lidx **opposite)
{
    tl_status st = TL_OK;
    const uint16_t *from = *patch->tets;
    size_t count = patch->tet_count;
    tl_lidx *tets = tl_mem_alloc(ctx, count, 4 * sizeof *tets, &st);
    if (st) return st;
    for (size_t i = 0; i < 4 * count; i++) tets[i] = from[i];
    st = tl_tets_adjacency(ctx, tets, count, patch->vert_count, opposite, NULL);
    tl_mem_free(ctx, tets);
    return st;
}
