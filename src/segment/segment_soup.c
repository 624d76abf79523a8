/* A mesh on disk: written once, read in windows. */
#include "segment/segment_soup.h"

#include "formats/formats_emit.h"
#include "formats/formats_feeder.h"

#include <math.h>
#include <string.h>

/* Records read at once where one array of them is wanted. */
#define STEP 16384u

tl_status tli_soup_open(tl_ctx *ctx, const tl_segments *like, const char *folder, tli_soup *soup)
{
    tl_status st = TL_OK;
    *soup = (tli_soup){.ctx = ctx, .like = like, .regions_match = true, .region_channel = -1};
    soup->vert_numbers = 3 + like->components[TL_ON_VERTEX];
    soup->fits = tl_mem_alloc(ctx, like->channel_count + 1, sizeof *soup->fits, &st);
    for (size_t i = 0; !st && i <= like->channel_count; i++) soup->fits[i] = true;
    for (size_t i = 0; i < like->channel_count && soup->region_channel < 0; i++) {
        const tl_segment_channel *channel = &like->channels[i];
        if (channel->on == TL_ON_TET && channel->components == 1 &&
            tli_is_region_name(channel->name))
            soup->region_channel = (int)i;
    }
    if (!st) st = tli_scratch_open(ctx, folder, &soup->verts);
    if (!st) st = tli_scratch_open(ctx, folder, &soup->tets);
    if (!st && like->has_regions) st = tli_scratch_open(ctx, folder, &soup->regions);
    if (!st && like->components[TL_ON_TET]) st = tli_scratch_open(ctx, folder, &soup->values);
    return st;
}

void tli_soup_close(tli_soup *soup)
{
    if (!soup->ctx) return;
    tli_scratch_close(soup->values);
    tli_scratch_close(soup->regions);
    tli_scratch_close(soup->tets);
    tli_scratch_close(soup->verts);
    tl_mem_free(soup->ctx, soup->fits);
    *soup = (tli_soup){0};
}

/* ---- growing ---- */

static void look_at(tli_soup *soup, tl_on on, const double *tuples, size_t stride, size_t count)
{
    const tl_segments *s = soup->like;
    for (size_t c = 0; c < s->channel_count; c++) {
        const tl_segment_channel *channel = &s->channels[c];
        if (channel->on != on || !soup->fits[c] || channel->scalar == TL_F64) continue;
        bool fits = true;
        for (size_t i = 0; i < count && fits; i++)
            for (uint32_t k = 0; k < channel->components; k++)
                fits &= tl_scalar_holds(channel->scalar, tuples[i * stride + channel->first + k]);
        soup->fits[c] = fits;
    }
}

tl_status tli_soup_put_verts(tli_soup *soup, uint64_t first, const double *records, size_t count)
{
    bool *narrow = &soup->fits[soup->like->channel_count];
    for (size_t i = 0; i < count && *narrow; i++)
        for (int k = 0; k < 3; k++)
            *narrow &= tl_scalar_holds(TL_F32, records[i * soup->vert_numbers + (size_t)k]);
    look_at(soup, TL_ON_VERTEX, records + 3, soup->vert_numbers, count);
    if (first + count > soup->vert_count) soup->vert_count = first + count;
    const size_t bytes = soup->vert_numbers * sizeof *records;
    return tli_scratch_write(soup->ctx, soup->verts, first * bytes, records, count * bytes);
}

tl_status tli_soup_add_tets(tli_soup *soup, const tl_lidx *tets, const int32_t *regions,
                            const double *values, size_t count)
{
    const uint32_t components = soup->like->components[TL_ON_TET];
    const uint64_t first = soup->tet_count;
    tl_status st =
        tli_scratch_write(soup->ctx, soup->tets, first * 16, tets, count * 4 * sizeof *tets);
    if (!st && soup->regions)
        st = tli_scratch_write(soup->ctx, soup->regions, first * sizeof *regions, regions,
                               count * sizeof *regions);
    if (!st && soup->values) {
        look_at(soup, TL_ON_TET, values, components, count);
        const size_t tuple = components * sizeof *values;
        st = tli_scratch_write(soup->ctx, soup->values, first * tuple, values, count * tuple);
    }
    if (soup->region_channel >= 0 && regions) {
        uint32_t at = soup->like->channels[soup->region_channel].first;
        for (size_t t = 0; t < count; t++)
            soup->regions_match &= values[t * components + at] == regions[t];
    }
    soup->tet_count += count;
    return st;
}

