/* TetGen and Triangle: points in NAME.node, cells in NAME.ele, boundary faces in NAME.face, any of
 * which names the mesh (wias-berlin.de/software/tetgen, File formats). Each file begins with its
 * counts; the index of the first point, 0 or 1, is that of all. Also the variant of Chaste whose
 * first lines end in BIN: records then are int32 and float64 without their index. The first
 * attribute of the cells, where it holds whole numbers, is their region. */
#include "formats/formats_label.h"
#include "formats/formats_reader.h"
#include "formats/formats_scan.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define ATTRIBUTES_MAX 4096
#define VTK_TRIANGLE 5
#define VTK_QUADRATIC_TRIANGLE 22
#define VTK_QUADRATIC_TETRA 24
#define NODES_MAX 10 /* of a cell */

typedef struct part {
    char *path;
    tli_map map;
    tli_scan scan;
    bool is_there, binary;
    int64_t count;
} part;

typedef struct tetgen {
    tl_ctx *ctx;
    tli_grid *grid;
    part nodes, cells, faces;
    int64_t base; /* index of the first point */
} tetgen;

/* ---- parts ---- */

static tl_status open_part(tetgen *t, const tli_source *source, const char *ending, part *p)
{
    tl_status st = TL_OK;
    const char *dot = strrchr(source->path, '.');
    st = tli_path_with_ending(t->ctx, source->path, dot ? strlen(dot) : 0, ending, &p->path);
    if (st) return st;
    p->is_there = tli_path_ends(source->path, ending);
    if (p->is_there)
        p->map = (tli_map){.bytes = source->map.bytes, .byte_count = source->map.byte_count};
    else if ((p->is_there = tli_file_exists(p->path)))
        st = tli_map_open(t->ctx, p->path, &p->map);
    if (st || !p->is_there) return st;
    tli_scan_open(t->ctx, p->path, p->map.bytes, p->map.byte_count, &p->scan);
    p->scan.comment = '#';
    return TL_OK;
}

static void close_part(tl_ctx *ctx, const tli_source *source, part *p)
{
    if (p->map.bytes != source->map.bytes) tli_map_close(ctx, &p->map);
    tl_mem_free(ctx, p->path);
}

/* The first line: its numbers, of which trailing ones may be missing, and BIN. */
static tl_status read_head(part *p, int64_t *numbers, int number_count)
{
    tli_span line, word;
    if (tli_scan_at_end(&p->scan)) return tli_scan_fail(&p->scan, "expected a line of counts");
    const char *start = p->scan.at;
    tli_scan_line(&p->scan, &line);
    tli_scan head;
    tli_scan_open(p->scan.ctx, p->path, p->scan.begin,
                  (uint64_t)(line.text - p->scan.begin) + line.bytes, &head);
    head.at = start;
    head.comment = '#';
    for (int i = 0; i < number_count && !tli_scan_at_end(&head); i++) {
        if (*head.at == 'B') break;
        tl_status st = tli_scan_int(&head, "a count", 0, UINT32_MAX, &numbers[i]);
        if (st) return st;
    }
    p->binary = tli_scan_word(&head, &word) && tli_span_is(word, "BIN");
    p->scan.binary = p->binary;
    p->count = numbers[0];
    return TL_OK;
}

/* Refuses counts that the file can't hold. */
static tl_status check_room(const part *p, const char *what, uint64_t ints, uint64_t reals)
{
    uint64_t bytes = p->binary ? 4 * ints + 8 * reals : 2 * (1 + ints + reals);
    return tli_scan_room(&p->scan, what, (uint64_t)p->count, bytes);
}

/* The index that a record of a text begins with. */
static tl_status skip_index(part *p)
{
    int64_t index;
    return p->binary ? TL_OK : tli_scan_int(&p->scan, "an index", INT64_MIN, INT64_MAX, &index);
}

static tl_status read_reals(part *p, const char *what, uint64_t count, double *values)
{
    if (p->binary) return tli_scan_binary_reals(&p->scan, what, TL_F64, count, values);
    return tli_scan_reals(&p->scan, what, count, values);
}

/* Indices of points, from 0 on. */
static tl_status read_points_of(tetgen *t, part *p, uint64_t count, uint32_t *points)
{
    const int64_t last = (int64_t)t->grid->point_count - 1 + t->base;
    tl_status st = TL_OK;
    for (uint64_t i = 0; !st && i < count; i++) {
        int64_t index = t->base;
        st = p->binary ? tli_scan_binary_int(&p->scan, "a point", 4, t->base, last, &index)
                       : tli_scan_int(&p->scan, "a point", t->base, last, &index);
        points[i] = (uint32_t)(index - t->base);
    }
    return st;
}

