/* Copies of a vertex meet at the part that it lies in, are linked in a ring by ascending segments,
 * and make their segments neighbours (Sondershaus 2007, 6.1.2). */
#include "segment/segment_build.h"

#include "base/base_sort.h"

#include <string.h>

/* Pairs seen lately: most vertices of a border repeat the pair of the one before. */
#define RECENT 1024u

/* What one group gives. */
typedef struct meeting {
    tli_build *b;
    uint32_t number;
    uint64_t vert_count; /* different vertices that have a segment */
    tli_link *links;     /* in the order of groups once done */
    size_t link_count, link_room;
    uint32_t *link_begins; /* [group_count + 1] */
    uint64_t *pairs;       /* lower segment << 32 | higher one */
    size_t pair_count, pair_room;
    uint64_t recent[RECENT];
} meeting;

/* ---- neighbours ---- */

static tl_status add_pair(tl_ctx *ctx, meeting *m, uint32_t low, uint32_t high)
{
    tl_status st = TL_OK;
    uint64_t pair = (uint64_t)low << 32 | high;
    uint64_t *recent = &m->recent[(low * 31 + high) % RECENT];
    if (*recent == pair) return TL_OK;
    *recent = pair;
    if (m->pair_count == m->pair_room) {
        m->pair_room = m->pair_room ? 2 * m->pair_room : 256;
        m->pairs = tl_mem_resize(ctx, m->pairs, m->pair_room, sizeof *m->pairs, &st);
        if (st) return st;
    }
    m->pairs[m->pair_count++] = pair;
    return TL_OK;
}

/* Each pair once, ascending. */
static tl_status unite_pairs(tl_ctx *ctx, uint64_t *pairs, size_t *count)
{
    tl_status st = tli_sort_u64(ctx, pairs, NULL, *count);
    size_t kept = 0;
    for (size_t i = 0; !st && i < *count; i++)
        if (!i || pairs[i] != pairs[kept - 1]) pairs[kept++] = pairs[i];
    if (!st) *count = kept;
    return st;
}

/* Lists of neighbours out of pairs, in both directions. */
static tl_status list_neighbours(tl_segments *s, const uint64_t *pairs, size_t count)
{
    tl_status st = TL_OK;
    for (size_t i = 0; i < count; i++) {
        s->entries[pairs[i] >> 32].neighbour_count++;
        s->entries[(uint32_t)pairs[i]].neighbour_count++;
    }
    if (2 * (uint64_t)count > UINT32_MAX)
        return tl_fail(s->ctx, TL_ERR_UNSUPPORTED, "%zu pairs of neighbours", count);
    uint32_t sum = 0;
    for (uint32_t i = 0; i < s->count; i++) {
        tli_segment_entry *entry = &s->entries[i];
        if (entry->neighbour_count > TL_SEGMENT_NEIGHBOURS_MAX)
            return tl_fail(s->ctx, TL_ERR_UNSUPPORTED,
                           "segment %u has %u neighbours, at most %u can be named", i,
                           entry->neighbour_count, TL_SEGMENT_NEIGHBOURS_MAX);
        entry->first_neighbour = sum;
        sum += entry->neighbour_count;
        entry->neighbour_count = 0;
    }
    s->neighbour_count = sum;
    s->neighbours = tl_mem_alloc(s->ctx, sum, sizeof *s->neighbours, &st);
    /* lower ones first, then the higher ones: both come ascending */
    for (int higher = 0; !st && higher < 2; higher++)
        for (size_t i = 0; i < count; i++) {
            uint32_t low = (uint32_t)(pairs[i] >> 32), high = (uint32_t)pairs[i];
            tli_segment_entry *entry = &s->entries[higher ? low : high];
            s->neighbours[entry->first_neighbour + entry->neighbour_count++] = higher ? high : low;
        }
    return st;
}

/* ---- meeting ---- */

static uint32_t segment_of(const tli_build *b, const tli_guest *guest)
{
    return b->part_bases[guest->part] + guest->piece;
}

