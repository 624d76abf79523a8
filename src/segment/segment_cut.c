/* A group of parts becomes segments: the tets of each part get a list of their own vertices and
 * indices of 16 bits. A part with more tets or vertices than such an index counts is cut in two
 * along its longest side, as often as it takes. */
#include "segment/segment_build.h"

#include "base/base_sort.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EMPTY TL_NONE
/* Pieces of a part: what a guest can name. */
#define PIECES_MAX 65535u

/* A segment of a group before it has its number. */
typedef struct piece {
    uint32_t part, number;
    uint32_t vert_count, tet_count;
    size_t ofs; /* of its body in the group's bodies */
    double bounds[6];
} piece;

/* What becomes of a group. */
typedef struct group {
    const tli_build *b;
    uint32_t number;
    tl_status status;
    piece *pieces;
    size_t piece_count;
    uint8_t *bodies;
    size_t byte_count, byte_room;
    tli_guest *guests; /* in the order of groups once done */
    size_t guest_count, guest_room;
    uint32_t *guest_begins; /* [group_count + 1] */
} group;

/* What a thread needs for a group. */
typedef struct cutter {
    tl_ctx *ctx;
    group *g;
    const tli_build *b;
    uint8_t *records; /* [tet_count] in the order of the group's parts */
    uint32_t *own;    /* [points of a part] local index of each vertex of the part */
    /* open addressing: places of other parts */
    uint32_t *keys, *locals;
    uint32_t *others; /* [TL_SEGMENT_MAX + 1] */
    size_t slots;     /* a power of 2 */
    uint32_t other_count;
} cutter;

/* ---- vertex lists ---- */

static size_t slot_of(const cutter *c, uint32_t place)
{
    size_t slot = (size_t)(place * 0x9e3779b1u) & (c->slots - 1);
    while (c->keys[slot] != EMPTY && c->keys[slot] != place) slot = (slot + 1) & (c->slots - 1);
    return slot;
}

static const uint32_t *tet_places(const cutter *c, size_t tet)
{
    return (const uint32_t *)(const void *)(c->records + tet * c->b->tet_bytes);
}

/* In the reverse order of their arrival: so no chain of open addressing breaks before its end. */
static void clear_others(cutter *c)
{
    for (uint32_t i = c->other_count; i-- > 0;) c->keys[slot_of(c, c->others[i])] = EMPTY;
    c->other_count = 0;
}

/* Lists the vertices of tets [count]; false if they are too many. */
static bool list_vertices(cutter *c, uint32_t part, const uint32_t *tets, size_t count,
                          uint32_t *vert_count)
{
    const tli_build *b = c->b;
    const uint32_t first = b->first_places[part], own = b->first_places[part + 1] - first;
    uint32_t verts = 0;
    memset(c->own, 0xff, own * sizeof *c->own);
    for (size_t t = 0; t < count; t++) {
        const uint32_t *places = tet_places(c, tets[t]);
        for (int i = 0; i < 4; i++) {
            uint32_t at = places[i] - first;
            if (at < own) {
                verts += c->own[at] == EMPTY;
                c->own[at] = 0;
                continue;
            }
            size_t slot = slot_of(c, places[i]);
            if (c->keys[slot] == places[i]) continue;
            if (c->other_count == TL_SEGMENT_MAX) return false;
            c->keys[slot] = places[i];
            c->others[c->other_count++] = places[i];
        }
    }
    *vert_count = verts + c->other_count;
    return *vert_count <= TL_SEGMENT_MAX;
}

/* Own vertices first, then the others, each ascending. others is sorted apart from the table, which
 * is cleared in the order of arrival. */
