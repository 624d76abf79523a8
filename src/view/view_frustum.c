/* What a frozen cut was made for, to be looked at from outside (Sondershaus 2007, figures 5.14 and
 * 6.20). */
#include "view/view_frustum.h"

#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "cut/cut_camera.h"

static const double COLOR[3] = {0.93, 0.52, 0.1};
static const double WIDTH_PX = 1.6;

/* Of each side of the picture: the line to the eye, and those across at two depths. */
enum { SIDES = 4, VERTS = 3 * SIDES, LINES = 3 * SIDES };

/* Depths along the view at which the box begins and ends. */
static void box_depths(const tl_camera *camera, const double bounds[6], const double forward[3],
                       double depths[2])
{
    depths[0] = (double)INFINITY;
    depths[1] = -(double)INFINITY;
    for (int corner = 0; corner < 8; corner++) {
        double to[3];
        for (int k = 0; k < 3; k++) to[k] = bounds[2 * k + (corner >> k & 1)] - camera->position[k];
        depths[0] = fmin(depths[0], vec_dot(to, forward));
        depths[1] = fmax(depths[1], vec_dot(to, forward));
    }
}

/* The vertices of a corner of the picture: at the eye, at the front, at the back. */
static void put_corner(const tl_camera *camera, const double forward[3], const double depths[2],
                       int corner, double *verts)
{
    double origin[3], direction[3], back[3];
    static const uint8_t RIGHT[SIDES] = {0, 1, 1, 0}, DOWN[SIDES] = {0, 0, 1, 1};
    tl_camera_ray(camera, RIGHT[corner] * (double)camera->size_px[0],
                  DOWN[corner] * (double)camera->size_px[1], origin, direction);
    vec_sub(origin, camera->position, back);
    const double start = vec_dot(back, forward), slope = vec_dot(direction, forward);
    const double least = camera->parallel_scale > 0 ? depths[0] : start;
    const double at[3] = {least, fmax(depths[0], least), fmax(depths[1], least)};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            verts[3 * (i * SIDES + corner) + k] =
                origin[k] + (at[i] - start) / slope * direction[k];
}

tl_status tli_frustum_lines(tl_ctx *ctx, const tl_camera *camera, const double bounds[6],
                            tl_polydata **lines)
{
    double forward[3], depths[2];
    *lines = NULL;
    tl_status st = tl_camera_check(ctx, camera);
    tl_polydata *p = tl_mem_zalloc(ctx, 1, sizeof *p, &st);
    if (st) return st;
    *p = (tl_polydata){.kind = TL_POLY_LINES, .vert_count = VERTS, .cell_count = LINES};
    p->xyz = tl_mem_alloc(ctx, VERTS, 3 * sizeof *p->xyz, &st);
    p->corners = tl_mem_alloc(ctx, LINES, 2 * sizeof *p->corners, &st);
    p->starts = tl_mem_alloc(ctx, LINES + 1, sizeof *p->starts, &st);
    if (st) {
        tl_polydata_destroy(ctx, p);
        return st;
    }
    vec_sub(camera->focal_point, camera->position, forward);
    const double length = vec_length(forward);
    for (int k = 0; k < 3; k++) forward[k] /= length;
    box_depths(camera, bounds, forward, depths);
    for (tl_lidx side = 0; side < SIDES; side++) {
        const tl_lidx next = (side + 1) % SIDES;
        const tl_lidx ends[3][2] = {{side, 2 * SIDES + side},
                                    {SIDES + side, SIDES + next},
                                    {2 * SIDES + side, 2 * SIDES + next}};
        put_corner(camera, forward, depths, (int)side, p->xyz);
        memcpy(p->corners + 6 * side, ends, sizeof ends);
    }
    for (tl_lidx i = 0; i <= LINES; i++) p->starts[i] = 2 * i;
    *lines = p;
    return TL_OK;
}

tl_status tli_make_frustum(tli_maker *maker, const tl_camera *camera)
{
    tl_status st = TL_OK;
    tl_polydata *lines = NULL;
    const tl_view *view = maker->view;
    const double *bounds = view->source->facts.bounds;
    if (!view->has_view || !tl_scene_flag(maker->agenda->scene, TL_NODE_DETAIL + 1, "frozen") ||
        tli_camera_is_same(&view->camera, camera))
        return TL_OK;
    tli_recipe recipe = tli_recipe_text(maker->recipe, "frustum");
    recipe = tli_recipe_bytes(recipe, &view->camera, sizeof view->camera);
    const tli_shape *shape = tli_maker_find(maker, recipe, &st);
    if (!st && !shape) {
        st = tli_frustum_lines(maker->ctx, &view->camera, bounds, &lines);
        if (!st) st = tli_maker_keep(maker, recipe, lines, NULL, &shape);
    }
    if (st) return st;
    tli_thing thing = tli_flat_lines(shape->parts[0], COLOR, WIDTH_PX);
    thing.recipe = recipe;
    return tli_maker_add(maker, &thing);
}
