/* Point location against brute force: regular, perturbed, thin, far away, with a cavity, in pieces,
 * with flat, inverted, overlapping and broken tets; from every kind of hint. */
#include "base/base_predicates.h"
#include "mesh/mesh.h"

#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

#define CORNERS(p) ((const double(*)[3])(p))

static bool corners_of(const make_mesh *m, size_t tet, double p[4][3])
{
    bool finite = true;
    for (size_t i = 0; i < 12; i++) {
        p[i / 3][i % 3] = m->xyz[3 * (size_t)m->tets[4 * tet + i / 3] + i % 3];
        finite = finite && isfinite(p[i / 3][i % 3]);
    }
    return finite;
}

static bool holds(const make_mesh *m, size_t tet, const double x[3])
{
    double p[4][3];
    if (!corners_of(m, tet, p)) return false;
    if (tli_orient3d(p[0], p[1], p[2], p[3]) <= 0) return false;
    return tli_orient3d(x, p[1], p[2], p[3]) >= 0 && tli_orient3d(p[0], x, p[2], p[3]) >= 0 &&
           tli_orient3d(p[0], p[1], x, p[3]) >= 0 && tli_orient3d(p[0], p[1], p[2], x) >= 0;
}

static double nearest_distance(const make_mesh *m, const double x[3], tl_lidx *tet)
{
    double best = INFINITY;
    *tet = TL_NONE;
    for (size_t t = 0; t < m->tet_count; t++) {
        double p[4][3], w[4];
        if (!corners_of(m, t, p)) continue;
        double distance = tl_tet_nearest(CORNERS(p), x, w);
        if (distance < best) {
            best = distance;
            *tet = (tl_lidx)t;
        }
    }
    return best;
}

static void check_weights(const make_mesh *m, tl_lidx tet, const double w[4], const double x[3],
                          double distance, double size)
{
    double p[4][3], square = 0;
    CHECK(corners_of(m, tet, p));
    CHECK_NEAR(w[0] + w[1] + w[2] + w[3], 1, 1e-14);
    for (int i = 0; i < 4; i++) CHECK(w[i] >= 0);
    for (int k = 0; k < 3; k++) {
        double q = 0;
        for (int i = 0; i < 4; i++) q += w[i] * (p[i][k] - x[k]);
        square += q * q;
    }
    CHECK_NEAR(sqrt(square), distance, 1e-12 * size);
}

/* One point from one hint. */
static void check_point(const make_mesh *m, const tl_locator *loc, const double x[3], tl_lidx hint,
                        bool inside, double size)
{
    double w[4] = {9, 9, 9, 9}, distance = -1;
    tl_lidx tet = tl_locator_find(loc, x, hint, w);
    CHECK_EQ(tet != TL_NONE, inside);
    if (inside) {
        CHECK(holds(m, tet, x));
        check_weights(m, tet, w, x, 0, size);
    }
    CHECK_EQ(tl_locator_find(loc, x, hint, NULL), tet);
    tl_lidx near = tl_locator_nearest(loc, x, hint, w, &distance);
    if (inside) {
        CHECK_EQ(near, tet);
        CHECK(distance == 0);
        return;
    }
    tl_lidx want = TL_NONE;
    double want_distance = nearest_distance(m, x, &want);
    CHECK_EQ(near, want);
    CHECK(distance == want_distance);
    check_weights(m, near, w, x, distance, size + distance);
}

/* Random points in and around, corners, points on edges and faces, each from several hints. */
static void check_mesh(make_mesh m, size_t point_count, uint64_t seed, double bytes_a_tet)
{
    tl_ctx *ctx = check_ctx_create(1);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_lidx *opposite = NULL;
    tl_locator *loc = NULL;
    CHECK_OK(ctx, tl_mesh_adjacency(ctx, mesh, &opposite, NULL));
    size_t before = tl_ctx_current_bytes(ctx);
    CHECK_OK(ctx, tl_locator_create(ctx, mesh, opposite, &loc));
    if (bytes_a_tet > 0)
        CHECK_BOUND("locator bytes a tet",
                    (double)(tl_ctx_current_bytes(ctx) - before) / (double)m.tet_count,
                    bytes_a_tet);
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double size = 0;
    for (size_t i = 0; i < 3 * m.vert_count; i++) {
        if (!isfinite(m.xyz[i])) continue;
        low[i % 3] = fmin(low[i % 3], m.xyz[i]);
        high[i % 3] = fmax(high[i % 3], m.xyz[i]);
    }
    for (int k = 0; k < 3; k++) size = fmax(size, high[k] - low[k]);
    size_t inside_count = 0;
    tl_lidx last = TL_NONE;
    for (size_t i = 0; i < point_count; i++) {
        double x[3], p[4][3];
        size_t at = (size_t)(make_random(&seed) % m.tet_count);
        bool finite = corners_of(&m, at, p);
        for (int k = 0; k < 3; k++) {
            double away = low[k] + (high[k] - low[k]) * (1.4 * make_uniform(&seed) - 0.2);
            double on[4] = {away, p[0][k], 0.5 * p[1][k] + 0.5 * p[2][k],
                            0.25 * p[0][k] + 0.5 * p[1][k] + 0.25 * p[3][k]};
            x[k] = on[finite ? i % 4 : 0];
        }
        bool inside = false;
        for (size_t t = 0; t < m.tet_count && !inside; t++) inside = holds(&m, t, x);
        inside_count += inside;
        check_point(&m, loc, x, TL_NONE, inside, size);
        check_point(&m, loc, x, (tl_lidx)at, inside, size);
        check_point(&m, loc, x, last, inside, size);
        check_point(&m, loc, x, (tl_lidx)(make_random(&seed) % m.tet_count), inside, size);
        check_point(&m, loc, x, TL_NONE - 1, inside, size);
        last = tl_locator_find(loc, x, last, NULL);
    }
    printf("%zu of %zu points inside\n", inside_count, point_count);
    tl_locator_destroy(loc);
    CHECK_EQ(tl_ctx_current_bytes(ctx), before);
    tl_mem_free(ctx, opposite);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
    make_release(&m);
}

