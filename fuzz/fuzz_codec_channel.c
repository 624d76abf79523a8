/* The decoder of channels, on a fixed patch. The first byte: bit 0 plain numbers, bit 1 the channel
 * on tets. */
#include "fuzz_codec.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    if (byte_count < 1) return 0;
    unsigned class_ = bytes[0] & 1 ? TL_CLASS_RAW : 0;
    bool on_tets = bytes[0] & 2;
    int64_t values[2 * FUZZ_PATCH_VERTS];
    tl_ctx *ctx = fuzz_ctx_create();
    tl_codec *codec = fuzz_codec_create(ctx);
    tl_patch *patch = fuzz_patch_create(ctx);
    tl_status st = tl_channel_decode(ctx, codec, class_, patch, on_tets ? 1 : 0,
                                     on_tets ? TL_ON_TET : TL_ON_VERTEX, on_tets ? 1 : 2, bytes + 1,
                                     byte_count - 1, values);
    FUZZ_CHECK(st == TL_OK || st == TL_ERR_FORMAT);
    tl_patch_destroy(ctx, patch);
    tl_codec_destroy(ctx, codec);
    tl_ctx_destroy(ctx);
    return 0;
}
