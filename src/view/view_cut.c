/* The cut that a scene asks for, and its mesh. */
#include <math.h>
#include <stdio.h>

#include "formats/formats_number.h"
#include "view/view.h"

/* Main memory that a tet of a content takes, with its share of all that is made of it: a limit of
 * memory is one of tets. */
static const double TET_BYTES = 160;
enum { NAME_BYTES = 512 };

tl_view_request tl_view_request_defaults(void)
{
    return (tl_view_request){.struct_bytes = sizeof(tl_view_request), .channel = TL_NONE};
}

tl_view_limits tl_view_limits_defaults(void)
{
    return (tl_view_limits){.struct_bytes = sizeof(tl_view_limits), .tets_max = UINT64_MAX};
}

/* ---- bounds ---- */

static double real(const tl_scene *scene, const char *prop)
{
    return tl_scene_real(scene, TL_NODE_DETAIL + 1, prop);
}

/* What a query is made of. */
typedef struct asked {
    tl_ctx *ctx;
    const tl_view *view;
    const tl_store_head *head;
    const tl_scene *scene;
    const tl_view_request *request;
    int64_t step;
    double *channels, *inside; /* [channel_count] bounds, and in the focus box */
    double box[6];
    bool is_said;                            /* a bound or budget */
    bool is_bounded, is_coarser, is_smaller; /* a bound alone; by limits: in pixels, in tets */
} asked;

/* A bound of all channels of the step, of the one of that name, or of the visible values. */
static tl_status bound_channel(const asked *a, const char *name, double value, bool percent,
                               tl_cut_query *query)
{
    bool found = false;
    const uint32_t seen = a->request->channel;
    char list[2048] = "";
    size_t at = 0;
    for (uint32_t c = 0; c < a->head->channel_count; c++) {
        const tl_store_channel *channel = &a->head->channels[c];
        const double range = channel->range[1] - channel->range[0];
        if (!tli_in_step(channel, a->step)) continue;
        if (at < sizeof list) {
            const int n = snprintf(list + at, sizeof list - at, " '%s'", channel->name);
            at += n > 0 ? (size_t)n : 0;
        }
        if (*name ? strcmp(channel->name, name) != 0 : seen != TL_NONE && c != seen) continue;
        found = true;
        if (c != seen)
            a->channels[c] = fmin(a->channels[c], percent ? value * range : value);
        else if (range > 0)
            query->bounds.classified =
                fmin(query->bounds.classified, percent ? value : value / range);
    }
    if (found || !*name) return TL_OK;
    tl_fail(a->ctx, TL_ERR_ARG, "the model has no channel '%s'", name);
    return tl_note(a->ctx, TL_ERR_ARG, "channels:%s", *list ? list : " none");
}

/* "[CHANNEL=]E[%]" */
static tl_status bound_word(const asked *a, const char *word, tl_cut_query *query)
{
    double value = 0;
    char name[NAME_BYTES] = "";
    const char *equals = strrchr(word, '='), *amount = equals ? equals + 1 : word;
    const size_t length = equals ? (size_t)(equals - word) : 0;
    const bool percent = *amount && amount[strlen(amount) - 1] == '%';
    const char *end = amount + strlen(amount) - percent;
    if (tli_number_f64(amount, end, &value) != end || !(value > 0) || !isfinite(value) ||
        length >= sizeof name || (equals && !length))
        return tl_fail(a->ctx, TL_ERR_ARG,
                       "detail.errors: '%s', expected E, E%%, CHANNEL=E or CHANNEL=E%%, above 0",
                       word);
    memcpy(name, word, length);
    name[length] = '\0';
    return bound_channel(a, name, percent ? value / 100 : value, percent, query);
}

static tl_status bound_channels(asked *a, tl_cut_query *query)
{
    tl_status st = TL_OK;
    char word[NAME_BYTES + 64];
    const char *text = tl_scene_text(a->scene, TL_NODE_DETAIL + 1, "errors");
    const double error = real(a->scene, "error");
    for (uint32_t c = 0; c < a->head->channel_count; c++) a->channels[c] = (double)INFINITY;
    a->is_said |= *text || error > 0;
    while (!st && *text) {
        const size_t length = strcspn(text, ";");
        snprintf(word, sizeof word, "%.*s", (int)length, text);
        text += length + (text[length] == ';');
        st = bound_word(a, word, query);
    }
    if (!st && error > 0)
        st = bound_channel(a, tl_scene_text(a->scene, TL_NODE_DETAIL + 1, "error_channel"), error,
                           false, query);
    query->bounds.channels = a->channels;
    return st;
}

static double bound_or_any(asked *a, const char *prop)
{
    const double bound = real(a->scene, prop);
    a->is_said |= bound > 0;
    return bound > 0 ? bound : (double)INFINITY;
}

