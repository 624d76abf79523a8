/* One patch of a surface: decoded, sliced by the kernel for meshes, and of its border what
 * neighbours need: which vertices they share, and the patch's part of the gradient there. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "extract/extract_slices.h"
#include "mesh/mesh.h"

typedef struct patch_job {
    tl_ctx *ctx;
    const tli_slices_job *job;
    tli_slices_patch *source;
    const tl_patch *patch; /* of it */
    tl_mesh *mesh;
    const double *scalar; /* [vert_count]: values of the patch, or own */
    double *own;
    size_t *carried;
    tli_slope *slopes; /* [vert_count] */
    double *gradients; /* [vert_count][3] */
    tli_slice_end *ends;
    uint32_t *slots; /* [vert_count] slot of a vertex, TL_NONE: none */
    tli_slices_part *part;
} patch_job;

/* ---- what can be passed over ---- */

tl_status tli_slices_may_cut(tl_ctx *ctx, const tli_slices_job *job, uint32_t number, bool *may)
{
    tl_patch_info info;
    double low, high;
    tl_status st = tl_store_patch(ctx, job->store, number, &info);
    *may = false;
    if (st) return st;
    if (job->opts.channel == TL_NONE) {
        double from[3], length = vec_length(job->opts.plane + 3);
        vec_sub(info.sphere, job->opts.plane, from);
        double distance = vec_dot(from, job->opts.plane + 3) / length;
        low = distance - info.sphere[3];
        high = distance + info.sphere[3];
    } else {
        low = (double)info.ranges[2 * job->opts.channel];
        high = (double)info.ranges[2 * job->opts.channel + 1];
    }
    for (size_t i = 0; i < job->opts.value_count; i++) /* NaN: nothing is finite */
        *may = *may || (low <= job->opts.values[i] && job->opts.values[i] <= high);
    return TL_OK;
}

/* ---- the patch ---- */

tl_status tli_slices_patch_open(tl_ctx *ctx, const tl_store *store, uint32_t number,
                                tli_slices_patch *patch)
{
    tl_status st = TL_OK;
    *patch = (tli_slices_patch){.store = store, .number = number};
    patch->values =
        tl_mem_zalloc(ctx, tl_store_get_head(store)->channel_count, sizeof *patch->values, &st);
    return st ? st : tl_store_topology(ctx, store, number, &patch->patch);
}

void tli_slices_patch_release(tl_ctx *ctx, tli_slices_patch *patch)
{
    const size_t count = tl_store_get_head(patch->store)->channel_count;
    for (size_t c = 0; patch->values && c < count; c++) tl_mem_free(ctx, patch->values[c]);
    tl_mem_free(ctx, patch->values);
    tl_patch_destroy(ctx, patch->patch);
    *patch = (tli_slices_patch){0};
}

/* Values of a channel of the store [vert_count][components], borrowed from the patch. */
static tl_status take_values(const patch_job *j, uint32_t channel, const double **values)
{
    tl_status st = TL_OK;
    tli_slices_patch *p = j->source;
    const uint32_t n = j->job->head->channels[channel].components;
    if (!p->values[channel]) {
        double *made = tl_mem_alloc(j->ctx, p->patch->vert_count, n * sizeof *made, &st);
        if (!st) st = tl_store_channel_values(j->ctx, p->store, p->number, p->patch, channel, made);
        if (st)
            tl_mem_free(j->ctx, made);
        else
            p->values[channel] = made;
    }
    *values = p->values[channel];
    return st;
}

static tl_status make_mesh(patch_job *j)
{
    tl_status st = TL_OK;
    const tl_patch *p = j->patch;
    double *xyz = tl_mem_alloc(j->ctx, p->vert_count, 3 * sizeof *xyz, &st);
    tl_lidx *tets = tl_mem_alloc(j->ctx, p->tet_count, 4 * sizeof *tets, &st);
    for (uint32_t v = 0; !st && v < p->vert_count; v++)
        tl_lattice_xyz(&j->job->head->lattice, p->places[v], xyz + 3 * (size_t)v);
    for (size_t t = 0; !st && t < p->tet_count; t++)
        for (size_t i = 0; i < 4; i++) tets[4 * t + i] = p->tets[t][i];
    if (!st) st = tl_mesh_adopt(j->ctx, xyz, p->vert_count, tets, p->tet_count, &j->mesh);
    if (!st) return TL_OK;
    tl_mem_free(j->ctx, tets);
    tl_mem_free(j->ctx, xyz);
    return st;
}

