/* A page of the index from bytes, proved before any of it is used: the checksum, counts against
 * bytes, numbers of segments and patches, levels that only rise towards the coarse side (so that no
 * path leads back), and blobs that fill the page's payload without gap, so that none overlap. */
#include <math.h>

#include "mesh/mesh_tree.h" /* tli_float_above, tli_float_below */
#include "store/store_read.h"

/* A page while it is unpacked. */
typedef struct page_task {
    tl_ctx *ctx;
    const tl_store *store;
    uint32_t id;
    tli_store_page *page;
    uint32_t output_count, bin_bytes;
    uint32_t roots; /* patches without consumer, the first ones */
    const uint8_t *segments, *outputs, *bins, *bins_end, *patches; /* not yet taken */
} page_task;

static tl_status fail_page(const page_task *task, const char *what, uint32_t id, const char *wrong)
{
    return tl_fail(task->ctx, TL_ERR_FORMAT, "'%s': page %u of the index: %s %u has %s",
                   task->store->reader.path, task->id, what, id, wrong);
}

/* ---- counts ---- */

static tl_status take_counts(page_task *task, const uint8_t *bytes, size_t byte_count)
{
    const tl_store *store = task->store;
    const bool last = task->id + 1 == store->page_count;
    const tli_page_entry *entry = &store->pages[task->id];
    const uint32_t next_segment = last ? store->head.segment_count : entry[1].first_segment;
    const uint32_t next_patch = last ? store->head.patch_count : entry[1].first_patch;
    const uint64_t channels = store->head.channel_count;
    const uint8_t *at = bytes;
    const uint32_t segments = tli_take_u32(&at), patches = tli_take_u32(&at);
    task->output_count = tli_take_u32(&at);
    task->bin_bytes = tli_take_u32(&at);
    if (segments != next_segment - entry->first_segment ||
        patches != next_patch - entry->first_patch)
        return fail_page(task, "it, from patch", entry->first_patch,
                         "other counts than the page directory");
    const uint64_t segment_bytes =
        segments * (TLI_SEGMENT_BYTES + TLI_SEGMENT_EACH_BYTES * channels);
    const uint64_t output_bytes = (uint64_t)task->output_count * TLI_OUTPUT_BYTES;
    const uint64_t patch_bytes = patches * (TLI_PATCH_BYTES + TLI_PATCH_EACH_BYTES * channels);
    const uint64_t used =
        TLI_PAGE_HEAD_BYTES + segment_bytes + output_bytes + task->bin_bytes + patch_bytes;
    if (tli_store_align(used) != byte_count)
        return fail_page(task, "it, from patch", entry->first_patch,
                         "counts that its bytes do not bear");
    for (uint64_t i = used; i < byte_count; i++)
        if (bytes[i])
            return fail_page(task, "it, from patch", entry->first_patch,
                             "padding that is not zero");
    task->page->segment_count = segments;
    task->page->patch_count = patches;
    task->segments = at;
    task->outputs = task->segments + segment_bytes;
    task->bins = task->outputs + output_bytes;
    task->patches = task->bins_end = task->bins + task->bin_bytes;
    task->roots = 0;
    if (entry->first_patch < store->head.root_patch_count) {
        const uint32_t left = store->head.root_patch_count - entry->first_patch;
        task->roots = left < patches ? left : patches;
    }
    return TL_OK;
}

/* ---- segments ---- */

static bool take_bins(page_task *task, const float *table, float *bins)
{
    if (task->bins_end - task->bins < 2) return false;
    const unsigned first = task->bins[0], count = task->bins[1];
    const uint8_t *codes = task->bins + 2;
    if (first + count > TL_BINS || (!count && first) || task->bins_end - codes < (ptrdiff_t)count)
        return false;
    if (count && (!codes[0] || !codes[count - 1])) return false;
    memset(bins, 0, TL_BINS * sizeof *bins);
    for (unsigned i = 0; i < count; i++) bins[first + i] = table[codes[i]];
    task->bins = codes + count;
    return true;
}

