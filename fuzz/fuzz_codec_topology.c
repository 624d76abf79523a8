/* The decoder of topologies. The first byte says whether the rest is plain numbers (odd) or a
 * stream for plain tables. What comes back must stand being arranged and encoded again. */
#include "fuzz_codec.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    if (byte_count < 1) return 0;
    unsigned class_ = bytes[0] & 1 ? TL_CLASS_RAW : 0;
    tl_ctx *ctx = fuzz_ctx_create();
    tl_codec *codec = fuzz_codec_create(ctx);
    tl_patch *patch = NULL, *again = NULL;
    tl_status st = tl_topology_decode(ctx, codec, class_, bytes + 1, byte_count - 1, &patch);
    FUZZ_CHECK((st == TL_OK) == (patch != NULL));
    if (patch) {
        tli_bytes out;
        tli_bytes_open(ctx, &out);
        fuzz_check_patch(patch);
        st = tli_patch_arrange(ctx, patch, NULL, NULL);
        if (!st) st = tli_topology_encode(ctx, codec, 0, patch, &out, NULL);
        if (!st)
            FUZZ_CHECK(tl_topology_decode(ctx, codec, 0, out.bytes, out.count, &again) == TL_OK);
        tli_bytes_close(&out);
    }
    tl_patch_destroy(ctx, again);
    tl_patch_destroy(ctx, patch);
    tl_codec_destroy(ctx, codec);
    tl_ctx_destroy(ctx);
    return 0;
}
