/* EnSight: one small mesh as Gold and 6, text and C binary of both byte orders; polyhedra,
 * structured parts, time sets, files of several steps; damaged files; the real ones. */
#include "check_source.h"

#include "formats/formats_ensight.h"

typedef struct file {
    uint8_t bytes[16384];
    size_t count;
    bool gold, binary, big_endian;
} file;

static void put(file *f, const void *bytes, size_t count)
{
    CHECK(f->count + count <= sizeof f->bytes);
    memcpy(f->bytes + f->count, bytes, count);
    f->count += count;
}

static void line(file *f, const char *text)
{
    char padded[80] = {0};
    CHECK(strlen(text) < sizeof padded);
    strcpy(padded, text);
    put(f, padded, f->binary ? 80 : strlen(text));
    if (!f->binary) put(f, "\n", 1);
}

static void put_word(file *f, uint32_t bits)
{
    uint8_t bytes[4];
    for (unsigned i = 0; i < 4; i++) bytes[i] = (uint8_t)(bits >> 8 * (f->big_endian ? 3 - i : i));
    put(f, bytes, 4);
}

/* Numbers in columns of 10 (Gold) or 8, one line. */
static void ints(file *f, int count, const int *values)
{
    char text[40];
    for (int i = 0; i < count; i++) {
        snprintf(text, sizeof text, f->gold ? "%10d" : "%8d", values[i]);
        if (f->binary)
            put_word(f, (uint32_t)values[i]);
        else
            put(f, text, strlen(text));
    }
    if (!f->binary) put(f, "\n", 1);
}

static void integer(file *f, int value)
{
    ints(f, 1, &value);
}

/* Numbers in columns of 12 without blanks between them, as EnSight 6 has them, or one a line. */
static void reals(file *f, int count, const float *values, int a_line)
{
    char text[40];
    for (int i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], 4);
        snprintf(text, sizeof text, "%12.5e", (double)values[i]);
        if (f->binary)
            put_word(f, bits);
        else
            put(f, text, strlen(text));
        if (!f->binary && (i % a_line == a_line - 1 || i == count - 1)) put(f, "\n", 1);
    }
}

static const float points[6][3] = {{0, 0, 0},  {1, 0, 0},     {0, 1, 0},
                                   {0, 0, -1}, {1, -0.5f, 1}, {-2e-5f, -3, -4}};
static const int tets[2][4] = {{1, 2, 3, 4}, {2, 3, 4, 5}}, triangle[3] = {1, 2, 3};

static void head(file *f, const char *ids)
{
    char text[80];
    f->count = 0;
    line(f, "a title");
    line(f, "and another");
    snprintf(text, sizeof text, "node id %s", ids);
    line(f, text);
    snprintf(text, sizeof text, "element id %s", ids);
    line(f, text);
}

/* The points of the mesh, as a part of Gold or those of all parts. */
static void put_points(file *f, bool ids)
{
    static const int numbers[6] = {11, 12, 13, 14, 15, 16};
    line(f, "coordinates");
    integer(f, 6);
    if (ids && (f->gold || f->binary)) ints(f, 6, numbers);
    float axis[6];
    for (int a = 0; a < 3 && f->gold; a++) {
        for (int i = 0; i < 6; i++) axis[i] = points[i][a];
        reals(f, 6, axis, 1);
    }
    for (int i = 0; i < 6 && !f->gold; i++) {
        char text[20];
        snprintf(text, sizeof text, "%8d", numbers[i]);
        if (ids && !f->binary) put(f, text, 8);
        reals(f, 3, points[i], 3);
    }
}

static void put_cells(file *f, const char *name, int count, int nodes, const int *ids, bool has_ids)
{
    const int add = has_ids && !f->gold ? 10 : 0; /* EnSight 6: given ids are named */
    line(f, name);
    integer(f, count);
    for (int i = 0; i < count && has_ids && (f->gold || f->binary); i++) integer(f, 70 + i);
    for (int i = 0; i < count; i++) {
        int moved[8];
        char text[20];
        for (int n = 0; n < nodes; n++) moved[n] = ids[i * nodes + n] + add;
        snprintf(text, sizeof text, "%8d", 70 + i);
        if (has_ids && !f->gold && !f->binary) put(f, text, 8);
        ints(f, nodes, moved);
    }
}

