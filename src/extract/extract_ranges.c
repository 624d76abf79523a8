/* Ranges of a scalar in blocks of tets. */
#include <math.h>

#include "extract/extract.h"

typedef struct job {
    const tl_lidx *tets;
    size_t tet_count;
    const double *scalar;
    double (*ranges)[2];
} job;

static tl_status measure_blocks(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t b = begin; b < end; b++) {
        double low = (double)INFINITY, high = -(double)INFINITY;
        size_t last =
            (b + 1) * TLI_RANGE_TETS < j->tet_count ? (b + 1) * TLI_RANGE_TETS : j->tet_count;
        for (size_t i = 4 * b * TLI_RANGE_TETS; i < 4 * last; i++) {
            double s = j->scalar[j->tets[i]];
            if (!isfinite(s)) continue;
            low = s < low ? s : low;
            high = s > high ? s : high;
        }
        j->ranges[b][0] = low;
        j->ranges[b][1] = high;
    }
    return TL_OK;
}

tl_status tl_range_index_create(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                                tl_range_index **ranges)
{
    tl_status st = TL_OK;
    size_t count = tl_mesh_tet_count(mesh), blocks = (count + TLI_RANGE_TETS - 1) / TLI_RANGE_TETS;
    *ranges = NULL;
    tl_range_index *r = tl_mem_zalloc(ctx, 1, sizeof *r, &st);
    double(*pairs)[2] = tl_mem_alloc(ctx, blocks, sizeof *pairs, &st);
    job j = {tl_mesh_tets(mesh), count, scalar, pairs};
    if (!st) st = tli_parallel(ctx, blocks, 16, measure_blocks, &j);
    if (st) {
        tl_mem_free(ctx, pairs);
        tl_mem_free(ctx, r);
        return st;
    }
    *r = (tl_range_index){count, pairs};
    *ranges = r;
    return TL_OK;
}

void tl_range_index_destroy(tl_ctx *ctx, tl_range_index *ranges)
{
    if (!ranges) return;
    tl_mem_free(ctx, ranges->ranges);
    tl_mem_free(ctx, ranges);
}
