/* Simplification under a bound on the field error: it holds at every original vertex, measured by
 * looking at every tet, and the mesh gets small where the field allows it. Shifts and scales change
 * next to nothing. */
#include "check.h"
#include "check_simplify.h"

static double field_ripple(const double x[3])
{
    return sin(5 * x[0] + 2 * x[1]) * cos(4 * x[2]);
}

static void add_channel(tl_mesh *mesh, const char *name, uint32_t components, double factor)
{
    size_t n = tl_mesh_vert_count(mesh);
    double *values = malloc(n * components * sizeof *values);
    if (!values) abort();
    for (size_t v = 0; v < n; v++)
        for (uint32_t k = 0; k < components; k++) {
            const double *x = tl_mesh_xyz(mesh) + 3 * v;
            double at[3] = {x[(k + 1) % 3], x[(k + 2) % 3] * (1 + 0.2 * k), x[k % 3]};
            values[v * components + k] = factor * (k % 2 ? field_ripple(at) : field_bumps(at));
        }
    tl_channel channel = {name, "", components, TL_ON_VERTEX, TL_F64, values};
    CHECK_OK(tl_mesh_ctx(mesh), tl_mesh_add_channel(mesh, &channel));
    free(values);
}

/* Runs and compares with brute force; bound is absolute. Returns the tets left. */
static size_t holds_bound(const tl_mesh *mesh, const tl_simplify_opts *opts, size_t count,
                          const char *const *names, const double *bounds)
{
    shrunk s = shrink(mesh, opts);
    check_whole(mesh, &s, 1e-3 * mesh_diagonal(mesh), 1e-4);
    for (size_t i = 0; i < count; i++) {
        double rms, found = brute_error(mesh, s.mesh, names[i], &rms), said;
        said = result_error(&s, names[i]);
        printf("%s: rms %.3g, ", names[i], rms);
        CHECK_BOUND("found", found, said * (1 + 1e-6) + 1e-12);
        CHECK_BOUND("said", said, bounds[i]);
        CHECK_NEAR(found, said, 1e-6 * said + 1e-12);
    }
    size_t tets = s.result.tets_out;
    shrink_release(&s);
    return tets;
}

