/* CGNS: sections of elements. Elements of the dimension of the base become cells; those of one less
 * stay where they are, to be looked up by boundary conditions. */
#include "formats/formats_cgns.h"
#include "formats/formats_split.h"

#include <stdlib.h>
#include <string.h>

/* Numbers of CGNS. */
#define MIXED 20
#define NGON 22
#define NFACE 23
/* Ids converted at a time. */
#define CHUNK 16384

/* VTK type, nodes and corners by the number of the kind; dimension 0: unknown. */
typedef struct kind {
    uint8_t type, nodes, corners, dim;
} kind;
static const kind kinds[] = {
    [2] = {TLI_VTK_VERTEX, 1, 1, 0},
    [3] = {TLI_VTK_LINE, 2, 2, 1},
    [4] = {TLI_VTK_QUADRATIC_EDGE, 3, 2, 1},
    [5] = {TLI_VTK_TRIANGLE, 3, 3, 2},
    [6] = {TLI_VTK_QUADRATIC_TRIANGLE, 6, 3, 2},
    [7] = {TLI_VTK_QUAD, 4, 4, 2},
    [8] = {TLI_VTK_QUADRATIC_QUAD, 8, 4, 2},
    [9] = {TLI_VTK_BIQUADRATIC_QUAD, 9, 4, 2},
    [10] = {TLI_VTK_TETRA, 4, 4, 3},
    [11] = {TLI_VTK_QUADRATIC_TETRA, 10, 4, 3},
    [12] = {TLI_VTK_PYRAMID, 5, 5, 3},
    [13] = {TLI_VTK_LAGRANGE_PYRAMID, 14, 5, 3},
    [14] = {TLI_VTK_WEDGE, 6, 6, 3},
    [15] = {TLI_VTK_QUADRATIC_WEDGE, 15, 6, 3},
    [16] = {TLI_VTK_BIQUADRATIC_WEDGE, 18, 6, 3},
    [17] = {TLI_VTK_HEXAHEDRON, 8, 8, 3},
    [18] = {TLI_VTK_QUADRATIC_HEXAHEDRON, 20, 8, 3},
    [19] = {TLI_VTK_TRIQUADRATIC_HEXAHEDRON, 27, 8, 3},
    [21] = {TLI_VTK_QUADRATIC_PYRAMID, 13, 5, 3},
    [24] = {TLI_VTK_LAGRANGE_CURVE, 4, 2, 1},
    [25] = {TLI_VTK_LAGRANGE_TRIANGLE, 9, 3, 2},
    [26] = {TLI_VTK_LAGRANGE_TRIANGLE, 10, 3, 2},
    [27] = {TLI_VTK_LAGRANGE_QUAD, 12, 4, 2},
    [28] = {TLI_VTK_LAGRANGE_QUAD, 16, 4, 2},
    [29] = {TLI_VTK_LAGRANGE_TETRA, 16, 4, 3},
    [30] = {TLI_VTK_LAGRANGE_TETRA, 20, 4, 3},
    [31] = {TLI_VTK_LAGRANGE_PYRAMID, 21, 5, 3},
    [32] = {TLI_VTK_LAGRANGE_PYRAMID, 29, 5, 3},
    [33] = {TLI_VTK_LAGRANGE_PYRAMID, 30, 5, 3},
    [34] = {TLI_VTK_LAGRANGE_WEDGE, 24, 6, 3},
    [35] = {TLI_VTK_LAGRANGE_WEDGE, 38, 6, 3},
    [36] = {TLI_VTK_LAGRANGE_WEDGE, 40, 6, 3},
    [37] = {TLI_VTK_LAGRANGE_HEXAHEDRON, 32, 8, 3},
    [38] = {TLI_VTK_LAGRANGE_HEXAHEDRON, 56, 8, 3},
    [39] = {TLI_VTK_LAGRANGE_HEXAHEDRON, 64, 8, 3},
};
#define KIND_COUNT (sizeof kinds / sizeof kinds[0])

/* ---- the list ---- */