/* ---- as a feed ---- */

typedef struct soup_feeder {
    tli_feeder feeder;
    const tli_soup *soup;
    uint32_t *channels[2]; /* of the segments, by tl_on */
} soup_feeder;

/* Numbers [at, at + components) of records [first, first + count) of a file. */
static tl_status read_part(const tli_soup *soup, const tli_scratch *file, size_t record_numbers,
                           size_t at, size_t components, uint64_t first, uint64_t count,
                           double *out)
{
    tl_status st = TL_OK;
    const size_t bytes = record_numbers * sizeof *out;
    double *records = tl_mem_alloc(soup->ctx, STEP, bytes, &st);
    for (uint64_t done = 0; !st && done < count;) {
        size_t part = count - done < STEP ? (size_t)(count - done) : STEP;
        st = tli_scratch_read(soup->ctx, file, (first + done) * bytes, records, part * bytes);
        for (size_t i = 0; !st && i < part; i++, out += components)
            memcpy(out, records + i * record_numbers + at, components * sizeof *out);
        done += part;
    }
    tl_mem_free(soup->ctx, records);
    return st;
}

static tl_status soup_points(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz)
{
    const tli_soup *soup = ((soup_feeder *)feeder)->soup;
    return read_part(soup, soup->verts, soup->vert_numbers, 0, 3, first, count, xyz);
}

static tl_status soup_values(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                             uint64_t count, double *values)
{
    const soup_feeder *f = (const soup_feeder *)feeder;
    const tli_soup *soup = f->soup;
    const tl_segment_channel *channel = &soup->like->channels[f->channels[on][array]];
    const bool verts = on == TL_ON_VERTEX;
    return read_part(soup, verts ? soup->verts : soup->values,
                     verts ? soup->vert_numbers : soup->like->components[TL_ON_TET],
                     channel->first + (verts ? 3u : 0u), channel->components, first, count, values);
}

static tl_status soup_cells(tli_feeder *feeder, uint64_t first, uint64_t count, tli_grid *window)
{
    const tli_soup *soup = ((soup_feeder *)feeder)->soup;
    tl_status st = TL_OK;
    window->connectivity =
        tl_mem_alloc(feeder->ctx, (size_t)count, 4 * sizeof *window->connectivity, &st);
    if (st) return st;
    return tli_scratch_read(feeder->ctx, soup->tets, first * 16, window->connectivity,
                            (size_t)count * 16);
}

static tl_status soup_regions(tli_feeder *feeder, uint64_t first, uint64_t count, int32_t *regions)
{
    const tli_soup *soup = ((soup_feeder *)feeder)->soup;
    return tli_scratch_read(feeder->ctx, soup->regions, first * sizeof *regions, regions,
                            (size_t)count * sizeof *regions);
}

static void soup_end(tli_feeder *feeder)
{
    soup_feeder *f = (soup_feeder *)feeder;
    tl_ctx *ctx = feeder->ctx;
    tli_feeder_drop_arrays(feeder);
    tl_mem_free(ctx, f->channels[0]);
    tl_mem_free(ctx, f->channels[1]);
    tl_mem_free(ctx, f);
}

