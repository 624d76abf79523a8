/* Stage model, internal: further channels for a model that exists. Its patches and segments stand
 * in a tli_model, whose plan has the new channels alone; meshes are read from the file when they
 * are needed. */
#ifndef TETRALOD_SRC_MODEL_ADD_H
#define TETRALOD_SRC_MODEL_ADD_H

#include "model/model.h"
#include "store/store.h"

typedef struct tli_adder {
    tl_ctx *ctx;
    const tl_store *store;
    const tl_store_head *head;
    const tl_segments *segments; /* of the data set with the channels */
    tli_plan *plan;
    tli_model *model; /* segments in reverse: the finest level first. ofs of a patch: its values
                         [vert_count][vert_comps] among the meshes */
    uint32_t *finest; /* [finest_count] patches of level 0 */
    uint32_t finest_count;
    tli_bins matches;    /* tli_match, by rank */
    double *leaf_errors; /* [finest_count][field_count] */
    double *radii;       /* [segment_count] of the model: of the spheres, as needed now */
} tli_adder;

/* An original vertex of a vertex of a patch; the new values follow. */
typedef struct tli_match {
    uint32_t local, carries; /* carries: it is measured by way of this patch */
    double xyz[3];
    double values[];
} tli_match;
static inline size_t tli_match_bytes(const tli_plan *plan)
{
    return sizeof(tli_match) + plan->vert_comps * sizeof(double);
}

/* Number of a segment of the file among those of the model, and back. */
static inline uint32_t tli_adder_segment(const tli_adder *a, uint32_t segment)
{
    return segment == TL_NONE ? TL_NONE : a->head->segment_count - 1 - segment;
}

/* A patch as it is decoded, with the identities of its vertices. */
typedef struct tli_added_patch {
    tl_patch *patch;
    uint64_t *ids; /* [vert_count] equal where patches share a vertex */
} tli_added_patch;
tl_status tli_added_patch_load(tl_ctx *ctx, const tli_adder *a, uint32_t patch,
                               tli_added_patch *out);
void tli_added_patch_release(tl_ctx *ctx, tli_added_patch *patch);
/* The mesh of vertices and tets (taken over) with room for the new channels. */
tl_status tli_added_mesh(tl_ctx *ctx, const tli_plan *plan, double *xyz, size_t vert_count,
                         tl_lidx *tets, size_t tet_count, tl_mesh **mesh);
/* Rows of values [vert_count][vert_comps] into the channels of a mesh. */
void tli_added_values(const tli_plan *plan, const double *rows, tl_mesh *mesh);
/* Writes the values of a patch and notes their ranges. */
tl_status tli_added_put(tl_ctx *ctx, tli_adder *a, uint32_t patch, uint32_t vert_count,
                        const double *rows);

/* Finds the original of every vertex of the finest level. TL_ERR_DATA if there is one without, or
 * an original that is no vertex: another mesh. model_add_match.c */
tl_status tli_adder_match(tli_adder *a);
/* Values of the finest level, originals on board. model_add_finest.c */
tl_status tli_adder_begin(tli_adder *a);
/* Values and errors of the levels above. model_add_level.c */
tl_status tli_adder_grow(tli_adder *a);
/* The file with the new channels beside the old ones. model_add_write.c */
tl_status tli_adder_write(tli_adder *a, const char *path, uint64_t *bytes);

#endif
