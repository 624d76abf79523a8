/* The boundary of a segment's result against the original one. What stands for the original are its
 * triangles, cut up where patches part, so that each piece is carried by one patch. Where a new
 * triangle is so near to them that it makes no difference it takes their place, so that flat parts
 * cost what they weigh at each level. Both ways, from the original and to it, the distance is
 * bounded for whole triangles, not at samples. */
#include "model/model_boundary.h"
#include "base/base_vec.h"

#include <string.h>

#include "base/base_sort.h"
#include "mesh/mesh_edge.h"

/* Relative to the largest error of the level before: how near a triangle must be to take the place
 * of the original ones, and how far all that took such a place may be off together. */
static const double NEAR = 0.1, NEAR_TOGETHER = 0.15;
/* What is accepted between a distance and its bound, relative to the same. */
static const double GAP = 0.02;
/* Relative to the diagonal: distances that make no difference. */
static const double FLAT = 2e-7;
/* Pieces this small, relative to the error here or to the largest of the level before, are not cut.
 */
static const double UNCUT = 0.2;
/* Part of the sides with more than two triangles from which on nothing is measured. */
static const double WILD = 0.1;
/* Cuts of a segment beside two for each triangle; triangles for each new one at which none is cut
 * any more. */
enum { CUTS_MIN = 256, FINE_ENOUGH = 1024 };
/* Cuts of a new triangle over the boundary before. */
enum { SETTLE_CUTS = 64 };
/* Part of the error that inputs may have been off by to tell something of what they become. */
static const double WELL_WITHIN = 0.6;

/* ---- faces where the segment was cut out ---- */

/* Faces of three locked vertices that one tet has and that are not boundary. */
typedef struct face_slot {
    tl_lidx verts[3]; /* ascending; the first TL_NONE: free */
    uint32_t tets;
} face_slot;

typedef struct face_table {
    face_slot *slots;
    size_t mask, used;
} face_table;

static void sort_three(tl_lidx v[3])
{
    for (int i = 0; i < 3; i++) {
        int next = i == 1 ? 1 : 0; /* 0-1, 1-2, 0-1 */
        tl_lidx a = v[next], b = v[next + 1];
        v[next] = a < b ? a : b;
        v[next + 1] = a < b ? b : a;
    }
}

static face_slot *find_face(const face_table *table, const tl_lidx v[3])
{
    uint64_t h = v[0] * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 32 ^ v[1]) * 0xbf58476d1ce4e5b9u;
    h = (h ^ h >> 32 ^ v[2]) * 0x94d049bb133111ebu;
    size_t at = (size_t)(h >> 20) & table->mask;
    while (table->slots[at].verts[0] != TL_NONE &&
           memcmp(table->slots[at].verts, v, 3 * sizeof *v) != 0)
        at = (at + 1) & table->mask;
    return &table->slots[at];
}

static tl_status grow_table(tl_ctx *ctx, face_table *table)
{
    tl_status st = TL_OK;
    face_table old = *table;
    size_t slots = old.slots ? 2 * (old.mask + 1) : 1024;
    table->slots = tl_mem_alloc(ctx, slots, sizeof *table->slots, &st);
    if (st) {
        *table = old;
        return st;
    }
    table->mask = slots - 1;
    for (size_t i = 0; i < slots; i++) table->slots[i].verts[0] = TL_NONE;
    for (size_t i = 0; old.slots && i <= old.mask; i++)
        if (old.slots[i].verts[0] != TL_NONE) *find_face(table, old.slots[i].verts) = old.slots[i];
    tl_mem_free(ctx, old.slots);
    return TL_OK;
}

static bool has_vertex_twice(const tl_lidx q[4])
{
    return q[0] == q[1] || q[0] == q[2] || q[0] == q[3] || q[1] == q[2] || q[1] == q[3] ||
           q[2] == q[3];
}

