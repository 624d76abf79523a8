/* Slices: areas and triangles of fields with a known answer, closed surfaces, one result for any
 * number of threads, values, blocks and pieces of a mesh; gradients. */
#include "check.h"
#include "check_ctx.h"

#include "tetralod/extract.h"

#include "fail_alloc.h"
#include "make_mesh.h"

static double linear(const double x[3])
{
    return 2 * x[0] - 3 * x[1] + 5 * x[2];
}

static double radius(const double x[3])
{
    double d[3] = {x[0] - 0.5, x[1] - 0.5, x[2] - 0.5};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

static tl_polydata *slice(tl_ctx *ctx, const tl_mesh *mesh, const double *values, size_t count,
                          const tl_range_index *ranges)
{
    tl_polydata *p = NULL;
    tl_slice_opts opts = tl_slice_opts_defaults();
    size_t carried = 0;
    opts.values = values;
    opts.value_count = count;
    opts.channels = &carried;
    opts.channel_count = 1;
    opts.ranges = ranges;
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, tl_mesh_channel(mesh, 0)->values, &opts, &p));
    return p;
}

static void check_same(const tl_polydata *a, const tl_polydata *b)
{
    CHECK_EQ(a->vert_count, b->vert_count);
    CHECK_EQ(a->cell_count, b->cell_count);
    CHECK(memcmp(a->xyz, b->xyz, 3 * a->vert_count * sizeof *a->xyz) == 0);
    CHECK(memcmp(a->corners, b->corners, 3 * a->cell_count * sizeof *a->corners) == 0);
    CHECK(memcmp(a->channels[0].values, b->channels[0].values, a->vert_count * sizeof(double)) ==
          0);
}

/* A plane through the cube: its area is known, and the field on it. */
static void plane_has_its_area(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(24);
    make_shuffle(&m, 5);
    tl_mesh *mesh = make_object(ctx, &m, linear);
    /* 2x - 3y + 5z = 2 meets each vertical line through the unit cube once inside of it: the area
     * above the unit square is |gradient| / 5 */
    double origin[3] = {0, 0, 0.4}, normal[3] = {2, -3, 5}, value = 0, expected = sqrt(38) / 5;
    double *scalar = malloc(m.vert_count * sizeof *scalar);
    tl_polydata *p = NULL;
    tl_slice_opts opts = tl_slice_opts_defaults();
    size_t carried = 0;
    opts.values = &value;
    opts.value_count = 1;
    opts.channels = &carried;
    opts.channel_count = 1;
    CHECK_OK(ctx, tl_plane_distance(ctx, mesh, origin, normal, scalar));
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, scalar, &opts, &p));
    CHECK_NEAR(tl_polydata_size(p), expected, 1e-12);
    for (size_t v = 0; v < p->vert_count; v++) CHECK_NEAR(p->channels[0].values[v], 2, 1e-12);
    /* front sides look to lower values: against the gradient */
    for (size_t c = 0; c < p->cell_count; c++) {
        const tl_lidx *t = p->corners + 3 * c;
        double u[3], w[3], n = 0;
        for (int k = 0; k < 3; k++) {
            u[k] = p->xyz[3 * t[1] + k] - p->xyz[3 * t[0] + k];
            w[k] = p->xyz[3 * t[2] + k] - p->xyz[3 * t[0] + k];
        }
        for (int k = 0; k < 3; k++)
            n += normal[k] * (u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3]);
        CHECK(n <= 1e-15); /* twice an area: rounding where it is none */
    }
    tl_polydata_destroy(ctx, p);
    free(scalar);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Spheres inside of a mesh of any order are closed; several at once are those one by one. */
