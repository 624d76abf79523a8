/* Stage cut, internal: the object, for the files that work on it. */
#ifndef TETRALOD_SRC_CUT_OBJECT_H
#define TETRALOD_SRC_CUT_OBJECT_H

#include "cut/cut_select.h"

struct tl_cut {
    tl_ctx *ctx;
    tli_dag graph;
    tli_asked asked;
    tli_selection now, next; /* the refined segments, and those being looked for */
    uint32_t *places;        /* [patch count] index in drawn, TL_NONE when not drawn */
    uint32_t *seen;          /* [patch count] stamp: looked at in this update */
    uint32_t stamp;
    tli_ids drawn, added, removed, wanted, foreseen; /* patches, room for all */
    size_t leaves;                                   /* drawn patches without producer */
    tl_cut_state state;
    double *channel_errors; /* [channel count] */
    tl_cut_resident_fn resident;
    void *resident_user;
};

/* Takes out of cut->next what would draw patches that are not resident, with all that depends on
 * it, and lists them in cut->wanted. cut_resident.c */
tl_status tli_cut_trim(tl_cut *cut);

#endif
