/* Writes small VTK XML files of every kind into memory: all codings, packings, header widths, byte
 * orders and number types, with blocks of any size. */
#ifndef TETRALOD_TESTS_MAKE_VTKXML_H
#define TETRALOD_TESTS_MAKE_VTKXML_H

#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include "tetralod/mesh.h"

#include "check.h"

typedef enum xml_coding { XML_ASCII, XML_INLINE, XML_APPENDED_BASE64, XML_APPENDED_RAW } xml_coding;
typedef enum xml_packing { XML_PLAIN, XML_ZLIB, XML_LZ4, XML_LZMA } xml_packing;

typedef struct xml_mode {
    xml_coding coding;
    xml_packing packing;
    bool wide, big_endian;
    size_t block_bytes; /* of packed data */
    tl_scalar scalar;   /* of point and cell data */
    bool wrapped;       /* base64 in lines of 20 characters */
} xml_mode;

typedef struct xml_text {
    char *text;
    size_t bytes, capacity;
} xml_text;

static inline void xml_put(xml_text *t, const void *bytes, size_t count)
{
    if (t->capacity <= count || t->bytes >= t->capacity - count) {
        t->capacity = 2 * t->bytes + count + 256;
        t->text = realloc(t->text, t->capacity);
        if (!t->text) abort();
    }
    if (count) memcpy(t->text + t->bytes, bytes, count);
    t->bytes += count;
    t->text[t->bytes] = '\0';
}

static inline void xml_printf(xml_text *t, const char *format, ...)
{
    char line[1024];
    va_list args;
    va_start(args, format);
    int count = vsnprintf(line, sizeof line, format, args);
    va_end(args);
    CHECK(count >= 0 && (size_t)count < sizeof line);
    xml_put(t, line, (size_t)count);
}

static inline void xml_put_ordered(xml_text *t, uint64_t word, size_t bytes, bool big_endian)
{
    for (size_t i = 0; i < bytes; i++) {
        uint8_t byte = (uint8_t)(word >> 8 * (big_endian ? bytes - 1 - i : i));
        xml_put(t, &byte, 1);
    }
}

/* A number as the bytes of its type in the file. */
static inline void xml_put_number(xml_text *t, tl_scalar scalar, double value, bool big_endian)
{
    uint64_t word;
    if (scalar == TL_F32) {
        float narrow = (float)value;
        uint32_t bits;
        memcpy(&bits, &narrow, sizeof bits);
        word = bits;
    } else if (scalar == TL_F64) {
        memcpy(&word, &value, sizeof word);
    } else {
        word = value < 0 ? (uint64_t)(int64_t)value : (uint64_t)value;
    }
    xml_put_ordered(t, word, tl_scalar_bytes(scalar), big_endian);
}

static inline void xml_put_base64(xml_text *t, const xml_text *bytes, bool wrapped)
{
    static const char letters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const uint8_t *in = (const uint8_t *)bytes->text;
    for (size_t i = 0; i < bytes->bytes; i += 3) {
        uint32_t group = 0;
        for (size_t j = 0; j < 3; j++) group = group << 8 | (i + j < bytes->bytes ? in[i + j] : 0);
        for (size_t j = 0; j < 4; j++)
            xml_put(t, i + j <= bytes->bytes ? &letters[group >> (18 - 6 * j) & 63] : "=", 1);
        if (wrapped && i % 15 == 12) xml_put(t, "\n  ", 3);
    }
}

static inline void xml_pack(xml_text *out, xml_packing packing, const void *bytes, size_t count)
{
    uint8_t packed[1 << 17];
    size_t used = 0;
    if (packing == XML_ZLIB) {
        uLongf length = sizeof packed;
        CHECK_EQ(compress2(packed, &length, bytes, (uLong)count, 6), Z_OK);
        used = length;
    } else if (packing == XML_LZ4) {
        int length = LZ4_compress_default(bytes, (char *)packed, (int)count, (int)sizeof packed);
        CHECK(length > 0);
        used = (size_t)length;
    } else {
        CHECK_EQ(lzma_easy_buffer_encode(0, LZMA_CHECK_CRC32, NULL, bytes, count, packed, &used,
                                         sizeof packed),
                 LZMA_OK);
    }
    xml_put(out, packed, used);
}

