/* Turns what is left of the working mesh into a mesh of its own, with all channels, and tells for
 * every original vertex a tet near it. */
#include "simplify/simplify_pack.h"

#include <string.h>

#include "base/base_predicates.h"

/* Vertices and tets that are left, in the order of the working mesh. */
static tl_status number_live(const tli_work *w, tli_packed *p)
{
    tl_status st = TL_OK;
    tl_lidx verts = 0;
    p->vert_of = tl_mem_alloc(w->ctx, w->vert_count, sizeof *p->vert_of, &st);
    p->tet_of = tl_mem_alloc(w->ctx, w->tet_count, sizeof *p->tet_of, &st);
    if (st) return st;
    for (size_t v = 0; v < w->vert_count; v++)
        p->vert_of[v] = w->verts[v].merged == v ? verts++ : TL_NONE;
    tl_lidx tets = 0;
    for (size_t t = 0; t < w->tet_count; t++)
        p->tet_of[t] = w->tets[t][0] == TL_NONE ? TL_NONE : tets++;
    p->vert_count = verts;
    p->tet_count = tets;
    return TL_OK;
}

static tl_status pack_shape(const tli_work *w, tli_packed *p, tl_mesh **mesh)
{
    tl_status st = TL_OK;
    double *xyz = tl_mem_alloc(w->ctx, p->vert_count, 3 * sizeof *xyz, &st);
    tl_lidx *tets = tl_mem_alloc(w->ctx, p->tet_count, 4 * sizeof *tets, &st);
    for (size_t v = 0; !st && v < w->vert_count; v++)
        if (p->vert_of[v] != TL_NONE)
            memcpy(xyz + 3 * (size_t)p->vert_of[v], w->verts[v].xyz, 3 * sizeof *xyz);
    for (size_t t = 0; !st && t < w->tet_count; t++)
        for (int j = 0; p->tet_of[t] != TL_NONE && j < 4; j++)
            tets[4 * (size_t)p->tet_of[t] + (size_t)j] = p->vert_of[w->tets[t][j]];
    if (!st) st = tl_mesh_adopt(w->ctx, xyz, p->vert_count, tets, p->tet_count, mesh);
    if (st) {
        tl_mem_free(w->ctx, tets);
        tl_mem_free(w->ctx, xyz);
    }
    return st;
}

/* Column of a steering channel in the working values, or SIZE_MAX. */
static size_t column_of(const tl_mesh *mesh, const tl_simplify_opts *opts,
                        const tl_channel *channel, double *scale, const double *channel_scales)
{
    size_t column = 0;
    for (size_t i = 0; i < opts->channel_count; i++) {
        const tl_channel *c = tl_mesh_channel_by_name(mesh, opts->channels[i].name);
        *scale = channel_scales[i];
        if (c == channel) return column;
        column += c->components;
    }
    return SIZE_MAX;
}

static void fill_vertex_channel(const tli_work *w, const tli_packed *p, const tl_channel *from,
                                size_t column, double scale, double *values)
{
    uint32_t k = from->components;
    for (size_t v = 0; v < w->vert_count; v++) {
        if (p->vert_of[v] == TL_NONE) continue;
        double *to = values + (size_t)p->vert_of[v] * k;
        const double *original = from->values + (size_t)w->verts[v].origin * k;
        bool changed = w->verts[v].version != 0 && w->placement != TL_PLACE_SUBSET &&
                       w->verts[v].kind < TLI_CORNER;
        for (uint32_t j = 0; j < k; j++)
            to[j] = changed && column != SIZE_MAX && scale > 0
                        ? w->values[v * w->components + column + j] / scale
                        : original[j];
    }
}

/* Tet channels start with the value of the tet that each new one was. */
static void fill_tet_channel(const tli_work *w, const tli_packed *p, const tl_channel *from,
                             double *values)
{
    uint32_t k = from->components;
    for (size_t t = 0; t < w->tet_count; t++)
        if (p->tet_of[t] != TL_NONE)
            memcpy(values + (size_t)p->tet_of[t] * k, from->values + (size_t)w->tet_origin[t] * k,
                   k * sizeof *values);
}

