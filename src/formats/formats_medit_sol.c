/* Values of Medit meshes: SolAtVertices says how many fields of which kinds each vertex has, then
 * the numbers of each vertex together. Symmetric tensors xx xy yy xz yz zz become xx yy zz xy yz
 * xz, as VTK has them. */
#include "formats/formats_medit.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define FIELDS_MAX 256
#define KIND_TENSOR 3

static uint32_t components_of(int64_t kind, int64_t dimension)
{
    if (kind == 1) return 1;
    if (kind == 2) return (uint32_t)dimension;
    return dimension == 2 ? 3 : 6;
}

static tl_status read_kinds(tli_medit *medit, int64_t *field_count, int64_t kinds[FIELDS_MAX],
                            uint64_t *numbers)
{
    tl_status st = tli_medit_int(medit, "the number of fields", 1, FIELDS_MAX, field_count);
    *numbers = 0;
    for (int64_t f = 0; !st && f < *field_count; f++) {
        st = tli_medit_int(medit, "a kind of field: scalar, vector or tensor", 1, 3, &kinds[f]);
        if (!st) *numbers += components_of(kinds[f], medit->dimension);
    }
    return st;
}

/* Vectors of the plane get a third component. */
static void place_value(const double *in, int64_t kind, int64_t dimension, double *out)
{
    static const uint8_t tensor_order[6] = {0, 2, 5, 1, 4, 3};
    if (kind == KIND_TENSOR && dimension == 3)
        for (int c = 0; c < 6; c++) out[c] = in[tensor_order[c]];
    else
        memcpy(out, in, components_of(kind, dimension) * sizeof *in);
}

static tl_status read_values(tli_medit *medit, uint64_t count, tli_grid *grid)
{
    int64_t field_count = 0, kinds[FIELDS_MAX];
    uint64_t numbers = 0;
    const uint32_t first = grid->point_array_count;
    tl_status st = read_kinds(medit, &field_count, kinds, &numbers);
    if (!st) {
        uint64_t bytes = medit->scan.binary ? medit->real_bytes : 2;
        st = tli_scan_room(&medit->scan, "vertices", count, numbers * bytes);
    }
    for (int64_t f = 0; !st && f < field_count; f++) {
        char name[40];
        uint32_t components = kinds[f] == 2 ? 3 : components_of(kinds[f], medit->dimension);
        tli_grid_array *array = NULL;
        snprintf(name, sizeof name, "solution%" PRId64, f + 1);
        st = tli_grid_add(grid, TL_ON_VERTEX, name, components,
                          medit->scan.binary && medit->real_bytes == 4 ? TL_F32 : TL_F64, NULL,
                          &array);
        if (!st) memset(array->values, 0, (size_t)count * components * sizeof *array->values);
    }
    for (uint64_t i = 0; !st && i < count; i++)
        for (int64_t f = 0; !st && f < field_count; f++) {
            tli_grid_array *array = &grid->point_arrays[first + f];
            double value[6];
            uint32_t components = components_of(kinds[f], medit->dimension);
            for (uint32_t c = 0; !st && c < components; c++)
                st = tli_medit_real(medit, "a value", &value[c]);
            if (!st)
                place_value(value, kinds[f], medit->dimension,
                            array->values + i * array->components);
        }
    return st;
}

static tl_status read_sections(tli_medit *medit, tli_grid *grid)
{
    bool more = true;
    tl_status st = TL_OK;
    while (!st && more) {
        tli_medit_section section;
        int64_t count = 0;
        st = tli_medit_next(medit, &section, &more);
        if (!st && more && strcmp(section.name, "SolAtVertices") == 0) {
            st = tli_medit_int(medit, "the number of vertices", 0, UINT32_MAX, &count);
            if (!st && (uint64_t)count != grid->point_count)
                st = tli_scan_fail(&medit->scan,
                                   "values of %" PRId64 " vertices, the mesh has %" PRIu64, count,
                                   grid->point_count);
            if (!st) st = read_values(medit, (uint64_t)count, grid);
        } else if (!st && more && strncmp(section.name, "SolAt", 5) == 0) {
            tl_log(medit->scan.ctx, TL_LOG_INFO, "'%s': %s left out", medit->scan.path,
                   section.name);
        }
        if (!st && more) st = tli_medit_leave(medit, &section);
    }
    return st;
}

tl_status tli_medit_read_sol(tl_ctx *ctx, const char *path, const tli_map *map, tli_grid *grid)
{
    tli_medit medit;
    tl_status st = tli_medit_open(ctx, path, map, &medit);
    return st ? st : read_sections(&medit, grid);
}
