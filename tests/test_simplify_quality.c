/* What a simplification by a number of tets promises of the shape: the number itself, tets that are
 * positive, topology, volume, boundary and interfaces within their bound. */
#include "check.h"
#include "check_simplify.h"
#include "tetralod/formats.h"

#include <unistd.h>

static void meets_ratio(tl_mesh *mesh, double ratio, double asked, double volume_part)
{
    tl_simplify_opts opts = shrink_ratio(ratio);
    opts.boundary_error = asked;
    shrunk s = shrink(mesh, &opts);
    if (asked < 0) asked = 1e-3 * mesh_diagonal(mesh);
    check_whole(mesh, &s, asked, volume_part);
    size_t target = (size_t)(ratio * (double)tl_mesh_tet_count(mesh));
    printf("tets %zu <= %zu\n", s.result.tets_out, target);
    CHECK(s.result.tets_out <= target);
    CHECK(s.result.tets_out + 200 >= target); /* the last collapse may pass it a little */
    CHECK(s.result.target_reached);
    CHECK_EQ(strcmp(s.result.stopped_by, "target"), 0);
    shrink_release(&s);
}

static void test_grid(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(21);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    (void)state;
    static const double ratios[] = {0.5, 0.1, 0.05};
    for (size_t i = 0; i < 3; i++) meets_ratio(mesh, ratios[i], -1, 1e-4);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Planes can be thinned without any distance. */
static void test_boundary_bounds(void **state)
{
    static const double asked[] = {0, 1e-9, 1e-4, 1e-3, 1e-2, 0.1};
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(15);
    perturb_inner(&m, 0.1 / 14, 5);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    (void)state;
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++)
        meets_ratio(mesh, 0.2, asked[i], 1e-4);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Every vertex of the boundary is off its plane: little can go when little is allowed. */
static void test_rough_boundary(void **state)
{
    static const double asked[] = {0, 1e-4, 1e-3, 3e-3, 1e-2, 0.1};
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(13);
    make_perturb(&m, 0.08 / 12, 5);
    make_shuffle(&m, 3);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    (void)state;
    size_t last = SIZE_MAX;
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++) {
        tl_simplify_opts opts = shrink_ratio(0.05);
        opts.boundary_error = asked[i];
        shrunk s = shrink(mesh, &opts);
        check_whole(mesh, &s, asked[i], 1e-4);
        CHECK(s.result.tets_out <= last);
        last = s.result.tets_out;
        if (i == 0) CHECK(!s.result.target_reached);
        if (i == 0) CHECK_EQ(strcmp(s.result.stopped_by, "boundary error"), 0);
        shrink_release(&s);
    }
    CHECK(last <= m.tet_count / 10);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Cells that grow by a factor of some hundred from one corner to the other. */
static void test_graded(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(17);
    (void)state;
    perturb_inner(&m, 0.1 / 16, 11);
    for (size_t i = 0; i < 3 * m.vert_count; i++)
        m.xyz[i] = (exp(4 * m.xyz[i]) - 1) / (exp(4.0) - 1);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FULL));
    meets_ratio(mesh, 0.1, -1, 1e-4);
    meets_ratio(mesh, 0.1, 0, 1e-9);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static void test_cavity(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid_cavity(16);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    (void)state;
    meets_ratio(mesh, 0.1, -1, 1e-4);
    meets_ratio(mesh, 0.1, 0, 1e-9);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* The cavity rounded towards a ball, the outside left a cube. */
static void round_cavity(make_mesh *m)
{
    for (size_t v = 0; v < m->vert_count; v++) {
        double *x = m->xyz + 3 * v, d[3], most = 0, length = 0;
        for (int k = 0; k < 3; k++) d[k] = x[k] - 0.5;
        for (int k = 0; k < 3; k++) most = fmax(most, fabs(d[k])), length += d[k] * d[k];
        if (!(most > 0)) continue;
        double part = fmin(fmax((0.5 - most) / (0.5 - 1.0 / 6), 0), 1);
        for (int k = 0; k < 3; k++) x[k] = 0.5 + d[k] * (1 + part * (most / sqrt(length) - 1));
    }
}

static void test_curved_cavity(void **state)
{
    static const double asked[] = {1e-3, 3e-3, 1e-2};
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid_cavity(19);
    (void)state;
    round_cavity(&m);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FULL));
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++)
        meets_ratio(mesh, 0.2, asked[i], 1e-4);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static void test_sphere_flow(void **state)
{
    static const double asked[] = {1e-3, 1e-2, 0.05};
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = NULL;
    (void)state;
    CHECK_OK(ctx, tl_sample_write(ctx, "sphere-flow", 13, "sphere_flow.vtu"));
    CHECK_OK(ctx, tl_mesh_read(ctx, "sphere_flow.vtu", NULL, &mesh, NULL));
    unlink("sphere_flow.vtu");
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++) {
        tl_simplify_opts opts = shrink_ratio(0.1);
        opts.boundary_error = asked[i];
        shrunk s = shrink(mesh, &opts);
        check_whole(mesh, &s, asked[i], 1e-4);
        shrink_release(&s);
    }
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- regions ---- */

