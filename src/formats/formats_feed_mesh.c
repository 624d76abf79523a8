/* A mesh in memory as a source: what no window can do is read as a whole, then handed on like this.
 */
#include "formats/formats_feeder.h"
#include "mesh/mesh.h"

#include <string.h>

typedef struct mesh_reader {
    tli_feeder reader;
    const tl_mesh *mesh;
    tl_mesh *owned;
    size_t *channels[2]; /* of the mesh, by tl_on */
} mesh_reader;

static const mesh_reader *of(const tli_feeder *reader)
{
    return (const mesh_reader *)reader;
}

static tl_status mesh_points(tli_feeder *reader, uint64_t first, uint64_t count, double *xyz)
{
    memcpy(xyz, of(reader)->mesh->xyz + 3 * first, (size_t)count * 3 * sizeof *xyz);
    return TL_OK;
}

static tl_status mesh_values(tli_feeder *reader, tl_on on, uint32_t array, uint64_t first,
                             uint64_t count, double *values)
{
    const mesh_reader *r = of(reader);
    const tl_channel *channel = &r->mesh->channels[r->channels[on][array]];
    const size_t tuple = channel->components;
    memcpy(values, channel->values + first * tuple, (size_t)count * tuple * sizeof *values);
    return TL_OK;
}

static tl_status mesh_cells(tli_feeder *reader, uint64_t first, uint64_t count, tli_grid *window)
{
    tl_status st = TL_OK;
    window->connectivity =
        tl_mem_alloc(reader->ctx, (size_t)count, 4 * sizeof *window->connectivity, &st);
    if (st) return st;
    memcpy(window->connectivity, of(reader)->mesh->tets + 4 * first,
           (size_t)count * 4 * sizeof *window->connectivity);
    return TL_OK;
}

static tl_status mesh_regions(tli_feeder *reader, uint64_t first, uint64_t count, int32_t *regions)
{
    memcpy(regions, of(reader)->mesh->regions + first, (size_t)count * sizeof *regions);
    return TL_OK;
}

static void mesh_close(tli_feeder *reader)
{
    tl_ctx *ctx = reader->ctx;
    const mesh_reader *r = of(reader);
    tli_feeder_drop_arrays(reader);
    tl_mem_free(ctx, r->channels[0]);
    tl_mem_free(ctx, r->channels[1]);
    tl_mesh_destroy(r->owned);
    tl_mem_free(ctx, reader);
}

tl_status tli_feeder_open_mesh(tl_ctx *ctx, const tl_mesh *mesh, bool owned, tli_feeder **reader)
{
    tl_status st = TL_OK;
    mesh_reader *r = tl_mem_zalloc(ctx, 1, sizeof *r, &st);
    if (st) return st;
    r->mesh = mesh;
    r->reader = (tli_feeder){.ctx = ctx,
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
        r->channels[channel->on][r->reader.array_counts[channel->on]] = i;
        st = tli_feeder_add(&r->reader, channel->on, channel->name, channel->components,
                            channel->scalar);
    }
    if (st) {
        mesh_close(&r->reader);
        return st;
    }
    if (owned) r->owned = (tl_mesh *)(uintptr_t)mesh;
    *reader = &r->reader;
    return TL_OK;
}
