/* Stage simplify, internal: the ball of tets around a vertex that may go, and what it tells about
 * moving the vertex into each of its neighbours. */
#ifndef TETRALOD_SRC_SIMPLIFY_THIN_H
#define TETRALOD_SRC_SIMPLIFY_THIN_H

#include "simplify/simplify_work.h"

/* Larger balls are left to the other collapses. Vertices fit the bits of a word. */
enum { TLI_BALL_LANES = 8, TLI_BALL_TETS = 80, TLI_BALL_VERTS = 48 };
enum { TLI_BALL_PLANES = 8 };

/* Neighbours have local numbers. Arrays are padded to whole lanes. */
typedef struct tli_ball {
    tl_lidx centre;
    tl_lidx first, span; /* numbers of the vertices that the worker may look at */
    tl_lidx verts[3 * TLI_BALL_TETS + 1];
    uint32_t vert_count;
    tl_lidx tets[TLI_BALL_TETS];
    uint32_t tet_count;
    int32_t corners[3][TLI_BALL_TETS + TLI_BALL_LANES]; /* so that centre and they are positive */

    float places[TLI_BALL_VERTS + TLI_BALL_LANES][4]; /* from the centre, in diagonals */
    float costs[TLI_BALL_VERTS + TLI_BALL_LANES];     /* of the move into each neighbour */
    float worst;    /* least mean ratio, cubed, of the tets; set with the planes */
    float inv_size; /* 1 / the distance of the farthest neighbour */
    /* Of the faces opposite the centre, in sizes of the ball: area normal and its product with a
     * corner; twice the sum of the corners, and the squares of the edges from the centre */
    float planes[TLI_BALL_PLANES][TLI_BALL_TETS + TLI_BALL_LANES];
} tli_ball;

/* Compiled once for each instruction set, with the same bytes from each. */
typedef struct tli_thin_kernel {
    /* Sets places and costs (INFINITY for neighbours that are not inner); returns the least cost.
     */
    float (*weigh)(const tli_work *work, const uint8_t *inner, tli_ball *ball);
    /* Sets the planes; the ball must be weighed. */
    void (*look)(tli_ball *ball);
    /* Are all tets between the faces and neighbour number to surely positive, with a mean ratio,
     * cubed, of at least quality? The ball must have been looked at. */
    bool (*fits)(const tli_ball *ball, uint32_t to, float quality);
} tli_thin_kernel;
extern const tli_thin_kernel tli_thin_base, tli_thin_avx2;
const tli_thin_kernel *tli_thin_best(void);

#endif
