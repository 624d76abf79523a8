/* VTKHDF, versions 1 and 2: unstructured grids, image data and polygonal data in one HDF5 group, in
 * parts and, from version 2 on, in steps. All steps stand behind one another in the same data sets;
 * the group Steps says where each begins. */
#include "formats/formats_cells.h"
#include "formats/formats_hdf5.h"
#include "formats/formats_split.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Parts and steps of a file at most. */
#define PARTS_MAX 1000000
/* Topologies of polygonal data, in the order of the columns of their offsets. */
#define TOPOLOGIES 4

/* One step: where its things begin. */
typedef struct place {
    uint64_t first_part, part_count;
    uint64_t point, cells[TOPOLOGIES], ids[TOPOLOGIES];
} place;

typedef struct vtkhdf {
    tl_ctx *ctx;
    tli_h5 *h5;
    tli_h5_request request;
    tli_grid *grid;
    tli_cells cells;
    bool has_steps;
    size_t step;
    place at;
} vtkhdf;

static const char *const topologies[TOPOLOGIES] = {"Vertices", "Lines", "Polygons", "Strips"};
static const uint8_t topology_types[TOPOLOGIES] = {2, 4, TLI_VTK_POLYGON, 6};

static bool has(vtkhdf *v, const char *path)
{
    return tli_h5_at(v->h5, path) == TLI_H5_DATA;
}

/* ---- steps ---- */

static tl_status count_steps(vtkhdf *v, uint64_t *count)
{
    tli_h5_data data;
    *count = 1;
    v->has_steps = has(v, "/VTKHDF/Steps/Values");
    if (!v->has_steps) return TL_OK;
    tl_status st = tli_h5_describe(v->h5, "/VTKHDF/Steps/Values", &data);
    if (!st && (data.rank != 1 || !data.count || data.count > PARTS_MAX))
        return tl_fail(v->ctx, TL_ERR_FORMAT, "'%s': %llu steps, expected 1 to %d", v->request.path,
                       (unsigned long long)data.count, PARTS_MAX);
    if (!st) *count = data.count;
    return st;
}

static tl_status list_times(vtkhdf *v, tl_steps *steps)
{
    uint64_t count, begin = 0;
    tl_status st = count_steps(v, &count);
    if (!st) st = tli_steps_alloc(v->ctx, (size_t)count, steps);
    if (!st && v->has_steps)
        st = tli_h5_reals(v->h5, "/VTKHDF/Steps/Values", &begin, &count, steps->times);
    else if (!st && has(v, "/VTKHDF/FieldData/TimeValue"))
        st = tli_h5_rows(v->h5, &v->request, "/VTKHDF/FieldData/TimeValue", 0, 1, 1, steps->times);
    return st;
}

static tl_status step_number(vtkhdf *v, const char *name, uint64_t step, uint64_t column,
                             uint64_t *value)
{
    char path[600];
    snprintf(path, sizeof path, "/VTKHDF/Steps/%s", name);
    if (!v->has_steps || !has(v, path)) return TL_OK;
    return tli_h5_number(v->h5, &v->request, path, step, column, INT64_MAX / 64, value);
}

/* Where a step begins; without steps everything begins at 0 and has all parts. */
static tl_status find_place(vtkhdf *v, bool is_poly, uint64_t step, place *at)
{
    tli_h5_data data;
    *at = (place){.part_count = 1};
    const char *points = "/VTKHDF/NumberOfPoints";
    tl_status st = has(v, points) ? tli_h5_describe(v->h5, points, &data) : TL_OK;
    if (!st && has(v, points) && !v->has_steps) at->part_count = data.count;
    if (!st) st = step_number(v, "NumberOfParts", step, 0, &at->part_count);
    if (!st) st = step_number(v, "PartOffsets", step, 0, &at->first_part);
    if (!st) st = step_number(v, "PointOffsets", step, 0, &at->point);
    for (uint64_t t = 0; t < (is_poly ? TOPOLOGIES : 1) && !st; t++) {
        st = step_number(v, "CellOffsets", step, t, &at->cells[t]);
        if (!st) st = step_number(v, "ConnectivityIdOffsets", step, t, &at->ids[t]);
    }
    if (!st && at->part_count > PARTS_MAX)
        return tl_fail(v->ctx, TL_ERR_FORMAT, "'%s': %llu parts, expected at most %d",
                       v->request.path, (unsigned long long)at->part_count, PARTS_MAX);
    return st;
}

