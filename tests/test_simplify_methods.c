/* Orders, placements, locked vertices and the listener; the same bytes for any number of threads.
 */
#include "check.h"
#include "check_simplify.h"

static tl_mesh *bumpy_grid(tl_ctx *ctx, size_t n)
{
    make_mesh m = make_grid(n);
    perturb_inner(&m, 0.1 / (double)(n - 1), 7);
    make_two_regions(&m);
    make_shuffle(&m, 9);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    make_release(&m);
    return mesh;
}

static void check_same(const tl_mesh *a, const tl_mesh *b)
{
    CHECK_EQ(tl_mesh_tet_count(b), tl_mesh_tet_count(a));
    CHECK_EQ(tl_mesh_vert_count(b), tl_mesh_vert_count(a));
    size_t tets = tl_mesh_tet_count(a), verts = tl_mesh_vert_count(a);
    CHECK(!memcmp(tl_mesh_tets(a), tl_mesh_tets(b), 4 * tets * sizeof(tl_lidx)));
    CHECK(!memcmp(tl_mesh_xyz(a), tl_mesh_xyz(b), 3 * verts * sizeof(double)));
    if (tl_mesh_regions(a))
        CHECK(!memcmp(tl_mesh_regions(a), tl_mesh_regions(b), tets * sizeof(int32_t)));
    CHECK_EQ(tl_mesh_channel_count(b), tl_mesh_channel_count(a));
    for (size_t i = 0; i < tl_mesh_channel_count(a); i++) {
        const tl_channel *p = tl_mesh_channel(a, i), *q = tl_mesh_channel(b, i);
        size_t count = (p->on == TL_ON_VERTEX ? verts : tets) * p->components;
        CHECK(!memcmp(p->values, q->values, count * sizeof(double)));
    }
}

/* ---- threads ---- */

static void test_threads(void **state)
{
    static const unsigned threads[] = {1, 1, 2, 3, 7};
    (void)state;
    for (int method = 0; method <= TL_SIMPLIFY_BLOCKS; method++)
        for (int by_error = 0; by_error < 2; by_error++) {
            shrunk first = {0};
            tl_mesh *meshes[5];
            tl_ctx *ctxs[5];
            for (size_t i = 0; i < 5; i++) {
                ctxs[i] = shrink_ctx(threads[i]);
                meshes[i] = bumpy_grid(ctxs[i], by_error ? 9 : 20);
                tl_simplify_opts opts = shrink_ratio(0.1);
                opts.method = (tl_simplify_method)method;
                opts.error = by_error ? 0.02 : 0;
                shrunk s = shrink(meshes[i], &opts);
                if (i == 0) {
                    first = s;
                    continue;
                }
                check_same(first.mesh, s.mesh);
                CHECK(first.result.boundary_error == s.result.boundary_error);
                CHECK(first.result.channels[0].max_error == s.result.channels[0].max_error);
                CHECK(first.result.channels[0].rms_error == s.result.channels[0].rms_error);
                shrink_release(&s);
            }
            printf("%s: %zu tets, rms %.4g, with 1, 1, 2, 3, 7 threads\n", method_names[method],
                   first.result.tets_out, first.result.channels[0].rms_error);
            shrink_release(&first);
            for (size_t i = 0; i < 5; i++) {
                tl_mesh_destroy(meshes[i]);
                tl_ctx_destroy(ctxs[i]);
            }
        }
}

/* ---- methods and placements ---- */

