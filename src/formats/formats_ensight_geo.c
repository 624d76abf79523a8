/* EnSight: parts. In Gold each part has points of its own, in EnSight 6 all share one list. Cells
 * of a kind stand together, so that values per element find them again. */
#include "formats/formats_ensight.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define PARTS_MAX 1000000
/* Part numbers and counts tell the byte order: the smaller of both readings is the right one. */

static const struct {
    const char *name;
    uint8_t type, nodes;
} kinds[] = {
    {"point", TLI_VTK_VERTEX, 1},
    {"bar2", TLI_VTK_LINE, 2},
    {"bar3", TLI_VTK_QUADRATIC_EDGE, 3},
    {"tria3", TLI_VTK_TRIANGLE, 3},
    {"tria6", TLI_VTK_QUADRATIC_TRIANGLE, 6},
    {"quad4", TLI_VTK_QUAD, 4},
    {"quad8", TLI_VTK_QUADRATIC_QUAD, 8},
    {"tetra4", 10, 4},
    {"tetra10", TLI_VTK_QUADRATIC_TETRA, 10},
    {"pyramid5", TLI_VTK_PYRAMID, 5},
    {"pyramid13", TLI_VTK_QUADRATIC_PYRAMID, 13},
    {"hexa8", TLI_VTK_HEXAHEDRON, 8},
    {"hexa20", TLI_VTK_QUADRATIC_HEXAHEDRON, 20},
    {"penta6", TLI_VTK_WEDGE, 6},
    {"penta15", TLI_VTK_QUADRATIC_WEDGE, 15},
    {"nsided", TLI_VTK_POLYGON, 0},
    {"nfaced", TLI_VTK_POLYHEDRON, 0},
};

/* ---- parts and sections ---- */

static tli_ensight_part *last_part(tli_ensight_geo *geo)
{
    return &geo->parts[geo->part_count - 1];
}

static tl_status add_part(tli_ensight_geo *geo, tli_scan *scan, int64_t number)
{
    tl_status st = TL_OK;
    if (geo->part_count == PARTS_MAX) return tli_scan_fail(scan, "more than %d parts", PARTS_MAX);
    if ((geo->part_count & (geo->part_count - 1)) == 0)
        geo->parts =
            tl_mem_resize(geo->ctx, geo->parts, geo->part_count ? 2 * (size_t)geo->part_count : 1,
                          sizeof *geo->parts, &st);
    if (st) return st;
    geo->parts[geo->part_count++] =
        (tli_ensight_part){.number = number, .first_section = geo->section_count};
    if (!geo->gold) last_part(geo)->point_count = geo->grid->point_count;
    return TL_OK;
}

static tl_status add_section(tli_ensight_geo *geo, const char *name, uint64_t cell_count)
{
    tl_status st = TL_OK;
    if ((geo->section_count & (geo->section_count - 1)) == 0)
        geo->sections = tl_mem_resize(geo->ctx, geo->sections,
                                      geo->section_count ? 2 * (size_t)geo->section_count : 1,
                                      sizeof *geo->sections, &st);
    if (st) return st;
    tli_ensight_section *section = &geo->sections[geo->section_count++];
    *section = (tli_ensight_section){.first_cell = geo->cells.count, .cell_count = cell_count};
    strcpy(section->name, name);
    last_part(geo)->section_count++;
    return TL_OK;
}

/* ---- points ---- */

static tl_status grow_points(tli_ensight_geo *geo, uint64_t count)
{
    tl_status st = TL_OK;
    geo->grid->xyz =
        tl_mem_resize(geo->ctx, geo->grid->xyz, (size_t)(geo->grid->point_count + count),
                      3 * sizeof(double), &st);
    if (st) return st;
    geo->grid->point_count += count;
    if (geo->grid->point_count > TL_MESH_VERTS_MAX)
        return tl_fail(geo->ctx, TL_ERR_UNSUPPORTED, "%" PRIu64 " points, at most %u",
                       geo->grid->point_count, TL_MESH_VERTS_MAX);
    return TL_OK;
}

