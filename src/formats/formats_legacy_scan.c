/* Legacy VTK files: words, counts, names, types and blocks of numbers. */
#include "formats/formats_legacy.h"
#include "formats/formats_number.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define WORD_SHOWN 32                  /* bytes of a foreign word in a message */
#define WIDEN_GRAIN ((size_t)1 << 18)  /* numbers a thread widens at a time */
#define TEXT_PIECE ((uint64_t)1 << 20) /* numbers of text between two reports of progress */

static const tli_legacy_type types[] = {
    {"float", TLI_LEGACY_NUMBER, TL_F32, TL_F32},
    {"double", TLI_LEGACY_NUMBER, TL_F64, TL_F64},
    {"int", TLI_LEGACY_NUMBER, TL_I32, TL_I32},
    {"unsigned_char", TLI_LEGACY_NUMBER, TL_U8, TL_U8},
    {"bit", TLI_LEGACY_BIT, TL_U8, TL_U8},
    {"char", TLI_LEGACY_NUMBER, TL_I8, TL_I8},
    {"signed_char", TLI_LEGACY_NUMBER, TL_I8, TL_I8},
    {"short", TLI_LEGACY_NUMBER, TL_I16, TL_I16},
    {"unsigned_short", TLI_LEGACY_NUMBER, TL_U16, TL_U16},
    {"unsigned_int", TLI_LEGACY_NUMBER, TL_U32, TL_U32},
    {"long", TLI_LEGACY_NUMBER, TL_I64, TL_I64},
    {"unsigned_long", TLI_LEGACY_NUMBER, TL_U64, TL_U64},
    {"long_long", TLI_LEGACY_NUMBER, TL_I64, TL_I64},
    {"unsigned_long_long", TLI_LEGACY_NUMBER, TL_U64, TL_U64},
    {"__int64", TLI_LEGACY_NUMBER, TL_I64, TL_I64},
    {"unsigned___int64", TLI_LEGACY_NUMBER, TL_U64, TL_U64},
    {"vtkidtype", TLI_LEGACY_NUMBER, TL_I32, TL_I64},
    {"vtktypeint8", TLI_LEGACY_NUMBER, TL_I8, TL_I8},
    {"vtktypeuint8", TLI_LEGACY_NUMBER, TL_U8, TL_U8},
    {"vtktypeint16", TLI_LEGACY_NUMBER, TL_I16, TL_I16},
    {"vtktypeuint16", TLI_LEGACY_NUMBER, TL_U16, TL_U16},
    {"vtktypeint32", TLI_LEGACY_NUMBER, TL_I32, TL_I32},
    {"vtktypeuint32", TLI_LEGACY_NUMBER, TL_U32, TL_U32},
    {"vtktypeint64", TLI_LEGACY_NUMBER, TL_I64, TL_I64},
    {"vtktypeuint64", TLI_LEGACY_NUMBER, TL_U64, TL_U64},
    {"vtktypefloat32", TLI_LEGACY_NUMBER, TL_F32, TL_F32},
    {"vtktypefloat64", TLI_LEGACY_NUMBER, TL_F64, TL_F64},
    {"string", TLI_LEGACY_STRING, TL_U8, TL_U8},
    {"utf8_string", TLI_LEGACY_STRING, TL_U8, TL_U8},
    {"variant", TLI_LEGACY_VARIANT, TL_U8, TL_U8},
};

const tli_legacy_type *tli_legacy_f32(void)
{
    return &types[0];
}

const tli_legacy_type *tli_legacy_int(void)
{
    return &types[2];
}

const tli_legacy_type *tli_legacy_u8(void)
{
    return &types[3];
}

/* ---- messages ---- */

tl_status tli_legacy_fail(const tli_legacy *reader, const char *place, tl_status status,
                          const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    tli_vprint(text, sizeof text, format, args);
    va_end(args);
    if (reader->binary)
        return tl_fail(reader->ctx, status, "'%s': byte %zu: %s", reader->path,
                       (size_t)(place - reader->begin), text);
    size_t line = 1;
    for (const char *p = reader->begin; p < place; p++) line += *p == '\n';
    return tl_fail(reader->ctx, status, "'%s': line %zu: %s", reader->path, line, text);
}

