/* Models of small meshes: every level conforms, fills the same volume, and is as near to the
 * original as it says; the file is the same whatever the number of threads. */
#include "tetralod/cut.h"
#include "tetralod/measure.h"

#include "check_ctx.h"
#include "check_file.h"
#include "check_model.h"

static double bumps(const double x[3])
{
    return sin(5 * x[0]) * cos(4 * x[1]) + x[2] * x[2];
}

static tl_store *build(tl_ctx *ctx, const tl_mesh *mesh, const tl_build_opts *opts,
                       const char *name)
{
    tl_store *store;
    tl_build_result result;
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, check_model_path(name), opts, &result));
    CHECK_EQ(result.tets_in, tl_mesh_tet_count(mesh));
    CHECK(result.bytes > 0);
    CHECK(result.level_count > 0);
    tl_build_release(ctx, &result);
    CHECK_OK(ctx, tl_store_open(ctx, check_model_path(name), &store));
    CHECK_OK(ctx, tl_store_check(ctx, store, TL_CHECK_FULL));
    return store;
}

static void drop(tl_store *store, const char *name)
{
    tl_store_close(store);
    CHECK_EQ(remove(check_model_path(name)), 0);
}

/* Shape, volume and promises of one level against the original. */
static void check_level(tl_ctx *ctx, const tl_mesh *original, const tl_store *store, uint32_t level)
{
    const tl_store_head *head = tl_store_get_head(store);
    const tl_store_level *promise = &head->levels[level];
    tl_mesh *mesh = check_model_level(ctx, store, level);
    tl_mesh_stats before, after;
    tl_compare_result found;
    CHECK_EQ(tl_mesh_tet_count(mesh), promise->tets);
    CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FULL));
    CHECK_OK(ctx, tl_mesh_measure(ctx, original, &before));
    CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &after));
    CHECK_EQ(after.nonmanifold_faces, 0);
    CHECK_EQ(after.nonmanifold_edges, before.nonmanifold_edges);
    CHECK_EQ(after.components, before.components);
    CHECK_NEAR(after.volume, before.volume, 0.005 * before.volume);
    CHECK_OK(ctx, tl_mesh_compare(ctx, original, mesh, NULL, &found));
    printf("level %u: %zu tets\n", level, tl_mesh_tet_count(mesh));
    for (size_t i = 0; i < found.field_count; i++) {
        double width = found.fields[i].range[1] - found.fields[i].range[0];
        CHECK_BOUND(found.fields[i].name, found.fields[i].max,
                    promise->max_error[i] + 1e-9 * width);
    }
    double slack = 1e-9 * head->stats.diagonal;
    CHECK_BOUND("outside", found.outside_distance, promise->boundary_error + slack);
    CHECK_BOUND("boundary", found.boundary_hausdorff, promise->boundary_error + slack);
    /* tight where it is more than what storing moves */
    if (found.boundary_hausdorff > 4 * head->levels[0].boundary_error)
        CHECK_BOUND("promise", promise->boundary_error, 1.5 * found.boundary_hausdorff);
    tl_compare_release(ctx, &found);
    tl_mesh_destroy(mesh);
}

static void check_all(tl_ctx *ctx, const tl_mesh *mesh, const tl_build_opts *opts, const char *name,
                      uint32_t levels_least)
{
    tl_store *store = build(ctx, mesh, opts, name);
    const tl_store_head *head = tl_store_get_head(store);
    CHECK(head->level_count >= levels_least);
    CHECK_EQ(head->levels[0].tets, tl_mesh_tet_count(mesh));
    for (uint32_t l = 0; l < head->level_count; l++) check_level(ctx, mesh, store, l);
    tl_cut_check_opts cuts = tl_cut_check_opts_defaults();
    tl_cut_check_result found;
    cuts.cuts = 8;
    CHECK_OK(ctx, tl_cut_check(ctx, store, mesh, &cuts, &found));
    CHECK_EQ(found.cuts_tried, 8);
    CHECK_BOUND("nearest promise", found.channels[0].measured, found.channels[0].promised);
    CHECK(found.channels[0].measured > 0);
    tl_cut_check_release(ctx, &found);
    drop(store, name);
}

/* Random cuts of a model fit together; what their volumes are off by at most. */
static double check_cuts(tl_ctx *ctx, tl_store *store, const tl_mesh *mesh, uint32_t count)
{
    tl_cut_check_opts cuts = tl_cut_check_opts_defaults();
    tl_cut_check_result found;
    cuts.cuts = count;
    CHECK_OK(ctx, tl_cut_check(ctx, store, mesh, &cuts, &found));
    CHECK_EQ(found.cuts_tried, count);
    const double volume_off = found.volume_off;
    tl_cut_check_release(ctx, &found);
    return volume_off;
}

