/* Stage formats, internal: what every reader hands on. A grid is a data set as its file has it,
 * with cells of any kind; formats_tets.c turns it into a mesh of tets. */
#ifndef TETRALOD_SRC_FORMATS_GRID_H
#define TETRALOD_SRC_FORMATS_GRID_H

#include "base/base.h"
#include "base/base_file.h"
#include "tetralod/formats.h"

/* A named array of a file, widened to float64. */
typedef struct tli_grid_array {
    char *name;          /* owned */
    uint32_t components; /* >= 1 */
    tl_scalar scalar;    /* type in the file */
    uint64_t count;      /* tuples */
    double *values;      /* [count][components], owned */
} tli_grid_array;

/* A structured block: points [first_point, first_point + ni * nj * nk), i fastest. Its cells come
 * after those of the blocks before it, i fastest. A dimension of 1 makes it a surface, line or
 * point. */
typedef struct tli_grid_block {
    uint64_t first_point;
    uint32_t dims[3];
} tli_grid_block;

/* The name of a region. */
typedef struct tli_grid_name {
    int32_t id;
    char *name; /* owned */
} tli_grid_name;

/* A named surface: side set, boundary condition, physical group. Its faces are polygons of corners,
 * in any direction; corners of quadratic faces only. */
typedef struct tli_grid_label {
    char *name; /* owned, "" when there is none */
    int32_t id;
    uint64_t face_count;
    uint64_t *offsets; /* [face_count + 1] into points, owned */
    uint32_t *points;  /* point ids, each below point_count: checked by the reader; owned */
} tli_grid_label;

typedef struct tli_grid {
    tl_ctx *ctx;
    uint64_t point_count;
    double *xyz; /* [point_count][3] */

    /* either structured blocks ... */
    tli_grid_block *blocks;
    uint32_t block_count;
    uint32_t odd_blocks; /* 1: the first cell of a block is cut as an odd one: part of a whole */
    uint8_t *blanks;     /* [point_count] or NULL; 0: the point is missing (iblank) */

    /* ... or (block_count 0) a list of cells in VTK's types and vertex orders. A tets-only file may
     * leave types NULL: every cell is then a VTK_TETRA and offsets may be NULL too. */
    uint64_t cell_count;
    uint8_t *types;         /* [cell_count] VTK cell types */
    uint64_t *offsets;      /* [cell_count + 1] into connectivity */
    uint32_t *connectivity; /* point ids, each below point_count: checked by the reader; of a
                               polyhedron (type 42) ids of its faces, each below face_count */

    /* Faces of polyhedra, each stored once, or once a cell; their corners in either direction. */
    uint64_t face_count;
    uint64_t *face_offsets; /* [face_count + 1] into face_points */
    uint32_t *face_points;  /* point ids, each below point_count: checked by the reader */

    /* Block, zone, material or entity of each cell; NULL: none. In front of any array that is named
     * like a region, behind the one that the user names. */
    int32_t *regions; /* [number of cells] */
    tli_grid_name *region_names;
    uint32_t region_name_count;
    tli_grid_label *labels;
    uint32_t label_count;

    tli_grid_array *point_arrays; /* count == point_count each: checked by the reader */
    uint32_t point_array_count;
    tli_grid_array *cell_arrays; /* count == number of cells each (blocks: of structured cells) */
    uint32_t cell_array_count;
    double time; /* NaN when the file has none */
} tli_grid;

/* An empty grid. */
void tli_grid_init(tl_ctx *ctx, tli_grid *grid);
void tli_grid_release(tli_grid *grid);
/* Appends an array (takes over values on success, copies name). A count that does not match is
 * TL_ERR_FORMAT. Allocates values [count][components] when values is NULL and returns the array. */
tl_status tli_grid_add(tli_grid *grid, tl_on on, const char *name, uint32_t components,
                       tl_scalar scalar, double *values, tli_grid_array **array);
/* Takes an array out of its list and frees it. */
void tli_grid_drop_array(tli_grid *grid, tl_on on, uint32_t index);
/* Number of cells: of the list, or of all blocks. */
uint64_t tli_grid_cell_count(const tli_grid *grid);

