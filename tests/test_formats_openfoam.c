/* OpenFOAM: a case of two cells written here, text and binary, with patches, fields and times; as
 * hexahedra and as polyhedra; decomposed; packed; damaged files; and the real cases. */
#include "check_source.h"
#include "make_text.h"

#include "formats/formats_openfoam.h"

#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

static void head(text *t, const char *class_name, bool binary)
{
    t->count = 0;
    add(t,
        "/* a comment */\nFoamFile\n{\n version 2.0;\n format %s;\n class %s;\n"
        " arch \"LSB;label=32;scalar=64\";\n object x;\n}\n// another { comment\n\n",
        binary ? "binary" : "ascii", class_name);
}

static void add_labels(text *t, bool binary, int count, const int *values)
{
    add(t, "%d\n(", count);
    if (binary) add_bytes(t, values, (size_t)count * sizeof *values);
    for (int i = 0; i < count && !binary; i++) add(t, "%d\n", values[i]);
    add(t, ")\n");
}

static void add_reals(text *t, bool binary, int count, int components, const double *values)
{
    add(t, "%d\n(", count);
    if (binary) add_bytes(t, values, (size_t)(count * components) * sizeof *values);
    for (int i = 0; i < count && !binary; i++) {
        add(t, components > 1 ? "(" : "");
        for (int c = 0; c < components; c++) add(t, "%g ", values[i * components + c]);
        add(t, components > 1 ? ")\n" : "\n");
    }
    add(t, ")\n");
}

static void save(const char *folder, const char *name, const text *t)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    put_file(path, t->bytes, t->count);
}

/* Two unit cubes side by side; point (i, j, k) is i + 3 j + 6 k. */
static const int quads[11][4] = {
    {1, 4, 10, 7},                                                             /* between them */
    {0, 6, 9, 3},  {0, 1, 7, 6}, {3, 9, 10, 4},  {0, 3, 4, 1}, {6, 7, 10, 9},  /* of cell 0 */
    {2, 5, 11, 8}, {1, 2, 8, 7}, {4, 10, 11, 5}, {1, 4, 5, 2}, {7, 8, 11, 10}, /* of cell 1 */
};

/* split: the face between the cells is two triangles, so both are polyhedra. */
static void make_faces(text *t, bool binary, bool split)
{
    int offsets[14] = {0}, points[64], count = 0, used = 0;
    for (int f = split; f < 11; f++) {
        for (int piece = 0; piece < 2 && f == 1 && count < 2; piece++) {
            if (!split) break;
            const int corners[2][3] = {{1, 4, 10}, {1, 10, 7}};
            memcpy(points + used, corners[piece], sizeof corners[piece]);
            offsets[++count] = used += 3;
        }
        memcpy(points + used, quads[f], sizeof quads[f]);
        offsets[++count] = used += 4;
    }
    head(t, binary ? "faceCompactList" : "faceList", binary);
    if (binary) {
        add_labels(t, true, count + 1, offsets);
        add_labels(t, true, used, points);
        return;
    }
    add(t, "%d\n(\n", count);
    for (int f = 0; f < count; f++) {
        add(t, "%d(", offsets[f + 1] - offsets[f]);
        for (int i = offsets[f]; i < offsets[f + 1]; i++) add(t, "%d ", points[i]);
        add(t, ")\n");
    }
    add(t, ")\n");
}

static void make_folders(const char *folder, const char *const *names)
{
    char path[256];
    mkdir(folder, 0777);
    for (; *names; names++) {
        snprintf(path, sizeof path, "%s/%s", folder, *names);
        mkdir(path, 0777);
    }
}

