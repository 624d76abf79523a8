/* The tets that a vertex is the newest vertex of: once the connectivity is known, they tell what is
 * around it and was there before it. Prediction of places and values, the same for coder and
 * decoder. */
#ifndef TETRALOD_SRC_CODEC_KIN_H
#define TETRALOD_SRC_CODEC_KIN_H

#include "codec/codec_topology.h"

/* One of a vertex's kin: the face opposite the vertex, in the order of the corners after the
 * vertex's own, and the elder vertex beyond it, or ELDER_NONE. */
#define ELDER_NONE 0xffffu
typedef struct tli_relative {
    uint16_t face[3], elder;
} tli_relative;

typedef struct tli_kin {
    uint32_t *begin;         /* [vert_count + 1] into relatives */
    tli_relative *relatives; /* of one vertex after the other, in the order of the tets */
} tli_kin;

/* Of more kin, the first are asked, for places and for values: more say nothing new. */
#define PLACE_KIN_MAX 6u
#define VALUE_KIN_MAX 3u

/* patch has its opposite faces. Tets with a vertex twice are no kin. */
tl_status tli_kin_open(tl_ctx *ctx, const tl_patch *patch, tli_kin *kin);
void tli_kin_close(tl_ctx *ctx, tli_kin *kin);

/* How many kin are asked. */
static inline uint32_t kin_count(const tli_kin *kin, uint32_t vertex, uint32_t most)
{
    uint32_t count = kin->begin[vertex + 1] - kin->begin[vertex];
    return count < most ? count : most;
}

/* What is expected of the place of a vertex whose elders have theirs. */
typedef struct tli_guess {
    uint64_t at[3];     /* image */
    uint32_t around[3]; /* bits of the extent of what it was made of */
    uint32_t group;     /* how good it is: 0 best, 2 worst */
    uint32_t kin_count;
    const tli_relative *first; /* of the kin; NULL: there is none */
    bool has_elder;            /* the first has */
} tli_guess;

/* Other guesses, which are exact in grids of hexahedra that were split: mode 0 is guess->at itself.
 * For others the guess has an elder. */
#define GUESS_MODES 12u

/* Nearest whole number; of numbers beyond 2^51 one nearby. */
static inline int64_t kin_round(double x)
{
    const double lift = 0x1.8p52; /* no fraction is left above it */
    return (int64_t)(x + lift - lift);
}

/* The mean of the mirrored elders or, without any, of the faces. Arithmetic wraps around, so that
 * images of any size work. */
void tli_kin_place(const tli_kin *kin, uint32_t vertex, const int64_t (*places)[3],
                   tli_guess *guess);

/* The guess of a mode along an axis. */
static inline uint64_t kin_guess(const tli_guess *guess, uint32_t mode, const int64_t (*places)[3],
                                 int axis)
{
    /* Of the first kin's elder and face. Mode 1, the corner of a cell beyond the tet in its middle:
     * halved; 2: the way back; 3 to 5: beyond the side of a cell; 6 to 8: parallelogram with the
     * face; 9 to 11: with two of its vertices and the elder. */
    static const int8_t weights[GUESS_MODES][4] = {
        {0, 0, 0, 0},  {-1, 1, 1, 1}, {-2, 1, 1, 1}, {-1, 2, 0, 0}, {-1, 0, 2, 0}, {-1, 0, 0, 2},
        {0, -1, 1, 1}, {0, 1, -1, 1}, {0, 1, 1, -1}, {-1, 0, 1, 1}, {-1, 1, 0, 1}, {-1, 1, 1, 0}};
    if (mode == 0) return guess->at[axis];
    const int8_t *weight = weights[mode];
    uint64_t base = (uint64_t)places[guess->first->elder][axis];
    uint64_t sum = (uint64_t)(int64_t)weight[0] * base;
    for (int c = 0; c < 3; c++)
        sum += (uint64_t)(int64_t)weight[1 + c] * (uint64_t)places[guess->first->face[c]][axis];
    if (mode == 1) return base + (uint64_t)topology_shifted((int64_t)(sum - 2 * base), 1);
    return sum;
}

#endif
