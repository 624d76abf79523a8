/* Paints: how a channel is coloured. What is automatic in its transfer node follows from all of the
 * data, its extremes and the values of a coarse mesh of one size: it stays as it is while the cut
 * moves, and whatever part of the mesh is chosen. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "view/view.h"

/* Opacities hold for a layer as thick as this part of the diagonal. */
static const double UNIT_DISTANCE = 0.02;
/* Part of the volume whose values are left out at either end of "most" where they are far away: the
 * others are in less than this part of the range. */
static const double TAIL = 0.002, MOST_WIDE = 0.8;
/* Part of a range that lies on either side of the middle of a diverging map, at least: less is
 * rounding, or values that have another meaning than their sign. */
static const double SIDE_LEAST = 0.05;
/* Channels of larger or smaller numbers are scaled before anything is computed with them. */
enum { EXPONENT_MOST = 200, EXPONENT_LEAST = -1000 };

typedef enum range_by { BY_MOST, BY_DATA, BY_PERCENT, BY_VALUES } range_by;
typedef enum symmetry { SYMMETRIC_AUTO, SYMMETRIC_ON, SYMMETRIC_OFF } symmetry;

/* A transfer node, or what holds for a channel without one. */
typedef struct wishes {
    const char *node; /* its name */
    const char *map;
    bool reversed, logarithmic;
    range_by by;
    symmetry symmetric;
    double range[2], parts[2], center, unit_distance;
    tl_value colors, opacities; /* rows */
    tl_value nan;               /* colour */
} wishes;

static wishes wishes_of(tl_ctx *ctx, const tl_scene *scene, const char *channel)
{
    tl_value value;
    const tl_node node = tl_scene_transfer_of(scene, channel);
    wishes w = {.node = channel, .map = "viridis", .by = BY_MOST};
    if (!node) return w;
    w.node = tl_scene_name(scene, node);
    w.map = tl_scene_text(scene, node, "map");
    w.reversed = tl_scene_flag(scene, node, "reversed");
    w.logarithmic = tl_scene_flag(scene, node, "logarithmic");
    w.by = (range_by)tl_scene_real(scene, node, "range_by");
    w.symmetric = (symmetry)tl_scene_real(scene, node, "symmetric");
    w.center = tl_scene_real(scene, node, "center");
    w.unit_distance = tl_scene_real(scene, node, "unit_distance");
    if (!tl_scene_get(ctx, scene, node, "range", &value) && value.count == 2)
        memcpy(w.range, value.reals, sizeof w.range);
    if (!tl_scene_get(ctx, scene, node, "percent", &value) && value.count == 2)
        for (int k = 0; k < 2; k++) w.parts[k] = value.reals[k] / 100;
    if (tl_scene_get(ctx, scene, node, "colors", &w.colors)) w.colors = (tl_value){0};
    if (tl_scene_get(ctx, scene, node, "opacities", &w.opacities)) w.opacities = (tl_value){0};
    if (tl_scene_get(ctx, scene, node, "nan_color", &w.nan)) w.nan = (tl_value){0};
    return w;
}

double tli_paint_shown(const tli_paint *paint, double value)
{
    return tli_shown(paint->values.logarithmic, paint->factor, value);
}

double tli_paint_value(const tli_paint *paint, double shown)
{
    return paint->values.logarithmic ? pow(10, shown) : shown / paint->factor;
}

/* ---- range ---- */

double tli_factor(bool logarithmic, const double range[2])
{
    int exponent = 0;
    const double largest = fmax(fabs(range[0]), fabs(range[1]));
    if (logarithmic) return 1;
    if (largest > 0) frexp(largest, &exponent);
    return exponent < EXPONENT_LEAST       ? ldexp(1, -EXPONENT_LEAST)
           : abs(exponent) > EXPONENT_MOST ? ldexp(1, -exponent)
                                           : 1;
}

