/* The state of a build as bytes: lists as they are in memory, pointers left out, with a sum over
 * all. It is for the program that wrote it, on this machine. */
#include "model/model_state.h"

#include <stdio.h>

#define MAGIC 0x3230454154534c54u /* "TLSTAE02" where bytes are little-endian */

/* What stands first. */
typedef struct state_head {
    uint64_t magic;
    uint32_t patch_bytes, segment_bytes; /* of notes: another program may have others */
    uint32_t stage, asked_bytes;
} state_head;

/* In the manner of FNV-1a, over words of eight bytes, the last one filled up with zeros. */
static uint64_t sum_bytes(uint64_t sum, const uint8_t *bytes, size_t count)
{
    for (size_t at = 0; at < count; at += 8) {
        uint64_t word = 0;
        memcpy(&word, bytes + at, count - at < 8 ? count - at : 8);
        sum = (sum ^ word) * 0x100000001b3u;
        sum ^= sum >> 32;
    }
    return sum;
}

#define SUM_START 0xcbf29ce484222325u

/* ---- writing ---- */

typedef struct pen {
    tli_sink *sink;
    uint64_t sum;
    tl_status status;
} pen;

/* Padded to eight bytes, as the sum has it. */
static void put(pen *p, const void *bytes, size_t count)
{
    static const uint8_t zeros[8];
    size_t rest = (8 - count % 8) % 8;
    if (p->status || !count) return;
    p->sum = sum_bytes(p->sum, bytes, count);
    p->status = tli_sink_write(p->sink, bytes, count);
    if (!p->status) p->status = tli_sink_write(p->sink, zeros, rest);
}

static void put_survey(pen *p, const tli_survey *s, size_t channels)
{
    tli_survey plain = *s;
    plain.channels = NULL;
    put(p, &plain, sizeof plain);
    put(p, s->channels, channels * sizeof *s->channels);
}

static void put_patch(pen *p, const tli_patch_note *note, size_t fields)
{
    tli_patch_note plain = *note;
    uint64_t samplings = note->sampling != NULL;
    plain.squares = plain.ranges = NULL;
    plain.sampling = NULL;
    for (int k = 0; k < TLI_KINDS; k++) plain.extents[k].items = NULL;
    put(p, &plain, sizeof plain);
    put(p, note->squares, fields * sizeof *note->squares);
    put(p, note->ranges, 2 * fields * sizeof *note->ranges);
    for (int k = 0; k < TLI_KINDS; k++)
        put(p, note->extents[k].items, note->extents[k].count * sizeof(tli_extent));
    put(p, &samplings, sizeof samplings);
    put(p, note->sampling, samplings * sizeof *note->sampling);
}

static void put_segment(pen *p, const tli_segment_note *note, size_t fields)
{
    tli_segment_note plain = *note;
    plain.inputs = plain.outputs = NULL;
    plain.errors.max = NULL;
    plain.errors.field = plain.errors.space = NULL;
    put(p, &plain, sizeof plain);
    put(p, note->inputs, note->input_count * sizeof *note->inputs);
    put(p, note->outputs, note->output_count * sizeof *note->outputs);
    put(p, note->errors.max, fields * sizeof *note->errors.max);
    put(p, note->errors.field, fields * TLI_BINS * sizeof *note->errors.field);
    put(p, note->errors.space, fields * TLI_BINS * sizeof *note->errors.space);
}

/* Of the model what does not lie in lists. */
typedef struct model_head {
    tl_lattice lattice;
    double position_error;
    uint64_t patch_count, segment_count, seam_count, point_count, cell_count;
    double finest_surface;
    uint64_t ends[5]; /* of the depots */
    uint32_t level_count, zero;
} model_head;

static void list_depots(const tli_model *m, tli_depot *depots[5])
{
    depots[0] = m->meshes;
    for (int i = 0; i < 2; i++) {
        depots[1 + i] = m->carried[i];
        depots[3 + i] = m->seam_files[i];
    }
}

