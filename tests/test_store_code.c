/* The short numbers of the container's index: what is rounded goes the promised way, what is read
 * and written again stays, and the checksum sees damage. */
#include "mesh/mesh_tree.h"
#include "store/store_round.h"

#include "make_mesh.h"

#define HASH_0 0x26ed6b45d1fd96cau
#define HASH_1 0x18730a396a0c3d2au
#define HASH_100 0x630a4568cd6fb9ffu
#define SEED_123 0x28e4d25b3a4bba4bu

static double random_size(uint64_t *seed)
{
    return ldexp(1 + make_uniform(seed), (int)(make_random(seed) % 80) - 60);
}

static void test_errors_go_up(void **state)
{
    (void)state;
    double table[TLI_CODE8_COUNT];
    uint64_t seed = 1;
    for (int unit = -40; unit <= 40; unit += 8) {
        for (unsigned c = 0; c < TLI_CODE8_COUNT; c++) table[c] = tli_code8_value(c, unit);
        for (unsigned c = 1; c < TLI_CODE8_COUNT; c++) CHECK(table[c] > table[c - 1]);
        for (int i = 0; i < 2000; i++) {
            double value = random_size(&seed);
            double small = table[tli_code8_above(table, value)];
            double large = tli_code16_value(tli_code16_above(value, unit), unit);
            CHECK(small >= value && large >= value);
            /* tight between the smallest normal number and the largest one */
            if (value > ldexp(1, unit - 29) && value < ldexp(1, unit + 1)) {
                CHECK(small <= value * 1.125);
                CHECK(large <= value * (1 + 0x1p-10));
            }
        }
    }
    CHECK_EQ(tli_code16_above(0, 3), 0);
    CHECK_EQ(tli_code8_above(table, 0), 0);
    CHECK_EQ(tli_code16_above(NAN, 3), TLI_CODE16_INFINITE);
    CHECK_EQ(tli_code16_above(-1, 3), TLI_CODE16_INFINITE);
    CHECK_EQ(tli_code16_above(INFINITY, 3), TLI_CODE16_INFINITE);
    CHECK(isinf(tli_code16_value(TLI_CODE16_INFINITE, 3)));
    CHECK(isinf(tli_code8_value(255, 3)));
}

static void test_errors_stay(void **state)
{
    (void)state;
    double table[TLI_CODE8_COUNT];
    const int units[] = {-900, -7, 0, 5, 900};
    for (size_t u = 0; u < sizeof units / sizeof *units; u++) {
        for (unsigned c = 0; c < TLI_CODE8_COUNT; c++) table[c] = tli_code8_value(c, units[u]);
        for (unsigned c = 0; c < TLI_CODE8_COUNT; c++)
            CHECK_EQ(tli_code8_above(table, table[c]), c);
        for (unsigned c = 0; c <= TLI_CODE16_INFINITE; c++) {
            CHECK_EQ(tli_code16_above(tli_code16_value(c, units[u]), units[u]), c);
        }
    }
    for (unsigned c = 0; c <= TLI_CODE16_INFINITE; c++) {
        double root = tli_code16_value(c, 3 + TLI_SQUARE_EXPONENT);
        CHECK_EQ(tli_square_above(root * root, 3), c);
    }
    uint64_t seed = 5;
    for (int i = 0; i < 2000; i++) {
        double square = random_size(&seed);
        double root = tli_code16_value(tli_square_above(square, 3), 3 + TLI_SQUARE_EXPONENT);
        CHECK(root * root >= square && root * root <= square * (1 + 0x1p-8));
    }
}

static void test_unit(void **state)
{
    (void)state;
    CHECK_EQ(tli_unit_above(0), 0);
    CHECK_EQ(tli_unit_above(1), 1);
    CHECK_EQ(tli_unit_above(0.75), 0);
    CHECK_EQ(tli_unit_above(1e300 * 1e300), TLI_UNIT_MAX);
    CHECK_EQ(tli_unit_above(0x1p-1074), TLI_UNIT_MIN);
}

static void test_floats(void **state)
{
    (void)state;
    uint64_t seed = 2;
    for (int i = 0; i < 10000; i++) {
        double value = random_size(&seed) * (make_random(&seed) & 1 ? 1 : -1);
        CHECK((double)tli_float_above(value) >= value && (double)tli_float_below(value) <= value);
        CHECK((double)nextafterf(tli_float_above(value), -INFINITY) < value);
    }
    CHECK(isinf(tli_float_above(1e300)) && isfinite(tli_float_below(1e300)));
    CHECK(isinf(tli_float_below(-INFINITY)) && isnan(tli_float_above(NAN)));
    CHECK(tli_float_above(1e-300) > 0);
}

static void check_range(const double range[2], double codec_error, uint64_t seed)
{
    tli_range_grid grid;
    tli_range_grid_make(range, codec_error, &grid);
    CHECK(isfinite(grid.lo) && isfinite(grid.step) && grid.step > 0);
    const double width = range[1] - range[0];
    for (int i = 0; i < 500; i++) {
        double a = range[0] + width * (1.5 * make_uniform(&seed) - 0.25);
        double b = range[0] + width * (1.5 * make_uniform(&seed) - 0.25);
        float given[2] = {tli_float_below(fmin(a, b)), tli_float_above(fmax(a, b))}, got[2];
        unsigned codes[2], again[2];
        tli_range_codes(&grid, given, codes);
        got[0] = tli_float_below(tli_range_value(&grid, codes[0]));
        got[1] = tli_float_above(tli_range_value(&grid, codes[1]));
        CHECK(got[0] <= given[0] && got[1] >= given[1]);
        if (isfinite(got[0]) && isfinite(got[1]) && isfinite(width))
            CHECK((double)got[1] - (double)got[0] <=
                  fabs(b - a) + width * 1e-4 + fabs(range[1]) * 1e-6 + 1e-44);
        tli_range_codes(&grid, got, again);
        CHECK_EQ(again[0], codes[0]);
        CHECK_EQ(again[1], codes[1]);
    }
}

