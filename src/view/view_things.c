/* The things of a scene, made of a body: volume, surfaces, planes, boundary, edges. */
#include <math.h>

#include "view/view.h"

static const double GREY[3] = {0.74, 0.75, 0.77};
const double tli_ink[3] = {0.15, 0.15, 0.17};
/* Opacity of a boundary around other things; shine of one that shows values. */
static const double GLASS = 0.15, MATT = 0.05;

/* ---- helpers ---- */

double tli_maker_real(const tli_maker *maker, const tli_entry *entry, const char *prop)
{
    return tl_scene_real(maker->agenda->scene, entry->node, prop);
}

tli_recipe tli_maker_recipe(const tli_maker *maker, const tli_entry *entry)
{
    const bool of_cut = maker->by_patch && tli_shares(TLI_CUTS, entry);
    return tli_recipe_count(of_cut ? maker->recipe : maker->body->recipe, (uint64_t)entry->kind);
}

/* The colour of a node, or another one where it is empty. Returns whether it is not. */
static bool node_color(const tli_maker *m, const tli_entry *entry, const double other[3],
                       double rgb[3])
{
    tl_value value;
    const bool has =
        !tl_scene_get(m->ctx, m->agenda->scene, entry->node, "color", &value) && value.count == 3;
    memcpy(rgb, has ? value.reals : other, 3 * sizeof *rgb);
    return has;
}

tli_thing tli_flat_lines(const tl_polydata *lines, const double rgb[3], double width_px)
{
    tli_thing thing = {.kind = TLI_THING_LINES,
                       .polydata = lines,
                       .look = tl_look_defaults(),
                       .line = tl_line_opts_defaults()};
    memcpy(thing.look.rgb, rgb, sizeof thing.look.rgb);
    thing.look.lit = false;
    thing.line.shape = TL_LINE_FLAT;
    thing.line.width_px = width_px;
    return thing;
}

void tli_shape_release(tli_shape *shape)
{
    if (!shape || atomic_fetch_sub(&shape->uses, 1) > 1) return;
    for (int i = 0; i < 2; i++) tl_polydata_destroy(shape->ctx, shape->parts[i]);
    tl_mem_free(shape->ctx, shape);
}

/* Takes over the use of a shape, also on failure. */
static tl_status add_shape(tli_maker *m, tli_shape *shape)
{
    tl_status st = TL_OK;
    tl_content *c = m->content;
    c->shapes = tl_mem_resize(m->ctx, c->shapes, c->shape_count + 1, sizeof *c->shapes, &st);
    if (st)
        tli_shape_release(shape);
    else
        c->shapes[c->shape_count++] = shape;
    return st;
}

const tli_shape *tli_maker_find(tli_maker *maker, tli_recipe recipe, tl_status *st)
{
    const tl_content *content = maker->content;
    const tl_view *view = maker->view;
    for (size_t i = 0; i < content->shape_count; i++)
        if (content->shapes[i]->recipe == recipe) return content->shapes[i];
    for (size_t i = 0; i < view->shape_count; i++)
        if (view->shapes[i]->recipe == recipe) {
            tli_shape *shape = view->shapes[i];
            atomic_fetch_add(&shape->uses, 1);
            *st = add_shape(maker, shape);
            return *st ? NULL : shape;
        }
    return NULL;
}

tl_status tli_maker_keep(tli_maker *maker, tli_recipe recipe, tl_polydata *first,
                         tl_polydata *second, const tli_shape **shape)
{
    tl_status st = TL_OK;
    tli_shape *made = tl_mem_zalloc(maker->ctx, 1, sizeof *made, &st);
    *shape = NULL;
    if (st) {
        tl_polydata_destroy(maker->ctx, first);
        tl_polydata_destroy(maker->ctx, second);
        return st;
    }
    made->ctx = maker->ctx;
    made->recipe = recipe;
    made->parts[0] = first;
    made->parts[1] = second;
    atomic_init(&made->uses, 1);
    st = add_shape(maker, made);
    if (!st) *shape = made;
    return st;
}

