/* The depth order of tets, for renderers that draw them one over the other.
 *
 * Of two tets with a common face the one on the camera's side of it is in front; a tet is drawn as
 * soon as all that lie behind it are (Williams 1992, MPVO: a topological order of the adjacency,
 * taken breadth first so that the result is its own queue). What a gap of a mesh that is not convex
 * parts is related by rays (draw_order_gaps.c). Where tets hide each other in a ring no order is
 * right: the one with the farthest centroid goes first then, and is counted. */
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "draw/draw_order.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192 };
/* Two bits for each face of a tet. */
enum { NOWHERE = 0, IN_FRONT = 1, BEHIND = 2, SIDE_MASK = 3 };
/* A face that is seen from its edge relates nothing: below this, relative to what its determinant
 * would be at right angles, its sign is rounding. */
static const double EDGE_ON = 1e-14;
/* Of a tet that stands in pairs. */
static const uint32_t IN_PAIRS = UINT32_C(1) << 31;

typedef struct work {
    const tli_order_view *view;
    uint8_t *own;     /* where the neighbours of a tet are, of faces it has the lower number of */
    uint8_t *sides;   /* the same of all faces */
    uint8_t *seen;    /* 1: may be seen */
    uint32_t *counts; /* tets behind that are not yet drawn, and IN_PAIRS; DRAWN */
    uint64_t *pairs;
    size_t pair_count;
    uint32_t *tets; /* [queued] what is drawn, and waits to release what it stood behind */
    size_t queued;
} work;

static const uint32_t DRAWN = UINT32_MAX;

/* ---- one tet ---- */

static double spread_of(const double a[3])
{
    return fabs(a[0]) + fabs(a[1]) + fabs(a[2]);
}

/* On which side of a face its neighbour is, as the camera sees it, from the corners turned out. */
static unsigned side_of(const tli_order_view *view, const tli_cell *cell, int face)
{
    double p[3][3];
    for (int i = 0; i < 3; i++) {
        const tli_vert *v = &view->verts[cell->verts[tli_tet_faces[face][i]]];
        p[i][0] = (double)v->x;
        p[i][1] = (double)v->y;
        p[i][2] = (double)v->z;
    }
    for (int k = 0; k < 3; k++) {
        p[1][k] -= p[0][k];
        p[2][k] -= p[0][k];
    }
    if (view->frame->parallel) { /* the camera is infinitely far away */
        p[0][0] = p[0][1] = 0;
        p[0][2] = 1;
    }
    double sign = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                  p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                  p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    double noise = EDGE_ON * spread_of(p[0]) * spread_of(p[1]) * spread_of(p[2]);
    return sign > noise ? IN_FRONT : sign < -noise ? BEHIND : NOWHERE;
}

/* True if the transfer function has any extinction between two values, in its steps. */
static bool has_extinction(const tl_transfer *t, float low, float high)
{
    /* the integrals begin a step before the first; flat tets are seen half a step around */
    double from = fmin(fmax(floor((double)low), 0), TLI_TRANSFER_STEPS);
    double to = fmin(fmax(ceil((double)high) + 2, 0), TLI_TRANSFER_STEPS + 2);
    size_t a = (size_t)from, b = (size_t)to;
    return t->bases[b / TLI_SUM_STEPS][3] != t->bases[a / TLI_SUM_STEPS][3] ||
           t->sums[b + b / TLI_SUM_STEPS][3] != t->sums[a + a / TLI_SUM_STEPS][3];
}

/* Whether a tet is finite, may lie in the picture and has any extinction. */
static bool may_be_seen(const tli_order_view *view, const tli_cell *cell)
{
    const tli_frame *f = view->frame;
    float low = INFINITY, high = -INFINITY, sum = 0;
    int left = 0, right = 0, above = 0, below = 0, back = 0;
    for (int i = 0; i < 4; i++) {
        const tli_vert *v = &view->verts[cell->verts[i]];
        double w = f->parallel ? 1 : (double)v->z;
        double x = (double)v->x + f->middle[0] * w, y = f->middle[1] * w - (double)v->y;
        sum += v->x + v->y + v->z + v->s;
        low = fminf(low, v->s);
        high = fmaxf(high, v->s);
        left += x < 0;
        right += x > view->width * w;
        above += y < 0;
        below += y > view->height * w;
        back += v->z <= 0;
    }
    if (!isfinite(sum) || left == 4 || right == 4 || above == 4 || below == 4 || back == 4)
        return false;
    return has_extinction(view->transfer, low, high);
}

