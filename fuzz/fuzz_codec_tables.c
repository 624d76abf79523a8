/* The reader of tables; with what comes back a patch is encoded and decoded. */
#include "fuzz_codec.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    tl_ctx *ctx = fuzz_ctx_create();
    tl_codec *codec = NULL;
    tl_status st = tl_codec_read(ctx, bytes, byte_count, &codec);
    FUZZ_CHECK((st == TL_OK) == (codec != NULL));
    for (unsigned class_ = 0; codec && class_ < TL_CLASS_COUNT; class_++) {
        tl_patch *patch = fuzz_patch_create(ctx), *back = NULL;
        tli_bytes out;
        tli_bytes_open(ctx, &out);
        FUZZ_CHECK(tli_topology_encode(ctx, codec, class_, patch, &out, NULL) == TL_OK);
        FUZZ_CHECK(tl_topology_decode(ctx, codec, class_, out.bytes, out.count, &back) == TL_OK);
        tl_patch_destroy(ctx, patch);
        tl_patch_destroy(ctx, back);
        tli_bytes_close(&out);
    }
    tl_codec_destroy(ctx, codec);
    tl_ctx_destroy(ctx);
    return 0;
}
