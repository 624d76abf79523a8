/* How values are spread over the volume: taken at spots, places that stand evenly in it however
 * large its tets are, in rising order; ranks of them, and the opacities of a first look. Within
 * their tets spots follow the additive sequence of Roberts, "The unreasonable effectiveness of
 * quasirandom sequences" (2018), so that they have the values of the piecewise linear field there:
 * means of coarse tets, or values of their corners, would have other extremes than it. */
#include <math.h>

#include "base/base_sort.h"
#include "view/view.h"

/* Tets that a thread walks through at a time. */
enum { GRAIN = 1 << 14, BINS = TLI_LOOK_POINTS };
/* Opacity of the rarest values of a first look; bins of it that the most frequent ones lie in. */
static const double LOOK_OPACITY = 0.6, MODE_BINS = 1.5;

/* ---- spots ---- */

/* Volumes of runs of tets, and then where each begins. */
typedef struct walk {
    const tl_mesh *mesh;
    double *starts; /* [runs + 1] */
    double step;    /* volume from spot to spot */
    tl_lidx *spots; /* [count] */
    size_t count;
} walk;

static tl_status sum_run(void *arg, size_t begin, size_t end, unsigned worker)
{
    walk *w = arg;
    double sum = 0;
    (void)worker;
    for (size_t t = begin; t < end; t++) sum += tli_volume_at(w->mesh, t);
    w->starts[begin / GRAIN + 1] = sum;
    return TL_OK;
}

/* The first spot that does not lie before a volume. */
static size_t spot_at(const walk *w, double volume)
{
    const double at = ceil(volume / w->step - 0.5);
    return at <= 0 ? 0 : at >= (double)w->count ? w->count : (size_t)at;
}

static tl_status place_run(void *arg, size_t begin, size_t end, unsigned worker)
{
    walk *w = arg;
    const double start = w->starts[begin / GRAIN];
    const size_t last = spot_at(w, w->starts[begin / GRAIN + 1]);
    size_t spot = spot_at(w, start), tet = begin;
    double sum = 0;
    (void)worker;
    for (size_t t = begin; t < end && spot < last; t++) {
        const double volume = tli_volume_at(w->mesh, t);
        if (!(volume > 0)) continue;
        tet = t;
        sum += volume;
        for (; spot < last && ((double)spot + 0.5) * w->step < start + sum; spot++)
            w->spots[spot] = (tl_lidx)t;
    }
    for (; spot < last; spot++) w->spots[spot] = (tl_lidx)tet; /* sums are rounded */
    return TL_OK;
}

tl_status tli_body_spots(tl_ctx *ctx, tli_body *body, size_t count)
{
    tl_status st = TL_OK;
    const size_t tets = tl_mesh_tet_count(body->mesh), runs = (tets + GRAIN - 1) / GRAIN;
    walk w = {.mesh = body->mesh, .count = count};
    if (body->spots) return TL_OK;
    w.starts = tl_mem_zalloc(ctx, runs + 1, sizeof *w.starts, &st);
    w.spots = tl_mem_alloc(body->ctx, count, sizeof *w.spots, &st);
    if (!st) st = tli_parallel(ctx, tets, GRAIN, sum_run, &w);
    for (size_t i = 0; !st && i < runs; i++) w.starts[i + 1] += w.starts[i];
    w.step = st ? 0 : w.starts[runs] / (double)count;
    const bool any = w.step > 0 && isfinite(w.step);
    if (!st && any) st = tli_parallel(ctx, tets, GRAIN, place_run, &w);
    tl_mem_free(ctx, w.starts);
    if (st) {
        tl_mem_free(body->ctx, w.spots);
        return st;
    }
    body->spots = w.spots;
    body->spot_count = any ? count : 0;
    return TL_OK;
}

/* ---- values at them ---- */

/* Shares of the corners of its tet at a spot. */
static void place_in_tet(size_t spot, double share[4])
{
    /* powers of the root of x^4 = x + 1 */
    static const double STEPS[3] = {0.81917251339616437, 0.67104360670378920, 0.54970047790197026};
    double cut[3];
    for (int k = 0; k < 3; k++) {
        const double at = 0.5 + (double)spot * STEPS[k];
        cut[k] = at - floor(at);
    }
    const double low = fmin(cut[0], cut[1]), high = fmax(cut[0], cut[1]);
    const double first = fmin(low, cut[2]), last = fmax(high, cut[2]);
    const double middle = fmax(low, fmin(high, cut[2]));
    share[0] = first;
    share[1] = middle - first;
    share[2] = last - middle;
    share[3] = 1 - last;
}

/* Linear in the tet; of a tet with corners that have no value, that of the others. */
static double value_at_spot(const tli_body *body, const double *values, size_t spot)
{
    double share[4], sum = 0, whole = 0;
    const tl_lidx *corners = tl_mesh_tets(body->mesh) + 4 * (size_t)body->spots[spot];
    place_in_tet(spot, share);
    for (int i = 0; i < 4; i++) {
        if (!isfinite(values[corners[i]])) continue;
        sum += share[i] * values[corners[i]];
        whole += share[i];
    }
    return sum / whole;
}

/* Gives values [count], which stand as their bits, in rising order to a scalar; bits are freed on
 * failure. */
