/* Errors of the drawn segments, which a camera turns into pixels. */
#include "cut/cut_outlook.h"

#include <math.h>
#include <string.h>

#include "cut/cut_object.h"

tl_status tli_outlook_take(tl_ctx *ctx, const tl_cut *cut, tli_outlook *outlook)
{
    tl_status st = TL_OK;
    const tli_ids *fringe = &cut->now.fringe;
    *outlook = (tli_outlook){.diagonal = cut->graph.head->stats.diagonal};
    outlook->parts = tl_mem_alloc(ctx, fringe->count, sizeof *outlook->parts, &st);
    for (size_t i = 0; !st && i < fringe->count; i++) {
        const tli_node *node = &cut->graph.nodes[fringe->ids[i]];
        if (tli_is_refined(&cut->now, fringe->ids[i]) || !(node->seen_error > 0)) continue;
        tli_outlook_part *part = &outlook->parts[outlook->count++];
        memcpy(part->sphere, node->sphere, sizeof part->sphere);
        part->error = node->seen_error;
    }
    return st;
}

void tli_outlook_release(tl_ctx *ctx, tli_outlook *outlook)
{
    tl_mem_free(ctx, outlook->parts);
    *outlook = (tli_outlook){0};
}

tl_status tli_outlook_pixels(tl_ctx *ctx, const tli_outlook *outlook, const tl_camera *camera,
                             double *pixels)
{
    tli_view view;
    tl_status st = tli_view_set(ctx, camera, outlook->diagonal, &view);
    *pixels = 0;
    for (size_t i = 0; !st && i < outlook->count; i++) {
        const double scale = tli_view_pixels(&view, outlook->parts[i].sphere);
        if (scale > 0) *pixels = fmax(*pixels, scale * outlook->parts[i].error);
    }
    return st;
}
