/* The boundary as a surface, its features, and silhouettes: cubes and spheres whose answers are
 * known, surfaces in parts against the whole, one result for any number of threads. */
#include "check.h"

#include "tetralod/extract.h"

#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"
#include "make_pieces.h"

static double linear(const double x[3])
{
    return 2 * x[0] - 3 * x[1] + 5 * x[2];
}

static double radius(const double x[3])
{
    return hypot(hypot(x[0] - 0.5, x[1] - 0.5), x[2] - 0.5);
}

static tl_polydata *lines_of(tl_ctx *ctx, tl_edges *edges, unsigned kinds, const tl_camera *camera)
{
    tl_polydata *lines = NULL;
    tl_edges_opts opts = tl_edges_opts_defaults();
    opts.kinds = kinds;
    opts.camera = camera;
    CHECK_OK(ctx, tl_edges_lines(ctx, edges, &opts, &lines));
    return lines;
}

static void check_same_lines(const tl_polydata *a, const tl_polydata *b)
{
    CHECK_EQ(a->vert_count, b->vert_count);
    CHECK_EQ(a->cell_count, b->cell_count);
    CHECK(memcmp(a->xyz, b->xyz, 3 * a->vert_count * sizeof *a->xyz) == 0);
    CHECK(memcmp(a->starts, b->starts, (a->cell_count + 1) * sizeof *a->starts) == 0);
    CHECK(memcmp(a->corners, b->corners, a->starts[a->cell_count] * sizeof *a->corners) == 0);
}

/* ---- the boundary ---- */

