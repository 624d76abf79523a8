/* Values on a lattice to a structured block: positions from origin and steps, values widened from
 * the order of the file to tuples, on the pool. */
#include "formats/formats_volume.h"

#include <inttypes.h>
#include <string.h>

#define ROW_VALUES 512 /* numbers on the stack */
#define PIECE_POINTS 65536

void tli_volume_init(const char *path, const char *name, tli_volume *volume)
{
    *volume = (tli_volume){.path = path,
                           .name = name,
                           .dims = {1, 1, 1},
                           .components = 1,
                           .steps = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                           .slope = 1};
}

void tli_volume_order(tli_volume *volume, bool components_together)
{
    const uint64_t first = components_together ? volume->components : 1;
    volume->strides[0] = first;
    volume->strides[1] = first * volume->dims[0];
    volume->strides[2] = volume->strides[1] * volume->dims[1];
    volume->strides[3] = components_together ? 1 : volume->strides[2] * volume->dims[2];
}

tl_status tli_volume_bytes(tl_ctx *ctx, const tli_volume *volume, uint64_t *byte_count)
{
    uint64_t points = 1;
    for (int axis = 0; axis < 3; axis++) {
        if (volume->dims[axis] == 0 || volume->dims[axis] > TL_MESH_VERTS_MAX / points)
            return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                           "'%s': an image of %" PRIu64 " x %" PRIu64 " x %" PRIu64
                           " points, expected 1 to %u of them",
                           volume->path, volume->dims[0], volume->dims[1], volume->dims[2],
                           TL_MESH_VERTS_MAX);
        points *= volume->dims[axis];
    }
    if (volume->components == 0 || volume->components > UINT32_MAX / 8)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': %" PRIu64 " components at each point",
                       volume->path, volume->components);
    *byte_count = points * volume->components * tl_scalar_bytes(volume->scalar); /* < 2^64 */
    return TL_OK;
}

/* ---- filling ---- */

typedef struct fill_job {
    const tli_volume *volume;
    double *xyz, *values;
} fill_job;

static void fill_row_points(const tli_volume *v, uint64_t j, uint64_t k, double *xyz)
{
    for (uint64_t i = 0; i < v->dims[0]; i++, xyz += 3)
        for (int axis = 0; axis < 3; axis++)
            xyz[axis] =
                v->origin[axis] + ((double)i * v->steps[0][axis] + (double)j * v->steps[1][axis] +
                                   (double)k * v->steps[2][axis]);
}

static const uint8_t *number_at(const tli_volume *v, uint64_t index)
{
    return v->bytes + index * tl_scalar_bytes(v->scalar);
}

/* Numbers that stand side by side are widened at once. */
static void fill_row_values(const tli_volume *v, uint64_t first, double *values)
{
    const uint64_t *strides = v->strides, components = v->components;
    double run[ROW_VALUES];
    if (strides[0] == components && (strides[3] == 1 || components == 1)) {
        tli_widen(number_at(v, first), v->scalar, v->big_endian, v->dims[0] * components, values);
        return;
    }
    for (uint64_t c = 0; c < components; c++)
        for (uint64_t i = 0; i < v->dims[0];) {
            uint64_t count = strides[0] == 1 ? v->dims[0] - i : 1;
            if (count > ROW_VALUES) count = ROW_VALUES;
            tli_widen(number_at(v, first + i * strides[0] + c * strides[3]), v->scalar,
                      v->big_endian, count, run);
            for (uint64_t n = 0; n < count; n++, i++) values[i * components + c] = run[n];
        }
}

/* Rows [begin, end) along i. */
static tl_status fill_rows(void *arg, size_t begin, size_t end, unsigned worker)
{
    const fill_job *job = arg;
    const tli_volume *v = job->volume;
    const bool scaled = v->slope != 1 || v->inter != 0;
    (void)worker;
    for (size_t row = begin; row < end; row++) {
        const uint64_t j = row % v->dims[1], k = row / v->dims[1], point = row * v->dims[0];
        double *values = job->values + point * v->components;
        fill_row_points(v, j, k, job->xyz + 3 * point);
        fill_row_values(v, j * v->strides[1] + k * v->strides[2], values);
        for (uint64_t n = 0; scaled && n < v->dims[0] * v->components; n++)
            values[n] = values[n] * v->slope + v->inter;
    }
    return TL_OK;
}

tl_status tli_volume_to_grid(tl_ctx *ctx, const tli_volume *volume, tli_grid *grid)
{
    uint64_t needed = 0;
    tli_grid_array *array = NULL;
    tl_status st = tli_volume_bytes(ctx, volume, &needed);
    if (st) return st;
    if (needed > volume->byte_count)
        return tl_fail(ctx, TL_ERR_FORMAT,
                       "'%s': %" PRIu64 " bytes of values, expected %" PRIu64 " for %" PRIu64
                       " x %" PRIu64 " x %" PRIu64 " points of %" PRIu64 " components",
                       volume->path, volume->byte_count, needed, volume->dims[0], volume->dims[1],
                       volume->dims[2], volume->components);
    if (needed < volume->byte_count)
        tl_log(ctx, TL_LOG_INFO, "'%s': %" PRIu64 " bytes follow the values", volume->path,
               volume->byte_count - needed);
    grid->blocks = tl_mem_zalloc(ctx, 1, sizeof *grid->blocks, &st);
    if (st) return st;
    for (int axis = 0; axis < 3; axis++) grid->blocks[0].dims[axis] = (uint32_t)volume->dims[axis];
    grid->block_count = 1;
    grid->point_count = volume->dims[0] * volume->dims[1] * volume->dims[2];
    bool scaled = volume->slope != 1 || volume->inter != 0;
    st = tli_grid_add(grid, TL_ON_VERTEX, volume->name, (uint32_t)volume->components,
                      scaled ? TL_F64 : volume->type, NULL, &array);
    grid->xyz = tl_mem_alloc(ctx, (size_t)grid->point_count, 3 * sizeof *grid->xyz, &st);
    if (st) return st;
    fill_job job = {volume, grid->xyz, array->values};
    return tli_parallel(ctx, (size_t)(volume->dims[1] * volume->dims[2]),
                        PIECE_POINTS / (size_t)volume->dims[0] + 1, fill_rows, &job);
}

tl_status tli_volume_text(tli_scan *scan, uint64_t count, tli_map *numbers)
{
    tl_status st = tli_scan_room(scan, "values", count, 2);
    double *values = tl_mem_alloc(scan->ctx, (size_t)count, sizeof *values, &st);
    if (!st) st = tli_scan_reals(scan, "a value", count, values);
    if (st) {
        tl_mem_free(scan->ctx, values);
        return st;
    }
    *numbers = (tli_map){
        .bytes = (const uint8_t *)values, .byte_count = count * sizeof *values, .owned = values};
    return TL_OK;
}
