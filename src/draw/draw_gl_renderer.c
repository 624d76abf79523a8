/* The back end on OpenGL: opaque things first, with their depth; then, from the far side to the
 * near one, the farthest translucent layer that is left at each pixel (depth peeling, Everitt 2001)
 * and before it what the volume has between that layer and the one drawn before it, so that volume
 * and surfaces are in exact order (Cignoni et al. 1997, V). Where there is OpenGL 4.3, and the
 * volume is drawn by rays, translucent pieces go into lists, and both are blended along each ray,
 * in one pass. Sums are kept in 32-bit floats. */
#include <math.h>
#include <string.h>

#include "draw/draw_gl.h"
#include "draw/draw_layers.h"
#include "draw/draw_shaders.h"

/* Most translucent layers at a pixel; nearer ones are left out. */
enum { LAYERS_MAX = 256 };
/* Rows of a picture that are read back at once. */
enum { BAND_ROWS = 64 };
/* Depths of the picture beyond all things: of nothing there, for shaders. */
static const float NEAREST = -1e30F, FARTHEST = 1e30F;
/* Depths of the buffer reach a little beyond the things, relative to their extent. */
static const double MARGIN = 1e-3;

typedef struct gl_state {
    tli_gl *gl;
    tli_gl_projector projector;
    tli_gl_caster caster;
    tli_gl_painter painter, lister; /* into pictures, into lists */
    GLuint cover;                   /* program: a picture over another */
    tli_gl_target before;           /* depth alone is used: of what the picture holds */
    tli_gl_target opaque, sum;      /* opaque things; all */
    tli_gl_target layers[2];        /* in turns the farthest layer that is left, and the last one */
} gl_state;

/* A thing in OpenGL. */
typedef struct gl_item {
    tli_gl_thing thing;
    /* of a volume */
    tli_gl_fog fog;
    tli_gl_web web;   /* for rays; empty: it is projected */
    tli_gl_tets tets; /* for projection, from the first picture on that needs them */
} gl_item;

/* ---- opening ---- */

static tl_status open_programs(tl_ctx *ctx, gl_state *s)
{
    static const tli_gl_source LAYERS = {
        "layers", false, {{tli_shader_screen_vert}, {tli_shader_layer_frag}}};
    tl_status st = tli_gl_begin(ctx, s->gl);
    if (st) return st;
    st = tli_gl_painter_open(ctx, s->gl, false, &s->painter);
    if (!st) st = tli_gl_program(ctx, s->gl, &LAYERS, &s->cover);
    return tli_gl_end(ctx, s->gl, st);
}

static void gl_close(tl_ctx *ctx, void *state)
{
    gl_state *s = state;
    if (s->gl && !tli_gl_begin(ctx, s->gl)) {
        tli_gl_projector_close(s->gl, &s->projector);
        tli_gl_caster_close(s->gl, &s->caster);
        tli_gl_painter_close(&s->painter);
        tli_gl_painter_close(&s->lister);
        glDeleteProgram(s->cover);
        tli_gl_target_free(s->gl, &s->before);
        tli_gl_target_free(s->gl, &s->opaque);
        tli_gl_target_free(s->gl, &s->sum);
        tli_gl_target_free(s->gl, &s->layers[0]);
        tli_gl_target_free(s->gl, &s->layers[1]);
        tli_gl_end(ctx, s->gl, TL_OK);
    }
    tli_gl_close(ctx, s->gl);
    tl_mem_free(ctx, s);
}

tl_status tli_gl_backend_open(tl_ctx *ctx, tli_gl_kind kind, void **state)
{
    tl_status st = TL_OK;
    gl_state *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    st = tli_gl_open(ctx, kind, &s->gl);
    if (!st) st = open_programs(ctx, s);
    if (st)
        gl_close(ctx, s);
    else
        *state = s;
    return st;
}

static tl_status gl_open(tl_ctx *ctx, void **state)
{
    return tli_gl_backend_open(ctx, TLI_GL_ANY, state);
}

static tl_status gl_open_current(tl_ctx *ctx, void **state)
{
    return tli_gl_backend_open(ctx, TLI_GL_CURRENT, state);
}

static const char *gl_name(const void *state)
{
    return ((const gl_state *)state)->gl->name;
}

static bool gl_is_fast(const void *state)
{
    return !((const gl_state *)state)->gl->software;
}

