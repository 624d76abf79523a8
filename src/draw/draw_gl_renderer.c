/* The back end on OpenGL: opens a context and its programs, keeps things in the card, and hands
 * pictures to draw_gl_frame.c and draw_gl_fetch.c. */
#include "draw/draw_gl.h"
#include "draw/draw_shaders.h"

/* ---- opening ---- */

static tl_status open_programs(tl_ctx *ctx, tli_gl_state *s)
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
    tli_gl_state *s = state;
    if (s->gl && !tli_gl_begin(ctx, s->gl)) {
        tli_gl_projector_close(s->gl, &s->projector);
        tli_gl_caster_close(s->gl, &s->caster);
        tli_gl_painter_close(&s->painter);
        tli_gl_painter_close(&s->lister);
        glDeleteProgram(s->cover);
        tli_gl_frame_free(s);
        tli_gl_end(ctx, s->gl, TL_OK);
    }
    tli_gl_close(ctx, s->gl);
    tl_mem_free(ctx, s);
}

tl_status tli_gl_backend_open(tl_ctx *ctx, tli_gl_kind kind, void **state)
{
    tl_status st = TL_OK;
    tli_gl_state *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
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
    return ((const tli_gl_state *)state)->gl->name;
}

static bool gl_is_fast(const void *state)
{
    return !((const tli_gl_state *)state)->gl->software;
}

static size_t gl_card_bytes(const void *state)
{
    return ((const tli_gl_state *)state)->gl->bytes;
}

/* ---- things ---- */

/* By rays where that is asked for or, automatically, where it can be. */
static tl_status add_volume(tl_ctx *ctx, tli_gl_state *s, const tli_item *item, tli_gl_item *own)
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
    tli_gl_state *s = state;
    tl_status st = TL_OK;
    tli_gl_item *own = tl_mem_zalloc(ctx, 1, sizeof *own, &st);
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
    tli_gl_state *s = state;
    tli_gl_item *own = item->own;
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

/* ---- pictures ---- */

static tl_status gl_draw(tl_ctx *ctx, void *state, tli_item *const *items, size_t item_count,
                         const tl_camera *camera, tl_image *image)
{
    tli_gl_state *s = state;
    tli_frame frame;
    const tli_gl_target *drawn = NULL;
    static const float nothing[4] = {0};
    tli_gl_view view = {.frame = &frame, .width = image->width, .height = image->height};
    tl_status st = tli_frame_set(ctx, camera, image, &frame);
    if (!st) st = tli_gl_begin(ctx, s->gl);
    if (st) return st;
    st = tli_gl_frame_draw(ctx, s, &view, items, item_count, nothing, image, &drawn);
    if (!st) st = tli_gl_fetch(ctx, s, drawn, frame.unit, image);
    return tli_gl_end(ctx, s->gl, st);
}

static tl_status gl_draw_bytes(tl_ctx *ctx, void *state, tli_item *const *items, size_t item_count,
                               const tl_camera *camera, const float *background, uint8_t *rgba,
                               float *depth)
{
    tli_gl_state *s = state;
    tli_frame frame;
    const tli_gl_target *drawn = NULL;
    const tl_image image = {.width = camera->size_px[0], .height = camera->size_px[1]};
    tli_gl_view view = {.frame = &frame, .width = image.width, .height = image.height};
    tl_status st = tli_frame_set(ctx, camera, &image, &frame);
    if (!st) st = tli_gl_begin(ctx, s->gl);
    if (st) return st;
    const float behind[4] = {background ? background[0] : 0, background ? background[1] : 0,
                             background ? background[2] : 0, background ? 1 : 0};
    st = tli_gl_frame_draw(ctx, s, &view, items, item_count, behind, NULL, &drawn);
    if (!st) st = tli_gl_fetch_bytes(ctx, s, drawn, frame.unit, rgba, depth);
    return tli_gl_end(ctx, s->gl, st);
}

#define GL_BACKEND(opener)                                                                         \
    {                                                                                              \
        .open = (opener), .close = gl_close, .name = gl_name, .is_fast = gl_is_fast,               \
        .card_bytes = gl_card_bytes, .add = gl_add, .change = gl_change, .remove = gl_remove,      \
        .draw = gl_draw, .draw_bytes = gl_draw_bytes                                               \
    }
const tli_backend tli_backend_gl = GL_BACKEND(gl_open);
const tli_backend tli_backend_gl_current = GL_BACKEND(gl_open_current);
