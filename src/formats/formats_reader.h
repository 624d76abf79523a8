/* Stage formats, internal: the table of readers. A format is a row of formats_readers.c: what it is
 * called, how it is recognised, who fills the grid and who lists the steps. A reader that needs a
 * library stands in files of its own, which are compiled only where the library was found; its row
 * stays and names the package. */
#ifndef TETRALOD_SRC_FORMATS_READER_H
#define TETRALOD_SRC_FORMATS_READER_H

#include "formats/formats_grid.h"

/* Bytes at the start of a file that tell its kind. */
#define TLI_HEAD_BYTES 4096
/* Files that name files that name files ...: a collection may be nested that deep. */
#define TLI_SOURCE_DEPTH_MAX 8

/* What is read: a file or a folder. */
typedef struct tli_source {
    const char *path;
    bool folder;
    unsigned depth;                /* 0: named by the user, else by a collection */
    tli_map map;                   /* the whole file; empty for a folder */
    char head[TLI_HEAD_BYTES + 1]; /* its first bytes, zero bytes as blanks, ended by 0 */
    size_t head_bytes;
} tli_source;

/* How sure a reader is that a source is its own. */
typedef enum tli_match {
    TLI_MATCH_NO = 0,
    TLI_MATCH_NAME, /* the name says so, the bytes say nothing */
    TLI_MATCH_BYTES /* the bytes say so */
} tli_match;

typedef tli_match tli_match_fn(const tli_source *source);
/* Fills an empty grid; on failure the caller releases it. The step is the reader's to choose, with
 * tli_steps_pick, if it has steps. */
typedef tl_status tli_read_fn(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                              tli_grid *grid);
/* Fills *steps (empty before; the caller releases it, on failure too). */
typedef tl_status tli_steps_fn(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                               tl_steps *steps);

typedef struct tli_reader {
    tl_format format;
    tli_match_fn *match;
    tli_read_fn *read; /* NULL: not read in this build; the source is then refused with the name of
                          the package */
    tli_steps_fn *steps; /* NULL: there is always one step */
} tli_reader;

/* [tli_reader_count], in the alphabetical order of their names. The best match wins, among equals
 * the first. */
extern const tli_reader tli_readers[];
extern const size_t tli_reader_count;

/* Name of a format that is known but not read; NULL if nothing is told. formats_foreign.c */
const char *tli_foreign_by_bytes(const tli_source *source);
const char *tli_foreign_by_name(const char *path);
/* The type attribute of a VTKFile element, or "" where it can't be seen in the head. */
void tli_vtk_xml_type(const char *head, char type[40]);

/* True if the head begins with text. */
bool tli_head_begins(const tli_source *source, const char *text);
/* True if the bytes of text stand somewhere near the beginning or the end of the file. */
bool tli_source_holds(const tli_source *source, const char *text);
/* True if the path ends in one of the endings of a list such as ".exo .e", in any case. */
bool tli_ends_in(const char *path, const char *endings);

/* The step that opts ask for, among count >= 1 steps: by number, or the one nearest to a time.
 * times may be NULL (none). Says through the log which one it is where there are several.
 * TL_ERR_ARG if there is no such step. */
tl_status tli_steps_pick(tl_ctx *ctx, const tl_read_opts *opts, const double *times, size_t count,
                         size_t *step);
/* Allocates steps->times [count], NaN, for a count of at least 1. */
tl_status tli_steps_alloc(tl_ctx *ctx, size_t count, tl_steps *steps);

/* Whether the reader of that name is the one that a path is read by. formats_read.c */
bool tli_reader_is(tl_ctx *ctx, const char *path, const tl_read_opts *opts, const char *name);

/* For collections: reads a file that source names (path is complete) into an empty grid, or lists
 * its steps. Fails where collections are nested too deep. formats_read.c */
tl_status tli_grid_read(tl_ctx *ctx, const tli_source *source, const char *path,
                        const tl_read_opts *opts, tli_grid *grid);
tl_status tli_grid_read_steps(tl_ctx *ctx, const tli_source *source, const char *path,
                              const tl_read_opts *opts, tl_steps *steps);
/* Gives the path of a file that the file at base names: name itself if it is absolute, else the
 * folder of base and name. */
char *tli_path_beside(tl_ctx *ctx, const char *base, const char *name, tl_status *status);

/* Readers in files of their own. Those of VTKHDF are there only where HDF5 is, those of XDMF where
 * expat is. */
tli_match_fn tli_match_cgns, tli_match_cube, tli_match_ensight, tli_match_exodus, tli_match_gmsh,
    tli_match_inrimage, tli_match_medit, tli_match_metaimage, tli_match_nifti, tli_match_nrrd,
    tli_match_openfoam, tli_match_pvd, tli_match_slc, tli_match_tetgen, tli_match_vtkpieces,
    tli_match_vtm;
tli_read_fn tli_read_cgns, tli_read_cube, tli_read_ensight, tli_read_exodus, tli_read_gmsh,
    tli_read_inrimage, tli_read_medit, tli_read_metaimage, tli_read_nifti, tli_read_nrrd,
    tli_read_openfoam, tli_read_pvd, tli_read_slc, tli_read_tetgen, tli_read_vtkhdf,
    tli_read_vtkpieces, tli_read_vtm, tli_read_xdmf;
tli_steps_fn tli_steps_cgns, tli_steps_ensight, tli_steps_exodus, tli_steps_gmsh,
    tli_steps_openfoam, tli_steps_pvd, tli_steps_vtkhdf, tli_steps_xdmf;

#endif
