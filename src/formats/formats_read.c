/* The one door in: tells what a file is by its first bytes, then by its name, has its reader fill a
 * grid and turns the grid into tets. Formats that are known but not read here are refused by name.
 */
#include "formats/formats_grid.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

/* Bytes at the start of a file that tell its kind. */
#define HEAD_BYTES 4096

#define READS                                                                                      \
    "this build reads VTU, VTI, VTR, VTS, legacy VTK, PLOT3D and raw volumes (with "               \
    "dimensions given)"

typedef enum file_kind {
    FILE_UNKNOWN = 0,
    FILE_VTK_XML,
    FILE_VTK_LEGACY,
    FILE_FOREIGN /* known, not read */
} file_kind;

/* ---- by the bytes ---- */

typedef struct magic {
    const char *bytes;
    size_t byte_count;
    const char *name; /* of a foreign format */
} magic;
#define MAGIC(text, name)                                                                          \
    {                                                                                              \
        text, sizeof text - 1, name                                                                \
    }

/* Formats that begin with fixed bytes. */
static const magic magics[] = {
    MAGIC("CDF\001", "Exodus II or another netCDF file"),
    MAGIC("CDF\002", "Exodus II or another netCDF file"),
    MAGIC("CDF\005", "Exodus II or another netCDF file"),
    MAGIC("@(#)ADF Database", "CGNS (ADF)"),
    MAGIC("$MeshFormat", "Gmsh MSH"),
    MAGIC("$NOD", "Gmsh MSH 1"),
    MAGIC("MeshVersionFormatted", "Medit mesh"),
    MAGIC("NRRD000", "NRRD"),
    MAGIC("#INRIMAGE", "Inrimage"),
    MAGIC("ply\n", "PLY"),
    MAGIC("ply\r", "PLY"),
    MAGIC("C Binary", "EnSight Gold geometry"),
    MAGIC("#!TDV", "Tecplot binary"),
    MAGIC("\x1f\x8b", "gzip: unpack it first"),
    MAGIC("PK\003\004", "zip: unpack it first"),
    MAGIC("\xfd"
          "7zXZ",
          "xz: unpack it first"),
    MAGIC("BZh", "bzip2: unpack it first"),
    MAGIC("(\xb5/\xfd", "zstd: unpack it first"),
};

/* Text that stands somewhere in the head. */
static const magic words[] = {
    MAGIC("<Xdmf", "XDMF"),
    MAGIC("FoamFile", "OpenFOAM"),
    MAGIC("ObjectType = Image", "MetaImage"),
    MAGIC("type: ensight", "EnSight case"),
    MAGIC("type:\tensight", "EnSight case"),
};

/* Types of <VTKFile type="..."> that are no single data set, or none that holds volume cells. */
static const char *const xml_types_not_read[] = {
    "PUnstructuredGrid",
    "PImageData",
    "PRectilinearGrid",
    "PStructuredGrid",
    "PPolyData",
    "Collection",
    "vtkMultiBlockDataSet",
    "vtkHierarchicalBoxDataSet",
    "vtkOverlappingAMR",
    "HyperTreeGrid",
    "Table",
    "PTable",
    "PolyData",
};

/* Endings of names that mean a format, where the bytes do not tell. */
static const struct {
    const char *ending, *name;
} endings[] = {
    {".cgns", "CGNS"},
    {".exo", "Exodus II"},
    {".ex2", "Exodus II"},
    {".e", "Exodus II"},
    {".exii", "Exodus II"},
    {".vtkhdf", "VTKHDF"},
    {".case", "EnSight case"},
    {".node", "TetGen"},
    {".ele", "TetGen"},
    {".msh", "Gmsh or Fluent MSH"},
    {".mesh", "Medit mesh"},
    {".xdmf", "XDMF"},
    {".xmf", "XDMF"},
    {".foam", "OpenFOAM"},
    {".stl", "STL, a surface"},
    {".obj", "OBJ, a surface"},
    {".inp", "Abaqus or AVS UCD"},
    {".nii", "NIfTI"},
    {".slc", "SLC volume"},
    {".cube", "Gaussian cube"},
    {".mha", "MetaImage"},
    {".mhd", "MetaImage"},
    {".dat", "Tecplot"},
    {".plt", "Tecplot"},
    {".cas", "Fluent case"},
    {".raw", "raw volume without given dimensions"},
    {".tlod", "tetralod model"},
};

static const char *name_by_ending(const char *path)
{
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++)
        if (tli_path_ends(path, endings[i].ending)) return endings[i].name;
    return NULL;
}

/* The type attribute of a VTKFile element, or "" where it can't be seen in the head. */
static void xml_type(const char *head, char type[40])
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

static bool is_legacy_vtk(const char *head)
{
    static const char start[] = "# vtk datafile version";
    for (size_t i = 0; i < sizeof start - 1; i++)
        if (tolower((unsigned char)head[i]) != start[i]) return false;
    return true;
}

