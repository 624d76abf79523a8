/* What every reader fills: a grid with its arrays, and the widening of a file's numbers to float64.
 */
#include "formats/formats_grid.h"

#include <math.h>
#include <string.h>

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
static const bool HOST_BIG_ENDIAN = true;
#else
static const bool HOST_BIG_ENDIAN = false;
#endif

/* ---- grid ---- */

static void arrays_release(tl_ctx *ctx, tli_grid_array *arrays, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        tl_mem_free(ctx, arrays[i].name);
        tl_mem_free(ctx, arrays[i].values);
    }
    tl_mem_free(ctx, arrays);
}

void tli_grid_init(tl_ctx *ctx, tli_grid *grid)
{
    *grid = (tli_grid){.ctx = ctx, .time = (double)NAN};
}

void tli_grid_release(tli_grid *grid)
{
    tl_ctx *ctx = grid->ctx;
    arrays_release(ctx, grid->cell_arrays, grid->cell_array_count);
    arrays_release(ctx, grid->point_arrays, grid->point_array_count);
    for (uint32_t i = 0; i < grid->label_count; i++) {
        tl_mem_free(ctx, grid->labels[i].name);
        tl_mem_free(ctx, grid->labels[i].offsets);
        tl_mem_free(ctx, grid->labels[i].points);
    }
    for (uint32_t i = 0; i < grid->region_name_count; i++)
        tl_mem_free(ctx, grid->region_names[i].name);
    tl_mem_free(ctx, grid->labels);
    tl_mem_free(ctx, grid->region_names);
    tl_mem_free(ctx, grid->regions);
    tl_mem_free(ctx, grid->face_points);
    tl_mem_free(ctx, grid->face_offsets);
    tl_mem_free(ctx, grid->connectivity);
    tl_mem_free(ctx, grid->offsets);
    tl_mem_free(ctx, grid->types);
    tl_mem_free(ctx, grid->blanks);
    tl_mem_free(ctx, grid->blocks);
    tl_mem_free(ctx, grid->xyz);
    tli_grid_init(ctx, grid);
}

uint64_t tli_grid_cell_count(const tli_grid *grid)
{
    if (grid->block_count == 0) return grid->cell_count;
    uint64_t sum = 0;
    for (uint32_t b = 0; b < grid->block_count; b++) {
        uint64_t cells = 1;
        for (int axis = 0; axis < 3; axis++) {
            uint32_t dim = grid->blocks[b].dims[axis];
            cells *= dim > 1 ? dim - 1 : dim;
        }
        sum += cells;
    }
    return sum;
}

tl_status tli_grid_add(tli_grid *grid, tl_on on, const char *name, uint32_t components,
                       tl_scalar scalar, double *values, tli_grid_array **array)
{
    tl_ctx *ctx = grid->ctx;
    bool on_points = on == TL_ON_VERTEX;
    tli_grid_array **list = on_points ? &grid->point_arrays : &grid->cell_arrays;
    uint32_t *list_count = on_points ? &grid->point_array_count : &grid->cell_array_count;
    uint64_t count = on_points ? grid->point_count : tli_grid_cell_count(grid);
    size_t value_count;
    if (components == 0)
        return tl_fail(ctx, TL_ERR_FORMAT, "array '%s': 0 components, expected at least 1",
                       name ? name : "");
    if (count > SIZE_MAX || !tli_mul_size((size_t)count, components, &value_count))
        return tl_fail(ctx, TL_ERR_FORMAT, "array '%s': %llu tuples of %u components overflow",
                       name, (unsigned long long)count, components);

    tl_status st = TL_OK;
    *list = tl_mem_resize(ctx, *list, (size_t)*list_count + 1, sizeof **list, &st);
    char *own_name = tli_strdup(ctx, name ? name : "", &st);
    double *own_values = values ? values : tl_mem_alloc(ctx, value_count, sizeof *values, &st);
    if (st) {
        if (!values) tl_mem_free(ctx, own_values);
        tl_mem_free(ctx, own_name);
        return st;
    }
    tli_grid_array *added = &(*list)[(*list_count)++];
    *added = (tli_grid_array){.name = own_name,
                              .components = components,
                              .scalar = scalar,
                              .count = count,
                              .values = own_values};
    if (array) *array = added;
    return TL_OK;
}

/* ---- names ---- */

tl_status tli_grid_name_region(tli_grid *grid, int32_t id, const char *name)
{
    tl_status st = TL_OK;
    if (!name || !*name) return TL_OK;
    for (uint32_t i = 0; i < grid->region_name_count; i++)
        if (grid->region_names[i].id == id) return TL_OK;
    grid->region_names =
        tl_mem_resize(grid->ctx, grid->region_names, (size_t)grid->region_name_count + 1,
                      sizeof *grid->region_names, &st);
    char *own = tli_strdup(grid->ctx, name, &st);
    if (!st) grid->region_names[grid->region_name_count++] = (tli_grid_name){id, own};
    return st;
}