tl_status tli_legacy_expected(const tli_legacy *reader, const char *what)
{
    char shown[WORD_SHOWN + 1];
    const char *p = tli_number_skip_space(reader->at, reader->end), *place = p;
    size_t length = 0;
    for (; p < reader->end && length<WORD_SHOWN && * p> ' ' && *p <= '~'; p++) shown[length++] = *p;
    shown[length] = 0;
    if (place == reader->end)
        return tli_legacy_fail(reader, place, TL_ERR_FORMAT,
                               "expected %s, found the end of the file", what);
    if (!length)
        return tli_legacy_fail(reader, place, TL_ERR_FORMAT, "expected %s, found byte 0x%02x", what,
                               (unsigned)(unsigned char)*place);
    return tli_legacy_fail(reader, place, TL_ERR_FORMAT, "expected %s, found '%s'", what, shown);
}

/* ---- words ---- */

static bool is_space(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

bool tli_legacy_next(tli_legacy *reader, tli_legacy_word *word)
{
    const char *p = tli_number_skip_space(reader->at, reader->end);
    word->text = p;
    while (p < reader->end && !is_space(*p)) p++;
    word->length = (size_t)(p - word->text);
    reader->at = p;
    return word->length != 0;
}

bool tli_legacy_next_in_line(tli_legacy *reader, tli_legacy_word *word)
{
    const char *p = reader->at;
    while (p < reader->end && is_space(*p) && *p != '\n') p++;
    reader->at = p;
    return p < reader->end && *p != '\n' && tli_legacy_next(reader, word);
}

void tli_legacy_skip_line(tli_legacy *reader)
{
    const char *p = reader->at;
    while (p < reader->end && *p != '\n') p++;
    reader->at = p < reader->end ? p + 1 : p;
}

bool tli_legacy_is(const tli_legacy_word *word, const char *keyword)
{
    size_t i = 0;
    for (; i < word->length && keyword[i]; i++) {
        char a = word->text[i], b = keyword[i];
        if (a >= 'A' && a <= 'Z') a = (char)(a + ('a' - 'A'));
        if (b >= 'A' && b <= 'Z') b = (char)(b + ('a' - 'A'));
        if (a != b) return false;
    }
    return i == word->length && !keyword[i];
}

bool tli_legacy_take(tli_legacy *reader, const char *keyword)
{
    const char *before = reader->at;
    tli_legacy_word word;
    if (tli_legacy_next(reader, &word) && tli_legacy_is(&word, keyword)) return true;
    reader->at = before;
    return false;
}

tl_status tli_legacy_read_int(tli_legacy *reader, const char *what, int64_t *value)
{
    const char *after = tli_number_i64(reader->at, reader->end, value);
    if (!after) return tli_legacy_expected(reader, what);
    reader->at = after;
    return TL_OK;
}

tl_status tli_legacy_read_count(tli_legacy *reader, const char *what, uint64_t *count)
{
    int64_t value;
    const char *before = reader->at;
    tl_status st = tli_legacy_read_int(reader, what, &value);
    if (!st && value < 0) {
        reader->at = before;
        st = tli_legacy_expected(reader, what);
    }
    if (!st) *count = (uint64_t)value;
    return st;
}

tl_status tli_legacy_read_real(tli_legacy *reader, const char *what, double *value)
{
    const char *after = tli_number_f64(reader->at, reader->end, value);
    if (!after) return tli_legacy_expected(reader, what);
    reader->at = after;
    return TL_OK;
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    char lower = (char)(c | 0x20);
    return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

tl_status tli_legacy_read_name(tli_legacy *reader, char name[TLI_LEGACY_NAME_MAX])
{
    tli_legacy_word word;
    size_t length = 0;
    if (!tli_legacy_next(reader, &word)) return tli_legacy_expected(reader, "a name");
    if (word.length >= TLI_LEGACY_NAME_MAX)
        return tli_legacy_fail(reader, word.text, TL_ERR_FORMAT,
                               "a name of %zu bytes, expected fewer than %d", word.length,
                               TLI_LEGACY_NAME_MAX);
    for (size_t i = 0; i < word.length; i++) {
        char c = word.text[i];
        if (c == '%' && i + 2 < word.length) {
            int high = hex_digit(word.text[i + 1]), low = hex_digit(word.text[i + 2]);
            if (high >= 0 && low >= 0 && (high || low)) {
                c = (char)(high * 16 + low);
                i += 2;
            }
        }
        if (c) name[length++] = c;
    }
    name[length] = 0;
    return TL_OK;
}

tl_status tli_legacy_read_type(tli_legacy *reader, const tli_legacy_type **type)
{
    tli_legacy_word word;
    const char *before = reader->at;
    if (tli_legacy_next(reader, &word)) {
        for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
            if (tli_legacy_is(&word, types[i].name)) {
                *type = &types[i];
                return TL_OK;
            }
        }
    }
    reader->at = before;
    return tli_legacy_expected(reader, "a number type such as float or vtktypeint64");
}

/* ---- blocks of numbers ---- */

/* Bytes are left for count values of a type after the end of this line (BINARY), to which the
 * reader moves, or for their text (ASCII). */
static tl_status open_block(tli_legacy *reader, const char *what, const tli_legacy_type *type,
                            uint64_t count)
{
    if (!count) return TL_OK;
    const char *place = reader->at;
    if (reader->binary) {
        tli_legacy_word rest;
        if (tli_legacy_next_in_line(reader, &rest)) {
            reader->at = place;
            return tli_legacy_expected(reader, "the end of the line before binary numbers");
        }
        tli_legacy_skip_line(reader);
    }
    uint64_t left = (uint64_t)(reader->end - reader->at), room;
    if (type->family == TLI_LEGACY_BIT && reader->binary)
        room = left < UINT64_MAX / 8 ? left * 8 : UINT64_MAX;
    else if (type->family != TLI_LEGACY_NUMBER)
        room = left + 1; /* strings may be empty, and end with a byte */
    else
        room = reader->binary ? left / tl_scalar_bytes(type->stored) : (left + 1) / 2;
    if (count > room)
        return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                               "%s: expected %" PRIu64 " values of type %s, found %" PRIu64
                               " bytes to the end of the file",
                               what, count, type->name, left);
    return TL_OK;
}

