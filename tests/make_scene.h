/* What tests of pictures draw: a camera before the unit cube, fog of a known extinction, simple
 * surfaces. */
#ifndef TETRALOD_TESTS_MAKE_SCENE_H
#define TETRALOD_TESTS_MAKE_SCENE_H

#include "tetralod/draw.h"

#include "check.h"

enum { MAKE_SIDE = 33 }; /* pixels; odd, so that one ray goes through the middle */

/* Along z through the unit cube, from a distance of 2. */
static inline tl_camera make_camera(bool parallel)
{
    tl_camera c = tl_camera_defaults();
    c.position[0] = c.position[1] = c.focal_point[0] = c.focal_point[1] = 0.5;
    c.position[2] = -2;
    c.focal_point[2] = 0.5;
    c.size_px[0] = c.size_px[1] = MAKE_SIDE;
    c.parallel_scale = parallel ? 0.6 : 0;
    return c;
}

/* Fields: as high as the place, and one everywhere. */
static inline double make_height(const double x[3])
{
    return x[2];
}

static inline double make_quarter(const double x[3])
{
    (void)x;
    return 0.25;
}

/* White fog whose extinction is linear from one value to another. */
static inline tl_transfer *make_fog(tl_ctx *ctx, double low, double low_extinction, double high,
                                    double high_extinction)
{
    static const tl_color_point white = {0, {1, 1, 1}};
    enum { POINTS = 257 };
    tl_opacity_point opacities[POINTS];
    tl_transfer *t = NULL;
    for (int i = 0; i < POINTS; i++) {
        double w = i / (POINTS - 1.0);
        double extinction = low_extinction + w * (high_extinction - low_extinction);
        opacities[i] = (tl_opacity_point){low + w * (high - low), -expm1(-extinction)};
    }
    CHECK_OK(ctx, tl_transfer_create(ctx, &white, 1, opacities, POINTS, 1, &t));
    return t;
}

/* Room for triangles; plain malloc. */
static inline tl_polydata make_triangles(size_t vert_count, size_t cell_count)
{
    tl_polydata p = {.kind = TL_POLY_TRIANGLES, .vert_count = vert_count, .cell_count = cell_count};
    p.xyz = calloc(vert_count + 1, 3 * sizeof *p.xyz);
    p.corners = calloc(cell_count + 1, 3 * sizeof *p.corners);
    if (!p.xyz || !p.corners) abort();
    return p;
}

static inline void make_triangles_release(tl_polydata *p)
{
    free(p->xyz);
    free(p->corners);
}

/* n x n squares of two triangles each; the point (u, v) of 0 .. 1 squared is at
 * origin + u a + v b. */
static inline tl_polydata make_sheet(size_t n, const double origin[3], const double a[3],
                                     const double b[3])
{
    tl_polydata p = make_triangles((n + 1) * (n + 1), 2 * n * n);
    for (size_t i = 0; i < p.vert_count; i++)
        for (size_t k = 0; k < 3; k++)
            p.xyz[3 * i + k] = origin[k] + (double)(i % (n + 1)) / (double)n * a[k] +
                               (double)(i / (n + 1)) / (double)n * b[k];
    for (size_t i = 0; i < n * n; i++) {
        tl_lidx v = (tl_lidx)(i / n * (n + 1) + i % n), w = v + (tl_lidx)n + 1;
        const tl_lidx corners[6] = {v, v + 1, w + 1, v, w + 1, w};
        memcpy(p.corners + 6 * i, corners, sizeof corners);
    }
    return p;
}

/* A sheet bent to a sphere: n squares around and from pole to pole. */
static inline tl_polydata make_sphere(size_t n, const double center[3], double radius)
{
    static const double zero[3] = {0, 0, 0}, u[3] = {1, 0, 0}, v[3] = {0, 1, 0};
    tl_polydata p = make_sheet(n, zero, u, v);
    const double pi = acos(-1);
    for (size_t i = 0; i < p.vert_count; i++) {
        double *x = p.xyz + 3 * i, around = 2 * pi * x[0], down = pi * x[1];
        x[0] = center[0] + radius * cos(around) * sin(down);
        x[1] = center[1] + radius * sin(around) * sin(down);
        x[2] = center[2] + radius * cos(down);
    }
    return p;
}

#endif
