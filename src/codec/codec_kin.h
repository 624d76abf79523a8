/* The tets that a vertex is the newest vertex of: once the connectivity is known, they tell what is
 * around it and was there before it. Prediction of places and values, the same for coder and
 * decoder. */
#ifndef TETRALOD_SRC_CODEC_KIN_H
#define TETRALOD_SRC_CODEC_KIN_H

#include "codec/codec_topology.h"

typedef struct tli_kin {
    const tl_patch *patch; /* tets and opposite */
    uint32_t *first;       /* [vertex] a tet, or TL_NONE */
    uint32_t *next;        /* [tet] */
    uint32_t *seen;        /* [vertex] by which vertex it was counted last */
} tli_kin;

/* patch is borrowed and has its opposite faces. Tets with a vertex twice are no kin. */
tl_status tli_kin_open(tl_ctx *ctx, const tl_patch *patch, tli_kin *kin);
void tli_kin_close(tl_ctx *ctx, tli_kin *kin);

static inline uint32_t kin_corner(const uint16_t tet[4], uint32_t vertex)
{
    return tet[3] == vertex ? 3 : tet[2] == vertex ? 2 : tet[1] == vertex ? 1 : 0;
}

/* What is expected of the place of a vertex whose elders have theirs. */
typedef struct tli_guess {
    uint64_t at[3];     /* image */
    uint32_t around[3]; /* bits of the extent of what it was made of */
    uint32_t group;     /* how good it is: 0 best, 2 worst */
    uint32_t kin_count;
    uint32_t face[3], elder; /* of the first kin; elder TL_NONE: there is none */
} tli_guess;
void tli_kin_place(const tli_kin *kin, uint32_t vertex, const int64_t (*places)[3],
                   tli_guess *guess);

/* Other guesses, which are exact in grids of hexahedra that were split: mode 0 is guess->at itself.
 * For others the guess has an elder. */
#define GUESS_MODES 12u
static inline uint64_t kin_guess(const tli_guess *guess, uint32_t mode, const int64_t (*places)[3],
                                 int axis)
{
    if (mode == 0) return guess->at[axis];
    uint64_t f[3], w = (uint64_t)places[guess->elder][axis], sum;
    for (int c = 0; c < 3; c++) f[c] = (uint64_t)places[guess->face[c]][axis];
    sum = f[0] + f[1] + f[2];
    switch (mode) {
    case 1: /* corner of a cell beyond the tet in its middle: half of sum - w */
        return w + (uint64_t)topology_shifted((int64_t)(sum - 3 * w), 1);
    case 2: return sum - 2 * w; /* and the way back */
    case 3:
    case 4:
    case 5: return 2 * f[mode - 3] - w; /* beyond the side of a cell */
    case 6:
    case 7:
    case 8: return sum - 2 * f[mode - 6]; /* parallelogram with the face */
    case 9:
    case 10:
    case 11: return sum - f[mode - 9] - w; /* with two of its vertices and the elder */
    default: return 0;
    }
}

#endif
