/* Transfer functions: from a file, from the name of a colour map, from the values alone.
 */
#include "cli_transfer.h"

#include <math.h>
#include <string.h>

enum { BINS = 256 };
/* Opacity of the rarest values of a first look. */
static const double LOOK_OPACITY = 0.6;

int cli_points_read(tl_ctx *ctx, const char *path, bool logarithmic, cli_points *points)
{
    tl_control_points *read;
    tl_status st = tl_control_points_read(ctx, path, logarithmic, &read);
    if (st) {
        fprintf(stderr, "tetralod: %s\n", tl_ctx_message(ctx));
        return CLI_FAILED;
    }
    points->color_count = read->color_count;
    points->opacity_count = read->opacity_count;
    points->logarithmic = read->logarithmic;
    memcpy(points->colors, read->colors, read->color_count * sizeof *read->colors);
    memcpy(points->opacities, read->opacities, read->opacity_count * sizeof *read->opacities);
    tl_mem_free(ctx, read);
    return CLI_DONE;
}

bool cli_points_map(const char *name, const double range[2], cli_points *points)
{
    size_t count;
    const tl_color_point *map = tl_colormap(name, &count);
    if (!map) return false;
    points->color_count = count;
    for (size_t i = 0; i < count; i++) {
        points->colors[i] = map[i];
        points->colors[i].value = range[0] + map[i].value * (range[1] - range[0]);
    }
    return true;
}

static size_t bin_of(double value, const double range[2])
{
    double at = (value - range[0]) / (range[1] - range[0]) * BINS;
    return at < 0 ? 0 : at >= BINS ? BINS - 1 : (size_t)at;
}

/* Weights of the values in each bin; returns the sum of those in the range. */
static double fill_bins(const double *values, const double *weights, size_t count,
                        const double range[2], double bins[BINS])
{
    double total = 0;
    memset(bins, 0, BINS * sizeof *bins);
    for (size_t i = 0; i < count; i++)
        if (values[i] >= range[0] && values[i] <= range[1]) {
            bins[bin_of(values[i], range)] += weights[i];
            total += weights[i];
        }
    return total;
}

void cli_points_look(const double *values, const double *weights, size_t count,
                     const double range[2], cli_points *points)
{
    double bins[BINS], total = 0, below = 0;
    size_t mode = 0;
    if (range[1] > range[0]) total = fill_bins(values, weights, count, range, bins);
    if (!(total > 0)) { /* one value, or none: a fog */
        points->opacities[0] = (tl_opacity_point){range[0], LOOK_OPACITY / 10};
        points->opacity_count = 1;
        return;
    }
    for (size_t b = 1; b < BINS; b++)
        if (bins[b] > bins[mode]) mode = b;
    for (size_t b = 0; b < mode; b++) below += bins[b];
    double at_mode = (below + bins[mode] / 2) / total, sum = 0;
    const double far_rank = fmax(at_mode, 1 - at_mode);
    const double far_bins = fmax((double)mode, (double)(BINS - 1 - mode));
    for (size_t b = 0; b < BINS; b++) {
        /* by how much of the volume lies between and by the value: rare values that are far from
         * the common ones stand out of those that are merely rare */
        const double rank = fabs((sum + bins[b] / 2) / total - at_mode) / far_rank;
        const double away = (rank + fabs((double)b - (double)mode) / far_bins) / 2;
        points->opacities[b] =
            (tl_opacity_point){range[0] + ((double)b + 0.5) * (range[1] - range[0]) / BINS,
                               LOOK_OPACITY * away * away * away};
        sum += bins[b];
    }
    points->opacity_count = BINS;
}
