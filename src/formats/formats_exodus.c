/* Exodus II: meshes in netCDF, by the names that Sandia's manual (SAND92-2137) gives to dimensions
 * and variables. The library of that name is not used: the Debian one is of 2013, cuts names at 32
 * characters and reads no netCDF-4 of today; what it adds to named arrays is little. */
#include "formats/formats_exodus.h"
#include "formats/formats_split.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- kinds of elements ---- */

/* VTK's type by the first letters of the name and the number of nodes; corners come first in all.
 */
static const struct {
    const char *name;
    uint8_t nodes, type;
} kinds[] = {
    {"TET", 4, TLI_VTK_TETRA},
    {"TET", 10, TLI_VTK_QUADRATIC_TETRA},
    {"TET", 0, TLI_VTK_LAGRANGE_TETRA},
    {"HEX", 8, TLI_VTK_HEXAHEDRON},
    {"HEX", 20, TLI_VTK_QUADRATIC_HEXAHEDRON},
    {"HEX", 27, TLI_VTK_TRIQUADRATIC_HEXAHEDRON},
    {"HEX", 0, TLI_VTK_LAGRANGE_HEXAHEDRON},
    {"WED", 6, TLI_VTK_WEDGE},
    {"WED", 15, TLI_VTK_QUADRATIC_WEDGE},
    {"WED", 18, TLI_VTK_BIQUADRATIC_WEDGE},
    {"WED", 0, TLI_VTK_LAGRANGE_WEDGE},
    {"PYR", 5, TLI_VTK_PYRAMID},
    {"PYR", 13, TLI_VTK_QUADRATIC_PYRAMID},
    {"PYR", 0, TLI_VTK_LAGRANGE_PYRAMID},
    {"TRI", 3, TLI_VTK_TRIANGLE},
    {"TRI", 6, TLI_VTK_QUADRATIC_TRIANGLE},
    {"TRI", 0, TLI_VTK_LAGRANGE_TRIANGLE},
    {"QUA", 4, TLI_VTK_QUAD},
    {"QUA", 8, TLI_VTK_QUADRATIC_QUAD},
    {"QUA", 9, TLI_VTK_BIQUADRATIC_QUAD},
    {"QUA", 0, TLI_VTK_LAGRANGE_QUAD},
    {"SHE", 3, TLI_VTK_TRIANGLE},
    {"SHE", 4, TLI_VTK_QUAD},
    {"SHE", 6, TLI_VTK_QUADRATIC_TRIANGLE},
    {"SHE", 8, TLI_VTK_QUADRATIC_QUAD},
    {"SHE", 9, TLI_VTK_BIQUADRATIC_QUAD},
    {"BAR", 0, TLI_VTK_LINE},
    {"BEA", 0, TLI_VTK_LINE},
    {"TRU", 0, TLI_VTK_LINE},
    {"EDG", 0, TLI_VTK_LINE},
    {"SPH", 0, TLI_VTK_VERTEX},
    {"CIR", 0, TLI_VTK_VERTEX},
    {"NSI", 0, TLI_VTK_POLYGON},
    {"NFA", 0, TLI_VTK_POLYHEDRON},
};

/* Least nodes of a kind that takes any number. */
static unsigned least_nodes(uint8_t type)
{
    tli_shape shape = tli_cell_type_of(type).shape;
    return shape == TLI_SHAPE_NONE ? 1 : tli_shape_corners(shape);
}

static uint8_t type_of(const char *name, uint64_t nodes)
{
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        bool same = true;
        for (int c = 0; c < 3; c++)
            same = same && toupper((unsigned char)name[c]) == kinds[i].name[c];
        if (!same || (kinds[i].nodes && kinds[i].nodes != nodes)) continue;
        return nodes >= least_nodes(kinds[i].type) ? kinds[i].type : 0;
    }
    return 0;
}

/* ---- points ---- */

