/* Transfer functions as tables of values and of integrals over the values: the mean colour and
 * extinction between any two values is a difference of two entries (Sondershaus 2007, chapter 7,
 * pre-integration, kept in one dimension as the antiderivative). */
#include <math.h>
#include <string.h>

#include "draw/draw.h"

/* Opacities are taken as at most this: extinction is finite. */
static const double OPACITY_MAX = 1 - 1e-6;
static const float GREY = 0.5F; /* of NaN */

static tl_status check_points(tl_ctx *ctx, const double *values, size_t stride, size_t count,
                              size_t numbers, const char *kind)
{
    if (!count) return tl_fail(ctx, TL_ERR_ARG, "a transfer function without %s", kind);
    for (size_t i = 0; i < count; i++) {
        const double *p = values + i * stride;
        if (!isfinite(p[0]) || (i && p[0] < p[-(ptrdiff_t)stride]))
            return tl_fail(ctx, TL_ERR_ARG, "point %zu of the %s does not stand in rising order", i,
                           kind);
        for (size_t k = 1; k <= numbers; k++)
            if (!(p[k] >= 0 && p[k] <= 1))
                return tl_fail(ctx, TL_ERR_ARG, "point %zu of the %s has %g, expected 0 to 1", i,
                               kind, p[k]);
    }
    return TL_OK;
}

/* Numbers of points at a value: linear between them. Of a step the upper side. */
static void interpolate(const double *points, size_t stride, size_t count, double value,
                        double *out)
{
    size_t i = 0, numbers = stride - 1;
    while (i < count && points[i * stride] <= value) i++;
    if (i == 0 || i == count) {
        memcpy(out, points + (i ? count - 1 : 0) * stride + 1, numbers * sizeof *out);
        return;
    }
    const double *a = points + (i - 1) * stride, *b = points + i * stride;
    double w = (value - a[0]) / (b[0] - a[0]);
    for (size_t k = 0; k < numbers; k++) out[k] = a[k + 1] * (1 - w) + b[k + 1] * w;
}

/* Integrals by Simpson's rule on each step; exact for linear colours times linear extinction. */
static void add_step(const double a[4], const double m[4], const double b[4], double width,
                     const double before[4], double after[4])
{
    for (int k = 0; k < 4; k++) {
        double fa = k < 3 ? a[k] * a[3] : a[3];
        double fm = k < 3 ? m[k] * m[3] : m[3];
        double fb = k < 3 ? b[k] * b[3] : b[3];
        after[k] = before[k] + width / 6 * (fa + 4 * fm + fb);
    }
}

typedef struct functions {
    const double *colors, *opacities;
    size_t color_count, opacity_count;
    double unit_distance;
} functions;

static void evaluate(const functions *f, double value, double out[4])
{
    double opacity;
    interpolate(f->colors, 4, f->color_count, value, out);
    interpolate(f->opacities, 2, f->opacity_count, value, &opacity);
    out[3] = -log1p(-fmin(opacity, OPACITY_MAX)) / f->unit_distance;
}

/* Notes the integrals at a step (from one before the first), in the block that begins there, too.
 */
static void note_sums(tl_transfer *t, int step, const double sums[4], double base[4])
{
    if (step % TLI_SUM_STEPS == 0 && step)
        for (int k = 0; k < 4; k++)
            t->sums[step + step / TLI_SUM_STEPS - 1][k] = (float)(sums[k] - base[k]);
    if (step % TLI_SUM_STEPS == 0) memcpy(base, sums, 4 * sizeof *base);
    for (int k = 0; k < 4; k++) {
        t->sums[step + step / TLI_SUM_STEPS][k] = (float)(sums[k] - base[k]);
        t->bases[step / TLI_SUM_STEPS][k] = (float)base[k];
    }
}

