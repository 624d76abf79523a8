/* PLOT3D: every variant written here and told by its size, damaged files, and the real data sets.
 */
#include "check_grid.h"

#include <unistd.h>

/* ---- files made here ---- */

/* What is written; the reader has to find it out. */
typedef struct variant {
    bool big_endian, records, multi, blank, text, overflow;
    unsigned real_bytes, axes;
} variant;

typedef struct file {
    uint8_t bytes[16384];
    size_t byte_count;
    size_t record; /* where the open record begins */
} file;

#define BLOCKS 2
#define OVERFLOW_VARS 7
static const int block_dims[BLOCKS][3] = {{2, 3, 2}, {3, 2, 2}};

static void put(file *out, const variant *as, uint64_t bits, size_t byte_count)
{
    CHECK(out->byte_count + byte_count <= sizeof out->bytes);
    for (size_t i = 0; i < byte_count; i++)
        out->bytes[out->byte_count++] =
            (uint8_t)(bits >> 8 * (as->big_endian ? byte_count - 1 - i : i));
}

static void put_int(file *out, const variant *as, int value)
{
    if (as->text)
        out->byte_count += (size_t)sprintf((char *)out->bytes + out->byte_count, " %d\n", value);
    else
        put(out, as, (uint32_t)value, 4);
}

static void put_real(file *out, const variant *as, double value)
{
    float narrow = (float)value;
    uint32_t narrow_bits;
    uint64_t bits;
    memcpy(&narrow_bits, &narrow, sizeof narrow_bits);
    memcpy(&bits, &value, sizeof bits);
    if (as->text)
        out->byte_count += (size_t)sprintf((char *)out->bytes + out->byte_count, " %.9g", value);
    else
        put(out, as, as->real_bytes == 4 ? narrow_bits : bits, as->real_bytes);
}

static void begin_record(file *out, const variant *as)
{
    out->record = out->byte_count;
    if (as->records) put_int(out, as, 0);
}

static void end_record(file *out, const variant *as)
{
    if (!as->records) return;
    size_t end = out->byte_count, length = end - out->record - 4;
    out->byte_count = out->record;
    put_int(out, as, (int)length);
    out->byte_count = end;
    put_int(out, as, (int)length);
}

static unsigned block_count(const variant *as)
{
    return as->multi ? BLOCKS : 1;
}

static int point_count(const variant *as, unsigned block)
{
    int count = 1;
    for (unsigned axis = 0; axis < as->axes; axis++) count *= block_dims[block][axis];
    return count;
}

static void put_head(file *out, const variant *as, bool overflow)
{
    out->byte_count = 0;
    if (as->multi) {
        begin_record(out, as);
        put_int(out, as, BLOCKS);
        end_record(out, as);
    }
    begin_record(out, as);
    for (unsigned b = 0; b < block_count(as); b++)
        for (unsigned axis = 0; axis < as->axes; axis++) put_int(out, as, block_dims[b][axis]);
    if (overflow) {
        put_int(out, as, OVERFLOW_VARS);
        put_int(out, as, 1);
    }
    end_record(out, as);
}

static double coordinate(unsigned block, unsigned axis, int i)
{
    return 100.0 * block + 10.0 * axis + i + 0.5;
}

static int blank_of(int i)
{
    return i % 5 == 1 ? 0 : i % 5 == 2 ? -2 : 1;
}

static void make_grid(file *out, const variant *as)
{
    put_head(out, as, false);
    for (unsigned b = 0; b < block_count(as); b++) {
        begin_record(out, as);
        for (unsigned axis = 0; axis < as->axes; axis++)
            for (int i = 0; i < point_count(as, b); i++) put_real(out, as, coordinate(b, axis, i));
        for (int i = 0; as->blank && i < point_count(as, b); i++) put_int(out, as, blank_of(i));
        end_record(out, as);
    }
}

static double flow(unsigned block, unsigned var, int i)
{
    return 1000.0 * block + 64.0 * var + i;
}

static void make_solution(file *out, const variant *as)
{
    put_head(out, as, as->overflow);
    for (unsigned b = 0; b < block_count(as); b++) {
        begin_record(out, as);
        for (int i = 0; i < 4; i++) put_real(out, as, i == 3 ? 3.5 : i);
        if (as->overflow) {
            for (int i = 0; i < 3; i++) put_real(out, as, 1);
            put_int(out, as, 1);
            for (int i = 0; i < 8; i++) put_real(out, as, 1);
        }
        end_record(out, as);
        begin_record(out, as);
        unsigned vars = as->overflow ? OVERFLOW_VARS : as->axes + 2;
        for (unsigned var = 0; var < vars; var++)
            for (int i = 0; i < point_count(as, b); i++) put_real(out, as, flow(b, var, i));
        end_record(out, as);
    }
}