static size_t gl_card_bytes(const void *state)
{
    return ((const gl_state *)state)->gl->bytes;
}

/* ---- things ---- */

/* By rays where that is asked for or, automatically, where it can be. */
static tl_status add_volume(tl_ctx *ctx, gl_state *s, const tli_item *item, gl_item *own)
{
    tl_volume_method method = item->volume_opts.method;
    tl_status st = tli_gl_fog_add(ctx, s->gl, item, &own->fog);
    if (!st && method != TL_VOLUME_PROJECTED) {
        st = tli_gl_web_add(ctx, s->gl, item, &own->web);
        if (!st) st = tli_gl_caster_open(ctx, s->gl, &s->caster);
        if (st == TL_ERR_UNSUPPORTED && method == TL_VOLUME_AUTOMATIC) {
            tl_log(ctx, TL_LOG_DEBUG, "%s", tl_ctx_message(ctx));
            tl_ctx_clear(ctx);
            tli_gl_web_remove(s->gl, &own->web);
            st = TL_OK;
        }
    }
    if (st) tli_gl_web_remove(s->gl, &own->web);
    if (st) tli_gl_fog_remove(s->gl, &own->fog);
    return st;
}

static tl_status gl_add(tl_ctx *ctx, void *state, tli_item *item)
{
    gl_state *s = state;
    tl_status st = TL_OK;
    gl_item *own = tl_mem_zalloc(ctx, 1, sizeof *own, &st);
    if (!st) st = tli_gl_begin(ctx, s->gl);
    if (!st) {
        if (item->kind == TLI_ITEM_VOLUME)
            st = add_volume(ctx, s, item, own);
        else
            st = tli_gl_thing_add(ctx, s->gl, item, &own->thing);
        st = tli_gl_end(ctx, s->gl, st);
    }
    if (st)
        tl_mem_free(ctx, own);
    else
        item->own = own;
    return st;
}

static tl_status gl_change(tl_ctx *ctx, void *state, tli_item *item)
{
    (void)ctx;
    (void)state;
    (void)item; /* values are read when it is drawn */
    return TL_OK;
}

static void gl_remove(tl_ctx *ctx, void *state, tli_item *item)
{
    gl_state *s = state;
    gl_item *own = item->own;
    if (!tli_gl_begin(ctx, s->gl)) {
        tli_gl_fog_remove(s->gl, &own->fog);
        tli_gl_web_remove(s->gl, &own->web);
        tli_gl_tets_remove(s->gl, &own->tets);
        tli_gl_thing_remove(ctx, s->gl, &own->thing);
        tli_gl_end(ctx, s->gl, TL_OK);
    } else /* what lies in a card that is out of reach goes with its context */
        tl_range_index_destroy(ctx, own->thing.ranges);
    tl_mem_free(ctx, own);
    item->own = NULL;
}

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
        const tli_gl_thing *thing = &((const gl_item *)items[i]->own)->thing;
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

static tl_status set_targets(tl_ctx *ctx, gl_state *s, const tl_image *image)
{
    uint32_t w = image->width, h = image->height;
    tl_status st = tli_gl_target_set(ctx, s->gl, &s->before, w, h, TLI_GL_DEPTH);
    if (!st) st = tli_gl_target_set(ctx, s->gl, &s->opaque, w, h, TLI_GL_COLOR | TLI_GL_DEPTH);
    if (!st) st = tli_gl_target_set(ctx, s->gl, &s->sum, w, h, TLI_GL_COLOR);
    for (int i = 0; i < 2 && !st; i++)
        st = tli_gl_target_set(ctx, s->gl, &s->layers[i], w, h, TLI_GL_COLOR | TLI_GL_DEPTH);
    return st;
}

/* Gives the depth of the picture, in units of the frame and rows from below, to two targets. */
static tl_status send_depth(tl_ctx *ctx, gl_state *s, const tl_image *image, double unit)
{
    tl_status st = TL_OK;
    size_t width = image->width;
    float *rows = tl_mem_alloc(ctx, width * BAND_ROWS, sizeof *rows, &st);
    for (uint32_t done = 0; done < image->height && !st; done += BAND_ROWS) {
        uint32_t count = image->height - done < BAND_ROWS ? image->height - done : BAND_ROWS;
        for (uint32_t row = 0; row < count; row++)
            for (size_t x = 0; x < width; x++) {
                double z = (double)image->depth[(image->height - 1 - done - row) * width + x];
                rows[row * width + x] =
                    (float)fmin(fmax(z / unit, (double)NEAREST), (double)FARTHEST);
            }
        tli_gl_target_send_depth(&s->before, done, count, rows);
        tli_gl_target_send_depth(&s->opaque, done, count, rows);
    }
    tl_mem_free(ctx, rows);
    return st;
}