static tl_status make_scalar(patch_job *j)
{
    tl_status st = TL_OK;
    const tl_slices_opts *o = &j->job->opts;
    const size_t count = j->patch->vert_count;
    const size_t n = o->channel == TL_NONE ? 0 : j->job->head->channels[o->channel].components;
    if (n) st = take_values(j, o->channel, &j->scalar);
    if (st || n == 1) return st;
    j->own = tl_mem_alloc(j->ctx, count, sizeof *j->own, &st);
    if (!st && !n) st = tl_plane_distance(j->ctx, j->mesh, o->plane, o->plane + 3, j->own);
    for (size_t v = 0; !st && n && v < count; v++) {
        double square = 0;
        for (size_t k = 0; k < n; k++) square += j->scalar[n * v + k] * j->scalar[n * v + k];
        j->own[v] = sqrt(square);
    }
    j->scalar = j->own;
    return st;
}

tl_channel tli_slices_carried(const tli_slices_job *job, size_t place)
{
    const tl_store_channel *from = &job->head->channels[job->opts.channels[place]];
    return (tl_channel){.name = from->name,
                        .unit = from->unit,
                        .components = job->opts.carry ? 1 : from->components,
                        .on = TL_ON_VERTEX,
                        .scalar = job->opts.carry ? TL_F64 : from->scalar};
}

/* What a carried channel is in the mesh [vert_count][components of it]. Gives *values. */
static tl_status carry_values(const patch_job *j, size_t place, uint32_t components,
                              double **values)
{
    const double *from;
    const tl_slices_opts *o = &j->job->opts;
    const uint32_t n = j->job->head->channels[o->channels[place]].components;
    const size_t count = j->patch->vert_count;
    tl_status st = take_values(j, o->channels[place], &from);
    *values = tl_mem_alloc(j->ctx, count, components * sizeof **values, &st);
    if (st) return st;
    if (!o->carry && count) memcpy(*values, from, count * n * sizeof *from);
    for (size_t v = 0; o->carry && v < count; v++)
        (*values)[v] = o->carry(o->carry_user, place, from + n * v, n);
    return TL_OK;
}

/* Puts the carried channels into the mesh. */
static tl_status carry_channels(patch_job *j)
{
    tl_status st = TL_OK;
    const tl_slices_opts *o = &j->job->opts;
    j->carried = tl_mem_alloc(j->ctx, o->channel_count, sizeof *j->carried, &st);
    for (size_t c = 0; !st && c < o->channel_count; c++) {
        double *values = NULL;
        tl_channel to = tli_slices_carried(j->job, c);
        st = carry_values(j, c, to.components, &values);
        to.values = values;
        if (!st) st = tl_mesh_adopt_channel(j->mesh, &to);
        if (st) tl_mem_free(j->ctx, values);
        j->carried[c] = c;
    }
    return st;
}

static tl_status make_gradients(patch_job *j)
{
    tl_status st = TL_OK;
    size_t count = j->patch->vert_count;
    if (!j->job->opts.normals) return TL_OK;
    j->slopes = tl_mem_zalloc(j->ctx, count, sizeof *j->slopes, &st);
    j->gradients = tl_mem_alloc(j->ctx, count, 3 * sizeof *j->gradients, &st);
    if (st) return st;
    tli_slopes_add(j->patch, tl_mesh_xyz(j->mesh), j->scalar, j->slopes);
    for (size_t v = 0; v < count; v++) tli_slope_gradient(&j->slopes[v], j->gradients + 3 * v);
    return TL_OK;
}

static tl_status slice(patch_job *j)
{
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = j->job->opts.values;
    opts.value_count = j->job->opts.value_count;
    opts.gradients = j->gradients;
    opts.channels = j->carried;
    opts.channel_count = j->job->opts.channel_count;
    return tli_slice_mesh(j->ctx, j->mesh, j->scalar, &opts, &j->part->surface, &j->ends);
}

/* ---- the rim ---- */

static uint32_t slot_of(patch_job *j, tl_lidx vert)
{
    if (j->slots[vert] == TL_NONE) j->slots[vert] = j->part->slot_count++;
    return j->slots[vert];
}

