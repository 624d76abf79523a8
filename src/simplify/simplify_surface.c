/* Which faces have to be kept (boundary, interfaces between regions), how free that leaves each
 * vertex, and which vertices must not be touched at all. */
#include <math.h>
#include <string.h>

#include "base/base_predicates.h"
#include "base/base_sort.h"
#include "base/base_vec.h"
#include "mesh/mesh.h"
#include "mesh/mesh_edge.h"
#include "simplify/simplify_work.h"

/* A boundary edge is sharp when its two faces bend by more than this (radians). */
static const double SHARP_ANGLE = 0.7;

typedef struct face_job {
    tli_work *work;
    const tl_lidx *opposite;
    const uint8_t *cut; /* [input vertices] or NULL: vertices at which a piece was cut out */
} face_job;

/* A face that was inside before the piece was cut out, or one that can't change any more. */
static bool is_cut(const tli_work *w, const uint8_t *cut, const tl_lidx *tet, unsigned face)
{
    for (int i = 0; cut && i < 3; i++)
        if (!cut[w->verts[tet[tli_tet_faces[face][i]]].origin]) return false;
    return cut != NULL;
}

/* Sets the face bits. */
static tl_status mark_faces(void *arg, size_t begin, size_t end, unsigned worker)
{
    face_job *job = arg;
    tli_work *w = job->work;
    (void)worker;
    for (size_t t = begin; t < end; t++)
        for (unsigned f = 0; f < 4; f++) {
            tl_lidx o = job->opposite[4 * t + f];
            bool boundary = o == TL_NONE;
            if (!boundary && (!w->regions || w->regions[t] == w->regions[o >> 2])) continue;
            unsigned surface = is_cut(w, job->cut, w->tets[t], f) ? 0 : 1u << f;
            w->faces[t] |= (uint8_t)(surface | (boundary ? 16u << f : 0u));
        }
    return TL_OK;
}

/* Lists the surface faces; an interface face comes from its lower region. */
static tl_status list_faces(tli_work *w, const tl_lidx *opposite, const uint8_t *cut)
{
    face_job job = {w, opposite, cut};
    tl_status st = tli_parallel(w->ctx, w->tet_count, 16384, mark_faces, &job);
    size_t capacity = 0;
    for (size_t t = 0; !st && t < w->tet_count; t++)
        for (unsigned f = 0; w->faces[t] && f < 4; f++) {
            tl_lidx o = opposite[4 * t + f];
            if (!(w->faces[t] & 1u << f)) continue;
            if (o != TL_NONE) w->has_surfaces_inside = true;
            if (o != TL_NONE && w->regions[t] > w->regions[o >> 2]) continue;
            if (w->surface_count == capacity) {
                capacity = capacity ? capacity * 2 : 4096;
                w->surface = tl_mem_resize(w->ctx, w->surface, capacity, sizeof *w->surface, &st);
                if (st) return st;
            }
            for (int i = 0; i < 3; i++)
                w->surface[w->surface_count][i] = w->tets[t][tli_tet_faces[f][i]];
            w->surface_count++;
        }
    return st;
}

static void freeze(tli_work *w, tl_lidx v)
{
    w->verts[v].kind = TLI_FROZEN;
}

/* True if the face shows the same side from both tets: they overlap, or are the same tet twice. */
static bool face_folds(const tl_lidx t[4], unsigned face, const tl_lidx o[4], unsigned other)
{
    const uint8_t *p = tli_tet_faces[face], *q = tli_tet_faces[other];
    unsigned i = 0;
    while (i < 2 && o[q[i]] != t[p[0]]) i++;
    return o[q[(i + 1) % 3]] == t[p[1]];
}

typedef struct bad_job {
    const tli_work *work;
    const tl_lidx *opposite;
    uint8_t *bad;
} bad_job;

static bool has_values(const tli_work *w, tl_lidx v)
{
    const double *row = w->values + v * w->components;
    for (size_t i = 0; i < w->components; i++)
        if (!isfinite(row[i])) return false;
    return true;
}

/* Flat, turned and infinite tets, those that lie on a neighbour, and those with a corner without a
 * value: if they grew, places that have values would lose them. */