/* The range of the node's own values. */
static tl_status check_range(tl_ctx *ctx, const wishes *w)
{
    if (!isfinite(w->range[1] - w->range[0]))
        return tl_fail(ctx, TL_ERR_ARG, "%s.range: from %g to %g is too wide", w->node, w->range[0],
                       w->range[1]);
    if (!(w->range[0] <= w->range[1]) || (w->logarithmic && !(w->range[0] > 0)))
        return tl_fail(ctx, TL_ERR_ARG, "%s.range: from %g to %g, expected %s", w->node,
                       w->range[0], w->range[1],
                       w->logarithmic && !(w->range[0] > 0) ? "a scale that begins above 0"
                                                            : "the lower one first");
    return TL_OK;
}

/* What is shown at the ends of "most" and "percent". */
static void find_ranks(const wishes *w, const tli_scalar *scalar, double shown[2])
{
    const double low = shown[0], high = shown[1];
    const bool by_percent = w->by == BY_PERCENT;
    double ends[2] = {low, high};
    for (int i = 0; scalar->spread_count && i < 2; i++) {
        const double part = by_percent ? w->parts[i] : i ? 1 - TAIL : TAIL;
        /* values of a coarse mesh may pass those of the original; spots miss the very extremes */
        if (part > 0 && part < 1) ends[i] = fmin(fmax(tli_rank_value(scalar, part), low), high);
        if (part >= 1) ends[i] = high;
        if (part <= 0) ends[i] = low;
    }
    if (by_percent || (ends[0] < ends[1] && ends[1] - ends[0] < MOST_WIDE * (high - low)))
        memcpy(shown, ends, sizeof ends);
}

/* The same length on both sides of the middle. */
static void balance(const wishes *w, double center, double shown[2])
{
    const double sides[2] = {center - shown[0], shown[1] - center};
    const double least = SIDE_LEAST * (shown[1] - shown[0]), half = fmax(sides[0], sides[1]);
    const bool is_signed = tl_colormap_is_diverging(w->map) &&
                           (w->by == BY_MOST || w->by == BY_DATA) && sides[0] > 0 && sides[1] > 0 &&
                           fmin(sides[0], sides[1]) >= least;
    if (w->logarithmic || w->symmetric == SYMMETRIC_OFF ||
        (w->symmetric == SYMMETRIC_AUTO && !is_signed))
        return;
    shown[0] = center - half;
    shown[1] = center + half;
}

static tl_status set_range(tl_ctx *ctx, const wishes *w, const tli_scalar *scalar, tli_paint *paint)
{
    tl_values *v = &paint->values;
    const double all[2] = {v->least, v->most};
    double shown[2] = {tli_paint_shown(paint, v->least), tli_paint_shown(paint, v->most)};
    if (w->by == BY_VALUES) {
        memcpy(v->range, w->range, sizeof v->range);
        return check_range(ctx, w);
    }
    if (w->by == BY_PERCENT && !(w->parts[0] <= w->parts[1]))
        return tl_fail(ctx, TL_ERR_ARG, "%s.percent: from %g to %g, expected the lower one first",
                       w->node, 100 * w->parts[0], 100 * w->parts[1]);
    if (w->by != BY_DATA) find_ranks(w, scalar, shown);
    balance(w, paint->factor * w->center, shown);
    for (int i = 0; i < 2; i++) { /* an extreme to the bit, and none that is too large */
        const bool is_extreme = shown[i] == tli_paint_shown(paint, all[i]);
        const double value = is_extreme ? all[i] : tli_paint_value(paint, shown[i]);
        v->range[i] = fmin(fmax(value, -DBL_MAX), DBL_MAX);
    }
    return TL_OK;
}

/* ---- colours ---- */

/* What is drawn for a value; below 0 on a logarithmic scale: for the least value there is. */
static double shown_point(const tli_paint *paint, double value)
{
    return tli_paint_shown(paint,
                           paint->values.logarithmic && !(value > 0) ? paint->values.least : value);
}

/* The points of a map over the range, its middle if that is one value, or of the node's own
 * colours, over whose range they go. */
