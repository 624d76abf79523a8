/* BINARY files of legacy VTK in windows: the mesh of a whole read, tet by tet and value by value;
 * what no window can take is read as a whole; broken files fail as they do as a whole. */
#include "check_ctx.h"
#include "check_feed.h"
#include "check_file.h"
#include "check_grid.h"
#include "tetralod/model.h"

/* ---- files ---- */

static void put(FILE *file, uint64_t value, int bytes)
{
    while (bytes--) fputc((int)(value >> 8 * bytes & 0xff), file);
}

static void put_f64(FILE *file, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put(file, bits, 8);
}

static void put_f32(FILE *file, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put(file, bits, 4);
}

static FILE *begin_file(const char *path, const char *head)
{
    FILE *file = fopen(path, "wb");
    CHECK(file != NULL);
    fprintf(file, "# vtk DataFile Version 3.0\ntest\nBINARY\n%s", head);
    return file;
}

/* Each kind of attribute; count: points or cells. */
static void put_attributes(FILE *file, const char *section, uint64_t count)
{
    const unsigned long long n = count;
    fprintf(file, "\n%s %llu\nSCALARS a%%20b short 1\nLOOKUP_TABLE default\n", section, n);
    for (uint64_t i = 0; i < count; i++) put(file, i * 31, 2);
    fprintf(file, "\nVECTORS v double\n");
    for (uint64_t i = 0; i < 3 * count; i++) put_f64(file, (double)i * 0.25 - 3);
    fprintf(file, "\nTENSORS t float\n");
    for (uint64_t i = 0; i < 9 * count; i++) put_f32(file, (float)i * 0.5f - 7);
    fprintf(file, "\nFIELD FieldData 4\nids 1 %llu vtktypeint64\n", n);
    for (uint64_t i = 0; i < count; i++) put(file, i ^ 5, 8);
    fprintf(file, "\nMETADATA\nINFORMATION 0\n\nbits 1 %llu bit\n", n);
    for (uint64_t i = 0; i < (count + 7) / 8; i++) put(file, i * 0x5b, 1);
    fprintf(file, "\nshort_one 1 2 int\n12345678\nregion 1 %llu unsigned_char\n", n);
    for (uint64_t i = 0; i < count; i++) put(file, i % 3, 1);
    fprintf(file, "\n");
}

static void write_structured(const char *path, const char *kind, const uint32_t d[3], bool ghosts)
{
    char head[200];
    const uint64_t points = (uint64_t)d[0] * d[1] * d[2];
    const uint64_t cells = (uint64_t)(d[0] - 1) * (d[1] - 1) * (d[2] - 1);
    snprintf(head, sizeof head, "DATASET %s\nDIMENSIONS %u %u %u\n", kind, d[0], d[1], d[2]);
    FILE *file = begin_file(path, head);
    if (strcmp(kind, "STRUCTURED_POINTS") == 0)
        fprintf(file, "ORIGIN 0.1 -2 3\nSPACING 0.3 0.7 1.1\n");
    for (int axis = 0; strcmp(kind, "RECTILINEAR_GRID") == 0 && axis < 3; axis++) {
        fprintf(file, "\n%c_COORDINATES %u float\n", "XYZ"[axis], d[axis]);
        for (uint32_t i = 0; i < d[axis]; i++) put_f32(file, (float)(i * i) * 0.1f + (float)i);
    }
    if (strcmp(kind, "STRUCTURED_GRID") == 0) {
        fprintf(file, "POINTS %llu double\n", (unsigned long long)points);
        for (uint64_t i = 0; i < points; i++) {
            const double x = (double)(i % d[0]), y = (double)(i / d[0] % d[1]);
            put_f64(file, x + 0.1 * y);
            put_f64(file, y * 1.3);
            put_f64(file, (double)(i / d[0] / d[1]) + 0.01 * x);
        }
    }
    put_attributes(file, "POINT_DATA", points);
    put_attributes(file, "CELL_DATA", cells);
    if (ghosts) {
        fprintf(file, "SCALARS vtkGhostLevels unsigned_char\nLOOKUP_TABLE default\n");
        for (uint64_t i = 0; i < cells; i++) put(file, i % 7 ? 0 : 2, 1);
    }
    fclose(file);
}