/* Links the copies of one vertex; at least two. */
static tl_status link_copies(tl_ctx *ctx, meeting *m, tli_guest *copies, uint32_t count)
{
    const tli_build *b = m->b;
    tl_status st = TL_OK;
    if (count > TL_SEGMENT_NEIGHBOURS_MAX)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "a vertex in %u segments, at most %u can be linked",
                       count, TL_SEGMENT_NEIGHBOURS_MAX);
    for (uint32_t i = 1; i < count; i++) { /* few: by insertion */
        tli_guest copy = copies[i];
        uint32_t at = i;
        for (; at && segment_of(b, &copies[at - 1]) > segment_of(b, &copy); at--)
            copies[at] = copies[at - 1];
        copies[at] = copy;
    }
    if (m->link_count + count > m->link_room) {
        m->link_room = 2 * m->link_room + count + 256;
        m->links = tl_mem_resize(ctx, m->links, m->link_room, sizeof *m->links, &st);
    }
    for (uint32_t i = 0; !st && i < count; i++) {
        const tli_guest *here = &copies[i], *next = &copies[i + 1 < count ? i + 1 : 0];
        m->links[m->link_count++] = (tli_link){.part = here->part,
                                               .piece = here->piece,
                                               .local = here->local,
                                               .next_segment = segment_of(b, next),
                                               .next_local = next->local,
                                               .is_copy = i > 0};
        for (uint32_t j = i + 1; !st && j < count; j++)
            st = add_pair(ctx, m, segment_of(b, here), segment_of(b, &copies[j]));
    }
    return st;
}

static tl_status sort_links(tl_ctx *ctx, meeting *m)
{
    const tli_build *b = m->b;
    tl_status st = TL_OK;
    uint32_t *keys = tl_mem_alloc(ctx, m->link_count, sizeof *keys, &st);
    uint32_t *places = tl_mem_alloc(ctx, m->link_count, sizeof *places, &st);
    tli_link *sorted = tl_mem_alloc(ctx, m->link_count, sizeof *sorted, &st);
    m->link_begins = tl_mem_alloc(ctx, (size_t)b->group_count + 1, sizeof *m->link_begins, &st);
    if (!st) {
        for (size_t i = 0; i < m->link_count; i++) keys[i] = b->group_of[m->links[i].part];
        tli_deal_alone(keys, m->link_count, b->group_count, m->link_begins, places);
        for (size_t i = 0; i < m->link_count; i++) sorted[places[i]] = m->links[i];
        tl_mem_free(ctx, m->links);
        m->links = sorted;
        sorted = NULL;
    }
    tl_mem_free(ctx, sorted);
    tl_mem_free(ctx, places);
    tl_mem_free(ctx, keys);
    return st;
}

/* Guests of the group into the order of their vertices. Gives begins [*verts + 1]. */
static tl_status load_guests(tl_ctx *ctx, const meeting *m, tli_guest **guests, uint32_t **begins,
                             uint32_t *verts)
{
    const tli_build *b = m->b;
    tl_status st = TL_OK;
    const size_t count = (size_t)b->guests.counts[m->number];
    tli_guest *arrived = tl_mem_alloc(ctx, count, sizeof *arrived, &st);
    uint32_t *keys = tl_mem_alloc(ctx, count, sizeof *keys, &st);
    uint32_t *places = tl_mem_alloc(ctx, count, sizeof *places, &st);
    uint32_t *bases = tl_mem_alloc(ctx, b->part_count, sizeof *bases, &st);
    *verts = 0;
    for (uint32_t i = b->group_begins[m->number]; !st && i < b->group_begins[m->number + 1]; i++) {
        uint32_t part = b->layout[i];
        bases[part] = *verts;
        *verts += b->first_places[part + 1] - b->first_places[part];
    }
    *begins = tl_mem_alloc(ctx, (size_t)*verts + 1, sizeof **begins, &st);
    *guests = tl_mem_alloc(ctx, count, sizeof **guests, &st);
    if (!st) st = tli_bins_read(ctx, &b->guests, m->number, arrived);
    if (!st) {
        for (size_t i = 0; i < count; i++) {
            uint32_t part = tli_part_of(b, arrived[i].place);
            keys[i] = bases[part] + (arrived[i].place - b->first_places[part]);
        }
        tli_deal_alone(keys, count, *verts, *begins, places);
        for (size_t i = 0; i < count; i++) (*guests)[places[i]] = arrived[i];
    }
    tl_mem_free(ctx, bases);
    tl_mem_free(ctx, places);
    tl_mem_free(ctx, keys);
    tl_mem_free(ctx, arrived);
    return st;
}

static tl_status meet(tl_ctx *ctx, meeting *m)
{
    tli_guest *guests = NULL;
    uint32_t *begins = NULL, verts = 0;
    tl_status st = load_guests(ctx, m, &guests, &begins, &verts);
    for (uint32_t v = 0; !st && v < verts; v++) {
        uint32_t count = begins[v + 1] - begins[v];
        m->vert_count += count > 0;
        if (count > 1) st = link_copies(ctx, m, guests + begins[v], count);
    }
    tl_mem_free(ctx, guests);
    tl_mem_free(ctx, begins);
    if (!st) st = unite_pairs(ctx, m->pairs, &m->pair_count);
    return st ? st : sort_links(ctx, m);
}

