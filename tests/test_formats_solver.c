/* Files of solvers: Exodus II, CGNS, VTKHDF, XDMF. Real files against the counts that their origin
 * gives, the same data in two homes against each other, and damaged files. */
#include "check_file.h"
#include "check_source.h"

#include <sys/wait.h>
#include <unistd.h>

/* ---- real files ---- */

typedef struct real_file {
    const char *path;
    uint64_t points;
    tl_cell_kind kind; /* one that the file has */
    uint64_t cells;
    size_t tets;
    const char *channel;
    uint32_t components;
    double high; /* of its range, as the list of origins rounds it; 0: not given */
    size_t steps, labels;
    tl_steps_mesh mesh;
    bool hdf5, expat;
} real_file;

static const real_file files[] = {
    {"exodus/disk_out_ref.ex2", 8499, TL_CELL_HEXAHEDRON, 7472, 44832, "V", 3, 22.4, 1, 7, 0, 0, 0},
    {"exodus/mug.e", 3774, TL_CELL_HEXAHEDRON, 1716 + 760, 14856, "aux_elem", 1, 0, 21, 2, 0, 0, 0},
    {"exodus/biplane_rms_pressure_bs.exo", 774, TL_CELL_QUADRATIC_HEXAHEDRON, 28, 225, NULL, 0, 0,
     1, 13, 0, 1, 0},
    {"exodus/biplane_rms_pressure_bs.exo", 774, TL_CELL_SURFACE, 524, 225, NULL, 0, 0, 1, 13, 0, 1,
     0},
    {"exodus/mesh_fs8.exo", 1000, TL_CELL_WEDGE, 336 + 336 + 672, 4032, NULL, 0, 0, 1, 8, 0, 0, 0},
    {"exodus/edgeFaceElem.exii", 12, TL_CELL_HEXAHEDRON, 2, 13, "RHO", 1, 0, 2, 1, 0, 0, 0},
    {"exodus/box-noglom.ex2", 27, TL_CELL_TETRA, 40, 40, "First Cell Array", 1, 0, 1, 0, 0, 0, 0},
    {"exodus/simple-cube-tet4.e", 98, TL_CELL_TETRA, 295, 295, NULL, 0, 0, 1, 2, 0, 0, 0},
    {"exodus/simple-cube-tet10.e", 568, TL_CELL_QUADRATIC_TETRA, 295, 295, NULL, 0, 0, 1, 2, 0, 0,
     0},
    {"exodus/simple-cube-hex8.e", 64, TL_CELL_HEXAHEDRON, 27, 162, NULL, 0, 0, 1, 2, 0, 0, 0},
    {"exodus/simple-cube-hex27.e", 343, TL_CELL_TRIQUADRATIC_HEXAHEDRON, 27, 162, NULL, 0, 0, 1, 2,
     0, 0, 0},
    {"exodus/simple-cube-wedge6.e", 216, TL_CELL_WEDGE, 250, 750, NULL, 0, 0, 1, 2, 0, 0, 0},
    {"exodus/simple-cube-wedge18.e", 1331, TL_CELL_QUADRATIC_WEDGE, 250, 750, NULL, 0, 0, 1, 2, 0,
     0, 0},
    {"exodus/simple-cube-pyramid5.e", 341, TL_CELL_PYRAMID, 750, 1500, NULL, 0, 0, 1, 2, 0, 0, 0},
    {"exodus/simple-cube-pyramid14.e", 2331, TL_CELL_QUADRATIC_PYRAMID, 750, 1500, NULL, 0, 0, 1, 2,
     0, 0, 0},
    {"exodus/simple-cube-multi-element-order1.e", 719, TL_CELL_PYRAMID, 750, 2707, NULL, 0, 0, 1, 2,
     0, 0, 0},
    {"exodus/simple-cube-multi-element-order1.e", 719, TL_CELL_TETRA, 295, 2707, NULL, 0, 0, 1, 2,
     0, 0, 0},
    {"exodus/simple-cube-multi-element-order2.e", 911, TL_CELL_QUADRATIC_TETRA, 295, 457, NULL, 0,
     0, 1, 2, 0, 0, 0},
    {"exodus/block-names.e", 27, TL_CELL_HEXAHEDRON, 8, 48, NULL, 0, 0, 1, 6, 0, 0, 0},
    {"multimaterial/voronoi_hus_hmax_0.02.exo", 6970, TL_CELL_SURFACE, 3486, 0, NULL, 0, 0, 1, 0, 0,
     0, 0},
    {"cgns/HeatingCoil.cgns", 29826 + 4394, TL_CELL_TETRA, 59193 + 17908, 178645, "Velocity", 3,
     0.797, 1, 6, 0, 0, 0},
    {"cgns/HeatingCoil.cgns", 29826 + 4394, TL_CELL_PYRAMID, 558, 178645, NULL, 0, 0, 1, 6, 0, 0,
     0},
    {"cgns/HeatingCoil.cgns", 29826 + 4394, TL_CELL_WEDGE, 33476, 178645, NULL, 0, 0, 1, 6, 0, 0,
     0},
    {"cgns/sqnz_s.adf.cgns", 15228, TL_CELL_HEXAHEDRON, 11264, 56320, "Momentum", 3, 0, 1, 6, 0, 0,
     0},
    {"cgns/sqnz_s.hdf.cgns", 15228, TL_CELL_HEXAHEDRON, 11264, 56320, "Momentum", 3, 0, 1, 6, 0, 1,
     0},
    {"cgns/tut21.cgns", 2106, TL_CELL_HEXAHEDRON, 1584, 9504, "Velocity", 3, 0, 1, 3, 0, 0, 0},
    {"cgns/tut21_hdf5.cgns", 2106, TL_CELL_HEXAHEDRON, 1584, 9504, "Velocity", 3, 0, 1, 3, 0, 1, 0},
    {"cgns/particles_example.cgns", 1114, TL_CELL_POLYHEDRON, 310, 3303, "VELOCITY", 3, 0, 1, 2, 0,
     1, 0},
    {"cgns/bump_3df_unstr.cgns", 54, TL_CELL_HEXAHEDRON, 12, 72, NULL, 0, 0, 1, 6, 0, 0, 0},
    {"cgns/bump_3df_hybrid.cgns", 48, TL_CELL_HEXAHEDRON, 12, 72, NULL, 0, 0, 1, 11, 0, 0, 0},
    {"xdmf-hdf5/can_0.hdf", 6724, TL_CELL_HEXAHEDRON, 4800, 28800, "EQPS", 1, 0, 1, 0, 0, 1, 0},
    {"xdmf-hdf5/can_1.hdf", 6724, TL_CELL_HEXAHEDRON, 4800, 28800, "DISPL", 3, 0, 1, 0, 0, 1, 0},
    {"xdmf-hdf5/can_2.hdf", 6724, TL_CELL_HEXAHEDRON, 4800, 28800, "EQPS", 1, 0, 1, 0, 0, 1, 0},
    {"timevarying/warping_spheres.vtkhdf", 1684, TL_CELL_SURFACE, 3360, 0,
     "SpatioTemporalHarmonics", 1, 0, 100, 0, TL_STEPS_MOVING, 1, 0},
    {"xdmf-hdf5/no_checkpoint.xdmf", 729, TL_CELL_TETRA, 3072, 3072, "f_5", 1, 1, 5, 0,
     TL_STEPS_CHANGING, 1, 1},
    {"xdmf-hdf5/out.xdmf", 4, TL_CELL_SURFACE, 2, 0, "phi", 1, 0, 5, 0, 0, 1, 1},
    {"xdmf-hdf5/mesh.xdmf", 970, TL_CELL_SURFACE, 484, 0, NULL, 0, 0, 1, 0, 0, 0, 1},
};

