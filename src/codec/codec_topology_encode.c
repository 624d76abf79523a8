/* The topology of a patch to bytes. */
#include "codec/codec_kin.h"
#include "codec/codec_raw.h"
#include "codec/codec_tell.h"
#include "codec/codec_walk.h"

#include <string.h>

void tli_topology_head(const tl_patch *patch, uint8_t kind, uint8_t flags, uint32_t odd_count,
                       uint8_t head[TOPOLOGY_HEAD_BYTES])
{
    head[0] = kind;
    head[1] = flags;
    for (int i = 0; i < 2; i++) head[2 + i] = (uint8_t)(patch->vert_count >> 8 * i);
    for (int i = 0; i < 3; i++) {
        head[4 + i] = (uint8_t)(patch->tet_count >> 8 * i);
        head[7 + i] = (uint8_t)(odd_count >> 8 * i);
    }
}

static bool is_arranged(const tl_patch *patch, const tli_walk *walk)
{
    for (uint32_t v = 0; v < patch->vert_count; v++)
        if (walk->vert_old[v] != v) return false;
    for (uint32_t t = 0; t < patch->tet_count; t++)
        if (walk->tet_old[t] != t || walk->corners[t] != 0xe4) return false; /* 0, 1, 2, 3 */
    return true;
}

static void tell_odd_tets(const tl_patch *patch, uint32_t odd_count, tli_tokens *tokens)
{
    uint32_t bits = model_bits_for(patch->vert_count);
    for (uint32_t t = patch->tet_count - odd_count; t < patch->tet_count; t++)
        for (int c = 0; c < 4; c++) tokens_plain(tokens, patch->tets[t][c], bits);
}

static void tell_shared(const tl_patch *patch, const uint8_t *on_border, tli_tokens *tokens)
{
    uint32_t last[2] = {0, 0};
    for (uint32_t v = 0; v < patch->vert_count; v++) {
        uint32_t kind = on_border[v], shared = patch->shared[v];
        tokens_symbol(tokens, v & (TOPOLOGY_STATES - 1), ROW_SHARED + 2 * kind + last[kind],
                      shared);
        last[kind] = shared;
    }
}

static void tell_regions(const tl_patch *patch, tli_tokens *tokens)
{
    tli_regions regions = {{0}};
    for (uint32_t t = 0; t < patch->tet_count; t++) {
        uint32_t row, index = 0;
        int32_t region = patch->regions[t], guess = tli_region_guess(patch, t, &row);
        if (region == guess) {
            tokens_symbol(tokens, t & (TOPOLOGY_STATES - 1), ROW_REGION + row, 0);
            continue;
        }
        while (index < REGION_RECENT && regions.recent[index] != region) index++;
        tokens_symbol(tokens, t & (TOPOLOGY_STATES - 1), ROW_REGION + row, 1 + index);
        if (index == REGION_RECENT) tokens_plain(tokens, (uint32_t)region, 32);
        regions_use(&regions, index, region);
    }
}

/* ---- places ---- */

/* What a guess of another mode must save to be no accident. */
#define MODE_GAIN_BITS 9u

/* The common powers of two of the places beside that of vertex 0; true if there are any. */
static bool find_shifts(const tl_patch *patch, tli_shifts *shifts)
{
    uint64_t used[2][3] = {{0}};
    bool any = false;
    for (uint32_t v = 1; v < patch->vert_count; v++)
        for (int a = 0; a < 3; a++)
            used[patch->shared[v]][a] |=
                (uint64_t)patch->places[v][a] - (uint64_t)patch->places[0][a];
    for (int s = 0; s < 2; s++)
        for (int a = 0; a < 3; a++) {
            uint8_t shift = 0;
            while (used[s][a] && !(used[s][a] >> shift & 1)) shift++;
            shifts->by[s][a] = shift;
            any = any || shift > 0;
        }
    return any;
}

/* Where a place is beside a guess, in units of the patch. */
typedef struct offset {
    int64_t beside[3];
} offset;

