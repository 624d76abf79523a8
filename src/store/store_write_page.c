/* A page of the index while it is filled: records of segments and patches in the short codes of the
 * format, kept apart by kind until the page is packed. */
#include <math.h>

#include "store/store_write.h"

uint64_t tli_page_bound(uint64_t segment_count, uint64_t patch_count, uint32_t channel_count)
{
    const uint64_t segment =
        TLI_SEGMENT_BYTES +
        (uint64_t)channel_count * (TLI_SEGMENT_EACH_BYTES + 2 * TLI_BINS_MOST_BYTES);
    const uint64_t patch =
        TLI_PATCH_BYTES + TLI_OUTPUT_BYTES + (uint64_t)channel_count * TLI_PATCH_EACH_BYTES;
    return segment_count * segment + patch_count * patch;
}

void tli_draft_open(tl_ctx *ctx, tli_page_draft *draft)
{
    tli_bytes_open(ctx, &draft->segments);
    tli_bytes_open(ctx, &draft->outputs);
    tli_bytes_open(ctx, &draft->bins);
    tli_bytes_open(ctx, &draft->patches);
}

void tli_draft_close(tli_page_draft *draft)
{
    tli_bytes_close(&draft->segments);
    tli_bytes_close(&draft->outputs);
    tli_bytes_close(&draft->bins);
    tli_bytes_close(&draft->patches);
}

static void put_sphere(uint8_t **at, const tli_sphere_grid *grid, const double sphere[4])
{
    uint32_t centre[3];
    unsigned radius;
    tli_sphere_codes(grid, sphere, centre, &radius);
    for (int k = 0; k < 3; k++) tli_put(at, centre[k], 4);
    tli_put(at, radius, 2);
}

/* ---- patches ---- */

tl_status tli_draft_patch(tli_store_writer *writer, const tl_patch_info *info, uint32_t flags,
                          uint32_t topology_bytes, const tli_blob *channels)
{
    tli_page_draft *draft = &writer->draft;
    const uint32_t channel_count = writer->head.channel_count;
    const size_t bytes = TLI_PATCH_BYTES + (size_t)channel_count * TLI_PATCH_EACH_BYTES;
    tl_status st = tli_bytes_reserve(&draft->patches, bytes);
    if (st) return st;
    uint8_t *at = draft->patches.bytes + draft->patches.count;
    tli_put(&at, info->producer, 4);
    tli_put(&at, topology_bytes, 4);
    tli_put(&at, info->carried, 8);
    tli_put(&at, info->tet_count, 4);
    tli_put(&at, info->vert_count, 2);
    tli_put(&at, info->class_, 1);
    tli_put(&at, info->level, 1);
    put_sphere(&at, &writer->spheres, info->sphere);
    tli_put(&at, flags, 2);
    for (uint32_t c = 0; c < channel_count; c++) {
        const tli_channel_codes *codes = &writer->codes[c];
        unsigned range[2];
        tli_range_codes(&codes->range, info->ranges + 2 * (size_t)c, range);
        tli_put(&at, channels[c].byte_count, 4);
        tli_put(&at, range[0], 2);
        tli_put(&at, range[1], 2);
        tli_put(&at, tli_square_above(info->square_error[c], codes->error_unit), 2);
    }
    draft->patches.count += bytes;
    draft->now.patch_bytes += bytes;
    draft->now.patch_count++;
    return TL_OK;
}

/* ---- segments ---- */

/* First bin that is not zero, how many follow up to the last one, their codes. */
static void put_bins(uint8_t **at, const double *table, const float *bins)
{
    uint8_t codes[TL_BINS];
    unsigned first = TL_BINS, last = 0;
    for (unsigned i = 0; i < TL_BINS; i++) {
        codes[i] = (uint8_t)tli_code8_above(table, (double)bins[i]);
        if (!codes[i]) continue;
        if (first == TL_BINS) first = i;
        last = i;
    }
    if (first == TL_BINS) {
        tli_put(at, 0, 2);
        return;
    }
    tli_put(at, first, 1);
    tli_put(at, last - first + 1, 1);
    memcpy(*at, codes + first, last - first + 1);
    *at += last - first + 1;
}

