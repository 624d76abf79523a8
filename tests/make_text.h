/* What the tests of text formats share: a file that grows by printing. */
#ifndef TETRALOD_TESTS_MAKE_TEXT_H
#define TETRALOD_TESTS_MAKE_TEXT_H

#include "check.h"

#include <stdarg.h>

typedef struct text {
    char bytes[8192];
    size_t count;
} text;

static inline void add_bytes(text *t, const void *bytes, size_t count)
{
    CHECK(t->count + count <= sizeof t->bytes);
    memcpy(t->bytes + t->count, bytes, count);
    t->count += count;
}

static inline void add(text *t, const char *format, ...) TL_PRINTF(2, 3);
static inline void add(text *t, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int n = vsnprintf(t->bytes + t->count, sizeof t->bytes - t->count, format, args);
    va_end(args);
    CHECK(n >= 0 && t->count + (size_t)n < sizeof t->bytes);
    t->count += (size_t)n;
}

#endif
