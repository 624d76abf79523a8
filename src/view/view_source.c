/* Sources: a model, of which no more than its head is read, or a mesh; coarse looks at models. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "cut/cut_mesh.h"
#include "view/view.h"

/* Tets of a look; of all glances together that a survey of a series has. */
static const uint64_t LOOK_TETS = 100000;
/* What a tet of a look takes, with its share of all that is kept of it, bytes; and the part of the
 * budget that a look may take. */
static const double LOOK_TET_BYTES = 130, LOOK_SHARE = 0.25;

/* ---- facts ---- */

bool tli_in_step(const tl_store_channel *channel, int64_t step)
{
    return !channel->has_step || (int64_t)channel->step == step;
}

/* The first place of a channel's name among those on the same kind of element. */
static uint32_t first_of_name(const tl_store_head *head, uint32_t c)
{
    uint32_t i = 0;
    while (strcmp(head->channels[i].name, head->channels[c].name) != 0 ||
           head->channels[i].on != head->channels[c].on)
        i++;
    return i;
}

static void add_step(const tl_store_channel *channel, tl_source_step *steps, size_t *count)
{
    size_t at = *count;
    for (size_t i = 0; i < *count; i++)
        if (steps[i].number == channel->step) return;
    while (at && steps[at - 1].number > channel->step) at--;
    memmove(steps + at + 1, steps + at, (*count - at) * sizeof *steps);
    steps[at] = (tl_source_step){.number = channel->step, .time = channel->time};
    ++*count;
}

static tl_status set_model_facts(tl_ctx *ctx, tl_source *source)
{
    tl_status st = TL_OK;
    const tl_store_head *head = tl_store_get_head(source->store);
    tl_source_facts *facts = &source->facts;
    tl_source_channel *channels = tl_mem_zalloc(ctx, head->channel_count, sizeof *channels, &st);
    facts->channels = channels;
    tl_source_step *steps = tl_mem_zalloc(ctx, head->channel_count, sizeof *steps, &st);
    facts->steps = steps;
    uint32_t *places = tl_mem_alloc(ctx, head->channel_count, sizeof *places, &st);
    for (uint32_t c = 0; !st && c < head->channel_count; c++) {
        const tl_store_channel *own = &head->channels[c];
        const uint32_t first = first_of_name(head, c);
        if (own->has_step) add_step(own, steps, &facts->step_count);
        if (first == c) {
            places[c] = (uint32_t)facts->channel_count;
            channels[facts->channel_count++] = (tl_source_channel){
                own->name,    own->unit, own->components, own->on, {own->range[0], own->range[1]},
                own->has_step};
        }
        double *range = channels[places[first]].range;
        range[0] = fmin(range[0], own->range[0]);
        range[1] = fmax(range[1], own->range[1]);
    }
    tl_mem_free(ctx, places);
    facts->is_model = true;
    facts->tets = head->input_tets;
    facts->verts = head->input_verts;
    memcpy(facts->bounds, head->stats.bounds, sizeof facts->bounds);
    facts->diagonal = head->stats.diagonal;
    facts->file_bytes = head->file_bytes;
    return st;
}

tl_status tli_set_mesh_facts(tl_ctx *ctx, tl_source *source, const tli_body *body)
{
    tl_status st = TL_OK;
    const tl_mesh *mesh = body->mesh;
    tl_source_facts *facts = &source->facts;
    tl_source_channel *channels =
        tl_mem_zalloc(ctx, tl_mesh_channel_count(mesh), sizeof *channels, &st);
    facts->channels = channels;
    for (size_t c = 0; !st && c < tl_mesh_channel_count(mesh); c++) {
        const tl_channel *own = tl_mesh_channel(mesh, c);
        channels[c] = (tl_source_channel){.name = tli_strdup(ctx, own->name, &st),
                                          .unit = tli_strdup(ctx, own->unit, &st),
                                          .components = own->components,
                                          .on = own->on,
                                          .has_steps = source->series.count > 1};
        facts->channel_count++;
        tl_channel_range(
            own, own->on == TL_ON_VERTEX ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh),
            channels[c].range, NULL);
    }
    facts->tets = tl_mesh_tet_count(mesh);
    facts->verts = tl_mesh_vert_count(mesh);
    memcpy(facts->bounds, body->bounds, sizeof facts->bounds);
    facts->diagonal = body->diagonal;
    return st;
}