/* ---- reading them ---- */

static tl_status read_plot3d(tl_ctx *ctx, const tli_map *map, void *arg, tli_grid *grid)
{
    tl_read_opts opts = {.struct_bytes = sizeof opts, .split = 5, .solution = arg};
    return tli_read_plot3d(ctx, map, "test.xyz", &opts, grid);
}

#define SOLUTION_PATH "plot3d_solution.q"

static void save_solution(const file *out)
{
    FILE *to = fopen(SOLUTION_PATH, "wb");
    CHECK(to != NULL);
    CHECK(fwrite(out->bytes, 1, out->byte_count, to) == out->byte_count);
    CHECK(fclose(to) == 0);
}

static void check_points(const tli_grid *grid, const variant *as)
{
    uint64_t first = 0;
    CHECK_EQ(grid->block_count, block_count(as));
    CHECK_EQ(grid->blanks != NULL, as->blank);
    for (unsigned b = 0; b < block_count(as); b++) {
        CHECK_EQ(grid->blocks[b].first_point, first);
        for (unsigned axis = 0; axis < 3; axis++)
            CHECK_EQ(grid->blocks[b].dims[axis], axis < as->axes ? block_dims[b][axis] : 1);
        for (int i = 0; i < point_count(as, b); i++, first++) {
            for (unsigned axis = 0; axis < 3; axis++)
                CHECK(grid->xyz[3 * first + axis] ==
                      (axis < as->axes ? coordinate(b, axis, i) : 0));
            if (as->blank) CHECK_EQ(grid->blanks[first], blank_of(i) != 0);
        }
    }
    CHECK_EQ(grid->point_count, first);
}

static void check_flow(const tli_grid *grid, const variant *as)
{
    static const char *const names[] = {"Density", "Momentum", "StagnationEnergy", "Gamma",
                                        "Species Density #1"};
    CHECK_EQ(grid->point_array_count, as->overflow ? 5 : 3);
    CHECK(grid->time == 3.5);
    uint64_t first = 0;
    for (unsigned b = 0; b < block_count(as); b++) {
        for (int i = 0; i < point_count(as, b); i++, first++) {
            unsigned var = 0;
            for (uint32_t a = 0; a < grid->point_array_count; a++) {
                const tli_grid_array *array = grid_array(grid, TL_ON_VERTEX, names[a]);
                CHECK_EQ(array->components, a == 1 ? 3 : 1);
                for (uint32_t k = 0; k < array->components; k++) {
                    double value = array->values[first * array->components + k];
                    CHECK(value == (k < as->axes ? flow(b, var++, i) : 0));
                }
            }
        }
    }
}

static variant variant_of(unsigned number)
{
    return (variant){.big_endian = number & 1,
                     .records = number >> 1 & 1,
                     .multi = number >> 2 & 1,
                     .blank = number >> 3 & 1,
                     .real_bytes = number & 16 ? 8 : 4,
                     .axes = number & 32 ? 2 : 3,
                     .text = number >> 6 & 1,
                     .overflow = number >> 7 & 1};
}

static void tells_every_variant(void **state)
{
    (void)state;
    static file grid_file, solution;
    tl_ctx *ctx = grid_ctx(0, 2);
    unsigned count = 0;
    for (unsigned number = 0; number < 256; number++) {
        const variant as = variant_of(number);
        if (as.text && (as.big_endian || as.records || as.real_bytes == 8)) continue;
        if (as.overflow && as.axes == 2) continue;
        make_grid(&grid_file, &as);
        make_solution(&solution, &as);
        save_solution(&solution);
        tli_grid grid;
        CHECK_OK(ctx, grid_read(ctx, read_plot3d, (void *)(uintptr_t)SOLUTION_PATH, grid_file.bytes,
                                grid_file.byte_count, &grid));
        check_points(&grid, &as);
        check_flow(&grid, &as);
        tli_grid_release(&grid);
        count++;
    }
    printf("%u variants\n", count);
    unlink(SOLUTION_PATH);
    tl_ctx_destroy(ctx);
}

