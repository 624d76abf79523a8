/* Makes a mesh of tets of another one, whole or cut. Vertices in use keep their order; those on cut
 * edges come behind, in the order of the cells that first have them. */
#include "extract/extract_part.h"

#include <string.h>

#include "mesh/mesh.h"

enum { GRAIN = 8192 };

/* ---- vertices ---- */

/* One thread: several would write the same places. Gives places [old_count] in the result, TL_NONE
 * for what is not in use. */
static tl_status number_olds(tl_ctx *ctx, const tl_lidx *refs, size_t ref_count, size_t old_count,
                             tli_cut_verts *verts, uint32_t **places)
{
    tl_status st = TL_OK;
    uint32_t *to = tl_mem_alloc(ctx, old_count, sizeof *to, &st);
    if (st) return st;
    memset(to, 0xff, old_count * sizeof *to);
    for (size_t i = 0; i < ref_count; i++)
        if (refs[i] < old_count) to[refs[i]] = 0;
    for (size_t v = 0; v < old_count; v++)
        if (to[v] != TL_NONE) to[v] = (uint32_t)verts->old_count++;
    verts->olds = tl_mem_alloc(ctx, verts->old_count, sizeof *verts->olds, &st);
    for (size_t v = 0; !st && v < old_count; v++)
        if (to[v] != TL_NONE) verts->olds[to[v]] = (tl_lidx)v;
    *places = to;
    return st;
}

typedef struct numbering {
    const tl_lidx *refs;
    const uint32_t *places, *numbers;
    size_t old_count, kept;
    tl_lidx *out;
} numbering;

static tl_status number_refs(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const numbering *n = arg;
    for (size_t i = begin; i < end; i++) {
        tl_lidx ref = n->refs[i];
        n->out[i] = ref < n->old_count ? n->places[ref]
                                       : (tl_lidx)(n->kept + n->numbers[ref - n->old_count]);
    }
    return TL_OK;
}

tl_status tli_cut_verts_make(tl_ctx *ctx, const tl_lidx *refs, size_t ref_count, size_t old_count,
                             const tli_cut_edges *edges, tl_lidx *corners, tli_cut_verts *verts)
{
    uint32_t *places = NULL, *numbers = NULL;
    size_t new_count = 0;
    *verts = (tli_cut_verts){.unique = NULL};
    tl_status st = number_olds(ctx, refs, ref_count, old_count, verts, &places);
    if (edges->piece_count) {
        numbers = tl_mem_alloc(ctx, edges->starts[edges->piece_count], sizeof *numbers, &st);
        if (!st) st = tli_weld_edges(ctx, edges, numbers, &verts->unique, &new_count);
    }
    verts->count = verts->old_count + new_count;
    numbering n = {refs, places, numbers, old_count, verts->old_count, corners};
    if (!st) st = tli_parallel(ctx, ref_count, GRAIN, number_refs, &n);
    tl_mem_free(ctx, numbers);
    tl_mem_free(ctx, places);
    return st;
}

void tli_cut_verts_release(tl_ctx *ctx, tli_cut_verts *verts)
{
    tl_mem_free(ctx, verts->unique);
    tl_mem_free(ctx, verts->olds);
}

double tli_cut_ends(const tli_cut_verts *verts, const double *xyz, const double *scalar,
                    size_t vert, size_t ends[2])
{
    if (vert < verts->old_count) {
        ends[0] = ends[1] = verts->olds[vert];
        return 0;
    }
    uint64_t both = verts->unique[vert - verts->old_count].verts;
    ends[0] = (size_t)(both >> 32);
    ends[1] = (size_t)(both & UINT32_MAX);
    return tli_cut_weight(xyz, scalar, 0, ends);
}

typedef struct mixing {
    const tli_cut_verts *verts;
    const double *xyz, *scalar, *from;
    size_t components;
    double *to;
} mixing;

