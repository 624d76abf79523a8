/* Proves a segmented mesh: each segment on its own and, loaded together with its neighbours, what
 * goes over its border. */
#include "segment/segment.h"

#include "mesh/mesh.h"

#include <stdlib.h>
#include <string.h>

/* A segment with its neighbours, by slots. */
typedef struct hood {
    tl_ctx *ctx;
    const tl_segments *s;
    tl_segment *by_slot; /* [neighbour_count + 1] */
    uint32_t loaded;     /* of them */
} hood;

/* A face by its vertices. */
typedef struct face_key {
    uint64_t ids[3];
} face_key;

static tl_status broken(const hood *h, const char *what, uint64_t at)
{
    return tl_fail(h->ctx, TL_ERR_DATA, "segment %u: %s %llu", h->by_slot[0].id, what,
                   (unsigned long long)at);
}

/* ---- alone ---- */

static int compare_ids(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static int compare_u32(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static tl_status check_vertices(const hood *h, uint64_t *ids)
{
    const tl_segment *seg = &h->by_slot[0];
    const double *bounds = h->s->entries[seg->id].bounds;
    uint32_t shared = 0;
    for (uint32_t v = 0; v < seg->vert_count; v++) {
        ids[v] = seg->vert_ids[v];
        if (ids[v] >= h->s->id_end) return broken(h, "an id past the end at vertex", v);
        for (int k = 0; k < 3; k++)
            if (seg->xyz[3 * (size_t)v + (size_t)k] < bounds[2 * k] ||
                seg->xyz[3 * (size_t)v + (size_t)k] > bounds[2 * k + 1])
                return broken(h, "outside of its box is vertex", v);
        uint32_t slot = TL_LINK_SLOT(seg->links[v]);
        if (slot > seg->neighbour_count) return broken(h, "no neighbour at the link of vertex", v);
        if (slot == 0 && seg->links[v] != v) return broken(h, "linked within itself: vertex", v);
        shared += slot != 0;
    }
    if (shared != h->s->entries[seg->id].shared_count)
        return broken(h, "shared vertices are counted wrong:", shared);
    qsort(ids, seg->vert_count, sizeof *ids, compare_ids);
    for (uint32_t v = 1; v < seg->vert_count; v++)
        if (ids[v] == ids[v - 1]) return broken(h, "twice there is the vertex of id", ids[v]);
    return TL_OK;
}

static tl_status check_tets(const hood *h, uint8_t *used)
{
    const tl_segment *seg = &h->by_slot[0];
    for (size_t i = 0; i < 4 * (size_t)seg->tet_count; i++) {
        if (seg->tets[i] >= seg->vert_count)
            return broken(h, "no vertex at a corner of tet", i / 4);
        used[seg->tets[i]] = 1;
    }
    for (uint32_t v = 0; v < seg->vert_count; v++)
        if (!used[v]) return broken(h, "of no tet is vertex", v);
    return TL_OK;
}

/* ---- over the border ---- */

/* Copies follow one another by ascending segments, and only the lowest is no copy. */
static tl_status check_links(const hood *h)
{
    const tl_segment *seg = &h->by_slot[0];
    for (uint32_t v = 0; v < seg->vert_count; v++) {
        uint32_t slot = TL_LINK_SLOT(seg->links[v]), local = TL_LINK_LOCAL(seg->links[v]);
        bool is_copy = seg->links[v] & TL_LINK_COPY;
        if (slot == 0) {
            if (is_copy) return broken(h, "a copy of nothing is vertex", v);
            continue;
        }
        const tl_segment *next = &h->by_slot[slot];
        if (local >= next->vert_count || next->vert_ids[local] != seg->vert_ids[v])
            return broken(h, "linked to another one is vertex", v);
        bool next_is_copy = next->links[local] & TL_LINK_COPY;
        if (next_is_copy != (next->id > seg->id))
            return broken(h, "out of order is the link of vertex", v);
    }
    return TL_OK;
}

static face_key key_of(const tl_segment *seg, uint32_t tet, uint32_t face)
{
    face_key key;
    for (int k = 0; k < 3; k++)
        key.ids[k] = seg->vert_ids[seg->tets[4 * (size_t)tet + tli_tet_faces[face][k]]];
    qsort(key.ids, 3, sizeof *key.ids, compare_ids);
    return key;
}

static int compare_keys(const void *a, const void *b)
{
    const face_key *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->ids[k] != y->ids[k]) return x->ids[k] < y->ids[k] ? -1 : 1;
    return 0;
}

static uint32_t slot_in(const tl_segment *seg, uint32_t other)
{
    for (uint32_t i = 0; i < seg->neighbour_count; i++)
        if (seg->neighbours[i] == other) return i + 1;
    return seg->id == other ? 0 : TL_NONE;
}

static bool has_twice(const tl_segment *seg, uint32_t tet)
{
    const uint16_t *v = seg->tets + 4 * (size_t)tet;
    return v[0] == v[1] || v[0] == v[2] || v[0] == v[3] || v[1] == v[2] || v[1] == v[3] ||
           v[2] == v[3];
}

/* Each opposite answers, over the same vertices. */
static tl_status check_answer(const hood *h, uint32_t tet, uint32_t face)
{
    const tl_segment *seg = &h->by_slot[0];
    uint32_t opposite = seg->opposites[4 * (size_t)tet + face];
    uint32_t slot = opposite >> 18, there = opposite >> 2 & 0xffff, side = opposite & 3;
    if (slot > seg->neighbour_count)
        return broken(h, "no neighbour opposite to a face of tet", tet);
    const tl_segment *other = &h->by_slot[slot];
    if (there >= other->tet_count) return broken(h, "nothing opposite to a face of tet", tet);
    uint32_t back = slot_in(other, seg->id);
    if (back == TL_NONE ||
        other->opposites[4 * (size_t)there + side] != (back << 18 | tet << 2 | face))
        return broken(h, "no answer to a face of tet", tet);
    face_key a = key_of(seg, tet, face), b = key_of(other, there, side);
    if (compare_keys(&a, &b) != 0)
        return broken(h, "other vertices opposite to a face of tet", tet);
    return TL_OK;
}

/* How often faces without an opposite are there, in the segment and its neighbours: not twice. */
static tl_status check_open_faces(const hood *h, face_key *keys, uint32_t *counts, size_t count)
{
    const tl_segment *seg = &h->by_slot[0];
    qsort(keys, count, sizeof *keys, compare_keys);
    memset(counts, 0, count * sizeof *counts);
    for (uint32_t n = 0; n <= seg->neighbour_count; n++) {
        const tl_segment *from = &h->by_slot[n];
        for (uint32_t t = 0; t < from->tet_count; t++)
            for (uint32_t f = 0; f < 4 && !has_twice(from, t); f++) {
                unsigned shared = 0;
                for (int k = 0; k < 3; k++)
                    shared +=
                        TL_LINK_SLOT(
                            from->links[from->tets[4 * (size_t)t + tli_tet_faces[f][k]]]) != 0;
                if (n && shared < 3) continue;
                face_key key = key_of(from, t, f);
                const face_key *found = bsearch(&key, keys, count, sizeof *keys, compare_keys);
                if (!found) continue;
                while (found > keys && compare_keys(found - 1, &key) == 0) found--;
                counts[found - keys]++;
            }
    }
    for (size_t i = 0; i < count; i++)
        if (counts[i] == 2)
            return broken(h, "two faces do not meet at the vertex of id", keys[i].ids[0]);
    return TL_OK;
}

static tl_status check_opposites(const hood *h)
{
    const tl_segment *seg = &h->by_slot[0];
    tl_status st = TL_OK;
    size_t count = 0;
    face_key *keys = tl_mem_alloc(h->ctx, 4 * (size_t)seg->tet_count, sizeof *keys, &st);
    uint32_t *counts = tl_mem_alloc(h->ctx, 4 * (size_t)seg->tet_count, sizeof *counts, &st);
    for (uint32_t t = 0; !st && t < seg->tet_count; t++)
        for (uint32_t f = 0; !st && f < 4; f++) {
            if (seg->opposites[4 * (size_t)t + f] != TL_OPPOSITE_NONE)
                st = check_answer(h, t, f);
            else if (!has_twice(seg, t))
                keys[count++] = key_of(seg, t, f);
        }
    if (!st) st = check_open_faces(h, keys, counts, count);
    tl_mem_free(h->ctx, counts);
    tl_mem_free(h->ctx, keys);
    return st;
}

/* ---- all segments ---- */

static tl_status check_segment(tl_ctx *ctx, const tl_segments *s, uint32_t segment)
{
    tl_status st = TL_OK;
    const tli_segment_entry *entry = &s->entries[segment];
    hood h = {.ctx = ctx, .s = s};
    h.by_slot = tl_mem_zalloc(ctx, (size_t)entry->neighbour_count + 1, sizeof *h.by_slot, &st);
    uint64_t *ids = tl_mem_alloc(ctx, entry->vert_count, sizeof *ids, &st);
    uint8_t *used = tl_mem_zalloc(ctx, entry->vert_count, 1, &st);
    for (; !st && h.loaded <= entry->neighbour_count; h.loaded++) {
        uint32_t id = h.loaded ? s->neighbours[entry->first_neighbour + h.loaded - 1] : segment;
        st = tl_segments_load(ctx, s, id, &h.by_slot[h.loaded]);
        if (st) break;
    }
    if (!st) st = check_vertices(&h, ids);
    if (!st) st = check_tets(&h, used);
    if (!st) st = check_links(&h);
    if (!st && s->has_adjacency) st = check_opposites(&h);
    for (uint32_t i = 0; i < h.loaded; i++) tl_segment_release(ctx, &h.by_slot[i]);
    tl_mem_free(ctx, used);
    tl_mem_free(ctx, ids);
    tl_mem_free(ctx, h.by_slot);
    return st;
}

static tl_status check_index(tl_ctx *ctx, const tl_segments *s)
{
    uint64_t tets = 0, owned = 0;
    for (uint32_t i = 0; i < s->count; i++) {
        const tli_segment_entry *entry = &s->entries[i];
        const uint32_t *list = s->neighbours + entry->first_neighbour;
        if (entry->tet_count == 0 || entry->tet_count > TL_SEGMENT_MAX ||
            entry->vert_count > TL_SEGMENT_MAX)
            return tl_fail(ctx, TL_ERR_DATA, "segment %u: %u tets, %u vertices", i,
                           entry->tet_count, entry->vert_count);
        tets += entry->tet_count;
        owned += entry->vert_count - entry->shared_count;
        for (uint32_t n = 0; n < entry->neighbour_count; n++) {
            if (list[n] >= s->count || list[n] == i || (n && list[n] <= list[n - 1]))
                return tl_fail(ctx, TL_ERR_DATA, "segment %u: neighbour %u is %u", i, n, list[n]);
            tl_segment_summary other = tl_segments_info(s, list[n]);
            if (!bsearch(&i, other.neighbours, other.neighbour_count, sizeof i, compare_u32))
                return tl_fail(ctx, TL_ERR_DATA, "segment %u names %u, not the other way round", i,
                               list[n]);
        }
    }
    if (tets != s->tet_count || owned > s->vert_count)
        return tl_fail(ctx, TL_ERR_DATA, "%llu tets in all segments, expected %llu",
                       (unsigned long long)tets, (unsigned long long)s->tet_count);
    return TL_OK;
}

typedef struct check_job {
    tl_ctx *ctx;
    const tl_segments *s;
} check_job;

static tl_status check_task(void *arg, size_t begin, size_t end, unsigned worker)
{
    const check_job *job = arg;
    tl_status st = TL_OK;
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_ctx *fork;
        st = tli_ctx_fork(job->ctx, &fork);
        if (!st) st = tli_ctx_join(job->ctx, fork, check_segment(fork, job->s, (uint32_t)i));
    }
    return st;
}

tl_status tl_segments_check(tl_ctx *ctx, const tl_segments *segments, tl_check_level level)
{
    check_job job = {ctx, segments};
    tl_status st = check_index(ctx, segments);
    if (!st && level == TL_CHECK_FULL) st = tli_parallel(ctx, segments->count, 1, check_task, &job);
    return st;
}
