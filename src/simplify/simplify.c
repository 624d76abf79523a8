/* The driver of a simplification: options, working mesh, order, result, errors. */
#include "tetralod/simplify.h"

#include <math.h>
#include <string.h>

#include "base/base_predicates.h"
#include "measure/measure.h"
#include "simplify/simplify_carry.h"
#include "simplify/simplify_order.h"
#include "simplify/simplify_pack.h"

/* A bound is tested before each collapse, and measured in the result. Where the mesh lies on itself
 * a vertex may be found at another place than the one it was carried to: vertices whose bound
 * breaks are locked and all is done again; the last try locks all. */
enum { TRIES_MAX = 6 };
/* What the tests leave to the rounding of the measure, relative to the bound. */
static const double SLACK = 1e-9;
/* Vectors whose lengths differ by less than this part of the widest range of a component count as
 * equally long. */
static const double EQUAL_LENGTHS = 1e-3;

tl_simplify_opts tl_simplify_opts_defaults(void)
{
    return (tl_simplify_opts){.struct_bytes = sizeof(tl_simplify_opts),
                              .boundary_error = -1,
                              .min_quality = 0.01,
                              .seed = 1};
}

/* Options with every channel named, and what follows from them. */
typedef struct plan {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    tl_simplify_opts opts;
    tl_simplify_channel *channels;
    double *scales, *bounds; /* [opts.channel_count]; bounds in the channels' units */
    bool bounded;
    size_t target;
    uint8_t *locked; /* [vert_count]: opts.locked and those of the tries before; NULL at first */
    tli_held held;   /* collapses of the try at hand, where there is a listener and a bound */
} plan;

static tl_status check_opts(const plan *p)
{
    const tl_simplify_opts *o = &p->opts;
    tl_ctx *ctx = p->ctx;
    if (o->ratio != 0 && !(o->ratio > 0 && o->ratio <= 1))
        return tl_fail(ctx, TL_ERR_ARG, "ratio %g, expected more than 0 and at most 1", o->ratio);
    if (!(o->error >= 0)) return tl_fail(ctx, TL_ERR_ARG, "error %g, expected 0 or more", o->error);
    if (!isfinite(o->boundary_error))
        return tl_fail(ctx, TL_ERR_ARG, "boundary error %g, expected a length", o->boundary_error);
    if (!(o->min_quality >= 0 && o->min_quality < 1))
        return tl_fail(ctx, TL_ERR_ARG, "quality %g, expected 0 or more and below 1",
                       o->min_quality);
    if ((unsigned)o->method > TL_SIMPLIFY_BLOCKS || (unsigned)o->placement > TL_PLACE_SUBSET)
        return tl_fail(ctx, TL_ERR_ARG, "unknown method %d or placement %d", (int)o->method,
                       (int)o->placement);
    if (tl_mesh_tet_count(p->mesh) == 0) return tl_fail(ctx, TL_ERR_DATA, "the mesh has no tets");
    return TL_OK;
}

/* Every channel on vertices, where the caller names none. */
static tl_status name_channels(plan *p)
{
    tl_status st = TL_OK;
    size_t count = tl_mesh_channel_count(p->mesh);
    p->channels = tl_mem_zalloc(p->ctx, p->opts.channels ? p->opts.channel_count : count,
                                sizeof *p->channels, &st);
    if (st) return st;
    if (p->opts.channels) {
        for (size_t i = 0; i < p->opts.channel_count; i++) p->channels[i] = p->opts.channels[i];
    } else {
        p->opts.channel_count = 0;
        for (size_t i = 0; i < count; i++) {
            const tl_channel *c = tl_mesh_channel(p->mesh, i);
            if (c->on == TL_ON_VERTEX)
                p->channels[p->opts.channel_count++] = (tl_simplify_channel){c->name, 1, 0};
        }
    }
    p->opts.channels = p->channels;
    return TL_OK;
}

/* What errors of a channel are fractions of: its range or, where the lengths of vectors are all but
 * equal, the widest range of a component. */
static double channel_width(const tl_channel *c, size_t count)
{
    double range[2], widest = 0;
    tl_channel_range(c, count, range, NULL);
    double width = range[1] - range[0];
    for (uint32_t k = 0; c->components > 1 && k < c->components; k++) {
        double lo = INFINITY, hi = -INFINITY;
        for (size_t v = 0; v < count; v++) {
            double value = c->values[v * c->components + k];
            if (!isfinite(value)) continue;
            lo = fmin(lo, value);
            hi = fmax(hi, value);
        }
        if (hi - lo > widest) widest = hi - lo;
    }
    return width > EQUAL_LENGTHS * widest ? width : widest;
}