static tl_status look(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const work *w = arg;
    for (size_t t = begin; t < end; t++) {
        const tli_cell *cell = &w->view->volume->cells[t];
        w->seen[t] = may_be_seen(w->view, cell);
        if (!w->own) continue;
        w->own[t] = 0;
        for (int i = 0; i < 4; i++)
            if (cell->behind[i] != TL_NONE && cell->behind[i] / 4 > t)
                w->own[t] |= (uint8_t)(side_of(w->view, cell, i) << (2 * i));
    }
    return TL_OK;
}

/* Gives the other tet of each face its side, and counts what lies behind each tet. */
static tl_status join(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    static const uint8_t turned[4] = {NOWHERE, BEHIND, IN_FRONT, NOWHERE};
    const work *w = arg;
    for (size_t t = begin; t < end; t++) {
        const tli_cell *cell = &w->view->volume->cells[t];
        unsigned sides = w->own[t];
        for (unsigned i = 0; i < 4; i++) {
            tl_lidx other = cell->behind[i];
            if (other == TL_NONE || other / 4 >= t) continue;
            sides |= (unsigned)turned[w->own[other / 4] >> (2 * (other % 4)) & SIDE_MASK]
                     << (2 * i);
        }
        w->sides[t] = (uint8_t)sides;
        w->counts[t] = 0;
        for (unsigned i = 0; i < 4; i++) w->counts[t] += (sides >> (2 * i) & SIDE_MASK) == BEHIND;
    }
    return TL_OK;
}

/* ---- the order ---- */

static void push(work *w, uint32_t tet)
{
    w->counts[tet] = DRAWN;
    w->tets[w->queued++] = tet;
}

/* One tet behind this one is drawn. */
static void release(work *w, uint32_t tet)
{
    if (w->counts[tet] == DRAWN) return; /* it did not wait, to end a ring */
    w->counts[tet]--;
    if ((w->counts[tet] & ~IN_PAIRS) == 0) push(w, tet);
}

/* Releases what a tet, which stands in pairs, is behind across gaps. */
static void release_pairs(work *w, uint32_t tet)
{
    size_t low = 0, high = w->pair_count;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (w->pairs[middle] >> 32 < tet)
            low = middle + 1;
        else
            high = middle;
    }
    for (; low < w->pair_count && w->pairs[low] >> 32 == tet; low++)
        release(w, (uint32_t)w->pairs[low]);
}

static void count_pairs(work *w)
{
    for (size_t i = 0; i < w->pair_count; i++) {
        w->counts[(uint32_t)w->pairs[i]]++;
        w->counts[w->pairs[i] >> 32] |= IN_PAIRS;
    }
}

/* Draws tets from place *next of the queue on, until it is empty. */
static void drain(work *w, size_t *next, const uint8_t *in_pairs)
{
    for (; *next < w->queued; ++*next) {
        uint32_t tet = w->tets[*next];
        const tli_cell *cell = &w->view->volume->cells[tet];
        for (unsigned i = 0; i < 4; i++)
            if ((w->sides[tet] >> (2 * i) & SIDE_MASK) == IN_FRONT) release(w, cell->behind[i] / 4);
        if (in_pairs[tet]) release_pairs(w, tet);
    }
}

/* Distance of a centroid as a number that falls with it. */
static uint32_t key_of(const tli_order_view *view, const tli_cell *cell)
{
    float x = 0, y = 0, z = 0;
    for (int i = 0; i < 4; i++) {
        const tli_vert *v = &view->verts[cell->verts[i]];
        x += v->x / (float)view->frame->scale;
        y += v->y / (float)view->frame->scale;
        z += v->z;
    }
    float far = view->frame->parallel ? z : x * x + y * y + z * z;
    uint32_t bits;
    memcpy(&bits, &far, sizeof bits);
    return bits >> 31 ? bits : ~(bits | UINT32_C(1) << 31);
}

typedef struct keyed {
    const tli_order_view *view;
    const uint32_t *tets;
    uint32_t *keys;
} keyed;

static tl_status fill_keys(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const keyed *k = arg;
    for (size_t i = begin; i < end; i++)
        k->keys[i] = key_of(k->view, &k->view->volume->cells[k->tets[i]]);
    return TL_OK;
}

/* Sorts tets [count] by their centroids, farthest first. */
static tl_status sort_centroids(tl_ctx *ctx, const tli_order_view *view, uint32_t *tets,
                                size_t count)
{
    tl_status st = TL_OK;
    keyed k = {.view = view, .tets = tets};
    k.keys = tl_mem_alloc(ctx, count, sizeof *k.keys, &st);
    if (!st) st = tli_parallel(ctx, count, GRAIN, fill_keys, &k);
    if (!st) st = tli_sort_u32(ctx, k.keys, tets, count);
    tl_mem_free(ctx, k.keys);
    return st;
}