/* ---- points ---- */

/* A marker is a whole number; meshio writes it as a real one. */
static tl_status take_marker(tli_scan *scan, int64_t *marker)
{
    double value = 0;
    const char *at = scan->at;
    tl_status st = tli_scan_real(scan, "a marker", &value);
    if (st) return st;
    if (!tl_scalar_holds(TL_I32, value)) {
        scan->at = at;
        return tli_scan_int(scan, "a marker", INT32_MIN, INT32_MAX, marker);
    }
    *marker = (int64_t)value;
    return TL_OK;
}

/* Arrays attribute1 ... and, of points, marker. Gives their values through arrays. */
static tl_status add_attributes(tetgen *t, tl_on on, int64_t first, int64_t count)
{
    tl_status st = TL_OK;
    for (int64_t i = first; !st && i < count; i++) {
        char name[40];
        snprintf(name, sizeof name, "attribute%" PRId64, i + 1);
        st = tli_grid_add(t->grid, on, name, 1, TL_F64, NULL, NULL);
    }
    return st;
}

static tl_status read_nodes(tetgen *t)
{
    part *p = &t->nodes;
    tli_grid *grid = t->grid;
    int64_t head[4] = {0, 3, 0, 0}, index = 0, marker = 0; /* points, axes, attributes, markers */
    tl_status st = read_head(p, head, 4);
    if (!st && (head[1] < 2 || head[1] > 3 || head[2] > ATTRIBUTES_MAX || head[3] > 1))
        st = tl_fail(t->ctx, TL_ERR_FORMAT,
                     "'%s': %" PRId64 " axes, %" PRId64 " attributes, %" PRId64
                     " markers; expected 2 or 3, at most %d, 0 or 1",
                     p->path, head[1], head[2], head[3], ATTRIBUTES_MAX);
    const uint64_t axes = (uint64_t)head[1], attributes = (uint64_t)head[2];
    if (!st && p->binary && head[3])
        st = tl_fail(t->ctx, TL_ERR_UNSUPPORTED, "'%s': markers in binary", p->path);
    if (!st) st = check_room(p, "points", (uint64_t)head[3], axes + attributes);
    if (st) return st;
    grid->point_count = (uint64_t)p->count;
    grid->xyz = tl_mem_zalloc(t->ctx, (size_t)p->count, 3 * sizeof *grid->xyz, &st);
    if (!st) st = add_attributes(t, TL_ON_VERTEX, 0, head[2]);
    if (!st && head[3]) st = tli_grid_add(grid, TL_ON_VERTEX, "marker", 1, TL_I32, NULL, NULL);
    for (uint64_t i = 0; !st && i < grid->point_count; i++) {
        if (!p->binary) st = tli_scan_int(&p->scan, "an index", INT32_MIN, UINT32_MAX, &index);
        if (i == 0) t->base = index;
        if (!st) st = read_reals(p, "a coordinate", axes, grid->xyz + 3 * i);
        for (uint64_t a = 0; !st && a < attributes; a++)
            st = read_reals(p, "an attribute", 1, &grid->point_arrays[a].values[i]);
        if (!st && head[3]) {
            st = take_marker(&p->scan, &marker);
            grid->point_arrays[attributes].values[i] = (double)marker;
        }
    }
    if (!st && t->base != 0 && t->base != 1)
        st = tl_fail(t->ctx, TL_ERR_FORMAT,
                     "'%s': the first point has index %" PRId64 ", expected 0 or 1", p->path,
                     t->base);
    return st;
}

/* ---- cells ---- */

static uint8_t cell_type(int64_t nodes)
{
    switch (nodes) {
    case 3: return VTK_TRIANGLE;
    case 4: return 10; /* tetrahedron */
    case 6: return VTK_QUADRATIC_TRIANGLE;
    case 10: return VTK_QUADRATIC_TETRA;
    default: return 0;
    }
}

/* The first attribute becomes the regions, or an array like the others where it can't. */
static tl_status take_regions(tetgen *t)
{
    tli_grid *grid = t->grid;
    tl_status st = TL_OK;
    if (grid->cell_array_count == 0) return TL_OK;
    const double *values = grid->cell_arrays[0].values;
    for (uint64_t i = 0; i < grid->cell_count; i++)
        if (!tl_scalar_holds(TL_I32, values[i])) return TL_OK;
    grid->regions = tl_mem_alloc(t->ctx, (size_t)grid->cell_count, sizeof *grid->regions, &st);
    for (uint64_t i = 0; !st && i < grid->cell_count; i++) grid->regions[i] = (int32_t)values[i];
    if (!st) tli_grid_drop_array(grid, TL_ON_TET, 0);
    return st;
}

