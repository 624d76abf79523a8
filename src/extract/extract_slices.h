/* Stage extract, internal: slices of a cut, patch by patch. */
#ifndef TETRALOD_SRC_EXTRACT_SLICES_H
#define TETRALOD_SRC_EXTRACT_SLICES_H

#include "cut/cut_gradient.h"
#include "extract/extract.h"

/* A vertex at an edge one or both of whose ends other patches hold, too: its normal depends on
 * them. */
typedef struct tli_rim_vert {
    uint32_t vert;    /* of the part's surface */
    uint32_t ends[2]; /* slots of the part */
    uint32_t level;
    double weight;
} tli_rim_vert;

/* What one patch adds to a surface, and what others need to know of it. Slots are vertices of the
 * patch: first its shared ones, then inner ones at the other end of an edge of a rim vertex. */
typedef struct tli_slices_part {
    uint32_t number;
    uint32_t tet_count;
    tl_polydata *surface;
    tli_rim_vert *rim;
    size_t rim_count;
    uint32_t slot_count, shared_count;
    int64_t (*places)[3]; /* [shared_count]; with twins, until there are keys */
    uint8_t *twins;
    uint32_t *keys;    /* [shared_count] numbers of the shared vertices */
    tli_slope *slopes; /* [slot_count] of the patch alone; NULL without normals */
    bool is_touched;   /* a neighbour has come or gone */
} tli_slices_part;

/* What is sliced, of any patch. */
typedef struct tli_slices_job {
    tl_store *store;
    const tl_store_head *head;
    tl_slices_opts opts; /* arrays point to own copies, values rising */
} tli_slices_job;

/* A patch as it was read and decoded, for all that slice it. */
typedef struct tli_slices_patch {
    const tl_store *store; /* borrowed */
    uint32_t number;
    tl_patch *patch;
    double **values; /* [channel_count of the store] of those that were asked for, else NULL:
                        [vert_count][components] */
} tli_slices_patch;
/* To be released also after a failure. ctx is that of one thread, here and below. */
tl_status tli_slices_patch_open(tl_ctx *ctx, const tl_store *store, uint32_t number,
                                tli_slices_patch *patch);
void tli_slices_patch_release(tl_ctx *ctx, tli_slices_patch *patch);
/* Slices a patch of the job's store. Gives *part, without keys. */
tl_status tli_slices_part_make(tl_ctx *ctx, const tli_slices_job *job, tli_slices_patch *patch,
                               tli_slices_part **part);
void tli_slices_part_destroy(tl_ctx *ctx, tli_slices_part *part);
/* Of memory. */
uint64_t tli_slices_part_bytes(const tli_slices_part *part);
/* A channel as it is carried, without values. */
tl_channel tli_slices_carried(const tli_slices_job *job, size_t place);
/* All of them as one. Gives *triangles. extract_slices_join.c */
tl_status tli_slices_join(tl_ctx *ctx, const tli_slices_job *job, tli_slices_part *const *parts,
                          size_t part_count, tl_polydata **triangles);
/* True if one of the values may lie in the patch. */
tl_status tli_slices_may_cut(tl_ctx *ctx, const tli_slices_job *job, uint32_t number, bool *may);

#endif
