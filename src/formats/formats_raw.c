/* Raw volumes: nothing but values on a regular grid, x fastest. What they are, the caller says. */
#include "formats/formats_grid.h"

#include <inttypes.h>
#include <string.h>

#define GRAIN ((size_t)1 << 16) /* points a thread works on at a time */

typedef struct job {
    const uint8_t *bytes;
    tl_scalar scalar;
    bool big_endian;
    const uint32_t *dims;
    double *xyz, *values;
} job;

static tl_status read_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const job *work = arg;
    (void)worker;
    tli_widen(work->bytes + begin * tl_scalar_bytes(work->scalar), work->scalar, work->big_endian,
              end - begin, work->values + begin);
    size_t row = begin / work->dims[0], i = begin % work->dims[0];
    for (size_t at = begin; at < end; row++, i = 0) {
        const double y = (double)(row % work->dims[1]), z = (double)(row / work->dims[1]);
        for (; i < work->dims[0] && at < end; i++, at++) {
            work->xyz[3 * at] = (double)i;
            work->xyz[3 * at + 1] = y;
            work->xyz[3 * at + 2] = z;
        }
    }
    return TL_OK;
}

tl_status tli_raw_check(tl_ctx *ctx, const tli_map *map, const char *path, const tl_read_opts *opts,
                        uint64_t *points)
{
    const uint32_t *dims = opts->raw_dims;
    uint64_t count = 1;
    if ((unsigned)opts->raw_scalar > TL_F64 || !dims[0] || !dims[1] || !dims[2])
        return tl_fail(
            ctx, TL_ERR_ARG,
            "'%s': raw volume of %u x %u x %u values of type %d, expected dimensions above "
            "0 and a known type",
            path, dims[0], dims[1], dims[2], (int)opts->raw_scalar);
    for (int axis = 0; axis < 3; axis++) {
        count *= dims[axis]; /* below 2^32 before, so below 2^64 */
        if (count > TL_MESH_VERTS_MAX)
            return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                           "'%s': raw volume of %u x %u x %u points, at most %u can be held", path,
                           dims[0], dims[1], dims[2], TL_MESH_VERTS_MAX);
    }
    uint64_t expected = count * tl_scalar_bytes(opts->raw_scalar);
    if (map->byte_count != expected)
        return tl_fail(ctx, TL_ERR_FORMAT,
                       "'%s': %" PRIu64 " bytes, expected %" PRIu64
                       " for %u x %u x %u values of %zu bytes",
                       path, map->byte_count, expected, dims[0], dims[1], dims[2],
                       tl_scalar_bytes(opts->raw_scalar));
    *points = count;
    return TL_OK;
}

tl_status tli_read_raw(tl_ctx *ctx, const tli_map *map, const char *path, const tl_read_opts *opts,
                       tli_grid *grid)
{
    uint64_t points = 0;
    tli_grid_array *array = NULL;
    tl_status st = tli_raw_check(ctx, map, path, opts, &points);
    if (st) return st;
    grid->blocks = tl_mem_zalloc(ctx, 1, sizeof *grid->blocks, &st);
    if (st) return st;
    memcpy(grid->blocks->dims, opts->raw_dims, sizeof grid->blocks->dims);
    grid->block_count = 1;
    grid->point_count = points;
    st = tli_grid_add(grid, TL_ON_VERTEX, "value", 1, opts->raw_scalar, NULL, &array);
    grid->xyz = tl_mem_alloc(ctx, (size_t)points, 3 * sizeof *grid->xyz, &st);
    if (st) return st;
    job work = {.bytes = map->bytes,
                .scalar = opts->raw_scalar,
                .big_endian = opts->raw_big_endian,
                .dims = opts->raw_dims,
                .xyz = grid->xyz,
                .values = array->values};
    return tli_parallel(ctx, (size_t)points, GRAIN, read_piece, &work);
}