static tl_status set_colors(tl_ctx *ctx, const wishes *w, tli_paint *paint)
{
    tl_status st = TL_OK;
    tl_values *v = &paint->values;
    size_t map_count;
    const tl_color_point *map = tl_colormap(w->map, &map_count);
    const size_t own = w->colors.count / 4, count = own ? own : map_count;
    TL_ASSERT(map);
    paint->colors = tl_mem_alloc(ctx, count, sizeof *paint->colors, &st);
    if (st) return st;
    v->color_count = count;
    if (own) {
        v->range[0] = w->colors.reals[0];
        v->range[1] = w->colors.reals[4 * (own - 1)];
        if (v->logarithmic && !(v->range[0] > 0)) v->range[0] = v->least;
    }
    const double shown[2] = {tli_paint_shown(paint, v->range[0]),
                             tli_paint_shown(paint, v->range[1])};
    for (size_t i = 0; i < count; i++) {
        tl_color_point *p = &paint->colors[i];
        if (own) {
            p->value = shown_point(paint, w->colors.reals[4 * i]);
            memcpy(p->rgb, w->colors.reals + 4 * i + 1, sizeof p->rgb);
        } else {
            *p = map[w->reversed ? count - 1 - i : i];
            const double at = w->reversed ? 1 - p->value : p->value;
            p->value = shown[0] + at * (shown[1] - shown[0]);
            if (shown[0] == shown[1]) memcpy(p->rgb, map[count / 2].rgb, sizeof p->rgb);
        }
    }
    memcpy(v->shown_range, shown, sizeof shown);
    return TL_OK;
}

static tl_status set_opacities(tl_ctx *ctx, const wishes *w, const tli_scalar *scalar,
                               tli_paint *paint)
{
    tl_status st = TL_OK;
    const size_t own = w->opacities.count / 2;
    paint->opacities =
        tl_mem_alloc(ctx, own ? own : TLI_LOOK_POINTS, sizeof *paint->opacities, &st);
    if (st) return st;
    for (size_t i = 0; i < own; i++)
        paint->opacities[i] = (tl_opacity_point){shown_point(paint, w->opacities.reals[2 * i]),
                                                 w->opacities.reals[2 * i + 1]};
    paint->values.opacity_count =
        own ? own : tli_look_opacities(scalar, paint->values.shown_range, paint->opacities);
    return TL_OK;
}

/* The points again, by their values. */
static tl_status set_values(tl_ctx *ctx, tli_paint *paint)
{
    tl_status st = TL_OK;
    tl_values *v = &paint->values;
    paint->value_colors = tl_mem_alloc(ctx, v->color_count, sizeof *paint->value_colors, &st);
    paint->value_opacities =
        tl_mem_alloc(ctx, v->opacity_count, sizeof *paint->value_opacities, &st);
    for (size_t i = 0; !st && i < v->color_count; i++) {
        paint->value_colors[i] = paint->colors[i];
        paint->value_colors[i].value = tli_paint_value(paint, paint->colors[i].value);
    }
    for (size_t i = 0; !st && i < v->opacity_count; i++) {
        paint->value_opacities[i] = paint->opacities[i];
        paint->value_opacities[i].value = tli_paint_value(paint, paint->opacities[i].value);
    }
    v->colors = paint->value_colors;
    v->opacities = paint->value_opacities;
    return st;
}

/* ---- all of it ---- */

static tl_status set_names(tl_ctx *ctx, const char *name, const tl_channel *channel,
                           tli_paint *paint)
{
    tl_status st = TL_OK;
    const char *bar = channel->components > 1 ? "|" : "";
    const bool has_unit = *channel->unit != '\0';
    const size_t room = strlen(name) + strlen(channel->unit) + 8;
    paint->channel = tli_strdup(ctx, name, &st);
    paint->title = tl_mem_alloc(ctx, room, 1, &st);
    if (!st)
        snprintf(paint->title, room, "%s%s%s%s%s%s", bar, name, bar, has_unit ? " [" : "",
                 channel->unit, has_unit ? "]" : "");
    paint->values.channel = paint->channel;
    paint->values.title = paint->title;
    return st;
}

/* What a paint is made for. */
typedef struct subject {
    tl_source *source;
    const tl_scene *scene;
    int64_t step;
    tli_body *whole; /* look */
    const char *name;
} subject;

