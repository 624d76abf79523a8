/* Stage formats, internal: PLOT3D files, told by their size, and where their numbers stand. */
#ifndef TETRALOD_SRC_FORMATS_PLOT3D_H
#define TETRALOD_SRC_FORMATS_PLOT3D_H

#include "formats/formats_grid.h"

/* A file: bytes, or the numbers of a text. Positions and sizes are counted in bytes or in numbers.
 */
typedef struct tli_p3d_source {
    const char *path;
    const uint8_t *bytes; /* NULL for text */
    double *numbers;      /* owned; NULL for bytes */
    uint64_t size;
} tli_p3d_source;

typedef struct tli_p3d_layout {
    bool text, big_endian, multi;
    bool blank;
    unsigned mark; /* size of the length before and after a Fortran record; 0: no records */
    unsigned real; /* size of a real number */
    unsigned axes; /* 2 or 3 */
    bool overflow; /* solution: the number of variables stands behind the dimensions */
} tli_p3d_layout;

typedef struct tli_p3d_header {
    uint32_t block_count;
    uint64_t dims_at;       /* of the first dimension */
    uint64_t data_at;       /* behind the dimensions */
    uint64_t points;        /* of all blocks */
    int64_t vars, gas_vars; /* of an OVERFLOW solution */
} tli_p3d_header;

/* Whether a file is text by its first bytes. */
bool tli_p3d_is_text(const tli_map *map);
/* Text is parsed: free source->numbers, also after a failure. */
tl_status tli_p3d_open(tl_ctx *ctx, const tli_map *map, const char *path, tli_p3d_source *source);

/* The variant that demands the size of the file; false where none does. A solution must have the
 * blocks of its grid. The other two say so. */
bool tli_p3d_find_grid(const tli_p3d_source *source, tli_p3d_layout *as, tli_p3d_header *head);
bool tli_p3d_find_solution(const tli_p3d_source *source, const tli_grid_block *blocks,
                           uint32_t block_count, unsigned axes, tli_p3d_layout *as,
                           tli_p3d_header *head);
tl_status tli_p3d_fail_grid(tl_ctx *ctx, const tli_p3d_source *source);
tl_status tli_p3d_fail_solution(tl_ctx *ctx, const tli_p3d_source *source,
                                const tli_grid_block *blocks, uint32_t block_count);
void tli_p3d_log_grid(tl_ctx *ctx, const tli_p3d_source *source, const tli_p3d_layout *as,
                      const tli_p3d_header *head);
void tli_p3d_log_solution(tl_ctx *ctx, const tli_p3d_source *source, const tli_p3d_layout *as,
                          const tli_p3d_header *head);

/* Gives *blocks [head->block_count]. */
tl_status tli_p3d_blocks(tl_ctx *ctx, const tli_p3d_source *source, const tli_p3d_layout *as,
                         const tli_p3d_header *head, tli_grid_block **blocks);
static inline uint64_t tli_p3d_block_points(const tli_grid_block *block)
{
    return (uint64_t)block->dims[0] * block->dims[1] * block->dims[2];
}

/* Where the numbers of each block begin: places [head->block_count]. Coordinates stand axis by
 * axis, iblank behind them; variables one after another. Fails where the length of a record is
 * wrong. time stays as it is where the file has none. */
tl_status tli_p3d_place_grid(tl_ctx *ctx, const tli_p3d_source *source, const tli_p3d_layout *as,
                             const tli_p3d_header *head, const tli_grid_block *blocks,
                             uint64_t *places);
tl_status tli_p3d_place_solution(tl_ctx *ctx, const tli_p3d_source *source,
                                 const tli_p3d_layout *as, const tli_p3d_header *head,
                                 const tli_grid_block *blocks, uint64_t *places, double *time);

unsigned tli_p3d_int_size(const tli_p3d_layout *as);
/* The integer at a position, which lies inside the file. A number of a text that is no integer
 * gives -1. */
int64_t tli_p3d_read_int(const tli_p3d_source *source, const tli_p3d_layout *as, uint64_t at);
void tli_p3d_read_reals(const tli_p3d_source *source, const tli_p3d_layout *as, uint64_t at,
                        size_t count, double *values);
/* iblank from a position on: 0 for holes; others are points, also those that another block overlaps
 * (< 0). */
void tli_p3d_read_blanks(const tli_p3d_source *source, const tli_p3d_layout *as, uint64_t at,
                         size_t count, uint8_t *blanks);
/* values[i * stride] = number i from a position on. */
tl_status tli_p3d_gather(tl_ctx *ctx, const tli_p3d_source *source, const tli_p3d_layout *as,
                         uint64_t at, size_t count, double *values, unsigned stride);

/* Variables become arrays: density, momentum of three components, then one each. */
uint64_t tli_p3d_variable_count(const tli_p3d_layout *as, const tli_p3d_header *head);
static inline uint64_t tli_p3d_array_count(const tli_p3d_layout *as, const tli_p3d_header *head)
{
    return tli_p3d_variable_count(as, head) - as->axes + 1;
}
const char *tli_p3d_array_name(const tli_p3d_header *head, uint64_t array, char name[48]);
static inline uint32_t tli_p3d_array_components(uint64_t array)
{
    return array == 1 ? 3 : 1;
}
/* The array of a variable, and which of its components it is. */
static inline uint64_t tli_p3d_array_of(const tli_p3d_layout *as, uint64_t var, uint32_t *component)
{
    bool momentum = var >= 1 && var <= as->axes;
    *component = momentum ? (uint32_t)var - 1 : 0;
    return momentum ? 1 : var == 0 ? 0 : var - as->axes + 1;
}

#endif
