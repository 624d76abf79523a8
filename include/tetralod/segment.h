/* tetralod, stage segment: meshes larger than memory. A data set becomes a file of segments, each
 * small enough for 16-bit indices, whatever its size (Sondershaus 2007, 6.1). Neither its tets nor
 * its vertices need fit into memory.
 *
 * A segment holds tets and all their vertices; a vertex with tets in several segments is in each of
 * them, and its copies are linked. Segments are numbered from 0.
 *
 * What returns a status can also fail for TL_ERR_MEMORY, TL_ERR_BUDGET and TL_ERR_CANCELLED. */
#ifndef TETRALOD_SEGMENT_H
#define TETRALOD_SEGMENT_H

#include "tetralod/formats.h"
#include "tetralod/simplify.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Vertices, and tets, that a segment can hold, shared vertices included. */
#define TL_SEGMENT_MAX 65535u
/* Neighbours that a segment can name. */
#define TL_SEGMENT_NEIGHBOURS_MAX 16383u

/* How a data set is cut into segments, and what that may take. */
typedef struct tl_segment_opts {
    size_t struct_bytes;   /* size of this struct, set by tl_segment_opts_defaults */
    uint32_t segment_tets; /* tets of a segment on average, 64 to 40,000; default 20,000. More:
                              fewer shared vertices, more memory at a time */
    uint32_t leaf_points;  /* most vertices of an octree leaf, the grain of the partition; default
                              0: a 24th of a segment's. Fewer: better balance, more time */
    uint64_t memory_bytes; /* what the work may take, on top of what the context holds already;
                              default 256 MiB, at least TL_SEGMENT_MEMORY_MIN. The result does not
                              depend on it */
    const char *folder;    /* where temporary files lie; NULL: "/tmp". They have no names where the
                              file    system allows it, so that nothing is left behind. borrowed */
    bool adjacency;        /* default true: the faces of tets are matched over all segments */
} tl_segment_opts;
TL_API tl_segment_opts tl_segment_opts_defaults(void);
/* Smallest memory_bytes. */
#define TL_SEGMENT_MEMORY_MIN ((uint64_t)32 << 20)

/* A channel of a segmented mesh; name and unit borrow from it. */
typedef struct tl_segment_channel {
    const char *name, *unit;
    uint32_t components;
    tl_on on;
    tl_scalar scalar;
    uint32_t first; /* its first component among those of all channels on vertices (on tets) */
    bool has_step;  /* of a series: it belongs to this step, and others may have its name */
    uint32_t step;
    double time; /* of the step; NaN: none */
} tl_segment_channel;

/* A data set in segments; holds on to its context and to its file. */
typedef struct tl_segments tl_segments;

/* Cuts the data set of a file into segments. VTK XML files with appended raw arrays and raw volumes
 * are read in windows; of other kinds the mesh is read as a whole first. read may be NULL
 * (defaults), as may opts. path: where the file of segments is kept when the call is done; NULL: it
 * goes with the object. Runs on the pool. Gives *segments; report may be NULL. As tl_mesh_read, and
 * TL_ERR_IO for a temporary folder that is full; TL_ERR_ARG for options out of range. */
TL_API tl_status tl_segments_build(tl_ctx *ctx, const char *input, const tl_read_opts *read,
                                   const tl_segment_opts *opts, const char *path,
                                   tl_segments **segments, tl_read_report *report);
/* The same of several steps of one mesh, [step_count], at least 1: the channels of each know their
 * step; read says nothing of steps. The steps are read one after another. TL_ERR_DATA when the mesh
 * of a step is not that of the first. */
TL_API tl_status tl_segments_build_series(tl_ctx *ctx, const tl_step *steps, size_t step_count,
                                          const tl_read_opts *read, const tl_segment_opts *opts,
                                          const char *path, tl_segments **segments,
                                          tl_read_report *report);
/* The same of a mesh in memory, borrowed during the call. */
TL_API tl_status tl_segments_build_mesh(tl_ctx *ctx, const tl_mesh *mesh,
                                        const tl_segment_opts *opts, const char *path,
                                        tl_segments **segments);
/* Opens a file that was kept. TL_ERR_IO, TL_ERR_FORMAT. Gives *segments. */
TL_API tl_status tl_segments_open(tl_ctx *ctx, const char *path, tl_segments **segments);
/* NULL is allowed. */
TL_API void tl_segments_destroy(tl_segments *segments);

/* Of the whole: tets; different vertices that tets use; the first index past all vertex ids; time
 * (NaN: none). */
TL_API uint32_t tl_segments_count(const tl_segments *segments);
TL_API uint64_t tl_segments_tet_count(const tl_segments *segments);
TL_API uint64_t tl_segments_vert_count(const tl_segments *segments);
TL_API uint64_t tl_segments_id_end(const tl_segments *segments);
TL_API double tl_segments_time(const tl_segments *segments);
TL_API bool tl_segments_has_regions(const tl_segments *segments);
TL_API bool tl_segments_has_adjacency(const tl_segments *segments);
/* Bytes of the file. */
TL_API uint64_t tl_segments_bytes(const tl_segments *segments);
TL_API size_t tl_segments_channel_count(const tl_segments *segments);
TL_API const tl_segment_channel *tl_segments_channel(const tl_segments *segments, size_t index);
/* Components of all channels on vertices (on tets) together. */
TL_API uint32_t tl_segments_components(const tl_segments *segments, tl_on on);

