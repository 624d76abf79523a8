/* Points on isosurfaces: how many there are against areas and integrals in closed form, how evenly
 * they lie, and that neither numbers of a mesh, parts of it nor threads change them. */
#include "check.h"

#include "tetralod/extract.h"

#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

static const double PI = 3.14159265358979323846;

static double radius(const double x[3])
{
    return hypot(hypot(x[0] - 0.5, x[1] - 0.5), x[2] - 0.5);
}

static double along(const double x[3])
{
    return 3 * x[0];
}

static double square(const double x[3])
{
    return radius(x) * radius(x);
}

static tl_polydata *points_of(tl_ctx *ctx, const tl_mesh *mesh, const tl_points_opts *opts,
                              double *area)
{
    tl_polydata *p = NULL;
    CHECK_OK(ctx, tl_slice_points(ctx, mesh, tl_mesh_channel(mesh, 0)->values, opts, area, &p));
    CHECK_EQ(p->vert_count, p->cell_count);
    CHECK_EQ(p->kind, TL_POLY_POINTS);
    return p;
}

/* Counts of independent dice are this far from what is expected, at most. */
static double off_by(double expected)
{
    return 5 * sqrt(expected);
}

/* On spheres: as many as their areas tell, on them, in all directions alike. */
static void points_on_spheres(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(32);
    make_shuffle(&m, 2);
    tl_mesh *mesh = make_object(ctx, &m, radius);
    static const double radii[2] = {0.4, 0.2};
    size_t carried = 0;
    double area;
    tl_points_opts opts = tl_points_opts_defaults();
    opts.values = radii;
    opts.value_count = 2;
    opts.count = 50000;
    opts.channels = &carried;
    opts.channel_count = 1;
    tl_polydata *p = points_of(ctx, mesh, &opts, &area);
    CHECK_NEAR((double)p->vert_count, 50000, off_by(50000));
    CHECK_NEAR(area, 4 * PI * 0.2 / 50000, 0.01 * 4 * PI * 0.2 / 50000);
    double octants[2][8] = {{0}};
    for (size_t i = 0; i < p->vert_count; i++) {
        const double *x = p->xyz + 3 * i, r = radius(x);
        int inner = r < 0.3, octant = (x[0] > 0.5) + 2 * (x[1] > 0.5) + 4 * (x[2] > 0.5);
        double inward = 0;
        octants[inner][octant]++;
        CHECK_NEAR(r, radii[inner], 0.003);
        CHECK_NEAR(p->channels[0].values[i], radii[inner], 1e-14);
        for (size_t k = 0; k < 3; k++) inward -= (double)p->normals[3 * i + k] * (x[k] - 0.5) / r;
        CHECK(inward > 0.9);
    }
    for (int i = 0; i < 8; i++) {
        CHECK_NEAR(octants[0][i], 5000, off_by(5000));
        CHECK_NEAR(octants[1][i], 1250, off_by(1250));
    }
    tl_polydata_destroy(ctx, p);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Of all values: as many at each place as the gradient is long. Of r^2 there are r^4-like many
 * within r; many single isosurfaces have as large an area as all of them. */
static void points_of_all_values(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(40);
    tl_mesh *mesh = make_object(ctx, &m, square);
    double area_all, area_some, values[200];
    tl_points_opts opts = tl_points_opts_defaults();
    opts.count = 100000;
    opts.low = 0;
    opts.high = 0.16;
    tl_polydata *p = points_of(ctx, mesh, &opts, &area_all);
    CHECK_NEAR((double)p->vert_count, 100000, off_by(100000));
    /* integral of 2 r over the ball of radius 0.4 */
    double all = 2 * PI * pow(0.4, 4);
    CHECK_NEAR(area_all * 100000, all, 0.01 * all);
    for (int shell = 1; shell <= 4; shell++) {
        double within = 0, expected = 100000 * pow(shell / 4.0, 4);
        for (size_t i = 0; i < p->vert_count; i++) within += radius(p->xyz + 3 * i) < 0.1 * shell;
        CHECK_NEAR(within, expected, off_by(expected) + 0.01 * expected);
    }
    tl_polydata_destroy(ctx, p);
    for (int i = 0; i < 200; i++) values[i] = 0.16 * (i + 0.5) / 200;
    opts.values = values;
    opts.value_count = 200;
    tl_polydata_destroy(ctx, points_of(ctx, mesh, &opts, &area_some));
    CHECK_NEAR(area_some * 0.16 / 200, area_all, 0.005 * area_all);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Values between ends that cut tets far larger than what is between them. */
static void a_thin_layer_of_large_tets(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(3);
    make_perturb(&m, 0.02, 5);
    for (size_t v = 0; v < m.vert_count; v++) /* the cube's sides stay where they are */
        for (size_t k = 0; k < 3; k++) {
            double *x = &m.xyz[3 * v + k];
            *x = *x < 0.2 ? 0 : *x > 0.8 ? 1 : *x;
        }
    tl_mesh *mesh = make_object(ctx, &m, along);
    tl_points_opts opts = tl_points_opts_defaults();
    double area, counts[4] = {0};
    opts.count = 40000;
    opts.low = 3 * 0.301;
    opts.high = 3 * 0.305;
    tl_polydata *p = points_of(ctx, mesh, &opts, &area);
    CHECK_NEAR(area * 40000, 3 * 0.004, 1e-10);
    CHECK_NEAR((double)p->vert_count, 40000, off_by(40000));
    for (size_t i = 0; i < p->vert_count; i++) {
        const double *x = p->xyz + 3 * i;
        CHECK(x[0] > 0.301 - 1e-12 && x[0] < 0.305 + 1e-12);
        CHECK_NEAR((double)p->normals[3 * i], -1, 1e-6);
        for (int k = 0; k < 3; k++) counts[k] += x[k] < (k ? 0.25 : 0.302);
        counts[3] += x[1] > 0.5 && x[2] > 0.5;
    }
    for (int i = 0; i < 4; i++) CHECK_NEAR(counts[i], 10000, off_by(10000));
    tl_polydata_destroy(ctx, p);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static int by_place(const void *a, const void *b)
{
    return memcmp(a, b, 3 * sizeof(double));
}

static tl_polydata *sorted_points(tl_ctx *ctx, const make_mesh *m, const tl_points_opts *opts)
{
    tl_mesh *mesh = make_object(ctx, m, radius);
    tl_polydata *p = points_of(ctx, mesh, opts, NULL);
    qsort(p->xyz, p->vert_count, 3 * sizeof(double), by_place);
    tl_mesh_destroy(mesh);
    return p;
}

static void check_same(const tl_polydata *a, const tl_polydata *b)
{
    CHECK_EQ(a->vert_count, b->vert_count);
    CHECK(memcmp(a->xyz, b->xyz, 3 * a->vert_count * sizeof *a->xyz) == 0);
}

/* Other numbers, parts, threads: the same points to the bit; another seed: others. */
static void same_points_of_same_tets(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    static const double values[2] = {0.3, 0.35};
    make_mesh m = make_grid(24);
    make_perturb(&m, 0.05 / 24, 7);
    for (int all = 0; all < 2; all++) {
        tl_points_opts opts = tl_points_opts_defaults();
        opts.area = 1e-4;
        opts.values = values;
        opts.value_count = all ? 0 : 2;
        opts.low = all ? 0.2 : opts.low;
        tl_polydata *p = sorted_points(ctx, &m, &opts), *q;
        CHECK(p->vert_count > 5000);
        make_shuffle(&m, 3);
        q = sorted_points(ctx, &m, &opts);
        check_same(p, q);
        tl_polydata_destroy(ctx, q);
        make_mesh half = m;
        half.tet_count = m.tet_count / 3;
        q = sorted_points(ctx, &half, &opts);
        size_t count = q->vert_count;
        for (size_t i = 0; i < q->vert_count; i++)
            CHECK(bsearch(q->xyz + 3 * i, p->xyz, p->vert_count, 3 * sizeof(double), by_place));
        tl_polydata_destroy(ctx, q);
        half.tets += 4 * half.tet_count;
        half.tet_count = m.tet_count - half.tet_count;
        q = sorted_points(ctx, &half, &opts);
        CHECK_EQ(q->vert_count + count, p->vert_count);
        tl_polydata_destroy(ctx, q);
        opts.seed = 1;
        q = sorted_points(ctx, &m, &opts);
        CHECK(memcmp(q->xyz, p->xyz, 24) != 0);
        tl_polydata_destroy(ctx, q);
        tl_polydata_destroy(ctx, p);
        opts.area = 0;
        tl_mesh *mesh = make_object(ctx, &m, radius);
        p = points_of(ctx, mesh, &opts, NULL);
        for (unsigned threads = 2; threads <= 3; threads++) {
            tl_ctx *other = check_ctx_create(threads);
            q = points_of(other, mesh, &opts, NULL);
            check_same(p, q);
            CHECK(memcmp(p->normals, q->normals, 3 * p->vert_count * sizeof *p->normals) == 0);
            tl_polydata_destroy(other, q);
            check_ctx_destroy(other);
        }
        tl_polydata_destroy(ctx, p);
        tl_mesh_destroy(mesh);
    }
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void points_of_anything(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_wreck(60, 500, 3);
    tl_mesh *mesh = make_object(ctx, &m, square);
    tl_points_opts opts = tl_points_opts_defaults();
    tl_polydata *p = points_of(ctx, mesh, NULL, NULL);
    CHECK_NEAR((double)p->vert_count, 200000, off_by(200000));
    for (size_t i = 0; i < 3 * p->vert_count; i++)
        CHECK(isfinite(p->xyz[i]) && isfinite(p->normals[i]));
    tl_polydata_destroy(ctx, p);
    const double *scalar = tl_mesh_channel(mesh, 0)->values;
    double value = 7;
    opts.values = &value;
    opts.value_count = 1; /* nothing has it */
    p = points_of(ctx, mesh, &opts, NULL);
    CHECK_EQ(p->vert_count, 0);
    tl_polydata_destroy(ctx, p);
    value = (double)NAN;
    CHECK_STATUS(tl_slice_points(ctx, mesh, scalar, &opts, NULL, &p), TL_ERR_ARG);
    opts.value_count = 0;
    opts.area = 1e-300;
    CHECK_STATUS(tl_slice_points(ctx, mesh, scalar, &opts, NULL, &p), TL_ERR_UNSUPPORTED);
    opts.area = -1;
    CHECK_STATUS(tl_slice_points(ctx, mesh, scalar, &opts, NULL, &p), TL_ERR_ARG);
    opts.area = 0;
    opts.count = 0;
    CHECK_STATUS(tl_slice_points(ctx, mesh, scalar, &opts, NULL, &p), TL_ERR_ARG);
    opts.count = 1;
    opts.low = opts.high;
    CHECK_STATUS(tl_slice_points(ctx, mesh, scalar, &opts, NULL, &p), TL_ERR_ARG);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static tl_status sample_some(tl_ctx *ctx, void *arg)
{
    size_t carried = 0;
    tl_polydata *p = NULL;
    tl_points_opts opts = tl_points_opts_defaults();
    opts.count = 100;
    opts.channels = &carried;
    opts.channel_count = 1;
    tl_status st = tl_slice_points(ctx, arg, tl_mesh_channel(arg, 0)->values, &opts, NULL, &p);
    tl_polydata_destroy(ctx, p);
    return st;
}

static void failing_memory_leaks_nothing(void **state)
{
    (void)state;
    fail_alloc f;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(5);
    tl_mesh *mesh = make_object(ctx, &m, radius);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, sample_some, mesh) > 8);
    fail_alloc_close(&f);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_on_spheres),
        cmocka_unit_test(points_of_all_values),
        cmocka_unit_test(a_thin_layer_of_large_tets),
        cmocka_unit_test(same_points_of_same_tets),
        cmocka_unit_test(points_of_anything),
        cmocka_unit_test(failing_memory_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
