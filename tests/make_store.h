/* Models for tests of the container: a graph of any size made from a few numbers, with patches of a
 * few tets that really decode (raw layout) and fields with a formula. A segment takes up four
 * patches (or more) and hands on half as many, which go to different segments, so the graph is no
 * tree. */
#ifndef TETRALOD_TESTS_MAKE_STORE_H
#define TETRALOD_TESTS_MAKE_STORE_H

#include "codec/codec.h"
#include "store/store.h"

#include "check_file.h"
#include "make_mesh.h"

#define MAKE_STORE_LEVELS_MAX 12
#define MAKE_STORE_CHANNELS_MAX 8
#define MAKE_STORE_OUTPUTS_MAX 16
#define MAKE_STORE_SIDE 1024 /* of the lattice */

typedef struct make_store {
    /* chosen */
    uint32_t level_count, coarse_segments, channel_count, vert_count;
    uint32_t outputs; /* patches that a segment hands on, 0: two; it takes up twice as many */
    bool with_twins;
    tli_blob codec;
    /* made */
    tl_store_head head;
    tl_store_level levels[MAKE_STORE_LEVELS_MAX];
    tl_store_channel channels[MAKE_STORE_CHANNELS_MAX];
    double level_errors[MAKE_STORE_LEVELS_MAX][MAKE_STORE_CHANNELS_MAX];
    uint64_t cells[3];
    tl_store_region regions[2];
    uint32_t patch_base[MAKE_STORE_LEVELS_MAX], segment_base[MAKE_STORE_LEVELS_MAX];
} make_store;

/* One patch with everything that is stored of it. */
typedef struct make_store_patch {
    tl_patch_info info;
    tl_patch patch;
    tli_twin twin;
    size_t twin_count;
    float ranges[2 * MAKE_STORE_CHANNELS_MAX];
    double square_error[MAKE_STORE_CHANNELS_MAX];
    int64_t *images[MAKE_STORE_CHANNELS_MAX];
    tli_bytes topology, values[MAKE_STORE_CHANNELS_MAX];
    tli_blob blobs[MAKE_STORE_CHANNELS_MAX];
} make_store_patch;

typedef struct make_store_segment {
    tl_segment_info info;
    uint32_t outputs[MAKE_STORE_OUTPUTS_MAX];
    double max_error[MAKE_STORE_CHANNELS_MAX];
    float field_bins[MAKE_STORE_CHANNELS_MAX * TL_BINS];
    float space_bins[MAKE_STORE_CHANNELS_MAX * TL_BINS];
} make_store_segment;

/* ---- the graph ---- */

static inline uint32_t make_store_outputs(const make_store *m)
{
    return m->outputs ? m->outputs : 2;
}

static inline uint32_t make_store_inputs(const make_store *m)
{
    return 2 * make_store_outputs(m);
}

static inline uint32_t make_store_patches(const make_store *m, uint32_t level)
{
    return m->levels[level].patch_count;
}

static inline uint32_t make_store_level(const make_store *m, uint32_t patch)
{
    uint32_t level = m->level_count - 1;
    while (level && patch >= m->patch_base[level] + make_store_patches(m, level)) level--;
    return level;
}

static inline void make_store_channels(make_store *m)
{
    static const tl_store_channel SOME[3] = {
        {.name = "temperature",
         .unit = "K",
         .components = 1,
         .on = TL_ON_VERTEX,
         .scalar = TL_F32,
         .code = {TL_VALUE_LATTICE, 0x1p-10},
         .range = {-1, 1},
         .codec_error = 0x1p-11},
        {.name = "velocity",
         .unit = "m/s",
         .components = 3,
         .on = TL_ON_VERTEX,
         .scalar = TL_F64,
         .code = {TL_VALUE_FLOAT64, 1},
         .range = {0, 2}},
        {.name = "material",
         .unit = "",
         .components = 1,
         .on = TL_ON_TET,
         .scalar = TL_I32,
         .code = {TL_VALUE_INTEGER, 1},
         .range = {0, 4}},
    };
    for (uint32_t c = 0; c < m->channel_count; c++) {
        m->channels[c] = SOME[c % 3];
        m->channels[c].time = c < 3 ? (double)NAN : c * 0.5;
        m->channels[c].nonfinite_count = c % 3 == 1 ? m->head.patch_count : 0;
    }
}

