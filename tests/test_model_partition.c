/* The partitions of levels: every kind gives models that keep their promises, the same for any
 * number of threads; cells balance and are the nearest ones; no patch is a sliver. */
#include "check_ctx.h"
#include "model/model.h"
#include "tetralod/cut.h"

#include "check_model.h"

static const tl_partition KINDS[] = {TL_PARTITION_CLUSTER, TL_PARTITION_OCTREE,
                                     TL_PARTITION_VORONOI};

static double bumps(const double x[3])
{
    return sin(5 * x[0]) * cos(4 * x[1]) + x[2] * x[2];
}

static uint64_t hash_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    uint64_t hash = 14695981039346656037u;
    CHECK(file != NULL);
    for (int c; (c = fgetc(file)) != EOF;) hash = (hash ^ (uint64_t)c) * 1099511628211u;
    fclose(file);
    return hash;
}

/* Builds the mesh and proves the model against it; returns its store. */
static tl_store *build(tl_ctx *ctx, const tl_mesh *mesh, const tl_build_opts *opts, uint32_t cuts)
{
    tl_store *store;
    tl_build_result result;
    tl_cut_check_opts check = tl_cut_check_opts_defaults();
    tl_cut_check_result found;
    check.cuts = cuts;
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, check_model_path("part"), opts, &result));
    tl_build_release(ctx, &result);
    CHECK_OK(ctx, tl_store_open(ctx, check_model_path("part"), &store));
    CHECK_OK(ctx, tl_store_check(ctx, store, TL_CHECK_FULL));
    CHECK_OK(ctx, tl_cut_check(ctx, store, mesh, &check, &found));
    CHECK_EQ(found.cuts_tried, cuts);
    tl_cut_check_release(ctx, &found);
    return store;
}

/* Segments are neither far too large nor, where there are several, tiny; patches no slivers. */
static void check_sizes(tl_ctx *ctx, const tl_store *store, const tl_build_opts *opts)
{
    const tl_store_head *head = tl_store_get_head(store);
    uint32_t slivers = 0;
    for (uint32_t s = 0; s < head->segment_count; s++) {
        tl_segment_info info;
        CHECK_OK(ctx, tl_store_segment(ctx, store, s, &info));
        CHECK(info.input_tets <= 2 * (uint64_t)opts->segment_tets);
        if (head->levels[info.level].segment_count > 1)
            CHECK(info.input_tets >= opts->segment_tets / 5);
    }
    for (uint32_t p = 0; p < head->patch_count; p++) {
        tl_patch_info info;
        CHECK_OK(ctx, tl_store_patch(ctx, store, p, &info));
        CHECK(info.tet_count <= opts->patch_tets);
        slivers +=
            head->levels[info.level].patch_count > 1 && info.tet_count < opts->patch_tets / 8;
    }
    CHECK_EQ(slivers, 0);
}

static void test_models(void **state)
{
    (void)state;
    make_mesh m = make_grid(15);
    make_perturb(&m, 0.005, 3);
    for (size_t k = 0; k < sizeof KINDS / sizeof *KINDS; k++) {
        tl_build_opts opts = check_model_opts(1200, 200);
        uint64_t first = 0;
        opts.partition = KINDS[k];
        for (unsigned threads = 1; threads <= 3; threads += 2) {
            tl_ctx *ctx = check_ctx_create(threads);
            tl_mesh *mesh = make_object(ctx, &m, bumps);
            tl_store *store = build(ctx, mesh, &opts, threads == 1 ? 8 : 0);
            CHECK(tl_store_get_head(store)->level_count > 4);
            check_sizes(ctx, store, &opts);
            tl_store_close(store);
            tl_mesh_destroy(mesh);
            check_ctx_destroy(ctx);
            uint64_t hash = hash_file(check_model_path("part"));
            if (threads == 1) first = hash;
            CHECK(hash == first);
            CHECK_EQ(remove(check_model_path("part")), 0);
        }
    }
    make_release(&m);
}