static tl_status put_model(pen *p, const tli_model *m)
{
    const tli_plan *plan = m->plan;
    tli_depot *depots[5];
    model_head head;
    memset(&head, 0, sizeof head);
    head.lattice = plan->lattice;
    head.position_error = plan->position_error;
    head.patch_count = m->patch_count;
    head.segment_count = m->segment_count;
    head.seam_count = m->seams.count;
    head.point_count = m->point_count;
    head.finest_surface = m->finest_surface;
    head.cell_count = m->cell_count;
    head.level_count = m->level_count;
    list_depots(m, depots);
    for (int i = 0; i < 5; i++) {
        head.ends[i] = tli_depot_end(depots[i]);
        tl_status st = tli_depot_sync(m->ctx, depots[i]);
        if (st) return st;
    }
    put(p, &head, sizeof head);
    for (size_t i = 0; i < plan->field_count; i++)
        put(p, &plan->fields[i].leaf_error, sizeof(double));
    for (size_t i = 0; i < m->patch_count; i++) put_patch(p, &m->patches[i], plan->field_count);
    for (size_t i = 0; i < m->segment_count; i++)
        put_segment(p, &m->segments[i], plan->field_count);
    put(p, m->seams.items, m->seams.count * sizeof *m->seams.items);
    return p->status;
}

tl_status tli_work_save(tli_work *w, uint32_t stage, const tli_survey *survey,
                        const tli_model *model)
{
    pen p = {.sum = SUM_START};
    tl_status st = TL_OK;
    w->stage = stage;
    if (!w->folder) return TL_OK;
    char *path = tli_work_path(w, TLI_STATE_NAME, &st);
    state_head head = {MAGIC, sizeof(tli_patch_note), sizeof(tli_segment_note), stage,
                       (uint32_t)strlen(w->asked)};
    if (!st) st = tli_sink_open(w->ctx, path, &p.sink);
    if (!st) {
        put(&p, &head, sizeof head);
        put(&p, w->asked, head.asked_bytes);
        if (survey) put_survey(&p, survey, survey->channel_count);
        st = p.status;
        if (!st && model) st = put_model(&p, model);
        if (!st) st = tli_sink_write(p.sink, &p.sum, sizeof p.sum);
    }
    tl_status end = tli_sink_close(p.sink, !st);
    tl_mem_free(w->ctx, path);
    return st ? st : end;
}

/* ---- reading ---- */

static tl_status damaged(const tli_work *w)
{
    return tl_fail(w->ctx, TL_ERR_FORMAT, "'%s/%s' is damaged at byte %zu", w->folder,
                   TLI_STATE_NAME, w->state_at);
}

/* The next bytes, where they lie; NULL past the end. */
static const uint8_t *next(tli_work *w, size_t count)
{
    size_t padded = count + (8 - count % 8) % 8, at = w->state_at;
    if (padded < count || padded > w->state.byte_count - sizeof(uint64_t) - at) return NULL;
    w->state_at += padded;
    return w->state.bytes + at;
}

static tl_status take(tli_work *w, void *to, size_t count)
{
    const uint8_t *from = next(w, count);
    if (!from) return damaged(w);
    if (count) memcpy(to, from, count);
    return TL_OK;
}

/* An array that follows. Gives it. */
static tl_status take_array(tli_work *w, size_t count, size_t item_bytes, void *array)
{
    tl_status st = TL_OK;
    size_t bytes;
    void *own = NULL;
    memcpy(array, &own, sizeof own);
    if (!tli_mul_size(count, item_bytes, &bytes)) return damaged(w);
    const uint8_t *from = next(w, bytes);
    if (!from) return damaged(w);
    own = tl_mem_alloc(w->ctx, count, item_bytes, &st);
    if (!st && bytes) memcpy(own, from, bytes);
    memcpy(array, &own, sizeof own);
    return st;
}

tl_status tli_state_begin(tli_work *w, const char *path, char **asked)
{
    tl_status st = TL_OK;
    state_head head = {0};
    uint64_t sum, bytes = w->state.byte_count;
    *asked = NULL;
    if (bytes < sizeof head + sizeof sum || bytes % 8)
        return tl_fail(w->ctx, TL_ERR_FORMAT, "'%s' is no state of a build", path);
    memcpy(&sum, w->state.bytes + bytes - sizeof sum, sizeof sum);
    memcpy(&head, w->state.bytes, sizeof head);
    if (head.magic != MAGIC || head.patch_bytes != sizeof(tli_patch_note) ||
        head.segment_bytes != sizeof(tli_segment_note))
        return tl_fail(w->ctx, TL_ERR_FORMAT, "'%s' is no state of a build by this program", path);
    if (sum_bytes(SUM_START, w->state.bytes, (size_t)bytes - sizeof sum) != sum)
        return tl_fail(w->ctx, TL_ERR_FORMAT, "'%s' is damaged", path);
    w->state_at = sizeof head;
    const uint8_t *text = next(w, head.asked_bytes);
    if (!text) return damaged(w);
    *asked = tl_mem_zalloc(w->ctx, (size_t)head.asked_bytes + 1, 1, &st);
    if (!st) memcpy(*asked, text, head.asked_bytes);
    w->stage = head.stage;
    return st;
}

