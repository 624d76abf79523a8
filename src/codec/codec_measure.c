/* What the codec reaches on a mesh: bits and CPU time, verified in the same run. */
#include "codec/codec_split.h"
#include "codec/codec_topology.h"
#include "mesh/mesh.h"

#include <float.h>
#include <math.h>
#include <string.h>
#include <time.h>

#define RUNS_MAX 1000u
/* Origins and units of a lattice fit whatever finite mesh there is. */
#define DIAGONAL_LEAST 1e-200
#define DIAGONAL_MOST 1e200

typedef struct measuring {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    tl_lattice lattice;
    tli_coded_channel *channels;
    size_t channel_count;
    tli_split split;
    int64_t **values; /* [patch * channel_count + channel] */
    tl_codec *codec;
    tli_bytes *blobs; /* [patch * (1 + channel_count)]: topology, then channels */
    tl_codec_report *report;
} measuring;

static double cpu_s(void)
{
    return (double)clock() / CLOCKS_PER_SEC;
}

static tl_status make_lattice(measuring *m, double position_error)
{
    double low[3], high[3], diagonal = 0;
    for (int a = 0; a < 3; a++) {
        low[a] = DBL_MAX;
        high[a] = -DBL_MAX;
    }
    for (size_t v = 0; v < m->mesh->vert_count; v++)
        for (size_t a = 0; a < 3; a++) {
            low[a] = fmin(low[a], m->mesh->xyz[3 * v + a]);
            high[a] = fmax(high[a], m->mesh->xyz[3 * v + a]);
        }
    for (int a = 0; a < 3; a++) diagonal = hypot(diagonal, high[a] - low[a]);
    if (position_error == 0) {
        m->lattice = (tl_lattice){.kind = TL_PLACE_FLOAT64};
        return TL_OK;
    }
    if (!(diagonal >= DIAGONAL_LEAST && diagonal <= DIAGONAL_MOST))
        return tl_fail(m->ctx, TL_ERR_DATA, "a mesh of diagonal %g has no lattice", diagonal);
    m->lattice = (tl_lattice){.kind = TL_PLACE_LATTICE,
                              .exponent = (int)floor(log2(position_error * diagonal))};
    for (int a = 0; a < 3; a++) {
        double origin = floor(ldexp(low[a], -m->lattice.exponent));
        if (!(fabs(origin) < 0x1p52))
            return tl_fail(m->ctx, TL_ERR_DATA, "a mesh too far from 0 for its size: %g", low[a]);
        m->lattice.origin[a] = (int64_t)origin;
    }
    return TL_OK;
}

static tl_status make_values(measuring *m, double channel_error)
{
    tl_status st = TL_OK;
    m->channels = tl_mem_zalloc(m->ctx, m->channel_count, sizeof *m->channels, &st);
    m->values =
        tl_mem_zalloc(m->ctx, m->channel_count * m->split.patch_count, sizeof *m->values, &st);
    for (size_t c = 0; c < m->channel_count && !st; c++) {
        const tl_channel *channel = &m->mesh->channels[c];
        bool on_vertex = channel->on == TL_ON_VERTEX;
        double range[2];
        tl_channel_range(channel, on_vertex ? m->mesh->vert_count : m->mesh->tet_count, range,
                         NULL);
        double step = channel_error * (range[1] - range[0]);
        tl_value_code code = {TL_VALUE_LATTICE, step};
        if (!(step > 0))
            code.kind = channel->scalar == TL_F64   ? TL_VALUE_FLOAT64
                        : channel->scalar == TL_F32 ? TL_VALUE_FLOAT32
                                                    : TL_VALUE_INTEGER;
        m->channels[c] = (tli_coded_channel){code, channel->on, channel->components};
        for (size_t p = 0; p < m->split.patch_count && !st; p++) {
            const tl_patch *patch = m->split.patches[p];
            const uint32_t *old = on_vertex ? m->split.vert_old[p] : m->split.tet_old[p];
            size_t k = channel->components,
                   count = on_vertex ? patch->vert_count : patch->tet_count;
            int64_t *values = tl_mem_alloc(m->ctx, count * k, sizeof *values, &st);
            m->values[p * m->channel_count + c] = values;
            for (size_t i = 0; i < count * k && !st; i++)
                values[i] = tl_value_image(&code, channel->values[old[i / k] * k + i % k]);
        }
    }
    return st;
}

