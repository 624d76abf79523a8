/* Surveys: the meshes that colours of a channel are chosen by. One that changes with time has the
 * same colours at all steps, so that a series that plays shows what changes: by coarser meshes of
 * some steps, and the extremes of all that the file says. */
#include <math.h>

#include "view/view.h"

/* Whether a channel, or an expression that may name one, is not the same at all steps. */
static bool varies(const tl_source *source, const char *name)
{
    const tl_store_head *head = source->store ? tl_store_get_head(source->store) : NULL;
    if (!head || source->facts.step_count < 2) return false;
    for (uint32_t c = 0; c < head->channel_count; c++)
        if (!head->channels[c].has_step && strcmp(head->channels[c].name, name) == 0) return false;
    return true;
}

/* Adds the mesh of a step, unless the channel is not there then. */
static tl_status add_step(tl_ctx *ctx, tl_source *source, const tl_scene *scene, int64_t step,
                          const char *name, tli_survey *survey)
{
    tli_body *look = NULL, *whole = NULL;
    const tl_channel *channel;
    tl_status st = tli_source_glance(ctx, source, step, &look);
    if (st) return st;
    st = tli_derive_channels(ctx, scene, look, &whole);
    if (!st) st = tli_body_channel(ctx, whole, name, &channel);
    tli_body_release(look);
    if (!st)
        survey->bodies[survey->count++] = whole;
    else
        tli_body_release(whole);
    return st == TL_ERR_ARG ? TL_OK : st;
}

tl_status tli_survey_begin(tl_ctx *ctx, tl_source *source, const tl_scene *scene, int64_t step,
                           tli_body *whole, const char *name, tli_survey *survey)
{
    tl_status st = TL_OK;
    const size_t steps = source->facts.step_count;
    const size_t count = steps < TLI_SURVEY_STEPS ? steps : TLI_SURVEY_STEPS;
    *survey = (tli_survey){.ctx = ctx, .source = source, .step = step};
    survey->is_series = varies(source, name);
    for (size_t i = 0; !st && survey->is_series && i < count; i++) {
        const size_t at = i * (steps - 1) / (count - 1);
        st = add_step(ctx, source, scene, source->facts.steps[at].number, name, survey);
    }
    if (!st && !survey->count) { /* also of a channel that none of these steps has */
        survey->is_series = false;
        survey->bodies[survey->count++] = tli_body_use(whole);
    }
    if (st) tli_survey_end(survey);
    return st;
}

void tli_survey_end(tli_survey *survey)
{
    for (size_t i = 0; i < survey->count; i++) tli_body_release(survey->bodies[i]);
    tl_mem_free(survey->ctx, survey->joined.spread);
    *survey = (tli_survey){0};
}

/* ---- extremes ---- */

static void widen(double range[2], const double other[2])
{
    range[0] = fmin(range[0], other[0]);
    range[1] = fmax(range[1], other[1]);
}

/* As the file says; false: it does not, or not above 0. */
static bool stored_extremes(const tli_survey *s, const tl_channel *channel, bool logarithmic,
                            double range[2])
{
    const tl_store *store = s->source->store;
    const tl_store_head *head = store ? tl_store_get_head(store) : NULL;
    for (uint32_t c = 0; head && c < head->channel_count; c++) {
        const tl_store_channel *own = &head->channels[c];
        if (own->on == channel->on && strcmp(own->name, channel->name) == 0 &&
            (s->is_series || tli_in_step(own, s->step)))
            widen(range, own->range);
    }
    return range[0] <= range[1] && (!logarithmic || range[0] > 0);
}

tl_status tli_survey_extremes(tl_ctx *ctx, const tli_survey *survey, const char *name,
                              bool logarithmic, double range[2])
{
    tl_status st = TL_OK;
    const tl_channel *channel;
    const double none[2] = {(double)INFINITY, -(double)INFINITY};
    memcpy(range, none, sizeof none);
    st = tli_body_channel(ctx, survey->bodies[0], name, &channel);
    if (st || stored_extremes(survey, channel, logarithmic, range)) return st;
    memcpy(range, none, sizeof none);
    for (size_t i = 0; !st && i < survey->count; i++) {
        double own[2];
        st = tli_body_channel(ctx, survey->bodies[i], name, &channel);
        if (!st && tli_extremes(survey->bodies[i]->mesh, channel, logarithmic, own))
            widen(range, own);
    }
    if (!(range[0] <= range[1])) range[0] = range[1] = logarithmic ? 1 : 0;
    return st;
}

/* ---- values at spots ---- */

tl_status tli_survey_spread(tl_ctx *ctx, tli_survey *survey, const char *name, bool logarithmic,
                            double factor, const tli_scalar **scalar)
{
    tl_status st = TL_OK;
    tli_scalar *scalars[TLI_SURVEY_STEPS];
    for (size_t i = 0; !st && i < survey->count; i++) {
        st = tli_body_scalar(ctx, survey->bodies[i], name, logarithmic, factor, &scalars[i]);
        if (!st) st = tli_body_spread(ctx, survey->bodies[i], scalars[i]);
    }
    *scalar = scalars[0];
    if (st || !survey->is_series) return st;
    *scalar = &survey->joined;
    return tli_spread_join(survey->ctx, scalars, survey->count, &survey->joined);
}
