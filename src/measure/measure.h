/* Stage measure, internal: errors at the original's vertices as stage simplify needs them, and the
 * parts of tl_mesh_compare: surfaces, their distance, isosurfaces. */
#ifndef TETRALOD_SRC_MEASURE_H
#define TETRALOD_SRC_MEASURE_H

#include <math.h>

#include "base/base.h"
#include "mesh/mesh.h"
#include "tetralod/measure.h"

/* ---- fields ---- */

/* Locates every original vertex in the copy: the tet that holds it or, outside, the nearest one.
 * hints   [vert_count] a tet of the copy near each vertex (TL_NONE: unknown), or NULL
 * tets    [vert_count] or NULL; TL_NONE for a vertex that no tet uses or that is not finite
 * weights [vert_count][4] or NULL; barycentric weights in that tet, of the nearest point outside;
 *         0 where tets is TL_NONE
 * outside_distance [vert_count] or NULL; mesh units, 0 inside and where tets is TL_NONE
 * A copy vertex with the same number at the same place counts as the same vertex. The result does
 * not depend on the number of threads. TL_ERR_DATA for a copy without tets. */
tl_status tli_measure_vertices(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                               const tl_locator *copy_locator, const tl_lidx *hints, tl_lidx *tets,
                               double (*weights)[4], double *outside_distance);

/* The error of a channel on vertices at the vertices located by tli_measure_vertices. channel is
 * the original's, copy_channel the one of the copy, with as many components.
 *
 * errors [vert_count] or NULL: the norm of the difference, 0 where nothing is measured.
 *
 * error receives name, components, on, rms, max, max_at and nonfinite_count; mean and range are 0.
 */
tl_status tli_measure_channel(tl_ctx *ctx, const tl_mesh *original, const tl_channel *channel,
                              const tl_mesh *copy, const tl_channel *copy_channel,
                              const tl_lidx *tets, const double (*weights)[4], double *errors,
                              tl_field_error *error);

/* All common channels: at the vertices, at the centroids and over the volume; fills fields,
 * field_count, outside_vertices and outside_distance. diagonal is the original's, opposite the
 * adjacency of the copy. measure_field.c */
tl_status tli_measure_fields(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                             const tl_lidx *opposite, double diagonal, tl_compare_result *result);

/* ---- points in tets (measure_vertices.c) ---- */

/* A point of a tet, ready to be interpolated at. */
typedef struct tli_tet_point {
    tl_lidx corners[4];
    double weights[4];
    int base; /* corner with the largest weight */
} tli_tet_point;

tli_tet_point tli_tet_point_make(const tl_lidx corners[4], const double weights[4]);

/* The norm of the difference of two channels with equal components at a point each: exactly 0 where
 * the values at the corners and the weights are equal, infinite where the copy's is not finite. The
 * original's values must be finite. */
double tli_point_error(const tl_channel *original, const tli_tet_point *point,
                       const tl_channel *copy, const tli_tet_point *copy_point);

/* True if all components of element are finite. */
bool tli_channel_finite(const tl_channel *channel, size_t element);

/* The inner half of tli_measure_vertices: order is that of tli_sort_hilbert over the original. */
tl_status tli_locate_vertices(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                              const tl_locator *copy_locator, const uint32_t *order,
                              const tl_lidx *hints, tl_lidx *tets, double (*weights)[4],
                              double *outside_distance);

/* ---- runs (measure_run.c) ---- */

/* tli_parallel over [0, item_count) in some twenty steps, with a report of progress before each and
 * at the end. Pieces are the same as in one call, so begin / grain numbers them. */
tl_status tli_measure_run(tl_ctx *ctx, const char *stage, size_t item_count, size_t grain,
                          tli_range_fn fn, void *arg);

/* ---- surfaces (measure_surface.c) ---- */

/* Four boxes of a packed tree; unused ones are empty. */
typedef struct tli_surface_node {
    double lo[3][4], hi[3][4];
} tli_surface_node;

enum { TLI_SURFACE_LEVELS_MAX = 17 };

/* Triangles along a Hilbert curve, vertices numbered by their first use, and a tree of boxes. */
typedef struct tli_surface {
    tl_ctx *ctx;
    double *xyz; /* [vert_count][3] */
    size_t vert_count;
    tl_lidx *triangles; /* [triangle_count][3] */
    uint32_t *origins;  /* [triangle_count] the triangle that it was */
    size_t triangle_count;
    double area;
    tli_surface_node *nodes; /* level 0 first: child i of node n of level 0 is triangle 4 n + i */
    size_t level_ofs[TLI_SURFACE_LEVELS_MAX];
    unsigned level_count; /* 0 for a surface without triangles */
} tli_surface;

/* Copies the triangles [triangle_count][3] over xyz [vert_count][3], finite. Fills *surface, to be
 * released also after a failure. */
tl_status tli_surface_create(tl_ctx *ctx, const double *xyz, size_t vert_count,
                             const tl_lidx *triangles, size_t triangle_count, tli_surface *surface);
void tli_surface_release(tli_surface *surface);

/* The squared distance of x to the nearest triangle, which *triangle receives. hint is a triangle
 * near x or TL_NONE. Infinite and TL_NONE for a surface without triangles. */
double tli_surface_nearest(const tli_surface *surface, const double x[3], tl_lidx hint,
                           tl_lidx *triangle);
/* The squared distance of x to one triangle. */
double tli_surface_distance2(const tli_surface *surface, tl_lidx triangle, const double x[3]);
double tli_triangle_distance2(const double a[3], const double b[3], const double c[3],
                              const double x[3]);