/* tuples * components, or a failure. */
static tl_status value_count(const tli_legacy *reader, const char *what, uint64_t tuples,
                             uint64_t components, size_t *count)
{
    if (tuples <= SIZE_MAX && components <= SIZE_MAX &&
        tli_mul_size((size_t)tuples, (size_t)components, count))
        return TL_OK;
    return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                           "%s: %" PRIu64 " times %" PRIu64 " values overflow", what, tuples,
                           components);
}

typedef struct widening {
    const char *bytes;
    tl_scalar scalar;
    double *values;
} widening;

/* A piece of the pool's work. */
static tl_status widen_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const widening *job = arg;
    (void)worker;
    tli_widen(job->bytes + begin * tl_scalar_bytes(job->scalar), job->scalar, true, end - begin,
              job->values + begin);
    return TL_OK;
}

static tl_status read_binary(tli_legacy *reader, const tli_legacy_type *type, size_t count,
                             double *values)
{
    if (type->family == TLI_LEGACY_BIT) {
        for (size_t i = 0; i < count; i++)
            values[i] = (unsigned char)reader->at[i / 8] >> (7 - i % 8) & 1;
        reader->at += (count + 7) / 8;
        return TL_OK;
    }
    widening job = {reader->at, type->stored, values};
    reader->at += count * tl_scalar_bytes(type->stored);
    return tli_parallel(reader->ctx, count, WIDEN_GRAIN, widen_piece, &job);
}

static void integer_limits(const tli_legacy_type *type, double limits[2])
{
    bool is_signed = type->scalar == TL_I8 || type->scalar == TL_I16 || type->scalar == TL_I32 ||
                     type->scalar == TL_I64;
    int bits = type->family == TLI_LEGACY_BIT ? 1 : 8 * (int)tl_scalar_bytes(type->scalar);
    limits[0] = is_signed ? -ldexp(1, bits - 1) : 0;
    limits[1] = ldexp(1, is_signed ? bits - 1 : bits) - 1; /* of 64 bits: rounded up, harmless */
}

