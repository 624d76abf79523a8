/* Models without the tets that bring nothing: smaller where the field is constant, whole at every
 * level, and as near to the original as the bounds of storing say. */
#include "tetralod/cut.h"

#include "check_model.h"

/* A bump in a constant field. */
static double bump(const double x[3])
{
    double r2 = 0;
    for (int k = 0; k < 3; k++) r2 += (x[k] - 0.3) * (x[k] - 0.3);
    return r2 < 0.04 ? (1 - r2 / 0.04) * (1 - r2 / 0.04) : 0;
}

static double nothing(const double x[3])
{
    (void)x;
    return 3;
}

/* Builds, proves the file and random cuts against the mesh; gives the store. */
static tl_store *build(tl_ctx *ctx, const tl_mesh *mesh, bool prune, tl_build_result *result)
{
    tl_store *store;
    tl_cut_check_opts cuts = tl_cut_check_opts_defaults();
    tl_cut_check_result found;
    tl_build_opts opts = check_model_opts(1000, 250);
    opts.prune = prune;
    cuts.cuts = 12;
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, check_model_path("prune"), &opts, result));
    CHECK_OK(ctx, tl_store_open(ctx, check_model_path("prune"), &store));
    CHECK_OK(ctx, tl_store_check(ctx, store, TL_CHECK_FULL));
    CHECK_OK(ctx, tl_cut_check(ctx, store, mesh, &cuts, &found));
    CHECK_EQ(found.cuts_tried, 12);
    tl_cut_check_release(ctx, &found);
    return store;
}

/* The finest mesh of a model and what it promises. */
static void check_finest(tl_ctx *ctx, tl_store *store, const tl_mesh *mesh, bool pruned)
{
    const tl_store_head *head = tl_store_get_head(store);
    const double width = head->channels[0].range[1] - head->channels[0].range[0];
    tl_cut_query query = tl_cut_query_defaults();
    tl_cut *cut;
    tl_mesh *finest;
    query.level = 0;
    CHECK_OK(ctx, tl_cut_create(ctx, store, &cut));
    CHECK_OK(ctx, tl_cut_update(cut, &query));
    CHECK_OK(ctx, tl_cut_mesh(cut, NULL, 0, &finest));
    CHECK_EQ(head->input_tets, tl_mesh_tet_count(mesh));
    CHECK(pruned ? tl_mesh_tet_count(finest) < tl_mesh_tet_count(mesh)
                 : tl_mesh_tet_count(finest) == tl_mesh_tet_count(mesh));
    CHECK_BOUND("finest mesh", tl_cut_channel_error(cut, 0), 1e-4 * width * (1 + 1e-9));
    CHECK_BOUND("its boundary", tl_cut_get_state(cut).boundary_error, head->position_error * 1.001);
    CHECK_OK(ctx, tl_mesh_check(ctx, finest, TL_CHECK_FULL));
    tl_mesh_destroy(finest);
    tl_cut_destroy(cut);
}

static void drop(tl_store *store)
{
    tl_store_close(store);
    CHECK_EQ(remove(check_model_path("prune")), 0);
}

static void check_field(make_field field, double smaller)
{
    tl_ctx *ctx;
    uint64_t bytes[2];
    make_mesh m = make_grid(17);
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    tl_mesh *mesh = make_object(ctx, &m, field);
    for (int prune = 0; prune < 2; prune++) {
        tl_build_result result;
        tl_store *store = build(ctx, mesh, prune, &result);
        bytes[prune] = result.bytes;
        check_finest(ctx, store, mesh, prune);
        drop(store);
        tl_build_release(ctx, &result);
    }
    CHECK_BOUND("bytes, pruned over whole", (double)bytes[1] / (double)bytes[0], smaller);
    tl_mesh_destroy(mesh);
    make_release(&m);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_bump(void **state)
{
    (void)state;
    check_field(bump, 0.9);
}

/* Whole levels go. How many depends on the groups of the finest level: fewer without METIS. */
static void test_constant(void **state)
{
    (void)state;
    check_field(nothing, 0.75);
}

static void test_lossless(void **state)
{
    (void)state;
    tl_ctx *ctx;
    tl_build_result result;
    tl_build_opts opts = check_model_opts(1000, 250);
    make_mesh m = make_grid(3);
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    tl_mesh *mesh = make_object(ctx, &m, bump);
    opts.prune = opts.lossless = true;
    CHECK_STATUS(tl_model_build_mesh(ctx, mesh, check_model_path("prune"), &opts, &result),
                 TL_ERR_ARG);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bump),
        cmocka_unit_test(test_constant),
        cmocka_unit_test(test_lossless),
    };
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