static void take_sphere(const uint8_t **at, const tli_sphere_grid *grid, double sphere[4])
{
    uint32_t centre[3];
    for (int k = 0; k < 3; k++) centre[k] = tli_take_u32(at);
    tli_sphere_value(grid, centre, (unsigned)tli_take(at, 2), sphere);
}

/* Counts are proved by take_segments, outputs here. */
static tl_status take_outputs(page_task *task, uint32_t id, tl_segment_info *info,
                              uint32_t *outputs)
{
    for (uint32_t i = 0; i < info->output_count; i++) {
        outputs[i] = tli_take_u32(&task->outputs);
        if (outputs[i] >= info->first_patch)
            return fail_page(task, "segment", id, "an output that is not coarser than its inputs");
        if (i && outputs[i] <= outputs[i - 1])
            return fail_page(task, "segment", id, "outputs that are not ascending");
    }
    info->outputs = outputs;
    return TL_OK;
}

static tl_status take_segment(page_task *task, uint32_t id, tl_segment_info *info,
                              double *max_error, float *bins)
{
    const tl_store *store = task->store;
    const size_t channels = store->head.channel_count;
    const uint8_t **at = &task->segments;
    info->level = tli_store_level_of(store, id);
    info->patch_count = tli_take_u32(at);
    info->output_count = tli_take_u32(at);
    info->output_tets = tli_take(at, 8);
    take_sphere(at, &store->spheres, info->sphere);
    info->boundary_error = tli_code16_value((unsigned)tli_take(at, 2), store->spheres.unit);
    info->max_error = max_error;
    info->field_bins = bins;
    info->space_bins = bins + channels * TL_BINS;
    const float *space_table = store->error_tables + channels * TLI_CODE8_COUNT;
    for (size_t c = 0; c < channels; c++) {
        max_error[c] = tli_code16_value((unsigned)tli_take(at, 2), store->codes[c].error_unit);
        if (!take_bins(task, store->error_tables + c * TLI_CODE8_COUNT, bins + c * TL_BINS) ||
            !take_bins(task, space_table, bins + (channels + c) * TL_BINS))
            return fail_page(task, "segment", id, "histograms that are none");
    }
    return TL_OK;
}

static tl_status take_segments(page_task *task)
{
    tli_store_page *page = task->page;
    const tl_store *store = task->store;
    const size_t channels = store->head.channel_count, count = page->segment_count;
    uint32_t id = store->pages[task->id].first_segment, left = task->output_count;
    uint32_t patch = store->pages[task->id].first_patch + task->roots;
    uint32_t patches_left = page->patch_count - task->roots;
    tl_status st = TL_OK;
    page->segments = tli_arena_alloc(&page->arena, count, sizeof *page->segments, &st);
    double *errors = tli_arena_alloc(&page->arena, count * channels, sizeof *errors, &st);
    float *bins = tli_arena_alloc(&page->arena, count * channels * 2, TL_BINS * sizeof *bins, &st);
    uint32_t *outputs = tli_arena_alloc(&page->arena, left, sizeof *outputs, &st);
    for (size_t s = 0; !st && s < count; s++, id++) {
        tl_segment_info *info = &page->segments[s];
        st = take_segment(task, id, info, errors + s * channels, bins + s * channels * 2 * TL_BINS);
        if (st) break;
        if (!info->patch_count || info->patch_count > patches_left || !info->output_count ||
            info->output_count > left)
            return fail_page(task, "segment", id, "no or too many inputs or outputs");
        info->first_patch = patch;
        patch += info->patch_count;
        patches_left -= info->patch_count;
        st = take_outputs(task, id, info, outputs);
        outputs += info->output_count;
        left -= info->output_count;
    }
    if (!st && (left || patches_left || task->bins != task->bins_end))
        return fail_page(task, "it, before segment", id, "outputs, patches or bins left over");
    return st;
}