static tl_status find_bad_tets(void *arg, size_t begin, size_t end, unsigned worker)
{
    bad_job *job = arg;
    const tli_work *w = job->work;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = w->tets[t];
        const double *p[4];
        bool fine = true;
        for (int i = 0; i < 4; i++) p[i] = w->verts[q[i]].xyz;
        for (int i = 0; i < 4; i++) fine = fine && isfinite(p[i][0] + p[i][1] + p[i][2]);
        for (int i = 0; i < 4; i++) fine = fine && has_values(w, q[i]);
        fine = fine && tli_orient3d(p[0], p[1], p[2], p[3]) > 0;
        for (unsigned f = 0; fine && f < 4; f++) {
            tl_lidx o = job->opposite[4 * t + f];
            fine = o == TL_NONE || !face_folds(q, f, w->tets[o >> 2], o & 3);
        }
        job->bad[t] = !fine;
    }
    return TL_OK;
}

static tl_status freeze_bad_tets(tli_work *w, const tl_lidx *opposite)
{
    tl_status st = TL_OK;
    bad_job job = {w, opposite, tl_mem_alloc(w->ctx, w->tet_count, 1, &st)};
    if (!st) st = tli_parallel(w->ctx, w->tet_count, 8192, find_bad_tets, &job);
    for (size_t t = 0; !st && t < w->tet_count; t++)
        for (int i = 0; job.bad[t] && i < 4; i++) freeze(w, w->tets[t][i]);
    tl_mem_free(w->ctx, job.bad);
    return st;
}

/* The edges of all surface faces, sorted: equal ones are neighbours. */
typedef struct edge_list {
    uint64_t *keys;  /* tli_edge_key */
    uint32_t *faces; /* surface face */
    size_t count;
} edge_list;

static tl_status list_edges(tli_work *w, edge_list *edges)
{
    tl_status st = TL_OK;
    edges->count = 3 * w->surface_count;
    edges->keys = tl_mem_alloc(w->ctx, edges->count, sizeof *edges->keys, &st);
    edges->faces = tl_mem_alloc(w->ctx, edges->count, sizeof *edges->faces, &st);
    for (size_t s = 0; !st && s < w->surface_count; s++)
        for (int i = 0; i < 3; i++) {
            edges->keys[3 * s + (size_t)i] =
                tli_edge_key(w->surface[s][i], w->surface[s][(i + 1) % 3]);
            edges->faces[3 * s + (size_t)i] = (uint32_t)s;
        }
    if (!st) st = tli_sort_u64(w->ctx, edges->keys, edges->faces, edges->count);
    return st;
}

/* Unit normals of all surface faces, 0 where there is none. */
typedef struct normal_job {
    const tli_work *work;
    double (*normals)[3];
} normal_job;

static void face_normal(const tli_work *w, size_t s, double n[3])
{
    const double *a = w->verts[w->surface[s][0]].xyz, *b = w->verts[w->surface[s][1]].xyz,
                 *c = w->verts[w->surface[s][2]].xyz;
    double u[3], v[3];
    vec_sub(b, a, u);
    vec_sub(c, a, v);
    vec_cross(u, v, n);
    double l = vec_length(n);
    for (int i = 0; i < 3; i++) n[i] = l > 0 ? n[i] / l : 0;
}

static tl_status set_normals(void *arg, size_t begin, size_t end, unsigned worker)
{
    const normal_job *job = arg;
    (void)worker;
    for (size_t s = begin; s < end; s++) face_normal(job->work, s, job->normals[s]);
    return TL_OK;
}

static tl_status add_sharp(tli_work *w, uint64_t key, size_t *capacity)
{
    tl_status st = TL_OK;
    if (w->sharp_count == *capacity) {
        *capacity = *capacity ? 2 * *capacity : 256;
        w->sharp = tl_mem_resize(w->ctx, w->sharp, *capacity, sizeof *w->sharp, &st);
        if (st) return st;
    }
    w->sharp[w->sharp_count][0] = (tl_lidx)(key >> 32);
    w->sharp[w->sharp_count][1] = (tl_lidx)key;
    w->sharp_count++;
    return TL_OK;
}

/* Counts at every vertex the curve edges (other than two surface faces), lists sharp edges, freezes
 * edges with other than two boundary faces. boundary [surface_count]: the face has one tet. */
