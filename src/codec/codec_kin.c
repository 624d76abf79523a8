/* Prediction from the elder neighbours of a vertex. Arithmetic wraps around, so that images of any
 * size work. */
#include "codec/codec_kin.h"
#include "codec/codec_model.h"

/* How far beyond a face the new vertex is expected, in sixteenths of how far the elder vertex lies
 * on this side of it; measured. */
#define MIRROR 13

tl_status tli_kin_open(tl_ctx *ctx, const tl_patch *patch, tli_kin *kin)
{
    tl_status st = TL_OK;
    *kin = (tli_kin){.patch = patch};
    kin->first = tl_mem_alloc(ctx, patch->vert_count, sizeof *kin->first, &st);
    kin->next = tl_mem_alloc(ctx, patch->tet_count, sizeof *kin->next, &st);
    kin->seen = tl_mem_alloc(ctx, patch->vert_count, sizeof *kin->seen, &st);
    if (st) return st;
    for (uint32_t v = 0; v < patch->vert_count; v++) kin->seen[v] = TL_NONE;
    for (uint32_t v = 0; v < patch->vert_count; v++) kin->first[v] = TL_NONE;
    for (uint32_t t = patch->tet_count; t-- > 0;) {
        const uint16_t *tet = patch->tets[t];
        uint32_t newest = tet[0];
        bool twice = tet[0] == tet[1] || tet[0] == tet[2] || tet[0] == tet[3] || tet[1] == tet[2] ||
                     tet[1] == tet[3] || tet[2] == tet[3];
        for (int c = 1; c < 4; c++) newest = tet[c] > newest ? tet[c] : newest;
        if (twice) continue;
        kin->next[t] = kin->first[newest];
        kin->first[newest] = t;
    }
    return TL_OK;
}

void tli_kin_close(tl_ctx *ctx, tli_kin *kin)
{
    tl_mem_free(ctx, kin->first);
    tl_mem_free(ctx, kin->next);
    tl_mem_free(ctx, kin->seen);
}

static inline int64_t beside(int64_t value, int64_t reference)
{
    return (int64_t)((uint64_t)value - (uint64_t)reference);
}

/* Nearest whole number, halves upwards. */
static int64_t divide(uint64_t sum, int64_t count)
{
    int64_t twice = (int64_t)(2 * sum + (uint64_t)count), whole = twice / (2 * count);
    return whole - (twice % (2 * count) < 0);
}

/* The face that the vertex was reached over, the elder vertex behind it, and how far they spread.
 */
static void first_kin(const tli_kin *kin, uint32_t t, uint32_t vertex, const int64_t (*places)[3],
                      tli_guess *guess)
{
    const uint16_t *tet = kin->patch->tets[t];
    uint32_t corner = kin_corner(tet, vertex), across = kin->patch->opposite[t][corner];
    if (across != TL_NONE) guess->elder = kin->patch->tets[across >> 2][across & 3];
    if (guess->elder >= vertex) guess->elder = TL_NONE;
    for (uint32_t c = 0; c < 3; c++) guess->face[c] = tet[(corner + 1 + c) & 3];
    for (int a = 0; a < 3; a++) {
        int64_t x0 = places[guess->face[0]][a], low = 0, high = 0;
        for (int c = 1; c < 4; c++) {
            uint32_t v = c < 3 ? guess->face[c] : guess->elder;
            int64_t x = v == TL_NONE ? 0 : beside(places[v][a], x0);
            low = x < low ? x : low;
            high = x > high ? x : high;
        }
        guess->around[a] = model_length((uint64_t)high - (uint64_t)low);
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
}

void tli_kin_place(const tli_kin *kin, uint32_t vertex, const int64_t (*places)[3],
                   tli_guess *guess)
{
    /* Sums beside a reference, so that they are small; they wrap around. */
    uint64_t face_sum[3] = {0}, both_face[3] = {0}, elder_sum[3] = {0};
    int64_t face_count = 0, both_count = 0;
    uint32_t t = kin->first[vertex];
    guess->kin_count = 0;
    guess->elder = TL_NONE;
    if (t == TL_NONE) {
        guess_before(places, vertex, guess);
        return;
    }
    first_kin(kin, t, vertex, places, guess);
    const int64_t *reference = places[guess->face[0]];
    for (; t != TL_NONE; t = kin->next[t], face_count++) {
        const uint16_t *tet = kin->patch->tets[t];
        uint32_t corner = kin_corner(tet, vertex), across = kin->patch->opposite[t][corner];
        uint32_t elder = across == TL_NONE ? vertex : kin->patch->tets[across >> 2][across & 3];
        const int64_t *x = places[tet[(corner + 1) & 3]], *y = places[tet[(corner + 2) & 3]];
        const int64_t *z = places[tet[(corner + 3) & 3]];
        bool both = elder < vertex;
        const int64_t *w = both ? places[elder] : reference;
        for (int a = 0; a < 3; a++) {
            uint64_t sum =
                (uint64_t)x[a] + (uint64_t)y[a] + (uint64_t)z[a] - 3 * (uint64_t)reference[a];
            face_sum[a] += sum;
            both_face[a] += both ? sum : 0;
            elder_sum[a] += (uint64_t)w[a] - (uint64_t)reference[a];
        }
        both_count += both;
    }
    for (int a = 0; a < 3; a++) {
        int64_t offset =
            both_count
                ? divide((16 + MIRROR) * both_face[a] - 3 * MIRROR * elder_sum[a], 48 * both_count)
                : divide(face_sum[a], 3 * face_count);
        guess->at[a] = (uint64_t)reference[a] + (uint64_t)offset;
    }
    guess->kin_count = (uint32_t)face_count;
    guess->group = both_count > 1 ? 0 : both_count ? 1 : 2;
}
