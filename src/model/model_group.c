/* Which patches make up a segment: parts of a graph whose nodes are patches and whose edges count
 * the vertices that two of them share. Old borders should come to lie inside of new segments, so
 * that what was locked may move: vertices shared by patches of different producers weigh more. */
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "model/model.h"
#include "segment/segment_octree.h"

/* Weight of a vertex between patches of different producers, and of the same one. */
enum { ACROSS = 4, ALONG = 1 };
/* Patches of one vertex past which it adds no edges: it would add their square. */
enum { FAN_MAX = 32 };
/* Edges that are first added up. */
enum { MERGE_FIRST = 1 << 20 };

/* Edges as patch << 32 | patch, both ways, with weights. */
typedef struct edge_list {
    uint64_t *keys;
    uint32_t *weights;
    size_t count, capacity, merge_at;
} edge_list;

static tl_status add_edge(tl_ctx *ctx, edge_list *e, uint32_t a, uint32_t b, uint32_t weight)
{
    tl_status st = TL_OK;
    if (e->count + 2 > e->capacity) {
        size_t capacity = e->capacity ? 2 * e->capacity : 4096;
        e->keys = tl_mem_resize(ctx, e->keys, capacity, sizeof *e->keys, &st);
        e->weights = tl_mem_resize(ctx, e->weights, capacity, sizeof *e->weights, &st);
        if (st) return st;
        e->capacity = capacity;
    }
    e->keys[e->count] = (uint64_t)a << 32 | b;
    e->weights[e->count++] = weight;
    e->keys[e->count] = (uint64_t)b << 32 | a;
    e->weights[e->count++] = weight;
    return TL_OK;
}

/* Adds up equal edges. */
static tl_status merge(tl_ctx *ctx, edge_list *e)
{
    tl_status st = tli_sort_u64(ctx, e->keys, e->weights, e->count);
    size_t n = 0;
    for (size_t i = 0; !st && i < e->count; i++)
        if (n && e->keys[n - 1] == e->keys[i])
            e->weights[n - 1] += e->weights[i];
        else {
            e->keys[n] = e->keys[i];
            e->weights[n++] = e->weights[i];
        }
    if (!st) e->count = n;
    return st;
}

/* Edges of the vertices of a bin. */
static tl_status list_edges(const tli_model *m, size_t first, const tli_seam_bins *s, edge_list *e)
{
    tl_status st = TL_OK;
    for (size_t i = 0, end; !st && i < s->count; i = end) {
        for (end = i + 1; end < s->count && s->ids[end] == s->ids[i]; end++) {
        }
        if (end - i > FAN_MAX) continue;
        for (size_t a = i; !st && a < end; a++)
            for (size_t b = i; !st && b < a; b++) {
                uint32_t p = s->patches[a], q = s->patches[b];
                bool along = m->patches[p].producer == m->patches[q].producer;
                st = add_edge(m->ctx, e, p - (uint32_t)first, q - (uint32_t)first,
                              along ? ALONG : ACROSS);
            }
        if (st || e->count < e->merge_at) continue;
        st = merge(m->ctx, e);
        if (e->count > e->merge_at / 2) e->merge_at *= 2;
    }
    return st;
}