/* The same offsets in all steps mean the same data. */
static tl_status compare_steps(vtkhdf *v, bool is_poly, tl_steps *steps)
{
    place first, other;
    tl_status st = find_place(v, is_poly, 0, &first);
    steps->mesh = TL_STEPS_STATIC;
    for (uint64_t s = 1; s < steps->count && !st; s++) {
        st = find_place(v, is_poly, s, &other);
        bool same_cells = memcmp(other.cells, first.cells, sizeof other.cells) == 0 &&
                          memcmp(other.ids, first.ids, sizeof other.ids) == 0 &&
                          other.part_count == first.part_count;
        if (!same_cells) steps->mesh = TL_STEPS_CHANGING;
        if (!same_cells) break;
        if (other.point != first.point) steps->mesh = TL_STEPS_MOVING;
    }
    return st;
}

/* ---- points ---- */

static tl_status part_number(vtkhdf *v, const char *name, uint64_t part, uint64_t *value)
{
    char path[96];
    snprintf(path, sizeof path, "/VTKHDF/%s", name);
    return tli_h5_number(v->h5, &v->request, path, v->at.first_part + part, 0, UINT32_MAX, value);
}

/* A table must have rows [first, first + rows) before anything is allocated for them. */
static tl_status check_rows(vtkhdf *v, const char *path, uint64_t first, uint64_t rows)
{
    tli_h5_data data;
    tl_status st = tli_h5_describe(v->h5, path, &data);
    if (!st && (data.rank < 1 || first > data.dims[0] || rows > data.dims[0] - first))
        return tl_fail(v->ctx, TL_ERR_FORMAT,
                       "'%s': '%s' has %llu rows, expected %llu from %llu on", v->request.path,
                       path, (unsigned long long)(data.rank ? data.dims[0] : 0),
                       (unsigned long long)rows, (unsigned long long)first);
    return st;
}

static tl_status read_points(vtkhdf *v)
{
    tl_status st = TL_OK;
    uint64_t points = 0;
    for (uint64_t p = 0; p < v->at.part_count && !st; p++) {
        uint64_t count = 0;
        st = part_number(v, "NumberOfPoints", p, &count);
        points += count;
    }
    if (!st && points > TL_MESH_VERTS_MAX)
        return tl_fail(v->ctx, TL_ERR_UNSUPPORTED, "'%s': %llu points; at most %u are read",
                       v->request.path, (unsigned long long)points, TL_MESH_VERTS_MAX);
    if (!st) st = check_rows(v, "/VTKHDF/Points", v->at.point, points);
    v->grid->xyz = tl_mem_alloc(v->ctx, (size_t)points, 3 * sizeof(double), &st);
    if (st) return st;
    v->grid->point_count = points;
    return tli_h5_rows(v->h5, &v->request, "/VTKHDF/Points", v->at.point, points, 3, v->grid->xyz);
}

/* ---- cells ---- */

/* One topology of one part. */
typedef struct part {
    const char *group; /* "" or "/Polygons" */
    uint64_t number;   /* of the part in the step */
    uint64_t first_cell, cell_count, first_id, id_count;
    uint64_t first_point, point_count;
} part;

/* Ends of the cells of a part: cells + 1 numbers for each part. Writers disagree whether the places
 * of a step count one more for each part before it; the numbers tell: they run from 0 to the ids.
 */
static tl_status read_offsets(vtkhdf *v, const part *p, const char *path, int64_t *offsets)
{
    tl_status st = TL_OK;
    const uint64_t count = p->cell_count + 1;
    for (int before = 0; before < 2; before++) {
        uint64_t begin = p->first_cell + p->number + (before ? v->at.first_part : 0);
        if (check_rows(v, path, begin, count)) continue;
        st = tli_h5_ints(v->h5, path, &begin, &count, offsets);
        if (st) return st;
        bool fits = offsets[0] == 0 && (uint64_t)offsets[p->cell_count] == p->id_count;
        for (uint64_t c = 0; c < p->cell_count && fits; c++) fits = offsets[c] <= offsets[c + 1];
        if (fits) return TL_OK;
    }
    return tl_fail(v->ctx, TL_ERR_FORMAT,
                   "'%s': '%s' does not run from 0 to %llu over the %llu cells of part %llu",
                   v->request.path, path, (unsigned long long)p->id_count,
                   (unsigned long long)p->cell_count, (unsigned long long)p->number);
}