/* All x, then all y, then all z. */
static tl_status read_apart(tli_ensight_geo *geo, tli_scan *scan, uint64_t first, uint64_t count)
{
    tl_status st = TL_OK;
    double *axis_values = tl_mem_alloc(geo->ctx, (size_t)count, sizeof *axis_values, &st);
    for (int axis = 0; !st && axis < 3; axis++) {
        st = tli_ensight_reals(scan, "a coordinate", count, axis_values);
        for (uint64_t i = 0; !st && i < count; i++)
            geo->grid->xyz[3 * (first + i) + (uint64_t)axis] = axis_values[i];
    }
    tl_mem_free(geo->ctx, axis_values);
    return st;
}

static tl_status read_part_points(tli_ensight_geo *geo, tli_scan *scan)
{
    tli_ensight_part *part = last_part(geo);
    uint64_t count = 0;
    tl_status st = tli_ensight_count(scan, "points", 3u + geo->has_node_ids, &count);
    part->first_point = geo->grid->point_count;
    part->point_count = count;
    if (!st) st = grow_points(geo, count);
    if (!st && geo->has_node_ids) st = tli_ensight_skip_ints(scan, "a node id", count);
    return st ? st : read_apart(geo, scan, part->first_point, count);
}

/* EnSight 6: the points of all parts, each after its id. */
static tl_status read_all_points(tli_ensight_geo *geo, tli_scan *scan)
{
    uint64_t count = 0;
    const bool ids = geo->has_node_ids;
    if (geo->grid->xyz) return tli_scan_fail(scan, "a second list of points");
    tl_status st = tli_ensight_count(scan, "points", 3u + ids, &count);
    if (!st) st = grow_points(geo, count);
    uint64_t *numbers = ids ? tl_mem_zalloc(geo->ctx, (size_t)count, sizeof *numbers, &st) : NULL;
    for (uint64_t i = 0; !st && ids && scan->binary && i < count; i++) {
        int64_t id = 0;
        st = tli_ensight_int(scan, "a node id", INT32_MIN, INT32_MAX, &id);
        numbers[i] = (uint64_t)id;
    }
    if (!st && scan->binary)
        st = tli_ensight_reals(scan, "a coordinate", 3 * count, geo->grid->xyz);
    for (uint64_t i = 0; !st && !scan->binary && i < count; i++) {
        int64_t id = 0;
        if (ids) st = tli_ensight_int(scan, "a node id", INT32_MIN, INT32_MAX, &id);
        if (ids) numbers[i] = (uint64_t)id;
        if (!st) st = tli_ensight_reals(scan, "a coordinate", 3, geo->grid->xyz + 3 * i);
    }
    if (st || !geo->maps_node_ids) {
        tl_mem_free(geo->ctx, numbers);
        return st;
    }
    return tli_ids_create(geo->ctx, numbers, count, &geo->node_ids);
}

/* ---- cells ---- */

/* Ids of points in the file to those of the grid. */
static tl_status read_nodes(tli_ensight_geo *geo, tli_scan *scan, uint64_t count, uint32_t *ids)
{
    const tli_ensight_part *part = last_part(geo);
    const int64_t low = geo->maps_node_ids ? INT32_MIN : 1,
                  high = geo->maps_node_ids ? INT32_MAX : (int64_t)part->point_count;
    tl_status st = TL_OK;
    for (uint64_t i = 0; !st && i < count; i++) {
        int64_t id = 1;
        st = tli_ensight_int(scan, "a point", low, high, &id);
        ids[i] = geo->maps_node_ids ? tli_ids_find(&geo->node_ids, (uint64_t)id)
                                    : (uint32_t)(part->first_point + (uint64_t)id - 1);
        if (!st && ids[i] == TL_NONE)
            st = tli_scan_fail(scan, "a cell has node %" PRId64 ", which is not there", id);
    }
    return st;
}

