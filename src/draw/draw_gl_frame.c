/* A picture: opaque things first, with their depth. Then, where there is OpenGL 4.3 and the volume
 * is drawn by rays, translucent pieces go into lists, and both are blended along each ray, in one
 * pass. Else, from the far side to the near one, the farthest translucent layers that are left at
 * each pixel (depth peeling, Everitt 2001), and before each what the volume has between it and the
 * one drawn before; a pass over the volume serves several of them. So volume and surfaces are in
 * exact order (Cignoni et al. 1997, V). Sums are kept in 32-bit floats. */
#include <math.h>
#include <string.h>

#include "draw/draw_gl.h"
#include "draw/draw_layers.h"

/* Most translucent layers at a pixel; nearer ones are left out. */
enum { LAYERS_MAX = 256 };
/* Depths of the buffer reach a little beyond the things, relative to their extent. */
static const double MARGIN = 1e-3;

/* ---- a picture ---- */

/* Points and lines are translucent at their edges. */
static bool is_painted(const tli_item *item, bool translucent)
{
    if (item->kind == TLI_ITEM_VOLUME || !(item->look.opacity > 0)) return false;
    return (item->look.opacity < 1) == translucent ||
           ((item->kind == TLI_ITEM_POINTS || item->kind == TLI_ITEM_LINES) && translucent);
}

/* How far a thing reaches beyond its places, in units of the frame at a depth of 1. */
static double reach_of(const tli_item *item, const tli_frame *frame)
{
    const tl_line_opts *l = &item->line_opts;
    const tl_point_opts *p = &item->point_opts;
    if (item->kind == TLI_ITEM_POINTS)
        return p->radius > 0 ? p->radius / frame->unit : p->radius_px / frame->scale;
    if (item->kind != TLI_ITEM_LINES) return 0;
    double width = l->width > 0 ? l->width / frame->unit : l->width_px / frame->scale;
    return TLI_ARROW_WIDTH * (width + (l->halo_px + 1) / frame->scale);
}

/* The depths that things may have in a view. */
static void set_depths(tli_gl_view *view, tli_item *const *items, size_t item_count)
{
    double near = (double)INFINITY, far = -(double)INFINITY;
    for (size_t i = 0; i < item_count; i++) {
        const tli_gl_thing *thing = &((const tli_gl_item *)items[i]->own)->thing;
        if (items[i]->kind == TLI_ITEM_VOLUME || !(thing->low[0] <= thing->high[0])) continue;
        for (int corner = 0; corner < 8; corner++) {
            double xyz[3], at[3];
            for (int k = 0; k < 3; k++) xyz[k] = corner >> k & 1 ? thing->high[k] : thing->low[k];
            tli_frame_place(view->frame, xyz, at);
            double reach = reach_of(items[i], view->frame);
            near = fmin(near, at[2] - reach);
            far = fmax(far, at[2] + reach * fmax(1, at[2]));
        }
    }
    if (!(near <= far)) near = far = 0;
    if (!view->frame->parallel) {
        near = 0;
        far = fmax(far, 0);
    }
    double margin = MARGIN * (far > near ? far - near : 1);
    view->depths[0] = view->frame->parallel ? near - margin : 0;
    view->depths[1] = far + margin;
}

static void paint_things(const tli_gl_painter *painter, const tli_gl_view *view,
                         tli_item *const *items, size_t item_count, bool translucent, GLuint limit)
{
    GLint tag = 0;
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    for (size_t i = 0; i < item_count; i++)
        if (is_painted(items[i], translucent))
            tli_gl_thing_draw(painter, view, items[i], &((const tli_gl_item *)items[i]->own)->thing,
                              translucent, limit, &tag);
}

static void paint(const tli_gl_state *s, const tli_gl_view *view, tli_item *const *items,
                  size_t item_count, bool translucent, GLuint limit)
{
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(translucent ? GL_GREATER : GL_LEQUAL);
    paint_things(&s->painter, view, items, item_count, translucent, limit);
    glDisable(GL_DEPTH_TEST);
}

static void draw_opaque(const tli_gl_state *s, const tli_gl_view *view, tli_item *const *items,
                        size_t item_count, const float background[4])
{
    static const float end = 1;
    tli_gl_target_use(&s->opaque);
    glDepthMask(GL_TRUE);
    glClearBufferfv(GL_COLOR, 0, background);
    glClearBufferfv(GL_DEPTH, 0, &end);
    paint(s, view, items, item_count, false, s->before.depth);
}

/* The farthest layer that is nearer than limit; false if there is none. */
static bool draw_layer(tli_gl_state *s, const tli_gl_view *view, tli_item *const *items,
                       size_t item_count, const tli_gl_target *layer, GLuint limit)
{
    static const float nothing[4] = {0}, begin = 0;
    const float nearest[4] = {TLI_GL_NEAREST, 0, 0, 0};
    GLuint any = 0;
    tli_gl_target_use(layer);
    glDepthMask(GL_TRUE);
    glClearBufferfv(GL_COLOR, 0, nothing);
    glClearBufferfv(GL_COLOR, 1, nearest);
    glClearBufferfv(GL_DEPTH, 0, &begin);
    if (!s->query) glGenQueries(1, &s->query);
    glBeginQuery(GL_ANY_SAMPLES_PASSED, s->query);
    paint(s, view, items, item_count, true, limit);
    glEndQuery(GL_ANY_SAMPLES_PASSED);
    glGetQueryObjectuiv(s->query, GL_QUERY_RESULT, &any);
    return any != 0;
}

