/* More cells of a list than are built at once: tets take the place of the ids of cells that are
 * done with, over several windows. */
#include "check.h"
#include "check_grid.h"

#define MANY 84 /* hexahedra along an edge; with the quads 1.3 windows and more of cells */

/* Hexahedra of a cube of MANY, a quad behind every third; the cell array names the hexahedron. */
static tl_status make_many(tl_ctx *ctx, tli_grid *grid)
{
    static const uint8_t hexahedron = 12, quad = 9;
    const uint32_t n = MANY + 1;
    const uint64_t hexes = (uint64_t)MANY * MANY * MANY, cells = hexes + hexes / 3;
    tl_status st = grid_make_block(ctx, 0, n, n, n, "x", grid);
    tl_mem_free(ctx, grid->blocks);
    grid->blocks = NULL;
    grid->block_count = 0;
    tli_grid_drop_array(grid, TL_ON_TET, 0);
    grid->cell_count = cells;
    grid->types = tl_mem_alloc(ctx, cells, 1, &st);
    grid->offsets = tl_mem_alloc(ctx, cells + 1, sizeof *grid->offsets, &st);
    grid->connectivity = tl_mem_alloc(ctx, 10 * cells, sizeof *grid->connectivity, &st);
    tli_grid_array *names;
    if (!st) st = tli_grid_add(grid, TL_ON_TET, "hexahedron", 1, TL_I32, NULL, &names);
    if (st) return st;
    uint64_t cell = 0, used = 0;
    for (uint64_t h = 0; h < hexes; h++) {
        const uint32_t at =
            (uint32_t)(h % MANY + n * (h / MANY % MANY) + (uint64_t)n * n * (h / MANY / MANY));
        const uint32_t corners[8] = {
            at,         at + 1,         at + n + 1,         at + n,
            at + n * n, at + n * n + 1, at + n * n + n + 1, at + n * n + n};
        for (int surface = 0; surface <= (h % 3 == 2); surface++) {
            grid->types[cell] = surface ? quad : hexahedron;
            grid->offsets[cell] = used;
            names->values[cell++] = surface ? -1.0 : (double)h;
            memcpy(grid->connectivity + used, corners, (surface ? 4 : 8) * sizeof *corners);
            used += surface ? 4 : 8;
        }
    }
    grid->offsets[cell] = used;
    return TL_OK;
}

/* Tets are written over ids that nobody needs any more: each lies in the cell it says. */
static void test_many_cells(void **state)
{
    (void)state;
    for (unsigned threads = 1; threads <= 3; threads += 2) {
        tl_ctx *ctx = grid_ctx(0, threads);
        tli_grid grid;
        tl_mesh *mesh;
        CHECK_OK(ctx, make_many(ctx, &grid));
        CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, NULL));
        tli_grid_release(&grid);
        const size_t tets = tl_mesh_tet_count(mesh);
        CHECK_EQ(tets, (size_t)6 * MANY * MANY * MANY);
        CHECK_NEAR(volume_of(mesh), (double)MANY * MANY * MANY, 1e-4);
        const double *names = tl_mesh_channel_by_name(mesh, "hexahedron")->values;
        for (size_t t = 0; t < tets; t++) {
            const uint64_t hex = (uint64_t)names[t];
            CHECK_EQ(hex, t / 6);
            const double low[3] = {(double)(hex % MANY), (double)(hex / MANY % MANY),
                                   (double)(hex / MANY / MANY)};
            for (int v = 0; v < 4; v++)
                for (int k = 0; k < 3; k++) {
                    double at = tl_mesh_xyz(
                        mesh)[3 * (size_t)tl_mesh_tets(mesh)[4 * t + (size_t)v] + (size_t)k];
                    CHECK(at == low[k] || at == low[k] + 1);
                }
        }
        tl_mesh_destroy(mesh);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_many_cells),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
