/* tetralod, stage formats: what other programs write, in; what they read, out; mixed cells to tets;
 * synthetic data with known formulas. */
#ifndef TETRALOD_FORMATS_H
#define TETRALOD_FORMATS_H

#include "tetralod/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The last step of a series. */
#define TL_STEP_LAST UINT64_MAX

/* How a file is read, and what is done with values that it marks as missing. */
typedef struct tl_read_opts {
    size_t struct_bytes;  /* size of this struct, set by tl_read_opts_defaults */
    const char *solution; /* PLOT3D: path of the Q file; NULL: none. borrowed */
    uint32_t raw_dims[3]; /* raw volume: points along x, y, z; 0: the file is no raw volume */
    tl_scalar raw_scalar; /* raw volume: type of a value, x fastest; default TL_U8 */
    bool raw_big_endian;  /* default false */
    int split;            /* tets of a structured cell: 5 (by parity, default) or 6 */
    bool
        cell_to_point; /* default false; true: cell data become point data, volume-weighted means */
    bool has_fill_value; /* default false */
    /* a vertex that holds it in any component of any channel is missing, as is one with iblank 0,
     * and the cells of missing vertices are cut away whole, as are cells that hold it themselves
     * (cell arrays but the one of the regions). May be NaN. Of float32 arrays the nearest float32
     * counts too */
    double fill_value;
    bool keep_fill;     /* default false; true: fill values become NaN and their tets stay */
    const char *region; /* name of the cell array that holds the regions; NULL: blocks, zones and
                           entities of the file where it has them, else the first array called
                           region, material or block (any case). borrowed */
    uint64_t step;      /* of a series: the step that is read, 0 (default) .. count - 1 or
                           TL_STEP_LAST. tl_read_steps says which there are */
    bool has_time;      /* default false; true: the step nearest to time, of two the earlier */
    double time;        /* in the unit of the file */
    bool weld;          /* default false; true: points at most weld_distance apart become one, with
                           the values of the first, before cells are split: blocks that were written
                           apart are joined */
    double weld_distance; /* mesh units, >= 0; 0 (default): the same place exactly */
} tl_read_opts;
TL_API tl_read_opts tl_read_opts_defaults(void);

/* Kinds of cells, as read_report counts them. */
typedef enum tl_cell_kind {
    TL_CELL_TETRA = 0,
    TL_CELL_HEXAHEDRON,
    TL_CELL_VOXEL,
    TL_CELL_WEDGE,
    TL_CELL_PYRAMID,
    TL_CELL_QUADRATIC_TETRA,
    TL_CELL_QUADRATIC_HEXAHEDRON,
    TL_CELL_TRIQUADRATIC_HEXAHEDRON,
    TL_CELL_QUADRATIC_WEDGE,
    TL_CELL_QUADRATIC_PYRAMID,
    TL_CELL_POLYHEDRON,
    TL_CELL_PRISM, /* pentagonal and hexagonal prisms */
    TL_CELL_SURFACE,
    TL_CELL_LINE,
    TL_CELL_POINT,
    TL_CELL_OTHER,
    TL_CELL_KIND_COUNT
} tl_cell_kind;
/* "tetra", "hexahedron" ...; never NULL. */
TL_API const char *tl_cell_kind_name(tl_cell_kind kind);

/* What a reader found, dropped and changed. Cells are those of the file; a structured file has one
 * between each eight points. */
typedef struct tl_read_report {
    uint64_t points;                    /* in the file */
    uint64_t cells[TL_CELL_KIND_COUNT]; /* in the file, by kind */
    uint64_t ghost_cells;               /* dropped: vtkGhostType */
    uint64_t blank_cells;               /* cut away: fill value, iblank */
    uint64_t surface_cells;             /* left out: surface, line, point, other cells together, and
                                           polyhedra without faces */
    uint64_t turned;           /* tets whose orientation was negative and is now positive: cells are
                                  turned whole, by the sign of their volume */
    uint64_t inverted;         /* tets that stay negative: parts of folded cells */
    uint64_t degenerate;       /* tets that are exactly flat */
    uint64_t unused_points;    /* points that no tet uses; left out */
    uint64_t nonfinite_values; /* channel values that are NaN or infinite */
    uint64_t open_cells;       /* polyhedra whose faces do not close; left out */
    uint64_t new_points;       /* vertices in the middle of polyhedra that no corner splits */
    uint64_t closed_cells;     /* polyhedra with holes of some edges, each of which got a face */
} tl_read_report;

