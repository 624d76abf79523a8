/* A channel over the volume: integral, mean, deviation and percentiles of the piecewise linear
 * field in closed form. With corner values v of a tet of volume V, the integral of the field is V
 * times their mean, that of its square V / 20 (sum(v)^2 + sum(v^2)); the part below a value is that
 * of a corner cut off, or of a wedge. */
#include <math.h>
#include <string.h>

#include "measure/measure.h"

/* Edges of the two histograms that percentiles are found by: a part of a part of the range. */
enum { EDGES = 1024 };
static const double PARTS[TL_STATISTICS_PARTS] = {0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99};

void tl_channel_at(const tl_mesh *mesh, const tl_channel *channel, tl_lidx tet,
                   const double weights[4], double *out)
{
    const size_t n = channel->components;
    const tl_lidx *corners = tl_mesh_tets(mesh) + 4 * (size_t)tet;
    for (size_t k = 0; k < n; k++) {
        out[k] = channel->on == TL_ON_TET ? channel->values[n * tet + k] : 0;
        for (size_t i = 0; channel->on == TL_ON_VERTEX && i < 4; i++)
            if (weights[i] != 0) out[k] += weights[i] * channel->values[n * corners[i] + k];
    }
}

/* ---- tets ---- */

typedef struct field {
    const tl_mesh *mesh;
    const tl_channel *channel;
    uint32_t component;
} field;

static double value_of(const field *f, size_t element)
{
    const uint32_t n = f->channel->components;
    const double *v = f->channel->values + element * n;
    double sum = 0;
    if (f->component < n) return v[f->component];
    for (uint32_t k = 0; k < n; k++) sum += v[k] * v[k];
    return sqrt(sum);
}

/* Volume and corner values of a tet; false if one is not finite. */
static bool take_tet(const field *f, size_t tet, double *volume, double v[4])
{
    double p[4][3];
    const tl_lidx *corners = tl_mesh_tets(f->mesh) + 4 * tet;
    for (size_t i = 0; i < 4; i++) {
        memcpy(p[i], tl_mesh_xyz(f->mesh) + 3 * (size_t)corners[i], sizeof p[i]);
        v[i] = value_of(f, f->channel->on == TL_ON_TET ? tet : corners[i]);
        if (!isfinite(v[i])) return false;
    }
    *volume = fabs(tl_tet_volume((const double(*)[3])p));
    return isfinite(*volume);
}

static void sort_four(double v[4])
{
    static const int PAIRS[5][2] = {{0, 1}, {2, 3}, {0, 2}, {1, 3}, {1, 2}};
    for (int i = 0; i < 5; i++) {
        double *a = &v[PAIRS[i][0]], *b = &v[PAIRS[i][1]], low = fmin(*a, *b);
        *b = fmax(*a, *b);
        *a = low;
    }
}

/* Part of a tet with rising values v whose value is below t. */
static double part_below(const double v[4], double t)
{
    if (t <= v[0]) return v[0] < v[3] || t < v[0] ? 0 : 1;
    if (t >= v[3]) return 1;
    if (t <= v[1])
        return (t - v[0]) / (v[1] - v[0]) * ((t - v[0]) / (v[2] - v[0])) *
               ((t - v[0]) / (v[3] - v[0]));
    if (t >= v[2])
        return 1 - (v[3] - t) / (v[3] - v[0]) * ((v[3] - t) / (v[3] - v[1])) *
                       ((v[3] - t) / (v[3] - v[2]));
    /* a wedge lies above: of three tets */
    const double ca = (v[2] - t) / (v[2] - v[0]), cb = (v[2] - t) / (v[2] - v[1]);
    const double da = (v[3] - t) / (v[3] - v[0]), db = (v[3] - t) / (v[3] - v[1]);
    return 1 - (ca * cb + da * db * (1 - cb) + da * (1 - ca) * cb);
}

/* ---- percentiles ---- */

