/* A thousand random cuts of models of generated and real meshes: their surfaces, patch by patch. */
#include "check.h"
#include "check_ctx.h"

#include "check_simplify_real.h"
#include "check_slices.h"

/* Of each file this many, at each of three values. */
enum { CUTS = 48 };

static const real_file files[] = {
    {"curvilinear/bluntfinxyz.bin", "curvilinear/bluntfinq.bin", {0}},
    {"curvilinear/combxyz.bin", "curvilinear/combq.bin", {0}},
    {"tet/bracket_appended_compressed.vtu", NULL, {0}},
    {"tet/seamount.vtu", NULL, {0}},
    {"hexmixed/fire_ug.vtu", NULL, {0}},
};

static double hills(const double x[3])
{
    return sin(9 * x[0]) * cos(7 * x[1]) * cos(8 * x[2]) + 0.3 * x[2];
}

static double shell(const double x[3])
{
    return fabs(sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) - 0.7);
}

static void try_cuts(tl_ctx *ctx, tl_mesh *mesh, const char *name, uint64_t seed)
{
    slices_case c;
    printf("%s: ", name);
    slices_open(&c, ctx, mesh, seed);
    for (int i = 0; i < 3; i++) slices_check(&c, CUTS, 0.25 + 0.2 * i);
    slices_say(&c);
    slices_close(&c);
}

static void generated(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    for (int i = 0; i < 2; i++) {
        make_mesh m = i ? make_grid_cavity(20) : make_grid(20);
        make_perturb(&m, 0.1 / 20, 3);
        make_shuffle(&m, 5);
        try_cuts(ctx, make_object(ctx, &m, i ? shell : hills), i ? "shell" : "hills", 3);
        make_release(&m);
    }
    tl_ctx_destroy(ctx);
}

static void real(void **state)
{
    (void)state;
    real_each(files, sizeof files / sizeof *files, try_cuts);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(generated), cmocka_unit_test(real)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
