/* Medit: a small mesh as text and in the binary forms of all versions, values beside it, damaged
 * files, and the real ones. */
#include "check_source.h"

typedef struct meshb {
    uint8_t bytes[4096];
    size_t count;
    int version;
    bool big_endian;
} meshb;

static void put_bits(meshb *m, uint64_t bits, unsigned count)
{
    CHECK(m->count + count <= sizeof m->bytes);
    for (unsigned i = 0; i < count; i++)
        m->bytes[m->count++] = (uint8_t)(bits >> 8 * (m->big_endian ? count - 1 - i : i));
}

static void put_int(meshb *m, int64_t value)
{
    put_bits(m, (uint64_t)value, m->version < 4 ? 4 : 8);
}

static void put_real(meshb *m, double value)
{
    uint64_t bits;
    uint32_t narrow_bits;
    const float narrow = (float)value;
    memcpy(&bits, &value, sizeof bits);
    memcpy(&narrow_bits, &narrow, sizeof narrow_bits);
    put_bits(m, m->version < 2 ? narrow_bits : bits, m->version < 2 ? 4 : 8);
}

/* Keyword and place of the next, which end_section fills in. */
static size_t begin_section(meshb *m, int keyword, int64_t count)
{
    put_bits(m, (uint64_t)keyword, 4);
    size_t place = m->count;
    put_bits(m, 0, m->version < 3 ? 4 : 8);
    put_int(m, count);
    return place;
}

static void end_section(meshb *m, size_t place)
{
    size_t end = m->count;
    m->count = place;
    put_bits(m, end, m->version < 3 ? 4 : 8);
    m->count = end;
}

static const double points[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};

static void begin_file(meshb *m)
{
    m->count = 0;
    put_bits(m, 1, 4);
    put_bits(m, (uint64_t)m->version, 4);
    put_bits(m, 3, 4); /* Dimension */
    put_bits(m, 20 + (m->version < 3 ? 0 : 4), m->version < 3 ? 4 : 8);
    put_bits(m, 3, 4);
}

/* The mesh of the text below, with a section that nobody knows. */
static void make_meshb(meshb *m)
{
    static const int64_t cells[][4] = {{1, 2, 3, 4}, {2, 3, 4, 5}};
    begin_file(m);
    size_t place = begin_section(m, 4, 5);
    for (int i = 0; i < 5; i++) {
        for (int axis = 0; axis < 3; axis++) put_real(m, points[i][axis]);
        put_int(m, 0);
    }
    end_section(m, place);
    place = begin_section(m, 13, 1); /* Corners */
    put_int(m, 1);
    end_section(m, place);
    place = begin_section(m, 8, 2);
    for (int i = 0; i < 2; i++) {
        for (int n = 0; n < 4; n++) put_int(m, cells[i][n]);
        put_int(m, 5 - i);
    }
    end_section(m, place);
    place = begin_section(m, 6, 2);
    for (int i = 0; i < 2; i++) {
        for (int n = 0; n < 3; n++) put_int(m, cells[i][n]);
        put_int(m, 9 * i);
    }
    end_section(m, place);
    put_bits(m, 54, 4);
}

static const char mesh_text[] = "MeshVersionFormatted 2 # a comment\n\nDimension\n3\nTetrahedra 2\n"
                                "1 2 3 4 5\n2 3 4 5 4\nCorners 1 1\nTriangles\n2\n1 2 3 0\n"
                                "2 3 4 9\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n"
                                "End\n";
static const char sol_text[] = "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n5\n3 1 2 3\n"
                               "1 1 2 3 11 12 22 13 23 33\n2 1 2 3 11 12 22 13 23 33\n"
                               "3 1 2 3 11 12 22 13 23 33\n4 1 2 3 11 12 22 13 23 33\n"
                               "5 1 2 3 11 12 22 13 23 33\nEnd\n";

static void check_mesh(const tli_grid *grid)
{
    CHECK_EQ(grid->point_count, 5);
    CHECK(memcmp(grid->xyz, points, sizeof points) == 0);
    CHECK_EQ(grid->cell_count, 4);
    uint64_t regions = 0;
    for (uint64_t i = 0; i < 4; i++)
        if (grid->types[i] == 10) regions = 10 * regions + (uint64_t)grid->regions[i];
    CHECK_EQ(regions, 54);
    CHECK_EQ(grid->label_count, 1);
    CHECK_EQ(grid->labels[0].id, 9);
    CHECK_EQ(grid->labels[0].face_count, 1);
    CHECK(grid->labels[0].points[0] == 1 && grid->labels[0].points[2] == 3);
}