static void spheres_are_closed(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(3);
    make_mesh m = make_grid(40);
    make_perturb(&m, 0.05 / 40, 7);
    make_shuffle(&m, 11);
    tl_mesh *mesh = make_object(ctx, &m, radius);
    static const double radii[3] = {0.45, 0.1, 0.3};
    tl_polydata *all = slice(ctx, mesh, radii, 3, NULL);
    bool closed = false;
    size_t verts = 0, cells = 0;
    double area = 0;
    CHECK_OK(ctx, tl_polydata_closed(ctx, all, &closed));
    CHECK(closed);
    for (int i = 0; i < 3; i++) {
        tl_polydata *one = slice(ctx, mesh, radii + i, 1, NULL);
        double sphere = 4 * 3.14159265358979323846 * radii[i] * radii[i];
        CHECK_OK(ctx, tl_polydata_closed(ctx, one, &closed));
        CHECK(closed);
        /* of a closed surface around one piece: vertices - edges + triangles = 2 */
        CHECK_EQ((long long)one->vert_count - (long long)one->cell_count / 2, 2);
        CHECK_NEAR(tl_polydata_size(one), sphere, 0.02 * sphere);
        for (size_t v = 0; v < one->vert_count; v++) {
            CHECK_NEAR(one->channels[0].values[v], radii[i], 1e-12);
            CHECK_NEAR(radius(one->xyz + 3 * v), radii[i], 0.01);
        }
        verts += one->vert_count;
        cells += one->cell_count;
        area += tl_polydata_size(one);
        tl_polydata_destroy(ctx, one);
    }
    CHECK_EQ(all->vert_count, verts);
    CHECK_EQ(all->cell_count, cells);
    CHECK_NEAR(tl_polydata_size(all), area, 1e-12 * area);
    tl_polydata_destroy(ctx, all);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Same bytes with any number of threads, with and without a range index. */
static void threads_and_ranges_change_nothing(void **state)
{
    (void)state;
    static const double values[2] = {0.31, 0.32};
    make_mesh m = make_grid(36);
    tl_polydata *first = NULL;
    tl_ctx *one = check_ctx_create(1);
    for (unsigned threads = 1; threads <= 4; threads++) {
        tl_ctx *ctx = check_ctx_create(threads);
        tl_mesh *mesh = make_object(ctx, &m, radius);
        tl_range_index *ranges = NULL;
        CHECK_OK(ctx, tl_range_index_create(ctx, mesh, tl_mesh_channel(mesh, 0)->values, &ranges));
        tl_polydata *plain = slice(ctx, mesh, values, 2, NULL);
        tl_polydata *skipped = slice(ctx, mesh, values, 2, ranges);
        check_same(plain, skipped);
        if (!first) first = slice(one, mesh, values, 2, NULL);
        check_same(first, plain);
        tl_polydata_destroy(ctx, skipped);
        tl_polydata_destroy(ctx, plain);
        tl_range_index_destroy(ctx, ranges);
        tl_mesh_destroy(mesh);
        tl_ctx_destroy(ctx);
    }
    tl_polydata_destroy(one, first);
    tl_ctx_destroy(one);
    make_release(&m);
}

static int by_place(const void *a, const void *b)
{
    return memcmp(a, b, 3 * sizeof(double));
}

/* A mesh in two parts, each numbered anew, gives vertices of the whole to the bit. */
static void parts_meet_exactly(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(20);
    make_perturb(&m, 0.05 / 20, 1);
    tl_mesh *whole = make_object(ctx, &m, radius);
    double value = 0.4;
    tl_polydata *all = slice(ctx, whole, &value, 1, NULL);
    double all_area = tl_polydata_size(all);
    size_t cells = 0;
    double area = 0;
    qsort(all->xyz, all->vert_count, 3 * sizeof(double),
          by_place); /* its triangles are done with */
    for (size_t part = 0; part < 2; part++) {
        size_t begin = part ? m.tet_count / 2 + 13 : 0;
        make_mesh some =
            make_room(m.vert_count, (part ? m.tet_count : m.tet_count / 2 + 13) - begin);
        memcpy(some.xyz, m.xyz, 3 * m.vert_count * sizeof *m.xyz);
        memcpy(some.tets, m.tets + 4 * begin, 4 * some.tet_count * sizeof *m.tets);
        make_shuffle(&some, 17 + part);
        tl_mesh *mesh = make_object(ctx, &some, radius);
        tl_polydata *p = slice(ctx, mesh, &value, 1, NULL);
        for (size_t v = 0; v < p->vert_count; v++)
            CHECK(bsearch(p->xyz + 3 * v, all->xyz, all->vert_count, 3 * sizeof(double), by_place));
        area += tl_polydata_size(p);
        cells += p->cell_count;
        tl_polydata_destroy(ctx, p);
        tl_mesh_destroy(mesh);
        make_release(&some);
    }
    CHECK_EQ(cells, all->cell_count);
    CHECK_NEAR(area, all_area, 1e-12);
    tl_polydata_destroy(ctx, all);
    tl_mesh_destroy(whole);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Values that vertices have to the bit, NaN values and places, meshes that are no manifold. */
static void ties_and_numbers_that_are_none(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(12);
    tl_mesh *mesh = make_object(ctx, &m, radius);
    double *scalar = malloc(m.vert_count * sizeof *scalar), value = 1;
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = &value;
    opts.value_count = 1;
    tl_polydata *p = NULL;
    bool closed = false;
    for (size_t v = 0; v < m.vert_count; v++)
        scalar[v] = radius(m.xyz + 3 * v) < 0.3 ? 1 : 0; /* cut at the upper ends of edges */
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, scalar, &opts, &p));
    CHECK_OK(ctx, tl_polydata_closed(ctx, p, &closed));
    CHECK(closed && p->cell_count > 0);
    tl_polydata_destroy(ctx, p);
    scalar[m.vert_count / 2] = (double)NAN;
    m.xyz[3 * (m.vert_count / 3)] = (double)NAN;
    tl_mesh *damaged = make_object(ctx, &m, radius);
    scalar[1] = (double)INFINITY;
    CHECK_OK(ctx, tl_slice_mesh(ctx, damaged, scalar, &opts, &p));
    for (size_t i = 0; i < 3 * p->vert_count; i++) CHECK(isfinite(p->xyz[i]));
    tl_polydata_destroy(ctx, p);
    tl_mesh_destroy(damaged);
    tl_mesh_destroy(mesh);
    make_release(&m);
    make_mesh soup = make_soup(60, 400, 9);
    mesh = make_object(ctx, &soup, linear);
    value = 1.5;
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, tl_mesh_channel(mesh, 0)->values, &opts, &p));
    CHECK(p->cell_count > 0);
    tl_polydata_destroy(ctx, p);
    opts.value_count = 0;
    CHECK_STATUS(tl_slice_mesh(ctx, mesh, scalar, &opts, &p), TL_ERR_ARG);
    opts.value_count = 1;
    value = (double)NAN;
    CHECK_STATUS(tl_slice_mesh(ctx, mesh, scalar, &opts, &p), TL_ERR_ARG);
    tl_mesh_destroy(mesh);
    make_release(&soup);
    free(scalar);
    tl_ctx_destroy(ctx);
}

