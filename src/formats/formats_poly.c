/* Polyhedra to tets. A face is cut by a rule that sees the face alone; then any corner works as the
 * top of all tets whose own faces are all cut from it, which the corner of the smallest id always
 * is where faces are cut from theirs. Which direction a face runs in is no promise of the formats:
 * it is found here, over the edges, each of which two faces must share. */
#include "formats/formats_poly.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/base_predicates.h"
#include "base/base_vec.h"

/* Corners that are tried as the top before a new vertex is made. */
#define APEX_TRIES 8
/* A triangle of a face counts as flat below this part of the area of the face. */
#define FLAT_PART 1e-9
/* A hole in a polyhedron is closed if its area is at least this part of the square of its edges. */
#define HOLE_PART 1e-4
/* Corners that are looked at for it. */
#define APEX_LOOKS 64
/* Relative to the lengths of the rows of a matrix: the determinant of one that is no use. */
#define SINGULAR 1e-12
/* Moves on the way to a point that sees all faces; the distance from them that is tried for is a
 * part of the edge of a cube of the same volume, halved every so many moves. */
#define CENTRE_MOVES 400
#define CENTRE_MOVES_EACH 50
#define CENTRE_MARGIN 0.05
/* Corners a face has at most for another corner than the smallest to be looked for. */
#define FAN_CORNERS_MAX 256

/* An edge of a face: low < high. */
typedef struct tli_poly_edge {
    tl_lidx low, high;
    size_t face;
    bool forward; /* the face runs from low to high */
} tli_poly_edge;

/* An edge that one face has alone, as one of its ends sees it. */
typedef struct tli_poly_half {
    tl_lidx from, to;
    bool used;
} tli_poly_half;

/* ---- scratch ---- */

void tli_poly_open(tl_ctx *ctx, tli_poly *poly)
{
    *poly = (tli_poly){.ctx = ctx};
}

void tli_poly_close(tli_poly *poly)
{
    tl_ctx *ctx = poly->ctx;
    tl_mem_free(ctx, poly->queue);
    tl_mem_free(ctx, poly->turns);
    tl_mem_free(ctx, poly->halves);
    tl_mem_free(ctx, poly->edges);
    tl_mem_free(ctx, poly->weights);
    tl_mem_free(ctx, poly->verts);
    tl_mem_free(ctx, poly->tets);
    tl_mem_free(ctx, poly->triangle_faces);
    tl_mem_free(ctx, poly->triangles);
    tl_mem_free(ctx, poly->ends);
    tl_mem_free(ctx, poly->ids);
    *poly = (tli_poly){0};
}

/* Room for count elements: at least doubles, so that a run of cells asks seldom. */
static void *room_for(tl_ctx *ctx, void *block, size_t *room, size_t count, size_t elem_bytes,
                      tl_status *st)
{
    if (*st || count <= *room) return block;
    size_t wanted = count < 64 ? 64 : count + count / 2;
    block = tl_mem_resize(ctx, block, wanted, elem_bytes, st);
    if (!*st) *room = wanted;
    return block;
}

void tli_poly_begin(tli_poly *poly)
{
    poly->id_count = poly->face_count = 0;
    poly->triangle_count = poly->tet_count = poly->vert_count = 0;
}

tl_status tli_poly_face(tli_poly *poly, const uint32_t *ids, size_t count)
{
    tl_status st = TL_OK;
    size_t begin = poly->id_count, kept = begin;
    poly->ids =
        room_for(poly->ctx, poly->ids, &poly->id_room, begin + count, sizeof *poly->ids, &st);
    poly->ends = room_for(poly->ctx, poly->ends, &poly->face_room, poly->face_count + 1,
                          sizeof *poly->ends, &st);
    if (st) return st;
    for (size_t i = 0; i < count; i++)
        if (kept == begin || poly->ids[kept - 1] != ids[i]) poly->ids[kept++] = ids[i];
    while (kept > begin + 1 && poly->ids[kept - 1] == poly->ids[begin]) kept--;
    if (kept < begin + 3) return TL_OK;
    poly->id_count = kept;
    poly->ends[poly->face_count++] = kept;
    return TL_OK;
}

/* ---- faces to triangles ---- */