/* Faces between locked vertices stay as they are, so those of the input are those of the result. */
static tl_status list_cut_faces(tl_ctx *ctx, const tli_weld *weld, face_table *table)
{
    tl_status st = grow_table(ctx, table);
    for (size_t t = 0; !st && t < weld->mesh->tet_count; t++) {
        const tl_lidx *q = weld->mesh->tets + 4 * t;
        unsigned locked = 0;
        for (unsigned i = 0; i < 4; i++) locked |= (unsigned)(weld->locked[q[i]] != 0) << i;
        for (unsigned f = 0; !st && f < 4; f++) {
            tl_lidx v[3];
            if ((locked | 1u << f) != 15u || weld->outer[t] >> f & 1) continue;
            for (int i = 0; i < 3; i++) v[i] = q[tli_tet_faces[f][i]];
            sort_three(v);
            face_slot *slot = find_face(table, v);
            if (slot->verts[0] == TL_NONE) {
                memcpy(slot->verts, v, sizeof v);
                slot->tets = 0;
                table->used++;
            }
            slot->tets++;
            if (2 * table->used > table->mask) st = grow_table(ctx, table);
        }
    }
    return st;
}

static bool is_cut_face(const face_table *table, const tli_weld *weld, const tl_lidx *origins,
                        const tl_lidx face[3])
{
    tl_lidx v[3];
    for (int i = 0; i < 3; i++) {
        v[i] = origins[face[i]];
        if (!weld->locked[v[i]]) return false;
    }
    sort_three(v);
    const face_slot *slot = find_face(table, v);
    return slot->verts[0] != TL_NONE && slot->tets == 1;
}

/* ---- the new boundary ---- */

static void mark_outer(const tli_weld *weld, const tli_piece_result *piece, const tl_lidx *opposite,
                       const face_table *table, uint8_t *outer)
{
    const tl_mesh *mesh = piece->mesh;
    for (size_t t = 0; t < mesh->tet_count; t++) {
        const tl_lidx *q = mesh->tets + 4 * t;
        for (unsigned f = 0; f < 4; f++) {
            tl_lidx face[3];
            if (opposite[4 * t + f] != TL_NONE || has_vertex_twice(q)) continue;
            for (int i = 0; i < 3; i++) face[i] = q[tli_tet_faces[f][i]];
            if (is_cut_face(table, weld, piece->origins, face)) continue;
            outer[t] |= (uint8_t)(1u << f);
        }
    }
}

/* The faces of a mesh that are boundary; gives *tet_of [triangle_count] unless that is NULL. */
static tl_status make_surface(tl_ctx *ctx, const tl_mesh *mesh, const uint8_t *outer,
                              tli_surface *surface, tl_lidx **tet_of)
{
    tl_status st = TL_OK;
    size_t count = 0, n = 0;
    for (size_t t = 0; t < mesh->tet_count; t++)
        for (unsigned f = 0; f < 4; f++) count += outer[t] >> f & 1;
    tl_lidx *triangles = tl_mem_alloc(ctx, count, 3 * sizeof *triangles, &st);
    tl_lidx *tets = tl_mem_alloc(ctx, count, sizeof *tets, &st);
    for (size_t t = 0; !st && t < mesh->tet_count; t++)
        for (unsigned f = 0; outer[t] && f < 4; f++) {
            if (!(outer[t] >> f & 1)) continue;
            for (size_t i = 0; i < 3; i++)
                triangles[3 * n + i] = mesh->tets[4 * t + tli_tet_faces[f][i]];
            tets[n++] = (tl_lidx)t;
        }
    if (!st) st = tli_surface_create(ctx, mesh->xyz, mesh->vert_count, triangles, count, surface);
    if (tet_of) *tet_of = tl_mem_alloc(ctx, count, sizeof **tet_of, &st);
    for (size_t i = 0; tet_of && !st && i < count; i++) (*tet_of)[i] = tets[surface->origins[i]];
    tl_mem_free(ctx, tets);
    tl_mem_free(ctx, triangles);
    return st;
}