/* Grids side by side that do not touch; the smallest are single tets. */
static make_mesh make_islands(void)
{
    make_mesh grid = make_grid(4), all = make_room(6 * grid.vert_count + 8, 6 * grid.tet_count + 2);
    size_t v = 0, t = 0;
    for (int i = 0; i < 6; i++) {
        for (size_t k = 0; k < 4 * grid.tet_count; k++)
            all.tets[4 * t + k] = grid.tets[k] + (tl_lidx)v;
        for (size_t k = 0; k < 3 * grid.vert_count; k++)
            all.xyz[3 * v + k] = grid.xyz[k] + (k % 3 == 0 ? 2.5 * i : 0);
        t += grid.tet_count;
        v += grid.vert_count;
    }
    for (int i = 0; i < 2; i++, t++)
        for (int c = 0; c < 4; c++, v++) {
            for (int k = 0; k < 3; k++) all.xyz[3 * v + (size_t)k] = -2 - 2 * i + (c == k + 1);
            all.tets[4 * t + (size_t)c] = (tl_lidx)v;
        }
    all.vert_count = v;
    all.tet_count = t;
    make_release(&grid);
    return all;
}

static void test_small(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh islands = make_islands();
    for (size_t k = 0; k < sizeof KINDS / sizeof *KINDS; k++)
        for (size_t tets = islands.tet_count - 1; tets < islands.tet_count + 1; tets++)
            for (uint32_t size = 64; size <= 512; size *= 2) {
                make_mesh part = islands;
                tl_build_opts opts = check_model_opts(size, size / 4);
                part.tets = islands.tets + 4 * (islands.tet_count - tets);
                part.tet_count = tets;
                opts.partition = KINDS[k];
                opts.boundary_error = 1e-3; /* of small parts it is much */
                tl_mesh *mesh = make_object(ctx, &part, bumps);
                tl_store *store = build(ctx, mesh, &opts, 4);
                tl_store_close(store);
                CHECK_EQ(remove(check_model_path("part")), 0);
                tl_mesh_destroy(mesh);
            }
    for (size_t k = 0; k < sizeof KINDS / sizeof *KINDS; k++)
        for (size_t tets = 1; tets <= 20; tets += tets < 4 ? 1 : 8) { /* the last ones */
            make_mesh part = islands;
            tl_build_opts opts = tl_build_opts_defaults();
            part.tets = islands.tets + 4 * (islands.tet_count - tets);
            part.tet_count = tets;
            opts.partition = KINDS[k];
            tl_mesh *mesh = make_object(ctx, &part, bumps);
            tl_store *store = build(ctx, mesh, &opts, 4);
            CHECK_EQ(tl_store_get_head(store)->levels[0].tets, tets);
            tl_store_close(store);
            CHECK_EQ(remove(check_model_path("part")), 0);
            tl_mesh_destroy(mesh);
        }
    make_release(&islands);
    check_ctx_destroy(ctx);
}

/* Samples that are a thousand times denser at one side, flat in z there. */
static void sample(tli_sampling *samplings, size_t count)
{
    uint64_t seed = 5;
    for (size_t p = 0; p < count; p++) {
        double at = (p + 0.5) / count, x = exp2(10 * (at - 1)), wide = 6 * x / count;
        for (int i = 0; i < TLI_SAMPLES; i++) {
            samplings[p].at[i][0] = x + wide * make_uniform(&seed);
            samplings[p].at[i][1] = 0.2 * make_uniform(&seed);
            samplings[p].at[i][2] = 0.02 * make_uniform(&seed);
        }
        const double shape[6] = {1, 1, 0.01 + at, 0, 0, 0};
        memcpy(samplings[p].shape, shape, sizeof shape);
    }
}

