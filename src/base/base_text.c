/* Numbers and names as people read them. */
#include <stdio.h>

#include "base/base.h"

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