/* The channel that a name means; fails where it can't steer. */
static tl_status check_channel(const plan *p, const tl_simplify_channel *s, const tl_channel **c)
{
    *c = s->name ? tl_mesh_channel_by_name(p->mesh, s->name) : NULL;
    if (!*c || (*c)->on != TL_ON_VERTEX)
        return tl_fail(p->ctx, TL_ERR_DATA, "the mesh has no channel '%s' on vertices",
                       s->name ? s->name : "(null)");
    if (!(s->weight > 0) || !isfinite(s->weight) || !(s->error >= 0))
        return tl_fail(p->ctx, TL_ERR_ARG,
                       "channel '%s': weight %g and error %g, expected more than 0 and 0 or more",
                       s->name, s->weight, s->error);
    return TL_OK;
}

/* Scale and bound of each steering channel. */
static tl_status weigh_channels(plan *p)
{
    tl_status st = TL_OK;
    const tl_channel *c;
    double heaviest = 0;
    for (size_t i = 0; i < p->opts.channel_count; i++)
        heaviest = fmax(heaviest, p->channels[i].weight);
    p->scales = tl_mem_alloc(p->ctx, p->opts.channel_count, sizeof *p->scales, &st);
    p->bounds = tl_mem_alloc(p->ctx, p->opts.channel_count, sizeof *p->bounds, &st);
    for (size_t i = 0; !st && i < p->opts.channel_count; i++) {
        const tl_simplify_channel *s = &p->channels[i];
        st = check_channel(p, s, &c);
        if (st) return st;
        double width = channel_width(c, tl_mesh_vert_count(p->mesh));
        double weight = s->weight / heaviest; /* so that the shape counts as much as ever */
        p->scales[i] = width > 0 && isfinite(weight / width) ? weight / width : 0;
        p->bounds[i] = s->error > 0 ? s->error : INFINITY;
        if (p->opts.error > 0) p->bounds[i] = fmin(p->bounds[i], p->opts.error * width);
        if (!(p->scales[i] > 0)) p->bounds[i] = INFINITY; /* a constant can't break a bound */
        p->bounded = p->bounded || isfinite(p->bounds[i]);
        p->held.components += c->components;
    }
    if (!st && p->held.components > TLI_COMPONENTS_MAX)
        st = tl_fail(p->ctx, TL_ERR_UNSUPPORTED,
                     "the channels have %zu components together, at most %u can steer",
                     p->held.components, TLI_COMPONENTS_MAX);
    return st;
}

static tl_status make_plan(tl_ctx *ctx, const tl_mesh *mesh, const tl_simplify_opts *opts, plan *p)
{
    *p = (plan){.ctx = ctx, .mesh = mesh, .opts = *opts};
    tl_status st = check_opts(p);
    if (!st) st = name_channels(p);
    if (!st) st = weigh_channels(p);
    if (st) return st;
    size_t tets = tl_mesh_tet_count(mesh), by_ratio = (size_t)((double)tets * p->opts.ratio);
    p->target = p->opts.target_tets;
    if (p->opts.ratio > 0 && (!p->target || by_ratio < p->target))
        p->target = by_ratio ? by_ratio : 1;
    bool error_given = p->opts.error > 0;
    for (size_t i = 0; i < p->opts.channel_count; i++)
        error_given = error_given || p->channels[i].error > 0;
    if (!p->target && !error_given)
        return tl_fail(ctx, TL_ERR_ARG, "neither a number of tets, a ratio nor an error is given");
    p->held.ctx = ctx;
    if (p->bounded && opts->listener) {
        p->opts.listener = tli_held_add;
        p->opts.listener_user = &p->held;
    }
    return TL_OK;
}

static void drop_plan(plan *p)
{
    tli_held_release(&p->held);
    tl_mem_free(p->ctx, p->locked);
    tl_mem_free(p->ctx, p->bounds);
    tl_mem_free(p->ctx, p->scales);
    tl_mem_free(p->ctx, p->channels);
}