/* Cells of a part behind those that are there; type 0: from the data set Types. */
static tl_status read_part(vtkhdf *v, const part *p, uint8_t type)
{
    char offsets_path[64], ids_path[64];
    tl_status st = TL_OK;
    snprintf(offsets_path, sizeof offsets_path, "/VTKHDF%s/Offsets", p->group);
    snprintf(ids_path, sizeof ids_path, "/VTKHDF%s/Connectivity", p->group);
    if (p->cell_count == 0) return TL_OK;
    if (!type) st = check_rows(v, "/VTKHDF/Types", p->first_cell, p->cell_count);
    if (!st) st = check_rows(v, ids_path, p->first_id, p->id_count);
    if (!st) st = check_rows(v, offsets_path, p->first_cell, p->cell_count + 1);
    if (!st) st = tli_cells_reserve(&v->cells, p->cell_count, p->id_count);
    uint32_t *types = tl_mem_alloc(v->ctx, (size_t)p->cell_count, sizeof *types, &st);
    int64_t *offsets = tl_mem_alloc(v->ctx, (size_t)p->cell_count + 1, sizeof *offsets, &st);
    if (!st) st = read_offsets(v, p, offsets_path, offsets);
    if (!st && !type)
        st = tli_h5_ids(v->h5, &v->request, "/VTKHDF/Types", p->first_cell, p->cell_count, 256, 0,
                        types);
    uint32_t *ids = v->cells.connectivity + v->cells.index_count;
    for (uint64_t c = 0; c < p->cell_count && !st; c++) {
        uint8_t own = type ? type : (uint8_t)types[c];
        if (own == TLI_VTK_POLYHEDRON) /* faces stand elsewhere, and only in newer files */
            st =
                tl_fail(v->ctx, TL_ERR_UNSUPPORTED, "'%s': VTKHDF with polyhedra", v->request.path);
        else
            tli_cells_add(&v->cells, own, (uint32_t)(offsets[c + 1] - offsets[c]), 0);
    }
    if (!st)
        st = tli_h5_ids(v->h5, &v->request, ids_path, p->first_id, p->id_count, p->point_count,
                        p->first_point, ids);
    tl_mem_free(v->ctx, offsets);
    tl_mem_free(v->ctx, types);
    return st;
}

/* All parts of one topology; column: of its offsets. */
static tl_status read_topology(vtkhdf *v, const char *group, unsigned column, uint8_t type)
{
    part p = {.group = group, .first_cell = v->at.cells[column], .first_id = v->at.ids[column]};
    char cells[64], ids[64];
    tl_status st = TL_OK;
    const char *name = *group ? group + 1 : "";
    snprintf(cells, sizeof cells, "%s%sNumberOfCells", name, *name ? "/" : "");
    snprintf(ids, sizeof ids, "%s%sNumberOfConnectivityIds", name, *name ? "/" : "");
    for (; p.number < v->at.part_count && !st; p.number++) {
        st = part_number(v, cells, p.number, &p.cell_count);
        if (!st) st = part_number(v, ids, p.number, &p.id_count);
        if (!st) st = part_number(v, "NumberOfPoints", p.number, &p.point_count);
        if (!st) st = read_part(v, &p, type);
        p.first_cell += p.cell_count;
        p.first_id += p.id_count;
        p.first_point += p.point_count;
    }
    return st;
}

/* ---- fields ---- */

typedef struct field_visit {
    vtkhdf *v;
    tl_on on;
    const char *group; /* "PointData" */
    uint64_t rows, left_out;
} field_visit;

static tl_status read_field(void *arg, const char *name)
{
    field_visit *visit = arg;
    vtkhdf *v = visit->v;
    tli_h5_data data;
    char path[512], offsets[512];
    uint64_t first = visit->on == TL_ON_VERTEX ? v->at.point : v->at.cells[0], components = 1;
    snprintf(path, sizeof path, "/VTKHDF/%s/%.400s", visit->group, name);
    snprintf(offsets, sizeof offsets, "%sOffsets/%.400s", visit->group, name);
    if (!has(v, path)) return TL_OK;
    tl_status st = tli_h5_describe(v->h5, path, &data);
    if (!st) st = step_number(v, offsets, v->step, 0, &first);
    if (st) return st;
    for (uint32_t d = 1; d < data.rank; d++) components *= data.dims[d];
    if (data.is_text || data.is_other || data.rank < 1 || components == 0 || components > 4096) {
        visit->left_out++;
        return TL_OK;
    }
    tli_grid_array *array;
    st = check_rows(v, path, first, visit->rows);
    if (!st)
        st =
            tli_grid_add(v->grid, visit->on, name, (uint32_t)components, data.scalar, NULL, &array);
    return st ? st
              : tli_h5_rows(v->h5, &v->request, path, first, visit->rows, (uint32_t)components,
                            array->values);
}