static void test_grid(void **state)
{
    (void)state;
    check_mesh(make_grid(2), 200, 1, 0);
    make_mesh m = make_grid(13);
    check_mesh(m, 200, 2, 24);
    m = make_grid(8);
    make_perturb(&m, 0.09 / 7, 1);
    make_shuffle(&m, 2);
    check_mesh(m, 300, 3, 0);
}

static void test_cavity(void **state)
{
    (void)state;
    make_mesh m = make_grid_cavity(10);
    make_perturb(&m, 0.08 / 9, 4);
    check_mesh(m, 400, 5, 0);
}

/* Every third tet alone is left: many components, walks that end at once. */
static void test_pieces(void **state)
{
    (void)state;
    make_mesh m = make_grid(8);
    make_shuffle(&m, 7);
    m.tet_count /= 3;
    check_mesh(m, 400, 6, 0);
}

static void test_scales(void **state)
{
    (void)state;
    static const double scales[] = {1e-6, 1, 1e6}, shifts[] = {0, 1e6, -1e3};
    for (int s = 0; s < 3; s++) {
        make_mesh m = make_grid(6);
        make_perturb(&m, 0.08 / 5, 8);
        for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] = scales[s] * m.xyz[i] + shifts[s];
        check_mesh(m, 100, 9, 0);
    }
    make_mesh layer = make_grid(9); /* layers of 1e-6 and less in a domain of 100 */
    for (size_t i = 0; i < 3 * layer.vert_count; i++)
        layer.xyz[i] = i % 3 == 2 ? pow(10, 12 * layer.xyz[i] - 10) : 100 * layer.xyz[i];
    check_mesh(layer, 300, 10, 0);
}

/* Flat, inverted, doubled, crossing tets, tets with a vertex twice, vertices that are no numbers.
 */
static void test_hostile(void **state)
{
    (void)state;
    make_mesh m = make_grid(6);
    make_perturb(&m, 0.6 / 5, 11); /* many inverted */
    check_mesh(m, 300, 12, 0);
    m = make_grid(6);
    for (size_t i = 2; i < 3 * m.vert_count; i += 3)
        if (m.xyz[i] > 0.5) m.xyz[i] = 0.5; /* all flat above */
    check_mesh(m, 300, 13, 0);
    m = make_grid(6);
    m.xyz[3 * 86] = NAN;
    m.xyz[3 * 90 + 1] = -INFINITY;
    for (size_t t = 0; t < m.tet_count; t += 9) m.tets[4 * t] = m.tets[4 * t + 1];
    for (size_t t = 0; t + 1 < m.tet_count; t += 11) memcpy(m.tets + 4 * t, m.tets + 4 * t + 4, 16);
    check_mesh(m, 300, 14, 0);
    check_mesh(make_soup(40, 200, 15), 300, 16, 0);
}

