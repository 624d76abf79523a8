/* The walk over a patch that encoder and arrangement share: it meets vertices and tets in the order
 * in which the decoder makes them, and says what the decoder needs to follow. */
#ifndef TETRALOD_SRC_CODEC_WALK_H
#define TETRALOD_SRC_CODEC_WALK_H

#include "codec/codec_tokens.h"

typedef struct tli_walk {
    uint32_t *vert_old; /* [vert_count] for each new index the old one; vertices of no tet last */
    uint32_t *tet_old;  /* [tet_count]; tets with a vertex twice last */
    uint8_t *corners;   /* [tet_count] for each new corner the old one, two bits each, by new tet */
    uint32_t (*opposite)[4]; /* [tet_count] of new faces; a block of tl_mem_alloc */
    uint8_t *on_border;      /* [vert_count] 1 for vertices of faces without a tet beyond */
    uint32_t odd_count;      /* tets with a vertex twice */
    bool
        rematch; /* faces with two tets that turn alike were not linked, they are not in opposite */
} tli_walk;

/* tokens: the connectivity, but for tets with a vertex twice. */
tl_status tli_walk_open(tl_ctx *ctx, const tl_patch *patch, tli_walk *walk, tli_tokens *tokens);
void tli_walk_close(tl_ctx *ctx, tli_walk *walk);

#endif
