/* From level to level: patches to segments, segments to patches, until the mesh is a patch or no
 * smaller than before. All segments of a level stop at the same cost, so that the error is spread
 * over the whole as if it were simplified at once; the cost that leaves the wanted number of tets
 * is found on a sample of the segments. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "model/model_turns.h"
#include "model/model_work.h"

/* Segments of the sample at the finest level, and at others. */
enum { SAMPLE_FINEST = 10, SAMPLE = 6 };
/* Segments for each thread below which it matters that all threads have work. */
enum { FEW = 4 };
/* A level that leaves more than this part of the tets is not worth having. */
static const double TOO_MUCH_LEFT = 0.95;
/* How far the first level's boundary may be off, in diagonals; the next ones twice as far each. */
static const double BOUNDARY_FIRST = 1e-3;
/* Part of a segment below which what a level is expected to make becomes one: from 1.5 on it is
 * two. */
static const double SURELY_ONE = 1.2;

/* ---- the cost of a level ---- */

/* One sixty-fourth of a segment's tets and the cost at which it is gone. */
typedef struct slice {
    double cost, tets;
} slice;

static int by_cost(const void *a, const void *b)
{
    double x = ((const slice *)a)->cost, y = ((const slice *)b)->cost;
    return (x > y) - (x < y);
}

typedef struct level_job {
    tli_level *level;
    const tli_segment_note *segments;
    size_t count;
    slice *slices; /* of the sample */
    size_t sample;
    tli_product *products; /* [count] */
} level_job;

static tl_status probe(void *arg, size_t begin, size_t end, unsigned worker)
{
    level_job *j = arg;
    tl_ctx *ctx = NULL;
    tl_status st = tli_ctx_fork(j->level->model->ctx, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        double costs[TLI_CURVE_POINTS];
        size_t tets;
        st = tli_segment_probe(ctx, j->level, &j->segments[i * j->count / j->sample], costs, &tets);
        for (size_t p = 0; !st && p < TLI_CURVE_POINTS; p++)
            j->slices[i * TLI_CURVE_POINTS + p] =
                (slice){costs[p], (double)tets / TLI_CURVE_POINTS};
    }
    return tli_ctx_join(j->level->model->ctx, ctx, st);
}

/* INFINITY where one segment is all: it stops at the number itself. */
static tl_status find_cost(level_job *j)
{
    tl_status st = TL_OK;
    j->level->cost_max = (double)INFINITY;
    if (j->count < 2) return TL_OK;
    size_t sample = j->level->level == 0 ? SAMPLE_FINEST : SAMPLE;
    j->sample = j->count < sample ? j->count : sample;
    size_t count = j->sample * TLI_CURVE_POINTS;
    j->slices = tl_mem_alloc(j->level->model->ctx, count, sizeof *j->slices, &st);
    if (!st)
        st = tli_turns(j->level->model->ctx, "probe", j->sample, j->level->model->plan->at_once,
                       probe, j);
    if (!st) {
        double all = 0, gone = 0;
        qsort(j->slices, count, sizeof *j->slices, by_cost);
        for (size_t i = 0; i < count; i++) all += j->slices[i].tets;
        size_t i = 0;
        while (i < count && gone < (1 - j->level->ratio) * all) gone += j->slices[i++].tets;
        double cost = j->slices[i ? i - 1 : 0].cost;
        j->level->cost_max = isfinite(cost) ? fmax(cost, (double)FLT_MIN) : (double)FLT_MAX;
    }
    tl_mem_free(j->level->model->ctx, j->slices);
    j->slices = NULL;
    return st;
}

/* ---- segments ---- */

static tl_status process(void *arg, size_t begin, size_t end, unsigned worker)
{
    level_job *j = arg;
    tl_ctx *ctx = NULL;
    tl_status st = tli_ctx_fork(j->level->model->ctx, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++)
        st = tli_segment_process(ctx, j->level, &j->segments[i], &j->products[i]);
    return tli_ctx_join(j->level->model->ctx, ctx, st);
}

/* A segment a thread; of few segments those that would leave threads idle come last, one by one
 * with all threads, which share the originals. */
