/* Numbers in windows: the last one in memory, those before in a working file. */
#include "model/model_tape.h"

tl_status tli_tape_open(tl_ctx *ctx, tli_depot *depot, tli_tape *tape)
{
    tl_status st = TL_OK;
    *tape = (tli_tape){.ctx = ctx, .depot = depot};
    tape->window = tl_mem_zalloc(ctx, TLI_TAPE_WINDOW, sizeof *tape->window, &st);
    return st;
}

void tli_tape_close(tli_tape *tape)
{
    if (!tape->ctx) return;
    tl_mem_free(tape->ctx, tape->places);
    tl_mem_free(tape->ctx, tape->window);
    *tape = (tli_tape){0};
}

static tl_status flush(tli_tape *t)
{
    tl_status st = TL_OK;
    if (t->place_count == t->place_room) {
        size_t room = t->place_room ? 2 * t->place_room : 16;
        t->places = tl_mem_resize(t->ctx, t->places, room, sizeof *t->places, &st);
        if (st) return st;
        t->place_room = room;
    }
    t->filled = 0;
    return tli_depot_put(t->ctx, t->depot, t->window, TLI_TAPE_WINDOW * sizeof *t->window,
                         &t->places[t->place_count++]);
}

tl_status tli_tape_write(tli_tape *t, uint32_t number)
{
    tl_status st = t->filled == TLI_TAPE_WINDOW ? flush(t) : TL_OK;
    if (!st) t->window[t->filled++] = number;
    return st;
}

tl_status tli_tape_rewind(tli_tape *t)
{
    t->at = t->filled;
    t->next_place = 0;
    /* a row of several windows is read from the file alone */
    if (t->place_count && t->filled) {
        tl_status st = flush(t);
        t->at = TLI_TAPE_WINDOW;
        return st;
    }
    t->at = t->place_count ? TLI_TAPE_WINDOW : 0;
    return TL_OK;
}

tl_status tli_tape_read(tli_tape *t, uint32_t *number)
{
    tl_status st = TL_OK;
    if (t->at == TLI_TAPE_WINDOW) {
        TL_ASSERT(t->next_place < t->place_count);
        st = tli_depot_get(t->ctx, t->depot, t->places[t->next_place++], t->window,
                           TLI_TAPE_WINDOW * sizeof *t->window);
        t->at = 0;
    }
    if (!st) *number = t->window[t->at++];
    return st;
}
