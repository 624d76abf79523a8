/* Direct volume rendering: the mesh made ready once, then a view: vertices to the screen, doors to
 * tiles, rays through the mesh, a tile at a time. */
#include <math.h>

#include "draw/draw_layers.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192 };
/* Up to here a layer's absorption is a short sum. */
static const double STEP_DEPTH_MAX = 0.2;

/* ---- the mesh made ready ---- */

typedef struct ready {
    tl_volume *volume;
    const tl_lidx *tets, *opposite;
} ready;

static tl_status fill_cells(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const ready *r = arg;
    for (size_t t = begin; t < end; t++)
        for (size_t i = 0; i < 4; i++) {
            r->volume->cells[t].verts[i] = r->tets[4 * t + i];
            r->volume->cells[t].behind[i] = r->opposite[4 * t + i];
        }
    return TL_OK;
}

/* Faces with nothing behind, of tets with four vertices. */
static void list_doors(tl_volume *v, tl_lidx *doors)
{
    size_t count = 0;
    for (size_t t = 0; t < v->cell_count; t++) {
        if (tli_cell_is_flat(&v->cells[t])) continue;
        for (size_t i = 0; i < 4; i++)
            if (v->cells[t].behind[i] == TL_NONE) {
                if (doors) doors[count] = (tl_lidx)(4 * t + i);
                count++;
            }
    }
    v->door_count = count;
}

tl_status tl_volume_create(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                           tl_volume **volume)
{
    tl_status st = TL_OK;
    tl_lidx *own = NULL;
    *volume = NULL;
    tl_volume *v = tl_mem_zalloc(ctx, 1, sizeof *v, &st);
    if (st) return st;
    v->mesh = mesh;
    v->cell_count = mesh->tet_count;
    v->vert_count = mesh->vert_count;
    v->cells = tl_mem_alloc(ctx, v->cell_count, sizeof *v->cells, &st);
    if (!st && !opposite) st = tl_mesh_adjacency(ctx, mesh, &own, NULL);
    ready r = {v, mesh->tets, opposite ? opposite : own};
    if (!st) st = tli_parallel(ctx, v->cell_count, GRAIN, fill_cells, &r);
    if (!st) list_doors(v, NULL);
    v->doors = tl_mem_alloc(ctx, v->door_count, sizeof *v->doors, &st);
    if (!st) list_doors(v, v->doors);
    tl_mem_free(ctx, own);
    if (st)
        tl_volume_destroy(ctx, v);
    else
        *volume = v;
    return st;
}

void tl_volume_destroy(tl_ctx *ctx, tl_volume *volume)
{
    if (!volume) return;
    tl_mem_free(ctx, volume->doors);
    tl_mem_free(ctx, volume->cells);
    tl_mem_free(ctx, volume);
}

tl_volume_opts tl_volume_opts_defaults(void)
{
    return (tl_volume_opts){.struct_bytes = sizeof(tl_volume_opts),
                            .opacity_end = 0.999,
                            .step_depth = 0.1,
                            .ambient = 0.4,
                            .diffuse = 0.6,
                            .specular = 0.2,
                            .shininess = 20};
}

tl_status tli_volume_opts_take(tl_ctx *ctx, const tl_volume_opts *given, tl_volume_opts *opts)
{
    *opts = tl_volume_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_volume_opts", given, opts, sizeof *opts);
    if (st) return st;
    if (!(opts->step_depth > 0) || opts->step_depth > STEP_DEPTH_MAX || !(opts->opacity_end > 0) ||
        opts->opacity_end > 1)
        return tl_fail(ctx, TL_ERR_ARG, "step depth %g, end of rays at opacity %g are out of range",
                       opts->step_depth, opts->opacity_end);
    if (opts->order != TL_ORDER_EXACT && opts->order != TL_ORDER_CENTROIDS)
        return tl_fail(ctx, TL_ERR_ARG, "order %d of a volume, expected one of tl_volume_order",
                       (int)opts->order);
    if (opts->method < TL_VOLUME_AUTOMATIC || opts->method > TL_VOLUME_RAYS)
        return tl_fail(ctx, TL_ERR_ARG, "method %d of a volume, expected one of tl_volume_method",
                       (int)opts->method);
    if (!(opts->gradient_opacity >= 0) || !isfinite(opts->gradient_opacity))
        return tl_fail(ctx, TL_ERR_ARG, "a gradient opacity of %g, expected 0 or more",
                       opts->gradient_opacity);
    if (tli_volume_has_light(opts) && !opts->gradients)
        return tl_fail(ctx, TL_ERR_ARG,
                       "a volume that is lit or has gradient opacity without gradients");
    return tli_light_check(ctx, opts->ambient, opts->diffuse, opts->specular, opts->shininess);
}

/* ---- a view ---- */

