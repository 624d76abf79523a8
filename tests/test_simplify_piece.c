/* Pieces of a larger mesh: places that are left lie where they will be decoded, whatever the steps
 * of the vertices, and quadrics that come in go out. */
#include "check.h"
#include "check_simplify.h"

#include "simplify/simplify_piece.h"

/* A grid far from the origin, where float32 is as coarse as a sixteenth, with float32 places. */
static tl_mesh *far_grid(tl_ctx *ctx, size_t n)
{
    make_mesh m = make_grid(n);
    perturb_inner(&m, 0.2 / (double)(n - 1), 7);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    double *xyz = (double *)(uintptr_t)mesh->xyz;
    for (size_t i = 0; i < 3 * m.vert_count; i++) xyz[i] = (float)(1e6 + 16 * xyz[i]);
    make_release(&m);
    return mesh;
}

/* The piece of a mesh with one channel at half of its tets. */
static tli_piece_result half_of(const tl_mesh *mesh, const int16_t *steps, const float *quadrics)
{
    tl_ctx *ctx = tl_mesh_ctx(mesh);
    double scale = 1;
    tl_simplify_channel channel = {.name = tl_mesh_channel(mesh, 0)->name, .weight = 1};
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    tli_piece_result result;
    opts.channels = &channel;
    opts.channel_count = 1;
    opts.boundary_error = 0.1;
    opts.target_tets = tl_mesh_tet_count(mesh) / 2;
    tli_piece piece = {.mesh = mesh,
                       .opts = &opts,
                       .channel_scales = &scale,
                       .scale = 1 / 28.0,
                       .cost_max = (double)INFINITY,
                       .volume_part = (double)INFINITY,
                       .steps = steps,
                       .quadrics = quadrics};
    CHECK_OK(ctx, tli_piece_simplify(ctx, &piece, &result));
    CHECK(tl_mesh_tet_count(result.mesh) <= opts.target_tets);
    return result;
}

static int16_t *fill_steps(const tl_mesh *mesh, int16_t step)
{
    int16_t *steps = malloc((tl_mesh_vert_count(mesh) + 1) * sizeof *steps);
    if (!steps) abort();
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) steps[v] = step;
    return steps;
}

/* Vertices that are no longer where an input vertex was. */
static size_t count_moved(const tl_mesh *mesh, const tli_piece_result *r)
{
    size_t moved = 0;
    for (size_t v = 0; v < tl_mesh_vert_count(r->mesh); v++)
        moved += memcmp(tl_mesh_xyz(r->mesh) + 3 * v, tl_mesh_xyz(mesh) + 3 * (size_t)r->origins[v],
                        3 * sizeof(double)) != 0;
    return moved;
}

static bool is_float32(double x)
{
    volatile float narrow = (float)x;
    return (double)narrow == x;
}

static void test_float32(void **state)
{
    tl_ctx *ctx = shrink_ctx(1);
    tl_mesh *mesh = far_grid(ctx, 12);
    int16_t *steps = fill_steps(mesh, TLI_STEP_FLOAT32);
    (void)state;
    tli_piece_result r = half_of(mesh, steps, NULL);
    size_t verts = tl_mesh_vert_count(r.mesh), moved = count_moved(mesh, &r);
    printf("%zu of %zu vertices moved\n", moved, verts);
    CHECK(moved > verts / 4);
    for (size_t i = 0; i < 3 * verts; i++) CHECK(is_float32(tl_mesh_xyz(r.mesh)[i]));
    for (size_t v = 0; v < verts; v++) CHECK_EQ(r.steps[v], TLI_STEP_FLOAT32);
    tli_piece_release(ctx, &r);
    free(steps);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* Half of the vertices on a coarser lattice: who takes in one of those lies on it, too. */
static void test_lattice(void **state)
{
    enum { FINE = -4, COARSE = -3 };
    tl_ctx *ctx = shrink_ctx(1);
    tl_mesh *mesh = far_grid(ctx, 12);
    int16_t *steps = fill_steps(mesh, FINE);
    size_t coarse = 0;
    (void)state;
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
        bool fits = true;
        for (size_t k = 0; k < 3; k++)
            fits = fits && fmod(tl_mesh_xyz(mesh)[3 * v + k], ldexp(1, COARSE)) == 0;
        if (fits) steps[v] = COARSE;
    }
    tli_piece_result r = half_of(mesh, steps, NULL);
    for (size_t v = 0; v < tl_mesh_vert_count(r.mesh); v++) {
        CHECK(r.steps[v] >= steps[r.origins[v]]);
        coarse += r.steps[v] == COARSE;
        for (size_t k = 0; k < 3; k++)
            CHECK_EQ(fmod(tl_mesh_xyz(r.mesh)[3 * v + k], ldexp(1, r.steps[v])), 0);
    }
    printf("%zu of %zu vertices on the coarse lattice, %zu moved\n", coarse,
           tl_mesh_vert_count(r.mesh), count_moved(mesh, &r));
    CHECK(coarse > 0 && coarse < tl_mesh_vert_count(r.mesh));
    tli_piece_release(ctx, &r);
    free(steps);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* The weights of all quadrics together stay what they are: in a second piece, too. */
static void test_quadrics(void **state)
{
    tl_ctx *ctx = shrink_ctx(1);
    tl_mesh *mesh = far_grid(ctx, 12);
    (void)state;
    tli_piece_result first = half_of(mesh, NULL, NULL);
    tli_piece_result second = half_of(first.mesh, NULL, first.quadrics);
    const tli_piece_result *results[] = {&first, &second};
    for (size_t i = 0; i < 2; i++) {
        double weight = 0;
        size_t floats = results[i]->quadric_floats;
        for (size_t v = 0; v < tl_mesh_vert_count(results[i]->mesh); v++)
            weight += (double)results[i]->quadrics[v * floats + 10];
        CHECK_NEAR(weight, (double)tl_mesh_vert_count(mesh), 1e-3);
    }
    tli_piece_release(ctx, &second);
    tli_piece_release(ctx, &first);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_float32),
        cmocka_unit_test(test_lattice),
        cmocka_unit_test(test_quadrics),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
