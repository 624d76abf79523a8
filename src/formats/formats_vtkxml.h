/* Stage formats, internal: the parts of the reader for VTK's XML files (.vtu, .vti, .vtr, .vts).
 *   formats_vtkxml_head.c    what the file has: pieces and arrays, and where their numbers stand
 *   formats_vtkxml_source.c  one array: sizes checked against the file before anything is allocated
 *   formats_vtkxml_decode.c  its numbers, on the pool
 *   formats_vtkxml_blocks.c  zlib, LZ4 and LZMA blocks
 *   formats_vtkxml_fields.c  point and cell data, matched over the pieces
 *   formats_vtu.c, formats_vts.c  the grid: unstructured, structured
 *   formats_vtkxml.c         the reader
 * VX stands for VTK XML. */
#ifndef TETRALOD_SRC_FORMATS_VTKXML_H
#define TETRALOD_SRC_FORMATS_VTKXML_H

#include "formats/formats_grid.h"
#include "formats/formats_xml.h"

typedef enum tli_vx_kind {
    TLI_VX_UNSTRUCTURED,
    TLI_VX_IMAGE,
    TLI_VX_RECTILINEAR,
    TLI_VX_STRUCTURED
} tli_vx_kind;

typedef enum tli_vx_section {
    TLI_VX_POINT_DATA,
    TLI_VX_CELL_DATA,
    TLI_VX_FIELD_DATA,
    TLI_VX_POINTS,
    TLI_VX_CELLS,
    TLI_VX_COORDINATES
} tli_vx_section;

typedef enum tli_vx_coding { TLI_VX_ASCII, TLI_VX_BASE64, TLI_VX_RAW } tli_vx_coding;

typedef enum tli_vx_packing { TLI_VX_PLAIN, TLI_VX_ZLIB, TLI_VX_LZ4, TLI_VX_LZMA } tli_vx_packing;

/* A <DataArray> that holds numbers. */
typedef struct tli_vx_array {
    tli_vx_section section;
    tli_span name; /* empty if it has none */
    uint64_t ofs;  /* of its tag, for messages */
    tl_scalar scalar;
    uint32_t components; /* 0: not said */
    tli_vx_coding coding;
    tli_span run; /* its text, or the appended bytes from its offset to the end of the file */

    /* set by tli_vx_open */
    bool is_open;
    uint64_t value_count; /* numbers in the file */
    uint64_t byte_count;  /* of all numbers, unpacked; 0 for ascii */
    uint64_t data_chars;  /* where in the run the data begin: characters or bytes */
    uint32_t skip_bytes;  /* bytes of the header that share their base64 groups with the data */
    uint64_t block_bytes; /* packed: size of each block but the last, unpacked */
    uint64_t *marks;      /* packed: [mark_count] where each block begins, and the end. ascii: the
                             numbers before each chunk of text, and all; owned */
    uint64_t mark_count;
} tli_vx_array;

typedef struct tli_vx_piece {
    uint64_t ofs; /* of its tag */
    uint64_t point_count, cell_count;
    uint64_t first_point, first_cell; /* unstructured */
    int64_t extent[6];                /* structured: i0, i1, j0, j1, k0, k1, points, inclusive */
    size_t first_array, array_count;  /* into arrays, those of field data included */
} tli_vx_piece;

typedef struct tli_vx_file {
    tl_ctx *ctx;
    const tli_map *map;
    tli_vx_kind kind;
    bool big_endian, wide_header; /* header words of 8 bytes instead of 4 */
    tli_vx_packing packing;
    double origin[3], spacing[3], direction[9]; /* image; direction by rows */
    double time;                                /* NaN: none */
    tli_vx_array *arrays;                       /* [array_count], owned */
    size_t array_count, array_capacity;
    tli_vx_piece *pieces; /* [piece_count], owned; pieces without points are left out */
    size_t piece_count, piece_capacity;
    uint64_t claimed_bytes; /* of the file, by all arrays opened so far */
    size_t read_count;      /* arrays read so far, for the progress */
} tli_vx_file;

/* Reads all tags. On failure, too, to be released with tli_vx_release. */
tl_status tli_vx_head_read(tl_ctx *ctx, const tli_map *map, tli_vx_file *file);
void tli_vx_release(tli_vx_file *file);

/* "'Velocity' at byte 1234" into label [label_bytes]. */
void tli_vx_label(const tli_vx_array *array, char *label, size_t label_bytes);

/* The first array of a section of a piece, by name where name is not NULL; NULL if there is none.
 */
tli_vx_array *tli_vx_find(const tli_vx_file *file, const tli_vx_piece *piece,
                          tli_vx_section section, const char *name);

/* Reads the sizes of an array and checks them against the file; allocates little and decodes
 * nothing. Opening twice is allowed. */
tl_status tli_vx_open(tli_vx_file *file, tli_vx_array *array);
/* Opens and demands count numbers at least. More are said in the log. */
tl_status tli_vx_open_expecting(tli_vx_file *file, tli_vx_array *array, uint64_t count);

/* Where numbers go: to one of the four. The integers of the file must lie in [0, limit), then add
 * is added to each. */
typedef struct tli_vx_target {
    double *f64;
    uint8_t *u8;
    uint32_t *u32;
    uint64_t *u64;
    uint64_t limit, add;
} tli_vx_target;

