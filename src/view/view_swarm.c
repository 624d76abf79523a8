/* Points and streamlines of a scene. */
#include <math.h>

#include "view/view.h"

/* Opacity of lines that do not run through the box. */
static const double GHOST = 0.12;
/* Channels that streamlines have of themselves stand before those that are carried along. */
enum { OWN_CHANNELS = 2 };

static tli_recipe with_scalar(tli_recipe recipe, const tli_scalar *scalar)
{
    return tli_recipe_count(recipe, scalar->recipe);
}

/* ---- points ---- */

static tl_status spread(tli_maker *m, const tli_entry *entry, const tli_scalar *own,
                        const tli_scalar *color, tl_polydata **points)
{
    double values[TL_SLICE_VALUES_MAX];
    tli_dressed dressed;
    tl_points_opts opts = tl_points_opts_defaults();
    const double shells = tli_maker_real(m, entry, "shells");
    opts.count = (uint64_t)tli_maker_real(m, entry, "count");
    /* the least and the largest value have no surface */
    opts.low = entry->own->values.shown_range[0];
    opts.high = entry->own->values.shown_range[1];
    if (opts.low < opts.high) {
        opts.values = values;
        opts.value_count = (size_t)fmin(shells, TL_SLICE_VALUES_MAX);
        for (size_t i = 0; i < opts.value_count; i++)
            values[i] =
                opts.low + ((double)i + 0.5) / (double)opts.value_count * (opts.high - opts.low);
    }
    tli_body_dress(m->body, color, &dressed);
    opts.channels = &dressed.first;
    opts.channel_count = 1;
    return tl_slice_points(m->ctx, &dressed.mesh, own->values, &opts, NULL, points);
}

tl_status tli_make_points(tli_maker *maker, const tli_entry *entry)
{
    tli_scalar *own, *color;
    const tli_shape *shape = NULL;
    const tli_paint *paint = entry->color ? entry->color : entry->own;
    if (!(tli_maker_real(maker, entry, "radius_px") > 0)) return TL_OK;
    const double *range = entry->own->values.shown_range;
    if (!(range[0] < range[1])) { /* one value, or none: no isosurfaces */
        tl_log(maker->ctx, TL_LOG_WARNING, "%s is empty: '%s' goes from %g to %g",
               tl_scene_name(maker->agenda->scene, entry->node), entry->own->values.channel,
               entry->own->values.range[0], entry->own->values.range[1]);
        return TL_OK;
    }
    tl_status st = tli_maker_scalar(maker, entry->own, false, &own);
    if (!st) st = tli_maker_scalar(maker, paint, false, &color);
    if (st) return st;
    tli_recipe recipe = with_scalar(with_scalar(tli_maker_recipe(maker, entry), own), color);
    recipe = tli_recipe_bytes(recipe, entry->own->values.shown_range,
                              sizeof entry->own->values.shown_range);
    recipe = tli_recipe_real(tli_recipe_real(recipe, tli_maker_real(maker, entry, "count")),
                             tli_maker_real(maker, entry, "shells"));
    shape = tli_maker_find(maker, recipe, &st);
    if (!st && !shape) {
        tl_polydata *points = NULL;
        st = spread(maker, entry, own, color, &points);
        if (!st) st = tli_maker_keep(maker, recipe, points, NULL, &shape);
    }
    if (st) return st;
    tli_thing thing = {.kind = TLI_THING_POINTS,
                       .polydata = shape->parts[0],
                       .look = tl_look_defaults(),
                       .point = tl_point_opts_defaults()};
    thing.recipe = tli_recipe_count(tli_recipe_count(recipe, paint->recipe),
                                    tl_scene_node_version(maker->agenda->scene, entry->node));
    thing.look.scalar = thing.polydata->channels[0].values;
    thing.look.transfer = paint->transfer;
    thing.look.ambient = 0.45;
    thing.look.specular = 0;
    thing.point.radius_px = tli_maker_real(maker, entry, "radius_px");
    return tli_maker_add(maker, &thing);
}

/* ---- lines ---- */

/* Lines through the box, and the others as ghosts. */
static tl_status divide(tli_maker *m, const double bounds[6], tl_polydata *lines,
                        tl_polydata *parts[2])
{
    tl_status st = TL_OK;
    uint8_t *marks = tl_mem_alloc(m->ctx, lines->cell_count, sizeof *marks, &st);
    if (!st) tl_lines_in_box(lines, bounds, marks);
    for (int part = 0; !st && part < 2; part++)
        st = tl_lines_pick(m->ctx, lines, marks, part == 0, &parts[part]);
    tl_mem_free(m->ctx, marks);
    return st;
}

/* The bounds of the box that selects. */
static bool box_of(const tli_maker *m, const tli_entry *entry, double bounds[6])
{
    double box[6];
    const tl_scene *scene = m->agenda->scene;
    if (!tl_scene_flag(scene, entry->node, "has_box")) return false;
    tl_scene_box(scene, entry->node, "box", box);
    for (int k = 0; k < 3; k++) {
        bounds[2 * k] = box[k];
        bounds[2 * k + 1] = box[3 + k];
    }
    return true;
}

