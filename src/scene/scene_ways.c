/* From one control point of a transfer function to the next: ways that are not straight become many
 * points. */
#include "scene/scene_ways.h"

#include <math.h>
#include <string.h>

/* What straight pieces may differ from the way by, and how often a way is halved. */
static const double BEND_MOST = 0.25 / 255;
enum { HALVINGS = 20, PROBES = 8 };

/* Colour, or opacity and zeros, at a part of the way. */
static void way_at(const tli_way *w, double t, double out[3])
{
    memset(out, 0, 3 * sizeof *out);
    if (w->is_color)
        tli_color_between(w->space, w->a + 1, w->b + 1, t, out);
    else
        out[0] = tli_opacity_between(w->a[1], w->b[1], w->a[2], w->a[3], t);
}

static bool are_near(const double a[3], const double b[3])
{
    for (int k = 0; k < 3; k++)
        if (fabs(a[k] - b[k]) > BEND_MOST) return false;
    return true;
}

/* At a part of the way; never below the point before, and not the same again. */
static void add_point(const tli_way *w, double t, const double numbers[3], tli_points *points)
{
    const size_t count = w->is_color ? points->color_count : points->opacity_count;
    const double from = w->a[0], to = w->b[0];
    double value = w->logarithmic && from > 0 ? exp((1 - t) * log(from) + t * log(to))
                                              : (1 - t) * from + t * to;
    double last_value = -(double)INFINITY, last[3] = {0};
    if (count && w->is_color) {
        last_value = points->colors[count - 1].value;
        memcpy(last, points->colors[count - 1].rgb, sizeof last);
    } else if (count) {
        last_value = points->opacities[count - 1].value;
        last[0] = points->opacities[count - 1].opacity;
    }
    value = fmax(t <= 0 ? from : t >= 1 ? to : fmin(value, to), last_value);
    if (value == last_value && are_near(numbers, last)) return;
    if (w->is_color)
        points->colors[points->color_count++] =
            (tl_color_point){value, {numbers[0], numbers[1], numbers[2]}};
    else
        points->opacities[points->opacity_count++] = (tl_opacity_point){value, numbers[0]};
}

static bool is_straight(const tli_way *w, double t0, const double *n0, double t1, const double *n1)
{
    for (int i = 1; i < PROBES; i++) {
        const double part = (double)i / PROBES;
        double now[3], straight[3];
        way_at(w, t0 + part * (t1 - t0), now);
        for (int k = 0; k < 3; k++) straight[k] = (1 - part) * n0[k] + part * n1[k];
        if (!are_near(now, straight)) return false;
    }
    return true;
}

/* Points between two parts of the way, so many that straight pieces follow it. Where there is no
 * room for more the rest is straight. */
static void bend(const tli_way *w, double t0, const double *n0, double t1, const double *n1,
                 int halvings, tli_points *points)
{
    const size_t count = w->is_color ? points->color_count : points->opacity_count;
    const double half = (t0 + t1) / 2;
    double middle[3];
    /* room is left for both sides of all that the file has */
    if (!halvings || count + 2 * TLI_FILE_POINTS_MAX + 4 > TL_SCENE_ROWS_MAX ||
        is_straight(w, t0, n0, t1, n1))
        return;
    way_at(w, half, middle);
    bend(w, t0, n0, half, middle, halvings - 1, points);
    add_point(w, half, middle, points);
    bend(w, half, middle, t1, n1, halvings - 1, points);
}

void tli_ways_follow(const double *numbers, size_t count, tli_way w, tli_points *points)
{
    for (size_t i = 0; i < count; i++) {
        double own[3] = {0}, next[3] = {0}, from[3], to[3];
        w.a = numbers + TLI_POINT_NUMBERS * i;
        w.b = i + 1 < count ? w.a + TLI_POINT_NUMBERS : w.a;
        memcpy(own, w.a + 1, (w.is_color ? 3 : 1) * sizeof *own);
        memcpy(next, w.b + 1, (w.is_color ? 3 : 1) * sizeof *next);
        if (i == 0 || i + 1 == count) add_point(&w, 0, own, points);
        if (!(w.b[0] > w.a[0])) continue;
        way_at(&w, 0, from);
        way_at(&w, 1, to);
        if (are_near(from, own)) memcpy(from, own, sizeof from); /* without its rounding */
        if (are_near(to, next)) memcpy(to, next, sizeof to);
        add_point(&w, 0, from, points);
        bend(&w, 0, from, 1, to, HALVINGS, points);
        add_point(&w, 1, to, points);
    }
}
