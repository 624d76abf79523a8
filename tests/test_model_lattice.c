/* Places of the finest level: storing moves no vertex so far that a value at its original place
 * changes by more than was asked, however thin a layer is; vertices at one place stay at one. */
#include "tetralod/cut.h"

#include "check_ctx.h"
#include "check_model.h"

enum { N = 14 };

/* Builds, proves file and cuts; what the finest level promises of a channel is to be the bound. */
static tl_store *build(tl_ctx *ctx, const tl_mesh *mesh)
{
    tl_store *store;
    tl_build_result result;
    tl_build_opts opts = check_model_opts(2000, 400);
    tl_cut_check_opts cuts = tl_cut_check_opts_defaults();
    tl_cut_check_result found;
    cuts.cuts = 8;
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, check_model_path("lattice"), &opts, &result));
    CHECK_OK(ctx, tl_store_open(ctx, check_model_path("lattice"), &store));
    CHECK_OK(ctx, tl_store_check(ctx, store, TL_CHECK_FULL));
    CHECK_OK(ctx, tl_cut_check(ctx, store, mesh, &cuts, &found));
    CHECK_EQ(found.cuts_tried, 8);
    tl_cut_check_release(ctx, &found);
    tl_build_release(ctx, &result);
    return store;
}

static void drop(tl_store *store)
{
    tl_store_close(store);
    CHECK_EQ(remove(check_model_path("lattice")), 0);
}

/* A boundary layer: planes of vertices from 1e-4 of the height on, and a field that rises within
 * the first few. The lattice that the bound on places allows is a fifth of that. */
static double layer(const double x[3])
{
    return tanh(x[2] / 3e-4) + 0.1 * sin(4 * x[0]) * x[1];
}

static void test_layer(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(N);
    make_perturb(&m, 0.005, 7);
    for (size_t v = 0; v < m.vert_count; v++)
        m.xyz[3 * v + 2] = expm1(7.0 * m.xyz[3 * v + 2]) / expm1(7.0);
    tl_mesh *mesh = make_object(ctx, &m, layer);
    double *rows = malloc(3 * m.vert_count * sizeof *rows);
    for (size_t v = 0; v < m.vert_count; v++)
        for (size_t k = 0; k < 3; k++) rows[3 * v + k] = layer(m.xyz + 3 * v) * (double)(k + 1);
    tl_channel channel = {"wind", "m/s", 3, TL_ON_VERTEX, TL_F64, rows};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    tl_store *store = build(ctx, mesh);
    const tl_store_head *head = tl_store_get_head(store);
    CHECK(head->lattice.kind == TL_PLACE_LATTICE);
    CHECK(head->position_error > 0);
    for (uint32_t c = 0; c < 2; c++) {
        const double width = head->channels[c].range[1] - head->channels[c].range[0];
        CHECK_BOUND(head->channels[c].name, head->channels[c].codec_error, 1.01e-4 * width);
    }
    drop(store);
    free(rows);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Two cubes side by side that share places, not vertices; the field is steep in one of them and
 * unknown in the other. */
static void test_sides(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh one = make_grid(N), m = make_room(2 * one.vert_count, 2 * one.tet_count);
    const size_t verts = one.vert_count, tets = one.tet_count;
    make_perturb(&one, 0.005, 11);
    double *values = malloc(2 * verts * sizeof *values);
    for (size_t v = 0; v < 2 * verts; v++) {
        memcpy(m.xyz + 3 * v, one.xyz + 3 * (v % verts), 3 * sizeof *m.xyz);
        if (v >= verts) m.xyz[3 * v] *= -1; /* mirrored in the plane x = 0 */
        if (v % N == 0) m.xyz[3 * v] = 0;
        const double *x = m.xyz + 3 * v;
        values[v] = v < verts ? sin(2e3 * x[1]) + x[2] : (double)NAN;
    }
    for (size_t t = 0; t < 2 * tets; t++) {
        for (size_t i = 0; i < 4; i++)
            m.tets[4 * t + i] = one.tets[4 * (t % tets) + i] + (tl_lidx)(t < tets ? 0 : verts);
        if (t < tets) continue;
        tl_lidx first = m.tets[4 * t];
        m.tets[4 * t] = m.tets[4 * t + 1];
        m.tets[4 * t + 1] = first;
    }
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_channel channel = {"heat", "", 1, TL_ON_VERTEX, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    tl_store *store = build(ctx, mesh);
    const tl_store_head *head = tl_store_get_head(store);
    const double width = head->channels[0].range[1] - head->channels[0].range[0];
    CHECK(head->lattice.kind == TL_PLACE_LATTICE);
    CHECK_BOUND("finest level", head->channels[0].codec_error, 1.01e-4 * width);
    tl_mesh *finest = check_model_level(ctx, store, 0);
    tl_mesh_stats stats;
    CHECK_OK(ctx, tl_mesh_measure(ctx, finest, &stats));
    printf("%zu of %d places have both sides\n", stats.duplicate_verts, N * N);
    CHECK(stats.duplicate_verts <= N * N);
    CHECK(stats.duplicate_verts >= N * N * 19 / 20); /* but for sides that no segment has both of */
    tl_mesh_destroy(finest);
    for (uint32_t l = 0; l < head->level_count; l++) {
        printf("level %u: %g\n", l, head->levels[l].max_error[0]);
        CHECK(isfinite(head->levels[l].max_error[0]));
    }
    drop(store);
    free(values);
    tl_mesh_destroy(mesh);
    make_release(&m);
    make_release(&one);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layer),
        cmocka_unit_test(test_sides),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