tl_status tli_soup_feed(const tli_soup *soup, uint64_t memory_bytes, tli_feed **feed)
{
    tl_status st = TL_OK;
    const tl_segments *s = soup->like;
    *feed = NULL;
    soup_feeder *f = tl_mem_zalloc(soup->ctx, 1, sizeof *f, &st);
    if (st) return st;
    f->soup = soup;
    f->feeder = (tli_feeder){.ctx = soup->ctx,
                             .point_count = soup->vert_count,
                             .cell_count = soup->tet_count,
                             .time = s->time,
                             .is_final = true,
                             .points = soup_points,
                             .values = soup_values,
                             .cells = soup_cells,
                             .regions = s->has_regions ? soup_regions : NULL,
                             .close = soup_end};
    for (int on = 0; on < 2; on++)
        f->channels[on] = tl_mem_alloc(soup->ctx, s->channel_count, sizeof *f->channels[on], &st);
    for (uint32_t i = 0; !st && i < s->channel_count; i++) {
        const tl_segment_channel *channel = &s->channels[i];
        f->channels[channel->on][f->feeder.array_counts[channel->on]] = i;
        st = tli_feeder_add(&f->feeder, channel->on, channel->name, channel->components,
                            channel->scalar);
    }
    if (st) {
        soup_end(&f->feeder);
        return st;
    }
    return tli_feed_of(soup->ctx, &f->feeder, memory_bytes, feed);
}

/* ---- as a file ---- */

/* An array of the output: numbers of the records of a mapped file. */
typedef struct column {
    const uint8_t *map;
    size_t record_numbers, at;
    uint32_t components;
    tl_scalar scalar;
} column;

static void fill_column(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const column *c = arg;
    const size_t bytes = c->record_numbers * sizeof(double);
    const size_t tuple = tl_scalar_bytes(c->scalar) * c->components;
    for (uint64_t i = begin; i < end; i++)
        tli_narrow((const double *)(const void *)(c->map + i * bytes) + c->at, c->components,
                   c->scalar, (uint8_t *)out + (i - begin) * tuple);
    tli_scratch_forget(c->map, (size_t)begin * bytes, (size_t)end * bytes);
}

/* Numbers that are written as they are. */
static void fill_same(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const column *c = arg;
    const size_t bytes = 4 * c->record_numbers;
    memcpy(out, c->map + begin * bytes, (size_t)(end - begin) * bytes);
    tli_scratch_forget(c->map, (size_t)begin * bytes, (size_t)end * bytes);
}

static void fill_wide(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const column *c = arg;
    const uint32_t *from = (const uint32_t *)(const void *)c->map;
    int64_t *to = out;
    for (uint64_t i = 4 * begin; i < 4 * end; i++) *to++ = from[i];
    tli_scratch_forget(c->map, (size_t)begin * 16, (size_t)end * 16);
}

/* The four files of a soup, mapped. */
typedef struct soup_maps {
    const uint8_t *verts, *tets, *regions, *values;
    size_t vert_bytes, tet_bytes, region_bytes, value_bytes;
} soup_maps;

static tl_status map_soup(const tli_soup *soup, soup_maps *maps)
{
    tl_ctx *ctx = soup->ctx;
    const size_t tets = (size_t)soup->tet_count;
    *maps = (soup_maps){.vert_bytes = (size_t)soup->vert_count * soup->vert_numbers * 8,
                        .tet_bytes = tets * 16,
                        .region_bytes = tets * sizeof(int32_t),
                        .value_bytes = tets * soup->like->components[TL_ON_TET] * 8};
    tl_status st = tli_scratch_map(ctx, soup->verts, maps->vert_bytes, &maps->verts);
    if (!st) st = tli_scratch_map(ctx, soup->tets, maps->tet_bytes, &maps->tets);
    if (!st && soup->regions)
        st = tli_scratch_map(ctx, soup->regions, maps->region_bytes, &maps->regions);
    if (!st && soup->values)
        st = tli_scratch_map(ctx, soup->values, maps->value_bytes, &maps->values);
    return st;
}

static void unmap_soup(soup_maps *maps)
{
    tli_scratch_unmap(maps->verts, maps->vert_bytes);
    tli_scratch_unmap(maps->tets, maps->tet_bytes);
    tli_scratch_unmap(maps->regions, maps->region_bytes);
    tli_scratch_unmap(maps->values, maps->value_bytes);
}

