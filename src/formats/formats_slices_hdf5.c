/* What readers of HDF5 share: runs of rows of a data set as ids or as values of an array. */
#include "formats/formats_hdf5.h"

#include <stdio.h>
#include <string.h>

/* Ids converted at a time. */
#define CHUNK 16384

tl_status tli_h5_ids(tli_h5 *h5, const tli_h5_request *r, const char *path, uint64_t first,
                     uint64_t count, uint64_t limit, uint64_t add, uint32_t *out)
{
    tl_status st = TL_OK;
    int64_t *values = tl_mem_alloc(r->ctx, CHUNK, sizeof *values, &st);
    for (uint64_t done = 0; done < count && !st;) {
        uint64_t piece = count - done < CHUNK ? count - done : CHUNK, begin = first + done;
        st = tli_h5_ints(h5, path, &begin, &piece, values);
        for (uint64_t i = 0; i < piece && !st; i++) {
            if (values[i] < 0 || (uint64_t)values[i] >= limit)
                st = tl_fail(r->ctx, TL_ERR_FORMAT,
                             "'%s': '%s': value %llu is %lld, expected 0 to %llu", r->path, path,
                             (unsigned long long)(begin + i), (long long)values[i],
                             (unsigned long long)limit - 1);
            out[done + i] = (uint32_t)((uint64_t)values[i] + add);
        }
        done += piece;
    }
    tl_mem_free(r->ctx, values);
    return st;
}

tl_status tli_h5_number(tli_h5 *h5, const tli_h5_request *r, const char *path, uint64_t index,
                        uint64_t column, uint64_t most, uint64_t *value)
{
    tli_h5_data data;
    int64_t number = 0;
    tl_status st = tli_h5_describe(h5, path, &data);
    const uint64_t begin[2] = {index, column}, count[2] = {1, 1};
    if (!st && data.rank != 1 && data.rank != 2)
        return tl_fail(r->ctx, TL_ERR_FORMAT, "'%s': '%s' is no list or table", r->path, path);
    if (!st) st = tli_h5_ints(h5, path, begin, count, &number);
    if (!st && (number < 0 || (uint64_t)number > most))
        return tl_fail(r->ctx, TL_ERR_FORMAT, "'%s': '%s': value %llu is %lld, expected 0 to %llu",
                       r->path, path, (unsigned long long)index, (long long)number,
                       (unsigned long long)most);
    *value = (uint64_t)number;
    return st;
}

tl_status tli_h5_rows(tli_h5 *h5, const tli_h5_request *r, const char *path, uint64_t first,
                      uint64_t rows, uint32_t components, double *out)
{
    tli_h5_data data;
    uint64_t begin[TLI_H5_RANK_MAX] = {first}, count[TLI_H5_RANK_MAX] = {rows}, inner = 1;
    tl_status st = tli_h5_describe(h5, path, &data);
    if (st) return st;
    for (uint32_t d = 1; d < data.rank; d++) {
        count[d] = data.dims[d];
        inner *= data.dims[d];
    }
    if (data.rank < 1 || inner != components)
        return tl_fail(r->ctx, TL_ERR_FORMAT, "'%s': '%s' has %llu values a row, expected %u",
                       r->path, path, (unsigned long long)inner, components);
    return tli_h5_reals(h5, path, begin, count, out);
}
