/* Single tets: volume, shape, angles, weights, nearest point, on known and random tets, flat ones
 * too. */
#include "make_mesh.h"

#define CORNERS(p) ((const double(*)[3])(p))

static const double corner[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const double regular[4][3] = {{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}};

static void random_tet(double p[4][3], uint64_t *seed)
{
    for (int i = 0; i < 12; i++) p[i / 3][i % 3] = 2 * make_uniform(seed) - 1;
}

static void test_known(void **state)
{
    (void)state;
    double low, high, turned[4][3];
    CHECK_NEAR(tl_tet_volume(corner), 1.0 / 6, 1e-16);
    CHECK_NEAR(fabs(tl_tet_volume(regular)), 8.0 / 3, 1e-15);
    CHECK_NEAR(fabs(tl_tet_quality(regular)), 1, 1e-15);
    CHECK_NEAR(tl_tet_quality(corner), 12 * cbrt(0.25) / 9, 1e-15);
    tl_tet_dihedral(regular, &low, &high);
    CHECK_NEAR(low, acos(1.0 / 3), 1e-14);
    CHECK_NEAR(high, acos(1.0 / 3), 1e-14);
    tl_tet_dihedral(corner, &low, &high);
    CHECK_NEAR(low, acos(1 / sqrt(3.0)), 1e-14);
    CHECK_NEAR(high, acos(0.0), 1e-14);
    memcpy(turned, corner, sizeof turned);
    memcpy(turned[1], corner[2], sizeof turned[1]);
    memcpy(turned[2], corner[1], sizeof turned[2]);
    CHECK_NEAR(tl_tet_volume(CORNERS(turned)), -1.0 / 6, 1e-16);
    CHECK_NEAR(tl_tet_quality(CORNERS(turned)), -12 * cbrt(0.25) / 9, 1e-15);
    tl_tet_dihedral(CORNERS(turned), &low, &high);
    CHECK_NEAR(low, acos(1 / sqrt(3.0)), 1e-14);
    CHECK_NEAR(high, acos(0.0), 1e-14);
}

/* Six angles of a random tet, each between the two smallest possible planes; the sum over a
 * corner's three edges is above pi. */
static void test_scale_and_shift(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int run = 0; run < 200; run++) {
        double p[4][3], q[4][3], low[2], high[2];
        random_tet(p, &seed);
        for (int i = 0; i < 12; i++) q[i / 3][i % 3] = 1e-6 * p[i / 3][i % 3] + 0.25;
        CHECK_NEAR(tl_tet_volume(CORNERS(q)), 1e-18 * tl_tet_volume(CORNERS(p)), 1e-27);
        CHECK_NEAR(tl_tet_quality(CORNERS(q)), tl_tet_quality(CORNERS(p)), 1e-6);
        tl_tet_dihedral(CORNERS(p), &low[0], &high[0]);
        CHECK(low[0] > 0 && low[0] <= acos(1.0 / 3) + 1e-12 && high[0] < acos(-1.0));
        CHECK(high[0] >= acos(1.0 / 3) - 1e-12);
        CHECK(fabs(tl_tet_quality(CORNERS(p))) <= 1);
    }
}

static void test_weights(void **state)
{
    (void)state;
    uint64_t seed = 2;
    double w[4], x[3];
    for (int run = 0; run < 500; run++) {
        double p[4][3], sum = 0;
        random_tet(p, &seed);
        for (int k = 0; k < 3; k++) x[k] = 4 * make_uniform(&seed) - 2;
        double size = 1 / fabs(tl_tet_volume(CORNERS(p)));
        CHECK(tl_tet_weights(CORNERS(p), x, w));
        for (int i = 0; i < 4; i++) sum += w[i];
        CHECK_NEAR(sum, 1, 1e-14 * size);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(w[0] * p[0][k] + w[1] * p[1][k] + w[2] * p[2][k] + w[3] * p[3][k], x[k],
                       1e-13 * size);
    }
    double flat[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 0}};
    CHECK(!tl_tet_weights(CORNERS(flat), x, w));
    flat[3][2] = 1e-300; /* not flat, but its volume is hardly a number */
    double in[3] = {0.3, 0.3, 0};
    if (tl_tet_weights(CORNERS(flat), in, w)) CHECK_NEAR(w[0] + w[1] + w[2] + w[3], 1, 1e-12);
}

/* A point q of a convex body is nearest to x exactly if no corner lies beyond q as seen along x -
 * q. */
static void check_nearest(const double p[4][3], const double x[3])
{
    double w[4], q[3] = {0, 0, 0}, sum = 0, square = 0, size = 0;
    double distance = tl_tet_nearest(p, x, w);
    for (int i = 0; i < 4; i++) {
        CHECK(w[i] >= 0);
        sum += w[i];
        for (int k = 0; k < 3; k++) {
            q[k] += w[i] * p[i][k];
            size = fmax(size, fabs(p[i][k] - x[k]));
        }
    }
    CHECK_NEAR(sum, 1, 1e-14);
    for (int k = 0; k < 3; k++) square += (x[k] - q[k]) * (x[k] - q[k]);
    CHECK_NEAR(distance, sqrt(square), 1e-9 * size);
    for (int i = 0; i < 4; i++) {
        double along = 0;
        for (int k = 0; k < 3; k++) along += (p[i][k] - q[k]) * (x[k] - q[k]);
        CHECK(along <= 1e-9 * size * size);
    }
}

static void test_nearest(void **state)
{
    (void)state;
    uint64_t seed = 3;
    for (int run = 0; run < 20000; run++) {
        double p[4][3], x[3];
        random_tet(p, &seed);
        for (int k = 0; k < 3; k++) x[k] = 3 * make_uniform(&seed) - 1.5;
        int kind = run % 8;
        if (kind == 1) memcpy(p[1], p[0], sizeof p[0]);
        if (kind == 2) p[0][2] = p[1][2] = p[2][2] = p[3][2] = 0.5;
        if (kind == 3) memcpy(p[1], p[0], sizeof p[0]), memcpy(p[2], p[0], sizeof p[0]);
        if (kind == 4) memcpy(x, p[run % 4], sizeof x);
        if (kind == 5)
            for (int k = 0; k < 3; k++) p[2][k] = 0.5 * p[0][k] + 0.5 * p[1][k];
        if (kind == 6)
            for (int i = 1; i < 4; i++) memcpy(p[i], p[0], sizeof p[0]);
        if (kind == 7)
            for (int k = 0; k < 3; k++) p[3][k] = p[0][k] + 1e-9 * p[3][k];
        check_nearest(CORNERS(p), x);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known),
        cmocka_unit_test(test_scale_and_shift),
        cmocka_unit_test(test_weights),
        cmocka_unit_test(test_nearest),
    };
    return cmocka_run_group_tests_name("mesh_tet", tests, NULL, NULL);
}
