/* Shared vertices of a level in working files: written segment by segment, read in bins. */
#include "model/model_seams.h"

#include <stdlib.h>
#include <string.h>

#include "base/base_sort.h"

/* A record of the file, and of a bin. */
typedef struct record {
    uint64_t id;
    uint32_t patch, zero;
} record;

/* Bytes that a record takes while its bin is sorted: as it is read, apart, and for the sort. */
enum { SORTED_BYTES = 16 + 12 + 12 };

/* ---- of a segment ---- */

tl_status tli_shared_add(tl_ctx *ctx, tli_shared *s, uint64_t id, uint32_t patch)
{
    tl_status st = TL_OK;
    if (s->count == s->capacity) {
        size_t capacity = s->capacity ? s->capacity + s->capacity / 2 : 1024;
        s->ids = tl_mem_resize(ctx, s->ids, capacity, sizeof *s->ids, &st);
        s->patches = tl_mem_resize(ctx, s->patches, capacity, sizeof *s->patches, &st);
        if (st) return st;
        s->capacity = capacity;
    }
    s->ids[s->count] = id;
    s->patches[s->count++] = patch;
    return TL_OK;
}

void tli_shared_release(tl_ctx *ctx, tli_shared *s)
{
    tl_mem_free(ctx, s->patches);
    tl_mem_free(ctx, s->ids);
    *s = (tli_shared){0};
}

tl_status tli_seam_put(tl_ctx *ctx, tli_depot *depot, tli_shared *shared, tli_seam *seam)
{
    tl_status st = TL_OK;
    record *records = tl_mem_alloc(ctx, shared->count, sizeof *records, &st);
    *seam = (tli_seam){.count = (uint32_t)shared->count};
    for (size_t i = 0; !st && i < shared->count; i++)
        records[i] = (record){shared->ids[i], shared->patches[i], 0};
    if (!st) st = tli_depot_put(ctx, depot, records, shared->count * sizeof *records, &seam->ofs);
    tl_mem_free(ctx, records);
    tli_shared_release(ctx, shared);
    return st;
}

tl_status tli_seams_add(tl_ctx *ctx, tli_seams *seams, tli_seam seam, size_t first_patch)
{
    tl_status st = TL_OK;
    if (seams->count == seams->capacity) {
        size_t capacity = seams->capacity ? 2 * seams->capacity : 16;
        seams->items = tl_mem_resize(ctx, seams->items, capacity, sizeof *seams->items, &st);
        if (st) return st;
        seams->capacity = capacity;
    }
    seam.first_patch = (uint32_t)first_patch;
    seams->items[seams->count++] = seam;
    return TL_OK;
}

void tli_seams_release(tl_ctx *ctx, tli_seams *seams)
{
    tl_mem_free(ctx, seams->items);
    *seams = (tli_seams){0};
}

/* ---- of a level, in bins ---- */

/* Ids of neighbours differ by little: multiplied, they spread over the bins. */
static uint32_t bin_of(uint64_t id, uint32_t bin_count)
{
    return (uint32_t)((id * 0x9e3779b97f4a7c15u >> 32) * bin_count >> 32);
}

/* The records of a segment into the bins. */
static tl_status deal_seam(tl_ctx *ctx, const tli_depot *depot, const tli_seam *seam,
                           tli_bins *bins)
{
    tl_status st = TL_OK;
    size_t n = seam->count;
    record *in = tl_mem_alloc(ctx, n, sizeof *in, &st),
           *out = tl_mem_alloc(ctx, n, sizeof *out, &st);
    uint32_t *keys = tl_mem_alloc(ctx, n, sizeof *keys, &st);
    uint32_t *places = tl_mem_alloc(ctx, n, sizeof *places, &st);
    uint32_t *begins = tl_mem_alloc(ctx, (size_t)bins->bin_count + 1, sizeof *begins, &st);
    if (!st) st = tli_depot_get(ctx, depot, seam->ofs, in, n * sizeof *in);
    if (!st) {
        for (size_t i = 0; i < n; i++) keys[i] = bin_of(in[i].id, bins->bin_count);
        tli_deal_alone(keys, n, bins->bin_count, begins, places);
        for (size_t i = 0; i < n; i++) {
            out[places[i]] = in[i];
            out[places[i]].patch += seam->first_patch;
        }
        st = tli_bins_add(bins, out, begins);
    }
    void *blocks[] = {begins, places, keys, out, in};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    return st;
}

