/* Labelled faces of a file become faces of tets. A labelled polygon is cut into every triangle that
 * the split of its cell could have made of it: a quad into the four of both diagonals, larger ones
 * as formats_poly.c cuts them. The triangles are sorted; then each face of a tet all of whose
 * corners are corners of labelled faces is looked up. */
#include "formats/formats_tets.h"
#include "mesh/mesh.h"

#include <stdlib.h>
#include <string.h>

/* A triangle that a label may have: corners ascending. */
typedef struct candidate {
    tl_lidx corners[3];
    uint32_t label;
    uint64_t polygon; /* counted over all labels */
} candidate;

typedef struct candidate_list {
    candidate *items;
    size_t count;
    uint64_t polygon_count;
} candidate_list;

static void sort_three(tl_lidx c[3])
{
    for (int i = 0; i < 3; i++) {
        int a = i == 1, b = a + 1;
        if (c[a] <= c[b]) continue;
        tl_lidx swap = c[a];
        c[a] = c[b];
        c[b] = swap;
    }
}

static int compare_corners(const tl_lidx a[3], const tl_lidx b[3])
{
    for (int i = 0; i < 3; i++)
        if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
    return 0;
}

static int compare_candidates(const void *a, const void *b)
{
    const candidate *x = a, *y = b;
    int order = compare_corners(x->corners, y->corners);
    if (order) return order;
    if (x->label != y->label) return x->label < y->label ? -1 : 1;
    return x->polygon < y->polygon ? -1 : x->polygon > y->polygon;
}

/* ---- candidates ---- */

static size_t candidates_of(uint64_t corners)
{
    return corners < 3 ? 0 : corners == 3 ? 1 : corners == 4 ? 4 : (size_t)corners - 2;
}

static void add_candidate(candidate_list *list, tl_lidx a, tl_lidx b, tl_lidx c, uint32_t label)
{
    candidate *item = &list->items[list->count++];
    *item = (candidate){{a, b, c}, label, list->polygon_count};
    sort_three(item->corners);
}

static tl_status add_polygon(const tli_tets *t, candidate_list *list, const uint32_t *ids,
                             size_t count, uint32_t label)
{
    tl_status st = TL_OK;
    if (count == 3) {
        add_candidate(list, ids[0], ids[1], ids[2], label);
    } else if (count == 4) {
        for (unsigned i = 0; i < 4; i++)
            add_candidate(list, ids[i], ids[(i + 1) % 4], ids[(i + 2) % 4], label);
    } else if (count > 4) {
        tl_lidx(*cut)[3] = tl_mem_alloc(t->ctx, count - 2, sizeof *cut, &st);
        if (st) return st;
        tli_poly_cut_face(t->grid->xyz, ids, count, cut);
        for (size_t i = 0; i + 2 < count; i++)
            add_candidate(list, cut[i][0], cut[i][1], cut[i][2], label);
        tl_mem_free(t->ctx, cut);
    }
    list->polygon_count++;
    return st;
}

static tl_status list_candidates(tli_tets *t, candidate_list *list)
{
    const tli_grid *grid = t->grid;
    tl_status st = TL_OK;
    size_t room = 0;
    for (uint32_t i = 0; i < grid->label_count; i++)
        for (uint64_t f = 0; f < grid->labels[i].face_count; f++)
            room += candidates_of(grid->labels[i].offsets[f + 1] - grid->labels[i].offsets[f]);
    list->items = tl_mem_alloc(t->ctx, room, sizeof *list->items, &st);
    for (uint32_t i = 0; i < grid->label_count && !st; i++) {
        const tli_grid_label *label = &grid->labels[i];
        for (uint64_t f = 0; f < label->face_count && !st; f++) {
            const uint32_t *ids = label->points + label->offsets[f];
            size_t count = (size_t)(label->offsets[f + 1] - label->offsets[f]);
            for (size_t c = 0; c < count; c++) t->point_marks[ids[c]] |= TLI_POINT_LABEL;
            st = add_polygon(t, list, ids, count, i);
        }
    }
    if (!st && list->count)
        qsort(list->items, list->count, sizeof *list->items, compare_candidates);
    return st;
}

/* ---- faces of tets ---- */

