/* XDMF 2 and 3: grids, collections in space and time, parts of a grid that stand elsewhere in the
 * file (XInclude with the xpointers that meshio and DOLFIN write, Reference). */
#include "formats/formats_split.h"
#include "formats/formats_xdmf.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Kinds of cells by name and, in mixed lists, by number; nodes 0: a number of its own in front. */
static const struct {
    const char *name, *other;
    uint8_t number, type, nodes;
} kinds[] = {
    {"Polyvertex", "", 1, 2, 0},
    {"Polyline", "", 2, 4, 0},
    {"Polygon", "", 3, TLI_VTK_POLYGON, 0},
    {"Triangle", "", 4, TLI_VTK_TRIANGLE, 3},
    {"Quadrilateral", "", 5, TLI_VTK_QUAD, 4},
    {"Tetrahedron", "", 6, TLI_VTK_TETRA, 4},
    {"Pyramid", "", 7, TLI_VTK_PYRAMID, 5},
    {"Wedge", "", 8, TLI_VTK_WEDGE, 6},
    {"Hexahedron", "", 9, TLI_VTK_HEXAHEDRON, 8},
    {"Polyhedron", "", 16, TLI_VTK_POLYHEDRON, 0},
    {"Edge_3", "Edge3", 34, TLI_VTK_QUADRATIC_EDGE, 3},
    {"Quadrilateral_9", "Quad_9", 35, TLI_VTK_BIQUADRATIC_QUAD, 9},
    {"Triangle_6", "Tri_6", 36, TLI_VTK_QUADRATIC_TRIANGLE, 6},
    {"Quadrilateral_8", "Quad_8", 37, TLI_VTK_QUADRATIC_QUAD, 8},
    {"Tetrahedron_10", "Tet_10", 38, TLI_VTK_QUADRATIC_TETRA, 10},
    {"Pyramid_13", "Pyr_13", 39, TLI_VTK_QUADRATIC_PYRAMID, 13},
    {"Wedge_15", "", 40, TLI_VTK_QUADRATIC_WEDGE, 15},
    {"Wedge_18", "", 41, TLI_VTK_BIQUADRATIC_WEDGE, 18},
    {"Hexahedron_20", "Hex_20", 48, TLI_VTK_QUADRATIC_HEXAHEDRON, 20},
    {"Hexahedron_24", "Hex_24", 49, 33, 24},
    {"Hexahedron_27", "Hex_27", 50, TLI_VTK_TRIQUADRATIC_HEXAHEDRON, 27},
};
#define KIND_COUNT (sizeof kinds / sizeof kinds[0])

typedef struct reader {
    tli_xdmf *x;
    const tli_xd_node *grid_node;
    tli_grid *grid;
    int32_t blocks; /* counted over all grids */
} reader;

/* ---- parts that stand elsewhere ---- */

/* Topology or Geometry of a grid: its own, or that of the grid an include or a reference names. */
static const tli_xd_node *part_of(const tli_xdmf *x, const tli_xd_node *grid, const char *name,
                                  int depth)
{
    const tli_xd_node *own = tli_xd_child(grid, name, NULL), *include = NULL;
    if (depth > 8) return NULL;
    if (own && *tli_xd_value(own, "Reference", "") && own->text)
        return tli_xd_find(x, own->text + strspn(own->text, " \t\r\n"));
    while (!own && (include = tli_xd_child(grid, "include", include))) {
        const char *pointer = tli_xd_value(include, "xpointer", "");
        const char *path = strstr(pointer, "//");
        const tli_xd_node *other = path ? tli_xd_find(x, path) : NULL;
        if (other && tli_xd_same(other->name, name)) own = other;
        if (other && !own && other != grid) own = part_of(x, other, name, depth + 1);
    }
    return own;
}

/* Numbers of the item of a node; a block of the context. */
static tl_status item_reals(tli_xdmf *x, const tli_xd_node *item, uint64_t *count, double **values)
{
    tl_scalar scalar;
    *values = NULL;
    *count = 0;
    tl_status st = tli_xd_describe(x, item, count, &scalar);
    *values = tl_mem_alloc(x->ctx, (size_t)(st ? 0 : *count), sizeof **values, &st);
    if (!st) st = tli_xd_reals(x, item, *count, *values);
    if (st) {
        tl_mem_free(x->ctx, *values);
        *values = NULL;
    }
    return st;
}

