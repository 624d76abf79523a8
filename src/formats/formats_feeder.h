/* Stage formats, internal to the windowed source: what stands behind a source. A reader answers for
 * ranges of points and cells of one data set; formats_feed.c makes windows of tets of them. */
#ifndef TETRALOD_SRC_FORMATS_FEEDER_H
#define TETRALOD_SRC_FORMATS_FEEDER_H

#include "formats/formats_feed.h"

/* An array as the file names it. */
typedef struct tli_feeder_array {
    char *name; /* owned */
    uint32_t components;
    tl_scalar scalar;
} tli_feeder_array;

struct tli_feeder {
    tl_ctx *ctx;
    uint64_t point_count, cell_count;
    double time;
    tli_feeder_array *arrays[2]; /* by tl_on, owned */
    uint32_t array_counts[2];
    bool is_final; /* cells are the tets of a mesh: not to be turned or counted again */
    bool has_blanks;
    const tli_grid_block *blocks; /* structured: the blocks, one after another; else NULL */
    uint32_t block_count;
    const char *path; /* for messages; NULL: none */

    /* xyz [count][3] of points [first, first + count). */
    tl_status (*points)(tli_feeder *reader, uint64_t first, uint64_t count, double *xyz);
    /* Values [count][components] of an array. */
    tl_status (*values)(tli_feeder *reader, tl_on on, uint32_t array, uint64_t first,
                        uint64_t count, double *values);
    /* NULL unless has_blanks: 0 where a point is missing. */
    tl_status (*blanks)(tli_feeder *reader, uint64_t first, uint64_t count, uint8_t *blanks);
    /* NULL for structured ones. Fills types, offsets (from 0) and connectivity of window, ids of
     * the whole; types and offsets may stay NULL for tets alone. */
    tl_status (*cells)(tli_feeder *reader, uint64_t first, uint64_t count, tli_grid *window);
    /* is_final: regions [count], NULL if there are none. */
    tl_status (*regions)(tli_feeder *reader, uint64_t first, uint64_t count, int32_t *regions);
    /* About how many tets; NULL: a tet a cell. */
    tl_status (*estimate)(tli_feeder *reader, uint64_t *tets);
    void (*close)(tli_feeder *reader); /* frees the reader */
};

/* Appends an array; copies name. */
tl_status tli_feeder_add(tli_feeder *reader, tl_on on, const char *name, uint32_t components,
                         tl_scalar scalar);
/* Frees the arrays, as part of a close. */
void tli_feeder_drop_arrays(tli_feeder *reader);

/* Readers of files. Each gives *reader, or leaves it NULL where the file is not for it, to be read
 * as a whole. map stays open until the reader is closed; borrowed. */
tl_status tli_feeder_open_vtu(tl_ctx *ctx, const tli_map *map, const char *path,
                              tli_feeder **reader);
/* A mesh in memory, borrowed, or owned by the reader. */
tl_status tli_feeder_open_mesh(tl_ctx *ctx, const tl_mesh *mesh, bool owned, tli_feeder **reader);

#endif
