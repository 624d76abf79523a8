/* The back end that draws nothing. It holds callers to what they promise: that what they lent stays
 * as it is until it is removed; and the front to the order of its calls. */
#include <string.h>

#include "draw/draw_backend.h"
#include "mesh/mesh.h"
#include "store/store_format.h"

typedef struct null_state {
    size_t item_count;
} null_state;

typedef struct null_item {
    uint64_t sum; /* over what the thing borrows */
} null_item;

static uint64_t add_bytes(uint64_t sum, const void *block, size_t count, size_t elem_bytes)
{
    return block && count ? tli_store_hash(sum, block, count * elem_bytes) : sum;
}

static uint64_t sum_polydata(uint64_t sum, const tl_polydata *p)
{
    sum = add_bytes(sum, p->xyz, p->vert_count, 3 * sizeof *p->xyz);
    sum = add_bytes(sum, p->normals, p->vert_count, 3 * sizeof *p->normals);
    sum = add_bytes(sum, p->corners, tli_corner_count(p), sizeof *p->corners);
    return add_bytes(sum, p->starts, p->starts ? p->cell_count + 1 : 0, sizeof *p->starts);
}

static uint64_t sum_item(const tli_item *item)
{
    size_t vert_count = 0;
    uint64_t sum = (uint64_t)item->kind;
    if (item->volume) vert_count = item->volume->vert_count;
    if (item->mesh) {
        vert_count = item->mesh->vert_count;
        sum = add_bytes(sum, item->mesh->xyz, vert_count, 3 * sizeof(double));
        sum = add_bytes(sum, item->mesh->tets, item->mesh->tet_count, 4 * sizeof(tl_lidx));
    }
    if (item->polydata) {
        vert_count = item->polydata->vert_count;
        sum = sum_polydata(sum, item->polydata);
    }
    sum = add_bytes(sum, item->scalar, vert_count, sizeof(double));
    sum = add_bytes(sum, item->look.scalar, vert_count, sizeof(double));
    sum = add_bytes(sum, item->transfer, 1, sizeof(tl_transfer));
    sum = add_bytes(sum, item->look.transfer, 1, sizeof(tl_transfer));
    return add_bytes(sum, item->volume_opts.gradients, vert_count, 3 * sizeof(double));
}

static tl_status null_open(tl_ctx *ctx, void **state)
{
    tl_status st = TL_OK;
    *state = tl_mem_zalloc(ctx, 1, sizeof(null_state), &st);
    return st;
}

static void null_close(tl_ctx *ctx, void *state)
{
    TL_ASSERT(((null_state *)state)->item_count == 0);
    tl_mem_free(ctx, state);
}

static const char *null_name(const void *state)
{
    (void)state;
    return "null";
}

static bool null_is_fast(const void *state)
{
    (void)state;
    return false;
}

static tl_status null_add(tl_ctx *ctx, void *state, tli_item *item)
{
    tl_status st = TL_OK;
    TL_ASSERT(item->id && !item->own);
    null_item *own = tl_mem_alloc(ctx, 1, sizeof *own, &st);
    if (st) return st;
    own->sum = sum_item(item);
    item->own = own;
    ((null_state *)state)->item_count++;
    return TL_OK;
}

static tl_status null_change(tl_ctx *ctx, void *state, tli_item *item)
{
    (void)ctx;
    (void)state;
    TL_ASSERT(item->own && item->kind == TLI_ITEM_SLICES && item->value_count);
    return TL_OK;
}

static void null_remove(tl_ctx *ctx, void *state, tli_item *item)
{
    TL_ASSERT(item->own && ((null_state *)state)->item_count);
    tl_mem_free(ctx, item->own);
    item->own = NULL;
    ((null_state *)state)->item_count--;
}

static tl_status null_draw(tl_ctx *ctx, void *state, tli_item *const *items, size_t item_count,
                           const tl_camera *camera, tl_image *image)
{
    (void)camera;
    (void)image;
    TL_ASSERT(item_count == ((null_state *)state)->item_count);
    for (size_t i = 0; i < item_count; i++) {
        TL_ASSERT(i == 0 || items[i]->id > items[i - 1]->id);
        if (sum_item(items[i]) != ((const null_item *)items[i]->own)->sum)
            return tl_fail(ctx, TL_ERR_ARG,
                           "thing %u of the renderer has changed since it was added",
                           (unsigned)items[i]->id);
    }
    return TL_OK;
}

const tli_backend tli_backend_null = {.open = null_open,
                                      .close = null_close,
                                      .name = null_name,
                                      .is_fast = null_is_fast,
                                      .add = null_add,
                                      .change = null_change,
                                      .remove = null_remove,
                                      .draw = null_draw};