static tl_status read_cells(tetgen *t)
{
    part *p = &t->cells;
    tli_grid *grid = t->grid;
    int64_t head[3] = {0, 4, 0}; /* cells, nodes, attributes */
    tl_status st = read_head(p, head, 3);
    const uint8_t type = cell_type(head[1]);
    const uint64_t nodes = (uint64_t)head[1], attributes = (uint64_t)head[2];
    if (!st && (type == 0 || head[2] > ATTRIBUTES_MAX))
        st = tl_fail(t->ctx, TL_ERR_FORMAT,
                     "'%s': cells of %" PRId64 " points and %" PRId64
                     " attributes, expected 3, 4, 6 or 10 and at most %d",
                     p->path, head[1], head[2], ATTRIBUTES_MAX);
    if (!st) st = check_room(p, "cells", nodes, attributes);
    if (st) return st;
    const uint64_t count = grid->cell_count = (uint64_t)p->count;
    grid->types = tl_mem_alloc(t->ctx, (size_t)count, 1, &st);
    grid->offsets = tl_mem_alloc(t->ctx, (size_t)count + 1, sizeof *grid->offsets, &st);
    grid->connectivity =
        tl_mem_alloc(t->ctx, (size_t)(count * nodes), sizeof *grid->connectivity, &st);
    if (!st) st = add_attributes(t, TL_ON_TET, 0, head[2]);
    if (st) return st;
    grid->offsets[0] = 0;
    for (uint64_t i = 0; !st && i < count; i++) {
        grid->types[i] = type;
        grid->offsets[i + 1] = (i + 1) * nodes;
        st = skip_index(p);
        if (!st) st = read_points_of(t, p, nodes, grid->connectivity + i * nodes);
        for (uint64_t a = 0; !st && a < attributes; a++)
            st = read_reals(p, "an attribute", 1, &grid->cell_arrays[a].values[i]);
    }
    return st ? st : take_regions(t);
}

/* ---- faces ---- */

/* Faces with a marker other than 0 are labels. */
static tl_status read_faces(tetgen *t)
{
    part *p = &t->faces;
    int64_t head[2] = {0, 0}; /* faces, markers */
    tl_status st = read_head(p, head, 2);
    if (!st && head[1] > 1)
        st = tl_fail(t->ctx, TL_ERR_FORMAT, "'%s': %" PRId64 " markers a face, expected 0 or 1",
                     p->path, head[1]);
    if (!st) st = check_room(p, "faces", 3, (uint64_t)head[1]);
    if (st || head[1] == 0) return st;
    tli_faces faces;
    tli_faces_init(t->ctx, &faces);
    for (int64_t i = 0; !st && i < p->count; i++) {
        uint32_t points[3];
        double marker = 0;
        st = skip_index(p);
        if (!st) st = read_points_of(t, p, 3, points);
        if (!st) st = read_reals(p, "a marker", 1, &marker);
        if (!st && !tl_scalar_holds(TL_I32, marker))
            st = tli_scan_fail(&p->scan, "marker %g, expected a whole number", marker);
        if (!st && marker != 0) st = tli_faces_add(&faces, (int32_t)marker, points, 3);
    }
    if (!st) st = tli_faces_to_labels(&faces, t->grid, NULL, NULL);
    tli_faces_release(&faces);
    return st;
}

/* ---- reader ---- */

tli_match tli_match_tetgen(const tli_source *source)
{
    return !source->folder && tli_ends_in(source->path, ".node .ele .face") ? TLI_MATCH_NAME
                                                                            : TLI_MATCH_NO;
}

tl_status tli_read_tetgen(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                          tli_grid *grid)
{
    tetgen t = {.ctx = ctx, .grid = grid};
    (void)opts;
    tl_status st = open_part(&t, source, ".node", &t.nodes);
    if (!st) st = open_part(&t, source, ".ele", &t.cells);
    if (!st) st = open_part(&t, source, ".face", &t.faces);
    if (!st && !t.nodes.is_there)
        st = tl_fail(ctx, TL_ERR_IO, "'%s': there is no '%s' with its points", source->path,
                     t.nodes.path);
    if (!st && !t.cells.is_there)
        tl_log(ctx, TL_LOG_INFO, "'%s': there is no '%s', so there are no cells", source->path,
               t.cells.path);
    if (!st) st = read_nodes(&t);
    if (!st && t.cells.is_there) st = read_cells(&t);
    if (!st && t.faces.is_there) st = read_faces(&t);
    close_part(ctx, source, &t.faces);
    close_part(ctx, source, &t.cells);
    close_part(ctx, source, &t.nodes);
    return st;
}
