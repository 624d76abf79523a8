/* tetralod, stage measure: how far two meshes are apart: field, space, boundary.
 * Sondershaus 2007, 3.1.1 (errors) and 4.2.5 (mean field error over the vertices). */
#ifndef TETRALOD_MEASURE_H
#define TETRALOD_MEASURE_H

#include "tetralod/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The field error of one channel, in the channel's unit. Of a vector or tensor: the norm of the
 * difference. The copy's value is interpolated in its tet that holds the point (any of them where
 * it holds the point several times), outside of all tets in the nearest point of the copy; of a
 * channel on tets it is that tet's value. Vertices of no tet are left out. Infinite where the copy
 * has no finite value at a point at which the original has one. */
typedef struct tl_field_error {
    const char *name; /* borrows from the first mesh */
    uint32_t components;
    tl_on on;
    double rms;      /* over the original vertices (tets: over their centroids) */
    double max;      /* over the original vertices (tets: over their centroids) */
    size_t max_at;   /* the vertex (tet) of the maximum */
    double mean;     /* integral of the error over the original volume, divided by it: the
                        4-point Gauss rule (degree 2) on each original tet, weight |V| */
    double range[2]; /* of the original channel; of the norm where it has several components */
    size_t nonfinite_count; /* original values left out because they are not finite (from the mean:
                               with their tets) */
} tl_field_error;

/* How far an isosurface of the copy is from that of the original, in mesh units. All distances are
 * infinite where only one mesh has the surface, and 0 where none has it. */
typedef struct tl_iso_error {
    const char *channel;    /* borrows from the first mesh */
    double value;           /* in the channel's unit */
    double mean;            /* d_M of 3.1.1 */
    double hausdorff;       /* d_H, two-sided: the largest distance found */
    double hausdorff_bound; /* d_H is at most this, apart from rounding */
    double one_sided[2]; /* d_O original to copy, copy to original: the largest distances found */
    double area[2];      /* original, copy; mesh units squared */
    size_t samples;      /* on both sides together */
} tl_iso_error;

/* An isosurface that is to be compared. */
typedef struct tl_iso_request {
    const char *channel; /* a scalar channel on vertices of both meshes. borrowed */
    double value;        /* finite, in the channel's unit */
} tl_iso_request;

/* What is compared, and how finely. */
typedef struct tl_compare_opts {
    size_t struct_bytes;        /* size of this struct, set by tl_compare_opts_defaults */
    const tl_iso_request *isos; /* [iso_count]; default NULL. borrowed */
    size_t iso_count;
    bool skip_boundary; /* default false; true: what begins with boundary_ stays 0 */
    double sample_step; /* distance of the boundary and isosurface samples in mesh units, at least
                           0.01 % of the larger diagonal; default 0: 0.25 % of it. No point of a
                           surface is farther from the next sample; every corner of a triangle is
                           one. Half the step takes four times the time */
} tl_compare_opts;
TL_API tl_compare_opts tl_compare_opts_defaults(void);

/* How far two meshes are apart. Pairs are original, copy. */
typedef struct tl_compare_result {
    tl_field_error *fields; /* [field_count]: channels that both meshes have, by name, place and
                               components */
    size_t field_count;
    size_t outside_vertices;   /* original vertices farther than 1e-9 of the diagonal from every tet
                                  of the copy: they are projected to its nearest point */
    double outside_distance;   /* the largest distance of any original vertex from the copy, mesh
                                  units */
    double boundary_mean;      /* d_M between the boundaries (3.1.1), mesh units, by the trapezoidal
                                  rule over the samples */
    double boundary_hausdorff; /* d_H, two-sided: the largest distance found, at the samples or in
                                  the search around them */
    double boundary_hausdorff_bound; /* d_H is at most this, apart from rounding: within 1 % of
                                        boundary_hausdorff or 0.1 % of the step unless the search
                                        was cut short */
    double boundary_one_sided[2];    /* d_O original to copy, copy to original, mesh units */
    double boundary_step;            /* the distance of samples used, mesh units */
    size_t boundary_samples;         /* on both sides together */
    double volume[2];                /* from here to components as in tl_mesh_stats */
    double area[2];                  /* of the boundary */
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
 * vertices that are not finite, or whose diagonal overflows; TL_ERR_ARG for an iso request that
 * names no scalar channel of both, or a step out of range; TL_ERR_UNSUPPORTED for a surface of more
 * than 1,431,655,765 triangles; TL_ERR_CANCELLED. *result is empty on failure. */
TL_API tl_status tl_mesh_compare(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                                 const tl_compare_opts *opts, tl_compare_result *result);
/* Frees what hangs on a result and empties it. NULL and an empty result are allowed. */
TL_API void tl_compare_release(tl_ctx *ctx, tl_compare_result *result);

/* ---- one mesh by itself ---- */

/* Value of a channel in a tet, linear between its corners, or that of the tet. weights [4] as of
 * tl_locator_find; out [components]. */
TL_API void tl_channel_at(const tl_mesh *mesh, const tl_channel *channel, tl_lidx tet,
                          const double weights[4], double *out);

enum { TL_STATISTICS_PARTS = 7 };
/* A component of a channel over the volume, linear in each tet; exact apart from rounding where not
 * said otherwise. */
typedef struct tl_statistics {
    double volume;          /* of the tets whose values are finite, mesh units cubed */
    double integral;        /* the channel's unit times mesh units cubed */
    double least, most;     /* 0 if nothing is finite, as are the next ones */
    double mean, deviation; /* deviation: root of the mean squared distance from the mean */
    double parts[TL_STATISTICS_PARTS]; /* values that 1, 5, 25, 50, 75, 95 and 99 percent of the
                                          volume lie below, within a millionth of the range */
} tl_statistics;
/* component: 0 to components - 1, or components: the length, linear between its values at vertices.
 * Volumes count as positive. One thread. TL_ERR_ARG for a larger component; 16 KB of memory.
 * statistics is untouched on failure. */
TL_API tl_status tl_channel_statistics(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                                       uint32_t component, tl_statistics *statistics);

#ifdef __cplusplus
}
#endif
#endif
