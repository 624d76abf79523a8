/* Stage formats, internal: netCDF files as named arrays. The classic formats (CDF-1, CDF-2, CDF-5)
 * are read here, out of the mapped bytes; netCDF-4 is HDF5 with conventions and read through
 * formats_hdf5.h where this build has it. */
#ifndef TETRALOD_SRC_FORMATS_NETCDF_H
#define TETRALOD_SRC_FORMATS_NETCDF_H

#include "formats/formats_reader.h"

/* Most dimensions of a variable that is read. */
#define TLI_NC_RANK_MAX 4
#define TLI_NC_NAME_MAX 256

typedef struct tli_nc_dim {
    char *name; /* owned */
    uint64_t length;
    bool is_record;
} tli_nc_dim;

typedef struct tli_nc_var {
    char *name; /* owned */
    uint32_t rank;
    uint64_t dims[TLI_NC_RANK_MAX]; /* of a record variable the first is the number of records */
    bool is_record, is_text;
    tl_scalar scalar;
    /* classic: where the data and the attributes begin; record_bytes of one record */
    uint64_t ofs, record_bytes, attributes_ofs;
} tli_nc_var;

typedef struct tli_nc {
    tl_ctx *ctx;
    const char *path; /* borrowed */
    const tli_map *map;
    int version; /* 1, 2, 5; 4: HDF5 */
    uint64_t record_count, record_step;
    tli_nc_dim *dims;
    size_t dim_count;
    tli_nc_var *vars;
    size_t var_count;
    struct tli_h5 *h5; /* netCDF-4 */
} tli_nc;

/* Reads the head of a classic file, or opens HDF5. Every variable is proved to lie in the file. On
 * failure, too, to be released with tli_nc_close. */
tl_status tli_nc_open(tl_ctx *ctx, const tli_source *source, tli_nc *nc);
void tli_nc_close(tli_nc *nc);

/* NULL if there is none. */
const tli_nc_var *tli_nc_find(const tli_nc *nc, const char *name);
/* The same with a number behind the name: "connect3". */
const tli_nc_var *tli_nc_find_numbered(const tli_nc *nc, const char *name, uint64_t number);
/* False if there is no such dimension. */
bool tli_nc_length(const tli_nc *nc, const char *name, uint64_t *length);
/* Values of one record, or of all of a variable that has none. */
uint64_t tli_nc_count(const tli_nc_var *var);

/* Reads values [first, first + count) of a record (0 for a variable without) to out[0],
 * out[stride] ... Text is TL_ERR_FORMAT, as is what does not lie in the variable. */
tl_status tli_nc_reals(const tli_nc *nc, const tli_nc_var *var, uint64_t record, uint64_t first,
                       uint64_t count, double *out, size_t stride);
/* The same for whole numbers in [low, high]; from each low is taken off. */
tl_status tli_nc_ids(const tli_nc *nc, const tli_nc_var *var, uint64_t first, uint64_t count,
                     int64_t low, int64_t high, uint32_t *out);
/* Row of a table of names, without the blanks and zero bytes at its end. */
tl_status tli_nc_text(const tli_nc *nc, const tli_nc_var *var, uint64_t row,
                      char text[TLI_NC_NAME_MAX]);
/* A text attribute of a variable; "" if it has none. */
tl_status tli_nc_attribute(const tli_nc *nc, const tli_nc_var *var, const char *name,
                           char text[TLI_NC_NAME_MAX]);

/* netCDF-4, formats_netcdf_hdf5.c: as above. */
tl_status tli_nc4_open(tli_nc *nc);
void tli_nc4_close(tli_nc *nc);
tl_status tli_nc4_reals(const tli_nc *nc, const tli_nc_var *var, uint64_t record, uint64_t first,
                        uint64_t count, double *out, size_t stride);
tl_status tli_nc4_text(const tli_nc *nc, const tli_nc_var *var, uint64_t row,
                       char text[TLI_NC_NAME_MAX]);
tl_status tli_nc4_attribute(const tli_nc *nc, const tli_nc_var *var, const char *name,
                            char text[TLI_NC_NAME_MAX]);

#endif
