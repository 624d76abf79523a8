/* OpenFOAM: a mesh is faces with the cells on both sides; the face turns away from its owner. Cells
 * that are tets, pyramids, wedges or hexahedra become such in VTK's order, others polyhedra. */
#include "formats/formats_openfoam.h"

#include "formats/formats_cells.h"

#include <inttypes.h>
#include <string.h>

#define SHAPE_FACES 6
#define SHAPE_POINTS 8

typedef struct builder {
    const tli_foam_mesh *mesh;
    uint64_t *offsets; /* [cell_count + 1] into faces */
    uint32_t *faces;   /* of each cell, ascending */
    tli_cells cells;
    bool has_polyhedra;
} builder;

static uint32_t face_size(const tli_foam_mesh *mesh, uint32_t face)
{
    return (uint32_t)(mesh->face_offsets[face + 1] - mesh->face_offsets[face]);
}

/* ---- faces of each cell ---- */

/* No cell without a face: that bounds their number. */
static tl_status count_cells(tli_foam_mesh *mesh)
{
    uint64_t cells = 0;
    for (uint64_t f = 0; f < mesh->face_count; f++)
        if (mesh->owner[f] + (uint64_t)1 > cells) cells = mesh->owner[f] + (uint64_t)1;
    for (uint64_t f = 0; f < mesh->neighbour_count; f++)
        if (mesh->neighbour[f] != TL_NONE && mesh->neighbour[f] + (uint64_t)1 > cells)
            cells = mesh->neighbour[f] + (uint64_t)1;
    if (cells > mesh->face_count + mesh->neighbour_count)
        return tl_fail(mesh->ctx, TL_ERR_FORMAT,
                       "'%s': cell %" PRIu64 " in a mesh of %" PRIu64 " faces", mesh->path,
                       cells - 1, mesh->face_count);
    mesh->cell_count = cells;
    return TL_OK;
}

static tl_status sort_faces(builder *b)
{
    const tli_foam_mesh *mesh = b->mesh;
    tl_status st = TL_OK;
    b->offsets = tl_mem_zalloc(mesh->ctx, (size_t)mesh->cell_count + 2, sizeof *b->offsets, &st);
    b->faces = tl_mem_alloc(mesh->ctx, (size_t)(mesh->face_count + mesh->neighbour_count),
                            sizeof *b->faces, &st);
    if (st) return st;
    uint64_t *ends = b->offsets + 1; /* counts, then where the next face of a cell goes */
    for (uint64_t f = 0; f < mesh->face_count; f++) {
        ends[mesh->owner[f] + (size_t)1]++;
        if (f < mesh->neighbour_count && mesh->neighbour[f] != TL_NONE)
            ends[mesh->neighbour[f] + (size_t)1]++;
    }
    for (uint64_t c = 0; c < mesh->cell_count; c++) ends[c + 1] += ends[c];
    for (uint64_t f = 0; f < mesh->face_count; f++) {
        b->faces[ends[mesh->owner[f]]++] = (uint32_t)f;
        if (f < mesh->neighbour_count && mesh->neighbour[f] != TL_NONE)
            b->faces[ends[mesh->neighbour[f]]++] = (uint32_t)f;
    }
    return TL_OK;
}

/* ---- shapes ---- */

/* Points of a face as seen from inside the cell, counterclockwise, or clockwise. */
static void face_corners(const tli_foam_mesh *mesh, uint32_t face, uint64_t cell, bool inward,
                         uint32_t *corners)
{
    const uint32_t count = face_size(mesh, face),
                   *points = mesh->face_points + mesh->face_offsets[face];
    bool turn = (mesh->owner[face] == cell) == inward;
    for (uint32_t i = 0; i < count; i++) corners[i] = points[turn ? count - 1 - i : i];
}

static bool holds(const uint32_t *points, uint32_t count, uint32_t point)
{
    for (uint32_t i = 0; i < count; i++)
        if (points[i] == point) return true;
    return false;
}

/* The one point that an edge joins to corner and that is none of base [base_count]; TL_NONE if
 * there is none or more than one. */