tl_status tli_maker_add(tli_maker *maker, const tli_thing *thing)
{
    tl_status st = TL_OK;
    tl_content *c = maker->content;
    c->things = tl_mem_resize(maker->ctx, c->things, c->thing_count + 1, sizeof *c->things, &st);
    if (!st) c->things[c->thing_count++] = *thing;
    return st;
}

tl_status tli_maker_scalar(tli_maker *maker, const tli_paint *paint, bool linear,
                           tli_scalar **scalar)
{
    return tli_body_scalar(maker->ctx, maker->body, paint->values.channel,
                           paint->values.logarithmic && !linear, paint->factor, scalar);
}

/* The scalar that a paint's colours are of, ready to be carried along: of values on tets these, not
 * means that none of them may have. paint may be NULL. */
static tl_status dress(tli_maker *m, const tli_paint *paint, tli_dressed *dressed)
{
    tli_scalar *scalar = NULL;
    tl_status st = paint ? tli_body_plain(m->ctx, m->body, paint->values.channel,
                                          paint->values.logarithmic, paint->factor, &scalar)
                         : TL_OK;
    if (!st) tli_body_dress(m->body, scalar, dressed);
    return st;
}

/* Of a shape, with all that a node says, and the paint that colours it. */
static tli_recipe thing_recipe(const tli_maker *m, const tli_entry *entry, const tli_shape *shape,
                               const tli_paint *paint)
{
    tli_recipe recipe = shape ? shape->recipe : tli_maker_recipe(m, entry);
    recipe = tli_recipe_count(recipe, tl_scene_node_version(m->agenda->scene, entry->node));
    return tli_recipe_count(recipe, paint ? paint->recipe : 0);
}

/* A thing of triangles whose first channel, if any, is that of a paint. */
static tli_thing surface_of(const tli_maker *m, const tli_entry *entry, const tli_shape *shape,
                            const tli_paint *paint)
{
    tli_thing thing = {.kind = TLI_THING_TRIANGLES,
                       .recipe = thing_recipe(m, entry, shape, paint),
                       .polydata = shape->parts[0],
                       .look = tl_look_defaults()};
    memcpy(thing.look.rgb, GREY, sizeof thing.look.rgb);
    if (paint && thing.polydata->channel_count) {
        thing.look.scalar = thing.polydata->channels[0].values;
        thing.look.transfer = paint->transfer;
    }
    return thing;
}

static tli_recipe with_paint(tli_recipe recipe, const tli_paint *paint)
{
    if (!paint) return tli_recipe_count(recipe, 0);
    recipe = tli_recipe_text(recipe, paint->values.channel);
    recipe = tli_recipe_count(recipe, paint->values.logarithmic);
    return tli_recipe_real(recipe, paint->factor);
}

/* ---- volume ---- */

/* The length of the longest gradient. */
static double steepest(const tl_mesh *mesh, const double *gradients)
{
    double most = 0;
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
        const double *g = gradients + 3 * v, length = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
        if (isfinite(length)) most = fmax(most, length);
    }
    return most;
}

/* Of all of the data, like the colours: it does not change with the cut, nor with what is chosen.
 */
static tl_status steepest_of_all(tli_maker *m, const tli_paint *paint, double *most)
{
    tli_scalar *scalar;
    tli_body *whole = m->agenda->whole;
    tl_status st = tli_body_scalar(m->ctx, whole, paint->values.channel, paint->values.logarithmic,
                                   paint->factor, &scalar);
    if (!st) st = tli_body_gradients(m->ctx, whole, scalar);
    if (!st) *most = steepest(whole->mesh, scalar->gradients);
    return st;
}