static tl_status read_points(tli_exodus *ex)
{
    static const char *const names[3] = {"coordx", "coordy", "coordz"};
    tli_grid *grid = ex->grid;
    tl_status st = TL_OK;
    uint64_t points = 0, axes = 0;
    tli_nc_length(&ex->nc, "num_nodes", &points);
    tli_nc_length(&ex->nc, "num_dim", &axes);
    const tli_nc_var *whole = tli_nc_find(&ex->nc, "coord");
    if (points > TL_MESH_VERTS_MAX)
        return tl_fail(ex->ctx, TL_ERR_UNSUPPORTED, "'%s': %llu points; at most %u are read",
                       ex->nc.path, (unsigned long long)points, TL_MESH_VERTS_MAX);
    if (points && (axes < 1 || axes > 3))
        return tl_fail(ex->ctx, TL_ERR_FORMAT, "'%s': %llu dimensions of space, expected 1 to 3",
                       ex->nc.path, (unsigned long long)axes);
    for (uint64_t a = 0; a < axes && points; a++) { /* before anything is allocated */
        const tli_nc_var *var = whole ? whole : tli_nc_find(&ex->nc, names[a]);
        if (!var || tli_nc_count(var) != (whole ? axes * points : points))
            return tl_fail(ex->ctx, TL_ERR_FORMAT, "'%s': no coordinates '%s' of %llu points",
                           ex->nc.path, names[a], (unsigned long long)points);
    }
    grid->xyz = tl_mem_zalloc(ex->ctx, (size_t)points, 3 * sizeof *grid->xyz, &st);
    grid->point_count = points;
    for (uint64_t a = 0; a < axes && points && !st; a++)
        st = tli_nc_reals(&ex->nc, whole ? whole : tli_nc_find(&ex->nc, names[a]), 0,
                          whole ? a * points : 0, points, grid->xyz + a, 3);
    return st;
}

/* ---- blocks ---- */

/* Cells of one size: connect is [cells][nodes]. */
static tl_status read_cells(tli_exodus *ex, const tli_nc_var *connect, tli_cells *cells,
                            tli_ex_block *block)
{
    uint64_t count = connect->dims[0], nodes = connect->dims[1];
    char name[TLI_NC_NAME_MAX];
    tl_status st = tli_nc_attribute(&ex->nc, connect, "elem_type", name);
    if (st) return st;
    if (nodes > UINT32_MAX)
        return tl_fail(ex->ctx, TL_ERR_FORMAT, "'%s': '%s' has elements of %llu nodes", ex->nc.path,
                       connect->name, (unsigned long long)nodes);
    block->type = type_of(name, nodes);
    block->cell_count = count;
    st = tli_cells_reserve(cells, count, count * nodes);
    if (st) return st;
    uint32_t *ids = cells->connectivity + cells->index_count;
    for (uint64_t c = 0; c < count; c++)
        tli_cells_add(cells, block->type, (uint32_t)nodes, block->id);
    st = tli_nc_ids(&ex->nc, connect, 0, count * nodes, 1, (int64_t)ex->grid->point_count, ids);
    if (!st && block->type == 0)
        tl_log(ex->ctx, TL_LOG_INFO, "block %d: %llu elements of the unknown kind '%s'", block->id,
               (unsigned long long)count, name);
    return st;
}

/* Polygons and polyhedra: a row of ids and, in entries, how many each cell has. */
static tl_status read_ragged(tli_exodus *ex, const tli_nc_var *ids, const tli_nc_var *entries,
                             uint8_t type, uint64_t limit, tli_cells *cells, tli_ex_block *block)
{
    tl_status st = TL_OK;
    uint64_t count = tli_nc_count(entries), all = tli_nc_count(ids), used = 0;
    block->type = type;
    block->cell_count = count;
    uint32_t *sizes = tl_mem_alloc(ex->ctx, (size_t)count, sizeof *sizes, &st);
    if (!st) st = tli_nc_ids(&ex->nc, entries, 0, count, 0, UINT32_MAX, sizes);
    for (uint64_t c = 0; c < count && !st; c++) used += sizes[c];
    if (!st && used != all)
        st = tl_fail(ex->ctx, TL_ERR_FORMAT, "'%s': '%s' adds up to %llu, '%s' has %llu values",
                     ex->nc.path, entries->name, (unsigned long long)used, ids->name,
                     (unsigned long long)all);
    if (!st) st = tli_cells_reserve(cells, count, all);
    uint32_t *to = st ? NULL : cells->connectivity + cells->index_count;
    for (uint64_t c = 0; c < count && !st; c++) tli_cells_add(cells, type, sizes[c], block->id);
    if (!st) st = tli_nc_ids(&ex->nc, ids, 0, all, 1, (int64_t)limit, to);
    tl_mem_free(ex->ctx, sizes);
    return st;
}

