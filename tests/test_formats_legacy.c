/* Legacy VTK files: written here and by VTK, every number type, damaged in every byte, hostile
 * counts, and the real data sets with the counts that their sources give. */
#include "check_grid.h"

#include <float.h>

#define VTK_FOLDER TETRALOD_SOURCE_DIR "/fuzz/corpus/vtk_legacy/"

static tl_status read_legacy(tl_ctx *ctx, const tli_map *map, void *arg, tli_grid *grid)
{
    (void)arg;
    return tli_read_vtk_legacy(ctx, map, "test.vtk", grid);
}

/* ---- files made here ---- */

/* A file that grows. */
typedef struct file {
    uint8_t bytes[8192];
    size_t byte_count;
} file;

static void put_text(file *out, const char *text)
{
    size_t length = strlen(text);
    CHECK(out->byte_count + length <= sizeof out->bytes);
    memcpy(out->bytes + out->byte_count, text, length);
    out->byte_count += length;
}

/* The low bytes of a number, the high one first. */
static void put_big_endian(file *out, uint64_t value, size_t byte_count)
{
    for (size_t i = byte_count; i-- > 0;) out->bytes[out->byte_count++] = (uint8_t)(value >> 8 * i);
}

static void put_f64(file *out, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_big_endian(out, bits, 8);
}

static void put_f32(file *out, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_big_endian(out, bits, 4);
}

/* Reads text that must be good. */
static void read_good(tl_ctx *ctx, const char *text, tli_grid *grid)
{
    CHECK_OK(ctx, grid_read(ctx, read_legacy, NULL, text, strlen(text), grid));
    grid_check(grid);
}

#define TET_ASCII                                                                                  \
    "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n"                            \
    "POINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"

static void reads_each_number_type(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        tl_scalar scalar;
        size_t stored_bytes;
        double low, high;
    } types[] = {{"char", TL_I8, 1, -128, 127},
                 {"signed_char", TL_I8, 1, -128, 127},
                 {"unsigned_char", TL_U8, 1, 0, 255},
                 {"short", TL_I16, 2, -32768, 32767},
                 {"unsigned_short", TL_U16, 2, 0, 65535},
                 {"int", TL_I32, 4, -2147483648.0, 2147483647},
                 {"unsigned_int", TL_U32, 4, 0, 4294967295.0},
                 {"long", TL_I64, 8, -9007199254740992.0, 9007199254740992.0},
                 {"unsigned_long", TL_U64, 8, 0, 9007199254740992.0},
                 {"vtkIdType", TL_I64, 4, -2147483648.0, 2147483647},
                 {"vtktypeint64", TL_I64, 8, -9007199254740992.0, 9007199254740992.0},
                 {"VTKTYPEUINT64", TL_U64, 8, 0, 9007199254740992.0},
                 {"vtktypeint32", TL_I32, 4, -2147483648.0, 2147483647},
                 {"float", TL_F32, 4, -FLT_MAX, FLT_MIN},
                 {"double", TL_F64, 8, -DBL_MAX, DBL_TRUE_MIN}};
    tl_ctx *ctx = grid_ctx(0, 1);
    for (size_t t = 0; t < sizeof types / sizeof *types; t++) {
        const double values[4] = {types[t].low, types[t].high, 1, 0};
        for (int binary = 0; binary < 2; binary++) {
            file out = {.byte_count = 0};
            char text[512];
            tli_grid grid;
            put_text(&out, "# vtk DataFile Version 4.2\nt\n");
            put_text(&out, binary ? "BINARY\n" : "ASCII\n");
            put_text(&out, "DATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 1\nPOINT_DATA 4\n");
            snprintf(text, sizeof text, "SCALARS a %s\nLOOKUP_TABLE default\n", types[t].name);
            put_text(&out, text);
            for (int i = 0; i < 4; i++) {
                snprintf(text, sizeof text, "%.17g ", values[i]);
                if (!binary)
                    put_text(&out, text);
                else if (types[t].scalar == TL_F64)
                    put_f64(&out, values[i]);
                else if (types[t].scalar == TL_F32)
                    put_f32(&out, (float)values[i]);
                else
                    put_big_endian(&out, (uint64_t)(int64_t)values[i], types[t].stored_bytes);
            }
            CHECK_OK(ctx, grid_read(ctx, read_legacy, NULL, out.bytes, out.byte_count, &grid));
            const tli_grid_array *array = grid_array(&grid, TL_ON_VERTEX, "a");
            CHECK_EQ(array->scalar, types[t].scalar);
            for (int i = 0; i < 4; i++)
                if (array->values[i] != values[i])
                    fail_msg("%s: %.17g, expected %.17g", types[t].name, array->values[i],
                             values[i]);
            tli_grid_release(&grid);
        }
    }
    tl_ctx_destroy(ctx);
}

