/* Meshes and options as they should not be: nothing crashes, bad parts are kept and the rest is
 * simplified around them. */
#include "check.h"
#include "check_simplify.h"

static tl_mesh *raw_mesh(tl_ctx *ctx, const double *xyz, size_t verts, const tl_lidx *tets,
                         size_t count)
{
    tl_mesh *mesh = NULL;
    CHECK_OK(ctx, tl_mesh_create(ctx, xyz, verts, tets, count, &mesh));
    double *values = malloc((verts + 1) * sizeof *values);
    for (size_t v = 0; v < verts; v++) values[v] = sin((double)v);
    tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    free(values);
    return mesh;
}

static void count_signs(const tl_mesh *mesh, size_t *inverted, size_t *flat)
{
    tl_mesh_stats stats;
    CHECK_OK(tl_mesh_ctx(mesh), tl_mesh_measure(tl_mesh_ctx(mesh), mesh, &stats));
    *inverted = stats.inverted;
    *flat = stats.degenerate;
}

/* Every method, with and without a bound; no tet more is bad than before. Returns the least number
 * of tets reached. */
static size_t survives(const tl_mesh *mesh, double ratio)
{
    size_t bad[2], after[2], least = SIZE_MAX;
    count_signs(mesh, &bad[0], &bad[1]);
    for (int method = 0; method <= TL_SIMPLIFY_BLOCKS; method++)
        for (int how = 0; how < 4; how++) {
            double range[2];
            tl_channel_range(tl_mesh_channel(mesh, 0), tl_mesh_vert_count(mesh), range, NULL);
            tl_simplify_opts opts = shrink_ratio(ratio);
            opts.method = (tl_simplify_method)method;
            opts.placement = (tl_placement)(how & 1);
            opts.error = how & 2 ? 0.1 : 0;
            shrunk s = shrink(mesh, &opts);
            CHECK_OK(tl_mesh_ctx(mesh), tl_mesh_check(tl_mesh_ctx(mesh), s.mesh, TL_CHECK_FAST));
            count_signs(s.mesh, &after[0], &after[1]);
            CHECK_EQ(after[0], s.result.inverted);
            CHECK_EQ(after[1], s.result.degenerate);
            CHECK(after[0] <= bad[0] && after[1] <= bad[1]);
            CHECK(s.result.tets_out >= 1);
            CHECK(s.result.boundary_error >= 0);
            if (how & 2) CHECK(s.result.channels[0].max_error <= 0.1 * (range[1] - range[0]));
            CHECK(s.result.target_reached ==
                      (s.result.tets_out <= (size_t)(ratio * (double)s.result.tets_in)) ||
                  s.result.tets_out == 1);
            if (s.result.tets_out < least) least = s.result.tets_out;
            shrink_release(&s);
        }
    return least;
}

static size_t survives_arrays(const double *xyz, size_t verts, const tl_lidx *tets, size_t count)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = raw_mesh(ctx, xyz, verts, tets, count);
    size_t least = survives(mesh, 0.01);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
    return least;
}

static size_t survives_make(const make_mesh *m, double ratio)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = make_object(ctx, m, field_bumps);
    size_t least = survives(mesh, ratio);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
    return least;
}

static const double CORNERS[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};

