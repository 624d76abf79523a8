/* A .tlod file as it comes. */
#include "fuzz_store.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    fuzz_read_store(bytes, byte_count, false, false, false);
    return 0;
}
