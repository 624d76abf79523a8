/* Legacy VTK files (.vtk), versions 1.0 to 5.1, ASCII and BINARY: what their geometry is.
 * Vtk File Formats, Kitware; and what VTK's own writers of 30 years have put into such files.
 *
 * The parts of the reader share the cursor of formats_legacy.h: formats_legacy_scan.c reads words
 * and numbers, formats_legacy_cells.c cells, formats_legacy_data.c attributes and fields. */
#include "formats/formats_legacy.h"
#include "formats/formats_number.h"

#include <inttypes.h>
#include <string.h>

#define HEADER "# vtk DataFile Version"
#define VTK_POLY_VERTEX 2
#define VTK_POLY_LINE 4
#define VTK_TRIANGLE_STRIP 6
#define VTK_POLYGON 7

/* An image says nothing of its points but their number. So many may stand in a file of any size;
 * more only if the file could hold a bit for each. */
#define FREE_POINTS ((uint64_t)1 << 20)

/* ---- geometry ---- */

static tl_status read_dataset(tli_legacy *reader, const tli_legacy_word *keyword, int arg)
{
    static const struct {
        const char *name;
        tli_legacy_kind kind;
    } kinds[] = {{"STRUCTURED_POINTS", TLI_LEGACY_IMAGE},
                 {"IMAGE_DATA", TLI_LEGACY_IMAGE},
                 {"STRUCTURED_GRID", TLI_LEGACY_STRUCTURED},
                 {"RECTILINEAR_GRID", TLI_LEGACY_RECTILINEAR},
                 {"UNSTRUCTURED_GRID", TLI_LEGACY_UNSTRUCTURED},
                 {"POLYDATA", TLI_LEGACY_POLYDATA}};
    (void)keyword, (void)arg;
    tli_legacy_word word;
    if (!tli_legacy_next(reader, &word)) return tli_legacy_expected(reader, "a kind of data set");
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        if (tli_legacy_is(&word, kinds[i].name)) {
            reader->kind = kinds[i].kind;
            return TL_OK;
        }
    }
    if (tli_legacy_is(&word, "FIELD")) return TL_OK; /* a data object: its fields alone */
    return tli_legacy_fail(reader, word.text, TL_ERR_UNSUPPORTED,
                           "data set of kind '%.*s', expected a grid or POLYDATA",
                           (int)(word.length < 40 ? word.length : 40), word.text);
}

static tl_status repeated(const tli_legacy *reader, const tli_legacy_word *keyword)
{
    return tli_legacy_fail(reader, keyword->text, TL_ERR_FORMAT, "%.*s stands here again",
                           (int)keyword->length, keyword->text);
}

static tl_status read_points(tli_legacy *reader, const tli_legacy_word *keyword, int arg)
{
    (void)arg;
    uint64_t count = 0;
    const tli_legacy_type *type = NULL;
    if (reader->has_points) return repeated(reader, keyword);
    tl_status st = tli_legacy_read_count(reader, "the number of points", &count);
    if (!st) st = tli_legacy_read_type(reader, &type);
    if (!st)
        st = reader->places
                 ? tli_legacy_locate(reader, "POINTS", type, count, 3, &reader->places->points)
                 : tli_legacy_read_numbers(reader, "POINTS", type, count, 3, &reader->grid->xyz);
    if (!st && count > TL_MESH_VERTS_MAX)
        st =
            tli_legacy_fail(reader, keyword->text, TL_ERR_UNSUPPORTED,
                            "%" PRIu64 " points, at most %u can be held", count, TL_MESH_VERTS_MAX);
    if (!st) reader->grid->point_count = count;
    reader->has_points = true;
    reader->components = 3;
    return st;
}

static tl_status read_cells(tli_legacy *reader, const tli_legacy_word *keyword, int cell_type)
{
    if (!cell_type && reader->has_cells) return repeated(reader, keyword);
    reader->has_cells = true;
    reader->cells_at = keyword->text;
    return tli_legacy_read_cells(reader, keyword->text, cell_type);
}

