/* Patches for tests out of the meshes of make_mesh.h. Memory is that of the context, since patches
 * own blocks of it. */
#ifndef TETRALOD_TESTS_MAKE_PATCH_H
#define TETRALOD_TESTS_MAKE_PATCH_H

#include "codec/codec.h"

#include "make_mesh.h"

/* A lattice of 2^-16 from the origin on. */
static const tl_lattice make_lattice = {TL_PLACE_LATTICE, -16, {0, 0, 0}};

/* The mesh, which has at most TL_PATCH_VERTS_MAX vertices, as a patch; shared: vertices with x = 0
 * and a few others. */
static inline tl_patch *make_patch(tl_ctx *ctx, const tl_lattice *lattice, const make_mesh *m)
{
    tl_status st = TL_OK;
    tl_patch *patch = tl_mem_zalloc(ctx, 1, sizeof *patch, &st);
    CHECK(patch != NULL);
    patch->vert_count = (uint32_t)m->vert_count;
    patch->tet_count = (uint32_t)m->tet_count;
    patch->places = tl_mem_alloc(ctx, m->vert_count, sizeof *patch->places, &st);
    patch->shared = tl_mem_alloc(ctx, m->vert_count, 1, &st);
    patch->tets = tl_mem_alloc(ctx, m->tet_count, sizeof *patch->tets, &st);
    if (m->regions) patch->regions = tl_mem_alloc(ctx, m->tet_count, sizeof *patch->regions, &st);
    CHECK_EQ(st, TL_OK);
    for (size_t v = 0; v < m->vert_count; v++) {
        tl_lattice_nearest(lattice, m->xyz + 3 * v, patch->places[v]);
        patch->shared[v] = m->xyz[3 * v] <= 0 || v % 97 == 5;
    }
    for (size_t i = 0; i < 4 * m->tet_count; i++) patch->tets[i / 4][i % 4] = (uint16_t)m->tets[i];
    if (m->regions && m->tet_count)
        memcpy(patch->regions, m->regions, m->tet_count * sizeof *m->regions);
    return patch;
}

/* Makes tables of one patch and its channels; class 0. */
static inline tl_codec *make_codec(tl_ctx *ctx, const tl_lattice *lattice, const tl_patch *patch,
                                   const tli_coded_channel *channels, size_t channel_count,
                                   const int64_t *const *values)
{
    tli_trainer *trainer = NULL;
    tl_codec *codec = NULL;
    tli_bytes bytes;
    tli_bytes_open(ctx, &bytes);
    CHECK_OK(ctx, tli_trainer_create(ctx, lattice, channels, channel_count, &trainer));
    if (patch) CHECK_OK(ctx, tli_trainer_add(ctx, trainer, 0, patch, values));
    CHECK_OK(ctx, tli_trainer_write(trainer, &bytes));
    CHECK_OK(ctx, tl_codec_read(ctx, bytes.bytes, bytes.count, &codec));
    CHECK(memcmp(tl_codec_lattice(codec)->origin, lattice->origin, sizeof lattice->origin) == 0);
    CHECK_EQ(tl_codec_lattice(codec)->exponent, lattice->exponent);
    tli_trainer_destroy(ctx, trainer);
    tli_bytes_close(&bytes);
    return codec;
}

#endif
