/* Lines by lines: which run through a box, and those alone (Sondershaus 2007, 7.3.2). The work
 * keeps a grid of the lines' names; here all segments are looked at, which takes some nanoseconds
 * each. */
#include <string.h>

#include "extract/extract_part.h"

/* Whether the segment touches the box: what is left of it between the slabs. */
static bool touches(const double a[3], const double b[3], const double bounds[6])
{
    double first = 0, last = 1;
    for (int k = 0; k < 3; k++) {
        double low = bounds[2 * k] - a[k], high = bounds[2 * k + 1] - a[k], way = b[k] - a[k];
        if (way == 0) {
            if (low > 0 || high < 0) return false;
            continue;
        }
        double in = (way > 0 ? low : high) / way, out = (way > 0 ? high : low) / way;
        first = in > first ? in : first;
        last = out < last ? out : last;
    }
    return first <= last;
}

size_t tl_lines_in_box(const tl_polydata *lines, const double bounds[6], uint8_t *selected)
{
    size_t count = 0;
    for (size_t c = 0; c < lines->cell_count; c++) {
        selected[c] = 0;
        for (size_t i = lines->starts[c] + 1; i < lines->starts[c + 1] && !selected[c]; i++)
            selected[c] = touches(lines->xyz + 3 * (size_t)lines->corners[i - 1],
                                  lines->xyz + 3 * (size_t)lines->corners[i], bounds);
        count += selected[c];
    }
    return count;
}

/* Corners and starts of the lines whose mark is as wanted. */
static tl_status pick_cells(tl_ctx *ctx, const tl_polydata *from, const uint8_t *marks, bool wanted,
                            tl_polydata *to)
{
    tl_status st = TL_OK;
    size_t count = 0, corners = 0;
    for (size_t c = 0; c < from->cell_count; c++) {
        if ((marks[c] != 0) != wanted) continue;
        count++;
        corners += from->starts[c + 1] - from->starts[c];
    }
    to->corners = tl_mem_alloc(ctx, corners, sizeof *to->corners, &st);
    to->starts = tl_mem_alloc(ctx, count + 1, sizeof *to->starts, &st);
    if (st) return st;
    to->starts[0] = 0;
    for (size_t c = 0; c < from->cell_count; c++) {
        size_t length = from->starts[c + 1] - from->starts[c], at = to->starts[to->cell_count];
        if ((marks[c] != 0) != wanted) continue;
        memcpy(to->corners + at, from->corners + from->starts[c], length * sizeof *to->corners);
        to->starts[++to->cell_count] = (tl_lidx)(at + length);
    }
    return st;
}

static tl_status pick_normals(tl_ctx *ctx, const tli_cut_verts *verts, const tl_polydata *from,
                              tl_polydata *to)
{
    tl_status st = TL_OK;
    to->normals = tl_mem_alloc(ctx, verts->count, 3 * sizeof *to->normals, &st);
    for (size_t v = 0; !st && v < verts->count; v++)
        memcpy(to->normals + 3 * v, from->normals + 3 * (size_t)verts->olds[v],
               3 * sizeof *to->normals);
    return st;
}

/* The vertices that the picked lines use, with channels and normals. */
static tl_status pick_verts(tl_ctx *ctx, const tl_polydata *from, tl_polydata *to)
{
    size_t none[1] = {0}, starts[2] = {0, 0};
    tli_cut_edges edges = {NULL, starts, none, 1}; /* nothing is cut */
    tli_cut_verts verts = {0};
    tl_status st = tli_cut_verts_make(ctx, to->corners, to->starts[to->cell_count],
                                      from->vert_count, &edges, to->corners, &verts);
    if (!st) st = tli_cut_verts_polydata(ctx, &verts, from, NULL, to);
    if (!st && from->normals) st = pick_normals(ctx, &verts, from, to);
    tli_cut_verts_release(ctx, &verts);
    return st;
}

tl_status tl_lines_pick(tl_ctx *ctx, const tl_polydata *lines, const uint8_t *marks, bool wanted,
                        tl_polydata **picked)
{
    tl_status st = TL_OK;
    *picked = NULL;
    tl_polydata *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    made->kind = TL_POLY_LINES;
    st = pick_cells(ctx, lines, marks, wanted, made);
    if (!st) st = pick_verts(ctx, lines, made);
    if (st)
        tl_polydata_destroy(ctx, made);
    else
        *picked = made;
    return st;
}
