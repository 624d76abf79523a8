/* Prediction from the elder neighbours of a vertex. */
#include "codec/codec_kin.h"
#include "codec/codec_model.h"

#include <string.h>

/* How far beyond a face the new vertex is expected, in sixteenths of how far the elder vertex lies
 * on this side of it; measured. */
#define MIRROR 13

static bool has_vertex_twice(const uint16_t tet[4])
{
    return tet[0] == tet[1] || tet[0] == tet[2] || tet[0] == tet[3] || tet[1] == tet[2] ||
           tet[1] == tet[3] || tet[2] == tet[3];
}

/* 4 * the newest vertex of a tet + its corner. */
static inline uint32_t newest_of(const uint16_t tet[4])
{
    uint32_t low = 4u * tet[0], other = 4u * tet[1] + 1, high = 4u * tet[2] + 2;
    uint32_t last = 4u * tet[3] + 3;
    low = low > other ? low : other;
    high = high > last ? high : last;
    return low > high ? low : high;
}

/* Kin by counting: begin [v] is the end of v's while they are filled in, from the last tet on. */
static void fill(const tl_patch *patch, uint32_t tet_count, tli_kin *kin)
{
    const uint16_t *corners = *patch->tets;
    uint32_t sum = 0;
    memset(kin->begin, 0, ((size_t)patch->vert_count + 1) * sizeof *kin->begin);
    for (uint32_t t = 0; t < tet_count; t++) kin->begin[newest_of(patch->tets[t]) >> 2]++;
    for (uint32_t v = 0; v <= patch->vert_count; v++) {
        sum += kin->begin[v];
        kin->begin[v] = sum;
    }
    for (uint32_t t = tet_count; t-- > 0;) {
        const uint16_t *tet = patch->tets[t];
        uint32_t newest = newest_of(tet) >> 2, corner = newest_of(tet) & 3;
        uint32_t across = patch->opposite[t][corner];
        tli_relative *relative = &kin->relatives[--kin->begin[newest]];
        for (uint32_t c = 0; c < 3; c++) relative->face[c] = tet[(corner + 1 + c) & 3];
        /* Without a tet beyond the face, its own vertex stands in for one that is no elder. */
        uint32_t elder = corners[across == TL_NONE ? 4 * t + corner : across];
        relative->elder = (uint16_t)(elder < newest ? elder : ELDER_NONE);
    }
}

tl_status tli_kin_open(tl_ctx *ctx, const tl_patch *patch, tli_kin *kin)
{
    tl_status st = TL_OK;
    uint32_t tet_count = patch->tet_count;
    /* They stand last. */
    while (tet_count > 0 && has_vertex_twice(patch->tets[tet_count - 1])) tet_count--;
    *kin = (tli_kin){0};
    kin->begin = tl_mem_alloc(ctx, (size_t)patch->vert_count + 1, sizeof *kin->begin, &st);
    kin->relatives = tl_mem_alloc(ctx, tet_count, sizeof *kin->relatives, &st);
    if (!st) fill(patch, tet_count, kin);
    return st;
}

void tli_kin_close(tl_ctx *ctx, tli_kin *kin)
{
    tl_mem_free(ctx, kin->begin);
    tl_mem_free(ctx, kin->relatives);
}

/* How far what the first kin says spreads. */
static inline void find_extent(const tli_relative *first, bool has_elder,
                               const int64_t (*places)[3], uint32_t around[3])
{
    const int64_t *reference = places[first->face[0]], *y = places[first->face[1]];
    const int64_t *z = places[first->face[2]], *w = has_elder ? places[first->elder] : reference;
    for (int a = 0; a < 3; a++) {
        uint64_t base = (uint64_t)reference[a];
        int64_t dy = (int64_t)((uint64_t)y[a] - base), dz = (int64_t)((uint64_t)z[a] - base);
        int64_t dw = (int64_t)((uint64_t)w[a] - base);
        int64_t low = dy < dz ? dy : dz, high = dy < dz ? dz : dy;
        low = dw < low ? dw : low;
        high = dw > high ? dw : high;
        low = low < 0 ? low : 0;
        high = high > 0 ? high : 0;
        around[a] = model_length((uint64_t)high - (uint64_t)low);
    }
}

/* A vertex without kin: the first of a component, or of no tet. */
static void guess_before(const int64_t (*places)[3], uint32_t vertex, tli_guess *guess)
{
    for (int a = 0; a < 3; a++) {
        guess->at[a] = vertex ? (uint64_t)places[vertex - 1][a] : 0;
        guess->around[a] = 0;
    }
    guess->group = 2;
    guess->has_elder = false;
}

void tli_kin_place(const tli_kin *kin, uint32_t vertex, const int64_t (*places)[3],
                   tli_guess *guess)
{
    /* 1 / (48 n) of mirrored elders, and 1 / (3 n) of faces. */
    static const double parts[2][PLACE_KIN_MAX + 1] = {
        {0, 1.0 / 48, 1.0 / 96, 1.0 / 144, 1.0 / 192, 1.0 / 240, 1.0 / 288},
        {0, 1.0 / 3, 1.0 / 6, 1.0 / 9, 1.0 / 12, 1.0 / 15, 1.0 / 18}};
    /* Sums beside a reference, so that they are small; they wrap around. */
    uint64_t sums[2][3] = {{0}};
    uint32_t count = kin_count(kin, vertex, PLACE_KIN_MAX), both_count = 0;
    const tli_relative *first = &kin->relatives[kin->begin[vertex]];
    guess->kin_count = count;
    guess->first = first;
    if (!count) {
        guess_before(places, vertex, guess);
        return;
    }
    const int64_t *reference = places[first->face[0]];
    guess->has_elder = first->elder != ELDER_NONE;
    find_extent(first, guess->has_elder, places, guess->around);
    for (uint32_t i = 0; i < count; i++) {
        const tli_relative *relative = &first[i];
        const int64_t *x = places[relative->face[0]], *y = places[relative->face[1]];
        const int64_t *z = places[relative->face[2]];
        uint32_t both = relative->elder != ELDER_NONE;
        const int64_t *w = places[both ? relative->elder : first->face[0]];
        for (int a = 0; a < 3; a++) {
            uint64_t base = (uint64_t)reference[a];
            uint64_t sum = (uint64_t)x[a] + (uint64_t)y[a] + (uint64_t)z[a] - 3 * base;
            uint64_t mirrored = (16 + MIRROR) * sum - 3 * MIRROR * ((uint64_t)w[a] - base);
            sums[0][a] += mirrored & (0 - (uint64_t)both);
            sums[1][a] += sum;
        }
        both_count += both;
    }
    uint32_t which = both_count == 0;
    double part = parts[which][which ? count : both_count];
    for (int a = 0; a < 3; a++) {
        double offset = (double)(int64_t)sums[which][a] * part;
        guess->at[a] = (uint64_t)reference[a] + (uint64_t)kin_round(offset);
    }
    guess->group = both_count > 1 ? 0 : both_count ? 1 : 2;
}
