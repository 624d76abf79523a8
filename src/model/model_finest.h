/* Stage model, internal: what all segments of the finest level agree on. What is known of a vertex
 * lies in working files, once for each segment that holds it, so that none is too large. */
#ifndef TETRALOD_SRC_MODEL_FINEST_H
#define TETRALOD_SRC_MODEL_FINEST_H

#include "base/base_scratch.h"
#include "model/model.h"
#include "model/model_stars.h"

/* A byte for each vertex of each segment; of segments that have none but zeros nothing is written.
 */
typedef struct tli_marks {
    tli_scratch *file;
    uint8_t *has_any; /* [segments] */
} tli_marks;

typedef struct tli_finest {
    tli_model *model;
    const tl_segments *segments;
    int largest, unit; /* exponents of the largest step and of the lattice's unit */
    bool as_is;        /* places stay as they are */
    tli_marks finer;   /* how many exponents below the largest step */
    tli_marks twins;
    tli_stars stars;
} tli_finest;

/* Chooses lattice and steps so that no tet turns or goes flat, and numbers the vertices that lie at
 * one place. model_lattice.c */
tl_status tli_finest_agree(tli_finest *finest, tli_plan *plan);
void tli_finest_release(tli_finest *finest);
/* steps [vert_count] of a segment. */
tl_status tli_finest_steps(tl_ctx *ctx, const tli_finest *finest, const tl_segment *segment,
                           int16_t *steps);
/* xyz [vert_count][3] receives the places as they will be decoded. */
void tli_finest_snap(const tli_finest *finest, const tl_segment *segment, const int16_t *steps,
                     double *xyz);

/* ---- model_twins.c ---- */
tl_status tli_finest_number_twins(tli_finest *finest);
/* Marks in wanted [vert_count] the vertices of a segment whose step is larger than that of another
 * one at the same place: all of a place are to stay together. */
tl_status tli_finest_even_twins(tl_ctx *ctx, const tl_segment *segment, const int16_t *steps,
                                uint8_t *wanted);

/* ---- marks, model_lattice.c ---- */
tl_status tli_marks_open(tl_ctx *ctx, const tli_finest *finest, tli_marks *marks);
void tli_marks_close(tl_ctx *ctx, tli_marks *marks);
/* values [vert_count] */
tl_status tli_marks_read(tl_ctx *ctx, const tli_finest *finest, const tli_marks *marks,
                         const tl_segment *segment, uint8_t *values);
tl_status tli_marks_write(tl_ctx *ctx, const tli_finest *finest, tli_marks *marks,
                          const tl_segment *segment, const uint8_t *values);

#endif
