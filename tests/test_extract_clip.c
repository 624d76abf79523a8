/* Parts of a mesh: cubes clipped by planes, whose volumes and areas are known, on all kinds of
 * planes and meshes; thresholds and regions; points, lines and triangles. */
#include "check.h"

#include "tetralod/extract.h"

#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

static double linear(const double x[3])
{
    return 2 * x[0] - 3 * x[1] + 5 * x[2];
}

static double radius(const double x[3])
{
    return hypot(hypot(x[0] - 0.5, x[1] - 0.5), x[2] - 0.5);
}

static tl_mesh_stats stats_of(tl_ctx *ctx, const tl_mesh *mesh)
{
    tl_mesh_stats stats;
    CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
    return stats;
}

/* A cube of n^3 vertices in random order, with regions, a channel on tets that counts them, and the
 * label "bottom" of the faces at z = 0. */
static tl_mesh *make_cube(tl_ctx *ctx, make_mesh *m, size_t n, double perturb)
{
    *m = make_grid(n);
    make_perturb(m, perturb / (double)n, 3);
    make_two_regions(m);
    make_shuffle(m, 4);
    tl_mesh *mesh = make_object(ctx, m, linear);
    double *numbers = malloc(m->tet_count * sizeof *numbers);
    for (size_t t = 0; t < m->tet_count; t++) numbers[t] = (double)t;
    tl_channel channel = {"number", "", 1, TL_ON_TET, TL_I32, numbers};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    CHECK_OK(ctx, tl_mesh_set_region_name(mesh, 2, "right"));
    free(numbers);
    tl_lidx *triangles, *faces;
    size_t count, bottom = 0;
    CHECK_OK(ctx, tl_mesh_boundary(ctx, mesh, NULL, &triangles, &faces, &count));
    for (size_t f = 0; f < count; f++) {
        double top = 0;
        for (size_t k = 0; k < 3; k++)
            top = fmax(top, m->xyz[3 * (size_t)triangles[3 * f + k] + 2]);
        if (top < 0.5 / (double)n) faces[bottom++] = faces[f];
    }
    tl_label label = {"bottom", 5, bottom, faces};
    CHECK_OK(ctx, tl_mesh_add_label(mesh, &label));
    tl_mem_free(ctx, faces);
    tl_mem_free(ctx, triangles);
    return mesh;
}

static double label_area(const tl_mesh *mesh)
{
    static const int corners[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    const tl_label *label = tl_mesh_label(mesh, 0);
    double sum = 0;
    for (size_t f = 0; f < label->face_count; f++) {
        const double *p[3];
        for (int k = 0; k < 3; k++)
            p[k] =
                tl_mesh_xyz(mesh) +
                3 * (size_t)tl_mesh_tets(
                        mesh)[(label->faces[f] & ~3u) + (tl_lidx)corners[label->faces[f] & 3][k]];
        double u[2] = {p[1][0] - p[0][0], p[1][1] - p[0][1]};
        double v[2] = {p[2][0] - p[0][0], p[2][1] - p[0][1]};
        sum += fabs(u[0] * v[1] - u[1] * v[0]) / 2;
    }
    return sum;
}

/* ---- planes ---- */

/* Fields, regions and cells of a clipped cube are those of the cube. */
static void check_carried(const tl_mesh *mesh, const make_mesh *m)
{
    const tl_channel *f = tl_mesh_channel_by_name(mesh, "f");
    const double *numbers = tl_mesh_channel_by_name(mesh, "number")->values;
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++)
        CHECK_NEAR(f->values[v], linear(tl_mesh_xyz(mesh) + 3 * v), 1e-12);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        size_t parent = (size_t)numbers[t];
        double p[4][3], x[3] = {0}, weights[4];
        CHECK_EQ(tl_mesh_regions(mesh)[t], m->regions[parent]);
        for (size_t i = 0; i < 4; i++)
            for (size_t k = 0; k < 3; k++) {
                p[i][k] = m->xyz[3 * (size_t)m->tets[4 * parent + i] + k];
                x[k] += tl_mesh_xyz(mesh)[3 * (size_t)tl_mesh_tets(mesh)[4 * t + i] + k] / 4;
            }
        CHECK(tl_tet_weights((const double(*)[3])p, x, weights));
        for (int i = 0; i < 4; i++) CHECK(weights[i] > 0);
    }
    CHECK(strcmp(tl_mesh_region_name(mesh, 2), "right") == 0);
}

