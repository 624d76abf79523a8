/* Control points in an editor: places, hits, changes. Points are left out by the distance of the
 * farthest one (Ramer 1972, Douglas & Peucker 1973), measured along opacity or colour alone, as the
 * place along the axis stays. */
#include "viewer_curve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where values stand that a logarithmic axis does not have, in lengths of it. */
static const double FAR_LEFT = -1e3;
/* The least length of an axis, of the larger of its ends: numbers on it differ in six digits. */
static const double AXIS_LEAST = 1e-7;

/* ---- the axis ---- */

double viewer_axis_px(const viewer_axis *axis, double value)
{
    const double low = axis->range[0], high = axis->range[1];
    double part;
    if (!axis->logarithmic)
        part = (value / 2 - low / 2) / (high / 2 - low / 2); /* halves do not overflow */
    else if (value > 0)
        part = log(value / low) / log(high / low);
    else
        part = FAR_LEFT;
    return axis->start_px + part * axis->length_px;
}

double viewer_axis_value(const viewer_axis *axis, double px)
{
    const double low = axis->range[0], high = axis->range[1];
    const double part = (px - axis->start_px) / axis->length_px;
    if (part == 0) return low;
    if (part == 1) return high;
    if (axis->logarithmic) return low * pow(high / low, part);
    return (1 - part) * low + part * high;
}

double viewer_axis_beside(const viewer_axis *axis, double value, double step_px)
{
    const double moved = viewer_axis_value(axis, viewer_axis_px(axis, value) + step_px);
    return fmin(fmax(moved, axis->range[0]), axis->range[1]);
}

double viewer_axis_round(const viewer_axis *axis, double value)
{
    const double px = viewer_axis_px(axis, value);
    const double step = viewer_axis_value(axis, px + 0.5) - viewer_axis_value(axis, px - 0.5);
    if (!(step > 0) || !isfinite(step)) return value;
    const int exponent = (int)floor(log10(step));
    /* a division by a power of ten that is exact gives the number nearest to the decimal one */
    const double unit = pow(10, abs(exponent));
    const double rounded = exponent < 0 ? round(value * unit) / unit : round(value / unit) * unit;
    if (!isfinite(rounded)) return value;
    return fmin(fmax(rounded, axis->range[0]), axis->range[1]);
}

/* Takes over ends that have digits between them. */
static void take_ends(viewer_axis *axis, double low, double high)
{
    if (!(high - low > fmax(fabs(low), fabs(high)) * AXIS_LEAST)) return;
    axis->range[0] = low;
    axis->range[1] = high;
}

void viewer_axis_zoom(viewer_axis *axis, const double all[2], double factor, double px)
{
    const double low = viewer_axis_value(axis, px - (px - axis->start_px) * factor);
    const double end_px = axis->start_px + axis->length_px;
    const double high = viewer_axis_value(axis, px + (end_px - px) * factor);
    take_ends(axis, fmax(low, all[0]), fmin(high, all[1]));
}

void viewer_axis_pan(viewer_axis *axis, const double all[2], double by_px)
{
    const double left = axis->start_px, right = left + axis->length_px;
    double move = -by_px; /* of the ends */
    move = fmax(move, fmin(viewer_axis_px(axis, all[0]) - left, 0));
    move = fmin(move, fmax(viewer_axis_px(axis, all[1]) - right, 0));
    take_ends(axis, viewer_axis_value(axis, left + move), viewer_axis_value(axis, right + move));
}

/* ---- rows ---- */

double *viewer_curve_row(viewer_curve *curve, size_t i)
{
    return curve->rows + i * curve->width;
}

const double *viewer_curve_row_const(const viewer_curve *curve, size_t i)
{
    return curve->rows + i * curve->width;
}

void viewer_curve_set(viewer_curve *curve, size_t width, const double *rows, size_t count)
{
    curve->width = width;
    curve->count = count < VIEWER_CURVE_POINTS_MAX ? count : VIEWER_CURVE_POINTS_MAX;
    if (curve->count) memcpy(curve->rows, rows, curve->count * width * sizeof *rows);
}

/* How far a value lies from a to b, 0 to 1; points at one value are a step. */
static double part_between(bool logarithmic, double value, double a, double b)
{
    if (!(b > a)) return 1;
    if (logarithmic && a > 0) return log(value / a) / log(b / a);
    return (value - a) / (b - a);
}

/* Numbers of the straight piece from row a to row b. */
static void on_piece(const viewer_curve *curve, size_t a, size_t b, bool logarithmic, double value,
                     double *numbers)
{
    const double *from = viewer_curve_row_const(curve, a), *to = viewer_curve_row_const(curve, b);
    const double part = part_between(logarithmic, value, from[0], to[0]);
    for (size_t k = 1; k < curve->width; k++) numbers[k - 1] = from[k] + part * (to[k] - from[k]);
}