/* Faces of polyhedra: blocks of polygons, which elements name by numbers over all blocks. */
static tl_status read_faces(tli_exodus *ex)
{
    tl_status st = TL_OK;
    uint64_t blocks = 0;
    tli_face_list list;
    tli_nc_length(&ex->nc, "num_fa_blk", &blocks);
    tli_face_list_begin(ex->grid, &list);
    for (uint64_t b = 1; b <= blocks && !st; b++) {
        const tli_nc_var *ids = tli_nc_find_numbered(&ex->nc, "fbconn", b);
        const tli_nc_var *entries = tli_nc_find_numbered(&ex->nc, "fbepecnt", b);
        tli_ex_block block = {0};
        tli_cells faces;
        if (!ids || !entries) continue; /* faces of one size are those of a surface */
        tli_cells_init(ex->ctx, &faces);
        st = read_ragged(ex, ids, entries, TLI_VTK_POLYGON, ex->grid->point_count, &faces, &block);
        for (uint64_t f = 0; f < faces.count && !st; f++)
            st = tli_face_list_add(&list, faces.connectivity + faces.offsets[f],
                                   faces.offsets[f + 1] - faces.offsets[f], 0);
        tli_cells_release(&faces);
    }
    return st ? st : tli_face_list_end(&list);
}

static tl_status read_block(tli_exodus *ex, uint64_t number, tli_cells *cells, tli_ex_block *block)
{
    const tli_nc *nc = &ex->nc;
    const tli_nc_var *connect = tli_nc_find_numbered(nc, "connect", number);
    const tli_nc_var *faces = tli_nc_find_numbered(nc, "facconn", number);
    const tli_nc_var *entries = tli_nc_find_numbered(nc, "ebepecnt", number);
    block->first_cell = cells->count;
    if (faces && entries)
        return read_ragged(ex, faces, entries, TLI_VTK_POLYHEDRON, ex->grid->face_count, cells,
                           block);
    if (connect && entries)
        return read_ragged(ex, connect, entries, TLI_VTK_POLYGON, ex->grid->point_count, cells,
                           block);
    if (connect && connect->rank == 2 && !connect->is_record)
        return read_cells(ex, connect, cells, block);
    if (connect && tli_nc_count(connect) > 0)
        return tl_fail(ex->ctx, TL_ERR_FORMAT, "'%s': '%s' is no table of elements", nc->path,
                       connect->name);
    return TL_OK; /* a block without elements has no table */
}

static tl_status read_block_head(tli_exodus *ex, uint64_t b)
{
    const tli_nc_var *ids = tli_nc_find(&ex->nc, "eb_prop1");
    const tli_nc_var *names = tli_nc_find(&ex->nc, "eb_names");
    char name[TLI_NC_NAME_MAX] = "";
    uint32_t id = (uint32_t)b + 1;
    tl_status st = TL_OK;
    if (ids && b < tli_nc_count(ids)) st = tli_nc_ids(&ex->nc, ids, b, 1, 0, INT32_MAX, &id);
    if (!st && names) st = tli_nc_text(&ex->nc, names, b, name);
    if (!st) ex->blocks[b].id = (int32_t)id;
    return st ? st : tli_grid_name_region(ex->grid, (int32_t)id, name);
}

static tl_status read_blocks(tli_exodus *ex)
{
    tl_status st = TL_OK;
    tli_cells cells;
    uint64_t count = 0;
    tli_nc_length(&ex->nc, "num_el_blk", &count);
    if (count > ex->nc.map->byte_count)
        return tl_fail(ex->ctx, TL_ERR_FORMAT, "'%s': %llu blocks can't be", ex->nc.path,
                       (unsigned long long)count);
    ex->blocks = tl_mem_zalloc(ex->ctx, (size_t)count, sizeof *ex->blocks, &st);
    if (st) return st;
    ex->block_count = count;
    tli_cells_init(ex->ctx, &cells);
    st = read_faces(ex);
    for (uint64_t b = 0; b < count && !st; b++) {
        st = read_block_head(ex, b);
        if (!st) st = read_block(ex, b + 1, &cells, &ex->blocks[b]);
    }
    if (!st) st = tli_cells_to_grid(&cells, ex->nc.path, true, ex->grid);
    tli_cells_release(&cells);
    return st;
}

