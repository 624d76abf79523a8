/* The readers of CGNS in ADF and of its steps. */
#include "fuzz_source.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    if (byte_count < 4 || bytes[0] == 0x89) return 0; /* HDF5 is the library's to read */
    fuzz_read(tli_read_cgns, "input.cgns", bytes, byte_count);
    fuzz_steps(tli_steps_cgns, "input.cgns", bytes, byte_count);
    return 0;
}
