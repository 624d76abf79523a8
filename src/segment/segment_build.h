/* Stage segment, internal to the builder: what its steps hand on.
 *   segment_build.c  points to parts, tets to groups of parts
 *   segment_cut.c    a group of parts to segments
 *   segment_link.c   copies of a vertex and neighbours
 *   segment_file.c   head and index of the file */
#ifndef TETRALOD_SRC_SEGMENT_BUILD_H
#define TETRALOD_SRC_SEGMENT_BUILD_H

#include "formats/formats_feed.h"
#include "segment/segment.h"

/* Points are renumbered: those of part 0 first, each part in the order of the source. Such a number
 * is called a place here; of two places the lower one is in the lower part, or the same. */
typedef struct tli_build {
    tl_ctx *ctx;
    tli_feed *feed;
    tl_segment_opts opts;
    const double *rotation; /* [9] of the octree, or NULL */
    tl_segments *segments;
    tl_read_report *report; /* of the feed, before the file is kept; NULL: not asked for */
    tli_octree octree;

    uint32_t part_count;
    uint32_t *first_places; /* [part_count + 1] */
    uint32_t *part_hints;   /* [places >> TLI_HINT_SHIFT] part of the first of so many places */
    tli_scratch *table;     /* u32 [points]: place of a point; TL_NONE: it is missing */
    tli_scratch *verts;     /* [places][vert_bytes]: index in the source u64, xyz, values */
    size_t vert_bytes, tet_bytes; /* of records */
    const uint8_t *vert_map;
    size_t vert_map_bytes;

    /* Groups are parts that lie together; what belongs to one fits into memory. */
    uint32_t *layout;       /* [part_count] parts along space */
    uint32_t *group_begins; /* [group_count + 1] into layout */
    uint32_t *group_of;     /* [part_count] */
    uint32_t group_count;
    unsigned in_flight; /* groups in memory at the same time */

    tli_bins tets;   /* places u32 [4], region i32 if there are any, values */
    tli_bins guests; /* tli_guest, at the group of the part of the place */
    tli_bins links;  /* tli_link, at the group of the part of the holder */

    uint32_t *part_bases;     /* [part_count + 1] first segment of a part */
    uint32_t *group_segments; /* [group_count + 1] segments of a group, in the order of the file */
} tli_build;

#define TLI_HINT_SHIFT 8u

/* A vertex of a segment: part, and the piece of the part, where a part is too large for one. */
typedef struct tli_guest {
    uint32_t place, part;
    uint16_t piece, local;
} tli_guest;
/* Where the next copy of a vertex is. */
typedef struct tli_link {
    uint32_t part;
    uint16_t piece, local;
    uint32_t next_segment;
    uint16_t next_local, is_copy; /* is_copy: a lower segment holds the vertex, too */
} tli_link;

static inline uint32_t tli_part_of(const tli_build *b, uint32_t place)
{
    uint32_t part = b->part_hints[place >> TLI_HINT_SHIFT];
    while (place >= b->first_places[part + 1]) part++;
    return part;
}

/* Tets of the bins become bodies in the file; fills entries and guests. */
tl_status tli_build_cut(tli_build *b);
/* Guests become links and neighbours. */
tl_status tli_build_link(tli_build *b);

/* As tl_segments_build, of a feed, which goes; rotation [9] turns the octree, NULL: it stays. */
tl_status tli_segments_build_feed(tl_ctx *ctx, tli_feed *feed, const tl_segment_opts *opts,
                                  const double *rotation, tl_segments **segments);

/* Fills the opposites. segment_adjacency.c */
tl_status tli_segments_match_faces(tl_segments *segments);

/* The head, whose fields come last; then the index behind all else, and the head for good. */
tl_status tli_segments_write_head(tl_segments *segments);
tl_status tli_segments_write_index(tl_segments *segments);

#endif
