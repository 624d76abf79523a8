/* Stage formats, internal: a list of cells that grows section by section, on its way to a grid. */
#ifndef TETRALOD_SRC_FORMATS_CELLS_H
#define TETRALOD_SRC_FORMATS_CELLS_H

#include "formats/formats_grid.h"

/* Cell types of VTK that readers name. */
#define TLI_VTK_VERTEX 1
#define TLI_VTK_LINE 3
#define TLI_VTK_TRIANGLE 5
#define TLI_VTK_POLYGON 7
#define TLI_VTK_QUAD 9
#define TLI_VTK_HEXAHEDRON 12
#define TLI_VTK_WEDGE 13
#define TLI_VTK_PYRAMID 14
#define TLI_VTK_QUADRATIC_EDGE 21
#define TLI_VTK_QUADRATIC_TRIANGLE 22
#define TLI_VTK_QUADRATIC_QUAD 23
#define TLI_VTK_QUADRATIC_TETRA 24
#define TLI_VTK_QUADRATIC_HEXAHEDRON 25
#define TLI_VTK_QUADRATIC_WEDGE 26
#define TLI_VTK_QUADRATIC_PYRAMID 27
#define TLI_VTK_BIQUADRATIC_QUAD 28
#define TLI_VTK_TRIQUADRATIC_HEXAHEDRON 29
#define TLI_VTK_BIQUADRATIC_WEDGE 32
#define TLI_VTK_POLYHEDRON 42
#define TLI_VTK_LAGRANGE_CURVE 68
#define TLI_VTK_LAGRANGE_TRIANGLE 69
#define TLI_VTK_LAGRANGE_QUAD 70
#define TLI_VTK_LAGRANGE_TETRA 71
#define TLI_VTK_LAGRANGE_HEXAHEDRON 72
#define TLI_VTK_LAGRANGE_WEDGE 73
#define TLI_VTK_LAGRANGE_PYRAMID 74

typedef struct tli_cells {
    tl_ctx *ctx;
    uint64_t count, capacity, index_count, index_capacity;
    uint8_t *types;
    uint64_t *offsets; /* [count + 1] */
    uint32_t *connectivity;
    int32_t *regions; /* [count] */
} tli_cells;

void tli_cells_init(tl_ctx *ctx, tli_cells *cells);
void tli_cells_release(tli_cells *cells);
/* Room for that many more; counts were checked against the file. */
tl_status tli_cells_reserve(tli_cells *cells, uint64_t cell_count, uint64_t index_count);
/* Appends a cell, for which there is room, and returns the place of its ids [index_count]. */
uint32_t *tli_cells_add(tli_cells *cells, uint8_t type, uint32_t index_count, int32_t region);
/* By dimension of a VTK cell type. */
bool tli_cell_is_volume(uint8_t type);
bool tli_cell_is_surface(uint8_t type);
/* Corners of a surface cell that is no polygon: 3 or 4. */
uint32_t tli_surface_corners(uint8_t type);
/* Hands everything to a grid without cells, with the regions where with_regions. path: for the
 * message about an id that is none of the grid's points (polyhedra: faces). */
tl_status tli_cells_to_grid(tli_cells *cells, const char *path, bool with_regions, tli_grid *grid);

#endif
