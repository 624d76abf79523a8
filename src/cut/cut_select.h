/* Stage cut, internal: which segments are refined. */
#ifndef TETRALOD_SRC_CUT_SELECT_H
#define TETRALOD_SRC_CUT_SELECT_H

#include "cut/cut_error.h"

/* Room for every item once. */
typedef struct tli_ids {
    uint32_t *ids;
    size_t count;
} tli_ids;
/* Into rising order. */
void tli_ids_sort(uint32_t *ids, size_t count);

/* A set of refined segments that is closed upwards. A segment is in it where refined[segment] is
 * stamp, and has a drawn output or none any more where exposed[segment] is. Arrays are
 * [segment count]. */
typedef struct tli_selection {
    uint32_t *refined, *exposed, *visited;
    uint32_t stamp, visit;
    tli_ids list;   /* the refined ones */
    tli_ids fringe; /* all that are or were exposed, each once */
    tli_ids work;   /* scratch of a closure */
    double *keys;   /* [segment count] of the budget's heap */
    tli_ids heap, put_off;
    tli_gain total; /* tets, vertices and bytes drawn */
    bool short_of;  /* a budget ended it early */
} tli_selection;

tl_status tli_selection_create(tl_ctx *ctx, const tl_store_head *head, tli_selection *selection);
void tli_selection_release(tl_ctx *ctx, tli_selection *selection);

/* Starts anew: nothing is refined. */
tl_status tli_select_begin(tli_selection *s, tli_dag *graph);
/* Refines segment and all that it depends on. */
tl_status tli_select_refine(tli_selection *s, tli_dag *graph, uint32_t segment);
/* Refines what is above its bound, without a budget. */
tl_status tli_select_by_error(tli_selection *s, tli_dag *graph, const tli_asked *asked);
/* The same under budgets, worst first, or where nothing is bounded whatever pays most.
 * cut_budget.c */
tl_status tli_select_by_budget(tli_selection *s, tli_dag *graph, const tli_asked *asked);

static inline bool tli_is_refined(const tli_selection *s, uint32_t segment)
{
    return segment != TL_NONE && s->refined[segment] == s->stamp;
}

#endif
