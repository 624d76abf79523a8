/* Surfaces of cuts, patch by patch: random cuts of models of several meshes; what is decoded; many
 * threads; failures. tests/test_long_extract_slices.c tries more of them. */
#include "check.h"
#include "check_ctx.h"

#include "store/store_format.h"

#include "check_slices.h"
#include "fail_alloc.h"

/* Slices that are updated together. */
enum { TOGETHER = 3 };

static double ball(const double x[3])
{
    double d[3] = {x[0] - 0.5, x[1] - 0.45, x[2] - 0.55};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

static double waves(const double x[3])
{
    return sin(7 * x[0]) * cos(5 * x[1]) + sin(6 * x[2]);
}

static void random_cuts(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    for (int i = 0; i < 3; i++) {
        slices_case c;
        make_mesh m = i == 1 ? make_grid_cavity(16) : make_grid(16);
        if (i == 2) make_perturb(&m, 0.1 / 16, 3);
        make_shuffle(&m, 5);
        slices_open(&c, ctx, make_object(ctx, &m, i == 1 ? waves : ball), 17 + (uint64_t)i);
        slices_check(&c, 5, 0.4);
        slices_check(&c, 5, 0.7);
        slices_say(&c);
        slices_close(&c);
        make_release(&m);
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void open_ball(slices_case *c, tl_ctx *ctx)
{
    make_mesh m = make_grid(16);
    slices_open(c, ctx, make_object(ctx, &m, ball), 1);
    make_release(&m);
}

static const uint32_t *cut_at(tl_cut *cut, uint32_t level, size_t *count)
{
    tl_cut_query query = tl_cut_query_defaults();
    query.level = level;
    CHECK_STATUS(tl_cut_update(cut, &query), TL_OK);
    return tl_cut_patches(cut, count);
}

/* Patches that the value misses are not read; those that were there are not decoded again; patches
 * that come back and other values give what was there before. */
static void decodes_what_changed(void **state)
{
    (void)state;
    static const double values[2] = {0.3, 0.1}, nowhere = 7;
    slices_case c;
    tl_ctx *ctx = check_ctx_create(2);
    tl_cut *cut = NULL;
    tl_polydata *first = NULL, *again = NULL;
    size_t fine_count, coarse_count;
    open_ball(&c, ctx);
    CHECK_OK(ctx, tl_cut_create(ctx, c.store, &cut));
    tl_slices *slices = slices_create(&c, ctx, values, 2);
    const uint32_t *patches = cut_at(cut, 0, &fine_count);
    CHECK_OK(ctx, tl_slices_update(slices, patches, fine_count));
    tl_slices_state fine = tl_slices_get_state(slices);
    CHECK(fine.decoded > 0 && fine.decoded < fine_count / 2);
    CHECK_EQ(fine.patches, fine.decoded);
    CHECK_EQ(fine.patches + fine.passed_over, fine_count);
    CHECK_OK(ctx, tl_slices_join(slices, &first));
    CHECK_EQ(first->cell_count, fine.triangles);
    uint64_t read = tl_store_bytes_read(c.store);
    CHECK_OK(ctx, tl_slices_update(slices, patches, fine_count));
    CHECK_EQ(tl_slices_get_state(slices).decoded, 0);
    CHECK_OK(ctx, tl_slices_set_values(slices, &nowhere, 1));
    CHECK_OK(ctx, tl_slices_update(slices, patches, fine_count));
    CHECK_EQ(tl_slices_get_state(slices).passed_over, fine_count);
    CHECK_EQ(tl_store_bytes_read(c.store), read);
    CHECK_OK(ctx, tl_slices_set_values(slices, values, 2));
    patches = cut_at(cut, 1, &coarse_count);
    CHECK_OK(ctx, tl_slices_update(slices, patches, coarse_count));
    patches = cut_at(cut, 0, &fine_count);
    CHECK_OK(ctx, tl_slices_update(slices, patches, fine_count));
    CHECK_OK(ctx, tl_slices_join(slices, &again));
    slices_same(first, again);
    tl_polydata_destroy(ctx, again);
    tl_polydata_destroy(ctx, first);
    tl_slices_destroy(slices);
    tl_cut_destroy(cut);
    slices_close(&c);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Two values, one with the channel carried, and a plane that carries it. */
static void create_together(const slices_case *c, tl_slices *slices[TOGETHER])
{
    static const double values[TOGETHER] = {0.3, 0.35, 0};
    for (int i = 0; i < TOGETHER; i++) {
        tl_slices_opts opts = tl_slices_opts_defaults();
        if (i < 2) opts.channel = c->number;
        opts.plane[2] = 0.4;
        opts.values = &values[i];
        opts.value_count = 1;
        opts.channels = &c->number;
        opts.channel_count = i > 0;
        CHECK_OK(c->ctx, tl_slices_create(c->ctx, c->store, &opts, &slices[i]));
    }
}

static void same_joined(tl_ctx *ctx, const tl_slices *slices, const tl_polydata *expected)
{
    tl_polydata *p = NULL;
    CHECK_OK(ctx, tl_slices_join(slices, &p));
    slices_same(p, expected);
    tl_polydata_destroy(ctx, p);
}

/* Bytes of the patches that one of them meets and none did before (known, [patch_count of the
 * model]), each with its only channel; *fresh is how many. */
static uint64_t bytes_of_new(const slices_case *c, tl_slices *const slices[TOGETHER],
                             const uint32_t *patches, size_t count, uint8_t *known, size_t *fresh)
{
    uint64_t bytes = 0;
    uint8_t *now = calloc(c->head->patch_count, 1);
    *fresh = 0;
    for (size_t i = 0; i < count; i++) {
        tl_patch_info info;
        bool is_new = false;
        for (int k = 0; k < TOGETHER; k++) {
            const uint8_t bit = (uint8_t)(1 << k);
            if (!tl_slices_patch(slices[k], patches[i])) continue;
            now[patches[i]] |= bit;
            is_new |= !(known[patches[i]] & bit);
        }
        if (!is_new) continue;
        CHECK_OK(c->ctx, tl_store_patch(c->ctx, c->store, patches[i], &info));
        bytes +=
            tli_store_blob_bytes(info.topology_bytes) + tli_store_blob_bytes(info.channel_bytes[0]);
        ++*fresh;
    }
    memcpy(known, now, c->head->patch_count);
    free(now);
    return bytes;
}

/* Several slices that go over to cuts together have what each has alone; a patch is read once for
 * all of them. */
static void together_as_alone(void **state)
{
    (void)state;
    slices_case c;
    tl_ctx *ctx = check_ctx_create(2);
    tl_cut *cut = NULL;
    tl_slices *together[TOGETHER], *alone[TOGETHER];
    size_t all = 0, each = 0;
    open_ball(&c, ctx);
    CHECK_EQ(c.head->channel_count, 1);
    uint8_t *known = calloc(c.head->patch_count, 1);
    CHECK_OK(ctx, tl_cut_create(ctx, c.store, &cut));
    create_together(&c, together);
    create_together(&c, alone);
    for (uint32_t round = 0; round < 8; round++) {
        size_t count, decoded, fresh;
        const uint32_t *patches = cut_at(cut, (3 * round + 1) % 4, &count);
        for (int k = 0; k < TOGETHER; k++) { /* reads the tables and pages that are needed */
            CHECK_OK(ctx, tl_slices_update(alone[k], patches, count));
            each += tl_slices_get_state(alone[k]).decoded;
        }
        const uint64_t before = tl_store_bytes_read(c.store);
        CHECK_OK(ctx, tl_slices_update_all(together, TOGETHER, patches, count, &decoded));
        const uint64_t read = tl_store_bytes_read(c.store) - before;
        CHECK_EQ(read, bytes_of_new(&c, together, patches, count, known, &fresh));
        CHECK_EQ(decoded, fresh);
        all += decoded;
        for (int k = 0; k < TOGETHER; k++) {
            tl_polydata *expected = NULL;
            CHECK_OK(ctx, tl_slices_join(alone[k], &expected));
            CHECK(expected->cell_count > 0);
            same_joined(ctx, together[k], expected);
            tl_polydata_destroy(ctx, expected);
        }
    }
    printf("%zu patches for %zu\n", all, each);
    CHECK(all > 50 && 4 * all < 3 * each);
    for (int k = 0; k < TOGETHER; k++) {
        tl_slices_destroy(together[k]);
        tl_slices_destroy(alone[k]);
    }
    tl_cut_destroy(cut);
    free(known);
    slices_close(&c);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Normals are those of the welded mesh where its tets are all there: a level that one value cuts
 * everywhere. */
static void normals_of_the_mesh(void **state)
{
    (void)state;
    slices_case c;
    tl_ctx *ctx = check_ctx_create(1);
    tl_cut *cut = NULL;
    tl_mesh *mesh = NULL;
    double values[TL_SLICE_VALUES_MAX];
    size_t count, channel;
    open_ball(&c, ctx);
    channel = c.number;
    for (int i = 0; i < 100; i++) values[i] = 0.01 * i;
    CHECK_OK(ctx, tl_cut_create(ctx, c.store, &cut));
    const uint32_t *patches = cut_at(cut, 1, &count);
    tl_slices *slices = slices_create(&c, ctx, values, 100);
    CHECK_OK(ctx, tl_slices_update(slices, patches, count));
    CHECK_EQ(tl_slices_get_state(slices).passed_over, 0);
    CHECK_OK(ctx, tl_cut_mesh(cut, &channel, 1, &mesh));
    const tl_channel *field = tl_mesh_channel(mesh, 0);
    double *gradients = malloc(tl_mesh_vert_count(mesh) * 3 * sizeof *gradients);
    tl_slice_opts opts = tl_slice_opts_defaults();
    tl_polydata *own = NULL, *plain = NULL;
    CHECK_OK(ctx, tl_mesh_gradient(ctx, mesh, field, gradients));
    opts.values = values;
    opts.value_count = 100;
    opts.gradients = gradients;
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, field->values, &opts, &plain));
    CHECK_OK(ctx, tl_slices_join(slices, &own));
    CHECK_EQ(own->cell_count, plain->cell_count);
    double sums[2][3] = {{0}}; /* the vertices come in another order */
    for (size_t i = 0; i < own->vert_count; i++)
        for (size_t k = 0; k < 3; k++) {
            sums[0][k] += (double)own->normals[3 * i + k] * own->xyz[3 * i + k];
            sums[1][k] += (double)plain->normals[3 * i + k] * plain->xyz[3 * i + k];
        }
    for (size_t k = 0; k < 3; k++)
        CHECK_NEAR(sums[0][k], sums[1][k], 1e-7 * (double)own->vert_count);
    tl_polydata_destroy(ctx, plain);
    tl_polydata_destroy(ctx, own);
    free(gradients);
    tl_mesh_destroy(mesh);
    tl_slices_destroy(slices);
    tl_cut_destroy(cut);
    slices_close(&c);
    tl_ctx_destroy(ctx);
}

/* The plane cuts of a cube have its area; any number of threads gives the same bytes. */
static void planes_and_threads(void **state)
{
    (void)state;
    slices_case c;
    tl_ctx *ctx[2] = {check_ctx_create(1), check_ctx_create(3)};
    tl_polydata *p[2];
    open_ball(&c, ctx[0]);
    for (int i = 0; i < 2; i++) {
        tl_slices *slices = NULL;
        tl_cut *cut = NULL;
        size_t count;
        static const double value = 0;
        tl_slices_opts opts = tl_slices_opts_defaults();
        opts.plane[2] = 0.4;
        opts.values = &value;
        opts.value_count = 1;
        opts.channels = &c.number;
        opts.channel_count = 1;
        CHECK_OK(ctx[i], tl_cut_create(ctx[i], c.store, &cut));
        CHECK_OK(ctx[i], tl_slices_create(ctx[i], c.store, &opts, &slices));
        const uint32_t *patches = cut_at(cut, 0, &count);
        CHECK_OK(ctx[i], tl_slices_update(slices, patches, count));
        CHECK(tl_slices_get_state(slices).passed_over > count / 2);
        CHECK_OK(ctx[i], tl_slices_join(slices, &p[i]));
        CHECK_NEAR(tl_polydata_size(p[i]), 1, 1e-4);
        tl_slices_destroy(slices);
        tl_cut_destroy(cut);
    }
    slices_same(p[0], p[1]);
    for (int i = 0; i < 2; i++) tl_polydata_destroy(ctx[i], p[i]);
    tl_store_close(c.store); /* before the second context, which loaded pages */
    c.store = NULL;
    slices_close(&c);
    for (int i = 2; i-- > 0;) tl_ctx_destroy(ctx[i]);
}

static void wrong_options(void **state)
{
    (void)state;
    static const double value = 0.5, bad = (double)NAN;
    static const uint32_t none = 9, twice[2] = {0, 0};
    slices_case c;
    tl_ctx *ctx = check_ctx_create(1);
    tl_slices *slices = NULL;
    open_ball(&c, ctx);
    tl_slices_opts opts = tl_slices_opts_defaults();
    CHECK_STATUS(tl_slices_create(ctx, c.store, &opts, &slices), TL_ERR_ARG); /* no values */
    opts.values = &bad;
    opts.value_count = 1;
    CHECK_STATUS(tl_slices_create(ctx, c.store, &opts, &slices), TL_ERR_ARG);
    opts.values = &value;
    opts.channel = none;
    CHECK_STATUS(tl_slices_create(ctx, c.store, &opts, &slices), TL_ERR_ARG);
    opts.channel = TL_NONE;
    opts.channels = &none;
    opts.channel_count = 1;
    CHECK_STATUS(tl_slices_create(ctx, c.store, &opts, &slices), TL_ERR_ARG);
    opts.channel_count = 0;
    opts.plane[5] = 0;
    CHECK_STATUS(tl_slices_create(ctx, c.store, &opts, &slices), TL_ERR_ARG);
    CHECK(slices == NULL);
    opts.plane[5] = 1;
    CHECK_OK(ctx, tl_slices_create(ctx, c.store, &opts, &slices));
    CHECK_STATUS(tl_slices_update(slices, &c.head->patch_count, 1), TL_ERR_ARG);
    CHECK_STATUS(tl_slices_update(slices, twice, 2), TL_ERR_ARG);
    CHECK_EQ(tl_slices_get_state(slices).patches, 0);
    tl_store *store = NULL;
    tl_slices *pair[2] = {slices, slices};
    const uint32_t patch = 0;
    CHECK_STATUS(tl_slices_update_all(pair, 2, &patch, 1, NULL), TL_ERR_ARG);
    CHECK_OK(ctx, tl_store_open(ctx, check_model_path("slices"), &store));
    CHECK_OK(ctx, tl_slices_create(ctx, store, &opts, &pair[1]));
    CHECK_STATUS(tl_slices_update_all(pair, 2, &patch, 1, NULL), TL_ERR_ARG);
    CHECK_OK(ctx, tl_slices_update_all(NULL, 0, &patch, 1, NULL));
    CHECK_EQ(tl_slices_get_state(slices).passed_over, 0);
    tl_slices_destroy(pair[1]);
    tl_store_close(store);
    tl_slices_destroy(slices);
    slices_close(&c);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static tl_status slice_model(tl_ctx *ctx, void *arg)
{
    tl_store *store = NULL;
    tl_cut *cut = NULL;
    tl_slices *slices = NULL;
    tl_polydata *p = NULL;
    size_t count = 0;
    static const double value = 0.3;
    static const uint32_t channel = 0;
    tl_slices_opts opts = tl_slices_opts_defaults();
    tl_cut_query query = tl_cut_query_defaults();
    opts.channel = 0;
    opts.values = &value;
    opts.value_count = 1;
    opts.channels = &channel;
    opts.channel_count = 1;
    tl_status st = tl_store_open(ctx, arg, &store);
    if (!st) st = tl_cut_create(ctx, store, &cut);
    if (!st) st = tl_slices_create(ctx, store, &opts, &slices);
    for (query.level = 3; !st && query.level >= 2; query.level--) {
        st = tl_cut_update(cut, &query);
        const uint32_t *patches = tl_cut_patches(cut, &count);
        if (!st) st = tl_slices_update(slices, patches, count);
    }
    if (!st) st = tl_slices_join(slices, &p);
    tl_polydata_destroy(ctx, p);
    tl_slices_destroy(slices);
    tl_cut_destroy(cut);
    tl_store_close(store);
    return st;
}

static void failing_memory(void **state)
{
    (void)state;
    slices_case c;
    fail_alloc f;
    char path[256];
    tl_ctx *ctx = check_ctx_create(1);
    open_ball(&c, ctx);
    snprintf(path, sizeof path, "%s", check_model_path("slices"));
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, slice_model, path) > 50);
    fail_alloc_close(&f);
    slices_close(&c);
    tl_ctx_destroy(ctx);
}

/* Whether all are as expected. */
static void same_together(tl_ctx *ctx, tl_slices *const slices[TOGETHER],
                          tl_polydata *const expected[TOGETHER])
{
    for (int k = 0; k < TOGETHER; k++) same_joined(ctx, slices[k], expected[k]);
}

/* An update of several that fails for lack of memory, at any place, leaves what was there, and what
 * comes after it: the same patches, half of them, others. */
static void failed_update_changes_nothing(void **state)
{
    (void)state;
    slices_case c;
    fail_alloc f;
    tl_store *store = NULL;
    tl_cut *cut = NULL;
    uint32_t *lists[2];
    size_t counts[2];
    tl_slices *slices[TOGETHER];
    tl_polydata *expected[2][TOGETHER];
    tl_ctx *ctx = check_ctx_create(1);
    open_ball(&c, ctx);
    fail_alloc_open(&f, 2);
    CHECK_OK(f.ctx, tl_store_open(f.ctx, check_model_path("slices"), &store));
    CHECK_OK(f.ctx, tl_cut_create(f.ctx, store, &cut));
    slices_case own = c;
    own.ctx = f.ctx;
    own.store = store;
    for (uint32_t i = 0; i < 2; i++) {
        const uint32_t *patches = cut_at(cut, 4 - i, &counts[i]);
        lists[i] = malloc(counts[i] * sizeof *lists[i]);
        memcpy(lists[i], patches, counts[i] * sizeof *patches);
        create_together(&own, slices);
        for (int k = 0; k < TOGETHER; k++) {
            CHECK_OK(f.ctx, tl_slices_update(slices[k], lists[i], counts[i]));
            CHECK_OK(f.ctx, tl_slices_join(slices[k], &expected[i][k]));
            tl_slices_destroy(slices[k]);
        }
    }
    size_t failures = 0;
    for (tl_status st = TL_ERR_MEMORY; st; failures += st != TL_OK) {
        tl_slices_state before[TOGETHER];
        create_together(&own, slices);
        CHECK_OK(f.ctx, tl_slices_update_all(slices, TOGETHER, lists[0], counts[0], NULL));
        for (int k = 0; k < TOGETHER; k++) before[k] = tl_slices_get_state(slices[k]);
        f.alloc.fail_at = f.alloc.requests + failures + 1;
        st = tl_slices_update_all(slices, TOGETHER, lists[1], counts[1], NULL);
        f.alloc.fail_at = 0;
        if (st) {
            CHECK_STATUS(st, TL_ERR_MEMORY);
            for (int k = 0; k < TOGETHER; k++) {
                const tl_slices_state after = tl_slices_get_state(slices[k]);
                CHECK(!memcmp(&before[k], &after, sizeof after));
            }
            same_together(f.ctx, slices, expected[0]);
            CHECK_OK(f.ctx, tl_slices_update_all(slices, 2, lists[0], counts[0] / 2, NULL));
            CHECK_OK(f.ctx, tl_slices_update_all(slices, 2, lists[0], counts[0], NULL));
            same_together(f.ctx, slices, expected[0]);
            CHECK_OK(f.ctx, tl_slices_update_all(slices, TOGETHER, lists[1], counts[1], NULL));
        }
        same_together(f.ctx, slices, expected[1]);
        for (int k = 0; k < TOGETHER; k++) tl_slices_destroy(slices[k]);
    }
    printf("%zu failures, %zu and %zu patches\n", failures, counts[0], counts[1]);
    CHECK(failures > 50);
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < TOGETHER; k++) tl_polydata_destroy(f.ctx, expected[i][k]);
        free(lists[i]);
    }
    tl_cut_destroy(cut);
    tl_store_close(store);
    fail_alloc_close(&f);
    slices_close(&c);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_cuts),        cmocka_unit_test(decodes_what_changed),
        cmocka_unit_test(together_as_alone),  cmocka_unit_test(normals_of_the_mesh),
        cmocka_unit_test(planes_and_threads), cmocka_unit_test(wrong_options),
        cmocka_unit_test(failing_memory),     cmocka_unit_test(failed_update_changes_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
