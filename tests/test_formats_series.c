/* Which files are the steps of a series, by their names alone, and what is left out. */
#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "make_series.h"

static void copy(const char *from, const char *to)
{
    char bytes[4096];
    size_t count;
    FILE *in = fopen(from, "rb"), *out = fopen(to, "wb");
    if (!in || !out) abort();
    while ((count = fread(bytes, 1, sizeof bytes, in)) > 0)
        if (fwrite(bytes, 1, count, out) != count) abort();
    fclose(in);
    fclose(out);
}

/* Files of these names in a folder of their own, up to a NULL: the numbers of the series that path
 * belongs to, as text. */
static void check_series(const char *const *names, const char *path, const char *expected,
                         size_t own)
{
    static const unsigned ONE = 1;
    char whole[300], found[300] = "";
    tl_series series;
    tl_ctx *ctx = check_ctx_create(1);
    mkdir("series", 0700);
    series_write("series_piece", 2, &ONE, 1);
    for (size_t i = 0; names[i]; i++) {
        snprintf(whole, sizeof whole, "series/%s", names[i]);
        copy(series_path("series_piece", ONE), whole);
    }
    snprintf(whole, sizeof whole, "series/%s", path);
    CHECK_OK(ctx, tl_series_find(ctx, whole, NULL, &series));
    for (size_t i = 0; i < series.count; i++) {
        const size_t at = strlen(found);
        snprintf(found + at, sizeof found - at, "%s%u", i ? " " : "", series.steps[i].number);
        CHECK(isnan(series.times[i]));
        CHECK_EQ(series.steps[i].step, 0);
    }
    assert_string_equal(found, expected);
    CHECK_EQ(series.own, own);
    CHECK(series.is_files == (series.count > 1));
    assert_string_equal(series.steps[own].path, whole);
    tl_series_release(ctx, &series);
    for (size_t i = 0; names[i]; i++) {
        snprintf(whole, sizeof whole, "series/%s", names[i]);
        CHECK_EQ(remove(whole), 0);
    }
    CHECK_EQ(remove("series"), 0);
    CHECK_EQ(remove(series_path("series_piece", ONE)), 0);
    check_ctx_destroy(ctx);
}

static void numbers_order_files(void **state)
{
    (void)state;
    static const char *const PLAIN[] = {"run_2.vtu", "run_10.vtu", "run_1.vtu",  "run_3.vtk",
                                        "run_.vtu",  "walk_4.vtu", "run_5a.vtu", NULL};
    static const char *const PADDED[] = {"t008.vtu", "t009.vtu",  "t010.vtu",
                                         "t11.vtu",  "t1000.vtu", NULL};
    static const char *const BARE[] = {"0.vtu", "50.vtu", "7.vtu", NULL};
    check_series(PLAIN, "run_2.vtu", "1 2 10", 1);
    check_series(PADDED, "t009.vtu", "8 9 10 11 1000", 1);
    check_series(BARE, "50.vtu", "0 7 50", 2);
}

static void one_step_has_one_file(void **state)
{
    (void)state;
    static const char *const TWO[] = {"a_9.vtu", "a_09.vtu", "a_10.vtu", NULL};
    check_series(TWO, "a_09.vtu", "9 10", 0);
    check_series(TWO, "a_9.vtu", "9 10", 0);
}

static void names_that_are_no_series(void **state)
{
    (void)state;
    static const char *const SIZES[] = {"g64.vtu", "g128.vtu", NULL};
    static const char *const PIECES[] = {"part_0.vtu", "part_1.vtu", "part.pvtu", NULL};
    static const char *const ALONE[] = {"part_0.vtu", "part_0.vtk", NULL};
    static const char *const LONG[] = {"x_1234567890.vtu", "x_1234567891.vtu", NULL};
    check_series(SIZES, "g64.vtu", "0", 0);
    check_series(PIECES, "part_0.vtu", "0", 0);
    check_series(ALONE, "part_0.vtu", "0", 0);
    check_series(LONG, "x_1234567890.vtu", "0", 0);
}

/* A collection has its own steps, with their times. */
static void steps_of_one_file(void **state)
{
    (void)state;
    static const unsigned NUMBERS[] = {3, 8};
    static const double TIMES[] = {0.5, 2};
    const char *files[2];
    char names[2][40];
    tl_series series;
    tl_ctx *ctx = check_ctx_create(1);
    series_write("series_of", 2, NUMBERS, 2);
    for (size_t i = 0; i < 2; i++)
        files[i] = strcpy(names[i], series_path("series_of", NUMBERS[i]));
    CHECK_OK(ctx, tl_series_write(ctx, "series_of_1.pvd", files, TIMES, 2));
    CHECK_OK(ctx, tl_series_write(ctx, "series_of_2.pvd", files, TIMES, 2));
    CHECK_OK(ctx, tl_series_find(ctx, "series_of_1.pvd", NULL, &series));
    CHECK_EQ(series.count, 2);
    CHECK(!series.is_files);
    CHECK_EQ(series.steps[1].step, 1);
    CHECK_EQ(series.steps[1].number, 1);
    CHECK(series.times[1] == 2);
    tl_series_release(ctx, &series);
    CHECK_STATUS(tl_series_find(ctx, "series_of_7.vtu", NULL, &series), TL_ERR_IO);
    CHECK_EQ(series.count, 0);
    tl_series_release(ctx, &series);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_order_files), cmocka_unit_test(one_step_has_one_file),
        cmocka_unit_test(names_that_are_no_series), cmocka_unit_test(steps_of_one_file)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