/* ---- points ---- */

static tl_status check_points(const reader *r, uint64_t points)
{
    if (points <= TL_MESH_VERTS_MAX) return TL_OK;
    return tl_fail(r->x->ctx, TL_ERR_UNSUPPORTED, "'%s': %llu points; at most %u are read",
                   r->x->source->path, (unsigned long long)points, TL_MESH_VERTS_MAX);
}

/* Coordinates together, XYZ or XY, or apart, X_Y_Z. */
static tl_status read_points(reader *r, const tli_xd_node *geometry, unsigned axes, bool apart)
{
    tl_status st = TL_OK;
    const tli_xd_node *item = tli_xd_child(geometry, "DataItem", NULL);
    uint64_t count = 0, points;
    tl_scalar scalar;
    if (!item) return tli_xd_fail(r->x, geometry, "has no DataItem");
    st = tli_xd_describe(r->x, item, &count, &scalar);
    points = apart ? count : count / axes;
    if (!st) st = check_points(r, points);
    r->grid->xyz = tl_mem_zalloc(r->x->ctx, (size_t)points, 3 * sizeof(double), &st);
    if (st) return st;
    r->grid->point_count = points;
    if (!apart && axes == 3) return tli_xd_reals(r->x, item, 3 * points, r->grid->xyz);
    for (unsigned a = 0; a < (apart ? axes : 1) && item && !st; a++) {
        double *values;
        st = item_reals(r->x, item, &count, &values);
        if (!st && count != (apart ? points : axes * points))
            st = tli_xd_fail(r->x, geometry, "has coordinates of different numbers");
        for (uint64_t i = 0; i < count && !st; i++)
            r->grid->xyz[apart ? 3 * i + a : i / axes * 3 + i % axes] = values[i];
        tl_mem_free(r->x->ctx, values);
        item = tli_xd_child(geometry, "DataItem", item);
    }
    return st;
}

/* ---- structured ---- */

static tl_status make_block(reader *r, const tli_xd_node *topology)
{
    tl_status st = TL_OK;
    const char *at =
        tli_xd_value(topology, "Dimensions", tli_xd_value(topology, "NumberOfElements", ""));
    uint64_t dims[3] = {1, 1, 1}, count = 1;
    for (int n = 0; *(at += strspn(at, " \t\r\n")) && n < 3; n++) {
        char *end;
        unsigned long long value = strtoull(at, &end, 10);
        if (end == at || value == 0 || value > TL_MESH_VERTS_MAX)
            return tli_xd_fail(r->x, topology, "has no dimensions that are read");
        at = end;
        dims[2] = dims[1], dims[1] = dims[0], dims[0] = value; /* the last is the fastest */
    }
    for (int axis = 0; axis < 3; axis++) {
        count *= dims[axis];
        st = check_points(r, count);
        if (st) return st;
    }
    r->grid->blocks = tl_mem_zalloc(r->x->ctx, 1, sizeof *r->grid->blocks, &st);
    if (st) return st;
    r->grid->block_count = 1;
    for (int axis = 0; axis < 3; axis++) r->grid->blocks[0].dims[axis] = (uint32_t)dims[axis];
    return TL_OK;
}

/* Three lists of coordinates, x first, or an origin and steps, z first. */
static tl_status make_lattice(reader *r, const tli_xd_node *geometry, bool lists)
{
    tl_status st = TL_OK;
    double *lines[3] = {NULL, NULL, NULL}, *numbers = NULL, origin[3] = {0}, steps[3] = {1, 1, 1};
    const uint32_t *dims = r->grid->blocks[0].dims;
    uint64_t points = (uint64_t)dims[0] * dims[1] * dims[2], count;
    const tli_xd_node *item = tli_xd_child(geometry, "DataItem", NULL);
    for (int k = 0; k < (lists ? 3 : 2) && !st; k++) {
        if (!item) {
            st = lists && k == 2 ? TL_OK : tli_xd_fail(r->x, geometry, "has too few DataItems");
            break;
        }
        st = item_reals(r->x, item, &count, lists ? &lines[k] : &numbers);
        if (!st && count != (lists ? dims[k] : count))
            st = tli_xd_fail(r->x, geometry, "has another size than its topology");
        for (uint64_t i = 0; i < 3 && i < count && !lists && !st; i++)
            (k ? steps : origin)[count < 3 ? count - 1 - i : 2 - i] = numbers[i];
        tl_mem_free(r->x->ctx, numbers);
        numbers = NULL;
        item = tli_xd_child(geometry, "DataItem", item);
    }
    r->grid->xyz = tl_mem_zalloc(r->x->ctx, (size_t)points, 3 * sizeof(double), &st);
    for (uint64_t p = 0; p < points && !st; p++) {
        const uint64_t at[3] = {p % dims[0], p / dims[0] % dims[1], p / dims[0] / dims[1]};
        for (int k = 0; k < 3; k++)
            r->grid->xyz[3 * p + (uint64_t)k] =
                lists ? (lines[k] ? lines[k][at[k]] : 0) : origin[k] + steps[k] * (double)at[k];
    }
    for (int k = 0; k < 3; k++) tl_mem_free(r->x->ctx, lines[k]);
    r->grid->point_count = points;
    return st;
}

