/* The door in: what a file is told to be, what is refused by which name, and all real files against
 * the counts that their origin gives. */
#include "check.h"
#include "check_ctx.h"

#include <unistd.h>

#include "tetralod/formats.h"

static void put_file(const char *path, const void *bytes, size_t byte_count)
{
    FILE *file = fopen(path, "wb");
    CHECK(file != NULL);
    CHECK_EQ(fwrite(bytes, 1, byte_count, file), byte_count);
    CHECK_EQ(fclose(file), 0);
}

/* ---- refused by name ---- */

typedef struct foreign {
    const char *path, *bytes;
    size_t byte_count;
    tl_status status;
    const char *says;
} foreign;
#define FOREIGN(path, bytes, status, says)                                                         \
    {                                                                                              \
        path, bytes, sizeof bytes - 1, status, says                                                \
    }

static const foreign foreigns[] = {
    FOREIGN("a.exo", "CDF\002\0\0\0\0", TL_ERR_FORMAT, "netCDF"),
    FOREIGN("a.cgns", "\x89HDF\r\n\x1a\n....", TL_ERR_UNSUPPORTED, "CGNS"),
    FOREIGN("a.hdf", "\x89HDF\r\n\x1a\n....", TL_ERR_UNSUPPORTED, "HDF5"),
    FOREIGN("a.vtkhdf", "\x89HDF\r\n\x1a\n....", TL_ERR_UNSUPPORTED, "VTKHDF"),
    FOREIGN("b.cgns", "@(#)ADF Database Version A02011", TL_ERR_FORMAT, "ADF"),
    FOREIGN("a.msh", "$NOD\n2.2 0 8\n", TL_ERR_UNSUPPORTED, "Gmsh MSH 1"),
    FOREIGN("a.gz", "\x1f\x8b\x08", TL_ERR_FORMAT, "inside a stream"),
    FOREIGN("a.pvtu", "<?xml version='1.0'?>\n<VTKFile byte_order='x' type = 'PPolyData'>",
            TL_ERR_UNSUPPORTED, "PPolyData"),
    FOREIGN("a.vtp", "<VTKFile type=\"PolyData\" version=\"0.1\">", TL_ERR_UNSUPPORTED, "PolyData"),
    FOREIGN("a.raw", "\1\2\3", TL_ERR_UNSUPPORTED, "raw volume without given dimensions"),
    FOREIGN("a.tlod", "\1\2\3", TL_ERR_UNSUPPORTED, "tetralod model"),
    FOREIGN("a.vtu", "no xml at all", TL_ERR_FORMAT, "VTKFile"),
    FOREIGN("a.vtk", "no header", TL_ERR_FORMAT, "# vtk DataFile"),
    FOREIGN("empty.vtu", "", TL_ERR_FORMAT, "empty"),
    FOREIGN("what.ever", "some bytes of no kind", TL_ERR_FORMAT, "tried as PLOT3D"),
};

