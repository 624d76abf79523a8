/* What the tests of the readers share: reading a grid out of memory, damaging its bytes, and the
 * folder of real data. */
#ifndef TETRALOD_TESTS_CHECK_GRID_H
#define TETRALOD_TESTS_CHECK_GRID_H

#include "check.h"

#include "formats/formats_grid.h"

#include <sys/stat.h>

/* Calls a reader on bytes. */
typedef tl_status (*grid_reader)(tl_ctx *ctx, const tli_map *map, void *arg, tli_grid *grid);

static inline tl_ctx *grid_ctx(size_t budget_bytes, unsigned thread_count)
{
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.budget_bytes = budget_bytes;
    opts.thread_count = thread_count;
    CHECK(tl_ctx_create(&opts, &ctx) == TL_OK);
    return ctx;
}

/* Reads a copy of exactly that size, so that a sanitizer sees a read past its end. */
static inline tl_status grid_read(tl_ctx *ctx, grid_reader reader, void *arg, const void *bytes,
                                  size_t byte_count, tli_grid *grid)
{
    uint8_t *copy = malloc(byte_count ? byte_count : 1);
    CHECK(copy != NULL);
    if (byte_count) memcpy(copy, bytes, byte_count);
    tli_map map = {.bytes = copy, .byte_count = byte_count};
    tl_ctx_clear(ctx);
    tli_grid_init(ctx, grid);
    tl_status st = reader(ctx, &map, arg, grid);
    free(copy);
    return st;
}

/* What every grid promises, whatever the bytes were. */
static inline void grid_check(const tli_grid *grid)
{
    uint64_t points = 0;
    for (uint32_t b = 0; b < grid->block_count; b++)
        points +=
            (uint64_t)grid->blocks[b].dims[0] * grid->blocks[b].dims[1] * grid->blocks[b].dims[2];
    if (grid->block_count) CHECK_EQ(points, grid->point_count);
    const uint64_t cells = grid->block_count ? 0 : grid->cell_count;
    for (uint64_t i = 0; !grid->offsets && i < 4 * cells; i++) /* tets alone */
        CHECK(grid->connectivity[i] < grid->point_count);
    for (uint64_t cell = 0; grid->offsets && cell < cells; cell++)
        CHECK(grid->offsets[cell] <= grid->offsets[cell + 1]);
    for (uint64_t cell = 0; grid->offsets && cell < cells; cell++) {
        uint64_t limit =
            grid->types && grid->types[cell] == 42 ? grid->face_count : grid->point_count;
        for (uint64_t i = grid->offsets[cell]; i < grid->offsets[cell + 1]; i++)
            CHECK(grid->connectivity[i] < limit);
    }
    for (uint64_t f = 0; f < grid->face_count; f++)
        CHECK(grid->face_offsets[f] <= grid->face_offsets[f + 1]);
    for (uint64_t i = 0; grid->face_count && i < grid->face_offsets[grid->face_count]; i++)
        CHECK(grid->face_points[i] < grid->point_count);
    for (uint32_t l = 0; l < grid->label_count; l++)
        for (uint64_t i = 0; i < grid->labels[l].offsets[grid->labels[l].face_count]; i++)
            CHECK(grid->labels[l].points[i] < grid->point_count);
    for (uint32_t i = 0; i < grid->point_array_count; i++)
        CHECK_EQ(grid->point_arrays[i].count, grid->point_count);
    for (uint32_t i = 0; i < grid->cell_array_count; i++)
        CHECK_EQ(grid->cell_arrays[i].count, tli_grid_cell_count(grid));
}

/* Reads bytes that may be damaged: a whole grid or a message, and nothing left behind. */
static inline bool grid_survives(tl_ctx *ctx, grid_reader reader, void *arg, const void *bytes,
                                 size_t byte_count)
{
    tli_grid grid;
    tl_status st = grid_read(ctx, reader, arg, bytes, byte_count, &grid);
    if (st)
        CHECK(tl_ctx_message(ctx)[0] != 0);
    else
        grid_check(&grid);
    tli_grid_release(&grid);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    return !st;
}

/* Every prefix, and two changes of every byte. step > 1 takes each step-th place only. Returns how
 * many of the damaged files were refused. */
static inline size_t grid_survives_damage(tl_ctx *ctx, grid_reader reader, void *arg,
                                          const uint8_t *bytes, size_t byte_count, size_t step)
{
    size_t refused = 0;
    uint8_t *damaged = malloc(byte_count ? byte_count : 1);
    CHECK(damaged != NULL);
    memcpy(damaged, bytes, byte_count);
    for (size_t i = 0; i < byte_count; i += step) {
        refused += !grid_survives(ctx, reader, arg, bytes, i);
        damaged[i] = bytes[i] ^ 0xff;
        refused += !grid_survives(ctx, reader, arg, damaged, byte_count);
        damaged[i] = bytes[i] ^ (uint8_t)(1u << i % 7);
        refused += !grid_survives(ctx, reader, arg, damaged, byte_count);
        damaged[i] = bytes[i];
    }
    free(damaged);
    return refused;
}

