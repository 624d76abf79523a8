/* Points, lines and triangles that were taken out of a mesh: ownership, size, closedness. */
#include "base/base_sort.h"
#include "base/base_vec.h"
#include "mesh/mesh.h"
#include "mesh/mesh_edge.h"

void tl_polydata_destroy(tl_ctx *ctx, tl_polydata *polydata)
{
    if (!polydata) return;
    for (size_t c = 0; c < polydata->channel_count; c++) {
        tli_free_const(ctx, polydata->channels[c].values);
        tli_free_const(ctx, polydata->channels[c].unit);
        tli_free_const(ctx, polydata->channels[c].name);
    }
    tl_mem_free(ctx, polydata->channels);
    tl_mem_free(ctx, polydata->starts);
    tl_mem_free(ctx, polydata->corners);
    tl_mem_free(ctx, polydata->normals);
    tl_mem_free(ctx, polydata->xyz);
    tl_mem_free(ctx, polydata);
}

tl_status tl_polydata_adopt_channel(tl_ctx *ctx, tl_polydata *polydata, const tl_channel *channel)
{
    tl_status st = TL_OK;
    if (!channel->name || !channel->components || !channel->values || channel->on != TL_ON_VERTEX)
        return tl_fail(ctx, TL_ERR_ARG,
                       "a channel of polydata needs a name, components and values on vertices");
    tl_channel own = *channel;
    char *name = tli_strdup(ctx, channel->name, &st);
    char *unit = tli_strdup(ctx, channel->unit ? channel->unit : "", &st);
    polydata->channels = tl_mem_resize(ctx, polydata->channels, polydata->channel_count + 1,
                                       sizeof *polydata->channels, &st);
    if (st) {
        tl_mem_free(ctx, unit);
        tl_mem_free(ctx, name);
        return st;
    }
    own.name = name;
    own.unit = unit;
    polydata->channels[polydata->channel_count++] = own;
    return TL_OK;
}

static double triangle_area(const tl_polydata *p, size_t cell)
{
    const tl_lidx *t = p->corners + 3 * cell;
    const double *a = p->xyz + 3 * (size_t)t[0];
    double u[3], v[3], n[3];
    vec_sub(p->xyz + 3 * (size_t)t[1], a, u);
    vec_sub(p->xyz + 3 * (size_t)t[2], a, v);
    vec_cross(u, v, n);
    return vec_length(n) / 2;
}

double tl_polydata_size(const tl_polydata *polydata)
{
    double sum = 0;
    if (polydata->kind == TL_POLY_TRIANGLES)
        for (size_t c = 0; c < polydata->cell_count; c++) sum += triangle_area(polydata, c);
    if (polydata->kind == TL_POLY_LINES)
        for (size_t c = 0; c < polydata->cell_count; c++)
            for (size_t i = polydata->starts[c] + 1; i < polydata->starts[c + 1]; i++) {
                double step[3];
                vec_sub(polydata->xyz + 3 * (size_t)polydata->corners[i],
                        polydata->xyz + 3 * (size_t)polydata->corners[i - 1], step);
                sum += vec_length(step);
            }
    return sum;
}

tl_status tl_polydata_closed(tl_ctx *ctx, const tl_polydata *polydata, bool *closed)
{
    tl_status st = TL_OK;
    size_t count = polydata->kind == TL_POLY_TRIANGLES ? 3 * polydata->cell_count : 0;
    uint64_t *edges = tl_mem_alloc(ctx, count, sizeof *edges, &st);
    uint32_t *forward = tl_mem_alloc(ctx, count, sizeof *forward, &st);
    for (size_t e = 0; !st && e < count; e++) {
        size_t next = e % 3 == 2 ? e - 2 : e + 1;
        tl_lidx a = polydata->corners[e], b = polydata->corners[next];
        forward[e] = a < b;
        edges[e] = tli_edge_key(a, b);
    }
    if (!st) st = tli_sort_u64(ctx, edges, forward, count);
    bool all = count > 0 && count % 2 == 0;
    for (size_t e = 0; !st && all && e < count; e += 2)
        all = edges[e] == edges[e + 1] && forward[e] != forward[e + 1] &&
              (e + 2 == count || edges[e + 2] != edges[e]);
    if (!st) *closed = all;
    tl_mem_free(ctx, forward);
    tl_mem_free(ctx, edges);
    return st;
}

uint64_t tli_polydata_bytes(const tl_polydata *p)
{
    uint64_t per_vert = 3 * sizeof *p->xyz, cells = 0;
    if (p->normals) per_vert += 3 * sizeof *p->normals;
    for (size_t i = 0; i < p->channel_count; i++)
        per_vert += p->channels[i].components * sizeof(double);
    if (p->kind == TL_POLY_TRIANGLES) cells = 3 * p->cell_count;
    if (p->kind == TL_POLY_LINES) cells = p->cell_count + 1 + p->starts[p->cell_count];
    return p->vert_count * per_vert + cells * sizeof(tl_lidx);
}