static void write_field(const char *folder, const char *name, bool binary, double scale)
{
    static const double tensor[12] = {1, 2, 3, 4, 5, 6, 11, 12, 13, 14, 15, 16};
    double values[12];
    text t;
    for (int i = 0; i < 12; i++) values[i] = tensor[i] * scale;
    head(&t, "volSymmTensorField", binary);
    add(&t, "dimensions [0 1 -1 0 0 0 0];\ninternalField nonuniform List<symmTensor> \n");
    add_reals(&t, binary, 2, 6, values);
    add(&t, ";\nboundaryField\n{\n wall { type calculated; value $internalField; }\n}\n");
    save(folder, name, &t);
}

/* A case with constant, time 0 and 0.5 (whose points have moved). */
static void write_case(const char *folder, bool binary, bool split)
{
    static const char *const names[] = {"constant",     "constant/polyMesh", "0",      "0.5",
                                        "0.5/polyMesh", "0.5/uniform",       "0.orig", NULL};
    static const int owner[12] = {0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1}, neighbour[2] = {1, 1};
    char path[256];
    double points[36];
    text t;
    make_folders(folder, names);
    for (int moved = 0; moved < 2; moved++) {
        for (int i = 0; i < 12; i++) {
            points[3 * i] = (1 + moved) * (i % 3);
            points[3 * i + 1] = i / 3 % 2;
            points[3 * i + 2] = i / 6;
        }
        head(&t, "vectorField", binary);
        add_reals(&t, binary, 12, 3, points);
        snprintf(path, sizeof path, "%s/%s", folder, moved ? "0.5/polyMesh" : "constant/polyMesh");
        save(path, "points", &t);
    }
    snprintf(path, sizeof path, "%s/constant/polyMesh", folder);
    make_faces(&t, binary, split);
    save(path, "faces", &t);
    head(&t, "labelList", binary);
    add_labels(&t, binary, 11 + split, owner + !split);
    save(path, "owner", &t);
    head(&t, "labelList", binary);
    add_labels(&t, binary, 1 + split, neighbour);
    save(path, "neighbour", &t);
    head(&t, "polyBoundaryMesh", false);
    add(&t,
        "3\n(\n wall { type wall; inGroups List<word> 1(wall); nFaces 9; startFace %d; }\n"
        " none { type patch; nFaces 0; startFace %d; }\n outlet { type patch; nFaces 1; startFace "
        "%d; }\n)\n",
        1 + split, 10 + split, 10 + split);
    save(path, "boundary", &t);
    for (int time = 0; time < 2; time++) {
        snprintf(path, sizeof path, "%s/%s", folder, time ? "0.5" : "0");
        write_field(path, "sigma", binary, 1 + time);
        head(&t, "pointScalarField", binary);
        add(&t, "#include \"other\"\ndimensions [0 0 0 0 0 0 0];\ninternalField uniform %d.5;\n",
            time);
        save(path, "height", &t);
        head(&t, "surfaceScalarField", binary);
        save(path, "phi", &t);
        t.count = 0;
        add(&t, "no file of the case\n");
        save(path, "notes.txt", &t);
    }
}

static void remove_case(const char *folder)
{
    char command[300];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    CHECK_EQ(system(command), 0);
}

static tl_status read_case(tl_ctx *ctx, const char *path, uint64_t step, tli_grid *grid)
{
    tl_read_opts opts = tl_read_opts_defaults();
    tli_source source = {.path = path, .folder = !strstr(path, ".foam")};
    opts.step = step;
    tl_ctx_clear(ctx);
    tli_grid_init(ctx, grid);
    return tli_read_openfoam(ctx, &source, &opts, grid);
}

