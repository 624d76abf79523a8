/* Statistics against closed forms: linear fields in a cube and in single tets, values on tets,
 * lengths of vectors, values that are not finite. */
#include "check.h"

#include "check_ctx.h"
#include "make_mesh.h"
#include "tetralod/measure.h"

enum { SIDE = 9 };

static double first_coordinate(const double x[3])
{
    return x[0];
}

static tl_mesh *cube(tl_ctx *ctx, make_mesh *m)
{
    tl_mesh *mesh = NULL;
    *m = make_grid(SIDE);
    CHECK_OK(ctx, tl_mesh_create(ctx, m->xyz, m->vert_count, m->tets, m->tet_count, &mesh));
    return mesh;
}

static void add_field(tl_ctx *ctx, tl_mesh *mesh, make_field field)
{
    const size_t count = tl_mesh_vert_count(mesh);
    double *values = malloc(count * sizeof *values);
    for (size_t v = 0; v < count; v++) values[v] = field(tl_mesh_xyz(mesh) + 3 * v);
    const tl_channel channel = {
        .name = "f", .components = 1, .on = TL_ON_VERTEX, .scalar = TL_F64, .values = values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    free(values);
}

/* x in the unit cube: uniform from 0 to 1. */
static void linear_in_a_cube(void **state)
{
    (void)state;
    static const double parts[TL_STATISTICS_PARTS] = {0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99};
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m;
    tl_mesh *mesh = cube(ctx, &m);
    tl_statistics s;
    add_field(ctx, mesh, first_coordinate);
    CHECK_OK(ctx, tl_channel_statistics(ctx, mesh, tl_mesh_channel(mesh, 0), 0, &s));
    CHECK_NEAR(s.volume, 1, 1e-13);
    CHECK_NEAR(s.integral, 0.5, 1e-13);
    CHECK_NEAR(s.mean, 0.5, 1e-13);
    CHECK_NEAR(s.deviation, sqrt(1.0 / 12), 1e-13);
    CHECK(s.least == 0 && s.most == 1);
    double worst = 0;
    for (int i = 0; i < TL_STATISTICS_PARTS; i++) worst = fmax(worst, fabs(s.parts[i] - parts[i]));
    CHECK_BOUND("percentiles", worst, 1e-6);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* One tet: the part below t of a barycentric coordinate is 1 - (1 - t)^3, and of other corner
 * values what rays through the tet count. */
static void single_tets(void **state)
{
    (void)state;
    static const double xyz[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const tl_lidx tet[4] = {0, 1, 2, 3};
    static const double corners[][4] = {{1, 0, 0, 0}, {0, 1, 1, 1},  {0, 0, 1, 1}, {0, 1, 2, 5},
                                        {3, 3, 3, 4}, {-1, 0, 0, 1}, {2, 2, 2, 2}};
    static const double parts[TL_STATISTICS_PARTS] = {0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99};
    enum { STEPS = 160 };
    tl_ctx *ctx = check_ctx_create(1);
    for (size_t c = 0; c < sizeof corners / sizeof *corners; c++) {
        tl_mesh *mesh = NULL;
        tl_statistics s;
        const double *v = corners[c];
        const tl_channel channel = {
            .name = "f", .components = 1, .on = TL_ON_VERTEX, .scalar = TL_F64, .values = v};
        CHECK_OK(ctx, tl_mesh_create(ctx, xyz, 4, tet, 1, &mesh));
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        CHECK_OK(ctx, tl_channel_statistics(ctx, mesh, tl_mesh_channel(mesh, 0), 0, &s));
        CHECK_NEAR(s.integral, (v[0] + v[1] + v[2] + v[3]) / 24, 1e-15);
        /* midpoints of a fine grid in the tet */
        double below[TL_STATISTICS_PARTS] = {0}, squares = 0;
        size_t count = 0;
        for (int x = 0; x < STEPS; x++)
            for (int y = 0; x + y < STEPS; y++)
                for (int z = 0; x + y + z < STEPS - 1; z++) {
                    const double p = (x + 0.5) / STEPS, q = (y + 0.5) / STEPS;
                    const double r = (z + 0.5) / STEPS;
                    const double f = v[0] * (1 - p - q - r) + v[1] * p + v[2] * q + v[3] * r;
                    for (int i = 0; i < TL_STATISTICS_PARTS; i++) below[i] += f < s.parts[i];
                    squares += (f - s.mean) * (f - s.mean);
                    count++;
                }
        CHECK_NEAR(s.deviation, sqrt(squares / (double)count), 0.01 * (s.most - s.least) + 1e-15);
        for (int i = 0; i < TL_STATISTICS_PARTS && s.least < s.most; i++)
            CHECK_NEAR(below[i] / (double)count, parts[i], 0.015);
        if (c == 0) CHECK_NEAR(s.parts[3], 1 - cbrt(0.5), 1e-6);
        tl_mesh_destroy(mesh);
    }
    check_ctx_destroy(ctx);
}

static void tets_vectors_and_gaps(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m;
    tl_mesh *mesh = cube(ctx, &m);
    tl_statistics s;
    double *values = calloc(3 * (m.tet_count + m.vert_count), sizeof *values), volume = 0;
    for (size_t t = 0; t < m.tet_count; t++) values[t] = t % 2 ? 3 : 1;
    values[0] = (double)NAN;
    const tl_channel on_tets = {
        .name = "c", .components = 1, .on = TL_ON_TET, .scalar = TL_F64, .values = values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &on_tets));
    for (size_t t = 1; t < m.tet_count; t++) {
        double p[4][3];
        for (size_t i = 0; i < 4; i++)
            memcpy(p[i], m.xyz + 3 * (size_t)m.tets[4 * t + i], sizeof p[i]);
        volume += tl_tet_volume((const double(*)[3])p);
    }
    CHECK_OK(ctx, tl_channel_statistics(ctx, mesh, tl_mesh_channel(mesh, 0), 0, &s));
    CHECK_NEAR(s.volume, volume, 1e-13);
    CHECK(s.least == 1 && s.most == 3 && s.parts[0] >= 1 && s.parts[0] < 1 + 1e-5);
    CHECK_NEAR(s.parts[6], 3, 1e-5);
    for (size_t v = 0; v < m.vert_count; v++) {
        values[3 * v] = 3;
        values[3 * v + 1] = -4;
        values[3 * v + 2] = 0;
    }
    const tl_channel vectors = {
        .name = "u", .components = 3, .on = TL_ON_VERTEX, .scalar = TL_F64, .values = values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &vectors));
    const tl_channel *u = tl_mesh_channel(mesh, 1);
    CHECK_OK(ctx, tl_channel_statistics(ctx, mesh, u, 1, &s));
    CHECK_NEAR(s.mean, -4, 1e-13);
    CHECK_OK(ctx, tl_channel_statistics(ctx, mesh, u, 3, &s));
    CHECK_NEAR(s.integral, 5, 1e-12);
    CHECK_NEAR(s.deviation, 0, 1e-12);
    CHECK(s.parts[0] == 5 && s.parts[6] == 5);
    CHECK_STATUS(tl_channel_statistics(ctx, mesh, u, 4, &s), TL_ERR_ARG);
    double at[3], weights[4] = {0.25, 0.25, 0.25, 0.25};
    tl_channel_at(mesh, u, 7, weights, at);
    CHECK(at[0] == 3 && at[1] == -4 && at[2] == 0);
    free(values);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_in_a_cube),
        cmocka_unit_test(single_tets),
        cmocka_unit_test(tets_vectors_and_gaps),
    };
    return cmocka_run_group_tests_name("measure_statistics", tests, NULL, NULL);
}
