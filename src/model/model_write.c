/* The file of a model: patches in the order of their consumers, coarse levels first, encoded by all
 * threads a window at a time. */
#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "codec/codec.h"
#include "model/model.h"
#include "store/store.h"

enum {
    WINDOW = 64,     /* patches in memory as bytes */
    TRAINING = 24,   /* patches of each class that tables are made of */
    COARSE_CLASS = 2 /* of levels from this one on */
};

/* A patch on its way into the file. */
typedef struct packet {
    tl_patch_info info;
    float *ranges;
    tli_bytes topology, *channels; /* [field_count] */
    tli_twin *twins;
    size_t twin_count, border_verts;
    tli_bits bits;
} packet;

typedef struct writer {
    tl_ctx *ctx;
    const tli_model *model;
    const tli_plan *plan;
    uint32_t *segments;       /* [segment_count] the model's in the file's order */
    uint32_t *segment_number; /* [segment_count] in the file, of the model's */
    uint32_t *patches;        /* [patch_count] the same of patches */
    uint32_t *patch_number;
    uint32_t root_count;
    tl_codec *codec;
    tli_store_writer *store;
    tl_store_head head;
    tl_store_level *levels;
    tl_store_channel *channels;
    double *level_errors; /* [level_count][field_count] */
    packet *window;       /* [WINDOW] */
    size_t first;         /* patch of the window */
    tli_bits bits;
    uint64_t border_verts, finest_verts;
} writer;

/* ---- numbers ---- */

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Segments coarse levels first, patches by their consumers. */
static tl_status number_all(writer *w)
{
    const tli_model *m = w->model;
    tl_status st = TL_OK;
    w->segments = tl_mem_alloc(w->ctx, m->segment_count, sizeof *w->segments, &st);
    w->segment_number = tl_mem_alloc(w->ctx, m->segment_count, sizeof *w->segment_number, &st);
    w->patches = tl_mem_alloc(w->ctx, m->patch_count, sizeof *w->patches, &st);
    w->patch_number = tl_mem_alloc(w->ctx, m->patch_count, sizeof *w->patch_number, &st);
    if (st) return st;
    uint32_t n = 0;
    for (uint32_t level = m->level_count; level-- > 0;)
        for (size_t s = 0; s < m->segment_count; s++) {
            if (m->segments[s].level != level) continue;
            w->segment_number[s] = n;
            w->segments[n++] = (uint32_t)s;
        }
    n = 0;
    for (size_t p = 0; p < m->patch_count; p++)
        if (m->patches[p].consumer == TL_NONE) w->patches[n++] = (uint32_t)p;
    w->root_count = n;
    for (size_t s = 0; s < m->segment_count; s++) {
        const tli_segment_note *note = &m->segments[w->segments[s]];
        for (uint32_t i = 0; i < note->input_count; i++) w->patches[n++] = note->inputs[i];
    }
    TL_ASSERT(n == m->patch_count);
    for (uint32_t i = 0; i < n; i++) w->patch_number[w->patches[i]] = i;
    return TL_OK;
}

/* ---- patches ---- */

static unsigned class_of(const writer *w, const tli_patch_note *note)
{
    if (w->plan->opts.raw) return TL_CLASS_RAW;
    return note->level < COARSE_CLASS ? note->level : COARSE_CLASS;
}

/* An arranged patch with the images of its values. */
typedef struct arranged {
    tl_patch patch;
    int64_t **values; /* [field_count] */
} arranged;

static void release_arranged(tl_ctx *ctx, const tli_plan *plan, arranged *a)
{
    for (size_t i = 0; a->values && i < plan->field_count; i++) tl_mem_free(ctx, a->values[i]);
    tl_mem_free(ctx, a->values);
    tl_mem_free(ctx, a->patch.places);
    tl_mem_free(ctx, a->patch.tets);
    tl_mem_free(ctx, a->patch.shared);
    tl_mem_free(ctx, a->patch.regions);
    tl_mem_free(ctx, a->patch.opposite);
    *a = (arranged){0};
}

