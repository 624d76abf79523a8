/* Pages and blobs of a .tlod file: all checksums are made right. */
#include "fuzz_store.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    fuzz_read_store(bytes, byte_count, true, true, true);
    return 0;
}
