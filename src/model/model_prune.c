/* Patches whose refinement brings nothing (Ponchio & Hormann 2008, 8): where what a segment made of
 * leaves is as near to the original as leaves have to be, its outputs become leaves in their place,
 * level upon level. */
#include <math.h>

#include "model/model.h"

/* What rounding adds to distances that do not change, relative. */
static const double ROUNDING = 1e-4;

/* Errors are saturated: those of whatever lies below are no larger. */
static bool is_idle(const tli_model *m, const tli_segment_note *s)
{
    const tli_plan *plan = m->plan;
    for (uint32_t i = 0; i < s->input_count; i++)
        if (m->patches[s->inputs[i]].producer != TL_NONE) return false;
    for (size_t f = 0; f < plan->field_count; f++)
        if (!(s->errors.max[f] <= plan->fields[f].bound)) return false;
    return s->errors.surface <= plan->position_error * (1 + ROUNDING);
}

/* Takes an idle segment out of the graph; its inputs are of no segment then, and go. */
static void take_out(tli_model *m, tli_plan *plan, size_t segment, uint32_t *segment_number,
                     uint32_t *patch_number)
{
    tli_segment_note *s = &m->segments[segment];
    for (uint32_t i = 0; i < s->output_count; i++) m->patches[s->outputs[i]].producer = TL_NONE;
    for (uint32_t i = 0; i < s->input_count; i++) patch_number[s->inputs[i]] = TL_NONE;
    for (size_t f = 0; f < plan->field_count; f++)
        plan->fields[f].leaf_error = fmax(plan->fields[f].leaf_error, s->errors.max[f]);
    m->leaf_surface = fmax(m->leaf_surface, s->errors.surface);
    segment_number[segment] = TL_NONE;
}

/* Closes the gaps; numbers [count] receive the new places of what stays. */
static void move_up(tli_model *m, uint32_t *segment_number, uint32_t *patch_number)
{
    size_t n = 0;
    for (size_t p = 0; p < m->patch_count; p++) {
        if (patch_number[p] == TL_NONE) {
            tli_patch_note_release(m->ctx, &m->patches[p]);
            continue;
        }
        patch_number[p] = (uint32_t)n;
        m->patches[n++] = m->patches[p];
    }
    m->patch_count = n;
    n = 0;
    for (size_t s = 0; s < m->segment_count; s++) {
        tli_segment_note *note = &m->segments[s];
        if (segment_number[s] == TL_NONE) {
            tli_segment_note_release(m->ctx, note);
            continue;
        }
        for (uint32_t i = 0; i < note->input_count; i++)
            note->inputs[i] = patch_number[note->inputs[i]];
        for (uint32_t i = 0; i < note->output_count; i++)
            note->outputs[i] = patch_number[note->outputs[i]];
        segment_number[s] = (uint32_t)n;
        m->segments[n++] = *note;
    }
    m->segment_count = n;
    for (size_t p = 0; p < m->patch_count; p++) {
        tli_patch_note *note = &m->patches[p];
        if (note->producer != TL_NONE) note->producer = segment_number[note->producer];
        if (note->consumer != TL_NONE) note->consumer = segment_number[note->consumer];
    }
}

tl_status tli_model_prune(tli_model *m, tli_plan *plan)
{
    tl_status st = TL_OK;
    uint32_t *segment_number = tl_mem_zalloc(m->ctx, m->segment_count, sizeof(uint32_t), &st);
    uint32_t *patch_number = tl_mem_zalloc(m->ctx, m->patch_count, sizeof(uint32_t), &st);
    for (size_t s = 0; !st && s < m->segment_count; s++) /* finest first */
        if (is_idle(m, &m->segments[s])) take_out(m, plan, s, segment_number, patch_number);
    if (!st) move_up(m, segment_number, patch_number);
    tl_mem_free(m->ctx, patch_number);
    tl_mem_free(m->ctx, segment_number);
    return st;
}
