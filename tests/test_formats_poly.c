/* Polyhedra and prisms to tets, and labels of faces: closed, positive, conforming with cells of
 * other kinds, a new vertex only where it must be. */
#include "check.h"

#include "check_alloc.h"
#include "check_grid.h"
#include "formats/formats_tets.h"
#include "make_mesh.h"

/* ---- grids ---- */

typedef struct grid_maker {
    tl_ctx *ctx;
    tli_grid grid;
    tli_face_list faces;
    size_t cell_room, id_room;
} grid_maker;

static void maker_open(grid_maker *m, tl_ctx *ctx, const double *xyz, uint64_t point_count)
{
    tl_status st = TL_OK;
    *m = (grid_maker){.ctx = ctx, .cell_room = 4096, .id_room = 65536};
    tli_grid_init(ctx, &m->grid);
    m->grid.point_count = point_count;
    m->grid.xyz = tl_mem_alloc(ctx, (size_t)point_count, 3 * sizeof *xyz, &st);
    m->grid.types = tl_mem_alloc(ctx, m->cell_room, 1, &st);
    m->grid.offsets = tl_mem_zalloc(ctx, m->cell_room + 1, sizeof(uint64_t), &st);
    m->grid.connectivity = tl_mem_alloc(ctx, m->id_room, sizeof(uint32_t), &st);
    CHECK_EQ(st, TL_OK);
    memcpy(m->grid.xyz, xyz, (size_t)point_count * 3 * sizeof *xyz);
    tli_face_list_begin(&m->grid, &m->faces);
}

static void maker_cell(grid_maker *m, uint8_t type, const uint32_t *ids, size_t count)
{
    tli_grid *grid = &m->grid;
    uint64_t used = grid->offsets[grid->cell_count];
    CHECK(grid->cell_count < m->cell_room && used + count <= m->id_room);
    grid->types[grid->cell_count] = type;
    memcpy(grid->connectivity + used, ids, count * sizeof *ids);
    grid->offsets[++grid->cell_count] = used + count;
}

/* A polyhedron of faces given as counts and corners, ended by 0. */
static void maker_polyhedron(grid_maker *m, const uint32_t *stream)
{
    uint32_t ids[256];
    size_t count = 0;
    for (; *stream; stream += *stream + 1) {
        CHECK_OK(m->ctx, tli_face_list_add(&m->faces, stream + 1, *stream, 0));
        ids[count++] = (uint32_t)m->grid.face_count - 1;
    }
    maker_cell(m, 42, ids, count);
}

static void maker_label(grid_maker *m, const char *name, int32_t id, const uint32_t *stream)
{
    tl_status st = TL_OK;
    uint64_t faces = 0, used = 0;
    uint64_t *offsets = tl_mem_zalloc(m->ctx, 64, sizeof *offsets, &st);
    uint32_t *points = tl_mem_alloc(m->ctx, 512, sizeof *points, &st);
    CHECK_EQ(st, TL_OK);
    for (; *stream; stream += *stream + 1) {
        memcpy(points + used, stream + 1, *stream * sizeof *stream);
        used += *stream;
        offsets[++faces] = used;
    }
    CHECK_OK(m->ctx, tli_grid_add_label(&m->grid, name, id, faces, offsets, points));
}

/* Makes the mesh, proves it positive and conforming and gives it. */
static tl_mesh *maker_mesh(grid_maker *m, tl_read_report *report)
{
    tl_mesh *mesh;
    tl_mesh_stats stats;
    CHECK_OK(m->ctx, tli_face_list_end(&m->faces));
    grid_check(&m->grid);
    CHECK_OK(m->ctx, tli_grid_to_mesh(&m->grid, NULL, &mesh, report));
    CHECK_OK(m->ctx, tl_mesh_check(m->ctx, mesh, TL_CHECK_FULL));
    CHECK_OK(m->ctx, tl_mesh_measure(m->ctx, mesh, &stats));
    CHECK_EQ(stats.nonmanifold_faces + stats.nonmanifold_edges, 0);
    CHECK_EQ(stats.inverted + stats.degenerate, 0);
    return mesh;
}

