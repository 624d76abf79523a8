/* The front of all renderers: checks what is added, keeps the list of things, and calls the back
 * end. */
#include <math.h>
#include <string.h>

#include "draw/draw_backend.h"
#include "mesh/mesh.h"

static const double SHININESS_MAX = 1000;

struct tl_renderer {
    const tli_backend *backend;
    void *state;
    tli_item **items; /* [item_count] in the order in which they were added; room for one more */
    size_t item_count;
    tl_item last; /* number of the last thing */
};

/* ---- opening ---- */

/* TL_OK with *renderer NULL: the back end is slower than the processor, and any will do. */
static tl_status open_backend(tl_ctx *ctx, const tli_backend *backend, bool only_fast,
                              tl_renderer **renderer)
{
    tl_status st = TL_OK;
    tl_renderer *r = tl_mem_zalloc(ctx, 1, sizeof *r, &st);
    if (st) return st;
    r->backend = backend;
    st = backend->open(ctx, &r->state);
    if (!st && (!only_fast || backend->is_fast(r->state))) {
        *renderer = r;
        return TL_OK;
    }
    if (!st) backend->close(ctx, r->state);
    tl_mem_free(ctx, r);
    return st;
}

static tl_status open_gl(tl_ctx *ctx, bool current, bool only_fast, tl_renderer **renderer)
{
#if TETRALOD_WITH_GL
    return open_backend(ctx, current ? &tli_backend_gl_current : &tli_backend_gl, only_fast,
                        renderer);
#else
    (void)current;
    (void)only_fast;
    (void)renderer;
    return tl_fail(ctx, TL_ERR_UNSUPPORTED, "this build has no renderer on OpenGL");
#endif
}

tl_status tl_renderer_create(tl_ctx *ctx, tl_renderer_kind kind, tl_renderer **renderer)
{
    *renderer = NULL;
    switch (kind) {
    case TL_RENDERER_AUTO: {
        tl_status st = open_gl(ctx, false, true, renderer);
        if (st && st != TL_ERR_UNSUPPORTED) return st;
        if (*renderer) return TL_OK;
        tl_ctx_clear(ctx);
        return open_backend(ctx, &tli_backend_cpu, false, renderer);
    }
    case TL_RENDERER_CPU: return open_backend(ctx, &tli_backend_cpu, false, renderer);
    case TL_RENDERER_GL: return open_gl(ctx, false, false, renderer);
    case TL_RENDERER_GL_CURRENT: return open_gl(ctx, true, false, renderer);
    case TL_RENDERER_NULL: return open_backend(ctx, &tli_backend_null, false, renderer);
    }
    return tl_fail(ctx, TL_ERR_ARG, "renderer %d, expected one of tl_renderer_kind", (int)kind);
}

static void free_item(tl_ctx *ctx, tl_renderer *r, tli_item *item)
{
    r->backend->remove(ctx, r->state, item);
    tl_mem_free(ctx, item->values);
    tl_mem_free(ctx, item);
}

void tl_renderer_destroy(tl_ctx *ctx, tl_renderer *renderer)
{
    if (!renderer) return;
    for (size_t i = 0; i < renderer->item_count; i++) free_item(ctx, renderer, renderer->items[i]);
    renderer->backend->close(ctx, renderer->state);
    tl_mem_free(ctx, renderer->items);
    tl_mem_free(ctx, renderer);
}

const char *tl_renderer_name(const tl_renderer *renderer)
{
    return renderer->backend->name(renderer->state);
}

size_t tl_renderer_card_bytes(const tl_renderer *renderer)
{
    const tli_backend *b = renderer->backend;
    return b->card_bytes ? b->card_bytes(renderer->state) : 0;
}

/* ---- looks and options ---- */

tl_look tl_look_defaults(void)
{
    return (tl_look){.struct_bytes = sizeof(tl_look),
                     .rgb = {0.78, 0.8, 0.83},
                     .opacity = 1,
                     .lit = true,
                     .ambient = 0.3,
                     .diffuse = 0.7,
                     .specular = 0.15,
                     .shininess = 30};
}

tl_line_opts tl_line_opts_defaults(void)
{
    return (tl_line_opts){
        .struct_bytes = sizeof(tl_line_opts), .shape = TL_LINE_TUBE, .width_px = 2};
}

