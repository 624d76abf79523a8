/* Legacy VTK files: attributes of points and cells, fields, metadata. */
#include "formats/formats_legacy.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

/* What an attribute's header line holds after its name. */
typedef enum shape {
    SHAPE_TYPE,            /* type; components is fixed */
    SHAPE_SCALARS,         /* type, perhaps components; LOOKUP_TABLE and a name on the next line */
    SHAPE_COMPONENTS_TYPE, /* components, type */
    SHAPE_COLORS,          /* components; bytes, or text from 0 to 1 */
    SHAPE_LOOKUP_TABLE,    /* size; four bytes, or text from 0 to 1, an entry. Left out */
    SHAPE_FIELD
} shape;

typedef struct attribute {
    const char *keyword;
    shape shape;
    uint32_t components;
} attribute;

static const attribute attributes[] = {
    {"SCALARS", SHAPE_SCALARS, 1},
    {"VECTORS", SHAPE_TYPE, 3},
    {"NORMALS", SHAPE_TYPE, 3},
    {"TENSORS", SHAPE_TYPE, 9},
    {"TENSORS6", SHAPE_TYPE, 6},
    {"TEXTURE_COORDINATES", SHAPE_COMPONENTS_TYPE, 0},
    {"GLOBAL_IDS", SHAPE_TYPE, 1},
    {"PEDIGREE_IDS", SHAPE_TYPE, 1},
    {"EDGE_FLAGS", SHAPE_TYPE, 1},
    {"COLOR_SCALARS", SHAPE_COLORS, 0},
    {"LOOKUP_TABLE", SHAPE_LOOKUP_TABLE, 4},
    {"FIELD", SHAPE_FIELD, 0},
};

#define COLOR_MAX 255

static uint64_t tuple_count(const tli_legacy *reader)
{
    return reader->on == TL_ON_VERTEX ? reader->grid->point_count
                                      : tli_grid_cell_count(reader->grid);
}

/* Older files mark ghosts by their level, 0 for what is no ghost. */
static void ghost_levels_to_type(double *values, uint64_t count)
{
    for (uint64_t i = 0; i < count; i++) values[i] = values[i] > 0;
}

/* Reads an array of points or cells and hands it to the grid. */
static tl_status read_array(tli_legacy *reader, const char *name, const tli_legacy_type *type,
                            uint64_t components)
{
    double *values = NULL;
    const uint64_t count = tuple_count(reader);
    if (components < 1 || components > UINT32_MAX)
        return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                               "array '%.80s' has %" PRIu64 " components, expected at least 1",
                               name, components);
    reader->components = (uint32_t)components;
    if (type->family == TLI_LEGACY_STRING || type->family == TLI_LEGACY_VARIANT) {
        tl_log(reader->ctx, TL_LOG_INFO, "'%s': array '%s' of type %s is left out", reader->path,
               name, type->name);
        return tli_legacy_skip_array(reader, name, type, count, components);
    }
    if (reader->places)
        return tli_legacy_locate_array(reader, name, type, (uint32_t)components, count);
    tl_status st = tli_legacy_read_numbers(reader, name, type, count, components, &values);
    if (!st && !strcmp(name, "vtkGhostLevels") && components == 1) {
        ghost_levels_to_type(values, count);
        name = "vtkGhostType";
    }
    if (!st)
        st = tli_grid_add(reader->grid, reader->on, name, (uint32_t)components, type->scalar,
                          values, NULL);
    if (st) tl_mem_free(reader->ctx, values);
    return st;
}

/* ---- attributes ---- */

/* SCALARS name type, then perhaps the number of components, then perhaps LOOKUP_TABLE name. */
static tl_status read_scalars(tli_legacy *reader, const char *name)
{
    const tli_legacy_type *type;
    uint64_t components = 1;
    tli_legacy_word word;
    tl_status st = tli_legacy_read_type(reader, &type);
    const char *before = reader->at;
    if (!st && tli_legacy_next_in_line(reader, &word)) {
        reader->at = before;
        if (!tli_legacy_is(&word, "LOOKUP_TABLE"))
            st = tli_legacy_read_count(reader, "the number of components", &components);
    }
    if (!st && tli_legacy_take(reader, "LOOKUP_TABLE"))
        (void)tli_legacy_next_in_line(reader, &word); /* its name */
    return st ? st : read_array(reader, name, type, components);
}

static tl_status read_colors(tli_legacy *reader, const char *name)
{
    uint64_t components, count = tuple_count(reader);
    double *values = NULL;
    tl_status st = tli_legacy_read_count(reader, "the number of components", &components);
    if (st || reader->binary)
        return st ? st : read_array(reader, name, tli_legacy_u8(), components);
    if (components < 1 || components > COLOR_MAX)
        return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                               "colours of %" PRIu64 " components, expected 1 to %d", components,
                               COLOR_MAX);
    reader->components = (uint32_t)components;
    st = tli_legacy_read_numbers(reader, name, tli_legacy_f32(), count, components, &values);
    if (st) return st;
    for (uint64_t i = 0; i < count * components; i++) {
        double byte = floor(values[i] * COLOR_MAX + 0.5);
        values[i] = byte > 0 ? fmin(byte, COLOR_MAX) : 0; /* of NaN: 0 */
    }
    st = tli_grid_add(reader->grid, reader->on, name, (uint32_t)components, TL_U8, values, NULL);
    if (st) tl_mem_free(reader->ctx, values);
    return st;
}