static bool reads(const char *name)
{
    for (size_t i = 0; tl_format_get(i); i++)
        if (!strcmp(tl_format_get(i)->name, name)) return tl_format_get(i)->reads;
    return false;
}

static void check_file(tl_ctx *ctx, const real_file *f, const char *path)
{
    tl_mesh *mesh;
    tl_read_report report;
    tl_steps steps;
    double range[2];
    CHECK_OK(ctx, tl_mesh_read(ctx, path, NULL, &mesh, &report));
    if (report.points != f->points || report.cells[f->kind] != f->cells ||
        (f->tets && tl_mesh_tet_count(mesh) != f->tets) || tl_mesh_label_count(mesh) != f->labels)
        fail_msg("%s: %llu points, %llu cells, %zu tets, %zu labels", f->path,
                 (unsigned long long)report.points, (unsigned long long)report.cells[f->kind],
                 tl_mesh_tet_count(mesh), tl_mesh_label_count(mesh));
    const tl_channel *channel = f->channel ? tl_mesh_channel_by_name(mesh, f->channel) : NULL;
    if (f->channel && !channel) fail_msg("%s: no channel '%s'", f->path, f->channel);
    if (channel) CHECK_EQ(channel->components, f->components);
    if (f->high != 0) {
        size_t n = channel->on == TL_ON_TET ? tl_mesh_tet_count(mesh) : tl_mesh_vert_count(mesh);
        tl_channel_range(channel, n, range, NULL);
        CHECK_NEAR(range[1], f->high, 0.005 * f->high);
    }
    tl_mesh_destroy(mesh);
    CHECK_OK(ctx, tl_read_steps(ctx, path, NULL, &steps));
    CHECK_EQ(steps.count, f->steps);
    CHECK_EQ(steps.mesh, f->mesh);
    tl_steps_release(ctx, &steps);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
}

