/* Binary PLOT3D in windows: the mesh of a whole read in every variant, blanked points, several
 * blocks and species included; broken files fail as they do as a whole. */
#include "check_ctx.h"
#include "check_feed.h"
#include "check_grid.h"

enum { BLOCKS = 3, SPECIES_VARS = 7 };
static const uint32_t DIMS[BLOCKS][3] = {{21, 13, 30}, {5, 40, 7}, {2, 61, 45}};

typedef struct variant {
    bool big_endian, records, wide, blank, species;
    uint32_t blocks;
} variant;

typedef struct writer {
    FILE *file;
    variant as;
} writer;

static void put(const writer *w, uint64_t bits, size_t bytes)
{
    for (size_t i = 0; i < bytes; i++)
        fputc((int)(bits >> 8 * (w->as.big_endian ? bytes - 1 - i : i) & 0xff), w->file);
}

static void put_real(const writer *w, double value)
{
    float narrow = (float)value;
    uint32_t few;
    uint64_t bits;
    memcpy(&few, &narrow, sizeof few);
    memcpy(&bits, &value, sizeof bits);
    put(w, w->as.wide ? bits : few, w->as.wide ? 8 : 4);
}

static void put_mark(const writer *w, uint64_t bytes)
{
    if (w->as.records) put(w, bytes, 4);
}

static uint64_t points_of(uint32_t b)
{
    return (uint64_t)DIMS[b][0] * DIMS[b][1] * DIMS[b][2];
}

static writer begin(const char *path, const variant *as, bool species)
{
    writer w = {fopen(path, "wb"), *as};
    CHECK(w.file != NULL);
    if (as->blocks > 1) {
        put_mark(&w, 4);
        put(&w, as->blocks, 4);
        put_mark(&w, 4);
    }
    const uint64_t head = (3 * as->blocks + (species ? 2 : 0)) * 4;
    put_mark(&w, head);
    for (uint32_t b = 0; b < as->blocks; b++)
        for (int axis = 0; axis < 3; axis++) put(&w, DIMS[b][axis], 4);
    if (species) put(&w, SPECIES_VARS, 4);
    if (species) put(&w, 1, 4);
    put_mark(&w, head);
    return w;
}

static void write_grid(const char *path, const variant *as)
{
    writer w = begin(path, as, false);
    for (uint32_t b = 0; b < as->blocks; b++) {
        const uint64_t n = points_of(b), bytes = n * (as->wide ? 24 : 12) + (as->blank ? 4 * n : 0);
        put_mark(&w, bytes);
        for (int axis = 0; axis < 3; axis++)
            for (uint64_t i = 0; i < n; i++) {
                const uint64_t d0 = DIMS[b][0], d1 = DIMS[b][1];
                const double at[3] = {(double)(i % d0), (double)(i / d0 % d1),
                                      (double)(i / d0 / d1)};
                put_real(&w, at[axis] + 0.11 * at[(axis + 1) % 3] + 100 * b);
            }
        for (uint64_t i = 0; as->blank && i < n; i++) put(&w, i % 211 == 7 ? 0 : 1 + i % 2, 4);
        put_mark(&w, bytes);
    }
    CHECK_EQ(fclose(w.file), 0);
}

static void write_solution(const char *path, const variant *as)
{
    writer w = begin(path, as, as->species);
    const uint64_t real = as->wide ? 8 : 4;
    for (uint32_t b = 0; b < as->blocks; b++) {
        const uint64_t n = points_of(b), vars = as->species ? SPECIES_VARS : 5;
        const uint64_t head = as->species ? 15 * real + 4 : 4 * real;
        put_mark(&w, head);
        for (int i = 0; i < 4; i++) put_real(&w, i == 3 ? 2.5 : i);
        for (int i = 0; as->species && i < 3; i++) put_real(&w, 1);
        if (as->species) put(&w, 1, 4);
        for (int i = 0; as->species && i < 8; i++) put_real(&w, 1);
        put_mark(&w, head);
        put_mark(&w, vars * n * real);
        for (uint64_t i = 0; i < vars * n; i++) put_real(&w, (double)i * 0.5 + 1000 * b);
        put_mark(&w, vars * n * real);
    }
    CHECK_EQ(fclose(w.file), 0);
}

/* Bits of a number as the variant. */
static variant variant_of(uint32_t bits)
{
    return (variant){.big_endian = bits & 1,
                     .records = bits & 2,
                     .wide = bits & 4,
                     .blank = bits & 8,
                     .species = bits & 16,
                     .blocks = bits & 32 ? BLOCKS : 1};
}

static void test_variants(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    for (uint32_t bits = 0; bits < 64; bits++) {
        const variant as = variant_of(bits);
        tl_read_opts opts = tl_read_opts_defaults();
        opts.split = bits % 3 ? 5 : 6;
        opts.solution = bits % 5 ? "w.q" : NULL;
        opts.keep_fill = bits % 7 == 1;
        opts.has_fill_value = bits % 7 == 3;
        opts.fill_value = 500; /* of some points */
        write_grid("w.xyz", &as);
        write_solution("w.q", &as);
        CHECK(check_feed_file(ctx, "w.xyz", &opts) > 1);
    }
    tl_ctx_destroy(ctx);
}

/* What can't be read in windows is read as a whole; what is broken fails as it does there. */
static void test_others(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_read_opts opts = tl_read_opts_defaults();
    const variant as = variant_of(2 + 32);
    tli_feed *feed = NULL;
    write_grid("w.xyz", &as);
    write_solution("w.q", &as);
    opts.solution = "w.q";
    opts.weld = true;
    CHECK_EQ(check_feed_file(ctx, "w.xyz", &opts), 0);
    opts.weld = false;
    FILE *file = fopen("w.q", "r+b");
    CHECK(file != NULL);
    CHECK_EQ(fseek(file, -2, SEEK_END), 0); /* the length behind the last record */
    fputc(77, file);
    CHECK_EQ(fclose(file), 0);
    CHECK_STATUS(tli_feed_open(ctx, "w.xyz", &opts, ".", 1, &feed), TL_ERR_FORMAT);
    CHECK(strstr(tl_ctx_message(ctx), "w.q") != NULL);
    file = fopen("w.xyz", "ab");
    CHECK(file != NULL);
    fputs("more", file);
    CHECK_EQ(fclose(file), 0);
    CHECK_STATUS(tli_feed_open(ctx, "w.xyz", &opts, ".", 1, &feed), TL_ERR_FORMAT);
    CHECK(strstr(tl_ctx_message(ctx), "PLOT3D") != NULL);
    tl_ctx_destroy(ctx);
}

static void test_real(void **state)
{
    (void)state;
    static const char *const files[][2] = {
        {"curvilinear/bluntfinxyz.bin", "curvilinear/bluntfinq.bin"},
        {"curvilinear/combxyz.bin", "curvilinear/combq.bin"}};
    char grid[1024], solution[1024];
    if (!data_path(files[0][0], grid, sizeof grid))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", grid);
    tl_ctx *ctx = check_ctx_create(2);
    for (int i = 0; i < 2; i++) {
        CHECK(data_path(files[i][0], grid, sizeof grid));
        CHECK(data_path(files[i][1], solution, sizeof solution));
        tl_read_opts opts = tl_read_opts_defaults();
        opts.solution = solution;
        CHECK(check_feed_file(ctx, grid, &opts) > 1);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_variants),
                                       cmocka_unit_test(test_others), cmocka_unit_test(test_real)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
