/* tl_mesh_measure on meshes whose numbers are known and against brute force; tl_mesh_check on a
 * good mesh with one thing damaged at a time. */
#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

/* With one to three threads, which must not matter. */
static tl_mesh_stats measure(const make_mesh *m)
{
    tl_mesh_stats stats, other;
    for (unsigned threads = 1; threads <= 3; threads++) {
        tl_ctx *ctx = check_ctx_create(threads);
        tl_mesh *mesh = make_object(ctx, m, NULL);
        CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, threads == 1 ? &stats : &other));
        if (threads > 1) CHECK_EQ(memcmp(&stats, &other, sizeof stats), 0);
        tl_mesh_destroy(mesh);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
    return stats;
}

static void test_grids(void **state)
{
    (void)state;
    for (size_t n = 2; n <= 32; n = 3 * n - 2) { /* 2, 4, 10, 28 */
        make_mesh m = make_grid(n);
        tl_mesh_stats s = measure(&m);
        CHECK_NEAR(s.volume, 1, 1e-12);
        CHECK_NEAR(s.boundary_area, 6, 1e-12);
        CHECK_NEAR(s.diagonal, sqrt(3.0), 1e-15);
        CHECK_EQ(s.boundary_triangles, 12 * (n - 1) * (n - 1));
        CHECK_EQ(s.components, 1);
        CHECK_EQ(s.inverted + s.degenerate + s.unused_verts + s.duplicate_verts + s.nonfinite_verts,
                 0);
        CHECK_EQ(s.nonmanifold_faces + s.nonmanifold_edges + s.nonmanifold_verts, 0);
        CHECK_EQ(s.interface_triangles, 0);
        CHECK_NEAR(s.quality_min, 12 * cbrt(0.25) / 9, 1e-12);
        CHECK_NEAR(s.quality_median, 12 * cbrt(0.25) / 9, 1e-12);
        CHECK_NEAR(s.dihedral_min, acos(1 / sqrt(3.0)), 1e-12);
        CHECK_NEAR(s.dihedral_max, acos(0.0), 1e-12);
        make_release(&m);
    }
}

static void test_cavity_and_regions(void **state)
{
    (void)state;
    make_mesh m = make_grid_cavity(13);
    make_two_regions(&m);
    tl_mesh_stats s = measure(&m);
    CHECK_NEAR(s.volume, 26.0 / 27, 1e-12);
    CHECK_NEAR(s.boundary_area, 6 + 6.0 / 9, 1e-12);
    CHECK_EQ(s.boundary_triangles, 12 * 12 * 12 + 12 * 4 * 4);
    CHECK_EQ(s.interface_triangles, 2 * (12 * 12 - 4 * 4));
    CHECK_EQ(s.unused_verts, 27);
    CHECK_EQ(s.components, 1);
    CHECK_EQ(s.nonmanifold_edges + s.nonmanifold_verts, 0);
    make_release(&m);
}

static void test_bad_vertices(void **state)
{
    (void)state;
    make_mesh m = make_grid(5);
    m.xyz[3 * 31] = m.xyz[3 * 32];
    m.xyz[3 * 0] = -0.0; /* where 0 is */
    m.xyz[3 * 124] = NAN;
    m.xyz[3 * 62 + 1] = INFINITY;
    tl_mesh_stats s = measure(&m);
    CHECK_EQ(s.nonfinite_verts, 2);
    CHECK_EQ(s.duplicate_verts, 1);
    CHECK(s.degenerate > 0 && isfinite(s.volume) && isfinite(s.quality_median));
    CHECK(isfinite(s.bounds[1]) && isfinite(s.boundary_area));
    for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] = 7;
    s = measure(&m);
    CHECK_EQ(s.duplicate_verts, 124);
    CHECK_EQ(s.degenerate, m.tet_count);
    CHECK(s.diagonal == 0 && s.volume == 0 && s.dihedral_max == 0);
    for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] = NAN;
    s = measure(&m);
    CHECK_EQ(s.nonfinite_verts, 125);
    CHECK(s.diagonal == 0 && s.quality_min == 0 && s.quality_median == 0);
    make_release(&m);
    m = make_room(9, 0);
    s = measure(&m);
    CHECK_EQ(s.unused_verts, 9);
    CHECK_EQ(s.components, 0);
    make_release(&m);
}

static void test_inverted(void **state)
{
    (void)state;
    make_mesh m = make_grid(4);
    for (size_t t = 0; t < m.tet_count; t += 5) {
        tl_lidx kept = m.tets[4 * t];
        m.tets[4 * t] = m.tets[4 * t + 1];
        m.tets[4 * t + 1] = kept;
    }
    tl_mesh_stats s = measure(&m);
    CHECK_EQ(s.inverted, 27);
    CHECK_NEAR(s.quality_min, -12 * cbrt(0.25) / 9, 1e-12);
    CHECK_NEAR(s.volume, 1 - 27 * 2 / 6.0 / 27, 1e-12);
    make_release(&m);
}

