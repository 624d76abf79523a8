/* The cut: select segments, compare with the ones before, and so find the patches that come and go
 * without looking at the others. */
#include "cut/cut_object.h"

#include <math.h>

tl_status tl_cut_create(tl_ctx *ctx, tl_store *store, tl_cut **cut)
{
    tl_status st = TL_OK;
    const tl_store_head *head = tl_store_get_head(store);
    *cut = NULL;
    tl_cut *c = tl_mem_zalloc(ctx, 1, sizeof *c, &st);
    if (st) return st;
    c->ctx = c->asked.ctx = ctx;
    c->asked.channel_count = head->channel_count;
    st = tli_dag_open(ctx, store, &c->graph);
    tl_status made = tli_selection_create(ctx, head, &c->now);
    if (!st) st = made;
    made = tli_selection_create(ctx, head, &c->next);
    if (!st) st = made;
    uint32_t **arrays[] = {&c->places,      &c->seen,       &c->drawn.ids,   &c->added.ids,
                           &c->removed.ids, &c->wanted.ids, &c->foreseen.ids};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        *arrays[i] = tl_mem_zalloc(ctx, head->patch_count, sizeof(uint32_t), &st);
    c->channel_errors = tl_mem_zalloc(ctx, head->channel_count, sizeof(double), &st);
    for (size_t p = 0; !st && p < head->patch_count; p++) c->places[p] = TL_NONE;
    tl_cut_query coarsest = tl_cut_query_defaults();
    if (!st) st = tl_cut_update(c, &coarsest);
    if (st)
        tl_cut_destroy(c);
    else
        *cut = c;
    return st;
}

void tl_cut_destroy(tl_cut *c)
{
    if (!c) return;
    void *blocks[] = {c->places,      c->seen,       c->drawn.ids,    c->added.ids,
                      c->removed.ids, c->wanted.ids, c->foreseen.ids, c->channel_errors};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(c->ctx, blocks[i]);
    tli_selection_release(c->ctx, &c->next);
    tli_selection_release(c->ctx, &c->now);
    tli_asked_release(&c->asked);
    tli_dag_close(&c->graph);
    tl_mem_free(c->ctx, c);
}

void tl_cut_set_resident(tl_cut *cut, tl_cut_resident_fn resident, void *user)
{
    cut->resident = resident;
    cut->resident_user = user;
}

/* ---- what comes and goes ---- */

static bool is_drawn(const tli_selection *s, const tli_arc *arc)
{
    bool open = arc->consumer == TL_NONE || tli_is_refined(s, arc->consumer);
    return open && !tli_is_refined(s, arc->producer);
}

static void draw(tl_cut *c, uint32_t patch, const tli_arc *arc)
{
    c->places[patch] = (uint32_t)c->drawn.count;
    c->drawn.ids[c->drawn.count++] = patch;
    c->added.ids[c->added.count++] = patch;
    c->leaves += arc->producer == TL_NONE;
}

static void undraw(tl_cut *c, uint32_t patch, const tli_arc *arc)
{
    uint32_t last = c->drawn.ids[--c->drawn.count];
    c->drawn.ids[c->places[patch]] = last;
    c->places[last] = c->places[patch];
    c->places[patch] = TL_NONE;
    c->removed.ids[c->removed.count++] = patch;
    c->leaves -= arc->producer == TL_NONE;
}

/* Sets whether a patch is drawn; its arc is loaded, since a segment beside it is. */
static void settle_patch(tl_cut *c, uint32_t patch)
{
    const tli_arc *arc = &c->graph.arcs[patch];
    if (c->seen[patch] == c->stamp) return;
    c->seen[patch] = c->stamp;
    bool drawn = is_drawn(&c->next, arc), was = c->places[patch] != TL_NONE;
    if (drawn && !was) draw(c, patch, arc);
    if (!drawn && was) undraw(c, patch, arc);
}

static tl_status settle_around(tl_cut *c, uint32_t segment)
{
    tl_segment_info info;
    tl_status st = tl_store_segment(c->ctx, c->graph.store, segment, &info);
    if (st) return st;
    for (uint32_t i = 0; i < info.patch_count; i++) settle_patch(c, info.first_patch + i);
    for (uint32_t i = 0; i < info.output_count; i++) settle_patch(c, info.outputs[i]);
    return TL_OK;
}

/* Goes from the patches of cut->now to those of cut->next. The pages of all segments that are
 * looked at are there, so that nothing can fail half-way. */
static tl_status settle(tl_cut *c)
{
    tl_status st = TL_OK;
    c->stamp++;
    c->added.count = c->removed.count = 0;
    if (!c->drawn.count) /* the first time */
        for (uint32_t p = 0; p < c->graph.head->root_patch_count; p++) settle_patch(c, p);
    for (size_t i = 0; !st && i < c->next.list.count; i++)
        if (!tli_is_refined(&c->now, c->next.list.ids[i]))
            st = settle_around(c, c->next.list.ids[i]);
    for (size_t i = 0; !st && i < c->now.list.count; i++)
        if (!tli_is_refined(&c->next, c->now.list.ids[i]))
            st = settle_around(c, c->now.list.ids[i]);
    return st;
}

/* ---- what holds ---- */

