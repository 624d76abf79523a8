/* Stage segment, internal: segments that are loaded together as one mesh. */
#ifndef TETRALOD_SRC_SEGMENT_CLUSTER_H
#define TETRALOD_SRC_SEGMENT_CLUSTER_H

#include "segment/segment.h"

/* A division of all segments into clusters of neighbours. */
typedef struct tli_clusters {
    tl_ctx *ctx;
    const tl_segments *segments;
    uint32_t count;
    uint32_t *of;      /* [segments] cluster of a segment */
    uint32_t *begins;  /* [count + 1] into list */
    uint32_t *list;    /* segments by cluster, ascending */
    uint64_t *borders; /* [border_count] ids of the vertices in several clusters, ascending */
    size_t border_count;
    double *ranges; /* [components on vertices][2] least and largest finite value */
} tli_clusters;

/* Clusters of about so many tets. Runs on the pool. Gives what hangs on *clusters. */
tl_status tli_clusters_open(tl_ctx *ctx, const tl_segments *segments, uint64_t cluster_tets,
                            tli_clusters *clusters);
void tli_clusters_close(tli_clusters *clusters);

/* One cluster as a mesh: all channels, and behind them one more on vertices that holds their
 * indices. */
typedef struct tli_cluster {
    tl_mesh *mesh;
    uint8_t *locked;                /* [vertices] 1: in several clusters */
    uint64_t *ids;                  /* [vertices] as in the segments */
    size_t locked_count, at_border; /* at_border: tets with a locked vertex */
    size_t index_channel;
} tli_cluster;
tl_status tli_cluster_load(tl_ctx *ctx, const tli_clusters *clusters, uint32_t number,
                           tli_cluster *cluster);
void tli_cluster_release(tl_ctx *ctx, tli_cluster *cluster);

#endif