static tl_status read_fields(vtkhdf *v)
{
    tl_status st = TL_OK;
    uint64_t left_out = 0;
    for (int on = TL_ON_VERTEX; on <= TL_ON_TET && !st; on++) {
        field_visit visit = {v, (tl_on)on, on == TL_ON_VERTEX ? "PointData" : "CellData", 0, 0};
        char group[32];
        visit.rows = on == TL_ON_VERTEX ? v->grid->point_count : tli_grid_cell_count(v->grid);
        snprintf(group, sizeof group, "/VTKHDF/%s", visit.group);
        if (tli_h5_at(v->h5, group) == TLI_H5_GROUP)
            st = tli_h5_members(v->h5, group, read_field, &visit);
        left_out += visit.left_out;
    }
    if (!st && left_out)
        tl_log(v->ctx, TL_LOG_INFO, "%llu arrays left out: they hold no numbers",
               (unsigned long long)left_out);
    return st;
}

/* ---- kinds ---- */

static tl_status read_unstructured(vtkhdf *v)
{
    tl_status st = read_points(v);
    if (!st) st = read_topology(v, "", 0, 0);
    if (!st) st = tli_cells_to_grid(&v->cells, v->request.path, false, v->grid);
    return st ? st : read_fields(v);
}

static tl_status read_polygons(vtkhdf *v)
{
    tl_status st = read_points(v);
    for (unsigned t = 0; t < TOPOLOGIES && !st; t++) {
        char group[16];
        snprintf(group, sizeof group, "/%s", topologies[t]);
        st = read_topology(v, group, t, topology_types[t]);
    }
    if (!st) st = tli_cells_to_grid(&v->cells, v->request.path, false, v->grid);
    return st ? st : read_fields(v);
}

/* A field of an image has its steps in front and its components behind the dimensions. */
static tl_status read_image_field(void *arg, const char *name)
{
    field_visit *visit = arg;
    vtkhdf *v = visit->v;
    tli_h5_data data;
    char path[512];
    const uint32_t *dims = v->grid->blocks[0].dims;
    snprintf(path, sizeof path, "/VTKHDF/%s/%.400s", visit->group, name);
    if (!has(v, path)) return TL_OK;
    tl_status st = tli_h5_describe(v->h5, path, &data);
    if (st) return st;
    uint32_t skip = v->has_steps ? 1 : 0, shape = 0;
    uint64_t begin[TLI_H5_RANK_MAX] = {0}, count[TLI_H5_RANK_MAX];
    for (uint32_t d = 0; d < data.rank; d++) count[d] = data.dims[d];
    bool fits = !data.is_text && !data.is_other && data.rank >= skip + 3;
    for (uint32_t axis = 0; axis < 3 && fits; axis++, shape++) {
        uint32_t points = dims[2 - axis];
        uint64_t cells = points > 1 ? points - 1 : points;
        fits = data.dims[skip + axis] == (visit->on == TL_ON_VERTEX ? points : cells);
    }
    uint64_t components = data.rank == skip + 4 ? data.dims[skip + 3] : 1;
    if (!fits || data.rank > skip + 4 || !components || components > 4096 ||
        (skip && v->step >= data.dims[0])) {
        visit->left_out++;
        return TL_OK;
    }
    if (skip) begin[0] = v->step, count[0] = 1;
    tli_grid_array *array;
    st = tli_grid_add(v->grid, visit->on, name, (uint32_t)components, data.scalar, NULL, &array);
    return st ? st : tli_h5_reals(v->h5, path, begin, count, array->values);
}

