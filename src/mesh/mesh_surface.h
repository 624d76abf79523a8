/* Stage mesh, internal: where a surface of triangles is no manifold. */
#ifndef TETRALOD_SRC_MESH_SURFACE_H
#define TETRALOD_SRC_MESH_SURFACE_H

#include "base/base.h"
#include "tetralod/mesh.h"

/* Counts edges with other than two triangles, and vertices without such an edge whose triangles are
 * more than one fan. triangles [triangle_count][3], three different vertices each. */
tl_status tli_surface_nonmanifold(tl_ctx *ctx, const tl_lidx *triangles, size_t triangle_count,
                                  size_t vert_count, size_t *edge_count, size_t *nonmanifold_verts);

#endif
