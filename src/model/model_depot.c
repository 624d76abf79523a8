/* Blocks one behind the other in a working file. */
#include "model/model_depot.h"

#include <stdatomic.h>

#include "base/base_scratch.h"

struct tli_depot {
    tl_ctx *ctx;
    tli_scratch *file;
    _Atomic uint64_t end;
};

tl_status tli_depot_create(tl_ctx *ctx, const char *folder, tli_depot **depot)
{
    tl_status st = TL_OK;
    tli_depot *d = tl_mem_zalloc(ctx, 1, sizeof *d, &st);
    *depot = NULL;
    if (st) return st;
    d->ctx = ctx;
    st = tli_scratch_open(ctx, folder, &d->file);
    if (st)
        tli_depot_destroy(d);
    else
        *depot = d;
    return st;
}

void tli_depot_destroy(tli_depot *depot)
{
    if (!depot) return;
    tli_scratch_close(depot->file);
    tl_mem_free(depot->ctx, depot);
}

tl_status tli_depot_put(tl_ctx *ctx, tli_depot *depot, const void *bytes, size_t byte_count,
                        uint64_t *ofs)
{
    *ofs = atomic_fetch_add(&depot->end, byte_count);
    return tli_scratch_write(ctx, depot->file, *ofs, bytes, byte_count);
}

tl_status tli_depot_get(tl_ctx *ctx, const tli_depot *depot, uint64_t ofs, void *bytes,
                        size_t byte_count)
{
    return tli_scratch_read(ctx, depot->file, ofs, bytes, byte_count);
}

void tli_depot_clear(tli_depot *depot)
{
    atomic_store(&depot->end, 0);
}