static tl_status process_segments(level_job *j)
{
    char stage[24];
    const tli_plan *plan = j->level->model->plan;
    const size_t threads = tl_ctx_thread_count(plan->ctx);
    size_t rest = j->count < FEW * threads ? j->count % threads : 0;
    snprintf(stage, sizeof stage, "level %u", j->level->level + 1);
    tl_status st = tli_turns(plan->ctx, stage, j->count - rest, plan->at_once, process, j);
    for (size_t i = j->count - rest; !st && i < j->count; i++)
        st = tli_segment_process(plan->ctx, j->level, &j->segments[i], &j->products[i]);
    return st;
}

/* The segments of a level with their input patches, which stay in the order they have. */
static tl_status list_segments(tli_model *m, uint32_t level, size_t first, size_t end,
                               const uint32_t *group_of, size_t count, size_t *first_segment)
{
    tl_status st = tli_model_add_segments(m, count, first_segment);
    for (size_t p = first; !st && p < end; p++)
        m->segments[*first_segment + group_of[p - first]].input_count++;
    for (size_t s = 0; !st && s < count; s++) {
        tli_segment_note *note = &m->segments[*first_segment + s];
        note->level = level;
        note->inputs = tl_mem_alloc(m->ctx, note->input_count, sizeof *note->inputs, &st);
        note->input_count = 0;
    }
    for (size_t p = first; !st && p < end; p++) {
        tli_segment_note *note = &m->segments[*first_segment + group_of[p - first]];
        note->inputs[note->input_count++] = (uint32_t)p;
    }
    return st;
}

static void drop_segments(tli_model *m, size_t first)
{
    while (m->segment_count > first) {
        tli_segment_note *note = &m->segments[--m->segment_count];
        tl_mem_free(m->ctx, note->inputs);
        *note = (tli_segment_note){0};
    }
}

/* Takes over what a segment made. */
static tl_status note_product(tli_model *m, size_t segment, tli_product *p)
{
    size_t first;
    tl_status st = tli_model_add_patches(m, p->patch_count, &first);
    tli_segment_note *note = &m->segments[segment];
    note->outputs = tl_mem_alloc(m->ctx, p->patch_count, sizeof *note->outputs, &st);
    if (!st) st = tli_seams_add(m->ctx, &m->seams, p->seam, first);
    if (st) return st;
    note->output_count = (uint32_t)p->patch_count;
    note->input_tets = p->input_tets;
    note->output_tets = p->output_tets;
    memcpy(note->box, p->box, sizeof note->box);
    note->errors = p->errors;
    for (size_t i = 0; i < p->patch_count; i++) {
        tli_patch_note *patch = &m->patches[first + i];
        *patch = p->patches[i];
        patch->level = note->level + 1;
        patch->producer = (uint32_t)segment;
        patch->consumer = TL_NONE;
        note->outputs[i] = (uint32_t)(first + i);
        for (int k = 0; k < 3; k++) {
            note->box[2 * k] = fmin(note->box[2 * k], patch->box[2 * k]);
            note->box[2 * k + 1] = fmax(note->box[2 * k + 1], patch->box[2 * k + 1]);
        }
    }
    for (uint32_t i = 0; i < note->input_count; i++) {
        tli_patch_note *patch = &m->patches[note->inputs[i]];
        patch->consumer = (uint32_t)segment;
        for (int k = 0; k < 3; k++) {
            note->box[2 * k] = fmin(note->box[2 * k], patch->box[2 * k]);
            note->box[2 * k + 1] = fmax(note->box[2 * k + 1], patch->box[2 * k + 1]);
        }
    }
    p->errors = (tli_errors){0};
    p->patch_count = 0; /* what hangs on the patches went along */
    tli_product_release(m->ctx, p);
    return TL_OK;
}

/* The largest error of the boundary at the level before. */
static double surface_before(const tli_model *m, uint32_t level)
{
    double largest = m->finest_surface;
    for (size_t s = 0; s < m->segment_count; s++)
        if (m->segments[s].level + 1 == level)
            largest = fmax(largest, m->segments[s].errors.surface);
    return largest;
}

/* Will all that a level makes be one segment of the next one, surely? */
static bool one_follows(const tli_level *level, size_t first, size_t end)
{
    double tets = 0;
    for (size_t p = first; p < end; p++) tets += level->model->patches[p].tet_count;
    return level->ratio * tets < SURELY_ONE * level->model->plan->opts.segment_tets;
}

/* The segments of a level and what they make, with a bound on the boundary that grows where it
 * keeps the level from being worth having; *more tells whether it is. */
