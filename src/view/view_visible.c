/* Which values of a model are visible, and how large an error of them does not show: for the query
 * of a cut, bin by bin. */
#include <math.h>

#include "view/view.h"

/* The error of values from low to high that changes what is drawn for them by no more than shown;
 * of a logarithmic scale small values count. */
static double error_of(const tli_paint *paint, double low, double high, double shown)
{
    const double below = low - tli_paint_value(paint, tli_paint_shown(paint, low) - shown);
    const double above = tli_paint_value(paint, tli_paint_shown(paint, high) + shown) - high;
    const double error = fmin(below, above);
    return error > 0 ? error : 0; /* NaN: no logarithm */
}

/* Values of a volume, by its opacities, or of colours on something else. */
static void see_paint(const tl_store_head *head, const tli_paint *paint, bool is_volume, uint32_t c,
                      const tli_seen *seen)
{
    const double *range = head->channels[c].range;
    const double width = (range[1] - range[0]) / TL_BINS;
    const tl_control_points points = {.colors = paint->colors,
                                      .color_count = paint->values.color_count,
                                      .opacities = paint->opacities,
                                      .opacity_count = paint->values.opacity_count};
    for (uint32_t b = 0; b < TL_BINS; b++) {
        const double low = range[0] + b * width, high = low + width;
        double opacity = 1, shown = TL_UNSEEN * (tli_paint_shown(paint, paint->values.range[1]) -
                                                 tli_paint_shown(paint, paint->values.range[0]));
        if (is_volume) {
            const double shown_low = tli_paint_shown(paint, low);
            const double shown_high = tli_paint_shown(paint, high);
            tl_control_points_visible(&points, shown_low, shown_high, &opacity, &shown);
        }
        const float error = (float)error_of(paint, low, high, shown);
        const size_t at = c * (size_t)TL_BINS + b;
        seen->unseen[at] = seen->opacity[at] > 0 ? fminf(seen->unseen[at], error) : error;
        seen->opacity[at] = fmaxf(seen->opacity[at], (float)opacity);
    }
}

/* Each paint once, as a volume or as a colour. */
static void see_colors(const tl_source *source, const tli_agenda *agenda, tli_share share,
                       const tli_seen *seen)
{
    const tl_store_head *head = tl_store_get_head(source->store);
    for (size_t p = 0; p < agenda->paint_count; p++) {
        const tli_paint *paint = agenda->paints[p];
        bool is_volume = false, is_color = false;
        if (!tli_is_used(agenda, share, paint)) continue;
        for (size_t i = 0; i < agenda->thing_count; i++) {
            const tli_entry *thing = &agenda->things[i];
            if (!tli_shares(share, thing)) continue;
            is_volume |= thing->kind == TL_NODE_VOLUME && thing->own == paint;
            is_color |=
                thing->color == paint || (thing->kind == TL_NODE_POINTS && thing->own == paint);
        }
        if (is_volume || is_color)
            see_paint(head, paint, is_volume,
                      tli_source_channel(source, agenda->step, paint->values.channel), seen);
    }
}

bool tli_see(const tl_source *source, const tli_agenda *agenda, tli_share share,
             const tli_seen *seen)
{
    const tl_store_head *head = tl_store_get_head(source->store);
    if (agenda->has_lines) return false;
    for (size_t i = 0; i < agenda->paint_count; i++) {
        const tl_values *values = &agenda->paints[i]->values;
        if (!tli_is_used(agenda, share, agenda->paints[i])) continue;
        if (tli_source_channel(source, agenda->step, values->channel) == TL_NONE ||
            !(values->range[0] < values->range[1]))
            return false;
    }
    see_colors(source, agenda, share, seen);
    for (size_t i = 0; i < agenda->thing_count; i++) { /* every error shows */
        const tli_entry *thing = &agenda->things[i];
        if (thing->kind != TL_NODE_SURFACE || !tli_shares(share, thing)) continue;
        const uint32_t c = tli_source_channel(source, agenda->step, thing->own->values.channel);
        const size_t at = c * (size_t)TL_BINS + tl_bin_of(head->channels[c].range,
                                                          tli_surface_value(agenda->scene, thing));
        seen->opacity[at] = 1;
        seen->unseen[at] = 0;
    }
    return true;
}
