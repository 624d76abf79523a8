/* Proves a whole file. What a page says of itself is proved whenever it is read; here come the sums
 * over all pages, the graph across them, and (full) every blob. */
#include "store/store_check.h"

#define STAGE "check"
/* Groups of patches that are looked at, by all threads, between two reports. */
#define REPORT_GROUPS ((size_t)64)
/* Root patches that are looked at together. */
#define ROOT_GROUP 64u

/* Counts that the head must agree with. */
typedef struct check_sums {
    uint64_t level_patches[TL_STORE_LEVELS_MAX], level_tets[TL_STORE_LEVELS_MAX];
    uint64_t topology_bytes;
    uint64_t outputs, produced; /* entries in outputs; patches with a producer */
} check_sums;

static tl_status fail_at(tl_ctx *ctx, const tl_store *store, const char *what, uint32_t id,
                         const char *wrong)
{
    return tl_fail(ctx, TL_ERR_DATA, "'%s': %s %u %s", store->reader.path, what, id, wrong);
}

/* ---- the file ---- */

/* Between the first page and the first blob. */
static tl_status check_padding(tl_ctx *ctx, const tl_store *store)
{
    uint8_t bytes[4096];
    uint64_t ofs = store->pages[0].page_ofs + store->pages[0].page_bytes;
    const uint64_t end = store->pages[0].payload_ofs;
    tl_status st = TL_OK;
    while (!st && ofs < end) {
        size_t piece = end - ofs < sizeof bytes ? (size_t)(end - ofs) : sizeof bytes;
        st = tli_store_read(ctx, store, ofs, bytes, piece);
        for (size_t i = 0; !st && i < piece; i++)
            if (bytes[i])
                st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': byte %llu, padding, is not zero",
                             store->reader.path, (unsigned long long)(ofs + i));
        ofs += piece;
    }
    return st;
}

/* Bytes on disk now; a file that grew behind its end while it was open is found, too. */
static tl_status check_size(tl_ctx *ctx, const tl_store *store)
{
    tli_pread now;
    if (store->reader.fd < 0) return TL_OK;
    tl_status st = tli_pread_open(ctx, store->reader.path, &now);
    if (st) return st;
    if (now.byte_count != store->head.file_bytes)
        st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': has %llu bytes now, its head says %llu",
                     store->reader.path, (unsigned long long)now.byte_count,
                     (unsigned long long)store->head.file_bytes);
    tli_pread_close(ctx, &now);
    return st;
}

/* ---- the graph ---- */

/* Every component of the error of a is at least that of b. */
static bool is_saturated(const tl_segment_info *a, const tl_segment_info *b, size_t channels)
{
    if (!(a->boundary_error >= b->boundary_error)) return false;
    for (size_t c = 0; c < channels; c++)
        if (!(a->max_error[c] >= b->max_error[c])) return false;
    for (size_t i = 0; i < channels * TL_BINS; i++)
        if (!(a->field_bins[i] >= b->field_bins[i]) || !(a->space_bins[i] >= b->space_bins[i]))
            return false;
    return true;
}

static tl_status check_segment(tl_ctx *ctx, const tl_store *store, uint32_t id, check_sums *sums)
{
    tl_segment_info info;
    uint64_t tets = 0, carried_out = 0, carried_in = 0;
    tl_status st = tl_store_segment(ctx, store, id, &info);
    for (uint32_t i = 0; !st && i < info.output_count; i++) {
        tl_patch_info output;
        st = tl_store_patch(ctx, store, info.outputs[i], &output);
        if (st) break;
        if (output.producer != id)
            return fail_at(ctx, store, "segment", id, "has an output with another producer");
        tets += output.tet_count;
        carried_out += output.carried;
    }
    for (uint32_t i = 0; !st && i < info.patch_count; i++) {
        tl_patch_info input;
        st = tl_store_patch(ctx, store, info.first_patch + i, &input);
        if (!st) carried_in += input.carried;
    }
    if (st) return st;
    if (tets != info.output_tets)
        return fail_at(ctx, store, "segment", id, "has outputs with another number of tets");
    if (carried_in != carried_out)
        return fail_at(ctx, store, "segment", id, "does not hand on all vertices that it took up");
    sums->outputs += info.output_count;
    return TL_OK;
}

static tl_status check_patch(tl_ctx *ctx, const tl_store *store, uint32_t id, check_sums *sums,
                             uint64_t *channel_bytes)
{
    tl_patch_info info;
    tl_segment_info fine, coarse;
    const uint32_t channels = store->head.channel_count;
    tl_status st = tl_store_patch(ctx, store, id, &info);
    if (st) return st;
    sums->level_patches[info.level]++;
    sums->level_tets[info.level] += info.tet_count;
    sums->topology_bytes += info.topology_bytes;
    for (uint32_t c = 0; c < channels; c++) channel_bytes[c] += info.channel_bytes[c];
    if (info.producer == TL_NONE) return TL_OK;
    sums->produced++;
    if (info.consumer == TL_NONE) return TL_OK;
    st = tl_store_segment(ctx, store, info.producer, &fine);
    if (!st) st = tl_store_segment(ctx, store, info.consumer, &coarse);
    if (!st && !is_saturated(&coarse, &fine, channels))
        st = fail_at(ctx, store, "patch", id,
                     "has a consumer with a smaller error than its producer");
    return st;
}

