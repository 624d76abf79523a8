/* The back end on the processor, the reference of the others. */
#include "draw/draw_backend.h"

static tl_status cpu_open(tl_ctx *ctx, void **state)
{
    (void)ctx;
    *state = NULL;
    return TL_OK;
}

static void cpu_close(tl_ctx *ctx, void *state)
{
    (void)ctx;
    (void)state;
}

static const char *cpu_name(const void *state)
{
    (void)state;
    return "cpu";
}

static bool cpu_is_fast(const void *state)
{
    (void)state;
    return false;
}

static tl_status cpu_add(tl_ctx *ctx, void *state, tli_item *item)
{
    (void)state;
    if (item->kind == TLI_ITEM_VOLUME) return TL_OK;
    return tl_fail(ctx, TL_ERR_UNSUPPORTED, "the processor draws volumes only");
}

static tl_status cpu_change(tl_ctx *ctx, void *state, tli_item *item)
{
    (void)ctx;
    (void)state;
    (void)item;
    return TL_OK;
}

static void cpu_remove(tl_ctx *ctx, void *state, tli_item *item)
{
    (void)ctx;
    (void)state;
    (void)item;
}

static tl_status cpu_draw(tl_ctx *ctx, void *state, tli_item *const *items, size_t item_count,
                          const tl_camera *camera, tl_image *image)
{
    tl_status st = TL_OK;
    (void)state;
    for (size_t i = 0; i < item_count && !st; i++)
        st = tl_draw_volume(ctx, items[i]->volume, items[i]->scalar, items[i]->transfer, camera,
                            &items[i]->volume_opts, image);
    return st;
}

const tli_backend tli_backend_cpu = {.open = cpu_open,
                                     .close = cpu_close,
                                     .name = cpu_name,
                                     .is_fast = cpu_is_fast,
                                     .add = cpu_add,
                                     .change = cpu_change,
                                     .remove = cpu_remove,
                                     .draw = cpu_draw};