static tl_status process_all(level_job *j, bool *more)
{
    tl_status st = TL_OK;
    tli_level *level = j->level;
    tli_model *m = level->model;
    double most = m->plan->boundary_error;
    double bound = ldexp(BOUNDARY_FIRST * m->plan->diagonal, (int)level->level);
    for (*more = false; !st && !*more; bound *= 4) {
        uint64_t in = 0, out = 0;
        level->boundary_error = bound < most ? bound : most;
        tli_depot_clear(m->tapes);
        tli_depot_clear(m->carried[(level->level + 1) & 1]);
        tli_depot_clear(m->seam_files[(level->level + 1) & 1]);
        st = find_cost(j);
        if (!st) st = process_segments(j);
        for (size_t s = 0; !st && s < j->count; s++) {
            in += j->products[s].input_tets;
            out += j->products[s].output_tets;
        }
        *more = !st && (double)out <= TOO_MUCH_LEFT * (double)in;
        if (*more || bound >= most) break;
        for (size_t s = 0; s < j->count; s++) tli_product_release(m->ctx, &j->products[s]);
    }
    return st;
}

static void drop_samplings(tli_model *m, size_t first, size_t end)
{
    for (size_t p = first; p < end; p++) {
        tl_mem_free(m->ctx, m->patches[p].sampling);
        m->patches[p].sampling = NULL;
    }
}

/* One level; *more tells whether it is worth having. Its patches begin at first. */
static tl_status grow_level(tli_model *m, uint32_t level_number, size_t first, bool *more)
{
    tl_status st = TL_OK;
    size_t end = m->patch_count, groups = 0, first_segment = m->segment_count;
    tli_level level = {
        .model = m, .level = level_number, .ratio = tli_plan_ratio(m->plan, level_number)};
    level.surface_before = surface_before(m, level_number);
    level_job job = {.level = &level};
    uint32_t *group_of = tl_mem_alloc(m->ctx, end - first, sizeof *group_of, &st);
    if (!st) st = tli_group(m, level_number, first, end, group_of, &groups, &level.locked);
    tli_seams_release(m->ctx, &m->seams);
    if (!st) st = tli_cells_create(m, level_number, first, end, level.ratio, &level.cells);
    level.parts_meet = level.cells || one_follows(&level, first, end);
    drop_samplings(m, first, end);
    if (!st) st = list_segments(m, level_number, first, end, group_of, groups, &first_segment);
    job.segments = m->segments + first_segment;
    level.first_segment = first_segment;
    job.count = groups;
    job.products = tl_mem_zalloc(m->ctx, groups, sizeof *job.products, &st);
    *more = false;
    if (!st) st = process_all(&job, more);
    for (size_t s = 0; *more && !st && s < groups; s++)
        st = note_product(m, first_segment + s, &job.products[s]);
    if (!*more) drop_segments(m, first_segment);
    for (size_t s = 0; job.products && s < groups; s++)
        tli_product_release(m->ctx, &job.products[s]);
    tl_mem_free(m->ctx, job.products);
    tli_cells_destroy(level.cells);
    tli_locked_release(&level.locked);
    tl_mem_free(m->ctx, group_of);
    return st;
}

/* The last level's first patch. */
static size_t last_level(const tli_model *m)
{
    size_t first = m->patch_count;
    while (first && m->patches[first - 1].level + 1 == m->level_count) first--;
    return first;
}

tl_status tli_model_grow(tli_model *m, const tli_survey *survey, bool *ended)
{
    tl_status st = TL_OK;
    size_t first = last_level(m);
    bool more = true;
    *ended = tli_work_ends(m->work, TLI_STAGE_FINEST + m->level_count - 1);
    while (!st && more && !*ended) {
        size_t end = m->patch_count;
        uint64_t tets = 0;
        for (size_t p = first; p < end; p++) tets += m->patches[p].tet_count;
        if (end - first < 2 && tets <= m->plan->opts.patch_tets / 2) break;
        st = grow_level(m, m->level_count - 1, first, &more);
        if (!st && more) {
            uint32_t stage = TLI_STAGE_FINEST + m->level_count++;
            st = tli_work_save(m->work, stage, survey, m);
            *ended = tli_work_ends(m->work, stage);
        }
        first = end;
    }
    return st;
}
