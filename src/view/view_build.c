/* Builds: from a scene and a camera to a content, with what is left of the one before. */
#include <math.h>

#include "view/view.h"
#include "view/view_frustum.h"
#include "view/view_places.h"

/* ---- facts ---- */

static uint64_t body_bytes(const tli_body *body)
{
    const tl_mesh *mesh = body->mesh;
    const uint64_t verts = tl_mesh_vert_count(mesh), tets = tl_mesh_tet_count(mesh);
    uint64_t bytes = verts * 3 * sizeof(double) + tets * 4 * sizeof(tl_lidx);
    for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
        const tl_channel *channel = tl_mesh_channel(mesh, c);
        bytes +=
            (channel->on == TL_ON_VERTEX ? verts : tets) * channel->components * sizeof(double);
    }
    for (size_t i = 0; i < body->scalar_count; i++)
        bytes += verts * sizeof(double) *
                 ((body->scalars[i]->own ? 1 : 0) + (body->scalars[i]->gradients ? 3 : 0));
    return bytes + (body->opposite ? tets * 4 * sizeof(tl_lidx) : 0);
}

/* Bounds of the errors of the mesh's channels: the first ones are those of the model, in the order
 * of the view's; others are computed. */
static tl_status set_errors(tl_ctx *ctx, const tl_view *view, tl_content *c)
{
    tl_status st = TL_OK;
    if (!view->source->store) return TL_OK;
    c->errors = tl_mem_alloc(ctx, view->channel_count, sizeof *c->errors, &st);
    for (size_t i = 0; !st && i < view->channel_count; i++)
        c->errors[i] = (tl_content_error){c->places ? tli_places_channel(c->places, i)
                                                    : tl_mesh_channel(c->body->mesh, i)->name,
                                          tl_cut_channel_error(view->cut, view->channels[i])};
    c->facts.errors = c->errors;
    c->facts.error_count = st ? 0 : view->channel_count;
    return st;
}

/* What stands around surfaces keeps what is asked for, too. */
static void add_hull(const tl_view *hull, tl_content_facts *f)
{
    if (hull->has_view) f->error_px = fmax(f->error_px, hull->state.pixels);
    f->boundary_error = fmax(f->boundary_error, hull->state.boundary_error);
    f->bounds_kept = f->bounds_kept && hull->state.bounds_kept;
    f->is_complete = f->is_complete && !hull->is_limited;
}

/* A mesh may move from step to step. */
static const double *seen_bounds(const tli_agenda *agenda, const tl_source_facts *source)
{
    return source->is_model && !tli_chooses(agenda->scene) ? source->bounds : agenda->look->bounds;
}

static tl_status set_facts(tl_ctx *ctx, const tl_view *view, const tli_agenda *agenda,
                           tl_content *c)
{
    const tl_source_facts *source = &view->source->facts;
    tl_content_facts *f = &c->facts;
    f->is_model = source->is_model;
    f->tets = c->places ? view->state.tets : tl_mesh_tet_count(c->body->mesh);
    f->verts = c->places ? 0 : tl_mesh_vert_count(c->body->mesh);
    f->is_part = !c->places && c->body->whole_tets;
    f->whole_tets = f->is_part ? c->body->whole_tets : f->tets;
    f->source_tets = source->is_model ? source->tets : tl_mesh_tet_count(agenda->whole->mesh);
    f->step = agenda->step;
    f->time = agenda->time;
    f->bounds_kept = f->is_complete = true;
    memcpy(f->bounds, seen_bounds(agenda, source), sizeof f->bounds);
    f->bytes = c->body ? body_bytes(c->body) : 0;
    for (size_t i = 0; i < c->shape_count; i++)
        for (int part = 0; part < 2; part++)
            if (c->shapes[i]->parts[part])
                f->bytes += tli_polydata_bytes(c->shapes[i]->parts[part]);
    for (size_t i = 0; i < c->thing_count; i++) f->is_moving |= c->things[i].speed != 0;
    if (!source->is_model) return TL_OK;
    f->patches = view->state.patches;
    f->error_px = view->has_view ? view->state.pixels : 0;
    f->boundary_error = view->state.boundary_error;
    f->space_error = view->state.space_error;
    f->bounds_kept = view->state.bounds_kept;
    f->is_complete = !view->is_limited;
    if (c->places) {
        f->bytes += tli_strips_bytes(view);
        if (c->body) add_hull(view->hull, f);
    }
    tl_status st = set_errors(ctx, view, c);
    if (!st) st = tli_outlook_take(ctx, view->cut, &c->outlook);
    if (!st && c->places && c->body) st = tli_outlook_take(ctx, view->hull->cut, &c->hull_outlook);
    return st;
}

