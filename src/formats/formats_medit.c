/* Medit meshes, .mesh (text) and .meshb (binary), versions 1 to 4: sections of a keyword, a number
 * of records and the records, each of which ends in a reference (Frey: Medit, INRIA RT-0253, 2001;
 * the binary form is that of libMeshb: int32 keyword and the place of the next one before each
 * section). References of volume cells are regions, those of surface cells labels. */
#include "formats/formats_medit.h"

#include "formats/formats_cells.h"
#include "formats/formats_label.h"
#include "formats/formats_reader.h"

#include <inttypes.h>
#include <string.h>

#define VERSION_MAX 4
#define KEY_DIMENSION 3
#define KEY_END 54

/* Keywords that are read: names, codes of the binary form, cells. */
typedef struct keyword {
    const char *name;
    int code;
    uint8_t type, nodes; /* of VTK; 0: no cells */
} keyword;
static const keyword keywords[] = {
    {"Vertices", 4, 0, 0},
    {"Edges", 5, TLI_VTK_LINE, 2},
    {"Triangles", 6, TLI_VTK_TRIANGLE, 3},
    {"Quadrilaterals", 7, TLI_VTK_QUAD, 4},
    {"Tetrahedra", 8, 10, 4},
    {"Prisms", 9, TLI_VTK_WEDGE, 6},
    {"Pentahedra", 9, TLI_VTK_WEDGE, 6},
    {"Hexahedra", 10, TLI_VTK_HEXAHEDRON, 8},
    {"Hexaedra", 10, TLI_VTK_HEXAHEDRON, 8},
    {"Pyramids", 49, TLI_VTK_PYRAMID, 5},
    {"EdgesP2", 25, TLI_VTK_QUADRATIC_EDGE, 3},
    {"TrianglesP2", 24, TLI_VTK_QUADRATIC_TRIANGLE, 6},
    {"TetrahedraP2", 30, TLI_VTK_QUADRATIC_TETRA, 10},
    {"SolAtVertices", 62, 0, 0},
    {"End", KEY_END, 0, 0},
};

/* ---- sections ---- */

tl_status tli_medit_open(tl_ctx *ctx, const char *path, const tli_map *map, tli_medit *medit)
{
    tli_span word = {0};
    *medit = (tli_medit){.dimension = 3};
    tli_scan *scan = &medit->scan;
    tli_scan_open(ctx, path, map->bytes, map->byte_count, scan);
    for (int big = 0; map->byte_count >= 8 && big < 2; big++) {
        if (tli_int_at(map->bytes, 4, big) != 1) continue;
        scan->binary = true;
        scan->big_endian = big;
        scan->at += 4;
        tl_status st = tli_scan_binary_int(scan, "the version", 4, 1, VERSION_MAX, &medit->version);
        medit->int_bytes = medit->version < 4 ? 4 : 8;
        medit->real_bytes = medit->version < 2 ? 4 : 8;
        medit->place_bytes = medit->version < 3 ? 4 : 8;
        return st;
    }
    scan->comment = '#';
    if (!tli_scan_word(scan, &word) || !tli_span_is(word, "MeshVersionFormatted"))
        return tli_scan_fail(scan, "expected MeshVersionFormatted, or the binary form");
    return tli_scan_int(scan, "the version", 0, VERSION_MAX, &medit->version);
}

tl_status tli_medit_int(tli_medit *medit, const char *what, int64_t low, int64_t high,
                        int64_t *value)
{
    if (medit->scan.binary)
        return tli_scan_binary_int(&medit->scan, what, medit->int_bytes, low, high, value);
    return tli_scan_int(&medit->scan, what, low, high, value);
}

tl_status tli_medit_real(tli_medit *medit, const char *what, double *value)
{
    if (medit->scan.binary)
        return tli_scan_binary_reals(&medit->scan, what, medit->real_bytes == 4 ? TL_F32 : TL_F64,
                                     1, value);
    return tli_scan_real(&medit->scan, what, value);
}

tl_status tli_medit_count(tli_medit *medit, const char *what, uint64_t ints, uint64_t reals,
                          uint64_t *count)
{
    int64_t value = 0;
    uint64_t bytes = medit->scan.binary ? ints * medit->int_bytes + reals * medit->real_bytes
                                        : 2 * (ints + reals);
    tl_status st = tli_medit_int(medit, "a number of records", 0, UINT32_MAX, &value);
    if (!st) st = tli_scan_room(&medit->scan, what, (uint64_t)value, bytes);
    if (!st) *count = (uint64_t)value;
    return st;
}

