/* Stage formats, internal: netCDF classic files out. A file is described whole, by dimensions and
 * arrays that make their own numbers, and then written front to back. */
#ifndef TETRALOD_SRC_FORMATS_NETCDF_WRITE_H
#define TETRALOD_SRC_FORMATS_NETCDF_WRITE_H

#include "formats/formats_emit.h"

/* Most dimensions of a variable that is written. */
#define TLI_NCW_RANK_MAX 2

typedef struct tli_ncw_dim {
    const char *name;
    uint64_t length; /* 0: that of the records */
} tli_ncw_dim;

/* An attribute of the file: text, or one number. */
typedef struct tli_ncw_attribute {
    const char *name;
    const char *text; /* NULL: a number */
    tl_scalar scalar; /* TL_I32 or TL_F32 */
    double value;
} tli_ncw_attribute;

/* A variable, of one record where its first dimension is that of the records. Its array has as many
 * numbers as its dimensions say. */
typedef struct tli_ncw_var {
    tli_out_array data; /* TL_U8: text; else TL_I32, TL_I64, TL_F32 or TL_F64 */
    uint32_t rank;
    uint32_t dims[TLI_NCW_RANK_MAX];
    const char *attribute, *text; /* NULL: it has no attribute */
} tli_ncw_var;

typedef struct tli_ncw {
    tli_ncw_dim *dims; /* [dim_count] */
    size_t dim_count;
    tli_ncw_attribute *attributes; /* [attribute_count] */
    size_t attribute_count;
    tli_ncw_var *vars; /* [var_count] */
    size_t var_count;
} tli_ncw;

/* Version of the format that holds the file: 2 (64-bit places), or 5 where a variable or a
 * dimension is too large for that or a number has 64 bits. */
int tli_ncw_version(const tli_ncw *file);
/* Bytes of all values, for the progress. */
uint64_t tli_ncw_bytes(const tli_ncw *file);
/* Writes the file into emit->sink. version: tli_ncw_version or larger. */
tl_status tli_ncw_emit(tli_emit *emit, const tli_ncw *file, int version);

#endif
