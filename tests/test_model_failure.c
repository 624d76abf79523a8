/* Builds and additions that fail: for lack of memory, at every request in turn; for lack of a
 * folder; because they are cancelled. None leaks, crashes, or leaves a file. */
#include <unistd.h>

#include "check_model.h"
#include "fail_alloc.h"

static double slope(const double x[3])
{
    return x[0] * x[0] + x[1];
}

typedef struct job {
    make_mesh mesh;
    tl_build_opts opts;
} job;

static tl_status build(tl_ctx *ctx, void *arg)
{
    const job *j = arg;
    tl_mesh *mesh;
    tl_build_result result;
    tl_status st = tl_mesh_create(ctx, j->mesh.xyz, j->mesh.vert_count, j->mesh.tets,
                                  j->mesh.tet_count, &mesh);
    if (st) return st;
    double values[64];
    for (size_t v = 0; v < j->mesh.vert_count; v++) values[v] = slope(j->mesh.xyz + 3 * v);
    tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, values};
    st = tl_mesh_add_channel(mesh, &channel);
    if (!st) st = tl_model_build_mesh(ctx, mesh, check_model_path("fail"), &j->opts, &result);
    if (!st) {
        tl_build_release(ctx, &result);
        CHECK_EQ(remove(check_model_path("fail")), 0);
    } else
        CHECK(access(check_model_path("fail"), F_OK) != 0);
    tl_mesh_destroy(mesh);
    return st;
}

static void test_memory(void **state)
{
    (void)state;
    job j = {make_grid(3), check_model_opts(64, 20)};
    fail_alloc f;
    fail_alloc_open(&f, 1);
    for (int kind = 0; kind <= TL_PARTITION_VORONOI; kind++) {
        j.opts.partition = (tl_partition)kind;
        printf("%ld requests\n", fail_alloc_each(&f, build, &j));
    }
    fail_alloc_close(&f);
    make_release(&j.mesh);
}

/* Files of a mesh with channels on vertices and tets, and of a model without them. */
typedef struct addition {
    char model[64], input[64];
} addition;

static addition make_addition(tl_ctx *ctx)
{
    addition a;
    make_mesh grid = make_grid(4);
    tl_mesh *mesh = make_object(ctx, &grid, NULL);
    tl_build_opts opts = check_model_opts(100, 30);
    tl_build_result result;
    double *values = calloc(grid.tet_count + grid.vert_count, sizeof *values);
    snprintf(a.model, sizeof a.model, "/tmp/test_model_%ld_add.tlod", (long)getpid());
    snprintf(a.input, sizeof a.input, "/tmp/test_model_%ld_add.vtu", (long)getpid());
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, a.model, &opts, &result));
    tl_build_release(ctx, &result);
    for (size_t i = 0; i < grid.tet_count + grid.vert_count; i++) values[i] = sin((double)i);
    const tl_channel channels[] = {{"f", "", 1, TL_ON_VERTEX, TL_F64, values},
                                   {"g", "", 1, TL_ON_TET, TL_F64, values}};
    for (int c = 0; c < 2; c++) CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channels[c]));
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, a.input, NULL));
    free(values);
    tl_mesh_destroy(mesh);
    make_release(&grid);
    return a;
}

static uint32_t channels_of(tl_ctx *ctx, const char *path)
{
    tl_store *store;
    CHECK_OK(ctx, tl_store_open(ctx, path, &store));
    const uint32_t count = tl_store_get_head(store)->channel_count;
    tl_store_close(store);
    return count;
}

static tl_status add(tl_ctx *ctx, void *arg)
{
    const addition *a = arg;
    tl_build_result result;
    tl_status st = tl_model_add_channels(ctx, a->model, NULL, 0, a->input, NULL, NULL, &result);
    if (!st) tl_build_release(ctx, &result);
    return st;
}

/* A model is as it was after an addition that fails. */
static void test_adding(void **state)
{
    (void)state;
    fail_alloc f;
    tl_ctx *ctx;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    addition a = make_addition(ctx);
    fail_alloc_open(&f, 1);
    f.alloc.fail_at = 1000;
    CHECK_STATUS(add(f.ctx, &a), TL_ERR_MEMORY);
    CHECK_EQ(channels_of(ctx, a.model), 0);
    printf("%ld requests\n", fail_alloc_each(&f, add, &a));
    fail_alloc_close(&f);
    CHECK_EQ(channels_of(ctx, a.model), 2);
    remove(a.model);
    remove(a.input);
    tl_ctx_destroy(ctx);
}

static void test_folder(void **state)
{
    (void)state;
    job j = {make_grid(4), check_model_opts(100, 30)};
    tl_ctx *ctx;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    j.opts.folder = "/nowhere/at/all";
    CHECK_STATUS(build(ctx, &j), TL_ERR_IO);
    CHECK(strstr(tl_ctx_message(ctx), "/nowhere/at/all") != NULL);
    j.opts.folder = NULL;
    j.opts.partition = (tl_partition)3;
    CHECK_STATUS(build(ctx, &j), TL_ERR_ARG);
    j.opts.partition = TL_PARTITION_CLUSTER;
    j.opts.reduction = 2;
    CHECK_STATUS(build(ctx, &j), TL_ERR_ARG);
    j.opts.reduction = 0.5;
    j.opts.position_error = 0;
    CHECK_STATUS(build(ctx, &j), TL_ERR_ARG);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
    make_release(&j.mesh);
}

static bool stop(void *user, const char *stage, uint64_t done, uint64_t total)
{
    int *left = user;
    (void)stage;
    (void)done;
    (void)total;
    return (*left)-- > 0;
}

/* Ends at the first report of progress, the second, and so on, until none is left. */
static void test_cancelled(void **state)
{
    (void)state;
    job j = {make_grid(4), check_model_opts(100, 30)};
    bool done = false;
    for (int reports = 0; !done; reports++) {
        int left = reports;
        tl_ctx *ctx;
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        opts.progress = stop;
        opts.user = &left;
        CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
        tl_status st = build(ctx, &j);
        done = st == TL_OK;
        CHECK(done || st == TL_ERR_CANCELLED);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
    make_release(&j.mesh);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_memory), cmocka_unit_test(test_adding),
                                       cmocka_unit_test(test_folder),
                                       cmocka_unit_test(test_cancelled)};
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