static tl_status make_images(tl_ctx *ctx, const tli_plan *plan, const tli_bundle *b,
                             const uint32_t *vert_order, const uint32_t *tet_order, arranged *a)
{
    tl_status st = TL_OK;
    a->values = tl_mem_zalloc(ctx, plan->field_count, sizeof *a->values, &st);
    for (size_t i = 0; !st && i < plan->field_count; i++) {
        const tli_field *f = &plan->fields[i];
        bool on_vertex = f->on == TL_ON_VERTEX;
        size_t count = on_vertex ? b->vert_count : b->tet_count, k = f->components;
        size_t stride = on_vertex ? plan->vert_comps : plan->tet_comps;
        const double *from = (on_vertex ? b->values : b->tet_values) + f->first;
        const uint32_t *order = on_vertex ? vert_order : tet_order;
        int64_t *to = a->values[i] = tl_mem_alloc(ctx, count * k, sizeof *to, &st);
        for (size_t e = 0; !st && e < count; e++)
            for (size_t c = 0; c < k; c++)
                *to++ = tl_value_image(&f->code, from[order[e] * stride + c]);
    }
    return st;
}

/* tet_order and vert_order [count] receive the old numbers. */
static tl_status make_patch(tl_ctx *ctx, const tli_plan *plan, const tli_bundle *b,
                            uint32_t *vert_order, uint32_t *tet_order, tl_patch *p)
{
    tl_status st = TL_OK;
    *p = (tl_patch){.vert_count = b->vert_count, .tet_count = b->tet_count};
    if (b->vert_count > TL_PATCH_VERTS_MAX || b->tet_count > TL_PATCH_TETS_MAX)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "a patch of %u tets has %u vertices, at most %u fit; take smaller patches",
                       b->tet_count, b->vert_count, TL_PATCH_VERTS_MAX);
    p->places = tl_mem_alloc(ctx, b->vert_count, sizeof *p->places, &st);
    p->shared = tl_mem_alloc(ctx, b->vert_count, sizeof *p->shared, &st);
    p->tets = tl_mem_alloc(ctx, b->tet_count, sizeof *p->tets, &st);
    if (b->regions) p->regions = tl_mem_alloc(ctx, b->tet_count, sizeof *p->regions, &st);
    if (st) return st;
    for (size_t v = 0; v < b->vert_count; v++) {
        tl_lattice_nearest(&plan->lattice, b->xyz + 3 * v, p->places[v]);
        p->shared[v] = b->shared[v];
    }
    for (size_t t = 0; t < b->tet_count; t++)
        for (size_t i = 0; i < 4; i++) p->tets[t][i] = (uint16_t)b->tets[4 * t + i];
    if (b->regions) memcpy(p->regions, b->regions, b->tet_count * sizeof *p->regions);
    return tli_patch_arrange(ctx, p, vert_order, tet_order);
}

/* Loads a patch of the model; twins may be NULL. */
static tl_status load(const writer *w, tl_ctx *ctx, const tli_patch_note *note, arranged *a,
                      packet *to)
{
    tli_bundle b = {0};
    tl_status st = TL_OK;
    *a = (arranged){0};
    uint32_t *vert_order = tl_mem_alloc(ctx, note->vert_count, sizeof *vert_order, &st);
    uint32_t *tet_order = tl_mem_alloc(ctx, note->tet_count, sizeof *tet_order, &st);
    if (!st)
        st =
            tli_bundle_create(ctx, w->plan, note->vert_count, note->tet_count, note->level > 0, &b);
    if (!st) st = tli_depot_get(ctx, w->model->meshes, note->ofs, b.block, b.bytes);
    if (!st) st = make_patch(ctx, w->plan, &b, vert_order, tet_order, &a->patch);
    if (!st) st = make_images(ctx, w->plan, &b, vert_order, tet_order, a);
    if (!st && to) to->twins = tl_mem_alloc(ctx, b.vert_count, sizeof *to->twins, &st);
    for (uint32_t v = 0; !st && to && v < b.vert_count; v++) {
        to->border_verts += b.shared[vert_order[v]];
        if (b.shared[vert_order[v]] && b.twins[vert_order[v]])
            to->twins[to->twin_count++] = (tli_twin){(uint16_t)v, b.twins[vert_order[v]]};
    }
    tli_bundle_release(ctx, &b);
    tl_mem_free(ctx, tet_order);
    tl_mem_free(ctx, vert_order);
    if (st) release_arranged(ctx, w->plan, a);
    return st;
}

/* ---- tables ---- */

