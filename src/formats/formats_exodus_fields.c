/* Exodus II: variables of nodes and elements. Each is a scalar; three in a row whose names differ
 * in a last letter x, y, z alone are the components of a vector, six that end in xx yy zz xy yz zx
 * (or xz) those of a symmetric tensor. */
#include "formats/formats_exodus.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Most variables of a kind. */
#define VARIABLES_MAX 65536

/* Ends of the names of components, in the order of the variables. */
static const struct {
    uint32_t components;
    const char *ends[6];
} kinds[] = {{3, {"x", "y", "z"}},
             {6, {"xx", "yy", "zz", "xy", "yz", "zx"}},
             {6, {"xx", "yy", "zz", "xy", "yz", "xz"}}};

/* The name without its end, in any case, and without a '_' before it; false if it ends otherwise.
 */
static bool stem_of(const char *name, const char *end, char stem[TLI_NC_NAME_MAX])
{
    size_t length = strlen(name), tail = strlen(end);
    if (length <= tail) return false;
    length -= tail;
    for (size_t i = 0; i < tail; i++)
        if (tolower((unsigned char)name[length + i]) != end[i]) return false;
    if (length > 1 && name[length - 1] == '_') length--;
    memcpy(stem, name, length);
    stem[length] = '\0';
    return true;
}

/* How many of the variables from i on are one array; its name. */
static tl_status array_at(tli_exodus *ex, const tli_nc_var *names, uint64_t i, uint64_t count,
                          uint32_t *components, char name[TLI_NC_NAME_MAX])
{
    char text[TLI_NC_NAME_MAX], stem[TLI_NC_NAME_MAX], other[TLI_NC_NAME_MAX];
    tl_status st = tli_nc_text(&ex->nc, names, i, name);
    *components = 1;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds && !st; k++) {
        uint32_t found = 1;
        if (count - i < kinds[k].components || !stem_of(name, kinds[k].ends[0], stem)) continue;
        while (found < kinds[k].components && !st) {
            st = tli_nc_text(&ex->nc, names, i + found, text);
            if (st || !stem_of(text, kinds[k].ends[found], other) || strcmp(stem, other)) break;
            found++;
        }
        if (found < kinds[k].components) continue;
        *components = found;
        memcpy(name, stem, sizeof stem);
        break;
    }
    return st;
}

/* One nodal variable: a table of its own or, in old files, a part of one of all. */
static tl_status read_nodal(tli_exodus *ex, uint64_t number, uint64_t count, double *out,
                            size_t stride)
{
    const tli_nc_var *own = tli_nc_find_numbered(&ex->nc, "vals_nod_var", number + 1);
    const tli_nc_var *all = tli_nc_find(&ex->nc, "vals_nod_var");
    uint64_t points = ex->grid->point_count;
    if (own) return tli_nc_reals(&ex->nc, own, ex->step, 0, points, out, stride);
    if (all && number < count)
        return tli_nc_reals(&ex->nc, all, ex->step, number * points, points, out, stride);
    return tl_fail(ex->ctx, TL_ERR_FORMAT, "'%s': nodal variable %llu has no values", ex->nc.path,
                   (unsigned long long)number + 1);
}

/* One element variable: a table for each block that has it; others are NaN. */
static tl_status read_element(tli_exodus *ex, uint64_t number, double *out, size_t stride)
{
    tl_status st = TL_OK;
    for (uint64_t b = 0; b < ex->block_count && !st; b++) {
        const tli_ex_block *block = &ex->blocks[b];
        char name[64];
        double *to = out + block->first_cell * stride;
        snprintf(name, sizeof name, "vals_elem_var%llueb", (unsigned long long)number + 1);
        const tli_nc_var *var = tli_nc_find_numbered(&ex->nc, name, b + 1);
        if (var) st = tli_nc_reals(&ex->nc, var, ex->step, 0, block->cell_count, to, stride);
        for (uint64_t c = 0; !var && c < block->cell_count; c++) to[c * stride] = (double)NAN;
    }
    return st;
}

/* The number type of the first table of a variable. */
static tl_scalar scalar_of(const tli_exodus *ex, tl_on on, uint64_t number)
{
    char name[64];
    const tli_nc_var *var = tli_nc_find_numbered(&ex->nc, "vals_nod_var", number + 1);
    snprintf(name, sizeof name, "vals_elem_var%llueb", (unsigned long long)number + 1);
    for (uint64_t b = 0; on == TL_ON_TET && b < ex->block_count; b++) {
        var = tli_nc_find_numbered(&ex->nc, name, b + 1);
        if (var) break;
    }
    return var ? var->scalar : TL_F64;
}

static tl_status read_variables(tli_exodus *ex, tl_on on)
{
    bool nodal = on == TL_ON_VERTEX;
    const tli_nc_var *names = tli_nc_find(&ex->nc, nodal ? "name_nod_var" : "name_elem_var");
    uint64_t count = 0;
    tl_status st = TL_OK;
    tli_nc_length(&ex->nc, nodal ? "num_nod_var" : "num_elem_var", &count);
    const tli_nc_var *times = tli_nc_find(&ex->nc, "time_whole");
    if (!count || !names || !times || !times->is_record || !times->dims[0]) return TL_OK;
    if (count > VARIABLES_MAX)
        return tl_fail(ex->ctx, TL_ERR_FORMAT, "'%s': %llu variables, expected at most %d",
                       ex->nc.path, (unsigned long long)count, VARIABLES_MAX);
    for (uint64_t i = 0; i < count && !st;) {
        char name[TLI_NC_NAME_MAX];
        uint32_t components = 1;
        tli_grid_array *array = NULL;
        st = array_at(ex, names, i, count, &components, name);
        if (!st)
            st = tli_grid_add(ex->grid, on, name, components, scalar_of(ex, on, i), NULL, &array);
        for (uint32_t k = 0; k < components && !st; k++)
            st = nodal ? read_nodal(ex, i + k, count, array->values + k, components)
                       : read_element(ex, i + k, array->values + k, components);
        i += components;
    }
    return st;
}

tl_status tli_ex_fields(tli_exodus *ex)
{
    tl_status st = read_variables(ex, TL_ON_VERTEX);
    return st ? st : read_variables(ex, TL_ON_TET);
}