static tl_status open_section(tli_cg_zone *zone, const tli_cg_node *node, tli_cg_section *section)
{
    tli_cg *cg = zone->cg;
    int64_t head[2] = {0}, range[2] = {0};
    const tli_cg_node *element_range = tli_cg_child(node, "ElementRange");
    *section = (tli_cg_section){.node = node,
                                .ids = tli_cg_child(node, "ElementConnectivity"),
                                .starts = tli_cg_child(node, "ElementStartOffset")};
    if (node->count != 2 || !element_range || element_range->count != 2 || !section->ids)
        return tli_cg_fail(cg, node, "has no kind, range or connectivity");
    tl_status st = tli_cg_ints(cg, node, 0, 2, head);
    if (!st) st = tli_cg_ints(cg, element_range, 0, 2, range);
    if (st) return st;
    section->kind = head[0] > 0 && head[0] < 1000 ? (unsigned)head[0] : 0;
    section->first = range[0];
    section->last = range[1];
    if (range[0] < 1 || range[1] < range[0] - 1 ||
        (uint64_t)(range[1] - range[0] + 1) > section->ids->count)
        return tli_cg_fail(cg, node, "has a range of elements that its ids do not fill");
    if (section->starts && section->starts->count != (uint64_t)(range[1] - range[0] + 2))
        return tli_cg_fail(cg, section->starts, "is not of the size of its range");
    return TL_OK;
}

static tl_status list_sections(tli_cg_zone *zone)
{
    tl_status st = TL_OK;
    const tli_cg_node *node = NULL;
    size_t count = 0;
    while ((node = tli_cg_labelled(zone->node, "Elements_t", node))) count++;
    zone->sections = tl_mem_zalloc(zone->cg->ctx, count, sizeof *zone->sections, &st);
    while (!st && (node = tli_cg_labelled(zone->node, "Elements_t", node)))
        st = open_section(zone, node, &zone->sections[zone->section_count++]);
    return st;
}

static int compare_sections(const void *a, const void *b)
{
    const tli_cg_section *x = a, *y = b;
    return (x->first > y->first) - (x->first < y->first);
}

static uint64_t element_count(const tli_cg_section *section)
{
    return (uint64_t)(section->last - section->first + 1);
}

/* ---- ids ---- */

/* Values [first, first + count) of a list as ids from 0 on, each below limit. A face that is named
 * with a minus runs the other way: its direction is found later. */
static tl_status read_ids(tli_cg_zone *zone, const tli_cg_node *node, uint64_t first,
                          uint64_t count, int64_t base, uint64_t limit, bool may_turn,
                          uint32_t *out)
{
    tl_status st = TL_OK;
    int64_t *values = tl_mem_alloc(zone->cg->ctx, CHUNK, sizeof *values, &st);
    for (uint64_t done = 0; done < count && !st;) {
        uint64_t piece = count - done < CHUNK ? count - done : CHUNK;
        st = tli_cg_ints(zone->cg, node, first + done, piece, values);
        for (uint64_t i = 0; i < piece && !st; i++) {
            int64_t id = (may_turn && values[i] < 0 ? -values[i] : values[i]) - base;
            if (id < 0 || (uint64_t)id >= limit)
                st = tli_cg_fail(zone->cg, node, "names what there is none of");
            out[done + i] = (uint32_t)id;
        }
        done += piece;
    }
    tl_mem_free(zone->cg->ctx, values);
    return st;
}

/* ---- sections of one kind, of several ---- */

static tl_status read_uniform(tli_cg_zone *zone, const tli_cg_section *section, const kind *k,
                              tli_cells *cells)
{
    uint64_t count = element_count(section);
    if (count > section->ids->count / k->nodes)
        return tli_cg_fail(zone->cg, section->ids, "has fewer ids than its elements need");
    tl_status st = tli_cells_reserve(cells, count, count * k->nodes);
    if (st) return st;
    uint32_t *ids = cells->connectivity + cells->index_count;
    for (uint64_t i = 0; i < count; i++) tli_cells_add(cells, k->type, k->nodes, 0);
    return read_ids(zone, section->ids, 0, count * k->nodes, 1, zone->grid->point_count, false,
                    ids);
}

/* A kind in front of the nodes of each element. Polygons had their kind with the number of nodes
 * added in older files; as cells of volume they are none. */
static tl_status read_mixed(tli_cg_zone *zone, tli_cg_section *section, tli_cells *cells)
{
    tl_status st = TL_OK;
    uint64_t count = section->ids->count, at = 0;
    int64_t *values = tl_mem_alloc(zone->cg->ctx, (size_t)count, sizeof *values, &st);
    if (!st) st = tli_cg_ints(zone->cg, section->ids, 0, count, values);
    section->places =
        tl_mem_zalloc(zone->cg->ctx, (size_t)element_count(section), sizeof *section->places, &st);
    if (!st) st = tli_cells_reserve(cells, element_count(section), count);
    for (uint64_t e = 0; e < element_count(section) && !st; e++) {
        const kind *k = at < count && values[at] > 0 && values[at] < (int64_t)KIND_COUNT
                            ? &kinds[values[at]]
                            : NULL;
        if (!k || !k->nodes || k->nodes > count - at - 1) {
            st = tli_cg_fail(zone->cg, section->ids, "has an element of a kind that is not read");
            break;
        }
        section->places[e] = at++;
        if (k->dim != zone->cell_dim) {
            zone->surface_elements++;
            at += k->nodes;
            continue;
        }
        uint32_t *ids = tli_cells_add(cells, k->type, k->nodes, 0);
        for (unsigned i = 0; i < k->nodes && !st; i++, at++) {
            if (values[at] < 1 || (uint64_t)values[at] > zone->grid->point_count)
                st = tli_cg_fail(zone->cg, section->ids, "names a point that there is none of");
            ids[i] = (uint32_t)(values[at] - 1);
        }
    }
    tl_mem_free(zone->cg->ctx, values);
    return st;
}

