/* Adjacency, incidence, boundary and components against brute force, on regular, shuffled and
 * hostile meshes, with several numbers of threads and with failing allocations. */
#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

#define THREADS_MAX 3

/* ---- brute force ---- */

typedef struct face_key {
    tl_lidx v[3];
    tl_lidx face;
} face_key;

static int by_vertices(const void *a, const void *b)
{
    const face_key *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->v[k] != y->v[k]) return x->v[k] < y->v[k] ? -1 : 1;
    return x->face < y->face ? -1 : 1;
}

static int by_index(const void *a, const void *b)
{
    const tl_lidx *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

static bool has_repeat(const tl_lidx *t)
{
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < i; j++)
            if (t[i] == t[j]) return true;
    return false;
}

typedef struct expected {
    tl_lidx *opposite;
    bool *boundary;
    size_t nonmanifold, boundary_count;
} expected;

static expected expect(const make_mesh *m)
{
    expected e = {0};
    face_key *keys = malloc((4 * m->tet_count + 1) * sizeof *keys);
    e.opposite = malloc((4 * m->tet_count + 1) * sizeof *e.opposite);
    e.boundary = calloc(4 * m->tet_count + 1, sizeof *e.boundary);
    size_t count = 0;
    for (size_t f = 0; f < 4 * m->tet_count; f++) {
        e.opposite[f] = TL_NONE;
        const tl_lidx *t = m->tets + f / 4 * 4;
        if (has_repeat(t)) continue;
        face_key *k = &keys[count++];
        size_t n = 0;
        for (size_t c = 0; c < 4; c++)
            if (c != f % 4) k->v[n++] = t[c];
        qsort(k->v, 3, sizeof *k->v, by_index);
        k->face = (tl_lidx)f;
    }
    qsort(keys, count, sizeof *keys, by_vertices);
    for (size_t i = 0, end; i < count; i = end) {
        for (end = i + 1; end < count && !memcmp(keys[i].v, keys[end].v, sizeof keys[i].v);) end++;
        if (end - i == 2) {
            e.opposite[keys[i].face] = keys[i + 1].face;
            e.opposite[keys[i + 1].face] = keys[i].face;
        }
        e.nonmanifold += end - i > 2;
        e.boundary[keys[i].face] = end - i == 1;
        e.boundary_count += end - i == 1;
    }
    free(keys);
    return e;
}

static void forget(expected *e)
{
    free(e->opposite);
    free(e->boundary);
}

/* ---- comparison ---- */

static void compare_adjacency(tl_ctx *ctx, const make_mesh *m, const tl_mesh *mesh,
                              const expected *e)
{
    tl_lidx *opposite = NULL;
    size_t nonmanifold = 99;
    CHECK_OK(ctx, tl_mesh_adjacency(ctx, mesh, &opposite, &nonmanifold));
    CHECK_EQ(nonmanifold, e->nonmanifold);
    for (size_t f = 0; f < 4 * m->tet_count; f++) CHECK_EQ(opposite[f], e->opposite[f]);
    for (int with = 0; with < 2; with++) {
        tl_lidx *triangles = NULL, *faces = NULL;
        size_t count = 0, next = 0;
        CHECK_OK(ctx,
                 tl_mesh_boundary(ctx, mesh, with ? opposite : NULL, &triangles, &faces, &count));
        CHECK_EQ(count, e->boundary_count);
        for (size_t f = 0; f < 4 * m->tet_count; f++) {
            if (!e->boundary[f]) continue;
            CHECK_EQ(faces[next], f);
            /* An even permutation of (triangle, the corner left out) is the tet turned inside out:
             * its outward normal points away from that corner. */
            const tl_lidx *t = m->tets + f / 4 * 4;
            tl_lidx turned[4] = {triangles[3 * next], triangles[3 * next + 1],
                                 triangles[3 * next + 2], t[f % 4]};
            int place[4], inversions = 0;
            for (int i = 0; i < 4; i++)
                for (int c = 0; c < 4; c++)
                    if (turned[i] == t[c]) place[i] = c;
            for (int i = 0; i < 4; i++)
                for (int j = 0; j < i; j++) inversions += place[j] > place[i];
            CHECK_EQ(inversions % 2, 1);
            next++;
        }
        tl_mem_free(ctx, faces);
        tl_mem_free(ctx, triangles);
    }
    tl_mem_free(ctx, opposite);
}

