/* The place under a pixel, and what a content has at a place. What finds tets is made when a body
 * is asked for the first time. */
#include <math.h>
#include <stdlib.h>

#include "view/view_places.h"

enum { VEILS_FIRST = 16 };

/* ---- finding tets ---- */

/* The locator of a body, which stays with it; those that borrow a mesh ask its owner. */
static tl_status get_locator(tl_ctx *ctx, tli_body *body, const tl_locator **locator)
{
    while (body->base) body = body->base;
    tl_status st = TL_OK;
    tli_lock_take(&body->locating);
    if (!body->locator) st = tl_locator_create(ctx, body->mesh, NULL, &body->locator);
    *locator = body->locator;
    tli_lock_give(&body->locating);
    return st;
}

/* The run of tets of a patch that a tet is of; run_count: it is not known. */
static size_t run_of(const tli_body *body, tl_lidx tet)
{
    const tl_channel *marks = tl_mesh_channel_by_name(body->mesh, TLI_MARKS);
    size_t run = 0;
    if (!body->run_count) return 0;
    if (marks) return (size_t)marks->values[tet];
    for (size_t first = 0; run < body->run_count; run++) {
        first += body->runs[run].tets;
        if (tet < first) break;
    }
    return run;
}

/* ---- probing ---- */

/* Takes away what only a view knows of. */
static void hide_marks(tl_probe *probe)
{
    size_t kept = 0;
    for (size_t i = 0; i < probe->value_count; i++)
        if (strcmp(probe->values[i].name, TLI_MARKS) != 0) probe->values[kept++] = probe->values[i];
    probe->value_count = kept;
}

static tl_status probe_body(tl_ctx *ctx, tli_body *body, const double xyz[3], tl_probe *probe)
{
    const tl_locator *locator = NULL;
    tl_status st = get_locator(ctx, body, &locator);
    if (!st) st = tl_mesh_probe(ctx, body->mesh, locator, xyz, probe);
    if (st) return st;
    const size_t run = probe->is_inside ? run_of(body, probe->tet) : body->run_count;
    if (run < body->run_count) {
        probe->patch = body->runs[run].patch;
        probe->level = body->runs[run].level;
    }
    for (size_t c = 0; c < probe->value_count && body->run_count; c++)
        probe->values[c].error = run < body->run_count && c < body->error_count
                                     ? body->run_errors[run * body->error_count + c]
                                     : (double)INFINITY;
    hide_marks(probe);
    return TL_OK;
}

tl_status tl_content_probe(tl_ctx *ctx, const tl_content *content, const double xyz[3],
                           tl_probe *probe)
{
    tli_body *body = NULL;
    *probe = (tl_probe){0};
    if (!content->places) return probe_body(ctx, content->body, xyz, probe);
    memcpy(probe->xyz, xyz, sizeof probe->xyz);
    tl_status st = tli_places_around(ctx, content->places, xyz, &body);
    if (!st && body) st = probe_body(ctx, body, xyz, probe);
    if (!st) st = tli_places_name(ctx, content->places, probe);
    tli_body_release(body);
    return st;
}

/* ---- picking ---- */

/* Along the line the distance of the opaque thing in a picture; infinite: none. */
static double opaque_distance(const tl_camera *camera, const tl_image *image, double x_px,
                              double y_px, const tli_sight *sight)
{
    double ahead[3], depth, cosine = 0, length = 0, start = 0;
    if (!image || !(x_px >= 0 && y_px >= 0)) return (double)INFINITY;
    const double x = floor(x_px * image->width / camera->size_px[0]);
    const double y = floor(y_px * image->height / camera->size_px[1]);
    if (x >= image->width || y >= image->height) return (double)INFINITY;
    depth = (double)image->depth[(size_t)y * image->width + (size_t)x];
    for (int k = 0; k < 3; k++) {
        ahead[k] = camera->focal_point[k] - camera->position[k];
        length += ahead[k] * ahead[k];
    }
    for (int k = 0; k < 3; k++) {
        cosine += ahead[k] / sqrt(length) * sight->direction[k];
        start += ahead[k] / sqrt(length) * (sight->origin[k] - camera->position[k]);
    }
    return (depth - start) / cosine;
}