static tl_status number_vertices(cutter *c, uint32_t part, uint32_t *sorted, uint32_t *own_count)
{
    const tli_build *b = c->b;
    const uint32_t own = b->first_places[part + 1] - b->first_places[part];
    uint32_t next = 0;
    for (uint32_t i = 0; i < own; i++)
        if (c->own[i] != EMPTY) c->own[i] = next++;
    *own_count = next;
    memcpy(sorted, c->others, c->other_count * sizeof *sorted);
    tl_status st = tli_sort_u32(c->ctx, sorted, NULL, c->other_count);
    for (uint32_t i = 0; i < c->other_count; i++) c->locals[slot_of(c, sorted[i])] = next++;
    return st;
}

/* ---- bodies ---- */

/* Room at the end of a list that doubles. */
static tl_status reserve(tl_ctx *ctx, void **list, size_t *room, size_t needed, size_t elem_bytes)
{
    tl_status st = TL_OK;
    if (needed <= *room) return TL_OK;
    size_t more = *room + *room / 2 > needed ? *room + *room / 2 : needed;
    *list = tl_mem_resize(ctx, *list, more, elem_bytes, &st);
    if (!st) *room = more;
    return st;
}

static void write_vertex(const cutter *c, uint8_t *body, const tli_body *at, uint32_t local,
                         uint32_t place, double bounds[6])
{
    const size_t values = c->b->vert_bytes - 32;
    const uint8_t *vert = c->b->vert_map + place * c->b->vert_bytes;
    double xyz[3];
    memcpy(xyz, vert + 8, sizeof xyz);
    memcpy(body + 8 * (size_t)local, vert, 8);
    memcpy(body + at->xyz + 24 * (size_t)local, xyz, sizeof xyz);
    if (values) memcpy(body + at->values + values * local, vert + 32, values);
    for (int k = 0; k < 3; k++) {
        if (xyz[k] < bounds[2 * k]) bounds[2 * k] = xyz[k];
        if (xyz[k] > bounds[2 * k + 1]) bounds[2 * k + 1] = xyz[k];
    }
}

static void write_tets(const cutter *c, uint32_t part, const uint32_t *tets, size_t count,
                       uint8_t *body, const tli_body *at)
{
    const tli_build *b = c->b;
    const uint32_t first = b->first_places[part], own = b->first_places[part + 1] - first;
    const size_t regions = b->segments->has_regions ? sizeof(int32_t) : 0;
    const size_t values = b->tet_bytes - 16 - regions;
    for (size_t t = 0; t < count; t++) {
        const uint32_t *places = tet_places(c, tets[t]);
        const uint8_t *rest = (const uint8_t *)(places + 4);
        uint16_t local[4];
        for (int i = 0; i < 4; i++) {
            uint32_t in_part = places[i] - first;
            local[i] =
                (uint16_t)(in_part < own ? c->own[in_part] : c->locals[slot_of(c, places[i])]);
        }
        memcpy(body + at->tets + 8 * t, local, sizeof local);
        if (regions) memcpy(body + at->regions + 4 * t, rest, regions);
        if (values) memcpy(body + at->tet_values + values * t, rest + regions, values);
    }
}

