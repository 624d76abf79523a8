/* The file of a model with channels that are added: tables for them, their blobs, their errors. */
#include <math.h>
#include <sys/stat.h>

#include "codec/codec.h"
#include "model/model_add.h"

enum { TRAINING = 24 /* patches of each class that tables are made of */ };

typedef struct writer {
    tl_ctx *ctx;
    tli_adder *a;
    const tli_plan *plan;
    size_t old_count, new_count; /* channels */
    tl_codec *codec;             /* NULL: every patch is raw */
    tli_bytes tables;
    tli_bytes *blobs; /* [field_count] of the patch at hand */
    tl_store_head head;
    tl_store_channel *channels; /* [new_count] */
    tl_store_level *levels;
    double *level_errors; /* [level_count][new_count] */
} writer;

/* ---- images ---- */

/* Of all new channels of a patch. Gives values[0 .. field_count - 1]. */
static tl_status load_images(writer *w, uint32_t id, const tl_patch *patch, int64_t **values)
{
    tl_status st = TL_OK;
    const size_t doubles = tli_row_doubles(w->plan, patch->vert_count, patch->tet_count);
    double *rows = tl_mem_alloc(w->ctx, doubles, sizeof *rows, &st);
    if (!st)
        st = tli_depot_get(w->ctx, w->a->model->meshes, w->a->model->patches[id].ofs, rows,
                           doubles * sizeof *rows);
    for (size_t f = 0; !st && f < w->plan->field_count; f++) {
        const tli_field *field = &w->plan->fields[f];
        const tli_rows from = tli_rows_of(w->plan, f, patch->vert_count, patch->tet_count);
        int64_t *to = values[f] =
            tl_mem_alloc(w->ctx, from.count * field->components, sizeof *to, &st);
        for (size_t e = 0; !st && e < from.count; e++)
            for (uint32_t c = 0; c < field->components; c++)
                *to++ = tl_value_image(&field->code, rows[from.first + e * from.stride + c]);
    }
    tl_mem_free(w->ctx, rows);
    return st;
}

static void release_images(writer *w, int64_t **values)
{
    for (size_t f = 0; f < w->plan->field_count; f++) tl_mem_free(w->ctx, values[f]);
    tl_mem_free(w->ctx, values);
}

/* ---- tables ---- */

static tl_status train_patch(writer *w, tli_trainer *trainer, uint32_t id, unsigned class_)
{
    tl_status st = TL_OK;
    tl_patch *patch = NULL;
    const int64_t **all = tl_mem_zalloc(w->ctx, w->new_count, sizeof *all, &st);
    int64_t **values = tl_mem_zalloc(w->ctx, w->plan->field_count, sizeof *values, &st);
    if (!st) st = tl_store_topology(w->ctx, w->a->store, id, &patch);
    if (!st) st = load_images(w, id, patch, values);
    for (size_t f = 0; !st && f < w->plan->field_count; f++) all[w->old_count + f] = values[f];
    if (!st) st = tli_trainer_add(w->ctx, trainer, class_, patch, all);
    if (values) release_images(w, values);
    tl_mem_free(w->ctx, all);
    tl_patch_destroy(w->ctx, patch);
    return st;
}

/* Some patches of each class, from all over the model. */
static tl_status train(writer *w, tli_trainer *trainer)
{
    tl_status st = TL_OK;
    for (unsigned class_ = 0; !st && class_ < TL_CLASS_COUNT; class_++) {
        size_t count = 0, seen = 0, taken = 0;
        for (int pass = 0; !st && pass < 2; pass++)
            for (uint32_t p = 0; !st && p < w->a->head->patch_count; p++) {
                tl_patch_info info;
                st = tl_store_patch(w->ctx, w->a->store, p, &info);
                if (st || info.class_ != class_) continue;
                if (pass == 0) {
                    count++;
                    continue;
                }
                if (count > TRAINING && seen++ * TRAINING / count < taken) continue;
                taken++;
                st = train_patch(w, trainer, p, class_);
            }
    }
    return st;
}

