/* What becomes of channels: none, constant ones, many, tensors, integers, tet channels, values that
 * are not finite. */
#include "check.h"
#include "check_simplify.h"
#include "tetralod/formats.h"

#include <unistd.h>

typedef double (*vertex_value)(const double x[3], uint32_t component);

static void add_values(tl_mesh *mesh, const char *name, uint32_t components, tl_on on,
                       tl_scalar scalar, vertex_value value)
{
    size_t n = on == TL_ON_VERTEX ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh);
    double *values = malloc((n * components + 1) * sizeof *values);
    if (!values) abort();
    for (size_t e = 0; e < n; e++) {
        double x[3] = {0, 0, 0}, p[4][3];
        if (on == TL_ON_VERTEX) memcpy(x, tl_mesh_xyz(mesh) + 3 * e, sizeof x);
        if (on == TL_ON_TET) tet_points(mesh, e, p);
        for (int i = 0; on == TL_ON_TET && i < 12; i++) x[i % 3] += p[i / 3][i % 3] / 4;
        for (uint32_t k = 0; k < components; k++) values[e * components + k] = value(x, k);
    }
    tl_channel channel = {name, "m/s", components, on, scalar, values};
    CHECK_OK(tl_mesh_ctx(mesh), tl_mesh_add_channel(mesh, &channel));
    free(values);
}

static double value_wave(const double x[3], uint32_t k)
{
    return sin(3 * x[0] + k) * cos(2 * x[1] - 0.3 * k) + x[2];
}

static double value_constant(const double x[3], uint32_t k)
{
    (void)x;
    return 42.5 + k;
}

static double value_byte(const double x[3], uint32_t k)
{
    (void)k;
    return floor(127 + 100 * field_bumps(x) / 1.3);
}

static double value_material(const double x[3], uint32_t k)
{
    (void)k;
    return x[0] < 0.5 ? 3 : 8;
}

static double value_direction(const double x[3], uint32_t k)
{
    double angle = 2 * x[0] + x[1];
    return k == 0 ? cos(angle) : k == 1 ? sin(angle) : 0;
}

static tl_mesh *plain_grid(tl_ctx *ctx, size_t n, make_field field)
{
    make_mesh m = make_grid(n);
    perturb_inner(&m, 0.1 / (double)(n - 1), 7);
    tl_mesh *mesh = make_object(ctx, &m, field);
    make_release(&m);
    return mesh;
}

static void check_channels_alike(const tl_mesh *a, const tl_mesh *b)
{
    CHECK_EQ(tl_mesh_channel_count(b), tl_mesh_channel_count(a));
    for (size_t i = 0; i < tl_mesh_channel_count(a); i++) {
        const tl_channel *p = tl_mesh_channel(a, i), *q = tl_mesh_channel(b, i);
        CHECK_EQ(strcmp(p->name, q->name), 0);
        CHECK_EQ(strcmp(p->unit, q->unit), 0);
        CHECK_EQ(q->components, p->components);
        CHECK_EQ(q->on, p->on);
        CHECK_EQ(q->scalar, p->scalar);
    }
}

static shrunk shrink_alike(tl_mesh *mesh, double ratio)
{
    tl_simplify_opts opts = shrink_ratio(ratio);
    shrunk s = shrink(mesh, &opts);
    check_whole(mesh, &s, 1e-3 * mesh_diagonal(mesh), 1e-4);
    check_channels_alike(mesh, s.mesh);
    CHECK(s.result.target_reached);
    return s;
}