static void paint_things(const tli_gl_painter *painter, const tli_gl_view *view,
                         tli_item *const *items, size_t item_count, bool translucent, GLuint limit)
{
    GLint tag = 0;
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    for (size_t i = 0; i < item_count; i++)
        if (is_painted(items[i], translucent))
            tli_gl_thing_draw(painter, view, items[i], &((const gl_item *)items[i]->own)->thing,
                              translucent, limit, &tag);
}

static void paint(const gl_state *s, const tli_gl_view *view, tli_item *const *items,
                  size_t item_count, bool translucent, GLuint limit)
{
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(translucent ? GL_GREATER : GL_LEQUAL);
    paint_things(&s->painter, view, items, item_count, translucent, limit);
    glDisable(GL_DEPTH_TEST);
}

static void draw_opaque(const gl_state *s, const tli_gl_view *view, tli_item *const *items,
                        size_t item_count)
{
    static const float nothing[4] = {0}, end = 1;
    tli_gl_target_use(&s->opaque);
    glDepthMask(GL_TRUE);
    glClearBufferfv(GL_COLOR, 0, nothing);
    glClearBufferfv(GL_DEPTH, 0, &end);
    paint(s, view, items, item_count, false, s->before.depth);
}

/* The farthest layer that is nearer than limit; false if there is none. */
static bool draw_layer(const gl_state *s, const tli_gl_view *view, tli_item *const *items,
                       size_t item_count, const tli_gl_target *layer, GLuint limit)
{
    static const float nothing[4] = {0}, begin = 0;
    const float nearest[4] = {NEAREST, 0, 0, 0};
    GLuint query = 0, any = 0;
    tli_gl_target_use(layer);
    glDepthMask(GL_TRUE);
    glClearBufferfv(GL_COLOR, 0, nothing);
    glClearBufferfv(GL_COLOR, 1, nearest);
    glClearBufferfv(GL_DEPTH, 0, &begin);
    glGenQueries(1, &query);
    glBeginQuery(GL_ANY_SAMPLES_PASSED, query);
    paint(s, view, items, item_count, true, limit);
    glEndQuery(GL_ANY_SAMPLES_PASSED);
    glGetQueryObjectuiv(query, GL_QUERY_RESULT, &any);
    glDeleteQueries(1, &query);
    return any != 0;
}

/* Puts a picture in front of the sum. */
static void cover(const gl_state *s, GLuint picture)
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

/* What is translucent, far layers first, with the volume in between. */
static void draw_layers(const gl_state *s, const tli_gl_view *view, tli_item *const *items,
                        size_t item_count)
{
    static const float nothing[4] = {0};
    const tli_item *volume = volume_of(items, item_count);
    const gl_item *own = volume ? volume->own : NULL;
    GLuint limit = s->opaque.depth;
    bool more = true;
    tli_gl_target_use(&s->sum);
    glClearBufferfv(GL_COLOR, 0, nothing);
    cover(s, s->opaque.color);
    for (int i = 0; i < LAYERS_MAX && more; i++) {
        const tli_gl_target *layer = &s->layers[i & 1];
        more = draw_layer(s, view, items, item_count, layer, limit);
        if (volume)
            tli_gl_tets_draw(&s->projector, view, volume, &own->fog, &own->tets, &s->sum,
                             layer->depth, limit);
        if (more) cover(s, layer->color);
        limit = layer->depth;
    }
}

/* The same by lists of what is translucent, and a ray a pixel through both. *again: there was too
 * little room for them, and now there is more. */
