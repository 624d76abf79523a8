/* Stage formats, internal: numbers that a file gives its points or cells, to indices. */
#ifndef TETRALOD_SRC_FORMATS_IDS_H
#define TETRALOD_SRC_FORMATS_IDS_H

#include "base/base.h"

/* Either a table over [low, low + table_count), or sorted ids, where they are far between. */
typedef struct tli_ids {
    tl_ctx *ctx;
    uint64_t low, table_count, sorted_count;
    uint32_t *indices; /* TL_NONE: no such id */
    uint64_t *sorted;
} tli_ids;

/* ids [count] become 0 .. count - 1; of equal ones the first. ids are taken over and freed. */
tl_status tli_ids_create(tl_ctx *ctx, uint64_t *ids, uint64_t count, tli_ids *map);
void tli_ids_release(tli_ids *map);
/* TL_NONE if there is no such id. */
uint32_t tli_ids_find(const tli_ids *map, uint64_t id);

#endif
