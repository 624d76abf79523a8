/* Clipping by planes. What is left of a tet is a tet or a wedge; wedges are split with the
 * diagonals of their faces from the smallest vertex that is kept (formats_split.h), which
 * neighbours see, too, so that the result conforms. A corner on the plane is its own cut vertex:
 * the wedge folds there, and tets of it that name a vertex twice go. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "extract/extract_part.h"
#include "formats/formats_split.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192 };

/* For two corners that are kept, first and second by rising number: an even order of all four that
 * begins with them. */
static const uint8_t EVEN[3][4][4] = {{{0}, {0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}},
                                      {{0}, {0}, {1, 2, 0, 3}, {1, 3, 2, 0}},
                                      {{0}, {0}, {0}, {2, 3, 0, 1}}};

typedef struct job {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const double *scalar;
    tli_part *part;
    size_t *tet_starts; /* [piece_count + 1] counts, then starts */
} job;

/* What is left of a tet: corners 0 to 3, or the cut of an edge from a kept corner to one that goes,
 * 4 * (kept + 1) + other. */
typedef struct rest {
    unsigned tet_count, edge_count;
    uint8_t tets[3][4];
    uint8_t edges[4];
} rest;

static uint8_t cut_of(rest *r, const double s[4], uint8_t kept, uint8_t other)
{
    if (s[kept] == 0) return kept;
    uint8_t edge = (uint8_t)(4 * (kept + 1) + other);
    r->edges[r->edge_count++] = edge;
    return edge;
}

/* ranks [4] of the vertices of the corners. Places of the wedge that are cuts count as vertices
 * behind all corners. */
static void split_wedge(rest *r, const uint8_t wedge[6], const uint8_t ranks[4])
{
    tl_lidx ids[6], tets[TLI_SPLIT_MAX][4];
    for (int i = 0; i < 6; i++) ids[i] = wedge[i] < 4 ? ranks[wedge[i]] : wedge[i];
    r->tet_count = tli_split_cell(TLI_SHAPE_WEDGE, ids, tets, NULL);
    for (unsigned t = 0; t < r->tet_count; t++)
        for (int c = 0; c < 4; c++) {
            int place = 0;
            while (ids[place] != tets[t][c]) place++;
            r->tets[t][c] = wedge[place];
        }
}

static void rank_corners(const tl_lidx *q, uint8_t ranks[4])
{
    for (int i = 0; i < 4; i++) {
        ranks[i] = 0;
        for (int k = 0; k < 4; k++) ranks[i] += q[k] < q[i] || (q[k] == q[i] && k < i);
    }
}

static void cut_tet(const tl_lidx *q, const double s[4], rest *r)
{
    uint8_t gone[4], kept[4], ranks[4], wedge[6];
    int gone_count = 0, kept_count = 0;
    for (uint8_t i = 0; i < 4; i++)
        if (s[i] > 0)
            gone[gone_count++] = i;
        else
            kept[kept_count++] = i;
    rank_corners(q, ranks);
    if (gone_count == 3) {
        r->tet_count = 1;
        for (uint8_t i = 0; i < 4; i++) r->tets[0][i] = i == kept[0] ? i : cut_of(r, s, kept[0], i);
        return;
    }
    if (gone_count == 1) {
        memcpy(wedge, tli_tet_faces[gone[0]], 3);
        for (int i = 0; i < 3; i++) wedge[i + 3] = cut_of(r, s, wedge[i], gone[0]);
    } else {
        const uint8_t *order = EVEN[kept[0]][kept[1]];
        for (int i = 0; i < 2; i++) {
            wedge[3 * i] = order[i];
            wedge[3 * i + 1] = cut_of(r, s, order[i], order[3]);
            wedge[3 * i + 2] = cut_of(r, s, order[i], order[2]);
        }
    }
    split_wedge(r, wedge, ranks);
}

/* What is left of tet t; nothing, or itself, or tets of it. */
static void clip_tet(const job *j, size_t t, rest *r)
{
    const tl_lidx *q = j->mesh->tets + 4 * t;
    double s[4];
    int kept = 0, gone = 0;
    r->tet_count = r->edge_count = 0;
    for (int i = 0; i < 4; i++) {
        s[i] = j->scalar[q[i]];
        kept += s[i] < 0;
        gone += s[i] > 0;
        if (!isfinite(s[i])) return;
    }
    if (gone && kept) {
        cut_tet(q, s, r);
    } else if (!gone) {
        r->tet_count = 1;
        for (uint8_t i = 0; i < 4; i++) r->tets[0][i] = i;
    }
}

static tl_status count_pieces(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    rest r;
    size_t tets = 0, edges = 0;
    for (size_t t = begin; t < end; t++) {
        clip_tet(j, t, &r);
        tets += r.tet_count;
        edges += r.edge_count;
    }
    j->tet_starts[begin / TLI_SLICE_TETS] = tets;
    j->part->edges.starts[begin / TLI_SLICE_TETS] = edges;
    j->part->edges.counts[begin / TLI_SLICE_TETS] = edges;
    return TL_OK;
}

