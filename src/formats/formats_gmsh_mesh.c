/* Gmsh: points and cells, in the three layouts of the versions. Tags of points and cells are any
 * numbers; they become indices in the order of the file. */
#include "formats/formats_gmsh.h"

#include <inttypes.h>
#include <string.h>

#define NODES_MAX 512 /* of an element */
#define TAGS_MAX 4096 /* of an element of version 2 */

/* Kinds by number of nodes: Gmsh's numbers of an order follow no rule. Corners come first in all of
 * them, in the order of VTK; what stands between them is not taken, so its order does not matter.
 */
tli_gmsh_kind tli_gmsh_kind_of(int64_t type)
{
#define KIND(number, vtk, dim, count)                                                              \
    case number: return (tli_gmsh_kind){vtk, dim, count};
    switch (type) {
        KIND(1, TLI_VTK_LINE, 1, 2)
        KIND(2, TLI_VTK_TRIANGLE, 2, 3)
        KIND(3, TLI_VTK_QUAD, 2, 4)
        KIND(4, 10, 3, 4)
        KIND(5, TLI_VTK_HEXAHEDRON, 3, 8)
        KIND(6, TLI_VTK_WEDGE, 3, 6)
        KIND(7, TLI_VTK_PYRAMID, 3, 5)
        KIND(8, TLI_VTK_QUADRATIC_EDGE, 1, 3)
        KIND(9, TLI_VTK_QUADRATIC_TRIANGLE, 2, 6)
        KIND(10, TLI_VTK_BIQUADRATIC_QUAD, 2, 9)
        KIND(11, TLI_VTK_QUADRATIC_TETRA, 3, 10)
        KIND(12, TLI_VTK_TRIQUADRATIC_HEXAHEDRON, 3, 27)
        KIND(13, TLI_VTK_BIQUADRATIC_WEDGE, 3, 18)
        KIND(14, TLI_VTK_LAGRANGE_PYRAMID, 3, 14)
        KIND(15, TLI_VTK_VERTEX, 0, 1)
        KIND(16, TLI_VTK_QUADRATIC_QUAD, 2, 8)
        KIND(17, TLI_VTK_QUADRATIC_HEXAHEDRON, 3, 20)
        KIND(18, TLI_VTK_QUADRATIC_WEDGE, 3, 15)
        KIND(19, TLI_VTK_QUADRATIC_PYRAMID, 3, 13)
        KIND(20, TLI_VTK_LAGRANGE_TRIANGLE, 2, 9)
        KIND(21, TLI_VTK_LAGRANGE_TRIANGLE, 2, 10)
        KIND(22, TLI_VTK_LAGRANGE_TRIANGLE, 2, 12)
        KIND(23, TLI_VTK_LAGRANGE_TRIANGLE, 2, 15)
        KIND(24, TLI_VTK_LAGRANGE_TRIANGLE, 2, 15)
        KIND(25, TLI_VTK_LAGRANGE_TRIANGLE, 2, 21)
        KIND(26, TLI_VTK_LAGRANGE_CURVE, 1, 4)
        KIND(27, TLI_VTK_LAGRANGE_CURVE, 1, 5)
        KIND(28, TLI_VTK_LAGRANGE_CURVE, 1, 6)
        KIND(29, TLI_VTK_LAGRANGE_TETRA, 3, 20)
        KIND(30, TLI_VTK_LAGRANGE_TETRA, 3, 35)
        KIND(31, TLI_VTK_LAGRANGE_TETRA, 3, 56)
        KIND(36, TLI_VTK_LAGRANGE_QUAD, 2, 16)
        KIND(37, TLI_VTK_LAGRANGE_QUAD, 2, 25)
        KIND(38, TLI_VTK_LAGRANGE_QUAD, 2, 36)
        KIND(71, TLI_VTK_LAGRANGE_TETRA, 3, 84)
        KIND(72, TLI_VTK_LAGRANGE_TETRA, 3, 120)
        KIND(90, TLI_VTK_LAGRANGE_WEDGE, 3, 40)
        KIND(91, TLI_VTK_LAGRANGE_WEDGE, 3, 75)
        KIND(92, TLI_VTK_LAGRANGE_HEXAHEDRON, 3, 64)
        KIND(93, TLI_VTK_LAGRANGE_HEXAHEDRON, 3, 125)
        KIND(94, TLI_VTK_LAGRANGE_HEXAHEDRON, 3, 216)
        KIND(118, TLI_VTK_LAGRANGE_PYRAMID, 3, 30)
        KIND(119, TLI_VTK_LAGRANGE_PYRAMID, 3, 55)
    default: return (tli_gmsh_kind){0};
    }
#undef KIND
}

