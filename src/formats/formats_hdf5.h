/* Stage formats, internal: HDF5 files as trees of named data sets. The one place that knows the
 * library (formats_tree_hdf5.c), which is not safe in several threads: one lock holds from open to
 * close. What the library can't be trusted with is checked before: the signature, the end of the
 * file, how many values a data set claims. */
#ifndef TETRALOD_SRC_FORMATS_HDF5_H
#define TETRALOD_SRC_FORMATS_HDF5_H

#include "formats/formats_reader.h"

#define TLI_H5_RANK_MAX 8
#define TLI_H5_PATH_MAX 1024

typedef struct tli_h5 tli_h5;

/* What a path names. */
typedef enum tli_h5_kind { TLI_H5_NONE = 0, TLI_H5_GROUP, TLI_H5_DATA } tli_h5_kind;

typedef struct tli_h5_data {
    uint32_t rank;
    uint64_t dims[TLI_H5_RANK_MAX];
    uint64_t count;         /* of values, all dimensions together */
    bool is_text, is_other; /* strings; or compounds and what else holds no numbers */
    tl_scalar scalar;
    size_t text_bytes; /* of strings of a fixed size, else 0 */
} tli_h5_data;

/* TL_ERR_FORMAT for a file without HDF5's signature, or shorter than it says. Waits for other
 * threads that have one open. */
tl_status tli_h5_open(tl_ctx *ctx, const char *path, const tli_map *map, tli_h5 **h5);
/* NULL is allowed. */
void tli_h5_close(tli_h5 *h5);

/* What is at a path such as "/VTKHDF/Points"; links to other files name nothing. */
tli_h5_kind tli_h5_at(tli_h5 *h5, const char *path);
/* Describes a data set; refuses one that claims more values than its storage could hold. */
tl_status tli_h5_describe(tli_h5 *h5, const char *path, tli_h5_data *data);
/* Calls visit for each member of a group, by name; ends at the first failure. */
typedef tl_status (*tli_h5_visit)(void *arg, const char *name);
tl_status tli_h5_members(tli_h5 *h5, const char *path, tli_h5_visit visit, void *arg);

/* The box of values from begin [rank] on, count [rank] along each dimension, as float64, or as
 * whole numbers of 64 bits; last dimension fastest. */
tl_status tli_h5_reals(tli_h5 *h5, const char *path, const uint64_t *begin, const uint64_t *count,
                       double *out);
tl_status tli_h5_ints(tli_h5 *h5, const char *path, const uint64_t *begin, const uint64_t *count,
                      int64_t *out);
/* String number index of a data set of strings or of bytes [rows][width], cut off to fit. */
tl_status tli_h5_text(tli_h5 *h5, const char *path, uint64_t index, char *text, size_t text_bytes);

/* Attributes of what is at path. False if there is none, or none of that kind. */
bool tli_h5_attribute_text(tli_h5 *h5, const char *path, const char *name, char *text,
                           size_t text_bytes);
bool tli_h5_attribute_reals(tli_h5 *h5, const char *path, const char *name, double *values,
                            size_t count);

/* ---- runs of rows: formats_slices_hdf5.c ---- */

/* Who asks, for messages. */
typedef struct tli_h5_request {
    tl_ctx *ctx;
    const char *path; /* of the file */
} tli_h5_request;
/* Values [first, first + count) of a list; each must lie in [0, limit), then add is added. */
tl_status tli_h5_ids(tli_h5 *h5, const tli_h5_request *r, const char *path, uint64_t first,
                     uint64_t count, uint64_t limit, uint64_t add, uint32_t *out);
/* One number, 0 to most, of a list or table. */
tl_status tli_h5_number(tli_h5 *h5, const tli_h5_request *r, const char *path, uint64_t index,
                        uint64_t column, uint64_t most, uint64_t *value);
/* Rows [first, first + rows) of a table of components columns; a list has one. */
tl_status tli_h5_rows(tli_h5 *h5, const tli_h5_request *r, const char *path, uint64_t first,
                      uint64_t rows, uint32_t components, double *out);

#endif
