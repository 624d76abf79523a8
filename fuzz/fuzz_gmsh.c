/* The reader of Gmsh files. */
#include "fuzz_source.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    fuzz_read(tli_read_gmsh, "input.msh", bytes, byte_count);
    return 0;
}
