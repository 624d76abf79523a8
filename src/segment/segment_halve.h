/* Stage segment, internal: one graph in two. */
#ifndef TETRALOD_SRC_SEGMENT_HALVE_H
#define TETRALOD_SRC_SEGMENT_HALVE_H

#include "segment/segment_octree.h"

/* side [node_count] receives 0 or 1: nodes of side 0 weigh wanted together, off by at most slack
 * where the nodes allow it; the cut is small. graph has at least 1 node. Deterministic. */
tl_status tli_graph_halve(tl_ctx *ctx, const tli_graph *graph, uint64_t wanted, uint64_t slack,
                          uint8_t *side);

#endif