/* ---- what is left out ---- */

static void say_left_out(const tli_exodus *ex)
{
    static const struct {
        const char *dim, *what;
    } parts[] = {{"num_node_sets", "node sets"},
                 {"num_edge_sets", "edge sets"},
                 {"num_face_sets", "face sets"},
                 {"num_elem_sets", "element sets"},
                 {"num_ed_blk", "edge blocks"},
                 {"num_glo_var", "global variables"},
                 {"num_edge_var", "edge variables"},
                 {"num_face_var", "face variables"},
                 {"num_nset_var", "variables of node sets"},
                 {"num_sset_var", "variables of side sets"}};
    char text[256] = "";
    size_t used = 0;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        uint64_t count = 0;
        if (!tli_nc_length(&ex->nc, parts[i].dim, &count) || !count) continue;
        int n = snprintf(text + used, sizeof text - used, "%s%llu %s", used ? ", " : "",
                         (unsigned long long)count, parts[i].what);
        if (n > 0 && (size_t)n < sizeof text - used) used += (size_t)n;
    }
    if (used) tl_log(ex->ctx, TL_LOG_INFO, "left out: %s", text);
}

/* ---- doors ---- */

/* Times of the steps; a file without steps has one, without a time. */
static tl_status list_times(tl_ctx *ctx, const tli_nc *nc, tl_steps *steps)
{
    const tli_nc_var *times = tli_nc_find(nc, "time_whole");
    uint64_t count = times && times->is_record ? times->dims[0] : 0;
    tl_status st = tli_steps_alloc(ctx, count ? (size_t)count : 1, steps);
    for (uint64_t i = 0; i < count && !st; i++)
        st = tli_nc_reals(nc, times, i, 0, 1, &steps->times[i], 1);
    return st;
}

tli_match tli_match_exodus(const tli_source *source)
{
    bool classic = tli_head_begins(source, "CDF\001") || tli_head_begins(source, "CDF\002") ||
                   tli_head_begins(source, "CDF\005");
    if (classic) return TLI_MATCH_BYTES;
    bool hdf5 = tli_head_begins(source, "\x89HDF\r\n\x1a\n");
    return hdf5 && tli_source_holds(source, "num_el_blk") ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

tl_status tli_steps_exodus(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                           tl_steps *steps)
{
    tli_nc nc;
    (void)opts;
    tl_status st = tli_nc_open(ctx, source, &nc);
    if (!st) st = list_times(ctx, &nc, steps);
    tli_nc_close(&nc);
    return st;
}

tl_status tli_read_exodus(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                          tli_grid *grid)
{
    tli_exodus ex = {.ctx = ctx, .grid = grid};
    tl_steps steps = {0};
    uint64_t nodes;
    tl_status st = tli_nc_open(ctx, source, &ex.nc);
    if (!st && !tli_nc_length(&ex.nc, "num_nodes", &nodes))
        st = tl_fail(ctx, TL_ERR_UNSUPPORTED,
                     "'%s': a netCDF file, but no Exodus II: it has no dimension num_nodes",
                     source->path);
    if (!st) st = list_times(ctx, &ex.nc, &steps);
    if (!st) st = tli_steps_pick(ctx, opts, steps.times, steps.count, &ex.step);
    if (!st) st = read_points(&ex);
    if (!st) st = read_blocks(&ex);
    if (!st) st = tli_ex_fields(&ex);
    if (!st) st = tli_ex_side_sets(&ex);
    if (!st) grid->time = steps.times[ex.step];
    if (!st) say_left_out(&ex);
    tl_mem_free(ctx, ex.blocks);
    tl_steps_release(ctx, &steps);
    tli_nc_close(&ex.nc);
    return st;
}
