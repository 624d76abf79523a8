/* Linear probing at most half full; a key that goes closes the gap behind it, so that a table that
 * lives for days holds no graves. */
#include "cut/cut_keys.h"

static const size_t SLOTS_LEAST = 64;

static size_t hash(const int64_t part[3], uint32_t rest)
{
    uint64_t h = rest * UINT64_C(0x9e3779b97f4a7c15);
    for (int k = 0; k < 3; k++) {
        h = (h ^ (uint64_t)part[k]) * UINT64_C(0xff51afd7ed558ccd);
        h ^= h >> 32;
    }
    return (size_t)(h ^ (h >> 29));
}

static tl_status fill_slots(tli_keys *k, size_t slot_count)
{
    tl_status st = TL_OK;
    uint32_t *slots = tl_mem_alloc(k->ctx, slot_count, sizeof *slots, &st);
    if (st) return st;
    for (size_t i = 0; i < slot_count; i++) slots[i] = TL_NONE;
    tl_mem_free(k->ctx, k->slots);
    k->slots = slots;
    k->slot_mask = slot_count - 1;
    for (uint32_t n = 0; n < k->count; n++) {
        if (!k->keys[n].uses) continue;
        size_t at = hash(k->keys[n].part, k->keys[n].rest) & k->slot_mask;
        while (slots[at] != TL_NONE) at = (at + 1) & k->slot_mask;
        slots[at] = n;
    }
    return TL_OK;
}

tl_status tli_keys_open(tl_ctx *ctx, size_t expected, tli_keys *k)
{
    tl_status st = TL_OK;
    size_t slot_count = SLOTS_LEAST;
    while (slot_count < 2 * expected) slot_count *= 2;
    *k = (tli_keys){.ctx = ctx, .free_number = TL_NONE};
    k->capacity = (uint32_t)(expected < TL_NONE ? expected : TL_NONE);
    k->keys = tl_mem_alloc(ctx, k->capacity, sizeof *k->keys, &st);
    return st ? st : fill_slots(k, slot_count);
}

void tli_keys_close(tli_keys *k)
{
    if (!k->ctx) return;
    tl_mem_free(k->ctx, k->slots);
    tl_mem_free(k->ctx, k->keys);
    *k = (tli_keys){0};
}

static bool equal(const tli_key *key, const int64_t part[3], uint32_t rest)
{
    return key->part[0] == part[0] && key->part[1] == part[1] && key->part[2] == part[2] &&
           key->rest == rest;
}

/* The slot that holds the key, or the empty one where it would be. */
static size_t slot_of(const tli_keys *k, const int64_t part[3], uint32_t rest)
{
    size_t at = hash(part, rest) & k->slot_mask;
    while (k->slots[at] != TL_NONE && !equal(&k->keys[k->slots[at]], part, rest))
        at = (at + 1) & k->slot_mask;
    return at;
}

/* A number that is free. */
static tl_status new_number(tli_keys *k, uint32_t *number)
{
    tl_status st = TL_OK;
    if (k->free_number != TL_NONE) {
        *number = k->free_number;
        k->free_number = (uint32_t)k->keys[*number].part[0];
        return st;
    }
    if (k->count == k->capacity) {
        if (k->capacity > TL_NONE / 2)
            return tl_fail(k->ctx, TL_ERR_UNSUPPORTED, "more than %u shared vertices or faces",
                           k->capacity);
        uint32_t capacity = k->capacity < 32 ? 64 : 2 * k->capacity;
        k->keys = tl_mem_resize(k->ctx, k->keys, capacity, sizeof *k->keys, &st);
        if (st) return st;
        k->capacity = capacity;
    }
    *number = k->count++;
    return st;
}

tl_status tli_keys_take(tli_keys *k, const int64_t part[3], uint32_t rest, uint32_t *number)
{
    tl_status st = TL_OK;
    if (2 * (k->used + 1) > k->slot_mask + 1) st = fill_slots(k, 2 * (k->slot_mask + 1));
    if (st) return st;
    size_t at = slot_of(k, part, rest);
    if (k->slots[at] == TL_NONE) {
        st = new_number(k, number);
        if (st) return st;
        k->slots[at] = *number;
        k->keys[*number] = (tli_key){{part[0], part[1], part[2]}, rest, 0};
        k->used++;
    }
    *number = k->slots[at];
    k->keys[*number].uses++;
    return TL_OK;
}

uint32_t tli_keys_find(const tli_keys *k, const int64_t part[3], uint32_t rest)
{
    return k->slots[slot_of(k, part, rest)];
}

bool tli_keys_drop(tli_keys *k, uint32_t number)
{
    tli_key *key = &k->keys[number];
    TL_ASSERT(key->uses);
    if (--key->uses) return false;
    size_t hole = slot_of(k, key->part, key->rest);
    for (size_t at = (hole + 1) & k->slot_mask; k->slots[at] != TL_NONE;
         at = (at + 1) & k->slot_mask) {
        const tli_key *other = &k->keys[k->slots[at]];
        size_t home = hash(other->part, other->rest) & k->slot_mask;
        /* it may move back to the hole unless its home lies behind that */
        if (((at - home) & k->slot_mask) < ((at - hole) & k->slot_mask)) continue;
        k->slots[hole] = k->slots[at];
        hole = at;
    }
    k->slots[hole] = TL_NONE;
    key->part[0] = k->free_number;
    k->free_number = number;
    k->used--;
    return true;
}
