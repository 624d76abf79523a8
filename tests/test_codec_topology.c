/* Topologies to bytes and back: every mesh of tets returns, garbage too. */
#include "check.h"
#include "check_ctx.h"

#include "make_patch.h"

static void check_same(const tl_patch *a, const tl_patch *b)
{
    CHECK_EQ(a->vert_count, b->vert_count);
    CHECK_EQ(a->tet_count, b->tet_count);
    for (uint32_t t = 0; t < a->tet_count; t++)
        for (int c = 0; c < 4; c++) {
            CHECK_EQ(a->tets[t][c], b->tets[t][c]);
            CHECK_EQ(a->opposite[t][c], b->opposite[t][c]);
        }
    for (uint32_t v = 0; v < a->vert_count; v++) {
        for (int k = 0; k < 3; k++) CHECK_EQ(a->places[v][k], b->places[v][k]);
        CHECK_EQ(a->shared[v], b->shared[v]);
    }
    CHECK_EQ(!a->regions, !b->regions);
    for (uint32_t t = 0; t < a->tet_count && a->regions; t++)
        CHECK_EQ(a->regions[t], b->regions[t]);
}

static int compare_rows(const void *a, const void *b)
{
    return memcmp(a, b, 4 * sizeof(uint32_t));
}

/* Tets as a sorted set, each turned by an even permutation so that equal tets have equal rows. */
static uint32_t (*sorted_tets(const tl_patch *patch, const uint32_t *vert_old))[4]
{
    static const uint8_t even[12][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 0, 3, 2},
                                        {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 0, 1, 3}, {2, 1, 3, 0},
                                        {2, 3, 0, 1}, {3, 0, 2, 1}, {3, 1, 0, 2}, {3, 2, 1, 0}};
    uint32_t(*rows)[4] = calloc(patch->tet_count + 1, sizeof *rows);
    CHECK(rows != NULL);
    for (uint32_t t = 0; t < patch->tet_count; t++) {
        memset(rows[t], 0xff, sizeof rows[t]);
        for (int p = 0; p < 12; p++) {
            uint32_t turned[4];
            for (int c = 0; c < 4; c++) {
                uint32_t v = patch->tets[t][even[p][c]];
                turned[c] = vert_old ? vert_old[v] : v;
            }
            if (compare_rows(turned, rows[t]) < 0) memcpy(rows[t], turned, sizeof turned);
        }
    }
    qsort(rows, patch->tet_count, sizeof *rows, compare_rows);
    return rows;
}

/* Arranges, encodes, decodes, compares; returns bits a tet. */
static double round_trip(tl_ctx *ctx, const tl_lattice *lattice, const make_mesh *m, tli_bits *bits)
{
    tl_patch *patch = make_patch(ctx, lattice, m), *back = NULL;
    uint32_t *vert_old = calloc(m->vert_count + 1, sizeof *vert_old);
    tli_bytes bytes, raw;
    tli_bytes_open(ctx, &bytes);
    tli_bytes_open(ctx, &raw);
    uint32_t(*before)[4] = sorted_tets(patch, NULL);
    CHECK_OK(ctx, tli_patch_arrange(ctx, patch, vert_old, NULL));
    uint32_t(*after)[4] = sorted_tets(patch, vert_old);
    CHECK(memcmp(before, after, patch->tet_count * sizeof *before) == 0);
    for (uint32_t v = 0; v < patch->vert_count; v++) {
        int64_t place[3];
        tl_lattice_nearest(lattice, m->xyz + 3 * (size_t)vert_old[v], place);
        CHECK(memcmp(place, patch->places[v], sizeof place) == 0);
    }
    tl_codec *codec = make_codec(ctx, lattice, patch, NULL, 0, NULL);
    CHECK_OK(ctx, tli_topology_encode(ctx, codec, 0, patch, &bytes, bits));
    CHECK_OK(ctx, tl_topology_decode(ctx, codec, 0, bytes.bytes, bytes.count, &back));
    check_same(patch, back);
    tl_patch_destroy(ctx, back);
    CHECK_OK(ctx, tli_topology_encode(ctx, NULL, TL_CLASS_RAW, patch, &raw, NULL));
    CHECK_OK(ctx, tl_topology_decode(ctx, NULL, TL_CLASS_RAW, raw.bytes, raw.count, &back));
    check_same(patch, back);
    tl_patch_destroy(ctx, back);
    /* An arranged patch is in order already. */
    uint16_t(*kept)[4] = malloc((patch->tet_count + 1) * sizeof *kept);
    memcpy(kept, patch->tets, patch->tet_count * sizeof *kept);
    CHECK_OK(ctx, tli_patch_arrange(ctx, patch, vert_old, NULL));
    CHECK(memcmp(kept, patch->tets, patch->tet_count * sizeof *kept) == 0);
    double per_tet = 8.0 * (double)bytes.count / (patch->tet_count + 1e-9);
    free(kept);
    free(before);
    free(after);
    free(vert_old);
    tl_codec_destroy(ctx, codec);
    tl_patch_destroy(ctx, patch);
    tli_bytes_close(&bytes);
    tli_bytes_close(&raw);
    return per_tet;
}

static void grids_return(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(0);
    for (int i = 0; i < 5; i++) {
        tli_bits bits = {0};
        make_mesh m = i < 4 ? make_grid(14) : make_grid_cavity(14);
        if (i == 1) make_perturb(&m, 0.004, 7);
        if (i > 1) make_shuffle(&m, 5);
        if (i == 3) make_two_regions(&m);
        double per_tet = round_trip(ctx, &make_lattice, &m, &bits), tets = (double)m.tet_count;
        printf(
            "grid %d: %.2f bits a tet, connectivity %.3f, places %.3f, flags %.3f, regions %.3f\n",
            i, per_tet, bits.connectivity / tets, bits.places / tets, bits.flags / tets,
            bits.regions / tets);
        make_release(&m);
    }
    tl_ctx_destroy(ctx);
}

static void soups_return(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(0);
    for (uint64_t seed = 0; seed < 60; seed++) {
        tli_bits bits = {0};
        make_mesh m = make_soup(4 + seed % 40, seed < 50 ? seed * 3 : 2000, seed);
        if (seed % 3 == 1) make_two_regions(&m);
        /* Tets with a vertex twice. */
        for (size_t t = 0; t + 7 < m.tet_count && seed % 2; t += 7)
            m.tets[4 * t] = m.tets[4 * t + 2];
        (void)round_trip(ctx, &make_lattice, &m, &bits);
        make_release(&m);
    }
    tl_ctx_destroy(ctx);
}

static void lossless_places_return(void **state)
{
    (void)state;
    const tl_lattice lattices[] = {{TL_PLACE_FLOAT32, 0, {0, 0, 0}},
                                   {TL_PLACE_FLOAT64, 0, {0, 0, 0}}};
    tl_ctx *ctx = check_ctx_create(0);
    for (int l = 0; l < 2; l++) {
        tli_bits bits = {0};
        make_mesh m = make_grid(8);
        make_perturb(&m, 0.01, 3);
        m.xyz[0] = l ? -1e308 : -1e38;
        m.xyz[1] = INFINITY;
        m.xyz[5] = -0.0;
        (void)round_trip(ctx, &lattices[l], &m, &bits);
        make_release(&m);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(grids_return),
                                       cmocka_unit_test(soups_return),
                                       cmocka_unit_test(lossless_places_return)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
