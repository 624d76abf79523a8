/* CGNS: boundary conditions become labels of faces. In a structured zone a condition is a box of
 * points with one index constant, in others a range or list of element numbers. */
#include "formats/formats_cgns.h"
#include "formats/formats_label.h"

#include <string.h>

/* Kind of a section of several kinds. */
#define MIXED 20
/* Corners of a polygon at most. */
#define CORNERS_MAX 256

/* The faces of one condition as they come. */
typedef struct patch {
    tli_faces faces;
    uint64_t left_out;
} patch;

/* ---- structured ---- */

/* Quads of the box low .. high (points, from 0) in the plane where one axis does not move. */
static tl_status add_box(tli_cg_zone *zone, const int64_t low[3], const int64_t high[3],
                         unsigned flat, patch *p)
{
    unsigned u = (flat + 1) % 3, v = (flat + 2) % 3;
    uint64_t steps[3] = {1, zone->points[0], zone->points[0] * zone->points[1]};
    tl_status st = TL_OK;
    for (int64_t j = low[v]; j < high[v] && !st; j++)
        for (int64_t i = low[u]; i < high[u] && !st; i++) {
            uint64_t at =
                (uint64_t)low[flat] * steps[flat] + (uint64_t)i * steps[u] + (uint64_t)j * steps[v];
            const uint32_t ids[4] = {(uint32_t)at, (uint32_t)(at + steps[u]),
                                     (uint32_t)(at + steps[u] + steps[v]),
                                     (uint32_t)(at + steps[v])};
            st = tli_faces_add(&p->faces, 0, ids, 4);
        }
    return st;
}

static tl_status structured_patch(tli_cg_zone *zone, const tli_cg_node *range, bool of_faces,
                                  patch *p)
{
    int64_t values[6], low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    unsigned flat = 3, flat_count = 0;
    if (zone->axes != 3 || range->count != 6) {
        p->left_out++;
        return TL_OK;
    }
    tl_status st = tli_cg_ints(zone->cg, range, 0, 6, values);
    for (unsigned axis = 0; axis < 3 && !st; axis++) {
        int64_t a = values[axis], b = values[axis + 3];
        low[axis] = (a < b ? a : b) - 1;
        high[axis] = (a < b ? b : a) - 1;
        if (a == b &&
            (!of_faces || low[axis] == 0 || (uint64_t)low[axis] + 1 == zone->points[axis]))
            flat = axis, flat_count++;
        if (low[axis] < 0 || (uint64_t)high[axis] >= zone->points[axis])
            st = tli_cg_fail(zone->cg, range, "is a box beyond its zone");
    }
    if (!st && flat_count != 1) {
        p->left_out++;
        return TL_OK;
    }
    /* faces end one point later; some writers give points all the same, up to the last */
    for (unsigned axis = 0; axis < 3; axis++)
        if (axis != flat && (uint64_t)high[axis] + 1 == zone->points[axis]) of_faces = false;
    for (unsigned axis = 0; axis < 3 && of_faces; axis++)
        if (axis != flat) high[axis]++;
    return st ? st : add_box(zone, low, high, flat, p);
}

/* ---- unstructured ---- */

static tl_status add_element(tli_cg_zone *zone, int64_t number, patch *p)
{
    uint32_t ids[CORNERS_MAX], count = 0;
    tl_status st = tli_cg_surface(zone, number, ids, &count);
    if (!st && count) st = tli_faces_add(&p->faces, 0, ids, count);
    p->left_out += count == 0;
    return st;
}

static tl_status element_patch(tli_cg_zone *zone, const tli_cg_node *range, const tli_cg_node *list,
                               patch *p)
{
    tl_status st = TL_OK;
    int64_t ends[2] = {1, 0};
    int64_t last = zone->section_count ? zone->sections[zone->section_count - 1].last : 0;
    if (range && range->count == 2) st = tli_cg_ints(zone->cg, range, 0, 2, ends);
    if (!st && range && (ends[0] < 1 || ends[1] > last))
        return tli_cg_fail(zone->cg, range, "is a range of elements that there are none of");
    for (int64_t number = ends[0]; number <= ends[1] && !st; number++)
        st = add_element(zone, number, p);
    for (uint64_t i = 0; list && i < list->count && !st; i++) {
        int64_t number = 0;
        st = tli_cg_ints(zone->cg, list, i, 1, &number);
        if (!st) st = add_element(zone, number, p);
    }
    return st;
}

/* ---- conditions ---- */

static int32_t id_in(const tli_grid *grid, const char *name)
{
    for (uint32_t i = 0; i < grid->label_count; i++)
        if (strcmp(grid->labels[i].name, name) == 0) return grid->labels[i].id;
    return 0;
}

