/* The reader of Medit files. */
#include "fuzz_source.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    fuzz_read(tli_read_medit, "input.mesh", bytes, byte_count);
    return 0;
}