/* Reads any known file as tets; the kind is told by the bytes, then by the name. Everything that is
 * dropped or changed is counted in report (may be NULL) and said through the log at level info.
 * A file without volume cells gives a mesh of 0 tets that keeps its points and channels.
 * opts may be NULL (defaults). Gives *mesh; on failure it is NULL. Runs on the pool. TL_ERR_IO;
 * TL_ERR_FORMAT and TL_ERR_UNSUPPORTED name the place in the file; TL_ERR_ARG for options out of
 * range, TL_ERR_DATA for a region array that is not there or holds no ids, TL_ERR_CANCELLED. */
TL_API tl_status tl_mesh_read(tl_ctx *ctx, const char *path, const tl_read_opts *opts,
                              tl_mesh **mesh, tl_read_report *report);

/* What happens to the mesh of a series from step to step. */
typedef enum tl_steps_mesh {
    TL_STEPS_STATIC = 0, /* the same points and cells in all steps */
    TL_STEPS_MOVING,     /* the same cells, other positions */
    TL_STEPS_CHANGING    /* other cells, or not known */
} tl_steps_mesh;

/* The steps of a series. A file without steps has one. */
typedef struct tl_steps {
    size_t count;  /* at least 1 */
    double *times; /* [count] in the unit of the file, NaN where it has none; a block of
                      tl_mem_alloc */
    tl_steps_mesh mesh;
} tl_steps;

/* One step of a series: a file, and which of its steps. */
typedef struct tl_step {
    const char *path; /* borrowed */
    uint64_t step;    /* as in tl_read_opts */
    uint32_t number;  /* what it is called where it is kept; steps ascend by it */
} tl_step;

/* Lists the steps of a file without reading its values. opts may be NULL; raw_dims and solution
 * matter only. Gives *steps, which tl_steps_release frees; empty on failure. Statuses as of
 * tl_mesh_read. */
TL_API tl_status tl_read_steps(tl_ctx *ctx, const char *path, const tl_read_opts *opts,
                               tl_steps *steps);
/* Frees what tl_read_steps gave, with the same context. An empty one is allowed. */
TL_API void tl_steps_release(tl_ctx *ctx, tl_steps *steps);

/* All steps that belong to a path: those of the file, or, where it has one alone, files beside it
 * whose names differ in the number right before the ending ("flow_0012.vtu"): set off by one of
 * "_-. ", or with zeros before it. Parts that a .pvtu or .vtm beside them names are no steps. */
typedef struct tl_series {
    tl_step *steps; /* [count] by number: the place in the file, or the number in the name */
    double *times;  /* [count] in the unit of the file, NaN where it has none */
    size_t count;   /* at least 1 */
    size_t own;     /* place of the step that the path itself stands for */
    tl_steps_mesh mesh;
    bool is_files; /* a file a step; files but that of the path have not been looked at */
} tl_series;
/* opts as of tl_read_steps, and its statuses. Gives *series, which tl_series_release frees; empty
 * on failure. */
TL_API tl_status tl_series_find(tl_ctx *ctx, const char *path, const tl_read_opts *opts,
                                tl_series *series);
/* With the same context. An empty one is allowed. */
TL_API void tl_series_release(tl_ctx *ctx, tl_series *series);

/* A format this library knows. All strings live as long as the library. */
typedef struct tl_format {
    const char *name;    /* "Exodus II" */
    const char *about;   /* one line */
    const char *endings; /* usual endings of names, ".exo .e", "" when there are none */
    const char *package; /* Debian package of the library it needs, NULL if it needs none */
    bool reads, writes;  /* in this build */
    bool series;         /* a file can hold several steps */
} tl_format;

/* Format index of the list of all, by name; NULL past the last. */
TL_API const tl_format *tl_format_get(size_t index);

