/* Models for tests of cuts: a random graph of segments and patches along a line, with errors that
 * do not fall towards the coarse side, written as a .tlod file whose blobs hold nothing. */
#ifndef TETRALOD_TESTS_MAKE_MODEL_H
#define TETRALOD_TESTS_MAKE_MODEL_H

#include "store/store.h"

#include "check.h"
#include "make_mesh.h"

enum { MODEL_CHANNELS = 2 };

typedef struct model_segment {
    uint32_t level, first_input, input_count, first_output, output_count; /* patches, as made */
    uint32_t outputs[8], number;
    double sphere[4], max_error[MODEL_CHANNELS], boundary_error;
    float bins[2 * MODEL_CHANNELS * TL_BINS]; /* field, then space */
    uint64_t output_tets;
} model_segment;

typedef struct model_patch {
    uint32_t producer, consumer, level, tets, verts, number;
    double sphere[4], square_error[MODEL_CHANNELS];
} model_patch;

typedef struct make_model {
    model_segment *segments;
    model_patch *patches;
    uint32_t segment_count, patch_count, level_count, root_count;
    uint64_t seed;
} make_model;

static inline double model_between(make_model *m, double a, double b)
{
    return a + (b - a) * make_uniform(&m->seed);
}

/* Leaves lie side by side, each a sphere on the x axis. */
static inline void model_leaves(make_model *m, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        model_patch *p = &m->patches[m->patch_count++];
        *p = (model_patch){.producer = TL_NONE, .consumer = TL_NONE};
        p->tets = 1000 + (uint32_t)(make_random(&m->seed) % 4000);
        p->verts = p->tets / 5;
        p->sphere[0] = (i + 0.5) / count;
        p->sphere[3] = 0.6 / count;
    }
}

static inline void model_hold(double sphere[4], const double other[4])
{
    double reach = fabs(other[0] - sphere[0]) + other[3];
    if (reach > sphere[3]) sphere[3] = reach;
}

/* One segment takes inputs [first, first + count) and makes some patches. */
static inline void model_merge(make_model *m, uint32_t level, uint32_t first, uint32_t count)
{
    model_segment *s = &m->segments[m->segment_count];
    *s = (model_segment){.level = level, .first_input = first, .input_count = count};
    uint64_t tets = 0;
    double square[MODEL_CHANNELS] = {0};
    memcpy(s->sphere, m->patches[first + count / 2].sphere, sizeof s->sphere);
    for (uint32_t i = first; i < first + count; i++) {
        model_patch *p = &m->patches[i];
        p->consumer = m->segment_count;
        tets += p->tets;
        model_hold(s->sphere, p->sphere);
        for (int c = 0; c < MODEL_CHANNELS; c++) square[c] += p->square_error[c];
        if (p->producer == TL_NONE) continue;
        const model_segment *child = &m->segments[p->producer];
        for (int c = 0; c < MODEL_CHANNELS; c++)
            s->max_error[c] = fmax(s->max_error[c], child->max_error[c]);
        s->boundary_error = fmax(s->boundary_error, child->boundary_error);
        for (int c = 0; c < 2 * MODEL_CHANNELS * TL_BINS; c++)
            s->bins[c] = fmaxf(s->bins[c], child->bins[c]);
    }
    for (int c = 0; c < MODEL_CHANNELS; c++)
        s->max_error[c] = s->max_error[c] * model_between(m, 1, 2) + model_between(m, 0, 1e-3);
    s->boundary_error = s->boundary_error * model_between(m, 1, 2) + model_between(m, 0, 1e-5);
    for (int c = 0; c < 2 * MODEL_CHANNELS * TL_BINS; c++)
        s->bins[c] += (float)model_between(m, 0, 1e-4);
    s->first_output = m->patch_count;
    s->output_count = 1 + (uint32_t)(make_random(&m->seed) % 4);
    for (uint32_t i = 0; i < s->output_count; i++) {
        model_patch *p = &m->patches[m->patch_count++];
        *p = (model_patch){.producer = m->segment_count, .consumer = TL_NONE, .level = level + 1};
        p->tets = (uint32_t)(tets / 2 / s->output_count) + 1;
        p->verts = p->tets / 5 + 4;
        memcpy(p->sphere, s->sphere, sizeof p->sphere);
        for (int c = 0; c < MODEL_CHANNELS; c++)
            p->square_error[c] = square[c] * model_between(m, 2, 5) / s->output_count + 1e-3;
    }
    m->segment_count++;
}

/* Levels of segments over leaf_count leaves, until few patches are left. */
static inline make_model make_graph(uint32_t leaf_count, uint64_t seed)
{
    make_model m = {.seed = seed};
    m.segments = calloc(2 * (size_t)leaf_count + 8, sizeof *m.segments);
    m.patches = calloc(8 * (size_t)leaf_count + 64, sizeof *m.patches);
    if (!m.segments || !m.patches) abort();
    model_leaves(&m, leaf_count);
    uint32_t first = 0;
    for (uint32_t level = 0; m.patch_count - first > 6 && level < 20; level++) {
        uint32_t end = m.patch_count;
        m.level_count = level + 1;
        while (first < end) {
            uint32_t count = 3 + (uint32_t)(make_random(&m.seed) % 5);
            if (first + count + 3 > end) count = end - first;
            model_merge(&m, level, first, count);
            first += count;
        }
    }
    m.level_count++;
    m.root_count = m.patch_count - first;
    return m;
}

