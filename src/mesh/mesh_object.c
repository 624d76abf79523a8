/* The mesh object: taking arrays in, handing them out. Indices are proved here once, so that no
 * later stage has to. */
#include "mesh/mesh.h"

#include <math.h>
#include <string.h>

/* Tets whose indices are looked at together: their maximum is a loop that vectorises. */
#define CHECK_TETS 1024

const uint8_t tli_tet_faces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

static tl_status check_indices(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count,
                               size_t vert_count)
{
    for (size_t begin = 0; begin < tet_count; begin += CHECK_TETS) {
        size_t end = begin + CHECK_TETS < tet_count ? begin + CHECK_TETS : tet_count;
        tl_lidx largest = 0;
        for (size_t i = 4 * begin; i < 4 * end; i++)
            largest = tets[i] > largest ? tets[i] : largest;
        if (largest < vert_count) continue;
        for (size_t i = 4 * begin; i < 4 * end; i++) {
            if (tets[i] >= vert_count)
                return tl_fail(ctx, TL_ERR_DATA,
                               "tet %zu: corner %zu is vertex %u of a mesh of %zu vertices", i / 4,
                               i % 4, tets[i], vert_count);
        }
    }
    return TL_OK;
}

static tl_status check_counts(tl_ctx *ctx, const double *xyz, size_t vert_count,
                              const tl_lidx *tets, size_t tet_count)
{
    if (vert_count > TL_MESH_VERTS_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "%zu vertices: a mesh in memory holds at most %u",
                       vert_count, TL_MESH_VERTS_MAX);
    if (tet_count > TL_MESH_TETS_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "%zu tets: a mesh in memory holds at most %u", tet_count,
                       TL_MESH_TETS_MAX);
    if ((vert_count && !xyz) || (tet_count && !tets))
        return tl_fail(ctx, TL_ERR_ARG, "a mesh of %zu vertices and %zu tets needs both arrays",
                       vert_count, tet_count);
    return TL_OK;
}

tl_status tl_mesh_adopt(tl_ctx *ctx, double *xyz, size_t vert_count, tl_lidx *tets,
                        size_t tet_count, tl_mesh **mesh)
{
    *mesh = NULL;
    tl_status st = check_counts(ctx, xyz, vert_count, tets, tet_count);
    if (!st) st = check_indices(ctx, tets, tet_count, vert_count);
    tl_mesh *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    made->ctx = ctx;
    made->vert_count = vert_count;
    made->tet_count = tet_count;
    made->xyz = xyz;
    made->tets = tets;
    made->time = (double)NAN;
    *mesh = made;
    return TL_OK;
}

tl_status tl_mesh_create(tl_ctx *ctx, const double *xyz, size_t vert_count, const tl_lidx *tets,
                         size_t tet_count, tl_mesh **mesh)
{
    *mesh = NULL;
    tl_status st = check_counts(ctx, xyz, vert_count, tets, tet_count);
    double *own_xyz = tl_mem_alloc(ctx, vert_count, 3 * sizeof *xyz, &st);
    tl_lidx *own_tets = tl_mem_alloc(ctx, tet_count, 4 * sizeof *tets, &st);
    if (!st) {
        if (vert_count) memcpy(own_xyz, xyz, vert_count * 3 * sizeof *xyz);
        if (tet_count) memcpy(own_tets, tets, tet_count * 4 * sizeof *tets);
        st = tl_mesh_adopt(ctx, own_xyz, vert_count, own_tets, tet_count, mesh);
    }
    if (st) {
        tl_mem_free(ctx, own_tets);
        tl_mem_free(ctx, own_xyz);
    }
    return st;
}

tl_status tl_mesh_set_regions(tl_mesh *mesh, const int32_t *regions)
{
    tl_status st = TL_OK;
    int32_t *own = NULL;
    if (regions) {
        own = tl_mem_alloc(mesh->ctx, mesh->tet_count, sizeof *own, &st);
        if (st) return st;
        if (mesh->tet_count) memcpy(own, regions, mesh->tet_count * sizeof *own);
    }
    tl_mem_free(mesh->ctx, mesh->regions);
    mesh->regions = own;
    return TL_OK;
}

void tl_mesh_set_time(tl_mesh *mesh, double time)
{
    mesh->time = time;
}

tl_ctx *tl_mesh_ctx(const tl_mesh *mesh)
{
    return mesh->ctx;
}

size_t tl_mesh_vert_count(const tl_mesh *mesh)
{
    return mesh->vert_count;
}

size_t tl_mesh_tet_count(const tl_mesh *mesh)
{
    return mesh->tet_count;
}

const double *tl_mesh_xyz(const tl_mesh *mesh)
{
    return mesh->xyz;
}

const tl_lidx *tl_mesh_tets(const tl_mesh *mesh)
{
    return mesh->tets;
}

const int32_t *tl_mesh_regions(const tl_mesh *mesh)
{
    return mesh->regions;
}

double tl_mesh_time(const tl_mesh *mesh)
{
    return mesh->time;
}
