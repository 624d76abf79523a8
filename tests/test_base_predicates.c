/* Orientation and in-sphere signs against exact rational numbers (GMP): random, flat, cospherical,
 * one or two roundings beside flat, far from the origin, at scales from 1e-6 to 1e6, and with
 * coordinates of very different size. */
#include "check.h"

#include "base/base.h"
#include "base/base_predicates.h"

#include <gmp.h>

#define ORIENT_ROUNDS 6000
#define INSPHERE_ROUNDS 2000
#define TIMED_POINTS 1000

/* ---- the oracle ---- */

static void set_differences(mpq_t out[3], const double p[3], const double origin[3])
{
    mpq_t o;
    mpq_init(o);
    for (int k = 0; k < 3; k++) {
        mpq_set_d(out[k], p[k]);
        mpq_set_d(o, origin[k]);
        mpq_sub(out[k], out[k], o);
    }
    mpq_clear(o);
}

/* out = | p q r | */
static void determinant(mpq_t out, mpq_t p[3], mpq_t q[3], mpq_t r[3])
{
    mpq_t one, other;
    mpq_inits(one, other, NULL);
    mpq_set_ui(out, 0, 1);
    for (int k = 0; k < 3; k++) {
        int l = (k + 1) % 3, m = (k + 2) % 3;
        mpq_mul(one, p[l], q[m]);
        mpq_mul(other, p[m], q[l]);
        mpq_sub(one, one, other);
        mpq_mul(one, one, r[k]);
        mpq_add(out, out, one);
    }
    mpq_clears(one, other, NULL);
}

static void vectors_init(mpq_t (*v)[3], int count)
{
    for (int i = 0; i < count; i++) mpq_inits(v[i][0], v[i][1], v[i][2], NULL);
}

static void vectors_clear(mpq_t (*v)[3], int count)
{
    for (int i = 0; i < count; i++) mpq_clears(v[i][0], v[i][1], v[i][2], NULL);
}

static int oracle_orient3d(double p[4][3])
{
    mpq_t v[3][3], sum;
    mpq_init(sum);
    vectors_init(v, 3);
    for (int i = 0; i < 3; i++) set_differences(v[i], p[i + 1], p[0]);
    determinant(sum, v[0], v[1], v[2]);
    int sign = mpq_sgn(sum);
    vectors_clear(v, 3);
    mpq_clear(sum);
    return sign;
}

/* The 4 x 4 determinant of differences to e and squares of their lengths, by its last column. */
static int oracle_insphere(double p[5][3])
{
    static const int rows[4][3] = {{1, 2, 3}, {2, 0, 3}, {0, 1, 3}, {1, 0, 2}};
    mpq_t v[4][3], sum, term, square, length;
    mpq_inits(sum, term, square, length, NULL);
    vectors_init(v, 4);
    for (int i = 0; i < 4; i++) set_differences(v[i], p[i], p[4]);
    for (int i = 0; i < 4; i++) {
        mpq_set_ui(length, 0, 1);
        for (int k = 0; k < 3; k++) {
            mpq_mul(square, v[i][k], v[i][k]);
            mpq_add(length, length, square);
        }
        determinant(term, v[rows[i][0]], v[rows[i][1]], v[rows[i][2]]);
        mpq_mul(term, term, length);
        mpq_add(sum, sum, term);
    }
    int sign = mpq_sgn(sum);
    vectors_clear(v, 4);
    mpq_clears(sum, term, square, length, NULL);
    return sign;
}

/* ---- points ---- */

static uint64_t random_state;

static uint64_t random_u64(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return random_state;
}

/* In [-1, 1) */
static double random_unit(void)
{
    return (double)(int64_t)random_u64() * 0x1p-63;
}

/* Up to two roundings; what is 0 gets the noise that a value of 1 would have. */
static void nudge(double *x)
{
    int steps = (int)(random_u64() % 5) - 2;
    if (*x == 0) {
        *x = steps * 0x1p-53;
        return;
    }
    for (; steps > 0; steps--) *x = nextafter(*x, HUGE_VAL);
    for (; steps < 0; steps++) *x = nextafter(*x, -HUGE_VAL);
}

typedef enum shape {
    SHAPE_RANDOM,
    SHAPE_GRID,       /* small integers */
    SHAPE_PLANE,      /* the last ones on the plane of the first three, rounded */
    SHAPE_PLANE_NEAR, /* and up to two roundings beside it */
    SHAPE_SPHERE,     /* on a sphere, rounded */
    SHAPE_CUBE,       /* corners of a box: exactly on a sphere */
    SHAPE_CUBE_NEAR,
    SHAPE_WILD,  /* exponents from -40 to 40 */
    SHAPE_TWINS, /* the same point twice */
    SHAPE_COUNT
} shape;