static bool is_at_rim(const patch_job *j, const tli_slice_end *end)
{
    return j->patch->shared[end->ends[0]] || j->patch->shared[end->ends[1]];
}

static tl_status find_rim(patch_job *j)
{
    tl_status st = TL_OK;
    const tl_patch *p = j->patch;
    tli_slices_part *part = j->part;
    size_t count = part->surface->vert_count;
    j->slots = tl_mem_alloc(j->ctx, p->vert_count, sizeof *j->slots, &st);
    for (size_t i = 0; i < count; i++) part->rim_count += is_at_rim(j, &j->ends[i]);
    part->rim = tl_mem_alloc(j->ctx, part->rim_count, sizeof *part->rim, &st);
    if (st) return st;
    for (uint32_t v = 0; v < p->vert_count; v++)
        j->slots[v] = p->shared[v] ? part->slot_count++ : TL_NONE;
    part->shared_count = part->slot_count;
    part->rim_count = 0;
    for (size_t i = 0; i < count; i++) {
        const tli_slice_end *e = &j->ends[i];
        if (!is_at_rim(j, e)) continue;
        part->rim[part->rim_count++] = (tli_rim_vert){
            (uint32_t)i, {slot_of(j, e->ends[0]), slot_of(j, e->ends[1])}, e->level, e->weight};
    }
    return TL_OK;
}

/* What the slots hold; keys come later, from all patches. */
static tl_status fill_slots(patch_job *j)
{
    tl_status st = TL_OK;
    tli_slices_part *part = j->part;
    const tl_patch *p = j->patch;
    part->keys = tl_mem_alloc(j->ctx, part->shared_count, sizeof *part->keys, &st);
    part->places = tl_mem_alloc(j->ctx, part->shared_count, sizeof *part->places, &st);
    part->twins = tl_mem_alloc(j->ctx, part->shared_count, 1, &st);
    if (j->slopes) part->slopes = tl_mem_alloc(j->ctx, part->slot_count, sizeof *part->slopes, &st);
    for (uint32_t v = 0; !st && v < p->vert_count; v++) {
        uint32_t slot = j->slots[v];
        if (slot == TL_NONE) continue;
        if (j->slopes) part->slopes[slot] = j->slopes[v];
        if (slot >= part->shared_count) continue;
        for (int k = 0; k < 3; k++) part->places[slot][k] = p->places[v][k];
        part->twins[slot] = p->twins ? p->twins[v] : 0;
    }
    return st;
}

/* ---- the part ---- */

tl_status tli_slices_part_make(tl_ctx *ctx, const tli_slices_job *job, tli_slices_patch *patch,
                               tli_slices_part **part)
{
    tl_status st = TL_OK;
    patch_job j = {.ctx = ctx, .job = job, .source = patch, .patch = patch->patch};
    j.part = tl_mem_zalloc(ctx, 1, sizeof *j.part, &st);
    if (st) return st;
    j.part->number = patch->number;
    j.part->tet_count = j.patch->tet_count;
    st = make_mesh(&j);
    if (!st) st = make_scalar(&j);
    if (!st) st = carry_channels(&j);
    if (!st) st = make_gradients(&j);
    if (!st) st = slice(&j);
    if (!st) st = find_rim(&j);
    if (!st) st = fill_slots(&j);
    tl_mesh_destroy(j.mesh);
    void *blocks[] = {j.slots, j.ends, j.gradients, j.slopes, j.carried, j.own};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    if (st)
        tli_slices_part_destroy(ctx, j.part);
    else
        *part = j.part;
    return st;
}

void tli_slices_part_destroy(tl_ctx *ctx, tli_slices_part *part)
{
    if (!part) return;
    tl_polydata_destroy(ctx, part->surface);
    void *blocks[] = {part->rim, part->places, part->twins, part->keys, part->slopes, part};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
}

uint64_t tli_slices_part_bytes(const tli_slices_part *part)
{
    const uint64_t slot = part->slopes ? sizeof *part->slopes : 0;
    const uint64_t shared = sizeof *part->keys + sizeof *part->places + sizeof *part->twins;
    return sizeof *part + tli_polydata_bytes(part->surface) + part->rim_count * sizeof *part->rim +
           part->slot_count * slot + part->shared_count * shared;
}