/* ---- life ---- */

tli_book *tli_book_use(tli_book *book)
{
    atomic_fetch_add(&book->uses, 1);
    return book;
}

void tli_book_release(tli_book *book)
{
    if (!book || atomic_fetch_sub(&book->uses, 1) > 1) return;
    tl_store_close(book->store);
    tl_mem_free(book->ctx, book);
}

static tl_status open_book(tl_ctx *ctx, const char *path, tli_book **book)
{
    tl_status st = TL_OK;
    tli_book *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (!st) st = tl_store_open(ctx, path, &made->store);
    if (st) {
        tl_mem_free(ctx, made);
        return st;
    }
    made->ctx = ctx;
    atomic_init(&made->uses, 1);
    *book = made;
    return TL_OK;
}

tl_status tli_source_make(tl_ctx *ctx, const char *name, tl_source **source)
{
    tl_status st = TL_OK;
    *source = tl_mem_zalloc(ctx, 1, sizeof **source, &st);
    if (st) return st;
    (*source)->ctx = ctx;
    st = tli_lock_create(ctx, &(*source)->lock);
    if (!st) {
        st = tli_bell_create(ctx, &(*source)->made);
        if (st) tli_lock_destroy(&(*source)->lock);
    }
    if (st) {
        tl_mem_free(ctx, *source);
        *source = NULL;
        return st;
    }
    (*source)->facts.name = (*source)->name = tli_strdup(ctx, name, &st);
    return st;
}

/* Ends a source that was not made whole. */
static tl_status fail(tl_source **source, tl_status status)
{
    tl_source_destroy(*source);
    *source = NULL;
    return status;
}

tl_status tl_source_open(tl_ctx *ctx, const char *path, tl_source **source)
{
    tl_status st = tli_source_make(ctx, path, source);
    if (!st) st = open_book(ctx, path, &(*source)->book);
    if (!st) {
        (*source)->store = (*source)->book->store;
        st = set_model_facts(ctx, *source);
    }
    if (!st)
        (*source)->looks =
            tl_mem_zalloc(ctx, 2 * (*source)->facts.step_count + 1, sizeof *(*source)->looks, &st);
    return st ? fail(source, st) : TL_OK;
}

tl_status tl_source_create(tl_ctx *ctx, tl_mesh *mesh, const char *name, tl_source **source)
{
    *source = NULL;
    if (!tl_mesh_tet_count(mesh))
        return tl_fail(ctx, TL_ERR_DATA, "'%s': there are no tets in it", name);
    tl_status st = tli_source_make(ctx, name, source);
    if (!st) st = tli_body_create(ctx, mesh, 1, &(*source)->body);
    if (!st) {
        st = tli_set_mesh_facts(ctx, *source, (*source)->body);
        (*source)->looks = tl_mem_zalloc(ctx, 1, sizeof *(*source)->looks, &st);
        if (st) (*source)->body->mesh = NULL; /* stays the caller's */
    }
    return st ? fail(source, st) : TL_OK;
}

tl_status tl_source_set_step(tl_ctx *ctx, tl_source *source, uint32_t number)
{
    tl_status st = TL_OK;
    if (source->store) return tl_fail(ctx, TL_ERR_ARG, "'%s' is a model, not a step", source->name);
    if (!source->body) return tl_fail(ctx, TL_ERR_ARG, "'%s' has steps of its own", source->name);
    tl_source_step *steps = tl_mem_alloc(source->ctx, 1, sizeof *steps, &st);
    if (st) return st;
    *steps = (tl_source_step){.number = number, .time = tl_mesh_time(source->body->mesh)};
    tli_free_const(source->ctx, source->facts.steps);
    source->facts.steps = steps;
    source->facts.step_count = 1;
    return TL_OK;
}

