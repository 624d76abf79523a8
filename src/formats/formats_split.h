/* Stage formats, internal: cells to tets, by indices alone. */
#ifndef TETRALOD_SRC_FORMATS_SPLIT_H
#define TETRALOD_SRC_FORMATS_SPLIT_H

#include "tetralod/formats.h"

/* Most tets of one cell that tli_split_cell takes. */
#define TLI_SPLIT_MAX 6
/* Most corners of one cell that tli_split_cell takes. */
#define TLI_CORNERS_MAX 8
/* Most corners of a prism. */
#define TLI_PRISM_CORNERS_MAX 12

/* Type of a tetrahedron in VTK's files. */
#define TLI_VTK_TETRA 10
/* Type of a polyhedron there. */
#define TLI_VTK_POLYHEDRON 42

/* How a cell is split; the corners are in VTK's order. */
typedef enum tli_shape {
    TLI_SHAPE_NONE = 0, /* no volume, or none that is split here */
    TLI_SHAPE_TETRA,
    TLI_SHAPE_PYRAMID,
    TLI_SHAPE_WEDGE,
    TLI_SHAPE_HEXAHEDRON,
    TLI_SHAPE_VOXEL,
    /* split by formats_poly.c, not by tli_split_cell */
    TLI_SHAPE_PENTAGONAL_PRISM,
    TLI_SHAPE_HEXAGONAL_PRISM,
    TLI_SHAPE_POLYHEDRON /* its faces are listed */
} tli_shape;

/* What a cell type of VTK is to us. */
typedef struct tli_cell_type {
    tl_cell_kind kind;
    tli_shape shape;
    uint8_t points; /* of such a cell in a file; 0: any number, the corners first */
} tli_cell_type;
tli_cell_type tli_cell_type_of(uint8_t vtk_type);

/* 4 (tetrahedron) to 12; 0 for TLI_SHAPE_NONE and TLI_SHAPE_POLYHEDRON. */
unsigned tli_shape_corners(tli_shape shape);

/* Splits a cell with the corners ids into tets, positive where the cell is convex and stands as VTK
 * documents it. Each face with four corners is cut from its smallest id, so that two cells that
 * share a face cut it alike. Corners may repeat: tets with a repeated vertex are left out and
 * counted in *repeated (may be NULL). Returns the number of tets. */
unsigned tli_split_cell(tli_shape shape, const tl_lidx *ids, tl_lidx tets[TLI_SPLIT_MAX][4],
                        unsigned *repeated);

/* Structured cells: corner x + 2 y + 4 z, x, y, z 0 or 1. Five tets by the parity of i + j + k, six
 * around the diagonal 0 - 7. All are positive in a right-handed grid. */
extern const uint8_t tli_split_five[2][5][4];
extern const uint8_t tli_split_six[6][4];

#endif
