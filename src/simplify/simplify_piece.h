/* Stage simplify, internal: a piece of a larger mesh, simplified on its own so that the pieces fit
 * together again: what the whole fixes (scales, steps of places, quadrics and surface distances so
 * far) comes in, what the next coarser mesh needs goes out. Stage model builds its levels of it. */
#ifndef TETRALOD_SRC_SIMPLIFY_PIECE_H
#define TETRALOD_SRC_SIMPLIFY_PIECE_H

#include "mesh/mesh.h"
#include "tetralod/simplify.h"

/* Steps of vertices: a place is a multiple of 2^step along each axis; or it is any number, or any
 * float32. A vertex that moves takes the coarser step of both ends. */
#define TLI_STEP_ANY INT16_MIN
#define TLI_STEP_FLOAT32 (INT16_MIN + 1)

/* Points of a curve of costs. */
enum { TLI_CURVE_POINTS = 64 };

typedef struct tli_piece {
    const tl_mesh *mesh;
    const tl_simplify_opts *opts; /* every channel named; target_tets is where it stops; locked are
                                     the vertices that other pieces have, too, and faces between
                                     these alone count as no surface; boundary_error is a length */
    const double *channel_scales; /* [opts->channel_count] values to cost units, of the whole */
    double scale;                 /* 1 / diagonal of the whole */
    double cost_max;              /* no collapse above this cost; INFINITY: no limit */
    double volume_part;           /* its volume changes by at most this part; INFINITY: no limit */
    const int16_t *steps;         /* [vert_count], or NULL: any place */
    const float *quadrics;        /* [vert_count][tli_quadric_floats], anchored at the vertices, or
                                     NULL: made from the mesh */
    const float *shares;          /* [vert_count] or NULL: weights of the quadrics that are made */
    const float *surface_bounds;  /* [vert_count] mesh units, or NULL: 0 */
} tli_piece;

/* Blocks of tl_mem_alloc; tli_piece_release. */
typedef struct tli_piece_result {
    tl_mesh *mesh;
    tl_lidx *hints;        /* [input vertices] a tet of the result near each, or TL_NONE */
    tl_lidx *origins;      /* [vert_count of mesh] the input vertex that it was */
    uint8_t *fixed;        /* [vert_count] place and values must stay as they are */
    int16_t *steps;        /* [vert_count], NULL if none were given */
    float *quadrics;       /* [vert_count][tli_quadric_floats] */
    float *surface_bounds; /* [vert_count] */
    size_t quadric_floats;
    double costs[TLI_CURVE_POINTS]; /* cost at which (i + 1) / TLI_CURVE_POINTS of the tets were
                                       gone; INFINITY past the end */
} tli_piece_result;

/* One thread: ctx is a fork where a pool's worker calls. Values are those of the quadrics: see
 * tli_refit_at. */
tl_status tli_piece_simplify(tl_ctx *ctx, const tli_piece *piece, tli_piece_result *result);
void tli_piece_release(tl_ctx *ctx, tli_piece_result *result);

/* Floats of a quadric with so many steering components. */
size_t tli_piece_quadric_floats(size_t component_count);
/* Moves the anchor of a quadric from values to other ones, shift [component_count] farther, in cost
 * units. */
void tli_piece_reanchor(float *quadric, const double *shift, size_t component_count);

#endif
