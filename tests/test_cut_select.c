/* Cuts through random graphs: the rule of selection by brute force, every path crossed once, no
 * memory of the cuts before, budgets, views, residency. */
#include "check.h"

#include "tetralod/cut.h"

#include "make_model.h"

typedef struct fixture {
    tl_ctx *ctx;
    tl_store *store;
    const tl_store_head *head;
    char path[64];
    uint8_t *drawn;          /* [patch_count] */
    uint32_t *fewest, *most; /* [patch_count] drawn patches on a path from here to a root */
    uint64_t seed;
} fixture;

static void open_model(fixture *f, uint32_t leaves, uint64_t seed)
{
    make_model m = make_graph(leaves, seed);
    *f = (fixture){.seed = seed};
    CHECK_STATUS(tl_ctx_create(NULL, &f->ctx), TL_OK);
    snprintf(f->path, sizeof f->path, "cut_select_%u_%u.tlod", leaves, (unsigned)seed);
    CHECK_OK(f->ctx, make_model_write(f->ctx, &m, f->path));
    CHECK_OK(f->ctx, tl_store_open(f->ctx, f->path, &f->store));
    f->head = tl_store_get_head(f->store);
    f->drawn = calloc(f->head->patch_count, 1);
    f->fewest = calloc(f->head->patch_count, sizeof *f->fewest);
    f->most = calloc(f->head->patch_count, sizeof *f->most);
    make_graph_release(&m);
}

static void close_model(fixture *f)
{
    tl_store_close(f->store);
    tl_ctx_destroy(f->ctx);
    remove(f->path);
    free(f->drawn);
    free(f->fewest);
    free(f->most);
}

static tl_patch_info patch_of(const fixture *f, uint32_t p)
{
    tl_patch_info info;
    CHECK_OK(f->ctx, tl_store_patch(f->ctx, f->store, p, &info));
    return info;
}

static tl_segment_info segment_of(const fixture *f, uint32_t s)
{
    tl_segment_info info;
    CHECK_OK(f->ctx, tl_store_segment(f->ctx, f->store, s, &info));
    return info;
}

/* Every path from a leaf to a root crosses exactly one drawn patch; counts agree with the state. */
static void check_is_cut(fixture *f, const tl_cut *cut)
{
    size_t count;
    uint64_t tets = 0;
    const uint32_t *patches = tl_cut_patches(cut, &count);
    memset(f->drawn, 0, f->head->patch_count);
    for (size_t i = 0; i < count; i++) {
        CHECK(!f->drawn[patches[i]]);
        f->drawn[patches[i]] = 1;
        tets += patch_of(f, patches[i]).tet_count;
    }
    CHECK_EQ(tl_cut_get_state(cut).tets, tets);
    CHECK_EQ(tl_cut_get_state(cut).patches, count);
    for (uint32_t p = 0; p < f->head->patch_count; p++) { /* consumers come before their inputs */
        tl_patch_info info = patch_of(f, p);
        uint32_t fewest = 0, most = 0;
        if (info.consumer != TL_NONE) {
            tl_segment_info s = segment_of(f, info.consumer);
            fewest = UINT32_MAX;
            for (uint32_t i = 0; i < s.output_count; i++) {
                if (f->fewest[s.outputs[i]] < fewest) fewest = f->fewest[s.outputs[i]];
                if (f->most[s.outputs[i]] > most) most = f->most[s.outputs[i]];
            }
        }
        f->fewest[p] = fewest + f->drawn[p];
        f->most[p] = most + f->drawn[p];
        if (info.producer == TL_NONE && (f->fewest[p] != 1 || f->most[p] != 1))
            fail_msg("leaf %u: between %u and %u drawn patches on its paths", p, f->fewest[p],
                     f->most[p]);
    }
}

static double error_of(const fixture *f, uint32_t segment, size_t channel)
{
    return segment == TL_NONE ? 0 : segment_of(f, segment).max_error[channel];
}

