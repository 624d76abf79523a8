/* Stage cut, internal: numbers for keys of four integers: what tells vertices apart across patches
 * (place and twin), and faces (three vertices). */
#ifndef TETRALOD_SRC_CUT_KEYS_H
#define TETRALOD_SRC_CUT_KEYS_H

#include "base/base.h"

typedef struct tli_key {
    int64_t part[3];
    uint32_t rest;
    uint32_t uses; /* 0: the number is free */
} tli_key;

/* An open table; a number stays as long as its key is used. */
typedef struct tli_keys {
    tl_ctx *ctx;
    tli_key *keys;                         /* [capacity] */
    uint32_t count, capacity, free_number; /* free ones are chained through part[0] */
    uint32_t *slots;                       /* numbers, TL_NONE when empty */
    size_t slot_mask, used;
} tli_keys;

tl_status tli_keys_open(tl_ctx *ctx, size_t expected, tli_keys *keys);
void tli_keys_close(tli_keys *keys);
/* The number of a key, new or not; counts one use. */
tl_status tli_keys_take(tli_keys *keys, const int64_t part[3], uint32_t rest, uint32_t *number);
/* TL_NONE if it is not there. */
uint32_t tli_keys_find(const tli_keys *keys, const int64_t part[3], uint32_t rest);
/* Ends one use; true if it was the last, and the number is free. */
bool tli_keys_drop(tli_keys *keys, uint32_t number);

#endif