/* Those of a model are the store's. */
static void free_names(tl_ctx *ctx, const tl_source *source)
{
    for (size_t c = 0; c < source->facts.channel_count; c++) {
        tli_free_const(ctx, source->facts.channels[c].name);
        tli_free_const(ctx, source->facts.channels[c].unit);
    }
}

void tl_source_destroy(tl_source *source)
{
    if (!source) return;
    tl_ctx *ctx = source->ctx;
    for (size_t i = 0; i < source->look_count; i++) tli_body_release(source->looks[i].body);
    tl_mem_free(ctx, source->looks);
    tli_body_release(source->body);
    if (!source->store) free_names(ctx, source);
    tl_series_release(ctx, &source->series);
    tli_book_release(source->book);
    tli_free_const(ctx, source->facts.steps);
    tli_free_const(ctx, source->facts.channels);
    tl_mem_free(ctx, source->name);
    tli_bell_destroy(&source->made);
    tli_lock_destroy(&source->lock);
    tl_mem_free(ctx, source);
}

const tl_source_facts *tl_source_get_facts(const tl_source *source)
{
    return &source->facts;
}

uint64_t tl_source_bytes_read(const tl_source *source)
{
    return source->store ? tl_store_bytes_read(source->store) : 0;
}

tl_store *tl_source_store(const tl_source *source)
{
    return source->store;
}

/* ---- steps and channels ---- */

tl_status tli_source_step(tl_ctx *ctx, const tl_source *source, int64_t wanted, int64_t *step,
                          double *time)
{
    char list[1024] = "";
    size_t at = 0;
    const tl_source_facts *facts = &source->facts;
    *step = -1;
    *time = source->store  ? tl_store_get_head(source->store)->time
            : source->body ? tl_mesh_time(source->body->mesh)
                           : (double)NAN;
    if (wanted < 0 && facts->step_count) wanted = facts->steps[facts->own_step].number;
    for (size_t i = 0; i < facts->step_count; i++) {
        if (facts->steps[i].number != (uint64_t)wanted) continue;
        *step = facts->steps[i].number;
        *time = facts->steps[i].time;
        return TL_OK;
    }
    if (wanted < 0) return TL_OK;
    if (!facts->step_count)
        return tl_fail(ctx, TL_ERR_ARG, "step %lld: '%s' has no time steps", (long long)wanted,
                       facts->name);
    for (size_t i = 0; i < facts->step_count && at < sizeof list; i++) {
        const int n = snprintf(list + at, sizeof list - at, " %u", facts->steps[i].number);
        at += n > 0 ? (size_t)n : 0;
    }
    tl_fail(ctx, TL_ERR_ARG, "step %lld: '%s' has no such step", (long long)wanted, facts->name);
    return tl_note(ctx, TL_ERR_ARG, "steps:%s", list);
}

tl_status tli_scene_step(tl_ctx *ctx, const tl_source *source, const tl_scene *scene, int64_t *step,
                         double *time)
{
    const double wanted = tl_scene_real(scene, TL_NODE_DATA + 1, "step");
    return tli_source_step(ctx, source, (int64_t)wanted, step, time);
}

uint32_t tli_source_channel(const tl_source *source, int64_t step, const char *name)
{
    const tl_store_head *head = source->store ? tl_store_get_head(source->store) : NULL;
    for (uint32_t c = 0; head && c < head->channel_count; c++)
        if (head->channels[c].on == TL_ON_VERTEX && tli_in_step(&head->channels[c], step) &&
            strcmp(head->channels[c].name, name) == 0)
            return c;
    return TL_NONE;
}

/* ---- meshes ---- */