static void compare_incidence(tl_ctx *ctx, const make_mesh *m, const tl_mesh *mesh)
{
    tl_lidx *offsets = NULL, *ids = NULL;
    CHECK_OK(ctx, tl_mesh_incidence(ctx, mesh, &offsets, &ids));
    CHECK_EQ(offsets[0], 0);
    CHECK_EQ(offsets[m->vert_count], 4 * m->tet_count);
    size_t *next = calloc(m->vert_count + 1, sizeof *next);
    for (size_t v = 0; v < m->vert_count; v++) {
        CHECK(offsets[v] <= offsets[v + 1]);
        next[v] = offsets[v];
    }
    for (size_t i = 0; i < 4 * m->tet_count; i++) {
        tl_lidx v = m->tets[i];
        CHECK(next[v] < offsets[v + 1]);
        CHECK_EQ(ids[next[v]], i / 4);
        next[v]++;
    }
    free(next);
    tl_mem_free(ctx, ids);
    tl_mem_free(ctx, offsets);
}

static size_t flood(const make_mesh *m, const expected *e, tl_lidx *component)
{
    tl_lidx *stack = malloc((m->tet_count + 1) * sizeof *stack);
    size_t count = 0;
    for (size_t t = 0; t < m->tet_count; t++) component[t] = TL_NONE;
    for (size_t t = 0; t < m->tet_count; t++) {
        if (component[t] != TL_NONE) continue;
        size_t depth = 0;
        component[t] = (tl_lidx)count;
        stack[depth++] = (tl_lidx)t;
        while (depth) {
            tl_lidx at = stack[--depth];
            for (size_t i = 0; i < 4; i++) {
                tl_lidx other = e->opposite[4 * (size_t)at + i];
                if (other == TL_NONE || component[other / 4] != TL_NONE) continue;
                component[other / 4] = (tl_lidx)count;
                stack[depth++] = other / 4;
            }
        }
        count++;
    }
    free(stack);
    return count;
}

static void compare_components(tl_ctx *ctx, const make_mesh *m, const tl_mesh *mesh,
                               const expected *e)
{
    tl_lidx *want = malloc((m->tet_count + 1) * sizeof *want), *got = NULL;
    size_t count = 99, want_count = flood(m, e, want);
    CHECK_OK(ctx, tl_mesh_components(ctx, mesh, NULL, &got, &count));
    CHECK_EQ(count, want_count);
    for (size_t t = 0; t < m->tet_count; t++) CHECK_EQ(got[t], want[t]);
    CHECK_OK(ctx, tl_mesh_components(ctx, mesh, NULL, NULL, &count));
    CHECK_EQ(count, want_count);
    tl_mem_free(ctx, got);
    free(want);
}

/* Everything, with 1 .. THREADS_MAX threads. Releases m. */
static void compare_all(make_mesh m)
{
    expected e = expect(&m);
    for (unsigned threads = 1; threads <= THREADS_MAX; threads++) {
        tl_ctx *ctx = check_ctx_create(threads);
        tl_mesh *mesh = make_object(ctx, &m, NULL);
        compare_adjacency(ctx, &m, mesh, &e);
        compare_incidence(ctx, &m, mesh);
        compare_components(ctx, &m, mesh, &e);
        tl_mesh_destroy(mesh);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
    forget(&e);
    make_release(&m);
}

/* ---- tests ---- */

static void test_regular(void **state)
{
    (void)state;
    compare_all(make_grid(2));
    compare_all(make_grid(7));
    compare_all(make_grid_cavity(8));
    make_mesh m = make_grid(24); /* several pieces and ranges */
    expected e = expect(&m);
    CHECK_EQ(e.boundary_count, 6 * 23 * 23 * 2);
    CHECK_EQ(e.nonmanifold, 0);
    forget(&e);
    compare_all(m);
}

static void test_shuffled(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 3; seed++) {
        make_mesh m = make_grid_cavity(18);
        make_shuffle(&m, seed);
        compare_all(m);
    }
}

static void test_soup(void **state)
{
    (void)state;
    compare_all(make_soup(4, 9, 1));   /* one tet nine times */
    compare_all(make_soup(5, 400, 2)); /* every face of many tets */
    compare_all(make_soup(9, 60, 3));
    compare_all(make_soup(30, 3000, 4));
    compare_all(make_soup(2000, 3000, 5)); /* mostly loose tets */
}

/* All tets around one vertex: one range gets everything. */
static void test_hub(void **state)
{
    (void)state;
    make_mesh m = make_grid(14);
    for (size_t t = 0; t < m.tet_count; t++) m.tets[4 * t + t % 4] = 5;
    compare_all(m); /* tets that had vertex 5 already now have it twice */
}

/* Vertices spread thinly over a large array. */
static void test_sparse(void **state)
{
    (void)state;
    make_mesh grid = make_grid(9), m = make_room(grid.vert_count * 1000, grid.tet_count);
    for (size_t i = 0; i < 4 * m.tet_count; i++) m.tets[i] = grid.tets[i] * 1000 + 17;
    make_release(&grid);
    compare_all(m);
}