/* ---- polygons and polyhedra ---- */

/* Calls take for each element with the place and number of its ids: by ElementStartOffset or, in
 * files before 3.4, by a count in front of each. */
typedef tl_status (*take_fn)(void *arg, uint64_t first, uint64_t count);
static tl_status each_ragged(tli_cg_zone *zone, const tli_cg_section *section, take_fn take,
                             void *arg)
{
    tl_status st = TL_OK;
    uint64_t elements = element_count(section), all = section->ids->count, at = 0;
    int64_t *starts = NULL, count = 0;
    if (section->starts) {
        starts = tl_mem_alloc(zone->cg->ctx, (size_t)elements + 1, sizeof *starts, &st);
        if (!st) st = tli_cg_ints(zone->cg, section->starts, 0, elements + 1, starts);
    }
    for (uint64_t e = 0; e < elements && !st; e++) {
        if (starts) {
            at = (uint64_t)starts[e];
            count = starts[e + 1] - starts[e];
        } else {
            if (at >= all)
                count = -1;
            else
                st = tli_cg_ints(zone->cg, section->ids, at++, 1, &count);
        }
        if (!st && (count < 0 || at > all || (uint64_t)count > all - at))
            st = tli_cg_fail(zone->cg, section->node, "has elements that end behind its ids");
        if (!st) st = take(arg, at, (uint64_t)count);
        at += (uint64_t)count;
    }
    tl_mem_free(zone->cg->ctx, starts);
    return st;
}

/* Ids of all elements of a section, read at once; take finds its part. */
typedef struct ragged {
    tli_cg_zone *zone;
    const uint32_t *ids;
    tli_face_list *faces;
    tli_cells *cells;
} ragged;

static tl_status take_face(void *arg, uint64_t first, uint64_t count)
{
    ragged *r = arg;
    for (uint64_t i = 0; i < count; i++)
        if (r->ids[first + i] >= r->zone->grid->point_count)
            return tli_cg_fail(r->zone->cg, r->zone->node, "has a face of points it has not");
    return tli_face_list_add(r->faces, r->ids + first, count, 0);
}

/* The face of the grid that an element number means, over all sections of polygons. */
static uint32_t face_of(const tli_cg_zone *zone, uint32_t id)
{
    int64_t number = (int64_t)id + 1;
    for (size_t s = 0; s < zone->section_count; s++) {
        const tli_cg_section *section = &zone->sections[s];
        if (section->kind == NGON && number >= section->first && number <= section->last)
            return (uint32_t)(section->first_face + (uint64_t)(number - section->first));
    }
    return UINT32_MAX;
}

static tl_status take_polyhedron(void *arg, uint64_t first, uint64_t count)
{
    ragged *r = arg;
    tl_status st = tli_cells_reserve(r->cells, 1, count);
    if (st) return st;
    uint32_t *faces = tli_cells_add(r->cells, TLI_VTK_POLYHEDRON, (uint32_t)count, 0);
    for (uint64_t i = 0; i < count; i++) {
        faces[i] = face_of(r->zone, r->ids[first + i]);
        if (faces[i] == UINT32_MAX)
            return tli_cg_fail(r->zone->cg, r->zone->node, "has a polyhedron of faces it has not");
    }
    return TL_OK;
}

static tl_status take_polygon(void *arg, uint64_t first, uint64_t count)
{
    ragged *r = arg;
    tl_status st = tli_cells_reserve(r->cells, 1, count);
    if (st) return st;
    uint32_t *ids = tli_cells_add(r->cells, TLI_VTK_POLYGON, (uint32_t)count, 0);
    memcpy(ids, r->ids + first, (size_t)count * sizeof *ids);
    return TL_OK;
}