/* Numbers the groups along a Hilbert curve through their patches' centres. */
static tl_status number_groups(const tli_model *m, size_t first, size_t count, uint32_t *group_of,
                               size_t *group_count)
{
    tl_status st = TL_OK;
    size_t n = *group_count, used = 0;
    double *centres = tl_mem_zalloc(m->ctx, n, 3 * sizeof *centres, &st);
    double *tets = tl_mem_zalloc(m->ctx, n, sizeof *tets, &st);
    uint32_t *order = tl_mem_alloc(m->ctx, n, sizeof *order, &st);
    uint32_t *rank = tl_mem_alloc(m->ctx, n, sizeof *rank, &st);
    for (size_t p = 0; !st && p < count; p++) {
        const tli_patch_note *note = &m->patches[first + p];
        size_t g = group_of[p];
        tets[g] += note->tet_count;
        for (int k = 0; k < 3; k++)
            centres[3 * g + (size_t)k] +=
                note->tet_count * (note->box[2 * k] / 2 + note->box[2 * k + 1] / 2);
    }
    for (size_t g = 0; !st && g < n; g++)
        for (int k = 0; k < 3; k++)
            centres[3 * g + (size_t)k] =
                tets[g] > 0 ? centres[3 * g + (size_t)k] / tets[g] : (double)INFINITY;
    if (!st) st = tli_sort_hilbert(m->ctx, centres, n, order);
    for (size_t i = 0; !st && i < n; i++)
        rank[order[i]] = tets[order[i]] > 0 ? (uint32_t)used++ : 0;
    for (size_t p = 0; !st && p < count; p++) group_of[p] = rank[group_of[p]];
    if (!st) *group_count = used;
    tl_mem_free(m->ctx, rank);
    tl_mem_free(m->ctx, order);
    tl_mem_free(m->ctx, tets);
    tl_mem_free(m->ctx, centres);
    return st;
}

/* ---- groups out of cells ---- */

/* What a group may hold as a part of what it should: more is divided, less goes to a neighbour. */
static const double CELL_MOST = 1.6, CELL_LEAST = 0.4;

/* Patches by the cells that cut them, cells numbered from 0. */
static tl_status number_cells(const tli_model *m, size_t first, size_t count, uint32_t *group_of,
                              size_t *group_count)
{
    tl_status st = TL_OK;
    uint64_t *cells = tl_mem_alloc(m->ctx, count, sizeof *cells, &st);
    uint32_t *patches = tl_mem_alloc(m->ctx, count, sizeof *patches, &st);
    for (size_t p = 0; !st && p < count; p++) {
        cells[p] = m->patches[first + p].cell;
        patches[p] = (uint32_t)p;
    }
    if (!st) st = tli_sort_u64(m->ctx, cells, patches, count);
    *group_count = 0;
    for (size_t i = 0; !st && i < count; i++) {
        if (!i || cells[i] != cells[i - 1]) ++*group_count;
        group_of[patches[i]] = (uint32_t)*group_count - 1;
    }
    tl_mem_free(m->ctx, patches);
    tl_mem_free(m->ctx, cells);
    return st;
}

/* The group with which group shares the largest weight and is not too large; itself if none. */
static size_t best_partner(const tli_graph *g, const uint32_t *group_of, const uint64_t *sizes,
                           size_t group, size_t group_count, double most, uint64_t *shared)
{
    size_t best = group;
    memset(shared, 0, group_count * sizeof *shared);
    for (uint32_t p = 0; p < g->node_count; p++)
        for (uint32_t e = g->begins[p]; group_of[p] == group && e < g->begins[p + 1]; e++)
            if (group_of[g->targets[e]] != group) shared[group_of[g->targets[e]]] += g->weights[e];
    for (size_t i = 0; i < group_count; i++)
        if (shared[i] > shared[best] && (double)(sizes[i] + sizes[group]) <= most) best = i;
    return best;
}

static tl_status merge_small(tl_ctx *ctx, const tli_graph *g, double wanted, uint32_t *group_of,
                             size_t group_count)
{
    tl_status st = TL_OK;
    uint64_t *sizes = tl_mem_zalloc(ctx, group_count, sizeof *sizes, &st);
    uint64_t *shared = tl_mem_alloc(ctx, group_count, sizeof *shared, &st);
    for (uint32_t p = 0; !st && p < g->node_count; p++) sizes[group_of[p]] += g->node_weights[p];
    for (size_t i = 0; !st && i < group_count; i++) {
        if ((double)sizes[i] >= CELL_LEAST * wanted) continue;
        size_t to = best_partner(g, group_of, sizes, i, group_count, CELL_MOST * wanted, shared);
        if (to == i) continue;
        for (uint32_t p = 0; p < g->node_count; p++)
            if (group_of[p] == i) group_of[p] = (uint32_t)to;
        sizes[to] += sizes[i];
        sizes[i] = 0;
    }
    tl_mem_free(ctx, shared);
    tl_mem_free(ctx, sizes);
    return st;
}

