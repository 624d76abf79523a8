/* CGNS: solutions at vertices and cell centres. Arrays whose names end in X, Y, Z and that follow
 * one another are a vector. */
#include "formats/formats_cgns.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static bool is_array(const tli_cg_node *node)
{
    tl_scalar scalar;
    return node && strcmp(node->label, "DataArray_t") == 0 && tli_cg_value_bytes(node, &scalar) &&
           strcmp(node->type, "C1") != 0;
}

static const tli_cg_node *next_array(const tli_cg_node *node)
{
    while (node && !is_array(node)) node = node->next;
    return node;
}

/* The arrays of a vector, X first, in any order in the file; false if node is none of a vector. */
static bool vector_of(const tli_cg_node *solution, const tli_cg_node *node,
                      const tli_cg_node *parts[3], char stem[TLI_CG_NAME])
{
    size_t length = strlen(node->name);
    char name[TLI_CG_NAME];
    if (length < 2 || node->name[length - 1] < 'X' || node->name[length - 1] > 'Z') return false;
    memcpy(name, node->name, length + 1);
    for (int k = 0; k < 3; k++) {
        name[length - 1] = "XYZ"[k];
        parts[k] = tli_cg_child(solution, name);
        if (!is_array(parts[k]) || parts[k]->count != node->count) return false;
    }
    memcpy(stem, node->name, length - 1);
    stem[length - 1] = '\0';
    if (length > 2 && stem[length - 2] == '_') stem[length - 2] = '\0';
    return true;
}

/* One array or vector of a solution on count elements, sizes [3] of them along the axes. */
static tl_status read_one(tli_cg_zone *zone, const tli_cg_node *solution, const tli_cg_node *node,
                          tl_on on, const uint64_t sizes[3], const uint64_t rind[6])
{
    const tli_cg_node *parts[3];
    char name[TLI_CG_NAME];
    tl_scalar scalar = TL_F64;
    uint32_t components = 1;
    tli_grid_array *array;
    memcpy(name, node->name, sizeof name);
    tli_cg_value_bytes(node, &scalar);
    if (vector_of(solution, node, parts, name)) {
        if (parts[0] != node) return TL_OK; /* comes with X */
        components = 3;
    } else {
        parts[0] = node;
    }
    uint64_t total = 1;
    for (int axis = 0; axis < 3; axis++) total *= sizes[axis] + rind[2 * axis] + rind[2 * axis + 1];
    if (node->count != total) {
        tl_log(zone->cg->ctx, TL_LOG_INFO, "zone '%s': '%s' left out: %llu values for %llu places",
               zone->node->name, node->name, (unsigned long long)node->count,
               (unsigned long long)total);
        return TL_OK;
    }
    tl_status st = tli_grid_add(zone->grid, on, name, components, scalar, NULL, &array);
    for (uint32_t k = 0; k < components && !st; k++)
        st = tli_cg_read_placed(zone, parts[k], sizes, rind, array->values + k, components);
    return st;
}

static tl_status read_solution(tli_cg_zone *zone, const tli_cg_node *solution)
{
    char where[TLI_CG_NAME];
    uint64_t rind[6], cells[3] = {tli_grid_cell_count(zone->grid), 1, 1};
    const tli_cg_node *location = tli_cg_child(solution, "GridLocation");
    tl_status st = tli_cg_text(zone->cg, location, 0, 32, where, sizeof where);
    if (!st) st = tli_cg_rind(zone, solution, rind);
    if (st) return st;
    bool on_cells = strcmp(where, "CellCenter") == 0;
    if (!on_cells && *where && strcmp(where, "Vertex") != 0) {
        tl_log(zone->cg->ctx, TL_LOG_INFO, "zone '%s': solution '%s' left out: it stands at '%s'",
               zone->node->name, solution->name, where);
        return TL_OK;
    }
    if (zone->structured) memcpy(cells, zone->cells, sizeof cells);
    const tli_cg_node *node = next_array(solution->first_child);
    for (; node && !st; node = next_array(node->next))
        st = read_one(zone, solution, node, on_cells ? TL_ON_TET : TL_ON_VERTEX,
                      on_cells ? cells : zone->points, rind);
    return st;
}

tl_status tli_cg_read_fields(tli_cg_zone *zone)
{
    char name[TLI_CG_NAME];
    tl_status st = tli_cg_step_name(zone, "FlowSolutionPointers", name);
    const tli_cg_node *node = tli_cg_labelled(zone->node, "FlowSolution_t", NULL);
    for (; node && !st; node = tli_cg_labelled(zone->node, "FlowSolution_t", node))
        if (!*name || strcmp(node->name, name) == 0) st = read_solution(zone, node);
    return st;
}