static tl_line_shape shape_of(const tli_maker *m, const tli_entry *entry)
{
    static const tl_line_shape SHAPES[] = {TL_LINE_TUBE, TL_LINE_FLAT, TL_LINE_RIBBON};
    return SHAPES[(int)tli_maker_real(m, entry, "shape")];
}

static bool is_ribbon(const tli_maker *m, const tli_entry *entry)
{
    return shape_of(m, entry) == TL_LINE_RIBBON;
}

/* Gives the lines of a node, in two parts where there is a box. */
static tl_status follow(tli_maker *m, const tli_entry *entry, const tli_scalar *color,
                        tl_polydata *parts[2])
{
    double bounds[6];
    tli_dressed dressed;
    const tl_channel *channel;
    const tl_lidx *opposite;
    tl_polydata *lines = NULL;
    tl_stream_report report = {0};
    const tl_scene *scene = m->agenda->scene;
    const char *seeds = tl_scene_text(scene, entry->node, "seeds");
    tl_stream_opts opts = tl_stream_opts_defaults();
    tl_status st =
        tli_body_channel(m->ctx, m->body, tl_scene_text(scene, entry->node, "channel"), &channel);
    if (!st) st = tli_body_opposite(m->ctx, m->body, &opposite);
    if (st) return st;
    tli_body_dress(m->body, color, &dressed);
    opts.channels = &dressed.first;
    opts.channel_count = 1;
    opts.normals = is_ribbon(m, entry);
    st = tli_seeds_follow(m->ctx, &dressed.mesh, opposite, channel, seeds, &opts, &lines, &report);
    if (!st && !lines->cell_count)
        tl_log(m->ctx, TL_LOG_WARNING,
               "%s is empty: no line from the seeds '%s', of which %zu lie outside of the mesh",
               tl_scene_name(scene, entry->node), seeds, report.seeds_outside);
    if (st || !box_of(m, entry, bounds)) {
        parts[0] = lines;
        return st;
    }
    st = divide(m, bounds, lines, parts);
    tl_polydata_destroy(m->ctx, lines);
    return st;
}

/* How the lines of one part look; ghosts have neither arrows nor halos. */
static tl_status add_part(tli_maker *m, const tli_entry *entry, const tli_shape *shape, int part)
{
    const double percent = m->diagonal / 100;
    tli_thing thing = {.kind = TLI_THING_LINES,
                       .polydata = shape->parts[part],
                       .look = tl_look_defaults(),
                       .line = tl_line_opts_defaults()};
    if (!thing.polydata || !thing.polydata->cell_count) return TL_OK;
    tli_recipe recipe = tli_recipe_count(shape->recipe, entry->color->recipe);
    recipe = tli_recipe_count(recipe, tl_scene_node_version(m->agenda->scene, entry->node));
    thing.recipe = tli_recipe_count(recipe, (uint64_t)part);
    thing.look.scalar = thing.polydata->channels[OWN_CHANNELS].values;
    thing.look.transfer = entry->color->transfer;
    thing.look.opacity = part ? GHOST : tli_maker_real(m, entry, "opacity");
    thing.line.shape = shape_of(m, entry);
    thing.line.width_px = tli_maker_real(m, entry, "width_px");
    thing.line.halo_px = part ? 0 : tli_maker_real(m, entry, "halo_px");
    thing.line.dash = thing.line.gap = tli_maker_real(m, entry, "dash") * percent;
    const double arrows = tli_maker_real(m, entry, "arrows") * percent;
    thing.line.arrow_spacing = part ? 0 : arrows;
    thing.period = arrows > 0 ? arrows : thing.line.dash + thing.line.gap;
    thing.speed = thing.period > 0 ? tli_maker_real(m, entry, "speed") : 0;
    return tli_maker_add(m, &thing);
}

tl_status tli_make_lines(tli_maker *maker, const tli_entry *entry)
{
    double bounds[6] = {0};
    tli_scalar *color;
    const tl_scene *scene = maker->agenda->scene;
    if (!(tli_maker_real(maker, entry, "width_px") > 0)) return TL_OK;
    tl_status st = tli_maker_scalar(maker, entry->color, false, &color);
    if (st) return st;
    tli_recipe recipe = with_scalar(tli_maker_recipe(maker, entry), color);
    recipe = tli_recipe_text(recipe, tl_scene_text(scene, entry->node, "channel"));
    recipe = tli_recipe_text(recipe, tl_scene_text(scene, entry->node, "seeds"));
    recipe = tli_recipe_count(recipe, is_ribbon(maker, entry));
    recipe = tli_recipe_count(recipe, box_of(maker, entry, bounds));
    recipe = tli_recipe_bytes(recipe, bounds, sizeof bounds);
    const tli_shape *shape = tli_maker_find(maker, recipe, &st);
    if (!st && !shape) {
        tl_polydata *parts[2] = {NULL, NULL};
        st = follow(maker, entry, color, parts);
        if (!st)
            st = tli_maker_keep(maker, recipe, parts[0], parts[1], &shape);
        else
            for (int i = 0; i < 2; i++) tl_polydata_destroy(maker->ctx, parts[i]);
    }
    for (int part = 0; !st && part < 2; part++) st = add_part(maker, entry, shape, part);
    return st ? tl_note(maker->ctx, st, "in %s", tl_scene_name(scene, entry->node)) : TL_OK;
}