static void begin_part(file *f, int number, const char *name)
{
    char text[80];
    snprintf(text, sizeof text, f->gold ? "part" : "part %d", number);
    line(f, text);
    if (f->gold) integer(f, number);
    line(f, name);
}

static void make_geo(file *f, bool ids)
{
    head(f, ids ? "given" : "assign");
    if (!f->gold) put_points(f, ids);
    begin_part(f, 4, "some tets");
    if (f->gold) put_points(f, ids);
    put_cells(f, "tetra4", 2, 4, tets[0], ids);
    put_cells(f, "tria3", 1, 3, triangle, ids);
    begin_part(f, 9, "a face");
    if (f->gold) put_points(f, ids);
    put_cells(f, "tria3", 1, 3, triangle, ids);
}

static void make_node_values(file *f, int components)
{
    const int parts = f->gold ? 2 : 1;
    f->count = 0;
    line(f, "values");
    for (int part = 0; part < parts; part++) {
        float values[54];
        for (int i = 0; i < 6; i++)
            for (int c = 0; c < components; c++)
                values[f->gold ? c * 6 + i : i * components + c] = (float)(100 * part + 10 * c + i);
        if (f->gold) line(f, "part");
        if (f->gold) integer(f, part ? 9 : 4);
        if (f->gold) line(f, "coordinates");
        reals(f, 6 * components, values, f->gold ? 1 : 6);
    }
}

static void make_cell_values(file *f)
{
    static const float values[2] = {7, 8};
    f->count = 0;
    line(f, "values");
    line(f, f->gold ? "part" : "part 4");
    if (f->gold) integer(f, 4);
    line(f, "tetra4");
    reals(f, 2, values, f->gold ? 1 : 6);
    line(f, "tria3");
    reals(f, 1, values, 1);
}

/* ---- reading ---- */

static tl_status read_geo(tl_ctx *ctx, const file *f, tli_grid *grid, tli_ensight_geo *geo,
                          tli_scan *scan)
{
    tli_grid_init(ctx, grid);
    *geo = (tli_ensight_geo){.ctx = ctx, .gold = f->gold, .grid = grid, .cells.ctx = ctx};
    tli_scan_open(ctx, "a.geo", f->bytes, f->count, scan);
    scan->binary = f->binary;
    return tli_ensight_geo_read(geo, scan);
}

static tl_status read_values(tl_ctx *ctx, const file *f, const tli_ensight_geo *geo, bool nodes,
                             uint32_t components, const char *name)
{
    tli_scan scan;
    tli_ensight_variable variable = {.components = components, .on_nodes = nodes};
    strcpy(variable.name, name);
    tli_scan_open(ctx, "a.val", f->bytes, f->count, &scan);
    scan.binary = f->binary;
    scan.big_endian = f->big_endian;
    return tli_ensight_values_read(geo, &scan, &variable);
}

static void check_mesh(const tli_grid *grid, const file *f)
{
    const uint64_t points_expected = f->gold ? 12 : 6;
    CHECK_EQ(grid->point_count, points_expected);
    for (uint64_t i = 0; i < points_expected; i++)
        for (int axis = 0; axis < 3; axis++)
            CHECK_NEAR(grid->xyz[3 * i + (uint64_t)axis], (double)points[i % 6][axis], 1e-6);
    CHECK_EQ(grid->cell_count, 4);
    static const uint8_t types[4] = {10, 10, 5, 5};
    static const int32_t regions[4] = {4, 4, 4, 9};
    CHECK(memcmp(grid->types, types, 4) == 0);
    CHECK(memcmp(grid->regions, regions, sizeof regions) == 0);
    for (int i = 0; i < 8; i++) CHECK_EQ(grid->connectivity[i], tets[i / 4][i % 4] - 1);
    CHECK_EQ(grid->connectivity[11], f->gold ? 6 : 0);
    CHECK_EQ(grid->region_name_count, 2);
    CHECK(strcmp(grid->region_names[0].name, "some tets") == 0);
}

