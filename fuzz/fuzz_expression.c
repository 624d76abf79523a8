/* Expressions of channels: whatever the text, a message or values. */
#include "fuzz_base.h"

#include <string.h>

#include "tetralod/extract.h"

#define TEXT_BYTES 5000

static const double XYZ[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
static const tl_lidx TETS[2][4] = {{0, 1, 2, 3}, {4, 2, 1, 3}};

static void add(tl_mesh *mesh, const char *name, uint32_t components, tl_on on)
{
    static const double values[15] = {1, -2, 0.5, 3e200, 0, -1, 7, 2, -3, 1e-300, 5, 6, -8, 9, 4};
    tl_channel channel = {name, "", components, on, TL_F64, values};
    FUZZ_CHECK(tl_mesh_add_channel(mesh, &channel) == TL_OK);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    char text[TEXT_BYTES];
    if (byte_count >= sizeof text) return 0;
    if (byte_count) memcpy(text, bytes, byte_count);
    text[byte_count] = 0;
    tl_ctx *ctx = fuzz_ctx_within((size_t)64 << 20);
    tl_mesh *mesh = NULL;
    FUZZ_CHECK(tl_mesh_create(ctx, XYZ[0], 5, TETS[0], 2, &mesh) == TL_OK);
    add(mesh, "p", 1, TL_ON_VERTEX);
    add(mesh, "U", 3, TL_ON_VERTEX);
    add(mesh, "c", 1, TL_ON_TET);
    tl_status st = tl_mesh_derive(ctx, mesh, "out", text);
    FUZZ_CHECK(st == TL_OK || st == TL_ERR_ARG || st == TL_ERR_BUDGET);
    FUZZ_CHECK((st == TL_OK) == (tl_mesh_channel_by_name(mesh, "out") != NULL));
    FUZZ_CHECK(st == TL_OK || *tl_ctx_message(ctx));
    tl_mesh_destroy(mesh);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
    return 0;
}