static void check_regions(tl_mesh *mesh, double asked, double volume_part)
{
    tl_simplify_opts opts = shrink_ratio(0.1);
    opts.boundary_error = asked;
    shrunk s = shrink(mesh, &opts);
    check_whole(mesh, &s, asked, 1e-4);
    check_same_topology(mesh, s.mesh, true);
    CHECK_BOUND("interface", brute_surface_distance(mesh, s.mesh, true),
                s.result.boundary_error + 1e-12);
    for (int32_t region = 1; region <= 2; region++) {
        double before = region_volume(mesh, region, false);
        CHECK_BOUND("volume of a region", fabs(region_volume(s.mesh, region, false) / before - 1),
                    volume_part);
    }
    shrink_release(&s);
}

static void test_flat_interface(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(15); /* an even number of cells: a plane of vertices at 1/2 */
    (void)state;
    make_two_regions(&m);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    check_regions(mesh, 0, 1e-9);
    check_regions(mesh, 1e-3, 1e-4);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* A wavy interface that ends on the outer boundary, and one that is a staircase of tets. */
static void test_curved_interface(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(17);
    (void)state;
    make_two_regions(&m);
    for (size_t v = 0; v < m.vert_count; v++) {
        double *x = m.xyz + 3 * v;
        x[0] += 0.3 * x[0] * (1 - x[0]) * sin(5 * x[1]) * cos(4 * x[2]);
    }
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FULL));
    check_regions(mesh, 1e-3, 1e-3);
    check_regions(mesh, 5e-3, 3e-3);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static void test_ball_region(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    make_mesh m = make_grid(17);
    (void)state;
    make_two_regions(&m);
    for (size_t t = 0; t < m.tet_count; t++) {
        double c[3] = {0}, d = 0;
        for (size_t i = 0; i < 12; i++)
            c[i % 3] += m.xyz[3 * (size_t)m.tets[4 * t + i / 3] + i % 3] / 4;
        for (int k = 0; k < 3; k++) d += (c[k] - 0.5) * (c[k] - 0.5);
        m.regions[t] = d < 0.09 ? 1 : 2;
    }
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    check_regions(mesh, 1e-2, 2e-2);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grid),
        cmocka_unit_test(test_boundary_bounds),
        cmocka_unit_test(test_rough_boundary),
        cmocka_unit_test(test_graded),
        cmocka_unit_test(test_cavity),
        cmocka_unit_test(test_curved_cavity),
        cmocka_unit_test(test_sphere_flow),
        cmocka_unit_test(test_flat_interface),
        cmocka_unit_test(test_curved_interface),
        cmocka_unit_test(test_ball_region),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