tl_status tli_work_load_survey(tli_work *w, size_t channel_count, tli_survey *survey)
{
    tl_status st = take(w, survey, sizeof *survey);
    survey->channels = NULL;
    if (!st && survey->channel_count != channel_count) st = damaged(w);
    if (!st) st = take_array(w, channel_count, sizeof *survey->channels, &survey->channels);
    return st;
}

static tl_status take_patch(tli_work *w, tli_patch_note *note, size_t fields)
{
    tli_patch_note plain;
    uint64_t samplings = 0;
    tl_status st = take(w, &plain, sizeof plain);
    if (st) return st;
    plain.squares = plain.ranges = NULL;
    plain.sampling = NULL;
    for (int k = 0; k < TLI_KINDS; k++) {
        plain.extents[k].items = NULL;
        plain.extents[k].capacity = plain.extents[k].count;
    }
    *note = plain;
    st = take_array(w, fields, sizeof(double), &note->squares);
    if (!st) st = take_array(w, 2 * fields, sizeof(double), &note->ranges);
    for (int k = 0; !st && k < TLI_KINDS; k++)
        st = take_array(w, note->extents[k].count, sizeof(tli_extent), &note->extents[k].items);
    if (!st) st = take(w, &samplings, sizeof samplings);
    if (!st && samplings > 1) st = damaged(w);
    if (!st && samplings) st = take_array(w, 1, sizeof *note->sampling, &note->sampling);
    return st;
}

static tl_status take_segment(tli_work *w, tli_segment_note *note, size_t fields)
{
    tli_segment_note plain;
    tl_status st = take(w, &plain, sizeof plain);
    if (st) return st;
    plain.inputs = plain.outputs = NULL;
    plain.errors.max = NULL;
    plain.errors.field = plain.errors.space = NULL;
    *note = plain;
    st = take_array(w, note->input_count, sizeof *note->inputs, &note->inputs);
    if (!st) st = take_array(w, note->output_count, sizeof *note->outputs, &note->outputs);
    if (!st) st = take_array(w, fields, sizeof(double), &note->errors.max);
    if (!st) st = take_array(w, fields * TLI_BINS, sizeof(float), &note->errors.field);
    if (!st) st = take_array(w, fields * TLI_BINS, sizeof(float), &note->errors.space);
    return st;
}

static tl_status take_lists(tli_work *w, const model_head *head, tli_model *m)
{
    size_t first, fields = m->plan->field_count;
    uint64_t left = w->state.byte_count - w->state_at;
    if (head->patch_count > left / sizeof(tli_patch_note) ||
        head->segment_count > left / sizeof(tli_segment_note))
        return damaged(w);
    tl_status st = tli_model_add_patches(m, (size_t)head->patch_count, &first);
    for (size_t i = 0; !st && i < m->patch_count; i++) st = take_patch(w, &m->patches[i], fields);
    if (!st) st = tli_model_add_segments(m, (size_t)head->segment_count, &first);
    for (size_t i = 0; !st && i < m->segment_count; i++)
        st = take_segment(w, &m->segments[i], fields);
    if (!st) st = take_array(w, (size_t)head->seam_count, sizeof(tli_seam), &m->seams.items);
    if (!st) m->seams.count = m->seams.capacity = (size_t)head->seam_count;
    return st;
}

tl_status tli_work_load_model(tli_work *w, tli_plan *plan, tli_model *m)
{
    model_head head;
    tli_depot *depots[5];
    tl_status st = take(w, &head, sizeof head);
    if (st) return st;
    plan->lattice = head.lattice;
    plan->position_error = head.position_error;
    m->point_count = head.point_count;
    m->finest_surface = head.finest_surface;
    m->cell_count = head.cell_count;
    m->level_count = head.level_count;
    list_depots(m, depots);
    for (int i = 0; !st && i < 5; i++) st = tli_depot_cut(depots[i], head.ends[i]);
    for (size_t i = 0; !st && i < plan->field_count; i++)
        st = take(w, &plan->fields[i].leaf_error, sizeof(double));
    if (!st) st = take_lists(w, &head, m);
    tli_map_close(w->ctx, &w->state);
    w->state = (tli_map){0};
    return st;
}
