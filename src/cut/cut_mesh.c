/* The mesh of a cut, or of some patches of one: patches in rising order, decoded on all threads;
 * vertices that several patches hold become one, told by place and twin. */
#include "cut/cut_mesh.h"

#include <string.h>

#include "cut/cut_keys.h"
#include "cut/cut_object.h"

typedef struct weld {
    tl_ctx *ctx;
    tl_store *store;
    const tl_store_head *head;
    uint32_t *ids; /* [count] patches */
    size_t count;
    tl_patch **patches;  /* [count] */
    tl_lidx **verts;     /* [count][vert_count] vertex of the mesh for each of a patch */
    size_t *tet_starts;  /* [count + 1] */
    size_t *vert_starts; /* [count] of a patch: those that no patch before it has */
    size_t vert_count;
    const size_t *channels;
    size_t channel_count;
    double *xyz;
    tl_lidx *tets;
    int32_t *regions; /* or NULL */
    double **values;  /* [channel_count] */
} weld;

static tl_status decode_patches(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    weld *w = arg;
    tl_ctx *fork = NULL;
    tl_status st = tli_ctx_fork(w->ctx, &fork);
    for (size_t i = begin; !st && i < end; i++) {
        st = tl_store_topology(fork, w->store, w->ids[i], &w->patches[i]);
        if (!st) w->verts[i] = tl_mem_alloc(fork, w->patches[i]->vert_count, sizeof(tl_lidx), &st);
    }
    return tli_ctx_join(w->ctx, fork, st);
}

/* Numbers the vertices: inner ones of a patch one after another, shared ones when first met. */
static tl_status number_verts(weld *w)
{
    tli_keys keys;
    size_t next = 0, shared = 0;
    for (size_t i = 0; i < w->count; i++)
        for (uint32_t v = 0; v < w->patches[i]->vert_count; v++) shared += w->patches[i]->shared[v];
    tl_status st = tli_keys_open(w->ctx, shared / 2, &keys);
    tl_lidx *of_key = tl_mem_alloc(w->ctx, shared, sizeof *of_key, &st);
    for (size_t i = 0; !st && i < w->count; i++) {
        const tl_patch *p = w->patches[i];
        w->vert_starts[i] = next;
        if (next + p->vert_count > TL_MESH_VERTS_MAX) {
            st = tl_fail(w->ctx, TL_ERR_UNSUPPORTED, "the cut has more than %u vertices",
                         TL_MESH_VERTS_MAX);
            break;
        }
        for (uint32_t v = 0; !st && v < p->vert_count; v++) {
            uint32_t key;
            if (!p->shared[v]) {
                w->verts[i][v] = (tl_lidx)next++;
                continue;
            }
            st = tli_keys_take(&keys, p->places[v], p->twins ? p->twins[v] : 0, &key);
            if (st) break;
            if (keys.keys[key].uses == 1) of_key[key] = (tl_lidx)next++;
            w->verts[i][v] = of_key[key];
        }
    }
    w->vert_count = next;
    tl_mem_free(w->ctx, of_key);
    tli_keys_close(&keys);
    return st;
}

static tl_status make_arrays(weld *w)
{
    tl_status st = TL_OK;
    bool regions = false;
    w->tet_starts = tl_mem_alloc(w->ctx, w->count + 1, sizeof *w->tet_starts, &st);
    if (st) return st;
    w->tet_starts[0] = 0;
    for (size_t i = 0; i < w->count; i++) {
        w->tet_starts[i + 1] = w->tet_starts[i] + w->patches[i]->tet_count;
        regions = regions || w->patches[i]->regions;
    }
    if (w->tet_starts[w->count] > TL_MESH_TETS_MAX)
        return tl_fail(w->ctx, TL_ERR_UNSUPPORTED, "the cut has %zu tets, a mesh at most %u",
                       w->tet_starts[w->count], TL_MESH_TETS_MAX);
    w->xyz = tl_mem_alloc(w->ctx, w->vert_count, 3 * sizeof *w->xyz, &st);
    w->tets = tl_mem_alloc(w->ctx, w->tet_starts[w->count], 4 * sizeof *w->tets, &st);
    if (regions)
        w->regions = tl_mem_zalloc(w->ctx, w->tet_starts[w->count], sizeof *w->regions, &st);
    w->values = tl_mem_zalloc(w->ctx, w->channel_count, sizeof *w->values, &st);
    for (size_t c = 0; !st && c < w->channel_count; c++) {
        const tl_store_channel *channel = &w->head->channels[w->channels[c]];
        size_t elems = channel->on == TL_ON_VERTEX ? w->vert_count : w->tet_starts[w->count];
        w->values[c] = tl_mem_alloc(w->ctx, elems, channel->components * sizeof *w->values[c], &st);
    }
    return st;
}

/* A vertex is written by the first patch that has it. */
static bool is_own(const weld *w, size_t i, uint32_t v)
{
    return w->verts[i][v] >= w->vert_starts[i];
}

static void fill_shape(weld *w, size_t i)
{
    const tl_patch *p = w->patches[i];
    tl_lidx *tets = w->tets + 4 * w->tet_starts[i];
    for (uint32_t t = 0; t < p->tet_count; t++)
        for (uint32_t j = 0; j < 4; j++) tets[4 * (size_t)t + j] = w->verts[i][p->tets[t][j]];
    if (p->regions)
        memcpy(w->regions + w->tet_starts[i], p->regions, p->tet_count * sizeof *p->regions);
    for (uint32_t v = 0; v < p->vert_count; v++)
        if (is_own(w, i, v))
            tl_lattice_xyz(&w->head->lattice, p->places[v], w->xyz + 3 * (size_t)w->verts[i][v]);
}

