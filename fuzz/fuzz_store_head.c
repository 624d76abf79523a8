/* The head of a .tlod file: its checksum is made right. */
#include "fuzz_store.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    fuzz_read_store(bytes, byte_count, true, false, false);
    return 0;
}