static void test_real_files(void **state)
{
    (void)state;
    char path[1024];
    tl_ctx *ctx = grid_ctx(0, 2);
    size_t done = 0;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        if (!data_path(files[i].path, path, sizeof path)) continue;
        if (files[i].hdf5 && !reads("VTKHDF")) continue;
        if (files[i].expat && !reads("XDMF")) continue;
        check_file(ctx, &files[i], path);
        done++;
    }
    tl_ctx_destroy(ctx);
    if (!done) CHECK_SKIP("no data");
}

/* f_5 is 0 .. 1 in the first step and rises by one a step. */
static void test_steps_and_times(void **state)
{
    (void)state;
    char path[1024];
    if (!reads("XDMF") || !reads("VTKHDF")) CHECK_SKIP("built without expat or HDF5");
    if (!data_path("xdmf-hdf5/no_checkpoint.xdmf", path, sizeof path)) CHECK_SKIP("no data");
    tl_ctx *ctx = grid_ctx(0, 1);
    const struct {
        tl_read_opts opts;
        double low;
    } cases[] = {{{.step = 2, .split = 5}, 2},
                 {{.step = TL_STEP_LAST, .split = 5}, 4},
                 {{.has_time = true, .time = 3.2, .split = 5}, 3}};
    for (size_t i = 0; i < 3; i++) {
        tl_read_opts opts = cases[i].opts;
        tl_mesh *mesh;
        double range[2];
        opts.struct_bytes = sizeof opts;
        CHECK_OK(ctx, tl_mesh_read(ctx, path, &opts, &mesh, NULL));
        tl_channel_range(tl_mesh_channel(mesh, 0), tl_mesh_vert_count(mesh), range, NULL);
        CHECK_NEAR(range[0], cases[i].low, 1e-12);
        CHECK_NEAR(range[1], cases[i].low + 1, 1e-12);
        CHECK(tl_mesh_time(mesh) == cases[i].low);
        tl_mesh_destroy(mesh);
    }
    tl_ctx_destroy(ctx);
}

/* The same tree in ADF and in HDF5 gives the same mesh. */
static void test_two_homes(void **state)
{
    (void)state;
    char path[2][1024];
    if (!reads("VTKHDF")) CHECK_SKIP("built without HDF5");
    if (!data_path("cgns/tut21.cgns", path[0], 1024) ||
        !data_path("cgns/tut21_hdf5.cgns", path[1], 1024))
        CHECK_SKIP("no data");
    tl_ctx *ctx = grid_ctx(0, 1);
    tl_mesh *m[2];
    for (int i = 0; i < 2; i++) CHECK_OK(ctx, tl_mesh_read(ctx, path[i], NULL, &m[i], NULL));
    CHECK(!memcmp(tl_mesh_xyz(m[0]), tl_mesh_xyz(m[1]), tl_mesh_vert_count(m[0]) * 24));
    CHECK(!memcmp(tl_mesh_tets(m[0]), tl_mesh_tets(m[1]), tl_mesh_tet_count(m[0]) * 16));
    for (size_t c = 0; c < tl_mesh_channel_count(m[0]); c++) {
        const tl_channel *a = tl_mesh_channel(m[0], c);
        const tl_channel *b = tl_mesh_channel_by_name(m[1], a->name);
        CHECK(b && b->components == a->components);
        CHECK(!memcmp(a->values, b->values, tl_mesh_tet_count(m[0]) * a->components * 8));
    }
    tl_mesh_destroy(m[0]);
    tl_mesh_destroy(m[1]);
    tl_ctx_destroy(ctx);
}