static inline void make_store_head(make_store *m)
{
    uint32_t patch = 0, segment = 0, segments = m->coarse_segments;
    const uint32_t top = m->level_count - 1;
    for (uint32_t l = m->level_count; l-- > 0;) {
        tl_store_level *level = &m->levels[l];
        *level = (tl_store_level){.max_error = m->level_errors[l], .boundary_error = l * 0.125};
        level->segment_count = l == top ? 0 : segments;
        level->patch_count =
            l == top ? make_store_outputs(m) * segments : make_store_inputs(m) * segments;
        if (!top) level->patch_count = segments; /* never simplified: roots alone */
        if (l != top) segments = 2 * segments;
        level->tets = (uint64_t)level->patch_count * (m->vert_count - 3);
        level->verts = l ? TL_STORE_UNKNOWN : (uint64_t)level->patch_count * m->vert_count;
        for (uint32_t c = 0; c < m->channel_count; c++) m->level_errors[l][c] = ldexp(l, -8);
        m->patch_base[l] = patch;
        m->segment_base[l] = segment;
        patch += level->patch_count;
        segment += level->segment_count;
    }
    m->cells[0] = 17;
    m->cells[2] = 4;
    m->regions[0] = (tl_store_region){-1, 10, NULL};
    m->regions[1] = (tl_store_region){7, 90, "inlet"};
    m->head = (tl_store_head){.lattice = {TL_PLACE_LATTICE, -10, {-512, 0, 1024}},
                              .segment_count = segment,
                              .patch_count = patch,
                              .root_patch_count = m->levels[top].patch_count,
                              .input_tets = m->levels[0].tets,
                              .input_verts = m->levels[0].verts,
                              .time = 1.5,
                              .position_error = 0x1p-11,
                              .border_share = 0.25,
                              .connectivity_bits = 100,
                              .place_bits = 200,
                              .flag_bits = 3,
                              .cells = m->cells,
                              .cell_kind_count = 3,
                              .regions = m->regions,
                              .regions_listed = 2,
                              .region_count = 2,
                              .levels = m->levels,
                              .level_count = m->level_count,
                              .channels = m->channels,
                              .channel_count = m->channel_count};
    tl_mesh_stats *s = &m->head.stats;
    const double bounds[6] = {-0.5, 0.5, 0, 1, 1, 2};
    memcpy(s->bounds, bounds, sizeof bounds);
    s->diagonal = sqrt(3);
    s->volume = 0.75;
    s->components = SIZE_MAX;
    s->quality_median = 0.5;
    s->boundary_triangles = 12;
}

/* m holds what is chosen. */
static inline void make_store_open(make_store *m)
{
    make_store_head(m);
    make_store_channels(m);
}

/* ---- segments ---- */

static inline void make_store_get_segment(const make_store *m, uint32_t id, make_store_segment *s)
{
    uint32_t level = m->level_count - 1;
    while (level && id >= m->segment_base[level] + m->levels[level].segment_count) level--;
    const uint32_t index = id - m->segment_base[level];
    uint64_t seed = 77 + id;
    memset(s, 0, sizeof *s);
    for (uint32_t i = 0; i < make_store_outputs(m); i++)
        s->outputs[i] = m->patch_base[level + 1] + index + i * m->levels[level].segment_count;
    s->info = (tl_segment_info){.level = level,
                                .first_patch = m->patch_base[level] + make_store_inputs(m) * index,
                                .patch_count = make_store_inputs(m),
                                .outputs = s->outputs,
                                .output_count = make_store_outputs(m),
                                .input_tets = make_store_inputs(m) * (m->vert_count - 3),
                                .output_tets = make_store_outputs(m) * (m->vert_count - 3),
                                .sphere = {0, 0.5, 1.5, 1},
                                .max_error = s->max_error,
                                .field_bins = s->field_bins,
                                .space_bins = s->space_bins};
    const double size = ldexp(1, (int)level - 12); /* twice that of the finer level: saturated */
    s->info.boundary_error = size * (1 + make_uniform(&seed) / 2);
    for (uint32_t c = 0; c < m->channel_count; c++) {
        s->max_error[c] = size * (1 + make_uniform(&seed) / 2);
        for (uint32_t b = 4 + (uint32_t)(make_random(&seed) % 5); b < 40; b++) {
            s->field_bins[c * TL_BINS + b] =
                (float)(s->max_error[c] * make_uniform(&seed) * 0x1p-9);
            s->space_bins[c * TL_BINS + b] = (float)(size * make_uniform(&seed) * 0x1p-9);
        }
        /* where the finer level has something, so has the coarser one */
        for (uint32_t b = 4; b < 40; b++) {
            s->field_bins[c * TL_BINS + b] += (float)size;
            s->space_bins[c * TL_BINS + b] += (float)size;
        }
    }
}

