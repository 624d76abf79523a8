/* Direct volume rendering: the mesh made ready once, then a picture: vertices to the screen, doors
 * to tiles, rays through the mesh, a tile at a time. */
#include <math.h>

#include "draw/draw_cast.h"
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
        const tl_lidx *q = v->cells[t].verts;
        bool flat = q[0] == q[1] || q[0] == q[2] || q[0] == q[3] || q[1] == q[2] || q[1] == q[3] ||
                    q[2] == q[3];
        for (size_t i = 0; i < 4 && !flat; i++)
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
    if (!(opts->gradient_opacity >= 0) || !isfinite(opts->gradient_opacity))
        return tl_fail(ctx, TL_ERR_ARG, "a gradient opacity of %g, expected 0 or more",
                       opts->gradient_opacity);
    if ((opts->lit || opts->gradient_opacity > 0) && !opts->gradients)
        return tl_fail(ctx, TL_ERR_ARG,
                       "a volume that is lit or has gradient opacity without "
                       "gradients");
    return tli_light_check(ctx, opts->ambient, opts->diffuse, opts->specular, opts->shininess);
}

/* ---- a picture ---- */

typedef struct picture {
    const tl_volume *volume;
    tli_frame *frame;
    tli_cast cast;
    tli_cast_fn follow;
    const double *scalar;
    tli_vert *verts;
    tli_tiles tiles;
    tl_image *image;
} picture;

static tl_status place_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const picture *p = arg;
    for (size_t v = begin; v < end; v++) {
        double at[3];
        tli_frame_place(p->frame, p->volume->mesh->xyz + 3 * v, at);
        double steps = (p->scalar[v] - p->cast.transfer->low) * p->cast.transfer->per_value;
        p->verts[v] = (tli_vert){(float)at[0], (float)at[1], (float)at[2], (float)steps};
    }
    return TL_OK;
}

static void draw_tile(const picture *p, size_t tile, const tli_door_hit *hits, size_t count)
{
    tli_ray rays[TLI_TILE_PX * TLI_TILE_PX];
    size_t ray_count = 0;
    uint32_t left = (uint32_t)(tile % p->tiles.columns) * TLI_TILE_PX;
    uint32_t top = (uint32_t)(tile / p->tiles.columns) * TLI_TILE_PX;
    for (size_t i = 0, end; i < count; i = end) {
        uint32_t column = left + hits[i].pixel % TLI_TILE_PX,
                 row = top + hits[i].pixel / TLI_TILE_PX;
        size_t at = (size_t)row * p->image->width + column;
        for (end = i + 1; end < count && hits[end].pixel == hits[i].pixel;) end++;
        rays[ray_count++] = (tli_ray){(float)(column + 0.5 - p->frame->middle[0]),
                                      (float)(p->frame->middle[1] - row - 0.5),
                                      (float)((double)p->image->depth[at] / p->frame->unit),
                                      hits + i,
                                      end - i,
                                      p->image->rgba + 4 * at};
    }
    if (ray_count) p->follow(&p->cast, rays, ray_count);
}

static tl_status draw_tiles(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const picture *p = arg;
    tl_status st = TL_OK;
    tli_door_hit *hits = NULL;
    size_t hit_max = 0, count = 0;
    for (size_t tile = begin; !st && tile < end; tile++) {
        st = tli_tile_hits(&p->tiles, tile, &hits, &hit_max, &count);
        if (!st) draw_tile(p, tile, hits, count);
    }
    tl_mem_free(p->tiles.ctx, hits);
    return st;
}

tl_status tl_draw_volume(tl_ctx *ctx, const tl_volume *volume, const double *scalar,
                         const tl_transfer *transfer, const tl_camera *camera,
                         const tl_volume_opts *opts, tl_image *image)
{
    tli_frame frame;
    tl_volume_opts own;
    picture p = {.volume = volume,
                 .frame = &frame,
                 .scalar = scalar,
                 .follow = tli_cast_best(),
                 .image = image};
    tl_status st = tli_volume_opts_take(ctx, opts, &own);
    if (!st && (own.lit || own.gradient_opacity > 0))
        st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "volumes are not lit");
    if (!st) st = tli_frame_set(ctx, camera, image, &frame);
    if (st) return st;
    p.cast = (tli_cast){.cells = volume->cells,
                        .transfer = transfer,
                        .scale = frame.scale,
                        .unit = frame.unit,
                        .parallel = frame.parallel,
                        .opacity_end = (float)own.opacity_end,
                        .step_depth = (float)own.step_depth};
    p.cast.verts = p.verts = tl_mem_alloc(ctx, volume->vert_count, sizeof *p.verts, &st);
    if (!st) st = tli_parallel(ctx, volume->vert_count, GRAIN, place_verts, &p);
    if (!st) st = tli_tiles_open(ctx, volume, &frame, p.verts, image, &p.tiles);
    if (!st) {
        st = tli_parallel(ctx, (size_t)p.tiles.columns * p.tiles.rows, 1, draw_tiles, &p);
        tli_tiles_close(&p.tiles);
    }
    tl_mem_free(ctx, p.verts);
    return st;
}