/* The padding that old systems leave: fewer than 512 zero bytes, and nothing but zero bytes. */
static void takes_zero_padding_only(void **state)
{
    (void)state;
    static file out;
    /* the largest layout: with more padding a smaller one can't fit either */
    const variant as = variant_of(1 + 4 + 8 + 16);
    tl_ctx *ctx = grid_ctx(0, 1);
    make_grid(&out, &as);
    const size_t exact = out.byte_count;
    static const struct {
        size_t padding;
        bool dirty, good;
    } cases[] = {{0, false, true},    {484, false, true}, {511, false, true},
                 {512, false, false}, {484, true, false}, {4, true, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tli_grid grid;
        memset(out.bytes + exact, 0, 600);
        if (cases[i].dirty) out.bytes[exact + cases[i].padding - 1] = 1;
        tl_status st =
            grid_read(ctx, read_plot3d, NULL, out.bytes, exact + cases[i].padding, &grid);
        CHECK_EQ(st, cases[i].good ? TL_OK : TL_ERR_FORMAT);
        if (!st) check_points(&grid, &as);
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

static void refuses_what_does_not_fit(void **state)
{
    (void)state;
    static file out;
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    tli_grid grid;
    variant as = variant_of(4 + 2);
    make_grid(&out, &as);
    CHECK_STATUS(grid_read(ctx, read_plot3d, NULL, out.bytes, out.byte_count - 1, &grid),
                 TL_ERR_FORMAT);
    CHECK(strstr(tl_ctx_message(ctx), "'test.xyz'") &&
          strstr(tl_ctx_message(ctx), "fit no PLOT3D grid"));
    tli_grid_release(&grid);
    /* the record of a block says another length: the size fits, the record does not */
    out.bytes[out.byte_count - 4] ^= 1;
    CHECK_STATUS(grid_read(ctx, read_plot3d, NULL, out.bytes, out.byte_count, &grid),
                 TL_ERR_FORMAT);
    CHECK(strstr(tl_ctx_message(ctx), "byte ") && strstr(tl_ctx_message(ctx), ", expected 144"));
    tli_grid_release(&grid);
    /* a solution of one block for a grid of two, and none at all */
    as.multi = false;
    make_solution(&out, &as);
    save_solution(&out);
    as.multi = true;
    make_grid(&out, &as);
    CHECK_STATUS(grid_read(ctx, read_plot3d, (void *)(uintptr_t)SOLUTION_PATH, out.bytes,
                           out.byte_count, &grid),
                 TL_ERR_FORMAT);
    CHECK(strstr(tl_ctx_message(ctx), "fit no PLOT3D solution for 2 blocks"));
    tli_grid_release(&grid);
    unlink(SOLUTION_PATH);
    CHECK_STATUS(grid_read(ctx, read_plot3d, (void *)(uintptr_t)SOLUTION_PATH, out.bytes,
                           out.byte_count, &grid),
                 TL_ERR_IO);
    tli_grid_release(&grid);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Dimensions that overflow, more blocks than the file holds, text that is no number. */
static void refuses_hostile_counts(void **state)
{
    (void)state;
    static const struct {
        const char *bytes;
        size_t byte_count;
    } cases[] = {{"", 0},
                 {"\0\0\0\0", 4},
                 {"\377\377\377\177\377\377\377\177\377\377\377\177\0\0\0\0", 16},
                 {"\377\377\17\0\1\0\0\0\1\0\0\0\1\0\0\0", 16},
                 {"\377\377\377\377\377\377\377\377\377\377\377\377", 12},
                 {"2 2 2 1 1 1 1", 13},
                 {"1e9 1e9 1e9 1", 13},
                 {"2 x 2", 5},
                 {"2 2 2 0.5 0.5", 13}};
    tl_ctx *ctx = grid_ctx((size_t)1 << 16, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tli_grid grid;
        CHECK_STATUS(grid_read(ctx, read_plot3d, NULL, cases[i].bytes, cases[i].byte_count, &grid),
                     TL_ERR_FORMAT);
        tli_grid_release(&grid);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    }
    tl_ctx_destroy(ctx);
}

static void survives_every_prefix_and_byte(void **state)
{
    (void)state;
    static file grid_file, solution, damaged;
    static const unsigned numbers[] = {1, 2 + 4 + 8, 2 + 4 + 16 + 128, 32 + 4, 64 + 4};
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    void *path = (void *)(uintptr_t)SOLUTION_PATH;
    for (size_t n = 0; n < sizeof numbers / sizeof *numbers; n++) {
        const variant as = variant_of(numbers[n]);
        make_grid(&grid_file, &as);
        make_solution(&solution, &as);
        save_solution(&solution);
        size_t refused =
            grid_survives_damage(ctx, read_plot3d, NULL, grid_file.bytes, grid_file.byte_count, 1);
        CHECK(refused >= grid_file.byte_count - 4); /* text may lose its last digits */
        damaged = solution;
        size_t bad = 0;
        for (size_t i = 0; i < solution.byte_count; i++) {
            damaged.byte_count = i;
            save_solution(&damaged);
            bad += !grid_survives(ctx, read_plot3d, path, grid_file.bytes, grid_file.byte_count);
            damaged.byte_count = solution.byte_count;
            damaged.bytes[i] ^= 0x41;
            save_solution(&damaged);
            bad += !grid_survives(ctx, read_plot3d, path, grid_file.bytes, grid_file.byte_count);
            damaged.bytes[i] = solution.bytes[i];
        }
        printf("variant %u: %zu of %zu damaged grids and %zu of %zu damaged solutions refused\n",
               numbers[n], refused, 3 * grid_file.byte_count, bad, 2 * solution.byte_count);
        CHECK(bad >= solution.byte_count - 4);
    }
    unlink(SOLUTION_PATH);
    tl_ctx_destroy(ctx);
}

/* ---- real data ---- */

static void reads_real_data(void **state)
{
    (void)state;
    static const struct {
        const char *grid, *solution;
        uint64_t points, cells;
        uint32_t blocks;
        double low, high; /* of the density; 0, 0 where the source gives none */
    } files[] = {{"bluntfinxyz.bin", "bluntfinq.bin", 40960, 37479, 1, 0.193, 4.977},
                 {"combxyz.bin", "combq.bin", 47025, 43008, 1, 0.198, 0.710},
                 {"multi-ascii.xyz", "multi-ascii.q", 2304, 1694, 2, 0, 0},
                 {"multi-bin-C.xyz", "multi-bin-C.q", 2304, 1694, 2, 0, 0},
                 {"multi-bin.xyz", "multi-bin.q", 2304, 1694, 2, 0, 0},
                 {"multi-bin.xyz", "multi-bin-oflow.q", 2304, 1694, 2, 0, 0},
                 {"multi-bin-2D.xyz", "multi-bin-2D.q", 2 * 11 * 17, 2 * 10 * 16, 2, 0, 0}};
    char path[4096], solution[4096], name[256];
    snprintf(name, sizeof name, "curvilinear/%s", files[0].grid);
    if (!data_path(name, path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx(0, 2);
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        tl_read_opts opts = {.struct_bytes = sizeof opts, .split = 5, .solution = solution};
        tli_map map;
        tli_grid grid;
        snprintf(name, sizeof name, "curvilinear/%s", files[i].grid);
        CHECK(data_path(name, path, sizeof path));
        snprintf(name, sizeof name, "curvilinear/%s", files[i].solution);
        CHECK(data_path(name, solution, sizeof solution));
        CHECK_OK(ctx, tli_map_open(ctx, path, &map));
        tli_grid_init(ctx, &grid);
        CHECK_OK(ctx, tli_read_plot3d(ctx, &map, path, &opts, &grid));
        double range[2];
        grid_range(grid_array(&grid, TL_ON_VERTEX, "Density"), range);
        printf("%s: %llu points, %llu cells, density %.4g to %.4g\n", files[i].grid,
               (unsigned long long)grid.point_count, (unsigned long long)tli_grid_cell_count(&grid),
               range[0], range[1]);
        CHECK_EQ(grid.point_count, files[i].points);
        CHECK_EQ(tli_grid_cell_count(&grid), files[i].cells);
        CHECK_EQ(grid.block_count, files[i].blocks);
        CHECK_EQ(grid.point_array_count, 3);
        if (files[i].high > 0) {
            CHECK_NEAR(range[0], files[i].low, 0.0006);
            CHECK_NEAR(range[1], files[i].high, 0.0006);
        } else {
            CHECK(range[0] > 0 && range[1] < 10);
        }
        tli_grid_release(&grid);
        tli_map_close(ctx, &map);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(tells_every_variant),
                                       cmocka_unit_test(takes_zero_padding_only),
                                       cmocka_unit_test(refuses_what_does_not_fit),
                                       cmocka_unit_test(refuses_hostile_counts),
                                       cmocka_unit_test(survives_every_prefix_and_byte),
                                       cmocka_unit_test(reads_real_data)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
