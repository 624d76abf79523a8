/* Thinning: what it leaves is a mesh of the same space and surfaces, whatever the number of ranges
 * and threads; its kernels give the same bytes. */
#include "check.h"
#include "check_simplify.h"

#include "mesh/mesh.h"
#include "simplify/simplify_thin.h"
#include "simplify/simplify_work.h"

static tl_mesh *rough_grid(tl_ctx *ctx, size_t n)
{
    make_mesh m = make_grid(n);
    perturb_inner(&m, 0.15 / (double)(n - 1), 5);
    make_two_regions(&m);
    make_shuffle(&m, 3);
    tl_mesh *mesh = make_object(ctx, &m, field_bumps);
    make_release(&m);
    return mesh;
}

/* The working mesh, thinned on the way to target, or not at all (SIZE_MAX). */
static tli_work *work_of(const tl_mesh *mesh, const uint8_t *locked, size_t target)
{
    tl_ctx *ctx = tl_mesh_ctx(mesh);
    tli_work *w = NULL;
    double scale = 1;
    tl_simplify_channel channel = {.name = tl_mesh_channel(mesh, 0)->name, .weight = 1};
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.channels = &channel;
    opts.channel_count = 1;
    opts.locked = locked;
    CHECK_OK(ctx, tli_work_create(ctx, mesh, &opts, &scale, target, &w));
    return w;
}

/* ---- what is left ---- */

/* Every tet is positive and in the stars of its vertices, stars hold nothing else; returns the
 * volume of a region. */
static double check_work(const tli_work *w, int32_t region)
{
    double volume = 0;
    size_t corners = 0, live = 0;
    CHECK_EQ(w->tet_count, w->tets_live);
    for (size_t v = 0; v < w->vert_count; v++) {
        const tli_star *s = &w->verts[v].star;
        CHECK_EQ(w->marks[v], 0);
        if (w->verts[v].merged != v) {
            CHECK_EQ(s->count, 0);
            continue;
        }
        live++;
        corners += s->count;
        for (uint32_t i = 0; i < s->count; i++) {
            const tl_lidx *q = w->tets[s->tets[i]];
            CHECK(q[0] == v || q[1] == v || q[2] == v || q[3] == v);
        }
    }
    CHECK_EQ(corners, 4 * w->tets_live);
    CHECK_EQ(live, w->verts_live);
    for (size_t t = 0; t < w->tet_count; t++) {
        double p[4][3];
        for (size_t i = 0; i < 4; i++) memcpy(p[i], w->verts[w->tets[t][i]].xyz, sizeof p[i]);
        double some = tl_tet_volume((const double(*)[3])p);
        CHECK(some > 0);
        if (w->regions[t] == region) volume += some;
    }
    return volume;
}

static size_t count_faces(const tli_work *w)
{
    size_t count = 0;
    for (size_t t = 0; t < w->tet_count; t++)
        for (unsigned f = 0; f < 4; f++) count += w->faces[t] >> f & 1;
    return count;
}

static void test_work(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    tl_mesh *mesh = rough_grid(ctx, 36); /* more vertices than a range holds */
    size_t verts = tl_mesh_vert_count(mesh);
    uint8_t *locked = calloc(verts, 1);
    (void)state;
    for (size_t v = 0; v < verts; v += 7) locked[v] = 1;
    tli_work *plain = work_of(mesh, locked, SIZE_MAX);
    tli_work *thin = work_of(mesh, locked, tl_mesh_tet_count(mesh) / 10);
    printf("%zu tets of %zu left, %zu vertices of %zu\n", thin->tets_live, plain->tets_live,
           thin->verts_live, plain->verts_live);
    CHECK_EQ(plain->tets_live, tl_mesh_tet_count(mesh));
    CHECK(thin->tets_live < plain->tets_live * 3 / 4);
    CHECK(thin->last_cost > 0);
    for (int32_t region = 0; region < 2; region++)
        CHECK_NEAR(check_work(thin, region), check_work(plain, region), 1e-12);
    CHECK_EQ(count_faces(thin), count_faces(plain));
    for (size_t v = 0; v < verts; v++) {
        CHECK_EQ(thin->verts[v].kind, plain->verts[v].kind * (thin->verts[v].merged == v));
        CHECK(thin->verts[v].merged == v || plain->verts[v].kind == TLI_FREE);
        CHECK(!memcmp(thin->verts[v].xyz, plain->verts[v].xyz, sizeof plain->verts[v].xyz));
    }
    tli_work_destroy(thin);
    tli_work_destroy(plain);
    free(locked);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* Where little is to go, little goes, and never past the target. */
static void test_target(void **state)
{
    static const double parts[] = {0.02, 0.3, 0.7, 0.95, 1};
    tl_ctx *ctx = shrink_ctx(1);
    tl_mesh *mesh = rough_grid(ctx, 16);
    size_t tets = tl_mesh_tet_count(mesh), last = 0;
    (void)state;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        size_t target = (size_t)(parts[i] * (double)tets);
        tli_work *w = work_of(mesh, NULL, target);
        printf("target %zu: %zu tets of %zu\n", target, w->tets_live, tets);
        CHECK(w->tets_live >= target && w->tets_live >= last);
        last = w->tets_live;
        tli_work_destroy(w);
    }
    CHECK_EQ(last, tets);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- the same bytes ---- */

static tl_status count_collapse(void *user, const tl_collapse *c)
{
    size_t *counts = user;
    counts[0]++;
    counts[1] += (size_t)c->kept * 31 + c->gone;
    return TL_OK;
}

static void test_threads(void **state)
{
    static const unsigned threads[] = {1, 2, 3};
    shrunk first = {0};
    tl_mesh *meshes[3];
    tl_ctx *ctxs[3];
    size_t counts[3][2] = {{0}};
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        ctxs[i] = shrink_ctx(threads[i]);
        meshes[i] = rough_grid(ctxs[i], 36);
        tl_simplify_opts opts = shrink_ratio(0.15);
        opts.listener = count_collapse;
        opts.listener_user = counts[i];
        shrunk s = shrink(meshes[i], &opts);
        CHECK_EQ(counts[i][0], s.result.vertices_in - s.result.vertices_out);
        CHECK_EQ(s.result.inverted + s.result.degenerate, 0);
        if (i == 0) {
            first = s;
            continue;
        }
        CHECK_EQ(counts[i][1], counts[0][1]);
        CHECK_EQ(s.result.tets_out, first.result.tets_out);
        CHECK(!memcmp(tl_mesh_tets(s.mesh), tl_mesh_tets(first.mesh),
                      4 * s.result.tets_out * sizeof(tl_lidx)));
        CHECK(!memcmp(tl_mesh_xyz(s.mesh), tl_mesh_xyz(first.mesh),
                      3 * s.result.vertices_out * sizeof(double)));
        shrink_release(&s);
    }
    printf("%zu collapses to %zu tets with 1, 2, 3 threads\n", counts[0][0], first.result.tets_out);
    shrink_release(&first);
    for (size_t i = 0; i < 3; i++) {
        tl_mesh_destroy(meshes[i]);
        tl_ctx_destroy(ctxs[i]);
    }
}

