/* Adds channels to a file, or takes its topology over into a new one: the graph and all blobs stay
 * as they are, blobs and errors of the new channels stand beside them. The new file is laid out as
 * if it had been built with them, so that a refinement is still one range. */
#include "store/store_write.h"

typedef struct append_task {
    tl_ctx *ctx;
    const tl_store *store;
    tli_store_writer *writer;
    const tli_store_added *added;
    uint32_t old_count, new_count;  /* channels */
    tli_blob *blobs;                /* [new_count] */
    float *ranges;                  /* [new_count][2] */
    double *square_error;           /* [new_count] */
    double *max_error;              /* [new_count] */
    float *field_bins, *space_bins; /* [new_count][TL_BINS] */
} append_task;

/* ---- patches ---- */

static tl_status copy_blobs(append_task *task, uint32_t id, const tl_patch_info *info)
{
    tl_patch_info merged = *info;
    tli_twin *twins = NULL;
    uint8_t *topology = NULL;
    size_t twin_count = 0, topology_bytes = 0;
    tl_status st = tli_store_twins(task->ctx, task->store, id, &twins, &twin_count);
    if (!st)
        st = tl_store_blob(task->ctx, task->store, id, TL_TOPOLOGY, &topology, &topology_bytes);
    merged.ranges = task->ranges;
    merged.square_error = task->square_error;
    if (!st)
        st = tli_store_add_patch(task->writer, &merged, (tli_blob){topology, topology_bytes},
                                 task->blobs, twins, twin_count);
    tl_mem_free(task->ctx, topology);
    tl_mem_free(task->ctx, twins);
    return st;
}

static tl_status append_patch(append_task *task, uint32_t id)
{
    const uint32_t old = task->old_count;
    tl_patch_info info;
    tl_status st = tl_store_patch(task->ctx, task->store, id, &info);
    if (st) return st;
    memcpy(task->ranges, info.ranges, 2 * (size_t)old * sizeof *task->ranges);
    memcpy(task->square_error, info.square_error, (size_t)old * sizeof *task->square_error);
    for (uint32_t c = 0; c < task->new_count; c++) task->blobs[c] = (tli_blob){NULL, 0};
    for (uint32_t c = 0; !st && c < old; c++) {
        uint8_t *bytes = NULL;
        size_t byte_count = 0;
        st = tl_store_blob(task->ctx, task->store, id, c, &bytes, &byte_count);
        task->blobs[c] = (tli_blob){bytes, byte_count};
    }
    if (!st)
        st = task->added->patch(task->added->user, id, task->blobs + old,
                                task->ranges + 2 * (size_t)old, task->square_error + old);
    if (!st) st = copy_blobs(task, id, &info);
    for (uint32_t c = 0; c < old; c++)
        tl_mem_free(task->ctx, (void *)(uintptr_t)task->blobs[c].bytes);
    return st;
}

/* ---- segments ---- */

static tl_status append_segment(append_task *task, uint32_t id)
{
    const size_t old = task->old_count, old_bins = old * TL_BINS;
    tl_segment_info info;
    tl_status st = tl_store_segment(task->ctx, task->store, id, &info);
    for (uint32_t i = 0; !st && i < info.patch_count; i++)
        st = append_patch(task, info.first_patch + i);
    if (st) return st;
    memcpy(task->max_error, info.max_error, old * sizeof *task->max_error);
    memcpy(task->field_bins, info.field_bins, old_bins * sizeof *task->field_bins);
    memcpy(task->space_bins, info.space_bins, old_bins * sizeof *task->space_bins);
    st = task->added->segment(task->added->user, id, task->max_error + old,
                              task->field_bins + old_bins, task->space_bins + old_bins);
    if (task->added->place)
        task->added->place(task->added->user, id, info.sphere, &info.boundary_error);
    info.max_error = task->max_error;
    info.field_bins = task->field_bins;
    info.space_bins = task->space_bins;
    return st ? st : tli_store_add_segment(task->writer, &info);
}

/* ---- the file ---- */

static tl_status append_all(append_task *task)
{
    const tl_store_head *head = tl_store_get_head(task->store);
    tl_status st = TL_OK;
    for (uint32_t p = 0; !st && p < head->root_patch_count; p++) st = append_patch(task, p);
    for (uint32_t s = 0; !st && s < head->segment_count; s++) {
        st = tl_progress(task->ctx, "append", s, head->segment_count);
        if (!st) st = append_segment(task, s);
    }
    return st;
}

static tl_status make_room(append_task *task, tli_arena *arena)
{
    const size_t count = task->new_count;
    tl_status st = TL_OK;
    task->blobs = tli_arena_alloc(arena, count, sizeof *task->blobs, &st);
    task->ranges = tli_arena_alloc(arena, count, 2 * sizeof *task->ranges, &st);
    task->square_error = tli_arena_alloc(arena, count, sizeof *task->square_error, &st);
    task->max_error = tli_arena_alloc(arena, count, sizeof *task->max_error, &st);
    task->field_bins = tli_arena_alloc(arena, count, TL_BINS * sizeof *task->field_bins, &st);
    task->space_bins = tli_arena_alloc(arena, count, TL_BINS * sizeof *task->space_bins, &st);
    return st;
}

tl_status tli_store_append(tl_ctx *ctx, const tl_store *store, const char *path,
                           const tl_store_head *head, tli_blob codec, const tli_store_added *added)
{
    const tl_store_head *old = tl_store_get_head(store);
    append_task task = {.ctx = ctx,
                        .store = store,
                        .added = added,
                        .old_count = old->channel_count,
                        .new_count = head->channel_count};
    tli_arena arena;
    if (task.new_count < task.old_count || head->patch_count != old->patch_count ||
        head->segment_count != old->segment_count ||
        head->root_patch_count != old->root_patch_count)
        return tl_fail(ctx, TL_ERR_ARG, "'%s': channels can be added only to the same graph", path);
    tli_arena_open(ctx, &arena);
    tl_status st = make_room(&task, &arena);
    if (!st) st = tli_store_begin(ctx, path, head, codec, old->identity, &task.writer);
    if (!st) {
        st = append_all(&task);
        tl_status end = tli_store_finish(task.writer, head, !st);
        if (!st) st = end;
    }
    tli_arena_close(&arena);
    return st;
}