/* Header and data of a binary array, in base64 or raw. */
static inline void xml_put_binary(xml_text *out, const xml_mode *mode, const xml_text *data)
{
    size_t word = mode->wide ? 8 : 4, step = mode->block_bytes;
    bool raw = mode->coding == XML_APPENDED_RAW;
    xml_text head = {0}, body = {0};
    if (mode->packing == XML_PLAIN) {
        xml_put_ordered(&head, data->bytes, word, mode->big_endian);
        xml_put(&head, data->text, data->bytes);
    } else {
        size_t block_count = (data->bytes + step - 1) / step;
        xml_put_ordered(&head, block_count, word, mode->big_endian);
        xml_put_ordered(&head, step, word, mode->big_endian);
        xml_put_ordered(&head, data->bytes % step, word, mode->big_endian);
        for (size_t b = 0; b < block_count; b++) {
            size_t before = body.bytes, first = b * step;
            size_t count = data->bytes - first < step ? data->bytes - first : step;
            xml_pack(&body, mode->packing, data->text + first, count);
            xml_put_ordered(&head, body.bytes - before, word, mode->big_endian);
        }
    }
    if (raw) {
        xml_put(out, head.text, head.bytes);
        xml_put(out, body.text, body.bytes);
    } else {
        xml_put_base64(out, &head, mode->wrapped);
        xml_put_base64(out, &body, mode->wrapped);
    }
    free(head.text);
    free(body.text);
}

/* A <DataArray>; appended data go to appended. */
static inline void xml_put_array(xml_text *t, xml_text *appended, const xml_mode *mode,
                                 tl_scalar scalar, const char *attributes, const double *values,
                                 size_t count)
{
    static const char *const types[] = {"Int8",   "UInt8", "Int16",  "UInt16",  "Int32",
                                        "UInt32", "Int64", "UInt64", "Float32", "Float64"};
    static const char *const formats[] = {"ascii", "binary", "appended", "appended"};
    xml_text data = {0};
    xml_printf(t, "<DataArray type=\"%s\" %s format=\"%s\"", types[scalar], attributes,
               formats[mode->coding]);
    for (size_t i = 0; i < count; i++) xml_put_number(&data, scalar, values[i], mode->big_endian);
    if (mode->coding >= XML_APPENDED_BASE64) {
        xml_printf(t, " offset=\"%zu\"/>\n", appended->bytes);
        xml_put_binary(appended, mode, &data);
    } else {
        xml_printf(t, ">\n");
        for (size_t i = 0; mode->coding == XML_ASCII && i < count; i++)
            xml_printf(t, "%.17g%c", values[i], i % 6 == 5 ? '\n' : ' ');
        if (mode->coding == XML_INLINE) xml_put_binary(t, mode, &data);
        xml_printf(t, "\n</DataArray>\n");
    }
    free(data.text);
}

static inline void xml_begin(xml_text *t, const xml_mode *mode, const char *type)
{
    static const char *const packings[] = {"", " compressor=\"vtkZLibDataCompressor\"",
                                           " compressor=\"vtkLZ4DataCompressor\"",
                                           " compressor=\"vtkLZMADataCompressor\""};
    xml_printf(
        t, "<?xml version=\"1.0\"?>\n<VTKFile type=\"%s\" version=\"0.1\" byte_order=\"%s\"%s%s>\n",
        type, mode->big_endian ? "BigEndian" : "LittleEndian",
        mode->wide ? " header_type=\"UInt64\"" : "", packings[mode->packing]);
}

static inline void xml_end(xml_text *t, xml_text *appended, const xml_mode *mode)
{
    if (mode->coding >= XML_APPENDED_BASE64) {
        xml_printf(t, "<AppendedData encoding=\"%s\">\n _",
                   mode->coding == XML_APPENDED_RAW ? "raw" : "base64");
        xml_put(t, appended->text, appended->bytes);
        xml_printf(t, "\n</AppendedData>\n");
    }
    xml_printf(t, "</VTKFile>\n");
    free(appended->text);
}

/* ---- the unstructured file: a hexahedron, a pyramid, a tet and a triangle ---- */

#define XML_POINTS 10
#define XML_CELLS 4
static const double xml_points[3 * XML_POINTS] = {0, 0, 0, 1, 0,   0,   1, 1,    0,     0,
                                                  1, 0, 0, 0, 1,   1,   0, 1,    1,     1,
                                                  1, 0, 1, 1, 0.5, 0.5, 2, 2.25, 0.125, 1};
static const double xml_connectivity[] = {0, 1, 2, 3, 4, 5, 6, 7, 4, 5,
                                          6, 7, 8, 5, 9, 6, 8, 0, 1, 2};
static const double xml_offsets[] = {8, 13, 17, 20};
static const double xml_types[] = {12, 14, 10, 5};
#define XML_CONNECTIVITY 20

/* Value i of an array of that type; fractions only where the type has them. */
static inline double xml_value(tl_scalar scalar, size_t i)
{
    double value = (double)(i * 7 % 23);
    bool is_unsigned = scalar == TL_U8 || scalar == TL_U16 || scalar == TL_U32 || scalar == TL_U64;
    if (i % 3 == 1 && !is_unsigned) value = -value;
    if (scalar == TL_F32) return value * 0.375;
    if (scalar == TL_F64) return value / 7;
    return value;
}

static inline void xml_put_values(xml_text *t, xml_text *appended, const xml_mode *mode,
                                  const char *attributes, size_t count)
{
    double *values = malloc(count * sizeof *values);
    CHECK(values != NULL);
    for (size_t i = 0; i < count; i++) values[i] = xml_value(mode->scalar, i);
    xml_put_array(t, appended, mode, mode->scalar, attributes, values, count);
    free(values);
}