/* Welded, the twelve blocks of the channel hang together. */
static void test_welded_blocks(void **state)
{
    (void)state;
    char path[1024];
    if (!data_path("cgns/sqnz_s.adf.cgns", path, sizeof path)) CHECK_SKIP("no data");
    tl_ctx *ctx = grid_ctx(0, 1);
    tl_read_opts opts = tl_read_opts_defaults();
    tl_mesh *mesh;
    tl_mesh_stats stats;
    opts.weld = true;
    opts.weld_distance = 1e-7;
    CHECK_OK(ctx, tl_mesh_read(ctx, path, &opts, &mesh, NULL));
    CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
    CHECK_EQ(stats.components, 1);
    CHECK_EQ(stats.nonmanifold_faces + stats.nonmanifold_edges, 0);
    CHECK_NEAR(stats.volume, 1.824, 5e-4);
    CHECK(tl_mesh_region_name(mesh, 1) && !strcmp(tl_mesh_region_name(mesh, 1), "dom1_1_1_1"));
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* ---- damaged files that are read here ---- */

static void test_damage(void **state)
{
    (void)state;
    static const struct {
        const char *path;
        source_reader reader;
        size_t step;
    } cases[] = {{"exodus/box-noglom.ex2", tli_read_exodus, 5},
                 {"exodus/edgeFaceElem.exii", tli_read_exodus, 7},
                 {"exodus/simple-cube-hex8.e", tli_read_exodus, 11},
                 {"cgns/bump_3df_hybrid.cgns", tli_read_cgns, 41},
                 {"cgns/tut21.cgns", tli_read_cgns, 977}};
    size_t done = 0, refused = 0;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char path[1024];
        size_t bytes;
        if (!data_path(cases[i].path, path, sizeof path)) continue;
        uint8_t *all = check_file_load(path, &bytes);
        tl_ctx *ctx = grid_ctx((size_t)256 << 20, 1);
        source_case damaged = {"damaged", cases[i].reader, NULL};
        refused += grid_survives_damage(ctx, source_read, &damaged, all, bytes, cases[i].step);
        tl_ctx_destroy(ctx);
        free(all);
        done++;
    }
    if (!done) CHECK_SKIP("no data");
    CHECK(refused > 100);
}

/* ---- damaged files that a library reads ---- */

/* Reads in a child; returns its wait status. */
static int read_in_child(const char *path)
{
    pid_t child = fork();
    CHECK(child >= 0);
    if (child == 0) {
        tl_ctx *ctx = NULL;
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        tl_mesh *mesh = NULL;
        opts.thread_count = 1;
        opts.budget_bytes = (size_t)256 << 20;
        alarm(20);
        if (tl_ctx_create(&opts, &ctx)) _exit(3);
        tl_status st = tl_mesh_read(ctx, path, NULL, &mesh, NULL);
        _exit(st ? (tl_ctx_message(ctx)[0] ? 1 : 2) : 0);
    }
    int status = 0;
    CHECK(waitpid(child, &status, 0) == child);
    return status;
}

/* Truncated at many places and with bytes changed: an error with a message, or a mesh where the
 * change is in values; never the end of the program. */
static void test_damaged_hdf5(void **state)
{
    (void)state;
    static const char *const names[] = {
        "cgns/tut21_hdf5.cgns", "exodus/biplane_rms_pressure_bs.exo", "xdmf-hdf5/can_0.hdf"};
    size_t reading = 0, refused = 0;
    if (!reads("VTKHDF")) CHECK_SKIP("built without HDF5");
    for (size_t n = 0; n < 3; n++) {
        char path[1024];
        size_t bytes;
        uint64_t random = n + 1;
        if (!data_path(names[n], path, sizeof path)) continue;
        uint8_t *all = check_file_load(path, &bytes);
        for (int i = 0; i < 60; i++) {
            size_t at = i < 20 ? (size_t)i * bytes / 20
                               : (size_t)((random = random * 6364136223846793005u + 1) >> 33) %
                                     (i < 50 ? 4096 : bytes);
            uint8_t kept = all[at];
            if (i >= 20) all[at] ^= (uint8_t)(1u << i % 8);
            put_file("damaged.h5", all, i < 20 ? at : bytes);
            all[at] = kept;
            int status = read_in_child("damaged.h5");
            if (!WIFEXITED(status) || WEXITSTATUS(status) > 1)
                fail_msg("%s: damage %d at byte %zu: wait status %d", names[n], i, at, status);
            reading += WEXITSTATUS(status) == 0;
            refused += WEXITSTATUS(status) == 1;
            if (i < 20) CHECK_EQ(WEXITSTATUS(status), 1);
        }
        free(all);
    }
    unlink("damaged.h5");
    if (!(reading + refused)) CHECK_SKIP("no data");
    printf("damaged HDF5 files: %zu refused, %zu read\n", refused, reading);
}

