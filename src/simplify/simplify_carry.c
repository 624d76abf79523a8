/* Carries original vertices through collapses (DESIGN, the promise). A vertex outside of the
 * changed tets, where the boundary moved in, is measured at the nearest of them. */
#include "simplify/simplify_carry.h"

/* A vertex counts as inside down to this barycentric weight. */
static const double INSIDE = -1e-12;

typedef struct carried_channel {
    const double *values; /* of the input mesh */
    uint32_t components;
    double scale, bound; /* bound in scaled units */
} carried_channel;

struct tli_carry {
    const double *xyz; /* of the input mesh */
    carried_channel *channels;
    size_t channel_count;
    tl_lidx *first; /* [tet_count] first vertex of a tet's list */
    tl_lidx *next;  /* [vert_count] the one after it */
};

/* What the hood keeps between test and commit. */
struct tli_carried {
    tl_lidx *verts;
    uint32_t *tets; /* place in sides[0], then sides[1] */
    size_t count, capacity;
    double (*frames)[9]; /* of the new tets: rows that give the weights of their three corners */
};

tl_status tli_carry_create(tli_work *w, const tl_mesh *mesh, const tl_simplify_opts *opts,
                           const double *channel_scales, const double *bounds)
{
    tl_status st = TL_OK;
    tli_carry *c = tl_mem_zalloc(w->ctx, 1, sizeof *c, &st);
    if (st) return st;
    w->carry = c;
    c->xyz = tl_mesh_xyz(mesh);
    c->channel_count = opts->channel_count;
    c->channels = tl_mem_alloc(w->ctx, c->channel_count, sizeof *c->channels, &st);
    c->first = tl_mem_alloc(w->ctx, w->tet_count, sizeof *c->first, &st);
    c->next = tl_mem_alloc(w->ctx, w->vert_count, sizeof *c->next, &st);
    if (st) return st;
    for (size_t i = 0; i < c->channel_count; i++) {
        const tl_channel *from = tl_mesh_channel_by_name(mesh, opts->channels[i].name);
        double scale = channel_scales[i]; /* 0 for a constant, which has no bound to break */
        c->channels[i] = (carried_channel){from->values, from->components, scale,
                                           scale > 0 ? bounds[i] * scale : INFINITY};
    }
    memset(c->first, 0xff, w->tet_count * sizeof *c->first);
    for (size_t v = 0; v < w->vert_count; v++) {
        c->next[v] = TL_NONE;
        if (w->verts[v].star.count == 0 || w->verts[v].kind == TLI_FROZEN) continue;
        tl_lidx t = w->verts[v].star.tets[0];
        c->next[v] = c->first[t];
        c->first[t] = (tl_lidx)v;
    }
    return TL_OK;
}

void tli_carry_destroy(tl_ctx *ctx, tli_carry *c)
{
    if (!c) return;
    tl_mem_free(ctx, c->next);
    tl_mem_free(ctx, c->first);
    tl_mem_free(ctx, c->channels);
    tl_mem_free(ctx, c);
}

tl_status tli_carried_create(tl_ctx *ctx, tli_carried **carried)
{
    tl_status st = TL_OK;
    *carried = tl_mem_zalloc(ctx, 1, sizeof **carried, &st);
    if (!st) (*carried)->frames = tl_mem_alloc(ctx, TLI_STAR_MAX, sizeof *(*carried)->frames, &st);
    return st;
}

void tli_carried_destroy(tl_ctx *ctx, tli_carried *carried)
{
    if (!carried) return;
    tl_mem_free(ctx, carried->frames);
    tl_mem_free(ctx, carried->tets);
    tl_mem_free(ctx, carried->verts);
    tl_mem_free(ctx, carried);
}

static tl_status collect(const tli_work *w, tli_carried *d, tl_lidx tet)
{
    tl_status st = TL_OK;
    for (tl_lidx v = w->carry->first[tet]; v != TL_NONE; v = w->carry->next[v]) {
        if (d->count == d->capacity) {
            d->capacity = d->capacity ? 2 * d->capacity : 256;
            d->verts = tl_mem_resize(w->ctx, d->verts, d->capacity, sizeof *d->verts, &st);
            d->tets = tl_mem_resize(w->ctx, d->tets, d->capacity, sizeof *d->tets, &st);
            if (st) return st;
        }
        d->verts[d->count++] = v;
    }
    return TL_OK;
}

static const tli_hood_tet *new_tet(const tli_hood *h, uint32_t i)
{
    return i < h->side_counts[0] ? &h->sides[0][i] : &h->sides[1][i - h->side_counts[0]];
}

