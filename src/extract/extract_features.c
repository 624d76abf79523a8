/* Which edges of a surface are seen as lines: sharp ones, those between regions, open ones, and
 * silhouettes (Sondershaus 2007, 7.1). Whether a triangle looks at the camera is asked once a
 * triangle, so that silhouettes are closed wherever the surface is. */
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "base/base_vec.h"
#include "extract/extract_edges.h"

enum { GRAIN = 8192, KINDS_ALL = 31 };

static const double DEGREE = 0.017453292519943295;

typedef enum facing { FACES_NOWHERE = 0, FACES_AWAY = 1, FACES_CAMERA = 2 } facing;

/* A triangle of a part. */
typedef struct side {
    const tli_edge_part *part;
    size_t part_index;
    uint32_t triangle;
} side;

typedef struct job {
    tl_ctx *ctx;
    const tl_edges *edges;
    const tl_edges_opts *opts;
    double cosine;           /* below: a sharp edge */
    double look[3];          /* parallel view: towards the camera */
    uint8_t *facings;        /* [all triangles] */
    uint32_t (*segments)[2]; /* [segment_count] vertices, counted over all parts */
    size_t segment_count, segment_room;
    uint32_t *ids;     /* [vert_count] vertices in use, rising */
    uint32_t *firsts;  /* [vert_count + 1] of ends */
    uint32_t *ends;    /* [2 * segment_count] ends of segments, 2 * segment + end, by vertex */
    uint8_t *is_taken; /* [segment_count] */
    tl_polydata *out;
} job;

/* ---- what looks where ---- */