void viewer_curve_at(const viewer_curve *curve, bool logarithmic, double value, double *numbers)
{
    size_t after = 0;
    if (!curve->count) {
        for (size_t k = 1; k < curve->width; k++) numbers[k - 1] = 0;
        return;
    }
    while (after < curve->count && viewer_curve_row_const(curve, after)[0] <= value) after++;
    if (after == 0 || after == curve->count) {
        const size_t end = after ? after - 1 : 0;
        memcpy(numbers, viewer_curve_row_const(curve, end) + 1,
               (curve->width - 1) * sizeof *numbers);
        return;
    }
    on_piece(curve, after - 1, after, logarithmic, value, numbers);
}

/* ---- changes ---- */

size_t viewer_curve_add(viewer_curve *curve, bool logarithmic, double value)
{
    double numbers[VIEWER_CURVE_WIDTH_MAX];
    size_t at = 0;
    if (curve->count == VIEWER_CURVE_POINTS_MAX) return VIEWER_CURVE_NONE;
    viewer_curve_at(curve, logarithmic, value, numbers);
    while (at < curve->count && viewer_curve_row_const(curve, at)[0] <= value) at++;
    double *row = viewer_curve_row(curve, at);
    memmove(row + curve->width, row, (curve->count - at) * curve->width * sizeof *row);
    row[0] = value;
    memcpy(row + 1, numbers, (curve->width - 1) * sizeof *row);
    curve->count++;
    return at;
}

bool viewer_curve_remove(viewer_curve *curve, size_t i)
{
    if (curve->count < 2 || i >= curve->count) return false;
    double *row = viewer_curve_row(curve, i);
    curve->count--;
    memmove(row, row + curve->width, (curve->count - i) * curve->width * sizeof *row);
    return true;
}

double viewer_curve_move(viewer_curve *curve, size_t i, double value)
{
    double *row = viewer_curve_row(curve, i);
    if (i > 0) value = fmax(value, viewer_curve_row(curve, i - 1)[0]);
    if (i + 1 < curve->count) value = fmin(value, viewer_curve_row(curve, i + 1)[0]);
    return row[0] = value;
}

size_t viewer_curve_hit(const viewer_curve *curve, const viewer_axis *axis, double bottom_px,
                        double height_px, const double px[2], double reach_px)
{
    size_t hit = VIEWER_CURVE_NONE;
    double nearest = reach_px;
    for (size_t i = 0; i < curve->count; i++) {
        const double *row = viewer_curve_row_const(curve, i);
        const double x = viewer_axis_px(axis, row[0]) - px[0];
        const double y = height_px > 0 ? bottom_px - row[1] * height_px - px[1] : 0;
        const double away = hypot(x, y);
        if (away > nearest) continue;
        nearest = away;
        hit = i;
    }
    return hit;
}

void viewer_curve_stretch(viewer_curve *curve, bool logarithmic, const double from[2],
                          const double to[2])
{
    const viewer_axis old = {{from[0], from[1]}, logarithmic && from[0] > 0, 0, 1};
    const viewer_axis new = {{to[0], to[1]}, logarithmic && to[0] > 0, 0, 1};
    for (size_t i = 0; i < curve->count; i++) {
        double *value = viewer_curve_row(curve, i);
        *value = viewer_axis_value(&new, viewer_axis_px(&old, *value));
    }
}

/* ---- fewer points ---- */

/* Keeps what the pieces between rows first and last need; a stack instead of recursion, as a step
 * at each point would nest as deeply as there are points. */
static void mark_kept(const viewer_curve *curve, bool logarithmic, double tolerance,
                      bool kept[VIEWER_CURVE_POINTS_MAX])
{
    size_t ends[VIEWER_CURVE_POINTS_MAX], depth = 0, first = 0;
    memset(kept, 0, VIEWER_CURVE_POINTS_MAX * sizeof *kept);
    kept[0] = kept[curve->count - 1] = true;
    ends[depth++] = curve->count - 1;
    while (depth) {
        const size_t last = ends[depth - 1];
        size_t worst = first;
        double most = tolerance;
        for (size_t i = first + 1; i < last; i++) {
            const double *row = viewer_curve_row_const(curve, i);
            double numbers[VIEWER_CURVE_WIDTH_MAX], away = 0;
            on_piece(curve, first, last, logarithmic, row[0], numbers);
            for (size_t k = 1; k < curve->width; k++)
                away = fmax(away, fabs(numbers[k - 1] - row[k]));
            if (away > most) {
                most = away;
                worst = i;
            }
        }
        if (worst == first) {
            first = last;
            depth--;
        } else {
            kept[worst] = true;
            ends[depth++] = worst;
        }
    }
}

void viewer_curve_thin(viewer_curve *curve, bool logarithmic, double tolerance)
{
    bool kept[VIEWER_CURVE_POINTS_MAX];
    size_t count = 0;
    if (curve->count < 3) return;
    mark_kept(curve, logarithmic, tolerance, kept);
    for (size_t i = 0; i < curve->count; i++)
        if (kept[i])
            memmove(viewer_curve_row(curve, count++), viewer_curve_row(curve, i),
                    curve->width * sizeof *curve->rows);
    curve->count = count;
}
