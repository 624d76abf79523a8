/* Stage formats, internal to the reader of legacy VTK files: the cursor that its parts share.
 *
 * A legacy file is text; in a BINARY one the numbers after a header line are big-endian bytes that
 * begin right after that line's end. */
#ifndef TETRALOD_SRC_FORMATS_LEGACY_H
#define TETRALOD_SRC_FORMATS_LEGACY_H

#include "formats/formats_grid.h"

/* Values of tli_legacy.kind, and a mask of them where a keyword may stand. */
typedef enum tli_legacy_kind {
    TLI_LEGACY_NONE = 1, /* no DATASET yet */
    TLI_LEGACY_IMAGE = 2,
    TLI_LEGACY_STRUCTURED = 4,
    TLI_LEGACY_RECTILINEAR = 8,
    TLI_LEGACY_UNSTRUCTURED = 16,
    TLI_LEGACY_POLYDATA = 32
} tli_legacy_kind;

typedef enum tli_legacy_family {
    TLI_LEGACY_NUMBER,
    TLI_LEGACY_BIT, /* packed, first in the highest bit of a byte */
    TLI_LEGACY_STRING,
    TLI_LEGACY_VARIANT
} tli_legacy_family;

/* A type name of a file. */
typedef struct tli_legacy_type {
    const char *name;
    tli_legacy_family family;
    tl_scalar stored; /* bytes of a BINARY file */
    tl_scalar scalar; /* what the numbers are: a vtkIdType is 64 bits wide, and stored in 32 */
} tli_legacy_type;

#define TLI_LEGACY_NAME_MAX 1024 /* bytes of a name, its end included */

/* Numbers of a BINARY file that stay there. */
typedef struct tli_legacy_block {
    const char *bytes;
    const tli_legacy_type *type;
    uint64_t count;
} tli_legacy_block;

typedef struct tli_legacy_array {
    char *name; /* owned */
    uint32_t components;
    bool is_level; /* ghost levels, to be read as marks */
    tli_legacy_block block;
} tli_legacy_array;

/* Where the large arrays of a BINARY file are: read like this, it takes no more memory than names.
 */
typedef struct tli_legacy_places {
    const tli_map *map;
    tli_legacy_block points, types;
    tli_legacy_block row;                   /* of cells, up to version 4.2 */
    uint64_t *row_starts;                   /* places in the row of some cells, owned */
    tli_legacy_block offsets, connectivity; /* from 5.0 on */
    tli_legacy_array *arrays[2];            /* by tl_on, owned */
    uint32_t array_counts[2];
} tli_legacy_places;

typedef struct tli_legacy {
    tl_ctx *ctx;
    const char *path;
    const char *begin, *at, *end; /* the file, and what is read next */
    bool binary;
    tli_grid *grid;
    tli_legacy_places *places; /* not NULL: places are found, nothing large is read */
    tli_legacy_kind kind;

    bool has_points, has_dims, has_cells, has_types;
    uint64_t dims[3];
    int64_t first_index[3]; /* of EXTENT */
    double origin[3], spacing[3];
    double *axes[3]; /* of a rectilinear grid, owned */
    uint64_t axis_counts[3];
    uint64_t blank_count;
    uint64_t type_count;  /* of CELL_TYPES */
    const char *cells_at; /* the keyword CELLS, for messages */

    bool closed;   /* geometry is complete: POINT_DATA or CELL_DATA was met */
    bool has_data; /* on is set */
    tl_on on;
    uint32_t components; /* of the array read last; METADATA needs it */
    uint32_t skipped_fields;
} tli_legacy;

/* A word of the file, not terminated. */
typedef struct tli_legacy_word {
    const char *text;
    size_t length;
} tli_legacy_word;

/* ---- formats_legacy.c ---- */

void tli_legacy_begin(tl_ctx *ctx, const tli_map *map, const char *path, tli_grid *grid,
                      tli_legacy *reader);
/* Reads everything but the positions of images and rectilinear grids. Where places are asked for,
 * TL_ERR_FORMAT and TL_ERR_UNSUPPORTED may come without a message: read as a whole, the file gives
 * one, or can be read. */
tl_status tli_legacy_read_file(tli_legacy *reader);
/* Of points [first, first + count) of an image or a rectilinear grid. */
void tli_legacy_positions(const tli_legacy *reader, uint64_t first, uint64_t count, double *xyz);
void tli_legacy_end(tli_legacy *reader);

/* ---- formats_legacy_scan.c ---- */

/* Fails with the path and the line (ASCII) or byte (BINARY) of a place. */
tl_status tli_legacy_fail(const tli_legacy *reader, const char *place, tl_status status,
                          const char *format, ...) TL_PRINTF(4, 5);
/* Fails with "expected WHAT, found WORD" at the next word. */
tl_status tli_legacy_expected(const tli_legacy *reader, const char *what);