static void maker_close(grid_maker *m, tl_mesh *mesh)
{
    tl_mesh_destroy(mesh);
    tli_grid_release(&m->grid);
    CHECK_EQ(tl_ctx_current_bytes(m->ctx), 0);
}

/* ---- single cells ---- */

static void test_prisms(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    for (unsigned n = 5; n <= 6; n++)
        for (uint64_t seed = 0; seed < 20; seed++) {
            double xyz[36];
            uint32_t ids[12], order[12];
            uint64_t random = seed + 1;
            tl_read_report report;
            grid_maker m;
            for (uint32_t i = 0; i < 2 * n; i++) order[i] = i;
            for (uint32_t i = 2 * n - 1; seed && i > 0; i--) {
                uint32_t j = (uint32_t)(make_random(&random) % (i + 1)), swap = order[i];
                order[i] = order[j], order[j] = swap;
            }
            for (uint32_t i = 0; i < 2 * n; i++) {
                double angle = 2 * 3.14159265358979 * (i % n) / n;
                double *p = xyz + 3 * (size_t)(ids[i] = order[i]);
                p[0] = cos(angle), p[1] = sin(angle), p[2] = i < n ? 0 : 2;
            }
            maker_open(&m, ctx, xyz, 2 * n);
            maker_cell(&m, n == 5 ? 15 : 16, ids, 2 * n);
            tl_mesh *mesh = maker_mesh(&m, &report);
            CHECK_EQ(report.cells[TL_CELL_PRISM], 1);
            CHECK_EQ(report.surface_cells + report.new_points + report.open_cells, 0);
            CHECK_EQ(tl_mesh_tet_count(mesh), n == 5 ? 9 : 12);
            CHECK_NEAR(volume_of(mesh), n * sin(2 * 3.14159265358979 / n), 1e-12);
            maker_close(&m, mesh);
        }
    tl_ctx_destroy(ctx);
}

/* An octahedron whose faces run in all directions. */
static void test_directions_of_faces(void **state)
{
    (void)state;
    static const double xyz[18] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
    tl_ctx *ctx = grid_ctx(0, 1);
    for (unsigned turned = 0; turned < 256; turned++) {
        uint32_t stream[64], used = 0;
        grid_maker m;
        for (unsigned f = 0; f < 8; f++) {
            uint32_t x = f & 1, y = 2 + (f >> 1 & 1), z = 4 + (f >> 2);
            stream[used++] = 3;
            stream[used++] = x;
            stream[used++] = turned >> f & 1 ? y : z;
            stream[used++] = turned >> f & 1 ? z : y;
        }
        stream[used] = 0;
        maker_open(&m, ctx, xyz, 6);
        maker_polyhedron(&m, stream);
        tl_mesh *mesh = maker_mesh(&m, NULL);
        CHECK_EQ(tl_mesh_tet_count(mesh), 4);
        CHECK_NEAR(volume_of(mesh), 4.0 / 3, 1e-15);
        maker_close(&m, mesh);
    }
    tl_ctx_destroy(ctx);
}

/* A cube with a valley through its roof: where that is shallow a corner sees all faces that are not
 * its own, else a point below the valley does. A deep valley hides the mean of the corners, too.
 * Linear values stay exact. */