/* What light and gradients add to the view. */
static tl_status open_light(tl_ctx *ctx, const tli_item *item, const tli_frame *frame,
                            tli_volume_view *view)
{
    tl_status st = TL_OK;
    const tl_volume_opts *o = &item->volume_opts;
    tli_cast *cast = &view->cast;
    if (!tli_volume_has_light(o)) return TL_OK;
    view->gradients = tl_mem_alloc(ctx, item->volume->vert_count, sizeof *view->gradients, &st);
    if (st) return st;
    tli_volume_gradients(o, item->volume->vert_count, view->gradients);
    cast->gradients = (const float(*)[4])view->gradients;
    cast->dims = o->gradient_opacity > 0;
    for (int k = 0; k < 3; k++) {
        cast->axes[0][k] = (float)frame->right[k];
        cast->axes[1][k] = (float)frame->up[k];
        cast->axes[2][k] = (float)frame->forward[k];
    }
    cast->ambient = o->lit ? (float)o->ambient : 1;
    cast->diffuse = o->lit ? (float)o->diffuse : 0;
    cast->specular = o->lit ? (float)o->specular : 0;
    cast->shininess = (float)o->shininess;
    return TL_OK;
}

tl_status tli_volume_view_open(tl_ctx *ctx, const tli_item *item, const tli_frame *frame,
                               const tl_image *image, tli_volume_view *view)
{
    tl_status st = TL_OK;
    const tl_volume_opts *o = &item->volume_opts;
    *view = (tli_volume_view){.follow = tli_cast_best()};
    view->verts = tl_mem_alloc(ctx, item->volume->vert_count, sizeof *view->verts, &st);
    if (!st) st = tli_volume_place(ctx, item, frame, view->verts);
    const float clear[2] = {(float)item->transfer->clear[0], (float)item->transfer->clear[1]};
    view->cast = (tli_cast){.cells = item->volume->cells,
                            .verts = view->verts,
                            .transfer = item->transfer,
                            .scale = frame->scale,
                            .unit = frame->unit,
                            .parallel = frame->parallel,
                            .opacity_end = (float)o->opacity_end,
                            .step_depth = (float)o->step_depth,
                            .clear = {clear[0], clear[1]}};
    if (!st) st = open_light(ctx, item, frame, view);
    if (!st) st = tli_doors_open(ctx, item->volume, frame, view->verts, clear, image, &view->doors);
    if (st) {
        tl_mem_free(ctx, view->gradients);
        tl_mem_free(ctx, view->verts);
    }
    return st;
}

void tli_volume_view_close(tl_ctx *ctx, tli_volume_view *view)
{
    tli_doors_close(&view->doors);
    tl_mem_free(ctx, view->gradients);
    tl_mem_free(ctx, view->verts);
}

bool tli_volume_view_misses(const tli_volume_view *view, size_t tile_index)
{
    const size_t *starts = view->doors.tiling.starts;
    return starts[tile_index] == starts[tile_index + 1];
}

tl_status tli_volume_view_draw(const tli_volume_view *view, size_t tile_index, tli_tile *tile)
{
    tli_ray rays[TLI_TILE_PIXELS];
    size_t ray_count = 0, hit = 0, hit_count;
    tl_status st =
        tli_doors_hits(&view->doors, tile_index, &tile->hits, &tile->hit_max, &hit_count);
    for (uint32_t pixel = 0; !st && pixel < TLI_TILE_PIXELS; pixel++) {
        size_t first = hit;
        while (hit < hit_count && tile->hits[hit].pixel == pixel) hit++;
        if (hit == first) {
            tli_tile_blend(tile, pixel);
            continue;
        }
        rays[ray_count++] =
            (tli_ray){.px = (float)(tile->px + pixel % TLI_TILE_PX),
                      .py = (float)(tile->py - pixel / TLI_TILE_PX),
                      .depth = tile->z[pixel],
                      .doors = tile->hits + first,
                      .door_count = hit - first,
                      .fragments = tile->sorted + tile->starts[pixel],
                      .fragment_count = tile->starts[pixel + 1] - tile->starts[pixel],
                      .rgba = tile->rgba[pixel]};
    }
    if (ray_count) view->follow(&view->cast, rays, ray_count);
    return st;
}

tl_status tl_draw_volume(tl_ctx *ctx, const tl_volume *volume, const double *scalar,
                         const tl_transfer *transfer, const tl_camera *camera,
                         const tl_volume_opts *opts, tl_image *image)
{
    tli_item item = {
        .kind = TLI_ITEM_VOLUME, .volume = volume, .scalar = scalar, .transfer = transfer};
    tli_item *const items[1] = {&item};
    tl_status st = tli_volume_opts_take(ctx, opts, &item.volume_opts);
    return st ? st : tli_cpu_draw(ctx, items, 1, camera, image);
}