/* Puts the faces of a label behind those of another of the same name. */
static tl_status grow_label(tl_ctx *ctx, tli_grid_label *label, uint64_t face_count,
                            const uint64_t *offsets, const uint32_t *points)
{
    tl_status st = TL_OK;
    size_t faces = (size_t)label->face_count, used = (size_t)label->offsets[faces];
    size_t more = (size_t)(offsets[face_count] - offsets[0]);
    label->offsets =
        tl_mem_resize(ctx, label->offsets, faces + (size_t)face_count + 1, sizeof *offsets, &st);
    label->points = tl_mem_resize(ctx, label->points, used + more, sizeof *points, &st);
    if (st) return st;
    if (more) memcpy(label->points + used, points + offsets[0], more * sizeof *points);
    for (uint64_t f = 0; f < face_count; f++)
        label->offsets[faces + f + 1] = used + (offsets[f + 1] - offsets[0]);
    label->face_count += face_count;
    return TL_OK;
}

tl_status tli_grid_add_label(tli_grid *grid, const char *name, int32_t id, uint64_t face_count,
                             uint64_t *offsets, uint32_t *points)
{
    tl_ctx *ctx = grid->ctx;
    tl_status st = TL_OK;
    if (!name) name = "";
    for (uint32_t i = 0; i < grid->label_count; i++) {
        tli_grid_label *label = &grid->labels[i];
        if (label->id != id || strcmp(label->name, name) != 0) continue;
        st = grow_label(ctx, label, face_count, offsets, points);
        if (st) return st;
        tl_mem_free(ctx, offsets);
        tl_mem_free(ctx, points);
        return TL_OK;
    }
    grid->labels =
        tl_mem_resize(ctx, grid->labels, (size_t)grid->label_count + 1, sizeof *grid->labels, &st);
    char *own = tli_strdup(ctx, name, &st);
    if (!st)
        grid->labels[grid->label_count++] = (tli_grid_label){own, id, face_count, offsets, points};
    return st;
}

void tli_grid_drop_array(tli_grid *grid, tl_on on, uint32_t index)
{
    bool points = on == TL_ON_VERTEX;
    tli_grid_array *arrays = points ? grid->point_arrays : grid->cell_arrays;
    uint32_t *count = points ? &grid->point_array_count : &grid->cell_array_count;
    tl_mem_free(grid->ctx, arrays[index].name);
    tl_mem_free(grid->ctx, arrays[index].values);
    memmove(arrays + index, arrays + index + 1, (*count - index - 1) * sizeof *arrays);
    (*count)--;
}

/* ---- widening ---- */

/* One loop a type: loads are unaligned, swaps are free of branches, and the compiler vectorises. */
#define WIDEN(type, raw_type, swap)                                                                \
    for (uint64_t i = 0; i < count; i++) {                                                         \
        raw_type raw;                                                                              \
        type number;                                                                               \
        memcpy(&raw, in + i * sizeof raw, sizeof raw);                                             \
        raw = swap(raw);                                                                           \
        memcpy(&number, &raw, sizeof raw);                                                         \
        values[i] = (double)number;                                                                \
    }
#define AS_IS(raw) (raw)

static void widen_native(const uint8_t *in, tl_scalar scalar, uint64_t count, double *values)
{
    switch (scalar) {
    case TL_I8: WIDEN(int8_t, uint8_t, AS_IS) break;
    case TL_U8: WIDEN(uint8_t, uint8_t, AS_IS) break;
    case TL_I16: WIDEN(int16_t, uint16_t, AS_IS) break;
    case TL_U16: WIDEN(uint16_t, uint16_t, AS_IS) break;
    case TL_I32: WIDEN(int32_t, uint32_t, AS_IS) break;
    case TL_U32: WIDEN(uint32_t, uint32_t, AS_IS) break;
    case TL_I64: WIDEN(int64_t, uint64_t, AS_IS) break;
    case TL_U64: WIDEN(uint64_t, uint64_t, AS_IS) break;
    case TL_F32: WIDEN(float, uint32_t, AS_IS) break;
    case TL_F64: memcpy(values, in, (size_t)count * sizeof *values); break;
    }
}

static void widen_swapped(const uint8_t *in, tl_scalar scalar, uint64_t count, double *values)
{
    switch (scalar) {
    case TL_I8: WIDEN(int8_t, uint8_t, AS_IS) break;
    case TL_U8: WIDEN(uint8_t, uint8_t, AS_IS) break;
    case TL_I16: WIDEN(int16_t, uint16_t, __builtin_bswap16) break;
    case TL_U16: WIDEN(uint16_t, uint16_t, __builtin_bswap16) break;
    case TL_I32: WIDEN(int32_t, uint32_t, __builtin_bswap32) break;
    case TL_U32: WIDEN(uint32_t, uint32_t, __builtin_bswap32) break;
    case TL_I64: WIDEN(int64_t, uint64_t, __builtin_bswap64) break;
    case TL_U64: WIDEN(uint64_t, uint64_t, __builtin_bswap64) break;
    case TL_F32: WIDEN(float, uint32_t, __builtin_bswap32) break;
    case TL_F64: WIDEN(double, uint64_t, __builtin_bswap64) break;
    }
}

void tli_widen(const void *bytes, tl_scalar scalar, bool big_endian, uint64_t count, double *values)
{
    if (count == 0) return;
    if (big_endian == HOST_BIG_ENDIAN)
        widen_native(bytes, scalar, count, values);
    else
        widen_swapped(bytes, scalar, count, values);
}