/* ---- points ---- */

/* Nodes of a block of version 4; parametric ones have a parameter for each dimension. */
static tl_status read_node_block(tli_gmsh *g, uint64_t total, uint64_t *tags, uint64_t *used)
{
    int64_t numbers[3] = {0, 0, 0}, tag = 0; /* version 4.0: tag, dimension, parametric */
    uint64_t count = 0;
    double ignored[3];
    tl_status st = TL_OK;
    for (int i = 0; !st && i < 3; i++)
        st = tli_gmsh_int(g, "a number of a block", 4, INT32_MIN, INT32_MAX, &numbers[i]);
    const int64_t dimension = numbers[g->version == 40 ? 1 : 0];
    if (!st) st = tli_gmsh_count(g, "nodes of a block", 1, 3, &count);
    if (!st && (count > total - *used || dimension < 0 || dimension > 3))
        st = tli_scan_fail(&g->scan,
                           "a block of dimension %" PRId64 " with %" PRIu64 " nodes after %" PRIu64
                           " of %" PRIu64,
                           dimension, count, *used, total);
    const uint64_t parameters = numbers[2] ? (uint64_t)dimension : 0;
    const bool apart = g->version == 41; /* all tags, then all positions */
    for (uint64_t i = 0; !st && apart && i < count; i++) {
        st = tli_gmsh_int(g, "the tag of a node", g->size_bytes, 1, INT64_MAX, &tag);
        tags[*used + i] = (uint64_t)tag;
    }
    for (uint64_t i = 0; !st && i < count; i++) {
        if (!apart) st = tli_gmsh_int(g, "the tag of a node", 4, 1, INT32_MAX, &tag);
        if (!apart) tags[*used + i] = (uint64_t)tag;
        if (!st) st = tli_gmsh_reals(g, "a coordinate", 3, g->grid->xyz + 3 * (*used + i));
        if (!st) st = tli_gmsh_reals(g, "a parameter", parameters, ignored);
    }
    *used += count;
    return st;
}

static tl_status read_nodes_4(tli_gmsh *g, uint64_t *total, uint64_t **tags)
{
    uint64_t blocks = 0, used = 0;
    int64_t ignored;
    tl_status st = tli_gmsh_count(g, "blocks of nodes", 4, 0, &blocks);
    if (!st) st = tli_gmsh_count(g, "nodes", 1, 3, total);
    for (int i = 0; !st && g->version == 41 && i < 2; i++)
        st = tli_gmsh_int(g, "the smallest or largest tag", g->size_bytes, INT64_MIN, INT64_MAX,
                          &ignored);
    g->grid->xyz = tl_mem_alloc(g->ctx, (size_t)*total, 3 * sizeof(double), &st);
    *tags = tl_mem_alloc(g->ctx, (size_t)*total, sizeof **tags, &st);
    for (uint64_t b = 0; !st && b < blocks; b++) st = read_node_block(g, *total, *tags, &used);
    if (!st && used != *total)
        st = tli_scan_fail(&g->scan, "%" PRIu64 " nodes in all blocks, expected %" PRIu64, used,
                           *total);
    return st;
}

/* Version 2: the count is text in binary files, too. */
static tl_status read_line_count(tli_gmsh *g, const char *what, uint64_t min_bytes, uint64_t *count)
{
    tli_span rest;
    int64_t value = 0;
    tl_status st = tli_scan_int(&g->scan, what, 0, INT64_MAX, &value);
    if (!st) tli_scan_line(&g->scan, &rest);
    if (!st) st = tli_scan_room(&g->scan, what, (uint64_t)value, min_bytes);
    *count = (uint64_t)value;
    return st;
}

static tl_status read_nodes_2(tli_gmsh *g, uint64_t *total, uint64_t **tags)
{
    tl_status st = read_line_count(g, "nodes", g->binary ? 28 : 8, total);
    if (st) return st;
    g->grid->xyz = tl_mem_alloc(g->ctx, (size_t)*total, 3 * sizeof(double), &st);
    *tags = tl_mem_alloc(g->ctx, (size_t)*total, sizeof **tags, &st);
    for (uint64_t i = 0; !st && i < *total; i++) {
        int64_t tag = 0;
        st = tli_gmsh_int(g, "the tag of a node", 4, 0, INT32_MAX, &tag);
        (*tags)[i] = (uint64_t)tag;
        if (!st) st = tli_gmsh_reals(g, "a coordinate", 3, g->grid->xyz + 3 * i);
    }
    return st;
}

