/* Files as a whole, for tests that compare or damage bytes. */
#ifndef TETRALOD_TESTS_CHECK_FILE_H
#define TETRALOD_TESTS_CHECK_FILE_H

#include "check.h"

/* Bytes of a file, by malloc: no more than these, so that sanitizers see who reads on. */
static inline void *check_file_load(const char *path, size_t *byte_count)
{
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    CHECK_EQ(fseek(file, 0, SEEK_END), 0);
    *byte_count = (size_t)ftell(file);
    rewind(file);
    void *bytes = malloc(*byte_count);
    CHECK(bytes && fread(bytes, 1, *byte_count, file) == *byte_count);
    fclose(file);
    return bytes;
}

#endif
