/* The mesh object: what it takes, owns and refuses; channels, number types, ranges. */
#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

static void test_create(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(0);
    make_mesh m = make_grid(3);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    CHECK(tl_mesh_ctx(mesh) == ctx);
    CHECK_EQ(tl_mesh_vert_count(mesh), 27);
    CHECK_EQ(tl_mesh_tet_count(mesh), 40);
    CHECK_EQ(memcmp(tl_mesh_xyz(mesh), m.xyz, 27 * 24), 0);
    CHECK_EQ(memcmp(tl_mesh_tets(mesh), m.tets, 40 * 16), 0);
    CHECK(tl_mesh_xyz(mesh) != m.xyz && !tl_mesh_regions(mesh) && isnan(tl_mesh_time(mesh)));
    make_two_regions(&m);
    CHECK_OK(ctx, tl_mesh_set_regions(mesh, m.regions));
    CHECK_EQ(memcmp(tl_mesh_regions(mesh), m.regions, 40 * 4), 0);
    CHECK_OK(ctx, tl_mesh_set_regions(mesh, NULL));
    CHECK(!tl_mesh_regions(mesh));
    tl_mesh_set_time(mesh, 2.5);
    CHECK(tl_mesh_time(mesh) == 2.5);
    tl_mesh_destroy(mesh);
    tl_mesh_destroy(NULL);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void test_refused(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(0);
    make_mesh m = make_grid(12);
    tl_mesh *mesh = NULL;
    m.tets[4 * 5000 + 3] = 1728;
    m.tets[4 * 5001 + 1] = TL_NONE;
    CHECK_STATUS(tl_mesh_create(ctx, m.xyz, m.vert_count, m.tets, m.tet_count, &mesh), TL_ERR_DATA);
    CHECK(!mesh && strstr(tl_ctx_message(ctx), "tet 5000: corner 3 is vertex 1728"));
    CHECK_STATUS(tl_mesh_create(ctx, m.xyz, 0, m.tets, 1, &mesh), TL_ERR_DATA);
    CHECK_STATUS(tl_mesh_create(ctx, m.xyz, 1, m.tets, (size_t)TL_MESH_TETS_MAX + 1, &mesh),
                 TL_ERR_ARG);
    CHECK_STATUS(tl_mesh_create(ctx, m.xyz, (size_t)TL_MESH_VERTS_MAX + 1, m.tets, 1, &mesh),
                 TL_ERR_ARG);
    CHECK_STATUS(tl_mesh_create(ctx, NULL, 4, m.tets, 1, &mesh), TL_ERR_ARG);
    CHECK_STATUS(tl_mesh_create(ctx, m.xyz, 4, NULL, 1, &mesh), TL_ERR_ARG);
    CHECK_OK(ctx, tl_mesh_create(ctx, NULL, 0, NULL, 0, &mesh));
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Adopting takes the blocks over on success only. */
static void test_adopt(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(0);
    tl_status st = TL_OK;
    double *xyz = tl_mem_zalloc(ctx, 4, 24, &st), *values = tl_mem_zalloc(ctx, 4, 8, &st);
    tl_lidx *tets = tl_mem_zalloc(ctx, 1, 16, &st);
    tl_mesh *mesh = NULL;
    CHECK_STATUS(st, TL_OK);
    tets[2] = 4;
    CHECK_STATUS(tl_mesh_adopt(ctx, xyz, 4, tets, 1, &mesh), TL_ERR_DATA);
    tets[2] = 3;
    CHECK_OK(ctx, tl_mesh_adopt(ctx, xyz, 4, tets, 1, &mesh));
    CHECK(tl_mesh_xyz(mesh) == xyz && tl_mesh_tets(mesh) == tets);
    tl_channel channel = {"a", NULL, 0, TL_ON_VERTEX, TL_F64, values};
    CHECK_STATUS(tl_mesh_adopt_channel(mesh, &channel), TL_ERR_ARG);
    channel.components = 1;
    CHECK_OK(ctx, tl_mesh_adopt_channel(mesh, &channel));
    CHECK(tl_mesh_channel(mesh, 0)->values == values);
    CHECK_EQ(strcmp(tl_mesh_channel(mesh, 0)->unit, ""), 0);
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
}

static void test_channel_names(void **state)
{
    (void)state;
    static const char *const given[] = {"p", "p", "p_7",           "p", "p_x", "p_", "q_2",
                                        "q", "q", "p_99999999999", ""};
    static const char *const want[] = {"p",   "p_2", "p_7", "p_8",           "p_x", "p_",
                                       "q_2", "q",   "q_3", "p_99999999999", ""};
    tl_ctx *ctx = check_ctx_create(0);
    make_mesh m = make_grid(2);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    double values[24] = {0};
    for (size_t i = 0; i < sizeof given / sizeof *given; i++) {
        tl_channel channel = {given[i], "m/s", 3, TL_ON_VERTEX, TL_F32, values};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        if (strcmp(tl_mesh_channel(mesh, i)->name, want[i]) != 0)
            fail_msg("name %zu is %s, expected %s", i, tl_mesh_channel(mesh, i)->name, want[i]);
    }
    tl_channel on_tet = {"p", "K", 1, TL_ON_TET, TL_I8, values},
               only = {"r", "", 1, TL_ON_TET, TL_I8, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &on_tet)); /* another kind of element: no clash */
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &only));
    CHECK_EQ(tl_mesh_channel_count(mesh), 13);
    CHECK(tl_mesh_channel_by_name(mesh, "p") == tl_mesh_channel(mesh, 0));
    CHECK(tl_mesh_channel_by_name(mesh, "r") == tl_mesh_channel(mesh, 12));
    CHECK(!tl_mesh_channel_by_name(mesh, "s"));
    tl_channel bad[] = {{NULL, "", 1, TL_ON_TET, TL_I8, values},
                        {"a", "", 1, (tl_on)2, TL_I8, values},
                        {"a", "", 1, TL_ON_TET, (tl_scalar)10, values},
                        {"a", "", 1, TL_ON_TET, TL_I8, NULL}};
    for (int i = 0; i < 4; i++) CHECK_STATUS(tl_mesh_add_channel(mesh, &bad[i]), TL_ERR_ARG);
    CHECK_EQ(tl_mesh_channel_count(mesh), 13);
    CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FULL));
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void test_scalars(void **state)
{
    (void)state;
    static const size_t bytes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    static const double low[] = {-128, 0, -32768, 0, -2147483648.0, 0, -0x1p63, 0};
    static const double high[] = {127,          255,          32767,         65535,
                                  2147483647.0, 4294967295.0, 0x1p63 - 1024, 0x1p64 - 2048};
    for (int s = TL_I8; s <= TL_F64; s++) CHECK_EQ(tl_scalar_bytes((tl_scalar)s), bytes[s]);
    for (int s = TL_I8; s <= TL_U64; s++) {
        tl_scalar type = (tl_scalar)s;
        CHECK(tl_scalar_holds(type, low[s]) && tl_scalar_holds(type, high[s]) &&
              tl_scalar_holds(type, 0.0));
        CHECK(!tl_scalar_holds(type, nextafter(low[s] * 1.0, -INFINITY)) &&
              !tl_scalar_holds(type, 0.5));
        CHECK(!tl_scalar_holds(type, s < TL_I64 ? high[s] + 1 : nextafter(high[s], INFINITY)));
        CHECK(!tl_scalar_holds(type, NAN) && !tl_scalar_holds(type, INFINITY) &&
              !tl_scalar_holds(type, -0.0));
    }
    CHECK(tl_scalar_holds(TL_F32, 0.5) && tl_scalar_holds(TL_F32, NAN) &&
          tl_scalar_holds(TL_F32, -INFINITY));
    CHECK(!tl_scalar_holds(TL_F32, 0.1) && !tl_scalar_holds(TL_F32, 1e300) &&
          tl_scalar_holds(TL_F32, -0.0));
    CHECK(tl_scalar_holds(TL_F64, 0.1) && tl_scalar_holds(TL_F64, 1e300));
}

