/* One pass over the segments of the input: ranges of its channels, its volume, what its places are
 * like. */
#include <math.h>

#include "base/base_predicates.h"
#include "model/model.h"
#include "model/model_turns.h"

typedef struct survey_job {
    tl_ctx *ctx;
    const tl_segments *segments;
    tli_survey *parts; /* [segments] */
} survey_job;

static tl_status survey_create(tl_ctx *ctx, const tl_segments *segments, tli_survey *s)
{
    tl_status st = TL_OK;
    size_t n = tl_segments_channel_count(segments);
    *s = (tli_survey){.channel_count = n, .is_finite = true, .is_float32 = true};
    s->channels = tl_mem_alloc(ctx, n, sizeof *s->channels, &st);
    for (size_t i = 0; !st && i < n; i++)
        s->channels[i] = (tli_channel_survey){
            {(double)INFINITY, (double)-INFINITY}, {(double)INFINITY, (double)-INFINITY}, 0};
    for (int k = 0; k < 3; k++) {
        s->bounds[2 * k] = (double)INFINITY;
        s->bounds[2 * k + 1] = (double)-INFINITY;
    }
    return st;
}

void tli_survey_release(tl_ctx *ctx, tli_survey *s)
{
    tl_mem_free(ctx, s->channels);
    s->channels = NULL;
}

/* Elements that are copies of another segment's are left out. */
static void survey_channel(const tl_segment_channel *c, const tl_segment *s, size_t stride,
                           tli_channel_survey *to)
{
    bool on_vertex = c->on == TL_ON_VERTEX;
    size_t count = on_vertex ? s->vert_count : s->tet_count;
    const double *row = (on_vertex ? s->values : s->tet_values) + c->first;
    for (size_t e = 0; e < count; e++, row += stride) {
        double sum = 0;
        uint64_t nonfinite = 0;
        if (on_vertex && (s->links[e] & TL_LINK_COPY)) continue;
        for (uint32_t k = 0; k < c->components; k++) {
            sum += row[k] * row[k]; /* may overflow: such values are refused */
            nonfinite += !isfinite(row[k]);
        }
        to->nonfinite += nonfinite;
        if (nonfinite) continue;
        double norm = c->components == 1 ? row[0] : sqrt(sum);
        to->range[0] = fmin(to->range[0], norm);
        to->range[1] = fmax(to->range[1], norm);
        for (uint32_t k = 0; k < c->components; k++) {
            to->extent[0] = fmin(to->extent[0], row[k]);
            to->extent[1] = fmax(to->extent[1], row[k]);
        }
    }
}

static void survey_places(const tl_segment *s, tli_survey *to)
{
    for (size_t v = 0; v < s->vert_count; v++)
        for (size_t k = 0; k < 3; k++) {
            double x = s->xyz[3 * v + k];
            to->is_finite = to->is_finite && isfinite(x);
            to->is_float32 = to->is_float32 && (!isfinite(x) || x == (double)(float)x);
            if (!isfinite(x)) continue;
            to->bounds[2 * k] = fmin(to->bounds[2 * k], x);
            to->bounds[2 * k + 1] = fmax(to->bounds[2 * k + 1], x);
        }
    for (size_t t = 0; t < s->tet_count; t++) {
        double p[4][3], sum = 0;
        for (size_t i = 0; i < 4; i++)
            for (size_t k = 0; k < 3; k++)
                sum += p[i][k] = s->xyz[3 * (size_t)s->tets[4 * t + i] + k];
        if (!isfinite(sum)) continue;
        int sign = tli_orient3d(p[0], p[1], p[2], p[3]);
        to->volume += tl_tet_volume(TLI_CORNERS(p));
        to->inverted += sign < 0;
        to->degenerate += sign == 0;
    }
}

static tl_status survey_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    survey_job *j = arg;
    tl_ctx *ctx = NULL;
    tl_status st = tli_ctx_fork(j->ctx, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_segment s;
        st = tl_segments_load(ctx, j->segments, (uint32_t)i, &s);
        if (st) break;
        st = survey_create(ctx, j->segments, &j->parts[i]);
        if (!st) survey_places(&s, &j->parts[i]);
        for (size_t c = 0; !st && c < tl_segments_channel_count(j->segments); c++) {
            const tl_segment_channel *channel = tl_segments_channel(j->segments, c);
            survey_channel(channel, &s, tl_segments_components(j->segments, channel->on),
                           &j->parts[i].channels[c]);
        }
        tl_segment_release(ctx, &s);
    }
    return tli_ctx_join(j->ctx, ctx, st);
}

static void add_survey(tli_survey *to, const tli_survey *from, size_t channels)
{
    to->is_finite = to->is_finite && from->is_finite;
    to->is_float32 = to->is_float32 && from->is_float32;
    to->volume += from->volume;
    to->inverted += from->inverted;
    to->degenerate += from->degenerate;
    for (int k = 0; k < 3; k++) {
        to->bounds[2 * k] = fmin(to->bounds[2 * k], from->bounds[2 * k]);
        to->bounds[2 * k + 1] = fmax(to->bounds[2 * k + 1], from->bounds[2 * k + 1]);
    }
    for (size_t c = 0; c < channels; c++) {
        tli_channel_survey *a = &to->channels[c];
        const tli_channel_survey *b = &from->channels[c];
        a->range[0] = fmin(a->range[0], b->range[0]);
        a->range[1] = fmax(a->range[1], b->range[1]);
        a->extent[0] = fmin(a->extent[0], b->extent[0]);
        a->extent[1] = fmax(a->extent[1], b->extent[1]);
        a->nonfinite += b->nonfinite;
    }
}

tl_status tli_survey_make(tl_ctx *ctx, const tl_segments *segments, tli_survey *survey)
{
    tl_status st = TL_OK;
    size_t count = tl_segments_count(segments), channels = tl_segments_channel_count(segments);
    survey_job job = {ctx, segments, tl_mem_zalloc(ctx, count, sizeof *job.parts, &st)};
    *survey = (tli_survey){0};
    if (!st) st = tli_turns(ctx, "survey", count, tl_ctx_thread_count(ctx), survey_range, &job);
    if (!st) st = survey_create(ctx, segments, survey);
    for (size_t i = 0; !st && i < count; i++) add_survey(survey, &job.parts[i], channels);
    for (size_t i = 0; job.parts && i < count; i++) tli_survey_release(ctx, &job.parts[i]);
    tl_mem_free(ctx, job.parts);
    for (size_t c = 0; !st && c < channels; c++) {
        tli_channel_survey *s = &survey->channels[c];
        if (s->range[0] <= s->range[1]) continue;
        s->range[0] = s->range[1] = s->extent[0] = s->extent[1] = 0; /* no finite value */
    }
    for (int k = 0; !st && k < 3; k++)
        if (survey->bounds[2 * k] > survey->bounds[2 * k + 1])
            survey->bounds[2 * k] = survey->bounds[2 * k + 1] = 0;
    return st;
}
