/* Surfaces of stage measure: nearest triangles against brute force, distances with known values,
 * the certified bound against dense samples, isosurfaces with known places and areas. */
#include "check_ctx.h"

#include "fail_alloc.h"
#include "make_mesh.h"
#include "measure/measure.h"

/* ---- surfaces to test with ---- */

typedef struct soup {
    double *xyz;
    size_t vert_count;
    tl_lidx *triangles;
    size_t triangle_count;
} soup;

static soup soup_room(size_t vert_count, size_t triangle_count)
{
    soup s = {calloc(3 * vert_count + 1, sizeof(double)), vert_count,
              calloc(3 * triangle_count + 1, sizeof(tl_lidx)), triangle_count};
    if (!s.xyz || !s.triangles) abort();
    return s;
}

static void soup_release(soup *s)
{
    free(s->xyz);
    free(s->triangles);
}

static tli_surface make_surface(tl_ctx *ctx, const soup *s)
{
    tli_surface surface;
    CHECK_OK(ctx, tli_surface_create(ctx, s->xyz, s->vert_count, s->triangles, s->triangle_count,
                                     &surface));
    return surface;
}

/* n x n cells over [0, 1]^2, placed by a function of (u, v). */
typedef void (*place_fn)(double u, double v, const double param[], double x[3]);

static soup make_sheet(size_t n, place_fn place, const double param[])
{
    soup s = soup_room((n + 1) * (n + 1), 2 * n * n);
    for (size_t i = 0; i < s.vert_count; i++)
        place((double)(i % (n + 1)) / (double)n, (double)(i / (n + 1)) / (double)n, param,
              s.xyz + 3 * i);
    for (size_t c = 0; c < n * n; c++) {
        tl_lidx a = (tl_lidx)(c % n + (n + 1) * (c / n)), b = a + 1, d = a + (tl_lidx)n + 1;
        const tl_lidx two[6] = {a, b, d, b, d + 1, d};
        memcpy(s.triangles + 6 * c, two, sizeof two);
    }
    return s;
}

/* param: height, tilt (radians, about the line u = 0) */
static void place_plane(double u, double v, const double param[], double x[3])
{
    x[0] = u * cos(param[1]);
    x[1] = v;
    x[2] = param[0] + u * sin(param[1]);
}

/* param: radius */
static void place_sphere(double u, double v, const double param[], double x[3])
{
    const double pi = acos(-1);
    x[0] = param[0] * sin(pi * v) * cos(2 * pi * u);
    x[1] = param[0] * sin(pi * v) * sin(2 * pi * u);
    x[2] = param[0] * cos(pi * v);
}

/* param: height, wavelength */
static void place_wave(double u, double v, const double param[], double x[3])
{
    x[0] = u;
    x[1] = v;
    x[2] = param[0] * sin(u / param[1]) * cos(v / param[1]);
}

/* param: where the valley's bottom is */
static void place_valley(double u, double v, const double param[], double x[3])
{
    x[0] = u - param[0];
    x[1] = v;
    x[2] = fabs(x[0]);
}

static soup make_random_soup(size_t triangle_count, double size, uint64_t seed)
{
    soup s = soup_room(3 * triangle_count, triangle_count);
    for (size_t t = 0; t < triangle_count; t++) {
        double center[3];
        for (size_t k = 0; k < 3; k++) center[k] = make_uniform(&seed);
        for (size_t i = 0; i < 9; i++)
            s.xyz[9 * t + i] = center[i % 3] + size * (make_uniform(&seed) - 0.5);
        if (t % 7 == 0) memcpy(s.xyz + 9 * t + 3, s.xyz + 9 * t, 3 * sizeof(double)); /* a line */
        if (t % 11 == 0) memcpy(s.xyz + 9 * t + 6, s.xyz + 9 * t, 3 * sizeof(double));
        for (size_t i = 0; i < 3; i++) s.triangles[3 * t + i] = (tl_lidx)(3 * t + i);
    }
    return s;
}

static tli_surface_error compare_soups(tl_ctx *ctx, const soup *a, const soup *b, double step)
{
    tli_surface_error error;
    tli_surface sa = make_surface(ctx, a), sb = make_surface(ctx, b);
    CHECK_OK(ctx, tli_surface_compare(ctx, "boundary", &sa, &sb, step, &error));
    tli_surface_release(&sa);
    tli_surface_release(&sb);
    return error;
}

/* ---- nearest ---- */

/* The distance to a triangle by the distances to its points on a fine lattice. */
static double distance2_by_points(const double t[9], const double x[3], int n)
{
    double best = (double)INFINITY;
    for (int i = 0; i <= n; i++) {
        for (int j = 0; i + j <= n; j++) {
            double d2 = 0;
            for (int k = 0; k < 3; k++) {
                double p = t[k] + i * (t[3 + k] - t[k]) / n + j * (t[6 + k] - t[k]) / n - x[k];
                d2 += p * p;
            }
            best = fmin(best, d2);
        }
    }
    return best;
}

