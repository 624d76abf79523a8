/* The reader of NRRD volumes. */
#include "fuzz_source.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    fuzz_read(tli_read_nrrd, "input", bytes, byte_count);
    return 0;
}
