/* Graphs to parts without a library: recursive bisection. A half is what a breadth-first walk from
 * a node at the rim reaches first; then nodes at the cut change sides as long as that shortens it
 * and keeps the balance. Weaker than METIS by some tenths of the cut, and slower per part; here so
 * that a build without METIS does the same work. */
#include "segment/segment_octree.h"

#include <string.h>

#define REFINE_ROUNDS 8
/* A half may be that part of its weight above what it should have. */
#define SLACK 0.01

typedef struct bisection {
    const tli_graph *graph;
    uint32_t *nodes; /* all nodes, those of one part in a row */
    uint32_t *queue; /* [node_count] */
    uint32_t *group; /* [node_count] the part a node is in now */
    uint32_t *seen;  /* [node_count] number of the walk that saw it last */
    uint32_t walk;
} bisection;

/* Nodes of group in breadth-first order from start into queue; returns how many. Pieces that hang
 * together otherwise follow one after the other. */
static uint32_t walk_from(bisection *b, const uint32_t *nodes, uint32_t count, uint32_t group,
                          uint32_t start)
{
    const tli_graph *g = b->graph;
    uint32_t head = 0, tail = 0, next = 0;
    b->walk++;
    b->queue[tail++] = start;
    b->seen[start] = b->walk;
    while (tail < count || head < tail) {
        if (head == tail) {
            while (b->seen[nodes[next]] == b->walk) next++;
            b->seen[nodes[next]] = b->walk;
            b->queue[tail++] = nodes[next];
        }
        uint32_t node = b->queue[head++];
        for (uint32_t e = g->begins[node]; e < g->begins[node + 1]; e++) {
            uint32_t other = g->targets[e];
            if (b->group[other] != group || b->seen[other] == b->walk) continue;
            b->seen[other] = b->walk;
            b->queue[tail++] = other;
        }
    }
    return tail;
}

/* What the cut between two groups gets shorter by if node changes from one to the other. */
static int64_t gain_of(const bisection *b, uint32_t node, uint32_t from, uint32_t to)
{
    const tli_graph *g = b->graph;
    int64_t gain = 0;
    for (uint32_t e = g->begins[node]; e < g->begins[node + 1]; e++) {
        uint32_t group = b->group[g->targets[e]];
        gain += group == to ? (int64_t)g->weights[e] : 0;
        gain -= group == from ? (int64_t)g->weights[e] : 0;
    }
    return gain;
}

/* Moves nodes over the cut while it gets shorter and both halves stay within their limits. */
static void refine(bisection *b, const uint32_t *nodes, uint32_t count, uint32_t a, uint32_t c,
                   uint64_t *weight_a, uint64_t low, uint64_t high)
{
    for (int turn = 0; turn < REFINE_ROUNDS; turn++) {
        uint32_t moved = 0;
        for (uint32_t i = 0; i < count; i++) {
            uint32_t node = nodes[i], from = b->group[node], to = from == a ? c : a;
            uint64_t weight = b->graph->node_weights[node];
            uint64_t after = from == a ? *weight_a - weight : *weight_a + weight;
            if (after < low || after > high || gain_of(b, node, from, to) <= 0) continue;
            b->group[node] = to;
            *weight_a = after;
            moved++;
        }
        if (!moved) break;
    }
}

/* Divides nodes [count] of group first into part_count groups first .. first + part_count - 1. */
static void divide(bisection *b, uint32_t *nodes, uint32_t count, uint32_t first,
                   uint32_t part_count)
{
    while (part_count > 1 && count > 1) {
        uint32_t left_parts = part_count / 2, other = first + left_parts;
        uint64_t sum = 0, left = 0;
        for (uint32_t i = 0; i < count; i++) sum += b->graph->node_weights[nodes[i]];
        uint64_t wanted =
            sum / part_count * left_parts + sum % part_count * left_parts / part_count;
        walk_from(b, nodes, count, first, nodes[0]);
        walk_from(b, nodes, count, first, b->queue[count - 1]);
        for (uint32_t i = 0; i < count; i++) {
            uint64_t weight = b->graph->node_weights[b->queue[i]];
            bool is_left = i == 0 || (left + weight / 2 <= wanted && i + 1 < count);
            b->group[b->queue[i]] = is_left ? first : other;
            left += is_left ? weight : 0;
        }
        uint64_t slack = (uint64_t)((double)wanted * SLACK);
        refine(b, nodes, count, first, other, &left, wanted - slack, wanted + slack);
        /* stable: the left half to the front */
        uint32_t kept = 0, moved = 0;
        for (uint32_t i = 0; i < count; i++) {
            if (b->group[nodes[i]] == first)
                nodes[kept++] = nodes[i];
            else
                b->queue[moved++] = nodes[i];
        }
        memcpy(nodes + kept, b->queue, moved * sizeof *nodes);
        divide(b, nodes, kept, first, left_parts);
        nodes += kept;
        count = moved;
        first = other;
        part_count -= left_parts;
    }
}

tl_status tli_graph_bisect(tl_ctx *ctx, const tli_graph *graph, uint32_t part_count,
                           uint32_t *parts)
{
    tl_status st = TL_OK;
    uint32_t n = graph->node_count;
    bisection b = {.graph = graph, .group = parts};
    b.nodes = tl_mem_alloc(ctx, n, sizeof *b.nodes, &st);
    b.queue = tl_mem_alloc(ctx, n, sizeof *b.queue, &st);
    b.seen = tl_mem_zalloc(ctx, n, sizeof *b.seen, &st);
    for (uint32_t i = 0; !st && i < n; i++) {
        b.nodes[i] = i;
        parts[i] = 0;
    }
    if (!st) divide(&b, b.nodes, n, 0, part_count);
    tl_mem_free(ctx, b.seen);
    tl_mem_free(ctx, b.queue);
    tl_mem_free(ctx, b.nodes);
    return st;
}

#ifndef TETRALOD_METIS
tl_status tli_graph_partition(tl_ctx *ctx, const tli_graph *graph, uint32_t part_count,
                              uint32_t *parts)
{
    return tli_graph_bisect(ctx, graph, part_count, parts);
}
#endif
