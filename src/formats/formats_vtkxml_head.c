/* VTK XML: reads the tags. What comes out is a list of pieces and of arrays with the place of their
 * numbers; the numbers are not looked at. The file formats are those of the VTK User's Guide and of
 * vtkXMLWriter; attributes that writers leave out get VTK's defaults. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "formats/formats_vtkxml.h"

#define ARRAYS_MAX 16384u    /* in one piece: searching them by name stays cheap */
#define COMPONENTS_MAX 4096u /* of an array */

static const char *const kind_names[] = {"UnstructuredGrid", "ImageData", "RectilinearGrid",
                                         "StructuredGrid"};

/* ---- small helpers ---- */

static tl_status fail_at(const tli_vx_file *file, uint64_t ofs, const char *what)
{
    return tl_fail(file->ctx, TL_ERR_FORMAT, "byte %llu: %s", (unsigned long long)ofs, what);
}

void tli_vx_label(const tli_vx_array *array, char *label, size_t label_bytes)
{
    char name[80];
    tli_span_text(array->name, name, sizeof name);
    snprintf(label, label_bytes, "'%s' at byte %llu", name, (unsigned long long)array->ofs);
}

tli_vx_array *tli_vx_find(const tli_vx_file *file, const tli_vx_piece *piece,
                          tli_vx_section section, const char *name)
{
    for (size_t i = 0; i < piece->array_count; i++) {
        tli_vx_array *array = &file->arrays[piece->first_array + i];
        if (array->section == section && (!name || tli_span_is(array->name, name))) return array;
    }
    return NULL;
}

/* Room for one more element; doubles. */
static void *grow(tl_ctx *ctx, void *block, size_t count, size_t *capacity, size_t elem_bytes,
                  tl_status *st)
{
    if (count < *capacity) return block;
    size_t wanted = *capacity ? 2 * *capacity : 16;
    block = tl_mem_resize(ctx, block, wanted, elem_bytes, st);
    if (!*st) *capacity = wanted;
    return block;
}

/* Reads the next token inside an element; *inside is false after its end tag. */
static tl_status next_inside(tli_xml *xml, const tli_xml_token *element, tli_xml_token *token,
                             bool *inside)
{
    *inside = false;
    if (element->kind == TLI_XML_EMPTY) return TL_OK;
    tl_status st = tli_xml_next(xml, token);
    if (st) return st;
    int name_bytes = element->name.bytes < 64 ? (int)element->name.bytes : 64;
    if (token->kind == TLI_XML_DONE)
        return tl_fail(xml->ctx, TL_ERR_FORMAT,
                       "byte %llu: the file ends inside <%.*s>, which begins at byte %llu",
                       (unsigned long long)token->ofs, name_bytes, element->name.text,
                       (unsigned long long)element->ofs);
    if (token->kind != TLI_XML_END) {
        *inside = true;
        return TL_OK;
    }
    if (token->name.bytes == element->name.bytes &&
        memcmp(token->name.text, element->name.text, token->name.bytes) == 0)
        return TL_OK;
    return tl_fail(xml->ctx, TL_ERR_FORMAT, "byte %llu: </%.*s>, expected </%.*s>",
                   (unsigned long long)token->ofs,
                   token->name.bytes < 64 ? (int)token->name.bytes : 64, token->name.text,
                   name_bytes, element->name.text);
}

static bool is_element(const tli_xml_token *token, const char *name)
{
    return (token->kind == TLI_XML_START || token->kind == TLI_XML_EMPTY) &&
           tli_span_is(token->name, name);
}

/* ---- arrays ---- */