/* ---- patches ---- */

static inline double make_store_value(const tl_store_channel *channel, const double xyz[3],
                                      uint32_t component)
{
    if (channel->components == 3) return sin(xyz[component % 3] + component);
    return sin(9 * xyz[0]) * cos(7 * xyz[1] * xyz[2]);
}

static inline void make_store_places(const make_store *m, uint32_t id, make_store_patch *p)
{
    uint64_t seed = 1234 + id;
    tl_patch *patch = &p->patch;
    const uint32_t group = p->info.consumer == TL_NONE ? m->head.segment_count : p->info.consumer;
    for (uint32_t v = 0; v < patch->vert_count; v++) {
        for (int k = 0; k < 3; k++)
            patch->places[v][k] = (int64_t)(make_random(&seed) % (MAKE_STORE_SIDE + 1));
        patch->shared[v] = v < 2;
        if (v < 2) /* one place of the whole group; the second vertex lies there, too */
            for (int k = 0; k < 3; k++) patch->places[v][k] = (group * 37 + (uint32_t)k) % 1024;
    }
    if (m->with_twins && id % 3 == 0) {
        p->twin = (tli_twin){.vert = 1, .twin = (uint8_t)(1 + id % 255)};
        p->twin_count = 1;
    } else {
        patch->shared[1] = 0;
    }
    for (uint32_t t = 0; t < patch->tet_count; t++)
        for (uint32_t c = 0; c < 4; c++) patch->tets[t][c] = (uint16_t)(t + c);
    memcpy(p->info.sphere, (const double[4]){0, 0.5, 1.5, 0.875}, sizeof p->info.sphere);
}

static inline void make_store_values(tl_ctx *ctx, const make_store *m, uint32_t id,
                                     make_store_patch *p, uint32_t c)
{
    const tl_store_channel *channel = &m->channels[c];
    const bool on_tet = channel->on == TL_ON_TET;
    const uint32_t elems = on_tet ? p->patch.tet_count : p->patch.vert_count;
    tl_status st = TL_OK;
    double low = INFINITY, high = -INFINITY;
    p->images[c] = tl_mem_alloc(ctx, (size_t)elems * channel->components, 8, &st);
    CHECK_OK(ctx, st);
    for (uint32_t e = 0; e < elems; e++) {
        double xyz[3], squares = 0, value = 0;
        tl_lattice_xyz(&m->head.lattice, p->patch.places[e], xyz);
        for (uint32_t k = 0; k < channel->components; k++) {
            value = on_tet ? (double)((id + e) % 5) : make_store_value(channel, xyz, k);
            if (!on_tet && channel->components == 3 && p->patch.places[e][0] % 8 == 5) value = NAN;
            int64_t image = tl_value_image(&channel->code, value);
            p->images[c][e * channel->components + k] = image;
            value = tl_value_of(&channel->code, image);
            squares += value * value;
        }
        double norm = channel->components == 1 ? value : sqrt(squares);
        if (isfinite(norm)) {
            low = fmin(low, norm);
            high = fmax(high, norm);
        }
    }
    float *range = p->ranges + 2 * (size_t)c;
    range[0] = nextafterf((float)low, -INFINITY);
    range[1] = nextafterf((float)high, INFINITY);
    if (low > high) range[0] = range[1] = NAN;
    p->square_error[c] = id * 0x1p-20;
    CHECK_OK(ctx, tli_channel_encode(ctx, NULL, TL_CLASS_RAW, &p->patch, c, channel->on,
                                     channel->components, p->images[c], &p->values[c]));
    p->blobs[c] = (tli_blob){p->values[c].bytes, p->values[c].count};
}

