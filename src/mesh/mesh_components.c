/* Components connected over faces, by union-find over the tets. The root of a component is its
 * first tet, so numbers follow from one pass. */
#include "mesh/mesh.h"

static tl_lidx root_of(tl_lidx *parent, tl_lidx t)
{
    while (parent[t] != t) {
        parent[t] = parent[parent[t]];
        t = parent[t];
    }
    return t;
}

static size_t number_components(const tl_lidx *opposite, size_t tet_count, tl_lidx *parent)
{
    for (size_t t = 0; t < tet_count; t++) {
        parent[t] = (tl_lidx)t;
        for (size_t i = 4 * t; i < 4 * t + 4; i++) {
            /* Each pair once, when both have a parent. */
            if (opposite[i] == TL_NONE || opposite[i] / 4 >= t) continue;
            tl_lidx a = root_of(parent, (tl_lidx)t), b = root_of(parent, opposite[i] / 4);
            if (a < b)
                parent[b] = a;
            else
                parent[a] = b;
        }
    }
    size_t count = 0;
    /* A parent comes before its child, so it is a number already. */
    for (size_t t = 0; t < tet_count; t++)
        parent[t] = parent[t] == t ? (tl_lidx)count++ : parent[parent[t]];
    return count;
}

tl_status tl_mesh_components(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                             tl_lidx **component, size_t *component_count)
{
    if (component) *component = NULL;
    *component_count = 0;
    tl_lidx *own_opposite = NULL;
    tl_status st = opposite ? TL_OK : tl_mesh_adjacency(ctx, mesh, &own_opposite, NULL);
    tl_lidx *numbers = tl_mem_alloc(ctx, mesh->tet_count, sizeof *numbers, &st);
    if (!st)
        *component_count =
            number_components(opposite ? opposite : own_opposite, mesh->tet_count, numbers);
    tl_mem_free(ctx, own_opposite);
    if (!st && component)
        *component = numbers;
    else
        tl_mem_free(ctx, numbers);
    return st;
}