/* The first candidate with these corners, or the count. */
static size_t find_candidate(const candidate_list *list, const tl_lidx corners[3])
{
    size_t low = 0, high = list->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (compare_corners(list->items[middle].corners, corners) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    bool found = low < list->count && compare_corners(list->items[low].corners, corners) == 0;
    return found ? low : list->count;
}

/* Labels of one face: each once. */
static tl_status take_face(tli_tets *t, const candidate_list *list, size_t at, tl_lidx face,
                           uint8_t *polygons, tli_label_faces *found, uint64_t *room)
{
    tl_status st = TL_OK;
    const tl_lidx *corners = list->items[at].corners;
    uint32_t last = UINT32_MAX;
    for (; at < list->count && compare_corners(list->items[at].corners, corners) == 0; at++) {
        const candidate *item = &list->items[at];
        polygons[item->polygon] = 1;
        if (item->label == last) continue;
        last = item->label;
        if (found->count == *room) {
            uint64_t wanted = *room ? 2 * *room : 1024;
            found->labels =
                tl_mem_resize(t->ctx, found->labels, (size_t)wanted, sizeof *found->labels, &st);
            found->faces =
                tl_mem_resize(t->ctx, found->faces, (size_t)wanted, sizeof *found->faces, &st);
            if (st) return st;
            *room = wanted;
        }
        found->labels[found->count] = item->label;
        found->faces[found->count++] = face;
    }
    return TL_OK;
}

static tl_status match_faces(tli_tets *t, const candidate_list *list, uint8_t *polygons,
                             tli_label_faces *found)
{
    tl_status st = TL_OK;
    uint64_t room = 0;
    for (size_t tet = 0; tet < t->tet_count && !st; tet++) {
        const tl_lidx *v = t->tets + 4 * tet;
        unsigned labelled = 0;
        for (unsigned i = 0; i < 4; i++) labelled += (t->point_marks[v[i]] & TLI_POINT_LABEL) != 0;
        if (labelled < 3) continue;
        for (unsigned f = 0; f < 4 && !st; f++) {
            const uint8_t *corner = tli_tet_faces[f];
            tl_lidx corners[3] = {v[corner[0]], v[corner[1]], v[corner[2]]};
            sort_three(corners);
            size_t at = find_candidate(list, corners);
            if (at < list->count)
                st = take_face(t, list, at, (tl_lidx)(4 * tet + f), polygons, found, &room);
        }
    }
    return st;
}

/* Says which labels lie elsewhere than on faces of volume cells. */
static void say_unmatched(const tli_tets *t, const uint8_t *polygons)
{
    uint64_t polygon = 0;
    for (uint32_t i = 0; i < t->grid->label_count; i++) {
        const tli_grid_label *label = &t->grid->labels[i];
        uint64_t missing = 0;
        for (uint64_t f = 0; f < label->face_count; f++) missing += !polygons[polygon++];
        if (missing)
            tl_log(t->ctx, TL_LOG_INFO,
                   "surface %d '%s': %llu of %llu faces are no faces of volume cells, left out",
                   label->id, label->name, (unsigned long long)missing,
                   (unsigned long long)label->face_count);
    }
}

tl_status tli_tets_find_labels(tli_tets *t, tli_label_faces *found)
{
    candidate_list list = {0};
    if (!t->grid->label_count) return TL_OK;
    tl_status st = list_candidates(t, &list);
    uint8_t *polygons = tl_mem_zalloc(t->ctx, (size_t)list.polygon_count, 1, &st);
    if (!st) st = match_faces(t, &list, polygons, found);
    if (!st && t->tet_count) say_unmatched(t, polygons);
    tl_mem_free(t->ctx, polygons);
    tl_mem_free(t->ctx, list.items);
    return st;
}

/* ---- into the mesh ---- */

tl_status tli_tets_add_labels(const tli_tets *t, const tli_label_faces *found, tl_mesh *mesh)
{
    tl_status st = TL_OK;
    uint32_t labels = t->grid->label_count;
    if (!labels) return TL_OK;
    size_t *ends = tl_mem_zalloc(t->ctx, (size_t)labels + 1, sizeof *ends, &st);
    tl_lidx *faces = tl_mem_alloc(t->ctx, (size_t)found->count, sizeof *faces, &st);
    if (!st) {
        for (uint64_t i = 0; i < found->count; i++) ends[found->labels[i] + 1]++;
        for (uint32_t i = 0; i < labels; i++) ends[i + 1] += ends[i];
        for (uint64_t i = 0; i < found->count; i++) /* now ends[i] runs from begin to end */
            faces[ends[found->labels[i]]++] = found->faces[i];
    }
    for (uint32_t i = 0; i < labels && !st; i++) {
        size_t begin = i ? ends[i - 1] : 0;
        const tli_grid_label *label = &t->grid->labels[i];
        st = tl_mesh_add_label(mesh,
                               &(tl_label){label->name, label->id, ends[i] - begin, faces + begin});
    }
    tl_mem_free(t->ctx, faces);
    tl_mem_free(t->ctx, ends);
    return st;
}