static inline const tli_grid_array *grid_array(const tli_grid *grid, tl_on on, const char *name)
{
    const tli_grid_array *arrays = on == TL_ON_VERTEX ? grid->point_arrays : grid->cell_arrays;
    uint32_t count = on == TL_ON_VERTEX ? grid->point_array_count : grid->cell_array_count;
    for (uint32_t i = 0; i < count; i++)
        if (!strcmp(arrays[i].name, name)) return &arrays[i];
    fail_msg("there is no array '%s'", name);
    return NULL;
}

/* Smallest and largest value, of several components the norm's. */
static inline void grid_range(const tli_grid_array *array, double range[2])
{
    range[0] = (double)INFINITY;
    range[1] = -(double)INFINITY;
    for (uint64_t i = 0; i < array->count; i++) {
        double sum = 0;
        const double *v = array->values + i * array->components;
        for (uint32_t k = 0; k < array->components; k++) sum += v[k] * v[k];
        double value = array->components == 1 ? v[0] : sqrt(sum);
        range[0] = fmin(range[0], value);
        range[1] = fmax(range[1], value);
    }
}

/* A block of ni x nj x nk points with x from x0 on, a point array of the same x and
 * a cell array that counts. */
static inline tl_status grid_make_block(tl_ctx *ctx, double x0, uint32_t ni, uint32_t nj,
                                        uint32_t nk, const char *name, tli_grid *grid)
{
    tl_status st = TL_OK;
    tli_grid_array *points, *cells;
    tli_grid_init(ctx, grid);
    grid->point_count = (uint64_t)ni * nj * nk;
    grid->xyz = tl_mem_alloc(ctx, (size_t)grid->point_count, 3 * sizeof(double), &st);
    grid->blocks = tl_mem_zalloc(ctx, 1, sizeof *grid->blocks, &st);
    if (st) return st;
    grid->block_count = 1;
    grid->blocks[0] = (tli_grid_block){0, {ni, nj, nk}};
    st = tli_grid_add(grid, TL_ON_VERTEX, name, 1, TL_F32, NULL, &points);
    if (!st) st = tli_grid_add(grid, TL_ON_TET, "cell", 1, TL_I32, NULL, &cells);
    if (st) return st;
    for (uint64_t p = 0; p < grid->point_count; p++) {
        double *at = grid->xyz + 3 * p;
        at[0] = x0 + (double)(p % ni), at[1] = (double)(p / ni % nj), at[2] = (double)(p / ni / nj);
        points->values[p] = at[0];
    }
    for (uint64_t c = 0; c < cells->count; c++) cells->values[c] = (double)c;
    return TL_OK;
}

/* Sum of the signed volumes of all tets. */
static inline double volume_of(const tl_mesh *mesh)
{
    double sum = 0;
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        double p[4][3];
        for (int v = 0; v < 4; v++)
            memcpy(p[v], tl_mesh_xyz(mesh) + 3 * (size_t)tl_mesh_tets(mesh)[4 * t + (size_t)v],
                   sizeof p[v]);
        sum += tl_tet_volume((const double(*)[3])p);
    }
    return sum;
}

/* The bytes of a small whole number as a type, in a byte order; returns how many. */
static inline size_t grid_number(uint8_t bytes[8], tl_scalar scalar, bool big_endian, int value)
{
    uint64_t bits = (uint64_t)(int64_t)value;
    const size_t count = tl_scalar_bytes(scalar);
    const float narrow = (float)value;
    const double wide = value;
    uint32_t narrow_bits;
    memcpy(&narrow_bits, &narrow, sizeof narrow_bits);
    if (scalar == TL_F32) bits = narrow_bits;
    if (scalar == TL_F64) memcpy(&bits, &wide, sizeof bits);
    for (size_t i = 0; i < count; i++)
        bytes[i] = (uint8_t)(bits >> 8 * (big_endian ? count - 1 - i : i));
    return count;
}

/* Path of a real data set; false if this machine has none. */
static inline bool data_path(const char *name, char *path, size_t path_bytes)
{
    const char *folder = getenv("TETRALOD_DATA");
    struct stat info;
    if (folder)
        snprintf(path, path_bytes, "%s/%s", folder, name);
    else
        snprintf(path, path_bytes, "%s/../shared/data/%s", TETRALOD_SOURCE_DIR, name);
    return stat(path, &info) == 0;
}

#endif