static tl_status make_volume(tli_maker *m, const tli_entry *entry)
{
    static const tl_volume_method METHODS[] = {TL_VOLUME_AUTOMATIC, TL_VOLUME_PROJECTED,
                                               TL_VOLUME_RAYS};
    tli_scalar *scalar;
    const tli_paint *paint = entry->own;
    const tl_scene *scene = m->agenda->scene;
    const double fade = tli_maker_real(m, entry, "gradient_opacity");
    const bool by_percent = tl_scene_flag(scene, entry->node, "gradient_percent");
    double most = 0;
    tli_thing thing = {.kind = TLI_THING_VOLUME,
                       .recipe = thing_recipe(m, entry, NULL, paint),
                       .transfer = paint->transfer,
                       .volume_opts = tl_volume_opts_defaults()};
    thing.volume_opts.method = METHODS[(int)tli_maker_real(m, entry, "method")];
    thing.volume_opts.lit = tl_scene_flag(scene, entry->node, "lit");
    tl_status st = tli_body_volume(m->ctx, m->body, &thing.volume);
    if (!st) st = tli_maker_scalar(m, paint, false, &scalar);
    if (!st && (thing.volume_opts.lit || fade > 0)) {
        st = tli_body_gradients(m->ctx, m->body, scalar);
        thing.volume_opts.gradients = scalar->gradients;
    }
    if (!st && fade > 0 && by_percent) st = steepest_of_all(m, paint, &most);
    if (st) return st;
    thing.scalar = scalar->values;
    if (fade > 0)
        thing.volume_opts.gradient_opacity = by_percent                  ? fade / 100 * most
                                             : paint->values.logarithmic ? fade
                                                                         : fade * paint->factor;
    return tli_maker_add(m, &thing);
}

/* ---- surfaces ---- */

static tl_status slice_surface(tli_maker *m, const tli_entry *entry, double value,
                               tl_polydata **triangles)
{
    tli_scalar *scalar;
    tli_dressed dressed;
    tl_slice_opts opts = tl_slice_opts_defaults();
    tl_status st = tli_maker_scalar(m, entry->own, true, &scalar);
    if (!st) st = tli_body_gradients(m->ctx, m->body, scalar);
    if (!st) st = dress(m, entry->color, &dressed);
    if (st) return st;
    opts.values = &value;
    opts.value_count = 1;
    opts.gradients = scalar->gradients;
    opts.channels = &dressed.first;
    opts.channel_count = dressed.mesh.channel_count;
    return tl_slice_mesh(m->ctx, &dressed.mesh, scalar->values, &opts, triangles);
}

/* Of the triangles of a surface or plane. */
static tli_recipe triangles_recipe(const tli_maker *m, const tli_entry *entry)
{
    double plane[6];
    tli_recipe recipe = tli_maker_recipe(m, entry);
    if (entry->kind == TL_NODE_SURFACE) {
        const double value = tli_surface_value(m->agenda->scene, entry);
        recipe = with_paint(with_paint(recipe, entry->own), entry->color);
        return tli_recipe_real(recipe, entry->own->factor * value);
    }
    tl_scene_plane(m->agenda->scene, entry->node, "plane", plane);
    return tli_recipe_bytes(with_paint(recipe, entry->color), plane, sizeof plane);
}

static tl_status make_surface(tli_maker *m, const tli_entry *entry)
{
    tl_status st = TL_OK;
    const tli_paint *own = entry->own, *color = entry->color;
    const double value = tli_surface_value(m->agenda->scene, entry);
    const tli_recipe recipe = triangles_recipe(m, entry);
    const tli_shape *shape = tli_maker_find(m, recipe, &st);
    if (!st && !shape) {
        tl_polydata *triangles = NULL;
        st = m->by_patch ? tli_strip_join(m, entry, &triangles)
                         : slice_surface(m, entry, own->factor * value, &triangles);
        if (!st && !triangles->cell_count)
            tl_log(m->ctx, TL_LOG_WARNING,
                   "%s is empty: '%s' has the value %g nowhere, it goes from %g to %g",
                   tl_scene_name(m->agenda->scene, entry->node), own->values.channel, value,
                   own->values.least, own->values.most);
        if (!st) st = tli_maker_keep(m, recipe, triangles, NULL, &shape);
    }
    if (st) return st;
    tli_thing thing = surface_of(m, entry, shape, color);
    thing.recipe = tli_recipe_count(thing.recipe, own->recipe);
    thing.look.opacity = tli_maker_real(m, entry, "opacity");
    if (!thing.look.scalar && !node_color(m, entry, GREY, thing.look.rgb)) {
        float rgb[3];
        double extinction;
        tl_transfer_at(own->transfer, tli_paint_shown(own, value), rgb, &extinction);
        for (int k = 0; k < 3; k++) thing.look.rgb[k] = (double)rgb[k];
    }
    return tli_maker_add(m, &thing);
}

