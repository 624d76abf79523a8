/* Lines of sight through meshes, against closed forms: chords of a cube, with a cavity too, depths
 * at which half of a fog's opacity is gathered, first meetings with isosurfaces. */
#include "view/view_ray.h"

#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

static const double CUBE[6] = {0, 1, 0, 1, 0, 1};
enum { RAYS = 300 };

typedef struct place {
    tl_ctx *ctx;
    tl_mesh *mesh;
    tl_locator *locator;
    const double *field;
} place;

static double height(const double x[3])
{
    return 2 * x[0] + 3;
}

static place open_place(tl_ctx *ctx, make_mesh m, make_field field)
{
    place p = {.ctx = ctx, .mesh = make_object(ctx, &m, field)};
    make_release(&m);
    CHECK_OK(ctx, tl_locator_create(ctx, p.mesh, NULL, &p.locator));
    if (field) p.field = tl_mesh_channel(p.mesh, 0)->values;
    return p;
}

static void close_place(place *p)
{
    tl_locator_destroy(p->locator);
    tl_mesh_destroy(p->mesh);
}

/* A line from outside through a place in the cube. */
static tli_sight random_sight(uint64_t *seed)
{
    tli_sight s = {.least = 0};
    double length = 0;
    for (int k = 0; k < 3; k++) {
        s.direction[k] = 2 * make_uniform(seed) - 1;
        length += s.direction[k] * s.direction[k];
    }
    for (int k = 0; k < 3; k++) {
        s.direction[k] /= sqrt(length);
        s.origin[k] = make_uniform(seed) - 5 * s.direction[k];
    }
    return s;
}

/* Where a line is in a box with sides low .. high; false: nowhere. */
static bool chord(const tli_sight *s, double low, double high, double t[2])
{
    t[0] = s->least;
    t[1] = INFINITY;
    for (int k = 0; k < 3; k++) {
        const double a = (low - s->origin[k]) / s->direction[k];
        const double b = (high - s->origin[k]) / s->direction[k];
        t[0] = fmax(t[0], fmin(a, b));
        t[1] = fmin(t[1], fmax(a, b));
    }
    return t[0] < t[1];
}

typedef struct sum {
    const place *p;
    double length, first, last, behind;
} sum;

static bool add_span(void *user, const tli_span *span)
{
    sum *s = user;
    const tl_lidx *tet = tl_mesh_tets(s->p->mesh) + 4 * (size_t)span->tet;
    CHECK(span->t[0] <= span->t[1]);
    CHECK(span->t[0] >= s->behind);
    s->behind = span->t[1];
    s->first = fmin(s->first, span->t[0]);
    s->last = fmax(s->last, span->t[1]);
    s->length += span->t[1] - span->t[0];
    for (int end = 0; end < 2; end++) { /* weights are those of the place */
        double x = 0, total = 0;
        for (int i = 0; i < 4; i++) {
            CHECK(span->weights[end][i] >= 0);
            total += span->weights[end][i];
            x += span->weights[end][i] * s->p->field[tet[i]];
        }
        CHECK_NEAR(total, 1, 1e-12);
        CHECK_NEAR(x, s->last, 100); /* finite */
    }
    return true;
}

static void walk_of(const place *p, const tli_sight *sight, sum *s)
{
    *s = (sum){.p = p, .first = INFINITY, .last = -INFINITY, .behind = -INFINITY};
    CHECK_OK(p->ctx, tli_sight_walk(p->ctx, p->mesh, p->locator, CUBE, sight, add_span, s));
}

static void test_chords(void **state)
{
    (void)state;
    uint64_t seed = 5;
    tl_ctx *ctx = check_ctx_create(2);
    for (int cavity = 0; cavity < 2; cavity++) {
        make_mesh m = make_grid_with(10, cavity);
        make_shuffle(&m, 3);
        place p = open_place(ctx, m, height);
        for (int i = 0; i < RAYS; i++) {
            double whole[2], hole[2];
            sum s;
            tli_sight sight = random_sight(&seed);
            if (!chord(&sight, 0, 1, whole)) continue;
            double expected = whole[1] - whole[0];
            if (cavity && chord(&sight, 3.0 / 9, 6.0 / 9, hole)) expected -= hole[1] - hole[0];
            walk_of(&p, &sight, &s);
            CHECK_NEAR(s.length, expected, 1e-10);
            CHECK_NEAR(s.first, whole[0], 1e-10);
            CHECK_NEAR(s.last, whole[1], 1e-10);
        }
        close_place(&p);
    }
    check_ctx_destroy(ctx);
}

/* Along the edges and faces of the grid nothing is counted twice, past it nothing at all; the eye
 * may stand inside. */
