/* What a content tells. */
#include <math.h>

#include "view/view.h"

/* Rays a pixel and side where there are edges to be smoothed; clouds have none. */
enum { SAMPLES = 2, SIDE_MAX = 32768 };

const tl_content_facts *tl_content_get_facts(const tl_content *content)
{
    return &content->facts;
}

tl_status tl_content_error_px(tl_ctx *ctx, const tl_content *content, const tl_camera *camera,
                              double *pixels)
{
    double hull = 0;
    tl_status st = tli_outlook_pixels(ctx, &content->outlook, camera, pixels);
    if (!st) st = tli_outlook_pixels(ctx, &content->hull_outlook, camera, &hull);
    if (!st) *pixels = fmax(*pixels, hull);
    return st;
}

const tl_values *const *tl_content_all_values(const tl_content *content, size_t *count)
{
    *count = content->paint_count;
    return content->values;
}

const tl_values *tl_content_values(const tl_content *content, const char *channel)
{
    for (size_t i = 0; i < content->paint_count; i++)
        if (strcmp(content->values[i]->channel, channel) == 0) return content->values[i];
    return NULL;
}

uint32_t tl_content_samples(const tl_content *content, const tl_scene *scene, uint32_t width,
                            uint32_t height)
{
    const double asked = tl_scene_real(scene, TL_NODE_PICTURE + 1, "samples");
    bool has_edges = false;
    for (size_t i = 0; i < content->thing_count; i++)
        has_edges |= content->things[i].kind != TLI_THING_VOLUME;
    if (asked > 0) return (uint32_t)asked;
    return has_edges && width <= SIDE_MAX / SAMPLES && height <= SIDE_MAX / SAMPLES ? SAMPLES : 1;
}
