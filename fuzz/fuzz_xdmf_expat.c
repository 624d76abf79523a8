/* The readers of XDMF, whose arrays stand in it as text, and of its steps. */
#include "fuzz_source.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    fuzz_read(tli_read_xdmf, "input.xdmf", bytes, byte_count);
    fuzz_steps(tli_steps_xdmf, "input.xdmf", bytes, byte_count);
    return 0;
}
