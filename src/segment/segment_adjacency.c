/* Opposite faces as a stream algorithm (Sondershaus 2007, 6.1.3, table 6.5). Faces within a segment
 * are matched when it is loaded, on all threads. A face whose three vertices are shared may lie
 * between segments: it waits in a table for its like. When a segment is released all its neighbours
 * have been loaded, so what has not met by then never does. */
#include "segment/segment_build.h"

#include "mesh/mesh.h"

#include <string.h>

/* Segments that are loaded at once, for each thread. */
#define BATCH_A_THREAD 2u
/* Slots of the table at first. */
#define SLOTS_MIN 4096u

/* A face that may lie between segments. */
typedef struct border_face {
    uint32_t ids[3];        /* ascending ids of its vertices */
    uint32_t segment, face; /* 4 * tet + face */
} border_face;

/* What has met, and so often, stands in the upper bits of the face of what came first. */
#define FACE_BITS 18u
#define MET (1u << FACE_BITS)
#define MANY (2u << FACE_BITS)

/* A face in the table; segment TL_NONE: none. */
typedef border_face waiting;

/* What is set when a segment is released. */
typedef struct match {
    uint32_t face, opposite;
} match;
typedef struct match_list {
    match *items;
    uint32_t count, room;
} match_list;

typedef struct adjacency {
    tl_ctx *ctx;
    tl_segments *s;
    waiting *slots;
    size_t slot_count, used;
    match_list *lists; /* [segments] */
    uint8_t *released; /* [segments] */
} adjacency;

/* One segment of a batch. */
typedef struct loaded {
    adjacency *a;
    uint32_t segment;
    border_face *faces;
    size_t face_count;
} loaded;

/* ---- within a segment ---- */

static void sort_three(uint32_t ids[3])
{
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2 - i; j++)
            if (ids[j] > ids[j + 1]) {
                uint32_t swap = ids[j];
                ids[j] = ids[j + 1];
                ids[j + 1] = swap;
            }
}

static bool is_shared(const tl_segment *seg, uint32_t local)
{
    return TL_LINK_SLOT(seg->links[local]) != 0 || (seg->links[local] & TL_LINK_COPY);
}

/* Lists the faces of three shared vertices. A tet with a vertex twice has no faces. */
static tl_status list_border(tl_ctx *ctx, loaded *l, const tl_segment *seg, const tl_lidx *tets)
{
    tl_status st = TL_OK;
    size_t room = 0;
    for (uint32_t t = 0; t < seg->tet_count; t++) {
        const tl_lidx *tet = tets + 4 * (size_t)t;
        bool twice = tet[0] == tet[1] || tet[0] == tet[2] || tet[0] == tet[3] || tet[1] == tet[2] ||
                     tet[1] == tet[3] || tet[2] == tet[3];
        unsigned shared = 0;
        for (unsigned i = 0; i < 4; i++) shared |= (unsigned)is_shared(seg, tet[i]) << i;
        for (unsigned f = 0; f < 4 && !twice; f++) {
            if ((shared | 1u << f) != 15u) continue;
            if (l->face_count == room) {
                room = room ? 2 * room : 1024;
                l->faces = tl_mem_resize(ctx, l->faces, room, sizeof *l->faces, &st);
                if (st) return st;
            }
            border_face *face = &l->faces[l->face_count++];
            *face = (border_face){.segment = l->segment, .face = 4 * t + f};
            for (int k = 0; k < 3; k++)
                face->ids[k] = (uint32_t)seg->vert_ids[tet[tli_tet_faces[f][k]]];
            sort_three(face->ids);
        }
    }
    return st;
}

static tl_status match_segment(tl_ctx *ctx, loaded *l)
{
    tl_segments *s = l->a->s;
    tl_segment seg;
    tl_lidx *tets = NULL, *opposite = NULL;
    tl_status st = tl_segments_load(ctx, s, l->segment, &seg);
    if (st) return st;
    tets = tl_mem_alloc(ctx, seg.tet_count, 4 * sizeof *tets, &st);
    for (size_t i = 0; !st && i < 4 * (size_t)seg.tet_count; i++) tets[i] = seg.tets[i];
    if (!st) st = tl_tets_adjacency(ctx, tets, seg.tet_count, seg.vert_count, &opposite, NULL);
    if (!st) st = list_border(ctx, l, &seg, tets);
    /* slot 0 is this segment: within it, opposites are what they are in a mesh */
    for (size_t i = 0; !st && i < l->face_count; i++) opposite[l->faces[i].face] = TL_NONE;
    if (!st)
        st = tli_scratch_write(ctx, s->file,
                               s->opposites_ofs + s->entries[l->segment].first_tet * 16, opposite,
                               (size_t)seg.tet_count * 16);
    tl_mem_free(ctx, opposite);
    tl_mem_free(ctx, tets);
    tl_segment_release(ctx, &seg);
    return st;
}

