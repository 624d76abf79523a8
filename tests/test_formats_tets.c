/* Grids to meshes of tets: blocks, lists of mixed cells, what is dropped and what is counted. */
#include "check.h"
#include "check_alloc.h"
#include "check_grid.h"

#include "base/base_predicates.h"
#include "formats/formats_tets.h"

/* ---- contexts whose log is kept, whose n-th allocation fails ---- */

typedef struct host {
    check_alloc alloc; /* the first, so that both hooks find what is theirs */
    char log[4096];
} host;

static void keep_log(void *user, tl_log_level level, const char *text)
{
    host *h = user;
    CHECK(level >= TL_LOG_INFO);
    size_t used = strlen(h->log);
    snprintf(h->log + used, sizeof h->log - used, "%s\n", text);
}

static tl_ctx *open_ctx(host *h, unsigned threads)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = threads;
    opts.resize = check_alloc_resize;
    opts.log = keep_log;
    opts.user = h;
    tl_ctx *ctx = NULL;
    CHECK_EQ(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

/* ---- grids made by hand ---- */

static double wave(double x, double y, double z)
{
    return x + 10 * y + 100 * z;
}

/* A block of ni x nj x nk points at the integers, with a wave at them and a cell array. */
static tl_status make_block(tl_ctx *ctx, uint32_t ni, uint32_t nj, uint32_t nk, tli_grid *grid)
{
    tl_status st = grid_make_block(ctx, 0, ni, nj, nk, "wave", grid);
    for (uint64_t p = 0; !st && p < grid->point_count; p++) {
        const double *at = grid->xyz + 3 * p;
        grid->point_arrays[0].values[p] = wave(at[0], at[1], at[2]);
    }
    return st;
}

typedef struct list_cell {
    uint8_t type;
    int count;
    uint32_t ids[10];
} list_cell;

static tl_status make_list(tl_ctx *ctx, const double (*xyz)[3], uint64_t point_count,
                           const list_cell *cells, uint64_t cell_count, tli_grid *grid)
{
    tl_status st = TL_OK;
    tli_grid_init(ctx, grid);
    grid->point_count = point_count;
    grid->cell_count = cell_count;
    grid->xyz = tl_mem_alloc(ctx, (size_t)point_count, 3 * sizeof(double), &st);
    grid->types = tl_mem_alloc(ctx, (size_t)cell_count, 1, &st);
    grid->offsets = tl_mem_alloc(ctx, (size_t)cell_count + 1, sizeof *grid->offsets, &st);
    grid->connectivity = tl_mem_alloc(ctx, (size_t)cell_count, 10 * sizeof(uint32_t), &st);
    if (st) return st;
    memcpy(grid->xyz, xyz, (size_t)point_count * sizeof *xyz);
    grid->offsets[0] = 0;
    for (uint64_t c = 0; c < cell_count; c++) {
        grid->types[c] = cells[c].type;
        grid->offsets[c + 1] = grid->offsets[c] + (uint64_t)cells[c].count;
        memcpy(grid->connectivity + grid->offsets[c], cells[c].ids,
               (size_t)cells[c].count * sizeof(uint32_t));
    }
    return TL_OK;
}

static void add_values(tli_grid *grid, tl_on on, const char *name, uint32_t components,
                       const double *values)
{
    tli_grid_array *array;
    CHECK_OK(grid->ctx, tli_grid_add(grid, on, name, components, TL_F32, NULL, &array));
    memcpy(array->values, values, (size_t)array->count * components * sizeof *values);
}

static void count_signs(const tl_mesh *mesh, size_t *inverted, size_t *flat)
{
    const tl_lidx *tets = tl_mesh_tets(mesh);
    const double *xyz = tl_mesh_xyz(mesh);
    *inverted = *flat = 0;
    for (size_t t = 0; t < 4 * tl_mesh_tet_count(mesh); t += 4) {
        int sign = tli_orient3d(xyz + 3 * (size_t)tets[t], xyz + 3 * (size_t)tets[t + 1],
                                xyz + 3 * (size_t)tets[t + 2], xyz + 3 * (size_t)tets[t + 3]);
        *inverted += sign < 0;
        *flat += sign == 0;
    }
}

static void check_positive(const tl_mesh *mesh)
{
    size_t inverted, flat;
    count_signs(mesh, &inverted, &flat);
    CHECK_EQ(inverted, 0);
    CHECK_EQ(flat, 0);
}

/* Every face has one or two tets, and the outer ones have the given area in triangles. */
static void check_conforming(tl_ctx *ctx, const tl_mesh *mesh, size_t boundary_triangles)
{
    tl_lidx *opposite = NULL, *triangles = NULL;
    size_t nonmanifold = 7, count = 0;
    CHECK_OK(ctx, tl_mesh_adjacency(ctx, mesh, &opposite, &nonmanifold));
    CHECK_OK(ctx, tl_mesh_boundary(ctx, mesh, opposite, &triangles, NULL, &count));
    CHECK_EQ(nonmanifold, 0);
    CHECK_EQ(count, boundary_triangles);
    tl_mem_free(ctx, triangles);
    tl_mem_free(ctx, opposite);
}

/* ---- blocks ---- */

static void check_block(unsigned threads, int split)
{
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, threads);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    tl_read_opts opts = tl_read_opts_defaults();
    opts.split = split;
    CHECK_OK(ctx, make_block(ctx, 41, 37, 53, &grid)); /* more cells than one piece */
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, &opts, &mesh, &report));
    size_t cells = 40 * 36 * 52;
    CHECK_EQ(tl_mesh_tet_count(mesh), cells * (size_t)split);
    CHECK_EQ(tl_mesh_vert_count(mesh), 41 * 37 * 53);
    CHECK_EQ(report.cells[TL_CELL_HEXAHEDRON], cells);
    CHECK_EQ(report.turned + report.inverted + report.degenerate + report.unused_points, 0);
    CHECK_NEAR(volume_of(mesh), (double)cells, 1e-6);
    check_conforming(ctx, mesh, 2 * 2 * (40 * 36 + 36 * 52 + 40 * 52));
    const tl_channel *wave_channel = tl_mesh_channel_by_name(mesh, "wave");
    const tl_channel *cell_channel = tl_mesh_channel_by_name(mesh, "cell");
    CHECK(wave_channel && cell_channel);
    CHECK_EQ(cell_channel->on, TL_ON_TET);
    CHECK_EQ(wave_channel->scalar, TL_F32);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++)
        CHECK_EQ(cell_channel->values[t], t / (size_t)split);
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
        const double *at = tl_mesh_xyz(mesh) + 3 * v;
        CHECK_NEAR(wave_channel->values[v], wave(at[0], at[1], at[2]), 0);
    }
    assert_string_equal(h.log, "");
    tl_mesh_destroy(mesh);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_blocks(void **state)
{
    (void)state;
    check_block(1, 5);
    check_block(3, 5);
    check_block(2, 6);
}