static void planes_through_a_cube(void **state)
{
    (void)state;
    const double hexagon = 1.5 * sqrt(3) / 2;
    static const struct {
        tl_half_space side;
        double volume, area, bottom;
    } cases[] = {
        {{{1, 1, 1}, 1.5}, 0.5, 3, 0.875},
        {{{-1, -1, -1}, -1.5}, 0.5, 3, 0.125},
        {{{1, 0, 0}, 0.3}, 0.3, 2 * 0.3 * 2 + 2, 0.3}, /* between vertices */
        {{{3, 0, 0}, 1.5}, 0.5, 4, 0.5},               /* through vertices and faces */
        {{{1, 1, 0}, 1}, 0.5, 3, 0.5},                 /* through diagonals of faces */
        {{{0, 0, -1}, -0.9}, 0.1, 2 + 0.4, 0},         /* nothing of the label */
        {{{0, 0, 1}, 0}, 0, 0, 0},                     /* only touched */
        {{{0, 0, 1}, 1}, 1, 6, 1},                     /* the whole */
        {{{0, 0, 1}, 7}, 1, 6, 1},
        {{{0, 1, 0}, -1}, 0, 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tl_ctx *ctx = check_ctx_create(1 + (unsigned)i % 3);
        make_mesh m;
        tl_mesh *mesh = make_cube(ctx, &m, 9, 0), *clipped = NULL;
        CHECK_OK(ctx, tl_mesh_clip(ctx, mesh, &cases[i].side, 1, &clipped));
        CHECK_OK(ctx, tl_mesh_check(ctx, clipped, TL_CHECK_FULL));
        tl_mesh_stats stats = stats_of(ctx, clipped);
        double area = cases[i].area + (i < 2 ? hexagon : i == 4 ? sqrt(2) : 0);
        CHECK_NEAR(stats.volume, cases[i].volume, 1e-13);
        CHECK_NEAR(stats.boundary_area, area, 1e-12); /* no face inside is open */
        CHECK_EQ(stats.nonmanifold_edges + stats.unused_verts + stats.duplicate_verts, 0);
        CHECK_NEAR(label_area(clipped), cases[i].bottom, 1e-13);
        check_carried(clipped, &m);
        tl_mesh_destroy(clipped);
        tl_mesh_destroy(mesh);
        make_release(&m);
        check_ctx_destroy(ctx);
    }
}

/* Both sides of planes through a mesh without any order are the whole; several planes at once cut a
 * box out; one result with any number of threads. */
static void sides_add_up(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m;
    tl_mesh *mesh = make_cube(ctx, &m, 14, 0.08), *one, *other;
    tl_mesh_stats whole = stats_of(ctx, mesh);
    uint64_t seed = 5;
    for (int i = 0; i < 8; i++) {
        tl_half_space side = {{0}, 0}, back;
        for (int k = 0; k < 3; k++) {
            side.normal[k] = 2 * make_uniform(&seed) - 1;
            side.offset += 0.5 * side.normal[k];
        }
        back = side;
        back.offset = -side.offset;
        for (int k = 0; k < 3; k++) back.normal[k] = -side.normal[k];
        CHECK_OK(ctx, tl_mesh_clip(ctx, mesh, &side, 1, &one));
        CHECK_OK(ctx, tl_mesh_clip(ctx, mesh, &back, 1, &other));
        tl_mesh_stats a = stats_of(ctx, one), b = stats_of(ctx, other);
        CHECK_NEAR(a.volume + b.volume, whole.volume, 1e-12);
        CHECK_EQ(a.inverted + b.inverted + a.nonmanifold_edges + b.nonmanifold_edges, 0);
        /* both have the cut: what is more than the whole's area is twice that of the plane's part
         */
        tl_polydata *cut = NULL;
        double *values = malloc(m.vert_count * sizeof *values), zero = 0;
        double origin[3] = {0.5, 0.5, 0.5};
        tl_slice_opts opts = tl_slice_opts_defaults();
        opts.values = &zero;
        opts.value_count = 1;
        CHECK_OK(ctx, tl_plane_distance(ctx, mesh, origin, side.normal, values));
        CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, values, &opts, &cut));
        CHECK_NEAR(a.boundary_area + b.boundary_area - whole.boundary_area,
                   2 * tl_polydata_size(cut), 1e-10);
        tl_polydata_destroy(ctx, cut);
        free(values);
        tl_mesh_destroy(other);
        tl_mesh_destroy(one);
    }
    static const tl_half_space box[6] = {{{1, 0, 0}, 0.7}, {{-1, 0, 0}, -0.21},
                                         {{0, 1, 0}, 0.6}, {{0, -1, 0}, -0.4},
                                         {{0, 0, 1}, 0.8}, {{0, 0, -1}, -0.3}};
    CHECK_OK(ctx, tl_mesh_clip(ctx, mesh, box, 6, &one));
    tl_mesh_stats stats = stats_of(ctx, one);
    CHECK_NEAR(stats.volume, 0.49 * 0.2 * 0.5, 1e-13);
    CHECK_NEAR(stats.boundary_area, 2 * (0.49 * 0.2 + 0.49 * 0.5 + 0.2 * 0.5), 1e-12);
    for (unsigned threads = 1; threads <= 3; threads++) {
        tl_ctx *own = check_ctx_create(threads);
        CHECK_OK(own, tl_mesh_clip(own, mesh, box, 6, &other));
        CHECK_EQ(tl_mesh_vert_count(one), tl_mesh_vert_count(other));
        CHECK_EQ(tl_mesh_tet_count(one), tl_mesh_tet_count(other));
        CHECK(memcmp(tl_mesh_xyz(one), tl_mesh_xyz(other),
                     3 * tl_mesh_vert_count(one) * sizeof(double)) == 0);
        CHECK(memcmp(tl_mesh_tets(one), tl_mesh_tets(other),
                     4 * tl_mesh_tet_count(one) * sizeof(tl_lidx)) == 0);
        tl_mesh_destroy(other);
        check_ctx_destroy(own);
    }
    tl_mesh_destroy(one);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void clips_of_anything(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_wreck(60, 500, 3);
    m.xyz[61] = (double)INFINITY;
    tl_mesh *mesh = make_object(ctx, &m, linear), *clipped = NULL;
    static const tl_half_space side = {{1, 2, -1}, 1}, flat = {{0, 0, 0}, 1},
                               wild = {{1, 0, 0}, (double)NAN};
    CHECK_OK(ctx, tl_mesh_clip(ctx, mesh, &side, 1, &clipped));
    CHECK(tl_mesh_tet_count(clipped) > 100);
    for (size_t v = 0; v < tl_mesh_vert_count(clipped); v++) {
        const double *x = tl_mesh_xyz(clipped) + 3 * v;
        CHECK(x[0] + 2 * x[1] - x[2] < 1 + 1e-12);
    }
    tl_mesh_destroy(clipped);
    CHECK_STATUS(tl_mesh_clip(ctx, mesh, &flat, 1, &clipped), TL_ERR_ARG);
    CHECK_STATUS(tl_mesh_clip(ctx, mesh, &wild, 1, &clipped), TL_ERR_ARG);
    CHECK_STATUS(tl_mesh_clip(ctx, mesh, &side, 0, &clipped), TL_ERR_ARG);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* ---- thresholds and regions ---- */

static void ranges_and_regions(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m;
    tl_mesh *mesh = make_cube(ctx, &m, 9, 0), *subset = NULL;
    uint8_t *keep = malloc(m.tet_count);
    const tl_channel *f = tl_mesh_channel_by_name(mesh, "f");
    for (int any = 0; any < 2; any++) {
        size_t expected = 0;
        memset(keep, 1, m.tet_count);
        CHECK_OK(ctx, tl_keep_range(ctx, mesh, f, 0, 2, any, keep));
        for (size_t t = 0; t < m.tet_count; t++) {
            int inside = 0;
            for (size_t i = 0; i < 4; i++) {
                double value = f->values[m.tets[4 * t + i]];
                inside += value >= 0 && value <= 2;
            }
            CHECK_EQ(keep[t], any ? inside > 0 : inside == 4);
            expected += keep[t];
        }
        CHECK_OK(ctx, tl_mesh_subset(ctx, mesh, keep, &subset));
        CHECK_EQ(tl_mesh_tet_count(subset), expected);
        CHECK_EQ(stats_of(ctx, subset).unused_verts, 0);
        check_carried(subset, &m);
        tl_mesh_destroy(subset);
    }
    static const int32_t right[2] = {2, 7};
    double kept = 0;
    for (int hide = 0; hide < 2; hide++) {
        memset(keep, 1, m.tet_count);
        CHECK_OK(ctx, tl_keep_regions(ctx, mesh, right, 2, hide, keep));
        CHECK_OK(ctx, tl_keep_range(ctx, mesh, tl_mesh_channel_by_name(mesh, "number"), 0,
                                    (double)m.tet_count / 2, false, keep));
        CHECK_OK(ctx, tl_mesh_subset(ctx, mesh, keep, &subset));
        for (size_t t = 0; t < tl_mesh_tet_count(subset); t++)
            CHECK_EQ(tl_mesh_regions(subset)[t], hide ? 1 : 2);
        kept += (double)tl_mesh_tet_count(subset);
        tl_mesh_destroy(subset);
    }
    CHECK_EQ(kept, m.tet_count / 2 + 1);
    memset(keep, 0, m.tet_count);
    CHECK_OK(ctx, tl_mesh_subset(ctx, mesh, keep, &subset));
    CHECK_EQ(tl_mesh_vert_count(subset), 0);
    tl_mesh_destroy(subset);
    free(keep);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* ---- points, lines, triangles ---- */

static void a_cap_of_a_sphere(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(40);
    tl_mesh *mesh = make_object(ctx, &m, radius);
    double r = 0.4, height = 0.13;
    tl_polydata *all = NULL, *cap = NULL;
    tl_slice_opts opts = tl_slice_opts_defaults();
    size_t carried = 0;
    opts.values = &r;
    opts.value_count = 1;
    opts.channels = &carried;
    opts.channel_count = 1;
    double *gradients = malloc(3 * m.vert_count * sizeof *gradients);
    CHECK_OK(ctx, tl_mesh_gradient(ctx, mesh, tl_mesh_channel(mesh, 0), gradients));
    opts.gradients = gradients;
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, tl_mesh_channel(mesh, 0)->values, &opts, &all));
    /* a normal that is not one long; above it lies a cap of that height */
    tl_half_space side = {{-2 * 0.6, 0, -2 * 0.8}, 0};
    side.offset = -2 * (0.5 * 0.6 + 0.5 * 0.8 + r - height);
    CHECK_OK(ctx, tl_polydata_clip(ctx, all, &side, 1, &cap));
    double area = 2 * 3.14159265358979323846 * r * height;
    CHECK_NEAR(tl_polydata_size(cap), area, 0.01 * area);
    for (size_t v = 0; v < cap->vert_count; v++) {
        const float *n = cap->normals + 3 * v;
        CHECK_NEAR(radius(cap->xyz + 3 * v), r, 0.002);
        CHECK_NEAR(cap->channels[0].values[v], r, 1e-12);
        CHECK_NEAR((double)(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), 1, 1e-6);
    }
    tl_polydata_destroy(ctx, cap);
    all->kind = TL_POLY_POINTS; /* only its vertices */
    CHECK_OK(ctx, tl_polydata_clip(ctx, all, &side, 1, &cap));
    size_t inside = 0;
    for (size_t v = 0; v < all->vert_count; v++)
        inside +=
            side.normal[0] * all->xyz[3 * v] + side.normal[2] * all->xyz[3 * v + 2] <= side.offset;
    CHECK_EQ(cap->vert_count, inside);
    CHECK_EQ(cap->cell_count, inside);
    tl_polydata_destroy(ctx, cap);
    all->kind = TL_POLY_TRIANGLES;
    tl_polydata_destroy(ctx, all);
    free(gradients);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Zigzags over a plane, on it, beside it. */
static void lines_over_a_plane(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    double xyz[9][3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 9, 0}, {2, 9, 0},
                        {1, 9, 5}, {1, 7, 0}, {3, 0, 0}, {0, 0, 8}};
    tl_lidx corners[] = {0, 1, 2, /**/ 3, 4, 5, /**/ 4, 3, 4, /**/ 1, 7, /**/ 0, 8, 6, 3, 0};
    tl_lidx starts[] = {0, 3, 6, 9, 11, 16};
    tl_polydata lines = {.kind = TL_POLY_LINES,
                         .vert_count = 9,
                         .xyz = xyz[0],
                         .cell_count = 5,
                         .corners = corners,
                         .starts = starts};
    static const tl_half_space side = {{1, 0, 0}, 1};
    tl_polydata *p = NULL;
    CHECK_OK(ctx, tl_polydata_clip(ctx, &lines, &side, 1, &p));
    /* two ends of the first line, nothing of the three that touch, all of the last one */
    CHECK_EQ(p->cell_count, 3);
    CHECK_NEAR(tl_polydata_size(p), 1 + sqrt(2) + 8 + sqrt(1 + 49 + 64) + 2 + sqrt(1 + 81), 1e-12);
    tl_polydata_destroy(ctx, p);
    check_ctx_destroy(ctx);
}