static tl_status mix_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const mixing *m = arg;
    size_t n = m->components, ends[2];
    for (size_t v = begin; v < end; v++) {
        double w = tli_cut_ends(m->verts, m->xyz, m->scalar, v, ends);
        for (size_t k = 0; k < n; k++) {
            double a = m->from[n * ends[0] + k], b = m->from[n * ends[1] + k];
            m->to[n * v + k] = v < m->verts->old_count ? a : tli_mix(a, b, w);
        }
    }
    return TL_OK;
}

tl_status tli_cut_verts_carry(tl_ctx *ctx, const tli_cut_verts *verts, const double *xyz,
                              const double *scalar, const double *from, size_t components,
                              double **values)
{
    tl_status st = TL_OK;
    mixing m = {verts, xyz, scalar, from, components, NULL};
    m.to = tl_mem_alloc(ctx, verts->count, components * sizeof *m.to, &st);
    if (!st) st = tli_parallel(ctx, verts->count, GRAIN, mix_verts, &m);
    if (st)
        tl_mem_free(ctx, m.to);
    else
        *values = m.to;
    return st;
}

tl_status tli_cut_verts_polydata(tl_ctx *ctx, const tli_cut_verts *verts, const tl_polydata *from,
                                 const double *scalar, tl_polydata *to)
{
    to->vert_count = verts->count;
    tl_status st = tli_cut_verts_carry(ctx, verts, from->xyz, scalar, from->xyz, 3, &to->xyz);
    for (size_t c = 0; !st && c < from->channel_count; c++) {
        double *values = NULL;
        tl_channel own = from->channels[c];
        st =
            tli_cut_verts_carry(ctx, verts, from->xyz, scalar, own.values, own.components, &values);
        own.values = values;
        if (!st) st = tl_polydata_adopt_channel(ctx, to, &own);
        if (st) tl_mem_free(ctx, values);
    }
    return st;
}

/* ---- what is carried ---- */

static tl_status carry_tets(tl_ctx *ctx, const tli_part *p, const tl_channel *channel,
                            double **values)
{
    tl_status st = TL_OK;
    size_t n = channel->components;
    double *to = tl_mem_alloc(ctx, p->tet_count, n * sizeof *to, &st);
    for (size_t t = 0; !st && t < p->tet_count; t++)
        memcpy(to + n * t, channel->values + n * p->parents[t], n * sizeof *to);
    *values = to;
    return st;
}

static tl_status carry_channel(tl_ctx *ctx, const tli_part *p, const tli_cut_verts *verts,
                               const tl_channel *channel, tl_mesh *mesh)
{
    double *values = NULL;
    tl_status st = channel->on == TL_ON_TET
                       ? carry_tets(ctx, p, channel, &values)
                       : tli_cut_verts_carry(ctx, verts, p->mesh->xyz, p->scalar, channel->values,
                                             channel->components, &values);
    tl_channel own = *channel;
    own.values = values;
    if (!st) st = tl_mesh_adopt_channel(mesh, &own);
    if (st) tl_mem_free(ctx, values);
    return st;
}

static tl_status carry_regions(tl_ctx *ctx, const tli_part *p, tl_mesh *mesh)
{
    tl_status st = TL_OK;
    const tl_mesh *from = p->mesh;
    for (size_t i = 0; !st && i < from->region_name_count; i++)
        st =
            tl_mesh_set_region_name(mesh, from->region_names[i].region, from->region_names[i].name);
    if (!from->regions) return st;
    mesh->regions = tl_mem_alloc(ctx, p->tet_count, sizeof *mesh->regions, &st);
    for (size_t t = 0; !st && t < p->tet_count; t++)
        mesh->regions[t] = from->regions[p->parents[t]];
    return st;
}

/* True if a reference lies in the face opposite to that corner of its tet. */
static bool lies_in(const tli_part *p, tl_lidx ref, tl_lidx opposite)
{
    size_t vert_count = p->mesh->vert_count;
    if (ref < vert_count) return ref != opposite;
    uint64_t verts = p->edges.edges[ref - vert_count].verts;
    return verts >> 32 != opposite && (verts & UINT32_MAX) != opposite;
}