static void fill(tl_transfer *t, const functions *f)
{
    double last[4], sums[4] = {0}, base[4] = {0}, width = (t->high - t->low) / TLI_TRANSFER_STEPS;
    int first = TLI_TRANSFER_STEPS + 2, last_seen = 0; /* steps that are seen */
    evaluate(f, t->low, last);
    note_sums(t, 0, sums, base);
    for (int i = 0; i <= TLI_TRANSFER_STEPS + 1; i++) {
        double now[4], half[4], at = i <= TLI_TRANSFER_STEPS ? t->low + i * width : t->high;
        evaluate(f, at, now);
        evaluate(f, i && i <= TLI_TRANSFER_STEPS ? at - width / 2 : at, half);
        if (i == 0 || i > TLI_TRANSFER_STEPS) memcpy(last, now, sizeof last);
        for (int k = 0; k < 4 && i <= TLI_TRANSFER_STEPS; k++) t->at[i][k] = (float)now[k];
        double before = sums[3];
        add_step(last, half, now, 1, sums, sums);
        if (sums[3] > before) {
            first = first < i ? first : i;
            last_seen = i;
        }
        note_sums(t, i + 1, sums, base);
        memcpy(last, now, sizeof last);
    }
    t->clear[0] = first > 0 ? first - 2 : -(double)INFINITY;
    t->clear[1] = last_seen <= TLI_TRANSFER_STEPS ? last_seen + 1 : (double)INFINITY;
}

tl_status tl_transfer_create(tl_ctx *ctx, const tl_color_point *colors, size_t color_count,
                             const tl_opacity_point *opacities, size_t opacity_count,
                             double unit_distance, tl_transfer **transfer)
{
    functions f = {
        .color_count = color_count, .opacity_count = opacity_count, .unit_distance = unit_distance};
    *transfer = NULL;
    f.colors = color_count ? &colors->value : NULL;
    f.opacities = opacity_count ? &opacities->value : NULL;
    tl_status st = check_points(ctx, f.colors, 4, color_count, 3, "colours");
    if (!st) st = check_points(ctx, f.opacities, 2, opacity_count, 1, "opacities");
    if (!st && (!(unit_distance > 0) || !isfinite(unit_distance)))
        st = tl_fail(ctx, TL_ERR_ARG, "a unit distance of %g, expected more than 0", unit_distance);
    tl_transfer *t = tl_mem_zalloc(ctx, 1, sizeof *t, &st);
    if (st) return st;
    t->low = fmin(colors[0].value, opacities[0].value);
    t->high = fmax(colors[color_count - 1].value, opacities[opacity_count - 1].value);
    t->per_value = t->high > t->low ? TLI_TRANSFER_STEPS / (t->high - t->low) : 0;
    for (int k = 0; k < 3; k++) t->nan[k] = GREY;
    fill(t, &f);
    *transfer = t;
    return TL_OK;
}

tl_status tl_transfer_with_nan(tl_ctx *ctx, const tl_transfer *from, const double rgb[3],
                               tl_transfer **transfer)
{
    tl_status st = TL_OK;
    *transfer = NULL;
    for (int k = 0; k < 3; k++)
        if (!(rgb[k] >= 0 && rgb[k] <= 1))
            return tl_fail(ctx, TL_ERR_ARG, "the colour of NaN has %g, expected 0 to 1", rgb[k]);
    tl_transfer *t = tl_mem_alloc(ctx, 1, sizeof *t, &st);
    if (st) return st;
    *t = *from;
    for (int k = 0; k < 3; k++) t->nan[k] = (float)rgb[k];
    *transfer = t;
    return TL_OK;
}

void tl_transfer_destroy(tl_ctx *ctx, tl_transfer *transfer)
{
    tl_mem_free(ctx, transfer);
}

void tl_transfer_at(const tl_transfer *transfer, double value, float rgb[3], double *extinction)
{
    double at = (value - transfer->low) * transfer->per_value;
    memcpy(rgb, transfer->nan, sizeof transfer->nan);
    *extinction = 0;
    if (isnan(value)) return;
    at = at < 0 || isnan(at) ? 0 : at > TLI_TRANSFER_STEPS ? TLI_TRANSFER_STEPS : at;
    size_t i = at < TLI_TRANSFER_STEPS ? (size_t)at : TLI_TRANSFER_STEPS - 1;
    float w = (float)(at - (double)i);
    for (int k = 0; k < 3; k++) rgb[k] = transfer->at[i][k] * (1 - w) + transfer->at[i + 1][k] * w;
    *extinction = (double)(transfer->at[i][3] * (1 - w) + transfer->at[i + 1][3] * w);
}