/* below [EDGES + 1]: volume whose value is below each of the edges from low to high. */
static void fill_edges(const field *f, double low, double high, double *below)
{
    const double width = (high - low) / EDGES;
    double whole[EDGES + 2] = {0}; /* tets that are below from an edge on */
    memset(below, 0, (EDGES + 1) * sizeof *below);
    for (size_t t = 0; t < tl_mesh_tet_count(f->mesh); t++) {
        double volume, v[4];
        if (!take_tet(f, t, &volume, v)) continue;
        sort_four(v);
        if (v[0] > high) continue;
        double from = ceil((v[0] - low) / width);
        size_t edge = from > 0 ? from < EDGES ? (size_t)from : EDGES : 0;
        for (; edge <= EDGES && low + (double)edge * width < v[3]; edge++)
            below[edge] += volume * part_below(v, low + (double)edge * width);
        whole[edge] += volume;
    }
    double sum = 0;
    for (size_t e = 0; e <= EDGES; e++) {
        sum += whole[e];
        below[e] += sum;
    }
}

/* The value that a volume lies below, between two edges. */
static double cross(const double *below, double low, double high, double wanted, double range[2])
{
    size_t edge = 0;
    const double width = (high - low) / EDGES;
    while (edge + 1 < EDGES && below[edge + 1] < wanted) edge++;
    range[0] = low + (double)edge * width;
    range[1] = low + (double)(edge + 1) * width;
    const double rise = below[edge + 1] - below[edge];
    const double at = rise > 0 ? fmin(fmax((wanted - below[edge]) / rise, 0), 1) : 0;
    return range[0] + at * width;
}

static tl_status find_parts(tl_ctx *ctx, const field *f, tl_statistics *s)
{
    tl_status st = TL_OK;
    double *coarse = tl_mem_alloc(ctx, EDGES + 1, sizeof *coarse, &st);
    double *fine = tl_mem_alloc(ctx, EDGES + 1, sizeof *fine, &st);
    if (!st) fill_edges(f, s->least, s->most, coarse);
    for (int i = 0; !st && i < TL_STATISTICS_PARTS; i++) {
        double range[2], inner[2];
        cross(coarse, s->least, s->most, PARTS[i] * s->volume, range);
        fill_edges(f, range[0], range[1], fine);
        s->parts[i] = cross(fine, range[0], range[1], PARTS[i] * s->volume, inner);
    }
    tl_mem_free(ctx, fine);
    tl_mem_free(ctx, coarse);
    return st;
}

/* ---- all ---- */

tl_status tl_channel_statistics(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                                uint32_t component, tl_statistics *statistics)
{
    const field f = {mesh, channel, component};
    tl_statistics s = {.least = (double)INFINITY, .most = -(double)INFINITY};
    double volume, v[4], squares = 0;
    if (component > channel->components)
        return tl_fail(ctx, TL_ERR_ARG, "component %u of a channel of %u", component,
                       channel->components);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        if (!take_tet(&f, t, &volume, v)) continue;
        s.volume += volume;
        s.integral += volume * (v[0] / 4 + v[1] / 4 + v[2] / 4 + v[3] / 4);
        for (int i = 0; i < 4; i++) {
            s.least = fmin(s.least, v[i]);
            s.most = fmax(s.most, v[i]);
        }
    }
    if (!(s.least <= s.most)) s.least = s.most = 0;
    s.mean = s.volume > 0 ? s.integral / s.volume : s.least;
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        double sum = 0, square = 0;
        if (!take_tet(&f, t, &volume, v)) continue;
        for (int i = 0; i < 4; i++) {
            sum += v[i] - s.mean;
            square += (v[i] - s.mean) * (v[i] - s.mean);
        }
        squares += volume / 20 * (sum * sum + square);
    }
    s.deviation = s.volume > 0 ? sqrt(squares / s.volume) : 0;
    for (int i = 0; i < TL_STATISTICS_PARTS; i++) s.parts[i] = s.least;
    tl_status st = s.least < s.most && isfinite(s.most - s.least) && s.volume > 0
                       ? find_parts(ctx, &f, &s)
                       : TL_OK;
    if (!st) *statistics = s;
    return st;
}