static tl_status classify_edges(tli_work *w, const edge_list *edges, const uint8_t *boundary,
                                const uint8_t *cut, uint8_t *curve_degree)
{
    tl_status st = TL_OK;
    size_t capacity = 0;
    const double least = cos(SHARP_ANGLE);
    normal_job job = {w, tl_mem_alloc(w->ctx, w->surface_count, sizeof *job.normals, &st)};
    if (!st) st = tli_parallel(w->ctx, w->surface_count, 2048, set_normals, &job);
    for (size_t i = 0, end; !st && i < edges->count; i = end) {
        size_t boundary_faces = 0;
        for (end = i; end < edges->count && edges->keys[end] == edges->keys[i]; end++)
            boundary_faces += boundary[edges->faces[end]];
        tl_lidx a = (tl_lidx)(edges->keys[i] >> 32), b = (tl_lidx)edges->keys[i];
        bool whole = !cut || !cut[w->verts[a].origin] || !cut[w->verts[b].origin];
        if (whole && boundary_faces != 0 && boundary_faces != 2) {
            freeze(w, a);
            freeze(w, b);
        }
        if (end - i != 2) {
            if (curve_degree[a] < 3) curve_degree[a]++;
            if (curve_degree[b] < 3) curve_degree[b]++;
            continue;
        }
        const double *n0 = job.normals[edges->faces[i]], *n1 = job.normals[edges->faces[i + 1]];
        if (vec_dot(n0, n1) < least) st = add_sharp(w, edges->keys[i], &capacity);
    }
    tl_mem_free(w->ctx, job.normals);
    return st;
}

/* A face listed twice is a face of more than two tets, or a doubled tet. */
static tl_status freeze_doubled_faces(tli_work *w)
{
    tl_status st = TL_OK;
    uint64_t *keys = tl_mem_alloc(w->ctx, w->surface_count, sizeof *keys, &st);
    uint32_t *ids = tl_mem_alloc(w->ctx, w->surface_count, sizeof *ids, &st);
    for (size_t s = 0; !st && s < w->surface_count; s++) {
        const tl_lidx *q = w->surface[s];
        uint64_t lo = q[0] < q[1] ? q[0] : q[1], hi = q[0] < q[1] ? q[1] : q[0];
        uint64_t least = q[2] < lo ? q[2] : lo, most = q[2] > hi ? q[2] : hi;
        keys[s] = least << 32 | most;
        ids[s] = (uint32_t)s;
    }
    if (!st) st = tli_sort_u64(w->ctx, keys, ids, w->surface_count);
    for (size_t i = 0; !st && i < w->surface_count; i++)
        for (size_t j = i + 1; j < w->surface_count && keys[j] == keys[i]; j++) {
            const tl_lidx *p = w->surface[ids[i]], *q = w->surface[ids[j]];
            if ((uint64_t)p[0] + p[1] + p[2] != (uint64_t)q[0] + q[1] + q[2]) continue;
            for (int k = 0; k < 3; k++) freeze(w, p[k]);
        }
    tl_mem_free(w->ctx, ids);
    tl_mem_free(w->ctx, keys);
    return st;
}

/* Number of fans that some faces form around vertex v: faces that share an edge at v belong
 * together. Quadratic in the number of faces, which is small. */
static size_t count_fans(const tli_work *w, const uint32_t *faces, size_t count, tl_lidx v,
                         uint32_t *group)
{
    size_t fans = count;
    for (size_t i = 0; i < count; i++) group[i] = (uint32_t)i;
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < i; j++) {
            const tl_lidx *p = w->surface[faces[i]], *q = w->surface[faces[j]];
            bool shared = false;
            for (int a = 0; a < 3; a++)
                for (int b = 0; b < 3; b++) shared = shared || (p[a] == q[b] && p[a] != v);
            if (!shared || group[i] == group[j]) continue;
            uint32_t from = group[i], to = group[j];
            for (size_t k = 0; k <= i; k++)
                if (group[k] == from) group[k] = to;
            fans--;
        }
    return fans;
}

/* Faces around a vertex past which it is frozen rather than looked at. */
enum { FAN_MAX = 256 };

static void classify_vertex(tli_work *w, tl_lidx v, const uint32_t *faces, size_t count,
                            const uint8_t *boundary, uint8_t curve_degree)
{
    uint32_t group[FAN_MAX], some[FAN_MAX];
    size_t n = 0;
    if (count == 0 || w->verts[v].kind == TLI_FROZEN) return;
    if (count > FAN_MAX) {
        freeze(w, v);
        return;
    }
    for (size_t i = 0; i < count; i++)
        if (boundary[faces[i]]) some[n++] = faces[i];
    if (count_fans(w, some, n, v, group) > 1)
        freeze(w, v);
    else if (curve_degree == 0)
        w->verts[v].kind =
            n == count || count_fans(w, faces, count, v, group) == 1 ? TLI_SURFACE : TLI_CORNER;
    else
        w->verts[v].kind = curve_degree == 2 ? TLI_CURVE : TLI_CORNER;
}