static void test_structured(void **state)
{
    (void)state;
    static const char *const kinds[] = {"STRUCTURED_POINTS", "RECTILINEAR_GRID", "STRUCTURED_GRID"};
    const uint32_t dims[3] = {13, 11, 20};
    tl_ctx *ctx = check_ctx_create(2);
    for (int i = 0; i < 6; i++) {
        tl_read_opts opts = tl_read_opts_defaults();
        opts.split = i % 2 ? 6 : 5;
        opts.has_fill_value = i == 3;
        opts.fill_value = 31000; /* of some points */
        write_structured("s.vtk", kinds[i / 2], dims, i == 5);
        CHECK(check_feed_file(ctx, "s.vtk", &opts) > 1);
    }
    tl_ctx_destroy(ctx);
}

/* Cells of a lattice of cubes, each by its place as a hexahedron, two wedges, six tets or a face:
 * lists of different lengths. */
static size_t cube_cells(const uint32_t d[3], uint64_t cube, uint32_t cells[2][9], uint8_t *types)
{
    const uint32_t n = d[0] - 1, m = d[1] - 1;
    const uint32_t i = (uint32_t)(cube % n), j = (uint32_t)(cube / n % m);
    const uint32_t k = (uint32_t)(cube / n / m), row = d[0], layer = d[0] * d[1];
    const uint32_t a = i + j * row + k * layer;
    const uint32_t c[8] = {a,         a + 1,         a + 1 + row,         a + row,
                           a + layer, a + 1 + layer, a + 1 + row + layer, a + row + layer};
    if (cube % 3 == 0) {
        const uint32_t first[9] = {6, c[0], c[1], c[2], c[4], c[5], c[6]};
        const uint32_t second[9] = {6, c[0], c[2], c[3], c[4], c[6], c[7]};
        memcpy(cells[0], first, sizeof first);
        memcpy(cells[1], second, sizeof second);
        types[0] = types[1] = 13;
        return 2;
    }
    cells[0][0] = 8;
    memcpy(cells[0] + 1, c, sizeof c);
    types[0] = 12;
    const uint32_t other[2][9] = {{4, c[0], c[1], c[3], c[4]}, {3, c[0], c[1], c[2]}};
    memcpy(cells[1], other[cube % 2], sizeof other[0]);
    types[1] = cube % 2 ? 5 : 10;
    return 2;
}

/* version 3: rows; 5: lists. */
static void write_mixed(const char *path, const uint32_t d[3], int version)
{
    const uint64_t cubes = (uint64_t)(d[0] - 1) * (d[1] - 1) * (d[2] - 1), cells = 2 * cubes;
    const unsigned long long points = (unsigned long long)d[0] * d[1] * d[2];
    uint32_t c[2][9];
    uint8_t t[2];
    unsigned long long ids = 0;
    for (uint64_t i = 0; i < cubes; i++) {
        cube_cells(d, i, c, t);
        ids += c[0][0] + c[1][0];
    }
    FILE *file = begin_file(path, "DATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\n"
                                  "TimeValue 1 1 double\n");
    put_f64(file, 2.5);
    fprintf(file, "\nPOINTS %llu float\n", points);
    for (uint64_t i = 0; i < points; i++) {
        put_f32(file, (float)(i % d[0]));
        put_f32(file, (float)(i / d[0] % d[1]) * 1.5f);
        put_f32(file, (float)(i / d[0] / d[1]));
    }
    if (version == 3) {
        fprintf(file, "\nCELLS %llu %llu\n", (unsigned long long)cells,
                ids + (unsigned long long)cells);
        for (uint64_t i = 0; i < cells; i++) {
            cube_cells(d, i / 2, c, t);
            for (uint32_t v = 0; v <= c[i % 2][0]; v++) put(file, c[i % 2][v], 4);
        }
    } else {
        fprintf(file, "\nCELLS %llu %llu\nOFFSETS vtktypeint64\n", (unsigned long long)cells + 1,
                ids);
        uint64_t offset = 0;
        put(file, 0, 8);
        for (uint64_t i = 0; i < cells; i++) {
            cube_cells(d, i / 2, c, t);
            put(file, offset += c[i % 2][0], 8);
        }
        fprintf(file, "\nCONNECTIVITY vtktypeint64\n");
        for (uint64_t i = 0; i < cells; i++) {
            cube_cells(d, i / 2, c, t);
            for (uint32_t v = 1; v <= c[i % 2][0]; v++) put(file, c[i % 2][v], 8);
        }
    }
    fprintf(file, "\nCELL_TYPES %llu\n", (unsigned long long)cells);
    for (uint64_t i = 0; i < cells; i++) {
        cube_cells(d, i / 2, c, t);
        put(file, t[i % 2], 4);
    }
    put_attributes(file, "CELL_DATA", cells);
    put_attributes(file, "POINT_DATA", points);
    fclose(file);
}

