/* Stage formats, internal: the parts of the reader of Medit files.
 *   formats_medit.c      sections, points, cells
 *   formats_medit_sol.c  values (.sol) */
#ifndef TETRALOD_SRC_FORMATS_MEDIT_H
#define TETRALOD_SRC_FORMATS_MEDIT_H

#include "formats/formats_scan.h"

/* A file, as text or binary, section by section. */
typedef struct tli_medit {
    tli_scan scan;
    int64_t version, dimension;
    unsigned int_bytes, real_bytes, place_bytes; /* binary */
} tli_medit;

/* A section: its keyword and where it ends. */
typedef struct tli_medit_section {
    char name[40]; /* of a text; "" for a keyword of the binary form that is not known here */
    uint64_t next; /* binary: where the next one begins, 0: none */
} tli_medit_section;

/* Reads version and, in binary files, byte order. */
tl_status tli_medit_open(tl_ctx *ctx, const char *path, const tli_map *map, tli_medit *medit);
/* The next section; *more is false at the end. Takes Dimension itself. */
tl_status tli_medit_next(tli_medit *medit, tli_medit_section *section, bool *more);
/* Leaves a section that is not read, or is read to its end. */
tl_status tli_medit_leave(tli_medit *medit, const tli_medit_section *section);
tl_status tli_medit_int(tli_medit *medit, const char *what, int64_t low, int64_t high,
                        int64_t *value);
tl_status tli_medit_real(tli_medit *medit, const char *what, double *value);
/* A number of records of some whole numbers and reals, checked against the rest of the file. */
tl_status tli_medit_count(tli_medit *medit, const char *what, uint64_t ints, uint64_t reals,
                          uint64_t *count);

/* Values of a .sol or .solb file as arrays of a grid. TL_ERR_FORMAT if they are not as many as its
 * points. */
tl_status tli_medit_read_sol(tl_ctx *ctx, const char *path, const tli_map *map, tli_grid *grid);

#endif