/* Values of one channel; those of a shared vertex are the same in all patches. */
static tl_status fill_channel(weld *w, tl_ctx *fork, size_t i, size_t c)
{
    tl_status st = TL_OK;
    const tl_patch *p = w->patches[i];
    const tl_store_channel *channel = &w->head->channels[w->channels[c]];
    const bool on_verts = channel->on == TL_ON_VERTEX;
    const uint32_t elems = on_verts ? p->vert_count : p->tet_count;
    const size_t k = channel->components;
    double *values = tl_mem_alloc(fork, elems, k * sizeof *values, &st);
    if (!st)
        st =
            tl_store_channel_values(fork, w->store, w->ids[i], p, (uint32_t)w->channels[c], values);
    for (uint32_t e = 0; !st && e < elems; e++) {
        if (on_verts && !is_own(w, i, e)) continue;
        size_t to = on_verts ? w->verts[i][e] : w->tet_starts[i] + e;
        memcpy(w->values[c] + to * k, values + e * k, k * sizeof *values);
    }
    tl_mem_free(fork, values);
    return st;
}

static tl_status fill_patches(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    weld *w = arg;
    tl_ctx *fork = NULL;
    tl_status st = tli_ctx_fork(w->ctx, &fork);
    for (size_t i = begin; !st && i < end; i++) {
        fill_shape(w, i);
        for (size_t c = 0; !st && c < w->channel_count; c++) st = fill_channel(w, fork, i, c);
    }
    return tli_ctx_join(w->ctx, fork, st);
}

static tl_status adopt(weld *w, tl_mesh **mesh)
{
    tl_status st =
        tl_mesh_adopt(w->ctx, w->xyz, w->vert_count, w->tets, w->tet_starts[w->count], mesh);
    if (st) return st;
    w->xyz = NULL;
    w->tets = NULL;
    if (w->regions) st = tl_mesh_set_regions(*mesh, w->regions);
    for (size_t c = 0; !st && c < w->channel_count; c++) {
        const tl_store_channel *from = &w->head->channels[w->channels[c]];
        tl_channel to = {.name = from->name,
                         .unit = from->unit,
                         .components = from->components,
                         .on = from->on,
                         .scalar = from->scalar,
                         .values = w->values[c]};
        st = tl_mesh_adopt_channel(*mesh, &to);
        if (!st) w->values[c] = NULL;
    }
    return st;
}

static void drop(weld *w)
{
    for (size_t c = 0; w->values && c < w->channel_count; c++) tl_mem_free(w->ctx, w->values[c]);
    for (size_t i = 0; w->patches && i < w->count; i++) tl_patch_destroy(w->ctx, w->patches[i]);
    for (size_t i = 0; w->verts && i < w->count; i++) tl_mem_free(w->ctx, w->verts[i]);
    void *blocks[] = {w->values,     w->regions, w->tets,    w->xyz, w->vert_starts,
                      w->tet_starts, w->verts,   w->patches, w->ids};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(w->ctx, blocks[i]);
}

static tl_status list_patches(weld *w, const uint32_t *patches)
{
    tl_status st = TL_OK;
    w->ids = tl_mem_alloc(w->ctx, w->count, sizeof *w->ids, &st);
    w->patches = tl_mem_zalloc(w->ctx, w->count, sizeof *w->patches, &st);
    w->verts = tl_mem_zalloc(w->ctx, w->count, sizeof *w->verts, &st);
    w->vert_starts = tl_mem_alloc(w->ctx, w->count, sizeof *w->vert_starts, &st);
    if (st) return st;
    if (w->count) memcpy(w->ids, patches, w->count * sizeof *w->ids);
    tli_ids_sort(w->ids, w->count);
    return TL_OK;
}

tl_status tli_patches_mesh(tl_ctx *ctx, tl_store *store, const uint32_t *patches,
                           size_t patch_count, const size_t *channels, size_t channel_count,
                           tl_mesh **mesh)
{
    tl_status st = TL_OK;
    weld w = {.ctx = ctx, .store = store, .head = tl_store_get_head(store), .count = patch_count};
    size_t *all = NULL;
    *mesh = NULL;
    if (!channels) {
        channel_count = w.head->channel_count;
        all = tl_mem_alloc(w.ctx, channel_count, sizeof *all, &st);
        for (size_t c = 0; !st && c < channel_count; c++) all[c] = c;
        channels = all;
    }
    for (size_t c = 0; !st && c < channel_count; c++)
        if (channels[c] >= w.head->channel_count)
            st = tl_fail(w.ctx, TL_ERR_ARG, "channel %zu of %zu", channels[c],
                         (size_t)w.head->channel_count);
    w.channels = channels;
    w.channel_count = channel_count;
    if (!st) st = list_patches(&w, patches);
    if (!st) st = tli_parallel(w.ctx, w.count, 1, decode_patches, &w);
    if (!st) st = number_verts(&w);
    if (!st) st = make_arrays(&w);
    if (!st) st = tli_parallel(w.ctx, w.count, 1, fill_patches, &w);
    if (!st) st = adopt(&w, mesh);
    drop(&w);
    tl_mem_free(w.ctx, all);
    if (!st) return TL_OK;
    tl_mesh_destroy(*mesh);
    *mesh = NULL;
    return tl_note(ctx, st, "while making the mesh of a cut of %zu patches", patch_count);
}

tl_status tl_cut_mesh(tl_cut *cut, const size_t *channels, size_t channel_count, tl_mesh **mesh)
{
    return tli_patches_mesh(cut->ctx, cut->graph.store, cut->drawn.ids, cut->drawn.count, channels,
                            channel_count, mesh);
}