/* Reads count numbers of text. */
static tl_status read_text(tli_legacy *reader, const char *what, const tli_legacy_type *type,
                           size_t count, double *values)
{
    const char *p = reader->at;
    size_t i = 0;
    double limits[2];
    if (type->scalar == TL_F32) {
        float value;
        for (const char *q; i < count && (q = tli_number_f32(p, reader->end, &value)); p = q)
            values[i++] = (double)value;
    } else if (type->scalar == TL_F64) {
        for (const char *q; i < count && (q = tli_number_f64(p, reader->end, &values[i])); p = q)
            i++;
    } else {
        integer_limits(type, limits);
        for (const char *q; i < count && (q = tli_number_f64(p, reader->end, &values[i])); p = q) {
            if (!(values[i] >= limits[0] && values[i] <= limits[1]) ||
                values[i] != trunc(values[i]))
                break;
            i++;
        }
    }
    reader->at = p;
    if (i == count) return TL_OK;
    char expected[160];
    snprintf(expected, sizeof expected, "a number of type %s of %.80s", type->name, what);
    return tli_legacy_expected(reader, expected);
}

tl_status tli_legacy_read_numbers(tli_legacy *reader, const char *what, const tli_legacy_type *type,
                                  uint64_t tuples, uint64_t components, double **values)
{
    size_t count;
    tl_status st = value_count(reader, what, tuples, components, &count);
    if (!st && (type->family == TLI_LEGACY_STRING || type->family == TLI_LEGACY_VARIANT))
        st = tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                             "%s: expected numbers, found type %s", what, type->name);
    if (!st) st = open_block(reader, what, type, count);
    if (st) return st;
    double *numbers = tl_mem_alloc(reader->ctx, count, sizeof *numbers, &st);
    for (size_t begin = 0; !st && begin < count;) {
        size_t piece = reader->binary || count - begin < TEXT_PIECE ? count - begin : TEXT_PIECE;
        st = reader->binary ? read_binary(reader, type, piece, numbers + begin)
                            : read_text(reader, what, type, piece, numbers + begin);
        begin += piece;
        if (!st)
            st = tl_progress(reader->ctx, "reading", (uint64_t)(reader->at - reader->begin),
                             (uint64_t)(reader->end - reader->begin));
    }
    if (st) {
        tl_mem_free(reader->ctx, numbers);
        return st;
    }
    *values = numbers;
    return TL_OK;
}

/* ---- numbers that stay in the file ---- */

/* After open_block. */
static void take_block(tli_legacy *reader, const tli_legacy_type *type, uint64_t count,
                       tli_legacy_block *block)
{
    *block = (tli_legacy_block){reader->at, type, count};
    reader->at += type->family == TLI_LEGACY_BIT ? count / 8 + (count % 8 != 0)
                                                 : count * tl_scalar_bytes(type->stored);
}

tl_status tli_legacy_locate(tli_legacy *reader, const char *what, const tli_legacy_type *type,
                            uint64_t tuples, uint64_t components, tli_legacy_block *block)
{
    size_t count;
    if (type->family == TLI_LEGACY_STRING || type->family == TLI_LEGACY_VARIANT)
        return TL_ERR_FORMAT;
    tl_status st = value_count(reader, what, tuples, components, &count);
    if (!st) st = open_block(reader, what, type, count);
    if (!st) take_block(reader, type, count, block);
    return st;
}

tl_status tli_legacy_locate_integers(tli_legacy *reader, const char *what,
                                     const tli_legacy_type *type, uint64_t count,
                                     tli_legacy_block *block)
{
    tl_status st = tli_legacy_open_integers(reader, what, type, count);
    if (!st) take_block(reader, type, count, block);
    return st;
}

tl_status tli_legacy_block_numbers(tl_ctx *ctx, const tli_legacy_block *block, uint64_t first,
                                   uint64_t count, double *values)
{
    if (block->type->family == TLI_LEGACY_BIT) {
        for (uint64_t i = first; i < first + count; i++)
            *values++ = (unsigned char)block->bytes[i / 8] >> (7 - i % 8) & 1;
        return TL_OK;
    }
    widening job = {block->bytes + first * tl_scalar_bytes(block->type->stored),
                    block->type->stored, values};
    return tli_parallel(ctx, (size_t)count, WIDEN_GRAIN, widen_piece, &job);
}

void tli_legacy_block_integers(const tli_legacy_block *block, uint64_t first, size_t count,
                               int64_t *values)
{
    tli_legacy cursor = {.binary = true,
                         .at = block->bytes + first * tl_scalar_bytes(block->type->stored)};
    (void)tli_legacy_read_integers(&cursor, "", block->type, count, values); /* of bytes: can't */
}

