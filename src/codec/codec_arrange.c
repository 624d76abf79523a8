/* The order of arrival. */
#include "codec/codec_match.h"
#include "codec/codec_tell.h"
#include "codec/codec_walk.h"

#include <string.h>

tl_status tli_patch_verify(tl_ctx *ctx, const tl_patch *patch)
{
    if (patch->vert_count > TL_PATCH_VERTS_MAX || patch->tet_count > TL_PATCH_TETS_MAX)
        return tl_fail(ctx, TL_ERR_ARG,
                       "a patch of %u vertices and %u tets; at most %u and %u are possible",
                       patch->vert_count, patch->tet_count, TL_PATCH_VERTS_MAX, TL_PATCH_TETS_MAX);
    for (uint32_t t = 0; t < patch->tet_count; t++)
        for (int c = 0; c < 4; c++)
            if (patch->tets[t][c] >= patch->vert_count)
                return tl_fail(ctx, TL_ERR_ARG, "tet %u of a patch names vertex %u of %u", t,
                               patch->tets[t][c], patch->vert_count);
    return TL_OK;
}

/* The opposite faces, as the walk found them or, where it could not link all, matched anew. */
static tl_status take_opposite(tl_ctx *ctx, tl_patch *patch, tli_walk *walk)
{
    tl_lidx *opposite = NULL;
    tl_mem_free(ctx, patch->opposite);
    patch->opposite = NULL;
    if (walk->rematch) {
        tl_status st = tli_patch_match(ctx, patch, &opposite);
        patch->opposite = (uint32_t(*)[4])(void *)opposite;
        return st;
    }
    patch->opposite = walk->opposite;
    walk->opposite = NULL;
    return TL_OK;
}

/* Applies an order to an array of elements of elem_bytes; spare is as large as the array. */
static void reorder(void *array, size_t elem_bytes, const uint32_t *order, size_t count,
                    void *spare)
{
    if (!array) return;
    memcpy(spare, array, count * elem_bytes);
    for (size_t i = 0; i < count; i++)
        memcpy((char *)array + i * elem_bytes, (const char *)spare + order[i] * elem_bytes,
               elem_bytes);
}

static void reorder_tets(tl_patch *patch, const tli_walk *walk, void *spare)
{
    uint16_t *vert_new = spare, (*old)[4];
    for (uint32_t v = 0; v < patch->vert_count; v++) vert_new[walk->vert_old[v]] = (uint16_t)v;
    old = (uint16_t(*)[4])(void *)(vert_new + TL_PATCH_VERTS_MAX + 1);
    memcpy(old, patch->tets, patch->tet_count * sizeof *old);
    for (uint32_t t = 0; t < patch->tet_count; t++)
        for (int c = 0; c < 4; c++)
            patch->tets[t][c] = vert_new[old[walk->tet_old[t]][walk->corners[t] >> 2 * c & 3]];
}

tl_status tli_patch_arrange(tl_ctx *ctx, tl_patch *patch, uint32_t *vert_order, uint32_t *tet_order)
{
    tli_walk walk = {0};
    tli_tokens tokens;
    tli_tokens_open(ctx, &tokens);
    size_t spare_bytes = (TL_PATCH_VERTS_MAX + 1) * sizeof(uint16_t) + 8 * (size_t)patch->tet_count;
    if (spare_bytes < 24 * (size_t)patch->vert_count) spare_bytes = 24 * (size_t)patch->vert_count;
    tl_status st = tli_patch_verify(ctx, patch);
    void *spare = tl_mem_alloc(ctx, spare_bytes, 1, &st);
    if (!st) st = tli_walk_open(ctx, patch, &walk, &tokens);
    if (!st) {
        reorder_tets(patch, &walk, spare);
        reorder(patch->places, sizeof *patch->places, walk.vert_old, patch->vert_count, spare);
        reorder(patch->shared, 1, walk.vert_old, patch->vert_count, spare);
        reorder(patch->twins, 1, walk.vert_old, patch->vert_count, spare);
        reorder(patch->regions, sizeof *patch->regions, walk.tet_old, patch->tet_count, spare);
        if (vert_order) memcpy(vert_order, walk.vert_old, patch->vert_count * sizeof *vert_order);
        if (tet_order) memcpy(tet_order, walk.tet_old, patch->tet_count * sizeof *tet_order);
        st = take_opposite(ctx, patch, &walk);
    }
    tli_walk_close(ctx, &walk);
    tli_tokens_close(&tokens);
    tl_mem_free(ctx, spare);
    return st;
}