/* ---- patches ---- */

static tl_status check_patch(const page_task *task, uint32_t id, const tl_patch_info *info,
                             unsigned flags)
{
    const tl_store *store = task->store;
    if (info->producer != TL_NONE) {
        if (info->producer >= store->head.segment_count ||
            (info->consumer != TL_NONE && info->producer <= info->consumer) ||
            tli_store_level_of(store, info->producer) >= info->level)
            return fail_page(task, "patch", id, "a producer that is not finer");
    }
    if (info->level >= store->head.level_count ||
        (info->consumer != TL_NONE && tli_store_level_of(store, info->consumer) != info->level))
        return fail_page(task, "patch", id, "another level than its consumer");
    if (flags & ~TLI_PATCH_HAS_TWINS)
        return fail_page(task, "patch", id, "flags that version 1 does not know");
    if (!info->vert_count || !info->tet_count || info->tet_count > TL_PATCH_TETS_MAX)
        return fail_page(task, "patch", id, "too few or too many tets or vertices");
    if (info->topology_bytes > TLI_STORE_BLOB_BYTES_MAX)
        return fail_page(task, "patch", id, "a blob that is too large");
    return TL_OK;
}

static tl_status take_patch(page_task *task, uint32_t id, uint32_t consumer, tl_patch_info *info,
                            uint8_t *has_twins)
{
    const tl_store *store = task->store;
    const uint8_t **at = &task->patches;
    float *ranges = (float *)(uintptr_t)info->ranges; /* this page's own, still being filled */
    double *squares = (double *)(uintptr_t)info->square_error;
    uint32_t *channel_bytes = (uint32_t *)(uintptr_t)info->channel_bytes;
    info->consumer = consumer;
    info->producer = tli_take_u32(at);
    info->topology_bytes = tli_take_u32(at);
    info->carried = tli_take(at, 8);
    info->tet_count = tli_take_u32(at);
    info->vert_count = (uint32_t)tli_take(at, 2);
    info->class_ = (uint32_t)tli_take(at, 1);
    info->level = (uint32_t)tli_take(at, 1);
    take_sphere(at, &store->spheres, info->sphere);
    const unsigned flags = (unsigned)tli_take(at, 2);
    *has_twins = flags & TLI_PATCH_HAS_TWINS;
    for (uint32_t c = 0; c < store->head.channel_count; c++) {
        const tli_channel_codes *codes = &store->codes[c];
        channel_bytes[c] = tli_take_u32(at);
        const unsigned low = (unsigned)tli_take(at, 2), high = (unsigned)tli_take(at, 2);
        const bool empty = low == 0xffff && high == 0;
        const double from = tli_range_value(&codes->range, low);
        const double to = tli_range_value(&codes->range, high);
        const double root =
            tli_code16_value((unsigned)tli_take(at, 2), codes->error_unit + TLI_SQUARE_EXPONENT);
        ranges[2 * c] = empty ? NAN : tli_float_below(from);
        ranges[2 * c + 1] = empty ? NAN : tli_float_above(to);
        squares[c] = root * root;
        if (!empty && !(ranges[2 * c] <= ranges[2 * c + 1]))
            return fail_page(task, "patch", id, "a range that is none");
        if (channel_bytes[c] > TLI_STORE_BLOB_BYTES_MAX)
            return fail_page(task, "patch", id, "a blob that is too large");
    }
    return check_patch(task, id, info, flags);
}

/* Blobs of a group follow one another: topologies, then channel by channel. */
static void place_blobs(const page_task *task, uint32_t first, uint32_t count, uint64_t *ofs)
{
    for (uint32_t i = 0; i < count; i++) {
        tl_patch_info *info = &task->page->patches[first + i];
        info->topology_ofs = *ofs;
        *ofs += tli_store_blob_bytes(info->topology_bytes);
    }
    for (uint32_t c = 0; c < task->store->head.channel_count; c++)
        for (uint32_t i = 0; i < count; i++) {
            const tl_patch_info *info = &task->page->patches[first + i];
            uint64_t *channel_ofs = (uint64_t *)(uintptr_t)info->channel_ofs;
            channel_ofs[c] = *ofs;
            *ofs += tli_store_blob_bytes(info->channel_bytes[c]);
        }
}