/* ---- the cut of an agenda ---- */

/* Names of the channels that are drawn. False: all are needed, as for an expression. */
static bool needed_names(const tl_view *view, const tli_agenda *agenda, tli_share share,
                         const char **names, size_t *count)
{
    const tl_store_head *head = tl_store_get_head(view->source->store);
    *count = 0;
    if (agenda->has_lines) return false;
    for (size_t i = 0; i < agenda->paint_count; i++) {
        uint32_t c = 0;
        const char *name = agenda->paints[i]->channel;
        if (!tli_is_used(agenda, share, agenda->paints[i])) continue;
        while (c < head->channel_count && strcmp(head->channels[c].name, name) != 0) c++;
        if (c == head->channel_count) return false;
        names[(*count)++] = name;
    }
    return *count || share == TLI_HULL;
}

/* Moves the cut of a view for a share of the things; those that are asked have the channels of all.
 */
static tl_status move_cut(tl_ctx *ctx, tl_view *view, const tli_agenda *agenda, tli_share share,
                          const tl_camera *camera, const tl_view_limits *limits)
{
    tl_status st = TL_OK;
    tl_view_request request = tl_view_request_defaults();
    if (!view->source->store) return TL_OK;
    const size_t bins = (size_t)tl_store_get_head(view->source->store)->channel_count * TL_BINS;
    const tli_share named = share == TLI_HULL ? TLI_HULL : TLI_ALL;
    tli_seen seen = {tl_mem_zalloc(ctx, bins, sizeof(float), &st), NULL};
    seen.unseen = tl_mem_zalloc(ctx, bins, sizeof(float), &st);
    const char **names = tl_mem_alloc(ctx, agenda->paint_count + 1, sizeof *names, &st);
    if (!st) {
        request.camera = camera;
        if (needed_names(view, agenda, named, names, &request.name_count)) request.names = names;
        if (tli_see(view->source, agenda, share, &seen)) {
            request.opacity = seen.opacity;
            request.unseen = seen.unseen;
        }
        st = tli_view_move(ctx, view, agenda->scene, agenda->step, &request, limits);
    }
    tl_mem_free(ctx, names);
    tl_mem_free(ctx, seen.unseen);
    tl_mem_free(ctx, seen.opacity);
    return st;
}

static void drop_body(tl_view *view)
{
    tli_body_release(view->body);
    view->body = NULL;
}

/* The mesh that boundary and edges around surfaces are made of, as coarse as they may be. */
static tl_status make_hull(tl_ctx *ctx, tl_view *view, const tli_agenda *agenda,
                           const tl_camera *camera, const tl_view_limits *limits)
{
    tl_status st = view->hull ? TL_OK : tl_view_create(ctx, view->source, &view->hull);
    if (!st) st = move_cut(ctx, view->hull, agenda, TLI_HULL, camera, limits);
    if (!st) st = tli_view_body(ctx, view->hull, agenda->scene, agenda->step, agenda->time);
    if (st) return st;
    view->cut_s += view->hull->cut_s;
    view->mesh_s += view->hull->mesh_s;
    return TL_OK;
}

