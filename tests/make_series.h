/* Series of numbered files in the working folder: a bump that moves along x from step to step. */
#ifndef TETRALOD_TESTS_MAKE_SERIES_H
#define TETRALOD_TESTS_MAKE_SERIES_H

#include <stdio.h>

#include "tetralod/formats.h"

#include "check_ctx.h"
#include "make_mesh.h"

/* "NAME_0007.vtu"; the text holds until the next call. */
static inline const char *series_path(const char *name, unsigned number)
{
    static char path[200];
    snprintf(path, sizeof path, "%s_%04u.vtu", name, number);
    return path;
}

static inline double series_value(const double x[3], unsigned number)
{
    const double along = x[0] - 0.1 * number;
    return exp(-8 * along * along) + 0.25 * x[1] + 0.1 * x[2];
}

/* A grid of size^3 vertices with "T". */
static inline tl_mesh *series_mesh(tl_ctx *ctx, size_t size, unsigned number)
{
    make_mesh m = make_grid(size);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    double *t = malloc(m.vert_count * sizeof *t);
    if (!t) abort();
    for (size_t v = 0; v < m.vert_count; v++) t[v] = series_value(m.xyz + 3 * v, number);
    const tl_channel channel = {"T", "K", 1, TL_ON_VERTEX, TL_F64, t};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    free(t);
    make_release(&m);
    return mesh;
}

static inline void series_write(const char *name, size_t size, const unsigned *numbers,
                                size_t count)
{
    tl_ctx *ctx = check_ctx_create(1);
    for (size_t i = 0; i < count; i++) {
        tl_mesh *mesh = series_mesh(ctx, size, numbers[i]);
        CHECK_OK(ctx, tl_mesh_write(ctx, mesh, series_path(name, numbers[i]), NULL));
        tl_mesh_destroy(mesh);
    }
    check_ctx_destroy(ctx);
}

#endif
