/* Samples: formulas against their physics and against numbers made elsewhere, files against
 * formulas, meshes at every size. */
#include "check.h"
#include "check_ctx.h"

#include <unistd.h>

#include "base/base_file.h"
#include "base/base_predicates.h"
#include "formats/formats_sample.h"

/* ---- formulas ---- */

static void test_catalogue(void **state)
{
    (void)state;
    size_t count = 0;
    for (const char *name; (name = tl_sample_name(count)) != NULL; count++) {
        CHECK(tl_sample_about(name) != NULL);
        CHECK(tl_sample_components(name) > 0);
    }
    CHECK_EQ(count, 3);
    CHECK_EQ(tl_sample_components("sphere-flow"), 4);
    CHECK_EQ(tl_sample_components("none"), 0);
    CHECK(tl_sample_about("none") == NULL);
}

/* The same formulas in numpy. */
static void test_values_made_elsewhere(void **state)
{
    (void)state;
    static const double at[3][3] = {{0, 0, 0}, {0.5, -0.25, 0.75}, {-1, 1, -1}};
    static const double lobb[3] = {0.59999999999999998, 0.17954470086242674, 0.83349222933682154};
    static const double bells[3] = {0.44647195200202272, 0.35291709596551735, 0.049618778294049287};
    tl_ctx *ctx = check_ctx_create(1);
    for (int i = 0; i < 3; i++) {
        double value;
        CHECK_OK(ctx, tl_sample_value(ctx, "marschner-lobb", at[i], &value));
        CHECK_NEAR(value, lobb[i], 1e-13);
        CHECK_OK(ctx, tl_sample_value(ctx, "gaussians", at[i], &value));
        CHECK_NEAR(value, bells[i], 1e-14);
    }
    tl_ctx_destroy(ctx);
}

static void flow_at(tl_ctx *ctx, const double x[3], double values[4])
{
    CHECK_OK(ctx, tl_sample_value(ctx, "sphere-flow", x, values));
}

/* Rate of change of component c along an axis, by central differences. */
static double slope(tl_ctx *ctx, const double x[3], int component, int axis)
{
    const double step = 1e-4;
    double low[4], high[4], p[3] = {x[0], x[1], x[2]};
    p[axis] = x[axis] - step;
    flow_at(ctx, p, low);
    p[axis] = x[axis] + step;
    flow_at(ctx, p, high);
    return (high[component] - low[component]) / (2 * step);
}

static void test_flow_is_potential_flow(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    double worst_divergence = 0, worst_rotation = 0, worst_wall = 0;
    for (int i = 0; i < 200; i++) {
        double polar = 0.015 * i, turn = 2.4 * i, r = 1 + 0.02 * (i % 50), values[4];
        double unit[3] = {cos(polar), sin(polar) * cos(turn), sin(polar) * sin(turn)};
        double x[3] = {r * unit[0], r * unit[1], r * unit[2]};
        double divergence = slope(ctx, x, 1, 0) + slope(ctx, x, 2, 1) + slope(ctx, x, 3, 2);
        worst_divergence = fmax(worst_divergence, fabs(divergence));
        for (int a = 0; a < 3; a++) {
            int b = (a + 1) % 3;
            double rotation = slope(ctx, x, 1 + b, a) - slope(ctx, x, 1 + a, b);
            worst_rotation = fmax(worst_rotation, fabs(rotation));
        }
        flow_at(ctx, unit, values);
        double through = values[1] * unit[0] + values[2] * unit[1] + values[3] * unit[2];
        worst_wall = fmax(worst_wall, fabs(through));
        CHECK_NEAR(values[0], 1 - 2.25 * sin(polar) * sin(polar), 1e-13);
    }
    CHECK_BOUND("divergence", worst_divergence, 1e-6);
    CHECK_BOUND("rotation", worst_rotation, 1e-6);
    CHECK_BOUND("flow through the sphere", worst_wall, 1e-14);
    double far[3] = {0, 1e6, 0}, values[4];
    flow_at(ctx, far, values);
    CHECK_NEAR(values[0], 0, 1e-12);
    CHECK_NEAR(values[1], 1, 1e-12);
    tl_ctx_destroy(ctx);
}

