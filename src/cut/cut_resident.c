/* A cut with what is there: a frame does not wait for a file. Where a patch that is to be drawn is
 * not resident, its consumer is not refined after all, nor is anything that depends on it, and the
 * coarser patches that come back into view are asked in turn. What is left is closed upwards: of a
 * segment that stays all consumers stay, since a segment below one that goes would have gone. */
#include "cut/cut_object.h"

/* Takes segment and the refined ones below it out of the set. */
static void unrefine(tl_cut *c, uint32_t segment)
{
    tli_selection *s = &c->next;
    s->work.count = 0;
    s->work.ids[s->work.count++] = segment;
    s->refined[segment] = s->stamp - 1;
    while (s->work.count) {
        uint32_t x = s->work.ids[--s->work.count];
        const tli_node *node = &c->graph.nodes[x];
        const tli_gain *gain = &c->graph.gains[x];
        s->total.tets -= gain->tets;
        s->total.verts -= gain->verts;
        s->total.bytes -= gain->bytes;
        const uint32_t *children = tli_node_children(&c->graph, node);
        for (uint32_t i = 0; i < node->child_count; i++) {
            if (!tli_is_refined(s, children[i])) continue;
            s->refined[children[i]] = s->stamp - 1;
            s->work.ids[s->work.count++] = children[i];
        }
    }
}

/* Asks for the inputs of a refined segment that are to be drawn; false if one is not there. */
static bool inputs_are_there(tl_cut *c, uint32_t segment)
{
    const tli_node *node = &c->graph.nodes[segment];
    bool there = true;
    for (uint32_t p = node->first_patch; p < node->first_patch + node->patch_count; p++) {
        if (tli_is_refined(&c->next, c->graph.arcs[p].producer) || c->seen[p] == c->stamp) continue;
        c->seen[p] = c->stamp;
        if (c->places[p] != TL_NONE || c->resident(c->resident_user, p)) continue;
        c->wanted.ids[c->wanted.count++] = p;
        there = false;
    }
    return there;
}

/* Keeps of list and fringe what is still refined, or exposed by something refined. */
static tl_status rebuild(tl_cut *c)
{
    tli_selection *s = &c->next;
    size_t kept = 0;
    for (size_t i = 0; i < s->list.count; i++)
        if (tli_is_refined(s, s->list.ids[i])) s->list.ids[kept++] = s->list.ids[i];
    s->list.count = kept;
    kept = 0;
    for (size_t i = 0; i < s->fringe.count; i++) {
        uint32_t x = s->fringe.ids[i];
        tli_node *node;
        tl_segment_info info;
        tl_status st = tli_dag_node(&c->graph, x, &node);
        if (!st) st = tl_store_segment(c->ctx, c->graph.store, x, &info);
        if (st) return st;
        bool open = false;
        for (uint32_t k = 0; k < info.output_count && !open; k++) {
            uint32_t consumer = c->graph.arcs[info.outputs[k]].consumer;
            open = consumer == TL_NONE || tli_is_refined(s, consumer);
        }
        if (open) s->fringe.ids[kept++] = x;
    }
    s->fringe.count = kept;
    return TL_OK;
}

tl_status tli_cut_trim(tl_cut *c)
{
    tli_selection *s = &c->next;
    c->wanted.count = 0;
    if (!c->resident) return TL_OK;
    c->stamp++;
    bool changed = true, any = false;
    while (changed) { /* each round takes at least one segment out */
        changed = false;
        for (size_t i = 0; i < s->list.count; i++) {
            uint32_t x = s->list.ids[i];
            if (!tli_is_refined(s, x) || inputs_are_there(c, x)) continue;
            unrefine(c, x);
            changed = any = true;
        }
    }
    /* patches are numbered by consumer, coarse levels first: the lowest number serves most */
    tli_ids_sort(c->wanted.ids, c->wanted.count);
    return any ? rebuild(c) : TL_OK;
}
