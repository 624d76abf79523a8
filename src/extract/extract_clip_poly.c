/* Clipping of points, lines and triangles by planes. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "extract/extract_part.h"
#include "mesh/mesh.h"

typedef struct job {
    tl_ctx *ctx;
    const tl_polydata *from;
    const double *scalar;
    tl_lidx *refs; /* corners of the result: below the vertex count vertices, else cut edges */
    size_t ref_count;
    tli_cut_edge *edges;
    size_t edge_count;
    tli_cut_verts verts;
    tl_polydata *out;
} job;

static bool is_kept(const job *j, size_t vert)
{
    return j->scalar[vert] <= 0; /* false for NaN */
}

/* True if the plane passes between two vertices, at neither of them. */
static bool is_cut(const job *j, size_t a, size_t b)
{
    double s = j->scalar[a], t = j->scalar[b];
    return isfinite(s) && isfinite(t) && ((s < 0 && t > 0) || (s > 0 && t < 0));
}

static void add_cut(job *j, tl_lidx a, tl_lidx b)
{
    j->refs[j->ref_count++] = (tl_lidx)(j->from->vert_count + j->edge_count);
    j->edges[j->edge_count++] = (tli_cut_edge){tli_edge_key(a, b), 0};
}

/* ---- cells ---- */

static void clip_triangle(job *j, const tl_lidx *corners)
{
    size_t first = j->ref_count, first_edge = j->edge_count;
    for (size_t i = 0; i < 3; i++) {
        tl_lidx next = corners[(i + 1) % 3];
        if (!isfinite(j->scalar[corners[i]])) {
            j->ref_count = first;
            j->edge_count = first_edge;
            return;
        }
        if (is_kept(j, corners[i])) j->refs[j->ref_count++] = corners[i];
        if (is_cut(j, corners[i], next)) add_cut(j, corners[i], next);
    }
    size_t count = j->ref_count - first;
    if (count < 3) j->ref_count = first; /* a corner or a side on the plane */
    if (count == 4) {
        const tl_lidx *r = j->refs + first;
        tl_lidx second[3] = {r[0], r[2], r[3]};
        memcpy(j->refs + first + 3, second, sizeof second);
        j->ref_count += 2;
    }
}

static void end_line(job *j)
{
    tl_polydata *out = j->out;
    if (j->ref_count - out->starts[out->cell_count] < 2)
        j->ref_count = out->starts[out->cell_count];
    else
        out->starts[++out->cell_count] = (tl_lidx)j->ref_count;
}

static void clip_line(job *j, const tl_lidx *corners, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (i && is_cut(j, corners[i - 1], corners[i])) add_cut(j, corners[i - 1], corners[i]);
        if (is_kept(j, corners[i]))
            j->refs[j->ref_count++] = corners[i];
        else
            end_line(j);
    }
    end_line(j);
}

/* Corners of the result, and the edges that are cut. */
static tl_status clip_cells(job *j)
{
    tl_status st = TL_OK;
    const tl_polydata *p = j->from;
    bool lines = p->kind == TL_POLY_LINES;
    size_t room = p->kind == TL_POLY_POINTS ? p->vert_count
                  : lines                   ? 2 * (size_t)p->starts[p->cell_count]
                                            : 6 * p->cell_count;
    if (p->vert_count + room >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED, "%zu cells are too many to be clipped",
                       p->cell_count);
    j->refs = tl_mem_alloc(j->ctx, room, sizeof *j->refs, &st);
    j->edges = tl_mem_alloc(j->ctx, lines ? room : 2 * p->cell_count, sizeof *j->edges, &st);
    if (lines) j->out->starts = tl_mem_zalloc(j->ctx, room + 1, sizeof *j->out->starts, &st);
    if (st) return st;
    if (p->kind == TL_POLY_POINTS)
        for (size_t v = 0; v < p->vert_count; v++)
            if (is_kept(j, v)) j->refs[j->ref_count++] = (tl_lidx)v;
    for (size_t c = 0; p->kind != TL_POLY_POINTS && c < p->cell_count; c++)
        if (lines)
            clip_line(j, p->corners + p->starts[c], p->starts[c + 1] - p->starts[c]);
        else
            clip_triangle(j, p->corners + 3 * c);
    if (p->kind == TL_POLY_TRIANGLES) j->out->cell_count = j->ref_count / 3;
    if (p->kind == TL_POLY_POINTS) j->out->cell_count = j->ref_count;
    return st;
}

/* ---- vertices ---- */

static tl_status carry_normals(job *j)
{
    tl_status st = TL_OK;
    const float *from = j->from->normals;
    if (!from) return st;
    float *to = tl_mem_alloc(j->ctx, j->verts.count, 3 * sizeof *to, &st);
    for (size_t v = 0; !st && v < j->verts.count; v++) {
        double n[3];
        size_t ends[2];
        double w = tli_cut_ends(&j->verts, j->from->xyz, j->scalar, v, ends);
        for (size_t k = 0; k < 3; k++)
            n[k] = tli_mix((double)from[3 * ends[0] + k], (double)from[3 * ends[1] + k], w);
        double length = vec_length(n);
        for (size_t k = 0; k < 3; k++) to[3 * v + k] = length > 0 ? (float)(n[k] / length) : 0;
    }
    j->out->normals = to;
    return st;
}

static tl_status make_verts(job *j)
{
    size_t starts[2] = {0, j->edge_count}, counts[1] = {j->edge_count};
    tli_cut_edges edges = {j->edges, starts, counts, 1};
    tl_status st = tli_cut_verts_make(j->ctx, j->refs, j->ref_count, j->from->vert_count, &edges,
                                      j->refs, &j->verts);
    if (!st) st = tli_cut_verts_polydata(j->ctx, &j->verts, j->from, j->scalar, j->out);
    return st ? st : carry_normals(j);
}

/* ---- sides ---- */

static tl_status clip_side(tl_ctx *ctx, const tl_polydata *from, const tl_half_space *side,
                           tl_polydata **clipped)
{
    tl_status st = TL_OK;
    double *scalar = tl_mem_alloc(ctx, from->vert_count, sizeof *scalar, &st);
    job j = {.ctx = ctx, .from = from, .scalar = scalar};
    j.out = tl_mem_zalloc(ctx, 1, sizeof *j.out, &st);
    if (!st) {
        j.out->kind = from->kind;
        st = tli_side_values(ctx, from->xyz, from->vert_count, side, scalar);
    }
    if (!st) st = clip_cells(&j);
    if (!st) st = make_verts(&j);
    if (!st && from->kind != TL_POLY_POINTS) {
        j.out->corners = j.refs;
        j.refs = NULL;
    }
    tli_cut_verts_release(ctx, &j.verts);
    tl_mem_free(ctx, j.edges);
    tl_mem_free(ctx, j.refs);
    tl_mem_free(ctx, scalar);
    if (st)
        tl_polydata_destroy(ctx, j.out);
    else
        *clipped = j.out;
    return st;
}

tl_status tl_polydata_clip(tl_ctx *ctx, const tl_polydata *polydata, const tl_half_space *sides,
                           size_t side_count, tl_polydata **clipped)
{
    tl_polydata *last = NULL;
    *clipped = NULL;
    tl_status st = tli_side_check(ctx, sides, side_count);
    for (size_t i = 0; !st && i < side_count; i++) {
        tl_polydata *next = NULL;
        st = clip_side(ctx, last ? last : polydata, &sides[i], &next);
        tl_polydata_destroy(ctx, last);
        last = next;
    }
    if (!st) *clipped = last;
    return st;
}
