/* Simplification in parts: conforming results near those of the mesh as a whole, in little memory,
 * bounds that hold, the same bytes for any number of threads. */
#include "check.h"
#include "check_ctx.h"

#include "check_file.h"
#include "make_mesh.h"

#include <dirent.h>
#include <sys/stat.h>

#include "base/base_file.h"
#include "tetralod/measure.h"
#include "tetralod/segment.h"

/* So little that the sample of 1.2 million tets takes some clusters. */
static tl_segment_opts small_opts(void)
{
    tl_segment_opts opts = tl_segment_opts_defaults();
    opts.memory_bytes = TL_SEGMENT_MEMORY_MIN;
    opts.folder = "work";
    return opts;
}

static double error_of(tl_ctx *ctx, const tl_mesh *a, const tl_mesh *b, double *most)
{
    tl_compare_opts opts = tl_compare_opts_defaults();
    tl_compare_result result;
    CHECK_OK(ctx, tl_mesh_compare(ctx, a, b, &opts, &result));
    double rms = result.fields[0].rms;
    *most = result.fields[0].max;
    tl_compare_release(ctx, &result);
    return rms;
}

/* A tenth of the tets in parts, beside a tenth at once. */
static void test_ratio(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    mkdir("work", 0777);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 50, "in.vtu"));
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.ratio = 0.1;
    tl_segment_opts cut = small_opts();
    tl_stream_result parts;
    CHECK_OK(ctx,
             tl_simplify_stream(ctx, "in.vtu", NULL, &opts, &cut, "out.vtu", NULL, &parts, NULL));
    CHECK(parts.clusters > 1 && parts.rounds > 1 && parts.target_reached);
    tl_mesh *in = NULL, *out = NULL, *whole = NULL;
    tl_simplify_result at_once;
    CHECK_OK(ctx, tl_mesh_read(ctx, "in.vtu", NULL, &in, NULL));
    CHECK_OK(ctx, tl_mesh_read(ctx, "out.vtu", NULL, &out, NULL));
    CHECK_OK(ctx, tl_mesh_simplify(ctx, in, &opts, &whole, &at_once));
    CHECK_OK(ctx, tl_mesh_check(ctx, out, TL_CHECK_FULL));
    CHECK_EQ(tl_mesh_tet_count(out), parts.tets_out);
    CHECK_EQ(tl_mesh_vert_count(out), parts.vertices_out);
    CHECK_EQ(tl_mesh_tet_count(in), parts.tets_in);
    CHECK(parts.tets_out <= parts.tets_in / 10);
    CHECK(parts.tets_out >= parts.tets_in / 11);

    tl_mesh_stats before, after;
    CHECK_OK(ctx, tl_mesh_measure(ctx, in, &before));
    CHECK_OK(ctx, tl_mesh_measure(ctx, out, &after));
    CHECK_BOUND("volume", fabs(after.volume - before.volume) / before.volume, 1e-3);
    CHECK_EQ(after.nonmanifold_faces, 0);
    CHECK_EQ(after.nonmanifold_edges, 0);
    CHECK_EQ(after.components, 1);
    CHECK_EQ(after.inverted, 0);
    double most;
    double rms_parts = error_of(ctx, in, out, &most), rms_whole = error_of(ctx, in, whole, &most);
    CHECK_BOUND("RMS error over that of the whole", rms_parts / rms_whole, 1.6);
    tl_simplify_release(ctx, &at_once);
    tl_mesh_destroy(whole);
    tl_mesh_destroy(out);
    tl_mesh_destroy(in);
    tl_ctx_destroy(ctx);
}

static void test_same_bytes(void **state)
{
    (void)state;
    char *first = NULL;
    size_t first_bytes = 0;
    mkdir("work", 0777);
    for (unsigned threads = 1; threads <= 3; threads += 2) {
        tl_ctx *ctx = check_ctx_create(threads);
        if (threads == 1) CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 50, "in.vtu"));
        tl_simplify_opts opts = tl_simplify_opts_defaults();
        opts.target_tets = 100000;
        tl_segment_opts cut = small_opts();
        CHECK_OK(ctx, tl_simplify_stream(ctx, "in.vtu", NULL, &opts, &cut, "same.vtu", NULL, NULL,
                                         NULL));
        size_t bytes;
        char *all = check_file_load("same.vtu", &bytes);
        if (first) {
            CHECK_EQ(bytes, first_bytes);
            CHECK(memcmp(all, first, bytes) == 0);
            free(all);
        } else {
            first = all;
            first_bytes = bytes;
        }
        tl_ctx_destroy(ctx);
    }
    free(first);
}

