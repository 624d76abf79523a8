/* Agendas: the visible things of a scene with the paints they need. */
#include <math.h>

#include "view/view.h"

/* ---- what a node says ---- */

/* Whether a thing is drawn: visible, and not without its channel yet. */
static bool is_drawn(const tl_scene *scene, tl_node node)
{
    const tl_node_kind kind = tl_scene_kind(scene, node);
    const bool needs_channel = kind == TL_NODE_VOLUME || kind == TL_NODE_SURFACE ||
                               kind == TL_NODE_POINTS || kind == TL_NODE_LINES;
    return kind >= TL_NODE_VOLUME && tl_scene_flag(scene, node, "visible") &&
           !(needs_channel && !*tl_scene_text(scene, node, "channel"));
}

double tli_surface_value(const tl_scene *scene, const tli_entry *thing)
{
    tl_value value;
    const tl_values *own = &thing->own->values;
    /* the property is there: a context is for messages alone */
    if (tl_scene_get(thing->own->ctx, scene, thing->node, "value", &value) || !value.count)
        return own->range[0] / 2 + own->range[1] / 2;
    return value.reals[0];
}

/* The channel that a thing is made of, on vertices or by means of tets; NULL: none. */
static const char *own_channel(const tl_scene *scene, const tli_entry *thing)
{
    const bool has = thing->kind == TL_NODE_VOLUME || thing->kind == TL_NODE_SURFACE ||
                     thing->kind == TL_NODE_POINTS;
    return has ? tl_scene_text(scene, thing->node, "channel") : NULL;
}

/* The channel whose colours it has; NULL: none. */
static const char *color_channel(const tl_scene *scene, const tli_entry *thing)
{
    const char *name = NULL;
    switch (thing->kind) {
    case TL_NODE_SURFACE:
    case TL_NODE_SLICE:
    case TL_NODE_BOUNDARY:
    case TL_NODE_POINTS:
    case TL_NODE_LINES: name = tl_scene_text(scene, thing->node, "color_by"); break;
    default: return NULL;
    }
    if (thing->kind == TL_NODE_LINES && !*name) name = tl_scene_text(scene, thing->node, "channel");
    if (thing->kind == TL_NODE_BOUNDARY && tl_scene_real(scene, thing->node, "mark") != 0)
        return NULL;
    return *name ? name : NULL;
}

/* ---- paints ---- */

static tl_status add_paint(tl_ctx *ctx, tli_agenda *agenda, tli_paint *paint)
{
    tl_status st = TL_OK;
    tli_paint **grown =
        tl_mem_resize(ctx, agenda->paints, agenda->paint_count + 1, sizeof *agenda->paints, &st);
    agenda->paints = grown;
    if (st)
        tli_paint_release(paint);
    else
        agenda->paints[agenda->paint_count++] = paint;
    return st;
}

/* A paint that the view still has, used; or NULL. */
static tli_paint *find_paint(const tl_view *view, tli_recipe recipe)
{
    for (size_t i = 0; i < view->paint_count; i++)
        if (view->paints[i]->recipe == recipe) return tli_paint_use(view->paints[i]);
    for (size_t i = 0; i < TLI_RECENT_PAINTS; i++)
        if (view->recent[i] && view->recent[i]->recipe == recipe)
            return tli_paint_use(view->recent[i]);
    return NULL;
}

static tl_status make_paint(tl_ctx *ctx, tl_view *view, const tli_agenda *agenda,
                            const char *channel, tli_paint **paint)
{
    tl_status st = tli_paint_create(ctx, view->source, agenda->scene, agenda->step, agenda->whole,
                                    channel, paint);
    if (st) return st;
    tli_paint **slot = &view->recent[view->recent_next++ % TLI_RECENT_PAINTS];
    tli_paint_release(*slot);
    *slot = tli_paint_use(*paint);
    return TL_OK;
}

/* The paint of a channel, from the agenda, from the view, or new. */
static tl_status get_paint(tl_ctx *ctx, tl_view *view, tli_agenda *agenda, const char *channel,
                           tli_paint **paint)
{
    const tli_recipe recipe = tli_paint_recipe(agenda->whole, agenda->scene, channel);
    *paint = NULL;
    for (size_t i = 0; i < agenda->paint_count; i++)
        if (agenda->paints[i]->recipe == recipe) *paint = agenda->paints[i];
    if (*paint) return TL_OK;
    *paint = find_paint(view, recipe);
    tl_status st = *paint ? TL_OK : make_paint(ctx, view, agenda, channel, paint);
    return st ? st : add_paint(ctx, agenda, *paint);
}