static tl_status find_after(tli_boundary *b, const tli_weld *weld, const tli_piece_result *piece,
                            const tl_lidx *opposite)
{
    face_table table = {0};
    tl_status st = list_cut_faces(b->ctx, weld, &table);
    if (!st) mark_outer(weld, piece, opposite, &table, b->outer);
    tl_mem_free(b->ctx, table.slots);
    return st ? st : make_surface(b->ctx, piece->mesh, b->outer, &b->after, &b->tet_of);
}

/* ---- sides of the new triangles ---- */

/* Sides as 3 * triangle + corner they start at, equal ones one after another. */
typedef struct side_list {
    uint64_t *keys; /* tli_edge_key */
    uint32_t *sides;
    size_t count;
} side_list;

static tl_status list_sides(const tli_boundary *b, side_list *list)
{
    tl_status st = TL_OK;
    size_t n = list->count = 3 * b->after.triangle_count;
    list->keys = tl_mem_alloc(b->ctx, n, sizeof *list->keys, &st);
    list->sides = tl_mem_alloc(b->ctx, n, sizeof *list->sides, &st);
    for (size_t i = 0; !st && i < n; i++) {
        size_t next = i % 3 == 2 ? i - 2 : i + 1;
        list->keys[i] = tli_edge_key(b->after.triangles[i], b->after.triangles[next]);
        list->sides[i] = (uint32_t)i;
    }
    return st ? st : tli_sort_u64(b->ctx, list->keys, list->sides, n);
}

static void release_sides(tl_ctx *ctx, side_list *list)
{
    tl_mem_free(ctx, list->sides);
    tl_mem_free(ctx, list->keys);
}

/* Is the new boundary a heap of triangles through one another rather than a surface? */
static tl_status find_wild(const tli_boundary *b, bool *wild)
{
    side_list list = {0};
    size_t many = 0;
    tl_status st = list_sides(b, &list);
    for (size_t i = 0, end; !st && i < list.count; i = end) {
        for (end = i + 1; end < list.count && list.keys[end] == list.keys[i]; end++) {
        }
        if (end - i > 2) many += end - i;
    }
    *wild = (double)many > WILD * (double)list.count;
    release_sides(b->ctx, &list);
    return st;
}

/* ---- what stands for the original ---- */

/* Triangles as they come, and their corners welded by place. */
typedef struct gatherer {
    tl_ctx *ctx;
    double *corners; /* [count][9] */
    size_t count, capacity;
} gatherer;

static tl_status gather(gatherer *g, const double corners[9])
{
    tl_status st = TL_OK;
    if (g->count == g->capacity) {
        size_t capacity = g->capacity ? g->capacity + g->capacity / 2 : 1024;
        g->corners = tl_mem_resize(g->ctx, g->corners, capacity, 9 * sizeof *g->corners, &st);
        if (st) return st;
        g->capacity = capacity;
    }
    memcpy(g->corners + 9 * g->count++, corners, 9 * sizeof *corners);
    return TL_OK;
}

static tl_status gather_window(void *user, tli_record_window *window)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < window->count; i++)
        st = gather(user, window->records + i * TLI_FACE_DOUBLES);
    return st;
}

/* Moves equal corners together: corners become vertices, triangles their numbers. */
static tl_status weld_corners(gatherer *g, tl_lidx *triangles, size_t *vert_count)
{
    tl_status st = TL_OK;
    size_t slots = 16, n = 0, corner_count = 3 * g->count;
    while (slots < 2 * corner_count) slots *= 2;
    tl_lidx *table = tl_mem_alloc(g->ctx, slots, sizeof *table, &st);
    for (size_t i = 0; !st && i < slots; i++) table[i] = TL_NONE;
    for (size_t i = 0; !st && i < corner_count; i++) {
        double x[3];
        memcpy(x, g->corners + 3 * i, sizeof x);
        uint64_t hash = vec_hash(x);
        size_t at = (size_t)(hash ^ hash >> 32) & (slots - 1);
        while (table[at] != TL_NONE && memcmp(g->corners + 3 * (size_t)table[at], x, sizeof x) != 0)
            at = (at + 1) & (slots - 1);
        if (table[at] == TL_NONE) {
            memcpy(g->corners + 3 * n, x, sizeof x); /* n is at most i */
            table[at] = (tl_lidx)n++;
        }
        triangles[i] = table[at];
    }
    tl_mem_free(g->ctx, table);
    *vert_count = n;
    return st;
}