/* ---- skipping ---- */

/* A string of a BINARY file: the two high bits of its first byte tell how many bytes its length
 * takes: 3: one, 2: two, 1: four, 0: eight. */
static tl_status skip_binary_string(tli_legacy *reader, const char *what)
{
    size_t left = (size_t)(reader->end - reader->at);
    if (left) {
        const unsigned char *bytes = (const unsigned char *)reader->at;
        size_t width = (size_t)1 << (3 - (bytes[0] >> 6));
        uint64_t length = bytes[0] & 0x3f;
        for (size_t i = 1; i < width && i < left; i++) length = length << 8 | bytes[i];
        if (width <= left && length <= left - width) {
            reader->at += width + length;
            return TL_OK;
        }
    }
    return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                           "%s: a string reaches past the end of the file", what);
}

tl_status tli_legacy_skip_array(tli_legacy *reader, const char *what, const tli_legacy_type *type,
                                uint64_t tuples, uint64_t components)
{
    size_t count;
    tl_status st = value_count(reader, what, tuples, components, &count);
    if (!st) st = open_block(reader, what, type, count);
    if (st || !count) return st;
    tli_legacy_word word;
    switch (type->family) {
    case TLI_LEGACY_NUMBER:
    case TLI_LEGACY_BIT:
        if (reader->binary) {
            reader->at += type->family == TLI_LEGACY_BIT ? (count + 7) / 8
                                                         : count * tl_scalar_bytes(type->stored);
            return TL_OK;
        }
        for (size_t i = 0; i < count; i++)
            if (!tli_legacy_next(reader, &word)) return tli_legacy_expected(reader, what);
        return TL_OK;
    case TLI_LEGACY_STRING:
        if (reader->binary) {
            for (size_t i = 0; !st && i < count; i++) st = skip_binary_string(reader, what);
            return st;
        }
        /* fall through */
    case TLI_LEGACY_VARIANT: /* text in both kinds of files, a line each */
        if (!reader->binary) tli_legacy_skip_line(reader);
        for (size_t i = 0; i < count; i++) tli_legacy_skip_line(reader);
        return TL_OK;
    }
    return TL_OK;
}

/* ---- integers ---- */

tl_status tli_legacy_open_integers(tli_legacy *reader, const char *what,
                                   const tli_legacy_type *type, uint64_t count)
{
    if (type->family != TLI_LEGACY_NUMBER || type->scalar == TL_F32 || type->scalar == TL_F64)
        return tli_legacy_fail(reader, reader->at, TL_ERR_FORMAT,
                               "%s: expected integers, found type %s", what, type->name);
    return open_block(reader, what, type, count);
}

static int64_t big_endian_integer(const unsigned char *bytes, size_t byte_count, bool is_signed)
{
    uint64_t value = is_signed && bytes[0] & 0x80 ? UINT64_MAX : 0;
    for (size_t i = 0; i < byte_count; i++) value = value << 8 | bytes[i];
    return (int64_t)value;
}

tl_status tli_legacy_read_integers(tli_legacy *reader, const char *what,
                                   const tli_legacy_type *type, size_t count, int64_t *values)
{
    if (!reader->binary) {
        for (size_t i = 0; i < count; i++) {
            const char *after = tli_number_i64(reader->at, reader->end, &values[i]);
            if (!after) return tli_legacy_expected(reader, what);
            reader->at = after;
        }
        return TL_OK;
    }
    const unsigned char *bytes = (const unsigned char *)reader->at;
    size_t width = tl_scalar_bytes(type->stored);
    bool is_signed = type->scalar == TL_I8 || type->scalar == TL_I16 || type->scalar == TL_I32 ||
                     type->scalar == TL_I64;
    /* two loops of constant width: the bytes of each become one load and one swap */
    if (width == 4 && is_signed)
        for (size_t i = 0; i < count; i++) values[i] = big_endian_integer(bytes + 4 * i, 4, true);
    else if (width == 8)
        for (size_t i = 0; i < count; i++) values[i] = big_endian_integer(bytes + 8 * i, 8, true);
    else
        for (size_t i = 0; i < count; i++)
            values[i] = big_endian_integer(bytes + width * i, width, is_signed);
    reader->at += width * count;
    return TL_OK;
}
