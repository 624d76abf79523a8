/* A label volume of 32 million samples, packed by zlib in a file of its own: frog tissues. */
#include "check_source.h"

static void frog_tissues(void **state)
{
    (void)state;
    char path[4096];
    if (!data_path("multimaterial/frogtissue.mhd", path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx((size_t)3 << 29, 2); /* 1.5 GiB */
    tl_read_opts opts = tl_read_opts_defaults();
    tli_map map;
    tli_source source;
    tli_grid grid;
    double range[2], sum = 0, weighted = 0;
    CHECK_OK(ctx, tli_map_open(ctx, path, &map));
    source_fill(path, &map, &source);
    CHECK_EQ(tli_match_metaimage(&source), TLI_MATCH_BYTES);
    tli_grid_init(ctx, &grid);
    CHECK_OK(ctx, tli_read_metaimage(ctx, &source, &opts, &grid));
    const tli_grid_array *labels = &grid.point_arrays[0];
    grid_range(labels, range);
    for (size_t i = 0; i < labels->count; i++) {
        sum += labels->values[i];
        weighted += labels->values[i] * (double)(i % 1000);
    }
    const double *last = grid.xyz + 3 * (grid.point_count - 1);
    printf("%llu samples, labels %g to %g, sum %.0f; %.0f MiB at most\n",
           (unsigned long long)grid.point_count, range[0], range[1], sum,
           (double)tl_ctx_peak_bytes(ctx) / 1048576);
    CHECK_EQ(grid.point_count, 500 * 470 * 136);
    CHECK(range[0] == 0 && range[1] == 29);
    CHECK(sum == 12279472 && weighted == 5809283053); /* as zlib and NumPy read it */
    CHECK(last[0] == 499 && last[1] == 469 && last[2] == 202.5);
    tli_grid_release(&grid);
    tli_map_close(ctx, &map);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(frog_tissues)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
