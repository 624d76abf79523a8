/* The readers of Exodus II in netCDF classic and of its steps. */
#include "fuzz_source.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    if (byte_count < 4 || bytes[0] != 'C') return 0; /* netCDF-4 is the library's to read */
    fuzz_read(tli_read_exodus, "input.exo", bytes, byte_count);
    fuzz_steps(tli_steps_exodus, "input.exo", bytes, byte_count);
    return 0;
}