tl_point_opts tl_point_opts_defaults(void)
{
    return (tl_point_opts){.struct_bytes = sizeof(tl_point_opts), .radius_px = 1.5};
}

static bool in_range(double value, double low, double high)
{
    return value >= low && value <= high;
}

static bool is_length(double value)
{
    return value >= 0 && isfinite(value);
}

tl_status tli_light_check(tl_ctx *ctx, double ambient, double diffuse, double specular,
                          double shininess)
{
    if (in_range(ambient, 0, 1) && in_range(diffuse, 0, 1) && in_range(specular, 0, 1) &&
        in_range(shininess, 1, SHININESS_MAX))
        return TL_OK;
    return tl_fail(ctx, TL_ERR_ARG,
                   "light of ambient %g, diffuse %g, specular %g, expected 0 to 1, shininess %g, "
                   "expected 1 to %g",
                   ambient, diffuse, specular, shininess, SHININESS_MAX);
}

static tl_status take_look(tl_ctx *ctx, const tl_look *given, tl_look *look)
{
    *look = tl_look_defaults();
    tl_status st = tli_opts_take(ctx, "tl_look", given, look, sizeof *look);
    if (st) return st;
    if (!look->scalar != !look->transfer)
        return tl_fail(ctx, TL_ERR_ARG, "a look with only one of scalar and transfer function");
    if (!in_range(look->rgb[0], 0, 1) || !in_range(look->rgb[1], 0, 1) ||
        !in_range(look->rgb[2], 0, 1) || !in_range(look->opacity, 0, 1))
        return tl_fail(ctx, TL_ERR_ARG,
                       "a look of colour %g, %g, %g and opacity %g, expected 0 to 1", look->rgb[0],
                       look->rgb[1], look->rgb[2], look->opacity);
    return tli_light_check(ctx, look->ambient, look->diffuse, look->specular, look->shininess);
}

static tl_status take_line_opts(tl_ctx *ctx, const tl_line_opts *given, tl_line_opts *opts)
{
    *opts = tl_line_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_line_opts", given, opts, sizeof *opts);
    if (st) return st;
    if (opts->shape < TL_LINE_FLAT || opts->shape > TL_LINE_RIBBON)
        return tl_fail(ctx, TL_ERR_ARG, "lines of shape %d, expected one of tl_line_shape",
                       (int)opts->shape);
    if (!is_length(opts->width) || !is_length(opts->width_px) ||
        !(opts->width > 0 || opts->width_px > 0))
        return tl_fail(ctx, TL_ERR_ARG, "lines %g pixels or %g wide, expected more than 0",
                       opts->width_px, opts->width);
    if (!is_length(opts->halo_px) || !is_length(opts->dash) || !is_length(opts->gap) ||
        !isfinite(opts->phase) || !is_length(opts->arrow_spacing))
        return tl_fail(ctx, TL_ERR_ARG,
                       "lines with halo %g, dash %g, gap %g, phase %g, arrows every %g",
                       opts->halo_px, opts->dash, opts->gap, opts->phase, opts->arrow_spacing);
    return TL_OK;
}

static tl_status take_point_opts(tl_ctx *ctx, const tl_point_opts *given, tl_point_opts *opts)
{
    *opts = tl_point_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_point_opts", given, opts, sizeof *opts);
    if (st) return st;
    if (!is_length(opts->radius) || !is_length(opts->radius_px) ||
        !(opts->radius > 0 || opts->radius_px > 0))
        return tl_fail(ctx, TL_ERR_ARG, "points of radius %g pixels or %g, expected more than 0",
                       opts->radius_px, opts->radius);
    return TL_OK;
}

/* ---- what is drawn ---- */

static const char *const POLY_NAMES[] = {"", "points", "lines", "triangles"};