static void test_one_channel(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(10);
    (void)state;
    perturb_inner(&m, 0.1 / 9, 2);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    double range[2];
    tl_channel_range(tl_mesh_channel(mesh, 0), m.vert_count, range, NULL);
    size_t last = m.tet_count;
    static const double errors[] = {0.001, 0.01, 0.05, 0.3};
    for (int method = 0; method <= TL_SIMPLIFY_BLOCKS; method++) {
        size_t before = m.tet_count;
        for (size_t i = 0; i < 4; i++) {
            tl_simplify_opts opts = tl_simplify_opts_defaults();
            opts.error = errors[i];
            opts.method = (tl_simplify_method)method;
            double bound = errors[i] * (range[1] - range[0]);
            printf("%s at %g: ", method_names[method], errors[i]);
            last = holds_bound(mesh, &opts, 1, (const char *const[]){"f"}, &bound);
            CHECK(last < before || before < 100);
            before = last;
        }
    }
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* What a bound forbids is forbidden also where a number of tets is asked for. */
static void test_bound_and_target(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(10);
    (void)state;
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    double range[2];
    tl_channel_range(tl_mesh_channel(mesh, 0), m.vert_count, range, NULL);
    tl_simplify_opts opts = shrink_ratio(0.01);
    opts.error = 0.005;
    shrunk s = shrink(mesh, &opts);
    CHECK(!s.result.target_reached);
    CHECK_EQ(strcmp(s.result.stopped_by, "error"), 0);
    CHECK(s.result.tets_out > m.tet_count / 100);
    CHECK_BOUND("error", brute_error(mesh, s.mesh, "f", NULL), 0.005 * (range[1] - range[0]));
    shrink_release(&s);
    opts.ratio = 0.5;
    opts.error = 0.2;
    s = shrink(mesh, &opts);
    CHECK(s.result.target_reached);
    CHECK_EQ(strcmp(s.result.stopped_by, "target"), 0);
    CHECK(s.result.tets_out <= m.tet_count / 2 && s.result.tets_out > m.tet_count / 2 - 100);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static void test_many_channels(void **state)
{
    static const char *const names[] = {"f", "velocity", "stress", "small"};
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(9);
    (void)state;
    perturb_inner(&m, 0.1 / 8, 4);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    add_channel(mesh, "velocity", 3, 50);
    add_channel(mesh, "stress", 6, 1e6);
    add_channel(mesh, "small", 1, 1e-8);
    double bounds[4], range[2];
    for (size_t i = 0; i < 4; i++) {
        tl_channel_range(tl_mesh_channel_by_name(mesh, names[i]), m.vert_count, range, NULL);
        bounds[i] = 0.05 * (range[1] - range[0]);
    }
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.error = 0.05;
    CHECK(holds_bound(mesh, &opts, 4, names, bounds) < m.tet_count);

    /* absolute bounds for some, the tighter of both where both are given */
    tl_simplify_channel some[] = {{"velocity", 1, 0.5 * bounds[1]}, {"f", 2, 10 * bounds[0]}};
    opts.channels = some;
    opts.channel_count = 2;
    const char *const two[] = {"velocity", "f"};
    CHECK(holds_bound(mesh, &opts, 2, two, (const double[]){0.5 * bounds[1], bounds[0]}) <
          m.tet_count);
    opts.error = 0;
    size_t loose =
        holds_bound(mesh, &opts, 2, two, (const double[]){0.5 * bounds[1], 10 * bounds[0]});
    some[0].error = 1.5 * bounds[1];
    CHECK(holds_bound(mesh, &opts, 2, two, (const double[]){1.5 * bounds[1], 10 * bounds[0]}) <=
          loose);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Channels that don't steer are still good where others are bounded. */
static void test_others_carried(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(10);
    (void)state;
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    double *values = malloc(m.vert_count * sizeof *values);
    if (!values) abort();
    for (size_t v = 0; v < m.vert_count; v++) values[v] = field_linear(m.xyz + 3 * v);
    tl_channel linear = {"linear", "", 1, TL_ON_VERTEX, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &linear));
    tl_simplify_channel only = {"f", 1, 0.02};
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.channels = &only;
    opts.channel_count = 1;
    shrunk s = shrink(mesh, &opts);
    CHECK_BOUND("bounded channel", brute_error(mesh, s.mesh, "f", NULL), 0.02);
    CHECK_BOUND("linear channel", brute_error(mesh, s.mesh, "linear", NULL), 0.05 * 5.5);
    shrink_release(&s);
    free(values);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* A linear field is the same on any mesh: only the shape holds it up. */
static void test_linear(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(10);
    (void)state;
    perturb_inner(&m, 0.1 / 9, 2);
    tl_mesh *mesh = make_object(ctx, &m, field_linear);
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.error = 1e-3;
    double bound = 1e-3 * 5.5;
    CHECK(holds_bound(mesh, &opts, 1, (const char *const[]){"f"}, &bound) < m.tet_count / 40);
    opts = shrink_ratio(0.02);
    shrunk s = shrink(mesh, &opts);
    CHECK_BOUND("linear field", brute_error(mesh, s.mesh, "f", NULL), 5.5 * 2e-3);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* A constant beside a channel with a bound is in nobody's way. */
static void test_constant_beside(void **state)
{
    tl_ctx *ctx = shrink_ctx(1);
    make_mesh m = make_grid(9);
    (void)state;
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.error = 0.05;
    shrunk alone = shrink(mesh, &opts);
    double *zeros = calloc(m.vert_count, sizeof *zeros);
    tl_channel constant = {"zero", "", 1, TL_ON_VERTEX, TL_F64, zeros};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &constant));
    shrunk beside = shrink(mesh, &opts);
    CHECK(alone.result.tets_out < m.tet_count / 2);
    CHECK_NEAR((double)beside.result.tets_out, (double)alone.result.tets_out,
               0.05 * (double)m.tet_count);
    CHECK(beside.result.channels[1].max_error == 0);
    shrink_release(&alone);
    shrink_release(&beside);
    free(zeros);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* An error was asked for and no channel can break it: the shape alone decides. */
static void test_nothing_to_break(void **state)
{
    tl_ctx *ctx = shrink_ctx(1);
    make_mesh m = make_grid(9);
    (void)state;
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.error = 0.01;
    shrunk s = shrink(mesh, &opts);
    check_whole(mesh, &s, 1e-3 * mesh_diagonal(mesh), 1e-4);
    CHECK(s.result.tets_out < m.tet_count / 10);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* ---- scale and shift ---- */

static shrunk transformed(tl_ctx *ctx, const make_mesh *m, double factor, double shift,
                          double values, double error)
{
    make_mesh moved = make_room(m->vert_count, m->tet_count);
    double *f = malloc(m->vert_count * sizeof *f);
    tl_mesh *mesh = NULL;
    if (!f) abort();
    memcpy(moved.tets, m->tets, 4 * m->tet_count * sizeof *m->tets);
    for (size_t i = 0; i < 3 * m->vert_count; i++) moved.xyz[i] = factor * (m->xyz[i] + shift);
    for (size_t v = 0; v < m->vert_count; v++) f[v] = values * field_bumps(m->xyz + 3 * v);
    mesh = make_object(ctx, &moved, NULL);
    tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, f};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.ratio = error > 0 ? 0 : 0.1;
    opts.error = error;
    shrunk s = shrink(mesh, &opts);
    CHECK_OK(ctx, tl_mesh_check(ctx, s.mesh, TL_CHECK_FULL));
    s.result.channels[0].rms_error /= values;
    s.result.channels[0].max_error /= values;
    tl_mesh_destroy(mesh);
    make_release(&moved);
    free(f);
    return s;
}

static void test_invariance(void **state)
{
    static const double cases[][3] = {/* factor, shift, values */
                                      {1e-6, 0, 1},  {1e6, 0, 1},  {1, 1e6, 1},   {1e-6, 1e6, 1},
                                      {1, 0, 1e-12}, {1, 0, 1e12}, {1e-15, 0, 1}, {1e15, 0, 1e-20}};
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(12);
    (void)state;
    perturb_inner(&m, 0.1 / 11, 8);
    for (int by_error = 0; by_error < 2; by_error++) {
        shrunk base = transformed(ctx, &m, 1, 0, 1, by_error ? 0.02 : 0);
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            shrunk s =
                transformed(ctx, &m, cases[i][0], cases[i][1], cases[i][2], by_error ? 0.02 : 0);
            double tets = (double)s.result.tets_out / (double)base.result.tets_out - 1;
            double rms = s.result.channels[0].rms_error / base.result.channels[0].rms_error - 1;
            printf("%s, factor %g, shift %g, values %g: ", by_error ? "error" : "ratio",
                   cases[i][0], cases[i][1], cases[i][2]);
            CHECK_BOUND("tets differ by", fabs(tets), by_error ? 0.05 : 0.005);
            CHECK_BOUND("rms differs by", fabs(rms), 0.05);
            shrink_release(&s);
        }
        shrink_release(&base);
    }
    make_release(&m);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_channel),     cmocka_unit_test(test_bound_and_target),
        cmocka_unit_test(test_many_channels),   cmocka_unit_test(test_others_carried),
        cmocka_unit_test(test_linear),          cmocka_unit_test(test_nothing_to_break),
        cmocka_unit_test(test_constant_beside), cmocka_unit_test(test_invariance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