static tl_status make_codec(writer *w)
{
    tl_status st = TL_OK;
    tli_trainer *trainer = NULL;
    tli_bytes fresh;
    const tli_blob old = tli_store_codec_bytes(w->a->store);
    if (!old.byte_count) return TL_OK;
    tli_bytes_open(w->ctx, &fresh);
    tli_coded_channel *coded = tl_mem_alloc(w->ctx, w->new_count, sizeof *coded, &st);
    for (size_t c = 0; !st && c < w->new_count; c++)
        coded[c] =
            (tli_coded_channel){w->channels[c].code, w->channels[c].on, w->channels[c].components};
    if (!st) st = tli_trainer_create(w->ctx, &w->a->head->lattice, coded, w->new_count, &trainer);
    if (!st) st = train(w, trainer);
    if (!st) st = tli_trainer_write(trainer, &fresh);
    if (!st) st = tli_tables_extend(w->ctx, old.bytes, old.byte_count, &fresh, &w->tables);
    if (!st) st = tl_codec_read(w->ctx, w->tables.bytes, w->tables.count, &w->codec);
    tli_trainer_destroy(w->ctx, trainer);
    tl_mem_free(w->ctx, coded);
    tli_bytes_close(&fresh);
    return st;
}

/* ---- head ---- */

static void fill_channels(writer *w)
{
    memcpy(w->channels, w->a->head->channels, w->old_count * sizeof *w->channels);
    for (size_t f = 0; f < w->plan->field_count; f++) {
        const tli_field *field = &w->plan->fields[f];
        w->channels[w->old_count + f] =
            (tl_store_channel){.name = field->name,
                               .unit = field->unit,
                               .components = field->components,
                               .on = field->on,
                               .scalar = field->scalar,
                               .code = field->code,
                               .range = {field->range[0], field->range[1]},
                               .codec_error = field->leaf_error,
                               .has_step = field->has_step,
                               .step = field->step,
                               .time = field->time,
                               .nonfinite_count = field->nonfinite_count};
    }
}

static tl_status fill_head(writer *w)
{
    tl_status st = TL_OK;
    const tl_store_head *old = w->a->head;
    const tli_model *m = w->a->model;
    const size_t n = w->new_count, fields = w->plan->field_count;
    w->channels = tl_mem_zalloc(w->ctx, n, sizeof *w->channels, &st);
    w->levels = tl_mem_alloc(w->ctx, old->level_count, sizeof *w->levels, &st);
    w->level_errors = tl_mem_zalloc(w->ctx, old->level_count * n, sizeof(double), &st);
    if (st) return st;
    fill_channels(w);
    for (uint32_t l = 0; l < old->level_count; l++) {
        w->levels[l] = old->levels[l];
        w->levels[l].max_error = w->level_errors + l * n;
        memcpy(w->level_errors + l * n, old->levels[l].max_error, w->old_count * sizeof(double));
    }
    for (size_t f = 0; f < fields; f++)
        w->level_errors[w->old_count + f] = w->plan->fields[f].leaf_error;
    for (size_t s = 0; s < m->segment_count; s++) {
        const tli_segment_note *note = &m->segments[s];
        tl_store_level *above = &w->levels[note->level + 1];
        above->boundary_error = fmax(above->boundary_error, note->errors.surface);
        for (size_t f = 0; f < fields; f++) {
            double *error = &w->level_errors[(note->level + 1) * n + w->old_count + f];
            *error = fmax(*error, note->errors.max[f]);
        }
    }
    w->head = *old;
    w->head.levels = w->levels;
    w->head.channels = w->channels;
    w->head.channel_count = (uint32_t)n;
    return TL_OK;
}

/* ---- what the store asks for ---- */