static tl_status write_piece(cutter *c, uint32_t part, uint32_t number, const uint32_t *tets,
                             size_t count, uint32_t vert_count)
{
    group *g = c->g;
    const tli_build *b = c->b;
    const uint32_t first = b->first_places[part], own = b->first_places[part + 1] - first;
    tli_body at = tli_body_of(b->segments, vert_count, (uint32_t)count);
    tl_status st = reserve(c->ctx, (void **)&g->bodies, &g->byte_room, g->byte_count + at.bytes, 1);
    if (!st)
        st = reserve(c->ctx, (void **)&g->guests, &g->guest_room, g->guest_count + vert_count,
                     sizeof *g->guests);
    g->pieces = tl_mem_resize(c->ctx, g->pieces, g->piece_count + 1, sizeof *g->pieces, &st);
    uint32_t *sorted = tl_mem_alloc(c->ctx, c->other_count, sizeof *sorted, &st);
    uint32_t own_count = 0;
    if (!st) st = number_vertices(c, part, sorted, &own_count);
    if (!st) {
        piece *p = &g->pieces[g->piece_count++];
        *p = (piece){.part = part,
                     .number = number,
                     .vert_count = vert_count,
                     .tet_count = (uint32_t)count,
                     .ofs = g->byte_count,
                     .bounds = {HUGE_VAL, -HUGE_VAL, HUGE_VAL, -HUGE_VAL, HUGE_VAL, -HUGE_VAL}};
        uint8_t *body = g->bodies + g->byte_count;
        memset(body, 0, at.bytes);
        tli_guest *guest = g->guests + g->guest_count;
        for (uint32_t i = 0; i < own; i++) {
            if (c->own[i] == EMPTY) continue;
            write_vertex(c, body, &at, c->own[i], first + i, p->bounds);
            *guest++ = (tli_guest){first + i, part, (uint16_t)number, (uint16_t)c->own[i]};
        }
        for (uint32_t i = 0; i < c->other_count; i++) {
            write_vertex(c, body, &at, own_count + i, sorted[i], p->bounds);
            *guest++ = (tli_guest){sorted[i], part, (uint16_t)number, (uint16_t)(own_count + i)};
        }
        write_tets(c, part, tets, count, body, &at);
        g->guest_count += vert_count;
        g->byte_count += at.bytes;
    }
    tl_mem_free(c->ctx, sorted);
    return st;
}

/* ---- parts ---- */

typedef struct sort_key {
    double at;
    uint32_t tet;
} sort_key;

static int compare_keys(const void *a, const void *b)
{
    const sort_key *x = a, *y = b;
    if (x->at != y->at) return x->at < y->at ? -1 : 1;
    return (x->tet > y->tet) - (x->tet < y->tet);
}

