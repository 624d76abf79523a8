/* Files that name others: pieces that become one mesh, steps, parts and blocks as regions with
 * names, surfaces among them, files that are not there or name themselves. */
#include "check_source.h"

static void save(const char *path, const char *text)
{
    put_file(path, text, strlen(text));
}

/* One tet on the triangle z = 0, with its apex up or down, and a value. */
static void save_tet(const char *path, double apex, double value)
{
    char text[1200];
    snprintf(
        text, sizeof text,
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">"
        "<UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">"
        "<PointData><DataArray type=\"Float64\" Name=\"p\" format=\"ascii\">%g 1 2 3</DataArray>"
        "</PointData><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
        "format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 %g</DataArray></Points>"
        "<Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3"
        "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>"
        "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells>"
        "</Piece></UnstructuredGrid></VTKFile>",
        value, apex);
    save(path, text);
}

static const char pieces[] =
    "<VTKFile type=\"PUnstructuredGrid\" version=\"0.1\">"
    "<PUnstructuredGrid GhostLevel=\"0\"><PPoints/><Piece Source=\"a.vtu\"/>"
    "<Piece Source=\"b.vtu\"></Piece></PUnstructuredGrid></VTKFile>";
static const char series[] = "<VTKFile type=\"Collection\" version=\"0.1\"><Collection>"
                             "<DataSet timestep=\"2.5\" part=\"0\" file=\"b.vtu\"/>"
                             "<DataSet timestep=\"0.5\" part=\"0\" file=\"a.vtu\"/>"
                             "<DataSet timestep=\"2.5\" part=\"1\" name=\"second\" file=\"a.vtu\"/>"
                             "</Collection></VTKFile>";
static const char blocks[] =
    "<VTKFile type=\"vtkMultiBlockDataSet\" version=\"1.0\"><vtkMultiBlockDataSet>"
    "<Block index=\"0\" name=\"fluid &amp; more\"><DataSet index=\"0\" file=\"a.vtu\"/>"
    "<DataSet index=\"1\" name=\"wall\" file=\"s.vtp\"/><DataSet index=\"2\"/></Block>"
    "<DataSet index=\"1\" name=\"solid\" file=\"b.vtu\"/>"
    "</vtkMultiBlockDataSet></VTKFile>";

static const char collection[] =
    "<VTKFile type=\"vtkPartitionedDataSetCollection\" version=\"1.0\">"
    "<vtkPartitionedDataSetCollection><Partitions index=\"0\"/><Partitions index=\"1\" "
    "name=\"core\">"
    "<DataSet index=\"0\" file=\"a.vtu\"/><DataSet index=\"1\" file=\"b.vtu\"/></Partitions>"
    "<Partitions index=\"2\" name=\"shell\"><DataSet index=\"0\" file=\"b.vtu\"/></Partitions>"
    "</vtkPartitionedDataSetCollection></VTKFile>";
static const char partitions[] =
    "<VTKFile type=\"vtkPartitionedDataSet\" version=\"1.0\"><vtkPartitionedDataSet>"
    "<DataSet index=\"0\" file=\"a.vtu\"/><DataSet index=\"1\" file=\"b.vtu\"/>"
    "</vtkPartitionedDataSet></VTKFile>";

static void save_files(void)
{
    save_tet("a.vtu", 1, 10);
    save_tet("b.vtu", -1, 20);
    save("s.vtp", "<VTKFile type=\"PolyData\" version=\"0.1\"></VTKFile>");
    save("x.pvtu", pieces);
    save("x.pvd", series);
    save("x.vtm", blocks);
    save("x.vtpc", collection);
    save("x.vtpd", partitions);
}

static void remove_files(void)
{
    static const char *const names[] = {"a.vtu", "b.vtu", "s.vtp",  "x.pvtu",
                                        "x.pvd", "x.vtm", "x.vtpc", "x.vtpd"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) remove(names[i]);
}

static void pieces_are_one_mesh(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    tl_mesh *mesh;
    tl_read_report report;
    save_files();
    CHECK_OK(ctx, tl_mesh_read(ctx, "x.pvtu", NULL, &mesh, &report));
    CHECK_EQ(tl_mesh_tet_count(mesh), 2);
    CHECK_EQ(tl_mesh_vert_count(mesh), 5);
    CHECK_EQ(report.points, 8);
    CHECK_EQ(report.unused_points, 3);
    CHECK(!tl_mesh_regions(mesh));
    CHECK(tl_mesh_channel_by_name(mesh, "p")->values[0] == 10); /* of the first */
    tl_mesh_destroy(mesh);
    remove_files();
    tl_ctx_destroy(ctx);
}