static tl_status read_image(vtkhdf *v)
{
    double extent[6], origin[3] = {0, 0, 0}, spacing[3] = {1, 1, 1},
                      direction[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    tl_status st = TL_OK;
    tli_h5_attribute_reals(v->h5, "/VTKHDF", "Origin", origin, 3);
    tli_h5_attribute_reals(v->h5, "/VTKHDF", "Spacing", spacing, 3);
    tli_h5_attribute_reals(v->h5, "/VTKHDF", "Direction", direction, 9);
    if (!tli_h5_attribute_reals(v->h5, "/VTKHDF", "WholeExtent", extent, 6))
        return tl_fail(v->ctx, TL_ERR_FORMAT, "'%s': an image without WholeExtent",
                       v->request.path);
    v->grid->blocks = tl_mem_zalloc(v->ctx, 1, sizeof *v->grid->blocks, &st);
    if (st) return st;
    v->grid->block_count = 1;
    double points = 1;
    for (int axis = 0; axis < 3; axis++) {
        double size = extent[2 * axis + 1] - extent[2 * axis] + 1;
        if (!(size >= 1 && size < 1e9)) size = 0;
        v->grid->blocks[0].dims[axis] = (uint32_t)size;
        points *= size;
    }
    if (!(points >= 1 && points <= TL_MESH_VERTS_MAX))
        return tl_fail(v->ctx, TL_ERR_FORMAT, "'%s': an image of %.0f points", v->request.path,
                       points);
    const uint32_t *dims = v->grid->blocks[0].dims;
    v->grid->point_count = (uint64_t)dims[0] * dims[1] * dims[2];
    v->grid->xyz = tl_mem_alloc(v->ctx, (size_t)v->grid->point_count, 3 * sizeof(double), &st);
    for (uint64_t p = 0; p < v->grid->point_count && !st; p++) {
        const double at[3] = {(extent[0] + (double)(p % dims[0])) * spacing[0],
                              (extent[2] + (double)(p / dims[0] % dims[1])) * spacing[1],
                              (extent[4] + (double)(p / dims[0] / dims[1])) * spacing[2]};
        for (int k = 0; k < 3; k++)
            v->grid->xyz[3 * p + (uint64_t)k] = origin[k] + direction[3 * k] * at[0] +
                                                direction[3 * k + 1] * at[1] +
                                                direction[3 * k + 2] * at[2];
    }
    for (int on = TL_ON_VERTEX; on <= TL_ON_TET && !st; on++) {
        field_visit visit = {v, (tl_on)on, on == TL_ON_VERTEX ? "PointData" : "CellData", 0, 0};
        char group[32];
        snprintf(group, sizeof group, "/VTKHDF/%s", visit.group);
        if (tli_h5_at(v->h5, group) == TLI_H5_GROUP)
            st = tli_h5_members(v->h5, group, read_image_field, &visit);
        if (!st && visit.left_out)
            tl_log(v->ctx, TL_LOG_INFO, "%llu arrays left out: not of the size of the image",
                   (unsigned long long)visit.left_out);
    }
    return st;
}

/* ---- doors ---- */

/* The first files of this kind say nothing: they are unstructured. */
static void kind_of(vtkhdf *v, char *type, size_t type_bytes)
{
    bool said = tli_h5_attribute_text(v->h5, "/VTKHDF", "Type", type, type_bytes);
    if (!said && has(v, "/VTKHDF/Types")) snprintf(type, type_bytes, "UnstructuredGrid");
}

tl_status tli_steps_vtkhdf(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                           tl_steps *steps)
{
    vtkhdf v = {.ctx = ctx, .request = {ctx, source->path}};
    char type[64];
    (void)opts;
    tl_status st = tli_h5_open(ctx, source->path, &source->map, &v.h5);
    if (!st) kind_of(&v, type, sizeof type);
    if (!st) st = list_times(&v, steps);
    if (!st && v.has_steps) st = compare_steps(&v, strcmp(type, "PolyData") == 0, steps);
    tli_h5_close(v.h5);
    return st;
}

tl_status tli_read_vtkhdf(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                          tli_grid *grid)
{
    vtkhdf v = {.ctx = ctx, .grid = grid, .request = {ctx, source->path}};
    tl_steps steps = {0};
    char type[64] = "";
    tli_cells_init(ctx, &v.cells);
    tl_status st = tli_h5_open(ctx, source->path, &source->map, &v.h5);
    if (!st) kind_of(&v, type, sizeof type);
    bool is_poly = strcmp(type, "PolyData") == 0;
    if (!st) st = list_times(&v, &steps);
    if (!st) st = tli_steps_pick(ctx, opts, steps.times, steps.count, &v.step);
    if (!st) st = find_place(&v, is_poly, v.step, &v.at);
    if (!st && strcmp(type, "UnstructuredGrid") == 0)
        st = read_unstructured(&v);
    else if (!st && strcmp(type, "ImageData") == 0)
        st = read_image(&v);
    else if (!st && is_poly)
        st = read_polygons(&v);
    else if (!st)
        st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': VTKHDF of type '%s'", source->path, type);
    if (!st) grid->time = steps.times[v.step];
    tli_cells_release(&v.cells);
    tl_steps_release(ctx, &steps);
    tli_h5_close(v.h5);
    return st;
}