/* Decodes the first count numbers of an open array, count <= value_count. Runs on the pool; reports
 * progress, so it can be cancelled. */
tl_status tli_vx_read(tli_vx_file *file, const tli_vx_array *array, uint64_t count,
                      const tli_vx_target *target);

/* Whether ranges of it can be read: plain bytes. */
static inline bool tli_vx_has_parts(const tli_vx_file *file, const tli_vx_array *array)
{
    return array->coding == TLI_VX_RAW && file->packing == TLI_VX_PLAIN;
}
/* Numbers [first, first + count) of an open array that has parts, to the start of target; the pages
 * of the file that they stand in are given back. Runs on the pool. */
tl_status tli_vx_read_part(tli_vx_file *file, const tli_vx_array *array, uint64_t first,
                           uint64_t count, const tli_vx_target *target);

/* For the two halves of the decoding: decodes chars [0, 4 * byte_count / 3) of base64 without white
 * space or padding; false if a character is none. */
bool tli_base64_decode(const char *text, size_t byte_count, uint8_t *bytes);
/* Characters, without padding, that hold so many bytes. */
uint64_t tli_base64_chars(uint64_t byte_count);
/* The first char_count characters of text that are no white space: text itself (*owned NULL) or a
 * copy. TL_ERR_FORMAT with *owned NULL if there are not so many. */
tl_status tli_base64_strip(tl_ctx *ctx, tli_span text, uint64_t char_count, const char **clean,
                           char **owned);

/* One thread's state of a decompressor. */
typedef struct tli_vx_unpacker tli_vx_unpacker;
tl_status tli_vx_unpacker_create(tl_ctx *ctx, tli_vx_packing packing, tli_vx_unpacker **unpacker);
void tli_vx_unpacker_destroy(tl_ctx *ctx, tli_vx_unpacker *unpacker);
/* Unpacks a block of exactly block_bytes. TL_ERR_FORMAT sets no message, but *wrong to what is
 * wrong with the block. */
tl_status tli_vx_unpack(tli_vx_unpacker *unpacker, const uint8_t *packed, size_t packed_bytes,
                        uint8_t *block, size_t block_bytes, const char **wrong);
/* The most bytes that so many packed ones can become. */
uint64_t tli_vx_unpacked_max(tli_vx_packing packing, uint64_t packed_bytes);

/* A field that all pieces have. */
typedef struct tli_vx_field {
    size_t index; /* in the lead piece */
    uint32_t components;
    tl_scalar scalar;
    tli_span name;
} tli_vx_field;
/* The fields on points or cells, opened and checked. Gives fields [*count]. */
tl_status tli_vx_fields_find(tli_vx_file *file, tl_on on, tli_vx_field **fields, size_t *count);
/* Its array in a piece. */
tli_vx_array *tli_vx_field_in(const tli_vx_file *file, tl_on on, const tli_vx_field *field,
                              const tli_vx_piece *piece);
/* As grids name it. */
void tli_vx_field_name(const tli_vx_field *field, char *name, size_t name_bytes);
/* Fills point_arrays and cell_arrays of a grid whose counts are set. box: extent of the whole for
 * structured kinds, else NULL. */
tl_status tli_vx_fields_read(tli_vx_file *file, const int64_t box[6], tli_grid *grid);
/* The values of a structured array of one piece into the whole: place [3] is where the piece
 * begins, counts its points or cells, whole those of the box. Rows go to their places. */
tl_status tli_vx_read_placed(tli_vx_file *file, const tli_vx_array *array, uint32_t components,
                             const uint64_t place[3], const uint64_t counts[3],
                             const uint64_t whole[3], double *values);

/* Counts the points and cells of an unstructured file into grid, numbers its pieces and opens what
 * describes their points and cells. */
tl_status tli_vx_unstructured_open(tli_vx_file *file, tli_grid *grid);
/* "array ...: value cell is end, expected at least last, the one before it". */
tl_status tli_vx_fail_offset(const tli_vx_file *file, const tli_vx_array *ends, uint64_t cell,
                             uint64_t end, uint64_t last);
/* Sets file->time from field data. */
tl_status tli_vx_time_read(tli_vx_file *file);

/* Adds the faces of polyhedra, where there are any, and names them in the connectivity.
 * formats_vtu_faces.c */
tl_status tli_vx_read_faces(tli_vx_file *file, tli_grid *grid);
tl_status tli_vx_read_unstructured(tli_vx_file *file, tli_grid *grid);
/* The box that the pieces of a structured file make, and where its points are. */
typedef struct tli_vx_structure {
    tli_vx_file *file; /* the first two are set by the caller */
    tli_grid *grid;    /* NULL: points are asked for by ranges */
    int64_t box[6];
    uint64_t dims[3], point_count;
    double *axes[3]; /* rectilinear: coordinates along each axis, owned; else NULL */
} tli_vx_structure;
tl_status tli_vx_structure_open(tli_vx_structure *structure);
/* Also after a failed opening. */
void tli_vx_structure_close(tli_vx_structure *structure);
/* xyz [count][3] of points [first, first + count); of a structured grid with one piece whose points
 * have parts. Runs on the pool. */
tl_status tli_vx_structure_points(const tli_vx_structure *structure, uint64_t first, uint64_t count,
                                  double *xyz);

tl_status tli_vx_read_structured(tli_vx_file *file, tli_grid *grid);

#endif
