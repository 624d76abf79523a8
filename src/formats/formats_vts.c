/* VTK XML: image data, rectilinear and structured grids. The pieces of a file are put together to
 * one block, the box of their extents; points that no piece covers are blank. */
#include <math.h>
#include <string.h>

#include "formats/formats_vtkxml.h"

/* Points of an image need no bytes in its file. So many are taken whatever the file's size; of more
 * there may be as many to a byte as zlib can make of it. */
#define IMPLICIT_POINTS_MIN ((uint64_t)1 << 22)
#define IMPLICIT_POINTS_A_BYTE 1032u
/* A box may be that much larger than its pieces together. */
#define BOX_GROWTH_MAX 8u

/* ---- extents ---- */

static tl_status find_box(tli_vx_structure *s)
{
    const tli_vx_file *file = s->file;
    uint64_t sum = 0, total = 1;
    memcpy(s->box, file->pieces[0].extent, sizeof s->box);
    for (size_t p = 0; p < file->piece_count; p++) {
        const int64_t *extent = file->pieces[p].extent;
        for (int axis = 0; axis < 3; axis++) {
            if (extent[2 * axis] < s->box[2 * axis]) s->box[2 * axis] = extent[2 * axis];
            if (extent[2 * axis + 1] > s->box[2 * axis + 1])
                s->box[2 * axis + 1] = extent[2 * axis + 1];
        }
        sum += file->pieces[p].point_count;
        if (sum > TL_MESH_VERTS_MAX) break;
    }
    for (int axis = 0; axis < 3; axis++) {
        s->dims[axis] = (uint64_t)(s->box[2 * axis + 1] - s->box[2 * axis]) + 1;
        total = total > UINT64_MAX / s->dims[axis] ? UINT64_MAX : total * s->dims[axis];
    }
    if (sum > TL_MESH_VERTS_MAX || total > TL_MESH_VERTS_MAX)
        return tl_fail(file->ctx, TL_ERR_UNSUPPORTED, "more than %u points", TL_MESH_VERTS_MAX);
    if (total / BOX_GROWTH_MAX > sum)
        return tl_fail(file->ctx, TL_ERR_UNSUPPORTED,
                       "the pieces have %llu points, but span a box of %llu",
                       (unsigned long long)sum, (unsigned long long)total);
    s->point_count = total;
    if (s->grid) s->grid->point_count = total;
    return TL_OK;
}

/* A piece that is flat where the whole is not would have other cells than the whole there. */
static tl_status check_flat(const tli_vx_structure *s)
{
    for (size_t p = 0; p < s->file->piece_count; p++)
        for (int axis = 0; axis < 3; axis++) {
            const int64_t *extent = s->file->pieces[p].extent;
            if (extent[2 * axis] == extent[2 * axis + 1] && s->dims[axis] > 1)
                return tl_fail(s->file->ctx, TL_ERR_UNSUPPORTED,
                               "piece %zu is flat along axis %d, the whole is not", p + 1, axis);
        }
    return TL_OK;
}

static tl_status add_block(tli_vx_structure *s)
{
    tl_status st = TL_OK;
    s->grid->blocks = tl_mem_zalloc(s->file->ctx, 1, sizeof *s->grid->blocks, &st);
    if (st) return st;
    for (int axis = 0; axis < 3; axis++) s->grid->blocks[0].dims[axis] = (uint32_t)s->dims[axis];
    s->grid->block_count = 1;
    return TL_OK;
}

/* Where a piece begins in the box, and its points along the axes. */
static void place_piece(const tli_vx_structure *s, const tli_vx_piece *piece, uint64_t place[3],
                        uint64_t counts[3])
{
    for (int axis = 0; axis < 3; axis++) {
        place[axis] = (uint64_t)(piece->extent[2 * axis] - s->box[2 * axis]);
        counts[axis] = (uint64_t)(piece->extent[2 * axis + 1] - piece->extent[2 * axis]) + 1;
    }
}

