/* EnSight: values of a variable. Gold: each part names its points or kinds of cells, and has all
 * first components, then all second ones; EnSight 6: components stand together. Symmetric tensors
 * 11 22 33 12 13 23 become xx yy zz xy yz xz, as VTK has them. */
#include "formats/formats_ensight.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

/* ---- where values go ---- */

static const tli_ensight_part *find_part(const tli_ensight_geo *geo, int64_t number)
{
    for (uint64_t p = 0; p < geo->part_count; p++)
        if (geo->parts[p].number == number) return &geo->parts[p];
    return NULL;
}

static const tli_ensight_section *find_section(const tli_ensight_geo *geo,
                                               const tli_ensight_part *part, const char *name)
{
    for (uint64_t s = 0; s < part->section_count; s++)
        if (strcmp(geo->sections[part->first_section + s].name, name) == 0)
            return &geo->sections[part->first_section + s];
    return NULL;
}

/* Component c of the file. */
static uint32_t place_of(uint32_t c, uint32_t components)
{
    static const uint8_t tensor[6] = {0, 1, 2, 3, 5, 4};
    return components == 6 ? tensor[c] : c;
}

static tl_status read_tuples(tli_scan *scan, bool gold, uint64_t first, uint64_t count,
                             tli_grid_array *array)
{
    const uint32_t components = array->components;
    tl_status st = TL_OK;
    const uint64_t total = count * components; /* both are bounded by the geometry */
    st = tli_scan_room(scan, "values", total, scan->binary ? 4 : 2);
    double *values = tl_mem_alloc(scan->ctx, (size_t)total, sizeof *values, &st);
    if (!st) st = tli_ensight_reals(scan, "a value", total, values);
    for (uint32_t c = 0; !st && c < components; c++)
        for (uint64_t i = 0; i < count; i++)
            array->values[(first + i) * components + place_of(c, components)] =
                gold ? values[c * count + i] : values[i * components + c];
    tl_mem_free(scan->ctx, values);
    return st;
}

/* One value for all: what is not defined. */
static tl_status skip_undefined(tli_scan *scan, const char *line)
{
    double value;
    if (strstr(line, "partial"))
        return tl_fail(scan->ctx, TL_ERR_UNSUPPORTED, "'%s': values of some points only (partial)",
                       scan->path);
    return strstr(line, "undef")
               ? tli_ensight_reals(scan, "the value of what is undefined", 1, &value)
               : TL_OK;
}

/* ---- parts ---- */

static tl_status begin_part(const tli_ensight_geo *geo, tli_scan *scan, const char *line,
                            const tli_ensight_part **part)
{
    int64_t number = 0;
    tl_status st;
    if (geo->gold) {
        st = tli_ensight_int(scan, "the number of a part", INT32_MIN, INT32_MAX, &number);
        if (!st && !scan->binary) {
            tli_span rest;
            tli_scan_line(scan, &rest);
        }
    } else {
        tli_scan rest;
        tli_scan_open(geo->ctx, scan->path, line + 4, strlen(line + 4), &rest);
        st = tli_scan_int(&rest, "the number of a part", INT32_MIN, INT32_MAX, &number);
    }
    if (st) return st;
    *part = find_part(geo, number);
    if (!*part) st = tli_scan_fail(scan, "values of part %" PRId64 ", which is not there", number);
    return st;
}

static tl_status read_line(const tli_ensight_geo *geo, tli_scan *scan, const char *line,
                           const tli_ensight_part *part, bool on_nodes, tli_grid_array *array)
{
    char name[TLI_ENSIGHT_LINE + 1];
    size_t length = strcspn(line, " ");
    memcpy(name, line, length);
    name[length] = '\0';
    tl_status st = skip_undefined(scan, line);
    if (st) return st;
    if (on_nodes && (strcmp(name, "coordinates") == 0 || strcmp(name, "block") == 0))
        return read_tuples(scan, geo->gold, part->first_point, part->point_count, array);
    const tli_ensight_section *section = on_nodes ? NULL : find_section(geo, part, name);
    if (!section)
        return tli_scan_fail(scan, "'%s' of part %" PRId64 ", which is not in the geometry", name,
                             part->number);
    return read_tuples(scan, geo->gold, section->first_cell, section->cell_count, array);
}

tl_status tli_ensight_values_read(const tli_ensight_geo *geo, tli_scan *scan,
                                  const tli_ensight_variable *variable)
{
    char line[TLI_ENSIGHT_LINE + 1];
    bool more = true;
    const tli_ensight_part *part = NULL;
    tli_grid_array *array = NULL;
    const bool nodes = variable->on_nodes;
    tl_status st = tli_grid_add(geo->grid, nodes ? TL_ON_VERTEX : TL_ON_TET, variable->name,
                                variable->components, TL_F32, NULL, &array);
    for (uint64_t i = 0; !st && i < array->count * array->components; i++)
        array->values[i] = (double)NAN;
    if (!st) st = tli_ensight_line(scan, line, &more); /* a description */
    if (!st && !geo->gold && nodes && geo->grid->point_count)
        st = read_tuples(scan, false, 0, geo->grid->point_count, array);
    while (!st) {
        st = tli_ensight_line(scan, line, &more);
        if (st || !more || strncmp(line, "END TIME STEP", 13) == 0) break;
        if (!line[0]) continue;
        if (strncmp(line, "part", 4) == 0)
            st = begin_part(geo, scan, line, &part);
        else if (!part)
            st = tli_scan_fail(scan, "'%s' before the first part", line);
        else
            st = read_line(geo, scan, line, part, nodes, array);
    }
    return st;
}