/* The bits that the numbers of an offset take; from most on it is left unfinished. */
static uint32_t find_offset(const tl_patch *patch, const tli_shifts *shifts, uint32_t v,
                            const tli_guess *guess, uint32_t mode, uint32_t most, offset *o)
{
    const int64_t(*places)[3] = (const int64_t(*)[3])patch->places;
    uint32_t bits = 0;
    for (int a = 0; a < 3 && bits < most; a++) {
        uint32_t shift = shifts->by[patch->shared[v]][a];
        uint64_t base = (uint64_t)places[0][a];
        int64_t place = topology_shifted((int64_t)((uint64_t)places[v][a] - base), shift);
        int64_t expected =
            topology_shifted((int64_t)(kin_guess(guess, mode, places, a) - base), shift);
        int64_t beside = (int64_t)((uint64_t)place - (uint64_t)expected);
        o->beside[a] = beside;
        bits += model_length(beside < 0 ? 0 - (uint64_t)beside : (uint64_t)beside);
    }
    return bits;
}

/* The mode that leaves the least to say; others than 0 only where they are no accident. */
static uint32_t find_mode(const tl_patch *patch, const tli_shifts *shifts, uint32_t v,
                          const tli_guess *guess, offset *o)
{
    uint32_t best = 0, best_bits = find_offset(patch, shifts, v, guess, 0, UINT32_MAX, o);
    best_bits = best_bits > MODE_GAIN_BITS ? best_bits - MODE_GAIN_BITS : 0;
    for (uint32_t mode = 1; mode < GUESS_MODES && guess->has_elder && best_bits; mode++) {
        offset other;
        uint32_t bits = find_offset(patch, shifts, v, guess, mode, best_bits, &other);
        if (bits >= best_bits) continue;
        best_bits = bits;
        best = mode;
        *o = other;
    }
    return best;
}

static void tell_places(const tl_lattice *lattice, const tl_patch *patch, const tli_kin *kin,
                        const tli_shifts *shifts, bool shifted, tli_tokens *tokens)
{
    const int64_t(*places)[3] = (const int64_t(*)[3])patch->places;
    tli_scale scales[PLACE_GROUPS][3] = {{{0}}};
    uint32_t mode_before = 0;
    for (int i = 0; i < 6 && shifted; i++)
        tokens_plain(tokens, shifts->by[i / 3][i % 3], SHIFT_BITS);
    for (int a = 0; a < 3 && patch->vert_count > 0; a++)
        tokens_plain(tokens, (uint64_t)places[0][a], topology_place_bits(lattice));
    for (uint32_t v = 1; v < patch->vert_count; v++) {
        tli_guess guess;
        offset o;
        tli_kin_place(kin, v, places, &guess);
        uint32_t mode = find_mode(patch, shifts, v, &guess, &o);
        uint32_t group = mode ? PLACE_GROUPS - 1 : guess.group;
        if (guess.has_elder) {
            tokens_symbol(tokens, STATE_MODE, topology_mode_row(guess.kin_count, mode_before),
                          mode);
            mode_before = mode;
        }
        for (int a = 0; a < 3; a++) {
            uint32_t shift = shifts->by[patch->shared[v]][a];
            uint32_t around = guess.around[a] > shift ? guess.around[a] - shift : 0;
            tokens_number(tokens, (uint32_t)a, ROW_PLACE + group * NUMBER_ROWS, &scales[group][a],
                          around, o.beside[a]);
        }
    }
}

static tl_status check_places(tl_ctx *ctx, const tl_lattice *lattice, const tl_patch *patch)
{
    for (uint32_t v = 0; v < patch->vert_count; v++) {
        if (patch->shared[v] > 1)
            return tl_fail(ctx, TL_ERR_ARG, "vertex %u of a patch has the shared flag %u", v,
                           patch->shared[v]);
        for (int a = 0; a < 3; a++)
            if (topology_is_outside(lattice, patch->places[v][a]))
                return tl_fail(ctx, TL_ERR_ARG,
                               "vertex %u of a patch lies outside the lattice: %lld", v,
                               (long long)patch->places[v][a]);
    }
    return TL_OK;
}

