/* Commands, a line each: whatever they say, a message that left the scene as it was, or a change
 * that can be undone and redone. */
#include "fuzz_base.h"

#include <string.h>

#include "tetralod/scene.h"

enum { LINE_BYTES = 1000 };

static void carry_out(tl_ctx *ctx, tl_scene *scene, const char *line)
{
    const uint64_t before = tl_scene_version(scene);
    tl_status st = tl_scene_do(ctx, scene, line);
    FUZZ_CHECK(st == TL_OK || st == TL_ERR_ARG || st == TL_ERR_BUDGET);
    FUZZ_CHECK(st == TL_OK || (*tl_ctx_message(ctx) && tl_scene_version(scene) == before));
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    tl_scene *scene;
    char line[LINE_BYTES];
    tl_ctx *ctx = fuzz_ctx_within((size_t)16 << 20);
    FUZZ_CHECK(tl_scene_create(ctx, &scene) == TL_OK);
    for (size_t at = 0; at < byte_count; at++) {
        size_t used = 0;
        for (; at < byte_count && bytes[at] && bytes[at] != '\n'; at++)
            if (used + 1 < sizeof line) line[used++] = (char)bytes[at];
        line[used] = '\0';
        carry_out(ctx, scene, line);
    }
    size_t steps = 0;
    while (tl_scene_redo_name(scene)) FUZZ_CHECK(tl_scene_redo(ctx, scene) == TL_OK);
    const uint64_t last = tl_scene_version(scene);
    for (; tl_scene_undo_name(scene); steps++) FUZZ_CHECK(tl_scene_undo(ctx, scene) == TL_OK);
    for (; steps; steps--) FUZZ_CHECK(tl_scene_redo(ctx, scene) == TL_OK);
    FUZZ_CHECK(tl_scene_version(scene) == last);
    tl_scene_destroy(ctx, scene);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
    return 0;
}
