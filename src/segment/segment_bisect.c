/* Graphs to parts without a library: halves of halves (segment_halve.c). Here so that a build
 * without METIS does the same work; cuts are as short as those of METIS within some percent
 * (docs/notes/2026-11-22-partitions.md). */
#include "segment/segment_halve.h"
#include "segment/segment_octree.h"

#include <math.h>

/* A part's weight over the mean at most, where the nodes allow it; METIS is told the same. */
#define IMBALANCE 1.1

typedef struct bisection {
    tl_ctx *ctx;
    double part_max;  /* weight of a part at most */
    uint32_t *parts;  /* [nodes of the whole] */
    uint32_t *number; /* [nodes of the whole] scratch: of a node in its half */
} bisection;

static tl_status divide(bisection *b, const tli_graph *graph, const uint32_t *nodes, uint32_t first,
                        uint32_t part_count);

/* The nodes of one side with the edges among them, divided further. */
static tl_status divide_side(bisection *b, const tli_graph *graph, const uint32_t *nodes,
                             const uint8_t *side, uint8_t which, uint32_t first,
                             uint32_t part_count)
{
    tl_status st = TL_OK;
    tli_graph half = {0};
    uint32_t count = 0, edges = 0;
    for (uint32_t i = 0; i < graph->node_count; i++) {
        if (side[i] != which) continue;
        b->number[i] = count++;
        edges += graph->begins[i + 1] - graph->begins[i];
    }
    if (!count) return TL_OK;
    uint32_t *kept = tl_mem_alloc(b->ctx, count, sizeof *kept, &st);
    half.begins = tl_mem_alloc(b->ctx, (size_t)count + 1, sizeof *half.begins, &st);
    half.targets = tl_mem_alloc(b->ctx, edges, sizeof *half.targets, &st);
    half.weights = tl_mem_alloc(b->ctx, edges, sizeof *half.weights, &st);
    half.node_weights = tl_mem_alloc(b->ctx, count, sizeof *half.node_weights, &st);
    edges = 0;
    for (uint32_t i = 0; !st && i < graph->node_count; i++) {
        if (side[i] != which) continue;
        uint32_t n = half.node_count++;
        kept[n] = nodes[i];
        half.node_weights[n] = graph->node_weights[i];
        half.begins[n] = edges;
        for (uint32_t e = graph->begins[i]; e < graph->begins[i + 1]; e++) {
            if (side[graph->targets[e]] != which) continue;
            half.targets[edges] = b->number[graph->targets[e]];
            half.weights[edges++] = graph->weights[e];
        }
    }
    if (!st) {
        half.begins[count] = edges;
        st = divide(b, &half, kept, first, part_count);
    }
    tli_graph_close(b->ctx, &half);
    tl_mem_free(b->ctx, kept);
    return st;
}

/* Divides a graph, whose nodes are those of the whole in nodes, into parts first .. first +
 * part_count - 1. What a part may still be too heavy by is shared by the divisions to come. */
static tl_status divide(bisection *b, const tli_graph *graph, const uint32_t *nodes, uint32_t first,
                        uint32_t part_count)
{
    tl_status st = TL_OK;
    uint64_t sum = 0;
    if (part_count < 2 || graph->node_count < 2) {
        for (uint32_t i = 0; i < graph->node_count; i++) b->parts[nodes[i]] = first;
        return TL_OK;
    }
    for (uint32_t i = 0; i < graph->node_count; i++) sum += graph->node_weights[i];
    uint32_t left_parts = part_count / 2;
    double share = (double)sum * left_parts / part_count;
    double room = b->part_max * part_count / (double)sum;
    double slack = room > 1 ? share * (pow(room, 1 / ceil(log2(part_count))) - 1) : 0;
    uint8_t *side = tl_mem_alloc(b->ctx, graph->node_count, sizeof *side, &st);
    if (!st) st = tli_graph_halve(b->ctx, graph, (uint64_t)share, (uint64_t)slack, side);
    if (!st) st = divide_side(b, graph, nodes, side, 0, first, left_parts);
    if (!st)
        st = divide_side(b, graph, nodes, side, 1, first + left_parts, part_count - left_parts);
    tl_mem_free(b->ctx, side);
    return st;
}

tl_status tli_graph_bisect(tl_ctx *ctx, const tli_graph *graph, uint32_t part_count,
                           uint32_t *parts)
{
    tl_status st = TL_OK;
    bisection b = {.ctx = ctx, .parts = parts};
    uint32_t *nodes = tl_mem_alloc(ctx, graph->node_count, sizeof *nodes, &st);
    b.number = tl_mem_alloc(ctx, graph->node_count, sizeof *b.number, &st);
    for (uint32_t i = 0; !st && i < graph->node_count; i++) {
        nodes[i] = i;
        b.part_max += IMBALANCE * graph->node_weights[i] / part_count;
    }
    if (!st) st = divide(&b, graph, nodes, 0, part_count);
    tl_mem_free(ctx, b.number);
    tl_mem_free(ctx, nodes);
    return st;
}

#ifndef TETRALOD_METIS
tl_status tli_graph_partition(tl_ctx *ctx, const tli_graph *graph, uint32_t part_count,
                              uint32_t *parts)
{
    return tli_graph_bisect(ctx, graph, part_count, parts);
}
#endif