static void test_range(void **state)
{
    (void)state;
    double values[] = {3, 4, NAN, 1, 0, -2, 1e200, 1e200, 0, INFINITY};
    double range[2] = {9, 9};
    size_t nonfinite = 9;
    tl_channel scalar = {"s", "", 1, TL_ON_VERTEX, TL_F64, values};
    tl_channel vector = {"v", "", 2, TL_ON_VERTEX, TL_F64, values};
    tl_channel_range(&scalar, 6, range, &nonfinite);
    CHECK(range[0] == -2 && range[1] == 4);
    CHECK_EQ(nonfinite, 1);
    tl_channel_range(&vector, 5, range, &nonfinite);
    CHECK(range[0] == 2);
    CHECK_NEAR(range[1] / 1e200, sqrt(2.0), 1e-15); /* squares would overflow */
    CHECK_EQ(nonfinite, 2);
    values[0] = 3e-200;
    values[1] = 4e-200;
    tl_channel_range(&vector, 1, range, NULL);
    CHECK_NEAR(range[0] / 5e-200, 1, 1e-15);
    tl_channel_range(&scalar, 0, range, &nonfinite);
    CHECK(range[0] == 0 && range[1] == 0 && nonfinite == 0);
    scalar.values = values + 9;
    tl_channel_range(&scalar, 1, range, &nonfinite);
    CHECK(range[0] == 0 && range[1] == 0 && nonfinite == 1);
}

static tl_status call_all(tl_ctx *ctx, void *arg)
{
    const make_mesh *m = arg;
    tl_mesh *mesh = NULL;
    double values[27] = {0};
    tl_channel channel = {"a", "m", 1, TL_ON_VERTEX, TL_F64, values};
    tl_status st = tl_mesh_create(ctx, m->xyz, m->vert_count, m->tets, m->tet_count, &mesh);
    CHECK_EQ(mesh == NULL, st != TL_OK);
    if (!st) st = tl_mesh_set_regions(mesh, m->regions);
    for (size_t i = 0; i < 3 && !st; i++) {
        st = tl_mesh_add_channel(mesh, &channel);
        CHECK_EQ(tl_mesh_channel_count(mesh), i + !st);
    }
    tl_mesh_destroy(mesh);
    return st;
}

static void test_failing_allocations(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    make_mesh m = make_grid(3);
    make_two_regions(&m);
    CHECK_EQ(fail_alloc_each(&f, call_all, &m), 3 + 1 + 3 * 4 + 1);
    make_release(&m);
    fail_alloc_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_adopt),
        cmocka_unit_test(test_channel_names),
        cmocka_unit_test(test_scalars),
        cmocka_unit_test(test_range),
        cmocka_unit_test(test_failing_allocations),
    };
    return cmocka_run_group_tests_name("mesh_object", tests, NULL, NULL);
}
