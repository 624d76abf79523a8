/* Stage model, internal: what an addition joins, originals and what the file has, through bins. */
#ifndef TETRALOD_SRC_MODEL_ADD_BINS_H
#define TETRALOD_SRC_MODEL_ADD_BINS_H

#include "model/model_add.h"

/* Bins of what is joined by hashes. */
enum { TLI_ADD_BINS = 64 };
static inline uint32_t tli_bin_of(uint64_t key)
{
    return (uint32_t)(key >> 32) % TLI_ADD_BINS;
}

/* Records on their way to bins. */
typedef struct tli_outbox {
    tl_ctx *ctx;
    tli_bins *bins;
    uint8_t *records, *sorted;
    uint32_t *keys, *places, *begins;
    size_t count, room;
} tli_outbox;
/* To be closed also after a failure. */
tl_status tli_outbox_open(tl_ctx *ctx, tli_bins *bins, tli_outbox *box);
/* The place of the next record, for a bin; full boxes are emptied first. NULL after a failure. */
void *tli_outbox_next(tli_outbox *box, uint32_t bin, tl_status *status);
/* Writes what is left if status is fine. Returns the first failure. */
tl_status tli_outbox_close(tli_outbox *box, tl_status status);

/* What is in a bin, in the order of the keys, which are the first eight bytes of records; equal
 * ones in the order they came. */
typedef struct tli_sorted_bin {
    uint8_t *records; /* [count] as they came */
    uint64_t *keys;   /* [count] ascending */
    uint32_t *order;  /* [count] of records */
    size_t count;
} tli_sorted_bin;
/* To be released also after a failure. */
tl_status tli_bin_sort(tl_ctx *ctx, const tli_bins *bins, uint32_t bin, tli_sorted_bin *sorted);
void tli_bin_release(tl_ctx *ctx, tli_sorted_bin *sorted);

#endif