static void triangle_distances(void **state)
{
    uint64_t seed = 5;
    enum { LATTICE = 60 };
    (void)state;
    for (int n = 0; n < 400; n++) {
        double t[9], x[3];
        for (int i = 0; i < 9; i++) t[i] = make_uniform(&seed);
        for (int i = 0; i < 3; i++) x[i] = 3 * make_uniform(&seed) - 1;
        if (n % 5 == 1) memcpy(t + 3, t, 3 * sizeof *t);
        if (n % 5 == 2) memcpy(t + 6, t + 3, 3 * sizeof *t);
        if (n % 5 == 3) /* nearly a line */
            for (int k = 0; k < 3; k++) t[6 + k] = (t[k] + t[3 + k]) / 2 + 1e-9 * x[k];
        double d = sqrt(tli_triangle_distance2(t, t + 3, t + 6, x));
        double lattice = sqrt(distance2_by_points(t, x, LATTICE));
        CHECK(d <= lattice + 1e-12);
        CHECK(d >= lattice - sqrt(3.0) / LATTICE);
    }
    const double a[3] = {0, 0, 0}, b[3] = {4, 0, 0}, c[3] = {0, 4, 0};
    const double above[3] = {1, 1, 3}, corner[3] = {-3, -4, 0}, side[3] = {4, 4, 1},
                 beyond[3] = {9, -5, 0};
    CHECK(tli_triangle_distance2(a, b, c, above) == 9);
    CHECK(tli_triangle_distance2(a, b, c, corner) == 25);
    CHECK_NEAR(tli_triangle_distance2(a, b, c, side), 9, 1e-14);
    CHECK(tli_triangle_distance2(a, b, c, beyond) == 50);
    CHECK(tli_triangle_distance2(a, b, c, b) == 0);
    CHECK(tli_triangle_distance2(a, b, c, c) == 0);
}

static void nearest_as_brute_force(void **state)
{
    static const size_t counts[] = {1, 2, 3, 4, 5, 16, 17, 300, 3000};
    uint64_t seed = 77;
    tl_ctx *ctx = check_ctx_create(2);
    (void)state;
    for (size_t n = 0; n < sizeof counts / sizeof *counts; n++) {
        soup s = make_random_soup(counts[n], 0.1, n + 1);
        tli_surface surface = make_surface(ctx, &s);
        CHECK_EQ(surface.triangle_count, counts[n]);
        for (int i = 0; i < 200; i++) {
            double x[3], best = (double)INFINITY;
            for (int k = 0; k < 3; k++) x[k] = 1.6 * make_uniform(&seed) - 0.3;
            for (size_t t = 0; t < counts[n]; t++)
                best = fmin(best, tli_surface_distance2(&surface, (tl_lidx)t, x));
            tl_lidx found,
                hint = i % 2 ? (tl_lidx)(make_random(&seed) % counts[n]) : (tl_lidx)TL_NONE;
            CHECK(tli_surface_nearest(&surface, x, hint, &found) == best);
            CHECK(tli_surface_distance2(&surface, found, x) == best);
        }
        tli_surface_release(&surface);
        soup_release(&s);
    }
    check_ctx_destroy(ctx);
}

/* ---- distances ---- */

static void identical_is_zero(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    const double wave[] = {0.1, 0.07}, ball[] = {1};
    soup s[3] = {make_sheet(20, place_wave, wave), make_sheet(17, place_sphere, ball),
                 make_random_soup(500, 0.2, 3)};
    (void)state;
    for (int i = 0; i < 3; i++) {
        tli_surface_error e = compare_soups(ctx, &s[i], &s[i], 0.01);
        CHECK(e.mean == 0);
        for (int side = 0; side < 2; side++) CHECK(e.one_sided[side] == 0 && e.bound[side] == 0);
        CHECK(e.samples > 0);

        soup turned = soup_room(s[i].vert_count, s[i].triangle_count);
        memcpy(turned.xyz, s[i].xyz, 3 * s[i].vert_count * sizeof *turned.xyz);
        for (size_t n = 0; n < 3 * s[i].triangle_count; n++)
            turned.triangles[n] = s[i].triangles[3 * s[i].triangle_count - 1 - n];
        e = compare_soups(ctx, &s[i], &turned, 0.01);
        CHECK_BOUND("mean between reordered surfaces", e.mean, 1e-13);
        for (int side = 0; side < 2; side++)
            CHECK_BOUND("bound between reordered surfaces", e.bound[side], 1e-11);
        soup_release(&turned);
        soup_release(&s[i]);
    }
    check_ctx_destroy(ctx);
}