static void test_nothing_to_find(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    for (int kind = 0; kind < 2; kind++) {
        make_mesh m = kind ? make_grid(3) : make_room(5, 0);
        for (size_t i = 0; kind && i < 3 * m.vert_count; i++) m.xyz[i] = NAN;
        tl_mesh *mesh = make_object(ctx, &m, NULL);
        tl_locator *loc = NULL;
        CHECK_OK(ctx, tl_locator_create(ctx, mesh, NULL, &loc));
        double x[3] = {0.5, 0.5, 0.5}, w[4], distance = 0;
        CHECK_EQ(tl_locator_find(loc, x, 0, w), TL_NONE);
        CHECK_EQ(tl_locator_nearest(loc, x, 0, w, &distance), TL_NONE);
        CHECK(isinf(distance));
        tl_locator_destroy(loc);
        tl_mesh_destroy(mesh);
        make_release(&m);
    }
    make_mesh m = make_grid(3);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_locator *loc = NULL;
    CHECK_OK(ctx, tl_locator_create(ctx, mesh, NULL, &loc));
    for (int k = 0; k < 3; k++) {
        double x[3] = {0.5, 0.5, 0.5};
        x[k] = k == 1 ? INFINITY : NAN;
        CHECK_EQ(tl_locator_find(loc, x, 3, NULL), TL_NONE);
        CHECK_EQ(tl_locator_nearest(loc, x, 3, NULL, NULL), TL_NONE);
    }
    tl_locator_destroy(loc);
    tl_locator_destroy(NULL);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* The tree is the same for any number of threads: so are the answers without hints. */
static void test_threads(void **state)
{
    (void)state;
    make_mesh m = make_grid_cavity(20);
    tl_lidx *first = NULL;
    for (unsigned threads = 1; threads <= 3; threads++) {
        tl_ctx *ctx = check_ctx_create(threads);
        tl_mesh *mesh = make_object(ctx, &m, NULL);
        tl_locator *loc = NULL;
        CHECK_OK(ctx, tl_locator_create(ctx, mesh, NULL, &loc));
        tl_lidx *found = malloc(2000 * sizeof *found);
        uint64_t seed = 17;
        for (size_t i = 0; i < 2000; i++) {
            double x[3];
            for (int k = 0; k < 3; k++) x[k] = (double)(make_random(&seed) % 39) / 38;
            found[i] = i % 2 ? tl_locator_find(loc, x, TL_NONE, NULL)
                             : tl_locator_nearest(loc, x, TL_NONE, NULL, NULL);
        }
        if (first) CHECK_EQ(memcmp(first, found, 2000 * sizeof *found), 0);
        if (first)
            free(found);
        else
            first = found;
        tl_locator_destroy(loc);
        tl_mesh_destroy(mesh);
        tl_ctx_destroy(ctx);
    }
    free(first);
    make_release(&m);
}

/* Tets that a box was said to touch, up to a limit. */
typedef struct visit {
    uint8_t *seen;
    size_t count, limit;
} visit;

static bool see(void *user, tl_lidx tet)
{
    visit *v = user;
    CHECK(!v->seen[tet]);
    v->seen[tet] = 1;
    return ++v->count < v->limit;
}

/* All tets that touch a box are visited, each once; a visitor may end it. */
static void test_boxes(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(12);
    uint64_t seed = 9;
    size_t visited = 0, touched = 0;
    make_perturb(&m, 0.02, 5);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_locator *loc = NULL;
    CHECK_OK(ctx, tl_locator_create(ctx, mesh, NULL, &loc));
    visit v = {calloc(m.tet_count, 1), 0, 0};
    CHECK(v.seen);
    for (int i = 0; i < 100; i++) {
        double low[3], high[3];
        for (int k = 0; k < 3; k++) {
            low[k] = 1.2 * make_uniform(&seed) - 0.1;
            high[k] = low[k] + 0.2 * make_uniform(&seed);
        }
        memset(v.seen, 0, m.tet_count);
        v.count = 0;
        v.limit = SIZE_MAX;
        tli_locator_box(loc, low, high, see, &v);
        visited += v.count;
        for (size_t t = 0; t < m.tet_count; t++) {
            double p[4][3];
            bool touches = corners_of(&m, t, p);
            for (int k = 0; touches && k < 3; k++)
                touches = fmin(fmin(p[0][k], p[1][k]), fmin(p[2][k], p[3][k])) <= high[k] &&
                          fmax(fmax(p[0][k], p[1][k]), fmax(p[2][k], p[3][k])) >= low[k];
            CHECK(v.seen[t] || !touches);
            touched += touches;
        }
        if (v.count < 3) continue;
        memset(v.seen, 0, m.tet_count);
        v.count = 0;
        v.limit = 2;
        tli_locator_box(loc, low, high, see, &v);
        CHECK_EQ(v.count, 2);
    }
    CHECK(touched > 1000 && visited < 4 * touched);
    free(v.seen);
    tl_locator_destroy(loc);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static tl_status call_create(tl_ctx *ctx, void *arg)
{
    tl_locator *loc = NULL;
    tl_status st = tl_locator_create(ctx, arg, NULL, &loc);
    CHECK_EQ(loc == NULL, st != TL_OK);
    tl_locator_destroy(loc);
    return st;
}

static void test_failing_allocations(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 2);
    make_mesh m = make_grid(12);
    tl_mesh *mesh = make_object(f.ctx, &m, NULL);
    CHECK(fail_alloc_each(&f, call_create, mesh) > 5);
    tl_mesh_destroy(mesh);
    make_release(&m);
    fail_alloc_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grid),    cmocka_unit_test(test_cavity),
        cmocka_unit_test(test_pieces),  cmocka_unit_test(test_scales),
        cmocka_unit_test(test_hostile), cmocka_unit_test(test_nothing_to_find),
        cmocka_unit_test(test_threads), cmocka_unit_test(test_failing_allocations),
        cmocka_unit_test(test_boxes),
    };
    return cmocka_run_group_tests_name("mesh_locator", tests, NULL, NULL);
}