static void test_centre(void **state)
{
    (void)state;
    static const uint32_t stream[] = {4, 0, 1, 2, 3, 4, 0, 1, 5, 4, 5, 1, 2, 6, 9, 5, 4, 2, 3,
                                      7, 6, 5, 3, 0, 4, 8, 7, 4, 4, 5, 9, 8, 4, 6, 7, 8, 9, 0};
    tl_ctx *ctx = grid_ctx(0, 1);
    for (int deep = 0; deep < 3; deep++) {
        double z = deep == 2 ? 0.1 : deep ? 0.8 : 1.5;
        const double xyz[33] = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 0, 0, 2, 2, 0,
                                2, 2, 2, 2, 0, 2, 2, 0, 1, z, 2, 1, z, 1, 1, -3};
        grid_maker m;
        tl_read_report report;
        tli_grid_array *array;
        maker_open(&m, ctx, xyz, 11);
        maker_polyhedron(&m, stream);
        CHECK_OK(ctx, tli_grid_add(&m.grid, TL_ON_VERTEX, "x+z", 1, TL_F64, NULL, &array));
        for (int i = 0; i < 11; i++) array->values[i] = xyz[3 * i] + xyz[3 * i + 2];
        tl_mesh *mesh = maker_mesh(&m, &report);
        CHECK_EQ(report.new_points, deep > 0);
        CHECK_EQ(report.points, 11);
        CHECK_EQ(report.unused_points, 1);
        CHECK_EQ(tl_mesh_vert_count(mesh), 10 + (deep > 0));
        if (deep) CHECK_EQ(tl_mesh_tet_count(mesh), 16);
        CHECK_NEAR(volume_of(mesh), 8 - 2 * (2 - z), 1e-12);
        const double *last = tl_mesh_xyz(mesh) + 3 * (tl_mesh_vert_count(mesh) - 1);
        CHECK(!deep || (last[2] < z && last[2] > 0));
        CHECK_NEAR(tl_mesh_channel(mesh, 0)->values[tl_mesh_vert_count(mesh) - 1],
                   last[0] + last[2], 1e-14);
        maker_close(&m, mesh);
    }
    tl_ctx_destroy(ctx);
}

/* Polyhedra that do not close are left out and counted; the others stay. */
static void test_open_cells(void **state)
{
    (void)state;
    static const double xyz[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const uint32_t whole[] = {3, 0, 1, 2, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3, 0};
    static const uint32_t broken[][24] = {
        {3, 0, 1, 2, 3, 0, 1, 3, 3, 1, 2, 3, 0},                         /* a face is missing */
        {3, 0, 1, 2, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3, 3, 0, 1, 2, 0}, /* one is there twice */
        {3, 0, 1, 2, 3, 0, 1, 2, 0},                                     /* flat */
        {2, 0, 1, 2, 1, 2, 0},                                           /* no faces */
        {0},
    };
    tl_ctx *ctx = grid_ctx(0, 1);
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++) {
        grid_maker m;
        tl_read_report report;
        maker_open(&m, ctx, xyz, 4);
        maker_polyhedron(&m, broken[i]);
        maker_polyhedron(&m, whole);
        tl_mesh *mesh = maker_mesh(&m, &report);
        CHECK_EQ(report.open_cells, 1);
        CHECK_EQ(report.cells[TL_CELL_POLYHEDRON], 2);
        CHECK_EQ(tl_mesh_tet_count(mesh), 1);
        maker_close(&m, mesh);
    }
    tl_ctx_destroy(ctx);
}

/* Two cubes side by side that both lack the face between them: each gets it, cut alike. */
static void test_missing_faces(void **state)
{
    (void)state;
    static const double xyz[36] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1,
                                   1, 1, 1, 0, 1, 1, 2, 0, 0, 2, 1, 0, 2, 0, 1, 2, 1, 1};
    static const uint32_t left[] = {4, 0, 3, 2, 1, 4, 4, 5, 6, 7, 4, 0, 1,
                                    5, 4, 4, 3, 7, 6, 2, 4, 0, 4, 7, 3, 0};
    static const uint32_t right[] = {4,  1, 2, 9, 8, 4,  5, 10, 11, 6, 4,  1,  8,
                                     10, 5, 4, 2, 6, 11, 9, 4,  8,  9, 11, 10, 0};
    tl_ctx *ctx = grid_ctx(0, 1);
    grid_maker m;
    tl_read_report report;
    tl_mesh_stats stats;
    maker_open(&m, ctx, xyz, 12);
    maker_polyhedron(&m, left);
    maker_polyhedron(&m, right);
    tl_mesh *mesh = maker_mesh(&m, &report);
    CHECK_EQ(report.open_cells, 0);
    CHECK_EQ(report.closed_cells, 2);
    CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
    CHECK_NEAR(stats.volume, 2, 1e-12);
    CHECK_EQ(stats.boundary_triangles, 20);
    CHECK_EQ(stats.components, 1);
    maker_close(&m, mesh);
    tl_ctx_destroy(ctx);
}

