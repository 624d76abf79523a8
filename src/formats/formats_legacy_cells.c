/* Legacy VTK files: cells. Up to version 4.2 a cell is its count and its indices in one row of
 * integers; from 5.0 on a section has OFFSETS and CONNECTIVITY of their own. */
#include "formats/formats_legacy.h"
#include "formats/formats_split.h"

#include <inttypes.h>
#include <string.h>

#define CHUNK 4096 /* integers read at a time */

/* ---- sections ---- */

static uint64_t index_count(const tli_grid *grid)
{
    return grid->offsets ? grid->offsets[grid->cell_count] : 0;
}

/* Room for more cells and indices behind those that are there. */
static tl_status reserve(tli_legacy *reader, uint64_t cells, uint64_t indices)
{
    tli_grid *grid = reader->grid;
    tl_status st = TL_OK;
    bool first = !grid->offsets;
    uint64_t before = index_count(grid);
    grid->offsets = tl_mem_resize(reader->ctx, grid->offsets, grid->cell_count + cells + 1,
                                  sizeof *grid->offsets, &st);
    if (!st && first) grid->offsets[0] = 0;
    grid->connectivity = tl_mem_resize(reader->ctx, grid->connectivity, before + indices,
                                       sizeof *grid->connectivity, &st);
    return st;
}

/* Types of the cells of a section of polygonal data. */
static tl_status append_types(tli_legacy *reader, uint64_t cells, int cell_type)
{
    tli_grid *grid = reader->grid;
    tl_status st = TL_OK;
    grid->types = tl_mem_resize(reader->ctx, grid->types, grid->cell_count + cells, 1, &st);
    if (!st && cells) memset(grid->types + grid->cell_count, cell_type, (size_t)cells);
    return st;
}

static tl_status bad_index(const tli_legacy *reader, const char *place, uint64_t cell,
                           int64_t value)
{
    return tli_legacy_fail(reader, place, TL_ERR_FORMAT,
                           "cell %" PRIu64 " names point %" PRId64 ", expected 0 to %u", cell,
                           value, TL_MESH_VERTS_MAX - 1);
}

static bool is_index(int64_t value)
{
    return value >= 0 && value < (int64_t)TL_MESH_VERTS_MAX;
}

/* Counts and indices in one row of size integers. No count passes the size - cells indices that are
 * left, and no cell follows the last, so a row that is read to its end holds every cell whole. */
static tl_status read_row(tli_legacy *reader, const char *place, uint64_t cells, uint64_t size)
{
    const tli_legacy_type *type = tli_legacy_int();
    if (cells > size)
        return tli_legacy_fail(
            reader, place, TL_ERR_FORMAT,
            "%" PRIu64 " cells in %" PRIu64 " integers, expected at least one a cell", cells, size);
    tl_status st = tli_legacy_open_integers(reader, "cells", type, size);
    if (!st) st = reserve(reader, cells, size - cells);
    if (st) return st;

    tli_grid *grid = reader->grid;
    const uint64_t base = grid->cell_count, limit = index_count(grid) + size - cells;
    uint64_t cell = 0, at = index_count(grid), left = 0; /* indices that the current cell lacks */
    for (uint64_t done = 0; done < size;) {
        int64_t values[CHUNK];
        size_t piece = size - done < CHUNK ? (size_t)(size - done) : CHUNK;
        st = tli_legacy_read_integers(reader, "an integer of a cell", type, piece, values);
        if (st) return st;
        for (size_t i = 0; i < piece; i++) {
            if (left) {
                if (!is_index(values[i])) return bad_index(reader, place, cell - 1, values[i]);
                grid->connectivity[at++] = (uint32_t)values[i];
                left--;
            } else {
                if (cell == cells || values[i] < 0 || (uint64_t)values[i] > limit - at)
                    return tli_legacy_fail(reader, place, TL_ERR_FORMAT,
                                           "cell %" PRIu64 " of %" PRIu64 " has %" PRId64
                                           " indices, expected at most %" PRIu64,
                                           cell, cells, values[i], limit - at);
                left = (uint64_t)values[i];
                grid->offsets[base + ++cell] = at + left;
            }
        }
        done += piece;
    }
    return TL_OK;
}