static tl_status find_before(tli_boundary *b, const tli_level *level,
                             const tli_segment_note *segment)
{
    const tli_model *m = level->model;
    gatherer g = {.ctx = b->ctx};
    tl_lidx *triangles = NULL;
    size_t vert_count = 0;
    const tli_pass pass = {.after = gather_window, .user = &g};
    tl_status st =
        tli_records_read(b->ctx, m, m->carried[level->level & 1], segment, TLI_FACES, &pass);
    triangles = tl_mem_alloc(b->ctx, g.count, 3 * sizeof *triangles, &st);
    if (!st) st = weld_corners(&g, triangles, &vert_count);
    if (!st) st = tli_surface_create(b->ctx, g.corners, vert_count, triangles, g.count, &b->before);
    tl_mem_free(b->ctx, triangles);
    tl_mem_free(b->ctx, g.corners);
    return st;
}

/* ---- both ---- */

static double farthest_corner(const tli_reach *reach, size_t triangle)
{
    const tl_lidx *v = reach->query.from->triangles + 3 * triangle;
    const double *d = reach->distances;
    return fmax(d[v[0]], fmax(d[v[1]], d[v[2]]));
}

/* Triangles that the surface they are measured to, of which those taken count, is near to. */
static void find_near(const tli_reach *reach, const uint8_t *taken, double most, uint8_t *is_near,
                      double *farthest)
{
    for (size_t t = 0; t < reach->query.from->triangle_count; t++) {
        double corners[9];
        if (farthest_corner(reach, t) > most) continue;
        tli_surface_triangle(reach->query.from, t, corners);
        double reached = tli_surface_cover(reach->query.to, taken, corners, most);
        is_near[t] = reached <= most;
        if (is_near[t]) *farthest = fmax(*farthest, reached);
    }
}

/* How far an input's boundary was off, by what was promised. */
static double promised_before(const tli_model *model, uint32_t patch)
{
    uint32_t by = model->patches[patch].producer;
    return by == TL_NONE ? model->finest_surface : model->segments[by].errors.surface;
}

/* The boundary as it was before this level, of the inputs that were promised to be well within
 * error; *rest: error less what they were promised to be within. */
static tl_status find_old(const tli_boundary *b, const tli_model *model,
                          const tli_segment_note *segment, const tli_weld *weld, double error,
                          double *rest, tli_surface *old)
{
    tl_status st = TL_OK;
    double off = 0;
    size_t count = weld->mesh->tet_count;
    uint8_t *outer = tl_mem_zalloc(b->ctx, count, 1, &st);
    for (uint32_t i = 0; !st && i < segment->input_count; i++) {
        double promised = promised_before(model, segment->inputs[i]);
        size_t first = weld->tet_base[i];
        size_t end = i + 1 < segment->input_count ? weld->tet_base[i + 1] : count;
        if (!(promised < WELL_WITHIN * error)) continue;
        off = fmax(off, promised);
        memcpy(outer + first, weld->outer + first, end - first);
    }
    if (!st) st = make_surface(b->ctx, weld->mesh, outer, old, NULL);
    *rest = error - off;
    tl_mem_free(b->ctx, outer);
    return st;
}

/* New triangles that the boundary before was so near to, and that to the original, that they can't
 * be farther than error are settled [after.triangle_count]: there are far fewer triangles of the
 * boundary before than original ones, over many of which a new one lies. */