/* Puts a picture in front of the sum. */
static void cover(const tli_gl_state *s, GLuint picture)
{
    glUseProgram(s->cover);
    tli_gl_set_texture(s->cover, "layer", 0, picture);
    tli_gl_target_use(&s->sum);
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

static const tli_item *volume_of(tli_item *const *items, size_t item_count)
{
    for (size_t i = 0; i < item_count; i++)
        if (items[i]->kind == TLI_ITEM_VOLUME) return items[i];
    return NULL;
}

static bool has_layers(tli_item *const *items, size_t item_count)
{
    bool found = false;
    for (size_t i = 0; i < item_count && !found; i++) found = is_painted(items[i], true);
    return found;
}

/* Gives the next slabs [count] of the volume room of their own, the first one that of the sum. */
static tl_status open_slabs(tl_ctx *ctx, tli_gl_state *s, const tli_gl_view *view, int count)
{
    static const float nothing[4] = {0};
    GLenum places[TLI_GL_SLABS];
    tl_status st = TL_OK;
    for (int i = 0; i + 1 < count && !st; i++)
        st = tli_gl_target_set(ctx, s->gl, &s->slabs[i], view->width, view->height, TLI_GL_COLOR);
    if (st) return st;
    if (!s->slab_frame) glGenFramebuffers(1, &s->slab_frame);
    glBindFramebuffer(GL_FRAMEBUFFER, s->slab_frame);
    glViewport(0, 0, (GLsizei)view->width, (GLsizei)view->height);
    for (int i = 0; i < TLI_GL_SLABS; i++) {
        places[i] = GL_COLOR_ATTACHMENT0 + (GLenum)i;
        glFramebufferTexture2D(GL_FRAMEBUFFER, places[i], GL_TEXTURE_2D,
                               i >= count ? 0
                               : i        ? s->slabs[i - 1].color
                                          : s->sum.color,
                               0);
    }
    glDrawBuffers(count, places);
    for (int i = 1; i < count; i++) glClearBufferfv(GL_COLOR, i, nothing);
    return TL_OK;
}

tl_status tli_gl_go_on(tl_ctx *ctx)
{
    return tli_ctx_is_cancelled(ctx) ? tl_fail(ctx, TL_ERR_CANCELLED, "cancelled during a picture")
                                     : TL_OK;
}

/* What is translucent, far layers first, with the volume in between. */
static tl_status draw_layers(tl_ctx *ctx, tli_gl_state *s, const tli_gl_view *view,
                             tli_item *const *items, size_t item_count)
{
    static const float nothing[4] = {0};
    const tli_item *volume = volume_of(items, item_count);
    const tli_gl_item *own = volume ? volume->own : NULL;
    GLuint limits[TLI_GL_SLABS + 1] = {s->opaque.depth};
    bool more = true;
    tl_status st = TL_OK;
    tli_gl_target_use(&s->sum);
    glClearBufferfv(GL_COLOR, 0, nothing);
    cover(s, s->opaque.color);
    for (int done = 0; done < LAYERS_MAX && more && !st; done += TLI_GL_SLABS) {
        const tli_gl_target *layers[TLI_GL_SLABS];
        int count = 0;
        for (; count < TLI_GL_SLABS && more && !st; count++) {
            tli_gl_target *layer = &s->layers[(done + count) % (TLI_GL_SLABS + 1)];
            st = tli_gl_target_set(ctx, s->gl, layer, view->width, view->height,
                                   TLI_GL_COLOR | TLI_GL_DEPTH);
            if (!st) more = draw_layer(s, view, items, item_count, layer, limits[count]);
            layers[count] = layer;
            limits[count + 1] = layer->depth;
        }
        if (volume && !st) st = open_slabs(ctx, s, view, count);
        if (volume && !st)
            tli_gl_tets_draw(&s->projector, view, volume, &own->fog, &own->tets, limits, count);
        for (int i = 0; i < count && !st; i++) {
            if (volume && i) cover(s, s->slabs[i - 1].color);
            if (more || i + 1 < count) cover(s, layers[i]->color);
        }
        limits[0] = limits[count];
        if (!st) st = tli_gl_go_on(ctx);
    }
    return st;
}

/* The same by lists of what is translucent, and a ray a pixel through both. *again: there was too
 * little room for them, and now there is more. */
static tl_status draw_rays(tl_ctx *ctx, tli_gl_state *s, const tli_gl_view *view,
                           tli_item *const *items, size_t item_count, bool *again)
{
    tl_status st = TL_OK;
    size_t pixel_count = (size_t)view->width * view->height, given_up = 0, none;
    const tli_item *volume = volume_of(items, item_count);
    tli_gl_item *own = volume ? volume->own : NULL;
    tli_gl_caster *c = &s->caster;
    tli_gl_scene scene = {.item = volume,
                          .fog = own ? &own->fog : NULL,
                          .web = own ? &own->web : NULL,
                          .has_layers = has_layers(items, item_count),
                          .back = &s->opaque};
    *again = false;
    tli_gl_target_use(&s->sum);
    if (scene.has_layers) {
        st = tli_gl_painter_open(ctx, s->gl, true, &s->lister);
        if (!st) st = tli_gl_lists_begin(ctx, s->gl, &c->layers, pixel_count, true);
        if (!st) paint_things(&s->lister, view, items, item_count, true, s->opaque.depth);
        if (!st) st = tli_gl_lists_sort(ctx, s->gl, &c->sorter, &c->layers, pixel_count);
    }
    if (!st && own) st = tli_gl_web_enter(ctx, s->gl, c, view, &own->web, s->opaque.depth);
    if (st) return st;
    st = tli_gl_caster_follow(ctx, c, view, &scene, &s->sum);
    if (!st && scene.has_layers) st = tli_gl_lists_end(ctx, s->gl, &c->layers, again, &none);
    if (!st && own) st = tli_gl_lists_end(ctx, s->gl, &c->entries, again, &given_up);
    if (given_up && !*again)
        tl_log(ctx, TL_LOG_WARNING, "%s: %zu rays of %zu went in circles and were given up",
               s->gl->name, given_up, pixel_count);
    return st;
}

/* Translucent things and the volume, in front of what is opaque. */
static tl_status draw_rest(tl_ctx *ctx, tli_gl_state *s, const tli_gl_view *view,
                           tli_item *const *items, size_t item_count)
{
    tl_status st = TL_OK;
    const tli_item *volume = volume_of(items, item_count);
    tli_gl_item *own = volume ? volume->own : NULL;
    bool by_rays = s->gl->modern && (own ? own->web.vert_count > 0 : has_layers(items, item_count));
    bool must = own && volume->volume_opts.method == TL_VOLUME_RAYS;
    if (by_rays) {
        bool again = true;
        if (!own) st = tli_gl_caster_open(ctx, s->gl, &s->caster);
        while (again && !st) st = draw_rays(ctx, s, view, items, item_count, &again);
        if (st != TL_ERR_UNSUPPORTED || must) return st;
        tl_log(ctx, TL_LOG_DEBUG, "%s", tl_ctx_message(ctx));
        tl_ctx_clear(ctx);
    }
    st = TL_OK;
    if (own) st = tli_gl_tets_place(ctx, s->gl, &s->projector, view, volume, &own->tets);
    return st ? st : draw_layers(ctx, s, view, items, item_count);
}

tl_status tli_gl_frame_draw(tl_ctx *ctx, tli_gl_state *s, tli_gl_view *view, tli_item *const *items,
                            size_t item_count, const float background[4], const tl_image *behind,
                            const tli_gl_target **drawn)
{
    uint32_t w = view->width, h = view->height;
    bool is_opaque = !volume_of(items, item_count) && !has_layers(items, item_count);
    tl_status st = tli_gl_target_set(ctx, s->gl, &s->before, w, h, TLI_GL_DEPTH);
    if (!st) st = tli_gl_target_set(ctx, s->gl, &s->opaque, w, h, TLI_GL_COLOR | TLI_GL_DEPTH);
    if (!st && !is_opaque) st = tli_gl_target_set(ctx, s->gl, &s->sum, w, h, TLI_GL_COLOR);
    if (!st) st = tli_gl_send_depth(ctx, s, behind, view->frame->unit);
    if (st) return st;
    set_depths(view, items, item_count);
    draw_opaque(s, view, items, item_count, background);
    st = tli_gl_go_on(ctx);
    if (!is_opaque && !st) st = draw_rest(ctx, s, view, items, item_count);
    *drawn = is_opaque ? &s->opaque : &s->sum;
    if (!st) st = tli_gl_check(ctx, s->gl);
    if (st && st != TL_ERR_CANCELLED) { /* the card may not have what was asked for */
        tli_gl_lists_free(s->gl, &s->caster.entries);
        tli_gl_lists_free(s->gl, &s->caster.layers);
    }
    return st;
}

void tli_gl_frame_free(tli_gl_state *s)
{
    tli_gl_target_free(s->gl, &s->before);
    tli_gl_target_free(s->gl, &s->opaque);
    tli_gl_target_free(s->gl, &s->sum);
    for (int i = 0; i <= TLI_GL_SLABS; i++) tli_gl_target_free(s->gl, &s->layers[i]);
    for (int i = 0; i + 1 < TLI_GL_SLABS; i++) tli_gl_target_free(s->gl, &s->slabs[i]);
    glDeleteFramebuffers(1, &s->slab_frame);
    glDeleteQueries(1, &s->query);
}
