/* What a model will be made like: its channels, their lattices, the scale of costs. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "model/model.h"

/* Sizes that did best by measurement: docs/notes/2026-11-22-model.md */
enum { SEGMENT_TETS = 65536, PATCH_TETS = 4096 };
/* Part of the memory for a bin of what is sorted in files; where no memory is given; at least. */
enum { BIN_PART = 16, BIN_BYTES = 16 << 20, BIN_BYTES_MIN = 1 << 20 };
/* Part of the tets that a level leaves, by measurement, too: below a half the finest level loses
 * more than simplifying at once would, since what is locked can't go. */
static const double RATIO_FINEST = 0.5, RATIO = 0.4;
/* Components that can steer a simplification. */
enum { COMPONENTS_MAX = 256 };
/* Channels that the coder has tables for. */
enum { CHANNELS_MAX = 1024 };
/* Vectors whose lengths differ by less than this part of the widest range of a component count as
 * equally long. */
static const double EQUAL_LENGTHS = 1e-3;
/* In the unit of a channel: the square of a tensor's norm is still a number. */
static const double VALUE_MAX = 1e150;
/* In the unit of the mesh: between them signs are exact and volumes are numbers. */
static const double PLACE_MAX = 1e100, WIDTH_MIN = 1e-80;

tl_build_opts tl_build_opts_defaults(void)
{
    return (tl_build_opts){.struct_bytes = sizeof(tl_build_opts),
                           .channel_error = 1e-4,
                           .position_error = 1e-5,
                           .boundary_error = 0.05,
                           .partition = TL_PARTITION_VORONOI};
}

tl_status tli_build_opts_check(tl_ctx *ctx, const tl_build_opts *o)
{
    if (!(o->channel_error >= 0) || !isfinite(o->channel_error))
        return tl_fail(ctx, TL_ERR_ARG, "channel error %g, expected 0 or more", o->channel_error);
    if (!(o->position_error > 0) || !(o->position_error < 1))
        return tl_fail(ctx, TL_ERR_ARG, "position error %g, expected more than 0 and below 1",
                       o->position_error);
    if (!(o->boundary_error >= 0) || !isfinite(o->boundary_error))
        return tl_fail(ctx, TL_ERR_ARG, "boundary error %g, expected 0 or more", o->boundary_error);
    if (o->prune && o->lossless)
        return tl_fail(ctx, TL_ERR_ARG, "lossless models keep all tets, so that none is pruned");
    if (o->partition > TL_PARTITION_VORONOI)
        return tl_fail(ctx, TL_ERR_ARG, "partition %d, expected 0 to %d", (int)o->partition,
                       TL_PARTITION_VORONOI);
    if (o->reduction != 0 && !(o->reduction >= 0.25 && o->reduction <= 0.75))
        return tl_fail(ctx, TL_ERR_ARG, "reduction %g, expected 0 or 0.25 to 0.75", o->reduction);
    return TL_OK;
}

/* What errors of a channel are fractions of: its range or, where vectors are all but equally long,
 * that of their components. */
static double width_of(const tli_channel_survey *c)
{
    double width = c->range[1] - c->range[0], extent = c->extent[1] - c->extent[0];
    return width > EQUAL_LENGTHS * extent ? width : extent;
}

/* The bound of the codec; 0: lossless. */
static double codec_bound(const tl_build_opts *o, const tli_field *f)
{
    if (o->lossless) return 0;
    for (size_t i = 0; i < o->error_count; i++) {
        const tl_build_channel *c = &o->errors[i];
        if (strcmp(c->name, f->name) != 0) continue;
        if (c->lossless) return 0;
        return c->relative ? c->error * f->width : c->error;
    }
    return o->channel_error * f->width;
}

/* Half of the bound is left for what moving the vertices to their lattice adds; a channel that is
 * stored as it is gets half of what others get. */
