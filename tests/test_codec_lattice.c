/* Images of places and values: exact both ways, ordered, nearest. */
#include <float.h>

#include "check.h"

#include "make_mesh.h"
#include "tetralod/codec.h"

static void float_images_are_ordered_and_exact(void **state)
{
    (void)state;
    static const double values[] = {-INFINITY, -DBL_MAX, -1e300,    -2,      -1, -0x1p-1074,
                                    -0.0,      0.0,      0x1p-1074, 1e-300,  1,  1 + 0x1p-52,
                                    2,         1e300,    DBL_MAX,   INFINITY};
    size_t count = sizeof values / sizeof *values;
    for (size_t i = 0; i < count; i++) {
        double back = tl_float64_of_image(tl_image_of_float64(values[i]));
        CHECK(memcmp(&back, &values[i], sizeof back) == 0);
        if (i > 0) CHECK(tl_image_of_float64(values[i - 1]) < tl_image_of_float64(values[i]));
    }
    CHECK_EQ(tl_image_of_float64(0.0) - tl_image_of_float64(-0.0), 1);
    uint64_t seed = 1;
    for (int i = 0; i < 100000; i++) {
        uint32_t a_bits = (uint32_t)make_random(&seed), b_bits = (uint32_t)make_random(&seed);
        float a, b, back;
        memcpy(&a, &a_bits, sizeof a);
        memcpy(&b, &b_bits, sizeof b);
        if (isnan(a) || isnan(b)) continue;
        back = tl_float32_of_image(tl_image_of_float32(a));
        CHECK(memcmp(&back, &a, sizeof a) == 0);
        CHECK(!(a < b) || tl_image_of_float32(a) < tl_image_of_float32(b));
    }
}

static void lattice_places_are_exact_and_nearest(void **state)
{
    (void)state;
    const tl_lattice lattices[] = {{TL_PLACE_LATTICE, -20, {-5, 1000000, 0}},
                                   {TL_PLACE_LATTICE, 3, {0, -7, 12}},
                                   {TL_PLACE_FLOAT32, 0, {0, 0, 0}},
                                   {TL_PLACE_FLOAT64, 0, {0, 0, 0}}};
    uint64_t seed = 2;
    for (size_t l = 0; l < 4; l++) {
        double unit = ldexp(1, lattices[l].exponent);
        for (int i = 0; i < 10000; i++) {
            double x[3], y[3];
            int64_t k[3], again[3];
            for (int a = 0; a < 3; a++)
                x[a] = unit * ((double)lattices[l].origin[a] + 1e6 * make_uniform(&seed));
            tl_lattice_nearest(&lattices[l], x, k);
            tl_lattice_xyz(&lattices[l], k, y);
            tl_lattice_nearest(&lattices[l], y, again);
            for (int a = 0; a < 3; a++) {
                double most = l < 2 ? unit / 2 : l == 2 ? 0x1p-24 * fabs(x[a]) : 0;
                CHECK(fabs(x[a] - y[a]) <= most);
                CHECK_EQ(again[a], k[a]);
            }
        }
    }
    const double far[3] = {-1e300, 1e300, NAN};
    int64_t k[3];
    tl_lattice_nearest(&lattices[0], far, k);
    CHECK_EQ(k[0], 0);
    CHECK_EQ(k[1], 4294967295);
    CHECK_EQ(k[2], 0);
}

static void values_have_images(void **state)
{
    (void)state;
    const tl_value_code codes[] = {{TL_VALUE_LATTICE, 0.25},
                                   {TL_VALUE_FLOAT32, 0},
                                   {TL_VALUE_FLOAT64, 0},
                                   {TL_VALUE_INTEGER, 0}};
    for (size_t c = 0; c < 4; c++) {
        CHECK(tl_value_image(&codes[c], NAN) == TL_IMAGE_NAN);
        CHECK(tl_value_image(&codes[c], INFINITY) == TL_IMAGE_PINF);
        CHECK(tl_value_image(&codes[c], -INFINITY) == TL_IMAGE_NINF);
        CHECK(isnan(tl_value_of(&codes[c], TL_IMAGE_NAN)));
        CHECK(tl_value_of(&codes[c], TL_IMAGE_PINF) == INFINITY);
        CHECK(tl_value_of(&codes[c], TL_IMAGE_NINF) == -INFINITY);
        for (int i = -100; i <= 100; i++)
            CHECK(tl_value_of(&codes[c], tl_value_image(&codes[c], i)) == i);
        CHECK(isfinite(tl_value_of(&codes[c], tl_value_image(&codes[c], -1e300))));
    }
    CHECK_EQ(tl_value_image(&codes[0], 0.3), 1);
    CHECK(tl_value_of(&codes[1], tl_value_image(&codes[1], 0.1)) == (double)0.1f);
    CHECK(tl_value_of(&codes[2], tl_value_image(&codes[2], -0.1)) == -0.1);
    CHECK(signbit(tl_value_of(&codes[2], tl_value_image(&codes[2], -0.0))));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(float_images_are_ordered_and_exact),
                                       cmocka_unit_test(lattice_places_are_exact_and_nearest),
                                       cmocka_unit_test(values_have_images)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
