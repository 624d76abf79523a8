/* Adds channels to a model: topology and all that is there stay as they are. */
#include <math.h>

#include "model/model_add.h"
#include "model/model_work.h"

/* ---- the model of the file ---- */

static tl_status note_patches(tli_adder *a)
{
    size_t first;
    tl_status st = tli_model_add_patches(a->model, a->head->patch_count, &first);
    a->finest = tl_mem_alloc(a->ctx, a->head->levels[0].patch_count, sizeof *a->finest, &st);
    for (uint32_t p = 0; !st && p < a->head->patch_count; p++) {
        tl_patch_info info;
        tli_patch_note *note = &a->model->patches[p];
        st = tl_store_patch(a->ctx, a->store, p, &info);
        if (st) break;
        note->level = info.level;
        note->producer = tli_adder_segment(a, info.producer);
        note->consumer = tli_adder_segment(a, info.consumer);
        note->vert_count = info.vert_count;
        note->tet_count = info.tet_count;
        if (info.producer != TL_NONE) continue;
        if (info.level > 0 || a->finest_count == a->head->levels[0].patch_count)
            return tl_fail(a->ctx, TL_ERR_UNSUPPORTED,
                           "patch %u of level %u was made of none: no channel can be added to such "
                           "a model",
                           p, info.level);
        a->finest[a->finest_count++] = p;
    }
    return st;
}

static tl_status note_segments(tli_adder *a)
{
    size_t first;
    tl_status st = tli_model_add_segments(a->model, a->head->segment_count, &first);
    a->radii = tl_mem_zalloc(a->ctx, a->head->segment_count, sizeof *a->radii, &st);
    for (uint32_t s = 0; !st && s < a->head->segment_count; s++) {
        tl_segment_info info;
        tli_segment_note *note = &a->model->segments[tli_adder_segment(a, s)];
        st = tl_store_segment(a->ctx, a->store, s, &info);
        if (st) break;
        note->level = info.level;
        note->inputs = tl_mem_alloc(a->ctx, info.patch_count, sizeof *note->inputs, &st);
        note->outputs = tl_mem_alloc(a->ctx, info.output_count, sizeof *note->outputs, &st);
        if (!st) st = tli_errors_create(a->ctx, a->plan, &note->errors);
        if (st) break;
        for (uint32_t i = 0; i < info.patch_count; i++) note->inputs[i] = info.first_patch + i;
        memcpy(note->outputs, info.outputs, info.output_count * sizeof *note->outputs);
        note->input_count = info.patch_count;
        note->output_count = info.output_count;
    }
    return st;
}

/* ---- is it the same data set? are the channels new? ---- */

static tl_status compare_counts(const tli_adder *a, const char *path)
{
    const uint64_t tets = tl_segments_tet_count(a->segments);
    const uint64_t verts = tl_segments_vert_count(a->segments);
    if (tets == a->head->input_tets && verts == a->head->input_verts) return TL_OK;
    return tl_fail(a->ctx, TL_ERR_DATA,
                   "the data set has %llu tets and %llu vertices, '%s' was made of %llu and %llu: "
                   "another mesh",
                   (unsigned long long)tets, (unsigned long long)verts, path,
                   (unsigned long long)a->head->input_tets,
                   (unsigned long long)a->head->input_verts);
}

/* A field that is there without a step, or at that step, is not added once more. */
static tl_status compare_names(const tli_adder *a, const char *path)
{
    if (!a->plan->field_count) return tl_fail(a->ctx, TL_ERR_DATA, "there is no channel to add");
    for (size_t f = 0; f < a->plan->field_count; f++)
        for (uint32_t c = 0; c < a->head->channel_count; c++) {
            const tli_field *field = &a->plan->fields[f];
            const tl_store_channel *channel = &a->head->channels[c];
            if (channel->on != field->on || strcmp(channel->name, field->name) != 0) continue;
            if (channel->has_step && field->has_step && channel->step != field->step) continue;
            if (channel->has_step)
                return tl_fail(a->ctx, TL_ERR_DATA, "'%s' has a channel '%s' at step %u already",
                               path, field->name, channel->step);
            return tl_fail(a->ctx, TL_ERR_DATA, "'%s' has a channel '%s' already", path,
                           field->name);
        }
    return TL_OK;
}

/* ---- the driver ---- */

static tl_status add(tli_adder *a, const char *path, tl_build_result *r)
{
    tli_work work = {.ctx = a->ctx};
    tl_status st = compare_counts(a, path);
    if (!st) st = compare_names(a, path);
    if (!st) st = tli_model_create(a->ctx, a->plan, &work, &a->model);
    if (!st) st = note_patches(a);
    if (!st) st = note_segments(a);
    if (!st) st = tli_adder_match(a);
    if (!st) st = tli_adder_match_cells(a);
    if (!st) st = tli_adder_begin(a);
    tli_bins_close(&a->cells);
    tli_bins_close(&a->matches);
    if (!st) st = tli_adder_grow(a);
    if (!st) tli_model_saturate(a->model);
    if (!st) st = tli_adder_write(a, path, &r->bytes);
    r->tets_in = a->head->input_tets;
    r->segments = a->head->segment_count;
    r->patches = a->head->patch_count;
    tli_model_destroy(a->model);
    void *blocks[] = {a->radii, a->leaf_errors, a->finest};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(a->ctx, blocks[i]);
    return st;
}

static tl_status add_segments(tl_ctx *ctx, const tl_segments *segments, const char *path,
                              const tl_build_opts *opts, tl_build_result *r)
{
    tl_store *store = NULL;
    tli_survey survey = {0};
    tli_plan plan = {0};
    tl_status st = tl_store_open(ctx, path, &store);
    if (!st) st = tli_survey_make(ctx, segments, &survey);
    if (!st) st = tli_plan_create(ctx, segments, &survey, opts, &plan);
    if (!st) {
        tli_adder a = {.ctx = ctx,
                       .store = store,
                       .head = tl_store_get_head(store),
                       .segments = segments,
                       .plan = &plan};
        plan.lattice = a.head->lattice;
        plan.position_error = a.head->position_error;
        st = add(&a, path, r);
        tli_plan_release(&plan);
    }
    tli_survey_release(ctx, &survey);
    tl_store_close(store);
    return st;
}

tl_status tl_model_add_channels(tl_ctx *ctx, const char *path, const tl_step *steps,
                                size_t step_count, const char *input, const tl_read_opts *read,
                                const tl_build_opts *given, tl_build_result *result)
{
    tl_build_opts opts = tl_build_opts_defaults();
    tl_segment_opts segment;
    tl_segments *segments = NULL;
    tl_build_result r = {0};
    double start = tli_clock_s();
    *result = r;
    tl_ctx_reset_peak(ctx);
    tl_status st = tli_build_opts_take(ctx, given, &opts, &segment);
    if (!st && !input && !step_count)
        st = tl_fail(ctx, TL_ERR_ARG, "neither a file nor steps to take channels from");
    if (!st)
        st = step_count ? tl_segments_build_series(ctx, steps, step_count, read, &segment, NULL,
                                                   &segments, NULL)
                        : tl_segments_build(ctx, input, read, &segment, NULL, &segments, NULL);
    if (!st) st = add_segments(ctx, segments, path, &opts, &r);
    tl_segments_destroy(segments);
    r.seconds = tli_clock_s() - start;
    r.peak_bytes = tl_ctx_peak_bytes(ctx);
    if (st) return tl_note(ctx, st, "while adding channels to '%s'; it is as it was", path);
    *result = r;
    return TL_OK;
}