static void test_empty(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = raw_mesh(ctx, CORNERS[0], 4, NULL, 0), *out = mesh;
    tl_simplify_result result = {.tets_in = 7};
    tl_simplify_opts opts = shrink_ratio(0.5);
    (void)state;
    CHECK_STATUS(tl_mesh_simplify(ctx, mesh, &opts, &out, &result), TL_ERR_DATA);
    CHECK(out == NULL);
    CHECK(strstr(tl_ctx_message(ctx), "no tets") != NULL);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_options(void **state)
{
    tl_ctx *ctx = shrink_ctx(1);
    static const tl_lidx one[] = {0, 1, 2, 3};
    tl_mesh *mesh = raw_mesh(ctx, CORNERS[0], 4, one, 1), *out;
    tl_simplify_result result;
    (void)state;
    tl_simplify_channel unknown = {"g", 1, 0}, weightless = {"f", 0, 0}, negative = {"f", 1, -1},
                        nameless = {NULL, 1, 0}, endless = {"f", INFINITY, 0};
    const struct {
        tl_simplify_opts opts;
        tl_status status;
    } cases[] = {
        {tl_simplify_opts_defaults(), TL_ERR_ARG},
        {{.ratio = -1}, TL_ERR_ARG},
        {{.ratio = 1.5}, TL_ERR_ARG},
        {{.ratio = NAN}, TL_ERR_ARG},
        {{.ratio = 1, .error = -1}, TL_ERR_ARG},
        {{.ratio = 1, .error = NAN}, TL_ERR_ARG},
        {{.ratio = 1, .boundary_error = NAN}, TL_ERR_ARG},
        {{.ratio = 1, .boundary_error = INFINITY}, TL_ERR_ARG},
        {{.ratio = 1, .min_quality = 1}, TL_ERR_ARG},
        {{.ratio = 1, .min_quality = -0.1}, TL_ERR_ARG},
        {{.ratio = 1, .method = (tl_simplify_method)9}, TL_ERR_ARG},
        {{.ratio = 1, .placement = (tl_placement)2}, TL_ERR_ARG},
        {{.ratio = 1, .channels = &unknown, .channel_count = 1}, TL_ERR_DATA},
        {{.ratio = 1, .channels = &nameless, .channel_count = 1}, TL_ERR_DATA},
        {{.ratio = 1, .channels = &weightless, .channel_count = 1}, TL_ERR_ARG},
        {{.ratio = 1, .channels = &negative, .channel_count = 1}, TL_ERR_ARG},
        {{.ratio = 1, .channels = &endless, .channel_count = 1}, TL_ERR_ARG},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        size_t bytes = tl_ctx_current_bytes(ctx);
        out = mesh;
        CHECK_STATUS(tl_mesh_simplify(ctx, mesh, &cases[i].opts, &out, &result), cases[i].status);
        CHECK(out == NULL);
        CHECK(*tl_ctx_message(ctx));
        CHECK_EQ(tl_ctx_current_bytes(ctx), bytes);
        tl_simplify_release(ctx, &result);
    }
    CHECK_STATUS(tl_mesh_simplify(ctx, mesh, NULL, &out, &result), TL_ERR_ARG);
    tl_simplify_release(ctx, NULL);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_few_tets(void **state)
{
    static const tl_lidx one[] = {0, 1, 2, 3}, two[] = {0, 1, 2, 3, 1, 2, 3, 4};
    static const tl_lidx doubled[] = {0, 1, 2, 3, 0, 1, 2, 3}, turned[] = {0, 2, 1, 3};
    static const tl_lidx mirrored[] = {0, 1, 2, 3, 0, 2, 1, 3}, degenerate[] = {0, 1, 1, 3};
    static const tl_lidx apart[] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 1, 2, 3, 4};
    (void)state;
    CHECK_EQ(survives_arrays(CORNERS[0], 5, one, 1), 1);
    CHECK_EQ(survives_arrays(CORNERS[0], 5, two, 2), 2);
    CHECK_EQ(survives_arrays(CORNERS[0], 5, doubled, 2), 2);
    CHECK_EQ(survives_arrays(CORNERS[0], 5, turned, 1), 1);
    CHECK_EQ(survives_arrays(CORNERS[0], 5, mirrored, 2), 2);
    CHECK_EQ(survives_arrays(CORNERS[0], 5, degenerate, 1), 1);
    CHECK_EQ(survives_arrays(CORNERS[0], 5, apart, 4), 4);
}

static void test_all_at_one_place(void **state)
{
    make_mesh m = make_grid(6);
    (void)state;
    for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] = 2.5;
    CHECK_EQ(survives_make(&m, 0.1), m.tet_count);
    for (size_t i = 0; i < 3 * m.vert_count; i += 3) m.xyz[i] = (double)i; /* on a line */
    CHECK_EQ(survives_make(&m, 0.1), m.tet_count);
    for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] = NAN;
    CHECK_EQ(survives_make(&m, 0.1), m.tet_count);
    make_release(&m);
}