static bool next_variant(int variant, file *f)
{
    f->gold = variant % 2;
    f->binary = variant / 2 % 3 > 0;
    f->big_endian = variant / 2 % 3 == 2;
    return variant < 12; /* from 6 on with ids */
}

static void all_variants_are_one_mesh(void **state)
{
    (void)state;
    static file geo_file, values;
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int variant = 0; next_variant(variant, &geo_file); variant++) {
        tli_grid grid;
        tli_ensight_geo geo;
        tli_scan scan;
        values = geo_file;
        make_geo(&geo_file, variant >= 6);
        CHECK_OK(ctx, read_geo(ctx, &geo_file, &grid, &geo, &scan));
        CHECK(!geo_file.binary || scan.big_endian == geo_file.big_endian);
        grid_check(&grid);
        check_mesh(&grid, &geo_file);
        make_node_values(&values, 6);
        CHECK_OK(ctx, read_values(ctx, &values, &geo, true, 6, "tensor"));
        make_cell_values(&values);
        CHECK_OK(ctx, read_values(ctx, &values, &geo, false, 1, "cells"));
        const double *tensor = grid_array(&grid, TL_ON_VERTEX, "tensor")->values;
        static const int order[6] = {0, 1, 2, 3, 5, 4};
        for (uint64_t i = 0; i < grid.point_count; i++)
            for (int c = 0; c < 6; c++)
                CHECK(tensor[6 * i + (uint64_t)order[c]] ==
                      (double)(100 * (i / 6) + i % 6) + 10 * c);
        const double *cells = grid_array(&grid, TL_ON_TET, "cells")->values;
        CHECK(cells[0] == 7 && cells[1] == 8 && cells[2] == 7 && isnan(cells[3]));
        tli_ensight_geo_release(&geo);
        tli_grid_release(&grid);
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* A pyramid as a polyhedron, a polygon, a curvilinear and a uniform part, ghosts. */
static void make_other_kinds(file *f)
{
    static const int faces[] = {4, 3, 3, 3, 3},
                     corners[] = {1, 2, 3, 4, 1, 2, 5, 2, 3, 5, 3, 4, 5, 4, 1, 5};
    static const int polygon[] = {1, 2, 3, 4, 5}, dims[] = {3, 2, 2}, ghost[] = {1, 2, 3, 5};
    static const float lattice[] = {1, 2, 3, 0.5f, 1, 2};
    head(f, "off");
    begin_part(f, 1, "polyhedra");
    put_points(f, false);
    line(f, "nfaced");
    integer(f, 1);
    integer(f, 5);
    for (int i = 0; i < 5; i++) integer(f, faces[i]);
    ints(f, 4, corners);
    for (int i = 0; i < 4; i++) ints(f, 3, corners + 4 + 3 * i);
    line(f, "nsided");
    integer(f, 1);
    integer(f, 5);
    ints(f, 5, polygon);
    put_cells(f, "g_tetra4", 1, 4, ghost, false);
    begin_part(f, 2, "lattice");
    line(f, "block uniform");
    ints(f, 3, dims);
    reals(f, 6, lattice, 1);
}

static void other_kinds_of_parts(void **state)
{
    (void)state;
    static file f;
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int binary = 0; binary < 2; binary++) {
        tli_grid grid;
        tli_ensight_geo geo;
        tli_scan scan;
        f = (file){.gold = true, .binary = binary};
        make_other_kinds(&f);
        CHECK_OK(ctx, read_geo(ctx, &f, &grid, &geo, &scan));
        static const uint8_t types[5] = {42, 7, 10, 12, 12};
        CHECK_EQ(grid.cell_count, 5);
        CHECK(memcmp(grid.types, types, 5) == 0);
        CHECK_EQ(grid.face_count, 5);
        CHECK_EQ(grid.face_offsets[5], 16);
        CHECK(grid.face_points[4] == 0 && grid.face_points[15] == 4);
        CHECK_EQ(grid.offsets[1], 5);
        CHECK_EQ(grid.connectivity[4], 4);
        const double *ghosts = grid_array(&grid, TL_ON_TET, "vtkGhostType")->values;
        CHECK(ghosts[2] == 1 && ghosts[0] + ghosts[1] + ghosts[3] + ghosts[4] == 0);
        CHECK_EQ(grid.point_count, 6 + 12);
        CHECK(grid.xyz[51] == 2 && grid.xyz[52] == 3 && grid.xyz[53] == 5);
        CHECK_EQ(grid.connectivity[grid.offsets[4]], 7); /* the second hexahedron */
        tli_ensight_geo_release(&geo);
        tli_grid_release(&grid);
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- cases and steps ---- */

static void put_all(const char *path, const file *f)
{
    put_file(path, f->bytes, f->count);
}

static const char case_text[] =
    "# a case\nFORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: s.geo\nVARIABLE\n"
    "scalar per node: 1 heat s.heat**\nvector per node: 2 2 wind s.wind\n"
    "constant per case: c 5\nTIME\ntime set: 1 a set\nnumber of steps: 3\nfilename numbers: 2\n5 "
    "7\n"
    "time values: 0.5 1.5\n2.5\ntime set: 2\nnumber of steps: 2\ntime values: 0.5 2.5\n"
    "FILE\nfile set: 2\nnumber of steps: 2\n";

static void make_case_files(void)
{
    static file f, values, all;
    char path[32];
    f = (file){.gold = true};
    make_geo(&f, false);
    put_all("s.geo", &f);
    for (int step = 0; step < 3; step++) {
        static const int numbers[3] = {2, 5, 7};
        values = (file){.gold = true};
        make_node_values(&values, 1);
        values.bytes[strlen("values\npart\n         4\ncoordinates\n")] = (uint8_t)'-'; /* -0 */
        snprintf(path, sizeof path, "s.heat%02d", numbers[step]);
        put_all(path, &values);
    }
    all = (file){.gold = true}; /* two steps in one file */
    for (int step = 0; step < 2; step++) {
        values = (file){.gold = true};
        make_node_values(&values, 3);
        if (step) /* the first number of the second step */
            memcpy(values.bytes + strlen("values\npart\n         4\ncoordinates\n"), " 5.00000e+01",
                   12);
        line(&all, "BEGIN TIME STEP");
        put(&all, values.bytes, values.count);
        line(&all, "END TIME STEP");
    }
    put_all("s.wind", &all);
}

static void steps_of_files_and_in_files(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    tl_read_opts opts = tl_read_opts_defaults();
    source_case c = {"s.case", tli_read_ensight, &opts};
    make_case_files();
    tli_map map = {.bytes = (const uint8_t *)case_text, .byte_count = sizeof case_text - 1};
    tli_source source;
    tl_steps steps = {0};
    source_fill("s.case", &map, &source);
    CHECK_EQ(tli_match_ensight(&source), TLI_MATCH_BYTES);
    CHECK_OK(ctx, tli_steps_ensight(ctx, &source, &opts, &steps));
    CHECK_EQ(steps.count, 3);
    CHECK(steps.times[0] == 0.5 && steps.times[1] == 1.5 && steps.times[2] == 2.5);
    CHECK_EQ(steps.mesh, TL_STEPS_STATIC);
    tl_steps_release(ctx, &steps);
    for (opts.step = 0; opts.step < 3; opts.step++) {
        tli_grid grid;
        CHECK_OK(ctx, grid_read(ctx, source_read, &c, case_text, sizeof case_text - 1, &grid));
        CHECK(grid.time == 0.5 + (double)opts.step);
        CHECK_EQ(grid.point_array_count, 2);
        CHECK(grid_array(&grid, TL_ON_VERTEX, "wind")->values[0] == (opts.step == 2 ? 50 : 0));
        tli_grid_release(&grid);
    }
    remove("s.heat05");
    tli_grid grid;
    opts.step = 1;
    CHECK_STATUS(grid_read(ctx, source_read, &c, case_text, sizeof case_text - 1, &grid),
                 TL_ERR_IO);
    check_says(ctx, "s.heat05");
    tli_grid_release(&grid);
    opts.step = 0;
    size_t refused = grid_survives_damage(ctx, source_read, &c, (const uint8_t *)case_text,
                                          sizeof case_text - 1, 1);
    printf("%zu of %zu damaged cases refused\n", refused, 3 * (sizeof case_text - 1));
    source_survives_budgets(&c, case_text, sizeof case_text - 1, 397);
    static const char *const names[] = {"s.geo", "s.heat02", "s.heat07", "s.wind"};
    for (size_t i = 0; i < 4; i++) remove(names[i]);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- damage ---- */

typedef struct damaged {
    bool gold, binary;
} damaged;

/* A grid_reader of a geometry. */
static tl_status read_damaged(tl_ctx *ctx, const tli_map *map, void *arg, tli_grid *grid)
{
    const damaged *d = arg;
    tli_scan scan;
    tli_ensight_geo geo = {.ctx = ctx, .gold = d->gold, .grid = grid, .cells.ctx = ctx};
    tli_scan_open(ctx, "a.geo", map->bytes, map->byte_count, &scan);
    scan.binary = d->binary;
    tl_status st = tli_ensight_geo_read(&geo, &scan);
    tli_ensight_geo_release(&geo);
    return st;
}

static void survives_damage(void **state)
{
    (void)state;
    static file f;
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    for (int variant = 0; next_variant(variant, &f); variant++) {
        damaged d = {f.gold, f.binary};
        if (f.gold && variant >= 6)
            make_other_kinds(&f);
        else
            make_geo(&f, variant >= 6);
        size_t refused = grid_survives_damage(ctx, read_damaged, &d, f.bytes, f.count, 3);
        printf("%s, %s: %zu of %zu damaged files refused\n", f.gold ? "Gold" : "6",
               f.binary ? "binary" : "text", refused, f.count);
        CHECK(refused > 0);
    }
    tl_ctx_destroy(ctx);
}

static void refusals_name_the_place(void **state)
{
    (void)state;
#define HEAD "a\nb\nnode id off\nelement id off\n"
#define PART HEAD "part\n1\nname\n"
    static const struct {
        const char *text, *says;
        tl_status status;
    } cases[] = {
        {"a\nb\nc\n", "begins with 'element id'", TL_ERR_FORMAT},
        {HEAD "tria3\n1\n", "'tria3' before the first part", TL_ERR_FORMAT},
        {PART "coordinates\n2000000000\n", "2000000000 points need 6 bytes", TL_ERR_FORMAT},
        {PART "coordinates\n1\n0\n0\nx\n", "line 12: expected a coordinate", TL_ERR_FORMAT},
        {PART "coordinates\n1\n0\n0\n0\ntria3\n1\n1 1 2\n", "expected a point", TL_ERR_FORMAT},
        {PART "hexa9\n1\n", "'hexa9', expected a part", TL_ERR_FORMAT},
        {PART "nfaced\n2\n1\n1\n1000000\n3\n", "corners of a face", TL_ERR_FORMAT},
        {PART "block uniform\n60000 60000 60000\n", "lattice", TL_ERR_FORMAT},
        {PART "block range\n", "without range", TL_ERR_UNSUPPORTED},
    };
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        damaged d = {true, false};
        tli_grid grid;
        CHECK_STATUS(grid_read(ctx, read_damaged, &d, cases[i].text, strlen(cases[i].text), &grid),
                     cases[i].status);
        check_says(ctx, cases[i].says);
        check_says(ctx, "a.geo");
        tli_grid_release(&grid);
    }
    source_case c = {"a.case", tli_read_ensight, NULL};
    tli_grid grid;
    CHECK_STATUS(grid_read(ctx, source_read, &c, "FORMAT\ntype: ensight\n", 21, &grid),
                 TL_ERR_FORMAT);
    check_says(ctx, "no model");
    tli_grid_release(&grid);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_variants_are_one_mesh),   cmocka_unit_test(other_kinds_of_parts),
        cmocka_unit_test(steps_of_files_and_in_files), cmocka_unit_test(survives_damage),
        cmocka_unit_test(refusals_name_the_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
