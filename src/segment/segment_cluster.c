/* Clusters: the graph of neighbours is partitioned by tets; the copies of a vertex in one cluster
 * become one again. A vertex is in several clusters exactly if, in each of them, the link of some
 * copy leads out of the cluster: the links are a ring over all copies. */
#include "segment/segment_cluster.h"

#include "base/base_sort.h"
#include "mesh/mesh.h"

#include <math.h>
#include <string.h>

/* The channel of indices; a name that no file gives. */
#define INDEX_NAME "\x01index"

/* ---- clusters ---- */

static tl_status partition(tli_clusters *c, uint64_t cluster_tets)
{
    const tl_segments *s = c->segments;
    tl_ctx *ctx = c->ctx;
    tl_status st = TL_OK;
    uint64_t wanted = (s->tet_count + cluster_tets - 1) / cluster_tets;
    if (wanted > s->count) wanted = s->count;
    if (wanted < 1) wanted = 1;
    c->count = (uint32_t)wanted;
    tli_graph graph = {.node_count = s->count};
    graph.begins = tl_mem_alloc(ctx, (size_t)s->count + 1, sizeof *graph.begins, &st);
    graph.node_weights = tl_mem_alloc(ctx, s->count, sizeof *graph.node_weights, &st);
    graph.targets = tl_mem_alloc(ctx, (size_t)s->neighbour_count, sizeof *graph.targets, &st);
    graph.weights = tl_mem_alloc(ctx, (size_t)s->neighbour_count, sizeof *graph.weights, &st);
    if (!st) {
        for (uint32_t i = 0; i < s->count; i++) {
            graph.begins[i] = s->entries[i].first_neighbour;
            graph.node_weights[i] = s->entries[i].tet_count;
        }
        graph.begins[s->count] = (uint32_t)s->neighbour_count;
        for (uint64_t e = 0; e < s->neighbour_count; e++) {
            graph.targets[e] = s->neighbours[e];
            graph.weights[e] = 1;
        }
        st = tli_graph_partition(ctx, &graph, c->count, c->of);
    }
    tli_graph_close(ctx, &graph);
    return st;
}

static tl_status list_segments(tli_clusters *c)
{
    tl_status st = TL_OK;
    const uint32_t segments = c->segments->count;
    uint32_t *places = tl_mem_alloc(c->ctx, segments, sizeof *places, &st);
    if (st) return st;
    tli_deal_alone(c->of, segments, c->count, c->begins, places);
    for (uint32_t i = 0; i < segments; i++) c->list[places[i]] = i;
    tl_mem_free(c->ctx, places);
    return TL_OK;
}

/* What one segment says: vertices whose link leads to another cluster, and ranges of values. */
typedef struct survey {
    tli_clusters *c;
    uint64_t *ids;
    size_t id_count;
    double *ranges;
} survey;

static tl_status survey_segment(tl_ctx *ctx, survey *v, uint32_t segment)
{
    tl_segment seg;
    tl_status st = tl_segments_load(ctx, v->c->segments, segment, &seg);
    if (st) return st;
    const uint32_t components = v->c->segments->components[TL_ON_VERTEX];
    v->ids = tl_mem_alloc(ctx, seg.vert_count, sizeof *v->ids, &st);
    v->ranges = tl_mem_alloc(ctx, components, 2 * sizeof *v->ranges, &st);
    for (uint32_t i = 0; !st && i < seg.vert_count; i++) {
        uint32_t slot = TL_LINK_SLOT(seg.links[i]);
        if (slot && v->c->of[seg.neighbours[slot - 1]] != v->c->of[segment])
            v->ids[v->id_count++] = seg.vert_ids[i];
    }
    for (uint32_t k = 0; !st && k < components; k++) {
        double least = (double)INFINITY, most = -(double)INFINITY;
        for (uint32_t i = 0; i < seg.vert_count; i++) {
            double value = seg.values[(size_t)i * components + k];
            if (!isfinite(value)) continue;
            least = value < least ? value : least;
            most = value > most ? value : most;
        }
        v->ranges[2 * k] = least;
        v->ranges[2 * k + 1] = most;
    }
    tl_segment_release(ctx, &seg);
    return st;
}