static tl_status take_group(page_task *task, uint32_t first, uint32_t count, uint32_t consumer,
                            uint64_t *ofs)
{
    tl_status st = TL_OK;
    const uint32_t first_id = task->store->pages[task->id].first_patch;
    for (uint32_t i = first; !st && i < first + count; i++)
        st = take_patch(task, first_id + i, consumer, &task->page->patches[i],
                        &task->page->has_twins[i]);
    if (!st) place_blobs(task, first, count, ofs);
    return st;
}

static tl_status make_patches(page_task *task)
{
    tli_store_page *page = task->page;
    const size_t channels = task->store->head.channel_count, count = page->patch_count;
    tl_status st = TL_OK;
    page->patches = tli_arena_alloc(&page->arena, count, sizeof *page->patches, &st);
    page->has_twins = tli_arena_alloc(&page->arena, count, 1, &st);
    float *ranges = tli_arena_alloc(&page->arena, count * channels, 2 * sizeof *ranges, &st);
    double *squares = tli_arena_alloc(&page->arena, count * channels, sizeof *squares, &st);
    uint64_t *ofs = tli_arena_alloc(&page->arena, count * channels, sizeof *ofs, &st);
    uint32_t *bytes = tli_arena_alloc(&page->arena, count * channels, sizeof *bytes, &st);
    for (size_t i = 0; !st && i < count; i++)
        page->patches[i] = (tl_patch_info){.ranges = ranges + 2 * i * channels,
                                           .square_error = squares + i * channels,
                                           .channel_ofs = ofs + i * channels,
                                           .channel_bytes = bytes + i * channels};
    return st;
}

static tl_status take_patches(page_task *task)
{
    const tl_store *store = task->store;
    tli_store_page *page = task->page;
    const tli_page_entry *entry = &store->pages[task->id];
    uint64_t ofs = entry->payload_ofs;
    uint32_t at = task->roots;
    tl_status st = make_patches(task);
    if (!st) st = take_group(task, 0, task->roots, TL_NONE, &ofs);
    for (uint32_t s = 0; !st && s < page->segment_count; s++) {
        tl_segment_info *segment = &page->segments[s];
        const uint32_t count = segment->patch_count;
        st = take_group(task, at, count, entry->first_segment + s, &ofs);
        segment->input_tets = 0;
        for (uint32_t i = at; !st && i < at + count; i++)
            segment->input_tets += page->patches[i].tet_count;
        at += count;
    }
    if (!st && ofs != tli_store_payload_end(store, task->id))
        st = fail_page(task, "it, from patch", entry->first_patch,
                       "blobs that do not fill its part of the file");
    return st;
}

/* ---- loading ---- */

static tl_status unpack(page_task *task, const uint8_t *bytes, size_t byte_count)
{
    const tl_store *store = task->store;
    const uint64_t seed = tli_store_seed(store->head.identity, TLI_PART_PAGE, task->id, 0);
    if (tli_store_hash(seed, bytes, byte_count) != store->pages[task->id].hash)
        return tl_fail(task->ctx, TL_ERR_FORMAT,
                       "'%s': page %u of the index, at byte %llu: its checksum is wrong: it is "
                       "damaged",
                       store->reader.path, task->id,
                       (unsigned long long)store->pages[task->id].page_ofs);
    tl_status st = take_counts(task, bytes, byte_count);
    if (!st) st = take_segments(task);
    if (!st) st = take_patches(task);
    return st;
}

