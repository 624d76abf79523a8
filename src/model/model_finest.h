/* Stage model, internal: what all segments of the finest level agree on. */
#ifndef TETRALOD_SRC_MODEL_FINEST_H
#define TETRALOD_SRC_MODEL_FINEST_H

#include "model/model.h"

typedef struct tli_finest {
    tli_model *model;
    const tl_segments *segments;
    int largest, unit; /* exponents of the largest step and of the lattice's unit */
    bool as_is;        /* places stay as they are */
    uint8_t *finer;    /* [id_end] how many exponents below the largest step */
    uint8_t *twins;    /* [id_end] */
    uint8_t *wanted;   /* [id_end] a finer step, while they are agreed on */
} tli_finest;

/* Chooses lattice and steps so that no tet turns or goes flat, and numbers the vertices that lie at
 * one place. model_lattice.c */
tl_status tli_finest_agree(tli_finest *finest, tli_plan *plan);
void tli_finest_release(tli_finest *finest);
/* xyz [vert_count][3] receives the places as they will be decoded. */
void tli_finest_snap(const tli_finest *finest, const tl_segment *segment, double *xyz);
int16_t tli_finest_step(const tli_finest *finest, uint64_t id);

#endif
