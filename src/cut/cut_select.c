/* The smallest upward-closed set of segments that keeps the bounds: from the roots down, every
 * segment with a drawn output is looked at; one that is above its bound is refined together with
 * all consumers it depends on, which exposes the segments that made its inputs. The set does not
 * depend on the order in which segments are looked at. */
#include "cut/cut_select.h"

#include <stdlib.h>

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

void tli_ids_sort(uint32_t *ids, size_t count)
{
    qsort(ids, count, sizeof *ids, by_number);
}

static uint32_t *make_ids(tl_ctx *ctx, const tl_store_head *head, tl_status *st)
{
    return tl_mem_zalloc(ctx, head->segment_count, sizeof(uint32_t), st);
}

tl_status tli_selection_create(tl_ctx *ctx, const tl_store_head *head, tli_selection *s)
{
    tl_status st = TL_OK;
    *s = (tli_selection){.stamp = 1}; /* which no segment carries yet */
    uint32_t **arrays[] = {&s->refined,    &s->exposed,  &s->visited,  &s->list.ids,
                           &s->fringe.ids, &s->work.ids, &s->heap.ids, &s->put_off.ids};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        *arrays[i] = make_ids(ctx, head, &st);
    s->keys = tl_mem_alloc(ctx, head->segment_count, sizeof *s->keys, &st);
    return st;
}

void tli_selection_release(tl_ctx *ctx, tli_selection *s)
{
    uint32_t *arrays[] = {s->refined,    s->exposed,  s->visited,  s->list.ids,
                          s->fringe.ids, s->work.ids, s->heap.ids, s->put_off.ids};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) tl_mem_free(ctx, arrays[i]);
    tl_mem_free(ctx, s->keys);
    *s = (tli_selection){0};
}

static void expose(tli_selection *s, uint32_t segment)
{
    if (segment == TL_NONE || s->exposed[segment] == s->stamp) return;
    s->exposed[segment] = s->stamp;
    s->fringe.ids[s->fringe.count++] = segment;
}

tl_status tli_select_begin(tli_selection *s, tli_dag *graph)
{
    tl_status st = TL_OK;
    const tli_arc *arc;
    s->stamp++;
    s->list.count = s->fringe.count = 0;
    s->total = (tli_gain){0};
    s->short_of = false;
    for (uint32_t p = 0; !st && p < graph->head->root_patch_count; p++) {
        st = tli_dag_arc(graph, p, &arc);
        if (st) break;
        expose(s, arc->producer);
        s->total.tets += arc->tets;
        s->total.verts += arc->verts;
        s->total.bytes += arc->bytes;
    }
    return st;
}

tl_status tli_select_refine(tli_selection *s, tli_dag *graph, uint32_t segment)
{
    tli_node *node;
    if (tli_is_refined(s, segment)) return TL_OK;
    s->work.count = 0;
    s->work.ids[s->work.count++] = segment;
    s->refined[segment] = s->stamp;
    while (s->work.count) {
        uint32_t x = s->work.ids[--s->work.count];
        tl_status st = tli_dag_node(graph, x, &node);
        if (st) return st;
        const tli_gain *gain = &graph->gains[x];
        s->list.ids[s->list.count++] = x;
        s->total.tets += gain->tets;
        s->total.verts += gain->verts;
        s->total.bytes += gain->bytes;
        const uint32_t *parents = tli_node_parents(graph, node);
        for (uint32_t i = 0; i < node->parent_count; i++) {
            if (tli_is_refined(s, parents[i])) continue;
            s->refined[parents[i]] = s->stamp;
            s->work.ids[s->work.count++] = parents[i];
        }
        const uint32_t *children = tli_node_children(graph, node);
        for (uint32_t i = 0; i < node->child_count; i++) expose(s, children[i]);
    }
    return TL_OK;
}

tl_status tli_select_by_error(tli_selection *s, tli_dag *graph, const tli_asked *asked)
{
    tl_status st = tli_select_begin(s, graph);
    for (size_t i = 0; !st && i < s->fringe.count; i++) { /* grows while it is walked */
        double severity;
        uint32_t x = s->fringe.ids[i];
        if (tli_is_refined(s, x)) continue;
        st = tli_severity(asked, graph, x, &severity);
        if (!st && severity > 1) st = tli_select_refine(s, graph, x);
    }
    return st;
}