/* The ball of an inner vertex, without the thinning's own gathering. */
static bool list_ball(const tli_work *w, tl_lidx u, tli_ball *b)
{
    const tli_star *s = &w->verts[u].star;
    *b = (tli_ball){.centre = u};
    if (w->verts[u].kind != TLI_FREE || s->count > TLI_BALL_TETS) return false;
    for (uint32_t i = 0; i < s->count; i++) {
        const tl_lidx *q = w->tets[s->tets[i]];
        const uint8_t *f = tli_tet_faces[tli_corner_of(q, u)];
        b->tets[b->tet_count] = s->tets[i];
        for (int j = 0; j < 3; j++) {
            uint32_t l = 0;
            while (l < b->vert_count && b->verts[l] != q[f[j]]) l++;
            if (l == b->vert_count) b->verts[b->vert_count++] = q[f[j]];
            b->corners[j][b->tet_count] = (int32_t)l;
        }
        b->tet_count++;
    }
    return b->vert_count <= TLI_BALL_VERTS;
}

/* Is every tet between the faces and neighbour number to positive, by volumes? */
static bool all_positive(const tli_work *w, const tli_ball *b, uint32_t to)
{
    for (uint32_t i = 0; i < b->tet_count; i++) {
        double p[4][3];
        bool holds = false;
        memcpy(p[0], w->verts[b->verts[to]].xyz, sizeof p[0]);
        for (int j = 0; j < 3; j++) {
            holds = holds || b->corners[j][i] == (int32_t)to;
            memcpy(p[j + 1], w->verts[b->verts[b->corners[j][i]]].xyz, sizeof p[0]);
        }
        if (!holds && !(tl_tet_volume((const double(*)[3])p) > 0)) return false;
    }
    return true;
}

static void test_kernels(void **state)
{
    tl_ctx *ctx = shrink_ctx(1);
    tl_mesh *mesh = rough_grid(ctx, 10);
    tli_work *w = work_of(mesh, NULL, SIZE_MAX);
    uint8_t *inner = calloc(w->vert_count, 1);
    const tli_thin_kernel *kernels[] = {&tli_thin_base, tli_thin_best()};
    static tli_ball balls[2];
    size_t moves = 0, positive = 0, fine = 0;
    (void)state;
    for (size_t v = 0; v < w->vert_count; v++) inner[v] = v % 5 != 0;
    for (tl_lidx u = 0; u < w->vert_count; u++) {
        float least[2];
        for (int k = 0; k < 2; k++) {
            if (!list_ball(w, u, &balls[k])) break;
            least[k] = kernels[k]->weigh(w, inner, &balls[k]);
            kernels[k]->look(&balls[k]);
        }
        if (!balls[1].tet_count || balls[1].centre != u) continue;
        CHECK(least[0] >= 0 && !memcmp(&least[0], &least[1], sizeof least[0]));
        CHECK(!memcmp(&balls[0], &balls[1], sizeof balls[0]));
        for (uint32_t to = 0; to < balls[0].vert_count; to++) {
            bool fits = kernels[0]->fits(&balls[0], to, 1e-3f);
            CHECK_EQ(kernels[1]->fits(&balls[1], to, 1e-3f), fits);
            CHECK(isinf(balls[0].costs[to]) == !inner[balls[0].verts[to]]);
            CHECK(!fits || all_positive(w, &balls[0], to));
            moves++;
            fine += fits;
            positive += all_positive(w, &balls[0], to);
        }
    }
    printf("%zu of %zu moves leave positive tets, %zu fine ones\n", positive, moves, fine);
    CHECK(fine > moves / 20 && fine < positive);
    free(inner);
    tli_work_destroy(w);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_work),
        cmocka_unit_test(test_target),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_kernels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
