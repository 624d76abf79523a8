/* Sources whose steps are files, or lie in one that is no model: a step is read when it is asked
 * for, and the last ones are kept as long as there is room for another one. */
#include <math.h>

#include "view/view.h"

/* Memory that reading and showing a step takes, by that of what is kept of it. */
static const size_t ROOM = 6;

/* ---- what is kept ---- */

/* The one at place becomes that which goes last. */
static void touch(tl_source *source, size_t place)
{
    const tli_look look = source->looks[place];
    memmove(source->looks + place, source->looks + place + 1,
            (source->look_count - place - 1) * sizeof *source->looks);
    source->looks[source->look_count - 1] = look;
}

/* Lets the oldest step go that nobody else uses; false: there is none. */
static bool drop_oldest(tl_source *source)
{
    for (size_t i = 0; i < source->look_count; i++) {
        if (atomic_load(&source->looks[i].body->uses) > 1) continue;
        tli_body_release(source->looks[i].body);
        source->look_count--;
        memmove(source->looks + i, source->looks + i + 1,
                (source->look_count - i) * sizeof *source->looks);
        return true;
    }
    return false;
}

bool tl_source_trim(tl_source *source)
{
    bool any = false;
    if (!source->series.count) return false;
    tli_lock_take(&source->lock);
    while (drop_oldest(source)) any = true;
    tli_lock_give(&source->lock);
    return any;
}

static size_t bytes_of(const tli_body *body)
{
    const tl_mesh *mesh = body->mesh;
    const size_t verts = tl_mesh_vert_count(mesh), tets = tl_mesh_tet_count(mesh);
    size_t bytes = verts * 3 * sizeof(double) + tets * 4 * sizeof(tl_lidx);
    for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
        const tl_channel *channel = tl_mesh_channel(mesh, c);
        bytes += (channel->on == TL_ON_VERTEX ? verts : tets) * channel->components *
                 sizeof *channel->values;
    }
    return bytes + body->spot_count * sizeof *body->spots;
}

/* ---- reading ---- */

static tl_status read_mesh(tl_ctx *ctx, const tl_source *source, const tl_step *step,
                           tl_mesh **mesh)
{
    tl_read_opts opts = source->read;
    opts.step = step->step;
    opts.has_time = false;
    tl_read_report report;
    tl_status st = tl_mesh_read(ctx, step->path, &opts, mesh, &report);
    if (!st && !tl_mesh_tet_count(*mesh)) {
        st = tl_fail(ctx, TL_ERR_DATA, "'%s' holds no volume cells, which are what is shown",
                     step->path);
        tl_note(ctx, st,
                "%llu points, %llu surface, line and point cells, %llu blank and ghost cells",
                (unsigned long long)report.points, (unsigned long long)report.surface_cells,
                (unsigned long long)(report.blank_cells + report.ghost_cells));
        tl_mesh_destroy(*mesh);
        *mesh = NULL;
    }
    return st;
}

static bool make_room(tl_source *source)
{
    tli_lock_take(&source->lock);
    const bool any = drop_oldest(source);
    tli_lock_give(&source->lock);
    return any;
}

/* What is kept makes room: before, as far as is known, and where that was not enough. */
static tl_status read_step(tl_ctx *ctx, tl_source *source, size_t place, tli_body **body)
{
    tl_mesh *mesh = NULL;
    const tl_step *step = &source->series.steps[place];
    while (tli_ctx_room(ctx) / ROOM < source->step_bytes && make_room(source)) continue;
    tl_status st = read_mesh(ctx, source, step, &mesh);
    while ((st == TL_ERR_BUDGET || st == TL_ERR_MEMORY) && make_room(source)) {
        tl_ctx_clear(ctx);
        st = read_mesh(ctx, source, step, &mesh);
    }
    if (st) return st;
    if (isfinite(source->series.times[place])) tl_mesh_set_time(mesh, source->series.times[place]);
    st = tli_body_create(ctx, mesh, tli_recipe_count(1, place), body);
    if (st) {
        tl_mesh_destroy(mesh);
        return st;
    }
    st = tli_body_spots(ctx, *body, TLI_SPOTS);
    source->step_bytes = bytes_of(*body);
    if (st) {
        tli_body_release(*body);
        *body = NULL;
    }
    return st;
}