tl_status tli_gmsh_read_nodes(tli_gmsh *g)
{
    uint64_t total = 0, *tags = NULL;
    if (g->grid->xyz) return tli_scan_fail(&g->scan, "$Nodes stand twice in the file");
    tl_status st =
        g->version == 22 ? read_nodes_2(g, &total, &tags) : read_nodes_4(g, &total, &tags);
    if (st) {
        tl_mem_free(g->ctx, tags);
        return st;
    }
    g->grid->point_count = total;
    return tli_ids_create(g->ctx, tags, total, &g->points);
}

/* ---- cells ---- */

/* Room for more cells in all lists that run beside each other. */
static tl_status reserve(tli_gmsh *g, uint64_t cells, uint64_t indices)
{
    tl_status st = tli_cells_reserve(&g->cells, cells, indices);
    const size_t room = (size_t)g->cells.capacity;
    g->cell_entities = tl_mem_resize(g->ctx, g->cell_entities, room, sizeof *g->cell_entities, &st);
    g->element_tags = tl_mem_resize(g->ctx, g->element_tags, room, sizeof *g->element_tags, &st);
    return st;
}

/* The nodes of an element, which becomes a cell. */
static tl_status read_cell(tli_gmsh *g, tli_gmsh_kind kind, unsigned tag_bytes, int64_t tag,
                           int32_t group, int32_t entity)
{
    uint32_t ids[NODES_MAX];
    tl_status st = TL_OK;
    for (unsigned n = 0; !st && n < kind.nodes; n++) {
        int64_t node = 0;
        const char *start = g->scan.at;
        st = tli_gmsh_int(g, "a node", tag_bytes, 0, INT64_MAX, &node);
        if (st) return st;
        ids[n] = tli_ids_find(&g->points, (uint64_t)node);
        if (ids[n] != TL_NONE) continue;
        g->scan.at = start;
        st = tli_scan_fail(&g->scan, "element %" PRId64 " has node %" PRId64 ", which is not there",
                           tag, node);
    }
    if (st) return st;
    g->cell_entities[g->cells.count] = entity;
    g->element_tags[g->cells.count] = (uint64_t)tag;
    memcpy(tli_cells_add(&g->cells, kind.vtk_type, kind.nodes, group), ids,
           kind.nodes * sizeof *ids);
    return TL_OK;
}

static tl_status check_kind(const tli_gmsh *g, int64_t type, tli_gmsh_kind *kind)
{
    *kind = tli_gmsh_kind_of(type);
    if (kind->nodes) return TL_OK;
    return tl_note(g->ctx, tli_scan_fail(&g->scan, "elements of type %" PRId64, type),
                   "the type is not known here, so nothing behind it can be read");
}

/* Tags of an element of version 2: group, entity, then partitions. */
static tl_status read_tags(tli_gmsh *g, int64_t count, int32_t *group, int32_t *entity)
{
    tl_status st = TL_OK;
    *group = *entity = 0;
    for (int64_t i = 0; !st && i < count; i++) {
        int64_t tag = 0;
        st = tli_gmsh_int(g, "a tag", 4, INT32_MIN, INT32_MAX, &tag);
        if (i == 0) *group = (int32_t)tag;
        if (i == 1) *entity = (int32_t)tag;
    }
    return st;
}

static tl_status read_element_2(tli_gmsh *g, int64_t type, int64_t tag_count)
{
    tli_gmsh_kind kind;
    int64_t tag = 0;
    int32_t group, entity;
    tl_status st = tli_gmsh_int(g, "the tag of an element", 4, 0, INT32_MAX, &tag);
    if (!st && !g->binary) st = tli_scan_int(&g->scan, "a type", 0, INT32_MAX, &type);
    if (!st && !g->binary) st = tli_scan_int(&g->scan, "a number of tags", 0, TAGS_MAX, &tag_count);
    if (!st) st = check_kind(g, type, &kind);
    if (!st) st = read_tags(g, tag_count, &group, &entity);
    if (!st) st = reserve(g, 1, kind.nodes);
    return st ? st : read_cell(g, kind, 4, tag, group, entity);
}

