/* A mesh in memory as a source: what no window can do is read as a whole, then handed on like this.
 */
#include "formats/formats_feeder.h"
#include "mesh/mesh.h"

#include <string.h>

typedef struct mesh_reader {
    tli_feeder feeder;
    const tl_mesh *mesh;
    tl_mesh *owned;
    size_t *channels[2]; /* of the mesh, by tl_on */
} mesh_reader;

static const mesh_reader *of(const tli_feeder *feeder)
{
    return (const mesh_reader *)feeder;
}

static tl_status mesh_points(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz)
{
    memcpy(xyz, of(feeder)->mesh->xyz + 3 * first, (size_t)count * 3 * sizeof *xyz);
    return TL_OK;
}

static tl_status mesh_values(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                             uint64_t count, double *values)
{
    const mesh_reader *r = of(feeder);
    const tl_channel *channel = &r->mesh->channels[r->channels[on][array]];
    const size_t tuple = channel->components;
    memcpy(values, channel->values + first * tuple, (size_t)count * tuple * sizeof *values);
    return TL_OK;
}

static tl_status mesh_cells(tli_feeder *feeder, uint64_t first, uint64_t count, tli_grid *window)
{
    tl_status st = TL_OK;
    window->connectivity =
        tl_mem_alloc(feeder->ctx, (size_t)count, 4 * sizeof *window->connectivity, &st);
    if (st) return st;
    memcpy(window->connectivity, of(feeder)->mesh->tets + 4 * first,
           (size_t)count * 4 * sizeof *window->connectivity);
    return TL_OK;
}

static tl_status mesh_regions(tli_feeder *feeder, uint64_t first, uint64_t count, int32_t *regions)
{
    memcpy(regions, of(feeder)->mesh->regions + first, (size_t)count * sizeof *regions);
    return TL_OK;
}

static void mesh_close(tli_feeder *feeder)
{
    tl_ctx *ctx = feeder->ctx;
    const mesh_reader *r = of(feeder);
    tli_feeder_drop_arrays(feeder);
    tl_mem_free(ctx, r->channels[0]);
    tl_mem_free(ctx, r->channels[1]);
    tl_mesh_destroy(r->owned);
    tl_mem_free(ctx, feeder);
}

tl_status tli_feeder_open_mesh(tl_ctx *ctx, const tl_mesh *mesh, bool owned, tli_feeder **feeder)
{
    tl_status st = TL_OK;
    mesh_reader *r = tl_mem_zalloc(ctx, 1, sizeof *r, &st);
    if (st) return st;
    r->mesh = mesh;
    r->feeder = (tli_feeder){.ctx = ctx,
                             .point_count = mesh->vert_count,
                             .cell_count = mesh->tet_count,
                             .time = mesh->time,
                             .is_final = true,
                             .points = mesh_points,
                             .values = mesh_values,
                             .cells = mesh_cells,
                             .regions = mesh->regions ? mesh_regions : NULL,
                             .close = mesh_close};
    for (int on = 0; on < 2; on++)
        r->channels[on] = tl_mem_alloc(ctx, mesh->channel_count, sizeof *r->channels[on], &st);
    for (size_t i = 0; !st && i < mesh->channel_count; i++) {
        const tl_channel *channel = &mesh->channels[i];
        r->channels[channel->on][r->feeder.array_counts[channel->on]] = i;
        st = tli_feeder_add(&r->feeder, channel->on, channel->name, channel->components,
                            channel->scalar);
    }
    if (st) {
        mesh_close(&r->feeder);
        return st;
    }
    if (owned) r->owned = (tl_mesh *)(uintptr_t)mesh;
    *feeder = &r->feeder;
    return TL_OK;
}