static tl_status slice_plane(tli_maker *m, const tli_entry *entry, tl_polydata **triangles)
{
    double plane[6];
    tl_status st = TL_OK;
    tli_dressed dressed;
    const double value = 0;
    const size_t count = tl_mesh_vert_count(m->body->mesh);
    double *distance = tl_mem_alloc(m->ctx, count, sizeof *distance, &st);
    tl_scene_plane(m->agenda->scene, entry->node, "plane", plane);
    tl_slice_opts opts = tl_slice_opts_defaults();
    if (!st) st = dress(m, entry->color, &dressed);
    if (!st) st = tl_plane_distance(m->ctx, m->body->mesh, plane, plane + 3, distance);
    if (!st) {
        opts.values = &value;
        opts.value_count = 1;
        opts.channels = &dressed.first;
        opts.channel_count = dressed.mesh.channel_count;
        st = tl_slice_mesh(m->ctx, &dressed.mesh, distance, &opts, triangles);
    }
    tl_mem_free(m->ctx, distance);
    return st;
}

static void warn_beside(const tli_maker *m, const tli_entry *entry)
{
    const double *b = m->by_patch ? m->view->source->facts.bounds : m->body->bounds;
    tl_log(m->ctx, TL_LOG_WARNING,
           "%s is empty: its plane lies beside the mesh, x %g .. %g, y %g .. %g, z %g .. %g",
           tl_scene_name(m->agenda->scene, entry->node), b[0], b[1], b[2], b[3], b[4], b[5]);
}

/* Planes show values, unlit: a colour on the picture is one of the bar. */
static tl_status make_slice(tli_maker *m, const tli_entry *entry)
{
    tl_status st = TL_OK;
    const tli_recipe recipe = triangles_recipe(m, entry);
    const tli_shape *shape = tli_maker_find(m, recipe, &st);
    if (!st && !shape) {
        tl_polydata *triangles = NULL;
        st = m->by_patch ? tli_strip_join(m, entry, &triangles) : slice_plane(m, entry, &triangles);
        if (!st && !triangles->cell_count) warn_beside(m, entry);
        if (!st) st = tli_maker_keep(m, recipe, triangles, NULL, &shape);
    }
    if (st) return st;
    tli_thing thing = surface_of(m, entry, shape, entry->color);
    thing.look.lit = !thing.look.scalar;
    thing.look.opacity = tli_maker_real(m, entry, "opacity");
    return tli_maker_add(m, &thing);
}

tl_status tli_make_strips(tli_maker *maker)
{
    tl_status st = TL_OK;
    const tli_agenda *agenda = maker->agenda;
    size_t count = 0;
    const tli_entry **missing = tl_mem_alloc(maker->ctx, agenda->thing_count, sizeof *missing, &st);
    for (size_t i = 0; !st && i < agenda->thing_count; i++) {
        const tli_entry *entry = &agenda->things[i];
        if (tli_shares(TLI_CUTS, entry) &&
            !tli_maker_find(maker, triangles_recipe(maker, entry), &st))
            missing[count++] = entry;
    }
    if (!st) st = tli_strips_update(maker, missing, count);
    tl_mem_free(maker->ctx, missing);
    return st;
}