static tl_status read_plain_cells(tli_ensight_geo *geo, tli_scan *scan, size_t kind, uint64_t count)
{
    const uint32_t nodes = kinds[kind].nodes;
    const bool inline_ids = geo->has_element_ids && !geo->gold && !scan->binary;
    const int32_t region = (int32_t)last_part(geo)->number;
    tl_status st = tli_scan_room(scan, "cells", count, nodes * (scan->binary ? 4u : 2u));
    if (!st) st = tli_cells_reserve(&geo->cells, count, count * nodes);
    for (uint64_t i = 0; !st && i < count; i++) {
        uint32_t ids[20];
        if (inline_ids) st = tli_ensight_skip_ints(scan, "an element id", 1);
        if (!st) st = read_nodes(geo, scan, nodes, ids);
        if (!st)
            memcpy(tli_cells_add(&geo->cells, kinds[kind].type, nodes, region), ids,
                   nodes * sizeof *ids);
    }
    return st;
}

/* Counts [count], whose sum the rest of the file must hold. */
static tl_status read_counts(tli_ensight_geo *geo, tli_scan *scan, const char *what, uint64_t count,
                             uint32_t **counts, uint64_t *sum)
{
    tl_status st = TL_OK;
    *sum = 0;
    *counts = tl_mem_alloc(geo->ctx, (size_t)count, sizeof **counts, &st);
    for (uint64_t i = 0; !st && i < count; i++) {
        int64_t value = 0;
        st = tli_ensight_int(scan, what, 0, INT32_MAX, &value);
        (*counts)[i] = (uint32_t)value;
        *sum += (uint64_t)value;
    }
    return st ? st : tli_scan_room(scan, what, *sum, scan->binary ? 4 : 2);
}

static tl_status read_polygons(tli_ensight_geo *geo, tli_scan *scan, uint64_t count)
{
    uint32_t *sizes = NULL;
    uint64_t sum = 0;
    tl_status st = read_counts(geo, scan, "corners of a polygon", count, &sizes, &sum);
    if (!st) st = tli_cells_reserve(&geo->cells, count, sum);
    for (uint64_t i = 0; !st && i < count; i++)
        st = read_nodes(
            geo, scan, sizes[i],
            tli_cells_add(&geo->cells, TLI_VTK_POLYGON, sizes[i], (int32_t)last_part(geo)->number));
    tl_mem_free(geo->ctx, sizes);
    return st;
}

/* Room for more faces, whose offsets go on from those that are there. */
static tl_status add_faces(tli_ensight_geo *geo, const uint32_t *sizes, uint64_t count,
                           uint64_t corners)
{
    tli_grid *grid = geo->grid;
    tl_status st = TL_OK;
    grid->face_offsets =
        tl_mem_resize(geo->ctx, grid->face_offsets, (size_t)(grid->face_count + count) + 1,
                      sizeof *grid->face_offsets, &st);
    grid->face_points =
        tl_mem_resize(geo->ctx, grid->face_points, (size_t)(geo->face_point_count + corners),
                      sizeof *grid->face_points, &st);
    if (st) return st;
    if (grid->face_count == 0) grid->face_offsets[0] = 0;
    for (uint64_t f = 0; f < count; f++)
        grid->face_offsets[grid->face_count + f + 1] =
            grid->face_offsets[grid->face_count + f] + sizes[f];
    return TL_OK;
}

static tl_status read_polyhedra(tli_ensight_geo *geo, tli_scan *scan, uint64_t count)
{
    tli_grid *grid = geo->grid;
    uint32_t *face_counts = NULL, *sizes = NULL;
    uint64_t faces = 0, corners = 0, face = grid->face_count;
    tl_status st = read_counts(geo, scan, "faces of a polyhedron", count, &face_counts, &faces);
    if (!st) st = read_counts(geo, scan, "corners of a face", faces, &sizes, &corners);
    if (!st && grid->face_count + faces > UINT32_MAX)
        st = tli_scan_fail(scan, "more than %u faces", UINT32_MAX);
    if (!st) st = add_faces(geo, sizes, faces, corners);
    if (!st) st = read_nodes(geo, scan, corners, grid->face_points + geo->face_point_count);
    if (!st) st = tli_cells_reserve(&geo->cells, count, faces);
    for (uint64_t i = 0; !st && i < count; i++) {
        uint32_t *ids = tli_cells_add(&geo->cells, TLI_VTK_POLYHEDRON, face_counts[i],
                                      (int32_t)last_part(geo)->number);
        for (uint32_t f = 0; f < face_counts[i]; f++) ids[f] = (uint32_t)face++;
    }
    if (!st) {
        grid->face_count += faces;
        geo->face_point_count += corners;
    }
    tl_mem_free(geo->ctx, sizes);
    tl_mem_free(geo->ctx, face_counts);
    return st;
}