static const char *const shape_names[SHAPE_COUNT] = {
    "random", "grid", "plane", "plane+-", "sphere", "cube", "cube+-", "exponents", "twins"};

static void make_point(shape s, double (*p)[3], int i)
{
    double u = random_unit(), v = random_unit();
    for (int k = 0; k < 3; k++) {
        p[i][k] = random_unit();
        if (s == SHAPE_GRID) p[i][k] = (double)(random_u64() % 5);
        if (s == SHAPE_WILD) p[i][k] = ldexp(p[i][k], (int)(random_u64() % 81) - 40);
        if (s == SHAPE_CUBE || s == SHAPE_CUBE_NEAR) p[i][k] = (double)(random_u64() & 1);
        if ((s == SHAPE_PLANE || s == SHAPE_PLANE_NEAR) && i > 2)
            p[i][k] = p[0][k] + u * (p[1][k] - p[0][k]) + v * (p[2][k] - p[0][k]);
    }
    if (s == SHAPE_SPHERE) {
        double length = sqrt(p[i][0] * p[i][0] + p[i][1] * p[i][1] + p[i][2] * p[i][2]);
        for (int k = 0; k < 3; k++) p[i][k] /= length;
    }
    if (s == SHAPE_TWINS && i == 3) memcpy(p[i], p[0], sizeof p[i]);
}

/* Scale first, then shift: both round, which is what flat tets of real meshes look like. */
static void make_points(shape s, double (*p)[3], int count, double scale, double shift)
{
    for (int i = 0; i < count; i++) make_point(s, p, i);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            p[i][k] = p[i][k] * scale + shift * (k + 1);
            if (s == SHAPE_PLANE_NEAR || s == SHAPE_CUBE_NEAR) nudge(&p[i][k]);
        }
}

static const double scales[] = {1, 1e-6, 1e-3, 1e3, 1e6, 1.0 / 3};
static const double shifts[] = {0, 1e6, 0.1, -1e3};

static void pick_frame(int round, double *scale, double *shift)
{
    *scale = scales[(size_t)round % (sizeof scales / sizeof *scales)];
    *shift = shifts[(size_t)round / 8 % (sizeof shifts / sizeof *shifts)];
}

/* ---- tests ---- */

static void test_orient3d_agrees_with_rationals(void **state)
{
    (void)state;
    random_state = 0x9e3779b97f4a7c15u;
    int zeros_of_all = 0;
    for (shape s = 0; s < SHAPE_COUNT; s++) {
        int zeros = 0, hard = 0;
        for (int round = 0; round < ORIENT_ROUNDS; round++) {
            double p[4][3], scale, shift;
            pick_frame(round, &scale, &shift);
            make_points(s, p, 4, scale, shift);
            int expected = oracle_orient3d(p);
            CHECK_EQ(tli_orient3d(p[0], p[1], p[2], p[3]), expected);
            CHECK_EQ(tli_orient3d_exact(p[0], p[1], p[2], p[3]), expected);
            CHECK_EQ(tli_orient3d(p[1], p[0], p[2], p[3]), -expected);
            CHECK_EQ(tli_orient3d(p[2], p[3], p[0], p[1]), expected);
            double approx = tli_orient3d_approx(p[0], p[1], p[2], p[3]);
            hard += (approx > 0) - (approx < 0) != expected;
            zeros += !expected;
        }
        printf("orient3d %-9s %d cases, %d flat, %d where plain arithmetic is wrong: ok\n",
               shape_names[s], ORIENT_ROUNDS, zeros, hard);
        zeros_of_all += zeros;
        if (s == SHAPE_PLANE_NEAR) CHECK(hard > 100); /* else the test is too easy to mean much */
    }
    CHECK(zeros_of_all > 1000);
}

static void test_insphere_agrees_with_rationals(void **state)
{
    (void)state;
    random_state = 0x2545f4914f6cdd1du;
    int zeros_of_all = 0;
    for (shape s = 0; s < SHAPE_COUNT; s++) {
        int zeros = 0;
        for (int round = 0; round < INSPHERE_ROUNDS; round++) {
            double p[5][3], scale, shift;
            pick_frame(round, &scale, &shift);
            make_points(s, p, 5, scale, shift);
            int expected = oracle_insphere(p);
            CHECK_EQ(tli_insphere(p[0], p[1], p[2], p[3], p[4]), expected);
            CHECK_EQ(tli_insphere(p[1], p[0], p[2], p[3], p[4]), -expected);
            zeros += !expected;
        }
        printf("insphere %-9s %d cases, %d cospherical: ok\n", shape_names[s], INSPHERE_ROUNDS,
               zeros);
        zeros_of_all += zeros;
    }
    CHECK(zeros_of_all > 1000);
}