tl_status tli_agenda_paint(tl_ctx *ctx, tl_view *view, tli_agenda *agenda, const char *channel)
{
    tli_paint *paint;
    return get_paint(ctx, view, agenda, channel, &paint);
}

static bool needs_channel(const tl_scene *scene, const tli_agenda *agenda, const char *channel)
{
    for (size_t i = 0; i < agenda->thing_count; i++) {
        const char *own = own_channel(scene, &agenda->things[i]);
        const char *color = color_channel(scene, &agenda->things[i]);
        if ((own && strcmp(own, channel) == 0) || (color && strcmp(color, channel) == 0))
            return true;
    }
    return false;
}

/* Those with a transfer node first, in the order of these. */
static tl_status set_paints(tl_ctx *ctx, tl_view *view, tli_agenda *agenda)
{
    tl_status st = TL_OK;
    size_t count;
    tli_paint *paint;
    const tl_node *nodes = tl_scene_nodes(agenda->scene, &count);
    for (size_t i = 0; !st && i < count; i++) {
        if (tl_scene_kind(agenda->scene, nodes[i]) != TL_NODE_TRANSFER) continue;
        const char *channel = tl_scene_text(agenda->scene, nodes[i], "channel");
        if (needs_channel(agenda->scene, agenda, channel))
            st = get_paint(ctx, view, agenda, channel, &paint);
    }
    for (size_t i = 0; !st && i < agenda->thing_count; i++) {
        tli_entry *thing = &agenda->things[i];
        const char *own = own_channel(agenda->scene, thing);
        const char *color = color_channel(agenda->scene, thing);
        if (own) st = get_paint(ctx, view, agenda, own, &thing->own);
        if (!st && color) st = get_paint(ctx, view, agenda, color, &thing->color);
        if (st) st = tl_note(ctx, st, "in %s", tl_scene_name(agenda->scene, thing->node));
    }
    return st;
}

/* ---- all of it ---- */

/* Surfaces between regions. */
static bool is_inside(const tl_scene *scene, tl_node node)
{
    return tl_scene_kind(scene, node) == TL_NODE_BOUNDARY &&
           tl_scene_flag(scene, node, "interfaces");
}

static tl_status set_things(tl_ctx *ctx, tli_agenda *agenda)
{
    tl_status st = TL_OK;
    size_t count;
    bool has_volume = false;
    const tl_node *nodes = tl_scene_nodes(agenda->scene, &count);
    agenda->things = tl_mem_zalloc(ctx, count, sizeof *agenda->things, &st);
    for (size_t i = 0; !st && i < count; i++) {
        const tl_node_kind kind = tl_scene_kind(agenda->scene, nodes[i]);
        if (!is_drawn(agenda->scene, nodes[i])) continue;
        if (kind == TL_NODE_VOLUME && has_volume) continue; /* a renderer draws one */
        has_volume |= kind == TL_NODE_VOLUME;
        agenda->things[agenda->thing_count++] = (tli_entry){.node = nodes[i], .kind = kind};
        agenda->has_lines |= kind == TL_NODE_LINES;
        agenda->has_glass |= kind == TL_NODE_VOLUME || kind == TL_NODE_SURFACE ||
                             kind == TL_NODE_SLICE || kind == TL_NODE_POINTS ||
                             kind == TL_NODE_LINES || is_inside(agenda->scene, nodes[i]);
    }
    return st;
}

/* A body that a view keeps, in place of another one or of itself. */
static void keep(tli_body **kept, tli_body *body)
{
    if (*kept == body) return;
    tli_body_release(*kept);
    *kept = tli_body_use(body);
}

/* The coarse mesh with the channels that are derived, of which paints are made: whatever is chosen
 * of it, they stay. */
static tl_status set_whole(tl_ctx *ctx, tl_view *view, tli_agenda *agenda)
{
    tli_body *look;
    tl_status st = tli_source_look(ctx, view->source, agenda->step, &look);
    if (st) return st;
    const tli_recipe recipe = tli_formula_recipe(look->recipe, agenda->scene);
    if (view->whole && view->whole->recipe == recipe)
        agenda->whole = tli_body_use(view->whole);
    else
        st = tli_derive_channels(ctx, agenda->scene, look, &agenda->whole);
    tli_body_release(look);
    if (!st) keep(&view->whole, agenda->whole);
    return st;
}