/* The gradient of a linear field is exact, and so are the normals that are made of it. */
static void gradients_of_linear_fields(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(10);
    make_perturb(&m, 0.05 / 10, 2);
    make_shuffle(&m, 4);
    tl_mesh *mesh = make_object(ctx, &m, linear);
    double *gradients = malloc(3 * m.vert_count * sizeof *gradients), value = 2.1;
    CHECK_OK(ctx, tl_mesh_gradient(ctx, mesh, tl_mesh_channel(mesh, 0), gradients));
    for (size_t v = 0; v < m.vert_count; v++) {
        CHECK_NEAR(gradients[3 * v], 2, 1e-11);
        CHECK_NEAR(gradients[3 * v + 1], -3, 1e-11);
        CHECK_NEAR(gradients[3 * v + 2], 5, 1e-11);
    }
    tl_polydata *p = NULL;
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = &value;
    opts.value_count = 1;
    opts.gradients = gradients;
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, tl_mesh_channel(mesh, 0)->values, &opts, &p));
    for (size_t v = 0; v < p->vert_count; v++) {
        CHECK_NEAR((double)p->normals[3 * v], -2 / sqrt(38), 1e-6);
        CHECK_NEAR((double)p->normals[3 * v + 1], 3 / sqrt(38), 1e-6);
        CHECK_NEAR((double)p->normals[3 * v + 2], -5 / sqrt(38), 1e-6);
    }
    tl_polydata_destroy(ctx, p);
    free(gradients);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static tl_status slice_all(tl_ctx *ctx, void *arg)
{
    tl_mesh *mesh = arg;
    double value = 0.3;
    tl_polydata *p = NULL;
    tl_range_index *ranges = NULL;
    tl_slice_opts opts = tl_slice_opts_defaults();
    size_t carried = 0;
    opts.values = &value;
    opts.value_count = 1;
    opts.channels = &carried;
    opts.channel_count = 1;
    const double *scalar = tl_mesh_channel(mesh, 0)->values;
    tl_status st = tl_range_index_create(ctx, mesh, scalar, &ranges);
    opts.ranges = ranges;
    if (!st) st = tl_slice_mesh(ctx, mesh, scalar, &opts, &p);
    tl_polydata_destroy(ctx, p);
    tl_range_index_destroy(ctx, ranges);
    return st;
}

static void failing_memory_leaks_nothing(void **state)
{
    (void)state;
    fail_alloc f;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(8);
    tl_mesh *mesh = make_object(ctx, &m, radius);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, slice_all, mesh) > 15);
    fail_alloc_close(&f);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plane_has_its_area),
        cmocka_unit_test(spheres_are_closed),
        cmocka_unit_test(threads_and_ranges_change_nothing),
        cmocka_unit_test(parts_meet_exactly),
        cmocka_unit_test(ties_and_numbers_that_are_none),
        cmocka_unit_test(gradients_of_linear_fields),
        cmocka_unit_test(failing_memory_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