static tl_status keep_spread(tl_ctx *ctx, tl_ctx *owner, uint64_t *bits, size_t count,
                             tli_scalar *scalar)
{
    tl_status st = tli_sort_u64(ctx, bits, NULL, count);
    if (st) {
        tl_mem_free(owner, bits);
        return st;
    }
    _Static_assert(sizeof(double) == sizeof *bits, "they take the place of their bits");
    double *spread = (double *)bits;
    for (size_t i = 0; i < count; i++) spread[i] = tli_sort_value(bits[i]);
    scalar->spread = spread;
    scalar->spread_count = count;
    return TL_OK;
}

tl_status tli_body_spread(tl_ctx *ctx, const tli_body *body, tli_scalar *scalar)
{
    tl_status st = TL_OK;
    size_t count = 0;
    if (scalar->spread) return TL_OK;
    uint64_t *bits = tl_mem_alloc(body->ctx, body->spot_count, sizeof *bits, &st);
    if (st) return st;
    for (size_t i = 0; i < body->spot_count; i++) {
        const double value = value_at_spot(body, scalar->values, i);
        if (isfinite(value)) bits[count++] = tli_sort_key(value);
    }
    return keep_spread(ctx, body->ctx, bits, count, scalar);
}

tl_status tli_spread_join(tl_ctx *ctx, tli_scalar *const *scalars, size_t scalar_count,
                          tli_scalar *joined)
{
    tl_status st = TL_OK;
    size_t count = 0, at = 0;
    for (size_t s = 0; s < scalar_count; s++) count += scalars[s]->spread_count;
    uint64_t *bits = tl_mem_alloc(ctx, count, sizeof *bits, &st);
    if (st) return st;
    for (size_t s = 0; s < scalar_count; s++)
        for (size_t i = 0; i < scalars[s]->spread_count; i++)
            bits[at++] = tli_sort_key(scalars[s]->spread[i]);
    return keep_spread(ctx, ctx, bits, count, joined);
}

/* ---- ranks, opacities ---- */

double tli_rank_value(const tli_scalar *scalar, double part)
{
    const double at = ceil(part * (double)scalar->spread_count) - 1;
    const size_t last = scalar->spread_count - 1;
    return scalar->spread[at <= 0 ? 0 : at >= (double)last ? last : (size_t)at];
}

size_t tli_spread_bins(const tli_scalar *scalar, const double range[2], double *bins,
                       size_t bin_count)
{
    size_t total = 0;
    for (size_t b = 0; b < bin_count; b++) bins[b] = 0;
    for (size_t i = 0; i < scalar->spread_count; i++) {
        const double value = scalar->spread[i];
        if (!(value >= range[0] && value <= range[1])) continue;
        const double at = range[0] < range[1]
                              ? (value - range[0]) / (range[1] - range[0]) * (double)bin_count
                              : 0;
        bins[at < (double)bin_count ? (size_t)at : bin_count - 1]++;
        total++;
    }
    for (size_t b = 0; total && b < bin_count; b++) bins[b] /= (double)total;
    return total;
}

/* Number of the values below one, or not above it. */
static size_t count_below(const tli_scalar *scalar, double value, bool or_equal)
{
    size_t low = 0, high = scalar->spread_count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        const double at = scalar->spread[middle];
        if (at < value || (or_equal && at == value))
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Parts of the volume and of the range that lie between a value and the most frequent ones. */
typedef struct distance {
    double part, value;
} distance;

/* The most frequent values: those of the narrow range that has most, wherever it begins, since
 * edges of bins would be a matter of chance. */
typedef struct mode {
    const tli_scalar *scalar;
    double low, high;
} mode;

static mode find_mode(const tli_scalar *scalar, size_t first, size_t end, double width)
{
    const double *v = scalar->spread;
    mode m = {scalar, v[first], v[first]};
    for (size_t i = first, j = first, most = 0; i < end; i++) {
        while (j < end && v[j] - v[i] <= width) j++;
        if (j - i <= most) continue;
        most = j - i;
        m.low = v[i];
        m.high = v[j - 1];
    }
    return m;
}

static distance from_mode(const mode *m, double value)
{
    const size_t count =
        value < m->low
            ? count_below(m->scalar, m->low, false) - count_below(m->scalar, value, false)
        : value > m->high
            ? count_below(m->scalar, value, true) - count_below(m->scalar, m->high, true)
            : 0;
    return (distance){(double)count, fmax(0, fmax(m->low - value, value - m->high))};
}

size_t tli_look_opacities(const tli_scalar *scalar, const double range[2], tl_opacity_point *points)
{
    const size_t first = count_below(scalar, range[0], false);
    const size_t end = count_below(scalar, range[1], true);
    if (!(range[0] < range[1]) || first >= end) { /* one value, or none: a fog */
        points[0] = (tl_opacity_point){range[0], LOOK_OPACITY / 10};
        return 1;
    }
    const double step = (range[1] - range[0]) / BINS;
    const mode m = find_mode(scalar, first, end, MODE_BINS * step);
    const distance low = from_mode(&m, range[0]), high = from_mode(&m, range[1]);
    const distance most = {fmax(fmax(low.part, high.part), 1), fmax(low.value, high.value)};
    for (size_t b = 0; b < BINS; b++) {
        /* by how much of the volume lies between and by the value: rare values that are far from
         * the common ones stand out of those that are merely rare */
        const double at = range[0] + ((double)b + 0.5) * step;
        const distance now = from_mode(&m, at);
        const double away = (now.part / most.part + now.value / most.value) / 2;
        points[b] = (tl_opacity_point){at, LOOK_OPACITY * away * away * away};
    }
    return BINS;
}