static tl_status train_class(writer *w, tli_trainer *trainer, unsigned class_)
{
    tl_status st = TL_OK;
    size_t count = 0, seen = 0, taken = 0;
    for (size_t i = 0; i < w->model->patch_count; i++)
        count += class_of(w, &w->model->patches[i]) == class_;
    for (size_t i = 0; !st && i < w->model->patch_count; i++) {
        const tli_patch_note *note = &w->model->patches[i];
        if (class_of(w, note) != class_) continue;
        if (count > TRAINING && seen++ * TRAINING / count < taken) continue;
        arranged a;
        taken++;
        st = load(w, w->ctx, note, &a, NULL);
        if (!st)
            st = tli_trainer_add(w->ctx, trainer, class_, &a.patch,
                                 (const int64_t *const *)a.values);
        release_arranged(w->ctx, w->plan, &a);
    }
    return st;
}

static tl_status make_codec(writer *w, tli_bytes *tables)
{
    tl_status st = TL_OK;
    tli_trainer *trainer = NULL;
    size_t n = w->plan->field_count;
    tli_coded_channel *channels = tl_mem_alloc(w->ctx, n, sizeof *channels, &st);
    for (size_t i = 0; !st && i < n; i++) {
        const tli_field *f = &w->plan->fields[i];
        channels[i] = (tli_coded_channel){f->code, f->on, f->components};
    }
    if (!st) st = tli_trainer_create(w->ctx, &w->plan->lattice, channels, n, &trainer);
    for (unsigned c = 0; !st && !w->plan->opts.raw && c <= COARSE_CLASS; c++)
        st = train_class(w, trainer, c);
    if (!st) st = tli_trainer_write(trainer, tables);
    if (!st) st = tl_codec_read(w->ctx, tables->bytes, tables->count, &w->codec);
    tli_trainer_destroy(w->ctx, trainer);
    tl_mem_free(w->ctx, channels);
    return st;
}

/* ---- head ---- */

static void fill_channels(writer *w, const tli_input *input)
{
    for (size_t i = 0; i < w->plan->field_count; i++) {
        const tli_field *f = &w->plan->fields[i];
        w->channels[i] = (tl_store_channel){.name = f->name,
                                            .unit = f->unit,
                                            .components = f->components,
                                            .on = f->on,
                                            .scalar = f->scalar,
                                            .code = f->code,
                                            .range = {f->range[0], f->range[1]},
                                            .codec_error = f->leaf_error,
                                            .has_step = f->has_step,
                                            .step = f->step,
                                            .time = f->has_step ? f->time : input->time,
                                            .nonfinite_count = f->nonfinite_count};
    }
}

static void fill_levels(writer *w)
{
    const tli_model *m = w->model;
    size_t n = w->plan->field_count;
    for (uint32_t l = 0; l < m->level_count; l++)
        w->levels[l] =
            (tl_store_level){.verts = TL_STORE_UNKNOWN, .max_error = w->level_errors + l * n};
    for (size_t i = 0; i < n; i++) w->level_errors[i] = w->plan->fields[i].leaf_error;
    w->levels[0].boundary_error = fmax(m->finest_surface, m->leaf_surface);
    for (size_t p = 0; p < m->patch_count; p++) {
        w->levels[m->patches[p].level].patch_count++;
        w->levels[m->patches[p].level].tets += m->patches[p].tet_count;
    }
    for (size_t s = 0; s < m->segment_count; s++) {
        const tli_segment_note *note = &m->segments[s];
        tl_store_level *above = &w->levels[note->level + 1];
        w->levels[note->level].segment_count++;
        above->boundary_error = fmax(above->boundary_error, note->errors.surface);
        for (size_t i = 0; i < n; i++) {
            double *error = &w->level_errors[(note->level + 1) * n + i];
            *error = fmax(*error, note->errors.max[i]);
        }
    }
}

static tl_status fill_head(writer *w, const tli_input *input)
{
    tl_status st = TL_OK;
    const tli_model *m = w->model;
    size_t n = w->plan->field_count;
    w->levels = tl_mem_zalloc(w->ctx, m->level_count, sizeof *w->levels, &st);
    w->channels = tl_mem_zalloc(w->ctx, n, sizeof *w->channels, &st);
    w->level_errors = tl_mem_zalloc(w->ctx, m->level_count * n, sizeof *w->level_errors, &st);
    if (st) return st;
    fill_channels(w, input);
    fill_levels(w);
    w->levels[0].verts = input->verts;
    w->head = (tl_store_head){.lattice = w->plan->lattice,
                              .segment_count = (uint32_t)m->segment_count,
                              .patch_count = (uint32_t)m->patch_count,
                              .root_patch_count = w->root_count,
                              .input_tets = input->tets,
                              .input_verts = input->verts,
                              .stats = input->stats,
                              .time = input->time,
                              .position_error = w->plan->position_error,
                              .levels = w->levels,
                              .level_count = m->level_count,
                              .channels = w->channels,
                              .channel_count = (uint32_t)n};
    return TL_OK;
}

