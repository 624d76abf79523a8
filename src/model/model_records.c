/* Records of carried originals, from patches to patches, without ever being whole in memory. */
#include "model/model.h"

/* Records in memory at a time: of a stream, and of each patch that is written. */
enum { WINDOW = 4096, ROOM = 512 };

tl_status tli_records_read(tl_ctx *ctx, const tli_model *model, tli_depot *from,
                           const tli_segment_note *segment, int kind, tli_record_fn fn, void *user)
{
    tl_status st = TL_OK;
    size_t doubles = tli_record_doubles(model->plan, kind), number = 0;
    double *window = tl_mem_alloc(ctx, WINDOW * doubles, sizeof *window, &st);
    for (uint32_t i = 0; i < segment->input_count; i++) {
        const tli_extents *e = &model->patches[segment->inputs[i]].extents[kind];
        for (size_t j = 0; !st && j < e->count; j++)
            for (uint64_t at = 0; !st && at < e->items[j].count; at += WINDOW) {
                uint64_t left = e->items[j].count - at;
                size_t n = left < WINDOW ? (size_t)left : WINDOW;
                st = tli_depot_get(ctx, from, e->items[j].ofs + at * doubles * sizeof *window,
                                   window, n * doubles * sizeof *window);
                for (size_t r = 0; !st && r < n; r++)
                    st = fn(user, i, number++, window + r * doubles);
            }
    }
    tl_mem_free(ctx, window);
    return st;
}

tl_status tli_dealer_open(tl_ctx *ctx, const tli_model *model, tli_depot *to, tli_patch_note *notes,
                          size_t count, int kind, tli_dealer *dealer)
{
    tl_status st = TL_OK;
    size_t doubles = tli_record_doubles(model->plan, kind);
    *dealer = (tli_dealer){
        .ctx = ctx, .to = to, .notes = notes, .count = count, .doubles = doubles, .kind = kind};
    dealer->rooms = tl_mem_alloc(ctx, count * ROOM, doubles * sizeof *dealer->rooms, &st);
    dealer->filled = tl_mem_zalloc(ctx, count, sizeof *dealer->filled, &st);
    return st;
}

static tl_status flush(tli_dealer *d, size_t patch)
{
    uint64_t ofs;
    tl_status st = tli_depot_put(d->ctx, d->to, d->rooms + patch * ROOM * d->doubles,
                                 d->filled[patch] * d->doubles * sizeof *d->rooms, &ofs);
    if (!st) st = tli_extents_add(d->ctx, &d->notes[patch].extents[d->kind], ofs, d->filled[patch]);
    d->filled[patch] = 0;
    return st;
}

tl_status tli_dealer_add(tli_dealer *d, size_t patch, const double *record, tl_lidx tet)
{
    double *to = d->rooms + (patch * ROOM + d->filled[patch]) * d->doubles;
    memcpy(to, record, d->doubles * sizeof *to);
    tli_record_set_tet(to, d->doubles, tet);
    d->notes[patch].carried += d->kind == TLI_POINTS;
    return ++d->filled[patch] == ROOM ? flush(d, patch) : TL_OK;
}

tl_status tli_dealer_close(tli_dealer *d, tl_status st)
{
    for (size_t p = 0; !st && p < d->count; p++)
        if (d->filled[p]) st = flush(d, p);
    tl_mem_free(d->ctx, d->filled);
    tl_mem_free(d->ctx, d->rooms);
    return st;
}
