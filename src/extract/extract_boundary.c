/* The boundary of a mesh, and the interfaces between its regions, as a surface to be drawn. Corners
 * of triangles begin as vertices of their own and are joined over edges: over smooth ones for
 * normals, and where nothing that stands on tets differs for vertices. Parts of the surface that
 * meet in a vertex or in an edge of four triangles alone stay apart by that. */
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "base/base_vec.h"
#include "extract/extract.h"
#include "mesh/mesh.h"

enum { GRAIN = 4096 };

static const double DEGREE = 0.017453292519943295;

typedef struct job {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const tl_boundary_opts *opts;
    bool regions, own_corners; /* divide vertices by regions; at every triangle */
    const tl_lidx *opposite;   /* of interfaces */
    tl_lidx *triangles, *faces;
    size_t outer_count, count; /* of triangles: the boundary's, then those of interfaces */
    double (*normals)[3];      /* [count] */
    uint64_t *keys;
    uint32_t *sides;
    uint32_t *smooth, *joined; /* [3 * count]: of corners, trees that share normals, and vertices */
    uint32_t *firsts;          /* [vert_count] the first corner of a vertex of the result */
    tl_polydata *out;
} job;

/* ---- sides ---- */

typedef struct siding {
    const tl_lidx *triangles;
    uint64_t *keys;
    uint32_t *sides;
} siding;

static tl_status list_sides(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const siding *s = arg;
    for (size_t i = 3 * begin; i < 3 * end; i++) {
        tl_lidx a = s->triangles[i], b = s->triangles[tli_next_corner(i)];
        s->keys[i] = tli_edge_key(a, b);
        s->sides[i] = (uint32_t)i;
    }
    return TL_OK;
}

tl_status tli_sort_sides(tl_ctx *ctx, const tl_lidx *triangles, size_t triangle_count,
                         uint64_t **keys, uint32_t **sides)
{
    tl_status st = TL_OK;
    if (triangle_count > UINT32_MAX / 3)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "%zu triangles are too many for their edges",
                       triangle_count);
    siding s = {.triangles = triangles};
    s.keys = tl_mem_alloc(ctx, 3 * triangle_count, sizeof *s.keys, &st);
    s.sides = tl_mem_alloc(ctx, 3 * triangle_count, sizeof *s.sides, &st);
    if (!st) st = tli_parallel(ctx, triangle_count, GRAIN, list_sides, &s);
    if (!st) st = tli_sort_u64(ctx, s.keys, s.sides, 3 * triangle_count);
    if (st) {
        tl_mem_free(ctx, s.sides);
        tl_mem_free(ctx, s.keys);
        return st;
    }
    *keys = s.keys;
    *sides = s.sides;
    return TL_OK;
}

bool tli_triangle_normal(const double *xyz, const tl_lidx *corners, double out[3])
{
    double u[3], v[3];
    vec_sub(xyz + 3 * (size_t)corners[1], xyz + 3 * (size_t)corners[0], u);
    vec_sub(xyz + 3 * (size_t)corners[2], xyz + 3 * (size_t)corners[0], v);
    vec_cross(u, v, out);
    double length = vec_length(out);
    bool usable = length > 0 && isfinite(length);
    for (int k = 0; k < 3; k++) out[k] = usable ? out[k] / length : 0;
    return usable;
}

static tl_status set_triangle_normals(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t t = begin; t < end; t++)
        tli_triangle_normal(j->mesh->xyz, j->triangles + 3 * t, j->normals[t]);
    return TL_OK;
}

/* ---- corners that are one ---- */

static uint32_t root_of(uint32_t *trees, uint32_t corner)
{
    while (trees[corner] != corner) corner = trees[corner] = trees[trees[corner]];
    return corner;
}

/* The smaller root stays, so that roots come in the order of corners. */
static void join(uint32_t *trees, uint32_t a, uint32_t b)
{
    a = root_of(trees, a);
    b = root_of(trees, b);
    if (a < b)
        trees[b] = a;
    else
        trees[a] = b;
}