/* Length of a pixel at a place, mesh units. */
static double pixel_length(const tl_camera *camera, const double x[3])
{
    double along = 0, length = 0;
    if (camera->parallel_scale > 0) return 2 * camera->parallel_scale / camera->size_px[1];
    for (int k = 0; k < 3; k++) {
        const double view = camera->focal_point[k] - camera->position[k];
        along += (x[k] - camera->position[k]) * view;
        length += view * view;
    }
    const double distance = fabs(along) / sqrt(length);
    return 2 * distance * tan(camera->view_angle * acos(-1) / 360) / camera->size_px[1];
}

/* Bounds inside of the box are finer than outside by the gain; what pixels ask for, there as
 * lengths at its middle. */
static void set_focus(asked *a, tl_cut_query *query)
{
    double middle[3];
    const double gain = fmax(real(a->scene, "focus_gain"), 1);
    if (!tl_scene_flag(a->scene, TL_NODE_DETAIL + 1, "focus") || query->level == 0) return;
    tl_scene_box(a->scene, TL_NODE_DETAIL + 1, "focus_box", a->box);
    query->box = a->box;
    query->outside = query->bounds;
    for (uint32_t c = 0; c < a->head->channel_count; c++) a->inside[c] = a->channels[c] / gain;
    query->bounds.channels = a->inside;
    query->bounds.classified /= gain;
    query->bounds.boundary /= gain;
    query->bounds.space /= gain;
    if (!query->camera || !isfinite(query->pixels)) return;
    for (int k = 0; k < 3; k++) middle[k] = a->box[k] / 2 + a->box[3 + k] / 2;
    const double length = query->pixels * pixel_length(query->camera, middle) / gain;
    query->bounds.space = fmin(query->bounds.space, length);
    query->bounds.boundary = fmin(query->bounds.boundary, length);
}

/* The cut that is there stays, for the picture to come. */
static bool is_frozen(const tl_scene *scene)
{
    return tl_scene_flag(scene, TL_NODE_DETAIL + 1, "frozen");
}

static tl_status fill_query(asked *a, const tl_view_limits *limits, tl_cut_query *query)
{
    const double pixels = real(a->scene, "error_px"), ram = real(a->scene, "ram_bytes");
    double tets = real(a->scene, "tets");
    query->camera = a->request->camera;
    query->opacity = a->request->opacity;
    query->unseen = a->request->unseen;
    tl_status st = bound_channels(a, query);
    query->bounds.space = bound_or_any(a, "space_error");
    query->bounds.boundary = bound_or_any(a, "boundary_error");
    a->is_said |= query->camera && pixels > 0;
    a->is_bounded = a->is_said;
    a->is_said |= tets > 0;
    if (tl_scene_flag(a->scene, TL_NODE_DETAIL + 1, "full") || !a->is_said) query->level = 0;
    a->is_bounded |= query->level == 0;
    if (query->camera && pixels > 0) query->pixels = pixels;
    if (ram > 0) tets = fmin(tets > 0 ? tets : (double)INFINITY, ceil(ram / TET_BYTES));
    if (tets > 0) query->tets_max = (uint64_t)tets;
    a->is_smaller = limits->tets_max < query->tets_max;
    a->is_coarser = limits->error_px_least > 0 && query->camera &&
                    (limits->error_px_least > query->pixels || query->level == 0);
    if (a->is_coarser) {
        query->pixels = limits->error_px_least;
        query->level = UINT32_MAX;
    }
    if (a->is_smaller) query->tets_max = limits->tets_max;
    set_focus(a, query);
    return st;
}

/* ---- the cut ---- */

tli_recipe tli_cut_recipe(const tl_cut *cut, int64_t step)
{
    size_t count;
    tli_recipe sum = 0;
    const uint32_t *patches = tl_cut_patches(cut, &count);
    for (size_t i = 0; i < count; i++) sum += tli_recipe_count(3, patches[i]);
    return tli_recipe_count(tli_recipe_count(sum, count), (uint64_t)step);
}

static bool is_named(const tl_view_request *request, const char *name)
{
    bool found = !request->names;
    for (size_t i = 0; !found && i < request->name_count; i++)
        found = strcmp(request->names[i], name) == 0;
    return found;
}

/* The channels of the step that are asked for; all where the scene may name any. */
static void choose_channels(tl_view *view, const tl_scene *scene, int64_t step,
                            const tl_view_request *request)
{
    const tl_store_head *head = tl_store_get_head(view->source->store);
    const bool all = tli_derives(scene);
    view->channel_count = 0;
    for (uint32_t c = 0; c < head->channel_count; c++)
        if (tli_in_step(&head->channels[c], step) &&
            (all || is_named(request, head->channels[c].name)))
            view->channels[view->channel_count++] = c;
}

