/* The back end on the processor, the reference of the others. A picture is drawn by tiles, each by
 * one thread: opaque things first, by depth; then rays go through the volume from the camera to
 * them, and stop at the fragments of translucent things on their way (Cignoni et al. 1997, V). */
#include "draw/draw_layers.h"
#include "mesh/mesh.h"

typedef struct picture {
    tl_ctx *ctx;
    tli_frame frame;
    tli_layer *layers; /* [layer_count] in the order of the things, with their pieces by tile */
    tli_tiling *tiling;
    size_t layer_count;
    bool has_volume;
    tli_volume_view volume;
    tli_tile *tiles; /* of the workers */
    unsigned worker_count;
    uint32_t columns, rows;
    tl_image *image;
} picture;

/* ---- slices ---- */

/* Slices as triangles, made at the first picture after a change. */
typedef struct slices {
    tl_polydata *triangles; /* NULL: to be made */
    tl_look look;           /* the scalar is that of the triangles */
} slices;

/* The slice of a mesh that has the look's scalar as its one channel. */
static tl_status cut(tl_ctx *ctx, const tli_item *item, tl_polydata **triangles)
{
    tl_status st = TL_OK;
    tl_channel sliced = {"sliced", "", 1, TL_ON_VERTEX, TL_F64, item->scalar};
    tl_channel colored = {"colored", "", 1, TL_ON_VERTEX, TL_F64, item->look.scalar};
    tl_mesh mesh = *item->mesh;
    static const size_t first = 0;
    double *gradients = tl_mem_alloc(ctx, mesh.vert_count, 3 * sizeof *gradients, &st);
    mesh.channels = &colored;
    mesh.channel_count = 1;
    if (!st) st = tl_mesh_gradient(ctx, &mesh, &sliced, gradients);
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = item->values;
    opts.value_count = item->value_count;
    opts.gradients = gradients;
    opts.channels = &first;
    opts.channel_count = item->look.scalar ? 1 : 0;
    if (!st) st = tl_slice_mesh(ctx, &mesh, item->scalar, &opts, triangles);
    tl_mem_free(ctx, gradients);
    return st;
}

static tl_status open_slices(tl_ctx *ctx, const tli_item *item, const tli_frame *frame,
                             tli_layer *layer)
{
    tl_status st = TL_OK;
    slices *s = item->own;
    if (!s->triangles) {
        st = cut(ctx, item, &s->triangles);
        if (st) return st;
        s->look = item->look;
        if (s->look.scalar) s->look.scalar = s->triangles->channels[0].values;
    }
    return tli_layer_surface(ctx, s->triangles, &s->look, frame, layer);
}

/* ---- a picture ---- */

static tl_status open_layer(picture *p, const tli_item *item)
{
    tli_layer *layer = &p->layers[p->layer_count];
    tl_status st = TL_OK;
    if (item->kind == TLI_ITEM_SURFACE)
        st = tli_layer_surface(p->ctx, item->polydata, &item->look, &p->frame, layer);
    else if (item->kind == TLI_ITEM_LINES)
        st = tli_layer_lines(p->ctx, item->polydata, &item->look, &item->line_opts, &p->frame,
                             layer);
    else if (item->kind == TLI_ITEM_POINTS)
        st = tli_layer_points(p->ctx, item->polydata, &item->look, &item->point_opts, &p->frame,
                              layer);
    else if (item->kind == TLI_ITEM_SLICES)
        st = open_slices(p->ctx, item, &p->frame, layer);
    else
        return TL_OK;
    if (st) return st;
    st = tli_tiling_open(p->ctx, p->image, layer->piece_count, layer->box, layer->data,
                         &p->tiling[p->layer_count]);
    if (st)
        layer->release(p->ctx, layer->data);
    else
        p->layer_count++;
    return st;
}

static tl_status open_picture(picture *p, tli_item *const *items, size_t item_count)
{
    tl_status st = TL_OK;
    p->worker_count = tl_ctx_thread_count(p->ctx);
    p->columns = (p->image->width + TLI_TILE_PX - 1) / TLI_TILE_PX;
    p->rows = (p->image->height + TLI_TILE_PX - 1) / TLI_TILE_PX;
    p->layers = tl_mem_alloc(p->ctx, item_count, sizeof *p->layers, &st);
    p->tiling = tl_mem_alloc(p->ctx, item_count, sizeof *p->tiling, &st);
    p->tiles = tl_mem_zalloc(p->ctx, p->worker_count, sizeof *p->tiles, &st);
    for (size_t i = 0; i < item_count && !st; i++)
        if (items[i]->kind == TLI_ITEM_VOLUME) {
            st = tli_volume_view_open(p->ctx, items[i], &p->frame, p->image, &p->volume);
            p->has_volume = !st;
        } else
            st = open_layer(p, items[i]);
    return st;
}