static tl_status clip_all(tl_ctx *ctx, void *arg)
{
    static const tl_half_space sides[2] = {{{1, 1, 1}, 1.5}, {{1, 0, 0}, 0.3}};
    tl_mesh *mesh = arg, *clipped = NULL, *subset = NULL;
    tl_polydata *surface = NULL, *part = NULL;
    uint8_t keep[5 * 64];
    for (size_t t = 0; t < sizeof keep; t++) keep[t] = t % 3 > 0;
    tl_status st = tl_mesh_clip(ctx, mesh, sides, 2, &clipped);
    tl_mesh_destroy(clipped);
    if (!st) st = tl_keep_range(ctx, mesh, tl_mesh_channel_by_name(mesh, "f"), 0, 2, true, keep);
    if (!st) st = tl_mesh_subset(ctx, mesh, keep, &subset);
    if (!st) st = tl_boundary_surface(ctx, mesh, NULL, NULL, &surface);
    if (!st) st = tl_polydata_clip(ctx, surface, sides, 2, &part);
    tl_polydata_destroy(ctx, part);
    tl_polydata_destroy(ctx, surface);
    tl_mesh_destroy(subset);
    return st;
}

static void failing_memory_leaks_nothing(void **state)
{
    (void)state;
    fail_alloc f;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m;
    tl_mesh *mesh = make_cube(ctx, &m, 5, 0);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, clip_all, mesh) > 60);
    fail_alloc_close(&f);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planes_through_a_cube),
        cmocka_unit_test(sides_add_up),
        cmocka_unit_test(clips_of_anything),
        cmocka_unit_test(ranges_and_regions),
        cmocka_unit_test(a_cap_of_a_sphere),
        cmocka_unit_test(lines_over_a_plane),
        cmocka_unit_test(failing_memory_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
