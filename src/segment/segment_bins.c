/* External sorting by bins: a window of records is put into the order of the bins in memory and
 * written with one large write; a bin is read back from its place in each of those runs. */
#include "segment/segment.h"

#include <string.h>

/* Keys that a thread takes at once. */
#define GRAIN 65536u

/* ---- counting sort ---- */

typedef struct deal {
    const uint32_t *keys;
    uint32_t bin_count;
    uint32_t *rows; /* [pieces][bin_count] counts, then next places */
    uint32_t *places;
} deal;

static tl_status count_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const deal *d = arg;
    uint32_t *row = d->rows + begin / GRAIN * d->bin_count;
    (void)worker;
    for (size_t i = begin; i < end; i++) row[d->keys[i]]++;
    return TL_OK;
}

static tl_status place_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const deal *d = arg;
    uint32_t *row = d->rows + begin / GRAIN * d->bin_count;
    (void)worker;
    for (size_t i = begin; i < end; i++) d->places[i] = row[d->keys[i]]++;
    return TL_OK;
}

tl_status tli_deal(tl_ctx *ctx, const uint32_t *keys, size_t count, uint32_t bin_count,
                   uint32_t *begins, uint32_t *places)
{
    tl_status st = TL_OK;
    size_t pieces = count / GRAIN + 1;
    deal d = {keys, bin_count, NULL, places};
    d.rows = tl_mem_zalloc(ctx, pieces, bin_count * sizeof *d.rows, &st);
    if (!st) st = tli_parallel(ctx, count, GRAIN, count_piece, &d);
    uint32_t sum = 0;
    for (uint32_t bin = 0; !st && bin < bin_count; bin++) {
        begins[bin] = sum;
        for (size_t p = 0; p < pieces; p++) {
            uint32_t here = d.rows[p * bin_count + bin];
            d.rows[p * bin_count + bin] = sum;
            sum += here;
        }
    }
    begins[bin_count] = sum;
    if (!st) st = tli_parallel(ctx, count, GRAIN, place_piece, &d);
    tl_mem_free(ctx, d.rows);
    return st;
}

void tli_deal_alone(const uint32_t *keys, size_t count, uint32_t bin_count, uint32_t *begins,
                    uint32_t *places)
{
    memset(begins, 0, ((size_t)bin_count + 1) * sizeof *begins);
    for (size_t i = 0; i < count; i++) begins[keys[i] + 1]++;
    for (uint32_t bin = 0; bin < bin_count; bin++) begins[bin + 1] += begins[bin];
    for (size_t i = 0; i < count; i++) places[i] = begins[keys[i]]++;
    memmove(begins + 1, begins, (size_t)bin_count * sizeof *begins);
    begins[0] = 0;
}

/* ---- bins ---- */

tl_status tli_bins_open(tl_ctx *ctx, const char *folder, size_t record_bytes, uint32_t bin_count,
                        tli_bins *bins)
{
    *bins = (tli_bins){.ctx = ctx, .record_bytes = record_bytes, .bin_count = bin_count};
    tl_status st = TL_OK;
    bins->counts = tl_mem_zalloc(ctx, bin_count, sizeof *bins->counts, &st);
    return st ? st : tli_scratch_open(ctx, folder, &bins->file);
}

tl_status tli_bins_add(tli_bins *bins, const void *records, const uint32_t *begins)
{
    tl_ctx *ctx = bins->ctx;
    tl_status st = TL_OK;
    size_t count = begins[bins->bin_count];
    if (!count) return TL_OK;
    if (bins->run_count == bins->run_room) {
        size_t room = bins->run_room ? 2 * bins->run_room : 16;
        bins->runs = tl_mem_resize(ctx, bins->runs, room, sizeof *bins->runs, &st);
        if (st) return st;
        bins->run_room = room;
    }
    tli_run run = {tli_scratch_bytes(bins->file), NULL};
    size_t begin_bytes = ((size_t)bins->bin_count + 1) * sizeof *begins;
    run.begins = tl_mem_alloc(ctx, begin_bytes, 1, &st);
    if (st) return st;
    memcpy(run.begins, begins, begin_bytes);
    bins->runs[bins->run_count++] = run;
    for (uint32_t bin = 0; bin < bins->bin_count; bin++)
        bins->counts[bin] += begins[bin + 1] - begins[bin];
    return tli_scratch_write(ctx, bins->file, run.ofs, records, count * bins->record_bytes);
}

tl_status tli_bins_read(tl_ctx *ctx, const tli_bins *bins, uint32_t bin, void *records)
{
    tl_status st = TL_OK;
    uint8_t *to = records;
    for (size_t r = 0; !st && r < bins->run_count; r++) {
        const tli_run *run = &bins->runs[r];
        uint64_t ofs = run->ofs + (uint64_t)run->begins[bin] * bins->record_bytes;
        size_t bytes = (run->begins[bin + 1] - run->begins[bin]) * bins->record_bytes;
        if (!bytes) continue;
        st = tli_scratch_read(ctx, bins->file, ofs, to, bytes);
        to += bytes;
    }
    return st;
}

void tli_bins_close(tli_bins *bins)
{
    if (!bins->ctx) return;
    for (size_t r = 0; r < bins->run_count; r++) tl_mem_free(bins->ctx, bins->runs[r].begins);
    tl_mem_free(bins->ctx, bins->runs);
    tl_mem_free(bins->ctx, bins->counts);
    tli_scratch_close(bins->file);
    *bins = (tli_bins){0};
}