static int compare_tets(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static void centre_of(const cutter *c, uint32_t tet, double centre[3])
{
    const uint32_t *places = tet_places(c, tet);
    memset(centre, 0, 3 * sizeof *centre);
    for (int i = 0; i < 4; i++) {
        double xyz[3];
        memcpy(xyz, c->b->vert_map + places[i] * c->b->vert_bytes + 8, sizeof xyz);
        for (int k = 0; k < 3; k++) centre[k] += isfinite(xyz[k]) ? 0.25 * xyz[k] : 0;
    }
}

/* Puts the half of the tets that is lower along the longest side in front; each half stays in the
 * order of the source. */
static tl_status halve(cutter *c, uint32_t *tets, size_t count)
{
    tl_status st = TL_OK;
    double box[6] = {HUGE_VAL, -HUGE_VAL, HUGE_VAL, -HUGE_VAL, HUGE_VAL, -HUGE_VAL}, centre[3];
    sort_key *keys = tl_mem_alloc(c->ctx, count, sizeof *keys, &st);
    if (st) return st;
    for (size_t i = 0; i < count; i++) {
        centre_of(c, tets[i], centre);
        for (int k = 0; k < 3; k++) {
            box[2 * k] = fmin(box[2 * k], centre[k]);
            box[2 * k + 1] = fmax(box[2 * k + 1], centre[k]);
        }
    }
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (box[2 * k + 1] - box[2 * k] > box[2 * axis + 1] - box[2 * axis]) axis = k;
    for (size_t i = 0; i < count; i++) {
        centre_of(c, tets[i], centre);
        keys[i] = (sort_key){centre[axis], tets[i]};
    }
    qsort(keys, count, sizeof *keys, compare_keys);
    for (size_t i = 0; i < count; i++) tets[i] = keys[i].tet;
    qsort(tets, count / 2, sizeof *tets, compare_tets);
    qsort(tets + count / 2, count - count / 2, sizeof *tets, compare_tets);
    tl_mem_free(c->ctx, keys);
    return TL_OK;
}

/* Cuts tets [count] of a part into pieces from *number on. Halves the list until each fits; depth
 * is at most that of the numbers of tets. */
static tl_status cut_part(cutter *c, uint32_t part, uint32_t *tets, size_t count, uint32_t *number)
{
    uint32_t verts = 0;
    bool fits = count <= TL_SEGMENT_MAX && list_vertices(c, part, tets, count, &verts);
    tl_status st = TL_OK;
    if (fits) {
        if (*number > PIECES_MAX)
            st = tl_fail(c->ctx, TL_ERR_UNSUPPORTED,
                         "part %u of space holds more than %u segments at nearly one place", part,
                         PIECES_MAX);
        if (!st) st = write_piece(c, part, *number, tets, count, verts);
        (*number)++;
    }
    clear_others(c);
    if (fits || st) return st;
    st = halve(c, tets, count);
    if (!st) st = cut_part(c, part, tets, count / 2, number);
    if (!st) st = cut_part(c, part, tets + count / 2, count - count / 2, number);
    return st;
}

/* ---- groups ---- */

/* Guests into the order of the groups of their places. */
static tl_status sort_guests(cutter *c)
{
    group *g = c->g;
    const tli_build *b = c->b;
    tl_status st = TL_OK;
    uint32_t *keys = tl_mem_alloc(c->ctx, g->guest_count, sizeof *keys, &st);
    uint32_t *places = tl_mem_alloc(c->ctx, g->guest_count, sizeof *places, &st);
    tli_guest *sorted = tl_mem_alloc(c->ctx, g->guest_count, sizeof *sorted, &st);
    g->guest_begins =
        tl_mem_alloc(c->ctx, (size_t)b->group_count + 1, sizeof *g->guest_begins, &st);
    if (!st) {
        for (size_t i = 0; i < g->guest_count; i++)
            keys[i] = b->group_of[tli_part_of(b, g->guests[i].place)];
        tli_deal_alone(keys, g->guest_count, b->group_count, g->guest_begins, places);
        for (size_t i = 0; i < g->guest_count; i++) sorted[places[i]] = g->guests[i];
        tl_mem_free(c->ctx, g->guests);
        g->guests = sorted;
        sorted = NULL;
    }
    tl_mem_free(c->ctx, sorted);
    tl_mem_free(c->ctx, places);
    tl_mem_free(c->ctx, keys);
    return st;
}

/* Tets of the group into the order of its parts. begins [parts of the group + 1]. */
static tl_status load_tets(cutter *c, uint32_t **begins)
{
    const tli_build *b = c->b;
    tl_status st = TL_OK;
    const uint32_t number = c->g->number;
    const uint32_t *layout = b->layout + b->group_begins[number];
    const uint32_t parts = b->group_begins[number + 1] - b->group_begins[number];
    if (b->tets.counts[number] >= TL_NONE)
        return tl_fail(c->ctx, TL_ERR_UNSUPPORTED, "a part of space holds 2^32 tets");
    const size_t count = (size_t)b->tets.counts[number], bytes = b->tet_bytes;
    uint8_t *arrived = tl_mem_alloc(c->ctx, count, bytes, &st);
    uint32_t *keys = tl_mem_alloc(c->ctx, count, sizeof *keys, &st);
    uint32_t *places = tl_mem_alloc(c->ctx, count, sizeof *places, &st);
    uint32_t *ranks = tl_mem_alloc(c->ctx, b->part_count, sizeof *ranks, &st);
    *begins = tl_mem_alloc(c->ctx, (size_t)parts + 1, sizeof **begins, &st);
    c->records = tl_mem_alloc(c->ctx, count, bytes, &st);
    if (!st) st = tli_bins_read(c->ctx, &b->tets, number, arrived);
    for (uint32_t p = 0; !st && p < parts; p++) ranks[layout[p]] = p;
    for (size_t t = 0; !st && t < count; t++) {
        uint32_t at[4], low = TL_NONE;
        memcpy(at, arrived + t * bytes, sizeof at);
        for (int i = 0; i < 4; i++) low = at[i] < low ? at[i] : low;
        keys[t] = ranks[tli_part_of(b, low)];
    }
    if (!st) {
        tli_deal_alone(keys, count, parts, *begins, places);
        for (size_t t = 0; t < count; t++)
            memcpy(c->records + places[t] * bytes, arrived + t * bytes, bytes);
    }
    tl_mem_free(c->ctx, ranks);
    tl_mem_free(c->ctx, places);
    tl_mem_free(c->ctx, keys);
    tl_mem_free(c->ctx, arrived);
    return st;
}

static tl_status cut_group(cutter *c)
{
    const tli_build *b = c->b;
    const uint32_t number = c->g->number;
    const uint32_t *layout = b->layout + b->group_begins[number];
    const uint32_t parts = b->group_begins[number + 1] - b->group_begins[number];
    uint32_t *begins = NULL, most = 0, tets_most = 0;
    tl_status st = load_tets(c, &begins);
    for (uint32_t p = 0; !st && p < parts; p++) {
        uint32_t own = b->first_places[layout[p] + 1] - b->first_places[layout[p]];
        most = own > most ? own : most;
        tets_most = begins[p + 1] - begins[p] > tets_most ? begins[p + 1] - begins[p] : tets_most;
    }
    c->slots = (size_t)TL_SEGMENT_MAX * 2 + 2; /* a power of 2, at most half full */
    c->own = tl_mem_alloc(c->ctx, most, sizeof *c->own, &st);
    c->keys = tl_mem_alloc(c->ctx, c->slots, sizeof *c->keys, &st);
    c->locals = tl_mem_alloc(c->ctx, c->slots, sizeof *c->locals, &st);
    c->others = tl_mem_alloc(c->ctx, TL_SEGMENT_MAX, sizeof *c->others, &st);
    uint32_t *tets = tl_mem_alloc(c->ctx, tets_most, sizeof *tets, &st);
    if (!st) memset(c->keys, 0xff, c->slots * sizeof *c->keys);
    for (uint32_t p = 0; !st && p < parts; p++) {
        uint32_t count = begins[p + 1] - begins[p], pieces = 0;
        for (uint32_t t = 0; t < count; t++) tets[t] = begins[p] + t;
        if (count) st = cut_part(c, layout[p], tets, count, &pieces);
    }
    tl_mem_free(c->ctx, tets);
    tl_mem_free(c->ctx, c->others);
    tl_mem_free(c->ctx, c->locals);
    tl_mem_free(c->ctx, c->keys);
    tl_mem_free(c->ctx, c->own);
    tl_mem_free(c->ctx, c->records);
    tl_mem_free(c->ctx, begins);
    return st ? st : sort_guests(c);
}

static tl_status cut_task(void *arg, size_t begin, size_t end, unsigned worker)
{
    group *groups = arg;
    tl_status st = TL_OK;
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_ctx *fork, *ctx = groups[i].b->ctx;
        st = tli_ctx_fork(ctx, &fork);
        if (st) break;
        cutter c = {.ctx = fork, .g = &groups[i], .b = groups[i].b};
        st = tli_ctx_join(ctx, fork, cut_group(&c));
    }
    return st;
}