/* One round, and the bound holds at every vertex. */
static void test_bound(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    mkdir("work", 0777);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 45, "in.vtu"));
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.error = 0.01;
    tl_segment_opts cut = small_opts();
    tl_stream_result parts;
    CHECK_OK(ctx,
             tl_simplify_stream(ctx, "in.vtu", NULL, &opts, &cut, "out.vtu", NULL, &parts, NULL));
    CHECK_EQ(parts.rounds, 1);
    CHECK(parts.clusters > 1 && parts.tets_out < parts.tets_in / 2);
    tl_mesh *in = NULL, *out = NULL;
    CHECK_OK(ctx, tl_mesh_read(ctx, "in.vtu", NULL, &in, NULL));
    CHECK_OK(ctx, tl_mesh_read(ctx, "out.vtu", NULL, &out, NULL));
    CHECK_OK(ctx, tl_mesh_check(ctx, out, TL_CHECK_FULL));
    double range[2], most;
    tl_channel_range(tl_mesh_channel(in, 0), tl_mesh_vert_count(in), range, NULL);
    error_of(ctx, in, out, &most);
    CHECK_BOUND("error", most, 0.01 * (range[1] - range[0]) * (1 + 1e-6));
    tl_mesh_destroy(out);
    tl_mesh_destroy(in);
    tl_ctx_destroy(ctx);
}

/* Regions and channels on tets come through; a mesh that fits is simplified as a whole. */
static void test_regions(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    mkdir("work", 0777);
    make_mesh m = make_grid(20);
    make_two_regions(&m);
    tl_mesh *mesh = make_object(ctx, &m, NULL), *out = NULL;
    double *values = malloc(m.tet_count * sizeof *values);
    for (size_t t = 0; t < m.tet_count; t++) values[t] = m.regions[t] + 0.5;
    tl_channel half = {"half", "", 1, TL_ON_TET, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &half));
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "in.vtu", NULL));
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.ratio = 0.3;
    tl_segment_opts cut = small_opts();
    tl_stream_result parts;
    CHECK_OK(ctx,
             tl_simplify_stream(ctx, "in.vtu", NULL, &opts, &cut, "out.vtu", NULL, &parts, NULL));
    CHECK_EQ(parts.clusters, 1);
    CHECK_OK(ctx, tl_mesh_read(ctx, "out.vtu", NULL, &out, NULL));
    CHECK(tl_mesh_regions(out) != NULL);
    const tl_channel *channel = tl_mesh_channel_by_name(out, "half");
    for (size_t t = 0; t < tl_mesh_tet_count(out); t++)
        CHECK_NEAR(channel->values[t], tl_mesh_regions(out)[t] + 0.5, 1e-9);
    tl_mesh_destroy(out);
    tl_mesh_destroy(mesh);
    free(values);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static void test_wrong_use(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    mkdir("work", 0777);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 6, "in.vtu"));
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    tl_segment_opts cut = small_opts();
    CHECK_STATUS(tl_simplify_stream(ctx, "in.vtu", NULL, &opts, &cut, "out.vtu", NULL, NULL, NULL),
                 TL_ERR_ARG);
    opts.ratio = 0.5;
    CHECK_STATUS(tl_simplify_stream(ctx, "in.vtu", NULL, &opts, &cut, "out.stl", NULL, NULL, NULL),
                 TL_ERR_ARG);
    CHECK_STATUS(tl_simplify_stream(ctx, "no.vtu", NULL, &opts, &cut, "out.vtu", NULL, NULL, NULL),
                 TL_ERR_IO);
    tl_simplify_channel unknown = {"nothing", 1, 0};
    opts.channels = &unknown;
    opts.channel_count = 1;
    CHECK_STATUS(tl_simplify_stream(ctx, "in.vtu", NULL, &opts, &cut, "out.vtu", NULL, NULL, NULL),
                 TL_ERR_DATA);
    DIR *dir = opendir("work");
    size_t entries = 0;
    while (readdir(dir)) entries++;
    closedir(dir);
    CHECK_EQ(entries, 2);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ratio),     cmocka_unit_test(test_same_bytes),
        cmocka_unit_test(test_bound),     cmocka_unit_test(test_regions),
        cmocka_unit_test(test_wrong_use),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