static tl_status settle(const tli_boundary *b, const tli_level *level,
                        const tli_segment_note *segment, const tli_weld *weld, double error,
                        uint8_t *settled)
{
    tli_surface old = {0};
    tli_reach reach = {0};
    double corners[9], found, bound, rest;
    tl_status st = find_old(b, level->model, segment, weld, error, &rest, &old);
    for (size_t t = 0; !st && t < b->after.triangle_count; t++) {
        if (settled[t]) continue;
        tli_surface_triangle(&b->after, t, corners);
        settled[t] = tli_surface_cover(&old, NULL, corners, rest) <= rest;
    }
    if (!st && old.triangle_count > 0) {
        st = tli_reach_create(b->ctx, &b->after, &old, settled, 0, &reach);
        reach.query.found = rest;
        reach.query.tolerance_relative = 0;
        reach.query.split_max = SETTLE_CUTS;
        for (size_t t = 0; !st && t < b->after.triangle_count; t++) {
            if (settled[t] || farthest_corner(&reach, t) > rest) continue;
            tli_surface_bound(&reach.query, t, &found, &bound);
            settled[t] = bound <= rest;
        }
    }
    tli_reach_release(&reach);
    tli_surface_release(&old);
    return st;
}

/* New triangles near to the original take its place; of that what is near to these goes. The rest
 * is measured. */
static tl_status measure(tli_boundary *b, const tli_level *level, const tli_segment_note *segment,
                         const tli_weld *weld)
{
    tl_status st = TL_OK;
    tli_reach back = {0};
    double flat = FLAT * level->model->plan->diagonal, largest = level->surface_before;
    double gap = fmax(GAP * largest, flat), farthest = 0;
    double near = fmax(fmin(NEAR * largest, NEAR_TOGETHER * largest - b->spread), flat);
    size_t count = b->after.triangle_count;
    b->spread_after = b->spread;
    b->least = UNCUT * largest;
    if (b->before.triangle_count == 0 || count == 0) {
        bool both = b->before.triangle_count == count;
        b->error = both ? 0 : (double)INFINITY;
        return TL_OK;
    }
    b->is_near = tl_mem_zalloc(b->ctx, count, 1, &st);
    b->goes = tl_mem_zalloc(b->ctx, b->before.triangle_count, 1, &st);
    uint8_t *settled = tl_mem_zalloc(b->ctx, count, 1, &st);
    if (!st) st = tli_reach_create(b->ctx, &b->before, &b->after, b->goes, gap, &b->reach);
    if (!st) st = tli_reach_create(b->ctx, &b->after, &b->before, settled, gap, &back);
    if (!st) {
        find_near(&back, NULL, near, b->is_near, &farthest);
        find_near(&b->reach, b->is_near, near, b->goes, &farthest);
        b->spread_after += farthest;
        for (uint32_t i = 0; i < segment->input_count; i++)
            b->reach.query.found =
                fmax(b->reach.query.found, promised_before(level->model, segment->inputs[i]));
        tli_reach_bound(&b->reach);
        back.query.found = fmax(back.query.found, b->reach.query.found);
        memcpy(settled, b->is_near, count);
        st = settle(b, level, segment, weld, back.query.found, settled);
    }
    if (!st) {
        tli_reach_bound(&back);
        b->error = fmax(fmax(b->reach.bound, back.bound) + b->spread, b->spread_after);
        b->least = UNCUT * fmax(largest, b->error);
    }
    tli_reach_release(&back);
    tl_mem_free(b->ctx, settled);
    return st;
}

tl_status tli_boundary_measure(tl_ctx *ctx, const tli_level *level, const tli_segment_note *segment,
                               const tli_weld *weld, const tli_piece_result *piece,
                               const tl_lidx *opposite, tli_boundary *b)
{
    tl_status st = TL_OK;
    bool any = false, wild = false;
    *b = (tli_boundary){.ctx = ctx};
    b->outer = tl_mem_zalloc(ctx, piece->mesh->tet_count, 1, &st);
    for (size_t t = 0; !any && t < weld->mesh->tet_count; t++) any = weld->outer[t] != 0;
    if (st || !any) return st;
    for (uint32_t i = 0; i < segment->input_count; i++)
        b->spread = fmax(b->spread, level->model->patches[segment->inputs[i]].spread);
    st = find_after(b, weld, piece, opposite);
    if (!st) st = find_wild(b, &wild);
    if (st || wild || !isfinite(b->spread)) {
        b->error = b->spread = b->spread_after = (double)INFINITY;
        return st;
    }
    st = find_before(b, level, segment);
    return st ? st : measure(b, level, segment, weld);
}