/* ---- windows ---- */

static void open_packet(writer *w, packet *p, tl_status *st)
{
    p->ranges = tl_mem_alloc(w->ctx, 2 * w->plan->field_count, sizeof *p->ranges, st);
    p->channels = tl_mem_alloc(w->ctx, w->plan->field_count, sizeof *p->channels, st);
    tli_bytes_open(w->ctx, &p->topology);
    for (size_t i = 0; !*st && i < w->plan->field_count; i++)
        tli_bytes_open(w->ctx, &p->channels[i]);
}

static void close_packet(writer *w, packet *p)
{
    tli_bytes_close(&p->topology);
    for (size_t i = 0; p->channels && i < w->plan->field_count; i++)
        tli_bytes_close(&p->channels[i]);
    tl_mem_free(w->ctx, p->channels);
    tl_mem_free(w->ctx, p->ranges);
    tl_mem_free(w->ctx, p->twins);
}

/* Centre of a box and half of its diagonal, which holds whatever the box does. */
static void box_sphere(const double box[6], double sphere[4])
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        bool empty = !(box[2 * k] <= box[2 * k + 1]);
        double half = empty ? 0 : box[2 * k + 1] / 2 - box[2 * k] / 2;
        sphere[k] = empty ? 0 : box[2 * k] + half;
        square += half * half;
    }
    sphere[3] = sqrt(square) * (1 + 1e-12);
}

static void fill_info(const writer *w, const tli_patch_note *note, packet *p)
{
    p->info = (tl_patch_info){
        .producer = note->producer == TL_NONE ? TL_NONE : w->segment_number[note->producer],
        .consumer = note->consumer == TL_NONE ? TL_NONE : w->segment_number[note->consumer],
        .level = note->level,
        .class_ = class_of(w, note),
        .tet_count = note->tet_count,
        .vert_count = note->vert_count,
        .ranges = p->ranges,
        .square_error = note->squares,
        .carried = note->carried};
    box_sphere(note->box, p->info.sphere);
    for (size_t i = 0; i < w->plan->field_count; i++) {
        float lo = (float)note->ranges[2 * i], hi = (float)note->ranges[2 * i + 1];
        p->ranges[2 * i] = (double)lo > note->ranges[2 * i] ? nextafterf(lo, -INFINITY) : lo;
        p->ranges[2 * i + 1] = (double)hi < note->ranges[2 * i + 1] ? nextafterf(hi, INFINITY) : hi;
    }
}

/* Bytes belong to the writer's context, which is the root of the worker's. */
static tl_status encode(void *arg, size_t begin, size_t end, unsigned worker)
{
    writer *w = arg;
    tl_ctx *ctx = NULL;
    tl_status st = tli_ctx_fork(w->ctx, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        packet *p = &w->window[i];
        const tli_patch_note *note = &w->model->patches[w->patches[w->first + i]];
        arranged a;
        fill_info(w, note, p);
        st = load(w, ctx, note, &a, p);
        if (st) break;
        st = tli_topology_encode(ctx, w->codec, p->info.class_, &a.patch, &p->topology, &p->bits);
        for (size_t c = 0; !st && c < w->plan->field_count; c++) {
            const tli_field *f = &w->plan->fields[c];
            st = tli_channel_encode(ctx, w->codec, p->info.class_, &a.patch, c, f->on,
                                    f->components, a.values[c], &p->channels[c]);
        }
        release_arranged(ctx, w->plan, &a);
    }
    return tli_ctx_join(w->ctx, ctx, st);
}

static tl_status add_packet(writer *w, packet *p)
{
    tl_status st = TL_OK;
    tli_blob *blobs = tl_mem_alloc(w->ctx, w->plan->field_count, sizeof *blobs, &st);
    for (size_t i = 0; !st && i < w->plan->field_count; i++)
        blobs[i] = (tli_blob){p->channels[i].bytes, p->channels[i].count};
    if (!st)
        st = tli_store_add_patch(w->store, &p->info,
                                 (tli_blob){p->topology.bytes, p->topology.count}, blobs, p->twins,
                                 p->twin_count);
    w->bits.connectivity += p->bits.connectivity;
    w->bits.places += p->bits.places;
    w->bits.flags += p->bits.flags;
    w->bits.regions += p->bits.regions;
    if (p->info.level == 0) {
        w->border_verts += p->border_verts;
        w->finest_verts += p->info.vert_count;
    }
    tl_mem_free(w->ctx, blobs);
    return st;
}

