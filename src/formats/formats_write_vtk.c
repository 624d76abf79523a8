/* Legacy VTK, version 3.0: the one that every reader of the format knows. Binary numbers are
 * big-endian. All fields stand as FIELD arrays, which keep names and components. */
#include "formats/formats_emit.h"
#include "formats/formats_split.h"

#include <math.h>
#include <string.h>

/* Bytes of a name as it stands in the file; readers hold it in 256. */
#define NAME_BYTES 240

/* 64-bit integers are "long" as on 64-bit systems but Windows: meshio does not know the later name,
 * vtktypeint64. */
static const char *type_name(tl_scalar scalar)
{
    static const char *const names[] = {[TL_I8] = "char",   [TL_U8] = "unsigned_char",
                                        [TL_I16] = "short", [TL_U16] = "unsigned_short",
                                        [TL_I32] = "int",   [TL_U32] = "unsigned_int",
                                        [TL_I64] = "long",  [TL_U64] = "unsigned_long",
                                        [TL_F32] = "float", [TL_F64] = "double"};
    return names[scalar];
}

/* Names are words there: what would end or confuse one is written as %XX. */
static void encode_name(const char *name, char text[NAME_BYTES + 4])
{
    static const char digits[] = "0123456789ABCDEF";
    size_t used = 0;
    for (; *name && used + 3 <= NAME_BYTES; name++) {
        unsigned char c = (unsigned char)*name;
        if (c > 32 && c < 127 && c != '%' && c != '"') {
            text[used++] = (char)c;
            continue;
        }
        text[used++] = '%';
        text[used++] = digits[c >> 4];
        text[used++] = digits[c & 15];
    }
    if (used == 0) text[used++] = '_';
    text[used] = '\0';
}

static tl_status write_numbers(tli_emit *emit, const tli_out_array *array, bool text)
{
    tl_status st =
        text ? tli_emit_text(emit, array) : tli_emit_raw(emit, array, !tli_big_endian_host());
    if (!st && !text) st = tli_sink_write(emit->sink, "\n", 1);
    return st;
}

/* A tet is listed as "4 a b c d". */
static void fill_cells(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const tli_out_array *tets = arg;
    int32_t *at = out;
    for (uint64_t t = begin; t < end; t++, at += 5) {
        at[0] = 4;
        tets->fill(tets->arg, t, t + 1, at + 1);
    }
}

static void fill_types(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    (void)arg;
    int32_t *at = out;
    for (uint64_t t = begin; t < end; t++) *at++ = TLI_VTK_TETRA;
}

static tl_status write_cells(tli_emit *emit, const tli_out_array *tets, bool text)
{
    unsigned long long count = tets->count;
    tli_out_array cells = {NULL, NULL, TL_I32, 5, count, fill_cells, tets};
    tli_out_array types = {NULL, NULL, TL_I32, 1, count, fill_types, NULL};
    tl_status st = tli_sink_printf(emit->sink, "CELLS %llu %llu\n", count, 5 * count);
    if (!st) st = write_numbers(emit, &cells, text);
    if (!st) st = tli_sink_printf(emit->sink, "CELL_TYPES %llu\n", count);
    if (!st) st = write_numbers(emit, &types, text);
    return st;
}

static tl_status write_fields(tli_emit *emit, const char *section, uint64_t count,
                              const tli_out_array *arrays, uint32_t array_count, bool text)
{
    if (array_count == 0) return TL_OK;
    tl_status st = tli_sink_printf(emit->sink, "%s %llu\nFIELD FieldData %u\n", section,
                                   (unsigned long long)count, array_count);
    for (uint32_t i = 0; i < array_count && !st; i++) {
        char name[NAME_BYTES + 4];
        encode_name(arrays[i].name, name);
        st = tli_sink_printf(emit->sink, "%s %u %llu %s\n", name, arrays[i].components,
                             (unsigned long long)arrays[i].count, type_name(arrays[i].scalar));
        if (!st) st = write_numbers(emit, &arrays[i], text);
    }
    return st;
}

static tl_status write_file(tli_emit *emit, const tli_out *out, bool text)
{
    tli_sink *sink = emit->sink;
    tl_status st = tli_sink_printf(sink, "# vtk DataFile Version 3.0\ntetralod\n%s\n",
                                   text ? "ASCII" : "BINARY");
    if (!st) st = tli_sink_printf(sink, "DATASET UNSTRUCTURED_GRID\n");
    if (!st && !isnan(out->time)) {
        tli_out_array time = {NULL, NULL, TL_F64, 1, 1, tli_fill_number, &out->time};
        st = tli_sink_printf(sink, "FIELD FieldData 1\nTimeValue 1 1 double\n");
        if (!st) st = write_numbers(emit, &time, text);
    }
    if (!st)
        st = tli_sink_printf(sink, "POINTS %llu %s\n", (unsigned long long)out->points.count,
                             type_name(out->points.scalar));
    if (!st) st = write_numbers(emit, &out->points, text);
    if (!st) st = write_cells(emit, &out->tets, text);
    if (!st)
        st = write_fields(emit, "POINT_DATA", out->points.count, out->point_arrays,
                          out->point_array_count, text);
    if (!st)
        st = write_fields(emit, "CELL_DATA", out->tets.count, out->cell_arrays,
                          out->cell_array_count, text);
    return st;
}

tl_status tli_emit_vtk(tl_ctx *ctx, const char *path, const tli_out *out, tli_encoding encoding)
{
    if (out->tets.scalar != TL_I32)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "'%s': %llu points and %llu tets are too many for legacy VTK; write .vtu",
                       path, (unsigned long long)out->points.count,
                       (unsigned long long)out->tets.count);
    tli_emit emit = {.ctx = ctx,
                     .total = tli_out_bytes(out) + sizeof out->time + 8 * out->tets.count};
    tl_status st = tli_sink_open(ctx, path, &emit.sink);
    if (!st) st = write_file(&emit, out, encoding == TLI_TEXT);
    return tli_emit_close(&emit, path, st);
}