/* The corner i places behind first, forwards or backwards. */
static size_t corner_at(size_t first, size_t i, size_t count, bool forwards)
{
    return forwards ? (first + i) % count : (first + count - i % count) % count;
}

/* Twice the area of the triangle a b c, as a vector. */
static void triangle_normal(const double *a, const double *b, const double *c, double n[3])
{
    double u[3], v[3];
    vec_sub(b, a, u);
    vec_sub(c, a, v);
    vec_cross(u, v, n);
}

/* The triangles from one corner all face the way that the face as a whole does. */
static bool fan_is_good(const double *xyz, const tl_lidx *ids, size_t count, size_t first,
                        const double whole[3])
{
    double area = vec_dot(whole, whole);
    for (size_t i = 1; i + 1 < count; i++) {
        double n[3];
        triangle_normal(xyz + 3 * (size_t)ids[first], xyz + 3 * (size_t)ids[(first + i) % count],
                        xyz + 3 * (size_t)ids[(first + i + 1) % count], n);
        if (!(vec_dot(n, whole) > FLAT_PART * area)) return false;
    }
    return true;
}

/* Where the fan of a face begins. The face is looked at from its smallest corner towards the
 * smaller of that one's neighbours, whichever cell asks, so that both compute the same numbers.
 * Returns a place in ids. */
static size_t fan_corner(const double *xyz, const tl_lidx *ids, size_t count)
{
    tl_lidx turned[FAN_CORNERS_MAX];
    size_t low = 0;
    for (size_t i = 1; i < count; i++)
        if (ids[i] < ids[low]) low = i;
    if (count <= 4 || count > FAN_CORNERS_MAX) return low;
    bool forwards = ids[(low + 1) % count] < ids[(low + count - 1) % count];
    for (size_t i = 0; i < count; i++) turned[i] = ids[corner_at(low, i, count, forwards)];
    double whole[3] = {0, 0, 0};
    for (size_t i = 1; i + 1 < count; i++) {
        double n[3];
        triangle_normal(xyz + 3 * (size_t)turned[0], xyz + 3 * (size_t)turned[i],
                        xyz + 3 * (size_t)turned[i + 1], n);
        for (int k = 0; k < 3; k++) whole[k] += n[k];
    }
    for (size_t i = 0; i < count; i++)
        if (fan_is_good(xyz, turned, count, i, whole)) return corner_at(low, i, count, forwards);
    return low;
}

void tli_poly_cut_face(const double *xyz, const tl_lidx *ids, size_t count, tl_lidx (*triangles)[3])
{
    size_t first = fan_corner(xyz, ids, count);
    for (size_t i = 1; i + 1 < count; i++) {
        triangles[i - 1][0] = ids[first];
        triangles[i - 1][1] = ids[(first + i) % count];
        triangles[i - 1][2] = ids[(first + i + 1) % count];
    }
}

static tl_status cut_faces(tli_poly *poly, const double *xyz)
{
    tl_status st = TL_OK;
    size_t room = poly->triangle_room;
    poly->triangles =
        room_for(poly->ctx, poly->triangles, &room, poly->id_count, sizeof *poly->triangles, &st);
    poly->triangle_faces = room_for(poly->ctx, poly->triangle_faces, &poly->triangle_room,
                                    poly->id_count, sizeof *poly->triangle_faces, &st);
    if (st) return st;
    for (size_t f = 0, begin = 0; f < poly->face_count; begin = poly->ends[f++]) {
        size_t count = poly->ends[f] - begin;
        tli_poly_cut_face(xyz, poly->ids + begin, count, poly->triangles + poly->triangle_count);
        for (size_t i = 0; i + 2 < count; i++) poly->triangle_faces[poly->triangle_count++] = f;
    }
    return TL_OK;
}

/* False if a face passes a corner twice. */
static bool triangles_are_simple(const tli_poly *poly)
{
    for (size_t i = 0; i < poly->triangle_count; i++) {
        const tl_lidx *t = poly->triangles[i];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
    }
    return true;
}

/* ---- directions of faces ---- */

static int compare_edges(const void *a, const void *b)
{
    const tli_poly_edge *x = a, *y = b;
    if (x->low != y->low) return x->low < y->low ? -1 : 1;
    if (x->high != y->high) return x->high < y->high ? -1 : 1;
    return x->face < y->face ? -1 : x->face > y->face;
}