static void test_no_channel(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = plain_grid(ctx, 13, NULL);
    (void)state;
    tl_mesh_set_time(mesh, 3.25);
    shrunk s = shrink_alike(mesh, 0.1);
    CHECK_EQ(s.result.channel_count, 0);
    CHECK(tl_mesh_time(s.mesh) == 3.25);
    CHECK(tl_mesh_regions(s.mesh) == NULL);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_constant(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = plain_grid(ctx, 13, NULL);
    (void)state;
    add_values(mesh, "constant", 1, TL_ON_VERTEX, TL_F32, value_constant);
    add_values(mesh, "constants", 3, TL_ON_VERTEX, TL_F32, value_constant);
    shrunk s = shrink_alike(mesh, 0.1);
    for (size_t i = 0; i < 2; i++) {
        CHECK(s.result.channels[i].max_error <= 1e-12);
        const tl_channel *c = tl_mesh_channel(s.mesh, i);
        for (size_t v = 0; v < c->components * tl_mesh_vert_count(s.mesh); v++)
            CHECK(c->values[v] == 42.5 + (double)(v % c->components));
    }
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_many(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = plain_grid(ctx, 11, field_bumps);
    char name[16];
    (void)state;
    for (int i = 0; i < 19; i++) {
        snprintf(name, sizeof name, "c%d", i);
        add_values(mesh, name, i == 4 ? 9 : 1, TL_ON_VERTEX, TL_F64, value_wave);
    }
    shrunk s = shrink_alike(mesh, 0.2);
    CHECK_EQ(s.result.channel_count, 20);
    for (size_t i = 0; i < 20; i++) {
        const tl_simplify_channel_result *c = &s.result.channels[i];
        CHECK_EQ(strcmp(c->name, tl_mesh_channel(mesh, i)->name), 0);
        printf("%s: ", c->name);
        CHECK_BOUND("rms", c->rms_error, 0.05 * (c->range[1] - c->range[0]));
        CHECK_NEAR(brute_error(mesh, s.mesh, c->name, NULL), c->max_error, 1e-6 * c->max_error);
    }
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_components_limit(void **state)
{
    tl_ctx *ctx = shrink_ctx(1);
    tl_mesh *mesh = plain_grid(ctx, 5, field_bumps);
    (void)state;
    add_values(mesh, "wide", 256, TL_ON_VERTEX, TL_F64, value_wave);
    tl_simplify_opts opts = shrink_ratio(0.7);
    tl_mesh *out = mesh;
    tl_simplify_result result;
    CHECK_STATUS(tl_mesh_simplify(ctx, mesh, &opts, &out, &result), TL_ERR_UNSUPPORTED);
    CHECK(out == NULL);
    CHECK(strstr(tl_ctx_message(ctx), "257 components") != NULL);
    /* as many as can steer do; the others are carried */
    tl_simplify_channel wide = {"wide", 1, 0};
    opts.channels = &wide;
    opts.channel_count = 1;
    shrunk s = shrink(mesh, &opts);
    CHECK(s.result.target_reached);
    check_channels_alike(mesh, s.mesh);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* A heavier channel keeps more of itself; a factor common to all changes nothing. */
static void test_weights(void **state)
{
    static const double weights[4][2] = {{1, 1}, {1, 16}, {16, 1}, {16, 16}};
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = plain_grid(ctx, 17, field_bumps);
    double rms[4][2];
    (void)state;
    add_values(mesh, "wave", 1, TL_ON_VERTEX, TL_F64, value_wave);
    for (int i = 0; i < 4; i++) {
        tl_simplify_channel weighed[] = {{"f", weights[i][0], 0}, {"wave", weights[i][1], 0}};
        tl_simplify_opts opts = shrink_ratio(0.25);
        opts.channels = weighed;
        opts.channel_count = 2;
        shrunk s = shrink(mesh, &opts);
        for (int c = 0; c < 2; c++) rms[i][c] = s.result.channels[c].rms_error;
        printf("weights %g and %g: rms %.4g and %.4g\n", weights[i][0], weights[i][1], rms[i][0],
               rms[i][1]);
        shrink_release(&s);
    }
    CHECK_BOUND("the heavier one's rms", rms[1][1], 0.8 * rms[0][1]);
    CHECK_BOUND("the heavier one's rms", rms[2][0], 0.98 * rms[0][0]);
    CHECK_BOUND("the lighter one's rms", rms[0][0], rms[1][0]);
    CHECK_BOUND("the lighter one's rms", rms[0][1], rms[2][1]);
    CHECK(rms[3][0] == rms[0][0] && rms[3][1] == rms[0][1]);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* An empty list of channels: the shape alone steers, all are carried. */
static void test_none_steers(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = plain_grid(ctx, 13, field_linear);
    (void)state;
    static const tl_simplify_channel none[1];
    tl_simplify_opts opts = shrink_ratio(0.1);
    opts.channels = none;
    opts.channel_count = 0;
    shrunk s = shrink(mesh, &opts);
    check_whole(mesh, &s, 1e-3 * mesh_diagonal(mesh), 1e-4);
    CHECK(s.result.target_reached);
    CHECK_EQ(s.result.channel_count, 1);
    CHECK_BOUND("linear, carried", s.result.channels[0].max_error, 0.02 * 5.5);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* Vectors of one length: the lengths have no range, the vectors have. */
static void test_directions(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = plain_grid(ctx, 13, NULL);
    (void)state;
    add_values(mesh, "direction", 3, TL_ON_VERTEX, TL_F64, value_direction);
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.error = 0.02;
    shrunk s = shrink(mesh, &opts);
    CHECK(s.result.tets_out < s.result.tets_in / 2);
    CHECK_BOUND("direction", brute_error(mesh, s.mesh, "direction", NULL), 0.02 * 2);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_tet_channels(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = plain_grid(ctx, 17, field_bumps);
    (void)state;
    add_values(mesh, "density", 1, TL_ON_TET, TL_F32, value_wave);
    add_values(mesh, "flux", 3, TL_ON_TET, TL_F64, value_wave);
    add_values(mesh, "material", 1, TL_ON_TET, TL_I32, value_material);
    shrunk s = shrink_alike(mesh, 0.2);
    CHECK_EQ(s.result.channel_count, 1);
    for (size_t i = 1; i < 4; i++) {
        const tl_channel *c[2] = {tl_mesh_channel(mesh, i), tl_mesh_channel(s.mesh, i)};
        double sums[2] = {0, 0}, p[4][3], lo = INFINITY, hi = -INFINITY;
        for (size_t side = 0; side < 2; side++) {
            const tl_mesh *at = side ? s.mesh : mesh;
            for (size_t t = 0; t < tl_mesh_tet_count(at); t++) {
                double value = c[side]->values[t * c[side]->components];
                tet_points(at, t, p);
                sums[side] += tl_tet_volume((const double(*)[3])p) * value;
                if (side == 0) lo = fmin(lo, value), hi = fmax(hi, value);
                if (side == 1) CHECK(value >= lo && value <= hi);
                if (side == 1 && i == 3) CHECK(value < 3.5 ? value > 2.5 : value > 7.5);
            }
        }
        printf("%s: ", c[0]->name);
        CHECK_BOUND("integral differs by", fabs(sums[1] / sums[0] - 1), 0.02);
    }
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* Means of integers are none: they must survive the writer. */
static void test_integers_widen(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = plain_grid(ctx, 13, NULL), *back = NULL;
    (void)state;
    add_values(mesh, "scalars", 1, TL_ON_VERTEX, TL_U8, value_byte);
    add_values(mesh, "material", 1, TL_ON_TET, TL_U8, value_material);
    shrunk s = shrink_alike(mesh, 0.1);
    const tl_channel *a = tl_mesh_channel(s.mesh, 0);
    size_t fractional = 0, n = tl_mesh_vert_count(s.mesh);
    for (size_t v = 0; v < n; v++) fractional += !tl_scalar_holds(TL_U8, a->values[v]);
    CHECK(fractional > 0);
    static const char *const names[] = {"widened.vtu", "widened.vtk"};
    for (int i = 0; i < 2; i++) {
        CHECK_OK(ctx, tl_mesh_write(ctx, s.mesh, names[i], NULL));
        CHECK_OK(ctx, tl_mesh_read(ctx, names[i], NULL, &back, NULL));
        unlink(names[i]);
        const tl_channel *b = tl_mesh_channel_by_name(back, "scalars");
        CHECK(b != NULL && b->scalar == TL_F64);
        CHECK_EQ(tl_mesh_vert_count(back), n);
        CHECK(!memcmp(a->values, b->values, n * sizeof *b->values));
        const tl_channel *material = tl_mesh_channel_by_name(back, "material");
        CHECK(material != NULL && material->scalar == TL_U8);
        tl_mesh_destroy(back);
    }
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- values and places that are not finite ---- */

static size_t count_without_value(const tl_mesh *mesh)
{
    const tl_lidx *q = tl_mesh_tets(mesh);
    const double *f = tl_mesh_channel(mesh, 0)->values;
    size_t count = 0;
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++, q += 4)
        count +=
            !isfinite(f[q[0]]) || !isfinite(f[q[1]]) || !isfinite(f[q[2]]) || !isfinite(f[q[3]]);
    return count;
}

static void test_nan_value(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(13);
    double *values = malloc(m.vert_count * sizeof *values);
    (void)state;
    perturb_inner(&m, 0.1 / 12, 2);
    for (size_t v = 0; v < m.vert_count; v++) values[v] = field_bumps(m.xyz + 3 * v);
    size_t odd = 6 + 13 * (6 + 13 * 6);
    values[odd] = NAN;
    values[3] = -INFINITY; /* on the boundary */
    for (int by_error = 0; by_error < 2; by_error++) {
        tl_mesh *mesh = make_object(ctx, &m, NULL);
        tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, values};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        tl_simplify_opts opts = shrink_ratio(0.1);
        opts.error = by_error ? 0.05 : 0;
        shrunk s = shrink(mesh, &opts);
        check_whole(mesh, &s, 1e-3 * mesh_diagonal(mesh), 1e-4);
        CHECK(by_error || s.result.target_reached);
        CHECK(s.result.tets_out < m.tet_count / 4);
        const tl_channel *c = tl_mesh_channel(s.mesh, 0);
        size_t nan = 0, infinite = 0;
        for (size_t v = 0; v < tl_mesh_vert_count(s.mesh); v++) {
            nan += isnan(c->values[v]);
            infinite += isinf(c->values[v]) != 0;
            if (isnan(c->values[v])) /* it is where it was */
                CHECK(!memcmp(tl_mesh_xyz(s.mesh) + 3 * v, m.xyz + 3 * odd, 3 * sizeof(double)));
        }
        CHECK_EQ(nan, 1);
        CHECK_EQ(infinite, 1);
        CHECK_EQ(count_without_value(s.mesh), count_without_value(mesh)); /* none grew */
        shrink_release(&s);
        tl_mesh_destroy(mesh);
    }
    free(values);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static void test_all_nan(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(7);
    double *values = malloc(m.vert_count * sizeof *values);
    (void)state;
    for (size_t v = 0; v < m.vert_count; v++) values[v] = NAN;
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    tl_simplify_opts opts = shrink_ratio(0.1);
    shrunk s = shrink(mesh, &opts);
    CHECK_EQ(s.result.tets_out, m.tet_count);
    CHECK(!s.result.target_reached);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    free(values);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static void test_nan_place(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(11);
    (void)state;
    size_t odd[2] = {5 + 11 * (5 + 11 * 5), 4};
    tl_mesh *plain = make_object(ctx, &m, field_bumps);
    const double *f = tl_mesh_channel(plain, 0)->values;
    m.xyz[3 * odd[0] + 1] = NAN;
    m.xyz[3 * odd[1]] = INFINITY;
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, f};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    for (int by_error = 0; by_error < 2; by_error++) {
        tl_simplify_opts opts = shrink_ratio(0.2);
        opts.error = by_error ? 0.1 : 0;
        shrunk s = shrink(mesh, &opts);
        size_t nan = 0, infinite = 0;
        for (size_t i = 0; i < 3 * tl_mesh_vert_count(s.mesh); i++) {
            nan += isnan(tl_mesh_xyz(s.mesh)[i]);
            infinite += isinf(tl_mesh_xyz(s.mesh)[i]) != 0;
        }
        CHECK_EQ(nan, 1);
        CHECK_EQ(infinite, 1);
        CHECK(s.result.tets_out < m.tet_count / 2);
        CHECK_EQ(s.result.inverted, 0);
        CHECK_EQ(s.result.degenerate, 0);
        shrink_release(&s);
    }
    tl_mesh_destroy(mesh);
    tl_mesh_destroy(plain);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_channel),     cmocka_unit_test(test_constant),
        cmocka_unit_test(test_many),           cmocka_unit_test(test_components_limit),
        cmocka_unit_test(test_weights),        cmocka_unit_test(test_none_steers),
        cmocka_unit_test(test_directions),     cmocka_unit_test(test_tet_channels),
        cmocka_unit_test(test_integers_widen), cmocka_unit_test(test_nan_value),
        cmocka_unit_test(test_all_nan),        cmocka_unit_test(test_nan_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
