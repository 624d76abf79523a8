/* netCDF classic, out, by the format specification of Unidata: the head, the variables without
 * records, then the one record. The head is made twice, at first to learn its length and with it
 * where each variable lies. */
#include "formats/formats_netcdf_write.h"

#include <string.h>

/* Tags of the lists of a head, types of its numbers. */
#define TAG_DIMENSION 10
#define TAG_VARIABLE 11
#define TAG_ATTRIBUTE 12
#define TYPE_CHAR 2
#define TYPE_INT 4
#define TYPE_FLOAT 5
#define TYPE_DOUBLE 6
#define TYPE_INT64 10
/* Bytes of a variable from which on CDF-2 can't hold it. */
#define LARGE_BYTES (UINT32_MAX - 3ull)

/* A head on its way, to a file or nowhere. */
typedef struct head {
    const tli_ncw *file;
    tli_sink *sink; /* NULL: its bytes are counted alone */
    int version;
    uint64_t bytes;
} head;

/* ---- sizes ---- */

static uint64_t padded(uint64_t bytes)
{
    return (bytes + 3) / 4 * 4;
}

static uint64_t var_bytes(const tli_ncw_var *var)
{
    return var->data.count * tli_out_tuple_bytes(&var->data);
}

static bool is_record(const tli_ncw *file, const tli_ncw_var *var)
{
    return var->rank && file->dims[var->dims[0]].length == 0;
}

int tli_ncw_version(const tli_ncw *file)
{
    for (size_t d = 0; d < file->dim_count; d++)
        if (file->dims[d].length > INT32_MAX) return 5;
    for (size_t v = 0; v < file->var_count; v++)
        if (var_bytes(&file->vars[v]) >= LARGE_BYTES || file->vars[v].data.scalar == TL_I64)
            return 5;
    return 2;
}

uint64_t tli_ncw_bytes(const tli_ncw *file)
{
    uint64_t sum = 0;
    for (size_t v = 0; v < file->var_count; v++) sum += var_bytes(&file->vars[v]);
    return sum;
}

/* ---- the head ---- */

static tl_status put_bytes(head *h, const void *bytes, size_t count)
{
    static const uint8_t zeros[4] = {0};
    h->bytes += padded(count);
    if (!h->sink) return TL_OK;
    tl_status st = tli_sink_write(h->sink, bytes, count);
    return st ? st : tli_sink_write(h->sink, zeros, (size_t)(padded(count) - count));
}

static tl_status put_number(head *h, uint64_t value, unsigned bytes)
{
    uint8_t out[8];
    for (unsigned i = 0; i < bytes; i++) out[i] = (uint8_t)(value >> 8 * (bytes - 1 - i));
    return put_bytes(h, out, bytes);
}

/* A count: 8 bytes in CDF-5, else 4. */
static tl_status put_count(head *h, uint64_t value)
{
    return put_number(h, value, h->version == 5 ? 8 : 4);
}

static tl_status put_text(head *h, const char *text)
{
    size_t length = strlen(text);
    tl_status st = put_count(h, length);
    return st ? st : put_bytes(h, text, length);
}

/* The tag and length of a list; an empty one has tag 0. */
static tl_status put_list(head *h, unsigned tag, size_t count)
{
    tl_status st = put_number(h, count ? tag : 0, 4);
    return st ? st : put_count(h, count);
}

static tl_status put_attribute(head *h, const tli_ncw_attribute *attribute)
{
    float narrow = (float)attribute->value;
    uint32_t bits = (uint32_t)(int32_t)attribute->value;
    bool real = attribute->scalar == TL_F32;
    if (real) memcpy(&bits, &narrow, sizeof bits);
    tl_status st = put_text(h, attribute->name);
    if (!st) st = put_number(h, attribute->text ? TYPE_CHAR : real ? TYPE_FLOAT : TYPE_INT, 4);
    if (!st && attribute->text) return put_text(h, attribute->text);
    if (!st) st = put_count(h, 1);
    return st ? st : put_number(h, bits, 4);
}