static tl_status run_order(const plan *p, tli_work *w)
{
    switch (p->opts.method) {
    case TL_SIMPLIFY_QUEUE: return tli_order_queue(w, p->target);
    case TL_SIMPLIFY_INDEPENDENT: return tli_order_independent(w, p->target);
    case TL_SIMPLIFY_RANDOMIZED: return tli_order_randomized(w, p->target, p->opts.seed);
    default: return tli_order_blocks(w, p->target);
    }
}

static const char *why_stopped(const plan *p, const tli_work *w)
{
    if (w->tets_live <= p->target) return "target";
    if (w->verdicts[TLI_NO_ERROR] > 0) return "error";
    return w->verdicts[TLI_NO_BOUNDARY] > w->verdicts[TLI_NO_SHAPE] ? "boundary error" : "shape";
}

static void count_signs(const tl_mesh *mesh, tl_simplify_result *r)
{
    const double *xyz = tl_mesh_xyz(mesh);
    const tl_lidx *q = tl_mesh_tets(mesh);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++, q += 4) {
        const double *p[4];
        for (int i = 0; i < 4; i++) p[i] = xyz + 3 * (size_t)q[i];
        bool finite = true;
        for (int i = 0; i < 4; i++) finite = finite && isfinite(p[i][0] + p[i][1] + p[i][2]);
        int sign = finite ? tli_orient3d(p[0], p[1], p[2], p[3]) : 1;
        r->inverted += sign < 0;
        r->degenerate += sign == 0;
    }
}

/* Vertices of the result that keep their values: those that no collapse changed. */
static tl_status list_kept(const plan *p, const tli_work *w, const tl_mesh *out, uint8_t **keep)
{
    tl_status st = TL_OK;
    size_t n = 0;
    *keep = tl_mem_zalloc(p->ctx, tl_mesh_vert_count(out), 1, &st);
    for (size_t v = 0; !st && v < w->vert_count; v++)
        if (w->verts[v].merged == v)
            (*keep)[n++] = w->placement == TL_PLACE_SUBSET || w->verts[v].kind >= TLI_CORNER;
    return st;
}

/* Where the original vertices lie in the result. */
typedef struct places {
    tl_lidx *tets;
    double (*weights)[4];
    double *outside;
} places;

/* A vertex that was not moved is measured at itself: where the mesh touches itself at a place, or a
 * flat tet is there, a search could end at another vertex. hints are tets of the vertex's own star.
 */
static void stay_at_corner(const tli_work *w, const tl_mesh *out, const tl_lidx *hints, places *at)
{
    const tl_lidx *tets = tl_mesh_tets(out);
    tl_lidx count = 0;
    for (size_t v = 0; v < w->vert_count; v++) {
        if (w->verts[v].merged != v) continue;
        tl_lidx number = count++, o = w->verts[v].origin;
        if (w->verts[v].version != 0 && w->placement != TL_PLACE_SUBSET) continue;
        if (at->tets[o] == TL_NONE || hints[o] == TL_NONE) continue;
        at->tets[o] = hints[o];
        at->outside[o] = 0;
        for (size_t j = 0; j < 4; j++) at->weights[o][j] = tets[4 * (size_t)hints[o] + j] == number;
    }
}

static tl_status find_places(const plan *p, const tli_work *w, const tl_mesh *out,
                             const tl_locator *locator, const tl_lidx *hints, places *at)
{
    tl_status st = TL_OK;
    size_t n = tl_mesh_vert_count(p->mesh);
    at->tets = tl_mem_alloc(p->ctx, n, sizeof *at->tets, &st);
    at->weights = tl_mem_alloc(p->ctx, n, sizeof *at->weights, &st);
    at->outside = tl_mem_alloc(p->ctx, n, sizeof *at->outside, &st);
    if (!st)
        st = tli_measure_vertices(p->ctx, p->mesh, out, locator, hints, at->tets, at->weights,
                                  at->outside);
    if (!st) stay_at_corner(w, out, hints, at);
    return st;
}

static void drop_places(const plan *p, places *at)
{
    tl_mem_free(p->ctx, at->outside);
    tl_mem_free(p->ctx, at->weights);
    tl_mem_free(p->ctx, at->tets);
}