/* OFFSETS: cells + 1 of them, from 0 to indices, none below the one before. */
static tl_status read_offsets(tli_legacy *reader, const char *place, uint64_t cells,
                              uint64_t indices)
{
    const tli_legacy_type *type;
    tli_grid *grid = reader->grid;
    tl_status st = tli_legacy_read_type(reader, &type);
    if (!st) st = tli_legacy_open_integers(reader, "OFFSETS", type, cells + 1);
    if (!st) st = reserve(reader, cells, 0);
    if (st) return st;
    const uint64_t base = index_count(grid);
    uint64_t *offsets = grid->offsets + grid->cell_count, last = 0;
    for (uint64_t done = 0; !st && done <= cells;) {
        int64_t values[CHUNK];
        size_t piece = cells + 1 - done < CHUNK ? (size_t)(cells + 1 - done) : CHUNK;
        st = tli_legacy_read_integers(reader, "an offset", type, piece, values);
        for (size_t i = 0; !st && i < piece; i++, done++) {
            uint64_t value = (uint64_t)values[i];
            if (value < last || value > indices || (!done && value) ||
                (done == cells && value != indices))
                st = tli_legacy_fail(reader, place, TL_ERR_FORMAT,
                                     "offset %" PRIu64 " of %" PRIu64 " is %" PRId64
                                     ", expected %" PRIu64 " to %" PRIu64,
                                     done, cells + 1, values[i], done == cells ? indices : last,
                                     done ? indices : 0);
            else
                offsets[done] = base + value;
            last = value;
        }
    }
    return st;
}

static tl_status read_connectivity(tli_legacy *reader, const char *place, uint64_t base,
                                   uint64_t indices)
{
    const tli_legacy_type *type;
    tli_grid *grid = reader->grid;
    if (!tli_legacy_take(reader, "CONNECTIVITY"))
        return tli_legacy_expected(reader, "CONNECTIVITY");
    tl_status st = tli_legacy_read_type(reader, &type);
    if (!st) st = tli_legacy_open_integers(reader, "CONNECTIVITY", type, indices);
    if (!st)
        grid->connectivity = tl_mem_resize(reader->ctx, grid->connectivity, base + indices,
                                           sizeof *grid->connectivity, &st);
    for (uint64_t done = 0; !st && done < indices;) {
        int64_t values[CHUNK];
        size_t piece = indices - done < CHUNK ? (size_t)(indices - done) : CHUNK;
        st = tli_legacy_read_integers(reader, "an index of a point", type, piece, values);
        for (size_t i = 0; !st && i < piece; i++, done++) {
            if (is_index(values[i]))
                grid->connectivity[base + done] = (uint32_t)values[i];
            else
                st = tli_legacy_fail(reader, place, TL_ERR_FORMAT,
                                     "index %" PRIu64 " of CONNECTIVITY is %" PRId64
                                     ", expected 0 to %u",
                                     done, values[i], TL_MESH_VERTS_MAX - 1);
        }
    }
    return st;
}

/* A section of version 5: its first number counts offsets, one more than cells. */
static tl_status read_arrays(tli_legacy *reader, const char *place, uint64_t offset_count,
                             uint64_t indices, uint64_t *cells)
{
    if (!offset_count)
        return tli_legacy_fail(reader, place, TL_ERR_FORMAT, "0 offsets, expected at least 1");
    *cells = offset_count - 1;
    const uint64_t base = index_count(reader->grid);
    tl_status st = read_offsets(reader, place, *cells, indices);
    if (!st && tli_legacy_take(reader, "METADATA")) tli_legacy_skip_metadata(reader);
    if (!st) st = read_connectivity(reader, place, base, indices);
    return st;
}

tl_status tli_legacy_read_cells(tli_legacy *reader, const char *place, int cell_type)
{
    uint64_t cells, size;
    tl_status st = tli_legacy_read_count(reader, "the number of cells", &cells);
    if (!st) st = tli_legacy_read_count(reader, "the number of integers of all cells", &size);
    if (st) return st;
    reader->components = 1;
    const bool lists = tli_legacy_take(reader, "OFFSETS");
    if (reader->places && cell_type)
        st = TL_ERR_UNSUPPORTED; /* polygons: as a whole */
    else if (reader->places)
        st = lists ? tli_legacy_locate_lists(reader, cells, size, &cells)
                   : tli_legacy_locate_row(reader, cells, size);
    else
        st = lists ? read_arrays(reader, place, cells, size, &cells)
                   : read_row(reader, place, cells, size);
    if (!st && cell_type) st = append_types(reader, cells, cell_type);
    if (!st) reader->grid->cell_count += cells;
    return st;
}