static inline void make_store_get_patch(tl_ctx *ctx, const make_store *m, uint32_t id,
                                        make_store_patch *p)
{
    const uint32_t level = make_store_level(m, id), index = id - m->patch_base[level];
    tl_status st = TL_OK;
    memset(p, 0, sizeof *p);
    p->info = (tl_patch_info){.producer = TL_NONE,
                              .consumer = TL_NONE,
                              .level = level,
                              .class_ = TL_CLASS_RAW,
                              .vert_count = m->vert_count,
                              .tet_count = m->vert_count - 3,
                              .ranges = p->ranges,
                              .square_error = p->square_error,
                              .carried = (uint64_t)1000 << level};
    if (level)
        p->info.producer = m->segment_base[level - 1] + index % m->levels[level - 1].segment_count;
    if (level + 1 < m->level_count)
        p->info.consumer = m->segment_base[level] + index / make_store_inputs(m);
    p->patch = (tl_patch){.vert_count = m->vert_count, .tet_count = m->vert_count - 3};
    p->patch.places = tl_mem_alloc(ctx, m->vert_count, sizeof *p->patch.places, &st);
    p->patch.tets = tl_mem_alloc(ctx, m->vert_count, sizeof *p->patch.tets, &st);
    p->patch.shared = tl_mem_alloc(ctx, m->vert_count, 1, &st);
    CHECK_OK(ctx, st);
    make_store_places(m, id, p);
    tli_bytes_open(ctx, &p->topology);
    CHECK_OK(ctx, tli_patch_arrange(ctx, &p->patch, NULL, NULL));
    for (uint32_t v = 0; p->twin_count && v < m->vert_count; v++)
        if (p->patch.shared[v]) p->twin.vert = (uint16_t)v; /* of two at one place either will do */
    CHECK_OK(ctx, tli_topology_encode(ctx, NULL, TL_CLASS_RAW, &p->patch, &p->topology, NULL));
    for (uint32_t c = 0; c < m->channel_count; c++) {
        tli_bytes_open(ctx, &p->values[c]);
        make_store_values(ctx, m, id, p, c);
    }
}

static inline void make_store_release_patch(tl_ctx *ctx, make_store_patch *p)
{
    for (uint32_t c = 0; c < MAKE_STORE_CHANNELS_MAX; c++) {
        tl_mem_free(ctx, p->images[c]);
        if (p->values[c].ctx) tli_bytes_close(&p->values[c]);
    }
    tli_bytes_close(&p->topology);
    tl_mem_free(ctx, p->patch.places);
    tl_mem_free(ctx, p->patch.tets);
    tl_mem_free(ctx, p->patch.shared);
    tl_mem_free(ctx, p->patch.opposite);
}

/* ---- the file ---- */

/* Adds everything; patches are made in content, a context without injected failures. */
static inline tl_status make_store_add(tl_ctx *content, const make_store *m,
                                       tli_store_writer *writer)
{
    tl_status st = TL_OK;
    uint32_t patch = 0;
    for (uint32_t s = 0; !st && s <= m->head.segment_count; s++) {
        make_store_segment segment;
        uint32_t end = m->head.root_patch_count;
        if (s) {
            make_store_get_segment(m, s - 1, &segment);
            end = segment.info.first_patch + segment.info.patch_count;
        }
        for (; !st && patch < end; patch++) {
            make_store_patch p;
            make_store_get_patch(content, m, patch, &p);
            st =
                tli_store_add_patch(writer, &p.info, (tli_blob){p.topology.bytes, p.topology.count},
                                    p.blobs, &p.twin, p.twin_count);
            make_store_release_patch(content, &p);
        }
        if (!st && s) st = tli_store_add_segment(writer, &segment.info);
    }
    return st;
}

static inline tl_status make_store_write(tl_ctx *ctx, tl_ctx *content, const make_store *m,
                                         const char *path)
{
    tli_store_writer *writer = NULL;
    tl_status st = tli_store_begin(ctx, path, &m->head, m->codec, 0, &writer);
    if (!st) st = make_store_add(content, m, writer);
    tl_status end = tli_store_finish(writer, &m->head, !st);
    return st ? st : end;
}

/* A small model: everything lies in the first page. */
static inline void make_store_small(make_store *m)
{
    memset(m, 0, sizeof *m);
    m->level_count = 2;
    m->coarse_segments = 1;
    m->channel_count = 2;
    m->vert_count = 5;
    m->with_twins = true;
    make_store_open(m);
}

#endif
