/* Surfaces between the regions inside of a mesh: every face once, with the regions on both sides;
 * with the boundary, the surface of every region is closed. */
#include "check.h"
#include "check_ctx.h"

#include "check_simplify_real.h"
#include "make_mesh.h"
#include "tetralod/extract.h"

/* A side of a triangle of a region, and its place among the vertices of the mesh. */
typedef struct side {
    double ends[2][3];
    int way; /* 1 or -1: as ends say, the smaller one first */
} side;

static int by_ends(const void *a, const void *b)
{
    return memcmp(((const side *)a)->ends, ((const side *)b)->ends, sizeof((const side *)a)->ends);
}

/* Adds the sides of a triangle, turned if so. */
static void add_sides(const tl_polydata *p, size_t triangle, bool turned, side *sides)
{
    for (size_t i = 0; i < 3; i++) {
        const double *a = p->xyz + 3 * (size_t)p->corners[3 * triangle + i];
        const double *b = p->xyz + 3 * (size_t)p->corners[3 * triangle + (i + 1) % 3];
        const bool swap = memcmp(a, b, 3 * sizeof *a) > 0;
        memcpy(sides[i].ends[0], swap ? b : a, sizeof sides[i].ends[0]);
        memcpy(sides[i].ends[1], swap ? a : b, sizeof sides[i].ends[1]);
        sides[i].way = swap == turned ? 1 : -1;
    }
}

static const double *values_of(const tl_polydata *p, const char *name)
{
    for (size_t c = 0; c < p->channel_count; c++)
        if (!strcmp(p->channels[c].name, name)) return p->channels[c].values;
    fail_msg("no channel '%s'", name);
    return NULL;
}

/* Edges along which the triangles of a region don't run as often to as fro. */
static size_t open_edges(const tl_polydata *p, int32_t region)
{
    const double *front = values_of(p, "region"), *behind = values_of(p, "region behind");
    side *sides = malloc((3 * p->cell_count + 1) * sizeof *sides);
    size_t count = 0, open = 0;
    for (size_t t = 0; t < p->cell_count; t++) {
        const tl_lidx v = p->corners[3 * t];
        const bool is_front = front[v] == region, is_behind = behind[v] == region;
        CHECK(!(is_front && is_behind));
        if (!is_front && !is_behind) continue;
        add_sides(p, t, is_behind, sides + count);
        count += 3;
    }
    CHECK(count > 0);
    qsort(sides, count, sizeof *sides, by_ends);
    for (size_t i = 0, end; i < count; i = end) {
        int sum = 0;
        for (end = i; end < count && by_ends(&sides[i], &sides[end]) == 0; end++)
            sum += sides[end].way;
        open += sum != 0;
    }
    free(sides);
    return open;
}

/* Volume inside of the surface of a region, by the divergence theorem. */
static double volume_inside(const tl_polydata *p, int32_t region)
{
    const double *front = values_of(p, "region"), *behind = values_of(p, "region behind");
    double volume = 0;
    for (size_t t = 0; t < p->cell_count; t++) {
        const tl_lidx *q = p->corners + 3 * t;
        const double *a = p->xyz + 3 * (size_t)q[0], *b = p->xyz + 3 * (size_t)q[1];
        const double *c = p->xyz + 3 * (size_t)q[2];
        double sign = front[q[0]] == region ? 1 : behind[q[0]] == region ? -1 : 0;
        volume += sign / 6 *
                  (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                   a[2] * (b[0] * c[1] - b[1] * c[0]));
    }
    return volume;
}

/* Both kinds of faces, then interfaces alone. folded: tets that lie in others. */
static void check_mesh(tl_ctx *ctx, const tl_mesh *mesh, int32_t region_end, size_t folded)
{
    size_t open = 0;
    tl_mesh_stats stats;
    tl_polydata *outer = NULL, *all = NULL, *inner = NULL;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
    CHECK_OK(ctx, tl_boundary_surface(ctx, mesh, NULL, &opts, &outer));
    opts.interfaces = true;
    CHECK_OK(ctx, tl_boundary_surface(ctx, mesh, NULL, &opts, &all));
    opts.boundary = false;
    CHECK_OK(ctx, tl_boundary_surface(ctx, mesh, NULL, &opts, &inner));
    printf("%zu triangles of the boundary, %zu between regions\n", outer->cell_count,
           inner->cell_count);
    CHECK_EQ(inner->cell_count, stats.interface_triangles);
    CHECK_EQ(all->cell_count, outer->cell_count + inner->cell_count);
    CHECK_NEAR(tl_polydata_size(all), tl_polydata_size(outer) + tl_polydata_size(inner),
               1e-9 * tl_polydata_size(all));
    const double *front = values_of(all, "region"), *behind = values_of(all, "region behind");
    for (size_t i = 0; i < 3 * all->cell_count; i++) {
        const tl_lidx v = all->corners[i], first = all->corners[i / 3 * 3];
        CHECK(i / 3 < outer->cell_count ? isnan(behind[v]) : front[v] < behind[v]);
        CHECK(front[v] == front[first] && (isnan(behind[v]) || behind[v] == behind[first]));
    }
    for (int32_t r = 1; r < region_end; r++) {
        open += open_edges(all, r);
        if (folded) continue; /* a face of such a tet looks the wrong way, which moves the volume */
        CHECK_NEAR(volume_inside(all, r), region_volume(mesh, r, false), 1e-9 * stats.volume);
    }
    printf("%zu edges are open\n", open);
    CHECK(open <= 2 * 6 * folded); /* seen from two regions */
    tl_polydata_destroy(ctx, inner);
    tl_polydata_destroy(ctx, all);
    tl_polydata_destroy(ctx, outer);
}

static void halves(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid_cavity(8);
    make_two_regions(&m);
    make_shuffle(&m, 3);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    check_mesh(ctx, mesh, 3, 0);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Five materials that share edges and corners; in the file one tet is inside out. */
static void materials(void **state)
{
    (void)state;
    static const real_file file = {"multimaterial/mickey_mesh.ele", NULL, {0}};
    tl_ctx *ctx = check_ctx_create(2);
    tl_mesh *mesh = real_read(ctx, &file);
    if (mesh) check_mesh(ctx, mesh, 6, 1);
    const bool found = mesh != NULL;
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
    if (!found) CHECK_SKIP("no data: set TETRALOD_DATA to the folder of data sets");
}

/* Without regions there is nothing inside. */
static void one_region(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(3);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_polydata *p = NULL;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    opts.interfaces = true;
    opts.boundary = false;
    CHECK_OK(ctx, tl_boundary_surface(ctx, mesh, NULL, &opts, &p));
    CHECK_EQ(p->cell_count, 0);
    tl_polydata_destroy(ctx, p);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(halves), cmocka_unit_test(materials),
                                       cmocka_unit_test(one_region)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