static double distance2(const tli_seed *s, const double x[3])
{
    const double d[3] = {x[0] - s->at[0], x[1] - s->at[1], x[2] - s->at[2]};
    return s->metric[0] * d[0] * d[0] + s->metric[1] * d[1] * d[1] + s->metric[2] * d[2] * d[2] +
           2 * (s->metric[3] * d[0] * d[1] + s->metric[4] * d[0] * d[2] +
                s->metric[5] * d[1] * d[2]);
}

static void test_voronoi(void **state)
{
    enum { PATCHES = 600, SEEDS = 37 };
    tli_sampling *samplings = malloc(PATCHES * sizeof *samplings);
    const tli_sampling *list[PATCHES];
    double weights[PATCHES], held[SEEDS] = {0}, most = 0, least = INFINITY;
    tli_seed *seeds;
    tl_ctx *ctx = check_ctx_create(1);
    (void)state;
    sample(samplings, PATCHES);
    for (int p = 0; p < PATCHES; p++) {
        list[p] = &samplings[p];
        weights[p] = 1;
    }
    CHECK_OK(ctx, tli_voronoi_create(ctx, list, weights, PATCHES, SEEDS, &seeds));
    for (int p = 0; p < PATCHES; p++) {
        uint32_t near[SEEDS], cells[TLI_SAMPLES];
        tli_voronoi_find(seeds, SEEDS, (const double(*)[3])samplings[p].at, TLI_SAMPLES, near,
                         cells);
        for (int i = 0; i < TLI_SAMPLES; i++) {
            for (int s = 0; s < SEEDS; s++)
                CHECK(distance2(&seeds[s], samplings[p].at[i]) >=
                      distance2(&seeds[cells[i]], samplings[p].at[i]) * (1 - 1e-12));
            held[cells[i]] += 1;
        }
    }
    for (int s = 0; s < SEEDS; s++) {
        most = fmax(most, held[s] * SEEDS / (PATCHES * TLI_SAMPLES));
        least = fmin(least, held[s] * SEEDS / (PATCHES * TLI_SAMPLES));
    }
    CHECK_BOUND("fullest cell over the mean", most, 1.4);
    CHECK_BOUND("mean over the emptiest cell", 1 / least, 1 / 0.6);
    tl_mem_free(ctx, seeds);
    free(samplings);
    check_ctx_destroy(ctx);
}

/* Parts stay within cells but for slivers, which go along with a neighbour. */
static void test_split(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(9);
    tl_mesh *mesh = make_object(ctx, &m, bumps);
    const size_t n = mesh->tet_count;
    uint32_t *cell_of = malloc(n * sizeof *cell_of), *was = malloc(n * sizeof *was);
    uint32_t *part = malloc(n * sizeof *part), *cells = NULL;
    size_t count, sizes[64] = {0};
    tl_lidx *opposite;
    CHECK_OK(ctx, tl_mesh_adjacency(ctx, mesh, &opposite, NULL));
    for (size_t t = 0; t < n; t++) was[t] = cell_of[t] = t < n / 2 ? 900 : t < n / 2 + 10 ? 7 : 33;
    CHECK_OK(ctx, tli_split_cells(ctx, mesh, opposite, cell_of, 400, part, &count, &cells));
    CHECK(count >= n / 400 && count < 64);
    for (size_t t = 0; t < n; t++) {
        CHECK(part[t] < count);
        sizes[part[t]]++;
        if (was[t] != 7) CHECK_EQ(cells[part[t]], was[t]);
        if (was[t] == 7) CHECK(cells[part[t]] == 900 || cells[part[t]] == 33);
    }
    for (size_t p = 0; p < count; p++) CHECK(sizes[p] > 200 && sizes[p] <= 400);
    tl_mem_free(ctx, cells);
    tl_mem_free(ctx, opposite);
    free(part);
    free(was);
    free(cell_of);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_models),
        cmocka_unit_test(test_small),
        cmocka_unit_test(test_voronoi),
        cmocka_unit_test(test_split),
    };
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