/* Cut and meshes: of all things one, or, where surfaces are made patch by patch, that of the hull.
 */
static tl_status make_meshes(tl_ctx *ctx, tl_view *view, const tli_agenda *agenda,
                             const tl_camera *camera, const tl_view_limits *limits, tl_content *c)
{
    bool has_hull = false;
    tl_view_limits own = *limits;
    const tli_share share = agenda->by_patch ? TLI_CUTS : TLI_ALL;
    const bool has_mesh = view->body && !view->is_ahead;
    own.any_cut = own.any_cut && (agenda->by_patch || has_mesh || !view->has_cut ||
                                  view->state.tets <= limits->tets_max);
    tl_status st = move_cut(ctx, view, agenda, share, camera, &own);
    for (size_t i = 0; i < agenda->thing_count; i++)
        has_hull |= agenda->by_patch && tli_shares(TLI_HULL, &agenda->things[i]);
    if (view->hull && !has_hull) drop_body(view->hull);
    if (!st && !agenda->by_patch) {
        st = tli_view_body(ctx, view, agenda->scene, agenda->step, agenda->time);
        if (!st) c->body = tli_body_use(view->body);
        return st;
    }
    drop_body(view);
    view->mesh_s = 0;
    if (!st && has_hull) st = make_hull(ctx, view, agenda, camera, &own);
    if (!st && has_hull) c->body = tli_body_use(view->hull->body);
    return st ? st : tli_places_create(ctx, view, agenda->time, &c->places);
}

/* ---- things ---- */

/* Those that change with the camera or time come last, so that the others can stay in a renderer
 * before them; else their order stays. */
static tl_status order_things(tl_ctx *ctx, tl_content *c)
{
    tl_status st = TL_OK;
    size_t count = 0;
    tli_thing *sorted = tl_mem_alloc(ctx, c->thing_count, sizeof *sorted, &st);
    for (int pass = 0; !st && pass < 3; pass++)
        for (size_t i = 0; i < c->thing_count; i++) {
            const int own = c->things[i].kind == TLI_THING_SILHOUETTES ? 1
                            : c->things[i].speed != 0                  ? 2
                                                                       : 0;
            if (own == pass) sorted[count++] = c->things[i];
        }
    if (st) return st;
    tl_mem_free(ctx, c->things);
    c->things = sorted;
    return TL_OK;
}

/* Whether a surface has the colour of its value: no other channel's, none of its own. */
static bool has_value_color(const tli_agenda *agenda, const tli_entry *thing)
{
    tl_value color;
    return thing->kind == TL_NODE_SURFACE && !thing->color &&
           !tl_scene_get(thing->own->ctx, agenda->scene, thing->node, "color", &color) &&
           !color.count;
}

/* The paint that a thing explains its colours by, if it has that role; NULL: none. */
static const tli_paint *paint_of_role(const tli_agenda *agenda, const tli_entry *thing, int role)
{
    const bool is_own =
        (thing->kind == TL_NODE_POINTS && !thing->color) || has_value_color(agenda, thing);
    switch (role) {
    case 0: return thing->kind == TL_NODE_VOLUME ? thing->own : NULL;
    case 1: return tli_is_glass(agenda, thing) ? NULL : thing->color;
    default: return is_own ? thing->own : NULL;
    }
}

size_t tli_agenda_bars(const tli_agenda *agenda, const tl_values **bars)
{
    size_t count = 0;
    for (int role = 0; role < 3; role++)
        for (size_t i = 0; i < agenda->thing_count; i++) {
            const tli_paint *paint = paint_of_role(agenda, &agenda->things[i], role);
            size_t at = 0;
            if (!paint) continue;
            while (at < count && bars[at] != &paint->values) at++;
            if (at == count) bars[count++] = &paint->values;
        }
    return count;
}