tl_status tli_view_move(tl_ctx *ctx, tl_view *view, const tl_scene *scene, int64_t step,
                        const tl_view_request *request, const tl_view_limits *limits)
{
    tl_status st = TL_OK;
    const double start = tli_clock_s();
    if (!view->source->store) return TL_OK;
    const tl_store_head *head = tl_store_get_head(view->source->store);
    const tl_view_limits none = tl_view_limits_defaults();
    const bool stays = view->has_cut && (limits->any_cut || is_frozen(scene));
    asked a = {
        .ctx = ctx, .view = view, .head = head, .scene = scene, .request = request, .step = step};
    choose_channels(view, scene, step, request);
    tl_cut_query query = tl_cut_query_defaults();
    a.channels = tl_mem_alloc(ctx, head->channel_count, sizeof *a.channels, &st);
    a.inside = tl_mem_alloc(ctx, head->channel_count, sizeof *a.inside, &st);
    if (!st) st = fill_query(&a, stays ? &none : limits, &query);
    if (!st && !view->cut) st = tl_cut_create(ctx, view->source->store, &view->cut);
    if (!st) st = stays ? tl_cut_assess(view->cut, &query) : tl_cut_update(view->cut, &query);
    tl_mem_free(ctx, a.inside);
    tl_mem_free(ctx, a.channels);
    view->cut_s = tli_clock_s() - start;
    if (st) return st;
    view->state = tl_cut_get_state(view->cut);
    const bool has_all = a.is_bounded && view->state.bounds_kept;
    if (!stays) view->is_draft = a.is_coarser || a.is_smaller;
    view->is_ahead |= !stays;
    view->is_limited =
        stays ? !has_all && !is_frozen(scene) : a.is_coarser || (a.is_smaller && !has_all);
    /* the camera is the one that the cut was made for */
    const bool is_first = !view->has_view;
    view->has_view = request->camera != NULL;
    if (view->has_view && (is_first || !stays)) view->camera = *request->camera;
    view->has_cut = true;
    return TL_OK;
}

tl_status tli_view_body(tl_ctx *ctx, tl_view *view, const tl_scene *scene, int64_t step,
                        double time)
{
    tl_status st = TL_OK;
    tli_body *whole = NULL, *derived = NULL;
    const double start = tli_clock_s();
    tli_recipe recipe;
    view->mesh_s = 0;
    if (view->source->store) {
        recipe = tli_cut_recipe(view->cut, step);
        recipe =
            tli_recipe_bytes(recipe, view->channels, view->channel_count * sizeof *view->channels);
    } else {
        st = tli_source_look(ctx, view->source, step, &whole);
        if (st) return st;
        recipe = whole->recipe;
    }
    if (view->body && view->body->recipe == tli_derive_recipe(recipe, scene)) {
        tli_body_release(whole);
        view->is_ahead = false;
        return TL_OK;
    }
    if (view->source->store)
        st = tli_source_mesh(ctx, view->source, view->cut, view->channels, view->channel_count,
                             time, recipe, &whole);
    if (!st && view->look && view->look->recipe == tli_derive_recipe(recipe, scene))
        derived = tli_body_use(view->look);
    else if (!st)
        st = tli_derive(ctx, scene, whole, &derived);
    tli_body_release(whole);
    if (!st) {
        tli_body_release(view->body);
        view->body = derived;
        view->is_ahead = false;
    }
    view->mesh_s = tli_clock_s() - start;
    return st;
}

/* ---- for others ---- */

tl_status tl_view_cut(tl_ctx *ctx, tl_view *view, const tl_scene *scene,
                      const tl_view_request *request, tl_cut_state *state)
{
    int64_t step;
    double time;
    tl_view_request own = tl_view_request_defaults();
    const tl_view_limits limits = tl_view_limits_defaults();
    tl_status st = tli_opts_take(ctx, "tl_view_request", request, &own, sizeof own);
    if (!st) st = tli_scene_step(ctx, view->source, scene, &step, &time);
    if (!st) st = tli_view_move(ctx, view, scene, step, &own, &limits);
    if (!st && state) *state = view->state;
    return st;
}

tl_cut *tl_view_get_cut(const tl_view *view)
{
    return view->cut;
}

tl_status tl_view_mesh(tl_ctx *ctx, tl_view *view, const tl_scene *scene, const tl_mesh **mesh,
                       size_t *whole_tets)
{
    int64_t step;
    double time;
    *mesh = NULL;
    tl_status st = tli_scene_step(ctx, view->source, scene, &step, &time);
    if (!st && view->source->store && !view->has_cut)
        st = tl_fail(ctx, TL_ERR_ARG, "there is no cut yet: tl_view_cut comes first");
    if (!st) st = tli_view_body(ctx, view, scene, step, time);
    if (st) return st;
    *mesh = view->body->mesh;
    if (whole_tets) *whole_tets = view->body->whole_tets;
    return TL_OK;
}

tl_status tl_view_create(tl_ctx *ctx, tl_source *source, tl_view **view)
{
    tl_status st = TL_OK;
    const size_t count = source->store ? tl_store_get_head(source->store)->channel_count : 0;
    tl_view *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    *view = NULL;
    if (st) return st;
    made->ctx = ctx;
    made->source = source;
    made->channels = tl_mem_alloc(ctx, count, sizeof *made->channels, &st);
    if (st)
        tl_view_destroy(made);
    else
        *view = made;
    return st;
}