static tl_status read_geometry(reader *r, const tli_xd_node *geometry)
{
    const char *type =
        tli_xd_value(geometry, "GeometryType", tli_xd_value(geometry, "Type", "XYZ"));
    bool block = r->grid->block_count > 0;
    tl_status st;
    if (tli_xd_same(type, "XYZ"))
        st = read_points(r, geometry, 3, false);
    else if (tli_xd_same(type, "XY"))
        st = read_points(r, geometry, 2, false);
    else if (tli_xd_same(type, "X_Y_Z"))
        st = read_points(r, geometry, 3, true);
    else if (tli_xd_same(type, "X_Y"))
        st = read_points(r, geometry, 2, true);
    else if (block && (tli_xd_same(type, "VXVYVZ") || tli_xd_same(type, "VXVY")))
        st = make_lattice(r, geometry, true);
    else if (block && (tli_xd_same(type, "ORIGIN_DXDYDZ") || tli_xd_same(type, "ORIGIN_DXDY")))
        st = make_lattice(r, geometry, false);
    else
        return tl_fail(r->x->ctx, TL_ERR_UNSUPPORTED, "'%s': geometry of type '%s'",
                       r->x->source->path, type);
    if (st || !block) return st;
    const uint32_t *dims = r->grid->blocks[0].dims;
    if ((uint64_t)dims[0] * dims[1] * dims[2] == r->grid->point_count) return TL_OK;
    return tli_xd_fail(r->x, geometry, "has another number of points than its topology");
}

/* ---- cells ---- */

static tl_status to_id(const reader *r, const tli_xd_node *node, double value, uint32_t *id)
{
    if (!(value >= 0 && value < (double)r->grid->point_count))
        return tli_xd_fail(r->x, node, "names a point that there is none of");
    *id = (uint32_t)value;
    return TL_OK;
}

/* Faces of a polyhedron: their number, for each that of its corners and these. */
static tl_status take_polyhedron(reader *r, const tli_xd_node *node, const double *values,
                                 uint64_t count, uint64_t *at, tli_face_list *faces,
                                 tli_cells *cells)
{
    tl_status st = TL_OK;
    double face_count = *at < count ? values[(*at)++] : -1;
    if (!(face_count >= 0 && face_count <= (double)(count - *at)))
        return tli_xd_fail(r->x, node, "has a polyhedron that ends behind its list");
    st = tli_cells_reserve(cells, 1, (uint64_t)face_count);
    uint32_t *ids = st ? NULL : tli_cells_add(cells, TLI_VTK_POLYHEDRON, (uint32_t)face_count, 0);
    for (uint64_t f = 0; f < (uint64_t)face_count && !st; f++) {
        uint32_t corners[256];
        double size = *at < count ? values[(*at)++] : -1;
        if (!(size >= 0 && size <= 256 && size <= (double)(count - *at)))
            return tli_xd_fail(r->x, node, "has a face that ends behind its list");
        for (uint64_t i = 0; i < (uint64_t)size && !st; i++)
            st = to_id(r, node, values[(*at)++], &corners[i]);
        if (!st) st = tli_face_list_add(faces, corners, (uint64_t)size, 0);
        if (!st) ids[f] = (uint32_t)r->grid->face_count - 1;
    }
    return st;
}