static int by_number(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* What is promised of the channels [channel_count] in a patch: by the segment that made it, or, of
 * those that no segment made, by the finest level. */
static tl_status set_errors(tl_ctx *ctx, const tl_store *store, const tl_patch_info *patch,
                            const size_t *channels, size_t channel_count, double *errors)
{
    tl_segment_info segment;
    const double *all = tl_store_get_head(store)->levels[0].max_error;
    tl_status st = TL_OK;
    if (patch->producer != TL_NONE) {
        st = tl_store_segment(ctx, store, patch->producer, &segment);
        if (!st) all = segment.max_error;
    }
    for (size_t c = 0; !st && c < channel_count; c++) errors[c] = all[channels[c]];
    return st;
}

tl_status tli_cut_list(tl_ctx *ctx, const tl_cut *cut, uint32_t **numbers, size_t *count)
{
    tl_status st = TL_OK;
    const uint32_t *drawn = tl_cut_patches(cut, count);
    *numbers = tl_mem_alloc(ctx, *count, sizeof **numbers, &st);
    if (st || !*count) return st;
    memcpy(*numbers, drawn, *count * sizeof **numbers);
    qsort(*numbers, *count, sizeof **numbers, by_number);
    return TL_OK;
}

/* A mesh of patches has them one after another, by number. */
static tl_status set_runs(tl_ctx *ctx, const tl_store *store, const uint32_t *patches, size_t count,
                          const size_t *channels, size_t channel_count, tli_body *body)
{
    tl_status st = TL_OK;
    body->runs = tl_mem_alloc(ctx, count, sizeof *body->runs, &st);
    body->run_errors = tl_mem_alloc(ctx, count, channel_count * sizeof *body->run_errors, &st);
    body->error_count = channel_count;
    for (size_t i = 0; !st && i < count; i++) {
        tl_patch_info info;
        st = tl_store_patch(ctx, store, patches[i], &info);
        if (st) break;
        body->runs[i] = (tli_run){patches[i], info.tet_count, info.level};
        st = set_errors(ctx, store, &info, channels, channel_count,
                        body->run_errors + i * channel_count);
    }
    body->run_count = st ? 0 : count;
    return st;
}

tl_status tli_book_mesh(tl_ctx *ctx, const tli_book *book, const uint32_t *patches,
                        size_t patch_count, const size_t *channels, size_t channel_count,
                        double time, tli_recipe recipe, tli_body **body)
{
    tl_mesh *mesh = NULL;
    *body = NULL;
    tl_status st =
        tli_patches_mesh(ctx, book->store, patches, patch_count, channels, channel_count, &mesh);
    if (st) return st;
    tl_mesh_set_time(mesh, time);
    st = tli_body_create(ctx, mesh, recipe, body);
    if (st) {
        tl_mesh_destroy(mesh);
        return st;
    }
    st = set_runs(ctx, book->store, patches, patch_count, channels, channel_count, *body);
    if (st) {
        tli_body_release(*body);
        *body = NULL;
    }
    return st;
}

tl_status tli_source_mesh(tl_ctx *ctx, const tl_source *source, const tl_cut *cut,
                          const size_t *channels, size_t channel_count, double time,
                          tli_recipe recipe, tli_body **body)
{
    size_t count;
    uint32_t *patches = NULL;
    tl_status st = tli_cut_list(ctx, cut, &patches, &count);
    *body = NULL;
    if (!st)
        st = tli_book_mesh(ctx, source->book, patches, count, channels, channel_count, time, recipe,
                           body);
    tl_mem_free(ctx, patches);
    return st;
}

/* Tets of a look under the budget. */
static uint64_t look_tets(const tl_ctx *ctx)
{
    const double room = LOOK_SHARE * (double)tli_ctx_room(ctx) / LOOK_TET_BYTES;
    return room < (double)LOOK_TETS ? (uint64_t)room : LOOK_TETS;
}

/* The mesh of a coarse cut. */
static tl_status make_coarse(tl_ctx *ctx, const tl_source *source, int64_t step, bool is_glance,
                             tli_body **body)
{
    tl_status st = TL_OK;
    tl_cut *cut = NULL;
    const tl_store_head *head = tl_store_get_head(source->store);
    size_t *channels = tl_mem_alloc(ctx, head->channel_count, sizeof *channels, &st);
    size_t count = 0;
    tl_cut_query query = tl_cut_query_defaults();
    query.tets_max = is_glance ? look_tets(ctx) / TLI_SURVEY_STEPS : look_tets(ctx);
    for (uint32_t c = 0; !st && c < head->channel_count; c++)
        if (tli_in_step(&head->channels[c], step)) channels[count++] = c;
    if (!st) st = tl_cut_create(ctx, source->store, &cut);
    if (!st) st = tl_cut_update(cut, &query);
    if (!st)
        st = tli_source_mesh(ctx, source, cut, channels, count, head->time,
                             tli_recipe_count(is_glance ? 5 : 2, (uint64_t)step), body);
    tl_cut_destroy(cut);
    tl_mem_free(ctx, channels);
    return st;
}

static tl_status make_look(tl_ctx *ctx, const tl_source *source, int64_t step, bool is_glance,
                           tli_body **body)
{
    tl_status st = source->store ? make_coarse(ctx, source, step, is_glance, body)
                                 : tli_body_borrow(ctx, source->body, source->body->recipe, body);
    if (!st) st = tli_body_spots(ctx, *body, is_glance ? TLI_SPOTS / TLI_SURVEY_STEPS : TLI_SPOTS);
    if (st) {
        tli_body_release(*body);
        *body = NULL;
    }
    return st;
}

/* The look of a step, which has a place whether it was made or not; under the lock. */
static tli_look *look_of(tl_source *source, int64_t step, bool is_glance)
{
    for (size_t i = 0; i < source->look_count; i++)
        if (source->looks[i].step == step && source->looks[i].is_glance == is_glance)
            return &source->looks[i];
    TL_ASSERT(source->look_count < 2 * source->facts.step_count + 1);
    source->looks[source->look_count] = (tli_look){.step = step, .is_glance = is_glance};
    return &source->looks[source->look_count++];
}

/* Made by the first who asks, outside of the lock, since that reads the file, reports progress and
 * can be cancelled; others wait for it, and one of them makes it where it failed. */
static tl_status shared_look(tl_ctx *ctx, tl_source *source, int64_t step, bool is_glance,
                             tli_body **body)
{
    tl_status st = TL_OK;
    tli_lock_take(&source->lock);
    tli_look *look = look_of(source, step, is_glance);
    while (look->is_making) tli_bell_wait(&source->made, &source->lock);
    if (!look->body) {
        look->is_making = true;
        tli_lock_give(&source->lock);
        tli_body *made = NULL;
        st = make_look(ctx, source, step, is_glance, &made);
        tli_lock_take(&source->lock);
        look->body = made;
        look->is_making = false;
        tli_bell_ring(&source->made);
    }
    if (!st) *body = tli_body_use(look->body);
    tli_lock_give(&source->lock);
    return st;
}

tl_status tli_source_look(tl_ctx *ctx, tl_source *source, int64_t step, tli_body **body)
{
    tli_body *shared = NULL;
    tl_status st = source->store || source->body
                       ? shared_look(ctx, source, source->body ? -1 : step, false, &shared)
                       : tli_steps_find(ctx, source, step, &shared);
    *body = NULL;
    /* views on other threads have it, too: what each computes of it is its own */
    if (!st) st = tli_body_borrow(ctx, shared, shared->recipe, body);
    tli_body_release(shared);
    return st;
}

tl_status tli_source_glance(tl_ctx *ctx, tl_source *source, int64_t step, tli_body **body)
{
    tli_body *shared = NULL;
    tl_status st = shared_look(ctx, source, step, true, &shared);
    *body = NULL;
    if (!st) st = tli_body_borrow(ctx, shared, shared->recipe, body);
    tli_body_release(shared);
    return st;
}
