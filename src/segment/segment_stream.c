/* The stream of segments (Sondershaus 2007, 6.1.3): a walk over their graph of neighbours. Among
 * the neighbours of what is loaded, the one is next that brings the fewest new neighbours with it;
 * of several the one that has waited longest. */
#include "segment/segment.h"

#include <math.h>

typedef struct walk {
    const tl_segments *s;
    uint32_t *unloaded; /* [count] neighbours that are still to come */
    uint32_t *unseen;   /* [count] neighbours that are neither loaded nor candidates */
    uint8_t *seen;      /* [count] 1: candidate, 2: loaded */
    uint32_t *candidates;
    uint32_t candidate_count;
    uint32_t active;
    uint64_t active_tets;
} walk;

static const uint32_t *neighbours_of(const walk *w, uint32_t segment, uint32_t *count)
{
    const tli_segment_entry *entry = &w->s->entries[segment];
    *count = entry->neighbour_count;
    return w->s->neighbours + entry->first_neighbour;
}

/* The next segment that nothing has reached: the one nearest to the lowest corner of all. */
static uint32_t first_unseen(const walk *w)
{
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, least = HUGE_VAL;
    uint32_t best = TL_NONE;
    for (uint32_t i = 0; i < w->s->count; i++)
        for (int k = 0; k < 3; k++) low[k] = fmin(low[k], w->s->entries[i].bounds[2 * k]);
    for (uint32_t i = 0; i < w->s->count; i++) {
        double square = 0;
        if (w->seen[i]) continue;
        for (int k = 0; k < 3; k++) {
            double d = w->s->entries[i].bounds[2 * k] - low[k];
            square += d * d;
        }
        if (best == TL_NONE || square < least) {
            best = i;
            least = square;
        }
    }
    return best;
}

static void add_candidate(walk *w, uint32_t segment)
{
    uint32_t count;
    const uint32_t *list = neighbours_of(w, segment, &count);
    w->seen[segment] = 1;
    w->candidates[w->candidate_count++] = segment;
    for (uint32_t i = 0; i < count; i++) w->unseen[list[i]]--;
}

static uint32_t take_candidate(walk *w)
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < w->candidate_count; i++)
        if (w->unseen[w->candidates[i]] < w->unseen[w->candidates[best]]) best = i;
    uint32_t segment = w->candidates[best];
    w->candidate_count--;
    for (uint32_t i = best; i < w->candidate_count; i++) w->candidates[i] = w->candidates[i + 1];
    return segment;
}

static void release(walk *w, uint32_t segment, tl_stream *stream)
{
    if (w->seen[segment] != 2 || w->unloaded[segment]) return;
    stream->tags[stream->tag_count++] = -(int32_t)segment - 1;
    w->active--;
    w->active_tets -= w->s->entries[segment].tet_count;
}

static void load(walk *w, uint32_t segment, tl_stream *stream)
{
    uint32_t count;
    const uint32_t *list = neighbours_of(w, segment, &count);
    stream->tags[stream->tag_count++] = (int32_t)segment;
    w->seen[segment] = 2;
    w->active++;
    w->active_tets += w->s->entries[segment].tet_count;
    if (w->active > stream->max_segments) stream->max_segments = w->active;
    if (w->active_tets > stream->max_tets) stream->max_tets = w->active_tets;
    for (uint32_t i = 0; i < count; i++) {
        if (!w->seen[list[i]]) add_candidate(w, list[i]);
        w->unloaded[list[i]]--;
    }
    release(w, segment, stream);
    for (uint32_t i = 0; i < count; i++) release(w, list[i], stream);
}

tl_status tl_segments_stream(tl_ctx *ctx, const tl_segments *segments, tl_stream *stream)
{
    tl_status st = TL_OK;
    const uint32_t n = segments->count;
    walk w = {.s = segments};
    *stream = (tl_stream){0};
    w.unloaded = tl_mem_alloc(ctx, n, sizeof *w.unloaded, &st);
    w.unseen = tl_mem_alloc(ctx, n, sizeof *w.unseen, &st);
    w.seen = tl_mem_zalloc(ctx, n, sizeof *w.seen, &st);
    w.candidates = tl_mem_alloc(ctx, n, sizeof *w.candidates, &st);
    stream->tags = tl_mem_alloc(ctx, 2 * (size_t)n, sizeof *stream->tags, &st);
    for (uint32_t i = 0; !st && i < n; i++)
        w.unloaded[i] = w.unseen[i] = segments->entries[i].neighbour_count;
    for (uint32_t loaded = 0; !st && loaded < n; loaded++) {
        if (!w.candidate_count) add_candidate(&w, first_unseen(&w));
        load(&w, take_candidate(&w), stream);
    }
    tl_mem_free(ctx, w.candidates);
    tl_mem_free(ctx, w.seen);
    tl_mem_free(ctx, w.unseen);
    tl_mem_free(ctx, w.unloaded);
    if (st) tl_stream_release(ctx, stream);
    return st;
}

void tl_stream_release(tl_ctx *ctx, tl_stream *stream)
{
    tl_mem_free(ctx, stream->tags);
    *stream = (tl_stream){0};
}