static tl_status check_sums_agree(tl_ctx *ctx, const tl_store *store, const check_sums *sums,
                                  const uint64_t *channel_bytes)
{
    const tl_store_head *head = &store->head;
    for (uint32_t l = 0; l < head->level_count; l++)
        if (sums->level_patches[l] != head->levels[l].patch_count ||
            sums->level_tets[l] != head->levels[l].tets)
            return fail_at(ctx, store, "level", l,
                           "has another number of patches or tets than the head says");
    for (uint32_t c = 0; c < head->channel_count; c++)
        if (channel_bytes[c] != head->channels[c].bytes)
            return fail_at(ctx, store, "channel", c,
                           "has another number of bytes than the head says");
    if (sums->topology_bytes != head->topology_bytes)
        return tl_fail(ctx, TL_ERR_DATA, "'%s': its topology has %llu bytes, its head says %llu",
                       store->reader.path, (unsigned long long)sums->topology_bytes,
                       (unsigned long long)head->topology_bytes);
    /* outputs are ascending and have the right producer: with equal counts each is there once */
    if (sums->outputs != sums->produced)
        return tl_fail(ctx, TL_ERR_DATA, "'%s': %llu patches have a producer, %llu are outputs",
                       store->reader.path, (unsigned long long)sums->produced,
                       (unsigned long long)sums->outputs);
    return TL_OK;
}

static tl_status check_index(tl_ctx *ctx, const tl_store *store)
{
    const tl_store_head *head = &store->head;
    check_sums sums = {0};
    tl_status st = TL_OK;
    uint64_t *channel_bytes = tl_mem_zalloc(ctx, head->channel_count, sizeof *channel_bytes, &st);
    for (uint32_t s = 0; !st && s < head->segment_count; s++)
        st = check_segment(ctx, store, s, &sums);
    for (uint32_t p = 0; !st && p < head->patch_count; p++)
        st = check_patch(ctx, store, p, &sums, channel_bytes);
    if (!st) st = check_sums_agree(ctx, store, &sums, channel_bytes);
    tl_mem_free(ctx, channel_bytes);
    return st;
}

/* ---- the blobs ---- */

/* Groups of patches: the roots in pieces, then the inputs of each segment. */
typedef struct blob_task {
    tl_ctx *ctx;
    const tl_store *store;
    size_t root_groups, first; /* first: group of the first item */
} blob_task;

static tl_status group_of(tl_ctx *ctx, const blob_task *task, size_t group, uint32_t *first,
                          uint32_t *count)
{
    const uint32_t roots = task->store->head.root_patch_count;
    tl_segment_info info;
    if (group < task->root_groups) {
        *first = (uint32_t)(group * ROOT_GROUP);
        *count = roots - *first < ROOT_GROUP ? roots - *first : ROOT_GROUP;
        return TL_OK;
    }
    tl_status st = tl_store_segment(ctx, task->store, (uint32_t)(group - task->root_groups), &info);
    if (st) return st;
    *first = info.first_patch;
    *count = info.patch_count;
    return TL_OK;
}

static tl_status check_groups(void *arg, size_t begin, size_t end, unsigned worker)
{
    const blob_task *task = arg;
    tl_ctx *fork = NULL;
    tl_status st = tli_ctx_fork(task->ctx, &fork);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        uint32_t first = 0, count = 0;
        st = group_of(fork, task, task->first + i, &first, &count);
        if (!st) st = tli_store_check_group(fork, task->store, first, count);
    }
    return tli_ctx_join(task->ctx, fork, st);
}

static tl_status check_blobs(tl_ctx *ctx, const tl_store *store)
{
    const tl_store_head *head = &store->head;
    blob_task task = {.ctx = ctx, .store = store};
    task.root_groups = (head->root_patch_count + (size_t)ROOT_GROUP - 1) / ROOT_GROUP;
    const size_t groups = task.root_groups + head->segment_count;
    tl_status st = TL_OK;
    for (; !st && task.first < groups; task.first += REPORT_GROUPS) {
        const size_t left = groups - task.first;
        st = tl_progress(ctx, STAGE, task.first, groups);
        if (!st)
            st = tli_parallel(ctx, left < REPORT_GROUPS ? left : REPORT_GROUPS, 1, check_groups,
                              &task);
    }
    return st ? st : tl_progress(ctx, STAGE, groups, groups);
}

tl_status tl_store_check(tl_ctx *ctx, const tl_store *store, tl_check_level level)
{
    tl_status st = check_size(ctx, store);
    if (!st) st = check_padding(ctx, store);
    if (!st) st = check_index(ctx, store);
    if (!st && level == TL_CHECK_FULL) st = check_blobs(ctx, store);
    return st;
}