/* The first tet of the part whose parent is not below. */
static size_t first_child(const tli_part *p, tl_lidx parent)
{
    size_t low = 0, high = p->tet_count;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (p->parents[middle] < parent)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Faces of the part that lie in a face of the mesh, written behind faces [*count] if there is room
 * (faces not NULL). */
static void list_faces(const tli_part *p, tl_lidx face, tl_lidx *faces, size_t *count)
{
    tl_lidx opposite = p->mesh->tets[face];
    for (size_t t = first_child(p, face / 4); t < p->tet_count && p->parents[t] == face / 4; t++)
        for (size_t i = 0; i < 4; i++) {
            bool all = true;
            for (int k = 0; k < 3; k++)
                all = all && lies_in(p, p->refs[4 * t + tli_tet_faces[i][k]], opposite);
            if (!all) continue;
            if (faces) faces[*count] = (tl_lidx)(4 * t + i);
            ++*count;
        }
}

static tl_status carry_label(tl_ctx *ctx, const tli_part *p, const tl_label *label, tl_mesh *mesh)
{
    tl_status st = TL_OK;
    size_t count = 0, written = 0;
    for (size_t f = 0; f < label->face_count; f++) list_faces(p, label->faces[f], NULL, &count);
    tl_lidx *faces = tl_mem_alloc(ctx, count, sizeof *faces, &st);
    for (size_t f = 0; !st && f < label->face_count; f++)
        list_faces(p, label->faces[f], faces, &written);
    tl_label own = {label->name, label->id, count, faces};
    if (!st) st = tl_mesh_add_label(mesh, &own);
    tl_mem_free(ctx, faces);
    return st;
}

static tl_status carry(tl_ctx *ctx, const tli_part *p, const tli_cut_verts *verts, tl_mesh *mesh)
{
    tl_status st = TL_OK;
    mesh->time = p->mesh->time;
    for (size_t c = 0; !st && c < p->mesh->channel_count; c++)
        st = carry_channel(ctx, p, verts, &p->mesh->channels[c], mesh);
    if (!st) st = carry_regions(ctx, p, mesh);
    for (size_t i = 0; !st && i < p->mesh->label_count; i++)
        st = carry_label(ctx, p, &p->mesh->labels[i], mesh);
    return st;
}

tl_status tli_part_mesh(tl_ctx *ctx, const tli_part *part, tl_mesh **mesh)
{
    tl_status st = TL_OK;
    double *xyz = NULL;
    tl_mesh *made = NULL;
    const tl_mesh *from = part->mesh;
    tli_cut_verts verts = {.unique = NULL};
    tl_lidx *tets = tl_mem_alloc(ctx, part->tet_count, 4 * sizeof *tets, &st);
    if (!st)
        st = tli_cut_verts_make(ctx, part->refs, 4 * part->tet_count, from->vert_count,
                                &part->edges, tets, &verts);
    if (!st) st = tli_cut_verts_carry(ctx, &verts, from->xyz, part->scalar, from->xyz, 3, &xyz);
    if (!st) st = tl_mesh_adopt(ctx, xyz, verts.count, tets, part->tet_count, &made);
    if (st) {
        tl_mem_free(ctx, xyz);
        tl_mem_free(ctx, tets);
    }
    if (!st) st = carry(ctx, part, &verts, made);
    tli_cut_verts_release(ctx, &verts);
    if (st)
        tl_mesh_destroy(made);
    else
        *mesh = made;
    return st;
}

void tli_part_release(tl_ctx *ctx, tli_part *part)
{
    tl_mem_free(ctx, part->edges.edges);
    tl_mem_free(ctx, part->edges.counts);
    tl_mem_free(ctx, part->edges.starts);
    tl_mem_free(ctx, part->parents);
    tl_mem_free(ctx, part->refs);
}