/* head: the first bytes, ended by 0; zero bytes among them are blanks, so that words are found. */
static file_kind kind_by_bytes(const char *head, size_t head_bytes, const char *path,
                               const char **foreign)
{
    static char const hdf5[] = "\x89HDF\r\n\x1a\n";
    if (is_legacy_vtk(head)) return FILE_VTK_LEGACY;
    for (size_t i = 0; i < sizeof magics / sizeof magics[0]; i++)
        if (head_bytes >= magics[i].byte_count &&
            memcmp(head, magics[i].bytes, magics[i].byte_count) == 0) {
            *foreign = magics[i].name;
            return FILE_FOREIGN;
        }
    if (head_bytes >= sizeof hdf5 - 1 && memcmp(head, hdf5, sizeof hdf5 - 1) == 0) {
        const char *by_name = name_by_ending(path);
        *foreign = by_name ? by_name : "HDF5 (VTKHDF, CGNS, netCDF-4 and others)";
        return FILE_FOREIGN;
    }
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        if (strstr(head, words[i].bytes)) {
            *foreign = words[i].name;
            return FILE_FOREIGN;
        }
    return strstr(head, "<VTKFile") ? FILE_VTK_XML : FILE_UNKNOWN;
}

static tl_status refuse(tl_ctx *ctx, const char *path, const char *what)
{
    return tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': %s; " READS, path, what);
}

/* ---- readers ---- */

static tl_status read_xml(tl_ctx *ctx, const tli_map *map, const char *path, const char *head,
                          tli_grid *grid)
{
    char type[40], what[80];
    xml_type(head, type);
    for (size_t i = 0; i < sizeof xml_types_not_read / sizeof xml_types_not_read[0]; i++)
        if (strcmp(type, xml_types_not_read[i]) == 0) {
            snprintf(what, sizeof what, "a VTK file of type %s", type);
            return refuse(ctx, path, what);
        }
    return tli_read_vtk_xml(ctx, map, path, grid);
}

/* What begins with no known bytes may be PLOT3D, which has none: its sizes tell. */
static tl_status read_unknown(tl_ctx *ctx, const tli_map *map, const char *path,
                              const tl_read_opts *opts, tli_grid *grid)
{
    static const char *const read_here[] = {".vtu", ".vti", ".vtr", ".vts", ".vtk"};
    if (map->byte_count == 0) return tl_fail(ctx, TL_ERR_FORMAT, "'%s': an empty file", path);
    for (size_t i = 0; i < sizeof read_here / sizeof read_here[0]; i++)
        if (tli_path_ends(path, read_here[i]))
            return tl_fail(ctx, TL_ERR_FORMAT, "'%s': starts with neither %s", path,
                           "'# vtk DataFile Version' nor XML with a VTKFile element");
    const char *foreign = name_by_ending(path);
    if (foreign) return refuse(ctx, path, foreign);
    tl_status st = tli_read_plot3d(ctx, map, path, opts, grid);
    return st ? tl_note(ctx, st, "'%s': tried as PLOT3D, since no other kind is told; " READS, path)
              : TL_OK;
}

static tl_status read_grid(tl_ctx *ctx, const tli_map *map, const char *path,
                           const tl_read_opts *opts, tli_grid *grid)
{
    if (opts->raw_dims[0] || opts->raw_dims[1] || opts->raw_dims[2])
        return tli_read_raw(ctx, map, path, opts, grid);
    char head[HEAD_BYTES + 1];
    size_t head_bytes = map->byte_count < HEAD_BYTES ? (size_t)map->byte_count : HEAD_BYTES;
    for (size_t i = 0; i < head_bytes; i++) head[i] = map->bytes[i] ? (char)map->bytes[i] : ' ';
    head[head_bytes] = '\0';
    const char *foreign = NULL;
    switch (kind_by_bytes(head, head_bytes, path, &foreign)) {
    case FILE_VTK_XML: return read_xml(ctx, map, path, head, grid);
    case FILE_VTK_LEGACY: return tli_read_vtk_legacy(ctx, map, path, grid);
    case FILE_FOREIGN: return refuse(ctx, path, foreign);
    case FILE_UNKNOWN: break;
    }
    return read_unknown(ctx, map, path, opts, grid);
}

tl_status tl_mesh_read(tl_ctx *ctx, const char *path, const tl_read_opts *opts, tl_mesh **mesh,
                       tl_read_report *report)
{
    *mesh = NULL;
    if (report) *report = (tl_read_report){0};
    tl_read_opts filled = tl_read_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_read_opts", opts, &filled, sizeof filled);
    if (st) return st;

    tli_map map;
    st = tli_map_open(ctx, path, &map);
    if (st) return st;
    tli_grid grid;
    tli_grid_init(ctx, &grid);
    st = read_grid(ctx, &map, path, &filled, &grid);
    tli_map_close(ctx, &map);
    if (!st) {
        st = tli_grid_to_mesh(&grid, &filled, mesh, report);
        if (st) tl_note(ctx, st, "while turning '%s' into tets", path);
    }
    tli_grid_release(&grid);
    return st;
}
