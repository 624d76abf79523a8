/* Raw volumes: every type in both byte orders, sizes that do not fit, and the real volumes. */
#include "check_grid.h"

static tl_status read_raw(tl_ctx *ctx, const tli_map *map, void *arg, tli_grid *grid)
{
    return tli_read_raw(ctx, map, "test.raw", arg, grid);
}

static tl_read_opts raw_opts(uint32_t x, uint32_t y, uint32_t z, tl_scalar scalar)
{
    return (tl_read_opts){.struct_bytes = sizeof(tl_read_opts),
                          .raw_dims = {x, y, z},
                          .raw_scalar = scalar,
                          .split = 5};
}

static void reads_each_type_in_both_orders(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int variant = 0; variant < 20; variant++) {
        tl_read_opts opts = raw_opts(3, 2, 4, (tl_scalar)(variant / 2));
        opts.raw_big_endian = variant % 2;
        uint8_t bytes[24 * 8];
        size_t byte_count = 0;
        for (int i = 0; i < 24; i++)
            byte_count +=
                grid_number(bytes + byte_count, opts.raw_scalar, opts.raw_big_endian, 3 * i);
        tli_grid grid;
        CHECK_OK(ctx, grid_read(ctx, read_raw, &opts, bytes, byte_count, &grid));
        CHECK_EQ(grid.point_count, 24);
        CHECK_EQ(grid.block_count, 1);
        CHECK_EQ(tli_grid_cell_count(&grid), 2 * 1 * 3);
        const tli_grid_array *array = grid_array(&grid, TL_ON_VERTEX, "value");
        CHECK_EQ(array->scalar, opts.raw_scalar);
        CHECK_EQ(array->components, 1);
        for (int i = 0; i < 24; i++) {
            CHECK(array->values[i] == 3 * i);
            CHECK(grid.xyz[3 * i] == i % 3 && grid.xyz[3 * i + 1] == i / 3 % 2 &&
                  grid.xyz[3 * i + 2] == i / 6);
        }
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

/* Rows and pieces of the pool do not coincide. */
static void reads_more_than_a_piece(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    tl_read_opts opts = raw_opts(101, 67, 43, TL_U8);
    const size_t count = 101 * 67 * 43;
    uint8_t *bytes = malloc(count);
    CHECK(bytes != NULL);
    for (size_t i = 0; i < count; i++) bytes[i] = (uint8_t)(i * 31 % 251);
    tli_grid grid;
    CHECK_OK(ctx, grid_read(ctx, read_raw, &opts, bytes, count, &grid));
    for (size_t i = 0; i < count; i++) {
        CHECK(grid.point_arrays[0].values[i] == bytes[i]);
        CHECK(grid.xyz[3 * i] == (double)(i % 101) &&
              grid.xyz[3 * i + 1] == (double)(i / 101 % 67) &&
              grid.xyz[3 * i + 2] == (double)(i / 101 / 67));
    }
    tli_grid_release(&grid);
    free(bytes);
    tl_ctx_destroy(ctx);
}

static void demands_the_exact_size(void **state)
{
    (void)state;
    static const struct {
        uint32_t dims[3];
        int scalar;
        size_t byte_count;
        tl_status status;
        const char *message;
    } cases[] = {
        {{2, 3, 4},
         TL_U16,
         47,
         TL_ERR_FORMAT,
         "'test.raw': 47 bytes, expected 48 for 2 x 3 x 4 values"},
        {{2, 3, 4}, TL_U16, 49, TL_ERR_FORMAT, "49 bytes, expected 48"},
        {{2, 3, 4}, TL_F64, 0, TL_ERR_FORMAT, "0 bytes, expected 192"},
        {{0, 3, 4}, TL_U8, 0, TL_ERR_ARG, "0 x 3 x 4"},
        {{2, 3, 4}, 10, 24, TL_ERR_ARG, "type 10"},
        {{4294967295u, 4294967295u, 4294967295u}, TL_F64, 24, TL_ERR_UNSUPPORTED, "at most"},
        {{65536, 65536, 1}, TL_U8, 24, TL_ERR_UNSUPPORTED, "at most"},
        {{1000, 1000, 1000}, TL_U8, 24, TL_ERR_FORMAT, "expected 1000000000"}};
    static const uint8_t bytes[64];
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tl_read_opts opts = raw_opts(cases[i].dims[0], cases[i].dims[1], cases[i].dims[2],
                                     (tl_scalar)cases[i].scalar);
        tli_grid grid;
        CHECK_STATUS(grid_read(ctx, read_raw, &opts, bytes, cases[i].byte_count, &grid),
                     cases[i].status);
        if (!strstr(tl_ctx_message(ctx), cases[i].message))
            fail_msg("\"%s\", expected \"%s\"", tl_ctx_message(ctx), cases[i].message);
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

static void survives_damage_and_failing_memory(void **state)
{
    (void)state;
    uint8_t bytes[27 * 4];
    tl_read_opts opts = raw_opts(3, 3, 3, TL_F32);
    for (size_t i = 0; i < sizeof bytes; i++) bytes[i] = (uint8_t)(i * 37);
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    size_t refused = grid_survives_damage(ctx, read_raw, &opts, bytes, sizeof bytes, 1);
    CHECK_EQ(refused, sizeof bytes); /* each prefix; all bytes are values */
    tl_ctx_destroy(ctx);
    for (size_t budget = 1; budget < 1500; budget += 50) {
        ctx = grid_ctx(budget, 1);
        tli_grid grid;
        tl_status st = grid_read(ctx, read_raw, &opts, bytes, sizeof bytes, &grid);
        CHECK(st == TL_OK || st == TL_ERR_BUDGET);
        if (budget < 27 * 32) CHECK_EQ(st, TL_ERR_BUDGET);
        tli_grid_release(&grid);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
}

static void reads_real_volumes(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint32_t dims[3];
    } files[] = {{"volume/neghip_64x64x64_uint8.raw", {64, 64, 64}},
                 {"volume/Bucky.raw", {32, 32, 32}},
                 {"volume/tooth_103x94x161_uint8.raw", {103, 94, 161}}};
    char path[4096];
    if (!data_path(files[0].name, path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx(0, 2);
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        const uint32_t *dims = files[i].dims;
        tl_read_opts opts = raw_opts(dims[0], dims[1], dims[2], TL_U8);
        tli_map map;
        tli_grid grid;
        if (!data_path(files[i].name, path, sizeof path)) fail_msg("no '%s'", path);
        CHECK_OK(ctx, tli_map_open(ctx, path, &map));
        tli_grid_init(ctx, &grid);
        CHECK_OK(ctx, tli_read_raw(ctx, &map, path, &opts, &grid));
        double range[2], sum = 0;
        uint64_t expected = 0;
        grid_range(&grid.point_arrays[0], range);
        for (uint64_t k = 0; k < grid.point_count; k++) {
            sum += grid.point_arrays[0].values[k];
            expected += map.bytes[k];
        }
        printf("%s: %g to %g\n", files[i].name, range[0], range[1]);
        CHECK_EQ(grid.point_count, (uint64_t)dims[0] * dims[1] * dims[2]);
        CHECK(range[0] >= 0 && range[0] < range[1] && range[1] <= 255);
        CHECK(sum == (double)expected);
        tli_grid_release(&grid);
        tli_map_close(ctx, &map);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_each_type_in_both_orders), cmocka_unit_test(reads_more_than_a_piece),
        cmocka_unit_test(demands_the_exact_size),
        cmocka_unit_test(survives_damage_and_failing_memory), cmocka_unit_test(reads_real_volumes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