/* Corners and starts name what is there, so that no back end reads beyond an array. */
static tl_status check_polydata(tl_ctx *ctx, const tl_polydata *p, tl_poly_kind kind)
{
    if (p->kind != kind)
        return tl_fail(ctx, TL_ERR_ARG, "polydata of kind %d, expected %s", (int)p->kind,
                       POLY_NAMES[kind]);
    for (size_t i = 0; kind == TL_POLY_LINES && i < p->cell_count; i++)
        if (p->starts[i] > p->starts[i + 1])
            return tl_fail(ctx, TL_ERR_ARG, "line %zu ends before it starts", i);
    size_t corner_count = tli_corner_count(p);
    for (size_t i = 0; i < corner_count; i++)
        if (p->corners[i] >= p->vert_count)
            return tl_fail(ctx, TL_ERR_ARG, "corner %zu of the %s is vertex %u of %zu", i,
                           POLY_NAMES[kind], (unsigned)p->corners[i], p->vert_count);
    return TL_OK;
}

static tl_status check_values(tl_ctx *ctx, const double *values, size_t value_count)
{
    if (!value_count || value_count > TL_SLICE_VALUES_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "%zu values of slices, expected 1 to %u", value_count,
                       TL_SLICE_VALUES_MAX);
    for (size_t i = 0; i < value_count; i++)
        if (!isfinite(values[i]))
            return tl_fail(ctx, TL_ERR_ARG, "value %zu of the slices is %g", i, values[i]);
    return TL_OK;
}

/* Copies the item into the list, with a number. */
static tl_status add_item(tl_ctx *ctx, tl_renderer *r, const tli_item *given, tl_item *number)
{
    tl_status st = TL_OK;
    r->items = tl_mem_resize(ctx, r->items, r->item_count + 1, sizeof(tli_item *), &st);
    tli_item *item = tl_mem_alloc(ctx, 1, sizeof *item, &st);
    if (st) return st;
    *item = *given;
    item->id = r->last + 1;
    st = r->backend->add(ctx, r->state, item);
    if (st) {
        tl_mem_free(ctx, item);
        return st;
    }
    r->items[r->item_count++] = item;
    r->last = item->id;
    if (number) *number = item->id;
    return TL_OK;
}

tl_status tl_renderer_add_volume(tl_ctx *ctx, tl_renderer *renderer, const tl_volume *volume,
                                 const double *scalar, const tl_transfer *transfer,
                                 const tl_volume_opts *opts, tl_item *item)
{
    tli_item new = {
        .kind = TLI_ITEM_VOLUME, .volume = volume, .scalar = scalar, .transfer = transfer};
    if (item) *item = 0;
    for (size_t i = 0; i < renderer->item_count; i++)
        if (renderer->items[i]->kind == TLI_ITEM_VOLUME)
            return tl_fail(ctx, TL_ERR_UNSUPPORTED, "a renderer draws one volume, and has it");
    tl_status st = tli_volume_opts_take(ctx, opts, &new.volume_opts);
    return st ? st : add_item(ctx, renderer, &new, item);
}

tl_status tl_renderer_add_surface(tl_ctx *ctx, tl_renderer *renderer, const tl_polydata *triangles,
                                  const tl_look *look, tl_item *item)
{
    tli_item new = {.kind = TLI_ITEM_SURFACE, .polydata = triangles};
    if (item) *item = 0;
    tl_status st = take_look(ctx, look, &new.look);
    if (!st) st = check_polydata(ctx, triangles, TL_POLY_TRIANGLES);
    return st ? st : add_item(ctx, renderer, &new, item);
}

tl_status tl_renderer_add_lines(tl_ctx *ctx, tl_renderer *renderer, const tl_polydata *lines,
                                const tl_look *look, const tl_line_opts *opts, tl_item *item)
{
    tli_item new = {.kind = TLI_ITEM_LINES, .polydata = lines};
    if (item) *item = 0;
    tl_status st = take_look(ctx, look, &new.look);
    if (!st) st = take_line_opts(ctx, opts, &new.line_opts);
    if (!st) st = check_polydata(ctx, lines, TL_POLY_LINES);
    return st ? st : add_item(ctx, renderer, &new, item);
}

tl_status tl_renderer_add_points(tl_ctx *ctx, tl_renderer *renderer, const tl_polydata *points,
                                 const tl_look *look, const tl_point_opts *opts, tl_item *item)
{
    tli_item new = {.kind = TLI_ITEM_POINTS, .polydata = points};
    if (item) *item = 0;
    tl_status st = take_look(ctx, look, &new.look);
    if (!st) st = take_point_opts(ctx, opts, &new.point_opts);
    if (!st) st = check_polydata(ctx, points, TL_POLY_POINTS);
    return st ? st : add_item(ctx, renderer, &new, item);
}

