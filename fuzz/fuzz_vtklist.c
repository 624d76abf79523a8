/* The readers of VTK XML files that name others, which are not there. */
#include "fuzz_source.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    tl_ctx *ctx = fuzz_ctx_create();
    tli_source source = {.path = "input", .map = {.bytes = bytes, .byte_count = byte_count}};
    tl_steps steps = {0};
    if (tli_steps_pvd(ctx, &source, NULL, &steps)) FUZZ_CHECK(tl_ctx_message(ctx)[0]);
    tl_steps_release(ctx, &steps);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
    fuzz_read(tli_read_vtkpieces, "input.pvtu", bytes, byte_count);
    fuzz_read(tli_read_pvd, "input.pvd", bytes, byte_count);
    fuzz_read(tli_read_vtm, "input.vtm", bytes, byte_count);
    return 0;
}