static tl_status pack_channels(const tli_work *w, const tli_packed *p, const tl_mesh *mesh,
                               const tl_simplify_opts *opts, const double *channel_scales,
                               tl_mesh *out)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < tl_mesh_channel_count(mesh); i++) {
        const tl_channel *from = tl_mesh_channel(mesh, i);
        size_t count = from->on == TL_ON_VERTEX ? p->vert_count : p->tet_count;
        double scale = 0;
        double *values = tl_mem_alloc(w->ctx, count, from->components * sizeof *values, &st);
        if (st) return st;
        if (from->on == TL_ON_VERTEX) {
            size_t column = column_of(mesh, opts, from, &scale, channel_scales);
            fill_vertex_channel(w, p, from, column, scale, values);
        } else
            fill_tet_channel(w, p, from, values);
        tl_channel to = *from;
        to.values = values;
        st = tl_mesh_adopt_channel(out, &to);
        if (st) tl_mem_free(w->ctx, values);
    }
    return st;
}

static tl_status pack_regions(const tli_work *w, const tli_packed *p, tl_mesh *out)
{
    tl_status st = TL_OK;
    if (!w->regions) return TL_OK;
    int32_t *regions = tl_mem_alloc(w->ctx, p->tet_count, sizeof *regions, &st);
    for (size_t t = 0; !st && t < w->tet_count; t++)
        if (p->tet_of[t] != TL_NONE) regions[p->tet_of[t]] = w->regions[t];
    if (!st) st = tl_mesh_set_regions(out, regions);
    tl_mem_free(w->ctx, regions);
    return st;
}

/* A tet of the star that is not flat, so that a walk can start there, or any. */
static tl_lidx solid_tet(const tli_work *w, const tli_star *star)
{
    for (uint32_t i = 0; i < star->count; i++) {
        const tl_lidx *q = w->tets[star->tets[i]];
        if (tli_orient3d_approx(w->verts[q[0]].xyz, w->verts[q[1]].xyz, w->verts[q[2]].xyz,
                                w->verts[q[3]].xyz) > 0)
            return star->tets[i];
    }
    return star->tets[0];
}

/* A tet at the vertex that an original vertex went into. */
static tl_status set_hints(const tli_work *w, tli_packed *p)
{
    tl_status st = TL_OK;
    p->hints = tl_mem_alloc(w->ctx, w->vert_count, sizeof *p->hints, &st);
    for (size_t v = 0; !st && v < w->vert_count; v++) {
        tl_lidx to = w->verts[v].merged;
        while (to != TL_NONE && w->verts[to].merged != to) to = w->verts[to].merged;
        bool gone = to == TL_NONE || w->verts[to].star.count == 0;
        p->hints[w->verts[v].origin] = gone ? TL_NONE : p->tet_of[solid_tet(w, &w->verts[to].star)];
    }
    return st;
}

tl_status tli_pack(const tli_work *w, const tl_mesh *mesh, const tl_simplify_opts *opts,
                   const double *channel_scales, tl_mesh **out, tl_lidx **hints)
{
    tli_packed p = {0};
    *out = NULL;
    tl_status st = number_live(w, &p);
    if (!st) st = pack_shape(w, &p, out);
    if (!st) st = pack_channels(w, &p, mesh, opts, channel_scales, *out);
    if (!st) st = pack_regions(w, &p, *out);
    if (!st) st = set_hints(w, &p);
    if (!st) tl_mesh_set_time(*out, tl_mesh_time(mesh));
    tl_mem_free(w->ctx, p.tet_of);
    tl_mem_free(w->ctx, p.vert_of);
    if (st) {
        tl_mem_free(w->ctx, p.hints);
        tl_mesh_destroy(*out);
        *out = NULL;
    } else
        *hints = p.hints;
    return st;
}