/* Channels of one kind as arrays; their columns stand at the same index as the channels. */
static uint32_t describe(const tli_soup *soup, const soup_maps *maps, tl_on on, column *columns,
                         tli_out_array *arrays)
{
    const tl_segments *s = soup->like;
    const bool verts = on == TL_ON_VERTEX;
    uint32_t used = 0;
    for (size_t i = 0; i < s->channel_count; i++) {
        const tl_segment_channel *channel = &s->channels[i];
        if (channel->on != on) continue;
        columns[i] = (column){.map = verts ? maps->verts : maps->values,
                              .record_numbers = verts ? soup->vert_numbers : s->components[on],
                              .at = channel->first + (verts ? 3u : 0u),
                              .components = channel->components,
                              .scalar = soup->fits[i] ? channel->scalar : TL_F64};
        arrays[used++] = (tli_out_array){.name = channel->name,
                                         .unit = channel->unit,
                                         .scalar = columns[i].scalar,
                                         .components = channel->components,
                                         .count = verts ? soup->vert_count : soup->tet_count,
                                         .fill = fill_column,
                                         .arg = &columns[i]};
    }
    return used;
}

/* As needs_region_array of formats_write.c has it. */
static bool needs_regions(const tli_soup *soup)
{
    const tl_segments *s = soup->like;
    for (size_t i = 0; i < s->channel_count; i++)
        if (s->channels[i].on == TL_ON_TET && strcmp(s->channels[i].name, TLI_REGION_NAME) == 0)
            return false;
    return s->has_regions && (soup->region_channel < 0 || !soup->regions_match);
}

static tl_status emit(const tli_soup *soup, const soup_maps *maps, column *columns,
                      tli_out_array *arrays, const char *path, const tl_write_opts *opts)
{
    const size_t channels = soup->like->channel_count;
    const tl_scalar index = tli_out_index_type(soup->vert_count, soup->tet_count);
    column places = {maps->verts, soup->vert_numbers, 0, 3, soup->fits[channels] ? TL_F32 : TL_F64};
    column tets = {.map = maps->tets, .record_numbers = 4};
    column regions = {.map = maps->regions, .record_numbers = 1};
    tli_out out = {.time = soup->like->time};
    out.points =
        (tli_out_array){"Points", NULL, places.scalar, 3, soup->vert_count, fill_column, &places};
    out.tets = (tli_out_array){
        "connectivity", NULL, index, 4, soup->tet_count, index == TL_I32 ? fill_same : fill_wide,
        &tets};
    out.point_arrays = arrays;
    out.point_array_count = describe(soup, maps, TL_ON_VERTEX, columns, arrays);
    tli_out_array *on_cells = arrays + out.point_array_count;
    out.cell_arrays = on_cells;
    if (needs_regions(soup)) {
        *on_cells++ =
            (tli_out_array){TLI_REGION_NAME, NULL, TL_I32, 1, soup->tet_count, fill_same, &regions};
        out.cell_array_count++;
    }
    out.cell_array_count += describe(soup, maps, TL_ON_TET, columns, on_cells);
    tli_encoding encoding = opts->ascii ? TLI_TEXT : opts->zlib ? TLI_ZLIB : TLI_RAW;
    return tli_path_ends(path, ".vtk") ? tli_emit_vtk(soup->ctx, path, &out, encoding)
                                       : tli_emit_vtu(soup->ctx, path, &out, encoding);
}

tl_status tli_soup_write(const tli_soup *soup, const char *path, const tl_write_opts *opts)
{
    tl_ctx *ctx = soup->ctx;
    tl_status st = TL_OK;
    soup_maps maps = {0};
    tl_write_opts filled = tl_write_opts_defaults();
    if (!tli_path_ends(path, ".vtk") && !tli_path_ends(path, ".vtu"))
        return tl_fail(ctx, TL_ERR_ARG, "'%s': the ending says as what to write, .vtu or .vtk",
                       path);
    st = tli_opts_take(ctx, "tl_write_opts", opts, &filled, sizeof filled);
    const size_t channels = soup->like->channel_count;
    column *columns = tl_mem_zalloc(ctx, channels + 1, sizeof *columns, &st);
    tli_out_array *arrays = tl_mem_zalloc(ctx, channels + 1, sizeof *arrays, &st);
    if (!st) st = map_soup(soup, &maps);
    if (!st) st = emit(soup, &maps, columns, arrays, path, &filled);
    unmap_soup(&maps);
    tl_mem_free(ctx, arrays);
    tl_mem_free(ctx, columns);
    return st;
}