/* Joins the corners at both ends of two sides of one edge, which run against each other. */
static void join_sides(uint32_t *trees, uint32_t side, uint32_t other)
{
    join(trees, side, (uint32_t)tli_next_corner(other));
    join(trees, (uint32_t)tli_next_corner(side), other);
}

static double region_of(const job *j, size_t triangle)
{
    return j->mesh->regions[j->faces[triangle] / 4];
}

/* NaN: nothing is behind. */
static double region_behind(const job *j, size_t triangle)
{
    if (triangle < j->outer_count) return (double)NAN;
    return j->mesh->regions[j->opposite[j->faces[triangle]] / 4];
}

static bool same_regions(const job *j, size_t a, size_t b)
{
    const bool outer = a < j->outer_count;
    return region_of(j, a) == region_of(j, b) && outer == (b < j->outer_count) &&
           (outer || region_behind(j, a) == region_behind(j, b));
}

static void join_corners(const job *j)
{
    double least = j->opts->normals ? cos(j->opts->crease * DEGREE) : -2;
    for (size_t i = 0, end; i < 3 * j->count; i = end) {
        end = tli_same_keys(j->keys, i, 3 * j->count);
        uint32_t a = j->sides[i], b = j->sides[end - 1];
        if (end != i + 2 || j->triangles[a] == j->triangles[b]) continue;
        if (vec_dot(j->normals[a / 3], j->normals[b / 3]) < least) continue;
        join_sides(j->smooth, a, b);
        if (j->own_corners || (j->regions && !same_regions(j, a / 3, b / 3))) continue;
        join_sides(j->joined, a, b);
    }
}

/* The vertices of the result, in the order of their first corners. */
static tl_status number_corners(job *j)
{
    tl_status st = TL_OK;
    size_t count = 0;
    for (size_t i = 0; i < 3 * j->count; i++) count += root_of(j->joined, (uint32_t)i) == i;
    j->out->vert_count = count;
    j->out->corners = tl_mem_alloc(j->ctx, j->count, 3 * sizeof *j->out->corners, &st);
    j->firsts = tl_mem_alloc(j->ctx, count, sizeof *j->firsts, &st);
    if (st) return st;
    uint32_t next = 0;
    for (size_t i = 0; i < 3 * j->count; i++) {
        uint32_t root = root_of(j->joined, (uint32_t)i);
        if (root == i) j->firsts[next] = root;
        j->out->corners[i] = root == i ? next++ : j->out->corners[root];
    }
    return st;
}

/* ---- vertices ---- */

static double angle_at(const job *j, size_t corner)
{
    size_t next = tli_next_corner(corner), last = tli_next_corner(next);
    double u[3], v[3], n[3];
    const double *xyz = j->mesh->xyz, *at = xyz + 3 * (size_t)j->triangles[corner];
    vec_sub(xyz + 3 * (size_t)j->triangles[next], at, u);
    vec_sub(xyz + 3 * (size_t)j->triangles[last], at, v);
    vec_cross(u, v, n);
    return atan2(vec_length(n), vec_dot(u, v));
}

/* Sums at the roots of the smooth trees, in the order of the corners. */
static tl_status set_normals(job *j)
{
    tl_status st = TL_OK;
    double(*sums)[3] = tl_mem_zalloc(j->ctx, 3 * j->count, sizeof *sums, &st);
    j->out->normals = tl_mem_alloc(j->ctx, j->out->vert_count, 3 * sizeof *j->out->normals, &st);
    for (size_t i = 0; !st && i < 3 * j->count; i++) {
        double *sum = sums[root_of(j->smooth, (uint32_t)i)], angle = angle_at(j, i);
        for (int k = 0; k < 3 && isfinite(angle); k++) sum[k] += angle * j->normals[i / 3][k];
    }
    for (size_t v = 0; !st && v < j->out->vert_count; v++) {
        const double *sum = sums[root_of(j->smooth, j->firsts[v])];
        double length = vec_length(sum);
        for (size_t k = 0; k < 3; k++)
            j->out->normals[3 * v + k] = length > 0 ? (float)(sum[k] / length) : 0;
    }
    tl_mem_free(j->ctx, sums);
    return st;
}