/* ---- files ---- */

typedef struct surfaces {
    size_t triangles;
    double outer, inner; /* volumes inside of the triangles of the box, and of the others */
} surfaces;

static surfaces measure_boundary(tl_ctx *ctx, const tl_mesh *mesh)
{
    tl_lidx *opposite = NULL, *triangles = NULL;
    size_t nonmanifold, components, count;
    surfaces s = {0};
    CHECK_OK(ctx, tl_mesh_adjacency(ctx, mesh, &opposite, &nonmanifold));
    CHECK_OK(ctx, tl_mesh_components(ctx, mesh, opposite, NULL, &components));
    CHECK_OK(ctx, tl_mesh_boundary(ctx, mesh, opposite, &triangles, NULL, &count));
    CHECK_EQ(nonmanifold, 0);
    CHECK_EQ(components, 1);
    s.triangles = count;
    for (size_t t = 0; t < count; t++) {
        const double *p[3];
        for (int v = 0; v < 3; v++)
            p[v] = tl_mesh_xyz(mesh) + 3 * (size_t)triangles[3 * t + (size_t)v];
        static const double origin[3] = {0, 0, 0};
        double volume = tli_orient3d_approx(origin, p[0], p[1], p[2]) / 6;
        bool near = fabs(p[0][0]) < 1.1 && fabs(p[0][1]) < 1.1 && fabs(p[0][2]) < 1.1 &&
                    volume < 0; /* seen from the origin, the cavity's triangles face inwards */
        if (near)
            s.inner -= volume;
        else
            s.outer += volume;
    }
    tl_mem_free(ctx, triangles);
    tl_mem_free(ctx, opposite);
    return s;
}

/* All tets are exactly positive; returns their volume and the ratio of the smallest to the largest.
 */
static double measure_tets(const tl_mesh *mesh, double *ratio)
{
    double sum = 0, smallest = (double)INFINITY, largest = 0;
    const tl_lidx *tets = tl_mesh_tets(mesh);
    const double *xyz = tl_mesh_xyz(mesh);
    for (size_t t = 0; t < 4 * tl_mesh_tet_count(mesh); t += 4) {
        const double *p[4];
        for (size_t v = 0; v < 4; v++) p[v] = xyz + 3 * (size_t)tets[t + v];
        CHECK_EQ(tli_orient3d(p[0], p[1], p[2], p[3]), 1);
        double volume = tli_orient3d_approx(p[0], p[1], p[2], p[3]) / 6;
        sum += volume;
        smallest = fmin(smallest, volume);
        largest = fmax(largest, volume);
    }
    *ratio = smallest / largest;
    return sum;
}

static void check_values(tl_ctx *ctx, const char *name, const tl_mesh *mesh)
{
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
        double expected[4];
        size_t at = 0;
        CHECK_OK(ctx, tl_sample_value(ctx, name, tl_mesh_xyz(mesh) + 3 * v, expected));
        for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
            const tl_channel *channel = tl_mesh_channel(mesh, c);
            CHECK_EQ(channel->scalar, TL_F32);
            for (uint32_t i = 0; i < channel->components; i++)
                CHECK_NEAR(channel->values[v * channel->components + i],
                           (double)(float)expected[at++], 0);
        }
        CHECK_EQ(at, tl_sample_components(name));
    }
}

static tl_mesh *write_and_read(tl_ctx *ctx, const char *name, uint32_t size)
{
    tl_mesh *mesh = NULL;
    tl_read_report report;
    CHECK_OK(ctx, tl_sample_write(ctx, name, size, "sample.vtu"));
    CHECK_OK(ctx, tl_mesh_read(ctx, "sample.vtu", NULL, &mesh, &report));
    CHECK_EQ(report.turned + report.inverted + report.degenerate + report.unused_points, 0);
    remove("sample.vtu");
    return mesh;
}

