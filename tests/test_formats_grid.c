/* What readers fill and share: joining of grids, structured blocks as lists, welding, names, steps,
 * and files that name files. */
#include "fail_alloc.h"

#include "check_grid.h"
#include "formats/formats_reader.h"

#include <unistd.h>

/* ---- grids made by hand ---- */

/* The unit tet, as a list without types and offsets. */
static tl_status make_tet(tl_ctx *ctx, tli_grid *grid)
{
    static const double xyz[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    tl_status st = TL_OK;
    tli_grid_init(ctx, grid);
    grid->point_count = 4;
    grid->cell_count = 1;
    grid->xyz = tl_mem_alloc(ctx, 12, sizeof(double), &st);
    grid->connectivity = tl_mem_alloc(ctx, 4, sizeof(uint32_t), &st);
    if (st) return st;
    memcpy(grid->xyz, xyz, sizeof xyz);
    for (uint32_t i = 0; i < 4; i++) grid->connectivity[i] = i;
    return TL_OK;
}

static tl_status add_quad_label(tli_grid *grid, const char *name, const uint32_t ids[4])
{
    tl_status st = TL_OK;
    uint64_t *offsets = tl_mem_alloc(grid->ctx, 2, sizeof *offsets, &st);
    uint32_t *points = tl_mem_alloc(grid->ctx, 4, sizeof *points, &st);
    if (!st) {
        offsets[0] = 0, offsets[1] = 4;
        memcpy(points, ids, 4 * sizeof *ids);
        st = tli_grid_add_label(grid, name, 3, 1, offsets, points);
    }
    if (st) {
        tl_mem_free(grid->ctx, points);
        tl_mem_free(grid->ctx, offsets);
    }
    return st;
}

/* ---- joining ---- */

static void test_blocks_stay_blocks(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_grid all, part;
    const uint32_t left[4] = {0, 2, 6, 4};
    tli_grid_init(ctx, &all);
    for (int b = 0; b < 2; b++) {
        CHECK_OK(ctx, grid_make_block(ctx, 2 * b, 2, 2, 2, "x", &part));
        CHECK_OK(ctx, add_quad_label(&part, "left", left));
        part.time = 0.5;
        const tli_join how = {true, 10 + b, b ? "second" : "first"};
        CHECK_OK(ctx, tli_grid_join(&all, &part, &how));
        CHECK_EQ(part.point_count, 0);
    }
    CHECK_EQ(all.block_count, 2);
    CHECK_EQ(all.blocks[1].first_point, 8);
    CHECK_EQ(all.point_count, 16);
    CHECK(all.xyz[3 * 8] == 2 && all.time == 0.5);
    CHECK(all.regions[0] == 10 && all.regions[1] == 11);
    CHECK_EQ(all.region_name_count, 2);
    CHECK(!strcmp(all.region_names[1].name, "second"));
    CHECK(grid_array(&all, TL_ON_VERTEX, "x")->values[15] == 3);
    CHECK_EQ(all.label_count, 1);
    CHECK_EQ(all.labels[0].face_count, 2);
    CHECK_EQ(all.labels[0].points[all.labels[0].offsets[1] + 2], 14);
    grid_check(&all);
    tli_grid_release(&all);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* A block and a list: both become lists, arrays that one side lacks are NaN there. */
static void test_block_and_list(void **state)
{
    (void)state;
    for (int order = 0; order < 2; order++) {
        tl_ctx *ctx = grid_ctx(0, 1);
        tli_grid block, tet;
        CHECK_OK(ctx, grid_make_block(ctx, 0, 3, 2, 2, "x", &block));
        CHECK_OK(ctx, make_tet(ctx, &tet));
        tli_grid *all = order ? &tet : &block, *part = order ? &block : &tet;
        CHECK_OK(ctx, tli_grid_join(all, part, NULL));
        grid_check(all);
        CHECK_EQ(all->block_count, 0);
        CHECK_EQ(all->cell_count, 3);
        CHECK_EQ(all->types[order ? 0 : 2], 10);
        CHECK_EQ(all->types[1], 12);
        CHECK_EQ(all->connectivity[all->offsets[order ? 0 : 2] + 1], order ? 1 : 13);
        const tli_grid_array *cell = grid_array(all, TL_ON_TET, "cell");
        CHECK(isnan(cell->values[order ? 0 : 2]) && cell->values[order ? 2 : 1] == 1);
        CHECK_EQ(cell->scalar, TL_F64);
        CHECK_EQ(grid_array(all, TL_ON_VERTEX, "x")->scalar, TL_F32);
        tli_grid_release(all);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
}

static void test_flat_blocks_as_lists(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    const struct {
        uint32_t dims[3];
        uint8_t type;
        uint32_t last[4];
    } cases[] = {
        {{3, 1, 3}, 9, {4, 5, 8, 7}}, {{1, 4, 1}, 3, {2, 3, 0, 0}}, {{1, 1, 1}, 1, {0, 0, 0, 0}}};
    for (int i = 0; i < 3; i++) {
        tli_grid grid;
        const uint32_t *d = cases[i].dims;
        CHECK_OK(ctx, grid_make_block(ctx, 0, d[0], d[1], d[2], "x", &grid));
        uint64_t cells = tli_grid_cell_count(&grid);
        CHECK_OK(ctx, tli_grid_unstructure(&grid));
        CHECK_EQ(grid.cell_count, cells);
        CHECK_EQ(grid.types[cells - 1], cases[i].type);
        uint64_t corners = grid.offsets[cells] - grid.offsets[cells - 1];
        CHECK(!memcmp(grid.connectivity + grid.offsets[cells - 1], cases[i].last,
                      corners * sizeof(uint32_t)));
        grid_check(&grid);
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

static tl_status join_all(tl_ctx *ctx, void *arg)
{
    tli_grid all, part;
    const uint32_t quad[4] = {0, 1, 3, 2};
    (void)arg;
    tli_grid_init(ctx, &all);
    tl_status st = TL_OK;
    for (int i = 0; i < 3 && !st; i++) {
        st = i == 1 ? make_tet(ctx, &part) : grid_make_block(ctx, i, 2, 2, 2, "x", &part);
        if (!st) st = add_quad_label(&part, "quad", quad);
        const tli_join how = {true, i, "name"};
        if (!st) st = tli_grid_join(&all, &part, &how);
        tli_grid_release(&part);
    }
    uint64_t welded;
    if (!st) st = tli_grid_weld(&all, 0, &welded);
    tli_grid_release(&all);
    return st;
}

static void test_failing_allocations(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, join_all, NULL) > 30);
    fail_alloc_close(&f);
}

/* ---- welding ---- */

/* Two blocks that share a face become one mesh; a gap is closed by a distance that spans it. */
static void test_weld(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    const struct {
        double gap, distance;
        uint64_t welded;
    } cases[] = {{0, 0, 9}, {1e-3, 0, 0}, {1e-3, 9e-4, 0}, {1e-3, 1.1e-3, 9}, {-1e-3, 2e-3, 9}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tli_grid all, part;
        uint64_t welded;
        CHECK_OK(ctx, grid_make_block(ctx, 1e6, 4, 3, 3, "x", &all));
        CHECK_OK(ctx, grid_make_block(ctx, 1e6 + 3 + cases[i].gap, 2, 3, 3, "x", &part));
        CHECK_OK(ctx, tli_grid_join(&all, &part, NULL));
        CHECK_OK(ctx, tli_grid_weld(&all, cases[i].distance, &welded));
        CHECK_EQ(welded, cases[i].welded);
        grid_check(&all);
        tl_mesh *mesh;
        tl_mesh_stats stats;
        CHECK_OK(ctx, tli_grid_to_mesh(&all, NULL, &mesh, NULL));
        CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
        CHECK_EQ(stats.components, welded ? 1 : 2);
        CHECK_EQ(stats.inverted + stats.degenerate + stats.nonmanifold_faces, 0);
        CHECK_EQ(tl_mesh_vert_count(mesh), 54 - welded);
        tl_mesh_destroy(mesh);
    }
    tli_grid grid;
    uint64_t welded;
    CHECK_OK(ctx, make_tet(ctx, &grid));
    CHECK_STATUS(tli_grid_weld(&grid, -1, &welded), TL_ERR_ARG);
    CHECK_STATUS(tli_grid_weld(&grid, (double)NAN, &welded), TL_ERR_ARG);
    grid.xyz[0] = (double)NAN; /* is welded to nothing */
    grid.xyz[3] = (double)NAN;
    CHECK_OK(ctx, tli_grid_weld(&grid, 1e300, &welded));
    CHECK_EQ(welded, 1);
    tli_grid_release(&grid);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- steps ---- */

static void test_steps(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    const double times[] = {0, 1, 2, (double)NAN, 4};
    const struct {
        tl_read_opts opts;
        size_t step;
    } cases[] = {{{.step = 2}, 2},
                 {{.step = TL_STEP_LAST}, 4},
                 {{.has_time = true, .time = 1.5}, 1},
                 {{.has_time = true, .time = 1.6}, 2},
                 {{.has_time = true, .time = -1e300}, 0},
                 {{.has_time = true, .time = 99, .step = 1}, 4}};
    size_t step;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        CHECK_OK(ctx, tli_steps_pick(ctx, &cases[i].opts, times, 5, &step));
        CHECK_EQ(step, cases[i].step);
    }
    CHECK_STATUS(tli_steps_pick(ctx, &(tl_read_opts){.step = 5}, times, 5, &step), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "step 5"));
    CHECK_OK(ctx, tli_steps_pick(ctx, &(tl_read_opts){.has_time = true}, NULL, 1, &step));
    tl_ctx_destroy(ctx);
}

/* ---- files that name files ---- */

static void test_files_that_name_files(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tl_status st = TL_OK;
    tli_grid grid;
    tl_mesh *mesh;
    tl_steps steps;
    tl_read_opts opts = tl_read_opts_defaults();
    CHECK_OK(ctx, make_tet(ctx, &grid));
    CHECK_OK(ctx, tli_grid_to_mesh(&grid, NULL, &mesh, NULL));
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "part.vtu", NULL));
    tl_mesh_destroy(mesh);

    tli_source source = {.path = "./all.pvd", .head = "head"};
    CHECK(tli_head_begins(&source, "hea") && !tli_head_begins(&source, "heat"));
    CHECK(tli_ends_in("A.VTU", ".vtk .vtu") && !tli_ends_in("vtu", ".vtk .vtu"));
    char *path = tli_path_beside(ctx, source.path, "part.vtu", &st);
    CHECK(!st && !strcmp(path, "./part.vtu"));
    tli_grid_init(ctx, &grid);
    CHECK_OK(ctx, tli_grid_read(ctx, &source, path, &opts, &grid));
    CHECK_EQ(grid.cell_count, 1);
    tli_grid_release(&grid);
    CHECK_OK(ctx, tli_grid_read_steps(ctx, &source, path, &opts, &steps));
    CHECK_EQ(steps.count, 1);
    tl_steps_release(ctx, &steps);
    tl_mem_free(ctx, path);
    path = tli_path_beside(ctx, source.path, "/part.vtu", &st);
    CHECK(!st && !strcmp(path, "/part.vtu"));
    tl_mem_free(ctx, path);

    source.depth = TLI_SOURCE_DEPTH_MAX;
    CHECK_STATUS(tli_grid_read(ctx, &source, "part.vtu", &opts, &grid), TL_ERR_FORMAT);
    CHECK_STATUS(tli_grid_read_steps(ctx, &source, "part.vtu", &opts, &steps), TL_ERR_FORMAT);
    source.depth = 0;
    CHECK_STATUS(tli_grid_read(ctx, &source, "none.vtu", &opts, &grid), TL_ERR_IO);
    CHECK(strstr(tl_ctx_message(ctx), "none.vtu") && strstr(tl_ctx_message(ctx), "all.pvd"));

    CHECK_OK(ctx, tl_read_steps(ctx, "part.vtu", NULL, &steps));
    CHECK(steps.count == 1 && isnan(steps.times[0]) && steps.mesh == TL_STEPS_STATIC);
    tl_steps_release(ctx, &steps);
    opts.step = 1;
    CHECK_STATUS(tl_mesh_read(ctx, "part.vtu", &opts, &mesh, NULL), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "part.vtu"));
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
    unlink("part.vtu");
}

static void test_list_of_formats(void **state)
{
    (void)state;
    size_t count = 0;
    for (const tl_format *f; (f = tl_format_get(count)); count++) {
        CHECK(*f->name && *f->about && f->endings);
        CHECK(f->reads || f->writes || f->package); /* what is not there says what is missing */
    }
    CHECK_EQ(count, tli_reader_count);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks_stay_blocks),
        cmocka_unit_test(test_block_and_list),
        cmocka_unit_test(test_flat_blocks_as_lists),
        cmocka_unit_test(test_failing_allocations),
        cmocka_unit_test(test_weld),
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_files_that_name_files),
        cmocka_unit_test(test_list_of_formats),
    };
    return cmocka_run_group_tests_name("formats_grid", tests, NULL, NULL);
}
