/* Stage view, internal: lines through a mesh, tet by tet, and what is met on them. */
#ifndef TETRALOD_SRC_VIEW_RAY_H
#define TETRALOD_SRC_VIEW_RAY_H

#include "tetralod/draw.h"

/* A line: places are origin + t * direction, direction of length 1, t from least on. */
typedef struct tli_sight {
    double origin[3], direction[3];
    double least; /* mesh units: 0 of perspective, -infinity of a parallel view */
} tli_sight;

/* The part of a line in a tet. */
typedef struct tli_span {
    tl_lidx tet;
    double t[2];          /* where it comes in and goes out, mesh units */
    double weights[2][4]; /* barycentric ones there, never negative */
} tli_span;
/* Return false to end. */
typedef bool (*tli_span_fn)(void *user, const tli_span *span);

/* Calls fn for the tets that a line passes, by where it comes in; a long span may come in several
 * parts. What the line only touches is left out, as are flat tets. bounds of the mesh: x0, x1, y0,
 * y1, z0, z1. locator: of this mesh. */
tl_status tli_sight_walk(tl_ctx *ctx, const tl_mesh *mesh, const tl_locator *locator,
                         const double bounds[6], const tli_sight *sight, tli_span_fn fn,
                         void *user);

/* A channel as a volume shows it. */
typedef struct tli_fog {
    const double *scalar; /* [vert_count]; NULL: there is no volume */
    const tl_transfer *transfer;
} tli_fog;
/* A thin thing on a line, that hides some of what is behind it. */
typedef struct tli_veil {
    double t, depth; /* where; optical depth, -ln(1 - opacity) */
} tli_veil;
/* Where a line has gathered half of the opacity that it gathers from a volume and veils
 * [veil_count] (by t) up to something opaque, at end, or in all (end infinite). *is_hit false: that
 * is less than TLI_SIGHT_SEEN. */
tl_status tli_sight_half(tl_ctx *ctx, const tl_mesh *mesh, const tl_locator *locator,
                         const double bounds[6], const tli_sight *sight, const tli_fog *fog,
                         const tli_veil *veils, size_t veil_count, double end, double *t,
                         bool *is_hit);
#define TLI_SIGHT_SEEN 0.02
/* Where a line passes a triangle; false: it does not. */
bool tli_sight_triangle(const tli_sight *sight, const double corners[3][3], double *t);

/* Where a line meets one of some values of a scalar [vert_count], or, scalar NULL, the mesh, for
 * the first time. */
tl_status tli_sight_meet(tl_ctx *ctx, const tl_mesh *mesh, const tl_locator *locator,
                         const double bounds[6], const tli_sight *sight, const double *scalar,
                         double value, double *t, bool *is_hit);

#endif