static void set_places(const job *j)
{
    for (size_t v = 0; v < j->out->vert_count; v++)
        memcpy(j->out->xyz + 3 * v, j->mesh->xyz + 3 * (size_t)j->triangles[j->firsts[v]],
               3 * sizeof *j->out->xyz);
}

static tl_status carry_channel(job *j, const tl_channel *channel)
{
    tl_status st = TL_OK;
    size_t n = channel->components;
    double *values = tl_mem_alloc(j->ctx, j->out->vert_count, n * sizeof *values, &st);
    for (size_t v = 0; !st && v < j->out->vert_count; v++) {
        uint32_t corner = j->firsts[v];
        size_t elem = channel->on == TL_ON_TET ? j->faces[corner / 3] / 4 : j->triangles[corner];
        memcpy(values + n * v, channel->values + n * elem, n * sizeof *values);
    }
    tl_channel own = *channel;
    own.on = TL_ON_VERTEX;
    own.values = values;
    if (!st) st = tl_polydata_adopt_channel(j->ctx, j->out, &own);
    if (st) tl_mem_free(j->ctx, values);
    return st;
}

static tl_status carry_regions(job *j, const char *name, tl_scalar scalar,
                               double (*region)(const job *j, size_t triangle))
{
    tl_status st = TL_OK;
    double *values = tl_mem_alloc(j->ctx, j->out->vert_count, sizeof *values, &st);
    for (size_t v = 0; !st && v < j->out->vert_count; v++) values[v] = region(j, j->firsts[v] / 3);
    tl_channel own = {name, "", 1, TL_ON_VERTEX, scalar, values};
    if (!st) st = tl_polydata_adopt_channel(j->ctx, j->out, &own);
    if (st) tl_mem_free(j->ctx, values);
    return st;
}

/* ---- faces ---- */

static bool is_interface(const job *j, size_t face)
{
    const tl_lidx other = j->opposite[face];
    return other != TL_NONE && j->mesh->regions[face / 4] < j->mesh->regions[other / 4];
}

/* Adds the interfaces to what is listed. */
static tl_status list_interfaces(job *j)
{
    tl_status st = TL_OK;
    size_t count = j->outer_count, faces = 4 * j->mesh->tet_count;
    for (size_t f = 0; f < faces; f++) count += is_interface(j, f);
    j->triangles = tl_mem_resize(j->ctx, j->triangles, count, 3 * sizeof *j->triangles, &st);
    j->faces = tl_mem_resize(j->ctx, j->faces, count, sizeof *j->faces, &st);
    for (size_t f = 0; !st && f < faces; f++) {
        if (!is_interface(j, f)) continue;
        const tl_lidx *q = j->mesh->tets + f / 4 * 4;
        for (size_t i = 0; i < 3; i++) j->triangles[3 * j->count + i] = q[tli_tet_faces[f % 4][i]];
        j->faces[j->count++] = (tl_lidx)f;
    }
    return st;
}

static tl_status list_faces(job *j, const tl_lidx *opposite, tl_lidx **own_opposite)
{
    tl_status st = TL_OK;
    const bool inside = j->opts->interfaces && j->mesh->regions;
    if (inside && !opposite) st = tl_mesh_adjacency(j->ctx, j->mesh, own_opposite, NULL);
    j->opposite = opposite ? opposite : *own_opposite;
    if (!st && j->opts->boundary)
        st = tl_mesh_boundary(j->ctx, j->mesh, j->opposite, &j->triangles, &j->faces,
                              &j->outer_count);
    j->count = j->outer_count;
    return !st && inside ? list_interfaces(j) : st;
}

/* ---- the surface ---- */