/* Some tets are flat, turned, doubled, or stand on corners of their own; the others shrink. */
static void test_bad_parts(void **state)
{
    (void)state;
    for (int kind = 0; kind < 5; kind++) {
        make_mesh m = make_grid(9);
        uint64_t seed = 17;
        for (int i = 0; i < 12; i++) {
            tl_lidx *q = m.tets + 4 * (size_t)(make_random(&seed) % m.tet_count);
            tl_lidx *p = m.tets + 4 * (size_t)(make_random(&seed) % m.tet_count);
            if (kind == 0) q[0] = q[1];
            if (kind == 1) q[0] ^= q[1], q[1] ^= q[0], q[0] ^= q[1];
            if (kind == 2) memcpy(p, q, 4 * sizeof *q);
            if (kind == 3) p[0] = q[0]; /* long tets through everything */
            if (kind == 4)              /* two corners at one place */
                memcpy(m.xyz + 3 * (size_t)q[0], m.xyz + 3 * (size_t)q[1], 3 * sizeof *m.xyz);
        }
        size_t least = survives_make(&m, 0.1);
        printf("kind %d: %zu tets of %zu left\n", kind, least, m.tet_count);
        CHECK(least < m.tet_count * 2 / 3);
        make_release(&m);
    }
}

static void test_soup(void **state)
{
    make_mesh m = make_soup(40, 300, 4);
    (void)state;
    survives_make(&m, 0.1);
    make_release(&m);
    m = make_soup(400, 100, 5);
    survives_make(&m, 0.1);
    make_release(&m);
}

/* Vertices at one place with different values are told apart by their numbers: an error bound is
 * held in the end, and the tries end. */
static void test_values_at_one_place(void **state)
{
    (void)state;
    const double one[4][3] = {{0}};
    const tl_lidx tet[4] = {0, 1, 2, 3};
    survives_arrays(one[0], 4, tet, 1);
    const double more[7][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1},
                               {1, 1, 1}, {0, 1, 0}, {0, 1, 0}};
    const tl_lidx tets[3][4] = {{0, 1, 2, 3}, {1, 2, 3, 4}, {0, 1, 5, 6}};
    survives_arrays(more[0], 7, tets[0], 3);
}

/* Vertices of no tet are left out. */
static void test_unreferenced(void **state)
{
    tl_ctx *ctx = shrink_ctx(1);
    make_mesh m = make_grid(9), more = make_room(m.vert_count + 100, m.tet_count);
    (void)state;
    for (size_t i = 0; i < 3 * more.vert_count; i++) more.xyz[i] = 1e3;
    memcpy(more.xyz + 150, m.xyz, 3 * m.vert_count * sizeof *m.xyz);
    for (size_t i = 0; i < 4 * m.tet_count; i++) more.tets[i] = m.tets[i] + 50;
    tl_mesh *mesh = make_object(ctx, &more, field_bumps);
    tl_simplify_opts opts = shrink_ratio(0.5);
    shrunk s = shrink(mesh, &opts);
    check_whole(mesh, &s, 1e-3 * sqrt(3.0), 1e-4);
    CHECK(s.result.target_reached);
    tl_mesh_stats stats;
    CHECK_OK(ctx, tl_mesh_measure(ctx, s.mesh, &stats));
    CHECK_EQ(stats.unused_verts, 0);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    make_release(&m);
    make_release(&more);
    tl_ctx_destroy(ctx);
}

