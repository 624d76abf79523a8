/* A mesh in parts of about equal size: planes across the longest side of the centroids' box, so
 * that parts are compact and the cuts do not depend on the order of tets. Where the mesh lies in
 * several cells, no part does; what a cell has too little of goes with a neighbour. */
#include <math.h>
#include <string.h>

#include "model/model.h"

/* A centroid (four times it) with its tet. */
typedef struct centre {
    double x[3];
    uint32_t tet;
} centre;

/* A cell's tets in a mesh are a sliver below that part of a part's size. */
enum { SLIVER = 4 };

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
    size_t low = parts / 2, middle = begin + (end - begin) * low / parts;
    select_at(s->centres, begin, end, middle, longest_axis(s->centres, begin, end));
    cut(s, begin, middle, low);
    cut(s, middle, end, parts - low);
}

static tl_status open_split(tl_ctx *ctx, const double *xyz, const tl_lidx *tets, size_t tet_count,
                            size_t part_tets, uint32_t *part, split *s)
{
    tl_status st = TL_OK;
    *s = (split){tl_mem_alloc(ctx, tet_count, sizeof(centre), &st), part_tets, part, 0};
    if (st) return st;
    for (size_t t = 0; t < tet_count; t++) {
        s->centres[t].tet = (uint32_t)t;
        for (int k = 0; k < 3; k++) {
            double sum = 0;
            for (size_t i = 0; i < 4; i++) sum += xyz[3 * (size_t)tets[4 * t + i] + (size_t)k];
            s->centres[t].x[k] = isfinite(sum) ? sum : 0;
        }
    }
    return TL_OK;
}

tl_status tli_split(tl_ctx *ctx, const double *xyz, const tl_lidx *tets, size_t tet_count,
                    size_t part_tets, uint32_t *part, size_t *part_count)
{
    split s;
    tl_status st = open_split(ctx, xyz, tets, tet_count, part_tets, part, &s);
    if (st) return st;
    if (tet_count) cut(&s, 0, tet_count, (tet_count + part_tets - 1) / part_tets);
    *part_count = s.count;
    tl_mem_free(ctx, s.centres);
    return TL_OK;
}

/* ---- by cells ---- */

/* The cells of a mesh, numbered in the order they come. */
typedef struct local_cells {
    uint32_t *numbers; /* [count] */
    size_t *tets;      /* [count] */
    size_t count;
} local_cells;

static tl_status list_cells(tl_ctx *ctx, uint32_t *cell_of, size_t tet_count, local_cells *cells)
{
    tl_status st = TL_OK;
    size_t capacity = 0, last = 0;
    *cells = (local_cells){0};
    for (size_t t = 0; t < tet_count; t++) {
        size_t c = last; /* that of the tet before, mostly */
        if (c >= cells->count || cells->numbers[c] != cell_of[t])
            for (c = 0; c < cells->count && cells->numbers[c] != cell_of[t]; c++) {
            }
        if (c == cells->count) {
            if (c == capacity) {
                capacity = capacity ? 2 * capacity : 64;
                cells->numbers =
                    tl_mem_resize(ctx, cells->numbers, capacity, sizeof *cells->numbers, &st);
                cells->tets = tl_mem_resize(ctx, cells->tets, capacity, sizeof *cells->tets, &st);
                if (st) return st;
            }
            cells->numbers[c] = cell_of[t];
            cells->tets[c] = 0;
            cells->count++;
        }
        cells->tets[c]++;
        cell_of[t] = (uint32_t)c;
        last = c;
    }
    return TL_OK;
}

/* The cell that shares the most faces with another one; where none does, the largest. faces
 * [cells->count] is scratch. */
static size_t best_neighbour(const tl_lidx *opposite, const uint32_t *cell_of, size_t tet_count,
                             size_t cell, const local_cells *cells, size_t *faces)
{
    size_t best = cell;
    memset(faces, 0, cells->count * sizeof *faces);
    for (size_t i = 0; i < 4 * tet_count; i++)
        if (cell_of[i / 4] == cell && opposite[i] != TL_NONE && cell_of[opposite[i] / 4] != cell)
            faces[cell_of[opposite[i] / 4]]++;
    for (size_t c = 0; c < cells->count; c++)
        if (faces[c] > faces[best]) best = c;
    for (size_t c = 0; !faces[best] && c < cells->count; c++)
        if (cells->tets[c] > cells->tets[best]) best = c;
    return best;
}