static void test_left_handed_blocks_are_turned(void **state)
{
    (void)state;
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 1);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    CHECK_OK(ctx, make_block(ctx, 3, 4, 5, &grid));
    for (uint64_t p = 0; p < grid.point_count; p++) grid.xyz[3 * p] *= -1;
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, &report));
    CHECK_EQ(report.turned, 2 * 3 * 4 * 5);
    CHECK_EQ(report.inverted, 0);
    CHECK_NEAR(volume_of(mesh), 24, 1e-12);
    check_positive(mesh);
    CHECK(strstr(h.log, "120 tets turned"));
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* Three blocks: volume, surface, volume; and one without points. */
static void test_several_blocks(void **state)
{
    (void)state;
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 2);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    tl_status st = TL_OK;
    CHECK_OK(ctx, make_block(ctx, 4, 4, 4, &grid));
    tl_mem_free(ctx, grid.blocks);
    grid.blocks = tl_mem_alloc(ctx, 4, sizeof *grid.blocks, &st);
    CHECK_EQ(st, TL_OK);
    grid.block_count = 4;
    grid.blocks[0] = (tli_grid_block){0, {4, 4, 2}};
    grid.blocks[1] = (tli_grid_block){32, {0, 4, 4}};
    grid.blocks[2] = (tli_grid_block){0, {4, 4, 1}};
    grid.blocks[3] = (tli_grid_block){32, {4, 4, 2}};
    tli_grid_drop_array(&grid, TL_ON_TET, 0);
    double ids[27];
    for (int i = 0; i < 27; i++) ids[i] = i;
    add_values(&grid, TL_ON_TET, "id", 1, ids);
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, &report));
    CHECK_EQ(report.cells[TL_CELL_HEXAHEDRON], 18);
    CHECK_EQ(report.cells[TL_CELL_SURFACE], 9);
    CHECK_EQ(report.surface_cells, 9);
    CHECK_EQ(tl_mesh_tet_count(mesh), 90);
    CHECK_EQ(tl_mesh_channel_by_name(mesh, "id")->values[44], 8);
    CHECK_EQ(tl_mesh_channel_by_name(mesh, "id")->values[45], 18); /* after the 9 of the surface */
    CHECK_NEAR(volume_of(mesh), 18, 1e-12);
    CHECK(strstr(h.log, "9 cells left out: surface 9"));
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- missing values ---- */

