/* tetralod, stage extract: what is drawn of a mesh: slices (isosurfaces, planes), and the fields
 * that are derived of its channels.
 *
 * A surface is a slice: where a scalar on vertices, linear in each tet, has a value. The scalar may
 * be a channel, a component or norm of one, the distance of a plane, or time.
 *
 * What returns a status can also fail for TL_ERR_MEMORY and TL_ERR_BUDGET, and runs on the pool
 * unless it says otherwise. Results do not depend on the number of threads. */
#ifndef TETRALOD_EXTRACT_H
#define TETRALOD_EXTRACT_H

#include "tetralod/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Values that one slice can be taken at. */
#define TL_SLICE_VALUES_MAX 254u

/* Least and largest scalar of blocks of tets, so that slices skip the blocks that have no such
 * value. Immutable. */
typedef struct tl_range_index tl_range_index;
/* scalar [vert_count]; not kept. Gives *ranges. */
TL_API tl_status tl_range_index_create(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                                       tl_range_index **ranges);
/* NULL is allowed. */
TL_API void tl_range_index_destroy(tl_ctx *ctx, tl_range_index *ranges);

typedef struct tl_slice_opts {
    size_t struct_bytes;
    const double *values;         /* [value_count] finite, in any order; borrowed during a call */
    size_t value_count;           /* 1 to TL_SLICE_VALUES_MAX; default 0 */
    const double *gradients;      /* [vert_count][3] of the scalar, for normals; NULL (default): no
                                     normals. borrowed */
    const size_t *channels;       /* [channel_count] channels of the mesh, on vertices, that are
                                     carried along; default none. borrowed */
    size_t channel_count;         /* each costs its values on the vertices of the result */
    const tl_range_index *ranges; /* of the same mesh and scalar; NULL (default): none. borrowed */
} tl_slice_opts;
TL_API tl_slice_opts tl_slice_opts_defaults(void);

/* Triangles where a scalar has one of the values, by marching tetrahedra. scalar [vert_count]; a
 * vertex of just the value counts as above it. Front sides (counterclockwise) and normals look to
 * lower values; across inverted tets the front sides are turned. Vertices are shared: one on each
 * edge that is cut, and at the same place to the bit wherever another mesh has that edge with the
 * same values. Tets with a corner that is not finite are left out. Vertices come in the order of
 * the tets that first have them, triangles in the order of their tets. Gives *triangles. TL_ERR_ARG
 * for options out of range, TL_ERR_UNSUPPORTED for more than 2^32 - 2 cut edges.
 * Sondershaus 2007, chapter 7; Cignoni et al. 1997, section V. */
TL_API tl_status tl_slice_mesh(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                               const tl_slice_opts *opts, tl_polydata **triangles);

/* ---- scalars to slice, fields to look at ---- */

/* out [vert_count]: distance of each vertex from a plane, mesh units, positive on the side of its
 * normal, which need not be one long. TL_ERR_ARG for a normal of no length. */
TL_API tl_status tl_plane_distance(tl_ctx *ctx, const tl_mesh *mesh, const double origin[3],
                                   const double normal[3], double *out);

/* out [vert_count][components][3]: gradient of each component of a channel on vertices, in its unit
 * by mesh units: at a vertex the mean over its tets by volume. 0 where no tet has a volume or is
 * finite. */
TL_API tl_status tl_mesh_gradient(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                                  double *out);

#ifdef __cplusplus
}
#endif
#endif
