/* Leaves of an octree to balanced parts: the graph of leaves that touch in a face is partitioned by
 * the numbers of their points (Sondershaus 2007, 6.1.1). There an edge weighs the distance of two
 * centres; here about the number of tet faces in the touching face, which is what a cut costs. */
#include "segment/segment_octree.h"

#include "base/base_sort.h"

#include <math.h>
#include <string.h>

#define LEVELS TLI_OCTREE_LEVELS
/* Weight of an edge at most; sums over a graph stay within 31 bits. */
#define EDGE_WEIGHT_MAX 10000.0

/* ---- cells by their codes ---- */

/* Every third bit of a code, packed. */
static uint32_t pack(uint64_t x)
{
    x &= 0x1249249249249249u;
    x = (x ^ x >> 2) & 0x10c30c30c30c30c3u;
    x = (x ^ x >> 4) & 0x100f00f00f00f00fu;
    x = (x ^ x >> 8) & 0x1f0000ff0000ffu;
    x = (x ^ x >> 16) & 0x1f00000000ffffu;
    return (uint32_t)((x ^ x >> 32) & 0x1fffff);
}

/* Codes are combined axis by axis with the bits of the other axes set, so that carries run through
 * them. */
static bool neighbour_code(uint64_t code, unsigned level, int axis, int direction, uint64_t *out)
{
    const uint64_t bits = (uint64_t)0x1249249249249249u << axis;
    const uint64_t step = (uint64_t)1 << (3 * (LEVELS - level) + (unsigned)axis);
    const uint32_t at = pack(code >> axis), size = 1u << (LEVELS - level);
    if (level == 0) return false;
    if (direction < 0) {
        if (at == 0) return false;
        *out = (((code & bits) - step) & bits) | (code & ~bits);
    } else {
        if (at + size >= 1u << LEVELS) return false;
        *out = (((code | ~bits) + step) & bits) | (code & ~bits);
    }
    return true;
}

/* The leaf that holds the cell of code, if it is not smaller than level; leaf_count if none. */
static size_t leaf_at(const tli_octree *octree, uint64_t code, unsigned level)
{
    size_t low = 0, high = octree->leaf_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (octree->codes[middle] <= code)
            low = middle + 1;
        else
            high = middle;
    }
    if (!low) return octree->leaf_count;
    size_t leaf = low - 1;
    uint64_t codes = (uint64_t)1 << 3 * (LEVELS - octree->levels[leaf]);
    bool holds = octree->levels[leaf] <= level && code - octree->codes[leaf] < codes;
    return holds ? leaf : octree->leaf_count;
}

/* Points per face of a leaf, were they even: (points)^(2/3). */
static double face_points(const tli_octree *octree, size_t leaf)
{
    double root = cbrt((double)octree->counts[leaf]);
    return root * root;
}

/* The touching face is that of the smaller leaf; the points of both lie at it. */
static uint32_t edge_weight(const tli_octree *octree, size_t small, size_t large)
{
    double part = ldexp(1, -2 * (int)(octree->levels[small] - octree->levels[large]));
    double points = 0.5 * (face_points(octree, small) + part * face_points(octree, large));
    double weight = 1 + 2 * points;
    return (uint32_t)(weight < EDGE_WEIGHT_MAX ? weight : EDGE_WEIGHT_MAX);
}

/* Calls for each pair of leaves that touch in a face once. Counts into begins (targets NULL), or
 * writes. */
static void visit_pairs(const tli_octree *octree, tli_graph *graph, uint32_t *places)
{
    for (size_t leaf = 0; leaf < octree->leaf_count; leaf++) {
        unsigned level = octree->levels[leaf];
        for (int side = 0; side < 6; side++) {
            uint64_t code;
            int direction = side & 1 ? 1 : -1;
            if (!neighbour_code(octree->codes[leaf], level, side / 2, direction, &code)) continue;
            size_t other = leaf_at(octree, code, level);
            if (other == octree->leaf_count) continue;
            /* of two equal ones only the one with the smaller code is asked */
            if (octree->levels[other] == level && other < leaf) continue;
            if (!graph->targets) {
                places[leaf]++;
                places[other]++;
                continue;
            }
            uint32_t weight = edge_weight(octree, leaf, other);
            graph->targets[places[leaf]] = (uint32_t)other;
            graph->weights[places[leaf]++] = weight;
            graph->targets[places[other]] = (uint32_t)leaf;
            graph->weights[places[other]++] = weight;
        }
    }
}