static void check_case(const tli_grid *grid, bool split, int time)
{
    static const double expected[6] = {1, 4, 6, 2, 5, 3};
    CHECK_EQ(grid->point_count, 12);
    CHECK(grid->xyz[6] == 2 * (1 + time));
    CHECK_EQ(grid->cell_count, 2);
    CHECK(grid->types[0] == (split ? 42 : 12) && grid->types[1] == grid->types[0]);
    CHECK_EQ(grid->label_count, 2);
    CHECK(strcmp(grid->labels[0].name, "wall") == 0 && grid->labels[0].id == 0);
    CHECK_EQ(grid->labels[0].face_count, 9);
    CHECK(strcmp(grid->labels[1].name, "outlet") == 0 && grid->labels[1].id == 2);
    CHECK_EQ(grid->labels[1].face_count, 1);
    CHECK_EQ(grid->labels[1].points[0], 7);
    const double *sigma = grid_array(grid, TL_ON_TET, "sigma")->values;
    for (int c = 0; c < 6; c++) {
        CHECK(sigma[c] == expected[c] * (1 + time));
        CHECK(sigma[6 + c] == (expected[c] + 10) * (1 + time));
    }
    CHECK(grid_array(grid, TL_ON_VERTEX, "height")->values[11] == time + 0.5);
    CHECK_EQ(grid->point_array_count, 1);
    CHECK_EQ(grid->cell_array_count, 1);
    CHECK(grid->time == 0.5 * time);
}