static void test_special_lines(void **state)
{
    (void)state;
    sum s;
    tl_ctx *ctx = check_ctx_create(1);
    place p = open_place(ctx, make_grid(9), height);
    tli_sight sight = {.origin = {-1, 0.3, 0.3}, .direction = {1, 0, 0}};
    walk_of(&p, &sight, &s);
    CHECK_NEAR(s.length, 1, 1e-12);
    for (int line = 0; line < 4; line++) { /* in faces, along edges */
        sight.origin[1] = line & 1 ? 0.25 : 0.3;
        sight.origin[2] = line & 2 ? 0.625 : 0.3;
        walk_of(&p, &sight, &s);
        CHECK_NEAR(s.length, 1, 1e-12);
    }
    sight.origin[1] = 2;
    walk_of(&p, &sight, &s);
    CHECK(s.length == 0);
    sight = (tli_sight){.origin = {0.25, 0.3, 0.3}, .direction = {-1, 0, 0}};
    walk_of(&p, &sight, &s);
    CHECK_NEAR(s.length, 0.25, 1e-12);
    sight.least = -INFINITY; /* parallel: what is behind the camera's place is seen, too */
    walk_of(&p, &sight, &s);
    CHECK_NEAR(s.length, 1, 1e-12);
    close_place(&p);
    check_ctx_destroy(ctx);
}

static tl_transfer *make_transfer(tl_ctx *ctx, const tl_opacity_point *points, size_t count,
                                  double unit)
{
    tl_transfer *t = NULL;
    const tl_color_point white = {0, {1, 1, 1}};
    CHECK_OK(ctx, tl_transfer_create(ctx, &white, 1, points, count, unit, &t));
    return t;
}

/* Constant extinction q over a length L: half of the opacity is gathered at
 * -ln((1 + exp(-q L)) / 2) / q. */
static void test_fog_of_one_value(void **state)
{
    (void)state;
    uint64_t seed = 8;
    tl_ctx *ctx = check_ctx_create(1);
    place p = open_place(ctx, make_grid(8), height);
    const double opacities[] = {0.05, 0.5, 0.999};
    for (int o = 0; o < 3; o++) {
        const tl_opacity_point points[2] = {{0, opacities[o]}, {10, opacities[o]}};
        const double q = -log1p(-opacities[o]);
        const tli_fog fog = {p.field, make_transfer(ctx, points, 2, 1)};
        for (int i = 0; i < RAYS; i++) {
            double whole[2], t;
            bool is_hit;
            const tli_sight sight = random_sight(&seed);
            CHECK(chord(&sight, 0, 1, whole));
            const double length = whole[1] - whole[0], all = -expm1(-q * length);
            CHECK_OK(ctx, tli_sight_half(ctx, p.mesh, p.locator, CUBE, &sight, &fog, NULL, 0,
                                         INFINITY, &t, &is_hit));
            CHECK_EQ(is_hit, all >= TLI_SIGHT_SEEN);
            if (is_hit) CHECK_NEAR(t - whole[0], -log1p(-all / 2) / q, 1e-6);
        }
        tl_transfer_destroy(ctx, (tl_transfer *)(uintptr_t)fog.transfer);
    }
    close_place(&p);
    check_ctx_destroy(ctx);
}

/* A thin layer between clear ones is hit where it is, though tets are thicker; a NaN is clear. */
static void test_thin_layer(void **state)
{
    (void)state;
    double t;
    bool is_hit;
    tl_ctx *ctx = check_ctx_create(1);
    place p = open_place(ctx, make_grid(4), height); /* 3 to 5, a tet spans 2/3 */
    const tl_opacity_point points[5] = {{3, 0}, {4.09, 0}, {4.1, 0.9999}, {4.11, 0}, {5, 0}};
    const tli_fog fog = {p.field, make_transfer(ctx, points, 5, 0.05)};
    const tli_sight sight = {.origin = {-2, 0.4, 0.7}, .direction = {1, 0, 0}};
    CHECK_OK(ctx, tli_sight_half(ctx, p.mesh, p.locator, CUBE, &sight, &fog, NULL, 0, INFINITY, &t,
                                 &is_hit));
    CHECK(is_hit);
    CHECK_NEAR(t, 2 + (4.1 - 3) / 2, 0.006);
    double *nan = (double *)(uintptr_t)p.field;
    for (size_t v = 0; v < tl_mesh_vert_count(p.mesh); v++) nan[v] = NAN;
    CHECK_OK(ctx, tli_sight_half(ctx, p.mesh, p.locator, CUBE, &sight, &fog, NULL, 0, INFINITY, &t,
                                 &is_hit));
    CHECK(!is_hit);
    tl_transfer_destroy(ctx, (tl_transfer *)(uintptr_t)fog.transfer);
    close_place(&p);
    check_ctx_destroy(ctx);
}