static tl_status survey_task(void *arg, size_t begin, size_t end, unsigned worker)
{
    survey *all = arg;
    tl_status st = TL_OK;
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_ctx *fork;
        st = tli_ctx_fork(all[i].c->ctx, &fork);
        if (!st) st = tli_ctx_join(all[i].c->ctx, fork, survey_segment(fork, &all[i], (uint32_t)i));
    }
    return st;
}

static tl_status unite_borders(tli_clusters *c, const survey *all)
{
    tl_status st = TL_OK;
    size_t total = 0, kept = 0;
    for (uint32_t i = 0; i < c->segments->count; i++) total += all[i].id_count;
    uint64_t *ids = tl_mem_alloc(c->ctx, total, sizeof *ids, &st);
    for (uint32_t i = 0; !st && i < c->segments->count; i++)
        for (size_t k = 0; k < all[i].id_count; k++) ids[kept++] = all[i].ids[k];
    if (!st) st = tli_sort_u64(c->ctx, ids, NULL, total);
    kept = 0;
    for (size_t i = 0; !st && i < total; i++)
        if (!i || ids[i] != ids[kept - 1]) ids[kept++] = ids[i];
    c->borders = tl_mem_resize(c->ctx, ids, kept, sizeof *ids, &st);
    c->border_count = kept;
    return st;
}

static tl_status survey_all(tli_clusters *c)
{
    tl_status st = TL_OK;
    const uint32_t segments = c->segments->count;
    const uint32_t components = c->segments->components[TL_ON_VERTEX];
    survey *all = tl_mem_zalloc(c->ctx, segments, sizeof *all, &st);
    for (uint32_t i = 0; !st && i < segments; i++) all[i].c = c;
    if (!st) st = tli_parallel(c->ctx, segments, 1, survey_task, all);
    if (!st) st = unite_borders(c, all);
    for (uint32_t k = 0; !st && k < components; k++) {
        double *range = c->ranges + 2 * (size_t)k;
        range[0] = (double)INFINITY, range[1] = -(double)INFINITY;
        for (uint32_t i = 0; i < segments; i++) {
            range[0] = fmin(range[0], all[i].ranges[2 * k]);
            range[1] = fmax(range[1], all[i].ranges[2 * k + 1]);
        }
    }
    for (uint32_t i = 0; all && i < segments; i++) {
        tl_mem_free(c->ctx, all[i].ids);
        tl_mem_free(c->ctx, all[i].ranges);
    }
    tl_mem_free(c->ctx, all);
    return st;
}

tl_status tli_clusters_open(tl_ctx *ctx, const tl_segments *segments, uint64_t cluster_tets,
                            tli_clusters *c)
{
    tl_status st = TL_OK;
    *c = (tli_clusters){.ctx = ctx, .segments = segments};
    c->of = tl_mem_zalloc(ctx, segments->count, sizeof *c->of, &st);
    c->list = tl_mem_alloc(ctx, segments->count, sizeof *c->list, &st);
    c->ranges = tl_mem_alloc(ctx, segments->components[TL_ON_VERTEX], 2 * sizeof *c->ranges, &st);
    if (!st) st = partition(c, cluster_tets);
    c->begins = tl_mem_alloc(ctx, (size_t)c->count + 1, sizeof *c->begins, &st);
    if (!st) st = list_segments(c);
    if (!st) st = survey_all(c);
    if (st) tli_clusters_close(c);
    return st;
}

void tli_clusters_close(tli_clusters *c)
{
    if (!c->ctx) return;
    tl_mem_free(c->ctx, c->borders);
    tl_mem_free(c->ctx, c->ranges);
    tl_mem_free(c->ctx, c->begins);
    tl_mem_free(c->ctx, c->list);
    tl_mem_free(c->ctx, c->of);
    *c = (tli_clusters){0};
}

/* ---- one cluster ---- */

/* The mesh on its way. */
typedef struct weld {
    tl_ctx *ctx;
    const tli_clusters *c;
    uint32_t number;
    tli_cluster *out;
    size_t vert_room, tet_room; /* copies counted; tets */
    size_t verts, tets;
    double *xyz;
    tl_lidx *corners;
    int32_t *regions;
    double **channels; /* [channels + 1] the last are the indices */
    uint32_t *slots;   /* shared vertices by their ids: index + 1; 0: empty */
    size_t slot_count; /* a power of 2 */
} weld;