static void series_of_parts(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    tl_read_opts opts = tl_read_opts_defaults();
    tl_mesh *mesh;
    tl_steps steps;
    save_files();
    CHECK_OK(ctx, tl_read_steps(ctx, "x.pvd", NULL, &steps));
    CHECK_EQ(steps.count, 2);
    CHECK(steps.times[0] == 0.5 && steps.times[1] == 2.5);
    tl_steps_release(ctx, &steps);
    CHECK_OK(ctx, tl_mesh_read(ctx, "x.pvd", &opts, &mesh, NULL));
    CHECK_EQ(tl_mesh_tet_count(mesh), 1);
    CHECK(tl_mesh_time(mesh) == 0.5 && !tl_mesh_regions(mesh));
    tl_mesh_destroy(mesh);
    opts.has_time = true;
    opts.time = 9;
    CHECK_OK(ctx, tl_mesh_read(ctx, "x.pvd", &opts, &mesh, NULL));
    CHECK_EQ(tl_mesh_tet_count(mesh), 2);
    CHECK_EQ(tl_mesh_vert_count(mesh), 8);
    CHECK(tl_mesh_time(mesh) == 2.5);
    CHECK(tl_mesh_regions(mesh)[0] == 0 && tl_mesh_regions(mesh)[1] == 1);
    CHECK(strcmp(tl_mesh_region_name(mesh, 1), "second") == 0);
    tl_mesh_destroy(mesh);
    opts.has_time = false;
    opts.step = 2;
    CHECK_STATUS(tl_mesh_read(ctx, "x.pvd", &opts, &mesh, NULL), TL_ERR_ARG);
    remove_files();
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void blocks_with_names(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    tl_mesh *mesh;
    save_files();
    CHECK_OK(ctx, tl_mesh_read(ctx, "x.vtm", NULL, &mesh, NULL));
    CHECK_EQ(tl_mesh_tet_count(mesh), 2);
    CHECK(tl_mesh_regions(mesh)[0] == 0 && tl_mesh_regions(mesh)[1] == 2);
    CHECK(strcmp(tl_mesh_region_name(mesh, 0), "fluid & more") == 0);
    CHECK(strcmp(tl_mesh_region_name(mesh, 2), "solid") == 0);
    tl_mesh_destroy(mesh);
    remove("b.vtu");
    CHECK_STATUS(tl_mesh_read(ctx, "x.vtm", NULL, &mesh, NULL), TL_ERR_IO);
    check_says(ctx, "b.vtu");
    check_says(ctx, "named by 'x.vtm'");
    save("x.pvd",
         "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"x.pvd\"/>"
         "</Collection></VTKFile>");
    CHECK_STATUS(tl_mesh_read(ctx, "x.pvd", NULL, &mesh, NULL), TL_ERR_FORMAT);
    check_says(ctx, "chain");
    save("x.vtm", "<VTKFile type=\"vtkMultiBlockDataSet\"><DataSet file=\"s.vtp\"/>"
                  "<DataSet file=\"s.vtp\"/></VTKFile>");
    CHECK_STATUS(tl_mesh_read(ctx, "x.vtm", NULL, &mesh, NULL), TL_ERR_UNSUPPORTED);
    check_says(ctx, "none of the 2 files");
    remove_files();
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Pieces in a row are one region; those of one data set are one mesh. */
static void partitions_in_rows(void **state)
{
    (void)state;
    static const int32_t regions[3] = {0, 0, 1};
    tl_ctx *ctx = grid_ctx(0, 1);
    tl_mesh *mesh;
    save_files();
    CHECK_OK(ctx, tl_mesh_read(ctx, "x.vtpc", NULL, &mesh, NULL));
    CHECK_EQ(tl_mesh_tet_count(mesh), 3);
    CHECK(memcmp(tl_mesh_regions(mesh), regions, sizeof regions) == 0);
    CHECK(strcmp(tl_mesh_region_name(mesh, 0), "core") == 0);
    CHECK(strcmp(tl_mesh_region_name(mesh, 1), "shell") == 0);
    tl_mesh_destroy(mesh);
    CHECK_OK(ctx, tl_mesh_read(ctx, "x.vtpd", NULL, &mesh, NULL));
    CHECK_EQ(tl_mesh_tet_count(mesh), 2);
    CHECK_EQ(tl_mesh_vert_count(mesh), 5); /* the triangle between them is there once */
    CHECK(!tl_mesh_regions(mesh));
    tl_mesh_destroy(mesh);
    remove_files();
    tl_ctx_destroy(ctx);
}

static void survives_damage(void **state)
{
    (void)state;
    const struct {
        source_case c;
        const char *text;
    } files[] = {{{"x.pvtu", tli_read_vtkpieces, NULL}, pieces},
                 {{"x.pvd", tli_read_pvd, NULL}, series},
                 {{"x.vtm", tli_read_vtm, NULL}, blocks},
                 {{"x.vtpc", tli_read_vtm, NULL}, collection},
                 {{"x.vtpd", tli_read_vtkpieces, NULL}, partitions}};
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    save_files();
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        source_case c = files[i].c;
        size_t count = strlen(files[i].text);
        size_t refused =
            grid_survives_damage(ctx, source_read, &c, (const uint8_t *)files[i].text, count, 1);
        printf("%s: %zu of %zu damaged files refused\n", c.path, refused, 3 * count);
        CHECK(refused > 0);
        source_survives_budgets(&c, files[i].text, count, 997);
    }
    remove_files();
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pieces_are_one_mesh), cmocka_unit_test(series_of_parts),
        cmocka_unit_test(blocks_with_names),   cmocka_unit_test(partitions_in_rows),
        cmocka_unit_test(survives_damage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
