/* What control points let be seen of values. */
#include <math.h>

#include "scene/scene.h"

/* Errors looked at, as parts of high - low: from the first on, each twice the one before. */
static const double UNSEEN_LEAST = 0x1p-6;
enum { UNSEEN_STEPS = 9 };

static double between(const tl_opacity_point *a, const tl_opacity_point *b, double value)
{
    const double width = b->value - a->value;
    const double t = width > 0 ? (value - a->value) / width : 0;
    return a->opacity + t * (b->opacity - a->opacity);
}

/* Largest opacity of values from low to high. Before the first point and behind the last one it is
 * theirs. */
static double most_opaque(const tl_control_points *p, double low, double high)
{
    const tl_opacity_point *points = p->opacities;
    const size_t count = p->opacity_count;
    double most = 0;
    if (!count) return 1;
    if (low <= points[0].value) most = points[0].opacity;
    if (high >= points[count - 1].value) most = fmax(most, points[count - 1].opacity);
    for (size_t i = 0; i + 1 < count; i++) {
        const tl_opacity_point *a = &points[i], *b = a + 1;
        if (b->value < low || a->value > high) continue;
        most = fmax(most,
                    fmax(between(a, b, fmax(low, a->value)), between(a, b, fmin(high, b->value))));
    }
    return most;
}

/* How fast opacity and colour change at most with values from low to high. */
static double steepest(const tl_control_points *p, double low, double high)
{
    double fade = 0, shade = 0;
    for (size_t i = 0; i + 1 < p->opacity_count; i++) {
        const tl_opacity_point *a = &p->opacities[i], *b = a + 1;
        if (b->value < low || a->value > high || a->opacity == b->opacity) continue;
        fade = fmax(fade, fabs(b->opacity - a->opacity) / (b->value - a->value));
    }
    for (size_t i = 0; i + 1 < p->color_count; i++) {
        const tl_color_point *a = &p->colors[i], *b = a + 1;
        if (b->value < low || a->value > high) continue;
        for (int k = 0; k < 3; k++)
            if (a->rgb[k] != b->rgb[k])
                shade = fmax(shade, fabs(b->rgb[k] - a->rgb[k]) / (b->value - a->value));
    }
    const double most = most_opaque(p, low, high);
    return fade + (most > 0 ? most * shade : 0);
}

void tl_control_points_visible(const tl_control_points *points, double low, double high,
                               double *opacity, double *unseen)
{
    double reach = UNSEEN_LEAST * (high - low);
    *opacity = most_opaque(points, low, high);
    *unseen = 0;
    for (int i = 0; i < UNSEEN_STEPS; i++, reach *= 2)
        *unseen =
            fmax(*unseen, fmin(reach, TL_UNSEEN / steepest(points, low - reach, high + reach)));
}
