/* Stage simplify, internal: least squares for values at the vertices of a mesh, given samples
 * inside of its tets. The normal equations are built once for all channels, in rows that threads
 * work on side by side; sums are taken by pieces, so that they do not depend on threads. */
#ifndef TETRALOD_SRC_SIMPLIFY_NORMAL_H
#define TETRALOD_SRC_SIMPLIFY_NORMAL_H

#include "simplify/simplify_work.h"

/* Samples by the tet that holds them. */
typedef struct tli_samples {
    size_t count;
    tl_lidx *origins;     /* [count] original vertices, ascending within a tet */
    double (*weights)[4]; /* [count] of the corners of the tet */
    uint32_t *starts;     /* [tets + 1] */
} tli_samples;

/* A few rows of the matrix; the entry on the diagonal comes first. */
typedef struct tli_rows tli_rows;

typedef struct tli_normal {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const tli_samples *samples;
    const uint8_t *keep; /* [vertices] those whose values stay: rows without entries */
    tl_lidx *star_starts, *stars;
    tli_rows *rows;
    size_t rows_count;
    double *diagonal; /* [vertices] with the pull towards the values before */
    double *pull;     /* [vertices] */
    double *room;     /* [4][vertices] of the iteration */
    double *load;     /* [vertices] sums of the samples' errors, by weight and stress */
    double *sums;     /* of pieces */
    float *stress;    /* [samples] what a sample counts, 1 or more */
    double *errors;   /* [samples] set by the caller */
} tli_normal;

tl_status tli_normal_open(tl_ctx *ctx, const tl_mesh *mesh, const tli_samples *samples,
                          const uint8_t *keep, tli_normal *normal);
void tli_normal_close(tli_normal *normal);
/* Begins with the errors at hand; every sample counts 1. */
void tli_normal_begin(tli_normal *normal);
/* Sets what a sample counts; its error is the one after the changes so far. */
void tli_normal_set_stress(tli_normal *normal, size_t tet, size_t sample, float stress);
/* change [vertices], of the values, makes the squares of the errors least; at most so many steps.
 */
tl_status tli_normal_solve(tli_normal *normal, int steps, const double **change);

#endif
