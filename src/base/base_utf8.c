/* Characters of UTF-8: no overlong forms, no surrogates, none above U+10FFFF. */
#include "base/base.h"

size_t tli_utf8_bytes(const char *at, const char *end)
{
    const unsigned char *p = (const unsigned char *)at;
    if (at >= end || p[0] < 0xc2 || p[0] > 0xf4) return 0;
    const size_t count = p[0] >= 0xf0 ? 4 : p[0] >= 0xe0 ? 3 : 2;
    if ((size_t)(end - at) < count) return 0;
    for (size_t i = 1; i < count; i++)
        if ((p[i] & 0xc0) != 0x80) return 0;
    if ((p[0] == 0xe0 && p[1] < 0xa0) || (p[0] == 0xed && p[1] > 0x9f) ||
        (p[0] == 0xf0 && p[1] < 0x90) || (p[0] == 0xf4 && p[1] > 0x8f))
        return 0;
    return count;
}
