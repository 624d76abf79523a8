/* Stage cut, internal: the parts of tl_cut_check. */
#ifndef TETRALOD_SRC_CUT_PROVER_H
#define TETRALOD_SRC_CUT_PROVER_H

#include "mesh/mesh.h"
#include "tetralod/cut.h"

typedef struct tli_prover {
    tl_ctx *ctx;
    tl_store *store;
    const tl_store_head *head;
    const tl_mesh *original; /* NULL: only the shape is proved */
    tl_cut *cut;
    tl_mesh_stats finest;
    size_t *channels; /* [channel_count] that are measured */
    size_t channel_count;
    uint64_t *proved; /* [proved_count] meshes that were measured, by what their patches hash to */
    size_t proved_count;
    tl_cut_check_result *result;
} tli_prover;

/* mesh: of prover->cut as it is; uniform: the same error is promised everywhere, so that the
 * promise may be called tight or loose. TL_ERR_DATA names what does not hold. cut_promise.c */
tl_status tli_prove_promises(tli_prover *p, const tl_mesh *mesh, bool uniform);
tl_status tli_prove_boundary(tli_prover *p, const tl_mesh *mesh, bool uniform);

#endif
