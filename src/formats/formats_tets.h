/* Stage formats, internal: the parts of the conversion of a grid to tets. */
#ifndef TETRALOD_SRC_FORMATS_TETS_H
#define TETRALOD_SRC_FORMATS_TETS_H

#include "formats/formats_grid.h"
#include "formats/formats_poly.h"
#include "formats/formats_split.h"

/* Cells, points or values that a thread takes at once. */
#define TLI_TETS_GRAIN 32768

/* Marks of a point. */
#define TLI_POINT_USED 1    /* by a tet */
#define TLI_POINT_HIDDEN 2  /* vtkGhostType says so */
#define TLI_POINT_MISSING 4 /* iblank 0 or fill value */
#define TLI_POINT_LABEL 8   /* a corner of a labelled face */

/* Marks of a cell: the number of its tets, or why it has none. */
#define TLI_CELL_COUNT 7  /* 7: the number stands in cell_counts */
#define TLI_CELL_CENTRE 8 /* a polyhedron with a vertex in the middle */
#define TLI_CELL_GHOST 16
#define TLI_CELL_BLANK 32

/* What one thread counts; sums of integers, so the order of the threads can't be seen. */
typedef struct tli_tally {
    uint64_t cells[TL_CELL_KIND_COUNT];
    uint64_t ghosts, blanks, repeated;
    uint64_t faceless, open; /* polyhedra without faces, or whose faces are not closed */
    uint64_t closed;         /* polyhedra that got the faces that they lacked */
    uint64_t turned, inverted, degenerate;
    uint64_t nonfinite_tets, nonfinite_values, filled;
} tli_tally;

/* A conversion on its way. */
typedef struct tli_tets {
    tl_ctx *ctx;
    tli_grid *grid;
    tl_read_opts opts;
    tl_read_report report;
    tli_tally *tallies; /* [threads] */
    tli_tally sum;

    uint64_t cell_count;
    uint8_t type;           /* of all cells of a list, where the grid has no types */
    uint32_t type_ids;      /* ids of each, where it has no offsets */
    uint64_t ids_left_out;  /* from the beginning of the connectivity that the grid has now */
    uint64_t cell_first;    /* of the data set, where this is a part of it; for messages */
    uint64_t *block_first;  /* [block_count + 1] first cell of each structured block */
    uint8_t *point_marks;   /* [point_count] */
    uint8_t *cell_marks;    /* [cell_count] */
    uint32_t *cell_counts;  /* [cell_count] tets of polyhedra and prisms; NULL if there are none */
    uint64_t *piece_first;  /* [pieces of cells + 1] first tet of each piece */
    uint64_t *piece_centre; /* [pieces of cells + 1] first new vertex of each piece */
    uint64_t first_centre;  /* point that is the first new vertex */
    uint64_t centre_count;
    uint32_t largest_cell; /* tets of the cell that has most */
    tli_poly *polys;       /* [threads] */

    tl_lidx *tets; /* [tet_count][4] */
    size_t tet_count;
    size_t vert_count;
    bool one_to_one; /* tet t is cell t */
    int32_t *regions;
    char *region_name; /* of the array they come from, for the log */
} tli_tets;

/* Tets of a cell. */
static inline uint32_t tli_cell_tets(const tli_tets *t, uint64_t cell)
{
    uint32_t count = t->cell_marks[cell] & TLI_CELL_COUNT;
    return count < TLI_CELL_COUNT ? count : t->cell_counts[cell];
}

/* The passes over the cells, formats_tets_cells.c: count tets and mark points; then write them,
 * new vertices included. */
tl_status tli_tets_count(tli_tets *t);
tl_status tli_tets_build(tli_tets *t);

/* Labelled faces to faces of tets, while points have the ids of the file: formats_labels.c. */
typedef struct tli_label_faces {
    uint64_t count;
    uint32_t *labels; /* [count] which label */
    tl_lidx *faces;   /* [count] 4 * tet + face, ascending */
} tli_label_faces;
tl_status tli_tets_find_labels(tli_tets *t, tli_label_faces *found);
/* Adds them to the mesh. */
tl_status tli_tets_add_labels(const tli_tets *t, const tli_label_faces *found, tl_mesh *mesh);

/* Consumes vtkGhostType, iblank and fill values: marks points and cells. formats_missing.c */
tl_status tli_tets_mark_missing(tli_tets *t);

/* The steps of tli_grid_to_mesh, for those who split a data set part by part. formats_tets.c */
/* Checks options and counts; takes over what grid holds. */
tl_status tli_tets_open(tli_tets *t, tli_grid *grid, const tl_read_opts *opts);
/* Makes room for marks. */
tl_status tli_tets_prepare(tli_tets *t);
/* Does that, marks what is missing, then makes t->tets out of the cells, which go. */
tl_status tli_tets_split(tli_tets *t);
/* After tli_tets_open, also a failed one. */
void tli_tets_release(tli_tets *t);

/* Adds what the threads counted to t->sum. formats_tets_report.c */
void tli_tets_sum(tli_tets *t);
/* Fills t->report out of t->sum and says what it counts. */
void tli_tets_report(tli_tets *t);

/* Fields: everything below is in formats_tets_fields.c. */
/* Index of the cell array that holds the regions, or -1. */
tl_status tli_tets_find_region(tli_tets *t, int *index);
/* Sets t->regions from that array, which stays. */
tl_status tli_tets_make_regions(tli_tets *t, int index);
/* Sets t->regions from those of the grid. */
tl_status tli_tets_take_regions(tli_tets *t);
/* Values of cells become values of tets. */
tl_status tli_tets_repeat(const tli_tets *t, tli_grid_array *array);
/* Cell data to point data, volume-weighted; all cell arrays but the one of the regions. */
tl_status tli_tets_average_cells(tli_tets *t, int region_index);
/* Moves all arrays into the mesh. */
tl_status tli_tets_hand_over(tli_tets *t, tl_mesh *mesh);
/* True for a name that means regions in any case: region, material or block, also followed by signs
 * (Material #) or by id, ids, number, s. */
bool tli_is_region_name(const char *name);

#endif
