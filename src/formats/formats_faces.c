/* The faces of polyhedra on their way into a grid. */
#include "formats/formats_grid.h"

#include <string.h>

void tli_face_list_begin(tli_grid *grid, tli_face_list *list)
{
    uint64_t faces = grid->face_count;
    *list = (tli_face_list){grid, faces ? faces + 1 : 0, faces ? grid->face_offsets[faces] : 0};
}

tl_status tli_face_list_add(tli_face_list *list, const uint32_t *ids, uint64_t count, uint32_t add)
{
    tli_grid *grid = list->grid;
    tl_status st = TL_OK;
    uint64_t faces = grid->face_count, used = faces ? grid->face_offsets[faces] : 0;
    if (faces == UINT32_MAX)
        return tl_fail(grid->ctx, TL_ERR_UNSUPPORTED, "more than %u faces of polyhedra",
                       UINT32_MAX);
    if (faces + 2 > list->face_room) {
        uint64_t room = 2 * list->face_room + 64;
        grid->face_offsets = tl_mem_resize(grid->ctx, grid->face_offsets, (size_t)room,
                                           sizeof *grid->face_offsets, &st);
        if (!st) list->face_room = room;
    }
    if (used + count > list->point_room) {
        uint64_t room = 2 * list->point_room + count + 256;
        grid->face_points = tl_mem_resize(grid->ctx, grid->face_points, (size_t)room,
                                          sizeof *grid->face_points, &st);
        if (!st) list->point_room = room;
    }
    if (st) return st;
    for (uint64_t i = 0; i < count; i++) grid->face_points[used + i] = ids[i] + add;
    grid->face_offsets[0] = 0;
    grid->face_offsets[++grid->face_count] = used + count;
    return TL_OK;
}

tl_status tli_face_list_add_stream(tli_face_list *list, const uint32_t *stream, uint64_t length,
                                   uint64_t limit, uint32_t add, uint32_t *face_count)
{
    tl_ctx *ctx = list->grid->ctx;
    tl_status st = TL_OK;
    uint64_t at = 1;
    *face_count = length ? stream[0] : 0;
    for (uint32_t face = 0; face < *face_count && !st; face++) {
        if (at == length || stream[at] > length - at - 1)
            return tl_fail(ctx, TL_ERR_FORMAT,
                           "face %u of %u of a polyhedron ends behind its %llu integers", face,
                           *face_count, (unsigned long long)length);
        uint32_t corners = stream[at++];
        for (uint32_t i = 0; i < corners; i++)
            if (stream[at + i] >= limit)
                return tl_fail(ctx, TL_ERR_FORMAT,
                               "face %u of a polyhedron names point %u, expected below %llu", face,
                               stream[at + i], (unsigned long long)limit);
        st = tli_face_list_add(list, stream + at, corners, add);
        at += corners;
    }
    if (!st && (at != length || *face_count == 0))
        return tl_fail(ctx, TL_ERR_FORMAT,
                       "a polyhedron of %u faces takes %llu integers of %llu, expected all",
                       *face_count, (unsigned long long)at, (unsigned long long)length);
    return st;
}

tl_status tli_face_list_end(tli_face_list *list)
{
    tli_grid *grid = list->grid;
    tl_status st = TL_OK;
    if (!grid->face_count) return TL_OK;
    uint64_t faces = grid->face_count;
    grid->face_points =
        tl_mem_resize(grid->ctx, grid->face_points, (size_t)grid->face_offsets[faces],
                      sizeof *grid->face_points, &st);
    grid->face_offsets = tl_mem_resize(grid->ctx, grid->face_offsets, (size_t)faces + 1,
                                       sizeof *grid->face_offsets, &st);
    return st;
}