/* A line that names a kind of cells; *known is false for one that does not. */
static tl_status read_section(tli_ensight_geo *geo, tli_scan *scan, const char *line, bool *known)
{
    uint64_t count = 0;
    const bool ghost = strncmp(line, "g_", 2) == 0;
    for (size_t kind = 0; kind < sizeof kinds / sizeof *kinds; kind++) {
        if (strcmp(line + 2 * ghost, kinds[kind].name) != 0) continue;
        *known = true;
        tl_status st = tli_ensight_count(scan, "cells", 1, &count);
        if (!st) st = add_section(geo, line, count);
        geo->has_ghosts |= ghost;
        if (!st && geo->has_element_ids && (geo->gold || scan->binary))
            st = tli_ensight_skip_ints(scan, "an element id", count);
        if (st) return st;
        if (kinds[kind].type == TLI_VTK_POLYGON) return read_polygons(geo, scan, count);
        if (kinds[kind].type == TLI_VTK_POLYHEDRON) return read_polyhedra(geo, scan, count);
        return read_plain_cells(geo, scan, kind, count);
    }
    *known = false;
    return TL_OK;
}

/* ---- structured parts ---- */

/* Positions by axes (rectilinear) or by origin and step (uniform). */
static tl_status read_lattice(tli_ensight_geo *geo, tli_scan *scan, const uint64_t dims[3],
                              bool uniform)
{
    double *axes[3] = {NULL, NULL, NULL}, steps[6] = {0};
    double *xyz = geo->grid->xyz + 3 * last_part(geo)->first_point;
    tl_status st = TL_OK;
    if (uniform) st = tli_ensight_reals(scan, "origin and steps", 6, steps);
    for (int axis = 0; axis < 3; axis++)
        axes[axis] = tl_mem_alloc(geo->ctx, (size_t)dims[axis], sizeof(double), &st);
    for (int axis = 0; !st && axis < 3; axis++) {
        if (!uniform) st = tli_ensight_reals(scan, "a coordinate", dims[axis], axes[axis]);
        for (uint64_t i = 0; uniform && i < dims[axis]; i++)
            axes[axis][i] = steps[axis] + (double)i * steps[3 + axis];
    }
    for (uint64_t k = 0; !st && k < dims[2]; k++)
        for (uint64_t j = 0; j < dims[1]; j++)
            for (uint64_t i = 0; i < dims[0]; i++, xyz += 3)
                xyz[0] = axes[0][i], xyz[1] = axes[1][j], xyz[2] = axes[2][k];
    for (int axis = 0; axis < 3; axis++) tl_mem_free(geo->ctx, axes[axis]);
    return st;
}

