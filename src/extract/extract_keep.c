/* Which tets of a mesh are shown, and a mesh of them. */
#include <string.h>

#include "extract/extract_part.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192 };

typedef struct keeping {
    const tl_mesh *mesh;
    const double *values; /* of the channel, or of its norm */
    tl_on on;
    double low, high;
    bool any, hide;
    const int32_t *regions;
    size_t region_count;
    uint8_t *keep;
} keeping;

static tl_status keep_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const keeping *k = arg;
    for (size_t t = begin; t < end; t++) {
        int inside = 0, count = k->on == TL_ON_TET ? 1 : 4;
        for (int i = 0; i < count; i++) {
            double value = k->values[k->on == TL_ON_TET ? t : k->mesh->tets[4 * t + (size_t)i]];
            inside += value >= k->low && value <= k->high;
        }
        if (k->any ? !inside : inside < count) k->keep[t] = 0;
    }
    return TL_OK;
}

tl_status tl_keep_range(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel, double low,
                        double high, bool any, uint8_t *keep)
{
    tl_status st = TL_OK;
    double *norms = NULL;
    keeping k = {.mesh = mesh,
                 .values = channel->values,
                 .on = channel->on,
                 .low = low,
                 .high = high,
                 .any = any,
                 .keep = keep};
    if (channel->components > 1) {
        size_t count = channel->on == TL_ON_TET ? mesh->tet_count : mesh->vert_count;
        norms = tl_mem_alloc(ctx, count, sizeof *norms, &st);
        if (!st) st = tl_derive(ctx, mesh, channel, TL_DERIVED_MAGNITUDE, norms);
        k.values = norms;
    }
    if (!st) st = tli_parallel(ctx, mesh->tet_count, GRAIN, keep_range, &k);
    tl_mem_free(ctx, norms);
    return st;
}

static tl_status keep_regions(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const keeping *k = arg;
    for (size_t t = begin; t < end; t++) {
        bool named = false;
        for (size_t i = 0; i < k->region_count; i++)
            named = named || k->regions[i] == (k->mesh->regions ? k->mesh->regions[t] : 0);
        if (named == k->hide) k->keep[t] = 0;
    }
    return TL_OK;
}

tl_status tl_keep_regions(tl_ctx *ctx, const tl_mesh *mesh, const int32_t *regions,
                          size_t region_count, bool hide, uint8_t *keep)
{
    keeping k = {
        .mesh = mesh, .regions = regions, .region_count = region_count, .hide = hide, .keep = keep};
    return tli_parallel(ctx, mesh->tet_count, GRAIN, keep_regions, &k);
}

tl_status tl_mesh_subset(tl_ctx *ctx, const tl_mesh *mesh, const uint8_t *keep, tl_mesh **subset)
{
    tl_status st = TL_OK;
    tli_part part = {.mesh = mesh};
    size_t next = 0;
    *subset = NULL;
    for (size_t t = 0; t < mesh->tet_count; t++) part.tet_count += keep[t] != 0;
    part.refs = tl_mem_alloc(ctx, part.tet_count, 4 * sizeof *part.refs, &st);
    part.parents = tl_mem_alloc(ctx, part.tet_count, sizeof *part.parents, &st);
    for (size_t t = 0; !st && t < mesh->tet_count; t++) {
        if (!keep[t]) continue;
        memcpy(part.refs + 4 * next, mesh->tets + 4 * t, 4 * sizeof *part.refs);
        part.parents[next++] = (tl_lidx)t;
    }
    if (!st) st = tli_part_mesh(ctx, &part, subset);
    tli_part_release(ctx, &part);
    return st;
}