static void test_blanks_and_fill_values(void **state)
{
    (void)state;
    for (int way = 0; way < 4; way++) { /* iblank, fill value; cut away, kept */
        host h = {.log = ""};
        tl_ctx *ctx = open_ctx(&h, 2);
        tli_grid grid;
        tl_mesh *mesh;
        tl_status st = TL_OK;
        tl_read_report report;
        tl_read_opts opts = tl_read_opts_defaults();
        CHECK_OK(ctx, make_block(ctx, 5, 5, 5, &grid));
        opts.keep_fill = way & 1;
        if (way & 2) {
            opts.has_fill_value = true;
            opts.fill_value = 1.1e20; /* the file holds the nearest float32 */
            grid.point_arrays[0].values[0] = (double)1.1e20f;
        } else {
            grid.blanks = tl_mem_alloc(ctx, 125, 1, &st);
            CHECK_EQ(st, TL_OK);
            memset(grid.blanks, 1, 125);
            grid.blanks[0] = 0;
        }
        CHECK_OK(ctx, tli_grid_to_mesh(&grid, &opts, &mesh, &report));
        const tl_channel *channel = tl_mesh_channel_by_name(mesh, "wave");
        if (opts.keep_fill) {
            CHECK_EQ(tl_mesh_tet_count(mesh), 320);
            CHECK(isnan(channel->values[0]));
            CHECK_EQ(report.nonfinite_values, 1);
            CHECK_EQ(report.blank_cells, 0);
            CHECK(strstr(h.log, "1 missing values kept as NaN"));
        } else {
            CHECK_EQ(tl_mesh_tet_count(mesh), 315);
            CHECK_EQ(tl_mesh_vert_count(mesh), 124);
            CHECK_EQ(report.blank_cells, 1);
            CHECK_EQ(report.unused_points, 1);
            CHECK_NEAR(channel->values[0], wave(1, 0, 0), 0);
            CHECK_NEAR(volume_of(mesh), 63, 1e-12);
            check_conforming(ctx, mesh, 192);
            CHECK(strstr(h.log, "1 cells cut away for missing values"));
            CHECK_EQ(tl_mesh_channel_by_name(mesh, "cell")->values[0], 1);
        }
        tl_mesh_destroy(mesh);
        tl_ctx_destroy(ctx);
    }
}

static void test_nan_as_fill_value_and_cells_that_hold_it(void **state)
{
    (void)state;
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 1);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    tl_read_opts opts = tl_read_opts_defaults();
    opts.has_fill_value = true;
    opts.fill_value = (double)NAN;
    CHECK_OK(ctx, make_block(ctx, 4, 4, 4, &grid));
    grid.cell_arrays[0].values[13] = (double)NAN; /* the cell in the middle */
    grid.point_arrays[0].values[63] = (double)NAN;
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, &opts, &mesh, &report));
    CHECK_EQ(report.blank_cells, 2);
    CHECK_EQ(tl_mesh_tet_count(mesh), 125);
    check_conforming(ctx, mesh, 108 + 12);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- lists of cells ---- */

