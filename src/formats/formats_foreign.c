/* Formats that are known by their bytes or names and not read here: refused by name. What a reader
 * of formats_readers.c takes never gets here. */
#include "formats/formats_reader.h"

#include <string.h>

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
    MAGIC("\x89HDF\r\n\x1a\n", "an HDF5 file that is neither VTKHDF, CGNS nor netCDF-4"),
    MAGIC("@(#)ADF Database", "CGNS (ADF)"),
    MAGIC("$NOD", "Gmsh MSH 1"),
    MAGIC("ply\n", "PLY"),
    MAGIC("ply\r", "PLY"),
    MAGIC("C Binary", "EnSight Gold geometry"),
    MAGIC("#!TDV", "Tecplot binary"),
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
    MAGIC("FoamFile", "a file of an OpenFOAM case: name the folder of the case"),
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
    {".msh", "Fluent MSH, or another that does not begin with $MeshFormat"},
    {".xdmf", "XDMF"},
    {".xmf", "XDMF"},
    {".stl", "STL, a surface"},
    {".obj", "OBJ, a surface"},
    {".inp", "Abaqus or AVS UCD"},
    {".avs", "AVS UCD"},
    {".bdf", "Nastran"},
    {".fem", "Nastran"},
    {".nas", "Nastran"},
    {".su2", "SU2"},
    {".vol", "Netgen"},
    {".med", "MED"},
    {".h5m", "MOAB"},
    {".dat", "Tecplot"},
    {".plt", "Tecplot"},
    {".cas", "Fluent case"},
    {".raw", "raw volume without given dimensions"},
    {".tlod", "tetralod model"},
};

/* Types of <VTKFile type="..."> that are no single data set, or none that holds volume cells. */
#define XML_TYPE(type)                                                                             \
    {                                                                                              \
        type, "a VTK file of type " type                                                           \
    }
static const struct {
    const char *type, *name;
} xml_types[] = {
    XML_TYPE("PPolyData"),
    XML_TYPE("vtkHierarchicalBoxDataSet"),
    XML_TYPE("vtkOverlappingAMR"),
    XML_TYPE("HyperTreeGrid"),
    XML_TYPE("Table"),
    XML_TYPE("PTable"),
    XML_TYPE("PolyData"),
};

const char *tli_foreign_by_bytes(const tli_source *source)
{
    const char *head = source->head;
    for (size_t i = 0; i < sizeof magics / sizeof magics[0]; i++)
        if (source->head_bytes >= magics[i].byte_count &&
            memcmp(head, magics[i].bytes, magics[i].byte_count) == 0)
            return magics[i].name;
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        if (strstr(head, words[i].bytes)) return words[i].name;
    char type[40];
    tli_vtk_xml_type(head, type);
    for (size_t i = 0; i < sizeof xml_types / sizeof xml_types[0]; i++)
        if (strcmp(type, xml_types[i].type) == 0) return xml_types[i].name;
    return NULL;
}

const char *tli_foreign_by_name(const char *path)
{
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++)
        if (tli_path_ends(path, endings[i].ending)) return endings[i].name;
    return NULL;
}