/* What is known of a segment without loading it. */
typedef struct tl_segment_summary {
    uint32_t tet_count, vert_count;
    uint32_t shared_count;      /* vertices that other segments hold as well */
    const uint32_t *neighbours; /* ascending segment ids, borrowed; at slot s + 1 */
    uint32_t neighbour_count;
    double bounds[6]; /* x0, x1, y0, y1, z0, z1 of its vertices, in mesh units */
} tl_segment_summary;
TL_API tl_segment_summary tl_segments_info(const tl_segments *segments, uint32_t segment);

/* "No face on the other side". */
#define TL_OPPOSITE_NONE UINT32_MAX

/* In a link: a lower segment holds the vertex. */
#define TL_LINK_COPY 0x80000000u
/* Slot and local index of a link. */
#define TL_LINK_SLOT(link) ((link) >> 16 & 0x3fffu)
#define TL_LINK_LOCAL(link) ((link)&0xffffu)

/* A segment in memory. Arrays live until tl_segment_release. */
typedef struct tl_segment {
    uint32_t id;
    uint32_t vert_count, tet_count;
    const uint64_t *vert_ids; /* [vert_count] index in the source; those whose home is this segment
                                 first, ascending; the others grouped by their home */
    const double *xyz;        /* [vert_count][3] in mesh units */
    const double *values;     /* [vert_count][components on vertices], channels one after another */
    const uint32_t *links;    /* [vert_count] the next copy: slot << 16 | local index there; slot 0:
                                 this    segment, and the vertex is not shared; slot s: neighbours[s -
                                 1].    Following links comes back to the vertex over all its copies */
    const uint16_t *tets;     /* [tet_count][4] local indices; ascending order of the source */
    const int32_t *regions;   /* [tet_count] or NULL */
    const double *tet_values; /* [tet_count][components on tets] */
    const uint32_t *opposites; /* [tet_count][4] the face on the other side, slot << 18 | tet << 2 |
                                  face, slots as above, or TL_OPPOSITE_NONE on the boundary and
                                  where a face has more than two tets. NULL: no adjacency */
    const uint32_t *neighbours; /* [neighbour_count], borrowed from the whole */
    uint32_t neighbour_count;
    void *block; /* internal */
} tl_segment;

/* Reads a segment. ctx: that of the calling thread, where several load at once (else that of
 * segments). Gives what hangs on *segment. TL_ERR_IO. */
TL_API tl_status tl_segments_load(tl_ctx *ctx, const tl_segments *segments, uint32_t segment,
                                  tl_segment *out);
TL_API void tl_segment_release(tl_ctx *ctx, tl_segment *segment);

/* Proves a segmented mesh: counts and indices in range, boxes, orders (fast); links that close over
 * copies of the same vertex, opposites that answer each other over the same three vertices, faces
 * without one that no other tet has, neighbours that name each other (full). TL_ERR_DATA names the
 * segment and the element. Runs on the pool. */
TL_API tl_status tl_segments_check(tl_ctx *ctx, const tl_segments *segments, tl_check_level level);

/* ---- the stream ---- */

/* An order in which segments are loaded and released, so that each is in memory together with every
 * one of its neighbours, and few are at a time (Sondershaus 2007, 6.1.3). */
typedef struct tl_stream {
    int32_t *tags; /* [tag_count] s: load segment s; -s - 1: release it, it and its neighbours were
                      loaded. Each segment once each */
    size_t tag_count;
    uint32_t max_segments; /* in memory at the same time, at most */
    uint64_t max_tets;
} tl_stream;
/* Gives what hangs on *stream. Depends on boxes and neighbours alone. */
TL_API tl_status tl_segments_stream(tl_ctx *ctx, const tl_segments *segments, tl_stream *stream);
TL_API void tl_stream_release(tl_ctx *ctx, tl_stream *stream);

/* ---- simplification ---- */

/* What was reached. */
typedef struct tl_stream_result {
    uint64_t tets_in, tets_out, vertices_in, vertices_out;
    uint64_t inverted, degenerate; /* tets of the result that are negative, flat */
    double boundary_error; /* bound on the two-sided distance of the boundaries and interfaces */
    unsigned rounds;
    uint32_t clusters; /* of the first round: 1 means that nothing was held at a border */
    bool target_reached;
    double seconds;    /* all but reading and writing of files */
    size_t peak_bytes; /* of the context */
} tl_stream_result;

/* Simplifies the data set of a file that need not fit into memory and streams the result to a .vtu
 * or .vtk file. Clusters of neighbouring segments are simplified as tl_mesh_simplify does, with
 * their common vertices locked; the next round cuts the rest into other clusters, so that those are
 * inside. The last round meets the target. A mesh of one cluster is simplified as a whole. With an
 * error bound there is one round alone: the bound holds at every original vertex, and what lies at
 * the borders of clusters keeps its tets. simplify: locked and listener must be NULL. The clusters
 * depend on the memory, not on the number of threads. result and report may be NULL. As
 * tl_segments_build and tl_mesh_simplify. */
TL_API tl_status tl_simplify_stream(tl_ctx *ctx, const char *input, const tl_read_opts *read,
                                    const tl_simplify_opts *simplify, const tl_segment_opts *opts,
                                    const char *output, const tl_write_opts *write,
                                    tl_stream_result *result, tl_read_report *report);

#ifdef __cplusplus
}
#endif
#endif