static tl_status read_cell_types(tli_legacy *reader, const tli_legacy_word *keyword, int arg)
{
    (void)arg;
    if (reader->has_types) return repeated(reader, keyword);
    reader->has_types = true;
    return tli_legacy_read_cell_types(reader);
}

/* DIMENSIONS: three counts. */
static tl_status read_dims(tli_legacy *reader, const tli_legacy_word *keyword, int arg)
{
    (void)arg;
    tl_status st = TL_OK;
    if (reader->has_dims) return repeated(reader, keyword);
    for (int axis = 0; !st && axis < 3; axis++)
        st = tli_legacy_read_count(reader, "a dimension", &reader->dims[axis]);
    reader->has_dims = true;
    return st;
}

/* EXTENT: first and last index along three axes. */
static tl_status read_extent(tli_legacy *reader, const tli_legacy_word *keyword, int arg)
{
    (void)arg;
    tl_status st = TL_OK;
    if (reader->has_dims) return repeated(reader, keyword);
    for (int axis = 0; !st && axis < 3; axis++) {
        int64_t first = 0, last = 0;
        st = tli_legacy_read_int(reader, "the first index of an extent", &first);
        if (!st) st = tli_legacy_read_int(reader, "the last index of an extent", &last);
        if (!st && (first < INT32_MIN || last > INT32_MAX || last < first - 1))
            st = tli_legacy_fail(reader, keyword->text, TL_ERR_FORMAT,
                                 "extent from %" PRId64 " to %" PRId64, first, last);
        if (st) break;
        reader->first_index[axis] = first;
        reader->dims[axis] = (uint64_t)(last - first + 1);
    }
    reader->has_dims = true;
    return st;
}

static tl_status read_origin(tli_legacy *reader, const tli_legacy_word *keyword, int arg)
{
    (void)keyword;
    double *values = arg ? reader->spacing : reader->origin;
    tl_status st = TL_OK;
    for (int axis = 0; !st && axis < 3; axis++)
        st = tli_legacy_read_real(reader, "a real number", &values[axis]);
    return st;
}

static tl_status read_axis(tli_legacy *reader, const tli_legacy_word *keyword, int axis)
{
    const tli_legacy_type *type = NULL;
    if (reader->axes[axis]) return repeated(reader, keyword);
    tl_status st =
        tli_legacy_read_count(reader, "a number of coordinates", &reader->axis_counts[axis]);
    if (!st) st = tli_legacy_read_type(reader, &type);
    reader->components = 1;
    return st ? st
              : tli_legacy_read_numbers(reader, "coordinates", type, reader->axis_counts[axis], 1,
                                        &reader->axes[axis]);
}

/* BLANKING: 0 for points that are missing. */
static tl_status read_blanking(tli_legacy *reader, const tli_legacy_word *keyword, int arg)
{
    (void)arg;
    const tli_legacy_type *type = NULL;
    double *values = NULL;
    if (reader->places) return TL_ERR_UNSUPPORTED; /* as a whole */
    if (reader->grid->blanks) return repeated(reader, keyword);
    tl_status st = tli_legacy_read_count(reader, "the number of points", &reader->blank_count);
    if (!st) st = tli_legacy_read_type(reader, &type);
    if (!st)
        st = tli_legacy_read_numbers(reader, "BLANKING", type, reader->blank_count, 1, &values);
    uint8_t *blanks = tl_mem_alloc(reader->ctx, reader->blank_count, 1, &st);
    for (uint64_t i = 0; !st && i < reader->blank_count; i++) blanks[i] = values[i] != 0;
    tl_mem_free(reader->ctx, values);
    if (!st) reader->grid->blanks = blanks;
    return st;
}

/* ---- all geometry is there ---- */

