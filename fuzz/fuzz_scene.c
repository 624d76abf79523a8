/* Scenes in JSON: whatever the text, a message or a scene; what is written of it is read again to
 * the same bytes. */
#include "fuzz_base.h"

#include <string.h>

#include "tetralod/scene.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    tl_scene *scene, *again;
    char *text, *same;
    size_t length, same_length;
    tl_ctx *ctx = fuzz_ctx_within((size_t)64 << 20);
    tl_status st = tl_scene_read_text(ctx, "fuzz", (const char *)bytes, byte_count, &scene);
    FUZZ_CHECK(st == TL_OK || st == TL_ERR_FORMAT || st == TL_ERR_UNSUPPORTED ||
               st == TL_ERR_BUDGET);
    FUZZ_CHECK((st == TL_OK) == (scene != NULL));
    FUZZ_CHECK(st == TL_OK || *tl_ctx_message(ctx));
    if (scene) {
        FUZZ_CHECK(tl_scene_write_text(ctx, scene, &text, &length) == TL_OK);
        st = tl_scene_read_text(ctx, "again", text, length, &again);
        FUZZ_CHECK(st == TL_OK || st == TL_ERR_BUDGET);
        if (again) {
            FUZZ_CHECK(tl_scene_write_text(ctx, again, &same, &same_length) == TL_OK);
            FUZZ_CHECK(same_length == length && memcmp(same, text, length) == 0);
            FUZZ_CHECK(tl_scene_version(again) == tl_scene_version(scene));
            tl_mem_free(ctx, same);
        }
        tl_scene_destroy(ctx, again);
        tl_mem_free(ctx, text);
    }
    tl_scene_destroy(ctx, scene);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
    return 0;
}
