/* Exodus II: side sets, lists of an element and the number of one of its sides, become labels. */
#include "formats/formats_exodus.h"
#include "formats/formats_label.h"
#include "formats/formats_split.h"

#include <string.h>

#define NO 0xff

/* Corners of the sides of each kind, in the order of their numbers. */
typedef struct side_table {
    tli_shape shape;
    uint8_t count;
    uint8_t corners[6][4];
} side_table;
static const side_table tables[] = {
    {TLI_SHAPE_TETRA, 4, {{0, 1, 3, NO}, {1, 2, 3, NO}, {0, 3, 2, NO}, {0, 2, 1, NO}}},
    {TLI_SHAPE_HEXAHEDRON,
     6,
     {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {0, 4, 7, 3}, {0, 3, 2, 1}, {4, 5, 6, 7}}},
    {TLI_SHAPE_WEDGE, 5, {{0, 1, 4, 3}, {1, 2, 5, 4}, {0, 3, 5, 2}, {0, 2, 1, NO}, {3, 4, 5, NO}}},
    {TLI_SHAPE_PYRAMID,
     5,
     {{0, 1, 4, NO}, {1, 2, 4, NO}, {2, 3, 4, NO}, {0, 4, 3, NO}, {0, 3, 2, 1}}},
};

/* Adds one side; false if it is none of a volume cell. */
static bool side_of(const tli_grid *grid, uint64_t cell, uint32_t side, uint32_t ids[4],
                    uint32_t *count)
{
    uint8_t type = grid->types ? grid->types[cell] : TLI_VTK_TETRA;
    tli_shape shape = tli_cell_type_of(type).shape;
    const uint32_t *corners = grid->connectivity + (grid->offsets ? grid->offsets[cell] : 4 * cell);
    for (size_t t = 0; t < sizeof tables / sizeof tables[0]; t++) {
        if (tables[t].shape != shape || side >= tables[t].count) continue;
        const uint8_t *at = tables[t].corners[side];
        *count = at[3] == NO ? 3 : 4;
        for (uint32_t i = 0; i < *count; i++) ids[i] = corners[at[i]];
        return true;
    }
    return false;
}

/* The faces of one set: offsets and points. */
static void list_sides(tli_exodus *ex, const uint32_t *cells, const uint32_t *sides, uint64_t count,
                       uint64_t *offsets, uint32_t *points, uint64_t *faces)
{
    *faces = offsets[0] = 0;
    for (uint64_t i = 0; i < count; i++) {
        uint32_t corners;
        if (!side_of(ex->grid, cells[i], sides[i], points + offsets[*faces], &corners)) continue;
        offsets[*faces + 1] = offsets[*faces] + corners;
        ++*faces;
    }
}

static tl_status read_set(tli_exodus *ex, uint64_t number, int32_t id, const char *name,
                          uint64_t *left_out)
{
    const tli_nc_var *cells = tli_nc_find_numbered(&ex->nc, "elem_ss", number);
    const tli_nc_var *sides = tli_nc_find_numbered(&ex->nc, "side_ss", number);
    tl_status st = TL_OK;
    if (!cells || !sides || tli_nc_count(cells) != tli_nc_count(sides)) return TL_OK; /* empty */
    uint64_t count = tli_nc_count(cells), faces = 0;
    uint32_t *pairs = tl_mem_alloc(ex->ctx, (size_t)count, 2 * sizeof *pairs, &st);
    uint64_t *offsets = tl_mem_alloc(ex->ctx, (size_t)count + 1, sizeof *offsets, &st);
    uint32_t *points = tl_mem_alloc(ex->ctx, (size_t)count, 4 * sizeof *points, &st);
    if (!st) st = tli_nc_ids(&ex->nc, cells, 0, count, 1, (int64_t)ex->grid->cell_count, pairs);
    if (!st) st = tli_nc_ids(&ex->nc, sides, 0, count, 1, UINT32_MAX, pairs + count);
    if (!st) list_sides(ex, pairs, pairs + count, count, offsets, points, &faces);
    if (!st) st = tli_grid_add_label(ex->grid, name, id, faces, offsets, points);
    tl_mem_free(ex->ctx, pairs);
    if (st) tl_mem_free(ex->ctx, points);
    if (st) tl_mem_free(ex->ctx, offsets);
    *left_out += count - faces;
    return st;
}

tl_status tli_ex_side_sets(tli_exodus *ex)
{
    const tli_nc_var *ids = tli_nc_find(&ex->nc, "ss_prop1");
    const tli_nc_var *names = tli_nc_find(&ex->nc, "ss_names");
    uint64_t count = 0, left_out = 0;
    tl_status st = TL_OK;
    tli_nc_length(&ex->nc, "num_side_sets", &count);
    for (uint64_t s = 0; s < count && s < TLI_LABELS_MAX && !st; s++) {
        char name[TLI_NC_NAME_MAX] = "";
        uint32_t id = (uint32_t)s + 1;
        if (ids && s < tli_nc_count(ids)) st = tli_nc_ids(&ex->nc, ids, s, 1, 0, INT32_MAX, &id);
        if (!st && names) st = tli_nc_text(&ex->nc, names, s, name);
        if (!st) st = read_set(ex, s + 1, (int32_t)id, name, &left_out);
    }
    if (!st && left_out)
        tl_log(ex->ctx, TL_LOG_INFO, "%llu sides of side sets left out: of no volume element",
               (unsigned long long)left_out);
    return st;
}
