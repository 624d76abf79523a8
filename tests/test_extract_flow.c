/* Streamlines of the flow past a sphere, by its stream function: in the whole mesh and in a cut of
 * several levels. */
#include "check.h"

#include "tetralod/cut.h"
#include "tetralod/extract.h"
#include "tetralod/formats.h"

#include "check_ctx.h"
#include "check_lines.h"
#include "check_model.h"

/* Distance from the axis far upstream of the line through x: of the stream function. */
static double far_radius(const double x[3])
{
    double r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    return hypot(x[1], x[2]) * sqrt(fmax(0, 1 - 1 / (r * r * r)));
}

/* Largest and mean difference from the lines through the seeds, which lie at (-9, rho, z). */
typedef struct deviation {
    double worst, mean;
} deviation;

static deviation deviation_of(const tl_polydata *lines)
{
    deviation d = {0, 0};
    for (size_t c = 0; c < lines->cell_count; c++) {
        size_t seed = lines->starts[c];
        while (lines->channels[0].values[seed] < 0) seed++;
        double radius = far_radius(lines->xyz + 3 * seed), worst = 0;
        for (size_t i = 0; i < line_verts(lines, c); i++)
            worst = fmax(worst, fabs(far_radius(line_vert(lines, c, i)) - radius));
        d.worst = fmax(d.worst, worst);
        d.mean += worst / (double)lines->cell_count;
    }
    return d;
}

/* Past the sphere, from the inlet of the box to its outlet. */
static void check_passed(const tl_polydata *lines, const tl_stream_report *report, size_t count)
{
    CHECK_EQ(lines->cell_count, count);
    CHECK_EQ(report->ends[TL_STREAM_END_BOUNDARY], 2 * count);
    for (size_t c = 0; c < count; c++) {
        CHECK_NEAR(line_vert(lines, c, 0)[0], -10, 1e-6);
        CHECK_NEAR(line_vert(lines, c, line_verts(lines, c) - 1)[0], 10, 1e-6);
    }
}

static tl_mesh *sphere_flow(tl_ctx *ctx, uint32_t size)
{
    tl_mesh *mesh = NULL;
    CHECK_OK(ctx, tl_sample_write(ctx, "sphere-flow", size, "lines_sphere.vtu"));
    CHECK_OK(ctx, tl_mesh_read(ctx, "lines_sphere.vtu", NULL, &mesh, NULL));
    remove("lines_sphere.vtu");
    return mesh;
}

enum { RAKE = 60 };

/* Seeds that pass the sphere at 0.35 to 6 radii. */
static void make_rake(double seeds[3 * RAKE])
{
    for (int i = 0; i < RAKE; i++) {
        double turn = 2.4 * i, radius = 0.35 + 0.095 * i;
        seeds[3 * i] = -9;
        seeds[3 * i + 1] = radius * cos(turn);
        seeds[3 * i + 2] = radius * sin(turn);
    }
}

static tl_polydata *trace(tl_ctx *ctx, const tl_mesh *mesh, const double seeds[3 * RAKE],
                          const tl_stream_opts *opts, tl_stream_report *report)
{
    tl_polydata *lines = NULL;
    const tl_channel *velocity = tl_mesh_channel_by_name(mesh, "velocity");
    CHECK_OK(ctx, tl_streamlines(ctx, mesh, NULL, NULL, velocity->values, seeds, RAKE, opts, &lines,
                                 report));
    return lines;
}

static void lines_follow_the_stream_function(void **state)
{
    (void)state;
    double seeds[3 * RAKE];
    deviation coarse = {0, 0}, fine = {0, 0};
    make_rake(seeds);
    for (unsigned order = 2; order <= 5; order += 3)
        for (uint32_t size = 24; size <= 48; size += 24) {
            tl_ctx *ctx = check_ctx_create(2);
            tl_mesh *mesh = sphere_flow(ctx, size);
            tl_stream_report report;
            tl_stream_opts opts = tl_stream_opts_defaults();
            opts.order = order;
            tl_polydata *lines = trace(ctx, mesh, seeds, &opts, &report);
            check_passed(lines, &report, RAKE);
            *(size == 24 ? &coarse : &fine) = deviation_of(lines);
            tl_polydata_destroy(ctx, lines);
            tl_mesh_destroy(mesh);
            check_ctx_destroy(ctx);
            if (size == 24) continue;
            printf("order %u:\n", order);
            CHECK_BOUND("  off the stream function, radii, worst", fine.worst, 0.01);
            CHECK_BOUND("  mean", fine.mean, 0.003);
            CHECK_BOUND("  mean, mesh of half the step", fine.mean, coarse.mean / 2.5);
        }
}

/* The finest mesh before the sphere, the coarsest behind it: lines go on across. */
static void lines_cross_levels(void **state)
{
    (void)state;
    static const double box[6] = {-11, -11, -11, -5, 11, 11};
    double seeds[3 * RAKE], bounds[2] = {0, 0};
    tl_ctx *ctx = check_ctx_create(2);
    tl_mesh *full = sphere_flow(ctx, 24), *mesh = NULL;
    tl_build_opts build = check_model_opts(1000, 200);
    tl_build_result result;
    tl_store *store = NULL;
    tl_cut *cut = NULL;
    const char *path = check_model_path("lines");
    CHECK_OK(ctx, tl_model_build_mesh(ctx, full, path, &build, &result));
    tl_build_release(ctx, &result);
    CHECK_OK(ctx, tl_store_open(ctx, path, &store));
    CHECK_OK(ctx, tl_cut_create(ctx, store, &cut));
    tl_cut_query query = tl_cut_query_defaults();
    query.box = box;
    query.bounds.channels = bounds;
    CHECK_OK(ctx, tl_cut_update(cut, &query));
    CHECK_OK(ctx, tl_cut_mesh(cut, NULL, 0, &mesh));
    size_t patch_count, levels = 0;
    const uint32_t *patches = tl_cut_patches(cut, &patch_count);
    for (size_t p = 0; p < patch_count; p++) {
        tl_patch_info info;
        CHECK_OK(ctx, tl_store_patch(ctx, store, patches[p], &info));
        levels |= (size_t)1 << info.level;
    }
    CHECK((levels & 1) && (levels & (levels - 1))); /* the finest and others */
    CHECK(tl_mesh_tet_count(mesh) < tl_mesh_tet_count(full));
    tl_stream_report report;
    make_rake(seeds);
    tl_polydata *lines = trace(ctx, mesh, seeds, NULL, &report);
    check_passed(lines, &report, RAKE);
    deviation off = deviation_of(lines);
    printf("%zu of %zu tets\n", tl_mesh_tet_count(mesh), tl_mesh_tet_count(full));
    CHECK_BOUND("off the stream function across levels, radii, mean", off.mean, 0.02);
    tl_polydata_destroy(ctx, lines);
    tl_mesh_destroy(mesh);
    tl_mesh_destroy(full);
    tl_cut_destroy(cut);
    tl_store_close(store);
    remove(path);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_follow_the_stream_function),
        cmocka_unit_test(lines_cross_levels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
