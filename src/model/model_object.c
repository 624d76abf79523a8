/* The lists of a model under construction. */
#include <string.h>

#include <math.h>

#include "model/model_work.h"

/* ---- bundles ---- */

/* Arrays by falling alignment, so that one block holds them without gaps. */
tl_status tli_bundle_create(tl_ctx *ctx, const tli_plan *plan, uint32_t vert_count,
                            uint32_t tet_count, bool with_quadrics, tli_bundle *bundle)
{
    size_t n = vert_count, m = tet_count;
    size_t sizes[] = {n * sizeof(uint64_t),
                      n * 3 * sizeof(double),
                      n * plan->vert_comps * sizeof(double),
                      m * plan->tet_comps * sizeof(double),
                      with_quadrics ? n * plan->quadric_floats * sizeof(float) : 0,
                      m * 4 * sizeof(tl_lidx),
                      plan->has_regions ? m * sizeof(int32_t) : 0,
                      n * sizeof(float),
                      n * sizeof(int16_t),
                      n,
                      n,
                      m};
    enum { COUNT = sizeof sizes / sizeof *sizes };
    size_t bytes = 0;
    tl_status st = TL_OK;
    uint8_t *at[COUNT];
    for (size_t i = 0; i < COUNT; i++) bytes += sizes[i];
    *bundle = (tli_bundle){.vert_count = vert_count, .tet_count = tet_count, .bytes = bytes};
    uint8_t *block = bundle->block = tl_mem_alloc(ctx, bytes, 1, &st);
    if (st) return st;
    for (size_t i = 0; i < COUNT; block += sizes[i++]) at[i] = block;
    bundle->ids = (void *)at[0];
    bundle->xyz = (void *)at[1];
    bundle->values = (void *)at[2];
    bundle->tet_values = (void *)at[3];
    bundle->quadrics = with_quadrics ? (void *)at[4] : NULL;
    bundle->tets = (void *)at[5];
    bundle->regions = plan->has_regions ? (void *)at[6] : NULL;
    bundle->surface = (void *)at[7];
    bundle->steps = (void *)at[8];
    bundle->shared = at[9];
    bundle->twins = at[10];
    bundle->outer = at[11];
    return TL_OK;
}

void tli_bundle_release(tl_ctx *ctx, tli_bundle *bundle)
{
    tl_mem_free(ctx, bundle->block);
    *bundle = (tli_bundle){0};
}

/* ---- lists ---- */

tl_status tli_extents_add(tl_ctx *ctx, tli_extents *e, uint64_t ofs, uint64_t count)
{
    tl_status st = TL_OK;
    if (e->count == e->capacity) {
        size_t capacity = e->capacity ? 2 * e->capacity : 4;
        e->items = tl_mem_resize(ctx, e->items, capacity, sizeof *e->items, &st);
        if (st) return st;
        e->capacity = capacity;
    }
    e->items[e->count++] = (tli_extent){ofs, count};
    return TL_OK;
}

tl_status tli_errors_create(tl_ctx *ctx, const tli_plan *plan, tli_errors *e)
{
    tl_status st = TL_OK;
    size_t n = plan->field_count;
    *e = (tli_errors){0};
    e->max = tl_mem_zalloc(ctx, n, sizeof *e->max, &st);
    e->field = tl_mem_zalloc(ctx, n * TLI_BINS, sizeof *e->field, &st);
    e->space = tl_mem_zalloc(ctx, n * TLI_BINS, sizeof *e->space, &st);
    return st;
}

void tli_errors_release(tl_ctx *ctx, tli_errors *e)
{
    tl_mem_free(ctx, e->space);
    tl_mem_free(ctx, e->field);
    tl_mem_free(ctx, e->max);
    *e = (tli_errors){0};
}

void tli_errors_join(const tli_plan *plan, const tli_errors *from, tli_errors *to)
{
    to->surface = fmax(to->surface, from->surface);
    for (size_t f = 0; f < plan->field_count; f++) to->max[f] = fmax(to->max[f], from->max[f]);
    for (size_t b = 0; b < plan->field_count * TLI_BINS; b++) {
        to->field[b] = fmaxf(to->field[b], from->field[b]);
        to->space[b] = fmaxf(to->space[b], from->space[b]);
    }
}