static const double cube_xyz[9][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},    {0, 0, 1},
                                      {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 2}};

/* A hexahedron with a pyramid on top, a quad and a vertex, an unused point. */
static void test_mixed_cells(void **state)
{
    (void)state;
    static const list_cell cells[] = {
        {9, 4, {0, 1, 2, 3}},     {12, 8, {0, 1, 2, 3, 4, 5, 6, 7}},
        {14, 5, {4, 5, 6, 7, 8}}, {1, 1, {0}},
        {42, 4, {0, 1, 2, 3}},    {7, 5, {0, 1, 2, 3, 4}},
    };
    static const double material[] = {-1, 4, 5, -1, -1, -1};
    double xyz[10][3];
    memcpy(xyz, cube_xyz, sizeof cube_xyz);
    xyz[9][0] = xyz[9][1] = xyz[9][2] = 77;
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 2);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    CHECK_OK(ctx, make_list(ctx, (const double(*)[3])xyz, 10, cells, 6, &grid));
    add_values(&grid, TL_ON_TET, " Material #", 1, material);
    grid.time = 2.5;
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, &report));
    CHECK_NEAR(volume_of(mesh), 1 + 1.0 / 3, 1e-15);
    CHECK_EQ(tl_mesh_tet_count(mesh), 6 + 2);
    CHECK_EQ(tl_mesh_vert_count(mesh), 9);
    CHECK_EQ(report.points, 10);
    CHECK_EQ(report.unused_points, 1);
    CHECK_EQ(report.surface_cells, 4);
    CHECK_EQ(report.cells[TL_CELL_PYRAMID], 1);
    CHECK_EQ(report.cells[TL_CELL_POLYHEDRON], 1);
    check_conforming(ctx, mesh, 5 * 2 + 4);
    CHECK_NEAR(tl_mesh_time(mesh), 2.5, 0);
    const tl_channel *channel = tl_mesh_channel_by_name(mesh, " Material #");
    for (size_t t = 0; t < 8; t++) {
        CHECK_EQ(tl_mesh_regions(mesh)[t], t < 6 ? 4 : 5);
        CHECK_EQ(channel->values[t], t < 6 ? 4 : 5);
    }
    CHECK(strstr(h.log, "4 cells left out: surface 2 point 1\n"));
    CHECK(strstr(h.log, "1 polyhedra without faces left out\n"));
    CHECK(strstr(h.log, "1 points of no tet left out"));
    CHECK(strstr(h.log, "regions from the cell array ' Material #'"));
    tl_mesh_destroy(mesh);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_collapsed_and_folded_cells(void **state)
{
    (void)state;
    static const list_cell cells[] = {
        {12, 8, {0, 1, 2, 3, 8, 8, 8, 8}}, /* a pyramid */
        {10, 4, {0, 2, 1, 4}},             /* negative: turned */
        {10, 4, {0, 1, 2, 3}},             /* flat */
        {10, 4, {0, 1, 1, 4}},             /* repeated */
        {24, 10, {0, 1, 3, 4, 5, 5, 5, 5, 5, 5}},
    };
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 1);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    CHECK_OK(ctx, make_list(ctx, cube_xyz, 9, cells, 5, &grid));
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, &report));
    CHECK_EQ(tl_mesh_tet_count(mesh), 2 + 1 + 1 + 1);
    CHECK_EQ(report.turned, 1);
    CHECK_EQ(report.degenerate, 1);
    CHECK_EQ(report.inverted, 0);
    CHECK_NEAR(volume_of(mesh), 2.0 / 3 + 1.0 / 6 + 1.0 / 6, 1e-15);
    CHECK(strstr(h.log, "tets with a repeated vertex dropped"));
    CHECK(strstr(h.log, "1 cells of higher order taken by their corners"));
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* A hexahedron one of whose corners is pushed through the opposite face keeps an inverted tet, and
 * a mirrored copy of it is turned first and keeps as many. */