static tl_status draw_rays(tl_ctx *ctx, gl_state *s, const tli_gl_view *view,
                           tli_item *const *items, size_t item_count, bool *again)
{
    tl_status st = TL_OK;
    size_t pixel_count = (size_t)view->width * view->height, given_up = 0, none;
    const tli_item *volume = volume_of(items, item_count);
    gl_item *own = volume ? volume->own : NULL;
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
    tli_gl_caster_follow(c, view, &scene, &s->sum);
    if (scene.has_layers) st = tli_gl_lists_end(ctx, s->gl, &c->layers, again, &none);
    if (!st && own) st = tli_gl_lists_end(ctx, s->gl, &c->entries, again, &given_up);
    if (given_up && !*again)
        tl_log(ctx, TL_LOG_WARNING, "%s: %zu rays of %zu went in circles and were given up",
               s->gl->name, given_up, pixel_count);
    return st;
}

/* Translucent things and the volume, in front of what is opaque. */
static tl_status draw_rest(tl_ctx *ctx, gl_state *s, const tli_gl_view *view,
                           tli_item *const *items, size_t item_count)
{
    tl_status st = TL_OK;
    const tli_item *volume = volume_of(items, item_count);
    gl_item *own = volume ? volume->own : NULL;
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
    if (!st) draw_layers(s, view, items, item_count);
    return st;
}

/* Puts rows [count] from row first below upwards, as they were read, into the picture. */
static void keep_rows(tl_image *image, double unit, uint32_t first, uint32_t count,
                      const float *colors, const float *depths)
{
    size_t width = image->width;
    for (uint32_t row = 0; row < count; row++)
        for (size_t x = 0; x < width; x++) {
            size_t to = (image->height - 1 - first - row) * width + x, from = row * width + x;
            float left = 1 - colors[4 * from + 3], z = depths[4 * from];
            for (size_t k = 0; k < 4; k++)
                image->rgba[4 * to + k] = colors[4 * from + k] + left * image->rgba[4 * to + k];
            if (z < FARTHEST) image->depth[to] = fminf(image->depth[to], (float)((double)z * unit));
        }
}

static tl_status fetch(tl_ctx *ctx, gl_state *s, double unit, tl_image *image)
{
    tl_status st = TL_OK;
    size_t width = image->width;
    float *colors = tl_mem_alloc(ctx, width * BAND_ROWS, 4 * sizeof *colors, &st);
    float *depths = tl_mem_alloc(ctx, width * BAND_ROWS, 4 * sizeof *depths, &st);
    for (uint32_t done = 0; done < image->height && !st; done += BAND_ROWS) {
        uint32_t count = image->height - done < BAND_ROWS ? image->height - done : BAND_ROWS;
        tli_gl_target_read(&s->sum, 0, done, count, colors);
        tli_gl_target_read(&s->opaque, 1, done, count, depths);
        keep_rows(image, unit, done, count, colors, depths);
    }
    tl_mem_free(ctx, depths);
    tl_mem_free(ctx, colors);
    return st;
}

/* Between begin and end. */
static tl_status draw_all(tl_ctx *ctx, gl_state *s, tli_item *const *items, size_t item_count,
                          tli_gl_view *view, tl_image *image)
{
    tl_status st = set_targets(ctx, s, image);
    if (!st) st = send_depth(ctx, s, image, view->frame->unit);
    if (st) return st;
    set_depths(view, items, item_count);
    draw_opaque(s, view, items, item_count);
    st = draw_rest(ctx, s, view, items, item_count);
    if (!st) st = tli_gl_check(ctx, s->gl);
    return st ? st : fetch(ctx, s, view->frame->unit, image);
}

static tl_status gl_draw(tl_ctx *ctx, void *state, tli_item *const *items, size_t item_count,
                         const tl_camera *camera, tl_image *image)
{
    gl_state *s = state;
    tli_frame frame;
    tli_gl_view view = {.frame = &frame, .width = image->width, .height = image->height};
    tl_status st = tli_frame_set(ctx, camera, image, &frame);
    if (!st) st = tli_gl_begin(ctx, s->gl);
    if (st) return st;
    return tli_gl_end(ctx, s->gl, draw_all(ctx, s, items, item_count, &view, image));
}

#define GL_BACKEND(opener)                                                                         \
    {                                                                                              \
        .open = (opener), .close = gl_close, .name = gl_name, .is_fast = gl_is_fast,               \
        .card_bytes = gl_card_bytes, .add = gl_add, .change = gl_change, .remove = gl_remove,      \
        .draw = gl_draw                                                                            \
    }
const tli_backend tli_backend_gl = GL_BACKEND(gl_open);
const tli_backend tli_backend_gl_current = GL_BACKEND(gl_open_current);