static void test_rule_of_selection(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 20; seed++) {
        fixture f;
        tl_cut *cut = NULL;
        open_model(&f, 5 + (uint32_t)(seed * seed), seed);
        CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &cut));
        for (int i = 0; i < 25; i++) {
            size_t channel = make_random(&f.seed) % 2;
            double bounds[2] = {INFINITY, INFINITY};
            tl_cut_query query = tl_cut_query_defaults();
            bounds[channel] = exp(-12 * make_uniform(&f.seed));
            query.bounds.channels = bounds;
            CHECK_OK(f.ctx, tl_cut_update(cut, &query));
            check_is_cut(&f, cut);
            for (uint32_t p = 0; p < f.head->patch_count; p++) {
                tl_patch_info info = patch_of(&f, p);
                bool drawn = error_of(&f, info.producer, channel) <= bounds[channel] &&
                             (info.consumer == TL_NONE ||
                              bounds[channel] < error_of(&f, info.consumer, channel));
                if (drawn != f.drawn[p])
                    fail_msg("patch %u is %sdrawn at %g", p, drawn ? "not " : "", bounds[channel]);
            }
            CHECK(tl_cut_channel_error(cut, channel) <= bounds[channel]);
            CHECK(tl_cut_get_state(cut).bounds_kept);
        }
        tl_cut_destroy(cut);
        close_model(&f);
    }
}

/* What a segment's bins say of the visible values: the largest error in space where the field error
 * shows, and the sum of field errors weighed with opacity. */
static double seen_error(const fixture *f, uint32_t segment, const tl_cut_query *q, bool space)
{
    double worst = 0, sum = 0;
    if (segment == TL_NONE) return 0;
    tl_segment_info info = segment_of(f, segment);
    for (int c = 0; c < MODEL_CHANNELS; c++) {
        double part = 0;
        for (int b = c * TL_BINS; b < (c + 1) * TL_BINS; b++) {
            const bool shows = !q->unseen || info.field_bins[b] > q->unseen[b];
            if (shows && (!q->opacity || q->opacity[b] > 0))
                worst = fmax(worst, (double)info.space_bins[b]);
            part += (double)info.field_bins[b] * (q->opacity ? (double)q->opacity[b] : 1);
        }
        sum += part;
    }
    return space ? worst : sum;
}

/* Some bins, or one, as an isovalue asks for. */
static void any_opacity(fixture *f, float *opacity)
{
    bool single = make_random(&f->seed) % 2;
    for (int b = 0; b < MODEL_CHANNELS * TL_BINS; b++)
        opacity[b] =
            !single && make_random(&f->seed) % 4 == 0 ? (float)make_uniform(&f->seed) : 0.0F;
    if (single) opacity[make_random(&f->seed) % (MODEL_CHANNELS * TL_BINS)] = 1;
}

/* Errors in space of visible values, and errors weighed with opacity, do not fall towards the
 * coarse side, so that the rule of selection holds for them, too. */
static void test_visible_values(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 10; seed++) {
        fixture f;
        tl_cut *cut = NULL;
        size_t refined = 0;
        open_model(&f, 200, seed);
        CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &cut));
        for (int i = 0; i < 30; i++) {
            float opacity[MODEL_CHANNELS * TL_BINS], unseen[MODEL_CHANNELS * TL_BINS];
            const bool space = i % 2, all = i % 7 == 0;
            const double share = make_uniform(&f.seed);
            tl_cut_query query = tl_cut_query_defaults();
            any_opacity(&f, opacity);
            if (!all) query.opacity = opacity;
            for (int b = 0; b < MODEL_CHANNELS * TL_BINS; b++)
                unseen[b] = (float)(1e-3 * make_uniform(&f.seed));
            if (i % 3 == 0) query.unseen = unseen;
            double bound = share * seen_error(&f, 0, &query, space), seen = 0;
            *(space ? &query.bounds.space : &query.bounds.classified) = bound;
            CHECK_OK(f.ctx, tl_cut_update(cut, &query));
            check_is_cut(&f, cut);
            for (uint32_t p = 0; p < f.head->patch_count; p++) {
                tl_patch_info info = patch_of(&f, p);
                const double fine = seen_error(&f, info.producer, &query, space);
                bool drawn =
                    fine <= bound && (info.consumer == TL_NONE ||
                                      bound < seen_error(&f, info.consumer, &query, space));
                if (drawn != f.drawn[p])
                    fail_msg("patch %u is %sdrawn at %g", p, drawn ? "not " : "", bound);
                if (f.drawn[p]) seen = fmax(seen, seen_error(&f, info.producer, &query, true));
            }
            CHECK(tl_cut_get_state(cut).space_error == seen);
            CHECK(tl_cut_get_state(cut).pixels == 0);
            refined += tl_cut_get_state(cut).segments;
        }
        CHECK(refined > 100);
        tl_cut_destroy(cut);
        close_model(&f);
    }
}