static inline void make_graph_release(make_model *m)
{
    free(m->segments);
    free(m->patches);
    memset(m, 0, sizeof *m);
}

/* Numbers as in a file: coarse first; patches by consumer, roots in front. */
static inline void model_number(make_model *m)
{
    uint32_t patch = 0;
    for (uint32_t i = m->patch_count - m->root_count; i < m->patch_count; i++)
        m->patches[i].number = patch++;
    for (uint32_t s = m->segment_count; s-- > 0;) {
        m->segments[s].number = m->segment_count - 1 - s;
        for (uint32_t i = 0; i < m->segments[s].input_count; i++)
            m->patches[m->segments[s].first_input + i].number = patch++;
    }
}

static inline tl_status model_add_patch(const make_model *m, tli_store_writer *w,
                                        const model_patch *p)
{
    const tli_blob empty = {(const uint8_t *)"", 0}, channels[MODEL_CHANNELS] = {empty, empty};
    static const float ranges[2 * MODEL_CHANNELS] = {0, 1, 0, 1};
    tl_patch_info info = {.level = p->level,
                          .tet_count = p->tets,
                          .vert_count = p->verts,
                          .ranges = ranges,
                          .square_error = p->square_error};
    info.producer = p->producer == TL_NONE ? TL_NONE : m->segments[p->producer].number;
    memcpy(info.sphere, p->sphere, sizeof info.sphere);
    return tli_store_add_patch(w, &info, empty, channels, NULL, 0);
}

static inline int model_by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static inline tl_status model_add_segment(const make_model *m, tli_store_writer *w,
                                          const model_segment *s)
{
    uint32_t outputs[8];
    tl_segment_info info = {.level = s->level,
                            .patch_count = s->input_count,
                            .outputs = outputs,
                            .output_count = s->output_count,
                            .boundary_error = s->boundary_error,
                            .max_error = s->max_error,
                            .field_bins = s->bins,
                            .space_bins = s->bins + MODEL_CHANNELS * TL_BINS};
    info.first_patch = m->patches[s->first_input].number;
    for (uint32_t i = 0; i < s->output_count; i++) {
        outputs[i] = m->patches[s->first_output + i].number;
        info.output_tets += m->patches[s->first_output + i].tets;
    }
    qsort(outputs, s->output_count, sizeof *outputs, model_by_number);
    memcpy(info.sphere, s->sphere, sizeof info.sphere);
    return tli_store_add_segment(w, &info);
}

/* Writes the model to path. */
static inline tl_status make_model_write(tl_ctx *ctx, make_model *m, const char *path)
{
    tl_store_channel channels[MODEL_CHANNELS];
    tl_store_level levels[TL_STORE_LEVELS_MAX] = {0};
    double errors[TL_STORE_LEVELS_MAX][MODEL_CHANNELS] = {{0}};
    for (int c = 0; c < MODEL_CHANNELS; c++)
        channels[c] = (tl_store_channel){.name = c ? "b" : "a",
                                         .unit = "",
                                         .components = 1,
                                         .scalar = TL_F32,
                                         .code = {TL_VALUE_LATTICE, 1e-4},
                                         .range = {0, 1},
                                         .codec_error = 5e-5,
                                         .time = (double)NAN};
    for (uint32_t l = 0; l < m->level_count; l++) levels[l].max_error = errors[l];
    for (uint32_t i = 0; i < m->patch_count; i++) {
        levels[m->patches[i].level].patch_count++;
        levels[m->patches[i].level].tets += m->patches[i].tets;
    }
    for (uint32_t i = 0; i < m->segment_count; i++) levels[m->segments[i].level].segment_count++;
    tl_store_head head = {.lattice = {TL_PLACE_LATTICE, -16, {0, 0, 0}},
                          .segment_count = m->segment_count,
                          .patch_count = m->patch_count,
                          .root_patch_count = m->root_count,
                          .input_tets = levels[0].tets,
                          .input_verts = levels[0].tets / 5,
                          .time = (double)NAN,
                          .position_error = 1e-6,
                          .levels = levels,
                          .level_count = m->level_count,
                          .channels = channels,
                          .channel_count = MODEL_CHANNELS};
    head.stats.bounds[1] = 1;
    head.stats.diagonal = 1;
    tli_store_writer *w = NULL;
    tl_status st = tli_store_begin(ctx, path, &head, (tli_blob){(const uint8_t *)"", 0}, 0, &w);
    model_number(m);
    for (uint32_t i = m->patch_count - m->root_count; !st && i < m->patch_count; i++)
        st = model_add_patch(m, w, &m->patches[i]);
    for (uint32_t s = m->segment_count; !st && s-- > 0;) {
        for (uint32_t i = 0; !st && i < m->segments[s].input_count; i++)
            st = model_add_patch(m, w, &m->patches[m->segments[s].first_input + i]);
        if (!st) st = model_add_segment(m, w, &m->segments[s]);
    }
    tl_status end = tli_store_finish(w, &head, !st);
    return st ? st : end;
}

#endif
