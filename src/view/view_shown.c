/* What a renderer has of a content. Things stand in the renderer in their order; when another
 * content comes, those stay that both begin with. */
#include <math.h>

#include "view/view.h"

typedef struct shown_item {
    tli_recipe recipe; /* with the scale of widths and the time */
    tl_item item;
} shown_item;

struct tl_shown {
    tl_renderer *renderer;
    const tl_content *content; /* NULL: none */
    shown_item *items;         /* [item_count] of things in their order */
    size_t item_count, room;
    tl_polydata **outlines; /* [outline_count] silhouettes of the last camera */
    size_t outline_count;
};

tl_status tl_shown_create(tl_ctx *ctx, tl_renderer *renderer, tl_shown **shown)
{
    tl_status st = TL_OK;
    *shown = tl_mem_zalloc(ctx, 1, sizeof **shown, &st);
    if (!st) (*shown)->renderer = renderer;
    return st;
}

/* Takes all items from one on out of the renderer, the last ones first. */
static void remove_from(tl_ctx *ctx, tl_shown *shown, size_t first)
{
    while (shown->item_count > first)
        tl_renderer_remove(ctx, shown->renderer, shown->items[--shown->item_count].item);
}

static void remove_outlines(tl_ctx *ctx, tl_shown *shown)
{
    for (size_t i = 0; i < shown->outline_count; i++) tl_polydata_destroy(ctx, shown->outlines[i]);
    tl_mem_free(ctx, shown->outlines);
    shown->outlines = NULL;
    shown->outline_count = 0;
}

void tl_content_hide(tl_ctx *ctx, tl_shown *shown)
{
    remove_from(ctx, shown, 0);
    remove_outlines(ctx, shown);
    shown->content = NULL;
}

void tl_shown_destroy(tl_ctx *ctx, tl_shown *shown)
{
    if (!shown) return;
    tl_content_hide(ctx, shown);
    tl_mem_free(ctx, shown->items);
    tl_mem_free(ctx, shown);
}

/* Whether a thing stays in the renderer as it is for another camera and time. */
static bool stays(const tli_thing *thing)
{
    return thing->kind != TLI_THING_SILHOUETTES && thing->speed == 0;
}

static tli_recipe item_recipe(const tli_thing *thing, double widths)
{
    const bool has_widths = thing->kind != TLI_THING_VOLUME && thing->kind != TLI_THING_TRIANGLES;
    return has_widths ? tli_recipe_real(thing->recipe, widths) : thing->recipe;
}

/* Equal things of two contents may be two copies: a renderer borrows the one that it was given. */
static bool is_same_thing(const tli_thing *a, const tli_thing *b)
{
    return a->recipe == b->recipe && a->polydata == b->polydata && a->volume == b->volume &&
           a->scalar == b->scalar && a->transfer == b->transfer &&
           a->look.scalar == b->look.scalar && a->look.transfer == b->look.transfer &&
           a->volume_opts.gradients == b->volume_opts.gradients;
}

tl_status tl_content_show(tl_ctx *ctx, tl_shown *shown, const tl_content *content)
{
    tl_status st = TL_OK;
    size_t same = 0;
    if (shown->content == content) return TL_OK;
    if (content->thing_count > shown->room) {
        shown->items =
            tl_mem_resize(ctx, shown->items, content->thing_count, sizeof *shown->items, &st);
        if (!st) shown->room = content->thing_count;
    }
    if (st) {
        tl_content_hide(ctx, shown);
        return st;
    }
    const tl_content *before = shown->content;
    while (before && same < shown->item_count && same < content->thing_count &&
           stays(&content->things[same]) && stays(&before->things[same]) &&
           is_same_thing(&content->things[same], &before->things[same]))
        same++;
    remove_from(ctx, shown, same);
    remove_outlines(ctx, shown);
    shown->content = content;
    return TL_OK;
}

/* ---- adding ---- */

static tl_status add_lines(tl_ctx *ctx, tl_shown *shown, const tli_thing *thing,
                           const tl_polydata *lines, double widths, double time_s, tl_item *item)
{
    tl_line_opts line = thing->line;
    line.width_px *= widths;
    line.halo_px *= widths;
    line.phase = time_s * thing->speed * thing->period;
    return tl_renderer_add_lines(ctx, shown->renderer, lines, &thing->look, &line, item);
}