static void reads_bits(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_grid grid;
    file out = {.byte_count = 0};
    put_text(&out, "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\n"
                   "DIMENSIONS 3 3 1\nPOINT_DATA 9\nSCALARS b bit\nLOOKUP_TABLE default\n");
    put_big_endian(&out, 0xa580, 2); /* 1010 0101 1 */
    put_text(&out, "\nSCALARS c int\nLOOKUP_TABLE default\n");
    for (unsigned i = 0; i < 9; i++) put_big_endian(&out, i, 4);
    CHECK_OK(ctx, grid_read(ctx, read_legacy, NULL, out.bytes, out.byte_count, &grid));
    static const double bits[] = {1, 0, 1, 0, 0, 1, 0, 1, 1};
    for (int i = 0; i < 9; i++) {
        CHECK(grid.point_arrays[0].values[i] == bits[i]);
        CHECK(grid.point_arrays[1].values[i] == i);
    }
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

static void reads_keywords_in_any_case(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_grid grid;
    read_good(ctx,
              "# VTK datafile version 2.0\r\nt\r\nascii\r\ndataset Structured_Points\r\n"
              "Dimensions 2 3 2\r\naspect_ratio 1 2 4\r\norigin -1 0 1e1\r\npoint_data 12\r\n"
              "scalars my%20name Float 1\r\nlookup_table T\r\n0 1 2 3 4 5 6 7 8 9 10 nan\r\n"
              "Lookup_Table T 1\r\n0 0 0 1\r\nvectors v float\r\n"
              "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 7.5",
              &grid);
    CHECK_EQ(grid.block_count, 1);
    CHECK_EQ(grid.point_count, 12);
    CHECK_EQ(tli_grid_cell_count(&grid), 2);
    CHECK(grid.xyz[33] == 0 && grid.xyz[34] == 4 && grid.xyz[35] == 14);
    CHECK(isnan(grid_array(&grid, TL_ON_VERTEX, "my name")->values[11]));
    CHECK(grid_array(&grid, TL_ON_VERTEX, "v")->values[35] == 7.5);
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

/* An ascii float is the nearest float, as a binary one would be, not the nearest double. */
static void rounds_text_to_its_type(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_grid grid;
    read_good(ctx,
              TET_ASCII "POINT_DATA 4\nSCALARS a float\n0.1 0.2 0.3 1e-50\nSCALARS b double\n"
                        "LOOKUP_TABLE default\n0.1 0.2 0.3 1e-50\n",
              &grid);
    CHECK(grid.point_arrays[0].values[0] == (double)0.1f);
    CHECK(grid.point_arrays[0].values[3] == 0);
    CHECK(grid.point_arrays[1].values[0] == 0.1);
    CHECK(grid.point_arrays[1].values[3] == 1e-50);
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

static void reads_attributes_of_all_kinds(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_grid grid;
    read_good(ctx,
              TET_ASCII
              "METADATA\nINFORMATION 0\n\n"
              "CELL_DATA 1\nTENSORS t float\n1 2 3 4 5 6 7 8 9\nMETADATA\nCOMPONENT_NAMES\n"
              "a\n\n\n\n\n\n\n\ni\n\nTENSORS6 s float\n1 2 3 4 5 6\n"
              "NORMALS n float\n0 0 1\nTEXTURE_COORDINATES c 2 float\n.5 .25\n"
              "GLOBAL_IDS g vtkIdType\n5000000000\nPEDIGREE_IDS p vtkIdType\n6\n"
              "EDGE_FLAGS e unsigned_char\n1\nCOLOR_SCALARS r 4\n0 0.1 1 2\n"
              "FIELD f 4\nx 2 1 double\n1 2\nNULL_ARRAY\nvtkGhostLevels 1 1 int\n2\n"
              "odd 1 7 double\n1 2 3 4 5 6 7\n",
              &grid);
    static const struct {
        const char *name;
        uint32_t components;
        double last;
    } expected[] = {{"t", 9, 9}, {"s", 6, 6}, {"n", 3, 1},   {"c", 2, .25}, {"g", 1, 5e9},
                    {"p", 1, 6}, {"e", 1, 1}, {"r", 4, 255}, {"x", 2, 2},   {"vtkGhostType", 1, 1}};
    CHECK_EQ(grid.cell_array_count, sizeof expected / sizeof *expected);
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        const tli_grid_array *array = grid_array(&grid, TL_ON_TET, expected[i].name);
        CHECK_EQ(array->components, expected[i].components);
        CHECK(array->values[array->components - 1] == expected[i].last);
    }
    CHECK(grid_array(&grid, TL_ON_TET, "r")->values[1] == 26);
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

/* Old rows of cells and new offsets say the same. */
static void reads_both_styles_of_cells(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    static const char *const sections[] = {
        "CELLS 3 14\n4 0 1 2 3 3 0 1 2\n4\n3 2 1 0\n",
        "CELLS 4 11\nOFFSETS vtktypeint64\n0 4 7 11\nCONNECTIVITY vtktypeint64\n0 1 2 3 0 1 2 3 2 "
        "1 0\n",
        "CELLS 4 11\nOFFSETS int\n0 4 7 11\nMETADATA\nINFORMATION 0\n\nconnectivity short\n"
        "0 1 2 3 0 1 2 3 2 1 0\n"};
    for (size_t s = 0; s < 3; s++) {
        char text[1024];
        tli_grid grid;
        snprintf(text, sizeof text,
                 "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
                 "0 0 0 1 0 0 0 1 0 0 0 1\n%sCELL_TYPES 3\n10 5 10\n",
                 sections[s]);
        read_good(ctx, text, &grid);
        static const uint64_t offsets[] = {0, 4, 7, 11};
        static const uint32_t ids[] = {0, 1, 2, 3, 0, 1, 2, 3, 2, 1, 0};
        CHECK_EQ(grid.cell_count, 3);
        CHECK(!memcmp(grid.offsets, offsets, sizeof offsets));
        CHECK(!memcmp(grid.connectivity, ids, sizeof ids));
        CHECK(!memcmp(grid.types, "\12\5\12", 3));
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

/* A polyhedron names its faces; the cells around it stay what they are. */
static void lists_faces_of_polyhedra(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_grid grid;
    read_good(ctx,
              "# vtk DataFile Version 4.2\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
              "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 2 23\n17 4 3 0 1 2 3 0 1 3 3 1 2 3 3 0 2 3\n"
              "4 0 1 2 3\nCELL_TYPES 2\n42 10\n",
              &grid);
    static const uint32_t ids[] = {0, 1, 2, 3, 0, 1, 2, 3};
    CHECK_EQ(grid.offsets[1], 4);
    CHECK_EQ(grid.offsets[2], 8);
    CHECK(!memcmp(grid.connectivity, ids, sizeof ids));
    CHECK_EQ(grid.face_count, 4);
    CHECK_EQ(grid.face_offsets[4], 12);
    CHECK(grid.face_points[3] == 0 && grid.face_points[4] == 1 && grid.face_points[5] == 3);
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

/* ---- files that VTK wrote ---- */

/* The value that the script behind these files gave component k of tuple i. */
static double written_value(const tli_grid_array *array, uint64_t i, uint32_t k)
{
    if (!strcmp(array->name, "bit")) return (double)((i * 7 + k * 3) % 2);
    if (!strcmp(array->name, "vtkGhostType")) return i == 1;
    double value = (double)i * 1.25 + k * 0.1 + (array->components > 1 ? 0 : 3);
    if (array->scalar == TL_F64) return value;
    return array->scalar == TL_F32 ? (double)(float)value : floor(value);
}

static void check_written(const tli_grid *grid, tl_on on)
{
    static const struct {
        const char *name;
        uint32_t components;
        tl_scalar scalar;
    } arrays[] = {{"f loat", 1, TL_F32}, {"v", 3, TL_F64},          {"t", 9, TL_F64},
                  {"t6", 6, TL_F64},     {"gid", 1, TL_I64},        {"pid", 1, TL_I64},
                  {"n", 3, TL_F32},      {"tc", 2, TL_F32},         {"bit", 1, TL_U8},
                  {"sh", 2, TL_I16},     {"ush", 1, TL_U16},        {"ui", 1, TL_U32},
                  {"ull", 1, TL_U64},    {"vtkGhostType", 1, TL_U8}};
    const size_t count = sizeof arrays / sizeof *arrays;
    CHECK_EQ(on == TL_ON_VERTEX ? grid->point_array_count : grid->cell_array_count, count);
    for (size_t a = 0; a < count; a++) {
        const tli_grid_array *array = grid_array(grid, on, arrays[a].name);
        CHECK_EQ(array->components, arrays[a].components);
        CHECK_EQ(array->scalar, arrays[a].scalar);
        for (uint64_t i = 0; i < array->count; i++)
            for (uint32_t k = 0; k < array->components; k++) {
                double value = array->values[i * array->components + k];
                if (fabs(value - written_value(array, i, k)) > 1e-15 * fabs(value))
                    fail_msg("%s: value %u of tuple %u is %.17g, expected %.17g", array->name, k,
                             (unsigned)i, value, written_value(array, i, k));
            }
    }
}

/* Reads a file through its path. */
static void read_path(tl_ctx *ctx, const char *path, tli_grid *grid)
{
    tli_map map;
    CHECK_OK(ctx, tli_map_open(ctx, path, &map));
    tli_grid_init(ctx, grid);
    CHECK_OK(ctx, tli_read_vtk_legacy(ctx, &map, path, grid));
    tli_map_close(ctx, &map);
    grid_check(grid);
}

static void reads_what_vtk_writes(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint64_t points, cells;
        double corner[3]; /* the last point */
    } files[] = {{"image_51_a1", 27, 8, {3, 3, 7}},     {"image_42_b0", 27, 8, {3, 3, 7}},
                 {"rect_51_b0", 24, 6, {1.2, .3, 2.7}}, {"sgrid_51_a0", 12, 2, {2.1, 1, 1}},
                 {"sgrid_42_b1", 12, 2, {2.1, 1, 1}},   {"poly_42_a0", 12, 7, {2.1, 1, 1}},
                 {"poly_51_b0", 12, 7, {2.1, 1, 1}},    {"ugrid_42_a0", 12, 6, {2.1, 1, 1}},
                 {"ugrid_42_b0", 12, 6, {2.1, 1, 1}},   {"ugrid_51_a0", 12, 6, {2.1, 1, 1}},
                 {"ugrid_51_b0", 12, 6, {2.1, 1, 1}}};
    static const uint8_t types[] = {12, 10, 13, 14, 11, 5};
    static const uint32_t ids[] = {0, 1, 4, 3, 6, 7, 10, 9, 0, 1, 3, 6, 0, 1,  3, 6, 7,
                                   9, 0, 1, 4, 3, 6, 0,  1, 3, 4, 6, 7, 9, 10, 0, 1, 2};
    tl_ctx *ctx = grid_ctx(0, 2);
    for (size_t f = 0; f < sizeof files / sizeof *files; f++) {
        char path[512];
        tli_grid grid;
        snprintf(path, sizeof path, VTK_FOLDER "%s.vtk", files[f].name);
        read_path(ctx, path, &grid);
        printf("%s\n", files[f].name);
        CHECK_EQ(grid.point_count, files[f].points);
        CHECK_EQ(tli_grid_cell_count(&grid), files[f].cells);
        for (int axis = 0; axis < 3; axis++)
            CHECK_NEAR(grid.xyz[3 * grid.point_count - 3 + (uint64_t)axis], files[f].corner[axis],
                       1e-15);
        CHECK(grid.time == 7.25);
        check_written(&grid, TL_ON_VERTEX);
        check_written(&grid, TL_ON_TET);
        if (!strncmp(files[f].name, "ugrid", 5)) {
            CHECK(!memcmp(grid.types, types, sizeof types));
            CHECK_EQ(grid.offsets[6] * sizeof *ids, sizeof ids);
            CHECK(!memcmp(grid.connectivity, ids, sizeof ids));
        }
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

/* Strings and variants between arrays of numbers are left out without losing the place. */
static void leaves_strings_out(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    static const char *const names[] = {"kinds_51_a", "kinds_42_b"};
    for (size_t f = 0; f < 2; f++) {
        char path[512];
        tli_grid grid;
        snprintf(path, sizeof path, VTK_FOLDER "%s.vtk", names[f]);
        read_path(ctx, path, &grid);
        CHECK_EQ(grid.point_array_count, 10);
        CHECK(grid.time == 2.5);
        CHECK(grid_array(&grid, TL_ON_VERTEX, "u c%\"\xc3\xa9")->values[3] == 63);
        CHECK(grid_array(&grid, TL_ON_VERTEX, "rng")->values[11] == 3);
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

static void reads_blanking_and_fields_alone(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_grid grid;
    read_path(ctx, VTK_FOLDER "blanking_a.vtk", &grid);
    CHECK(grid.blanks && !memcmp(grid.blanks, "\1\1\1\1\0\1\1\1", 8));
    tli_grid_release(&grid);
    read_path(ctx, VTK_FOLDER "field_only_a.vtk", &grid);
    CHECK_EQ(grid.point_count, 0);
    CHECK_EQ(tli_grid_cell_count(&grid), 0);
    CHECK(grid.time == 1e-3);
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

/* ---- bad files ---- */

#define HEAD "# vtk DataFile Version 3.0\nt\nASCII\n"
#define UGRID HEAD "DATASET UNSTRUCTURED_GRID\n"
#define IMAGE HEAD "DATASET STRUCTURED_POINTS\n"

static void names_file_place_and_expectation(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        tl_status status;
        const char *message;
    } cases[] = {
        {"", TL_ERR_FORMAT, "'test.vtk': line 1: expected '# vtk DataFile Version', found the end"},
        {"# vtk DataFile Version 9.0\n", TL_ERR_UNSUPPORTED, "version 9, expected 1.0 to 5.1"},
        {"# vtk DataFile Version 3.0\nt\nASCI\n", TL_ERR_FORMAT,
         "line 3: expected ASCII or BINARY, found 'ASCI'"},
        {HEAD, TL_ERR_FORMAT, "line 4: expected DATASET"},
        {HEAD "DATASET TABLE\n", TL_ERR_UNSUPPORTED, "line 4: data set of kind 'TABLE'"},
        {HEAD "POINTS 1 float\n", TL_ERR_FORMAT, "line 4: POINTS can't stand here"},
        {UGRID "POINTS 4 float\n0 0 0\n0 x 0\n", TL_ERR_FORMAT,
         "line 5: POINTS: expected 12 values"},
        {UGRID "POINTS 2 float\n0 0 0\n0 x 0\n", TL_ERR_FORMAT,
         "line 7: expected a number of type float of POINTS, found 'x'"},
        {UGRID "POINTS -4 float\n", TL_ERR_FORMAT, "expected the number of points, found '-4'"},
        {UGRID "POINTS 99999999999999999999 float\n", TL_ERR_FORMAT,
         "expected the number of points"},
        {UGRID "POINTS 9223372036854775807 float\n", TL_ERR_FORMAT, "overflow"},
        {UGRID "POINTS 4000000000 float\n0 0 0\n", TL_ERR_FORMAT, "expected 12000000000 values"},
        {UGRID "POINTS 1 floot\n0 0 0\n", TL_ERR_FORMAT, "expected a number type"},
        {UGRID "POINTS 0 float\nPOINTS 0 float\n", TL_ERR_FORMAT, "POINTS stands here again"},
        {UGRID "POINTS 1 float\n0 0 0\nCELLS 1 2\n1 1\nCELL_TYPES 1\n1\n", TL_ERR_FORMAT,
         "line 7: cell 0 names point 1, expected below 1"},
        {UGRID "POINTS 1 float\n0 0 0\nCELLS 1 2\n1 -1\n", TL_ERR_FORMAT, "names point -1"},
        {UGRID "CELLS 1 5000000000\n4 0 0 0 0\n", TL_ERR_FORMAT, "expected 5000000000 values"},
        {UGRID "CELLS 7 5\n4 0 0 0 0\n", TL_ERR_FORMAT, "7 cells in 5 integers"},
        {UGRID "CELLS 1 5\n5 0 0 0 0\n", TL_ERR_FORMAT, "has 5 indices, expected at most 4"},
        {UGRID "CELLS 1 5\n3 0 0 0 0\n", TL_ERR_FORMAT, "cell 1 of 1 has 0 indices"},
        {UGRID "CELLS 2 5\n3 0 0 0 0\n", TL_ERR_FORMAT, "0 cell types for 2 cells"},
        {UGRID "CELLS 0 0\nOFFSETS int\n0\nCONNECTIVITY int\n", TL_ERR_FORMAT, "0 offsets"},
        {UGRID "CELLS 3 4\nOFFSETS int\n0 3 2\nCONNECTIVITY int\n0 0 0 0\n", TL_ERR_FORMAT,
         "offset 2 of 3 is 2, expected 4"},
        {UGRID "CELLS 2 4\nOFFSETS float\n0 4\nCONNECTIVITY int\n0 0 0 0\n", TL_ERR_FORMAT,
         "OFFSETS: expected integers, found type float"},
        {UGRID "CELLS 2 4\nOFFSETS int\n0 4\n", TL_ERR_FORMAT, "expected CONNECTIVITY"},
        {UGRID "POINTS 1 float\n0 0 0\nCELLS 1 2\n1 0\nCELL_TYPES 1\n256\n", TL_ERR_FORMAT,
         "type 256 of cell 0"},
        {UGRID "POINTS 1 float\n0 0 0\nCELLS 1 2\n1 0\n", TL_ERR_FORMAT,
         "0 cell types for 1 cells"},
        {UGRID "POINTS 1 float\n0 0 0\nCELLS 1 3\n2 7 0\nCELL_TYPES 1\n42\n", TL_ERR_FORMAT,
         "cell 0 is a polyhedron"},
        {TET_ASCII "POINT_DATA 5\n", TL_ERR_FORMAT, "line 11: POINT_DATA of 5 tuples, expected 4"},
        {TET_ASCII "SCALARS a float\n", TL_ERR_FORMAT, "expected POINT_DATA or CELL_DATA before"},
        {TET_ASCII "CELL_DATA 1\nSCALARS a int\n1.5\n", TL_ERR_FORMAT, "found '1.5'"},
        {TET_ASCII "CELL_DATA 1\nSCALARS a unsigned_char\n256\n", TL_ERR_FORMAT, "found '256'"},
        {TET_ASCII "CELL_DATA 1\nSCALARS a float 0\n256\n", TL_ERR_FORMAT, "has 0 components"},
        {TET_ASCII "CELL_DATA 1\nVECTORS a float\n1 2 3 4\n", TL_ERR_FORMAT,
         "line 13: expected a keyword, found '4'"},
        {TET_ASCII "CELL_DATA 1\nFIELD f 2\na 1 1 int\n1\n", TL_ERR_FORMAT,
         "expected a name, found the end of the file"},
        {IMAGE "POINT_DATA 1\n", TL_ERR_FORMAT, "expected DIMENSIONS"},
        {IMAGE "DIMENSIONS 4000000000 4000000000 2\n", TL_ERR_UNSUPPORTED, "points, at most"},
        {IMAGE "DIMENSIONS 1000 1000 1000\n", TL_ERR_FORMAT, "but the file has"},
        {IMAGE "EXTENT 0 -2 0 1 0 1\n", TL_ERR_FORMAT, "extent from 0 to -2"},
        {HEAD "DATASET STRUCTURED_GRID\nDIMENSIONS 2 2 2\nPOINTS 1 float\n0 0 0\n", TL_ERR_FORMAT,
         "1 points, expected 8 by the dimensions"},
        {HEAD "DATASET RECTILINEAR_GRID\nDIMENSIONS 2 2 2\nX_COORDINATES 1 float\n0\n",
         TL_ERR_FORMAT, "1 coordinates along x, expected 2"},
        {HEAD
         "DATASET STRUCTURED_GRID\nDIMENSIONS 1 1 1\nPOINTS 1 float\n0 0 0\nBLANKING 2 int\n1 1\n",
         TL_ERR_FORMAT, "BLANKING of 2 points, expected 1"}};
    tl_ctx *ctx = grid_ctx((size_t)8 << 20, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tli_grid grid;
        tl_status st =
            grid_read(ctx, read_legacy, NULL, cases[i].text, strlen(cases[i].text), &grid);
        tli_grid_release(&grid);
        if (st != cases[i].status || !strstr(tl_ctx_message(ctx), cases[i].message))
            fail_msg("case %zu: %s: \"%s\", expected \"%s\"", i, tl_status_name(st),
                     tl_ctx_message(ctx), cases[i].message);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    }
    tl_ctx_destroy(ctx);
}

/* In a binary file the message gives the byte. */
static void names_the_byte_of_a_binary_file(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_grid grid;
    file out = {.byte_count = 0};
    put_text(&out,
             "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 double\n");
    size_t start = out.byte_count;
    for (int i = 0; i < 5; i++) put_f64(&out, i);
    CHECK_STATUS(grid_read(ctx, read_legacy, NULL, out.bytes, out.byte_count, &grid),
                 TL_ERR_FORMAT);
    char expected[64];
    snprintf(expected, sizeof expected, "byte %zu: POINTS: expected 6 values", start);
    CHECK(strstr(tl_ctx_message(ctx), expected));
    CHECK(strstr(tl_ctx_message(ctx), "found 40 bytes"));
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

/* A whole file in memory, at most the size of a corpus file. */
static void load(const char *path, file *out)
{
    FILE *in = fopen(path, "rb");
    if (!in) fail_msg("can't open '%s'", path);
    out->byte_count = fread(out->bytes, 1, sizeof out->bytes, in);
    CHECK(out->byte_count < sizeof out->bytes);
    fclose(in);
}

static void survives_every_prefix_and_byte(void **state)
{
    (void)state;
    static const char *const names[] = {"kinds_51_a",  "kinds_42_b",  "colors_a",    "blanking_a",
                                        "poly_51_b0",  "ugrid_51_b0", "ugrid_42_a0", "sgrid_42_b1",
                                        "image_51_a1", "rect_51_b0"};
    static file original;
    tl_ctx *ctx = grid_ctx((size_t)4 << 20, 1);
    for (size_t f = 0; f < sizeof names / sizeof *names; f++) {
        char path[512];
        snprintf(path, sizeof path, VTK_FOLDER "%s.vtk", names[f]);
        load(path, &original);
        size_t refused =
            grid_survives_damage(ctx, read_legacy, NULL, original.bytes, original.byte_count, 1);
        printf("%s: %zu bytes, %zu of %zu damaged files refused\n", names[f], original.byte_count,
               refused, 3 * original.byte_count);
        CHECK(refused > original.byte_count / 4);
    }
    tl_ctx_destroy(ctx);
}

/* The n-th allocation fails, for n = 1, 2, 3 ... until reading succeeds. */
typedef struct failing {
    uint64_t left;
} failing;

static void *resize_or_fail(void *user, void *block, size_t old_bytes, size_t new_bytes)
{
    failing *plan = user;
    (void)old_bytes;
    if (!new_bytes) {
        free(block);
        return NULL;
    }
    if (plan->left && !--plan->left) return NULL;
    return realloc(block, new_bytes);
}

static void survives_failing_allocations(void **state)
{
    (void)state;
    static const char *const names[] = {"ugrid_51_b0", "poly_42_a0", "rect_51_b0", "blanking_a",
                                        "colors_a"};
    static file original;
    for (size_t f = 0; f < sizeof names / sizeof *names; f++) {
        char path[512];
        snprintf(path, sizeof path, VTK_FOLDER "%s.vtk", names[f]);
        load(path, &original);
        uint64_t n = 0;
        for (bool done = false; !done; n++) {
            failing plan = {0};
            tl_ctx *ctx = NULL;
            tli_grid grid;
            tl_ctx_opts opts = tl_ctx_opts_defaults();
            opts.thread_count = 1;
            opts.resize = resize_or_fail;
            opts.user = &plan;
            CHECK(tl_ctx_create(&opts, &ctx) == TL_OK);
            plan.left = n + 1;
            tl_status st =
                grid_read(ctx, read_legacy, NULL, original.bytes, original.byte_count, &grid);
            done = plan.left > 0;
            if (!done) CHECK_EQ(st, TL_ERR_MEMORY);
            if (done) CHECK_EQ(st, TL_OK);
            tli_grid_release(&grid);
            CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
            tl_ctx_destroy(ctx);
        }
        printf("%s: %u allocations\n", names[f], (unsigned)n - 1);
        CHECK(n > 3);
    }
}

/* ---- real data ---- */

typedef struct real_file {
    const char *name;
    uint64_t points, cells;
    uint32_t point_arrays, cell_arrays;
    const char *array; /* an array of the points, with a range to three digits, or NULL */
    double low, high;
} real_file;

static const real_file real_files[] = {
    {"curvilinear/kitchen.vtk", 11424, 27 * 23 * 16, 20, 0, NULL, 0, 0},
    {"curvilinear/bluntfin.vtk", 40960, 37479, 3, 0, "Density", 0.193, 4.977},
    {"hexmixed/ball_4.vtk", 17217, 16384, 0, 0, NULL, 0, 0},
    {"hexmixed/PentaHexa.vtk", 401, 210, 1, 1, NULL, 0, 0},
    {"hexmixed/hexa.vtk", 12167, 10648, 1, 0, "scalars", 0.75, 17.3},
    {"tet/post.vtk", 2288, 8750, 1, 0, "Pressure", 0.355, 1.641},
    {"tet/CylinderLinear.vtk", 465, 1522, 2, 0, NULL, 0, 0},
    {"tet/CylinderQuadratic.vtk", 2814, 1522, 3, 4, NULL, 0, 0},
    {"vector/carotid.vtk", 167580, 75 * 48 * 44, 2, 0, "vectors", 0, 22.7},
    {"tensor/notch_stress_fixed.vtk", 3537, 2192, 3, 0, NULL, 0, 0},
    {"vtk-formats/mesh_vtk51.vtk", 1331, 1600, 0, 1, NULL, 0, 0},
    {"vtk-formats/tetraMesh.vtk", 55, 160, 1, 0, NULL, 0, 0},
    {"vtk-formats/uGridEx.vtk", 27, 12, 2, 0, NULL, 0, 0},
    {"vtk-formats/VTKCellTypes.vtk", 27, 11, 2, 1, NULL, 0, 0},
    {"vtk-formats/tensors.vtk", 8, 1, 3, 0, NULL, 0, 0},
    {"vtk-formats/HexagonalPrism.vtk", 12, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/PentagonalPrism.vtk", 10, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Hexahedron.vtk", 8, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Voxel.vtk", 8, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Wedge.vtk", 6, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Pyramid.vtk", 5, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Tetra.vtk", 4, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Polygon.vtk", 6, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/PolyLine.vtk", 5, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/PolyVertex.vtk", 6, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Line.vtk", 2, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Pixel.vtk", 4, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Quad.vtk", 4, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Triangle.vtk", 3, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/TriangleStrip.vtk", 10, 1, 0, 0, NULL, 0, 0},
    {"vtk-formats/Vertex.vtk", 1, 1, 0, 0, NULL, 0, 0}};

static void check_real(tl_ctx *ctx, const real_file *file_of, const char *path)
{
    tli_grid grid;
    read_path(ctx, path, &grid);
    printf("%s: %llu points, %llu cells\n", file_of->name, (unsigned long long)grid.point_count,
           (unsigned long long)tli_grid_cell_count(&grid));
    CHECK_EQ(grid.point_count, file_of->points);
    CHECK_EQ(tli_grid_cell_count(&grid), file_of->cells);
    CHECK_EQ(grid.point_array_count, file_of->point_arrays);
    CHECK_EQ(grid.cell_array_count, file_of->cell_arrays);
    if (file_of->array) {
        double range[2];
        grid_range(grid_array(&grid, TL_ON_VERTEX, file_of->array), range);
        CHECK_NEAR(range[0], file_of->low, 0.003 * (file_of->high - file_of->low));
        CHECK_NEAR(range[1], file_of->high, 0.003 * (file_of->high - file_of->low));
    }
    tli_grid_release(&grid);
}

static void reads_real_data(void **state)
{
    (void)state;
    char path[4096];
    if (!data_path(real_files[0].name, path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx(0, 2);
    for (size_t i = 0; i < sizeof real_files / sizeof *real_files; i++) {
        if (!data_path(real_files[i].name, path, sizeof path)) fail_msg("no '%s'", path);
        check_real(ctx, &real_files[i], path);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(reads_each_number_type),
                                       cmocka_unit_test(reads_bits),
                                       cmocka_unit_test(reads_keywords_in_any_case),
                                       cmocka_unit_test(rounds_text_to_its_type),
                                       cmocka_unit_test(reads_attributes_of_all_kinds),
                                       cmocka_unit_test(reads_both_styles_of_cells),
                                       cmocka_unit_test(lists_faces_of_polyhedra),
                                       cmocka_unit_test(reads_what_vtk_writes),
                                       cmocka_unit_test(leaves_strings_out),
                                       cmocka_unit_test(reads_blanking_and_fields_alone),
                                       cmocka_unit_test(names_file_place_and_expectation),
                                       cmocka_unit_test(names_the_byte_of_a_binary_file),
                                       cmocka_unit_test(survives_every_prefix_and_byte),
                                       cmocka_unit_test(survives_failing_allocations),
                                       cmocka_unit_test(reads_real_data)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