/* ---- all of it ---- */

static tl_status tell_rest(tl_ctx *ctx, const tl_lattice *lattice, const tl_patch *patch,
                           const tli_walk *walk, tli_topology_tokens *out)
{
    tli_tokens *tokens = &out->tokens;
    tli_kin kin = {0};
    tli_shifts shifts = {{{0}}};
    bool shifted = find_shifts(patch, &shifts);
    tl_status st = tli_kin_open(ctx, patch, &kin);
    if (!st) {
        unsigned flags = (patch->regions ? TOPOLOGY_REGIONS : 0) |
                         (walk->rematch ? TOPOLOGY_REMATCH : 0) | (shifted ? TOPOLOGY_SHIFTED : 0);
        tli_topology_head(patch, BLOB_CODED, (uint8_t)flags, walk->odd_count, out->head);
        tell_odd_tets(patch, walk->odd_count, tokens);
        out->connectivity_end = tokens->count;
        tell_shared(patch, walk->on_border, tokens);
        out->flags_end = tokens->count;
        tell_places(lattice, patch, &kin, &shifts, shifted, tokens);
        out->places_end = tokens->count;
        if (patch->regions) tell_regions(patch, tokens);
        st = tokens->status;
    }
    tli_kin_close(ctx, &kin);
    return st;
}

tl_status tli_topology_tell(tl_ctx *ctx, const tl_lattice *lattice, const tl_patch *patch,
                            tli_topology_tokens *out)
{
    tli_walk walk = {0};
    tli_tokens_open(ctx, &out->tokens);
    tl_status st = tli_patch_verify(ctx, patch);
    if (!st) st = check_places(ctx, lattice, patch);
    if (!st && !patch->opposite)
        st = tl_fail(ctx, TL_ERR_ARG, "a patch without opposite faces: it is not arranged");
    if (!st) st = tli_walk_open(ctx, patch, &walk, &out->tokens);
    if (!st && !is_arranged(patch, &walk))
        st = tl_fail(ctx, TL_ERR_ARG, "a patch that is not in order of arrival");
    if (!st) st = tell_rest(ctx, lattice, patch, &walk, out);
    tli_walk_close(ctx, &walk);
    return st;
}

tl_status tli_topology_encode(tl_ctx *ctx, const tl_codec *codec, unsigned class_,
                              const tl_patch *patch, tli_bytes *out, tli_bits *bits)
{
    tli_topology_tokens told;
    size_t before = out->count;
    if (class_ == TL_CLASS_RAW) return tli_topology_encode_raw(ctx, patch, out);
    if (class_ >= TL_CLASS_COUNT || !codec)
        return tl_fail(ctx, TL_ERR_ARG, "there is no class %u of patches", class_);
    const tli_table *table = &codec->tables[class_];
    tl_status st = tli_topology_tell(ctx, &codec->lattice, patch, &told);
    if (!st) st = tli_bytes_append(out, told.head, sizeof told.head);
    size_t least = model_least_bytes(patch->tet_count);
    least = least > TOPOLOGY_HEAD_BYTES ? least - TOPOLOGY_HEAD_BYTES : 0;
    if (!st) st = tli_tokens_write(&told.tokens, table, TOPOLOGY_STATES, least, out);
    if (!st && bits) {
        bits->connectivity += tli_tokens_weigh(&told.tokens, 0, told.connectivity_end, table);
        bits->flags += tli_tokens_weigh(&told.tokens, told.connectivity_end, told.flags_end, table);
        bits->places += tli_tokens_weigh(&told.tokens, told.flags_end, told.places_end, table);
        bits->regions += tli_tokens_weigh(&told.tokens, told.places_end, told.tokens.count, table);
    }
    if (st) out->count = before;
    tli_tokens_close(&told.tokens);
    return st;
}