static tl_status add_silhouettes(tl_ctx *ctx, tl_shown *shown, const tli_thing *thing,
                                 const tl_camera *camera, double widths, tl_item *item)
{
    tl_status st = TL_OK;
    tl_polydata *lines = NULL;
    tl_edges_opts opts = tl_edges_opts_defaults();
    opts.kinds = TL_EDGE_SILHOUETTE;
    opts.camera = camera;
    shown->outlines =
        tl_mem_resize(ctx, shown->outlines, shown->outline_count + 1, sizeof *shown->outlines, &st);
    /* edges of a body are joined, so that this only reads them */
    if (!st) st = tl_edges_lines(ctx, shown->content->body->edges, &opts, &lines);
    if (st) return st;
    shown->outlines[shown->outline_count++] = lines;
    return add_lines(ctx, shown, thing, lines, widths, 0, item);
}

static tl_status add_thing(tl_ctx *ctx, tl_shown *shown, const tli_thing *thing,
                           const tl_camera *camera, double widths, double time_s, tl_item *item)
{
    tl_point_opts point = thing->point;
    switch (thing->kind) {
    case TLI_THING_VOLUME:
        return tl_renderer_add_volume(ctx, shown->renderer, thing->volume, thing->scalar,
                                      thing->transfer, &thing->volume_opts, item);
    case TLI_THING_TRIANGLES:
        return tl_renderer_add_surface(ctx, shown->renderer, thing->polydata, &thing->look, item);
    case TLI_THING_LINES:
        return add_lines(ctx, shown, thing, thing->polydata, widths, time_s, item);
    case TLI_THING_SILHOUETTES: return add_silhouettes(ctx, shown, thing, camera, widths, item);
    case TLI_THING_POINTS:
        point.radius_px *= widths;
        return tl_renderer_add_points(ctx, shown->renderer, thing->polydata, &thing->look, &point,
                                      item);
    }
    return TL_OK;
}

/* Brings the renderer up to date: from the first thing on that changes. */
static tl_status add_things(tl_ctx *ctx, tl_shown *shown, const tl_camera *camera, double widths,
                            double time_s)
{
    tl_status st = TL_OK;
    const tl_content *content = shown->content;
    size_t same = 0;
    while (same < shown->item_count && stays(&content->things[same]) &&
           shown->items[same].recipe == item_recipe(&content->things[same], widths))
        same++;
    remove_from(ctx, shown, same);
    remove_outlines(ctx, shown);
    for (size_t i = same; !st && i < content->thing_count; i++) {
        shown_item added = {item_recipe(&content->things[i], widths), 0};
        st = add_thing(ctx, shown, &content->things[i], camera, widths, time_s, &added.item);
        if (!st) shown->items[shown->item_count++] = added;
    }
    return st;
}

/* ---- drawing ---- */

tl_draw_opts tl_draw_opts_defaults(void)
{
    return (tl_draw_opts){.struct_bytes = sizeof(tl_draw_opts), .samples = 1, .scale = 1};
}

tl_status tl_content_draw(tl_ctx *ctx, tl_shown *shown, const tl_camera *camera,
                          const tl_draw_opts *opts, tl_image **image)
{
    tl_image *fine = NULL;
    tl_camera large = *camera;
    tl_draw_opts own = tl_draw_opts_defaults();
    *image = NULL;
    tl_status st = tli_opts_take(ctx, "tl_draw_opts", opts, &own, sizeof own);
    if (!st && (own.samples < 1 || own.samples > 8 || !(own.scale > 0) || !isfinite(own.scale) ||
                !isfinite(own.time_s)))
        st = tl_fail(ctx, TL_ERR_ARG, "%u rays a pixel at a scale of %g: expected 1 to 8, above 0",
                     own.samples, own.scale);
    if (!st && !shown->content) st = tl_fail(ctx, TL_ERR_ARG, "no content is shown");
    if (st) return st;
    for (int k = 0; k < 2; k++) large.size_px[k] *= own.samples;
    st = add_things(ctx, shown, camera, own.samples * own.scale, own.time_s);
    if (!st) st = tl_image_create(ctx, large.size_px[0], large.size_px[1], &fine);
    if (!st) st = tl_renderer_draw(ctx, shown->renderer, &large, fine);
    if (!st && own.samples == 1) {
        *image = fine;
        return TL_OK;
    }
    if (!st) st = tl_image_reduce(ctx, fine, own.samples, image);
    tl_image_destroy(ctx, fine);
    return st;
}