static double *copy_values(tl_ctx *ctx, const double *values, size_t value_count, tl_status *st)
{
    double *copy = tl_mem_alloc(ctx, value_count, sizeof *copy, st);
    if (!*st) memcpy(copy, values, value_count * sizeof *copy);
    return copy;
}

tl_status tl_renderer_add_slices(tl_ctx *ctx, tl_renderer *renderer, const tl_mesh *mesh,
                                 const double *scalar, const double *values, size_t value_count,
                                 const tl_look *look, tl_item *item)
{
    tli_item new = {
        .kind = TLI_ITEM_SLICES, .mesh = mesh, .scalar = scalar, .value_count = value_count};
    if (item) *item = 0;
    tl_status st = take_look(ctx, look, &new.look);
    if (!st) st = check_values(ctx, values, value_count);
    new.values = copy_values(ctx, values, value_count, &st);
    if (!st) st = add_item(ctx, renderer, &new, item);
    if (st) tl_mem_free(ctx, new.values);
    return st;
}

tl_status tl_renderer_set_slices(tl_ctx *ctx, tl_renderer *renderer, tl_item item,
                                 const double *values, size_t value_count)
{
    tli_item *found = NULL;
    for (size_t i = 0; i < renderer->item_count && !found; i++)
        if (renderer->items[i]->id == item) found = renderer->items[i];
    if (!found || found->kind != TLI_ITEM_SLICES)
        return tl_fail(ctx, TL_ERR_ARG, "thing %u of the renderer is none of slices",
                       (unsigned)item);
    tl_status st = check_values(ctx, values, value_count);
    tli_item old = *found;
    double *copy = copy_values(ctx, values, value_count, &st);
    if (st) return st;
    found->values = copy;
    found->value_count = value_count;
    st = renderer->backend->change(ctx, renderer->state, found);
    tl_mem_free(ctx, st ? copy : old.values);
    if (st) *found = old;
    return st;
}

void tl_renderer_remove(tl_ctx *ctx, tl_renderer *renderer, tl_item item)
{
    size_t kept = 0, count = renderer->item_count;
    for (size_t i = 0; i < count; i++) {
        tli_item *it = renderer->items[i];
        if (it->id == item)
            free_item(ctx, renderer, it);
        else
            renderer->items[kept++] = it;
    }
    renderer->item_count = kept;
}

tl_status tl_renderer_draw(tl_ctx *ctx, tl_renderer *renderer, const tl_camera *camera,
                           tl_image *image)
{
    tli_frame frame;
    tl_status st = tli_frame_set(ctx, camera, image, &frame);
    if (st) return st;
    return renderer->backend->draw(ctx, renderer->state, renderer->items, renderer->item_count,
                                   camera, image);
}

/* By way of a picture in floats. */
static tl_status draw_packed(tl_ctx *ctx, tl_renderer *renderer, const tl_camera *camera,
                             const float *background, uint8_t *rgba, float *depth)
{
    tl_image *image = NULL;
    tl_status st = tl_image_create(ctx, camera->size_px[0], camera->size_px[1], &image);
    if (!st) st = tl_renderer_draw(ctx, renderer, camera, image);
    const size_t count = st ? 0 : (size_t)image->width * image->height;
    if (!st) tli_pixels_pack(image->rgba, count, background, rgba);
    if (!st && depth) memcpy(depth, image->depth, count * sizeof *depth);
    tl_image_destroy(ctx, image);
    return st;
}

tl_status tl_renderer_draw_bytes(tl_ctx *ctx, tl_renderer *renderer, const tl_camera *camera,
                                 const float background[3], uint8_t *rgba, float *depth)
{
    if (!renderer->backend->draw_bytes)
        return draw_packed(ctx, renderer, camera, background, rgba, depth);
    tl_status st = tli_image_check(ctx, camera->size_px[0], camera->size_px[1]);
    return st ? st
              : renderer->backend->draw_bytes(ctx, renderer->state, renderer->items,
                                              renderer->item_count, camera, background, rgba,
                                              depth);
}
