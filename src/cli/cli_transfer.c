/* Transfer functions: from a file, from the name of a colour map, from the values alone.
 */
#include "cli_transfer.h"
#include "cli_colorspace.h"

#include <math.h>
#include <string.h>

enum { BINS = 256 };
/* Opacity of the rarest values of a first look. */
static const double LOOK_OPACITY = 0.6;

/* ---- from one control point to the next ---- */

/* Numbers of a control point: a value, then red, green, blue or opacity, middle, sharpness. */
enum { NUMBERS = 4, FILE_POINTS_MAX = 1024 };
/* What straight pieces may differ from the way by, and how often a way is halved. */
static const double BEND_MOST = 0.25 / 255;
enum { HALVINGS = 20, PROBES = 8 };

typedef struct way {
    const double *a, *b; /* [NUMBERS] */
    bool is_color, logarithmic;
    cli_color_space space;
} way;

/* Colour, or opacity and zeros, at a part of the way. */
static void way_at(const way *w, double t, double out[3])
{
    memset(out, 0, 3 * sizeof *out);
    if (w->is_color)
        cli_color_between(w->space, w->a + 1, w->b + 1, t, out);
    else
        out[0] = cli_opacity_between(w->a[1], w->b[1], w->a[2], w->a[3], t);
}

static bool are_near(const double a[3], const double b[3])
{
    for (int k = 0; k < 3; k++)
        if (fabs(a[k] - b[k]) > BEND_MOST) return false;
    return true;
}

/* At a part of the way; never below the point before, and not the same again. */
static void add_point(const way *w, double t, const double numbers[3], cli_points *points)
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

static bool is_straight(const way *w, double t0, const double *n0, double t1, const double *n1)
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
static void bend(const way *w, double t0, const double *n0, double t1, const double *n1,
                 int halvings, cli_points *points)
{
    const size_t count = w->is_color ? points->color_count : points->opacity_count;
    const double half = (t0 + t1) / 2;
    double middle[3];
    /* room is left for both sides of all that the file has */
    if (!halvings || count + 2 * FILE_POINTS_MAX + 4 > CLI_POINTS_MAX ||
        is_straight(w, t0, n0, t1, n1))
        return;
    way_at(w, half, middle);
    bend(w, t0, n0, half, middle, halvings - 1, points);
    add_point(w, half, middle, points);
    bend(w, half, middle, t1, n1, halvings - 1, points);
}

/* All ways between control points [count][NUMBERS]. A way may begin or end beside its control
 * point: a step. */
static void go(const double *numbers, size_t count, way w, cli_points *points)
{
    for (size_t i = 0; i < count; i++) {
        double own[3] = {0}, next[3] = {0}, from[3], to[3];
        w.a = numbers + NUMBERS * i;
        w.b = i + 1 < count ? w.a + NUMBERS : w.a;
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

/* ---- ParaView's JSON ---- */

static int wrong(const char *path, const char *what)
{
    fprintf(stderr, "tetralod: '%s': %s\n", path, what);
    return CLI_FAILED;
}

/* Number i of a list; NaN if it is none. */
static double number_of(const json_t *list, size_t i)
{
    const json_t *number = json_array_get(list, i);
    return json_is_number(number) ? json_number_value(number) : (double)NAN;
}

/* Control points under a key, by values that do not fall, the other numbers from 0 to 1; false for
 * a list of anything else. */
static bool take_groups(const json_t *list, double *numbers, size_t *count)
{
    const size_t length = json_array_size(list);
    *count = length / NUMBERS;
    if (list && (!json_is_array(list) || length % NUMBERS || *count > FILE_POINTS_MAX))
        return false;
    for (size_t i = 0; i < length; i++) {
        const double x = numbers[i] = number_of(list, i);
        if (!isfinite(x) || (i % NUMBERS && !(x >= 0 && x <= 1))) return false;
        if (i % NUMBERS == 0 && i && x < numbers[i - NUMBERS]) return false;
    }
    return true;
}

/* Whether a key says yes: true, or a number but 0. */
static bool is_on(const json_t *map, const char *key)
{
    const json_t *word = json_object_get(map, key);
    return json_is_true(word) || (json_is_number(word) && json_number_value(word) != 0);
}

static int take(const char *path, const json_t *root, bool logarithmic, double *numbers,
                cli_points *points)
{
    const json_t *map = json_is_array(root) ? json_array_get(root, 0) : root;
    way color = {.is_color = true}, opacity = {.is_color = false};
    size_t count;
    if (!json_is_object(map))
        return wrong(path, "expected a list of colour maps, as ParaView writes it");
    const json_t *space = json_object_get(map, "ColorSpace");
    if (space &&
        (!json_is_string(space) || !cli_color_space_named(json_string_value(space), &color.space)))
        return wrong(path, "ColorSpace: expected RGB, HSV, Lab, Lab/CIEDE2000, Diverging or Step");
    if (color.space == CLI_SPACE_HSV && is_on(map, "HSVWrap")) color.space = CLI_SPACE_HSV_WRAP;
    if (!take_groups(json_object_get(map, "RGBPoints"), numbers, &count) || !count)
        return wrong(path, "RGBPoints: expected numbers in groups of value, red, green, blue, by "
                           "value, colours from 0 to 1");
    points->logarithmic = is_on(map, "UseLogScale") && numbers[0] > 0;
    color.logarithmic = opacity.logarithmic = logarithmic || points->logarithmic;
    go(numbers, count, color, points);
    if (!take_groups(json_object_get(map, "Points"), numbers, &count))
        return wrong(path, "Points: expected numbers in groups of value, opacity, middle, "
                           "sharpness, by value, the others from 0 to 1");
    go(numbers, count, opacity, points);
    return CLI_DONE;
}

int cli_points_read(tl_ctx *ctx, const char *path, bool logarithmic, cli_points *points)
{
    json_t *root;
    tl_status st = TL_OK;
    int failed = cli_json_read(ctx, path, true, &root);
    if (failed) return failed;
    double *numbers = tl_mem_alloc(ctx, FILE_POINTS_MAX, NUMBERS * sizeof *numbers, &st);
    failed = st ? wrong(path, tl_ctx_message(ctx)) : take(path, root, logarithmic, numbers, points);
    tl_mem_free(ctx, numbers);
    json_decref(root);
    return failed;
}

/* ---- without a file ---- */

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
