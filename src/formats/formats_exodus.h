/* Stage formats, internal: the parts of the Exodus II reader. */
#ifndef TETRALOD_SRC_FORMATS_EXODUS_H
#define TETRALOD_SRC_FORMATS_EXODUS_H

#include "formats/formats_cells.h"
#include "formats/formats_netcdf.h"

typedef struct tli_ex_block {
    uint64_t first_cell, cell_count;
    int32_t id;
    uint8_t type; /* of VTK; 0: unknown, 7, 42: see ends */
} tli_ex_block;

typedef struct tli_exodus {
    tl_ctx *ctx;
    tli_nc nc;
    tli_grid *grid;
    tli_ex_block *blocks; /* [block_count] */
    uint64_t block_count;
    size_t step;
} tli_exodus;

/* Nodal and element variables of the step. formats_exodus_fields.c */
tl_status tli_ex_fields(tli_exodus *ex);
/* Side sets become labels. formats_exodus_sides.c */
tl_status tli_ex_side_sets(tli_exodus *ex);

#endif