static tl_status read_elements_2(tli_gmsh *g)
{
    uint64_t total = 0;
    tl_status st = read_line_count(g, "elements", 8, &total);
    if (!st) st = reserve(g, total, 0);
    for (uint64_t i = 0; !st && i < total && !g->binary; i++) st = read_element_2(g, 0, 0);
    for (uint64_t i = 0; !st && i < total && g->binary;) {
        int64_t type = 0, count = 0, tags = 0;
        st = tli_gmsh_int(g, "a type", 4, 0, INT32_MAX, &type);
        if (!st) st = tli_gmsh_int(g, "a number of elements", 4, 1, (int64_t)(total - i), &count);
        if (!st) st = tli_gmsh_int(g, "a number of tags", 4, 0, TAGS_MAX, &tags);
        for (int64_t k = 0; !st && k < count; k++, i++) st = read_element_2(g, type, tags);
    }
    return st;
}

/* Second and further groups of a surface: more labels of the same face. */
static tl_status add_more_groups(tli_gmsh *g, const int32_t *groups, uint64_t count)
{
    tl_status st = TL_OK;
    const uint64_t cell = g->cells.count - 1;
    for (uint64_t i = 1; !st && i < count; i++)
        st = tli_faces_add(&g->faces, groups[i], g->cells.connectivity + g->cells.offsets[cell],
                           tli_surface_corners(g->cells.types[cell]));
    return st;
}

static tl_status read_element_block(tli_gmsh *g)
{
    int64_t numbers[3] = {0, 0, 0}; /* dimension, tag of the entity, type; 4.0: tag first */
    uint64_t count = 0, group_count = 0;
    tli_gmsh_kind kind = {0};
    tl_status st = TL_OK;
    for (int i = 0; !st && i < 3; i++)
        st = tli_gmsh_int(g, "a number of a block", 4, INT32_MIN, INT32_MAX, &numbers[i]);
    const int64_t dimension = numbers[g->version == 40], tag = numbers[g->version != 40];
    if (!st) st = check_kind(g, numbers[2], &kind);
    if (!st) st = tli_gmsh_count(g, "elements of a block", 1u + kind.nodes, 0, &count);
    if (!st) st = reserve(g, count, count * kind.nodes);
    const unsigned tag_bytes = g->version == 40 ? 4 : g->size_bytes;
    const int32_t *groups = tli_gmsh_groups(g, dimension, tag, &group_count);
    if (!st && group_count > 1 && kind.dimension == 3)
        tl_log(g->ctx, TL_LOG_INFO,
               "'%s': entity %" PRId64 " has %" PRIu64
               " physical groups; the first one is its region",
               g->scan.path, tag, group_count);
    for (uint64_t i = 0; !st && i < count; i++) {
        int64_t element = 0;
        st = tli_gmsh_int(g, "the tag of an element", tag_bytes, 0, INT64_MAX, &element);
        if (!st) st = read_cell(g, kind, tag_bytes, element, groups ? groups[0] : 0, (int32_t)tag);
        if (!st && kind.dimension == 2 && group_count > 1)
            st = add_more_groups(g, groups, group_count);
    }
    return st;
}

static tl_status read_elements_4(tli_gmsh *g)
{
    uint64_t blocks = 0, total = 0;
    int64_t ignored;
    tl_status st = tli_gmsh_count(g, "blocks of elements", 4, 0, &blocks);
    if (!st) st = tli_gmsh_count(g, "elements", 2, 0, &total);
    for (int i = 0; !st && g->version == 41 && i < 2; i++)
        st = tli_gmsh_int(g, "the smallest or largest tag", g->size_bytes, INT64_MIN, INT64_MAX,
                          &ignored);
    for (uint64_t b = 0; !st && b < blocks; b++) st = read_element_block(g);
    if (!st && g->cells.count != total)
        st = tli_scan_fail(&g->scan, "%" PRIu64 " elements in all blocks, expected %" PRIu64,
                           g->cells.count, total);
    return st;
}

tl_status tli_gmsh_read_elements(tli_gmsh *g)
{
    if (!g->grid->xyz) return tli_scan_fail(&g->scan, "$Elements before $Nodes");
    if (g->element_tags || g->cells.count)
        return tli_scan_fail(&g->scan, "$Elements stand twice in the file");
    return g->version == 22 ? read_elements_2(g) : read_elements_4(g);
}