static void test_inverted_cells_are_counted(void **state)
{
    (void)state;
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        static const list_cell cells[] = {{12, 8, {0, 1, 2, 3, 4, 5, 6, 7}}};
        double xyz[8][3];
        memcpy(xyz, cube_xyz, sizeof xyz);
        xyz[6][2] = -3;
        for (int i = 0; i < 8 && mirrored; i++) xyz[i][0] *= -1;
        host h = {.log = ""};
        tl_ctx *ctx = open_ctx(&h, 1);
        tli_grid grid;
        tl_mesh *mesh;
        tl_read_report report;
        size_t inverted, flat;
        CHECK_OK(ctx, make_list(ctx, (const double(*)[3])xyz, 8, cells, 1, &grid));
        CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, &report));
        CHECK(report.inverted > 0);
        count_signs(mesh, &inverted, &flat);
        CHECK_EQ(inverted, report.inverted);
        CHECK_EQ(flat, report.degenerate);
        CHECK(strstr(h.log, "tets stay inverted"));
        tl_mesh_destroy(mesh);
        tl_ctx_destroy(ctx);
    }
}

static void test_ghosts(void **state)
{
    (void)state;
    static const list_cell cells[] = {
        {10, 4, {0, 1, 3, 4}}, {10, 4, {1, 2, 3, 6}}, {10, 4, {4, 5, 6, 1}},
        {10, 4, {4, 7, 6, 3}}, {5, 3, {0, 1, 2}},
    };
    static const double ghost_cells[] = {1, 0, 32, 4, 1}, ids[] = {0, 1, 2, 3, 4};
    static const double ghost_points[] = {0, 0, 0, 1, 0, 0, 0, 2, 0};
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 2);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    CHECK_OK(ctx, make_list(ctx, cube_xyz, 9, cells, 5, &grid));
    add_values(&grid, TL_ON_TET, "vtkGhostType", 1, ghost_cells);
    add_values(&grid, TL_ON_VERTEX, "vtkGhostType", 1, ghost_points);
    add_values(&grid, TL_ON_TET, "id", 1, ids);
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, &report));
    CHECK_EQ(report.ghost_cells, 3); /* duplicate, hidden, with a hidden point */
    CHECK_EQ(report.surface_cells, 1);
    CHECK_EQ(tl_mesh_tet_count(mesh), 1);
    CHECK_EQ(tl_mesh_channel_count(mesh), 1);
    CHECK_EQ(tl_mesh_channel(mesh, 0)->values[0], 1);
    CHECK(strstr(h.log, "3 ghost cells dropped"));
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_no_volume_cells(void **state)
{
    (void)state;
    static const list_cell cells[] = {{9, 4, {0, 1, 2, 3}}, {3, 2, {0, 1}}};
    static const double values[] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 2);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    tl_read_opts opts = tl_read_opts_defaults();
    opts.cell_to_point = true;
    CHECK_OK(ctx, make_list(ctx, cube_xyz, 9, cells, 2, &grid));
    add_values(&grid, TL_ON_VERTEX, "p", 1, values);
    add_values(&grid, TL_ON_TET, "block", 1, values);
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, &opts, &mesh, &report));
    CHECK_EQ(tl_mesh_tet_count(mesh), 0);
    CHECK_EQ(tl_mesh_vert_count(mesh), 9);
    CHECK_EQ(tl_mesh_channel_count(mesh), 2);
    CHECK_EQ(report.unused_points, 0);
    CHECK_NEAR(tl_mesh_channel_by_name(mesh, "p")->values[8], 9, 0);
    tl_mesh_destroy(mesh);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- tets alone, in place ---- */

static void make_plain_tets(tl_ctx *ctx, tli_grid *grid, bool with_types)
{
    static const uint32_t ids[4][4] = {{0, 1, 3, 4}, {2, 3, 1, 6}, {5, 5, 6, 1}, {7, 6, 4, 3}};
    tl_status st = TL_OK;
    tli_grid_init(ctx, grid);
    grid->point_count = 9;
    grid->cell_count = 4;
    grid->xyz = tl_mem_alloc(ctx, 9, sizeof cube_xyz[0], &st);
    grid->connectivity = tl_mem_alloc(ctx, 16, sizeof(uint32_t), &st);
    if (with_types) {
        grid->types = tl_mem_alloc(ctx, 4, 1, &st);
        grid->offsets = tl_mem_alloc(ctx, 5, sizeof *grid->offsets, &st);
    }
    CHECK_EQ(st, TL_OK);
    memcpy(grid->xyz, cube_xyz, sizeof cube_xyz);
    memcpy(grid->connectivity, ids, sizeof ids);
    for (unsigned i = 0; i < 4 && with_types; i++) grid->types[i] = 10;
    for (unsigned i = 0; i < 5 && with_types; i++) grid->offsets[i] = 4 * i;
}

