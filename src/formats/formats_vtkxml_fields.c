/* VTK XML: point and cell data. The arrays of the first piece are taken as far as all pieces have
 * them with as many components; what is left out is said. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "formats/formats_vtkxml.h"

static uint64_t elements_of(const tli_vx_piece *piece, tl_on on)
{
    return on == TL_ON_VERTEX ? piece->point_count : piece->cell_count;
}

static bool same_name(tli_span a, tli_span b)
{
    return a.bytes == b.bytes && (a.bytes == 0 || memcmp(a.text, b.text, a.bytes) == 0);
}

/* The array of another piece that goes with one of the lead's: at the same place, or of that name.
 */
static tli_vx_array *match(const tli_vx_file *file, const tli_vx_piece *lead, size_t index,
                           const tli_vx_piece *piece)
{
    const tli_vx_array *wanted = &file->arrays[lead->first_array + index];
    for (size_t i = 0; i <= piece->array_count; i++) {
        size_t at = i == 0 ? index : i - 1;
        if (at >= piece->array_count) continue;
        tli_vx_array *array = &file->arrays[piece->first_array + at];
        if (array->section == wanted->section && same_name(array->name, wanted->name)) return array;
    }
    return NULL;
}

/* Components of an array over count elements: what the file says; else, of a file that does not say
 * it, as many as the values make. */
static tl_status find_components(tli_vx_file *file, tli_vx_array *array, uint64_t count,
                                 uint32_t *components)
{
    *components = array->components ? array->components : 1;
    uint64_t total;
    if (array->components == 0 && count > 0) {
        tl_status st = tli_vx_open(file, array);
        if (st) return st;
        uint64_t quotient = array->value_count / count;
        if (array->value_count % count == 0 && quotient > 1 && quotient <= 9)
            *components = (uint32_t)quotient;
    }
    if (count > SIZE_MAX / 8 / *components)
        total = UINT64_MAX;
    else
        total = count * *components;
    return tli_vx_open_expecting(file, array, total);
}

/* Checks one array of the lead in all pieces, before anything is allocated for it. */
static tl_status check_field(tli_vx_file *file, const tli_vx_piece *lead, tl_on on,
                             tli_vx_field *out, bool *is_complete)
{
    char label[128];
    tli_vx_array *first = &file->arrays[lead->first_array + out->index];
    tl_status st = find_components(file, first, elements_of(lead, on), &out->components);
    tli_vx_label(first, label, sizeof label);
    *is_complete = false;
    out->scalar = first->scalar;
    for (size_t p = 0; !st && p < file->piece_count; p++) {
        const tli_vx_piece *piece = &file->pieces[p];
        if (piece == lead || elements_of(piece, on) == 0) continue;
        tli_vx_array *array = match(file, lead, out->index, piece);
        uint32_t components = 0;
        if (array) st = find_components(file, array, elements_of(piece, on), &components);
        if (!st && components != out->components) {
            tl_log(file->ctx, TL_LOG_WARNING, "array %s left out: piece %zu %s", label, p + 1,
                   array ? "has it with another number of components" : "lacks it");
            return TL_OK;
        }
        if (array && array->scalar != out->scalar) out->scalar = TL_F64;
    }
    *is_complete = !st;
    return st;
}

tl_status tli_vx_read_placed(tli_vx_file *file, const tli_vx_array *array, uint32_t components,
                             const uint64_t place[3], const uint64_t counts[3],
                             const uint64_t whole[3], double *values)
{
    uint64_t total = counts[0] * counts[1] * counts[2] * components;
    tli_vx_target target = {.f64 = values};
    if (memcmp(counts, whole, 3 * sizeof *counts) == 0)
        return tli_vx_read(file, array, total, &target);
    tl_status st = TL_OK;
    double *part = tl_mem_alloc(file->ctx, (size_t)total, sizeof *part, &st);
    target.f64 = part;
    if (!st) st = tli_vx_read(file, array, total, &target);
    const double *row = part;
    size_t row_values = (size_t)counts[0] * components;
    for (uint64_t k = 0; !st && k < counts[2]; k++)
        for (uint64_t j = 0; j < counts[1]; j++, row += row_values) {
            uint64_t to = ((place[2] + k) * whole[1] + place[1] + j) * whole[0] + place[0];
            memcpy(values + to * components, row, row_values * sizeof *row);
        }
    tl_mem_free(file->ctx, part);
    return st;
}