static size_t part_at(const size_t *firsts, size_t part_count, size_t item)
{
    size_t low = 0, high = part_count;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (firsts[middle] <= item)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static tl_status face_triangles(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    const tl_edges *e = j->edges;
    const tl_camera *camera = j->opts->camera;
    size_t i = part_at(e->first_triangles, e->part_count, begin);
    for (size_t t = begin; t < end; t++) {
        while (t >= e->first_triangles[i + 1]) i++;
        const tli_edge_part *p = &e->parts[i];
        size_t own = t - e->first_triangles[i];
        double look[3];
        vec_sub(camera->position, p->xyz + 3 * (size_t)p->triangles[3 * own], look);
        double toward = vec_dot(p->normals[own], camera->parallel_scale > 0 ? j->look : look);
        bool known = vec_dot(p->normals[own], p->normals[own]) > 0 && isfinite(toward);
        j->facings[t] = (uint8_t)(!known ? FACES_NOWHERE : toward > 0 ? FACES_CAMERA : FACES_AWAY);
    }
    return TL_OK;
}

static tl_status set_facings(job *j)
{
    tl_status st = TL_OK;
    if (!(j->opts->kinds & TL_EDGE_SILHOUETTE)) return st;
    size_t count = j->edges->first_triangles[j->edges->part_count];
    vec_sub(j->opts->camera->position, j->opts->camera->focal_point, j->look);
    j->facings = tl_mem_alloc(j->ctx, count, 1, &st);
    return st ? st : tli_parallel(j->ctx, count, GRAIN, face_triangles, j);
}

/* ---- which edges ---- */

static int32_t region_of(const side *s)
{
    return s->part->regions ? s->part->regions[s->triangle] : 0;
}

static unsigned kinds_between(const job *j, const side *a, const side *b)
{
    unsigned kinds = region_of(a) == region_of(b) ? 0 : TL_EDGE_REGION;
    const double *n = a->part->normals[a->triangle], *m = b->part->normals[b->triangle];
    if (vec_dot(n, m) < j->cosine && vec_dot(n, n) > 0 && vec_dot(m, m) > 0) kinds |= TL_EDGE_SHARP;
    if (j->facings) {
        const size_t *firsts = j->edges->first_triangles;
        unsigned both = j->facings[firsts[a->part_index] + a->triangle] |
                        j->facings[firsts[b->part_index] + b->triangle];
        if (both == (FACES_AWAY | FACES_CAMERA)) kinds |= TL_EDGE_SILHOUETTE;
    }
    return kinds;
}

static tl_status add_segment(job *j, size_t part, const tli_edge *e)
{
    tl_status st = TL_OK;
    if (j->segment_count == j->segment_room) {
        size_t room = j->segment_room ? 2 * j->segment_room : 1024;
        j->segments = tl_mem_resize(j->ctx, j->segments, room, sizeof *j->segments, &st);
        if (st) return st;
        j->segment_room = room;
    }
    for (int i = 0; i < 2; i++) {
        const tli_edge_part *p = &j->edges->parts[part];
        uint32_t number = p->shared ? p->shared[e->verts[i]] : TL_NONE;
        j->segments[j->segment_count][i] =
            number == TL_NONE ? (uint32_t)(j->edges->first_verts[part] + e->verts[i])
                              : j->edges->owners[number];
    }
    j->segment_count++;
    return st;
}

static tl_status pick_inner(job *j, size_t part)
{
    tl_status st = TL_OK;
    const tli_edge_part *p = &j->edges->parts[part];
    for (size_t i = 0; !st && i < p->edge_count; i++) {
        const tli_edge *e = &p->edges[i];
        side a = {p, part, e->sides[0]}, b = {p, part, e->sides[1]};
        unsigned kinds = e->sides[0] == TL_NONE   ? TL_EDGE_NONMANIFOLD
                         : e->sides[1] == TL_NONE ? TL_EDGE_OPEN
                                                  : kinds_between(j, &a, &b);
        if (kinds & j->opts->kinds) st = add_segment(j, part, e);
    }
    return st;
}

/* The shared number at which a side begins, as its triangle goes around. */
static uint32_t begin_of(const tli_edge_part *p, const tli_edge *rim)
{
    const tl_lidx *corners = p->triangles + 3 * (size_t)rim->sides[0];
    for (size_t k = 0; k < 3; k++)
        if (corners[k] == rim->verts[0])
            return p->shared[rim->verts[corners[(k + 1) % 3] == rim->verts[1] ? 0 : 1]];
    return TL_NONE;
}

static tl_status pick_seam(job *j, size_t seam)
{
    const tl_edges *edges = j->edges;
    const tli_seam_side *sides = edges->sides + edges->starts[seam];
    size_t count = edges->starts[seam + 1] - edges->starts[seam];
    const tli_edge_part *p = &edges->parts[sides[0].part];
    const tli_edge *rim = &p->rims[sides[0].rim];
    unsigned kinds = count == 1 ? TL_EDGE_OPEN : TL_EDGE_NONMANIFOLD;
    if (count == 2) {
        const tli_edge_part *q = &edges->parts[sides[1].part];
        const tli_edge *other = &q->rims[sides[1].rim];
        side a = {p, sides[0].part, rim->sides[0]}, b = {q, sides[1].part, other->sides[0]};
        if (begin_of(p, rim) != begin_of(q, other)) kinds = kinds_between(j, &a, &b);
    }
    return kinds & j->opts->kinds ? add_segment(j, sides[0].part, rim) : TL_OK;
}

/* ---- lines ---- */

/* Vertices in use, and the ends of segments at each. */
static tl_status sort_ends(job *j)
{
    tl_status st = TL_OK;
    size_t count = 2 * j->segment_count, verts = 0;
    if (count >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED, "%zu edges are too many for lines",
                       j->segment_count);
    j->ids = tl_mem_alloc(j->ctx, count, sizeof *j->ids, &st);
    j->ends = tl_mem_alloc(j->ctx, count, sizeof *j->ends, &st);
    j->firsts = tl_mem_alloc(j->ctx, count + 1, sizeof *j->firsts, &st);
    for (size_t i = 0; !st && i < count; i++) {
        j->ids[i] = j->segments[i / 2][i & 1];
        j->ends[i] = (uint32_t)i;
    }
    if (!st) st = tli_sort_u32(j->ctx, j->ids, j->ends, count);
    if (st) return st;
    uint32_t last = TL_NONE;
    for (size_t i = 0; i < count; i++) {
        if (j->ids[i] != last) {
            last = j->ids[i];
            j->firsts[verts] = (uint32_t)i;
            j->ids[verts++] = last;
        }
        j->segments[j->ends[i] / 2][j->ends[i] & 1] = (uint32_t)(verts - 1);
    }
    j->firsts[verts] = (uint32_t)count;
    j->out->vert_count = verts;
    return st;
}

/* Follows segments from one end to where a line ends. */
static void follow(job *j, uint32_t end, size_t *corner_count)
{
    tl_polydata *out = j->out;
    out->corners[(*corner_count)++] = j->segments[end / 2][end & 1];
    for (;;) {
        j->is_taken[end / 2] = 1;
        end ^= 1;
        uint32_t vert = j->segments[end / 2][end & 1], first = j->firsts[vert];
        out->corners[(*corner_count)++] = vert;
        if (j->firsts[vert + 1] - first != 2) break;
        end = j->ends[first] == end ? j->ends[first + 1] : j->ends[first];
        if (j->is_taken[end / 2]) break;
    }
    out->starts[++out->cell_count] = (tl_lidx)*corner_count;
}

/* Lines that end somewhere first, then what is left: loops. */
static tl_status chain(job *j)
{
    tl_status st = TL_OK;
    size_t corners = 0;
    tl_polydata *out = j->out;
    out->starts = tl_mem_zalloc(j->ctx, j->segment_count + 1, sizeof *out->starts, &st);
    out->corners = tl_mem_alloc(j->ctx, 2 * j->segment_count, sizeof *out->corners, &st);
    j->is_taken = tl_mem_zalloc(j->ctx, j->segment_count, 1, &st);
    for (int loops = 0; !st && loops < 2; loops++)
        for (size_t v = 0; v < out->vert_count; v++) {
            if (!loops && j->firsts[v + 1] - j->firsts[v] == 2) continue;
            for (uint32_t i = j->firsts[v]; i < j->firsts[v + 1]; i++)
                if (!j->is_taken[j->ends[i] / 2]) follow(j, j->ends[i], &corners);
        }
    return st;
}

static tl_status set_places(job *j)
{
    tl_status st = TL_OK;
    const tl_edges *e = j->edges;
    j->out->xyz = tl_mem_alloc(j->ctx, j->out->vert_count, 3 * sizeof *j->out->xyz, &st);
    for (size_t v = 0; !st && v < j->out->vert_count; v++) {
        size_t part = part_at(e->first_verts, e->part_count, j->ids[v]);
        memcpy(j->out->xyz + 3 * v, e->parts[part].xyz + 3 * (j->ids[v] - e->first_verts[part]),
               3 * sizeof *j->out->xyz);
    }
    return st;
}

/* ---- asking ---- */

static tl_status take_opts(tl_ctx *ctx, const tl_edges_opts *o)
{
    if (!o->kinds || o->kinds & ~(unsigned)KINDS_ALL)
        return tl_fail(ctx, TL_ERR_ARG, "%u is no set of kinds of edges", o->kinds);
    if (!(o->angle >= 0 && o->angle <= 180))
        return tl_fail(ctx, TL_ERR_ARG, "sharp edges from %g degrees on, expected 0 to 180",
                       o->angle);
    if (!(o->kinds & TL_EDGE_SILHOUETTE)) return TL_OK;
    if (!o->camera) return tl_fail(ctx, TL_ERR_ARG, "silhouettes need a camera");
    return tl_camera_check(ctx, o->camera);
}

tl_edges_opts tl_edges_opts_defaults(void)
{
    return (tl_edges_opts){.struct_bytes = sizeof(tl_edges_opts),
                           .kinds = KINDS_ALL & ~(unsigned)TL_EDGE_SILHOUETTE,
                           .angle = 30};
}

tl_status tl_edges_lines(tl_ctx *ctx, tl_edges *edges, const tl_edges_opts *opts,
                         tl_polydata **lines)
{
    tl_edges_opts own = tl_edges_opts_defaults();
    *lines = NULL;
    tl_status st = tli_opts_take(ctx, "tl_edges_opts", opts, &own, sizeof own);
    if (!st) st = take_opts(ctx, &own);
    if (!st) st = tli_edges_join(ctx, edges);
    if (st) return st;
    job j = {.ctx = ctx, .edges = edges, .opts = &own, .cosine = cos(own.angle * DEGREE)};
    j.out = tl_mem_zalloc(ctx, 1, sizeof *j.out, &st);
    if (!st) j.out->kind = TL_POLY_LINES;
    if (!st) st = set_facings(&j);
    for (size_t i = 0; !st && i < edges->part_count; i++) st = pick_inner(&j, i);
    for (size_t i = 0; !st && i < edges->seam_count; i++) st = pick_seam(&j, i);
    if (!st) st = sort_ends(&j);
    if (!st) st = chain(&j);
    if (!st) st = set_places(&j);
    tl_mem_free(ctx, j.is_taken);
    tl_mem_free(ctx, j.firsts);
    tl_mem_free(ctx, j.ends);
    tl_mem_free(ctx, j.ids);
    tl_mem_free(ctx, j.segments);
    tl_mem_free(ctx, j.facings);
    if (st)
        tl_polydata_destroy(ctx, j.out);
    else
        *lines = j.out;
    return st;
}
