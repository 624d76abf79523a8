/* TetGen: text with both first indices, attributes, markers, quadratic cells, Chaste's binary form;
 * missing parts; damaged files. */
#include "check_source.h"
#include "make_text.h"

static const double points[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
static const int cells[2][4] = {{0, 1, 2, 3}, {1, 2, 3, 4}};
static const int faces[3][4] = {{0, 1, 2, -2}, {1, 2, 3, 0}, {2, 3, 4, 7}};

/* attribute: of the cells, as a format of a number. */
static void make_text(int base, const char *attribute, text *node, text *ele, text *face)
{
    node->count = ele->count = face->count = 0;
    add(node, "# points\n5 3 1 1\n");
    for (int i = 0; i < 5; i++)
        add(node, "%d %g %g %g %g %d # end\n", i + base, points[i][0], points[i][1], points[i][2],
            10.5 + i, i - 2);
    add(ele, "\n2 4 1\n");
    for (int i = 0; i < 2; i++) {
        add(ele, "%d", i + base);
        for (int n = 0; n < 4; n++) add(ele, " %d", cells[i][n] + base);
        add(ele, attribute, i);
    }
    add(face, "3 1\n");
    for (int i = 0; i < 3; i++)
        add(face, "%d %d %d %d %d\n", i + base, faces[i][0] + base, faces[i][1] + base,
            faces[i][2] + base, faces[i][3]);
}

static void make_binary(text *node, text *ele, text *face)
{
    node->count = ele->count = face->count = 0;
    add(node, "5\t3\t1\t0\tBIN\n");
    for (int i = 0; i < 5; i++) {
        const double attribute = 10.5 + i;
        add_bytes(node, points[i], sizeof points[i]);
        add_bytes(node, &attribute, sizeof attribute);
    }
    add(node, "\n#\n# a trailer\n");
    add(ele, "2\t4\t1\tBIN\n");
    for (int i = 0; i < 2; i++) {
        const double attribute = 3 + i;
        add_bytes(ele, cells[i], sizeof cells[i]);
        add_bytes(ele, &attribute, sizeof attribute);
    }
    add(face, "1\t0\tBIN\n");
    add_bytes(face, faces[0], 12);
}

static tl_status read_files(tl_ctx *ctx, const text *node, const text *ele, const text *face,
                            tli_grid *grid)
{
    source_case c = {"t.ele", tli_read_tetgen, NULL};
    if (node) put_file("t.node", node->bytes, node->count);
    if (face) put_file("t.face", face->bytes, face->count);
    tl_status st = grid_read(ctx, source_read, &c, ele->bytes, ele->count, grid);
    remove("t.node");
    remove("t.face");
    return st;
}

static void check_mesh(const tli_grid *grid)
{
    CHECK_EQ(grid->point_count, 5);
    CHECK(memcmp(grid->xyz, points, sizeof points) == 0);
    CHECK_EQ(grid->cell_count, 2);
    CHECK(memcmp(grid->connectivity, cells, sizeof cells) == 0);
    for (int i = 0; i < 5; i++)
        CHECK(grid_array(grid, TL_ON_VERTEX, "attribute1")->values[i] == 10.5 + i);
}

static void text_of_both_bases(void **state)
{
    (void)state;
    static text node, ele, face;
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int base = 0; base < 2; base++) {
        tli_grid grid;
        make_text(base, " 1%d.0\n", &node, &ele, &face);
        CHECK_OK(ctx, read_files(ctx, &node, &ele, &face, &grid));
        grid_check(&grid);
        check_mesh(&grid);
        CHECK(grid.regions && grid.regions[0] == 10 && grid.regions[1] == 11);
        CHECK_EQ(grid.cell_array_count, 0);
        CHECK(grid_array(&grid, TL_ON_VERTEX, "marker")->values[4] == 2);
        CHECK_EQ(grid.label_count, 2);
        CHECK(grid.labels[0].id == -2 && grid.labels[1].id == 7);
        CHECK_EQ(grid.labels[1].face_count, 1);
        CHECK_EQ(grid.labels[1].points[2], 4);
        tli_grid_release(&grid);
        make_text(base, " %d.5\n", &node, &ele, &face); /* no regions: an array */
        CHECK_OK(ctx, read_files(ctx, &node, &ele, NULL, &grid));
        CHECK(!grid.regions);
        CHECK(grid_array(&grid, TL_ON_TET, "attribute1")->values[1] == 1.5);
        CHECK_EQ(grid.label_count, 0);
        tli_grid_release(&grid);
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void binary_of_chaste(void **state)
{
    (void)state;
    static text node, ele, face;
    tl_ctx *ctx = grid_ctx(0, 2);
    tli_grid grid;
    make_binary(&node, &ele, &face);
    CHECK_OK(ctx, read_files(ctx, &node, &ele, &face, &grid));
    check_mesh(&grid);
    CHECK(grid.regions[0] == 3 && grid.regions[1] == 4);
    tli_grid_release(&grid);
    ele.count -= 10; /* into the cells */
    CHECK_STATUS(read_files(ctx, &node, &ele, &face, &grid), TL_ERR_FORMAT);
    check_says(ctx, "t.ele");
    tli_grid_release(&grid);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void other_cells_and_missing_parts(void **state)
{
    (void)state;
    static text node, ele, face;
    tl_ctx *ctx = grid_ctx(0, 2);
    tli_grid grid;
    make_text(0, "\n", &node, &ele, &face);
    ele.count = 0;
    add(&ele, "1 3 0\n0 0 1 2\n");
    CHECK_OK(ctx, read_files(ctx, &node, &ele, NULL, &grid));
    CHECK_EQ(grid.types[0], 5);
    tli_grid_release(&grid);
    CHECK_STATUS(read_files(ctx, NULL, &ele, NULL, &grid), TL_ERR_IO);
    check_says(ctx, "t.node");
    tli_grid_release(&grid);

    source_case c = {"u.node", tli_read_tetgen, NULL}; /* points alone */
    CHECK_OK(ctx, grid_read(ctx, source_read, &c, node.bytes, node.count, &grid));
    CHECK(grid.point_count == 5 && grid.cell_count == 0);
    tli_grid_release(&grid);
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"1 5 0\n0 0 1 2 3 4\n", "cells of 5 points"},
        {"1 4 0\n0 0 1 2 5\n", "line 2: expected a point, a whole number of 0 to 4"},
        {"4000000000 4 0\n0 0 1 2 3\n", "4000000000 cells need 10 bytes"},
        {"x\n", "line 1: expected a count"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        ele.count = 0;
        add(&ele, "%s", bad[i].text);
        CHECK_STATUS(read_files(ctx, &node, &ele, NULL, &grid), TL_ERR_FORMAT);
        check_says(ctx, bad[i].says);
        check_says(ctx, "t.ele");
        tli_grid_release(&grid);
    }
    node.count = 0;
    add(&node, "1 3 0 0\n2 0 0 0\n");
    CHECK_STATUS(grid_read(ctx, source_read, &c, node.bytes, node.count, &grid), TL_ERR_FORMAT);
    check_says(ctx, "first point has index 2");
    tli_grid_release(&grid);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void survives_damage(void **state)
{
    (void)state;
    static text node, ele, face;
    for (int binary = 0; binary < 2; binary++) {
        tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
        if (binary)
            make_binary(&node, &ele, &face);
        else
            make_text(1, " 5 %d\n", &node, &ele, &face);
        const text *parts[] = {&node, &ele, &face};
        static const char *const names[] = {"d.node", "d.ele", "d.face"};
        for (int part = 0; part < 3; part++) {
            source_case c = {names[part], tli_read_tetgen, NULL};
            for (int i = 0; i < 3; i++)
                if (i != part) put_file(names[i], parts[i]->bytes, parts[i]->count);
            size_t refused = grid_survives_damage(
                ctx, source_read, &c, (const uint8_t *)parts[part]->bytes, parts[part]->count, 1);
            printf("%s: %zu of %zu damaged files refused\n", names[part], refused,
                   3 * parts[part]->count);
            source_survives_budgets(&c, parts[part]->bytes, parts[part]->count, 197);
        }
        tl_ctx_destroy(ctx);
    }
}

/* Tets of each material as its origin counts them. */
static void regions_of_a_real_mesh(void **state)
{
    (void)state;
    static const size_t expected[6] = {0, 16765, 51057, 6414, 1076, 1032};
    char path[4096];
    if (!data_path("multimaterial/mickey_mesh.ele", path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx(0, 2);
    tl_mesh *mesh;
    size_t counts[6] = {0};
    CHECK_OK(ctx, tl_mesh_read(ctx, path, NULL, &mesh, NULL));
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        CHECK(tl_mesh_regions(mesh)[t] >= 0 && tl_mesh_regions(mesh)[t] < 6);
        counts[tl_mesh_regions(mesh)[t]]++;
    }
    for (int i = 0; i < 6; i++) CHECK_EQ(counts[i], expected[i]);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(text_of_both_bases),
        cmocka_unit_test(binary_of_chaste),
        cmocka_unit_test(other_cells_and_missing_parts),
        cmocka_unit_test(survives_damage),
        cmocka_unit_test(regions_of_a_real_mesh),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