/* Points or cells along the axes of an extent. */
static void count_axes(const int64_t extent[6], tl_on on, uint64_t counts[3])
{
    for (int axis = 0; axis < 3; axis++) {
        counts[axis] = (uint64_t)(extent[2 * axis + 1] - extent[2 * axis]) + 1;
        if (on == TL_ON_TET && counts[axis] > 1) counts[axis]--;
    }
}

static tl_status read_piece_values(tli_vx_file *file, const tli_vx_piece *piece, tl_on on,
                                   const tli_vx_array *array, uint32_t components,
                                   const int64_t *box, double *values)
{
    if (!box) {
        uint64_t first = on == TL_ON_VERTEX ? piece->first_point : piece->first_cell;
        tli_vx_target target = {.f64 = values + first * components};
        return tli_vx_read(file, array, elements_of(piece, on) * components, &target);
    }
    uint64_t place[3], counts[3], whole[3];
    count_axes(piece->extent, on, counts);
    count_axes(box, on, whole);
    for (int axis = 0; axis < 3; axis++)
        place[axis] = (uint64_t)(piece->extent[2 * axis] - box[2 * axis]);
    return tli_vx_read_placed(file, array, components, place, counts, whole, values);
}

static tl_status read_field(tli_vx_file *file, const tli_vx_piece *lead, tl_on on,
                            const tli_vx_field *what, const int64_t *box, tli_grid *grid)
{
    char name[256];
    tli_grid_array *array;
    tli_vx_field_name(what, name, sizeof name);
    tl_status st = tli_grid_add(grid, on, name, what->components, what->scalar, NULL, &array);
    if (!st && box && file->piece_count > 1) /* what no piece covers */
        for (uint64_t i = 0; i < array->count * array->components; i++)
            array->values[i] = (double)NAN;
    for (size_t p = 0; !st && p < file->piece_count; p++) {
        const tli_vx_piece *piece = &file->pieces[p];
        if (elements_of(piece, on) == 0) continue;
        st = read_piece_values(file, piece, on, match(file, lead, what->index, piece),
                               what->components, box, array->values);
    }
    return st;
}

/* The first piece that has elements; NULL if none has. */
static const tli_vx_piece *lead_of(const tli_vx_file *file, tl_on on)
{
    for (size_t p = 0; p < file->piece_count; p++)
        if (elements_of(&file->pieces[p], on)) return &file->pieces[p];
    return NULL;
}

tli_vx_array *tli_vx_field_in(const tli_vx_file *file, tl_on on, const tli_vx_field *field,
                              const tli_vx_piece *piece)
{
    return match(file, lead_of(file, on), field->index, piece);
}

void tli_vx_field_name(const tli_vx_field *field, char *name, size_t name_bytes)
{
    tli_span_text(field->name, name, name_bytes);
    if (!name[0]) snprintf(name, name_bytes, "unnamed");
}

tl_status tli_vx_fields_find(tli_vx_file *file, tl_on on, tli_vx_field **fields, size_t *count)
{
    tli_vx_section section = on == TL_ON_VERTEX ? TLI_VX_POINT_DATA : TLI_VX_CELL_DATA;
    const tli_vx_piece *piece = lead_of(file, on);
    tl_status st = TL_OK;
    *fields = NULL;
    *count = 0;
    if (!piece) return TL_OK;
    tli_vx_field *found = tl_mem_alloc(file->ctx, piece->array_count, sizeof *found, &st);
    for (size_t i = 0; !st && i < piece->array_count; i++) {
        const tli_vx_array *array = &file->arrays[piece->first_array + i];
        tli_vx_field what = {.index = i, .name = array->name};
        bool is_complete;
        if (array->section != section) continue;
        st = check_field(file, piece, on, &what, &is_complete);
        if (!st && is_complete) found[(*count)++] = what;
    }
    if (st)
        tl_mem_free(file->ctx, found);
    else
        *fields = found;
    return st;
}

static tl_status read_fields_on(tli_vx_file *file, tl_on on, const int64_t *box, tli_grid *grid)
{
    tli_vx_field *fields;
    size_t count;
    tl_status st = tli_vx_fields_find(file, on, &fields, &count);
    for (size_t i = 0; !st && i < count; i++)
        st = read_field(file, lead_of(file, on), on, &fields[i], box, grid);
    tl_mem_free(file->ctx, fields);
    return st;
}

tl_status tli_vx_fields_read(tli_vx_file *file, const int64_t box[6], tli_grid *grid)
{
    tl_status st = read_fields_on(file, TL_ON_VERTEX, box, grid);
    return st ? st : read_fields_on(file, TL_ON_TET, box, grid);
}
