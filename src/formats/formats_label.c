/* Faces with ids to labels: sorted by id, then cut into one label each. */
#include "formats/formats_label.h"

#include <string.h>

#include "base/base_sort.h"

#define FIRST_CAPACITY 256

void tli_faces_init(tl_ctx *ctx, tli_faces *faces)
{
    *faces = (tli_faces){.ctx = ctx};
}

void tli_faces_release(tli_faces *faces)
{
    tl_mem_free(faces->ctx, faces->ids);
    tl_mem_free(faces->ctx, faces->offsets);
    tl_mem_free(faces->ctx, faces->points);
    *faces = (tli_faces){.ctx = faces->ctx};
}

static tl_status reserve(tli_faces *faces, uint64_t point_count)
{
    tl_status st = TL_OK;
    uint64_t used = faces->count ? faces->offsets[faces->count] : 0;
    if (faces->count == faces->capacity) {
        uint64_t more = faces->capacity ? 2 * faces->capacity : FIRST_CAPACITY;
        faces->ids = tl_mem_resize(faces->ctx, faces->ids, (size_t)more, sizeof *faces->ids, &st);
        faces->offsets = tl_mem_resize(faces->ctx, faces->offsets, (size_t)more + 1,
                                       sizeof *faces->offsets, &st);
        if (st) return st;
        faces->capacity = more;
    }
    if (used + point_count > faces->point_capacity) {
        uint64_t more = 2 * (used + point_count) + FIRST_CAPACITY;
        faces->points =
            tl_mem_resize(faces->ctx, faces->points, (size_t)more, sizeof *faces->points, &st);
        if (!st) faces->point_capacity = more;
    }
    return st;
}

tl_status tli_faces_add(tli_faces *faces, int32_t id, const uint32_t *points, uint32_t point_count)
{
    tl_status st = reserve(faces, point_count);
    if (st) return st;
    if (faces->count == 0) faces->offsets[0] = 0;
    uint64_t used = faces->offsets[faces->count];
    memcpy(faces->points + used, points, point_count * sizeof *points);
    faces->ids[faces->count++] = id;
    faces->offsets[faces->count] = used + point_count;
    return TL_OK;
}

/* One label of the faces order [count]. */
static tl_status add_label(const tli_faces *faces, const uint32_t *order, uint64_t count,
                           const char *name, tli_grid *grid)
{
    tl_status st = TL_OK;
    uint64_t point_count = 0;
    for (uint64_t i = 0; i < count; i++)
        point_count += faces->offsets[order[i] + 1] - faces->offsets[order[i]];
    uint64_t *offsets = tl_mem_alloc(faces->ctx, (size_t)count + 1, sizeof *offsets, &st);
    uint32_t *points = tl_mem_alloc(faces->ctx, (size_t)point_count, sizeof *points, &st);
    if (!st) {
        offsets[0] = 0;
        for (uint64_t i = 0; i < count; i++) {
            uint64_t first = faces->offsets[order[i]], n = faces->offsets[order[i] + 1] - first;
            memcpy(points + offsets[i], faces->points + first, (size_t)n * sizeof *points);
            offsets[i + 1] = offsets[i] + n;
        }
        st = tli_grid_add_label(grid, name ? name : "", faces->ids[order[0]], count, offsets,
                                points);
    }
    if (st) {
        tl_mem_free(faces->ctx, points);
        tl_mem_free(faces->ctx, offsets);
    }
    return st;
}

/* Orders faces by id; equal ids stay in the order of the file. */
static tl_status sort_faces(const tli_faces *faces, uint32_t **order)
{
    tl_status st = TL_OK;
    if (faces->count > UINT32_MAX)
        return tl_fail(faces->ctx, TL_ERR_UNSUPPORTED, "%llu labelled faces, at most %u",
                       (unsigned long long)faces->count, UINT32_MAX);
    uint32_t *keys = tl_mem_alloc(faces->ctx, (size_t)faces->count, sizeof *keys, &st);
    uint32_t *sorted = tl_mem_alloc(faces->ctx, (size_t)faces->count, sizeof *sorted, &st);
    for (uint64_t i = 0; !st && i < faces->count; i++) {
        keys[i] = (uint32_t)faces->ids[i] ^ 0x80000000u; /* signed order */
        sorted[i] = (uint32_t)i;
    }
    if (!st) st = tli_sort_u32(faces->ctx, keys, sorted, (size_t)faces->count);
    tl_mem_free(faces->ctx, keys);
    if (st) {
        tl_mem_free(faces->ctx, sorted);
        return st;
    }
    *order = sorted;
    return TL_OK;
}

tl_status tli_faces_to_labels(const tli_faces *faces, tli_grid *grid, tli_label_name_fn name,
                              const void *arg)
{
    uint32_t *order = NULL;
    uint64_t labels = 0, first = 0;
    if (faces->count == 0) return TL_OK;
    tl_status st = sort_faces(faces, &order);
    while (!st && first < faces->count && labels < TLI_LABELS_MAX) {
        const int32_t id = faces->ids[order[first]];
        uint64_t end = first;
        while (end < faces->count && faces->ids[order[end]] == id) end++;
        st = add_label(faces, order + first, end - first, name ? name(arg, id) : NULL, grid);
        first = end;
        labels++;
    }
    if (!st && first < faces->count)
        tl_log(faces->ctx, TL_LOG_INFO, "%llu faces have more than %d different labels; left out",
               (unsigned long long)(faces->count - first), TLI_LABELS_MAX);
    tl_mem_free(faces->ctx, order);
    return st;
}
