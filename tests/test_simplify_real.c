/* One small real mesh, the promises measured. */
#include "check.h"
#include "check_simplify_real.h"

static void test_small_files(void **state)
{
    static const real_file files[] = {{"volume/Bucky.raw", NULL, {32, 32, 32}},
                                      {"tet/annulus_gradation.vtu", NULL, {0}}};
    tl_ctx *ctx = shrink_ctx(2);
    size_t found = 0;
    (void)state;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        tl_mesh *mesh = real_read(ctx, &files[i]);
        if (!mesh) continue;
        printf("%s\n", files[i].name);
        found++;
        real_simplify(mesh, 0.2, 0);
        real_simplify(mesh, 0, 0.1);
        tl_mesh_destroy(mesh);
    }
    tl_ctx_destroy(ctx);
    if (!found) CHECK_SKIP("no data: set TETRALOD_DATA to the folder of data sets");
    CHECK_EQ(found, sizeof files / sizeof *files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_small_files)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