/* Of a cube of n^3 vertices, with each kind of division. */
static void boundary_of_a_cube(void **state)
{
    (void)state;
    enum { N = 9 };
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(N);
    make_two_regions(&m);
    make_shuffle(&m, 3);
    tl_mesh *mesh = make_object(ctx, &m, linear);
    tl_polydata *p = NULL;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    size_t carried[2] = {0, 1};
    double *numbers = malloc(m.tet_count * sizeof *numbers);
    for (size_t t = 0; t < m.tet_count; t++) numbers[t] = (double)t;
    tl_channel channel = {"number", "", 1, TL_ON_TET, TL_I32, numbers};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    opts.channels = carried;
    opts.channel_count = 1;

    /* six sides, those along x divided in the middle by the regions */
    CHECK_OK(ctx, tl_boundary_surface(ctx, mesh, NULL, &opts, &p));
    CHECK_EQ(p->cell_count, 12 * (N - 1) * (N - 1));
    CHECK_EQ(p->vert_count, 6 * N * N + 4 * N);
    CHECK_NEAR(tl_polydata_size(p), 6, 1e-12);
    CHECK_EQ(p->channel_count, 2);
    for (size_t v = 0; v < p->vert_count; v++) {
        const double *x = p->xyz + 3 * v;
        const float *n = p->normals + 3 * v;
        CHECK_NEAR(p->channels[0].values[v], linear(x), 1e-12);
        CHECK(p->channels[1].values[v] == (x[0] < 0.5 ? 1 : 2) || x[0] == 0.5);
        double out = 0; /* one component is 1, and points to the outside */
        for (int k = 0; k < 3; k++) out += (double)n[k] * (x[k] - 0.5);
        CHECK_NEAR(out, 0.5, 1e-6);
    }
    tl_polydata_destroy(ctx, p);

    /* without divisions one closed surface */
    bool closed = false;
    opts.regions = opts.normals = false;
    CHECK_OK(ctx, tl_boundary_surface(ctx, mesh, NULL, &opts, &p));
    CHECK_EQ(p->vert_count, 6 * (N - 1) * (N - 1) + 2);
    CHECK_OK(ctx, tl_polydata_closed(ctx, p, &closed));
    CHECK(closed && !p->normals);
    tl_polydata_destroy(ctx, p);

    /* a channel on tets: that of the one tet at each triangle */
    opts.channel_count = 2;
    opts.normals = true;
    opts.crease = 180;
    CHECK_OK(ctx, tl_boundary_surface(ctx, mesh, NULL, &opts, &p));
    CHECK_EQ(p->vert_count, 3 * p->cell_count);
    for (size_t t = 0; t < p->cell_count; t++) {
        const double *of = p->channels[1].values;
        const tl_lidx *c = p->corners + 3 * t;
        CHECK(of[c[0]] == of[c[1]] && of[c[0]] == of[c[2]]);
        for (int k = 0; k < 3; k++) {
            int found = 0;
            for (int i = 0; i < 4; i++)
                found += memcmp(m.xyz + 3 * m.tets[4 * (size_t)of[c[0]] + (size_t)i],
                                p->xyz + 3 * c[k], 3 * sizeof(double)) == 0;
            CHECK_EQ(found, 1);
        }
    }
    tl_polydata_destroy(ctx, p);
    opts.crease = 181;
    CHECK_STATUS(tl_boundary_surface(ctx, mesh, NULL, &opts, &p), TL_ERR_ARG);
    opts.crease = 180;
    carried[1] = 2;
    CHECK_STATUS(tl_boundary_surface(ctx, mesh, NULL, &opts, &p), TL_ERR_ARG);
    free(numbers);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Cells without volume, twice the same vertex, no number for a place. */
static void boundaries_of_anything(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_wreck(40, 300, 3);
    tl_mesh *mesh = make_object(ctx, &m, linear);
    tl_polydata *p = NULL;
    tl_edges *edges = NULL;
    tl_camera camera = tl_camera_defaults();
    CHECK_OK(ctx, tl_boundary_surface(ctx, mesh, NULL, NULL, &p));
    CHECK(p->cell_count > 0);
    for (size_t i = 0; i < 3 * p->vert_count; i++) CHECK(isfinite(p->normals[i]));
    tl_polydata_destroy(ctx, p);
    CHECK_OK(ctx, tl_edges_create(ctx, &edges));
    CHECK_OK(ctx, tl_edges_add_mesh(ctx, edges, 0, mesh, NULL));
    p = lines_of(ctx, edges, 31, &camera);
    CHECK(p->cell_count > 0);
    tl_polydata_destroy(ctx, p);
    tl_edges_destroy(ctx, edges);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* ---- features ---- */

static void features_of_a_cube(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(9);
    make_two_regions(&m);
    make_shuffle(&m, 8);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_edges *edges = NULL;
    CHECK_OK(ctx, tl_edges_create(ctx, &edges));
    CHECK_OK(ctx, tl_edges_add_mesh(ctx, edges, 7, mesh, NULL));
    tl_polydata *p = lines_of(ctx, edges, TL_EDGE_SHARP, NULL);
    CHECK_EQ(p->cell_count, 12);
    CHECK_NEAR(tl_polydata_size(p), 12, 1e-12);
    tl_polydata_destroy(ctx, p);
    p = lines_of(ctx, edges, TL_EDGE_REGION, NULL); /* once around the middle */
    CHECK_EQ(p->cell_count, 1);
    CHECK_EQ(p->corners[0], p->corners[p->starts[1] - 1]);
    CHECK_NEAR(tl_polydata_size(p), 4, 1e-12);
    tl_polydata_destroy(ctx, p);
    p = lines_of(ctx, edges, TL_EDGE_OPEN | TL_EDGE_NONMANIFOLD, NULL);
    CHECK_EQ(p->cell_count, 0);
    tl_polydata_destroy(ctx, p);

    /* from far above a corner the outline is a hexagon; from straight ahead there is no outline
     * but that of one side */
    tl_camera camera = tl_camera_defaults();
    for (int k = 0; k < 3; k++) camera.position[k] = 0.5 + 10 - k;
    for (int k = 0; k < 3; k++) camera.focal_point[k] = 0.5;
    p = lines_of(ctx, edges, TL_EDGE_SILHOUETTE, &camera);
    CHECK_EQ(p->cell_count, 1);
    CHECK_NEAR(tl_polydata_size(p), 6, 1e-12);
    tl_polydata_destroy(ctx, p);
    camera.parallel_scale = 2;
    camera.position[0] = camera.position[1] = 0.5;
    p = lines_of(ctx, edges, TL_EDGE_SILHOUETTE, &camera);
    CHECK_NEAR(tl_polydata_size(p), 4, 1e-12);
    tl_polydata_destroy(ctx, p);

    tl_edges_opts opts = tl_edges_opts_defaults();
    opts.kinds = TL_EDGE_SILHOUETTE;
    CHECK_STATUS(tl_edges_lines(ctx, edges, &opts, &p), TL_ERR_ARG);
    opts.kinds = 0;
    CHECK_STATUS(tl_edges_lines(ctx, edges, &opts, &p), TL_ERR_ARG);
    opts.kinds = TL_EDGE_SHARP;
    opts.angle = (double)NAN;
    CHECK_STATUS(tl_edges_lines(ctx, edges, &opts, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_edges_add_mesh(ctx, edges, 7, mesh, NULL), TL_ERR_ARG);
    CHECK_STATUS(tl_edges_remove(ctx, edges, 6), TL_ERR_ARG);
    tl_edges_destroy(ctx, edges);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* ---- a sphere, whole and in parts ---- */

enum { PARTS = 5 };
static const double SPHERE = 0.4;

typedef struct sphere {
    tl_polydata *all;
    uint32_t *shared;          /* of all its vertices */
    tl_lidx *triangles[PARTS]; /* in bands along x */
    size_t counts[PARTS];
} sphere;

static sphere make_sphere(tl_ctx *ctx)
{
    sphere s = {0};
    make_mesh m = make_grid(24);
    tl_mesh *mesh = make_object(ctx, &m, radius);
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = &SPHERE;
    opts.value_count = 1;
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, tl_mesh_channel(mesh, 0)->values, &opts, &s.all));
    tl_mesh_destroy(mesh);
    make_release(&m);
    s.shared = malloc(s.all->vert_count * sizeof *s.shared);
    for (size_t v = 0; v < s.all->vert_count; v++) s.shared[v] = (uint32_t)v;
    for (int part = 0; part < PARTS; part++)
        s.triangles[part] = malloc(3 * s.all->cell_count * sizeof(tl_lidx));
    for (size_t t = 0; t < s.all->cell_count; t++) {
        const tl_lidx *c = s.all->corners + 3 * t;
        int part = (int)(s.all->xyz[3 * c[0]] * PARTS);
        memcpy(s.triangles[part] + 3 * s.counts[part]++, c, 3 * sizeof *c);
    }
    return s;
}

static void release_sphere(tl_ctx *ctx, sphere *s)
{
    for (int part = 0; part < PARTS; part++) free(s->triangles[part]);
    free(s->shared);
    tl_polydata_destroy(ctx, s->all);
}

static tl_status add_band(tl_ctx *ctx, tl_edges *edges, const sphere *s, unsigned part)
{
    tl_edges_part band = {.xyz = s->all->xyz,
                          .vert_count = s->all->vert_count,
                          .shared = s->shared,
                          .triangles = s->triangles[part],
                          .triangle_count = s->counts[part]};
    return tl_edges_add(ctx, edges, part, &band);
}

static tl_edges *whole(tl_ctx *ctx, const sphere *s)
{
    tl_edges *edges = NULL;
    tl_edges_part part = {.xyz = s->all->xyz,
                          .vert_count = s->all->vert_count,
                          .triangles = s->all->corners,
                          .triangle_count = s->all->cell_count};
    CHECK_OK(ctx, tl_edges_create(ctx, &edges));
    CHECK_OK(ctx, tl_edges_add(ctx, edges, 0, &part));
    return edges;
}

static tl_camera camera_at(double distance)
{
    tl_camera camera = tl_camera_defaults();
    static const double way[3] = {0.48, -0.6, 0.64}; /* one long */
    for (int k = 0; k < 3; k++) {
        camera.position[k] = 0.5 + distance * way[k];
        camera.focal_point[k] = 0.5;
    }
    return camera;
}

/* Where rays from the camera touch the sphere, within what its triangles are off; closed lines. */
static void silhouette_of_a_sphere(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(3);
    sphere s = make_sphere(ctx);
    tl_edges *edges = whole(ctx, &s);
    for (int parallel = 0; parallel < 2; parallel++) {
        double distance = 1.1, edge = 1.0 / 23;
        tl_camera camera = camera_at(distance);
        camera.parallel_scale = parallel;
        double height = parallel ? 0 : SPHERE * SPHERE / distance, off = 0;
        double round = 2 * 3.14159265358979323846 * sqrt(SPHERE * SPHERE - height * height);
        tl_polydata *p = lines_of(ctx, edges, TL_EDGE_SILHOUETTE, &camera);
        for (size_t v = 0; v < p->vert_count; v++) {
            double along = 0;
            for (size_t k = 0; k < 3; k++)
                along += (p->xyz[3 * v + k] - 0.5) * (camera.position[k] - 0.5) / distance;
            off = fmax(off, fabs(along - height));
        }
        CHECK_BOUND("silhouette off by edges of the grid", off / edge, 1.5);
        CHECK(p->cell_count > 0);
        for (size_t c = 0; c < p->cell_count; c++) { /* each ends where it begins, or at others */
            size_t ends = 0;
            tl_lidx last = p->corners[p->starts[c + 1] - 1];
            for (size_t d = 0; d < p->cell_count; d++)
                ends +=
                    (p->corners[p->starts[d]] == last) + (p->corners[p->starts[d + 1] - 1] == last);
            CHECK_EQ(ends % 2, 0);
        }
        CHECK(tl_polydata_size(p) > 0.98 * round && tl_polydata_size(p) < 1.6 * round);
        tl_polydata_destroy(ctx, p);
    }
    tl_edges_destroy(ctx, edges);
    release_sphere(ctx, &s);
    check_ctx_destroy(ctx);
}

/* Parts in any order, after some came and went, are the whole; one that is away leaves its rim
 * open. */
static void parts_are_the_whole(void **state)
{
    (void)state;
    static const unsigned orders[3][PARTS] = {{0, 1, 2, 3, 4}, {3, 0, 4, 2, 1}, {4, 3, 2, 1, 0}};
    tl_ctx *ctx = check_ctx_create(2);
    sphere s = make_sphere(ctx);
    tl_edges *edges = whole(ctx, &s);
    tl_camera camera = camera_at(2);
    unsigned kinds = TL_EDGE_SILHOUETTE | TL_EDGE_SHARP;
    tl_polydata *all = lines_of(ctx, edges, kinds, &camera), *first = NULL;
    tl_edges_destroy(ctx, edges);
    for (unsigned threads = 1; threads <= 3; threads++) {
        tl_ctx *own = check_ctx_create(threads);
        CHECK_OK(own, tl_edges_create(own, &edges));
        for (int i = 0; i < PARTS; i++)
            CHECK_OK(own, add_band(own, edges, &s, orders[threads - 1][i]));
        tl_polydata *p = lines_of(own, edges, kinds | TL_EDGE_OPEN, &camera);
        CHECK_NEAR(tl_polydata_size(p), tl_polydata_size(all), 1e-12);
        CHECK_EQ(p->vert_count, all->vert_count);
        CHECK_OK(own, tl_edges_remove(own, edges, 2));
        tl_polydata *gap = lines_of(own, edges, TL_EDGE_OPEN, NULL);
        CHECK(tl_polydata_size(gap) > 4 * 3.1 * 0.38); /* two rims */
        tl_polydata_destroy(own, gap);
        CHECK_OK(own, add_band(own, edges, &s, 2));
        tl_polydata *again = lines_of(own, edges, kinds | TL_EDGE_OPEN, &camera);
        check_same_lines(p, again);
        tl_polydata_destroy(own, again);
        if (!first) {
            tl_edges *same = NULL;
            CHECK_OK(ctx, tl_edges_create(ctx, &same));
            for (unsigned i = 0; i < PARTS; i++) CHECK_OK(ctx, add_band(ctx, same, &s, i));
            first = lines_of(ctx, same, kinds | TL_EDGE_OPEN, &camera);
            tl_edges_destroy(ctx, same);
        }
        check_same_lines(first, p);
        tl_polydata_destroy(own, p);
        tl_edges_destroy(own, edges);
        check_ctx_destroy(own);
    }
    tl_polydata_destroy(ctx, first);
    tl_polydata_destroy(ctx, all);
    release_sphere(ctx, &s);
    check_ctx_destroy(ctx);
}

/* Patches of a cut, as seams know them: the cube again, also after one was away. */
static void patches_are_the_whole(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    pieces p;
    tl_seams *seams = NULL;
    tl_edges *edges = NULL;
    static const tl_lattice lattice = {TL_PLACE_LATTICE, 0, {0, 0, 0}};
    tl_camera camera = tl_camera_defaults();
    for (int k = 0; k < 3; k++) camera.position[k] = 500 + 9000 - 1000 * k;
    for (int k = 0; k < 3; k++) camera.focal_point[k] = 500;
    make_pieces(ctx, &p);
    CHECK_OK(ctx, tl_seams_create(ctx, &seams));
    CHECK_OK(ctx, tl_edges_create(ctx, &edges));
    CHECK_STATUS(tl_edges_add_patch(ctx, edges, 3, &lattice, &p.list[3].patch, seams), TL_ERR_ARG);
    for (uint32_t i = 0; i < PIECES; i++)
        CHECK_OK(ctx, tl_seams_add(seams, 7 * i, &p.list[i].patch));
    for (uint32_t i = PIECES; i-- > 0;)
        CHECK_OK(ctx, tl_edges_add_patch(ctx, edges, 7 * i, &lattice, &p.list[i].patch, seams));
    for (int again = 0; again < 2; again++) {
        tl_polydata *sharp = lines_of(ctx, edges, TL_EDGE_SHARP, NULL);
        tl_polydata *outline = lines_of(ctx, edges, TL_EDGE_SILHOUETTE, &camera);
        tl_polydata *wrong = lines_of(ctx, edges, TL_EDGE_OPEN | TL_EDGE_NONMANIFOLD, NULL);
        CHECK_EQ(sharp->cell_count, 12);
        CHECK_NEAR(tl_polydata_size(sharp), 12000, 1e-9);
        CHECK_EQ(outline->cell_count, 1);
        CHECK_NEAR(tl_polydata_size(outline), 6000, 1e-9);
        CHECK_EQ(wrong->cell_count, 0);
        tl_polydata_destroy(ctx, wrong);
        tl_polydata_destroy(ctx, outline);
        tl_polydata_destroy(ctx, sharp);
        CHECK_OK(ctx, tl_edges_remove(ctx, edges, 14));
        CHECK_OK(ctx, tl_seams_remove(seams, 14));
        CHECK_OK(ctx, tl_seams_add(seams, 15, &p.list[2].patch));
        CHECK_OK(ctx, tl_edges_add_patch(ctx, edges, 15, &lattice, &p.list[2].patch, seams));
        CHECK_OK(ctx, tl_edges_remove(ctx, edges, 15));
        CHECK_OK(ctx, tl_seams_remove(seams, 15));
        CHECK_OK(ctx, tl_seams_add(seams, 14, &p.list[2].patch));
        CHECK_OK(ctx, tl_edges_add_patch(ctx, edges, 14, &lattice, &p.list[2].patch, seams));
    }
    tl_edges_destroy(ctx, edges);
    tl_seams_destroy(seams);
    drop_pieces(ctx, &p);
    check_ctx_destroy(ctx);
}

/* ---- failures ---- */

typedef struct failing {
    tl_mesh *mesh;
    const sphere *sphere;
} failing;

static tl_status all_of_it(tl_ctx *ctx, void *arg)
{
    const failing *f = arg;
    tl_polydata *p = NULL;
    tl_edges *edges = NULL;
    size_t carried = 0;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    tl_camera camera = camera_at(3);
    tl_edges_opts which = {sizeof which, 31, 30, &camera};
    opts.channels = &carried;
    opts.channel_count = 1;
    tl_status st = tl_boundary_surface(ctx, f->mesh, NULL, &opts, &p);
    tl_polydata_destroy(ctx, p);
    if (!st) st = tl_edges_create(ctx, &edges);
    if (!st) st = tl_edges_add_mesh(ctx, edges, 9, f->mesh, NULL);
    if (!st) st = add_band(ctx, edges, f->sphere, 1);
    if (!st) st = add_band(ctx, edges, f->sphere, 2);
    if (!st) st = tl_edges_lines(ctx, edges, &which, &p);
    if (!st) tl_polydata_destroy(ctx, p);
    tl_edges_destroy(ctx, edges);
    return st;
}

static void failing_memory_leaks_nothing(void **state)
{
    (void)state;
    fail_alloc f;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(5);
    make_two_regions(&m);
    sphere s = make_sphere(ctx);
    failing arg = {make_object(ctx, &m, linear), &s};
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, all_of_it, &arg) > 40);
    fail_alloc_close(&f);
    tl_edges *edges = NULL;
    CHECK_OK(ctx, tl_edges_create(ctx, &edges));
    s.triangles[0][4] = (tl_lidx)s.all->vert_count;
    CHECK_STATUS(add_band(ctx, edges, &s, 0), TL_ERR_DATA);
    CHECK(strstr(tl_ctx_message(ctx), "triangle 1: corner 1"));
    tl_edges_destroy(ctx, edges);
    release_sphere(ctx, &s);
    tl_mesh_destroy(arg.mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boundary_of_a_cube),           cmocka_unit_test(boundaries_of_anything),
        cmocka_unit_test(features_of_a_cube),           cmocka_unit_test(silhouette_of_a_sphere),
        cmocka_unit_test(parts_are_the_whole),          cmocka_unit_test(patches_are_the_whole),
        cmocka_unit_test(failing_memory_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