/* A query of any kind. */
static tl_cut_query any_query(fixture *f, double bounds[4], double box[6], tl_camera *camera)
{
    tl_cut_query q = tl_cut_query_defaults();
    uint64_t kind = make_random(&f->seed);
    for (int i = 0; i < 4; i++) bounds[i] = exp(-10 * make_uniform(&f->seed));
    if (kind & 1) q.bounds.channels = bounds;
    if (kind & 2) q.bounds.boundary = exp(-16 * make_uniform(&f->seed));
    if (kind & 4) q.bounds.space = exp(-12 * make_uniform(&f->seed));
    if (kind & 8) q.bounds.classified = exp(-6 * make_uniform(&f->seed));
    if (kind & 16) {
        for (int k = 0; k < 3; k++) {
            box[k] = make_uniform(&f->seed) - 0.5 * (k > 0);
            box[k + 3] = box[k] + make_uniform(&f->seed) * 0.3;
        }
        q.box = box;
        q.outside.channels = bounds + 2;
    }
    if (kind & 32) {
        *camera = tl_camera_defaults();
        camera->position[0] = make_uniform(&f->seed);
        camera->position[2] = 0.01 + make_uniform(&f->seed);
        camera->focal_point[0] = make_uniform(&f->seed);
        q.camera = camera;
        q.pixels = exp(4 * make_uniform(&f->seed) - 2);
    }
    if ((kind & 192) == 192)
        q.tets_max = (uint64_t)((double)f->head->input_tets * make_uniform(&f->seed));
    if ((kind & 768) == 768) q.level = (uint32_t)(make_random(&f->seed) % f->head->level_count);
    return q;
}

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static uint32_t *sorted_patches(const tl_cut *cut, size_t *count)
{
    const uint32_t *patches = tl_cut_patches(cut, count);
    uint32_t *copy = malloc((*count + 1) * sizeof *copy);
    if (!copy) abort();
    memcpy(copy, patches, *count * sizeof *copy);
    qsort(copy, *count, sizeof *copy, by_number);
    return copy;
}

/* What came and what went lead from the patches before to those now. */
static void check_change(const fixture *f, const tl_cut *cut, uint8_t *kept)
{
    size_t count;
    const uint32_t *ids = tl_cut_removed(cut, &count);
    for (size_t i = 0; i < count; i++) {
        CHECK_EQ(kept[ids[i]], 1);
        kept[ids[i]] = 0;
    }
    ids = tl_cut_added(cut, &count);
    for (size_t i = 0; i < count; i++) {
        CHECK_EQ(kept[ids[i]], 0);
        kept[ids[i]] = 1;
    }
    CHECK(!memcmp(kept, f->drawn, f->head->patch_count));
}

static void test_no_memory_of_before(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 10; seed++) {
        fixture f;
        tl_cut *cut = NULL, *fresh = NULL;
        open_model(&f, 20 + 40 * (uint32_t)seed, seed);
        CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &cut));
        check_is_cut(&f, cut);
        uint8_t *kept = malloc(f.head->patch_count);
        if (!kept) abort();
        memcpy(kept, f.drawn, f.head->patch_count);
        for (int i = 0; i < 60; i++) {
            double bounds[4], box[6];
            tl_camera camera;
            tl_cut_query query = any_query(&f, bounds, box, &camera);
            CHECK_OK(f.ctx, tl_cut_update(cut, &query));
            check_is_cut(&f, cut);
            check_change(&f, cut, kept);
            if (query.camera && tl_cut_get_state(cut).bounds_kept)
                CHECK(tl_cut_get_state(cut).pixels <= query.pixels * (1 + 1e-12));
            size_t count, fresh_count;
            CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &fresh));
            CHECK_OK(f.ctx, tl_cut_update(fresh, &query));
            uint32_t *a = sorted_patches(cut, &count), *b = sorted_patches(fresh, &fresh_count);
            CHECK_EQ(count, fresh_count);
            CHECK(!memcmp(a, b, count * sizeof *a));
            CHECK_EQ(tl_cut_get_state(cut).bounds_kept, tl_cut_get_state(fresh).bounds_kept);
            free(a);
            free(b);
            tl_cut_destroy(fresh);
        }
        free(kept);
        tl_cut_destroy(cut);
        close_model(&f);
    }
}

