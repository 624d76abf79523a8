/* Stage mesh, internal: the struct behind tl_mesh, for the stages below that build and read it
 * fast. */
#ifndef TETRALOD_SRC_MESH_H
#define TETRALOD_SRC_MESH_H

#include "base/base.h"
#include "tetralod/mesh.h"

struct tl_mesh {
    tl_ctx *ctx;
    size_t vert_count, tet_count;
    double *xyz;          /* [vert_count][3] */
    tl_lidx *tets;        /* [tet_count][4] */
    int32_t *regions;     /* [tet_count] or NULL */
    tl_channel *channels; /* name, unit and values owned */
    size_t channel_count;
    double time;
};

/* Corners of the face opposite to corner i, in the order that turns its normal out of a positive
 * tet. */
extern const uint8_t tli_tet_faces[4][3];

/* Copies the corner positions of a tet into p [4][3]. */
static inline void tli_tet_corners(const double *xyz, const tl_lidx *tet, double p[4][3])
{
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) p[i][k] = xyz[3 * (size_t)tet[i] + (size_t)k];
}

/* Adds the qualifier that ISO C before C23 does not add to an array of arrays by itself. */
#define TLI_CORNERS(p) ((const double(*)[3])(p))

#endif
