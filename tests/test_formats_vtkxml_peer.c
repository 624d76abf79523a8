/* Files that VTK and meshio write, in every mode they have, read as VTK itself reads them; and the
 * real files of the data folder have the counts of its SOURCES.md and of VTK. */
#include "check.h"

#include <unistd.h>

#include "formats/formats_grid.h"

static tl_ctx *ctx;

static int setup(void **state)
{
    (void)state;
    return tl_ctx_create(NULL, &ctx) != TL_OK;
}

static int teardown(void **state)
{
    (void)state;
    bool clean = tl_ctx_current_bytes(ctx) == 0;
    tl_ctx_destroy(ctx);
    return !clean;
}

static void read_file(const char *path, tli_grid *grid)
{
    tli_map map;
    CHECK_OK(ctx, tli_map_open(ctx, path, &map));
    tli_grid_init(ctx, grid);
    CHECK_OK(ctx, tli_read_vtk_xml(ctx, &map, path, grid));
    tli_map_close(ctx, &map);
}

/* ---- peers ---- */

static double next_number(FILE *truth)
{
    char word[64];
    CHECK(fscanf(truth, "%63s", word) == 1);
    return strtod(word, NULL);
}

static size_t next_count(FILE *truth, const char *word)
{
    char found[64];
    CHECK(fscanf(truth, "%63s", found) == 1);
    assert_string_equal(found, word);
    return (size_t)next_number(truth);
}

static void check_number(double actual, double expected)
{
    if (!isnan(expected) || !isnan(actual)) CHECK_NEAR(actual - expected, 0, 0);
}

static void check_infinite_or_equal(double actual, double expected)
{
    if (isinf(expected))
        CHECK(actual == expected);
    else
        check_number(actual, expected);
}

/* A point of a turned image is a sum of products, which VTK adds in another order. */
static void check_points(const tli_grid *grid, FILE *truth, bool is_image)
{
    CHECK_EQ(grid->point_count, next_count(truth, "points"));
    for (uint64_t i = 0; i < 3 * grid->point_count; i++)
        CHECK_NEAR(grid->xyz[i], next_number(truth), is_image ? 1e-14 : 0);
}

static void check_cells(const tli_grid *grid, FILE *truth)
{
    size_t listed = next_count(truth, "cells");
    CHECK_EQ(tli_grid_cell_count(grid), next_number(truth));
    CHECK_EQ(listed, grid->cell_count);
    uint64_t at = 0;
    for (size_t i = 0; i < listed; i++) {
        CHECK_EQ(grid->types[i], next_number(truth));
        uint64_t count = (uint64_t)next_number(truth);
        CHECK_EQ(grid->offsets[i + 1] - grid->offsets[i], count);
        for (uint64_t j = 0; j < count; j++) CHECK_EQ(grid->connectivity[at++], next_number(truth));
    }
}

static void check_arrays(const tli_grid_array *arrays, uint32_t array_count, FILE *truth)
{
    CHECK_EQ(array_count, next_count(truth, "arrays"));
    for (uint32_t a = 0; a < array_count; a++) {
        char name[128];
        CHECK_EQ(arrays[a].components, next_number(truth));
        CHECK_EQ(arrays[a].count, next_number(truth));
        CHECK(fscanf(truth, " %127[^\n]", name) == 1);
        assert_string_equal(arrays[a].name, name);
        for (uint64_t i = 0; i < arrays[a].count * arrays[a].components; i++)
            check_infinite_or_equal(arrays[a].values[i], next_number(truth));
    }
}

static void check_file(const char *name)
{
    char path[512];
    tli_grid grid;
    snprintf(path, sizeof path, "peer/%s.truth", name);
    FILE *truth = fopen(path, "r");
    CHECK(truth != NULL);
    snprintf(path, sizeof path, "peer/%s", name);
    printf("# %s\n", name);
    read_file(path, &grid);
    check_points(&grid, truth, strstr(name, ".vti") != NULL);
    check_cells(&grid, truth);
    char word[16];
    CHECK(fscanf(truth, "%15s", word) == 1);
    check_number(grid.time, next_number(truth));
    check_arrays(grid.point_arrays, grid.point_array_count, truth);
    check_arrays(grid.cell_arrays, grid.cell_array_count, truth);
    tli_grid_release(&grid);
    fclose(truth);
}

static void reads_what_peers_write(void **state)
{
    char name[256];
    size_t count = 0;
    (void)state;
    if (system("/usr/bin/python3 -c 'import vtk' 2>peer.log"))
        CHECK_SKIP("VTK for /usr/bin/python3 is not installed");
    CHECK_EQ(system("mkdir peer && /usr/bin/python3 '" TETRALOD_SOURCE_DIR
                    "/tests/vtk_xml_peer.py' peer 2>>peer.log"),
             0);
    FILE *list = fopen("peer/list", "r");
    CHECK(list != NULL);
    for (; fscanf(list, "%255s", name) == 1; count++) check_file(name);
    fclose(list);
    printf("# %zu files\n", count);
    CHECK(count >= 190);
}

/* ---- real files ---- */