static void parallel_planes(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    const double low[] = {0, 0};
    (void)state;
    for (int n = 0; n < 3; n++) {
        const double high[] = {n == 0 ? 1e-3 : n == 1 ? 1e-9 : 0, 0};
        soup a = make_sheet(31, place_plane, low), b = make_sheet(7, place_plane, high);
        tli_surface_error e = compare_soups(ctx, &a, &b, 0.02);
        CHECK_NEAR(e.mean, high[0], 1e-14);
        for (int side = 0; side < 2; side++) {
            CHECK_NEAR(e.one_sided[side], high[0], 1e-14);
            CHECK_BOUND("bound between planes", e.bound[side], high[0] * 1.01 + 0.001 * 0.02);
            CHECK(e.bound[side] >= e.one_sided[side]);
        }
        soup_release(&a);
        soup_release(&b);
    }
    check_ctx_destroy(ctx);
}

/* The distance to a plane grows linearly: the trapezoidal rule is exact whatever the step. */
static void tilted_planes(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    const double flat[] = {0, 0}, tilt[] = {0, 0.3};
    static const double steps[] = {10, 0.3, 0.04, 0.011};
    (void)state;
    for (int n = 0; n < 4; n++) {
        soup a = make_sheet(3, place_plane, flat), b = make_sheet(2, place_plane, tilt);
        tli_surface_error e = compare_soups(ctx, &a, &b, steps[n]);
        CHECK_NEAR(e.mean, sin(0.3) / 2, 1e-14);
        for (int side = 0; side < 2; side++) {
            CHECK_NEAR(e.one_sided[side], sin(0.3), 1e-14);
            CHECK_BOUND("bound between tilted planes", e.bound[side],
                        sin(0.3) * 1.01 + 0.001 * steps[n]);
        }
        soup_release(&a);
        soup_release(&b);
    }
    check_ctx_destroy(ctx);
}