/* What one batch of groups gave goes to the file, in their order. */
static tl_status store_group(tli_build *b, const group *g, piece **pieces, size_t *piece_count)
{
    tl_status st = TL_OK;
    uint64_t ofs = tli_scratch_bytes(b->segments->file);
    if (g->byte_count)
        st = tli_scratch_write(b->ctx, b->segments->file, ofs, g->bodies, g->byte_count);
    if (!st) st = tli_bins_add(&b->guests, g->guests, g->guest_begins);
    *pieces = tl_mem_resize(b->ctx, *pieces, *piece_count + g->piece_count, sizeof **pieces, &st);
    for (size_t i = 0; !st && i < g->piece_count; i++) {
        (*pieces)[*piece_count] = g->pieces[i];
        (*pieces)[(*piece_count)++].ofs += (size_t)ofs;
    }
    return st;
}

/* ---- numbers of segments ---- */

static tl_status number_segments(tli_build *b, const piece *pieces, size_t count)
{
    tl_segments *s = b->segments;
    tl_status st = TL_OK;
    if (count > INT32_MAX)
        return tl_fail(b->ctx, TL_ERR_UNSUPPORTED, "%zu segments, at most %d can be numbered",
                       count, INT32_MAX);
    b->part_bases = tl_mem_zalloc(b->ctx, (size_t)b->part_count + 1, sizeof *b->part_bases, &st);
    b->group_segments =
        tl_mem_zalloc(b->ctx, (size_t)b->group_count + 1, sizeof *b->group_segments, &st);
    s->entries = tl_mem_zalloc(b->ctx, count, sizeof *s->entries, &st);
    s->order = tl_mem_alloc(b->ctx, count, sizeof *s->order, &st);
    if (st) return st;
    s->count = (uint32_t)count;
    for (size_t i = 0; i < count; i++) {
        b->part_bases[pieces[i].part + 1]++;
        b->group_segments[b->group_of[pieces[i].part] + 1]++;
    }
    for (uint32_t g = 0; g < b->group_count; g++) b->group_segments[g + 1] += b->group_segments[g];
    for (uint32_t p = 0; p < b->part_count; p++) b->part_bases[p + 1] += b->part_bases[p];
    uint64_t tets = 0, verts = 0;
    for (size_t i = 0; i < count; i++) {
        const piece *p = &pieces[i];
        uint32_t id = b->part_bases[p->part] + p->number;
        tli_segment_entry *entry = &s->entries[id];
        *entry = (tli_segment_entry){.body_ofs = p->ofs,
                                     .first_tet = tets,
                                     .first_vert = verts,
                                     .tet_count = p->tet_count,
                                     .vert_count = p->vert_count};
        memcpy(entry->bounds, p->bounds, sizeof entry->bounds);
        s->order[i] = id;
        tets += p->tet_count;
        verts += p->vert_count;
    }
    s->links_ofs = tli_scratch_bytes(s->file);
    s->opposites_ofs = s->links_ofs + verts * sizeof(uint32_t);
    return TL_OK;
}

