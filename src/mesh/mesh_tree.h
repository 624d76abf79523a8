/* Stage mesh, internal: a tree of boxes over the tets, about 12 bytes a tet. */
#ifndef TETRALOD_SRC_MESH_TREE_H
#define TETRALOD_SRC_MESH_TREE_H

#include "mesh/mesh.h"

/* Children of a node, and tets of a leaf. */
#define TLI_TREE_WIDTH 4
/* Enough for TL_MESH_TETS_MAX tets. */
#define TLI_TREE_LEVELS 16
/* Nodes that wait during a descent, at most: all but one of the children on every level. */
#define TLI_TREE_STACK (TLI_TREE_WIDTH * TLI_TREE_LEVELS)

/* Boxes of the children of a node, relative to the centre of the tree and rounded outwards. A child
 * that is not there has a box that nothing touches. */
typedef struct tli_tree_block {
    float low[3][TLI_TREE_WIDTH], high[3][TLI_TREE_WIDTH];
} tli_tree_block;

/* Node i of level 0 is a leaf: tets order[4 * i] .. The children of node i of level k are the nodes
 * 4 * i .. 4 * i + 3 of level k - 1; block i of level k - 1 holds their boxes. The topmost level
 * has one block. */
typedef struct tli_tree {
    double center[3];
    tl_lidx *order; /* [item_count] tets with finite corners along a Hilbert curve */
    size_t item_count;
    tli_tree_block *blocks;
    size_t level_begins[TLI_TREE_LEVELS]; /* first block of a level */
    unsigned level_count;                 /* 0: no tets */
} tli_tree;

/* Gives what hangs on tree. */
tl_status tli_tree_open(tl_ctx *ctx, const tl_mesh *mesh, tli_tree *tree);
void tli_tree_close(tl_ctx *ctx, tli_tree *tree);

/* A descent that waits. */
typedef struct tli_tree_node {
    tl_lidx node;
    uint32_t level;
    double square; /* of the distance to the box, for the nearest tet */
} tli_tree_node;

/* Largest float that is not above x, smallest that is not below. */
float tli_float_below(double x);
float tli_float_above(double x);

#endif
