/* What colour maps promise: points over 0 to 1, lightness (CIE 1976) that rises, falls evenly to
 * both sides of a diverging middle, or stays as it goes around. */
#include <math.h>
#include <string.h>

#include "tetralod/draw.h"

#include "check.h"

static double linear_of(double c)
{
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

static double lightness(const double rgb[3])
{
    const double y =
        0.2126 * linear_of(rgb[0]) + 0.7152 * linear_of(rgb[1]) + 0.0722 * linear_of(rgb[2]);
    return y > 216.0 / 24389 ? 116 * cbrt(y) - 16 : y * 24389 / 27;
}

static void points_over_0_to_1(void **state)
{
    (void)state;
    const char *name;
    for (size_t i = 0; (name = tl_colormap_name(i)) != NULL; i++) {
        size_t count;
        const tl_color_point *map = tl_colormap(name, &count);
        CHECK(map && count >= 2 && map[0].value == 0 && map[count - 1].value == 1);
        for (size_t p = 0; p < count; p++) {
            CHECK(!p || map[p].value > map[p - 1].value);
            for (int k = 0; k < 3; k++) CHECK(map[p].rgb[k] >= 0 && map[p].rgb[k] <= 1);
        }
    }
    CHECK(!tl_colormap("pink", &(size_t){0}) && !tl_colormap_is_diverging("pink"));
}

/* Of 100: colours have three digits, and one component is a little outside of sRGB. */
static const double LIGHTNESS_ERROR = 0.1;

static void lightness_is_even(void **state)
{
    static const char *const RISING[] = {"viridis", "inferno", "magma",
                                         "plasma",  "cividis", "grey"};
    (void)state;
    size_t count;
    for (size_t i = 0; i < sizeof RISING / sizeof *RISING; i++) {
        const tl_color_point *map = tl_colormap(RISING[i], &count);
        CHECK(!tl_colormap_is_diverging(RISING[i]));
        for (size_t p = 1; p < count; p++) CHECK(lightness(map[p].rgb) > lightness(map[p - 1].rgb));
    }
    double worst = 0;
    const tl_color_point *map = tl_colormap("blue-to-brown", &count);
    CHECK(tl_colormap_is_diverging("blue-to-brown"));
    for (size_t p = 0; p < count; p++)
        worst = fmax(worst, fabs(lightness(map[p].rgb) - (96 - 72 * fabs(2 * map[p].value - 1))));
    CHECK_BOUND("lightness of blue-to-brown", worst, LIGHTNESS_ERROR);
    worst = 0;
    map = tl_colormap("phase", &count);
    CHECK(!tl_colormap_is_diverging("phase"));
    for (size_t p = 0; p < count; p++) worst = fmax(worst, fabs(lightness(map[p].rgb) - 66));
    CHECK_BOUND("lightness of phase", worst, LIGHTNESS_ERROR);
    CHECK_EQ(memcmp(map[0].rgb, map[count - 1].rgb, sizeof map[0].rgb), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(points_over_0_to_1),
                                       cmocka_unit_test(lightness_is_even)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
