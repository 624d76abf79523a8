/* Memory for stars: each worker has a bank of its own, so that no lock is needed. */
#include <string.h>

#include "simplify/simplify_work.h"

enum { CHUNK = 65536 };

static uint32_t *take_room(tli_star_bank *bank, uint32_t capacity, tl_status *st)
{
    size_t list = capacity / TLI_BANK_STEP;
    if (list < TLI_BANK_CLASSES && bank->free_lists[list]) {
        uint32_t *room = bank->free_lists[list];
        memcpy(&bank->free_lists[list], room, sizeof bank->free_lists[list]);
        return room;
    }
    if (bank->room_count < capacity) {
        bank->room = tli_arena_alloc(&bank->arena, CHUNK, sizeof *bank->room, st);
        bank->room_count = *st ? 0 : CHUNK;
        if (*st) return NULL;
    }
    uint32_t *room = bank->room;
    bank->room += capacity;
    bank->room_count -= capacity;
    return room;
}

void tli_star_release(tli_star_bank *bank, tli_star *star)
{
    size_t list = star->capacity / TLI_BANK_STEP;
    if (list >= 1 && list < TLI_BANK_CLASSES && ((uintptr_t)star->tets & 7) == 0) {
        memcpy(star->tets, &bank->free_lists[list], sizeof(uint32_t *));
        bank->free_lists[list] = star->tets;
    }
    *star = (tli_star){0};
}

tl_status tli_star_reserve(tli_star_bank *bank, tli_star *star, uint32_t count)
{
    tl_status st = TL_OK;
    if (count <= star->capacity) return TL_OK;
    uint32_t capacity = (count + TLI_BANK_STEP - 1) / TLI_BANK_STEP * TLI_BANK_STEP;
    uint32_t *room = take_room(bank, capacity, &st);
    if (st) return st;
    tli_star old = *star;
    memcpy(room, old.tets, old.count * sizeof *room);
    tli_star_release(bank, star);
    *star = (tli_star){room, old.count, capacity};
    return TL_OK;
}