/* What lies before what is opaque. */
typedef struct search {
    tl_ctx *ctx;
    tli_sight sight;
    double end; /* of what is opaque; infinite: nothing is */
    tli_veil *veils;
    size_t veil_count, veil_max;
    tli_fog fog;
} search;

static tl_status add_veil(search *s, double t, double opacity)
{
    tl_status st = TL_OK;
    if (s->veil_count == s->veil_max) {
        const size_t most = s->veil_max ? 2 * s->veil_max : VEILS_FIRST;
        tli_veil *grown = tl_mem_resize(s->ctx, s->veils, most, sizeof *grown, &st);
        if (st) return st;
        s->veils = grown;
        s->veil_max = most;
    }
    s->veils[s->veil_count++] = (tli_veil){t, -log1p(-opacity)};
    return TL_OK;
}

static tl_status meet_triangles(search *s, const tl_polydata *p, double opacity)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < p->cell_count; i++) {
        double t, corners[3][3];
        for (size_t c = 0; c < 3; c++)
            memcpy(corners[c], p->xyz + 3 * (size_t)p->corners[3 * i + c], sizeof corners[c]);
        if (!tli_sight_triangle(&s->sight, TLI_CORNERS(corners), &t)) continue;
        if (opacity >= 1)
            s->end = fmin(s->end, t);
        else
            st = add_veil(s, t, opacity);
    }
    return st;
}

static tl_status meet_things(search *s, const tl_content *content)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < content->thing_count; i++) {
        const tli_thing *thing = &content->things[i];
        if (thing->kind == TLI_THING_TRIANGLES)
            st = meet_triangles(s, thing->polydata, thing->look.opacity);
        else if (thing->kind == TLI_THING_VOLUME)
            s->fog = (tli_fog){thing->scalar, thing->transfer};
    }
    return st;
}

static int by_place(const void *a, const void *b)
{
    const tli_veil *x = a, *y = b;
    return (x->t > y->t) - (x->t < y->t);
}

/* Where a line comes into the mesh. body may be NULL: there is none. */
static tl_status meet_mesh(tl_ctx *ctx, tli_body *body, const tli_sight *sight, double *t,
                           bool *is_hit)
{
    const tl_locator *locator = NULL;
    if (!body) return TL_OK;
    tl_status st = get_locator(ctx, body, &locator);
    return st ? st
              : tli_sight_meet(ctx, body->mesh, locator, body->bounds, sight, NULL, 0, t, is_hit);
}

/* Half of the opacity on a line: of all things, or, where there is no volume, of those alone that
 * need no mesh. */
static tl_status meet_half(search *s, tli_body *body, double *t, bool *is_hit)
{
    const tl_locator *locator = NULL;
    tl_status st = s->fog.scalar ? get_locator(s->ctx, body, &locator) : TL_OK;
    if (s->veil_count) qsort(s->veils, s->veil_count, sizeof *s->veils, by_place);
    if (st) return st;
    return tli_sight_half(s->ctx, body ? body->mesh : NULL, locator, body ? body->bounds : NULL,
                          &s->sight, &s->fog, s->veils, s->veil_count, s->end, t, is_hit);
}

tl_status tl_content_pick(tl_ctx *ctx, const tl_content *content, const tl_camera *camera,
                          double x_px, double y_px, const tl_image *image, double xyz[3],
                          bool *is_hit)
{
    double t = 0;
    search s = {.ctx = ctx};
    tli_body *near = NULL;
    *is_hit = false;
    tl_status st = tl_camera_check(ctx, camera);
    if (st) return st;
    tl_camera_ray(camera, x_px, y_px, s.sight.origin, s.sight.direction);
    s.sight.least = camera->parallel_scale > 0 ? -(double)INFINITY : 0;
    s.end = opaque_distance(camera, image, x_px, y_px, &s.sight);
    st = meet_things(&s, content);
    if (!st) st = meet_half(&s, content->body, &t, is_hit);
    if (!st && !*is_hit && content->places)
        st = tli_places_along(ctx, content->places, &s.sight, &near);
    if (!st && !*is_hit)
        st = meet_mesh(ctx, content->places ? near : content->body, &s.sight, &t, is_hit);
    tli_body_release(near);
    tl_mem_free(ctx, s.veils);
    for (int k = 0; k < 3 && *is_hit; k++) xyz[k] = s.sight.origin[k] + t * s.sight.direction[k];
    return st;
}