/* Blanks what no piece covers. */
static tl_status mark_blanks(tli_vx_structure *s)
{
    tl_status st = TL_OK;
    uint64_t covered = 0;
    if (s->file->piece_count == 1) return TL_OK;
    uint8_t *blanks = tl_mem_zalloc(s->file->ctx, (size_t)s->grid->point_count, 1, &st);
    for (size_t p = 0; !st && p < s->file->piece_count; p++) {
        uint64_t place[3], counts[3];
        place_piece(s, &s->file->pieces[p], place, counts);
        for (uint64_t k = place[2]; k < place[2] + counts[2]; k++)
            for (uint64_t j = place[1]; j < place[1] + counts[1]; j++)
                memset(blanks + (k * s->dims[1] + j) * s->dims[0] + place[0], 1, (size_t)counts[0]);
    }
    for (uint64_t i = 0; !st && i < s->grid->point_count; i++) covered += blanks[i];
    if (!st && covered < s->grid->point_count) {
        tl_log(s->file->ctx, TL_LOG_INFO, "%llu points of the whole are in no piece; left blank",
               (unsigned long long)(s->grid->point_count - covered));
        s->grid->blanks = blanks;
        return TL_OK;
    }
    tl_mem_free(s->file->ctx, blanks);
    return st;
}

/* ---- points ---- */

static void lattice_point(const tli_vx_structure *s, const uint64_t at[3], double xyz[3])
{
    const tli_vx_file *file = s->file;
    double step[3];
    if (s->axes[0]) {
        for (int axis = 0; axis < 3; axis++) xyz[axis] = s->axes[axis][at[axis]];
        return;
    }
    for (int axis = 0; axis < 3; axis++)
        step[axis] = (double)(s->box[2 * axis] + (int64_t)at[axis]) * file->spacing[axis];
    for (int axis = 0; axis < 3; axis++) {
        const double *row = file->direction + (size_t)3 * (size_t)axis;
        xyz[axis] = file->origin[axis] + (row[0] * step[0] + row[1] * step[1] + row[2] * step[2]);
    }
}

typedef struct lattice_job {
    const tli_vx_structure *s;
    uint64_t first;
    double *xyz;
} lattice_job;

/* Points [begin, end) behind the first one. */
static tl_status fill_points(void *arg, size_t begin, size_t end, unsigned worker)
{
    const lattice_job *job = arg;
    const uint64_t *dims = job->s->dims, point = job->first + begin;
    uint64_t at[3] = {point % dims[0], point / dims[0] % dims[1], point / dims[0] / dims[1]};
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        lattice_point(job->s, at, job->xyz + 3 * i);
        if (++at[0] < dims[0]) continue;
        at[0] = 0;
        if (++at[1] < dims[1]) continue;
        at[1] = 0;
        at[2]++;
    }
    return TL_OK;
}

static tl_status fill_lattice(const tli_vx_structure *s, uint64_t first, uint64_t count,
                              double *xyz)
{
    lattice_job job = {s, first, xyz};
    return tli_parallel(s->file->ctx, (size_t)count, 4096, fill_points, &job);
}

static tl_status check_image(const tli_vx_structure *s)
{
    uint64_t bytes = s->file->map->byte_count;
    uint64_t most = bytes * IMPLICIT_POINTS_A_BYTE;
    if (most < IMPLICIT_POINTS_MIN) most = IMPLICIT_POINTS_MIN;
    if (s->point_count > most)
        return tl_fail(s->file->ctx, TL_ERR_FORMAT, "%llu points in a file of %llu bytes can't be",
                       (unsigned long long)s->point_count, (unsigned long long)bytes);
    return TL_OK;
}

/* The three coordinate arrays of a piece, in the order of the axes. */
static tl_status open_axes(const tli_vx_structure *s, const tli_vx_piece *piece,
                           tli_vx_array *axes[3])
{
    tl_status st = TL_OK;
    int found = 0;
    uint64_t place[3], counts[3];
    place_piece(s, piece, place, counts);
    for (size_t i = 0; i < piece->array_count && found < 3; i++) {
        tli_vx_array *array = &s->file->arrays[piece->first_array + i];
        if (array->section == TLI_VX_COORDINATES) axes[found++] = array;
    }
    if (found < 3)
        return tl_fail(s->file->ctx, TL_ERR_FORMAT,
                       "the piece at byte %llu has %d arrays of <Coordinates>, expected 3",
                       (unsigned long long)piece->ofs, found);
    for (int axis = 0; !st && axis < 3; axis++)
        st = tli_vx_open_expecting(s->file, axes[axis], counts[axis]);
    return st;
}

