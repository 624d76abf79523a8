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
    if (st) return st;
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
}

/* Numbers beside a reference, so that they are small and signed. */
typedef struct kin_sums {
    int64_t mirrored[3], face[3]; /* 48 times what is expected, and a + b + c, of all kin */
    int64_t low[3], high[3];
    int64_t mirrored_count, face_count;
} kin_sums;

static inline int64_t beside(int64_t value, int64_t reference)
{
    return (int64_t)((uint64_t)value - (uint64_t)reference);
}

static inline int64_t add(int64_t a, int64_t b)
{
    return (int64_t)((uint64_t)a + (uint64_t)b);
}

static inline int64_t times(int64_t a, int64_t b)
{
    return (int64_t)((uint64_t)a * (uint64_t)b);
}

static void add_tet(const tli_kin *kin, uint32_t t, uint32_t vertex, const int64_t (*places)[3],
                    const int64_t reference[3], kin_sums *sums)
{
    const uint16_t *tet = kin->patch->tets[t];
    uint32_t corner = tet[0] == vertex ? 0 : tet[1] == vertex ? 1 : tet[2] == vertex ? 2 : 3;
    uint32_t across = kin->patch->opposite[t][corner];
    uint32_t elder = across == TL_NONE ? vertex : kin->patch->tets[across >> 2][across & 3];
    for (int a = 0; a < 3; a++) {
        int64_t face = 0;
        for (uint32_t c = 0; c < 4; c++) {
            if (c == corner) continue;
            int64_t x = beside(places[tet[c]][a], reference[a]);
            face = add(face, x);
            if (x < sums->low[a]) sums->low[a] = x;
            if (x > sums->high[a]) sums->high[a] = x;
        }
        sums->face[a] = add(sums->face[a], face);
        if (elder < vertex) {
            int64_t w = beside(places[elder][a], reference[a]);
            sums->mirrored[a] =
                add(sums->mirrored[a], add(times(face, 16 + MIRROR), times(w, -3 * MIRROR)));
            if (w < sums->low[a]) sums->low[a] = w;
            if (w > sums->high[a]) sums->high[a] = w;
        }
    }
    sums->face_count++;
    sums->mirrored_count += elder < vertex;
}

/* Nearest whole number, halves upwards. */
static int64_t divide(int64_t sum, int64_t count)
{
    int64_t twice = add(times(sum, 2), count), whole = twice / (2 * count);
    return whole - (twice % (2 * count) < 0);
}

/* The face that the vertex was reached over and the elder vertex behind it. */
static void first_kin(const tli_kin *kin, uint32_t t, uint32_t vertex, tli_guess *guess)
{
    const uint16_t *tet = kin->patch->tets[t];
    uint32_t corner = tet[0] == vertex ? 0 : tet[1] == vertex ? 1 : tet[2] == vertex ? 2 : 3;
    uint32_t across = kin->patch->opposite[t][corner];
    if (across != TL_NONE) guess->elder = kin->patch->tets[across >> 2][across & 3];
    if (guess->elder >= vertex) guess->elder = TL_NONE;
    for (uint32_t c = 0; c < 3; c++) guess->face[c] = tet[(corner + 1 + c) & 3];
}

void tli_kin_place(const tli_kin *kin, uint32_t vertex, const int64_t (*places)[3],
                   tli_guess *guess)
{
    static const int64_t nowhere[3] = {0, 0, 0};
    guess->kin_count = 0;
    guess->elder = TL_NONE;
    const int64_t *reference = vertex ? places[vertex - 1] : nowhere;
    kin_sums sums = {{0}, {0}, {0}, {0}, 0, 0};
    uint32_t t = kin->first[vertex];
    if (t == TL_NONE) {
        for (int a = 0; a < 3; a++) {
            guess->at[a] = (uint64_t)reference[a];
            guess->around[a] = 0;
        }
        guess->group = 2;
        return;
    }
    const uint16_t *tet = kin->patch->tets[t];
    reference = places[tet[0] == vertex ? tet[1] : tet[0]];
    for (int a = 0; a < 3; a++) {
        sums.low[a] = INT64_MAX;
        sums.high[a] = INT64_MIN;
    }
    first_kin(kin, t, vertex, guess);
    for (; t != TL_NONE; t = kin->next[t]) add_tet(kin, t, vertex, places, reference, &sums);
    for (int a = 0; a < 3; a++) {
        int64_t offset = sums.mirrored_count ? divide(sums.mirrored[a], 48 * sums.mirrored_count)
                                             : divide(sums.face[a], 3 * sums.face_count);
        guess->at[a] = (uint64_t)reference[a] + (uint64_t)offset;
        guess->around[a] = model_length((uint64_t)sums.high[a] - (uint64_t)sums.low[a]);
    }
    guess->kin_count = (uint32_t)sums.face_count;
    guess->group = sums.mirrored_count > 1 ? 0 : sums.mirrored_count ? 1 : 2;
}