static void test_grids(void **state)
{
    (void)state;
    static const char *const names[] = {"marschner-lobb", "gaussians"};
    tl_ctx *ctx = check_ctx_create(2);
    for (int i = 0; i < 2; i++)
        for (uint32_t size = 2; size < 40; size += 12) {
            double ratio;
            size_t cells = (size_t)(size - 1) * (size - 1) * (size - 1);
            tl_mesh *mesh = write_and_read(ctx, names[i], size);
            CHECK_EQ(tl_mesh_vert_count(mesh), (size_t)size * size * size);
            CHECK_EQ(tl_mesh_tet_count(mesh), 5 * cells);
            CHECK_NEAR(measure_tets(mesh, &ratio), 8, 1e-6);
            surfaces s = measure_boundary(ctx, mesh);
            CHECK_EQ(s.triangles, 12 * (size - 1) * (size - 1));
            CHECK(tl_mesh_channel_by_name(mesh, "value") != NULL);
            check_values(ctx, names[i], mesh);
            tl_mesh_destroy(mesh);
        }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_shells(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    for (uint32_t size = 2; size <= 40; size += size < 12 ? 1 : 14) {
        double ratio, box = pow(2 * TLI_SHELLS_HALF_SIDE, 3);
        tl_mesh *mesh = write_and_read(ctx, "sphere-flow", size);
        size_t side = (size_t)fmax(1, round(size / cbrt(12)));
        CHECK_EQ(tl_mesh_vert_count(mesh), (6 * side * side + 2) * (2 * side + 1));
        CHECK_EQ(tl_mesh_tet_count(mesh), 72 * side * side * side);
        double volume = measure_tets(mesh, &ratio);
        surfaces s = measure_boundary(ctx, mesh);
        CHECK_EQ(s.triangles, 2 * 12 * side * side);
        CHECK_NEAR(s.outer, box, 1e-9 * box);
        CHECK_NEAR(volume, box - s.inner, 1e-9 * box);
        double ball = 4.0 / 3 * 3.14159265358979323846;
        CHECK(s.inner < ball && s.inner > ball * (1 - 1.6 / (double)(side * side)));
        check_values(ctx, "sphere-flow", mesh);
        if (size == 40) CHECK_BOUND("smallest cell to largest", ratio, 1e-4);
        tl_mesh_destroy(mesh);
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_default_sizes(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_mesh *mesh = write_and_read(ctx, "sphere-flow", 0);
    printf("sphere-flow: %zu tets\n", tl_mesh_tet_count(mesh));
    CHECK_NEAR((double)tl_mesh_tet_count(mesh), 1e6, 5e4);
    double range[2];
    tl_channel_range(tl_mesh_channel_by_name(mesh, "pressure"), tl_mesh_vert_count(mesh), range,
                     NULL);
    CHECK_NEAR(range[0], -1.25, 1e-3); /* at the sphere's equator */
    CHECK_NEAR(range[1], 1, 1e-3);     /* where the flow stands still */
    tl_mesh_destroy(mesh);
    mesh = write_and_read(ctx, "gaussians", 0);
    CHECK_EQ(tl_mesh_tet_count(mesh), 1250235);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- sizes that no disk holds ---- */

static void check_far_tets(const tli_sample_mesh *mesh, uint64_t first)
{
    enum { COUNT = 400 };
    uint64_t tets[COUNT][4];
    uint64_t count = mesh->tet_count - first < COUNT ? mesh->tet_count - first : COUNT;
    tli_sample_tets(mesh, first, first + count, tets);
    for (uint64_t t = 0; t < count; t++) {
        double p[4][3];
        for (int v = 0; v < 4; v++) {
            float xyz[3];
            CHECK(tets[t][v] < mesh->vert_count);
            tli_sample_point(mesh, tets[t][v], xyz);
            for (int axis = 0; axis < 3; axis++) p[v][axis] = (double)xyz[axis];
        }
        if (tli_orient3d(p[0], p[1], p[2], p[3]) != 1)
            fail_msg("kind %d, side %u: tet %llu is not positive", (int)mesh->kind, mesh->side,
                     (unsigned long long)(first + t));
    }
}

static void test_huge_sizes(void **state)
{
    (void)state;
    static const uint32_t sizes[] = {700, 2000, 10000, 32768};
    for (int kind = 0; kind < 2; kind++)
        for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
            tli_sample_mesh mesh;
            CHECK(tli_sample_mesh_init(&mesh, (tli_sample_kind)kind, sizes[i]));
            double wanted = pow(sizes[i], 3);
            CHECK_NEAR((double)mesh.vert_count / wanted, 1, 0.01);
            for (uint64_t part = 0; part <= 64; part++)
                check_far_tets(&mesh, mesh.tet_count / 64 * part);
        }
    tli_sample_mesh mesh;
    for (int kind = 0; kind < 2; kind++) {
        CHECK(!tli_sample_mesh_init(&mesh, (tli_sample_kind)kind, 1));
        CHECK(!tli_sample_mesh_init(&mesh, (tli_sample_kind)kind, 32769));
    }
}

static void test_memory_does_not_grow(void **state)
{
    (void)state;
    static const uint32_t sizes[] = {24, 96};
    size_t peaks[2];
    for (int i = 0; i < 2; i++) {
        tl_ctx *ctx = check_ctx_create(2);
        CHECK_OK(ctx, tl_sample_write(ctx, "sphere-flow", sizes[i], "sample.vtu"));
        peaks[i] = tl_ctx_peak_bytes(ctx);
        tl_ctx_destroy(ctx);
    }
    remove("sample.vtu");
    printf("peak %zu bytes at size %u, %zu at %u\n", peaks[0], sizes[0], peaks[1], sizes[1]);
    CHECK_BOUND("peak bytes", (double)peaks[1], 6e6);
}

/* ---- what goes wrong ---- */

static bool cancel(void *user, const char *stage, uint64_t done, uint64_t total)
{
    (void)user, (void)stage, (void)done, (void)total;
    return false;
}

static void test_wrong_use_and_failures(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    double x[3] = {0}, values[4];
    CHECK_STATUS(tl_sample_value(ctx, "none", x, values), TL_ERR_ARG);
    CHECK_STATUS(tl_sample_write(ctx, "none", 0, "a.vtu"), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "none"));
    CHECK_STATUS(tl_sample_write(ctx, "gaussians", 1, "a.vtu"), TL_ERR_ARG);
    CHECK_STATUS(tl_sample_write(ctx, "gaussians", 100000, "a.vtu"), TL_ERR_ARG);
    CHECK_STATUS(tl_sample_write(ctx, "gaussians", 5, "a.vtk"), TL_ERR_ARG);
    for (uint64_t n = 1;; n++) {
        tli_file_fail_at(ctx, n);
        tl_status st = tl_sample_write(ctx, "sphere-flow", 40, "a.vtu");
        tli_file_fail_at(ctx, 0);
        CHECK((st == TL_OK) == (access("a.vtu", F_OK) == 0));
        if (!st) break;
        CHECK_EQ(st, TL_ERR_IO);
    }
    remove("a.vtu");
    tl_ctx_destroy(ctx);
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.progress = cancel;
    CHECK_EQ(tl_ctx_create(&opts, &ctx), TL_OK);
    CHECK_STATUS(tl_sample_write(ctx, "gaussians", 9, "a.vtu"), TL_ERR_CANCELLED);
    CHECK(access("a.vtu", F_OK) != 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_catalogue),
        cmocka_unit_test(test_values_made_elsewhere),
        cmocka_unit_test(test_flow_is_potential_flow),
        cmocka_unit_test(test_grids),
        cmocka_unit_test(test_shells),
        cmocka_unit_test(test_default_sizes),
        cmocka_unit_test(test_huge_sizes),
        cmocka_unit_test(test_memory_does_not_grow),
        cmocka_unit_test(test_wrong_use_and_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