/* All that follows from values. */
static tl_status set_scale(tl_ctx *ctx, const wishes *w, const char *name, tli_survey *survey,
                           tli_paint *paint)
{
    const tli_scalar *scalar;
    double extremes[2];
    tl_values *v = &paint->values;
    v->logarithmic = w->logarithmic;
    tl_status st = tli_survey_extremes(ctx, survey, name, v->logarithmic, extremes);
    if (st) return st;
    v->least = extremes[0];
    v->most = extremes[1];
    paint->factor = tli_factor(v->logarithmic, extremes);
    st = tli_survey_spread(ctx, survey, name, v->logarithmic, paint->factor, &scalar);
    if (!st && v->logarithmic && !scalar->spread_count)
        tl_log(ctx, TL_LOG_WARNING, "no value of '%s' is above 0: a logarithmic scale shows none",
               name);
    if (!st) st = set_range(ctx, w, scalar, paint);
    if (!st) st = set_colors(ctx, w, paint);
    if (!st) st = set_opacities(ctx, w, scalar, paint);
    return st ? st : set_values(ctx, paint);
}

static tl_status fill(tl_ctx *ctx, const wishes *w, const subject *of, tli_paint *paint)
{
    tli_survey survey;
    const tl_channel *channel;
    tl_values *v = &paint->values;
    tl_status st = tli_body_channel(ctx, of->whole, of->name, &channel);
    if (!st) st = set_names(ctx, of->name, channel, paint);
    if (!st)
        st = tli_survey_begin(ctx, of->source, of->scene, of->step, of->whole, of->name, &survey);
    if (st) return st;
    st = set_scale(ctx, w, of->name, &survey, paint);
    tli_survey_end(&survey);
    const double diagonal = fmax(of->source->facts.diagonal, 1e-300);
    const double unit = w->unit_distance > 0 ? w->unit_distance : UNIT_DISTANCE * diagonal;
    if (!st)
        st = tl_transfer_create(ctx, paint->colors, v->color_count, paint->opacities,
                                v->opacity_count, unit, &paint->transfer);
    if (!st && w->nan.count == 3) {
        tl_transfer *grey = paint->transfer;
        st = tl_transfer_with_nan(ctx, grey, w->nan.reals, &paint->transfer);
        tl_transfer_destroy(ctx, grey);
    }
    v->transfer = paint->transfer;
    return st;
}

tli_recipe tli_paint_recipe(const tli_body *whole, const tl_scene *scene, const char *channel)
{
    const tl_node node = tl_scene_transfer_of(scene, channel);
    return tli_recipe_count(tli_recipe_text(whole->recipe, channel),
                            node ? tl_scene_node_version(scene, node) : 0);
}

tl_status tli_paint_create(tl_ctx *ctx, tl_source *source, const tl_scene *scene, int64_t step,
                           tli_body *whole, const char *channel, tli_paint **paint)
{
    tl_status st = TL_OK;
    const wishes w = wishes_of(ctx, scene, channel);
    const subject of = {source, scene, step, whole, channel};
    tli_paint *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    *paint = NULL;
    if (st) return st;
    made->ctx = ctx;
    made->recipe = tli_paint_recipe(whole, scene, channel);
    atomic_init(&made->uses, 1);
    st = fill(ctx, &w, &of, made);
    if (st)
        tli_paint_release(made);
    else
        *paint = made;
    return st;
}

tli_paint *tli_paint_use(tli_paint *paint)
{
    atomic_fetch_add(&paint->uses, 1);
    return paint;
}

void tli_paint_release(tli_paint *paint)
{
    if (!paint || atomic_fetch_sub(&paint->uses, 1) > 1) return;
    tl_ctx *ctx = paint->ctx;
    tl_transfer_destroy(ctx, paint->transfer);
    tl_mem_free(ctx, paint->value_opacities);
    tl_mem_free(ctx, paint->value_colors);
    tl_mem_free(ctx, paint->opacities);
    tl_mem_free(ctx, paint->colors);
    tl_mem_free(ctx, paint->title);
    tl_mem_free(ctx, paint->channel);
    tl_mem_free(ctx, paint);
}
