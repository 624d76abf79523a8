/* A mesh in parts of about equal size: planes across the longest side of the centroids' box, so
 * that parts are compact and the cuts do not depend on the order of tets. */
#include <math.h>
#include <string.h>

#include "model/model.h"

/* A centroid (four times it) with its tet. */
typedef struct centre {
    double x[3];
    uint32_t tet;
} centre;

typedef struct split {
    centre *centres;
    size_t part_tets;
    uint32_t *part;
    uint32_t count;
} split;

static bool before(const centre *a, const centre *b, int axis)
{
    return a->x[axis] < b->x[axis] || (a->x[axis] == b->x[axis] && a->tet < b->tet);
}

static void swap(centre *a, centre *b)
{
    centre t = *a;
    *a = *b;
    *b = t;
}

/* The median of three, without an order of their own. */
static centre median(const centre *c, size_t begin, size_t end, int axis)
{
    centre a = c[begin], b = c[begin + (end - begin) / 2], d = c[end - 1];
    if (before(&b, &a, axis)) swap(&a, &b);
    if (before(&d, &b, axis)) b = before(&d, &a, axis) ? a : d;
    return b;
}

/* Puts the element that belongs at position at there, smaller ones before it. Quickselect; no two
 * elements are equal. */
static void select_at(centre *c, size_t begin, size_t end, size_t at, int axis)
{
    while (end - begin > 1) {
        centre pivot = median(c, begin, end, axis);
        size_t i = begin, j = end - 1;
        for (;;) {
            while (before(&c[i], &pivot, axis)) i++;
            while (before(&pivot, &c[j], axis)) j--;
            if (i >= j) break;
            swap(&c[i], &c[j]);
        }
        if (at == i) return; /* where the pivot is */
        if (at < i)
            end = i;
        else
            begin = i + 1;
    }
}

static int longest_axis(const centre *c, size_t begin, size_t end)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    int axis = 0;
    for (size_t i = begin; i < end; i++)
        for (int k = 0; k < 3; k++) {
            lo[k] = fmin(lo[k], c[i].x[k]);
            hi[k] = fmax(hi[k], c[i].x[k]);
        }
    for (int k = 1; k < 3; k++)
        if (hi[k] - lo[k] > hi[axis] - lo[axis]) axis = k;
    return axis;
}

static void cut(split *s, size_t begin, size_t end, size_t parts)
{
    if (parts <= 1) {
        for (size_t i = begin; i < end; i++) s->part[s->centres[i].tet] = s->count;
        s->count++;
        return;
    }
    size_t low = parts / 2, middle = begin + (end - begin) / parts * low;
    select_at(s->centres, begin, end, middle, longest_axis(s->centres, begin, end));
    cut(s, begin, middle, low);
    cut(s, middle, end, parts - low);
}

tl_status tli_split(tl_ctx *ctx, const double *xyz, const tl_lidx *tets, size_t tet_count,
                    size_t part_tets, uint32_t *part, size_t *part_count)
{
    tl_status st = TL_OK;
    split s = {tl_mem_alloc(ctx, tet_count, sizeof(centre), &st), part_tets, part, 0};
    if (st) return st;
    for (size_t t = 0; t < tet_count; t++) {
        s.centres[t].tet = (uint32_t)t;
        for (int k = 0; k < 3; k++) {
            double sum = 0;
            for (size_t i = 0; i < 4; i++) sum += xyz[3 * (size_t)tets[4 * t + i] + (size_t)k];
            s.centres[t].x[k] = isfinite(sum) ? sum : 0;
        }
    }
    if (tet_count) cut(&s, 0, tet_count, (tet_count + part_tets - 1) / part_tets);
    *part_count = s.count;
    tl_mem_free(ctx, s.centres);
    return TL_OK;
}