static tl_status match_task(void *arg, size_t begin, size_t end, unsigned worker)
{
    loaded *batch = arg;
    tl_status st = TL_OK;
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_ctx *fork, *ctx = batch[i].a->ctx;
        st = tli_ctx_fork(ctx, &fork);
        if (!st) st = tli_ctx_join(ctx, fork, match_segment(fork, &batch[i]));
    }
    return st;
}

/* ---- the table ---- */

static size_t slot_of(const adjacency *a, const uint32_t ids[3])
{
    uint64_t hash = ids[0] * 0x9e3779b97f4a7c15u;
    hash = (hash ^ hash >> 32 ^ ids[1]) * 0xbf58476d1ce4e5b9u;
    hash = (hash ^ hash >> 32 ^ ids[2]) * 0x94d049bb133111ebu;
    size_t slot = (size_t)((hash >> 32) * a->slot_count >> 32); /* below 2^32 slots */
    while (a->slots[slot].segment != TL_NONE &&
           memcmp(a->slots[slot].ids, ids, 3 * sizeof *ids) != 0)
        slot = slot + 1 < a->slot_count ? slot + 1 : 0;
    return slot;
}

static bool is_alive(const adjacency *a, const waiting *w)
{
    return w->segment != TL_NONE && !a->released[w->segment];
}

/* A table without what can't meet anything any more, half full at most. */
static tl_status rebuild(adjacency *a)
{
    tl_status st = TL_OK;
    waiting *old = a->slots;
    size_t old_count = a->slot_count, kept = 0;
    for (size_t i = 0; i < old_count; i++) kept += is_alive(a, &old[i]);
    size_t count = 2 * kept > SLOTS_MIN ? 2 * kept : SLOTS_MIN;
    if (count > UINT32_MAX)
        return tl_fail(a->ctx, TL_ERR_UNSUPPORTED, "%zu faces wait between segments", kept);
    waiting *slots = tl_mem_alloc(a->ctx, count, sizeof *slots, &st);
    if (st) return st;
    for (size_t i = 0; i < count; i++) slots[i].segment = TL_NONE;
    a->slots = slots;
    a->slot_count = count;
    a->used = kept;
    for (size_t i = 0; i < old_count; i++)
        if (is_alive(a, &old[i])) a->slots[slot_of(a, old[i].ids)] = old[i];
    tl_mem_free(a->ctx, old);
    return TL_OK;
}

static tl_status set_opposite(adjacency *a, uint32_t segment, uint32_t face, uint32_t opposite)
{
    tl_status st = TL_OK;
    match_list *list = &a->lists[segment];
    if (list->count == list->room) {
        list->room = list->room ? 2 * list->room : 256;
        list->items = tl_mem_resize(a->ctx, list->items, list->room, sizeof *list->items, &st);
        if (st) return st;
    }
    list->items[list->count++] = (match){face, opposite};
    return TL_OK;
}

static uint32_t pack_opposite(const adjacency *a, uint32_t from, uint32_t segment, uint32_t face)
{
    return tli_segment_slot(a->s, from, segment) << FACE_BITS | face;
}

/* The third face of its vertices: the first two lose each other. The one that met the first stands
 * in the list of the first one's segment. */
static tl_status part(adjacency *a, uint32_t segment, uint32_t face)
{
    const match_list *list = &a->lists[segment];
    uint32_t i = list->count;
    while (i && list->items[i - 1].face != face) i--;
    TL_ASSERT(i > 0);
    const uint32_t opposite = list->items[i - 1].opposite, slot = opposite >> FACE_BITS;
    const tli_segment_entry *entry = &a->s->entries[segment];
    const uint32_t other = slot ? a->s->neighbours[entry->first_neighbour + slot - 1] : segment;
    tl_status st = set_opposite(a, segment, face, TL_OPPOSITE_NONE);
    return st ? st : set_opposite(a, other, opposite & (MET - 1), TL_OPPOSITE_NONE);
}