/* What is no hole: a long edge beside the two short ones of a neighbour, and two holes that meet at
 * a corner, of which nobody says which edges belong together. */
static void test_no_holes(void **state)
{
    (void)state;
    static const double xyz[27] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1,   0, 0, 0,
                                   1, 1, 0, 1, 1, 1, 1, 0, 1, 1, 0.5, 0, 0};
    static const uint32_t broken[][36] = {
        {4, 0, 3, 2, 1, 4, 4, 5, 6, 7, 5, 0, 8, 1, 5, 4,
         4, 3, 7, 6, 2, 4, 0, 4, 7, 3, 4, 1, 2, 6, 5, 0},
        {3, 0, 2, 1, 3, 0, 3, 2, 3, 4, 5, 6, 3, 0, 1, 5, 3, 2, 3, 7, 3, 2, 7, 6, 3, 0, 4, 7, 0},
    };
    tl_ctx *ctx = grid_ctx(0, 1);
    for (size_t i = 0; i < 2; i++) {
        grid_maker m;
        tl_read_report report;
        maker_open(&m, ctx, xyz, 9);
        maker_polyhedron(&m, broken[i]);
        tl_mesh *mesh = maker_mesh(&m, &report);
        CHECK_EQ(report.open_cells, 1);
        CHECK_EQ(report.closed_cells, 0);
        maker_close(&m, mesh);
    }
    tl_ctx_destroy(ctx);
}

/* ---- many cells ---- */

/* Points of an n x n x n grid with shuffled ids. */
static void grid_points(unsigned n, uint64_t seed, double *xyz, uint32_t *ids)
{
    uint32_t count = n * n * n;
    for (uint32_t i = 0; i < count; i++) ids[i] = i;
    for (uint32_t i = count - 1; i > 0; i--) {
        uint32_t j = (uint32_t)(make_random(&seed) % (i + 1)), swap = ids[i];
        ids[i] = ids[j], ids[j] = swap;
    }
    for (uint32_t i = 0; i < count; i++) {
        double *p = xyz + 3 * (size_t)ids[i];
        p[0] = i % n, p[1] = i / n % n, p[2] = (double)(i / n / n);
    }
}

