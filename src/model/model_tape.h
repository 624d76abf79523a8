/* Stage model, internal: a row of numbers that is written once and then read in the same order;
 * past some thousands it lies in a working file. */
#ifndef TETRALOD_SRC_MODEL_TAPE_H
#define TETRALOD_SRC_MODEL_TAPE_H

#include "model/model_depot.h"

typedef struct tli_tape {
    tl_ctx *ctx;
    tli_depot *depot;
    uint32_t *window; /* [TLI_TAPE_WINDOW] */
    uint64_t *places; /* [place_count] of full windows */
    size_t place_count, place_room;
    size_t at, filled; /* in the window */
    size_t next_place; /* when it is read */
} tli_tape;
enum { TLI_TAPE_WINDOW = 16384 };

/* depot is borrowed. */
tl_status tli_tape_open(tl_ctx *ctx, tli_depot *depot, tli_tape *tape);
tl_status tli_tape_write(tli_tape *tape, uint32_t number);
/* Back to the first number, to read. */
tl_status tli_tape_rewind(tli_tape *tape);
/* There must be one left. */
tl_status tli_tape_read(tli_tape *tape, uint32_t *number);
void tli_tape_close(tli_tape *tape);

#endif
