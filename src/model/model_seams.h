/* Stage model, internal: vertices that patches share, and vertices that segments share, of a whole
 * level. There are more of them than fit into memory: they lie in working files and are looked at
 * in bins, each of which fits. What comes out depends on neither the bins nor their number. */
#ifndef TETRALOD_SRC_MODEL_SEAMS_H
#define TETRALOD_SRC_MODEL_SEAMS_H

#include "model/model_depot.h"
#include "segment/segment.h"

/* Shared vertices of a segment's patches, while it is made. */
typedef struct tli_shared {
    uint64_t *ids;
    uint32_t *patches;
    size_t count, capacity;
} tli_shared;
tl_status tli_shared_add(tl_ctx *ctx, tli_shared *shared, uint64_t id, uint32_t patch);
void tli_shared_release(tl_ctx *ctx, tli_shared *shared);

/* Where those of a segment lie in the file; patches count from first_patch. */
typedef struct tli_seam {
    uint64_t ofs;
    uint32_t count, first_patch;
} tli_seam;
/* Those of all segments of a level, in the order of its patches. */
typedef struct tli_seams {
    tli_seam *items;
    size_t count, capacity;
} tli_seams;
/* Writes and releases *shared; first_patch of *seam is 0. */
tl_status tli_seam_put(tl_ctx *ctx, tli_depot *depot, tli_shared *shared, tli_seam *seam);
tl_status tli_seams_add(tl_ctx *ctx, tli_seams *seams, tli_seam seam, size_t first_patch);
void tli_seams_release(tl_ctx *ctx, tli_seams *seams);

/* A level's seams dealt to bins: all that is known of a vertex is in one of them. */
typedef struct tli_seam_bins {
    tli_bins bins;
    uint64_t *ids; /* [largest bin] of the bin that was read last, ascending */
    uint32_t *patches;
    size_t count;
} tli_seam_bins;
/* bin_bytes: about what a bin may take while it is looked at. */
tl_status tli_seam_bins_open(tl_ctx *ctx, const char *folder, const tli_depot *depot,
                             const tli_seams *seams, uint64_t bin_bytes, tli_seam_bins *bins);
tl_status tli_seam_bins_read(tl_ctx *ctx, tli_seam_bins *bins, uint32_t bin);
void tli_seam_bins_close(tl_ctx *ctx, tli_seam_bins *bins);

/* A vertex of several segments, at one of them. */
typedef struct tli_locked_vertex {
    uint64_t id;
    uint32_t segments; /* that hold it */
    uint32_t zero;
} tli_locked_vertex;
/* Vertices of several segments of a level, by segment. */
typedef struct tli_locked {
    tli_bins bins;
} tli_locked;
tl_status tli_locked_open(tl_ctx *ctx, const char *folder, size_t segment_count,
                          tli_locked *locked);
/* Adds vertices [count], each to segments[i]. */
tl_status tli_locked_add(tl_ctx *ctx, tli_locked *locked, const tli_locked_vertex *vertices,
                         const uint32_t *segments, size_t count);
/* Those of a segment, ascending. Gives *vertices. Several threads may read. */
tl_status tli_locked_read(tl_ctx *ctx, const tli_locked *locked, size_t segment,
                          tli_locked_vertex **vertices, size_t *count);
void tli_locked_release(tli_locked *locked);
/* Index of the vertex id among vertices [count], which ascend; SIZE_MAX if it is not one. */
size_t tli_locked_find(const tli_locked_vertex *vertices, size_t count, uint64_t id);

#endif
