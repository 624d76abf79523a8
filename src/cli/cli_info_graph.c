/* tetralod info --details of a model: what only the whole index tells. RMS errors of the levels,
 * and locality: what is drawn where the mesh is finest at one point and as coarse as that allows
 * everywhere else. */
#include "cli_model.h"

#include <math.h>
#include <string.h>

/* The refined segments of a cut, as a stack of those whose consumers are still to be visited. */
typedef struct closure {
    const tl_store *store;
    const tl_store_head *head;
    const tl_patch_info *patches; /* [patch_count] */
    const tl_segment_info *segments;
    uint32_t *refined; /* [segment_count] number of the closure that refined it last */
    uint32_t *stack;   /* [segment_count] */
    uint32_t number;
} closure;

static tl_status read_index(tl_ctx *ctx, const tl_store *store, tl_segment_info *segments,
                            tl_patch_info *patches)
{
    const tl_store_head *head = tl_store_get_head(store);
    tl_status st = TL_OK;
    for (uint32_t s = 0; !st && s < head->segment_count; s++)
        st = tl_store_segment(ctx, store, s, &segments[s]);
    for (uint32_t p = 0; !st && p < head->patch_count; p++)
        st = tl_store_patch(ctx, store, p, &patches[p]);
    return st;
}

/* Counts input patches of a refined segment, or roots, that are drawn. */
static void count_drawn(const closure *c, uint32_t first, uint32_t count, cli_graph_view *view)
{
    for (uint32_t p = first; p < first + count; p++) {
        uint32_t producer = c->patches[p].producer;
        if (producer != TL_NONE && c->refined[producer] == c->number) continue;
        view->tets += c->patches[p].tet_count;
        view->patches++;
    }
}

/* The least set of refined segments that holds segment, and what is drawn then. */
static cli_graph_view refine(closure *c, uint32_t segment)
{
    cli_graph_view view = {0};
    size_t height = 0, next = 0;
    c->refined[segment] = ++c->number;
    c->stack[height++] = segment;
    while (next < height) {
        const tl_segment_info *s = &c->segments[c->stack[next++]];
        for (uint32_t i = 0; i < s->output_count; i++) {
            uint32_t consumer = c->patches[s->outputs[i]].consumer;
            if (consumer == TL_NONE || c->refined[consumer] == c->number) continue;
            c->refined[consumer] = c->number;
            c->stack[height++] = consumer;
        }
    }
    for (size_t i = 0; i < height; i++)
        count_drawn(c, c->segments[c->stack[i]].first_patch, c->segments[c->stack[i]].patch_count,
                    &view);
    count_drawn(c, 0, c->head->root_patch_count, &view);
    view.segments = height;
    return view;
}

static bool has_leaf(const closure *c, uint32_t segment)
{
    const tl_segment_info *s = &c->segments[segment];
    for (uint32_t p = s->first_patch; p < s->first_patch + s->patch_count; p++)
        if (c->patches[p].producer == TL_NONE) return true;
    return false;
}

/* Over all segments that hold patches of the finest mesh. */
static void find_locality(closure *c, cli_graph *graph)
{
    double tets = 0, patches = 0, segments = 0, points = 0;
    for (uint32_t s = 0; s < c->head->segment_count; s++) {
        if (!has_leaf(c, s)) continue;
        cli_graph_view view = refine(c, s);
        if (view.tets > graph->worst.tets) graph->worst = view;
        tets += (double)view.tets;
        patches += (double)view.patches;
        segments += (double)view.segments;
        points++;
    }
    if (!(points > 0)) { /* one level: all of it */
        count_drawn(c, 0, c->head->root_patch_count, &graph->worst);
        graph->mean = graph->worst;
        return;
    }
    graph->mean =
        (cli_graph_view){(uint64_t)llround(tets / points), (uint64_t)llround(patches / points),
                         (uint64_t)llround(segments / points)};
}

static void find_rms(const closure *c, cli_graph *graph)
{
    const uint32_t channels = c->head->channel_count, levels = c->head->level_count;
    for (uint32_t p = 0; p < c->head->patch_count; p++) {
        const tl_patch_info *patch = &c->patches[p];
        for (uint32_t i = 0; i < channels; i++)
            graph->rms[patch->level * channels + i] += patch->square_error[i];
        graph->carried[patch->level] += (double)patch->carried;
    }
    for (uint32_t l = 0; l < levels; l++)
        for (uint32_t i = 0; i < channels; i++) {
            double *rms = &graph->rms[l * channels + i];
            *rms = graph->carried[l] > 0 ? sqrt(*rms / graph->carried[l]) : 0;
        }
}

tl_status cli_graph_create(tl_ctx *ctx, const tl_store *store, cli_graph *graph)
{
    const tl_store_head *head = tl_store_get_head(store);
    tl_status st = TL_OK;
    *graph = (cli_graph){0};
    tl_segment_info *segments = tl_mem_zalloc(ctx, head->segment_count, sizeof *segments, &st);
    tl_patch_info *patches = tl_mem_zalloc(ctx, head->patch_count, sizeof *patches, &st);
    closure c = {.store = store, .head = head, .patches = patches, .segments = segments};
    c.refined = tl_mem_zalloc(ctx, head->segment_count, sizeof *c.refined, &st);
    c.stack = tl_mem_alloc(ctx, head->segment_count, sizeof *c.stack, &st);
    graph->rms = tl_mem_zalloc(ctx, (size_t)head->level_count * head->channel_count,
                               sizeof *graph->rms, &st);
    graph->carried = tl_mem_zalloc(ctx, head->level_count, sizeof *graph->carried, &st);
    if (!st) st = read_index(ctx, store, segments, patches);
    if (!st) find_locality(&c, graph);
    if (!st) find_rms(&c, graph);
    void *blocks[] = {c.stack, c.refined, patches, segments};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    if (st) cli_graph_destroy(ctx, graph);
    return st;
}

void cli_graph_destroy(tl_ctx *ctx, cli_graph *graph)
{
    tl_mem_free(ctx, graph->carried);
    tl_mem_free(ctx, graph->rms);
    *graph = (cli_graph){0};
}