/* Cells between the points, hexahedra or quadrilaterals; flatter ones are left out. */
static tl_status add_block_cells(tli_ensight_geo *geo, const uint64_t dims[3])
{
    static const uint8_t corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                          {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    const uint64_t first = last_part(geo)->first_point;
    uint64_t cells[3], strides[3] = {1, dims[0], dims[0] * dims[1]}, count = 1;
    int axes[3], used = 0;
    for (int axis = 0; axis < 3; axis++) {
        cells[axis] = dims[axis] > 1 ? dims[axis] - 1 : 1;
        count *= cells[axis];
        if (dims[axis] > 1) axes[used++] = axis;
    }
    if (used < 2) count = 0;
    const uint32_t nodes = used == 3 ? 8 : 4;
    tl_status st = add_section(geo, "block", count);
    if (!st) st = tli_cells_reserve(&geo->cells, count, count * nodes);
    for (uint64_t c = 0; !st && c < count; c++) {
        uint64_t base = first + c % cells[0] + c / cells[0] % cells[1] * strides[1] +
                        c / cells[0] / cells[1] * strides[2];
        uint32_t *ids = tli_cells_add(&geo->cells, used == 3 ? TLI_VTK_HEXAHEDRON : TLI_VTK_QUAD,
                                      nodes, (int32_t)last_part(geo)->number);
        for (uint32_t n = 0; n < nodes; n++) {
            uint64_t id = base;
            for (int a = 0; a < used; a++) id += corners[n][a] * strides[axes[a]];
            ids[n] = (uint32_t)id;
        }
    }
    return st;
}

static tl_status read_block(tli_ensight_geo *geo, tli_scan *scan, const char *line)
{
    const bool uniform = strstr(line, "uniform"), rectilinear = strstr(line, "rectilinear");
    uint64_t dims[3] = {1, 1, 1}, count = 1;
    tl_status st = TL_OK;
    if (!geo->gold || strstr(line, "range") || strstr(line, "with_ghost"))
        return tl_fail(
            geo->ctx, TL_ERR_UNSUPPORTED,
            "'%s': a structured part '%s'; those of EnSight Gold without range and ghosts "
            "are read",
            scan->path, line);
    for (int axis = 0; !st && axis < 3; axis++) {
        int64_t dim = 1;
        st = tli_ensight_int(scan, "a dimension", 1, INT32_MAX, &dim);
        dims[axis] = (uint64_t)dim;
        count = count > TL_MESH_VERTS_MAX / dims[axis] ? TL_MESH_VERTS_MAX : count * dims[axis];
    }
    /* lattices need no numbers of each point; others do, in the variables: 64 points a byte */
    if (!st && !uniform && !rectilinear)
        st = tli_scan_room(scan, "points", count, scan->binary ? 12 : 6);
    if (!st && (uniform || rectilinear) && count / 4096 > (uint64_t)(scan->end - scan->begin))
        st = tli_scan_fail(scan, "a lattice of %" PRIu64 " points in so small a file", count);
    if (st) return st;
    last_part(geo)->first_point = geo->grid->point_count;
    last_part(geo)->point_count = count;
    st = grow_points(geo, count);
    if (!st && (uniform || rectilinear))
        st = read_lattice(geo, scan, dims, uniform);
    else if (!st)
        st = read_apart(geo, scan, last_part(geo)->first_point, count);
    if (!st && strstr(line, "iblanked")) {
        tl_log(geo->ctx, TL_LOG_INFO, "'%s': iblank of part %" PRId64 " left out", scan->path,
               last_part(geo)->number);
        st = tli_ensight_skip_ints(scan, "iblank", count);
    }
    return st ? st : add_block_cells(geo, dims);
}

/* ---- the file ---- */

/* Of the two byte orders the one in which the next number is smaller. */
static void find_byte_order(tli_scan *scan)
{
    if (!scan->binary || scan->end - scan->at < 4) return;
    const uint8_t *at = (const uint8_t *)scan->at;
    uint32_t little = (uint32_t)tli_int_at(at, 4, false), big = (uint32_t)tli_int_at(at, 4, true);
    scan->big_endian = big < little;
}

static bool has_ids(const char *line)
{
    return strstr(line, "given") || strstr(line, "ignore");
}

static tl_status begin_part(tli_ensight_geo *geo, tli_scan *scan, const char *line)
{
    char name[TLI_ENSIGHT_LINE + 1];
    int64_t number = 0;
    bool more;
    tl_status st = TL_OK;
    if (geo->gold) {
        if (geo->part_count == 0) find_byte_order(scan);
        st = tli_ensight_int(scan, "the number of a part", INT32_MIN, INT32_MAX, &number);
        if (!st && !scan->binary) {
            tli_span rest;
            tli_scan_line(scan, &rest);
        }
    } else {
        tli_scan part;
        tli_scan_open(geo->ctx, scan->path, line + 4, strlen(line + 4), &part);
        st = tli_scan_int(&part, "the number of a part", INT32_MIN, INT32_MAX, &number);
    }
    if (!st) st = add_part(geo, scan, number);
    if (!st) st = tli_ensight_line(scan, name, &more);
    return st ? st : tli_grid_name_region(geo->grid, (int32_t)number, name);
}

/* Two lines of text, whether there are ids, and what may come before the parts. */
static tl_status read_head(tli_ensight_geo *geo, tli_scan *scan)
{
    char line[TLI_ENSIGHT_LINE + 1];
    bool more = true;
    tl_status st = TL_OK;
    for (int i = 0; !st && i < 4; i++) {
        st = tli_ensight_line(scan, line, &more);
        if (i == 2) geo->has_node_ids = has_ids(line);
        if (i == 2) geo->maps_node_ids = !geo->gold && strstr(line, "given");
        if (i == 3) geo->has_element_ids = has_ids(line);
    }
    if (!st && strncmp(line, "element id", 10) != 0)
        st = tli_scan_fail(scan, "expected four lines, of which the last begins with 'element id'");
    return st;
}

static tl_status read_line(tli_ensight_geo *geo, tli_scan *scan, const char *line)
{
    bool known = true;
    if (strncmp(line, "part", 4) == 0) return begin_part(geo, scan, line);
    if (strcmp(line, "extents") == 0) {
        double extents[6];
        if (!scan->binary) return tli_ensight_reals(scan, "the extents", 6, extents);
        find_byte_order(scan);
        return tli_ensight_reals(scan, "the extents", 6, extents);
    }
    if (!geo->gold && strcmp(line, "coordinates") == 0) {
        find_byte_order(scan);
        return read_all_points(geo, scan);
    }
    if (geo->part_count == 0) return tli_scan_fail(scan, "'%s' before the first part", line);
    if (strcmp(line, "coordinates") == 0) return read_part_points(geo, scan);
    if (strncmp(line, "block", 5) == 0) return read_block(geo, scan, line);
    tl_status st = read_section(geo, scan, line, &known);
    if (!st && !known)
        st = tli_scan_fail(scan, "'%s', expected a part, points or a kind of cells", line);
    return st;
}

static tl_status mark_ghosts(tli_ensight_geo *geo)
{
    tli_grid_array *array = NULL;
    tl_status st = TL_OK;
    if (!geo->has_ghosts) return TL_OK;
    st = tli_grid_add(geo->grid, TL_ON_TET, "vtkGhostType", 1, TL_U8, NULL, &array);
    if (st) return st;
    memset(array->values, 0, (size_t)array->count * sizeof *array->values);
    for (uint64_t s = 0; s < geo->section_count; s++)
        for (uint64_t i = 0;
             strncmp(geo->sections[s].name, "g_", 2) == 0 && i < geo->sections[s].cell_count; i++)
            array->values[geo->sections[s].first_cell + i] = 1;
    return TL_OK;
}

tl_status tli_ensight_geo_read(tli_ensight_geo *geo, tli_scan *scan)
{
    char line[TLI_ENSIGHT_LINE + 1];
    bool more = true;
    geo->node_ids.ctx = geo->ctx;
    tli_cells_init(geo->ctx, &geo->cells);
    tl_status st = read_head(geo, scan);
    while (!st) {
        st = tli_ensight_line(scan, line, &more);
        if (st || !more) break;
        if (strncmp(line, "END TIME STEP", 13) == 0) break;
        if (line[0]) st = read_line(geo, scan, line);
    }
    if (!st) st = tli_cells_to_grid(&geo->cells, scan->path, true, geo->grid);
    return st ? st : mark_ghosts(geo);
}

void tli_ensight_geo_release(tli_ensight_geo *geo)
{
    tli_cells_release(&geo->cells);
    tli_ids_release(&geo->node_ids);
    tl_mem_free(geo->ctx, geo->sections);
    tl_mem_free(geo->ctx, geo->parts);
}
