/* Values fitted to samples: linear fields and constants come out, fixed vertices stay, and a vertex
 * that samples hardly know does not run away. */
#include "check.h"
#include "check_ctx.h"

#include "make_mesh.h"
#include "model/model.h"

static double linear(const double x[3])
{
    return 1 + 2 * x[0] - 3 * x[1] + 5 * x[2];
}

/* Samples of a field at places with these weights in each tet, turned around its corners. */
static void add_samples(tli_fit *fit, const tl_mesh *mesh, make_field field, const double base[4],
                        const double *now)
{
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++)
        for (size_t turn = 0; turn < 4; turn++) {
            double w[4], x[3] = {0, 0, 0};
            const tl_lidx *q = tl_mesh_tets(mesh) + 4 * t;
            for (size_t i = 0; i < 4; i++) w[i] = base[(i + turn) % 4];
            for (size_t i = 0; i < 4; i++)
                for (size_t k = 0; k < 3; k++)
                    x[k] += w[i] * tl_mesh_xyz(mesh)[3 * (size_t)q[i] + k];
            double value = field(x);
            tli_fit_add(fit, (tl_lidx)t, w, &value, now);
        }
}

static void linear_fields_come_out(void **state)
{
    (void)state;
    static const double base[4] = {0.6, 0.2, 0.15, 0.05};
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(7);
    make_perturb(&m, 0.02, 3);
    tl_mesh *mesh = make_object(ctx, &m, linear);
    size_t n = tl_mesh_vert_count(mesh);
    double *now = calloc(n, sizeof *now);
    uint8_t *fixed = calloc(n, 1);
    tli_fit *fit = NULL;
    fixed[5] = 1;
    now[5] = linear(tl_mesh_xyz(mesh) + 15);
    CHECK_OK(ctx, tli_fit_create(ctx, mesh, 1, &fit));
    add_samples(fit, mesh, linear, base, now);
    tli_fit_solve(fit, fixed, now);
    for (size_t v = 0; v < n; v++) /* the solver stops at a thousandth of a range of 10 or so */
        CHECK_NEAR(now[v], linear(tl_mesh_xyz(mesh) + 3 * v), 0.05);
    CHECK_EQ(now[5] == linear(tl_mesh_xyz(mesh) + 15), 1);
    tli_fit_destroy(fit);
    free(fixed);
    free(now);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* Vertex 0 of one tet is known by samples of weight 1e-9 alone, which differ from what is there. */
static void unknown_vertices_stay(void **state)
{
    (void)state;
    static const double weights[4] = {1e-9, 0.5, 0.3, 0.2 - 1e-9};
    static const double turned[4] = {1e-9, 0.1, 0.2, 0.7 - 1e-9};
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(2);
    tl_mesh *mesh = make_object(ctx, &m, linear);
    size_t n = tl_mesh_vert_count(mesh), corner = tl_mesh_tets(mesh)[0];
    double *now = calloc(n, sizeof *now), high = 3, low = 0;
    uint8_t *fixed = calloc(n, 1);
    memset(fixed, 1, n);
    fixed[corner] = 0;
    tli_fit *fit = NULL;
    CHECK_OK(ctx, tli_fit_create(ctx, mesh, 1, &fit));
    tli_fit_add(fit, 0, weights, &high, now);
    tli_fit_add(fit, 0, turned, &low, now);
    tli_fit_solve(fit, fixed, now);
    CHECK_NEAR(now[corner], 0, 1e-3);
    for (size_t v = 0; v < n; v++) CHECK(v == corner || now[v] == 0);
    tli_fit_destroy(fit);
    /* what was there before is brought back to where samples are */
    now[corner] = 1e8;
    CHECK_OK(ctx, tli_fit_create(ctx, mesh, 1, &fit));
    tli_fit_add(fit, 0, weights, &high, now);
    tli_fit_add(fit, 0, turned, &low, now);
    tli_fit_solve(fit, fixed, now);
    CHECK_NEAR(now[corner], 3.3, 1e-9); /* a tenth of the range beyond its end */
    tli_fit_destroy(fit);
    free(fixed);
    free(now);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_fields_come_out),
        cmocka_unit_test(unknown_vertices_stay),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