/* Labels of all zones are one where their names are; ids count from 1. */
static int32_t label_id(const tli_cg_zone *zone, const char *name)
{
    int32_t id = id_in(zone->whole, name);
    if (!id) id = id_in(zone->grid, name);
    if (id) return id;
    id = 1;
    for (uint32_t i = 0; i < zone->whole->label_count; i++)
        if (zone->whole->labels[i].id >= id) id = zone->whole->labels[i].id + 1;
    for (uint32_t i = 0; i < zone->grid->label_count; i++)
        if (zone->grid->labels[i].id >= id) id = zone->grid->labels[i].id + 1;
    return id;
}

static tl_status add_patch(tli_cg_zone *zone, const char *name, patch *p)
{
    tl_status st = TL_OK;
    tli_faces *faces = &p->faces;
    if (!faces->count) return TL_OK;
    size_t ids = (size_t)faces->offsets[faces->count];
    uint64_t *offsets = tl_mem_alloc(zone->cg->ctx, (size_t)faces->count + 1, sizeof *offsets, &st);
    uint32_t *points = tl_mem_alloc(zone->cg->ctx, ids, sizeof *points, &st);
    if (!st) {
        memcpy(offsets, faces->offsets, ((size_t)faces->count + 1) * sizeof *offsets);
        memcpy(points, faces->points, ids * sizeof *points);
        st = tli_grid_add_label(zone->grid, name, label_id(zone, name), faces->count, offsets,
                                points);
    }
    if (st) {
        tl_mem_free(zone->cg->ctx, points);
        tl_mem_free(zone->cg->ctx, offsets);
    }
    return st;
}

static tl_status read_bc(tli_cg_zone *zone, const tli_cg_node *bc, uint64_t *left_out)
{
    char where[TLI_CG_NAME];
    const tli_cg_node *range = tli_cg_child(bc, "PointRange");
    const tli_cg_node *list = tli_cg_child(bc, "PointList");
    const tli_cg_node *element_range = tli_cg_child(bc, "ElementRange");
    const tli_cg_node *element_list = tli_cg_child(bc, "ElementList");
    patch p = {0};
    tl_status st =
        tli_cg_text(zone->cg, tli_cg_child(bc, "GridLocation"), 0, 32, where, sizeof where);
    bool of_faces = strstr(where, "FaceCenter") != NULL;
    tli_faces_init(zone->cg->ctx, &p.faces);
    if (!st && zone->structured && range)
        st = structured_patch(zone, range, of_faces, &p);
    else if (!st && !zone->structured && of_faces && (range || list))
        st = element_patch(zone, range, list, &p);
    else if (!st && !zone->structured && (element_range || element_list))
        st = element_patch(zone, element_range, element_list, &p);
    else if (!st)
        p.left_out++;
    if (!st) st = add_patch(zone, bc->name, &p);
    tli_faces_release(&p.faces);
    *left_out += p.left_out;
    return st;
}

/* The first element tells whether a section of several kinds is one of a surface. */
static bool is_surface(tli_cg_zone *zone, const tli_cg_section *section)
{
    uint32_t ids[CORNERS_MAX], count = 0;
    return zone->cell_dim == 3 && tli_cg_surface(zone, section->first, ids, &count) == TL_OK &&
           count > 0;
}

/* Surface sections of a zone without conditions are named by themselves. */
static tl_status label_sections(tli_cg_zone *zone)
{
    tl_status st = TL_OK;
    for (size_t s = 0; s < zone->section_count && !st; s++) {
        const tli_cg_section *section = &zone->sections[s];
        patch p = {0};
        bool whole = section->kind == MIXED && section->places && is_surface(zone, section);
        if (!whole && (section->kind < 5 || section->kind > 9 || zone->cell_dim < 3)) continue;
        tli_faces_init(zone->cg->ctx, &p.faces);
        for (int64_t number = section->first; number <= section->last && !st; number++)
            st = add_element(zone, number, &p);
        if (!st) st = add_patch(zone, section->node->name, &p);
        tli_faces_release(&p.faces);
    }
    return st;
}

tl_status tli_cg_read_bcs(tli_cg_zone *zone)
{
    const tli_cg_node *all = tli_cg_labelled(zone->node, "ZoneBC_t", NULL), *bc = NULL;
    uint64_t left_out = 0;
    tl_status st = TL_OK;
    while (all && !st && (bc = tli_cg_labelled(all, "BC_t", bc))) st = read_bc(zone, bc, &left_out);
    if (!st && left_out)
        tl_log(zone->cg->ctx, TL_LOG_INFO,
               "zone '%s': %llu faces or boundary conditions left out: they name no faces",
               zone->node->name, (unsigned long long)left_out);
    return st || zone->grid->label_count ? st : label_sections(zone);
}