tl_status tli_seam_bins_open(tl_ctx *ctx, const char *folder, const tli_depot *depot,
                             const tli_seams *seams, uint64_t bin_bytes, tli_seam_bins *b)
{
    uint64_t records = 0;
    *b = (tli_seam_bins){0};
    for (size_t i = 0; i < seams->count; i++) records += seams->items[i].count;
    uint64_t bin_count = records * SORTED_BYTES / bin_bytes + 1;
    tl_status st = tli_bins_open(ctx, folder, sizeof(record), (uint32_t)bin_count, &b->bins);
    for (size_t i = 0; !st && i < seams->count; i++)
        st = deal_seam(ctx, depot, &seams->items[i], &b->bins);
    uint64_t most = 0;
    for (uint32_t i = 0; !st && i < bin_count; i++)
        most = b->bins.counts[i] > most ? b->bins.counts[i] : most;
    b->ids = tl_mem_alloc(ctx, (size_t)most, sizeof *b->ids, &st);
    b->patches = tl_mem_alloc(ctx, (size_t)most, sizeof *b->patches, &st);
    return st;
}

tl_status tli_seam_bins_read(tl_ctx *ctx, tli_seam_bins *b, uint32_t bin)
{
    tl_status st = TL_OK;
    b->count = (size_t)b->bins.counts[bin];
    record *records = tl_mem_alloc(ctx, b->count, sizeof *records, &st);
    if (!st) st = tli_bins_read(ctx, &b->bins, bin, records);
    for (size_t i = 0; !st && i < b->count; i++) {
        b->ids[i] = records[i].id;
        b->patches[i] = records[i].patch;
    }
    tl_mem_free(ctx, records);
    return st ? st : tli_sort_u64(ctx, b->ids, b->patches, b->count);
}

void tli_seam_bins_close(tl_ctx *ctx, tli_seam_bins *b)
{
    tl_mem_free(ctx, b->patches);
    tl_mem_free(ctx, b->ids);
    tli_bins_close(&b->bins);
    *b = (tli_seam_bins){0};
}

/* ---- of several segments ---- */

tl_status tli_locked_open(tl_ctx *ctx, const char *folder, size_t segment_count, tli_locked *locked)
{
    return tli_bins_open(ctx, folder, sizeof(tli_locked_vertex), (uint32_t)segment_count,
                         &locked->bins);
}

tl_status tli_locked_add(tl_ctx *ctx, tli_locked *locked, const tli_locked_vertex *vertices,
                         const uint32_t *segments, size_t count)
{
    tl_status st = TL_OK;
    const uint32_t bin_count = locked->bins.bin_count;
    tli_locked_vertex *out = tl_mem_alloc(ctx, count, sizeof *out, &st);
    uint32_t *places = tl_mem_alloc(ctx, count, sizeof *places, &st);
    uint32_t *begins = tl_mem_alloc(ctx, (size_t)bin_count + 1, sizeof *begins, &st);
    if (!st) {
        tli_deal_alone(segments, count, bin_count, begins, places);
        for (size_t i = 0; i < count; i++) out[places[i]] = vertices[i];
        st = tli_bins_add(&locked->bins, out, begins);
    }
    tl_mem_free(ctx, begins);
    tl_mem_free(ctx, places);
    tl_mem_free(ctx, out);
    return st;
}

static int by_id(const void *a, const void *b)
{
    uint64_t x = ((const tli_locked_vertex *)a)->id, y = ((const tli_locked_vertex *)b)->id;
    return (x > y) - (x < y);
}

tl_status tli_locked_read(tl_ctx *ctx, const tli_locked *locked, size_t segment,
                          tli_locked_vertex **vertices, size_t *count)
{
    tl_status st = TL_OK;
    *count = (size_t)locked->bins.counts[segment];
    *vertices = tl_mem_alloc(ctx, *count, sizeof **vertices, &st);
    if (!st) st = tli_bins_read(ctx, &locked->bins, (uint32_t)segment, *vertices);
    if (!st) qsort(*vertices, *count, sizeof **vertices, by_id);
    return st;
}

void tli_locked_release(tli_locked *locked)
{
    tli_bins_close(&locked->bins);
}

size_t tli_locked_find(const tli_locked_vertex *vertices, size_t count, uint64_t id)
{
    size_t low = 0, high = count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (vertices[middle].id < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low < count && vertices[low].id == id ? low : SIZE_MAX;
}