static void text_with_values(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    source_case c = {"a.mesh", tli_read_medit, NULL};
    tli_grid grid;
    put_file("a.sol", sol_text, sizeof sol_text - 1);
    CHECK_OK(ctx, grid_read(ctx, source_read, &c, mesh_text, sizeof mesh_text - 1, &grid));
    grid_check(&grid);
    check_mesh(&grid);
    CHECK_EQ(grid.point_array_count, 3);
    static const double tensor[6] = {11, 22, 33, 12, 23, 13};
    for (int i = 0; i < 5; i++) {
        CHECK(grid.point_arrays[0].values[i] == i + 1);
        CHECK(grid.point_arrays[1].values[3 * i + 2] == 3);
        CHECK(memcmp(grid.point_arrays[2].values + 6 * i, tensor, sizeof tensor) == 0);
    }
    tli_grid_release(&grid);
    size_t refused = grid_survives_damage(ctx, source_read, &c, (const uint8_t *)mesh_text,
                                          sizeof mesh_text - 1, 1);
    printf("%zu of %zu damaged files refused\n", refused, 3 * (sizeof mesh_text - 1));
    put_file("a.sol", sol_text, sizeof sol_text - 40);
    CHECK_STATUS(grid_read(ctx, source_read, &c, mesh_text, sizeof mesh_text - 1, &grid),
                 TL_ERR_FORMAT);
    check_says(ctx, "a.sol");
    tli_grid_release(&grid);
    remove("a.sol");

    /* the values named, the mesh found */
    put_file("b.mesh", mesh_text, sizeof mesh_text - 1);
    c.path = "b.sol";
    CHECK_OK(ctx, grid_read(ctx, source_read, &c, sol_text, sizeof sol_text - 1, &grid));
    CHECK_EQ(grid.point_array_count, 3);
    tli_grid_release(&grid);
    refused = grid_survives_damage(ctx, source_read, &c, (const uint8_t *)sol_text,
                                   sizeof sol_text - 1, 1);
    printf("%zu of %zu damaged values refused\n", refused, 3 * (sizeof sol_text - 1));
    remove("b.mesh");
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
    c.path = "a.mesh";
    source_survives_budgets(&c, mesh_text, sizeof mesh_text - 1, 97);
}

static void binary_of_all_versions(void **state)
{
    (void)state;
    static meshb m;
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    for (int variant = 0; variant < 8; variant++) {
        source_case c = {"a.meshb", tli_read_medit, NULL};
        tli_grid grid;
        m.version = 1 + variant / 2;
        m.big_endian = variant % 2;
        make_meshb(&m);
        CHECK_OK(ctx, grid_read(ctx, source_read, &c, m.bytes, m.count, &grid));
        check_mesh(&grid);
        tli_grid_release(&grid);
        size_t refused = grid_survives_damage(ctx, source_read, &c, m.bytes, m.count, 1);
        printf("version %d: %zu of %zu damaged files refused\n", m.version, refused, 3 * m.count);
        CHECK(refused > m.count / 2);
    }
    tl_ctx_destroy(ctx);
}

static void refusals_name_the_place(void **state)
{
    (void)state;
#define HEAD "MeshVersionFormatted 1\nDimension 3\n"
    static const struct {
        const char *text, *says;
    } cases[] = {
        {"Mesh 1\n", "expected MeshVersionFormatted"},
        {"MeshVersionFormatted 5\n", "the version"},
        {"MeshVersionFormatted 1\nDimension 4\n", "line 2: expected the dimension"},
        {HEAD "Vertices 3000000000\n0 0 0 1\n", "3000000000 vertices need 8 bytes"},
        {HEAD "Vertices 1\n0 0 0 1\nTetrahedra 1\n1 1 1 2 0\n", "cell 1 has point 2 of 1"},
        {HEAD "Vertices 1\n0 0 0 1\nTetrahedra 1\n1 1 1 0 0\n", "line 6: expected a point"},
        {HEAD "Vertices 1\n0 0 0 1\nTriangles 1\n1 1 7 3\n", "point 7 of 1"},
        {HEAD "Vertices 1\n0 0 0 1\nVertices 1\n0 0 0 1\n", "twice"},
        {HEAD "Tetrahedra 0\nEnd\n", "no Vertices"},
    };
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        source_case c = {"x.mesh", tli_read_medit, NULL};
        tli_grid grid;
        CHECK_STATUS(grid_read(ctx, source_read, &c, cases[i].text, strlen(cases[i].text), &grid),
                     TL_ERR_FORMAT);
        check_says(ctx, cases[i].says);
        check_says(ctx, "x.mesh");
        tli_grid_release(&grid);
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(text_with_values),
        cmocka_unit_test(binary_of_all_versions),
        cmocka_unit_test(refusals_name_the_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
