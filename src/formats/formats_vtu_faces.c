/* VTK XML: polyhedra. A cell of type 42 has its points in the connectivity and its faces in an
 * array of their own, as streams; the grid wants the ids of its faces in the connectivity. */
#include <string.h>

#include "formats/formats_split.h"
#include "formats/formats_vtkxml.h"

/* The streams of a piece: where each ends, and their numbers. */
typedef struct face_streams {
    double *ends; /* [cell_count] -1 for other cells; as numbers, since they may be negative */
    uint32_t *numbers;
    uint64_t number_count;
} face_streams;

static bool has_polyhedra(const tli_grid *grid, const tli_vx_piece *piece)
{
    return piece->cell_count &&
           memchr(grid->types + piece->first_cell, TLI_VTK_POLYHEDRON, (size_t)piece->cell_count);
}

static tl_status read_streams(tli_vx_file *file, const tli_vx_piece *piece, face_streams *s)
{
    tl_status st = TL_OK;
    tli_vx_array *faces = tli_vx_find(file, piece, TLI_VX_CELLS, "faces");
    tli_vx_array *ends = tli_vx_find(file, piece, TLI_VX_CELLS, "faceoffsets");
    if (!faces || !ends)
        return tl_fail(file->ctx,
                       tli_vx_find(file, piece, TLI_VX_CELLS, "face_connectivity")
                           ? TL_ERR_UNSUPPORTED
                           : TL_ERR_FORMAT,
                       "the piece at byte %llu has polyhedra, but no faces and faceoffsets",
                       (unsigned long long)piece->ofs);
    st = tli_vx_open_expecting(file, ends, piece->cell_count);
    if (!st) st = tli_vx_open(file, faces);
    if (st) return st;
    s->number_count = faces->value_count;
    s->ends = tl_mem_alloc(file->ctx, (size_t)piece->cell_count, sizeof *s->ends, &st);
    s->numbers = tl_mem_alloc(file->ctx, (size_t)s->number_count, sizeof *s->numbers, &st);
    tli_vx_target to_ends = {.f64 = s->ends};
    tli_vx_target to_numbers = {.u32 = s->numbers, .limit = UINT32_MAX};
    if (!st) st = tli_vx_read(file, ends, piece->cell_count, &to_ends);
    if (!st) st = tli_vx_read(file, faces, s->number_count, &to_numbers);
    return st;
}

/* Adds the faces of the polyhedra of a piece; counts [cell_count] receives how many each has. */
static tl_status add_faces(tli_vx_file *file, const tli_vx_piece *piece, const face_streams *s,
                           const tli_grid *grid, tli_face_list *list, uint32_t *counts)
{
    tl_status st = TL_OK;
    uint64_t begin = 0;
    for (uint64_t cell = 0; cell < piece->cell_count && !st; cell++) {
        if (grid->types[piece->first_cell + cell] != TLI_VTK_POLYHEDRON) continue;
        if (!(s->ends[cell] >= (double)begin && s->ends[cell] <= (double)s->number_count))
            return tl_fail(file->ctx, TL_ERR_FORMAT,
                           "faceoffsets: cell %llu has %.17g, expected %llu to %llu",
                           (unsigned long long)cell, s->ends[cell], (unsigned long long)begin,
                           (unsigned long long)s->number_count);
        uint64_t end = (uint64_t)s->ends[cell];
        st = tli_face_list_add_stream(list, s->numbers + begin, end - begin, piece->point_count,
                                      (uint32_t)piece->first_point, &counts[cell]);
        if (st)
            tl_note(file->ctx, st, "cell %llu of the piece at byte %llu", (unsigned long long)cell,
                    (unsigned long long)piece->ofs);
        begin = end;
    }
    return st;
}

/* Connectivity anew: polyhedra name faces, which are numbered in the order of the cells. */
static tl_status name_faces(tli_grid *grid, const uint32_t *counts)
{
    tl_status st = TL_OK;
    uint64_t length = 0, at = 0, face = 0, begin = 0;
    for (uint64_t cell = 0; cell < grid->cell_count; cell++)
        length += grid->types[cell] == TLI_VTK_POLYHEDRON
                      ? counts[cell]
                      : grid->offsets[cell + 1] - grid->offsets[cell];
    uint32_t *named = tl_mem_alloc(grid->ctx, (size_t)length, sizeof *named, &st);
    if (st) return st;
    for (uint64_t cell = 0; cell < grid->cell_count; cell++) {
        uint64_t end = grid->offsets[cell + 1];
        if (grid->types[cell] == TLI_VTK_POLYHEDRON) {
            for (uint32_t i = 0; i < counts[cell]; i++) named[at++] = (uint32_t)face++;
        } else {
            memcpy(named + at, grid->connectivity + begin, (size_t)(end - begin) * sizeof *named);
            at += end - begin;
        }
        grid->offsets[cell + 1] = at;
        begin = end;
    }
    tl_mem_free(grid->ctx, grid->connectivity);
    grid->connectivity = named;
    return TL_OK;
}

tl_status tli_vx_read_faces(tli_vx_file *file, tli_grid *grid)
{
    tl_status st = TL_OK;
    bool any = false;
    for (size_t p = 0; p < file->piece_count; p++)
        any = any || has_polyhedra(grid, &file->pieces[p]);
    if (!any) return TL_OK;
    tli_face_list list;
    uint32_t *counts = tl_mem_zalloc(file->ctx, (size_t)grid->cell_count, sizeof *counts, &st);
    tli_face_list_begin(grid, &list);
    for (size_t p = 0; p < file->piece_count && !st; p++) {
        const tli_vx_piece *piece = &file->pieces[p];
        face_streams streams = {0};
        if (!has_polyhedra(grid, piece)) continue;
        st = read_streams(file, piece, &streams);
        if (!st) st = add_faces(file, piece, &streams, grid, &list, counts + piece->first_cell);
        tl_mem_free(file->ctx, streams.numbers);
        tl_mem_free(file->ctx, streams.ends);
    }
    if (!st) st = tli_face_list_end(&list);
    if (!st) st = name_faces(grid, counts);
    tl_mem_free(file->ctx, counts);
    return st;
}