static tl_status train(measuring *m)
{
    tli_trainer *trainer = NULL;
    tli_bytes bytes;
    tli_bytes_open(m->ctx, &bytes);
    tl_status st = tli_trainer_create(m->ctx, &m->lattice, m->channels, m->channel_count, &trainer);
    for (size_t p = 0; p < m->split.patch_count && !st; p++)
        st = tli_trainer_add(m->ctx, trainer, 0, m->split.patches[p],
                             (const int64_t *const *)(m->values + p * m->channel_count));
    if (!st) st = tli_trainer_write(trainer, &bytes);
    m->report->table_bytes = bytes.count;
    if (!st) st = tl_codec_read(m->ctx, bytes.bytes, bytes.count, &m->codec);
    tli_trainer_destroy(m->ctx, trainer);
    tli_bytes_close(&bytes);
    return st;
}

static tl_status encode_all(measuring *m, tli_bits *bits)
{
    tl_status st = TL_OK;
    double begin = cpu_s();
    for (size_t p = 0; p < m->split.patch_count && !st; p++) {
        const tl_patch *patch = m->split.patches[p];
        tli_bytes *blobs = m->blobs + p * (1 + m->channel_count);
        blobs[0].count = 0;
        st = tli_topology_encode(m->ctx, m->codec, 0, patch, &blobs[0], bits);
        for (size_t c = 0; c < m->channel_count && !st; c++) {
            const tli_coded_channel *coded = &m->channels[c];
            blobs[1 + c].count = 0;
            st = tli_channel_encode(m->ctx, m->codec, 0, patch, c, coded->on, coded->components,
                                    m->values[p * m->channel_count + c], &blobs[1 + c]);
        }
    }
    m->report->encode_s = fmin(m->report->encode_s, cpu_s() - begin);
    return st;
}

static bool is_same(const tl_patch *a, const tl_patch *b)
{
    return a->vert_count == b->vert_count && a->tet_count == b->tet_count &&
           memcmp(a->tets, b->tets, a->tet_count * sizeof *a->tets) == 0 &&
           memcmp(a->opposite, b->opposite, a->tet_count * sizeof *a->opposite) == 0 &&
           memcmp(a->places, b->places, a->vert_count * sizeof *a->places) == 0 &&
           memcmp(a->shared, b->shared, a->vert_count) == 0 && !a->regions == !b->regions &&
           (!a->regions || memcmp(a->regions, b->regions, a->tet_count * sizeof *a->regions) == 0);
}

/* One patch; spare has room for the values of any channel. Adds to the times. */
static tl_status decode_patch(measuring *m, size_t p, int64_t *spare, double times[2])
{
    const tl_patch *patch = m->split.patches[p];
    const tli_bytes *blobs = m->blobs + p * (1 + m->channel_count);
    tl_patch *back = NULL;
    double begin = cpu_s();
    tl_status st = tl_topology_decode(m->ctx, m->codec, 0, blobs[0].bytes, blobs[0].count, &back);
    times[0] += cpu_s() - begin;
    if (!st && !is_same(patch, back))
        st = tl_fail(m->ctx, TL_ERR_DATA, "the topology of patch %zu came back changed", p);
    for (size_t c = 0; c < m->channel_count && !st; c++) {
        const tli_coded_channel *coded = &m->channels[c];
        size_t count = coded->on == TL_ON_VERTEX ? patch->vert_count : patch->tet_count;
        begin = cpu_s();
        st = tl_channel_decode(m->ctx, m->codec, 0, back, c, coded->on, coded->components,
                               blobs[1 + c].bytes, blobs[1 + c].count, spare);
        times[1] += cpu_s() - begin;
        if (!st && memcmp(spare, m->values[p * m->channel_count + c],
                          count * coded->components * sizeof *spare) != 0)
            st = tl_fail(m->ctx, TL_ERR_DATA, "channel %zu of patch %zu came back changed", c, p);
    }
    tl_patch_destroy(m->ctx, back);
    return st;
}

