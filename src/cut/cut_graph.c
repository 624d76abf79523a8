/* The graph of a model, node by node as it is asked for. */
#include "cut/cut_graph.h"

#include <string.h>

tl_status tli_dag_open(tl_ctx *ctx, tl_store *store, tli_dag *graph)
{
    tl_status st = TL_OK;
    const tl_store_head *head = tl_store_get_head(store);
    *graph = (tli_dag){.ctx = ctx, .store = store, .head = head};
    graph->nodes = tl_mem_zalloc(ctx, head->segment_count, sizeof *graph->nodes, &st);
    graph->gains = tl_mem_zalloc(ctx, head->segment_count, sizeof *graph->gains, &st);
    graph->arcs = tl_mem_zalloc(ctx, head->patch_count, sizeof *graph->arcs, &st);
    return st;
}

void tli_dag_close(tli_dag *graph)
{
    tl_mem_free(graph->ctx, graph->links);
    tl_mem_free(graph->ctx, graph->arcs);
    tl_mem_free(graph->ctx, graph->gains);
    tl_mem_free(graph->ctx, graph->nodes);
}

/* Sum of the squared errors of all channels on vertices, each relative to its range. */
static float relative_square_error(const tl_store_head *head, const tl_patch_info *info)
{
    double sum = 0;
    for (size_t c = 0; c < head->channel_count; c++) {
        const tl_store_channel *channel = &head->channels[c];
        double range = channel->range[1] - channel->range[0];
        if (channel->on == TL_ON_VERTEX && range > 0)
            sum += info->square_error[c] / (range * range);
    }
    return (float)sum;
}

static tl_status load_arc(tli_dag *graph, uint32_t patch)
{
    tl_patch_info info;
    tl_status st = tl_store_patch(graph->ctx, graph->store, patch, &info);
    if (st) return st;
    uint64_t bytes = info.topology_bytes;
    for (size_t c = 0; c < graph->head->channel_count; c++) bytes += info.channel_bytes[c];
    graph->arcs[patch] = (tli_arc){.producer = info.producer,
                                   .consumer = info.consumer,
                                   .tets = info.tet_count,
                                   .verts = info.vert_count,
                                   .bytes = bytes < UINT32_MAX ? (uint32_t)bytes : UINT32_MAX,
                                   .square_error = relative_square_error(graph->head, &info),
                                   .loaded = true};
    return TL_OK;
}

tl_status tli_dag_arc(tli_dag *graph, uint32_t patch, const tli_arc **arc)
{
    *arc = &graph->arcs[patch];
    return (*arc)->loaded ? TL_OK : load_arc(graph, patch);
}

/* Adds a link unless those from begin on have it. */
static tl_status add_link(tli_dag *graph, size_t begin, uint32_t segment)
{
    tl_status st = TL_OK;
    if (segment == TL_NONE) return st;
    for (size_t i = begin; i < graph->link_count; i++)
        if (graph->links[i] == segment) return st;
    if (graph->link_count == graph->link_capacity) {
        size_t capacity = graph->link_capacity ? 2 * graph->link_capacity : 1024;
        graph->links = tl_mem_resize(graph->ctx, graph->links, capacity, sizeof *graph->links, &st);
        if (st) return st;
        graph->link_capacity = capacity;
    }
    graph->links[graph->link_count++] = segment;
    return st;
}

static void add_gain(tli_gain *gain, const tli_arc *arc, int sign)
{
    gain->tets += sign * (int64_t)arc->tets;
    gain->verts += sign * (int64_t)arc->verts;
    gain->bytes += sign * (int64_t)arc->bytes;
    gain->square_error -= sign * (double)arc->square_error;
}

static tl_status load_node(tli_dag *graph, uint32_t segment)
{
    tl_segment_info info;
    const tli_arc *arc;
    tli_node node = {.loaded = true};
    tli_gain gain = {0};
    size_t begin = graph->link_count;
    tl_status st = tl_store_segment(graph->ctx, graph->store, segment, &info);
    if (st) return st;
    memcpy(node.sphere, info.sphere, sizeof node.sphere);
    node.level = info.level;
    node.first_patch = info.first_patch;
    node.patch_count = info.patch_count;
    for (uint32_t i = 0; !st && i < info.patch_count; i++) {
        st = tli_dag_arc(graph, info.first_patch + i, &arc);
        if (!st) st = add_link(graph, begin, arc->producer);
        if (!st) add_gain(&gain, arc, 1);
    }
    size_t middle = graph->link_count;
    for (uint32_t i = 0; !st && i < info.output_count; i++) {
        st = tli_dag_arc(graph, info.outputs[i], &arc);
        if (!st) st = add_link(graph, middle, arc->consumer);
        if (!st) add_gain(&gain, arc, -1);
    }
    if (st) {
        graph->link_count = begin;
        return st;
    }
    node.first_link = (uint32_t)begin;
    node.child_count = (uint32_t)(middle - begin);
    node.parent_count = (uint32_t)(graph->link_count - middle);
    graph->nodes[segment] = node;
    graph->gains[segment] = gain;
    return TL_OK;
}

tl_status tli_dag_node(tli_dag *graph, uint32_t segment, tli_node **node)
{
    *node = &graph->nodes[segment];
    return (*node)->loaded ? TL_OK : load_node(graph, segment);
}