static bool scalar_of(tli_span type, tl_scalar *scalar)
{
    static const char *const names[] = {"Int8",   "UInt8", "Int16",  "UInt16",  "Int32",
                                        "UInt32", "Int64", "UInt64", "Float32", "Float64"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (tli_span_is(type, names[i])) {
            *scalar = (tl_scalar)i;
            return true;
        }
    return false;
}

/* Coding and, of appended arrays, the offset, which is kept as length of an empty run until the
 * appended data are found. */
static tl_status read_format(tli_vx_file *file, const tli_xml_token *tag, tli_vx_array *array,
                             bool *appended)
{
    tli_span format, offset;
    *appended = false;
    if (!tli_xml_attribute(tag, "format", &format) || tli_span_is(format, "ascii")) {
        array->coding = TLI_VX_ASCII;
    } else if (tli_span_is(format, "binary")) {
        array->coding = TLI_VX_BASE64;
    } else if (tli_span_is(format, "appended")) {
        uint64_t place;
        if (!tli_xml_attribute(tag, "offset", &offset) || !tli_span_u64(offset, &place) ||
            place > SIZE_MAX)
            return fail_at(file, tag->ofs, "an appended array without a valid 'offset'");
        array->run.bytes = (size_t)place;
        array->coding = TLI_VX_RAW;
        *appended = true;
    } else {
        return fail_at(file, tag->ofs, "unknown 'format', expected ascii, binary or appended");
    }
    return TL_OK;
}

/* The inline text of an array; its other children are passed over. */
static tl_status read_inline(tli_vx_file *file, tli_xml *xml, const tli_xml_token *tag,
                             tli_span *text)
{
    tli_xml_token token;
    bool inside;
    tl_status st;
    *text = (tli_span){"", 0};
    while (!(st = next_inside(xml, tag, &token, &inside)) && inside) {
        if (token.kind == TLI_XML_TEXT) {
            if (text->bytes)
                return fail_at(file, token.ofs, "the text of an array in two parts, expected one");
            *text = token.text;
        } else if ((st = tli_xml_skip(xml, &token))) {
            return st;
        }
    }
    return st;
}

/* Arrays of one time step only: those of the first are taken. */
static bool is_later_step(const tli_xml_token *tag)
{
    tli_span step;
    const char *end;
    if (!tli_xml_attribute(tag, "TimeStep", &step)) return false;
    end = memchr(step.text, ' ', step.bytes);
    if (end) step.bytes = (size_t)(end - step.text);
    uint64_t number;
    return tli_span_u64(step, &number) && number > 0;
}

static tl_status read_array(tli_vx_file *file, tli_xml *xml, const tli_xml_token *tag,
                            tli_vx_section section)
{
    tli_span type, components, text;
    tli_vx_array array = {.section = section, .ofs = tag->ofs, .name = {"", 0}};
    tli_xml_attribute(tag, "Name", &array.name);
    char label[128];
    tli_vx_label(&array, label, sizeof label);

    bool is_number = tli_xml_attribute(tag, "type", &type) && scalar_of(type, &array.scalar);
    bool is_later = is_later_step(tag);
    if (!is_number || is_later || !is_element(tag, "DataArray")) {
        if (section != TLI_VX_FIELD_DATA)
            tl_log(file->ctx, TL_LOG_INFO, "array %s left out: %s", label,
                   is_later ? "it belongs to a later time step" : "it holds no numbers");
        return tli_xml_skip(xml, tag);
    }
    uint64_t number;
    if (tli_xml_attribute(tag, "NumberOfComponents", &components)) {
        if (!tli_span_u64(components, &number) || number > COMPONENTS_MAX)
            return tl_fail(file->ctx, TL_ERR_FORMAT,
                           "array %s: 'NumberOfComponents' is no number up to %u", label,
                           COMPONENTS_MAX);
        array.components = (uint32_t)number;
    }
    bool appended;
    tl_status st = read_format(file, tag, &array, &appended);
    if (!st) st = read_inline(file, xml, tag, &text);
    if (st) return st;
    if (!appended) array.run = text;

    file->arrays =
        grow(file->ctx, file->arrays, file->array_count, &file->array_capacity, sizeof array, &st);
    if (!st) file->arrays[file->array_count++] = array;
    return st;
}

static tl_status read_section(tli_vx_file *file, tli_xml *xml, const tli_xml_token *element,
                              tli_vx_section section, size_t first_array)
{
    tli_xml_token token;
    bool inside;
    tl_status st;
    while (!(st = next_inside(xml, element, &token, &inside)) && inside) {
        if (is_element(&token, "DataArray") || is_element(&token, "Array"))
            st = read_array(file, xml, &token, section);
        else if (token.kind != TLI_XML_TEXT)
            st = tli_xml_skip(xml, &token);
        if (!st && file->array_count - first_array > ARRAYS_MAX)
            st = tl_fail(file->ctx, TL_ERR_UNSUPPORTED,
                         "byte %llu: more than %u arrays in one piece",
                         (unsigned long long)token.ofs, ARRAYS_MAX);
        if (st) return st;
    }
    return st;
}

/* ---- pieces ---- */

static tl_status read_extent(tli_vx_file *file, const tli_xml_token *tag, const char *name,
                             int64_t extent[6])
{
    tli_span value;
    bool valid = tli_xml_attribute(tag, name, &value) && tli_span_i64s(value, extent, 6);
    for (int i = 0; valid && i < 6; i++) valid = extent[i] >= INT32_MIN && extent[i] <= INT32_MAX;
    return valid
               ? TL_OK
               : tl_fail(file->ctx, TL_ERR_FORMAT, "byte %llu: '%s' is not six integers of 32 bits",
                         (unsigned long long)tag->ofs, name);
}

/* Points and cells of an extent; 0 points if it is empty. false on overflow. */
static bool count_extent(const int64_t extent[6], uint64_t *points, uint64_t *cells)
{
    *points = *cells = 1;
    for (int axis = 0; axis < 3; axis++)
        if (extent[2 * axis + 1] < extent[2 * axis]) *points = 0;
    for (int axis = 0; *points && axis < 3; axis++) {
        uint64_t count = (uint64_t)(extent[2 * axis + 1] - extent[2 * axis]) + 1;
        if (*points > UINT64_MAX / 64 / count) return false;
        *points *= count;
        *cells *= count > 1 ? count - 1 : 1;
    }
    if (*points == 0) *cells = 0;
    return true;
}

static tl_status read_piece_counts(tli_vx_file *file, const tli_xml_token *tag, tli_vx_piece *piece)
{
    if (file->kind != TLI_VX_UNSTRUCTURED) {
        tl_status st = read_extent(file, tag, "Extent", piece->extent);
        if (!st && !count_extent(piece->extent, &piece->point_count, &piece->cell_count))
            st = fail_at(file, tag->ofs, "'Extent' of more than 2^58 points");
        return st;
    }
    tli_span points, cells;
    if (!tli_xml_attribute(tag, "NumberOfPoints", &points) ||
        !tli_span_u64(points, &piece->point_count) ||
        !tli_xml_attribute(tag, "NumberOfCells", &cells) ||
        !tli_span_u64(cells, &piece->cell_count))
        return fail_at(file, tag->ofs, "<Piece> without valid 'NumberOfPoints', 'NumberOfCells'");
    return TL_OK;
}

static tl_status read_piece(tli_vx_file *file, tli_xml *xml, const tli_xml_token *tag)
{
    static const struct {
        const char *name;
        tli_vx_section section;
    } sections[] = {{"PointData", TLI_VX_POINT_DATA}, {"CellData", TLI_VX_CELL_DATA},
                    {"FieldData", TLI_VX_FIELD_DATA}, {"Points", TLI_VX_POINTS},
                    {"Cells", TLI_VX_CELLS},          {"Coordinates", TLI_VX_COORDINATES}};
    tli_vx_piece piece = {.ofs = tag->ofs, .first_array = file->array_count};
    tl_status st = read_piece_counts(file, tag, &piece);
    tli_xml_token token;
    bool inside = true;
    while (!st && !(st = next_inside(xml, tag, &token, &inside)) && inside) {
        size_t s = 0, section_count = sizeof sections / sizeof *sections;
        while (s < section_count && !is_element(&token, sections[s].name)) s++;
        if (s < section_count)
            st = read_section(file, xml, &token, sections[s].section, piece.first_array);
        else if (token.kind != TLI_XML_TEXT)
            st = tli_xml_skip(xml, &token);
    }
    if (st) return st;
    piece.array_count = file->array_count - piece.first_array;
    if (piece.point_count == 0 && piece.cell_count == 0) return TL_OK;
    file->pieces =
        grow(file->ctx, file->pieces, file->piece_count, &file->piece_capacity, sizeof piece, &st);
    if (!st) file->pieces[file->piece_count++] = piece;
    return st;
}

/* ---- data set and file ---- */

static tl_status read_image_frame(tli_vx_file *file, const tli_xml_token *tag)
{
    tli_span value;
    if ((tli_xml_attribute(tag, "Origin", &value) && !tli_span_f64s(value, file->origin, 3)) ||
        (tli_xml_attribute(tag, "Spacing", &value) && !tli_span_f64s(value, file->spacing, 3)) ||
        (tli_xml_attribute(tag, "Direction", &value) && !tli_span_f64s(value, file->direction, 9)))
        return fail_at(file, tag->ofs,
                       "'Origin', 'Spacing' or 'Direction' is not 3, 3 or 9 numbers");
    return TL_OK;
}

/* The time of the data: first of the steps in the file, or later field data. */
static void read_time_values(tli_vx_file *file, const tli_xml_token *tag)
{
    tli_span values;
    if (!tli_xml_attribute(tag, "TimeValues", &values)) return;
    const char *end = values.text;
    while (end < values.text + values.bytes && *end != ' ') end++;
    if (end < values.text + values.bytes)
        tl_log(file->ctx, TL_LOG_INFO, "several time steps in the file; the first is read");
    values.bytes = (size_t)(end - values.text);
    double time;
    if (tli_span_f64s(values, &time, 1)) file->time = time;
}

static tl_status read_data_set(tli_vx_file *file, tli_xml *xml, const tli_xml_token *tag)
{
    tli_xml_token token;
    bool inside = true;
    read_time_values(file, tag);
    tl_status st = file->kind == TLI_VX_IMAGE ? read_image_frame(file, tag) : TL_OK;
    while (!st && !(st = next_inside(xml, tag, &token, &inside)) && inside) {
        if (is_element(&token, "Piece"))
            st = read_piece(file, xml, &token);
        else if (is_element(&token, "FieldData"))
            st = read_section(file, xml, &token, TLI_VX_FIELD_DATA, file->array_count);
        else if (token.kind != TLI_XML_TEXT)
            st = tli_xml_skip(xml, &token);
    }
    return st;
}

/* Gives the appended arrays their runs, now that the data are found behind '_'. data NULL: the file
 * has none. */
static tl_status place_appended(tli_vx_file *file, const char *data, bool is_raw)
{
    const char *end = (const char *)file->map->bytes + file->map->byte_count;
    for (size_t i = 0; i < file->array_count; i++) {
        tli_vx_array *array = &file->arrays[i];
        if (array->coding != TLI_VX_RAW) continue;
        char label[128];
        tli_vx_label(array, label, sizeof label);
        if (!data)
            return tl_fail(file->ctx, TL_ERR_FORMAT, "array %s is appended, but there is no %s",
                           label, "<AppendedData> with '_' in the file");
        if (array->run.bytes > (size_t)(end - data))
            return tl_fail(file->ctx, TL_ERR_FORMAT,
                           "array %s: offset %zu is past the end of the file, expected at most %zu",
                           label, array->run.bytes, (size_t)(end - data));
        const char *at = data + array->run.bytes;
        array->run = (tli_span){at, (size_t)(end - at)};
        if (!is_raw) array->coding = TLI_VX_BASE64;
    }
    return TL_OK;
}

static tl_status read_appended(tli_vx_file *file, tli_xml *xml, const tli_xml_token *tag)
{
    tli_span encoding;
    const char *at = xml->at;
    while (at < xml->end && (*at == ' ' || (*at >= '\t' && *at <= '\r'))) at++;
    if (tag->kind != TLI_XML_START || at == xml->end || *at != '_')
        return fail_at(file, tag->ofs, "<AppendedData> without '_' before its data");
    bool is_raw = tli_xml_attribute(tag, "encoding", &encoding) && tli_span_is(encoding, "raw");
    return place_appended(file, at + 1, is_raw);
}

static tl_status read_kind(tli_vx_file *file, const tli_xml_token *tag)
{
    tli_span type;
    if (!tli_xml_attribute(tag, "type", &type))
        return fail_at(file, tag->ofs, "<VTKFile> without 'type'");
    for (size_t i = 0; i < sizeof kind_names / sizeof *kind_names; i++)
        if (tli_span_is(type, kind_names[i])) {
            file->kind = (tli_vx_kind)i;
            return TL_OK;
        }
    char name[64];
    tli_span_text(type, name, sizeof name);
    return tl_fail(file->ctx, TL_ERR_UNSUPPORTED,
                   "VTK XML of type '%s' is not yet supported, expected UnstructuredGrid, "
                   "ImageData, RectilinearGrid or StructuredGrid",
                   name);
}

static tl_status read_coding(tli_vx_file *file, const tli_xml_token *tag)
{
    static const char *const packings[] = {"", "vtkZLibDataCompressor", "vtkLZ4DataCompressor",
                                           "vtkLZMADataCompressor"};
    tli_span value;
    char name[64] = "";
    if (tli_xml_attribute(tag, "byte_order", &value)) {
        file->big_endian = tli_span_is(value, "BigEndian");
        if (!file->big_endian && !tli_span_is(value, "LittleEndian"))
            return fail_at(file, tag->ofs, "'byte_order' is neither LittleEndian nor BigEndian");
    }
    if (tli_xml_attribute(tag, "header_type", &value)) {
        file->wide_header = tli_span_is(value, "UInt64");
        if (!file->wide_header && !tli_span_is(value, "UInt32"))
            return fail_at(file, tag->ofs, "'header_type' is neither UInt32 nor UInt64");
    }
    if (!tli_xml_attribute(tag, "compressor", &value)) return TL_OK;
    for (size_t i = 0; i < sizeof packings / sizeof *packings; i++)
        if (tli_span_is(value, packings[i])) {
            file->packing = (tli_vx_packing)i;
            return TL_OK;
        }
    tli_span_text(value, name, sizeof name);
    return tl_fail(file->ctx, TL_ERR_UNSUPPORTED,
                   "compressor '%s' is not known, expected vtkZLibDataCompressor, "
                   "vtkLZ4DataCompressor or vtkLZMADataCompressor",
                   name);
}

tl_status tli_vx_head_read(tl_ctx *ctx, const tli_map *map, tli_vx_file *file)
{
    *file = (tli_vx_file){.ctx = ctx,
                          .map = map,
                          .spacing = {1, 1, 1},
                          .direction = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                          .time = (double)NAN};
    tli_xml xml;
    tli_xml_token root, token;
    tl_status st = tli_xml_open(ctx, map->bytes, map->byte_count, &xml);
    if (!st) st = tli_xml_next(&xml, &root);
    if (!st && !is_element(&root, "VTKFile"))
        st = fail_at(file, root.ofs, "expected <VTKFile> as the first tag");
    if (!st) st = read_kind(file, &root);
    if (!st) st = read_coding(file, &root);
    bool inside = true, found = false;
    while (!st && !(st = next_inside(&xml, &root, &token, &inside)) && inside) {
        if (found && is_element(&token, "AppendedData")) return read_appended(file, &xml, &token);
        if (token.kind == TLI_XML_TEXT) continue;
        bool is_data = is_element(&token, kind_names[file->kind]);
        if (is_data && found)
            st = fail_at(file, token.ofs, "a second data set in one file, expected one");
        else
            st = is_data ? read_data_set(file, &xml, &token) : tli_xml_skip(&xml, &token);
        found |= is_data;
    }
    if (!st && !found) st = fail_at(file, root.ofs, "<VTKFile> without the data set of its 'type'");
    return st ? st : place_appended(file, NULL, false);
}

void tli_vx_release(tli_vx_file *file)
{
    for (size_t i = 0; i < file->array_count; i++) tl_mem_free(file->ctx, file->arrays[i].marks);
    tl_mem_free(file->ctx, file->arrays);
    tl_mem_free(file->ctx, file->pieces);
    file->arrays = NULL;
    file->pieces = NULL;
    file->array_count = file->piece_count = 0;
}
