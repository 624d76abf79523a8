/* tetralod, stage measure: how far two meshes are apart: field, space, boundary.
 * Sondershaus 2007, 3.1.1 (errors) and 4.2.5 (mean field error over the vertices). */
#ifndef TETRALOD_MEASURE_H
#define TETRALOD_MEASURE_H

#include "tetralod/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The field error of one channel, in the channel's unit. Of a vector or tensor: the norm of the
 * difference. */
typedef struct tl_field_error {
    const char *name; /* borrows from the first mesh */
    uint32_t components;
    tl_on on;
    double rms;      /* over the original vertices (tets: over their centroids) */
    double max;      /* over the original vertices (tets: over their centroids) */
    size_t max_at;   /* the vertex (tet) of the maximum */
    double mean;     /* integral over the original volume by quadrature, divided by it */
    double range[2]; /* of the original channel; of the norm where it has several components */
    size_t nonfinite_count; /* original values left out because they are not finite */
} tl_field_error;

/* How far an isosurface of the copy is from that of the original, in mesh units. */
typedef struct tl_iso_error {
    const char *channel;
    double value;
    double mean;      /* d_M of 3.1.1 */
    double hausdorff; /* d_H, two-sided, at the samples */
    double area[2];
    size_t samples;
} tl_iso_error;

typedef struct tl_iso_request {
    const char *channel; /* a scalar channel on vertices of both meshes. borrowed */
    double value;
} tl_iso_request;

typedef struct tl_compare_opts {
    size_t struct_bytes;
    const tl_iso_request *isos; /* default NULL. borrowed */
    size_t iso_count;
    bool skip_boundary; /* default false */
    double
        sample_step; /* distance of the boundary and isosurface samples in mesh units; default 0:
                        0.25 % of the diagonal, at least one sample a triangle. Smaller is slower */
} tl_compare_opts;
TL_API tl_compare_opts tl_compare_opts_defaults(void);

typedef struct tl_compare_result {
    tl_field_error *fields; /* [field_count]: channels that both meshes have, by name, place and
                               components */
    size_t field_count;
    size_t outside_vertices; /* original vertices that no tet of the copy holds: they are projected
                                to the nearest point of its boundary */
    double outside_distance; /* the largest distance of such a vertex, mesh units */
    double boundary_mean;    /* d_M between the boundaries, mesh units */
    double boundary_hausdorff; /* d_H, two-sided */
    double boundary_step;      /* the distance of samples used */
    size_t boundary_samples;   /* on both sides together */
    double volume[2];
    double area[2];
    size_t inverted[2];
    size_t degenerate[2];
    size_t nonmanifold_faces[2];
    size_t nonmanifold_edges[2];
    size_t nonmanifold_verts[2];
    size_t components[2];
    double diagonal;    /* of the original */
    tl_iso_error *isos; /* [iso_count] */
    size_t iso_count;
} tl_compare_result;

/* Compares a copy (simplified, decoded, moved) with the original. Runs on the pool; the result does
 * not depend on the number of threads. opts may be NULL. Gives *result, to be released with
 * tl_compare_release before either mesh is destroyed. TL_ERR_DATA for a mesh without tets or with
 * vertices that are not finite; TL_ERR_ARG for an iso request that names no scalar channel of both.
 */
TL_API tl_status tl_mesh_compare(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                                 const tl_compare_opts *opts, tl_compare_result *result);
TL_API void tl_compare_release(tl_ctx *ctx, tl_compare_result *result);

#ifdef __cplusplus
}
#endif
#endif