static void set_code(const tl_build_opts *o, tli_field *f)
{
    double step = f->bound / sqrt(f->components);
    f->moved = (f->bound > 0 ? f->bound : o->channel_error * f->width) / 2;
    f->code = (tl_value_code){TL_VALUE_LATTICE, step};
    double largest = fmax(fabs(f->range[0]), fabs(f->range[1]));
    bool fits = step > 0 && largest / step < 0x1p52;
    if (fits) return;
    f->code.kind = f->scalar < TL_F32    ? TL_VALUE_INTEGER
                   : f->scalar == TL_F32 ? TL_VALUE_FLOAT32
                                         : TL_VALUE_FLOAT64;
    f->code.step = 1;
}

/* What several steps are called in one mesh. */
static const char *make_key(tl_ctx *ctx, const tl_segment_channel *c, tl_status *st)
{
    char number[16];
    if (!c->has_step) return tli_strdup(ctx, c->name, st);
    int digits = snprintf(number, sizeof number, "@%u", c->step);
    size_t length = strlen(c->name);
    char *key = tl_mem_alloc(ctx, length + (size_t)digits + 1, 1, st);
    if (*st) return NULL;
    memcpy(key, c->name, length);
    memcpy(key + length, number, (size_t)digits + 1);
    return key;
}

static bool is_steering(const tl_build_opts *o, const tl_segment_channel *c)
{
    if (c->on != TL_ON_VERTEX) return false;
    if (!c->has_step || !o->steer) return true;
    for (size_t i = 0; i < o->steer_count; i++)
        if (o->steer[i] == c->step) return true;
    return false;
}

static tl_status set_field(tli_plan *p, const tl_segment_channel *c,
                           const tli_channel_survey *found, tli_field *f)
{
    size_t *comps = c->on == TL_ON_VERTEX ? &p->vert_comps : &p->tet_comps;
    tl_status st = TL_OK;
    *f = (tli_field){.components = c->components,
                     .on = c->on,
                     .scalar = c->scalar,
                     .has_step = c->has_step,
                     .step = c->step,
                     .time = c->time,
                     .steers = is_steering(&p->opts, c),
                     .first = *comps,
                     .source_first = c->first,
                     .nonfinite_count = found->nonfinite};
    f->name = tli_strdup(p->ctx, c->name, &st);
    f->unit = tli_strdup(p->ctx, c->unit ? c->unit : "", &st);
    f->key = make_key(p->ctx, c, &st);
    if (st) return st;
    *comps += c->components;
    p->vert_fields += c->on == TL_ON_VERTEX;
    memcpy(f->range, found->range, sizeof f->range);
    f->width = width_of(found);
    f->bound = codec_bound(&p->opts, f);
    set_code(&p->opts, f);
    f->scale = f->width > 0 && isfinite(1 / f->width) ? 1 / f->width : 0;
    return TL_OK;
}

/* Differences of places and of values are squared and multiplied. */
static tl_status check_values(tl_ctx *ctx, const char *name, const tli_channel_survey *found)
{
    double largest = fmax(fabs(found->extent[0]), fabs(found->extent[1]));
    if (largest <= VALUE_MAX) return TL_OK;
    return tl_fail(ctx, TL_ERR_DATA, "channel '%s' has values of up to %g, expected at most %g",
                   name, largest, VALUE_MAX);
}

static tl_status check_places(tl_ctx *ctx, const tli_survey *survey)
{
    double largest = 0, widest = 0;
    for (int i = 0; i < 6; i++) largest = fmax(largest, fabs(survey->bounds[i]));
    for (int k = 0; k < 3; k++)
        widest = fmax(widest, survey->bounds[2 * k + 1] - survey->bounds[2 * k]);
    if (!survey->is_finite)
        return tl_fail(ctx, TL_ERR_DATA, "tets have vertices whose places are no finite numbers");
    if (largest > PLACE_MAX)
        return tl_fail(ctx, TL_ERR_DATA, "coordinates of up to %g, expected at most %g", largest,
                       PLACE_MAX);
    if (widest > 0 && widest < WIDTH_MIN)
        return tl_fail(ctx, TL_ERR_DATA, "the mesh is %g wide, expected at least %g", widest,
                       WIDTH_MIN);
    return TL_OK;
}