static tl_status decode_all(measuring *m, uint32_t patch_tets)
{
    tl_status st = TL_OK;
    size_t most = 1;
    double times[2] = {0, 0};
    for (size_t c = 0; c < m->channel_count; c++)
        if (m->channels[c].components > most) most = m->channels[c].components;
    int64_t *spare = tl_mem_alloc(m->ctx, most * 4 * patch_tets, sizeof *spare, &st);
    for (size_t p = 0; p < m->split.patch_count && !st; p++) st = decode_patch(m, p, spare, times);
    tl_mem_free(m->ctx, spare);
    m->report->topology_decode_s = fmin(m->report->topology_decode_s, times[0]);
    m->report->channel_decode_s = fmin(m->report->channel_decode_s, times[1]);
    return st;
}

static void sum_up(measuring *m, const tli_bits *bits, unsigned runs)
{
    tl_codec_report *r = m->report;
    r->patch_count = m->split.patch_count;
    r->connectivity_bits = bits->connectivity / runs;
    r->place_bits = bits->places / runs;
    r->flag_bits = bits->flags / runs;
    r->region_bits = bits->regions / runs;
    for (size_t p = 0; p < m->split.patch_count; p++) {
        const tl_patch *patch = m->split.patches[p];
        const uint32_t *opposite = patch->opposite[0];
        r->tet_count += patch->tet_count;
        r->vert_count += patch->vert_count;
        for (size_t f = 0; f < 4 * (size_t)patch->tet_count; f++)
            r->border_face_count += opposite[f] == TL_NONE;
        r->topology_bytes += (double)m->blobs[p * (1 + m->channel_count)].count;
        for (size_t c = 0; c < m->channel_count; c++)
            r->channel_bytes += (double)m->blobs[p * (1 + m->channel_count) + 1 + c].count;
    }
    r->channel_bits = 8 * r->channel_bytes;
}

static tl_status measure(measuring *m, uint32_t patch_tets, double channel_error, unsigned runs)
{
    tl_status st = tli_split_open(m->ctx, m->mesh, &m->lattice, patch_tets, &m->split);
    tli_bits bits = {0};
    if (!st) st = make_values(m, channel_error);
    size_t blob_count = m->split.patch_count * (1 + m->channel_count);
    m->blobs = tl_mem_zalloc(m->ctx, blob_count, sizeof *m->blobs, &st);
    for (size_t b = 0; b < blob_count && !st; b++) tli_bytes_open(m->ctx, &m->blobs[b]);
    if (!st) st = train(m);
    for (unsigned run = 0; run < runs && !st; run++) {
        st = encode_all(m, &bits);
        if (!st) st = decode_all(m, patch_tets);
    }
    if (!st) sum_up(m, &bits, runs);
    for (size_t b = 0; b < blob_count && m->blobs; b++) tli_bytes_close(&m->blobs[b]);
    for (size_t i = 0; i < m->channel_count * m->split.patch_count && m->values; i++)
        tl_mem_free(m->ctx, m->values[i]);
    return st;
}

tl_status tl_codec_measure(tl_ctx *ctx, const tl_mesh *mesh, uint32_t patch_tets,
                           double position_error, double channel_error, unsigned runs,
                           tl_codec_report *report)
{
    if (patch_tets < 1 || patch_tets > TL_PATCH_VERTS_MAX / 4 || runs < 1 || runs > RUNS_MAX ||
        !(position_error >= 0 && position_error <= 1) ||
        !(channel_error >= 0 && channel_error <= 1))
        return tl_fail(ctx, TL_ERR_ARG, "patches of %u tets, errors %g and %g, %u runs", patch_tets,
                       position_error, channel_error, runs);
    tl_codec_report made = {
        .encode_s = DBL_MAX, .topology_decode_s = DBL_MAX, .channel_decode_s = DBL_MAX};
    measuring m = {.ctx = ctx, .mesh = mesh, .channel_count = mesh->channel_count, .report = &made};
    tl_status st = make_lattice(&m, position_error);
    if (!st) st = measure(&m, patch_tets, channel_error, runs);
    tli_split_close(ctx, &m.split);
    tl_mem_free(ctx, m.channels);
    tl_mem_free(ctx, m.values);
    tl_mem_free(ctx, m.blobs);
    tl_codec_destroy(ctx, m.codec);
    if (!st) *report = made;
    return st;
}