void tli_graph_close(tl_ctx *ctx, tli_graph *graph)
{
    tl_mem_free(ctx, graph->node_weights);
    tl_mem_free(ctx, graph->weights);
    tl_mem_free(ctx, graph->targets);
    tl_mem_free(ctx, graph->begins);
    *graph = (tli_graph){0};
}

tl_status tli_octree_graph(const tli_octree *octree, tli_graph *graph)
{
    tl_ctx *ctx = octree->ctx;
    tl_status st = TL_OK;
    size_t n = octree->leaf_count;
    if (n > INT32_MAX / 8)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "an octree of %zu leaves, at most %d can be merged",
                       n, INT32_MAX / 8);
    *graph = (tli_graph){.node_count = (uint32_t)n};
    uint32_t *places = tl_mem_zalloc(ctx, n, sizeof *places, &st);
    graph->begins = tl_mem_zalloc(ctx, n + 1, sizeof *graph->begins, &st);
    graph->node_weights = tl_mem_alloc(ctx, n, sizeof *graph->node_weights, &st);
    if (!st) {
        visit_pairs(octree, graph, places);
        for (size_t i = 0; i < n; i++) {
            graph->begins[i + 1] = graph->begins[i] + places[i];
            places[i] = graph->begins[i];
            graph->node_weights[i] =
                octree->counts[i] ? (uint32_t)octree->counts[i] : 1; /* below 2^32 points */
        }
        graph->targets = tl_mem_alloc(ctx, graph->begins[n], sizeof *graph->targets, &st);
        graph->weights = tl_mem_alloc(ctx, graph->begins[n], sizeof *graph->weights, &st);
    }
    if (!st) visit_pairs(octree, graph, places);
    tl_mem_free(ctx, places);
    if (st) tli_graph_close(ctx, graph);
    return st;
}

/* ---- parts ---- */

/* Numbers parts ascending by their points, those without any left out. part_count: of the numbers
 * that octree->parts holds. */
static tl_status number_parts(tli_octree *octree, uint32_t part_count)
{
    tl_ctx *ctx = octree->ctx;
    tl_status st = TL_OK;
    uint64_t *points = tl_mem_zalloc(ctx, part_count, sizeof *points, &st);
    uint32_t *order = tl_mem_alloc(ctx, part_count, sizeof *order, &st);
    uint32_t *numbers = tl_mem_zalloc(ctx, part_count, sizeof *numbers, &st);
    for (size_t i = 0; !st && i < octree->leaf_count; i++)
        points[octree->parts[i]] += octree->counts[i];
    for (uint32_t p = 0; !st && p < part_count; p++) order[p] = p;
    if (!st) st = tli_sort_u64(ctx, points, order, part_count);
    uint32_t empty = 0;
    while (!st && empty + 1 < part_count && points[empty] == 0) empty++;
    for (uint32_t p = empty; !st && p < part_count; p++) numbers[order[p]] = p - empty;
    for (size_t i = 0; !st && i < octree->leaf_count; i++)
        octree->parts[i] = numbers[octree->parts[i]];
    if (!st) {
        memmove(points, points + empty, (part_count - empty) * sizeof *points);
        tl_mem_free(ctx, octree->part_points);
        octree->part_points = points;
        octree->part_count = part_count - empty;
        points = NULL;
    }
    tl_mem_free(ctx, numbers);
    tl_mem_free(ctx, order);
    tl_mem_free(ctx, points);
    return st;
}

tl_status tli_octree_merge(tli_octree *octree, uint32_t part_count)
{
    tl_status st = TL_OK;
    if (part_count < 1) part_count = 1;
    if (part_count >= octree->leaf_count) {
        part_count = (uint32_t)octree->leaf_count;
        for (uint32_t i = 0; i < part_count; i++) octree->parts[i] = i;
    } else {
        tli_graph graph;
        st = tli_octree_graph(octree, &graph);
        if (st) return st;
        st = tli_graph_partition(octree->ctx, &graph, part_count, octree->parts);
        tli_graph_close(octree->ctx, &graph);
    }
    return st ? st : number_parts(octree, part_count);
}