static tl_status add_segment(writer *w, uint32_t number, uint32_t first_patch)
{
    const tli_segment_note *note = &w->model->segments[w->segments[number]];
    tl_status st = TL_OK;
    uint32_t *outputs = tl_mem_alloc(w->ctx, note->output_count, sizeof *outputs, &st);
    if (st) return st;
    for (uint32_t i = 0; i < note->output_count; i++)
        outputs[i] = w->patch_number[note->outputs[i]];
    qsort(outputs, note->output_count, sizeof *outputs, by_number);
    tl_segment_info info = {.level = note->level,
                            .first_patch = first_patch,
                            .patch_count = note->input_count,
                            .outputs = outputs,
                            .output_count = note->output_count,
                            .input_tets = note->input_tets,
                            .output_tets = note->output_tets,
                            .boundary_error = note->errors.surface,
                            .max_error = note->errors.max,
                            .field_bins = note->errors.field,
                            .space_bins = note->errors.space};
    box_sphere(note->box, info.sphere);
    st = tli_store_add_segment(w->store, &info);
    tl_mem_free(w->ctx, outputs);
    return st;
}

/* Encodes the patches [first, end), at most WINDOW, and adds them and the segments they complete.
 */
static tl_status write_window(writer *w, size_t end, uint32_t *segment, uint32_t *group_first)
{
    tl_status st = TL_OK;
    size_t count = end - w->first;
    memset(w->window, 0, WINDOW * sizeof *w->window);
    for (size_t i = 0; i < count; i++) open_packet(w, &w->window[i], &st);
    if (!st) st = tli_parallel(w->ctx, count, 1, encode, w);
    for (size_t i = 0; !st && i < count; i++) {
        uint32_t next = (uint32_t)(w->first + i) + 1;
        st = add_packet(w, &w->window[i]);
        if (next == w->root_count) *group_first = next;
        if (st || next <= w->root_count) continue;
        if (next - *group_first < w->model->segments[w->segments[*segment]].input_count) continue;
        st = add_segment(w, (*segment)++, *group_first);
        *group_first = next;
    }
    for (size_t i = 0; i < count; i++) close_packet(w, &w->window[i]);
    if (!st) st = tl_progress(w->ctx, "encode", end, w->model->patch_count);
    return st;
}

static tl_status write_all(writer *w)
{
    tl_status st = TL_OK;
    uint32_t segment = 0, group_first = 0;
    size_t count = w->model->patch_count;
    w->window = tl_mem_alloc(w->ctx, WINDOW, sizeof *w->window, &st);
    for (w->first = 0; !st && w->first < count; w->first += WINDOW)
        st = write_window(w, count - w->first < WINDOW ? count : w->first + WINDOW, &segment,
                          &group_first);
    w->head.connectivity_bits = w->bits.connectivity;
    w->head.place_bits = w->bits.places;
    w->head.flag_bits = w->bits.flags;
    w->head.region_bits = w->bits.regions;
    w->head.border_share = w->finest_verts ? (double)w->border_verts / (double)w->finest_verts : 0;
    return st;
}

tl_status tli_model_write(const tli_model *model, const char *path, const tli_input *input,
                          uint64_t *bytes)
{
    writer w = {.ctx = model->ctx, .model = model, .plan = model->plan};
    tli_bytes tables;
    struct stat written;
    tl_status st = number_all(&w);
    tli_bytes_open(w.ctx, &tables);
    if (!st) st = fill_head(&w, input);
    if (!st) st = make_codec(&w, &tables);
    if (!st)
        st = tli_store_begin(w.ctx, path, &w.head, (tli_blob){tables.bytes, tables.count}, 0,
                             &w.store);
    if (!st) st = write_all(&w);
    if (w.store) {
        tl_status end = tli_store_finish(w.store, &w.head, !st);
        if (!st) st = end;
    }
    if (!st) *bytes = stat(path, &written) == 0 ? (uint64_t)written.st_size : 0;
    tli_bytes_close(&tables);
    tl_codec_destroy(w.ctx, w.codec);
    void *blocks[] = {w.window,   w.level_errors, w.channels,       w.levels,
                      w.segments, w.patches,      w.segment_number, w.patch_number};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(w.ctx, blocks[i]);
    return st;
}