/* Divides one group; new groups are numbered from *group_count on. number [node_count] is scratch.
 */
static tl_status divide_group(tl_ctx *ctx, const tli_graph *g, size_t group, uint32_t parts,
                              uint32_t *group_of, size_t *group_count, uint32_t *number)
{
    tl_status st = TL_OK;
    tli_graph own = {0};
    uint32_t edges = 0;
    for (uint32_t p = 0; p < g->node_count; p++) {
        if (group_of[p] != group) continue;
        number[p] = own.node_count++;
        edges += g->begins[p + 1] - g->begins[p];
    }
    own.begins = tl_mem_alloc(ctx, (size_t)own.node_count + 1, sizeof *own.begins, &st);
    own.targets = tl_mem_alloc(ctx, edges, sizeof *own.targets, &st);
    own.weights = tl_mem_alloc(ctx, edges, sizeof *own.weights, &st);
    own.node_weights = tl_mem_alloc(ctx, own.node_count, sizeof *own.node_weights, &st);
    uint32_t *part_of = tl_mem_alloc(ctx, own.node_count, sizeof *part_of, &st);
    edges = 0;
    for (uint32_t p = 0; !st && p < g->node_count; p++) {
        if (group_of[p] != group) continue;
        own.begins[number[p]] = edges;
        own.node_weights[number[p]] = g->node_weights[p];
        for (uint32_t e = g->begins[p]; e < g->begins[p + 1]; e++) {
            if (group_of[g->targets[e]] != group) continue;
            own.targets[edges] = number[g->targets[e]];
            own.weights[edges++] = g->weights[e];
        }
    }
    if (!st) own.begins[own.node_count] = edges;
    if (!st) st = tli_graph_partition(ctx, &own, parts, part_of);
    for (uint32_t p = 0; !st && p < g->node_count; p++)
        if (group_of[p] == group && part_of[number[p]])
            group_of[p] = (uint32_t)*group_count + part_of[number[p]] - 1;
    if (!st) *group_count += parts - 1;
    tl_mem_free(ctx, part_of);
    tli_graph_close(ctx, &own);
    return st;
}

static tl_status divide_large(tl_ctx *ctx, const tli_graph *g, double wanted, uint32_t *group_of,
                              size_t *group_count)
{
    tl_status st = TL_OK;
    size_t before = *group_count;
    uint64_t *sizes = tl_mem_zalloc(ctx, before, sizeof *sizes, &st);
    uint32_t *number = tl_mem_alloc(ctx, g->node_count, sizeof *number, &st);
    for (uint32_t p = 0; !st && p < g->node_count; p++) sizes[group_of[p]] += g->node_weights[p];
    for (size_t i = 0; !st && i < before; i++)
        if ((double)sizes[i] > CELL_MOST * wanted)
            st = divide_group(ctx, g, i, (uint32_t)((double)sizes[i] / wanted + 0.5), group_of,
                              group_count, number);
    tl_mem_free(ctx, number);
    tl_mem_free(ctx, sizes);
    return st;
}

/* Cells were made for a mesh that had yet to come: what is far too large or small now is mended. */
static tl_status group_cells(const tli_model *m, size_t first, const tli_graph *g,
                             uint32_t *group_of, size_t *group_count)
{
    double wanted = m->plan->opts.segment_tets;
    tl_status st = number_cells(m, first, g->node_count, group_of, group_count);
    if (!st) st = merge_small(m->ctx, g, wanted, group_of, *group_count);
    return st ? st : divide_large(m->ctx, g, wanted, group_of, group_count);
}

