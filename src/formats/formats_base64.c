/* Base64 as VTK writes it: groups of four characters for three bytes, '=' at the end of a run. */
#include <string.h>

#include "formats/formats_vtkxml.h"

/* 64 + value of a character; 0: it is none. */
#define C(c, value) [c] = 64 + (value)
static const uint8_t codes[256] = {
    C('A', 0),  C('B', 1),  C('C', 2),  C('D', 3),  C('E', 4),  C('F', 5),  C('G', 6),  C('H', 7),
    C('I', 8),  C('J', 9),  C('K', 10), C('L', 11), C('M', 12), C('N', 13), C('O', 14), C('P', 15),
    C('Q', 16), C('R', 17), C('S', 18), C('T', 19), C('U', 20), C('V', 21), C('W', 22), C('X', 23),
    C('Y', 24), C('Z', 25), C('a', 26), C('b', 27), C('c', 28), C('d', 29), C('e', 30), C('f', 31),
    C('g', 32), C('h', 33), C('i', 34), C('j', 35), C('k', 36), C('l', 37), C('m', 38), C('n', 39),
    C('o', 40), C('p', 41), C('q', 42), C('r', 43), C('s', 44), C('t', 45), C('u', 46), C('v', 47),
    C('w', 48), C('x', 49), C('y', 50), C('z', 51), C('0', 52), C('1', 53), C('2', 54), C('3', 55),
    C('4', 56), C('5', 57), C('6', 58), C('7', 59), C('8', 60), C('9', 61), C('+', 62), C('/', 63)};
#undef C
#define VALID 64u

uint64_t tli_base64_chars(uint64_t byte_count)
{
    return byte_count / 3 * 4 + (byte_count % 3 ? byte_count % 3 + 1 : 0);
}

bool tli_base64_decode(const char *text, size_t byte_count, uint8_t *bytes)
{
    const uint8_t *in = (const uint8_t *)text;
    unsigned valid = VALID;
    size_t i = 0;
    for (; i + 3 <= byte_count; i += 3, in += 4) {
        unsigned a = codes[in[0]], b = codes[in[1]], c = codes[in[2]], d = codes[in[3]];
        uint32_t group = (a & 63) << 18 | (b & 63) << 12 | (c & 63) << 6 | (d & 63);
        valid &= a & b & c & d;
        bytes[i] = (uint8_t)(group >> 16);
        bytes[i + 1] = (uint8_t)(group >> 8);
        bytes[i + 2] = (uint8_t)group;
    }
    if (i < byte_count) {
        bool two = byte_count - i == 2;
        unsigned a = codes[in[0]], b = codes[in[1]], c = two ? codes[in[2]] : VALID;
        uint32_t group = (a & 63) << 18 | (b & 63) << 12 | (c & 63) << 6;
        valid &= a & b & c;
        bytes[i] = (uint8_t)(group >> 16);
        if (two) bytes[i + 1] = (uint8_t)(group >> 8);
    }
    return (valid & VALID) != 0;
}

tl_status tli_base64_strip(tl_ctx *ctx, tli_span text, uint64_t char_count, const char **clean,
                           char **owned)
{
    *owned = NULL;
    *clean = text.text;
    if (char_count > text.bytes)
        return tl_fail(ctx, TL_ERR_FORMAT, "%llu characters of base64 expected, %zu are left",
                       (unsigned long long)char_count, text.bytes);
    unsigned blanks = 0;
    for (size_t i = 0; i < char_count; i++) blanks |= (unsigned char)text.text[i] <= ' ';
    if (!blanks) return TL_OK;

    tl_status st = TL_OK;
    char *copy = tl_mem_alloc(ctx, (size_t)char_count, 1, &st);
    if (st) return st;
    size_t used = 0;
    for (size_t i = 0; i < text.bytes && used < char_count; i++)
        if ((unsigned char)text.text[i] > ' ') copy[used++] = text.text[i];
    if (used < char_count) {
        tl_mem_free(ctx, copy);
        return tl_fail(ctx, TL_ERR_FORMAT, "%llu characters of base64 expected, %zu are left",
                       (unsigned long long)char_count, used);
    }
    *clean = *owned = copy;
    return TL_OK;
}