/* Errors of all channels on vertices, at every original vertex. */
static tl_status measure(const plan *p, const tl_mesh *out, const places *at, tl_simplify_result *r)
{
    tl_status st = TL_OK;
    size_t n = tl_mesh_vert_count(p->mesh);
    r->outside_vertices = 0;
    for (size_t v = 0; v < n; v++) r->outside_vertices += at->outside[v] > 0;
    r->channel_count = 0;
    for (size_t i = 0; !st && i < tl_mesh_channel_count(p->mesh); i++) {
        const tl_channel *c = tl_mesh_channel(p->mesh, i);
        tl_field_error e = {0};
        if (c->on != TL_ON_VERTEX) continue;
        st = tli_measure_channel(p->ctx, p->mesh, c, out, tl_mesh_channel(out, i), at->tets,
                                 (const double(*)[4])at->weights, NULL, &e);
        tl_simplify_channel_result *to = &r->channels[r->channel_count++];
        *to = (tl_simplify_channel_result){.name = c->name, .max_error = e.max, .rms_error = e.rms};
        tl_channel_range(c, n, to->range, NULL);
    }
    return st;
}

/* Locks the original vertices at which a bound breaks; *held tells whether none does. */
static tl_status lock_broken(plan *p, const tl_mesh *out, const places *at,
                             const tl_simplify_result *r, bool *held)
{
    tl_status st = TL_OK;
    size_t n = tl_mesh_vert_count(p->mesh);
    double *errors = NULL;
    *held = true;
    for (size_t i = 0; !st && p->bounded && i < p->opts.channel_count; i++) {
        const tl_simplify_channel *s = &p->channels[i];
        const tl_channel *c = tl_mesh_channel_by_name(p->mesh, s->name);
        double largest = 0;
        for (size_t j = 0; j < r->channel_count; j++)
            if (r->channels[j].name == c->name) largest = r->channels[j].max_error;
        if (largest <= p->bounds[i]) continue;
        *held = false;
        tl_field_error e;
        if (!errors) errors = tl_mem_alloc(p->ctx, n, sizeof *errors, &st);
        if (!p->locked) {
            p->locked = tl_mem_zalloc(p->ctx, n, 1, &st);
            if (!st && p->opts.locked) memcpy(p->locked, p->opts.locked, n);
        }
        if (!st)
            st = tli_measure_channel(p->ctx, p->mesh, c, out, tl_mesh_channel_by_name(out, s->name),
                                     at->tets, (const double(*)[4])at->weights, errors, &e);
        for (size_t v = 0; !st && v < n; v++) p->locked[v] |= errors[v] > p->bounds[i];
    }
    tl_mem_free(p->ctx, errors);
    return st;
}

/* Channels of the mesh whose values keep a bound as they are: a least-squares fit might break it.
 */
static tl_status list_bounded(const plan *p, uint8_t **bounded)
{
    tl_status st = TL_OK;
    *bounded = tl_mem_zalloc(p->ctx, tl_mesh_channel_count(p->mesh), 1, &st);
    for (size_t i = 0; !st && i < p->opts.channel_count; i++)
        for (size_t j = 0; isfinite(p->bounds[i]) && j < tl_mesh_channel_count(p->mesh); j++) {
            const tl_channel *c = tl_mesh_channel(p->mesh, j);
            if (c == tl_mesh_channel_by_name(p->mesh, p->channels[i].name)) (*bounded)[j] = 1;
        }
    return st;
}

/* The values of tets and of vertices without a bound, then the errors of all. */
static tl_status finish_values(plan *p, const tli_work *w, tl_mesh *out, const tl_lidx *hints,
                               tl_simplify_result *r, bool *held)
{
    places at = {0};
    uint8_t *keep = NULL, *bounded = NULL;
    tl_lidx *opposite = NULL;
    tl_locator *locator = NULL;
    tl_status st = list_kept(p, w, out, &keep);
    if (!st) st = list_bounded(p, &bounded);
    if (!st) st = tl_mesh_adjacency(p->ctx, out, &opposite, NULL);
    if (!st) st = tli_refit(w, p->mesh, out, opposite, hints, keep, bounded);
    double start = tli_clock_s();
    if (!st) st = tl_locator_create(p->ctx, out, opposite, &locator);
    if (!st && tli_has_tet_channels(out)) {
        st = tli_average_tets(p->ctx, p->mesh, out, locator, hints);
        start = tli_clock_s();
    }
    if (!st) st = find_places(p, w, out, locator, hints, &at);
    if (!st) st = measure(p, out, &at, r);
    if (!st) st = lock_broken(p, out, &at, r, held);
    r->measure_seconds += tli_clock_s() - start;
    tl_mem_free(p->ctx, bounded);
    drop_places(p, &at);
    tl_locator_destroy(locator);
    tl_mem_free(p->ctx, opposite);
    tl_mem_free(p->ctx, keep);
    return st;
}