/* Number of points of dims, with a check of what a mesh can hold. */
static tl_status structured_points(tli_legacy *reader, uint64_t *count)
{
    const uint64_t *dims = reader->dims;
    *count = 1;
    for (int axis = 0; axis < 3; axis++) {
        if (dims[axis] > TL_MESH_VERTS_MAX || (*count *= dims[axis]) > TL_MESH_VERTS_MAX)
            return tli_legacy_fail(reader, reader->at, TL_ERR_UNSUPPORTED,
                                   "%" PRIu64 " x %" PRIu64 " x %" PRIu64
                                   " points, at most %u can be held",
                                   dims[0], dims[1], dims[2], TL_MESH_VERTS_MAX);
    }
    return TL_OK;
}

/* What was read on its own must agree with the dimensions. */
static tl_status check_structured(const tli_legacy *reader, uint64_t count)
{
    if (reader->kind == TLI_LEGACY_STRUCTURED && reader->grid->point_count != count)
        return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                               "%" PRIu64 " points, expected %" PRIu64 " by the dimensions",
                               reader->grid->point_count, count);
    for (int axis = 0; reader->kind == TLI_LEGACY_RECTILINEAR && axis < 3; axis++)
        if (reader->axis_counts[axis] != reader->dims[axis])
            return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                                   "%" PRIu64 " coordinates along %c, expected %" PRIu64
                                   " by the dimensions",
                                   reader->axis_counts[axis], "xyz"[axis], reader -> dims[axis]);
    if (reader->grid->blanks && reader->blank_count != count)
        return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                               "BLANKING of %" PRIu64 " points, expected %" PRIu64,
                               reader->blank_count, count);
    uint64_t bits = (uint64_t)(reader->end - reader->begin) * 8;
    if (count > FREE_POINTS && count > bits)
        return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                               "%" PRIu64 " points by the dimensions, but the file has %" PRIu64
                               " bytes",
                               count, bits / 8);
    return TL_OK;
}

static tl_status close_structured(tli_legacy *reader)
{
    tli_grid *grid = reader->grid;
    uint64_t count = 0;
    if (!reader->has_dims) return tli_legacy_expected(reader, "DIMENSIONS");
    tl_status st = structured_points(reader, &count);
    if (!st) st = check_structured(reader, count);
    if (st || !count) return st;
    grid->blocks = tl_mem_zalloc(reader->ctx, 1, sizeof *grid->blocks, &st);
    if (st) return st;
    for (int axis = 0; axis < 3; axis++) grid->blocks->dims[axis] = (uint32_t)reader->dims[axis];
    grid->block_count = 1;
    grid->point_count = count;
    return TL_OK;
}

/* Checks that the geometry is whole; from here on the counts of points and cells are known. */
static tl_status close_geometry(tli_legacy *reader)
{
    if (reader->closed) return TL_OK;
    reader->closed = true;
    switch (reader->kind) {
    case TLI_LEGACY_NONE: return TL_OK;
    case TLI_LEGACY_UNSTRUCTURED:
    case TLI_LEGACY_POLYDATA: return tli_legacy_close_cells(reader);
    default: return close_structured(reader);
    }
}

/* POINT_DATA or CELL_DATA: their count must be that of the geometry. */
static tl_status read_data_header(tli_legacy *reader, const tli_legacy_word *keyword, int on)
{
    uint64_t count;
    tl_status st = tli_legacy_read_count(reader, "the number of tuples", &count);
    if (!st) st = close_geometry(reader);
    if (st) return st;
    reader->has_data = true;
    reader->on = (tl_on)on;
    uint64_t expected =
        on == TL_ON_VERTEX ? reader->grid->point_count : tli_grid_cell_count(reader->grid);
    if (count == expected) return TL_OK;
    return tli_legacy_fail(reader, keyword->text, TL_ERR_FORMAT,
                           "%.*s of %" PRIu64 " tuples, expected %" PRIu64, (int)keyword->length,
                           keyword->text, count, expected);
}