static void release_group(tl_ctx *ctx, group *g)
{
    tl_mem_free(ctx, g->guest_begins);
    tl_mem_free(ctx, g->guests);
    tl_mem_free(ctx, g->bodies);
    tl_mem_free(ctx, g->pieces);
    *g = (group){0};
}

tl_status tli_build_cut(tli_build *b)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = b->ctx;
    piece *pieces = NULL;
    size_t piece_count = 0;
    b->vert_map_bytes = (size_t)b->first_places[b->part_count] * b->vert_bytes;
    group *groups = tl_mem_zalloc(ctx, b->in_flight, sizeof *groups, &st);
    if (!st) st = tli_scratch_map(ctx, b->verts, b->vert_map_bytes, &b->vert_map);
    if (!st) st = tli_bins_open(ctx, b->opts.folder, sizeof(tli_guest), b->group_count, &b->guests);
    if (!st) st = tli_segments_write_head(b->segments);
    for (uint32_t first = 0; !st && first < b->group_count; first += b->in_flight) {
        uint32_t left = b->group_count - first, count = left < b->in_flight ? left : b->in_flight;
        for (uint32_t i = 0; i < count; i++) groups[i] = (group){.b = b, .number = first + i};
        st = tli_parallel(ctx, count, 1, cut_task, groups);
        for (uint32_t i = 0; !st && i < count; i++)
            st = store_group(b, &groups[i], &pieces, &piece_count);
        for (uint32_t i = 0; i < count; i++) release_group(ctx, &groups[i]);
        tli_scratch_forget(b->vert_map, 0, b->vert_map_bytes);
        if (!st) st = tl_progress(ctx, "segments", first + count, b->group_count);
    }
    if (!st) st = number_segments(b, pieces, piece_count);
    tl_mem_free(ctx, groups);
    tl_mem_free(ctx, pieces);
    tli_bins_close(&b->tets);
    return st;
}