static double square_error(fixture *f, const tl_cut *cut)
{
    size_t count;
    double sum = 0;
    const uint32_t *patches = tl_cut_patches(cut, &count);
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < MODEL_CHANNELS; c++) sum += patch_of(f, patches[i]).square_error[c];
    return sum;
}

static void test_budgets_are_kept(void **state)
{
    (void)state;
    fixture f;
    tl_cut *cut = NULL;
    open_model(&f, 600, 3);
    CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &cut));
    uint64_t coarsest = tl_cut_get_state(cut).tets;
    double before = INFINITY;
    for (int i = 0; i <= 40; i++) {
        tl_cut_query query = tl_cut_query_defaults();
        query.tets_max = coarsest + (f.head->input_tets - coarsest) * (uint64_t)i / 40;
        CHECK_OK(f.ctx, tl_cut_update(cut, &query));
        check_is_cut(&f, cut);
        CHECK(tl_cut_get_state(cut).tets <= query.tets_max);
        if (i >= 20) CHECK(tl_cut_get_state(cut).tets > query.tets_max * 9 / 10);
        double now = square_error(&f, cut);
        CHECK(now <= before * 1.02); /* a greedy choice may lose a little to a smaller budget's */
        before = now;
    }
    tl_cut_query query = tl_cut_query_defaults();
    query.tets_max = 1;
    CHECK_OK(f.ctx, tl_cut_update(cut, &query));
    CHECK_EQ(tl_cut_get_state(cut).tets, coarsest);
    CHECK(!tl_cut_get_state(cut).bounds_kept); /* and says so */
    tl_cut_destroy(cut);
    close_model(&f);
}

static void test_levels(void **state)
{
    (void)state;
    fixture f;
    tl_cut *cut = NULL;
    open_model(&f, 300, 9);
    CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &cut));
    for (uint32_t level = 0; level < f.head->level_count; level++) {
        tl_cut_query query = tl_cut_query_defaults();
        query.level = level;
        CHECK_OK(f.ctx, tl_cut_update(cut, &query));
        check_is_cut(&f, cut);
        for (uint32_t p = 0; p < f.head->patch_count; p++)
            CHECK_EQ(f.drawn[p], patch_of(&f, p).level == level);
    }
    tl_cut_destroy(cut);
    close_model(&f);
}

typedef struct residency {
    fixture *f;
    double share;
    const uint8_t *asked_before;
} residency;

/* Some patches are there, by a hash of their number. */
static bool is_there(void *user, uint32_t patch)
{
    const residency *r = user;
    uint64_t seed = patch + 77;
    return make_uniform(&seed) < r->share;
}

static void test_only_what_is_resident(void **state)
{
    (void)state;
    fixture f;
    tl_cut *cut = NULL;
    open_model(&f, 500, 5);
    for (int share = 0; share <= 10; share++) {
        residency r = {.f = &f, .share = share / 10.0};
        CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &cut));
        check_is_cut(&f, cut);
        uint8_t *before = malloc(f.head->patch_count);
        if (!before) abort();
        tl_cut_set_resident(cut, is_there, &r);
        for (int i = 0; i < 30; i++) {
            double bounds[4], box[6];
            tl_camera camera;
            memcpy(before, f.drawn, f.head->patch_count);
            tl_cut_query query = any_query(&f, bounds, box, &camera);
            CHECK_OK(f.ctx, tl_cut_update(cut, &query));
            check_is_cut(&f, cut);
            for (uint32_t p = 0; p < f.head->patch_count; p++)
                if (f.drawn[p] && !before[p] && patch_of(&f, p).consumer != TL_NONE)
                    CHECK(is_there(&r, p));
            size_t wanted;
            tl_cut_wanted(cut, &wanted);
            if (share == 10) CHECK_EQ(wanted, 0);
        }
        free(before);
        tl_cut_destroy(cut);
    }
    close_model(&f);
}

