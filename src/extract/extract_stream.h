/* Stage extract, internal: streamlines. A line walks from tet to tet; its vertices are rows of
 * numbers until the result is put together. */
#ifndef TETRALOD_SRC_EXTRACT_STREAM_H
#define TETRALOD_SRC_EXTRACT_STREAM_H

#include "extract/extract.h"

/* A tet that a line is in, made of the mesh when it is entered: one vertex of four is new then, so
 * a table of all tets would cost more traffic than it saves. Weights are barycentric. */
typedef struct tli_stream_cell {
    tl_lidx tet;
    double origin[3];    /* the last corner */
    double slopes[4][3]; /* gradients of the weights */
    double vectors[4][3];
} tli_stream_cell;

typedef struct tli_stream_field {
    const tl_mesh *mesh;
    const tl_lidx *opposite;
    const tl_locator *locator;
    const double *vectors; /* [vert_count][3] */
} tli_stream_field;

/* Makes a tet the cell; false for one without a positive volume: the cell is then as it was. */
bool tli_stream_enter(const tli_stream_field *field, tl_lidx tet, tli_stream_cell *cell);

typedef enum tli_stream_way {
    TLI_WAY_IN,  /* the cell holds the point */
    TLI_WAY_OUT, /* the way leaves the mesh */
    TLI_WAY_LOST /* the point is not finite */
} tli_stream_way;
/* Walks from a point that the cell holds, within rounding, straight to another; the cell becomes
 * the one of its end. weights: of the end in it. reached: TLI_WAY_OUT: the part of the way that
 * lies in the mesh. */
tli_stream_way tli_stream_walk(const tli_stream_field *field, tli_stream_cell *cell,
                               const double from[3], const double to[3], double weights[4],
                               double *reached);

/* Weights of x in the cell, within it or not. */
static inline void tli_stream_weights(const tli_stream_cell *cell, const double x[3],
                                      double weights[4])
{
    double d[3] = {x[0] - cell->origin[0], x[1] - cell->origin[1], x[2] - cell->origin[2]};
    for (int i = 0; i < 3; i++)
        weights[i] =
            cell->slopes[i][0] * d[0] + cell->slopes[i][1] * d[1] + cell->slopes[i][2] * d[2];
    weights[3] = 1 - weights[0] - weights[1] - weights[2];
}

static inline void tli_stream_vector(const tli_stream_cell *cell, const double weights[4],
                                     double v[3])
{
    for (int k = 0; k < 3; k++)
        v[k] = weights[0] * cell->vectors[0][k] + weights[1] * cell->vectors[1][k] +
               (weights[2] * cell->vectors[2][k] + weights[3] * cell->vectors[3][k]);
}

/* What all lines of a call share. */
typedef struct tli_stream_job {
    tl_ctx *ctx;
    tli_stream_field field;
    tl_stream_opts opts;
    tl_lidx *own_opposite; /* when the caller had none */
    tl_locator *own_locator;
    double bounds[6]; /* of the mesh */
    double length_max, time_max;
    double speed_min; /* vectors' unit */
    double tolerance; /* mesh units */
    size_t
        row_doubles; /* of a vertex: x, y, z, time, speed, carried values, with normals the spin */
} tli_stream_job;
/* Columns of a row. */
enum { TLI_ROW_TIME = 3, TLI_ROW_SPEED = 4, TLI_ROW_CARRIED = 5 };

/* Checks and completes what a call was given; closed on failure, too. */
tl_status tli_stream_open(tl_ctx *ctx, const tli_stream_field *given, const tl_stream_opts *opts,
                          tli_stream_job *job);
void tli_stream_close(tli_stream_job *job);

/* One line: rows [count][row_doubles], a block of tl_mem_alloc that further lines use again. */
typedef struct tli_stream_line {
    double *rows;
    size_t count, room;
    size_t ends[TL_STREAM_END_COUNT];
    uint64_t steps;
} tli_stream_line;
/* Traces the line of a seed; count is below 2 where there is none. Any thread. */
tl_status tli_stream_trace(const tli_stream_job *job, const double seed[3], tli_stream_line *line);

/* How fast what flows turns about its direction v at a point of a cell: angle by time. */
double tli_stream_spin(const tli_stream_cell *cell, const double v[3]);

/* Lines that stay, one behind the other. */
typedef struct tli_stream_sum {
    double *rows;
    size_t count, room;
    tl_lidx *starts; /* [line_count + 1] */
    size_t line_count, line_room;
    tl_stream_report report;
} tli_stream_sum;
/* Traces seeds [seed_count][3], at most TLI_STREAM_BATCH, on the pool into lines. */
enum { TLI_STREAM_BATCH = 1024 };
tl_status tli_stream_batch(const tli_stream_job *job, const double *seeds, size_t seed_count,
                           tli_stream_line *lines);
tl_status tli_stream_keep(const tli_stream_job *job, const tli_stream_line *line,
                          tli_stream_sum *sum);
void tli_stream_sum_release(const tli_stream_job *job, tli_stream_sum *sum);
/* Of rows with a spin. Gives *normals [count][3], also after a failure. */
tl_status tli_stream_normals(const tli_stream_job *job, const tli_stream_sum *sum, float **normals);
/* The lines with their channels. Gives *lines. */
tl_status tli_stream_finish(const tli_stream_job *job, const tli_stream_sum *sum,
                            tl_polydata **lines);

#endif
