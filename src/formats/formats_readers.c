/* The table of readers: one row a format. To add one: write `tli_read_x(ctx, source, opts, grid)`
 * in a file of its own, declare it in formats_reader.h, tell its bytes or its name here, add a row.
 */
#include "formats/formats_reader.h"

#include <ctype.h>
#include <string.h>

/* ---- VTK ---- */

void tli_vtk_xml_type(const char *head, char type[40])
{
    type[0] = '\0';
    const char *at = strstr(head, "<VTKFile");
    const char *end = at ? strchr(at, '>') : NULL;
    while (at && (at = strstr(at, "type")) && (!end || at < end)) {
        char before = at[-1];
        at += strlen("type");
        while (isspace((unsigned char)*at)) at++;
        if (!isspace((unsigned char)before) || *at != '=') continue;
        at++;
        while (isspace((unsigned char)*at)) at++;
        char quote = *at;
        if (quote != '"' && quote != '\'') continue;
        size_t length = strcspn(++at, quote == '"' ? "\"" : "'");
        if (length >= 40) return;
        memcpy(type, at, length);
        type[length] = '\0';
        return;
    }
}

static tli_match match_xml_type(const tli_source *source, const char *type)
{
    char found[40];
    tli_vtk_xml_type(source->head, found);
    return strcmp(found, type) == 0 ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

static tli_match match_vti(const tli_source *source)
{
    return match_xml_type(source, "ImageData");
}

static tli_match match_vtr(const tli_source *source)
{
    return match_xml_type(source, "RectilinearGrid");
}

static tli_match match_vts(const tli_source *source)
{
    return match_xml_type(source, "StructuredGrid");
}

static tli_match match_vtu(const tli_source *source)
{
    return match_xml_type(source, "UnstructuredGrid");
}

static tl_status read_xml(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                          tli_grid *grid)
{
    (void)opts;
    return tli_read_vtk_xml(ctx, &source->map, source->path, grid);
}

static tli_match match_legacy(const tli_source *source)
{
    static const char start[] = "# vtk datafile version";
    for (size_t i = 0; i < sizeof start - 1; i++)
        if (tolower((unsigned char)source->head[i]) != start[i]) return TLI_MATCH_NO;
    return TLI_MATCH_BYTES;
}

static tl_status read_legacy(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                             tli_grid *grid)
{
    (void)opts;
    return tli_read_vtk_legacy(ctx, &source->map, source->path, grid);
}

/* ---- without marks of their own: formats_read.c asks for them ---- */

static tli_match match_nothing(const tli_source *source)
{
    (void)source;
    return TLI_MATCH_NO;
}

static tl_status read_plot3d(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                             tli_grid *grid)
{
    return tli_read_plot3d(ctx, &source->map, source->path, opts, grid);
}

static tl_status read_raw(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                          tli_grid *grid)
{
    return tli_read_raw(ctx, &source->map, source->path, opts, grid);
}

/* ---- libraries ---- */

#define HDF5_PACKAGE "libhdf5-dev"
#if TETRALOD_WITH_HDF5
#define HDF5_READER(function) function
#else
#define HDF5_READER(function) NULL
#endif

#if TETRALOD_WITH_EXPAT
#define EXPAT_READER(function) function
#else
#define EXPAT_READER(function) NULL
#endif

static tli_match match_xdmf(const tli_source *source)
{
    return strstr(source->head, "<Xdmf") ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

static tli_match match_vtkhdf(const tli_source *source)
{
    bool hdf5 = tli_head_begins(source, "\x89HDF\r\n\x1a\n");
    return hdf5 && tli_source_holds(source, "VTKHDF") ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

/* ---- the table ---- */

const tli_reader tli_readers[] = {
    {{"CGNS",
      "zones of flow solvers with solutions and boundary conditions; that in HDF5 needs HDF5",
      ".cgns", NULL, .reads = true, .series = true},
     tli_match_cgns,
     tli_read_cgns,
     tli_steps_cgns},
    {{"EnSight", "EnSight 6 and Gold, text and C binary, with their time sets", ".case .encas .sos",
      NULL, .reads = true, .series = true},
     tli_match_ensight,
     tli_read_ensight,
     tli_steps_ensight},
    {{"Exodus II", "meshes of Sandia's codes in netCDF; netCDF-4 needs HDF5",
      ".e .exo .exodus .ex2 .exii .gen .g", NULL, .reads = true, .writes = true, .series = true},
     tli_match_exodus,
     tli_read_exodus,
     tli_steps_exodus},
    {{"Gaussian cube", "values on a lattice around a molecule", ".cube .cub", NULL, .reads = true},
     tli_match_cube,
     tli_read_cube,
     NULL},
    {{"Gmsh", "MSH 2.0 to 4.1 with groups, names and values, text and binary", ".msh", NULL,
      .reads = true, .writes = true, .series = true},
     tli_match_gmsh,
     tli_read_gmsh,
     tli_steps_gmsh},
    {{"Inrimage", "volumes of INRIA", ".inr .inr.gz", NULL, .reads = true},
     tli_match_inrimage,
     tli_read_inrimage,
     NULL},
    {{"legacy VTK", "VTK files with a text head, versions 1 to 5.1, text and binary", ".vtk", NULL,
      .reads = true, .writes = true},
     match_legacy,
     read_legacy,
     NULL},
    {{"Medit", "meshes with values beside them (.sol), text and binary", ".mesh .meshb .sol .solb",
      NULL, .reads = true, .writes = true},
     tli_match_medit,
     tli_read_medit,
     NULL},
    {{"MetaImage", "volumes of ITK, in one or two files, text, raw or zlib", ".mha .mhd", NULL,
      .reads = true},
     tli_match_metaimage,
     tli_read_metaimage,
     NULL},
    {{"NIfTI", "volumes of neuroimaging, versions 1 and 2", ".nii .nii.gz .hdr", NULL,
      .reads = true},
     tli_match_nifti,
     tli_read_nifti,
     NULL},
    {{"NRRD", "volumes, in one or two files, text, raw or gzip", ".nrrd .nhdr", NULL,
      .reads = true},
     tli_match_nrrd,
     tli_read_nrrd,
     NULL},
    {{"OpenFOAM",
      "cases: the folder, a .foam file or system/controlDict in it; also decomposed ones", ".foam",
      NULL, .reads = true, .series = true},
     tli_match_openfoam,
     tli_read_openfoam,
     tli_steps_openfoam},
    {{"PLOT3D", "structured grids with a solution (--solution)", ".xyz .q .p3d .bin", NULL,
      .reads = true},
     match_nothing,
     read_plot3d,
     NULL},
    {{"PVD", "VTK XML, steps and parts in files of their own", ".pvd", NULL, .reads = true,
      .series = true},
     tli_match_pvd,
     tli_read_pvd,
     tli_steps_pvd},
    {{"PVTU and its like", "VTK XML, pieces of a partition in files of their own",
      ".pvtu .pvti .pvtr .pvts .vtpd", NULL, .reads = true},
     tli_match_vtkpieces,
     tli_read_vtkpieces,
     NULL},
    {{"raw volume", "values alone, with dimensions given (--raw)", ".raw", NULL, .reads = true},
     match_nothing,
     read_raw,
     NULL},
    {{"SLC", "volumes of VolVis", ".slc", NULL, .reads = true}, tli_match_slc, tli_read_slc, NULL},
    {{"TetGen", "tets of TetGen and Triangle, text and Chaste's binary form", ".node .ele .face",
      NULL, .reads = true, .writes = true},
     tli_match_tetgen,
     tli_read_tetgen,
     NULL},
    {{"VTI", "VTK XML, image data", ".vti", NULL, .reads = true}, match_vti, read_xml, NULL},
    {{"VTKHDF", "grids, images and polygons of VTK in HDF5, in parts and steps", ".vtkhdf .hdf",
      HDF5_PACKAGE, .reads = TETRALOD_WITH_HDF5, .series = true},
     match_vtkhdf,
     HDF5_READER(tli_read_vtkhdf),
     HDF5_READER(tli_steps_vtkhdf)},
    {{"VTM", "VTK XML, blocks in files of their own", ".vtm .vtmb .vtpc", NULL, .reads = true},
     tli_match_vtm,
     tli_read_vtm,
     NULL},
    {{"VTR", "VTK XML, rectilinear grids", ".vtr", NULL, .reads = true}, match_vtr, read_xml, NULL},
    {{"VTS", "VTK XML, structured grids", ".vts", NULL, .reads = true}, match_vts, read_xml, NULL},
    {{"VTU", "VTK XML, unstructured grids", ".vtu", NULL, .reads = true, .writes = true},
     match_vtu,
     read_xml,
     NULL},
    {{"XDMF", "XML with arrays in HDF5, files of bytes or in itself, collections in time and space",
      ".xdmf .xmf", "libexpat1-dev", .reads = TETRALOD_WITH_EXPAT, .series = true},
     match_xdmf,
     EXPAT_READER(tli_read_xdmf),
     EXPAT_READER(tli_steps_xdmf)},
};
const size_t tli_reader_count = sizeof tli_readers / sizeof tli_readers[0];

const tl_format *tl_format_get(size_t index)
{
    return index < tli_reader_count ? &tli_readers[index].format : NULL;
}
