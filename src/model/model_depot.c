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

tl_status tli_depot_open(tl_ctx *ctx, const char *path, bool anew, tli_depot **depot)
{
    tl_status st = TL_OK;
    tli_depot *d = tl_mem_zalloc(ctx, 1, sizeof *d, &st);
    *depot = NULL;
    if (st) return st;
    d->ctx = ctx;
    st = tli_scratch_open_named(ctx, path, anew, &d->file);
    if (!st) atomic_store(&d->end, tli_scratch_bytes(d->file));
    if (st)
        tli_depot_destroy(d);
    else
        *depot = d;
    return st;
}

tl_status tli_depot_cut(tli_depot *d, uint64_t end)
{
    uint64_t bytes = tli_scratch_bytes(d->file);
    if (bytes < end)
        return tl_fail(
            d->ctx, TL_ERR_DATA, "'%s' has %llu bytes, expected at least %llu: it was changed",
            tli_scratch_folder(d->file), (unsigned long long)bytes, (unsigned long long)end);
    atomic_store(&d->end, end);
    return TL_OK;
}

uint64_t tli_depot_end(const tli_depot *depot)
{
    return atomic_load(&depot->end);
}

tl_status tli_depot_sync(tl_ctx *ctx, tli_depot *depot)
{
    return tli_scratch_sync(ctx, depot->file);
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