static tl_status take_mixed(reader *r, const tli_xd_node *node, const double *values,
                            uint64_t count, double base, tli_cells *cells)
{
    tl_status st = TL_OK;
    tli_face_list faces;
    tli_face_list_begin(r->grid, &faces);
    for (uint64_t at = 0; at < count && !st;) {
        size_t k = 0;
        while (k < KIND_COUNT && kinds[k].number != values[at]) k++;
        if (k == KIND_COUNT) return tli_xd_fail(r->x, node, "has a cell of an unknown kind");
        at++;
        if (kinds[k].type == TLI_VTK_POLYHEDRON) {
            st = take_polyhedron(r, node, values, count, &at, &faces, cells);
            continue;
        }
        double nodes = kinds[k].nodes;
        if (!kinds[k].nodes) nodes = at < count ? values[at++] : -1;
        if (!(nodes >= 0 && nodes <= (double)(count - at)))
            return tli_xd_fail(r->x, node, "has a cell that ends behind its list");
        st = tli_cells_reserve(cells, 1, (uint64_t)nodes);
        if (st) break;
        uint32_t *ids = tli_cells_add(cells, kinds[k].type, (uint32_t)nodes, 0);
        for (uint64_t i = 0; i < (uint64_t)nodes && !st; i++)
            st = to_id(r, node, values[at++] - base, &ids[i]);
    }
    return st ? st : tli_face_list_end(&faces);
}

static tl_status take_uniform(reader *r, const tli_xd_node *node, size_t k, const double *values,
                              uint64_t count, double base, tli_cells *cells)
{
    uint64_t nodes = kinds[k].nodes;
    if (!nodes) nodes = strtoull(tli_xd_value(node, "NodesPerElement", "1"), NULL, 10);
    if (!nodes || nodes > UINT32_MAX || count % nodes)
        return tli_xd_fail(r->x, node, "has a list that is no multiple of the nodes of a cell");
    tl_status st = tli_cells_reserve(cells, count / nodes, count);
    for (uint64_t c = 0; c < count / nodes && !st; c++) {
        uint32_t *ids = tli_cells_add(cells, kinds[k].type, (uint32_t)nodes, 0);
        for (uint64_t i = 0; i < nodes && !st; i++)
            st = to_id(r, node, values[c * nodes + i] - base, &ids[i]);
    }
    return st;
}

static const char *topology_type(const tli_xd_node *topology)
{
    return tli_xd_value(topology, "TopologyType", tli_xd_value(topology, "Type", ""));
}

static tl_status read_cells(reader *r, const tli_xd_node *topology)
{
    const char *type = topology_type(topology);
    const tli_xd_node *item = tli_xd_child(topology, "DataItem", NULL);
    double base = 0, *values = NULL;
    uint64_t count = 0;
    size_t k = 0;
    tli_cells cells;
    while (k < KIND_COUNT && !tli_xd_same(type, kinds[k].name) &&
           !tli_xd_same(type, kinds[k].other))
        k++;
    bool mixed = tli_xd_same(type, "Mixed");
    if ((k == KIND_COUNT && !mixed) || (!mixed && kinds[k].type == TLI_VTK_POLYHEDRON) || !*type)
        return tl_fail(r->x->ctx, TL_ERR_UNSUPPORTED, "'%s': topology of type '%s'",
                       r->x->source->path, type);
    if (!item) return tli_xd_fail(r->x, topology, "has no DataItem");
    tl_status st = tli_xd_real(r->x, topology, "BaseOffset", &base);
    tli_cells_init(r->x->ctx, &cells);
    if (!st) st = item_reals(r->x, item, &count, &values);
    if (!st)
        st = mixed ? take_mixed(r, topology, values, count, base, &cells)
                   : take_uniform(r, topology, k, values, count, base, &cells);
    tl_mem_free(r->x->ctx, values);
    if (!st) st = tli_cells_to_grid(&cells, r->x->source->path, false, r->grid);
    tli_cells_release(&cells);
    return st;
}

/* ---- fields ---- */