static soup make_box(double low, double high)
{
    static const tl_lidx faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                        {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    soup s = soup_room(8, 12);
    for (size_t v = 0; v < 8; v++)
        for (size_t k = 0; k < 3; k++) s.xyz[3 * v + k] = v >> k & 1 ? high : low;
    for (size_t f = 0; f < 6; f++)
        for (size_t i = 0; i < 6; i++)
            s.triangles[6 * f + i] = faces[f][i < 3 ? i : i == 3 ? 0 : i - 2];
    return s;
}

static void nested_boxes(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    soup inner = make_box(0, 1), outer = make_box(-0.05, 1.05);
    (void)state;
    tli_surface_error e = compare_soups(ctx, &inner, &outer, 0.02);
    CHECK_NEAR(e.one_sided[0], 0.05, 1e-14);
    CHECK_NEAR(e.one_sided[1], 0.05 * sqrt(3.0), 1e-14);
    CHECK_BOUND("bound inner to outer box", e.bound[0], 0.05 * 1.01);
    CHECK_BOUND("bound outer to inner box", e.bound[1], 0.05 * sqrt(3.0) * 1.01);
    CHECK(e.mean > 0.05 && e.mean < 0.052);
    soup_release(&inner);
    soup_release(&outer);
    check_ctx_destroy(ctx);
}

static void concentric_spheres(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    const double small[] = {1}, large[] = {1.1};
    soup a = make_sheet(80, place_sphere, small), b = make_sheet(60, place_sphere, large);
    (void)state;
    tli_surface_error e = compare_soups(ctx, &a, &b, 0.02);
    /* chords lie below the sphere by at most r (1 - cos(half angle)), two angles a cell */
    double sag = 1.1 * (1 - cos(acos(-1) / 60)) * 2;
    CHECK_NEAR(e.mean, 0.1, sag);
    for (int side = 0; side < 2; side++) {
        CHECK_NEAR(e.one_sided[side], 0.1, sag);
        CHECK_BOUND("bound between spheres", e.bound[side], e.one_sided[side] * 1.01);
    }
    soup_release(&a);
    soup_release(&b);
    check_ctx_destroy(ctx);
}

/* Over the bottom of a valley both slopes are equally far: the largest distance, far from any
 * corner and from any side of a prism. */
static void over_a_valley(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    const double bottom[] = {0.4}, low[] = {0.2, 0};
    soup plane = make_sheet(1, place_plane, low), valley = make_sheet(50, place_valley, bottom);
    (void)state;
    for (size_t v = 0; v < plane.vert_count; v++) plane.xyz[3 * v] = 0.6 * plane.xyz[3 * v] - 0.3;
    tli_surface_error e = compare_soups(ctx, &plane, &valley, 0.3);
    CHECK_NEAR(e.one_sided[0], 0.2 / sqrt(2), 0.01 * 0.2 / sqrt(2));
    CHECK(e.bound[0] >= 0.2 / sqrt(2) - 1e-15);
    CHECK_BOUND("bound over a valley", e.bound[0], 0.2 / sqrt(2) * 1.01);
    CHECK_NEAR(e.one_sided[1], 0.5, 1e-14);
    CHECK_BOUND("bound from a valley", e.bound[1], 0.5 * 1.01);
    soup_release(&plane);
    soup_release(&valley);
    check_ctx_destroy(ctx);
}

/* The largest distance of points on a lattice on every triangle. */
static double dense_one_sided(tl_ctx *ctx, const soup *a, const soup *b, int n)
{
    double largest = 0;
    tli_surface sb = make_surface(ctx, b);
    tl_lidx nearest = TL_NONE;
    for (size_t t = 0; t < a->triangle_count; t++) {
        const double *p[3];
        for (size_t i = 0; i < 3; i++) p[i] = a->xyz + 3 * (size_t)a->triangles[3 * t + i];
        for (int i = 0; i <= n; i++) {
            for (int j = 0; i + j <= n; j++) {
                double x[3];
                for (int k = 0; k < 3; k++)
                    x[k] = p[0][k] + i * (p[1][k] - p[0][k]) / n + j * (p[2][k] - p[0][k]) / n;
                largest = fmax(largest, tli_surface_nearest(&sb, x, nearest, &nearest));
            }
        }
    }
    tli_surface_release(&sb);
    return sqrt(largest);
}

/* Large triangles over a wavy surface: the largest distance is somewhere inside of them, between
 * samples that are far too coarse. */
static void bound_between_samples(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    const double flat[] = {0.03, 0}, wave[] = {0.1, 0.05};
    soup a = make_sheet(1, place_plane, flat), b = make_sheet(70, place_wave, wave);
    (void)state;
    tli_surface_error e = compare_soups(ctx, &a, &b, 0.5);
    double dense[2] = {dense_one_sided(ctx, &a, &b, 400), dense_one_sided(ctx, &b, &a, 8)};
    for (int side = 0; side < 2; side++) {
        double spacing = side == 0 ? 1.0 / 400 : 0.05 / 8;
        CHECK_BOUND("dense samples and the bound", dense[side], e.bound[side]);
        CHECK_BOUND("bound and what was found", e.bound[side],
                    fmax(e.one_sided[side] * 1.01, e.one_sided[side] + 0.001 * 0.5));
        CHECK_BOUND("what was found and dense samples", e.one_sided[side], dense[side] + spacing);
    }
    soup_release(&a);
    soup_release(&b);
    check_ctx_destroy(ctx);
}

static void bound_of_soups(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    (void)state;
    for (uint64_t seed = 1; seed < 6; seed++) {
        soup a = make_random_soup(40, 0.5, seed), b = make_random_soup(60, 0.5, seed + 100);
        tli_surface_error e = compare_soups(ctx, &a, &b, 0.1);
        double dense[2] = {dense_one_sided(ctx, &a, &b, 60), dense_one_sided(ctx, &b, &a, 60)};
        for (int side = 0; side < 2; side++) {
            CHECK_BOUND("dense samples and the bound", dense[side], e.bound[side]);
            CHECK_BOUND("bound and what was found", e.bound[side],
                        fmax(e.one_sided[side] * 1.01, e.one_sided[side] + 0.001 * 0.1));
            CHECK(e.one_sided[side] >= dense[side] - 0.01 * dense[side] - 0.01 * 0.1);
        }
        soup_release(&a);
        soup_release(&b);
    }
    check_ctx_destroy(ctx);
}

/* Samples come with the area, not with the longest side. */
static void sample_counts(void **state)
{
    static const double needle[9] = {0, 0, 0, 1, 0, 0, 1, 0.0005, 0};
    tl_ctx *ctx = check_ctx_create(1);
    const double low[] = {0, 0}, high[] = {0.1, 0};
    soup plane = make_sheet(1, place_plane, low), lifted = make_sheet(1, place_plane, high);
    soup thin[2] = {soup_room(3, 1), soup_room(3, 1)};
    (void)state;
    for (size_t i = 0; i < 9; i++) {
        thin[0].xyz[i] = needle[i];
        thin[1].xyz[i] = needle[i] + 1;
        thin[0].triangles[i / 3] = thin[1].triangles[i / 3] = (tl_lidx)(i / 3);
    }
    tli_surface_error e = compare_soups(ctx, &thin[0], &thin[1], 0.001);
    CHECK(e.samples > 2 * 1000 && e.samples < 2 * 3 * 1000);
    e = compare_soups(ctx, &plane, &lifted, 0.01);
    CHECK(e.samples > 2 * 100 * 100 && e.samples < 4 * 100 * 100);
    soup_release(&plane);
    soup_release(&lifted);
    soup_release(&thin[0]);
    soup_release(&thin[1]);
    check_ctx_destroy(ctx);
}

static void empty_surfaces(void **state)
{
    tl_ctx *ctx = check_ctx_create(1);
    const double flat[] = {0, 0};
    soup plane = make_sheet(2, place_plane, flat), none = soup_room(3, 0);
    (void)state;
    tli_surface_error e = compare_soups(ctx, &none, &none, 0.1);
    CHECK(e.mean == 0 && e.bound[0] == 0 && e.bound[1] == 0 && e.samples == 0);
    e = compare_soups(ctx, &plane, &none, 0.1);
    CHECK(isinf(e.mean) && isinf(e.one_sided[0]) && isinf(e.bound[1]));
    soup_release(&plane);
    soup_release(&none);
    check_ctx_destroy(ctx);
}

static void threads_change_nothing(void **state)
{
    static const unsigned threads[] = {1, 2, 7};
    const double wave[] = {0.1, 0.05}, other[] = {0.11, 0.05};
    soup a = make_sheet(60, place_wave, wave), b = make_sheet(23, place_wave, other);
    tli_surface_error e[3];
    (void)state;
    for (int i = 0; i < 3; i++) {
        tl_ctx *ctx = check_ctx_create(threads[i]);
        e[i] = compare_soups(ctx, &a, &b, 0.01);
        check_ctx_destroy(ctx);
        CHECK(memcmp(&e[i], &e[0], sizeof e[0]) == 0);
    }
    CHECK(e[0].mean > 0);
    soup_release(&a);
    soup_release(&b);
}

/* ---- isosurfaces ---- */

static double field_x(const double x[3])
{
    return x[0] + 2 * x[1] - x[2];
}

static double field_radius(const double x[3])
{
    return sqrt((x[0] - 0.5) * (x[0] - 0.5) + (x[1] - 0.5) * (x[1] - 0.5) +
                (x[2] - 0.5) * (x[2] - 0.5));
}

static tli_surface iso_of(tl_ctx *ctx, make_mesh *m, make_field field, double value)
{
    tli_surface surface;
    tl_mesh *mesh = make_object(ctx, m, field);
    CHECK_OK(ctx, tli_iso_surface(ctx, mesh, tl_mesh_channel_by_name(mesh, "f"), value, &surface));
    tl_mesh_destroy(mesh);
    return surface;
}

static void iso_plane(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh fine = make_grid(12), coarse = make_grid(5);
    tli_surface_error e;
    (void)state;
    tli_surface a = iso_of(ctx, &fine, field_x, 0.9), b = iso_of(ctx, &coarse, field_x, 0.9);
    for (size_t v = 0; v < a.vert_count; v++) CHECK_NEAR(field_x(a.xyz + 3 * v), 0.9, 1e-14);
    CHECK_NEAR(a.area, b.area, 1e-12);
    CHECK_OK(ctx, tli_surface_compare(ctx, "isosurface", &a, &b, 0.01, &e));
    CHECK_NEAR(e.mean, 0, 1e-14);
    for (int side = 0; side < 2; side++) {
        CHECK_NEAR(e.one_sided[side], 0, 1e-13);
        CHECK_BOUND("bound between equal planes", e.bound[side], 0.001 * 0.01);
    }
    tli_surface_release(&b);
    b = iso_of(ctx, &coarse, field_x, 0.96);
    CHECK_OK(ctx, tli_surface_compare(ctx, "isosurface", &a, &b, 0.01, &e));
    for (int side = 0; side < 2; side++) CHECK(e.bound[side] >= 0.06 / sqrt(6.0) - 1e-14);
    tli_surface_release(&a);
    tli_surface_release(&b);
    make_release(&fine);
    make_release(&coarse);
    check_ctx_destroy(ctx);
}

static void iso_sphere(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh grid = make_grid(41);
    (void)state;
    tli_surface a = iso_of(ctx, &grid, field_radius, 0.3),
                b = iso_of(ctx, &grid, field_radius, 0.4);
    double h = 1.0 / 40, pi = acos(-1);
    CHECK_NEAR(a.area, 4 * pi * 0.09, 0.01 * 4 * pi * 0.09);
    CHECK_NEAR(b.area, 4 * pi * 0.16, 0.01 * 4 * pi * 0.16);
    /* closed: Euler's formula of a sphere, so every corner was merged */
    CHECK_EQ(a.vert_count, a.triangle_count / 2 + 2);
    tli_surface_error e;
    CHECK_OK(ctx, tli_surface_compare(ctx, "isosurface", &a, &b, 0.005, &e));
    CHECK_NEAR(e.mean, 0.1, h * h);
    for (int side = 0; side < 2; side++) CHECK_NEAR(e.one_sided[side], 0.1, 3 * h * h);
    tli_surface_release(&a);
    tli_surface_release(&b);
    make_release(&grid);
    check_ctx_destroy(ctx);
}

/* Corners in another order, vertices on the value, no surface at all, values that are none. */
static void iso_special(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh grid = make_grid(9);
    (void)state;
    tli_surface a = iso_of(ctx, &grid, field_radius, 0.31);
    for (size_t t = 0; t < grid.tet_count; t++) {
        tl_lidx *c = grid.tets + 4 * t, first = c[0];
        c[0] = c[1];
        c[1] = c[2];
        c[2] = first;
    }
    tli_surface b = iso_of(ctx, &grid, field_radius, 0.31);
    tli_surface_error e;
    CHECK_EQ(a.vert_count, b.vert_count);
    CHECK_NEAR(a.area, b.area, 1e-13);
    CHECK_OK(ctx, tli_surface_compare(ctx, "isosurface", &a, &b, 0.5, &e));
    CHECK_NEAR(e.mean, 0, 1e-16);
    for (int side = 0; side < 2; side++) CHECK_NEAR(e.one_sided[side], 0, 1e-14);

    tli_surface_release(&a);
    tli_surface_release(&b);
    a = iso_of(ctx, &grid, field_x, 0.5); /* passes through vertices */
    CHECK(a.area > 0);
    tli_surface_release(&a);
    a = iso_of(ctx, &grid, field_x, 17);
    CHECK_EQ(a.triangle_count, 0);
    CHECK_EQ(a.vert_count, 0);
    tli_surface_release(&a);
    tl_mesh *mesh = make_object(ctx, &grid, field_radius);
    double *values = mesh->channels[0].values ? malloc(grid.vert_count * sizeof *values) : NULL;
    if (!values) abort();
    memcpy(values, mesh->channels[0].values, grid.vert_count * sizeof *values);
    for (size_t v = 0; v < grid.vert_count; v += 3)
        values[v] = v % 2 ? (double)NAN : (double)INFINITY;
    tl_channel channel = {"g", "", 1, TL_ON_VERTEX, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    CHECK_OK(ctx, tli_iso_surface(ctx, mesh, tl_mesh_channel_by_name(mesh, "g"), 0.3, &a));
    for (size_t i = 0; i < 3 * a.vert_count; i++) CHECK(isfinite(a.xyz[i]));
    tli_surface_release(&a);
    free(values);
    tl_mesh_destroy(mesh);
    make_release(&grid);
    check_ctx_destroy(ctx);
}

/* ---- failures ---- */

static tl_status compare_isos(tl_ctx *ctx, void *arg)
{
    const tl_mesh *mesh = arg;
    tli_surface a = {0}, b = {0};
    tli_surface_error e;
    tl_status st = tli_iso_surface(ctx, mesh, &mesh->channels[0], 0.3, &a);
    if (!st) st = tli_iso_surface(ctx, mesh, &mesh->channels[0], 0.33, &b);
    if (!st) st = tli_surface_compare(ctx, "isosurface", &a, &b, 0.05, &e);
    tli_surface_release(&a);
    tli_surface_release(&b);
    return st;
}

static void every_allocation_fails(void **state)
{
    fail_alloc f;
    (void)state;
    fail_alloc_open(&f, 1);
    make_mesh grid = make_grid(7);
    tl_mesh *mesh = make_object(f.ctx, &grid, field_radius);
    CHECK(fail_alloc_each(&f, compare_isos, mesh) > 20);
    tl_mesh_destroy(mesh);
    make_release(&grid);
    fail_alloc_close(&f);
}

/* A sheet and another one over it, in cells of other sizes. */
static void covered_by_cells(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    const double low[2] = {0, 0}, high[2] = {0.001, 0};
    soup below = make_sheet(7, place_plane, low), above = make_sheet(5, place_plane, high);
    tli_surface to = make_surface(ctx, &below), from = make_surface(ctx, &above);
    uint8_t *taken = calloc(to.triangle_count, 1);
    size_t gone = 0;
    for (size_t t = 0; t < from.triangle_count; t++) {
        double corners[9], reached;
        for (int i = 0; i < 3; i++)
            memcpy(corners + 3 * i, tli_surface_corner(&from, t, i), 3 * sizeof *corners);
        reached = tli_surface_cover(&to, NULL, corners, 0.002);
        CHECK(reached >= 0.001 - 1e-12 && reached <= 0.002); /* prisms are widened */
        CHECK(isinf(tli_surface_cover(&to, NULL, corners, 0.0009)));
        CHECK(isinf(tli_surface_cover(&to, taken, corners, 0.002)));
    }
    for (size_t t = 0; t < to.triangle_count; t++) taken[t] = t != to.triangle_count / 2;
    for (size_t t = 0; t < from.triangle_count; t++) { /* over the hole alone nothing is shown */
        double corners[9];
        for (int i = 0; i < 3; i++)
            memcpy(corners + 3 * i, tli_surface_corner(&from, t, i), 3 * sizeof *corners);
        gone += isinf(tli_surface_cover(&to, taken, corners, 0.002));
    }
    CHECK(gone > 0 && gone < 12);
    free(taken);
    tli_surface_release(&from);
    tli_surface_release(&to);
    soup_release(&above);
    soup_release(&below);
    check_ctx_destroy(ctx);
}

/* Two triangles over thousands of small ones: the cuts that one takes are those of many. */
static void reach_of_large_triangles(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    const double flat[2] = {0, 0}, wave[2] = {0.002, 0.03};
    soup large = make_sheet(1, place_plane, flat), small = make_sheet(100, place_wave, wave);
    tli_surface from = make_surface(ctx, &large), to = make_surface(ctx, &small);
    uint8_t none[2] = {0};
    tli_reach reach;
    CHECK_OK(ctx, tli_reach_create(ctx, &from, &to, none, 0, &reach));
    tli_reach_bound(&reach);
    CHECK(reach.splits_left > 0);
    CHECK_BOUND("dense samples and the bound", dense_one_sided(ctx, &large, &small, 300),
                reach.bound);
    CHECK_BOUND("bound and what was found", reach.bound, reach.query.found * 1.1 + 1e-12);
    CHECK_BOUND("what was found", reach.query.found, 0.002 + 1e-12);
    tli_reach_release(&reach);
    tli_surface_release(&to);
    tli_surface_release(&from);
    soup_release(&small);
    soup_release(&large);
    check_ctx_destroy(ctx);
}

typedef struct dealt {
    const uint32_t *labels;
    double area[2], corners_off;
} dealt;

static tl_status count_piece(void *user, const double c[9], tl_lidx to)
{
    dealt *d = user;
    uint32_t label = d->labels[to];
    double e[3], f[3], n[3];
    for (int k = 0; k < 3; k++) {
        e[k] = c[3 + k] - c[k];
        f[k] = c[6 + k] - c[k];
    }
    n[0] = e[1] * f[2] - e[2] * f[1];
    n[1] = e[2] * f[0] - e[0] * f[2];
    n[2] = e[0] * f[1] - e[1] * f[0];
    d->area[label] += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
    for (int i = 0; i < 3; i++) /* label 1 lies beyond x = 3/7 */
        d->corners_off = fmax(d->corners_off, label ? 3.0 / 7 - c[3 * i] : c[3 * i] - 3.0 / 7);
    return TL_OK;
}

/* Triangles are cut where labels meet, and nothing is lost. */
static void dealt_at_borders(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    const double low[2] = {0, 0}, high[2] = {0.001, 0};
    soup below = make_sheet(7, place_plane, low), above = make_sheet(4, place_plane, high);
    tli_surface to = make_surface(ctx, &below), from = make_surface(ctx, &above);
    uint32_t *labels = calloc(to.triangle_count, sizeof *labels);
    uint8_t *borders = calloc(to.triangle_count, 1), *none = calloc(from.triangle_count, 1);
    for (size_t t = 0; t < to.triangle_count; t++) {
        double x = 0;
        for (int i = 0; i < 3; i++) x += tli_surface_corner(&to, t, i)[0] / 3;
        labels[t] = x > 3.0 / 7;
        for (int i = 0; i < 3; i++) {
            double a = tli_surface_corner(&to, t, i)[0];
            double b = tli_surface_corner(&to, t, (i + 1) % 3)[0];
            if (fabs(a - 3.0 / 7) < 1e-9 && fabs(b - 3.0 / 7) < 1e-9)
                borders[t] |= (uint8_t)(1u << i);
        }
    }
    tli_reach reach;
    dealt d = {labels, {0, 0}, 0};
    CHECK_OK(ctx, tli_reach_create(ctx, &from, &to, none, 0, &reach));
    tli_reach_bound(&reach);
    CHECK_NEAR(reach.bound, 0.001, 2e-4);
    CHECK(reach.bound >= 0.001 - 1e-12);
    tli_deal_query deal = {&to, labels, borders, 0, 1000};
    for (size_t t = 0; t < from.triangle_count; t++)
        CHECK_OK(ctx, tli_surface_deal(&reach.query, &deal, t, count_piece, &d));
    CHECK_NEAR(d.area[0], 3.0 / 7, 1e-6);
    CHECK_NEAR(d.area[1], 4.0 / 7, 1e-6);
    CHECK_BOUND("beyond the border", d.corners_off, 1e-6);
    tli_reach_release(&reach);
    free(none);
    free(borders);
    free(labels);
    tli_surface_release(&from);
    tli_surface_release(&to);
    soup_release(&above);
    soup_release(&below);
    check_ctx_destroy(ctx);
}

/* A fan of triangles around an apex, from angle, over a ring at height 0. */
static soup make_fan(size_t count, double angle, const double apex[3])
{
    const double turn = 2 * acos(-1);
    soup s = soup_room(count + 1, count);
    memcpy(s.xyz, apex, 3 * sizeof *apex);
    for (size_t i = 0; i < count; i++) {
        s.xyz[3 * i + 3] = cos(angle + turn * (double)i / (double)count);
        s.xyz[3 * i + 4] = sin(angle + turn * (double)i / (double)count);
        const tl_lidx t[3] = {0, (tl_lidx)(1 + i), (tl_lidx)(1 + (i + 1) % count)};
        memcpy(s.triangles + 3 * i, t, sizeof t);
    }
    return s;
}

typedef struct dealt_by_label {
    const tli_surface *to;
    const uint32_t *labels;
    double farthest; /* of a piece from the triangles of its label */
} dealt_by_label;

static tl_status sample_piece(void *user, const double c[9], tl_lidx to)
{
    dealt_by_label *d = user;
    const int n = 20;
    for (int i = 0; i <= n; i++)
        for (int j = 0; i + j <= n; j++) {
            double x[3], nearest = (double)INFINITY;
            for (int k = 0; k < 3; k++)
                x[k] = c[k] + i * (c[3 + k] - c[k]) / n + j * (c[6 + k] - c[k]) / n;
            for (size_t t = 0; t < d->to->triangle_count; t++)
                if (d->labels[t] == d->labels[to])
                    nearest = fmin(nearest, tli_surface_distance2(d->to, (tl_lidx)t, x));
            d->farthest = fmax(d->farthest, sqrt(nearest));
        }
    return TL_OK;
}

/* Where many labels meet at a corner, a piece over it crosses no border beside itself and still
 * must not be dealt to a label that part of it is far from. */
static void dealt_around_a_corner(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    const double tip[3] = {0, 0, 0.3}, other[3] = {0.012, 0.007, 0.31}, least = 0.001;
    for (int turn = 0; turn < 24; turn++) {
        soup below = make_fan(8, 0, tip), above = make_fan(5, turn * 0.05, other);
        tli_surface to = make_surface(ctx, &below), from = make_surface(ctx, &above);
        uint32_t labels[8];
        uint8_t borders[8], none[5] = {0};
        for (size_t t = 0; t < 8; t++) {
            labels[t] = to.origins[t] % 2;
            borders[t] = 7;
        }
        tli_reach reach;
        dealt_by_label d = {&to, labels, 0};
        CHECK_OK(ctx, tli_reach_create(ctx, &from, &to, none, 0, &reach));
        tli_reach_bound(&reach);
        tli_deal_query deal = {&to, labels, borders, least, 1000};
        for (size_t t = 0; t < from.triangle_count; t++)
            CHECK_OK(ctx, tli_surface_deal(&reach.query, &deal, t, sample_piece, &d));
        CHECK_BOUND("from its label", d.farthest, reach.bound + least);
        tli_reach_release(&reach);
        tli_surface_release(&from);
        tli_surface_release(&to);
        soup_release(&above);
        soup_release(&below);
    }
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangle_distances),
        cmocka_unit_test(nearest_as_brute_force),
        cmocka_unit_test(identical_is_zero),
        cmocka_unit_test(parallel_planes),
        cmocka_unit_test(tilted_planes),
        cmocka_unit_test(nested_boxes),
        cmocka_unit_test(concentric_spheres),
        cmocka_unit_test(over_a_valley),
        cmocka_unit_test(bound_between_samples),
        cmocka_unit_test(bound_of_soups),
        cmocka_unit_test(covered_by_cells),
        cmocka_unit_test(dealt_at_borders),
        cmocka_unit_test(dealt_around_a_corner),
        cmocka_unit_test(reach_of_large_triangles),
        cmocka_unit_test(sample_counts),
        cmocka_unit_test(empty_surfaces),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(iso_plane),
        cmocka_unit_test(iso_sphere),
        cmocka_unit_test(iso_special),
        cmocka_unit_test(every_allocation_fails),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
