/* Values and how much of the volume has them: ranks, and the opacities of a first look. */
#include <math.h>
#include <stdlib.h>

#include "view/view.h"

/* Values that ranks are taken from; of larger meshes every n-th vertex. */
enum { SAMPLES_MOST = 1 << 18, BINS = TLI_LOOK_POINTS };
/* Opacity of the rarest values of a first look. */
static const double LOOK_OPACITY = 0.6;

static int by_value(const void *a, const void *b)
{
    const tli_sample *x = a, *y = b;
    return (x->value > y->value) - (x->value < y->value);
}

tl_status tli_take_samples(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                           tli_sample **samples, size_t *count)
{
    tl_status st = TL_OK;
    const size_t vert_count = tl_mesh_vert_count(mesh);
    const size_t stride = 1 + vert_count / SAMPLES_MOST;
    double *weights = tl_mem_zalloc(ctx, vert_count, sizeof *weights, &st);
    *count = 0;
    *samples = tl_mem_alloc(ctx, vert_count / stride + 1, sizeof **samples, &st);
    for (size_t t = 0; !st && t < tl_mesh_tet_count(mesh); t++) {
        const double volume = tli_volume_at(mesh, t);
        for (size_t i = 0; i < 4; i++) weights[tl_mesh_tets(mesh)[4 * t + i]] += volume;
    }
    for (size_t v = 0; !st && v < vert_count; v += stride)
        if (isfinite(scalar[v]) && weights[v] > 0)
            (*samples)[(*count)++] = (tli_sample){scalar[v], weights[v]};
    tl_mem_free(ctx, weights);
    if (!st && *count) qsort(*samples, *count, sizeof **samples, by_value);
    return st;
}

double tli_rank_value(const tli_sample *samples, size_t count, double part)
{
    double total = 0, below = 0;
    for (size_t i = 0; i < count; i++) total += samples[i].weight;
    for (size_t i = 0; i < count; i++)
        if ((below += samples[i].weight) >= part * total) return samples[i].value;
    return samples[count - 1].value;
}

static size_t bin_of(double value, const double range[2])
{
    const double at = (value - range[0]) / (range[1] - range[0]) * BINS;
    return at < 0 ? 0 : at >= BINS ? BINS - 1 : (size_t)at;
}

/* Weights of the values in each bin; returns the sum of those in the range. */
static double fill_bins(const tli_sample *samples, size_t count, const double range[2],
                        double bins[BINS])
{
    double total = 0;
    memset(bins, 0, BINS * sizeof *bins);
    for (size_t i = 0; i < count; i++)
        if (samples[i].value >= range[0] && samples[i].value <= range[1]) {
            bins[bin_of(samples[i].value, range)] += samples[i].weight;
            total += samples[i].weight;
        }
    return total;
}

size_t tli_look_opacities(const tli_sample *samples, size_t count, const double range[2],
                          tl_opacity_point *points)
{
    double bins[BINS], total = 0, below = 0;
    size_t mode = 0;
    if (range[1] > range[0]) total = fill_bins(samples, count, range, bins);
    if (!(total > 0)) { /* one value, or none: a fog */
        points[0] = (tl_opacity_point){range[0], LOOK_OPACITY / 10};
        return 1;
    }
    for (size_t b = 1; b < BINS; b++)
        if (bins[b] > bins[mode]) mode = b;
    for (size_t b = 0; b < mode; b++) below += bins[b];
    const double at_mode = (below + bins[mode] / 2) / total;
    const double far_rank = fmax(at_mode, 1 - at_mode);
    const double far_bins = fmax((double)mode, (double)(BINS - 1 - mode));
    double sum = 0;
    for (size_t b = 0; b < BINS; b++) {
        /* by how much of the volume lies between and by the value: rare values that are far from
         * the common ones stand out of those that are merely rare */
        const double rank = fabs((sum + bins[b] / 2) / total - at_mode) / far_rank;
        const double away = (rank + fabs((double)b - (double)mode) / far_bins) / 2;
        points[b] = (tl_opacity_point){range[0] + ((double)b + 0.5) * (range[1] - range[0]) / BINS,
                                       LOOK_OPACITY * away * away * away};
        sum += bins[b];
    }
    return BINS;
}
