/* Critical points: where a vector field, linear in each tet, is 0. Inside of a tet that is one
 * linear system of three equations; most tets have a component of one sign and are passed over.
 * Points on a face are found from both sides and kept once, those at vertices are found as such. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/base_vec.h"
#include "extract/extract.h"
#include "mesh/mesh.h"

enum { TETS_AT_ONCE = 4096 };
/* A determinant by the product of the lengths of its columns below which the zeros are a line. */
static const double SINGULAR = 1e-12;
/* Two points are one if they are closer than this part of the longest edge of the tet. */
static const double SAME = 1e-6;

typedef struct found {
    double x[3], reach; /* reach: SAME of the tet */
    size_t order;
    bool is_double;
} found;

typedef struct piece {
    found *points;
    size_t count, room;
} piece;

typedef struct job {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const double *vectors;
    uint8_t *states; /* [vert_count] of vertices that are 0: 1 alone so far, 2 beside another */
    piece *pieces;
} job;

static bool is_zero(const double v[3])
{
    return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

/* Vertices that are 0, and whether a neighbour is. One thread: tets write to their corners. */
static void mark_verts(job *j)
{
    for (size_t t = 0; t < j->mesh->tet_count; t++) {
        const tl_lidx *q = j->mesh->tets + 4 * t;
        size_t zeros = 0, where[4];
        for (int i = 0; i < 4; i++)
            if (is_zero(j->vectors + 3 * (size_t)q[i])) where[zeros++] = q[i];
        for (size_t i = 0; i < zeros; i++)
            if (j->states[where[i]] < 2) j->states[where[i]] = zeros > 1 ? 2 : 1;
    }
}

static tl_status add_point(const job *j, size_t index, const double x[3], double reach)
{
    tl_status st = TL_OK;
    piece *own = &j->pieces[index];
    if (own->count == own->room) {
        size_t room = own->room ? 2 * own->room : 16;
        own->points = tl_mem_resize(j->ctx, own->points, room, sizeof *own->points, &st);
        if (st) return st;
        own->room = room;
    }
    own->points[own->count] = (found){.reach = reach};
    memcpy(own->points[own->count++].x, x, 3 * sizeof *x);
    return st;
}

/* False if some component has one sign on all corners, or a corner is no number. */
static bool may_vanish(const double *const v[4])
{
    for (int k = 0; k < 3; k++) {
        double low = v[0][k], high = v[0][k];
        for (int i = 1; i < 4; i++) {
            low = v[i][k] < low ? v[i][k] : low;
            high = v[i][k] > high ? v[i][k] : high;
        }
        if (!(low <= 0 && high >= 0)) return false;
    }
    for (int i = 0; i < 4; i++)
        if (!vec_is_finite(v[i])) return false;
    return true;
}

/* Weights of the one point where the field is 0, none negative; false if there is no such. */
static bool vanishes(const double *const v[4], double weights[4])
{
    double columns[3][3], cross[3], lengths = 1, rest[3];
    for (int i = 0; i < 3; i++) {
        vec_sub(v[i], v[3], columns[i]);
        lengths *= vec_length(columns[i]);
    }
    vec_cross(columns[1], columns[2], cross);
    double det = vec_dot(columns[0], cross);
    if (!(fabs(det) > SINGULAR * lengths)) return false;
    for (int k = 0; k < 3; k++) rest[k] = -v[3][k];
    weights[0] = vec_dot(rest, cross) / det;
    vec_cross(columns[2], columns[0], cross);
    weights[1] = vec_dot(rest, cross) / det;
    vec_cross(columns[0], columns[1], cross);
    weights[2] = vec_dot(rest, cross) / det;
    weights[3] = 1 - weights[0] - weights[1] - weights[2];
    return weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0 && weights[3] >= 0;
}

static double longest_edge(const double p[4][3])
{
    double longest = 0;
    for (int i = 0; i < 4; i++)
        for (int l = 0; l < i; l++) {
            double edge[3];
            vec_sub(p[i], p[l], edge);
            longest = fmax(longest, vec_length(edge));
        }
    return longest;
}

static tl_status search_tet(const job *j, size_t index, size_t tet)
{
    const tl_lidx *q = j->mesh->tets + 4 * tet;
    const double *v[4];
    double p[4][3], weights[4], x[3] = {0, 0, 0};
    tl_status st = TL_OK;
    for (int i = 0; i < 4; i++) v[i] = j->vectors + 3 * (size_t)q[i];
    if (!may_vanish(v)) return TL_OK;
    tli_tet_corners(j->mesh->xyz, q, p);
    double reach = SAME * longest_edge(TLI_CORNERS(p));
    if (!isfinite(reach)) return TL_OK;
    bool at_vertex = false;
    for (int i = 0; i < 4 && !st; i++) {
        at_vertex = at_vertex || is_zero(v[i]);
        if (j->states[q[i]] == 1) st = add_point(j, index, p[i], reach);
    }
    if (st || at_vertex || !vanishes(v, weights)) return st;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) x[k] += weights[i] * p[i][k];
    return add_point(j, index, x, reach);
}