/* The next word; false at the end of the file. */
bool tli_legacy_next(tli_legacy *reader, tli_legacy_word *word);
/* The next word of this line; false at its end, which stays. */
bool tli_legacy_next_in_line(tli_legacy *reader, tli_legacy_word *word);
/* Moves past the end of this line. */
void tli_legacy_skip_line(tli_legacy *reader);
/* True if word is the keyword in any case. */
bool tli_legacy_is(const tli_legacy_word *word, const char *keyword);
/* True, and the word is taken, if the next word is the keyword. */
bool tli_legacy_take(tli_legacy *reader, const char *keyword);

/* what: for messages. */
tl_status tli_legacy_read_count(tli_legacy *reader, const char *what, uint64_t *count);
tl_status tli_legacy_read_int(tli_legacy *reader, const char *what, int64_t *value);
tl_status tli_legacy_read_real(tli_legacy *reader, const char *what, double *value);
/* Decodes %XX. */
tl_status tli_legacy_read_name(tli_legacy *reader, char name[TLI_LEGACY_NAME_MAX]);
tl_status tli_legacy_read_type(tli_legacy *reader, const tli_legacy_type **type);

/* Reads tuples * components numbers after the end of this line, when the file can hold them. Gives
 * *values. */
tl_status tli_legacy_read_numbers(tli_legacy *reader, const char *what, const tli_legacy_type *type,
                                  uint64_t tuples, uint64_t components, double **values);
/* Moves past an array of any type. */
tl_status tli_legacy_skip_array(tli_legacy *reader, const char *what, const tli_legacy_type *type,
                                uint64_t tuples, uint64_t components);
/* Before integers are read in pieces: checks that the file can hold count of them, and moves to the
 * first. */
tl_status tli_legacy_open_integers(tli_legacy *reader, const char *what,
                                   const tli_legacy_type *type, uint64_t count);
/* The next integers. */
tl_status tli_legacy_read_integers(tli_legacy *reader, const char *what,
                                   const tli_legacy_type *type, size_t count, int64_t *values);
/* The same two when numbers stay where they are: moves past them, gives their place. */
tl_status tli_legacy_locate(tli_legacy *reader, const char *what, const tli_legacy_type *type,
                            uint64_t tuples, uint64_t components, tli_legacy_block *block);
tl_status tli_legacy_locate_integers(tli_legacy *reader, const char *what,
                                     const tli_legacy_type *type, uint64_t count,
                                     tli_legacy_block *block);
/* Numbers [first, first + count) of a block. */
tl_status tli_legacy_block_numbers(tl_ctx *ctx, const tli_legacy_block *block, uint64_t first,
                                   uint64_t count, double *values);
void tli_legacy_block_integers(const tli_legacy_block *block, uint64_t first, size_t count,
                               int64_t *values);
/* The type int. */
const tli_legacy_type *tli_legacy_int(void);
const tli_legacy_type *tli_legacy_u8(void);
const tli_legacy_type *tli_legacy_f32(void);

/* ---- formats_legacy_cells.c ---- */

/* What follows CELLS (cell_type 0), or VERTICES, LINES, POLYGONS, TRIANGLE_STRIPS: appends to the
 * cells of the grid. place is the keyword. */
tl_status tli_legacy_read_cells(tli_legacy *reader, const char *place, int section);
tl_status tli_legacy_read_cell_types(tli_legacy *reader);
/* Once points, cells and types are there: counts agree, every index is below the point count. */
tl_status tli_legacy_close_cells(tli_legacy *reader);

/* ---- formats_legacy_places.c ---- */

/* What follows the counts of CELLS, or OFFSETS behind them. */
tl_status tli_legacy_locate_row(tli_legacy *reader, uint64_t cells, uint64_t size);
tl_status tli_legacy_locate_lists(tli_legacy *reader, uint64_t offset_count, uint64_t indices,
                                  uint64_t *cells);
/* What follows the header of an array of points or cells. */
tl_status tli_legacy_locate_array(tli_legacy *reader, const char *name, const tli_legacy_type *type,
                                  uint32_t components, uint64_t count);
/* Of cells [first, first + count): fills types, offsets from 0 and connectivity of an empty grid,
 * every id below the number of points. */
tl_status tli_legacy_read_part(const tli_legacy *reader, uint64_t first, uint64_t count,
                               tli_grid *part);
void tli_legacy_forget(const tli_legacy_places *places, const tli_legacy_block *block,
                       uint64_t first, uint64_t count);
void tli_legacy_drop_places(tl_ctx *ctx, tli_legacy_places *places);

/* ---- formats_legacy_data.c ---- */

/* What follows the keyword of an attribute of POINT_DATA or CELL_DATA; *known is false, and nothing
 * read, for any other keyword. */
tl_status tli_legacy_read_attribute(tli_legacy *reader, const tli_legacy_word *keyword,
                                    bool *known);
/* What follows FIELD: arrays of points or cells, or of the data set. */
tl_status tli_legacy_read_field(tli_legacy *reader);
/* What follows METADATA. */
void tli_legacy_skip_metadata(tli_legacy *reader);

#endif