/* Under the lock: the one that is kept; NULL. */
static tli_body *find_kept(tl_source *source, int64_t number)
{
    for (size_t i = 0; i < source->look_count; i++) {
        if (source->looks[i].step != number) continue;
        touch(source, i);
        return tli_body_use(source->looks[source->look_count - 1].body);
    }
    return NULL;
}

/* Read outside of the lock, one step at a time. */
tl_status tli_steps_find(tl_ctx *ctx, tl_source *source, int64_t number, tli_body **body)
{
    tl_status st = TL_OK;
    const tl_series *series = &source->series;
    size_t place = series->own;
    for (size_t i = 0; i < series->count; i++)
        if (series->steps[i].number == (uint64_t)number) place = i;
    tli_lock_take(&source->lock);
    while (source->is_reading) tli_bell_wait(&source->made, &source->lock);
    *body = find_kept(source, number);
    if (!*body) {
        source->is_reading = true;
        tli_lock_give(&source->lock);
        st = read_step(ctx, source, place, body);
        tli_lock_take(&source->lock);
        if (!st)
            source->looks[source->look_count++] =
                (tli_look){.step = number, .body = tli_body_use(*body)};
        source->is_reading = false;
        tli_bell_ring(&source->made);
    }
    tli_lock_give(&source->lock);
    return st;
}

/* ---- the source ---- */

static tl_status set_steps(tl_ctx *ctx, tl_source *source)
{
    tl_status st = TL_OK;
    const tl_series *series = &source->series;
    tl_source_facts *facts = &source->facts;
    tl_source_step *steps = tl_mem_alloc(ctx, series->count, sizeof *steps, &st);
    source->looks = tl_mem_alloc(ctx, series->count, sizeof *source->looks, &st);
    facts->steps = steps;
    if (st) return st;
    for (size_t i = 0; i < series->count; i++)
        steps[i] = (tl_source_step){.number = series->steps[i].number,
                                    .time = series->times[i],
                                    .file = series->is_files ? series->steps[i].path : NULL};
    facts->step_count = series->count;
    facts->own_step = series->own;
    return TL_OK;
}

static tl_status read_first(tl_ctx *ctx, tl_source *source, int64_t wanted)
{
    int64_t step;
    double time;
    tli_body *body = NULL;
    tl_status st = tli_source_step(ctx, source, wanted, &step, &time);
    if (!st) st = tli_source_look(ctx, source, step, &body);
    if (!st) st = tli_set_mesh_facts(ctx, source, body);
    tli_body_release(body);
    return st;
}

/* A file without steps. */
static tl_status read_only(tl_ctx *ctx, tl_source *source, int64_t wanted)
{
    tl_mesh *mesh = NULL;
    double time;
    tl_status st = wanted > 0 ? tli_source_step(ctx, source, wanted, &wanted, &time) : TL_OK;
    if (!st) st = read_mesh(ctx, source, &source->series.steps[0], &mesh);
    source->looks = tl_mem_zalloc(ctx, 1, sizeof *source->looks, &st);
    if (!st) st = tli_body_create(ctx, mesh, 1, &source->body);
    if (st) {
        tl_mesh_destroy(mesh);
        return st;
    }
    return tli_set_mesh_facts(ctx, source, source->body);
}

tl_status tl_source_read(tl_ctx *ctx, const char *path, const tl_read_opts *read, int64_t step,
                         tl_source **source)
{
    tl_read_opts own = tl_read_opts_defaults();
    *source = NULL;
    tl_status st = tli_opts_take(ctx, "tl_read_opts", read, &own, sizeof own);
    if (!st) st = tli_source_make(ctx, path, source);
    if (st) return st;
    (*source)->read = own;
    st = tl_series_find(ctx, path, &own, &(*source)->series);
    if (!st && (*source)->series.count > 1) {
        st = set_steps(ctx, *source);
        if (!st) st = read_first(ctx, *source, step);
    } else if (!st) {
        st = read_only(ctx, *source, step);
        if (!st && step == 0) st = tl_source_set_step(ctx, *source, 0);
    }
    if (st) {
        tl_source_destroy(*source);
        *source = NULL;
    }
    return st;
}