/* Of the patches that are drawn, which are those of the selection. */
static tl_status sum_up(tl_cut *c, const tli_selection *of)
{
    const tl_store_head *head = c->graph.head;
    tl_status st = TL_OK;
    tl_cut_state *s = &c->state;
    bool leaves = c->leaves > 0, within = true;
    if (of->total.tets > 0 && (uint64_t)of->total.tets > c->asked.tets_max) within = false;
    if (of->total.bytes > 0 && (uint64_t)of->total.bytes > c->asked.bytes_max) within = false;
    *s = (tl_cut_state){.tets = (uint64_t)of->total.tets,
                        .vertices = (uint64_t)of->total.verts,
                        .bytes = (uint64_t)of->total.bytes,
                        .patches = c->drawn.count,
                        .segments = of->list.count,
                        .bounds_kept = within && (!leaves || tli_leaves_keep(&c->asked, head)),
                        .boundary_error = leaves ? head->levels[0].boundary_error : 0};
    for (size_t i = 0; i < head->channel_count; i++)
        c->channel_errors[i] = leaves ? head->levels[0].max_error[i] : 0;
    for (size_t i = 0; !st && i < of->fringe.count; i++) {
        tl_segment_info info;
        double severity = 0, space, pixels;
        uint32_t x = of->fringe.ids[i];
        if (tli_is_refined(of, x)) continue;
        st = tl_store_segment(c->ctx, c->graph.store, x, &info);
        if (!st) st = tli_severity(&c->asked, &c->graph, x, &severity);
        if (st) break;
        if (severity > 1) s->bounds_kept = false;
        s->boundary_error = fmax(s->boundary_error, info.boundary_error);
        tli_seen_error(&c->asked, &c->graph, x, &space, &pixels);
        s->space_error = fmax(s->space_error, space);
        s->pixels = fmax(s->pixels, pixels);
        for (size_t k = 0; k < head->channel_count; k++)
            c->channel_errors[k] = fmax(c->channel_errors[k], info.max_error[k]);
    }
    return st;
}

/* Sets c->next to what query asks for, as if all were resident. */
static tl_status select_segments(tl_cut *c, const tl_cut_query *query)
{
    tl_status st = tli_asked_set(&c->asked, c->graph.head, query);
    bool budget = query->tets_max != UINT64_MAX || query->bytes_max != UINT64_MAX;
    if (st) return st;
    return budget ? tli_select_by_budget(&c->next, &c->graph, &c->asked)
                  : tli_select_by_error(&c->next, &c->graph, &c->asked);
}

tl_status tl_cut_update(tl_cut *c, const tl_cut_query *query)
{
    tl_status st = select_segments(c, query);
    if (!st) st = tli_cut_trim(c);
    if (!st) st = settle(c);
    if (!st) st = sum_up(c, &c->next);
    if (st) return tl_note(c->ctx, st, "while moving the cut");
    tli_selection before = c->now;
    c->now = c->next;
    c->next = before;
    return TL_OK;
}

tl_status tl_cut_assess(tl_cut *c, const tl_cut_query *query)
{
    tl_status st = tli_asked_set(&c->asked, c->graph.head, query);
    if (!st) st = sum_up(c, &c->now);
    return st ? tl_note(c->ctx, st, "while looking at the cut") : TL_OK;
}

tl_status tl_cut_foresee(tl_cut *c, const tl_cut_query *query, const uint32_t **patches,
                         size_t *count)
{
    tl_status st = select_segments(c, query);
    c->foreseen.count = 0;
    for (size_t i = 0; !st && i < c->next.list.count; i++) {
        const tli_node *node = &c->graph.nodes[c->next.list.ids[i]];
        for (uint32_t p = node->first_patch; p < node->first_patch + node->patch_count; p++) {
            bool drawn = !tli_is_refined(&c->next, c->graph.arcs[p].producer);
            if (!drawn || c->places[p] != TL_NONE) continue;
            if (c->resident && c->resident(c->resident_user, p)) continue;
            c->foreseen.ids[c->foreseen.count++] = p;
        }
    }
    tli_ids_sort(c->foreseen.ids, c->foreseen.count);
    *patches = c->foreseen.ids;
    *count = c->foreseen.count;
    return st ? tl_note(c->ctx, st, "while looking ahead of the cut") : TL_OK;
}

tl_cut_state tl_cut_get_state(const tl_cut *cut)
{
    return cut->state;
}

double tl_cut_channel_error(const tl_cut *cut, size_t channel)
{
    TL_ASSERT(channel < cut->graph.head->channel_count);
    return cut->channel_errors[channel];
}

const uint32_t *tl_cut_patches(const tl_cut *cut, size_t *count)
{
    *count = cut->drawn.count;
    return cut->drawn.ids;
}

const uint32_t *tl_cut_added(const tl_cut *cut, size_t *count)
{
    *count = cut->added.count;
    return cut->added.ids;
}

const uint32_t *tl_cut_removed(const tl_cut *cut, size_t *count)
{
    *count = cut->removed.count;
    return cut->removed.ids;
}

const uint32_t *tl_cut_wanted(const tl_cut *cut, size_t *count)
{
    *count = cut->wanted.count;
    return cut->wanted.ids;
}