/* What is foreseen is what would come, resident or not, and nothing moves. */
static void test_looking_ahead(void **state)
{
    (void)state;
    fixture f;
    tl_cut *cut = NULL, *other = NULL;
    size_t foreseen_count = 0, hidden = 0;
    open_model(&f, 400, 6);
    CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &cut));
    CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &other));
    uint8_t *now = malloc(f.head->patch_count), *then = malloc(f.head->patch_count);
    if (!now || !then) abort();
    for (int i = 0; i < 60; i++) {
        residency r = {.f = &f, .share = i % 3 ? 0.5 : 0};
        double bounds[4], box[6], bounds_then[4], box_then[6];
        tl_camera camera, camera_then;
        const uint32_t *foreseen = NULL;
        size_t count;
        tl_cut_query query = any_query(&f, bounds, box, &camera);
        tl_cut_query ahead = any_query(&f, bounds_then, box_then, &camera_then);
        CHECK_OK(f.ctx, tl_cut_update(other, &ahead));
        check_is_cut(&f, other);
        memcpy(then, f.drawn, f.head->patch_count);
        tl_cut_set_resident(cut, NULL, NULL);
        CHECK_OK(f.ctx, tl_cut_update(cut, &query));
        check_is_cut(&f, cut);
        memcpy(now, f.drawn, f.head->patch_count);
        tl_cut_set_resident(cut, is_there, &r);
        const tl_cut_state was = tl_cut_get_state(cut);
        CHECK_OK(f.ctx, tl_cut_foresee(cut, &ahead, &foreseen, &count));
        CHECK_EQ(tl_cut_get_state(cut).tets, was.tets);
        check_is_cut(&f, cut);
        CHECK(!memcmp(now, f.drawn, f.head->patch_count));
        size_t at = 0;
        for (uint32_t p = 0; p < f.head->patch_count; p++) {
            if (!then[p] || now[p] || patch_of(&f, p).consumer == TL_NONE) continue;
            if (is_there(&r, p)) {
                hidden++;
                continue;
            }
            CHECK(at < count);
            CHECK_EQ(foreseen[at++], p);
        }
        CHECK_EQ(at, count);
        foreseen_count += count;
        tl_cut_set_resident(cut, NULL, NULL); /* and the next update is not led astray */
        CHECK_OK(f.ctx, tl_cut_update(cut, &query));
        check_is_cut(&f, cut);
        CHECK(!memcmp(now, f.drawn, f.head->patch_count));
    }
    CHECK(foreseen_count > 1000 && hidden > 100);
    free(now);
    free(then);
    tl_cut_destroy(other);
    tl_cut_destroy(cut);
    close_model(&f);
}

static void test_bad_queries(void **state)
{
    (void)state;
    fixture f;
    tl_cut *cut = NULL;
    open_model(&f, 30, 2);
    CHECK_OK(f.ctx, tl_cut_create(f.ctx, f.store, &cut));
    double bounds[2] = {1, (double)NAN}, box[6] = {1, 0, 0, 0, 1, 1};
    tl_camera camera = tl_camera_defaults();
    tl_cut_query query = tl_cut_query_defaults();
    query.bounds.channels = bounds;
    CHECK_STATUS(tl_cut_update(cut, &query), TL_ERR_ARG);
    query = tl_cut_query_defaults();
    query.box = box;
    CHECK_STATUS(tl_cut_update(cut, &query), TL_ERR_ARG);
    query = tl_cut_query_defaults();
    query.camera = &camera;
    query.pixels = 1;
    camera.view_up[1] = 0;
    CHECK_STATUS(tl_cut_update(cut, &query), TL_ERR_ARG);
    camera = tl_camera_defaults();
    camera.view_angle = 180;
    CHECK_STATUS(tl_cut_update(cut, &query), TL_ERR_ARG);
    query.struct_bytes = 3;
    CHECK_STATUS(tl_cut_update(cut, &query), TL_ERR_ARG);
    check_is_cut(&f, cut); /* nothing has changed */
    tl_cut_destroy(cut);
    close_model(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rule_of_selection),     cmocka_unit_test(test_no_memory_of_before),
        cmocka_unit_test(test_budgets_are_kept),      cmocka_unit_test(test_levels),
        cmocka_unit_test(test_only_what_is_resident), cmocka_unit_test(test_bad_queries),
        cmocka_unit_test(test_visible_values),        cmocka_unit_test(test_looking_ahead),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