/* Each vertex on its own. */
typedef struct class_job {
    tli_work *work;
    const uint32_t *offsets, *faces; /* surface faces by vertex */
    const uint8_t *boundary, *cut, *curve_degree;
} class_job;

static tl_status classify_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const class_job *job = arg;
    (void)worker;
    for (size_t v = begin; v < end; v++)
        if (!job->cut || !job->cut[job->work->verts[v].origin])
            classify_vertex(job->work, (tl_lidx)v, job->faces + job->offsets[v],
                            job->offsets[v + 1] - job->offsets[v], job->boundary,
                            job->curve_degree[v]);
    return TL_OK;
}

/* Faces by vertex, then the classes. */
static tl_status classify_vertices(tli_work *w, const uint8_t *boundary, const uint8_t *cut,
                                   const uint8_t *curve_degree)
{
    tl_status st = TL_OK;
    uint32_t *offsets = tl_mem_zalloc(w->ctx, w->vert_count + 2, sizeof *offsets, &st);
    uint32_t *faces = tl_mem_alloc(w->ctx, 3 * w->surface_count, sizeof *faces, &st);
    if (!st) {
        for (size_t s = 0; s < w->surface_count; s++)
            for (int i = 0; i < 3; i++) offsets[w->surface[s][i] + 2]++;
        for (size_t v = 0; v < w->vert_count; v++) offsets[v + 2] += offsets[v + 1];
        for (size_t s = 0; s < w->surface_count; s++)
            for (int i = 0; i < 3; i++) faces[offsets[w->surface[s][i] + 1]++] = (uint32_t)s;
        class_job job = {w, offsets, faces, boundary, cut, curve_degree};
        st = tli_parallel(w->ctx, w->vert_count, 4096, classify_range, &job);
    }
    tl_mem_free(w->ctx, faces);
    tl_mem_free(w->ctx, offsets);
    return st;
}

/* boundary [surface_count] in the order of list_faces. */
static void mark_boundary(const tli_work *w, const tl_lidx *opposite, uint8_t *boundary)
{
    size_t s = 0;
    for (size_t t = 0; t < w->tet_count; t++)
        for (unsigned f = 0; w->faces[t] && f < 4; f++) {
            if (!(w->faces[t] & 1u << f)) continue;
            tl_lidx o = opposite[4 * t + f];
            if (o != TL_NONE && w->regions[t] > w->regions[o >> 2]) continue;
            boundary[s++] = o == TL_NONE;
        }
}

tl_status tli_work_find_surfaces(tli_work *w, const tl_lidx *opposite, size_t nonmanifold_faces,
                                 const uint8_t *locked, bool is_piece)
{
    const uint8_t *cut = is_piece ? locked : NULL;
    edge_list edges = {0};
    tl_status st = freeze_bad_tets(w, opposite);
    if (!st) st = list_faces(w, opposite, cut);
    uint8_t *boundary = tl_mem_alloc(w->ctx, w->surface_count, sizeof *boundary, &st);
    uint8_t *curve_degree = tl_mem_zalloc(w->ctx, w->vert_count, sizeof *curve_degree, &st);
    if (!st) mark_boundary(w, opposite, boundary);
    if (!st && nonmanifold_faces) st = freeze_doubled_faces(w);
    if (!st) st = list_edges(w, &edges);
    if (!st) st = classify_edges(w, &edges, boundary, cut, curve_degree);
    if (!st) st = classify_vertices(w, boundary, cut, curve_degree);
    for (size_t v = 0; !st && locked && v < w->vert_count; v++)
        if (locked[w->verts[v].origin] && w->verts[v].kind < TLI_CORNER)
            w->verts[v].kind = TLI_CORNER;
    tl_mem_free(w->ctx, edges.faces);
    tl_mem_free(w->ctx, edges.keys);
    tl_mem_free(w->ctx, curve_degree);
    tl_mem_free(w->ctx, boundary);
    return st;
}