/* Signs of cases that can be read off: the conventions of the header. */
static void test_conventions(void **state)
{
    (void)state;
    const double o[3] = {0, 0, 0}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1};
    const double in[3] = {0.5, 0.5, 0.5}, out[3] = {2, 0, 0}, on[3] = {1, 1, 1};
    CHECK_EQ(tli_orient3d(o, x, y, z), 1);
    CHECK_EQ(tli_orient3d(x, o, y, z), -1);
    CHECK_EQ(tli_orient3d(o, x, y, x), 0);
    CHECK_EQ(tli_orient3d(o, o, o, o), 0);
    CHECK_NEAR(tli_orient3d_approx(o, x, y, z), 1.0, 0.0);
    CHECK_EQ(tli_insphere(o, x, y, z, in), 1);
    CHECK_EQ(tli_insphere(o, x, y, z, out), -1);
    CHECK_EQ(tli_insphere(o, x, y, z, on), 0);
}

/* The ends of the range that the header promises. */
static void test_range(void **state)
{
    (void)state;
    random_state = 0x51ed2701a3b4c5d6u;
    for (int round = 0; round < 400; round++) {
        double p[5][3];
        make_points(round & 1 ? SHAPE_PLANE_NEAR : SHAPE_GRID, p, 5, round & 2 ? 1e-79 : 1e99, 0);
        CHECK_EQ(tli_orient3d(p[0], p[1], p[2], p[3]), oracle_orient3d(p));
        make_points(round & 1 ? SHAPE_CUBE_NEAR : SHAPE_GRID, p, 5, round & 2 ? 1e-44 : 1e59, 0);
        CHECK_EQ(tli_insphere(p[0], p[1], p[2], p[3], p[4]), oracle_insphere(p));
    }
}

static double time_orient3d(double (*p)[3], int rounds)
{
    long sum = 0;
    double start = tli_clock_s();
    for (int r = 0; r < rounds; r++)
        for (int i = 0; i < TIMED_POINTS; i++)
            sum += tli_orient3d(p[i], p[i + 1], p[i + 2], p[i + 3]);
    double ns = 1e9 * (tli_clock_s() - start) / rounds / TIMED_POINTS;
    CHECK(labs(sum) <= (long)rounds * TIMED_POINTS);
    return ns;
}

static double time_insphere(double (*p)[3], int rounds)
{
    long sum = 0;
    double start = tli_clock_s();
    for (int r = 0; r < rounds; r++)
        for (int i = 0; i < TIMED_POINTS; i++)
            sum += tli_insphere(p[i], p[i + 1], p[i + 2], p[i + 3], p[i + 4]);
    double ns = 1e9 * (tli_clock_s() - start) / rounds / TIMED_POINTS;
    CHECK(labs(sum) <= (long)rounds * TIMED_POINTS);
    return ns;
}

/* Prints the figures of the note on predicates; no bound, for machines differ. */
static void test_prints_times(void **state)
{
    (void)state;
    static double p[TIMED_POINTS + 4][3];
    random_state = 0x0123456789abcdefu;
    make_points(SHAPE_RANDOM, p, TIMED_POINTS + 4, 1, 0);
    printf("decided by the filter: orient3d %.1f ns, insphere %.1f ns\n", time_orient3d(p, 2000),
           time_insphere(p, 500));
    make_points(SHAPE_GRID, p, TIMED_POINTS + 4, 1, 0);
    for (int i = 0; i < TIMED_POINTS + 4; i++) p[i][2] = p[i][0];
    printf("flat, differences exact: orient3d %.0f ns, insphere %.0f ns\n", time_orient3d(p, 100),
           time_insphere(p, 20));
    make_points(SHAPE_RANDOM, p, TIMED_POINTS + 4, 1, 0);
    for (int i = 0; i < TIMED_POINTS + 4; i++) p[i][2] = 0.5 * p[i][0];
    printf("flat, differences rounded: orient3d %.0f ns, insphere %.0f ns\n", time_orient3d(p, 20),
           time_insphere(p, 5));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_conventions),
        cmocka_unit_test(test_orient3d_agrees_with_rationals),
        cmocka_unit_test(test_insphere_agrees_with_rationals),
        cmocka_unit_test(test_range),
        cmocka_unit_test(test_prints_times),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