/* ---- the model ---- */

tl_status tli_model_create(tl_ctx *ctx, const tli_plan *plan, tli_work *work, tli_model **model)
{
    tl_status st = TL_OK;
    tli_model *m = tl_mem_zalloc(ctx, 1, sizeof *m, &st);
    *model = NULL;
    if (st) return st;
    m->ctx = ctx;
    m->plan = plan;
    m->work = work;
    st = tli_depot_create(ctx, plan->opts.folder, &m->tapes);
    if (!st) st = tli_work_depot(work, plan, "meshes.work", &m->meshes);
    for (int i = 0; !st && i < 2; i++) {
        st = tli_work_depot(work, plan, i ? "carried1.work" : "carried0.work", &m->carried[i]);
        if (!st)
            st = tli_work_depot(work, plan, i ? "seams1.work" : "seams0.work", &m->seam_files[i]);
    }
    if (st)
        tli_model_destroy(m);
    else
        *model = m;
    return st;
}

void tli_patch_note_release(tl_ctx *ctx, tli_patch_note *p)
{
    for (int k = 0; k < TLI_KINDS; k++) tl_mem_free(ctx, p->extents[k].items);
    tl_mem_free(ctx, p->sampling);
    tl_mem_free(ctx, p->squares);
    tl_mem_free(ctx, p->ranges);
}

void tli_segment_note_release(tl_ctx *ctx, tli_segment_note *s)
{
    tl_mem_free(ctx, s->inputs);
    tl_mem_free(ctx, s->outputs);
    tli_errors_release(ctx, &s->errors);
}

void tli_model_destroy(tli_model *m)
{
    if (!m) return;
    for (size_t i = 0; i < m->patch_count; i++) tli_patch_note_release(m->ctx, &m->patches[i]);
    for (size_t i = 0; i < m->segment_count; i++) tli_segment_note_release(m->ctx, &m->segments[i]);
    tl_mem_free(m->ctx, m->patches);
    tl_mem_free(m->ctx, m->segments);
    tli_depot_destroy(m->meshes);
    tli_depot_destroy(m->tapes);
    for (int i = 0; i < 2; i++) {
        tli_depot_destroy(m->carried[i]);
        tli_depot_destroy(m->seam_files[i]);
    }
    tli_seams_release(m->ctx, &m->seams);
    tl_mem_free(m->ctx, m);
}

tl_status tli_model_add_patches(tli_model *m, size_t count, size_t *first)
{
    tl_status st = TL_OK;
    *first = m->patch_count;
    if (m->patch_count + count > m->patch_capacity) {
        size_t capacity = m->patch_count + count + m->patch_capacity / 2;
        m->patches = tl_mem_resize(m->ctx, m->patches, capacity, sizeof *m->patches, &st);
        if (st) return st;
        m->patch_capacity = capacity;
    }
    for (size_t i = 0; i < count; i++)
        m->patches[m->patch_count + i] = (tli_patch_note){.producer = TL_NONE, .consumer = TL_NONE};
    m->patch_count += count;
    return TL_OK;
}

tl_status tli_model_add_segments(tli_model *m, size_t count, size_t *first)
{
    tl_status st = TL_OK;
    *first = m->segment_count;
    if (m->segment_count + count > m->segment_capacity) {
        size_t capacity = m->segment_count + count + m->segment_capacity / 2;
        m->segments = tl_mem_resize(m->ctx, m->segments, capacity, sizeof *m->segments, &st);
        if (st) return st;
        m->segment_capacity = capacity;
    }
    for (size_t i = 0; i < count; i++) m->segments[m->segment_count + i] = (tli_segment_note){0};
    m->segment_count += count;
    return TL_OK;
}

void tli_product_release(tl_ctx *ctx, tli_product *p)
{
    for (size_t i = 0; i < p->patch_count; i++) tli_patch_note_release(ctx, &p->patches[i]);
    tl_mem_free(ctx, p->patches);
    tli_shared_release(ctx, &p->shared);
    tli_errors_release(ctx, &p->errors);
    *p = (tli_product){0};
}