static tl_status read_attribute(reader *r, const tli_xd_node *node, uint64_t *left_out)
{
    const char *center = tli_xd_value(node, "Center", "Node");
    const tli_xd_node *item = tli_xd_child(node, "DataItem", NULL);
    tl_on on = tli_xd_same(center, "Cell") ? TL_ON_TET : TL_ON_VERTEX;
    uint64_t places = on == TL_ON_TET ? tli_grid_cell_count(r->grid) : r->grid->point_count;
    uint64_t count = 0;
    tl_scalar scalar = TL_F64;
    if (!item || (!tli_xd_same(center, "Cell") && !tli_xd_same(center, "Node"))) {
        ++*left_out;
        return TL_OK;
    }
    tl_status st = tli_xd_describe(r->x, item, &count, &scalar);
    if (st) return st;
    if (!places || !count || count % places || count / places > 4096)
        return tl_fail(r->x->ctx, TL_ERR_FORMAT,
                       "'%s': attribute '%s': %llu values for %llu places", r->x->source->path,
                       tli_xd_value(node, "Name", ""), (unsigned long long)count,
                       (unsigned long long)places);
    tli_grid_array *array;
    st = tli_grid_add(r->grid, on, tli_xd_value(node, "Name", ""), (uint32_t)(count / places),
                      scalar, NULL, &array);
    return st ? st : tli_xd_reals(r->x, item, count, array->values);
}

static tl_status read_attributes(reader *r)
{
    tl_status st = TL_OK;
    uint64_t left_out = 0;
    const tli_xd_node *node = NULL;
    while (!st && (node = tli_xd_child(r->grid_node, "Attribute", node)))
        st = read_attribute(r, node, &left_out);
    if (!st && left_out)
        tl_log(r->x->ctx, TL_LOG_INFO, "%llu attributes left out: not of nodes or cells",
               (unsigned long long)left_out);
    return st;
}

/* ---- grids ---- */

static bool is_collection(const tli_xd_node *grid)
{
    const char *type = tli_xd_value(grid, "GridType", tli_xd_value(grid, "Type", "Uniform"));
    return tli_xd_same(type, "Collection") || tli_xd_same(type, "Tree");
}

static bool is_temporal(const tli_xd_node *grid)
{
    return is_collection(grid) &&
           tli_xd_same(tli_xd_value(grid, "CollectionType", "Spatial"), "Temporal");
}

static tl_status read_uniform(reader *r, const tli_xd_node *node)
{
    const tli_xd_node *topology = part_of(r->x, node, "Topology", 0);
    const tli_xd_node *geometry = part_of(r->x, node, "Geometry", 0);
    if (!topology || !geometry) return tli_xd_fail(r->x, node, "has no topology or no geometry");
    r->grid_node = node;
    bool block = strstr(topology_type(topology), "Mesh") != NULL ||
                 strstr(topology_type(topology), "MESH") != NULL;
    tl_status st = block ? make_block(r, topology) : TL_OK;
    if (!st) st = read_geometry(r, geometry);
    if (!st && !block) st = read_cells(r, topology);
    return st ? st : read_attributes(r);
}

/* A grid or all of a collection, as blocks with names where there are several. */
static tl_status read_grid(reader *r, const tli_xd_node *node, bool as_block, int depth)
{
    tl_status st = TL_OK;
    const tli_xd_node *child = NULL;
    if (depth > 16) return tli_xd_fail(r->x, node, "stands in too many collections");
    if (is_collection(node)) {
        while (!st && (child = tli_xd_child(node, "Grid", child)))
            st = read_grid(r, child, true, depth + 1);
        return st;
    }
    tli_grid part, *whole = r->grid;
    tli_grid_init(r->x->ctx, &part);
    r->grid = &part;
    st = read_uniform(r, node);
    r->grid = whole;
    const tli_join how = {as_block, ++r->blocks, tli_xd_value(node, "Name", "")};
    if (!st) st = tli_grid_join(whole, &part, &how);
    tli_grid_release(&part);
    return st;
}

/* ---- steps ---- */

/* The first collection in time, or NULL: then all grids together are one step. */
static const tli_xd_node *find_series(const tli_xdmf *x)
{
    const tli_xd_node *domain = tli_xd_child(x->root, "Domain", NULL), *grid = NULL;
    while (domain && (grid = tli_xd_child(domain, "Grid", grid)))
        if (is_temporal(grid)) return grid;
    return NULL;
}

static const tli_xd_node *step_node(const tli_xd_node *series, size_t step)
{
    const tli_xd_node *grid = tli_xd_child(series, "Grid", NULL);
    while (grid && step--) grid = tli_xd_child(series, "Grid", grid);
    return grid;
}

