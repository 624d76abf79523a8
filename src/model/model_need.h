/* Stage model, internal: how much memory a build takes. */
#ifndef TETRALOD_SRC_MODEL_NEED_H
#define TETRALOD_SRC_MODEL_NEED_H

#include "tetralod/model.h"

/* What a build depends on. */
typedef struct tli_need {
    uint64_t tets;
    size_t vert_comps, tet_comps, fields;
    uint32_t segment_tets, patch_tets;
} tli_need;

/* Upper bounds in bytes: of the lists of all levels, of a segment that is worked on. */
uint64_t tli_need_lists(const tli_need *need);
uint64_t tli_need_segment(const tli_need *need);
/* A limit under which a build works, on one thread at a time. */
uint64_t tli_need_least(const tli_need *need);
/* About what the work files take. */
uint64_t tli_need_disk(const tli_need *need);
/* Segments that may be worked on at once under a limit (0: none), at least 1. */
size_t tli_need_at_once(const tli_need *need, uint64_t limit, size_t threads);

#endif