static size_t slot_of(const weld *w, uint64_t id)
{
    size_t slot = (size_t)((id * 0x9e3779b97f4a7c15u) >> 32) & (w->slot_count - 1);
    while (w->slots[slot] && w->out->ids[w->slots[slot] - 1] != id)
        slot = (slot + 1) & (w->slot_count - 1);
    return slot;
}

static tl_status weld_open(weld *w)
{
    const tl_segments *s = w->c->segments;
    tl_status st = TL_OK;
    size_t shared = 0;
    for (uint32_t i = w->c->begins[w->number]; i < w->c->begins[w->number + 1]; i++) {
        const tli_segment_entry *entry = &s->entries[w->c->list[i]];
        w->vert_room += entry->vert_count;
        w->tet_room += entry->tet_count;
        shared += entry->shared_count;
    }
    w->slot_count = 64;
    while (w->slot_count < 2 * shared) w->slot_count *= 2;
    if (w->vert_room >= TL_MESH_VERTS_MAX || w->tet_room > TL_MESH_TETS_MAX)
        return tl_fail(w->ctx, TL_ERR_UNSUPPORTED, "a cluster of %zu tets", w->tet_room);
    w->slots = tl_mem_zalloc(w->ctx, w->slot_count, sizeof *w->slots, &st);
    w->xyz = tl_mem_alloc(w->ctx, w->vert_room, 3 * sizeof *w->xyz, &st);
    w->corners = tl_mem_alloc(w->ctx, w->tet_room, 4 * sizeof *w->corners, &st);
    if (s->has_regions) w->regions = tl_mem_alloc(w->ctx, w->tet_room, sizeof *w->regions, &st);
    w->out->ids = tl_mem_alloc(w->ctx, w->vert_room, sizeof *w->out->ids, &st);
    w->out->locked = tl_mem_zalloc(w->ctx, w->vert_room, 1, &st);
    w->channels = tl_mem_zalloc(w->ctx, s->channel_count + 1, sizeof *w->channels, &st);
    for (size_t c = 0; !st && c < s->channel_count; c++) {
        const tl_segment_channel *channel = &s->channels[c];
        size_t room = channel->on == TL_ON_VERTEX ? w->vert_room : w->tet_room;
        w->channels[c] = tl_mem_alloc(w->ctx, room, channel->components * sizeof(double), &st);
    }
    return st;
}

/* Index of a vertex of a segment in the mesh; the vertex is added where it is new. */
static tl_lidx place_vertex(weld *w, const tl_segment *seg, uint32_t v)
{
    const tl_segments *s = w->c->segments;
    const uint32_t slot = TL_LINK_SLOT(seg->links[v]);
    size_t at = 0;
    bool leaves = slot && w->c->of[seg->neighbours[slot - 1]] != w->number;
    if (slot) {
        at = slot_of(w, seg->vert_ids[v]);
        if (w->slots[at]) {
            w->out->locked[w->slots[at] - 1] |= leaves;
            return w->slots[at] - 1;
        }
    }
    tl_lidx index = (tl_lidx)w->verts++;
    w->out->ids[index] = seg->vert_ids[v];
    w->out->locked[index] = leaves;
    if (slot) w->slots[at] = index + 1;
    memcpy(w->xyz + 3 * (size_t)index, seg->xyz + 3 * (size_t)v, 3 * sizeof *w->xyz);
    const double *values = seg->values + (size_t)v * s->components[TL_ON_VERTEX];
    for (size_t c = 0; c < s->channel_count; c++) {
        const tl_segment_channel *channel = &s->channels[c];
        if (channel->on != TL_ON_VERTEX) continue;
        memcpy(w->channels[c] + (size_t)index * channel->components, values + channel->first,
               channel->components * sizeof(double));
    }
    return index;
}