static tl_status meet_task(void *arg, size_t begin, size_t end, unsigned worker)
{
    meeting *meetings = arg;
    tl_status st = TL_OK;
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_ctx *fork, *ctx = meetings[i].b->ctx;
        st = tli_ctx_fork(ctx, &fork);
        if (!st) st = tli_ctx_join(ctx, fork, meet(fork, &meetings[i]));
    }
    return st;
}

static void release_meeting(tl_ctx *ctx, meeting *m)
{
    tl_mem_free(ctx, m->pairs);
    tl_mem_free(ctx, m->link_begins);
    tl_mem_free(ctx, m->links);
    memset(m, 0, sizeof *m);
}

static tl_status meet_all(tli_build *b)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = b->ctx;
    uint64_t *pairs = NULL;
    size_t pair_count = 0;
    meeting *meetings = tl_mem_zalloc(ctx, b->in_flight, sizeof *meetings, &st);
    if (!st) st = tli_bins_open(ctx, b->opts.folder, sizeof(tli_link), b->group_count, &b->links);
    for (uint32_t first = 0; !st && first < b->group_count; first += b->in_flight) {
        uint32_t left = b->group_count - first, count = left < b->in_flight ? left : b->in_flight;
        for (uint32_t i = 0; i < count; i++) {
            meetings[i].b = b;
            meetings[i].number = first + i;
        }
        st = tli_parallel(ctx, count, 1, meet_task, meetings);
        for (uint32_t i = 0; !st && i < count; i++) {
            meeting *m = &meetings[i];
            st = tli_bins_add(&b->links, m->links, m->link_begins);
            pairs = tl_mem_resize(ctx, pairs, pair_count + m->pair_count, sizeof *pairs, &st);
            for (size_t k = 0; !st && k < m->pair_count; k++) pairs[pair_count++] = m->pairs[k];
            b->segments->vert_count += m->vert_count;
        }
        for (uint32_t i = 0; i < count; i++) release_meeting(ctx, &meetings[i]);
        if (!st) st = tl_progress(ctx, "links", first + count, b->group_count);
    }
    if (!st) st = unite_pairs(ctx, pairs, &pair_count);
    if (!st) st = list_neighbours(b->segments, pairs, pair_count);
    tl_mem_free(ctx, pairs);
    tl_mem_free(ctx, meetings);
    tli_bins_close(&b->guests);
    return st;
}

/* ---- links into the file ---- */

/* The segments of a group follow one another in the file, so do their links. */
static tl_status write_links(tl_ctx *ctx, tli_build *b, uint32_t number)
{
    tl_segments *s = b->segments;
    tl_status st = TL_OK;
    const uint32_t begin = b->group_segments[number], end = b->group_segments[number + 1];
    if (begin == end) return TL_OK;
    const tli_segment_entry *last = &s->entries[s->order[end - 1]];
    const uint64_t first_vert = s->entries[s->order[begin]].first_vert;
    const size_t verts = (size_t)(last->first_vert + last->vert_count - first_vert);
    const size_t count = (size_t)b->links.counts[number];
    uint32_t *packed = tl_mem_alloc(ctx, verts, sizeof *packed, &st);
    tli_link *links = tl_mem_alloc(ctx, count, sizeof *links, &st);
    if (!st) st = tli_bins_read(ctx, &b->links, number, links);
    for (uint32_t i = begin; !st && i < end; i++) {
        const tli_segment_entry *entry = &s->entries[s->order[i]];
        for (uint32_t v = 0; v < entry->vert_count; v++)
            packed[entry->first_vert - first_vert + v] = v;
    }
    for (size_t i = 0; !st && i < count; i++) {
        const tli_link *link = &links[i];
        uint32_t segment = b->part_bases[link->part] + link->piece;
        tli_segment_entry *entry = &s->entries[segment];
        uint32_t slot = tli_segment_slot(s, segment, link->next_segment);
        packed[entry->first_vert - first_vert + link->local] =
            slot << 16 | link->next_local | (link->is_copy ? TL_LINK_COPY : 0);
        entry->shared_count++;
    }
    if (!st)
        st = tli_scratch_write(ctx, s->file, s->links_ofs + first_vert * sizeof *packed, packed,
                               verts * sizeof *packed);
    tl_mem_free(ctx, links);
    tl_mem_free(ctx, packed);
    return st;
}

static tl_status write_task(void *arg, size_t begin, size_t end, unsigned worker)
{
    tli_build *b = arg;
    tl_status st = TL_OK;
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_ctx *fork;
        st = tli_ctx_fork(b->ctx, &fork);
        if (!st) st = tli_ctx_join(b->ctx, fork, write_links(fork, b, (uint32_t)i));
    }
    return st;
}

tl_status tli_build_link(tli_build *b)
{
    tl_status st = meet_all(b);
    if (!st) st = tli_parallel(b->ctx, b->group_count, 1, write_task, b);
    tli_bins_close(&b->links);
    return st;
}