static unsigned type_of(tl_scalar scalar)
{
    switch (scalar) {
    case TL_U8: return TYPE_CHAR;
    case TL_I32: return TYPE_INT;
    case TL_I64: return TYPE_INT64;
    case TL_F32: return TYPE_FLOAT;
    default: TL_ASSERT(scalar == TL_F64); return TYPE_DOUBLE;
    }
}

static tl_status put_variable(head *h, const tli_ncw_var *var, uint64_t ofs)
{
    tli_ncw_attribute attribute = {.name = var->attribute, .text = var->text};
    uint64_t bytes = padded(var_bytes(var));
    tl_status st = put_text(h, var->data.name);
    if (!st) st = put_count(h, var->rank);
    for (uint32_t d = 0; d < var->rank && !st; d++) st = put_count(h, var->dims[d]);
    if (!st) st = put_list(h, TAG_ATTRIBUTE, var->attribute != NULL);
    if (!st && var->attribute) st = put_attribute(h, &attribute);
    if (!st) st = put_number(h, type_of(var->data.scalar), 4);
    if (!st) st = put_count(h, bytes);
    return st ? st : put_number(h, ofs, 8);
}

/* ofs: where the variables without records begin. */
static tl_status put_head(head *h, uint64_t ofs)
{
    const tli_ncw *file = h->file;
    const char magic[4] = {'C', 'D', 'F', (char)h->version};
    uint64_t record_ofs = ofs;
    bool records = false;
    for (size_t v = 0; v < file->var_count; v++) {
        if (is_record(file, &file->vars[v]))
            records = true;
        else
            record_ofs += padded(var_bytes(&file->vars[v]));
    }
    tl_status st = put_bytes(h, magic, sizeof magic);
    if (!st) st = put_count(h, records);
    if (!st) st = put_list(h, TAG_DIMENSION, file->dim_count);
    for (size_t d = 0; d < file->dim_count && !st; d++) {
        st = put_text(h, file->dims[d].name);
        if (!st) st = put_count(h, file->dims[d].length);
    }
    if (!st) st = put_list(h, TAG_ATTRIBUTE, file->attribute_count);
    for (size_t a = 0; a < file->attribute_count && !st; a++)
        st = put_attribute(h, &file->attributes[a]);
    if (!st) st = put_list(h, TAG_VARIABLE, file->var_count);
    for (size_t v = 0; v < file->var_count && !st; v++) {
        const tli_ncw_var *var = &file->vars[v];
        uint64_t *at = is_record(file, var) ? &record_ofs : &ofs;
        st = put_variable(h, var, *at);
        *at += padded(var_bytes(var));
    }
    return st;
}

/* ---- the file ---- */

static tl_status emit_values(tli_emit *emit, const tli_ncw *file, bool records)
{
    static const uint8_t zeros[4] = {0};
    tl_status st = TL_OK;
    for (size_t v = 0; v < file->var_count && !st; v++) {
        const tli_ncw_var *var = &file->vars[v];
        uint64_t bytes = var_bytes(var);
        if (is_record(file, var) != records) continue;
        st = tli_emit_raw(emit, &var->data, !tli_big_endian_host());
        if (!st) st = tli_sink_write(emit->sink, zeros, (size_t)(padded(bytes) - bytes));
    }
    return st;
}

tl_status tli_ncw_emit(tli_emit *emit, const tli_ncw *file, int version)
{
    for (size_t v = 0; v < file->var_count; v++) {
        const tli_ncw_var *var = &file->vars[v];
        uint64_t count = 1;
        for (uint32_t d = is_record(file, var); d < var->rank; d++)
            count *= file->dims[var->dims[d]].length;
        TL_ASSERT(count == var->data.count * var->data.components);
    }
    head counted = {.file = file, .version = version};
    head written = {.file = file, .sink = emit->sink, .version = version};
    tl_status st = put_head(&counted, 0);
    if (!st) st = put_head(&written, counted.bytes);
    if (!st) st = emit_values(emit, file, false);
    return st ? st : emit_values(emit, file, true);
}