static bool is_wanted(const tl_build_opts *o, const char *name)
{
    for (size_t i = 0; i < o->channel_count; i++)
        if (strcmp(o->channels[i], name) == 0) return true;
    return !o->channels;
}

static tl_status check_names(const tli_plan *p, const tl_segments *segments)
{
    for (size_t i = 0; i < p->opts.channel_count + p->opts.error_count; i++) {
        const char *name = i < p->opts.channel_count
                               ? p->opts.channels[i]
                               : p->opts.errors[i - p->opts.channel_count].name;
        size_t c = 0, count = tl_segments_channel_count(segments);
        while (c < count && strcmp(tl_segments_channel(segments, c)->name, name) != 0) c++;
        if (c == count)
            return tl_fail(p->ctx, TL_ERR_DATA, "the data set has no channel '%s'", name);
    }
    return TL_OK;
}

/* What was found of a channel; the steps of a series have one range, so that a part of it is the
 * same at all times. */
static tli_channel_survey survey_of(const tl_segments *segments, const tli_survey *survey, size_t i)
{
    const tl_segment_channel *c = tl_segments_channel(segments, i);
    tli_channel_survey found = survey->channels[i];
    for (size_t j = 0; c->has_step && j < tl_segments_channel_count(segments); j++) {
        const tl_segment_channel *other = tl_segments_channel(segments, j);
        const tli_channel_survey *s = &survey->channels[j];
        if (other->on != c->on || other->components != c->components ||
            strcmp(other->name, c->name) != 0)
            continue;
        found.range[0] = fmin(found.range[0], s->range[0]);
        found.range[1] = fmax(found.range[1], s->range[1]);
        found.extent[0] = fmin(found.extent[0], s->extent[0]);
        found.extent[1] = fmax(found.extent[1], s->extent[1]);
    }
    return found;
}

static tl_status check_counts(const tli_plan *p, size_t components)
{
    if (p->field_count > CHANNELS_MAX)
        return tl_fail(p->ctx, TL_ERR_UNSUPPORTED, "%zu channels of all steps, at most %d fit",
                       p->field_count, CHANNELS_MAX);
    if (components > COMPONENTS_MAX)
        return tl_fail(p->ctx, TL_ERR_UNSUPPORTED,
                       "the channels on vertices that steer have %zu components together, at most "
                       "%d can; take fewer channels, or let fewer steps steer",
                       components, COMPONENTS_MAX);
    return TL_OK;
}

static tl_status check_steer(const tli_plan *p)
{
    for (size_t i = 0; i < p->opts.steer_count; i++) {
        size_t f = 0;
        while (f < p->field_count &&
               !(p->fields[f].has_step && p->fields[f].step == p->opts.steer[i]))
            f++;
        if (f == p->field_count)
            return tl_fail(p->ctx, TL_ERR_ARG, "step %u is to steer and is not built",
                           p->opts.steer[i]);
    }
    return TL_OK;
}

static tl_status set_fields(tli_plan *p, const tl_segments *segments, const tli_survey *survey,
                            size_t *steering_comps)
{
    size_t count = tl_segments_channel_count(segments), components = 0;
    tl_status st = check_names(p, segments);
    p->fields = tl_mem_zalloc(p->ctx, count, sizeof *p->fields, &st);
    p->steering = tl_mem_zalloc(p->ctx, count, sizeof *p->steering, &st);
    p->steering_scales = tl_mem_zalloc(p->ctx, count, sizeof *p->steering_scales, &st);
    for (size_t i = 0; !st && i < count; i++) {
        const tl_segment_channel *c = tl_segments_channel(segments, i);
        if (!is_wanted(&p->opts, c->name)) continue;
        const tli_channel_survey found = survey_of(segments, survey, i);
        st = check_values(p->ctx, c->name, &found);
        if (st) break;
        tli_field *f = &p->fields[p->field_count++];
        st = set_field(p, c, &found, f);
        if (st || !f->steers) continue;
        p->steering[p->steering_count] = (tl_simplify_channel){f->key, 1, 0};
        p->steering_scales[p->steering_count++] = f->scale;
        components += f->components;
    }
    if (!st) st = check_counts(p, components);
    if (!st) st = check_steer(p);
    *steering_comps = components;
    return st;
}