/* One vertex in the middle of a ball of count tets or more: rings of triangles around it. */
static make_mesh make_fan(size_t rings, size_t around)
{
    make_mesh m = make_room(1 + rings * around, 2 * (rings - 1) * around);
    size_t t = 0;
    for (size_t r = 0; r < rings; r++)
        for (size_t a = 0; a < around; a++) {
            double *x = m.xyz + 3 * (1 + r * around + a);
            double theta = 0.3 + 2.5 * (double)r / (double)(rings - 1);
            double phi = 6.283185307179586 * (double)a / (double)around;
            x[0] = sin(theta) * cos(phi);
            x[1] = sin(theta) * sin(phi);
            x[2] = cos(theta);
        }
    for (size_t r = 0; r + 1 < rings; r++)
        for (size_t a = 0; a < around; a++) {
            tl_lidx p = (tl_lidx)(1 + r * around + a),
                    q = (tl_lidx)(1 + r * around + (a + 1) % around);
            tl_lidx up = (tl_lidx)around, two[8] = {0, p, p + up, q, 0, q, p + up, q + up};
            memcpy(m.tets + 4 * t, two, sizeof two);
            t += 2;
        }
    return m;
}

static void test_fan(void **state)
{
    make_mesh m = make_fan(51, 50);
    tl_ctx *ctx = shrink_ctx(2);
    (void)state;
    CHECK_EQ(m.tet_count, 5000);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FULL));
    size_t least = survives(mesh, 0.1);
    printf("fan: %zu tets left of 5000\n", least);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Two balls that touch in a vertex, two that touch in an edge. */
static void test_nonmanifold(void **state)
{
    (void)state;
    for (int shared = 1; shared <= 2; shared++) {
        tl_ctx *ctx = shrink_ctx(2);
        make_mesh m = make_grid(7), two = make_room(2 * m.vert_count, 2 * m.tet_count);
        tl_lidx n = (tl_lidx)m.vert_count;
        for (size_t i = 0; i < 3 * m.vert_count; i++) {
            two.xyz[i] = m.xyz[i];
            two.xyz[3 * m.vert_count + i] = m.xyz[i] + (i % 3 < 2 || shared == 1 ? 1 : 0);
        }
        for (size_t i = 0; i < 4 * m.tet_count; i++) {
            two.tets[i] = m.tets[i];
            tl_lidx v = m.tets[i];
            bool touches = shared == 1 ? v == 0 : v % 49 == 0;
            two.tets[4 * m.tet_count + i] = touches ? (shared == 1 ? n - 1 : v + 48) : v + n;
        }
        tl_mesh *mesh = make_object(ctx, &two, field_bumps);
        tl_mesh_stats stats;
        CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
        CHECK_EQ(stats.nonmanifold_verts, shared == 1 ? 1 : 0);
        CHECK_EQ(stats.nonmanifold_edges, shared == 1 ? 0 : 6);
        tl_simplify_opts opts = shrink_ratio(0.3);
        shrunk s = shrink(mesh, &opts);
        check_whole(mesh, &s, 1e-3 * stats.diagonal, 1e-4);
        CHECK(s.result.target_reached);
        shrink_release(&s);
        tl_mesh_destroy(mesh);
        make_release(&two);
        make_release(&m);
        tl_ctx_destroy(ctx);
    }
}

/* Layers of 1e-6 in a domain of 100, as at a wall. */
static void test_thin_layers(void **state)
{
    make_mesh m = make_grid(12);
    tl_ctx *ctx = shrink_ctx(2);
    (void)state;
    for (size_t v = 0; v < m.vert_count; v++) {
        double *x = m.xyz + 3 * v;
        x[2] = x[2] > 0 ? 1e-6 * pow(1e8, (x[2] * 11 - 1) / 10) : 0; /* 0, 1e-6 ... 100 */
        x[0] *= 100;
        x[1] *= 100;
    }
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    double *values = malloc(m.vert_count * sizeof *values);
    for (size_t v = 0; v < m.vert_count; v++)
        values[v] = tanh(m.xyz[3 * v + 2] / 1e-3) + 0.01 * sin(m.xyz[3 * v] / 20);
    tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FULL));
    for (int by_error = 0; by_error < 2; by_error++) {
        tl_simplify_opts opts = shrink_ratio(0.2);
        opts.error = by_error ? 0.02 : 0;
        shrunk s = shrink(mesh, &opts);
        check_whole(mesh, &s, 1e-3 * mesh_diagonal(mesh), 1e-4);
        printf("layers: rms %.4g of %.4g\n", s.result.channels[0].rms_error,
               s.result.channels[0].range[1] - s.result.channels[0].range[0]);
        CHECK(s.result.tets_out < m.tet_count / 2);
        if (by_error)
            CHECK_BOUND("error", brute_error(mesh, s.mesh, "f", NULL),
                        0.02 * (s.result.channels[0].range[1] - s.result.channels[0].range[0]));
        shrink_release(&s);
    }
    free(values);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Sizes at which signs are exact, and some that are out of the range of doubles soon. */