/* Times of a collection: each grid's own, or a list or start and step of all. */
static tl_status read_times(tli_xdmf *x, const tli_xd_node *series, tl_steps *steps)
{
    tl_status st = TL_OK;
    const tli_xd_node *time = tli_xd_child(series, "Time", NULL), *grid = NULL;
    const tli_xd_node *item = time ? tli_xd_child(time, "DataItem", NULL) : NULL;
    if (item) {
        double *values;
        uint64_t count;
        st = item_reals(x, item, &count, &values);
        bool slab = tli_xd_same(tli_xd_value(time, "TimeType", "List"), "HyperSlab");
        for (size_t i = 0; i < steps->count && !st; i++) {
            if (slab && count >= 2) steps->times[i] = values[0] + (double)i * values[1];
            if (!slab && i < count) steps->times[i] = values[i];
        }
        tl_mem_free(x->ctx, values);
    }
    for (size_t i = 0; !st && (grid = tli_xd_child(series, "Grid", grid)); i++)
        st = tli_xd_real(x, tli_xd_child(grid, "Time", NULL), "Value", &steps->times[i]);
    return st;
}

static const char *item_text(const tli_xd_node *part)
{
    const tli_xd_node *item = part ? tli_xd_child(part, "DataItem", NULL) : NULL;
    return item && item->text ? item->text : "";
}

/* Steps that name the same arrays have the same mesh; of others it is not known. */
static void compare_steps(const tli_xdmf *x, const tli_xd_node *series, tl_steps *steps)
{
    const tli_xd_node *first = tli_xd_child(series, "Grid", NULL), *grid = first;
    steps->mesh = TL_STEPS_STATIC;
    while (grid && (grid = tli_xd_child(series, "Grid", grid))) {
        const char *a = item_text(part_of(x, first, "Topology", 0));
        const char *b = item_text(part_of(x, grid, "Topology", 0));
        if (is_collection(grid) || strcmp(a, b) != 0) {
            steps->mesh = TL_STEPS_CHANGING;
            return;
        }
        a = item_text(part_of(x, first, "Geometry", 0));
        b = item_text(part_of(x, grid, "Geometry", 0));
        if (strcmp(a, b) != 0) steps->mesh = TL_STEPS_MOVING;
    }
}

static tl_status list_steps(tli_xdmf *x, const tli_xd_node *series, tl_steps *steps)
{
    size_t count = 0;
    const tli_xd_node *grid = NULL;
    while (series && (grid = tli_xd_child(series, "Grid", grid))) count++;
    if (series && !count) return tli_xd_fail(x, series, "has no steps");
    tl_status st = tli_steps_alloc(x->ctx, count ? count : 1, steps);
    return st || !series ? st : read_times(x, series, steps);
}

/* ---- doors ---- */

tl_status tli_steps_xdmf(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                         tl_steps *steps)
{
    tli_xdmf x;
    (void)opts;
    tl_status st = tli_xd_open(ctx, source, &x);
    const tli_xd_node *series = st ? NULL : find_series(&x);
    if (!st) st = list_steps(&x, series, steps);
    if (!st && series) compare_steps(&x, series, steps);
    tli_xd_close(&x);
    return st;
}

tl_status tli_read_xdmf(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                        tli_grid *grid)
{
    tli_xdmf x;
    tl_steps steps = {0};
    size_t step = 0;
    tl_status st = tli_xd_open(ctx, source, &x);
    const tli_xd_node *series = st ? NULL : find_series(&x);
    reader r = {.x = &x, .grid = grid};
    if (!st) st = list_steps(&x, series, &steps);
    if (!st) st = tli_steps_pick(ctx, opts, steps.times, steps.count, &step);
    const tli_xd_node *domain = st ? NULL : tli_xd_child(x.root, "Domain", NULL), *node = NULL;
    if (!st && !domain) st = tli_xd_fail(&x, x.root, "has no domain");
    if (!st && series) {
        st = read_grid(&r, step_node(series, step), false, 0);
        if (!st) grid->time = steps.times[step];
    } else if (!st) {
        const tli_xd_node *first = tli_xd_child(domain, "Grid", NULL);
        bool several = first && tli_xd_child(domain, "Grid", first);
        if (!first) st = tli_xd_fail(&x, domain, "has no grid");
        while (!st && (node = tli_xd_child(domain, "Grid", node)))
            st = read_grid(&r, node, several, 0);
        const tli_xd_node *time = first ? tli_xd_child(first, "Time", NULL) : NULL;
        if (!st) st = tli_xd_real(&x, time, "Value", &grid->time);
    }
    tl_steps_release(ctx, &steps);
    tli_xd_close(&x);
    return st;
}