static void set_frames(tli_hood *h, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const uint16_t *l = new_tet(h, i)->verts;
        double *f = h->carried->frames[i], det = 0;
        for (int r = 0; r < 3; r++) {
            const double *a = h->rel[l[(r + 1) % 3]], *b = h->rel[l[(r + 2) % 3]];
            f[3 * r] = a[1] * b[2] - a[2] * b[1];
            f[3 * r + 1] = a[2] * b[0] - a[0] * b[2];
            f[3 * r + 2] = a[0] * b[1] - a[1] * b[0];
        }
        for (int j = 0; j < 3; j++) det += h->rel[l[0]][j] * f[j];
        for (int j = 0; j < 9; j++) f[j] /= det;
    }
}

/* Weights of x (from the new place) in the tet, of the new vertex first; returns the least. */
static double weigh(const double f[9], const double x[3], double weights[4])
{
    weights[0] = 1;
    for (int r = 0; r < 3; r++) {
        weights[r + 1] = f[3 * r] * x[0] + f[3 * r + 1] * x[1] + f[3 * r + 2] * x[2];
        weights[0] -= weights[r + 1];
    }
    double ab = weights[0] < weights[1] ? weights[0] : weights[1];
    double cd = weights[2] < weights[3] ? weights[2] : weights[3];
    return ab < cd ? ab : cd;
}

/* The new tet that holds x, or the nearest one. */
static uint32_t locate(const tli_hood *h, uint32_t count, const double x[3], double weights[4])
{
    double best = INFINITY, some[4], p[4][3] = {{0}};
    uint32_t found = 0;
    for (uint32_t i = 0; i < count; i++)
        if (weigh(h->carried->frames[i], x, weights) >= INSIDE) return i;
    for (uint32_t i = 0; i < count; i++) {
        const uint16_t *l = new_tet(h, i)->verts;
        for (int j = 0; j < 3; j++) memcpy(p[j + 1], h->rel[l[j]], sizeof p[0]);
        double d = tl_tet_nearest((const double(*)[3])p, x, some);
        if (!(d < best)) continue;
        best = d;
        found = i;
        memcpy(weights, some, sizeof some);
    }
    return found;
}

static bool within_bounds(const tli_work *w, const tli_hood *h, tl_lidx v, uint32_t tet,
                          const double weights[4])
{
    const uint16_t *l = new_tet(h, tet)->verts;
    const double *corner[4] = {h->values};
    size_t first = 0;
    for (int j = 0; j < 3; j++) corner[j + 1] = w->values + h->verts[l[j]] * w->components;
    for (size_t c = 0; c < w->carry->channel_count; c++) {
        const carried_channel *ch = &w->carry->channels[c];
        if (ch->bound == INFINITY) {
            first += ch->components;
            continue;
        }
        const double *want = ch->values + (size_t)w->verts[v].origin * ch->components;
        double sum = 0;
        for (uint32_t k = 0; k < ch->components; k++) {
            double value = 0;
            for (int j = 0; j < 4; j++) value += weights[j] * corner[j][first + k];
            double d = value - want[k] * ch->scale;
            sum += d * d;
        }
        if (!(sum <= ch->bound * ch->bound)) return false;
        first += ch->components;
    }
    return true;
}

tl_status tli_carry_test(tli_work *w, tli_hood *h, bool *fine)
{
    tl_status st = TL_OK;
    tli_carried *d = h->carried;
    uint32_t count = h->side_counts[0] + h->side_counts[1];
    *fine = false;
    d->count = 0;
    for (uint32_t i = 0; !st && i < count; i++) st = collect(w, d, new_tet(h, i)->tet);
    for (uint32_t i = 0; !st && i < h->gone_count; i++) st = collect(w, d, h->gone[i]);
    if (st) return st;
    set_frames(h, count);
    for (size_t i = 0; i < d->count; i++) {
        const double *at = w->carry->xyz + 3 * (size_t)w->verts[d->verts[i]].origin;
        double x[3] = {at[0] - h->place[0], at[1] - h->place[1], at[2] - h->place[2]};
        double weights[4] = {0};
        d->tets[i] = locate(h, count, x, weights);
        if (!within_bounds(w, h, d->verts[i], d->tets[i], weights)) return TL_OK;
    }
    *fine = true;
    return TL_OK;
}

void tli_carry_commit(tli_work *w, tli_hood *h)
{
    tli_carried *d = h->carried;
    uint32_t count = h->side_counts[0] + h->side_counts[1];
    for (uint32_t i = 0; i < count; i++) w->carry->first[new_tet(h, i)->tet] = TL_NONE;
    for (uint32_t i = 0; i < h->gone_count; i++) w->carry->first[h->gone[i]] = TL_NONE;
    for (size_t i = 0; i < d->count; i++) {
        tl_lidx *first = &w->carry->first[new_tet(h, d->tets[i])->tet];
        w->carry->next[d->verts[i]] = *first;
        *first = d->verts[i];
    }
}