static void test_nonmanifold(void **state)
{
    (void)state;
    /* three tets on a face, two on an edge only, two on a vertex only */
    static const tl_lidx tets[3][3][4] = {{{0, 1, 2, 3}, {0, 2, 1, 4}, {0, 1, 2, 5}},
                                          {{0, 1, 2, 3}, {0, 1, 4, 5}},
                                          {{0, 1, 2, 3}, {0, 4, 5, 6}}};
    static const size_t counts[3] = {3, 2, 2}, faces[3] = {1, 0, 0}, edges[3] = {3, 1, 0},
                        verts[3] = {0, 0, 1};
    static const size_t triangles[3] = {9, 8, 8}, components[3] = {3, 2, 2};
    for (int i = 0; i < 3; i++) {
        make_mesh m = make_room(7, counts[i]);
        uint64_t seed = 1;
        for (size_t k = 0; k < 21; k++) m.xyz[k] = make_uniform(&seed);
        memcpy(m.tets, tets[i], 16 * counts[i]);
        tl_mesh_stats s = measure(&m);
        CHECK_EQ(s.nonmanifold_faces, faces[i]);
        CHECK_EQ(s.nonmanifold_edges, edges[i]);
        CHECK_EQ(s.nonmanifold_verts, verts[i]);
        CHECK_EQ(s.boundary_triangles, triangles[i]);
        CHECK_EQ(s.components, components[i]);
        make_release(&m);
    }
}

/* ---- brute force ---- */

static bool shares_edge(const tl_lidx *a, const tl_lidx *b, tl_lidx v)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (a[i] == b[j] && a[i] != v) return true;
    return false;
}

static bool has(const tl_lidx *triangle, tl_lidx v)
{
    return triangle[0] == v || triangle[1] == v || triangle[2] == v;
}

/* Fans of v by flooding over edges at v; *bad if an edge at v has other than two triangles. */
static size_t count_fans(const tl_lidx *triangles, size_t count, tl_lidx v, size_t vert_count,
                         bool *bad)
{
    size_t fans = 0;
    bool *seen = calloc(count + 1, sizeof *seen);
    for (size_t i = 0; i < count; i++) {
        if (seen[i] || !has(triangles + 3 * i, v)) continue;
        fans++;
        seen[i] = true;
        for (bool grew = true; grew;) {
            grew = false;
            for (size_t a = 0; a < count; a++)
                for (size_t b = 0; b < count; b++)
                    if (seen[a] && !seen[b] && has(triangles + 3 * a, v) &&
                        has(triangles + 3 * b, v) &&
                        shares_edge(triangles + 3 * a, triangles + 3 * b, v))
                        seen[b] = grew = true;
        }
    }
    free(seen);
    *bad = false;
    for (tl_lidx w = 0; w < vert_count; w++) {
        size_t around = 0;
        for (size_t i = 0; i < count && w != v; i++)
            around += has(triangles + 3 * i, v) && has(triangles + 3 * i, w);
        *bad = *bad || (around != 0 && around != 2);
    }
    return fans;
}

static int by_value(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

static void check_soup(make_mesh m)
{
    tl_mesh_stats s = measure(&m);
    tl_ctx *ctx = check_ctx_create(1);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_lidx *triangles = NULL;
    size_t count = 0, edges = 0, verts = 0, inverted = 0;
    CHECK_OK(ctx, tl_mesh_boundary(ctx, mesh, NULL, &triangles, NULL, &count));
    for (tl_lidx v = 0; v < m.vert_count; v++) {
        bool bad = false;
        verts += count_fans(triangles, count, v, m.vert_count, &bad) > 1 && !bad;
        for (tl_lidx w = 0; w < v; w++) {
            size_t around = 0;
            for (size_t i = 0; i < count; i++)
                around += has(triangles + 3 * i, v) && has(triangles + 3 * i, w);
            edges += around != 0 && around != 2;
        }
    }
    CHECK_EQ(s.boundary_triangles, count);
    CHECK_EQ(s.nonmanifold_edges, edges);
    CHECK_EQ(s.nonmanifold_verts, verts);
    double *quality = malloc((m.tet_count + 1) * sizeof *quality), low = INFINITY, high = 0,
           volume = 0;
    for (size_t t = 0; t < m.tet_count; t++) {
        double p[4][3], smallest, largest;
        for (size_t i = 0; i < 12; i++)
            p[i / 3][i % 3] = m.xyz[3 * (size_t)m.tets[4 * t + i / 3] + i % 3];
        quality[t] = tl_tet_quality((const double(*)[3])p);
        volume += tl_tet_volume((const double(*)[3])p);
        inverted += quality[t] < 0;
        tl_tet_dihedral((const double(*)[3])p, &smallest, &largest);
        low = fmin(low, smallest);
        high = fmax(high, largest);
    }
    qsort(quality, m.tet_count, sizeof *quality, by_value);
    CHECK_EQ(s.inverted, inverted);
    CHECK(s.quality_min == quality[0]);
    CHECK(s.quality_median == quality[(m.tet_count - 1) / 2] / 2 + quality[m.tet_count / 2] / 2);
    CHECK_NEAR(s.dihedral_min, low, 1e-12);
    CHECK_NEAR(s.dihedral_max, high, 1e-12);
    CHECK_NEAR(s.volume, volume, 1e-12);
    free(quality);
    tl_mem_free(ctx, triangles);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
    make_release(&m);
}

static void test_brute_force(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 6; seed++) {
        check_soup(make_soup(12, 4 + seed, seed));
        check_soup(make_soup(40, 14 + seed, seed));
        make_mesh m =
            make_grid(4); /* a random part of a grid: vertices and edges that only touch */
        make_perturb(&m, 0.02, seed);
        make_shuffle(&m, seed);
        m.tet_count = 60;
        check_soup(m);
    }
}