static tl_status add_segment(weld *w, uint32_t segment)
{
    const tl_segments *s = w->c->segments;
    tl_segment seg;
    tl_status st = tl_segments_load(w->ctx, s, segment, &seg);
    if (st) return st;
    tl_lidx *places = tl_mem_alloc(w->ctx, seg.vert_count, sizeof *places, &st);
    for (uint32_t v = 0; !st && v < seg.vert_count; v++) places[v] = place_vertex(w, &seg, v);
    for (size_t i = 0; !st && i < 4 * (size_t)seg.tet_count; i++)
        w->corners[4 * w->tets + i] = places[seg.tets[i]];
    if (!st && seg.regions)
        memcpy(w->regions + w->tets, seg.regions, seg.tet_count * sizeof *w->regions);
    for (size_t c = 0; !st && c < s->channel_count; c++) {
        const tl_segment_channel *channel = &s->channels[c];
        if (channel->on != TL_ON_TET) continue;
        double *to = w->channels[c] + w->tets * channel->components;
        for (uint32_t t = 0; t < seg.tet_count; t++, to += channel->components)
            memcpy(to, seg.tet_values + (size_t)t * s->components[TL_ON_TET] + channel->first,
                   channel->components * sizeof *to);
    }
    if (!st) w->tets += seg.tet_count;
    tl_mem_free(w->ctx, places);
    tl_segment_release(w->ctx, &seg);
    return st;
}

/* Blocks shrink to what is used and go to the mesh. */
static tl_status make_mesh(weld *w)
{
    const tl_segments *s = w->c->segments;
    tli_cluster *out = w->out;
    tl_status st = TL_OK;
    w->xyz = tl_mem_resize(w->ctx, w->xyz, w->verts, 3 * sizeof *w->xyz, &st);
    out->ids = tl_mem_resize(w->ctx, out->ids, w->verts, sizeof *out->ids, &st);
    if (!st) st = tl_mesh_adopt(w->ctx, w->xyz, w->verts, w->corners, w->tets, &out->mesh);
    if (st) return st;
    w->xyz = NULL;
    w->corners = NULL;
    if (w->regions) st = tl_mesh_set_regions(out->mesh, w->regions);
    tl_mesh_set_time(out->mesh, s->time);
    w->channels[s->channel_count] = tl_mem_alloc(w->ctx, w->verts, sizeof(double), &st);
    for (size_t v = 0; !st && v < w->verts; v++) w->channels[s->channel_count][v] = (double)v;
    for (size_t c = 0; !st && c <= s->channel_count; c++) {
        tl_channel channel = {INDEX_NAME, "", 1, TL_ON_VERTEX, TL_F64, NULL};
        if (c < s->channel_count) {
            const tl_segment_channel *from = &s->channels[c];
            channel = (tl_channel){from->name, from->unit,   from->components,
                                   from->on,   from->scalar, NULL};
            size_t count = from->on == TL_ON_VERTEX ? w->verts : w->tets;
            w->channels[c] = tl_mem_resize(w->ctx, w->channels[c], count,
                                           from->components * sizeof(double), &st);
        }
        channel.values = w->channels[c];
        if (!st) st = tl_mesh_adopt_channel(out->mesh, &channel);
        if (!st) w->channels[c] = NULL;
    }
    out->index_channel = s->channel_count;
    for (size_t v = 0; v < w->verts; v++) out->locked_count += out->locked[v];
    const tl_lidx *tets = tl_mesh_tets(out->mesh);
    for (size_t t = 0; t < w->tets; t++)
        out->at_border += out->locked[tets[4 * t]] | out->locked[tets[4 * t + 1]] |
                          out->locked[tets[4 * t + 2]] | out->locked[tets[4 * t + 3]];
    return st;
}

tl_status tli_cluster_load(tl_ctx *ctx, const tli_clusters *clusters, uint32_t number,
                           tli_cluster *cluster)
{
    *cluster = (tli_cluster){0};
    weld w = {.ctx = ctx, .c = clusters, .number = number, .out = cluster};
    tl_status st = weld_open(&w);
    for (uint32_t i = clusters->begins[number]; !st && i < clusters->begins[number + 1]; i++)
        st = add_segment(&w, clusters->list[i]);
    tl_mem_free(ctx, w.slots);
    if (!st) st = make_mesh(&w);
    for (size_t c = 0; w.channels && c <= clusters->segments->channel_count; c++)
        tl_mem_free(ctx, w.channels[c]);
    tl_mem_free(ctx, w.channels);
    tl_mem_free(ctx, w.regions);
    tl_mem_free(ctx, w.corners);
    tl_mem_free(ctx, w.xyz);
    if (st) tli_cluster_release(ctx, cluster);
    return st;
}

void tli_cluster_release(tl_ctx *ctx, tli_cluster *cluster)
{
    tl_mesh_destroy(cluster->mesh);
    tl_mem_free(ctx, cluster->ids);
    tl_mem_free(ctx, cluster->locked);
    *cluster = (tli_cluster){0};
}