static tl_status fill_pieces(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    rest r;
    tli_part *p = j->part;
    size_t tet = j->tet_starts[begin / TLI_SLICE_TETS];
    size_t edge = p->edges.starts[begin / TLI_SLICE_TETS];
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = j->mesh->tets + 4 * t;
        tl_lidx refs[20];
        clip_tet(j, t, &r);
        memcpy(refs, q, 4 * sizeof *refs);
        for (unsigned e = 0; e < r.edge_count; e++, edge++) {
            tl_lidx a = q[r.edges[e] / 4 - 1], b = q[r.edges[e] % 4];
            p->edges.edges[edge] = (tli_cut_edge){tli_edge_key(a, b), 0};
            refs[r.edges[e]] = (tl_lidx)(j->mesh->vert_count + edge);
        }
        for (unsigned i = 0; i < r.tet_count; i++, tet++) {
            for (int c = 0; c < 4; c++) p->refs[4 * tet + (size_t)c] = refs[r.tets[i][c]];
            p->parents[tet] = (tl_lidx)t;
        }
    }
    return TL_OK;
}

static tl_status make_part(job *j)
{
    tl_status st = TL_OK;
    tli_part *p = j->part;
    size_t pieces = (j->mesh->tet_count + TLI_SLICE_TETS - 1) / TLI_SLICE_TETS;
    p->edges.piece_count = pieces;
    p->edges.starts = tl_mem_alloc(j->ctx, pieces + 1, sizeof *p->edges.starts, &st);
    p->edges.counts = tl_mem_alloc(j->ctx, pieces, sizeof *p->edges.counts, &st);
    j->tet_starts = tl_mem_alloc(j->ctx, pieces + 1, sizeof *j->tet_starts, &st);
    if (!st) st = tli_parallel(j->ctx, j->mesh->tet_count, TLI_SLICE_TETS, count_pieces, j);
    if (st) return st;
    p->tet_count = tli_make_starts(j->tet_starts, pieces);
    size_t edges = tli_make_starts(p->edges.starts, pieces);
    if (p->tet_count > TL_MESH_TETS_MAX || edges + j->mesh->vert_count >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED,
                       "%zu tets with %zu cut edges are too many for a mesh", p->tet_count, edges);
    p->refs = tl_mem_alloc(j->ctx, p->tet_count, 4 * sizeof *p->refs, &st);
    p->parents = tl_mem_alloc(j->ctx, p->tet_count, sizeof *p->parents, &st);
    p->edges.edges = tl_mem_alloc(j->ctx, edges, sizeof *p->edges.edges, &st);
    return st ? st : tli_parallel(j->ctx, j->mesh->tet_count, TLI_SLICE_TETS, fill_pieces, j);
}

static tl_status clip_side(tl_ctx *ctx, const tl_mesh *mesh, const tl_half_space *side,
                           tl_mesh **clipped)
{
    tl_status st = TL_OK;
    tli_part part = {.mesh = mesh};
    double *scalar = tl_mem_alloc(ctx, mesh->vert_count, sizeof *scalar, &st);
    if (!st) st = tli_side_values(ctx, mesh->xyz, mesh->vert_count, side, scalar);
    job j = {.ctx = ctx, .mesh = mesh, .scalar = scalar, .part = &part};
    part.scalar = scalar;
    if (!st) st = make_part(&j);
    if (!st) st = tli_part_mesh(ctx, &part, clipped);
    tli_part_release(ctx, &part);
    tl_mem_free(ctx, j.tet_starts);
    tl_mem_free(ctx, scalar);
    return st;
}

tl_status tl_mesh_clip(tl_ctx *ctx, const tl_mesh *mesh, const tl_half_space *sides,
                       size_t side_count, tl_mesh **clipped)
{
    tl_mesh *last = NULL;
    *clipped = NULL;
    tl_status st = tli_side_check(ctx, sides, side_count);
    for (size_t i = 0; !st && i < side_count; i++) {
        tl_mesh *next = NULL;
        st = clip_side(ctx, last ? last : mesh, &sides[i], &next);
        tl_mesh_destroy(last);
        last = next;
    }
    if (!st) *clipped = last;
    return st;
}

/* ---- sides ---- */

tl_status tli_side_check(tl_ctx *ctx, const tl_half_space *sides, size_t side_count)
{
    if (!side_count) return tl_fail(ctx, TL_ERR_ARG, "clipping needs a side");
    for (size_t i = 0; i < side_count; i++) {
        double length = vec_length(sides[i].normal);
        if (!(length > 0) || !isfinite(length) || !isfinite(sides[i].offset))
            return tl_fail(ctx, TL_ERR_ARG,
                           "side %zu needs a finite offset and a normal with a length", i);
    }
    return TL_OK;
}

typedef struct siding {
    const double *xyz;
    const tl_half_space *side;
    double *out;
} siding;

static tl_status set_sides(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const siding *s = arg;
    for (size_t v = begin; v < end; v++)
        s->out[v] = vec_dot(s->side->normal, s->xyz + 3 * v) - s->side->offset;
    return TL_OK;
}

tl_status tli_side_values(tl_ctx *ctx, const double *xyz, size_t vert_count,
                          const tl_half_space *side, double *out)
{
    siding s = {xyz, side, out};
    return tli_parallel(ctx, vert_count, GRAIN, set_sides, &s);
}
