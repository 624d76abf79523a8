/* Stage formats, internal: the parts of the reader of OpenFOAM cases.
 *   formats_openfoam_scan.c   heads, words and lists of files, text and binary
 *   formats_openfoam_cells.c  cells from the faces of a polyMesh
 *   formats_openfoam_zones.c  zones of cells
 *   formats_openfoam_case.c   folders of times, and where the newest file before a time stands
 *   formats_openfoam.c        the reader */
#ifndef TETRALOD_SRC_FORMATS_OPENFOAM_H
#define TETRALOD_SRC_FORMATS_OPENFOAM_H

#include "formats/formats_reader.h"
#include "formats/formats_scan.h"

/* ---- files ---- */

typedef struct tli_foam {
    tl_ctx *ctx;
    char *path; /* owned */
    tli_map map;
    tli_scan scan;
    bool binary;
    unsigned label_bytes, scalar_bytes; /* of binary lists */
    char class_name[48];
} tli_foam;

/* Opens path or path.gz and reads the head. *there is false, and nothing open, if there is neither;
 * TL_ERR_FORMAT if the head is none. path is copied. */
tl_status tli_foam_open(tl_ctx *ctx, const char *path, tli_foam *file, bool *there);
/* Reads the head of bytes in memory; path is copied, map taken over, on failure too. */
tl_status tli_foam_attach(tl_ctx *ctx, const char *path, tli_map map, tli_foam *file);
void tli_foam_close(tli_foam *file);

/* Passes over white space and comments; the next character, 0 at the end. */
char tli_foam_peek(tli_foam *file);
tl_status tli_foam_take(tli_foam *file, char expected);
/* The next word: up to white space or one of (){};[] unless these stand inside. */
tl_status tli_foam_word(tli_foam *file, tli_span *word);
/* Leaves the rest of an entry: up to ; or a block { }. */
tl_status tli_foam_skip_entry(tli_foam *file);
/* N and the bracket of a list, whose elements take so many bytes at least. *one: it is N{one}, all
 * are the same, at most most of them. */
tl_status tli_foam_begin_list(tli_foam *file, const char *what, uint64_t bytes, uint64_t most,
                              uint64_t *count, bool *one);
/* A list N ( ... ) or N { one }: whole numbers low .. high, or tuples of reals. Gives the values.
 */
tl_status tli_foam_labels(tli_foam *file, const char *what, int64_t low, int64_t high,
                          uint64_t most, uint64_t *count, uint32_t **values);
tl_status tli_foam_reals(tli_foam *file, const char *what, uint32_t components, uint64_t most,
                         uint64_t *count, double **values);
/* uniform VALUE or nonuniform List<...> N ( ... ), for count tuples. */
tl_status tli_foam_field(tli_foam *file, uint32_t components, uint64_t count, double *values);

/* ---- a polyMesh ---- */

typedef struct tli_foam_mesh {
    tl_ctx *ctx;
    const char *path; /* of its faces, for messages */
    uint64_t point_count, face_count, cell_count, neighbour_count;
    uint64_t *face_offsets; /* [face_count + 1] */
    uint32_t *face_points;
    uint32_t *owner;     /* [face_count] */
    uint32_t *neighbour; /* [neighbour_count]: of the first faces; TL_NONE: none */
} tli_foam_mesh;

/* List of faces, N ( 3(0 1 2) ... ) or as offsets and points. */
tl_status tli_foam_faces(tli_foam *file, tli_foam_mesh *mesh);
/* Counts the cells and makes cells of the grid: of the usual shapes where they are such, else
 * polyhedra, for which the grid takes the faces over. */
tl_status tli_foam_make_cells(tli_foam_mesh *mesh, tli_grid *grid);

/* Reads the file of zones of cells: regions of the grid, whose cells are there. */
tl_status tli_foam_zones(tli_foam *file, tli_grid *grid);

/* ---- a case ---- */

typedef struct tli_foam_time {
    char name[64];
    double value;
} tli_foam_time;

typedef struct tli_foam_case {
    tl_ctx *ctx;
    char *folder;         /* owned */
    tli_foam_time *times; /* [time_count] ascending */
    size_t time_count;
    uint32_t processors; /* 0: not decomposed */
} tli_foam_case;

/* The case that a source names: a folder, a .foam file or system/controlDict in it. */
bool tli_foam_case_of(const tli_source *source, char *folder, size_t folder_bytes);
tl_status tli_foam_case_open(tl_ctx *ctx, const tli_source *source, tli_foam_case *c);
void tli_foam_case_close(tli_foam_case *c);
/* Opens a file of the mesh: polyMesh/NAME in the folder of the newest time up to step, else of
 * constant. root: the case, or a processor's folder. TL_ERR_IO if there is none. */
tl_status tli_foam_open_mesh_file(const tli_foam_case *c, const char *root, size_t step,
                                  const char *name, tli_foam *file);
/* The same for one that may be missing: *there is then false, and nothing open. */
tl_status tli_foam_find_mesh_file(const tli_foam_case *c, const char *root, size_t step,
                                  const char *name, tli_foam *file, bool *there);
/* True if some time has a file of that name in its polyMesh. */
bool tli_foam_has_mesh_file(const tli_foam_case *c, const char *root, const char *name);
/* Names of the files of a folder, ascending. Gives names, each and the list. */
tl_status tli_folder_list(tl_ctx *ctx, const char *folder, char ***names, size_t *count);
void tli_folder_release(tl_ctx *ctx, char **names, size_t count);

#endif