static void test_plain_tets(void **state)
{
    (void)state;
    static const double values[] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    for (int with_types = 0; with_types < 2; with_types++) {
        host h = {.log = ""};
        tl_ctx *ctx = open_ctx(&h, 2);
        tli_grid grid;
        tl_mesh *mesh;
        tl_read_report report;
        make_plain_tets(ctx, &grid, with_types);
        add_values(&grid, TL_ON_VERTEX, "p", 1, values);
        add_values(&grid, TL_ON_TET, "c", 2, values);
        CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, &report));
        CHECK_EQ(report.cells[TL_CELL_TETRA], 4);
        CHECK_EQ(tl_mesh_tet_count(mesh), 3);
        CHECK_EQ(tl_mesh_vert_count(mesh), 7); /* 5 and 8 are gone */
        CHECK_EQ(report.unused_points, 2);
        const tl_channel *p = tl_mesh_channel_by_name(mesh, "p");
        const tl_channel *c = tl_mesh_channel_by_name(mesh, "c");
        CHECK_EQ(p->values[5], 7);
        CHECK_EQ(p->values[6], 8);
        CHECK_EQ(c->values[3], 4);
        CHECK_EQ(c->values[4], 7); /* the third tet has gone */
        CHECK_NEAR(volume_of(mesh), 0.5, 1e-15);
        check_positive(mesh);
        tl_mesh_destroy(mesh);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
}

/* Tets alone cost little on top of the mesh: marks of cells and points. */
static void test_memory_of_plain_tets(void **state)
{
    (void)state;
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 2);
    tli_grid grid;
    tl_mesh *mesh;
    tl_status st = TL_OK;
    size_t tets = 400000;
    tli_grid_init(ctx, &grid);
    grid.point_count = 80000;
    grid.cell_count = tets;
    grid.xyz = tl_mem_alloc(ctx, 80000, 3 * sizeof(double), &st);
    grid.connectivity = tl_mem_alloc(ctx, tets, 4 * sizeof(uint32_t), &st);
    CHECK_EQ(st, TL_OK);
    for (size_t i = 0; i < 240000; i++) grid.xyz[i] = (double)((i * 2654435761u) % 1000);
    for (size_t i = 0; i < 4 * tets; i++) grid.connectivity[i] = (uint32_t)((i * 48271u) % 79000);
    CHECK_OK(ctx, tli_grid_add(&grid, TL_ON_TET, "c", 1, TL_F32, NULL, NULL));
    memset(grid.cell_arrays[0].values, 0, tets * sizeof(double));
    size_t before = tl_ctx_current_bytes(ctx);
    tl_ctx_reset_peak(ctx);
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, NULL));
    CHECK_BOUND("transient bytes a tet", (double)(tl_ctx_peak_bytes(ctx) - before) / (double)tets,
                3);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- cell data to points ---- */