/* The file with piece_count equal pieces; point arrays "p" and "v" [3], cell array "c" [2]. */
static inline xml_text xml_make_unstructured(const xml_mode *mode, int piece_count)
{
    static const double time = 0.625;
    xml_text t = {0}, appended = {0};
    xml_begin(&t, mode, "UnstructuredGrid");
    xml_printf(&t, "<UnstructuredGrid>\n<FieldData>\n");
    xml_put_array(&t, &appended, mode, TL_F64, "Name=\"TimeValue\" NumberOfTuples=\"1\"", &time, 1);
    xml_printf(&t, "</FieldData>\n");
    for (int p = 0; p < piece_count; p++) {
        xml_printf(
            &t, "<Piece NumberOfPoints=\"%d\" NumberOfCells=\"%d\">\n<PointData Scalars=\"p\">\n",
            XML_POINTS, XML_CELLS);
        xml_put_values(&t, &appended, mode, "Name=\"p\"", XML_POINTS);
        xml_put_values(&t, &appended, mode, "Name=\"v\" NumberOfComponents=\"3\"", 3 * XML_POINTS);
        xml_printf(&t, "</PointData>\n<CellData>\n");
        xml_put_values(&t, &appended, mode, "Name=\"c\" NumberOfComponents=\"2\"", 2 * XML_CELLS);
        xml_printf(&t, "</CellData>\n<Points>\n");
        xml_put_array(&t, &appended, mode, TL_F64, "NumberOfComponents=\"3\"", xml_points,
                      3 * XML_POINTS);
        xml_printf(&t, "</Points>\n<Cells>\n");
        xml_put_array(&t, &appended, mode, mode->wide ? TL_I64 : TL_I32, "Name=\"connectivity\"",
                      xml_connectivity, XML_CONNECTIVITY);
        xml_put_array(&t, &appended, mode, mode->wide ? TL_U64 : TL_U16, "Name=\"offsets\"",
                      xml_offsets, XML_CELLS);
        xml_put_array(&t, &appended, mode, TL_U8, "Name=\"types\"", xml_types, XML_CELLS);
        xml_printf(&t, "</Cells>\n</Piece>\n");
    }
    xml_printf(&t, "</UnstructuredGrid>\n");
    xml_end(&t, &appended, mode);
    return t;
}

/* ---- structured files: 3 x 2 x 2 points ---- */

#define XML_NI 3
#define XML_NJ 2
#define XML_NK 2

/* type: ImageData, RectilinearGrid or StructuredGrid; points at (1 + i / 2, 2 - j, 3 k), the extent
 * beginning at (4, -1, 0). */
static inline xml_text xml_make_structured(const xml_mode *mode, const char *type)
{
    static const double x[] = {1, 1.5, 2}, y[] = {2, 1}, z[] = {0, 3};
    xml_text t = {0}, appended = {0};
    bool is_image = strcmp(type, "ImageData") == 0;
    xml_begin(&t, mode, type);
    xml_printf(
        &t, "<%s WholeExtent=\"4 6 -1 0 0 1\"%s>\n<Piece Extent=\"4 6 -1 0 0 1\">\n<PointData>\n",
        type, is_image ? " Origin=\"-1 1 0\" Spacing=\"0.5 -1 3\"" : "");
    xml_put_values(&t, &appended, mode, "Name=\"p\"", XML_NI * XML_NJ * XML_NK);
    xml_printf(&t, "</PointData>\n<CellData>\n");
    xml_put_values(&t, &appended, mode, "Name=\"c\"", 2);
    xml_printf(&t, "</CellData>\n");
    if (strcmp(type, "RectilinearGrid") == 0) {
        xml_printf(&t, "<Coordinates>\n");
        xml_put_array(&t, &appended, mode, TL_F64, "Name=\"x\"", x, 3);
        xml_put_array(&t, &appended, mode, TL_F32, "", y, 2);
        xml_put_array(&t, &appended, mode, TL_I16, "", z, 2);
        xml_printf(&t, "</Coordinates>\n");
    } else if (!is_image) {
        double xyz[3 * XML_NI * XML_NJ * XML_NK];
        for (int i = 0; i < XML_NI * XML_NJ * XML_NK; i++) {
            xyz[3 * i] = x[i % XML_NI];
            xyz[3 * i + 1] = y[i / XML_NI % XML_NJ];
            xyz[3 * i + 2] = z[i / XML_NI / XML_NJ];
        }
        xml_printf(&t, "<Points>\n");
        xml_put_array(&t, &appended, mode, TL_F32, "NumberOfComponents=\"3\"", xyz,
                      3 * XML_NI * XML_NJ * XML_NK);
        xml_printf(&t, "</Points>\n");
    }
    xml_printf(&t, "</Piece>\n</%s>\n", type);
    xml_end(&t, &appended, mode);
    return t;
}

#endif