static tl_status take_opts(tl_ctx *ctx, const tl_mesh *mesh, const tl_boundary_opts *o)
{
    if (!(o->crease >= 0 && o->crease <= 180))
        return tl_fail(ctx, TL_ERR_ARG, "a crease of %g degrees, expected 0 to 180", o->crease);
    for (size_t c = 0; c < o->channel_count; c++)
        if (o->channels[c] >= mesh->channel_count)
            return tl_fail(ctx, TL_ERR_ARG, "channel %zu can't be carried: the mesh has %zu",
                           o->channels[c], mesh->channel_count);
    return TL_OK;
}

static tl_status make_corners(job *j)
{
    tl_status st = TL_OK;
    for (size_t c = 0; c < j->opts->channel_count; c++)
        j->own_corners = j->own_corners || j->mesh->channels[j->opts->channels[c]].on == TL_ON_TET;
    j->normals = tl_mem_alloc(j->ctx, j->count, sizeof *j->normals, &st);
    j->smooth = tl_mem_alloc(j->ctx, j->count, 3 * sizeof *j->smooth, &st);
    j->joined = tl_mem_alloc(j->ctx, j->count, 3 * sizeof *j->joined, &st);
    if (!st) st = tli_sort_sides(j->ctx, j->triangles, j->count, &j->keys, &j->sides);
    if (!st) st = tli_parallel(j->ctx, j->count, GRAIN, set_triangle_normals, j);
    for (size_t i = 0; !st && i < 3 * j->count; i++) j->smooth[i] = j->joined[i] = (uint32_t)i;
    if (!st) join_corners(j);
    return st ? st : number_corners(j);
}

static tl_status make_verts(job *j)
{
    tl_status st = TL_OK;
    j->out->xyz = tl_mem_alloc(j->ctx, j->out->vert_count, 3 * sizeof *j->out->xyz, &st);
    if (!st) set_places(j);
    if (!st && j->opts->normals) st = set_normals(j);
    for (size_t c = 0; !st && c < j->opts->channel_count; c++)
        st = carry_channel(j, &j->mesh->channels[j->opts->channels[c]]);
    if (!st && j->regions) st = carry_regions(j, "region", TL_I32, region_of);
    return !st && j->regions && j->opts->interfaces
               ? carry_regions(j, "region behind", TL_F64, region_behind)
               : st;
}

tl_boundary_opts tl_boundary_opts_defaults(void)
{
    return (tl_boundary_opts){.struct_bytes = sizeof(tl_boundary_opts),
                              .normals = true,
                              .crease = 30,
                              .regions = true,
                              .boundary = true};
}

tl_status tl_boundary_surface(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                              const tl_boundary_opts *opts, tl_polydata **triangles)
{
    tl_boundary_opts own = tl_boundary_opts_defaults();
    tl_lidx *own_opposite = NULL;
    *triangles = NULL;
    tl_status st = tli_opts_take(ctx, "tl_boundary_opts", opts, &own, sizeof own);
    if (!st) st = take_opts(ctx, mesh, &own);
    if (st) return st;
    job j = {.ctx = ctx, .mesh = mesh, .opts = &own, .regions = own.regions && mesh->regions};
    j.out = tl_mem_zalloc(ctx, 1, sizeof *j.out, &st);
    if (!st) st = list_faces(&j, opposite, &own_opposite);
    if (!st) {
        j.out->kind = TL_POLY_TRIANGLES;
        j.out->cell_count = j.count;
        st = make_corners(&j);
    }
    if (!st) st = make_verts(&j);
    tl_mem_free(ctx, j.firsts);
    tl_mem_free(ctx, j.joined);
    tl_mem_free(ctx, j.smooth);
    tl_mem_free(ctx, j.sides);
    tl_mem_free(ctx, j.keys);
    tl_mem_free(ctx, j.normals);
    tl_mem_free(ctx, own_opposite);
    tl_mem_free(ctx, j.faces);
    tl_mem_free(ctx, j.triangles);
    if (st)
        tl_polydata_destroy(ctx, j.out);
    else
        *triangles = j.out;
    return st;
}