/* ---- check ---- */

static void expect_fault(const make_mesh *m, const char *says)
{
    for (unsigned threads = 1; threads <= 2; threads++) {
        tl_ctx *ctx = check_ctx_create(threads);
        tl_mesh *mesh = make_object(ctx, m, NULL);
        CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FAST));
        tl_status st = tl_mesh_check(ctx, mesh, TL_CHECK_FULL);
        CHECK_STATUS(st, says ? TL_ERR_DATA : TL_OK);
        if (says && !strstr(tl_ctx_message(ctx), says))
            fail_msg("'%s' does not say '%s'", tl_ctx_message(ctx), says);
        tl_mesh_destroy(mesh);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
}

static void test_check(void **state)
{
    (void)state;
    make_mesh m = make_grid(28); /* several pieces */
    tl_lidx kept[4];
    size_t at = 4 * 70003;
    expect_fault(&m, NULL);
    memcpy(kept, m.tets + at, sizeof kept);
    m.xyz[3 * 20000 + 1] = NAN;
    m.xyz[3 * 21000 + 1] = NAN;
    expect_fault(&m, "vertex 20000 ");
    m.xyz[3 * 20000 + 1] = 20000 / 28 % 28 / 27.0;
    m.xyz[3 * 21000 + 1] = 21000 / 28 % 28 / 27.0;
    expect_fault(&m, NULL);
    m.tets[at] = m.tets[at + 1];
    expect_fault(&m, "tet 70003 has a vertex twice");
    memcpy(m.tets + at, kept, sizeof kept);
    m.tets[at] = kept[1];
    m.tets[at + 1] = kept[0];
    expect_fault(&m, "tet 70003 is inverted");
    memcpy(m.tets + at, kept, sizeof kept);
    memcpy(m.tets + at, m.tets, sizeof kept); /* the corner tet: its inner face has three now */
    expect_fault(&m, "of tet 0 has more than two tets");
    memcpy(m.tets + at, kept, sizeof kept);
    for (size_t i = 0; i < 3 * m.vert_count; i += 3)
        if (m.xyz[i] > 0.98) m.xyz[i] = 26.0 / 27;
    expect_fault(&m, "is flat");
    make_release(&m);
    m = make_room(4, 2);
    for (size_t k = 0; k < 3; k++) m.xyz[3 * (k + 1) + k] = 1;
    for (size_t i = 0; i < 8; i++) m.tets[i] = (tl_lidx)(i % 4);
    expect_fault(&m, "tet 0 is there twice");
    make_release(&m);
    m = make_room(0, 0);
    expect_fault(&m, NULL);
    make_release(&m);
}

static tl_status call_measure(tl_ctx *ctx, void *arg)
{
    tl_mesh_stats stats;
    return tl_mesh_measure(ctx, arg, &stats);
}

static tl_status call_check(tl_ctx *ctx, void *arg)
{
    return tl_mesh_check(ctx, arg, TL_CHECK_FULL);
}

static void test_failing_allocations(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 2);
    make_mesh m = make_grid(12);
    tl_mesh *mesh = make_object(f.ctx, &m, NULL);
    CHECK(fail_alloc_each(&f, call_measure, mesh) > 10);
    CHECK(fail_alloc_each(&f, call_check, mesh) > 4);
    tl_mesh_destroy(mesh);
    make_release(&m);
    fail_alloc_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grids),        cmocka_unit_test(test_cavity_and_regions),
        cmocka_unit_test(test_bad_vertices), cmocka_unit_test(test_inverted),
        cmocka_unit_test(test_nonmanifold),  cmocka_unit_test(test_brute_force),
        cmocka_unit_test(test_check),        cmocka_unit_test(test_failing_allocations),
    };
    return cmocka_run_group_tests_name("mesh_measure", tests, NULL, NULL);
}