static uint32_t across(const builder *b, uint64_t cell, const uint32_t *base, uint32_t base_count,
                       uint32_t corner)
{
    const tli_foam_mesh *mesh = b->mesh;
    uint32_t found = TL_NONE;
    for (uint64_t i = b->offsets[cell]; i < b->offsets[cell + 1]; i++) {
        const uint32_t face = b->faces[i], count = face_size(mesh, face);
        const uint32_t *points = mesh->face_points + mesh->face_offsets[face];
        for (uint32_t k = 0; k < count; k++) {
            uint32_t next = points[(k + 1) % count];
            uint32_t other = points[k] == corner ? next : next == corner ? points[k] : TL_NONE;
            if (other == TL_NONE || holds(base, base_count, other)) continue;
            if (found != TL_NONE && found != other) return TL_NONE;
            found = other;
        }
    }
    return found;
}

/* Corners of a usual shape in VTK's order; 0 where the cell is none. */
static uint8_t find_shape(const builder *b, uint64_t cell, uint32_t corners[SHAPE_POINTS],
                          uint32_t *count)
{
    const tli_foam_mesh *mesh = b->mesh;
    const uint64_t first = b->offsets[cell], faces = b->offsets[cell + 1] - first;
    uint32_t triangles = 0, quads = 0, triangle = 0, quad = 0;
    if (faces < 4 || faces > SHAPE_FACES) return 0;
    for (uint64_t i = first; i < first + faces; i++) {
        uint32_t size = face_size(mesh, b->faces[i]);
        if (size == 3 && !triangles++) triangle = b->faces[i];
        if (size == 4 && !quads++) quad = b->faces[i];
    }
    if (triangles + quads != faces) return 0;
    uint8_t type;
    uint32_t base = 3, above = 1; /* points of the base and across from it */
    bool inward = true;
    if (faces == 4 && triangles == 4)
        type = 10;
    else if (faces == 5 && quads == 1)
        type = TLI_VTK_PYRAMID, base = 4;
    else if (faces == 5 && triangles == 2)
        type = TLI_VTK_WEDGE, above = 3, inward = false;
    else if (faces == 6 && quads == 6)
        type = TLI_VTK_HEXAHEDRON, base = above = 4;
    else
        return 0;
    face_corners(mesh, base == 4 ? quad : triangle, cell, inward, corners);
    for (uint32_t i = 0; i < base; i++) {
        uint32_t point = across(b, cell, corners, base, corners[i]);
        if (point == TL_NONE || holds(corners, i, corners[i])) return 0;
        if (above == 1 && i > 0 && point != corners[base]) return 0;
        if (above > 1 && holds(corners + base, i, point)) return 0;
        corners[base + (above > 1 ? i : 0)] = point;
    }
    *count = base + above;
    return type;
}

static tl_status add_cell(builder *b, uint64_t cell)
{
    uint32_t corners[SHAPE_POINTS], count = 0;
    const uint64_t first = b->offsets[cell], faces = b->offsets[cell + 1] - first;
    uint8_t type = find_shape(b, cell, corners, &count);
    const uint32_t *ids = type ? corners : b->faces + first;
    if (!type) count = (uint32_t)faces;
    b->has_polyhedra |= !type;
    tl_status st = tli_cells_reserve(&b->cells, 1, count);
    if (!st)
        memcpy(tli_cells_add(&b->cells, type ? type : TLI_VTK_POLYHEDRON, count, 0), ids,
               count * sizeof *ids);
    return st;
}

tl_status tli_foam_make_cells(tli_foam_mesh *mesh, tli_grid *grid)
{
    builder b = {.mesh = mesh};
    tli_cells_init(mesh->ctx, &b.cells);
    tl_status st = count_cells(mesh);
    if (!st) st = sort_faces(&b);
    if (!st) st = tli_cells_reserve(&b.cells, mesh->cell_count, 0);
    for (uint64_t c = 0; !st && c < mesh->cell_count; c++) st = add_cell(&b, c);
    if (!st && b.has_polyhedra) {
        grid->face_count = mesh->face_count;
        grid->face_offsets = mesh->face_offsets;
        grid->face_points = mesh->face_points;
    }
    if (!st) st = tli_cells_to_grid(&b.cells, mesh->path, false, grid);
    tl_mem_free(mesh->ctx, b.faces);
    tl_mem_free(mesh->ctx, b.offsets);
    tli_cells_release(&b.cells);
    return st;
}