/* Veils count where they are; before something opaque half of all is a half. */
static void test_veils(void **state)
{
    (void)state;
    double t;
    bool is_hit;
    tl_ctx *ctx = check_ctx_create(1);
    place p = open_place(ctx, make_grid(6), height);
    const tli_sight sight = {.origin = {-2, 0.4, 0.7}, .direction = {1, 0, 0}}; /* in from 2 to 3 */
    const tl_opacity_point even[2] = {{0, 0.5}, {10, 0.5}};
    const tli_fog none = {NULL, NULL}, fog = {p.field, make_transfer(ctx, even, 2, 1)};
    const tli_veil glass[2] = {{2.1, -log(0.85)}, {2.9, -log(0.85)}};
    const struct {
        const tli_fog *fog;
        size_t veils;
        double end, t; /* t below 0: nothing */
    } cases[] = {
        {&none, 0, INFINITY, -1},
        {&none, 0, 2.5, 2.5},
        {&none, 2, INFINITY, 2.1},  /* the first one has more than half of both */
        {&none, 2, 2.5, 2.5},       /* glass before a wall is looked through */
        {&fog, 0, INFINITY, 2.415}, /* 1 - 2^-x = 1 / 4 */
        {&fog, 0, 2.6, 2.6},        /* fog takes less than a half up to the wall */
        {&fog, 0, 3.5, 3},          /* just a half */
        {&fog, 2, 3.5, 2 + 1 + log(0.85) / log(2)},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        CHECK_OK(ctx, tli_sight_half(ctx, p.mesh, p.locator, CUBE, &sight, cases[i].fog, glass,
                                     cases[i].veils, cases[i].end, &t, &is_hit));
        CHECK_EQ(is_hit, cases[i].t > 0);
        if (is_hit) CHECK_NEAR(t, cases[i].t, 1e-4);
    }
    tl_transfer_destroy(ctx, (tl_transfer *)(uintptr_t)fog.transfer);
    close_place(&p);
    check_ctx_destroy(ctx);
}

/* A triangle is met where the line passes its plane, if the weights of the place say so. */
static void test_triangles(void **state)
{
    (void)state;
    uint64_t seed = 12;
    int hits = 0;
    for (int i = 0; i < 10 * RAYS; i++) {
        double corners[3][3], w[3], inside = 1, t = NAN, x[3] = {0};
        tli_sight sight = random_sight(&seed);
        for (int c = 0; c < 9; c++) corners[c / 3][c % 3] = make_uniform(&seed);
        w[0] = 2 * make_uniform(&seed) - 0.5;
        w[1] = 2 * make_uniform(&seed) - 0.5;
        w[2] = 1 - w[0] - w[1];
        for (int c = 0; c < 3; c++) {
            inside = fmin(inside, w[c]);
            for (int k = 0; k < 3; k++) x[k] += w[c] * corners[c][k];
        }
        for (int k = 0; k < 3; k++) sight.origin[k] = x[k] - 3 * sight.direction[k];
        const bool is_hit = tli_sight_triangle(&sight, (const double(*)[3])corners, &t);
        CHECK_EQ(is_hit, inside >= 0);
        if (is_hit) CHECK_NEAR(t, 3, 1e-9);
        hits += is_hit;
        sight.least = 3.1;
        CHECK(!tli_sight_triangle(&sight, (const double(*)[3])corners, &t));
    }
    CHECK(hits > RAYS);
}

static void test_meetings(void **state)
{
    (void)state;
    uint64_t seed = 2;
    tl_ctx *ctx = check_ctx_create(1);
    place p = open_place(ctx, make_grid(7), height);
    for (int i = 0; i < RAYS; i++) {
        double whole[2], t;
        bool is_hit;
        const tli_sight sight = random_sight(&seed);
        const double value = 3.1 + 1.8 * make_uniform(&seed);
        CHECK(chord(&sight, 0, 1, whole));
        CHECK_OK(ctx, tli_sight_meet(ctx, p.mesh, p.locator, CUBE, &sight, NULL, 0, &t, &is_hit));
        CHECK(is_hit);
        CHECK_NEAR(t, whole[0], 1e-10);
        const double plane = ((value - 3) / 2 - sight.origin[0]) / sight.direction[0];
        CHECK_OK(ctx,
                 tli_sight_meet(ctx, p.mesh, p.locator, CUBE, &sight, p.field, value, &t, &is_hit));
        CHECK_EQ(is_hit, plane >= whole[0] && plane <= whole[1]);
        if (is_hit) CHECK_NEAR(t, plane, 1e-9);
    }
    close_place(&p);
    check_ctx_destroy(ctx);
}

static tl_status try_meet(tl_ctx *ctx, void *arg)
{
    double t;
    bool is_hit;
    const place *p = arg;
    const tli_sight sight = {.origin = {-1, 0.3, 0.3}, .direction = {1, 0, 0}};
    return tli_sight_meet(ctx, p->mesh, p->locator, CUBE, &sight, p->field, 9, &t, &is_hit);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    place p = open_place(f.ctx, make_grid(5), height);
    CHECK(fail_alloc_each(&f, try_meet, &p) > 1);
    close_place(&p);
    fail_alloc_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chords),
        cmocka_unit_test(test_special_lines),
        cmocka_unit_test(test_fog_of_one_value),
        cmocka_unit_test(test_thin_layer),
        cmocka_unit_test(test_veils),
        cmocka_unit_test(test_triangles),
        cmocka_unit_test(test_meetings),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