/* A face meets what waits for it, or waits. */
static tl_status meet(adjacency *a, const border_face *face)
{
    tl_status st = TL_OK;
    if (5 * (a->used + 1) > 4 * a->slot_count) st = rebuild(a);
    if (st) return st;
    waiting *w = &a->slots[slot_of(a, face->ids)];
    if (w->segment == TL_NONE) {
        *w = *face;
        a->used++;
        return TL_OK;
    }
    const uint32_t first = w->face & (MET - 1);
    if (w->face & MANY) return TL_OK; /* stays without an opposite */
    if (w->face & MET) {
        w->face |= MANY;
        return part(a, w->segment, first);
    }
    w->face |= MET;
    st = set_opposite(a, face->segment, face->face,
                      pack_opposite(a, face->segment, w->segment, first));
    return st ? st
              : set_opposite(a, w->segment, first,
                             pack_opposite(a, w->segment, face->segment, face->face));
}

/* ---- the stream ---- */

static tl_status release_segment(adjacency *a, uint32_t segment)
{
    tl_segments *s = a->s;
    tl_status st = TL_OK;
    match_list *list = &a->lists[segment];
    const size_t bytes = (size_t)s->entries[segment].tet_count * 16;
    const uint64_t ofs = s->opposites_ofs + s->entries[segment].first_tet * 16;
    a->released[segment] = 1;
    if (!list->count) return TL_OK;
    uint32_t *opposite = tl_mem_alloc(a->ctx, bytes, 1, &st);
    if (!st) st = tli_scratch_read(a->ctx, s->file, ofs, opposite, bytes);
    for (uint32_t i = 0; !st && i < list->count; i++)
        opposite[list->items[i].face] = list->items[i].opposite;
    if (!st) st = tli_scratch_write(a->ctx, s->file, ofs, opposite, bytes);
    tl_mem_free(a->ctx, opposite);
    tl_mem_free(a->ctx, list->items);
    *list = (match_list){0};
    return st;
}

/* The next loads of the stream together, then the releases between them. */
static tl_status take_batch(adjacency *a, const tl_stream *stream, size_t *at, loaded *batch,
                            size_t room)
{
    size_t begin = *at, count = 0;
    for (; *at < stream->tag_count && count < room; (*at)++)
        if (stream->tags[*at] >= 0)
            batch[count++] = (loaded){.a = a, .segment = (uint32_t)stream->tags[*at]};
    while (*at < stream->tag_count && stream->tags[*at] < 0) (*at)++;
    tl_status st = tli_parallel(a->ctx, count, 1, match_task, batch);
    for (size_t i = 0; i < count; i++) {
        for (size_t f = 0; !st && f < batch[i].face_count; f++) st = meet(a, &batch[i].faces[f]);
        tl_mem_free(a->ctx, batch[i].faces);
    }
    for (size_t i = begin; !st && i < *at; i++)
        if (stream->tags[i] < 0) st = release_segment(a, (uint32_t)(-(stream->tags[i] + 1)));
    return st;
}

tl_status tli_segments_match_faces(tl_segments *s)
{
    tl_ctx *ctx = s->ctx;
    tl_status st = TL_OK;
    tl_stream stream = {0};
    adjacency a = {.ctx = ctx, .s = s};
    const size_t room = (size_t)tl_ctx_thread_count(ctx) * BATCH_A_THREAD;
    loaded *batch = tl_mem_alloc(ctx, room, sizeof *batch, &st);
    a.lists = tl_mem_zalloc(ctx, s->count, sizeof *a.lists, &st);
    a.released = tl_mem_zalloc(ctx, s->count, 1, &st);
    if (!st) st = rebuild(&a);
    if (!st) st = tl_segments_stream(ctx, s, &stream);
    for (size_t at = 0; !st && at < stream.tag_count;) {
        st = take_batch(&a, &stream, &at, batch, room);
        if (!st) st = tl_progress(ctx, "adjacency", at, stream.tag_count);
    }
    s->has_adjacency = !st;
    for (uint32_t i = 0; a.lists && i < s->count; i++) tl_mem_free(ctx, a.lists[i].items);
    tl_stream_release(ctx, &stream);
    tl_mem_free(ctx, a.slots);
    tl_mem_free(ctx, a.released);
    tl_mem_free(ctx, a.lists);
    tl_mem_free(ctx, batch);
    return st;
}