static void test_cell_to_point(void **state)
{
    (void)state;
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 2);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_opts opts = tl_read_opts_defaults();
    opts.cell_to_point = true;
    opts.region = "cell";
    CHECK_OK(ctx, make_block(ctx, 4, 2, 2, &grid)); /* three cells in a row */
    for (uint64_t p = 0; p < grid.point_count; p++)
        if (grid.xyz[3 * p] == 3) grid.xyz[3 * p] = 5; /* of lengths 1, 1 and 3 */
    static const double values[] = {1, 10, 2, 20, 6, 60};
    add_values(&grid, TL_ON_TET, "wave", 2, values);
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, &opts, &mesh, NULL));
    CHECK_EQ(tl_mesh_channel_count(mesh), 3);
    CHECK_EQ(tl_mesh_channel_by_name(mesh, "cell")->on, TL_ON_TET);
    CHECK_EQ(tl_mesh_regions(mesh)[14], 2);
    const tl_channel *mean = tl_mesh_channel_by_name(mesh, "wave_2");
    CHECK(mean != NULL);
    CHECK_EQ(mean->on, TL_ON_VERTEX);
    static const double expected[] = {1, 1.5, 5, 6};
    for (size_t v = 0; v < 16; v++) {
        CHECK_NEAR(mean->values[2 * v], expected[v % 4], 1e-14);
        CHECK_NEAR(mean->values[2 * v + 1], 10 * expected[v % 4], 1e-13);
    }
    tl_mesh_destroy(mesh);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- regions ---- */

static void test_region_names(void **state)
{
    (void)state;
    static const char *const yes[] = {"region",      "Region",   "MATERIAL", "Block",  "Material #",
                                      "MaterialIds", "block_id", " region ", "Blocks", "RegionId"};
    static const char *const no[] = {"",
                                     "regio",
                                     "MaterialVolumeFraction",
                                     "my region",
                                     "mat",
                                     "blockage",
                                     "material_temperature",
                                     "regional",
                                     "block temperature id"};
    for (size_t i = 0; i < sizeof yes / sizeof yes[0]; i++)
        if (!tli_is_region_name(yes[i])) fail_msg("'%s' is a name of regions", yes[i]);
    for (size_t i = 0; i < sizeof no / sizeof no[0]; i++)
        if (tli_is_region_name(no[i])) fail_msg("'%s' is no name of regions", no[i]);
}

static void test_chosen_regions(void **state)
{
    (void)state;
    static const double fractions[] = {0.4, 1.5, 2.6}, bad[] = {1, 1e12, 2}, ids[] = {7, 8, 9};
    static const struct {
        const char *region;
        tl_status status;
        int first; /* region of tet 0; -1: none */
    } cases[] = {{NULL, TL_OK, 7},
                 {"fraction", TL_OK, 0},
                 {"none", TL_ERR_DATA, -1},
                 {"vector", TL_ERR_DATA, -1},
                 {"bad", TL_ERR_DATA, -1}};
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        host h = {.log = ""};
        tl_ctx *ctx = open_ctx(&h, 1);
        tli_grid grid;
        tl_mesh *mesh;
        tl_read_opts opts = tl_read_opts_defaults();
        opts.region = cases[k].region;
        static const double vectors[] = {1, 1, 1, 2, 2, 2, 3, 3, 3};
        CHECK_OK(ctx, make_block(ctx, 4, 2, 2, &grid));
        add_values(&grid, TL_ON_TET, "region", 1, fractions); /* the name, but no ids */
        add_values(&grid, TL_ON_TET, "vector", 3, vectors);
        add_values(&grid, TL_ON_TET, "bad", 1, bad);
        add_values(&grid, TL_ON_TET, "fraction", 1, fractions);
        add_values(&grid, TL_ON_TET, "Block", 1, ids);
        CHECK_STATUS(tli_grid_to_mesh(&grid, &opts, &mesh, NULL), cases[k].status);
        if (cases[k].status) {
            CHECK(mesh == NULL);
            CHECK(strstr(tl_ctx_message(ctx), cases[k].region));
        } else {
            CHECK_EQ(tl_mesh_regions(mesh)[0], cases[k].first);
            CHECK(tl_mesh_channel_by_name(mesh, "Block") != NULL);
        }
        tl_mesh_destroy(mesh);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
}

/* ---- what is refused ---- */

