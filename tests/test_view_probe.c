/* What lies at a place of a mesh, against formulas: linear fields are met exactly, tets have the
 * size that the grid gives them, regions and names are those of the tet. */
#include "tetralod/view.h"

#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

enum { SIDE = 9, PLACES = 400 };

typedef struct place {
    tl_mesh *mesh;
    tl_locator *locator;
} place;

static double height(const double x[3])
{
    return 4 - x[0] + 2 * x[2];
}

/* A grid of two regions: "f", a scalar; "move", a vector; "cell", the number of the tet; "gap", a
 * scalar that is NaN at one vertex. */
static place open_place(tl_ctx *ctx)
{
    make_mesh m = make_grid(SIDE);
    place p = {0};
    make_two_regions(&m);
    double *move = calloc(3 * m.vert_count, sizeof *move),
           *cell = calloc(m.tet_count, sizeof *cell);
    if (!move || !cell) abort();
    p.mesh = make_object(ctx, &m, height);
    for (size_t v = 0; v < m.vert_count; v++)
        for (size_t k = 0; k < 3; k++) move[3 * v + k] = (double)(k + 1) * m.xyz[3 * v + k];
    for (size_t t = 0; t < m.tet_count; t++) cell[t] = (double)t;
    const tl_channel vector = {"move", "m/s", 3, TL_ON_VERTEX, TL_F64, move};
    const tl_channel number = {"cell", "", 1, TL_ON_TET, TL_F64, cell};
    CHECK_OK(ctx, tl_mesh_add_channel(p.mesh, &vector));
    CHECK_OK(ctx, tl_mesh_add_channel(p.mesh, &number));
    move[0] = NAN;
    const tl_channel gap = {"gap", "K", 1, TL_ON_VERTEX, TL_F64, move};
    CHECK_OK(ctx, tl_mesh_add_channel(p.mesh, &gap));
    CHECK_OK(ctx, tl_mesh_set_region_name(p.mesh, 2, "steel"));
    CHECK_OK(ctx, tl_locator_create(ctx, p.mesh, NULL, &p.locator));
    free(move);
    free(cell);
    make_release(&m);
    return p;
}

static void close_place(place *p)
{
    tl_locator_destroy(p->locator);
    tl_mesh_destroy(p->mesh);
}

static void check_inside(const tl_probe *probe, const double x[3])
{
    CHECK(probe->is_inside);
    CHECK_EQ(probe->value_count, 4);
    for (int k = 0; k < 3; k++) CHECK(probe->xyz[k] == x[k]);
    CHECK_NEAR(probe->values[0].values[0], height(x), 1e-13);
    CHECK_EQ(probe->values[1].components, 3);
    for (int k = 0; k < 3; k++) CHECK_NEAR(probe->values[1].values[k], (k + 1) * x[k], 1e-13);
    CHECK(strcmp(probe->values[1].name, "move") == 0 && strcmp(probe->values[1].unit, "m/s") == 0);
    CHECK(probe->values[2].values[0] == (double)probe->tet);
    CHECK_NEAR(probe->tet_size, sqrt(2) / (SIDE - 1), 1e-14); /* the diagonal of a cell's side */
    CHECK_EQ(probe->patch, TL_NONE);
    CHECK_EQ(probe->level, TL_NONE);
    if (x[0] < 0.5 - 1e-9) CHECK_EQ(probe->region, 1);
    if (x[0] > 0.5 + 1e-9) CHECK_EQ(probe->region, 2);
    CHECK_EQ(probe->region_name != NULL, probe->region == 2);
    if (probe->region_name) CHECK(strcmp(probe->region_name, "steel") == 0);
}

static void test_linear_fields(void **state)
{
    (void)state;
    uint64_t seed = 4;
    tl_ctx *ctx = check_ctx_create(1);
    place p = open_place(ctx);
    tl_probe again = {0};
    for (int i = 0; i < PLACES; i++) {
        tl_probe one = {0};
        double x[3];
        for (int k = 0; k < 3; k++) x[k] = make_uniform(&seed);
        CHECK_OK(ctx, tl_mesh_probe(ctx, p.mesh, p.locator, x, &one));
        check_inside(&one, x);
        tl_probe_release(ctx, &one);
        CHECK(!one.values);
        CHECK_OK(ctx, tl_mesh_probe(ctx, p.mesh, p.locator, x, &again)); /* near the last one */
        check_inside(&again, x);
    }
    tl_probe_release(ctx, &again);
    close_place(&p);
    check_ctx_destroy(ctx);
}

/* Outside, at a place that is none, and back inside with the same probe; at a vertex without a
 * value there is none. */
static void test_outside(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    place p = open_place(ctx);
    tl_probe probe = {0};
    const double inside[3] = {0.3, 0.4, 0.5}, corner[3] = {0, 0, 0};
    const double others[3][3] = {{1.0001, 0.5, 0.5}, {NAN, 0.5, 0.5}, {0.5, -INFINITY, 0.5}};
    for (int i = 0; i < 3; i++) {
        CHECK_OK(ctx, tl_mesh_probe(ctx, p.mesh, p.locator, others[i], &probe));
        CHECK(!probe.is_inside);
        CHECK_EQ(probe.value_count, 4);
        CHECK_OK(ctx, tl_mesh_probe(ctx, p.mesh, p.locator, inside, &probe));
        check_inside(&probe, inside);
    }
    CHECK_OK(ctx, tl_mesh_probe(ctx, p.mesh, p.locator, corner, &probe));
    CHECK(probe.is_inside);
    CHECK(isnan(probe.values[3].values[0]));
    CHECK(probe.values[0].values[0] == 4);
    tl_probe_release(ctx, &probe);
    tl_probe_release(ctx, NULL);
    close_place(&p);
    check_ctx_destroy(ctx);
}

static tl_status try_probe(tl_ctx *ctx, void *arg)
{
    const place *p = arg;
    tl_probe probe = {0};
    const double x[3] = {0.3, 0.4, 0.5};
    tl_status st = tl_mesh_probe(ctx, p->mesh, p->locator, x, &probe);
    tl_probe_release(ctx, &probe);
    return st;
}

static void test_allocation_failures(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    place p = open_place(f.ctx);
    CHECK(fail_alloc_each(&f, try_probe, &p) > 1);
    close_place(&p);
    fail_alloc_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_linear_fields),
        cmocka_unit_test(test_outside),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