/* The queue ran dry: rings are cut at the farthest of what is left, again and again. */
static tl_status cut_rings(tl_ctx *ctx, work *w, size_t *next, const uint8_t *in_pairs,
                           size_t *broken)
{
    tl_status st = TL_OK;
    size_t tet_count = w->view->volume->cell_count, count = 0;
    uint32_t *left = tl_mem_alloc(ctx, tet_count - w->queued, sizeof *left, &st);
    if (st) return st;
    for (size_t t = 0; t < tet_count; t++)
        if (w->counts[t] != DRAWN) left[count++] = (uint32_t)t;
    st = sort_centroids(ctx, w->view, left, count);
    for (size_t i = 0; i < count && !st; i++) {
        if (w->counts[left[i]] == DRAWN) continue;
        ++*broken;
        push(w, left[i]);
        drain(w, next, in_pairs);
    }
    tl_mem_free(ctx, left);
    return st;
}

static tl_status settle(tl_ctx *ctx, work *w, size_t *broken)
{
    tl_status st = TL_OK;
    size_t tet_count = w->view->volume->cell_count, next = 0;
    /* w->own has served */
    uint8_t *in_pairs = w->own;
    for (size_t t = 0; t < tet_count; t++) {
        in_pairs[t] = (w->counts[t] & IN_PAIRS) != 0;
        if ((w->counts[t] & ~IN_PAIRS) == 0) push(w, (uint32_t)t);
    }
    drain(w, &next, in_pairs);
    if (w->queued < tet_count) st = cut_rings(ctx, w, &next, in_pairs, broken);
    return st;
}

/* Keeps what is seen of tets [count], in order. Returns how many. */
static size_t keep_seen(const uint8_t *seen, uint32_t *tets, size_t count)
{
    size_t kept = 0;
    for (size_t i = 0; i < count; i++)
        if (seen[tets[i]]) tets[kept++] = tets[i];
    return kept;
}

tl_status tli_order_exact(tl_ctx *ctx, const tli_order_view *view, tli_order *order)
{
    tl_status st = TL_OK;
    size_t count = view->volume->cell_count;
    work w = {.view = view};
    *order = (tli_order){0};
    w.own = tl_mem_alloc(ctx, count, 1, &st);
    w.sides = tl_mem_alloc(ctx, count, 1, &st);
    w.seen = tl_mem_alloc(ctx, count, 1, &st);
    w.counts = tl_mem_alloc(ctx, count, sizeof *w.counts, &st);
    w.tets = tl_mem_alloc(ctx, count, sizeof *w.tets, &st);
    if (!st) st = tli_parallel(ctx, count, GRAIN, look, &w);
    if (!st) st = tli_parallel(ctx, count, GRAIN, join, &w);
    if (!st) st = tli_order_gaps(ctx, view, &w.pairs, &w.pair_count);
    if (!st) count_pairs(&w);
    if (!st) st = settle(ctx, &w, &order->broken);
    if (!st) order->count = keep_seen(w.seen, w.tets, count);
    tl_mem_free(ctx, w.pairs);
    tl_mem_free(ctx, w.counts);
    tl_mem_free(ctx, w.seen);
    tl_mem_free(ctx, w.sides);
    tl_mem_free(ctx, w.own);
    if (st)
        tl_mem_free(ctx, w.tets);
    else
        order->tets = w.tets;
    return st;
}

tl_status tli_order_centroids(tl_ctx *ctx, const tli_order_view *view, tli_order *order)
{
    tl_status st = TL_OK;
    size_t count = view->volume->cell_count;
    work w = {.view = view};
    *order = (tli_order){0};
    w.seen = tl_mem_alloc(ctx, count, 1, &st);
    w.tets = tl_mem_alloc(ctx, count, sizeof *w.tets, &st);
    if (!st) st = tli_parallel(ctx, count, GRAIN, look, &w);
    for (size_t t = 0; t < count && !st; t++)
        if (w.seen[t]) w.tets[w.queued++] = (uint32_t)t;
    if (!st) st = sort_centroids(ctx, view, w.tets, w.queued);
    tl_mem_free(ctx, w.seen);
    if (st)
        tl_mem_free(ctx, w.tets);
    else
        *order = (tli_order){w.tets, w.queued, 0};
    return st;
}