tl_status tli_legacy_read_cell_types(tli_legacy *reader)
{
    tl_status st = tli_legacy_read_count(reader, "the number of cell types", &reader->type_count);
    if (!st && reader->places)
        return tli_legacy_locate_integers(reader, "CELL_TYPES", tli_legacy_int(),
                                          reader->type_count, &reader->places->types);
    if (!st)
        st = tli_legacy_open_integers(reader, "CELL_TYPES", tli_legacy_int(), reader->type_count);
    uint8_t *types = st ? NULL : tl_mem_alloc(reader->ctx, reader->type_count, 1, &st);
    if (st) return st;
    reader->grid->types = types;
    for (uint64_t done = 0; done < reader->type_count;) {
        int64_t values[CHUNK];
        size_t piece =
            reader->type_count - done < CHUNK ? (size_t)(reader->type_count - done) : CHUNK;
        const char *place = reader->at;
        st = tli_legacy_read_integers(reader, "a cell type", tli_legacy_int(), piece, values);
        if (st) return st;
        for (size_t i = 0; i < piece; i++, done++) {
            if (values[i] < 0 || values[i] > UINT8_MAX)
                return tli_legacy_fail(reader, place, TL_ERR_FORMAT,
                                       "type %" PRId64 " of cell %" PRIu64 ", expected 0 to %d",
                                       values[i], done, UINT8_MAX);
            types[done] = (uint8_t)values[i];
        }
    }
    return TL_OK;
}

/* ---- once all is there ---- */

/* Replaces the face streams of polyhedra by the ids of their faces, which are fewer than the
 * numbers of the stream. */
static tl_status list_faces(tli_legacy *reader)
{
    tli_grid *grid = reader->grid;
    tli_face_list list;
    tl_status st = TL_OK;
    if (!grid->cell_count || !memchr(grid->types, TLI_VTK_POLYHEDRON, (size_t)grid->cell_count))
        return TL_OK;
    uint64_t kept = 0, begin = 0;
    tli_face_list_begin(grid, &list);
    for (uint64_t cell = 0; cell < grid->cell_count && !st; cell++) {
        uint64_t end = grid->offsets[cell + 1], length = end - begin;
        uint32_t *stream = grid->connectivity + begin, faces = 0;
        uint32_t first = (uint32_t)grid->face_count;
        if (grid->types[cell] == TLI_VTK_POLYHEDRON) {
            st = tli_face_list_add_stream(&list, stream, length, grid->point_count, 0, &faces);
            if (st == TL_ERR_FORMAT)
                return tli_legacy_fail(reader, reader->cells_at, TL_ERR_FORMAT,
                                       "cell %" PRIu64
                                       " is a polyhedron, expected a list of faces in "
                                       "its %" PRIu64 " integers",
                                       cell, length);
            length = faces;
            for (uint32_t i = 0; i < faces; i++) grid->connectivity[kept + i] = first + i;
        } else if (length) {
            memmove(grid->connectivity + kept, stream, (size_t)length * sizeof *stream);
        }
        kept += length;
        grid->offsets[cell + 1] = kept;
        begin = end;
    }
    return st ? st : tli_face_list_end(&list);
}

tl_status tli_legacy_close_cells(tli_legacy *reader)
{
    tli_grid *grid = reader->grid;
    if (reader->kind == TLI_LEGACY_UNSTRUCTURED && reader->type_count != grid->cell_count)
        return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                               "%" PRIu64 " cell types for %" PRIu64 " cells", reader->type_count,
                               grid->cell_count);
    if (reader->places) return TL_OK; /* indices are looked at as they are read */
    tl_status st = list_faces(reader);
    if (st) return st;
    const uint64_t indices = index_count(grid);
    for (uint64_t i = 0, cell = 0; i < indices; i++) {
        if (grid->connectivity[i] < grid->point_count) continue;
        while (grid->offsets[cell + 1] <= i) cell++;
        if (grid->types[cell] == TLI_VTK_POLYHEDRON) continue; /* names faces */
        return tli_legacy_fail(reader, reader->cells_at, TL_ERR_FORMAT,
                               "cell %" PRIu64 " names point %u, expected below %" PRIu64, cell,
                               grid->connectivity[i], grid->point_count);
    }
    return TL_OK;
}
