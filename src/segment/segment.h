/* Stage segment, internal: the struct behind tl_segments, and what its builders share. */
#ifndef TETRALOD_SRC_SEGMENT_H
#define TETRALOD_SRC_SEGMENT_H

#include "base/base_scratch.h"
#include "segment/segment_octree.h"
#include "tetralod/segment.h"

/* What is kept in memory of each segment. */
typedef struct tli_segment_entry {
    uint64_t body_ofs;  /* of its body in the file */
    uint64_t first_tet; /* among the tets in the order of the file: place of opposites */
    uint64_t first_vert;
    uint32_t tet_count, vert_count, shared_count;
    uint32_t first_neighbour, neighbour_count;
    double bounds[6];
} tli_segment_entry;

/* The file: head, bodies in an order that follows space, links, opposites, index. A body is one
 * array after the other, each from a multiple of 8:
 *   vertex ids u64, xyz f64 [3], values f64, tet values f64, regions i32, tets u16 [4] */
struct tl_segments {
    tl_ctx *ctx;
    tli_scratch *file;
    tl_segment_channel *channels; /* names owned */
    size_t channel_count;
    uint32_t components[2]; /* by tl_on */
    bool has_regions, has_adjacency;
    double time;
    uint64_t id_end, tet_count, vert_count;
    uint32_t count;
    tli_segment_entry *entries; /* [count] */
    uint32_t *order;            /* [count] segments in the order of the file */
    uint32_t *neighbours;       /* of all segments */
    uint64_t neighbour_count;
    uint64_t links_ofs, opposites_ofs;
};

/* Bytes from the start of a body to each of its arrays, and of the whole. */
typedef struct tli_body {
    size_t xyz, values, tet_values, regions, tets, bytes;
} tli_body;
tli_body tli_body_of(const tl_segments *segments, uint32_t vert_count, uint32_t tet_count);

/* The slot of a segment among the neighbours of another: 0 for itself. It must be one. */
uint32_t tli_segment_slot(const tl_segments *segments, uint32_t segment, uint32_t other);

/* ---- dealing records to bins (segment_bins.c) ---- */

/* Counting sort by keys below bin_count, stable: begins [bin_count + 1], and places [count], where
 * each record goes. Runs on the pool. */
tl_status tli_deal(tl_ctx *ctx, const uint32_t *keys, size_t count, uint32_t bin_count,
                   uint32_t *begins, uint32_t *places);
/* The same on one thread, without a context's pool. */
void tli_deal_alone(const uint32_t *keys, size_t count, uint32_t bin_count, uint32_t *begins,
                    uint32_t *places);

/* Records of fixed size in many bins, in one working file: each call of tli_bins_add appends a run
 * that is sorted by bins. The order within a bin is the order of arrival. */
typedef struct tli_run {
    uint64_t ofs;
    uint32_t *begins; /* [bin_count + 1] */
} tli_run;
typedef struct tli_bins {
    tl_ctx *ctx;
    tli_scratch *file;
    size_t record_bytes;
    uint32_t bin_count;
    uint64_t *counts; /* [bin_count] records */
    tli_run *runs;
    size_t run_count, run_room;
} tli_bins;
tl_status tli_bins_open(tl_ctx *ctx, const char *folder, size_t record_bytes, uint32_t bin_count,
                        tli_bins *bins);
/* begins is copied. One thread at a time. */
tl_status tli_bins_add(tli_bins *bins, const void *records, const uint32_t *begins);
/* All records of a bin, to records [counts[bin]]. Several threads may read. */
tl_status tli_bins_read(tl_ctx *ctx, const tli_bins *bins, uint32_t bin, void *records);
void tli_bins_close(tli_bins *bins);

#endif
