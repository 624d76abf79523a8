/* The tables and the memory of the cut-border. */
#include "codec/codec_border.h"

/* Rows of corners that are no corner of the face are not used. */
const uint8_t tli_border_corners[4][4][3] = {{{0}, {1, 2, 3}, {2, 3, 1}, {3, 1, 2}},
                                             {{0, 3, 2}, {0}, {2, 0, 3}, {3, 2, 0}},
                                             {{0, 1, 3}, {1, 3, 0}, {0}, {3, 0, 1}},
                                             {{0, 2, 1}, {1, 0, 2}, {2, 1, 0}, {0}}};

tl_status tli_border_open(tl_ctx *ctx, uint32_t vert_capacity, uint32_t tet_capacity,
                          tli_border *border)
{
    tl_status st = TL_OK;
    size_t words = ((size_t)vert_capacity + 63) / 64;
    *border = (tli_border){.vert_capacity = vert_capacity, .tet_capacity = tet_capacity};
    border->tets = tl_mem_alloc(ctx, tet_capacity, 4 * sizeof *border->tets, &st);
    border->opposite = tl_mem_alloc(ctx, tet_capacity, 4 * sizeof *border->opposite, &st);
    border->fans = tl_mem_alloc(ctx, tet_capacity, 16 * sizeof *border->fans, &st);
    border->next = tl_mem_alloc(ctx, tet_capacity, 4 * sizeof *border->next, &st);
    border->head = tl_mem_alloc(ctx, vert_capacity, sizeof *border->head, &st);
    border->tail = tl_mem_alloc(ctx, vert_capacity, sizeof *border->tail, &st);
    border->waiting = tl_mem_zalloc(ctx, words, sizeof *border->waiting, &st);
    if (!st)
        for (uint32_t v = 0; v < vert_capacity; v++) border->head[v] = TL_NONE;
    return st;
}

void tli_border_close(tl_ctx *ctx, tli_border *border)
{
    tl_mem_free(ctx, border->fans);
    tl_mem_free(ctx, border->next);
    tl_mem_free(ctx, border->head);
    tl_mem_free(ctx, border->tail);
    tl_mem_free(ctx, border->waiting);
}