static tl_status set_look(tl_ctx *ctx, tl_view *view, tli_agenda *agenda)
{
    tl_status st = TL_OK;
    const tli_recipe recipe = tli_choice_recipe(agenda->whole->recipe, agenda->scene);
    if (view->look && view->look->recipe == recipe)
        agenda->look = tli_body_use(view->look);
    else
        st = tli_choose(ctx, agenda->scene, agenda->whole, &agenda->look);
    if (!st) keep(&view->look, agenda->look);
    return st;
}

/* ---- which things ---- */

bool tli_shares(tli_share share, const tli_entry *thing)
{
    const tl_node_kind kind = thing->kind;
    if (share == TLI_CUTS) return kind == TL_NODE_SURFACE || kind == TL_NODE_SLICE;
    if (share == TLI_HULL)
        return kind == TL_NODE_BOUNDARY || kind == TL_NODE_EDGES || kind == TL_NODE_SILHOUETTES;
    return true;
}

bool tli_is_glass(const tli_agenda *agenda, const tli_entry *thing)
{
    return thing->kind == TL_NODE_BOUNDARY && agenda->has_glass &&
           tl_scene_real(agenda->scene, thing->node, "opacity") < 0 &&
           !tl_scene_flag(agenda->scene, thing->node, "interfaces");
}

bool tli_is_used(const tli_agenda *agenda, tli_share share, const tli_paint *paint)
{
    if (share == TLI_ALL) return true;
    for (size_t i = 0; i < agenda->thing_count; i++) {
        const tli_entry *thing = &agenda->things[i];
        if (!tli_shares(share, thing)) continue;
        if (thing->own == paint || (thing->color == paint && !tli_is_glass(agenda, thing)))
            return true;
    }
    return false;
}

static bool is_of_vertices(const tl_source *source, const tli_agenda *agenda,
                           const tli_paint *paint)
{
    return !paint || tli_source_channel(source, agenda->step, paint->values.channel) != TL_NONE;
}

/* Things that need the mesh of the whole cut: of all that is derived or chosen, of values on tets
 * and of formulas, and of interfaces. */
static bool is_by_patch(const tl_source *source, const tli_agenda *agenda)
{
    bool has_cuts = false;
    if (!source->store || tli_derives(agenda->scene)) return false;
    for (size_t i = 0; i < agenda->thing_count; i++) {
        const tli_entry *thing = &agenda->things[i];
        const bool cuts = tli_shares(TLI_CUTS, thing);
        has_cuts |= cuts;
        if (!cuts && !tli_shares(TLI_HULL, thing)) return false;
        if (cuts && !(is_of_vertices(source, agenda, thing->own) &&
                      is_of_vertices(source, agenda, thing->color)))
            return false;
        if (thing->kind == TL_NODE_BOUNDARY &&
            (tl_scene_flag(agenda->scene, thing->node, "interfaces") ||
             tl_scene_real(agenda->scene, thing->node, "mark") != 0))
            return false;
    }
    return has_cuts;
}

/* ---- life ---- */

tl_status tli_agenda_begin(tl_ctx *ctx, tl_view *view, const tl_scene *scene, tli_agenda *agenda)
{
    *agenda = (tli_agenda){.scene = scene};
    tl_status st = tli_scene_step(ctx, view->source, scene, &agenda->step, &agenda->time);
    if (!st) st = set_whole(ctx, view, agenda);
    if (!st) st = set_look(ctx, view, agenda);
    if (st) tli_agenda_release(ctx, agenda);
    return st;
}

tl_status tli_agenda_create(tl_ctx *ctx, tl_view *view, const tl_scene *scene, tli_agenda *agenda)
{
    tl_status st = tli_agenda_begin(ctx, view, scene, agenda);
    if (!st) st = set_things(ctx, agenda);
    if (!st) st = set_paints(ctx, view, agenda);
    if (!st) agenda->by_patch = is_by_patch(view->source, agenda);
    if (st) tli_agenda_release(ctx, agenda);
    return st;
}

void tli_agenda_release(tl_ctx *ctx, tli_agenda *agenda)
{
    for (size_t i = 0; i < agenda->paint_count; i++) tli_paint_release(agenda->paints[i]);
    tl_mem_free(ctx, agenda->paints);
    tl_mem_free(ctx, agenda->things);
    tli_body_release(agenda->look);
    tli_body_release(agenda->whole);
    *agenda = (tli_agenda){0};
}