static void cube_corners(unsigned n, const uint32_t *ids, unsigned x, unsigned y, unsigned z,
                         unsigned size, uint32_t corners[8])
{
    static const unsigned at[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    for (int c = 0; c < 8; c++)
        corners[c] =
            ids[x + at[c][0] * size + n * (y + at[c][1] * size) + n * n * (z + at[c][2] * size)];
}

static const uint8_t cube_faces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                         {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

/* Hexahedra and the same cells as polyhedra, mixed at random: one mesh without gaps. */
static void test_polyhedra_beside_hexahedra(void **state)
{
    (void)state;
    enum { N = 6 };
    static double xyz[3 * N * N * N];
    static uint32_t ids[N * N * N];
    tl_ctx *ctx = grid_ctx(0, 2);
    for (uint64_t seed = 1; seed < 6; seed++) {
        grid_maker m;
        uint64_t random = seed;
        grid_points(N, seed, xyz, ids);
        maker_open(&m, ctx, xyz, N * N * N);
        for (unsigned c = 0; c < (N - 1) * (N - 1) * (N - 1); c++) {
            uint32_t corners[8], stream[64], used = 0;
            cube_corners(N, ids, c % (N - 1), c / (N - 1) % (N - 1), c / (N - 1) / (N - 1), 1,
                         corners);
            if (make_random(&random) & 1) {
                maker_cell(&m, 12, corners, 8);
                continue;
            }
            for (int f = 0; f < 6; f++) {
                unsigned turn = make_random(&random) % 4;
                stream[used++] = 4;
                for (unsigned i = 0; i < 4; i++)
                    stream[used++] = corners[cube_faces[f][(i + turn) % 4]];
            }
            stream[used] = 0;
            maker_polyhedron(&m, stream);
        }
        tl_read_report report;
        tl_mesh *mesh = maker_mesh(&m, &report);
        tl_mesh_stats stats;
        CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
        CHECK_EQ(stats.boundary_triangles, 2 * 6 * (N - 1) * (N - 1));
        CHECK_NEAR(stats.volume, (N - 1) * (N - 1) * (N - 1), 1e-9);
        CHECK_EQ(report.new_points, 0);
        maker_close(&m, mesh);
    }
    tl_ctx_destroy(ctx);
}

/* A refined grid: one cube of edge 2 beside eight of edge 1, whose face it shares as four quads
 * with corners on its edges. */
static void test_refinement(void **state)
{
    (void)state;
    enum { N = 5 };
    static double xyz[3 * N * N * N];
    static uint32_t ids[N * N * N];
    tl_ctx *ctx = grid_ctx(0, 1);
    for (uint64_t seed = 1; seed < 30; seed++) {
        grid_maker m;
        grid_points(N, seed, xyz, ids);
        maker_open(&m, ctx, xyz, N * N * N);
        for (unsigned c = 0; c < 8; c++) { /* x from 2 to 4 */
            uint32_t corners[8];
            cube_corners(N, ids, 2 + (c & 1), c >> 1 & 1, c >> 2, 1, corners);
            maker_cell(&m, 12, corners, 8);
        }
#define AT(x, y, z) ids[(x) + N * (y) + N * N * (z)]
        const uint32_t stream[] = {
            /* the side x = 2 in four quads */
            4, AT(2, 0, 0), AT(2, 1, 0), AT(2, 1, 1), AT(2, 0, 1), 4, AT(2, 1, 0), AT(2, 2, 0),
            AT(2, 2, 1), AT(2, 1, 1), 4, AT(2, 0, 1), AT(2, 1, 1), AT(2, 1, 2), AT(2, 0, 2), 4,
            AT(2, 1, 1), AT(2, 2, 1), AT(2, 2, 2), AT(2, 1, 2),
            /* its neighbours have a corner more */
            5, AT(0, 0, 0), AT(0, 2, 0), AT(2, 2, 0), AT(2, 1, 0), AT(2, 0, 0), 5, AT(0, 0, 2),
            AT(0, 2, 2), AT(2, 2, 2), AT(2, 1, 2), AT(2, 0, 2), 5, AT(0, 0, 0), AT(2, 0, 0),
            AT(2, 0, 1), AT(2, 0, 2), AT(0, 0, 2), 5, AT(0, 2, 0), AT(2, 2, 0), AT(2, 2, 1),
            AT(2, 2, 2), AT(0, 2, 2), 4, AT(0, 0, 0), AT(0, 2, 0), AT(0, 2, 2), AT(0, 0, 2), 0};
        maker_polyhedron(&m, stream);
        tl_mesh *mesh = maker_mesh(&m, NULL);
        tl_mesh_stats stats;
        CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
        CHECK_NEAR(stats.volume, 16, 1e-12);
        CHECK_NEAR(stats.boundary_area, 2 * 4 + 4 * 8, 1e-12); /* no gap between the cubes */
        CHECK_EQ(stats.components, 1);
        maker_close(&m, mesh);
    }
    tl_ctx_destroy(ctx);
}

/* ---- labels ---- */

static double label_area(const tl_mesh *mesh, const tl_label *label)
{
    double sum = 0;
    for (size_t i = 0; i < label->face_count; i++) {
        const tl_lidx *tet = tl_mesh_tets(mesh) + 4 * (size_t)(label->faces[i] / 4);
        const double *p[3];
        for (unsigned k = 0, c = 0; k < 4; k++)
            if (k != label->faces[i] % 4) p[c++] = tl_mesh_xyz(mesh) + 3 * (size_t)tet[k];
        double u[3], v[3];
        for (int k = 0; k < 3; k++) u[k] = p[1][k] - p[0][k], v[k] = p[2][k] - p[0][k];
        double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2],
               z = u[0] * v[1] - u[1] * v[0];
        sum += sqrt(x * x + y * y + z * z) / 2;
    }
    return sum;
}

/* Quads and a pentagon on hexahedra, a polyhedron and between them. */
static void test_labels(void **state)
{
    (void)state;
    enum { N = 4 };
    static double xyz[3 * N * N * N];
    static uint32_t ids[N * N * N];
    tl_ctx *ctx = grid_ctx(0, 1);
    for (uint64_t seed = 1; seed < 20; seed++) {
        grid_maker m;
        uint32_t low[64], middle[64], count = 0, inner = 0;
        grid_points(N, seed, xyz, ids);
        maker_open(&m, ctx, xyz, N * N * N);
        for (unsigned c = 0; c < 27; c++) {
            uint32_t corners[8];
            unsigned z = c / 9;
            cube_corners(N, ids, c % 3, c / 3 % 3, z, 1, corners);
            maker_cell(&m, 12, corners, 8);
            if (z == 0) {
                low[count++] = 4;
                for (int i = 0; i < 4; i++) low[count++] = corners[i];
            }
            if (z == 1) {
                middle[inner++] = 4;
                for (int i = 0; i < 4; i++) middle[inner++] = corners[(i + 1) % 4];
            }
        }
        low[count] = middle[inner] = 0;
        const uint32_t nowhere[] = {3, ids[0], ids[N - 1], ids[N * N - 1], 0};
        maker_label(&m, "low", 7, low);
        maker_label(&m, "middle", -2, middle);
        maker_label(&m, "nowhere", 9, nowhere);
        tl_mesh *mesh = maker_mesh(&m, NULL);
        CHECK_EQ(tl_mesh_label_count(mesh), 3);
        const tl_label *label = tl_mesh_label(mesh, 0);
        CHECK(!strcmp(label->name, "low") && label->id == 7);
        CHECK_EQ(label->face_count, 18);
        CHECK_NEAR(label_area(mesh, label), 9, 1e-12);
        for (size_t i = 0; i < label->face_count; i++)
            for (unsigned k = 0; k < 4; k++)
                if (k != label->faces[i] % 4)
                    CHECK(tl_mesh_xyz(
                              mesh)[3 * (size_t)tl_mesh_tets(mesh)[4 * (label->faces[i] / 4) + k] +
                                    2] == 0);
        label = tl_mesh_label(mesh, 1); /* both sides */
        CHECK_EQ(label->face_count, 36);
        CHECK_NEAR(label_area(mesh, label), 18, 1e-12);
        CHECK_EQ(tl_mesh_label(mesh, 2)->face_count, 0);
        maker_close(&m, mesh);
    }
    tl_ctx_destroy(ctx);
}

/* A structured block is cut by parity; its labels follow. */
static void test_labels_of_blocks(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    for (int split = 5; split <= 6; split++) {
        enum { N = 4 };
        grid_maker m;
        double xyz[3 * N * N * N];
        uint32_t ids[N * N * N], stream[64], used = 0;
        grid_points(N, 1, xyz, ids);
        for (uint32_t i = 0; i < N * N * N; i++)
            xyz[3 * i] = i % N, xyz[3 * i + 1] = i / N % N, xyz[3 * i + 2] = (double)(i / N / N);
        maker_open(&m, ctx, xyz, N * N * N);
        tl_status st = TL_OK;
        m.grid.blocks = tl_mem_zalloc(ctx, 1, sizeof *m.grid.blocks, &st);
        CHECK_EQ(st, TL_OK);
        m.grid.block_count = 1;
        m.grid.blocks[0] = (tli_grid_block){0, {N, N, N}};
        for (uint32_t j = 0; j < 3; j++)
            for (uint32_t i = 0; i < 3; i++) {
                uint32_t p = i + N * j, quad[5] = {4, p, p + 1, p + N + 1, p + N};
                memcpy(stream + used, quad, sizeof quad);
                used += 5;
            }
        stream[used] = 0;
        maker_label(&m, "floor", 1, stream);
        tl_read_opts opts = tl_read_opts_defaults();
        tl_mesh *mesh;
        opts.split = split;
        CHECK_OK(ctx, tli_grid_to_mesh(&m.grid, &opts, &mesh, NULL));
        CHECK_EQ(tl_mesh_label(mesh, 0)->face_count, 18);
        CHECK_NEAR(label_area(mesh, tl_mesh_label(mesh, 0)), 9, 1e-12);
        maker_close(&m, mesh);
    }
    tl_ctx_destroy(ctx);
}

/* ---- repeatability and memory ---- */

static tl_mesh *random_mesh(tl_ctx *ctx, bool to_point)
{
    enum { N = 6 };
    static double xyz[3 * N * N * N];
    static uint32_t ids[N * N * N];
    grid_maker m;
    tli_grid_array *array;
    grid_points(N, 3, xyz, ids);
    uint64_t random = 4;
    for (int i = 0; i < 3 * N * N * N; i++) xyz[i] += 0.9 * (make_uniform(&random) - 0.5);
    maker_open(&m, ctx, xyz, N * N * N);
    for (unsigned c = 0; c < 125; c++) {
        uint32_t corners[8], stream[64], used = 0;
        cube_corners(N, ids, c % 5, c / 5 % 5, c / 25, 1, corners);
        for (int f = 0; f < 6; f++) {
            stream[used++] = 4;
            for (unsigned i = 0; i < 4; i++) stream[used++] = corners[cube_faces[f][i]];
        }
        stream[used] = 0;
        maker_polyhedron(&m, stream);
    }
    CHECK_OK(ctx, tli_grid_add(&m.grid, TL_ON_TET, "cell", 1, TL_F64, NULL, &array));
    for (unsigned c = 0; c < 125; c++) array->values[c] = 7;
    tl_mesh *mesh;
    tl_read_report report;
    tl_read_opts opts = tl_read_opts_defaults();
    opts.cell_to_point = to_point;
    CHECK_OK(ctx, tli_grid_to_mesh(&m.grid, &opts, &mesh, &report));
    CHECK(report.new_points > 0);
    tli_grid_release(&m.grid);
    return mesh;
}

static void test_same_for_any_threads(void **state)
{
    (void)state;
    tl_ctx *one = grid_ctx(0, 1), *many = grid_ctx(0, 3);
    tl_mesh *a = random_mesh(one, true), *b = random_mesh(many, true);
    CHECK_EQ(tl_mesh_tet_count(a), tl_mesh_tet_count(b));
    CHECK_EQ(tl_mesh_vert_count(a), tl_mesh_vert_count(b));
    CHECK(!memcmp(tl_mesh_tets(a), tl_mesh_tets(b), tl_mesh_tet_count(a) * 16));
    CHECK(!memcmp(tl_mesh_xyz(a), tl_mesh_xyz(b), tl_mesh_vert_count(a) * 24));
    for (size_t v = 0; v < tl_mesh_vert_count(a); v++)
        CHECK_NEAR(tl_mesh_channel(a, 0)->values[v], 7, 1e-12);
    tl_mesh_destroy(a);
    tl_mesh_destroy(b);
    tl_ctx_destroy(one);
    tl_ctx_destroy(many);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_prisms),
        cmocka_unit_test(test_directions_of_faces),
        cmocka_unit_test(test_centre),
        cmocka_unit_test(test_open_cells),
        cmocka_unit_test(test_missing_faces),
        cmocka_unit_test(test_no_holes),
        cmocka_unit_test(test_polyhedra_beside_hexahedra),
        cmocka_unit_test(test_refinement),
        cmocka_unit_test(test_labels),
        cmocka_unit_test(test_labels_of_blocks),
        cmocka_unit_test(test_same_for_any_threads),
    };
    return cmocka_run_group_tests_name("formats_poly", tests, NULL, NULL);
}