static void list_edges(tli_poly *poly)
{
    size_t edge = 0;
    for (size_t f = 0, begin = 0; f < poly->face_count; begin = poly->ends[f++])
        for (size_t i = begin; i < poly->ends[f]; i++) {
            tl_lidx a = poly->ids[i], b = poly->ids[i + 1 < poly->ends[f] ? i + 1 : begin];
            poly->edges[edge++] = (tli_poly_edge){a < b ? a : b, a < b ? b : a, f, a < b};
        }
    qsort(poly->edges, poly->id_count, sizeof *poly->edges, compare_edges);
}

static bool same_edge(const tli_poly_edge *a, const tli_poly_edge *b)
{
    return a->low == b->low && a->high == b->high;
}

/* The place of the edge a b of face f. */
static size_t find_edge(const tli_poly *poly, tl_lidx a, tl_lidx b, size_t f)
{
    const tli_poly_edge wanted = {a < b ? a : b, a < b ? b : a, f, false};
    size_t low = 0, high = poly->id_count;
    while (high - low > 1) {
        size_t middle = low + (high - low) / 2;
        if (compare_edges(&poly->edges[middle], &wanted) <= 0)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Every edge is there twice, in two faces. */
static bool edges_pair_up(const tli_poly *poly)
{
    const tli_poly_edge *edges = poly->edges;
    if (poly->id_count % 2) return false;
    for (size_t i = 0; i < poly->id_count; i += 2)
        if (!same_edge(&edges[i], &edges[i + 1]) || edges[i].face == edges[i + 1].face ||
            (i && same_edge(&edges[i], &edges[i - 1])))
            return false;
    return true;
}

/* ---- holes ---- */

static int compare_halves(const void *a, const void *b)
{
    const tli_poly_half *x = a, *y = b;
    if (x->from != y->from) return x->from < y->from ? -1 : 1;
    return (x->to > y->to) - (x->to < y->to);
}

/* Lists the edges that one face has alone, from both ends. *count 0 if there are none, or if an
 * end has other than two of them, or if another edge has more than two faces. */
static tl_status list_halves(tli_poly *poly, size_t *count)
{
    tl_status st = TL_OK;
    size_t used = 0;
    *count = 0;
    poly->halves = room_for(poly->ctx, poly->halves, &poly->half_room, 2 * poly->id_count,
                            sizeof *poly->halves, &st);
    for (size_t i = 0, end; !st && i < poly->id_count; i = end) {
        const tli_poly_edge *edge = &poly->edges[i];
        for (end = i + 1; end < poly->id_count && same_edge(edge, &poly->edges[end]);) end++;
        if (end - i > 2) return TL_OK;
        if (end - i == 2) continue;
        poly->halves[used++] = (tli_poly_half){edge->low, edge->high, false};
        poly->halves[used++] = (tli_poly_half){edge->high, edge->low, false};
    }
    if (st || !used) return st;
    qsort(poly->halves, used, sizeof *poly->halves, compare_halves);
    for (size_t i = 0; i < used; i += 2)
        if (poly->halves[i].from != poly->halves[i + 1].from ||
            (i && poly->halves[i].from == poly->halves[i - 1].from))
            return TL_OK;
    *count = used;
    return TL_OK;
}

/* The loop that begins with a half edge goes to loop; returns its length. */
static size_t walk_hole(tli_poly *poly, size_t half_count, size_t first, tl_lidx *loop)
{
    size_t length = 0;
    for (size_t at = first; !poly->halves[at].used;) {
        const tli_poly_half wanted = {poly->halves[at].to, poly->halves[at].from, false};
        poly->halves[at].used = true;
        loop[length++] = poly->halves[at].from;
        tli_poly_half *back =
            bsearch(&wanted, poly->halves, half_count, sizeof wanted, compare_halves);
        back->used = true; /* each edge goes into one loop, in one direction */
        at = (size_t)(back - poly->halves) ^ 1;
    }
    return length;
}

/* The loop goes around something: it is not a long edge beside the short ones of others. */
static bool hole_is_wide(const double *xyz, const tl_lidx *loop, size_t count)
{
    double whole[3] = {0, 0, 0}, around = 0;
    for (size_t i = 0; i < count; i++) {
        double n[3], edge[3];
        const double *p = xyz + 3 * (size_t)loop[i], *q = xyz + 3 * (size_t)loop[(i + 1) % count];
        triangle_normal(xyz + 3 * (size_t)loop[0], p, q, n);
        vec_sub(q, p, edge);
        around += vec_length(edge);
        for (int k = 0; k < 3; k++) whole[k] += n[k];
    }
    return vec_length(whole) > HOLE_PART * around * around;
}

/* Adds the faces that are missing. */
static tl_status close_holes(tli_poly *poly, const double *xyz)
{
    size_t halves;
    tl_status st = list_halves(poly, &halves);
    tl_lidx *loop = NULL;
    if (!st && halves) loop = tl_mem_alloc(poly->ctx, halves, sizeof *loop, &st);
    for (size_t i = 0; !st && i < halves; i++) {
        if (poly->halves[i].used) continue;
        size_t length = walk_hole(poly, halves, i, loop);
        if (length < 3 || !hole_is_wide(xyz, loop, length)) continue;
        st = tli_poly_face(poly, loop, length);
        poly->closed = true;
    }
    tl_mem_free(poly->ctx, loop);
    return st;
}

/* Turns faces until all run in the same sense as face 0. False if they can't, or if some can't be
 * reached. */
static bool align_faces(tli_poly *poly)
{
    size_t head = 0, tail = 0;
    memset(poly->turns, 0, poly->face_count);
    poly->turns[0] = 1;
    poly->queue[tail++] = 0;
    while (head < tail) {
        size_t f = poly->queue[head++], begin = f ? poly->ends[f - 1] : 0;
        for (size_t i = begin; i < poly->ends[f]; i++) {
            tl_lidx a = poly->ids[i], b = poly->ids[i + 1 < poly->ends[f] ? i + 1 : begin];
            size_t at = find_edge(poly, a, b, f);
            const tli_poly_edge *mine = &poly->edges[at], *other = &poly->edges[at ^ 1];
            uint8_t turn =
                (uint8_t)(mine->forward == other->forward ? 3 - poly->turns[f] : poly->turns[f]);
            if (!poly->turns[other->face]) {
                poly->turns[other->face] = turn;
                poly->queue[tail++] = other->face;
            } else if (poly->turns[other->face] != turn) {
                return false;
            }
        }
    }
    return tail == poly->face_count;
}

/* Six times the volume within the triangles, seen from the centre. */
static double enclosed(const tli_poly *poly, const double *xyz)
{
    double sum = 0;
    for (size_t i = 0; i < poly->triangle_count; i++) {
        const tl_lidx *t = poly->triangles[i];
        sum += tli_orient3d_approx(poly->centre, xyz + 3 * (size_t)t[0], xyz + 3 * (size_t)t[1],
                                   xyz + 3 * (size_t)t[2]);
    }
    return sum;
}

static void turn_triangle(tl_lidx t[3])
{
    tl_lidx swap = t[1];
    t[1] = t[2];
    t[2] = swap;
}

/* Makes (centre, triangle) positive for a convex cell. */
static void turn_outward(tli_poly *poly, const double *xyz)
{
    for (size_t i = 0; i < poly->triangle_count; i++)
        if (poly->turns[poly->triangle_faces[i]] == 2) turn_triangle(poly->triangles[i]);
    if (enclosed(poly, xyz) < 0)
        for (size_t i = 0; i < poly->triangle_count; i++) turn_triangle(poly->triangles[i]);
}

/* ---- corners ---- */

static int compare_ids(const void *a, const void *b)
{
    tl_lidx x = *(const tl_lidx *)a, y = *(const tl_lidx *)b;
    return (x > y) - (x < y);
}

static void list_corners(tli_poly *poly, const double *xyz)
{
    memcpy(poly->verts, poly->ids, poly->id_count * sizeof *poly->ids);
    qsort(poly->verts, poly->id_count, sizeof *poly->verts, compare_ids);
    for (size_t i = 0; i < poly->id_count; i++)
        if (!poly->vert_count || poly->verts[poly->vert_count - 1] != poly->verts[i])
            poly->verts[poly->vert_count++] = poly->verts[i];
    for (int k = 0; k < 3; k++) {
        double sum = 0;
        for (size_t i = 0; i < poly->vert_count; i++)
            sum += xyz[3 * (size_t)poly->verts[i] + (size_t)k];
        poly->centre[k] = sum / (double)poly->vert_count;
    }
}

static bool has_corner(const tl_lidx t[3], tl_lidx v)
{
    return t[0] == v || t[1] == v || t[2] == v;
}

/* Every face that has the corner is cut from it: its triangles all have it. */
static bool can_be_apex(const tli_poly *poly, tl_lidx v)
{
    for (size_t i = 0; i < poly->triangle_count;) {
        size_t face = poly->triangle_faces[i], with = 0, all = 0;
        bool on_face = false;
        for (; i < poly->triangle_count && poly->triangle_faces[i] == face; i++, all++)
            with += has_corner(poly->triangles[i], v);
        size_t begin = face ? poly->ends[face - 1] : 0;
        for (size_t j = begin; j < poly->ends[face] && with != all; j++)
            on_face = on_face || poly->ids[j] == v;
        if (on_face) return false;
    }
    return true;
}

/* ---- tets ---- */

/* The tets from a corner; false as soon as one is not positive, where that is asked for. */
static bool tets_from(tli_poly *poly, const double *xyz, tl_lidx apex, const double *apex_xyz,
                      bool must_be_positive)
{
    poly->tet_count = 0;
    for (size_t i = 0; i < poly->triangle_count; i++) {
        const tl_lidx *t = poly->triangles[i];
        if (has_corner(t, apex)) continue;
        if (must_be_positive && tli_orient3d(apex_xyz, xyz + 3 * (size_t)t[0],
                                             xyz + 3 * (size_t)t[1], xyz + 3 * (size_t)t[2]) <= 0)
            return false;
        tl_lidx *tet = poly->tets[poly->tet_count++];
        tet[0] = apex, tet[1] = t[0], tet[2] = t[1], tet[3] = t[2];
    }
    return poly->tet_count > 0;
}

/* ---- the new vertex ---- */

/* How far inside the triangle's plane the centre is, and its outward normal of length 1. */
static double depth_below(const tli_poly *poly, const double *xyz, size_t triangle, double n[3])
{
    const tl_lidx *t = poly->triangles[triangle];
    const double *a = xyz + 3 * (size_t)t[0];
    double d[3];
    triangle_normal(a, xyz + 3 * (size_t)t[1], xyz + 3 * (size_t)t[2], n);
    double length = vec_length(n);
    if (!(length > 0)) return (double)INFINITY; /* sees nothing, hides nothing */
    for (int k = 0; k < 3; k++) n[k] /= length;
    vec_sub(a, poly->centre, d);
    return vec_dot(n, d);
}

/* Moves the centre away from the plane that hides most, until none does or the moves are used up.
 */
static void move_centre(tli_poly *poly, const double *xyz, tl_lidx centre_id)
{
    double margin = CENTRE_MARGIN * cbrt(fabs(enclosed(poly, xyz)) / 6);
    for (int move = 1; move <= CENTRE_MOVES; move++) {
        double least = (double)INFINITY, n[3], away[3] = {0, 0, 0};
        for (size_t i = 0; i < poly->triangle_count; i++) {
            double depth = depth_below(poly, xyz, i, n);
            if (depth >= least) continue;
            least = depth;
            memcpy(away, n, sizeof away);
        }
        for (int k = 0; k < 3; k++) poly->centre[k] -= (margin - least) * away[k];
        if (tets_from(poly, xyz, centre_id, poly->centre, true)) return;
        if (move % CENTRE_MOVES_EACH == 0) margin /= 2;
    }
}

/* Solves the symmetric m x = b; false if m is singular. */
static bool solve_three(const double m[3][3], const double b[3], double x[3])
{
    double c[3][3];
    vec_cross(m[1], m[2], c[0]);
    vec_cross(m[2], m[0], c[1]);
    vec_cross(m[0], m[1], c[2]);
    double det = vec_dot(m[0], c[0]);
    double size = vec_length(m[0]) * vec_length(m[1]) * vec_length(m[2]);
    if (!(fabs(det) > SINGULAR * size)) return false;
    for (int k = 0; k < 3; k++) x[k] = (b[0] * c[0][k] + b[1] * c[1][k] + b[2] * c[2][k]) / det;
    return true;
}

/* Weights of the corners for a centre that is not their mean: those of the linear function that
 * fits best, so that linear fields stay exact. */
static void weigh_corners(tli_poly *poly, const double *xyz, const double mean[3])
{
    double m[3][3] = {{0}}, off[3], x[3];
    for (size_t i = 0; i < poly->vert_count; i++) {
        double d[3];
        vec_sub(xyz + 3 * (size_t)poly->verts[i], mean, d);
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++) m[r][c] += d[r] * d[c];
    }
    vec_sub(poly->centre, mean, off);
    bool solved = solve_three((const double(*)[3])m, off, x);
    for (size_t i = 0; i < poly->vert_count; i++) {
        double d[3];
        vec_sub(xyz + 3 * (size_t)poly->verts[i], mean, d);
        poly->weights[i] = 1 / (double)poly->vert_count + (solved ? vec_dot(d, x) : 0);
    }
}

static bool is_finite(const tli_poly *poly, const double *xyz)
{
    for (size_t i = 0; i < poly->vert_count; i++)
        if (!vec_is_finite(xyz + 3 * (size_t)poly->verts[i])) return false;
    return vec_is_finite(poly->centre);
}

static tl_status reserve(tli_poly *poly)
{
    tl_status st = TL_OK;
    size_t turns = poly->turn_room;
    poly->edges = room_for(poly->ctx, poly->edges, &poly->edge_room, poly->id_count,
                           sizeof *poly->edges, &st);
    poly->verts = room_for(poly->ctx, poly->verts, &poly->vert_room, poly->id_count,
                           sizeof *poly->verts, &st);
    poly->weights = room_for(poly->ctx, poly->weights, &poly->weight_room, poly->id_count,
                             sizeof *poly->weights, &st);
    poly->tets =
        room_for(poly->ctx, poly->tets, &poly->tet_room, poly->id_count, sizeof *poly->tets, &st);
    poly->turns = room_for(poly->ctx, poly->turns, &turns, poly->face_count, 1, &st);
    poly->queue = room_for(poly->ctx, poly->queue, &poly->turn_room, poly->face_count,
                           sizeof *poly->queue, &st);
    return st;
}

tl_status tli_poly_split(tli_poly *poly, const double *xyz, tl_lidx centre_id, tli_poly_kind *kind)
{
    *kind = TLI_POLY_NONE;
    if (poly->face_count < 4) return TL_OK;
    tl_status st = reserve(poly);
    if (st) return st;
    list_edges(poly);
    poly->closed = false;
    if (!edges_pair_up(poly)) {
        st = close_holes(poly, xyz);
        if (st || !poly->closed || (st = reserve(poly))) return st;
        list_edges(poly);
    }
    if (!edges_pair_up(poly) || !align_faces(poly)) return TL_OK;
    st = cut_faces(poly, xyz);
    if (st || !triangles_are_simple(poly)) return st;
    list_corners(poly, xyz);
    if (!is_finite(poly, xyz)) { /* no sign means anything */
        tets_from(poly, xyz, poly->verts[0], NULL, false);
        *kind = TLI_POLY_APEX;
        return TL_OK;
    }
    turn_outward(poly, xyz);
    for (size_t i = 0, tries = 0; i < poly->vert_count && i < APEX_LOOKS && tries < APEX_TRIES;
         i++) {
        tl_lidx apex = poly->verts[i];
        if (!can_be_apex(poly, apex)) continue;
        tries++;
        if (!tets_from(poly, xyz, apex, xyz + 3 * (size_t)apex, true)) continue;
        *kind = TLI_POLY_APEX;
        return TL_OK;
    }
    double mean[3] = {poly->centre[0], poly->centre[1], poly->centre[2]};
    if (!tets_from(poly, xyz, centre_id, poly->centre, true)) move_centre(poly, xyz, centre_id);
    if (!tets_from(poly, xyz, centre_id, poly->centre, true))
        memcpy(poly->centre, mean, sizeof mean);
    tets_from(poly, xyz, centre_id, poly->centre, false);
    weigh_corners(poly, xyz, mean);
    *kind = TLI_POLY_CENTRE;
    return TL_OK;
}