static const struct {
    const char *path;
    uint64_t points, cells;
    uint32_t point_arrays, cell_arrays;
} files[] = {
    {"curvilinear/multicomb_0.vts", 648, 440, 3, 0},
    {"curvilinear/multicomb_1.vts", 864, 616, 3, 0},
    {"curvilinear/multicomb_2.vts", 972, 704, 3, 0},
    {"hexmixed/can.vtu", 6724, 4800, 5, 1},
    {"hexmixed/fire_ug.vtu", 12323, 10462, 6, 0},
    {"multimaterial/5material-droplet_10.vtu", 491, 884, 20, 2},
    {"multimaterial/cth.vtr", 545025, 524288, 0, 9},
    {"tet/2x2x2cube.vtu", 29791, 162000, 1, 0},
    {"tet/annulus_gradation.vtu", 2160, 9600, 3, 0},
    {"tet/bracket_appended_compressed.vtu", 50000, 206208, 3, 2},
    {"tet/dataset.vtu", 102578, 56786, 0, 1},
    {"tet/monodomain3d_0.vtu", 847, 3600, 51, 0},
    {"tet/raptorTetra_19409.vtu", 5992, 19409, 0, 0},
    {"tet/raptorTetra_8418.vtu", 2996, 8418, 0, 0},
    {"tet/seamount.vtu", 20004, 100450, 3, 0},
    {"timevarying/wavy/wavy/wavy00.vts", 6400, 6241, 1, 0},
    {"timevarying/viscous-fingers/010_density.vti", 262144, 250047, 1, 0},
    {"vector/BuiltInExample1.vti", 33345, 32768, 1, 0},
    {"volume/hydrogen.vti", 262144, 250047, 1, 0},
    {"vtk-formats/Tetrahedron.vtu", 35, 96, 2, 0},
    {"vtk-formats/QuadraticTetra.vtu", 189, 96, 2, 0},
    {"vtk-formats/QuadraticPyramid.vtu", 153, 48, 2, 0},
    {"vtk-formats/QuadraticWedge.vtu", 93, 16, 2, 0},
    {"vtk-formats/Wedge.vtu", 27, 16, 2, 0},
    {"vtk-formats/Hexahedron.vtu", 26, 7, 0, 1},
    {"vtk-formats/TriQuadraticHexahedron.vtu", 117, 7, 0, 1},
    {"vtk-formats/polyhedron2pieces.vtu", 18, 4, 0, 0},
    {"vtk-formats/celldata_appended_binary_uncompressed.vtu", 4434, 3085, 0, 5},
    {"vtk-formats/celldata_inline_binary_compressed.vtu", 4434, 3085, 0, 5},
};

static void reads_real_files(void **state)
{
    const char *folder = getenv("TETRALOD_DATA");
    (void)state;
    if (!folder) CHECK_SKIP("TETRALOD_DATA names no folder of data");
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        char path[1024];
        tli_grid grid;
        snprintf(path, sizeof path, "%s/%s", folder, files[i].path);
        printf("# %s\n", files[i].path);
        read_file(path, &grid);
        CHECK_EQ(grid.point_count, files[i].points);
        CHECK_EQ(tli_grid_cell_count(&grid), files[i].cells);
        CHECK_EQ(grid.point_array_count, files[i].point_arrays);
        CHECK_EQ(grid.cell_array_count, files[i].cell_arrays);
        tli_grid_release(&grid);
    }
}

/* Ranges and sums that SOURCES.md gives: the numbers, not only their count. */
static void reads_real_values(void **state)
{
    const char *folder = getenv("TETRALOD_DATA");
    char path[1024];
    tli_grid grid;
    uint64_t points = 0, voxels = 0;
    (void)state;
    if (!folder) CHECK_SKIP("TETRALOD_DATA names no folder of data");
    for (int piece = 0; piece < 4; piece++) {
        snprintf(path, sizeof path, "%s/hexmixed/blood_vessels/T0000000500/%03d.vtu", folder,
                 piece);
        read_file(path, &grid);
        points += grid.point_count;
        for (uint64_t i = 0; i < grid.cell_count; i++) voxels += grid.types[i] == 11;
        tli_grid_release(&grid);
    }
    CHECK_EQ(points, 48823);
    CHECK_EQ(voxels, 39353);

    snprintf(path, sizeof path, "%s/tet/bracket_appended_compressed.vtu", folder);
    read_file(path, &grid);
    const tli_grid_array *stress = &grid.cell_arrays[1];
    double low = INFINITY, high = -INFINITY;
    for (uint64_t i = 0; i < stress->count; i++) {
        low = fmin(low, stress->values[i]);
        high = fmax(high, stress->values[i]);
    }
    assert_string_equal(stress->name, "sj2p");
    CHECK_NEAR(low, 216.08399963, 1e-8);
    CHECK_NEAR(high, 119441, 0.5);
    CHECK(grid.types == NULL);
    tli_grid_release(&grid);
}

/* The same mesh in five codings. */
static void reads_five_codings(void **state)
{
    static const char *const names[] = {"ascii", "binary", "append_b64", "append_raw",
                                        "append_raw_compress"};
    const char *folder = getenv("TETRALOD_DATA");
    tli_grid grids[5];
    (void)state;
    if (!folder) CHECK_SKIP("TETRALOD_DATA names no folder of data");
    for (int i = 0; i < 5; i++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/vtk-formats/quad_%s.vtu", folder, names[i]);
        read_file(path, &grids[i]);
        CHECK_EQ(grids[i].point_count, 16);
        CHECK_EQ(grids[i].cell_count, 9);
        CHECK(memcmp(grids[i].xyz, grids[0].xyz, 16 * 3 * sizeof(double)) == 0);
        CHECK(memcmp(grids[i].connectivity, grids[0].connectivity, 36 * sizeof(uint32_t)) == 0);
    }
    for (int i = 0; i < 5; i++) tli_grid_release(&grids[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(reads_what_peers_write, setup, teardown),
        cmocka_unit_test_setup_teardown(reads_real_files, setup, teardown),
        cmocka_unit_test_setup_teardown(reads_real_values, setup, teardown),
        cmocka_unit_test_setup_teardown(reads_five_codings, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
