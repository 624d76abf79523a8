/* What lies at a place: tet, region and the values of all channels. */
#include <math.h>
#include <string.h>

#include "mesh/mesh.h"
#include "tetralod/measure.h"
#include "tetralod/view.h"

/* Pairs of corners of a tet: its edges. */
static const uint8_t EDGES[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

/* Room for the values of all channels, in one block. */
static tl_status make_room(tl_ctx *ctx, const tl_mesh *mesh, tl_probe *probe)
{
    tl_status st = TL_OK;
    const size_t count = tl_mesh_channel_count(mesh);
    size_t reals = 0;
    for (size_t c = 0; c < count; c++) reals += tl_mesh_channel(mesh, c)->components;
    /* the reals stand behind the heads, whose size is a multiple of theirs */
    _Static_assert(sizeof(tl_probe_value) % sizeof(double) == 0, "reals would not be aligned");
    const size_t heads = count * (sizeof(tl_probe_value) / sizeof(double));
    probe->values = tl_mem_zalloc(ctx, heads + reals, sizeof(double), &st);
    if (st) return st;
    probe->value_count = count;
    double *next = (double *)probe->values + heads;
    for (size_t c = 0; c < count; c++) {
        const tl_channel *channel = tl_mesh_channel(mesh, c);
        probe->values[c] = (tl_probe_value){.name = channel->name,
                                            .unit = channel->unit,
                                            .components = channel->components,
                                            .values = next};
        next += channel->components;
    }
    return TL_OK;
}

static double longest_edge(const tl_mesh *mesh, tl_lidx tet)
{
    double p[4][3], longest = 0;
    tli_tet_corners(tl_mesh_xyz(mesh), tl_mesh_tets(mesh) + 4 * (size_t)tet, p);
    for (int e = 0; e < 6; e++) {
        const double *a = p[EDGES[e][0]], *b = p[EDGES[e][1]];
        longest = fmax(longest, hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]));
    }
    return longest;
}

tl_status tl_mesh_probe(tl_ctx *ctx, const tl_mesh *mesh, const tl_locator *locator,
                        const double xyz[3], tl_probe *probe)
{
    double weights[4];
    const tl_lidx hint = probe->is_inside ? probe->tet : TL_NONE;
    tl_status st = probe->values ? TL_OK : make_room(ctx, mesh, probe);
    if (st) return st;
    memcpy(probe->xyz, xyz, sizeof probe->xyz);
    probe->tet = tl_locator_find(locator, xyz, hint, weights);
    probe->is_inside = probe->tet != TL_NONE;
    probe->patch = probe->level = TL_NONE;
    if (!probe->is_inside) return TL_OK;
    probe->tet_size = longest_edge(mesh, probe->tet);
    probe->region = tl_mesh_regions(mesh) ? tl_mesh_regions(mesh)[probe->tet] : 0;
    probe->region_name = tl_mesh_region_name(mesh, probe->region);
    double *out = (double *)(probe->values + probe->value_count);
    for (size_t c = 0; c < probe->value_count; c++) {
        tl_channel_at(mesh, tl_mesh_channel(mesh, c), probe->tet, weights, out);
        out += probe->values[c].components;
    }
    return TL_OK;
}

void tl_probe_release(tl_ctx *ctx, tl_probe *probe)
{
    if (!probe) return;
    tl_mem_free(ctx, probe->values);
    *probe = (tl_probe){0};
}
