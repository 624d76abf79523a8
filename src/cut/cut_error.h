/* Stage cut, internal: how far a segment is from what is asked for. */
#ifndef TETRALOD_SRC_CUT_ERROR_H
#define TETRALOD_SRC_CUT_ERROR_H

#include "cut/cut_camera.h"
#include "cut/cut_graph.h"

/* A query, checked and copied. What only depends on the query is kept in the nodes, under the
 * number of its generation, which stays the same while only the camera moves. */
typedef struct tli_asked {
    tl_ctx *ctx;
    size_t channel_count;
    uint32_t generation;
    tl_cut_bounds inside, outside; /* channels point to own copies, or are NULL */
    float *opacity, *unseen;       /* [channel_count][TL_BINS] or NULL */
    double box[6];
    bool has_box, has_camera;
    bool spends; /* no bound, no pixels, no level: budgets alone steer */
    tli_view view;
    double pixels;
    uint32_t level;
    uint64_t tets_max, bytes_max;
} tli_asked;

/* Takes over a query in place of the one before; on failure that one stays. head: of the store. */
tl_status tli_asked_set(tli_asked *asked, const tl_store_head *head, const tl_cut_query *query);
void tli_asked_release(tli_asked *asked);

/* By what factor the segment's error is above what is asked for: refine where it is above 1. */
tl_status tli_severity(const tli_asked *asked, tli_dag *graph, uint32_t segment, double *severity);
/* How far isosurfaces of visible values are from their places there, mesh units, and with a camera
 * by how many pixels these or the boundary are off: 0 out of view. After tli_severity. */
void tli_seen_error(const tli_asked *asked, const tli_dag *graph, uint32_t segment, double *space,
                    double *pixels);
/* True if the finest patches keep the bounds that hold without a view and everywhere. */
bool tli_leaves_keep(const tli_asked *asked, const tl_store_head *head);

#endif
