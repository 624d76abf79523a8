/* Stage segment, internal: partitions of space into parts of about equally many points. Octree over
 * points that stream by, its leaves merged to parts (Sondershaus 2007, 6.1.1). */
#ifndef TETRALOD_SRC_SEGMENT_OCTREE_H
#define TETRALOD_SRC_SEGMENT_OCTREE_H

#include "base/base.h"

/* Levels below the root: a leaf is not smaller than 2^-21 of the box's longest side. */
#define TLI_OCTREE_LEVELS 21u

/* Hands over points [first, first + count): xyz [count][3]; missing [count] is zero and may be set
 * to 1 for points that do not count. Called on one thread. */
typedef tl_status (*tli_points_fn)(void *user, uint64_t first, size_t count, double *xyz,
                                   uint8_t *missing);

typedef struct tli_octree_opts {
    uint64_t leaf_points;   /* most points of a leaf (but for points at one place), >= 1 */
    uint64_t memory_bytes;  /* for counting, about */
    const double *rotation; /* [9] rows of a matrix that points are turned by first; NULL: none */
    const char *stage;      /* name for the progress */
} tli_octree_opts;

/* Leaves with points in the order of their Morton codes; an empty leaf belongs to the one before
 * it. Immutable once built, but for the parts. */
typedef struct tli_octree {
    tl_ctx *ctx;
    double rotation[9];
    bool is_rotated;
    double low[3], scale; /* grid of 2^21 cells along the longest side */
    size_t leaf_count;    /* at least 1 */
    uint64_t *codes;      /* [leaf_count] first code of a leaf */
    uint8_t *levels;      /* [leaf_count] 0: the whole */
    uint64_t *counts;     /* [leaf_count] points */
    uint32_t *top;        /* first leaf that may hold a code with given top bits */
    uint32_t *parts;      /* [leaf_count] part of a leaf; set by tli_octree_merge */
    uint32_t part_count;
    uint64_t *part_points; /* [part_count], ascending */
} tli_octree;

/* Points that are not finite lie in the first leaf. Runs on the pool. Gives what hangs on *octree;
 * on failure there is nothing to close. */
tl_status tli_octree_build(tl_ctx *ctx, uint64_t point_count, tli_points_fn points, void *user,
                           const tli_octree_opts *opts, tli_octree *octree);
void tli_octree_close(tli_octree *octree);

/* Merges leaves to about part_count parts with equally many points each, numbered ascending by
 * their points. Deterministic. */
tl_status tli_octree_merge(tli_octree *octree, uint32_t part_count);

/* The leaf, and the part, that hold a point. Any thread. */
size_t tli_octree_leaf(const tli_octree *octree, const double xyz[3]);
static inline uint32_t tli_octree_find(const tli_octree *octree, const double xyz[3])
{
    return octree->parts[tli_octree_leaf(octree, xyz)];
}

/* ---- graphs ---- */

/* An undirected graph: neighbours of node i are targets[begins[i]] .. targets[begins[i + 1] - 1],
 * each edge in both directions with the same weight. */
typedef struct tli_graph {
    uint32_t node_count;
    uint32_t *begins;       /* [node_count + 1] */
    uint32_t *targets;      /* [begins[node_count]] */
    uint32_t *weights;      /* of edges, >= 1 */
    uint32_t *node_weights; /* [node_count], >= 1 */
} tli_graph;

/* Leaves that touch in a face; the weight of an edge is about the number of tet faces that lie in
 * it. Gives what hangs on *graph. */
tl_status tli_octree_graph(const tli_octree *octree, tli_graph *graph);
void tli_graph_close(tl_ctx *ctx, tli_graph *graph);

/* parts [node_count] receives numbers below part_count, of which some may be unused: balanced by
 * the weights of nodes, with a small cut. Deterministic. segment_metis.c, or segment_bisect.c where
 * the library is not there. */
tl_status tli_graph_partition(tl_ctx *ctx, const tli_graph *graph, uint32_t part_count,
                              uint32_t *parts);
/* Recursive bisection along a breadth-first order from a far node; no library. */
tl_status tli_graph_bisect(tl_ctx *ctx, const tli_graph *graph, uint32_t part_count,
                           uint32_t *parts);

#endif