/* Lists the triangles whose boxes come within reach of the box of three corners; only those that
 * are taken [triangle_count], or all (NULL). Returns their number, or more than room if that is not
 * enough. */
size_t tli_surface_around(const tli_surface *surface, const uint8_t *taken, const double corners[9],
                          double reach, tl_lidx *list, size_t room);

/* Position of a corner of a triangle, and of all of them. */
static inline const double *tli_surface_corner(const tli_surface *surface, size_t triangle, int k)
{
    return surface->xyz + 3 * (size_t)surface->triangles[3 * triangle + (size_t)k];
}
static inline void tli_surface_triangle(const tli_surface *surface, size_t triangle,
                                        double corners[9])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            corners[3 * i + k] = tli_surface_corner(surface, triangle, i)[k];
}

/* ---- distances of surfaces (measure_distance.c) ---- */

typedef struct tli_surface_error {
    double mean;         /* d_M of Sondershaus 2007, 3.1.1 */
    double one_sided[2]; /* d_O both ways: the largest distances found */
    double bound[2];     /* d_O is at most this, apart from rounding */
    size_t samples;
} tli_surface_error;

/* The distance that rounding alone may put a computed point off a surface, mesh units. Distances up
 * to this are taken for 0, so that identical surfaces are exactly that. */
double tli_surface_rounding(const tli_surface *a, const tli_surface *b);
/* A squared distance to a distance. */
static inline double tli_surface_distance(double distance2, double rounding)
{
    double distance = sqrt(distance2);
    return distance > rounding ? distance : 0;
}

/* Both ways between two surfaces, with samples at most step apart. Progress is reported as stage.
 */
tl_status tli_surface_compare(tl_ctx *ctx, const char *stage, const tli_surface *a,
                              const tli_surface *b, double step, tli_surface_error *error);

/* How far a triangle is from a surface at most (measure_bound.c). Starts from the distances of its
 * corners and from a value found already, and cuts the triangle up until what may lie above is
 * within tolerance, or split_max cuts are made. */
typedef struct tli_bound_query {
    const tli_surface *from, *to;
    const double *distances;   /* [from->vert_count] of its vertices to the other surface */
    const tl_lidx *nearest;    /* [from->vert_count] the triangles of those */
    double found;              /* largest distance known before */
    double tolerance;          /* gap that is accepted, mesh units */
    double tolerance_relative; /* the same, of the largest distance found */
    double rounding;           /* distances up to this are 0: see tli_surface_rounding */
    unsigned split_max;
    uint64_t *splits_left; /* of all triangles together; NULL: no limit */
} tli_bound_query;
/* *found: largest distance found in this triangle, at least query->found; *bound: no point of the
 * triangle is farther than that, at least *found. */
void tli_surface_bound(const tli_bound_query *query, size_t triangle, double *found, double *bound);

/* Triangles of a surface with labels, and where those meet. */
typedef struct tli_deal_query {
    const tli_surface *to;
    const uint32_t *labels; /* [to->triangle_count] */
    const uint8_t *borders; /* [to->triangle_count] bit i: the side from corner i to the next one
                               does not lie between triangles of one label */
    double least;           /* pieces up to this size are not cut, mesh units */
    uint64_t splits_left;   /* cuts of all triangles together */
} tli_deal_query;
/* Called with the corners of a piece of a triangle and the triangle of the other surface that it
 * goes to. */
typedef tl_status (*tli_piece_fn)(void *user, const double corners[9], tl_lidx to);
/* Cuts a triangle of query->from where labels meet. A piece goes to the triangle that is nearest to
 * its centre or, over several labels, that all of it is nearest to. */
tl_status tli_surface_deal(const tli_bound_query *query, tli_deal_query *deal, size_t triangle,
                           tli_piece_fn fn, void *user);

/* No point of the triangle is farther from a surface than the result, which is at most most, or
 * infinite where that was not to be shown. Of the surface those triangles count alone that are
 * taken [to->triangle_count], or all of them (NULL). measure_cover.c */
double tli_surface_cover(const tli_surface *to, const uint8_t *taken, const double corners[9],
                         double most);

/* How far a surface is from another one at most, for one thread (measure_reach.c). */
typedef struct tli_reach {
    tl_ctx *ctx;
    double *distances;
    tl_lidx *nearest;
    tli_bound_query query; /* of the arrays above; found: the largest distance found so far */
    const uint8_t *left_out;
    uint64_t splits_left;
    double bound; /* no point looked at is farther, apart from rounding */
} tli_reach;
/* Measures the vertices of all triangles but those that are left out [from->triangle_count]. from,
 * to, which has triangles, and left_out are borrowed. Distances up to gap, mesh units, make no
 * difference. To be released also after a failure. */
tl_status tli_reach_create(tl_ctx *ctx, const tli_surface *from, const tli_surface *to,
                           const uint8_t *left_out, double gap, tli_reach *reach);
/* The bound: within gap or a tenth of query.found, which it raises. */
void tli_reach_bound(tli_reach *reach);
void tli_reach_release(tli_reach *reach);

/* ---- isosurfaces (measure_iso.c) ---- */

/* The isosurface of a scalar channel on vertices by marching tets; tets with a value that is not
 * finite are left out. Fills *surface, to be released also after a failure. */
tl_status tli_iso_surface(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel, double value,
                          tli_surface *surface);

#endif
