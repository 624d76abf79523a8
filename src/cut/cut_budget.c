/* Segments one after another until a budget is spent. With bounds the one that is farthest above
 * its own comes first. Without, the one whose refinement, with all it depends on, takes away most
 * squared error for a tet (or byte): the greedy answer to "least root mean square error for so many
 * tets". */
#include <math.h>

#include "cut/cut_select.h"

/* A segment whose worth has fallen below this part of what it was when it was put into the heap,
 * because it no longer shares its consumers with another, is put back. */
static const double STALE = 0.999;

/* ---- heap of segments by key, the largest first; ties: the lower number ---- */

static bool before(const tli_selection *s, uint32_t a, uint32_t b)
{
    return s->keys[a] > s->keys[b] || (s->keys[a] == s->keys[b] && a < b);
}

static void heap_push(tli_selection *s, uint32_t segment, double key)
{
    uint32_t *heap = s->heap.ids;
    size_t at = s->heap.count++;
    s->keys[segment] = key;
    for (; at && before(s, segment, heap[(at - 1) / 2]); at = (at - 1) / 2)
        heap[at] = heap[(at - 1) / 2];
    heap[at] = segment;
}

static uint32_t heap_pop(tli_selection *s)
{
    uint32_t *heap = s->heap.ids, top = heap[0], last = heap[--s->heap.count];
    size_t at = 0;
    for (size_t next = 1; next < s->heap.count; next = 2 * at + 1) {
        if (next + 1 < s->heap.count && before(s, heap[next + 1], heap[next])) next++;
        if (!before(s, heap[next], last)) break;
        heap[at] = heap[next];
        at = next;
    }
    if (s->heap.count) heap[at] = last;
    return top;
}

/* ---- worth ---- */

/* What refining segment with all it depends on adds. */
static tl_status closure_gain(tli_selection *s, tli_dag *graph, uint32_t segment, tli_gain *gain)
{
    tli_node *node;
    *gain = (tli_gain){0};
    s->visit++;
    s->work.count = 0;
    s->work.ids[s->work.count++] = segment;
    s->visited[segment] = s->visit;
    while (s->work.count) {
        uint32_t x = s->work.ids[--s->work.count];
        tl_status st = tli_dag_node(graph, x, &node);
        if (st) return st;
        gain->tets += graph->gains[x].tets;
        gain->bytes += graph->gains[x].bytes;
        gain->square_error += graph->gains[x].square_error;
        const uint32_t *parents = tli_node_parents(graph, node);
        for (uint32_t i = 0; i < node->parent_count; i++) {
            if (tli_is_refined(s, parents[i]) || s->visited[parents[i]] == s->visit) continue;
            s->visited[parents[i]] = s->visit;
            s->work.ids[s->work.count++] = parents[i];
        }
    }
    return TL_OK;
}

static bool fits(const tli_selection *s, const tli_asked *asked, const tli_gain *gain)
{
    int64_t tets = s->total.tets + gain->tets, bytes = s->total.bytes + gain->bytes;
    return (tets <= 0 || (uint64_t)tets <= asked->tets_max) &&
           (bytes <= 0 || (uint64_t)bytes <= asked->bytes_max);
}

/* Squared error that goes away for a tet, or for a byte where only bytes are limited. */
static double worth(const tli_asked *asked, const tli_gain *gain)
{
    double price = (double)(asked->tets_max != UINT64_MAX ? gain->tets : gain->bytes);
    if (!(gain->square_error > 0)) return price > 0 ? 0 : INFINITY;
    return price > 0 ? gain->square_error / price : INFINITY;
}

static tl_status key_of(tli_selection *s, tli_dag *graph, const tli_asked *asked, uint32_t segment,
                        double *key)
{
    tli_gain gain;
    if (!asked->spends) return tli_severity(asked, graph, segment, key);
    tl_status st = closure_gain(s, graph, segment, &gain);
    *key = worth(asked, &gain);
    return st;
}

/* Puts what was exposed since from into the heap, bounds permitting. */
static tl_status push_fringe(tli_selection *s, tli_dag *graph, const tli_asked *asked, size_t *from)
{
    tl_status st = TL_OK;
    for (; !st && *from < s->fringe.count; (*from)++) {
        uint32_t x = s->fringe.ids[*from];
        double key;
        st = key_of(s, graph, asked, x, &key);
        if (!st && (asked->spends || key > 1)) heap_push(s, x, key);
    }
    return st;
}

/* Refines the first of the heap, puts it back or puts it off. */
static tl_status take_first(tli_selection *s, tli_dag *graph, const tli_asked *asked)
{
    tli_gain gain;
    uint32_t x = heap_pop(s);
    if (tli_is_refined(s, x)) return TL_OK;
    tl_status st = closure_gain(s, graph, x, &gain);
    if (st) return st;
    double now = asked->spends ? worth(asked, &gain) : s->keys[x];
    if (now < STALE * s->keys[x])
        heap_push(s, x, now);
    else if (fits(s, asked, &gain))
        st = tli_select_refine(s, graph, x);
    else
        s->put_off.ids[s->put_off.count++] = x;
    return st;
}

tl_status tli_select_by_budget(tli_selection *s, tli_dag *graph, const tli_asked *asked)
{
    tl_status st = tli_select_begin(s, graph);
    size_t pushed = 0, refined = SIZE_MAX;
    s->heap.count = s->put_off.count = 0;
    /* what did not fit may fit once its consumers were refined for another's sake */
    while (!st && refined != s->list.count) {
        refined = s->list.count;
        for (size_t i = 0; i < s->put_off.count; i++)
            heap_push(s, s->put_off.ids[i], s->keys[s->put_off.ids[i]]);
        s->put_off.count = 0;
        st = push_fringe(s, graph, asked, &pushed);
        while (!st && s->heap.count) {
            st = take_first(s, graph, asked);
            if (!st) st = push_fringe(s, graph, asked, &pushed);
        }
    }
    s->short_of = s->put_off.count > 0;
    return st;
}