static tl_status give_patch(void *user, uint32_t id, tli_blob *blobs, float *ranges,
                            double *square_error)
{
    writer *w = user;
    tl_status st = TL_OK;
    tl_patch *patch = NULL;
    tl_patch_info info;
    const tli_patch_note *note = &w->a->model->patches[id];
    int64_t **values = tl_mem_zalloc(w->ctx, w->plan->field_count, sizeof *values, &st);
    if (!st) st = tl_store_patch(w->ctx, w->a->store, id, &info);
    if (!st) st = tl_store_topology(w->ctx, w->a->store, id, &patch);
    if (!st) st = load_images(w, id, patch, values);
    for (size_t f = 0; !st && f < w->plan->field_count; f++) {
        const tli_field *field = &w->plan->fields[f];
        float lo = (float)note->ranges[2 * f], hi = (float)note->ranges[2 * f + 1];
        ranges[2 * f] = (double)lo > note->ranges[2 * f] ? nextafterf(lo, -INFINITY) : lo;
        ranges[2 * f + 1] = (double)hi < note->ranges[2 * f + 1] ? nextafterf(hi, INFINITY) : hi;
        square_error[f] = note->squares[f];
        w->blobs[f].count = 0;
        st = tli_channel_encode(w->ctx, w->codec, info.class_, patch, w->old_count + f, field->on,
                                field->components, values[f], &w->blobs[f]);
        blobs[f] = (tli_blob){w->blobs[f].bytes, w->blobs[f].count};
    }
    if (values) release_images(w, values);
    tl_patch_destroy(w->ctx, patch);
    return st;
}

static tl_status give_segment(void *user, uint32_t id, double *max_error, float *field_bins,
                              float *space_bins)
{
    const writer *w = user;
    const size_t n = w->plan->field_count;
    const tli_errors *e = &w->a->model->segments[tli_adder_segment(w->a, id)].errors;
    memcpy(max_error, e->max, n * sizeof *max_error);
    memcpy(field_bins, e->field, n * TLI_BINS * sizeof *field_bins);
    memcpy(space_bins, e->space, n * TLI_BINS * sizeof *space_bins);
    return TL_OK;
}

/* An original may go another way than that of the build, and a little farther out. */
static void give_place(void *user, uint32_t id, double sphere[4], double *boundary_error)
{
    const writer *w = user;
    const uint32_t number = tli_adder_segment(w->a, id);
    sphere[3] = fmax(sphere[3], w->a->radii[number]);
    *boundary_error = fmax(*boundary_error, w->a->model->segments[number].errors.surface);
}

tl_status tli_adder_write(tli_adder *a, const char *path, uint64_t *bytes)
{
    writer w = {.ctx = a->ctx,
                .a = a,
                .plan = a->plan,
                .old_count = a->head->channel_count,
                .new_count = a->head->channel_count + a->plan->field_count};
    tl_status st = TL_OK;
    struct stat written;
    const tli_store_added added = {&w, give_patch, give_segment, give_place};
    tli_bytes_open(w.ctx, &w.tables);
    w.blobs = tl_mem_zalloc(w.ctx, w.plan->field_count, sizeof *w.blobs, &st);
    for (size_t f = 0; !st && f < w.plan->field_count; f++) tli_bytes_open(w.ctx, &w.blobs[f]);
    if (!st) st = fill_head(&w);
    if (!st) st = make_codec(&w);
    if (!st)
        st = tli_store_append(w.ctx, a->store, path, &w.head,
                              (tli_blob){w.tables.bytes, w.tables.count}, &added);
    if (!st) *bytes = stat(path, &written) == 0 ? (uint64_t)written.st_size : 0;
    for (size_t f = 0; w.blobs && f < w.plan->field_count; f++) tli_bytes_close(&w.blobs[f]);
    tli_bytes_close(&w.tables);
    tl_codec_destroy(w.ctx, w.codec);
    void *blocks[] = {w.blobs, w.level_errors, w.levels, w.channels};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(w.ctx, blocks[i]);
    return st;
}
