/* Stage formats, internal: what the writers are given. A file is described by arrays that make
 * their own numbers piece by piece, so that a mesh in memory and a sample that is never in memory
 * are written by the same code. */
#ifndef TETRALOD_SRC_FORMATS_EMIT_H
#define TETRALOD_SRC_FORMATS_EMIT_H

#include "base/base_file.h"
#include "tetralod/formats.h"

/* Writes tuples [begin, end) to out, in the array's own type and the byte order of the machine.
 * Runs on the pool, for any pieces in any order. */
typedef void (*tli_fill_fn)(const void *arg, uint64_t begin, uint64_t end, void *out);

typedef struct tli_out_array {
    const char *name;
    const char *unit; /* NULL or "": unknown */
    tl_scalar scalar;
    uint32_t components;
    uint64_t count; /* tuples */
    tli_fill_fn fill;
    const void *arg;
} tli_out_array;

/* Tets with their fields. */
typedef struct tli_out {
    tli_out_array points; /* 3 components */
    tli_out_array tets;   /* 4 components, TL_I32 or TL_I64 */
    const tli_out_array *point_arrays;
    uint32_t point_array_count;
    const tli_out_array *cell_arrays;
    uint32_t cell_array_count;
    double time; /* NaN: none */
} tli_out;

typedef enum tli_encoding { TLI_RAW = 0, TLI_ZLIB, TLI_TEXT } tli_encoding;

/* formats_write_vtu.c, formats_write_vtk.c; the latter knows no TLI_ZLIB. The file appears only
 * when complete. TL_ERR_IO, TL_ERR_UNSUPPORTED (legacy: indices past 31 bits), TL_ERR_CANCELLED. */
tl_status tli_emit_vtu(tl_ctx *ctx, const char *path, const tli_out *out, tli_encoding encoding);
tl_status tli_emit_vtk(tl_ctx *ctx, const char *path, const tli_out *out, tli_encoding encoding);

/* ---- what the two share: formats_emit.c ---- */

/* An output file on its way, and how far it is. */
typedef struct tli_emit {
    tl_ctx *ctx;
    tli_sink *sink;
    uint64_t done, total; /* bytes before compression, for the progress */
    uint64_t nonfinite;   /* numbers written as text that are not finite */
} tli_emit;

/* What regions are written as. */
#define TLI_REGION_NAME "region"
/* scalar if it holds all values, else TL_F64; values to a type that holds them. formats_write.c */
tl_status tli_narrowest(tl_ctx *ctx, const double *values, size_t count, tl_scalar scalar,
                        tl_scalar *narrow);
void tli_narrow(const double *values, size_t count, tl_scalar scalar, void *out);
/* Bytes of a tuple, and of all numbers of the arrays of out. */
size_t tli_out_tuple_bytes(const tli_out_array *array);
uint64_t tli_out_bytes(const tli_out *out);
/* Type of connectivity that holds all of it. */
tl_scalar tli_out_index_type(uint64_t point_count, uint64_t tet_count);
bool tli_big_endian_host(void);

/* Longest text of one number with a separator. */
#define TLI_NUMBER_BYTES 32
/* A number of so many digits into text [TLI_NUMBER_BYTES], whatever the locale; nan, inf. Returns
 * the length. */
int tli_print_real(char *text, double value, int digits);
/* Text as part of an attribute of an XML file. formats_write_series.c */
tl_status tli_emit_escaped(tli_sink *sink, const char *text);
/* Fills an array of one double, which arg points to. */
void tli_fill_number(const void *arg, uint64_t begin, uint64_t end, void *out);

/* The numbers of an array as they are in memory, or with the bytes of each number turned. */
tl_status tli_emit_raw(tli_emit *emit, const tli_out_array *array, bool swap);
/* The same as text, a tuple a line; every float is written so that it reads back the same. */
tl_status tli_emit_text(tli_emit *emit, const tli_out_array *array);
/* Closes the file, which appears if st is TL_OK, and says what there is to say. Returns st or the
 * failure of closing. */
tl_status tli_emit_close(tli_emit *emit, const char *path, tl_status st);

#endif
