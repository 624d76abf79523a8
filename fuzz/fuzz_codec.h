/* What the fuzz targets of the codec share: a context with a small budget, a codec with plain
 * tables, a patch, and a look at what a decoder hands on. A broken promise ends the program. */
#ifndef TETRALOD_FUZZ_CODEC_H
#define TETRALOD_FUZZ_CODEC_H

#include "codec/codec.h"

#include "fuzz_base.h"

#define FUZZ_BUDGET_BYTES ((size_t)64 << 20)

static inline tl_ctx *fuzz_ctx_create(void)
{
    return fuzz_ctx_within(FUZZ_BUDGET_BYTES);
}

/* Two channels: two numbers a vertex, one a tet. */
static inline tl_codec *fuzz_codec_create(tl_ctx *ctx)
{
    const tl_lattice lattice = {TL_PLACE_LATTICE, -8, {0, 0, 0}};
    const tli_coded_channel channels[2] = {{{TL_VALUE_LATTICE, 0.5}, TL_ON_VERTEX, 2},
                                           {{TL_VALUE_FLOAT64, 0}, TL_ON_TET, 1}};
    tli_trainer *trainer;
    tl_codec *codec;
    tli_bytes bytes;
    tli_bytes_open(ctx, &bytes);
    FUZZ_CHECK(tli_trainer_create(ctx, &lattice, channels, 2, &trainer) == TL_OK);
    FUZZ_CHECK(tli_trainer_write(trainer, &bytes) == TL_OK);
    FUZZ_CHECK(tl_codec_read(ctx, bytes.bytes, bytes.count, &codec) == TL_OK);
    tli_trainer_destroy(ctx, trainer);
    tli_bytes_close(&bytes);
    return codec;
}

/* A strip of tets, arranged. */
#define FUZZ_PATCH_VERTS 12u
static inline tl_patch *fuzz_patch_create(tl_ctx *ctx)
{
    tl_status st = TL_OK;
    tl_patch *patch = tl_mem_zalloc(ctx, 1, sizeof *patch, &st);
    FUZZ_CHECK(patch);
    patch->vert_count = FUZZ_PATCH_VERTS;
    patch->tet_count = FUZZ_PATCH_VERTS - 3;
    patch->places = tl_mem_alloc(ctx, patch->vert_count, sizeof *patch->places, &st);
    patch->shared = tl_mem_zalloc(ctx, patch->vert_count, 1, &st);
    patch->tets = tl_mem_alloc(ctx, patch->tet_count, sizeof *patch->tets, &st);
    FUZZ_CHECK(st == TL_OK);
    for (uint32_t v = 0; v < patch->vert_count; v++)
        for (uint32_t a = 0; a < 3; a++) patch->places[v][a] = 100 * v * (v % 3 == a) + v;
    for (uint32_t t = 0; t < patch->tet_count; t++)
        for (uint32_t c = 0; c < 4; c++)
            patch->tets[t][c] = (uint16_t)(t + (c < 2 && t % 2 ? 1 - c : c));
    FUZZ_CHECK(tli_patch_arrange(ctx, patch, NULL, NULL) == TL_OK);
    return patch;
}

static inline void fuzz_check_patch(const tl_patch *patch)
{
    for (uint32_t face = 0; face < 4 * patch->tet_count; face++) {
        uint32_t across = patch->opposite[face / 4][face % 4];
        FUZZ_CHECK(patch->tets[face / 4][face % 4] < patch->vert_count);
        FUZZ_CHECK(across == TL_NONE || (across < 4 * patch->tet_count && across != face &&
                                         patch->opposite[across / 4][across % 4] == face));
    }
    for (uint32_t v = 0; v < patch->vert_count; v++) FUZZ_CHECK(patch->shared[v] <= 1);
}

#endif