static void test_ranges_go_outwards(void **state)
{
    (void)state;
    check_range((const double[2]){0, 1}, 1e-4, 1);
    check_range((const double[2]){-1e6, 3e6}, 0, 2);
    check_range((const double[2]){101325, 101326}, 1e-3, 3);
    check_range((const double[2]){5, 5}, 0, 4);
    check_range((const double[2]){0, 0}, 0, 5);
    check_range((const double[2]){-1e308, 1e308}, 0, 6);
    check_range((const double[2]){-1e-300, 2e-300}, 0, 7);
    tli_range_grid grid;
    unsigned codes[2];
    tli_range_grid_make((const double[2]){0, 1}, 0, &grid);
    tli_range_codes(&grid, (const float[2]){NAN, NAN}, codes);
    CHECK_EQ(codes[0], 0xffff);
    CHECK_EQ(codes[1], 0);
    tli_range_codes(&grid, (const float[2]){-100, 100}, codes); /* far outside: not known */
    CHECK_EQ(codes[0], 0);
    CHECK_EQ(codes[1], 0xffff);
    CHECK(isinf(tli_range_value(&grid, 0)) && isinf(tli_range_value(&grid, 0xffff)));
}

static double distance(const double a[4], const double b[4])
{
    double squares = 0;
    for (int k = 0; k < 3; k++) squares += (a[k] - b[k]) * (a[k] - b[k]);
    return sqrt(squares);
}

static void test_spheres_hold(void **state)
{
    (void)state;
    const double bounds[6] = {1e6, 1e6 + 3, -5, 2, 0, 0.001};
    const double diagonal = sqrt(58);
    tli_sphere_grid grid;
    uint64_t seed = 9;
    tli_sphere_grid_make(bounds, diagonal, &grid);
    for (int i = 0; i < 5000; i++) {
        double sphere[4], got[4], again[4];
        uint32_t centre[3], centre_again[3];
        unsigned radius, radius_again;
        for (int k = 0; k < 3; k++)
            sphere[k] = bounds[2 * k] + make_uniform(&seed) * (bounds[2 * k + 1] - bounds[2 * k]);
        sphere[3] = ldexp(make_uniform(&seed), -(int)(make_random(&seed) % 30));
        tli_sphere_codes(&grid, sphere, centre, &radius);
        tli_sphere_value(&grid, centre, radius, got);
        CHECK(got[3] >= sphere[3] + distance(got, sphere));
        CHECK(got[3] <= sphere[3] * 1.001 + 1e-8);
        tli_sphere_codes(&grid, got, centre_again, &radius_again);
        tli_sphere_value(&grid, centre_again, radius_again, again);
        for (int k = 0; k < 4; k++) CHECK(again[k] == got[k]);
    }
    double far[4] = {0, 0, 0, 1}, got[4]; /* clamped to the grid, and so far larger */
    uint32_t centre[3];
    unsigned radius;
    tli_sphere_codes(&grid, far, centre, &radius);
    tli_sphere_value(&grid, centre, radius, got);
    CHECK(got[3] >= 1 + distance(got, far));
    tli_sphere_codes(&grid, (const double[4]){NAN, 0, 0, 1}, centre, &radius);
    CHECK_EQ(radius, TLI_CODE16_INFINITE);
}

/* Vectors for whoever writes a reader; docs/FORMAT.md names them. */
static void test_hash_vectors(void **state)
{
    (void)state;
    uint8_t bytes[100];
    for (size_t i = 0; i < sizeof bytes; i++) bytes[i] = (uint8_t)i;
    CHECK(tli_store_hash(0, bytes, 0) == HASH_0);
    CHECK(tli_store_hash(0, bytes, 1) == HASH_1);
    CHECK(tli_store_hash(1, bytes, 100) == HASH_100);
    CHECK(tli_store_seed(1, TLI_PART_BLOB, 2, 3) == SEED_123);
}

static void test_hash_sees_damage(void **state)
{
    (void)state;
    enum { BYTES = 77 };
    uint8_t bytes[BYTES];
    uint64_t seed = 4;
    for (size_t i = 0; i < BYTES; i++) bytes[i] = (uint8_t)make_random(&seed);
    for (size_t length = 0; length <= BYTES; length++) {
        uint64_t whole = tli_store_hash(7, bytes, length);
        CHECK(whole != tli_store_hash(8, bytes, length));
        if (length) CHECK(whole != tli_store_hash(7, bytes, length - 1));
        for (size_t i = 0; i < length; i++)
            for (int bit = 0; bit < 8; bit++) {
                bytes[i] ^= (uint8_t)(1 << bit);
                CHECK(whole != tli_store_hash(7, bytes, length));
                bytes[i] ^= (uint8_t)(1 << bit);
            }
    }
    memset(bytes, 0, sizeof bytes); /* zeros of every length differ */
    for (size_t length = 0; length < BYTES; length++)
        CHECK(tli_store_hash(7, bytes, length) != tli_store_hash(7, bytes, length + 1));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_errors_go_up),
        cmocka_unit_test(test_errors_stay),
        cmocka_unit_test(test_unit),
        cmocka_unit_test(test_floats),
        cmocka_unit_test(test_ranges_go_outwards),
        cmocka_unit_test(test_spheres_hold),
        cmocka_unit_test(test_hash_vectors),
        cmocka_unit_test(test_hash_sees_damage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