static void test_methods(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = bumpy_grid(ctx, 15);
    double rms[2][TL_SIMPLIFY_BLOCKS + 1];
    (void)state;
    for (int placement = 0; placement < 2; placement++)
        for (int method = 0; method <= TL_SIMPLIFY_BLOCKS; method++) {
            tl_simplify_opts opts = shrink_ratio(0.3);
            opts.method = (tl_simplify_method)method;
            opts.placement = (tl_placement)placement;
            shrunk s = shrink(mesh, &opts);
            check_whole(mesh, &s, 1e-3 * mesh_diagonal(mesh), 1e-4);
            check_same_topology(mesh, s.mesh, true);
            CHECK(s.result.target_reached);
            rms[placement][method] = s.result.channels[0].rms_error;
            printf("%s, %s: rms %.4g\n", method_names[method], placement ? "subset" : "optimal",
                   rms[placement][method]);
            shrink_release(&s);
        }
    for (int method = 0; method <= TL_SIMPLIFY_BLOCKS; method++) {
        CHECK_BOUND("free places are better", rms[0][method], rms[1][method]);
        CHECK_BOUND("of the queue's rms", rms[0][method] / rms[0][TL_SIMPLIFY_QUEUE], 2);
    }
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* Index in mesh of each vertex of part, by place and bits; SIZE_MAX where there is none. */
static void find_originals(const tl_mesh *mesh, const tl_mesh *part, size_t *index)
{
    const double *from = tl_mesh_xyz(mesh), *to = tl_mesh_xyz(part);
    for (size_t v = 0; v < tl_mesh_vert_count(part); v++) {
        index[v] = SIZE_MAX;
        for (size_t o = 0; o < tl_mesh_vert_count(mesh); o++)
            if (!memcmp(from + 3 * o, to + 3 * v, 3 * sizeof *from)) index[v] = o;
    }
}

static void test_subset(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = bumpy_grid(ctx, 13);
    size_t *index = malloc(tl_mesh_vert_count(mesh) * sizeof *index);
    (void)state;
    for (int by_error = 0; by_error < 2; by_error++) {
        tl_simplify_opts opts = shrink_ratio(0.1);
        opts.placement = TL_PLACE_SUBSET;
        opts.error = by_error ? 0.02 : 0;
        shrunk s = shrink(mesh, &opts);
        find_originals(mesh, s.mesh, index);
        const double *from = tl_mesh_channel(mesh, 0)->values,
                     *to = tl_mesh_channel(s.mesh, 0)->values;
        for (size_t v = 0; v < tl_mesh_vert_count(s.mesh); v++) {
            CHECK(index[v] != SIZE_MAX);
            CHECK(to[v] == from[index[v]]);
        }
        shrink_release(&s);
    }
    free(index);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_locked(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = bumpy_grid(ctx, 9);
    size_t n = tl_mesh_vert_count(mesh);
    uint8_t *locked = calloc(n, 1);
    uint64_t seed = 3;
    (void)state;
    for (size_t v = 0; v < n; v++) locked[v] = make_uniform(&seed) < 0.1;
    for (int method = 0; method <= TL_SIMPLIFY_BLOCKS; method++)
        for (int placement = 0; placement < 2; placement++) {
            tl_simplify_opts opts = shrink_ratio(0.2);
            opts.method = (tl_simplify_method)method;
            opts.placement = (tl_placement)placement;
            opts.locked = locked;
            shrunk s = shrink(mesh, &opts);
            check_whole(mesh, &s, 1e-3 * mesh_diagonal(mesh), 1e-4);
            size_t *index = malloc(tl_mesh_vert_count(s.mesh) * sizeof *index), found = 0;
            size_t wanted = 0;
            find_originals(mesh, s.mesh, index);
            for (size_t v = 0; v < tl_mesh_vert_count(s.mesh); v++) {
                if (index[v] == SIZE_MAX || !locked[index[v]]) continue;
                found++;
                CHECK(tl_mesh_channel(s.mesh, 0)->values[v] ==
                      tl_mesh_channel(mesh, 0)->values[index[v]]);
            }
            for (size_t v = 0; v < n; v++) wanted += locked[v];
            CHECK_EQ(found, wanted);
            free(index);
            shrink_release(&s);
        }
    memset(locked, 1, n);
    tl_simplify_opts opts = shrink_ratio(0.2);
    opts.locked = locked;
    shrunk s = shrink(mesh, &opts);
    CHECK_EQ(s.result.tets_out, s.result.tets_in);
    CHECK(!s.result.target_reached);
    CHECK(s.result.channels[0].max_error == 0);
    shrink_release(&s);
    free(locked);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- listener ---- */

/* A mesh as plain lists, changed by what the listener hears. */
typedef struct replay {
    tl_lidx *tets;
    double *xyz;
    uint8_t *gone; /* per vertex */
    size_t tet_count, calls, components;
} replay;

static tl_status replay_collapse(void *user, const tl_collapse *c)
{
    replay *r = user;
    CHECK(c->kept != c->gone && !r->gone[c->kept] && !r->gone[c->gone]);
    CHECK(c->cost >= 0 && isfinite(c->cost));
    for (size_t k = 0; k < r->components; k++) CHECK(isfinite(c->values[k]));
    r->gone[c->gone] = 1;
    r->calls++;
    memcpy(r->xyz + 3 * (size_t)c->kept, c->xyz, sizeof c->xyz);
    for (size_t t = 0; t < r->tet_count;) {
        tl_lidx *q = r->tets + 4 * t;
        int ends = 0;
        for (int i = 0; i < 4; i++) ends += q[i] == c->kept || q[i] == c->gone;
        if (ends == 2) {
            memcpy(q, r->tets + 4 * --r->tet_count, 4 * sizeof *q);
            continue;
        }
        for (int i = 0; i < 4; i++)
            if (q[i] == c->gone) q[i] = c->kept;
        t++;
    }
    return TL_OK;
}

/* A tet by the places of its corners, in an order of their own. */
typedef struct placed {
    double x[4][3];
} placed;

static int point_order(const void *a, const void *b)
{
    const double *p = a, *q = b;
    for (int k = 0; k < 3; k++)
        if (p[k] < q[k] || p[k] > q[k]) return p[k] < q[k] ? -1 : 1;
    return 0;
}

static int placed_order(const void *a, const void *b)
{
    const placed *p = a, *q = b;
    for (int i = 0; i < 4; i++)
        if (point_order(p->x[i], q->x[i])) return point_order(p->x[i], q->x[i]);
    return 0;
}

static placed *place_tets(const tl_lidx *tets, size_t count, const double *xyz)
{
    placed *p = malloc((count + 1) * sizeof *p);
    for (size_t t = 0; t < count; t++) {
        for (size_t i = 0; i < 4; i++)
            memcpy(p[t].x[i], xyz + 3 * (size_t)tets[4 * t + i], sizeof p[t].x[i]);
        qsort(p[t].x, 4, sizeof p[t].x[0], point_order);
    }
    qsort(p, count, sizeof *p, placed_order);
    return p;
}

static void test_listener(void **state)
{
    tl_ctx *ctx = shrink_ctx(3);
    (void)state;
    for (int method = 0; method <= TL_SIMPLIFY_BLOCKS; method++)
        for (int by_error = 0; by_error < 2; by_error++) {
            /* blocks are made of some thousand vertices and more */
            tl_mesh *mesh = bumpy_grid(ctx, method == TL_SIMPLIFY_BLOCKS ? 20 : 9);
            size_t verts = tl_mesh_vert_count(mesh), tets = tl_mesh_tet_count(mesh);
            replay r = {.tets = malloc(4 * tets * sizeof *r.tets),
                        .xyz = malloc(3 * verts * sizeof *r.xyz),
                        .gone = calloc(verts, 1),
                        .tet_count = tets,
                        .components = 1};
            memcpy(r.tets, tl_mesh_tets(mesh), 4 * tets * sizeof *r.tets);
            memcpy(r.xyz, tl_mesh_xyz(mesh), 3 * verts * sizeof *r.xyz);
            tl_simplify_opts opts = shrink_ratio(0.6);
            opts.method = (tl_simplify_method)method;
            opts.error = by_error ? 0.005 : 0;
            opts.listener = replay_collapse;
            opts.listener_user = &r;
            shrunk s = shrink(mesh, &opts);
            printf("%s%s: %zu collapses\n", method_names[method], by_error ? ", error" : "",
                   r.calls);
            CHECK_EQ(r.calls, verts - s.result.vertices_out);
            CHECK_EQ(r.tet_count, s.result.tets_out);
            placed *a = place_tets(r.tets, r.tet_count, r.xyz);
            placed *b = place_tets(tl_mesh_tets(s.mesh), r.tet_count, tl_mesh_xyz(s.mesh));
            CHECK(!memcmp(a, b, r.tet_count * sizeof *a));
            free(a);
            free(b);
            free(r.tets);
            free(r.xyz);
            free(r.gone);
            shrink_release(&s);
            tl_mesh_destroy(mesh);
        }
    tl_ctx_destroy(ctx);
}

static tl_status count_collapse(void *user, const tl_collapse *c)
{
    (void)c;
    ++*(size_t *)user;
    return TL_OK;
}

/* Listening changes nothing. */
static void test_listener_same(void **state)
{
    tl_ctx *ctx = shrink_ctx(4);
    tl_mesh *mesh = bumpy_grid(ctx, 22);
    size_t calls = 0;
    (void)state;
    tl_simplify_opts opts = shrink_ratio(0.1);
    shrunk a = shrink(mesh, &opts);
    opts.listener = count_collapse;
    opts.listener_user = &calls;
    shrunk b = shrink(mesh, &opts);
    check_same(a.mesh, b.mesh);
    CHECK_EQ(calls, b.result.vertices_in - b.result.vertices_out);
    shrink_release(&a);
    shrink_release(&b);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads),  cmocka_unit_test(test_methods),
        cmocka_unit_test(test_subset),   cmocka_unit_test(test_locked),
        cmocka_unit_test(test_listener), cmocka_unit_test(test_listener_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
