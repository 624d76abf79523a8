/* Records of an addition in bins that fit into memory: boxes on the way there, bins in the order of
 * their keys. */
#include "model/model_add_bins.h"

#include "base/base_sort.h"

enum {
    BOX_BYTES = 8 << 20, /* of records dealt at a time; a box has some at least */
    BOX_LEAST = 1024
};

/* ---- records on their way to bins ---- */

tl_status tli_outbox_open(tl_ctx *ctx, tli_bins *bins, tli_outbox *o)
{
    tl_status st = TL_OK;
    *o = (tli_outbox){.ctx = ctx, .bins = bins, .room = BOX_BYTES / bins->record_bytes};
    if (o->room < BOX_LEAST) o->room = BOX_LEAST;
    o->records = tl_mem_alloc(ctx, o->room, bins->record_bytes, &st);
    o->sorted = tl_mem_alloc(ctx, o->room, bins->record_bytes, &st);
    o->keys = tl_mem_alloc(ctx, o->room, sizeof *o->keys, &st);
    o->places = tl_mem_alloc(ctx, o->room, sizeof *o->places, &st);
    o->begins = tl_mem_alloc(ctx, (size_t)bins->bin_count + 1, sizeof *o->begins, &st);
    return st;
}

static tl_status flush(tli_outbox *o)
{
    const size_t bytes = o->bins->record_bytes;
    if (!o->count) return TL_OK;
    tli_deal_alone(o->keys, o->count, o->bins->bin_count, o->begins, o->places);
    for (size_t i = 0; i < o->count; i++)
        memcpy(o->sorted + o->places[i] * bytes, o->records + i * bytes, bytes);
    o->count = 0;
    return tli_bins_add(o->bins, o->sorted, o->begins);
}

void *tli_outbox_next(tli_outbox *o, uint32_t bin, tl_status *st)
{
    if (!*st && o->count == o->room) *st = flush(o);
    if (*st) return NULL;
    o->keys[o->count] = bin;
    return o->records + o->count++ * o->bins->record_bytes;
}

tl_status tli_outbox_close(tli_outbox *o, tl_status st)
{
    if (!st) st = flush(o);
    void *blocks[] = {o->begins, o->places, o->keys, o->sorted, o->records};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(o->ctx, blocks[i]);
    return st;
}

/* ---- bins ---- */

tl_status tli_bin_sort(tl_ctx *ctx, const tli_bins *bins, uint32_t bin, tli_sorted_bin *s)
{
    tl_status st = TL_OK;
    s->count = (size_t)bins->counts[bin];
    s->records = tl_mem_alloc(ctx, s->count, bins->record_bytes, &st);
    s->keys = tl_mem_alloc(ctx, s->count, sizeof *s->keys, &st);
    s->order = tl_mem_alloc(ctx, s->count, sizeof *s->order, &st);
    if (!st) st = tli_bins_read(ctx, bins, bin, s->records);
    for (size_t i = 0; !st && i < s->count; i++) {
        memcpy(&s->keys[i], s->records + i * bins->record_bytes, sizeof *s->keys);
        s->order[i] = (uint32_t)i;
    }
    return st ? st : tli_sort_u64(ctx, s->keys, s->order, s->count);
}

void tli_bin_release(tl_ctx *ctx, tli_sorted_bin *s)
{
    tl_mem_free(ctx, s->order);
    tl_mem_free(ctx, s->keys);
    tl_mem_free(ctx, s->records);
}