static tl_status group_graph(const tli_model *m, size_t first, size_t count, const edge_list *e,
                             uint32_t *group_of, size_t *group_count)
{
    tl_status st = TL_OK;
    uint64_t tets = 0;
    uint32_t *offsets = tl_mem_zalloc(m->ctx, count + 1, sizeof *offsets, &st);
    uint32_t *neighbours = tl_mem_alloc(m->ctx, e->count, sizeof *neighbours, &st);
    uint32_t *sizes = tl_mem_alloc(m->ctx, count, sizeof *sizes, &st);
    for (size_t i = 0; !st && i < e->count; i++) {
        neighbours[i] = (uint32_t)e->keys[i];
        offsets[(e->keys[i] >> 32) + 1]++;
    }
    for (size_t p = 0; !st && p < count; p++) {
        offsets[p + 1] += offsets[p];
        sizes[p] = m->patches[first + p].tet_count;
        tets += sizes[p];
    }
    uint32_t segment_tets = m->plan->opts.segment_tets;
    *group_count = (size_t)((tets + segment_tets / 2) / segment_tets);
    if (*group_count < 1) *group_count = 1;
    if (*group_count > count) *group_count = count;
    tli_graph graph = {(uint32_t)count, offsets, neighbours, e->weights, sizes};
    if (!st)
        st = count && m->patches[first].cell != TL_NONE
                 ? group_cells(m, first, &graph, group_of, group_count)
                 : tli_graph_partition(m->ctx, &graph, (uint32_t)*group_count, group_of);
    if (!st) st = number_groups(m, first, count, group_of, group_count);
    tl_mem_free(m->ctx, sizes);
    tl_mem_free(m->ctx, neighbours);
    tl_mem_free(m->ctx, offsets);
    return st;
}

/* The groups of the patches [count] of a vertex, each once, in at most count places. */
static size_t list_groups(const uint32_t *patches, size_t count, size_t first,
                          const uint32_t *group_of, uint32_t *groups)
{
    size_t n = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t group = group_of[patches[i] - first];
        size_t j = 0;
        while (j < n && groups[j] != group) j++;
        if (j == n) groups[n++] = group;
    }
    return n;
}

/* Vertices of a bin that several groups hold. */
static tl_status list_locked(const tli_model *m, size_t first, const tli_seam_bins *s,
                             const uint32_t *group_of, tli_locked *locked)
{
    tl_status st = TL_OK;
    size_t count = 0;
    tli_locked_vertex *vertices = tl_mem_alloc(m->ctx, s->count, sizeof *vertices, &st);
    uint32_t *groups = tl_mem_alloc(m->ctx, s->count, sizeof *groups, &st);
    for (size_t i = 0, end; !st && i < s->count; i = end) {
        for (end = i + 1; end < s->count && s->ids[end] == s->ids[i]; end++) {
        }
        size_t n = list_groups(s->patches + i, end - i, first, group_of, groups + count);
        for (size_t j = 0; n > 1 && j < n; j++)
            vertices[count++] = (tli_locked_vertex){s->ids[i], (uint32_t)n, 0};
    }
    if (!st) st = tli_locked_add(m->ctx, locked, vertices, groups, count);
    tl_mem_free(m->ctx, groups);
    tl_mem_free(m->ctx, vertices);
    return st;
}

tl_status tli_group(tli_model *m, uint32_t level, size_t first, size_t end, uint32_t *group_of,
                    size_t *group_count, tli_locked *locked)
{
    edge_list edges = {.merge_at = MERGE_FIRST};
    tli_seam_bins seams;
    const char *folder = m->plan->opts.folder;
    *locked = (tli_locked){0};
    tl_status st = tli_seam_bins_open(m->ctx, folder, m->seam_files[level & 1], &m->seams,
                                      m->plan->bin_bytes, &seams);
    for (uint32_t b = 0; !st && b < seams.bins.bin_count; b++) {
        st = tli_seam_bins_read(m->ctx, &seams, b);
        if (!st) st = list_edges(m, first, &seams, &edges);
    }
    if (!st) st = merge(m->ctx, &edges);
    if (!st) st = group_graph(m, first, end - first, &edges, group_of, group_count);
    tl_mem_free(m->ctx, edges.weights);
    tl_mem_free(m->ctx, edges.keys);
    if (!st) st = tli_locked_open(m->ctx, folder, *group_count, locked);
    for (uint32_t b = 0; !st && b < seams.bins.bin_count; b++) {
        if (seams.bins.bin_count > 1) st = tli_seam_bins_read(m->ctx, &seams, b);
        if (!st) st = list_locked(m, first, &seams, group_of, locked);
    }
    tli_seam_bins_close(m->ctx, &seams);
    return st;
}