static void test_mixed(void **state)
{
    (void)state;
    const uint32_t dims[3] = {31, 30, 40};
    tl_ctx *ctx = check_ctx_create(2);
    for (int version = 3; version <= 5; version += 2) {
        write_mixed("m.vtk", dims, version);
        CHECK(check_feed_file(ctx, "m.vtk", NULL) > 1);
        tl_read_opts opts = tl_read_opts_defaults();
        opts.region = "ids";
        CHECK(check_feed_file(ctx, "m.vtk", &opts) > 1);
    }
    tl_ctx_destroy(ctx);
}

/* A prism over a pentagon. */
static void write_prism(const char *path)
{
    FILE *file = begin_file(path, "DATASET UNSTRUCTURED_GRID\nPOINTS 10 float\n");
    for (int i = 0; i < 10; i++) {
        put_f32(file, (float)cos(i % 5 * 1.2566));
        put_f32(file, (float)sin(i % 5 * 1.2566));
        put_f32(file, i < 5 ? 0.0f : 1.0f);
    }
    fprintf(file, "\nCELLS 1 11\n");
    put(file, 10, 4);
    for (uint32_t i = 0; i < 10; i++) put(file, i, 4);
    fprintf(file, "\nCELL_TYPES 1\n");
    put(file, 15, 4);
    fclose(file);
}

/* What goes through the whole: text, prisms. */
static void test_whole(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    write_prism("p.vtk");
    CHECK_EQ(check_feed_file(ctx, "p.vtk", NULL), 0);
    tl_mesh *mesh = NULL;
    CHECK_OK(ctx, tl_mesh_read(ctx, "p.vtk", NULL, &mesh, NULL));
    CHECK(tl_mesh_tet_count(mesh) > 0);
    tl_write_opts opts = tl_write_opts_defaults();
    opts.ascii = true;
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "a.vtk", &opts));
    CHECK_EQ(check_feed_file(ctx, "a.vtk", NULL), 0);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* What our writer writes; and its model has the bytes of that of the same mesh as VTU. */
static void test_written(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_mesh *mesh = NULL;
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 34, "g.vtu"));
    CHECK_OK(ctx, tl_mesh_read(ctx, "g.vtu", NULL, &mesh, NULL));
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "g.vtk", NULL));
    tl_mesh_destroy(mesh);
    CHECK(check_feed_file(ctx, "g.vtk", NULL) > 1);
    void *all[2];
    size_t bytes[2];
    for (int i = 0; i < 2; i++) {
        tl_build_opts opts = tl_build_opts_defaults();
        tl_build_result result;
        CHECK_OK(ctx, tl_model_build(ctx, i ? "g.vtk" : "g.vtu", NULL, "g.tlod", &opts, &result));
        tl_build_release(ctx, &result);
        all[i] = check_file_load("g.tlod", &bytes[i]);
    }
    CHECK_EQ(bytes[0], bytes[1]);
    CHECK(memcmp(all[0], all[1], bytes[0]) == 0);
    free(all[0]);
    free(all[1]);
    tl_ctx_destroy(ctx);
}

/* ---- broken files ---- */

