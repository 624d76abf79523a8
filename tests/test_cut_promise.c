/* The check of a model against its original: channels on vertices and on tets keep what is
 * promised, and an original that differs in one value is told. */
#include "check_ctx.h"
#include "check_model.h"
#include "tetralod/cut.h"

enum { CELLS = 9, FIELDS = 3 };

static double wave(const double x[3], uint32_t k)
{
    return sin(6 * x[k % 3]) * cos(4 * x[(k + 1) % 3]) + x[(k + 2) % 3];
}

/* A scalar on vertices, and on tets a scalar of the same name and a vector. off: is added to the
 * value of one tet, or vertex. */
static tl_mesh *make_original(tl_ctx *ctx, tl_on on, double off)
{
    static const struct {
        const char *name;
        uint32_t components;
        tl_on on;
    } LIST[FIELDS] = {
        {"density", 1, TL_ON_VERTEX}, {"density", 1, TL_ON_TET}, {"flow", 3, TL_ON_TET}};
    make_mesh m = make_grid(CELLS);
    make_perturb(&m, 0.08 / CELLS, 5);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    for (int i = 0; i < FIELDS; i++) {
        const uint32_t n = LIST[i].components;
        const size_t count = LIST[i].on == TL_ON_TET ? m.tet_count : m.vert_count;
        double *values = malloc(count * n * sizeof *values);
        for (size_t e = 0; e < count; e++) {
            const size_t v = LIST[i].on == TL_ON_TET ? m.tets[4 * e] : e;
            for (uint32_t k = 0; k < n; k++) values[e * n + k] = wave(m.xyz + 3 * v, k);
        }
        if (n == 1 && LIST[i].on == on) values[count / 2] += off;
        tl_channel channel = {LIST[i].name, "", n, LIST[i].on, TL_F64, values};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        free(values);
    }
    make_release(&m);
    return mesh;
}

static void keeps_what_it_promises(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_store *store = NULL;
    tl_build_result built;
    tl_cut_check_result r;
    tl_build_opts opts = check_model_opts(900, 150);
    const char *path = check_model_path("promise");
    tl_mesh *mesh = make_original(ctx, TL_ON_TET, 0);
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, path, &opts, &built));
    CHECK_OK(ctx, tl_store_open(ctx, path, &store));
    CHECK(tl_store_get_head(store)->level_count > 2);
    CHECK_OK(ctx, tl_cut_check(ctx, store, mesh, NULL, &r));
    CHECK_EQ(r.channel_count, FIELDS);
    for (size_t c = 0; c < r.channel_count; c++) {
        printf("%s: measured %g, promised %g, at most %.3f times\n", r.channels[c].name,
               r.channels[c].measured, r.channels[c].promised, r.channels[c].looseness);
        CHECK(r.channels[c].measured > 0);
        CHECK(r.channels[c].measured <= r.channels[c].promised);
        CHECK(r.channels[c].looseness < 1.5);
    }
    tl_cut_check_release(ctx, &r);
    tl_mesh_destroy(mesh);
    for (int on = 0; on < 2; on++) {
        mesh = make_original(ctx, on ? TL_ON_TET : TL_ON_VERTEX, 50);
        CHECK_STATUS(tl_cut_check(ctx, store, mesh, NULL, &r), TL_ERR_DATA);
        CHECK(strstr(tl_ctx_message(ctx), "'density' is off by "));
        CHECK(strstr(tl_ctx_message(ctx), on ? "centroid of tet" : "at vertex"));
        CHECK(r.channels == NULL);
        tl_mesh_destroy(mesh);
    }
    tl_build_release(ctx, &built);
    tl_store_close(store);
    CHECK_EQ(remove(path), 0);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(keeps_what_it_promises)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