/* x fastest. */
void tli_legacy_positions(const tli_legacy *reader, uint64_t first, uint64_t count, double *xyz)
{
    const uint64_t *dims = reader->dims;
    if (!count) return;
    uint64_t index[3] = {first % dims[0], first / dims[0] % dims[1], first / dims[0] / dims[1]};
    for (; count; count--, xyz += 3) {
        for (int axis = 0; axis < 3; axis++)
            xyz[axis] = reader->axes[axis]
                            ? reader->axes[axis][index[axis]]
                            : reader->origin[axis] +
                                  reader->spacing[axis] *
                                      (double)(reader->first_index[axis] + (int64_t)index[axis]);
        if (++index[0] < dims[0]) continue;
        index[0] = 0;
        if (++index[1] < dims[1]) continue;
        index[1] = 0;
        index[2]++;
    }
}

static tl_status fill_positions(tli_legacy *reader)
{
    tli_grid *grid = reader->grid;
    tl_status st = TL_OK;
    if (grid->xyz) return TL_OK;
    grid->xyz = tl_mem_alloc(reader->ctx, (size_t)grid->point_count * 3, sizeof *grid->xyz, &st);
    if (!st) tli_legacy_positions(reader, 0, grid->point_count, grid->xyz);
    return st;
}

/* ---- the file ---- */

/* Keywords of the geometry, and in which kinds of data sets they may stand. */
typedef tl_status (*section_fn)(tli_legacy *reader, const tli_legacy_word *keyword, int arg);
typedef struct section {
    const char *keyword;
    int kinds;
    section_fn read;
    int arg;
} section;

#define KINDS_DIMS (TLI_LEGACY_IMAGE | TLI_LEGACY_STRUCTURED | TLI_LEGACY_RECTILINEAR)
#define KINDS_POINTS (TLI_LEGACY_STRUCTURED | TLI_LEGACY_UNSTRUCTURED | TLI_LEGACY_POLYDATA)

static const section sections[] = {
    {"DATASET", TLI_LEGACY_NONE, read_dataset, 0},
    {"POINTS", KINDS_POINTS, read_points, 0},
    {"CELLS", TLI_LEGACY_UNSTRUCTURED, read_cells, 0},
    {"CELL_TYPES", TLI_LEGACY_UNSTRUCTURED, read_cell_types, 0},
    {"VERTICES", TLI_LEGACY_POLYDATA, read_cells, VTK_POLY_VERTEX},
    {"LINES", TLI_LEGACY_POLYDATA, read_cells, VTK_POLY_LINE},
    {"POLYGONS", TLI_LEGACY_POLYDATA, read_cells, VTK_POLYGON},
    {"TRIANGLE_STRIPS", TLI_LEGACY_POLYDATA, read_cells, VTK_TRIANGLE_STRIP},
    {"DIMENSIONS", KINDS_DIMS, read_dims, 0},
    {"EXTENT", KINDS_DIMS, read_extent, 0},
    {"ORIGIN", TLI_LEGACY_IMAGE, read_origin, 0},
    {"SPACING", TLI_LEGACY_IMAGE, read_origin, 1},
    {"ASPECT_RATIO", TLI_LEGACY_IMAGE, read_origin, 1},
    {"X_COORDINATES", TLI_LEGACY_RECTILINEAR, read_axis, 0},
    {"Y_COORDINATES", TLI_LEGACY_RECTILINEAR, read_axis, 1},
    {"Z_COORDINATES", TLI_LEGACY_RECTILINEAR, read_axis, 2},
    {"BLANKING", TLI_LEGACY_STRUCTURED, read_blanking, 0},
};