tl_status tli_draft_segment(tli_store_writer *writer, const tl_segment_info *info)
{
    tli_page_draft *draft = &writer->draft;
    const size_t channel_count = writer->head.channel_count;
    const size_t bytes = TLI_SEGMENT_BYTES + channel_count * TLI_SEGMENT_EACH_BYTES;
    const size_t output_bytes = (size_t)info->output_count * TLI_OUTPUT_BYTES;
    tl_status st = tli_bytes_reserve(&draft->segments, bytes);
    if (!st) st = tli_bytes_reserve(&draft->outputs, output_bytes);
    if (!st) st = tli_bytes_reserve(&draft->bins, channel_count * 2 * TLI_BINS_MOST_BYTES);
    if (st) return st;
    uint8_t *at = draft->segments.bytes + draft->segments.count;
    tli_put(&at, info->patch_count, 4);
    tli_put(&at, info->output_count, 4);
    tli_put(&at, info->output_tets, 8);
    put_sphere(&at, &writer->spheres, info->sphere);
    tli_put(&at, tli_code16_above(info->boundary_error, writer->spheres.unit), 2);
    for (size_t c = 0; c < channel_count; c++)
        tli_put(&at, tli_code16_above(info->max_error[c], writer->codes[c].error_unit), 2);
    uint8_t *output = draft->outputs.bytes + draft->outputs.count;
    for (uint32_t i = 0; i < info->output_count; i++) tli_put(&output, info->outputs[i], 4);
    uint8_t *bin = draft->bins.bytes + draft->bins.count, *bins_begin = bin;
    const double *space_table = writer->error_tables + channel_count * TLI_CODE8_COUNT;
    for (size_t c = 0; c < channel_count; c++) {
        put_bins(&bin, writer->error_tables + c * TLI_CODE8_COUNT, info->field_bins + c * TL_BINS);
        put_bins(&bin, space_table, info->space_bins + c * TL_BINS);
    }
    const size_t bin_bytes = (size_t)(bin - bins_begin);
    draft->segments.count += bytes;
    draft->outputs.count += output_bytes;
    draft->bins.count += bin_bytes;
    draft->now.segment_bytes += bytes;
    draft->now.output_bytes += output_bytes;
    draft->now.bin_bytes += bin_bytes;
    draft->now.segment_count++;
    draft->now.output_count += info->output_count;
    return TL_OK;
}

/* ---- packing ---- */

uint64_t tli_draft_bytes(const tli_page_mark *mark)
{
    return tli_store_align(TLI_PAGE_HEAD_BYTES + (uint64_t)mark->segment_bytes +
                           mark->output_bytes + mark->bin_bytes + mark->patch_bytes);
}

/* Moves the first bytes of a part to the page. */
static void move_part(uint8_t **at, tli_bytes *part, size_t byte_count)
{
    if (byte_count) memcpy(*at, part->bytes, byte_count);
    *at += byte_count;
    part->count -= byte_count;
    if (part->count) memmove(part->bytes, part->bytes + byte_count, part->count);
}

tl_status tli_draft_pack(tli_page_draft *draft, const tli_page_mark *mark, tli_bytes *page)
{
    const tli_page_mark m = *mark; /* may be one of the draft's own */
    const uint64_t bytes = tli_draft_bytes(&m);
    page->count = 0;
    tl_status st = tli_bytes_reserve(page, (size_t)bytes);
    if (st) return st;
    uint8_t *at = page->bytes;
    tli_put(&at, m.segment_count, 4);
    tli_put(&at, m.patch_count, 4);
    tli_put(&at, m.output_count, 4);
    tli_put(&at, m.bin_bytes, 4);
    move_part(&at, &draft->segments, m.segment_bytes);
    move_part(&at, &draft->outputs, m.output_bytes);
    move_part(&at, &draft->bins, m.bin_bytes);
    move_part(&at, &draft->patches, m.patch_bytes);
    const size_t used = (size_t)(at - page->bytes);
    memset(at, 0, (size_t)bytes - used);
    page->count = (size_t)bytes;
    draft->now.segment_bytes -= m.segment_bytes;
    draft->now.output_bytes -= m.output_bytes;
    draft->now.bin_bytes -= m.bin_bytes;
    draft->now.patch_bytes -= m.patch_bytes;
    draft->now.segment_count -= m.segment_count;
    draft->now.patch_count -= m.patch_count;
    draft->now.output_count -= m.output_count;
    draft->whole = (tli_page_mark){0};
    draft->payload_ofs = m.payload_end;
    draft->first_segment += m.segment_count;
    draft->first_patch += m.patch_count;
    return TL_OK;
}