static void test_foreign_formats_are_named(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(0);
    for (size_t i = 0; i < sizeof foreigns / sizeof foreigns[0]; i++) {
        const foreign *f = &foreigns[i];
        tl_mesh *mesh = (tl_mesh *)&mesh;
        tl_read_report report;
        put_file(f->path, f->bytes, f->byte_count);
        tl_status st = tl_mesh_read(ctx, f->path, NULL, &mesh, &report);
        if (st != f->status || !strstr(tl_ctx_message(ctx), f->says) ||
            !strstr(tl_ctx_message(ctx), f->path))
            fail_msg("%s: %s: %s", f->path, tl_status_name(st), tl_ctx_message(ctx));
        CHECK(mesh == NULL);
        if (f->status == TL_ERR_UNSUPPORTED) CHECK(strstr(tl_ctx_message(ctx), "this build reads"));
        remove(f->path);
    }
    tl_mesh *mesh;
    CHECK_STATUS(tl_mesh_read(ctx, "not-there.vtu", NULL, &mesh, NULL), TL_ERR_IO);
    CHECK(strstr(tl_ctx_message(ctx), "not-there.vtu"));
    CHECK_STATUS(tl_mesh_read(ctx, ".", NULL, &mesh, NULL), TL_ERR_IO);
    tl_read_opts opts = {0};
    CHECK_STATUS(tl_mesh_read(ctx, ".", &opts, &mesh, NULL), TL_ERR_ARG);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- real files ---- */

/* Points and cells as the list of origins gives them, tets as the rules of splitting demand. A cell
 * kind of TL_CELL_KIND_COUNT: of several kinds, not compared. */
typedef struct real_file {
    const char *path;
    uint64_t points;
    tl_cell_kind kind;
    uint64_t cells;
    size_t tets;
    const char *channel; /* a channel that must be there, NULL: none */
    uint32_t components;
    double low, high; /* its range, rounded as in the list; both 0: not given there */
} real_file;

static const real_file real_files[] = {
    {"volume/hydrogen.vti", 262144, TL_CELL_HEXAHEDRON, 250047, 1250235, "probability_density", 1,
     0, 1},
    {"curvilinear/bluntfinxyz.bin", 40960, TL_CELL_HEXAHEDRON, 37479, 187395, NULL, 0, 0, 0},
    {"curvilinear/combxyz.bin", 47025, TL_CELL_HEXAHEDRON, 43008, 215040, NULL, 0, 0, 0},
    {"curvilinear/bluntfin.vtk", 40960, TL_CELL_HEXAHEDRON, 37479, 187395, "Density", 1, 0.193,
     4.977},
    {"curvilinear/kitchen.vtk", 11424, TL_CELL_HEXAHEDRON, 9936, 49680, "velocity", 3, 0, 0},
    {"curvilinear/multi-ascii.xyz", 2304, TL_CELL_HEXAHEDRON, 1694, 8470, NULL, 0, 0, 0},
    {"curvilinear/multi-bin.xyz", 2304, TL_CELL_HEXAHEDRON, 1694, 8470, NULL, 0, 0, 0},
    {"curvilinear/multi-bin-C.xyz", 2304, TL_CELL_HEXAHEDRON, 1694, 8470, NULL, 0, 0, 0},
    {"curvilinear/multicomb_0.vts", 648, TL_CELL_HEXAHEDRON, 440, 2200, "Momentum", 3, 0, 0},
    {"curvilinear/multicomb_1.vts", 864, TL_CELL_HEXAHEDRON, 616, 3080, "Density", 1, 0, 0},
    {"curvilinear/multicomb_2.vts", 972, TL_CELL_HEXAHEDRON, 704, 3520, "StagnationEnergy", 1, 0,
     0},
    {"tet/post.vtk", 2288, TL_CELL_TETRA, 8750, 8750, "Pressure", 1, 0.355, 1.641},
    {"tet/bracket_appended_compressed.vtu", 50000, TL_CELL_TETRA, 206208, 206208, "sj2p", 1, 216,
     119000},
    {"tet/seamount.vtu", 20004, TL_CELL_TETRA, 100450, 100450, "Velocity", 3, 0, 1.27},
    {"tet/annulus_gradation.vtu", 2160, TL_CELL_TETRA, 9600, 9600, "Velocity", 3, 0, 0.78},
    {"tet/2x2x2cube.vtu", 29791, TL_CELL_TETRA, 162000, 162000, "Coordinate", 3, 0, 0},
    {"tet/dataset.vtu", 102578, TL_CELL_QUADRATIC_TETRA, 56786, 56786,
     "Equivalent (von-Mises) Stress (psi)", 1, 0.014, 23.3},
    {"tet/raptorTetra_19409.vtu", 5992, TL_CELL_TETRA, 19409, 19409, NULL, 0, 0, 0},
    {"tet/raptorTetra_8418.vtu", 2996, TL_CELL_TETRA, 8418, 8418, NULL, 0, 0, 0},
    {"tet/CylinderLinear.vtk", 465, TL_CELL_TETRA, 1522, 1522, "velocity", 3, 0, 0},
    {"tet/CylinderQuadratic.vtk", 2814, TL_CELL_QUADRATIC_TETRA, 1522, 1522, "velocity", 3, 0, 0},
    {"tet/monodomain3d_0.vtu", 847, TL_CELL_TETRA, 3600, 3600, "V_000050", 1, 0, 0},
    {"tet/HumanWedgeMesh.ele", 18411, TL_CELL_TETRA, 97200, 97200, NULL, 0, 0, 0},
    {"tet/HumanWedgeMesh.node", 18411, TL_CELL_TETRA, 97200, 97200, NULL, 0, 0, 0},
    {"tet/ellipsoid_15811_elements.node", 3432, TL_CELL_TETRA, 15811, 15811, NULL, 0, 0, 0},
    {"multimaterial/mickey_mesh.ele", 13960, TL_CELL_TETRA, 76344, 76344, NULL, 0, 0, 0},
    {"tet/tinyBoxt.mesh", 11866, TL_CELL_TETRA, 63434, 63434, "solution1", 3, 0, 0.3},
    {"tet/tinyBoxt.sol", 11866, TL_CELL_SURFACE, 5056, 63434, "solution1", 3, 0, 0.3},
    {"tet/hand.mesh", 7234, TL_CELL_TETRA, 29998, 29998, NULL, 0, 0, 0},
    {"tet/hand.mesh", 7234, TL_CELL_SURFACE, 9556, 29998, NULL, 0, 0, 0},
    {"tet/sphere_lowres_TMS_1-0001_Magstim_70mm_Fig8_nii_scalar.msh", 4904, TL_CELL_TETRA, 25937,
     25937, "normE", 1, 0.0079, 2.4},
    {"tet/sphere_lowres_TMS_1-0001_Magstim_70mm_Fig8_nii_scalar.msh", 4904, TL_CELL_SURFACE, 8988,
     25937, NULL, 0, 0, 0},
    {"tet/Armadillo13K.msh", 13230, TL_CELL_TETRA, 54985, 54985, NULL, 0, 0, 0},
    {"gmsh/piece.asc.v22.msh", 3939, TL_CELL_TETRA, 13179, 13179, NULL, 0, 0, 0},
    {"gmsh/piece.asc.v22.msh", 3939, TL_CELL_SURFACE, 6908, 13179, NULL, 0, 0, 0},
    {"gmsh/piece.bin.v22.msh", 3939, TL_CELL_TETRA, 13179, 13179, NULL, 0, 0, 0},
    {"gmsh/piece.asc.v40.msh", 4096, TL_CELL_TETRA, 13676, 13676, NULL, 0, 0, 0},
    {"gmsh/piece.bin.v40.msh", 4916, TL_CELL_TETRA, 12693, 12693, NULL, 0, 0, 0},
    {"gmsh/piece.asc.v41.msh", 4094, TL_CELL_TETRA, 13370, 13370, NULL, 0, 0, 0},
    {"gmsh/piece.bin.v41.msh", 4094, TL_CELL_SURFACE, 7206, 13370, NULL, 0, 0, 0},
    {"gmsh/surfaces_in_3d.asc.v22.msh", 117, TL_CELL_SURFACE, 204, 0, NULL, 0, 0, 0},
    {"gmsh/surfaces_in_3d.bin.v22.msh", 117, TL_CELL_SURFACE, 204, 0, NULL, 0, 0, 0},
    {"gmsh/surfaces_in_3d.asc.v41.msh", 117, TL_CELL_SURFACE, 204, 0, NULL, 0, 0, 0},
    {"gmsh/surfaces_in_3d.bin.v41.msh", 117, TL_CELL_SURFACE, 204, 0, NULL, 0, 0, 0},
    {"gmsh/unstructured_hex.v22.msh", 573, TL_CELL_HEXAHEDRON, 400, 2400, NULL, 0, 0, 0},
    {"volume/neghip.slc", 287496, TL_CELL_HEXAHEDRON, 274625, 1373125, "value", 1, 0, 255},
    {"volume/nut.slc", 164492, TL_CELL_HEXAHEDRON, 155440, 777200, "value", 1, 0, 255},
    {"volume/m4_TotalDensity.cube", 17050, TL_CELL_HEXAHEDRON, 15120, 75600, "value", 1, 0, 0.4928},
    {"multimaterial/mickey.nrrd", 250047, TL_CELL_HEXAHEDRON, 238328, 1191640, "value", 1, 1, 5},
    {"tensor/tensors.inr.gz", 212992, TL_CELL_HEXAHEDRON, 193548, 967740, "value", 6, 0, 0},
    {"tensor/roi_evals.nii.gz", 27000, TL_CELL_HEXAHEDRON, 24389, 121945, "value", 3, 0, 0.01496},
    {"tensor/roi_evecs.nii.gz", 27000, TL_CELL_HEXAHEDRON, 24389, 121945, "value", 9, 1.73, 1.732},
    {"tensor/small_64D.nii", 1000, TL_CELL_HEXAHEDRON, 729, 3645, "value", 65, 0, 0},
    {"ensight/TEST.case", 537, TL_CELL_HEXAHEDRON, 122, 914, "Velocity", 3, 0, 0.03655},
    {"ensight/TEST_bin.case", 537, TL_CELL_POLYHEDRON, 18, 914, "Pressure", 1, 0.12, 0.2546},
    {"ensight/cylinder_Re35.case", 15348, TL_CELL_SURFACE, 14594, 0, "velocity", 3, 0, 49.55},
    {"ensight/elements.case", 112, TL_CELL_SURFACE, 5, 24, "pointTensors", 6, 0, 0},
    {"ensight/elements.case", 112, TL_CELL_QUADRATIC_HEXAHEDRON, 1, 24, "cellTensors", 6, 0, 0},
    {"ensight/elements6.case", 108, TL_CELL_WEDGE, 1, 24, "pointCVectors_i", 3, 0, 0},
    {"ensight/elements.sos", 112, TL_CELL_TETRA, 1, 24, "cellScalars", 1, 8, 15},
    {"hexmixed/fire_ug.vtu", 12323, TL_CELL_HEXAHEDRON, 10462, 62772, "t", 1, 298, 692},
    {"hexmixed/can.vtu", 6724, TL_CELL_HEXAHEDRON, 4800, 28800, "EQPS", 1, 0.02, 2.89},
    {"hexmixed/hexa.vtk", 12167, TL_CELL_HEXAHEDRON, 10648, 63888, "scalars", 1, 0.75, 17.3},
    {"hexmixed/ball_4.vtk", 17217, TL_CELL_HEXAHEDRON, 16384, 98304, NULL, 0, 0, 0},
    {"hexmixed/PentaHexa.vtk", 401, TL_CELL_PRISM, 210, 2028, "scalar2", 1, 0, 0},
    {"vtk-formats/Tetrahedron.vtu", 35, TL_CELL_TETRA, 96, 96, "Polynomial", 1, 0, 0},
    {"vtk-formats/QuadraticTetra.vtu", 189, TL_CELL_QUADRATIC_TETRA, 96, 96, NULL, 0, 0, 0},
    {"vtk-formats/QuadraticPyramid.vtu", 153, TL_CELL_QUADRATIC_PYRAMID, 48, 96, NULL, 0, 0, 0},
    {"vtk-formats/QuadraticWedge.vtu", 93, TL_CELL_QUADRATIC_WEDGE, 16, 48, NULL, 0, 0, 0},
    {"vtk-formats/Wedge.vtu", 27, TL_CELL_WEDGE, 16, 48, NULL, 0, 0, 0},
    {"vtk-formats/Hexahedron.vtu", 26, TL_CELL_HEXAHEDRON, 7, 42, "material", 1, 0, 0},
    {"vtk-formats/TriQuadraticHexahedron.vtu", 117, TL_CELL_TRIQUADRATIC_HEXAHEDRON, 7, 42, NULL, 0,
     0, 0},
    {"vtk-formats/polyhedron2pieces.vtu", 18, TL_CELL_PYRAMID, 2, 16, NULL, 0, 0, 0},
    {"vtk-formats/polyhedron2pieces.vtu", 18, TL_CELL_POLYHEDRON, 2, 16, NULL, 0, 0, 0},
    {"vtk-formats/VTKCellTypes.vtk", 27, TL_CELL_KIND_COUNT, 0, 13, "vectors", 3, 0, 0},
    {"vtk-formats/uGridEx.vtk", 27, TL_CELL_KIND_COUNT, 0, 14, "scalars", 1, 0, 0},
    {"vtk-formats/tetraMesh.vtk", 55, TL_CELL_TETRA, 160, 160, "scalars", 1, 0, 0},
    {"vtk-formats/tensors.vtk", 8, TL_CELL_VOXEL, 1, 6, "tensors1", 9, 0, 0},
    {"vtk-formats/mesh_vtk51.vtk", 1331, TL_CELL_HEXAHEDRON, 1000, 6000, "MaterialID", 1, 0, 0},
    {"vtk-formats/mesh_vtk51.vtk", 1331, TL_CELL_SURFACE, 600, 6000, NULL, 0, 0, 0},
    {"vtk-formats/quad_ascii.vtu", 16, TL_CELL_SURFACE, 9, 0, NULL, 0, 0, 0},
    {"vtk-formats/quad_append_raw.vtu", 16, TL_CELL_SURFACE, 9, 0, NULL, 0, 0, 0},
    {"vtk-formats/quad_append_raw_compress.vtu", 16, TL_CELL_SURFACE, 9, 0, NULL, 0, 0, 0},
    {"vtk-formats/quad_append_b64.vtu", 16, TL_CELL_SURFACE, 9, 0, NULL, 0, 0, 0},
    {"vtk-formats/quad_binary.vtu", 16, TL_CELL_SURFACE, 9, 0, NULL, 0, 0, 0},
    {"vtk-formats/celldata_appended_binary_uncompressed.vtu", 4434, TL_CELL_SURFACE, 3085, 0,
     "levels", 1, 0, 0},
    {"vtk-formats/celldata_inline_binary_compressed.vtu", 4434, TL_CELL_SURFACE, 3085, 0,
     "indicator_amr", 1, 0, 0},
    {"vtk-formats/Tetra.vtk", 4, TL_CELL_TETRA, 1, 1, NULL, 0, 0, 0},
    {"vtk-formats/Voxel.vtk", 8, TL_CELL_VOXEL, 1, 6, NULL, 0, 0, 0},
    {"vtk-formats/Hexahedron.vtk", 8, TL_CELL_HEXAHEDRON, 1, 6, NULL, 0, 0, 0},
    {"vtk-formats/Wedge.vtk", 6, TL_CELL_WEDGE, 1, 3, NULL, 0, 0, 0},
    {"vtk-formats/Pyramid.vtk", 5, TL_CELL_PYRAMID, 1, 2, NULL, 0, 0, 0},
    {"vtk-formats/HexagonalPrism.vtk", 12, TL_CELL_PRISM, 1, 12, NULL, 0, 0, 0},
    {"vtk-formats/PentagonalPrism.vtk", 10, TL_CELL_PRISM, 1, 9, NULL, 0, 0, 0},
    {"vtk-formats/Line.vtk", 2, TL_CELL_LINE, 1, 0, NULL, 0, 0, 0},
    {"vtk-formats/PolyLine.vtk", 5, TL_CELL_LINE, 1, 0, NULL, 0, 0, 0},
    {"vtk-formats/Vertex.vtk", 1, TL_CELL_POINT, 1, 0, NULL, 0, 0, 0},
    {"vtk-formats/PolyVertex.vtk", 6, TL_CELL_POINT, 1, 0, NULL, 0, 0, 0},
    {"vtk-formats/Pixel.vtk", 4, TL_CELL_SURFACE, 1, 0, NULL, 0, 0, 0},
    {"vtk-formats/Polygon.vtk", 6, TL_CELL_SURFACE, 1, 0, NULL, 0, 0, 0},
    {"vtk-formats/Quad.vtk", 4, TL_CELL_SURFACE, 1, 0, NULL, 0, 0, 0},
    {"vtk-formats/Triangle.vtk", 3, TL_CELL_SURFACE, 1, 0, NULL, 0, 0, 0},
    {"vtk-formats/TriangleStrip.vtk", 10, TL_CELL_SURFACE, 1, 0, NULL, 0, 0, 0},
    {"vector/carotid.vtk", 167580, TL_CELL_HEXAHEDRON, 158400, 792000, "scalars", 1, 0, 580},
    {"vector/BuiltInExample1.vti", 33345, TL_CELL_SURFACE, 32768, 0, "Vectors_", 3, 0, 0},
    {"tensor/notch_stress_fixed.vtk", 3537, TL_CELL_HEXAHEDRON, 2188, 12958, "Nodal Stress", 6, 0,
     0},
    {"tensor/notch_stress_fixed.vtk", 3537, TL_CELL_WEDGE, 4, 12958, NULL, 0, 0, 0},
    {"timevarying/viscous-fingers/010_density.vti", 262144, TL_CELL_HEXAHEDRON, 250047, 1250235,
     "ImageFile", 1, 0, 0},
    {"timevarying/wavy/wavy/wavy00.vts", 6400, TL_CELL_SURFACE, 6241, 0, "z", 1, 0, 0},
    {"multimaterial/cth.vtr", 545025, TL_CELL_HEXAHEDRON, 524288, 2621440, "Pressure", 1, 0, 0},
    {"multimaterial/5material-droplet_10.vtu", 491, TL_CELL_SURFACE, 884, 0, "Air::Time", 1, 0, 0},
    {"hexmixed/blood_vessels/T0000000500.pvtu", 48823, TL_CELL_VOXEL, 39353, 235927, "velocity", 3,
     0, 0.362},
    {"timevarying/wavy/wavy.pvd", 6400, TL_CELL_SURFACE, 6241, 0, "z", 1, 0, 0},
    {"hexmixed/blood_vessels/T0000000500/000.vtu", 11047, TL_CELL_VOXEL, 8892, 53352, "velocity", 3,
     0, 0},
    {"hexmixed/blood_vessels/T0000000500/001.vtu", 14341, TL_CELL_VOXEL, 11579, 69474,
     "shearstress", 1, 0, 0},
    {"hexmixed/blood_vessels/T0000000500/002.vtu", 14251, TL_CELL_VOXEL, 11757, 70542, "density", 1,
     0, 0},
    {"hexmixed/blood_vessels/T0000000500/003.vtu", 9184, TL_CELL_VOXEL, 7125, 42750, NULL, 0, 0, 0},
};

static void data_path(char path[1024], const char *name)
{
    const char *folder = getenv("TETRALOD_DATA");
    snprintf(path, 1024, "%s/%s", folder ? folder : TETRALOD_SOURCE_DIR "/../shared/data", name);
}

/* The list rounds; to two or three digits. */
static void check_range(const real_file *f, const tl_mesh *mesh, const tl_channel *channel)
{
    double range[2];
    size_t count = channel->on == TL_ON_TET ? tl_mesh_tet_count(mesh) : tl_mesh_vert_count(mesh);
    if (f->high == 0) return;
    tl_channel_range(channel, count, range, NULL);
    if (f->low != 0) CHECK_NEAR(range[0], f->low, 0.1 * fabs(f->low));
    CHECK_NEAR(range[1], f->high, 0.005 * fabs(f->high));
}

static void check_file(tl_ctx *ctx, const real_file *f)
{
    char path[1024];
    tl_mesh *mesh;
    tl_read_report report;
    data_path(path, f->path);
    CHECK_OK(ctx, tl_mesh_read(ctx, path, NULL, &mesh, &report));
    if (report.points != f->points || tl_mesh_tet_count(mesh) != f->tets ||
        (f->kind < TL_CELL_KIND_COUNT && report.cells[f->kind] != f->cells))
        fail_msg("%s: %llu points, %zu tets, %llu cells of the kind; expected %llu, %zu, %llu",
                 f->path, (unsigned long long)report.points, tl_mesh_tet_count(mesh),
                 (unsigned long long)report.cells[f->kind % TL_CELL_KIND_COUNT],
                 (unsigned long long)f->points, f->tets, (unsigned long long)f->cells);
    CHECK_EQ(tl_mesh_vert_count(mesh), report.points - report.unused_points + report.new_points);
    const tl_channel *channel = f->channel ? tl_mesh_channel_by_name(mesh, f->channel) : NULL;
    if (f->channel && !channel) fail_msg("%s: no channel '%s'", f->path, f->channel);
    if (channel) {
        CHECK_EQ(channel->components, f->components);
        check_range(f, mesh, channel);
    }
    tl_mesh_destroy(mesh);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
}

static void test_real_files(void **state)
{
    (void)state;
    char path[1024];
    data_path(path, real_files[0].path);
    if (access(path, R_OK) != 0) CHECK_SKIP("no data at %s", path);
    tl_ctx *ctx = check_ctx_create(0);
    for (size_t i = 0; i < sizeof real_files / sizeof real_files[0]; i++)
        check_file(ctx, &real_files[i]);
    tl_ctx_destroy(ctx);
}

static void test_raw_volume_and_solution(void **state)
{
    (void)state;
    char path[1024], solution[1024];
    tl_mesh *mesh;
    tl_read_opts opts = tl_read_opts_defaults();
    data_path(path, "volume/neghip_64x64x64_uint8.raw");
    if (access(path, R_OK) != 0) CHECK_SKIP("no data at %s", path);
    tl_ctx *ctx = check_ctx_create(0);
    for (int axis = 0; axis < 3; axis++) opts.raw_dims[axis] = 64;
    CHECK_OK(ctx, tl_mesh_read(ctx, path, &opts, &mesh, NULL));
    CHECK_EQ(tl_mesh_tet_count(mesh), 1250235);
    CHECK_EQ(tl_mesh_channel(mesh, 0)->scalar, TL_U8);
    tl_mesh_destroy(mesh);
    opts = tl_read_opts_defaults();
    data_path(path, "curvilinear/combxyz.bin");
    data_path(solution, "curvilinear/combq.bin");
    opts.solution = solution;
    opts.split = 6;
    CHECK_OK(ctx, tl_mesh_read(ctx, path, &opts, &mesh, NULL));
    CHECK_EQ(tl_mesh_tet_count(mesh), 6 * 43008);
    CHECK(tl_mesh_channel_count(mesh) >= 3);
    double range[2];
    tl_channel_range(tl_mesh_channel(mesh, 0), tl_mesh_vert_count(mesh), range, NULL);
    CHECK_NEAR(range[0], 0.198, 0.0005);
    CHECK_NEAR(range[1], 0.710, 0.0005);
    tl_mesh_destroy(mesh);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_foreign_formats_are_named),
        cmocka_unit_test(test_real_files),
        cmocka_unit_test(test_raw_volume_and_solution),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
