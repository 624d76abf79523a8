/* Stage model, internal: values around original vertices. */
#ifndef TETRALOD_SRC_MODEL_STARS_H
#define TETRALOD_SRC_MODEL_STARS_H

#include "model/model.h"

/* What segments of the input know of each other's vertices. */
typedef struct tli_stars {
    tl_ctx *ctx;
    const tli_plan *plan;
    const tl_segments *segments;
    tli_depot *depot;
    uint64_t *places; /* [segments] in the depot */
    uint32_t *counts; /* [segments] vertices */
} tli_stars;
/* Borrows plan and segments. To be closed also after a failure. */
tl_status tli_stars_open(tl_ctx *ctx, const tli_plan *plan, const tl_segments *segments,
                         tli_stars *all);
void tli_stars_close(tli_stars *all);
/* Gives *stars [vert_count][vert_fields] of a segment, whole for the vertices whose home it is. Any
 * thread, with a context of its own. */
tl_status tli_stars_create(tl_ctx *ctx, const tli_stars *all, const tl_segment *segment,
                           tli_star **stars);

#endif
