/* The tets that a vertex is the newest vertex of: once the connectivity is known, they tell what is
 * around it and was there before it. Prediction of places and values, the same for coder and
 * decoder. */
#ifndef TETRALOD_SRC_CODEC_KIN_H
#define TETRALOD_SRC_CODEC_KIN_H

#include "codec/codec.h"

typedef struct tli_kin {
    const tl_patch *patch; /* tets and opposite */
    uint32_t *first;       /* [vertex] a tet, or TL_NONE */
    uint32_t *next;        /* [tet] */
} tli_kin;

/* patch is borrowed and has its opposite faces. Tets with a vertex twice are no kin. */
tl_status tli_kin_open(tl_ctx *ctx, const tl_patch *patch, tli_kin *kin);
void tli_kin_close(tl_ctx *ctx, tli_kin *kin);

/* What is expected of the place of a vertex whose elders have theirs. */
typedef struct tli_guess {
    uint64_t at[3];     /* image */
    uint32_t around[3]; /* bits of the extent of what it was made of */
    uint32_t group;     /* how good it is: 0 best */
} tli_guess;
void tli_kin_place(const tli_kin *kin, uint32_t vertex, const int64_t (*places)[3],
                   tli_guess *guess);

#endif