static void test_extreme_sizes(void **state)
{
    static const double sizes[] = {1e-300, 1e-120, 1e-75, 1e-40, 1e-30,
                                   1e30,   1e40,   1e95,  1e120, 1e300};
    tl_ctx *ctx = shrink_ctx(2);
    (void)state;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        make_mesh m = make_grid(7);
        tl_mesh *plain = make_object(ctx, &m, field_bumps);
        for (size_t k = 0; k < 3 * m.vert_count; k++) m.xyz[k] *= sizes[i];
        tl_mesh *mesh = make_object(ctx, &m, NULL);
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, tl_mesh_channel(plain, 0)));
        tl_simplify_opts opts = shrink_ratio(0.2);
        shrunk s = shrink(mesh, &opts);
        printf("size %g: %zu tets left of %zu (%s)\n", sizes[i], s.result.tets_out, m.tet_count,
               s.result.stopped_by);
        if (fabs(log10(sizes[i])) <= 40) CHECK(s.result.target_reached);
        if (fabs(log10(sizes[i])) <= 75) CHECK_OK(ctx, tl_mesh_check(ctx, s.mesh, TL_CHECK_FULL));
        CHECK(isfinite(s.result.channels[0].max_error));
        shrink_release(&s);
        tl_mesh_destroy(mesh);
        tl_mesh_destroy(plain);
        make_release(&m);
    }
    tl_ctx_destroy(ctx);
}

static void test_targets(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(9);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    (void)state;
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.target_tets = 1;
    shrunk s = shrink(mesh, &opts);
    CHECK(!s.result.target_reached);
    CHECK(strcmp(s.result.stopped_by, "target") != 0);
    check_whole(mesh, &s, 1e-3 * sqrt(3.0), 1e-4);
    shrink_release(&s);
    static const size_t enough[] = {2560, 2561, SIZE_MAX};
    for (size_t i = 0; i < 3; i++) {
        opts.target_tets = enough[i];
        s = shrink(mesh, &opts);
        CHECK(s.result.target_reached);
        CHECK_EQ(strcmp(s.result.stopped_by, "target"), 0);
        CHECK_EQ(s.result.tets_out, m.tet_count);
        CHECK_EQ(s.result.vertices_out, m.vert_count);
        CHECK(s.result.channels[0].max_error == 0);
        CHECK(s.result.boundary_error == 0);
        shrink_release(&s);
    }
    opts.ratio = 0.5; /* the smaller of both counts */
    opts.target_tets = 500;
    s = shrink(mesh, &opts);
    CHECK(s.result.tets_out <= 500);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_empty),
        cmocka_unit_test(test_options),
        cmocka_unit_test(test_few_tets),
        cmocka_unit_test(test_all_at_one_place),
        cmocka_unit_test(test_bad_parts),
        cmocka_unit_test(test_soup),
        cmocka_unit_test(test_unreferenced),
        cmocka_unit_test(test_fan),
        cmocka_unit_test(test_nonmanifold),
        cmocka_unit_test(test_thin_layers),
        cmocka_unit_test(test_extreme_sizes),
        cmocka_unit_test(test_targets),
        cmocka_unit_test(test_values_at_one_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
