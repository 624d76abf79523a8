/* Numbers and names as people read them, and as files have them. */
#include <locale.h>
#include <stdio.h>

#include "base/base.h"

int tli_vprint(char *text, size_t bytes, const char *format, va_list args)
{
    /* of this thread alone; the locale "C" is there without being made */
    const locale_t points = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    const locale_t before = uselocale(points);
    const int length = vsnprintf(text, bytes, format, args);
    uselocale(before);
    if (points) freelocale(points);
    return length;
}

int tli_print(char *text, size_t bytes, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    const int length = tli_vprint(text, bytes, format, args);
    va_end(args);
    return length;
}

tl_text tl_text_count(uint64_t count)
{
    char digits[24];
    tl_text text;
    const int n = snprintf(digits, sizeof digits, "%llu", (unsigned long long)count);
    size_t at = 0;
    for (int i = 0; i < n; i++) {
        if (i > 0 && (n - i) % 3 == 0) text.s[at++] = ',';
        text.s[at++] = digits[i];
    }
    text.s[at] = '\0';
    return text;
}

tl_text tl_text_name(const char *name)
{
    enum { LONGEST = 40 }; /* characters of a name in a table */
    tl_text text;
    size_t at = 0;
    for (; *name && at < LONGEST; name++)
        text.s[at++] = (char)((unsigned char)*name < 0x20 || *name == 0x7f ? '?' : *name);
    if (*name) {
        while (at > 0 && ((unsigned char)text.s[at - 1] & 0xc0) == 0x80) at--; /* whole letters */
        if (at > 0 && ((unsigned char)text.s[at - 1] & 0x80)) at--;
        text.s[at++] = '.';
        text.s[at++] = '.';
    }
    text.s[at] = '\0';
    return text;
}