/* Glass without colours where other things lie inside. */
static tl_status make_boundary(tli_maker *m, const tli_entry *entry)
{
    tl_status st = TL_OK;
    const double opacity = tli_maker_real(m, entry, "opacity");
    const bool inside = tl_scene_flag(m->agenda->scene, entry->node, "interfaces");
    const bool is_glass = tli_is_glass(m->agenda, entry);
    const tli_paint *color = is_glass ? NULL : entry->color;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    opts.regions = false;
    opts.interfaces = inside;
    opts.boundary = !inside;
    const tli_recipe recipe =
        tli_recipe_count(with_paint(tli_maker_recipe(m, entry), color), inside);
    const tli_shape *shape = tli_maker_find(m, recipe, &st);
    if (!st && !shape) {
        tli_dressed dressed;
        const tl_lidx *opposite;
        tl_polydata *triangles = NULL;
        st = dress(m, color, &dressed);
        if (!st) st = tli_body_opposite(m->ctx, m->body, &opposite);
        if (!st) {
            opts.channels = &dressed.first;
            opts.channel_count = dressed.mesh.channel_count;
            st = tl_boundary_surface(m->ctx, &dressed.mesh, opposite, &opts, &triangles);
        }
        if (!st && inside && !triangles->cell_count)
            tl_log(m->ctx, TL_LOG_WARNING, "%s is empty: the mesh has no two regions that touch",
                   tl_scene_name(m->agenda->scene, entry->node));
        if (!st) st = tli_maker_keep(m, recipe, triangles, NULL, &shape);
    }
    if (st) return st;
    tli_thing thing = surface_of(m, entry, shape, color);
    thing.recipe = tli_recipe_count(thing.recipe, is_glass);
    if (!thing.look.scalar) node_color(m, entry, GREY, thing.look.rgb);
    if (thing.look.scalar) thing.look.specular = MATT;
    thing.look.opacity = is_glass ? GLASS : opacity < 0 ? 1 : opacity;
    return tli_maker_add(m, &thing);
}

/* ---- edges ---- */

static tli_thing edges_of(const tli_maker *m, const tli_entry *entry, const tli_shape *shape)
{
    double rgb[3];
    node_color(m, entry, tli_ink, rgb);
    tli_thing thing =
        tli_flat_lines(shape ? shape->parts[0] : NULL, rgb, tli_maker_real(m, entry, "width_px"));
    thing.recipe = thing_recipe(m, entry, shape, NULL);
    return thing;
}

static tl_status make_edges(tli_maker *m, const tli_entry *entry)
{
    tl_status st = TL_OK;
    const tli_recipe recipe = tli_maker_recipe(m, entry);
    const tli_shape *shape = tli_maker_find(m, recipe, &st);
    if (!(tli_maker_real(m, entry, "width_px") > 0)) return st;
    if (!st && !shape) {
        tl_polydata *lines = NULL;
        tl_edges_opts opts = tl_edges_opts_defaults();
        st = tli_body_edges(m->ctx, m->body);
        if (!st) st = tl_edges_lines(m->ctx, m->body->edges, &opts, &lines);
        if (!st) st = tli_maker_keep(m, recipe, lines, NULL, &shape);
    }
    if (st) return st;
    const tli_thing thing = edges_of(m, entry, shape);
    return tli_maker_add(m, &thing);
}

/* Which ones they are depends on the camera. */
static tl_status make_silhouettes(tli_maker *m, const tli_entry *entry)
{
    tli_thing thing = edges_of(m, entry, NULL);
    thing.kind = TLI_THING_SILHOUETTES;
    if (!(thing.line.width_px > 0)) return TL_OK;
    tl_status st = tli_body_edges(m->ctx, m->body);
    return st ? st : tli_maker_add(m, &thing);
}

/* ---- all ---- */

tl_status tli_make_thing(tli_maker *maker, const tli_entry *entry)
{
    switch (entry->kind) {
    case TL_NODE_VOLUME: return make_volume(maker, entry);
    case TL_NODE_SURFACE: return make_surface(maker, entry);
    case TL_NODE_SLICE: return make_slice(maker, entry);
    case TL_NODE_BOUNDARY:
        return tli_maker_real(maker, entry, "mark") != 0 ? tli_make_marks(maker, entry)
                                                         : make_boundary(maker, entry);
    case TL_NODE_EDGES: return make_edges(maker, entry);
    case TL_NODE_SILHOUETTES: return make_silhouettes(maker, entry);
    case TL_NODE_POINTS: return tli_make_points(maker, entry);
    case TL_NODE_LINES: return tli_make_lines(maker, entry);
    default: return TL_OK;
    }
}