static void set_sizes(tl_build_opts *opts)
{
    if (!opts->segment_tets) opts->segment_tets = SEGMENT_TETS;
    if (!opts->patch_tets) opts->patch_tets = PATCH_TETS;
}

tli_need tli_plan_need(const tl_build_opts *opts, const tl_segments *segments)
{
    tl_build_opts sized = *opts;
    set_sizes(&sized);
    return (tli_need){.tets = tl_segments_tet_count(segments),
                      .vert_comps = tl_segments_components(segments, TL_ON_VERTEX),
                      .tet_comps = tl_segments_components(segments, TL_ON_TET),
                      .fields = tl_segments_channel_count(segments),
                      .segment_tets = sized.segment_tets,
                      .patch_tets = sized.patch_tets};
}

tli_need tli_plan_need_of_feed(const tl_build_opts *opts, const tli_feed *feed)
{
    tl_build_opts sized = *opts;
    size_t count, components[2] = {0, 0};
    const tl_channel *channels = tli_feed_channels(feed, &count);
    set_sizes(&sized);
    for (size_t i = 0; i < count; i++) components[channels[i].on] += channels[i].components;
    return (tli_need){.tets = tli_feed_tet_estimate(feed),
                      .vert_comps = components[TL_ON_VERTEX],
                      .tet_comps = components[TL_ON_TET],
                      .fields = count,
                      .segment_tets = sized.segment_tets,
                      .patch_tets = sized.patch_tets};
}

tl_status tli_plan_create(tl_ctx *ctx, const tl_segments *segments, const tli_survey *survey,
                          const tl_build_opts *opts, tli_plan *p)
{
    double square = 0;
    size_t steering_comps = 0;
    *p = (tli_plan){.ctx = ctx, .opts = *opts};
    tl_status st = check_places(ctx, survey);
    if (!st) st = set_fields(p, segments, survey, &steering_comps);
    if (st) {
        tli_plan_release(p);
        return st;
    }
    set_sizes(&p->opts);
    p->source_vert_comps = tl_segments_components(segments, TL_ON_VERTEX);
    p->source_tet_comps = tl_segments_components(segments, TL_ON_TET);
    p->quadric_floats = tli_piece_quadric_floats(steering_comps);
    p->has_regions = tl_segments_has_regions(segments);
    p->float32_places = survey->is_float32;
    memcpy(p->bounds, survey->bounds, sizeof p->bounds);
    for (int k = 0; k < 3; k++) {
        double side = p->bounds[2 * k + 1] - p->bounds[2 * k];
        square += side * side;
    }
    p->diagonal = sqrt(square);
    p->boundary_error = p->opts.boundary_error * p->diagonal;
    tli_need need = tli_plan_need(&p->opts, segments);
    p->at_once = tli_need_at_once(&need, opts->memory_bytes, tl_ctx_thread_count(ctx));
    p->bin_bytes = opts->memory_bytes ? opts->memory_bytes / BIN_PART : BIN_BYTES;
    if (p->bin_bytes < BIN_BYTES_MIN) p->bin_bytes = BIN_BYTES_MIN;
    return TL_OK;
}

void tli_plan_release(tli_plan *p)
{
    for (size_t i = 0; p->fields && i < p->field_count; i++) {
        tl_mem_free(p->ctx, (char *)(uintptr_t)p->fields[i].key);
        tl_mem_free(p->ctx, (char *)(uintptr_t)p->fields[i].name);
        tl_mem_free(p->ctx, (char *)(uintptr_t)p->fields[i].unit);
    }
    tl_mem_free(p->ctx, p->steering_scales);
    tl_mem_free(p->ctx, p->steering);
    tl_mem_free(p->ctx, p->fields);
    p->fields = NULL;
}

double tli_plan_ratio(const tli_plan *p, uint32_t level)
{
    return p->opts.reduction > 0 ? p->opts.reduction : level ? RATIO : RATIO_FINEST;
}

double tli_field_round(const tli_field *f, double value)
{
    return tl_value_of(&f->code, tl_value_image(&f->code, value));
}
