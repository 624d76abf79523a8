/* What is at a place of a cut whose surfaces were made patch by patch: the patches that may hold
 * it, or that a line may pass, become a mesh when one asks; the last few of these stay. */
#include "view/view_places.h"

#include "base/base_vec.h"

enum { BODIES = 8 };
/* By how much spheres are larger here, of their radius: what sums of squares may be off. */
static const double MARGIN = 1e-9;

struct tli_places {
    tl_ctx *ctx;
    tli_book *book;
    uint32_t *patches;    /* [count] rising */
    double (*spheres)[4]; /* [count] */
    size_t count;
    size_t *channels; /* [channel_count] of the model */
    size_t channel_count;
    double time;
    tli_lock lock;            /* of what follows */
    tli_body *bodies[BODIES]; /* used; by their recipes */
    size_t next;
};

/* ---- life ---- */

static tl_status fill(tl_ctx *ctx, const tl_view *view, tli_places *p)
{
    tl_status st = tli_cut_list(ctx, view->cut, &p->patches, &p->count);
    p->spheres = tl_mem_alloc(ctx, p->count, sizeof *p->spheres, &st);
    p->channels = tl_mem_alloc(ctx, view->channel_count, sizeof *p->channels, &st);
    if (!st && view->channel_count)
        memcpy(p->channels, view->channels, view->channel_count * sizeof *p->channels);
    p->channel_count = view->channel_count;
    for (size_t i = 0; !st && i < p->count; i++) {
        tl_patch_info info;
        st = tl_store_patch(ctx, p->book->store, p->patches[i], &info);
        if (!st) memcpy(p->spheres[i], info.sphere, sizeof p->spheres[i]);
    }
    return st;
}

tl_status tli_places_create(tl_ctx *ctx, const tl_view *view, double time, tli_places **places)
{
    tl_status st = TL_OK;
    tli_places *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (!st) st = tli_lock_create(ctx, &made->lock);
    *places = NULL;
    if (st) {
        tl_mem_free(ctx, made);
        return st;
    }
    made->ctx = ctx;
    made->time = time;
    made->book = tli_book_use(view->source->book);
    st = fill(ctx, view, made);
    if (st)
        tli_places_destroy(made);
    else
        *places = made;
    return st;
}

void tli_places_destroy(tli_places *places)
{
    if (!places) return;
    tl_ctx *ctx = places->ctx;
    for (size_t i = 0; i < BODIES; i++) tli_body_release(places->bodies[i]);
    tli_book_release(places->book);
    tli_lock_destroy(&places->lock);
    tl_mem_free(ctx, places->channels);
    tl_mem_free(ctx, places->spheres);
    tl_mem_free(ctx, places->patches);
    tl_mem_free(ctx, places);
}

/* ---- meshes ---- */

/* The body of these patches if it is there, used; it is the caller's to make else. */
static tli_body *find_body(tli_places *p, tli_recipe recipe)
{
    tli_body *found = NULL;
    tli_lock_take(&p->lock);
    for (size_t i = 0; !found && i < BODIES; i++)
        if (p->bodies[i] && p->bodies[i]->recipe == recipe) found = tli_body_use(p->bodies[i]);
    tli_lock_give(&p->lock);
    return found;
}

static void keep_body(tli_places *p, tli_body *body)
{
    tli_lock_take(&p->lock);
    tli_body *old = p->bodies[p->next];
    p->bodies[p->next] = tli_body_use(body);
    p->next = (p->next + 1) % BODIES;
    tli_lock_give(&p->lock);
    tli_body_release(old);
}

/* The parts of a search that differ: whether a sphere is met. */
typedef bool (*meets_fn)(const void *what, const double sphere[4]);

static tl_status take_body(tl_ctx *ctx, tli_places *p, meets_fn meets, const void *what,
                           tli_body **body)
{
    tl_status st = TL_OK;
    size_t count = 0;
    uint32_t *met = tl_mem_alloc(ctx, p->count, sizeof *met, &st);
    *body = NULL;
    if (st) return st;
    for (size_t i = 0; i < p->count; i++)
        if (meets(what, p->spheres[i])) met[count++] = p->patches[i];
    const tli_recipe recipe = tli_recipe_bytes(5, met, count * sizeof *met);
    if (count) *body = find_body(p, recipe);
    if (count && !*body) {
        st = tli_book_mesh(ctx, p->book, met, count, p->channels, p->channel_count, p->time, recipe,
                           body);
        if (!st) keep_body(p, *body);
    }
    tl_mem_free(ctx, met);
    return st;
}

static bool holds(const void *what, const double sphere[4])
{
    double from[3];
    const double reach = sphere[3] * (1 + MARGIN);
    vec_sub(what, sphere, from);
    return vec_dot(from, from) <= reach * reach;
}

static bool is_passed(const void *what, const double sphere[4])
{
    double from[3], across[3];
    const tli_sight *sight = what;
    const double reach = sphere[3] * (1 + MARGIN);
    vec_sub(sphere, sight->origin, from);
    vec_cross(from, sight->direction, across);
    return vec_dot(across, across) <= reach * reach * vec_dot(sight->direction, sight->direction) &&
           vec_dot(from, sight->direction) >= sight->least - reach;
}

tl_status tli_places_around(tl_ctx *ctx, tli_places *places, const double x[3], tli_body **body)
{
    return take_body(ctx, places, holds, x, body);
}

tl_status tli_places_along(tl_ctx *ctx, tli_places *places, const tli_sight *sight, tli_body **body)
{
    return take_body(ctx, places, is_passed, sight, body);
}

/* ---- names ---- */

static const tl_store_channel *channel_of(const tli_places *places, size_t channel)
{
    return &tl_store_get_head(places->book->store)->channels[places->channels[channel]];
}

const char *tli_places_channel(const tli_places *places, size_t channel)
{
    return channel_of(places, channel)->name;
}

tl_status tli_places_name(tl_ctx *ctx, const tli_places *places, tl_probe *probe)
{
    tl_status st = TL_OK;
    if (!probe->values) {
        probe->values = tl_mem_zalloc(ctx, places->channel_count, sizeof *probe->values, &st);
        probe->value_count = st ? 0 : places->channel_count;
    }
    for (size_t c = 0; c < probe->value_count; c++) {
        probe->values[c].name = channel_of(places, c)->name;
        probe->values[c].unit = channel_of(places, c)->unit;
        probe->values[c].components = channel_of(places, c)->components;
    }
    return st;
}