static tl_status skip_lookup_table(tli_legacy *reader)
{
    uint64_t size;
    tl_status st = tli_legacy_read_count(reader, "the size of the lookup table", &size);
    const tli_legacy_type *type = reader->binary ? tli_legacy_u8() : tli_legacy_f32();
    return st ? st : tli_legacy_skip_array(reader, "LOOKUP_TABLE", type, size, 4);
}

tl_status tli_legacy_read_attribute(tli_legacy *reader, const tli_legacy_word *keyword, bool *known)
{
    const attribute *found = NULL;
    for (size_t i = 0; i < sizeof attributes / sizeof *attributes; i++)
        if (tli_legacy_is(keyword, attributes[i].keyword)) found = &attributes[i];
    *known = found != NULL;
    if (!found) return TL_OK;
    if (found->shape == SHAPE_FIELD) return tli_legacy_read_field(reader);
    if (!reader->has_data)
        return tli_legacy_fail(reader, keyword->text, TL_ERR_FORMAT,
                               "expected POINT_DATA or CELL_DATA before %s", found->keyword);

    char name[TLI_LEGACY_NAME_MAX];
    const tli_legacy_type *type = NULL;
    uint64_t components = found->components;
    tl_status st = tli_legacy_read_name(reader, name);
    if (st) return st;
    switch (found->shape) {
    case SHAPE_SCALARS: return read_scalars(reader, name);
    case SHAPE_COLORS: return read_colors(reader, name);
    case SHAPE_LOOKUP_TABLE: return skip_lookup_table(reader);
    case SHAPE_COMPONENTS_TYPE:
        st = tli_legacy_read_count(reader, "the number of components", &components);
        break;
    default: break;
    }
    if (!st) st = tli_legacy_read_type(reader, &type);
    return st ? st : read_array(reader, name, type, components);
}

/* ---- fields ---- */

/* An array of the data set itself: the time is taken from it, others are counted. */
static tl_status read_global(tli_legacy *reader, const char *name, const tli_legacy_type *type,
                             uint64_t tuples, uint64_t components)
{
    static const char *const times[] = {"TIME", "TimeValue"};
    const tli_legacy_word word = {name, strlen(name)};
    bool is_time = tuples == 1 && components == 1 && type->family == TLI_LEGACY_NUMBER &&
                   (tli_legacy_is(&word, times[0]) || tli_legacy_is(&word, times[1]));
    if (!is_time) {
        reader->skipped_fields++;
        return tli_legacy_skip_array(reader, name, type, tuples, components);
    }
    double *values = NULL;
    tl_status st = tli_legacy_read_numbers(reader, name, type, 1, 1, &values);
    if (!st) reader->grid->time = values[0];
    tl_mem_free(reader->ctx, values);
    return st;
}

/* One array of a field: name, components, tuples, type, numbers. */
static tl_status read_field_array(tli_legacy *reader)
{
    char name[TLI_LEGACY_NAME_MAX];
    uint64_t components = 0, tuples = 0;
    const tli_legacy_type *type = NULL;
    if (tli_legacy_take(reader, "METADATA")) tli_legacy_skip_metadata(reader);
    tl_status st = tli_legacy_read_name(reader, name);
    if (st || !strcmp(name, "NULL_ARRAY")) return st;
    st = tli_legacy_read_count(reader, "the number of components", &components);
    if (!st) st = tli_legacy_read_count(reader, "the number of tuples", &tuples);
    if (!st) st = tli_legacy_read_type(reader, &type);
    if (st) return st;
    reader->components = components < UINT32_MAX ? (uint32_t)components : 0;
    if (!reader->has_data) return read_global(reader, name, type, tuples, components);
    const uint64_t expected = tuple_count(reader);
    if (tuples == expected) return read_array(reader, name, type, components);
    tl_log(reader->ctx, TL_LOG_WARNING,
           "'%s': array '%s' has %" PRIu64 " tuples, expected %" PRIu64 "; it is left out",
           reader->path, name, tuples, expected);
    return tli_legacy_skip_array(reader, name, type, tuples, components);
}

tl_status tli_legacy_read_field(tli_legacy *reader)
{
    char name[TLI_LEGACY_NAME_MAX];
    uint64_t arrays = 0;
    tl_status st = tli_legacy_read_name(reader, name);
    if (!st) st = tli_legacy_read_count(reader, "the number of arrays", &arrays);
    for (uint64_t i = 0; !st && i < arrays; i++) st = read_field_array(reader);
    return st;
}

/* ---- metadata ---- */

/* Up to an empty line; the names of components, a line each, may be empty themselves. */
void tli_legacy_skip_metadata(tli_legacy *reader)
{
    tli_legacy_word word;
    tli_legacy_skip_line(reader);
    while (reader->at < reader->end && tli_legacy_next_in_line(reader, &word)) {
        bool names = tli_legacy_is(&word, "COMPONENT_NAMES");
        tli_legacy_skip_line(reader);
        for (uint32_t i = 0; names && i < reader->components && reader->at < reader->end; i++)
            tli_legacy_skip_line(reader);
    }
}
