/* What an error in space says of whole surfaces: at every level of models of five data sets, how
 * far the isosurfaces of the original and of the level are from each other, both ways, by brute
 * force. From the original to the level the promise must hold; the other way round it is not made,
 * and counted. */
#include "check.h"
#include "check_ctx.h"

#include "check_simplify_real.h"
#include "check_slices.h"

enum { VALUES = 9 };
/* Part of the surfaces on which a level may have more than the original has near it: where a value
 * is that of an extremum, give or take the field error. */
static const double STRAYS = 0.05;

static const real_file files[] = {
    {"curvilinear/bluntfinxyz.bin", "curvilinear/bluntfinq.bin", {0}},
    {"curvilinear/combxyz.bin", "curvilinear/combq.bin", {0}},
    {"volume/neghip_64x64x64_uint8.raw", NULL, {64, 64, 64}},
};

typedef struct tally {
    size_t count, finite, strays;
    double tightest, sum_of_logs; /* of promise by distance to the level */
} tally;

static void look_at(slices_case *c, tl_cut *cut, uint32_t level, double value, tally *t)
{
    const size_t channel = c->number;
    const uint32_t bin = tl_bin_of(c->head->channels[channel].range, value);
    float *opacity = calloc((size_t)c->head->channel_count * TL_BINS, sizeof *opacity);
    tl_cut_query query = tl_cut_query_defaults();
    tl_mesh *mesh = NULL;
    query.level = level;
    query.opacity = opacity;
    opacity[channel * TL_BINS + bin] = 1;
    CHECK_OK(c->ctx, tl_cut_update(cut, &query));
    CHECK_OK(c->ctx, tl_cut_mesh(cut, &channel, 1, &mesh));
    tl_polydata *whole = slices_of_mesh(c, c->original, value);
    tl_polydata *ours = slices_of_mesh(c, mesh, value);
    const double promise = tl_cut_get_state(cut).space_error + c->head->position_error;
    const double to_level = slices_far(c->ctx, whole, ours);
    CHECK(to_level <= promise);
    t->count++;
    t->strays += slices_far(c->ctx, ours, whole) > promise;
    if (isfinite(promise) && to_level > 0) {
        t->finite++;
        t->tightest = fmax(t->tightest, to_level / promise);
        t->sum_of_logs += log(promise / to_level);
    }
    tl_polydata_destroy(c->ctx, ours);
    tl_polydata_destroy(c->ctx, whole);
    tl_mesh_destroy(mesh);
    free(opacity);
}

static void try_levels(tl_ctx *ctx, tl_mesh *mesh, const char *name, uint64_t number)
{
    (void)number;
    slices_case c;
    tl_cut *cut = NULL;
    tally t = {0};
    const tl_build_opts opts = tl_build_opts_defaults();
    slices_build(&c, ctx, mesh, &opts);
    const double *range = c.head->channels[c.number].range;
    CHECK_OK(ctx, tl_cut_create(ctx, c.store, &cut));
    for (uint32_t level = 1; level < c.head->level_count; level++)
        for (int i = 1; i <= VALUES; i++)
            look_at(&c, cut, level, range[0] + (0.1 * i + 0.003) * (range[1] - range[0]), &t);
    printf("%s: %zu surfaces, %zu promises: distance at most %.3f of the promise, %.1f times less "
           "in the mean; %zu levels have more than the original ok\n",
           name, t.count, t.finite, t.tightest, exp(t.sum_of_logs / (double)t.finite), t.strays);
    CHECK(t.finite > t.count / 2);
    CHECK((double)t.strays <= STRAYS * (double)t.count + 4);
    tl_cut_destroy(cut);
    slices_close(&c);
}

static void samples(void **state)
{
    (void)state;
    static const char *const names[] = {"gaussians", "sphere-flow"};
    tl_ctx *ctx = check_ctx_create(2);
    for (int i = 0; i < 2; i++) {
        tl_mesh *mesh = NULL;
        CHECK_OK(ctx, tl_sample_write(ctx, names[i], 40, "sample.vtu"));
        CHECK_OK(ctx, tl_mesh_read(ctx, "sample.vtu", NULL, &mesh, NULL));
        CHECK_EQ(remove("sample.vtu"), 0);
        try_levels(ctx, mesh, names[i], 0);
    }
    tl_ctx_destroy(ctx);
}

static void real(void **state)
{
    (void)state;
    real_each(files, sizeof files / sizeof *files, try_levels);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(samples), cmocka_unit_test(real)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