static tl_status read_axes(tli_vx_structure *s)
{
    tli_vx_array *arrays[3];
    tl_status st = TL_OK;
    for (size_t p = 0; !st && p < s->file->piece_count; p++)
        st = open_axes(s, &s->file->pieces[p], arrays);
    for (int axis = 0; axis < 3; axis++)
        s->axes[axis] = tl_mem_zalloc(s->file->ctx, (size_t)s->dims[axis], sizeof(double), &st);
    for (size_t p = 0; !st && p < s->file->piece_count; p++) {
        uint64_t place[3], counts[3];
        place_piece(s, &s->file->pieces[p], place, counts);
        st = open_axes(s, &s->file->pieces[p], arrays);
        for (int axis = 0; !st && axis < 3; axis++) {
            tli_vx_target target = {.f64 = s->axes[axis] + place[axis]};
            st = tli_vx_read(s->file, arrays[axis], counts[axis], &target);
        }
    }
    return st;
}

static tl_status open_points(const tli_vx_structure *s)
{
    tl_status st = TL_OK;
    for (size_t p = 0; !st && p < s->file->piece_count; p++) {
        const tli_vx_piece *piece = &s->file->pieces[p];
        tli_vx_array *points = tli_vx_find(s->file, piece, TLI_VX_POINTS, NULL);
        if (!points || (points->components != 0 && points->components != 3))
            return tl_fail(s->file->ctx, TL_ERR_FORMAT,
                           "piece %zu at byte %llu has no <Points> of 3 components", p + 1,
                           (unsigned long long)piece->ofs);
        st = tli_vx_open_expecting(s->file, points, 3 * piece->point_count);
    }
    return st;
}

static tl_status read_points(tli_vx_structure *s)
{
    tl_status st = TL_OK;
    const bool is_lattice = s->file->kind != TLI_VX_STRUCTURED;
    s->grid->xyz = tl_mem_zalloc(s->file->ctx, (size_t)s->point_count, 3 * sizeof(double), &st);
    if (!st && is_lattice) return fill_lattice(s, 0, s->point_count, s->grid->xyz);
    for (size_t p = 0; !st && p < s->file->piece_count; p++) {
        const tli_vx_piece *piece = &s->file->pieces[p];
        uint64_t place[3], counts[3];
        place_piece(s, piece, place, counts);
        st = tli_vx_read_placed(s->file, tli_vx_find(s->file, piece, TLI_VX_POINTS, NULL), 3, place,
                                counts, s->dims, s->grid->xyz);
    }
    return st;
}

tl_status tli_vx_structure_open(tli_vx_structure *s)
{
    tl_status st = find_box(s);
    if (!st) st = check_flat(s);
    if (st) return st;
    switch (s->file->kind) {
    case TLI_VX_IMAGE: return check_image(s);
    case TLI_VX_RECTILINEAR: return read_axes(s);
    default: return open_points(s);
    }
}

void tli_vx_structure_close(tli_vx_structure *s)
{
    for (int axis = 0; axis < 3; axis++) tl_mem_free(s->file->ctx, s->axes[axis]);
}

tl_status tli_vx_structure_points(const tli_vx_structure *s, uint64_t first, uint64_t count,
                                  double *xyz)
{
    if (s->file->kind != TLI_VX_STRUCTURED) return fill_lattice(s, first, count, xyz);
    tli_vx_target target = {.f64 = xyz};
    return tli_vx_read_part(s->file, tli_vx_find(s->file, s->file->pieces, TLI_VX_POINTS, NULL),
                            3 * first, 3 * count, &target);
}

tl_status tli_vx_read_structured(tli_vx_file *file, tli_grid *grid)
{
    tli_vx_structure s = {.file = file, .grid = grid};
    if (file->piece_count == 0) return TL_OK;
    tl_status st = tli_vx_structure_open(&s);
    if (!st) st = read_points(&s);
    tli_vx_structure_close(&s);
    if (!st) st = mark_blanks(&s);
    if (!st) st = add_block(&s);
    return st ? st : tli_vx_fields_read(file, s.box, grid);
}
