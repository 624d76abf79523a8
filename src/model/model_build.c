/* The driver of a build. */
#include <math.h>

#include "model/model.h"

/* Errors do not fall from a segment to the consumers of what it made. Segments are in the order of
 * their levels. */
void tli_model_saturate(tli_model *m)
{
    size_t bins = m->plan->field_count * TLI_BINS;
    for (size_t s = 0; s < m->segment_count; s++) {
        tli_segment_note *to = &m->segments[s];
        for (uint32_t i = 0; i < to->input_count; i++) {
            uint32_t producer = m->patches[to->inputs[i]].producer;
            if (producer == TL_NONE) continue;
            const tli_errors *from = &m->segments[producer].errors;
            to->errors.surface = fmax(to->errors.surface, from->surface);
            for (size_t f = 0; f < m->plan->field_count; f++)
                to->errors.max[f] = fmax(to->errors.max[f], from->max[f]);
            for (size_t b = 0; b < bins; b++) {
                to->errors.field[b] = fmaxf(to->errors.field[b], from->field[b]);
                to->errors.space[b] = fmaxf(to->errors.space[b], from->space[b]);
            }
        }
    }
}

static tl_status set_levels(const tli_model *m, tl_build_result *r)
{
    tl_status st = TL_OK;
    r->levels = tl_mem_zalloc(m->ctx, m->level_count, sizeof *r->levels, &st);
    if (st) return st;
    r->level_count = m->level_count;
    for (size_t p = 0; p < m->patch_count; p++) {
        tl_build_level *level = &r->levels[m->patches[p].level];
        level->patches++;
        level->tets += m->patches[p].tet_count;
        level->vertices += m->patches[p].vert_count;
        r->tets_stored += m->patches[p].tet_count;
    }
    for (size_t s = 0; s < m->segment_count; s++) {
        r->levels[m->segments[s].level].segments++;
        tl_build_level *above = &r->levels[m->segments[s].level + 1];
        above->boundary_error = fmax(above->boundary_error, m->segments[s].errors.surface);
    }
    r->patches = m->patch_count;
    r->segments = m->segment_count;
    return TL_OK;
}

tl_status tl_model_build_mesh(tl_ctx *ctx, const tl_mesh *mesh, const char *path,
                              const tl_build_opts *opts, tl_build_result *result)
{
    tli_plan plan;
    tli_model *model = NULL;
    tli_shared shared = {0};
    size_t *channels = NULL;
    tl_build_result r = {0};
    double start = tli_clock_s();
    *result = r;
    tl_status st = tli_plan_create(ctx, mesh, opts, &plan, &channels);
    if (st) return st;
    st = tli_model_create(ctx, &plan, &model);
    if (!st) st = tli_model_begin(model, &plan, mesh, channels, &shared);
    if (!st) st = tli_model_grow(model, &shared);
    if (!st) tli_model_saturate(model);
    if (!st) st = set_levels(model, &r);
    tli_input input = {.time = tl_mesh_time(mesh),
                       .tets = tl_mesh_tet_count(mesh),
                       .verts = tl_mesh_vert_count(mesh)};
    if (!st) st = tl_mesh_measure(ctx, mesh, &input.stats);
    if (!st) st = tli_model_write(model, path, &input, &r.bytes);
    r.tets_in = input.tets;
    r.seconds = tli_clock_s() - start;
    r.peak_bytes = tl_ctx_peak_bytes(ctx);
    tli_shared_release(ctx, &shared);
    tli_model_destroy(model);
    tl_mem_free(ctx, channels);
    tli_plan_release(&plan);
    if (st)
        tl_build_release(ctx, &r);
    else
        *result = r;
    return st;
}

tl_status tl_model_build(tl_ctx *ctx, const char *input, const tl_read_opts *read, const char *path,
                         const tl_build_opts *opts, tl_build_result *result)
{
    tl_mesh *mesh = NULL;
    double start = tli_clock_s();
    *result = (tl_build_result){0};
    tl_status st = tl_mesh_read(ctx, input, read, &mesh, NULL);
    if (!st) st = tl_model_build_mesh(ctx, mesh, path, opts, result);
    tl_mesh_destroy(mesh);
    if (st) return tl_note(ctx, st, "while building '%s' from '%s'", path, input);
    result->seconds = tli_clock_s() - start;
    return TL_OK;
}

void tl_build_release(tl_ctx *ctx, tl_build_result *result)
{
    if (!result) return;
    tl_mem_free(ctx, result->levels);
    *result = (tl_build_result){0};
}