/* Tets on the way to which the mesh may be thinned; SIZE_MAX where each collapse has to be tested
 * or the order of costs is asked for. */
static size_t thin_target(const plan *p)
{
    bool blocks = p->opts.method == TL_SIMPLIFY_AUTO || p->opts.method == TL_SIMPLIFY_BLOCKS;
    return blocks && !p->bounded ? p->target : SIZE_MAX;
}

/* One simplification; *held tells whether the bounds hold in its result. */
static tl_status simplify_once(plan *p, tl_mesh **out, tl_simplify_result *r, bool *held)
{
    tli_work *w = NULL;
    tl_lidx *hints = NULL;
    double start = tli_clock_s(), measured = r->measure_seconds;
    tl_status st = tli_work_create(p->ctx, p->mesh, &p->opts, p->scales, thin_target(p), &w);
    if (!st && p->bounded) {
        double *bounds = tl_mem_alloc(p->ctx, p->opts.channel_count, sizeof *bounds, &st);
        for (size_t i = 0; !st && i < p->opts.channel_count; i++)
            bounds[i] = p->bounds[i] * (1 - SLACK);
        if (!st) st = tli_carry_create(w, p->mesh, &p->opts, p->scales, bounds);
        tl_mem_free(p->ctx, bounds);
    }
    if (!st) st = run_order(p, w);
    if (!st) st = tli_pack(w, p->mesh, &p->opts, p->scales, out, &hints);
    if (!st) tli_work_drop_tets(w);
    if (!st) st = finish_values(p, w, *out, hints, r, held);
    if (!st) {
        r->boundary_error = tli_work_surface_bound(w);
        r->target_reached = w->tets_live <= p->target;
        r->stopped_by = why_stopped(p, w);
    }
    tl_mem_free(p->ctx, hints);
    tli_work_destroy(w);
    r->seconds += tli_clock_s() - start - (r->measure_seconds - measured);
    return st;
}

tl_status tl_mesh_simplify(tl_ctx *ctx, const tl_mesh *mesh, const tl_simplify_opts *opts,
                           tl_mesh **out, tl_simplify_result *result)
{
    tl_simplify_result r = {0};
    plan p;
    *out = NULL;
    *result = r;
    if (!opts) return tl_fail(ctx, TL_ERR_ARG, "simplification needs options with a target");
    tl_ctx_reset_peak(ctx);
    tl_status st = make_plan(ctx, mesh, opts, &p);
    if (!st) r.channels = tl_mem_zalloc(ctx, tl_mesh_channel_count(mesh), sizeof *r.channels, &st);
    for (int i = 1; !st; i++) {
        bool held = true;
        p.held.count = 0;
        st = simplify_once(&p, out, &r, &held);
        if (st || held) break;
        if (i > TRIES_MAX) /* everything was locked, so everything was measured at itself */
            st = tl_fail(ctx, TL_ERR_DATA, "the error bound can't be held");
        if (i >= TRIES_MAX) memset(p.locked, 1, tl_mesh_vert_count(mesh));
        p.opts.locked = p.locked;
        tl_mesh_destroy(*out);
        *out = NULL;
    }
    if (!st) st = tli_held_tell(&p.held, opts->listener, opts->listener_user);
    if (!st) {
        r.tets_in = tl_mesh_tet_count(mesh);
        r.vertices_in = tl_mesh_vert_count(mesh);
        r.tets_out = tl_mesh_tet_count(*out);
        r.vertices_out = tl_mesh_vert_count(*out);
        count_signs(*out, &r);
        r.peak_bytes = tl_ctx_peak_bytes(ctx);
    }
    drop_plan(&p);
    if (st) {
        tl_simplify_release(ctx, &r);
        tl_mesh_destroy(*out);
        *out = NULL;
        return tl_note(ctx, st, "while simplifying %zu tets", tl_mesh_tet_count(mesh));
    }
    *result = r;
    return TL_OK;
}

void tl_simplify_release(tl_ctx *ctx, tl_simplify_result *result)
{
    if (!result) return;
    tl_mem_free(ctx, result->channels);
    *result = (tl_simplify_result){0};
}
