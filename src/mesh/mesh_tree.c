/* Building the tree of boxes: tets in Hilbert order of their centroids, four to a leaf, four nodes
 * to a node above. No pointers: a node's children follow from its number. Boxes are float32 around
 * the centre of the mesh, rounded outwards: they only choose which tets are looked at. */
#include "mesh/mesh_tree.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "base/base_vec.h"

/* Tets, or blocks, of a piece for the pool. */
#define PIECE_TETS 32768
#define PIECE_BLOCKS 4096

typedef struct building {
    const tl_mesh *mesh;
    tli_tree *tree;
    double *centroids; /* [tet_count][3] */
    unsigned level;
    size_t node_count; /* of the level */
} building;

float tli_float_below(double x)
{
    if (x >= (double)FLT_MAX) return FLT_MAX;
    if (x < -(double)FLT_MAX) return -INFINITY;
    float f = (float)x;
    return (double)f > x ? nextafterf(f, -INFINITY) : f;
}

float tli_float_above(double x)
{
    return -tli_float_below(-x);
}

/* A tet with a corner that is not finite gets a centroid that is not, and comes last. */
static tl_status find_centroids(void *arg, size_t begin, size_t end, unsigned worker)
{
    building *b = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        double p[4][3];
        tli_tet_corners(b->mesh->xyz, b->mesh->tets + 4 * t, p);
        for (int k = 0; k < 3; k++)
            b->centroids[3 * t + (size_t)k] =
                0.25 * p[0][k] + 0.25 * p[1][k] + 0.25 * p[2][k] + 0.25 * p[3][k];
    }
    return TL_OK;
}

static size_t count_finite(const building *b)
{
    size_t count = b->mesh->tet_count;
    while (count) {
        if (vec_is_finite(b->centroids + 3 * (size_t)b->tree->order[count - 1])) break;
        count--;
    }
    return count;
}

static void set_center(const building *b)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < b->tree->item_count; i++) {
        for (size_t k = 0; k < 3; k++) {
            double x = b->centroids[3 * (size_t)b->tree->order[i] + k];
            low[k] = x < low[k] ? x : low[k];
            high[k] = x > high[k] ? x : high[k];
        }
    }
    for (int k = 0; k < 3; k++)
        b->tree->center[k] = b->tree->item_count ? low[k] / 2 + high[k] / 2 : 0;
}

static void leaf_box(const building *b, size_t leaf, double low[3], double high[3])
{
    const tli_tree *tree = b->tree;
    size_t begin = leaf * TLI_TREE_WIDTH, end = begin + TLI_TREE_WIDTH;
    if (end > tree->item_count) end = tree->item_count;
    for (size_t i = begin; i < end; i++) {
        const tl_lidx *tet = b->mesh->tets + 4 * (size_t)tree->order[i];
        for (int c = 0; c < 4; c++) {
            for (size_t k = 0; k < 3; k++) {
                double x = b->mesh->xyz[3 * (size_t)tet[c] + k] - tree->center[k];
                low[k] = x < low[k] ? x : low[k];
                high[k] = x > high[k] ? x : high[k];
            }
        }
    }
}

static void inner_box(const building *b, size_t node, double low[3], double high[3])
{
    const tli_tree_block *block = b->tree->blocks + b->tree->level_begins[b->level - 1] + node;
    for (int k = 0; k < 3; k++) {
        for (int c = 0; c < TLI_TREE_WIDTH; c++) {
            low[k] = (double)block->low[k][c] < low[k] ? (double)block->low[k][c] : low[k];
            high[k] = (double)block->high[k][c] > high[k] ? (double)block->high[k][c] : high[k];
        }
    }
}

static tl_status find_boxes(void *arg, size_t begin, size_t end, unsigned worker)
{
    building *b = arg;
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        tli_tree_block *block = b->tree->blocks + b->tree->level_begins[b->level] + i;
        for (size_t c = 0; c < TLI_TREE_WIDTH; c++) {
            double low[3] = {INFINITY, INFINITY, INFINITY},
                   high[3] = {-INFINITY, -INFINITY, -INFINITY};
            size_t node = i * TLI_TREE_WIDTH + c;
            if (node < b->node_count) (b->level ? inner_box : leaf_box)(b, node, low, high);
            for (int k = 0; k < 3; k++) {
                block->low[k][c] = low[k] <= high[k] ? tli_float_below(low[k]) : INFINITY;
                block->high[k][c] = low[k] <= high[k] ? tli_float_above(high[k]) : -INFINITY;
            }
        }
    }
    return TL_OK;
}

static size_t quarter(size_t count)
{
    return (count + TLI_TREE_WIDTH - 1) / TLI_TREE_WIDTH;
}

static tl_status build_levels(tl_ctx *ctx, building *b)
{
    tli_tree *tree = b->tree;
    if (tree->item_count == 0) return TL_OK;
    size_t block_count = 0, leaf_count = quarter(tree->item_count);
    for (size_t nodes = leaf_count;; nodes = quarter(nodes)) {
        TL_ASSERT(tree->level_count < TLI_TREE_LEVELS);
        tree->level_begins[tree->level_count++] = block_count;
        block_count += quarter(nodes);
        if (nodes <= TLI_TREE_WIDTH) break;
    }
    tl_status st = TL_OK;
    tree->blocks = tl_mem_alloc(ctx, block_count, sizeof *tree->blocks, &st);
    b->node_count = leaf_count;
    for (b->level = 0; b->level < tree->level_count && !st; b->level++) {
        st = tli_parallel(ctx, quarter(b->node_count), PIECE_BLOCKS, find_boxes, b);
        b->node_count = quarter(b->node_count);
    }
    return st;
}

tl_status tli_tree_open(tl_ctx *ctx, const tl_mesh *mesh, tli_tree *tree)
{
    memset(tree, 0, sizeof *tree);
    building b = {.mesh = mesh, .tree = tree};
    tl_status st = TL_OK;
    tree->order = tl_mem_alloc(ctx, mesh->tet_count, sizeof *tree->order, &st);
    b.centroids = tl_mem_alloc(ctx, mesh->tet_count, 3 * sizeof *b.centroids, &st);
    if (!st) st = tli_parallel(ctx, mesh->tet_count, PIECE_TETS, find_centroids, &b);
    if (!st) st = tli_sort_hilbert(ctx, b.centroids, mesh->tet_count, tree->order);
    if (!st) {
        tree->item_count = count_finite(&b);
        set_center(&b);
    }
    tl_mem_free(ctx, b.centroids);
    if (!st) st = build_levels(ctx, &b);
    if (st) tli_tree_close(ctx, tree);
    return st;
}

void tli_tree_close(tl_ctx *ctx, tli_tree *tree)
{
    tl_mem_free(ctx, tree->blocks);
    tl_mem_free(ctx, tree->order);
    tree->blocks = NULL;
    tree->order = NULL;
}