/* ---- dealing ---- */

/* Sides of the new triangles beyond which another part begins, or nothing. */
static tl_status find_borders(const tli_boundary *b, const uint32_t *labels, uint8_t *borders)
{
    side_list list = {0};
    tl_status st = list_sides(b, &list);
    size_t n = list.count;
    const uint64_t *keys = list.keys;
    const uint32_t *sides = list.sides;
    for (size_t i = 0, end; !st && i < n; i = end) {
        bool one = true;
        for (end = i + 1; end < n && keys[end] == keys[i]; end++)
            one = one && labels[sides[end] / 3] == labels[sides[i] / 3];
        if (one && end - i > 1) continue;
        for (size_t k = i; k < end; k++) borders[sides[k] / 3] |= (uint8_t)(1u << sides[k] % 3);
    }
    release_sides(b->ctx, &list);
    return st;
}

typedef struct piece_dealer {
    const tl_lidx *tet_of;
    const uint32_t *part; /* of the tets */
    tli_dealer *to;
} piece_dealer;

/* A piece goes to the part of a new triangle. */
static tl_status deal_piece(void *user, const double corners[9], tl_lidx triangle)
{
    const piece_dealer *d = user;
    double record[TLI_FACE_DOUBLES] = {0};
    memcpy(record, corners, 9 * sizeof *record);
    return tli_dealer_add(d->to, d->part[d->tet_of[triangle]], record, 0);
}

static tl_status deal_near(const tli_boundary *b, piece_dealer *dealer)
{
    tl_status st = TL_OK;
    for (size_t t = 0; !st && t < b->after.triangle_count; t++) {
        double corners[9];
        if (!b->is_near[t]) continue;
        tli_surface_triangle(&b->after, t, corners);
        st = deal_piece(dealer, corners, (tl_lidx)t);
    }
    return st;
}

tl_status tli_boundary_deal(const tli_boundary *b, const uint32_t *part, const uint32_t *label,
                            tli_dealer *to)
{
    tl_status st = TL_OK;
    size_t count = b->after.triangle_count;
    piece_dealer dealer = {b->tet_of, part, to};
    if (!count || !b->before.triangle_count) return TL_OK; /* nothing is known, or to be known */
    uint32_t *labels = tl_mem_alloc(b->ctx, count, sizeof *labels, &st);
    uint8_t *borders = tl_mem_zalloc(b->ctx, count, sizeof *borders, &st);
    for (size_t i = 0; !st && i < count; i++) labels[i] = label[part[b->tet_of[i]]];
    if (!st) st = find_borders(b, labels, borders);
    if (!st) st = deal_near(b, &dealer);
    tli_deal_query deal = {&b->after, labels, borders, b->least,
                           CUTS_MIN + 2 * b->before.triangle_count};
    if (b->before.triangle_count > FINE_ENOUGH * (count + FINE_ENOUGH)) deal.splits_left = 0;
    for (size_t t = 0; !st && t < b->before.triangle_count; t++)
        if (!b->goes[t]) st = tli_surface_deal(&b->reach.query, &deal, t, deal_piece, &dealer);
    tl_mem_free(b->ctx, borders);
    tl_mem_free(b->ctx, labels);
    return st;
}

void tli_boundary_release(tli_boundary *b)
{
    if (!b->ctx) return;
    tl_ctx *ctx = b->ctx;
    tli_reach_release(&b->reach);
    tli_surface_release(&b->after);
    tli_surface_release(&b->before);
    void *blocks[] = {b->goes, b->is_near, b->tet_of, b->outer};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    *b = (tli_boundary){0};
}
