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

#endif
