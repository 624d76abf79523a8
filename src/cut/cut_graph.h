/* Stage cut, internal: the graph of a model as far as it was looked at. Pages of the index are read
 * when a segment is first asked for; what a cut needs of it then lies in flat arrays. */
#ifndef TETRALOD_SRC_CUT_GRAPH_H
#define TETRALOD_SRC_CUT_GRAPH_H

#include "base/base.h"
#include "tetralod/store.h"

/* What refining a segment adds; of several together the sums. */
typedef struct tli_gain {
    int64_t tets, verts, bytes;
    double square_error; /* what goes away, of all vertex channels, relative to their ranges */
} tli_gain;

typedef struct tli_node {
    double sphere[4];
    /* how far the segment is from what is asked, for the query numbered generation: cut_error.c */
    double severity, severity_outside;
    double space_error,
        seen_error; /* of visible values; of these and of the boundary; mesh units */
    uint32_t generation;
    uint32_t level;
    uint32_t first_patch, patch_count; /* inputs */
    uint32_t first_link; /* producers of inputs, then consumers of outputs, each once */
    uint32_t child_count, parent_count;
    bool loaded;
} tli_node;

typedef struct tli_arc {
    uint32_t producer, consumer; /* segments, or TL_NONE */
    uint32_t tets, verts;
    uint32_t bytes;
    float square_error;
    bool loaded;
} tli_arc;

typedef struct tli_dag {
    tl_ctx *ctx;
    tl_store *store; /* borrowed */
    const tl_store_head *head;
    tli_node *nodes; /* [segment count] */
    tli_gain *gains; /* [segment count] */
    tli_arc *arcs;   /* [patch count] */
    uint32_t *links;
    size_t link_count, link_capacity;
} tli_dag;

tl_status tli_dag_open(tl_ctx *ctx, tl_store *store, tli_dag *graph);
void tli_dag_close(tli_dag *graph);
/* *node stays where it is as long as the graph. */
tl_status tli_dag_node(tli_dag *graph, uint32_t segment, tli_node **node);
tl_status tli_dag_arc(tli_dag *graph, uint32_t patch, const tli_arc **arc);

static inline const uint32_t *tli_node_children(const tli_dag *graph, const tli_node *node)
{
    return graph->links + node->first_link;
}

static inline const uint32_t *tli_node_parents(const tli_dag *graph, const tli_node *node)
{
    return graph->links + node->first_link + node->child_count;
}

#endif