static void cases_of_all_kinds(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int variant = 0; variant < 4; variant++) {
        const bool binary = variant & 1, split = variant & 2;
        write_case("case", binary, split);
        put_file("case/x.foam", "", 0);
        for (int time = 0; time < 2; time++) {
            tli_grid grid;
            tl_mesh *mesh;
            CHECK_OK(ctx, read_case(ctx, time ? "case/x.foam" : "case", (uint64_t)time, &grid));
            grid_check(&grid);
            check_case(&grid, split, time);
            tli_grid_release(&grid);
            tl_read_opts opts = tl_read_opts_defaults();
            opts.step = (uint64_t)time;
            CHECK_OK(ctx, tl_mesh_read(ctx, "case", &opts, &mesh, NULL));
            CHECK_NEAR(volume_of(mesh), 2 * (1 + time), 1e-12);
            tl_mesh_destroy(mesh);
        }
        tli_grid grid;
        CHECK_STATUS(read_case(ctx, "case", 2, &grid), TL_ERR_ARG);
        tli_grid_release(&grid);
        tl_steps steps;
        CHECK_OK(ctx, tl_read_steps(ctx, "case", NULL, &steps));
        CHECK_EQ(steps.count, 2);
        CHECK(steps.times[0] == 0 && steps.times[1] == 0.5);
        CHECK_EQ(steps.mesh, TL_STEPS_MOVING);
        tl_steps_release(ctx, &steps);
        remove_case("case");
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Two whole cases as processors: at the same place, so all points are welded. */
static void decomposed_and_packed(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    tli_grid grid;
    mkdir("parts", 0777);
    write_case("parts/processor0", true, false);
    write_case("parts/processor1", true, true);
    CHECK_OK(ctx, read_case(ctx, "parts", 1, &grid));
    grid_check(&grid);
    CHECK_EQ(grid.cell_count, 4);
    CHECK_EQ(grid.point_count, 24);
    CHECK_EQ(grid.connectivity[grid.offsets[2]], 0); /* the first face of the second piece */
    uint32_t highest = 0;
    for (uint64_t i = 0; i < grid.face_offsets[grid.face_count]; i++)
        if (grid.face_points[i] > highest) highest = grid.face_points[i];
    CHECK_EQ(highest, 11);
    CHECK_EQ(grid.label_count, 2);
    CHECK_EQ(grid.labels[0].face_count, 18);
    CHECK(grid_array(&grid, TL_ON_TET, "sigma")->values[18] == 22);
    tli_grid_release(&grid);
    remove_case("parts");

    write_case("case", false, false);
    gzFile packed = gzopen("case/constant/polyMesh/points.gz", "wb");
    tli_map map;
    CHECK_OK(ctx, tli_map_open(ctx, "case/constant/polyMesh/points", &map));
    CHECK_EQ(gzwrite(packed, map.bytes, (unsigned)map.byte_count), map.byte_count);
    gzclose(packed);
    tli_map_close(ctx, &map);
    remove("case/constant/polyMesh/points");
    CHECK_OK(ctx, read_case(ctx, "case", 0, &grid));
    check_case(&grid, false, 0);
    tli_grid_release(&grid);
    remove("case/constant/polyMesh/points.gz");
    CHECK_STATUS(read_case(ctx, "case", 0, &grid), TL_ERR_IO);
    check_says(ctx, "case/constant/polyMesh/points");
    tli_grid_release(&grid);
    remove_case("case");
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void survives_damage(void **state)
{
    (void)state;
    static const char *const names[] = {"constant/polyMesh/points",   "constant/polyMesh/faces",
                                        "constant/polyMesh/owner",    "constant/polyMesh/neighbour",
                                        "constant/polyMesh/boundary", "0/sigma"};
    for (int binary = 0; binary < 2; binary++) {
        tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
        write_case("case", binary, binary);
        for (size_t n = 0; n < 6; n++) {
            char path[256];
            text whole = {.count = 0}, damaged;
            snprintf(path, sizeof path, "case/%s", names[n]);
            FILE *file = fopen(path, "rb");
            whole.count = fread(whole.bytes, 1, sizeof whole.bytes, file);
            fclose(file);
            size_t refused = 0, tried = 0;
            for (size_t i = 0; i < 3 * whole.count; i += 11, tried++) {
                tli_grid grid;
                damaged = whole;
                if (i % 3 == 0) damaged.count = i / 3;
                if (i % 3 == 1) damaged.bytes[i / 3] = (char)(damaged.bytes[i / 3] ^ 0xff);
                if (i % 3 == 2) damaged.bytes[i / 3] = (char)(damaged.bytes[i / 3] ^ (1 << i % 7));
                put_file(path, damaged.bytes, damaged.count);
                tl_status st = read_case(ctx, "case", 0, &grid);
                if (st)
                    CHECK(tl_ctx_message(ctx)[0] != 0);
                else
                    grid_check(&grid);
                refused += st != TL_OK;
                tli_grid_release(&grid);
                CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
            }
            printf("%s: %zu of %zu damaged files refused\n", names[n], refused, tried);
            CHECK(refused > tried / 8);
            put_file(path, whole.bytes, whole.count);
        }
        tl_ctx_destroy(ctx);
        tl_status st = TL_ERR_BUDGET;
        for (size_t budget = 997; st == TL_ERR_BUDGET; budget += 997) {
            tli_grid grid;
            ctx = grid_ctx(budget, 1);
            st = read_case(ctx, "case", 0, &grid);
            CHECK(st == TL_OK || st == TL_ERR_BUDGET);
            tli_grid_release(&grid);
            CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
            tl_ctx_destroy(ctx);
        }
        remove_case("case");
    }
}

static void refusals_name_the_place(void **state)
{
    (void)state;
    static const struct {
        const char *name, *list, *says;
    } cases[] = {
        {"points", "2\n((0 0 0)(1 x 0))", "expected points, a number"},
        {"points", "4000000000\n((0 0 0))", "4000000000 points need 6 bytes"},
        {"faces", "1(4(0 1 2 12))", "a point 12, expected 0 to 11"},
        {"owner", "11(0 0 0 0 0 0 1 1 1 1 99)", "cell 99 in a mesh of 11 faces"},
        {"owner", "10(0 0 0 0 0 0 1 1 1 1)", "11 faces with 10 owners"},
        {"neighbour", "4000000000{0}", "4000000000 equal cells of faces, expected at most 11"},
        {"neighbour", "12(0 0 0 0 0 0 0 0 0 0 0 0)", "12 cells of 11 faces"},
        {"boundary", "1(a { nFaces 5; startFace 8; })", "patch 'a' has faces 8 on, 5, of 11"},
    };
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        text t;
        tli_grid grid;
        write_case("case", false, false);
        head(&t, "x", false);
        add(&t, "%s\n", cases[i].list);
        save("case/constant/polyMesh", cases[i].name, &t);
        CHECK_STATUS(read_case(ctx, "case", 0, &grid), TL_ERR_FORMAT);
        check_says(ctx, cases[i].says);
        check_says(ctx, "case");
        tli_grid_release(&grid);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        remove_case("case");
    }
    tl_ctx_destroy(ctx);
}

static void real_cases(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint64_t step, points, cells, steps;
        double top; /* of |U| */
    } cases[] = {{"openfoam/cubeflow", 5, 216, 125, 6, 0.115},
                 {"openfoam/cavity/case.foam", 5, 882, 400, 6, 0.8527},
                 {"openfoam/64BitFloats", 0, 12, 2, 1, 2}};
    char path[4096];
    if (!data_path(cases[0].name, path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx(0, 2);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tli_grid grid;
        tl_steps steps;
        double range[2];
        if (!data_path(cases[i].name, path, sizeof path)) fail_msg("no '%s'", path);
        CHECK_OK(ctx, read_case(ctx, path, cases[i].step, &grid));
        CHECK_EQ(grid.point_count, cases[i].points);
        CHECK_EQ(grid.cell_count, cases[i].cells);
        for (uint64_t c = 0; c < grid.cell_count; c++) CHECK_EQ(grid.types[c], 12);
        grid_range(grid_array(&grid, TL_ON_TET, "U"), range);
        CHECK_NEAR(range[1], cases[i].top, 1e-3 * cases[i].top);
        tli_grid_release(&grid);
        CHECK_OK(ctx, tl_read_steps(ctx, path, NULL, &steps));
        CHECK_EQ(steps.count, cases[i].steps);
        tl_steps_release(ctx, &steps);
    }
    tl_ctx_destroy(ctx);
}

/* Zones of cells are regions with names; a cell of two zones has the first. */
static void zones_are_regions(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    for (int binary = 0; binary < 2; binary++) {
        static const int rotor[1] = {1}, all[2] = {1, 0};
        tl_mesh *mesh;
        text t;
        write_case("zoned", binary, false);
        head(&t, "regIOobject", binary);
        add(&t, "3\n(\nrotor\n{\n    type cellZone;\n    cellLabels List<label> ");
        add_labels(&t, binary, 1, rotor);
        add(&t, ";\n}\nempty { type cellZone; cellLabels List<label> 0(); }\n"
                "rest { type cellZone; cellLabels List<label> ");
        add_labels(&t, binary, 2, all);
        add(&t, "; }\n)\n");
        save("zoned/constant/polyMesh", "cellZones", &t);
        CHECK_OK(ctx, tl_mesh_read(ctx, "zoned", NULL, &mesh, NULL));
        CHECK_EQ(tl_mesh_tet_count(mesh), 12);
        for (size_t i = 0; i < 12; i++) CHECK_EQ(tl_mesh_regions(mesh)[i], i < 6 ? 3 : 1);
        CHECK(strcmp(tl_mesh_region_name(mesh, 1), "rotor") == 0);
        CHECK(strcmp(tl_mesh_region_name(mesh, 3), "rest") == 0);
        tl_mesh_destroy(mesh);
        head(&t, "regIOobject", false);
        add(&t, "1(rotor { type cellZone; cellLabels List<label> 1(2); })");
        save("zoned/constant/polyMesh", "cellZones", &t);
        CHECK_STATUS(tl_mesh_read(ctx, "zoned", NULL, &mesh, NULL), TL_ERR_FORMAT);
        check_says(ctx, "cells of a zone 2");
        remove("zoned/constant/polyMesh/cellZones");
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cases_of_all_kinds),      cmocka_unit_test(decomposed_and_packed),
        cmocka_unit_test(survives_damage),         cmocka_unit_test(zones_are_regions),
        cmocka_unit_test(refusals_name_the_place), cmocka_unit_test(real_cases),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