static tl_status load_page(tl_ctx *ctx, const tl_store *store, uint32_t id, tli_store_page **page)
{
    const tli_page_entry *entry = &store->pages[id];
    tl_status st = TL_OK;
    tli_store_page *p = tl_mem_zalloc(ctx, 1, sizeof *p, &st);
    uint8_t *bytes = tl_mem_alloc(ctx, entry->page_bytes, 1, &st);
    if (!st) {
        page_task task = {.ctx = ctx, .store = store, .id = id, .page = p};
        p->ctx = tli_ctx_owner(ctx);
        tli_arena_open(ctx, &p->arena);
        st = tli_store_read(ctx, store, entry->page_ofs, bytes, entry->page_bytes);
        if (!st) st = unpack(&task, bytes, entry->page_bytes);
        p->arena.ctx = p->ctx;
        if (st) tli_arena_close(&p->arena);
    }
    tl_mem_free(ctx, bytes);
    if (st)
        tl_mem_free(ctx, p);
    else
        *page = p;
    return st;
}

void tli_store_page_release(tli_store_page *page)
{
    if (!page) return;
    tli_arena_close(&page->arena);
    tl_mem_free(page->ctx, page);
}

tl_status tli_store_page_get(tl_ctx *ctx, const tl_store *store, uint32_t page_id,
                             const tli_store_page **page)
{
    _Atomic(tli_store_page *) *slot = &store->kept->pages[page_id];
    tli_store_page *there = atomic_load_explicit(slot, memory_order_acquire);
    if (!there) {
        tli_store_page *made = NULL;
        tl_status st = load_page(ctx, store, page_id, &made);
        if (st) return st;
        if (atomic_compare_exchange_strong(slot, &there, made)) {
            there = made;
            atomic_fetch_add_explicit(&store->kept->pages_read, 1, memory_order_relaxed);
        } else {
            tli_store_page_release(made); /* another thread was first; both pages are the same */
        }
    }
    *page = there;
    return TL_OK;
}

/* ---- finding ---- */

/* The page that holds a patch, or a segment. */
static uint32_t find_page(const tl_store *store, uint32_t number, bool is_patch)
{
    uint32_t low = 0, high = store->page_count; /* the page is in [low, high) */
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        const tli_page_entry *page = &store->pages[middle];
        if ((is_patch ? page->first_patch : page->first_segment) <= number)
            low = middle;
        else
            high = middle;
    }
    return low;
}

uint32_t tli_store_page_of_patch(const tl_store *store, uint32_t patch)
{
    return find_page(store, patch, true);
}

uint32_t tli_store_page_of_segment(const tl_store *store, uint32_t segment)
{
    return find_page(store, segment, false);
}

static tl_status fail_number(tl_ctx *ctx, const tl_store *store, const char *what, uint32_t id,
                             uint32_t count)
{
    return tl_fail(ctx, TL_ERR_ARG, "'%s': there is no %s %u; there are %u", store->reader.path,
                   what, id, count);
}

tl_status tl_store_segment(tl_ctx *ctx, const tl_store *store, uint32_t segment,
                           tl_segment_info *info)
{
    const tli_store_page *page = NULL;
    if (segment >= store->head.segment_count)
        return fail_number(ctx, store, "segment", segment, store->head.segment_count);
    const uint32_t page_id = tli_store_page_of_segment(store, segment);
    tl_status st = tli_store_page_get(ctx, store, page_id, &page);
    if (!st) *info = page->segments[segment - store->pages[page_id].first_segment];
    return st;
}

tl_status tl_store_patch(tl_ctx *ctx, const tl_store *store, uint32_t patch, tl_patch_info *info)
{
    const tli_store_page *page = NULL;
    if (patch >= store->head.patch_count)
        return fail_number(ctx, store, "patch", patch, store->head.patch_count);
    const uint32_t page_id = tli_store_page_of_patch(store, patch);
    tl_status st = tli_store_page_get(ctx, store, page_id, &page);
    if (!st) *info = page->patches[patch - store->pages[page_id].first_patch];
    return st;
}
