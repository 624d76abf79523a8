/* Stage cut, internal: proofs that patches fit together, many a second. */
#ifndef TETRALOD_SRC_CUT_PROOF_H
#define TETRALOD_SRC_CUT_PROOF_H

#include "base/base.h"
#include "tetralod/store.h"

/* The faces at the borders of all patches of a model, numbered, and what each patch adds to a mesh.
 * A vertex at a border is its place, its twin and its values: patches that differ in one of these
 * do not share a face. */
typedef struct tli_proof tli_proof;

/* Sums over the patches of a mesh. */
typedef struct tli_proof_sums {
    double volume; /* mesh units cubed */
    uint64_t tets, inverted, flat;
    uint64_t odd_sides; /* as below, of faces that only one patch can have */
} tli_proof_sums;

/* Decodes every patch once, on the pool. TL_ERR_DATA if patches of one level give a vertex
 * different values. Gives *proof. */
tl_status tli_proof_create(tl_ctx *ctx, tl_store *store, tli_proof **proof);
/* NULL is allowed. */
void tli_proof_destroy(tli_proof *proof);

/* Of a level as a whole. */
typedef struct tli_proof_level {
    tli_proof_sums sums;
    uint64_t odd_sides; /* tets at faces that have other than one tet, or one on each side */
} tli_proof_level;
/* level < level count; borrowed. */
const tli_proof_level *tli_proof_of_level(const tli_proof *proof, uint32_t level);

/* What a cut is counted in; one a thread. Gives *counts (tl_mem_free). */
tl_status tli_proof_counts(tl_ctx *ctx, const tli_proof *proof, uint16_t **counts);
/* Proves that every face of the patches [patch_count] has the tets on both sides that it has in a
 * level as a whole. TL_ERR_DATA names the first patch where that is not so. counts, of
 * tli_proof_counts, is the same afterwards. Any thread, ctx being its own. */
tl_status tli_proof_patches(tl_ctx *ctx, const tli_proof *proof, const uint32_t *patches,
                            size_t patch_count, uint16_t *counts, tli_proof_sums *sums);

#endif