static tl_status search_tets(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    tl_status st = TL_OK;
    for (size_t t = begin; t < end && !st; t++) st = search_tet(j, begin / TETS_AT_ONCE, t);
    return st;
}

static int by_place(const void *a, const void *b)
{
    const found *f = a, *g = b;
    if (f->x[0] != g->x[0]) return f->x[0] < g->x[0] ? -1 : 1;
    return (f->order > g->order) - (f->order < g->order);
}

static int by_order(const void *a, const void *b)
{
    const found *f = a, *g = b;
    return (f->order > g->order) - (f->order < g->order);
}

/* Of points at one place all but the first in the order of tets are doubles. */
static void mark_doubles(found *points, size_t count)
{
    qsort(points, count, sizeof *points, by_place);
    for (size_t i = 0; i < count; i++)
        for (size_t l = i + 1; l < count; l++) {
            double off[3], reach = fmax(points[i].reach, points[l].reach);
            vec_sub(points[l].x, points[i].x, off);
            if (off[0] > points[i].reach && off[0] > points[l].reach) break;
            if (vec_length(off) > reach) continue;
            bool later = points[l].order > points[i].order;
            points[later ? l : i].is_double = true;
        }
    qsort(points, count, sizeof *points, by_order);
}

static tl_status gather(const job *j, size_t piece_count, tl_polydata **points)
{
    tl_status st = TL_OK;
    size_t count = 0;
    for (size_t i = 0; i < piece_count; i++) count += j->pieces[i].count;
    if (count >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED, "%zu critical points are too many", count);
    found *all = tl_mem_alloc(j->ctx, count, sizeof *all, &st);
    tl_polydata *made = tl_mem_zalloc(j->ctx, 1, sizeof *made, &st);
    if (made) made->xyz = tl_mem_alloc(j->ctx, count, 3 * sizeof *made->xyz, &st);
    if (st) {
        tl_polydata_destroy(j->ctx, made);
        tl_mem_free(j->ctx, all);
        return st;
    }
    made->kind = TL_POLY_POINTS;
    size_t next = 0;
    for (size_t i = 0; i < piece_count; i++)
        for (size_t l = 0; l < j->pieces[i].count; l++, next++) {
            all[next] = j->pieces[i].points[l];
            all[next].order = next;
        }
    mark_doubles(all, count);
    for (size_t i = 0; i < count; i++)
        if (!all[i].is_double)
            memcpy(made->xyz + 3 * made->vert_count++, all[i].x, sizeof all[i].x);
    made->cell_count = made->vert_count;
    tl_mem_free(j->ctx, all);
    *points = made;
    return TL_OK;
}

tl_status tl_critical_points(tl_ctx *ctx, const tl_mesh *mesh, const double *vectors,
                             tl_polydata **points)
{
    tl_status st = TL_OK;
    job j = {.ctx = ctx, .mesh = mesh, .vectors = vectors};
    size_t piece_count = mesh->tet_count / TETS_AT_ONCE + 1;
    *points = NULL;
    j.states = tl_mem_zalloc(ctx, mesh->vert_count, 1, &st);
    j.pieces = tl_mem_zalloc(ctx, piece_count, sizeof *j.pieces, &st);
    if (!st) mark_verts(&j);
    if (!st) st = tli_parallel(ctx, mesh->tet_count, TETS_AT_ONCE, search_tets, &j);
    if (!st) st = gather(&j, piece_count, points);
    for (size_t i = 0; j.pieces && i < piece_count; i++) tl_mem_free(ctx, j.pieces[i].points);
    tl_mem_free(ctx, j.pieces);
    tl_mem_free(ctx, j.states);
    return st;
}