static void test_small(void **state)
{
    (void)state;
    compare_all(make_room(0, 0));
    compare_all(make_room(70000, 0));
    compare_all(make_room(1, 5)); /* all corners at vertex 0 */
    static const tl_lidx tets[4][4] = {{0, 1, 2, 3}, {4, 1, 3, 2}, {0, 0, 2, 3}, {1, 3, 2, 0}};
    for (size_t count = 1; count <= 4; count++) {
        make_mesh m = make_room(6, count);
        memcpy(m.tets, tets, count * sizeof *tets);
        compare_all(m);
    }
}

/* Plain arrays whose indices nobody has proved. */
static void test_bad_index(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(12);
    m.tets[4 * 1234 + 2] = (tl_lidx)m.vert_count;
    tl_lidx *a = NULL, *b = NULL;
    CHECK_STATUS(tl_tets_adjacency(ctx, m.tets, m.tet_count, m.vert_count, &a, NULL), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "tet 1234: corner 2"));
    CHECK_STATUS(tl_tets_incidence(ctx, m.tets, m.tet_count, m.vert_count, &a, &b), TL_ERR_ARG);
    CHECK(!a && !b);
    CHECK_STATUS(tl_tets_incidence(ctx, m.tets, (size_t)TL_MESH_TETS_MAX + 1, 5, &a, &b),
                 TL_ERR_ARG);
    make_release(&m);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- failing allocations ---- */

static tl_status call_adjacency(tl_ctx *ctx, void *arg)
{
    tl_lidx *opposite = NULL;
    tl_status st = tl_mesh_adjacency(ctx, arg, &opposite, NULL);
    CHECK(!st || !opposite);
    tl_mem_free(ctx, opposite);
    return st;
}

static tl_status call_incidence(tl_ctx *ctx, void *arg)
{
    tl_lidx *offsets = NULL, *ids = NULL;
    tl_status st = tl_mesh_incidence(ctx, arg, &offsets, &ids);
    CHECK(!st || (!offsets && !ids));
    tl_mem_free(ctx, ids);
    tl_mem_free(ctx, offsets);
    return st;
}

static tl_status call_boundary(tl_ctx *ctx, void *arg)
{
    tl_lidx *triangles = NULL, *faces = NULL;
    size_t count = 0;
    tl_status st = tl_mesh_boundary(ctx, arg, NULL, &triangles, &faces, &count);
    CHECK(!st || (!triangles && !faces && !count));
    tl_mem_free(ctx, faces);
    tl_mem_free(ctx, triangles);
    return st;
}

static tl_status call_boundary_of(tl_ctx *ctx, void *arg)
{
    tl_lidx *triangles = NULL, *opposite = NULL;
    size_t count = 0;
    tl_status st = tl_mesh_adjacency(ctx, arg, &opposite, NULL);
    if (!st) st = tl_mesh_boundary(ctx, arg, opposite, &triangles, NULL, &count);
    CHECK(!st || !triangles);
    tl_mem_free(ctx, triangles);
    tl_mem_free(ctx, opposite);
    return st;
}

static tl_status call_components(tl_ctx *ctx, void *arg)
{
    tl_lidx *component = NULL;
    size_t count = 0;
    tl_status st = tl_mesh_components(ctx, arg, NULL, &component, &count);
    CHECK(!st || (!component && !count));
    tl_mem_free(ctx, component);
    return st;
}

static void test_failing_allocations(void **state)
{
    (void)state;
    for (unsigned threads = 1; threads <= 2; threads++) {
        fail_alloc f;
        fail_alloc_open(&f, threads);
        make_mesh m = make_grid(15);
        tl_mesh *mesh = make_object(f.ctx, &m, NULL);
        CHECK(fail_alloc_each(&f, call_adjacency, mesh) > 4);
        CHECK(fail_alloc_each(&f, call_incidence, mesh) > 4);
        CHECK(fail_alloc_each(&f, call_boundary, mesh) > 4);
        CHECK(fail_alloc_each(&f, call_boundary_of, mesh) > 6);
        CHECK(fail_alloc_each(&f, call_components, mesh) > 4);
        tl_mesh_destroy(mesh);
        make_release(&m);
        fail_alloc_close(&f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_regular),   cmocka_unit_test(test_shuffled),
        cmocka_unit_test(test_soup),      cmocka_unit_test(test_hub),
        cmocka_unit_test(test_sparse),    cmocka_unit_test(test_small),
        cmocka_unit_test(test_bad_index), cmocka_unit_test(test_failing_allocations),
    };
    return cmocka_run_group_tests_name("mesh_topology", tests, NULL, NULL);
}