/* ---- XDMF made here ---- */

static void test_xdmf(void **state)
{
    (void)state;
    static const char text[] =
        "<?xml version='1.0'?><!DOCTYPE Xdmf SYSTEM 'Xdmf.dtd' []>\n"
        "<Xdmf Version='2.0'><Domain><Grid GridType='Collection' CollectionType='Temporal'>\n"
        "<Grid><Time Value='1.5'/><Topology TopologyType='Mixed' NumberOfElements='3'>\n"
        "<DataItem Dimensions='28' NumberType='Int'>6 0 1 2 3 5 0 1 2 3\n"
        "16 4 3 0 1 2 3 0 1 3 3 1 2 3 3 2 0 3</DataItem></Topology>\n"
        "<Geometry GeometryType='X_Y_Z'><DataItem Dimensions='4'>0 1 0 0</DataItem>\n"
        "<DataItem Dimensions='4'>0 0 1 0</DataItem><DataItem Dimensions='4'>0 0 0 1</DataItem>\n"
        "</Geometry><Attribute Name='v' AttributeType='Vector' Center='Cell'>\n"
        "<DataItem Dimensions='3 3' Precision='8'>1 2 3 4 5 6 7 8 9</DataItem></Attribute></Grid>\n"
        "<Grid Name='block'><Time Value='2.5'/><Topology TopologyType='3DCoRectMesh'\n"
        "Dimensions='2 3 4'/><Geometry GeometryType='ORIGIN_DXDYDZ'>\n"
        "<DataItem Dimensions='3'>3 2 1</DataItem><DataItem Dimensions='3'>.5 1 2</DataItem>\n"
        "</Geometry><Attribute Name='r' Center='Cell'><DataItem Format='Binary' Seek='2'\n"
        "Endian='Big' NumberType='Int' Precision='2' Dimensions='6'>six.bin</DataItem>\n"
        "</Attribute></Grid></Grid></Domain></Xdmf>\n";
    static const uint8_t six[] = {9, 9, 0, 1, 0, 2, 0, 3, 0, 4, 0, 5, 1, 0};
    if (!reads("XDMF")) CHECK_SKIP("built without expat");
    tl_ctx *ctx = grid_ctx(0, 1);
    tl_read_opts opts = tl_read_opts_defaults();
    tl_mesh *mesh;
    tl_read_report report;
    put_file("made.xdmf", text, sizeof text - 1);
    put_file("six.bin", six, sizeof six);
    CHECK_OK(ctx, tl_mesh_read(ctx, "made.xdmf", &opts, &mesh, &report));
    CHECK_EQ(tl_mesh_tet_count(mesh), 2);
    CHECK_EQ(report.cells[TL_CELL_POLYHEDRON], 1);
    CHECK_EQ(report.cells[TL_CELL_SURFACE], 1);
    CHECK(tl_mesh_time(mesh) == 1.5 && tl_mesh_channel(mesh, 0)->values[5] == 9);
    tl_mesh_destroy(mesh);
    opts.step = 1;
    CHECK_OK(ctx, tl_mesh_read(ctx, "made.xdmf", &opts, &mesh, &report));
    CHECK_EQ(tl_mesh_tet_count(mesh), 30);
    CHECK(tl_mesh_channel(mesh, 0)->values[29] == 256);
    const double *last = tl_mesh_xyz(mesh) + 3 * 23;
    CHECK(last[0] == 1 + 3 * 2 && last[1] == 2 + 2 * 1 && last[2] == 3.5);
    tl_mesh_destroy(mesh);
    for (size_t cut = 0; cut < sizeof text - 1; cut += 13) { /* every prefix is refused */
        put_file("made.xdmf", text, cut);
        CHECK(tl_mesh_read(ctx, "made.xdmf", NULL, &mesh, NULL) != TL_OK);
        CHECK(tl_ctx_message(ctx)[0]);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    }
    tl_ctx_destroy(ctx);
    unlink("made.xdmf");
    unlink("six.bin");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_real_files), cmocka_unit_test(test_steps_and_times),
        cmocka_unit_test(test_two_homes),  cmocka_unit_test(test_welded_blocks),
        cmocka_unit_test(test_damage),     cmocka_unit_test(test_damaged_hdf5),
        cmocka_unit_test(test_xdmf),
    };
    return cmocka_run_group_tests_name("formats_solver", tests, NULL, NULL);
}