/* How a mesh is written. */
typedef struct tl_write_opts {
    size_t struct_bytes; /* size of this struct, set by tl_write_opts_defaults */
    bool zlib;           /* VTU: compress with zlib; default false. Smaller and slower */
    bool ascii;          /* legacy VTK and VTU: text; default false */
} tl_write_opts;
TL_API tl_write_opts tl_write_opts_defaults(void);

/* Writes a mesh; the ending of the name says as what: .vtu, .vtk, .msh (Gmsh 2.2), .mesh (Medit,
 * with the channels in a .sol beside it), .exo .exodus .ex2 .exii .gen .e .g (Exodus II) or .node
 * and .ele (TetGen, both and a .face are written). VTU and VTK: positions and values are written in
 * the narrowest type that loses nothing (positions: float32 or float64; channels: their own type if
 * all values fit, else float64). What a format can't hold is left out and said through the log.
 * Files appear only when complete. opts may be NULL. TL_ERR_ARG for an unknown ending, zlib beside
 * ascii or for another than .vtu, or ascii for Exodus; TL_ERR_IO, TL_ERR_UNSUPPORTED (legacy VTK of
 * 2^31 points or 2^29 tets, Gmsh of 2^31 points or elements, Exodus of more than 65,536 regions or
 * ids of more than 31 bits), TL_ERR_CANCELLED. Runs on the pool. */
TL_API tl_status tl_mesh_write(tl_ctx *ctx, const tl_mesh *mesh, const char *path,
                               const tl_write_opts *opts);

/* Writes a collection (.pvd) that names the files of a series: files [count], relative to the
 * folder of path, times [count] (NaN: the number of the step). TL_ERR_ARG if path does not end in
 * .pvd; TL_ERR_IO. */
TL_API tl_status tl_series_write(tl_ctx *ctx, const char *path, const char *const *files,
                                 const double *times, size_t count);

/* Writes points, lines or triangles; the ending of the name says as what: .ply (binary), .vtp
 * (VTK), .stl (binary, triangles alone), .obj (text) or .glb (binary glTF 2.0). Positions are
 * float32 where that moves none by more than 1e-6 of the diagonal, else float64; .stl has float32
 * alone, .glb float32 around the middle, and 0 for what is not finite. Channels go into .ply, .vtp
 * and, of up to four components, .glb (as _NAME); normals into all but .stl. What a format can't
 * hold is left out and said through the log. The file appears only when complete. TL_ERR_ARG for an
 * unknown ending, TL_ERR_IO, TL_ERR_UNSUPPORTED for what a format has no place for: lines in .stl,
 * counts past 32 bits. */
TL_API tl_status tl_polydata_write(tl_ctx *ctx, const tl_polydata *polydata, const char *path);
/* True if tl_polydata_write knows the ending of path and its kind of file has a place for cells of
 * that kind. */
TL_API bool tl_polydata_writes(tl_poly_kind kind, const char *path);

/* ---- synthetic data ---- */

/* Name of sample index, NULL past the last one; one-line description of a sample, NULL for an
 * unknown name. Both live as long as the library. */
TL_API const char *tl_sample_name(size_t index);
TL_API const char *tl_sample_about(const char *name);

/* Streams a sample to a .vtu file, in memory that does not grow with its size.
 * size: vertices along each side of a grid, 2 to 32,768, or the nearest equal; 0 takes the sample's
 * default. Runs on the pool. TL_ERR_ARG for an unknown name, a size out of range or a name that
 * does not end in .vtu; TL_ERR_IO, TL_ERR_CANCELLED. */
TL_API tl_status tl_sample_write(tl_ctx *ctx, const char *name, uint32_t size, const char *path);

/* The exact values of a sample at x: values [tl_sample_components(name)], all channels one after
 * the other in the order of the file, for x of the sample's domain. TL_ERR_ARG for an unknown name,
 * of which tl_sample_components is 0. */
TL_API size_t tl_sample_components(const char *name);
TL_API tl_status tl_sample_value(tl_ctx *ctx, const char *name, const double x[3], double *values);

#ifdef __cplusplus
}
#endif
#endif