static void close_picture(picture *p)
{
    for (unsigned w = 0; p->tiles && w < p->worker_count; w++) {
        tl_mem_free(p->ctx, p->tiles[w].fragments);
        tl_mem_free(p->ctx, p->tiles[w].sorted);
        tl_mem_free(p->ctx, p->tiles[w].hits);
    }
    if (p->has_volume) tli_volume_view_close(p->ctx, &p->volume);
    for (size_t i = 0; i < p->layer_count; i++) {
        tli_tiling_close(p->ctx, &p->tiling[i]);
        p->layers[i].release(p->ctx, p->layers[i].data);
    }
    tl_mem_free(p->ctx, p->tiles);
    tl_mem_free(p->ctx, p->tiling);
    tl_mem_free(p->ctx, p->layers);
}

static bool is_empty(const picture *p, size_t tile)
{
    for (size_t i = 0; i < p->layer_count; i++)
        if (p->tiling[i].starts[tile] < p->tiling[i].starts[tile + 1]) return false;
    return !p->has_volume || tli_volume_view_misses(&p->volume, tile);
}

static tl_status draw_tile(const picture *p, size_t index, tli_tile *tile)
{
    tli_tile_load(tile, p->image, (uint32_t)(index % p->columns) * TLI_TILE_PX,
                  (uint32_t)(index / p->columns) * TLI_TILE_PX);
    for (size_t i = 0; i < p->layer_count; i++) {
        const tli_tiling *b = &p->tiling[i];
        for (size_t at = b->starts[index]; at < b->starts[index + 1]; at++)
            p->layers[i].draw(p->layers[i].data, b->entries[at], tile);
    }
    tl_status st = tli_tile_sort(tile);
    if (!st && p->has_volume)
        st = tli_volume_view_draw(&p->volume, index, tile);
    else if (!st)
        for (uint32_t pixel = 0; pixel < TLI_TILE_PIXELS; pixel++) tli_tile_blend(tile, pixel);
    if (!st) tli_tile_store(tile, p->image);
    return st;
}

static tl_status draw_tiles(void *arg, size_t begin, size_t end, unsigned worker)
{
    const picture *p = arg;
    tl_status st = TL_OK;
    tli_tile *tile = &p->tiles[worker];
    tile->ctx = p->ctx;
    tile->frame = &p->frame;
    for (size_t i = begin; !st && i < end; i++)
        if (!is_empty(p, i)) st = draw_tile(p, i, tile);
    return st;
}

tl_status tli_cpu_draw(tl_ctx *ctx, tli_item *const *items, size_t item_count,
                       const tl_camera *camera, tl_image *image)
{
    picture p = {.ctx = ctx, .image = image};
    tl_status st = tli_frame_set(ctx, camera, image, &p.frame);
    if (st) return st;
    st = open_picture(&p, items, item_count);
    if (!st) st = tli_parallel(ctx, (size_t)p.columns * p.rows, 1, draw_tiles, &p);
    close_picture(&p);
    return st;
}

/* ---- the table ---- */

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
    tl_status st = TL_OK;
    (void)state;
    if (item->kind == TLI_ITEM_SLICES) item->own = tl_mem_zalloc(ctx, 1, sizeof(slices), &st);
    return st;
}

static void cpu_remove(tl_ctx *ctx, void *state, tli_item *item)
{
    slices *s = item->own;
    (void)state;
    if (s) tl_polydata_destroy(ctx, s->triangles);
    tl_mem_free(ctx, s);
    item->own = NULL;
}

static tl_status cpu_change(tl_ctx *ctx, void *state, tli_item *item)
{
    slices *s = item->own;
    (void)state;
    tl_polydata_destroy(ctx, s->triangles);
    s->triangles = NULL;
    return TL_OK;
}

static tl_status cpu_draw(tl_ctx *ctx, void *state, tli_item *const *items, size_t item_count,
                          const tl_camera *camera, tl_image *image)
{
    (void)state;
    return tli_cpu_draw(ctx, items, item_count, camera, image);
}

const tli_backend tli_backend_cpu = {.open = cpu_open,
                                     .close = cpu_close,
                                     .name = cpu_name,
                                     .is_fast = cpu_is_fast,
                                     .add = cpu_add,
                                     .change = cpu_change,
                                     .remove = cpu_remove,
                                     .draw = cpu_draw};