/* Widens count numbers of a file's type and byte order to float64. */
void tli_widen(const void *bytes, tl_scalar scalar, bool big_endian, uint64_t count,
               double *values);

/* Names a region; copies. An id that has a name keeps it. "" and NULL name nothing. */
tl_status tli_grid_name_region(tli_grid *grid, int32_t id, const char *name);
/* Adds a label; takes over offsets and points on success, copies name. A label of the same name and
 * id grows instead. */
tl_status tli_grid_add_label(tli_grid *grid, const char *name, int32_t id, uint64_t face_count,
                             uint64_t *offsets, uint32_t *points);

/* Adds faces of polyhedra, one after the other: formats_faces.c. */
typedef struct tli_face_list {
    tli_grid *grid;
    uint64_t face_room, point_room;
} tli_face_list;
void tli_face_list_begin(tli_grid *grid, tli_face_list *list);
/* ids [count] of the corners, add is added to each; the face is number grid->face_count - 1. */
tl_status tli_face_list_add(tli_face_list *list, const uint32_t *ids, uint64_t count, uint32_t add);
/* Adds all faces of a polyhedron as VTK lists them: their number, then for each the number of its
 * corners and these, which must lie below limit. */
tl_status tli_face_list_add_stream(tli_face_list *list, const uint32_t *stream, uint64_t length,
                                   uint64_t limit, uint32_t add, uint32_t *face_count);
/* Gives back what room is left over. */
tl_status tli_face_list_end(tli_face_list *list);

/* The rest of this part: formats_grid_join.c. */
/* How a grid is added to another. */
typedef struct tli_join {
    bool is_block;    /* its cells get the region below, unless they have regions of their own */
    int32_t region;   /* of the block */
    const char *name; /* of the block; NULL: none */
} tli_join;
/* Moves everything of from, which is left empty, behind what into holds: an empty into takes from
 * as it is. Arrays are the same where name and number of components are; where one side lacks an
 * array its values are NaN. Structured blocks stay such when both sides are structured, else they
 * become lists. how may be NULL: a piece of the same mesh. */
tl_status tli_grid_join(tli_grid *into, tli_grid *from, const tli_join *how);
/* Structured blocks become lists of cells, in the same order. */
tl_status tli_grid_unstructure(tli_grid *grid);
/* Points at most distance apart become one, the one of the smallest index: in cells, faces and
 * labels; points that nothing names stay. *welded receives the number of points that became
 * another. Structured blocks become lists. formats_weld.c */
tl_status tli_grid_weld(tli_grid *grid, double distance, uint64_t *welded);

/* Grid to mesh: drops ghosts (vtkGhostType) and blanks, splits cells, turns tets, picks the region,
 * leaves unused points out, fills report. grid is emptied on the way. formats_tets.c */
tl_status tli_grid_to_mesh(tli_grid *grid, const tl_read_opts *opts, tl_mesh **mesh,
                           tl_read_report *report);

/* The readers of single files. map holds the whole file; path is for messages and neighbours. Each
 * fills an empty grid; on failure the caller releases it. The table of all readers, and how to add
 * one: formats_reader.h. */
tl_status tli_read_vtk_xml(tl_ctx *ctx, const tli_map *map, const char *path, tli_grid *grid);
tl_status tli_read_vtk_legacy(tl_ctx *ctx, const tli_map *map, const char *path, tli_grid *grid);
tl_status tli_read_plot3d(tl_ctx *ctx, const tli_map *map, const char *path,
                          const tl_read_opts *opts, tli_grid *grid);
/* The file must hold exactly one value for each point of opts; *points receives their number. */
tl_status tli_raw_check(tl_ctx *ctx, const tli_map *map, const char *path, const tl_read_opts *opts,
                        uint64_t *points);
tl_status tli_read_raw(tl_ctx *ctx, const tli_map *map, const char *path, const tl_read_opts *opts,
                       tli_grid *grid);

#endif