/* Ids of a ragged section; the counts between them in older files pass as ids that nobody uses. */
static tl_status read_ragged(tli_cg_zone *zone, const tli_cg_section *section, bool may_turn,
                             take_fn take, ragged *r)
{
    tl_status st = TL_OK;
    uint64_t count = section->ids->count;
    uint32_t *ids = tl_mem_alloc(zone->cg->ctx, (size_t)count, sizeof *ids, &st);
    if (!st)
        st =
            read_ids(zone, section->ids, 0, count, 1 - !section->starts, UINT32_MAX, may_turn, ids);
    for (uint64_t i = 0; i < count && !section->starts && !st; i++) ids[i] -= ids[i] > 0;
    r->ids = ids;
    if (!st) st = each_ragged(zone, section, take, r);
    tl_mem_free(zone->cg->ctx, ids);
    return st;
}

static tl_status read_faces(tli_cg_zone *zone)
{
    tl_status st = TL_OK;
    tli_face_list faces;
    tli_face_list_begin(zone->grid, &faces);
    for (size_t s = 0; s < zone->section_count && !st; s++) {
        tli_cg_section *section = &zone->sections[s];
        ragged r = {.zone = zone, .faces = &faces};
        if (section->kind != NGON || zone->cell_dim < 3) continue;
        section->first_face = zone->grid->face_count;
        st = read_ragged(zone, section, false, take_face, &r);
    }
    return st ? st : tli_face_list_end(&faces);
}

/* ---- a zone ---- */

static tl_status read_section(tli_cg_zone *zone, tli_cg_section *section, tli_cells *cells)
{
    ragged r = {.zone = zone, .cells = cells};
    const kind *k = section->kind < KIND_COUNT ? &kinds[section->kind] : &kinds[0];
    if (section->kind == MIXED) return read_mixed(zone, section, cells);
    if (section->kind == NFACE) return read_ragged(zone, section, true, take_polyhedron, &r);
    if (section->kind == NGON && zone->cell_dim == 2)
        return read_ragged(zone, section, false, take_polygon, &r);
    if (section->kind == NGON) return TL_OK; /* faces of polyhedra: read before */
    if (!k->nodes) {
        tl_log(zone->cg->ctx, TL_LOG_INFO, "section '%s': %llu elements of kind %u left out",
               section->node->name, (unsigned long long)element_count(section), section->kind);
        return TL_OK;
    }
    if (k->dim == zone->cell_dim) return read_uniform(zone, section, k, cells);
    zone->surface_elements += element_count(section);
    return TL_OK;
}

tl_status tli_cg_read_sections(tli_cg_zone *zone)
{
    tli_cells cells;
    tl_status st = list_sections(zone);
    if (st) return st;
    if (zone->section_count)
        qsort(zone->sections, zone->section_count, sizeof *zone->sections, compare_sections);
    tli_cells_init(zone->cg->ctx, &cells);
    st = read_faces(zone);
    for (size_t s = 0; s < zone->section_count && !st; s++)
        st = read_section(zone, &zone->sections[s], &cells);
    if (!st) st = tli_cells_to_grid(&cells, zone->cg->path, false, zone->grid);
    tli_cells_release(&cells);
    return st;
}

/* ---- looking up ---- */

tl_status tli_cg_surface(tli_cg_zone *zone, int64_t number, uint32_t *ids, uint32_t *count)
{
    *count = 0;
    for (size_t s = 0; s < zone->section_count; s++) {
        const tli_cg_section *section = &zone->sections[s];
        const kind *k = section->kind < KIND_COUNT ? &kinds[section->kind] : &kinds[0];
        if (number < section->first || number > section->last) continue;
        uint64_t at = (uint64_t)(number - section->first);
        if (section->kind == NGON && zone->grid->face_count) {
            const uint64_t *offsets = zone->grid->face_offsets + section->first_face + at;
            uint64_t corners = offsets[1] - offsets[0];
            if (corners > 256) return TL_OK;
            memcpy(ids, zone->grid->face_points + offsets[0], (size_t)corners * sizeof *ids);
            *count = (uint32_t)corners;
            return TL_OK;
        }
        if (section->kind == MIXED && section->places) {
            int64_t type;
            tl_status st = tli_cg_ints(zone->cg, section->ids, section->places[at], 1, &type);
            if (st || type < 1 || type >= (int64_t)KIND_COUNT || kinds[type].dim != 2) return st;
            *count = kinds[type].corners;
            return read_ids(zone, section->ids, section->places[at] + 1, *count, 1,
                            zone->grid->point_count, false, ids);
        }
        if (k->dim != 2 || !k->nodes) return TL_OK;
        *count = k->corners;
        return read_ids(zone, section->ids, at * k->nodes, k->corners, 1, zone->grid->point_count,
                        false, ids);
    }
    return TL_OK;
}