static void test_refused(void **state)
{
    (void)state;
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 1);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_opts opts = tl_read_opts_defaults();
    static const list_cell seven[] = {{10, 4, {0, 1, 2, 4}}, {12, 7, {0, 1, 2, 3, 4, 5, 6}}};
    CHECK_OK(ctx, make_list(ctx, cube_xyz, 9, seven, 2, &grid));
    CHECK_STATUS(tli_grid_to_mesh(&grid, NULL, &mesh, NULL), TL_ERR_FORMAT);
    CHECK(strstr(tl_ctx_message(ctx), "cell 1 (hexahedron): 7 points, expected 8"));
    opts.split = 7;
    CHECK_OK(ctx, make_block(ctx, 2, 2, 2, &grid));
    CHECK_STATUS(tli_grid_to_mesh(&grid, &opts, &mesh, NULL), TL_ERR_ARG);
    CHECK_OK(ctx, make_block(ctx, 2, 2, 2, &grid));
    grid.blocks[0].first_point = 1;
    CHECK_STATUS(tli_grid_to_mesh(&grid, NULL, &mesh, NULL), TL_ERR_FORMAT);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_points_that_are_not_finite(void **state)
{
    (void)state;
    host h = {.log = ""};
    tl_ctx *ctx = open_ctx(&h, 2);
    tli_grid grid;
    tl_mesh *mesh;
    tl_read_report report;
    CHECK_OK(ctx, make_block(ctx, 3, 3, 3, &grid));
    grid.xyz[0] = (double)NAN;
    grid.xyz[3 * 26] = (double)INFINITY;
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, &report));
    CHECK_EQ(tl_mesh_tet_count(mesh), 40);
    CHECK(strstr(h.log, "10 tets have a corner that is not finite"));
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- memory that runs out ---- */

static tl_status convert_all(tl_ctx *ctx, tl_mesh **mesh)
{
    static const list_cell cells[] = {{12, 8, {0, 1, 2, 3, 4, 5, 6, 7}}, {14, 5, {4, 5, 6, 7, 8}}};
    static const double values[] = {3, 4};
    double xyz[10][3] = {{0}};
    memcpy(xyz, cube_xyz, sizeof cube_xyz);
    tl_read_opts opts = tl_read_opts_defaults();
    opts.cell_to_point = true;
    tli_grid grid;
    tli_grid_array *array = NULL;
    tl_status st = make_list(ctx, (const double(*)[3])xyz, 10, cells, 2, &grid);
    if (!st) st = tli_grid_add(&grid, TL_ON_TET, "region", 1, TL_I32, NULL, &array);
    if (!st) memcpy(array->values, values, sizeof values);
    if (!st) st = tli_grid_add(&grid, TL_ON_TET, "other", 1, TL_I32, NULL, &array);
    if (!st) memcpy(array->values, values, sizeof values);
    if (!st) st = tli_grid_to_mesh(&grid, &opts, mesh, NULL);
    tli_grid_release(&grid);
    return st;
}

static void test_every_allocation_fails_once(void **state)
{
    (void)state;
    for (unsigned long n = 1;; n++) {
        host h = {.log = ""};
        tl_ctx *ctx = open_ctx(&h, 2);
        tl_mesh *mesh = NULL;
        h.alloc.requests = 0;
        h.alloc.fail_at = n;
        tl_status st = convert_all(ctx, &mesh);
        CHECK((st == TL_OK) == (mesh != NULL));
        if (st) CHECK_EQ(st, TL_ERR_MEMORY);
        bool failed = h.alloc.requests >= n;
        tl_mesh_destroy(mesh);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
        if (!failed) {
            printf("%lu allocations failed in turn\n", n - 1);
            CHECK_EQ(st, TL_OK);
            CHECK(n > 20);
            return;
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_left_handed_blocks_are_turned),
        cmocka_unit_test(test_several_blocks),
        cmocka_unit_test(test_blanks_and_fill_values),
        cmocka_unit_test(test_nan_as_fill_value_and_cells_that_hold_it),
        cmocka_unit_test(test_mixed_cells),
        cmocka_unit_test(test_collapsed_and_folded_cells),
        cmocka_unit_test(test_inverted_cells_are_counted),
        cmocka_unit_test(test_ghosts),
        cmocka_unit_test(test_no_volume_cells),
        cmocka_unit_test(test_plain_tets),
        cmocka_unit_test(test_memory_of_plain_tets),
        cmocka_unit_test(test_cell_to_point),
        cmocka_unit_test(test_region_names),
        cmocka_unit_test(test_chosen_regions),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_points_that_are_not_finite),
        cmocka_unit_test(test_every_allocation_fails_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