/* Gives slivers to their neighbours, the smallest first. */
static tl_status merge_slivers(tl_ctx *ctx, const tl_lidx *opposite, uint32_t *cell_of,
                               size_t tet_count, size_t least, local_cells *cells)
{
    tl_status st = TL_OK;
    size_t *faces = tl_mem_alloc(ctx, cells->count, sizeof *faces, &st);
    while (!st) {
        size_t smallest = cells->count;
        for (size_t c = 0; c < cells->count; c++)
            if (cells->tets[c] && cells->tets[c] < least &&
                (smallest == cells->count || cells->tets[c] < cells->tets[smallest]))
                smallest = c;
        if (smallest == cells->count) break;
        size_t to = best_neighbour(opposite, cell_of, tet_count, smallest, cells, faces);
        if (to == smallest) break; /* all there is */
        for (size_t t = 0; t < tet_count; t++)
            if (cell_of[t] == smallest) cell_of[t] = (uint32_t)to;
        cells->tets[to] += cells->tets[smallest];
        cells->tets[smallest] = 0;
    }
    tl_mem_free(ctx, faces);
    return st;
}

/* Orders the centres by cells, and cuts each cell. */
static tl_status cut_cells(tl_ctx *ctx, split *s, const uint32_t *cell_of, size_t tet_count,
                           const local_cells *cells, uint32_t **part_cells)
{
    tl_status st = TL_OK;
    size_t begin = 0, parts = 0;
    centre *by_cell = tl_mem_alloc(ctx, tet_count, sizeof *by_cell, &st);
    size_t *places = tl_mem_alloc(ctx, cells->count, sizeof *places, &st);
    for (size_t c = 0; !st && c < cells->count; c++) {
        places[c] = begin;
        begin += cells->tets[c];
        parts += (cells->tets[c] + s->part_tets - 1) / s->part_tets;
    }
    *part_cells = tl_mem_alloc(ctx, parts, sizeof **part_cells, &st);
    for (size_t t = 0; !st && t < tet_count; t++) by_cell[places[cell_of[t]]++] = s->centres[t];
    if (!st) {
        tl_mem_free(ctx, s->centres);
        s->centres = by_cell;
        by_cell = NULL;
        begin = 0;
    }
    for (size_t c = 0; !st && c < cells->count; c++) {
        size_t count = cells->tets[c];
        if (!count) continue;
        uint32_t first = s->count;
        cut(s, begin, begin + count, (count + s->part_tets - 1) / s->part_tets);
        for (uint32_t p = first; p < s->count; p++) (*part_cells)[p] = cells->numbers[c];
        begin += count;
    }
    tl_mem_free(ctx, places);
    tl_mem_free(ctx, by_cell);
    return st;
}

tl_status tli_split_cells(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                          uint32_t *cell_of, size_t part_tets, uint32_t *part, size_t *part_count,
                          uint32_t **part_cells)
{
    split s = {0};
    local_cells cells = {0};
    size_t n = mesh->tet_count;
    *part_cells = NULL;
    tl_status st = list_cells(ctx, cell_of, n, &cells);
    if (!st) st = merge_slivers(ctx, opposite, cell_of, n, part_tets / SLIVER, &cells);
    if (!st) st = open_split(ctx, mesh->xyz, mesh->tets, n, part_tets, part, &s);
    if (!st) st = cut_cells(ctx, &s, cell_of, n, &cells, part_cells);
    *part_count = s.count;
    tl_mem_free(ctx, s.centres);
    tl_mem_free(ctx, cells.tets);
    tl_mem_free(ctx, cells.numbers);
    if (st) {
        tl_mem_free(ctx, *part_cells);
        *part_cells = NULL;
    }
    return st;
}