/* A check against data that the model was not made of names the vertex. */
static void test_other_data(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(9);
    tl_mesh *mesh = make_object(ctx, &m, bumps);
    tl_build_opts opts = check_model_opts(1000, 200);
    tl_store *store = build(ctx, mesh, &opts, "other");
    tl_cut_check_opts four = tl_cut_check_opts_defaults();
    four.cuts = 4;
    tl_cut_check_result found;
    CHECK_OK(ctx, tl_cut_check(ctx, store, mesh, &four, &found));
    tl_cut_check_release(ctx, &found);
    double *values = (double *)(uintptr_t)tl_mesh_channel(mesh, 0)->values;
    values[100] += 10;
    CHECK_STATUS(tl_cut_check(ctx, store, mesh, &four, &found), TL_ERR_DATA);
    CHECK(strstr(tl_ctx_message(ctx), "vertex 100") != NULL);
    tl_mesh_destroy(mesh);
    make_release(&m);
    m = make_grid(8);
    mesh = make_object(ctx, &m, bumps);
    CHECK_STATUS(tl_cut_check(ctx, store, mesh, &four, &found), TL_ERR_DATA);
    CHECK(strstr(tl_ctx_message(ctx), "another data set") != NULL);
    drop(store, "other");
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void test_grid(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(12);
    tl_mesh *mesh = make_object(ctx, &m, bumps);
    tl_build_opts opts = check_model_opts(1500, 250);
    check_all(ctx, mesh, &opts, "grid", 4);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void test_rough(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid_cavity(10);
    make_perturb(&m, 0.1 / 9 * 0.9, 7);
    make_shuffle(&m, 8);
    make_two_regions(&m);
    tl_mesh *mesh = make_object(ctx, &m, bumps);
    tl_build_opts opts = check_model_opts(1000, 200);
    check_all(ctx, mesh, &opts, "rough", 3);
    opts.lossless = true;
    check_all(ctx, mesh, &opts, "lossless", 3);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Only islands of one to three cells an axis, one cell apart: segments part many of them. */
static make_mesh make_islands(size_t n)
{
    enum { APART = 4 };
    make_mesh m = make_grid(n);
    uint64_t random = 5;
    uint8_t sizes[8][8][8][3];
    size_t cells = n - 1, tets = 0;
    for (size_t i = 0; i < sizeof sizes; i++)
        (&sizes[0][0][0][0])[i] = (uint8_t)(1 + make_random(&random) % (APART - 1));
    for (size_t cell = 0; cell < cells * cells * cells; cell++) {
        size_t at[3] = {cell % cells, cell / cells % cells, cell / cells / cells};
        const uint8_t *size = sizes[at[2] / APART][at[1] / APART][at[0] / APART];
        bool in = true;
        for (int i = 0; i < 3; i++) in = in && at[i] % APART < size[i];
        if (!in) continue;
        memmove(m.tets + 20 * tets, m.tets + 20 * cell, 20 * sizeof *m.tets);
        tets++;
    }
    m.tet_count = 5 * tets;
    return m;
}

/* Halves of an island or cavity in two segments must not close onto each other, and borders that
 * stay must not cost volume. */
static void test_islands(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_islands(29);
    make_perturb(&m, 0.15 / 28, 3);
    tl_mesh *mesh = make_object(ctx, &m, bumps);
    tl_build_opts opts = check_model_opts(1000, 200);
    tl_store *store = build(ctx, mesh, &opts, "islands");
    CHECK_BOUND("volume of islands", check_cuts(ctx, store, NULL, 200), 0.005);
    drop(store, "islands");
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* What readers do with inverted tets: each is turned alone, so that its neighbours lie on the same
 * side of their common faces. Levels have no more such faces, wherever patches part; what can't be
 * simplified at all is many patches without segments. */
static void test_turned(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    const double jitters[2] = {0.35, 0.9};
    for (int i = 0; i < 2; i++) {
        make_mesh m = make_islands(29);
        make_perturb(&m, jitters[i] / 28, 3);
        size_t turned = 0;
        for (size_t t = 0; t < m.tet_count; t++) {
            tl_lidx *q = m.tets + 4 * t, first = q[0];
            double x[4][3];
            for (int k = 0; k < 4; k++) memcpy(x[k], m.xyz + 3 * (size_t)q[k], sizeof x[k]);
            if (tl_tet_volume((const double(*)[3])x) >= 0) continue;
            q[0] = q[1];
            q[1] = first;
            turned++;
        }
        CHECK(turned > 0);
        tl_mesh *mesh = make_object(ctx, &m, bumps);
        tl_build_opts opts = check_model_opts(1000, 70);
        tl_store *store = build(ctx, mesh, &opts, "turned");
        check_cuts(ctx, store, NULL, 100);
        CHECK(tl_store_get_head(store)->root_patch_count > (i ? 128u : 0u));
        drop(store, "turned");
        tl_mesh_destroy(mesh);
        make_release(&m);
    }
    check_ctx_destroy(ctx);
}

/* Two vertices at one place with different values, in flat tets: the finest level has both, so that
 * nothing is off where nothing is rounded. */
static void test_twins(void **state)
{
    (void)state;
    enum { TWINS = 12 };
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(7);
    const size_t verts = m.vert_count, tets = m.tet_count;
    m.xyz = realloc(m.xyz, 3 * (verts + TWINS) * sizeof *m.xyz);
    m.tets = realloc(m.tets, 4 * (tets + TWINS) * sizeof *m.tets);
    CHECK(m.xyz != NULL && m.tets != NULL);
    for (size_t i = 0; i < TWINS; i++) {
        const tl_lidx *q = m.tets + 4 * (i * tets / TWINS), v = (tl_lidx)(verts + i);
        const tl_lidx flat[4] = {v, q[1], q[2], q[0]};
        memcpy(m.xyz + 3 * (size_t)v, m.xyz + 3 * (size_t)q[0], 3 * sizeof *m.xyz);
        memcpy(m.tets + 4 * (tets + i), flat, sizeof flat);
    }
    m.vert_count += TWINS;
    m.tet_count += TWINS;
    tl_mesh *mesh = make_object(ctx, &m, bumps);
    double *values = (double *)(uintptr_t)tl_mesh_channel(mesh, 0)->values;
    for (size_t i = 0; i < TWINS; i++) values[verts + i] += 5;
    tl_build_opts opts = check_model_opts(1000, 200);
    opts.lossless = true;
    tl_store *store = build(ctx, mesh, &opts, "twins");
    CHECK_BOUND("finest level with twins", tl_store_get_head(store)->channels[0].codec_error,
                1e-12);
    check_cuts(ctx, store, mesh, 8);
    drop(store, "twins");
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void test_threads(void **state)
{
    (void)state;
    make_mesh m = make_grid(11);
    make_perturb(&m, 0.005, 3);
    uint8_t *first = NULL;
    size_t first_bytes = 0;
    for (unsigned threads = 1; threads <= 3; threads++) {
        tl_ctx *ctx = check_ctx_create(threads);
        tl_mesh *mesh = make_object(ctx, &m, bumps);
        tl_build_opts opts = check_model_opts(1200, 200);
        tl_build_result result;
        size_t bytes;
        CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, check_model_path("threads"), &opts, &result));
        tl_build_release(ctx, &result);
        uint8_t *data = check_file_load(check_model_path("threads"), &bytes);
        if (!first) {
            first = data;
            first_bytes = bytes;
        } else {
            CHECK_EQ(bytes, first_bytes);
            CHECK(memcmp(data, first, bytes) == 0);
            free(data);
        }
        tl_mesh_destroy(mesh);
        check_ctx_destroy(ctx);
    }
    remove(check_model_path("threads"));
    free(first);
    make_release(&m);
}

/* Meshes that leave nothing to simplify, or are no volumes. */
static void test_odd(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    const double xyz[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1};
    const tl_lidx tets[] = {0, 1, 2, 3, 0, 1, 2, 4}, flat[] = {0, 1, 2, 1};
    tl_build_opts opts = check_model_opts(1000, 100);
    tl_build_result result;
    for (size_t count = 1; count <= 2; count++) { /* one tet; a doubled one with twins */
        tl_mesh *mesh;
        CHECK_OK(ctx, tl_mesh_create(ctx, xyz, 5, tets, count, &mesh));
        drop(build(ctx, mesh, &opts, "odd"), "odd");
        tl_mesh_destroy(mesh);
    }
    tl_mesh *mesh;
    CHECK_OK(ctx, tl_mesh_create(ctx, xyz, 5, flat, 1, &mesh));
    drop(build(ctx, mesh, &opts, "odd"), "odd");
    tl_mesh_destroy(mesh);
    CHECK_OK(ctx, tl_mesh_create(ctx, xyz, 5, tets, 0, &mesh));
    CHECK_STATUS(tl_model_build_mesh(ctx, mesh, check_model_path("odd"), &opts, &result),
                 TL_ERR_DATA);
    tl_mesh_destroy(mesh);
    make_mesh soup = make_soup(300, 2000, 5);
    mesh = make_object(ctx, &soup, bumps);
    drop(build(ctx, mesh, &opts, "soup"), "soup");
    tl_mesh_destroy(mesh);
    make_release(&soup);
    check_ctx_destroy(ctx);
}

/* Twenty channels of all kinds, constant ones and some without numbers among them. */
static void test_channels(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(11);
    tl_mesh *mesh = make_object(ctx, &m, bumps);
    uint64_t seed = 4;
    double *values = malloc((m.tet_count + m.vert_count) * 3 * sizeof *values);
    for (uint32_t c = 0; c < 20; c++) {
        char name[16];
        snprintf(name, sizeof name, "c%u", c);
        bool on_tet = c % 5 == 4;
        uint32_t k = c % 3 == 1 ? 3 : 1;
        size_t count = on_tet ? m.tet_count : m.vert_count;
        for (size_t i = 0; i < count * k; i++) {
            values[i] = c == 2   ? 7
                        : on_tet ? (double)(i % 9)
                                 : bumps(m.xyz + 3 * (i / k)) * (c + 1);
            if (c == 3 && make_random(&seed) % 50 == 0) values[i] = (double)NAN;
        }
        tl_channel channel = {
            name, "m", k, on_tet ? TL_ON_TET : TL_ON_VERTEX, c % 10 == 9 ? TL_I32 : TL_F64, values};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    }
    tl_build_opts opts = check_model_opts(2000, 400);
    drop(build(ctx, mesh, &opts, "channels"), "channels");
    opts.lossless = true;
    drop(build(ctx, mesh, &opts, "channels"), "channels");
    const char *some[] = {"f", "c1"};
    opts.channels = some;
    opts.channel_count = 2;
    tl_store *store = build(ctx, mesh, &opts, "channels");
    CHECK_EQ(tl_store_get_head(store)->channel_count, 2);
    drop(store, "channels");
    some[0] = "nothing";
    tl_build_result result;
    CHECK_STATUS(tl_model_build_mesh(ctx, mesh, check_model_path("channels"), &opts, &result),
                 TL_ERR_DATA);
    free(values);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* The mesh with one value changed must be refused with these words. */
static void refuse(tl_ctx *ctx, const tl_mesh *mesh, const char *words)
{
    tl_build_opts opts = check_model_opts(1000, 200);
    tl_build_result result;
    CHECK_STATUS(tl_model_build_mesh(ctx, mesh, check_model_path("refuse"), &opts, &result),
                 TL_ERR_DATA);
    CHECK(strstr(tl_ctx_message(ctx), words) != NULL);
    CHECK(access(check_model_path("refuse"), F_OK) != 0);
}

/* Numbers that no promise can be computed of. */
static void test_numbers_beyond(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    const struct {
        double place, value, scale;
        const char *words;
    } cases[] = {{(double)NAN, 1, 1, "no finite numbers"},
                 {(double)INFINITY, 1, 1, "no finite numbers"},
                 {1e120, 1, 1, "coordinates of up to 1e+120"},
                 {0.5, 1, 1e-90, "wide"},
                 {0.5, -1e200, 1, "'f' has values of up to 1e+200"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        make_mesh n = make_grid(5);
        for (size_t k = 0; k < 3 * n.vert_count; k++) n.xyz[k] *= cases[i].scale;
        if (cases[i].scale == 1) n.xyz[3 * 62] = cases[i].place;
        tl_mesh *mesh = make_object(ctx, &n, NULL);
        double *values = calloc(n.vert_count, sizeof *values);
        values[7] = cases[i].value;
        tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, values};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        refuse(ctx, mesh, cases[i].words);
        free(values);
        tl_mesh_destroy(mesh);
        make_release(&n);
    }
    check_ctx_destroy(ctx);
}

/* Values that are not finite stay where they are, and every promise holds around them. */
static void test_no_values(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(11);
    tl_mesh *mesh = make_object(ctx, &m, bumps);
    double *values = (double *)(uintptr_t)tl_mesh_channel(mesh, 0)->values;
    values[3] = (double)INFINITY;
    values[100] = (double)-INFINITY;
    values[5 + 11 * (5 + 11 * 5)] = (double)NAN;
    tl_build_opts opts = check_model_opts(600, 150);
    tl_store *store = build(ctx, mesh, &opts, "no_values");
    tl_cut_check_opts cuts = tl_cut_check_opts_defaults();
    tl_cut_check_result found;
    cuts.cuts = 24;
    CHECK(tl_store_get_head(store)->level_count > 2);
    CHECK_OK(ctx, tl_cut_check(ctx, store, mesh, &cuts, &found));
    tl_cut_check_release(ctx, &found);
    drop(store, "no_values");
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grid),
        cmocka_unit_test(test_rough),
        cmocka_unit_test(test_turned),
        cmocka_unit_test(test_twins),
        cmocka_unit_test(test_islands),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_odd),
        cmocka_unit_test(test_channels),
        cmocka_unit_test(test_other_data),
        cmocka_unit_test(test_no_values),
        cmocka_unit_test(test_numbers_beyond),
    };
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
