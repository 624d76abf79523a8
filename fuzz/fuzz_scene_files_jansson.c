/* ParaView's transfer functions and VTK's cameras in JSON: the first byte chooses which. */
#include "fuzz_base.h"

#include <string.h>

#include "scene/scene_json.h"

static void check_points(const tl_control_points *p)
{
    FUZZ_CHECK(p->color_count + p->opacity_count && p->color_count <= TL_SCENE_ROWS_MAX);
    FUZZ_CHECK(p->opacity_count <= TL_SCENE_ROWS_MAX);
    for (size_t i = 0; i < p->color_count; i++)
        for (int k = 0; k < 3; k++)
            FUZZ_CHECK(p->colors[i].rgb[k] >= 0 && p->colors[i].rgb[k] <= 1);
    for (size_t i = 1; i < p->color_count; i++)
        FUZZ_CHECK(p->colors[i].value >= p->colors[i - 1].value);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    tl_status st = TL_OK;
    tl_camera *cameras = NULL;
    tl_control_points *points = NULL;
    size_t count = 0;
    if (!byte_count || byte_count > 1 << 20) return 0;
    tl_ctx *ctx = fuzz_ctx_within((size_t)64 << 20);
    char *text = tl_mem_zalloc(ctx, byte_count, 1, &st);
    memcpy(text, bytes + 1, byte_count - 1);
    if (*bytes == 'c')
        st = tli_json_cameras(ctx, "fuzz", text, byte_count - 1, false, &cameras, &count);
    else
        st = tli_json_points(ctx, "fuzz", text, byte_count - 1, *bytes == 'l', &points);
    FUZZ_CHECK(st == TL_OK || st == TL_ERR_FORMAT || st == TL_ERR_BUDGET);
    FUZZ_CHECK(st == TL_OK || *tl_ctx_message(ctx));
    if (points) check_points(points);
    for (size_t i = 0; i < count; i++) FUZZ_CHECK(tl_camera_check(ctx, &cameras[i]) == TL_OK);
    tl_mem_free(ctx, cameras);
    tl_mem_free(ctx, points);
    tl_mem_free(ctx, text);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
    return 0;
}