/* "# vtk DataFile Version 3.0", a title, ASCII or BINARY. */
static tl_status read_header(tli_legacy *reader)
{
    const size_t length = sizeof HEADER - 1;
    const tli_legacy_word start = {reader->at, length};
    double version;
    if ((size_t)(reader->end - reader->at) < length || !tli_legacy_is(&start, HEADER))
        return tli_legacy_expected(reader, "'" HEADER "'");
    reader->at += length;
    tl_status st = tli_legacy_read_real(reader, "a version", &version);
    if (st) return st;
    if (!(version >= 1 && version < 6))
        return tli_legacy_fail(reader, reader->at, TL_ERR_UNSUPPORTED,
                               "version %g, expected 1.0 to 5.1", version);
    tli_legacy_skip_line(reader);
    tli_legacy_skip_line(reader);
    if (tli_legacy_take(reader, "BINARY"))
        reader->binary = true;
    else if (!tli_legacy_take(reader, "ASCII"))
        return tli_legacy_expected(reader, "ASCII or BINARY");
    return TL_OK;
}

static tl_status read_section(tli_legacy *reader, const tli_legacy_word *keyword)
{
    bool known;
    if (tli_legacy_is(keyword, "POINT_DATA"))
        return read_data_header(reader, keyword, TL_ON_VERTEX);
    if (tli_legacy_is(keyword, "CELL_DATA")) return read_data_header(reader, keyword, TL_ON_TET);
    if (tli_legacy_is(keyword, "METADATA")) {
        tli_legacy_skip_metadata(reader);
        return TL_OK;
    }
    tl_status st = tli_legacy_read_attribute(reader, keyword, &known);
    if (known) return st;
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++) {
        if (!tli_legacy_is(keyword, sections[i].keyword)) continue;
        if (!(sections[i].kinds & (int)reader->kind) || reader->closed)
            return tli_legacy_fail(reader, keyword->text, TL_ERR_FORMAT, "%s can't stand here",
                                   sections[i].keyword);
        return sections[i].read(reader, keyword, sections[i].arg);
    }
    reader->at = keyword->text;
    return tli_legacy_expected(reader, "a keyword");
}

void tli_legacy_begin(tl_ctx *ctx, const tli_map *map, const char *path, tli_grid *grid,
                      tli_legacy *reader)
{
    const char *text = (const char *)map->bytes;
    *reader = (tli_legacy){.ctx = ctx,
                           .path = path,
                           .begin = text,
                           .at = text,
                           .end = text + map->byte_count,
                           .grid = grid,
                           .kind = TLI_LEGACY_NONE,
                           .spacing = {1, 1, 1},
                           .cells_at = text,
                           .components = 1};
}

tl_status tli_legacy_read_file(tli_legacy *reader)
{
    tli_legacy_word keyword;
    tl_status st = read_header(reader);
    if (!st && reader->places && !reader->binary) return TL_ERR_UNSUPPORTED; /* as a whole */
    const char *body = reader->at;
    while (!st && tli_legacy_next(reader, &keyword)) st = read_section(reader, &keyword);
    if (!st && tli_number_skip_space(body, reader->end) == reader->end)
        st = tli_legacy_expected(reader, "DATASET");
    if (!st) st = close_geometry(reader);
    if (!st && reader->skipped_fields)
        tl_log(reader->ctx, TL_LOG_INFO, "'%s': %u arrays of the data set as a whole are left out",
               reader->path, reader->skipped_fields);
    return st;
}

void tli_legacy_end(tli_legacy *reader)
{
    for (int axis = 0; axis < 3; axis++) tl_mem_free(reader->ctx, reader->axes[axis]);
}

tl_status tli_read_vtk_legacy(tl_ctx *ctx, const tli_map *map, const char *path, tli_grid *grid)
{
    tli_legacy reader;
    tli_legacy_begin(ctx, map, path, grid, &reader);
    tl_status st = tli_legacy_read_file(&reader);
    if (!st) st = fill_positions(&reader);
    tli_legacy_end(&reader);
    return st;
}