static tl_status next_binary(tli_medit *medit, tli_medit_section *section, bool *more)
{
    int64_t code = 0, next = 0;
    tli_scan *scan = &medit->scan;
    const char *start = scan->at;
    tl_status st = tli_scan_binary_int(scan, "a keyword", 4, 0, INT32_MAX, &code);
    if (!st && code == KEY_END) {
        *more = false;
        return TL_OK;
    }
    if (!st)
        st = tli_scan_binary_int(scan, "the place of the next keyword", medit->place_bytes, 0,
                                 (int64_t)(scan->end - scan->begin), &next);
    if (!st && next != 0 && next < scan->at - scan->begin) {
        scan->at = start;
        st = tli_scan_fail(scan, "the next keyword at %" PRId64 " stands before this one", next);
    }
    section->next = (uint64_t)next;
    section->name[0] = '\0';
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++)
        if (keywords[i].code == code && !section->name[0]) strcpy(section->name, keywords[i].name);
    if (!st && code == KEY_DIMENSION)
        st = tli_scan_binary_int(scan, "the dimension", 4, 2, 3, &medit->dimension);
    return st;
}

static bool is_letter(char c)
{
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

/* Words up to one that begins with a capital letter and is no number. */
static bool find_keyword(tli_scan *scan, tli_span *word)
{
    while (tli_scan_word(scan, word))
        if (is_letter(word->text[0]) && !tli_span_is(*word, "nan") && !tli_span_is(*word, "inf"))
            return true;
    return false;
}

tl_status tli_medit_next(tli_medit *medit, tli_medit_section *section, bool *more)
{
    tli_span word;
    *section = (tli_medit_section){0};
    *more = true;
    if (medit->scan.binary) {
        *more = medit->scan.at < medit->scan.end;
        return *more ? next_binary(medit, section, more) : TL_OK;
    }
    *more = find_keyword(&medit->scan, &word) && !tli_span_is(word, "End");
    if (!*more) return TL_OK;
    tli_span_text(word, section->name, sizeof section->name);
    if (tli_span_is(word, "Dimension"))
        return tli_scan_int(&medit->scan, "the dimension", 2, 3, &medit->dimension);
    return TL_OK;
}

tl_status tli_medit_leave(tli_medit *medit, const tli_medit_section *section)
{
    tli_scan *scan = &medit->scan;
    if (!scan->binary) return TL_OK; /* the next keyword is looked for */
    if (section->next)
        scan->at = scan->begin + section->next;
    else
        scan->at = scan->end;
    return TL_OK;
}

/* ---- a mesh ---- */

typedef struct mesh_reader {
    tli_medit medit;
    tli_grid *grid;
    tli_cells cells;
    tli_faces faces;
    bool has_regions;
} mesh_reader;

static tl_status read_vertices(mesh_reader *r)
{
    tli_medit *medit = &r->medit;
    const uint64_t axes = (uint64_t)medit->dimension;
    tl_status st = TL_OK;
    uint64_t count = 0;
    int64_t reference;
    if (r->grid->xyz) return tli_scan_fail(&medit->scan, "Vertices stand twice in the file");
    st = tli_medit_count(medit, "vertices", 1, axes, &count);
    r->grid->xyz = tl_mem_zalloc(medit->scan.ctx, (size_t)count, 3 * sizeof(double), &st);
    if (st) return st;
    r->grid->point_count = count;
    for (uint64_t i = 0; !st && i < count; i++) {
        for (uint64_t axis = 0; !st && axis < axes; axis++)
            st = tli_medit_real(medit, "a coordinate", &r->grid->xyz[3 * i + axis]);
        if (!st) st = tli_medit_int(medit, "a reference", INT64_MIN, INT64_MAX, &reference);
    }
    return st;
}

static tl_status read_cells(mesh_reader *r, const keyword *key)
{
    tli_medit *medit = &r->medit;
    uint64_t count = 0;
    int64_t id = 0, reference = 0;
    tl_status st = tli_medit_count(medit, "cells", key->nodes + 1u, 0, &count);
    if (!st) st = tli_cells_reserve(&r->cells, count, count * key->nodes);
    const bool surface = tli_cell_is_surface(key->type), volume = tli_cell_is_volume(key->type);
    const uint32_t corners = key->nodes == 4 || key->nodes == 8 ? 4 : 3;
    for (uint64_t i = 0; !st && i < count; i++) {
        uint32_t ids[10];
        for (unsigned n = 0; !st && n < key->nodes; n++) {
            st = tli_medit_int(medit, "a point", 1, UINT32_MAX, &id);
            ids[n] = (uint32_t)(id - 1);
        }
        if (!st) st = tli_medit_int(medit, "a reference", INT32_MIN, INT32_MAX, &reference);
        if (st) return st;
        memcpy(tli_cells_add(&r->cells, key->type, key->nodes, (int32_t)reference), ids,
               key->nodes * sizeof *ids);
        r->has_regions |= volume && reference != 0;
        if (surface && reference != 0)
            st = tli_faces_add(&r->faces, (int32_t)reference, ids, corners);
    }
    return st;
}

static tl_status read_sections(mesh_reader *r)
{
    bool more = true;
    tl_status st = TL_OK;
    while (!st && more) {
        tli_medit_section section;
        st = tli_medit_next(&r->medit, &section, &more);
        if (st || !more) break;
        for (size_t i = 0; !st && i < sizeof keywords / sizeof *keywords; i++) {
            if (strcmp(section.name, keywords[i].name) != 0) continue;
            if (keywords[i].type)
                st = read_cells(r, &keywords[i]);
            else if (keywords[i].code == 4)
                st = read_vertices(r);
        }
        if (!st) st = tli_medit_leave(&r->medit, &section);
    }
    if (!st && !r->grid->xyz)
        st = tl_fail(r->medit.scan.ctx, TL_ERR_FORMAT, "'%s': no Vertices", r->medit.scan.path);
    return st;
}

/* Labels name points: those were read before or after them. */
static tl_status check_faces(const mesh_reader *r)
{
    uint64_t count = r->faces.count ? r->faces.offsets[r->faces.count] : 0;
    for (uint64_t i = 0; i < count; i++)
        if (r->faces.points[i] >= r->grid->point_count)
            return tl_fail(r->medit.scan.ctx, TL_ERR_FORMAT,
                           "'%s': a face has point %u of %" PRIu64, r->medit.scan.path,
                           r->faces.points[i] + 1, r->grid->point_count);
    return TL_OK;
}

/* ---- reader ---- */

tli_match tli_match_medit(const tli_source *source)
{
    const uint8_t *bytes = source->map.bytes;
    bool binary =
        source->map.byte_count >= 8 &&
        ((tli_int_at(bytes, 4, false) == 1 && tli_int_at(bytes + 4, 4, false) <= VERSION_MAX &&
          tli_int_at(bytes + 4, 4, false) >= 1) ||
         (tli_int_at(bytes, 4, true) == 1 && tli_int_at(bytes + 4, 4, true) <= VERSION_MAX &&
          tli_int_at(bytes + 4, 4, true) >= 1));
    if (source->folder) return TLI_MATCH_NO;
    if (strstr(source->head, "MeshVersionFormatted")) return TLI_MATCH_BYTES;
    if (!tli_ends_in(source->path, ".mesh .meshb .sol .solb")) return TLI_MATCH_NO;
    return binary ? TLI_MATCH_BYTES : TLI_MATCH_NAME;
}

/* The values beside a mesh, or the mesh beside values. Gives *other, NULL if there is none. */
static tl_status find_other(tl_ctx *ctx, const char *path, const char *const endings[2],
                            char **other)
{
    const char *dot = strrchr(path, '.');
    *other = NULL;
    for (int i = 0; dot && i < 2; i++) {
        tl_status st = tli_path_with_ending(ctx, path, strlen(dot), endings[i], other);
        if (st || tli_file_exists(*other)) return st;
        tl_mem_free(ctx, *other);
        *other = NULL;
    }
    return TL_OK;
}

static tl_status read_mesh(tl_ctx *ctx, const char *path, const tli_map *map, tli_grid *grid)
{
    mesh_reader r = {.grid = grid};
    tli_cells_init(ctx, &r.cells);
    tli_faces_init(ctx, &r.faces);
    tl_status st = tli_medit_open(ctx, path, map, &r.medit);
    if (!st) st = read_sections(&r);
    if (!st) st = check_faces(&r);
    if (!st) st = tli_cells_to_grid(&r.cells, path, r.has_regions, grid);
    if (!st) st = tli_faces_to_labels(&r.faces, grid, NULL, NULL);
    tli_faces_release(&r.faces);
    tli_cells_release(&r.cells);
    return st;
}

static tl_status read_values_at(tl_ctx *ctx, const char *path, tli_grid *grid)
{
    tli_map map;
    tl_status st = tli_map_open(ctx, path, &map);
    if (st) return st;
    st = tli_medit_read_sol(ctx, path, &map, grid);
    tli_map_close(ctx, &map);
    return st;
}

/* The values are named: the mesh stands beside them. */
static tl_status read_mesh_of(tl_ctx *ctx, const tli_source *source, tli_grid *grid)
{
    static const char *const endings[] = {".mesh", ".meshb"};
    char *path = NULL;
    tli_map map = {0};
    tl_status st = find_other(ctx, source->path, endings, &path);
    if (!st && !path)
        st = tl_fail(ctx, TL_ERR_IO, "'%s': values, but there is no .mesh or .meshb of that name",
                     source->path);
    if (!st) st = tli_map_open(ctx, path, &map);
    if (!st) st = read_mesh(ctx, path, &map, grid);
    if (!st) st = tli_medit_read_sol(ctx, source->path, &source->map, grid);
    tli_map_close(ctx, &map);
    tl_mem_free(ctx, path);
    return st;
}

tl_status tli_read_medit(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                         tli_grid *grid)
{
    static const char *const endings[] = {".sol", ".solb"};
    char *values = NULL;
    if (tli_ends_in(source->path, ".sol .solb")) return read_mesh_of(ctx, source, grid);
    tl_status st = read_mesh(ctx, source->path, &source->map, grid);
    if (!st && opts->solution) return read_values_at(ctx, opts->solution, grid);
    if (!st) st = find_other(ctx, source->path, endings, &values);
    if (!st && values) st = read_values_at(ctx, values, grid);
    tl_mem_free(ctx, values);
    return st;
}