static tl_status take_paints(tl_ctx *ctx, const tli_agenda *agenda, tl_content *c)
{
    tl_status st = TL_OK;
    c->paints = tl_mem_alloc(ctx, agenda->paint_count, sizeof *c->paints, &st);
    c->values = tl_mem_alloc(ctx, agenda->paint_count, sizeof *c->values, &st);
    c->bars = tl_mem_alloc(ctx, agenda->paint_count, sizeof *c->bars, &st);
    for (size_t i = 0; !st && i < agenda->paint_count; i++) {
        c->paints[i] = tli_paint_use(agenda->paints[i]);
        c->values[i] = &c->paints[i]->values;
        c->paint_count++;
    }
    if (!st) c->bar_count = tli_agenda_bars(agenda, c->bars);
    return st;
}

static tl_status make_things(tl_ctx *ctx, tl_view *view, const tli_agenda *agenda,
                             const tl_camera *camera, tl_content *c)
{
    tl_status st = TL_OK;
    tli_maker maker = {.ctx = ctx,
                       .view = view,
                       .agenda = agenda,
                       .body = c->body,
                       .content = c,
                       .diagonal = view->source->facts.diagonal,
                       .by_patch = agenda->by_patch};
    maker.recipe = agenda->by_patch
                       ? tli_recipe_text(tli_cut_recipe(view->cut, agenda->step), "cut")
                       : c->body->recipe;
    if (maker.by_patch) st = tli_make_strips(&maker);
    for (size_t i = 0; !st && i < agenda->thing_count; i++) {
        st = tli_make_thing(&maker, &agenda->things[i]);
        if (!st) st = tl_progress(ctx, "scene", i + 1, agenda->thing_count);
    }
    if (!st) st = tli_make_frustum(&maker, camera);
    return st ? st : order_things(ctx, c);
}

/* ---- life ---- */

static void release_kept(tl_ctx *ctx, tli_paint **paints, size_t paint_count, tli_shape **shapes,
                         size_t shape_count)
{
    for (size_t i = 0; i < paint_count; i++) tli_paint_release(paints[i]);
    for (size_t i = 0; i < shape_count; i++) tli_shape_release(shapes[i]);
    tl_mem_free(ctx, paints);
    tl_mem_free(ctx, shapes);
}

void tl_content_destroy(tl_ctx *ctx, tl_content *content)
{
    if (!content) return;
    tl_mem_free(ctx, content->things);
    for (int i = 0; i < 2; i++) tl_transfer_destroy(ctx, content->marks[i]);
    release_kept(ctx, content->paints, content->paint_count, content->shapes, content->shape_count);
    tl_mem_free(ctx, content->bars);
    tl_mem_free(ctx, content->values);
    tl_mem_free(ctx, content->errors);
    tli_outlook_release(ctx, &content->outlook);
    tli_outlook_release(ctx, &content->hull_outlook);
    tli_places_destroy(content->places);
    tli_body_release(content->body);
    tl_mem_free(ctx, content);
}

/* What the next build can use again. */
static tl_status keep(tl_ctx *ctx, tl_view *view, const tl_content *c)
{
    tl_status st = TL_OK;
    tli_paint **paints = tl_mem_alloc(ctx, c->paint_count, sizeof *paints, &st);
    tli_shape **shapes = tl_mem_alloc(ctx, c->shape_count, sizeof *shapes, &st);
    if (st) {
        tl_mem_free(ctx, paints);
        return st;
    }
    for (size_t i = 0; i < c->paint_count; i++) paints[i] = tli_paint_use(c->paints[i]);
    for (size_t i = 0; i < c->shape_count; i++) {
        atomic_fetch_add(&c->shapes[i]->uses, 1);
        shapes[i] = c->shapes[i];
    }
    release_kept(ctx, view->paints, view->paint_count, view->shapes, view->shape_count);
    view->paints = paints;
    view->paint_count = c->paint_count;
    view->shapes = shapes;
    view->shape_count = c->shape_count;
    return TL_OK;
}