static tl_status read_windows(tl_ctx *ctx, const char *path, tl_read_report *report)
{
    tli_feed *feed = NULL;
    tl_status st = tli_feed_open(ctx, path, NULL, ".", 1, &feed);
    if (st) return st;
    check_feed_tets all = {.tuple = check_feed_components(feed, TL_ON_TET)};
    st = check_feed_gather(feed, &all);
    if (!st) st = tli_feed_report(feed, report);
    check_feed_drop(&all);
    tli_feed_close(feed);
    return st;
}

/* A file that was cut short or changed in a byte is refused or counted as it is as a whole. */
static void test_broken(void **state)
{
    (void)state;
    const uint32_t dims[3] = {3, 3, 3};
    tl_ctx *ctx = check_ctx_create(1);
    uint64_t random = 7;
    size_t refused = 0;
    for (int i = 0; i < 900; i++) {
        size_t bytes;
        if (i % 3 == 2)
            write_structured("b.vtk", "STRUCTURED_GRID", dims, true);
        else
            write_mixed("b.vtk", dims, i % 3 ? 5 : 3);
        char *all = check_file_load("b.vtk", &bytes);
        random = random * 6364136223846793005u + 1442695040888963407u;
        const size_t place = (size_t)(random >> 33) % bytes;
        if (i % 2)
            bytes = place;
        else
            all[place] = (char)(random >> 20);
        FILE *file = fopen("b.vtk", "wb");
        fwrite(all, 1, bytes, file);
        fclose(file);
        free(all);
        tl_mesh *mesh = NULL;
        tl_read_report whole = {0}, windowed = {0};
        tl_status expected = tl_mesh_read(ctx, "b.vtk", NULL, &mesh, &whole);
        tl_mesh_destroy(mesh);
        CHECK_EQ(read_windows(ctx, "b.vtk", &windowed), expected);
        if (expected)
            refused++;
        else
            CHECK(memcmp(&whole, &windowed, sizeof whole) == 0);
    }
    CHECK(refused > 100 && refused < 800);
    tl_ctx_destroy(ctx);
}

/* A point that is not there is named with its cell. */
static void test_message(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    FILE *file = begin_file("x.vtk", "DATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n");
    for (int i = 0; i < 12; i++) put_f32(file, (float)(i % 4 == 0));
    fprintf(file, "\nCELLS 2 10\n");
    for (uint32_t i = 0; i < 10; i++) put(file, i % 5 ? i - 1 : 4, 4);
    fprintf(file, "\nCELL_TYPES 2\n");
    for (int i = 0; i < 2; i++) put(file, 10, 4);
    fclose(file);
    tl_read_report report;
    CHECK_STATUS(read_windows(ctx, "x.vtk", &report), TL_ERR_FORMAT);
    CHECK(strstr(tl_ctx_message(ctx), "'x.vtk'") != NULL);
    CHECK(strstr(tl_ctx_message(ctx), "cell 1 names point 5, expected below 4") != NULL);
    tl_ctx_destroy(ctx);
}

/* ---- real data ---- */

static void test_real(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        bool is_windowed;
    } files[] = {{"tet/CylinderLinear.vtk", true},
                 {"tet/CylinderQuadratic.vtk", true},
                 {"tet/post.vtk", true},
                 {"vector/carotid.vtk", true},
                 {"tensor/notch_stress_fixed.vtk", true},
                 {"hexmixed/ball_4.vtk", false},
                 {"curvilinear/bluntfin.vtk", false}};
    char path[4096];
    if (!data_path(files[0].name, path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = check_ctx_create(2);
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        if (!data_path(files[i].name, path, sizeof path)) fail_msg("no '%s'", path);
        uint64_t windows = check_feed_file(ctx, path, NULL);
        printf("%s: %llu windows\n", files[i].name, (unsigned long long)windows);
        CHECK_EQ(windows > 0, files[i].is_windowed);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_structured), cmocka_unit_test(test_mixed),
        cmocka_unit_test(test_whole),      cmocka_unit_test(test_written),
        cmocka_unit_test(test_broken),     cmocka_unit_test(test_message),
        cmocka_unit_test(test_real),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
