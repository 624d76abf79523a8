/* Real data of many kinds, to a tenth and to errors, the promises measured. */
#include "check.h"
#include "check_simplify_real.h"

static const real_file files[] = {
    {"curvilinear/bluntfinxyz.bin", "curvilinear/bluntfinq.bin", {0}},
    {"curvilinear/combxyz.bin", "curvilinear/combq.bin", {0}},
    {"curvilinear/kitchen.vtk", NULL, {0}},
    {"volume/neghip_64x64x64_uint8.raw", NULL, {64, 64, 64}},
    {"volume/hydrogen.vti", NULL, {0}},
    {"tet/bracket_appended_compressed.vtu", NULL, {0}},
    {"tet/2x2x2cube.vtu", NULL, {0}},
    {"tet/dataset.vtu", NULL, {0}},
    {"tet/monodomain3d_0.vtu", NULL, {0}},
    {"tet/raptorTetra_19409.vtu", NULL, {0}},
    {"tet/seamount.vtu", NULL, {0}},
    {"tet/post.vtk", NULL, {0}},
    {"tet/CylinderLinear.vtk", NULL, {0}},
    {"hexmixed/can.vtu", NULL, {0}},
    {"hexmixed/fire_ug.vtu", NULL, {0}},
};

static void test_files(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    size_t found = 0;
    const char *only = getenv("TETRALOD_FILE");
    (void)state;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        if (only && !strstr(files[i].name, only)) continue;
        tl_mesh *mesh = real_read(ctx, &files[i]);
        if (!mesh) continue;
        printf("%s\n", files[i].name);
        found++;
        real_simplify(mesh, 0.1, 0);
        real_simplify(mesh, 0, 0.02);
        real_simplify(mesh, 0.3, 0.1);
        tl_mesh_destroy(mesh);
    }
    tl_ctx_destroy(ctx);
    if (!found) CHECK_SKIP("no data: set TETRALOD_DATA to the folder of data sets");
    if (!only) CHECK_EQ(found, sizeof files / sizeof *files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_files)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