void tl_view_trim(tl_view *view)
{
    if (view->hull) tl_view_trim(view->hull);
    tli_strips_tidy(view, NULL);
    release_kept(view->ctx, view->paints, view->paint_count, view->shapes, view->shape_count);
    view->paints = NULL;
    view->shapes = NULL;
    view->paint_count = view->shape_count = 0;
    drop_body(view);
}

void tl_view_destroy(tl_view *view)
{
    if (!view) return;
    tl_view_trim(view);
    tl_view_destroy(view->hull);
    tl_mem_free(view->ctx, view->strips);
    for (size_t i = 0; i < TLI_RECENT_PAINTS; i++) tli_paint_release(view->recent[i]);
    tli_body_release(view->look);
    tli_body_release(view->whole);
    tl_cut_destroy(view->cut);
    tl_mem_free(view->ctx, view->channels);
    tl_mem_free(view->ctx, view);
}

/* ---- all of it ---- */

static tl_status build(tl_ctx *ctx, tl_view *view, const tli_agenda *agenda,
                       const tl_camera *camera, const tl_view_limits *limits, tl_content *c)
{
    tl_status st = make_meshes(ctx, view, agenda, camera, limits, c);
    if (st) return st;
    const double start = tli_clock_s();
    st = take_paints(ctx, agenda, c);
    if (!st) st = make_things(ctx, view, agenda, camera, c);
    if (!st) tli_strips_tidy(view, agenda);
    if (!st) st = set_facts(ctx, view, agenda, c);
    if (!st) st = keep(ctx, view, c);
    c->facts.cut_s = view->cut_s;
    c->facts.mesh_s = view->mesh_s;
    c->facts.extract_s = tli_clock_s() - start;
    return st;
}

tl_status tl_view_build(tl_ctx *ctx, tl_view *view, const tl_scene *scene, const tl_camera *camera,
                        const tl_view_limits *limits, tl_content **content)
{
    tli_agenda agenda;
    tl_view_limits own = tl_view_limits_defaults();
    *content = NULL;
    tl_status st = tli_opts_take(ctx, "tl_view_limits", limits, &own, sizeof own);
    if (!st) st = tl_camera_check(ctx, camera);
    if (!st) st = tl_progress(ctx, "scene", 0, 1);
    if (!st) st = tli_agenda_create(ctx, view, scene, &agenda);
    if (st) return st;
    tl_content *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (!st) {
        made->ctx = ctx;
        st = build(ctx, view, &agenda, camera, &own, made);
    }
    tli_agenda_release(ctx, &agenda);
    if (st == TL_ERR_MEMORY || st == TL_ERR_BUDGET) tli_strips_tidy(view, NULL); /* for the next */
    if (st)
        tl_content_destroy(ctx, made);
    else
        *content = made;
    return st;
}

/* ---- before there is a content ---- */

tl_status tl_view_values(tl_ctx *ctx, tl_view *view, const tl_scene *scene, const char *channel,
                         const tl_values **values)
{
    tli_agenda agenda;
    tl_status st = tli_agenda_begin(ctx, view, scene, &agenda);
    if (!st) st = tli_agenda_paint(ctx, view, &agenda, channel);
    if (!st) *values = &agenda.paints[0]->values; /* the view has it, too */
    tli_agenda_release(ctx, &agenda);
    return st;
}

tl_status tl_view_bounds(tl_ctx *ctx, tl_view *view, const tl_scene *scene, double bounds[6])
{
    tli_agenda agenda;
    tl_status st = tli_agenda_begin(ctx, view, scene, &agenda);
    if (!st) memcpy(bounds, seen_bounds(&agenda, &view->source->facts), 6 * sizeof *bounds);
    tli_agenda_release(ctx, &agenda);
    return st;
}
